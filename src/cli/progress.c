#include "progress.h"

#include "base/clock.h"
#include "message.h"
#include "signals.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Seconds between two lines of progress: a terminal overwrites its line, a log grows. */
static const double terminal_interval = 0.1;
static const double log_interval = 2.0;

/* The time left is shown after this much of a stage. */
static const double estimate_fraction = 0.02;
static const double estimate_seconds = 0.5;

enum { NAME = 32 };

static struct {
    pthread_mutex_t lock; /* around everything here and around standard error */
    bool shown;
    bool terminal;
    bool standing;    /* a line without its newline is on the terminal */
    char stage[NAME]; /* the last one reported */
    double began;     /* when it began, seconds */
    double skipped;   /* its fraction then */
    double last;      /* when something was written */
} state = {.lock = PTHREAD_MUTEX_INITIALIZER};

void cli_progress_begin(bool wanted, bool quiet) {
    state.terminal = isatty(STDERR_FILENO) != 0;
    state.shown = !quiet && (wanted || state.terminal);
    state.stage[0] = '\0';
}

static void clear_line(void) {
    if (state.standing) {
        fputs("\r\033[K", stderr);
        state.standing = false;
    }
}

static void show(double fraction, double now) {
    char rest[32] = "";
    const double elapsed = now - state.began, done = fraction - state.skipped;
    if (elapsed >= estimate_seconds && done >= estimate_fraction && fraction < 1.0) {
        const double left = elapsed * (1.0 - fraction) / done;
        snprintf(rest, sizeof rest, ", about %.0f %s left", left >= 100.0 ? left / 60.0 : left,
                 left >= 100.0 ? "min" : "s");
    }
    clear_line();
    fprintf(stderr, "vdbshade: %s %.0f %%%s", state.stage, 100.0 * fraction, rest);
    if (state.terminal) {
        state.standing = true;
        fflush(stderr);
    } else {
        fputc('\n', stderr);
    }
    state.last = now;
}

int32_t cli_progress_report(void *user, const char *name, double fraction) {
    (void)user;
    if (state.shown) {
        pthread_mutex_lock(&state.lock);
        const double now = vshi_seconds();
        const bool is_new = strncmp(state.stage, name, NAME - 1) != 0;
        if (is_new) {
            snprintf(state.stage, NAME, "%s", name);
            state.began = now;
            state.skipped = fraction;
        }
        if (now - state.last >= (state.terminal ? terminal_interval : log_interval) ||
            (is_new && !state.terminal)) {
            show(fraction, now);
        }
        pthread_mutex_unlock(&state.lock);
    }
    return cli_interrupted() ? 1 : 0;
}

void cli_progress_line(const char *line) {
    pthread_mutex_lock(&state.lock);
    clear_line();
    fprintf(stderr, "vdbshade: %s\n", line);
    pthread_mutex_unlock(&state.lock);
}

void cli_progress_end(void) {
    pthread_mutex_lock(&state.lock);
    clear_line();
    fflush(stderr);
    pthread_mutex_unlock(&state.lock);
}
