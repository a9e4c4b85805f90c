#include "progress.h"

#include "base/clock.h"
#include "estimate.h"
#include "message.h"
#include "signals.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Seconds between two lines of progress: a terminal overwrites its line, a log grows. */
static const double terminal_interval = 0.1;
static const double log_interval = 2.0;

/* The time left is left out before this much is known. */
static const double estimate_fraction = 0.02;
static const double estimate_seconds = 0.5;

static struct {
    pthread_mutex_t lock; /* around everything here and around standard error */
    bool shown;
    bool terminal;
    bool standing; /* a line without its newline is on the terminal */
    cli_estimate estimate;
    double last; /* when something was written */
} state = {.lock = PTHREAD_MUTEX_INITIALIZER};

void cli_progress_begin(bool wanted, bool quiet) {
    state.terminal = isatty(STDERR_FILENO) != 0;
    state.shown = !quiet && (wanted || state.terminal);
    cli_estimate_begin(&state.estimate, vshi_seconds());
}

void cli_progress_expect(const char *stage, int kind, double seconds) {
    pthread_mutex_lock(&state.lock);
    cli_estimate_expect(&state.estimate, stage, kind, seconds);
    pthread_mutex_unlock(&state.lock);
}

static void clear_line(void) {
    if (state.standing) {
        fputs("\r\033[K", stderr);
        state.standing = false;
    }
}

/* Seconds left of the whole command or, where nobody knows its stages, of the one under way; below 0: not
 * known yet. */
static double left_at(double now) {
    const cli_estimate *e = &state.estimate;
    const double left = cli_estimate_left(e, now), elapsed = now - (left >= 0.0 ? e->first : e->began);
    if (elapsed < estimate_seconds ||
        (left < 0.0 && !(e->fraction >= estimate_fraction && e->fraction < 1.0))) {
        return -1.0;
    }
    return left >= 0.0 ? left : elapsed * (1.0 - e->fraction) / e->fraction;
}

static void show(double now) {
    char rest[32] = "";
    cli_estimate *e = &state.estimate;
    const double left = left_at(now), percent = 100.0 * cli_estimate_share(e, now);
    if (left >= 100.0) {
        snprintf(rest, sizeof rest, ", about %.0f min left", left / 60.0);
    } else if (left >= 0.0) {
        snprintf(rest, sizeof rest, ", about %.0f s left", left);
    }
    clear_line();
    if (e->count > 0) {
        fprintf(stderr, "vdbshade: %s (%.0f %% of all)%s", e->name, percent, rest);
    } else {
        fprintf(stderr, "vdbshade: %s %.0f %%%s", e->name, percent, rest);
    }
    if (state.terminal) {
        state.standing = true;
        fflush(stderr);
    } else {
        fputc('\n', stderr);
    }
    state.last = now;
}

int32_t cli_progress_report(void *user, const char *stage, double fraction) {
    (void)user;
    if (state.shown) {
        pthread_mutex_lock(&state.lock);
        const double now = vshi_seconds();
        const bool fresh = strncmp(state.estimate.name, stage, sizeof state.estimate.name - 1) != 0;
        cli_estimate_report(&state.estimate, stage, fraction, now);
        if (now - state.last >= (state.terminal ? terminal_interval : log_interval) ||
            (fresh && !state.terminal)) {
            show(now);
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
