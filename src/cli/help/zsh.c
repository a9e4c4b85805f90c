/* Completion for zsh: specifications of _arguments, a command each. */
#include "help.h"

#include <string.h>

/* Text within the quotes of a specification. */
static void put(FILE *out, const char *text) {
    for (const char *c = text; *c != '\0'; ++c) {
        if (*c == '\'') {
            fputs("'\\''", out);
        } else {
            fprintf(out, strchr("[]:\\", *c) != NULL ? "\\%c" : "%c", *c);
        }
    }
}

static void write_words(FILE *out, const char *words, char between) {
    const char *at = words, *word;
    size_t length;
    for (int first = 1; (length = cli_next_word(&at, &word)) > 0; first = 0) {
        if (!first) {
            fputc(between, out);
        }
        fwrite(word, 1, length, out);
    }
}

/* ":NAME:ACTION" */
static void write_value(FILE *out, const char *name, const cli_value *value) {
    fputc(':', out);
    put(out, name);
    fputc(':', out);
    switch (value->kind) {
    case CLI_VALUE_WORDS:
        fputc('(', out);
        write_words(out, value->words, ' ');
        fputc(')', out);
        break;
    case CLI_VALUE_FILE:
        fputs("_files", out);
        if (value->words[0] != '\0') {
            fputs(" -g \"*.(#i)(", out);
            write_words(out, value->words, '|');
            fputs(")(-.)\"", out);
        }
        break;
    case CLI_VALUE_FOLDER:
        fputs("_files -/", out);
        break;
    case CLI_VALUE_OTHER:
        fputc(' ', out); /* nothing is offered */
        break;
    }
}

static bool may_repeat(const cli_option *option) {
    return strstr(option->help, "repeat") != NULL || strstr(option->help, "again") != NULL;
}

static void write_option(FILE *out, const cli_command *command, const cli_option *option) {
    char brief[384];
    cli_option_brief(option, brief, sizeof brief);
    const char *equals = option->value != NULL ? "=" : "", *repeats = may_repeat(option) ? "*" : "";
    if (option->key == 'h') {
        fprintf(out, "            '(- *)'{-h,--help}'[");
    } else if (option->key < 256) {
        fprintf(out, "            '%s(-%c --%s)'{-%c%s,--%s%s}'[", repeats, option->key, option->name,
                option->key, option->value != NULL ? "+" : "", option->name, equals);
    } else {
        fprintf(out, "            '%s--%s%s[", repeats, option->name, equals);
    }
    put(out, brief);
    fputc(']', out);
    if (option->value != NULL) {
        cli_value value;
        cli_value_of_option(command, option, &value);
        write_value(out, option->value, &value);
    }
    fputs("' \\\n", out);
}

static void write_command(FILE *out, const cli_command *command) {
    cli_option options[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, options, CLI_MOST_OPTIONS);
    fprintf(out, "        %s)\n        _arguments -S \\\n", command->name);
    for (size_t i = 0; i < count; ++i) {
        if (options[i].key != 0) {
            write_option(out, command, &options[i]);
        }
    }
    cli_operand operands[CLI_MOST_OPERANDS];
    const size_t operand_count = cli_operands_of(command, operands);
    for (size_t i = 0; i < operand_count; ++i) {
        if (operands[i].repeats) {
            fputs("            '*", out);
        } else {
            fprintf(out, "            '%zu%s", i + 1, operands[i].optional ? ":" : "");
        }
        write_value(out, operands[i].name, &operands[i].value);
        fputs("' \\\n", out);
    }
    fputs("            && return 0\n        ;;\n", out);
}

void cli_write_zsh(FILE *out) {
    fputs("#compdef vdbshade\n"
          "# vdbshade: completion for zsh. Made by 'vdbshade help --completion zsh'.\n"
          "\n"
          "_vdbshade() {\n"
          "    local curcontext=$curcontext state line\n"
          "    typeset -A opt_args\n"
          "    local -a commands=(\n",
          out);
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        fprintf(out, "        '%s:", row->command->name);
        put(out, row->brief);
        fputs("'\n", out);
    }
    fputs("    )\n"
          "    _arguments -C '(- *)'{-h,--help}'[show the commands]' '(- *)--version[show the version]' \\\n"
          "        '1:command:->command' '*::argument:->arguments' && return 0\n"
          "    case $state in\n"
          "    command)\n"
          "        _describe -t commands command commands\n"
          "        ;;\n"
          "    arguments)\n"
          "        case $words[1] in\n",
          out);
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        write_command(out, row->command);
    }
    fputs("        esac\n        ;;\n    esac\n}\n\n_vdbshade \"$@\"\n", out);
}
