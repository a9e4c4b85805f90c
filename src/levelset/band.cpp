#include "levelset/band.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <map>

namespace vshi {

namespace {

using openvdb::Vec3d;

constexpr int LEAF = 8;
constexpr int REGION = Band::REGION;
constexpr int LEAVES = REGION / LEAF;
// A triangle whose height over its longest edge is less, voxels, counts as that edge: floats cannot resolve
// its inside.
constexpr double FLAT = 2e-4;
// In bands wider than this, voxels, most triangles within reach of a leaf are the nearest of none of its
// voxels.
constexpr double WIDE = 6.0;
// Distance from a leaf's middle to its farthest voxels: in a straight line, rounded up, and along each axis.
constexpr float LEAF_RADIUS = 6.07f;
const Vec3d LEAF_HALF(3.5);
// A triangle between two neighbouring voxels is at most √3 from either.
constexpr double PARTING = 1.74;
// Error of distances to triangles, voxels, whose corners are floats.
constexpr double SLACK = 0.01;

Vec3d any_normal_to(const Vec3d &a) {
    const int least = int(openvdb::math::MinIndex(Vec3d(std::fabs(a[0]), std::fabs(a[1]), std::fabs(a[2]))));
    Vec3d axis(0.0);
    axis[least] = 1.0;
    const Vec3d normal = a.cross(axis);
    return normal.lengthSqr() > 0.0 ? normal / normal.length() : axis;
}

void set_row(float row[4], const Vec3d &direction, double constant) {
    for (int i = 0; i < 3; ++i) {
        row[i] = float(direction[i]);
    }
    row[3] = float(constant);
}

void set_edge(vshi_frame &frame, int e, const Vec3d &from, const Vec3d &along, double length,
              const Vec3d &normal) {
    const Vec3d beside = along.cross(normal);
    const double low = along.dot(from);
    set_row(frame.row[VSHI_FRAME_BESIDE + e], beside, -beside.dot(from));
    set_row(frame.row[VSHI_FRAME_ALONG + e], along, 0.0);
    frame.low[e] = float(low);
    frame.high[e] = float(low + length);
}

// `corner` is relative to the region's middle.
vshi_frame frame_of(const Corners &corner) {
    vshi_frame frame{};
    Corners edge;
    double square[3];
    for (int i = 0; i < 3; ++i) {
        edge[i] = corner[(i + 1) % 3] - corner[i];
        square[i] = edge[i].lengthSqr();
    }
    const int longest = int(std::max_element(square, square + 3) - square);
    const double length = std::sqrt(square[longest]);
    const Vec3d area = edge[0].cross(edge[1]);
    const double twice = area.length();
    const bool flat = !(twice > FLAT * length);
    const Vec3d normal = flat ? any_normal_to(edge[longest]) : area / twice;
    set_row(frame.row[VSHI_FRAME_HEIGHT], normal, -normal.dot(corner[longest]));
    for (int i = 0; i < 3; ++i) {
        const int e = (longest + i) % 3; // the longest first: the inside lies between its ends
        if (flat && i > 0) {             // disable this edge: put it far away
            frame.row[VSHI_FRAME_BESIDE + i][3] = 1.0f;
            frame.low[i] = frame.high[i] = 1e6f;
            continue;
        }
        const double size = std::sqrt(square[e]);
        const Vec3d along = size > 0.0 ? edge[e] / size : any_normal_to(normal);
        set_edge(frame, i, corner[e], along, size, normal);
    }
    return frame;
}

double at(const float row[4], const Vec3d &q) {
    return double(row[0]) * q[0] + double(row[1]) * q[1] + double(row[2]) * q[2] + double(row[3]);
}

// Whether a point of the box around q may be within `reach` of the triangle. May return true if none is.
bool may_reach(const vshi_frame &frame, const Vec3d &q, const Vec3d &half, double reach) {
    const auto extent = [&](const float row[4]) {
        return reach + SLACK + std::fabs(double(row[0])) * half[0] + std::fabs(double(row[1])) * half[1] +
               std::fabs(double(row[2])) * half[2];
    };
    if (std::fabs(at(frame.row[VSHI_FRAME_HEIGHT], q)) > extent(frame.row[VSHI_FRAME_HEIGHT])) {
        return false;
    }
    for (int e = VSHI_FRAME_BESIDE; e < VSHI_FRAME_ALONG; ++e) {
        if (at(frame.row[e], q) > extent(frame.row[e])) {
            return false;
        }
    }
    return true;
}

struct Box {
    Cell first, last; // cells
};

// Cells of `edge` voxels with a voxel's centre within `reach` of the corners' box, moved by `shift` voxels.
// Empty if last < first.
Box cells_of(const Corners &corner, double reach, int edge, double shift = 0.0) {
    Box box{};
    for (int axis = 0; axis < 3; ++axis) {
        const double low = shift + std::min({corner[0][axis], corner[1][axis], corner[2][axis]});
        const double high = shift + std::max({corner[0][axis], corner[1][axis], corner[2][axis]});
        box.first[axis] = int32_t(std::floor(std::ceil(low - reach) / edge));
        box.last[axis] = int32_t(std::floor(std::floor(high + reach) / edge));
    }
    return box;
}

// Calls use(cell) for the cells of the box that the triangle may reach. Halves large boxes.
template <typename Use>
void visit(const vshi_frame &frame, const Vec3d &origin, double reach, int edge, const Box &box,
           const Use &use) {
    Vec3d middle, half;
    int widest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = double(box.first[axis]) * edge, high = double(box.last[axis]) * edge + (edge - 1);
        middle[axis] = 0.5 * (low + high) - origin[axis];
        half[axis] = 0.5 * (high - low);
        widest = half[axis] > half[widest] ? axis : widest;
    }
    if (!may_reach(frame, middle, half, reach)) {
        return;
    }
    if (box.first[widest] >= box.last[widest]) {
        use(box.first);
        return;
    }
    Box lower = box, upper = box;
    lower.last[widest] = box.first[widest] + (box.last[widest] - box.first[widest]) / 2;
    upper.first[widest] = lower.last[widest] + 1;
    visit(frame, origin, reach, edge, lower, use);
    visit(frame, origin, reach, edge, upper, use);
}

Corners moved(const Corners &corner, const Vec3d &origin) {
    return {corner[0] - origin, corner[1] - origin, corner[2] - origin};
}

template <typename Use> void visit_regions(const Corners &corner, double reach, const Use &use) {
    const Box box = cells_of(corner, reach, REGION);
    if (same(box.first, box.last)) {
        use(box.first);
    } else {
        visit(frame_of(moved(corner, corner[0])), corner[0], reach, REGION, box, use);
    }
}

} // namespace

