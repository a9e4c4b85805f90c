/* What values are, told from the tables: from an option's placeholder ("FILE.json", "yes|no"), from the range
 * of a setting ("taps, cones, rays"), and for files whose endings no placeholder has, from a table of their
 * own. */
#include "help.h"

#include "cli/paths.h"

#include <ctype.h>
#include <string.h>

#define ROWS "csv tsv txt xyz ply raw f32 bin"

/* Files of many endings: operands and options of a command (NULL: of each that no row before names). */
static const struct {
    const char *command, *name, *endings;
} files[] = {
    {"query", "INPUT", CLI_MODEL_ENDINGS " json vdb"},
    {"volume", "INPUT", CLI_MODEL_ENDINGS " json vdb"},
    {"voxelize", "INPUT", CLI_MODEL_ENDINGS " json vdb"},
    {"render", "INPUT", CLI_MODEL_ENDINGS " json vdb"},
    {"unwrap", "INPUT", CLI_MODEL_ENDINGS},
    {"view", "OTHER", CLI_MODEL_ENDINGS},
    {"info", "FILE", CLI_MODEL_ENDINGS " json vdb " CLI_IMAGE_ENDINGS},
    {"query", "points", ROWS},
    {"query", "output", ROWS},
    {"bake", "output", CLI_IMAGE_ENDINGS " glb gltf"},
    {NULL, "INPUT", CLI_MODEL_ENDINGS " json"},
    {NULL, "SCENE", "json"},
    {NULL, "GOLDEN", CLI_IMAGE_ENDINGS " vdb"},
    {NULL, "NEW", CLI_IMAGE_ENDINGS " vdb"},
    {NULL, "output", CLI_IMAGE_ENDINGS},
    {NULL, "caster", CLI_MODEL_ENDINGS " vdb"},
    {NULL, "lights", "glb gltf"},
    {NULL, "lightmap", CLI_IMAGE_ENDINGS},
    {NULL, "planes", CLI_IMAGE_ENDINGS},
    {NULL, "other-planes", CLI_IMAGE_ENDINGS},
    {NULL, "picture", CLI_IMAGE_ENDINGS},
    {NULL, "like", "vdb"},
    {NULL, "cache", "json"},
};

size_t cli_next_word(const char **at, const char **word) {
    *word = *at + strspn(*at, " \n");
    const size_t length = strcspn(*word, " \n");
    *at = *word + length;
    return length;
}

static void add_word(cli_value *value, const char *word, size_t length) {
    const size_t used = strlen(value->words);
    if (used + length + 2 <= sizeof value->words) {
        snprintf(value->words + used, sizeof value->words - used, "%s%.*s", used > 0 ? " " : "", (int)length,
                 word);
    }
}

/* Whether it is a word to be given as it stands, and not what stands for one. */
static bool is_literal(const char *word, size_t length) {
    for (size_t i = 0; i < length; ++i) {
        if (!islower((unsigned char)word[i]) && !isdigit((unsigned char)word[i]) && word[i] != '-') {
            return false;
        }
    }
    return length > 0;
}

/* "yes|no": all are literal, or it is no list. */
static void read_placeholder(const char *text, cli_value *value) {
    for (const char *at = text; strchr(text, '|') != NULL;) {
        const size_t length = strcspn(at, "|");
        if (!is_literal(at, length)) {
            value->words[0] = '\0';
            return;
        }
        add_word(value, at, length);
        if (at[length] == '\0') {
            return;
        }
        at += length + 1;
    }
}

/* "taps, cones, rays", "8, 16 or 32"; of "m, cm, or metres" what stands before the last, which is no word. */
static void read_range(const char *text, cli_value *value) {
    if (strchr(text, ',') == NULL) {
        return;
    }
    for (const char *at = text; *at != '\0';) {
        const char *comma = strstr(at, ", "), * or = strstr(at, " or ");
        const char *end = comma != NULL ? comma : at + strlen(at);
        end = or != NULL && or < end ? or : end;
        if (strncmp(at, "or ", 3) == 0) {
            return;
        }
        if (is_literal(at, (size_t)(end - at))) {
            add_word(value, at, (size_t)(end - at));
        }
        at = end + (*end == '\0' ? 0 : end == comma ? 2 : 4);
    }
}

