// Sparse voxelising of distance callbacks and procedural trees.
//
// A field that changes by at most L per unit and is d at the middle of a box cannot come nearer to 0 than
// |d| - L · (half the box's diagonal) anywhere in it. So boxes of voxels are halved only where the surface or
// its band may be, from the whole bounds down to leaves of 8³, and the work follows the surface's area.
#include "base/floats.h"
#include "geometry/sdf.h"
#include "levelset/surface.h"

#include <array>
#include <cmath>
#include <memory>
#include <vector>

namespace vshi {

namespace {

constexpr double SQRT3 = 1.7320508075688772;
// From this many boxes on, their number at one level predicts the number of leaves: in fewer and larger
// boxes, edges and corners count for too much.
constexpr size_t PREDICTING_BOXES = 4096;

// A field's callback: for a position, or for several at once.
struct Callback {
    const vsh_distance &field;
    vsh_distances_fn *batch;       // replaces field.distance; may be nullptr
    const vsh_sdf *tree;           // the field's tree; nullptr: it has none
    const uint8_t *keep = nullptr; // the tree's nodes that decide at the positions; nullptr: all

    double operator()(const Vec3d &position) const {
        double d = 0.0;
        (*this)(1, &position, &d);
        return d;
    }
    void operator()(size_t count, const Vec3d *positions, double *distances) const {
        if (batch != nullptr) {
            batch(field.user, count, positions->asPointer(), distances);
            return;
        }
        if (keep != nullptr) {
            const auto places = reinterpret_cast<const double(*)[3]>(positions);
            vshi_sdf_distances_within(tree, keep, count, places, distances);
            return;
        }
        for (size_t i = 0; i < count; ++i) {
            distances[i] = field.distance(field.user, positions[i].asPointer());
        }
    }
};
static_assert(sizeof(Vec3d) == 3 * sizeof(double), "arrays of positions are arrays of doubles");

// Boxes of one size; `size` voxels an edge, at multiples of it.
struct Level {
    int32_t size;
    std::vector<Coord> origins;
};

class Voxelizer {
  public:
    Voxelizer(const Callback &call_, const Lattice &lattice_, double band_, Stage &stage_)
        : call(call_), field(call_.field), lattice(lattice_), band(band_), stage(stage_) {}

    FloatGrid::Ptr run(const Vec3d &low, const Vec3d &high) {
        grid = FloatGrid::create(float(band));
        Level level = start(low, high);
        while (level.size > 8) {
            level = split(level);
            check_leaves(level);
        }
        for (const Level &boxes : solid) {
            for (const Coord &origin : boxes.origins) {
                fill_inside(origin, boxes.size);
            }
        }
        add_leaves(level);
        if (grid->tree().leafCount() == 0) {
            refuse(
                VSH_ERROR_INPUT,
                "no surface in the box (%.9g, %.9g, %.9g) … (%.9g, %.9g, %.9g): the distance does not change "
                "sign at voxel size %g",
                low[0], low[1], low[2], high[0], high[1], high[2], lattice.voxel);
        }
        return grid;
    }

  private:
    Vec3d position(const Vec3d &index) const { return index * lattice.voxel + lattice.translation; }
    double distance(const Vec3d &index) const { return call(position(index)); }

    // The most by which the field at a voxel of a box differs from its value at the box's middle. The box has
    // an edge of `size` voxels.
    double slack(int32_t size) const { return field.lipschitz * 0.5 * SQRT3 * (size - 1) * lattice.voxel; }

    // The lowest number wins, so that the message does not depend on threads.
    void note_bad(size_t index) {
        size_t first = bad.load();
        while (index < first && !bad.compare_exchange_weak(first, index)) {
        }
    }

    [[noreturn]] void fail_bad(const Vec3d &index) const {
        const Vec3d p = position(index);
        refuse(VSH_ERROR_INPUT, "distance callback: %g at (%.9g, %.9g, %.9g): expected a finite value",
               distance(index), p[0], p[1], p[2]);
    }

