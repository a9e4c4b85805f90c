/* vdbshade view: a page that shows baked meshes or a scene in a browser. */
#include "base/clock.h"
#include "cli.h"

typedef struct view_settings {
    const char *inputs[2]; /* the second may be NULL */
    const char *output;
    cli_list planes[2];
    int32_t uv_set;
} view_settings;

static const cli_option options[] = {
    {.help = "Page"},
    {"output", "OUT.html", "page to write", CLI_VALUE(TEXT, view_settings, output)},
    {"planes", "FILE",
     "image of a bake of INPUT, best an EXR with every channel; again for each further page of its lightmap",
     CLI_RANGE(LIST, view_settings, planes[0], 0, VSH_MAX_VIEW_PLANES)},
    {"other-planes", "FILE", "the same of OTHER or, without one, of INPUT once more",
     CLI_RANGE(LIST, view_settings, planes[1], 0, VSH_MAX_VIEW_PLANES)},
    {"uv-set", "N",
     "UV set of the lightmap, from 0 (that of the lightmap or AO in the materials, else bake's default)",
     CLI_RANGE(INTEGER, view_settings, uv_set, 0, VSH_MAX_UV_SETS - 1)},
    CLI_COMMON_OPTIONS,
};

static bool is_scene(const view_settings *s) {
    return cli_has_ending(s->inputs[0], "json");
}

/* Refuses what can be refused before anything is read. */
static int check(const view_settings *s) {
    CLI_REFUSE_IF(s->output == NULL || !cli_has_ending(s->output, "html"), "%s: give -o OUT.html",
                  s->output != NULL ? s->output : s->inputs[0]);
    CLI_REFUSE_IF(is_scene(s) &&
                      (s->inputs[1] != NULL || s->planes[0].count + s->planes[1].count > 0 || s->uv_set >= 0),
                  "%s: a scene takes no OTHER, --planes, --other-planes or --uv-set", s->inputs[0]);
    for (size_t i = 0; i < 2; ++i) {
        CLI_TRY(cli_check_apart(&s->output, 1, s->planes[i].text, s->planes[i].count, NULL));
    }
    return cli_check_outputs(&s->output, 1, s->inputs, 2, NULL);
}

static int write_scene(const view_settings *s) {
    vsh_scene *scene = NULL;
    const bool done =
        vsh_scene_read(s->inputs[0], &cli_run, &scene, &cli_error) == VSH_OK &&
        vsh_scene_check_outputs(scene, &s->output, 1, &cli_run, &cli_error) == VSH_OK &&
        vsh_view_write_scene(s->output, vshi_path_name(s->inputs[0]), scene, &cli_run, &cli_error) == VSH_OK;
    vsh_scene_free(scene);
    return done ? CLI_OK : cli_fail_with(NULL);
}

static int write_page(const view_settings *s) {
    vsh_view_bake bakes[2];
    for (size_t i = 0; i < 2; ++i) {
        bakes[i] = vsh_view_bake_default();
        bakes[i].model = s->inputs[i];
        bakes[i].planes = s->planes[i].text;
        bakes[i].plane_count = s->planes[i].count;
        bakes[i].uv_set = s->uv_set;
    }
    const vsh_view_bake *other = s->inputs[1] != NULL || s->planes[1].count > 0 ? &bakes[1] : NULL;
    return cli_check_input(vsh_view_write(s->output, &bakes[0], other, &cli_run, &cli_error));
}

static int view_main(int argc, char **argv) {
    view_settings s = {.uv_set = -1};
    CLI_TRY(cli_parse(&cli_view, argc, argv, &s, s.inputs));
    CLI_TRY(check(&s));
    const double start = vshi_seconds();
    cli_signals_watch();
    CLI_TRY(is_scene(&s) ? write_scene(&s) : write_page(&s));
    cli_signals_end(CLI_OK);
    cli_inform("%s: written in %.2f s; open it in a browser", s.output, vshi_seconds() - start);
    return CLI_OK;
}

const cli_command cli_view = {
    "view", "INPUT [OTHER] -o OUT.html [options]",
    "page that shows a lit mesh in a browser, with every channel of its bake",
    "Writes a page that shows a lit mesh in a browser, in three dimensions: its light, AO, every channel\n"
    "of its bake, texel density and charts. It compares two bakes. A page of a scene (.json) shows the\n"
    "surface of the casters' voxels, with shadows and AO at its vertices. The page needs no other file;\n"
    "docs/view.md",
    CLI_ENDING(options, view_main)};
