/* vdbshade help: help of commands, pages of the manual, and what packages install of both. */
#include "help.h"

#include "cli/document.h"
#include "cli/message.h"
#include "cli/paths.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { KEY_MAN = 0x2000, KEY_COMPLETION, KEY_WRITE };

static const cli_option options[] = {
    {0, NULL, NULL, "What is printed"},
    {KEY_MAN, "man", NULL, "the man page of the command, or of vdbshade"},
    {KEY_COMPLETION, "completion", "bash|zsh|fish",
     "what that shell completes command lines by; for bash:\nsource <(vdbshade help --completion bash)"},
    {KEY_WRITE, "write", "FOLDER", "write all of these there, as packages install them"},
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

typedef struct help_settings {
    const char *shell, *folder; /* NULL: not asked for */
    bool man;
} help_settings;

/* What a shell's completions are, and where packages install them. */
static const struct {
    const char *shell, *path;
    void (*write)(FILE *out);
} completions[] = {
    {"bash", "share/bash-completion/completions/vdbshade", cli_write_bash},
    {"zsh", "share/zsh/site-functions/_vdbshade", cli_write_zsh},
    {"fish", "share/fish/vendor_completions.d/vdbshade.fish", cli_write_fish},
};
enum { SHELL_COUNT = sizeof completions / sizeof completions[0] };

static int take(void *settings, int key, const char *name, const char *value) {
    help_settings *s = settings;
    switch (key) {
    case KEY_MAN:
        s->man = true;
        return CLI_OK;
    case KEY_WRITE:
        s->folder = value;
        return CLI_OK;
    default:
        s->shell = value;
        for (size_t i = 0; i < SHELL_COUNT; ++i) {
            if (strcmp(value, completions[i].shell) == 0) {
                return CLI_OK;
            }
        }
        return cli_usage("%s '%s': expected one of bash, zsh, fish", name, value);
    }
}

/* --- pages */

/* "scene", "scene.md", "docs/scene.md", in any case. */
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

/* Its heading, "# Scene files": where the words begin, and how many bytes they are. */
static const char *page_title(const cli_page *page, int *length) {
    const char *text = (const char *)page->bytes;
    const size_t marks = page->size > 2 && text[0] == '#' ? 2 : 0;
    const char *end = memchr(text, '\n', page->size);
    *length = (int)((end != NULL ? (size_t)(end - text) : page->size) - marks);
    return text + marks;
}

static void list_topics(void) {
    cli_print_commands();
    printf("\nPages of the manual, 'vdbshade help TOPIC':\n");
    for (const cli_page *page = cli_pages; page->name != NULL; ++page) {
        int length;
        const char *title = page_title(page, &length);
        printf("  %s%-*s %.*s\n", cli_command_find(page->name) != NULL ? "docs/" : "",
               cli_command_find(page->name) != NULL ? 12 : 17, page->name, length, title);
    }
}

static int unknown_topic(const char *topic) {
    enum { MOST = 128 };
    const char *names[MOST];
    size_t count = 0;
    const cli_command_row *row;
    for (size_t i = 0; count < MOST && (row = cli_command_get(i)) != NULL; ++i) {
        names[count++] = row->command->name;
    }
    for (const cli_page *page = cli_pages; count < MOST && page->name != NULL; ++page) {
        names[count++] = page->name;
    }
    const char *near = cli_nearest(topic, names, count);
    if (near != NULL) {
        return cli_usage("help: %s: no such topic; did you mean %s?", topic, near);
    }
    return cli_usage("help: %s: no such topic; 'vdbshade help' lists them", topic);
}

/* --- files */

static void compose_man(FILE *out, const void *user) {
    cli_write_man(out, user);
}

static void compose_completion(FILE *out, const void *user) {
    completions[*(const size_t *)user].write(out);
}

static int write_file(const char *folder, const char *path, void (*compose)(FILE *out, const void *user),
                      const void *user) {
    char whole[4096];
    if (snprintf(whole, sizeof whole, "%s/%s", folder, path) >= (int)sizeof whole) {
        return cli_usage("--write '%s': the name is too long", folder);
    }
    CLI_TRY(cli_make_folder_of(whole));
    return cli_document_write(whole, compose, user);
}

static int write_all(const char *folder) {
    const cli_command_row *row;
    int code = write_file(folder, "share/man/man1/vdbshade.1", compose_man, NULL);
    for (size_t i = 0; code == CLI_OK && (row = cli_command_get(i)) != NULL; ++i) {
        char path[96];
        snprintf(path, sizeof path, "share/man/man1/vdbshade-%s.1", row->command->name);
        code = write_file(folder, path, compose_man, row);
    }
    for (size_t i = 0; code == CLI_OK && i < SHELL_COUNT; ++i) {
        code = write_file(folder, completions[i].path, compose_completion, &i);
    }
    return code;
}

/* --- the command */

static int print_completion(const char *shell) {
    for (size_t i = 0; i < SHELL_COUNT; ++i) {
        if (strcmp(shell, completions[i].shell) == 0) {
            completions[i].write(stdout);
        }
    }
    return CLI_OK;
}

static int print_topic(const char *topic, bool man) {
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        if (strcmp(topic, row->command->name) != 0) {
            continue;
        }
        if (man) {
            cli_write_man(stdout, row);
            return CLI_OK;
        }
        cli_print_help(row->command);
        if (find_page(topic) != NULL) {
            printf("\nThe manual's page: vdbshade help docs/%s.md\n", topic);
        }
        return CLI_OK;
    }
    const cli_page *page = find_page(topic);
    if (page == NULL) {
        return unknown_topic(topic);
    }
    if (man) {
        return cli_usage("--man: %s is no command", topic);
    }
    fwrite(page->bytes, 1, page->size, stdout);
    return CLI_OK;
}

static int help_main(int argc, char **argv) {
    help_settings s = {.shell = NULL};
    const char *topic;
    CLI_TRY(cli_parse(&cli_help, argc, argv, take, &s, &topic));
    if (s.man + (s.shell != NULL) + (s.folder != NULL) > 1 ||
        (topic != NULL && (s.shell != NULL || s.folder != NULL))) {
        return cli_usage("help: one of TOPIC, --man, --completion and --write is taken, or TOPIC with --man");
    }
    if (s.folder != NULL) {
        return write_all(s.folder);
    }
    if (s.shell != NULL) {
        return print_completion(s.shell);
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
