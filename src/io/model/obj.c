/* Reads the statements of an OBJ. Numbers vertices in the order of faces: corners of a mesh with the same
 * position, texture coordinate and normal are one vertex. */
#include "io/model/obj.h"

#include "base/decimal.h"
#include "base/memory.h"
#include "base/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Objects, groups and materials split an OBJ's faces into meshes, with names as in Assimp 5.2, so that bakes
 * keep the names of objects. A group is an object. Another material begins another mesh of it, with the
 * material's name. */

static const char unnamed[] = "defaultobject";

static vsh_result name_number(vshi_obj *obj, const char *name, size_t size, size_t *number,
                              vsh_error *error) {
    bool is_new;
    VSHI_TRY(vshi_words_number(&obj->names, &obj->budget, name, size, number, &is_new, error));
    VSHI_TRY(VSHI_GROW(&obj->budget, obj->object_of, obj->object_of_capacity, obj->names.count, error));
    if (is_new) {
        obj->object_of[*number] = 0;
    }
    return VSH_OK;
}

static vsh_result add_mesh(vshi_obj *obj, size_t name, vsh_error *error) {
    VSHI_TRY(VSHI_GROW(&obj->budget, obj->meshes, obj->mesh_capacity, obj->mesh_count + 1, error));
    obj->mesh = obj->mesh_count++;
    obj->meshes[obj->mesh] = (vshi_obj_mesh){.name = name,
                                             .material = obj->material,
                                             .first_vertex = obj->vertex_count,
                                             .first_corner = obj->faces.count,
                                             .first_run = obj->faces.run_count};
    vshi_obj_object *object = &obj->objects[obj->object];
    if (object->last_mesh == SIZE_MAX) {
        object->first_mesh = obj->mesh;
    } else {
        obj->meshes[object->last_mesh].next = obj->mesh + 1;
    }
    object->last_mesh = obj->mesh;
    return VSH_OK;
}

static vsh_result add_object(vshi_obj *obj, size_t name, vsh_error *error) {
    VSHI_TRY(VSHI_GROW(&obj->budget, obj->objects, obj->object_capacity, obj->object_count + 1, error));
    obj->object = obj->object_count++;
    obj->objects[obj->object] =
        (vshi_obj_object){.name = name, .first_mesh = SIZE_MAX, .last_mesh = SIZE_MAX};
    obj->object_of[name] = obj->object_of[name] == 0 ? obj->object_count : obj->object_of[name];
    return add_mesh(obj, name, error);
}

/* Makes sure that there is a mesh for faces, lines or points. */
static vsh_result require_mesh(vshi_obj *obj, vsh_error *error) {
    if (obj->object == SIZE_MAX) {
        size_t name;
        VSHI_TRY(name_number(obj, unnamed, sizeof unnamed - 1, &name, error));
        VSHI_TRY(add_object(obj, name, error));
    }
    obj->meshes[obj->mesh].used = true;
    return VSH_OK;
}

static vsh_result set_object(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    size_t name, length = 0;
    while (length < size && text[length] != ' ' && text[length] != '\t') {
        ++length;
    }
    if (length == 0) {
        return VSH_OK;
    }
    VSHI_TRY(name_number(obj, text, length, &name, error));
    if (obj->object_of[name] == 0) {
        return add_object(obj, name, error);
    }
    if (obj->object_of[name] - 1 == obj->object) {
        return VSH_OK;
    }
    obj->object = obj->object_of[name] - 1;
    return add_mesh(obj, name, error);
}

static vsh_result set_group(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    size_t name;
    if (size == 0 && obj->group == SIZE_MAX) {
        return VSH_OK;
    }
    VSHI_TRY(name_number(obj, text, size, &name, error));
    const bool same = name == obj->group;
    obj->group = name;
    return same ? VSH_OK : add_object(obj, name, error);
}

