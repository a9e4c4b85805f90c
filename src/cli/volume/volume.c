/* vdbshade volume: shadow and AO on voxels, as .vdb grids. */
#include "base/bytes.h"
#include "base/clock.h"
#include "base/memory.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/options.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/temporary.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* --- options */

typedef struct volume_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it; its output and stats are ours */
    double band;            /* 0: not given */
    bool has_box;
    double box_min[3], box_max[3], box_voxel_size; /* 0: not given */
    const char *like;                              /* file; NULL: not given */
    const char *like_grid;                         /* NULL: the first */
    char like_text[4096];
    int32_t inside;
    bool half;
} volume_settings;

enum {
    KEY_BAND = 0x2000,
    KEY_BOX,
    KEY_BOX_VOXEL_SIZE,
    KEY_LIKE,
    KEY_INSIDE,
    KEY_HALF,
    KEY_STATS,
    KEY_DRY_RUN
};

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT.vdb", "file to write: grids shadow.NAME of each light, and ao"},
    {KEY_HALF, "half", NULL, "write 16-bit floats"},
    {KEY_STATS, "stats", "FILE.json", "write times, counts and peak memory as JSON"},
    {KEY_DRY_RUN, "dry-run", NULL, "bake nothing: print voxels and memory"},
    {0, NULL, NULL, "Which voxels (without --box and --like the casters' own band)"},
    {KEY_BAND, "band", "VOXELS",
     "how far from the surface, in voxels, more than 0 to 100\n(all of the level set's band)"},
    {KEY_BOX, "box", "X0,Y0,Z0,X1,Y1,Z1", "a box, scene units: lower corner, upper corner"},
    {KEY_BOX_VOXEL_SIZE, "box-voxel-size", "SIZE", "the edge of its voxels (that of the casters' voxels)"},
    {KEY_LIKE, "like", "FILE[:GRID]",
     "the active voxels of a grid in a .vdb file, a fog say,\non its own lattice (the file's first grid of "
     "numbers)"},
    {KEY_INSIDE, "inside", "nearest|off",
     "voxels inside a solid: nearest (they take the nearest\noutside value) or off (inactive) (nearest)"},
    {0, NULL, NULL, "Light and occlusion"},
    CLI_LIGHT_OPTIONS,
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

static int volume_main(int argc, char **argv);

const cli_command cli_volume = {
    "volume",
    "INPUT -o OUT.vdb [options]",
    "Bakes soft shadows and ambient occlusion into sparse grids. INPUT is a mesh file, a level set\n"
    "(FILE.vdb, FILE.vdb:GRID) or a scene file (.json; its casters, lights and ao, not its receivers).\n"
    "docs/volume.md describes the output. Numbers in brackets are the defaults.",
    options,
    sizeof options / sizeof options[0],
    volume_main};

static int take_like(volume_settings *s, const char *name, const char *value) {
    if (value[0] == '\0' || strlen(value) >= sizeof s->like_text) {
        return cli_usage("%s '%.60s': expected FILE.vdb or FILE.vdb:GRID", name, value);
    }
    strcpy(s->like_text, value);
    s->like = s->like_text;
    s->like_grid = cli_grid_name(value);
    if (s->like_grid != NULL) {
        s->like_text[s->like_grid - 1 - value] = '\0';
    }
    return s->like_grid == NULL || s->like_grid[0] != '\0'
               ? CLI_OK
               : cli_usage("%s '%s': no grid is named behind the colon", name, value);
}

static int take(void *settings, int key, const char *name, const char *value) {
    volume_settings *s = settings;
    switch (key) {
    case 'o':
        s->bake.output = value;
        return CLI_OK;
    case KEY_STATS:
        s->bake.stats = value;
        return CLI_OK;
    case KEY_DRY_RUN:
        s->bake.dry_run = true;
        return CLI_OK;
    case KEY_HALF:
        s->half = true;
        return CLI_OK;
    case KEY_BAND: {
        const int code = cli_parse_positive(name, value, &s->band);
        return code == CLI_OK && s->band > 100.0 ? cli_parse_number(name, value, 0.0, 100.0, &s->band) : code;
    }
    case KEY_BOX:
        s->has_box = true;
        return cli_parse_box(name, value, s->box_min, s->box_max);
    case KEY_BOX_VOXEL_SIZE:
        return cli_parse_positive(name, value, &s->box_voxel_size);
    case KEY_LIKE:
        return take_like(s, name, value);
    case KEY_INSIDE:
        return cli_parse_name(name, value, VSH_NAMES_INSIDE, &s->inside);
    default:
        break;
    }
    return cli_shared_parse(&s->bake, key, name, value);
}

