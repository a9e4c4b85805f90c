/* What fuzz targets share. A target is one function, LLVMFuzzerTestOneInput(), that is given any bytes and
 * must come back: a crash, a sanitizer's report or an abort() is a find. Under libFuzzer (tools/fuzz), or
 * replaying files. */
#ifndef VSH_FUZZ_H
#define VSH_FUZZ_H

#include <vdbshade/base.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Bytes on their way into parameters; zeros behind their end. */
typedef struct fuzz_input {
    const uint8_t *at;
    size_t left;
} fuzz_input;

void fuzz_fill(fuzz_input *input, void *to, size_t size);
uint8_t fuzz_byte(fuzz_input *input);

/* A folder of this process in memory (/dev/shm), or else in TMPDIR; removed with its files at exit. Its path
 * holds until then. */
const char *fuzz_folder(void);

/* Writes a file there; the path, which holds until the next call. */
const char *fuzz_file(const char *name, const void *data, size_t size);

enum { FUZZ_MEMORY = 64 << 20 };

/* One thread, that much memory, warnings looked at, and a progress callback that cancels after 30 ms: inputs
 * that ask for much are not to stop the fuzzer. */
vsh_run fuzz_run(void);

/* True once that time is over; fuzz_run() starts it. */
int fuzz_is_late(void);

/* The error of the next call, filled with what no call leaves in it. */
vsh_error *fuzz_error(void);

/* Aborts where a call's result, its error and its handle do not fit together. */
void fuzz_ended(vsh_result result, const void *handle);

/* The same for a call without a handle. */
void fuzz_ended_plain(vsh_result result);

/* Makes a handle by a call that is given fuzz_error(), and looks at all three once it has ended. */
#define FUZZ_MAKE(handle, call)                                                                              \
    do {                                                                                                     \
        const vsh_result fuzz_result = (call);                                                               \
        fuzz_ended(fuzz_result, handle);                                                                     \
    } while (0)

#endif
