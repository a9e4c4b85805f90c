/* Helpers of the targets for the C API: handles for calls, and structs of any bytes. Callers promise that
 * pointers are right, so each is NULL or an array as long as the struct says.
 */
#pragma once

#include "fuzz.h"

#include <vdbshade/vdbshade.h>

enum { FUZZ_SIDE = 8 };

/* Made once for the process. */
typedef struct fuzz_handles {
    vsh_mesh mesh;
    vsh_grid *grid;
    vsh_field *field;
    vsh_occluders *occluders; /* made from the field alone */
    vsh_outline *outline;
    vsh_voxels *voxels;
    vshi_heights *heights;
    vshi_spheres *spheres;
} fuzz_handles;

const fuzz_handles *fuzz_made(void);

extern const float fuzz_corners[24], fuzz_uvs[16], fuzz_heights[FUZZ_SIDE * FUZZ_SIDE];
extern const uint32_t fuzz_indices[36];

/* A call that must not fail. */
#define FUZZ_MUST(call) FUZZ_REQUIRE((call) == VSH_OK)

/* Fills a struct of options: changes some bytes, or takes all bytes from the input. */
void fuzz_take(fuzz_input *input, void *to, size_t size);
vsh_run fuzz_take_run(fuzz_input *input);
/* Occluders, with a layer or without. If the input makes none, these are the ones of fuzz_made(). Free them
 * with fuzz_free_occluders(). */
vsh_occluders *fuzz_take_occluders(fuzz_input *input);
void fuzz_free_occluders(vsh_occluders *occluders);
vsh_light fuzz_take_light(fuzz_input *input);

typedef void fuzz_call(fuzz_input *input);

/* The call that the input's first byte chooses. */
void fuzz_choose(const uint8_t *data, size_t size, fuzz_call *const *calls, size_t count);
