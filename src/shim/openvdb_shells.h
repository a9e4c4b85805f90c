// The closed surfaces that a mesh consists of, and the rooms among them.
#pragma once

#include "shim/openvdb_surface.h"

#include <vdbshade/mesh.h>

namespace vshi {

// What is filled, and what is cut out of it afterwards.
struct Solid {
    Surface outward;
    Surface rooms;
};

// Adds all of a mesh's triangles in index space.
void add_mesh(const vsh_mesh &mesh, const Lattice &lattice, Surface &surface);

// Adds a closed mesh to solids.front(), which takes all that have no rooms. A shell that faces inward inside
// other shells of its mesh is a room; its mesh becomes solids of its own, one for each depth of nesting, so
// that what stands in a room is not cut out with it. Throws Failure when memory is short.
void add_closed_mesh(const vsh_mesh &mesh, const Lattice &lattice, std::vector<Solid> &solids,
                     vsh_error *error);

} // namespace vshi
