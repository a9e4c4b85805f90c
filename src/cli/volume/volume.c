/* vdbshade volume: shadow and AO on voxels, as .vdb grids. */
#include "base/bytes.h"
#include "base/clock.h"
#include "base/memory.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

/* --- options */

typedef struct volume_settings {
    cli_bake_settings bake; /* the scene, the output and the stats */
    double band;            /* 0: not given */
    bool has_box;
    double box_min[3], box_max[3], box_voxel_size; /* 0: not given */
    const char *like;                              /* file; NULL: not given */
    const char *like_grid;                         /* NULL: the first */
    int32_t inside;
    bool half;
} volume_settings;

enum { KEY_BAND = 0x2000, KEY_BOX, KEY_LIKE, KEY_INSIDE };

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(volume_settings, bake.output), "output", "OUT.vdb",
     "file to write: grids shadow.NAME of each light, and ao"},
    {CLI_FLAG(volume_settings, half), "half", NULL, "write 16-bit floats"},
    CLI_STATS_OPTION(volume_settings, bake.stats),
    {CLI_FLAG(volume_settings, bake.dry_run), "dry-run", NULL, "bake nothing: print voxels and memory"},
    {0, NULL, NULL, "Which voxels (without --box and --like the casters' own band)"},
    {KEY_BAND, "band", "VOXELS",
     "how far from the surface, in voxels, more than 0 to 100\n(all of the level set's band)"},
    {KEY_BOX, "box", "X0,Y0,Z0,X1,Y1,Z1", "a box, scene units: lower corner, upper corner"},
    {CLI_POSITIVE(volume_settings, box_voxel_size), "box-voxel-size", "SIZE",
     "the edge of its voxels (that of the casters' voxels)"},
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

static int take_like(volume_settings *s, const char *name, const char *value) {
    if (value[0] == '\0') {
        return cli_usage("%s '': expected FILE.vdb or FILE.vdb:GRID", name);
    }
    s->like = value;
    s->like_grid = cli_split_grid(&s->like);
    if (s->like_grid != NULL && s->like_grid[0] == '\0') {
        return cli_usage("%s '%s': no grid is named behind the colon", name, value);
    }
    return CLI_OK;
}

