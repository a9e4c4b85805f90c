/* What the parts of `vdbshade query` share. */
#ifndef CLI_QUERY_H
#define CLI_QUERY_H

#include "cli/bake/options.h"
#include "cli/stats.h"
#include "points.h"

typedef struct query_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it; its output and stats are ours */
    const char *points;
    int32_t format, points_format; /* VSHI_TABLE_…; -1: not given */
    int normals;                   /* as cli_points_open() takes it */
    bool distance, gradient, answers_only, strict;
    int32_t batch; /* rows; 0: as many as go */
    double within; /* 0: not given */
} query_settings;

/* What is asked of each point. */
typedef struct query_answers {
    size_t lights;
    const vsh_light *light;
    bool error, ao, distance, gradient;
    bool shadow_error, ao_error; /* of `error`, those that methods know */
    /* a batch's values */
    float *memory;
    float **visibility, **deviation; /* [lights] */
    vsh_query_output output;
    cli_points_column *columns;
    size_t column_count;
} query_answers;

size_t query_answers_floats(const query_answers *answers); /* a point */
int query_answers_create(query_answers *answers, size_t room);
void query_answers_free(query_answers *answers);

/* Reads, answers and writes until the points end. */
int query_stream(const query_settings *settings, const vsh_query *query, query_answers *answers,
                 uint64_t held, const vsh_run *run, cli_points_reader *reader, cli_stats *stats);

#endif
