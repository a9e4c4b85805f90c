// Volumes: the voxels to shade (a level set's band, a box, another grid's active voxels), the leaves that
// hold their values, and the trees made of these.
#include "levelset/file.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <openvdb/tools/Prune.h>

namespace vshi {

namespace {

constexpr float BACKGROUND = 1.0f; // lit, and open: voxels that were not shaded darken nothing

// A block's values in one grid: a leaf, a tile, or none.
struct Slot {
    std::unique_ptr<Leaf> leaf;
    float tile = 0.0f;
    bool is_tile = false;
};

struct Channel {
    vshi_channel what;
    std::vector<Slot> slots; // [blocks]; empty once closed
    FloatTree::Ptr tree;     // once closed
    vsh_volume_grid info{};
};

// Shared by the voxels and by the volumes made on them.
struct VoxelSet {
    std::vector<vshi_block> blocks; // sorted by origin
    Matrix matrix{};
    double least_axis = 0.0; // shortest axis of a voxel, world units
};

// The content of a vsh_voxels handle.
struct Voxels : vsh_voxels {
    std::shared_ptr<const VoxelSet> set;
};

const std::shared_ptr<const VoxelSet> &set_of(const vsh_voxels *voxels) {
    return static_cast<const Voxels *>(voxels)->set;
}

} // namespace

} // namespace vshi

struct vsh_volume {
    std::shared_ptr<const vshi::VoxelSet> set;
    std::vector<vshi::Channel> channels;
    vsh_volume_info info{};
};

namespace vshi {

namespace {

// --- voxels

constexpr double FARTHEST = 1e12;      // voxels from the origin: doubles must tell voxels apart there
constexpr double ROUNDING = 1e-6;      // voxels by which a box may be longer without another voxel
constexpr double BAND_ROUNDING = 1e-6; // share of a band's width: the background is a float

void grow_index_box(vsh_voxels_info &info, const vshi_block &block) {
    for (int v = 0; v < VSHI_BLOCK_VOXELS; ++v) {
        const int offset[3] = {v >> 6, v >> 3 & 7, v & 7};
        for (int axis = 0; axis < 3 && (block.mask[v >> 6] >> (v & 63) & 1) != 0; ++axis) {
            info.index_min[axis] = std::min(info.index_min[axis], block.origin[axis] + offset[axis]);
            info.index_max[axis] = std::max(info.index_max[axis], block.origin[axis] + offset[axis]);
        }
    }
}

// Sets the box of the centres; false if it is not finite.
bool set_bounds(const VoxelSet &set, vsh_voxels_info &info) {
    const double *m = set.matrix.data();
    bool finite = true;
    std::fill_n(info.bounds_min, 3, std::numeric_limits<double>::max());
    std::fill_n(info.bounds_max, 3, std::numeric_limits<double>::lowest());
    for (int axis = 0; axis < 3; ++axis) {
        info.voxel_size[axis] = axis_of(m, axis).length();
        finite = finite && info.voxel_size[axis] > 0.0;
    }
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3d at = apply(m, Vec3d((corner & 1 ? info.index_max : info.index_min)[0],
                                        (corner & 2 ? info.index_max : info.index_min)[1],
                                        (corner & 4 ? info.index_max : info.index_min)[2]));
        for (int axis = 0; axis < 3; ++axis) {
            info.bounds_min[axis] = std::min(info.bounds_min[axis], at[axis]);
            info.bounds_max[axis] = std::max(info.bounds_max[axis], at[axis]);
            finite = finite && std::isfinite(at[axis]);
        }
    }
    return finite;
}

void check_blocks(const vsh_run &run, double count, const char *what) {
    check_bytes(run, count * double(sizeof(vshi_block)), what);
}

// Makes a handle; `what` names the voxels in messages.
vsh_voxels *close_voxels(VoxelSet &&set, bool normals, const char *what) {
    vsh_voxels_info info{};
    std::fill_n(info.index_min, 3, std::numeric_limits<int32_t>::max());
    std::fill_n(info.index_max, 3, std::numeric_limits<int32_t>::min());
    for (const vshi_block &block : set.blocks) {
        for (const uint64_t word : block.mask) {
            info.count += uint64_t(__builtin_popcountll(word));
        }
        grow_index_box(info, block);
    }
    if (info.count == 0) {
        refuse(VSH_ERROR_INPUT, "%s: no active voxels", what);
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (info.index_min[axis] < -LARGEST_INDEX || info.index_max[axis] > LARGEST_INDEX) {
            refuse(VSH_ERROR_INPUT, "%s: voxels %d to %d: indices may go to %d", what, info.index_min[axis],
                   info.index_max[axis], LARGEST_INDEX);
        }
    }
    if (!set_bounds(set, info)) {
        refuse(VSH_ERROR_INPUT, "%s: its transform holds values that are not finite", what);
    }
    set.blocks.shrink_to_fit();
    info.blocks = set.blocks.size();
    info.bytes = sizeof(Voxels) + sizeof set + set.blocks.size() * sizeof(vshi_block);
    info.has_normals = normals;
    set.least_axis = std::min({info.voxel_size[0], info.voxel_size[1], info.voxel_size[2]});
    auto made = std::make_unique<Voxels>();
    made->set = std::make_shared<const VoxelSet>(std::move(set));
    made->blocks = made->set->blocks.data();
    std::copy(made->set->matrix.begin(), made->set->matrix.end(), made->matrix);
    made->info = info;
    return made.release();
}

// --- the band of a level set

vsh_voxels *from_grid(const vsh_grid &grid, double band, const vsh_run &run) {
    const double widest = grid.info.half_width;
    if (!(band >= 0.0 && band <= widest * (1.0 + BAND_ROUNDING))) {
        refuse(VSH_ERROR_ARGUMENT, "band of %g voxels: expected 0 … %g, the half width of the level set",
               band, widest);
    }
    const FloatTree &tree = grid.level_set->constTree();
    check_blocks(run, double(tree.leafCount()), "voxels of a band");
    const float most = float((band > 0.0 ? band : widest) * grid.info.voxel_size);
    VoxelSet set;
    std::copy_n(grid.info.transform, 12, set.matrix.begin());
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        vshi_block block{{leaf->origin()[0], leaf->origin()[1], leaf->origin()[2]}, {}};
        uint64_t any = 0;
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            if (std::fabs(*value) <= most) {
                block.mask[value.pos() >> 6] |= uint64_t(1) << (value.pos() & 63);
                any = 1;
            }
        }
        if (any != 0) {
            set.blocks.push_back(block);
        }
    }
    std::sort(set.blocks.begin(), set.blocks.end(), comes_before<vshi_block>);
    return close_voxels(std::move(set), true, "band");
}

