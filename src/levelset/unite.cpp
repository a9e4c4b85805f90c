// The union of grids. Grids on the new lattice are shifted by whole voxels; others are meshed, moved and
// measured again. Then each voxel gets the least value of all.
#include "base/vec.h"
#include "levelset/surface.h"

#include <cmath>
#include <limits>
#include <openvdb/tools/Interpolation.h>
#include <set>

namespace vshi {

namespace {

// Sizes of voxels that differ by less than this share are equal: at any index, the difference moves a voxel
// by less than its size.
constexpr double SAME_SIZE = 1e-9;
constexpr double SAME_PLACE = 1e-3; // voxels by which an instance may be off the lattice
constexpr double UNEVEN = 1e-6;     // of an instance's axes, relative

struct Placed {
    const vsh_grid *grid;
    double transform[12]; // from the grid's index space to the world: rows of four
    double scale;         // of the instance
    double voxel;         // world units
};

// A level set whose voxel `index - shift` is the union's voxel `index`.
struct Part {
    FloatGrid::ConstPtr grid;
    Coord shift;
};

constexpr double IDENTITY[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

Placed place(const vsh_grid_instance &instance, size_t number) {
    if (instance.grid == nullptr) {
        refuse(VSH_ERROR_ARGUMENT, "unite: instance %zu has no grid", number);
    }
    const double *m = instance.transform != nullptr ? instance.transform : IDENTITY;
    const Vec3d axis[3] = {axis_of(m, 0), axis_of(m, 1), axis_of(m, 2)};
    const double scale = axis[0].length();
    bool even = scale > 0.0 && std::isfinite(scale) && Vec3d(m[3], m[7], m[11]).isFinite();
    for (int i = 0; i < 3; ++i) {
        even = even && std::fabs(axis[i].length() - scale) <= UNEVEN * scale &&
               std::fabs(axis[i].dot(axis[(i + 1) % 3])) <= UNEVEN * scale * scale;
    }
    if (!even) {
        refuse(VSH_ERROR_ARGUMENT,
               "unite: instance %zu: axes of length %g, %g, %g: expected a rotation, mirroring and one scale",
               number, axis[0].length(), axis[1].length(), axis[2].length());
    }
    Placed placed{instance.grid, {}, scale, scale * instance.grid->info.voxel_size};
    const double *g = instance.grid->info.transform;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            placed.transform[4 * row + column] = m[4 * row] * g[column] + m[4 * row + 1] * g[4 + column] +
                                                 m[4 * row + 2] * g[8 + column] +
                                                 (column == 3 ? m[4 * row + 3] : 0.0);
        }
    }
    return placed;
}

// Applies the inverse of a rotation times the voxel size: its transpose over the square.
Vec3d apply_back(const Placed &placed, const Vec3d &world) {
    const double *m = placed.transform;
    const Vec3d p = (world - Vec3d(m[3], m[7], m[11])) / (placed.voxel * placed.voxel);
    return Vec3d(m[0] * p[0] + m[4] * p[1] + m[8] * p[2], m[1] * p[0] + m[5] * p[1] + m[9] * p[2],
                 m[2] * p[0] + m[6] * p[1] + m[10] * p[2]);
}

bool is_upright(const Placed &placed, double voxel) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            const double expected = row == column ? voxel : 0.0;
            if (std::fabs(placed.transform[4 * row + column] - expected) > SAME_SIZE * voxel) {
                return false;
            }
        }
    }
    return true;
}

// Whether the instance's voxels are voxels of the lattice, shifted by `shift`, and its band is wide enough.
bool lies_on(const Placed &placed, const Lattice &lattice, Coord &shift) {
    if (!is_upright(placed, lattice.voxel) ||
        placed.grid->info.half_width < lattice.half_width * (1.0 - 1e-5)) {
        return false;
    }
    const Vec3d offset =
        (Vec3d(placed.transform[3], placed.transform[7], placed.transform[11]) - lattice.translation) /
        lattice.voxel;
    for (int i = 0; i < 3; ++i) {
        if (std::fabs(offset[i] - std::round(offset[i])) > SAME_PLACE ||
            std::fabs(offset[i]) > double(LARGEST_INDEX)) {
            return false;
        }
        shift[i] = int32_t(std::round(offset[i]));
    }
    return true;
}

