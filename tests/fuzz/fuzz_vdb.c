/* .vdb files: read as a level set, listed, or read as a set of voxels, by the last byte.
 * OpenVDB 10.0 itself is not safe on damaged files: see docs/security.md. */
#include "fuzz.h"

#include <vdbshade/grid.h>
#include <vdbshade/volume.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) {
        return 0;
    }
    const char *path = fuzz_file("a.vdb", data, size);
    vsh_run run = fuzz_run();
    run.memory_limit /= 4; /* tiles of a few bytes become blocks up to it */
    vsh_vdb_entry entries[4];
    size_t count;
    switch (data[size - 1] % 3) { /* the last byte is a value of a leaf */
    case 0:
        FUZZ_TRY(vsh_grid, grid, vsh_grid_read(path, NULL, &run, &grid, fuzz_error()));
        break;
    case 1:
        fuzz_check_plain(vsh_vdb_list(path, &run, entries, 4, &count, fuzz_error()));
        break;
    default:
        FUZZ_TRY(vsh_voxels, voxels, vsh_voxels_from_vdb(path, NULL, &run, &voxels, fuzz_error()));
    }
    return 0;
}
