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
    WORST = 3,   /* examples that the line of a kind names */
    KINDS = 64,  /* warnings of further kinds are printed at once */
    TEXT = 1024, /* bytes of a warning */
    NAME = 100   /* bytes of an example's name */
};

typedef struct example {
    char name[NAME]; /* a mesh or file; "" if the warning names none */
    double number;   /* the first that it gives: the larger, the worse */
    bool numbered;
} example;

typedef struct kind {
    char shape[TEXT]; /* the words, without what differs */
    char text[TEXT];  /* of the worst */
    size_t count;
    bool objects;         /* all are about meshes */
    example worst[WORST]; /* of two with the same number the earlier goes first */
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

/* Keeps the first quoted name as the example's. Returns the end of the quotation at `c`. */
static const char *take_name(const char *message, const char *c, example *about, bool *object) {
    const char *end = c + 1;
    while (*end != '\0' && !closes(end)) {
        ++end;
    }
    if (*end == '\0') {
        return c;
    }
    if (about->name[0] == '\0') {
        snprintf(about->name, sizeof about->name, "%.*s", (int)(end - c - 1), c + 1);
        *object = c - message >= 5 && strncmp(c - 5, "mesh ", 5) == 0;
        *object = *object || (c - message >= 7 && strncmp(c - 7, "object ", 7) == 0);
    }
    return end;
}

/* The words of a warning: names become '', numbers #, and the s that a plural ends in goes. A number in
 * brackets ("mesh 'sail' (3 of 9)") is none that tells how bad it is. */
static void examine(const char *message, char shape[TEXT], example *about, bool *object) {
    size_t length = 0;
    bool found = false, brackets = false;
    *object = false;
    const char *c = behind_file(message);
    const char *const first = c;
    while (*c != '\0' && length + 2 < TEXT) {
        const char before = c > first ? c[-1] : ' ';
        if (*c == '\'' && !isalnum((unsigned char)before)) {
            c = take_name(message, c, about, object);
            shape[length++] = '\'';
            c += *c == '\'';
        } else if (isdigit((unsigned char)*c)) {
            char *end;
            const double value = strtod(c, &end);
            about->number = found || brackets ? about->number : value;
            found = found || !brackets;
            shape[length++] = '#';
            c = end;
        } else if (*c == 's' && isalpha((unsigned char)before) && !isalpha((unsigned char)c[1])) {
            ++c;
        } else {
            brackets = *c == '(' || (brackets && *c != ')');
            shape[length++] = *c++;
        }
    }
    shape[length] = '\0';
    about->numbered = found;
    if (about->name[0] == '\0' && first > message) {
        snprintf(about->name, sizeof about->name, "%.*s", (int)(first - message - 2), message);
    }
}

/* Finds the kind of a shape, or adds it; NULL if there are too many. */
static kind *find_kind(const char *shape) {
    for (size_t i = 0; i < state.count; ++i) {
        if (strcmp(state.kinds[i].shape, shape) == 0) {
            return &state.kinds[i];
        }
    }
    if (state.count == KINDS) {
        return NULL;
    }
    kind *fresh = &state.kinds[state.count++];
    *fresh = (kind){.objects = true};
    snprintf(fresh->shape, sizeof fresh->shape, "%s", shape);
    return fresh;
}

static void keep(kind *of, const char *message, const example *about) {
    size_t at = of->count < WORST ? of->count : WORST;
    for (; at > 0 && about->number > of->worst[at - 1].number; --at) {
        if (at < WORST) {
            of->worst[at] = of->worst[at - 1];
        }
    }
    if (at < WORST) {
        of->worst[at] = *about;
    }
    if (at == 0) {
        snprintf(of->text, sizeof of->text, "%s", message);
    }
    ++of->count;
}

void cli_warnings_parse(void *user, const char *message) {
    (void)user;
    if (state.quiet) {
        return;
    }
    pthread_mutex_lock(&state.lock);
    kind *of = NULL;
    if (state.keep) {
        example about = {.numbered = false};
        char shape[TEXT];
        bool object;
        examine(message, shape, &about, &object);
        of = find_kind(shape);
        if (of != NULL) {
            of->objects = of->objects && object;
            keep(of, message, &about);
        }
    }
    pthread_mutex_unlock(&state.lock);
    if (of == NULL) { /* notes name themselves */
        cli_say("%s%s", strncmp(message, "note: ", 6) == 0 ? "" : "warning: ", message);
    }
}

/* "7 objects, the worst: <its text>; then 'b' (12), 'c' (3); --verbose lists all". */
static void say_kind(const kind *of) {
    if (of->count == 1) {
        cli_say("warning: %s", of->text);
        return;
    }
    char *then;
    size_t size;
    FILE *out = open_memstream(&then, &size);
    for (size_t i = 1; i < WORST && i < of->count; ++i) {
        const example *one = &of->worst[i];
        if (one->name[0] != '\0') {
            fprintf(out, "%s'%s'", ftell(out) > 0 ? ", " : "; then ", one->name);
            if (one->numbered) {
                fprintf(out, " (%g)", one->number);
            }
        }
    }
    fclose(out);
    cli_say("warning: %zu %s: %s%s; --verbose lists all", of->count, of->objects ? "objects" : "times",
            of->text, then);
    free(then);
}

void cli_warnings_tell(void) {
    for (size_t i = 0; i < state.count; ++i) {
        say_kind(&state.kinds[i]);
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
