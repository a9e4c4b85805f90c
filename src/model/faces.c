#include "model/faces.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

/* Polygons that shared their first corner with the face before have always begun at another one (Assimp's
 * encoding of polygons as fans), and so bakes keep their bits. */
static void turn_fan(vshi_face_cutter *cutter, uint32_t *triangles, size_t count) {
    if (cutter->begun && triangles[0] == cutter->last_first) {
        uint32_t *t = triangles;
        const uint32_t first[3] = {t[2], t[0], t[1]};
        memcpy(t, first, sizeof first);
        if (count == 2) {
            const uint32_t second[3] = {t[4], t[5], t[3]};
            memcpy(t + 3, second, sizeof second);
        }
    }
    cutter->last_first = triangles[0];
    cutter->begun = true;
}

static vsh_result cut(vshi_face_cutter *cutter, const float *positions, const uint32_t *corners, size_t count,
                      uint32_t *triangles, size_t *made, vsh_error *error) {
    bool simple;
    VSHI_TRY(vshi_polygon_cut(&cutter->polygon, positions, corners, count, cutter->job, triangles, made,
                              &simple, error));
    cutter->crossing += !simple;
    if (count <= 4 && cutter->turns && *made > 0) {
        turn_fan(cutter, triangles, *made);
    }
    for (size_t i = 0; count > 4 && i < *made; ++i) {
        turn_fan(cutter, triangles + 3 * i, 1);
    }
    return VSH_OK;
}

/* A polygon by the numbers of its corners, which then become vertices. */
static vsh_result cut_apart(vshi_face_cutter *cutter, const uint32_t *corners, size_t count,
                            uint32_t *triangles, size_t *made, vsh_error *error) {
    if (count > cutter->own_capacity) {
        free(cutter->own_positions);
        free(cutter->own_corners);
        cutter->own_capacity = 0;
        const size_t capacity = count + count / 2;
        VSHI_TRY(
            vshi_allocate((void **)&cutter->own_positions, capacity, sizeof(float[3]), "polygon", error));
        VSHI_TRY(vshi_allocate((void **)&cutter->own_corners, capacity, sizeof(uint32_t), "polygon", error));
        cutter->own_capacity = capacity;
    }
    for (size_t i = 0; i < count; ++i) {
        memcpy(cutter->own_positions + 3 * i, cutter->positions + 3 * (size_t)corners[i], sizeof(float[3]));
        cutter->own_corners[i] = (uint32_t)i;
    }
    cutter->begun = false;
    VSHI_TRY(cut(cutter, cutter->own_positions, cutter->own_corners, count, triangles, made, error));
    for (size_t i = 0; i < 3 * *made; ++i) {
        triangles[i] = corners[triangles[i]];
    }
    return VSH_OK;
}

vsh_result vshi_face_cut(vshi_face_cutter *cutter, const uint32_t *corners, size_t count, uint32_t *triangles,
                         size_t *made, vsh_error *error) {
    enum { FACES_A_POLL = 1 << 14 };
    *made = 0;
    if (count < 3) {
        return VSH_OK;
    }
    if (cutter->looked++ % FACES_A_POLL == 0 && vshi_job_cancelled(cutter->job)) {
        return vshi_job_fail_cancelled(cutter->job, error);
    }
    if (cutter->apart && count > 3) {
        return cut_apart(cutter, corners, count, triangles, made, error);
    }
    return cut(cutter, cutter->positions, corners, count, triangles, made, error);
}

void vshi_face_cutter_end(vshi_face_cutter *cutter, const vsh_run *run, const char *path, const char *name) {
    vshi_polygon_free(&cutter->polygon);
    free(cutter->own_positions);
    free(cutter->own_corners);
    if (cutter->crossing > 0) {
        vshi_warn(run,
                  "%s: mesh '%s': edges of %zu polygons cross, so their triangles are guessed; triangulate "
                  "before the export",
                  path, name, cutter->crossing);
    }
}

size_t vshi_faces_most(const vshi_face_run *runs, size_t count, bool *triangles) {
    size_t most = 0;
    *triangles = true;
    for (size_t i = 0; i < count; ++i) {
        most += runs[i].size >= 3 ? runs[i].faces * (runs[i].size - 2) : 0;
        *triangles = *triangles && runs[i].size == 3;
    }
    return most;
}

vsh_result vshi_faces_cut(vshi_face_cutter *cutter, const vshi_face_run *runs, size_t count,
                          const uint32_t *corners, uint32_t *triangles, size_t *made, vsh_error *error) {
    bool plain;
    size_t faces = 0;
    *made = 0;
    for (size_t i = 0; i < count; ++i) {
        faces += runs[i].faces;
    }
    cutter->turns = !cutter->apart && vshi_faces_most(runs, count, &plain) > faces;
    for (size_t i = 0; i < count; ++i) {
        for (size_t f = 0; f < runs[i].faces; ++f, corners += runs[i].size) {
            size_t more;
            VSHI_TRY(vshi_face_cut(cutter, corners, runs[i].size, triangles + 3 * *made, &more, error));
            *made += more;
        }
    }
    return VSH_OK;
}

void vshi_faces_free(vshi_faces *faces) {
    free(faces->runs);
    free(faces->corners);
    *faces = (vshi_faces){0};
}
