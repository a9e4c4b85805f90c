#include "message.h"

#include "paths.h"
#include "plain.h"
#include "progress.h"
#include "signals.h"
#include "warnings.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const char *input;

static const struct {
    vsh_result result;
    int code;
} exit_codes[] = {
    {VSH_OK, CLI_OK},
    {VSH_ERROR_ARGUMENT, CLI_USAGE},
    {VSH_ERROR_INPUT, CLI_USAGE},
    {VSH_ERROR_UNSUPPORTED, CLI_USAGE},
    {VSH_ERROR_READ, CLI_FILE},
    {VSH_ERROR_WRITE, CLI_FILE},
    {VSH_ERROR_LIMIT, CLI_LIMIT},
    {VSH_ERROR_MEMORY, CLI_LIMIT},
    {VSH_ERROR_CANCELLED, CLI_INTERRUPTED},
    {VSH_ERROR_INTERNAL, CLI_DEFECT},
};

static void __attribute__((format(printf, 1, 0))) say(const char *format, va_list arguments) {
    char line[3 * 4096]; /* two paths and what is said of them */
    vsnprintf(line, sizeof line, format, arguments);
    for (char *c = line; (c = strchr(c, '\n')) != NULL;) {
        *c = '?';
    }
    cli_plain(line, strlen(line));
    cli_progress_line(line);
}

void cli_say(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(format, arguments);
    va_end(arguments);
}

int cli_usage(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    cli_warnings_tell();
    say(format, arguments);
    va_end(arguments);
    return CLI_USAGE;
}

static int code_of(vsh_result result) {
    for (size_t i = 0; i < sizeof exit_codes / sizeof exit_codes[0]; ++i) {
        if (exit_codes[i].result == result) {
            return exit_codes[i].code;
        }
    }
    return CLI_DEFECT;
}

int cli_fail(const vsh_error *error) {
    cli_warnings_tell();
    if (error->code == VSH_ERROR_CANCELLED) {
        cli_signals_tell();
        return CLI_INTERRUPTED;
    }
    cli_say("%s", error->message);
    return code_of(error->code);
}

void cli_message_input(const char *path) {
    input = path;
}

/* Whether a file is there of the name that stands before one of a message's colons. */
static bool names_file(const char *message) {
    char name[sizeof((vsh_error *)NULL)->message];
    for (const char *colon = strchr(message, ':'); colon != NULL; colon = strchr(colon + 1, ':')) {
        snprintf(name, sizeof name, "%.*s", (int)(colon - message), message);
        if (access(name, F_OK) == 0) {
            return true;
        }
    }
    return false;
}

int cli_fail_of(const char *path, const vsh_error *error) {
    const bool of_caster =
        strncmp(error->message, "casters[", strlen("casters[")) == 0; /* of a scene's file */
    const bool of_values = error->code == VSH_ERROR_INPUT || error->code == VSH_ERROR_LIMIT ||
                           error->code == VSH_ERROR_UNSUPPORTED;
    const char *of = path != NULL ? path : input;
    const bool of_scene = error->code == VSH_ERROR_READ && of != NULL && cli_has_ending(of, "json");
    if ((!of_values && !of_caster && !of_scene) || of == NULL || names_file(error->message)) {
        return cli_fail(error);
    }
    cli_warnings_tell();
    cli_say("%s: %s", of, error->message);
    return code_of(error->code);
}

int cli_out_of_memory(const char *what) {
    cli_warnings_tell();
    cli_say("%s: the system refused memory", what);
    return CLI_LIMIT;
}
