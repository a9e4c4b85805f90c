/* Geometries of an Embree scene that need code of ours: triangles that let rays pass (masks and one-sided
 * faces) and procedural solids. */
#include "trace/embree_scene.h"

#include "base/floats.h"
#include "base/memory.h"
#include "geometry/mesh.h"
#include "trace/solids.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- triangles that let rays pass */

static vshi_vec vertex(const vshi_sieve *sieve, uint32_t number) {
    return vshi_vec_off(sieve->vertices + 3 * (size_t)number);
}

/* Whether a ray passes through a triangle that it meets. Computes the hit in double from the ray and the
 * triangle alone (Möller and Trumbore, "Fast, minimum storage ray-triangle intersection", 1997): Embree's own
 * hit depends on the packet's size. */
static bool passes(const vshi_sieve *sieve, uint32_t triangle, vshi_vec origin, vshi_vec direction) {
    const uint32_t *corners = sieve->corners + 3 * (size_t)triangle;
    const vshi_vec a = vertex(sieve, corners[0]);
    const vshi_vec ab = vshi_sub(vertex(sieve, corners[1]), a);
    const vshi_vec ac = vshi_sub(vertex(sieve, corners[2]), a);
    if (sieve->one_sided) {
        /* the ray goes towards the light */
        const double along = vshi_dot(vshi_cross(ab, ac), direction);
        if (sieve->mirrored ? along > 0.0 : along < 0.0) {
            return true;
        }
    }
    if (sieve->places == NULL) {
        return false;
    }
    const vshi_vec across = vshi_cross(direction, ac), off = vshi_sub(origin, a);
    const double determinant = vshi_dot(ab, across);
    if (determinant == 0.0) {
        return false;
    }
    const double u = vshi_dot(off, across) / determinant;
    const double v = vshi_dot(direction, vshi_cross(off, ab)) / determinant, w = 1.0 - u - v;
    const vshi_mask_place *p = sieve->places + 3 * (size_t)triangle;
    const vshi_mask_place at = {w * p[0].x + u * p[1].x + v * p[2].x, w * p[0].y + u * p[1].y + v * p[2].y};
    return !vshi_alpha_mask_opaque(&sieve->mask, at);
}

/* An Embree filter. Contexts with their own filter search solids, and meet triangles as they are. */
static void filter_by_sieve(const struct RTCFilterFunctionNArguments *args) {
    const vshi_sieve *sieve = args->geometryUserPtr;
    if (args->context->filter != NULL) {
        return;
    }
    const size_t n = args->N;
    const unsigned *hit = (const unsigned *)args->hit;
    for (size_t i = 0; i < n; ++i) {
        if (args->valid[i] != -1) {
            continue;
        }
        if (passes(sieve, hit[VSHI_HIT_TRIANGLE * n + i],
                   vshi_packet_vector(args->ray, VSHI_RAY_ORIGIN, n, i),
                   vshi_packet_vector(args->ray, VSHI_RAY_DIRECTION, n, i))) {
            args->valid[i] = 0;
        }
    }
}

/* Copies a mask's texels, once for all masks that share them. */
static vsh_result copy_texels(vshi_triangles *triangles, const vsh_alpha_mask *mask, const vsh_run *run,
                              double held, const uint8_t **alpha, vsh_error *error) {
    const size_t texels = (size_t)mask->width * (size_t)mask->height;
    for (size_t i = triangles->texture_count; i-- > 0;) {
        const vshi_texture *known = &triangles->textures[i];
        if (known->of == mask->alpha && known->texels == texels) {
            *alpha = known->alpha;
            return VSH_OK;
        }
    }
    VSHI_TRY(
        vshi_check_limit(run, held + (double)triangles->sieve_bytes + (double)texels, "alpha masks", error));
    vshi_texture *texture = &triangles->textures[triangles->texture_count];
    VSHI_TRY(vshi_allocate((void **)&texture->alpha, texels, 1, "alpha masks", error));
    memcpy(texture->alpha, mask->alpha, texels);
    texture->of = mask->alpha;
    texture->texels = texels;
    ++triangles->texture_count;
    triangles->sieve_bytes += texels;
    *alpha = texture->alpha;
    return VSH_OK;
}

