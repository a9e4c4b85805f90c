/* Reads PLY (G. Turk, "The PLY polygon file format", 1994): vertices and faces. Assimp 5.2 repeats or invents
 * the faces and vertices that a file lacks at its end. */
#include "base/bytes.h"
#include "base/decimal.h"
#include "base/memory.h"
#include "base/vec.h"
#include "io/model/faces.h"
#include "io/model/model.h"
#include "io/model/text.h"
#include "io/table.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Roles of properties. Roles below ROLE_NUMBERS are numbers of vertices. */
enum {
    ROLE_X,
    ROLE_NX = 3,
    ROLE_U = 6,
    ROLE_NUMBERS = 8,
    ROLE_CORNERS = ROLE_NUMBERS, /* a list */
    ROLE_NONE
};

typedef struct ply_reader {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vshi_budget budget;
    vshi_text text;
    vshi_ply_header head;
    int8_t roles[VSHI_PLY_PROPERTIES];
    const vshi_ply_element *element;
    uint64_t row;
    uint64_t vertices; /* in the header */
    bool has_normals, has_uvs;
    float *positions, *normals, *uvs;
    size_t position_capacity, normal_capacity, uv_capacity, vertex_count;
    vshi_faces faces;
    /* the current row */
    const char *at, *end;
    float number[ROLE_NUMBERS];
    size_t corners; /* of the face */
} ply_reader;

/* --- the header */

/* Blender writes texture coordinates as s and t, MeshLab as texture_u and texture_v. */
static const struct {
    const char *name;
    int role;
} names[] = {
    {"x", ROLE_X},         {"y", ROLE_X + 1},         {"z", ROLE_X + 2}, {"nx", ROLE_NX},
    {"ny", ROLE_NX + 1},   {"nz", ROLE_NX + 2},       {"u", ROLE_U},     {"v", ROLE_U + 1},
    {"s", ROLE_U},         {"t", ROLE_U + 1},         {"tx", ROLE_U},    {"ty", ROLE_U + 1},
    {"texture_u", ROLE_U}, {"texture_v", ROLE_U + 1},
};

static int find_role(const char *element, const vshi_ply_property *property) {
    const bool list = property->count_type >= 0;
    if (strcmp(element, "face") == 0 && list && property->type < VSHI_PLY_FLOAT) {
        return strcmp(property->name, "vertex_index") == 0 || strcmp(property->name, "vertex_indices") == 0
                   ? ROLE_CORNERS
                   : ROLE_NONE;
    }
    for (size_t i = 0; strcmp(element, "vertex") == 0 && !list && i < sizeof names / sizeof names[0]; ++i) {
        if (strcmp(property->name, names[i].name) == 0) {
            return names[i].role;
        }
    }
    return ROLE_NONE;
}

static vsh_result find_roles(ply_reader *r, const vshi_ply_element *element, vsh_error *error) {
    const bool vertex = strcmp(element->name, "vertex") == 0, again = vertex && r->vertices > 0;
    for (int p = element->first; p < element->end; ++p) {
        const int role = again ? ROLE_NONE : find_role(element->name, &r->head.property[p]);
        r->roles[p] = (int8_t)role;
        r->has_normals = r->has_normals || (role >= ROLE_NX && role < ROLE_U);
        r->has_uvs = r->has_uvs || role == ROLE_U || role == ROLE_U + 1;
    }
    r->vertices = vertex && !again ? element->count : r->vertices;
    if (r->vertices > UINT32_MAX && r->vertices > r->text.size) {
        return VSH_OK; /* the file is too short for them, so reading it fails */
    }
    return r->vertices > UINT32_MAX
               ? vshi_fail(error, VSH_ERROR_LIMIT, "%s: more than %u vertices", r->path, UINT32_MAX)
           : element->count > 0 && strcmp(element->name, "tristrips") == 0
               ? vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                           "%s: its triangles are strips ('tristrips'): save it with faces, from MeshLab or "
                           "Blender",
                           r->path)
               : VSH_OK;
}

static vsh_result read_header(ply_reader *r, vsh_error *error) {
    vshi_ply_header *head = &r->head;
    r->at = r->text.bytes;
    r->end = r->at + r->text.size;
    while (!head->ended) {
        const char *stop = r->at < r->end ? memchr(r->at, '\n', (size_t)(r->end - r->at)) : NULL;
        if (stop == NULL) {
            return vshi_ply_fail_header(r->path, error);
        }
        VSHI_TRY(vshi_ply_header_line(head, r->path, r->at, (size_t)(stop - r->at), error));
        r->at = stop + 1;
    }
    for (int e = 0; e < head->elements; ++e) {
        VSHI_TRY(find_roles(r, &head->element[e], error));
    }
    return VSH_OK;
}

/* --- rows */

