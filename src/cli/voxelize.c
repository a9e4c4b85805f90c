/* vdbshade voxelize: casters to a .vdb level set. */
#include "bake/bake.h"
#include "base/clock.h"

typedef struct voxelize_settings {
    cli_bake_settings bake; /* the casters */
    const char *name;
} voxelize_settings;

static const cli_option options[] = {
    {.help = "Output"},
    {"output", "OUT.vdb", "OpenVDB file to write", CLI_VALUE(TEXT, voxelize_settings, bake.output)},
    {"name", "NAME", "name of the grid in it (surface)", CLI_VALUE(TEXT, voxelize_settings, name)},
    {.help = "Voxels"},
    CLI_GRID_OPTIONS,
    {CLI_SETTINGS(VSH_SETTINGS_LEVEL_SET)},
    CLI_COMMON_OPTIONS,
};

static int voxelize(const voxelize_settings *s, vsh_scene *scene) {
    const char *output = s->bake.output, *input = s->bake.input;
    CLI_TRY(cli_check_outputs(&output, 1, &input, 1, scene));
    cli_signals_watch();
    const double start = vshi_seconds();
    const vsh_scene casters = {.casters = scene->casters, .caster_count = scene->caster_count};
    vsh_occluders_info made = {.voxel_size = 0.0};
    cli_provenance origin = {.count = 0};
    vsh_assets *assets = NULL;
    vsh_grid *grid = NULL;
    vsh_grid_info info;
    int code;
    CLI_TRY_DONE(cli_check_input(vsh_assets_load(scene, &cli_run, &assets, &cli_error)));
    CLI_TRY_DONE(cli_check_input(vsh_scene_casters(scene, assets, &cli_run, &grid, &cli_error)));
    vsh_grid_get_info(grid, &info);
    made.voxel_size = info.voxel_size;
    CLI_TRY_DONE(cli_provenance_make(&casters, &input, 1, &made, &origin));
    CLI_TRY_DONE(cli_begin_writing());
    CLI_TRY_DONE(
        cli_check(vsh_grid_write(grid, output, s->name, origin.attributes, origin.count, &cli_error)));
    cli_signals_end(CLI_OK);
    cli_inform("%s: voxel %.4g, %" PRIu64 " active voxels, %s in memory, %.2f s", output, info.voxel_size,
               info.active_voxels, cli_bytes_text(info.bytes), vshi_seconds() - start);
done:
    cli_provenance_free(&origin);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    return code;
}

static int voxelize_main(int argc, char **argv) {
    voxelize_settings s = {.bake.output = NULL};
    CLI_TRY(cli_parse(&cli_voxelize, argc, argv, &s, &s.bake.input));
    CLI_REFUSE_IF(s.bake.output == NULL || !cli_has_ending(s.bake.output, "vdb"), "%s: give -o OUT.vdb",
                  s.bake.output != NULL ? s.bake.output : s.bake.input);
    CLI_REFUSE_IF(s.name != NULL && s.name[0] == '\0', "--name '': expected a name");
    cli_bake_scene made;
    int code;
    CLI_TRY_DONE(cli_bake_scene_casters(&s.bake, &made));
    vsh_scene casters = vsh_scene_default(); /* the scene's methods would leave some casters out */
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
    "voxelize", "INPUT -o OUT.vdb [options]", "level set of a mesh's or a scene's casters",
    "Turns a mesh file, a level set (FILE.vdb or FILE.vdb:NAME), or all casters of a scene file (.json)\n"
    "into one narrow-band level set. Numbers in brackets are defaults.",
    CLI_ENDING(options, voxelize_main)};
