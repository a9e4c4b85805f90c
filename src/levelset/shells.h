// Surfaces to be voxelised, by what their components are.
#pragma once

#include "levelset/surface.h"

#include "mesh/solidity.h"

namespace vshi {

// What is filled, and what is cut out of it afterwards.
struct Solid {
    Surface outward;
    Surface rooms;
};

// Faces with a thin wall behind them. What stands apart is voxelised together.
struct Wall {
    bool inward = true; // the wall is outside of what they enclose; else within
    bool open = false;  // `closed` has triangles over holes
    Surface faces;
    Surface closed;                    // with what closes their holes
    std::vector<openvdb::BBoxd> boxes; // index space
};

struct Parts {
    std::vector<Solid> solids; // the first takes all that have no rooms
    std::vector<Wall> walls;
    Surface sheets;
};

// Sorts the components' triangles in index space. Walls whose boxes are at least `apart` voxels from each
// other may share a surface.
Parts sort_parts(const vshi_solidity *solidity, const Lattice &lattice, double apart);

} // namespace vshi
