#define _GNU_SOURCE /* qsort_r */
#include "shapes/outline.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const size_t MAX_POINTS = (size_t)1 << 31;
/* Peak bytes of an outline for each of its points: points, tree, and cuts. */
static const double BYTES_PER_POINT = 96.0;

/* --- contours */

void vshi_contours_free(vshi_contours *c) {
    free(c->points);
    free(c->starts);
    c->points = NULL;
    c->starts = NULL;
    c->point_count = c->point_capacity = c->contour_count = c->contour_capacity = 0;
}

static bool fails(vshi_contours *c, vsh_result result) {
    c->result = c->result == VSH_OK ? result : c->result;
    return result != VSH_OK;
}

/* Makes room for one more element of an array. The memory limit counts `bytes` for each element. Returns
 * false, and sets contours->result, if there is no room. */
static bool make_room(vshi_contours *c, void **array, size_t size, size_t count, size_t *capacity,
                      double bytes) {
    if (count < *capacity) {
        return true;
    }
    if (*capacity > MAX_POINTS) {
        return !fails(c, vshi_fail(c->error, VSH_ERROR_LIMIT, "outline: more than %zu points", MAX_POINTS));
    }
    return !fails(c, vshi_check_limit(c->run, bytes * 2.0 * (double)*capacity, "outline", c->error)) &&
           !fails(c, vshi_make_room(array, count, capacity, size, "outline", c->error));
}

static size_t contour_begin(const vshi_contours *c) {
    return c->contour_count > 0 ? c->starts[c->contour_count] : 0;
}

void vshi_contours_add(vshi_contours *c, double x, double y) {
    if (c->result != VSH_OK || !make_room(c, (void **)&c->points, sizeof *c->points, c->point_count,
                                          &c->point_capacity, BYTES_PER_POINT)) {
        return;
    }
    if (!(fabs(x) <= VSHI_OUTLINE_LARGEST && fabs(y) <= VSHI_OUTLINE_LARGEST)) {
        fails(c, vshi_fail(c->error, VSH_ERROR_INPUT,
                           "outline: a point at (%.9g, %.9g): expected at most %g in size", x, y,
                           VSHI_OUTLINE_LARGEST));
        return;
    }
    if (c->point_count > contour_begin(c)) {
        const vshi_point last = c->points[c->point_count - 1];
        if (last.x == x && last.y == y) {
            return;
        }
    }
    c->points[c->point_count++] = (vshi_point){x, y};
}

void vshi_contours_close(vshi_contours *c) {
    const size_t begin = contour_begin(c);
    if (c->result != VSH_OK || c->point_count == begin) {
        return;
    }
    const vshi_point start = c->points[begin], last = c->points[c->point_count - 1];
    const bool closed = start.x == last.x && start.y == last.y;
    if (c->point_count - begin - (closed ? 1 : 0) < 3) {
        c->point_count = begin;
        return;
    }
    if (!closed) {
        vshi_contours_add(c, start.x, start.y);
    }
    const size_t starts = c->contour_count > 0 ? c->contour_count + 1 : 0;
    if (c->result != VSH_OK || !make_room(c, (void **)&c->starts, sizeof *c->starts, starts,
                                          &c->contour_capacity, BYTES_PER_POINT)) {
        return;
    }
    c->starts[0] = 0;
    c->starts[++c->contour_count] = (uint32_t)c->point_count;
    if (c->point_count > MAX_POINTS) {
        fails(c, vshi_fail(c->error, VSH_ERROR_LIMIT, "outline: more than %zu points", MAX_POINTS));
    }
}

enum { LEAF_SEGMENTS = 4 };

/* --- growing a tree */

/* A contour while the tree above the contours is built. */
typedef struct item {
    double middle[2];
    uint32_t contour;
} item;

static int by_middle(const void *a, const void *b, void *axis) {
    const item *p = a, *q = b;
    const double x = p->middle[*(const int *)axis], y = q->middle[*(const int *)axis];
    return x != y ? (x < y ? -1 : 1) : (p->contour > q->contour) - (p->contour < q->contour);
}

static void grow_box(double low[2], double high[2], vshi_point p) {
    low[0] = fmin(low[0], p.x);
    low[1] = fmin(low[1], p.y);
    high[0] = fmax(high[0], p.x);
    high[1] = fmax(high[1], p.y);
}

