// Examines grids that others made. Some are called level sets but do not hold distances: filtered, scaled and
// advected ones. Distances change by a voxel's size from voxel to voxel at the surface, and reach the
// background where the band ends.
#include "levelset/file.h"

#include "base/elementary.h"
#include "levelset/surface.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <openvdb/tools/Morphology.h>
#include <vector>

namespace vshi {

namespace {

// Largest deviation of a matrix from a rotation times a scale. Matrices made of 32-bit floats deviate by
// 1e-6; distances are wrong by as much.
constexpr double UNEVEN = 1e-4;
constexpr double SMALLEST_READ = 1e-5;   // voxel size, world units; OpenVDB writes no smaller ones
constexpr double NARROWEST = 3.0 - 1e-3; // half width, voxels; background is a float
constexpr double LEAST_NORM = 0.8, GREATEST_NORM = 1.2; // norm of a distance's gradient on a lattice
constexpr float PLATEAU = 1.0f - 1e-4f; // share of the background: a smaller inactive value is no background
constexpr float BEYOND = 1.0f + 1e-3f;  // share of the background: rounding to half floats adds less
constexpr float CLIFF = 1.5f; // voxels from a voxel to the next at the band's rim; a distance changes by 1
constexpr float JUMP = 2.5f;  // a larger change is damage; sheets thinner than a voxel change by up to 1.9
constexpr int STRIDES[3] = {64, 8, 1}; // places between neighbours in a leaf
constexpr double CLIFF_SHARE = 0.1;    // of the steps at the band's rim; conversions of meshes leave some

Finding finding(Finding::Kind kind, const char *format, ...) __attribute__((format(printf, 2, 3)));

Finding finding(Finding::Kind kind, const char *format, ...) {
    char text[256];
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    return {kind, text};
}

} // namespace

Finding examine_matrix(const Matrix &matrix) {
    Vec3d axes[3];
    double length[3];
    for (int i = 0; i < 3; ++i) {
        axes[i] = axis_of(matrix.data(), i);
        length[i] = axes[i].length();
    }
    if (!std::isfinite(length[0] + length[1] + length[2] + axis_of(matrix.data(), 3).lengthSqr())) {
        return finding(Finding::BAD, "its transform holds values that are not finite");
    }
    const double low = std::min({length[0], length[1], length[2]});
    const double high = std::max({length[0], length[1], length[2]});
    if (!(low >= SMALLEST_READ && high <= LARGEST_VOXEL)) {
        return finding(Finding::BAD, "voxel size %g x %g x %g: expected %g to %g", length[0], length[1],
                       length[2], SMALLEST_READ, LARGEST_VOXEL);
    }
    if (high - low > UNEVEN * high) {
        return finding(Finding::BAD, "voxel size %g x %g x %g: it is scaled unevenly, expected cubes",
                       length[0], length[1], length[2]);
    }
    for (int i = 0; i < 3; ++i) {
        const double cosine = axes[i].dot(axes[(i + 1) % 3]) / (length[i] * length[(i + 1) % 3]);
        if (std::fabs(cosine) > UNEVEN) {
            return finding(Finding::BAD,
                           "it is sheared: its axes %c and %c meet at %.3f degrees, expected 90", "xyz"[i],
                           "xyz"[(i + 1) % 3], vshi_acos(cosine) * (180.0 / M_PI));
        }
    }
    return {};
}

Finding examine_kind(const openvdb::GridBase &grid) {
    if (!grid.isType<FloatGrid>() && !grid.isType<openvdb::DoubleGrid>()) {
        return finding(Finding::BAD, "it is a %s, expected a level set of floats or doubles",
                       grid.type().c_str());
    }
    if (grid.getGridClass() != openvdb::GRID_LEVEL_SET) {
        return finding(Finding::BAD, "its class is '%s', expected 'level set'",
                       openvdb::GridBase::gridClassToString(grid.getGridClass()).c_str());
    }
    if (!grid.transform().isLinear()) {
        return finding(Finding::BAD,
                       "its transform is a %s: only rotated, mirrored, moved and uniformly "
                       "scaled grids can cast shadows",
                       grid.transform().mapType().c_str());
    }
    return examine_matrix(matrix_of(grid.transform()));
}

namespace {

// Counts of one leaf, or of all.
struct Census {
    size_t negative = 0, positive = 0;
    size_t flat = 0, steep = 0, norms = 0; // gradients: too small, too large, and all
    size_t rim = 0, cliffs = 0;            // steps from the band to the background; those above CLIFF
    size_t plateaus = 0;                   // inactive values inside the band
    size_t jumps = 0;                      // between neighbours, too high for distances
    size_t outer = 0;                      // inactive values beyond the background
    openvdb::Index bad = Leaf::SIZE;       // first value that is not finite

