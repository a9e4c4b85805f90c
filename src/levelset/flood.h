// What of a band can be reached from far away without coming near its surface.
#pragma once

#include "levelset/band.h"

namespace vshi {

// Voxels farther than this from the surface are joined across faces: between two of them no surface passes,
// and hardly any hole is wide enough to let them through.
constexpr float WELL_OFF = 0.8660255f;

// Adds the parts of a leaf: its voxels that are well off the surface, by what hangs together
// across the voxels' faces. Returns whether it has others.
bool add_parts(const float distances[VSHI_LEAF_VOXELS], std::vector<Bits> &parts);

// Leaves by their origin.
class LeafTable {
  public:
    static constexpr uint32_t NONE = UINT32_MAX;

    // `leaves` are sorted by origin, and outlive this.
    explicit LeafTable(const std::vector<BandLeaf> &leaves);
    uint32_t find(const Cell &origin) const; // NONE where there is no such leaf

    // Afterwards around() has a leaf and the 26 around it: at 9 x + 3 y + z, of 0 … 2 along each axis.
    void find_neighbours();
    const uint32_t *around(size_t leaf) const { return neighbours[leaf].data(); }

    const std::vector<BandLeaf> &leaves;

  private:
    std::vector<uint32_t> table;
    std::vector<std::array<uint32_t, 27>> neighbours;
};

// Voxels of a leaf whose side of the surface is known, and those that are outside.
struct KnownSides {
    Bits known{}, outside{};
};

// Tells the sides of all parts: they are joined across the faces of voxels, through leaves that are not there
// as well. Holes in the surface that are narrower than some 1.7 voxels let nothing through.
// Throws where the stage is cancelled. The table knows its neighbours.
std::vector<KnownSides> find_outside(const LeafTable &table, Stage &stage);

} // namespace vshi
