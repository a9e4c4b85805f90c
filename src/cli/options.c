/* The parser of command lines and their help. */
#include "options.h"

#include "message.h"
#include "paths.h"
#include "text.h"

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static void read_settings(void) {
    vsh_setting setting;
    while (listed_count < CLI_MOST_SETTINGS && vsh_setting_get(listed_count, &setting) != 0) {
        setting_text *text = &listed[listed_count++];
        text->setting = setting;
        tell_help(&setting, text->help, sizeof text->help);
    }
}

const vsh_setting *cli_setting(size_t index) {
    read_settings();
    return index < listed_count ? &listed[index].setting : NULL;
}

/* A command's options, with settings in the place of their groups. */
typedef struct option_list {
    cli_option options[CLI_MOST_OPTIONS];
    size_t count;
} option_list;

static void add_option(option_list *list, const cli_option *option) {
    if (list->count < CLI_MOST_OPTIONS) {
        list->options[list->count++] = *option;
    }
}

static void list_options(const cli_command *command, option_list *list) {
    list->count = 0;
    for (size_t i = 0; i < command->option_count; ++i) {
        const cli_option *option = &command->options[i];
        if (option->key < CLI_KEY_SETTINGS) {
            add_option(list, option);
            continue;
        }
        const vsh_setting *setting;
        bool found = false; /* by a name that is another's too: the first */
        for (size_t k = 0; (setting = cli_setting(k)) != NULL && !found; ++k) {
            found = option->name != NULL && strcmp(setting->option, option->name) == 0;
            if (found || (option->name == NULL && setting->group == option->key - CLI_KEY_SETTINGS)) {
                add_option(list,
                           &(cli_option){CLI_KEY_SETTING + (int)k, setting->option,
                                         setting->value[0] != '\0' ? setting->value : NULL, listed[k].help});
            }
        }
    }
}

size_t cli_list_options(const cli_command *command, cli_option *options, size_t most) {
    option_list list;
    list_options(command, &list);
    const size_t count = list.count < most ? list.count : most;
    memcpy(options, list.options, count * sizeof *options);
    return count;
}

bool cli_find_option(const cli_command *command, const char *name, size_t length, cli_option *option) {
    option_list list;
    list_options(command, &list);
    for (size_t i = 0; i < list.count; ++i) {
        const cli_option *one = &list.options[i];
        if (one->key != 0 && strlen(one->name) == length && strncmp(one->name, name, length) == 0) {
            *option = *one;
            return true;
        }
    }
    return false;
}

/* --- words that are none */

static int least(int a, int b) {
    return a < b ? a : b;
}

/* Edit distance (V. Levenshtein, 1966), for words of up to 63 letters. */
static int edit_distance(const char *a, const char *b) {
    enum { LONGEST = 64 };
    const size_t b_length = strlen(b);
    if (strlen(a) >= LONGEST || b_length >= LONGEST) {
        return LONGEST;
    }
    int row[LONGEST];
    for (size_t j = 0; j <= b_length; ++j) {
        row[j] = (int)j;
    }
    for (size_t i = 1; a[i - 1] != '\0'; ++i) {
        int diagonal = row[0];
        row[0] = (int)i;
        for (size_t j = 1; j <= b_length; ++j) {
            const int above = row[j];
            row[j] = least(diagonal + (a[i - 1] != b[j - 1]), 1 + least(above, row[j - 1]));
            diagonal = above;
        }
    }
    return row[b_length];
}

const char *cli_nearest(const char *text, const char *const *candidates, size_t count) {
    const char *nearest = NULL;
    const int length = (int)strlen(text);
    int best = 1 + (length > 6 ? length / 3 : 2);
    for (size_t i = 0; i < count; ++i) {
        const int distance = edit_distance(text, candidates[i]);
        if (distance < best) {
            best = distance;
            nearest = candidates[i];
        }
    }
    return nearest;
}

