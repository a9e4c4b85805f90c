/* Level sets and volumes as OpenVDB's own grids, for programs in C++ that use OpenVDB themselves. Not part of
 * vdbshade.h: it includes OpenVDB's headers. */
#ifndef VDBSHADE_OPENVDB_H
#define VDBSHADE_OPENVDB_H

#include "grid.h"
#include "voxels.h"

#include <openvdb/openvdb.h>

namespace vdbshade {

/* A handle with the values of a level set, which are copied: the grid may change afterwards. What holds of
 * the grids of files (vsh_grid_read()) holds here: any rotation, mirroring and uniform scale; distances are
 * made anew, with a warning, where the values are none or the band is narrower than 3 voxels. Errors:
 * - VSH_ERROR_UNSUPPORTED: this program was compiled against another version or ABI of OpenVDB than vdbshade;
 * - VSH_ERROR_ARGUMENT: no grid, run;
 * - VSH_ERROR_INPUT, VSH_ERROR_LIMIT: as vsh_grid_read();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
inline vsh_result grid_from_openvdb(const openvdb::FloatGrid::ConstPtr &level_set, const vsh_run *run,
                                    vsh_grid **grid, vsh_error *error) {
    return vsh_grid_from_openvdb(&level_set, OPENVDB_LIBRARY_VERSION_NUMBER, OPENVDB_ABI_VERSION_NUMBER, run,
                                 grid, error);
}

/* The level set of a handle, named "surface": its values are shared, not copied, and live as long as the
 * pointer. Errors: VSH_ERROR_UNSUPPORTED as above; VSH_ERROR_MEMORY. */
inline vsh_result grid_to_openvdb(const vsh_grid *grid, openvdb::FloatGrid::ConstPtr &level_set,
                                  vsh_error *error) {
    return vsh_grid_to_openvdb(grid, OPENVDB_LIBRARY_VERSION_NUMBER, OPENVDB_ABI_VERSION_NUMBER, &level_set,
                               error);
}

/* A grid of a volume, with its name and metadata as in a file; its values are shared. Errors:
 * VSH_ERROR_ARGUMENT (no such grid), VSH_ERROR_UNSUPPORTED as above; VSH_ERROR_MEMORY. */
inline vsh_result volume_to_openvdb(const vsh_volume *volume, size_t grid,
                                    openvdb::FloatGrid::ConstPtr &values, vsh_error *error) {
    return vsh_volume_to_openvdb(volume, grid, OPENVDB_LIBRARY_VERSION_NUMBER, OPENVDB_ABI_VERSION_NUMBER,
                                 &values, error);
}

} // namespace vdbshade

#endif
