/* The parser of command lines, and their help. */
#include "options.h"

#include "base/suggest.h"
#include "message.h"
#include "paths.h"
#include "progress.h"
#include "warnings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>
#include <vdbshade/reader.h>

enum { HELP_COLUMN = 30, HELP_WIDTH = 56 };

/* --- settings of the library */

typedef struct setting_text {
    vsh_setting setting;
    char help[sizeof(vsh_setting)];
} setting_text;

static setting_text listed[CLI_MOST_SETTINGS]; /* read once */
static size_t listed_count;

static void tell_help(const vsh_setting *s, char *help, size_t size) {
    const bool counts = strchr("0123456789ma", s->range[0]) != NULL && strchr(s->range, ',') == NULL;
    const bool plain = s->range[0] == '\0', always = s->otherwise[0] == '\0';
    snprintf(help, size, "%s%s%s%s%s%s", s->help,
             plain    ? ""
             : counts ? ", "
                      : ": ",
             s->range, always ? "" : " (", s->otherwise, always ? "" : ")");
}

const vsh_setting *cli_setting(size_t index) {
    vsh_setting setting;
    while (listed_count < CLI_MOST_SETTINGS && vsh_setting_get(listed_count, &setting) != 0) {
        setting_text *text = &listed[listed_count++];
        text->setting = setting;
        tell_help(&setting, text->help, sizeof text->help);
    }
    return index < listed_count ? &listed[index].setting : NULL;
}

/* The setting that a row stands for by its group or, where it has one, by its option's name; from *at on. */
static const vsh_setting *next_setting(const cli_option *row, size_t *at) {
    const vsh_setting *setting;
    while ((setting = cli_setting(*at)) != NULL) {
        ++*at;
        if (row->name != NULL ? strcmp(setting->option, row->name) == 0
                              : setting->group == row->key - CLI_KEY_SETTINGS) {
            return setting;
        }
    }
    return NULL;
}

size_t cli_list_options(const cli_command *command, cli_option *options, size_t most) {
    size_t count = 0;
    for (size_t i = 0; i < command->option_count && count < most; ++i) {
        const cli_option *option = &command->options[i];
        if (option->key < CLI_KEY_SETTINGS || option->key >= CLI_STORE_TEXT) {
            options[count] = *option;
            if (option->name != NULL && strcmp(option->name, "output") == 0) {
                options[count].key = 'o';
            }
            ++count;
            continue;
        }
        const vsh_setting *setting;
        for (size_t at = 0; count < most && (setting = next_setting(option, &at)) != NULL;) {
            const char *value = setting->value[0] != '\0' ? setting->value : NULL;
            options[count++] =
                (cli_option){CLI_KEY_SETTING + (int)at - 1, setting->option, value, listed[at - 1].help};
            if (option->name != NULL) {
                break; /* others may have the name, too */
            }
        }
    }
    return count;
}

bool cli_find_option(const cli_command *command, const char *word, cli_option *option) {
    cli_option list[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, list, CLI_MOST_OPTIONS);
    const size_t length = word[1] == '-' ? strcspn(word + 2, "=") : 0;
    for (size_t i = 0; i < count; ++i) {
        const bool named = length > 0 && list[i].key != 0 && strlen(list[i].name) == length &&
                           strncmp(list[i].name, word + 2, length) == 0;
        if (named || (length == 0 && list[i].key == word[1])) {
            *option = list[i];
            return true;
        }
    }
    return false;
}

/* --- words that are none */

const char *cli_nearest(const char *text, const char *const *candidates, size_t count) {
    const char *nearest = NULL;
    const size_t length = strlen(text);
    size_t best = 1 + (length > 6 ? length / 3 : 2);
    for (size_t i = 0; i < count; ++i) {
        const size_t distance = vshi_edit_distance(text, candidates[i]);
        if (distance < best) {
            best = distance;
            nearest = candidates[i];
        }
    }
    return nearest;
}

enum { MOST_OPERANDS = 2 };

/* A command line that is being parsed. */
typedef struct parsing {
    const cli_command *command;
    int argc;
    char **argv;
    const char *operands[MOST_OPERANDS + 1]; /* the first ones */
    int operand_count;
    FILE *told; /* the command line as outputs tell it */
} parsing;