// Adds the corners of an instance's band, in the world.
void grow_bounds(const Placed &placed, Vec3d &low, Vec3d &high) {
    const openvdb::CoordBBox box = placed.grid->level_set->evalActiveVoxelBoundingBox();
    const Vec3d from = box.min().asVec3d(), to = box.max().asVec3d();
    vshi_grow_box_by(low.asPointer(), high.asPointer(), placed.transform, from.asPointer(), to.asPointer());
}

// The lattice of the union: that of the first upright instance with the union's voxel size, so that at least
// this one needs no resampling.
Lattice choose_lattice(const std::vector<Placed> &placed, const vsh_grid_options *given) {
    vsh_grid_options options = vsh_grid_options_default();
    require(vshi_options_resolve, given, &options, sizeof options, "vsh_grid_options");
    Vec3d low(std::numeric_limits<double>::max());
    Vec3d high(-low);
    double finest = placed[0].voxel;
    for (const Placed &instance : placed) {
        finest = std::min(finest, instance.voxel);
        grow_bounds(instance, low, high);
    }
    if (options.voxel_size == 0.0) {
        options.voxel_size = finest;
    }
    Lattice lattice = make_lattice(&options, low, high);
    for (const Placed &instance : placed) {
        const Vec3d origin(instance.transform[3], instance.transform[7], instance.transform[11]);
        double farthest = 0.0;
        for (int i = 0; i < 3; ++i) {
            farthest = std::max({farthest, std::fabs(low[i] - origin[i]), std::fabs(high[i] - origin[i])});
        }
        if (is_upright(instance, lattice.voxel) &&
            farthest / lattice.voxel + lattice.half_width < double(LARGEST_INDEX)) {
            lattice.voxel = instance.voxel;
            lattice.translation = origin;
            break;
        }
    }
    return lattice;
}

constexpr double COPIES = 5.0; // of far inner nodes that exist at a time, beside the instance's own

void check_union(const std::vector<Placed> &placed, const Lattice &lattice, const vsh_run &run) {
    double leaves = 0.0, bytes = 0.0;
    for (const Placed &instance : placed) {
        const double finer = instance.voxel / lattice.voxel;
        const double count = double(instance.grid->level_set->tree().leafCount());
        // the inverse of band_leaves() for a thin band
        const double area = count * double(Leaf::SIZE) / (2.0 * instance.grid->info.half_width + 12.0);
        const Vec3d sides = instance.grid->level_set->evalActiveVoxelDim().asVec3d();
        leaves += band_leaves(area * finer * finer, sides * finer, lattice.half_width);
        const double held = double(instance.grid->info.bytes);
        bytes += held + count * SOURCE_BYTES_PER_LEAF + COPIES * far_node_bytes(held, count);
    }
    check_memory(run, lattice.voxel, leaves, bytes + leaves * REDISTANCE_BYTES_PER_LEAF);
}

// Measures an instance on the lattice. Signs come from its own values, by interpolation.
FloatGrid::Ptr resample(const Placed &placed, size_t number, const Lattice &lattice, double begin, double end,
                        Stage &stage) {
    Surface surface = mesh_surface(*placed.grid->level_set, stage);
    if (surface.polygons.empty()) {
        refuse(VSH_ERROR_INPUT, "unite: instance %zu: the grid has no surface", number);
    }
    stage.loop(surface.points.size(), 4096, begin, begin, [&](size_t i) {
        const Vec3d point(surface.points[i]);
        surface.points[i] = openvdb::Vec3s(lattice.index(apply(placed.transform, point)));
    });
    FloatGrid::Ptr measured = measure_surface(surface, lattice, lattice.half_width, begin, end, stage);

    // Upper nodes of the lattice that the instance's inside may cover without a surface.
    std::vector<Coord> origins;
    visit_blocks(measured->evalActiveVoxelBoundingBox(), UPPER_SIZE,
                 [&](const Coord &origin) { origins.push_back(origin); });
    copy_signs(*measured, origins, stage, [&] {
        return
            [&, tree = FloatGrid::ConstUnsafeAccessor(placed.grid->level_set->constTree())](const Coord &at) {
                const Vec3d source = apply_back(placed, lattice.world(at));
                return openvdb::tools::BoxSampler::sample(tree, source) < 0.0f;
            };
    });
    return measured;
}

