// Edges and corners put back into a mesh of a field's zero.
#pragma once

#include "levelset/surface.h"

#include <functional>

namespace vshi {

// The distance to a surface, or less where it is none: voxels, at a place in index space; changes by at most
// 1 a voxel.
using IndexDistance = std::function<double(const Vec3d &)>;

// Meshing leaves one point in each cell that the surface passes, the mean of where it cuts the cell's edges,
// which rounds edges and corners off: by up to 1.51 voxels where a cube's corner is a lattice point. Points
// that are off the zero are moved to where the planes of those cuts meet, in their cell, if that is nearer to
// it.
void sharpen_surface(Surface &surface, const IndexDistance &distance, double begin, double end, Stage &stage);

} // namespace vshi
