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
    int8_t side[EDGE * EDGE * EDGE]; // 1: outside, -1: inside, 0: not known, or tried before
};

Sides::Sides(const Surface &surface_, const LeafTable &table_, Stage &stage)
    : surface(surface_), table(table_), leaves(table_.leaves), now(find_outside(table, stage)), next(now),
      tried(now.size()) {
    well_off.reserve(now.size());
    any_fresh.reserve(now.size());
    for (const KnownSides &sides : now) {
        well_off.push_back(sides.known);
        any_fresh.push_back(sides.known != Bits{});
    }
}

// Known, and not tried in the rounds before.
uint64_t Sides::fresh(uint32_t leaf, size_t x) const {
    return now[leaf].known[x] & ~tried[leaf][x];
}

bool Sides::has_fresh(const uint32_t around[27]) const {
    return std::any_of(around, around + 27,
                       [&](uint32_t leaf) { return leaf != LeafTable::NONE && any_fresh[leaf] != 0; });
}

// What is near the surface has leaves all around it; where there is none, nothing is known.
void Sides::gather(const uint32_t around[27], Halo &halo) const {
    const auto take_one = [&](uint32_t leaf, int x, int n, int to) {
        const bool is_there = leaf != LeafTable::NONE;
        halo.distance[to] = is_there ? leaves[leaf].distances[64 * x + n] : 0.0f;
        const bool known = is_there && (fresh(leaf, size_t(x)) >> n & 1) != 0;
        halo.side[to] = int8_t(!known ? 0 : (now[leaf].outside[x] >> n & 1) != 0 ? 1 : -1);
    };
    for (int x = 0; x < EDGE; ++x) {
        for (int y = 0; y < EDGE; ++y) {
            const uint32_t *const from = around + 9 * part_of(x) + 3 * part_of(y);
            const int to = in_halo(x, y, 0), inner_x = (x + 7) & 7, row = 8 * ((y + 7) & 7);
            take_one(from[0], inner_x, row + LEAF - 1, to);
            take_one(from[2], inner_x, row, to + EDGE - 1);
            uint64_t sides = 0;
            if (from[1] != LeafTable::NONE) {
                const uint64_t known = fresh(from[1], size_t(inner_x)) >> row & 0xff;
                const uint64_t outside = known & now[from[1]].outside[inner_x] >> row;
                sides = spread(outside) | spread(known & ~outside) * 0xff;
                std::memcpy(halo.distance + to + 1, leaves[from[1]].distances + 64 * inner_x + row,
                            LEAF * sizeof *halo.distance);
            } else {
                std::fill_n(halo.distance + to + 1, LEAF, 0.0f);
            }
            std::memcpy(halo.side + to + 1, &sides, sizeof sides);
        }
    }
}

// The leaf's voxels that are of a set or one of whose 26 neighbours is; `word_of(leaf, x)` tells the set.
template <typename Word> static Bits touching(const uint32_t *around, const Word &word_of) {
    const auto word = [&](int k, int x) {
        return around[k] == LeafTable::NONE ? uint64_t(0) : word_of(around[k], size_t(x));
    };
    // A plane of three leaves along z, with what touches it along z.
    const auto row = [&](int k, int x) {
        const uint64_t own = word(k + 1, x);
        return own | (own << 1 & ~ROW_ENDS) | (own >> 1 & ~(ROW_ENDS << 7)) | (word(k, x) >> 7 & ROW_ENDS) |
               (word(k + 2, x) & ROW_ENDS) << 7;
    };
    uint64_t planes[EDGE];
    for (int x = 0; x < EDGE; ++x) {
        const int k = 9 * part_of(x), inner_x = (x + 7) & 7;
        const uint64_t own = row(k + 3, inner_x);
        planes[x] = own | own << 8 | own >> 8 | row(k, inner_x) >> 56 | row(k + 6, inner_x) << 56;
    }
    Bits all;
    for (size_t x = 0; x < LEAF; ++x) {
        all[x] = planes[x] | planes[x + 1] | planes[x + 2];
    }
    return all;
}

