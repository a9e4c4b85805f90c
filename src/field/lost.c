/* Casters that a field does not hold: parts thinner than its voxels, of which no voxel's centre is inside.
 *
 * Where a surface is held the field is negative within a voxel of it, along the normal: so it is looked at
 * there, at places all over a mesh, each standing for as much area. A slab that is 1.25 voxels thick has a
 * voxel's centre an eighth of a voxel under its surface, wherever it lies. */
#include "base/memory.h"
#include "field/field.h"
#include "field/level.h"
#include "mesh/mesh.h"
#include "trace/embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Places that are looked at: of all meshes together, and of each at least. */
enum { PLACES = 16384, LEAST = 64, STEPS = 5 };
/* How far from the surface the field is looked at, voxels: to both sides, as faces may be turned. */
static const double DEPTH = 1.25;
/* How near to the surface rays begin that look for the other side, of that. */
static const double NEAR = 1e-4;
static const double GOLDEN = 0.61803398874989485, SILVER = 0.41421356237309515;

static double area_of(const vshi_vec corner[3]) {
    return 0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
}

/* Sum of the triangles' areas. */
static double mesh_area(const vsh_mesh *mesh) {
    double area = 0.0;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        area += vshi_mesh_degenerate(mesh, i) ? 0.0 : area_of(corner);
    }
    return area;
}

static double fraction(double x) {
    return x - floor(x);
}

/* A place of a triangle, by numbers of 0 … 1. */
static vshi_vec place_in(const vshi_vec corner[3], double u, double v) {
    const bool beyond = u + v > 1.0;
    u = beyond ? 1.0 - u : u;
    v = beyond ? 1.0 - v : v;
    return vshi_add(corner[0], vshi_add(vshi_scale(vshi_sub(corner[1], corner[0]), u),
                                        vshi_scale(vshi_sub(corner[2], corner[0]), v)));
}

static bool holds(const vsh_field *field, vshi_vec place, vshi_vec normal) {
    for (int step = -STEPS; step <= STEPS; ++step) {
        const double height = DEPTH * field->voxel_size * step / STEPS;
        const vshi_vec world = vshi_add(place, vshi_scale(normal, height));
        const vshi_vec p = vshi_to_field(field, (const double[]){world.x, world.y, world.z});
        if (vshi_field_distance(field, (const float[]){(float)p.x, (float)p.y, (float)p.z}) <= 0.0f) {
            return true;
        }
    }
    return false;
}

/* How thick a solid is under a place, world units: infinite for a sheet, which has no other side; negative
 * where it is thicker than what voxels lose, so that it is no more than an edge that they cut. */
static double thickness_at(const vsh_field *field, const vsh_triangles *triangles, vshi_vec place,
                           vshi_vec normal) {
    const double thin = DEPTH * field->voxel_size;
    double nearest = INFINITY;
    for (int side = -1; side <= 1; side += 2) {
        const vshi_vec d = vshi_scale(normal, side), from = vshi_add(place, vshi_scale(d, NEAR * thin));
        const vshi_segment_ray ray = {{from.x, from.y, from.z}, {d.x, d.y, d.z}, INFINITY};
        nearest = fmin(nearest, vshi_triangles_distance(triangles, &ray));
    }
    return nearest <= thin || isinf(nearest) ? nearest : -1.0;
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Looks at `places` places of a mesh; `thickness` has room for as many. */
static void look_at_mesh(const vsh_field *field, const vsh_mesh *mesh, double area, size_t places,
                         const vsh_triangles *triangles, double *thickness, vsh_lost *lost) {
    if (mesh->mask != NULL) { /* a sheet, which is a shell of voxels where it is opaque */
        return;
    }
    double before = 0.0;
    size_t next = 0, gone = 0, measured = 0;
    for (size_t i = 0; i < mesh->triangle_count && next < places; ++i) {
        vshi_vec corner[3];
        if (vshi_mesh_degenerate(mesh, i)) {
            continue;
        }
        vshi_mesh_triangle(mesh, i, corner);
        before += area_of(corner);
        const vshi_vec normal =
            vshi_unit(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        bool any = false;
        for (; next < places && ((double)next + 0.5) / (double)places * area <= before; ++next) {
            const vshi_vec at =
                place_in(corner, fraction((double)next * GOLDEN), fraction((double)next * SILVER));
            if (holds(field, at, normal)) {
                continue;
            }
            const double thick = triangles != NULL ? thickness_at(field, triangles, at, normal) : INFINITY;
            if (thick < 0.0) {
                continue;
            }
            any = true;
            ++gone;
            if (isfinite(thick)) {
                thickness[measured++] = thick;
            }
        }
        lost->triangles += any;
    }
    lost->share = (double)gone / (double)places;
    qsort(thickness, measured, sizeof *thickness, by_value);
    lost->thickness = measured > 0 ? thickness[measured / 10] : 0.0;
}

vsh_result vsh_field_find_lost(const vsh_field *field, const vsh_mesh *meshes, size_t mesh_count,
                               const vsh_triangles *triangles, vsh_lost *lost, vsh_error *error) {
    VSHI_NEEDS(field);
    VSHI_NEEDS_OF(mesh_count, meshes);
    VSHI_NEEDS_OF(mesh_count, lost);
    double sum = 0.0;
    for (size_t m = 0; m < mesh_count; ++m) {
        VSHI_TRY(vshi_mesh_check_data(&meshes[m], m, error));
        sum += mesh_area(&meshes[m]);
    }
    void *thickness = NULL;
    VSHI_TRY(vshi_allocate(&thickness, PLACES + LEAST, sizeof(double), "lost casters", error));
    for (size_t m = 0; m < mesh_count; ++m) {
        const double area = mesh_area(&meshes[m]);
        const size_t places = LEAST + (size_t)(sum > 0.0 ? PLACES * (area / sum) : 0.0);
        vsh_lost found = {0.0, 0.0, 0};
        if (area > 0.0) {
            look_at_mesh(field, &meshes[m], area, places, triangles, thickness, &found);
        }
        lost[m] = found;
    }
    free(thickness);
    return VSH_OK;
}
