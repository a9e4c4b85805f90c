/* Small runs through the public calls, for tests that let something fail in the middle of them. */
#ifndef FAULTS_SCENARIOS_H
#define FAULTS_SCENARIOS_H

#include "../unit/testing.h"

#include <stdio.h>
#include <stdlib.h>

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

/* --- What scenarios are made of. */

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

/* Values 0 … 1, no two neighbours alike. */
void parts_fill(float *values, size_t count);

/* A cube of 1 in a few voxels. */
vsh_result parts_occluders(const vsh_run *run, vsh_grid **grid, vsh_occluders **occluders, vsh_error *error);

/* Points around it, with normals up. */
void parts_place(double positions[3 * POINTS], float normals[3 * POINTS]);

/* Scenarios that bake and write (bakes.c). */
scenario_fn bake_lightmap, bake_volume, draw, bake_flat, write_exr, write_png, write_tif, read_images;

#endif
