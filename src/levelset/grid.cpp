// The handle of a level set: what it tells, and what the field reads of it.
#include "levelset/grid.h"

#include "base/parallel.h"
#include "base/try.h"
#include "levelset/bits.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>
#include <tbb/info.h>
#include <unistd.h>
#include <vector>

namespace vshi {

namespace {

// Indices are kept where OpenVDB's own arithmetic on them (sums, boxes, leaves beside leaves) cannot
// overflow.
constexpr double LARGEST_INDEX = 268435456.0;

// OpenVDB's maps cannot be constructed with a voxel whose volume is below this: they take it for singular.
constexpr double SINGULAR = 3e-15;

void fail_option(vsh_error *error, const char *name, double value, const char *expected) {
    throw Failure{
        vshi_fail(error, VSH_ERROR_ARGUMENT, "grid options: %s %g: expected %s", name, value, expected)};
}

vsh_grid_options resolve(const vsh_grid_options *given, vsh_error *error) {
    vsh_grid_options options = vsh_grid_options_default();
    require(vshi_options_resolve(given, &options, sizeof options, "vsh_grid_options", error));
    if (!(options.voxel_size >= 0.0 && std::isfinite(options.voxel_size))) {
        fail_option(error, "voxel_size", options.voxel_size, "more than 0, or 0 for one from the resolution");
    }
    if (options.voxel_size == 0.0 && (options.resolution < 2 || options.resolution > 65536)) {
        fail_option(error, "resolution", options.resolution, "2 … 65536");
    }
    if (!(options.half_width >= 3.0 && options.half_width <= 100.0)) {
        fail_option(error, "half_width", options.half_width, "3 … 100 voxels");
    }
    if (!(options.shell_thickness >= 1.0 && options.shell_thickness <= 50.0)) {
        fail_option(error, "shell_thickness", options.shell_thickness, "1 … 50 voxels");
    }
    return options;
}

} // namespace

openvdb::math::Transform::Ptr Lattice::transform() const {
    using Map = openvdb::math::UniformScaleTranslateMap;
    if (voxel * voxel * voxel > 1.01 * SINGULAR) {
        auto transform = openvdb::math::Transform::createLinearTransform(voxel);
        transform->postTranslate(translation);
        return transform;
    }
    // Read as from a file, where every size is taken: the map's name, then its members in their order.
    openvdb::initialize();
    const Vec3d size(voxel), inverse(1.0 / voxel);
    std::stringstream text;
    openvdb::io::setCurrentVersion(text);
    openvdb::writeString(text, Map::mapType());
    for (const Vec3d &member : {translation, size, size, inverse, inverse * inverse, 0.5 * inverse}) {
        member.write(text);
    }
    const auto transform = std::make_shared<openvdb::math::Transform>();
    transform->read(text);
    return transform;
}

Lattice make_lattice(const vsh_grid_options *given, const Vec3d &low, const Vec3d &high, vsh_error *error) {
    const vsh_grid_options options = resolve(given, error);
    const Vec3d size = high - low;
    const double longest = std::max(size[0], std::max(size[1], size[2]));
    Lattice lattice{options.voxel_size, options.half_width, options.shell_thickness, Vec3d(0.0)};
    if (lattice.voxel == 0.0) {
        if (!(longest > 0.0)) {
            throw Failure{vshi_fail(error, VSH_ERROR_INPUT,
                                    "the casters' box has no size: no voxel size follows from resolution %d",
                                    options.resolution)};
        }
        lattice.voxel = longest / options.resolution;
    }
    if (!(0.5 * longest / lattice.voxel + lattice.half_width + lattice.shell < LARGEST_INDEX)) {
        throw Failure{vshi_fail(error, VSH_ERROR_LIMIT,
                                "voxel size %g: %g voxels along the longest side, %g at most", lattice.voxel,
                                longest / lattice.voxel, 2.0 * LARGEST_INDEX)};
    }
    if (!(lattice.voxel >= SMALLEST_VOXEL && lattice.voxel <= LARGEST_VOXEL)) {
        throw Failure{vshi_fail(error, VSH_ERROR_LIMIT,
                                "voxel size %g: distances are kept for %g … %g; scale the scene",
                                lattice.voxel, SMALLEST_VOXEL, LARGEST_VOXEL)};
    }
    for (int i = 0; i < 3; ++i) {
        const double centre = low[i] + 0.5 * size[i];
        lattice.translation[i] = lattice.voxel * std::round(centre / lattice.voxel);
        // A voxel must be many steps of a double there, or positions would fall together.
        if (!(std::fabs(lattice.translation[i]) / lattice.voxel < 1e12)) {
            throw Failure{vshi_fail(error, VSH_ERROR_LIMIT,
                                    "voxel size %g: %g voxels from the origin, 1e12 at most", lattice.voxel,
                                    std::fabs(centre / lattice.voxel))};
        }
    }
    return lattice;
}

// A surface of A voxel² has about A/64 leaves a layer, and a band of half width b passes (2 b + 12)/8 layers.
// A wide band around a small solid takes more, by Steiner's formula for its box, but nothing beyond that box.
double band_leaves(double area, const Vec3d &sides, double half_width) {
    const double b = half_width;
    const double around = M_PI * b * b * (sides[0] + sides[1] + sides[2] + 4.0 / 3.0 * b);
    const double most = (sides[0] + 2.0 * b + 8.0) * (sides[1] + 2.0 * b + 8.0) * (sides[2] + 2.0 * b + 8.0);
    return std::min(area * (2.0 * b + 12.0) + around, most) / double(Leaf::SIZE);
}

vsh_result check_bytes(const vsh_run *run, double bytes, const char *what, vsh_error *error) {
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    const double machine = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
    if (machine > 0.0 && bytes > machine) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: about %.0f MB are needed, over this machine's memory of %.0f MB", what,
                         bytes / 1e6, machine / 1e6);
    }
    return VSH_OK;
}

