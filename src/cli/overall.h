/* Progress over several rounds of the same stages, as one. */
#ifndef CLI_OVERALL_H
#define CLI_OVERALL_H

#include <vdbshade/base.h>

enum { CLI_OVERALL_STAGES = 64 };

typedef struct cli_overall {
    const vsh_run *run;                 /* whose progress is told */
    const char *name;                   /* of all rounds together */
    double before;                      /* fraction that the rounds before this one made */
    double share;                       /* of this one */
    double weight[CLI_OVERALL_STAGES];  /* of each stage in a round: what it took in the last one, sum 1 */
    double seconds[CLI_OVERALL_STAGES]; /* that it has taken in this one */
    double since;                       /* the stage's begin */
    int stage;                          /* -1: none yet */
    char current[80];                   /* name of the stage */
} cli_overall;

/* `stages` that a round has about: the first has no better measure. */
void cli_overall_begin(cli_overall *overall, const vsh_run *run, const char *name, int stages);

/* The run of a round, which takes `share` of it all, 0 … 1. It holds for as long as `overall`. */
vsh_run cli_overall_round(cli_overall *overall, double share);

/* The round is done. */
void cli_overall_next(cli_overall *overall);

#endif
