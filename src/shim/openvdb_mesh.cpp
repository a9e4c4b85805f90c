// Level sets from meshes: all closed ones together, all open ones as shells.
#include "caster/mesh.h"
#include "shim/openvdb_shells.h"

#include <cfloat>
#include <cmath>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/util/Util.h>

namespace vshi {

namespace {

// Distances, nearest polygons, their next values, and one more set of distances while they are collected; and
// what a triangle takes as polygon, corners and part of a shell. Measured over spheres of 16000 leaves: 11 to
// 13 kB a leaf; the whole estimate comes to 1.3 to 1.8 times the peak.
constexpr double MESH_BYTES_PER_LEAF = 5.0 * BYTES_PER_LEAF;
constexpr double BYTES_PER_TRIANGLE = 96.0;

struct Meshes {
    const vsh_mesh *mesh;
    size_t count;
    std::vector<vsh_mesh_report> reports;
    Vec3d low{DBL_MAX};
    Vec3d high{-DBL_MAX};
    size_t triangles = 0;
};

Meshes look_over(const vsh_mesh *mesh, size_t count, vsh_error *error) {
    if (mesh == nullptr || count == 0) {
        throw Failure{vshi_fail(error, VSH_ERROR_ARGUMENT, "voxelize: no meshes")};
    }
    Meshes meshes{mesh, count, std::vector<vsh_mesh_report>(count)};
    for (size_t i = 0; i < count; ++i) {
        vsh_result result = vshi_mesh_check_data(&mesh[i], i, error);
        if (result == VSH_OK) {
            result = vsh_mesh_check(&mesh[i], &meshes.reports[i], error);
        }
        if (result != VSH_OK) {
            throw Failure{result};
        }
        meshes.low = openvdb::math::minComponent(meshes.low, Vec3d(meshes.reports[i].bounds_min));
        meshes.high = openvdb::math::maxComponent(meshes.high, Vec3d(meshes.reports[i].bounds_max));
        meshes.triangles += mesh[i].triangle_count - meshes.reports[i].degenerate_triangles;
    }
    if (meshes.triangles == 0) {
        throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "voxelize: %zu mesh%s without a triangle of any area",
                                count, count == 1 ? "" : "es")};
    }
    if (meshes.triangles > size_t(INT32_MAX)) {
        throw Failure{vshi_fail(error, VSH_ERROR_LIMIT, "voxelize: %zu triangles, %d at most",
                                meshes.triangles, INT32_MAX)};
    }
    return meshes;
}

void foretell(const Meshes &meshes, const Lattice &lattice, const vsh_run &run, vsh_error *error) {
    double leaves = 0.0;
    for (const vsh_mesh_report &report : meshes.reports) {
        const double band = lattice.half_width + RIM + (report.open_edges > 0 ? 0.5 * lattice.shell : 0.0);
        const Vec3d size = Vec3d(report.bounds_max) - Vec3d(report.bounds_min);
        if (report.area > 0.0) {
            leaves += band_leaves(report.area / (lattice.voxel * lattice.voxel), size / lattice.voxel, band);
        }
    }
    check_memory(&run, lattice.voxel, leaves,
                 leaves * MESH_BYTES_PER_LEAF + double(meshes.triangles) * BYTES_PER_TRIANGLE, error);
}

// Within this distance (voxels) of a surface the conversion signs a voxel by the side it lies on; farther
// off, by what can be reached from outside. The first means nothing where a surface ends.
constexpr float SIGNED_BY_SIDE = 0.87f;

// A voxel next to a surface that ends is inside only if the side it lies on is inside farther off, too.
bool beside_inside(FloatGrid::ConstUnsafeAccessor &values, const Coord &at, float near) {
    for (int32_t n = 0; n < 26; ++n) {
        if (values.getValue(at + openvdb::util::COORD_OFFSETS[n]) < -near) {
            return true;
        }
    }
    return false;
}

// Moves the surface out by `offset` (world units), so that a sheet becomes a solid; what its conversion found
// to be enclosed stays inside.
void thicken(FloatGrid &grid, float offset, float voxel, float background, Stage &stage) {
    std::vector<Leaf *> leaves;
    grid.tree().getNodes(leaves);
    std::vector<float> values(leaves.size() * Leaf::SIZE);
    const float near = SIGNED_BY_SIDE * voxel;
    stage.loop(leaves.size(), 64, 0.0, 0.0, [&](size_t i) {
        FloatGrid::ConstUnsafeAccessor around(grid.constTree());
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            float value = leaves[i]->getValue(n);
            if (value < 0.0f && value >= -near &&
                !beside_inside(around, leaves[i]->offsetToGlobalCoord(n), near)) {
                value = -value;
            }
            values[i * Leaf::SIZE + n] = std::clamp(value - offset, -background, background);
        }
    });
    stage.loop(leaves.size(), 64, 0.0, 0.0, [&](size_t i) {
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            const float value = values[i * Leaf::SIZE + n];
            leaves[i]->setValueOnly(n, value);
            leaves[i]->setActiveState(n, std::fabs(value) < background);
        }
    });
    stage.run([&] { openvdb::tools::changeLevelSetBackground(grid.tree(), background); });
}

