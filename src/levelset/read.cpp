// Reading .vdb files, in this process or by run.reader: level sets, lists of grids, dense copies. The first
// part encodes and decodes the messages of the reader; decoding checks their content.
#include "levelset/file.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <openvdb/tools/Dense.h>
#include <sstream>
#include <stdexcept>

namespace vshi {

namespace {

[[noreturn]] void fail_answer(const char *path, const char *what) {
    Failure failure;
    vshi_answer_fail(path, what, &failure.error);
    throw failure;
}

Matrix decode_matrix(vshi_decoder *decoder) {
    Matrix matrix;
    for (double &number : matrix) {
        number = vshi_decode_number(decoder);
    }
    return matrix;
}

// --- messages: level sets

// A leaf of the tree in a message.
struct LeafData {
    int32_t origin[3];
    int32_t unused;
    uint64_t active[VSHI_MASK_WORDS];
    float values[Leaf::SIZE];
};

// A tile of the tree in a message.
struct TileData {
    int32_t origin[3];
    int32_t level; // 1 … 3: 8, 128 and 4096 voxels wide
    float value;
    int32_t active;
};

constexpr int32_t WIDTHS[4] = {0, 8, 128, 4096};
constexpr int32_t LAST_INDEX = INT32_MAX - (1 << 13); // a root tile ends before INT32_MAX

bool is_aligned(const int32_t origin[3], int32_t width) {
    return std::all_of(origin, origin + 3,
                       [&](int32_t o) { return o % width == 0 && o >= -LAST_INDEX && o <= LAST_INDEX; });
}

// Adds the first tile of each node that has no children: the receiver makes the node from that tile.
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

// The tiles to send. A new node holds inactive background, so such tiles are left out.
std::vector<TileData> list_tiles(const FloatTree &tree) {
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

void decode_tiles(FloatTree &tree, vshi_decoder *decoder, const char *path) {
    const uint64_t count = vshi_decode_count(decoder, UINT64_MAX);
    const auto *tiles = static_cast<const TileData *>(vshi_decode_array(decoder, count, sizeof(TileData)));
    for (uint64_t i = 0; tiles != nullptr && i < count; ++i) {
        const TileData &tile = tiles[i];
        if (tile.level < 1 || tile.level > 3 || !is_aligned(tile.origin, WIDTHS[tile.level]) ||
            (tile.active != 0 && tile.active != 1)) {
            fail_answer(path, "a tile's place");
        }
        tree.addTile(openvdb::Index(tile.level), Coord(tile.origin), tile.value, tile.active != 0);
    }
}

void decode_leaves(FloatTree &tree, vshi_decoder *decoder, const char *path) {
    const uint64_t count = vshi_decode_count(decoder, UINT64_MAX);
    const auto *leaves = static_cast<const LeafData *>(vshi_decode_array(decoder, count, sizeof(LeafData)));
    openvdb::tree::ValueAccessor<FloatTree, false> accessor(tree);
    for (uint64_t i = 0; leaves != nullptr && i < count; ++i) {
        const LeafData &data = leaves[i];
        const Coord origin(data.origin);
        if (!is_aligned(data.origin, 8) || accessor.probeConstLeaf(origin) != nullptr) {
            fail_answer(path, "a leaf's place");
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

void encode_level_set(vshi_encoder *encoder, const LevelSet &set) {
    const FloatTree &tree = set.grid->constTree();
    vshi_encode_text(encoder, set.name.grid.c_str());
    vshi_encode_number(encoder, set.shell);
    vshi_encode_array(encoder, set.matrix.data(), set.matrix.size(), sizeof set.matrix[0]);
    const float background = tree.background();
    vshi_encode_array(encoder, &background, 1, sizeof background);
    const std::vector<TileData> tiles = list_tiles(tree);
    vshi_encode_count(encoder, tiles.size());
    vshi_encode_array(encoder, tiles.data(), tiles.size(), sizeof(TileData));
    vshi_encode_count(encoder, tree.leafCount());
    LeafData data{};
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        std::copy(leaf->origin().data(), leaf->origin().data() + 3, data.origin);
        for (openvdb::Index word = 0; word < VSHI_MASK_WORDS; ++word) {
            data.active[word] = leaf->getValueMask().getWord<uint64_t>(word);
        }
        std::memcpy(data.values, leaf->buffer().data(), sizeof data.values);
        vshi_encode_array(encoder, &data, 1, sizeof data);
    }
}

LevelSet decode_level_set(vshi_decoder *decoder, const char *path) {
    const char *name = vshi_decode_text(decoder, false);
    if (name == nullptr) {
        fail_answer(path, "a name");
    }
    LevelSet set{{path, name}, nullptr, {}, vshi_decode_number(decoder)};
    set.matrix = decode_matrix(decoder);
    const void *background = vshi_decode_array(decoder, 1, sizeof(float));
    const auto tree =
        std::make_shared<FloatTree>(background != nullptr ? *static_cast<const float *>(background) : 0.0f);
    decode_tiles(*tree, decoder, path);
    decode_leaves(*tree, decoder, path);
    if (!vshi_decoder_ends(decoder) || !(set.shell >= 0.0)) {
        fail_answer(path, "the level set's size");
    }
    set.grid = FloatGrid::create(tree);
    return set;
}

// --- messages: voxels

void encode_blocks(vshi_encoder *encoder, const std::string &grid, const Matrix &matrix,
                   const std::vector<vshi_block> &blocks) {
    vshi_encode_text(encoder, grid.c_str());
    vshi_encode_array(encoder, matrix.data(), matrix.size(), sizeof matrix[0]);
    vshi_encode_count(encoder, blocks.size());
    for (const vshi_block &block : blocks) { // one by one: the struct's padding may hold anything
        vshi_encode_array(encoder, block.origin, 3, sizeof block.origin[0]);
        vshi_encode_array(encoder, block.mask, VSHI_MASK_WORDS, sizeof block.mask[0]);
    }
}

std::vector<vshi_block> decode_blocks(vshi_decoder *decoder, const char *path, std::string &grid,
                                      Matrix &matrix) {
    constexpr size_t BLOCK_BYTES = 80;
    const char *name = vshi_decode_text(decoder, false);
    grid = name != nullptr ? name : "";
    matrix = decode_matrix(decoder);
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
        const bool rises = blocks.empty() || comes_before(blocks.back(), block);
        if (!rises || !is_aligned(block.origin, 8)) {
            fail_answer(path, "a block's place");
        }
        blocks.push_back(block);
    }
    if (name == nullptr || !vshi_decoder_ends(decoder) || blocks.size() != count) {
        fail_answer(path, "the voxels' number");
    }
    return blocks;
}

// --- requests

bool Answer::poll(void *user, double fraction) {
    Stage &stage = *static_cast<Stage *>(user);
    stage.reach(0.25 * fraction);
    return stage.cancelled();
}

vshi_decoder *Answer::ask(int32_t kind, const char *path, const std::function<void(vshi_encoder *)> &encode) {
    const auto request = std::make_unique<vshi_exchange>();
    require(vshi_exchange_begin, request.get(), kind, path, &stage.options);
    encode(&request->encoder);
    require(vshi_exchange_send, request.get(), poll, &stage, &answer);
    stage.check();
    return &answer.payload;
}

void end_request(vshi_decoder *request, const char *path) {
    if (!vshi_decoder_ends(request)) {
        refuse(VSH_ERROR_INTERNAL, "%s: the request to its reader is bad", path);
    }
}

namespace {

vsh_grid *read(const char *path, const char *name, const vsh_run &run) {
    Stage stage(run, "load");
    stage.check();
    LevelSet set{{path, ""}, nullptr, {}, 0.0};
    if (run.reader != nullptr) {
        Answer answer(stage);
        const auto encode = [&](vshi_encoder *to) { vshi_encode_text(to, name); };
        set = decode_level_set(answer.ask(VSHI_READ_GRID, path, encode), path);
        refuse_bad(set.name, examine_matrix(set.matrix));
    } else {
        set = load_level_set(path, name, stage);
    }
    stage.reach(0.3);
    return close_level_set(set, stage);
}

// --- lists: plain structs, with texts that end

template <size_t Capacity> bool is_text(const char (&text)[Capacity], bool lines = false) {
    const size_t length = strnlen(text, Capacity);
    const auto is_control = [&](char c) {
        return !(lines && c == '\n') && (static_cast<unsigned char>(c) < 0x20 || c == 0x7f);
    };
    return length < Capacity && std::none_of(text, text + length, is_control);
}

std::vector<vsh_vdb_entry> decode_list(vshi_decoder *decoder, const char *path, size_t capacity,
                                       size_t *count) {
    const uint64_t all = vshi_decode_count(decoder, UINT32_MAX),
                   listed = vshi_decode_count(decoder, capacity);
    const auto *from =
        static_cast<const vsh_vdb_entry *>(vshi_decode_array(decoder, listed, sizeof(vsh_vdb_entry)));
    if (!vshi_decoder_ends(decoder) || listed > all) {
        fail_answer(path, "the list's size");
    }
    *count = size_t(all);
    std::vector<vsh_vdb_entry> entries(from, from + listed);
    for (const vsh_vdb_entry &entry : entries) {
        if (!is_text(entry.name) || !is_text(entry.type) || !is_text(entry.grid_class) ||
            !is_text(entry.problem) || !is_text(entry.attributes, true)) {
            fail_answer(path, "a text");
        }
    }
    return entries;
}

void list(const char *path, const vsh_run &run, vsh_vdb_entry *entries, size_t capacity, size_t *count) {
    std::vector<vsh_vdb_entry> found;
    if (run.reader != nullptr) {
        Stage stage(run, "load");
        Answer answer(stage);
        const auto encode = [&](vshi_encoder *to) { vshi_encode_count(to, capacity); };
        found = decode_list(answer.ask(VSHI_READ_LIST, path, encode), path, capacity, count);
    } else {
        *count = list_grids(path, run, found, capacity);
    }
    std::copy(found.begin(), found.end(), entries);
}

// --- dense copies

using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>; // x fastest, as in pictures

struct CopyGrid {
    const openvdb::CoordBBox &box;
    float *values;
    float *active;

    template <typename GridType> void operator()(const GridType &grid) const {
        const auto &tree = grid.constTree();
        if constexpr (std::is_same_v<GridType, openvdb::MaskGrid>) {
            copy_active(tree, values);
        } else if (values != nullptr) {
            Dense dense(box, values);
            openvdb::tools::copyToDense(tree, dense, true);
        }
        copy_active(tree, active);
    }

    template <typename Tree> void copy_active(const Tree &tree, float *to) const {
        if (to != nullptr) {
            Dense dense(box, to);
            openvdb::tools::copyToDense(openvdb::BoolTree(tree, false, true, openvdb::TopologyCopy()), dense,
                                        true);
        }
    }
};

// A box of a grid to copy.
struct CopyRequest {
    const char *path, *name;
    int32_t low[3], size[3];

    size_t count() const { return size_t(size[0]) * size_t(size[1]) * size_t(size[2]); }
};

openvdb::CoordBBox box_of(const CopyRequest &request) {
    const int32_t *size = request.size;
    const openvdb::CoordBBox box = box_to_copy(request.low, size);
    if (double(size[0]) * double(size[1]) * double(size[2]) > double(INT32_MAX)) {
        refuse(VSH_ERROR_ARGUMENT, "copy of %d × %d × %d voxels: expected up to 2^31 - 1", size[0], size[1],
               size[2]);
    }
    return box;
}

// `values` and `active` may be NULL.
void copy(const CopyRequest &request, const vsh_run &run, float *values, float *active) {
    const openvdb::CoordBBox box = box_of(request);
    Stage stage(run, "load");
    stage.check();
    if (run.reader == nullptr) {
        const openvdb::GridBase::Ptr grid = read_numbers(request.path, request.name, run);
        stage.check();
        grid->apply<NumberGrids>(CopyGrid{box, values, active});
        return;
    }
    Answer answer(stage);
    const auto encode = [&](vshi_encoder *to) {
        vshi_encode_text(to, request.name);
        vshi_encode_array(to, request.low, 3, sizeof request.low[0]);
        vshi_encode_array(to, request.size, 3, sizeof request.size[0]);
        vshi_encode_count(to, values != nullptr);
        vshi_encode_count(to, active != nullptr);
    };
    vshi_decoder *payload = answer.ask(VSHI_READ_COPY, request.path, encode);
    for (float *to : {values, active}) {
        const void *from = to != nullptr ? vshi_decode_array(payload, request.count(), sizeof *to) : nullptr;
        if (from != nullptr) {
            std::memcpy(to, from, request.count() * sizeof *to);
        }
    }
    if (!vshi_decoder_ends(payload)) {
        fail_answer(request.path, "the copy's size");
    }
}

} // namespace

} // namespace vshi

vsh_result vshi_serve_grid(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::guard_run(run, error, VSH_ERROR_READ, path, [&](const vsh_run &full) {
        const char *name = vshi_decode_text(request, false);
        vshi::end_request(request, path);
        vshi::Stage stage(full, "load");
        vshi::encode_level_set(payload, vshi::load_level_set(path, name, stage));
    });
}

vsh_result vshi_serve_list(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::guard_run(run, error, VSH_ERROR_READ, path, [&](const vsh_run &full) {
        const uint64_t capacity = vshi_decode_count(request, UINT64_MAX);
        vshi::end_request(request, path);
        std::vector<vsh_vdb_entry> found;
        vshi_encode_count(payload, vshi::list_grids(path, full, found, capacity));
        vshi_encode_count(payload, found.size());
        vshi_encode_array(payload, found.data(), found.size(), sizeof(vsh_vdb_entry));
    });
}

vsh_result vshi_serve_copy(const char *path, vshi_decoder *request, const vsh_run *run, vshi_encoder *payload,
                           vsh_error *error) {
    return vshi::guard_run(run, error, VSH_ERROR_READ, path, [&](const vsh_run &full) {
        vshi::CopyRequest box{path, vshi_decode_text(request, false), {}, {}};
        for (int32_t *to : {box.low, box.size}) {
            const void *from = vshi_decode_array(request, 3, sizeof *to);
            if (from != nullptr) {
                std::memcpy(to, from, 3 * sizeof *to);
            }
        }
        const bool has_values = vshi_decode_count(request, 1) != 0;
        const bool has_active = vshi_decode_count(request, 1) != 0;
        vshi::end_request(request, path);
        vshi::box_of(box); // before memory is allocated
        std::vector<float> values(has_values ? box.count() : 0), active(has_active ? box.count() : 0);
        vshi::copy(box, full, has_values ? values.data() : nullptr, has_active ? active.data() : nullptr);
        vshi_encode_array(payload, values.data(), values.size(), sizeof(float));
        vshi_encode_array(payload, active.data(), active.size(), sizeof(float));
    });
}

vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                         vsh_error *error) {
    VSHI_MAKES(grid);
    VSHI_NEEDS(path);
    return vshi::guard_run(run, error, VSH_ERROR_READ, path,
                           [&](const vsh_run &full) { *grid = vshi::read(path, name, full); });
}

vsh_result vsh_vdb_list(const char *path, const vsh_run *run, vsh_vdb_entry *entries, size_t capacity,
                        size_t *count, vsh_error *error) {
    VSHI_NEEDS(count);
    *count = 0;
    VSHI_NEEDS(path);
    VSHI_NEEDS_OF(capacity, entries);
    return vshi::guard_run(run, error, VSH_ERROR_READ, path,
                           [&](const vsh_run &full) { vshi::list(path, full, entries, capacity, count); });
}

vsh_result vshi_vdb_copy(const char *path, const char *name, const int32_t index_min[3],
                         const int32_t size[3], const vsh_run *run, float *values, float *active,
                         vsh_error *error) {
    VSHI_NEEDS_BOTH(path, index_min);
    VSHI_NEEDS(size);
    return vshi::guard_run(run, error, VSH_ERROR_READ, path, [&](const vsh_run &full) {
        vshi::copy({path, name, {index_min[0], index_min[1], index_min[2]}, {size[0], size[1], size[2]}},
                   full, values, active);
    });
}
