/* What the program says on standard error, and the exit code that goes with it. */
#ifndef CLI_MESSAGE_H
#define CLI_MESSAGE_H

#include <stddef.h>
#include <stdio.h>
#include <vdbshade/base.h>

enum {
    CLI_HELP = -1, /* the help was printed, and nothing is left to do */
    CLI_OK = 0,
    CLI_UNLIKE = 1, /* a comparison did not hold */
    CLI_USAGE = 2,
    CLI_FILE = 3,
    CLI_LIMIT = 4,
    CLI_DEFECT = 70, /* EX_SOFTWARE of sysexits.h */
    CLI_INTERRUPTED = 130
};

/* "vdbshade: …" as one line: control characters become '?'. */
void cli_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The last line that was printed so, or by a child, without "vdbshade: "; "" at first. */
const char *cli_last_message(void);
void cli_keep_message(const char *line);

/* As cli_say(), and returns CLI_USAGE. This and the next tell the warnings that were kept before. */
int cli_usage(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Says what failed and returns the exit code of its result. */
int cli_fail(const vsh_error *error);

/* The same of what the library made of a file's contents, which may have told it no name: a message that
 * begins with none of a file that is there begins with `path`, or (NULL) the command's first operand. */
int cli_fail_of(const char *path, const vsh_error *error);

/* CLI_OK of VSH_OK; else as cli_fail(), or as cli_fail_of() without a path. */
int cli_check(vsh_result result, const vsh_error *error);
int cli_check_result(vsh_result result, const vsh_error *error);

/* What that operand is; it must live on. */
void cli_message_input(const char *path);

/* Shows that the output is being written. CLI_OK, or CLI_INTERRUPTED after saying so. */
int cli_begin_writing(void);

/* Text for terminals: names come from files, and terminals obey control characters. Those but newlines become
 * '?': those of ASCII, and those that UTF-8 has of its own. */
void cli_plain(char *text, size_t size);

/* From here on standard output is text, and goes through cli_plain(). */
void cli_plain_output(void);

/* Running text, broken into lines at blanks. */
typedef struct cli_text {
    FILE *out;
    int width;                                                       /* characters a line, if words allow */
    int lead;                                                        /* blanks before the first line */
    int indent;                                                      /* blanks before each later line */
    void (*put)(FILE *out, const char *word, int length, int first); /* NULL: as it is; first of a line */
    int column;                                                      /* 0 to begin with */
} cli_text;

/* Counts the characters of UTF-8 text. */
int cli_text_characters(const char *text, size_t length);

/* Adds words that blanks or newlines part. */
void cli_text_add(cli_text *text, const char *words);

/* Ends the line, where one was begun. */
void cli_text_end(cli_text *text);

/* --- early returns of functions that return an exit code, as in base/error.h */

/* Returns what a call came to, unless that is CLI_OK. */
#define CLI_TRY(call)                                                                                        \
    do {                                                                                                     \
        const int tried = (call);                                                                            \
        if (tried != CLI_OK) {                                                                               \
            return tried;                                                                                    \
        }                                                                                                    \
    } while (0)

/* Puts what a call came to into `code` and, unless that is CLI_OK, goes to the label `done`. */
#define CLI_TRY_DONE(call)                                                                                   \
    do {                                                                                                     \
        code = (call);                                                                                       \
        if (code != CLI_OK) {                                                                                \
            goto done;                                                                                       \
        }                                                                                                    \
    } while (0)

#endif
