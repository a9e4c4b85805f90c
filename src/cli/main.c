/* vdbshade: the table of commands, their help, the command `help`, and main(). */
#include "cli.h"

#include <errno.h>
#include <strings.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

static const cli_command *const commands[] = {
    &cli_bake, &cli_merge, &cli_unwrap,  &cli_voxelize, &cli_info,  &cli_volume, &cli_query, &cli_render,
    &cli_view, &cli_flat,  &cli_compare, &cli_regress,  &cli_trade, &cli_help,   NULL};

static const struct {
    int code;
    const char *meaning;
} exits[] = {
    {CLI_OK, "success"},
    {CLI_UNLIKE, "a comparison failed"},
    {CLI_USAGE, "wrong usage or input"},
    {CLI_FILE, "a file could not be read or written"},
    {CLI_LIMIT, "a limit (memory, size) would be exceeded"},
    {CLI_DEFECT, "a defect of vdbshade"},
    {CLI_INTERRUPTED, "interrupted"},
};

static const char summary[] = "Bakes soft shadows and ambient occlusion from signed distance fields.";

static const char errors[] =
    "Errors are one line on standard error; a failed or interrupted run leaves the old output as it was.";

static const cli_command *find_command(const char *name) {
    size_t i = 0;
    while (commands[i] != NULL && strcmp(name, commands[i]->name) != 0) {
        ++i;
    }
    return commands[i];
}

/* --- running text, broken into lines at blanks */

typedef struct text {
    int width;  /* characters of a line, if words are not longer */
    int lead;   /* blanks before the first line */
    int indent; /* blanks before each later line */
    int column; /* 0 to begin with */
} text;

/* Counts the characters of UTF-8 text. */
static int count_characters(const char *word, size_t length) {
    int count = 0;
    for (size_t i = 0; i < length; ++i) {
        count += ((unsigned char)word[i] & 0xc0) != 0x80;
    }
    return count;
}

static void add_words(text *t, const char *words) {
    static const char blanks[] = " \n";
    for (words += strspn(words, blanks); *words != '\0'; words += strspn(words, blanks)) {
        const size_t length = strcspn(words, blanks);
        const int wide = count_characters(words, length);
        if (t->column > 0 && t->column + 1 + wide > t->width) {
            putchar('\n');
            t->column = 0;
        }
        const bool first = t->column == 0;
        if (first) {
            printf("%*s", t->lead, "");
            t->lead = t->indent;
        } else {
            putchar(' ');
        }
        fwrite(words, 1, length, stdout);
        t->column += wide + !first;
        words += length;
    }
}

/* Writes words as lines. */
static void write_text(text t, const char *words) {
    add_words(&t, words);
    putchar('\n');
}

/* --- help on standard output */

enum { HELP_COLUMN = 30, HELP_WIDTH = 56, PAGE_WIDTH = 96 };

static void print_option(const cli_option *option) {
    char left[128];
    const char letter = cli_letter_of(option->name);
    int used = letter != '\0' ? snprintf(left, sizeof left, "  -%c, --%s", letter, option->name)
                              : snprintf(left, sizeof left, "      --%s", option->name);
    if (option->value != NULL) {
        used += snprintf(left + used, sizeof left - (size_t)used, " %s", option->value);
    }
    fputs(left, stdout);
    int columns = count_characters(left, (size_t)used);
    if (columns >= HELP_COLUMN) {
        putchar('\n');
        columns = 0;
    }
    const text t = {.width = HELP_WIDTH, .lead = HELP_COLUMN - columns, .indent = HELP_COLUMN};
    write_text(t, option->help);
}

void cli_print_help(const cli_command *command) {
    cli_option list[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, list);
    printf("Usage: vdbshade %s %s\n\n%s\n", command->name, command->usage, command->summary);
    for (size_t i = 0; i < count; ++i) {
        if (list[i].kind == CLI_KIND_HEADING) {
            printf("\n%s:\n", list[i].help);
        } else {
            print_option(&list[i]);
        }
    }
}

static void print_commands(void) {
    printf("Usage: vdbshade COMMAND …\n\n%s\n\nCommands:\n", summary);
    for (size_t i = 0; commands[i] != NULL; ++i) {
        printf("  %-10s %s\n", commands[i]->name, commands[i]->brief);
    }
    printf("\n"
           "  vdbshade COMMAND --help   options of a command\n"
           "  vdbshade help             pages of the manual too\n"
           "  vdbshade --version        version\n\n");
    text t = {.width = PAGE_WIDTH};
    add_words(&t, "Exit codes:");
    for (size_t i = 0; i < CLI_COUNT(exits); ++i) {
        char line[96];
        snprintf(line, sizeof line, " %d %s%s", exits[i].code, exits[i].meaning,
                 i + 1 < CLI_COUNT(exits) ? ";" : ".");
        add_words(&t, line);
    }
    write_text(t, errors);
}

