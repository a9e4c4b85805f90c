// True distances for a grid that has none: its zero surface is meshed, and the mesh's distances take the
// grid's own signs, so that cavities stay as they are (a converter that looks for the inside would fill
// them).
//
// Edges and corners of the mesh are put back by Ju, Losasso, Schaefer and Warren, "Dual contouring of Hermite
// data", 2002: the point of a cell minimises the squared distances to the planes of the surface where it cuts
// the cell's edges.
#include "levelset/surface.h"

#include <openvdb/tools/VolumeToMesh.h>

namespace vshi {

namespace {

// Points nearer to the zero than this, voxels, stay: flat parts, and curved ones of radii of 30 voxels and
// more, cost one evaluation a point. An edge that lies so near to a cell's face may be cut by half a voxel
// with 0.02.
constexpr double NEAR_ENOUGH = 0.002;
// Step of the gradient's differences, voxels: small, so that edges are hardly ever within it.
constexpr double STEP = 1.0 / 1024;
// Weight of a point's old place, beside the planes' mean 1. ROUNDS of pulls let go of it: the point comes to
// within 1e-4 of planes at right angles, and stays where the planes say nothing.
constexpr double HOLD = 0.01;
constexpr int ROUNDS = 4;
// A point may lie on its cell's faces, and a rounding beyond.
constexpr double MARGIN = 1e-3;

struct Planes {
    Vec3d normal[12];
    Vec3d place[12];
    int count = 0;
};

Vec3d gradient(const IndexDistance &distance, const Vec3d &p) {
    Vec3d g(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3d h(0.0);
        h[axis] = STEP;
        g[axis] = distance(p + h) - distance(p - h);
    }
    return g;
}

// Where the field is 0 between a place inside and one that is not: by halves, as false position creeps where
// a second side of an edge is near, and at last by the line between them.
Vec3d zero_between(const IndexDistance &distance, Vec3d inside, Vec3d outside) {
    for (int i = 0; i < 10; ++i) {
        const Vec3d middle = 0.5 * (inside + outside);
        (distance(middle) < 0.0 ? inside : outside) = middle;
    }
    const double low = distance(inside);
    const double high = distance(outside);
    return high > low ? inside + (outside - inside) * (low / (low - high)) : outside;
}

Planes planes_of_cell(const IndexDistance &distance, const Vec3d &low) {
    Planes planes;
    bool inside[8];
    const auto corner = [&](int i) { return low + Vec3d(i & 1, i >> 1 & 1, i >> 2 & 1); };
    for (int i = 0; i < 8; ++i) {
        inside[i] = distance(corner(i)) < 0.0;
    }
    for (int i = 0; i < 8; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const int j = i | 1 << axis;
            if (j == i || inside[i] == inside[j]) {
                continue;
            }
            const Vec3d place = zero_between(distance, corner(inside[i] ? i : j), corner(inside[i] ? j : i));
            Vec3d normal = gradient(distance, place);
            if (normal.normalize()) {
                planes.place[planes.count] = place;
                planes.normal[planes.count++] = normal;
            }
        }
    }
    return planes;
}

// The place near `start` that is least off the planes; false where they say nothing.
bool meet(const Planes &planes, const Vec3d &start, Vec3d &place) {
    openvdb::Mat3d sum = openvdb::Mat3d::identity() * (HOLD * planes.count);
    for (int i = 0; i < planes.count; ++i) {
        const Vec3d &n = planes.normal[i];
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                sum[row][column] += n[row] * n[column];
            }
        }
    }
    const openvdb::Mat3d inverse = sum.inverse();
    place = start;
    for (int round = 0; round < ROUNDS; ++round) {
        Vec3d pull(0.0);
        for (int i = 0; i < planes.count; ++i) {
            pull += planes.normal[i] * planes.normal[i].dot(planes.place[i] - place);
        }
        place += inverse * pull;
    }
    return planes.count > 0 && std::isfinite(place.lengthSqr());
}

// Meshing leaves one point in each cell that the surface passes, the mean of where it cuts the cell's edges,
// which rounds edges and corners off: by up to 1.51 voxels where a cube's corner is a lattice point. A point
// that is off the zero is moved to where the planes of those cuts meet, in its cell, if that is nearer to it.
void sharpen_point(openvdb::Vec3s &point, const IndexDistance &distance) {
    const Vec3d at(point);
    const double off = std::fabs(distance(at));
    if (!(off > NEAR_ENOUGH)) {
        return;
    }
    const Vec3d low(std::floor(at[0]), std::floor(at[1]), std::floor(at[2]));
    Vec3d place;
    if (!meet(planes_of_cell(distance, low), at, place)) {
        return;
    }
    for (int axis = 0; axis < 3; ++axis) {
        place[axis] = std::min(std::max(place[axis], low[axis] - MARGIN), low[axis] + 1.0 + MARGIN);
    }
    if (std::fabs(distance(place)) < off) {
        point = openvdb::Vec3s(place);
    }
}

} // namespace

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
        stage.loop(surface.points.size(), 1024, begin + 0.2 * (end - begin), begin + 0.3 * (end - begin),
                   [&](size_t i) { sharpen_point(surface.points[i], exact); });
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