// Origins of the union's nodes of `size` voxels: all that a part's nodes touch after the part's shift. `list`
// gives the origins of a part's nodes.
template <typename List>
std::vector<Coord> shifted_origins(const std::vector<Part> &parts, int32_t size, const List &list) {
    const int32_t last = size - 1;
    std::set<Coord> origins;
    for (const Part &part : parts) {
        for (const Coord &origin : list(part.grid->constTree())) {
            for (int corner = 0; corner < 8; ++corner) {
                const Coord at =
                    origin + part.shift +
                    Coord((corner & 1) ? last : 0, (corner & 2) ? last : 0, (corner & 4) ? last : 0);
                origins.insert(at & ~last);
            }
        }
    }
    return std::vector<Coord>(origins.begin(), origins.end());
}

std::vector<Coord> leaf_origins(const FloatTree &tree) {
    std::vector<Coord> origins;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        origins.push_back(leaf->origin());
    }
    return origins;
}

FloatGrid::Ptr unite_parts(const std::vector<Part> &parts, const Lattice &lattice, double begin,
                           Stage &stage) {
    const float background = lattice.background();
    FloatGrid::Ptr united = FloatGrid::create(background);
    const std::vector<Coord> origins = shifted_origins(parts, int32_t(Leaf::DIM), leaf_origins);
    std::vector<Leaf *> leaves;
    leaves.reserve(origins.size());
    for (const Coord &origin : origins) {
        leaves.push_back(united->tree().touchLeaf(origin));
    }
    stage.loop(leaves.size(), 16, begin, 1.0, [&](size_t i) {
        Leaf &leaf = *leaves[i];
        for (const Part &part : parts) {
            FloatGrid::ConstUnsafeAccessor tree(part.grid->constTree());
            for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
                const float value = tree.getValue(leaf.offsetToGlobalCoord(n) - part.shift);
                leaf.setValueOnly(n, std::max(std::min(value, leaf.getValue(n)), -background));
            }
        }
    });
    fill_tiles(united->tree(), shifted_origins(parts, UPPER_SIZE, root_origins), background, stage, [&] {
        std::vector<FloatGrid::ConstUnsafeAccessor> trees;
        trees.reserve(parts.size());
        for (const Part &part : parts) {
            trees.emplace_back(part.grid->constTree());
        }
        return [&parts, trees](const Coord &at) {
            for (size_t i = 0; i < parts.size(); ++i) {
                if (trees[i].getValue(at - parts[i].shift) < 0.0f) {
                    return true;
                }
            }
            return false;
        };
    });
    return united;
}

bool is_identity(const double *transform) {
    return transform == nullptr || std::equal(IDENTITY, IDENTITY + 12, transform);
}

vsh_grid *unite(const vsh_grid_instance *instances, size_t count, const vsh_grid_options *options,
                const vsh_run &run) {
    if (instances == nullptr || count == 0) {
        refuse(VSH_ERROR_ARGUMENT, "unite: no grids");
    }
    std::vector<Placed> placed;
    for (size_t i = 0; i < count; ++i) {
        placed.push_back(place(instances[i], i));
    }
    const bool own_voxel = options == nullptr || options->voxel_size == 0.0;
    if (count == 1 && own_voxel && is_identity(instances[0].transform)) {
        return new vsh_grid(*instances[0].grid); // the tree is shared: no handle ever changes it
    }
    const Lattice lattice = choose_lattice(placed, options);
    check_union(placed, lattice, run);
    Stage stage(run, "voxelize");
    std::vector<Part> parts;
    double shell = 0.0;
    for (size_t i = 0; i < count; ++i) {
        stage.check(); // meshing, the first step of resampling, cannot be cancelled
        Part part{placed[i].grid->level_set, Coord(0)};
        if (!lies_on(placed[i], lattice, part.shift)) {
            part = {resample(placed[i], i, lattice, 0.9 * double(i) / double(count),
                             0.9 * double(i + 1) / double(count), stage),
                    Coord(0)};
        }
        parts.push_back(part);
        shell = std::max(shell, placed[i].scale * placed[i].grid->info.shell_thickness);
    }
    return close_grid(unite_parts(parts, lattice, 0.9, stage), lattice.matrix(), shell, stage);
}

} // namespace

} // namespace vshi

vsh_result vsh_grid_unite(const vsh_grid_instance *instances, size_t instance_count,
                          const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                          vsh_error *error) {
    VSHI_MAKES(grid);
    return vshi::guard_run(run, error, VSH_ERROR_INTERNAL, "unite", [&](const vsh_run &full) {
        *grid = vshi::unite(instances, instance_count, options, full);
    });
}
