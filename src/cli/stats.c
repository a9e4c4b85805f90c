#include "stats.h"

#include "clock.h"
#include "message.h"
#include "signals.h"
#include "temporary.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

static const char *const stage_names[CLI_STAGE_COUNT] = {"load", "voxelize", "field", "bake", "write"};

double cli_stats_stage(cli_stats *stats, int stage, double since) {
    const double now = cli_seconds();
    stats->seconds[stage] += now - since;
    return now;
}

static uint64_t peak_bytes(void) {
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (uint64_t)usage.ru_maxrss * 1024 : 0;
}

/* Of the field, for each active voxel of the level set. */
static double bytes_per_voxel(const cli_stats *stats) {
    return (double)stats->field.bytes / fmax(1.0, (double)stats->field.active_voxels);
}

/* The JSON file. */
static int write_file(const cli_stats *stats, const char *path) {
    json_t *stages = json_object();
    for (int i = 0; i < CLI_STAGE_COUNT; ++i) {
        json_object_set_new(stages, stage_names[i], json_real(stats->seconds[i]));
    }
    typedef struct count {
        const char *name;
        uint64_t value;
    } count;
    const count own[][3] = {
        [CLI_STATS_TEXELS] = {{"texels", stats->texels},
                              {"invalid_texels", stats->invalid_texels},
                              {"bands", stats->bands}},
        [CLI_STATS_POINTS] = {{"points", stats->points},
                              {"bad_rows", stats->bad_rows},
                              {"beyond_reach", stats->shade.beyond_reach}},
        [CLI_STATS_VOXELS] = {{"voxels", stats->voxels},
                              {"inside_voxels", stats->inside_voxels},
                              {"tiles", stats->tiles}},
    };
    const count counts[] = {
        own[stats->of][0],
        own[stats->of][1],
        {"samples", stats->shade.samples},
        {"marches", stats->shade.marches},
        {"certified", stats->shade.certified},
        {"unfinished", stats->shade.unfinished},
        {"skipped", stats->shade.skipped},
        {"rays", stats->shade.rays},
        {"refined", stats->shade.refined},
        {"peak_bytes", peak_bytes()},
        own[stats->of][2],
        {"threads", (uint64_t)stats->threads},
        {"levels", (uint64_t)stats->field.levels},
        {"field_bytes", stats->field.bytes},
        {"active_voxels", stats->grid.active_voxels},
    };
    json_t *root = json_object();
    json_object_set_new(root, "version", json_string(vsh_version()));
    json_object_set_new(root, "stages_s", stages);
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; ++i) {
        json_object_set_new(root, counts[i].name, json_integer((json_int_t)counts[i].value));
    }
    if (stats->of == CLI_STATS_TEXELS) {
        json_object_set_new(root, "resumed_rows", json_integer((json_int_t)stats->resumed_rows));
    }
    /* what adaptive and exact methods say of themselves; null where no such method ran */
    const double values = stats->estimated_values;
    json_object_set_new(root, "certified_share",
                        values > 0.0 ? json_real(1.0 - fmin(1.0, (double)stats->shade.refined / values))
                                     : json_null());
    json_object_set_new(root, "estimated_rmse",
                        values > 0.0 ? json_real(sqrt(stats->shade.square_error / values)) : json_null());
    json_object_set_new(root, "field_bytes_per_voxel", json_real(bytes_per_voxel(stats)));
    json_object_set_new(root, "voxel_size", json_real(stats->grid.voxel_size));
    char *text = json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    json_decref(root);
    if (text == NULL) {
        cli_say("%s: the system refused memory", path);
        return CLI_LIMIT;
    }
    const int code = cli_temporary_write(path, text);
    free(text);
    return code;
}

cli_stats cli_stats_begin(int32_t of, int32_t threads) {
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return (cli_stats){
        .of = of, .shade = vsh_shade_stats_zero(), .threads = threads > 0 ? threads : (int32_t)cores};
}

int cli_stats_finish(const cli_stats *stats, const char *path) {
    int code = CLI_OK;
    if (path != NULL) {
        cli_signals_writing(path);
        code = write_file(stats, path);
        cli_signals_writing(NULL);
    }
    if (code == CLI_OK) {
        cli_signals_end();
    }
    return code;
}

void cli_stats_say(const cli_stats *stats) {
    char field[32], peak[32];
    if (stats->field.bytes == 0) {
        cli_say("no voxels, %d thread%s, peak %s", stats->threads, stats->threads == 1 ? "" : "s",
                cli_bytes_text(peak_bytes(), peak, sizeof peak));
    } else {
        cli_say("voxel %.4g, %" PRIu64
                " active voxels, field of %d level%s in %s (%.1f bytes a voxel), %d thread%s, "
                "peak %s",
                stats->grid.voxel_size, stats->grid.active_voxels, stats->field.levels,
                stats->field.levels == 1 ? "" : "s", cli_bytes_text(stats->field.bytes, field, sizeof field),
                bytes_per_voxel(stats), stats->threads, stats->threads == 1 ? "" : "s",
                cli_bytes_text(peak_bytes(), peak, sizeof peak));
    }
    const double *s = stats->seconds;
    cli_say("load %.2f s, voxelize %.2f s, field %.2f s, %s %.2f s, write %.2f s", s[CLI_STAGE_LOAD],
            s[CLI_STAGE_VOXELIZE], s[CLI_STAGE_FIELD], stats->of == CLI_STATS_POINTS ? "shade" : "bake",
            s[CLI_STAGE_BAKE], s[CLI_STAGE_WRITE]);
}
