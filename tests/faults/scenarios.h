/* Small runs through the public calls, and calls of the system that fail in the middle of them. */
#pragma once

#include "../unit/testing.h"

/* Runs to the end or to the first failure, returns that call's code and error, and frees everything that it
 * made. Aborts if a call that fails does not leave NULL for its handle. */
typedef vsh_result scenario_fn(const vsh_run *run, vsh_error *error);

typedef struct scenario {
    const char *name;
    scenario_fn *run;
} scenario;

extern const scenario scenarios[];
extern const size_t scenario_count;

/* Makes and enters a folder with the files that scenarios read, and outputs that contain "old"; the second
 * removes it. Setup and teardown of a cmocka group. */
int scenarios_begin(void **state);
int scenarios_end(void **state);

/* Whether the outputs are unchanged after a scenario that failed, and there are no new files. Restores both
 * in any case. */
int scenarios_untouched(void);

/* --- Parts of scenarios. */

/* Runs a call. Ends the scenario if it fails, and the test if it then left a handle. */
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
 * posix_memalign, strdup, strndup and free of our objects here, where the n-th may fail, and blocks that are
 * not freed are counted. Allocations of other libraries are not seen. */

/* From now on the `first`-th allocation fails (from 1; 0: none) and, where `all` is not 0, every later one.
 * Begins counting anew. */
void faults_begin(uint64_t first, int all);

/* Ends it. Returns the number of allocations since then; *failed is how many of them failed. */
uint64_t faults_end(uint64_t *failed);

/* Blocks that were taken since the process began, and are not freed. */
uint64_t faults_live(void);

/* --- System calls of writing that fail: the linker's --wrap sends open, pwrite, fsync, close and rename of
 * our objects here. Only calls on files that are being written count. */

enum {
    WRITES_FAIL,  /* the n-th fails, as on a full disk */
    WRITES_SHORT, /* every pwrite writes only a part, every second one is interrupted first: all must succeed
                   */
    WRITES_KILL   /* SIGKILL in place of the n-th */
};

/* Starts counting, and lets the n-th call (from 1; 0: none) fail. */
void writes_begin(uint64_t n, int how);

/* Ends it. Returns the number of calls since then; *what names the one that failed, NULL if none did. */
uint64_t writes_end(const char **what);