Band::Band(const Surface &surface_, double half_width_, Stage &stage)
    : half_width(half_width_), surface(surface_) {
    std::map<Cell, size_t> numbers;
    Cell last{};
    size_t current = 0;
    for (size_t i = 0; i < surface.polygons.size(); ++i) {
        if (i % 4096 == 0) {
            stage.check();
        }
        for (uint32_t half = 0; half < triangles_of(surface.polygons[i]); ++half) {
            const auto triangle = uint32_t(2 * i + half);
            visit_regions(corners_of(surface, triangle), half_width, [&](const Cell &cell) {
                if (regions.empty() || !same(cell, last)) { // else the previous triangle has added the region
                    const auto found = numbers.emplace(cell, regions.size());
                    if (found.second) {
                        regions.emplace_back();
                        regions.back().origin = {cell[0] * REGION, cell[1] * REGION, cell[2] * REGION};
                    }
                    current = found.first->second;
                    last = cell;
                }
                regions[current].triangles.push_back(triangle);
            });
        }
    }
}

// Measures a region's leaves. Places are relative to the region's middle.
class Band::Measuring {
  public:
    Measuring(const Band &band_, Region &region_, const vshi_leaf_kernel &kernel_)
        : band(band_), region(region_), kernel(kernel_), frames(region.triangles.size()) {
        limits.fill(FLT_MAX);
    }

    void measure(bool sides) {
        frame_triangles();
        if (band.half_width > WIDE) {
            limit_leaves();
        }
        list_triangles();
        for (int leaf = 0; leaf < VSHI_REGION_LEAVES; ++leaf) {
            measure_leaf(leaf, sides);
        }
    }

  private:
    static Cell cell_of(int leaf) {
        return {leaf / (LEAVES * LEAVES), leaf / LEAVES % LEAVES, leaf % LEAVES};
    }
    static Vec3d middle_of(int leaf) {
        const Cell cell = cell_of(leaf);
        return {LEAF * (cell[0] + 0.5) - 0.5 * REGION, LEAF * (cell[1] + 0.5) - 0.5 * REGION,
                LEAF * (cell[2] + 0.5) - 0.5 * REGION};
    }

