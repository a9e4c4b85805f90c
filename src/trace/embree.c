/* Builds Embree scenes of triangles and procedural solids. Masks and one-sided faces let rays pass
 * triangles. */
#include "trace/embree_scene.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/mesh_set.h"
#include "trace/trace.h"

#include <dlfcn.h>
#include <errno.h>
#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* --- loading Embree. The library is not linked: names come from Embree's own file, so that functions of the
 * same names in a host (a static Embree, Embree 4) and ours do not mix. */

#define NAME(name) #name,
static const char *const names[] = {VSHI_EMBREE_CALLS(NAME)};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static vshi_embree calls;
static _Atomic(const vshi_embree *) loaded;

/* Loads Embree for as long as the process lives. */
static vsh_result load_calls(vsh_error *error) {
    errno = 0;
    void *library = dlopen(VSH_EMBREE, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL && errno == ENOMEM) {
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "triangles: the system refused the memory that Embree takes");
    }
    unsigned char *call = (unsigned char *)&calls;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        void *found = library != NULL ? dlsym(library, names[i]) : NULL;
        if (found == NULL) {
            const char *why = dlerror();
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                             "triangles: exact methods trace rays with Embree, which cannot be loaded: %s",
                             why != NULL ? why : VSH_EMBREE);
        }
        memcpy(call + i * sizeof found, &found, sizeof found);
    }
    atomic_store_explicit(&loaded, &calls, memory_order_release);
    return VSH_OK;
}

/* Errors: VSH_ERROR_UNSUPPORTED (Embree is missing), VSH_ERROR_MEMORY. */
static vsh_result load_embree(const vshi_embree **embree, vsh_error *error) {
    vsh_result result = VSH_OK;
    *embree = atomic_load_explicit(&loaded, memory_order_acquire);
    if (*embree == NULL) {
        pthread_mutex_lock(&lock);
        result = atomic_load_explicit(&loaded, memory_order_relaxed) == NULL ? load_calls(error) : VSH_OK;
        *embree = atomic_load_explicit(&loaded, memory_order_relaxed);
        pthread_mutex_unlock(&lock);
    }
    return result;
}

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

/* Makes sieves of the meshes; triangles->sieves stays NULL if none is needed. `held` bytes are in use.
 * Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result create_sieves(vshi_triangles *triangles, const vsh_mesh *meshes, size_t count,
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

static void free_sieves(vshi_triangles *triangles) {
    for (size_t i = 0; i < triangles->texture_count; ++i) {
        free(triangles->textures[i].alpha);
    }
    for (size_t m = 0; m < triangles->sieve_count; ++m) {
        free(triangles->sieves[m].places);
    }
    free(triangles->textures);
    free(triangles->sieves);
}

/* Lets rays pass through a mesh's geometry as its sieve allows. Vertices and corners are Embree's buffers. */
static void attach_sieve(const vshi_triangles *triangles, size_t mesh, RTCGeometry geometry,
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

/* Adds triangles->solids as geometry `number`; false if Embree fails, which keeps the reason. */
static bool attach_solids(vshi_triangles *triangles, unsigned number) {
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

/* --- scenes */

/* Bytes of a triangle in buffers and tree: 180 to 230 measured, more while the tree is built. */
static const double TRIANGLE_BYTES = 300.0;
/* A solid terrain of so many triangles becomes quads of two, which take two thirds of the memory. */
enum { LEAST_TERRAIN = 1 << 19 };
/* Bytes of a quad: 97 measured, more while the tree is built. */
static const double QUAD_BYTES = 160.0;

static bool watch_memory(void *user, ssize_t bytes, bool post) {
    (void)post;
    vshi_triangles *triangles = user;
    const long long held = atomic_fetch_add(&triangles->bytes, (long long)bytes) + (long long)bytes;
    if (bytes > 0 && triangles->limit > 0 && held > (long long)triangles->limit) {
        atomic_store(&triangles->refused, true);
        return false;
    }
    return true;
}

/* A cancelled job ends the build. Any thread may call this. Embree flushes denormals to zero on its threads,
 * which the host's callback must not see. */
static bool watch_progress(void *user, double fraction) {
    VSHI_FLOATS;
    (void)fraction;
    return !vshi_job_advance(user, 0);
}

/* Sets centre and scale from the box of all corners. */
static void set_scale(vshi_triangles *triangles, const double low[3], const double high[3]) {
    double half = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = 0.5 * high[axis] - 0.5 * low[axis];
        triangles->centre[axis] = low[axis] <= high[axis] ? low[axis] + side : 0.0;
        half = side > half ? side : half;
    }
    int exponent = 0;
    if (half > 0.0) {
        frexp(half, &exponent);
    }
    triangles->scale = ldexp(1.0, exponent < -1000 ? 1000 : -exponent);
    triangles->size = 2.0 * half;
}

static void measure(vshi_triangles *triangles, const vsh_mesh *meshes, size_t mesh_count) {
    double *low = triangles->low, *high = triangles->high;
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = DBL_MAX;
        high[axis] = -DBL_MAX;
    }
    for (size_t m = 0; m < mesh_count; ++m) {
        for (size_t i = 0; i < 3 * meshes[m].triangle_count; ++i) {
            vshi_grow_box(low, high, vshi_mesh_place(&meshes[m], meshes[m].indices[i]));
        }
    }
    const size_t parts = triangles->solids != NULL ? vshi_solids_part_count(triangles->solids) : 0;
    for (size_t k = 0; k < parts; ++k) {
        double least[3], most[3];
        vshi_solids_part_box(triangles->solids, k, least, most);
        if (least[0] <= most[0]) {
            vshi_grow_box_by(low, high, NULL, least, most);
        }
    }
    set_scale(triangles, low, high);
}

