/* PLY (G. Turk, "The PLY polygon file format", 1994): vertices, and faces or the strips (element tristrips)
 * of Stanford's scans. */
#include "table/ply.h"
#include "base/bytes.h"
#include "base/decimal.h"
#include "base/memory.h"
#include "model/faces.h"
#include "model/model.h"
#include "model/text.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Meanings of properties. Vertices have numbers, which are below VSHI_PLY_NUMBERS. */
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
    uint64_t vertices; /* that the header names */
    bool has_normals, has_uvs;
    float *positions, *normals, *uvs;
    size_t position_capacity, normal_capacity, uv_capacity, vertex_count;
    vshi_faces faces;
    /* of the row that is read */
    const char *at, *end;
    vsh_error *error;
    int64_t last[2]; /* indices of the strip, of which `length` have been read */
    size_t length;
    float number[VSHI_PLY_NUMBERS];
    size_t corners; /* of the face; of a strip, triangles' */
    float texcoord[VSHI_PLY_MOST_TEXCOORDS];
    size_t texcoords;
    vsh_result failed;
} ply_reader;

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
static vsh_result check_strips(const ply_reader *r, const vshi_ply_element *strips, vsh_error *error) {
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

static vsh_result describe(ply_reader *r, const vshi_ply_element *element, vsh_error *error) {
    const bool vertex = strcmp(element->name, "vertex") == 0, again = vertex && r->vertices > 0;
    for (int p = element->first; p < element->end; ++p) {
        const int role = again ? VSHI_PLY_NOTHING : role_of(element->name, &r->head.property[p]);
        r->roles[p] = (int8_t)role;
        r->has_normals = r->has_normals || (role >= VSHI_PLY_NX && role < VSHI_PLY_U);
        r->has_uvs = r->has_uvs || role == VSHI_PLY_U || role == VSHI_PLY_U + 1;
    }
    r->vertices = vertex && !again ? element->count : r->vertices;
    if (r->vertices > UINT32_MAX && r->vertices > r->text.size) {
        return VSH_OK; /* the file is too short for them, which is found where it ends */
    }
    return r->vertices > UINT32_MAX
               ? vshi_fail(error, VSH_ERROR_LIMIT, "%s: more than %u vertices", r->path, UINT32_MAX)
           : element->count > 0 && strcmp(element->name, "tristrips") == 0 ? check_strips(r, element, error)
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
        VSHI_TRY(describe(r, &head->element[e], error));
    }
    return VSH_OK;
}

/* --- rows */

/* Keeps the vertex that was read. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result keep_vertex(ply_reader *r, vsh_error *error) {
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

/* --- parsing rows */

static bool fail(ply_reader *r, vsh_result result) {
    r->failed = result;
    return false;
}

static bool fail_short(ply_reader *r) {
    return fail(r, vshi_ply_fail_short(r->path, r->element, r->row, r->error));
}

static bool fail_value(ply_reader *r, vshi_token token, const char *expected) {
    return fail(r, vshi_fail(r->error, VSH_ERROR_INPUT, "%s: %s %" PRIu64 " holds '%.*s', expected %s",
                             r->path, r->element->name, r->row, VSHI_TOKEN_ARGS(token), expected));
}

static bool push_corner(ply_reader *r, uint32_t corner) {
    vshi_faces *faces = &r->faces;
    const size_t at = faces->count + r->corners++;
    const vsh_result result =
        vshi_grow(&r->budget, &faces->corners, &faces->capacity, at + 1, sizeof *faces->corners, r->error);
    if (result != VSH_OK) {
        return fail(r, result);
    }
    faces->corners[at] = corner;
    return true;
}

static bool check_index(ply_reader *r, int64_t index) {
    return index >= 0 && (uint64_t)index < r->vertices
               ? true
               : fail(r, vshi_fail(r->error, VSH_ERROR_INPUT,
                                   "%s: %s %" PRIu64 " uses vertex %" PRId64 ", but there are only %" PRIu64,
                                   r->path, r->element->name, r->row, index, r->vertices));
}