static int unknown_option(const parsing *p, const char *text) {
    cli_option list[CLI_MOST_OPTIONS];
    const size_t rows = cli_list_options(p->command, list, CLI_MOST_OPTIONS);
    const char *names[CLI_MOST_OPTIONS];
    size_t count = 0;
    for (size_t i = 0; i < rows; ++i) {
        if (list[i].key != 0) {
            names[count++] = list[i].name;
        }
    }
    char word[64];
    snprintf(word, sizeof word, "%s", text + strspn(text, "-"));
    word[strcspn(word, "=")] = '\0';
    const char *near = cli_nearest(word, names, count);
    if (near != NULL) {
        return cli_usage("%s: no such option; did you mean --%s?", text, near);
    }
    return cli_usage("%s: no such option; see 'vdbshade %s --help'", text, p->command->name);
}

/* --- the command line as outputs tell it */

static char *parsed_command; /* of the process's one command line at a time */
static const char *parsed_grid;

const char *cli_parsed_grid(void) {
    return parsed_grid;
}

const char *cli_parsed_command(void) {
    return parsed_command != NULL ? parsed_command : "";
}

/* Writes a word behind a blank, quoted as a shell would have it. */
static void tell_word(FILE *told, const char *word) {
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%";
    if (word[0] != '\0' && strspn(word, plain) == strlen(word)) {
        fprintf(told, " %s", word);
        return;
    }
    fputs(" '", told);
    for (const char *c = word; *c != '\0'; ++c) {
        fprintf(told, "%s%c", *c == '\'' ? "'\\'" : "", *c);
    }
    fputc('\'', told);
}

static void tell_option(FILE *told, const cli_option *option, const char *value) {
    static const char *const changes_nothing[] = {
        "output",  "output-folder", "stats", "threads", "memory-limit", "sandbox", "allow-outside", "quiet",
        "verbose", "progress",      "json",  "dry-run", "help",         "view",    "shard"};
    for (size_t i = 0; i < sizeof changes_nothing / sizeof changes_nothing[0]; ++i) {
        if (strcmp(option->name, changes_nothing[i]) == 0) {
            return;
        }
    }
    fprintf(told, " --%s", option->name);
    if (value != NULL) {
        tell_word(told, strncmp(option->value, "FILE", 4) == 0 ? cli_file_name(value) : value);
    }
}

/* --- parsing */

cli_common cli_given;

/* The machine's memory, or where they are less the control group's (a container) and what the process may
 * address (ulimit -v). 0: not known. */
static uint64_t machine_memory(void) {
    const long pages = sysconf(_SC_PHYS_PAGES);
    const long page = sysconf(_SC_PAGESIZE);
    uint64_t bytes = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : 0;
    static const char *const limits[] = {"/sys/fs/cgroup/memory.max",
                                         "/sys/fs/cgroup/memory/memory.limit_in_bytes"};
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; ++i) {
        FILE *file = fopen(limits[i], "r");
        unsigned long long limit = 0;
        if (file != NULL) {
            if (fscanf(file, "%llu", &limit) == 1 && limit > 0 && (bytes == 0 || limit < bytes)) {
                bytes = limit;
            }
            fclose(file);
        }
    }
    struct rlimit space;
    if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY &&
        (bytes == 0 || space.rlim_cur < bytes)) {
        bytes = space.rlim_cur;
    }
    return bytes;
}

vsh_run cli_make_run(void) {
    vsh_run run = vsh_run_default();
    run.threads = cli_given.threads;
    run.memory_limit = cli_given.memory_limit;
    run.reader = strcmp(cli_given.sandbox, "off") == 0 ? NULL : VSH_READER;
    run.confined = strcmp(cli_given.sandbox, "require") == 0;
    run.allow_outside = cli_given.allow_outside;
    run.progress = cli_progress_report;
    run.warning = cli_warnings_parse;
    run.notes = cli_given.verbose;
    cli_warnings_begin(cli_given.verbose, cli_given.quiet);
    return run;
}

static int parse_sandbox(const char *name, const char *value) {
    if (strcmp(value, "auto") != 0 && strcmp(value, "require") != 0 && strcmp(value, "off") != 0) {
        return cli_usage("%s '%s': expected auto, require or off", name, value);
    }
    cli_given.sandbox = value;
    return CLI_OK;
}

