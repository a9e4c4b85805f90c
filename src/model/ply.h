/* PLY (G. Turk, "The PLY polygon file format", 1994): vertices, and faces or the strips (element tristrips)
 * of Stanford's scans. */
#ifndef VSHI_MODEL_PLY_H
#define VSHI_MODEL_PLY_H

#include "model/faces.h"
#include "model/model.h"
#include "model/stream.h"
#include "table/ply.h"

/* What a property is to us. Of a vertex: a number that it is made of. */
enum {
    VSHI_PLY_X,
    VSHI_PLY_NX = 3,
    VSHI_PLY_U = 6,
    VSHI_PLY_NUMBERS = 8,
    VSHI_PLY_CORNERS = VSHI_PLY_NUMBERS, /* lists */
    VSHI_PLY_TEXCOORDS,
    VSHI_PLY_STRIP,
    VSHI_PLY_NOTHING
};

enum { VSHI_PLY_MOST_TEXCOORDS = 8 }; /* of one face that are kept: two for each corner */

typedef struct vshi_ply_row_property {
    int8_t type, count_type; /* as in the header */
    int8_t role;
    int8_t size, count_size; /* bytes in a binary file */
} vshi_ply_row_property;

typedef struct vshi_ply_reader {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vshi_budget budget;
    vshi_stream stream;
    vshi_ply_header head;
    vshi_ply_row_property property[VSHI_PLY_PROPERTIES];
    const vshi_ply_element *element;
    uint64_t row;
    uint64_t vertices; /* that the header names */
    bool has_normals, has_uvs;
    float *positions, *normals, *uvs;
    size_t position_capacity, normal_capacity, uv_capacity, vertex_count;
    vshi_faces faces;
    /* of the row */
    float number[VSHI_PLY_NUMBERS];
    size_t corners; /* of the face; of a strip, triangles' */
    float texcoord[VSHI_PLY_MOST_TEXCOORDS];
    size_t texcoords;
    vsh_result failed;
} vshi_ply_reader;

/* Reads a PLY, for `units` of the job. Errors: as vsh_model_read(). */
vsh_result vshi_ply_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error);

/* Reads the row at `at` into the reader's members, and its corners behind those of `faces`. Returns behind
 * it; NULL: it failed, or (reader->failed is VSH_OK) the window ends within it. */
const char *vshi_ply_read_row(vshi_ply_reader *reader, const char *at, vsh_error *error);

/* Reads rows from the window on while they are as nearly all files have them, as many as are there whole, and
 * moves stream.at and row: whatever else follows, and every error, is vshi_ply_read_row()'s. Errors:
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_ply_read_plain_rows(vshi_ply_reader *reader, int role, vsh_error *error);

/* Keeps the vertex that was read. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_ply_keep_vertex(vshi_ply_reader *reader, vsh_error *error);

#endif