/* --- the command `help` */

static const cli_option options[] = {{.help = "Options"}, CLI_HELP_OPTION};

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
    print_commands();
    printf("\nPages of the manual, 'vdbshade help TOPIC':\n");
    for (const cli_page *page = cli_pages; page->name != NULL; ++page) {
        const bool hidden = find_command(page->name) != NULL;
        const char *title = (const char *)page->bytes; /* "# Scene files" */
        const char *end = memchr(title, '\n', page->size);
        const int length = end != NULL && title[0] == '#' ? (int)(end - title) - 2 : 0;
        printf("  %s%-*s %.*s\n", hidden ? "docs/" : "", hidden ? 12 : 17, page->name, length, title + 2);
    }
}

/* Returns the command, or also the page, whose name is nearest to `topic`; NULL if none is near. */
static const char *find_nearest(const char *topic, bool has_pages) {
    enum { MOST = 128 };
    const char *names[MOST];
    size_t count = 0;
    for (size_t i = 0; commands[i] != NULL; ++i) {
        names[count++] = commands[i]->name;
    }
    for (const cli_page *page = cli_pages; has_pages && count < MOST && page->name != NULL; ++page) {
        names[count++] = page->name;
    }
    return cli_nearest(topic, names, count);
}

static int print_topic(const char *topic) {
    const cli_command *command = find_command(topic);
    const cli_page *page = find_page(topic);
    if (command == NULL && page == NULL) {
        const char *near = find_nearest(topic, true);
        CLI_REFUSE_IF(near != NULL, "help: %s: no such topic; did you mean %s?", topic, near);
        return cli_usage("help: %s: no such topic; 'vdbshade help' lists them", topic);
    }
    if (command != NULL) {
        cli_print_help(command);
        if (page != NULL) {
            printf("\nThe manual's page: vdbshade help docs/%s.md\n", topic);
        }
    } else {
        fwrite(page->bytes, 1, page->size, stdout);
    }
    return CLI_OK;
}

static int help_main(int argc, char **argv) {
    const char *topic;
    CLI_TRY(cli_parse(&cli_help, argc, argv, NULL, &topic));
    if (topic != NULL) {
        return print_topic(topic);
    }
    list_topics();
    return CLI_OK;
}

const cli_command cli_help = {
    "help", "[TOPIC] [options]", "help of a command, or a page of the manual",
    "Prints the help of a command, or a page of the manual (docs/*.md): 'vdbshade help scene'. A page\n"
    "that has a command's name is printed by 'vdbshade help docs/query.md'. Without TOPIC it lists both.",
    CLI_ENDING(options, help_main)};

/* --- the program */

static int run_command(int argc, char **argv) {
    CLI_REFUSE_IF(argc < 2, "no command; see 'vdbshade --help'");
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        print_commands();
        return CLI_OK;
    }
    if (strcmp(argv[1], "--version") == 0 || strcmp(argv[1], "-V") == 0) {
        printf("vdbshade %s\n", vsh_version());
        return CLI_OK;
    }
    const cli_command *command = find_command(argv[1]);
    const char *near = command == NULL && argv[1][0] != '-' ? find_nearest(argv[1], false) : NULL;
    CLI_REFUSE_IF(near != NULL, "%s: no such command; did you mean %s?", argv[1], near);
    CLI_REFUSE_IF(command == NULL, "%s: no such %s; see 'vdbshade --help'", argv[1],
                  argv[1][0] == '-' ? "option" : "command");
    if (command != &cli_query) { /* `query` may write binary points there */
        cli_plain_output();
    }
    return command->main(argc - 1, argv + 1);
}

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#endif

/* Landlock keeps a reader, which a damaged file may control, from the memory and environment of other
 * processes. Without Landlock this process closes its own. That stops debuggers and core files too, so it is
 * the exception. */
static void close_own_memory(void) {
    enum { ASK_VERSION = 1 };
    if (!VSHI_SANITIZED && syscall(SYS_landlock_create_ruleset, NULL, 0, ASK_VERSION) < 1) {
        prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
    }
}

int main(int argc, char **argv) {
    const int served = vsh_reader_serve(argc, argv);
    if (served >= 0) {
        _exit(served); /* without freeing memory */
    }
    close_own_memory();
    cli_signals_begin();
    int code = run_command(argc, argv);
    code = code == CLI_HELP ? CLI_OK : code;
    cli_end_progress();
    cli_print_warnings();
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == CLI_OK) {
        code = cli_refuse(CLI_FILE, "standard output: cannot be written: %s", strerror(errno));
    }
    return code;
}