/* Stores the value of an option whose key is a place in the settings. */
static int store(void *settings, int key, const char *name, const char *value) {
    char *member = (char *)settings + key % CLI_STORE_TEXT;
    const bool flag = true;
    double number;
    switch (key - key % CLI_STORE_TEXT) {
    case CLI_STORE_TEXT:
        memcpy(member, &value, sizeof value);
        return CLI_OK;
    case CLI_STORE_FLAG:
        memcpy(member, &flag, sizeof flag);
        return CLI_OK;
    default:
        CLI_TRY(cli_parse_positive(name, value, &number));
        memcpy(member, &number, sizeof number);
        return CLI_OK;
    }
}

/* The place in the settings that the command's table gives for the output; else 'o'. */
static int find_output(const cli_command *command) {
    for (size_t i = 0; i < command->option_count; ++i) {
        if (command->options[i].name != NULL && strcmp(command->options[i].name, "output") == 0) {
            return command->options[i].key;
        }
    }
    return 'o';
}

static int parse_option(cli_option_fn *take, void *settings, int key, const char *name, const char *value) {
    switch (key) {
    case CLI_KEY_THREADS:
        return cli_parse_integer(name, value, 1, 1024, &cli_given.threads);
    case CLI_KEY_MEMORY_LIMIT:
        return cli_parse_bytes(name, value, &cli_given.memory_limit);
    case CLI_KEY_SANDBOX:
        return parse_sandbox(name, value);
    case CLI_KEY_ALLOW_OUTSIDE:
        cli_given.allow_outside = true;
        return CLI_OK;
    case CLI_KEY_QUIET:
        cli_given.quiet = true;
        return CLI_OK;
    case CLI_KEY_VERBOSE:
        cli_given.verbose = true;
        return CLI_OK;
    case CLI_KEY_PROGRESS:
        cli_given.progress = true;
        return CLI_OK;
    default:
        return key >= CLI_STORE_TEXT ? store(settings, key, name, value) : take(settings, key, name, value);
    }
}

/* Parses an option with the value that its word gives, or (NULL) that the next word is, and moves *at there.
 */
static int parse_value(const parsing *p, cli_option_fn *take, void *settings, const cli_option *option,
                       const char *value, int *at) {
    char name[64];
    snprintf(name, sizeof name, "--%s", option->name);
    if (value != NULL && option->value == NULL) {
        return cli_usage("%s: takes no value", name);
    }
    if (value == NULL && option->value != NULL) {
        if (*at + 1 == p->argc) {
            return cli_usage("%s: needs a value", name);
        }
        value = p->argv[++*at];
    }
    if (option->key == 'h') {
        cli_print_help(p->command);
        return CLI_HELP;
    }
    tell_option(p->told, option, value);
    const int place = option->key == 'o' ? find_output(p->command) : option->key;
    return parse_option(take, settings, place, name, value);
}

/* Parses "-q", "-o", "-oVALUE" or "-qo". */
static int parse_letters(const parsing *p, cli_option_fn *take, void *settings, int *at) {
    cli_option option = {.value = NULL};
    for (const char *c = p->argv[*at] + 1; *c != '\0' && option.value == NULL; ++c) {
        const char letter[] = {'-', *c, '\0'};
        if (!cli_find_option(p->command, letter, &option)) {
            return unknown_option(p, letter);
        }
        const char *value = option.value != NULL && c[1] != '\0' ? c + 1 : NULL;
        CLI_TRY(parse_value(p, take, settings, &option, value, at));
    }
    return CLI_OK;
}

/* Parses all options, and lists the operands between them and after "--". */
static int parse_options(parsing *p, cli_option_fn *take, void *settings) {
    bool ended = false;
    for (int at = 1; at < p->argc; ++at) {
        const char *word = p->argv[at], *sign = strchr(word, '=');
        cli_option option;
        if (!ended && strcmp(word, "--") == 0) {
            ended = true;
        } else if (!ended && strncmp(word, "--", 2) == 0) {
            if (!cli_find_option(p->command, word, &option)) {
                return unknown_option(p, word);
            }
            CLI_TRY(parse_value(p, take, settings, &option, sign != NULL ? sign + 1 : NULL, &at));
        } else if (!ended && word[0] == '-' && word[1] != '\0') {
            CLI_TRY(parse_letters(p, take, settings, &at));
        } else if (p->operand_count <= MOST_OPERANDS) {
            p->operands[p->operand_count++] = word;
        }
    }
    return CLI_OK;
}

