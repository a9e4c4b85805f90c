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

/* The files that scenarios read and write, in the working directory; outputs hold "old". */
void scenarios_make_files(void);

/* Whether the outputs of a scenario that failed are as they were, and no other file is there; then they are
 * made so anew. */
int scenarios_untouched(void);
void scenarios_remove_files(void);

#endif
