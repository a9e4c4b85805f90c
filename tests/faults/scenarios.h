/* Small runs through the public calls, and calls of the system that fail in the middle of them. */
#pragma once

#include "../unit/testing.h"

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

/* --- Parts of scenarios. */

/* Runs a call; ends the scenario where it fails, and the test where it then left a handle. */
#define TRY(call)                                                                                            \
    do {                                                                                                     \
        const vsh_result tried = (call);                                                                     \
        if (tried != VSH_OK) {                                                                               \
            return tried;                                                                                    \
        }                                                                                                    \
    } while (0)

#define MAKE(handle, call) TRY(check_handle(#handle, call, (const void *const *)&(handle)))

static inline vsh_result check_handle(const char *name, vsh_result result, const void *const *handle) {
    if ((result == VSH_OK) != (*handle != NULL)) {
        fprintf(stderr, "%s: %s with%s a handle\n", name, vsh_result_name(result),
                *handle != NULL ? "" : "out");
        abort();
    }
    return result;
}

enum { SIDE = 12, POINTS = 80, IMAGES = 3 };

/* Of SIDE by SIDE pixels, one of each reader. */
extern const char *const images[IMAGES];

/* --- Allocations that fail: the linker's --wrap sends every malloc, calloc, realloc, aligned_alloc,
 * posix_memalign, strdup, strndup and free of our objects here, where the n-th may fail and what is not freed
 * is counted. Allocations of the libraries underneath are not seen. */

/* From now on the `first`-th allocation fails (from 1; 0: none) and, where `all` is not 0, every later one.
 * Begins counting anew. */
void faults_begin(uint64_t first, int all);

/* Ends it; the number of allocations since, and in *failed how many of them were refused. */
uint64_t faults_end(uint64_t *failed);

/* Blocks that were taken since the process began, and are not freed. */
uint64_t faults_live(void);

/* --- System calls of writing that fail: the linker's --wrap sends open, pwrite, fsync, close and rename of
 * our objects here. Counted are those of files that are being written. */

enum {
    WRITES_FAIL,  /* the n-th fails, as on a full disk */
    WRITES_SHORT, /* every pwrite writes but a part, every other is interrupted first: all must go well */
    WRITES_KILL   /* SIGKILL in place of the n-th */
};

/* From now on; n from 1, 0: none. */
void writes_begin(uint64_t n, int how);

/* The number of calls since; *what names the one that failed, NULL: none did. */
uint64_t writes_end(const char **what);
