/* A mesh's faces: corners as a file lists them, and the triangles they become. */
#ifndef VSHI_FACES_H
#define VSHI_FACES_H

#include "base/job.h"
#include "model/text.h"

/* Cuts one face after the other. Begin with positions (finite) and job, and all else 0. */
typedef struct vshi_face_cutter {
    const float *positions;
    vshi_job *job;
    bool apart; /* corners at one vertex count as two, as if each had its own */
    bool turns; /* whether polygons of four corners are turned as larger ones */
    bool begun;
    uint32_t last_first;
    size_t looked;
    size_t crossing; /* out: polygons whose edges cross */
    size_t capacity; /* memory that polygons share one after the other */
    struct vshi_polygon_corner *corners;
    uint32_t *reflex; /* corners that others must stay clear of, along `axis` */
} vshi_face_cutter;

/* Cuts the face of `count` corners, vertices of the positions, into triangles with its own winding, at most
 * count - 2: *made of them, three vertices each, in `triangles`. The corners should lie in one plane, nearly.
 * Every simple polygon is covered exactly, also one whose holes are joined to its outline by bridges, one
 * with corners on a line or twice at a place; no triangle is flipped, and none without area is made. A
 * polygon without area becomes a fan without area. Where edges cross, some triangles are made. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_face_cut(vshi_face_cutter *cutter, const uint32_t *corners, size_t count, uint32_t *triangles,
                         size_t *made, vsh_error *error);

/* Frees the cutter, and warns if edges of polygons cross in mesh `name`. */
void vshi_face_cutter_end(vshi_face_cutter *cutter, const vsh_run *run, const char *path, const char *name);

/* Consecutive faces with the same number of corners. */
typedef struct vshi_face_run {
    size_t faces, size;
} vshi_face_run;

/* Faces that are being read. */
typedef struct vshi_faces {
    uint32_t *corners;
    size_t count, capacity;
    vshi_face_run *runs;
    size_t run_count, run_capacity;
} vshi_faces;

/* Of some of the runs: the triangles they make at most, and whether they are triangles already. */
size_t vshi_faces_most(const vshi_face_run *runs, size_t count, bool *triangles);

/* The last `size` corners are a face of a mesh that begins at run `first_run`. */
static inline vsh_result vshi_faces_end_face(vshi_faces *faces, vshi_budget *budget, size_t first_run,
                                             size_t size, vsh_error *error) {
    const size_t last = faces->run_count - 1;
    if (faces->run_count > first_run && faces->runs[last].size == size) {
        ++faces->runs[last].faces;
        return VSH_OK;
    }
    const vsh_result result = vshi_grow(budget, &faces->runs, &faces->run_capacity, faces->run_count + 1,
                                        sizeof *faces->runs, error);
    if (result == VSH_OK) {
        faces->runs[faces->run_count++] = (vshi_face_run){1, size};
    }
    return result;
}

/* Cuts all faces of some runs, whose corners these are. */
vsh_result vshi_faces_cut(vshi_face_cutter *cutter, const vshi_face_run *runs, size_t count,
                          const uint32_t *corners, uint32_t *triangles, size_t *made, vsh_error *error);

void vshi_faces_free(vshi_faces *faces);

#endif
