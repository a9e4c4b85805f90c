/* Reads a glTF or GLB into a model: chunks and JSON, then the nodes of its scene with their lights and
 * meshes. */
#include "io/model/gltf.h"

#include "base/bytes.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/vec.h"
#include "io/model/text.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool vshi_is_gltf(const char *path) {
    const char *ending = vshi_path_ending(path);
    return strcasecmp(ending, "gltf") == 0 || strcasecmp(ending, "glb") == 0;
}

/* --- JSON */

vsh_result vshi_gltf_fail(const vshi_gltf *gltf, vsh_error *error, const char *format, ...) {
    char text[768];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s", gltf->path, text);
}

const json_t *vshi_gltf_element(const vshi_gltf *gltf, const char *array, size_t index) {
    return json_array_get(json_object_get(gltf->root, array), index);
}

bool vshi_gltf_count(const json_t *object, const char *key, size_t fallback, size_t *value) {
    static const double most = 9007199254740992.0; /* 2^53: doubles hold all whole numbers up to this */
    const json_t *given = json_object_get(object, key);
    *value = fallback;
    if (given == NULL) {
        return true;
    }
    const double number = json_number_value(given);
    if (!json_is_number(given) || !(number >= 0.0 && number <= most) || number != floor(number)) {
        return false;
    }
    *value = (size_t)number;
    return true;
}

vsh_result vshi_gltf_index(const vshi_gltf *gltf, const json_t *object, const char *key, const char *array,
                           const char *where, size_t *index, vsh_error *error) {
    if (!vshi_gltf_count(object, key, SIZE_MAX, index)) {
        return vshi_gltf_fail(gltf, error, "%s: '%s' is no index", where, key);
    }
    const size_t count = json_array_size(json_object_get(gltf->root, array));
    if (*index != SIZE_MAX && *index >= count) {
        return vshi_gltf_fail(gltf, error, "%s: '%s' is %zu, but there are only %zu %s", where, key, *index,
                              count, array);
    }
    return VSH_OK;
}

bool vshi_gltf_numbers(const json_t *object, const char *key, size_t count, double *values) {
    const json_t *given = json_object_get(object, key);
    if (given == NULL) {
        return true;
    }
    if (!json_is_array(given)) {
        return false;
    }
    for (size_t i = 0; i < count && i < json_array_size(given); ++i) {
        const json_t *number = json_array_get(given, i);
        if (!json_is_number(number)) {
            return false;
        }
        values[i] = json_number_value(number);
    }
    return true;
}

json_t *vshi_gltf_extension(const json_t *object, const char *name) {
    return json_object_get(json_object_get(object, "extensions"), name);
}

vsh_result vshi_gltf_hold(vshi_gltf *gltf, double bytes, vsh_error *error) {
    gltf->bytes_held += bytes;
    return vshi_check_limit(gltf->run, gltf->bytes_held, gltf->path, error);
}

vsh_result vshi_gltf_allocate(vshi_gltf *gltf, void **memory, size_t count, size_t size, vsh_error *error) {
    VSHI_TRY(vshi_gltf_hold(gltf, (double)count * (double)size, error));
    return vshi_allocate(memory, count, size, gltf->path, error);
}

/* --- required extensions */

bool vshi_gltf_is_named(const char *name, const char *pattern) {
    const size_t length = strlen(pattern);
    return length > 0 && strncmp(name, pattern, length) == 0 &&
           (pattern[length - 1] == '_' || name[length] == '\0');
}

/* Extensions that are read, or do not change geometry, such as those of materials. */
static const char *const understood[] = {
    "KHR_mesh_quantization",   "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing", "EXT_meshopt_compression",
    "KHR_meshopt_compression", "KHR_materials_",
    "KHR_texture_transform",   "KHR_texture_basisu",
    "EXT_texture_webp",        "EXT_texture_avif",
    "MSFT_texture_dds",        "KHR_lights_punctual",
    "EXT_lights_image_based",  "EXT_lights_ies",
    "KHR_animation_pointer",   "KHR_xmp",
    "KHR_xmp_json_ld",         "MOZ_lightmap",
    "KHR_audio_emitter",
};

static bool is_understood(const char *name) {
    bool known = false;
    for (size_t i = 0; i < sizeof understood / sizeof understood[0]; ++i) {
        known = known || vshi_gltf_is_named(name, understood[i]);
    }
    return known;
}

