/* vdbshade: the command line. Which subcommand, and the exit code. */
#include "child.h"
#include "commands.h"
#include "message.h"
#include "signals.h"
#include "warnings.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <vdbshade/reader.h>

static const cli_command *const commands[] = {
    &cli_bake,   &cli_voxelize, &cli_info,    &cli_trade,  &cli_query, &cli_volume, &cli_flat,
    &cli_render, &cli_compare,  &cli_regress, &cli_unwrap, &cli_view,  &cli_field};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

static const char help_text[] =
    "Usage: vdbshade COMMAND …\n"
    "\n"
    "Bakes soft shadows and ambient occlusion from signed distance fields.\n"
    "\n"
    "Commands:\n"
    "  bake INPUT -o OUT         lightmap of a mesh or a scene (.json)\n"
    "  unwrap INPUT -o OUT.obj   lightmap UVs for meshes that have none\n"
    "  voxelize INPUT -o OUT.vdb level set of a mesh's or a scene's casters\n"
    "  field INPUT -o OUT.field  a scene's fields, made once for many bakes\n"
    "  info FILE                 what a mesh, .vdb, scene or image holds, and what is wrong with it\n"
    "  volume INPUT -o OUT.vdb   grids of shadow and AO: a surface's band, a box, a fog's voxels\n"
    "  query INPUT -o OUT        shadow, AO, distance at points of a CSV, a PLY or raw floats\n"
    "  render INPUT -o OUT       picture of a scene, or a turntable, to look at a bake\n"
    "  view INPUT -o OUT.html    page to look at a lit mesh in a browser, with every channel of its bake\n"
    "  flat SCENE -o OUT         light map of a plane, for 2D games\n"
    "  compare GOLDEN NEW        whether a bake is like its golden one, and in what it is not\n"
    "  regress DIR               bakes of a folder's scenes against their golden ones\n"
    "  trade INPUT -o OUT.html   error against time by every method, measured on a scene of yours\n"
    "\n"
    "  vdbshade COMMAND --help   options of a command\n"
    "  vdbshade --version        version\n"
    "\n"
    "Exit codes: 0 done; 1 a comparison did not hold; 2 bad usage or bad input; 3 a file could not be\n"
    "read or written; 4 a limit (memory, size) would be passed; 70 a defect of vdbshade; 130\n"
    "interrupted. Errors are one line on standard error; a failed or interrupted run leaves the old\n"
    "output as it was.\n";

static int unknown_command(const char *text) {
    if (text[0] == '-') {
        return cli_usage("%s: no such option; see 'vdbshade --help'", text);
    }
    const char *names[COMMAND_COUNT];
    for (size_t i = 0; i < COMMAND_COUNT; ++i) {
        names[i] = commands[i]->name;
    }
    const char *near = cli_nearest(text, names, COMMAND_COUNT);
    if (near != NULL) {
        return cli_usage("%s: no such command; did you mean %s?", text, near);
    }
    return cli_usage("%s: no such command; see 'vdbshade --help'", text);
}

static int dispatch(int argc, char **argv) {
    if (argc < 2) {
        return cli_usage("no command; see 'vdbshade --help'");
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        fputs(help_text, stdout);
        return CLI_OK;
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("vdbshade %s\n", vsh_version());
        return CLI_OK;
    }
    for (size_t i = 0; i < COMMAND_COUNT; ++i) {
        if (strcmp(argv[1], commands[i]->name) == 0) {
            if (commands[i] != &cli_query) { /* which may write points there */
                cli_plain_output();
            }
            return commands[i]->main(argc - 1, argv + 1);
        }
    }
    return unknown_command(argv[1]);
}

int main(int argc, char **argv) {
    const int served = vsh_reader_serve(argc, argv);
    if (served >= 0) {
        _exit(served); /* what it holds goes with it */
    }
    cli_self_close();
    cli_signals_begin();
    int code = dispatch(argc, argv);
    cli_warnings_tell();
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == CLI_OK) {
        cli_say("standard output: cannot be written: %s", strerror(errno));
        code = CLI_FILE;
    }
    return code;
}
