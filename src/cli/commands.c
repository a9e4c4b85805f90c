/* The table of subcommands, and the help of the whole program. */
#include "commands.h"

#include "message.h"

#include <stdio.h>
#include <string.h>

static const cli_command_row rows[] = {
    {&cli_bake, "INPUT -o OUT", "lightmap of a mesh or a scene (.json)"},
    {&cli_merge, "OUT", "parts of a bake on several machines, put together"},
    {&cli_unwrap, "INPUT -o OUT.obj", "lightmap UVs for meshes that have none"},
    {&cli_voxelize, "INPUT -o OUT.vdb", "level set of a mesh's or a scene's casters"},
    {&cli_info, "FILE", "what a mesh, .vdb, scene or image holds, and what is wrong with it"},
    {&cli_volume, "INPUT -o OUT.vdb", "grids of shadow and AO: a surface's band, a box, a fog's voxels"},
    {&cli_query, "INPUT -o OUT", "shadow, AO, distance at points of a CSV, a PLY or raw floats"},
    {&cli_render, "INPUT -o OUT", "picture of a scene, to look at a bake"},
    {&cli_view, "INPUT -o OUT.html",
     "page to look at a lit mesh in a browser, with every channel of its bake"},
    {&cli_flat, "SCENE -o OUT", "light map of a plane, for 2D games"},
    {&cli_compare, "GOLDEN NEW", "whether a bake is like its golden one, and in what it is not"},
    {&cli_regress, "DIR", "bakes of a folder's scenes against their golden ones"},
    {&cli_trade, "INPUT -o OUT.html", "error against time by every method, measured on a scene of yours"},
    {&cli_help, "[TOPIC]", "help of a command, or a page of the manual"},
};

static const cli_exit_row exits[] = {
    {CLI_OK, "done"},
    {CLI_UNLIKE, "a comparison did not hold"},
    {CLI_USAGE, "bad usage or bad input"},
    {CLI_FILE, "a file could not be read or written"},
    {CLI_LIMIT, "a limit (memory, size) would be passed"},
    {CLI_DEFECT, "a defect of vdbshade"},
    {CLI_INTERRUPTED, "interrupted"},
};

const char cli_summary[] = "Bakes soft shadows and ambient occlusion from signed distance fields.";

const char cli_errors[] = "Errors are one line on standard error; a failed or interrupted run leaves the old "
                          "output as it was.";

const cli_command_row *cli_command_get(size_t index) {
    return index < sizeof rows / sizeof rows[0] ? &rows[index] : NULL;
}

const cli_exit_row *cli_exit_get(size_t index) {
    return index < sizeof exits / sizeof exits[0] ? &exits[index] : NULL;
}

const cli_command *cli_command_find(const char *name) {
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        if (strcmp(name, row->command->name) == 0) {
            return row->command;
        }
    }
    return NULL;
}

void cli_print_commands(void) {
    enum { COLUMN = 28, WIDTH = 96 };
    printf("Usage: vdbshade COMMAND …\n\n%s\n\nCommands:\n", cli_summary);
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        const int used = printf("  %s %s", row->command->name, row->operands);
        printf("%*s%s\n", used < COLUMN ? COLUMN - used : 1, "", row->brief);
    }
    printf("\n"
           "  vdbshade COMMAND --help   options of a command\n"
           "  vdbshade help             pages of the manual too\n"
           "  vdbshade --version        version\n\n");
    cli_text text = {.out = stdout, .width = WIDTH};
    cli_text_add(&text, "Exit codes:");
    const cli_exit_row *exit;
    for (size_t i = 0; (exit = cli_exit_get(i)) != NULL; ++i) {
        char line[96];
        snprintf(line, sizeof line, " %d %s%s", exit->code, exit->meaning,
                 cli_exit_get(i + 1) != NULL ? ";" : ".");
        cli_text_add(&text, line);
    }
    cli_text_add(&text, " ");
    cli_text_add(&text, cli_errors);
    cli_text_end(&text);
}
