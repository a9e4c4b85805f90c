// Surfaces as points and polygons.
#pragma once

#include <array>
#include <cstdint>
#include <openvdb/Types.h>
#include <vector>

namespace vshi {

// Polygons in index space; a triangle's fourth corner is openvdb::util::INVALID_IDX.
struct Surface {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> polygons;
};

// A quad is two triangles; a triangle's number is twice its polygon's, plus one for a quad's second.
using Corners = std::array<openvdb::Vec3d, 3>;

inline uint32_t triangles_of(const openvdb::Vec4I &polygon) {
    return polygon[3] == UINT32_MAX ? 1 : 2;
}

inline Corners corners_of(const Surface &surface, uint32_t triangle) {
    const openvdb::Vec4I &polygon = surface.polygons[triangle / 2];
    const int second = int(triangle % 2) + 1;
    return {openvdb::Vec3d(surface.points[polygon[0]]), openvdb::Vec3d(surface.points[polygon[second]]),
            openvdb::Vec3d(surface.points[polygon[second + 1]])};
}

} // namespace vshi
