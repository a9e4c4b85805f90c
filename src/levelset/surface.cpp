// Grids of the distances to surfaces of triangles and quads.
#include "levelset/surface.h"

#include "levelset/sides.h"

#include <memory>
#include <openvdb/tools/SignedFloodFill.h>
#include <set>

namespace vshi {

namespace {

// A conversion under way; shares of it as measured at 512 voxels.
class Conversion {
  public:
    Conversion(const Surface &surface_, const Lattice &lattice_, double half_width, double begin_,
               double end_, Stage &stage_)
        : surface(surface_), lattice(lattice_), begin(begin_), end(end_), stage(stage_),
          kernel(*vshi_leaf_kernel_of(stage.options.isa)), band(surface, half_width, stage) {}

    FloatGrid::Ptr without_sides() {
        measure(false, 0.8);
        return make_grid();
    }

    FloatGrid::Ptr with_sides() {
        measure(true, 0.5);
        LeafTable table(leaves);
        table.find_neighbours();
        tell_sides(table);
        measure_boundary(table);
        const FloatGrid::Ptr grid = make_grid();
        constexpr openvdb::Index above_leaves = 1;
        stage.run([&] { openvdb::tools::signedFloodFill(grid->tree(), true, 1, above_leaves); });
        return grid;
    }

  private:
    double at(double share) const { return begin + share * (end - begin); }

    void measure(bool sides, double until) {
        stage.loop(band.region_count(), 1, begin, at(until),
                   [&](size_t i) { band.measure(i, sides, kernel); });
        leaves = band.leaves();
    }

    void tell_sides(const LeafTable &table) {
        Sides sides(surface, table, stage);
        for (int round = 0; round < Sides::ROUNDS; ++round) {
            stage.loop(leaves.size(), 16, at(0.5), at(0.7), [&](size_t i) { sides.settle(i); });
            sides.end_round();
        }
        told.resize(leaves.size());
        stage.loop(leaves.size(), 16, at(0.7), at(0.8), [&](size_t i) { told[i] = sides.tell(i); });
    }

    bool has_inside(size_t leaf) const {
        uint64_t inside = 0;
        for (const uint64_t outside : told[leaf].outside) {
            inside |= ~outside;
        }
        return inside != 0;
    }

    // Those of a region's leaves that hold some of the inside.
    uint64_t leaves_inside(const LeafTable &table, const Cell &origin) const {
        constexpr int edge = int(Leaf::DIM), count = Band::REGION / edge;
        uint64_t all = 0;
        for (int n = 0; n < VSHI_REGION_LEAVES; ++n) {
            const uint32_t leaf =
                table.find({origin[0] + edge * (n / (count * count)), origin[1] + edge * (n / count % count),
                            origin[2] + edge * (n % count)});
            all |= uint64_t(leaf != LeafTable::NONE && has_inside(leaf)) << n;
        }
        return all;
    }

    // Takes the distances of the inside to what bounds it, where something else is within it.
    void measure_boundary(const LeafTable &table) {
        const std::vector<size_t> regions = regions_near_buried(band, leaves, told);
        if (regions.empty()) {
            return;
        }
        const Surface boundary = boundary_of(surface, table, told, at(0.8), at(0.85), stage);
        Band bounded(boundary, band.half_width, stage);
        const std::vector<size_t> again = regions_near_buried(bounded, leaves, told);
        stage.loop(again.size(), 1, at(0.85), at(0.9), [&](size_t i) {
            bounded.measure(again[i], false, kernel, leaves_inside(table, bounded.region_origin(again[i])));
        });
        const std::vector<BandLeaf> others = bounded.leaves();
        const LeafTable other_table(others);
        std::set<Cell> near;
        for (const size_t region : regions) {
            near.insert(band.region_origin(region));
        }
        stage.loop(leaves.size(), 64, at(0.9), at(0.9), [&](size_t i) {
            const Cell &origin = leaves[i].origin;
            constexpr int32_t mask = ~(Band::REGION - 1);
            if (!has_inside(i) || near.count({origin[0] & mask, origin[1] & mask, origin[2] & mask}) == 0) {
                return;
            }
            const uint32_t other = other_table.find(origin);
            for (size_t x = 0; x < told[i].outside.size(); ++x) {
                uint8_t inside[64];
                spread_plane(~told[i].outside[x], inside);
                float *const to = leaves[i].distances + 64 * x;
                const float *const from =
                    other == LeafTable::NONE ? nullptr : others[other].distances + 64 * x;
                for (int n = 0; n < 64; ++n) {
                    const float measured = from == nullptr ? float(band.half_width) : from[n];
                    to[n] = inside[n] != 0 ? measured : to[n];
                }
            }
        });
    }

    // In world units; without sides all is outside.
    std::unique_ptr<Leaf> make_leaf(size_t i, float background) const {
        const BandLeaf &leaf = leaves[i];
        const Coord origin(leaf.origin[0], leaf.origin[1], leaf.origin[2]);
        auto made = std::make_unique<Leaf>(openvdb::PartialCreate(), origin, background);
        made->allocate();
        float *const values = made->buffer().data();
        Leaf::NodeMaskType active;
        const double voxel = lattice.voxel;
        for (openvdb::Index x = 0; x < Leaf::DIM; ++x) {
            uint8_t inside[64], within[64];
            spread_plane(told.empty() ? 0 : ~told[i].outside[x], inside);
            const float *const from = leaf.distances + 64 * x;
            float *const to = values + 64 * x;
            for (int n = 0; n < 64; ++n) {
                const auto value = float(double(from[n]) * voxel);
                within[n] = value < background;
                to[n] = inside[n] != 0 ? -value : value;
            }
            active.getWord<uint64_t>(x) = pack_plane(within);
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
    std::vector<Sides::Told> told;
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
