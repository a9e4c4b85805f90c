/* vdbshade volume: shadow and AO in voxels, as .vdb grids, or of a box as the slices of a 3D texture. */
#include "bake/bake.h"
#include "base/memory.h"

typedef struct volume_settings {
    cli_bake_settings bake;              /* the scene, the output and the stats */
    double band, box[6], box_voxel_size; /* 0: not given */
    const char *like, *like_grid;        /* file, and grid or NULL: the first */
    int32_t inside;                      /* VSH_INSIDE_… */
    bool half;
    bool slices;        /* the output is no .vdb */
    const char *header; /* of the output's floats; NULL: no such output */
} volume_settings;

static int parse_box(void *at, const char *name, const char *value) {
    double *box = at;
    return cli_read_numbers(value, 6, box) && box[0] < box[3] && box[1] < box[4] && box[2] < box[5]
               ? CLI_OK
               : cli_usage(
                     "%s '%s': expected X0,Y0,Z0,X1,Y1,Z1, the second corner above the first on every axis",
                     name, value);
}

static const cli_option options[] = {
    {.help = "Output"},
    {"output", "OUT",
     "file to write: grids shadow.NAME of each light, and ao (.vdb); of a box the slices from z = 0 on, "
     "below "
     "each other in an image of up to 3 grids (.png, .exr), or floats with their header OUT.json (.raw)",
     CLI_VALUE(TEXT, volume_settings, bake.output)},
    {"half", NULL, "write 16-bit floats (.vdb, .exr)", CLI_VALUE(FLAG, volume_settings, half)},
    CLI_STATS_OPTION(volume_settings, bake.stats),
    {"dry-run", NULL, "bake nothing: print voxels and memory",
     CLI_VALUE(FLAG, volume_settings, bake.dry_run)},
    {.help = "Which voxels (without --box and --like the casters' own band)"},
    {"band", "VOXELS",
     "distance from the surface, in voxels, more than 0 to 100 (all of the level set's band)",
     CLI_RANGE(NUMBER, volume_settings, band, 0.0, 100.0)},
    {"box", "X0,Y0,Z0,X1,Y1,Z1", "a box, scene units: lower corner, upper corner",
     CLI_PARSED(volume_settings, box, parse_box)},
    {"box-voxel-size", "SIZE", "the edge of its voxels (that of the casters' voxels)",
     CLI_VALUE(POSITIVE, volume_settings, box_voxel_size)},
    {"like", "FILE[:GRID]",
     "the active voxels of a grid in a .vdb file, a fog for example, on its own lattice (the file's first "
     "grid "
     "of numbers)",
     CLI_VALUE(TEXT, volume_settings, like)},
    {"inside", "nearest|off",
     "voxels inside a solid: nearest (they get the nearest outside value) or off (inactive) (nearest)",
     CLI_RANGE(NAME, volume_settings, inside, VSH_NAMES_INSIDE, 0)},
    {.help = "Light and occlusion"},
    CLI_LIGHT_OPTIONS,
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

static bool has_box(const volume_settings *s) {
    return s->box[0] < s->box[3];
}

/* Refuses options that contradict each other, and splits --like. */
static int set_options(volume_settings *s) {
    const char *output = s->bake.output;
    CLI_REFUSE_IF(output == NULL || !cli_has_ending(output, "vdb png exr raw"),
                  "%s: give -o OUT.vdb, .png, .exr or .raw", output != NULL ? output : s->bake.input);
    CLI_REFUSE_IF(s->half && !cli_has_ending(output, "vdb exr"), "%s: --half is for .vdb and .exr", output);
    if (!cli_has_ending(output, "vdb")) {
        CLI_REFUSE_IF(!has_box(s), "%s: the slices of a 3D texture need --box", output);
        s->slices = true;
    }
    if (cli_has_ending(output, "raw")) {
        s->header = cli_keep_text("%.*sjson", (int)strlen(output) - 3, output);
    }
    CLI_REFUSE_IF(cli_was_given("band") && s->band == 0.0, "--band '0': expected more than 0");
    const char *where = s->band > 0.0 ? "--band" : has_box(s) ? "--box" : "--like";
    CLI_REFUSE_IF((s->band > 0.0) + has_box(s) + (s->like != NULL) > 1,
                  "%s: give one of --band, --box and --like", where);
    CLI_REFUSE_IF(s->box_voxel_size > 0.0 && !has_box(s), "--box-voxel-size: needs --box");
    const char *like = s->like;
    s->like_grid = like != NULL ? cli_split_grid(&s->like) : NULL;
    CLI_REFUSE_IF(like != NULL && (*like == '\0' || (s->like_grid != NULL && *s->like_grid == '\0')),
                  "--like '%s': expected FILE.vdb or FILE.vdb:GRID", like);
    return CLI_OK;
}

/* --- the work */

typedef struct volume_work {
    const volume_settings *settings;
    cli_shading shading;
    vsh_grid *grid; /* union of all casters; NULL: not needed */
    vsh_voxels *voxels;
    vsh_volume *volume;
} volume_work;

static int load(volume_work *work) {
    const volume_settings *s = work->settings;
    cli_shading *shading = &work->shading;
    CLI_TRY(cli_shading_load(shading));
    if (s->like != NULL) {
        CLI_TRY(
            cli_check_input(vsh_voxels_from_vdb(s->like, s->like_grid, &cli_run, &work->voxels, &cli_error)));
        cli_stats_lap(&shading->stats, CLI_STAGE_LOAD);
    }
    return CLI_OK;
}

/* Makes the voxels of the box, or of the band of all casters' level set, unless --like gave some. If no voxel
 * size was given, the level set also gives the box its voxels' size. Without layers it casts, too. */
static int make_voxels(volume_work *work) {
    const volume_settings *s = work->settings;
    cli_shading *shading = &work->shading;
    vsh_grid_info info = {.voxel_size = s->box_voxel_size};
    if (s->like != NULL) {
        return CLI_OK;
    }
    if (s->box_voxel_size == 0.0) {
        CLI_TRY(cli_check_input(
            vsh_scene_casters(shading->scene, shading->assets, &cli_run, &work->grid, &cli_error)));
        vsh_grid_get_info(work->grid, &info);
        cli_stats_lap(&shading->stats, CLI_STAGE_VOXELIZE);
    }
    return cli_check_input(
        has_box(s)
            ? vsh_voxels_from_box(s->box, s->box + 3, info.voxel_size, &cli_run, &work->voxels, &cli_error)
            : vsh_voxels_from_grid(work->grid, s->band, &cli_run, &work->voxels, &cli_error));
}

static int make_occluders(volume_work *work) {
    CLI_TRY(make_voxels(work));
    vsh_voxels_info info;
    vsh_voxels_get_info(work->voxels, &info);
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.receivers_min = info.bounds_min;
    what.receivers_max = info.bounds_max;
    what.voxels = 1; /* for normals, and to fill insides */
    what.grid = work->shading.scene->layer_count == 0 ? work->grid : NULL;
    CLI_TRY(cli_shading_cast(&work->shading, &what));
    vsh_grid_free(work->grid); /* gives its memory to the bake */
    work->grid = NULL;
    return CLI_OK;
}

static int bake_volume(volume_work *work) {
    cli_shading *shading = &work->shading;
    const vsh_scene *scene = shading->scene;
    vsh_volume_options bake = vsh_volume_options_default();
    bake.inside = work->settings->inside;
    bake.ao = scene->ao;
    bake.error = scene->error;
    bake.shade = scene->shade;
    CLI_TRY(
        cli_check_input(vsh_bake_volume(shading->occluders, work->voxels, scene->lights, scene->light_count,
                                        &bake, &cli_run, &work->volume, &shading->stats.shade, &cli_error)));
    cli_stats_lap(&shading->stats, CLI_STAGE_BAKE);
    return CLI_OK;
}

/* --- the slices of a box: voxels by x, then y, then z */

enum { MOST_PLANES = 3 }; /* R, G and B */

static size_t count_grids(const vsh_scene *scene) {
    return (scene->light_count + (scene->ao != 0)) * (scene->error != 0 ? 2 : 1);
}

/* Returns the number of voxels along the axes. */
static void get_size(const volume_work *work, int32_t size[3]) {
    vsh_voxels_info info;
    vsh_voxels_get_info(work->voxels, &info);
    for (int axis = 0; axis < 3; ++axis) {
        size[axis] = info.index_max[axis] + 1; /* from 0 on */
    }
}

/* Describes an image with the slices of `count` grids below each other. A single grid is grey. */
static vsh_image make_strip(const int32_t size[3], size_t count, const float *const *planes) {
    static const char *const names[] = {"R", "G", "B"};
    return (vsh_image){size[0], size[1] * size[2], (int32_t)count, names, planes, NULL};
}

/* PNG has 8 bits, because engines that cut 16 bits to 8 also apply a curve. */
static vsh_image_options strip_options(const volume_settings *s, size_t count) {
    static const char *const packs[] = {"R=R,G=R,B=R", "R=R,G=G,B=0", "R=R,G=G,B=B"};
    vsh_image_options how = vsh_image_options_default();
    how.pack = packs[count - 1];
    how.bits = cli_has_ending(s->bake.output, "png") ? 8 : s->half ? 16 : 32;
    return how;
}

/* Refuses slices that do not fit into their image, or into memory. */
static int check_slices(const volume_work *work) {
    const volume_settings *s = work->settings;
    const size_t count = count_grids(work->shading.scene);
    if (!s->slices || s->header != NULL) {
        return CLI_OK;
    }
    CLI_REFUSE_IF(count > MOST_PLANES, "%s: an image has room for %d grids, not %zu; write .raw or .vdb",
                  s->bake.output, MOST_PLANES, count);
    int32_t size[3];
    get_size(work, size);
    const double rows = (double)size[1] * size[2];
    if (rows > INT32_MAX) {
        return cli_refuse(CLI_LIMIT,
                          "%s: slices of %d x %d x %d voxels are too high for an image; write .raw",
                          s->bake.output, size[0], size[1], size[2]);
    }
    const vsh_image strip = make_strip(size, count, NULL);
    const vsh_image_options how = strip_options(s, count);
    CLI_TRY(cli_check(vsh_image_check(s->bake.output, &strip, &how, &cli_error)));
    return cli_check(
        vshi_check_limit(&cli_run, rows * size[0] * (double)(count * sizeof(float)), "slices", &cli_error));
}

/* Describes the slices: {"shape": …}, and the provenance. */
static json_t *describe_slices(const volume_work *work) {
    const cli_provenance *origin = &work->shading.origin;
    const double *low = work->settings->box;
    int32_t size[3];
    vsh_voxels_info info;
    get_size(work, size);
    vsh_voxels_get_info(work->voxels, &info);
    const double voxel = info.voxel_size[0];
    json_t *grids = json_array(), *notes = json_object();
    for (size_t i = 0; i < count_grids(work->shading.scene); ++i) {
        vsh_volume_grid grid;
        vsh_volume_get_grid(work->volume, i, &grid);
        json_array_append_new(grids, cli_utf8_json(grid.name));
    }
    for (size_t i = 0; i < origin->count; ++i) {
        json_object_set_new(notes, origin->attributes[i].name, cli_utf8_json(origin->attributes[i].value));
    }
    return json_pack("{s:o, s:s, s:[i,i,i], s:[f,f,f], s:[f,f,f], s:f, s:o}", "grids", grids, "type",
                     "float32", "size", size[0], size[1], size[2], "box_min", low[0], low[1], low[2],
                     "box_max", low[0] + voxel * size[0], low[1] + voxel * size[1], low[2] + voxel * size[2],
                     "voxel_size", voxel, "origin", notes);
}

/* Copies the slices of a grid from `first` on. */
static int copy_slices(const volume_work *work, size_t grid, int32_t first, int32_t count, float *values) {
    int32_t size[3];
    const int32_t from[3] = {0, 0, first};
    get_size(work, size);
    size[2] = count;
    return cli_check(vsh_volume_copy(work->volume, grid, from, size, values, &cli_error));
}

/* Writes all floats, one grid after the other, and their header. */
static int write_raw(const volume_work *work) {
    const volume_settings *s = work->settings;
    cli_temporary raw = {.file = NULL}, header = {.file = NULL};
    cli_temporary *const both[] = {&raw, &header};
    int32_t size[3];
    get_size(work, size);
    const size_t area = (size_t)size[0] * (size_t)size[1];
    float *slice = malloc(area * sizeof *slice);
    json_t *described = describe_slices(work);
    int code;
    CLI_TRY_DONE(cli_temporary_begin(&raw, s->bake.output));
    CLI_TRY_DONE(cli_temporary_begin(&header, s->header));
    json_dumpf(described, header.file, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    for (size_t i = 0; i < count_grids(work->shading.scene); ++i) {
        for (int32_t z = 0; z < size[2] && !ferror(raw.file); ++z) {
            CLI_TRY_DONE(copy_slices(work, i, z, 1, slice));
            fwrite(slice, sizeof *slice, area, raw.file);
        }
    }
    code = cli_temporaries_commit(both, CLI_COUNT(both));
done:
    cli_temporary_abandon(&raw);
    cli_temporary_abandon(&header);
    json_decref(described);
    free(slice);
    return code;
}

/* Writes the slices below each other. */
static int write_strip(const volume_work *work) {
    const volume_settings *s = work->settings;
    const cli_provenance *origin = &work->shading.origin;
    const size_t count = count_grids(work->shading.scene);
    float *planes[MOST_PLANES] = {NULL};
    int32_t size[3];
    int code = CLI_OK;
    get_size(work, size);
    for (size_t i = 0; i < count && code == CLI_OK; ++i) {
        planes[i] = malloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2] * sizeof(float));
        code = copy_slices(work, i, 0, size[2], planes[i]);
    }
    const vsh_image strip = make_strip(size, count, (const float *const *)planes);
    vsh_image_options how = strip_options(s, count);
    how.attributes = origin->attributes;
    how.attribute_count = origin->count;
    code = code == CLI_OK ? cli_check(vsh_image_write(s->bake.output, &strip, &how, &cli_error)) : code;
    for (size_t i = 0; i < count; ++i) {
        free(planes[i]);
    }
    return code;
}

