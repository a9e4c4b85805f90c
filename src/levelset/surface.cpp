// Grids of the distances to surfaces of triangles and quads, and true distances for a grid that has none.
#include "base/job.h"
#include "levelset/band.h"

#include <memory>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

namespace vshi {

namespace {

// The conversion of one surface. The steps' shares of the time were measured at 512 voxels.
class Conversion {
  public:
    Conversion(const Surface &surface_, const Lattice &lattice_, double half_width, double begin_,
               double end_, Stage &stage_)
        : surface(surface_), lattice(lattice_), begin(begin_), end(end_), stage(stage_),
          kernel(*VSHI_KERNEL_OF(vshi_leaf, stage.options.isa)), band(surface, half_width, stage) {}

    FloatGrid::Ptr without_sides() {
        measure(false, 0.8);
        return make_grid();
    }

    FloatGrid::Ptr with_sides() {
        measure(true, 0.5);
        LeafTable table(leaves);
        table.find_neighbours();
        sides = find_sides(surface, table, at(0.5), at(0.8), stage);
        measure_boundary(table);
        const FloatGrid::Ptr grid = make_grid();
        constexpr openvdb::Index above_leaves = 1;
        stage.run([&] { openvdb::tools::signedFloodFill(grid->tree(), true, 1, above_leaves); });
        return grid;
    }

  private:
    double at(double share) const { return begin + share * (end - begin); }

    void measure(bool with_parts, double until) {
        stage.loop(band.region_count(), 1, begin, at(until),
                   [&](size_t i) { band.measure(i, with_parts, kernel); });
        leaves = band.leaves();
    }

    bool has_inside(size_t leaf) const {
        const Bits &outside = sides[leaf].outside;
        return std::any_of(outside.begin(), outside.end(), [](uint64_t word) { return ~word != 0; });
    }

    // Measures the inside to its boundary where other surfaces lie within it.
    void measure_boundary(const LeafTable &table) {
        const std::set<Cell> near = regions_near_buried(table, sides, band.half_width);
        if (near.empty()) {
            return;
        }
        const Surface boundary = boundary_of(surface, table, sides, at(0.8), at(0.85), stage);
        Band bounded(boundary, band.half_width, stage);
        stage.loop(bounded.region_count(), 1, at(0.85), at(0.9), [&](size_t i) {
            if (near.count(bounded.region_origin(i)) != 0) {
                bounded.measure(i, false, kernel);
            }
        });
        const std::vector<BandLeaf> others = bounded.leaves();
        const LeafTable other_table(others);
        stage.loop(leaves.size(), 64, at(0.9), at(0.9), [&](size_t i) {
            const Cell &origin = leaves[i].origin;
            constexpr int32_t mask = ~(Band::REGION - 1);
            if (!has_inside(i) || near.count({origin[0] & mask, origin[1] & mask, origin[2] & mask}) == 0) {
                return;
            }
            const uint32_t other = other_table.find(origin);
            for (int n = 0; n < VSHI_LEAF_VOXELS; ++n) {
                if (!is_outside(i, n)) {
                    leaves[i].distances[n] =
                        other == LeafTable::NONE ? float(band.half_width) : others[other].distances[n];
                }
            }
        });
    }

    bool is_outside(size_t leaf, int voxel) const {
        return (sides[leaf].outside[size_t(voxel >> 6)] >> (voxel & 63) & 1) != 0;
    }

    // A leaf in world units; without sides all voxels are outside.
    std::unique_ptr<Leaf> make_leaf(size_t i, float background) const {
        const BandLeaf &leaf = leaves[i];
        const Coord origin(leaf.origin[0], leaf.origin[1], leaf.origin[2]);
        auto made = std::make_unique<Leaf>(openvdb::PartialCreate(), origin, background);
        made->allocate();
        float *const values = made->buffer().data();
        Leaf::NodeMaskType active;
        for (int n = 0; n < VSHI_LEAF_VOXELS; ++n) {
            const auto value = float(double(leaf.distances[n]) * lattice.voxel);
            active.set(openvdb::Index32(n), value < background);
            values[n] = sides.empty() || is_outside(i, n) ? value : -value;
        }
        made->setValueMask(active);
        return made;
    }

