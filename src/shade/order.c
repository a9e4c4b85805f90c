/* Points sorted along Morton's curve. Hilbert's, which never jumps, saves a hundredth of the samples of a
 * million random points and takes 30 ns more a point to compute. */
#include "base/parallel.h"
#include "field/level.h"
#include "shade/query.h"

#include <string.h>

enum {
    BITS = 14, /* of the curve, along each edge */
    LAST = (1 << BITS) - 1,
    SHIFT = 20, /* VSH_QUERY_BATCH is 1 << SHIFT */
    DIGIT = 11,
    PASSES = 4,
    PIECE = 4096
};

_Static_assert(VSH_QUERY_BATCH == 1 << SHIFT, "points are numbered by the lowest bits");

/* The curve fills the casters' box, grown by so many of its diagonals; points outside are put on its sides.
 */
static const double FAR = 4.0;

typedef struct ordering {
    const vshi_view *view;
    size_t first; /* of the points */
    double low[3];
    double scale; /* cells are cubes */
    uint64_t *order;
} ordering;

/* Bits with two zeros between each. */
static inline uint64_t spread(uint64_t x) {
    x = (x | x << 16) & 0x0000ff0000ffu;
    x = (x | x << 8) & 0x00f00f00f00fu;
    x = (x | x << 4) & 0x0c30c30c30c3u;
    return (x | x << 2) & 0x249249249249u;
}

static uint64_t place_of(const ordering *o, const double p[3]) {
    uint64_t place = 0;
    bool finite = true;
    for (int axis = 0; axis < 3; ++axis) {
        const double cell = (p[axis] - o->low[axis]) * o->scale;
        finite = finite && isfinite(p[axis]);
        place = place << 1 | spread((uint64_t)(cell > 0.0 ? cell < LAST ? cell : LAST : 0.0));
    }
    return finite ? place : UINT64_MAX >> SHIFT;
}

static void make_keys(void *user, size_t begin, size_t end) {
    const ordering *o = user;
    for (size_t i = begin; i < end; ++i) {
        double p[3];
        vshi_view_position(o->view, o->first + i, p);
        o->order[i] = place_of(o, p) << SHIFT | i;
    }
}

/* Sorts by the places, which are above the points' numbers. The sorted numbers come to lie in `order` after
 * an even number of passes. */
static void sort(uint64_t *order, uint64_t *spare, size_t count) {
    for (int shift = SHIFT; shift < SHIFT + PASSES * DIGIT; shift += DIGIT) {
        uint32_t at[1 << DIGIT] = {0}, sum = 0;
        for (size_t i = 0; i < count; ++i) {
            ++at[order[i] >> shift & ((1 << DIGIT) - 1)];
        }
        for (int value = 0; value < 1 << DIGIT; ++value) {
            const uint32_t own = at[value];
            at[value] = sum;
            sum += own;
        }
        for (size_t i = 0; i < count; ++i) {
            spare[at[order[i] >> shift & ((1 << DIGIT) - 1)]++] = order[i];
        }
        uint64_t *const sorted = spare;
        spare = order;
        order = sorted;
    }
}

vsh_result vshi_order_points(vshi_job *job, const vsh_field *field, const vshi_view *view, size_t first,
                             size_t count, uint64_t *order, vsh_error *error) {
    ordering o = {.view = view, .first = first, .order = order};
    double diagonal = 0.0, longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = field->world_max[axis] - field->world_min[axis];
        diagonal += side * side;
        longest = fmax(longest, side);
    }
    diagonal = sqrt(diagonal);
    for (int axis = 0; axis < 3; ++axis) {
        o.low[axis] = field->world_min[axis] - FAR * diagonal;
    }
    o.scale = (1 << BITS) / (longest + 2.0 * FAR * diagonal);
    VSHI_TRY(vshi_parallel_for(job, count, PIECE, 0, make_keys, &o, error));
    sort(order, order + count, count);
    return VSH_OK;
}

/* --- whether it pays: a million random points on the sample asset take 0.59 µs each by cone as they come and
 * 0.38 in order, a hundred thousand 0.59 and 0.49, ten thousand 0.63 and 0.67 */

bool vshi_order_pays(const vsh_field *field, const vshi_view *view, size_t first, size_t count) {
    enum { LEAST = 32768, TOGETHER = 16, LOOKS = 256 };
    static const double SPREAD = 8.0; /* voxels: side of the box of so many points that share little */
    if (count < LEAST) {
        return false;
    }
    size_t apart = 0;
    for (size_t look = 0; look < LOOKS; ++look) {
        const size_t begin = first + (count - TOGETHER) / (LOOKS - 1) * look;
        double low[3], high[3], side = 0.0;
        vshi_view_position(view, begin, low);
        memcpy(high, low, sizeof high);
        for (size_t i = 1; i < TOGETHER; ++i) {
            double p[3];
            vshi_view_position(view, begin + i, p);
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = fmin(low[axis], p[axis]);
                high[axis] = fmax(high[axis], p[axis]);
            }
        }
        for (int axis = 0; axis < 3; ++axis) {
            side = fmax(side, high[axis] - low[axis]);
        }
        apart += side > SPREAD * field->voxel_size;
    }
    return apart > LOOKS / 4;
}
