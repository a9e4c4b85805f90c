/* vdbshade: the command line. Which subcommand, and the exit code. */
#include "child.h"
#include "commands.h"
#include "message.h"
#include "progress.h"
#include "signals.h"
#include "warnings.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include <vdbshade/reader.h>

static int unknown_command(const char *text) {
    if (text[0] == '-') {
        return cli_usage("%s: no such option; see 'vdbshade --help'", text);
    }
    enum { MOST = 64 };
    const char *names[MOST];
    size_t count = 0;
    for (const cli_command_row *row; count < MOST && (row = cli_command_get(count)) != NULL;) {
        names[count++] = row->command->name;
    }
    const char *near = cli_nearest(text, names, count);
    if (near != NULL) {
        return cli_usage("%s: no such command; did you mean %s?", text, near);
    }
    return cli_usage("%s: no such command; see 'vdbshade --help'", text);
}

static int dispatch(int argc, char **argv) {
    if (argc < 2) {
        return cli_usage("no command; see 'vdbshade --help'");
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        cli_print_commands();
        return CLI_OK;
    }
    if (strcmp(argv[1], "--version") == 0) {
        printf("vdbshade %s\n", vsh_version());
        return CLI_OK;
    }
    const cli_command *command = cli_command_find(argv[1]);
    if (command == NULL) {
        return unknown_command(argv[1]);
    }
    if (command != &cli_query) { /* which may write points there */
        cli_plain_output();
    }
    return command->main(argc - 1, argv + 1);
}

int main(int argc, char **argv) {
    const int served = vsh_reader_serve(argc, argv);
    if (served >= 0) {
        _exit(served); /* what it holds goes with it */
    }
    cli_self_close();
    cli_signals_begin();
    int code = dispatch(argc, argv);
    code = code == CLI_HELP ? CLI_OK : code;
    cli_progress_end();
    cli_warnings_tell();
    if ((fflush(stdout) != 0 || ferror(stdout)) && code == CLI_OK) {
        cli_say("standard output: cannot be written: %s", strerror(errno));
        code = CLI_FILE;
    }
    return code;
}
