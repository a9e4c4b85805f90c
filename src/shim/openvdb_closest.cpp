#include "shim/openvdb_closest.h"

#include <cmath>
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
constexpr int PASSES = 2;
constexpr int HALO = 10; // voxels an edge of a leaf with its neighbours

struct Measure {
    float distance; // voxels, without sign
    Int32 polygon;
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

    // New measures of a leaf's voxels from the old ones of its neighbourhood.
    void measure(const NearestLeaf &leaf, Measure *measures) const;

    FloatGrid &distances;
    openvdb::Int32Grid &nearest;
    const Surface &surface;
    const double per_world;
    const double world;

  private:
    Measure improve(const Measure *at, const Vec3d &p) const;
    const std::vector<Offset> around;
};

Measure Again::improve(const Measure *at, const Vec3d &p) const {
    Int32 tried[27] = {at->polygon};
    int tries = 1;
    Int32 best = at->polygon;
    double least = squared_distance(surface, best, p);
    double length = std::sqrt(least);
    for (const Offset &offset : around) {
        const Measure &there = at[offset.step];
        if (there.polygon == NOTHING || there.distance - offset.length > length ||
            std::find(tried, tried + tries, there.polygon) != tried + tries) {
            continue;
        }
        tried[tries++] = there.polygon;
        const double squared = squared_distance(surface, there.polygon, p);
        if (squared < least || (squared == least && there.polygon < best)) {
            least = squared;
            best = there.polygon;
            length = std::sqrt(least);
        }
    }
    return {float(length), best};
}

void Again::measure(const NearestLeaf &leaf, Measure *measures) const {
    Measure halo[HALO * HALO * HALO];
    openvdb::Int32Grid::ConstUnsafeAccessor polygons(nearest.constTree());
    FloatGrid::ConstUnsafeAccessor values(distances.constTree());
    Measure *fill = halo;
    for (int x = -1; x <= 8; ++x) {
        for (int y = -1; y <= 8; ++y) {
            for (int z = -1; z <= 8; ++z, ++fill) {
                const Coord at = leaf.origin().offsetBy(x, y, z);
                if (!polygons.probeValue(at, fill->polygon)) {
                    fill->polygon = NOTHING;
                } else {
                    fill->distance = float(std::fabs(values.getValue(at)) * per_world);
                }
            }
        }
    }
    for (Index i = 0; i < NearestLeaf::SIZE; ++i) {
        const Coord local = NearestLeaf::offsetToLocalCoord(i);
        const Measure *at = halo + ((local[0] + 1) * HALO + local[1] + 1) * HALO + local[2] + 1;
        measures[i] = *at;
        if (at->polygon != NOTHING && at->distance > MEASURED_WELL) {
            measures[i] = improve(at, (leaf.origin() + local).asVec3d());
        }
    }
}

} // namespace

void measure_again(FloatGrid &distances, openvdb::Int32Grid &nearest, const Surface &surface, double voxel,
                   double begin, double end, Stage &stage) {
    const Again again(distances, nearest, surface, voxel);
    std::vector<NearestLeaf *> leaves;
    nearest.tree().getNodes(leaves);
    std::vector<Measure> measures(leaves.size() * NearestLeaf::SIZE);
    const double step = (end - begin) / PASSES;
    for (int pass = 0; pass < PASSES; ++pass) {
        stage.loop(leaves.size(), 16, begin + pass * step, begin + (pass + 1) * step,
                   [&](size_t i) { again.measure(*leaves[i], measures.data() + i * NearestLeaf::SIZE); });
        stage.loop(leaves.size(), 64, 0.0, 0.0, [&](size_t i) {
            Leaf *values = distances.tree().probeLeaf(leaves[i]->origin());
            for (Index n = 0; values != nullptr && n < NearestLeaf::SIZE; ++n) {
                const Measure &measure = measures[i * NearestLeaf::SIZE + n];
                if (leaves[i]->isValueOn(n)) {
                    leaves[i]->setValueOnly(n, measure.polygon);
                    values->setValueOn(
                        n, std::copysign(float(measure.distance * again.world), values->getValue(n)));
                }
            }
        });
    }
}

} // namespace vshi