/* Errors: VSH_ERROR_UNSUPPORTED, with the extension and advice. */
static vsh_result check_extensions(const vshi_gltf *gltf, vsh_error *error) {
    size_t i;
    const json_t *item;
    json_array_foreach(json_object_get(gltf->root, "extensionsRequired"), i, item) {
        const char *name = json_string_value(item);
        if (name == NULL) {
            return vshi_gltf_fail(gltf, error, "extensionsRequired[%zu] is no name", i);
        }
        if (is_understood(name)) {
            continue;
        }
        const char *advice = strcmp(name, "KHR_node_visibility") == 0 ? "export only the visible nodes"
                             : strcmp(name, "KHR_gaussian_splatting") == 0
                                 ? "it holds no triangles"
                                 : "export it without that extension";
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: cannot be read without the glTF extension '%s', which is not supported: %s",
                         gltf->path, name, advice);
    }
    return VSH_OK;
}

/* Jansson needs 25 bytes for each byte of a list of nodes, and 1 for buffers in base64 (measured).
 * vshi_text_read_whole() checks the limit with a mean. */
vsh_result vshi_gltf_parse(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    static const char mark[3] = {'\xef', '\xbb', '\xbf'};
    json_error_t where;
    if (size >= sizeof mark && memcmp(text, mark, sizeof mark) == 0) {
        text += sizeof mark;
        size -= sizeof mark;
    }
    while (size > 0 && text[size - 1] == '\0') {
        --size; /* some exporters pad chunks with zeros */
    }
    errno = 0;
    gltf->root = json_loadb(text, size, JSON_ALLOW_NUL, &where);
    if (errno == ENOMEM) { /* Jansson reports a syntax error, or cuts numbers and words */
        return vshi_fail_memory(error, gltf->path);
    }
    const bool early = json_error_code(&where) == json_error_premature_end_of_input || where.position < 0 ||
                       (size_t)where.position >= size;
    return gltf->root != NULL
               ? VSH_OK
               : vshi_fail(error, early ? VSH_ERROR_READ : VSH_ERROR_INPUT, "%s: %s: line %d column %d: %s",
                           gltf->path, early ? "cut short" : "its JSON is damaged", where.line, where.column,
                           where.text);
}

static vsh_result fail_version(const vshi_gltf *gltf, const char *version, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                     "%s: is glTF %s; glTF 2.0 is read: export it again, or convert it (gltf-pipeline)",
                     gltf->path, version);
}

/* The chunks of a GLB (glTF 2.0, 4.4). */
static vsh_result open_binary(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8 };
    static const char magic[4] = {'g', 'l', 'T', 'F'}, json_type[4] = {'J', 'S', 'O', 'N'},
                      binary_type[4] = {'B', 'I', 'N', '\0'};
    const size_t compared = size < sizeof magic ? size : sizeof magic;
    if (memcmp(text, magic, compared) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is no GLB: it does not begin with 'glTF'", gltf->path);
    }
    if (size >= HEADER && vshi_bytes_number(text + 4, 4, false) == 1) {
        return fail_version(gltf, "1.0", error);
    }
    const uint64_t length = size < HEADER + CHUNK ? HEADER + CHUNK : vshi_bytes_number(text + 8, 4, false);
    if (length > size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of %llu", gltf->path, size,
                         (unsigned long long)length);
    }
    const size_t json = (size_t)vshi_bytes_number(text + HEADER, 4, false);
    if (json > size - HEADER - CHUNK) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its JSON of %zu bytes passes the file's %zu bytes",
                         gltf->path, json, size);
    }
    if (memcmp(text + HEADER + 4, json_type, sizeof json_type) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its first chunk is no JSON", gltf->path);
    }
    const size_t next = HEADER + CHUNK + json;
    if (size - next >= CHUNK && memcmp(text + next + 4, binary_type, sizeof binary_type) == 0) {
        const size_t held = (size_t)vshi_bytes_number(text + next, 4, false), left = size - next - CHUNK;
        if (held > left) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of a chunk of %zu", gltf->path,
                             left, held);
        }
        gltf->binary = true;
        gltf->chunk = (vshi_gltf_bytes){(const unsigned char *)text + next + CHUNK, held};
    }
    return vshi_gltf_parse(gltf, text + HEADER + CHUNK, json, error);
}

