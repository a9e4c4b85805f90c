// Distances put right after a mesh conversion.
#pragma once

#include "levelset/surface.h"

namespace vshi {

// OpenVDB's conversion measures every voxel beyond the first layer against the polygons that its neighbours
// of that moment happened to be nearest to: up to 0.6 voxels too much, measured on a sphere. Here each voxel
// is measured again against the nearest polygons of all 26 neighbours, twice. `distances` keep their signs;
// `nearest` holds the polygons' numbers, as the conversion gives them.
void measure_again(FloatGrid &distances, openvdb::Int32Grid &nearest, const Surface &surface, double voxel,
                   double begin, double end, Stage &stage);

} // namespace vshi