static int take(void *settings, int key, const char *name, const char *value) {
    volume_settings *s = settings;
    switch (key) {
    case KEY_BAND:
        CLI_TRY(cli_parse_positive(name, value, &s->band));
        return cli_parse_number(name, value, 0.0, 100.0, &s->band);
    case KEY_BOX:
        s->has_box = true;
        return cli_parse_box(name, value, s->box_min, s->box_max);
    case KEY_LIKE:
        return take_like(s, name, value);
    case KEY_INSIDE:
        return cli_parse_name(name, value, VSH_NAMES_INSIDE, &s->inside);
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
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

/* Refuses bad outputs before anything is read. */
static int check_files(const volume_settings *s, const vsh_scene *scene) {
    CLI_TRY(cli_check_apart(s->bake.output, s->like, "also the file of --like"));
    CLI_TRY(cli_check_apart(s->bake.stats, s->like, "also the file of --like"));
    return cli_bake_check_files(&s->bake, scene);
}

/* --- the work */

typedef struct volume_work {
    const volume_settings *settings;
    cli_shading shading;
    vsh_grid *grid;
    vsh_voxels *voxels;
    vsh_volume *volume;
} volume_work;

static int load(volume_work *work) {
    const volume_settings *s = work->settings;
    CLI_TRY(cli_shading_load(&work->shading));
    if (s->like == NULL) {
        return CLI_OK;
    }
    const double start = vshi_seconds();
    vsh_error error;
    CLI_TRY(cli_check_result(
        vsh_voxels_from_vdb(s->like, s->like_grid, &work->shading.run, &work->voxels, &error), &error));
    cli_stats_stage(&work->shading.stats, CLI_STAGE_LOAD, start);
    return CLI_OK;
}

/* Makes the voxels of the casters' band, or of the box, whose voxels may be of the casters' size. */
static int choose_voxels(volume_work *work) {
    const volume_settings *s = work->settings;
    const vsh_run *run = &work->shading.run;
    vsh_error error;
    vsh_result result = VSH_OK;
    if (s->has_box) {
        double size = s->box_voxel_size;
        if (size == 0.0 && work->grid != NULL) {
            vsh_grid_info info;
            vsh_grid_get_info(work->grid, &info);
            size = info.voxel_size;
        }
        result = vsh_voxels_from_box(s->box_min, s->box_max, size, run, &work->voxels, &error);
    } else if (s->like == NULL) {
        result = vsh_voxels_from_grid(work->grid, s->band, run, &work->voxels, &error);
    }
    return cli_check_result(result, &error);
}

/* Makes the union of all casters in voxels: what has the band, or tells the size of a box's voxels; and
 * without layers what casts. */
static int make_grid(volume_work *work) {
    cli_shading *shading = &work->shading;
    if (work->settings->like != NULL || work->settings->box_voxel_size > 0.0) {
        return CLI_OK;
    }
    const double start = vshi_seconds();
    vsh_error error;
    const vsh_result result =
        vsh_scene_casters(shading->scene, shading->assets, &shading->run, &work->grid, &error);
    cli_stats_stage(&shading->stats, CLI_STAGE_VOXELIZE, start);
    return cli_check_result(result, &error);
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
    what.grid = work->shading.scene->layer_count == 0 ? work->grid : NULL;
    CLI_TRY(cli_shading_cast(&work->shading, &what));
    vsh_grid_free(work->grid); /* neither what casts nor the voxels need it */
    work->grid = NULL;
    return CLI_OK;
}

static int bake_volume(volume_work *work) {
    cli_shading *shading = &work->shading;
    const vsh_scene *scene = shading->scene;
    const double start = vshi_seconds();
    vsh_volume_options bake = vsh_volume_options_default();
    bake.inside = work->settings->inside;
    bake.ao = scene->ao;
    bake.error = scene->error;
    bake.shade = scene->shade;
    vsh_error error;
    const vsh_result result =
        vsh_bake_volume(shading->occluders, work->voxels, scene->lights, scene->light_count, &bake,
                        &shading->run, &work->volume, &shading->stats.shade, &error);
    cli_stats_stage(&shading->stats, CLI_STAGE_BAKE, start);
    return cli_check_result(result, &error);
}

static int write_volume(volume_work *work) {
    const double start = vshi_seconds();
    const cli_provenance *origin = &work->shading.origin;
    CLI_TRY(cli_begin_writing());
    vsh_error error;
    const vsh_result result =
        vsh_volume_write(work->volume, work->settings->bake.output, work->settings->half, origin->attributes,
                         origin->count, &error);
    cli_stats_stage(&work->shading.stats, CLI_STAGE_WRITE, start);
    return cli_check(result, &error);
}

static void count_voxels(const vsh_volume *volume, cli_stats *stats, vsh_volume_info *info) {
    vsh_volume_get_info(volume, info);
    stats->voxels = info->shaded;
    stats->inside_voxels = info->filled + info->off;
    for (size_t i = 0; i < info->grids; ++i) {
        vsh_volume_grid grid;
        vsh_volume_get_grid(volume, i, &grid);
        stats->tiles += grid.tiles;
    }
}

static void say_results(const volume_work *work, const vsh_volume_info *info) {
    char bytes[32];
    cli_say("%s: %zu grid%s of %" PRIu64 " voxels, %" PRIu64 " more inside, %" PRIu64 " of them filled; %s",
            work->settings->bake.output, info->grids, info->grids == 1 ? "" : "s", info->shaded,
            info->filled + info->off, info->filled, vshi_bytes_text(info->bytes, bytes, sizeof bytes));
    cli_stats_say(&work->shading.stats);
}

/* Bytes of a block of 8³ voxels: its values in one grid with its share of the tree, and its masks. */
static const double GRID_BYTES = 2200.0, BLOCK_BYTES = 640.0;

static void print_forecast(const volume_work *work) {
    const vsh_scene *scene = work->shading.scene;
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
    volume_work work = {.settings = s, .shading = cli_shading_begin(scene, CLI_STATS_VOXELS)};
    cli_shading *shading = &work.shading;
    const char *const files[] = {s->bake.input, s->like, cli_bake_lights(&s->bake)};
    vsh_volume_info info;
    int code;
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(make_occluders(&work));
    if (s->bake.dry_run) {
        print_forecast(&work);
        goto done;
    }
    CLI_TRY_DONE(
        cli_provenance_make(scene, files, 3, &shading->stats.casters, &shading->run, &shading->origin));
    CLI_TRY_DONE(bake_volume(&work));
    CLI_TRY_DONE(write_volume(&work));
    count_voxels(work.volume, &shading->stats, &info);
    CLI_TRY_DONE(cli_stats_finish(&shading->stats, &shading->run, s->bake.stats));
    if (!cli_given.quiet) {
        say_results(&work, &info);
    }
done:
    vsh_volume_free(work.volume);
    vsh_voxels_free(work.voxels);
    vsh_grid_free(work.grid);
    cli_shading_free(shading);
    return code;
}

static int volume_main(int argc, char **argv) {
    volume_settings s = {.band = 0.0};
    CLI_TRY(cli_parse(&cli_volume, argc, argv, take, &s, &s.bake.input));
    CLI_TRY(check_options(&s));
    cli_bake_scene made;
    int code;
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
    return code;
}

const cli_command cli_volume = {
    "volume",
    "INPUT -o OUT.vdb [options]",
    "Bakes soft shadows and ambient occlusion into sparse grids. INPUT is a mesh file, a level set\n"
    "(FILE.vdb, FILE.vdb:GRID) or a scene file (.json; its casters, lights and ao, not its receivers).\n"
    "docs/query.md describes the output. Numbers in brackets are the defaults.",
    options,
    sizeof options / sizeof options[0],
    volume_main};