    Level start(const Vec3d &low, const Vec3d &high) {
        const double margin = lattice.half_width + 1.0;
        const Vec3d first = lattice.index(low) - Vec3d(margin);
        const Vec3d last = lattice.index(high) + Vec3d(margin);
        region = openvdb::CoordBBox(Coord::floor(first), Coord::ceil(last));
        sides = (high - low) / lattice.voxel;
        Level level{8, {}};
        while (level.size < region.dim()[region.maxExtent()] / 4) {
            level.size *= 2;
        }
        visit_blocks(region, level.size, [&](const Coord &origin) { level.origins.push_back(origin); });
        return level;
    }

    // Uses the coarsest tiles that fit.
    void fill_inside(const Coord &origin, int32_t size) {
        grid->tree().sparseFill(openvdb::CoordBBox::createCube(origin, size), -grid->background(), false);
    }

    // Predicts the leaves from the boxes of a level, and checks the memory for them. The boxes are children
    // of boxes within slack() and the band of the surface. Leaves have voxels within the band.
    void check_leaves(const Level &level) const {
        if (level.size > 8 && level.origins.size() < PREDICTING_BOXES) {
            return;
        }
        const double edge = level.size;
        const double width = 2.0 * band / (field.lipschitz * lattice.voxel);
        const double reach = SQRT3 * (2.0 * edge - 1.0) + width;
        const double area = double(level.origins.size()) * edge * edge * edge / reach;
        const double leaves = area * (SQRT3 * 8.0 + width) / double(Leaf::SIZE);
        if (field.exact) {
            check_memory(stage.options, lattice.voxel, leaves, leaves * BYTES_PER_LEAF);
        } else {
            check_redistance(stage.options, lattice, area, sides, leaves, 0.0);
        }
    }

    // Refuses too many tiles of the root, which keeps a list of them.
    void check_tiles(const Level &level, const std::vector<int8_t> &signs) const {
        constexpr double TILE = 4096.0, BYTES_PER_TILE = 112.0; // voxels along its side; a node of std::map
        if (level.size < TILE) {
            return;
        }
        const double boxes = double(std::count(signs.begin(), signs.end(), int8_t(-1)));
        const double tiles = boxes * std::pow(level.size / TILE, 3.0);
        check_memory(stage.options, lattice.voxel, tiles * std::pow(TILE / 8.0, 3.0), tiles * BYTES_PER_TILE);
    }

    Level split(const Level &level) {
        const size_t count = level.origins.size();
        std::vector<int8_t> signs(count); // 0: to be halved
        const Vec3d middle(0.5 * (level.size - 1));
        stage.loop(count, 256, 0.0, 0.0, [&](size_t i) {
            const double d = distance(level.origins[i].asVec3d() + middle);
            if (!std::isfinite(d)) {
                note_bad(i);
            } else if (std::fabs(d) > slack(level.size) + band) {
                signs[i] = d < 0.0 ? -1 : 1;
            }
        });
        if (bad != SIZE_MAX) {
            fail_bad(level.origins[bad].asVec3d() + middle);
        }
        check_tiles(level, signs);
        Level next{level.size / 2, {}};
        Level inside{level.size, {}};
        for (size_t i = 0; i < count; ++i) {
            if (signs[i] < 0) {
                inside.origins.push_back(level.origins[i]);
            }
            for (int32_t child = 0; signs[i] == 0 && child < 8; ++child) {
                const Coord origin = level.origins[i].offsetBy(
                    (child & 4) ? next.size : 0, (child & 2) ? next.size : 0, (child & 1) ? next.size : 0);
                if (region.hasOverlap(openvdb::CoordBBox::createCube(origin, next.size))) {
                    next.origins.push_back(origin);
                }
            }
        }
        solid.push_back(std::move(inside));
        return next;
    }

    // The tree's shapes that decide in a leaf.
    std::vector<uint8_t> narrow(const Coord &origin) const {
        constexpr double MARGIN = 1.0 + 1e-6; // for the rounding of positions
        std::vector<uint8_t> keep;
        if (call.tree != nullptr) {
            keep.resize(call.tree->node_count);
            vshi_sdf_narrow(call.tree, position(origin.asVec3d() + Vec3d(3.5)).asPointer(),
                            MARGIN * 3.5 * SQRT3 * lattice.voxel, keep.data());
        }
        return keep;
    }

