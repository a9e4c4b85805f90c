/* Progress over several rounds of the same stages, as one. */
#ifndef VSHI_ROUNDS_H
#define VSHI_ROUNDS_H

#include <vdbshade/base.h>

enum { VSHI_ROUNDS_STAGES = 64 };

typedef struct vshi_rounds {
    const vsh_run *run;                 /* whose progress is told */
    const char *name;                   /* of all rounds together */
    double before;                      /* fraction that the rounds before this one made */
    double share;                       /* of this one */
    double weight[VSHI_ROUNDS_STAGES];  /* of each stage in a round: what it took in the last one, sum 1 */
    double seconds[VSHI_ROUNDS_STAGES]; /* that it has taken in this one */
    double since;                       /* the stage's begin */
    int stage;                          /* -1: none yet */
    char current[80];                   /* name of the stage */
} vshi_rounds;

/* `stages` that a round has about: the first has no better measure. */
void vshi_rounds_begin(vshi_rounds *rounds, const vsh_run *run, const char *name, int stages);

/* The run of a round, which takes `share` of it all, 0 … 1. It holds for as long as `rounds`. */
vsh_run vshi_rounds_run(vshi_rounds *rounds, double share);

/* The round is done. */
void vshi_rounds_next(vshi_rounds *rounds);

#endif
