#include "base/rounds.h"

#include "base/clock.h"

#include <stdio.h>
#include <string.h>

void vshi_rounds_begin(vshi_rounds *rounds, const vsh_run *run, const char *name, int stages) {
    memset(rounds, 0, sizeof *rounds);
    rounds->run = run;
    rounds->name = name;
    stages = stages < VSHI_ROUNDS_STAGES ? stages : VSHI_ROUNDS_STAGES;
    for (int i = 0; i < stages; ++i) {
        rounds->weight[i] = 1.0 / stages;
    }
}

static void end_stage(vshi_rounds *rounds, double now) {
    if (rounds->stage >= 0) {
        rounds->seconds[rounds->stage] += now - rounds->since;
    }
    rounds->since = now;
}

/* Called by one thread at a time. */
static int32_t report(void *user, const char *stage, double fraction) {
    vshi_rounds *rounds = user;
    if (rounds->stage < 0 || strncmp(rounds->current, stage, sizeof rounds->current - 1) != 0) {
        end_stage(rounds, vshi_seconds());
        rounds->stage += rounds->stage + 1 < VSHI_ROUNDS_STAGES;
        snprintf(rounds->current, sizeof rounds->current, "%s", stage);
    }
    double done = rounds->weight[rounds->stage] * fraction;
    for (int i = 0; i < rounds->stage; ++i) {
        done += rounds->weight[i];
    }
    done = rounds->before + rounds->share * (done < 1.0 ? done : 1.0);
    const vsh_run *run = rounds->run;
    return run != NULL && run->progress != NULL ? run->progress(run->user, rounds->name, done) : 0;
}

vsh_run vshi_rounds_run(vshi_rounds *rounds, double share) {
    rounds->share = share;
    rounds->stage = -1;
    memset(rounds->seconds, 0, sizeof rounds->seconds);
    vsh_run run = *rounds->run;
    run.progress = report;
    run.warning = NULL; /* would be told in each round */
    run.user = rounds;
    return run;
}

void vshi_rounds_next(vshi_rounds *rounds) {
    end_stage(rounds, vshi_seconds());
    double sum = 0.0;
    for (int i = 0; i < VSHI_ROUNDS_STAGES; ++i) {
        sum += rounds->seconds[i];
    }
    for (int i = 0; i < VSHI_ROUNDS_STAGES && sum > 0.0; ++i) {
        rounds->weight[i] = rounds->seconds[i] / sum;
    }
    rounds->before += rounds->share;
    rounds->share = 0.0;
}
