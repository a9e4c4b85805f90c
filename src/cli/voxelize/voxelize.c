/* vdbshade voxelize: casters to a .vdb level set. */
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/options.h"
#include "cli/patch.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { KEY_NAME = 0x2000 };

typedef struct voxelize_settings {
    const char *input;
    const char *output;
    const char *name;
    cli_common common;
    cli_patch patch;
} voxelize_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT.vdb", "OpenVDB file to write"},
    {KEY_NAME, "name", "NAME", "name of the grid in it (surface)"},
    {0, NULL, NULL, "Voxels"},
    CLI_GRID_OPTIONS,
    CLI_SETTINGS(VSH_SETTINGS_LEVEL_SET),
    CLI_COMMON_OPTIONS,
};

static int voxelize_main(int argc, char **argv);

const cli_command cli_voxelize = {
    "voxelize",
    "INPUT -o OUT.vdb [options]",
    "Turns a mesh file, a level set (FILE.vdb or FILE.vdb:GRID), or all casters of a scene file (.json)\n"
    "into one narrow-band level set. Numbers in brackets are what holds without the option.",
    options,
    sizeof options / sizeof options[0],
    voxelize_main};

static int take(void *settings, int key, const char *name, const char *value) {
    voxelize_settings *s = settings;
    if (key == 'o') {
        s->output = value;
        return CLI_OK;
    }
    if (key == KEY_NAME) {
        s->name = value;
        return value[0] != '\0' ? CLI_OK : cli_usage("%s '': expected a name", name);
    }
    bool taken;
    const int code = cli_patch_take(&s->patch, key, name, value, &taken);
    return taken ? code : cli_common_parse(&s->common, key, name, value, &taken);
}

/* What can be refused before anything is read. */
static int check_files(const voxelize_settings *s, const vsh_scene *scene) {
    if (cli_same_file(s->output, s->input)) {
        return cli_usage("%s: the output is the input", s->output);
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (caster->path != NULL && cli_same_file(s->output, caster->path)) {
            return cli_usage("%s: the output is also a caster's file", s->output);
        }
    }
    return cli_temporary_check(s->output);
}

static int write_grid(const voxelize_settings *s, const vsh_scene *scene, const vsh_run *run,
                      const vsh_grid *grid) {
    const vsh_scene casters = {.casters = scene->casters, .caster_count = scene->caster_count};
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    cli_provenance origin;
    const vsh_occluders_info made = {.voxel_size = info.voxel_size};
    const int code = cli_provenance_make(&casters, &s->input, 1, &made, run, &origin);
    if (code != CLI_OK) {
        return code;
    }
    if (cli_progress_report(NULL, "write", 0.0) != 0) {
        const vsh_error cancelled = {VSH_ERROR_CANCELLED, "write: cancelled"};
        cli_provenance_free(&origin);
        return cli_fail(&cancelled);
    }
    vsh_error error;
    const vsh_result result =
        vsh_grid_write(grid, s->output, s->name, origin.attributes, origin.count, &error);
    cli_provenance_free(&origin);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

static void say_summary(const voxelize_settings *s, const vsh_grid *grid, double seconds) {
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    char bytes[32];
    cli_say("%s: voxel %.4g, %" PRIu64 " active voxels, %s in memory, %.2f s", s->output, info.voxel_size,
            info.active_voxels, vshi_bytes_text(info.bytes, bytes, sizeof bytes), seconds);
}

static int voxelize(const voxelize_settings *s, const vsh_scene *scene) {
    const double start = vshi_seconds();
    const vsh_run run = cli_common_run(&s->common);
    vsh_assets *assets = NULL;
    vsh_grid *grid = NULL;
    vsh_error error;
    int code;
    if (vsh_assets_load(scene, &run, &assets, &error) != VSH_OK ||
        vsh_scene_casters(scene, assets, &run, &grid, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
        goto done;
    }
    CLI_TRY_DONE(write_grid(s, scene, &run, grid));
    cli_signals_end(CLI_OK);
    if (!s->common.quiet) {
        say_summary(s, grid, vshi_seconds() - start);
    }
done:
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    return code;
}

static int voxelize_main(int argc, char **argv) {
    voxelize_settings s;
    memset(&s, 0, sizeof s);
    s.common = cli_common_default();
    bool help;
    int code = cli_parse(&cli_voxelize, argc, argv, take, &s, "INPUT", &s.input, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    code = cli_patch_check(&s.patch);
    if (code != CLI_OK) {
        return code;
    }
    if (s.output == NULL || !cli_has_ending(s.output, "vdb")) {
        return cli_usage("%s: give -o OUT.vdb", s.output != NULL ? s.output : s.input);
    }
    cli_progress_begin(s.common.progress, s.common.quiet);
    const bool vdb = cli_has_ending(s.input, "vdb");
    vsh_caster caster = vsh_caster_default();
    caster.type = vdb ? VSH_CASTER_VDB : VSH_CASTER_MESH;
    caster.path = s.input;
    caster.grid = cli_parsed_grid();
    vsh_scene scene = vsh_scene_default();
    scene.casters = &caster;
    scene.caster_count = 1;
    scene.grid.resolution = vdb ? 0 : scene.grid.resolution; /* its own voxels */
    vsh_scene *read = NULL;
    if (cli_has_ending(s.input, "json")) {
        const vsh_run run = cli_common_run(&s.common);
        vsh_error error;
        if (vsh_scene_read(s.input, &run, &read, &error) != VSH_OK) {
            return cli_fail(&error);
        }
        scene.casters = read->casters;
        scene.caster_count = read->caster_count;
        scene.grid = read->grid;
        scene.unit = read->unit;
        scene.cast_blended = read->cast_blended;
    }
    CLI_TRY_DONE(cli_patch_scene(&s.patch, &scene));
    CLI_TRY_DONE(check_files(&s, &scene));
    cli_signals_watch();
    code = voxelize(&s, &scene);
done:
    vsh_scene_free(read);
    cli_progress_end();
    return code;
}