void check_memory(const vsh_run *run, double voxel, double leaves, double bytes, vsh_error *error) {
    char what[128];
    std::snprintf(what, sizeof what, "voxel size %g (about %.3g voxels)", voxel, leaves * double(Leaf::SIZE));
    require(check_bytes(run, bytes, what, error));
}

// Of an arena. TBB prints a warning where one asks for more threads than the machine has cores.
static int slots(const vshi_job *job) {
    if (job == nullptr) {
        throw std::bad_alloc();
    }
    vshi_parallel_threads(0); // OpenVDB frees trees on all cores, whatever the arena
    const int threads = vshi_job_threads(job);
    return threads > 0 ? std::min(threads, tbb::info::default_concurrency()) : tbb::task_arena::automatic;
}

Stage::Stage(const vsh_run &run, const char *name, vsh_error *error_)
    : options(run), job(vshi_job_begin(&run, name, UNITS)), error(error_), arena(slots(job)) {}

void Stage::reach(double fraction) {
    const size_t target = size_t(std::clamp(fraction, 0.0, 1.0) * double(UNITS));
    size_t before = reached.load();
    while (before < target && !reached.compare_exchange_weak(before, target)) {
    }
    vshi_job_advance(job, before < target ? target - before : 0);
}

void Stage::check() {
    if (cancelled()) {
        throw Failure{vshi_job_fail_cancelled(job, error)};
    }
}

namespace {

void set_transform(vsh_grid &grid) {
    const openvdb::math::Transform &transform = grid.level_set->transform();
    const Vec3d origin = transform.indexToWorld(Vec3d(0.0));
    for (int column = 0; column < 3; ++column) {
        Vec3d unit(0.0);
        unit[column] = 1.0;
        const Vec3d axis = transform.baseMap()->applyJacobian(unit);
        for (int row = 0; row < 3; ++row) {
            grid.transform[4 * row + column] = axis[row];
        }
    }
    for (int row = 0; row < 3; ++row) {
        grid.transform[4 * row + 3] = origin[row];
    }
}

void set_bounds(vsh_grid_info &info, const double *transform, const openvdb::CoordBBox &voxels) {
    for (int row = 0; row < 3; ++row) {
        double low = transform[4 * row + 3];
        double high = low;
        for (int column = 0; column < 3; ++column) {
            const double a = transform[4 * row + column] * voxels.min()[column];
            const double b = transform[4 * row + column] * voxels.max()[column];
            low += std::min(a, b);
            high += std::max(a, b);
        }
        info.bounds_min[row] = low;
        info.bounds_max[row] = high;
    }
}

// What closing a leaf finds out: the box of voxels inside the surface or next to it.
struct Closed {
    openvdb::CoordBBox box;
    size_t active = 0;
    bool uniform = true; // all of one sign
};

Closed close_leaf(Leaf &leaf, float background, float voxel) {
    Closed closed;
    float *const values = leaf.buffer().data();
    const bool first = std::signbit(values[0]);
    Leaf::NodeMaskType active;
    uint64_t across = 0, planes = 0; // of those in the box: seen along x, and which x
    for (openvdb::Index x = 0; x < Leaf::DIM; ++x) {
        uint8_t within[64], low[64], others[64], beyond[64];
        float *const plane = values + 64 * x;
        for (int i = 0; i < 64; ++i) {
            const float value = plane[i], size = std::fabs(value);
            within[i] = size < background;
            low[i] = value < voxel;
            others[i] = std::signbit(value) != first;
            beyond[i] = !(size <= background);
        }
        if (pack_plane(beyond) != 0) { // else nothing is to be written
            for (int i = 0; i < 64; ++i) {
                plane[i] = beyond[i] != 0 ? std::copysign(background, plane[i]) : plane[i];
            }
        }
        const uint64_t word = pack_plane(within), lower = pack_plane(low);
        active.getWord<uint64_t>(x) = word;
        closed.active += size_t(__builtin_popcountll(word));
        closed.uniform &= pack_plane(others) == 0;
        across |= lower;
        planes |= uint64_t(lower != 0) << x;
    }
    leaf.setValueMask(active);
    if (planes != 0) {
        uint64_t rows = across | across >> 32; // all of its y together, as z
        rows |= rows >> 16;
        rows = (rows | rows >> 8) & 0xff;
        const int z[2] = {__builtin_ctzll(rows), 63 - __builtin_clzll(rows)};
        const Coord low(__builtin_ctzll(planes), __builtin_ctzll(across) >> 3, z[0]);
        const Coord high(63 - __builtin_clzll(planes), (63 - __builtin_clzll(across)) >> 3, z[1]);
        closed.box = openvdb::CoordBBox(leaf.origin() + low, leaf.origin() + high);
    }
    return closed;
}

} // namespace