namespace {

// A triangle near a voxel.
struct Near {
    Corners corner;
    Vec3d normal;
    float low[3], high[3]; // a box around it, from the leaf's origin
    double height;         // of the voxel over its plane, times the normal's length
};

// Whether the piece from the voxel at a to b goes through the triangle; in doubt at its edges, it does.
bool goes_through(const Near &near, const Vec3d &a, const Vec3d &b) {
    const double from = near.height, to = near.normal.dot(b - near.corner[0]);
    if (!((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0))) {
        return false;
    }
    const Vec3d place = a + (b - a) * (from / (from - to));
    for (int i = 0; i < 3; ++i) {
        const Vec3d edge = near.corner[(i + 1) % 3] - near.corner[i];
        const double beside = edge.cross(place - near.corner[i]).dot(near.normal);
        if (beside < 0.0 &&
            beside * beside > AT_EDGE * AT_EDGE * edge.lengthSqr() * near.normal.lengthSqr()) {
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

    // The voxel that parts() is asked of.
    void go_to(const Cell &local_) {
        local = local_;
        taken = false;
    }

    // Whether a triangle is between the voxel and a neighbour.
    bool parts(const int8_t step[3]) {
        if (!taken) {
            take();
        }
        float low[3], high[3];
        Vec3d to;
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t end = local[axis] + step[axis];
            low[axis] = float(std::min(local[axis], end));
            high[axis] = float(std::max(local[axis], end));
            to[axis] = leaf.origin[axis] + end;
        }
        for (Near &one : near) {
            if ((one.low[0] <= high[0]) & (one.low[1] <= high[1]) & (one.low[2] <= high[2]) &
                    (one.high[0] >= low[0]) & (one.high[1] >= low[1]) & (one.high[2] >= low[2]) &&
                goes_through(one, place, to)) {
                std::swap(one, near.front()); // it is likely to part the next one, too
                return true;
            }
        }
        return false;
    }

  private:
    void take() {
        if (boxes.empty()) {
            fill();
        }
        const size_t count = leaf.triangle_count;
        const float *const box = boxes.data();
        const float x = float(local[0]), y = float(local[1]), z = float(local[2]);
        for (size_t i = 0; i < count; ++i) {
            hit[i] = (box[i] <= x + 1.0f) & (box[count + i] <= y + 1.0f) & (box[2 * count + i] <= z + 1.0f) &
                     (box[3 * count + i] >= x - 1.0f) & (box[4 * count + i] >= y - 1.0f) &
                     (box[5 * count + i] >= z - 1.0f);
        }
        place = Vec3d(leaf.origin[0] + local[0], leaf.origin[1] + local[1], leaf.origin[2] + local[2]);
        near.clear();
        for (size_t i = 0; i < count; ++i) {
            if (hit[i] == 0) {
                continue;
            }
            Near one{corners_of(surface, leaf.triangles[i]), {}, {}, {}, 0.0};
            one.normal = (one.corner[1] - one.corner[0]).cross(one.corner[2] - one.corner[0]);
            one.height = one.normal.dot(place - one.corner[0]);
            for (size_t axis = 0; axis < 3; ++axis) {
                one.low[axis] = box[axis * count + i];
                one.high[axis] = box[(3 + axis) * count + i];
            }
            near.push_back(one);
        }
        taken = true;
    }

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
    Cell local{};
    Vec3d place;
    bool taken = false;
    std::vector<Near> near; // what may be between the voxel and its neighbours
};

// The side of a voxel that is not known: that of a neighbour that it shares a free ball with, or of one that
// no triangle parts it from. 0: none.
int Sides::side_of(const Halo &halo, const Cell &local, Nearby &nearby) {
    const int at = in_halo(local[0] + 1, local[1] + 1, local[2] + 1);
    const float own = halo.distance[at];
    // First the neighbour that lies away from the surface.
    constexpr int stride[3] = {EDGE * EDGE, EDGE, 1};
    float slope[3], steepest = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        slope[axis] = halo.distance[at + stride[axis]] - halo.distance[at - stride[axis]];
        steepest = std::max(steepest, std::fabs(slope[axis]));
    }
    int there = at, square = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int step = (slope[axis] > 0.41421f * steepest) - (slope[axis] < -0.41421f * steepest);
        there += step * stride[axis];
        square += step & 1;
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
    nearby.go_to(local);
    for (int tried = 0; tried < count; ++tried) { // the farthest from the surface first
        Known26 *const farthest = std::max_element(
            known, known + count, [](const Known26 &a, const Known26 &b) { return a.distance < b.distance; });
        if (!nearby.parts(farthest->step)) {
            return farthest->side;
        }
        farthest->distance = -1.0f;
    }
    return 0;
}

void Sides::settle(size_t i) {
    next[i] = now[i];
    Bits left; // those on the surface stay unknown
    bool any = false;
    for (size_t x = 0; x < LEAF; ++x) {
        left[x] = ~now[i].known[x];
        for (uint64_t unknown = left[x]; unknown != 0; unknown &= unknown - 1) {
            const int n = __builtin_ctzll(unknown);
            left[x] ^= uint64_t(leaves[i].distances[64 * x + size_t(n)] < ON) << n;
        }
        any |= left[x] != 0;
    }
    if (!any) {
        return;
    }
    const uint32_t *const around = table.around(i);
    if (!has_fresh(around)) {
        return;
    }
    // those without a neighbour whose side is known learn nothing now
    const Bits near_fresh = touching(around, [&](uint32_t leaf, size_t x) { return fresh(leaf, x); });
    uint64_t all = 0;
    for (size_t x = 0; x < LEAF; ++x) {
        left[x] &= near_fresh[x];
        all |= left[x];
    }
    if (all == 0) {
        return;
    }
    Halo halo;
    gather(around, halo);
    Nearby nearby(surface, leaves[i]);
    for (int x = 0; x < LEAF; ++x) {
        for (; left[x] != 0; left[x] &= left[x] - 1) {
            const int n = __builtin_ctzll(left[x]);
            const int side = side_of(halo, {x, n >> 3, n & 7}, nearby);
            if (side != 0) {
                next[i].known[x] |= uint64_t(1) << n;
                next[i].outside[x] |= uint64_t(side > 0) << n;
            }
        }
    }
}

void Sides::end_round() {
    for (size_t i = 0; i < now.size(); ++i) {
        tried[i] = now[i].known;
        any_fresh[i] = next[i].known != tried[i];
    }
    now.swap(next);
}

Sides::Told Sides::tell(size_t i) const {
    Told told{now[i].outside, {}};
    bool any = false;
    for (size_t x = 0; x < LEAF; ++x) {
        any |= (~told.outside[x] & ~well_off[i][x]) != 0;
    }
    if (!any) {
        return told;
    }
    const Bits near_outside =
        touching(table.around(i), [&](uint32_t leaf, size_t x) { return now[leaf].outside[x]; });
    for (size_t x = 0; x < LEAF; ++x) {
        const uint64_t near = ~told.outside[x] & ~well_off[i][x];
        told.buried[x] = near & ~near_outside[x];
        for (uint64_t left = near & near_outside[x]; left != 0; left &= left - 1) {
            const int n = __builtin_ctzll(left);
            told.outside[x] |= uint64_t(leaves[i].distances[64 * x + size_t(n)] < ON) << n;
        }
    }
    return told;
}

} // namespace vshi
