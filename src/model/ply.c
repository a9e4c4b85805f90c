#include "model/ply.h"

#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- the header */

/* Blender writes texture coordinates as s and t, MeshLab as texture_u and texture_v. */
static const struct {
    const char *name;
    int role;
} names[] = {
    {"x", VSHI_PLY_X},         {"y", VSHI_PLY_X + 1},         {"z", VSHI_PLY_X + 2}, {"nx", VSHI_PLY_NX},
    {"ny", VSHI_PLY_NX + 1},   {"nz", VSHI_PLY_NX + 2},       {"u", VSHI_PLY_U},     {"v", VSHI_PLY_U + 1},
    {"s", VSHI_PLY_U},         {"t", VSHI_PLY_U + 1},         {"tx", VSHI_PLY_U},    {"ty", VSHI_PLY_U + 1},
    {"texture_u", VSHI_PLY_U}, {"texture_v", VSHI_PLY_U + 1},
};

static int role_of(const char *element, const vshi_ply_property *property) {
    const bool list = property->count_type >= 0;
    if (strcmp(element, "tristrips") == 0) {
        return VSHI_PLY_STRIP;
    }
    if (strcmp(element, "face") == 0 && list) {
        return strcmp(property->name, "vertex_index") == 0 || strcmp(property->name, "vertex_indices") == 0
                   ? VSHI_PLY_CORNERS
               : strcmp(property->name, "texcoord") == 0 ? VSHI_PLY_TEXCOORDS
                                                         : VSHI_PLY_NOTHING;
    }
    for (size_t i = 0; strcmp(element, "vertex") == 0 && !list && i < sizeof names / sizeof names[0]; ++i) {
        if (strcmp(property->name, names[i].name) == 0) {
            return names[i].role;
        }
    }
    return VSHI_PLY_NOTHING;
}

/* Strips take the place of faces: there can be no others, and nothing but vertices in their rows. */
static vsh_result check_strips(const vshi_ply_reader *r, const vshi_ply_element *strips, vsh_error *error) {
    const vshi_ply_property *list = &r->head.property[strips->first];
    bool others = false;
    for (int e = 0; e < r->head.elements; ++e) {
        const vshi_ply_element *other = &r->head.element[e];
        others = others || strcmp(other->name, "face") == 0 ||
                 (other != strips && strcmp(other->name, "tristrips") == 0);
    }
    return strips->end == strips->first + 1 && list->count_type >= 0 && list->type < VSHI_PLY_FLOAT && !others
               ? VSH_OK
               : vshi_fail(
                     error, VSH_ERROR_UNSUPPORTED,
                     "%s: its triangles are strips ('tristrips') that are no single list of indices, or "
                     "stand beside faces: save it with faces, from MeshLab or Blender",
                     r->path);
}

static vsh_result describe(vshi_ply_reader *r, const vshi_ply_element *element, vsh_error *error) {
    const bool vertex = strcmp(element->name, "vertex") == 0, again = vertex && r->vertices > 0;
    for (int p = element->first; p < element->end; ++p) {
        const vshi_ply_property *from = &r->head.property[p];
        const bool list = from->count_type >= 0;
        r->property[p] = (vshi_ply_row_property){
            .type = from->type,
            .count_type = from->count_type,
            .role = (int8_t)(again ? VSHI_PLY_NOTHING : role_of(element->name, from)),
            .size = (int8_t)vshi_ply_size(from->type),
            .count_size = (int8_t)(list ? vshi_ply_size(from->count_type) : 0),
        };
        const int role = r->property[p].role;
        r->has_normals = r->has_normals || (role >= VSHI_PLY_NX && role < VSHI_PLY_U);
        r->has_uvs = r->has_uvs || role == VSHI_PLY_U || role == VSHI_PLY_U + 1;
    }
    r->vertices = vertex && !again ? element->count : r->vertices;
    if (r->vertices > UINT32_MAX && r->vertices > r->stream.size) {
        return VSH_OK; /* the file is too short for them, which is found where it ends */
    }
    return r->vertices > UINT32_MAX
               ? vshi_fail(error, VSH_ERROR_LIMIT, "%s: more than %u vertices", r->path, UINT32_MAX)
           : element->count > 0 && strcmp(element->name, "tristrips") == 0 ? check_strips(r, element, error)
                                                                           : VSH_OK;
}