static vsh_result check_version(const vshi_gltf *gltf, vsh_error *error) {
    const json_t *asset = json_object_get(gltf->root, "asset");
    const char *version = json_string_value(json_object_get(asset, "version"));
    const char *least = json_string_value(json_object_get(asset, "minVersion"));
    if (version == NULL) {
        return vshi_gltf_fail(gltf, error, "is no glTF: its JSON names no version of the asset");
    }
    const bool later = least != NULL && strcmp(least, "2.0") != 0;
    return strncmp(version, "2.", 2) == 0 && !later ? VSH_OK
                                                    : fail_version(gltf, later ? least : version, error);
}

vsh_result vshi_gltf_open(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    const bool binary = size >= 4 && memcmp(text, "glTF", 4) == 0;
    const size_t length = strlen(gltf->path);
    const bool expected = length >= 4 && (gltf->path[length - 1] == 'b' || gltf->path[length - 1] == 'B');
    VSHI_TRY(binary || expected ? open_binary(gltf, text, size, error)
                                : vshi_gltf_parse(gltf, text, size, error));
    VSHI_TRY(check_version(gltf, error));
    VSHI_TRY(check_extensions(gltf, error));
    const size_t buffers = json_array_size(json_object_get(gltf->root, "buffers"));
    const size_t views = json_array_size(json_object_get(gltf->root, "bufferViews"));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->buffers, buffers, sizeof *gltf->buffers, error));
    gltf->buffer_count = buffers;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->views, views, sizeof *gltf->views, error));
    gltf->view_count = views;
    return VSH_OK;
}

/* --- lights: KHR_lights_punctual (Khronos, ratified 2019) */

static const char LIGHTS[] = "KHR_lights_punctual";

