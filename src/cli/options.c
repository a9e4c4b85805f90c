/* The parser of command lines, and their help. */
#include "base/text.h"
#include "cli.h"

#include <errno.h>
#include <sys/resource.h>
#include <unistd.h>

cli_common cli_given;
cli_line cli_parsed;

/* --- settings of the library */

static vsh_setting listed[CLI_MOST_SETTINGS]; /* read once */
static const char *listed_help[CLI_MOST_SETTINGS];
static size_t listed_count;

/* Formats "HELP, RANGE (DEFAULT)" or "HELP: NAMES (DEFAULT)". */
static const char *format_help(const vsh_setting *s) {
    const bool counts = strchr("0123456789ma", s->range[0]) != NULL && strchr(s->range, ',') == NULL;
    const char *separator = s->range[0] == '\0' ? "" : counts ? ", " : ": ";
    return s->otherwise[0] == '\0' ? cli_keep_text("%s%s%s", s->help, separator, s->range)
                                   : cli_keep_text("%s%s%s (%s)", s->help, separator, s->range, s->otherwise);
}

const vsh_setting *cli_setting(size_t index) {
    while (listed_count < CLI_MOST_SETTINGS && vsh_setting_get(listed_count, &listed[listed_count]) != 0) {
        listed_help[listed_count] = format_help(&listed[listed_count]);
        ++listed_count;
    }
    return index < listed_count ? &listed[index] : NULL;
}

/* Sets a setting of `owner`: a vsh_scene, vsh_receiver or vsh_flat_scene. */
static int set(const vsh_setting *setting, const char *text, void *owner) {
    const char *name = cli_keep_text("--%s", setting->option);
    switch (setting->owner) {
    case VSH_SETTING_OF_SCENE:
        return cli_check(vsh_scene_set(owner, name, text, &cli_error));
    case VSH_SETTING_OF_RECEIVER:
        return cli_check(vsh_receiver_set(owner, name, text, &cli_error));
    default:
        return cli_check(vsh_flat_scene_set(owner, name, text, &cli_error));
    }
}

/* Stores the value of a setting, and checks it at once, before any file is read. */
static int store_setting(size_t index, const char *value) {
    vsh_scene scene = vsh_scene_default();
    vsh_receiver receiver = vsh_receiver_default();
    vsh_flat_scene flat = vsh_flat_scene_default();
    void *const owners[] = {[VSH_SETTING_OF_SCENE] = &scene,
                            [VSH_SETTING_OF_RECEIVER] = &receiver,
                            [VSH_SETTING_OF_FLAT] = &flat};
    const vsh_setting *setting = cli_setting(index);
    cli_parsed.settings[index] = value != NULL ? value : "true";
    return set(setting, cli_parsed.settings[index], owners[setting->owner]);
}

int cli_set_default(const char *option, const char *value) {
    for (size_t i = 0; cli_setting(i) != NULL; ++i) {
        if (strcmp(cli_setting(i)->option, option) == 0) {
            return cli_was_given(option) ? CLI_OK : store_setting(i, value);
        }
    }
    return CLI_OK;
}

int cli_apply_settings(int32_t owner, void *target) {
    if (owner == VSH_SETTING_OF_SCENE && cli_parsed.rule_count > 0) {
        vsh_scene *scene = target;
        scene->solidity = cli_parsed.rules;
        scene->solidity_count = cli_parsed.rule_count;
    }
    for (size_t i = 0; cli_setting(i) != NULL; ++i) {
        if (cli_parsed.settings[i] != NULL && cli_setting(i)->owner == (vsh_setting_owner)owner) {
            CLI_TRY(set(cli_setting(i), cli_parsed.settings[i], target));
        }
    }
    return CLI_OK;
}

/* --- tables of options */

/* Finds the option of a name or, if `letter` is not 0, of a letter. */
static const cli_option *find_option(const cli_option *options, size_t count, const char *name, char letter) {
    for (size_t i = 0; i < count; ++i) {
        if (options[i].name != NULL && (letter != '\0' ? cli_letter_of(options[i].name) == letter
                                                       : strcmp(options[i].name, name) == 0)) {
            return &options[i];
        }
    }
    return NULL;
}