/* The next index of a strip; -1 begins another. Every second triangle of a strip runs the other way around;
 * those of fewer than three vertices, by which strips are joined, are left out. */
static bool push_strip(ply_reader *r, int64_t index) {
    if (index == -1) {
        r->length = 0;
        return true;
    }
    if (!check_index(r, index)) {
        return false;
    }
    const int64_t a = r->last[0], b = r->last[1];
    r->last[0] = b;
    r->last[1] = index;
    if (r->length++ < 2 || a == b || b == index || a == index) {
        return true;
    }
    const bool odd = r->length % 2 == 0;
    return push_corner(r, (uint32_t)(odd ? b : a)) && push_corner(r, (uint32_t)(odd ? a : b)) &&
           push_corner(r, (uint32_t)index);
}

static bool push_index(ply_reader *r, int role, int64_t index) {
    return role == VSHI_PLY_STRIP ? push_strip(r, index)
                                  : check_index(r, index) && push_corner(r, (uint32_t)index);
}

static void push_number(ply_reader *r, int role, float number) {
    if (role < VSHI_PLY_NUMBERS) {
        r->number[role] = number;
    } else if (role == VSHI_PLY_TEXCOORDS) {
        if (r->texcoords < VSHI_PLY_MOST_TEXCOORDS) {
            r->texcoord[r->texcoords] = number;
        }
        ++r->texcoords;
    }
}

/* --- text */

static bool next_token(ply_reader *r, vshi_token *token) {
    *token = vshi_scan_token(&r->at, r->end);
    return token->text != NULL ? true : fail_short(r);
}

static bool take_text(ply_reader *r, int role) {
    static const char finite[] = "a finite number";
    vshi_token token;
    if (!next_token(r, &token)) {
        return false;
    }
    if (role == VSHI_PLY_CORNERS || role == VSHI_PLY_STRIP) {
        int64_t index;
        return vshi_token_integer(token, &index) && (index >= 0 || role == VSHI_PLY_STRIP)
                   ? push_index(r, role, index)
                   : fail_value(r, token, "an index of a vertex");
    }
    float number;
    if (vshi_decimal_float(token.text, &number) != token.text + token.size) {
        /* no place is there, but other things may be so */
        if (vshi_token_number(token) != VSHI_NUMBER_NOT_FINITE || role < VSHI_PLY_NX) {
            return fail_value(r, token, finite);
        }
        number = NAN;
    } else if (role < VSHI_PLY_NX && !isfinite(number)) {
        return fail_value(r, token, finite);
    }
    push_number(r, role, number);
    return true;
}

static bool take_text_property(ply_reader *r, const vshi_ply_property *property, int role) {
    int64_t values = 1;
    if (property->count_type >= 0) {
        vshi_token token;
        if (!next_token(r, &token)) {
            return false;
        }
        if (!vshi_token_integer(token, &values) || values < 0) {
            return fail_value(r, token, "a list's length");
        }
    }
    for (int64_t i = 0; i < values; ++i) {
        if (!take_text(r, role)) {
            return false;
        }
    }
    return true;
}

/* --- binary */

/* Indices that are floats (nobody writes them so) are whole, or none. */
static int64_t index_at(const char *at, int type, bool big_endian) {
    if (type < VSHI_PLY_FLOAT) {
        return vshi_bytes_integer(at, 1 << type / 2, type % 2 == 0, big_endian);
    }
    const float number = (float)vshi_ply_number(at, type, big_endian);
    return number >= 0.0F && number <= 16777216.0F && floorf(number) == number ? (int64_t)number : -2;
}

static bool take_binary_property(ply_reader *r, const vshi_ply_property *property, int role) {
    const bool big = r->head.big_endian;
    const int size = vshi_ply_size(property->type);
    uint64_t values = 1;
    if (property->count_type >= 0) {
        const int count_size = vshi_ply_size(property->count_type);
        if (r->end - r->at < count_size) {
            return fail_short(r);
        }
        values = vshi_bytes_number(r->at, count_size, big);
        r->at += count_size;
    }
    if (values > (uint64_t)(r->end - r->at) / (uint64_t)size) {
        return fail_short(r);
    }
    const char *at = r->at;
    r->at += values * (uint64_t)size;
    for (; role != VSHI_PLY_NOTHING && at < r->at; at += size) {
        if (role != VSHI_PLY_CORNERS && role != VSHI_PLY_STRIP) {
            push_number(r, role, (float)vshi_ply_number(at, property->type, big));
        } else if (!push_index(r, role, index_at(at, property->type, big))) {
            return false;
        }
    }
    return true;
}