// --- a box

vshi_block box_block(const Coord &origin, const int32_t size[3]) {
    vshi_block block{{origin[0], origin[1], origin[2]}, {}};
    for (int v = 0; v < VSHI_BLOCK_VOXELS; ++v) {
        const bool within = origin[0] + (v >> 6) < size[0] && origin[1] + (v >> 3 & 7) < size[1] &&
                            origin[2] + (v & 7) < size[2];
        block.mask[v >> 6] |= uint64_t(within) << (v & 63);
    }
    return block;
}

vsh_voxels *from_box(const double low[3], const double high[3], double voxel, const vsh_run &run) {
    if (!(voxel > 0.0 && std::isfinite(voxel))) {
        refuse(VSH_ERROR_ARGUMENT, "box: voxel size %g: expected more than 0", voxel);
    }
    if (voxel < SMALLEST_WRITTEN || voxel > LARGEST_VOXEL) {
        refuse(VSH_ERROR_LIMIT, "box: voxel size %g: expected %g … %g", voxel, SMALLEST_WRITTEN,
               LARGEST_VOXEL);
    }
    int32_t size[3];
    double blocks = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(std::isfinite(low[axis]) && std::isfinite(high[axis]) && low[axis] < high[axis])) {
            refuse(VSH_ERROR_ARGUMENT,
                   "box: %g … %g along %c: expected finite bounds, the second above the first", low[axis],
                   high[axis], "xyz"[axis]);
        }
        const double voxels = std::max(1.0, std::ceil((high[axis] - low[axis]) / voxel - ROUNDING));
        const double far = std::max(std::fabs(low[axis]), std::fabs(high[axis])) / voxel;
        if (!(voxels <= LARGEST_INDEX && far <= FARTHEST)) {
            refuse(VSH_ERROR_LIMIT,
                   "box: voxel size %g: %g voxels along %c, %g from the origin; at most %d and %g", voxel,
                   voxels, "xyz"[axis], far, LARGEST_INDEX, FARTHEST);
        }
        size[axis] = int32_t(voxels);
        blocks *= std::ceil(voxels / 8.0);
    }
    char what[96];
    std::snprintf(what, sizeof what, "box of %d x %d x %d voxels", size[0], size[1], size[2]);
    // with the values of one grid, without which the voxels are of no use
    check_bytes(run, blocks * (double(sizeof(vshi_block)) + BYTES_PER_LEAF), what);
    VoxelSet set;
    for (size_t axis = 0; axis < 3; ++axis) {
        set.matrix[5 * axis] = voxel;
        set.matrix[4 * axis + 3] = low[axis] + 0.5 * voxel;
    }
    set.blocks.reserve(size_t(blocks));
    visit_blocks({Coord(0), Coord(size[0] - 1, size[1] - 1, size[2] - 1)}, 8,
                 [&](const Coord &origin) { set.blocks.push_back(box_block(origin, size)); });
    return close_voxels(std::move(set), false, what);
}

