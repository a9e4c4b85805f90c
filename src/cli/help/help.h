/* What is made of the tables of commands and options beside --help: man pages and completions. */
#ifndef CLI_HELP_H
#define CLI_HELP_H

#include "cli/commands.h"

#include <stdio.h>

/* Pages of docs/, built in (cmake/embed_docs.cmake). */
typedef struct cli_page {
    const char *name; /* "scene", of docs/scene.md */
    const unsigned char *bytes;
    size_t size;
} cli_page;

extern const cli_page cli_pages[]; /* up to one without a name */

/* What a value is, as far as a shell can complete it. */
typedef enum cli_value_kind {
    CLI_VALUE_OTHER,
    CLI_VALUE_WORDS,
    CLI_VALUE_FILE,
    CLI_VALUE_FOLDER
} cli_value_kind;

typedef struct cli_value {
    cli_value_kind kind;
    char words[512]; /* of CLI_VALUE_WORDS: which; of CLI_VALUE_FILE: endings, "": any; parted by blanks */
} cli_value;

/* What an option takes. */
void cli_value_of_option(const cli_command *command, const cli_option *option, cli_value *value);

/* An operand of a command: what its usage begins with. */
typedef struct cli_operand {
    char name[32];
    bool optional, repeats; /* "[OTHER]", "PART…" */
    cli_value value;
} cli_operand;

enum { CLI_MOST_OPERANDS = 4 };

size_t cli_operands_of(const cli_command *command, cli_operand operands[CLI_MOST_OPERANDS]);

/* An option's help in a few words: up to what parts its first clause from the rest. */
void cli_option_brief(const cli_option *option, char *brief, size_t size);

/* The next of words that blanks part, from *at on; its length, 0 at the end. */
size_t cli_next_word(const char **at, const char **word);

/* A man page in the man macros; of the program for NULL. */
void cli_write_man(FILE *out, const cli_command_row *row);

/* Completions of a shell. */
void cli_write_bash(FILE *out);
void cli_write_zsh(FILE *out);
void cli_write_fish(FILE *out);

#endif
