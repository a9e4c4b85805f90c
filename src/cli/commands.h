/* The subcommands, the exit codes, and the pages of the manual. */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

#include "options.h"

#include <stdio.h>

extern const cli_command cli_bake;
extern const cli_command cli_voxelize;
extern const cli_command cli_info;
extern const cli_command cli_trade;
extern const cli_command cli_query;
extern const cli_command cli_render;
extern const cli_command cli_volume;
extern const cli_command cli_flat;
extern const cli_command cli_compare;
extern const cli_command cli_regress;
extern const cli_command cli_unwrap;
extern const cli_command cli_view;
extern const cli_command cli_help;
extern const cli_command cli_merge;

/* A command, and its line in the help of the whole program. */
typedef struct cli_command_row {
    const cli_command *command;
    const char *operands;
    const char *brief;
} cli_command_row;

extern const cli_command_row cli_commands[]; /* in the order of the help; the last row has no command */

/* Returns the row of a command's name, or NULL. */
const cli_command_row *cli_find_command(const char *name);

/* Returns the command, or also the page of the manual, whose name is nearest to `text`; NULL if none is near.
 */
const char *cli_nearest_topic(const char *text, bool has_pages);

typedef struct cli_exit_row {
    int code;
    const char *meaning;
} cli_exit_row;

extern const cli_exit_row cli_exits[]; /* the last row has no meaning */

/* A page of docs/, built in (cmake/embed_docs.cmake). */
typedef struct cli_page {
    const char *name; /* "scene", of docs/scene.md */
    const unsigned char *bytes;
    size_t size;
} cli_page;

extern const cli_page cli_pages[]; /* the last row has no name */

/* Texts of the help: a line about vdbshade, and how every command reports errors. */
extern const char cli_summary[], cli_errors[];

/* Prints the help of the whole program. */
void cli_print_commands(void);

/* Writes a man page in the man macros: of a command, or for NULL of the program. */
void cli_write_man(FILE *out, const cli_command_row *row);

#endif
