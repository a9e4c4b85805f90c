#include "mesh/mesh.h"

#include "base/similarity.h"
#include "base/try.h"

#include <stdio.h>
#include <string.h>

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

bool vshi_mesh_same_transform(const double *a, const double *b) {
    return a == b || (a != NULL && b != NULL && memcmp(a, b, 12 * sizeof *a) == 0);
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
    if (vshi_transform_flattens(m)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: the transform flattens it (determinant %g)",
                         vshi_mesh_label(mesh, index).text, vshi_transform_determinant(m));
    }
    return VSH_OK;
}

/* Whether all positions are finite, and stay so in the world: by the largest, without a branch. */
static bool positions_hold(const vsh_mesh *mesh) {
    uint32_t most = 0;
    for (size_t i = 0; i < 3 * mesh->vertex_count; ++i) {
        uint32_t bits;
        memcpy(&bits, &mesh->positions[i], sizeof bits);
        bits &= 0x7fffffff; /* without the sign: they are in order of what they stand for */
        most = bits > most ? bits : most;
    }
    float farthest;
    memcpy(&farthest, &most, sizeof farthest);
    double sum = (double)farthest;
    for (int i = 0; mesh->transform != NULL && i < 12; ++i) {
        sum += fabs(mesh->transform[i]) * (i % 4 == 3 ? 1.0 : (double)farthest);
    }
    return isfinite(sum);
}

static bool indices_hold(const vsh_mesh *mesh) {
    uint32_t most = 0;
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        most = mesh->indices[i] > most ? mesh->indices[i] : most;
    }
    return mesh->triangle_count == 0 || most < mesh->vertex_count;
}

vsh_result vshi_mesh_validate(const vsh_mesh *mesh, size_t index, vsh_error *error) {
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
    VSHI_TRY(vshi_mesh_check_transform(mesh, index, error));
    const bool positions_held = positions_hold(mesh), indices_held = indices_hold(mesh);
    for (size_t v = 0; !positions_held && v < mesh->vertex_count; ++v) {
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
    for (size_t i = 0; !indices_held && i < 3 * mesh->triangle_count; ++i) {
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
