/* vdbshade bake: from files to lightmaps. */
#include "bake_expect.h"
#include "bake_forecast.h"
#include "bake_options.h"
#include "box.h"
#include "clock.h"
#include "invalid.h"
#include "meshes.h"
#include "message.h"
#include "paths.h"
#include "progress.h"
#include "receiver.h"
#include "resume.h"
#include "signals.h"
#include "targets.h"
#include "temporary.h"
#include "warnings.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct bake_work {
    const cli_bake_settings *settings;
    const vsh_scene *given;
    vsh_scene *scene; /* that of the targets */
    vsh_run run;
    vsh_assets *assets;
    cli_targets targets;
    vsh_occluders *occluders;
    /* of the only receiver; several are rasterised again, so as not to hold all at once */
    vsh_charts *charts;
    vsh_texels *kept; /* NULL where it is baked in bands */
    cli_box receivers;
    cli_origin origin;
    cli_stats stats;
} bake_work;

static int make_folder_of(const char *output) {
    char *folder = cli_targets_folder(output);
    const int code = folder != NULL ? cli_make_folder(folder) : cli_out_of_memory(output);
    free(folder);
    return code;
}

/* What can be refused before anything is read. */
static int check_files(const cli_bake_settings *settings, const vsh_scene *scene) {
    int code = settings->stats != NULL ? cli_temporary_check(settings->stats) : CLI_OK;
    if (code == CLI_OK && settings->invalid_picture != NULL) {
        code = settings->resume
                   ? cli_usage("--invalid '%s': not together with --resume", settings->invalid_picture)
                   : cli_invalid_check(settings->invalid_picture);
    }
    const bool makes = settings->output_folder != NULL || settings->per_object;
    for (size_t i = 0; i < scene->receiver_count && code == CLI_OK; ++i) {
        const char *output = scene->receivers[i].output;
        if (makes && settings->dry_run) {
            continue; /* its folder need not be there yet */
        }
        code = makes ? make_folder_of(output) : cli_check_folder(output);
        code = code == CLI_OK
                   ? cli_receiver_check(scene, i, settings->output == NULL ? settings->input : NULL)
                   : code;
    }
    return code;
}

static int load(bake_work *work) {
    const double start = cli_seconds();
    int code = cli_load_assets(work->given, &work->run, &work->assets);
    if (code == CLI_OK) {
        code = cli_targets_make(work->given, work->assets, work->settings->per_object, &work->targets);
    }
    for (size_t i = 0; i < work->targets.scene.receiver_count && code == CLI_OK; ++i) {
        code = cli_bake_check_output(work->settings, work->given, work->targets.receivers[i].output);
    }
    work->scene = &work->targets.scene;
    cli_stats_stage(&work->stats, CLI_STAGE_LOAD, start);
    return code;
}

static cli_receiver_job receiver_job(const bake_work *work, size_t index) {
    return (cli_receiver_job){.scene = work->scene,
                              .meshes = work->targets.meshes[index],
                              .mesh_count = work->targets.mesh_counts[index],
                              .run = &work->run,
                              .index = index,
                              .band_rows = work->settings->band_rows,
                              .origin = &work->origin,
                              .resume = work->settings->resume,
                              .invalid_picture = work->settings->invalid_picture};
}

/* Where its samples are: all of them are made, where they go into memory at once, or looked at in passing. */
static int find_bounds(const bake_work *work, const cli_receiver_job *job, const vsh_charts *charts,
                       vsh_texels **texels, vsh_texels_info *info) {
    cli_bands bands;
    int code = cli_receiver_plan(job, charts, 0, &bands);
    if (code == CLI_OK && bands.count == 1) {
        code = cli_receiver_texels(charts, 0, bands.rows, &work->run, texels);
        if (code == CLI_OK) {
            vsh_texels_get_info(*texels, info);
        }
    } else if (code == CLI_OK) {
        vsh_charts_info counted;
        vsh_charts_get_info(charts, &counted);
        info->samples = counted.samples;
        vsh_error error;
        if (vsh_charts_bounds(charts, &work->run, info->bounds_min, info->bounds_max, &error) != VSH_OK) {
            code = cli_fail_of(NULL, &error);
        }
    }
    return code;
}

