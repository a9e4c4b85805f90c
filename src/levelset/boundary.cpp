#include "levelset/band.h"

#include <algorithm>
#include <cmath>

namespace vshi {

namespace {

using openvdb::Vec3d;

constexpr int LEAF = 8;
// Pieces of triangles are not cut below this, voxels.
constexpr double PIECE = 1.0;
// Longest triangles whose box of cells is tested before they are cut, voxels.
constexpr double GLANCE = 32.0;
// Upper bound of the distance, voxels, by which rounding moves a piece's middle off its triangle.
constexpr double MARGIN = 1e-5;
using Piece = std::array<openvdb::Vec3s, 3>;

// For each lattice cell of a leaf, at its first voxel: whether one of the eight voxels at its corners is
// outside. A surface that bounds the outside passes such cells only.
Bits cells_near_outside(const LeafTable &table, const std::vector<Sides> &sides, size_t leaf) {
    const Bits *around[8];
    static const Bits none{};
    for (int n = 0; n < 8; ++n) {
        const uint32_t found = table.around(leaf)[13 + (n & 4 ? 9 : 0) + (n & 2 ? 3 : 0) + (n & 1)];
        around[n] = found == LeafTable::NONE ? &none : &sides[found].outside;
    }
    constexpr uint64_t last_z = 0x8080808080808080u;
    // The voxels of a plane, joined with the next along z and along y.
    const auto plane = [&](int n, int x) {
        uint64_t rows[2];
        for (int y = 0; y < 2; ++y) {
            const uint64_t own = (*around[n + 2 * y])[x], next = (*around[n + 2 * y + 1])[x];
            rows[y] = own | (own >> 1 & ~last_z) | (next << 7 & last_z);
        }
        return rows[0] | rows[0] >> 8 | rows[1] << 56;
    };
    Bits near;
    uint64_t next = plane(4, 0);
    for (int x = LEAF - 1; x >= 0; --x) {
        const uint64_t own = plane(0, x);
        near[x] = own | next;
        next = own;
    }
    return near;
}

enum class Bounds { NOTHING, ALL, SOME };

class Cutting {
  public:
    Cutting(const LeafTable &table_, const std::vector<Bits> &near_, Stage &stage_, std::vector<Piece> &kept_)
        : table(table_), near(near_), stage(stage_), kept(kept_) {}

    // Adds the parts of a triangle that bound the outside.
    void cut(const Corners &corner) {
        if (sort(corner) == Bounds::ALL) {
            add(corner);
        }
    }

  private:
    void add(const Corners &corner) {
        kept.push_back({openvdb::Vec3s(corner[0]), openvdb::Vec3s(corner[1]), openvdb::Vec3s(corner[2])});
    }