/* Adds the vertex of the row. */
static vsh_result add_vertex(ply_reader *r, vsh_error *error) {
    const size_t v = r->vertex_count, next = v + 1;
    VSHI_TRY(vshi_grow(&r->budget, &r->positions, &r->position_capacity, next, sizeof(float[3]), error));
    memcpy(r->positions + 3 * v, r->number + ROLE_X, sizeof(float[3]));
    if (r->has_normals) {
        VSHI_TRY(vshi_grow(&r->budget, &r->normals, &r->normal_capacity, next, sizeof(float[3]), error));
        memcpy(r->normals + 3 * v, r->number + ROLE_NX, sizeof(float[3]));
    }
    if (r->has_uvs) {
        VSHI_TRY(vshi_grow(&r->budget, &r->uvs, &r->uv_capacity, next, sizeof(float[2]), error));
        memcpy(r->uvs + 2 * v, r->number + ROLE_U, sizeof(float[2]));
    }
    ++r->vertex_count;
    return VSH_OK;
}

/* --- parsing rows */

static vsh_result fail_short(const ply_reader *r, vsh_error *error) {
    return vshi_ply_fail_short(r->path, r->element, r->row, error);
}

static vsh_result fail_value(const ply_reader *r, vshi_token token, const char *expected, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s %" PRIu64 " holds '%.*s', expected %s", r->path,
                     r->element->name, r->row, VSHI_TOKEN_ARGS(token), expected);
}

static vsh_result push_index(ply_reader *r, int64_t index, vsh_error *error) {
    if (index < 0 || (uint64_t)index >= r->vertices) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: %s %" PRIu64 " uses vertex %" PRId64 ", but there are only %" PRIu64, r->path,
                         r->element->name, r->row, index, r->vertices);
    }
    vshi_faces *faces = &r->faces;
    const size_t at = faces->count + r->corners++;
    VSHI_TRY(VSHI_GROW(&r->budget, faces->corners, faces->capacity, at + 1, error));
    faces->corners[at] = (uint32_t)index;
    return VSH_OK;
}

static void set_number(ply_reader *r, int role, float number) {
    if (role < ROLE_NUMBERS) {
        r->number[role] = number;
    }
}

/* --- text */

static vsh_result read_text_value(ply_reader *r, int role, vsh_error *error) {
    const vshi_token token = vshi_scan_token(&r->at, r->end);
    if (token.text == NULL) {
        return fail_short(r, error);
    }
    if (role == ROLE_CORNERS) {
        int64_t index;
        return vshi_token_integer(token, &index) && index >= 0
                   ? push_index(r, index, error)
                   : fail_value(r, token, "an index of a vertex", error);
    }
    float number;
    const bool is_number = vshi_decimal_float(token.text, &number) == token.text + token.size;
    /* "nan" and "inf" are no positions, but may be other values */
    if (role < ROLE_NX ? !is_number || !isfinite(number)
                       : !is_number && vshi_token_number(token) != VSHI_NUMBER_NOT_FINITE) {
        return fail_value(r, token, "a finite number", error);
    }
    set_number(r, role, is_number ? number : NAN);
    return VSH_OK;
}

static vsh_result read_text_property(ply_reader *r, const vshi_ply_property *property, int role,
                                     vsh_error *error) {
    int64_t values = 1;
    if (property->count_type >= 0) {
        const vshi_token token = vshi_scan_token(&r->at, r->end);
        if (token.text == NULL) {
            return fail_short(r, error);
        }
        if (!vshi_token_integer(token, &values) || values < 0) {
            return fail_value(r, token, "a list's length", error);
        }
    }
    for (int64_t i = 0; i < values; ++i) {
        VSHI_TRY(read_text_value(r, role, error));
    }
    return VSH_OK;
}

/* --- binary */

static vsh_result read_binary_property(ply_reader *r, const vshi_ply_property *property, int role,
                                       vsh_error *error) {
    const bool big = r->head.big_endian;
    const int size = vshi_ply_size(property->type);
    uint64_t values = 1;
    if (property->count_type >= 0) {
        const int count_size = vshi_ply_size(property->count_type);
        if (r->end - r->at < count_size) {
            return fail_short(r, error);
        }
        values = vshi_bytes_number(r->at, count_size, big);
        r->at += count_size;
    }
    if (values > (uint64_t)(r->end - r->at) / (uint64_t)size) {
        return fail_short(r, error);
    }
    const char *at = r->at;
    r->at += values * (uint64_t)size;
    for (; role != ROLE_NONE && at < r->at; at += size) {
        if (role != ROLE_CORNERS) {
            set_number(r, role, (float)vshi_ply_number(at, property->type, big));
        } else {
            VSHI_TRY(push_index(r, vshi_bytes_integer(at, size, property->type % 2 == 0, big), error));
        }
    }
    return VSH_OK;
}

