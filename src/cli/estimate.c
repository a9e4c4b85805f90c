#include "estimate.h"

#include <stdio.h>
#include <string.h>

/* An expectation counts as much as so many seconds of measurement: less than a fifth of a second tells little
 * of how fast the rest is. */
static const double TRUST = 0.2;
/* Of a kind against all kinds together. */
static const double KIND_TRUST = 0.1;
/* How wrong expectations may be, as a factor either way. */
static const double MOST_WRONG = 30.0;
/* The own pace of a stage is what counts from this part of it on, and little much before it: blocks that are
 * done first are not like the others. */
static const double PACE_KNOWN = 0.7;
/* A stage whose beginning is told again has begun again. */
static const double AGAIN = 0.5;

void cli_estimate_begin(cli_estimate *e, double now) {
    memset(e, 0, sizeof *e);
    e->current = -1;
    e->first = now;
    e->began = now;
}

static bool is_same(const char *a, const char *b) {
    return strncmp(a, b, CLI_ESTIMATE_NAME - 1) == 0;
}

/* Whether a stage of that name was over before it was expected, and has not been asked for: what it took. */
static bool take_past(cli_estimate *e, const char *name, double *took) {
    for (int i = 0; i < e->past_count; ++i) {
        cli_expected *stage = &e->past[i];
        if (!stage->skipped && is_same(stage->name, name)) {
            stage->skipped = true;
            *took = stage->took;
            return true;
        }
    }
    return false;
}

void cli_estimate_expect(cli_estimate *e, const char *name, int kind, double seconds) {
    if (e->count == CLI_ESTIMATE_STAGES) {
        return;
    }
    cli_expected *stage = &e->stages[e->count];
    *stage = (cli_expected){.kind = kind, .seconds = seconds > 0.0 ? seconds : 0.0};
    snprintf(stage->name, sizeof stage->name, "%s", name);
    stage->over = take_past(e, name, &stage->took);
    if (!stage->over && e->running && e->current < 0 && is_same(e->name, name)) {
        e->current = e->count;
    }
    ++e->count;
}

static void end_stage(cli_estimate *e, double now) {
    if (e->current >= 0) {
        cli_expected *stage = &e->stages[e->current];
        stage->took = now - e->began;
        stage->over = true;
    } else if (e->past_count < (int)(sizeof e->past / sizeof *e->past)) {
        cli_expected *stage = &e->past[e->past_count++];
        *stage = (cli_expected){.took = now - e->began, .over = true};
        snprintf(stage->name, sizeof stage->name, "%s", e->name);
    }
}

/* The next stage of that name that is not over; those before it were left out. */
static int find_next(cli_estimate *e, const char *name) {
    int next = 0;
    while (next < e->count && (e->stages[next].over || !is_same(e->stages[next].name, name))) {
        ++next;
    }
    if (next == e->count) {
        return -1;
    }
    for (int i = 0; i < next; ++i) {
        e->stages[i].skipped = e->stages[i].skipped || !e->stages[i].over;
        e->stages[i].over = true;
    }
    return next;
}

void cli_estimate_report(cli_estimate *e, const char *name, double fraction, double now) {
    const bool again = fraction <= 0.0 && e->fraction >= AGAIN;
    if (!e->running || again || !is_same(e->name, name)) {
        if (e->running) {
            end_stage(e, now);
            e->began = now;
        }
        snprintf(e->name, sizeof e->name, "%s", name);
        e->running = true;
        e->fraction = 0.0;
        e->current = find_next(e, name);
    }
    e->fraction = fraction > e->fraction ? (fraction < 1.0 ? fraction : 1.0) : e->fraction;
}

static double limited(double factor) {
    return factor > MOST_WRONG ? MOST_WRONG : factor < 1.0 / MOST_WRONG ? 1.0 / MOST_WRONG : factor;
}

/* What stages of a kind take over what they were expected to. */
static double pace_of(const cli_estimate *e, int kind) {
    double took[2] = {0.0, 0.0}, expected[2] = {0.0, 0.0}; /* of all; of the kind */
    for (int i = 0; i < e->count; ++i) {
        const cli_expected *stage = &e->stages[i];
        if (!stage->over || stage->skipped) {
            continue;
        }
        took[0] += stage->took;
        expected[0] += stage->seconds;
        if (stage->kind == kind) {
            took[1] += stage->took;
            expected[1] += stage->seconds;
        }
    }
    const double all = limited((took[0] + TRUST) / (expected[0] + TRUST));
    return limited((took[1] + KIND_TRUST * all) / (expected[1] + KIND_TRUST));
}

/* What is left of the stage under way: by expectation at its beginning, by its own pace later. */
static double left_of_current(const cli_estimate *e, double now) {
    const double elapsed = now - e->began;
    double expected = elapsed; /* of a stage that nobody expected: as long again */
    if (e->current >= 0) {
        const cli_expected *stage = &e->stages[e->current];
        expected = stage->seconds * pace_of(e, stage->kind) * (1.0 - e->fraction);
    }
    if (e->fraction <= 0.0) {
        return expected > elapsed * 0.1 ? expected : elapsed * 0.1;
    }
    const double by_pace = elapsed * (1.0 - e->fraction) / e->fraction;
    const double part = e->fraction < PACE_KNOWN ? e->fraction / PACE_KNOWN : 1.0, known = part * part;
    return known * by_pace + (1.0 - known) * expected;
}

double cli_estimate_left(const cli_estimate *e, double now) {
    if (e->count == 0) {
        return -1.0;
    }
    double left = e->running ? left_of_current(e, now) : 0.0;
    for (int i = 0; i < e->count; ++i) {
        const cli_expected *stage = &e->stages[i];
        if (!stage->over && !(e->running && i == e->current)) {
            left += stage->seconds * pace_of(e, stage->kind);
        }
    }
    return left;
}

double cli_estimate_share(cli_estimate *e, double now) {
    const double left = cli_estimate_left(e, now), elapsed = now - e->first;
    if (left < 0.0) {
        return e->fraction;
    }
    const double share = elapsed + left > 0.0 ? elapsed / (elapsed + left) : 0.0;
    e->shown = share > e->shown ? share : e->shown;
    return e->shown;
}
