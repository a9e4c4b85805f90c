// The handle of a level set: making it, its facts, its leaves for the field, and OpenVDB grids of callers.
#include "levelset/grid.h"

#include "base/parallel.h"
#include "levelset/file.h"

#include <cmath>
#include <cstdarg>
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

void refuse(vsh_result code, const char *format, ...) {
    Failure failure;
    char text[1 << 14]; // vshi_fail() shortens it in the middle
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    vshi_fail(&failure.error, code, "%s", text);
    throw failure;
}

namespace {

void check_option(bool good, const char *name, double value, const char *expected) {
    if (!good) {
        refuse(VSH_ERROR_ARGUMENT, "grid options: %s %g: expected %s", name, value, expected);
    }
}

vsh_grid_options resolve(const vsh_grid_options *given) {
    vsh_grid_options o = vsh_grid_options_default();
    require(vshi_options_resolve, given, &o, sizeof o, "vsh_grid_options");
    check_option(o.voxel_size >= 0.0 && std::isfinite(o.voxel_size), "voxel_size", o.voxel_size,
                 "more than 0, or 0 for one from the resolution");
    check_option(o.voxel_size != 0.0 || (o.resolution >= 2 && o.resolution <= 65536), "resolution",
                 o.resolution, "2 … 65536");
    check_option(o.half_width >= 3.0 && o.half_width <= 100.0, "half_width", o.half_width, "3 … 100 voxels");
    check_option(o.shell_thickness >= 1.0 && o.shell_thickness <= 50.0, "shell_thickness", o.shell_thickness,
                 "1 … 50 voxels");
    return o;
}

} // namespace

Matrix Lattice::matrix() const {
    return {voxel,          0.0, 0.0, translation[0], 0.0,           voxel, 0.0,
            translation[1], 0.0, 0.0, voxel,          translation[2]};
}

Matrix matrix_of(const openvdb::math::Transform &transform) {
    Matrix matrix{};
    const Vec3d origin = transform.indexToWorld(Vec3d(0.0));
    for (int column = 0; column < 4; ++column) {
        Vec3d unit(0.0);
        unit[column % 3] = 1.0;
        const Vec3d axis = column < 3 ? transform.baseMap()->applyJacobian(unit) : origin;
        for (int row = 0; row < 3; ++row) {
            matrix[size_t(4 * row + column)] = axis[row];
        }
    }
    return matrix;
}

