// Which side of a surface voxels are on: outside is what can be reached from far away.
#pragma once

#include "levelset/flood.h"
#include "levelset/grid.h"

namespace vshi {

// Whatever way the polygons face, and whatever holes narrower than a voxel they leave: voxels well off the
// surface are joined across their faces, which no surface passes between them; those near it take the side of
// one that no surface parts them from. What nobody reaches is inside.
class Sides {
  public:
    // Surface and table, which knows its neighbours, outlive this.
    Sides(const Surface &surface, const LeafTable &table, Stage &stage);

    // Tells the sides of voxels near the surface from those of their neighbours: for each of ROUNDS in turn,
    // settle() of every leaf (several at once if wanted), then end_round().
    static constexpr int ROUNDS = 3;
    void settle(size_t leaf);
    void end_round();

    // After the rounds. `buried` voxels are inside and near a surface that has the inside on both of its
    // sides, as where solids meet or overlap: what they are near to bounds nothing.
    struct Told {
        Bits outside{}, buried{};
    };
    Told tell(size_t leaf) const;

  private:
    struct Halo;
    class Nearby;

    uint64_t fresh(uint32_t leaf, size_t x) const;
    bool has_fresh(const uint32_t around[27]) const;
    void gather(const uint32_t around[27], Halo &halo) const;
    static int side_of(const Halo &halo, const Cell &local, Nearby &nearby);

    const Surface &surface;
    const LeafTable &table;
    const std::vector<BandLeaf> &leaves;
    std::vector<KnownSides> now, next;
    std::vector<Bits> tried;        // what was known a round before: what it does not tell it never does
    std::vector<uint8_t> any_fresh; // whether something is known that was not
    std::vector<Bits> well_off;     // whose sides are known from the start
};

// --- distances of the inside where surfaces meet or overlap within it

// The part of a surface that bounds the inside. Faces with the inside on both sides go: where solids touch,
// and within others. Large triangles are cut into pieces of about a voxel.
Surface boundary_of(const Surface &surface, const LeafTable &table, const std::vector<Sides::Told> &told,
                    double begin, double end, Stage &stage);

// The regions of a band that hold a voxel within its half width of a leaf with buried voxels: distances of
// the inside are others there once they are taken to the boundary.
std::vector<size_t> regions_near_buried(const Band &band, const std::vector<BandLeaf> &leaves,
                                        const std::vector<Sides::Told> &told);

} // namespace vshi
