// The voxels around a surface: their leaves, distances and sides.
#pragma once

#include "levelset/kernel/leaf.h"
#include "levelset/surface.h"

#include <algorithm>
#include <memory>
#include <set>

namespace vshi {

// --- sets of a leaf's voxels

// One bit a voxel of a leaf: word x, bit y · 8 + z.
using Bits = std::array<uint64_t, 8>;

inline bool any(const Bits &bits) {
    return std::any_of(bits.begin(), bits.end(), [](uint64_t word) { return word != 0; });
}

constexpr uint64_t ROW_ENDS = 0x0101010101010101u; // first voxels of a word's rows

// --- the band

using Cell = std::array<int32_t, 3>;

// Faster than std::array's ==, which calls memcmp().
inline bool same(const Cell &a, const Cell &b) {
    return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

struct BandLeaf {
    Cell origin;
    std::unique_ptr<float[]>
        distances; // [512], voxels, stored x · 64 + y · 8 + z, at most the band's half width
    std::vector<uint32_t> triangles; // all that may separate its voxels from neighbours, and more
    std::vector<Bits> parts;         // its voxels well off the surface, in sets connected within the leaf
};

class Band {
  public:
    const double half_width;

    // Sorts the triangles by regions of voxels; throws when the stage is cancelled. `surface` outlives this.
    // `half_width` is in voxels, 3 or more.
    Band(const Surface &surface, double half_width, Stage &stage);

    static constexpr int REGION = 32; // voxels along an edge of a region
    size_t region_count() const { return regions.size(); }
    const Cell &region_origin(size_t region) const { return regions[region].origin; }

    // Measures the voxels of one region. Threads may measure different regions. With `sides`, leaves get
    // parts and triangles.
    void measure(size_t region, bool sides, const vshi_leaf_kernel &kernel);

    // Hands over all leaves with a voxel within the band by origin (x, then y, then z), once every region is
    // measured.
    std::vector<BandLeaf> leaves();

  private:
    struct Region {
        Cell origin;
        std::vector<uint32_t> triangles;
        std::vector<BandLeaf> leaves;
    };
    class Measuring;

    const Surface &surface;
    std::vector<Region> regions;
};

// A table of leaves by origin.
class LeafTable {
  public:
    static constexpr uint32_t NONE = UINT32_MAX;

    // `leaves` are sorted by origin, and outlive this.
    explicit LeafTable(const std::vector<BandLeaf> &leaves_) : leaves(leaves_) {}
    size_t lower_bound(const Cell &place) const; // the first leaf not before this place
    uint32_t find(const Cell &origin) const;     // NONE if there is no such leaf

    // Finds the 27 leaves of around(): a leaf and its neighbours at 9 x + 3 y + z, of 0 … 2 along each axis.
    void find_neighbours();
    const uint32_t *around(size_t leaf) const { return neighbours[leaf].data(); }

    const std::vector<BandLeaf> &leaves;

  private:
    std::vector<std::array<uint32_t, 27>> neighbours;
};

// --- sides: a voxel is outside if a path leads to it from far away

// Adds the parts of a leaf: its voxels well off the surface, in sets connected across the voxels' faces.
// Returns whether it has other voxels.
bool add_parts(const float distances[VSHI_LEAF_VOXELS], std::vector<Bits> &parts);

// `buried` voxels are inside, near a surface with the inside on both sides, as where solids meet or overlap:
// that surface bounds nothing.
struct Sides {
    Bits outside{}, buried{};
};

// Finds the sides of all leaves of a table with neighbours. The way that polygons face does not matter, nor
// do holes narrower than some 1.7 voxels. Throws when the stage is cancelled.
std::vector<Sides> find_sides(const Surface &surface, const LeafTable &table, double begin, double end,
                              Stage &stage);

// The part of a surface that bounds the inside, without faces that have the inside on both sides: where
// solids touch, and within solids. Large triangles are cut into pieces of about a voxel.
Surface boundary_of(const Surface &surface, const LeafTable &table, const std::vector<Sides> &sides,
                    double begin, double end, Stage &stage);

// Origins of the regions with a voxel within `half_width` of a leaf with buried voxels. There, distances of
// the inside to the boundary may differ from those to the surface.
std::set<Cell> regions_near_buried(const LeafTable &table, const std::vector<Sides> &sides,
                                   double half_width);

} // namespace vshi
