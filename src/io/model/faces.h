/* A mesh's faces: corners as a file lists them, and the triangles they become. */
#pragma once

#include "base/job.h"
#include "io/model/text.h"

/* Cuts one face after the other. Begins with positions (finite) and job; all else is 0. */
typedef struct vshi_face_cutter {
    const float *positions;
    vshi_job *job;
    bool apart; /* treats corners at one vertex as two vertices */
    bool turns; /* whether quads are turned like larger polygons */
    bool begun;
    uint32_t last_first;
    size_t faces;    /* so far */
    size_t crossing; /* out: polygons whose edges cross */
    size_t capacity; /* of the arrays below, which polygons share */
    struct vshi_polygon_corner *corners;
    uint32_t *reflex; /* corners that may lie in ears, sorted */
} vshi_face_cutter;

/* Cuts a face of `count` corners, which are vertices of the positions, into *made triangles, at most count -
 * 2, with the same winding. The corners should nearly lie in one plane. Covers every simple polygon exactly,
 * also with holes that bridges join to the outline, with corners on a line, or twice at a place. Makes no
 * flipped triangles, and none without area. A polygon without area becomes a fan without area. If edges
 * cross, it still makes triangles. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_face_cut(vshi_face_cutter *cutter, const uint32_t *corners, size_t count, uint32_t *triangles,
                         size_t *made, vsh_error *error);

/* Frees the cutter, and warns if edges of polygons cross in mesh `name`. */
void vshi_face_cutter_end(vshi_face_cutter *cutter, const vsh_run *run, const char *path, const char *name);

/* Consecutive faces with the same number of corners. */
typedef struct vshi_face_run {
    size_t faces, size;
} vshi_face_run;

/* The faces of a file so far. */
typedef struct vshi_faces {
    uint32_t *corners;
    size_t count, capacity;
    vshi_face_run *runs;
    size_t run_count, run_capacity;
} vshi_faces;

/* Counts the triangles that some runs make at most. *triangles: all their faces are triangles. */
size_t vshi_faces_count_triangles(const vshi_face_run *runs, size_t count, bool *triangles);

/* Ends a face with the last `size` corners, in a mesh that begins at run `first_run`. */
static inline vsh_result vshi_faces_end_face(vshi_faces *faces, vshi_budget *budget, size_t first_run,
                                             size_t size, vsh_error *error) {
    const size_t last = faces->run_count - 1;
    if (faces->run_count > first_run && faces->runs[last].size == size) {
        ++faces->runs[last].faces;
        return VSH_OK;
    }
    VSHI_TRY(VSHI_GROW(budget, faces->runs, faces->run_capacity, faces->run_count + 1, error));
    faces->runs[faces->run_count++] = (vshi_face_run){1, size};
    return VSH_OK;
}

/* Cuts all faces of some runs with these corners. */
vsh_result vshi_faces_cut(vshi_face_cutter *cutter, const vshi_face_run *runs, size_t count,
                          const uint32_t *corners, uint32_t *triangles, size_t *made, vsh_error *error);

void vshi_faces_free(vshi_faces *faces);
