#include "levelset/sides.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace vshi {

namespace {

using openvdb::Vec3d;

constexpr int LEAF = 8;
constexpr int EDGE = 10; // of a leaf with the voxels around it
// Voxels nearer than this lie on the surface: neither side is wrong.
constexpr float ON = 1e-4f;
// What goes by a triangle's edge within this, voxels, goes through it.
constexpr double AT_EDGE = 1e-6;
// By how much boxes of triangles are too large, voxels: more than their rounding.
constexpr double BOX_MARGIN = 1e-3;

constexpr uint64_t ROW_ENDS = 0x0101010101010101u;

// Part 0, 1 or 2 of the leaves around that position 0 … 9 of the halo lies in.
int part_of(int position) {
    return position == 0 ? 0 : position == EDGE - 1 ? 2 : 1;
}

int in_halo(int x, int y, int z) {
    return (x * EDGE + y) * EDGE + z;
}

} // namespace

struct Sides::Halo {
    float distance[EDGE * EDGE * EDGE];
    int8_t side[EDGE * EDGE * EDGE]; // 1: outside, -1: inside, 0: not known
};

// Whether one of the 26 neighbours is outside.
bool Sides::touches_outside(const Halo &halo, int at) {
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            const int8_t *const side = halo.side + at + in_halo(x, y, 0);
            if (side[-1] > 0 || side[0] > 0 || side[1] > 0) {
                return true;
            }
        }
    }
    return false;
}

Sides::Sides(const Surface &surface_, const LeafTable &table_)
    : surface(surface_), table(table_), leaves(table_.leaves), now(find_outside(table)), next(now) {}

// Byte z is 1 where bit z is set.
static uint64_t spread(uint64_t byte) {
    const uint64_t copies = byte * ROW_ENDS & 0x8040201008040201u;
    return ((copies + 0x7f7f7f7f7f7f7f7fu) | copies) >> 7 & ROW_ENDS;
}

// One row of a leaf: its distances, and the sides that are known (1: outside, -1: inside, 0: not known).
struct Sides::Row {
    const float *distance;
    int8_t side[LEAF];
};

Sides::Row Sides::row(uint32_t leaf, int x, int y) const {
    const uint64_t known = now[leaf].known[x] >> 8 * y & 0xff, outside = now[leaf].outside[x] >> 8 * y & 0xff;
    const uint64_t sides = spread(outside) | spread(known & ~outside) * 0xff;
    Row row{leaves[leaf].distances + 64 * x + 8 * y, {}};
    std::memcpy(row.side, &sides, sizeof sides);
    return row;
}

// What is near the surface has leaves all around it; where there is none, nothing is known.
void Sides::gather(size_t i, Halo &halo) const {
    uint32_t around[27];
    for (int k = 0; k < 27; ++k) {
        const Cell &origin = leaves[i].origin;
        around[k] = k == 13 ? uint32_t(i)
                            : table.find({origin[0] + LEAF * (k / 9 - 1), origin[1] + LEAF * (k / 3 % 3 - 1),
                                          origin[2] + LEAF * (k % 3 - 1)});
    }
    std::fill_n(halo.side, EDGE * EDGE * EDGE, int8_t(0));
    std::fill_n(halo.distance, EDGE * EDGE * EDGE, 0.0f);
    for (int x = 0; x < EDGE; ++x) {
        for (int y = 0; y < EDGE; ++y) {
            const uint32_t *const from = around + 9 * part_of(x) + 3 * part_of(y);
            const int to = in_halo(x, y, 0), inner_x = (x + 7) & 7, inner_y = (y + 7) & 7;
            if (from[0] != LeafTable::NONE) {
                const Row last = row(from[0], inner_x, inner_y);
                halo.distance[to] = last.distance[LEAF - 1];
                halo.side[to] = last.side[LEAF - 1];
            }
            if (from[1] != LeafTable::NONE) {
                const Row all = row(from[1], inner_x, inner_y);
                std::copy_n(all.distance, LEAF, halo.distance + to + 1);
                std::copy_n(all.side, LEAF, halo.side + to + 1);
            }
            if (from[2] != LeafTable::NONE) {
                const Row first = row(from[2], inner_x, inner_y);
                halo.distance[to + EDGE - 1] = first.distance[0];
                halo.side[to + EDGE - 1] = first.side[0];
            }
        }
    }
}

namespace {

// Whether the piece from a to b goes through the triangle; in doubt at its edges, it does.
bool goes_through(const Corners &corner, const Vec3d &a, const Vec3d &b) {
    const Vec3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    const double from = normal.dot(a - corner[0]), to = normal.dot(b - corner[0]);
    if (!((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0))) {
        return false;
    }
    const Vec3d place = a + (b - a) * (from / (from - to));
    for (int i = 0; i < 3; ++i) {
        const Vec3d edge = corner[(i + 1) % 3] - corner[i];
        const double beside = edge.cross(place - corner[i]).dot(normal);
        if (beside < 0.0 && beside * beside > AT_EDGE * AT_EDGE * edge.lengthSqr() * normal.lengthSqr()) {
            return false;
        }
    }
    return true;
}

// A neighbour whose side is known.
struct Known26 {
    float distance;
    int8_t side;
    int8_t step[3];
};

} // namespace

// The triangles near a leaf as boxes, so that one look finds those near a voxel.
class Sides::Nearby {
  public:
    Nearby(const Surface &surface_, const BandLeaf &leaf_) : surface(surface_), leaf(leaf_) {}

