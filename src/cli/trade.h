/* Error against time on the user's own scene: what `vdbshade trade` measures and what its report shows. */
#ifndef CLI_TRADE_H
#define CLI_TRADE_H

#include "bake_options.h"

enum { TRADE_MAX_RESOLUTIONS = 16 };

typedef struct trade_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it */
    const char *report;
    const char *csv;
    int32_t resolutions[TRADE_MAX_RESOLUTIONS];
    size_t resolution_count;
    int32_t truth_rays;
    double budget; /* seconds */
} trade_settings;

typedef struct trade_metrics {
    size_t count;         /* valid texels, over all lights */
    size_t penumbra;      /* of them with a truth in 0.02 … 0.98 */
    double rmse;          /* over all */
    double penumbra_rmse; /* 0 where there is no penumbra */
    double bias;          /* mean of value - truth */
    double p95, p99, max; /* of |value - truth| */
    double width_error;   /* of the 10 % to 90 % distance, relative to it; NaN where no penumbra has one */
} trade_metrics;

/* One way to bake, and what came of it. */
typedef struct trade_run {
    const char *method;
    char options[128];  /* as `bake` takes them */
    int32_t resolution; /* 0: no voxels */
    bool embree;        /* rays alone, no cone before them */
    bool front;         /* nothing is both faster and nearer to the truth */
    double build_s;
    double bake_s;
    uint64_t bytes;   /* of field and triangles */
    double certified; /* share of the values that a cone proved; NaN for rays alone */
    trade_metrics metrics;
    float *values; /* as trade_subject.truth */
} trade_run;

typedef struct trade_field {
    int32_t resolution;
    vsh_field *field;
    double build_s;
} trade_field;

/* Shadows of all lights, or AO. */
typedef struct trade_subject {
    const char *name; /* "shadow", "ao" */
    bool ao;
    size_t planes; /* lights, or 1 */
    float *truth;  /* [planes][height][width] */
    trade_run *runs;
    size_t run_count;
} trade_subject;

typedef struct trade_work {
    const trade_settings *settings;
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    vsh_texels *texels;
    vsh_texels_info info;
    vsh_triangles *triangles; /* NULL where a caster is no mesh, or there is no Embree */
    double triangles_s;
    trade_field fields[TRADE_MAX_RESOLUTIONS]; /* finest first */
    size_t field_count;
    float *mask; /* [height][width]: 1 where the finest field finds a texel valid */
    size_t valid;
    double *positions; /* [valid][3]: of the valid texels, lifted */
    float *normals;    /* [valid][3] */
    uint32_t *texel;   /* [valid] */
    trade_subject subjects[2];
    size_t subject_count;
    size_t skipped; /* runs that did not fit into the budget */
    double began;
    char truth_text[160]; /* what the truth is, for the report */
} trade_work;

/* Takes the values, which belong to the subject from then on; NULL where memory is short. */
trade_run *trade_add(trade_work *work, trade_subject *subject, const trade_run *run);

size_t trade_texels(const trade_work *work);
double trade_now(const trade_work *work);  /* seconds to take differences of */
double trade_left(const trade_work *work); /* seconds of the budget */
int trade_out_of_memory(const char *what);

/* All of these return CLI_OK or an exit code, having said why. */
int trade_make_field(trade_work *work, int32_t resolution, vsh_field **field, double *seconds);
int trade_measure(trade_work *work);
int trade_take_mask(trade_work *work, const vsh_field *field);
int trade_take_truth(trade_work *work, int32_t finest);
int trade_measure_embree(trade_work *work);
int trade_write_report(const trade_work *work);
int trade_write_csv(const trade_work *work);

/* NaN in no field but width_error. */
int trade_compare(const trade_work *work, const trade_subject *subject, const float *values,
                  trade_metrics *metrics);

#endif
