// The voxels around a surface: the leaves that they are in, their distances, and the sides that they are on.
#pragma once

#include "levelset/kernel/leaf.h"
#include "levelset/surface.h"

#include <algorithm>
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
    float *distances; // [512], voxels, stored x · 64 + y · 8 + z; the band's half width where it is farther
    const uint32_t *triangles; // those that come near enough to its voxels, and more
    size_t triangle_count;
    const Bits *parts; // its voxels that are well off the surface, in sets connected within the leaf
    size_t part_count;
};

class Band {
  public:
    const double half_width;

    // Sorts the triangles by regions of voxels; throws where the stage is cancelled. `surface` outlives this;
    // `half_width` in voxels, 3 or more.
    Band(const Surface &surface, double half_width, Stage &stage);

    static constexpr int REGION = 32; // voxels along an edge of a region
    size_t region_count() const { return regions.size(); }
    const Cell &region_origin(size_t region) const { return regions[region].origin; }

    // Measures the voxels of one region; others may be measured at the same time. With `sides`, leaves have
    // their parts and triangles.
    void measure(size_t region, bool sides, const vshi_leaf_kernel &kernel);

    // All leaves that hold a voxel within the band, sorted by origin (x, then y, then z), once every region
    // is measured. They point into the band.
    std::vector<BandLeaf> leaves();

  private:
    struct Region {
        Cell origin;
        std::vector<uint32_t> triangles;
        // of its leaves, one after the other
        std::vector<Cell> leaves;
        std::vector<float> distances;
        std::vector<Bits> parts;
        std::vector<uint32_t> near_triangles;
        std::vector<size_t> part_ends, triangle_ends;
    };
    class Measuring;

    const Surface &surface;
    std::vector<Region> regions;
};

// Leaves by their origin.
class LeafTable {
  public:
    static constexpr uint32_t NONE = UINT32_MAX;

    // `leaves` are sorted by origin, and outlive this.
    explicit LeafTable(const std::vector<BandLeaf> &leaves_) : leaves(leaves_) {}
    size_t lower_bound(const Cell &place) const; // the first leaf that is not before this place
    uint32_t find(const Cell &origin) const;     // NONE where there is no such leaf

    // Afterwards around() has a leaf and the 26 around it: at 9 x + 3 y + z, of 0 … 2 along each axis.
    void find_neighbours();
    const uint32_t *around(size_t leaf) const { return neighbours[leaf].data(); }

    const std::vector<BandLeaf> &leaves;

  private:
    std::vector<std::array<uint32_t, 27>> neighbours;
};

// --- sides: outside is what can be reached from far away

// Adds the parts of a leaf: its voxels that are well off the surface, in sets connected across the voxels'
// faces. Returns whether it has other voxels.
bool add_parts(const float distances[VSHI_LEAF_VOXELS], std::vector<Bits> &parts);

// `buried` voxels are inside and near a surface that has the inside on both of its sides, as where solids
// meet or overlap: the surface near them bounds nothing.
struct Sides {
    Bits outside{}, buried{};
};

// The sides of all leaves of a table that knows its neighbours, whatever way the polygons face, and whatever
// holes narrower than some 1.7 voxels they leave. Throws where the stage is cancelled.
std::vector<Sides> find_sides(const Surface &surface, const LeafTable &table, double begin, double end,
                              Stage &stage);

// The part of a surface that bounds the inside. Faces with the inside on both sides go: where solids touch,
// and within others. Large triangles are cut into pieces of about a voxel.
Surface boundary_of(const Surface &surface, const LeafTable &table, const std::vector<Sides> &sides,
                    double begin, double end, Stage &stage);

// Origins of the regions that hold a voxel within `half_width` of a leaf with buried voxels: distances of the
// inside differ there once they are measured to the boundary.
std::set<Cell> regions_near_buried(const LeafTable &table, const std::vector<Sides> &sides,
                                   double half_width);

} // namespace vshi