vsh_result vshi_obj_material(vshi_obj *obj, const char *name, size_t size, size_t *number, bool *is_new,
                             vsh_error *error) {
    VSHI_TRY(vshi_words_number(&obj->materials, &obj->budget, name, size, number, is_new, error));
    VSHI_TRY(VSHI_GROW(&obj->budget, obj->alphas, obj->alpha_capacity, obj->materials.count, error));
    if (*is_new) {
        obj->alphas[*number] = (vshi_obj_alpha){.opacity = 1.0};
    }
    return VSH_OK;
}

static vsh_result set_material(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    size_t material, name;
    bool is_new;
    if (size == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_obj_material(obj, text, size, &material, &is_new, error));
    if (material == obj->material) {
        return VSH_OK;
    }
    obj->material = material;
    if (obj->mesh == SIZE_MAX) {
        return VSH_OK;
    }
    const vshi_obj_mesh *mesh = &obj->meshes[obj->mesh];
    if (mesh->used && mesh->material != SIZE_MAX && mesh->material != material) {
        VSHI_TRY(name_number(obj, text, size, &name, error));
        VSHI_TRY(add_mesh(obj, name, error));
    }
    obj->meshes[obj->mesh].material = material;
    return VSH_OK;
}

static const struct {
    const char *name;
    int least, kept; /* numbers: required; kept */
} kinds[VSHI_OBJ_KINDS] = {
    {"vertex", 3, 3},
    {"texture coordinate", 1, 2},
    {"normal", 3, 3},
};

/* --- the model */

/* Each mesh ends where the next one begins. */
static size_t vertex_end(const vshi_obj *obj, size_t mesh) {
    return mesh + 1 < obj->mesh_count ? obj->meshes[mesh + 1].first_vertex : obj->vertex_count;
}

static size_t run_end(const vshi_obj *obj, size_t mesh) {
    return mesh + 1 < obj->mesh_count ? obj->meshes[mesh + 1].first_run : obj->faces.run_count;
}

/* Copies the values of one kind to array `number` of the shapes, with zeros for corners without values. Frees
 * the values.
 */
static vsh_result copy_values(vshi_obj *obj, int kind, int number, vsh_model *model, vsh_error *error) {
    vshi_obj_values *values = &obj->kinds[kind];
    for (size_t m = 0; m < obj->mesh_count; ++m) {
        const vshi_model_array array = vshi_model_array_of(&model->shapes[m], number);
        const size_t first = obj->meshes[m].first_vertex;
        size_t capacity = 0;
        if (!obj->meshes[m].has[kind]) {
            continue;
        }
        VSHI_TRY(vshi_reserve(&obj->budget, array.at, &capacity, array.count, array.size, error));
        for (size_t v = 0; v < array.count; ++v) {
            const uint32_t part = obj->vertices[first + v].part[kind];
            char *to = (char *)*array.at + array.size * v;
            if (part > 0) {
                memcpy(to, (const char *)values->values + array.size * (part - 1), array.size);
            } else {
                memset(to, 0, array.size);
            }
        }
    }
    free(values->values);
    obj->budget.bytes -= (double)(values->capacity * (size_t)kinds[kind].kept * sizeof(float));
    *values = (vshi_obj_values){0};
    return VSH_OK;
}

/* Cuts the faces into triangles, or copies their corners if all are triangles. */
static vsh_result make_triangles(vshi_obj *obj, size_t m, vshi_model_shape *shape, vsh_error *error) {
    const vshi_obj_mesh *mesh = &obj->meshes[m];
    const size_t run_count = run_end(obj, m) - mesh->first_run;
    const vshi_face_run *runs = run_count > 0 ? obj->faces.runs + mesh->first_run : NULL;
    bool triangles;
    const size_t most = vshi_faces_count_triangles(runs, run_count, &triangles);
    VSHI_TRY(vshi_reserve(&obj->budget, &shape->indices, &(size_t){0}, most, sizeof(uint32_t[3]), error));
    if (most == 0) {
        return VSH_OK;
    }
    if (triangles) {
        shape->triangle_count = most;
        memcpy(shape->indices, obj->faces.corners + mesh->first_corner, most * sizeof(uint32_t[3]));
        return VSH_OK;
    }
    vshi_face_cutter cutter = {.positions = shape->positions, .job = obj->job, .apart = true};
    const vsh_result result =
        vshi_faces_cut(&cutter, runs, run_count, obj->faces.corners + mesh->first_corner, shape->indices,
                       &shape->triangle_count, error);
    vshi_face_cutter_end(&cutter, obj->run, obj->path, obj->names.names[mesh->name]);
    return result;
}

