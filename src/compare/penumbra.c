/* Measures how wide penumbrae are: finds shadow edges in both bakes, and compares those found in both.
 *
 * Every line of texels along each axis is walked. An edge goes from one side (at most 10 % of the way from
 * the darkest to the lightest golden value) to the other (at least 90 %). Only noise of 80 % of the range
 * looks like an edge. Edges that a border cuts off do not count. The length between the sides, times the
 * cosine of the angle between line and mean gradient, is the width across the edge. Each edge is measured
 * along the axis nearest to its gradient, so that it counts by its length: by the coarea formula, lengths
 * along parallel lines add up to the area of the penumbra.
 *
 * A golden and a new edge are a pair if each is the nearest to the other. Both must rise or both fall, and
 * they must not be farther apart than the wider is wide.
 *
 * A value close to a mark may reach it in one bake and miss it in the other. So a width counts only if moving
 * the marks a little changes it by at most twice as much as on an even slope.
 *
 * Limits: an edge between two neighbours reads as 0.8 texels. Widths below about two texels are not resolved.
 * A caster too thin for a dark core has no edge. */
#include "compare/compare.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>

enum { OUTLIERS = 8 };      /* values ignored at each end of the range */
enum { FEWEST_EDGES = 16 }; /* fewer do not make a mean */

static const double LOW = 0.1, HIGH = 0.9;
static const double ROOM = 0.02;        /* move of the marks that tests if a width is steady */
static const double MOST_ROOM = 0.3;    /* share of the range that each mark moves at most */
static const double LEAST_RANGE = 0.05; /* from the darkest to the lightest: less is no shadow */
static const double REACH = 2.0;        /* texels that narrow edges of a pair may be apart */

typedef struct edge {
    double at;    /* texels along the line */
    double width; /* across the edge */
    int rises;    /* 1: dark to light; -1 */
    bool own;     /* the line's axis is the nearest to its gradient */
    bool steady;  /* its width hardly depends on the marks */
    size_t near;  /* index of the nearest of the others; SIZE_MAX: none */
} edge;

/* Values that count as the two sides of an edge. */
typedef struct marks {
    double low, high;
} marks;

typedef struct line {
    const vshi_pair *pair;
    size_t first, stride, count;
    int axis;
    marks sides, closer; /* `closer`: moved towards each other by ROOM and noise */
} line;

static bool is_valid(const line *l, size_t i) {
    return l->pair->mask[l->first + i * l->stride] != 0;
}

static double value_at(const line *l, int which, size_t i) {
    return vshi_value_at(l->pair, which, l->first + i * l->stride);
}

/* Length that a line spends between the marks from one texel to the next. */
static double length_between(marks m, double a, double b) {
    const double least = fmax(fmin(a, b), m.low), most = fmin(fmax(a, b), m.high);
    if (a == b) {
        return a > m.low && a < m.high ? 1.0 : 0.0;
    }
    return most > least ? (most - least) / fabs(b - a) : 0.0;
}

/* Slope along an axis at a texel: a central difference if both neighbours are valid. */
static double find_slope(const line *l, int which, size_t i, int axis) {
    const vshi_pair *pair = l->pair;
    const size_t at = l->first + i * l->stride, step = pair->stride[axis];
    size_t place[3];
    vshi_find_place(pair, at, place);
    const bool before = place[axis] > 0 && pair->mask[at - step];
    const bool after = place[axis] + 1 < pair->size[axis] && pair->mask[at + step];
    if (!before && !after) {
        return 0.0;
    }
    const double low = vshi_value_at(pair, which, before ? at - step : at);
    const double high = vshi_value_at(pair, which, after ? at + step : at);
    return (high - low) / (before && after ? 2.0 : 1.0);
}

/* Measures the edge between texels `begin` and `end`, which are on different sides. */
static edge measure_edge(const line *l, int which, size_t begin, size_t end) {
    const marks m = l->sides;
    const double first = value_at(l, which, begin), last = value_at(l, which, end);
    edge e = {.rises = last > first ? 1 : -1, .near = SIZE_MAX};
    double width = 0.0, closer = 0.0, lit = 0.0;
    for (size_t i = begin; i < end; ++i) {
        const double a = value_at(l, which, i), b = value_at(l, which, i + 1);
        width += length_between(m, a, b);
        closer += length_between(l->closer, a, b);
        lit += 0.5 * (fmin(m.high, fmax(m.low, a)) + fmin(m.high, fmax(m.low, b))) - m.low;
    }
    const double even =
        (l->closer.high - l->closer.low) / (m.high - m.low); /* share that is left on an even slope */
    e.steady = closer >= width * (2.0 * even - 1.0);
    const double share = lit / (m.high - m.low); /* lit texels, with fractions */
    e.at = e.rises > 0 ? (double)end - share : (double)begin + share;
    double along = 0.0, squares = 0.0, widest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        double sum = 0.0; /* by the trapezium rule for each axis, so that its errors cancel */
        for (size_t i = begin; i <= end && l->pair->size[axis] > 1; ++i) {
            sum += (i == begin || i == end ? 0.5 : 1.0) * find_slope(l, which, i, axis);
        }
        along = axis == l->axis ? fabs(sum) : along;
        squares += sum * sum;
        widest = fmax(widest, fabs(sum));
    }
    e.own = along >= widest;
    e.width = squares > 0.0 ? width * along / sqrt(squares) : width;
    return e;
}

