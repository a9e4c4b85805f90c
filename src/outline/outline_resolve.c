/* The border of what contours wind around: cut where they cross, kept where one side only is inside, joined
 * again. Quadratic at worst, near-linear where few contours cross, as letters do. */
#include "base/elementary.h"
#include "outline/outline.h"

#include <math.h>
#include <stdlib.h>

/* How far beside the middle of a piece its sides are looked at: of its length, and of the outline's size,
 * below which rounding decides. */
static const double SIDE_OF_LENGTH = 1e-4;
static const double SIDE_OF_SIZE = 1e-13;

/* A cut of a segment: where, and how far along it. */
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
    if (!vshi_contours_reserve(w->result, &w->cuts, sizeof *w->cuts, w->cut_count, &w->cut_capacity,
                               sizeof *w->cuts)) {
        return false;
    }
    const double along = (point.x - a.x) * (b.x - a.x) + (point.y - a.y) * (b.y - a.y);
    w->cuts[w->cut_count++] = (cut){segment, along, point};
    return true;
}

/* Whether p, on the line of a segment, lies between its ends. */
static bool between(vshi_point a, vshi_point b, vshi_point p) {
    return p.x >= fmin(a.x, b.x) && p.x <= fmax(a.x, b.x) && p.y >= fmin(a.y, b.y) && p.y <= fmax(a.y, b.y);
}

/* Where two segments cross: the same bits whatever their order and sense, so that contours that lie on each
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

/* Cuts segment i with those of higher numbers. */
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

/* Keeps a piece where one of its sides is inside, the inside to its left. */
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
    if (!vshi_contours_reserve(w->result, &w->pieces, sizeof *w->pieces, w->piece_count, &w->piece_capacity,
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

/* The first unused piece that begins at a point; NULL where there is none. */
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
    for (size_t i = 1; i < w->piece_count; ++i) { /* contours that share a line have it twice */
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

bool vshi_outline_resolve(const vsh_outline *outline, vshi_contours *result) {
    work w = {.outline = outline, .result = result};
    const bool fits = cut_all(&w) && join(&w);
    free(w.pieces);
    free(w.cuts);
    return fits;
}