// --- another grid's active voxels

// Blocks of a tree's leaves, and of its active tiles.
struct Topology {
    std::vector<vshi_block> &blocks;
    const vsh_run &run;
    const char *what;

    template <typename GridType> void operator()(const GridType &grid) const {
        using Tree = typename GridType::TreeType;
        const Tree &tree = grid.constTree();
        double count = double(tree.leafCount());
        const auto begin_tiles = [&] {
            auto tile = tree.cbeginValueOn();
            tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
            return tile;
        };
        for (auto tile = begin_tiles(); tile; ++tile) {
            count += double(tile.getVoxelCount()) / VSHI_BLOCK_VOXELS;
        }
        check_blocks(run, count, what);
        blocks.reserve(size_t(count));
        for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
            vshi_block block{{leaf->origin()[0], leaf->origin()[1], leaf->origin()[2]}, {}};
            for (openvdb::Index i = 0; i < VSHI_MASK_WORDS; ++i) {
                block.mask[i] = leaf->getValueMask().template getWord<uint64_t>(i);
            }
            if (!leaf->getValueMask().isOff()) {
                blocks.push_back(block);
            }
        }
        for (auto tile = begin_tiles(); tile; ++tile) {
            visit_blocks(tile.getBoundingBox(), 8, [&](const Coord &origin) {
                vshi_block block{{origin[0], origin[1], origin[2]}, {}};
                std::fill(block.mask, block.mask + VSHI_MASK_WORDS, ~uint64_t(0));
                blocks.push_back(block);
            });
        }
    }
};

// The blocks of a grid's active voxels, sorted.
std::vector<vshi_block> blocks_of(const openvdb::GridBase &grid, const char *what, const vsh_run &run) {
    std::vector<vshi_block> blocks;
    grid.apply<NumberGrids>(Topology{blocks, run, what});
    std::sort(blocks.begin(), blocks.end(), comes_before<vshi_block>);
    return blocks;
}

Matrix linear_matrix_of(const openvdb::GridBase &grid, const GridName &name) {
    if (!grid.transform().isLinear()) {
        refuse(VSH_ERROR_INPUT, "%s: its transform is a %s: expected a linear one", name.text().c_str(),
               grid.transform().mapType().c_str());
    }
    return matrix_of(grid.transform());
}

vsh_voxels *from_vdb(const char *path, const char *name, const vsh_run &run) {
    Stage stage(run, "load");
    stage.check();
    VoxelSet set;
    GridName what{path, ""};
    if (run.reader != nullptr) {
        Answer answer(stage);
        const auto encode = [&](vshi_encoder *to) { vshi_encode_text(to, name); };
        set.blocks = decode_blocks(answer.ask(VSHI_READ_VOXELS, path, encode), path, what.grid, set.matrix);
        check_blocks(run, double(set.blocks.size()), what.text().c_str());
    } else {
        const openvdb::GridBase::Ptr grid = read_numbers(path, name, run);
        what.grid = grid->getName();
        set.matrix = linear_matrix_of(*grid, what);
        set.blocks = blocks_of(*grid, what.text().c_str(), run);
        stage.check();
    }
    return close_voxels(std::move(set), false, what.text().c_str());
}

// --- values

bool every(const uint64_t *mask, uint64_t word) {
    return std::all_of(mask, mask + VSHI_MASK_WORDS, [&](uint64_t w) { return w == word; });
}

void settle(Slot &slot, const uint64_t *mask) {
    if (slot.leaf == nullptr) {
        return;
    }
    float *values = slot.leaf->buffer().data();
    if (every(mask, 0)) {
        slot.leaf.reset();
    } else if (every(mask, ~uint64_t(0)) &&
               std::all_of(values + 1, values + Leaf::SIZE, [&](float v) { return v == values[0]; })) {
        slot.is_tile = true;
        slot.tile = values[0];
        slot.leaf.reset();
    } else {
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
            const bool on = (mask[i >> 6] >> (i & 63) & 1) != 0;
            slot.leaf->setActiveState(i, on);
            values[i] = on ? values[i] : BACKGROUND;
        }
    }
}

