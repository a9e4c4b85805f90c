#include "levelset/closest.h"

#include <cmath>
#include <cstdint>
#include <openvdb/math/Proximity.h>
#include <openvdb/util/Util.h>

namespace vshi {

namespace {

using NearestLeaf = openvdb::Int32Tree::LeafNodeType;
using openvdb::Index;
using openvdb::Int32;

// Voxels nearer than this (voxels) were measured against every polygon that passes them, and those that the
// conversion pushed off a surface inside the solid stand at √0.75: both stay.
constexpr double MEASURED_WELL = 0.87;
const Int32 NOTHING = Int32(openvdb::util::INVALID_IDX);
// Marks a polygon that is new since the last pass: only those need to be tried by the neighbours.
constexpr Int32 IS_NEW = INT32_MIN;
constexpr int PASSES = 2;
constexpr int HALO = 10; // voxels an edge of a leaf with its neighbours

struct Measure {
    float distance; // voxels, without sign
    Int32 polygon;
};

struct Neighbour : Measure {
    bool tempting; // worth trying: its polygon is new to those around it
};

double squared_distance(const Surface &surface, Int32 polygon, const Vec3d &p) {
    const openvdb::Vec4I &corners = surface.polygons[size_t(polygon)];
    const Vec3d a(surface.points[corners[0]]), b(surface.points[corners[1]]), c(surface.points[corners[2]]);
    Vec3d uvw;
    double squared = (p - openvdb::math::closestPointOnTriangleToPoint(a, c, b, p, uvw)).lengthSqr();
    if (corners[3] != openvdb::util::INVALID_IDX) {
        const Vec3d d(surface.points[corners[3]]);
        squared = std::min(squared,
                           (p - openvdb::math::closestPointOnTriangleToPoint(a, d, c, p, uvw)).lengthSqr());
    }
    return squared;
}

struct Offset {
    int step; // in the halo
    float length;
};

// The 26 neighbours, nearest first.
std::vector<Offset> neighbours() {
    std::vector<Offset> all;
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                if (x != 0 || y != 0 || z != 0) {
                    all.push_back({(x * HALO + y) * HALO + z, float(std::sqrt(x * x + y * y + z * z))});
                }
            }
        }
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Offset &a, const Offset &b) { return a.length < b.length; });
    return all;
}

class Again {
  public:
    Again(FloatGrid &distances_, openvdb::Int32Grid &nearest_, const Surface &surface_, double voxel)
        : distances(distances_), nearest(nearest_), surface(surface_), per_world(1.0 / voxel), world(voxel),
          around(neighbours()) {}

    // New measures of a leaf's voxels from the old ones of its neighbourhood. False where there is nothing to
    // be gained: then they are not filled.
    bool measure(const NearestLeaf &leaf, bool first, Measure *measures) const;

    FloatGrid &distances;
    openvdb::Int32Grid &nearest;
    const Surface &surface;
    const double per_world;
    const double world;

  private:
    bool gather(const NearestLeaf &leaf, bool first, Neighbour *halo) const;
    Measure improve(const Neighbour *at, bool first, const Vec3d &p) const;
    const std::vector<Offset> around;
};

Measure Again::improve(const Neighbour *at, bool first, const Vec3d &p) const {
    Int32 tried[27] = {at->polygon};
    int tries = 1;
    Int32 best = at->polygon;
    // At first the value may belong to a part of its polygon only: large ones are converted in pieces.
    double least = first ? squared_distance(surface, best, p) : -1.0; // negative: not measured yet
    double length = first ? std::sqrt(least) : double(at->distance);
    for (const Offset &offset : around) {
        const Neighbour &there = at[offset.step];
        if (!there.tempting || double(there.distance) - double(offset.length) > length ||
            std::find(tried, tried + tries, there.polygon) != tried + tries) {
            continue;
        }
        tried[tries++] = there.polygon;
        if (least < 0.0) {
            least = squared_distance(surface, best, p);
        }
        const double squared = squared_distance(surface, there.polygon, p);
        if (squared < least || (squared == least && there.polygon < best)) {
            least = squared;
            best = there.polygon;
            length = std::sqrt(least);
        }
    }
    return {float(length), best != at->polygon ? best | IS_NEW : best};
}