    void frame_triangles() {
        Vec3d middle;
        for (int axis = 0; axis < 3; ++axis) {
            middle[axis] = double(region.origin[axis]) + 0.5 * (REGION - 1);
        }
        for (size_t i = 0; i < frames.size(); ++i) {
            const Corners corner = moved(corners_of(band.surface, region.triangles[i]), middle);
            frames[i] = frame_of(corner);
            boxes.push_back(cells_of(corner, band.half_width, LEAF, 0.5 * (REGION - 1)));
        }
    }

    // Finds the largest distance of a leaf's middle from a triangle that may be the nearest of one of its
    // voxels.
    void limit_leaves() {
        for (const vshi_frame &frame : frames) {
            float distances[VSHI_REGION_LEAVES];
            kernel.middles(&frame, distances);
            for (int leaf = 0; leaf < VSHI_REGION_LEAVES; ++leaf) {
                limits[leaf] = std::min(limits[leaf], distances[leaf] + 2.0f * LEAF_RADIUS);
            }
        }
    }

    // Sorts the triangles by leaves.
    void list_triangles() {
        for (uint32_t i = 0; i < frames.size(); ++i) {
            float distances[VSHI_REGION_LEAVES] = {};
            if (band.half_width > WIDE) {
                kernel.middles(&frames[i], distances);
            }
            for_each_leaf(boxes[i], [&](int leaf) {
                if (distances[leaf] <= limits[leaf] &&
                    may_reach(frames[i], middle_of(leaf), LEAF_HALF, band.half_width)) {
                    lists[leaf].push_back(i);
                }
            });
        }
    }

    template <typename Use> static void for_each_leaf(const Box &box, const Use &use) {
        for (int32_t x = std::max(box.first[0], 0); x <= std::min(box.last[0], LEAVES - 1); ++x) {
            for (int32_t y = std::max(box.first[1], 0); y <= std::min(box.last[1], LEAVES - 1); ++y) {
                for (int32_t z = std::max(box.first[2], 0); z <= std::min(box.last[2], LEAVES - 1); ++z) {
                    use((x * LEAVES + y) * LEAVES + z);
                }
            }
        }
    }

    void measure_leaf(int number, bool sides) {
        const std::vector<uint32_t> &near = lists[size_t(number)];
        const Vec3d middle = middle_of(number);
        const float place[3] = {float(middle[0]), float(middle[1]), float(middle[2])};
        BandLeaf leaf;
        leaf.distances.reset(near.empty() ? nullptr : new float[VSHI_LEAF_VOXELS]);
        if (near.empty() || !kernel.measure(frames.data(), near.data(), near.size(), place,
                                            float(band.half_width), leaf.distances.get())) {
            return;
        }
        const Cell cell = cell_of(number);
        for (int axis = 0; axis < 3; ++axis) {
            leaf.origin[axis] = region.origin[axis] + LEAF * cell[axis];
        }
        if (sides && add_parts(leaf.distances.get(), leaf.parts)) {
            for (const uint32_t i : near) {
                if (may_reach(frames[i], middle, LEAF_HALF, PARTING)) {
                    leaf.triangles.push_back(region.triangles[i]);
                }
            }
        }
        region.leaves.push_back(std::move(leaf));
    }

    const Band &band;
    Region &region;
    const vshi_leaf_kernel &kernel;
    std::vector<vshi_frame> frames;
    std::vector<Box> boxes;                                      // leaves that each triangle may reach
    std::array<float, VSHI_REGION_LEAVES> limits;                // of limit_leaves(), for wide bands
    std::array<std::vector<uint32_t>, VSHI_REGION_LEAVES> lists; // frames, by leaf
};

void Band::measure(size_t number, bool sides, const vshi_leaf_kernel &kernel) {
    Measuring(*this, regions[number], kernel).measure(sides);
    regions[number].triangles = {};
}

std::vector<BandLeaf> Band::leaves() {
    std::vector<BandLeaf> all;
    for (Region &region : regions) {
        std::move(region.leaves.begin(), region.leaves.end(), std::back_inserter(all));
    }
    std::sort(all.begin(), all.end(),
              [](const BandLeaf &a, const BandLeaf &b) { return a.origin < b.origin; });
    return all;
}

} // namespace vshi
