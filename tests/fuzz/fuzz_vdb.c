/* .vdb files: read as a level set, listed, or read as a set of voxels, by the last byte.
 * OpenVDB 10.0 itself is not safe on damaged files: see docs/security.md. */
#include "fuzz.h"

#include <vdbshade/grid.h>
#include <vdbshade/volume.h>

static void list(const char *path, const vsh_run *run) {
    vsh_vdb_entry entries[4];
    size_t count;
    const vsh_result result = vsh_vdb_list(path, run, entries, 4, &count, fuzz_error());
    fuzz_ended_plain(result);
}

static void read_grid(const char *path, const vsh_run *run) {
    vsh_grid *grid;
    FUZZ_MAKE(grid, vsh_grid_read(path, NULL, run, &grid, fuzz_error()));
    vsh_grid_free(grid);
}

static void read_voxels(const char *path, const vsh_run *run) {
    vsh_voxels *voxels;
    FUZZ_MAKE(voxels, vsh_voxels_from_vdb(path, NULL, run, &voxels, fuzz_error()));
    vsh_voxels_free(voxels);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static void (*const calls[])(const char *, const vsh_run *) = {read_grid, list, read_voxels};
    if (size == 0) {
        return 0;
    }
    vsh_run run = fuzz_run();
    run.memory_limit /= 4; /* tiles of a few bytes become blocks up to it */
    calls[data[size - 1] % 3](fuzz_file("a.vdb", data, size), &run); /* the last byte is a value of a leaf */
    return 0;
}
