#include "embree.h"

#include "directions.h"
#include "embree_scene.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MAX_THREADS = 64 };

static void world_position(const vsh_mesh *mesh, size_t vertex, double world[3]) {
    const float *p = &mesh->positions[3 * vertex];
    for (int i = 0; i < 3; i++) {
        const double *row = mesh->transform != NULL ? &mesh->transform[4 * i] : NULL;
        world[i] = row != NULL ? row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3] : (double)p[i];
    }
}

static void find_center(const vsh_mesh *meshes, size_t mesh_count, double center[3]) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t m = 0; m < mesh_count; m++) {
        for (size_t v = 0; v < meshes[m].vertex_count; v++) {
            double world[3];
            world_position(&meshes[m], v, world);
            for (int i = 0; i < 3; i++) {
                low[i] = fmin(low[i], world[i]);
                high[i] = fmax(high[i], world[i]);
            }
        }
    }
    for (int i = 0; i < 3; i++) {
        center[i] = low[i] <= high[i] ? (low[i] + high[i]) / 2.0 : 0.0;
    }
}

static bool mirrors(const double *m) {
    return m != NULL && m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
                                m[2] * (m[4] * m[9] - m[5] * m[8]) <
                            0.0;
}

static bool attach(truth_mesh *truth, const vsh_mesh *mesh) {
    RTCGeometry geometry = rtcNewGeometry(truth->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                mesh->vertex_count > 0 ? mesh->vertex_count : 1);
    uint32_t *indices =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t),
                                mesh->triangle_count > 0 ? mesh->triangle_count : 1);
    if (vertices == NULL || indices == NULL) {
        rtcReleaseGeometry(geometry);
        return false;
    }
    memset(indices, 0, 3 * sizeof(uint32_t));
    for (size_t v = 0; v < mesh->vertex_count; v++) {
        double world[3];
        world_position(mesh, v, world);
        for (int i = 0; i < 3; i++) {
            vertices[3 * v + (size_t)i] = (float)(world[i] - truth->center[i]);
        }
    }
    /* A mirroring transform turns triangles inside out, so their corners are exchanged. */
    const bool flip = mirrors(mesh->transform);
    for (size_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *from = &mesh->indices[3 * t];
        indices[3 * t] = from[0];
        indices[3 * t + 1] = from[flip ? 2 : 1];
        indices[3 * t + 2] = from[flip ? 1 : 2];
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(truth->scene, geometry);
    rtcReleaseGeometry(geometry);
    return true;
}

truth_mesh *truth_mesh_create(const vsh_mesh *meshes, size_t mesh_count) {
    truth_mesh *truth = calloc(1, sizeof *truth);
    if (truth == NULL) {
        return NULL;
    }
    find_center(meshes, mesh_count, truth->center);
    truth->device = rtcNewDevice(NULL);
    if (truth->device == NULL) {
        goto fail;
    }
    truth->scene = rtcNewScene(truth->device);
    rtcSetSceneFlags(truth->scene, RTC_SCENE_FLAG_ROBUST);
    for (size_t m = 0; m < mesh_count; m++) {
        if (!attach(truth, &meshes[m])) {
            goto fail;
        }
    }
    rtcCommitScene(truth->scene);
    if (rtcGetDeviceError(truth->device) != RTC_ERROR_NONE) {
        goto fail;
    }
    return truth;
fail:
    truth_mesh_free(truth);
    return NULL;
}

void truth_mesh_free(truth_mesh *truth) {
    if (truth == NULL) {
        return;
    }
    if (truth->scene != NULL) {
        rtcReleaseScene(truth->scene);
    }
    if (truth->device != NULL) {
        rtcReleaseDevice(truth->device);
    }
    free(truth);
}

/* Rays of each point: those to a light, or over the hemisphere around the normal. */
typedef struct work {
    const truth_mesh *truth;
    const double *origins;
    const float *normals;
    const double *towards; /* towards the light; NULL: AO */
    double w;              /* the light's radius at unit distance */
    float distance;
    size_t rays;
    bool (*counts)(const truth_mesh *truth, struct RTCRay ray); /* whether a ray adds to the share */
    float *shares;
} work;

static bool is_free(const truth_mesh *truth, struct RTCRay ray) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(truth->scene, &context, &ray);
    return ray.tfar >= 0.0F; /* a hit sets it to -∞ */
}

