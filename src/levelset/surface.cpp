// Grids of the distances to surfaces of triangles and quads.
#include "base/isa.h"
#include "levelset/band.h"

#include <memory>
#include <openvdb/tools/SignedFloodFill.h>

namespace vshi {

namespace {

// A conversion under way; shares of it as measured at 512 voxels.
class Conversion {
  public:
    Conversion(const Surface &surface_, const Lattice &lattice_, double half_width, double begin_,
               double end_, Stage &stage_)
        : surface(surface_), lattice(lattice_), begin(begin_), end(end_), stage(stage_),
          kernel(*VSHI_KERNEL_OF(vshi_leaf, stage.options.isa)), band(surface, half_width, stage) {}

    FloatGrid::Ptr without_sides() {
        measure(false, 0.8);
        return make_grid();
    }

    FloatGrid::Ptr with_sides() {
        measure(true, 0.5);
        LeafTable table(leaves);
        table.find_neighbours();
        sides = find_sides(surface, table, at(0.5), at(0.8), stage);
        measure_boundary(table);
        const FloatGrid::Ptr grid = make_grid();
        constexpr openvdb::Index above_leaves = 1;
        stage.run([&] { openvdb::tools::signedFloodFill(grid->tree(), true, 1, above_leaves); });
        return grid;
    }

  private:
    double at(double share) const { return begin + share * (end - begin); }

    void measure(bool with_parts, double until) {
        stage.loop(band.region_count(), 1, begin, at(until),
                   [&](size_t i) { band.measure(i, with_parts, kernel); });
        leaves = band.leaves();
    }

    bool has_inside(size_t leaf) const {
        const Bits &outside = sides[leaf].outside;
        return std::any_of(outside.begin(), outside.end(), [](uint64_t word) { return ~word != 0; });
    }

    // Takes the distances of the inside to what bounds it, where something else is within it.
    void measure_boundary(const LeafTable &table) {
        const std::set<Cell> near = regions_near_buried(table, sides, band.half_width);
        if (near.empty()) {
            return;
        }
        const Surface boundary = boundary_of(surface, table, sides, at(0.8), at(0.85), stage);
        Band bounded(boundary, band.half_width, stage);
        stage.loop(bounded.region_count(), 1, at(0.85), at(0.9), [&](size_t i) {
            if (near.count(bounded.region_origin(i)) != 0) {
                bounded.measure(i, false, kernel);
            }
        });
        const std::vector<BandLeaf> others = bounded.leaves();
        const LeafTable other_table(others);
        stage.loop(leaves.size(), 64, at(0.9), at(0.9), [&](size_t i) {
            const Cell &origin = leaves[i].origin;
            constexpr int32_t mask = ~(Band::REGION - 1);
            if (!has_inside(i) || near.count({origin[0] & mask, origin[1] & mask, origin[2] & mask}) == 0) {
                return;
            }
            const uint32_t other = other_table.find(origin);
            for (int n = 0; n < VSHI_LEAF_VOXELS; ++n) {
                if (!is_outside(i, n)) {
                    leaves[i].distances[n] =
                        other == LeafTable::NONE ? float(band.half_width) : others[other].distances[n];
                }
            }
        });
    }

    bool is_outside(size_t leaf, int voxel) const {
        return (sides[leaf].outside[size_t(voxel >> 6)] >> (voxel & 63) & 1) != 0;
    }

    // In world units; without sides all is outside.
    std::unique_ptr<Leaf> make_leaf(size_t i, float background) const {
        const BandLeaf &leaf = leaves[i];
        const Coord origin(leaf.origin[0], leaf.origin[1], leaf.origin[2]);
        auto made = std::make_unique<Leaf>(openvdb::PartialCreate(), origin, background);
        made->allocate();
        float *const values = made->buffer().data();
        Leaf::NodeMaskType active;
        for (int n = 0; n < VSHI_LEAF_VOXELS; ++n) {
            const auto value = float(double(leaf.distances[n]) * lattice.voxel);
            active.set(openvdb::Index32(n), value < background);
            values[n] = sides.empty() || is_outside(i, n) ? value : -value;
        }
        made->setValueMask(active);
        return made;
    }

    FloatGrid::Ptr make_grid() {
        const auto background = float(band.half_width * lattice.voxel);
        std::vector<std::unique_ptr<Leaf>> made(leaves.size());
        stage.loop(leaves.size(), 64, at(0.9), end, [&](size_t i) { made[i] = make_leaf(i, background); });
        const FloatGrid::Ptr grid = FloatGrid::create(background);
        grid->setTransform(lattice.transform());
        for (std::unique_ptr<Leaf> &leaf : made) {
            grid->tree().addLeaf(leaf.release());
        }
        return grid;
    }

    const Surface &surface;
    const Lattice &lattice;
    const double begin, end;
    Stage &stage;
    const vshi_leaf_kernel &kernel;
    Band band;
    std::vector<BandLeaf> leaves;
    std::vector<Sides> sides;
};

} // namespace

FloatGrid::Ptr fill_surface(const Surface &surface, const Lattice &lattice, double half_width, double begin,
                            double end, Stage &stage) {
    return Conversion(surface, lattice, half_width, begin, end, stage).with_sides();
}

FloatGrid::Ptr measure_surface(const Surface &surface, const Lattice &lattice, double half_width,
                               double begin, double end, Stage &stage) {
    return Conversion(surface, lattice, half_width, begin, end, stage).without_sides();
}

} // namespace vshi
