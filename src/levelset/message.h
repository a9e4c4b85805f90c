// Grids between a reader and its caller: transforms, level sets and voxels as plain arrays.
#pragma once

#include "levelset/grid.h"
#include "levelset/serve.h"
#include "levelset/volume.h"

#include <string>
#include <vector>

namespace vshi {

// A transform: OpenVDB's name of its map, and the numbers that define it, without those that follow from
// them. Maps of files hold both, and damaged ones do not agree.
struct TransformData {
    std::string map;
    std::vector<double> numbers;
};

TransformData describe_transform(const openvdb::math::Transform &transform);

// The transform that OpenVDB reads from a sound file with these numbers. Throws std::invalid_argument for a
// map that is none of the known ones, or has other numbers.
openvdb::math::Transform::Ptr restore_transform(const TransformData &data);

// A grid of a file, as messages name it.
struct Named {
    const char *path;
    std::string grid;

    std::string text() const { return std::string(path) + ": grid '" + grid + "'"; }
};

// A level set as it stands in a file, before its values are looked at.
struct LevelSet {
    Named named;
    FloatGrid::Ptr grid;
    double shell; // world units; 0: none
};

void put_level_set(vshi_encoder *encoder, const LevelSet &set);

// Throws Failure (VSH_ERROR_READ) for what no sound reader sends: tiles and leaves out of place, out of
// range, twice, numbers that are not finite.
LevelSet take_level_set(vshi_decoder *decoder, const char *path, vsh_error *error);

void put_blocks(vshi_encoder *encoder, const std::string &grid, const openvdb::math::Transform &transform,
                const std::vector<vshi_block> &blocks);
std::vector<vshi_block> take_blocks(vshi_decoder *decoder, const char *path, std::string &grid,
                                    openvdb::math::Transform::Ptr &transform, vsh_error *error);

} // namespace vshi