static int32_t find_alpha(const vshi_obj_alpha *alpha) {
    return alpha->opacity < 1.0 || alpha->image > 0 ? VSH_ALPHA_BLENDED : VSH_ALPHA_OPAQUE;
}

static vsh_result make_shapes(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    VSHI_TRY(VSHI_RESERVE(&obj->budget, model->shapes, obj->mesh_count, error));
    for (; model->shape_count < obj->mesh_count; ++model->shape_count) {
        const vshi_obj_mesh *mesh = &obj->meshes[model->shape_count];
        model->shapes[model->shape_count] = (vshi_model_shape){
            .uv_sets = mesh->has[VSHI_OBJ_TEXTURE],
            .vertex_count = vertex_end(obj, model->shape_count) - mesh->first_vertex,
            .alpha = mesh->material != SIZE_MAX ? find_alpha(&obj->alphas[mesh->material]) : VSH_ALPHA_OPAQUE,
            .material = mesh->material < obj->materials.count ? (int32_t)mesh->material + 1 : 0,
        };
    }
    VSHI_TRY(copy_values(obj, VSHI_OBJ_POSITION, VSHI_MODEL_POSITIONS, model, error));
    VSHI_TRY(copy_values(obj, VSHI_OBJ_TEXTURE, VSHI_MODEL_UVS, model, error));
    VSHI_TRY(copy_values(obj, VSHI_OBJ_NORMAL, VSHI_MODEL_NORMALS, model, error));
    for (size_t m = 0; m < obj->mesh_count; ++m) {
        VSHI_TRY(make_triangles(obj, m, &model->shapes[m], error));
    }
    return VSH_OK;
}

static void make_material(const vshi_obj_alpha *from, vshi_model_material *material) {
    vshi_material *values = &material->values;
    const double transform[6] = {from->scale[0], 0.0, from->offset[0], 0.0, from->scale[1], from->offset[1]};
    values->alpha = find_alpha(from);
    values->by_texture = 1;
    values->base_alpha = from->opacity;
    material->image = from->image;
    if (from->image > 0) {
        values->image_channel = from->channel;
        values->wrap[0] = values->wrap[1] = from->clamp ? VSH_WRAP_CLAMP : VSH_WRAP_REPEAT;
        memcpy(values->uv_transform, transform, sizeof transform);
    }
}

static vsh_result hold_bytes(vshi_obj *obj, double bytes, vsh_error *error) {
    obj->budget.bytes += bytes;
    return vshi_check_limit(obj->run, obj->budget.bytes, obj->path, error);
}

/* Copies the paths of the materials' masks. */
static vsh_result make_images(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    const size_t count = obj->images.count;
    VSHI_TRY(hold_bytes(obj, (double)count * sizeof *model->images + (double)obj->images.used, error));
    VSHI_TRY(VSHI_ALLOCATE(model->images, count, obj->path, error));
    model->image_count = count;
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(vshi_copy_text(&model->images[i].path, obj->images.names[i], obj->path, error));
    }
    return VSH_OK;
}

/* Copies the materials' names and transparency. */
static vsh_result make_materials(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    const size_t count = obj->materials.count;
    if (count >= INT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu materials, at most %d", obj->path, count,
                         INT32_MAX - 1);
    }
    VSHI_TRY(hold_bytes(obj, (double)count * sizeof *model->materials + (double)obj->materials.used, error));
    VSHI_TRY(vshi_model_add_materials(model, count, error));
    for (size_t i = 0; i < count; ++i) {
        make_material(&obj->alphas[i], &model->materials[i]);
        VSHI_TRY(vshi_model_copy_line(obj->materials.names[i], &model->materials[i].name, error));
    }
    return VSH_OK;
}