    FloatGrid::Ptr make_grid() {
        const auto background = float(band.half_width * lattice.voxel);
        std::vector<std::unique_ptr<Leaf>> made(leaves.size());
        stage.loop(leaves.size(), 64, at(0.9), end, [&](size_t i) { made[i] = make_leaf(i, background); });
        const FloatGrid::Ptr grid = FloatGrid::create(background);
        for (std::unique_ptr<Leaf> &leaf : made) {
            grid->tree().addLeaf(leaf.release());
        }
        return grid;
    }

    const Surface &surface;
    const Lattice &lattice;
    const double begin, end;
    Stage &stage;
    const vshi_leaf_kernel &kernel;
    Band band;
    std::vector<BandLeaf> leaves;
    std::vector<Sides> sides;
};

} // namespace

FloatGrid::Ptr fill_surface(const Surface &surface, const Lattice &lattice, double half_width, double begin,
                            double end, Stage &stage) {
    return Conversion(surface, lattice, half_width, begin, end, stage).with_sides();
}

FloatGrid::Ptr measure_surface(const Surface &surface, const Lattice &lattice, double half_width,
                               double begin, double end, Stage &stage) {
    return Conversion(surface, lattice, half_width, begin, end, stage).without_sides();
}

// --- re-distancing: the zero surface is meshed, and the mesh's distances get the grid's own signs, so that
// cavities stay (a converter that searches for the inside would fill them). Edges and corners of the mesh are
// restored after Ju, Losasso, Schaefer and Warren, "Dual contouring of Hermite data", 2002: the point of a
// cell minimises the squared distances to the surface's planes at the cell's edges.

namespace {

// Points nearer to the zero than this, voxels, stay. So flat parts, and curved ones of radii from 30 voxels
// on, cost one evaluation a point. With 0.02, an edge that lies so near to a cell's face could lose half a
// voxel.
constexpr double NEAR_ENOUGH = 0.002;
// Step of the gradient's differences, voxels: small, so that edges are hardly ever within it.
constexpr double STEP = 1.0 / 1024;
// Weight of a point's old place, against the planes' mean of 1. After ROUNDS pulls the point is within 1e-4
// of planes at right angles, and stays along directions that no plane restricts.
constexpr double HOLD = 0.01;
constexpr int ROUNDS = 4;
// A point may lie on its cell's faces, and by rounding a little beyond.
constexpr double MARGIN = 1e-3;

struct Planes {
    Vec3d normal[12];
    Vec3d place[12];
    int count = 0;
};

Vec3d gradient(const IndexDistance &distance, const Vec3d &p) {
    Vec3d g(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3d h(0.0);
        h[axis] = STEP;
        g[axis] = distance(p + h) - distance(p - h);
    }
    return g;
}

// Finds the field's zero between a place inside and one outside: first by bisection, because false position
// converges slowly where a second side of an edge is near, and at last by linear interpolation.
Vec3d zero_between(const IndexDistance &distance, Vec3d inside, Vec3d outside) {
    for (int i = 0; i < 10; ++i) {
        const Vec3d middle = 0.5 * (inside + outside);
        (distance(middle) < 0.0 ? inside : outside) = middle;
    }
    const double low = distance(inside);
    const double high = distance(outside);
    return high > low ? inside + (outside - inside) * (low / (low - high)) : outside;
}

Planes planes_of_cell(const IndexDistance &distance, const Vec3d &low) {
    Planes planes;
    bool inside[8];
    const auto corner = [&](int i) { return low + Vec3d(i & 1, i >> 1 & 1, i >> 2 & 1); };
    for (int i = 0; i < 8; ++i) {
        inside[i] = distance(corner(i)) < 0.0;
    }
    for (int i = 0; i < 8; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const int j = i | 1 << axis;
            if (j == i || inside[i] == inside[j]) {
                continue;
            }
            const Vec3d place = zero_between(distance, corner(inside[i] ? i : j), corner(inside[i] ? j : i));
            Vec3d normal = gradient(distance, place);
            if (normal.normalize()) {
                planes.place[planes.count] = place;
                planes.normal[planes.count++] = normal;
            }
        }
    }
    return planes;
}

// Finds the place near `start` that is nearest to the planes; false if there is none.
bool intersect_planes(const Planes &planes, const Vec3d &start, Vec3d &place) {
    openvdb::Mat3d sum = openvdb::Mat3d::identity() * (HOLD * planes.count);
    for (int i = 0; i < planes.count; ++i) {
        const Vec3d &n = planes.normal[i];
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                sum[row][column] += n[row] * n[column];
            }
        }
    }
    const openvdb::Mat3d inverse = sum.inverse();
    place = start;
    for (int round = 0; round < ROUNDS; ++round) {
        Vec3d pull(0.0);
        for (int i = 0; i < planes.count; ++i) {
            pull += planes.normal[i] * planes.normal[i].dot(planes.place[i] - place);
        }
        place += inverse * pull;
    }
    return planes.count > 0 && std::isfinite(place.lengthSqr());
}

