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

} // namespace vshi

struct vsh_voxels {
    std::shared_ptr<const vshi::VoxelSet> set;
    vsh_voxels_info info;
};
