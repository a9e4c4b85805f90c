/* vdbshade: the command line. Which subcommand, and the exit code. */
#include "commands.h"
#include "message.h"
#include "progress.h"
#include "signals.h"
#include "warnings.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <vdbshade/reader.h>

static int unknown_command(const char *text) {
    if (text[0] == '-') {
        return cli_usage("%s: no such option; see 'vdbshade --help'", text);
    }
    const char *near = cli_nearest_topic(text, false);
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
    const cli_command_row *row = cli_find_command(argv[1]);
    if (row == NULL) {
        return unknown_command(argv[1]);
    }
    if (row->command != &cli_query) { /* which may write points there */
        cli_plain_output();
    }
    return row->command->main(argc - 1, argv + 1);
}

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#endif

/* Sanitizers look into their own process by way of another. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

/* A reader that a file has taken over is kept by Landlock from the memory and environment of other processes.
 * Where the kernel has no Landlock, this process closes its own before any file is read. That shuts debuggers
 * and core files out, too, so it is not done elsewhere. */
static void close_own_memory(void) {
    enum { ASK_VERSION = 1 };
    if (!SANITIZED && syscall(SYS_landlock_create_ruleset, NULL, 0, ASK_VERSION) < 1) {
        prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
    }
}

int main(int argc, char **argv) {
    const int served = vsh_reader_serve(argc, argv);
    if (served >= 0) {
        _exit(served); /* what it holds goes with it */
    }
    close_own_memory();
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