static vsh_result add_entries(const vshi_obj *obj, vsh_model *model, vsh_error *error) {
    for (size_t o = 0; o < obj->object_count; ++o) {
        const uint32_t number = vshi_model_next_object(model);
        for (size_t m = obj->objects[o].first_mesh + 1; m > 0; m = obj->meshes[m - 1].next) {
            const vshi_model_place place = {.node = obj->names.names[obj->objects[o].name],
                                            .mesh = obj->names.names[obj->meshes[m - 1].name],
                                            .object = number,
                                            .shape = m - 1,
                                            .world = vshi_identity};
            if (model->shapes[m - 1].triangle_count > 0) {
                VSHI_TRY(vshi_model_add(model, obj->path, obj->run, &place, error));
            }
        }
    }
    return VSH_OK;
}

static vsh_result build_model(vshi_obj *obj, vsh_model *model, vsh_error *error) {
    free(obj->heads);
    obj->budget.bytes -= (double)(obj->head_capacity * sizeof *obj->heads);
    obj->heads = NULL;
    VSHI_TRY(make_images(obj, model, error));
    VSHI_TRY(make_materials(obj, model, error));
    VSHI_TRY(make_shapes(obj, model, error));
    return add_entries(obj, model, error);
}

/* Vertices at one position that are compared. If more of them differ (the pole of a sphere), some are stored
 * twice. */
enum { LONGEST_CHAIN = 32 };

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

static bool is_line_end(char c) {
    return c == '\n' || c == '\r';
}

/* Whether c ends a token. */
static bool ends_token(char c) {
    return is_blank(c) || is_line_end(c);
}

/* Skips blanks of the statement; "\" before a line's end is one. */
static inline const char *skip_blanks(vshi_obj *obj, const char *c) {
    for (;;) {
        if (is_blank(*c)) {
            ++c;
        } else if (*c == '\\' && is_line_end(c[1])) {
            c += c[1] == '\r' && c[2] == '\n' ? 3 : 2;
            ++obj->line;
        } else {
            return c;
        }
    }
}

static bool is_over(char c) {
    return is_line_end(c) || c == '#';
}

/* Returns the start of the line after c. */
static const char *skip_line(vshi_obj *obj, const char *c) {
    for (;; ++c) {
        if (*c == '\\') {
            c = skip_blanks(obj, c);
        }
        if (is_line_end(*c)) {
            ++obj->line;
            return c + (*c == '\r' && c[1] == '\n' ? 2 : 1);
        }
    }
}

static vshi_token find_token(const char *c) {
    vshi_token token = {c, 0};
    while (!ends_token(c[token.size])) {
        ++token.size;
    }
    return token;
}

/* --- v, vt, vn */

static vsh_result fail_number(const vshi_obj *obj, int kind, const char *at, vsh_error *error) {
    const vshi_token token = find_token(at);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu: %s holds '%.*s', expected a finite number",
                     obj->path, obj->statement, kinds[kind].name, VSHI_TOKEN_ARGS(token));
}

/* x y z w are homogeneous coordinates; other numbers after x y z are a colour. */
static vsh_result convert_position(vshi_obj *obj, int count, const float *number, float *position,
                                   vsh_error *error) {
    memcpy(position, number, sizeof(float[3]));
    if (count != 4) {
        return VSH_OK;
    }
    for (int k = 0; k < 3; ++k) {
        position[k] = number[k] / number[3];
        if (!isfinite(position[k])) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: line %zu: vertex's weight is %g, so its position is not finite", obj->path,
                             obj->statement, (double)number[3]);
        }
    }
    return VSH_OK;
}