static vsh_result copy_mask(vshi_triangles *triangles, const vsh_mesh *mesh, vshi_sieve *sieve,
                            const vsh_run *run, double held, vsh_error *error) {
    const size_t corners = 3 * mesh->triangle_count;
    triangles->sieve_bytes += corners * sizeof *sieve->places;
    VSHI_TRY(vshi_check_limit(run, held + (double)triangles->sieve_bytes, "alpha masks", error));
    VSHI_TRY(vshi_allocate((void **)&sieve->places, corners, sizeof *sieve->places, "alpha masks", error));
    sieve->mask = *mesh->mask;
    VSHI_TRY(copy_texels(triangles, mesh->mask, run, held, &sieve->mask.alpha, error));
    vshi_mask_place *to = sieve->places;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        for (size_t k = 0; k < 3 && !vshi_mesh_degenerate(mesh, i); ++k) {
            *to++ = vshi_alpha_mask_place(mesh->mask, mesh->mask_uvs + 2 * (size_t)mesh->indices[3 * i + k]);
        }
    }
    return VSH_OK;
}

vsh_result vshi_sieves_create(vshi_triangles *triangles, const vsh_mesh *meshes, size_t count,
                              const vsh_run *run, double held, vsh_error *error) {
    size_t masks = 0;
    bool any = false;
    for (size_t m = 0; m < count; ++m) {
        masks += meshes[m].mask != NULL;
        any = any || meshes[m].mask != NULL || meshes[m].one_sided != 0;
    }
    if (!any) {
        return VSH_OK;
    }
    const vshi_array arrays[] = {VSHI_ARRAY(triangles->sieves, count),
                                 VSHI_ARRAY(triangles->textures, masks)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "alpha masks", error));
    triangles->sieve_count = count;
    triangles->sieve_bytes = count * sizeof *triangles->sieves + masks * sizeof *triangles->textures;
    for (size_t m = 0; m < count; ++m) {
        vshi_sieve *sieve = &triangles->sieves[m];
        sieve->one_sided = meshes[m].one_sided != 0;
        sieve->mirrored = vshi_transform_determinant(meshes[m].transform) < 0.0;
        if (meshes[m].mask != NULL && meshes[m].triangle_count > 0) {
            VSHI_TRY(copy_mask(triangles, &meshes[m], sieve, run, held, error));
        }
    }
    return VSH_OK;
}

void vshi_sieves_free(vshi_triangles *triangles) {
    for (size_t i = 0; i < triangles->texture_count; ++i) {
        free(triangles->textures[i].alpha);
    }
    for (size_t m = 0; m < triangles->sieve_count; ++m) {
        free(triangles->sieves[m].places);
    }
    free(triangles->textures);
    free(triangles->sieves);
}

void vshi_sieve_attach(const vshi_triangles *triangles, size_t mesh, RTCGeometry geometry,
                       const float *vertices, const uint32_t *corners) {
    vshi_sieve *sieve = triangles->sieves != NULL ? &triangles->sieves[mesh] : NULL;
    if (sieve != NULL && (sieve->places != NULL || sieve->one_sided)) {
        sieve->vertices = vertices;
        sieve->corners = corners;
        triangles->embree->rtcSetGeometryUserData(geometry, sieve);
        triangles->embree->rtcSetGeometryIntersectFilterFunction(geometry, filter_by_sieve);
        triangles->embree->rtcSetGeometryOccludedFilterFunction(geometry, filter_by_sieve);
    }
}

/* --- solids: one geometry, whose primitives are the parts of their union. Rays meet them by sphere tracing,
 * at world coordinates in double precision. */

/* Rounding of floats moves a box by less than this part of the scene's size. */
static const double MARGIN = 0x1p-20;