static vsh_result read_header(vshi_ply_reader *r, vsh_error *error) {
    vshi_ply_header *head = &r->head;
    while (!head->ended) {
        const char *at = r->stream.at;
        const char *stop = at < r->stream.end ? memchr(at, '\n', (size_t)(r->stream.end - at)) : NULL;
        if (stop != NULL) {
            VSHI_TRY(vshi_ply_header_line(head, r->path, at, (size_t)(stop - at), error));
            r->stream.at = stop + 1;
        } else if (vshi_stream_ended(&r->stream)) {
            return vshi_ply_fail_header(r->path, error);
        } else {
            VSHI_TRY(vshi_stream_fill(&r->stream, error));
        }
    }
    for (int e = 0; e < head->elements; ++e) {
        VSHI_TRY(describe(r, &head->element[e], error));
    }
    return VSH_OK;
}

/* --- rows */

vsh_result vshi_ply_keep_vertex(vshi_ply_reader *r, vsh_error *error) {
    const size_t v = r->vertex_count, next = v + 1;
    VSHI_TRY(vshi_grow(&r->budget, &r->positions, &r->position_capacity, next, sizeof(float[3]), error));
    memcpy(r->positions + 3 * v, r->number + VSHI_PLY_X, sizeof(float[3]));
    if (r->has_normals) {
        VSHI_TRY(vshi_grow(&r->budget, &r->normals, &r->normal_capacity, next, sizeof(float[3]), error));
        memcpy(r->normals + 3 * v, r->number + VSHI_PLY_NX, sizeof(float[3]));
    }
    if (r->has_uvs) {
        VSHI_TRY(vshi_grow(&r->budget, &r->uvs, &r->uv_capacity, next, sizeof(float[2]), error));
        memcpy(r->uvs + 2 * v, r->number + VSHI_PLY_U, sizeof(float[2]));
    }
    ++r->vertex_count;
    return VSH_OK;
}

/* Texture coordinates of a face's corners are those of its vertices: the last face's count. */
static vsh_result keep_texcoords(vshi_ply_reader *r, const uint32_t *corners, vsh_error *error) {
    enum { LEAST = 6 };
    if (r->texcoords < LEAST || r->texcoords > VSHI_PLY_MOST_TEXCOORDS || r->corners < r->texcoords / 2) {
        return VSH_OK;
    }
    if (r->uvs == NULL && r->vertices <= r->stream.size) { /* else the file is too short for them */
        VSHI_TRY(
            vshi_reserve(&r->budget, &r->uvs, &r->uv_capacity, (size_t)r->vertices, sizeof(float[2]), error));
        memset(r->uvs, 0, r->uv_capacity * sizeof(float[2]));
    }
    for (size_t i = 0; r->uvs != NULL && i < r->texcoords / 2; ++i) {
        memcpy(r->uvs + 2 * (size_t)corners[i], r->texcoord + 2 * i, sizeof(float[2]));
    }
    return VSH_OK;
}

static vsh_result keep_row(vshi_ply_reader *r, int role, vsh_error *error) {
    vshi_faces *faces = &r->faces;
    const uint32_t *corners = faces->corners != NULL ? faces->corners + faces->count : NULL;
    if (role < VSHI_PLY_NUMBERS) {
        return vshi_ply_keep_vertex(r, error);
    }
    if (role == VSHI_PLY_STRIP) {
        for (size_t i = 0; i < r->corners; i += 3) {
            faces->count += 3;
            VSHI_TRY(vshi_faces_end_face(faces, &r->budget, 0, 3, error));
        }
        return VSH_OK;
    }
    if (role == VSHI_PLY_NOTHING) {
        return VSH_OK;
    }
    VSHI_TRY(keep_texcoords(r, corners, error));
    faces->count += r->corners;
    return vshi_faces_end_face(faces, &r->budget, 0, r->corners, error);
}

/* What an element's rows are: of vertices, faces or strips, or of nothing that is kept. */
static int role_of_rows(const vshi_ply_reader *r) {
    int role = VSHI_PLY_NOTHING;
    for (int p = r->element->first; p < r->element->end; ++p) {
        role = r->property[p].role < role ? r->property[p].role : role;
    }
    return role;
}

