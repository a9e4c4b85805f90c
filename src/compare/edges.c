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
 * Values that hardly reach a mark in one bake may hardly miss it in the other, and say nothing by it. What
 * is no difference (the threshold, and what noise comes to) is therefore allowed for at both marks: an edge
 * of one bake is missed only where the other has none between marks that much closer together (hysteresis
 * as Canny's, 1986), and the width of one counts only where so small a move of the marks changes it no more
 * than it does twice on an even slope.
 *
 * Limits: an edge between two neighbours reads as 0.8 texels wide, and widths below about two texels are not
 * resolved; a penumbra of a caster so thin that nothing gets dark has no edge. */
#include "compare/pair.h"

#include <math.h>
#include <stdlib.h>

enum { OUTLIERS = 8 };      /* so many values at each end of the range are not looked at */
enum { FEWEST_EDGES = 16 }; /* below it they say nothing of a bake */

static const double LOW = 0.1, HIGH = 0.9;
static const double LEAST_NOISE = 0.25; /* of the squared difference: what penumbrae alone come to is less */
static const double MOST_ROOM = 0.3;    /* of the range, that each mark gives way */
static const double LEAST_RANGE = 0.05; /* between the darkest and the lightest: less is no shadow */
static const double REACH = 2.0;        /* texels that a pair's edges may stand apart, however narrow */

typedef struct edge {
    double at;    /* texels along the line */
    double width; /* across the edge */
    int rises;    /* 1: dark to light; -1 */
    bool own;     /* this axis is the one to measure it on */
    bool steady;  /* its width does not hang on where the marks are */
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
    marks sides, closer; /* the latter: closer together by what is no difference */
} line;

static bool valid(const line *l, size_t i) {
    return l->pair->mask[l->first + i * l->stride] != 0;
}

static double value(const line *l, int which, size_t i) {
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
static edge measure_edge(const line *l, marks m, int which, size_t begin, size_t end) {
    const double first = value(l, which, begin), last = value(l, which, end);
    edge e = {.rises = last > first ? 1 : -1, .near = SIZE_MAX};
    double width = 0.0, closer = 0.0, lit = 0.0;
    for (size_t i = begin; i < end; ++i) {
        const double a = value(l, which, i), b = value(l, which, i + 1);
        width += length_between(m, a, b);
        closer += length_between(l->closer, a, b);
        lit += 0.5 * (fmin(m.high, fmax(m.low, a)) + fmin(m.high, fmax(m.low, b))) - m.low;
    }
    const double even = (l->closer.high - l->closer.low) / (m.high - m.low); /* share left on an even slope */
    e.steady = closer >= width * (2.0 * even - 1.0);
    const double share = lit / (m.high - m.low); /* texels of the way that are past the edge, if it rises */
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

static size_t find_edges(const line *l, marks m, int which, edge *edges) {
    size_t count = 0, last = 0;
    int side = 0; /* of texel `last`: -1 dark, 1 light, 0 none yet */
    for (size_t i = 0; i < l->count; ++i) {
        if (!valid(l, i)) {
            side = 0;
            continue;
        }
        const double v = value(l, which, i);
        const int now = v <= m.low ? -1 : v >= m.high ? 1 : 0;
        if (now == 0) {
            continue;
        }
        if (side != 0 && now != side) {
            edges[count++] = measure_edge(l, m, which, last, i);
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
        edges[i].near = SIZE_MAX;
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
    uint64_t edges[2], missed[2]; /* found in each; of these, not in the other */
    uint64_t pairs;
    double width[2], off; /* sums over the pairs */
} tally;

static bool paired(const edge *edges, size_t i, const edge *others) {
    return edges[i].near != SIZE_MAX && others[edges[i].near].near == i;
}

static void find_pairs(edge *edges, size_t count, edge *others, size_t other_count) {
    find_nearest(edges, count, others, other_count);
    find_nearest(others, other_count, edges, count);
}

static void count_widths(const edge *golden, size_t count, const edge *values, tally *t) {
    for (size_t i = 0; i < count; ++i) {
        if (!paired(golden, i, values)) {
            continue;
        }
        const edge *other = &values[golden[i].near];
        /* where the two are near the diagonal, one may be its axis' own and the other not */
        if ((golden[i].own || other->own) && golden[i].steady && other->steady) {
            ++t->pairs;
            t->width[VSHI_GOLDEN] += golden[i].width;
            t->width[VSHI_NEW] += other->width;
            t->off += fabs(other->width - golden[i].width);
        }
    }
}

/* Edges of one, and those of them without a counterpart in the other, however weak. `weak` is scratch. */
static void count_missed(const line *l, int which, edge *edges, size_t count, edge *weak, tally *t) {
    const size_t weak_count = find_edges(l, l->closer, 1 - which, weak);
    find_pairs(edges, count, weak, weak_count);
    for (size_t i = 0; i < count; ++i) {
        t->edges[which] += edges[i].own;
        t->missed[which] += edges[i].own && !paired(edges, i, weak);
    }
}

static void count_line(const line *l, edge *const scratch[3], tally *t) {
    edge *golden = scratch[0], *values = scratch[1];
    const size_t a = find_edges(l, l->sides, VSHI_GOLDEN, golden);
    const size_t b = find_edges(l, l->sides, VSHI_NEW, values);
    find_pairs(golden, a, values, b);
    count_widths(golden, a, values, t);
    count_missed(l, VSHI_GOLDEN, golden, a, scratch[2], t);
    count_missed(l, VSHI_NEW, values, b, scratch[2], t);
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
static bool find_sides(const vshi_pair *pair, double threshold, double noise, line *l) {
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
    const double room = fmin(vshi_no_difference(threshold, noise), MOST_ROOM * range);
    l->sides = (marks){dark[0] + LOW * range, dark[0] + HIGH * range};
    l->closer = (marks){l->sides.low + room, l->sides.high - room};
    return range >= LEAST_RANGE; /* not where there are fewer values: -inf */
}

static double share(uint64_t part, uint64_t of) {
    return of > 0 ? (double)part / (double)of : 0.0;
}

/* `noise` is what there is beside the limits' own, in units of the range between dark and light. Many texels
 * of a wide penumbra have many chances to pass a mark, so that the mean width moves as far as a single one.
 */
static void conclude(const tally *t, double noise, vsh_measures *m) {
    const uint64_t most = t->edges[0] > t->edges[1] ? t->edges[0] : t->edges[1];
    for (int which = 0; which < 2; ++which) {
        m->edges[which] = t->edges[which];
        m->width[which] = t->pairs > 0 ? t->width[which] / (double)t->pairs : NAN;
    }
    m->pairs = t->pairs;
    if (most >= FEWEST_EDGES) {
        m->value[VSH_MEASURE_EDGES] =
            fmax(share(t->missed[0], t->edges[0]), share(t->missed[1], t->edges[1]));
    }
    if (t->pairs >= FEWEST_EDGES) {
        const double ratio = t->width[VSHI_NEW] / t->width[VSHI_GOLDEN];
        m->value[VSH_MEASURE_PENUMBRA] = fmax(0.0, fmax(ratio, 1.0 / ratio) - 1.0 - VSHI_NOISY_EDGE * noise);
        m->value[VSH_MEASURE_WIDTHS] = fmax(0.0, t->off / t->width[VSHI_GOLDEN] - VSHI_NOISY_EDGE * noise);
    }
}

/* Whether value `i` is the first of a line along the axis, which `l` then is. */
static bool begins_line(line *l, size_t i) {
    l->first = i;
    return i / l->stride % l->count == 0;
}

static void set_axis(line *l, int axis) {
    l->axis = axis;
    l->stride = l->pair->stride[axis];
    l->count = l->pair->size[axis];
}

bool vshi_measure_edges(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                        vsh_measures *m) {
    (void)scratch;
    size_t longest = 1;
    for (int axis = 0; axis < 3; ++axis) {
        longest = pair->size[axis] > longest ? pair->size[axis] : longest;
    }
    edge *edges = calloc(3 * longest, sizeof *edges);
    if (edges == NULL) {
        return false;
    }
    edge *const lists[3] = {edges, edges + longest, edges + 2 * longest};
    tally t = {.pairs = 0};
    line l = {.pair = pair};
    const double noise = m->noise_share >= LEAST_NOISE ? m->noise : 0.0;
    const bool shadow = find_sides(pair, options->threshold, fmax(noise, options->noise), &l);
    for (int axis = 0; shadow && axis < 3; ++axis) {
        set_axis(&l, axis);
        for (size_t i = 0; i < pair->count; ++i) {
            if (begins_line(&l, i)) {
                count_line(&l, lists, &t);
            }
        }
    }
    conclude(&t, fmax(0.0, noise - options->noise) / ((l.sides.high - l.sides.low) / (HIGH - LOW)), m);
    free(edges);
    return true;
}

/* --- widths where golden has penumbrae, whatever the new values are there */

/* Length that a line of values spends between its sides, from `begin` to `end`. */
static double length_of(const line *l, int which, size_t begin, size_t end) {
    double length = 0.0;
    for (size_t i = begin; i < end; ++i) {
        length += length_between(l->sides, value(l, which, i), value(l, which, i + 1));
    }
    return length;
}

/* Adds the penumbra between two texels of golden's that are on two sides. The other may be wider, and is
 * looked at as far again to both ends. */
static void add_width(const line *l, size_t begin, size_t end, double *golden, double *off) {
    for (size_t reach = end - begin + 1, k = 0; k < reach; ++k) {
        begin -= begin > 0 && valid(l, begin - 1);
        end += end + 1 < l->count && valid(l, end + 1);
    }
    const double width = length_of(l, VSHI_GOLDEN, begin, end);
    *golden += width;
    *off += fabs(length_of(l, VSHI_NEW, begin, end) - width);
}

static void add_widths_of_line(const line *l, double *golden, double *off) {
    size_t last = 0;
    int side = 0; /* of texel `last`: -1 dark, 1 light, 0 none yet */
    for (size_t i = 0; i < l->count; ++i) {
        const double v = valid(l, i) ? value(l, VSHI_GOLDEN, i) : NAN;
        const int now = v <= l->sides.low ? -1 : v >= l->sides.high ? 1 : 0;
        if (now == 0) {
            side = isnan(v) ? 0 : side;
            continue;
        }
        if (side != 0 && now != side) {
            add_width(l, last, i, golden, off);
        }
        side = now;
        last = i;
    }
}

void vshi_add_widths(const vshi_pair *pair, double *golden, double *off) {
    line l = {.pair = pair, .sides = {LOW, HIGH}};
    for (int axis = 0; axis < 3; ++axis) {
        set_axis(&l, axis);
        for (size_t i = 0; i < pair->count; ++i) {
            if (begins_line(&l, i)) {
                add_widths_of_line(&l, golden, off);
            }
        }
    }
}