/* Whether a placeholder stands for a file: "FILE", "FILE.json", "OUT.vdb", "FILE[:GRID]", "PAGE.html". */
static bool is_file(const char *text) {
    static const char *const words[] = {"FILE", "OUT", "PAGE", "INPUT", "OTHER", "SCENE", "GOLDEN", "NEW"};
    const size_t length = strcspn(text, ".[");
    for (size_t i = 0; i < sizeof words / sizeof words[0]; ++i) {
        if (strlen(words[i]) == length && strncmp(text, words[i], length) == 0) {
            return true;
        }
    }
    return false;
}

static void read_file(const cli_command *command, const char *name, const char *placeholder,
                      cli_value *value) {
    value->kind = CLI_VALUE_FILE;
    const char *dot = strchr(placeholder, '.');
    if (dot != NULL) {
        add_word(value, dot + 1, strlen(dot + 1));
        return;
    }
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        if (strcmp(files[i].name, name) == 0 &&
            (files[i].command == NULL || strcmp(files[i].command, command->name) == 0)) {
            add_word(value, files[i].endings, strlen(files[i].endings));
            return;
        }
    }
}

static void read_value(const cli_command *command, const char *name, const char *placeholder,
                       cli_value *value) {
    if (strcmp(placeholder, "FOLDER") == 0 || strcmp(placeholder, "DIR") == 0) {
        value->kind = CLI_VALUE_FOLDER;
    } else if (is_file(placeholder)) {
        read_file(command, name, placeholder, value);
    } else {
        read_placeholder(placeholder, value);
    }
}

void cli_value_of_option(const cli_command *command, const cli_option *option, cli_value *value) {
    *value = (cli_value){.kind = CLI_VALUE_OTHER};
    if (option->value == NULL) {
        return;
    }
    read_value(command, option->name, option->value, value);
    const vsh_setting *setting =
        option->key >= CLI_KEY_SETTING ? cli_setting((size_t)(option->key - CLI_KEY_SETTING)) : NULL;
    if (value->kind == CLI_VALUE_OTHER && setting != NULL) {
        read_range(setting->range, value);
    }
    if (value->kind == CLI_VALUE_OTHER && value->words[0] != '\0') {
        value->kind = CLI_VALUE_WORDS;
    }
}

/* Topics of `help`: commands and pages. */
static void list_topics(cli_value *value) {
    value->kind = CLI_VALUE_WORDS;
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        add_word(value, row->command->name, strlen(row->command->name));
    }
    for (const cli_page *page = cli_pages; page->name != NULL; ++page) {
        if (cli_command_find(page->name) == NULL) {
            add_word(value, page->name, strlen(page->name));
        }
    }
}

size_t cli_operands_of(const cli_command *command, cli_operand operands[CLI_MOST_OPERANDS]) {
    size_t count = 0;
    const char *at = command->usage, *word;
    size_t length;
    while (count < CLI_MOST_OPERANDS && (length = cli_next_word(&at, &word)) > 0 && word[0] != '-' &&
           strncmp(word, "[options]", length) != 0) {
        cli_operand *operand = &operands[count++];
        *operand = (cli_operand){.optional = word[0] == '['};
        const size_t begin = operand->optional, name = strspn(word + begin, "ABCDEFGHIJKLMNOPQRSTUVWXYZ_");
        operand->repeats = strstr(word, "…") != NULL && strstr(word, "…") < word + length;
        snprintf(operand->name, sizeof operand->name, "%.*s", (int)name, word + begin);
        if (command == &cli_help) {
            list_topics(&operand->value);
        } else {
            read_value(command, operand->name, operand->name, &operand->value);
        }
    }
    return count;
}

void cli_option_brief(const cli_option *option, char *brief, size_t size) {
    size_t used = 0;
    for (const char *c = option->help; *c != '\0' && used + 1 < size; ++c) {
        const char next = c[1];
        const bool blank = next == ' ' || next == '\n';
        if (((*c == ';' || *c == ':') && blank) || ((*c == ' ' || *c == '\n') && next == '(')) {
            break;
        }
        brief[used++] = *c == '\n' ? ' ' : *c;
    }
    brief[used] = '\0';
}