static int32_t find_light_type(const char *name) {
    static const char *const names[] = {[VSHI_MODEL_LIGHT_DIRECTIONAL] = "directional",
                                        [VSHI_MODEL_LIGHT_POINT] = "point",
                                        [VSHI_MODEL_LIGHT_SPOT] = "spot"};
    for (int32_t i = 0; name != NULL && i < (int32_t)(sizeof names / sizeof names[0]); ++i) {
        if (strcmp(name, names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

/* Reads a number; keeps *value if the key is absent. */
static vsh_result read_number(const vshi_gltf *gltf, const json_t *object, const char *key, double lowest,
                              double highest, const char *where, double *value, vsh_error *error) {
    const json_t *given = json_object_get(object, key);
    const double number = given != NULL ? json_number_value(given) : *value;
    if ((given != NULL && !json_is_number(given)) || !(number >= lowest && number <= highest)) {
        return vshi_gltf_fail(gltf, error, "%s: its %s is %s%g, expected a number of %g to %g", where, key,
                              json_is_number(given) ? "" : "no number, or ", number, lowest, highest);
    }
    *value = number;
    return VSH_OK;
}

static vsh_result read_light(const vshi_gltf *gltf, const json_t *given, const char *where,
                             vshi_model_light *light, vsh_error *error) {
    static const double eighth = 0.78539816339744828, quarter = 1.5707963267948966; /* turns, radians */
    static const double widest = 1.5708; /* a quarter turn in few digits */
    for (int i = 0; i < 3; ++i) {
        light->color[i] = 1.0;
    }
    bool good = vshi_gltf_numbers(given, "color", 3, light->color);
    for (int i = 0; i < 3; ++i) {
        good = good && light->color[i] >= 0.0 && light->color[i] <= FLT_MAX;
    }
    if (!good) {
        return vshi_gltf_fail(gltf, error, "%s: its color is no three numbers of at least 0", where);
    }
    light->intensity = 1.0;
    VSHI_TRY(read_number(gltf, given, "intensity", 0.0, FLT_MAX, where, &light->intensity, error));
    VSHI_TRY(read_number(gltf, given, "range", 0.0, FLT_MAX, where, &light->range, error));
    if (light->type == VSHI_MODEL_LIGHT_SPOT) {
        const json_t *spot = json_object_get(given, "spot");
        light->outer_angle = eighth;
        VSHI_TRY(
            read_number(gltf, spot, "outerConeAngle", DBL_MIN, widest, where, &light->outer_angle, error));
        VSHI_TRY(read_number(gltf, spot, "innerConeAngle", 0.0, light->outer_angle, where,
                             &light->inner_angle, error));
        light->outer_angle = fmin(light->outer_angle, quarter);
        light->inner_angle = fmin(light->inner_angle, quarter);
    }
    return VSH_OK;
}

/* Sets the light's position, and its direction along -z of its node. Returns false if it has none. */
static bool place_light(const double world[12], vshi_model_light *light) {
    const vshi_vec away = {-world[2], -world[6], -world[10]};
    for (int i = 0; i < 3; ++i) {
        light->position[i] = world[4 * i + 3];
        if (!(fabs(light->position[i]) <= FLT_MAX)) {
            return false;
        }
    }
    const double length = vshi_length(away);
    if (light->type == VSHI_MODEL_LIGHT_POINT) {
        return true;
    }
    if (!(length > 0.0 && length <= FLT_MAX)) {
        return false;
    }
    const vshi_vec unit = vshi_unit(away);
    light->direction[0] = unit.x + 0.0; /* removes -0 */
    light->direction[1] = unit.y + 0.0;
    light->direction[2] = unit.z + 0.0;
    return true;
}

static vsh_result add_light(vshi_gltf *gltf, size_t node, size_t index, const json_t *given,
                            vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "lights[%zu] of %s", index, LIGHTS);
    vshi_model_light light = {.type = find_light_type(json_string_value(json_object_get(given, "type")))};
    if (light.type < 0) {
        vshi_warn(gltf->run, "%s: %s is left out: its type is not directional, point or spot", gltf->path,
                  where);
        return VSH_OK;
    }
    VSHI_TRY(read_light(gltf, given, where, &light, error));
    if (!place_light(gltf->node_world[node], &light)) {
        vshi_warn(gltf->run,
                  "%s: the light of nodes[%zu] is left out: its transform gives it no direction or place",
                  gltf->path, node);
        return VSH_OK;
    }
    const char *name = json_string_value(json_object_get(vshi_gltf_element(gltf, "nodes", node), "name"));
    name = name != NULL && name[0] != '\0' ? name : json_string_value(json_object_get(given, "name"));
    VSHI_TRY(vshi_gltf_hold(gltf, 2.0 * sizeof light + (name != NULL ? (double)strlen(name) : 0.0), error));
    return vshi_model_add_light(gltf->model, &light, name, error);
}

/* Adds the light that a node of the scene carries. */
static vsh_result add_node_light(vshi_gltf *gltf, size_t node, vsh_error *error) {
    const json_t *carried = vshi_gltf_extension(vshi_gltf_element(gltf, "nodes", node), LIGHTS);
    const json_t *lights = json_object_get(vshi_gltf_extension(gltf->root, LIGHTS), "lights");
    size_t index;
    if (carried == NULL) {
        return VSH_OK;
    }
    if (!vshi_gltf_count(carried, "light", SIZE_MAX, &index) || index >= json_array_size(lights)) {
        return vshi_gltf_fail(gltf, error, "nodes[%zu]: its light is none of the %zu of %s", node,
                              json_array_size(lights), LIGHTS);
    }
    return add_light(gltf, node, index, json_array_get(lights, index), error);
}

/* --- transforms */

/* own = translation × rotation (a quaternion x, y, z, w) × scale, in floats, so that bakes keep their bits.
 * Normalises the quaternion if needed. */
static void compose_parts(const double t[3], const double r[4], const double s[3], double own[12]) {
    static const double unit_slack = 1e-5;
    const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3];
    const double scale = fabs(square - 1.0) < unit_slack ? 1.0 : square > 0.0 ? 1.0 / sqrt(square) : 0.0;
    const float x = (float)(r[0] * scale), y = (float)(r[1] * scale), z = (float)(r[2] * scale);
    const float w = (float)(r[3] * scale);
    const float turn[9] = {
        1.0F - 2.0F * (y * y + z * z), 2.0F * (x * y - z * w),        2.0F * (x * z + y * w),
        2.0F * (x * y + z * w),        1.0F - 2.0F * (x * x + z * z), 2.0F * (y * z - x * w),
        2.0F * (x * z - y * w),        2.0F * (y * z + x * w),        1.0F - 2.0F * (x * x + y * y),
    };
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            own[4 * row + column] = (double)(turn[3 * row + column] * (float)s[column]);
        }
        own[4 * row + 3] = (double)(float)t[row];
    }
}

