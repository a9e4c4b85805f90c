// The voxels around a surface: which leaves they are in, their distances, which side of it they are on.
#pragma once

#include "levelset/bits.h"
#include "levelset/grid.h"
#include "levelset/kernel/leaf.h"
#include "levelset/polygons.h"

#include <cstddef>

namespace vshi {

using Cell = std::array<int32_t, 3>;

// What std::array's == calls memcmp() for.
inline bool same(const Cell &a, const Cell &b) {
    return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

struct BandLeaf {
    Cell origin;
    float *distances; // [512], voxels, stored x · 64 + y · 8 + z; the band's half width where it is farther
    const uint32_t *triangles; // those that come near enough to its voxels, and more
    size_t triangle_count;
    const Bits *parts; // its voxels that are well off the surface, by what hangs together within the leaf
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
    // their parts and triangles. Of the region's leaves, 16 x + 4 y + z, only those in `wanted` are.
    void measure(size_t region, bool sides, const vshi_leaf_kernel &kernel, uint64_t wanted = ~uint64_t(0));

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
    void sort_triangles(Stage &stage);

    const Surface &surface;
    std::vector<Region> regions;
};

} // namespace vshi
