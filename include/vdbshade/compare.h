/* Comparing baked values with golden ones: measures, their limits, and the file that limits stand in.
 *
 * A plain RMSE hardly notices that penumbrae were lost, so there is a measure for each way in which a bake
 * goes wrong: penumbrae of another width, values that stand somewhere else, shadows without their casters.
 * docs/regression.md has the formulas, their sources, and what each measure cannot see. */
#ifndef VDBSHADE_COMPARE_H
#define VDBSHADE_COMPARE_H

#include "image.h"

#include <math.h>

#ifdef __cplusplus
extern "C" {
#endif

/* --- coverage */

typedef struct vsh_coverage {
    uint64_t golden;  /* texels covered in each */
    uint64_t values;  /* … */
    uint64_t both;    /* in both: what values are compared over */
    uint64_t differs; /* in one of the two alone */
    uint64_t first;   /* index of the first of those; `count` where there is none */
    double share;     /* differs / covered in either; 0 where nothing is covered */
} vsh_coverage;

/* Compares two planes of coverage [count], a texel being covered where its value is above 1/2 (NULL: all
 * are), and writes 1 into mask[count] (may be NULL) where both are, else 0. Cannot fail. */
VSH_API void vsh_compare_coverage(uint64_t count, const float *golden, const float *values, uint8_t *mask,
                                  vsh_coverage *coverage);

/* --- values */

/* Two planes of an image, or grids of voxels. A view; nothing is owned. */
typedef struct vsh_compared {
    int32_t size[3];     /* width, height, depth, 1 … 2^31 values in all; depth 1: an image */
    const float *golden; /* [depth][height][width] */
    const float *values; /* the same: what is to be like `golden` */
    const uint8_t *mask; /* the same: compared where it is not 0. NULL: everywhere */
} vsh_compared;

/* How values are compared. */
typedef struct vsh_compare_options {
    size_t struct_size;
    double threshold; /* of VSH_MEASURE_SHARE, in units of the range, 0 … 1 */
    double step;   /* a texel belongs to a lost or gained region where it is farther than this from all values
                      around its place, in units of the range, > 0 … 1 */
    int32_t reach; /* what is around: texels along each axis, 0 … 16. What moved less is not lost */
    double noise;  /* standard error of the differences that sampling is known to make, in units of the range,
                      0 … 1: threshold, step and the marks of edges give way by 2.6 of it */
} vsh_compare_options;

static inline vsh_compare_options vsh_compare_options_default(void) {
    vsh_compare_options options = {sizeof(vsh_compare_options), 0.02, 0.1, 2, 0.0};
    return options;
}

/* What is held against a limit. Values are taken in units of the range (vsh_measures.range), lengths in
 * texels.
 */
enum {
    VSH_MEASURE_NONFINITE =
        0, /* values that are NaN or infinite, in either, compared or not; the limit is 0 */
    VSH_MEASURE_RMSE = 1,
    VSH_MEASURE_BIAS = 2,     /* |mean difference| */
    VSH_MEASURE_MAX = 3,      /* largest difference */
    VSH_MEASURE_P99 = 4,      /* of the differences, nearest rank */
    VSH_MEASURE_SHARE = 5,    /* of values that differ by more than options.threshold */
    VSH_MEASURE_SSIM = 6,     /* structural similarity, 1: alike; at least the limit */
    VSH_MEASURE_PENUMBRA = 7, /* penumbrae are so much wider or narrower, as a share: 1 is twice or half */
    VSH_MEASURE_WIDTHS = 8,   /* mean |difference| of a penumbra's width, as a share of the mean width */
    VSH_MEASURE_EDGES = 9,    /* share of shadow edges that one has and the other has not */
    VSH_MEASURE_SHIFT = 10,   /* displacement, texels */
    VSH_MEASURE_LOST = 11,    /* texels of the largest region that got lighter as a whole: a caster is gone */
    VSH_MEASURE_GAINED = 12,  /* … darker: a caster came */
    VSH_MEASURE_COUNT = 13
};

/* "rmse" to VSH_MEASURE_RMSE and back; -1 and NULL for what is none. Names are static strings; NULL is none.
 */
VSH_API int32_t vsh_measure(const char *name);
VSH_API const char *vsh_measure_name(int32_t measure);

/* Whether the limit is the least that will do (VSH_MEASURE_SSIM), not the most: 1 or 0. */
VSH_API int32_t vsh_measure_at_least(int32_t measure);

/* Touching texels of one sign that have no counterpart around their place. Zeros where there is none. */
typedef struct vsh_region {
    uint64_t count; /* texels */
    uint64_t worst; /* index of the one farthest off */
    double by;      /* how far that is, new - golden, in units of the range */
    int32_t min[3]; /* x, y, z of the box around them, both inclusive */
    int32_t max[3];
} vsh_region;

/* Of two: golden, new. */
typedef struct vsh_measures {
    uint64_t count; /* values compared: masked in, finite in both */
    double range;   /* unit of all values here: 1, or the largest |golden| where that is more */
    double value[VSH_MEASURE_COUNT]; /* NaN where a measure does not apply: too few shadow edges, say */
    uint64_t nonfinite[2];           /* values that are no number */
    uint64_t nonfinite_first[2];     /* index; meaningless where there is none */
    double bias;                     /* with its sign, new - golden */
    uint64_t worst;                  /* index of the largest difference */
    double worst_value[2];           /* there, as they are */
    uint64_t edges[2];               /* shadow edges crossed */
    uint64_t pairs;                  /* of them found in both */
    double width[2];         /* mean width of those from 10 % to 90 %, texels; NaN where there are none */
    double shift[3];         /* x, y, z, texels: what stands at p in golden stands at p + shift in new */
    double explained;        /* share of the squared difference that vanishes when that is undone */
    vsh_region lost, gained; /* the largest of each */
    double noise;            /* standard error of the differences that neighbours along edges do not share */
    double noise_share;      /* its share of the squared difference. Noise excuses lost and gained regions as
                              * vsh_compare_options.noise does, and from a quarter on penumbrae and widths */
    double curve[3][2];      /* golden and new value at 1/4, 1/2 and 3/4 of golden's range, if a curve (gamma,
                              * exposure) explains 98 % of the squared difference that is no noise; else 0.
                              * Penumbrae, edges, shift and regions are then what differs besides the curve */
} vsh_measures;

/* Measures how far values are from golden ones. Takes 26 bytes a value beside the caller's; runs under the
 * stage "compare". The same bits for any number of threads. Errors:
 * - VSH_ERROR_ARGUMENT: compared, its planes or measures NULL, sizes, options out of range, run;
 * - VSH_ERROR_LIMIT: run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_compare(const vsh_compared *compared, const vsh_compare_options *options,
                               const vsh_run *run, vsh_measures *measures, vsh_error *error);

/* --- against a truth */

/* How far values are from the truth, over several planes together. Zeros where nothing is compared. */
typedef struct vsh_accuracy {
    uint64_t count;       /* values compared: masked in, finite in both */
    uint64_t penumbra;    /* of them with a truth in 0.02 … 0.98 */
    double rmse;          /* over all */
    double penumbra_rmse; /* over the penumbra; 0 where there is none */
    double bias;          /* mean of value - truth */
    double p95, p99;      /* of |value - truth|, nearest rank */
    double max;           /* the same, the largest */
    /* Σ |w - v| / Σ v over the penumbrae that lines of the truth along each axis cross from 0.1 to 0.9, v and
     * w the lengths that truth and values spend between the two around that place; NaN where there are none.
     * Unlike VSH_MEASURE_WIDTHS it asks for no edge in the values: a penumbra that is gone counts as 1. */
    double width_error;
} vsh_accuracy;

/* Measures how far planes of values, which lie in 0 … 1, are from their truth, which is `golden`. Takes 10
 * bytes a value with the caller's. Errors:
 * - VSH_ERROR_ARGUMENT: planes or accuracy NULL, a plane's values NULL, its size, run;
 * - VSH_ERROR_LIMIT: run->memory_limit;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_compare_accuracy(const vsh_compared *planes, size_t plane_count, const vsh_run *run,
                                        vsh_accuracy *accuracy, vsh_error *error);

/* --- limits */

/* What a channel is allowed. */
typedef struct vsh_limits {
    size_t struct_size;
    double value[VSH_MEASURE_COUNT]; /* of VSH_MEASURE_NONFINITE it is not looked at: it is 0 */
    vsh_compare_options options;     /* how its values are compared */
} vsh_limits;

/* Limits that bakes pass which differ by rounding: another compiler, files of 16 instead of 32 bits; and that
 * fail penumbrae a tenth wider, a shift of a quarter of a texel, a lost caster of four texels. */
VSH_API vsh_limits vsh_limits_default(void);

/* Widens limits, and sets options.noise, for values that were estimated: bakes whose standard errors are a
 * and b differ by noise of √(a² + b²), in units of the range, 0 … 1, and are alike all the same.
 * docs/regression.md has the formulas. Limits that are not to give way are set after it. Cannot fail. */
VSH_API void vsh_limits_allow_noise(vsh_limits *limits, double noise);

/* Bit i of the result: measure i does not hold. Measures that do not apply hold; nothing holds where nothing
 * was compared. */
VSH_API uint32_t vsh_compare_judge(const vsh_measures *measures, const vsh_limits *limits);

/* Limits from a JSON file (docs/regression.md): those for all channels, and those for some of them. */
typedef struct vsh_tolerances vsh_tolerances;

/* Reads such a file. Free it with vsh_tolerances_free(). Errors: VSH_ERROR_ARGUMENT (path or tolerances
 * NULL), VSH_ERROR_READ, VSH_ERROR_INPUT (no JSON, unknown keys, values out of range, with the place),
 * VSH_ERROR_LIMIT (one whose values may take over 64 MiB). */
VSH_API vsh_result vsh_tolerances_read(const char *path, vsh_tolerances **tolerances, vsh_error *error);
VSH_API void vsh_tolerances_free(vsh_tolerances *tolerances); /* NULL does nothing */

/* Puts what the file says of a channel over *limits, and of coverage over *coverage (NULL: not asked; the
 * share that may differ). tolerances NULL: nothing. Cannot fail. */
VSH_API void vsh_tolerances_apply(const vsh_tolerances *tolerances, const char *channel, vsh_limits *limits,
                                  double *coverage);

/* --- two files */

/* What came of a channel of two images, or of a grid of two .vdb files. */
typedef struct vsh_channel_comparison {
    char name[VSH_CHANNEL_NAME];    /* the channel's or the grid's */
    int32_t size[3];                /* depth 1: an image */
    int32_t origin[3];              /* index of the first voxel; 0 in images */
    int32_t is_coverage;            /* 1: it tells what is covered; the measures are not taken */
    vsh_coverage coverage;          /* of this channel, or this grid's active voxels */
    double coverage_limit;          /* that it was held to, as a share */
    double max_error[2];            /* that golden and new say they were made to; NaN: they don't */
    vsh_limits limits;              /* that it was held to */
    vsh_measures measures;          /* what was measured */
    uint32_t failed;                /* as of vsh_compare_judge() */
    int32_t coverage_failed, alike; /* 1 or 0 */
} vsh_channel_comparison;

/* NaN, and a reach of -1: what the tolerance file says, else what holds without. */
typedef struct vsh_compare_files_options {
    size_t struct_size;
    const char
        *tolerances; /* a file as of vsh_tolerances_read(); NULL: GOLDEN.tolerance.json, if it is there */
    const char *coverage; /* channel of images that tells what is covered; one that is not there: all is */
    double limits[VSH_MEASURE_COUNT]; /* of all channels */
    double coverage_limit;            /* covered texels that may be in one file alone, as a share */
    double threshold, step;           /* as of vsh_compare_options */
    double noise;    /* as of vsh_limits_allow_noise(); NaN: by the max errors of the files, where
                      * these or their methods, samplers or frames differ */
    int32_t reach;   /* as of vsh_compare_options */
    int32_t padding; /* 1: what is not covered is compared too */
    /* Sees the values of each channel that was measured, which hold until it returns; `index` is the
     * channel's. Other than 0 ends the comparison with VSH_ERROR_CANCELLED. May be NULL. */
    int32_t (*look)(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared);
    void *user; /* handed to `look` */
} vsh_compare_files_options;

static inline vsh_compare_files_options vsh_compare_files_options_default(void) {
    vsh_compare_files_options options = {
        sizeof(vsh_compare_files_options), NULL, "A", {0}, NAN, NAN, NAN, NAN, -1, 0, NULL, NULL};
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        options.limits[i] = NAN;
    }
    return options;
}