static bool read_transform(const json_t *node, double own[12]) {
    double matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; /* by columns */
    double t[3] = {0, 0, 0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (json_object_get(node, "matrix") != NULL) {
        const bool good = vshi_gltf_numbers(node, "matrix", 16, matrix);
        for (int i = 0; i < 12; ++i) {
            own[i] = (double)(float)matrix[4 * (i % 4) + i / 4];
        }
        return good;
    }
    const bool good = vshi_gltf_numbers(node, "translation", 3, t) &&
                      vshi_gltf_numbers(node, "rotation", 4, r) && vshi_gltf_numbers(node, "scale", 3, s);
    compose_parts(t, r, s, own);
    return good;
}

/* Copies the name of an item; "nodes[3]" or "meshes[3]" if it has none. */
static void copy_name(const char *array, size_t index, const json_t *item, char *text, size_t size) {
    const char *name = json_string_value(json_object_get(item, "name"));
    if (name != NULL && name[0] != '\0') {
        snprintf(text, size, "%s", name);
    } else {
        snprintf(text, size, "%s[%zu]", array, index);
    }
}

/* --- shapes */

/* Reads a shape for each primitive of a mesh, from *first on. */
static vsh_result read_mesh(vshi_gltf *gltf, size_t mesh, const vshi_gltf_pose *pose, size_t *first,
                            vsh_error *error) {
    const json_t *given = vshi_gltf_element(gltf, "meshes", mesh);
    const json_t *primitives = json_object_get(given, "primitives");
    const size_t count = json_array_size(primitives);
    const char *name = json_string_value(json_object_get(given, "name"));
    vsh_model *model = gltf->model;
    *first = model->shape_count;
    VSHI_TRY(vshi_gltf_hold(gltf, 2.0 * (double)count * sizeof *model->shapes, error));
    for (size_t i = 0; i < count; ++i) {
        char where[256];
        snprintf(where, sizeof where, "mesh %zu '%.150s': primitive %zu", mesh, name != NULL ? name : "", i);
        VSHI_TRY(vshi_make_room((void **)&model->shapes, model->shape_count, &gltf->shape_capacity,
                                sizeof *model->shapes, gltf->path, error));
        vshi_model_shape *shape = &model->shapes[model->shape_count++];
        *shape = (vshi_model_shape){.positions = NULL};
        VSHI_TRY(vshi_job_check(gltf->job, error));
        VSHI_TRY(vshi_gltf_read_primitive(gltf, json_array_get(primitives, i), pose, where, shape, error));
    }
    return VSH_OK;
}

/* --- skins and weights */

/* Reads the inverse bind matrices of a skin's `count` joints; keeps NULL if the skin has none. */
static vsh_result read_inverse(vshi_gltf *gltf, const json_t *skin, const char *where, size_t count,
                               float **inverse, vsh_error *error) {
    vshi_gltf_accessor opened;
    VSHI_TRY(vshi_gltf_accessor_find(gltf, skin, "inverseBindMatrices", where, &opened, error));
    if (opened.count == 0) {
        return VSH_OK;
    }
    if (opened.count < count || opened.components != 16) {
        return vshi_gltf_fail(gltf, error, "%s: %zu joints, but %zu matrices of %d components", where, count,
                              opened.count, opened.components);
    }
    VSHI_TRY(vshi_gltf_hold(gltf, (double)opened.count * sizeof(float[16]), error));
    return vshi_gltf_read_attribute(gltf, skin, "inverseBindMatrices", 16, opened.count, where, inverse,
                                    error);
}

static vsh_result read_joints(vshi_gltf *gltf, size_t skin, double (**joints)[12], size_t *count,
                              vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "skins[%zu]", skin);
    const json_t *given = vshi_gltf_element(gltf, "skins", skin);
    const json_t *list = json_object_get(given, "joints");
    float *inverse = NULL;
    *count = json_array_size(list);
    vsh_result result;
    VSHI_TRY_DONE(read_inverse(gltf, given, where, *count, &inverse, error));
    VSHI_TRY_DONE(VSHI_ALLOCATE(*joints, *count, gltf->path, error));
    for (size_t i = 0; i < *count; ++i) {
        const double node = json_number_value(json_array_get(list, i));
        if (!(node >= 0.0 && node < (double)gltf->node_count) || !gltf->node_seen[(size_t)node]) {
            result = vshi_gltf_fail(gltf, error, "%s: joint %zu is no node of the scene", where, i);
            goto done;
        }
        double bind[12];
        for (int k = 0; k < 12; ++k) {
            bind[k] =
                inverse != NULL ? (double)inverse[16 * i + (size_t)(4 * (k % 4) + k / 4)] : vshi_identity[k];
        }
        vshi_transform_compose(gltf->node_world[(size_t)node], bind, (*joints)[i]);
    }
done:
    free(inverse);
    return result;
}

