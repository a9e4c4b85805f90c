#include "levelset/file.h"

#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace vshi {

namespace {

namespace math = openvdb::math;

constexpr int32_t LAST_INDEX = INT32_MAX - (1 << 13); // so that a root tile ends before it

// A kind of transform: how many numbers OpenVDB writes as they are, and of the scale that follows them.
struct Kind {
    std::string map;
    size_t plain, scale;
};

const Kind &kind_of(const std::string &map) {
    static const std::vector<Kind> all{
        {math::TranslationMap::mapType(), 3, 0},
        {math::ScaleMap::mapType(), 0, 3},
        {math::UniformScaleMap::mapType(), 0, 3},
        {math::ScaleTranslateMap::mapType(), 3, 3},
        {math::UniformScaleTranslateMap::mapType(), 3, 3},
        {math::AffineMap::mapType(), 16, 0},
        {math::UnitaryMap::mapType(), 16, 0},
        {math::NonlinearFrustumMap::mapType(), 24, 0}, // 16 of them another map's
    };
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Kind &kind) { return kind.map == map; });
    if (found == all.end()) {
        throw std::invalid_argument("its transform is of no known kind");
    }
    return *found;
}

void add(std::vector<double> &numbers, const double *more, size_t count) {
    numbers.insert(numbers.end(), more, more + count);
}

void write(std::ostream &out, const double *numbers, size_t count) {
    out.write(reinterpret_cast<const char *>(numbers), std::streamsize(count * sizeof *numbers));
}

// A scale with what follows from it, as OpenVDB computes it.
void write_scale(std::ostream &out, const double *numbers) {
    const Vec3d scale(numbers), inverse = 1.0 / scale;
    const Vec3d size(std::fabs(scale[0]), std::fabs(scale[1]), std::fabs(scale[2]));
    for (const Vec3d &member : {scale, size, inverse, Vec3d(inverse * inverse), Vec3d(inverse / 2.0)}) {
        member.write(out);
    }
}

} // namespace

TransformData describe_transform(const math::Transform &transform) {
    TransformData data{transform.mapType(), {}};
    const Kind &kind = kind_of(data.map);
    if (const auto frustum = transform.map<math::NonlinearFrustumMap>()) {
        add(data.numbers, frustum->getBBox().min().asPointer(), 3);
        add(data.numbers, frustum->getBBox().max().asPointer(), 3);
        data.numbers.push_back(frustum->getTaper());
        data.numbers.push_back(frustum->getDepth());
        add(data.numbers, frustum->secondMap().getMat4().asPointer(), 16);
        return data;
    }
    // Every other map writes those that define it first, as doubles.
    std::stringstream text;
    transform.baseMap()->write(text);
    data.numbers.resize(kind.plain + kind.scale);
    text.read(reinterpret_cast<char *>(data.numbers.data()),
              std::streamsize(data.numbers.size() * sizeof(double)));
    return data;
}

math::Transform::Ptr restore_transform(const TransformData &data) {
    initialize();
    const Kind &kind = kind_of(data.map);
    if (data.numbers.size() != kind.plain + kind.scale) {
        throw std::invalid_argument("its transform has other numbers");
    }
    std::stringstream text;
    openvdb::io::setCurrentVersion(text);
    openvdb::writeString(text, data.map);
    const double *numbers = data.numbers.data();
    if (data.map == math::NonlinearFrustumMap::mapType()) {
        write(text, numbers, 8);
        openvdb::writeString(text, math::AffineMap::mapType());
        write(text, numbers + 8, 16);
    } else {
        write(text, numbers, kind.plain);
    }
    if (kind.scale > 0) {
        write_scale(text, numbers + kind.plain);
    }
    const auto transform = std::make_shared<math::Transform>();
    transform->read(text);
    return transform;
}

