/* vdbshade view: one page that shows baked meshes, to be turned and looked into. */
#include "base/clock.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/temporary.h"

enum { KEY_PLANES = 0x2000, KEY_OTHER_PLANES, KEY_UV_SET };

/* Planes of one bake, a file each. */
typedef struct view_planes {
    const char *files[VSH_MAX_VIEW_PLANES];
    size_t count;
} view_planes;

typedef struct view_settings {
    const char *inputs[2]; /* the second may be NULL */
    const char *output;
    view_planes planes[2];
    int32_t uv_set;
} view_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "Page"},
    {CLI_TEXT(view_settings, output), "output", "OUT.html", "page to write"},
    {KEY_PLANES, "planes", "FILE",
     "image of a bake of INPUT, best an EXR with every\nchannel; again for each further page of its "
     "lightmap"},
    {KEY_OTHER_PLANES, "other-planes", "FILE", "the same of OTHER or, without one, of INPUT once more"},
    {KEY_UV_SET, "uv-set", "N",
     "UV set of the lightmap, from 0 (that of the lightmap\nor AO in the materials, or else as bake takes "
     "it)"},
    CLI_COMMON_OPTIONS,
};

static int take_planes(view_planes *planes, const char *name, const char *value) {
    if (planes->count == VSH_MAX_VIEW_PLANES) {
        return cli_usage("%s '%s': at most %d are taken", name, value, VSH_MAX_VIEW_PLANES);
    }
    planes->files[planes->count++] = value;
    return CLI_OK;
}

static int take(void *settings, int key, const char *name, const char *value) {
    view_settings *s = settings;
    switch (key) {
    case KEY_PLANES:
        return take_planes(&s->planes[0], name, value);
    case KEY_OTHER_PLANES:
        return take_planes(&s->planes[1], name, value);
    default: /* --uv-set */
        return cli_parse_integer(name, value, 0, VSH_MAX_UV_SETS - 1, &s->uv_set);
    }
}

static bool is_scene(const view_settings *s) {
    return cli_has_ending(s->inputs[0], "json");
}

/* What can be refused before anything is read. */
static int check(const view_settings *s) {
    if (s->output == NULL || !cli_has_ending(s->output, "html")) {
        return cli_usage("%s: give -o OUT.html", s->output != NULL ? s->output : s->inputs[0]);
    }
    if (is_scene(s) &&
        (s->inputs[1] != NULL || s->planes[0].count + s->planes[1].count > 0 || s->uv_set >= 0)) {
        return cli_usage("%s: is a scene, which takes no OTHER, --planes, --other-planes or --uv-set",
                         s->inputs[0]);
    }
    for (size_t i = 0; i < 2; ++i) {
        CLI_TRY(cli_check_apart(s->output, s->inputs[i], "the input"));
        for (size_t k = 0; k < s->planes[i].count; ++k) {
            CLI_TRY(cli_check_apart(s->output, s->planes[i].files[k], "also a file of planes"));
        }
    }
    return cli_temporary_check(s->output);
}

static int write_scene(const view_settings *s, const vsh_run *run) {
    vsh_scene *scene = NULL;
    vsh_error error;
    const bool done =
        vsh_scene_read(s->inputs[0], run, &scene, &error) == VSH_OK &&
        vsh_scene_check_outputs(scene, &s->output, 1, run, &error) == VSH_OK &&
        vsh_view_write_scene(s->output, cli_file_name(s->inputs[0]), scene, run, &error) == VSH_OK;
    vsh_scene_free(scene);
    return done ? CLI_OK : cli_fail_of(NULL, &error);
}

static int write_page(const view_settings *s, const vsh_run *run) {
    vsh_view_bake bakes[2];
    for (size_t i = 0; i < 2; ++i) {
        bakes[i] = vsh_view_bake_default();
        bakes[i].model = s->inputs[i];
        bakes[i].planes = s->planes[i].files;
        bakes[i].plane_count = s->planes[i].count;
        bakes[i].uv_set = s->uv_set;
    }
    const bool two = s->inputs[1] != NULL || s->planes[1].count > 0;
    vsh_error error;
    return cli_check_result(vsh_view_write(s->output, &bakes[0], two ? &bakes[1] : NULL, run, &error),
                            &error);
}

static int view_main(int argc, char **argv) {
    view_settings s = {.uv_set = -1};
    CLI_TRY(cli_parse(&cli_view, argc, argv, take, &s, s.inputs));
    CLI_TRY(check(&s));
    const double start = vshi_seconds();
    const vsh_run run = cli_make_run();
    cli_signals_watch();
    CLI_TRY(is_scene(&s) ? write_scene(&s, &run) : write_page(&s, &run));
    cli_signals_end(CLI_OK);
    if (!cli_given.quiet) {
        cli_say("%s: written in %.2f s; open it in a browser", s.output, vshi_seconds() - start);
    }
    return CLI_OK;
}

const cli_command cli_view = {
    "view",
    "INPUT [OTHER] -o OUT.html [options]",
    "Writes a page that shows a lit mesh in a browser, in three dimensions: its light, AO, every channel\n"
    "of its bake, texel density and charts, and compares two bakes. A page of a scene (.json) shows the\n"
    "surface of the casters' voxels, with shadows and AO at its vertices. The page needs no other file;\n"
    "docs/view.md",
    options,
    sizeof options / sizeof options[0],
    view_main};