static int unknown_option(const cli_command *command, const option_list *list, const char *text) {
    const char *names[CLI_MOST_OPTIONS];
    size_t count = 0;
    for (size_t i = 0; i < list->count; ++i) {
        if (list->options[i].key != 0) {
            names[count++] = list->options[i].name;
        }
    }
    char word[64];
    snprintf(word, sizeof word, "%s", text + strspn(text, "-"));
    word[strcspn(word, "=")] = '\0';
    const char *near = cli_nearest(word, names, count);
    if (near != NULL) {
        return cli_usage("%s: no such option; did you mean --%s?", text, near);
    }
    return cli_usage("%s: no such option; see 'vdbshade %s --help'", text, command->name);
}

static const cli_option *option_of_key(const option_list *list, int key) {
    for (size_t i = 0; i < list->count; ++i) {
        if (list->options[i].key == key) {
            return &list->options[i];
        }
    }
    return NULL;
}

static void make_getopt_tables(const option_list *list, struct option *longs, char *shorts) {
    size_t count = 0;
    *shorts++ = ':'; /* a missing value is told from an unknown option */
    for (size_t i = 0; i < list->count && count + 1 < CLI_MOST_OPTIONS; ++i) {
        const cli_option *option = &list->options[i];
        if (option->key == 0) {
            continue;
        }
        longs[count++] = (struct option){
            option->name, option->value != NULL ? required_argument : no_argument, NULL, option->key};
        if (option->key < 256) {
            *shorts++ = (char)option->key;
            if (option->value != NULL) {
                *shorts++ = ':';
            }
        }
    }
    *shorts = '\0';
    longs[count] = (struct option){NULL, 0, NULL, 0};
}

/* getopt_long() takes any beginning of a name; a script that relies on one would break at the next option.
 * The word it took is the last or, where the value stands by itself, the last but one. */
static bool abbreviated(const cli_option *option, char **argv, const char *value, const char **word) {
    *word = argv[optind - 1];
    if (value != NULL && value == argv[optind - 1]) {
        *word = argv[optind - 2];
    }
    if (strncmp(*word, "--", 2) != 0) {
        return false; /* a short option */
    }
    const size_t length = strcspn(*word + 2, "=");
    return length != strlen(option->name) || strncmp(*word + 2, option->name, length) != 0;
}

/* --- the command line as outputs tell it */

static char *parsed_command; /* of the process's one command line at a time */
static char *parsed_file;    /* FILE.vdb of an operand FILE.vdb:NAME */
static const char *parsed_grid;

const char *cli_parsed_grid(void) {
    return parsed_grid;
}

const char *cli_parsed_command(void) {
    return parsed_command != NULL ? parsed_command : "";
}

static void append(const char *text, size_t length) {
    const size_t used = strlen(cli_parsed_command());
    char *longer = realloc(parsed_command, used + length + 1);
    if (longer != NULL) {
        memcpy(longer + used, text, length);
        longer[used + length] = '\0';
        parsed_command = longer;
    }
}

/* A word behind a blank, quoted as a shell would have it. */
static void append_word(const char *word) {
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%";
    append(" ", 1);
    if (word[0] != '\0' && strspn(word, plain) == strlen(word)) {
        append(word, strlen(word));
        return;
    }
    append("'", 1);
    for (const char *c = word; *c != '\0'; ++c) {
        if (*c == '\'') {
            append("'\\''", 4);
        } else {
            append(c, 1);
        }
    }
    append("'", 1);
}

