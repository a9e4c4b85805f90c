// Distances to surfaces of triangles and quads.
#pragma once

#include "levelset/grid.h"

#include <vector>

namespace vshi {

// Polygons in index space; a triangle's fourth corner is openvdb::util::INVALID_IDX.
struct Surface {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> polygons;
};

// Bands are converted a little wider than asked for, voxels, because the conversion's errors leave holes at
// their rims.
constexpr double RIM = 1.0;

// Signed distances on the lattice, active within half_width (voxels) of the surface: inside is what cannot be
// reached from outside, whatever way the polygons face.
FloatGrid::Ptr fill_surface(const Surface &surface, const Lattice &lattice, double half_width, double begin,
                            double end, Stage &stage);

// Unsigned distances on the lattice, active within half_width (voxels) of the surface.
FloatGrid::Ptr measure_surface(const Surface &surface, const Lattice &lattice, double half_width,
                               double begin, double end, Stage &stage);

} // namespace vshi