/* What came of two files. */
typedef struct vsh_comparison vsh_comparison;

/* Compares two images channel by channel, or two .vdb files grid by grid, over what both cover. That they
 * are not alike is no error, and neither are other sizes, channels, voxels or formats: those are problems of
 * the comparison. Free it with vsh_comparison_free(). Files from strangers are for run->reader (base.h).
 * Errors: as of vsh_tolerances_read(), vsh_image_read(), vsh_vdb_copy() and vsh_compare(), and
 * - VSH_ERROR_ARGUMENT: golden, fresh or comparison NULL, options, run;
 * - VSH_ERROR_INPUT: more than 4096 grids. */
VSH_API vsh_result vsh_compare_files(const char *golden, const char *fresh,
                                     const vsh_compare_files_options *options, const vsh_run *run,
                                     vsh_comparison **comparison, vsh_error *error);

/* 1: all channels and grids are alike, and there is no problem; 0. */
VSH_API int32_t vsh_comparison_alike(const vsh_comparison *comparison);

/* Channels, and lines of text that tell of problems, from index 0; NULL behind the last. They belong to the
 * comparison. */
VSH_API const vsh_channel_comparison *vsh_comparison_channel(const vsh_comparison *comparison, size_t index);
VSH_API const char *vsh_comparison_problem(const vsh_comparison *comparison, size_t index);

VSH_API void vsh_comparison_free(vsh_comparison *comparison); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