static void join_children(vsh_outline *o, vshi_outline_node *node) {
    const vshi_outline_node *child = &o->nodes[node->children];
    for (int axis = 0; axis < 2; ++axis) {
        node->low[axis] = fmin(child[0].low[axis], child[1].low[axis]);
        node->high[axis] = fmax(child[0].high[axis], child[1].high[axis]);
    }
}

static void grow_chain(vsh_outline *o, size_t index, uint32_t first, uint32_t count) {
    vshi_outline_node *node = &o->nodes[index];
    node->first = first;
    node->count = count;
    if (count <= LEAF_SEGMENTS) {
        node->children = 0;
        node->low[0] = node->low[1] = INFINITY;
        node->high[0] = node->high[1] = -INFINITY;
        for (uint32_t i = 0; i <= count; ++i) {
            grow_box(node->low, node->high, o->points[first + i]);
        }
        return;
    }
    const uint32_t leaves = (count + LEAF_SEGMENTS - 1) / LEAF_SEGMENTS;
    const uint32_t left = leaves / 2 * LEAF_SEGMENTS;
    node->children = (uint32_t)o->node_count;
    o->node_count += 2;
    grow_chain(o, node->children, first, left);
    grow_chain(o, node->children + 1U, first + left, count - left);
    join_children(o, node);
}

static void grow_space(vsh_outline *o, size_t index, item *items, size_t count) {
    if (count == 1) {
        const uint32_t start = o->starts[items->contour];
        grow_chain(o, index, start, o->starts[items->contour + 1] - start - 1);
        return;
    }
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (size_t i = 0; i < count; ++i) {
        grow_box(low, high, (vshi_point){items[i].middle[0], items[i].middle[1]});
    }
    int axis = high[0] - low[0] >= high[1] - low[1] ? 0 : 1;
    qsort_r(items, count, sizeof *items, by_middle, &axis);
    vshi_outline_node *node = &o->nodes[index];
    node->first = node->count = 0;
    node->children = (uint32_t)o->node_count;
    o->node_count += 2;
    grow_space(o, node->children, items, count / 2);
    grow_space(o, node->children + 1U, items + count / 2, count - count / 2);
    join_children(o, node);
}

/* Builds the tree over points and starts. */
static vsh_result grow_tree(vsh_outline *o, vsh_error *error) {
    size_t leaves = 0;
    for (size_t c = 0; c < o->contour_count; ++c) {
        leaves += (o->starts[c + 1] - o->starts[c] - 1 + LEAF_SEGMENTS - 1) / LEAF_SEGMENTS;
    }
    item *items;
    VSHI_TRY(vshi_allocate((void **)&o->nodes, 2 * leaves, sizeof *o->nodes, "outline", error));
    VSHI_TRY(vshi_allocate((void **)&items, o->contour_count, sizeof *items, "outline", error));
    for (size_t c = 0; c < o->contour_count; ++c) {
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (uint32_t i = o->starts[c]; i < o->starts[c + 1]; ++i) {
            grow_box(low, high, o->points[i]);
        }
        items[c] = (item){{0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])}, (uint32_t)c};
    }
    o->node_count = 1;
    grow_space(o, 0, items, o->contour_count);
    free(items);
    return VSH_OK;
}

/* --- queries */

static double box_square(const vshi_outline_node *node, vshi_point p) {
    const double x = fmax(fmax(node->low[0] - p.x, p.x - node->high[0]), 0.0);
    const double y = fmax(fmax(node->low[1] - p.y, p.y - node->high[1]), 0.0);
    return x * x + y * y;
}

static double segment_square(vshi_point a, vshi_point b, vshi_point p) {
    const double dx = b.x - a.x, dy = b.y - a.y, px = p.x - a.x, py = p.y - a.y;
    const double square = dx * dx + dy * dy;
    double t = square > 0.0 ? (px * dx + py * dy) / square : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    const double x = px - t * dx, y = py - t * dy;
    return x * x + y * y;
}