static vsh_result read_numbers(vshi_obj *obj, int kind, const char **at, vsh_error *error) {
    enum { MOST = 4 };
    vshi_obj_values *values = &obj->kinds[kind];
    const size_t size = (size_t)kinds[kind].kept;
    float number[MOST] = {0};
    int count = 0;
    const char *c = *at;
    if (values->count == UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: line %zu: more than %u of %s", obj->path,
                         obj->statement, UINT32_MAX, kinds[kind].name);
    }
    VSHI_TRY(vshi_grow(&obj->budget, &values->values, &values->capacity, values->count + 1,
                       size * sizeof(float), error));
    for (c = skip_blanks(obj, c); !is_over(*c); c = skip_blanks(obj, c), ++count) {
        float given;
        const char *end = vshi_decimal_float(c, &given);
        if (end == NULL || !(ends_token(*end) || *end == '\\') || !isfinite(given)) {
            return fail_number(obj, kind, c, error);
        }
        number[count < MOST ? count : MOST - 1] = given;
        c = end;
    }
    *at = c;
    if (count < kinds[kind].least) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu: %s of %d numbers, expected at least %d",
                         obj->path, obj->statement, kinds[kind].name, count, kinds[kind].least);
    }
    float *to = values->values + size * values->count++;
    if (kind == VSHI_OBJ_POSITION) {
        return convert_position(obj, count, number, to, error);
    }
    memcpy(to, number, size * sizeof(float));
    return VSH_OK;
}

/* --- f */

static vsh_result fail_corner(const vshi_obj *obj, const char *corner, vsh_error *error) {
    const vshi_token token = find_token(corner);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu: '%.*s' is no corner of a face", obj->path,
                     obj->statement, VSHI_TOKEN_ARGS(token));
}

/* Parses a whole number of at most 18 digits; returns its end, or NULL. */
static inline const char *read_index(const char *c, int64_t *index) {
    enum { DIGITS = 18 };
    const bool negative = *c == '-';
    c += *c == '-' || *c == '+';
    const char *first = c;
    uint64_t number = 0;
    for (; (unsigned char)(*c - '0') < 10; ++c) {
        number = 10 * number + (unsigned char)(*c - '0');
    }
    *index = negative ? -(int64_t)number : (int64_t)number;
    return c > first && c - first <= DIGITS ? c : NULL;
}

/* Resolves an index from 1, or from -1 backwards from the latest value. */
static inline vsh_result resolve_index(vshi_obj *obj, int kind, int64_t index, uint32_t *part,
                                       vsh_error *error) {
    vshi_obj_values *values = &obj->kinds[kind];
    const int64_t count = (int64_t)values->count;
    if (index == 0 || index < -count) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: line %zu: %s index %lld out of range, there are %lld so far", obj->path,
                         obj->statement, kinds[kind].name, (long long)index, (long long)count);
    }
    index = index > 0 ? index : count + 1 + index;
    if (index > values->highest) {
        values->highest = index;
        values->highest_line = obj->statement;
    }
    *part = index <= UINT32_MAX ? (uint32_t)index : UINT32_MAX;
    return VSH_OK;
}

/* Makes room for the heads of all positions up to one. *possible: the file is long enough for that many
 * positions; otherwise check_indices() fails later. */
static vsh_result reserve_heads(vshi_obj *obj, size_t position, bool *possible, vsh_error *error) {
    enum { LEAST_BYTES = 7 }; /* a vertex is at least "v 0 0 0" */
    *possible = position <= obj->text.size / LEAST_BYTES && position < UINT32_MAX;
    if (!*possible || position <= obj->head_count) {
        return VSH_OK;
    }
    VSHI_TRY(VSHI_GROW(&obj->budget, obj->heads, obj->head_capacity, position, error));
    memset(obj->heads + obj->head_count, 0, (obj->head_capacity - obj->head_count) * sizeof *obj->heads);
    obj->head_count = obj->head_capacity;
    return VSH_OK;
}

