#include "overall.h"

#include "clock.h"

#include <stdio.h>
#include <string.h>

void cli_overall_begin(cli_overall *overall, const vsh_run *run, const char *name, int stages) {
    memset(overall, 0, sizeof *overall);
    overall->run = run;
    overall->name = name;
    stages = stages < CLI_OVERALL_STAGES ? stages : CLI_OVERALL_STAGES;
    for (int i = 0; i < stages; ++i) {
        overall->weight[i] = 1.0 / stages;
    }
}

static void end_stage(cli_overall *overall, double now) {
    if (overall->stage >= 0) {
        overall->seconds[overall->stage] += now - overall->since;
    }
    overall->since = now;
}

/* Called by one thread at a time. */
static int32_t report(void *user, const char *stage, double fraction) {
    cli_overall *overall = user;
    if (overall->stage < 0 || strncmp(overall->current, stage, sizeof overall->current - 1) != 0) {
        end_stage(overall, cli_seconds());
        overall->stage += overall->stage + 1 < CLI_OVERALL_STAGES;
        snprintf(overall->current, sizeof overall->current, "%s", stage);
    }
    double done = overall->weight[overall->stage] * fraction;
    for (int i = 0; i < overall->stage; ++i) {
        done += overall->weight[i];
    }
    done = overall->before + overall->share * (done < 1.0 ? done : 1.0);
    const vsh_run *run = overall->run;
    return run->progress != NULL ? run->progress(run->user, overall->name, done) : 0;
}

vsh_run cli_overall_round(cli_overall *overall, double share) {
    overall->share = share;
    overall->stage = -1;
    memset(overall->seconds, 0, sizeof overall->seconds);
    vsh_run run = *overall->run;
    run.progress = report;
    run.warning = NULL; /* would be told in each round */
    run.user = overall;
    return run;
}

void cli_overall_next(cli_overall *overall) {
    end_stage(overall, cli_seconds());
    double sum = 0.0;
    for (int i = 0; i < CLI_OVERALL_STAGES; ++i) {
        sum += overall->seconds[i];
    }
    for (int i = 0; i < CLI_OVERALL_STAGES && sum > 0.0; ++i) {
        overall->weight[i] = overall->seconds[i] / sum;
    }
    overall->before += overall->share;
    overall->share = 0.0;
}
