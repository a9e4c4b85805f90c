// The voxels of a volume, as its grids need them.
#pragma once

#include "levelset/grid.h"
#include "levelset/volume.h"

#include <memory>
#include <vector>

namespace vshi {

// Shared by the voxels and by the volumes made on them.
struct VoxelSet {
    std::vector<vshi_block> blocks; // sorted by origin
    openvdb::math::Transform::Ptr transform;
    double least_axis = 0.0; // of a voxel, world units
};

// Takes the set; `what` names it in messages.
vsh_voxels *close_voxels(VoxelSet &&set, bool normals, const char *what, vsh_error *error);

// Whether memory allows for so many blocks.
void check_blocks(const vsh_run &run, double count, const char *what, vsh_error *error);

} // namespace vshi

struct vsh_voxels {
    std::shared_ptr<const vshi::VoxelSet> set;
    vsh_voxels_info info;
};
