// Finds the side of the surface that each voxel is on. Voxels well off the surface are joined across their
// faces, and through missing leaves: no surface passes between them. Near the surface, a voxel gets its side
// from a neighbour if no surface separates the two. All voxels that are not joined with the outside are
// inside.
#include "levelset/band.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

namespace vshi {

namespace {

constexpr int LEAF = 8;
constexpr int EDGE = 10; // voxels along a leaf and one neighbour at each end
constexpr uint32_t EXTERIOR = 0;
// Voxels farther than this from the surface are joined across faces: no surface passes between two of them,
// and hardly any hole is wide enough for one.
constexpr float WELL_OFF = 0.8660255f;
// Voxels nearer than this lie on the surface: either side is right.
constexpr float ON = 1e-4f;
// A segment that passes a triangle's edge within this distance, voxels, meets the triangle.
constexpr double AT_EDGE = 1e-6;
// Margin of triangles' boxes, voxels: more than their rounding.
constexpr double BOX_MARGIN = 1e-3;
// Rounds in which voxels near the surface get their sides from neighbours.
constexpr int ROUNDS = 3;

// Byte z is 1 where bit z is set.
uint64_t spread(uint64_t byte) {
    const uint64_t copies = byte * ROW_ENDS & 0x8040201008040201u;
    return ((copies + 0x7f7f7f7f7f7f7f7fu) | copies) >> 7 & ROW_ENDS;
}

// The voxels of `within` connected to the seed.
Bits flood(Bits seed, const Bits &within) {
    for (bool changed = true; changed;) {
        changed = false;
        for (int x = 0; x < LEAF; ++x) {
            const uint64_t old = seed[x];
            uint64_t w = old | (x > 0 ? seed[x - 1] : 0) | (x < LEAF - 1 ? seed[x + 1] : 0);
            w |= w << 8 | w >> 8;
            w &= within[x];
            w |= (w << 1 & ~ROW_ENDS) | (w >> 1 & ~(ROW_ENDS << 7));
            w &= within[x];
            w |= (w << 1 & ~ROW_ENDS) | (w >> 1 & ~(ROW_ENDS << 7));
            w &= within[x];
            seed[x] = w;
            changed |= w != old;
        }
    }
    return seed;
}

// The 64 voxels of a leaf's face: the last along the axis, or the first.
uint64_t face(const Bits &bits, int axis, bool last) {
    if (axis == 0) {
        return bits[last ? LEAF - 1 : 0];
    }
    uint64_t all = 0;
    for (int x = 0; x < LEAF; ++x) {
        const uint64_t w = bits[x];
        const uint64_t row = axis == 1 ? (last ? w >> 56 : w & 0xff)
                                       : ((last ? w >> 7 : w) & ROW_ENDS) * 0x0102040810204080u >> 56;
        all |= row << 8 * x;
    }
    return all;
}

} // namespace

bool add_parts(const float distances[VSHI_LEAF_VOXELS], std::vector<Bits> &parts) {
    Bits left{};
    for (int i = 0; i < VSHI_LEAF_VOXELS; ++i) {
        left[size_t(i >> 6)] |= uint64_t(distances[i] > WELL_OFF) << (i & 63);
    }
    const bool others = std::any_of(left.begin(), left.end(), [](uint64_t word) { return ~word != 0; });
    for (int x = 0; x < LEAF;) {
        if (left[x] == 0) {
            ++x;
            continue;
        }
        Bits seed{};
        seed[x] = left[x] & (~left[x] + 1);
        const Bits part = flood(seed, left);
        for (int i = 0; i < LEAF; ++i) {
            left[i] &= ~part[i];
        }
        parts.push_back(part);
    }
    return others;
}

size_t LeafTable::lower_bound(const Cell &place) const {
    const auto before = [](const BandLeaf &leaf, const Cell &at) { return leaf.origin < at; };
    return size_t(std::lower_bound(leaves.begin(), leaves.end(), place, before) - leaves.begin());
}

uint32_t LeafTable::find(const Cell &origin) const {
    const size_t at = lower_bound(origin);
    return at < leaves.size() && same(leaves[at].origin, origin) ? uint32_t(at) : NONE;
}

void LeafTable::find_neighbours() {
    std::array<uint32_t, 27> none;
    none.fill(NONE);
    neighbours.assign(leaves.size(), none);
    size_t next[13] = {}; // by offset: neighbours have the same order as the leaves
    for (size_t i = 0; i < leaves.size(); ++i) {
        neighbours[i][13] = uint32_t(i);
        for (int k = 14; k < 27; ++k) {
            const Cell &origin = leaves[i].origin;
            const Cell at{origin[0] + LEAF * (k / 9 - 1), origin[1] + LEAF * (k / 3 % 3 - 1),
                          origin[2] + LEAF * (k % 3 - 1)};
            size_t &found = next[k - 14];
            while (found < leaves.size() && leaves[found].origin < at) {
                ++found;
            }
            if (found < leaves.size() && same(leaves[found].origin, at)) {
                neighbours[i][size_t(k)] = uint32_t(found);
                neighbours[found][size_t(26 - k)] = uint32_t(i);
            }
        }
    }
}

namespace {

bool same_column(const Cell &a, const Cell &b) {
    return a[0] == b[0] && a[1] == b[1];
}

// Sets of parts of leaves, of runs of empty leaves and of the exterior that are connected.
class Joining {
  public:
    Joining(const LeafTable &table_, Stage &stage) : table(table_), leaves(table.leaves) {
        size_t node = 1 + leaves.size();
        for (const BandLeaf &leaf : leaves) {
            first_part.push_back(node);
            node += leaf.parts.size();
        }
        parent.resize(node);
        std::iota(parent.begin(), parent.end(), 0);
        for (size_t i = 0; i < leaves.size(); ++i) {
            if (i % 1024 == 0) {
                stage.check();
            }
            if (run_below(i) != EXTERIOR && leaves[i - 1].origin[2] + LEAF < leaves[i].origin[2]) {
                join_run(i);
            }
            for (int axis = 0; axis < 3; ++axis) {
                join_face(i, axis, false);
                join_face(i, axis, true);
            }
        }
    }

