// A dense copy of a grid of a file: its values, and which of them are active.
#include "shim/openvdb_file.h"

#include <openvdb/tools/Dense.h>
#include <vdbshade/volume.h>

namespace vshi {

namespace {

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>; // x fastest, as in pictures

struct Copy {
    const openvdb::CoordBBox &box;
    float *values;
    float *active;

    template <typename GridType> void operator()(const GridType &grid) const {
        const auto &tree = grid.constTree();
        if constexpr (std::is_same_v<GridType, openvdb::MaskGrid>) {
            if (values != nullptr) {
                copy_active(tree, values);
            }
        } else if (values != nullptr) {
            Dense dense(box, values);
            openvdb::tools::copyToDense(tree, dense, true);
        }
        if (active != nullptr) {
            copy_active(tree, active);
        }
    }

    template <typename Tree> void copy_active(const Tree &tree, float *to) const {
        const openvdb::BoolTree topology(tree, false, true, openvdb::TopologyCopy());
        Dense dense(box, to);
        openvdb::tools::copyToDense(topology, dense, true);
    }
};

vsh_result copy(const char *path, const char *name, const int32_t index_min[3], const int32_t size[3],
                const vsh_run &run, float *values, float *active, vsh_error *error) {
    Stage stage(run, "load", error);
    stage.check();
    double count = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 1 || int64_t(index_min[axis]) + size[axis] - 1 > INT32_MAX) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "copy: %d voxels from %d on along %c", size[axis],
                             index_min[axis], "xyz"[axis]);
        }
        count *= double(size[axis]);
    }
    if (count > double(INT32_MAX)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "copy of %d × %d × %d voxels: expected up to 2^31 - 1",
                         size[0], size[1], size[2]);
    }
    const openvdb::GridBase::Ptr grid = read_numbers(path, name, run, error);
    stage.check();
    const openvdb::Coord low(index_min[0], index_min[1], index_min[2]);
    const openvdb::CoordBBox box(low, low + openvdb::Coord(size[0] - 1, size[1] - 1, size[2] - 1));
    grid->apply<NumberGrids>(Copy{box, values, active});
    return VSH_OK;
}

} // namespace

} // namespace vshi

vsh_result vsh_vdb_copy(const char *path, const char *name, const int32_t index_min[3], const int32_t size[3],
                        const vsh_run *run, float *values, float *active, vsh_error *error) {
    vsh_run full;
    const vsh_result result = vshi_run_resolve(run, &full, error);
    if (result != VSH_OK) {
        return result;
    }
    return vshi::guard(error, VSH_ERROR_READ, path, [&]() -> vsh_result {
        vshi::initialize();
        return vshi::copy(path, name, index_min, size, full, values, active, error);
    });
}