static void write_point(const vshi_triangles *triangles, vshi_vec world, float *out) {
    out[0] = (float)((world.x - triangles->centre[0]) * triangles->scale);
    out[1] = (float)((world.y - triangles->centre[1]) * triangles->scale);
    out[2] = (float)((world.z - triangles->centre[2]) * triangles->scale);
}

/* VSHI_SOLID_… of triangle i of a mesh, by its corners' order even if the transform mirrors. */
static uint8_t find_solid(const vsh_mesh *mesh, const uint8_t *sides, const uint8_t *holed, size_t i) {
    const uint8_t side = holed[i] != VSHI_SIDE_SHEET ? holed[i] : sides[i];
    if (side == VSHI_SIDE_SHEET) {
        return VSHI_AIR_AROUND;
    }
    const bool mirrored = vshi_transform_determinant(mesh->transform) < 0.0;
    const bool behind = (side == VSHI_SIDE_BEHIND) != mirrored;
    return (uint8_t)((behind ? VSHI_SOLID_BEHIND : VSHI_SOLID_BEFORE) |
                     (sides[i] == VSHI_SIDE_SHEET   ? VSHI_SOLID_VESSEL
                      : holed[i] != VSHI_SIDE_SHEET ? VSHI_SOLID_HOLED
                                                    : 0));
}

/* Finds the meshes whose triangles become quads. */
static vsh_result find_terrains(vshi_triangles *triangles, const vshi_mesh_set *set, vsh_error *error) {
    VSHI_TRY(
        vshi_allocate((void **)&triangles->cells, set->count, sizeof *triangles->cells, "triangles", error));
    for (size_t m = 0; m < set->count; ++m) {
        const vsh_mesh *mesh = &set->meshes[m];
        vshi_terrain terrain;
        if (mesh->triangle_count >= LEAST_TERRAIN && mesh->mask == NULL && mesh->one_sided == 0 &&
            set->checked[m].report.degenerate_triangles == 0 && vshi_mesh_is_terrain(mesh, &terrain) &&
            terrain.solid) {
            triangles->cells[m] = (terrain.columns - 1) * (terrain.rows - 1);
        }
    }
    return VSH_OK;
}

/* Triangles of a mesh's geometry, or its quads. */
static size_t count_triangles(const vshi_triangles *triangles, const vshi_mesh_set *set, size_t m) {
    return set->meshes[m].triangle_count - set->checked[m].report.degenerate_triangles - triangles->cells[m];
}