    bool is_outside(size_t leaf, size_t part) { return root(first_part[leaf] + part) == EXTERIOR; }

  private:
    size_t root(size_t node) {
        while (parent[node] != node) {
            parent[node] = parent[parent[node]];
            node = parent[node];
        }
        return node;
    }

    // The exterior is the least of all nodes, and stays a root.
    void unite(size_t a, size_t b) {
        a = root(a);
        b = root(b);
        parent[std::max(a, b)] = uint32_t(std::min(a, b));
    }

    // The run of empty leaves that ends below leaf i, and may be empty. A run that begins at infinity is the
    // exterior.
    size_t run_below(size_t i) const {
        return i > 0 && same_column(leaves[i - 1].origin, leaves[i].origin) ? 1 + i : EXTERIOR;
    }

    // The run around a place without a leaf.
    size_t run_at(const Cell &place) const {
        const size_t above = table.lower_bound(place);
        return above < leaves.size() && same_column(leaves[above].origin, place) ? run_below(above)
                                                                                 : EXTERIOR;
    }

    // Joins the run below leaf i with its neighbours.
    void join_run(size_t i) {
        const int32_t low = leaves[i - 1].origin[2] + LEAF, high = leaves[i].origin[2];
        for (int side = 0; side < 4; ++side) {
            Cell at{leaves[i].origin[0], leaves[i].origin[1], low};
            at[side / 2] += side % 2 == 0 ? LEAF : -LEAF;
            for (size_t above = table.lower_bound(at); at[2] < high; ++above) {
                const bool is_there = above < leaves.size() && same_column(leaves[above].origin, at);
                if (!is_there || leaves[above].origin[2] > at[2]) {
                    unite(1 + i, is_there ? run_below(above) : EXTERIOR);
                }
                if (!is_there) {
                    break;
                }
                at[2] = leaves[above].origin[2] + LEAF;
            }
        }
    }

