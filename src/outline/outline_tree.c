#define _GNU_SOURCE /* qsort_r */
#include "outline/outline.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>

enum { LEAF_SEGMENTS = 4 };

/* --- growing */

/* A contour while the tree above the contours is made. */
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

vsh_result vshi_outline_grow_tree(vsh_outline *o, vsh_error *error) {
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

/* --- asking */

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

/* What a way from a to b that lies to the right of a point at height y adds: the half-open rule. */
static int64_t crossing(vshi_point a, vshi_point b, double y) {
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
        if (p.x <
            node->low[0]) { /* all of it to the right: whole contours add nothing, chains by their ends */
            winding += node->count == 0
                           ? 0
                           : crossing(o->points[node->first], o->points[node->first + node->count], p.y);
            continue;
        }
        if (node->children != 0) {
            stack[top++] = node->children + 1;
            stack[top++] = node->children;
            continue;
        }
        for (uint32_t i = node->first; i < node->first + node->count; ++i) {
            const vshi_point a = o->points[i], b = o->points[i + 1];
            const int64_t crosses = crossing(a, b, p.y);
            if (crosses != 0) {
                const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
                winding += crosses > 0 ? side > 0.0 : -(side < 0.0);
            }
        }
    }
    return winding;
}
