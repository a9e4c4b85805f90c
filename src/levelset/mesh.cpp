// Level sets from meshes: solids together, rooms cut out of them, walls behind other faces, sheets as shells.
// Filling a solid fills its rooms. Each room is cut out of the solids around it and of no others, so that
// pillars and furniture in the room stay.
#include "geometry/alpha_mask.h"
#include "geometry/mesh_set.h"
#include "geometry/solidity.h"
#include "levelset/surface.h"

#include <cfloat>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Composite.h>

namespace vshi {

namespace {

// A leaf takes distances, sides, the leaf itself, and once more distances where solids overlap. A triangle
// takes a polygon, corners, and places in lists. Measured over the assets at 512 and 1024 voxels, the whole
// estimate is 1.6 to 2.4 times the peak.
constexpr double MESH_BYTES_PER_LEAF = 3.0 * BYTES_PER_LEAF;
constexpr double BYTES_PER_TRIANGLE = 160.0;

// Each triangle visits each region of 32³ voxels (band.h) that it reaches. This many visits take about ten
// seconds. Bands up to NARROW cost at most three times as much as the narrowest.
constexpr double MOST_VISITS = 3e6;
constexpr double NARROW = 12.0;

// Checked meshes.
struct Meshes {
    vshi_mesh_set set{};
    Vec3d low{DBL_MAX};
    Vec3d high{-DBL_MAX};
    size_t triangles = 0;
    // All meshes if some have masks; these are replaced by their opaque pieces
    std::vector<vsh_mesh> cut;
    std::vector<vshi_mask_pieces> pieces;

    Meshes() = default;
    ~Meshes() {
        vshi_mesh_set_free(&set);
        for (vshi_mask_pieces &each : pieces) {
            vshi_mask_pieces_free(&each);
        }
    }
    Meshes(const Meshes &) = delete;
    Meshes &operator=(const Meshes &) = delete;