/* UVs are looked over, and complained of, before the long work. */
static int rasterise(bake_work *work) {
    const double start = cli_seconds();
    int code = CLI_OK;
    work->receivers = cli_box_empty();
    cli_expected_receiver *expected = calloc(work->scene->receiver_count + 1, sizeof *expected);
    if (expected == NULL) {
        return cli_out_of_memory("receivers");
    }
    for (size_t i = 0; i < work->scene->receiver_count && code == CLI_OK; ++i) {
        const cli_receiver_job job = receiver_job(work, i);
        vsh_charts *charts = NULL;
        vsh_texels *texels = NULL;
        vsh_texels_info info = {0};
        code = cli_receiver_charts(&job, true, &charts);
        code = code == CLI_OK ? find_bounds(work, &job, charts, &texels, &info) : code;
        if (code == CLI_OK) {
            cli_box_grow(&work->receivers, &info);
            vsh_charts_info counted;
            vsh_charts_get_info(charts, &counted);
            expected[i] = (cli_expected_receiver){counted.covered, counted.samples, texels == NULL};
        }
        if (code == CLI_OK && work->scene->receiver_count == 1) {
            work->charts = charts;
            work->kept = texels;
        } else {
            vsh_texels_free(texels);
            vsh_charts_free(charts);
        }
    }
    if (code == CLI_OK) {
        cli_bake_expect(work->scene, work->assets, expected, work->run.threads);
    }
    free(expected);
    cli_stats_stage(&work->stats, CLI_STAGE_BAKE, start);
    return code;
}