Lattice make_lattice(const vsh_grid_options *given, const Vec3d &low, const Vec3d &high) {
    const vsh_grid_options options = resolve(given);
    const Vec3d size = high - low;
    const double longest = std::max(size[0], std::max(size[1], size[2]));
    Lattice lattice{options.voxel_size, options.half_width, options.shell_thickness, Vec3d(0.0)};
    if (lattice.voxel == 0.0) {
        if (!(longest > 0.0)) {
            refuse(VSH_ERROR_INPUT, "the casters' box has no size: no voxel size follows from resolution %d",
                   options.resolution);
        }
        lattice.voxel = longest / options.resolution;
    }
    if (!(0.5 * longest / lattice.voxel + lattice.half_width + lattice.shell < double(LARGEST_INDEX))) {
        refuse(VSH_ERROR_LIMIT, "voxel size %g: %g voxels along the longest side, %g at most", lattice.voxel,
               longest / lattice.voxel, 2.0 * double(LARGEST_INDEX));
    }
    if (!(lattice.voxel >= SMALLEST_VOXEL && lattice.voxel <= LARGEST_VOXEL)) {
        refuse(VSH_ERROR_LIMIT, "voxel size %g: distances are kept for %g … %g; scale the scene",
               lattice.voxel, SMALLEST_VOXEL, LARGEST_VOXEL);
    }
    for (int i = 0; i < 3; ++i) {
        const double centre = low[i] + 0.5 * size[i];
        lattice.translation[i] = lattice.voxel * std::round(centre / lattice.voxel);
        // A voxel must be many steps of a double there, or positions would fall together.
        if (!(std::fabs(lattice.translation[i]) / lattice.voxel < 1e12)) {
            refuse(VSH_ERROR_LIMIT, "voxel size %g: %g voxels from the origin, 1e12 at most", lattice.voxel,
                   std::fabs(centre / lattice.voxel));
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

void check_bytes(const vsh_run &run, double bytes, const char *what) {
    require(vshi_check_limit, &run, bytes, what);
    const double machine = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
    if (machine > 0.0 && bytes > machine) {
        refuse(VSH_ERROR_LIMIT, "%s: about %.0f MB are needed, over this machine's memory of %.0f MB", what,
               bytes / 1e6, machine / 1e6);
    }
}

void check_memory(const vsh_run &run, double voxel, double leaves, double bytes) {
    char what[128];
    std::snprintf(what, sizeof what, "voxel size %g (about %.3g voxels)", voxel, leaves * double(Leaf::SIZE));
    check_bytes(run, bytes, what);
}

// Threads of an arena. TBB prints a warning if an arena has more than the machine has cores.
static int count_slots(const vshi_job *job) {
    if (job == nullptr) {
        throw std::bad_alloc();
    }
    vshi_parallel_threads(0); // OpenVDB frees trees on all cores, whatever the arena
    const int threads = vshi_job_threads(job);
    return threads > 0 ? std::min(threads, tbb::info::default_concurrency()) : tbb::task_arena::automatic;
}

Stage::Stage(const vsh_run &run, const char *name)
    : options(run), job(vshi_job_begin(&run, name, UNITS)), arena(count_slots(job)) {}

void Stage::reach(double fraction) {
    const size_t target = size_t(std::clamp(fraction, 0.0, 1.0) * double(UNITS));
    size_t before = reached.load();
    while (before < target && !reached.compare_exchange_weak(before, target)) {
    }
    vshi_job_advance(job, before < target ? target - before : 0);
}

void Stage::check() {
    require(vshi_job_step, job, size_t(0));
}

namespace {

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

// Facts about a closed leaf.
struct Closed {
    openvdb::CoordBBox box; // around voxels inside the surface or next to it
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

vsh_grid *close_grid(const FloatGrid::Ptr &level_set, const Matrix &matrix, double shell, Stage &stage) {
    auto grid = std::make_unique<vsh_grid>();
    grid->level_set = level_set;
    level_set->setGridClass(openvdb::GRID_LEVEL_SET);
    vsh_grid_info &info = grid->info;
    info = {};
    std::copy(matrix.begin(), matrix.end(), info.transform);
    info.voxel_size = axis_of(info.transform, 0).length();
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

openvdb::CoordBBox box_to_copy(const int32_t index_min[3], const int32_t size[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 1 || int64_t(index_min[axis]) + size[axis] - 1 > INT32_MAX) {
            refuse(VSH_ERROR_ARGUMENT, "copy: %d voxels from %d on along %c", size[axis], index_min[axis],
                   "xyz"[axis]);
        }
    }
    return {Coord(index_min), Coord(index_min).offsetBy(size[0] - 1, size[1] - 1, size[2] - 1)};
}

void copy_dense(const FloatTree &tree, const int32_t index_min[3], const int32_t size[3], float *values) {
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box_to_copy(index_min, size), values);
    openvdb::tools::copyToDense(tree, dense, true);
}

void check_openvdb(uint32_t version, uint32_t abi) {
    if (version != OPENVDB_LIBRARY_VERSION_NUMBER || abi != OPENVDB_ABI_VERSION_NUMBER) {
        refuse(VSH_ERROR_UNSUPPORTED, "OpenVDB %u.%u.%u (ABI %u): vdbshade was compiled against %s (ABI %d)",
               version >> 24, version >> 16 & 0xff, version & 0xffff, abi, OPENVDB_LIBRARY_VERSION_STRING,
               OPENVDB_ABI_VERSION_NUMBER);
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
    std::sort(leaves, leaves + std::min(count, capacity), vshi::comes_before<vshi_leaf>);
    return count;
}

void vshi_grid_block_signs(const vsh_grid *grid, const int32_t origin[3], const int32_t size[3],
                           int8_t *signs) {
    openvdb::FloatGrid::ConstUnsafeAccessor tree(grid->level_set->constTree());
    const openvdb::Coord low(origin), last = low.offsetBy(8 * size[0] - 1, 8 * size[1] - 1, 8 * size[2] - 1);
    vshi::visit_blocks({low, last}, 8,
                       [&](const openvdb::Coord &block) { *signs++ = tree.getValue(block) < 0.0f ? -1 : 1; });
}

vsh_result vsh_grid_copy(const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3],
                         float *values, vsh_error *error) {
    VSHI_NEEDS_BOTH(grid, index_min);
    VSHI_NEEDS_BOTH(size, values);
    return vshi::guard(error, VSH_ERROR_INTERNAL, "grid",
                       [&] { vshi::copy_dense(grid->level_set->constTree(), index_min, size, values); });
}

vsh_result vsh_grid_from_openvdb(const void *level_set, uint32_t version, uint32_t abi, const vsh_run *run,
                                 vsh_grid **grid, vsh_error *error) {
    VSHI_MAKES(grid);
    VSHI_NEEDS(level_set);
    return vshi::guard_run(run, error, VSH_ERROR_INPUT, "OpenVDB", [&](const vsh_run &full) {
        vshi::check_openvdb(version, abi);
        const auto &given = *static_cast<const openvdb::FloatGrid::ConstPtr *>(level_set);
        if (given == nullptr) {
            vshi::refuse(VSH_ERROR_ARGUMENT, "the OpenVDB grid is NULL");
        }
        vshi::Stage stage(full, "load");
        const vshi::GridName name{"OpenVDB", given->getName()};
        vshi::refuse_bad(name, vshi::examine_kind(*given));
        vshi::check_bytes(full, double(given->memUsage()), name.text().c_str());
        vshi::LevelSet set{
            name, openvdb::FloatGrid::create(std::make_shared<openvdb::FloatTree>(given->constTree())),
            vshi::matrix_of(given->transform()), vshi::shell_of(*given)};
        *grid = vshi::close_level_set(set, stage);
    });
}

vsh_result vsh_grid_to_openvdb(const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set,
                               vsh_error *error) {
    VSHI_NEEDS_BOTH(grid, level_set);
    return vshi::guard(error, VSH_ERROR_LIMIT, "OpenVDB", [&] {
        vshi::check_openvdb(version, abi);
        *static_cast<openvdb::FloatGrid::ConstPtr *>(level_set) = vshi::named_surface(*grid, "surface");
    });
}