vsh_grid *close_grid(const FloatGrid::Ptr &level_set, double shell, Stage &stage) {
    auto grid = std::make_unique<vsh_grid>();
    grid->level_set = level_set;
    level_set->setGridClass(openvdb::GRID_LEVEL_SET);
    set_transform(*grid);
    const double voxel =
        std::sqrt(grid->transform[0] * grid->transform[0] + grid->transform[4] * grid->transform[4] +
                  grid->transform[8] * grid->transform[8]);
    const float background = level_set->background();

    std::vector<Leaf *> leaves;
    level_set->tree().getNodes(leaves);
    std::vector<Closed> closed(leaves.size());
    stage.loop(leaves.size(), 64, 1.0, 1.0,
               [&](size_t i) { closed[i] = close_leaf(*leaves[i], background, float(voxel)); });

    openvdb::CoordBBox box;
    vsh_grid_info info{};
    for (size_t i = 0; i < leaves.size(); ++i) {
        box.expand(closed[i].box);
        info.active_voxels += closed[i].active;
        if (closed[i].active == 0 && closed[i].uniform) {
            const float value = leaves[i]->getFirstValue(); // a copy: the tile takes the leaf's place
            level_set->tree().addTile(1, leaves[i]->origin(), value, false);
        }
    }
    info.voxel_size = voxel;
    info.half_width = double(background) / voxel;
    info.shell_thickness = shell;
    info.bytes = level_set->memUsage();
    if (!box.empty()) {
        set_bounds(info, grid->transform, box);
    }
    const openvdb::CoordBBox band = level_set->evalActiveVoxelBoundingBox();
    for (int axis = 0; axis < 3; ++axis) {
        info.index_min[axis] = band.empty() ? 0 : band.min()[axis];
        info.index_max[axis] = band.empty() ? 0 : band.max()[axis];
    }
    std::copy(std::begin(grid->transform), std::end(grid->transform), info.transform);
    grid->info = info;
    return grid.release();
}

} // namespace vshi

void vsh_grid_get_info(const vsh_grid *grid, vsh_grid_info *info) {
    *info = grid->info;
}

void vsh_grid_free(vsh_grid *grid) {
    delete grid;
}

size_t vshi_grid_leaves(const vsh_grid *grid, vshi_leaf *leaves, size_t capacity) {
    const openvdb::FloatTree &tree = grid->level_set->constTree();
    size_t count = 0;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf, ++count) {
        if (count < capacity) {
            const openvdb::Coord origin = leaf->origin();
            leaves[count] = {{origin[0], origin[1], origin[2]}, leaf->buffer().data()};
        }
    }
    std::sort(leaves, leaves + std::min(count, capacity), [](const vshi_leaf &a, const vshi_leaf &b) {
        return std::lexicographical_compare(a.origin, a.origin + 3, b.origin, b.origin + 3);
    });
    return count;
}

void vshi_grid_block_signs(const vsh_grid *grid, const int32_t origin[3], const int32_t size[3],
                           int8_t *signs) {
    openvdb::FloatGrid::ConstUnsafeAccessor tree(grid->level_set->constTree());
    for (int32_t x = 0; x < size[0]; ++x) {
        for (int32_t y = 0; y < size[1]; ++y) {
            for (int32_t z = 0; z < size[2]; ++z) {
                const openvdb::Coord block(origin[0] + 8 * x, origin[1] + 8 * y, origin[2] + 8 * z);
                *signs++ = tree.getValue(block) < 0.0f ? -1 : 1;
            }
        }
    }
}

const double *vshi_grid_transform(const vsh_grid *grid) {
    return grid->transform;
}