    // Whether one of them is between two neighbours.
    bool parts(const Cell &from, const Cell &to) {
        if (boxes.empty()) {
            fill();
        }
        const size_t count = leaf.triangle_count;
        float low[3], high[3];
        Vec3d a, b;
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = float(std::min(from[axis], to[axis]));
            high[axis] = float(std::max(from[axis], to[axis]));
            a[axis] = leaf.origin[axis] + from[axis];
            b[axis] = leaf.origin[axis] + to[axis];
        }
        const float *const box = boxes.data();
        for (size_t i = 0; i < count; ++i) {
            hit[i] = (box[i] <= high[0]) & (box[count + i] <= high[1]) & (box[2 * count + i] <= high[2]) &
                     (box[3 * count + i] >= low[0]) & (box[4 * count + i] >= low[1]) &
                     (box[5 * count + i] >= low[2]);
        }
        for (size_t i = 0; i < count; ++i) {
            if (hit[i] != 0 && goes_through(corners_of(surface, leaf.triangles[i]), a, b)) {
                return true;
            }
        }
        return false;
    }

  private:
    void fill() {
        const size_t count = leaf.triangle_count;
        boxes.resize(6 * count + 1);
        hit.resize(count);
        for (size_t i = 0; i < count; ++i) {
            const Corners corner = corners_of(surface, leaf.triangles[i]);
            for (int axis = 0; axis < 3; ++axis) {
                const auto ends = std::minmax({corner[0][axis], corner[1][axis], corner[2][axis]});
                boxes[axis * count + i] = float(ends.first - leaf.origin[axis] - BOX_MARGIN);
                boxes[(3 + axis) * count + i] = float(ends.second - leaf.origin[axis] + BOX_MARGIN);
            }
        }
    }

    const Surface &surface;
    const BandLeaf &leaf;
    std::vector<float> boxes; // lows along x, y and z, then highs
    std::vector<uint8_t> hit;
};

// The side of a voxel that is not known: that of a neighbour that it shares a free ball with, or of one that
// no triangle parts it from. 0: none.
int Sides::side_of(const Halo &halo, const Cell &local, Nearby &nearby) {
    const int at = in_halo(local[0] + 1, local[1] + 1, local[2] + 1);
    const float own = halo.distance[at];
    if (own < ON) {
        return 0;
    }
    // First the neighbour that lies away from the surface.
    constexpr int stride[3] = {EDGE * EDGE, EDGE, 1};
    float slope[3], steepest = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        slope[axis] = halo.distance[at + stride[axis]] - halo.distance[at - stride[axis]];
        steepest = std::max(steepest, std::fabs(slope[axis]));
    }
    int there = at, square = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (std::fabs(slope[axis]) > 0.41421f * steepest) {
            there += slope[axis] > 0.0f ? stride[axis] : -stride[axis];
            ++square;
        }
    }
    constexpr float length[4] = {0.0f, 1.00001f, 1.41423f, 1.73207f};
    if (halo.side[there] != 0 && own + halo.distance[there] > length[square]) {
        return halo.side[there];
    }
    Known26 known[26];
    int count = 0;
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                const int k = at + x * stride[0] + y * stride[1] + z;
                if (halo.side[k] == 0) {
                    continue;
                }
                if (own + halo.distance[k] > length[x * x + y * y + z * z]) {
                    return halo.side[k];
                }
                known[count++] = {halo.distance[k], halo.side[k], {int8_t(x), int8_t(y), int8_t(z)}};
            }
        }
    }
    std::stable_sort(known, known + count,
                     [](const Known26 &a, const Known26 &b) { return a.distance > b.distance; });
    for (int k = 0; k < count; ++k) {
        const int8_t *const step = known[k].step;
        if (!nearby.parts(local, {local[0] + step[0], local[1] + step[1], local[2] + step[2]})) {
            return known[k].side;
        }
    }
    return 0;
}

bool Sides::is_settled(size_t i) const {
    uint64_t all = ~uint64_t(0);
    for (const uint64_t word : now[i].known) {
        all &= word;
    }
    return ~all == 0;
}

void Sides::settle(size_t i) {
    next[i] = now[i];
    if (is_settled(i)) {
        return;
    }
    Halo halo;
    gather(i, halo);
    Nearby nearby(surface, leaves[i]);
    for (int x = 0; x < LEAF; ++x) {
        for (uint64_t left = ~now[i].known[x]; left != 0; left &= left - 1) {
            const int n = __builtin_ctzll(left);
            const int side = side_of(halo, {x, n >> 3, n & 7}, nearby);
            if (side != 0) {
                next[i].known[x] |= uint64_t(1) << n;
                next[i].outside[x] |= uint64_t(side > 0) << n;
            }
        }
    }
}

void Sides::end_round() {
    now.swap(next);
}

Sides::Told Sides::tell(size_t i) const {
    Told told{now[i].outside, {}};
    Halo halo;
    bool gathered = false;
    for (int x = 0; x < LEAF; ++x) {
        for (uint64_t left = ~told.outside[x]; left != 0; left &= left - 1) {
            const int n = __builtin_ctzll(left);
            const float distance = leaves[i].distances[64 * x + n];
            if (distance > WELL_OFF) {
                continue;
            }
            if (!gathered) {
                gather(i, halo);
                gathered = true;
            }
            if (!touches_outside(halo, in_halo(x + 1, (n >> 3) + 1, (n & 7) + 1))) {
                told.buried[x] |= uint64_t(1) << n;
            } else if (distance < ON) {
                told.outside[x] |= uint64_t(1) << n;
            }
        }
    }
    return told;
}

} // namespace vshi
