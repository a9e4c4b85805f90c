/* Standard error: messages, kept warnings and progress. Standard output without control characters. */
#define _GNU_SOURCE /* fopencookie */
#include "base/clock.h"
#include "base/error.h"
#include "cli.h"

#include <ctype.h>
#include <errno.h>
#include <pthread.h>
#include <stdarg.h>
#include <sys/ioctl.h>
#include <unistd.h>

vsh_error cli_error;
vsh_run cli_run;
char cli_last_line[CLI_LINE];

/* --- the terminal */

/* Replaces control characters of ASCII and of UTF-8, but not newlines, by '?'. */
static void make_plain(char *text, size_t size) {
    unsigned char before = 0;
    for (size_t i = 0; i < size; ++i) {
        const unsigned char c = (unsigned char)text[i];
        if ((c < 0x20 && c != '\n') || c == 0x7f || (before == 0xc2 && c >= 0x80 && c < 0xa0)) {
            text[i] = '?';
            if (c >= 0x80) {
                text[i - 1] = '?';
            }
        }
        before = c;
    }
}

bool cli_has_escapes(void) {
    const char *term = getenv("TERM");
    return isatty(STDERR_FILENO) != 0 && term != NULL && strcmp(term, "dumb") != 0;
}

/* Returns the escape sequence if it may be used (https://no-color.org), else "". */
static const char *use_color(const char *sequence) {
    const char *no_color = getenv("NO_COLOR");
    return cli_has_escapes() && (no_color == NULL || no_color[0] == '\0') ? sequence : "";
}

/* Returns the smaller of the terminal's width and COLUMNS; 80 if neither is known. */
static int find_columns(void) {
    struct winsize window = {.ws_col = 0};
    const char *text = getenv("COLUMNS");
    const long given = text != NULL ? strtol(text, NULL, 10) : 0;
    ioctl(STDERR_FILENO, TIOCGWINSZ, &window);
    const int columns = window.ws_col > 0 ? window.ws_col : 80;
    return given > 0 && (given < columns || window.ws_col == 0) ? (int)given : columns;
}

/* --- progress */

/* Seconds between two lines of progress: a terminal overwrites its line, a log grows. */
static const double terminal_interval = 0.1;
static const double log_interval = 2.0;

/* The time left is shown after this much of a stage. */
static const double estimate_fraction = 0.02;
static const double estimate_seconds = 1.0;

enum { NAME = 32 };

static struct {
    pthread_mutex_t lock; /* protects this struct and standard error */
    bool shown;
    bool terminal;
    bool standing;    /* a line without its newline is on the terminal */
    char stage[NAME]; /* the last one reported */
    double began;     /* when it began, seconds */
    double skipped;   /* its fraction at that time */
    double last;      /* when something was written */
} progress = {.lock = PTHREAD_MUTEX_INITIALIZER};

void cli_begin_progress(bool shown) {
    progress.terminal = cli_has_escapes();
    progress.shown = shown && (cli_given.progress || progress.terminal);
    progress.stage[0] = '\0';
}

static void clear_line(void) {
    if (progress.standing) {
        fputs("\r\033[K", stderr);
        progress.standing = false;
    }
}

/* Writes a line. On a terminal the line is cut to the width, and has a bar if there is room. */
static void show_progress(double fraction, double now) {
    static const char full[] = "########################################";
    enum { WIDEST = sizeof full - 1, REST = 46 /* columns of the other text */ };
    char rest[32] = "", line[512];
    const double elapsed = now - progress.began, done = fraction - progress.skipped;
    if (elapsed >= estimate_seconds && done >= estimate_fraction && fraction < 1.0) {
        const double left = fmax(elapsed * (1.0 - fraction) / done, progress.terminal ? 1.0 : 0.0);
        snprintf(rest, sizeof rest, ", about %.0f %s left", left >= 100.0 ? left / 60.0 : left,
                 left >= 100.0 ? "min" : "s");
    }
    const int columns = progress.terminal ? find_columns() - 1 : (int)sizeof line;
    const int room = progress.terminal ? (int)fmin(fmax(columns - REST, 0.0), WIDEST) : 0;
    const int drawn = (int)(room * fmin(fmax(fraction, 0.0), 1.0));
    snprintf(line, sizeof line, "vdbshade: %s%.*s%*s%s%s %.0f %%%s", room > 0 ? "[" : "", drawn, full,
             room - drawn, "", room > 0 ? "] " : "", progress.stage, 100.0 * fraction, rest);
    clear_line();
    fprintf(stderr, "%.*s%s", columns, line, progress.terminal ? "" : "\n");
    fflush(stderr);
    progress.standing = progress.terminal;
    progress.last = now;
}

