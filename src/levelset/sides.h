// Which side of a surface voxels are on: outside is what can be reached from far away.
#pragma once

#include "levelset/flood.h"

namespace vshi {

// Whatever way the polygons face, and whatever holes narrower than a voxel they leave: voxels well off the
// surface are joined across their faces, which no surface passes between them; those near it take the side of
// one that no surface parts them from. What nobody reaches is inside.
class Sides {
  public:
    // Both outlive this.
    Sides(const Surface &surface, const LeafTable &table);

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
    struct Row;
    struct Halo;
    class Nearby;

    Row row(uint32_t leaf, int x, int y) const;
    void gather(size_t leaf, Halo &halo) const;
    static bool touches_outside(const Halo &halo, int at);
    bool is_settled(size_t leaf) const;
    static int side_of(const Halo &halo, const Cell &local, Nearby &nearby);

    const Surface &surface;
    const LeafTable &table;
    const std::vector<BandLeaf> &leaves;
    std::vector<KnownSides> now, next;
};

} // namespace vshi