// Moves a point of the mesh that is off the zero to where the planes of its cell meet, if that is nearer to
// the zero. Meshing puts each point at the mean of the surface's cuts of its cell's edges. That rounds edges
// and corners off: by up to 1.51 voxels where a cube's corner is a lattice point.
void sharpen_point(openvdb::Vec3s &point, const IndexDistance &distance) {
    const Vec3d at(point);
    const double off = std::fabs(distance(at));
    if (!(off > NEAR_ENOUGH)) {
        return;
    }
    const Vec3d low(std::floor(at[0]), std::floor(at[1]), std::floor(at[2]));
    Vec3d place;
    if (!intersect_planes(planes_of_cell(distance, low), at, place)) {
        return;
    }
    for (int axis = 0; axis < 3; ++axis) {
        place[axis] = std::min(std::max(place[axis], low[axis] - MARGIN), low[axis] + 1.0 + MARGIN);
    }
    if (std::fabs(distance(place)) < off) {
        point = openvdb::Vec3s(place);
    }
}

} // namespace

void check_redistance(const vsh_run &run, const Lattice &lattice, double area, const Vec3d &sides,
                      double source_leaves, double held) {
    const double leaves = band_leaves(area, sides, lattice.half_width);
    check_memory(run, lattice.voxel, leaves,
                 held + source_leaves * SOURCE_BYTES_PER_LEAF + leaves * REDISTANCE_BYTES_PER_LEAF);
}

Surface mesh_surface(const FloatGrid &source, Stage &stage) {
    Surface surface;
    stage.run([&] { openvdb::tools::volumeToMesh(source, surface.points, surface.polygons, 0.0); });
    stage.check();
    return surface;
}

FloatGrid::Ptr redistance(const FloatGrid &source, const IndexDistance &exact, const Lattice &lattice,
                          double begin, double end, Stage &stage) {
    Surface surface = mesh_surface(source, stage);
    stage.reach(begin + 0.2 * (end - begin));
    stage.check();
    if (surface.polygons.empty()) {
        refuse(VSH_ERROR_INPUT, "no surface: the values do not change sign at voxel size %g", lattice.voxel);
    }
    if (exact) {
        stage.loop(surface.points.size(), 1024, begin + 0.2 * (end - begin), begin + 0.3 * (end - begin),
                   [&](size_t i) { sharpen_point(surface.points[i], exact); });
    }
    FloatGrid::Ptr measured =
        measure_surface(surface, lattice, lattice.half_width, begin + 0.3 * (end - begin), end, stage);
    copy_signs(*measured, root_origins(source.constTree()), stage, [&] {
        return [tree = FloatGrid::ConstUnsafeAccessor(source.constTree())](const Coord &at) {
            return tree.getValue(at) < 0.0f;
        };
    });
    return measured;
}

} // namespace vshi