    // Joins the parts of leaf i with the parts or the run beyond one of its faces.
    void join_face(size_t i, int axis, bool last) {
        Cell beyond = leaves[i].origin;
        beyond[axis] += last ? LEAF : -LEAF;
        constexpr int stride[3] = {9, 3, 1};
        const uint32_t neighbour = table.around(i)[13 + (last ? stride[axis] : -stride[axis])];
        const bool is_there = neighbour != LeafTable::NONE;
        if (is_there && !last) {
            return; // the neighbour joins them
        }
        const size_t run = is_there ? EXTERIOR : run_at(beyond);
        for (size_t p = 0; p < leaves[i].parts.size(); ++p) {
            const uint64_t own = face(leaves[i].parts[p], axis, last);
            if (own != 0 && !is_there) {
                unite(first_part[i] + p, run);
            }
            for (size_t q = 0; is_there && q < leaves[neighbour].parts.size(); ++q) {
                if ((own & face(leaves[neighbour].parts[q], axis, false)) != 0) {
                    unite(first_part[i] + p, first_part[neighbour] + q);
                }
            }
        }
    }

    const LeafTable &table;
    const std::vector<BandLeaf> &leaves;
    std::vector<size_t> first_part; // nodes: EXTERIOR, the runs below leaves, the parts of leaves
    std::vector<uint32_t> parent;
};

// Voxels of a leaf whose side of the surface is known, and those that are outside.
struct KnownSides {
    Bits known{}, outside{};
};

// The sides of all parts.
std::vector<KnownSides> find_outside(const LeafTable &table, Stage &stage) {
    Joining joining(table, stage);
    std::vector<KnownSides> all(table.leaves.size());
    for (size_t i = 0; i < all.size(); ++i) {
        const BandLeaf &leaf = table.leaves[i];
        for (size_t p = 0; p < leaf.parts.size(); ++p) {
            const bool outside = joining.is_outside(i, p);
            for (int x = 0; x < LEAF; ++x) {
                all[i].known[x] |= leaf.parts[p][x];
                all[i].outside[x] |= outside ? leaf.parts[p][x] : 0;
            }
        }
    }
    return all;
}

// Which of three leaves along an axis holds position 0 … 9 of the halo.
int part_of(int position) {
    return position == 0 ? 0 : position == EDGE - 1 ? 2 : 1;
}

int in_halo(int x, int y, int z) {
    return (x * EDGE + y) * EDGE + z;
}

struct Halo {
    float distance[EDGE * EDGE * EDGE];
    int8_t side[EDGE * EDGE * EDGE]; // 1: outside, -1: inside, 0: unknown, or tried before
};

// The leaf's voxels that belong to a set or have one of their 26 neighbours in it. word_of(leaf, x) gives the
// set.
template <typename Word> Bits touching(const uint32_t *around, const Word &word_of) {
    const auto word = [&](int k, int x) {
        return around[k] == LeafTable::NONE ? uint64_t(0) : word_of(around[k], size_t(x));
    };
    // A plane of the middle one of three leaves along z, joined with neighbours along z.
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

// A triangle near a leaf.
struct Near {
    Corners corner;
    Vec3d normal;
    float low[3], high[3]; // a box around it, from the leaf's origin
};

// Whether the segment from a to b passes through the triangle, or very near to its edges.
bool goes_through(const Near &near, const Vec3d &a, const Vec3d &b) {
    const double from = near.normal.dot(a - near.corner[0]), to = near.normal.dot(b - near.corner[0]);
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

// The triangles near a leaf.
class Nearby {
  public:
    Nearby(const Surface &surface_, const BandLeaf &leaf_) : surface(surface_), leaf(leaf_) {}

    // Whether a triangle is between a voxel and its neighbour.
    bool parts(const Cell &local, const int8_t step[3]) {
        if (near.empty()) {
            fill();
        }
        float low[3], high[3];
        Vec3d from, to;
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t end = local[axis] + step[axis];
            low[axis] = float(std::min(local[axis], end));
            high[axis] = float(std::max(local[axis], end));
            from[axis] = leaf.origin[axis] + local[axis];
            to[axis] = leaf.origin[axis] + end;
        }
        return std::any_of(near.begin(), near.end(), [&](const Near &one) {
            return one.low[0] <= high[0] && one.low[1] <= high[1] && one.low[2] <= high[2] &&
                   one.high[0] >= low[0] && one.high[1] >= low[1] && one.high[2] >= low[2] &&
                   goes_through(one, from, to);
        });
    }

  private:
    void fill() {
        for (const uint32_t triangle : leaf.triangles) {
            Near one{corners_of(surface, triangle), {}, {}, {}};
            one.normal = (one.corner[1] - one.corner[0]).cross(one.corner[2] - one.corner[0]);
            for (int axis = 0; axis < 3; ++axis) {
                const auto ends =
                    std::minmax({one.corner[0][axis], one.corner[1][axis], one.corner[2][axis]});
                one.low[axis] = float(ends.first - leaf.origin[axis] - BOX_MARGIN);
                one.high[axis] = float(ends.second - leaf.origin[axis] + BOX_MARGIN);
            }
            near.push_back(one);
        }
    }

    const Surface &surface;
    const BandLeaf &leaf;
    std::vector<Near> near;
};

// Finds the side of a voxel: that of a neighbour whose free ball overlaps its own, or of a neighbour that no
// triangle separates from it. 0: none.
int side_of(const Halo &halo, const Cell &local, Nearby &nearby) {
    const int at = in_halo(local[0] + 1, local[1] + 1, local[2] + 1);
    const float own = halo.distance[at];
    // First try the neighbour away from the surface.
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
    for (int tried = 0; tried < count; ++tried) { // the farthest from the surface first
        Known26 *const farthest = std::max_element(
            known, known + count, [](const Known26 &a, const Known26 &b) { return a.distance < b.distance; });
        if (!nearby.parts(local, farthest->step)) {
            return farthest->side;
        }
        farthest->distance = -1.0f;
    }
    return 0;
}

class Settling {
  public:
    Settling(const Surface &surface_, const LeafTable &table_, Stage &stage)
        : surface(surface_), table(table_), leaves(table_.leaves), now(find_outside(table, stage)), next(now),
          tried(now.size()) {
        for (const KnownSides &sides : now) {
            well_off.push_back(sides.known);
        }
    }

    // A round finds sides of voxels near the surface from those of their neighbours: settle() for every leaf,
    // on any thread, then end_round().
    void settle(size_t leaf);
    void end_round();
    Sides sides_of(size_t leaf) const; // after the rounds

  private:
    // Known, and not tried in the rounds before.
    uint64_t fresh(uint32_t leaf, size_t x) const { return now[leaf].known[x] & ~tried[leaf][x]; }
    void gather(const uint32_t around[27], Halo &halo) const;

    const Surface &surface;
    const LeafTable &table;
    const std::vector<BandLeaf> &leaves;
    std::vector<KnownSides> now, next;
    std::vector<Bits> tried;    // voxels known since an earlier round: trying them again cannot help
    std::vector<Bits> well_off; // voxels whose sides are known from the start
};

// Voxels near the surface have leaves all around them. Voxels without a leaf are unknown.
void Settling::gather(const uint32_t around[27], Halo &halo) const {
    const auto copy_voxel = [&](uint32_t leaf, int x, int n, int to) {
        const bool is_there = leaf != LeafTable::NONE;
        halo.distance[to] = is_there ? leaves[leaf].distances[64 * x + n] : 0.0f;
        const bool known = is_there && (fresh(leaf, size_t(x)) >> n & 1) != 0;
        halo.side[to] = int8_t(!known ? 0 : (now[leaf].outside[x] >> n & 1) != 0 ? 1 : -1);
    };
    for (int x = 0; x < EDGE; ++x) {
        for (int y = 0; y < EDGE; ++y) {
            const uint32_t *const from = around + 9 * part_of(x) + 3 * part_of(y);
            const int to = in_halo(x, y, 0), inner_x = (x + 7) & 7, row = 8 * ((y + 7) & 7);
            copy_voxel(from[0], inner_x, row + LEAF - 1, to);
            copy_voxel(from[2], inner_x, row, to + EDGE - 1);
            uint64_t sides = 0;
            if (from[1] != LeafTable::NONE) {
                const uint64_t known = fresh(from[1], size_t(inner_x)) >> row & 0xff;
                const uint64_t outside = known & now[from[1]].outside[inner_x] >> row;
                sides = spread(outside) | spread(known & ~outside) * 0xff;
                std::memcpy(halo.distance + to + 1, leaves[from[1]].distances.get() + 64 * inner_x + row,
                            LEAF * sizeof *halo.distance);
            } else {
                std::fill_n(halo.distance + to + 1, LEAF, 0.0f);
            }
            std::memcpy(halo.side + to + 1, &sides, sizeof sides);
        }
    }
}

void Settling::settle(size_t i) {
    next[i] = now[i];
    Bits left;
    for (size_t x = 0; x < LEAF; ++x) {
        left[x] = ~now[i].known[x];
    }
    if (!any(left)) {
        return;
    }
    const uint32_t *const around = table.around(i);
    // skip voxels without a neighbour of known side, and voxels on the surface
    const Bits near_fresh = touching(around, [&](uint32_t leaf, size_t x) { return fresh(leaf, x); });
    for (size_t x = 0; x < LEAF; ++x) {
        left[x] &= near_fresh[x];
        for (uint64_t unknown = left[x]; unknown != 0; unknown &= unknown - 1) {
            const int n = __builtin_ctzll(unknown);
            left[x] ^= uint64_t(leaves[i].distances[64 * x + size_t(n)] < ON) << n;
        }
    }
    if (!any(left)) {
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

void Settling::end_round() {
    for (size_t i = 0; i < now.size(); ++i) {
        tried[i] = now[i].known;
    }
    now.swap(next);
}

Sides Settling::sides_of(size_t i) const {
    Sides sides{now[i].outside, {}};
    Bits near;
    for (size_t x = 0; x < LEAF; ++x) {
        near[x] = ~sides.outside[x] & ~well_off[i][x];
    }
    if (!any(near)) {
        return sides;
    }
    const Bits near_outside =
        touching(table.around(i), [&](uint32_t leaf, size_t x) { return now[leaf].outside[x]; });
    for (size_t x = 0; x < LEAF; ++x) {
        sides.buried[x] = near[x] & ~near_outside[x];
        for (uint64_t left = near[x] & near_outside[x]; left != 0; left &= left - 1) {
            const int n = __builtin_ctzll(left);
            sides.outside[x] |= uint64_t(leaves[i].distances[64 * x + size_t(n)] < ON) << n;
        }
    }
    return sides;
}

} // namespace

std::vector<Sides> find_sides(const Surface &surface, const LeafTable &table, double begin, double end,
                              Stage &stage) {
    Settling settling(surface, table, stage);
    const size_t count = table.leaves.size();
    const double last = begin + 2.0 / 3.0 * (end - begin);
    for (int round = 0; round < ROUNDS; ++round) {
        stage.loop(count, 16, begin, last, [&](size_t i) { settling.settle(i); });
        settling.end_round();
    }
    std::vector<Sides> sides(count);
    stage.loop(count, 16, last, end, [&](size_t i) { sides[i] = settling.sides_of(i); });
    return sides;
}

} // namespace vshi