int32_t cli_report_progress(void *user, const char *name, double fraction) {
    (void)user;
    if (progress.shown) {
        pthread_mutex_lock(&progress.lock);
        const double now = vshi_seconds();
        const bool is_new = strncmp(progress.stage, name, NAME - 1) != 0;
        if (is_new) {
            snprintf(progress.stage, NAME, "%s", name);
            make_plain(progress.stage, strlen(progress.stage));
            progress.began = now;
            progress.skipped = fraction;
        }
        if (now - progress.last >= (progress.terminal ? terminal_interval : log_interval) ||
            (is_new && !progress.terminal)) {
            show_progress(fraction, now);
        }
        pthread_mutex_unlock(&progress.lock);
    }
    return cli_interrupted() ? 1 : 0;
}

void cli_end_progress(void) {
    pthread_mutex_lock(&progress.lock);
    clear_line();
    fflush(stderr);
    pthread_mutex_unlock(&progress.lock);
}

int cli_begin_writing(void) {
    return cli_report_progress(NULL, "write", 0.0) == 0 ? CLI_OK : cli_cancelled();
}

/* --- messages */

static void __attribute__((format(printf, 2, 0)))
say(const char *color, const char *format, va_list arguments) {
    char line[3 * 4096]; /* two paths and a text */
    vsnprintf(line, sizeof line, format, arguments);
    vshi_one_line(line);
    make_plain(line, strlen(line));
    snprintf(cli_last_line, sizeof cli_last_line, "%s", line);
    pthread_mutex_lock(&progress.lock);
    clear_line();
    fprintf(stderr, "%svdbshade: %s%s\n", color, line, color[0] != '\0' ? "\033[0m" : "");
    pthread_mutex_unlock(&progress.lock);
}

void cli_say(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    say(strncmp(format, "warning: ", strlen("warning: ")) == 0 ? use_color("\033[33m") : "", format,
        arguments);
    va_end(arguments);
}

