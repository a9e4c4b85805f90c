// OpenVDB's conversion takes for inside whatever cannot be reached from outside, so it fills rooms; they are
// cut out afterwards, each out of the solids that it lies in and of no others, so that what stands in a room
// or reaches into it stays.
#include "levelset/shells.h"

#include <map>
#include <openvdb/util/Util.h>

namespace vshi {

namespace {

using Rooms = std::vector<uint32_t>; // components

Vec3d to_index(const Lattice &lattice, const vshi_vec &p) {
    return lattice.index(Vec3d(p.x, p.y, p.z));
}

openvdb::Vec4I polygon_of(openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
    return {a, b, c, openvdb::util::INVALID_IDX};
}

void add_triangle(const vshi_vec corner[3], const Lattice &lattice, Surface &surface) {
    const auto first = openvdb::Index32(surface.points.size());
    for (int k = 0; k < 3; ++k) {
        surface.points.emplace_back(to_index(lattice, corner[k]));
    }
    surface.polygons.push_back(polygon_of(first, first + 1, first + 2));
}

void add_whole(const vsh_mesh &mesh, const Lattice &lattice, Surface &surface) {
    const size_t first = surface.points.size();
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        surface.points.emplace_back(
            to_index(lattice, vshi_transform_point(mesh.transform, vshi_vec_off(mesh.positions + 3 * v))));
    }
    const auto corner = [first](uint32_t vertex) { return openvdb::Index32(first + vertex); };
    for (size_t i = 0; i < mesh.triangle_count; ++i) {
        if (!vshi_mesh_degenerate(&mesh, i)) {
            const uint32_t *vertex = mesh.indices + 3 * i;
            surface.polygons.push_back(polygon_of(corner(vertex[0]), corner(vertex[1]), corner(vertex[2])));
        }
    }
}

class Sorting {
  public:
    Sorting(const vshi_solidity *solidity, const Lattice &lattice_, double apart_)
        : lattice(lattice_), apart(apart_), all(vshi_solidity_components(solidity, &count)),
          wholes(*vshi_solidity_wholes(solidity)), rooms(count) {
        size_t cuts = 0;
        const vshi_cut *cut = vshi_solidity_cuts(solidity, &cuts);
        for (size_t i = 0; i < cuts; ++i) {
            rooms[cut[i].solid].push_back(cut[i].room);
        }
        parts.solids.resize(1);
    }

    Parts sort(const vshi_solidity *solidity) {
        for (size_t w = 0; w < wholes.count; ++w) {
            size_t own = 0;
            const vshi_component *first = vshi_solidity_of_whole(solidity, w, &own);
            const vsh_mesh &mesh = wholes.meshes[w];
            if (all_alike(first, own)) {
                const bool sheet = own > 0 && first->kind == VSHI_KIND_SHEET;
                add_whole(mesh, lattice, sheet ? parts.sheets : parts.solids.front().outward);
                for (size_t i = 0; !sheet && i < own; ++i) {
                    add_caps(first[i], parts.solids.front().outward);
                }
            } else {
                for (size_t i = 0; i < own; ++i) {
                    add_component(mesh, first[i]);
                }
            }
        }
        return std::move(parts);
    }

  private:
    size_t index_of(const vshi_component &c) const { return size_t(&c - all); }

    // Whether all of a whole is sheets, or solids without rooms.
    bool all_alike(const vshi_component *first, size_t own) const {
        return std::all_of(first, first + own, [&](const vshi_component &c) {
            return c.kind == first->kind &&
                   (c.kind == VSHI_KIND_SHEET || (c.kind == VSHI_KIND_SOLID && rooms[index_of(c)].empty()));
        });
    }

    void add_faces(const vsh_mesh &mesh, const vshi_component &c, Surface &surface) const {
        for (size_t at = 0; at < c.triangles; ++at) {
            if (!vshi_mesh_degenerate(&mesh, c.list[at])) {
                vshi_vec corner[3];
                vshi_mesh_triangle(&mesh, c.list[at], corner);
                add_triangle(corner, lattice, surface);
            }
        }
    }

    void add_caps(const vshi_component &c, Surface &surface) const {
        for (size_t k = 0; k < c.open_edges; ++k) {
            add_triangle(c.cap[k], lattice, surface);
        }
    }

    void add_closed(const vsh_mesh &mesh, const vshi_component &c, Surface &surface) const {
        add_faces(mesh, c, surface);
        add_caps(c, surface);
    }

    void add_component(const vsh_mesh &mesh, const vshi_component &c) {
        switch (c.kind) {
        case VSHI_KIND_SHEET:
            add_faces(mesh, c, parts.sheets);
            break;
        case VSHI_KIND_WALL:
            add_wall(mesh, c);
            break;
        case VSHI_KIND_SOLID:
            add_closed(mesh, c, solid_of(rooms[index_of(c)]).outward);
            break;
        case VSHI_KIND_ROOM: // comes with its solids
            break;
        }
    }

    // The solid with these rooms; a new one is given them.
    Solid &solid_of(const Rooms &cut) {
        if (cut.empty()) {
            return parts.solids.front();
        }
        const auto found = numbers.find(cut);
        if (found != numbers.end()) {
            return parts.solids[found->second];
        }
        numbers[cut] = parts.solids.size();
        parts.solids.emplace_back();
        for (const uint32_t room : cut) {
            add_closed(wholes.meshes[all[room].whole], all[room], parts.solids.back().rooms);
        }
        return parts.solids.back();
    }

    void add_wall(const vsh_mesh &mesh, const vshi_component &c) {
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
        add_faces(mesh, c, wall->faces);
        add_closed(mesh, c, wall->closed);
    }

    const Lattice &lattice;
    const double apart;
    size_t count = 0;
    const vshi_component *all;
    const vshi_wholes &wholes;
    std::vector<Rooms> rooms; // of each solid
    std::map<Rooms, size_t> numbers;
    Parts parts;
};

} // namespace

Parts sort_parts(const vshi_solidity *solidity, const Lattice &lattice, double apart) {
    return Sorting(solidity, lattice, apart).sort(solidity);
}

} // namespace vshi