/* Takes the operands that the usage begins with: "INPUT [OTHER] -o OUT [options]". */
static int parse_operands(const parsing *p, const char **operands) {
    const char *command = p->command->name, *at = p->command->usage;
    char name[32] = "";
    bool optional = false;
    int count = 0;
    for (; *at != '\0' && *at != '-' && strncmp(at, "[options]", strlen("[options]")) != 0; ++count) {
        const size_t length = strcspn(at, " ");
        optional = *at == '[';
        snprintf(name, sizeof name, "%.*s", (int)length - 2 * optional, at + optional);
        operands[count] = count < p->operand_count ? p->operands[count] : NULL;
        if (operands[count] != NULL) {
            tell_word(p->told, cli_file_name(operands[count]));
        } else if (!optional) {
            return cli_usage("%s: no %s; see 'vdbshade %s --help'", command, name, command);
        }
        at += length + strspn(at + length, " ");
    }
    if (count < p->operand_count) {
        return cli_usage("%s: one %s is taken, not also '%s'", command, name, p->operands[count]);
    }
    parsed_grid = count == 1 && !optional ? cli_split_grid(&operands[0]) : NULL;
    cli_message_input(operands[0]);
    return CLI_OK;
}

int cli_parse(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
              const char **operands) {
    parsing p = {.command = command, .argc = argc, .argv = argv};
    cli_given = (cli_common){.memory_limit = machine_memory() / 4 * 3, .sandbox = "auto"};
    free(parsed_command);
    parsed_command = NULL;
    size_t size;
    p.told = open_memstream(&parsed_command, &size);
    fputs(command->name, p.told);
    int code = parse_options(&p, take, settings);
    code = code == CLI_OK ? parse_operands(&p, operands) : code;
    fclose(p.told);
    if (code == CLI_OK) {
        cli_progress_begin(cli_given.progress, cli_given.quiet);
    }
    return code;
}

static void print_option(const cli_option *option) {
    char left[128];
    int used = option->key < 256 ? snprintf(left, sizeof left, "  -%c, --%s", option->key, option->name)
                                 : snprintf(left, sizeof left, "      --%s", option->name);
    if (option->value != NULL) {
        used += snprintf(left + used, sizeof left - (size_t)used, " %s", option->value);
    }
    fputs(left, stdout);
    int columns = cli_text_characters(left, strlen(left));
    if (columns >= HELP_COLUMN) {
        putchar('\n');
        columns = 0;
    }
    cli_text text = {
        .out = stdout, .width = HELP_WIDTH, .lead = HELP_COLUMN - columns, .indent = HELP_COLUMN};
    cli_text_add(&text, option->help);
    cli_text_end(&text);
}

void cli_print_help(const cli_command *command) {
    cli_option list[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, list, CLI_MOST_OPTIONS);
    printf("Usage: vdbshade %s %s\n\n%s\n", command->name, command->usage, command->summary);
    for (size_t i = 0; i < count; ++i) {
        if (list[i].key == 0) {
            printf("\n%s:\n", list[i].help);
        } else {
            print_option(&list[i]);
        }
    }
}

int cli_density_take(cli_densities *densities, const char *name, const char *value) {
    const char *sign = strrchr(value, '='); /* names may have one, numbers have none */
    if (sign == NULL || sign == value) {
        return cli_usage("%s '%s': expected PATTERN=X", name, value);
    }
    if (densities->count == CLI_MOST_DENSITIES) {
        return cli_usage("%s: more than %d of them", name, CLI_MOST_DENSITIES);
    }
    vsh_density_rule *rule = &densities->list[densities->count];
    CLI_TRY(cli_parse_positive(name, sign + 1, &rule->factor));
    rule->pattern = cli_keep_text("%.*s", (int)(sign - value), value);
    ++densities->count;
    return CLI_OK;
}

int cli_provenance_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                        const vsh_occluders_info *casters, const vsh_run *run, cli_provenance *origin) {
    *origin = (cli_provenance){NULL, NULL, 0};
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = scene;
    source.command = cli_parsed_command();
    if (casters != NULL) {
        source.voxel_size = casters->voxel_size;
        source.has_triangles = casters->has_triangles;
    }
    source.files = files;
    source.file_count = file_count;
    vsh_error error;
    if (vsh_provenance_create(&source, run, &origin->made, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    origin->attributes = vsh_provenance_attributes(origin->made, &origin->count);
    return CLI_OK;
}

void cli_provenance_free(cli_provenance *origin) {
    vsh_provenance_free(origin->made);
    *origin = (cli_provenance){NULL, NULL, 0};
}