/* Reads the default weights of morph targets from a node or mesh. */
static vsh_result read_weights(const vshi_gltf *gltf, const json_t *owner, double **weights, size_t *count,
                               vsh_error *error) {
    *count = json_array_size(json_object_get(owner, "weights"));
    VSHI_TRY(VSHI_ALLOCATE(*weights, *count, gltf->path, error));
    return vshi_gltf_numbers(owner, "weights", *count, *weights)
               ? VSH_OK
               : vshi_gltf_fail(gltf, error, "the weights of morph targets are no numbers");
}

/* Finds the shapes of a node's mesh, from *first on, moved by its weights and skin. Nodes without weights or
 * a skin share shapes. *skinned: the shapes are in the world, so the node's transform does not apply. */
static vsh_result find_shapes(vshi_gltf *gltf, const json_t *node, size_t mesh, size_t skin, size_t *first,
                              bool *skinned, vsh_error *error) {
    const bool own_weights = json_object_get(node, "weights") != NULL;
    const bool shared = skin == SIZE_MAX && !own_weights;
    *skinned = false;
    if (shared && gltf->mesh_shapes[mesh] > 0) {
        *first = gltf->mesh_shapes[mesh] - 1;
        return VSH_OK;
    }
    const json_t *owner = own_weights ? node : vshi_gltf_element(gltf, "meshes", mesh);
    double *weights = NULL, (*joints)[12] = NULL;
    vshi_gltf_pose pose = {0};
    vsh_result result;
    VSHI_TRY_DONE(read_weights(gltf, owner, &weights, &pose.weight_count, error));
    if (skin != SIZE_MAX) {
        VSHI_TRY_DONE(read_joints(gltf, skin, &joints, &pose.joint_count, error));
    }
    pose.weights = weights;
    pose.joints = (const double(*)[12])joints;
    VSHI_TRY_DONE(read_mesh(gltf, mesh, &pose, first, error));
    *skinned = pose.joint_count > 0;
    if (shared) {
        gltf->mesh_shapes[mesh] = *first + 1;
    }
done:
    free(joints);
    free(weights);
    return result;
}

/* --- entries */

/* `instance`: 1 + its index; 0: the node has no instances. */
static vsh_result add_entries(vshi_gltf *gltf, size_t node, size_t mesh, size_t first, size_t instance,
                              const double world[12], vsh_error *error) {
    const json_t *given = vshi_gltf_element(gltf, "meshes", mesh);
    const size_t count = json_array_size(json_object_get(given, "primitives"));
    char node_name[256], mesh_name[256];
    const uint32_t object = vshi_model_next_object(gltf->model);
    copy_name("nodes", node, vshi_gltf_element(gltf, "nodes", node), node_name, sizeof node_name);
    copy_name("meshes", mesh, given, mesh_name, sizeof mesh_name);
    for (size_t i = 0; i < count; ++i) {
        if (gltf->model->shapes[first + i].triangle_count == 0) {
            continue;
        }
        char one[320], part[320], index[32] = "", number[32] = "";
        if (instance > 0) {
            snprintf(index, sizeof index, "[%zu]", instance - 1);
        }
        if (count > 1) {
            snprintf(number, sizeof number, "-%zu", i);
        }
        snprintf(one, sizeof one, "%s%s", node_name, index);
        snprintf(part, sizeof part, "%s%s", mesh_name, number);
        VSHI_TRY(vshi_gltf_hold(gltf, sizeof(vshi_model_entry) + (double)strlen(one), error));
        const vshi_model_place place = {
            .node = one,
            .mesh = part,
            .object = object,
            .shape = first + i,
            .world = world,
            .origin = {(uint32_t)node + 1, (uint32_t)mesh + 1, (uint32_t)i + 1, (uint32_t)instance}};
        VSHI_TRY(vshi_model_add(gltf->model, gltf->path, gltf->run, &place, error));
    }
    return VSH_OK;
}

const vshi_gltf_part vshi_gltf_parts[VSHI_GLTF_PARTS] = {
    {"TRANSLATION", "translation", 3}, {"ROTATION", "rotation", 4}, {"SCALE", "scale", 3}};

