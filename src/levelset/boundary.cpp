#include "levelset/boundary.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace vshi {

namespace {

using openvdb::Vec3d;

constexpr int LEAF = 8;
// Pieces of triangles are not cut below this, voxels.
constexpr double PIECE = 1.0;

bool any(const Bits &bits) {
    return std::any_of(bits.begin(), bits.end(), [](uint64_t word) { return word != 0; });
}

enum class Bounds { NOTHING, ALL, SOME };

class Cutting {
  public:
    Cutting(const LeafTable &table_, const std::vector<Sides::Told> &told_, Surface &kept_)
        : table(table_), told(told_), kept(kept_) {}

    // Adds what bounds the outside of a triangle.
    void cut(const Corners &corner) {
        if (sort(corner) == Bounds::ALL) {
            add(corner);
        }
    }

  private:
    // What of the triangle bounds the outside; that is added where it is some.
    Bounds sort(const Corners &corner) {
        const double square[3] = {(corner[1] - corner[0]).lengthSqr(), (corner[2] - corner[1]).lengthSqr(),
                                  (corner[0] - corner[2]).lengthSqr()};
        const size_t longest = size_t(std::max_element(square, square + 3) - square);
        if (!(square[longest] > PIECE * PIECE)) {
            return near_outside((corner[0] + corner[1] + corner[2]) / 3.0) ? Bounds::ALL : Bounds::NOTHING;
        }
        const Vec3d middle = 0.5 * (corner[longest] + corner[(longest + 1) % 3]);
        const Vec3d &from = corner[longest], &to = corner[(longest + 1) % 3],
                    &opposite = corner[(longest + 2) % 3];
        const Corners half[2] = {{from, middle, opposite}, {middle, to, opposite}};
        const Bounds bounds[2] = {sort(half[0]), sort(half[1])};
        if (bounds[0] == bounds[1] && bounds[0] != Bounds::SOME) {
            return bounds[0];
        }
        for (int i = 0; i < 2; ++i) {
            if (bounds[i] == Bounds::ALL) {
                add(half[i]);
            }
        }
        return Bounds::SOME;
    }

    // Whether one of the eight voxels around a point is outside: of a surface that bounds it, there is one on
    // either side.
    bool near_outside(const Vec3d &p) {
        Cell first;
        for (int axis = 0; axis < 3; ++axis) {
            first[axis] = int32_t(std::floor(p[axis]));
        }
        for (int i = 0; i < 8; ++i) {
            if (is_outside({first[0] + (i & 1), first[1] + (i >> 1 & 1), first[2] + (i >> 2)})) {
                return true;
            }
        }
        return false;
    }

    bool is_outside(const Cell &voxel) {
        constexpr int32_t mask = ~(LEAF - 1);
        const Cell origin{voxel[0] & mask, voxel[1] & mask, voxel[2] & mask};
        if (!same(origin, last_origin)) { // else as for the voxel before
            last_origin = origin;
            last = table.find(origin);
        }
        return last != LeafTable::NONE &&
               (told[last].outside[size_t(voxel[0] & 7)] >> (8 * (voxel[1] & 7) + (voxel[2] & 7)) & 1) != 0;
    }

    void add(const Corners &corner) {
        const auto first = uint32_t(kept.points.size());
        for (const Vec3d &point : corner) {
            kept.points.emplace_back(point);
        }
        kept.polygons.emplace_back(first, first + 1, first + 2, UINT32_MAX);
    }

    const LeafTable &table;
    const std::vector<Sides::Told> &told;
    Surface &kept;
    Cell last_origin{1, 1, 1}; // none's
    uint32_t last = LeafTable::NONE;
};

} // namespace

Surface boundary_of(const Surface &surface, const LeafTable &table, const std::vector<Sides::Told> &told) {
    std::vector<bool> in_doubt(2 * surface.polygons.size());
    for (size_t i = 0; i < told.size(); ++i) {
        const BandLeaf &leaf = table.leaves[i];
        for (size_t t = 0; any(told[i].buried) && t < leaf.triangle_count; ++t) {
            in_doubt[leaf.triangles[t]] = true;
        }
    }
    Surface kept;
    kept.points = surface.points;
    Cutting cutting(table, told, kept);
    for (size_t i = 0; i < surface.polygons.size(); ++i) {
        const bool whole = !in_doubt[2 * i] && !in_doubt[2 * i + 1];
        if (whole) {
            kept.polygons.push_back(surface.polygons[i]);
        }
        for (uint32_t half = 0; !whole && half < triangles_of(surface.polygons[i]); ++half) {
            cutting.cut(corners_of(surface, uint32_t(2 * i + half)));
        }
    }
    return kept;
}

std::vector<size_t> regions_near_buried(const Band &band, const std::vector<BandLeaf> &leaves,
                                        const std::vector<Sides::Told> &told) {
    std::set<Cell> near;
    const int reach = int(std::ceil(band.half_width));
    for (size_t i = 0; i < leaves.size(); ++i) {
        if (!any(told[i].buried)) {
            continue;
        }
        Cell low, high;
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = (leaves[i].origin[axis] - reach) & ~(Band::REGION - 1);
            high[axis] = leaves[i].origin[axis] + LEAF - 1 + reach;
        }
        for (int32_t x = low[0]; x <= high[0]; x += Band::REGION) {
            for (int32_t y = low[1]; y <= high[1]; y += Band::REGION) {
                for (int32_t z = low[2]; z <= high[2]; z += Band::REGION) {
                    near.insert({x, y, z});
                }
            }
        }
    }
    std::vector<size_t> numbers;
    for (size_t i = 0; i < band.region_count(); ++i) {
        if (near.count(band.region_origin(i)) != 0) {
            numbers.push_back(i);
        }
    }
    return numbers;
}

} // namespace vshi