static bool meets_back(const truth_mesh *truth, struct RTCRay ray) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit hit = {.ray = ray, .hit.geomID = RTC_INVALID_GEOMETRY_ID};
    rtcIntersect1(truth->scene, &context, &hit);
    return hit.hit.geomID != RTC_INVALID_GEOMETRY_ID &&
           hit.hit.Ng_x * hit.ray.dir_x + hit.hit.Ng_y * hit.ray.dir_y + hit.hit.Ng_z * hit.ray.dir_z > 0.0F;
}

static void count_rays(void *user, size_t begin, size_t end) {
    const work *job = user;
    for (size_t point = begin; point < end; point++) {
        const double *origin = &job->origins[3 * point], *center = job->truth->center;
        const float *n = job->normals != NULL ? &job->normals[3 * point] : NULL;
        const truth_frame frame =
            truth_frame_around(job->towards != NULL ? job->towards : (double[]){n[0], n[1], n[2]});
        size_t count = 0;
        for (size_t i = 0; i < job->rays; i++) {
            double d[3];
            if (job->towards != NULL) {
                truth_light_direction(&frame, job->w, i, job->rays, d);
            } else {
                truth_cosine_direction(&frame, i, job->rays, d);
            }
            const struct RTCRay ray = {.org_x = (float)(origin[0] - center[0]),
                                       .org_y = (float)(origin[1] - center[1]),
                                       .org_z = (float)(origin[2] - center[2]),
                                       .dir_x = (float)d[0],
                                       .dir_y = (float)d[1],
                                       .dir_z = (float)d[2],
                                       .tfar = job->distance,
                                       .mask = 0xffffffffU};
            const bool hidden =
                job->towards != NULL && n != NULL && d[0] * n[0] + d[1] * n[1] + d[2] * n[2] <= 0.0;
            count += !hidden && job->counts(job->truth, ray);
        }
        job->shares[point] = (float)((double)count / (double)job->rays);
    }
}

typedef struct pieces {
    size_t count;
    void (*body)(void *user, size_t begin, size_t end);
    void *user;
    atomic_size_t next;
} pieces;

static void *run(void *user) {
    pieces *all = user;
    for (;;) {
        const size_t begin = atomic_fetch_add(&all->next, TRUTH_AT_ONCE);
        if (begin >= all->count) {
            return NULL;
        }
        all->body(all->user, begin, all->count - begin > TRUTH_AT_ONCE ? begin + TRUTH_AT_ONCE : all->count);
    }
}

int truth_in_pieces(size_t count, int threads, void (*body)(void *user, size_t begin, size_t end),
                    void *user) {
    pieces all = {.count = count, .body = body, .user = user};
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    int wanted = threads > 0 ? threads : (int)(cores > 0 ? cores : 1);
    wanted = wanted < MAX_THREADS ? wanted : MAX_THREADS;
    pthread_t thread[MAX_THREADS];
    int started = 0;
    while (started < wanted - 1 && pthread_create(&thread[started], NULL, run, &all) == 0) {
        started++;
    }
    run(&all);
    for (int i = 0; i < started; i++) {
        pthread_join(thread[i], NULL);
    }
    return started == wanted - 1 ? 0 : -1;
}

int truth_mesh_light(const truth_mesh *truth, size_t count, const double *origins, const float *normals,
                     const double towards[3], double w, size_t rays, int threads, float *visible) {
    work job = {truth, origins, normals, towards, w, INFINITY, rays, is_free, visible};
    return truth_in_pieces(count, threads, count_rays, &job);
}

int truth_mesh_ao(const truth_mesh *truth, size_t count, const double *origins, const float *normals,
                  double distance, size_t rays, int threads, float *open) {
    work job = {truth, origins, normals, NULL, 0.0, (float)distance, rays, is_free, open};
    return truth_in_pieces(count, threads, count_rays, &job);
}

int truth_mesh_backs(const truth_mesh *truth, size_t count, const double *origins, const float *normals,
                     size_t rays, int threads, float *backs) {
    work job = {truth, origins, normals, NULL, 0.0, INFINITY, rays, meets_back, backs};
    return truth_in_pieces(count, threads, count_rays, &job);
}
