// The handle of a level set: making it, what it tells, what the field reads of it, and the caller's own
// OpenVDB grids.
#include "levelset/grid.h"

#include "base/parallel.h"
#include "levelset/file.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <openvdb/tools/Dense.h>
#include <openvdb/version.h>
#include <tbb/info.h>
#include <unistd.h>
#include <vector>

template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
template class openvdb::Grid<openvdb::FloatTree>;

namespace vshi {

namespace {

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

// Restored as from a file, as OpenVDB cannot construct maps of the smallest voxels: it takes them for
// singular.
openvdb::math::Transform::Ptr Lattice::transform() const {
    return restore_transform({openvdb::math::UniformScaleTranslateMap::mapType(),
                              {translation[0], translation[1], translation[2], voxel, voxel, voxel}});
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
    if (!(0.5 * longest / lattice.voxel + lattice.half_width + lattice.shell < double(LARGEST_INDEX))) {
        throw Failure{vshi_fail(error, VSH_ERROR_LIMIT,
                                "voxel size %g: %g voxels along the longest side, %g at most", lattice.voxel,
                                longest / lattice.voxel, 2.0 * double(LARGEST_INDEX))};
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

void set_transform(vsh_grid_info &info, const openvdb::math::Transform &transform) {
    const Vec3d origin = transform.indexToWorld(Vec3d(0.0));
    for (int column = 0; column < 4; ++column) {
        Vec3d unit(0.0);
        unit[column % 3] = 1.0;
        const Vec3d axis = column < 3 ? transform.baseMap()->applyJacobian(unit) : origin;
        for (int row = 0; row < 3; ++row) {
            info.transform[4 * row + column] = axis[row];
        }
    }
}

void set_bounds(vsh_grid_info &info, const openvdb::CoordBBox &voxels) {
    for (int row = 0; row < 3; ++row) {
        const double *r = info.transform + 4 * row;
        info.bounds_min[row] = info.bounds_max[row] = r[3];
        for (int column = 0; column < 3; ++column) {
            const double a = r[column] * voxels.min()[column], b = r[column] * voxels.max()[column];
            info.bounds_min[row] += std::min(a, b);
            info.bounds_max[row] += std::max(a, b);
        }
    }
}

// The findings of closing a leaf.
struct Closed {
    openvdb::CoordBBox box; // of voxels inside the surface or next to it
    size_t active = 0;
    bool uniform = true; // all of one sign
};

Closed close_leaf(Leaf &leaf, float background, float voxel) {
    Closed closed;
    float *const values = leaf.buffer().data();
    const bool first = std::signbit(values[0]);
    Leaf::NodeMaskType active;
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
        const float value = values[i], size = std::fabs(value);
        active.set(i, size < background);
        closed.uniform &= std::signbit(value) == first;
        if (!(size <= background)) {
            values[i] = std::copysign(background, value);
        }
        if (value < voxel) {
            closed.box.expand(leaf.offsetToGlobalCoord(i));
        }
    }
    leaf.setValueMask(active);
    closed.active = active.countOn();
    return closed;
}

} // namespace

vsh_grid *close_grid(const FloatGrid::Ptr &level_set, double shell, Stage &stage) {
    auto grid = std::make_unique<vsh_grid>();
    grid->level_set = level_set;
    level_set->setGridClass(openvdb::GRID_LEVEL_SET);
    vsh_grid_info &info = grid->info;
    info = {};
    set_transform(info, level_set->transform());
    const double *m = info.transform;
    info.voxel_size = std::sqrt(m[0] * m[0] + m[4] * m[4] + m[8] * m[8]);
    const float background = level_set->background();

    std::vector<Leaf *> leaves;
    level_set->tree().getNodes(leaves);
    std::vector<Closed> closed(leaves.size());
    stage.loop(leaves.size(), 64, 1.0, 1.0,
               [&](size_t i) { closed[i] = close_leaf(*leaves[i], background, float(info.voxel_size)); });

    openvdb::CoordBBox box;
    for (size_t i = 0; i < leaves.size(); ++i) {
        box.expand(closed[i].box);
        info.active_voxels += closed[i].active;
        if (closed[i].active == 0 && closed[i].uniform) {
            const float value = leaves[i]->getFirstValue(); // a copy: the tile takes the leaf's place
            level_set->tree().addTile(1, leaves[i]->origin(), value, false);
        }
    }
    info.half_width = double(background) / info.voxel_size;
    info.shell_thickness = shell;
    info.bytes = level_set->memUsage();
    if (!box.empty()) {
        set_bounds(info, box);
    }
    const openvdb::CoordBBox band = level_set->evalActiveVoxelBoundingBox();
    for (int axis = 0; axis < 3; ++axis) {
        info.index_min[axis] = band.empty() ? 0 : band.min()[axis];
        info.index_max[axis] = band.empty() ? 0 : band.max()[axis];
    }
    return grid.release();
}

openvdb::CoordBBox box_to_copy(const int32_t index_min[3], const int32_t size[3], vsh_error *error) {
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 1 || int64_t(index_min[axis]) + size[axis] - 1 > INT32_MAX) {
            throw Failure{vshi_fail(error, VSH_ERROR_ARGUMENT, "copy: %d voxels from %d on along %c",
                                    size[axis], index_min[axis], "xyz"[axis])};
        }
    }
    return {Coord(index_min), Coord(index_min).offsetBy(size[0] - 1, size[1] - 1, size[2] - 1)};
}

