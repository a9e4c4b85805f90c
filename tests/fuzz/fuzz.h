/* Helpers of fuzz targets. A target is one function, LLVMFuzzerTestOneInput(), that gets any bytes and must
 * return. A crash, a sanitizer's report or an abort() is a finding. Targets run under libFuzzer (tools/fuzz)
 * or replay files. */
#pragma once

#include <vdbshade/vdbshade.h>

#ifndef __cplusplus
#include "compare/compare.h"
#include "field/field.h"
#include "flat/flat.h"
#include "io/image/image.h"
#include "lightmap/texels.h"
#include "shade/occluders.h"
#include "shapes/heights.h"
#include "shapes/outline.h"
#include "shapes/spheres.h"
#include "trace/trace.h"
#endif

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Bytes from which parameters are made; zeros follow the last one. */
typedef struct fuzz_input {
    const uint8_t *at;
    size_t left;
} fuzz_input;

void fuzz_fill(fuzz_input *input, void *to, size_t size);
uint8_t fuzz_byte(fuzz_input *input);

/* A folder of this process in memory (/dev/shm), or else in TMPDIR; removed with its files at exit. Its path
 * is valid until then. */
const char *fuzz_folder(void);

/* Writes a file there. Returns its path, which is valid until the next call. */
const char *fuzz_file(const char *name, const void *data, size_t size);

enum { FUZZ_MEMORY = 64 << 20 };

/* A run with one thread, limited memory, warnings that are checked, and a progress callback that cancels
 * after 30 ms, so that large inputs do not stop the fuzzer. */
vsh_run fuzz_run(void);

/* True once that time is over; fuzz_run() starts it. */
int fuzz_is_late(void);

/* The error for the next call, filled with values that no call leaves in it. */
vsh_error *fuzz_error(void);

/* Aborts if a call's result, its error and its handle at `place` contradict each other; else returns the
 * result. */
vsh_result fuzz_check(vsh_result result, const void *place);

/* Checks a call without a handle in the same way. */
vsh_result fuzz_check_plain(vsh_result result);

/* Aborts if a condition does not hold. */
void fuzz_require(int holds, const char *condition);
#define FUZZ_REQUIRE(condition) fuzz_require((condition), #condition)

/* Makes a handle by a call that is given fuzz_error(), and checks all three. */
#define FUZZ_MAKE(handle, call) fuzz_check((call), &(handle))

/* Makes a handle in the same way, and frees it. */
#define FUZZ_TRY(type, name, call)                                                                           \
    do {                                                                                                     \
        type *name;                                                                                          \
        FUZZ_MAKE(name, call);                                                                               \
        type##_free(name);                                                                                   \
    } while (0)