vsh_result vshi_gltf_read_instances(vshi_gltf *gltf, const json_t *instancing, const char *where,
                                    float *values[VSHI_GLTF_PARTS], size_t *count, vsh_error *error) {
    const json_t *attributes = json_object_get(instancing, "attributes");
    *count = SIZE_MAX;
    for (int k = 0; k < VSHI_GLTF_PARTS; ++k) {
        const char *name = vshi_gltf_parts[k].attribute;
        vshi_gltf_accessor accessor;
        VSHI_TRY(vshi_gltf_accessor_find(gltf, attributes, name, where, &accessor, error));
        if (accessor.count == 0) {
            continue;
        }
        *count = *count == SIZE_MAX ? accessor.count : *count;
        VSHI_TRY(vshi_gltf_read_attribute(gltf, attributes, name, vshi_gltf_parts[k].components, *count,
                                          where, &values[k], error));
    }
    return *count < SIZE_MAX
               ? VSH_OK
               : vshi_gltf_fail(gltf, error, "%s has neither TRANSLATION nor ROTATION nor SCALE", where);
}

/* EXT_mesh_gpu_instancing: adds the mesh once for every element of the accessors, below the node's transform.
 */
static vsh_result add_instances(vshi_gltf *gltf, size_t node, size_t mesh, size_t first,
                                const json_t *instancing, vsh_error *error) {
    float *values[VSHI_GLTF_PARTS] = {NULL};
    size_t count;
    char where[64];
    snprintf(where, sizeof where, "nodes[%zu]: EXT_mesh_gpu_instancing", node);
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_read_instances(gltf, instancing, where, values, &count, error));
    for (size_t i = 0; i < count; ++i) {
        double t[3] = {0, 0, 0}, r[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, own[12], world[12];
        double *const given[3] = {t, r, s};
        for (int k = 0; k < 3; ++k) {
            const int components = vshi_gltf_parts[k].components;
            for (int c = 0; c < components && values[k] != NULL; ++c) {
                given[k][c] = (double)values[k][(size_t)components * i + (size_t)c];
            }
        }
        compose_parts(t, r, s, own);
        vshi_transform_compose(gltf->node_world[node], own, world);
        VSHI_TRY_DONE(vshi_job_check(gltf->job, error));
        VSHI_TRY_DONE(add_entries(gltf, node, mesh, first, i + 1, world, error));
    }
done:
    for (int k = 0; k < 3; ++k) {
        free(values[k]);
    }
    return result;
}

static vsh_result add_node(vshi_gltf *gltf, size_t node, vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "nodes[%zu]", node);
    const json_t *given = vshi_gltf_element(gltf, "nodes", node);
    size_t mesh, skin, first = 0;
    bool skinned = false;
    VSHI_TRY(vshi_gltf_index(gltf, given, "mesh", "meshes", where, &mesh, error));
    VSHI_TRY(vshi_gltf_index(gltf, given, "skin", "skins", where, &skin, error));
    if (mesh == SIZE_MAX) {
        return VSH_OK;
    }
    VSHI_TRY(find_shapes(gltf, given, mesh, skin, &first, &skinned, error));
    if (skinned) {
        return add_entries(gltf, node, mesh, first, 0, vshi_identity, error);
    }
    const json_t *instancing = vshi_gltf_extension(given, "EXT_mesh_gpu_instancing");
    return instancing != NULL ? add_instances(gltf, node, mesh, first, instancing, error)
                              : add_entries(gltf, node, mesh, first, 0, gltf->node_world[node], error);
}

/* --- the tree */

static vsh_result visit(vshi_gltf *gltf, const json_t *nodes, const double parent[12], int depth,
                        vsh_error *error) {
    enum { DEEPEST = 1024 };
    size_t i;
    const json_t *item;
    if (depth > DEEPEST) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: its nodes are nested deeper than %d", gltf->path,
                         DEEPEST);
    }
    json_array_foreach(nodes, i, item) {
        const double number = json_number_value(item);
        if (!json_is_number(item) || !(number >= 0.0 && number < (double)gltf->node_count)) {
            return vshi_gltf_fail(gltf, error, "a list of nodes names node %g, but there are only %zu",
                                  number, gltf->node_count);
        }
        const size_t node = (size_t)number;
        const json_t *given = vshi_gltf_element(gltf, "nodes", node);
        double own[12];
        if (gltf->node_seen[node]) {
            return vshi_gltf_fail(gltf, error, "nodes[%zu] is its own descendant, or has two parents", node);
        }
        gltf->node_seen[node] = true;
        gltf->visited[gltf->visited_count++] = node;
        if (!read_transform(given, own)) {
            return vshi_gltf_fail(gltf, error, "nodes[%zu]: its transform is no list of numbers", node);
        }
        vshi_transform_compose(parent, own, gltf->node_world[node]);
        VSHI_TRY(visit(gltf, json_object_get(given, "children"), gltf->node_world[node], depth + 1, error));
    }
    return VSH_OK;
}

