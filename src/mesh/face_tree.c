/* A box is halved at the median of its faces' middles along its longest side, so that the tree is as deep as
 * the logarithm of their number, however unevenly they lie. */
#include "mesh/face_tree.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

enum { LEAF = 4, DEEPEST = 64 };

typedef struct node {
    vshi_vec low, high;
    uint32_t begin, count; /* of a leaf's faces; count 0: */
    uint32_t right;        /* the right child; the left one follows its parent */
} node;

struct vshi_face_tree {
    const vshi_face *faces;
    vshi_face_corners_fn *corners;
    const void *user;
    node *nodes;
    size_t count;
};

typedef struct building {
    vshi_face_tree *tree;
    vshi_face *faces;
    float (*middle)[3]; /* of the faces */
} building;

/* The C library's fmin() and fmax() are calls, and took a third of the time. */
static double lower(double a, double b) {
    return a < b ? a : b;
}

static double upper(double a, double b) {
    return a > b ? a : b;
}

static void grow(vshi_vec *low, vshi_vec *high, vshi_vec p) {
    *low = (vshi_vec){lower(low->x, p.x), lower(low->y, p.y), lower(low->z, p.z)};
    *high = (vshi_vec){upper(high->x, p.x), upper(high->y, p.y), upper(high->z, p.z)};
}

static void swap(building *b, size_t i, size_t k) {
    const vshi_face face = b->faces[i];
    b->faces[i] = b->faces[k];
    b->faces[k] = face;
    for (int axis = 0; axis < 3; ++axis) {
        const float at = b->middle[i][axis];
        b->middle[i][axis] = b->middle[k][axis];
        b->middle[k][axis] = at;
    }
}

static int longest_side(const building *b, size_t begin, size_t end) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = begin; i < end; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const float at = b->middle[i][axis];
            low[axis] = at < low[axis] ? at : low[axis];
            high[axis] = at > high[axis] ? at : high[axis];
        }
    }
    int best = 0;
    for (int axis = 1; axis < 3; ++axis) {
        best = high[axis] - low[axis] > high[best] - low[best] ? axis : best;
    }
    return best;
}

/* Puts the face that is `nth` along the axis into its place, the nearer ones before it (C. A. R. Hoare,
 * "Algorithm 65: find", 1961). */
static void select_nth(building *b, size_t begin, size_t end, size_t nth, int axis) {
    while (end - begin > 1) {
        const float pivot = b->middle[begin + (end - begin) / 2][axis];
        size_t i = begin, k = end - 1;
        for (;;) {
            while (b->middle[i][axis] < pivot) {
                ++i;
            }
            while (b->middle[k][axis] > pivot) {
                --k;
            }
            if (i >= k) {
                break;
            }
            swap(b, i++, k--);
        }
        const size_t split = i == k ? i + 1 : i; /* those before it are no farther than the pivot */
        if (nth < split && split < end) {
            end = split;
        } else if (nth >= split) {
            begin = split;
        } else {
            return; /* all the same */
        }
    }
}

static size_t build(building *b, size_t begin, size_t end) {
    vshi_face_tree *tree = b->tree;
    const size_t place = tree->count++;
    node made = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, (uint32_t)begin, 0, 0};
    if (end - begin <= LEAF) {
        made.count = (uint32_t)(end - begin);
        for (size_t i = begin; i < end; ++i) {
            vshi_vec corner[3];
            tree->corners(tree->user, b->faces[i], corner);
            for (int k = 0; k < 3; ++k) {
                grow(&made.low, &made.high, corner[k]);
            }
        }
    } else {
        const size_t middle = begin + (end - begin) / 2;
        select_nth(b, begin, end, middle, longest_side(b, begin, end));
        const size_t left = build(b, begin, middle);
        made.right = (uint32_t)build(b, middle, end);
        for (size_t i = 0; i < 2; ++i) {
            const node *child = &tree->nodes[i == 0 ? left : made.right];
            grow(&made.low, &made.high, child->low);
            grow(&made.low, &made.high, child->high);
        }
    }
    tree->nodes[place] = made;
    return place;
}

vsh_result vshi_face_tree_create(vshi_face *faces, size_t count, vshi_face_corners_fn *corners,
                                 const void *user, vshi_face_tree **made, vsh_error *error) {
    building b = {.faces = faces};
    vshi_face_tree *tree = NULL;
    *made = NULL;
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&tree, 1, sizeof *tree, "faces", error));
    *tree = (vshi_face_tree){.faces = faces, .corners = corners, .user = user};
    VSHI_TRY_DONE(vshi_allocate((void **)&b.middle, count, sizeof *b.middle, "faces", error));
    /* halves hold more than half of LEAF each */
    VSHI_TRY_DONE(vshi_allocate((void **)&tree->nodes, count + 1, sizeof *tree->nodes, "faces", error));
    b.tree = tree;
    for (size_t i = 0; i < count; ++i) {
        vshi_vec corner[3];
        corners(user, faces[i], corner);
        const vshi_vec sum = vshi_add(corner[0], vshi_add(corner[1], corner[2]));
        b.middle[i][0] = (float)sum.x;
        b.middle[i][1] = (float)sum.y;
        b.middle[i][2] = (float)sum.z;
    }
    if (count > 0) {
        build(&b, 0, count);
    }
    *made = tree;
    tree = NULL;
