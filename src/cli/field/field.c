/* vdbshade field: a scene's fields, made once. */
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/provenance.h"
#include "cli/signals.h"
#include "cli/temporary.h"
#include "cli/try.h"
#include "cli/warnings.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { KEY_DRY_RUN = 0x2000 };

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT.field", "file to write; any ending but those of images and models"},
    {KEY_DRY_RUN, "dry-run", NULL,
     "make nothing: print voxels, memory and expected time,\nfound by a small field"},
    {0, NULL, NULL,
     "Light and occlusion: what 'bake' is told; only where no voxels\nare named does it tell how many"},
    CLI_LIGHT_OPTIONS,
    CLI_ACCURACY_OPTIONS,
    {0, NULL, NULL, "Casters and voxels"},
    CLI_NO_CAST_OPTION,
    CLI_CASTER_OPTION,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

static int field_main(int argc, char **argv);

const cli_command cli_field = {
    "field",
    "INPUT -o OUT.field [options]",
    "Makes the voxels of a mesh's, a .vdb's or a scene's (.json) casters, and keeps them in a file that\n"
    "bake, render, query, volume and trade take with --field: a second sun then costs no voxel. It is of\n"
    "these casters and voxels and of this version, and is refused for any other: docs/field.md. Numbers\n"
    "in brackets are what holds without the option.",
    options,
    sizeof options / sizeof options[0],
    field_main};

typedef struct field_settings {
    cli_bake_settings bake; /* the scene, as `bake` takes it */
    bool dry_run;
} field_settings;

static int take(void *settings, int key, const char *name, const char *value) {
    field_settings *s = settings;
    switch (key) {
    case 'o':
        s->bake.output = value;
        return CLI_OK;
    case KEY_DRY_RUN:
        s->dry_run = true;
        return CLI_OK;
    default:
        break;
    }
    return cli_shared_parse(&s->bake, key, name, value);
}

/* What can be refused before anything is read. */
static int check_output(const field_settings *s, const vsh_scene *scene) {
    static const char *const others[] = {"exr", "png",  "vdb", "json", "obj",
                                         "glb", "gltf", "ply", "stl",  "fbx"};
    const char *output = s->bake.output;
    for (size_t i = 0; i < sizeof others / sizeof others[0]; ++i) {
        if (cli_has_ending(output, others[i])) {
            return cli_usage("%s: a file of fields is no .%s: give -o OUT.field", output, others[i]);
        }
    }
    CLI_TRY(cli_bake_check_output(&s->bake, scene, output));
    CLI_TRY(cli_bake_check_inputs(&s->bake, scene, &output, 1));
    return cli_temporary_check(output);
}

static void say_summary(const char *output, const vsh_scene_field_report *r) {
    char bytes[VSHI_BYTES_ROOM];
    cli_say("%s: %zu field%s, voxel %.4g, %" PRIu64
            " active voxels, %s; voxelize %.2f s, field %.2f s, write "
            "%.2f s",
            output, r->fields, r->fields == 1 ? "" : "s", r->finest, r->active_voxels,
            vshi_bytes_text(r->field_bytes, bytes, sizeof bytes), r->voxelize_s, r->field_s, r->write_s);
}

static int save(const field_settings *s, const vsh_scene *scene, const vsh_assets *assets,
                const vsh_run *run) {
    const vsh_scene casters = {.casters = scene->casters, .caster_count = scene->caster_count};
    cli_provenance origin;
    CLI_TRY(cli_provenance_make(&casters, &s->bake.input, 1, NULL, run, &origin));
    vsh_scene_field_options told = vsh_scene_field_options_default();
    told.attributes = origin.attributes;
    told.attribute_count = origin.count;
    vsh_scene_field_report report;
    vsh_error error;
    const vsh_result result =
        vsh_scene_save_field(scene, assets, s->bake.output, &told, run, &report, &error);
    cli_provenance_free(&origin);
    if (result != VSH_OK) {
        return cli_fail_of(s->bake.input, &error);
    }
    cli_signals_end(CLI_OK);
    cli_warnings_tell();
    if (!s->bake.common.quiet) {
        say_summary(s->bake.output, &report);
    }
    return CLI_OK;
}

static int forecast(const field_settings *s, const vsh_scene *scene, const vsh_assets *assets,
                    const vsh_run *run) {
    vsh_scene_field_report r;
    vsh_error error;
    if (vsh_scene_field_forecast(scene, assets, run, &r, &error) != VSH_OK) {
        return cli_fail_of(s->bake.input, &error);
    }
    char grid[VSHI_BYTES_ROOM], field[VSHI_BYTES_ROOM];
    printf("fields        %zu\n", r.fields);
    printf("voxels        about %.3g of %.4g\n", (double)r.active_voxels, r.finest);
    printf("memory        level sets about %s, fields %s; the file is as large as these\n",
           vshi_bytes_text(r.grid_bytes, grid, sizeof grid),
           vshi_bytes_text(r.field_bytes, field, sizeof field));
    printf("time          about %.2g s: voxelize %.2g s, field %.2g s (by a small field; half or twice as "
           "much is "
           "possible)\n",
           r.voxelize_s + r.field_s, r.voxelize_s, r.field_s);
    return CLI_OK;
}

static int run_field(const field_settings *s, const vsh_scene *scene) {
    const vsh_run run = cli_common_run(&s->bake.common);
    vsh_assets *assets = NULL;
    vsh_error error;
    if (vsh_assets_load(scene, &run, &assets, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    const int code = s->dry_run ? forecast(s, scene, assets, &run) : save(s, scene, assets, &run);
    vsh_assets_free(assets);
    return code;
}

static int field_main(int argc, char **argv) {
    field_settings s;
    memset(&s, 0, sizeof s);
    s.bake.common = cli_common_default();
    bool help;
    int code = cli_parse(&cli_field, argc, argv, take, &s, "INPUT", &s.bake.input, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    CLI_TRY(cli_patch_check(&s.bake.patch));
    if (s.bake.output == NULL && !s.dry_run) {
        return cli_usage("%s: give -o OUT.field", s.bake.input);
    }
    cli_progress_begin(s.bake.common.progress, s.bake.common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    if (s.bake.output != NULL) {
        CLI_TRY_DONE(check_output(&s, &made.scene));
    }
    cli_signals_watch();
    code = run_field(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}
