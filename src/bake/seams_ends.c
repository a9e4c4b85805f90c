/* Ends of edges, held against each other. */
#include "bake/seams_parts.h"

#include <math.h>

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

void vshi_ends_turn(const vshi_edge_end first[2], vshi_edge_end second[2]) {
    if (!vshi_same_place(first[0].at, second[0].at)) {
        const vshi_edge_end turned = second[0];
        second[0] = second[1];
        second[1] = turned;
    }
}

bool vshi_ends_same_in_lightmap(const vshi_edge_end a[2], const vshi_edge_end b[2]) {
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

bool vshi_ends_smooth(const vshi_edge_end a[2], const vshi_edge_end b[2], double cosine) {
    bool all = true;
    for (int k = 0; k < 2; ++k) {
        all = all && vshi_dot(normal_at(&a[k]), normal_at(&b[k])) >= cosine;
    }
    return all;
}

/* What lies outside of the image is not baked. */
bool vshi_ends_inside(const vshi_edge_end a[2]) {
    const vshi_raster *raster = a[0].raster;
    bool all = true;
    for (int k = 0; k < 2; ++k) {
        all = all && a[k].x >= -SAME_PLACE && a[k].x <= raster->width + SAME_PLACE && a[k].y >= -SAME_PLACE &&
              a[k].y <= raster->height + SAME_PLACE;
    }
    return all;
}

vshi_seam vshi_seam_between(const vshi_edge_end a[2], const vshi_edge_end b[2], uint32_t *chart,
                            uint32_t first_triangle, uint32_t second_triangle) {
    return (vshi_seam){{{a[0].x, a[1].x}, {b[0].x, b[1].x}},
                       {{a[0].y, a[1].y}, {b[0].y, b[1].y}},
                       {vshi_chart_of(chart, first_triangle), vshi_chart_of(chart, second_triangle)},
                       {a[0].page, b[0].page}};
}
