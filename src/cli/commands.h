/* The subcommands. */
#ifndef CLI_COMMANDS_H
#define CLI_COMMANDS_H

#include "options.h"

extern const cli_command cli_bake;
extern const cli_command cli_voxelize;
extern const cli_command cli_field;
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

int cli_bake_main(int argc, char **argv);
int cli_render_main(int argc, char **argv);

#endif
