/* What vdbshade volume is told. */
#include "cli/casters.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"
#include "cli/try.h"
#include "cli/volume/volume.h"

#include <math.h>
#include <string.h>

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
    {KEY_DRY_RUN, "dry-run", NULL,
     "bake nothing: print voxels, memory and expected time,\nfound by shading some voxels"},
    CLI_SHARD_OPTION(
        "bake part I of N into OUT.vdb.I-of-N.part; 'vdbshade\nmerge OUT.vdb' puts all parts together"),
    CLI_SHARD_LEAST_OPTION,
    {0, NULL, NULL, "Which voxels (without --box and --like the casters' own band)"},
    {KEY_BAND, "band", "VOXELS",
     "how far from the surface, in voxels, more than 0 to 100\n(all of the level set's band: --half-width)"},
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
    CLI_ISA_OPTION,
};

const cli_command cli_volume = {
    "volume",
    "INPUT -o OUT.vdb [options]",
    "Bakes soft shadows and ambient occlusion into sparse grids. INPUT is a mesh file, a level set\n"
    "(FILE.vdb, FILE.vdb:GRID) or a scene file (.json; its casters, lights and ao, not its receivers).\n"
    "What is written, and how to read it: docs/volume.md. Numbers in brackets are the defaults.",
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
    case CLI_KEY_SHARD:
        return cli_parse_shard(name, value, &s->bake.shard, &s->bake.shard_count);
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
        return cli_parse_name(name, value, vsh_inside, vsh_inside_name, &s->inside);
    default:
        break;
    }
    return cli_shared_parse(&s->bake, key, name, value);
}

int volume_check_options(const volume_settings *s) {
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

/* What can be refused before anything is read. */
int volume_check_files(const volume_settings *s, const vsh_scene *scene) {
    const char *output = s->bake.output, *stats = s->bake.stats;
    if (stats != NULL && cli_same_file(output, stats)) {
        return cli_usage("%s: both the output and the --stats file", output);
    }
    const int code = check_output(s, scene, output);
    return code == CLI_OK && stats != NULL ? check_output(s, scene, stats) : code;
}

int volume_parse(int argc, char **argv, volume_settings *s, bool *help) {
    memset(s, 0, sizeof *s);
    s->bake.common = cli_common_default();
    s->bake.shard_least = vsh_bake_job_options_default().shard_least;
    s->bake.words = (const char *const *)argv;
    s->bake.word_count = (size_t)argc;
    return cli_parse(&cli_volume, argc, argv, take, s, "INPUT", &s->bake.input, help);
}

/* --- its shards */

/* Faces of a cube of as many voxels a side as casters are long: surfaces of a room, a fence, a head, a house,
 * a tree and the cloister come to 0.5 to 1.6 times as many. */
enum { FACES = 3 };

/* Infinite where only files tell. */
static double expected_voxels(const volume_settings *s, const vsh_scene *scene) {
    if (s->has_box && s->box_voxel_size > 0.0) {
        double voxels = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            voxels *= fmax(1.0, ceil((s->box_max[axis] - s->box_min[axis]) / s->box_voxel_size));
        }
        return voxels;
    }
    const vsh_grid_options *grid = &scene->grid;
    if (s->has_box || s->like != NULL || grid->voxel_size > 0.0 || grid->resolution == 0) {
        return INFINITY;
    }
    const double side = grid->resolution, band = s->band > 0.0 ? s->band : (double)grid->half_width;
    return FACES * side * side * 2.0 * band;
}

int32_t volume_shards(const volume_settings *s, const vsh_scene *scene) {
    const vsh_volume_options bake = volume_options(s, scene);
    return vsh_volume_shards(expected_voxels(s, scene), scene->light_count, &bake, s->bake.shard_least,
                             s->bake.shard_count);
}

vsh_volume_options volume_options(const volume_settings *s, const vsh_scene *scene) {
    vsh_volume_options bake = vsh_volume_options_default();
    bake.inside = s->inside;
    bake.ao = scene->ao;
    bake.error = scene->error;
    bake.shade = scene->shade;
    return bake;
}
