// True distances for a grid that has none: its zero surface is meshed, and the mesh's distances take the
// grid's own signs, so that cavities stay as they are (a converter that looks for the inside would fill
// them).
#include "levelset/redistance.h"

#include "levelset/tiles.h"

#include <cmath>
#include <openvdb/tools/VolumeToMesh.h>

namespace vshi {

void check_redistance(const vsh_run &run, const Lattice &lattice, double area, const Vec3d &sides,
                      double source_leaves, double held, vsh_error *error) {
    const double leaves = band_leaves(area, sides, lattice.half_width);
    check_memory(&run, lattice.voxel, leaves,
                 held + source_leaves * SOURCE_BYTES_PER_LEAF + leaves * REDISTANCE_BYTES_PER_LEAF, error);
}

Surface mesh_surface(const FloatGrid &source, Stage &stage) {
    Surface surface;
    stage.run([&] {
        // In index space: world positions would lose a float's digits far from the origin.
        const FloatGrid::ConstPtr unit =
            source.copyReplacingTransform(openvdb::math::Transform::createLinearTransform());
        openvdb::tools::volumeToMesh(*unit, surface.points, surface.polygons, 0.0);
    });
    stage.check();
    return surface;
}

FloatGrid::Ptr redistance(const FloatGrid &source, const IndexDistance &exact, const Lattice &lattice,
                          double begin, double end, Stage &stage, vsh_error *error) {
    Surface surface = mesh_surface(source, stage);
    stage.reach(begin + 0.2 * (end - begin));
    stage.check();
    if (surface.polygons.empty()) {
        throw Failure{vshi_fail(error, VSH_ERROR_INPUT,
                                "no surface: the values do not change sign at voxel size %g", lattice.voxel)};
    }
    if (exact) {
        sharpen_surface(surface, exact, begin + 0.2 * (end - begin), begin + 0.3 * (end - begin), stage);
    }
    FloatGrid::Ptr measured =
        measure_surface(surface, lattice, lattice.half_width, begin + 0.3 * (end - begin), end, stage);
    take_signs(*measured, root_origins(source.constTree()), stage, [&] {
        return [tree = FloatGrid::ConstUnsafeAccessor(source.constTree())](const Coord &at) {
            return tree.getValue(at) < 0.0f;
        };
    });
    return measured;
}

} // namespace vshi
