/* Completion for bash: a function that looks at the words so far, and takes what it answers from `case`s. */
#include "help.h"

static const char head[] =
    "# vdbshade: completion for bash. Made by 'vdbshade help --completion bash'.\n"
    "\n"
    "# Files with one of these endings (none: all), and folders.\n"
    "_vdbshade_files() {\n"
    "    local path ending\n"
    "    compopt -o filenames 2>/dev/null\n"
    "    while IFS= read -r path; do\n"
    "        if [[ $# -eq 0 || -d ${path/#~/$HOME} ]]; then\n"
    "            COMPREPLY+=(\"$path\")\n"
    "            continue\n"
    "        fi\n"
    "        for ending; do\n"
    "            [[ ${path,,} != *.\"$ending\" ]] || COMPREPLY+=(\"$path\")\n"
    "        done\n"
    "    done < <(compgen -f -- \"$current\")\n"
    "}\n"
    "\n"
    "_vdbshade_folders() {\n"
    "    compopt -o filenames 2>/dev/null\n"
    "    mapfile -t COMPREPLY < <(compgen -d -- \"$current\")\n"
    "}\n"
    "\n"
    "_vdbshade_words() {\n"
    "    mapfile -t COMPREPLY < <(compgen -W \"$*\" -- \"$current\")\n"
    "}\n"
    "\n"
    "_vdbshade() {\n"
    "    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}\n"
    "    COMPREPLY=()\n"
    "    if [[ $current == = ]]; then # bash makes a word of its own of it\n"
    "        current=\n"
    "    elif [[ $before == = ]]; then\n"
    "        before=${COMP_WORDS[COMP_CWORD - 2]}\n"
    "    fi\n"
    "    current=${current#[\\\"\\']} current=${current//\\\\/}\n"
    "    if ((COMP_CWORD == 1)); then\n"
    "        _vdbshade_words";

static void write_value(FILE *out, const cli_value *value) {
    static const char *const calls[] = {[CLI_VALUE_WORDS] = "_vdbshade_words ",
                                        [CLI_VALUE_FILE] = "_vdbshade_files ",
                                        [CLI_VALUE_FOLDER] = "_vdbshade_folders"};
    if (value->kind != CLI_VALUE_OTHER) {
        fprintf(out, "%s%s", calls[value->kind], value->words);
    }
}

static void write_command(FILE *out, const cli_command *command) {
    cli_option options[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, options, CLI_MOST_OPTIONS);
    fprintf(out, "    %s)\n        case $before in\n", command->name);
    for (size_t i = 0; i < count; ++i) {
        if (options[i].key == 0 || options[i].value == NULL) {
            continue;
        }
        cli_value value;
        cli_value_of_option(command, &options[i], &value);
        fputs("        ", out);
        if (options[i].key < 256) {
            fprintf(out, "-%c | ", options[i].key);
        }
        fprintf(out, "--%s) ", options[i].name);
        write_value(out, &value);
        fputs(value.kind == CLI_VALUE_OTHER ? "return ;;\n" : "; return ;;\n", out);
    }
    fputs("        esac\n        if [[ $current == -* ]]; then\n            _vdbshade_words", out);
    for (size_t i = 0; i < count; ++i) {
        if (options[i].key != 0) {
            fprintf(out, " --%s", options[i].name);
        }
    }
    fputs("\n        else\n            ", out);
    cli_operand operands[CLI_MOST_OPERANDS]; /* which are all of one kind */
    cli_value value = {.kind = CLI_VALUE_OTHER};
    if (cli_operands_of(command, operands) > 0) {
        value = operands[0].value;
    }
    write_value(out, &value);
    fputs(value.kind == CLI_VALUE_OTHER ? ":\n        fi\n        ;;\n" : "\n        fi\n        ;;\n", out);
}

void cli_write_bash(FILE *out) {
    fputs(head, out);
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        fprintf(out, " %s", row->command->name);
    }
    fputs(" --help --version\n        return\n    fi\n    case ${COMP_WORDS[1]} in\n", out);
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        write_command(out, row->command);
    }
    fputs("    esac\n}\n\ncomplete -F _vdbshade vdbshade\n", out);
}