/* Numbers the triangles of all geometries. */
static vsh_result number_triangles(vshi_triangles *triangles, const vshi_mesh_set *set, vsh_error *error) {
    size_t count = 0;
    VSHI_TRY(vshi_allocate((void **)&triangles->first, set->count, sizeof(uint32_t), "triangles", error));
    for (size_t m = 0; m < set->count; ++m) {
        const size_t vertices = set->meshes[m].vertex_count;
        triangles->first[m] = (uint32_t)count;
        count += count_triangles(triangles, set, m);
        if (vertices > UINT32_MAX || count > UINT32_MAX) {
            return vshi_fail(error, VSH_ERROR_LIMIT,
                             "triangles: %zu vertices of a mesh and %zu triangles, at most %u of each",
                             vertices, count, UINT32_MAX);
        }
    }
    triangles->count = count;
    return vshi_allocate((void **)&triangles->solid, count, 1, "triangles", error);
}

static void set_solid(vshi_triangles *triangles, uint8_t solid, uint8_t *to) {
    triangles->has_solids = triangles->has_solids || solid != VSHI_AIR_AROUND;
    triangles->has_holes = triangles->has_holes || (solid & VSHI_SOLID_HOLED) != 0;
    triangles->has_vessels = triangles->has_vessels || (solid & VSHI_SOLID_VESSEL) != 0;
    *to = solid;
}

/* Writes a terrain's cells as quads, which Embree splits from their second to their last corner, then its
 * sides and bottom as quads with their last corner twice. */
static void write_quads(vshi_triangles *triangles, const vshi_mesh_set *set, size_t m, uint8_t *solid,
                        uint32_t *corners) {
    const vsh_mesh *mesh = &set->meshes[m];
    const uint32_t *given = mesh->indices;
    for (size_t i = 0; i < triangles->cells[m]; ++i, given += 6, corners += 4) {
        memcpy(corners, (const uint32_t[4]){given[4], given[1], given[2], given[0]}, 4 * sizeof *corners);
    }
    for (; given < mesh->indices + 3 * mesh->triangle_count; given += 3, corners += 4) {
        memcpy(corners, (const uint32_t[4]){given[0], given[1], given[2], given[2]}, 4 * sizeof *corners);
    }
    const uint8_t side =
        find_solid(mesh, vshi_solidity_sides(set->solidity, m), vshi_solidity_holed(set->solidity, m), 0);
    for (size_t i = 0; i < count_triangles(triangles, set, m); ++i) {
        set_solid(triangles, side, &solid[i]);
    }
}

/* Writes the triangles of a mesh, except for degenerate ones. */
static void write_triangles(vshi_triangles *triangles, const vshi_mesh_set *set, size_t m, uint8_t *solid,
                            uint32_t *corners) {
    const vsh_mesh *mesh = &set->meshes[m];
    const uint8_t *sides = vshi_solidity_sides(set->solidity, m);
    const uint8_t *holed = vshi_solidity_holed(set->solidity, m);
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        if (!vshi_mesh_degenerate(mesh, i)) {
            memcpy(corners, mesh->indices + 3 * i, 3 * sizeof *corners);
            corners += 3;
            set_solid(triangles, find_solid(mesh, sides, holed, i), solid++);
        }
    }
}

/* Attaches mesh `m` as the geometry of that number; false if Embree fails, which keeps the reason. */
static bool attach_mesh(vshi_triangles *triangles, const vshi_mesh_set *set, size_t m) {
    const vsh_mesh *mesh = &set->meshes[m];
    const size_t count = count_triangles(triangles, set, m), sides = triangles->cells[m] > 0 ? 4 : 3;
    if (count == 0) {
        return true;
    }
    const RTCGeometry geometry = triangles->embree->rtcNewGeometry(
        triangles->device, sides == 4 ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
    if (geometry == NULL) {
        return false;
    }
    float *vertices = triangles->embree->rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh->vertex_count);
    uint32_t *corners = triangles->embree->rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, sides == 4 ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3,
        sides * sizeof(uint32_t), count);
    if (vertices != NULL && corners != NULL) {
        for (size_t v = 0; v < mesh->vertex_count; ++v) {
            write_point(triangles, vshi_mesh_place(mesh, v), vertices + 3 * v);
        }
        uint8_t *solid = triangles->solid + triangles->first[m];
        if (sides == 4) {
            write_quads(triangles, set, m, solid, corners);
        } else {
            write_triangles(triangles, set, m, solid, corners);
        }
        attach_sieve(triangles, m, geometry, vertices, corners);
        triangles->embree->rtcCommitGeometry(geometry);
        triangles->embree->rtcAttachGeometryByID(triangles->scene, geometry, (unsigned)m);
    }
    triangles->embree->rtcReleaseGeometry(geometry);
    return vertices != NULL && corners != NULL;
}

