// Whether a grid that came from outside is a level set of true distances.
#pragma once

#include "levelset/grid.h"

#include <string>

namespace vshi {

// What is wrong with a grid; `text` is empty where nothing is.
struct Finding {
    // NOTED: to be told, and used as it is. ODD: the surface is there, the distances must be made anew.
    enum Kind { FINE, NOTED, ODD, BAD } kind = FINE;
    std::string text;
};

// What shows without the tree: class, type of values, transform.
Finding examine_kind(const openvdb::GridBase &grid);

// Voxel size of a transform that examine_kind() found fine, world units.
double voxel_size(const openvdb::GridBase &grid);

// What the tree's values show.
Finding examine_values(const FloatGrid &grid, Stage &stage);

// True distances for an ODD grid: the same surface, signs and transform, a band that is 3 voxels wide at
// least. Messages do not name the file: who reads it puts its name in front.
FloatGrid::Ptr mend(const FloatGrid &grid, Stage &stage, vsh_error *error);

} // namespace vshi