    void add(const Census &other) {
        negative += other.negative;
        positive += other.positive;
        flat += other.flat;
        steep += other.steep;
        norms += other.norms;
        rim += other.rim;
        cliffs += other.cliffs;
        plateaus += other.plateaus;
        jumps += other.jumps;
        outer += other.outer;
    }
};

// Two norms of a gradient. `towards` uses differences towards the surface (Godunov's scheme for the Eikonal
// equation, Rouy and Tourin 1992): central differences vanish in the middle of thin sheets. `steepest` uses
// the larger of both differences: across a sheet thinner than two voxels the others are small too.
struct Norms {
    double towards, steepest;
};

Norms find_norms(const float *value, double voxel) {
    const double sign = *value < 0.0f ? -1.0 : 1.0;
    double towards = 0.0, steepest = 0.0;
    for (const int stride : STRIDES) {
        const double back = sign * (double(*value) - double(value[-stride])) / voxel;
        const double ahead = sign * (double(*value) - double(value[stride])) / voxel;
        const double slope = std::max(0.0, std::max(back, ahead));
        const double most = std::max(std::fabs(back), std::fabs(ahead));
        towards += slope * slope;
        steepest += most * most;
    }
    return {std::sqrt(towards), std::sqrt(steepest)};
}

// Whether two neighbours differ more than distances can: by too much, or from deep inside to the outside.
bool is_jump(float a, float b, float background, float voxel) {
    const bool in_a = std::fabs(a) < background, in_b = std::fabs(b) < background;
    if (in_a && in_b) {
        return std::fabs(a - b) > JUMP * voxel;
    }
    // a background means any distance beyond the band
    return std::signbit(a) != std::signbit(b) &&
           ((!in_a && !in_b) || std::fabs(in_a ? a : b) > (JUMP - 1.0f) * voxel);
}

void count_pairs(Census &census, const Leaf &leaf, openvdb::Index i, float background, float voxel) {
    const float *values = leaf.buffer().data();
    for (const openvdb::Index stride : STRIDES) {
        if ((i / stride) % 8 == 7) {
            continue;
        }
        const float a = values[i], b = values[i + stride];
        const bool in_a = std::fabs(a) < background, in_b = std::fabs(b) < background;
        // dense grids have distances beyond the background, as active values
        const bool active = leaf.isValueOn(i) && leaf.isValueOn(i + stride);
        census.jumps += active ? std::fabs(a - b) > JUMP * voxel : is_jump(a, b, background, voxel);
        if (in_a != in_b) {
            const float outer = std::copysign(background, in_a ? b : a);
            ++census.rim;
            census.cliffs += std::fabs(outer - (in_a ? a : b)) > CLIFF * voxel;
        }
    }
}

// Counts jumps across the leaf's faces. Each leaf compares with its next neighbours, and with earlier ones
// that are tiles.
size_t count_jumps_beside(const Leaf &leaf, const FloatTree &tree, float background, float voxel) {
    size_t jumps = 0;
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const bool ahead = side % 2 != 0;
        Coord at = leaf.origin();
        at[axis] += ahead ? 8 : -1;
        const Leaf *beside = tree.probeConstLeaf(at);
        if (beside != nullptr && !ahead) {
            continue; // that leaf compares itself with this one
        }
        const float tile = beside == nullptr ? tree.getValue(at) : 0.0f;
        const openvdb::Index stride = STRIDES[axis], u = STRIDES[(axis + 1) % 3], v = STRIDES[(axis + 2) % 3];
        for (openvdb::Index k = 0; k < 64; ++k) {
            const openvdb::Index first = k / 8 * u + k % 8 * v;
            const float value = leaf.buffer().data()[first + (ahead ? 7 * stride : 0)];
            jumps +=
                is_jump(value, beside != nullptr ? beside->buffer().data()[first] : tile, background, voxel);
        }
    }
    return jumps;
}

Census count_leaf(const Leaf &leaf, float background, float voxel) {
    Census census;
    const float *values = leaf.buffer().data();
    for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
        const float value = values[i];
        if (!std::isfinite(value)) {
            census.bad = i;
            return census;
        }
        census.negative += value < 0.0f;
        census.positive += value > 0.0f;
        census.outer += !leaf.isValueOn(i) && std::fabs(value) > BEYOND * background;
        census.plateaus += !leaf.isValueOn(i) && std::fabs(value) < PLATEAU * background;
        count_pairs(census, leaf, i, background, voxel);
        const Coord at = Leaf::offsetToLocalCoord(i);
        const bool surrounded = std::min({at[0], at[1], at[2]}) > 0 && std::max({at[0], at[1], at[2]}) < 7;
        if (surrounded && std::fabs(value) < voxel) {
            const Norms norms = find_norms(values + i, double(voxel));
            ++census.norms;
            census.flat += norms.steepest < LEAST_NORM;
            census.steep += norms.towards > GREATEST_NORM;
        }
    }
    return census;
}

