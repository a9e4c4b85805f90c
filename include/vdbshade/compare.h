/* Compares baked values with golden ones: measures, their limits, and files of limits.
 *
 * A plain RMSE hardly notices lost penumbrae. So there is one measure for each way in which bakes go wrong:
 * wider penumbrae, shifted values, shadows without their casters. docs/pipeline.md has the formulas, their
 * sources, and what each measure cannot see.
 *
 *     vsh_comparison *comparison;
 *     const vsh_channel_comparison *channel;
 *     vsh_compare_files("golden.exr", "new.exr", NULL, &run, &comparison, &error);
 *     for (size_t i = 0; (channel = vsh_comparison_channel(comparison, i)) != NULL; ++i) {
 *         printf("%s: %s\n", channel->name, channel->alike ? "alike" : "not alike");
 *     }
 *     vsh_comparison_free(comparison);
 */
#pragma once

#include "image.h"

#include <math.h>

VSH_BEGIN_C

/* --- coverage */

typedef struct vsh_coverage {
    uint64_t golden;  /* texels covered in golden */
    uint64_t values;  /* texels covered in the new values */
    uint64_t both;    /* texels covered in both: there, values are compared */
    uint64_t differs; /* texels covered in one alone */
    uint64_t first;   /* index of the first of those; `count` if there are none */
    double share;     /* differs / texels covered in either; 0 if there are none */
} vsh_coverage;

/* --- values */

/* Two planes of an image, or grids of voxels. A view; nothing is owned. */
typedef struct vsh_compared {
    int32_t size[3];     /* width, height, depth, 1 … 2^31 values in all; depth 1: an image */
    const float *golden; /* [depth][height][width] */
    const float *values; /* [depth][height][width]: the new values */
    const uint8_t *mask; /* [depth][height][width]: nonzero values are compared. NULL: all are */
} vsh_compared;

/* How values are compared. Values are in units of the range (vsh_measures.range). */
typedef struct vsh_compare_options {
    size_t struct_size;
    double step;   /* a texel is lost or gained if it differs by this from all values nearby, > 0 … 1 */
    int32_t reach; /* texels along each axis that count as nearby, 0 … 16 */
    double noise;  /* standard error that sampling makes between the two, 0 … 1; measures allow for it */
} vsh_compare_options;

static inline vsh_compare_options vsh_compare_options_default(void) {
    vsh_compare_options options = {sizeof(vsh_compare_options), 0.1, 2, 0.0};
    return options;
}

/* The measures, each with an upper limit. The first that fails names the fault best: a shifted bake also
 * fails most of those after it. Values are in units of the range, lengths in texels. */
typedef enum vsh_measure {
    VSH_MEASURE_NONFINITE = 0, /* NaN and infinite values of both, compared or not; the limit is always 0 */
    VSH_MEASURE_SHIFT = 1,     /* displacement, texels */
    VSH_MEASURE_PENUMBRA = 2,  /* change of the mean penumbra width, as a share: 1 is twice or half */
    VSH_MEASURE_LOST = 3,      /* texels of the largest region that lost its shadow */
    VSH_MEASURE_GAINED = 4,    /* texels of the largest region that got a new shadow */
    VSH_MEASURE_RMSE = 5,      /* root mean square difference */
    VSH_MEASURE_P99 = 6,       /* 99th percentile of the differences, nearest rank */
    VSH_MEASURE_MAX = 7        /* largest difference */
} vsh_measure;
enum { VSH_MEASURE_COUNT = 8 };

/* Touching texels that all got lighter, or all darker, with no like value nearby. Zeros if there are none. */
typedef struct vsh_region {
    uint64_t count; /* texels */
    uint64_t worst; /* index of the texel that differs most */
    double by;      /* its difference, new - golden, in units of the range */
    int32_t min[3]; /* x, y, z of the bounding box, inclusive */
    int32_t max[3];
} vsh_region;

/* Arrays of two: golden, new. */
typedef struct vsh_measures {
    uint64_t count;                  /* values compared: masked in, finite in both */
    double range;                    /* unit of all values here: 1, or the largest |golden| if that is more */
    double value[VSH_MEASURE_COUNT]; /* NaN if a measure does not apply, e.g. with too few shadow edges */
    uint64_t nonfinite[2];           /* NaN and infinite values */
    uint64_t nonfinite_first[2];     /* index of the first; meaningless if there are none */
    uint64_t worst;                  /* index of the largest difference */
    double worst_value[2];           /* the values there, not scaled */
    uint64_t pairs;                  /* shadow edges found in both */
    double width[2];                 /* their mean width from 10 % to 90 %, texels; NaN without pairs */
    double shift[3];                 /* x, y, z, texels: golden's value at p is the new value at p + shift */
    double explained;        /* share of the squared difference that vanishes when the shift is undone */
    vsh_region lost, gained; /* the largest of each */
} vsh_measures;

/* Measures how far values are from golden ones. Takes 9 bytes a value beside the caller's, and runs under
 * the stage "compare" on one thread. Errors:
 * - VSH_ERROR_ARGUMENT: compared, its planes or measures are NULL; sizes, options or run out of range;
 * - VSH_ERROR_LIMIT: run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_compare(const vsh_compared *compared, const vsh_compare_options *options,
                               const vsh_run *run, vsh_measures *measures, vsh_error *error);

/* --- against a truth */