size_t cli_list_options(const cli_command *command, cli_option options[CLI_MOST_OPTIONS]) {
    size_t count = 0;
    for (size_t i = 0; i < command->option_count; ++i) {
        const cli_option *row = &command->options[i];
        if (row->kind != CLI_KIND_SETTINGS && row->kind != CLI_KIND_SETTING) {
            options[count++] = *row;
            continue;
        }
        const vsh_setting *setting;
        for (size_t k = 0; (setting = cli_setting(k)) != NULL; ++k) {
            const bool wanted = row->kind == CLI_KIND_SETTING
                                    ? strcmp(setting->option, row->name) == 0
                                    : setting->group == (vsh_setting_topic)row->place;
            if (wanted && find_option(options, count, setting->option, 0) == NULL) {
                options[count++] = (cli_option){
                    setting->option, setting->value[0] != '\0' ? setting->value : NULL,
                    row->help != NULL ? row->help : listed_help[k], .kind = CLI_KIND_SETTING, .place = k};
            }
        }
    }
    return count;
}

char cli_letter_of(const char *option) {
    const bool has = strcmp(option, "help") == 0 || strcmp(option, "output") == 0 ||
                     strcmp(option, "quiet") == 0 || strcmp(option, "verbose") == 0;
    return has ? option[0] : '\0';
}

bool cli_find_option(const cli_command *command, const char *word, cli_option *option) {
    cli_option list[CLI_MOST_OPTIONS];
    const char letter = word[1] != '-' ? word[1] : '\0', *name = word + 2;
    const cli_option *found =
        find_option(list, cli_list_options(command, list),
                    letter == '\0' ? cli_keep_text("%.*s", (int)strcspn(name, "="), name) : "", letter);
    *option = found != NULL ? *found : (cli_option){.name = NULL};
    return found != NULL;
}

bool cli_was_given(const char *option) {
    for (size_t i = 0; i < cli_parsed.option_count; ++i) {
        if (strcmp(cli_parsed.options[i], option) == 0) {
            return true;
        }
    }
    return false;
}

const char *cli_nearest(const char *text, const char *const *candidates, size_t count) {
    const char *nearest = NULL;
    size_t best = 1 + (strlen(text) > 6 ? strlen(text) / 3 : 2);
    for (size_t i = 0; i < count; ++i) {
        const size_t distance = vshi_edit_distance(text, candidates[i]);
        if (distance < best) {
            best = distance;
            nearest = candidates[i];
        }
    }
    return nearest;
}

/* --- values */

/* strtod() and strtoll() also skip leading blanks. */
static bool starts_number(const char *text) {
    return *text != '\0' && strchr("+-.0123456789", *text) != NULL;
}

static bool read_number(const char *text, double *value, const char **rest) {
    char *end = NULL;
    if (!starts_number(text) || strpbrk(text, "xXpP") != NULL) {
        return false;
    }
    *value = strtod(text, &end);
    *rest = end;
    return end != text && isfinite(*value);
}

bool cli_read_numbers(const char *text, size_t count, double *value) {
    bool good = true;
    for (size_t i = 0; i < count && good; ++i) {
        good = read_number(text, &value[i], &text) && *text == (i + 1 < count ? ',' : '\0');
        ++text;
    }
    return good;
}

bool cli_read_integer(const char *text, int32_t *value, const char **rest) {
    char *end = NULL;
    errno = 0;
    const long long number = starts_number(text) ? strtoll(text, &end, 10) : 0;
    *rest = end;
    *value = (int32_t)number;
    return end != NULL && end != text && errno == 0 && number >= INT32_MIN && number <= INT32_MAX;
}

/* Reads "W" or "WxH". */
static bool read_size(const char *text, int32_t size[2]) {
    const char *at;
    if (!cli_read_integer(text, &size[0], &at)) {
        return false;
    }
    size[1] = size[0];
    return (*at == '\0' || (*at == 'x' && cli_read_integer(at + 1, &size[1], &at) && *at == '\0')) &&
           size[0] >= 1 && size[0] <= VSH_MAX_LIGHTMAP_SIZE && size[1] >= 1 &&
           size[1] <= VSH_MAX_LIGHTMAP_SIZE;
}

static bool read_bytes(const char *text, uint64_t *value) {
    static const struct {
        const char *suffix;
        double factor;
    } units[] = {{"", 1.0},       {"k", 1e3},      {"M", 1e6},     {"G", 1e9},
                 {"KiB", 0x1p10}, {"MiB", 0x1p20}, {"GiB", 0x1p30}};
    double number;
    const char *rest;
    if (read_number(text, &number, &rest) && number >= 0.0) {
        for (size_t i = 0; i < CLI_COUNT(units); ++i) {
            if (strcmp(rest, units[i].suffix) == 0 && number * units[i].factor < 0x1p62) {
                *value = (uint64_t)(number * units[i].factor);
                return true;
            }
        }
    }
    return false;
}