/* Reads a row into the reader's members, and its corners behind those of `faces`. */
static vsh_result read_row(ply_reader *r, vsh_error *error) {
    r->error = error;
    r->corners = r->texcoords = r->length = 0;
    for (int p = r->element->first; p < r->element->end; ++p) {
        const vshi_ply_property *property = &r->head.property[p];
        if (!(r->head.ascii ? take_text_property(r, property, r->roles[p])
                            : take_binary_property(r, property, r->roles[p]))) {
            return r->failed;
        }
    }
    return VSH_OK;
}

/* Texture coordinates of a face's corners are those of its vertices: the last face's count. */
static vsh_result keep_texcoords(ply_reader *r, const uint32_t *corners, vsh_error *error) {
    enum { LEAST = 6 };
    if (r->texcoords < LEAST || r->texcoords > VSHI_PLY_MOST_TEXCOORDS || r->corners < r->texcoords / 2) {
        return VSH_OK;
    }
    if (r->uvs == NULL && r->vertices <= r->text.size) { /* else the file is too short for them */
        VSHI_TRY(
            vshi_reserve(&r->budget, &r->uvs, &r->uv_capacity, (size_t)r->vertices, sizeof(float[2]), error));
        memset(r->uvs, 0, r->uv_capacity * sizeof(float[2]));
    }
    for (size_t i = 0; r->uvs != NULL && i < r->texcoords / 2; ++i) {
        memcpy(r->uvs + 2 * (size_t)corners[i], r->texcoord + 2 * i, sizeof(float[2]));
    }
    return VSH_OK;
}

static vsh_result keep_row(ply_reader *r, int role, vsh_error *error) {
    vshi_faces *faces = &r->faces;
    const uint32_t *corners = faces->corners != NULL ? faces->corners + faces->count : NULL;
    if (role < VSHI_PLY_NUMBERS) {
        return keep_vertex(r, error);
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
static int role_of_rows(const ply_reader *r) {
    int role = VSHI_PLY_NOTHING;
    for (int p = r->element->first; p < r->element->end; ++p) {
        role = r->roles[p] < role ? r->roles[p] : role;
    }
    return role;
}

static vsh_result read_element(ply_reader *r, vsh_error *error) {
    const int role = role_of_rows(r);
    memset(r->number, 0, sizeof r->number);
    for (r->row = 0; r->row < r->element->count; ++r->row) {
        VSHI_TRY(vshi_text_poll(&r->text, r->at, error));
        VSHI_TRY(read_row(r, error));
        VSHI_TRY(keep_row(r, role, error));
    }
    return VSH_OK;
}

/* --- what it becomes */

static vsh_result make_triangles(ply_reader *r, vshi_model_shape *shape, vsh_error *error) {
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

static vsh_result build(ply_reader *r, vsh_model *model, vsh_error *error) {
    static const double world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    size_t capacity = 0;
    if (r->vertex_count != r->vertices) { /* faces have been checked against the header's number */
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: its vertices have no x, y or z", r->path);
    }
    VSHI_TRY(vshi_model_check_positions(r->path, "", r->positions, r->vertex_count, error));
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
    vshi_model_check_normals(r->path, r->run, "mesh ''", shape);
    VSHI_TRY(make_triangles(r, shape, error));
    const vshi_model_place place = {"", "", 1, 0, world, {0, 0, 0, 0}};
    return shape->triangle_count > 0 ? vshi_model_add(model, r->path, r->run, &place, error)
                                     : vshi_fail(error, VSH_ERROR_INPUT, "%s: holds no triangles", r->path);
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
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, path, error));
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
