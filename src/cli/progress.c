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

/* The clock goes on when a stage is interrupted by short ones: the next lightmap's tiles go on with "bake".
 */
enum { STAGES = 16, NAME = 32 };
typedef struct stage_clock {
    char name[NAME];
    double began, fraction;
} stage_clock;

static struct {
    pthread_mutex_t lock; /* around everything here and around standard error */
    bool shown;
    bool terminal;
    bool standing; /* a line without its newline is on the terminal */
    stage_clock stages[STAGES];
    stage_clock *stage; /* the last one reported */
    double last;        /* when something was written */
} state = {.lock = PTHREAD_MUTEX_INITIALIZER};

void cli_progress_begin(bool wanted, bool quiet) {
    state.terminal = isatty(STDERR_FILENO) != 0;
    state.shown = !quiet && (wanted || state.terminal);
    memset(state.stages, 0, sizeof state.stages);
    state.stage = NULL;
}

static void clear_line(void) {
    if (state.standing) {
        fputs("\r\033[K", stderr);
        state.standing = false;
    }
}

/* Finds the clock of a stage, which starts again if the fraction falls. */
static stage_clock *find_stage(const char *name, double fraction, double now) {
    int i = 0;
    while (i < STAGES - 1 && state.stages[i].name[0] != '\0' &&
           strncmp(state.stages[i].name, name, NAME - 1) != 0) {
        ++i;
    }
    stage_clock *stage = &state.stages[i];
    if (strncmp(stage->name, name, NAME - 1) != 0 || fraction < stage->fraction) {
        snprintf(stage->name, NAME, "%s", name);
        stage->began = now;
    }
    stage->fraction = fraction;
    return stage;
}

static void show(const stage_clock *stage, double now) {
    char rest[32] = "";
    const double elapsed = now - stage->began;
    if (elapsed >= estimate_seconds && stage->fraction >= estimate_fraction && stage->fraction < 1.0) {
        const double left = elapsed * (1.0 - stage->fraction) / stage->fraction;
        snprintf(rest, sizeof rest, ", about %.0f %s left", left >= 100.0 ? left / 60.0 : left,
                 left >= 100.0 ? "min" : "s");
    }
    clear_line();
    fprintf(stderr, "vdbshade: %s %.0f %%%s", stage->name, 100.0 * stage->fraction, rest);
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
        const stage_clock *before = state.stage;
        state.stage = find_stage(name, fraction, now);
        if (now - state.last >= (state.terminal ? terminal_interval : log_interval) ||
            (state.stage != before && !state.terminal)) {
            show(state.stage, now);
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