/* Reads the number of a word in "a|b|c". */
static bool read_word(const char *text, const char *words, int32_t *value) {
    const size_t length = strlen(text);
    *value = 0;
    for (const char *at = words; *at != '\0'; ++*value) {
        const size_t size = strcspn(at, "|");
        if (size == length && strncmp(at, text, size) == 0) {
            return true;
        }
        at += size + (at[size] != '\0');
    }
    return false;
}

/* Lists the names of a VSH_NAMES_… kind. */
static const char *list_names(int32_t kind) {
    const char *list = "one of", *name;
    for (int32_t i = 0; (name = vsh_get_name(kind, i)) != NULL; ++i) {
        list = cli_keep_text("%s%s %s", list, i > 0 ? "," : "", name);
    }
    return list;
}

static int add_item(cli_list *list, size_t most, const char *name, const char *value) {
    CLI_REFUSE_IF(value[0] == '\0', "%s: expected a name", name);
    CLI_REFUSE_IF(list->count == most, "%s '%s': given more than %zu times", name, value, most);
    list->text[list->count++] = value;
    return CLI_OK;
}

/* Splits PATTERN=X, *x is behind the last '='. Names may contain one. */
static const char *split_pattern(const char *value, const char **x) {
    const char *sign = strrchr(value, '=');
    *x = sign != NULL ? sign + 1 : NULL;
    return sign == NULL || sign == value ? NULL : cli_keep_text("%.*s", (int)(sign - value), value);
}

int cli_parse_treat(void *unused, const char *name, const char *value) {
    static const int32_t solidity[] = {VSH_SOLIDITY_SOLID, VSH_SOLIDITY_SHELL, VSH_SOLIDITY_INWARD};
    const char *x, *pattern = split_pattern(value, &x);
    int32_t word;
    (void)unused;
    CLI_REFUSE_IF(cli_parsed.rule_count == CLI_MOST_RULES, "%s '%s': given more than %d times", name, value,
                  CLI_MOST_RULES);
    CLI_REFUSE_IF(pattern == NULL || !read_word(x, "solid|sheet|room", &word),
                  "%s '%s': expected PATTERN=solid, PATTERN=sheet or PATTERN=room", name, value);
    cli_parsed.rules[cli_parsed.rule_count++] = (vsh_solidity_rule){pattern, solidity[word]};
    return CLI_OK;
}

int cli_parse_density(void *at, const char *name, const char *value) {
    cli_densities *densities = at;
    vsh_density_rule rule;
    const char *x;
    rule.pattern = split_pattern(value, &x);
    CLI_REFUSE_IF(rule.pattern == NULL || !cli_read_numbers(x, 1, &rule.factor) || !(rule.factor > 0.0),
                  "%s '%s': expected PATTERN=X, a number greater than 0", name, value);
    CLI_REFUSE_IF(densities->count == CLI_MOST_DENSITIES, "%s '%s': given more than %d times", name, value,
                  CLI_MOST_DENSITIES);
    densities->list[densities->count++] = rule;
    return CLI_OK;
}

/* --- parsing */

enum { MOST_OPERANDS = 2 };

/* A command line, while it is parsed. */
typedef struct command_line {
    const cli_command *command;
    int argc;
    char **argv;
    void *settings;
    const char *operands[MOST_OPERANDS + 1]; /* the first ones */
    int operand_count;
    FILE *record; /* the line for provenance */
} command_line;

static int unknown_option(const command_line *p, const char *text) {
    cli_option list[CLI_MOST_OPTIONS];
    const size_t rows = cli_list_options(p->command, list);
    const char *names[CLI_MOST_OPTIONS], *word = text + strspn(text, "-");
    size_t count = 0;
    for (size_t i = 0; i < rows; ++i) {
        names[count] = list[i].name;
        count += list[i].name != NULL;
    }
    const char *near = cli_nearest(cli_keep_text("%.*s", (int)strcspn(word, "="), word), names, count);
    return near != NULL ? cli_usage("%s: no such option; did you mean --%s?", text, near)
                        : cli_usage("%s: no such option; see 'vdbshade %s --help'", text, p->command->name);
}

