// The grids of a volume: leaves that are filled block by block, and the trees made of them.
#include "base/attributes.h"
#include "base/try.h"
#include "levelset/file.h"
#include "levelset/voxels.h"

#include <cmath>
#include <limits>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/Prune.h>

namespace vshi {

namespace {

constexpr float BACKGROUND = 1.0f; // lit, and open: what was not shaded darkens nothing

// What becomes of a block in one grid.
struct Slot {
    std::unique_ptr<Leaf> leaf;
    float tile = 0.0f;
    bool is_tile = false;
};

struct Channel {
    vshi_channel what;
    std::string method;
    std::vector<Slot> slots; // [blocks], while it is made
    FloatTree::Ptr tree;     // afterwards
    vsh_volume_grid info{};
};

} // namespace

} // namespace vshi

struct vsh_volume {
    std::shared_ptr<const vshi::VoxelSet> set;
    std::vector<vshi::Channel> channels;
    vsh_volume_info info{};
};

namespace vshi {

namespace {

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
            channel.tree->addLeaf(slot.leaf.release()); // the tree's, also where it throws
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

vsh_result begin(const vsh_voxels &voxels, const vshi_channel *channels, size_t count, const vsh_run &run,
                 double held, vsh_volume **volume, vsh_error *error) {
    const double blocks = double(voxels.info.blocks);
    const double bytes =
        held + double(voxels.info.bytes) + blocks * double(count) * (BYTES_PER_LEAF + double(sizeof(Slot)));
    const std::string what = std::to_string(count) + (count > 1 ? " grids" : " grid") + " of " +
                             std::to_string(voxels.info.count) + " voxels";
    VSHI_TRY(check_bytes(&run, bytes, what.c_str(), error));
    auto made = std::make_unique<vsh_volume>();
    made->set = voxels.set;
    made->channels = std::vector<Channel>(count);
    for (size_t c = 0; c < count; ++c) {
        made->channels[c].what = channels[c];
        made->channels[c].method = channels[c].method;
        made->channels[c].slots.resize(voxels.set->blocks.size());
    }
    *volume = made.release();
    return VSH_OK;
}

FloatGrid::Ptr to_grid(const Channel &channel, const VoxelSet &set, bool as_half) {
    const FloatGrid::Ptr grid =
        named_grid(channel.tree, *set.transform, channel.what.name, openvdb::GRID_UNKNOWN);
    grid->setSaveFloatAsHalf(as_half);
    grid->insertMeta("description", openvdb::StringMetadata(channel.what.description));
    grid->insertMeta("vdbshade_method", openvdb::StringMetadata(channel.method));
    if (channel.what.light[0] != '\0') {
        grid->insertMeta("vdbshade_light", openvdb::StringMetadata(channel.what.light));
    }
    grid->insertMeta("vdbshade_caster_voxel_size", openvdb::DoubleMetadata(channel.what.caster_voxel_size));
    return grid;
}

const Channel &channel_of(const vsh_volume &volume, size_t grid, vsh_error *error) {
    if (grid >= volume.channels.size()) {
        throw Failure{vshi_fail(error, VSH_ERROR_ARGUMENT, "grid %zu: the volume has %zu", grid,
                                volume.channels.size())};
    }
    return volume.channels[grid];
}

} // namespace

} // namespace vshi

vsh_result vshi_volume_begin(const vsh_voxels *voxels, const vshi_channel *channels, size_t count,
                             const vsh_run *run, double held, vsh_volume **volume, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume",
                       [&] { return vshi::begin(*voxels, channels, count, *run, held, volume, error); });
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
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume", [&]() -> vsh_result {
        volume->info = *counts;
        volume->info.grids = volume->channels.size();
        volume->info.bytes = 0;
        for (vshi::Channel &channel : volume->channels) {
            vshi::grow_tree(channel, *volume->set);
            volume->info.bytes += channel.tree->memUsage();
        }
        return VSH_OK;
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

vsh_result vsh_volume_sample(const vsh_volume *volume, size_t grid, size_t count, const double *positions,
                             float *values, vsh_error *error) {
    VSHI_NEEDS(volume);
    VSHI_NEEDS_OF(count, positions);
    VSHI_NEEDS_OF(count, values);
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume", [&]() -> vsh_result {
        const vshi::FloatTree &tree = *vshi::channel_of(*volume, grid, error).tree;
        const openvdb::tree::ValueAccessor<const vshi::FloatTree> at(tree);
        constexpr double FARTHEST = 2147483646.0;
        for (size_t i = 0; i < count; ++i) {
            const double *p = positions + 3 * i;
            const vshi::Vec3d index = volume->set->transform->worldToIndex(vshi::Vec3d(p[0], p[1], p[2]));
            bool inside = true; // of what indices can say; false for NaN
            for (int axis = 0; axis < 3; ++axis) {
                inside = inside && std::fabs(index[axis]) < FARTHEST;
            }
            values[i] = inside ? openvdb::tools::BoxSampler::sample(at, index)
                               : std::numeric_limits<float>::quiet_NaN();
        }
        return VSH_OK;
    });
}

vsh_result vsh_volume_copy(const vsh_volume *volume, size_t grid, const int32_t index_min[3],
                           const int32_t size[3], float *values, vsh_error *error) {
    VSHI_NEEDS(volume);
    VSHI_NEEDS(index_min);
    VSHI_NEEDS(size);
    VSHI_NEEDS(values);
    return vshi::guard(error, VSH_ERROR_INTERNAL, "volume", [&]() -> vsh_result {
        const vshi::FloatTree &tree = *vshi::channel_of(*volume, grid, error).tree;
        return vshi::copy_dense(tree, index_min, size, values, error);
    });
}

vsh_result vsh_volume_write(const vsh_volume *volume, const char *path, int32_t as_half,
                            const vsh_attribute *attributes, size_t attribute_count, vsh_error *error) {
    VSHI_NEEDS(volume);
    return vshi::guard(error, VSH_ERROR_WRITE, path, [&] {
        vshi::initialize();
        VSHI_TRY(vshi_attributes_check(path, attributes, attribute_count, error));
        VSHI_TRY(vshi::check_writable(path, volume->set->least_axis, error));
        openvdb::GridCPtrVec grids;
        for (const vshi::Channel &channel : volume->channels) {
            const vshi::FloatGrid::Ptr grid = vshi::to_grid(channel, *volume->set, as_half != 0);
            vshi::put_attributes(*grid, attributes, attribute_count);
            grids.push_back(grid);
        }
        return vshi::write_grids(grids, path, error);
    });
}

vsh_result vsh_volume_to_openvdb(const vsh_volume *volume, size_t grid, uint32_t version, uint32_t abi,
                                 void *values, vsh_error *error) {
    VSHI_NEEDS(volume);
    VSHI_NEEDS(values);
    return vshi::guard(error, VSH_ERROR_LIMIT, "OpenVDB", [&] {
        vshi::check_openvdb(version, abi, error);
        *static_cast<openvdb::FloatGrid::ConstPtr *>(values) =
            vshi::to_grid(vshi::channel_of(*volume, grid, error), *volume->set, false);
        return VSH_OK;
    });
}