// Whether the outermost voxels are all inside: beyond them there is nothing, so the signs are exchanged.
bool is_inverted(const std::vector<const Leaf *> &leaves) {
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2;
        const bool upper = side % 2 != 0;
        const Leaf *last = *std::max_element(leaves.begin(), leaves.end(), [&](const Leaf *a, const Leaf *b) {
            return upper ? a->origin()[axis] < b->origin()[axis] : a->origin()[axis] > b->origin()[axis];
        });
        for (int u = 0; u < 8; ++u) {
            for (int v = 0; v < 8; ++v) {
                Coord at;
                at[axis] = upper ? 7 : 0;
                at[(axis + 1) % 3] = u;
                at[(axis + 2) % 3] = v;
                if (!(last->getValue(Leaf::coordToOffset(at)) < 0.0f)) {
                    return false;
                }
            }
        }
    }
    return true;
}

// Tiles hold no surface, so they must be far from one.
Finding examine_tiles(const FloatTree &tree, float background) {
    FloatTree::ValueAllCIter tile(tree);
    tile.setMaxDepth(FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
    Finding result;
    for (; tile; ++tile) {
        const Coord at = tile.getCoord();
        const float value = tile.getValue();
        if (!std::isfinite(value)) {
            return finding(Finding::BAD, "value %g from voxel (%d, %d, %d) on: expected finite values",
                           double(value), at[0], at[1], at[2]);
        }
        if (std::fabs(value) < PLATEAU * background) {
            if (tile.isValueOn()) {
                return finding(Finding::BAD,
                               "the same value %g in all voxels of a tile from (%d, %d, %d) on: "
                               "no distances",
                               double(value), at[0], at[1], at[2]);
            }
            if (result.kind == Finding::FINE) {
                result = finding(Finding::ODD, "value %g beyond the band, where the background is %g",
                                 double(value), double(background));
            }
        }
    }
    return result;
}

} // namespace

Finding examine_values(const FloatGrid &grid, double voxel, Stage &stage) {
    const float background = grid.background();
    if (!std::isfinite(background) || background < 0.0f) {
        return finding(Finding::BAD, "background %g: outside must be positive", double(background));
    }
    std::vector<const Leaf *> leaves;
    grid.tree().getNodes(leaves);
    if (leaves.empty()) {
        return finding(Finding::BAD, "it holds no surface: it is empty");
    }
    for (const Leaf *leaf : leaves) {
        const Coord at = leaf->origin();
        if (std::min({at[0], at[1], at[2]}) < -LARGEST_INDEX ||
            std::max({at[0], at[1], at[2]}) > LARGEST_INDEX) {
            return finding(Finding::BAD, "voxel (%d, %d, %d): indices may go to %d", at[0], at[1], at[2],
                           LARGEST_INDEX);
        }
    }
    std::vector<Census> each(leaves.size());
    stage.loop(leaves.size(), 64, 0.3, 0.5, [&](size_t i) {
        each[i] = count_leaf(*leaves[i], background, float(voxel));
        each[i].jumps += count_jumps_beside(*leaves[i], grid.tree(), background, float(voxel));
    });
    Census all;
    for (size_t i = 0; i < each.size(); ++i) {
        if (each[i].bad < Leaf::SIZE) {
            const Coord at = leaves[i]->offsetToGlobalCoord(each[i].bad);
            return finding(Finding::BAD, "value %g at voxel (%d, %d, %d): expected finite values",
                           double(leaves[i]->getValue(each[i].bad)), at[0], at[1], at[2]);
        }
        all.add(each[i]);
    }
    if (all.negative == 0 || all.positive == 0) {
        return finding(Finding::BAD, "it holds no surface: no value is %s 0",
                       all.negative == 0 ? "below" : "above");
    }
    if (is_inverted(leaves)) {
        return finding(Finding::BAD, "outside is negative: the signs are exchanged, or it has no outside");
    }
    const Finding tiles = examine_tiles(grid.tree(), background);
    if (tiles.kind != Finding::FINE) {
        return tiles;
    }
    if (double(background) < NARROWEST * voxel) {
        return finding(Finding::ODD, "its band has a half width of %.3g voxels, 3 at least are needed",
                       double(background) / voxel);
    }
    if (2 * all.flat > all.norms || 2 * all.steep > all.norms) {
        return finding(Finding::ODD, "its values are no distances: they change too %s at the surface",
                       2 * all.flat > all.norms ? "slowly" : "fast");
    }
    if (all.plateaus > 0) {
        return finding(Finding::ODD, "%zu inactive voxels are no background", all.plateaus);
    }
    if (double(all.cliffs) > CLIFF_SHARE * double(all.rim)) {
        return finding(Finding::ODD, "its values end before they reach the background %g",
                       double(background));
    }
    if (all.jumps > 0) {
        return finding(Finding::NOTED,
                       "damaged? %zu times its values jump by more than %g voxels from a voxel to the next",
                       all.jumps, double(JUMP));
    }
    if (all.outer > 0) {
        return finding(Finding::NOTED, "damaged? %zu inactive values are beyond the background %g", all.outer,
                       double(background));
    }
    return {};
}

