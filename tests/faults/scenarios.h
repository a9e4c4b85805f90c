/* Small runs through the public calls, for tests that let something fail in the middle of them. */
#ifndef FAULTS_SCENARIOS_H
#define FAULTS_SCENARIOS_H

#include <vdbshade/vdbshade.h>

/* Runs to its end or to the first failure, whose code and error it returns, and frees what it made. Calls
 * that fail must leave NULL for their handles, else it aborts. */
typedef vsh_result scenario_fn(const vsh_run *run, vsh_error *error);

typedef struct scenario {
    const char *name;
    scenario_fn *run;
} scenario;

extern const scenario scenarios[];
extern const size_t scenario_count;

/* Makes a folder with the files that scenarios read and write, outputs holding "old", and enters it; takes it
 * away again. cmocka's way of setting up a group. */
int scenarios_begin(void **state);
int scenarios_end(void **state);

/* Whether the outputs of a scenario that failed are as they were, and no other file is there; then they are
 * made so anew. */
int scenarios_untouched(void);

#endif
