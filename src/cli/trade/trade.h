/* vdbshade trade: time and error of many ways to bake one scene. */
#ifndef CLI_TRADE_H
#define CLI_TRADE_H

#include "cli/bake/options.h"

enum { TRADE_MAX_RESOLUTIONS = 16 };

typedef struct trade_settings {
    cli_bake_settings bake; /* the scene, with the options that `bake` has too */
    const char *page;
    const char *csv;                            /* NULL: none */
    int32_t resolutions[TRADE_MAX_RESOLUTIONS]; /* descending */
    size_t resolution_count;
    int32_t truth_rays;
    int32_t receiver; /* -1: all */
    double budget;    /* seconds */
} trade_settings;

/* A plane of values holds the texels of all receivers, one receiver after the other. */
typedef struct trade_receiver {
    vsh_charts *charts;
    vsh_charts_info info;
    size_t first; /* its first texel in a plane */
} trade_receiver;

/* One way to bake, its time and its error. */
typedef struct trade_run {
    const char *method; /* a static string */
    char options[128];  /* of `bake` */
    int32_t resolution; /* 0: none, or chosen by auto */
    bool embree;        /* Embree's rays alone */
    bool front;         /* no other run is both faster and nearer to the truth */
    double build_s;
    double bake_s;
    double rate;          /* microseconds for one light at one texel, or one texel's AO */
    uint64_t bytes;       /* of the field and the triangles */
    size_t valid;         /* texels with a value in this run */
    vsh_accuracy metrics; /* over the texels that are valid in all fields */
    double valid_rmse;    /* over the run's own valid texels */
} trade_run;

/* The casters at one resolution, or as auto makes them. */
typedef struct trade_field {
    int32_t resolution;    /* 0: chosen by auto */
    vsh_occluders *voxels; /* NULL for auto */
    vsh_occluders *traced; /* `voxels` with triangles, if all casters are meshes */
    double build_s;
    uint8_t *mask; /* [texels]: 1 where the texel is valid */
    size_t valid;  /* texels */
} trade_field;

/* The shadows of all lights, or AO. */
typedef struct trade_subject {
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
    double low[3], high[3]; /* world box of the receivers' samples; low > high: there are none */
    double samples;
    size_t texels;            /* of all lightmaps */
    size_t covered;           /* by charts */
    vsh_triangles *triangles; /* of the mesh casters; NULL without any */
    vsh_solids *solids;       /* of the procedural casters; NULL without any */
    bool meshes;              /* all casters are triangles, and Embree is there */
    double triangles_s;
    trade_field fields[TRADE_MAX_RESOLUTIONS]; /* finest first */
    size_t field_count;
    uint8_t *common; /* [texels]: 1 where a texel is valid in all fields: runs are compared there */
    uint8_t *any;    /* [texels]: 1 where a texel is valid in a field: the truth is known there */
    size_t common_count;
    size_t points;     /* texels of `any` */
    double *positions; /* [points][3] */
    float *normals;    /* [points][3] */
    uint32_t *texel;   /* [points]: place in a plane */
    float *traced;     /* [points]: values of the rays */
    trade_subject subjects[2];
    size_t subject_count;
    float *values;          /* [planes of the larger subject][texels]: those of the run being measured */
    float **planes;         /* [lights]: of a receiver that is baked */
    vsh_compared *compared; /* [planes of the larger subject][receivers] */
    size_t skipped;         /* runs that did not fit into the budget */
    double measuring;       /* when the budget began, seconds */
    double truth_s;
} trade_work;

/* Write the page and the CSV of settings. CLI_OK or an exit code, having said why. */
int trade_write_page(const trade_work *work);
int trade_write_csv(const trade_work *work);

#endif
