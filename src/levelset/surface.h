// Surfaces of triangles and quads, and level sets of the distances to them.
#pragma once

#include "levelset/grid.h"

#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace vshi {

// Polygons in index space; a triangle's fourth corner is UINT32_MAX, OpenVDB's INVALID_IDX.
struct Surface {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> polygons;
};

// A quad is two triangles; a triangle's number is twice its polygon's, plus one for a quad's second.
using Corners = std::array<openvdb::Vec3d, 3>;

inline uint32_t triangles_of(const openvdb::Vec4I &polygon) {
    return polygon[3] == UINT32_MAX ? 1 : 2;
}

inline Corners corners_of(const Surface &surface, uint32_t triangle) {
    const openvdb::Vec4I &polygon = surface.polygons[triangle / 2];
    const int second = int(triangle % 2) + 1;
    return {openvdb::Vec3d(surface.points[polygon[0]]), openvdb::Vec3d(surface.points[polygon[second]]),
            openvdb::Vec3d(surface.points[polygon[second + 1]])};
}

// Signed distances on the lattice, active within half_width (voxels, at least 3) of the surface. A voxel is
// inside if no path leads to it from far away, whatever way the polygons face. Distances are exact to 1e-4 of
// a voxel.
FloatGrid::Ptr fill_surface(const Surface &surface, const Lattice &lattice, double half_width, double begin,
                            double end, Stage &stage);

// Unsigned distances on the lattice, active within half_width (voxels) of the surface.
FloatGrid::Ptr measure_surface(const Surface &surface, const Lattice &lattice, double half_width,
                               double begin, double end, Stage &stage);

// --- re-distancing

// The distance to a surface, or a lower bound of it, at a place in index space; voxels. It changes by at most
// 1 a voxel.
using IndexDistance = std::function<double(const Vec3d &)>;

// Peak memory of re-distancing: a leaf of the source with its part of the mesh, and a leaf of the result with
// its distances. Measured over spheres and boxes at half widths of 3 to 30, the whole estimate is 1.3 to 1.6
// times the peak, without the 25 MB of the first threads.
constexpr double SOURCE_BYTES_PER_LEAF = 1.5 * BYTES_PER_LEAF;
constexpr double REDISTANCE_BYTES_PER_LEAF = 3.0 * BYTES_PER_LEAF;

// Bytes of a grid's inner nodes beyond those of a compact grid (eight around the origin, 2.1 MB, and the
// nodes below), which the estimates' margins cover. Leaves far from each other have their own nodes, 130
// times their size, in every copy on the way.
inline double far_node_bytes(double grid_bytes, double leaves) {
    constexpr double COMPACT = 3e6;
    return std::max(0.0, grid_bytes - leaves * double(sizeof(Leaf)) - COMPACT);
}

// Fails if re-distancing would exceed the run's memory limit or the machine's memory. The surface has `area`
// voxel² in a box of `sides` voxels and lies in `source_leaves`; `held` bytes are in use.
void check_redistance(const vsh_run &run, const Lattice &lattice, double area, const Vec3d &sides,
                      double source_leaves, double held);

// The zero surface of a grid as quads in its index space; voxels beside it must be active.
Surface mesh_surface(const FloatGrid &source, Stage &stage);

// A level set of true distances on the lattice, with the zero surface and the signs of `source`: the surface
// is meshed and the mesh measured. `source` is on the same lattice, and has values wherever neighbours differ
// in sign. `exact`, if not empty, is the field that `source` samples; it keeps edges and corners.
FloatGrid::Ptr redistance(const FloatGrid &source, const IndexDistance &exact, const Lattice &lattice,
                          double begin, double end, Stage &stage);

// --- signs of tiles

constexpr int32_t UPPER_SIZE = int32_t(UpperNode::DIM);

// Sets the tiles of one node. A tile has one sign, because no surface passes through it.
template <typename Node, typename Inside> void sign_tiles(Node &node, Inside &&inside, float background) {
    for (auto tile = node.beginValueAll(); tile; ++tile) {
        tile.setValue(inside(tile.getCoord()) ? -background : background);
    }
    for (auto tile = node.beginValueOn(); tile; ++tile) {
        tile.setValueOff();
    }
}

// Origins of a tree's upper nodes and of its root's tiles.
inline std::vector<Coord> root_origins(const FloatTree &tree) {
    std::vector<Coord> origins;
    std::vector<const UpperNode *> nodes;
    tree.getNodes(nodes);
    origins.reserve(nodes.size());
    for (const UpperNode *node : nodes) {
        origins.push_back(node->origin());
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(0);
    for (; tile; ++tile) {
        origins.push_back(tile.getCoord());
    }
    return origins;
}

// Gives every tile of `tree` the sign of its first voxel, by the test that `make_inside()` makes. Adds a tile
// to the root at each of `origins` that lies inside and has no node. The tree has leaves wherever there is a
// surface.
template <typename MakeInside>
void fill_tiles(FloatTree &tree, const std::vector<Coord> &origins, float background, Stage &stage,
                MakeInside &&make_inside) {
    std::vector<LowerNode *> lower;
    tree.getNodes(lower);
    stage.loop(lower.size(), 1, 0.0, 0.0,
               [&](size_t i) { sign_tiles(*lower[i], make_inside(), background); });
    std::vector<UpperNode *> upper;
    tree.getNodes(upper);
    stage.loop(upper.size(), 1, 0.0, 0.0,
               [&](size_t i) { sign_tiles(*upper[i], make_inside(), background); });
    auto inside = make_inside();
    for (const Coord &origin : origins) {
        if (tree.getValueDepth(origin) < 1 && inside(origin)) {
            tree.addTile(3, origin, -background, false);
        }
    }
}

// Gives unsigned distances the signs of a test of voxels; parameters as above.
template <typename MakeInside>
void copy_signs(FloatGrid &distances, const std::vector<Coord> &origins, Stage &stage,
                MakeInside &&make_inside) {
    std::vector<Leaf *> leaves;
    distances.tree().getNodes(leaves);
    stage.loop(leaves.size(), 16, 0.0, 0.0, [&](size_t i) {
        auto inside = make_inside();
        float *values = leaves[i]->buffer().data();
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            values[n] = std::copysign(values[n], inside(leaves[i]->offsetToGlobalCoord(n)) ? -1.0f : 1.0f);
        }
    });
    fill_tiles(distances.tree(), origins, distances.background(), stage, make_inside);
}

} // namespace vshi