void warn(const Meshes &meshes, const Lattice &lattice, const vsh_run &run) {
    for (size_t i = 0; i < meshes.count; ++i) {
        const vsh_mesh_report &report = meshes.reports[i];
        const vshi_mesh_name name = vshi_mesh_label(&meshes.mesh[i], i);
        if (report.open_edges > 0) {
            vshi_warn(&run, "%s (%zu of %zu): %zu open edge%s: baked as a shell %g voxels (%g units) thick",
                      name.text, i + 1, meshes.count, report.open_edges, report.open_edges == 1 ? "" : "s",
                      lattice.shell, lattice.shell * lattice.voxel);
        } else if (report.flipped_edges > 0) {
            vshi_warn(
                &run,
                "%s (%zu of %zu): %zu edge%s whose triangles disagree about the outside: what it encloses "
                "is taken for inside",
                name.text, i + 1, meshes.count, report.flipped_edges, report.flipped_edges == 1 ? "" : "s");
        }
    }
}

struct Progress {
    double done;
    double per_triangle;

    double next(const Surface &surface) { return done += per_triangle * double(surface.polygons.size()); }
};

// NULL where it has no triangles.
FloatGrid::Ptr fill_solid(const Solid &solid, const Lattice &lattice, Progress &progress, Stage &stage) {
    if (solid.outward.polygons.empty()) {
        return nullptr;
    }
    double begin = progress.done;
    const FloatGrid::Ptr filled =
        fill_surface(solid.outward, lattice, lattice.half_width, begin, progress.next(solid.outward), stage);
    if (!solid.rooms.polygons.empty()) {
        begin = progress.done;
        const FloatGrid::Ptr rooms =
            fill_surface(solid.rooms, lattice, lattice.half_width, begin, progress.next(solid.rooms), stage);
        stage.run([&] { openvdb::tools::csgDifference(*filled, *rooms); });
    }
    return filled;
}

void unite(FloatGrid::Ptr &united, const FloatGrid::Ptr &more, Stage &stage) {
    if (united == nullptr || more == nullptr) {
        united = united == nullptr ? more : united;
    } else {
        stage.run([&] { openvdb::tools::csgUnion(*united, *more); });
    }
}

vsh_result from_meshes(const vsh_mesh *mesh, size_t count, const vsh_grid_options *options,
                       const vsh_run *given, vsh_grid **grid, vsh_error *error) {
    vsh_run run;
    const vsh_result result = vshi_run_resolve(given, &run, error);
    if (result != VSH_OK) {
        return result;
    }
    const Meshes meshes = look_over(mesh, count, error);
    const Lattice lattice = make_lattice(options, meshes.low, meshes.high, error);
    foretell(meshes, lattice, run, error);
    Stage stage(run, "voxelize", error);
    warn(meshes, lattice, run);

    std::vector<Solid> solids(1);
    Surface open;
    for (size_t i = 0; i < count; ++i) {
        if (meshes.reports[i].open_edges > 0) {
            add_mesh(mesh[i], lattice, open);
        } else if (meshes.reports[i].flipped_edges > 0) { // says nothing about rooms
            add_mesh(mesh[i], lattice, solids.front().outward);
        } else {
            add_closed_mesh(mesh[i], lattice, solids, error);
        }
    }
    Progress progress{0.0, 1.0 / double(meshes.triangles)};
    FloatGrid::Ptr united;
    for (const Solid &solid : solids) {
        unite(united, fill_solid(solid, lattice, progress, stage), stage);
    }
    if (!open.polygons.empty()) {
        const double begin = progress.done;
        FloatGrid::Ptr shell =
            fill_surface(open, lattice, lattice.half_width + 0.5 * lattice.shell, begin, 1.0, stage);
        thicken(*shell, float(0.5 * lattice.shell * lattice.voxel), float(lattice.voxel),
                lattice.background(), stage);
        unite(united, shell, stage);
    }
    *grid = close_grid(united, open.polygons.empty() ? 0.0 : lattice.shell * lattice.voxel, stage);
    return VSH_OK;
}

} // namespace

} // namespace vshi

vsh_result vsh_grid_from_meshes(const vsh_mesh *meshes, size_t mesh_count, const vsh_grid_options *options,
                                const vsh_run *run, vsh_grid **grid, vsh_error *error) {
    VSHI_NEEDS(grid);
    *grid = nullptr;
    return vshi::guard(error, VSH_ERROR_INTERNAL, "voxelize",
                       [&] { return vshi::from_meshes(meshes, mesh_count, options, run, grid, error); });
}
