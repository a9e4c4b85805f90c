/* Chooses the number of voxels. Seconds were measured on one core of an AMD EPYC (Zen 3), as whole processes
 * of the cloister, `smooth` and `thin`. They are constants, so that the choice depends on the input alone
 * (docs/accuracy.md). */
#include "shade/resolution.h"

#include <math.h>
#include <stddef.h>

/* Of building: OpenVDB's module is loaded, each triangle sorted, each voxel of the band measured and put into
 * the field. */
static const double MODULE_S = 0.05, TRIANGLE_S = 0.5e-6, VOXEL_S = 0.11e-6;
/* Voxels of a band for each of a voxel's area of surface: three to each side. */
static const double BAND = 6.5;

/* The share of values that a field proves which rays would have had to find: MOST (1 - FIRST / N) with N
 * voxels, the mean of the three assets, which differ by twice as much or half (0.28, 0.50, 0.60 and 0.61 of
 * `smooth` with 24, 48, 96 and 192; 0 to 0.16 of the cloister). */
static const double MOST = 0.45, FIRST = 12.0;
/* What one of these saves at an error of 0.02, the marches of all values taken off; at others it grows with
 * the root of how much less the error is: 1.6 to 2.7 times at 0.005. */
static const double PROVED_S = 0.2e-6, PROVED_ERROR = 0.02;

static const int32_t CHOICES[] = {48, 96, 192, 384};

static double building_s(const vshi_resolution_need *need, double n) {
    const double voxel = need->longest / n;
    return MODULE_S + TRIANGLE_S * need->triangles + VOXEL_S * BAND * need->area / (voxel * voxel);
}

int32_t vshi_resolution_traced(const vshi_resolution_need *need) {
    const double saves = need->values * PROVED_S * sqrt(PROVED_ERROR / fmax(need->max_error, 1e-4));
    int32_t best = 0;
    double most = 0.0;
    for (size_t i = 0; need->longest > 0.0 && i < sizeof CHOICES / sizeof CHOICES[0]; ++i) {
        const double n = CHOICES[i], gain = saves * MOST * (1.0 - FIRST / n) - building_s(need, n);
        if (gain > most) {
            most = gain;
            best = CHOICES[i];
        }
    }
    return best;
}

/* What voxels displace, times their number along the longest side: 3.1 of the seeds' shadows, 0.9 of their AO
 * within 0.6. */
static const double DISPLACED = 4.0, DISPLACED_AO = 1.2;
/* Fewer lose too much of what is thin; more of them take gigabytes. */
enum { LEAST = 128, LARGEST = 1024 };

int32_t vshi_resolution_marched(double max_error, int32_t ao_only) {
    const double wanted = ceil((ao_only ? DISPLACED_AO : DISPLACED) / fmax(max_error, 1e-4));
    return wanted < LEAST ? LEAST : wanted > LARGEST ? LARGEST : (int32_t)wanted;
}
