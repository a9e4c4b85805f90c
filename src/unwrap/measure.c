/* How dense and how stretched a mesh's UVs are. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"

#include <math.h>
#include <vdbshade/unwrap.h>

/* Sums over triangles that have area in the world and in the UVs. */
typedef struct sums {
    double area;   /* in the world */
    double flat;   /* in texels */
    double square; /* of the L2 stretch of each, times its area */
} sums;

/* Squared L2 stretch of a triangle (Sander and others, "Texture mapping progressive meshes", 2001): half the
 * sum of the squared lengths of what a unit along u and along v becomes. */
static double square_stretch(const vshi_vec p[3], const double uv[3][2], double doubled) {
    vshi_vec along[2];
    for (int k = 0; k < 2; ++k) { /* derivatives by texel */
        const int other = 1 - k;
        const double sign = k == 0 ? 1.0 : -1.0;
        along[k] = (vshi_vec){0.0, 0.0, 0.0};
        for (int c = 0; c < 3; ++c) {
            const double weight = sign * (uv[(c + 1) % 3][other] - uv[(c + 2) % 3][other]) / doubled;
            along[k] = vshi_add(along[k], vshi_scale(p[c], weight));
        }
    }
    return 0.5 * (vshi_dot(along[0], along[0]) + vshi_dot(along[1], along[1]));
}

static void add_triangle(const vsh_mesh *mesh, size_t triangle, const double size[2], sums *s) {
    vshi_vec p[3];
    double uv[3][2];
    vshi_mesh_triangle(mesh, triangle, p);
    for (size_t c = 0; c < 3; ++c) {
        const float *at = mesh->uvs + 2 * (size_t)mesh->indices[3 * triangle + c];
        uv[c][0] = (double)at[0] * size[0];
        uv[c][1] = (double)at[1] * size[1];
    }
    const double area = 0.5 * vshi_length(vshi_cross(vshi_sub(p[1], p[0]), vshi_sub(p[2], p[0])));
    const double doubled =
        (uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) - (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]);
    const double square = square_stretch(p, (const double(*)[2])uv, doubled);
    if (area > 0.0 && isfinite(square)) {
        s->area += area;
        s->flat += 0.5 * fabs(doubled);
        s->square += area * square;
    }
}

vsh_result vsh_uvs_measure(const vsh_mesh *mesh, int32_t width, int32_t height, vsh_uvs_measures *measures,
                           vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(mesh);
    VSHI_NEEDS(measures);
    if (width < 1 || height < 1 || width > VSH_MAX_PAGE_SIZE || height > VSH_MAX_PAGE_SIZE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "UVs measured at %d × %d: expected 1 … %d", width, height,
                         VSH_MAX_PAGE_SIZE);
    }
    VSHI_TRY(vshi_mesh_check_data(mesh, VSHI_MESH_ALONE, error));
    vsh_uvs_measures found = {0.0, 0.0};
    if (mesh->uvs != NULL) {
        const double size[2] = {width, height};
        sums s = {0.0, 0.0, 0.0};
        for (size_t i = 0; i < mesh->triangle_count; ++i) {
            add_triangle(mesh, i, size, &s);
        }
        if (s.area > 0.0) {
            found.texels_per_unit = sqrt(s.flat / s.area);
            found.stretch = sqrt(s.square / s.area) * found.texels_per_unit;
        }
    }
    *measures = found;
    return VSH_OK;
}