int cli_refuse(int code, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    cli_print_warnings();
    say(use_color("\033[31m"), format, arguments);
    va_end(arguments);
    return code;
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

int cli_cancelled(void) {
    cli_print_warnings();
    cli_signals_tell();
    return CLI_INTERRUPTED;
}

int cli_check(vsh_result result) {
    return result == VSH_OK                ? CLI_OK
           : result == VSH_ERROR_CANCELLED ? cli_cancelled()
                                           : cli_refuse(code_of(result), "%s", cli_error.message);
}

/* Whether an existing file is named before one of the message's colons. */
static bool names_file(const char *message) {
    char name[sizeof cli_error.message];
    for (const char *colon = strchr(message, ':'); colon != NULL; colon = strchr(colon + 1, ':')) {
        snprintf(name, sizeof name, "%.*s", (int)(colon - message), message);
        if (access(name, F_OK) == 0) {
            return true;
        }
    }
    return false;
}

int cli_fail_with(const char *path) {
    const vsh_result code = cli_error.code;
    path = path != NULL ? path : cli_parsed.input;
    const bool of_values =
        code == VSH_ERROR_INPUT || code == VSH_ERROR_LIMIT || code == VSH_ERROR_UNSUPPORTED ||
        strncmp(cli_error.message, "casters[", strlen("casters[")) == 0 || /* a place in a scene file */
        (code == VSH_ERROR_READ && path != NULL && cli_has_ending(path, "json"));
    return path != NULL && of_values && !names_file(cli_error.message)
               ? cli_refuse(code_of(code), "%s: %s", path, cli_error.message)
               : cli_check(code);
}

int cli_check_input(vsh_result result) {
    return result == VSH_OK ? CLI_OK : cli_fail_with(NULL);
}

/* --- warnings
 *
 * Two warnings are of one kind if they differ only in files, quoted names and numbers. So neither the
 * library nor its reader process has to number its warnings. docs/warnings.md lists them. */

enum { KINDS = 64 }; /* warnings of further kinds are printed at once */

typedef struct warning_kind {
    char shape[CLI_LINE]; /* the words, without what differs */
    char text[CLI_LINE];  /* the worst warning */
    double number;        /* its first number: the larger, the worse */
    size_t count;
} warning_kind;

static struct {
    pthread_mutex_t lock;
    warning_kind kinds[KINDS];
    size_t count;
} warnings = {.lock = PTHREAD_MUTEX_INITIALIZER};

/* Skips the file that a warning begins with: "level.glb: …". */
static const char *skip_file(const char *message) {
    const char *colon = strstr(message, ": ");
    const size_t length = colon != NULL ? (size_t)(colon - message) : 0;
    const bool file = length > 0 && memchr(message, '\'', length) == NULL &&
                      (memchr(message, '.', length) != NULL || memchr(message, '/', length) != NULL);
    return file ? colon + 2 : message;
}

/* Reduces a warning to its words: names become '', numbers #, and a plural loses its s. Returns the first
 * number, or 0. Numbers in brackets ("mesh 'sail' (3 of 9)") do not count. */
static double find_shape(const char *message, char shape[CLI_LINE]) {
    size_t length = 0;
    double number = 0.0;
    bool found = false, brackets = false;
    const char *c = skip_file(message);
    for (char before = ' '; *c != '\0' && length + 1 < CLI_LINE; before = c[-1]) {
        char kept = *c++;
        if (kept == '\'' && !isalnum((unsigned char)before)) {
            const char *end = c;
            while (*end != '\0' && (*end != '\'' || isalnum((unsigned char)end[1]))) {
                ++end; /* an apostrophe within a name is followed by a letter */
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
    char shape[CLI_LINE];
    const double number = find_shape(message, shape);
    size_t i = 0;
    while (i < warnings.count && strcmp(warnings.kinds[i].shape, shape) != 0) {
        ++i;
    }
    if (i == KINDS) {
        return false;
    }
    warning_kind *kind = &warnings.kinds[i];
    if (i == warnings.count) {
        *kind = (warning_kind){.number = -1.0};
        memcpy(kind->shape, shape, sizeof shape);
        ++warnings.count;
    }
    if (number > kind->number) {
        kind->number = number;
        snprintf(kind->text, sizeof kind->text, "%s", message);
    }
    ++kind->count;
    return true;
}

/* Keeps a warning such as "file.glb: mesh 'sail': 4 open edges: …". A vsh_warning_fn. */
static void add_warning(void *user, const char *message) {
    (void)user;
    if (cli_given.quiet) {
        return;
    }
    pthread_mutex_lock(&warnings.lock);
    const bool kept = !cli_given.verbose && keep(message);
    pthread_mutex_unlock(&warnings.lock);
    if (!kept) { /* notes begin with "note: " */
        cli_say(strncmp(message, "note: ", 6) == 0 ? "%s" : "warning: %s", message);
    }
}

void cli_warn(const char *format, ...) {
    char line[CLI_LINE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    add_warning(NULL, line);
}

void cli_print_warnings(void) {
    for (size_t i = 0; i < warnings.count; ++i) {
        const warning_kind *kind = &warnings.kinds[i];
        if (kind->count == 1) {
            cli_say("warning: %s", kind->text);
        } else {
            cli_say("warning: %zu times, the worst: %s; --verbose lists all", kind->count, kind->text);
        }
    }
    warnings.count = 0;
}

void cli_complete_run(void) {
    cli_run.reader = cli_given.sandbox == CLI_SANDBOX_OFF ? NULL : VSH_READER;
    cli_run.confined = cli_given.sandbox == CLI_SANDBOX_REQUIRE;
    cli_run.allow_outside = cli_given.allow_outside;
    cli_run.progress = cli_report_progress;
    cli_run.warning = add_warning;
    cli_run.notes = cli_given.verbose;
}

/* --- standard output */

/* A cookie_write_function_t: writes all, or returns 0 with errno. A character of UTF-8 may have begun in the
 * text before, so the last byte of that text is checked again. */
static ssize_t write_plain(void *last, const char *text, size_t size) {
    char *before = last, *plain = malloc(size + 1);
    cli_end_progress(); /* both may be the same terminal */
    plain[0] = *before;
    memcpy(plain + 1, text, size);
    *before = plain[size];
    make_plain(plain, size + 1);
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
    FILE *plain = is_plain ? NULL : fopencookie(&before, "w", (cookie_io_functions_t){.write = write_plain});
    if (plain != NULL) {
        setvbuf(plain, NULL, isatty(STDOUT_FILENO) ? _IOLBF : _IOFBF, BUFSIZ);
        stdout = plain;
        is_plain = true;
    }
}
