/* Samples of coarse smooth meshes are lifted towards the surface that their normals describe, after Hanika,
 * "Hacking the Shadow Terminator" (Ray Tracing Gems II, 2021): p' = p + Σ b_i (-min(0, (p - v_i)·n_i)) n_i.
 * Only convex parts are lifted, by about the sagitta of the arc over the triangle. */
#include "mesh/smooth_surface.h"
#include "mesh/mesh.h"

#include <math.h>

/* Vertex normals nearer to the geometric normal than this are those of a flat triangle (0.08°): exporters
 * write them with a float's noise, and a flat mesh is to stay exactly flat. */
static const double FLAT_COSINE = 1.0 - 1e-6;

/* Normals that lean farther over their face than this (53°) come from a shared hard edge, not from a curved
 * surface. They still shade, but do not lift: over a cube with averaged normals (54.7°) the lift would be two
 * thirds of its half edge, and tear it off the floor. */
static const double LIFT_COSINE = 0.6;

/* The least cosine between the shading and the geometric normal. */
static const double LEAST_COSINE = 1e-3;

bool vshi_surface_set(const vsh_mesh *mesh, size_t triangle, vshi_surface *surface) {
    uint32_t vertex[3];
    vshi_mesh_triangle_of(mesh, triangle, surface->corner, vertex);
    const vshi_vec *corner = surface->corner;
    surface->geometric =
        vshi_unit(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
    surface->mirrored = vshi_transform_determinant(mesh->transform) < 0.0;
    surface->smooth = false;
    for (int k = 0; k < 3; ++k) {
        surface->normal[k] = surface->geometric;
        surface->lifts[k] = false;
        if (mesh->normals == NULL) {
            continue;
        }
        const vshi_vec given = vshi_vec_off(mesh->normals + 3 * (size_t)vertex[k]);
        const vshi_vec normal = vshi_unit(vshi_transform_normal(mesh->transform, vshi_unit(given)));
        const double cosine = vshi_dot(normal, surface->geometric);
        if (!vshi_finite(given) || !(cosine > 0.0)) {
            continue;
        }
        surface->normal[k] = normal;
        surface->lifts[k] = cosine > LIFT_COSINE;
        surface->smooth = surface->smooth || cosine < FLAT_COSINE;
    }
    return vshi_dot(surface->geometric, surface->geometric) > 0.0;
}

void vshi_surface_at(const vshi_surface *surface, const double weight[3], vshi_vec *position,
                     vshi_vec *normal, vshi_vec *lift) {
    const double b[3] = {weight[0], weight[surface->mirrored ? 2 : 1], weight[surface->mirrored ? 1 : 2]};
    const vshi_vec *corner = surface->corner;
    const vshi_vec p = vshi_add(corner[0], vshi_add(vshi_scale(vshi_sub(corner[1], corner[0]), b[1]),
                                                    vshi_scale(vshi_sub(corner[2], corner[0]), b[2])));
    *position = p;
    *normal = surface->geometric;
    *lift = (vshi_vec){0.0, 0.0, 0.0};
    if (!surface->smooth) {
        return;
    }
    vshi_vec sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; ++k) {
        const vshi_vec n = surface->normal[k];
        sum = vshi_add(sum, vshi_scale(n, b[k]));
        const double below = vshi_dot(vshi_sub(p, corner[k]), n);
        if (surface->lifts[k] && below < 0.0) {
            *position = vshi_add(*position, vshi_scale(n, -b[k] * below));
        }
    }
    *lift = vshi_sub(*position, p);
    vshi_vec unit = vshi_unit(sum);
    const double cosine = vshi_dot(unit, surface->geometric);
    if (cosine < LEAST_COSINE) {
        unit = vshi_unit(vshi_add(unit, vshi_scale(surface->geometric, LEAST_COSINE - cosine)));
    }
    *normal = unit;
}

vshi_vec vshi_surface_tangent(const vsh_mesh *mesh, size_t triangle, double *handedness) {
    vshi_vec corner[3];
    uint32_t vertex[3];
    vshi_mesh_triangle_of(mesh, triangle, corner, vertex);
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) {
        u[k] = (double)mesh->uvs[2 * (size_t)vertex[k]];
        v[k] = (double)mesh->uvs[2 * (size_t)vertex[k] + 1];
    }
    const vshi_vec a = vshi_sub(corner[1], corner[0]), b = vshi_sub(corner[2], corner[0]);
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
    *handedness = area < 0.0 ? -1.0 : 1.0;
    if (area == 0.0) {
        return (vshi_vec){0.0, 0.0, 0.0};
    }
    return vshi_unit(
        vshi_scale(vshi_sub(vshi_scale(a, v[2] - v[0]), vshi_scale(b, v[1] - v[0])), *handedness));
}
