/* Two warnings are of a kind where their words are the same, and only files, quoted names and numbers differ.
 * So neither the library nor its readers in processes of their own have to number kinds, and a new one cannot
 * be forgotten. docs/warnings.md lists them. */
#include "warnings.h"

#include "message.h"

#include <ctype.h>
#include <pthread.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    KINDS = 64, /* warnings of further kinds are printed at once */
    TEXT = 1024 /* bytes of a warning */
};

typedef struct kind {
    char shape[TEXT]; /* the words, without what differs */
    char text[TEXT];  /* of the worst */
    double number;    /* the first that it gives: the larger, the worse */
    size_t count;
} kind;

static struct {
    pthread_mutex_t lock;
    kind kinds[KINDS];
    size_t count;
    bool keep, quiet;
} state = {.lock = PTHREAD_MUTEX_INITIALIZER};

void cli_warnings_begin(bool all, bool quiet) {
    state.keep = !all;
    state.quiet = quiet;
}

/* Whether a name's quotation ends here, which one with an apostrophe in it does not there. */
static bool closes(const char *c) {
    return *c == '\'' && !isalnum((unsigned char)c[1]);
}

/* Behind the file that a warning begins with: "level.glb: …". */
static const char *behind_file(const char *message) {
    const char *colon = strstr(message, ": ");
    const size_t length = colon != NULL ? (size_t)(colon - message) : 0;
    const bool file = length > 0 && memchr(message, '\'', length) == NULL &&
                      (memchr(message, '.', length) != NULL || memchr(message, '/', length) != NULL);
    return file ? colon + 2 : message;
}

/* The words of a warning: names become '', numbers #, and the s that a plural ends in goes. Returns the first
 * number, or 0. A number in brackets ("mesh 'sail' (3 of 9)") does not tell how bad the warning is. */
static double examine(const char *message, char shape[TEXT]) {
    size_t length = 0;
    double number = 0.0;
    bool found = false, brackets = false;
    const char *c = behind_file(message);
    for (char before = ' '; *c != '\0' && length + 1 < TEXT; before = c[-1]) {
        char kept = *c++;
        if (kept == '\'' && !isalnum((unsigned char)before)) {
            const char *end = c;
            while (*end != '\0' && !closes(end)) {
                ++end;
            }
            c = *end != '\0' ? end + 1 : c;
        } else if (isdigit((unsigned char)kept)) {
            char *end;
            const double value = strtod(c - 1, &end);
            number = found || brackets ? number : value;
            found = found || !brackets;
            kept = '#';
            c = end;
        } else if (kept == 's' && isalpha((unsigned char)before) && !isalpha((unsigned char)*c)) {
            continue;
        } else {
            brackets = kept == '(' || (brackets && kept != ')');
        }
        shape[length++] = kept;
    }
    shape[length] = '\0';
    return number;
}

/* Counts a warning in its kind; false if there are too many kinds. */
static bool keep(const char *message) {
    char shape[TEXT];
    const double number = examine(message, shape);
    size_t i = 0;
    while (i < state.count && strcmp(state.kinds[i].shape, shape) != 0) {
        ++i;
    }
    if (i == KINDS) {
        return false;
    }
    kind *of = &state.kinds[i];
    if (i == state.count) {
        *of = (kind){.number = -1.0};
        memcpy(of->shape, shape, sizeof shape);
        ++state.count;
    }
    if (number > of->number) {
        of->number = number;
        snprintf(of->text, sizeof of->text, "%s", message);
    }
    ++of->count;
    return true;
}

void cli_warnings_parse(void *user, const char *message) {
    (void)user;
    if (state.quiet) {
        return;
    }
    pthread_mutex_lock(&state.lock);
    const bool kept = state.keep && keep(message);
    pthread_mutex_unlock(&state.lock);
    if (!kept) { /* notes name themselves */
        cli_say("%s%s", strncmp(message, "note: ", 6) == 0 ? "" : "warning: ", message);
    }
}

void cli_warnings_tell(void) {
    for (size_t i = 0; i < state.count; ++i) {
        const kind *of = &state.kinds[i];
        if (of->count == 1) {
            cli_say("warning: %s", of->text);
        } else {
            cli_say("warning: %zu times, the worst: %s; --verbose lists all", of->count, of->text);
        }
    }
    state.count = 0;
}

void cli_warn(const char *format, ...) {
    char line[TEXT];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    cli_warnings_parse(NULL, line);
}