    const vsh_mesh_report &report(size_t i) const { return set.checked[i].report; }
};

void check_meshes(const vsh_mesh *mesh, size_t count, Meshes &meshes) {
    if (mesh == nullptr || count == 0) {
        refuse(VSH_ERROR_ARGUMENT, "voxelize: no meshes");
    }
    require(vshi_mesh_set_create, mesh, count, &meshes.set);
    for (size_t i = 0; i < count; ++i) {
        const vsh_mesh_report &report = meshes.report(i);
        meshes.low = openvdb::math::minComponent(meshes.low, Vec3d(report.bounds_min));
        meshes.high = openvdb::math::maxComponent(meshes.high, Vec3d(report.bounds_max));
        meshes.triangles += mesh[i].triangle_count - report.degenerate_triangles;
    }
    if (meshes.triangles == 0) {
        refuse(VSH_ERROR_INPUT, "voxelize: %zu mesh%s without a triangle of any area", count,
               count == 1 ? "" : "es");
    }
    if (meshes.triangles > size_t(INT32_MAX)) {
        refuse(VSH_ERROR_LIMIT, "voxelize: %zu triangles, %d at most", meshes.triangles, INT32_MAX);
    }
}

// Longest pieces into which masks cut triangles, voxels: the border is exact to half of that.
constexpr double PIECE = 0.5;

// Cuts the meshes that have masks. run.memory_held grows by their pieces.
void cut_masks(const vsh_mesh *given, size_t count, double voxel, Meshes &meshes, vsh_run &run) {
    const auto masked = [](const vsh_mesh &mesh) { return mesh.mask != nullptr; };
    if (std::none_of(given, given + count, masked)) {
        return;
    }
    meshes.cut.assign(given, given + count);
    meshes.pieces.resize(count);
    for (size_t i = 0; i < count; ++i) {
        vsh_mesh &mesh = meshes.cut[i];
        if (!masked(mesh)) {
            continue;
        }
        vshi_mask_pieces &pieces = meshes.pieces[i];
        require(vshi_mask_pieces_cut, &mesh, PIECE * voxel, &run, &pieces);
        mesh.positions = pieces.positions;
        mesh.indices = pieces.indices;
        mesh.vertex_count = 3 * pieces.count;
        mesh.triangle_count = pieces.count;
        mesh.normals = mesh.uvs = mesh.mask_uvs = nullptr;
        mesh.mask = nullptr;
        mesh.checked = nullptr;
        mesh.solidity = VSH_SOLIDITY_SHELL;
        mesh.alpha = VSH_ALPHA_MASKED;
        run.memory_held += uint64_t(pieces.count) * (9 * sizeof(float) + 3 * sizeof(uint32_t));
    }
    vshi_mesh_set_free(&meshes.set);
    meshes.triangles = 0;
    check_meshes(meshes.cut.data(), count, meshes);
}

// Half width of the band that a component is measured in, voxels.
double band_of(const vshi_component &component, const Lattice &lattice) {
    const double shell = component.kind == VSHI_KIND_WALL    ? lattice.shell
                         : component.kind == VSHI_KIND_SHEET ? 0.5 * lattice.shell
                                                             : 0.0;
    return lattice.half_width + shell;
}

// Refuses wide bands of many triangles. A triangle smaller than a region reaches (half width / 16 + 1)³ of
// them.
void check_work(size_t triangles, double half_width) {
    const double widest = std::max(NARROW, 16.0 * (std::cbrt(MOST_VISITS / double(triangles)) - 1.0));
    if (half_width > widest) {
        refuse(
            VSH_ERROR_LIMIT,
            "half_width %g: a band this wide takes minutes for %zu triangles; use at most %.0f (the field's "
            "coarser levels reach farther anyway)",
            half_width, triangles, std::floor(widest));
    }
}

// Estimates the memory for all objects, and checks it.
void check_leaves(const Meshes &meshes, const Lattice &lattice, const vsh_run &run) {
    double leaves = 0.0;
    const vshi_solidity &solidity = *meshes.set.solidity;
    for (size_t w = 0; w < solidity.wholes.count; ++w) {
        double band = lattice.half_width, area = 0.0;
        for (size_t i = solidity.first[w]; i < solidity.first[w + 1]; ++i) {
            const vshi_component &component = solidity.components[i];
            band = std::max(band, band_of(component, lattice));
            area += component.kind == VSHI_KIND_WALL ? component.area : 0.0; // walls are measured twice
        }
        Vec3d low(DBL_MAX), high(-DBL_MAX);
        for (size_t i = solidity.wholes.first[w]; i < solidity.wholes.first[w + 1]; ++i) {
            area += meshes.report(i).area;
            low = openvdb::math::minComponent(low, Vec3d(meshes.report(i).bounds_min));
            high = openvdb::math::maxComponent(high, Vec3d(meshes.report(i).bounds_max));
        }
        if (area > 0.0) {
            leaves += band_leaves(area / (lattice.voxel * lattice.voxel), (high - low) / lattice.voxel, band);
        }
    }
    check_memory(run, lattice.voxel, leaves,
                 leaves * MESH_BYTES_PER_LEAF + double(meshes.triangles) * BYTES_PER_TRIANGLE);
}

// --- components sorted by kind

// A filled surface, and the rooms that are cut out of it afterwards.
struct Solid {
    Surface outward;
    Surface rooms;
};

// Faces with a thin wall behind them. Walls that stand apart are voxelised together.
struct Wall {
    bool inward = true; // the faces look inwards, and the wall lies outside of them; else inside
    bool open = false;  // the faces have holes
    Surface faces;
    Surface closed;                    // with their holes closed
    std::vector<openvdb::BBoxd> boxes; // index space
};

struct Parts {
    std::vector<Solid> solids; // the first holds all solids without rooms
    std::vector<Wall> walls;
    Surface sheets;
};

using Rooms = std::vector<uint32_t>; // components

Vec3d to_index(const Lattice &lattice, const vshi_vec &p) {
    return lattice.index(Vec3d(p.x, p.y, p.z));
}

void add_triangle(const vshi_vec corner[3], const Lattice &lattice, Surface &surface) {
    const auto first = openvdb::Index32(surface.points.size());
    for (int k = 0; k < 3; ++k) {
        surface.points.emplace_back(to_index(lattice, corner[k]));
    }
    surface.polygons.emplace_back(first, first + 1, first + 2, UINT32_MAX);
}

// Sorts components by kind.
class Sorting {
  public:
    Sorting(const vshi_solidity &solidity_, const Lattice &lattice_, double apart_)
        : solidity(solidity_), lattice(lattice_), apart(apart_), rooms(solidity.count) {
        for (size_t i = 0; i < solidity.cut_count; ++i) {
            rooms[solidity.cuts[i].solid].push_back(solidity.cuts[i].room);
        }
        parts.solids.resize(1);
    }