double vshi_outline_square(const vsh_outline *o, vshi_point p, double bound) {
    double best = bound;
    struct {
        uint32_t node;
        double square;
    } stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top].node = 0;
    stack[top++].square = box_square(&o->nodes[0], p);
    while (top > 0) {
        --top;
        if (stack[top].square >= best) {
            continue;
        }
        const vshi_outline_node *node = &o->nodes[stack[top].node];
        if (node->children == 0) {
            for (uint32_t i = node->first; i < node->first + node->count; ++i) {
                const double square = segment_square(o->points[i], o->points[i + 1], p);
                best = square < best ? square : best;
            }
            continue;
        }
        const uint32_t left = node->children;
        const double squares[2] = {box_square(&o->nodes[left], p), box_square(&o->nodes[left + 1], p)};
        const uint32_t near = squares[1] < squares[0];
        stack[top].node = left + 1 - near;
        stack[top++].square = squares[1 - near];
        stack[top].node = left + near;
        stack[top++].square = squares[near];
    }
    return best;
}

/* The winding of a way from a to b around a point at height y to its left, by the half-open rule. */
static int64_t count_crossing(vshi_point a, vshi_point b, double y) {
    return (a.y <= y && b.y > y) - (a.y > y && b.y <= y);
}

int64_t vshi_outline_winding(const vsh_outline *o, vshi_point p) {
    int64_t winding = 0;
    uint32_t stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const vshi_outline_node *node = &o->nodes[stack[--top]];
        if (p.y < node->low[1] || p.y >= node->high[1] || p.x >= node->high[0]) {
            continue;
        }
        if (p.x < node->low[0]) { /* all to the right: whole contours add nothing, chains by their ends */
            winding += node->count == 0 ? 0
                                        : count_crossing(o->points[node->first],
                                                         o->points[node->first + node->count], p.y);
            continue;
        }
        if (node->children != 0) {
            stack[top++] = node->children + 1;
            stack[top++] = node->children;
            continue;
        }
        for (uint32_t i = node->first; i < node->first + node->count; ++i) {
            const vshi_point a = o->points[i], b = o->points[i + 1];
            const int64_t crosses = count_crossing(a, b, p.y);
            if (crosses != 0) {
                const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
                winding += crosses > 0 ? side > 0.0 : -(side < 0.0);
            }
        }
    }
    return winding;
}

/* --- the border of the filled area: contours are cut where they cross. Pieces with one side inside are kept
 * and joined again. Time is quadratic at worst, and near-linear if few contours cross, as in letters. */

/* Distance from a piece's middle to the test points on its sides: shares of the piece's length and, against
 * rounding, of the outline's size. */
static const double SIDE_OF_LENGTH = 1e-4;
static const double SIDE_OF_SIZE = 1e-13;

/* A cut of a segment. */
typedef struct cut {
    uint32_t segment;
    double along;
    vshi_point point;
} cut;

typedef struct piece {
    vshi_point from, to;
    bool used;
} piece;

typedef struct work {
    const vsh_outline *outline;
    cut *cuts;
    size_t cut_count, cut_capacity;
    piece *pieces;
    size_t piece_count, piece_capacity;
    vshi_contours *result;
} work;

static bool same(vshi_point a, vshi_point b) {
    return a.x == b.x && a.y == b.y;
}

static int compare(vshi_point a, vshi_point b) {
    if (a.x != b.x) {
        return a.x < b.x ? -1 : 1;
    }
    return (a.y > b.y) - (a.y < b.y);
}

static double turn(vshi_point a, vshi_point b, vshi_point p) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

static bool add_cut(work *w, uint32_t segment, vshi_point point) {
    const vshi_point a = w->outline->points[segment], b = w->outline->points[segment + 1];
    if (same(point, a) || same(point, b)) {
        return true;
    }
    if (!make_room(w->result, (void **)&w->cuts, sizeof *w->cuts, w->cut_count, &w->cut_capacity,
                   sizeof *w->cuts)) {
        return false;
    }
    const double along = (point.x - a.x) * (b.x - a.x) + (point.y - a.y) * (b.y - a.y);
    w->cuts[w->cut_count++] = (cut){segment, along, point};
    return true;
}

/* Whether a point on a segment's line lies between its ends. */
static bool between(vshi_point a, vshi_point b, vshi_point p) {
    return p.x >= fmin(a.x, b.x) && p.x <= fmax(a.x, b.x) && p.y >= fmin(a.y, b.y) && p.y <= fmax(a.y, b.y);
}

/* The crossing of two segments. Their order and sense do not change its bits, so contours on top of each
 * other are cut alike. */
