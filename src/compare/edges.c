/* How wide penumbrae are: shadow edges are looked for in both bakes, and those that are the same are
 * compared.
 *
 * Every line of texels, along each axis, is walked from end to end. An edge is where it goes from one side
 * (at most 10 % of the way from the darkest to the lightest golden value) to the other (at least 90 %), and
 * its width is the length between: noise has to bring a value across 80 % of the range to make an edge, and
 * one that runs into a border of the coverage or the end of the image counts as none. The length along the
 * line times the cosine of the angle between it and the mean gradient is the width across the edge; an edge
 * is measured on the lines along the axis nearest to its gradient only, so that every edge counts by its
 * length. (By the coarea formula the lengths along parallel lines, summed, are the area of the penumbra;
 * without the restriction that is a Crofton estimate.) Golden and new edges make a pair where each is the
 * nearest to the other, of one direction, and no farther off than the wider of them.
 *
 * Limits: an edge between two neighbours reads as 0.8 texels wide, and widths below about two texels are not
 * resolved; a penumbra of a caster so thin that nothing gets dark has no edge. */
#include "compare/pair.h"

#include <math.h>
#include <stdlib.h>

enum { OUTLIERS = 8 };      /* so many values at each end of the range are not looked at */
enum { FEWEST_EDGES = 16 }; /* below it they say nothing of a bake */

static const double LOW = 0.1, HIGH = 0.9;
static const double LEAST_RANGE = 0.05; /* between the darkest and the lightest: less is no shadow */
static const double REACH = 2.0;        /* texels that a pair's edges may stand apart, however narrow */

typedef struct edge {
    double at;    /* texels along the line */
    double width; /* across the edge */
    int rises;    /* 1: dark to light; -1 */
    bool own;     /* this axis is the one to measure it on */
    size_t near;  /* index of the nearest of the others; SIZE_MAX: none */
} edge;

/* A line of texels, and the values that count as its two sides. */
typedef struct line {
    const vshi_pair *pair;
    size_t first, stride, count;
    int axis;
    double low, high;
} line;

static bool valid(const line *l, size_t i) {
    return l->pair->mask[l->first + i * l->stride] != 0;
}

static double value(const line *l, int which, size_t i) {
    return vshi_value_at(l->pair, which, l->first + i * l->stride);
}

/* Length that the line spends between the sides from one texel to the next. */
static double length_between(const line *l, double a, double b) {
    const double least = fmax(fmin(a, b), l->low), most = fmin(fmax(a, b), l->high);
    if (a == b) {
        return a > l->low && a < l->high ? 1.0 : 0.0;
    }
    return most > least ? (most - least) / fabs(b - a) : 0.0;
}

/* Change of the values along an axis at a texel: central where both neighbours are there. */
static double slope(const line *l, int which, size_t i, int axis) {
    const vshi_pair *pair = l->pair;
    const size_t at = l->first + i * l->stride, step = pair->stride[axis];
    size_t place[3];
    vshi_place_of(pair, at, place);
    const bool before = place[axis] > 0 && pair->mask[at - step];
    const bool after = place[axis] + 1 < pair->size[axis] && pair->mask[at + step];
    if (!before && !after) {
        return 0.0;
    }
    const double low = vshi_value_at(pair, which, before ? at - step : at);
    const double high = vshi_value_at(pair, which, after ? at + step : at);
    return (high - low) / (before && after ? 2.0 : 1.0);
}

/* The edge between texels `begin` and `end`, which are on two sides. */
static edge measure_edge(const line *l, int which, size_t begin, size_t end) {
    const double first = value(l, which, begin), last = value(l, which, end);
    edge e = {.rises = last > first ? 1 : -1, .near = SIZE_MAX};
    double width = 0.0, lit = 0.0;
    for (size_t i = begin; i < end; ++i) {
        const double a = value(l, which, i), b = value(l, which, i + 1);
        width += length_between(l, a, b);
        lit += 0.5 * (fmin(l->high, fmax(l->low, a)) + fmin(l->high, fmax(l->low, b))) - l->low;
    }
    const double share = lit / (l->high - l->low); /* texels of the way that are past the edge, if it rises */
    e.at = e.rises > 0 ? (double)end - share : (double)begin + share;
    double along = 0.0, squares = 0.0, widest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        double sum = 0.0; /* over the same way, by trapezia, along the line as across it: errors cancel */
        for (size_t i = begin; i <= end && l->pair->size[axis] > 1; ++i) {
            sum += (i == begin || i == end ? 0.5 : 1.0) * slope(l, which, i, axis);
        }
        along = axis == l->axis ? fabs(sum) : along;
        squares += sum * sum;
        widest = fmax(widest, fabs(sum));
    }
    e.own = along >= widest;
    e.width = squares > 0.0 ? width * along / sqrt(squares) : width;
    return e;
}

