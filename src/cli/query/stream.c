/* Points read, answered and written a batch at a time. A batch is VSH_QUERY_BATCH rows, so that every bit is
 * that of one call of the library for all, or as many as the memory limit holds. */
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/message.h"
#include "cli/progress.h"
#include "cli/try.h"
#include "query.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum {
    ORDER_BYTES = 16, /* a point of a call, as query.h says */
    TEXT_BYTES = 256, /* of a kept row of text: what is more makes batches smaller */
    LEAST_ROWS = 1024 /* what is not worth a smaller batch */
};

size_t query_answers_floats(const query_answers *a) {
    return a->lights * (a->shadow_error ? 2 : 1) + (a->ao ? a->ao_error ? 2 : 1 : 0) + (a->distance ? 1 : 0) +
           (a->gradient ? 3 : 0);
}

static float *add_column(query_answers *a, float **next, size_t room, const char *kind, const char *name,
                         size_t width) {
    static const char *const axes[] = {".x", ".y", ".z"};
    float *values = *next;
    *next += width * room;
    for (size_t i = 0; i < width; ++i) {
        cli_points_column *column = &a->columns[a->column_count++];
        snprintf(column->name, sizeof column->name, "%s%s%s", kind, name, width > 1 ? axes[i] : "");
        column->values = values + i;
        column->stride = width;
    }
    return values;
}

int query_answers_create(query_answers *a, size_t room) {
    const size_t floats = query_answers_floats(a);
    a->memory = malloc(room * floats * sizeof *a->memory);
    a->columns = calloc(floats, sizeof *a->columns);
    a->visibility = calloc(a->lights + 1, sizeof *a->visibility);
    a->deviation = calloc(a->lights + 1, sizeof *a->deviation);
    if (a->memory == NULL || a->columns == NULL || a->visibility == NULL || a->deviation == NULL) {
        return cli_out_of_memory("points");
    }
    float *next = a->memory;
    a->output = vsh_query_output_default();
    a->output.visibility = a->visibility;
    a->output.deviation = a->deviation;
    for (size_t l = 0; l < a->lights; ++l) {
        a->visibility[l] = add_column(a, &next, room, "shadow.", a->light[l].name, 1);
    }
    a->output.ao = a->ao ? add_column(a, &next, room, "ao", "", 1) : NULL;
    for (size_t l = 0; a->shadow_error && l < a->lights; ++l) {
        a->deviation[l] = add_column(a, &next, room, "error.", a->light[l].name, 1);
    }
    a->output.ao_deviation = a->ao && a->ao_error ? add_column(a, &next, room, "error.", "ao", 1) : NULL;
    a->output.distance = a->distance ? add_column(a, &next, room, "distance", "", 1) : NULL;
    a->output.gradient = a->gradient ? add_column(a, &next, room, "gradient", "", 3) : NULL;
    return CLI_OK;
}

void query_answers_free(query_answers *a) {
    free(a->memory);
    free(a->columns);
    free(a->visibility);
    free(a->deviation);
    a->memory = NULL;
    a->columns = NULL;
    a->visibility = a->deviation = NULL;
}

/* Rows of a batch, and the most of their own bytes that it holds. */
static int plan(const query_settings *s, const query_answers *answers, uint64_t held,
                const cli_points_reader *reader, bool keep, size_t *rows, size_t *most_kept) {
    const uint64_t limit = s->bake.common.memory_limit;
    const size_t row_size = reader->table.row_size; /* 0: of text */
    const size_t own = !keep          ? 0
                       : row_size > 0 ? 2 * row_size
                                      : TEXT_BYTES; /* room is taken twice what is used */
    const size_t each = cli_points_bytes(reader->has_normals, keep) + ORDER_BYTES + own +
                        query_answers_floats(answers) * sizeof(float);
    const size_t least = s->batch > 0 && s->batch < LEAST_ROWS ? (size_t)s->batch : LEAST_ROWS;
    *rows = s->batch > 0 ? (size_t)s->batch : VSH_QUERY_BATCH;
    while (limit > 0 && held + (uint64_t)*rows * each > limit && *rows / 2 >= least) {
        *rows /= 2;
    }
    if (limit > 0 && held + (uint64_t)*rows * each > limit) {
        char all[32], most[32];
        cli_say("%s: the field and %zu points at a time need %s, over the memory limit of %s",
                reader->table.source.name, *rows,
                vshi_bytes_text(held + (uint64_t)*rows * each, all, sizeof all),
                vshi_bytes_text(limit, most, sizeof most));
        return CLI_LIMIT;
    }
    *most_kept = *rows * own / 2;
    return CLI_OK;
}

