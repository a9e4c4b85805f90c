/* Error against time on the user's own scene: what `vdbshade trade` measures and what its report shows. */
#ifndef CLI_TRADE_H
#define CLI_TRADE_H

#include "cli/bake/options.h"

#include <stdio.h>

enum { TRADE_MAX_RESOLUTIONS = 16, TRADE_LEAST_RESOLUTION = 2, TRADE_MOST_RESOLUTION = 65536 };

typedef struct trade_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it */
    const char *report;
    const char *csv;
    const char *plot;
    const char *view;
    int32_t resolutions[TRADE_MAX_RESOLUTIONS]; /* descending */
    size_t resolution_count;
    int32_t truth_rays;
    int32_t receiver; /* -1: all */
    double budget;    /* seconds */
} trade_settings;

/* What is done, in the order in which one process does it. */
typedef enum trade_kind {
    TRADE_TRUTH, /* of one subject, or (subject_count) of all */
    TRADE_EMBREE,
    TRADE_AUTO,
    TRADE_METHOD
} trade_kind;

typedef struct trade_task {
    trade_kind kind;
    size_t subject;
    size_t field;     /* TRADE_METHOD: on which */
    int32_t method;   /* … */
    int32_t number;   /* rays or cones; 0: none */
    double max_error; /* 0: none */
} trade_task;

/* Every plane of values holds the texels of all receivers, one receiver after the other. */
typedef struct trade_receiver {
    const char *path;
    vsh_charts *charts;
    vsh_charts_info info;
    double low[3], high[3]; /* world box of its samples */
    size_t first;           /* of its texels, in a plane */
} trade_receiver;

/* One way to bake, and what came of it. */
typedef struct trade_run {
    size_t task;
    const char *method;
    char options[128];  /* as `bake` takes them */
    int32_t resolution; /* 0: no voxels, or those that auto takes */
    bool embree;        /* rays alone, no cone before them */
    bool front;         /* nothing is both faster and nearer to the truth */
    double build_s;
    double bake_s;
    double rate;      /* microseconds that the bake takes for a value: one light's at a texel, or its AO */
    uint64_t bytes;   /* of field and triangles */
    double certified; /* share of the values that a cone proved; NaN for rays alone */
    size_t valid;     /* texels that it gave a value, over one plane */
    vsh_accuracy metrics; /* over the texels that all runs have */
    double valid_rmse;    /* over all texels that it gave a value */
    float *values;        /* as trade_subject.truth */
    uint8_t *mask;        /* [texels]: 1 where it is to be compared; NULL: as its field says, or where there
                             is any truth */
} trade_run;

typedef struct trade_field {
    int32_t resolution;
    vsh_occluders *occluders; /* of voxels alone */
    vsh_occluders *traced;    /* with triangles, where casters are all meshes */
    double build_s;
    uint8_t *mask; /* [texels]: 1 where a bake on this field finds a texel valid */
    size_t valid;  /* how many those are */
} trade_field;

/* Shadows of all lights, or AO. */
typedef struct trade_subject {
    const char *name; /* "shadow", "ao" */
    bool ao;
    size_t planes; /* lights, or 1 */
    float *truth;  /* [planes][texels] */
    trade_run *runs;
    size_t run_count;
} trade_subject;

typedef struct trade_work {
    const trade_settings *settings;
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    trade_receiver *receivers;
    size_t receiver_count;
    size_t texels; /* of all receivers' lightmaps */
    size_t covered;
    vsh_triangles *triangles; /* of the mesh casters; NULL where there are none, or there is no Embree */
    vsh_solids *solids;       /* of the procedural casters; NULL where there are none */
    bool meshes;              /* casters are all meshes, and there is Embree: exact, and Embree's own curve */
    double triangles_s;
    trade_field fields[TRADE_MAX_RESOLUTIONS]; /* finest first */
    size_t field_count;
    uint8_t *common; /* [texels]: 1 where all fields find a texel valid: what all runs are measured on */
    size_t common_count;
    size_t points;     /* texels that any field finds valid: what truth is for */
    double *positions; /* [points][3]: lifted, see trade_texels.c */
    float *normals;    /* [points][3] */
    uint32_t *texel;   /* [points], in a plane */
    uint8_t *any;      /* [texels]: 1 where any field finds a texel valid */
    trade_subject subjects[2];
    size_t subject_count;
    trade_task *tasks; /* [task_count] */
    size_t task_count;
    size_t skipped; /* runs that did not fit into the budget */
    double began;
    double measuring; /* since when: what the budget is for */
    double truth_s;
    char truth_text[320]; /* what the truth is, for the report */
} trade_work;

/* Takes the run with its values and mask, which belong to its subject from then on. CLI_OK or an exit code;
 * the run is then still the caller's. */
int trade_add(trade_work *work, trade_run *run);

double trade_now(const trade_work *work);  /* seconds to take differences of */
double trade_left(const trade_work *work); /* seconds of the budget */

/* A measured time is the median of a few, where they are short. */
enum { TRADE_REPEATS = 3 };
#define TRADE_SHORT_SECONDS 0.3
typedef struct trade_clock {
    double times[TRADE_REPEATS];
    int count;
} trade_clock;
bool trade_again(const trade_clock *clock); /* whether to measure once more */
double trade_median(trade_clock *clock);

/* All of these return CLI_OK or an exit code, having said why. */
int trade_load(trade_work *work);
int trade_make_occluders(trade_work *work, int32_t resolution, vsh_occluders **occluders, double *seconds);
int trade_add_triangles(const trade_work *work, trade_field *field);
int trade_take_masks(trade_work *work);
int trade_place_points(trade_work *work);
void trade_describe_truth(trade_work *work);
int trade_take_truth(trade_work *work, const trade_task *task);
int trade_measure_embree(trade_work *work, const trade_task *task);
int trade_measure(trade_work *work, const trade_task *task); /* TRADE_AUTO, TRADE_METHOD */
int trade_write_report(const trade_work *work);
int trade_write_csv(const trade_work *work);
int trade_write_plot(const trade_work *work);

/* --view: whether a page can show the scene, and then what was loaded; and the page, last of all: values are
 * grown for it. */
int trade_check_view(const trade_settings *settings, const vsh_scene *scene);
int trade_check_view_uvs(const trade_work *work);
int trade_write_view(const trade_work *work);

/* Bakes all receivers into planes of shadow [lights][texels], of AO or of coverage (each may be NULL). */
int trade_bake(const trade_work *work, const vsh_occluders *occluders, const vsh_shade_options *shade,
               float *shadow, float *ao, float *coverage, vsh_shade_stats *stats);

/* The name of a run and what `bake` calls its options, by its task. */
void trade_name_run(const trade_work *work, trade_run *run);

/* Lists what is to be done, once there are masks and fields. */
int trade_list_tasks(trade_work *work);

/* --- parts of the report */

/* Options as code, to be broken between them only. */
void trade_options_write(FILE *out, const char *options);

/* Truth, bake and difference of each run on the front, for the first receivers; ends the paragraph before. */
void trade_thumbnails_write(FILE *out, const trade_work *work, const trade_subject *subject);

/* Writes an SVG, to stand in a page or alone: RMSE over time, both logarithmic; the runs of a method at a
 * voxel size, the Pareto front and Embree's rays as lines. */
void trade_plot_write(FILE *out, const trade_work *work, const trade_subject *subject);

#endif