static vsh_result read_element(vshi_ply_reader *r, vsh_error *error) {
    const int role = role_of_rows(r);
    memset(r->number, 0, sizeof r->number);
    for (r->row = 0; r->row < r->element->count;) {
        VSHI_TRY(vshi_ply_read_plain_rows(r, role, error));
        if (r->row == r->element->count) {
            break;
        }
        const char *next = vshi_ply_read_row(r, r->stream.at, error);
        if (next != NULL) {
            VSHI_TRY(keep_row(r, role, error));
            r->stream.at = next;
            ++r->row;
        } else if (r->failed != VSH_OK) {
            return r->failed;
        } else {
            VSHI_TRY(vshi_stream_fill(&r->stream, error));
        }
    }
    return VSH_OK;
}

/* --- what it becomes */

static vsh_result check_vertices(const vshi_ply_reader *r, vsh_error *error) {
    size_t bad = 0;
    if (r->vertex_count != r->vertices) { /* faces were held against what the header names */
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: its vertices have no x, y or z", r->path);
    }
    for (size_t v = 0; v < r->vertex_count; ++v) {
        const float *p = r->positions + 3 * v;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: vertex %zu of %zu lies at (%g, %g, %g), expected finite numbers", r->path,
                             v, r->vertex_count, (double)p[0], (double)p[1], (double)p[2]);
        }
    }
    for (size_t v = 0; r->normals != NULL && v < r->vertex_count; ++v) {
        float *n = r->normals + 3 * v;
        if (!isfinite(n[0]) || !isfinite(n[1]) || !isfinite(n[2])) {
            memset(n, 0, sizeof(float[3])); /* which no direction is: flat there */
            ++bad;
        }
    }
    if (bad > 0) {
        vshi_warn(r->run, "%s: mesh '': %zu normals are not finite; those faces are flat", r->path, bad);
    }
    return VSH_OK;
}

static vsh_result make_triangles(vshi_ply_reader *r, vshi_model_shape *shape, vsh_error *error) {
    bool plain;
    size_t capacity = 0;
    vshi_faces *faces = &r->faces;
    const size_t most = vshi_faces_most(faces->runs, faces->run_count, &plain);
    if (plain || most == 0) {
        shape->indices = faces->corners;
        shape->triangle_count = most;
        faces->corners = NULL;
        return VSH_OK;
    }
    vshi_face_cutter cutter = {.positions = shape->positions, .job = r->job};
    VSHI_TRY(vshi_reserve(&r->budget, &shape->indices, &capacity, most, sizeof(uint32_t[3]), error));
    const vsh_result result = vshi_faces_cut(&cutter, faces->runs, faces->run_count, faces->corners,
                                             shape->indices, &shape->triangle_count, error);
    vshi_face_cutter_end(&cutter, r->run, r->path, "");
    return result;
}

static vsh_result build(vshi_ply_reader *r, vsh_model *model, vsh_error *error) {
    static const double world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    size_t capacity = 0;
    VSHI_TRY(check_vertices(r, error));
    VSHI_TRY(vshi_reserve(&r->budget, &model->shapes, &capacity, 1, sizeof *model->shapes, error));
    vshi_model_shape *shape = model->shapes;
    *shape = (vshi_model_shape){.positions = r->positions,
                                .normals = r->normals,
                                .uvs = {r->uvs},
                                .uv_sets = r->uvs != NULL,
                                .vertex_count = r->vertex_count,
                                .alpha = VSH_ALPHA_OPAQUE};
    r->positions = r->normals = r->uvs = NULL;
    model->shape_count = 1;
    VSHI_TRY(make_triangles(r, shape, error));
    const vshi_model_place place = {"", "", 1, 0, world, {0, 0, 0, 0}};
    return shape->triangle_count > 0 ? vshi_model_add(model, r->path, r->run, &place, error)
                                     : vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles", r->path);
}

vsh_result vshi_ply_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error) {
    vshi_ply_reader r = {.path = path, .run = run, .job = job, .budget = {path, run, 0.0}};
    vsh_model *made = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_stream_open(&r.stream, path, &r.budget, job, units, error));
    VSHI_TRY_DONE(read_header(&r, error));
    for (int e = 0; e < r.head.elements; ++e) {
        r.element = &r.head.element[e];
        VSHI_TRY_DONE(r.element->first < r.element->end ? read_element(&r, error) : VSH_OK);
    }
    vshi_stream_close(&r.stream);
    VSHI_TRY_DONE(vshi_model_create(path, &made, error));
    VSHI_TRY_DONE(build(&r, made, error));
    *model = made;
    made = NULL;
done:
    vsh_model_free(made);
    vshi_stream_close(&r.stream);
    vshi_faces_free(&r.faces);
    free(r.uvs);
    free(r.normals);
    free(r.positions);
    return result;
}
