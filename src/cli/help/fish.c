/* Completion for fish: a line of `complete` an option. */
#include "help.h"

static const char head[] =
    "# vdbshade: completion for fish. Made by 'vdbshade help --completion fish'.\n"
    "\n"
    "# Whether the command is this one.\n"
    "function __vdbshade_is\n"
    "    set -l words (commandline -opc)\n"
    "    test (count $words) -ge 2; and test $words[2] = $argv[1]\n"
    "end\n"
    "\n"
    "function __vdbshade_begins\n"
    "    test (count (commandline -opc)) -eq 1\n"
    "end\n"
    "\n"
    "# Files with one of these endings (none: all), and folders.\n"
    "function __vdbshade_files\n"
    "    set -l word (commandline -ct | string replace -r -- '^-[^=]*=' '' | string unescape)\n"
    "    set -l home (string replace -r -- '^~' $HOME \"$word\")\n"
    "    for path in $home*\n"
    "        set -l shown (string replace -- $home \"$word\" $path)\n"
    "        if test -d $path\n"
    "            echo $shown/\n"
    "        else if test (count $argv) -eq 0; or string match -qir -- '\\\\.('(string join '|' $argv)')$' "
    "$path\n"
    "            echo $shown\n"
    "        end\n"
    "    end\n"
    "end\n"
    "\n"
    "complete -c vdbshade -f\n"
    "complete -c vdbshade -n __vdbshade_begins -l help -d 'show the commands'\n"
    "complete -c vdbshade -n __vdbshade_begins -l version -d 'show the version'\n";

static void put(FILE *out, const char *text) {
    fputc('\'', out);
    for (const char *c = text; *c != '\0'; ++c) {
        fprintf(out, *c == '\'' || *c == '\\' ? "\\%c" : "%c", *c);
    }
    fputc('\'', out);
}

static void write_value(FILE *out, const cli_value *value) {
    switch (value->kind) {
    case CLI_VALUE_WORDS:
        fprintf(out, " -a '%s'", value->words);
        break;
    case CLI_VALUE_FILE:
        fprintf(out, " -a '(__vdbshade_files%s%s)'", value->words[0] != '\0' ? " " : "", value->words);
        break;
    case CLI_VALUE_FOLDER:
        fputs(" -a '(__fish_complete_directories (commandline -ct))'", out);
        break;
    case CLI_VALUE_OTHER:
        break;
    }
}

static void write_command(FILE *out, const cli_command *command) {
    cli_option options[CLI_MOST_OPTIONS];
    const size_t count = cli_list_options(command, options, CLI_MOST_OPTIONS);
    fputc('\n', out);
    for (size_t i = 0; i < count; ++i) {
        if (options[i].key == 0) {
            continue;
        }
        cli_value value;
        cli_value_of_option(command, &options[i], &value);
        fprintf(out, "complete -c vdbshade -n '__vdbshade_is %s'", command->name);
        if (options[i].key < 256) {
            fprintf(out, " -s %c", options[i].key);
        }
        fprintf(out, " -l %s%s", options[i].name, options[i].value != NULL ? " -x" : "");
        write_value(out, &value);
        char brief[384];
        cli_option_brief(&options[i], brief, sizeof brief);
        fputs(" -d ", out);
        put(out, brief);
        fputc('\n', out);
    }
    cli_operand operands[CLI_MOST_OPERANDS]; /* which are all of one kind */
    if (cli_operands_of(command, operands) > 0 && operands[0].value.kind != CLI_VALUE_OTHER) {
        fprintf(out, "complete -c vdbshade -n '__vdbshade_is %s'", command->name);
        write_value(out, &operands[0].value);
        fputc('\n', out);
    }
}

void cli_write_fish(FILE *out) {
    fputs(head, out);
    const cli_command_row *row;
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        fprintf(out, "complete -c vdbshade -n __vdbshade_begins -a %s -d ", row->command->name);
        put(out, row->brief);
        fputc('\n', out);
    }
    for (size_t i = 0; (row = cli_command_get(i)) != NULL; ++i) {
        write_command(out, row->command);
    }
}
