/* What is found where a mesh is looked over. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh.h"

#include <float.h>

static void grow(vsh_mesh_report *report, vshi_vec p) {
    const double at[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
        report->bounds_min[k] = at[k] < report->bounds_min[k] ? at[k] : report->bounds_min[k];
        report->bounds_max[k] = at[k] > report->bounds_max[k] ? at[k] : report->bounds_max[k];
    }
}

vsh_result vshi_mesh_look_over(const vsh_mesh *mesh, size_t index, vsh_mesh_report *report,
                               vsh_error *error) {
    VSHI_TRY(vshi_mesh_validate(mesh, index, error));
    *report = (vsh_mesh_report){.bounds_min = {DBL_MAX, DBL_MAX, DBL_MAX},
                                .bounds_max = {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (vshi_mesh_degenerate(mesh, i)) {
            ++report->degenerate_triangles;
            continue;
        }
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        report->area +=
            0.5 * vshi_length(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
        for (int k = 0; k < 3; ++k) {
            grow(report, corner[k]);
        }
    }
    return VSH_OK;
}

vsh_result vsh_mesh_check(const vsh_mesh *mesh, vsh_mesh_report *report, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(mesh);
    VSHI_NEEDS(report);
    vsh_mesh_report found;
    VSHI_TRY(vshi_mesh_look_over(mesh, VSHI_MESH_ALONE, &found, error));
    VSHI_TRY(vshi_mesh_count_edges(mesh, &found, error));
    *report = found;
    return VSH_OK;
}