/* Records a word after a blank, quoted as a shell needs it. */
static void record_word(FILE *record, const char *word) {
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%";
    if (word[0] != '\0' && strspn(word, plain) == strlen(word)) {
        fprintf(record, " %s", word);
        return;
    }
    fputs(" '", record);
    for (const char *c = word; *c != '\0'; ++c) {
        fprintf(record, "%s%c", *c == '\'' ? "'\\'" : "", *c);
    }
    fputc('\'', record);
}

/* Records an option if it changes values. */
static void record_option(FILE *record, const cli_option *option, const char *value) {
    static const char changes_nothing[] =
        " output stats threads memory-limit sandbox allow-outside quiet verbose progress json "
        "dry-run help view shard ";
    if (strstr(changes_nothing, cli_keep_text(" %s ", option->name)) != NULL) {
        return;
    }
    fprintf(record, " --%s", option->name);
    if (value != NULL) {
        record_word(record, strncmp(option->value, "FILE", 4) == 0 ? vshi_path_name(value) : value);
    }
}

/* Stores the value of an option. */
static int store(const cli_option *o, void *settings, const char *name, const char *value) {
    void *at = o->global != NULL ? o->global : (char *)settings + o->place;
    double *number = at; /* these two as the kind says */
    int32_t *integer = at;
    const char *expected = "", *rest;
    bool good = true;
    switch (o->kind) {
    case CLI_KIND_SETTING:
        return store_setting(o->place, value);
    case CLI_KIND_TEXT:
        *(const char **)at = value;
        break;
    case CLI_KIND_FLAG:
        *(bool *)at = true;
        break;
    case CLI_KIND_POSITIVE:
        good = cli_read_numbers(value, 1, number) && *number > 0.0;
        expected = "a number greater than 0";
        break;
    case CLI_KIND_NUMBER:
        good = cli_read_numbers(value, 1, number) && *number >= o->least && *number <= o->most;
        expected = cli_keep_text("a number from %g to %g", o->least, o->most);
        break;
    case CLI_KIND_INTEGER:
        good = cli_read_integer(value, integer, &rest) && *rest == '\0' && *integer >= o->least &&
               *integer <= o->most;
        expected = cli_keep_text("a whole number from %.0f to %.0f", o->least, o->most);
        break;
    case CLI_KIND_BYTES:
        good = read_bytes(value, at);
        expected = "bytes, with k, M, G, KiB, MiB or GiB behind the number";
        break;
    case CLI_KIND_NAME:
        *integer = vsh_find_name((int32_t)o->least, value);
        good = *integer >= 0;
        expected = list_names((int32_t)o->least);
        break;
    case CLI_KIND_WORD:
        good = read_word(value, o->value, integer);
        expected = cli_keep_text("one of %s", o->value);
        break;
    case CLI_KIND_POINT:
        good = cli_read_numbers(value, 3, number);
        expected = "X,Y,Z, three numbers";
        break;
    case CLI_KIND_VECTOR:
        good =
            cli_read_numbers(value, 3, number) && (number[0] != 0.0 || number[1] != 0.0 || number[2] != 0.0);
        expected = "X,Y,Z, three numbers that are not all 0";
        break;
    case CLI_KIND_COLOR:
        good = cli_read_numbers(value, 3, number) && number[0] >= 0.0 && number[1] >= 0.0 && number[2] >= 0.0;
        expected = "R,G,B, three numbers from 0";
        break;
    case CLI_KIND_SIZE:
        good = read_size(value, integer);
        expected = cli_keep_text("W or WxH, each from 1 to %d texels", VSH_MAX_LIGHTMAP_SIZE);
        break;
    case CLI_KIND_LIST:
        return add_item(at, (size_t)o->most, name, value);
    default:
        return o->parse(at, name, value);
    }
    return good ? CLI_OK : cli_usage("%s '%s': expected %s", name, value, expected);
}

/* Parses an option. If `value` is NULL, the next word is its value, and *at moves to it. */
static int parse_option(command_line *p, const cli_option *option, const char *value, int *at) {
    const char *name = cli_keep_text("--%s", option->name);
    CLI_REFUSE_IF(value != NULL && option->value == NULL, "%s: takes no value", name);
    if (value == NULL && option->value != NULL) {
        CLI_REFUSE_IF(*at + 1 == p->argc, "%s: needs a value", name);
        value = p->argv[++*at];
    }
    if (option->kind == CLI_KIND_HELP) {
        cli_print_help(p->command);
        return CLI_HELP;
    }
    record_option(p->record, option, value);
    if (!cli_was_given(option->name)) {
        cli_parsed.options[cli_parsed.option_count++] = option->name;
    }
    return store(option, p->settings, name, value);
}