void grow_tree(Channel &channel, const VoxelSet &set) {
    channel.tree = std::make_shared<FloatTree>(BACKGROUND);
    for (size_t b = 0; b < channel.slots.size(); ++b) {
        Slot &slot = channel.slots[b];
        if (slot.is_tile) {
            channel.tree->addTile(1, Coord(set.blocks[b].origin), slot.tile, true);
        } else if (slot.leaf != nullptr) {
            channel.tree->addLeaf(slot.leaf.release()); // which owns it even if it throws
        }
    }
    std::vector<Slot>().swap(channel.slots);
    // nodes whose tiles are all alike become tiles of the node above
    openvdb::tools::prune(*channel.tree, 0.0f, false);
    channel.info.active_voxels = channel.tree->activeVoxelCount();
    channel.info.leaves = channel.tree->leafCount();
    channel.info.tiles = channel.tree->activeTileCount();
    std::copy(std::begin(channel.what.name), std::end(channel.what.name), channel.info.name);
}

FloatGrid::Ptr to_grid(const Channel &channel, const VoxelSet &set, bool as_half) {
    const FloatGrid::Ptr grid =
        named_grid(channel.tree, set.matrix.data(), channel.what.name, openvdb::GRID_UNKNOWN);
    grid->setSaveFloatAsHalf(as_half);
    grid->insertMeta("description", openvdb::StringMetadata(channel.what.description));
    grid->insertMeta("vdbshade_method", openvdb::StringMetadata(channel.what.method));
    if (channel.what.light[0] != '\0') {
        grid->insertMeta("vdbshade_light", openvdb::StringMetadata(channel.what.light));
    }
    grid->insertMeta("vdbshade_caster_voxel_size", openvdb::DoubleMetadata(channel.what.caster_voxel_size));
    return grid;
}

const Channel &channel_of(const vsh_volume &volume, size_t grid) {
    if (grid >= volume.channels.size()) {
        refuse(VSH_ERROR_ARGUMENT, "grid %zu: the volume has %zu", grid, volume.channels.size());
    }
    return volume.channels[grid];
}

} // namespace

} // namespace vshi

vsh_result vsh_voxels_from_grid(const vsh_grid *grid, double band, const vsh_run *run, vsh_voxels **voxels,
                                vsh_error *error) {
    VSHI_MAKES(voxels);
    VSHI_NEEDS(grid);
    return vshi::guard_run(run, error, VSH_ERROR_INTERNAL, "band",
                           [&](const vsh_run &full) { *voxels = vshi::from_grid(*grid, band, full); });
}

vsh_result vsh_voxels_from_box(const double box_min[3], const double box_max[3], double voxel_size,
                               const vsh_run *run, vsh_voxels **voxels, vsh_error *error) {
    VSHI_MAKES(voxels);
    VSHI_NEEDS_BOTH(box_min, box_max);
    return vshi::guard_run(run, error, VSH_ERROR_INTERNAL, "box", [&](const vsh_run &full) {
        vshi::initialize();
        *voxels = vshi::from_box(box_min, box_max, voxel_size, full);
    });
}

vsh_result vsh_voxels_from_vdb(const char *path, const char *name, const vsh_run *run, vsh_voxels **voxels,
                               vsh_error *error) {
    VSHI_MAKES(voxels);
    VSHI_NEEDS(path);
    return vshi::guard_run(run, error, VSH_ERROR_READ, path,
                           [&](const vsh_run &full) { *voxels = vshi::from_vdb(path, name, full); });
}

vsh_result vshi_serve_voxels(const char *path, vshi_decoder *request, const vsh_run *run,
                             vshi_encoder *payload, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_READ, path, [&] {
        const char *name = vshi_decode_text(request, false);
        vshi::end_request(request, path);
        const openvdb::GridBase::Ptr grid = vshi::read_numbers(path, name, *run);
        const vshi::GridName what{path, grid->getName()};
        vshi::encode_blocks(payload, what.grid, vshi::linear_matrix_of(*grid, what),
                            vshi::blocks_of(*grid, what.text().c_str(), *run));
    });
}

void vsh_voxels_free(vsh_voxels *voxels) {
    delete static_cast<vshi::Voxels *>(voxels);
}

