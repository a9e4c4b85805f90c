/* A balanced k-d tree in place (Bentley, "Multidimensional binary search trees used for associative
 * searching", 1975). */
#include "lightmap/places.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>

enum { DEEPEST = 64, FEW = 8 /* places that are tested one by one */ };

/* By an axis, then by number, so that the input's order does not matter. */
static bool is_before(const vshi_place *a, const vshi_place *b, int axis) {
    return a->at[axis] < b->at[axis] || (a->at[axis] == b->at[axis] && a->number < b->number);
}

static void swap(vshi_place *a, vshi_place *b) {
    const vshi_place moved = *a;
    *a = *b;
    *b = moved;
}

/* Moves the place that belongs at `middle` there, smaller ones below and larger ones above (Hoare, "Find",
 * 1961). */
static void select_middle(vshi_place *list, size_t begin, size_t end, size_t middle, int axis) {
    while (end - begin > 1) {
        vshi_place *pivot = &list[end - 1];
        size_t below = begin;
        swap(&list[begin + (end - begin) / 2], pivot);
        for (size_t i = begin; i < end - 1; ++i) {
            if (is_before(&list[i], pivot, axis)) {
                swap(&list[i], &list[below++]);
            }
        }
        swap(&list[below], pivot);
        if (below < middle) {
            begin = below + 1;
        } else if (below > middle) {
            end = below;
        } else {
            return;
        }
    }
}

static int longest_axis(const vshi_place *list, size_t begin, size_t end) {
    float low[3], high[3];
    for (int k = 0; k < 3; ++k) {
        low[k] = high[k] = list[begin].at[k];
    }
    for (size_t i = begin + 1; i < end; ++i) {
        for (int k = 0; k < 3; ++k) {
            low[k] = fminf(low[k], list[i].at[k]);
            high[k] = fmaxf(high[k], list[i].at[k]);
        }
    }
    int longest = 0;
    for (int k = 1; k < 3; ++k) {
        longest = high[k] - low[k] > high[longest] - low[longest] ? k : longest;
    }
    return longest;
}

typedef struct part {
    size_t begin, end;
} part;

vsh_result vshi_places_sort(vshi_places *places, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&places->axis, places->count, 1, "places", error));
    part open[DEEPEST];
    int count = 0;
    open[count++] = (part){0, places->count};
    while (count > 0) {
        const part p = open[--count];
        if (p.end - p.begin <= FEW) {
            continue;
        }
        const size_t middle = p.begin + (p.end - p.begin) / 2;
        const int axis = longest_axis(places->list, p.begin, p.end);
        select_middle(places->list, p.begin, p.end, middle, axis);
        places->axis[middle] = (uint8_t)axis;
        open[count++] = (part){p.begin, middle}; /* parts are halves, so at most DEEPEST are open */
        open[count++] = (part){middle + 1, p.end};
    }
    return VSH_OK;
}

void vshi_places_free(vshi_places *places) {
    free(places->axis);
    free(places->list);
    *places = (vshi_places){NULL, NULL, 0};
}

/* --- search */

typedef struct nearest {
    float square;
    uint32_t number;
} nearest;

static void consider(const vshi_place *place, const float at[3], nearest *best) {
    const float x = place->at[0] - at[0], y = place->at[1] - at[1], z = place->at[2] - at[2];
    const float square = x * x + y * y + z * z;
    if (square < best->square ||
        (square == best->square && best->number != UINT32_MAX && place->number < best->number)) {
        *best = (nearest){square, place->number};
    }
}

/* A part of the tree, and a lower bound of the distance to its places. */
typedef struct far_part {
    part part;
    float square;
} far_part;

uint32_t vshi_places_nearest(const vshi_places *places, const float at[3], float square) {
    nearest best = {square, UINT32_MAX};
    far_part open[DEEPEST];
    int count = 0;
    open[count++] = (far_part){{0, places->count}, 0.0F};
    while (count > 0) {
        const far_part next = open[--count];
        part p = next.part;
        if (next.square > best.square) {
            continue;
        }
        while (p.end - p.begin > FEW) {
            const size_t middle = p.begin + (p.end - p.begin) / 2;
            const vshi_place *place = &places->list[middle];
            const float over = at[places->axis[middle]] - place->at[places->axis[middle]];
            const part below = {p.begin, middle}, above = {middle + 1, p.end};
            consider(place, at, &best);
            open[count++] = (far_part){over < 0.0F ? above : below, over * over};
            p = over < 0.0F ? below : above;
        }
        for (size_t i = p.begin; i < p.end; ++i) {
            consider(&places->list[i], at, &best);
        }
    }
    return best.number;
}

/* A part of the tree, and of the line that is near to it. */
typedef struct line_part {
    part part;
    float begin, end;
} line_part;

/* Cuts off the part of the line farther than `within` beyond the plane, against the sign. */
static line_part cut(line_part p, part of, float at, float along, float plane, float sign, float within) {
    const float over = sign * (at - plane) - within, step = sign * along;
    p.part = of;
    if (step > 0.0F) {
        p.end = fminf(p.end, -over / step);
    } else if (step < 0.0F) {
        p.begin = fmaxf(p.begin, -over / step);
    } else if (over > 0.0F) {
        p.end = -1.0F;
    }
    return p;
}

void vshi_places_along(const vshi_places *places, const float a[3], const float b[3], float within,
                       bool (*found)(void *user, uint32_t number), void *user) {
    line_part open[DEEPEST];
    int count = 0;
    open[count++] = (line_part){{0, places->count}, 0.0F, 1.0F};
    while (count > 0) {
        const line_part next = open[--count];
        const part p = next.part;
        if (!(next.begin <= next.end) || p.begin == p.end) {
            continue;
        }
        if (p.end - p.begin <= FEW) {
            for (size_t i = p.begin; i < p.end; ++i) {
                if (!found(user, places->list[i].number)) {
                    return;
                }
            }
            continue;
        }
        const size_t middle = p.begin + (p.end - p.begin) / 2;
        const int axis = places->axis[middle];
        const float plane = places->list[middle].at[axis], along = b[axis] - a[axis];
        if (!found(user, places->list[middle].number)) {
            return;
        }
        open[count++] = cut(next, (part){middle + 1, p.end}, a[axis], along, plane, -1.0F, within);
        open[count++] = cut(next, (part){p.begin, middle}, a[axis], along, plane, 1.0F, within);
    }
}