// Part -1, 0 or 1 of the neighbourhood along an axis that position 0 … 9 of the halo lies in.
int part_of(int position) {
    return position == 0 ? 0 : position == HALO - 1 ? 2 : 1;
}

// Fills the halo; false where no voxel has a neighbour whose polygon it should try.
bool Again::gather(const NearestLeaf &leaf, bool first, Neighbour *halo) const {
    const NearestLeaf *polygons[27];
    const Leaf *values[27];
    openvdb::Int32Grid::ConstUnsafeAccessor find_polygons(nearest.constTree());
    FloatGrid::ConstUnsafeAccessor find_values(distances.constTree());
    for (int i = 0; i < 27; ++i) {
        const Coord origin = leaf.origin().offsetBy(8 * (i / 9 - 1), 8 * (i / 3 % 3 - 1), 8 * (i % 3 - 1));
        polygons[i] = find_polygons.probeConstLeaf(origin);
        values[i] = polygons[i] != nullptr ? find_values.probeConstLeaf(origin) : nullptr;
    }
    bool tempting = false;
    Int32 only = NOTHING;
    bool many = false;
    for (int x = 0; x < HALO; ++x) {
        for (int y = 0; y < HALO; ++y) {
            const int row = 9 * part_of(x) + 3 * part_of(y);
            for (int z = 0; z < HALO; ++z, ++halo) {
                *halo = {{0.0f, NOTHING}, false};
                const int from = row + part_of(z);
                const auto at = Index(((x + 7) & 7) << 6 | ((y + 7) & 7) << 3 | ((z + 7) & 7));
                if (values[from] == nullptr || !polygons[from]->isValueOn(at)) {
                    continue;
                }
                const Int32 polygon = polygons[from]->getValue(at);
                const bool is_new = first || (polygon & IS_NEW) != 0;
                const double distance = std::fabs(double(values[from]->getValue(at)));
                *halo = {{float(distance * per_world), polygon & ~IS_NEW}, is_new};
                tempting |= is_new;
                many |= only != NOTHING && only != halo->polygon;
                only = halo->polygon;
            }
        }
    }
    return first || (tempting && many);
}

bool Again::measure(const NearestLeaf &leaf, bool first, Measure *measures) const {
    Neighbour halo[HALO * HALO * HALO];
    if (!gather(leaf, first, halo)) {
        return false;
    }
    for (Index i = 0; i < NearestLeaf::SIZE; ++i) {
        const Coord local = NearestLeaf::offsetToLocalCoord(i);
        const Neighbour *at = halo + ((local[0] + 1) * HALO + local[1] + 1) * HALO + local[2] + 1;
        measures[i] = *at;
        if (at->polygon != NOTHING && at->distance > MEASURED_WELL) {
            measures[i] = improve(at, first, (leaf.origin() + local).asVec3d());
        }
    }
    return true;
}

} // namespace

void measure_again(FloatGrid &distances, openvdb::Int32Grid &nearest, const Surface &surface, double voxel,
                   double begin, double end, Stage &stage) {
    const Again again(distances, nearest, surface, voxel);
    std::vector<NearestLeaf *> leaves;
    nearest.tree().getNodes(leaves);
    std::vector<Measure> measures(leaves.size() * NearestLeaf::SIZE);
    std::vector<char> changed(leaves.size());
    const double step = (end - begin) / PASSES;
    for (int pass = 0; pass < PASSES; ++pass) {
        stage.loop(leaves.size(), 16, begin + pass * step, begin + (pass + 1) * step, [&](size_t i) {
            changed[i] = again.measure(*leaves[i], pass == 0, measures.data() + i * NearestLeaf::SIZE);
        });
        stage.loop(leaves.size(), 64, 0.0, 0.0, [&](size_t i) {
            Leaf *values = distances.tree().probeLeaf(leaves[i]->origin());
            for (Index n = 0; values != nullptr && n < NearestLeaf::SIZE; ++n) {
                const Measure &measure = measures[i * NearestLeaf::SIZE + n];
                if (changed[i] && leaves[i]->isValueOn(n)) {
                    leaves[i]->setValueOnly(n, measure.polygon);
                    values->setValueOn(
                        n, std::copysign(float(double(measure.distance) * again.world), values->getValue(n)));
                }
            }
        });
    }
}

} // namespace vshi
