/* Two edges of equal ends in the world, compared. */
#include "bake/seams_search.h"

#include "base/memory.h"
#include "mesh/weld.h"

#include <math.h>
#include <stdlib.h>

/* How far apart the ends of an edge may be for two triangles to be of one chart, texels: what is rounded when
 * a file is written. A seam as narrow would be read at the same place on both sides. */
static const double SAME_PLACE = 1.0 / 1024.0;

void vshi_edge_look_at(const vshi_seam_pages *pages, uint32_t edge, vshi_edge_end ends[2]) {
    size_t local;
    const vsh_mesh *mesh = vshi_edge_mesh(pages, edge, &local);
    const size_t page = vshi_seam_page(pages, edge / 3);
    const vshi_raster *raster = &pages->charts[page]->raster;
    const uint32_t *corner = mesh->indices + 3 * local;
    for (uint32_t k = 0; k < 2; ++k) {
        const uint32_t vertex = corner[(edge % 3 + k) % 3];
        const float *uv = mesh->uvs + 2 * (size_t)vertex;
        ends[k] = (vshi_edge_end){.mesh = mesh,
                                  .raster = raster,
                                  .triangle = local,
                                  .page = (uint32_t)page,
                                  .vertex = {corner[edge % 3], corner[(edge % 3 + 1) % 3]},
                                  .t = k,
                                  .at = vshi_edge_place(mesh, vertex),
                                  .x = (double)uv[0] * raster->width,
                                  .y = (1.0 - (double)uv[1]) * raster->height};
    }
}

static bool are_same_in_lightmap(const vshi_edge_end a[2], const vshi_edge_end b[2]) {
    bool all = a[0].page == b[0].page;
    for (int k = 0; k < 2; ++k) {
        all = all && fabs(a[k].x - b[k].x) <= SAME_PLACE && fabs(a[k].y - b[k].y) <= SAME_PLACE;
    }
    return all;
}

static vshi_vec normal_of(const vsh_mesh *mesh, uint32_t vertex) {
    const vshi_vec given = vshi_vec_off(mesh->normals + 3 * (size_t)vertex);
    return vshi_unit(vshi_transform_normal(mesh->transform, given));
}

static vshi_vec normal_at(const vshi_edge_end *end) {
    const vsh_mesh *mesh = end->mesh;
    vshi_vec normal = {0.0, 0.0, 0.0}, corner[3];
    if (mesh->normals != NULL && (end->t == 0.0 || end->t == 1.0)) {
        normal = normal_of(mesh, end->vertex[end->t == 1.0]);
    } else if (mesh->normals != NULL) {
        normal = vshi_unit(vshi_add(vshi_scale(normal_of(mesh, end->vertex[0]), 1.0 - end->t),
                                    vshi_scale(normal_of(mesh, end->vertex[1]), end->t)));
    }
    if (!(vshi_dot(normal, normal) > 0.0)) {
        vshi_mesh_triangle(mesh, end->triangle, corner);
        normal = vshi_unit(vshi_cross(vshi_sub(corner[1], corner[0]), vshi_sub(corner[2], corner[0])));
    }
    return normal;
}

static bool are_smooth(const vshi_edge_end a[2], const vshi_edge_end b[2], double cosine) {
    bool all = true;
    for (int k = 0; k < 2; ++k) {
        all = all && vshi_dot(normal_at(&a[k]), normal_at(&b[k])) >= cosine;
    }
    return all;
}

/* What lies outside of the image is not baked. */
static bool are_inside(const vshi_edge_end a[2]) {
    const vshi_raster *raster = a[0].raster;
    bool all = true;
    for (int k = 0; k < 2; ++k) {
        all = all && a[k].x >= -SAME_PLACE && a[k].x <= raster->width + SAME_PLACE && a[k].y >= -SAME_PLACE &&
              a[k].y <= raster->height + SAME_PLACE;
    }
    return all;
}

static vsh_result add_seam(vshi_seam_search *search, const vshi_seam *seam, vsh_error *error) {
    vshi_seams *seams = search->seams;
    if (seams->count == search->room) {
        search->room = 2 * search->room + 64;
        const size_t bytes = search->room * sizeof *seams->list;
        VSHI_TRY(vshi_check_limit(search->run, search->held + (double)bytes, "seams", error));
        vshi_seam *grown = realloc(seams->list, bytes);
        if (grown == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "seams: the system refused memory");
        }
        seams->list = grown;
    }
    seams->list[seams->count++] = *seam;
    return VSH_OK;
}

vsh_result vshi_seam_compare(vshi_seam_search *search, const uint32_t edge[2], const vshi_edge_end a[2],
                             const vshi_edge_end b[2], bool *goes_on, vsh_error *error) {
    const bool turned = !vshi_same_place(a[0].at, b[0].at);
    const vshi_edge_end second[2] = {b[turned], b[!turned]};
    const bool one_chart = are_same_in_lightmap(a, second);
    *goes_on = one_chart || are_smooth(a, second, search->cosine);
    if (one_chart) {
        vshi_set_join(search->seams->chart, edge[0] / 3, edge[1] / 3);
    } else if (*goes_on && are_inside(a) && are_inside(second)) {
        const vshi_seam seam = {{{a[0].x, a[1].x}, {second[0].x, second[1].x}},
                                {{a[0].y, a[1].y}, {second[0].y, second[1].y}},
                                {edge[0] / 3, edge[1] / 3},
                                {a[0].page, second[0].page}};
        return add_seam(search, &seam, error);
    }
    return VSH_OK;
}
