// True distances for a grid that has none.
#pragma once

#include "shim/openvdb_surface.h"

namespace vshi {

// A leaf of the source, of its mesh, and of what becomes of it, together.
constexpr double REDISTANCE_BYTES_PER_LEAF = 4.0 * BYTES_PER_LEAF;

// The zero surface of a grid as quads in its index space; voxels beside it must be active.
Surface mesh_surface(const FloatGrid &source, Stage &stage);

// A level set on the lattice with the zero surface and the signs of `source` (on the same lattice, with
// values at least wherever neighbours differ in sign) and true distances: the surface is meshed and the mesh
// measured.
FloatGrid::Ptr redistance(const FloatGrid &source, const Lattice &lattice, double begin, double end,
                          Stage &stage, vsh_error *error);

} // namespace vshi