namespace {

// A leaf, and a tile of the tree, as they are sent.
struct LeafData {
    int32_t origin[3];
    int32_t unused;
    uint64_t active[VSHI_MASK_WORDS];
    float values[Leaf::SIZE];
};

struct TileData {
    int32_t origin[3];
    int32_t level; // 1 … 3: 8, 128 and 4096 voxels wide
    float value;
    int32_t active;
};

constexpr int32_t WIDTHS[4] = {0, 8, 128, 4096};

[[noreturn]] void fail(const char *path, const char *what, vsh_error *error) {
    throw Failure{vshi_answer_fail(path, what, error)};
}

bool aligned(const int32_t origin[3], int32_t width) {
    for (int axis = 0; axis < 3; ++axis) {
        if (origin[axis] % width != 0 || origin[axis] < -LAST_INDEX || origin[axis] > LAST_INDEX) {
            return false;
        }
    }
    return true;
}

void put_transform(vshi_encoder *encoder, const math::Transform &transform) {
    const TransformData data = describe_transform(transform);
    vshi_encode_text(encoder, data.map.c_str());
    vshi_encode_array(encoder, data.numbers.data(), data.numbers.size(), sizeof(double));
}

math::Transform::Ptr take_transform(vshi_decoder *decoder, const char *path, vsh_error *error) {
    const char *map = vshi_decode_text(decoder, true);
    TransformData data{map != nullptr ? map : "", {}};
    try {
        const Kind &kind = kind_of(data.map);
        for (size_t i = 0; i < kind.plain + kind.scale; ++i) {
            data.numbers.push_back(vshi_decode_number(decoder));
        }
        if (!decoder->bad) {
            return restore_transform(data);
        }
    } catch (const std::invalid_argument &) {
    }
    fail(path, "a transform", error);
}

// Nodes that have nothing but tiles are made by their first.
template <typename Node>
void add_childless(const FloatTree &tree, int32_t level, std::vector<TileData> &tiles) {
    std::vector<const Node *> nodes;
    tree.getNodes(nodes);
    for (const Node *node : nodes) {
        if (node->childCount() == 0) {
            const Coord &at = node->origin();
            tiles.push_back({{at[0], at[1], at[2]}, level, node->getFirstValue(), node->isValueOn(0)});
        }
    }
}

// Tiles that say more than their node's making does: inactive background is left out.
std::vector<TileData> tiles_of(const FloatTree &tree) {
    std::vector<TileData> tiles;
    const float background = tree.background();
    FloatTree::ValueAllCIter tile(tree);
    tile.setMaxDepth(FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
        const float value = tile.getValue();
        const auto level = int32_t(FloatTree::ValueAllCIter::LEAF_DEPTH - tile.getDepth());
        const bool plain = std::memcmp(&value, &background, sizeof value) == 0 && !tile.isValueOn();
        if (!plain || level == 3) {
            const Coord at = tile.getBoundingBox().min();
            tiles.push_back({{at[0], at[1], at[2]}, level, value, tile.isValueOn()});
        }
    }
    add_childless<UpperNode>(tree, 2, tiles);
    add_childless<LowerNode>(tree, 1, tiles);
    return tiles;
}

void build_tiles(FloatTree &tree, vshi_decoder *decoder, const char *path, vsh_error *error) {
    const uint64_t count = vshi_decode_count(decoder, UINT64_MAX);
    const auto *tiles = static_cast<const TileData *>(vshi_decode_array(decoder, count, sizeof(TileData)));
    for (uint64_t i = 0; tiles != nullptr && i < count; ++i) {
        const TileData &tile = tiles[i];
        if (tile.level < 1 || tile.level > 3 || !aligned(tile.origin, WIDTHS[tile.level]) ||
            (tile.active != 0 && tile.active != 1)) {
            fail(path, "a tile's place", error);
        }
        tree.addTile(openvdb::Index(tile.level), Coord(tile.origin), tile.value, tile.active != 0);
    }
}

void build_leaves(FloatTree &tree, vshi_decoder *decoder, const char *path, vsh_error *error) {
    const uint64_t count = vshi_decode_count(decoder, UINT64_MAX);
    const auto *leaves = static_cast<const LeafData *>(vshi_decode_array(decoder, count, sizeof(LeafData)));
    openvdb::tree::ValueAccessor<FloatTree, false> accessor(tree);
    for (uint64_t i = 0; leaves != nullptr && i < count; ++i) {
        const LeafData &data = leaves[i];
        const Coord origin(data.origin);
        if (!aligned(data.origin, 8) || accessor.probeConstLeaf(origin) != nullptr) {
            fail(path, "a leaf's place", error);
        }
        auto leaf = std::make_unique<Leaf>(origin, 0.0f, false);
        std::memcpy(leaf->buffer().data(), data.values, sizeof data.values);
        for (openvdb::Index word = 0; word < VSHI_MASK_WORDS; ++word) {
            leaf->getValueMask().getWord<uint64_t>(word) = data.active[word];
        }
        accessor.addLeaf(leaf.release());
    }
}

} // namespace

