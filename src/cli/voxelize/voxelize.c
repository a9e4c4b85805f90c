/* vdbshade voxelize: casters to a .vdb level set. */
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <inttypes.h>

enum { KEY_NAME = 0x2000 };

typedef struct voxelize_settings {
    cli_bake_settings bake; /* the casters, as `bake` takes them */
    const char *name;
} voxelize_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(voxelize_settings, bake.output), "output", "OUT.vdb", "OpenVDB file to write"},
    {KEY_NAME, "name", "NAME", "name of the grid in it (surface)"},
    {0, NULL, NULL, "Voxels"},
    CLI_GRID_OPTIONS,
    CLI_SETTINGS(VSH_SETTINGS_LEVEL_SET),
    CLI_COMMON_OPTIONS,
};

static int take(void *settings, int key, const char *name, const char *value) {
    voxelize_settings *s = settings;
    if (key == KEY_NAME) {
        s->name = value;
        return value[0] != '\0' ? CLI_OK : cli_usage("%s '': expected a name", name);
    }
    return cli_patch_take(&s->bake.patch, key, name, value);
}

static int voxelize(const voxelize_settings *s, const vsh_scene *scene) {
    CLI_TRY(cli_bake_check_output(&s->bake, scene, s->bake.output));
    CLI_TRY(cli_temporary_check(s->bake.output));
    cli_signals_watch();
    const double start = vshi_seconds();
    const vsh_run run = cli_make_run();
    const vsh_scene casters = {.casters = scene->casters, .caster_count = scene->caster_count};
    vsh_occluders_info made = {.voxel_size = 0.0};
    cli_provenance origin = {.count = 0};
    vsh_assets *assets = NULL;
    vsh_grid *grid = NULL;
    vsh_grid_info info;
    vsh_error error;
    int code;
    CLI_TRY_DONE(cli_check_result(vsh_assets_load(scene, &run, &assets, &error), &error));
    CLI_TRY_DONE(cli_check_result(vsh_scene_casters(scene, assets, &run, &grid, &error), &error));
    vsh_grid_get_info(grid, &info);
    made.voxel_size = info.voxel_size;
    CLI_TRY_DONE(cli_provenance_make(&casters, &s->bake.input, 1, &made, &run, &origin));
    CLI_TRY_DONE(cli_begin_writing());
    CLI_TRY_DONE(cli_check(
        vsh_grid_write(grid, s->bake.output, s->name, origin.attributes, origin.count, &error), &error));
    cli_signals_end(CLI_OK);
    if (!cli_given.quiet) {
        char bytes[32];
        cli_say("%s: voxel %.4g, %" PRIu64 " active voxels, %s in memory, %.2f s", s->bake.output,
                info.voxel_size, info.active_voxels, vshi_bytes_text(info.bytes, bytes, sizeof bytes),
                vshi_seconds() - start);
    }
done:
    cli_provenance_free(&origin);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    return code;
}

static int voxelize_main(int argc, char **argv) {
    voxelize_settings s = {.name = NULL};
    CLI_TRY(cli_parse(&cli_voxelize, argc, argv, take, &s, &s.bake.input));
    CLI_TRY(cli_patch_check(&s.bake.patch));
    if (s.bake.output == NULL || !cli_has_ending(s.bake.output, "vdb")) {
        return cli_usage("%s: give -o OUT.vdb", s.bake.output != NULL ? s.bake.output : s.bake.input);
    }
    cli_bake_scene made;
    int code;
    CLI_TRY_DONE(cli_bake_scene_casters(&s.bake, &made));
    vsh_scene casters = vsh_scene_default(); /* no method of the scene's leaves any of them out */
    casters.casters = made.scene.casters;
    casters.caster_count = made.scene.caster_count;
    casters.grid = made.scene.grid;
    casters.unit = made.scene.unit;
    casters.cast_blended = made.scene.cast_blended;
    casters.solidity = made.scene.solidity;
    casters.solidity_count = made.scene.solidity_count;
    code = voxelize(&s, &casters);
done:
    cli_bake_scene_free(&made);
    return code;
}

const cli_command cli_voxelize = {
    "voxelize",
    "INPUT -o OUT.vdb [options]",
    "Turns a mesh file, a level set (FILE.vdb or FILE.vdb:GRID), or all casters of a scene file (.json)\n"
    "into one narrow-band level set. Numbers in brackets are what holds without the option.",
    options,
    sizeof options / sizeof options[0],
    voxelize_main};