/* Finds the next two texels on different sides, from crossing[1] on. */
static bool find_crossing(const line *l, int which, size_t crossing[2]) {
    int side = 0; /* of texel crossing[0]: -1 dark, 1 light */
    for (size_t i = crossing[1]; i < l->count; ++i) {
        const double v = is_valid(l, i) ? value_at(l, which, i) : NAN;
        const int now = v <= l->sides.low ? -1 : v >= l->sides.high ? 1 : 0;
        if (side != 0 && now == -side) {
            crossing[1] = i;
            return true;
        }
        side = isnan(v) ? 0 : now != 0 ? now : side;
        crossing[0] = now != 0 ? i : crossing[0];
    }
    return false;
}

static size_t find_edges(const line *l, int which, edge *edges) {
    size_t count = 0, crossing[2] = {0, 0};
    while (find_crossing(l, which, crossing)) {
        edges[count++] = measure_edge(l, which, crossing[0], crossing[1]);
    }
    return count;
}

/* Finds for each edge the nearest of the others that may be the same one. */
static void find_nearest(edge *edges, size_t count, const edge *others, size_t other_count) {
    for (size_t i = 0, begin = 0; i < count; ++i) {
        double best = INFINITY;
        edges[i].near = SIZE_MAX;
        while (begin + 1 < other_count && others[begin + 1].at < edges[i].at) {
            ++begin;
        }
        for (size_t k = begin > 0 ? begin - 1 : 0; k < other_count && k < begin + 4; ++k) {
            const double off = fabs(others[k].at - edges[i].at);
            if (others[k].rises == edges[i].rises && off < best &&
                off <= REACH + fmax(edges[i].width, others[k].width)) {
                best = off;
                edges[i].near = k;
            }
        }
    }
}

typedef struct tally {
    uint64_t pairs;
    double width[2]; /* sums over the pairs */
} tally;

static void add_line(const line *l, edge *golden, edge *fresh, tally *t) {
    const size_t golden_count = find_edges(l, VSHI_GOLDEN, golden);
    const size_t fresh_count = find_edges(l, VSHI_NEW, fresh);
    find_nearest(golden, golden_count, fresh, fresh_count);
    find_nearest(fresh, fresh_count, golden, golden_count);
    for (size_t i = 0; i < golden_count; ++i) {
        const edge *one = &golden[i], *other = one->near != SIZE_MAX ? &fresh[one->near] : NULL;
        /* near a diagonal, the nearest axes of the two edges' gradients may differ */
        if (other != NULL && other->near == i && (one->own || other->own) && one->steady && other->steady) {
            ++t->pairs;
            t->width[VSHI_GOLDEN] += one->width;
            t->width[VSHI_NEW] += other->width;
        }
    }
}

/* Keeps the OUTLIERS smallest values, the largest of them first. */
static void keep_smallest(double kept[OUTLIERS], double v) {
    if (v >= kept[0]) {
        return;
    }
    size_t i = 0;
    for (; i + 1 < OUTLIERS && kept[i + 1] > v; ++i) {
        kept[i] = kept[i + 1];
    }
    kept[i] = v;
}

/* Finds the marks; false if there is no shadow. */
static bool find_sides(const vshi_pair *pair, double noise, line *l) {
    double dark[OUTLIERS], light[OUTLIERS]; /* light: negated */
    for (int i = 0; i < OUTLIERS; ++i) {
        dark[i] = light[i] = INFINITY;
    }
    for (size_t i = 0; i < pair->count; ++i) {
        if (pair->mask[i]) {
            keep_smallest(dark, vshi_value_at(pair, VSHI_GOLDEN, i));
            keep_smallest(light, -vshi_value_at(pair, VSHI_GOLDEN, i));
        }
    }
    const double range = -light[0] - dark[0];
    const double room = fmin(ROOM + VSHI_NOISE_P99 * noise, MOST_ROOM * range);
    l->sides = (marks){dark[0] + LOW * range, dark[0] + HIGH * range};
    l->closer = (marks){l->sides.low + room, l->sides.high - room};
    return range >= LEAST_RANGE; /* -inf if there are too few values */
}

/* Starts line `l` at value `i`. Returns whether that is the first value of a line along the axis. */
static bool begins_line(line *l, size_t i) {
    l->first = i;
    return i / l->stride % l->count == 0;
}

static void set_axis(line *l, int axis) {
    l->axis = axis;
    l->stride = l->pair->stride[axis];
    l->count = l->pair->size[axis];
}

vsh_result vshi_measure_penumbrae(const vshi_pair *pair, double noise, vsh_measures *m, vsh_error *error) {
    line l = {.pair = pair};
    if (!find_sides(pair, noise, &l)) {
        return VSH_OK;
    }
    size_t longest = 1;
    for (int axis = 0; axis < 3; ++axis) {
        longest = pair->size[axis] > longest ? pair->size[axis] : longest;
    }
    void *memory;
    VSHI_TRY(vshi_allocate(&memory, 2 * longest, sizeof(edge), "comparison", error));
    edge *edges = memory;
    tally t = {.pairs = 0};
    for (int axis = 0; axis < 3; ++axis) {
        set_axis(&l, axis);
        for (size_t i = 0; i < pair->count; ++i) {
            if (begins_line(&l, i)) {
                add_line(&l, edges, edges + longest, &t);
            }
        }
    }
    free(memory);
    m->pairs = t.pairs;
    for (int which = 0; which < 2 && t.pairs > 0; ++which) {
        m->width[which] = t.width[which] / (double)t.pairs;
    }
    if (t.pairs >= FEWEST_EDGES) {
        const double ratio = t.width[VSHI_NEW] / t.width[VSHI_GOLDEN];
        m->value[VSH_MEASURE_PENUMBRA] = fmax(ratio, 1.0 / ratio) - 1.0;
    }
    return VSH_OK;
}
