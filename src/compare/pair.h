/* Golden values and new ones on one lattice, as the measures see them. */
#ifndef VSHI_PAIR_H
#define VSHI_PAIR_H

#include <vdbshade/compare.h>

#include <stdbool.h>

typedef struct vshi_pair {
    size_t size[3];
    size_t stride[3]; /* from a value to the next along an axis */
    size_t count;
    const float *plane[2]; /* golden, new */
    const uint8_t *mask;   /* 1 where both are finite and asked for */
    double scale;          /* 1 / range */
} vshi_pair;

enum { VSHI_GOLDEN, VSHI_NEW };

static inline double vshi_value_at(const vshi_pair *pair, int which, size_t i) {
    return (double)pair->plane[which][i] * pair->scale;
}

/* Refuses what cannot be compared; *count: how many values there are. */
vsh_result vshi_pair_check(const vsh_compared *compared, double *count, vsh_error *error);

/* Makes the pair, with `mask` [count] as its mask, and fills the measures' count, range and what is told of
 * values that are not finite; the others are NaN or 0. */
void vshi_pair_make(const vsh_compared *compared, uint8_t *mask, vshi_pair *pair, vsh_measures *m);

/* x, y, z of a value. */
static inline void vshi_place_of(const vshi_pair *pair, size_t i, size_t place[3]) {
    place[0] = i % pair->size[0];
    place[1] = i / pair->stride[1] % pair->size[1];
    place[2] = i / pair->stride[2];
}

/* What is told from nothing, and noise on top of it: at most so far does noise of that standard error carry
 * 99 of 100 values. */
static inline double vshi_no_difference(double nothing, double noise) {
    return nothing + 2.6 * noise;
}

/* Each fills its own members of the measures. Work takes `scratch` bytes a value, below, and returns false
 * where the system refuses what it needs besides. */
typedef bool vshi_measure_fn(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                             vsh_measures *measures);

vshi_measure_fn vshi_measure_values;  /* RMSE, bias, maximum, p99, share */
vshi_measure_fn vshi_measure_ssim;    /* structural similarity */
vshi_measure_fn vshi_measure_edges;   /* penumbra, widths, edges */
vshi_measure_fn vshi_measure_shift;   /* displacement */
vshi_measure_fn vshi_measure_regions; /* lost, gained */

/* Of causes.c. The first fills measures->noise and noise_share. The second puts what golden's values are on
 * the curve that the new ones follow in their place, into mapped[count], and fills measures->curve; without
 * such a curve nothing changes, and it returns false. */
void vshi_find_noise(const vshi_pair *pair, vsh_measures *measures);
bool vshi_follow_curve(vshi_pair *pair, float *mapped, void *scratch, vsh_measures *measures);

/* Of edges.c, for vsh_accuracy.width_error: adds the widths of the golden penumbrae, and by how much the new
 * values are off, each texels along a line. */
void vshi_add_widths(const vshi_pair *pair, double *golden, double *off);

/* Change of a width, as a share, per noise of a standard error of 1. Both ends of a penumbra move by noise /
 * slope; steady ones (edges.c) have half the mean slope there at least. The mean of 16 edges or more
 * (FEWEST_EDGES) moves by a quarter of that. */
#define VSHI_NOISY_EDGE 5.0
#define VSHI_NOISY_WIDTH (VSHI_NOISY_EDGE / 4.0)

/* Of ssim.c: what two planes come to where one is flat and the other is it with noise of a standard error. */
double vshi_ssim_of_noise(double noise);

enum {
    VSHI_CURVE_SCRATCH = 4,
    VSHI_SHIFT_SCRATCH = 5,
    VSHI_REGIONS_SCRATCH = 16
}; /* bytes a value; the others take none */

#endif