/* Finds the vertex of the current mesh with these parts, or adds it. */
static vsh_result find_vertex(vshi_obj *obj, const uint32_t part[VSHI_OBJ_KINDS], uint32_t *vertex,
                              vsh_error *error) {
    bool possible;
    const size_t first = obj->meshes[obj->mesh].first_vertex;
    VSHI_TRY(reserve_heads(obj, part[0], &possible, error));
    if (!possible) {
        *vertex = 0;
        return VSH_OK;
    }
    uint32_t *head = &obj->heads[part[0] - 1];
    int compared = 0;
    for (uint32_t v = *head; v > first && compared < LONGEST_CHAIN;
         v = obj->vertices[v - 1].next, ++compared) {
        const uint32_t *other = obj->vertices[v - 1].part;
        if (other[1] == part[1] && other[2] == part[2]) {
            *vertex = (uint32_t)(v - 1 - first);
            return VSH_OK;
        }
    }
    if (obj->vertex_count == UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: line %zu: more than %u vertices", obj->path,
                         obj->statement, UINT32_MAX);
    }
    VSHI_TRY(VSHI_GROW(&obj->budget, obj->vertices, obj->vertex_capacity, obj->vertex_count + 1, error));
    *vertex = (uint32_t)(obj->vertex_count - first);
    obj->vertices[obj->vertex_count++] = (vshi_obj_vertex){{part[0], part[1], part[2]}, *head};
    *head = (uint32_t)obj->vertex_count;
    return VSH_OK;
}

/* Reads a corner: p, p/t, p//n or p/t/n. */
static vsh_result read_corner(vshi_obj *obj, const char **at, uint32_t part[VSHI_OBJ_KINDS],
                              vsh_error *error) {
    const char *const corner = *at, *c = corner;
    bool *has = obj->meshes[obj->mesh].has;
    for (int kind = VSHI_OBJ_POSITION; kind < VSHI_OBJ_KINDS; ++kind) {
        int64_t index;
        part[kind] = 0;
        if (kind > VSHI_OBJ_POSITION) {
            if (*c != '/') {
                continue;
            }
            ++c;
            if (*c == '/' || ends_token(*c)) {
                continue;
            }
        }
        c = read_index(c, &index);
        if (c == NULL) {
            return fail_corner(obj, corner, error);
        }
        VSHI_TRY(resolve_index(obj, kind, index, &part[kind], error));
        has[kind] = true;
    }
    *at = c;
    return ends_token(*c) || *c == '\\' ? VSH_OK : fail_corner(obj, corner, error);
}

static vsh_result read_face(vshi_obj *obj, const char **at, vsh_error *error) {
    size_t size = 0;
    const char *c = *at;
    VSHI_TRY(require_mesh(obj, error));
    vshi_faces *faces = &obj->faces;
    for (c = skip_blanks(obj, c); !is_over(*c); c = skip_blanks(obj, c), ++size) {
        uint32_t part[VSHI_OBJ_KINDS], vertex = 0;
        VSHI_TRY(read_corner(obj, &c, part, error));
        VSHI_TRY(find_vertex(obj, part, &vertex, error));
        VSHI_TRY(VSHI_GROW(&obj->budget, faces->corners, faces->capacity, faces->count + 1, error));
        faces->corners[faces->count++] = vertex;
    }
    *at = c;
    return vshi_faces_end_face(faces, &obj->budget, obj->meshes[obj->mesh].first_run, size, error);
}

/* --- statements */

typedef vsh_result name_fn(vshi_obj *obj, const char *text, size_t size, vsh_error *error);

static vsh_result read_name(vshi_obj *obj, const char **at, name_fn *read, vsh_error *error) {
    const char *c = skip_blanks(obj, *at), *end = c;
    while (!is_line_end(*end)) {
        ++end;
    }
    *at = end;
    const vshi_token name = vshi_scan_rest(c, end);
    return read(obj, name.text, name.size, error);
}

