#include "unwrap/sparse.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

enum { FEW = 12, DEEPEST = 64 };

typedef struct part {
    uint32_t begin, end, row; /* vertices in the list; the first row that is theirs */
    int depth;
} part;

typedef struct dissecting {
    const uint32_t *begin, *neighbours;
    const vshi_vec *place;
    uint32_t *list; /* vertices */
    uint32_t *side; /* [count]: the part that a vertex is in, times two, and whether it is beyond the plane */
    uint32_t *other; /* [count]: room */
    uint32_t *order;
} dissecting;

static double along(vshi_vec p, int axis) {
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

/* The longest side of the part's box, and the mean along it. */
static int find_plane(const dissecting *d, const part *p, double *middle) {
    double low[3], high[3], sum[3];
    for (int k = 0; k < 3; ++k) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
        sum[k] = 0.0;
    }
    for (uint32_t i = p->begin; i < p->end; ++i) {
        for (int k = 0; k < 3; ++k) {
            const double x = along(d->place[d->list[i]], k);
            low[k] = x < low[k] ? x : low[k];
            high[k] = x > high[k] ? x : high[k];
            sum[k] += x;
        }
    }
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
        axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
    }
    *middle = sum[axis] / (double)(p->end - p->begin);
    return axis;
}

static void number(dissecting *d, const part *p) {
    for (uint32_t i = p->begin; i < p->end; ++i) {
        d->order[d->list[i]] = p->row + (i - p->begin);
    }
}

/* `turned`: before is beyond, for where one vertex beyond, the tip of a fan, touches all that is before.
 * Sorts a part's vertices into those before a plane, those beyond it, and those before it that touch them,
 * which come last. Returns false where that parts nothing. */
static bool cut(dissecting *d, const part *p, uint32_t tag, bool turned, part halves[2]) {
    double middle;
    const int axis = find_plane(d, p, &middle);
    for (uint32_t i = p->begin; i < p->end; ++i) {
        const uint32_t v = d->list[i];
        d->side[v] = 2 * tag + ((along(d->place[v], axis) > middle) != turned);
    }
    uint32_t near = p->begin, beyond = 0, between = p->end;
    for (uint32_t i = p->begin; i < p->end; ++i) {
        const uint32_t v = d->list[i];
        bool touches = false;
        for (uint32_t n = d->begin[v]; d->side[v] == 2 * tag && n < d->begin[v + 1] && !touches; ++n) {
            touches = d->side[d->neighbours[n]] == 2 * tag + 1;
        }
        if (touches) {
            d->other[--between] = v;
        } else if (d->side[v] == 2 * tag) {
            d->other[near++] = v;
        } else {
            d->list[p->begin + beyond++] = v; /* no further than what was read */
        }
    }
    if (near == p->begin || beyond == 0) {
        uint32_t at = p->begin +
                      beyond; /* all that is before it touches it, or nothing is: the list as a whole again */
        for (uint32_t i = p->begin; i < near; ++i) {
            d->list[at++] = d->other[i];
        }
        for (uint32_t i = between; i < p->end; ++i) {
            d->list[at++] = d->other[i];
        }
        return false;
    }
    for (uint32_t i = 0; i < beyond; ++i) {
        d->other[near + i] = d->list[p->begin + i];
    }
    for (uint32_t i = p->begin; i < p->end; ++i) {
        d->list[i] = d->other[i];
    }
    halves[0] = (part){p->begin, near, p->row, p->depth + 1};
    halves[1] = (part){near, near + beyond, p->row + (near - p->begin), p->depth + 1};
    const part border = {between, p->end, p->row + (between - p->begin), 0};
    number(d, &border);
    for (uint32_t i = between; i < p->end; ++i) {
        d->side[d->list[i]] = UINT32_MAX; /* in no part any more */
    }
    return true;
}

vsh_result vshi_dissect(const uint32_t *begin, const uint32_t *neighbours, const vshi_vec *place,
                        uint32_t count, uint32_t *order, vsh_error *error) {
    dissecting d = {.begin = begin, .neighbours = neighbours, .place = place, .order = order};
    part stack[DEEPEST + 2];
    size_t waiting = 0;
    uint32_t tag = 0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&d.list, count, sizeof *d.list, "an order of vertices", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&d.side, count, sizeof *d.side, "an order of vertices", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&d.other, count, sizeof *d.other, "an order of vertices", error));
    for (uint32_t v = 0; v < count; ++v) {
        d.list[v] = v;
        d.side[v] = UINT32_MAX;
    }
    stack[waiting++] = (part){0, count, 0, 0};
    while (waiting > 0) {
        const part p = stack[--waiting];
        part halves[2];
        if (p.end - p.begin <= FEW || p.depth >= DEEPEST ||
            (!cut(&d, &p, tag, false, halves) && !cut(&d, &p, tag, true, halves))) {
            ++tag;
            number(&d, &p);
            continue;
        }
        ++tag;
        stack[waiting++] = halves[0];
        stack[waiting++] = halves[1];
    }
done:
    free(d.other);
    free(d.side);
    free(d.list);
    return result;
}
