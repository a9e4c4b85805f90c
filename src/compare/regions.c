/* What is lost or gained as a whole: a shadow without its caster, or a new one.
 *
 * A texel is off by how far its new value lies outside the range of the golden values around its place, or
 * its golden value outside that of the new ones (flat dilation and erosion: Serra, "Image Analysis and
 * Mathematical Morphology", 1982): the first finds what came, the second what went, be it one texel wide.
 * What only moved by no more than the reach, or got a little softer, has its like nearby and is off by
 * nothing. Touching texels (by corners too) that are off by a step or more to one side make a region.
 *
 * Limits: a shadow fainter than the step is not seen, and penumbrae that change by many texels are off too.
 */
#include "compare/pair.h"

#include <math.h>
#include <string.h>

/* Least and greatest of a plane within `reach` of each texel along an axis: in place, line by line. */
typedef struct extremes {
    float *least, *greatest;
} extremes;

enum { MOST_REACH = 16, WINDOW = 2 * MOST_REACH + 1 };

static void spread(const vshi_pair *pair, const extremes *e, int axis, size_t first, size_t reach) {
    const size_t stride = pair->stride[axis], count = pair->size[axis], window = 2 * reach + 1;
    float least[WINDOW], greatest[WINDOW]; /* a ring: what stood at i is needed until i + reach */
    for (size_t next = 0; next < count + reach; ++next) {
        const size_t slot = next % window, at = first + next * stride;
        least[slot] = next < count ? e->least[at] : INFINITY;
        greatest[slot] = next < count ? e->greatest[at] : -INFINITY;
        if (next < reach) {
            continue;
        }
        const size_t i = next - reach, begin = i > reach ? i - reach : 0;
        float low = INFINITY, high = -INFINITY;
        for (size_t k = begin; k <= next; ++k) {
            low = fminf(low, least[k % window]);
            high = fmaxf(high, greatest[k % window]);
        }
        e->least[first + i * stride] = low;
        e->greatest[first + i * stride] = high;
    }
}

/* Adds to `off`, where it is more, how far the values of `one` lie outside the range of the other around
 * them; `sign` turns that into new - golden. */
static void look_around(const vshi_pair *pair, int one, double sign, size_t reach, const extremes *e,
                        float *off) {
    for (size_t i = 0; i < pair->count; ++i) {
        const float value = (float)vshi_value_at(pair, 1 - one, i);
        e->least[i] = pair->mask[i] ? value : INFINITY;
        e->greatest[i] = pair->mask[i] ? value : -INFINITY;
    }
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < pair->count && pair->size[axis] > 1; ++i) {
            if (i / pair->stride[axis] % pair->size[axis] == 0) {
                spread(pair, e, axis, i, reach);
            }
        }
    }
    for (size_t i = 0; i < pair->count; ++i) {
        if (pair->mask[i]) {
            const double value = vshi_value_at(pair, one, i);
            const double outside =
                fmax(0.0, value - (double)e->greatest[i]) + fmin(0.0, value - (double)e->least[i]);
            if (fabs(outside) > fabs((double)off[i])) {
                off[i] = (float)(sign * outside);
            }
        }
    }
}

/* Takes the region of texel `start` out of `off`. */
static vsh_region take_region(const vshi_pair *pair, float *off, uint32_t *stack, size_t start, double step) {
    const double sign = off[start] > 0.0f ? 1.0 : -1.0;
    vsh_region region = {.worst = start, .by = (double)off[start]};
    size_t height = 0;
    stack[height++] = (uint32_t)start;
    off[start] = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        region.min[axis] = INT32_MAX;
        region.max[axis] = INT32_MIN;
    }
    while (height > 0) {
        const size_t at = stack[--height];
        size_t place[3];
        vshi_place_of(pair, at, place);
        ++region.count;
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t p = (int32_t)place[axis];
            region.min[axis] = p < region.min[axis] ? p : region.min[axis];
            region.max[axis] = p > region.max[axis] ? p : region.max[axis];
        }
        for (int neighbour = 0; neighbour < 27; ++neighbour) {
            size_t to = 0;
            bool inside = true;
            for (int axis = 0, rest = neighbour; axis < 3; ++axis, rest /= 3) {
                const size_t p = place[axis] + (size_t)(rest % 3); /* one more than it is */
                inside = inside && p >= 1 && p <= pair->size[axis];
                to += inside ? (p - 1) * pair->stride[axis] : 0;
            }
            if (inside && sign * (double)off[to] >= step) {
                if (fabs((double)off[to]) > fabs(region.by)) {
                    region.by = (double)off[to];
                    region.worst = to;
                }
                off[to] = 0.0f;
                stack[height++] = (uint32_t)to;
            }
        }
    }
    return region;
}

bool vshi_measure_regions(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                          vsh_measures *m) {
    float *planes = scratch;
    float *off = planes + 2 * pair->count;
    const extremes e = {planes, planes + pair->count};
    memset(off, 0, pair->count * sizeof *off);
    look_around(pair, VSHI_NEW, 1.0, (size_t)options->reach, &e, off);
    look_around(pair, VSHI_GOLDEN, -1.0, (size_t)options->reach, &e, off);
    const double step = vshi_no_difference(options->step, fmax(options->noise, m->noise));
    uint32_t *stack = (uint32_t *)(planes + 3 * pair->count); /* no texel is on it twice */
    for (size_t i = 0; i < pair->count; ++i) {
        if (fabs((double)off[i]) >= step) {
            vsh_region *largest = off[i] > 0.0f ? &m->lost : &m->gained;
            const vsh_region region = take_region(pair, off, stack, i, step);
            if (region.count > largest->count) {
                *largest = region;
            }
        }
    }
    m->value[VSH_MEASURE_LOST] = (double)m->lost.count;
    m->value[VSH_MEASURE_GAINED] = (double)m->gained.count;
    return true;
}