static int check_options(const volume_settings *s) {
    if (s->bake.output == NULL || !cli_has_ending(s->bake.output, "vdb")) {
        return cli_usage("%s: give -o OUT.vdb", s->bake.output != NULL ? s->bake.output : s->bake.input);
    }
    const char *where = s->band > 0.0 ? "--band" : s->has_box ? "--box" : "--like";
    if ((s->band > 0.0) + s->has_box + (s->like != NULL) > 1) {
        return cli_usage("%s: give one of --band, --box and --like", where);
    }
    if (s->box_voxel_size > 0.0 && !s->has_box) {
        return cli_usage("--box-voxel-size: there is no --box");
    }
    return cli_patch_check(&s->bake.patch);
}

static int check_output(const volume_settings *s, const vsh_scene *scene, const char *output) {
    if (s->like != NULL && cli_same_file(output, s->like)) {
        return cli_usage("%s: the output is also the file of --like", output);
    }
    CLI_TRY(cli_bake_check_output(&s->bake, scene, output));
    CLI_TRY(cli_bake_check_inputs(&s->bake, scene, &output, 1));
    return cli_temporary_check(output);
}

/* Refuses bad outputs before anything is read. */
static int check_files(const volume_settings *s, const vsh_scene *scene) {
    const char *output = s->bake.output, *stats = s->bake.stats;
    if (stats != NULL && cli_same_file(output, stats)) {
        return cli_usage("%s: both the output and the --stats file", output);
    }
    const int code = check_output(s, scene, output);
    return code == CLI_OK && stats != NULL ? check_output(s, scene, stats) : code;
}

static vsh_volume_options volume_options(const volume_settings *s, const vsh_scene *scene) {
    vsh_volume_options bake = vsh_volume_options_default();
    bake.inside = s->inside;
    bake.ao = scene->ao;
    bake.error = scene->error;
    bake.shade = scene->shade;
    return bake;
}

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

static int find_origin(volume_work *work) {
    const cli_bake_settings *bake = &work->settings->bake;
    const char *const files[] = {bake->input, work->settings->like, cli_bake_lights(bake)};
    return cli_provenance_make(work->scene, files, 3, &work->stats.casters, &work->run, &work->origin);
}

static int bake_volume(volume_work *work) {
    const double start = vshi_seconds();
    const vsh_volume_options bake = volume_options(work->settings, work->scene);
    vsh_error error;
    const vsh_result result =
        vsh_bake_volume(work->occluders, work->voxels, work->scene->lights, work->scene->light_count, &bake,
                        &work->run, &work->volume, &work->stats.shade, &error);
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

/* Bytes of a block of 8³ voxels: its values in one grid with its share of the tree, and its masks. */
static const double GRID_BYTES = 2200.0, BLOCK_BYTES = 640.0;

static void print_forecast(const volume_work *work) {
    const vsh_scene *scene = work->scene;
    vsh_voxels_info info;
    vsh_voxels_get_info(work->voxels, &info);
    const double grids =
        ((double)scene->light_count + (scene->ao != 0 ? 1.0 : 0.0)) * (scene->error != 0 ? 2.0 : 1.0);
    const double bytes = (double)vshi_peak_bytes() + (double)info.blocks * (BLOCK_BYTES + GRID_BYTES * grids);
    char text[32];
    printf("voxels        %" PRIu64 ", those inside too\n", info.count);
    printf("memory        about %s at most\n", vshi_bytes_text((uint64_t)bytes, text, sizeof text));
}

static int run_volume(const volume_settings *s, vsh_scene *scene) {
    volume_work work = {.settings = s, .scene = scene, .run = cli_common_run(&s->bake.common)};
    work.stats = cli_stats_begin(CLI_STATS_VOXELS, work.run.threads);
    vsh_volume_info info;
    int code;
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(make_occluders(&work));
    if (s->bake.dry_run) {
        print_forecast(&work);
        goto done;
    }
    CLI_TRY_DONE(find_origin(&work));
    CLI_TRY_DONE(bake_volume(&work));
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

static int volume_main(int argc, char **argv) {
    volume_settings s = {.bake = {.common = cli_common_default()}};
    bool help;
    int code = cli_parse(&cli_volume, argc, argv, take, &s, "INPUT", &s.bake.input, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    CLI_TRY(check_options(&s));
    cli_progress_begin(s.bake.common.progress, s.bake.common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    if (s.band > made.scene.grid.half_width) {
        made.scene.grid.half_width = s.band;
    }
    CLI_TRY_DONE(cli_bake_check_work(&s.bake, &made));
    CLI_TRY_DONE(check_files(&s, &made.scene));
    cli_signals_watch();
    code = run_volume(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}