/* Exact methods trace the casters' own triangles; values are held against the casters themselves. */
static int make_occluders(bake_work *work) {
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.receivers_min = work->receivers.min;
    options.receivers_max = work->receivers.max;
    options.truth = 1;
    vsh_error error;
    if (vsh_scene_occluders(work->scene, work->assets, &options, &work->run, &work->occluders, &error) !=
        VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    cli_stats_occluders(&work->stats, work->scene, work->occluders);
    return cli_stats_errors(&work->stats, work->scene);
}

static int find_origin(bake_work *work) {
    const double start = cli_seconds();
    const int code = cli_origin_make(work->given, &work->settings->input, 1, &work->stats.casters, &work->run,
                                     &work->origin);
    cli_stats_stage(&work->stats, CLI_STAGE_LOAD, start);
    return code;
}

enum { MOST_TOLD = 8 }; /* lightmaps that have a line each */

static void say_receiver(const bake_work *work, size_t index, const cli_bands *bands,
                         const cli_stats *before) {
    const cli_common *common = &work->settings->common;
    if (common->quiet || (work->scene->receiver_count > MOST_TOLD && !common->verbose)) {
        return;
    }
    const vsh_receiver *receiver = &work->scene->receivers[index];
    char banded[64] = "", taken[64] = "";
    if (bands->count > 1) {
        snprintf(banded, sizeof banded, ", in %d bands of %d rows", bands->count, bands->rows);
    }
    if (work->stats.resumed_rows > before->resumed_rows) {
        snprintf(taken, sizeof taken, ", %" PRIu64 " rows of them from before",
                 work->stats.resumed_rows - before->resumed_rows);
    }
    cli_say("%s: %d × %d, %" PRIu64 " texels, %" PRIu64 " of them invalid%s%s", receiver->output,
            receiver->width, receiver->height, work->stats.texels - before->texels,
            work->stats.invalid_texels - before->invalid_texels, banded, taken);
}

static int bake_receiver(bake_work *work, size_t index) {
    const cli_receiver_job job = receiver_job(work, index);
    cli_receiver_input input = {.occluders = work->occluders};
    int code = CLI_OK;
    if (work->charts == NULL) {
        const double start = cli_seconds();
        code = cli_receiver_charts(&job, false, &work->charts);
        cli_stats_stage(&work->stats, CLI_STAGE_BAKE, start);
    }
    input.charts = work->charts;
    if (code == CLI_OK) {
        const uint64_t held = work->stats.casters.field_bytes + work->stats.casters.triangles_bytes;
        code = cli_receiver_plan(&job, work->charts, held, &input.bands);
    }
    if (code == CLI_OK && input.bands.count > 1) {
        vsh_texels_free(work->kept);
        work->kept = NULL;
    }
    input.texels = work->kept;
    const cli_stats before = work->stats;
    code = code == CLI_OK ? cli_receiver_bake(&job, &input, &work->stats) : code;
    vsh_texels_free(work->kept);
    vsh_charts_free(work->charts);
    work->kept = NULL;
    work->charts = NULL;
    if (code == CLI_OK) {
        say_receiver(work, index, &input.bands, &before);
    }
    return code;
}

static int bake_receivers(bake_work *work) {
    const vsh_scene *scene = work->scene;
    int code = CLI_OK;
    for (size_t i = 0; i < scene->receiver_count && code == CLI_OK; ++i) {
        code = bake_receiver(work, i);
    }
    /* not before all are whole: a bake that goes on writes those that were again */
    for (size_t i = 0; i < scene->receiver_count && code == CLI_OK && work->settings->resume; ++i) {
        cli_resume_remove(scene->receivers[i].output);
    }
    return code;
}

/* Where there are too many for a line each. */
static void say_all(const bake_work *work) {
    const size_t count = work->scene->receiver_count;
    if (count > MOST_TOLD && !work->settings->common.verbose) {
        cli_say("%zu lightmaps, %s to %s: %" PRIu64 " texels, %" PRIu64
                " of them invalid; --verbose tells of each",
                count, work->scene->receivers[0].output, work->scene->receivers[count - 1].output,
                work->stats.texels, work->stats.invalid_texels);
    }
}

static int bake(const cli_bake_settings *settings, const vsh_scene *scene) {
    bake_work work = {.settings = settings, .given = scene, .run = cli_common_run(&settings->common)};
    work.stats = cli_stats_begin(CLI_STATS_TEXELS, work.run.threads);
    int code = load(&work);
    if (code == CLI_OK && settings->dry_run) {
        code = cli_bake_forecast(&work.targets, work.assets, &work.run, settings->band_rows);
        cli_targets_free(&work.targets);
        vsh_assets_free(work.assets);
        return code;
    }
    code = code == CLI_OK ? rasterise(&work) : code;
    cli_warnings_tell(); /* what is wrong with the files, before the long work */
    code = code == CLI_OK ? make_occluders(&work) : code;
    cli_warnings_tell();
    code = code == CLI_OK ? find_origin(&work) : code;
    code = code == CLI_OK ? bake_receivers(&work) : code;
    if (code == CLI_OK) {
        cli_stats_warn(&work.stats, scene, &work.run);
        code = cli_stats_finish(&work.stats, &work.run, settings->stats);
    }
    if (code == CLI_OK) {
        cli_warnings_tell();
        if (!settings->common.quiet) {
            say_all(&work);
            cli_stats_say(&work.stats);
        }
    }
    vsh_texels_free(work.kept);
    vsh_charts_free(work.charts);
    cli_stats_end(&work.stats);
    cli_origin_free(&work.origin);
    vsh_occluders_free(work.occluders);
    cli_targets_free(&work.targets);
    vsh_assets_free(work.assets);
    return code;
}

int cli_bake_main(int argc, char **argv) {
    cli_bake_settings settings;
    bool help;
    int code = cli_bake_parse(argc, argv, &settings, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(settings.common.progress, settings.common.quiet);
    cli_bake_scene made;
    code = cli_bake_scene_make(&settings, &made);
    code = code == CLI_OK ? check_files(&settings, &made.scene) : code;
    if (code == CLI_OK) {
        cli_signals_watch();
        code = bake(&settings, &made.scene);
    }
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}