static const char *without_folder(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

static void append_option(const cli_option *option, const char *value) {
    static const char *const changes_nothing[] = {
        "output",  "output-folder", "stats", "threads", "memory-limit", "sandbox", "allow-outside", "quiet",
        "verbose", "progress",      "json",  "dry-run", "help",         "view",    "shard"};
    for (size_t i = 0; i < sizeof changes_nothing / sizeof changes_nothing[0]; ++i) {
        if (strcmp(option->name, changes_nothing[i]) == 0) {
            return;
        }
    }
    char name[64];
    snprintf(name, sizeof name, "--%s", option->name);
    append_word(name);
    if (value != NULL) {
        append_word(strncmp(option->value, "FILE", 4) == 0 ? without_folder(value) : value);
    }
}

int cli_parse(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
              const char *what, const char **operand, bool *help) {
    const int code = cli_parse_operands(command, argc, argv, take, settings, &what, operand, 1, help);
    parsed_grid = code == CLI_OK && !*help ? cli_grid_name(*operand) : NULL;
    if (parsed_grid != NULL) {
        free(parsed_file);
        parsed_file = strndup(*operand, (size_t)(parsed_grid - 1 - *operand));
        if (parsed_file == NULL) {
            return cli_out_of_memory("file name");
        }
        *operand = parsed_file;
        cli_message_input(parsed_file);
    }
    return code;
}

int cli_parse_operands(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
                       const char *const *what, const char **operands, int count, bool *help) {
    return cli_parse_some(command, argc, argv, take, settings, what, operands, count, count, help);
}

int cli_parse_some(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
                   const char *const *what, const char **operands, int least, int count, bool *help) {
    struct option longs[CLI_MOST_OPTIONS];
    char shorts[2 * CLI_MOST_OPTIONS + 2];
    option_list list;
    list_options(command, &list);
    make_getopt_tables(&list, longs, shorts);
    *help = false;
    opterr = 0;
    optind = 1;
    free(parsed_command);
    parsed_command = NULL;
    append(command->name, strlen(command->name));
    int key;
    while ((key = getopt_long(argc, argv, shorts, longs, NULL)) != -1) {
        if (key == ':') {
            return cli_usage("%s: needs a value", argv[optind - 1]);
        }
        if (key == '?') {
            const cli_option *known = optopt != 0 ? option_of_key(&list, optopt) : NULL;
            if (known != NULL && known->value == NULL) {
                return cli_usage("--%s: takes no value", known->name);
            }
            char letter[3] = {'-', (char)optopt, '\0'};
            return unknown_option(command, &list, optopt > 0 && optopt < 256 ? letter : argv[optind - 1]);
        }
        if (key == 'h') {
            *help = true;
            cli_print_help(command);
            return CLI_OK;
        }
        const cli_option *option = option_of_key(&list, key);
        const char *word;
        if (abbreviated(option, argv, optarg, &word)) {
            return unknown_option(command, &list, word);
        }
        char name[64];
        snprintf(name, sizeof name, "--%s", option->name);
        append_option(option, optarg);
        const int code = take(settings, key, key < 256 ? word : name, optarg);
        if (code != CLI_OK) {
            return code;
        }
    }
    for (int i = 0; i < count; ++i) {
        operands[i] = NULL;
        if (optind + i >= argc && i >= least) {
            continue;
        }
        if (optind + i >= argc) {
            return cli_usage("%s: no %s; see 'vdbshade %s --help'", command->name, what[i], command->name);
        }
        operands[i] = argv[optind + i];
        append_word(without_folder(operands[i]));
    }
    cli_message_input(operands[0]);
    if (optind + count < argc) {
        return cli_usage("%s: one %s is taken, not also '%s'", command->name, what[count - 1],
                         argv[optind + count]);
    }
    return CLI_OK;
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
    option_list list;
    list_options(command, &list);
    printf("Usage: vdbshade %s %s\n\n%s\n", command->name, command->usage, command->summary);
    for (size_t i = 0; i < list.count; ++i) {
        if (list.options[i].key == 0) {
            printf("\n%s:\n", list.options[i].help);
        } else {
            print_option(&list.options[i]);
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
    char *own = strndup(value, (size_t)(sign - value));
    if (own == NULL) {
        return cli_out_of_memory(name);
    }
    rule->pattern = densities->own[densities->count++] = own;
    return CLI_OK;
}

void cli_densities_free(cli_densities *densities) {
    for (size_t i = 0; i < densities->count; ++i) {
        free(densities->own[i]);
    }
    densities->count = 0;
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