static vshi_point meet(vshi_point a, vshi_point b, vshi_point c, vshi_point d) {
    const bool ab = compare(a, b) < 0, cd = compare(c, d) < 0;
    const vshi_point ends[2][2] = {{ab ? a : b, ab ? b : a}, {cd ? c : d, cd ? d : c}};
    const int order = compare(ends[0][0], ends[1][0]);
    const int first = order != 0 ? order > 0 : compare(ends[0][1], ends[1][1]) > 0;
    const vshi_point from = ends[first][0], to = ends[first][1], *other = ends[1 - first];
    const double before = turn(other[0], other[1], from), after = turn(other[0], other[1], to);
    const double t = before / (before - after);
    return (vshi_point){from.x + t * (to.x - from.x), from.y + t * (to.y - from.y)};
}

/* Cuts both segments of a pair where they meet: the same point for both. */
static bool cut_pair(work *w, uint32_t i, uint32_t k) {
    const vshi_point *s = w->outline->points;
    const vshi_point a = s[i], b = s[i + 1], c = s[k], d = s[k + 1];
    const double ta = turn(c, d, a), tb = turn(c, d, b), tc = turn(a, b, c), td = turn(a, b, d);
    if (((ta > 0.0 && tb < 0.0) || (ta < 0.0 && tb > 0.0)) &&
        ((tc > 0.0 && td < 0.0) || (tc < 0.0 && td > 0.0))) {
        const vshi_point meeting = meet(a, b, c, d);
        return add_cut(w, i, meeting) && add_cut(w, k, meeting);
    }
    bool going = true;
    going = going && (ta != 0.0 || !between(c, d, a) || add_cut(w, k, a));
    going = going && (tb != 0.0 || !between(c, d, b) || add_cut(w, k, b));
    going = going && (tc != 0.0 || !between(a, b, c) || add_cut(w, i, c));
    return going && (td != 0.0 || !between(a, b, d) || add_cut(w, i, d));
}

/* Cuts segment i with segments of higher numbers. */
static bool cut_segment(work *w, uint32_t i) {
    const vsh_outline *o = w->outline;
    const vshi_point a = o->points[i], b = o->points[i + 1];
    const double low[2] = {fmin(a.x, b.x), fmin(a.y, b.y)}, high[2] = {fmax(a.x, b.x), fmax(a.y, b.y)};
    uint32_t stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const vshi_outline_node *node = &o->nodes[stack[--top]];
        if (low[0] > node->high[0] || high[0] < node->low[0] || low[1] > node->high[1] ||
            high[1] < node->low[1] || (node->count > 0 && node->first + node->count <= i + 1)) {
            continue;
        }
        if (node->children != 0) {
            stack[top++] = node->children + 1;
            stack[top++] = node->children;
            continue;
        }
        for (uint32_t k = node->first; k < node->first + node->count; ++k) {
            if (k > i && !cut_pair(w, i, k)) {
                return false;
            }
        }
    }
    return true;
}

static int by_place(const void *a, const void *b) {
    const cut *p = a, *q = b;
    if (p->segment != q->segment) {
        return p->segment < q->segment ? -1 : 1;
    }
    return (p->along > q->along) - (p->along < q->along);
}

/* Keeps a piece if just one of its sides is inside, and turns it so that the inside is on its left. */
static bool add_piece(work *w, vshi_point a, vshi_point b) {
    const double dx = b.x - a.x, dy = b.y - a.y, length = vshi_hypot(dx, dy);
    if (!(length > 0.0)) {
        return true;
    }
    const vshi_outline_node *root = &w->outline->nodes[0];
    const double size =
        fmax(fmax(fabs(root->low[0]), fabs(root->high[0])), fmax(fabs(root->low[1]), fabs(root->high[1])));
    const double step = fmax(SIDE_OF_LENGTH * length, SIDE_OF_SIZE * size) / length;
    const vshi_point middle = {0.5 * (a.x + b.x), 0.5 * (a.y + b.y)};
    const vshi_point left = {middle.x - step * dy, middle.y + step * dx};
    const vshi_point right = {middle.x + step * dy, middle.y - step * dx};
    const bool in_left = vshi_outline_winding(w->outline, left) != 0;
    const bool in_right = vshi_outline_winding(w->outline, right) != 0;
    if (in_left == in_right) {
        return true;
    }
    if (!make_room(w->result, (void **)&w->pieces, sizeof *w->pieces, w->piece_count, &w->piece_capacity,
                   sizeof *w->pieces)) {
        return false;
    }
    w->pieces[w->piece_count++] = in_left ? (piece){a, b, false} : (piece){b, a, false};
    return true;
}