    Parts sort() {
        for (size_t i = 0; i < solidity.count; ++i) {
            add_component(i);
        }
        return std::move(parts);
    }

  private:
    void add_faces(const vshi_component &c, Surface &surface) const {
        const vsh_mesh &mesh = solidity.wholes.meshes[c.whole];
        for (size_t at = 0; at < c.triangles; ++at) {
            if (!vshi_mesh_degenerate(&mesh, c.list[at])) {
                vshi_vec corner[3];
                vshi_mesh_triangle(&mesh, c.list[at], corner);
                add_triangle(corner, lattice, surface);
            }
        }
    }

    void add_closed(const vshi_component &c, Surface &surface) const {
        add_faces(c, surface);
        for (size_t k = 0; k < c.open_edges; ++k) {
            add_triangle(c.cap[k], lattice, surface);
        }
    }

    void add_component(size_t i) {
        const vshi_component &c = solidity.components[i];
        switch (c.kind) {
        case VSHI_KIND_SHEET:
            add_faces(c, parts.sheets);
            break;
        case VSHI_KIND_WALL:
            add_wall(c);
            break;
        case VSHI_KIND_SOLID:
            add_closed(c, solid_with(rooms[i]).outward);
            break;
        case VSHI_KIND_ROOM: // added with its solids
            break;
        }
    }

    // The solid with these rooms, which may be new.
    Solid &solid_with(const Rooms &cut) {
        const auto [found, is_new] = numbers.try_emplace(cut, parts.solids.size());
        if (is_new) {
            parts.solids.emplace_back();
            for (const uint32_t room : cut) {
                add_closed(solidity.components[room], parts.solids.back().rooms);
            }
        }
        return parts.solids[found->second];
    }

    void add_wall(const vshi_component &c) {
        openvdb::BBoxd box(to_index(lattice, c.low), to_index(lattice, c.high));
        box.expand(0.5 * apart);
        auto wall = std::find_if(parts.walls.begin(), parts.walls.end(), [&](const Wall &w) {
            return w.inward == c.inward && std::none_of(w.boxes.begin(), w.boxes.end(),
                                                        [&](const auto &b) { return b.hasOverlap(box); });
        });
        if (wall == parts.walls.end()) {
            parts.walls.emplace_back();
            wall = parts.walls.end() - 1;
            wall->inward = c.inward;
        }
        wall->boxes.push_back(box);
        wall->open |= c.open_edges > 0;
        add_faces(c, wall->faces);
        add_closed(c, wall->closed);
    }

    const vshi_solidity &solidity;
    const Lattice &lattice;
    const double apart;
    std::vector<Rooms> rooms;                      // of each solid
    std::map<Rooms, size_t> numbers{{Rooms{}, 0}}; // of the solids, by their rooms
    Parts parts;
};

// --- the parts as level sets

// Moves the surface out by `offset` (world units) and narrows the band, so that a sheet becomes a solid.
void move_out(FloatGrid &grid, float offset, float background, Stage &stage) {
    std::vector<Leaf *> leaves;
    grid.tree().getNodes(leaves);
    stage.loop(leaves.size(), 64, 0.0, 0.0, [&](size_t i) {
        for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
            const float value = std::clamp(leaves[i]->getValue(n) - offset, -background, background);
            leaves[i]->setValueOnly(n, value);
            leaves[i]->setActiveState(n, std::fabs(value) < background);
        }
    });
    stage.run([&] { openvdb::tools::changeLevelSetBackground(grid.tree(), background); });
}

struct Progress {
    double done;
    double per_triangle;