/* Progress of a batch as a part of the file. */
typedef struct batch_progress {
    const vsh_run *run;
    double begin, share;
} batch_progress;

static int32_t report(void *user, const char *stage, double fraction) {
    const batch_progress *p = user;
    return p->run->progress(p->run->user, stage, p->begin + p->share * fraction);
}

static int answer_batch(const vsh_query *query, const query_answers *answers, const cli_points *points,
                        batch_progress *progress, cli_stats *stats) {
    const double start = vshi_seconds();
    vsh_run run = *progress->run;
    run.progress = report;
    run.user = progress;
    const vsh_points view = {points->count, points->positions, points->normals, points->texels};
    vsh_error error;
    const vsh_result result =
        vsh_query_points(query, &view, NULL, &run, &answers->output, &stats->shade, &error);
    cli_stats_stage(stats, CLI_STAGE_BAKE, start);
    return cli_check_result(result, &error);
}

static int answer_rows(const query_settings *s, const vsh_query *query, const query_answers *answers,
                       const vsh_run *run, size_t most_kept, cli_points_reader *reader, cli_points *points,
                       cli_points_writer *writer, cli_stats *stats) {
    batch_progress progress = {run, 0.0, 0.0};
    for (;;) {
        double start = vshi_seconds();
        CLI_TRY(cli_points_read(reader, most_kept, points));
        cli_stats_stage(stats, CLI_STAGE_LOAD, start);
        if (points->count == 0) {
            return CLI_OK;
        }
        const uint64_t size = reader->table.source.size;
        const double done = size > 0 ? (double)reader->table.source.taken / (double)size : 1.0;
        progress.begin = size > 0 ? progress.begin + progress.share : 0.0;
        progress.share = (done < 1.0 ? done : 1.0) - progress.begin;
        CLI_TRY(answer_batch(query, answers, points, &progress, stats));
        start = vshi_seconds();
        CLI_TRY(cli_points_write(writer, points));
        CLI_TRY(s->batch > 0 || size == 0 ? cli_points_writer_flush(writer) : CLI_OK);
        cli_stats_stage(stats, CLI_STAGE_WRITE, start);
    }
}

int query_stream(const query_settings *s, const vsh_query *query, query_answers *answers, uint64_t held,
                 const vsh_run *run, cli_points_reader *reader, cli_stats *stats) {
    cli_points points = {0};
    cli_points_writer writer = {0};
    size_t rows = 0, most_kept = 0;
    const bool keep = !s->answers_only && s->format == s->points_format && cli_points_can_keep(reader);
    int code = CLI_OK;
    CLI_TRY_DONE(plan(s, answers, held, reader, keep, &rows, &most_kept));
    CLI_TRY_DONE(cli_points_create(rows, reader->has_normals, keep, &points));
    CLI_TRY_DONE(query_answers_create(answers, rows));
    CLI_TRY_DONE(cli_points_writer_open(s->bake.output, s->format, s->answers_only, reader, answers->columns,
                                        answers->column_count, &writer));
    CLI_TRY_DONE(answer_rows(s, query, answers, run, most_kept, reader, &points, &writer, stats));
    const double start = vshi_seconds();
    CLI_TRY_DONE(cli_points_writer_commit(&writer, reader));
    cli_stats_stage(stats, CLI_STAGE_WRITE, start);
    stats->points = reader->table.rows;
    stats->bad_rows = reader->bad;
done:
    cli_points_writer_free(&writer);
    cli_points_free(&points);
    return code;
}
