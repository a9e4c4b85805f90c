/* Handles and meshes made in one call, with default options. A test fails if one cannot be made. */
#pragma once

#include "testing.h"

/* Lets type_info(object) return what type_get_info() fills. */
#define INFO(type, name)                                                                                     \
    static inline type##_info name(const type *object) {                                                     \
        type##_info info;                                                                                    \
        type##_get_info(object, &info);                                                                      \
        return info;                                                                                         \
    }

INFO(vsh_field, field_info)
INFO(vsh_grid, grid_info)
INFO(vsh_occluders, occluders_info)
INFO(vsh_volume, volume_info)
INFO(vsh_voxels, voxels_info)

/* The square [-1, 1]² at y = 0, facing up; u runs along x, v along -z. `uvs` NULL: all of the lightmap. */
static inline vsh_mesh floor_mesh(const float *uvs) {
    static const float corners[12] = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1};
    return quad_mesh("floor", corners, uvs != NULL ? uvs : QUAD_UVS);
}

/* A plate of 2 × 2, 0.2 thick, whose top is at y = 1. */
static inline vsh_mesh plate_mesh(void) {
    static float corners[24];
    return box_mesh(corners, (const double[]){-1.0, 0.8, -1.0}, (const double[]){1.0, 1.0, 1.0});
}

/* --- level sets */

static inline vsh_sdf_node box_node(double half_x, double half_y, double half_z) {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.shape = VSH_SDF_BOX;
    memcpy(node.size, (const double[3]){half_x, half_y, half_z}, sizeof node.size);
    return node;
}

/* VSH_SDF_UNION or another operation on two nodes of a tree. */
static inline vsh_sdf_node operation_node(int32_t operation, int32_t left, int32_t right) {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.shape = operation;
    node.left = left;
    node.right = right;
    return node;
}

static inline vsh_grid *grid_from_sdf(const vsh_sdf *sdf, double voxel) {
    return grid_of_tree(sdf->nodes, sdf->node_count, with_voxel(voxel));
}

static inline vsh_grid *grid_from_distance(const vsh_distance *distance, double voxel) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_distance(distance, &options, NULL, &grid, &failure));
    return grid;
}

static inline vsh_grid *grid_from_meshes(const vsh_mesh *meshes, size_t count, double voxel) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(meshes, count, &options, NULL, &grid, &failure));
    return grid;
}

/* Frees the grid. Reach 0: the default one. */
static inline vsh_field *field_of_grid(vsh_grid *grid, double reach) {
    vshi_field_options options = vshi_field_options_default();
    options.reach = reach;
    vsh_field *field = NULL;
    assert_ok(vshi_field_create(grid, &options, NULL, &field, &failure));
    vsh_grid_free(grid);
    return field;
}

static inline float distance_at(const vsh_field *field, const double position[3]) {
    float distance = NAN;
    vsh_field_sample(field, 1, position, &distance);
    return distance;
}

/* --- triangles and their texels */

static inline vshi_triangles *triangles_from(const vsh_mesh *meshes, size_t count) {
    const vsh_run run = vsh_run_default();
    vshi_triangles *triangles = NULL;
    assert_ok(vshi_triangles_create(meshes, count, NULL, &run, &triangles, &failure));
    return triangles;
}

static inline vsh_occluders *occluders_from_triangles(const vshi_triangles *triangles) {
    vshi_occluder_parts parts = {.field = NULL};
    vsh_occluders *occluders = NULL;
    parts.triangles = triangles;
    assert_ok(vshi_occluders_make(&parts, NULL, &occluders, &failure));
    return occluders;
}

static inline vsh_charts *charts_from(const vsh_mesh *meshes, size_t count,
                                      const vsh_lightmap_options *options) {
    vsh_charts *charts = NULL;
    assert_ok(vsh_charts_create(meshes, count, options, NULL, NULL, &charts, &failure));
    return charts;
}

/* The samples of all texels, tile by tile. */
typedef struct texel_list {
    vshi_samples all;
} texel_list;

typedef struct texel_samples {
    size_t count;
    const double *positions;        /* lifted off coarse triangles towards the smooth surface */
    const float *normals;           /* smooth where the mesh is */
    const float *geometric_normals; /* of the triangles */
    const uint32_t *texels;         /* each vsh_texel() */
} texel_samples;

static inline void texel_list_free(texel_list *list) {
    if (list != NULL) {
        vshi_samples_free(&list->all);
        free(list);
    }
}
OWNER(texel_list)

static inline void add_samples(void *user, const vshi_samples *samples) {
    vshi_samples *all = user;
    memcpy(all->position + 3 * all->count, samples->position, 3 * samples->count * sizeof(double));
    memcpy(all->normal + 3 * all->count, samples->normal, 3 * samples->count * sizeof(float));
    memcpy(all->geometric + 3 * all->count, samples->geometric, 3 * samples->count * sizeof(float));
    memcpy(all->lift + 3 * all->count, samples->lift, 3 * samples->count * sizeof(float));
    memcpy(all->texel + all->count, samples->texel, samples->count * sizeof(uint32_t));
    memcpy(all->mesh + all->count, samples->mesh, samples->count * sizeof(uint32_t));
    all->count += samples->count;
}

static inline texel_list *texels_from(const vsh_charts *charts) {
    texel_list *list = calloc(1, sizeof *list);
    assert_ok(vshi_samples_allocate(&list->all, (size_t)charts->info.samples, false, &failure));
    for (size_t tile = 0; tile < vshi_charts_tiles(&charts->sorted); ++tile) {
        assert_ok(vshi_tile_visit(charts, tile, false, add_samples, &list->all, &failure));
    }
    assert_int_equal(list->all.count, charts->info.samples);
    return list;
}

static inline texel_samples samples_of(const texel_list *list) {
    const vshi_samples *s = &list->all;
    return (texel_samples){s->count, s->position, s->normal, s->geometric, s->texel};
}

/* --- files */

static inline vsh_image_file *image_from(const char *path) {
    vsh_image_file *file = NULL;
    assert_ok(vsh_image_read(path, NULL, &file, &failure));
    return file;
}

static inline vsh_model *model_from(const char *path) {
    vsh_model *model = NULL;
    assert_ok(vsh_model_read(path, NULL, &model, &failure));
    return model;
}