/* Parses "-q", "-o", "-oVALUE" or "-qo". */
static int parse_letters(command_line *p, int *at) {
    cli_option option = {.value = NULL};
    for (const char *c = p->argv[*at] + 1; *c != '\0' && option.value == NULL; ++c) {
        const char letter[] = {'-', *c, '\0'};
        if (!cli_find_option(p->command, letter, &option)) {
            return unknown_option(p, letter);
        }
        CLI_TRY(parse_option(p, &option, option.value != NULL && c[1] != '\0' ? c + 1 : NULL, at));
    }
    return CLI_OK;
}

/* Parses all options, and lists the operands between them and after "--". */
static int parse_words(command_line *p) {
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
            CLI_TRY(parse_option(p, &option, sign != NULL ? sign + 1 : NULL, &at));
        } else if (!ended && word[0] == '-' && word[1] != '\0') {
            CLI_TRY(parse_letters(p, &at));
        } else if (p->operand_count <= MOST_OPERANDS) {
            p->operands[p->operand_count++] = word;
        }
    }
    return CLI_OK;
}

/* Assigns the operands that the usage begins with: "INPUT [OTHER] -o OUT [options]". */
static int assign_operands(const command_line *p, const char **operands) {
    const char *command = p->command->name, *at = p->command->usage, *name = "";
    bool optional = false;
    int count = 0;
    for (; *at != '\0' && *at != '-' && strncmp(at, "[options]", strlen("[options]")) != 0; ++count) {
        const int length = (int)strcspn(at, " ");
        optional = *at == '[';
        name = cli_keep_text("%.*s", length - 2 * optional, at + optional);
        operands[count] = count < p->operand_count ? p->operands[count] : NULL;
        CLI_REFUSE_IF(operands[count] == NULL && !optional, "%s: no %s; see 'vdbshade %s --help'", command,
                      name, command);
        if (operands[count] != NULL) {
            record_word(p->record, vshi_path_name(operands[count]));
        }
        at += length + (int)strspn(at + length, " ");
    }
    CLI_REFUSE_IF(count < p->operand_count, "%s: expected one %s, but '%s' is one more", command, name,
                  p->operands[count]);
    cli_parsed.grid = count == 1 && !optional ? cli_split_grid(&operands[0]) : NULL;
    cli_parsed.input = operands[0];
    CLI_REFUSE_IF(cli_was_given("resolution") && cli_was_given("voxel-size"),
                  "--resolution and --voxel-size: give one of the two");
    return CLI_OK;
}

/* Returns the machine's memory, or the limit of the control group (a container) or of the address space
 * (ulimit -v) if that is less. */
static uint64_t find_memory(void) {
    static const char *const limits[] = {"/sys/fs/cgroup/memory.max",
                                         "/sys/fs/cgroup/memory/memory.limit_in_bytes"};
    uint64_t bytes = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGESIZE);
    for (size_t i = 0; i < CLI_COUNT(limits); ++i) {
        FILE *file = fopen(limits[i], "r");
        uint64_t limit = 0;
        if (file != NULL) {
            bytes = fscanf(file, "%" SCNu64, &limit) == 1 && limit > 0 && limit < bytes ? limit : bytes;
            fclose(file);
        }
    }
    struct rlimit space;
    return getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur < bytes ? space.rlim_cur : bytes;
}

int cli_parse(const cli_command *command, int argc, char **argv, void *settings, const char **operands) {
    command_line p = {.command = command, .argc = argc, .argv = argv, .settings = settings};
    free(cli_parsed.command);
    cli_given = (cli_common){.quiet = false};
    cli_run = vsh_run_default();
    cli_run.memory_limit = find_memory() / 4 * 3;
    cli_parsed = (cli_line){.command = NULL};
    size_t size;
    p.record = open_memstream(&cli_parsed.command, &size);
    fputs(command->name, p.record);
    int code = parse_words(&p);
    code = code == CLI_OK ? assign_operands(&p, operands) : code;
    fclose(p.record);
    cli_complete_run();
    cli_begin_progress(!cli_given.quiet);
    return code;
}