    // Samples a leaf by blocks of 4³ voxels. Blocks that the band cannot reach are sampled at their middles
    // only. Returns nullptr if no voxel is in the band; `sign` is then the leaf's side.
    Leaf *sample_leaf(const Coord &origin, int8_t &sign, size_t index) {
        const std::vector<uint8_t> keep = narrow(origin);
        const Callback here{call.field, call.batch, call.tree, keep.empty() ? nullptr : keep.data()};
        const float background = grid->background();
        auto leaf = std::make_unique<Leaf>(origin, background, false);
        float *const values = leaf->buffer().data();
        bool in_band = false, inside = false, outside = false;
        std::array<Coord, 8> corners;
        std::array<Vec3d, 8> places;
        std::array<double, 8> middles;
        for (int32_t block = 0; block < 8; ++block) {
            corners[block] =
                origin.offsetBy((block & 4) ? BLOCK : 0, (block & 2) ? BLOCK : 0, (block & 1) ? BLOCK : 0);
            places[block] = position(corners[block].asVec3d() + Vec3d(0.5 * (BLOCK - 1)));
        }
        here(places.size(), places.data(), middles.data());
        for (int32_t block = 0; block < 8; ++block) {
            const bool far = !(std::fabs(middles[block]) <= slack(BLOCK) + band);
            std::array<Vec3d, BLOCK * BLOCK * BLOCK> positions;
            std::array<double, BLOCK * BLOCK * BLOCK> distances;
            distances.fill(middles[block]);
            if (!far) {
                for (int32_t i = 0; i < int32_t(positions.size()); ++i) {
                    positions[i] = position(
                        corners[block].offsetBy(i / (BLOCK * BLOCK), i / BLOCK % BLOCK, i % BLOCK).asVec3d());
                }
                here(positions.size(), positions.data(), distances.data());
            }
            const openvdb::Index first = Leaf::coordToOffset(corners[block]);
            float last = 0.0f;
            for (openvdb::Index i = 0; i < distances.size(); ++i) {
                if (!std::isfinite(distances[i])) {
                    note_bad(index);
                    return nullptr;
                }
                const float value = float(distances[i]);
                const bool near = !far && std::fabs(value) < background;
                last = near ? value : std::copysign(background, value);
                const openvdb::Index offset =
                    first + ((i / (BLOCK * BLOCK)) << 6 | (i / BLOCK % BLOCK) << 3 | i % BLOCK);
                values[offset] = last;
                if (near) {
                    leaf->setActiveState(offset, true); // meshing looks at active voxels only
                }
                in_band |= near;
            }
            (last < 0.0f ? inside : outside) = true;
        }
        // A leaf of both signs without a voxel in the band comes from a field that is no distance near its
        // surface. Re-distancing, or the field's reader, must see its change of sign.
        if (in_band || (inside && outside)) {
            return leaf.release();
        }
        sign = inside ? -1 : 1;
        return nullptr;
    }

    void add_leaves(const Level &level) {
        const size_t count = level.origins.size();
        std::vector<std::unique_ptr<Leaf>> made(count);
        std::vector<int8_t> signs(count);
        stage.loop(count, 16, 0.0, field.exact ? 1.0 : 0.5, [&](size_t i) {
            if (i < bad.load()) {
                made[i].reset(sample_leaf(level.origins[i], signs[i], i));
            }
        });
        if (bad != SIZE_MAX) {
            for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
                const Vec3d index = (Leaf::offsetToLocalCoord(i) + level.origins[bad]).asVec3d();
                if (!std::isfinite(distance(index))) {
                    fail_bad(index);
                }
            }
            refuse(VSH_ERROR_INPUT, "distance callback: a value that is not finite between voxels");
        }
        for (size_t i = 0; i < count; ++i) {
            if (made[i] != nullptr) {
                grid->tree().addLeaf(made[i].release());
            } else if (signs[i] < 0) {
                fill_inside(level.origins[i], 8);
            }
        }
    }