static int write_volume(volume_work *work) {
    const volume_settings *s = work->settings;
    const cli_provenance *origin = &work->shading.origin;
    CLI_TRY(cli_begin_writing());
    if (s->slices) {
        CLI_TRY(s->header != NULL ? write_raw(work) : write_strip(work));
    } else {
        CLI_TRY(cli_check(vsh_volume_write(work->volume, s->bake.output, s->half, origin->attributes,
                                           origin->count, &cli_error)));
    }
    cli_stats_lap(&work->shading.stats, CLI_STAGE_WRITE);
    return CLI_OK;
}

/* Counts the voxels, and prints the results. */
static int finish(volume_work *work) {
    cli_stats *stats = &work->shading.stats;
    vsh_volume_info info;
    vsh_volume_get_info(work->volume, &info);
    stats->voxels = info.shaded;
    stats->inside_voxels = info.filled + info.off;
    for (size_t i = 0; i < info.grids; ++i) {
        vsh_volume_grid grid;
        vsh_volume_get_grid(work->volume, i, &grid);
        stats->tiles += grid.tiles;
    }
    CLI_TRY(cli_stats_finish(stats, work->settings->bake.stats));
    cli_inform("%s: %zu grid%s of %" PRIu64 " voxels, %" PRIu64 " more inside, %" PRIu64
               " of them filled; %s",
               work->settings->bake.output, info.grids, info.grids == 1 ? "" : "s", info.shaded,
               info.filled + info.off, info.filled, cli_bytes_text(info.bytes));
    if (work->settings->slices) {
        int32_t size[3];
        get_size(work, size);
        cli_inform("%s: %d slice%s of %d x %d", work->settings->bake.output, size[2], size[2] == 1 ? "" : "s",
                   size[0], size[1]);
    }
    cli_stats_say(stats);
    return CLI_OK;
}

