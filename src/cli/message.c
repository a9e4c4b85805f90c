#define _GNU_SOURCE /* fopencookie */
#include "message.h"

#include "base/error.h"
#include "paths.h"
#include "progress.h"
#include "signals.h"
#include "warnings.h"

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *input;
static char last_line[1024];

const char *cli_last_message(void) {
    return last_line;
}

void cli_keep_message(const char *line) {
    snprintf(last_line, sizeof last_line, "%s", line);
}

static void __attribute__((format(printf, 1, 0))) say(const char *format, va_list arguments) {
    char line[3 * 4096]; /* two paths and what is said of them */
    vsnprintf(line, sizeof line, format, arguments);
    vshi_one_line(line);
    cli_plain(line, strlen(line));
    cli_keep_message(line);
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
    switch (result) {
    case VSH_OK:
        return CLI_OK;
    case VSH_ERROR_ARGUMENT:
    case VSH_ERROR_INPUT:
    case VSH_ERROR_UNSUPPORTED:
        return CLI_USAGE;
    case VSH_ERROR_READ:
    case VSH_ERROR_WRITE:
        return CLI_FILE;
    case VSH_ERROR_LIMIT:
    case VSH_ERROR_MEMORY:
        return CLI_LIMIT;
    case VSH_ERROR_CANCELLED:
        return CLI_INTERRUPTED;
    default:
        return CLI_DEFECT;
    }
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

int cli_check(vsh_result result, const vsh_error *error) {
    return result == VSH_OK ? CLI_OK : cli_fail(error);
}

int cli_check_result(vsh_result result, const vsh_error *error) {
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, error);
}

int cli_begin_writing(void) {
    const vsh_error cancelled = {VSH_ERROR_CANCELLED, "write: cancelled"};
    return cli_progress_report(NULL, "write", 0.0) == 0 ? CLI_OK : cli_fail(&cancelled);
}

/* --- text for terminals */

static bool is_control(unsigned char before, unsigned char c) {
    return (c < 0x20 && c != '\n') || c == 0x7f || (before == 0xc2 && c >= 0x80 && c < 0xa0);
}

void cli_plain(char *text, size_t size) {
    unsigned char before = 0;
    for (size_t i = 0; i < size; ++i) {
        const unsigned char c = (unsigned char)text[i];
        if (is_control(before, c)) {
            text[i] = '?';
            if (c >= 0x80) {
                text[i - 1] = '?';
            }
        }
        before = c;
    }
}

/* A cookie_write_function_t: all of it, or 0 with errno. A character that the text before began goes on here,
 * so its last byte is looked at again. */
static ssize_t write_plain(void *last, const char *text, size_t size) {
    char *before = last, *plain = malloc(size + 1);
    plain[0] = *before;
    memcpy(plain + 1, text, size);
    *before = plain[size];
    cli_plain(plain, size + 1);
    size_t done = 0;
    while (done < size) {
        const ssize_t got = write(STDOUT_FILENO, plain + 1 + done, size - done);
        if (got < 0 && errno != EINTR) {
            break;
        }
        done += got > 0 ? (size_t)got : 0;
    }
    free(plain);
    return done == size ? (ssize_t)size : 0;
}

void cli_plain_output(void) {
    static char before;
    static bool is_plain;
    if (is_plain) {
        return;
    }
    FILE *plain = fopencookie(&before, "w", (cookie_io_functions_t){.write = write_plain});
    if (plain != NULL) {
        setvbuf(plain, NULL, isatty(STDOUT_FILENO) ? _IOLBF : _IOFBF, BUFSIZ);
        stdout = plain;
        is_plain = true;
    }
}

int cli_text_characters(const char *text, size_t length) {
    int count = 0;
    for (size_t i = 0; i < length; ++i) {
        count += ((unsigned char)text[i] & 0xc0) != 0x80;
    }
    return count;
}

void cli_text_add(cli_text *text, const char *words) {
    static const char blanks[] = " \n";
    for (words += strspn(words, blanks); *words != '\0'; words += strspn(words, blanks)) {
        const size_t length = strcspn(words, blanks);
        const int wide = cli_text_characters(words, length);
        if (text->column > 0 && text->column + 1 + wide > text->width) {
            cli_text_end(text);
        }
        const int first = text->column == 0;
        if (first) {
            fprintf(text->out, "%*s", text->lead, "");
            text->lead = text->indent;
        } else {
            fputc(' ', text->out);
        }
        if (text->put != NULL) {
            text->put(text->out, words, (int)length, first);
        } else {
            fwrite(words, 1, length, text->out);
        }
        text->column += wide + !first;
        words += length;
    }
}

void cli_text_end(cli_text *text) {
    if (text->column > 0) {
        fputc('\n', text->out);
    }
    text->column = 0;
}