namespace {

// Area of a surface, voxel², for each voxel that has a neighbour on the other side: a plane of normal n has
// 2 max |n_i| such voxels a voxel², 1.66 over all directions.
constexpr double AREA_PER_VOXEL = 0.6;

constexpr double COPIES = 6.0; // of far inner nodes that exist at a time

// True distances for an ODD grid: the same surface and signs, and a band of 3 voxels or more. Its errors do
// not name the file.
FloatGrid::Ptr compute_distances(const FloatGrid &grid, double voxel, Stage &stage) {
    const double half_width = std::clamp(std::round(double(grid.background()) / voxel), 3.0, 100.0);
    const Lattice lattice{voxel, half_width, 0.0, Vec3d(0.0)};
    const double count = double(grid.tree().leafCount());
    check_memory(stage.options, voxel, count,
                 2.0 * count * BYTES_PER_LEAF + COPIES * far_node_bytes(double(grid.memUsage()), count));

    // Meshing uses active voxels only: those of all cells that hold both signs.
    const FloatGrid::Ptr source = grid.deepCopy();
    std::vector<Leaf *> leaves;
    source->tree().getNodes(leaves);
    std::atomic<size_t> crossings{0}; // voxels next to the surface
    stage.loop(leaves.size(), 64, 0.5, 0.6, [&](size_t i) {
        FloatGrid::ConstUnsafeAccessor values(grid.constTree());
        size_t found = 0;
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            const Coord at = leaves[i]->offsetToGlobalCoord(n);
            const bool inside = leaves[i]->getValue(n) < 0.0f;
            bool crossed = false;
            for (int side = 0; side < 6 && !crossed; ++side) {
                Coord beside = at;
                beside[side / 2] += side % 2 != 0 ? 1 : -1;
                crossed = (values.getValue(beside) < 0.0f) != inside;
            }
            leaves[i]->setActiveState(n, crossed);
            found += crossed;
        }
        crossings += found;
    });
    check_redistance(stage.options, lattice, AREA_PER_VOXEL * double(crossings.load()),
                     source->evalActiveVoxelDim().asVec3d(), count, count * BYTES_PER_LEAF);
    stage.run([&] {
        openvdb::tools::dilateActiveValues(source->tree(), 1, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                           openvdb::tools::PRESERVE_TILES);
    });
    return redistance(*source, {}, lattice, 0.6, 1.0, stage);
}

} // namespace

void refuse_bad(const GridName &name, const Finding &finding) {
    if (finding.kind == Finding::BAD) {
        refuse(VSH_ERROR_INPUT, "%s cannot cast shadows: %s", name.text().c_str(), finding.text.c_str());
    }
}

vsh_grid *close_level_set(LevelSet &set, Stage &stage) {
    const std::string name = set.name.text();
    stage.check();
    check_bytes(stage.options, double(set.grid->memUsage()), name.c_str());
    const double voxel = axis_of(set.matrix.data(), 0).length();
    const Finding finding = examine_values(*set.grid, voxel, stage);
    refuse_bad(set.name, finding);
    if (finding.kind == Finding::NOTED) {
        vshi_warn(&stage.options, "%s: %s", name.c_str(), finding.text.c_str());
    }
    if (finding.kind == Finding::ODD) {
        vshi_warn(&stage.options, "%s: %s: its distances were made anew", name.c_str(), finding.text.c_str());
        try {
            set.grid = compute_distances(*set.grid, voxel, stage);
        } catch (const Failure &failure) {
            if (failure.error.code != VSH_ERROR_CANCELLED) {
                refuse(failure.error.code, "%s: %.700s", name.c_str(), failure.error.message);
            }
            throw;
        }
    }
    return close_grid(set.grid, set.matrix, set.shell, stage);
}

} // namespace vshi