/* Lists the nodes without a parent, in new memory: a file without scenes shows them. */
static json_t *find_roots(const vshi_gltf *gltf) {
    json_t *roots = json_array();
    bool *child = calloc(gltf->node_count + 1, sizeof *child);
    for (size_t n = 0; n < gltf->node_count && child != NULL; ++n) {
        size_t i;
        const json_t *item;
        json_array_foreach(json_object_get(vshi_gltf_element(gltf, "nodes", n), "children"), i, item) {
            const double number = json_number_value(item);
            if (number >= 0.0 && number < (double)gltf->node_count) {
                child[(size_t)number] = true;
            }
        }
    }
    for (size_t n = 0; n < gltf->node_count && child != NULL; ++n) {
        if (!child[n]) {
            json_array_append_new(roots, json_integer((json_int_t)n));
        }
    }
    free(child);
    return roots;
}

static vsh_result visit_scene(vshi_gltf *gltf, vsh_error *error) {
    size_t index;
    const json_t *scenes = json_object_get(gltf->root, "scenes");
    VSHI_TRY(vshi_gltf_index(gltf, gltf->root, "scene", "scenes", "glTF", &index, error));
    if (json_array_size(scenes) > 0) { /* the first is the default */
        const json_t *scene = json_array_get(scenes, index == SIZE_MAX ? 0 : index);
        return visit(gltf, json_object_get(scene, "nodes"), vshi_identity, 0, error);
    }
    json_t *roots = find_roots(gltf);
    const vsh_result result = visit(gltf, roots, vshi_identity, 0, error);
    json_decref(roots);
    return result;
}

static vsh_result add_scene(vshi_gltf *gltf, vsh_error *error) {
    VSHI_TRY(visit_scene(gltf, error));
    for (size_t i = 0; i < gltf->visited_count; ++i) {
        VSHI_TRY(add_node(gltf, gltf->visited[i], error));
        VSHI_TRY(add_node_light(gltf, gltf->visited[i], error));
    }
    return VSH_OK;
}

/* --- the file */

static vsh_result allocate(vshi_gltf *gltf, vsh_error *error) {
    const size_t meshes = json_array_size(json_object_get(gltf->root, "meshes"));
    const size_t nodes = gltf->node_count = json_array_size(json_object_get(gltf->root, "nodes"));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->model, 1, sizeof *gltf->model, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->mesh_shapes, meshes, sizeof *gltf->mesh_shapes, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->node_seen, nodes, sizeof *gltf->node_seen, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->node_world, nodes, sizeof *gltf->node_world, error));
    return vshi_gltf_allocate(gltf, (void **)&gltf->visited, nodes, sizeof *gltf->visited, error);
}

vsh_result vshi_gltf_read(const char *path, const vsh_run *run, vshi_job *job, size_t units,
                          vsh_model **model, vsh_error *error) {
    vshi_gltf gltf = {.path = path, .run = run, .job = job};
    vshi_budget budget = {path, run, 0.0};
    vshi_text text;
    vsh_result result;
    VSHI_TRY_DONE(vshi_text_read_whole(&text, &budget, job, units / 5, error));
    gltf.bytes_held = (double)text.size;
    VSHI_TRY_DONE(vshi_gltf_open(&gltf, text.bytes, text.size, error));
    VSHI_TRY_DONE(allocate(&gltf, error));
    gltf.model->unit = 1.0; /* glTF is in metres */
    VSHI_TRY_DONE(vshi_gltf_read_materials(&gltf, error));
    VSHI_TRY_DONE(add_scene(&gltf, error));
    VSHI_TRY_DONE(vshi_text_poll(&text, text.bytes + text.size, error));
    *model = gltf.model;
    gltf.model = NULL;
done:
    vsh_model_free(gltf.model);
    free(gltf.visited);
    free(gltf.node_world);
    free(gltf.node_seen);
    free(gltf.unpackings);
    free(gltf.mesh_shapes);
    vshi_gltf_free_buffers(&gltf);
    json_decref(gltf.root);
    vshi_text_free(&text);
    return result;
}
