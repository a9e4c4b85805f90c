// OpenVDB's conversion takes for inside whatever cannot be reached from outside, so it fills rooms. Which
// shells are rooms is told by the way their triangles face.
#include "shim/openvdb_shells.h"

#include "base/elementary.h"
#include "caster/mesh.h"

#include <cfloat>
#include <cmath>
#include <numeric>
#include <openvdb/util/Util.h>

namespace vshi {

namespace {

// Triangles that hang together by their vertices.
struct Shell {
    double volume = 0.0; // voxels, negative where it faces inward
    Vec3d low{DBL_MAX};
    Vec3d high{-DBL_MAX};
    Vec3d sample{0.0};             // one of its vertices
    std::vector<size_t> triangles; // of the mesh
    size_t depth = 0;              // shells around it
    bool room = false;
};

Vec3d to_index(const Lattice &lattice, const vshi_vec &p) {
    return lattice.index(Vec3d(p.x, p.y, p.z));
}

struct Corners {
    Vec3d at[3];
    uint32_t vertex[3];
};

// Corners in index space, anticlockwise from outside also where the mesh's transform mirrors.
Corners corners_of(const vsh_mesh &mesh, const Lattice &lattice, size_t triangle) {
    vshi_vec corner[3];
    Corners result;
    vshi_mesh_triangle_of(&mesh, triangle, corner, result.vertex);
    for (int k = 0; k < 3; ++k) {
        result.at[k] = to_index(lattice, corner[k]);
    }
    return result;
}

uint32_t root_of(std::vector<uint32_t> &parent, uint32_t v) {
    while (parent[v] != v) {
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    return v;
}

std::vector<Shell> find_shells(const vsh_mesh &mesh, const Lattice &lattice, vsh_error *error) {
    std::vector<uint32_t> weld(mesh.vertex_count);
    const vsh_result result = vshi_mesh_weld(&mesh, weld.data(), error);
    if (result != VSH_OK) {
        throw Failure{result};
    }
    std::vector<uint32_t> parent(mesh.vertex_count);
    std::iota(parent.begin(), parent.end(), 0u);
    for (size_t i = 0; i < 3 * mesh.triangle_count; ++i) {
        const uint32_t a = root_of(parent, weld[mesh.indices[i]]);
        const uint32_t b = root_of(parent, weld[mesh.indices[i - i % 3]]);
        parent[std::max(a, b)] = std::min(a, b);
    }
    std::vector<uint32_t> number(mesh.vertex_count, UINT32_MAX);
    std::vector<Shell> shells;
    for (size_t i = 0; i < mesh.triangle_count; ++i) {
        if (vshi_mesh_degenerate(&mesh, i)) {
            continue;
        }
        const Corners c = corners_of(mesh, lattice, i);
        uint32_t &shell = number[root_of(parent, weld[c.vertex[0]])];
        if (shell == UINT32_MAX) {
            shell = uint32_t(shells.size());
            shells.emplace_back();
            shells.back().sample = c.at[0];
        }
        Shell &s = shells[shell];
        const Vec3d a = c.at[0] - s.sample, b = c.at[1] - s.sample, d = c.at[2] - s.sample;
        s.volume += a.dot(b.cross(d)) / 6.0;
        for (const Vec3d &at : c.at) {
            s.low = openvdb::math::minComponent(s.low, at);
            s.high = openvdb::math::maxComponent(s.high, at);
        }
        s.triangles.push_back(i);
    }
    return shells;
}

// How often a shell goes around a point: its solid angle there over the whole sphere's (van Oosterom and
// Strackee, "The solid angle of a plane triangle", 1983). ±1 inside a closed shell, 0 outside.
double winding(const vsh_mesh &mesh, const Lattice &lattice, const Shell &shell, const Vec3d &point) {
    for (int i = 0; i < 3; ++i) {
        if (point[i] < shell.low[i] || point[i] > shell.high[i]) {
            return 0.0;
        }
    }
    double angle = 0.0;
    for (const size_t triangle : shell.triangles) {
        const Corners corners = corners_of(mesh, lattice, triangle);
        const Vec3d a = corners.at[0] - point, b = corners.at[1] - point, c = corners.at[2] - point;
        const double la = a.length(), lb = b.length(), lc = c.length();
        angle +=
            2.0 * vshi_atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (4.0 * 3.14159265358979323846);
}

// Finds how deep every shell lies in the others, and the rooms. Returns whether there are any.
bool nest(const vsh_mesh &mesh, const Lattice &lattice, std::vector<Shell> &shells) {
    const bool all_inward =
        std::all_of(shells.begin(), shells.end(), [](const Shell &shell) { return shell.volume < 0.0; });
    const bool none_inward =
        std::none_of(shells.begin(), shells.end(), [](const Shell &shell) { return shell.volume < 0.0; });
    if (all_inward || none_inward) {
        return false;
    }
    bool rooms = false;
    for (Shell &shell : shells) {
        double around = 0.0;
        for (const Shell &other : shells) {
            if (&other != &shell) {
                const double times = winding(mesh, lattice, other, shell.sample);
                around += times;
                shell.depth += std::fabs(times) > 0.5;
            }
        }
        shell.room = shell.volume < 0.0 && around > 0.5;
        rooms |= shell.room;
    }
    return rooms;
}

void add_shell(const vsh_mesh &mesh, const Lattice &lattice, const Shell &shell, Surface &surface) {
    for (const size_t triangle : shell.triangles) {
        const auto first = openvdb::Index32(surface.points.size());
        const Corners corners = corners_of(mesh, lattice, triangle);
        for (const Vec3d &at : corners.at) {
            surface.points.emplace_back(at);
        }
        surface.polygons.emplace_back(first, first + 1, first + 2, openvdb::util::INVALID_IDX);
    }
}

} // namespace

void add_mesh(const vsh_mesh &mesh, const Lattice &lattice, Surface &surface) {
    const size_t first = surface.points.size();
    for (size_t v = 0; v < mesh.vertex_count; ++v) {
        surface.points.emplace_back(
            to_index(lattice, vshi_transform_point(mesh.transform, vshi_vec_off(mesh.positions + 3 * v))));
    }
    const auto corner = [first](uint32_t vertex) { return openvdb::Index32(first + vertex); };
    for (size_t i = 0; i < mesh.triangle_count; ++i) {
        if (!vshi_mesh_degenerate(&mesh, i)) {
            const uint32_t *vertex = mesh.indices + 3 * i;
            surface.polygons.emplace_back(corner(vertex[0]), corner(vertex[1]), corner(vertex[2]),
                                          openvdb::util::INVALID_IDX);
        }
    }
}

void add_closed_mesh(const vsh_mesh &mesh, const Lattice &lattice, std::vector<Solid> &solids,
                     vsh_error *error) {
    std::vector<Shell> shells = find_shells(mesh, lattice, error);
    if (!nest(mesh, lattice, shells)) {
        add_mesh(mesh, lattice, solids.front().outward);
        return;
    }
    const size_t first = solids.size();
    for (const Shell &shell : shells) {
        // A room at depth 1 is cut out of depth 0; what stands in it has depth 2.
        const size_t solid = first + (shell.room ? (shell.depth - 1) / 2 : shell.depth / 2);
        if (solids.size() <= solid) {
            solids.resize(solid + 1);
        }
        add_shell(mesh, lattice, shell, shell.room ? solids[solid].rooms : solids[solid].outward);
    }
}

} // namespace vshi
