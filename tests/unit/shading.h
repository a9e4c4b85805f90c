/* Short ways to ask for shadows and AO, for their tests. */
#pragma once

#include "casts.h"
#include "fields.h"
#include "previews.h"
#include "testing.h"

#include "field/field.h"

#define PI 3.14159265358979323846
#define RADIANS(degrees) ((degrees)*PI / 180.0)

static inline vsh_light sun(const double towards[3], double angle) {
    vsh_light light = vsh_light_default();
    memcpy(light.direction, towards, sizeof light.direction);
    light.angle = angle;
    return light;
}

static inline vsh_light lamp(const double position[3], double radius) {
    vsh_light light = vsh_light_default();
    light.type = VSH_LIGHT_SPHERE;
    memcpy(light.position, position, sizeof light.position);
    light.radius = radius;
    strcpy(light.name, "lamp");
    return light;
}

static inline vsh_shade_stats shade_points(const vsh_occluders *occluders, const vsh_points *points,
                                           const vsh_light *light, const vsh_shade_options *options,
                                           const vsh_run *run, float *values, float *deviation) {
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_shadow(occluders, points, light, options, run, values, deviation, &stats, &failure));
    return stats;
}

static inline vsh_shade_stats shade_ao_points(const vsh_occluders *occluders, const vsh_points *points,
                                              const vsh_shade_options *options, const vsh_run *run,
                                              float *values, float *deviation) {
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_ao(occluders, points, options, run, values, deviation, NULL, &stats, &failure));
    return stats;
}

/* Puts point i at (x, y, z), with its normal up. */
static inline void put_point(double *positions, float *normals, size_t i, double x, double y, double z) {
    memcpy(positions + 3 * i, (const double[]){x, y, z}, sizeof(double[3]));
    memcpy(normals + 3 * i, (const float[]){0.0f, 1.0f, 0.0f}, sizeof(float[3]));
}

/* Puts side × side points over [-half, half]² at a height. */
static inline void put_square(size_t side, double half, double height, double *positions, float *normals) {
    for (size_t i = 0; i < side * side; ++i) {
        const double x = ((double)(i % side) + 0.5) / (double)side,
                     z = ((double)(i / side) + 0.5) / (double)side;
        put_point(positions, normals, i, half * (2.0 * x - 1.0), height, half * (2.0 * z - 1.0));
    }
}

static inline vsh_query *query_of(const vsh_occluders *occluders, const vsh_light *lights, size_t count,
                                  const vsh_shade_options *options) {
    vsh_query *query = NULL;
    assert_ok(vsh_query_create(occluders, lights, count, options, &query, &failure));
    return query;
}

static inline vsh_shade_stats shadows_by(const vsh_occluders *occluders, const vsh_light *light,
                                         int32_t method, size_t count, const double *positions,
                                         const float *normals, float *visible) {
    vsh_shade_options options = preview_options();
    options.method = method;
    const vsh_points points = {count, positions, normals, NULL};
    return shade_points(occluders, &points, light, &options, NULL, visible, NULL);
}

static inline vsh_shade_stats shadows(const vsh_field *field, const vsh_light *light, int32_t method,
                                      size_t count, const double *positions, const float *normals,
                                      float *visible) {
    return shadows_by(occluders_of(field), light, method, count, positions, normals, visible);
}

static inline float shadow_at(const vsh_field *field, const vsh_light *light, int32_t method,
                              const double *position, const float *normal) {
    float visible = -1.0f;
    shadows(field, light, method, 1, position, normal, &visible);
    return visible;
}

/* A field in which nothing casts. */
static inline vsh_field *field_of_nothing(double voxel) {
    vsh_field *field = NULL;
    assert_ok(vshi_field_create_empty(voxel, &field, &failure));
    return field;
}

/* Unit direction `elevation` over the x, z plane at `azimuth`, radians. */
static inline void direction_at(double elevation, double azimuth, double direction[3]) {
    direction[0] = cos(elevation) * cos(azimuth);
    direction[1] = sin(elevation);
    direction[2] = cos(elevation) * sin(azimuth);
}

static inline void random_direction(uint64_t *counter, double direction[3]) {
    const double z = between(counter, -1.0, 1.0), angle = between(counter, 0.0, 2.0 * PI);
    direction[0] = sqrt(1.0 - z * z) * cos(angle);
    direction[1] = sqrt(1.0 - z * z) * sin(angle);
    direction[2] = z;
}

/* Receivers on the seeds' floor: `size` × `size` of its 512² texels, evenly spaced, with normals up. */
static inline void floor_texels(size_t size, double *positions, float *normals) {
    const size_t stride = 512 / size;
    for (size_t row = 0; row < size; ++row) {
        for (size_t column = 0; column < size; ++column) {
            put_point(positions, normals, row * size + column,
                      -2.5 + 5.0 * ((double)(column * stride) + 0.5) / 512.0, 0.001,
                      -2.5 + 5.0 * ((double)(row * stride) + 0.5) / 512.0);
        }
    }
}

/* Receivers like floor_texels(), but every third one lies in the air or inside a solid, and its normal points
 * anywhere. */
static inline void scattered_texels(size_t size, uint64_t counter, double *positions, float *normals) {
    floor_texels(size, positions, normals);
    for (size_t i = 0; i < size * size; i += 3) {
        double n[3];
        random_direction(&counter, n);
        for (size_t axis = 0; axis < 3; ++axis) {
            positions[3 * i + axis] = axis == 1 ? between(&counter, -1.0, 3.0) : between(&counter, -4.0, 4.0);
            normals[3 * i + axis] = (float)n[axis];
        }
    }
}

/* A room of half size 1 in a box with walls of a given thickness. */
static inline vsh_field *hollow_box(double voxel, double wall) {
    vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
    nodes[0].shape = nodes[1].shape = VSH_SDF_BOX;
    nodes[0].size[0] = nodes[0].size[1] = nodes[0].size[2] = 1.0 + wall;
    nodes[2].shape = VSH_SDF_SUBTRACTION;
    nodes[2].left = 0;
    nodes[2].right = 1;
    return field_of_grid(grid_of_tree(nodes, 3, with_voxel(voxel)), 0.0);
}