static bool cut_all(work *w) {
    const vsh_outline *o = w->outline;
    for (size_t c = 0; c < o->contour_count; ++c) {
        for (uint32_t i = o->starts[c]; i + 1 < o->starts[c + 1]; ++i) {
            if (!cut_segment(w, i)) {
                return false;
            }
        }
    }
    if (w->cut_count > 0) {
        qsort(w->cuts, w->cut_count, sizeof *w->cuts, by_place);
    }
    size_t at = 0;
    for (size_t c = 0; c < o->contour_count; ++c) {
        for (uint32_t i = o->starts[c]; i + 1 < o->starts[c + 1]; ++i) {
            vshi_point from = o->points[i];
            for (; at < w->cut_count && w->cuts[at].segment == i; ++at) {
                if (!add_piece(w, from, w->cuts[at].point)) {
                    return false;
                }
                from = w->cuts[at].point;
            }
            if (!add_piece(w, from, o->points[i + 1])) {
                return false;
            }
        }
    }
    return true;
}

static int by_ends(const void *a, const void *b) {
    const piece *p = a, *q = b;
    const int order = compare(p->from, q->from);
    return order != 0 ? order : compare(p->to, q->to);
}

/* Finds the first unused piece that begins at a point; NULL if there is none. */
static piece *find(const work *w, vshi_point from) {
    size_t low = 0, high = w->piece_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (compare(w->pieces[middle].from, from) < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    for (; low < w->piece_count && same(w->pieces[low].from, from); ++low) {
        if (!w->pieces[low].used) {
            return &w->pieces[low];
        }
    }
    return NULL;
}

static bool join(work *w) {
    if (w->piece_count > 0) {
        qsort(w->pieces, w->piece_count, sizeof *w->pieces, by_ends);
    }
    for (size_t i = 1; i < w->piece_count; ++i) { /* contours that share a line have duplicates */
        w->pieces[i].used =
            same(w->pieces[i].from, w->pieces[i - 1].from) && same(w->pieces[i].to, w->pieces[i - 1].to);
    }
    for (size_t i = 0; i < w->piece_count; ++i) {
        if (w->pieces[i].used) {
            continue;
        }
        const vshi_point start = w->pieces[i].from;
        piece *at = &w->pieces[i];
        do {
            vshi_contours_add(w->result, at->from.x, at->from.y);
            at->used = true;
            if (same(at->to, start)) {
                break;
            }
            at = find(w, at->to);
        } while (at != NULL);
        if (at == NULL) {
            return false;
        }
        vshi_contours_close(w->result);
    }
    return true;
}

/* Cuts the contours of `outline` where they cross, and adds the borders of the area to `result`, with the
 * area on their left. Returns false, with a useless result, if rounding leaves ends that fit nothing: some
 * contours touch along nearly the same line. */
static bool resolve_contours(const vsh_outline *outline, vshi_contours *result) {
    work w = {.outline = outline, .result = result};
    const bool fits = cut_all(&w) && join(&w);
    free(w.pieces);
    free(w.cuts);
    return fits;
}

/* --- outlines */

/* Twice the area, measured from the contour's first point to lose little far from the origin. */
static double contour_area(const vshi_point *points, size_t count) {
    double sum = 0.0;
    for (size_t i = 1; i + 1 < count; ++i) {
        const vshi_point o = points[0], a = points[i], b = points[i + 1];
        sum += (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
    }
    return sum;
}

static double area_of(const vsh_outline *o) {
    double sum = 0.0;
    for (size_t c = 0; c < o->contour_count; ++c) {
        sum += contour_area(o->points + o->starts[c], o->starts[c + 1] - o->starts[c]);
    }
    return 0.5 * sum;
}

/* Reverses all contours if that puts the area on their left. */
static void orient(vsh_outline *o) {
    o->area = area_of(o);
    if (o->area >= 0.0) {
        return;
    }
    o->area = -o->area;
    for (size_t c = 0; c < o->contour_count; ++c) {
        for (size_t i = o->starts[c], k = o->starts[c + 1] - 1; i < k; ++i, --k) {
            const vshi_point swapped = o->points[i];
            o->points[i] = o->points[k];
            o->points[k] = swapped;
        }
    }
}

/* Makes an outline that owns the contours' arrays, and its tree. *outline stays NULL if there are no
 * contours. */
static vsh_result make(vshi_contours *c, vsh_outline **outline) {
    vsh_outline *made = NULL;
    vsh_result result;
    VSHI_TRY_DONE(c->result);
    if (c->contour_count == 0) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "outline", c->error));
    made->points = c->points;
    made->starts = c->starts;
    made->contour_count = c->contour_count;
    c->points = NULL;
    c->starts = NULL;
    orient(made);
    VSHI_TRY_DONE(grow_tree(made, c->error));
    *outline = made;
    made = NULL;
done:
    vsh_outline_free(made);
    vshi_contours_free(c);
    return result;
}

