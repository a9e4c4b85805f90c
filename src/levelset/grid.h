// Shared by all code that is compiled against OpenVDB: failures, the handle of a level set, the lattice of a
// new grid, and a stage of work.
#pragma once

#include "base/guard.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/tbb.h"
#include "levelset/access.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <openvdb/Grid.h>
#include <openvdb/openvdb.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

// Compiled once, in grid.cpp, because compiling it takes longer than the rest of any file that uses grids.
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::FloatTree>;

struct vsh_grid {
    openvdb::FloatGrid::Ptr level_set; // in index space; never changed once the handle exists
    vsh_grid_info info;                // with the transform to the world
};

namespace vshi {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using Leaf = FloatTree::LeafNodeType;
using UpperNode = FloatTree::RootNodeType::ChildNodeType;
using LowerNode = UpperNode::ChildNodeType;

// From a grid's index space to the world: three rows of four. Grids themselves are kept in index space,
// because OpenVDB takes maps of voxels below 1.44e-5 for singular, and adds rounding to others.
using Matrix = std::array<double, 12>;

inline Vec3d apply(const double *m, const Vec3d &p) {
    return Vec3d(m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
                 m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
                 m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]);
}

// World axis of a voxel along index axis 0 … 2.
inline Vec3d axis_of(const double *m, int axis) {
    return Vec3d(m[axis], m[4 + axis], m[8 + axis]);
}

// The matrix of a linear transform.
Matrix matrix_of(const openvdb::math::Transform &transform);

// Throws a Failure.
[[noreturn]] void refuse(vsh_result code, const char *format, ...) __attribute__((format(printf, 2, 3)));

// Runs body(full) as a public function, with the run that its caller gave or the default one.
template <typename Body>
vsh_result guard_run(const vsh_run *run, vsh_error *error, vsh_result code, const char *what,
                     const Body &body) {
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return guard(error, code, what, [&] { body(full); });
}

// Orders leaves and blocks by origin: x, then y, then z.
template <typename Block> bool comes_before(const Block &a, const Block &b) {
    return std::lexicographical_compare(a.origin, a.origin + 3, b.origin, b.origin + 3);
}

// Calls use(origin) for each block of `size` voxels (a power of two) that a box touches: by x, then y, then
// z.
template <typename Use> void visit_blocks(const openvdb::CoordBBox &box, int32_t size, const Use &use) {
    const Coord first = box.min() & ~(size - 1);
    for (int32_t x = first[0]; x <= box.max()[0]; x += size) {
        for (int32_t y = first[1]; y <= box.max()[1]; y += size) {
            for (int32_t z = first[2]; z <= box.max()[2]; z += size) {
                use(Coord(x, y, z));
            }
        }
    }
}

// Bytes of a grid per leaf: 512 values, two masks, origin, and its share of the nodes above.
constexpr double BYTES_PER_LEAF = 2400.0;

// Voxel sizes, world units: distances are 32-bit floats, and squares and volumes must be in the range of
// these, too.
constexpr double SMALLEST_VOXEL = 1e-12;
constexpr double LARGEST_VOXEL = 1e12;

// Indices are kept where OpenVDB's own arithmetic on them (sums, boxes, leaves beside leaves) cannot
// overflow.
constexpr int32_t LARGEST_INDEX = 1 << 28;

// Estimates the leaves of a band that reaches `half_width` voxels to either side of a surface of `area`
// voxel² in a box of `sides` voxels.
double band_leaves(double area, const Vec3d &sides, double half_width);

// The lattice of a new grid: world = voxel · index + translation. The translation is a whole number of voxels
// near the middle of the bounds, so that indices stay small far from the origin.
struct Lattice {
    double voxel;      // world units
    double half_width; // voxels
    double shell;      // thickness of an open mesh, voxels
    Vec3d translation;

    Vec3d world(const Coord &index) const { return index.asVec3d() * voxel + translation; }
    Vec3d index(const Vec3d &world) const { return (world - translation) / voxel; }
    float background() const { return float(half_width * voxel); }
    Matrix matrix() const;
};

// Checks the options and lays the lattice over the bounds. Indices beyond ±2^28 are refused.
Lattice make_lattice(const vsh_grid_options *options, const Vec3d &low, const Vec3d &high);

// Fails with VSH_ERROR_LIMIT, naming `what`, if `bytes` exceed the run's memory limit or the machine's
// memory: OpenVDB ends the process when its thread pool runs out.
void check_bytes(const vsh_run &run, double bytes, const char *what);

// Checks the bytes of a new grid. The message gives `leaves` as voxels of the band.
void check_memory(const vsh_run &run, double voxel, double leaves, double bytes);

// A stage of work on the run's threads. Its progress is a fraction.
class Stage {
  public:
    Stage(const vsh_run &run, const char *name);
    ~Stage() { vshi_job_end(job); }
    Stage(const Stage &) = delete;
    Stage &operator=(const Stage &) = delete;

    void reach(double fraction); // any thread; a smaller fraction than before does nothing
    bool cancelled() { return vshi_job_advance(job, 0); } // polls the callback
    void check();                                         // throws when cancelled

    // Calls body(i) for 0 … count - 1, while the fraction goes from `begin` to `end`; throws when cancelled.
    template <typename Body> void loop(size_t count, size_t grain, double begin, double end, Body &&body) {
        std::atomic<size_t> done{0};
        release(&done);
        arena.execute([&] {
            tbb::parallel_for(
                tbb::blocked_range<size_t>(0, count, grain),
                [&](const tbb::blocked_range<size_t> &range) {
                    acquire(&done); // before anything of this loop is read
                    if (!vshi_job_cancelled(job)) {
                        for (size_t i = range.begin(); i != range.end(); ++i) {
                            body(i);
                        }
                        const size_t so_far = done.fetch_add(range.size()) + range.size();
                        reach(begin + (end - begin) * double(so_far) / double(count));
                    }
                    release(&done);
                },
                tbb::simple_partitioner());
        });
        acquire(&done);
        check();
    }

    template <typename Body> void run(Body &&body) { arena.execute(body); }

    const vsh_run &options;

  private:
    static constexpr size_t UNITS = 1000000;
    vshi_job *job;
    LentArena arena;
    std::atomic<size_t> reached{0};
};

// Makes the handle of a level set. Values at or beyond the background become ± background and inactive, all
// others active. `shell` is the thickness of open meshes in it, world units.
vsh_grid *close_grid(const FloatGrid::Ptr &level_set, const Matrix &matrix, double shell, Stage &stage);

// The box of a dense copy. Fails if it holds no voxel, or ends beyond the largest index.
openvdb::CoordBBox box_to_copy(const int32_t index_min[3], const int32_t size[3]);

// Copies a box of a tree's values, x fastest.
void copy_dense(const FloatTree &tree, const int32_t index_min[3], const int32_t size[3], float *values);

// Fails for a caller that was compiled against another OpenVDB: its classes of grids differ, though their
// names are alike.
void check_openvdb(uint32_t version, uint32_t abi);

} // namespace vshi
