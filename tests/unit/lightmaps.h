/* Lightmaps of a floor, with a wall on it or without, for tests. */
#ifndef TESTS_LIGHTMAPS_H
#define TESTS_LIGHTMAPS_H

#include "casts.h"
#include "previews.h"
#include "testing.h"

enum { SIZE = 64, TEXELS = SIZE * SIZE };

static const double VOXEL = 0.04;
static const double WALL = 0.2; /* half its thickness */

static const uint32_t QUAD_INDICES[6] = {0, 1, 2, 0, 2, 3};

/* The floor y = 0 over [-1, 1]², facing up; u runs along x, v along -z. */
static const float FLOOR_POSITIONS[12] = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1};
static const float QUAD_UVS[8] = {0, 0, 1, 0, 1, 1, 0, 1};

static inline vsh_mesh floor_mesh(void) {
    return (vsh_mesh){.name = "floor",
                      .positions = FLOOR_POSITIONS,
                      .uvs = QUAD_UVS,
                      .indices = QUAD_INDICES,
                      .vertex_count = 4,
                      .triangle_count = 2};
}

static inline double texel_x(uint32_t texel) {
    return -1.0 + 2.0 * (texel % SIZE + 0.5) / SIZE;
}

/* A slab under y = 0 and, where `wall` is not zero, a wall |x| < WALL of height 1 across all of it. */
static inline vsh_field *floor_field(int wall) {
    vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
    nodes[0].shape = VSH_SDF_BOX;
    nodes[0].size[0] = nodes[0].size[2] = 1.5;
    nodes[0].size[1] = 0.25;
    nodes[0].translation[1] = -0.25;
    nodes[0].rounding = 0.0;
    nodes[1] = nodes[0];
    nodes[1].size[0] = WALL;
    nodes[1].size[1] = 0.5;
    nodes[1].translation[1] = 0.5;
    nodes[2].shape = VSH_SDF_UNION;
    nodes[2].left = 0;
    nodes[2].right = 1;
    const vsh_sdf sdf = {nodes, wall ? 3 : 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = VOXEL;
    OWNED(vsh_grid) *grid = NULL;
    vsh_field *field = NULL;
    assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure));
    assert_ok(vsh_field_create(grid, NULL, NULL, &field, &failure));
    return field;
}

static inline vsh_field *field_of_mesh(const vsh_mesh *mesh, double voxel) {
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    OWNED(vsh_grid) *grid = NULL;
    vsh_field *field = NULL;
    assert_ok(vsh_grid_from_meshes(mesh, 1, &options, NULL, &grid, &failure));
    assert_ok(vsh_field_create(grid, NULL, NULL, &field, &failure));
    return field;
}

static inline vsh_charts *make_texels(const vsh_mesh *meshes, size_t count, int32_t size, int32_t supersample,
                                      int32_t padding) {
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = size;
    options.supersample = supersample;
    options.padding = padding;
    vsh_charts *charts = NULL;
    assert_ok(vsh_charts_create(meshes, count, &options, NULL, NULL, &charts, &failure));
    return charts;
}

static inline vsh_light sun(double x, double y, double z, double angle) {
    vsh_light light = vsh_light_default();
    light.direction[0] = x;
    light.direction[1] = y;
    light.direction[2] = z;
    light.angle = angle;
    return light;
}

/* Planes of one light, AO, irradiance and coverage. */
typedef struct planes {
    float shadow[TEXELS], ao[TEXELS], irradiance[3 * TEXELS], coverage[TEXELS];
    float *lights[1];
    vsh_lightmap all;
} planes;

static inline planes *new_planes(void) {
    planes *p = malloc(sizeof *p);
    memset(p, 0xff, sizeof *p); /* NaN: whatever is not written shows */
    p->lights[0] = p->shadow;
    p->all = (vsh_lightmap){
        .shadow = p->lights, .ao = p->ao, .irradiance = p->irradiance, .coverage = p->coverage};
    return p;
}

static inline void bake(const vsh_field *field, const vsh_charts *charts, const vsh_light *light,
                        const vsh_lightmap *lightmap, vsh_bake_stats *stats, int32_t threads) {
    vsh_run run = run_on(threads);
    assert_ok(vsh_bake_lightmap(occluders_of(field), charts, light, light != NULL ? 1 : 0, NULL, &run,
                                lightmap, stats, &failure));
}

#endif