/* Errors of values against the truth, over several planes together. Zeros if nothing is compared. */
typedef struct vsh_accuracy {
    uint64_t count; /* values compared: masked in, finite in both */
    double rmse;    /* root mean square of value - truth */
    double p99;     /* of |value - truth|, nearest rank */
    double max;     /* largest |value - truth| */
} vsh_accuracy;

/* Measures how far planes of values, 0 … 1, are from their truth, which is `golden`. Takes a byte a value
 * beside the caller's. Errors:
 * - VSH_ERROR_ARGUMENT: planes or accuracy NULL, a plane's values NULL, its size, run;
 * - VSH_ERROR_LIMIT: run->memory_limit;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_compare_accuracy(const vsh_compared *planes, size_t plane_count, const vsh_run *run,
                                        vsh_accuracy *accuracy, vsh_error *error);

/* --- limits */

/* Limits of one channel. */
typedef struct vsh_limits {
    size_t struct_size;
    double value[VSH_MEASURE_COUNT]; /* the largest values that pass; VSH_MEASURE_NONFINITE's is ignored */
    vsh_compare_options options;     /* how its values are compared */
} vsh_limits;

/* --- two files */

/* Result for a channel of two images, or a grid of two .vdb files. */
typedef struct vsh_channel_comparison {
    char name[VSH_CHANNEL_NAME];    /* the channel's or the grid's */
    int32_t size[3];                /* depth 1: an image */
    int32_t origin[3];              /* index of the first voxel; 0 in images */
    int32_t is_coverage;            /* 1: this is the coverage channel, and has no measures */
    vsh_coverage coverage;          /* of this channel, or this grid's active voxels */
    double coverage_limit;          /* share of covered texels that may differ */
    double max_error[2];            /* --max-error of golden and new by their files; NaN: unknown */
    vsh_limits limits;              /* limits used */
    vsh_measures measures;          /* measured differences */
    uint32_t failed;                /* bit i is set if measure i fails */
    int32_t coverage_failed, alike; /* 1 or 0 */
} vsh_channel_comparison;

/* NaN, and a reach of -1, mean: use the tolerance file's value, else the default. */
typedef struct vsh_compare_files_options {
    size_t struct_size;
    /* JSON file of limits (docs/pipeline.md); NULL: GOLDEN.tolerance.json if it exists */
    const char *tolerances;
    const char *coverage; /* channel of images with coverage; if it is missing, everything is covered */
    double limits[VSH_MEASURE_COUNT]; /* of all channels */
    double coverage_limit;            /* share of covered texels that may be in one file alone */
    double step;                      /* as of vsh_compare_options */
    double noise;  /* standard error that sampling leaves, in units of the range; NaN: from the max errors in
                    * the files, if these or the methods, samplers or frames differ */
    int32_t reach; /* as of vsh_compare_options */
    int32_t padding; /* 1: compare texels that are not covered, too */
    /* Called with the values of each measured channel; `index` is the channel's. The arrays are valid until
     * it returns. A nonzero result ends the comparison with VSH_ERROR_CANCELLED. May be NULL. */
    int32_t (*look)(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared);
    void *user; /* passed to `look` */
} vsh_compare_files_options;

static inline vsh_compare_files_options vsh_compare_files_options_default(void) {
    vsh_compare_files_options options = {
        sizeof(vsh_compare_files_options), NULL, "A", {0}, NAN, NAN, NAN, -1, 0, NULL, NULL};
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        options.limits[i] = NAN;
    }
    return options;
}

/* Result of comparing two files. */
typedef struct vsh_comparison vsh_comparison;

/* Compares two images channel by channel, or two .vdb files grid by grid, over what both cover. Different
 * values are no error. Different sizes, channels, voxels or formats are problems of the comparison, not
 * errors. Free it with vsh_comparison_free(). Read files from strangers with run->reader (base.h).
 * Errors: those of vsh_image_read(), vsh_grid_read() and vsh_compare(), and
 * - VSH_ERROR_ARGUMENT: golden, fresh or comparison NULL, options, run;
 * - VSH_ERROR_INPUT: more than 4096 grids. */
VSH_API vsh_result vsh_compare_files(const char *golden, const char *fresh,
                                     const vsh_compare_files_options *options, const vsh_run *run,
                                     vsh_comparison **comparison, vsh_error *error);

/* Return the channels, and lines of text about problems, from index 0; NULL after the last. They belong to
 * the comparison. */
VSH_API const vsh_channel_comparison *vsh_comparison_channel(const vsh_comparison *comparison, size_t index);
VSH_API const char *vsh_comparison_problem(const vsh_comparison *comparison, size_t index);

/* Returns 1 if all channels or grids are alike and there is no problem, else 0; 0 for NULL. */
static inline int32_t vsh_comparison_alike(const vsh_comparison *comparison) {
    const vsh_channel_comparison *channel = vsh_comparison_channel(comparison, 0);
    for (size_t i = 1; channel != NULL && channel->alike; ++i) {
        channel = vsh_comparison_channel(comparison, i);
    }
    return comparison != NULL && channel == NULL && vsh_comparison_problem(comparison, 0) == NULL;
}

VSH_API void vsh_comparison_free(vsh_comparison *comparison); /* NULL does nothing */

VSH_END_C
