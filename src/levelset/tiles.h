// Signs of what holds no surface.
#pragma once

#include "levelset/grid.h"

#include <cmath>
#include <vector>

namespace vshi {

using LowerNode = FloatTree::RootNodeType::ChildNodeType::ChildNodeType;
using UpperNode = FloatTree::RootNodeType::ChildNodeType;
constexpr int32_t UPPER_SIZE = int32_t(UpperNode::DIM);

// Sets the tiles of one node, each of which has one sign because no surface passes it.
template <typename Node, typename Inside> void sign_tiles(Node &node, Inside &&inside, float background) {
    for (auto tile = node.beginValueAll(); tile; ++tile) {
        tile.setValue(inside(tile.getCoord()) ? -background : background);
    }
    for (auto tile = node.beginValueOn(); tile; ++tile) {
        tile.setValueOff();
    }
}

// Origins of the upper nodes and of the root's tiles of a tree.
inline std::vector<Coord> root_origins(const FloatTree &tree) {
    std::vector<Coord> origins;
    std::vector<const UpperNode *> nodes;
    tree.getNodes(nodes);
    origins.reserve(nodes.size());
    for (const UpperNode *node : nodes) {
        origins.push_back(node->origin());
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(0);
    for (; tile; ++tile) {
        origins.push_back(tile.getCoord());
    }
    return origins;
}

// Gives every tile of `tree` the sign that `make_inside()(first voxel)` tells, and the root a tile at each of
// `origins` that lies inside and has no node. The tree has leaves wherever there is a surface.
template <typename MakeInside>
void fill_tiles(FloatTree &tree, const std::vector<Coord> &origins, float background, Stage &stage,
                MakeInside &&make_inside) {
    std::vector<LowerNode *> lower;
    tree.getNodes(lower);
    stage.loop(lower.size(), 1, 0.0, 0.0,
               [&](size_t i) { sign_tiles(*lower[i], make_inside(), background); });
    std::vector<UpperNode *> upper;
    tree.getNodes(upper);
    stage.loop(upper.size(), 1, 0.0, 0.0,
               [&](size_t i) { sign_tiles(*upper[i], make_inside(), background); });
    auto inside = make_inside();
    for (const Coord &origin : origins) {
        if (tree.getValueDepth(origin) < 1 && inside(origin)) {
            tree.addTile(3, origin, -background, false);
        }
    }
}

// The signs of unsigned distances from a test of voxels; `origins` as above.
template <typename MakeInside>
void take_signs(FloatGrid &distances, const std::vector<Coord> &origins, Stage &stage,
                MakeInside &&make_inside) {
    std::vector<Leaf *> leaves;
    distances.tree().getNodes(leaves);
    stage.loop(leaves.size(), 16, 0.0, 0.0, [&](size_t i) {
        auto inside = make_inside();
        float *values = leaves[i]->buffer().data();
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            values[n] = std::copysign(values[n], inside(leaves[i]->offsetToGlobalCoord(n)) ? -1.0f : 1.0f);
        }
    });
    fill_tiles(distances.tree(), origins, distances.background(), stage, make_inside);
}

} // namespace vshi
