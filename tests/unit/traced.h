/* Casters that are marched and traced: a field, and the same solids as triangles, so that a test can ask
 * every method for the same thing. */
#pragma once

#include "previews.h"
#include "shading.h"
#include "testing.h"

typedef struct caster {
    vsh_field *field;
    vshi_triangles *triangles;
} casting;

#define occluders_of_caster(c) occluders_traced((c)->field, (c)->triangles)

/* Numbers of methods. */
enum { SHADOW_METHODS = VSH_SHADOW_EXACT + 1, AO_METHODS = VSH_AO_EXACT + 1 };

/* A solid's surface: SOLID_SECTORS columns of SOLID_RINGS + 1 places. Its chords are within 3e-4 of a radius.
 */
enum { SOLID_RINGS = 65, SOLID_SECTORS = 128, SOLID_VERTICES = (SOLID_RINGS + 1) * SOLID_SECTORS };

/* Vertex `sector`, `ring` of a solid, around its centre. No vertex lies on a plane of symmetry, so that the
 * flat sides of a rounded box are quads from one vertex to the next. */
static inline void solid_vertex(const truth_solid *solid, int sector, int ring, double p[3]) {
    const double a = 2.0 * PI * (sector + 0.5) / SOLID_SECTORS;
    if (solid->shape == TRUTH_TORUS) {
        const double b = 2.0 * PI * ring / SOLID_RINGS, out = solid->radius + solid->minor_radius * cos(b);
        p[0] = out * cos(a);
        p[1] = solid->minor_radius * sin(b);
        p[2] = out * sin(a);
        return;
    }
    /* from pole to pole; the poles themselves are drawn out over the flat sides */
    const double b = ring == 0             ? -0.5 * PI
                     : ring == SOLID_RINGS ? 0.5 * PI
                                           : PI * ((ring - 0.5) / (SOLID_RINGS - 1) - 0.5);
    const double n[3] = {cos(b) * cos(a), sin(b), cos(b) * sin(a)};
    for (int axis = 0; axis < 3; ++axis) {
        const double half = solid->shape == TRUTH_BOX ? solid->half[axis] : 0.0;
        p[axis] = (n[axis] < 0.0 ? -half : half) + solid->radius * n[axis];
    }
    if (ring == 0 || ring == SOLID_RINGS) {
        p[0] = p[2] = 0.0; /* the middle of the side */
    }
}

/* The solid around its centre; arrays are the caller's to free. */
static inline vsh_mesh mesh_of_solid(const truth_solid *solid) {
    float *positions = malloc(3 * SOLID_VERTICES * sizeof *positions);
    uint32_t *indices = malloc(6 * (size_t)SOLID_RINGS * SOLID_SECTORS * sizeof *indices);
    size_t triangles = 0, vertices = 0;
    if (solid->shape == TRUTH_BOX && !(solid->radius > 0.0)) {
        const double low[3] = {-solid->half[0], -solid->half[1], -solid->half[2]};
        vsh_mesh box = box_mesh(positions, low, solid->half);
        memcpy(indices, box.indices, 36 * sizeof *indices);
        box.indices = indices;
        return box;
    }
    for (int sector = 0; sector < SOLID_SECTORS; ++sector) {
        for (int ring = 0; ring <= SOLID_RINGS; ++ring, ++vertices) {
            double p[3];
            solid_vertex(solid, sector, ring, p);
            for (size_t axis = 0; axis < 3; ++axis) {
                positions[3 * vertices + axis] = (float)p[axis];
            }
            if (ring < SOLID_RINGS) {
                const uint32_t at = (uint32_t)vertices;
                const uint32_t next =
                    (uint32_t)((sector + 1) % SOLID_SECTORS) * (SOLID_RINGS + 1) + (uint32_t)ring;
                const uint32_t both[6] = {at, at + 1, next + 1, at, next + 1, next};
                memcpy(indices + 3 * triangles, both, sizeof both);
                triangles += 2;
            }
        }
    }
    return mesh_of_arrays(NULL, positions, NULL, vertices, indices, triangles);
}