done:
    free(b.middle);
    vshi_face_tree_free(tree);
    return result;
}

void vshi_face_tree_free(vshi_face_tree *tree) {
    if (tree == NULL) {
        return;
    }
    free(tree->nodes);
    free(tree);
}

/* --- segments */

typedef struct segment {
    vshi_vec from, along, over; /* over: 1 / along; infinite where that is 0 */
} segment;

static bool clip(double low, double high, double from, double over, double *begin, double *end) {
    if (isinf(over)) {
        return low <= from && from <= high;
    }
    const double a = (low - from) * over, b = (high - from) * over;
    *begin = upper(*begin, lower(a, b));
    *end = lower(*end, upper(a, b));
    return *begin <= *end;
}

/* Of a segment, to both sides: far above rounding, for a face that lies in its box's side. */
static const double ROOM = 1e-9;

static bool meets(const node *n, const segment *s) {
    double begin = -ROOM, end = 1.0 + ROOM;
    return clip(n->low.x, n->high.x, s->from.x, s->over.x, &begin, &end) &&
           clip(n->low.y, n->high.y, s->from.y, s->over.y, &begin, &end) &&
           clip(n->low.z, n->high.z, s->from.z, s->over.z, &begin, &end);
}

/* On which side of the line through a and b a segment passes: turned about, exactly the opposite, so that
 * none passes between two faces at an edge. */
static double passes(const segment *s, vshi_vec a, vshi_vec b) {
    return vshi_dot(s->along, vshi_cross(vshi_sub(a, s->from), vshi_sub(b, s->from)));
}

static bool crosses(const segment *s, const vshi_vec corner[3], vshi_face_crossing *crossing) {
    const double w[3] = {passes(s, corner[1], corner[2]), passes(s, corner[2], corner[0]),
                         passes(s, corner[0], corner[1])};
    if ((w[0] < 0.0 || w[1] < 0.0 || w[2] < 0.0) && (w[0] > 0.0 || w[1] > 0.0 || w[2] > 0.0)) {
        return false;
    }
    const double sum = w[0] + w[1] + w[2];
    if (sum == 0.0) {
        return false;
    }
    const vshi_vec normal = vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0]));
    const double speed = vshi_dot(normal, s->along);
    if (speed == 0.0) {
        return false;
    }
    crossing->at = vshi_dot(normal, vshi_sub(corner[0], s->from)) / speed;
    crossing->out = speed > 0.0 ? 1 : -1;
    return crossing->at >= 0.0 && crossing->at <= 1.0;
}

/* Into one comes before out of one in the same place, so that no order in which they are found shows. */
static bool before(const vshi_face_crossing *a, const vshi_face_crossing *b) {
    if (a->at != b->at) {
        return a->at < b->at;
    }
    return a->out != b->out ? a->out < b->out : a->component < b->component;
}

static size_t put(vshi_face_crossing *crossings, size_t count, size_t most, vshi_face_crossing one) {
    if (count == most) {
        if (!before(&one, &crossings[count - 1])) {
            return count;
        }
        --count;
    }
    size_t i = count;
    for (; i > 0 && before(&one, &crossings[i - 1]); --i) {
        crossings[i] = crossings[i - 1];
    }
    crossings[i] = one;
    return count + 1;
}

size_t vshi_face_tree_cross(const vshi_face_tree *tree, vshi_vec from, vshi_vec to,
                            vshi_face_crossing *crossings, size_t most) {
    const vshi_vec along = vshi_sub(to, from);
    const segment s = {from, along, {1.0 / along.x, 1.0 / along.y, 1.0 / along.z}};
    uint32_t waiting[DEEPEST];
    size_t depth = 0, found = 0;
    if (tree->count > 0) {
        waiting[depth++] = 0;
    }
    while (depth > 0) {
        const uint32_t at = waiting[--depth];
        const node *n = &tree->nodes[at];
        if (!meets(n, &s)) {
            continue;
        }
        if (n->count == 0) {
            waiting[depth++] = n->right;
            waiting[depth++] = at + 1;
        }
        for (uint32_t i = n->begin; i < n->begin + n->count; ++i) {
            vshi_vec corner[3];
            vshi_face_crossing one = {0.0, tree->faces[i].component, 0};
            tree->corners(tree->user, tree->faces[i], corner);
            if (crosses(&s, corner, &one)) {
                found = put(crossings, found, most, one);
            }
        }
    }
    return found;
}