/* Reads a row into the reader's members, and its corners after those of `faces`. */
static vsh_result read_row(ply_reader *r, vsh_error *error) {
    r->corners = 0;
    for (int p = r->element->first; p < r->element->end; ++p) {
        const vshi_ply_property *property = &r->head.property[p];
        VSHI_TRY(r->head.ascii ? read_text_property(r, property, r->roles[p], error)
                               : read_binary_property(r, property, r->roles[p], error));
    }
    return VSH_OK;
}

static vsh_result add_row(ply_reader *r, int role, vsh_error *error) {
    if (role < ROLE_NUMBERS) {
        return add_vertex(r, error);
    }
    if (role == ROLE_NONE) {
        return VSH_OK;
    }
    r->faces.count += r->corners;
    return vshi_faces_end_face(&r->faces, &r->budget, 0, r->corners, error);
}

/* Finds the role of an element's rows: the first of their roles. */
static int find_row_role(const ply_reader *r) {
    int role = ROLE_NONE;
    for (int p = r->element->first; p < r->element->end; ++p) {
        role = r->roles[p] < role ? r->roles[p] : role;
    }
    return role;
}

static vsh_result read_element(ply_reader *r, vsh_error *error) {
    const int role = find_row_role(r);
    memset(r->number, 0, sizeof r->number);
    for (r->row = 0; r->row < r->element->count; ++r->row) {
        VSHI_TRY(vshi_text_poll(&r->text, r->at, error));
        VSHI_TRY(read_row(r, error));
        VSHI_TRY(add_row(r, role, error));
    }
    return VSH_OK;
}

/* --- the model */

static vsh_result make_triangles(ply_reader *r, vshi_model_shape *shape, vsh_error *error) {
    bool plain;
    vshi_faces *faces = &r->faces;
    const size_t most = vshi_faces_count_triangles(faces->runs, faces->run_count, &plain);
    if (plain || most == 0) {
        shape->indices = faces->corners;
        shape->triangle_count = most;
        faces->corners = NULL;
        return VSH_OK;
    }
    vshi_face_cutter cutter = {.positions = shape->positions, .job = r->job};
    VSHI_TRY(vshi_reserve(&r->budget, &shape->indices, &(size_t){0}, most, sizeof(uint32_t[3]), error));
    const vsh_result result = vshi_faces_cut(&cutter, faces->runs, faces->run_count, faces->corners,
                                             shape->indices, &shape->triangle_count, error);
    vshi_face_cutter_end(&cutter, r->run, r->path, "");
    return result;
}

static vsh_result build(ply_reader *r, vsh_model *model, vsh_error *error) {
    if (r->vertex_count != r->vertices) { /* faces may use all vertices of the header */
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: its vertices have no x, y or z", r->path);
    }
    VSHI_TRY(vshi_model_check_positions(r->path, "", r->positions, r->vertex_count, error));
    VSHI_TRY(VSHI_RESERVE(&r->budget, model->shapes, 1, error));
    vshi_model_shape *shape = model->shapes;
    *shape = (vshi_model_shape){.positions = r->positions,
                                .normals = r->normals,
                                .uvs = {r->uvs},
                                .uv_sets = r->uvs != NULL,
                                .vertex_count = r->vertex_count,
                                .alpha = VSH_ALPHA_OPAQUE};
    r->positions = r->normals = r->uvs = NULL;
    model->shape_count = 1;
    vshi_model_check_normals(r->path, r->run, "mesh ''", shape);
    VSHI_TRY(make_triangles(r, shape, error));
    const vshi_model_place place = {"", "", 1, 0, vshi_identity, {0, 0, 0, 0}};
    return shape->triangle_count > 0 ? vshi_model_add(model, r->path, r->run, &place, error) : VSH_OK;
}

vsh_result vshi_ply_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error) {
    ply_reader r = {.path = path, .run = run, .job = job, .budget = {path, run, 0.0}};
    vsh_model *made = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_text_read(&r.text, path, path, &r.budget, job, units, error));
    VSHI_TRY_DONE(read_header(&r, error));
    for (int e = 0; e < r.head.elements; ++e) {
        r.element = &r.head.element[e];
        VSHI_TRY_DONE(r.element->first < r.element->end ? read_element(&r, error) : VSH_OK);
    }
    VSHI_TRY_DONE(vshi_text_poll(&r.text, r.end, error));
    vshi_text_free(&r.text);
    VSHI_TRY_DONE(VSHI_ALLOCATE(made, 1, path, error));
    VSHI_TRY_DONE(build(&r, made, error));
    *model = made;
    made = NULL;
done:
    vsh_model_free(made);
    vshi_text_free(&r.text);
    vshi_faces_free(&r.faces);
    free(r.uvs);
    free(r.normals);
    free(r.positions);
    return result;
}