vsh_result vshi_volume_begin(const vsh_voxels *voxels, const vshi_channel *channels, size_t count,
                             const vsh_run *run, double held, vsh_volume **volume, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume", [&] {
        const size_t blocks = voxels->info.blocks;
        const double bytes =
            held + double(voxels->info.bytes) +
            double(blocks) * double(count) * (vshi::BYTES_PER_LEAF + double(sizeof(vshi::Slot)));
        const std::string what = std::to_string(count) + (count > 1 ? " grids" : " grid") + " of " +
                                 std::to_string(voxels->info.count) + " voxels";
        vshi::check_bytes(*run, bytes, what.c_str());
        auto made = std::make_unique<vsh_volume>();
        made->set = vshi::set_of(voxels);
        made->channels = std::vector<vshi::Channel>(count);
        for (size_t c = 0; c < count; ++c) {
            made->channels[c].what = channels[c];
            made->channels[c].slots.resize(blocks);
        }
        *volume = made.release();
    });
}

float *vshi_volume_values(vsh_volume *volume, size_t channel, size_t block) {
    vshi::Slot &slot = volume->channels[channel].slots[block];
    try {
        if (slot.leaf == nullptr) {
            slot.leaf = std::make_unique<vshi::Leaf>(openvdb::Coord(volume->set->blocks[block].origin),
                                                     vshi::BACKGROUND, false);
        }
        return slot.leaf->buffer().data();
    } catch (const std::bad_alloc &) {
        return nullptr;
    }
}

void vshi_volume_set_tile(vsh_volume *volume, size_t channel, size_t block, float value) {
    vshi::Slot &slot = volume->channels[channel].slots[block];
    slot.is_tile = true;
    slot.tile = value;
}

float vshi_volume_value(const vsh_volume *volume, size_t channel, size_t block, int voxel) {
    const vshi::Slot &slot = volume->channels[channel].slots[block];
    return slot.leaf != nullptr ? slot.leaf->buffer().data()[voxel] : slot.tile;
}

void vshi_volume_settle(vsh_volume *volume, size_t block, const uint64_t mask[VSHI_MASK_WORDS]) {
    for (vshi::Channel &channel : volume->channels) {
        vshi::settle(channel.slots[block], mask);
    }
}

vsh_result vshi_volume_close(vsh_volume *volume, const vsh_volume_info *counts, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume", [&] {
        volume->info = *counts;
        volume->info.grids = volume->channels.size();
        volume->info.bytes = 0;
        for (vshi::Channel &channel : volume->channels) {
            vshi::grow_tree(channel, *volume->set);
            volume->info.bytes += channel.tree->memUsage();
        }
    });
}

void vsh_volume_free(vsh_volume *volume) {
    delete volume;
}

void vsh_volume_get_info(const vsh_volume *volume, vsh_volume_info *info) {
    *info = volume->info;
}

void vsh_volume_get_grid(const vsh_volume *volume, size_t grid, vsh_volume_grid *info) {
    const vsh_volume_grid none{};
    *info = grid < volume->channels.size() ? volume->channels[grid].info : none;
}

vsh_result vsh_volume_copy(const vsh_volume *volume, size_t grid, const int32_t index_min[3],
                           const int32_t size[3], float *values, vsh_error *error) {
    VSHI_NEEDS_BOTH(volume, index_min);
    VSHI_NEEDS_BOTH(size, values);
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume", [&] {
        vshi::copy_dense(*vshi::channel_of(*volume, grid).tree, index_min, size, values);
    });
}

vsh_result vsh_volume_write(const vsh_volume *volume, const char *path, int32_t as_half,
                            const vsh_attribute *attributes, size_t attribute_count, vsh_error *error) {
    VSHI_NEEDS(volume);
    const auto make = [&] {
        std::vector<vshi::FloatGrid::Ptr> grids;
        for (const vshi::Channel &channel : volume->channels) {
            grids.push_back(vshi::to_grid(channel, *volume->set, as_half != 0));
        }
        return grids;
    };
    return vshi::write_grids(path, volume->set->least_axis, attributes, attribute_count, make, error);
}

vsh_result vsh_volume_to_openvdb(const vsh_volume *volume, size_t grid, uint32_t version, uint32_t abi,
                                 void *values, vsh_error *error) {
    VSHI_NEEDS_BOTH(volume, values);
    return vshi::guard(error, VSH_ERROR_LIMIT, "OpenVDB", [&] {
        vshi::check_openvdb(version, abi);
        *static_cast<openvdb::FloatGrid::ConstPtr *>(values) =
            vshi::to_grid(vshi::channel_of(*volume, grid), *volume->set, false);
    });
}
