// Distances of the inside where surfaces meet or overlap within it.
#pragma once

#include "levelset/grid.h"
#include "levelset/sides.h"

namespace vshi {

// What is left of a surface without what has the inside on both of its sides, as faces where solids touch and
// all that is within others: it bounds nothing. Large triangles are cut in pieces, to about a voxel.
Surface boundary_of(const Surface &surface, const LeafTable &table, const std::vector<Sides::Told> &told,
                    double begin, double end, Stage &stage);

// The regions of a band that hold a voxel within its half width of a leaf with buried voxels: distances of
// the inside are others there once they are taken to the boundary.
std::vector<size_t> regions_near_buried(const Band &band, const std::vector<BandLeaf> &leaves,
                                        const std::vector<Sides::Told> &told);

} // namespace vshi