/* Fails because of the memory limit, a cancelled job or Embree's `code`. */
static vsh_result fail_by(const vshi_triangles *triangles, enum RTCError code, vshi_job *job,
                          vsh_error *error) {
    if (atomic_load(&triangles->refused)) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "triangles: the memory limit of %.0f MB is passed",
                         (double)triangles->limit / 1e6);
    }
    VSHI_TRY(vshi_job_check(job, error));
    if (code == RTC_ERROR_OUT_OF_MEMORY || code == RTC_ERROR_NONE) { /* Embree loses some reasons */
        return vshi_fail(error, VSH_ERROR_MEMORY, "triangles: the system refused memory");
    }
    return vshi_fail(error, VSH_ERROR_INTERNAL, "triangles: Embree's error %d", (int)code);
}

/* Fails with the device's error, which reading clears. */
static vsh_result fail_build(const vshi_triangles *triangles, vshi_job *job, vsh_error *error) {
    return fail_by(triangles, triangles->embree->rtcGetDeviceError(triangles->device), job, error);
}

/* Builds the tree on the threads of the arena around the call. */
static void commit(void *user) {
    const vshi_triangles *triangles = user;
    triangles->embree->rtcCommitScene(triangles->scene);
}

/* Makes an empty scene. */
static vsh_result begin_scene(vshi_triangles *triangles, vshi_job *job, vsh_error *error) {
    VSHI_TRY(load_embree(&triangles->embree, error));
    triangles->device = triangles->embree->rtcNewDevice(NULL);
    if (triangles->device == NULL) {
        const enum RTCError code = triangles->embree->rtcGetDeviceError(NULL);
        return code == RTC_ERROR_OUT_OF_MEMORY || code == RTC_ERROR_NONE
                   ? vshi_fail(error, VSH_ERROR_MEMORY, "triangles: the system refused memory")
                   : vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                               "triangles: Embree refuses this machine, error %d", (int)code);
    }
    triangles->wide = triangles->embree->rtcGetDeviceProperty(
                          triangles->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    triangles->embree->rtcSetDeviceMemoryMonitorFunction(triangles->device, watch_memory, triangles);
    triangles->scene = triangles->embree->rtcNewScene(triangles->device);
    if (triangles->scene == NULL) {
        return fail_build(triangles, job, error);
    }
    triangles->embree->rtcSetSceneFlags(triangles->scene,
                                        RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    triangles->embree->rtcSetSceneProgressMonitorFunction(triangles->scene, watch_progress, job);
    return VSH_OK;
}

static vsh_result build_tree(vshi_triangles *triangles, vshi_job *job, vsh_error *error) {
    const vsh_result result = vshi_parallel_call(job, commit, triangles, error);
    triangles->embree->rtcSetSceneProgressMonitorFunction(triangles->scene, NULL, NULL);
    if (result != VSH_OK) {
        return result;
    }
    const enum RTCError code = triangles->embree->rtcGetDeviceError(triangles->device);
    return code != RTC_ERROR_NONE || atomic_load(&triangles->refused) || vshi_job_cancelled(job)
               ? fail_by(triangles, code, job, error)
               : VSH_OK;
}

static vsh_result build(vshi_triangles *triangles, const vshi_mesh_set *set, vshi_job *job,
                        vsh_error *error) {
    VSHI_TRY(begin_scene(triangles, job, error));
    VSHI_TRY(number_triangles(triangles, set, error));
    for (size_t m = 0; m < set->count; ++m) {
        if (!attach_mesh(triangles, set, m)) {
            return fail_build(triangles, job, error);
        }
        VSHI_TRY(vshi_job_step(job, 0, error));
    }
    if (triangles->solids != NULL && !attach_solids(triangles, (unsigned)set->count)) {
        return fail_build(triangles, job, error);
    }
    VSHI_TRY(build_tree(triangles, job, error));
    return vshi_job_step(job, 1, error);
}

static vsh_result build_quads(vshi_triangles *triangles, const vshi_quads *quads, vshi_job *job,
                              vsh_error *error) {
    VSHI_TRY(begin_scene(triangles, job, error));
    const RTCGeometry geometry = triangles->embree->rtcNewGeometry(triangles->device, RTC_GEOMETRY_TYPE_QUAD);
    if (geometry == NULL) {
        return fail_build(triangles, job, error);
    }
    float *corners = triangles->embree->rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), quads->corner_count);
    uint32_t *indices = triangles->embree->rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), quads->quad_count);
    vsh_result result =
        corners != NULL && indices != NULL
            ? quads->write(quads->user, triangles->centre, triangles->scale, corners, indices, error)
            : fail_build(triangles, job, error);
    if (result == VSH_OK) {
        triangles->embree->rtcCommitGeometry(geometry);
        /* for quads of one size, rays are as fast as with the better quality, which takes twice the time */
        triangles->embree->rtcSetSceneBuildQuality(triangles->scene, RTC_BUILD_QUALITY_LOW);
        triangles->embree->rtcAttachGeometry(triangles->scene, geometry);
        result = build_tree(triangles, job, error);
    }
    triangles->embree->rtcReleaseGeometry(geometry);
    return result;
}

