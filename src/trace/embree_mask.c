#include "trace/embree_scene.h"

#include "base/memory.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static vshi_vec vertex(const vshi_sieve *sieve, uint32_t number) {
    return vshi_vec_off(sieve->vertices + 3 * (size_t)number);
}

/* Whether a ray passes through a triangle that it meets. By the ray and the triangle alone, in double: where
 * on it Embree's own numbers put the hit depends on how many rays it has traced at once (Möller and Trumbore,
 * "Fast, minimum storage ray-triangle intersection", 1997). */
static bool passes(const vshi_sieve *sieve, uint32_t triangle, vshi_vec origin, vshi_vec direction) {
    const uint32_t *corners = sieve->corners + 3 * (size_t)triangle;
    const vshi_vec a = vertex(sieve, corners[0]);
    const vshi_vec ab = vshi_sub(vertex(sieve, corners[1]), a);
    const vshi_vec ac = vshi_sub(vertex(sieve, corners[2]), a);
    if (sieve->one_sided) {
        /* the ray goes to where the light is from */
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

/* Rays that look for solids have a filter of their own, and meet triangles as they are. */
static void filter(const struct RTCFilterFunctionNArguments *args) {
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

/* A copy of a mask's texels; one for all masks that have the same. */
static vsh_result take_texels(vsh_triangles *triangles, const vsh_alpha_mask *mask, const vsh_run *run,
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

static vsh_result copy_mask(vsh_triangles *triangles, const vsh_mesh *mesh, vshi_sieve *sieve,
                            const vsh_run *run, double held, vsh_error *error) {
    const size_t corners = 3 * mesh->triangle_count;
    triangles->sieve_bytes += corners * sizeof *sieve->places;
    VSHI_TRY(vshi_check_limit(run, held + (double)triangles->sieve_bytes, "alpha masks", error));
    VSHI_TRY(vshi_allocate((void **)&sieve->places, corners, sizeof *sieve->places, "alpha masks", error));
    sieve->mask = *mesh->mask;
    VSHI_TRY(take_texels(triangles, mesh->mask, run, held, &sieve->mask.alpha, error));
    vshi_mask_place *to = sieve->places;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        for (size_t k = 0; k < 3 && !vshi_mesh_degenerate(mesh, i); ++k) {
            *to++ = vshi_alpha_mask_place(mesh->mask, mesh->mask_uvs + 2 * (size_t)mesh->indices[3 * i + k]);
        }
    }
    return VSH_OK;
}

vsh_result vshi_sieves_create(vsh_triangles *triangles, const vsh_mesh *meshes, size_t count,
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
    VSHI_TRY(
        vshi_allocate((void **)&triangles->sieves, count, sizeof *triangles->sieves, "alpha masks", error));
    VSHI_TRY(vshi_allocate((void **)&triangles->textures, masks, sizeof *triangles->textures, "alpha masks",
                           error));
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

void vshi_sieves_free(vsh_triangles *triangles) {
    for (size_t i = 0; i < triangles->texture_count; ++i) {
        free(triangles->textures[i].alpha);
    }
    for (size_t m = 0; m < triangles->sieve_count; ++m) {
        free(triangles->sieves[m].places);
    }
    free(triangles->textures);
    free(triangles->sieves);
}

void vshi_sieve_attach(const vsh_triangles *triangles, size_t mesh, RTCGeometry geometry,
                       const float *vertices, const uint32_t *corners) {
    vshi_sieve *sieve = triangles->sieves != NULL ? &triangles->sieves[mesh] : NULL;
    if (sieve != NULL && (sieve->places != NULL || sieve->one_sided)) {
        sieve->vertices = vertices;
        sieve->corners = corners;
        triangles->embree->rtcSetGeometryUserData(geometry, sieve);
        triangles->embree->rtcSetGeometryIntersectFilterFunction(geometry, filter);
        triangles->embree->rtcSetGeometryOccludedFilterFunction(geometry, filter);
    }
}