/* Bytes of a block of 8³ voxels: values in one grid with their part of the tree, and masks. */
static const double GRID_BYTES = 2200.0, BLOCK_BYTES = 640.0;

static void print_forecast(const volume_work *work) {
    const vsh_scene *scene = work->shading.scene;
    vsh_voxels_info info;
    vsh_voxels_get_info(work->voxels, &info);
    const double grids = (double)count_grids(scene);
    const double strip = work->settings->slices ? (double)info.count * sizeof(float) : 0.0;
    const double bytes =
        (double)vshi_peak_bytes() + (double)info.blocks * (BLOCK_BYTES + GRID_BYTES * grids) + strip * grids;
    printf("voxels        %" PRIu64 ", with those inside\n", info.count);
    printf("memory        about %s at most\n", cli_bytes_text((uint64_t)bytes));
}

static int run_volume(const volume_settings *s, volume_work *work) {
    cli_shading *shading = &work->shading;
    const char *const files[] = {s->bake.input, s->like, cli_bake_lights(&s->bake)};
    const char *const outputs[] = {s->bake.output, s->header, s->bake.stats};
    CLI_TRY(cli_shading_begin(shading, &s->bake, CLI_STATS_VOXELS));
    shading->scene->grid.half_width = fmax(shading->scene->grid.half_width, s->band);
    CLI_TRY(cli_bake_check_work(&s->bake, &shading->made));
    CLI_TRY(cli_check_outputs(outputs, CLI_COUNT(outputs), files, CLI_COUNT(files), shading->scene));
    cli_signals_watch();
    CLI_TRY(load(work));
    CLI_TRY(make_occluders(work));
    CLI_TRY(check_slices(work));
    if (s->bake.dry_run) {
        print_forecast(work);
        return CLI_OK;
    }
    CLI_TRY(cli_provenance_make(shading->scene, files, CLI_COUNT(files), &shading->stats.casters,
                                &shading->origin));
    CLI_TRY(bake_volume(work));
    CLI_TRY(write_volume(work));
    return finish(work);
}

static int volume_main(int argc, char **argv) {
    volume_settings s = {.band = 0.0};
    volume_work work = {.settings = &s};
    CLI_TRY(cli_parse(&cli_volume, argc, argv, &s, &s.bake.input));
    CLI_TRY(set_options(&s));
    const int code = run_volume(&s, &work);
    vsh_volume_free(work.volume);
    vsh_voxels_free(work.voxels);
    vsh_grid_free(work.grid);
    cli_shading_free(&work.shading);
    return code;
}

const cli_command cli_volume = {
    "volume", "INPUT -o OUT [options]", "grids of shadow and AO: a surface's band, a box, a fog's voxels",
    "Bakes soft shadows and ambient occlusion into grids or 3D textures. INPUT is a mesh file, a level\n"
    "set (FILE.vdb, FILE.vdb:GRID) or a scene file (.json; its casters, lights and ao, not its\n"
    "receivers). docs/query.md describes the output. Numbers in brackets are defaults.",
    CLI_ENDING(options, volume_main)};