    // Decides whether the triangle bounds the outside. If some of it does, adds that part.
    Bounds sort(const Corners &corner) {
        const double square[3] = {(corner[1] - corner[0]).lengthSqr(), (corner[2] - corner[1]).lengthSqr(),
                                  (corner[0] - corner[2]).lengthSqr()};
        const size_t longest = size_t(std::max_element(square, square + 3) - square);
        if (!(square[longest] > PIECE * PIECE)) {
            const Vec3d middle = (corner[0] + corner[1] + corner[2]) / 3.0;
            return is_near_outside(cell_of(middle)) ? Bounds::ALL : Bounds::NOTHING;
        }
        if (square[longest] >= GLANCE * GLANCE && stage.cancelled()) {
            return Bounds::NOTHING; // the caller discards the result
        }
        if (square[longest] < GLANCE * GLANCE) {
            const Bounds glanced = glance(corner);
            if (glanced != Bounds::SOME) {
                return glanced;
            }
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

    // Decides by the cells of a triangle's box, if these are all alike. That settles axis-aligned planes
    // early.
    Bounds glance(const Corners &corner) {
        Cell low, high;
        for (int axis = 0; axis < 3; ++axis) {
            const auto ends = std::minmax({corner[0][axis], corner[1][axis], corner[2][axis]});
            low[axis] = floor_of(ends.first - MARGIN);
            high[axis] = floor_of(ends.second + MARGIN);
        }
        uint64_t inner = 0, outer = 0;
        constexpr int32_t mask = ~(LEAF - 1);
        for (int32_t x = low[0] & mask; x <= high[0]; x += LEAF) {
            for (int32_t y = low[1] & mask; y <= high[1]; y += LEAF) {
                for (int32_t z = low[2] & mask; z <= high[2]; z += LEAF) {
                    const uint64_t across = ROW_ENDS * range(low[2], high[2], z, 1);
                    const uint64_t box = across & range(low[1], high[1], y, LEAF);
                    const Bits *const leaf = near_of({x, y, z});
                    const int32_t end = std::min(high[0] - x, LEAF - 1);
                    for (int32_t i = std::max(low[0] - x, 0); i <= end; ++i) {
                        const uint64_t word = leaf == nullptr ? 0 : (*leaf)[size_t(i)];
                        inner |= box & ~word;
                        outer |= box & word;
                    }
                    if (inner != 0 && outer != 0) {
                        return Bounds::SOME;
                    }
                }
            }
        }
        return outer != 0 ? Bounds::ALL : Bounds::NOTHING;
    }

    // The bits of low … high within a leaf that begins at `origin`, each `width` bits wide.
    static uint64_t range(int32_t low, int32_t high, int32_t origin, int width) {
        const int first = std::max(low - origin, 0), last = std::min(high - origin, LEAF - 1);
        const uint64_t all = width == 1 ? 0xff : ~uint64_t(0);
        return all >> width * (LEAF - 1 - (last - first)) << width * first;
    }

    static int32_t floor_of(double x) {
        const auto whole = int32_t(x);
        return whole - (x < whole);
    }

    static Cell cell_of(const Vec3d &p) { return {floor_of(p[0]), floor_of(p[1]), floor_of(p[2])}; }

    // Returns NULL if there is no such leaf.
    const Bits *near_of(const Cell &origin) {
        if (!same(origin, last_origin)) {
            last_origin = origin;
            last = table.find(origin);
        }
        return last == LeafTable::NONE ? nullptr : &near[last];
    }

    bool is_near_outside(const Cell &cell) {
        constexpr int32_t mask = ~(LEAF - 1);
        const Bits *const leaf = near_of({cell[0] & mask, cell[1] & mask, cell[2] & mask});
        return leaf != nullptr &&
               ((*leaf)[size_t(cell[0] & 7)] >> (8 * (cell[1] & 7) + (cell[2] & 7)) & 1) != 0;
    }

    const LeafTable &table;
    const std::vector<Bits> &near;
    Stage &stage;
    std::vector<Piece> &kept;
    Cell last_origin{1, 1, 1}; // of no leaf
    uint32_t last = LeafTable::NONE;
};

} // namespace

Surface boundary_of(const Surface &surface, const LeafTable &table, const std::vector<Sides> &sides,
                    double begin, double end, Stage &stage) {
    std::vector<uint8_t> in_doubt(surface.polygons.size());
    for (size_t i = 0; i < sides.size(); ++i) {
        if (any(sides[i].buried)) {
            for (const uint32_t triangle : table.leaves[i].triangles) {
                in_doubt[triangle / 2] = 1;
            }
        }
    }
    std::vector<uint32_t> doubtful;
    for (size_t i = 0; i < in_doubt.size(); ++i) {
        if (in_doubt[i] != 0) {
            doubtful.push_back(uint32_t(i));
        }
    }
    const double middle = 0.5 * (begin + end);
    std::vector<Bits> near(sides.size());
    stage.loop(near.size(), 256, begin, middle,
               [&](size_t i) { near[i] = cells_near_outside(table, sides, i); });
    std::vector<std::vector<Piece>> pieces(doubtful.size());
    stage.loop(doubtful.size(), 4, middle, end, [&](size_t i) {
        Cutting cutting(table, near, stage, pieces[i]);
        for (uint32_t half = 0; half < triangles_of(surface.polygons[doubtful[i]]); ++half) {
            cutting.cut(corners_of(surface, 2 * doubtful[i] + half));
        }
    });
    Surface kept;
    kept.points = surface.points;
    size_t next = 0;
    for (size_t i = 0; i < surface.polygons.size(); ++i) {
        if (in_doubt[i] == 0) {
            kept.polygons.push_back(surface.polygons[i]);
            continue;
        }
        for (const Piece &piece : pieces[next]) {
            const auto first = uint32_t(kept.points.size());
            kept.points.insert(kept.points.end(), piece.begin(), piece.end());
            kept.polygons.emplace_back(first, first + 1, first + 2, UINT32_MAX);
        }
        std::vector<Piece>().swap(pieces[next++]);
    }
    return kept;
}

std::set<Cell> regions_near_buried(const LeafTable &table, const std::vector<Sides> &sides,
                                   double half_width) {
    std::set<Cell> near;
    const int reach = int(std::ceil(half_width));
    for (size_t i = 0; i < sides.size(); ++i) {
        if (!any(sides[i].buried)) {
            continue;
        }
        const Coord origin(table.leaves[i].origin.data());
        visit_blocks({origin.offsetBy(-reach), origin.offsetBy(LEAF - 1 + reach)}, Band::REGION,
                     [&](const Coord &region) {
                         near.insert({region[0], region[1], region[2]});
                     });
    }
    return near;
}

} // namespace vshi
