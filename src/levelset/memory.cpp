// Level sets in memory: from and to the caller's own OpenVDB grids, and as dense arrays.
#include "levelset/file.h"

#include <openvdb/tools/Dense.h>
#include <openvdb/version.h>

namespace vshi {

namespace {

vsh_result adopt(const FloatGrid::ConstPtr &given, const vsh_run &run, vsh_grid **grid, vsh_error *error) {
    if (given == nullptr) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "the OpenVDB grid is NULL");
    }
    Stage stage(run, "load", error);
    const Named named{"OpenVDB", given->getName()};
    refuse_bad(named, examine_kind(*given), error);
    refuse_large(named, run, double(given->memUsage()), error);
    LevelSet set{named, given->deepCopy(), shell_of(*given)};
    *grid = close_level_set(set, stage, error);
    return VSH_OK;
}

} // namespace

void check_openvdb(uint32_t version, uint32_t abi, vsh_error *error) {
    if (version != OPENVDB_LIBRARY_VERSION_NUMBER || abi != OPENVDB_ABI_VERSION_NUMBER) {
        throw Failure{vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                                "OpenVDB %u.%u.%u (ABI %u): vdbshade was compiled against %s (ABI %d)",
                                version >> 24, version >> 16 & 0xff, version & 0xffff, abi,
                                OPENVDB_LIBRARY_VERSION_STRING, OPENVDB_ABI_VERSION_NUMBER)};
    }
}

vsh_result copy_dense(const FloatTree &tree, const int32_t index_min[3], const int32_t size[3], float *values,
                      vsh_error *error) {
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 1 || int64_t(index_min[axis]) + size[axis] - 1 > INT32_MAX) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "copy: %d voxels from %d on along %c", size[axis],
                             index_min[axis], "xyz"[axis]);
        }
    }
    const Coord low(index_min[0], index_min[1], index_min[2]);
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense( // x fastest

        openvdb::CoordBBox(low, low + Coord(size[0] - 1, size[1] - 1, size[2] - 1)), values);
    openvdb::tools::copyToDense(tree, dense, true);
    return VSH_OK;
}

} // namespace vshi

vsh_result vsh_grid_copy(const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3],
                         float *values, vsh_error *error) {
    VSHI_NEEDS(grid);
    VSHI_NEEDS(index_min);
    VSHI_NEEDS(size);
    VSHI_NEEDS(values);
    return vshi::guard(error, VSH_ERROR_INTERNAL, "grid", [&] {
        return vshi::copy_dense(grid->level_set->constTree(), index_min, size, values, error);
    });
}

vsh_result vsh_grid_from_openvdb(const void *level_set, uint32_t version, uint32_t abi, const vsh_run *run,
                                 vsh_grid **grid, vsh_error *error) {
    VSHI_NEEDS(grid);
    *grid = nullptr;
    VSHI_NEEDS(level_set);
    vsh_run full;
    const vsh_result result = vshi_run_resolve(run, &full, error);
    return result != VSH_OK ? result : vshi::guard(error, VSH_ERROR_INPUT, "OpenVDB", [&] {
        vshi::check_openvdb(version, abi, error);
        return vshi::adopt(*static_cast<const openvdb::FloatGrid::ConstPtr *>(level_set), full, grid, error);
    });
}

vsh_result vsh_grid_to_openvdb(const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set,
                               vsh_error *error) {
    VSHI_NEEDS(grid);
    VSHI_NEEDS(level_set);
    return vshi::guard(error, VSH_ERROR_LIMIT, "OpenVDB", [&] {
        vshi::check_openvdb(version, abi, error);
        *static_cast<openvdb::FloatGrid::ConstPtr *>(level_set) = vshi::named_surface(*grid, "surface");
        return VSH_OK;
    });
}
