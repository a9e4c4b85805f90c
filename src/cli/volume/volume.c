/* vdbshade volume: shadow and AO on voxels, as .vdb grids. */
#include "cli/volume/volume.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/casters.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/provenance.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/temporary.h"
#include "cli/try.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* --- the work */

typedef struct volume_work {
    const volume_settings *settings;
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    vsh_occluders *occluders;
    vsh_grid *grid;
    vsh_voxels *voxels;
    vsh_volume *volume;
    cli_provenance origin;
    cli_stats stats;
} volume_work;

static int load(volume_work *work) {
    const double start = vshi_seconds();
    const volume_settings *s = work->settings;
    vsh_error error;
    if (vsh_assets_load(work->scene, &work->run, &work->assets, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    if (s->like != NULL &&
        vsh_voxels_from_vdb(s->like, s->like_grid, &work->run, &work->voxels, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    cli_stats_stage(&work->stats, CLI_STAGE_LOAD, start);
    return CLI_OK;
}

/* Of the casters' band, or of the box, whose voxels may be of the casters' size. */
static int choose_voxels(volume_work *work) {
    const volume_settings *s = work->settings;
    vsh_error error;
    vsh_result result = VSH_OK;
    if (s->has_box) {
        double size = s->box_voxel_size;
        if (size == 0.0 && work->grid != NULL) {
            vsh_grid_info info;
            vsh_grid_get_info(work->grid, &info);
            size = info.voxel_size;
        }
        result = vsh_voxels_from_box(s->box_min, s->box_max, size, &work->run, &work->voxels, &error);
    } else if (s->like == NULL) {
        result = vsh_voxels_from_grid(work->grid, s->band, &work->run, &work->voxels, &error);
    }
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

/* The union of all casters in voxels: what has the band, or tells the size of a box's voxels; and without
 * layers what casts. */
static int make_grid(volume_work *work) {
    const volume_settings *s = work->settings;
    if (s->like != NULL || s->box_voxel_size > 0.0) {
        return CLI_OK;
    }
    const double start = vshi_seconds();
    vsh_error error;
    const vsh_result result = vsh_scene_casters(work->scene, work->assets, &work->run, &work->grid, &error);
    cli_stats_stage(&work->stats, CLI_STAGE_VOXELIZE, start);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

static int make_occluders(volume_work *work) {
    CLI_TRY(make_grid(work));
    CLI_TRY(choose_voxels(work));
    vsh_voxels_info info;
    vsh_voxels_get_info(work->voxels, &info);
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.receivers_min = info.bounds_min;
    what.receivers_max = info.bounds_max;
    what.voxels = 1; /* whose slopes are normals, and whose insides are filled */
    what.grid = work->scene->layer_count == 0 ? work->grid : NULL;
    vsh_error error;
    if (vsh_scene_occluders(work->scene, work->assets, &what, &work->run, &work->occluders, &error) !=
        VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    vsh_grid_free(work->grid); /* neither what casts nor the voxels need it */
    work->grid = NULL;
    vsh_occluders_info casters;
    vsh_occluders_get_info(work->occluders, &casters);
    cli_stats_casters(&work->stats, work->scene, &casters);
    return CLI_OK;
}

/* Instead of what casts, what the parts say did. */
static int find_casters(volume_work *work) {
    const volume_settings *s = work->settings;
    CLI_TRY(make_grid(work));
    CLI_TRY(choose_voxels(work));
    vsh_occluders_info casters;
    vsh_error error;
    if (vsh_volume_part_casters(s->bake.merged, s->bake.shard_count, &work->run, &casters, &error) !=
        VSH_OK) {
        return cli_fail(&error);
    }
    cli_stats_casters(&work->stats, work->scene, &casters);
    return CLI_OK;
}

static int find_origin(volume_work *work) {
    const cli_bake_settings *bake = &work->settings->bake;
    const char *const files[] = {bake->input, work->settings->like, cli_bake_lights(bake)};
    return cli_provenance_make(work->scene, files, 3, &work->stats.casters, &work->run, &work->origin);
}

static vsh_part_options part_options(const volume_work *work) {
    const cli_bake_settings *s = &work->settings->bake;
    vsh_part_options part = vsh_part_options_default();
    part.parts = s->output;
    part.shard = s->shard;
    part.shard_count = s->shard_count;
    part.attributes = work->origin.attributes;
    part.attribute_count = work->origin.count;
    part.words = s->words;
    part.word_count = s->word_count;
    part.working = work->settings->working;
    return part;
}

static vsh_result run_bake(volume_work *work, const vsh_volume_options *bake, vsh_error *error) {
    const cli_bake_settings *s = &work->settings->bake;
    const vsh_scene *scene = work->scene;
    const vsh_part_options part = part_options(work);
    if (s->merged != NULL) {
        return vsh_volume_merge(work->voxels, scene->lights, scene->light_count, bake, &part, &work->run,
                                &work->volume, &work->stats.shade, error);
    }
    if (s->shard == 0) {
        return vsh_bake_volume(work->occluders, work->voxels, scene->lights, scene->light_count, bake,
                               &work->run, &work->volume, &work->stats.shade, error);
    }
    return vsh_bake_volume_part(work->occluders, work->voxels, scene->lights, scene->light_count, bake, &part,
                                &work->run, &work->stats.shade, error);
}

static int bake_volume(volume_work *work) {
    const double start = vshi_seconds();
    const vsh_volume_options bake = volume_options(work->settings, work->scene);
    vsh_error error;
    const vsh_result result = run_bake(work, &bake, &error);
    cli_stats_stage(&work->stats, CLI_STAGE_BAKE, start);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

static int write_volume(volume_work *work) {
    const double start = vshi_seconds();
    const char *output = work->settings->bake.output;
    if (cli_progress_report(NULL, "write", 0.0) != 0) {
        const vsh_error cancelled = {VSH_ERROR_CANCELLED, "write: cancelled"};
        return cli_fail(&cancelled);
    }
    vsh_error error;
    const vsh_result result = vsh_volume_write(work->volume, output, work->settings->half,
                                               work->origin.attributes, work->origin.count, &error);
    cli_stats_stage(&work->stats, CLI_STAGE_WRITE, start);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

static void count_voxels(volume_work *work, vsh_volume_info *info) {
    vsh_volume_get_info(work->volume, info);
    work->stats.voxels = info->shaded;
    work->stats.inside_voxels = info->filled + info->off;
    for (size_t i = 0; i < info->grids; ++i) {
        vsh_volume_grid grid;
        vsh_volume_get_grid(work->volume, i, &grid);
        work->stats.tiles += grid.tiles;
    }
}

static void say_results(const volume_work *work, const vsh_volume_info *info) {
    if (work->settings->bake.common.quiet) {
        return;
    }
    char bytes[32];
    cli_say("%s: %zu grid%s of %" PRIu64 " voxels, %" PRIu64 " more inside, %" PRIu64 " of them filled; %s",
            work->settings->bake.output, info->grids, info->grids == 1 ? "" : "s", info->shaded,
            info->filled + info->off, info->filled, vshi_bytes_text(info->bytes, bytes, sizeof bytes));
    cli_stats_say(&work->stats);
}

static void say_part(const volume_work *work) {
    const cli_bake_settings *s = &work->settings->bake;
    if (!s->common.quiet) {
        cli_say("%s.%d-of-%d.part: 'vdbshade merge %s' once all parts are there", s->output, s->shard,
                s->shard_count, s->output);
        cli_stats_say(&work->stats);
    }
}

/* What it will take, for people and for tools/slurm/submit. */
static int print_forecast(const volume_work *work) {
    const volume_settings *s = work->settings;
    const vsh_volume_options bake = volume_options(s, work->scene);
    const double *took = work->stats.seconds;
    vsh_volume_forecast f;
    vsh_voxels_info info;
    vsh_error error;
    if (vsh_bake_volume_forecast(work->occluders, work->voxels, work->scene->lights, work->scene->light_count,
                                 &bake, &work->run, &f, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    vsh_voxels_get_info(work->voxels, &info);
    const double made = took[CLI_STAGE_LOAD] + took[CLI_STAGE_VOXELIZE] + took[CLI_STAGE_FIELD];
    char bytes[32];
    printf("voxels        %" PRIu64 ", those inside too, in %d grid%s\n", info.count, f.grids,
           f.grids == 1 ? "" : "s");
    printf("memory        about %s at most\n", vshi_bytes_text((uint64_t)f.peak_bytes, bytes, sizeof bytes));
    printf("time          about %.2g s: voxelize %.2g s, field %.2g s, bake %.2g s (by some of the voxels)\n",
           made + f.bake_s, took[CLI_STAGE_VOXELIZE], took[CLI_STAGE_FIELD], f.bake_s);
    if (s->bake.shard_count > 0) {
        printf("parts         %d of %d have voxels\n", s->working, s->bake.shard_count);
    }
    return CLI_OK;
}

/* A shard without voxels reads nothing, and its part says so. */
static int leave_part(volume_work *work) {
    const cli_bake_settings *s = &work->settings->bake;
    const vsh_volume_options bake = volume_options(work->settings, work->scene);
    const vsh_part_options part = part_options(work);
    vsh_error error;
    if (vsh_bake_volume_part(NULL, NULL, work->scene->lights, work->scene->light_count, &bake, &part,
                             &work->run, &work->stats.shade, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    CLI_TRY(cli_stats_finish(&work->stats, &work->run, s->stats));
    if (!s->common.quiet) {
        cli_bake_say_idle(s, s->output, work->settings->working);
    }
    return CLI_OK;
}

static int run_volume(const volume_settings *s, vsh_scene *scene) {
    volume_work work = {.settings = s, .scene = scene, .run = cli_common_run(&s->bake.common)};
    work.stats = cli_stats_begin(CLI_STATS_VOXELS, work.run.threads);
    vsh_volume_info info;
    int code;
    if (s->bake.shard > s->working && !s->bake.dry_run) {
        return leave_part(&work);
    }
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(s->bake.merged != NULL ? find_casters(&work) : make_occluders(&work));
    if (s->bake.dry_run) {
        code = print_forecast(&work);
        goto done;
    }
    CLI_TRY_DONE(find_origin(&work));
    CLI_TRY_DONE(bake_volume(&work));
    if (s->bake.shard > 0) {
        CLI_TRY_DONE(cli_stats_finish(&work.stats, &work.run, s->bake.stats));
        say_part(&work);
        goto done;
    }
    CLI_TRY_DONE(write_volume(&work));
    count_voxels(&work, &info);
    CLI_TRY_DONE(cli_stats_finish(&work.stats, &work.run, s->bake.stats));
    say_results(&work, &info);
done:
    cli_provenance_free(&work.origin);
    vsh_volume_free(work.volume);
    vsh_voxels_free(work.voxels);
    vsh_grid_free(work.grid);
    vsh_occluders_free(work.occluders);
    vsh_assets_free(work.assets);
    return code;
}

static int volume_by(volume_settings *s) {
    int code = volume_check_options(s);
    if (code != CLI_OK) {
        return code;
    }
    cli_progress_begin(s->bake.common.progress, s->bake.common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s->bake, &made));
    if (s->band > made.scene.grid.half_width && !cli_patch_has(&s->bake.patch, "--half-width")) {
        made.scene.grid.half_width = s->band;
    }
    s->working = volume_shards(s, &made.scene);
    CLI_TRY_DONE(cli_bake_check_work(&s->bake, &made));
    CLI_TRY_DONE(volume_check_files(s, &made.scene));
    cli_signals_watch();
    code = run_volume(s, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}

int volume_main(int argc, char **argv) {
    volume_settings s;
    bool help;
    const int code = volume_parse(argc, argv, &s, &help);
    return code != CLI_OK || help ? code : volume_by(&s);
}

int cli_volume_merge(int argc, char **argv, const char *output, int32_t shards, const char *stats,
                     const cli_common *common) {
    volume_settings s;
    bool help;
    const int code = volume_parse(argc, argv, &s, &help);
    if (code != CLI_OK || help) {
        return code != CLI_OK ? code : cli_usage("%s: its parts are of no bake", output);
    }
    s.bake.common = *common;
    s.bake.output = s.bake.merged = output;
    s.bake.shard = 0;
    s.bake.shard_count = shards;
    s.bake.stats = stats;
    s.bake.words = NULL;
    s.bake.word_count = 0;
    return volume_by(&s);
}