void put_level_set(vshi_encoder *encoder, const LevelSet &set) {
    const FloatTree &tree = set.grid->constTree();
    vshi_encode_text(encoder, set.named.grid.c_str());
    vshi_encode_number(encoder, set.shell);
    put_transform(encoder, set.grid->transform());
    const float background = tree.background();
    vshi_encode_array(encoder, &background, 1, sizeof background);
    const std::vector<TileData> tiles = tiles_of(tree);
    vshi_encode_count(encoder, tiles.size());
    vshi_encode_array(encoder, tiles.data(), tiles.size(), sizeof(TileData));
    vshi_encode_count(encoder, tree.leafCount());
    LeafData data{};
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        for (int axis = 0; axis < 3; ++axis) {
            data.origin[axis] = leaf->origin()[axis];
        }
        for (openvdb::Index word = 0; word < VSHI_MASK_WORDS; ++word) {
            data.active[word] = leaf->getValueMask().getWord<uint64_t>(word);
        }
        std::memcpy(data.values, leaf->buffer().data(), sizeof data.values);
        vshi_encode_array(encoder, &data, 1, sizeof data);
    }
}

LevelSet take_level_set(vshi_decoder *decoder, const char *path, vsh_error *error) {
    const char *name = vshi_decode_text(decoder, false);
    if (name == nullptr) {
        fail(path, "a name", error);
    }
    LevelSet set{{path, name}, nullptr, vshi_decode_number(decoder)};
    const math::Transform::Ptr transform = take_transform(decoder, path, error);
    float background = 0.0f;
    if (const void *at = vshi_decode_array(decoder, 1, sizeof background)) {
        std::memcpy(&background, at, sizeof background);
    }
    const auto tree = std::make_shared<FloatTree>(background);
    build_tiles(*tree, decoder, path, error);
    build_leaves(*tree, decoder, path, error);
    if (!vshi_decoder_ends(decoder) || !(set.shell >= 0.0)) {
        fail(path, "the level set's size", error);
    }
    set.grid = FloatGrid::create(tree);
    set.grid->setTransform(transform);
    return set;
}

void put_blocks(vshi_encoder *encoder, const std::string &grid, const math::Transform &transform,
                const std::vector<vshi_block> &blocks) {
    vshi_encode_text(encoder, grid.c_str());
    put_transform(encoder, transform);
    vshi_encode_count(encoder, blocks.size());
    for (const vshi_block &block : blocks) { // one by one: padding holds nothing of ours
        vshi_encode_array(encoder, block.origin, 3, sizeof block.origin[0]);
        vshi_encode_array(encoder, block.mask, VSHI_MASK_WORDS, sizeof block.mask[0]);
    }
}

std::vector<vshi_block> take_blocks(vshi_decoder *decoder, const char *path, std::string &grid,
                                    math::Transform::Ptr &transform, vsh_error *error) {
    constexpr size_t BLOCK_BYTES = 80;
    const char *name = vshi_decode_text(decoder, false);
    grid = name != nullptr ? name : "";
    transform = take_transform(decoder, path, error);
    const uint64_t count = vshi_decode_count(decoder, uint64_t(decoder->end - decoder->at) / BLOCK_BYTES);
    std::vector<vshi_block> blocks;
    blocks.reserve(count);
    for (uint64_t i = 0; i < count; ++i) {
        vshi_block block{};
        const void *origin = vshi_decode_array(decoder, 3, sizeof block.origin[0]);
        const void *mask = vshi_decode_array(decoder, VSHI_MASK_WORDS, sizeof block.mask[0]);
        if (origin == nullptr || mask == nullptr) {
            break;
        }
        std::memcpy(block.origin, origin, sizeof block.origin);
        std::memcpy(block.mask, mask, sizeof block.mask);
        const bool rises =
            blocks.empty() || std::lexicographical_compare(blocks.back().origin, blocks.back().origin + 3,
                                                           block.origin, block.origin + 3);
        if (!rises || !aligned(block.origin, 8)) {
            fail(path, "a block's place", error);
        }
        blocks.push_back(block);
    }
    if (name == nullptr || !vshi_decoder_ends(decoder) || blocks.size() != count) {
        fail(path, "the voxels' number", error);
    }
    return blocks;
}

} // namespace vshi