static size_t find_edges(const line *l, int which, edge *edges) {
    size_t count = 0, last = 0;
    int side = 0; /* of texel `last`: -1 dark, 1 light, 0 none yet */
    for (size_t i = 0; i < l->count; ++i) {
        if (!valid(l, i)) {
            side = 0;
            continue;
        }
        const double v = value(l, which, i);
        const int now = v <= l->low ? -1 : v >= l->high ? 1 : 0;
        if (now == 0) {
            continue;
        }
        if (side != 0 && now != side) {
            edges[count++] = measure_edge(l, which, last, i);
        }
        side = now;
        last = i;
    }
    return count;
}

/* For each edge the nearest of the others that may be the same one. */
static void find_nearest(edge *edges, size_t count, const edge *others, size_t other_count) {
    for (size_t i = 0, begin = 0; i < count; ++i) {
        double best = INFINITY;
        while (begin < other_count && others[begin].at < edges[i].at && begin + 1 < other_count &&
               others[begin + 1].at < edges[i].at) {
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
    uint64_t edges[2], pairs;
    double width[2], off; /* sums over the pairs */
} tally;

static void count_line(const line *l, edge *golden, edge *values, tally *t) {
    const size_t a = find_edges(l, VSHI_GOLDEN, golden), b = find_edges(l, VSHI_NEW, values);
    find_nearest(golden, a, values, b);
    find_nearest(values, b, golden, a);
    for (size_t i = 0; i < a; ++i) {
        const edge *other = golden[i].near != SIZE_MAX ? &values[golden[i].near] : NULL;
        if (other != NULL && other->near == i && (golden[i].own || other->own)) {
            /* where the two are near the diagonal, one may be its axis' own and the other not */
            ++t->edges[VSHI_GOLDEN];
            ++t->edges[VSHI_NEW];
            ++t->pairs;
            t->width[VSHI_GOLDEN] += golden[i].width;
            t->width[VSHI_NEW] += other->width;
            t->off += fabs(other->width - golden[i].width);
        } else if (golden[i].own) {
            ++t->edges[VSHI_GOLDEN];
        }
    }
    for (size_t i = 0; i < b; ++i) {
        const bool paired = values[i].near != SIZE_MAX && golden[values[i].near].near == i;
        t->edges[VSHI_NEW] += !paired && values[i].own;
    }
}

/* Keeps the OUTLIERS smallest of what it is given, the largest of them first. */
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

/* What counts as dark and as light. */
static bool find_sides(const vshi_pair *pair, double *low, double *high) {
    double dark[OUTLIERS], light[OUTLIERS]; /* the latter with the other sign */
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
    *low = dark[0] + LOW * range;
    *high = dark[0] + HIGH * range;
    return range >= LEAST_RANGE; /* not where there are fewer values: -inf */
}

static double share(double part, double of) {
    return of > 0.0 ? part / of : 0.0;
}

static void conclude(const tally *t, vsh_measures *m) {
    const double pairs = (double)t->pairs, most = fmax((double)t->edges[0], (double)t->edges[1]);
    for (int which = 0; which < 2; ++which) {
        m->edges[which] = t->edges[which];
        m->width[which] = t->pairs > 0 ? t->width[which] / pairs : NAN;
    }
    m->pairs = t->pairs;
    if (most >= FEWEST_EDGES) {
        m->value[VSH_MEASURE_EDGES] = fmax(share((double)t->edges[0] - pairs, (double)t->edges[0]),
                                           share((double)t->edges[1] - pairs, (double)t->edges[1]));
    }
    if (t->pairs >= FEWEST_EDGES) {
        const double ratio = t->width[VSHI_NEW] / t->width[VSHI_GOLDEN];
        m->value[VSH_MEASURE_PENUMBRA] = fmax(ratio, 1.0 / ratio) - 1.0;
        m->value[VSH_MEASURE_WIDTHS] = t->off / t->width[VSHI_GOLDEN];
    }
}

bool vshi_measure_edges(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                        vsh_measures *m) {
    (void)options;
    (void)scratch;
    size_t longest = 1;
    for (int axis = 0; axis < 3; ++axis) {
        longest = pair->size[axis] > longest ? pair->size[axis] : longest;
    }
    edge *edges = calloc(2 * longest, sizeof *edges);
    if (edges == NULL) {
        return false;
    }
    tally t = {{0}, 0, {0.0}, 0.0};
    line l = {.pair = pair};
    const bool shadow = find_sides(pair, &l.low, &l.high);
    for (l.axis = 0; shadow && l.axis < 3; ++l.axis) {
        l.stride = pair->stride[l.axis];
        l.count = pair->size[l.axis];
        for (size_t i = 0; i < pair->count; ++i) {
            if (i / l.stride % l.count == 0) { /* the first of a line */
                l.first = i;
                count_line(&l, edges, edges + longest, &t);
            }
        }
    }
    conclude(&t, m);
    free(edges);
    return true;
}
