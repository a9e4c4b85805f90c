/* The subcommands. */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

#include "options.h"

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

/* A command, and the line that tells of it. */
typedef struct cli_command_row {
    const cli_command *command;
    const char *operands;
    const char *brief;
} cli_command_row;

/* Row `index`, in the order of the help; NULL beyond the last. */
const cli_command_row *cli_command_get(size_t index);

/* The command of that name; NULL: there is none. */
const cli_command *cli_command_find(const char *name);

/* What vdbshade is; what it does, in a line. */
extern const char cli_summary[];

/* An exit code and what it says. */
typedef struct cli_exit_row {
    int code;
    const char *meaning;
} cli_exit_row;

/* Row `index`; NULL beyond the last. */
const cli_exit_row *cli_exit_get(size_t index);

/* What holds of errors in every command. */
extern const char cli_errors[];

/* The help of the whole program. */
void cli_print_commands(void);

#endif