/* The scene's triangles moved by `offset`, then scaled. */
static inline vshi_triangles *triangles_of_moved(truth_scene scene, double scale, const double offset[3]) {
    vsh_mesh meshes[MAX_SOLIDS] = {{0}};
    double transforms[MAX_SOLIDS][12];
    for (size_t i = 0; i < scene.count; ++i) {
        meshes[i] = mesh_of_solid(&scene.solids[i]);
        memset(transforms[i], 0, sizeof transforms[i]);
        for (int axis = 0; axis < 3; ++axis) {
            transforms[i][5 * axis] = scale;
            transforms[i][4 * axis + 3] = scale * (scene.solids[i].center[axis] + offset[axis]);
        }
        meshes[i].transform = transforms[i];
    }
    vshi_triangles *triangles = triangles_from(meshes, scene.count);
    for (size_t i = 0; i < scene.count; ++i) {
        free((void *)(uintptr_t)meshes[i].positions);
        free((void *)(uintptr_t)meshes[i].indices);
    }
    return triangles;
}

static inline casting caster_of_moved(truth_scene scene, double voxel, double scale, const double offset[3],
                                      double reach) {
    return (casting){field_of_grid(grid_of_moved(scene, voxel, scale, offset), reach),
                     triangles_of_moved(scene, scale, offset)};
}

static inline casting caster_of(truth_scene scene, double voxel, double reach) {
    const double nowhere[3] = {0.0, 0.0, 0.0};
    return caster_of_moved(scene, voxel, 1.0, nowhere, reach);
}

static inline casting caster_of_meshes(const vsh_mesh *meshes, size_t count, double voxel, double reach) {
    return (casting){field_of_grid(grid_from_meshes(meshes, count, voxel), reach),
                     triangles_from(meshes, count)};
}

static inline void caster_free(casting *c) {
    vshi_triangles_free(c->triangles);
    vshi_field_free(c->field);
}

static inline vsh_shade_stats cast_shadows(const casting *c, const vsh_light *light, int32_t method,
                                           size_t count, const double *positions, const float *normals,
                                           float *visible) {
    return shadows_by(occluders_of_caster(c), light, method, count, positions, normals, visible);
}

static inline float cast_shadow_at(const casting *c, const vsh_light *light, int32_t method,
                                   const double *position, const float *normal) {
    float visible = -1.0f;
    cast_shadows(c, light, method, 1, position, normal, &visible);
    return visible;
}

static inline vsh_shade_stats cast_ao(const casting *c, int32_t method, double distance, size_t count,
                                      const double *positions, const float *normals, float *open) {
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    options.ao_distance = distance;
    const vsh_points points = {count, positions, normals, NULL};
    return shade_ao_points(occluders_of_caster(c), &points, &options, NULL, open, NULL);
}

static inline float cast_ao_at(const casting *c, int32_t method, double distance, const double *position,
                               const float *normal) {
    float open = -1.0f;
    cast_ao(c, method, distance, 1, position, normal, &open);
    return open;
}

/* --- shadows and AO by every method, one kind of value after the other */

/* Shadow methods by their numbers, then those of AO. */
enum { KINDS = SHADOW_METHODS + AO_METHODS };

static inline bool is_ao(int kind) {
    return kind >= SHADOW_METHODS;
}

/* Values that few rays make: they may change by a whole ray where an edge moves by a rounding. */
static inline bool by_rays(int kind) {
    return is_ao(kind) ? kind >= SHADOW_METHODS + VSH_AO_RAYS : kind >= VSH_SHADOW_RAYS;
}

static inline const char *name_of(int kind) {
    static char name[32];
    snprintf(name, sizeof name, "%s %s", is_ao(kind) ? "AO" : "shadow",
             is_ao(kind) ? vsh_get_name(VSH_NAMES_AO, kind - SHADOW_METHODS)
                         : vsh_get_name(VSH_NAMES_SHADOW, kind));
    return name;
}

static inline vsh_shade_stats cast_kind(const casting *c, int kind, const vsh_light *light,
                                        double ao_distance, size_t count, const double *at,
                                        const float *facing, float *values) {
    return is_ao(kind) ? cast_ao(c, kind - SHADOW_METHODS, ao_distance, count, at, facing, values)
                       : cast_shadows(c, light, kind, count, at, facing, values);
}

static inline float cast_kind_at(const casting *c, int kind, const vsh_light *light, double ao_distance,
                                 const double *at, const float *facing) {
    float value = -1.0f;
    cast_kind(c, kind, light, ao_distance, 1, at, facing, &value);
    return value;
}

/* With options of the test's own, but for the method. */
static inline void shade_kind(const casting *c, int kind, const vsh_light *light, vsh_shade_options options,
                              const vsh_points *points, float *values) {
    if (is_ao(kind)) {
        options.ao_method = kind - SHADOW_METHODS;
        shade_ao_points(occluders_of_caster(c), points, &options, NULL, values, NULL);
    } else {
        options.method = kind;
        shade_points(occluders_of_caster(c), points, light, &options, NULL, values, NULL);
    }
}
