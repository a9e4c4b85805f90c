/* .vdb files: listed, read as a level set, and as a set of voxels. OpenVDB 10.0 itself is not safe on damaged
 * files: see docs/reliability.md. */
#include "fuzz.h"

#include <vdbshade/grid.h>
#include <vdbshade/volume.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *path = fuzz_file("a.vdb", data, size);
    vsh_run run = fuzz_run();
    vsh_error error;
    vsh_vdb_entry entries[4];
    size_t count;
    const vsh_result result = vsh_vdb_list(path, &run, entries, 4, &count, fuzz_error(&error));
    fuzz_ended(result, &error, result == VSH_OK ? &count : NULL);
    run = fuzz_run();
    vsh_grid *grid;
    fuzz_ended(vsh_grid_read(path, NULL, &run, &grid, fuzz_error(&error)), &error, grid);
    vsh_grid_free(grid);
    run = fuzz_run();
    vsh_voxels *voxels;
    fuzz_ended(vsh_voxels_from_vdb(path, NULL, &run, &voxels, fuzz_error(&error)), &error, voxels);
    vsh_voxels_free(voxels);
    return 0;
}