void copy_dense(const FloatTree &tree, const int32_t index_min[3], const int32_t size[3], float *values,
                vsh_error *error) {
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense( // x fastest
        box_to_copy(index_min, size, error), values);
    openvdb::tools::copyToDense(tree, dense, true);
}

void check_openvdb(uint32_t version, uint32_t abi, vsh_error *error) {
    if (version != OPENVDB_LIBRARY_VERSION_NUMBER || abi != OPENVDB_ABI_VERSION_NUMBER) {
        throw Failure{vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                                "OpenVDB %u.%u.%u (ABI %u): vdbshade was compiled against %s (ABI %d)",
                                version >> 24, version >> 16 & 0xff, version & 0xffff, abi,
                                OPENVDB_LIBRARY_VERSION_STRING, OPENVDB_ABI_VERSION_NUMBER)};
    }
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

vsh_result vsh_grid_copy(const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3],
                         float *values, vsh_error *error) {
    VSHI_NEEDS(grid);
    VSHI_NEEDS(index_min);
    VSHI_NEEDS(size);
    VSHI_NEEDS(values);
    return vshi::guard(error, VSH_ERROR_INTERNAL, "grid", [&]() -> vsh_result {
        vshi::copy_dense(grid->level_set->constTree(), index_min, size, values, error);
        return VSH_OK;
    });
}

vsh_result vsh_grid_from_openvdb(const void *level_set, uint32_t version, uint32_t abi, const vsh_run *run,
                                 vsh_grid **grid, vsh_error *error) {
    VSHI_NEEDS(grid);
    *grid = nullptr;
    VSHI_NEEDS(level_set);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return vshi::guard(error, VSH_ERROR_INPUT, "OpenVDB", [&]() -> vsh_result {
        vshi::check_openvdb(version, abi, error);
        const auto &given = *static_cast<const openvdb::FloatGrid::ConstPtr *>(level_set);
        if (given == nullptr) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "the OpenVDB grid is NULL");
        }
        vshi::Stage stage(full, "load", error);
        const vshi::Named named{"OpenVDB", given->getName()};
        vshi::refuse_bad(named, vshi::examine_kind(*given), error);
        vshi::refuse_large(named, full, double(given->memUsage()), error);
        vshi::LevelSet set{named, given->deepCopy(), vshi::shell_of(*given)};
        *grid = vshi::close_level_set(set, stage, error);
        return VSH_OK;
    });
}

vsh_result vsh_grid_to_openvdb(const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set,
                               vsh_error *error) {
    VSHI_NEEDS(grid);
    VSHI_NEEDS(level_set);
    return vshi::guard(error, VSH_ERROR_LIMIT, "OpenVDB", [&] {
        vshi::check_openvdb(version, abi, error);
        *static_cast<openvdb::FloatGrid::ConstPtr *>(level_set) = vshi::named_surface(*grid, "surface");
        return VSH_OK;
    });
}