/* Replaces an outline by one whose contours neither cross nor overlap, unless rounding prevents it. */
static vsh_result resolve(vshi_contours *c, vsh_outline **outline) {
    vshi_contours resolved = {.run = c->run, .error = c->error};
    const bool fits = resolve_contours(*outline, &resolved);
    if (resolved.result == VSH_OK && !fits) {
        vshi_contours_free(&resolved);
        return VSH_OK;
    }
    vsh_outline_free(*outline);
    *outline = NULL;
    return make(&resolved, outline);
}

vsh_result vshi_contours_finish(vshi_contours *c, bool clean, const char *what, vsh_outline **outline) {
    *outline = NULL;
    VSHI_TRY(make(c, outline));
    if (*outline != NULL && !clean) {
        VSHI_TRY(resolve(c, outline));
    }
    if (*outline == NULL || !((*outline)->area > 0.0)) {
        vsh_outline_free(*outline);
        *outline = NULL;
        return vshi_fail(c->error, VSH_ERROR_INPUT, "%s: has no outline: nothing in it is solid", what);
    }
    return VSH_OK;
}

void vsh_outline_free(vsh_outline *o) {
    if (o == NULL) {
        return;
    }
    free(o->nodes);
    free(o->starts);
    free(o->points);
    free(o);
}

vsh_result vsh_outline_from_polygons(const double *points, const size_t *counts, size_t contour_count,
                                     const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(outline);
    VSHI_NEEDS_OF(contour_count, points);
    VSHI_NEEDS_OF(contour_count, counts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_contours contours = {.run = &full, .error = error};
    for (size_t c = 0; c < contour_count; ++c) {
        for (size_t i = 0; i < counts[c]; ++i, points += 2) {
            vshi_contours_add(&contours, points[0], points[1]);
        }
        vshi_contours_close(&contours);
    }
    return vshi_contours_finish(&contours, false, "polygons", outline);
}

vsh_result vshi_outline_unite(const vshi_outline_instance *instances, size_t instance_count,
                              const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(outline);
    static const double identity[6] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    vshi_contours contours = {.run = run, .error = error};
    for (size_t i = 0; i < instance_count; ++i) {
        const vsh_outline *o = instances[i].outline;
        const double *m = instances[i].transform != NULL ? instances[i].transform : identity;
        const double determinant = m[0] * m[4] - m[1] * m[3];
        if (!isfinite(determinant) || determinant == 0.0 || !isfinite(m[2]) || !isfinite(m[5])) {
            vshi_contours_free(&contours);
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "instance %zu: a transform that flattens or is not finite", i);
        }
        for (size_t c = 0; c < o->contour_count; ++c) {
            /* a mirrored contour is reversed, so that its area winds the same way as the others */
            const size_t begin = o->starts[c], end = o->starts[c + 1] - 1;
            for (size_t k = begin; k < end; ++k) {
                const vshi_point p = o->points[determinant > 0.0 ? k : end - (k - begin)];
                vshi_contours_add(&contours, m[0] * p.x + m[1] * p.y + m[2], m[3] * p.x + m[4] * p.y + m[5]);
            }
            vshi_contours_close(&contours);
        }
    }
    return vshi_contours_finish(&contours, instance_count == 1, "outlines", outline);
}

void vshi_outline_get_info(const vsh_outline *o, vshi_outline_info *info) {
    const size_t points = o->starts[o->contour_count];
    vshi_outline_info found = {.contours = o->contour_count,
                               .points = points - o->contour_count,
                               .area = o->area,
                               .bytes = points * sizeof *o->points + o->node_count * sizeof *o->nodes +
                                        (o->contour_count + 1) * sizeof *o->starts + sizeof *o};
    memcpy(found.bounds_min, o->nodes[0].low, sizeof found.bounds_min);
    memcpy(found.bounds_max, o->nodes[0].high, sizeof found.bounds_max);
    *info = found;
}
