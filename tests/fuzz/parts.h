/* What the targets of the C API's structs share: handles that calls are given, and structs of any bytes.
 * Pointers are the caller's promise, so they are NULL or lead to arrays that are as long as the struct says.
 */
#ifndef VSH_FUZZ_PARTS_H
#define VSH_FUZZ_PARTS_H

#include "fuzz.h"

#include <vdbshade/vdbshade.h>

enum { FUZZ_SIDE = 8 };

/* Made once for the process. */
typedef struct fuzz_handles {
    vsh_mesh mesh;
    vsh_grid *grid;
    vsh_field *field;
    vsh_occluders *occluders; /* of the field alone */
    vsh_outline *outline;
    vsh_voxels *voxels;
    vsh_heights *heights;
    vsh_spheres *spheres;
} fuzz_handles;

const fuzz_handles *fuzz_made(void);

extern const float fuzz_corners[24], fuzz_uvs[16], fuzz_heights[FUZZ_SIDE * FUZZ_SIDE];
extern const uint32_t fuzz_indices[36];

/* Aborts where a call that must not fail does. */
void fuzz_must(vsh_result result);

/* A struct of options: as it is with some bytes changed, or all bytes the input's. */
void fuzz_take(fuzz_input *input, void *to, size_t size);
vsh_run fuzz_take_run(fuzz_input *input);
/* What casts, with a layer or without; those that were made once where the input makes none. Free with
 * fuzz_free_occluders(). */
vsh_occluders *fuzz_take_occluders(fuzz_input *input);
void fuzz_free_occluders(vsh_occluders *occluders);
vsh_light fuzz_take_light(fuzz_input *input);

typedef void fuzz_call(fuzz_input *input);

/* The call that the input's first byte chooses. */
void fuzz_choose(const uint8_t *data, size_t size, fuzz_call *const *calls, size_t count);

#endif
