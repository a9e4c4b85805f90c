// Distances to surfaces of triangles and quads.
#pragma once

#include "levelset/grid.h"
#include "levelset/polygons.h"

namespace vshi {

// Signed distances on the lattice, active within half_width (voxels, at least 3) of the surface: inside is
// what cannot be reached from outside, whatever way the polygons face. Distances are exact to 1e-4 of a voxel
// where the surface's points are.
FloatGrid::Ptr fill_surface(const Surface &surface, const Lattice &lattice, double half_width, double begin,
                            double end, Stage &stage);

// Unsigned distances on the lattice, active within half_width (voxels) of the surface.
FloatGrid::Ptr measure_surface(const Surface &surface, const Lattice &lattice, double half_width,
                               double begin, double end, Stage &stage);

} // namespace vshi