static vsh_result read_statement(vshi_obj *obj, const char **at, vsh_error *error) {
    static const struct {
        const char *keyword;
        name_fn *read;
    } named[] = {
        {"o", set_object},
        {"g", set_group},
        {"usemtl", set_material},
        {"mtllib", vshi_obj_read_materials},
    };
    const char *c = *at;
    if (c[0] == 'v' && ends_token(c[1])) {
        *at = c + 1;
        return read_numbers(obj, VSHI_OBJ_POSITION, at, error);
    }
    if (c[0] == 'v' && (c[1] == 't' || c[1] == 'n') && ends_token(c[2])) {
        *at = c + 2;
        return read_numbers(obj, c[1] == 't' ? VSHI_OBJ_TEXTURE : VSHI_OBJ_NORMAL, at, error);
    }
    if (c[0] == 'f' && ends_token(c[1])) {
        *at = c + 1;
        return read_face(obj, at, error);
    }
    if ((c[0] == 'l' || c[0] == 'p') && ends_token(c[1])) {
        return require_mesh(obj, error); /* they cast no shadow, but split meshes like faces */
    }
    const vshi_token keyword = find_token(c);
    for (size_t i = 0; i < sizeof named / sizeof named[0]; ++i) {
        if (vshi_token_is(keyword, named[i].keyword)) {
            *at = c + keyword.size;
            return read_name(obj, at, named[i].read, error);
        }
    }
    return VSH_OK;
}

static vsh_result read_statements(vshi_obj *obj, vsh_error *error) {
    static const char mark[3] = {'\xef', '\xbb', '\xbf'};
    const char *c = obj->text.bytes, *end = c + obj->text.size;
    c += memcmp(c, mark, sizeof mark) == 0 ? sizeof mark : 0;
    while (c < end) {
        VSHI_TRY(vshi_text_poll(&obj->text, c, error));
        obj->statement = obj->line;
        c = skip_blanks(obj, c);
        VSHI_TRY(read_statement(obj, &c, error));
        c = skip_line(obj, c);
    }
    return vshi_text_poll(&obj->text, end, error);
}

static vsh_result check_indices(const vshi_obj *obj, vsh_error *error) {
    for (int kind = VSHI_OBJ_POSITION; kind < VSHI_OBJ_KINDS; ++kind) {
        const vshi_obj_values *values = &obj->kinds[kind];
        if (values->highest > (int64_t)values->count) {
            return vshi_fail(
                error, VSH_ERROR_INPUT, "%s: line %zu: %s index %lld out of range, the file has %zu",
                obj->path, values->highest_line, kinds[kind].name, (long long)values->highest, values->count);
        }
    }
    return VSH_OK;
}

vsh_result vshi_obj_read(const char *path, const vsh_run *run, vshi_job *job, size_t units, vsh_model **model,
                         vsh_error *error) {
    vshi_obj obj = {.path = path,
                    .run = run,
                    .job = job,
                    .budget = {path, run, 0.0},
                    .line = 1,
                    .object = SIZE_MAX,
                    .mesh = SIZE_MAX,
                    .material = SIZE_MAX,
                    .group = SIZE_MAX};
    vsh_model *made = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_text_read(&obj.text, path, path, &obj.budget, job, units, error));
    VSHI_TRY_DONE(read_statements(&obj, error));
    VSHI_TRY_DONE(check_indices(&obj, error));
    vshi_text_free(&obj.text);
    VSHI_TRY_DONE(VSHI_ALLOCATE(made, 1, path, error));
    VSHI_TRY_DONE(build_model(&obj, made, error));
    *model = made;
    made = NULL;
done:
    vsh_model_free(made);
    vshi_text_free(&obj.text);
    vshi_words_free(&obj.materials);
    vshi_words_free(&obj.names);
    vshi_faces_free(&obj.faces);
    free(obj.meshes);
    free(obj.objects);
    free(obj.alphas);
    vshi_words_free(&obj.images);
    free(obj.object_of);
    free(obj.vertices);
    free(obj.heads);
    for (int kind = 0; kind < VSHI_OBJ_KINDS; ++kind) {
        free(obj.kinds[kind].values);
    }
    return result;
}
