#include "levelset/flood.h"

#include <algorithm>

namespace vshi {

namespace {

constexpr int LEAF = 8;
constexpr uint32_t EXTERIOR = 0;

// Voxels of `within` that hang together with the seed.
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
    for (int x = 0; x < LEAF; ++x) {
        uint8_t well_off[64];
        for (int i = 0; i < 64; ++i) {
            well_off[i] = distances[64 * x + i] > WELL_OFF;
        }
        left[x] = pack_plane(well_off);
    }
    bool others = false;
    for (const uint64_t word : left) {
        others |= ~word != 0;
    }
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

// Where the search for a leaf begins in the table.
static size_t hash(const Cell &origin) {
    uint64_t h = uint64_t(uint32_t(origin[0])) * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 32 ^ uint32_t(origin[1])) * 0xc2b2ae3d27d4eb4fu;
    h = (h ^ h >> 32 ^ uint32_t(origin[2])) * 0x165667b19e3779f9u;
    return size_t(h ^ h >> 32);
}

LeafTable::LeafTable(const std::vector<BandLeaf> &leaves_) : leaves(leaves_) {
    size_t size = 16;
    while (size < 2 * leaves.size()) {
        size *= 2;
    }
    table.assign(size, NONE);
    for (size_t i = 0; i < leaves.size(); ++i) {
        size_t at = hash(leaves[i].origin) & (size - 1);
        while (table[at] != NONE) {
            at = (at + 1) & (size - 1);
        }
        table[at] = uint32_t(i);
    }
}

uint32_t LeafTable::find(const Cell &origin) const {
    size_t at = hash(origin) & (table.size() - 1);
    while (table[at] != NONE && !same(leaves[table[at]].origin, origin)) {
        at = (at + 1) & (table.size() - 1);
    }
    return table[at];
}

void LeafTable::find_neighbours() {
    std::array<uint32_t, 27> none;
    none.fill(NONE);
    neighbours.assign(leaves.size(), none);
    size_t next[13] = {}; // of each offset: as leaves follow each other, so do those beside them
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

// Sets of parts of leaves, of runs of empty leaves and of the exterior that hang together.
class Joining {
  public:
    Joining(const LeafTable &table, Stage &stage);
    bool is_outside(size_t leaf, size_t part) { return root(first_part[leaf] + part) == EXTERIOR; }

  private:
    size_t root(size_t node);
    void unite(size_t a, size_t b);
    size_t lower_bound(const Cell &place) const;
    size_t run_below(size_t leaf) const;
    size_t run_at(const Cell &place) const;
    void join_run(size_t leaf);
    void join_face(size_t leaf, int axis, bool last);

    const LeafTable &table;
    const std::vector<BandLeaf> &leaves;
    std::vector<size_t> first_part; // nodes: EXTERIOR, the runs below leaves, the parts of leaves
    std::vector<uint32_t> parent;
};

Joining::Joining(const LeafTable &table_, Stage &stage) : table(table_), leaves(table.leaves) {
    size_t node = 1 + leaves.size();
    for (const BandLeaf &leaf : leaves) {
        first_part.push_back(node);
        node += leaf.part_count;
    }
    parent.resize(node);
    for (size_t i = 0; i < node; ++i) {
        parent[i] = uint32_t(i);
    }
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

size_t Joining::root(size_t node) {
    while (parent[node] != node) {
        parent[node] = parent[parent[node]];
        node = parent[node];
    }
    return node;
}

// The exterior is the least of all nodes, and stays a root.
void Joining::unite(size_t a, size_t b) {
    a = root(a);
    b = root(b);
    parent[std::max(a, b)] = uint32_t(std::min(a, b));
}

static bool same_column(const Cell &a, const Cell &b) {
    return a[0] == b[0] && a[1] == b[1];
}

// The first leaf that is not before this place.
size_t Joining::lower_bound(const Cell &place) const {
    const auto before = [](const BandLeaf &leaf, const Cell &at) { return leaf.origin < at; };
    return size_t(std::lower_bound(leaves.begin(), leaves.end(), place, before) - leaves.begin());
}

// The run of empty leaves that ends below leaf i, which may not be there; one that begins at infinity is the
// exterior.
size_t Joining::run_below(size_t i) const {
    return i > 0 && same_column(leaves[i - 1].origin, leaves[i].origin) ? 1 + i : EXTERIOR;
}

// The run that a place without a leaf lies in.
size_t Joining::run_at(const Cell &place) const {
    const size_t above = lower_bound(place);
    return above < leaves.size() && same_column(leaves[above].origin, place) ? run_below(above) : EXTERIOR;
}

// Joins the run below leaf i with those beside it.
void Joining::join_run(size_t i) {
    const int32_t low = leaves[i - 1].origin[2] + LEAF, high = leaves[i].origin[2];
    for (int side = 0; side < 4; ++side) {
        Cell at{leaves[i].origin[0], leaves[i].origin[1], low};
        at[side / 2] += side % 2 == 0 ? LEAF : -LEAF;
        for (size_t above = lower_bound(at); at[2] < high; ++above) {
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

// Joins the parts of leaf i with what is beyond one of its faces.
void Joining::join_face(size_t i, int axis, bool last) {
    Cell beyond = leaves[i].origin;
    beyond[axis] += last ? LEAF : -LEAF;
    constexpr int stride[3] = {9, 3, 1};
    const uint32_t neighbour = table.around(i)[13 + (last ? stride[axis] : -stride[axis])];
    if (neighbour != LeafTable::NONE && !last) {
        return; // it does that itself
    }
    const size_t run = neighbour == LeafTable::NONE ? run_at(beyond) : EXTERIOR;
    for (size_t p = 0; p < leaves[i].part_count; ++p) {
        const uint64_t own = face(leaves[i].parts[p], axis, last);
        if (own != 0 && neighbour == LeafTable::NONE) {
            unite(first_part[i] + p, run);
            continue;
        }
        for (size_t q = 0; own != 0 && q < leaves[neighbour].part_count; ++q) {
            if ((own & face(leaves[neighbour].parts[q], axis, false)) != 0) {
                unite(first_part[i] + p, first_part[neighbour] + q);
            }
        }
    }
}

} // namespace

std::vector<KnownSides> find_outside(const LeafTable &table, Stage &stage) {
    Joining joining(table, stage);
    std::vector<KnownSides> all(table.leaves.size());
    for (size_t i = 0; i < all.size(); ++i) {
        const BandLeaf &leaf = table.leaves[i];
        for (size_t p = 0; p < leaf.part_count; ++p) {
            const bool outside = joining.is_outside(i, p);
            for (int x = 0; x < LEAF; ++x) {
                all[i].known[x] |= leaf.parts[p][x];
                all[i].outside[x] |= outside ? leaf.parts[p][x] : 0;
            }
        }
    }
    return all;
}

} // namespace vshi
