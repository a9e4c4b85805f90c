/* The table of subcommands, the help of the whole program, and the command `help`. */
#include "commands.h"

#include "message.h"
#include "paths.h"
#include "temporary.h"

#include <string.h>
#include <strings.h>

const cli_command_row cli_commands[] = {
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
    {NULL, NULL, NULL},
};

const cli_exit_row cli_exits[] = {
    {CLI_OK, "done"},
    {CLI_UNLIKE, "a comparison did not hold"},
    {CLI_USAGE, "bad usage or bad input"},
    {CLI_FILE, "a file could not be read or written"},
    {CLI_LIMIT, "a limit (memory, size) would be passed"},
    {CLI_DEFECT, "a defect of vdbshade"},
    {CLI_INTERRUPTED, "interrupted"},
    {0, NULL},
};

const char cli_summary[] = "Bakes soft shadows and ambient occlusion from signed distance fields.";

const char cli_errors[] = "Errors are one line on standard error; a failed or interrupted run leaves the old "
                          "output as it was.";

const cli_command_row *cli_find_command(const char *name) {
    for (const cli_command_row *row = cli_commands; row->command != NULL; ++row) {
        if (strcmp(name, row->command->name) == 0) {
            return row;
        }
    }
    return NULL;
}

void cli_print_commands(void) {
    enum { COLUMN = 28, WIDTH = 96 };
    printf("Usage: vdbshade COMMAND …\n\n%s\n\nCommands:\n", cli_summary);
    for (const cli_command_row *row = cli_commands; row->command != NULL; ++row) {
        const int used = printf("  %s %s", row->command->name, row->operands);
        printf("%*s%s\n", used < COLUMN ? COLUMN - used : 1, "", row->brief);
    }
    printf("\n"
           "  vdbshade COMMAND --help   options of a command\n"
           "  vdbshade help             pages of the manual too\n"
           "  vdbshade --version        version\n\n");
    cli_text text = {.out = stdout, .width = WIDTH};
    cli_text_add(&text, "Exit codes:");
    for (const cli_exit_row *exit = cli_exits; exit->meaning != NULL; ++exit) {
        char line[96];
        snprintf(line, sizeof line, " %d %s%s", exit->code, exit->meaning,
                 exit[1].meaning != NULL ? ";" : ".");
        cli_text_add(&text, line);
    }
    cli_text_add(&text, cli_errors);
    cli_text_end(&text);
}

/* --- the command `help` */

typedef struct help_settings {
    const char *folder; /* NULL: not asked for */
    bool man;
} help_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "What is printed"},
    {CLI_FLAG(help_settings, man), "man", NULL, "the man page of the command, or of vdbshade"},
    {CLI_TEXT(help_settings, folder), "write", "FOLDER",
     "write all man pages there, as packages install them"},
    {'h', "help", NULL, "show this help"},
};

static int help_main(int argc, char **argv);

const cli_command cli_help = {
    "help",
    "[TOPIC] [options]",
    "Prints the help of a command, or a page of the manual (docs/*.md): 'vdbshade help scene'. A page\n"
    "that has a command's name is printed by 'vdbshade help docs/query.md'. Without TOPIC it lists both.",
    options,
    sizeof options / sizeof options[0],
    help_main};

/* Finds "scene", "scene.md" or "docs/scene.md", in any case. */
static const cli_page *find_page(const char *topic) {
    const char *name = strncmp(topic, "docs/", 5) == 0 ? topic + 5 : topic;
    const size_t length = strlen(name) - (cli_has_ending(name, "md") ? 3 : 0);
    for (const cli_page *page = cli_pages; page->name != NULL; ++page) {
        if (strlen(page->name) == length && strncasecmp(page->name, name, length) == 0) {
            return page;
        }
    }
    return NULL;
}

static void list_topics(void) {
    cli_print_commands();
    printf("\nPages of the manual, 'vdbshade help TOPIC':\n");
    for (const cli_page *page = cli_pages; page->name != NULL; ++page) {
        const bool hidden = cli_find_command(page->name) != NULL;
        const char *text = (const char *)page->bytes; /* begins with its title, "# Scene files" */
        const char *end = memchr(text, '\n', page->size);
        const int length = end != NULL && text[0] == '#' ? (int)(end - text) - 2 : 0;
        printf("  %s%-*s %.*s\n", hidden ? "docs/" : "", hidden ? 12 : 17, page->name, length, text + 2);
    }
}

const char *cli_nearest_topic(const char *text, bool has_pages) {
    enum { MOST = 128 };
    const char *names[MOST];
    size_t count = 0;
    for (const cli_command_row *row = cli_commands; row->command != NULL; ++row) {
        names[count++] = row->command->name;
    }
    for (const cli_page *page = cli_pages; has_pages && count < MOST && page->name != NULL; ++page) {
        names[count++] = page->name;
    }
    return cli_nearest(text, names, count);
}

static int unknown_topic(const char *topic) {
    const char *near = cli_nearest_topic(topic, true);
    if (near != NULL) {
        return cli_usage("help: %s: no such topic; did you mean %s?", topic, near);
    }
    return cli_usage("help: %s: no such topic; 'vdbshade help' lists them", topic);
}

static int print_topic(const char *topic, bool man) {
    const cli_command_row *row = cli_find_command(topic);
    const cli_page *page = find_page(topic);
    if (row == NULL && page == NULL) {
        return unknown_topic(topic);
    }
    if (row != NULL && man) {
        cli_write_man(stdout, row);
    } else if (row != NULL) {
        cli_print_help(row->command);
        if (page != NULL) {
            printf("\nThe manual's page: vdbshade help docs/%s.md\n", topic);
        }
    } else if (man) {
        return cli_usage("--man: %s is no command", topic);
    } else {
        fwrite(page->bytes, 1, page->size, stdout);
    }
    return CLI_OK;
}

/* Writes the man page of a command, or for NULL of the program. */
static int write_page(const char *folder, const cli_command_row *row) {
    char path[4096];
    if (snprintf(path, sizeof path, "%s/share/man/man1/vdbshade%s%s.1", folder, row != NULL ? "-" : "",
                 row != NULL ? row->command->name : "") >= (int)sizeof path) {
        return cli_usage("--write '%s': the name is too long", folder);
    }
    CLI_TRY(cli_make_folder_of(path));
    cli_temporary page;
    CLI_TRY(cli_temporary_begin(&page, path));
    cli_write_man(page.file, row);
    return cli_temporary_commit(&page);
}

static int write_pages(const char *folder) {
    CLI_TRY(write_page(folder, NULL));
    for (const cli_command_row *row = cli_commands; row->command != NULL; ++row) {
        CLI_TRY(write_page(folder, row));
    }
    return CLI_OK;
}

static int help_main(int argc, char **argv) {
    help_settings s = {.folder = NULL};
    const char *topic;
    CLI_TRY(cli_parse(&cli_help, argc, argv, NULL, &s, &topic));
    if (s.folder != NULL) {
        return topic == NULL && !s.man
                   ? write_pages(s.folder)
                   : cli_usage("help: one of TOPIC, --man and --write is taken, or TOPIC with --man");
    }
    if (topic != NULL) {
        return print_topic(topic, s.man);
    }
    if (s.man) {
        cli_write_man(stdout, NULL);
    } else {
        list_topics();
    }
    return CLI_OK;
}