static void find_part_bounds(const struct RTCBoundsFunctionArguments *args) {
    VSHI_FLOATS;
    const vshi_triangles *triangles = args->geometryUserPtr;
    double low[3], high[3];
    float lowest[3], highest[3];
    vshi_solids_part_box(triangles->solids, args->primID, low, high);
    for (int axis = 0; axis < 3; ++axis) {
        lowest[axis] = (float)((low[axis] - triangles->centre[axis]) * triangles->scale - MARGIN);
        highest[axis] = (float)((high[axis] - triangles->centre[axis]) * triangles->scale + MARGIN);
    }
    *args->bounds_o = (struct RTCBounds){.lower_x = lowest[0],
                                         .lower_y = lowest[1],
                                         .lower_z = lowest[2],
                                         .upper_x = highest[0],
                                         .upper_y = highest[1],
                                         .upper_z = highest[2]};
}

/* The distance at which lane i's ray meets a part, the scene's units; infinite if it does not. */
static float meet_part(const vshi_triangles *triangles, unsigned part, const float *ray, size_t n, size_t i) {
    vshi_segment_ray world = {.far = (double)ray[VSHI_RAY_FAR * n + i] / triangles->scale};
    for (size_t axis = 0; axis < 3; ++axis) {
        world.origin[axis] =
            (double)ray[(VSHI_RAY_ORIGIN + axis) * n + i] / triangles->scale + triangles->centre[axis];
        world.direction[axis] = (double)ray[(VSHI_RAY_DIRECTION + axis) * n + i];
    }
    return (float)(vshi_solids_part_meet(triangles->solids, part, &world) * triangles->scale);
}

static void occlude_parts(const struct RTCOccludedFunctionNArguments *args) {
    VSHI_FLOATS;
    float *ray = (float *)args->ray;
    for (size_t i = 0; i < args->N; ++i) {
        if (args->valid[i] == -1 &&
            meet_part(args->geometryUserPtr, args->primID, ray, args->N, i) < INFINITY) {
            ray[VSHI_RAY_FAR * args->N + i] = -INFINITY;
        }
    }
}

/* Searches for solids (contexts with a filter) use triangles only. */
static void intersect_parts(const struct RTCIntersectFunctionNArguments *args) {
    VSHI_FLOATS;
    float *ray = (float *)args->rayhit;
    unsigned *hit = (unsigned *)args->rayhit;
    const size_t n = args->N;
    for (size_t i = 0; args->context->filter == NULL && i < n; ++i) {
        const float met =
            args->valid[i] == -1 ? meet_part(args->geometryUserPtr, args->primID, ray, n, i) : INFINITY;
        if (met < INFINITY) {
            ray[VSHI_RAY_FAR * n + i] = met;
            hit[(VSHI_RAY_ROWS + VSHI_HIT_TRIANGLE) * n + i] = args->primID;
            hit[(VSHI_RAY_ROWS + VSHI_HIT_MESH) * n + i] = args->geomID;
        }
    }
}

bool vshi_triangles_attach_solids(vshi_triangles *triangles, unsigned number) {
    const vshi_embree *embree = triangles->embree;
    const RTCGeometry geometry = embree->rtcNewGeometry(triangles->device, RTC_GEOMETRY_TYPE_USER);
    if (geometry == NULL) {
        return false;
    }
    embree->rtcSetGeometryUserPrimitiveCount(geometry, (unsigned)vshi_solids_part_count(triangles->solids));
    embree->rtcSetGeometryUserData(geometry, triangles);
    embree->rtcSetGeometryBoundsFunction(geometry, find_part_bounds, NULL);
    embree->rtcSetGeometryIntersectFunction(geometry, intersect_parts);
    embree->rtcSetGeometryOccludedFunction(geometry, occlude_parts);
    embree->rtcCommitGeometry(geometry);
    embree->rtcAttachGeometryByID(triangles->scene, geometry, number);
    embree->rtcReleaseGeometry(geometry);
    return true;
}