    double advance(const Surface &surface) { return done += per_triangle * double(surface.polygons.size()); }
};

// Returns NULL for a solid without triangles.
FloatGrid::Ptr fill_solid(const Solid &solid, const Lattice &lattice, Progress &progress, Stage &stage) {
    if (solid.outward.polygons.empty()) {
        return nullptr;
    }
    double begin = progress.done;
    const FloatGrid::Ptr filled = fill_surface(solid.outward, lattice, lattice.half_width, begin,
                                               progress.advance(solid.outward), stage);
    if (!solid.rooms.polygons.empty()) {
        begin = progress.done;
        const FloatGrid::Ptr rooms = fill_surface(solid.rooms, lattice, lattice.half_width, begin,
                                                  progress.advance(solid.rooms), stage);
        stage.run([&] { openvdb::tools::csgDifference(*filled, *rooms); });
    }
    return filled;
}

void unite(FloatGrid::Ptr &united, const FloatGrid::Ptr &more, Stage &stage) {
    if (united == nullptr || more == nullptr) {
        united = united == nullptr ? more : united;
    } else {
        stage.run([&] { openvdb::tools::csgUnion(*united, *more); });
    }
}

// A wall behind faces that look inwards, or behind the outer skin of a house with open rooms.
FloatGrid::Ptr fill_wall(const Wall &wall, const Lattice &lattice, Progress &progress, Stage &stage) {
    const double begin = progress.done, end = progress.advance(wall.faces);
    const double middle = 0.5 * (begin + end);
    const double half_width = lattice.half_width + lattice.shell;
    FloatGrid::Ptr grown, within;
    if (wall.open) {
        grown = measure_surface(wall.faces, lattice, half_width, begin, middle, stage);
        within = fill_surface(wall.closed, lattice, lattice.half_width, middle, end, stage);
    } else {
        grown = fill_surface(wall.faces, lattice, half_width, begin, end, stage);
        within = grown->deepCopy();
        move_out(*within, 0.0f, lattice.background(), stage);
    }
    move_out(*grown, float(lattice.shell * lattice.voxel), lattice.background(), stage);
    stage.run([&] {
        if (wall.inward) {
            openvdb::tools::csgDifference(*grown, *within);
        } else {
            openvdb::tools::csgIntersection(*grown, *within);
        }
    });
    return grown;
}

// Measures sheets without signs, as their inside is air.
FloatGrid::Ptr fill_sheets(const Surface &sheets, const Lattice &lattice, Progress &progress, Stage &stage) {
    const double begin = progress.done;
    FloatGrid::Ptr shell = measure_surface(sheets, lattice, lattice.half_width + 0.5 * lattice.shell, begin,
                                           progress.advance(sheets), stage);
    move_out(*shell, float(0.5 * lattice.shell * lattice.voxel), lattice.background(), stage);
    return shell;
}

vsh_grid *from_meshes(const vsh_mesh *given, size_t count, const vsh_grid_options *options, vsh_run run) {
    vshi_tight_meshes tight;
    require(vshi_meshes_tighten, given, given != nullptr ? count : 0, &tight);
    const std::unique_ptr<void, void (*)(void *)> copies(tight.memory, std::free);
    const vsh_mesh *mesh = tight.meshes;
    Meshes meshes;
    check_meshes(mesh, count, meshes);
    const Lattice lattice = make_lattice(options, meshes.low, meshes.high);
    cut_masks(mesh, count, lattice.voxel, meshes, run);
    require(vshi_mesh_set_solve, &meshes.set, &run);
    check_work(meshes.triangles, lattice.half_width);
    check_leaves(meshes, lattice, run);
    Stage stage(run, "voxelize");
    vshi_mesh_set_note(&meshes.set, lattice.shell, lattice.voxel, &run);

    const double reach = 2.0 * (lattice.half_width + lattice.shell) + 2.0;
    const Parts parts = Sorting(*meshes.set.solidity, lattice, reach).sort();
    Progress progress{0.0, 1.0 / double(meshes.triangles)};
    FloatGrid::Ptr united;
    for (const Solid &solid : parts.solids) {
        unite(united, fill_solid(solid, lattice, progress, stage), stage);
    }
    for (const Wall &wall : parts.walls) {
        unite(united, fill_wall(wall, lattice, progress, stage), stage);
    }
    const bool sheets = !parts.sheets.polygons.empty();
    if (sheets) {
        unite(united, fill_sheets(parts.sheets, lattice, progress, stage), stage);
    }
    return close_grid(united, lattice.matrix(), sheets ? lattice.shell * lattice.voxel : 0.0, stage);
}

} // namespace

} // namespace vshi

vsh_result vsh_grid_from_meshes(const vsh_mesh *meshes, size_t mesh_count, const vsh_grid_options *options,
                                const vsh_run *run, vsh_grid **grid, vsh_error *error) {
    VSHI_MAKES(grid);
    return vshi::guard_run(run, error, VSH_ERROR_INTERNAL, "voxelize", [&](const vsh_run &full) {
        *grid = vshi::from_meshes(meshes, mesh_count, options, full);
    });
}
