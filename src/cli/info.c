/* vdbshade info: what a file holds, and what is wrong with it. */
#include "info.h"

#include "commands.h"
#include "message.h"
#include "paths.h"
#include "progress.h"
#include "signals.h"

static const cli_option options[] = {
    {0, NULL, NULL, "Options"},
    CLI_TRUSTED_OPTION,
    {'h', "help", NULL, "show this help"},
};

static int info_main(int argc, char **argv);

const cli_command cli_info = {
    "info",
    "FILE",
    "Prints what a file holds and what is wrong with it. Meshes: triangles, vertices, UV sets, bounds,\n"
    "open, flipped and degenerate parts, overlapping UVs. OpenVDB files (.vdb): class, voxel size, band,\n"
    "bounds, memory of each grid, and why it cannot cast. Scenes (.json): casters, lights, receivers.\n"
    "Images: size, and the range of each channel.",
    options,
    sizeof options / sizeof options[0],
    info_main};

static int take(void *settings, int key, const char *name, const char *value) {
    bool taken;
    const int code = cli_common_take(settings, key, name, value, &taken);
    return taken ? code : cli_usage("%s: no such option", name);
}

static int print_info(const char *path, const vsh_run *run) {
    static const char *const image_endings[] = {
        "exr", "png", "tif", "tiff", "jpg", "jpeg", "hdr", "tga", "bmp", "webp", "dpx",  "psd",  "pgm",
        "ppm", "pnm", "pfm", "gif",  "jp2", "j2k",  "sgi", "rgb", "rla", "ico",  "heic", "heif", "avif"};
    if (cli_has_ending(path, "vdb")) {
        return cli_info_vdb(path, run);
    }
    if (cli_has_ending(path, "json")) {
        return cli_info_scene(path);
    }
    for (size_t i = 0; i < sizeof image_endings / sizeof image_endings[0]; ++i) {
        if (cli_has_ending(path, image_endings[i])) {
            return cli_info_image(path, run);
        }
    }
    return cli_info_mesh(path, run);
}

static int info_main(int argc, char **argv) {
    cli_common common = cli_common_default();
    const char *path = NULL;
    bool help;
    const int code = cli_parse(&cli_info, argc, argv, take, &common, "FILE", &path, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(false, true);
    cli_signals_watch();
    const vsh_run run = cli_common_run(&common);
    return print_info(path, &run);
}
