/* vdbshade info: what a file holds, and what is wrong with it. */
#include "info.h"

#include "cli/commands.h"
#include "cli/message.h"
#include "cli/patch.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"

enum { KEY_SIZE = 0x2000 };

static const cli_option options[] = {
    {0, NULL, NULL, "Options"},
    {KEY_SIZE, "size", "W[xH]", "texels of the lightmap that UVs are looked at in (1024)"},
    {CLI_KEY_VERBOSE, "verbose", NULL, "a paragraph for each mesh, however many there are"},
    CLI_SETTING("unit"),
    CLI_MEMORY_OPTION,
    CLI_READER_OPTIONS,
    {'h', "help", NULL, "show this help"},
};

static int info_main(int argc, char **argv);

const cli_command cli_info = {
    "info",
    "FILE",
    "Prints what a file holds and what is wrong with it. Meshes: objects, triangles, UV sets, bounds,\n"
    "open, flipped and degenerate parts, what they are taken for, UVs that overlap within or between\n"
    "objects. OpenVDB files (FILE.vdb, or FILE.vdb:GRID): class, voxel size, band, bounds, memory of\n"
    "each grid, and why it cannot cast. Scenes (.json): casters, lights, receivers. Images: size, and\n"
    "the range of each channel.",
    options,
    sizeof options / sizeof options[0],
    info_main};

typedef struct info_settings {
    cli_common common;
    cli_patch patch;
    cli_info_look look;
} info_settings;

static int take(void *settings, int key, const char *name, const char *value) {
    info_settings *s = settings;
    bool taken;
    if (key == KEY_SIZE) {
        return cli_parse_size(name, value, &s->look.width, &s->look.height);
    }
    const int code = cli_patch_take(&s->patch, key, name, value, &taken);
    return taken ? code : cli_common_parse(&s->common, key, name, value, &taken);
}

static int print_info(const char *path, const cli_info_look *look, const vsh_run *run) {
    if (cli_has_ending(path, "vdb")) {
        return cli_info_vdb(path, cli_parsed_grid(), run);
    }
    if (cli_has_ending(path, "json")) {
        return cli_info_scene(path, run);
    }
    if (cli_has_ending_of(path, CLI_IMAGE_ENDINGS)) {
        return cli_info_image(path, run);
    }
    return cli_info_mesh(path, look, run);
}

static int info_main(int argc, char **argv) {
    info_settings s = {.common = cli_common_default(), .look = {.width = 1024, .height = 1024}};
    const char *path = NULL;
    bool help;
    const int code = cli_parse(&cli_info, argc, argv, take, &s, "FILE", &path, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(false, true);
    cli_signals_watch();
    const vsh_run run = cli_common_run(&s.common);
    s.look.all = s.common.verbose;
    vsh_scene scene = vsh_scene_default();
    cli_patch_scene(&s.patch, &scene);
    s.look.unit = scene.unit;
    return print_info(path, &s.look, &run);
}
