#include "mesh/mesh.h"

#include "base/floats.h"
#include "base/memory.h"

#include <float.h>
#include <stdio.h>

/* A linear part whose unit columns span less volume than this squeezes the mesh flat: what is left of its
 * third direction is rounding. */
static const double FLATTENING_VOLUME = 1e-12;

vshi_mesh_name vshi_mesh_label(const vsh_mesh *mesh, size_t index) {
    vshi_mesh_name name;
    if (mesh->name != NULL && mesh->name[0] != '\0') {
        const int written = snprintf(name.text, sizeof name.text, "mesh '%s'", mesh->name);
        if (written >= (int)sizeof name.text) {
            /* Room for "…'", without leaving half a UTF-8 character before it. */
            size_t end = sizeof name.text - 5;
            while (end > 0 && ((unsigned char)name.text[end] & 0xc0) == 0x80) {
                --end;
            }
            snprintf(name.text + end, sizeof name.text - end, "…'");
        }
    } else if (index == VSHI_MESH_ALONE) {
        snprintf(name.text, sizeof name.text, "mesh");
    } else {
        snprintf(name.text, sizeof name.text, "mesh %zu", index);
    }
    return name;
}

vsh_result vshi_mesh_check_transform(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    const double *m = mesh->transform;
    if (m == NULL) {
        return VSH_OK;
    }
    for (int i = 0; i < 12; ++i) {
        if (!isfinite(m[i])) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: transform row %d column %d is %g, expected a finite number",
                             vshi_mesh_label(mesh, index).text, i / 4, i % 4, m[i]);
        }
    }
    const vshi_vec x = vshi_unit((vshi_vec){m[0], m[4], m[8]});
    const vshi_vec y = vshi_unit((vshi_vec){m[1], m[5], m[9]});
    const vshi_vec z = vshi_unit((vshi_vec){m[2], m[6], m[10]});
    /* The determinant itself decides about mirroring, so it must not underflow or overflow either. */
    const double determinant = vshi_transform_determinant(m);
    if (!(fabs(vshi_dot(x, vshi_cross(y, z))) > FLATTENING_VOLUME) || determinant == 0.0 ||
        !isfinite(determinant)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: the transform flattens it (determinant %g)",
                         vshi_mesh_label(mesh, index).text, determinant);
    }
    return VSH_OK;
}

vsh_result vshi_mesh_check_data(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    if ((mesh->positions == NULL && mesh->vertex_count > 0) ||
        (mesh->indices == NULL && mesh->triangle_count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s are NULL", vshi_mesh_label(mesh, index).text,
                         mesh->positions == NULL && mesh->vertex_count > 0 ? "positions" : "indices");
    }
    if (mesh->vertex_count > UINT32_MAX || mesh->triangle_count > SIZE_MAX / 64) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: %zu vertices and %zu triangles, at most %u and %zu can be addressed",
                         vshi_mesh_label(mesh, index).text, mesh->vertex_count, mesh->triangle_count,
                         UINT32_MAX, SIZE_MAX / 64);
    }
    const vsh_result result = vshi_mesh_check_transform(mesh, index, error);
    if (result != VSH_OK) {
        return result;
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * v;
        const vshi_vec local = vshi_vec_off(p);
        if (!vshi_finite(local) || !vshi_finite(vshi_transform_point(mesh->transform, local))) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: vertex %zu of %zu lies at (%g, %g, %g)%s",
                             vshi_mesh_label(mesh, index).text, v, mesh->vertex_count, local.x, local.y,
                             local.z,
                             vshi_finite(local) ? ", which the transform takes beyond every number"
                                                : ", expected finite numbers");
        }
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        if (mesh->indices[i] >= mesh->vertex_count) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: triangle %zu uses vertex %u, but there are only %zu",
                             vshi_mesh_label(mesh, index).text, i / 3, mesh->indices[i], mesh->vertex_count);
        }
    }
    return VSH_OK;
}

bool vshi_mesh_degenerate(const vsh_mesh *mesh, size_t i) {
    const uint32_t *index = mesh->indices + 3 * i;
    const vshi_vec a = vshi_vec_off(mesh->positions + 3 * (size_t)index[0]);
    const vshi_vec b = vshi_vec_off(mesh->positions + 3 * (size_t)index[1]);
    const vshi_vec c = vshi_vec_off(mesh->positions + 3 * (size_t)index[2]);
    const vshi_vec normal = vshi_cross(vshi_sub(b, a), vshi_sub(c, a));
    return normal.x == 0.0 && normal.y == 0.0 && normal.z == 0.0;
}

static void grow(vsh_mesh_report *report, vshi_vec p) {
    const double at[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
        report->bounds_min[k] = at[k] < report->bounds_min[k] ? at[k] : report->bounds_min[k];
        report->bounds_max[k] = at[k] > report->bounds_max[k] ? at[k] : report->bounds_max[k];
    }
}

vsh_result vsh_mesh_check_sized(const vsh_mesh *mesh, vsh_mesh_report *report, size_t report_size,
                                vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(mesh);
    VSHI_NEEDS(report);
    vsh_result result = vshi_mesh_check_data(mesh, VSHI_MESH_ALONE, error);
    if (result != VSH_OK) {
        return result;
    }
    vsh_mesh_report found = {.bounds_min = {DBL_MAX, DBL_MAX, DBL_MAX},
                             .bounds_max = {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (vshi_mesh_degenerate(mesh, i)) {
            ++found.degenerate_triangles;
            continue;
        }
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        found.area +=
            0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        for (int k = 0; k < 3; ++k) {
            grow(&found, corner[k]);
        }
    }
    result = vshi_mesh_count_edges(mesh, &found, error);
    if (result == VSH_OK) {
        vshi_give(report, report_size, &found, sizeof found);
    }
    return result;
}