    const Callback &call;
    const vsh_distance &field;
    const Lattice &lattice;
    const double band; // world units of the field's value
    Stage &stage;
    openvdb::CoordBBox region;
    Vec3d sides;              // of the bounds, voxels
    std::vector<Level> solid; // boxes inside: filled once all levels have passed the memory check
    FloatGrid::Ptr grid;
    std::atomic<size_t> bad{SIZE_MAX}; // first box with a value that is not finite
    static constexpr int32_t BLOCK = 4;
};

void check_field(const vsh_distance *field, vsh_distances_fn *batch) {
    if (field == nullptr || (field->distance == nullptr && batch == nullptr)) {
        refuse(VSH_ERROR_ARGUMENT, "distance field: no callback");
    }
    if (!(field->lipschitz > 0.0 && std::isfinite(field->lipschitz))) {
        refuse(VSH_ERROR_ARGUMENT, "distance field: lipschitz %g: expected more than 0", field->lipschitz);
    }
    for (int i = 0; i < 3; ++i) {
        const double low = field->bounds_min[i], high = field->bounds_max[i];
        if (!(std::isfinite(low) && std::isfinite(high) && low <= high && std::isfinite(high - low))) {
            refuse(VSH_ERROR_ARGUMENT, "distance field: bounds[%d] %g … %g: expected finite, the lower first",
                   i, low, high);
        }
    }
}

// The body of all public calls. `batch` and `tree` may be NULL.
vsh_result from_distance(const vsh_distance *field, vsh_distances_fn *batch, const vsh_sdf *tree,
                         const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                         vsh_error *error) {
    return guard_run(run, error, VSH_ERROR_INTERNAL, "voxelize", [&](const vsh_run &full) {
        check_field(field, batch);
        const Callback call{*field, batch, tree};
        const Vec3d low(field->bounds_min), high(field->bounds_max);
        const Lattice lattice = make_lattice(options, low, high);
        Stage stage(full, "voxelize");
        // A field to be re-distanced is needed only where cells of 2³ voxels may hold its zero.
        const double band = field->exact ? lattice.half_width * lattice.voxel
                                         : 1.01 * SQRT3 * field->lipschitz * lattice.voxel;
        FloatGrid::Ptr level_set = Voxelizer(call, lattice, band, stage).run(low, high);
        if (!field->exact) {
            const double unit = 1.0 / (field->lipschitz * lattice.voxel);
            const IndexDistance exact = [&](const Vec3d &index) {
                return unit * call(index * lattice.voxel + lattice.translation);
            };
            level_set = redistance(*level_set, exact, lattice, 0.5, 1.0, stage);
        }
        *grid = close_grid(level_set, lattice.matrix(), 0.0, stage);
    });
}

double tree_distance(void *user, const double position[3]) {
    return vshi_sdf_distance(static_cast<const vsh_sdf *>(user), position);
}

} // namespace

} // namespace vshi

vsh_result vsh_grid_from_distance(const vsh_distance *field, const vsh_grid_options *options,
                                  const vsh_run *run, vsh_grid **grid, vsh_error *error) {
    VSHI_MAKES(grid);
    return vshi::from_distance(field, nullptr, nullptr, options, run, grid, error);
}

vsh_result vsh_grid_from_distances(const vsh_distance *field, vsh_distances_fn *distances,
                                   const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                   vsh_error *error) {
    VSHI_MAKES(grid);
    VSHI_NEEDS(distances);
    return vshi::from_distance(field, distances, nullptr, options, run, grid, error);
}

vsh_result vsh_grid_from_sdf(const vsh_sdf *sdf, const vsh_grid_options *options, const vsh_run *run,
                             vsh_grid **grid, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(grid);
    VSHI_TRY(vshi_sdf_check(sdf, error));
    vsh_sdf tree = *sdf;
    vsh_distance field = {vshi::tree_distance, &tree, 1.0, vshi_sdf_exact(sdf), {0, 0, 0}, {0, 0, 0}};
    vshi_sdf_bounds(sdf, field.bounds_min, field.bounds_max);
    return vshi::from_distance(&field, nullptr, sdf, options, run, grid, error);
}