vsh_result vshi_triangles_of_quads(const vshi_quads *quads, const vsh_run *run, double held, vshi_job *job,
                                   vshi_triangles **triangles, vsh_error *error) {
    *triangles = NULL;
    const double bytes = 12.0 * (double)quads->corner_count + QUAD_BYTES * (double)quads->quad_count;
    VSHI_TRY(vshi_check_limit(run, held + bytes, "surface", error));
    vshi_triangles *made;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "surface", error));
    made->limit = run->memory_limit;
    made->fine = true;
    set_scale(made, quads->low, quads->high);
    const vsh_result result = build_quads(made, quads, job, error);
    if (result != VSH_OK) {
        vshi_triangles_free(made);
        return result;
    }
    *triangles = made;
    return VSH_OK;
}

vsh_result vshi_triangles_create(const vsh_mesh *meshes, size_t mesh_count, vshi_solids *solids,
                                 const vsh_run *run, vshi_triangles **triangles, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(triangles);
    vshi_mesh_set set;
    vshi_triangles *made = NULL;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, mesh_count, &set, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "triangles", error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(&set, run, error));
    VSHI_TRY_DONE(find_terrains(made, &set, error));
    double bytes = 0.0;
    for (size_t m = 0; m < mesh_count; ++m) {
        bytes += 12.0 * (double)set.meshes[m].vertex_count +
                 (made->cells[m] > 0 ? QUAD_BYTES : TRIANGLE_BYTES) * (double)count_triangles(made, &set, m);
    }
    VSHI_TRY_DONE(vshi_check_limit(run, bytes, "triangles", error));
    VSHI_TRY_DONE(create_sieves(made, set.meshes, set.count, run, bytes, error));
    made->limit = run->memory_limit;
    made->solids = solids;
    measure(made, set.meshes, set.count);
    VSHI_TRY_DONE(vshi_job_open(&job, run, "triangles", 1, "triangles", error));
    VSHI_TRY_DONE(vshi_job_check(job, error));
    result = build(made, &set, job, error);
done:
    vshi_job_end(job);
    vshi_mesh_set_free(&set);
    if (result != VSH_OK) {
        if (made != NULL) {
            made->solids = NULL; /* the caller's */
        }
        vshi_triangles_free(made);
        made = NULL;
    }
    *triangles = made;
    return result;
}

void vshi_triangles_free(vshi_triangles *triangles) {
    if (triangles == NULL) {
        return;
    }
    vshi_solids_free(triangles->solids);
    if (triangles->scene != NULL) {
        triangles->embree->rtcReleaseScene(triangles->scene);
    }
    if (triangles->device != NULL) {
        triangles->embree->rtcReleaseDevice(triangles->device);
    }
    free_sieves(triangles);
    free(triangles->cells);
    free(triangles->solid);
    free(triangles->first);
    free(triangles);
}

uint64_t vshi_triangles_bytes(const vshi_triangles *triangles) {
    const long long bytes = atomic_load(&triangles->bytes);
    return sizeof *triangles + triangles->sieve_bytes + (bytes > 0 ? (uint64_t)bytes : 0) + triangles->count;
}
