// True distances for a grid that has none.
#pragma once

#include "levelset/surface.h"

#include <functional>

namespace vshi {

// --- edges and corners put back into a mesh of a field's zero

// The distance to a surface, or less where it is none: voxels, at a place in index space; changes by at most
// 1 a voxel.
using IndexDistance = std::function<double(const Vec3d &)>;

// Meshing leaves one point in each cell that the surface passes, the mean of where it cuts the cell's edges,
// which rounds edges and corners off: by up to 1.51 voxels where a cube's corner is a lattice point. Points
// that are off the zero are moved to where the planes of those cuts meet, in their cell, if that is nearer to
// it.
void sharpen_surface(Surface &surface, const IndexDistance &distance, double begin, double end, Stage &stage);

// --- re-distancing

// What re-distancing takes at its peak: a leaf of the source with its part of the mesh, and a leaf of what
// becomes of it with its distances. Measured over spheres and boxes at half widths of 3 to 30: the
// whole estimate comes to 1.3 to 1.6 times the peak, without the 25 MB that the first threads take.
constexpr double SOURCE_BYTES_PER_LEAF = 1.5 * BYTES_PER_LEAF;
constexpr double REDISTANCE_BYTES_PER_LEAF = 3.0 * BYTES_PER_LEAF;

// Bytes of a grid's inner nodes beside those of a compact one (eight around the origin, 2.1 MB, and those
// below them), which the estimates' margins hold: leaves far from each other have nodes of their own, 130
// times their size, in every copy on the way.
inline double far_node_bytes(double grid_bytes, double leaves) {
    constexpr double COMPACT = 3e6;
    return std::max(0.0, grid_bytes - leaves * double(sizeof(Leaf)) - COMPACT);
}

// Throws Failure where re-distancing would pass the run's memory limit or the machine's: a surface of `area`
// voxel² in a box of `sides` voxels, held in `source_leaves`, `held` bytes beside it.
void check_redistance(const vsh_run &run, const Lattice &lattice, double area, const Vec3d &sides,
                      double source_leaves, double held, vsh_error *error);

// The zero surface of a grid as quads in its index space; voxels beside it must be active.
Surface mesh_surface(const FloatGrid &source, Stage &stage);

// A level set on the lattice with the zero surface and the signs of `source` (on the same lattice, with
// values at least wherever neighbours differ in sign) and true distances: the surface is meshed and the mesh
// measured. `exact`: the field that the source holds values of, by which edges and corners are kept; may be
// empty.
FloatGrid::Ptr redistance(const FloatGrid &source, const IndexDistance &exact, const Lattice &lattice,
                          double begin, double end, Stage &stage, vsh_error *error);

} // namespace vshi
