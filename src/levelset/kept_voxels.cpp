// Voxels as a file of fields keeps them: blocks, and the map of their lattice.
#include "base/try.h"
#include "levelset/file.h"
#include "levelset/message.h"
#include "levelset/voxels.h"

#include <cmath>
#include <cstring>
#include <stdexcept>

namespace vshi {

namespace {

openvdb::math::Transform::Ptr transform_of(const vshi_map &map, const char *what, vsh_error *error) {
    try {
        const size_t length = strnlen(map.name, sizeof map.name);
        TransformData data{std::string(map.name, length), {}};
        for (uint64_t i = 0; i < map.count && i < VSHI_MAP_NUMBERS; ++i) {
            if (!std::isfinite(map.numbers[i])) {
                throw std::invalid_argument("its transform is not finite");
            }
            data.numbers.push_back(map.numbers[i]);
        }
        return restore_transform(data);
    } catch (const std::invalid_argument &) {
        throw Failure{vshi_fail(error, VSH_ERROR_INPUT, "%s: its transform is none of a level set", what)};
    }
}

} // namespace

} // namespace vshi

vsh_result vshi_voxels_map(const vsh_voxels *voxels, vshi_map *map, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_INTERNAL, "voxels", [&]() -> vsh_result {
        const vshi::TransformData data = vshi::describe_transform(*voxels->set->transform);
        *map = vshi_map{};
        if (data.map.size() >= sizeof map->name || data.numbers.size() > VSHI_MAP_NUMBERS) {
            return vshi_fail(error, VSH_ERROR_INPUT, "voxels: are of no level set");
        }
        std::memcpy(map->name, data.map.data(), data.map.size());
        map->count = data.numbers.size();
        std::copy(data.numbers.begin(), data.numbers.end(), map->numbers);
        return VSH_OK;
    });
}

vsh_result vshi_voxels_of_blocks(const vshi_map *map, const vshi_block *blocks, size_t count,
                                 const char *what, const vsh_run *run, vsh_voxels **voxels,
                                 vsh_error *error) {
    *voxels = nullptr;
    return vshi::guard(error, VSH_ERROR_INPUT, what, [&]() -> vsh_result {
        vshi::initialize();
        vshi::check_blocks(*run, double(count), what, error);
        vshi::VoxelSet set;
        set.transform = vshi::transform_of(*map, what, error);
        set.blocks.assign(blocks, blocks + count);
        *voxels = vshi::close_voxels(std::move(set), true, what, error);
        return VSH_OK;
    });
}
