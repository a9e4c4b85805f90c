/* The nodes of a glTF's scene: where they stand, and the meshes that they show. */
#include "model/gltf.h"

#include "base/memory.h"
#include "base/vec.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- lights: KHR_lights_punctual (Khronos, ratified 2019) */

static const char extension[] = "KHR_lights_punctual";

static int32_t type_of(const char *name) {
    static const char *const names[] = {[VSH_MODEL_LIGHT_DIRECTIONAL] = "directional",
                                        [VSH_MODEL_LIGHT_POINT] = "point",
                                        [VSH_MODEL_LIGHT_SPOT] = "spot"};
    for (int32_t i = 0; name != NULL && i < (int32_t)(sizeof names / sizeof names[0]); ++i) {
        if (strcmp(name, names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

/* A number that stays where the key is absent. */
static vsh_result number(const vshi_gltf *gltf, const json_t *object, const char *key, double lowest,
                         double highest, const char *where, double *value, vsh_error *error) {
    const json_t *given = json_object_get(object, key);
    const double told = given != NULL ? json_number_value(given) : *value;
    if ((given != NULL && !json_is_number(given)) || !(told >= lowest && told <= highest)) {
        return vshi_gltf_fail(gltf, error, "%s: its %s is %s%g, expected a number of %g to %g", where, key,
                              json_is_number(given) ? "" : "no number, or ", told, lowest, highest);
    }
    *value = told;
    return VSH_OK;
}

static vsh_result read_values(const vshi_gltf *gltf, const json_t *given, const char *where,
                              vsh_model_light *light, vsh_error *error) {
    static const double eighth = 0.78539816339744828, quarter = 1.5707963267948966; /* turns, radians */
    /* a quarter turn, as written with few digits */
    static const double widest = 1.5708;
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
    VSHI_TRY(number(gltf, given, "intensity", 0.0, FLT_MAX, where, &light->intensity, error));
    VSHI_TRY(number(gltf, given, "range", 0.0, FLT_MAX, where, &light->range, error));
    if (light->type == VSH_MODEL_LIGHT_SPOT) {
        const json_t *spot = json_object_get(given, "spot");
        light->outer_angle = eighth;
        VSHI_TRY(number(gltf, spot, "outerConeAngle", DBL_MIN, widest, where, &light->outer_angle, error));
        VSHI_TRY(
            number(gltf, spot, "innerConeAngle", 0.0, light->outer_angle, where, &light->inner_angle, error));
        light->outer_angle = fmin(light->outer_angle, quarter);
        light->inner_angle = fmin(light->inner_angle, quarter);
    }
    return VSH_OK;
}

/* Where its node stands, and the way its -z points. False where it points nowhere. */
static bool place(const double world[12], vsh_model_light *light) {
    const vshi_vec away = {-world[2], -world[6], -world[10]};
    for (int i = 0; i < 3; ++i) {
        light->position[i] = world[4 * i + 3];
        if (!(fabs(light->position[i]) <= FLT_MAX)) {
            return false;
        }
    }
    const double length = vshi_length(away);
    if (light->type == VSH_MODEL_LIGHT_POINT) {
        return true;
    }
    if (!(length > 0.0 && length <= FLT_MAX)) {
        return false;
    }
    const vshi_vec unit = vshi_unit(away);
    light->direction[0] = unit.x + 0.0; /* no -0 */
    light->direction[1] = unit.y + 0.0;
    light->direction[2] = unit.z + 0.0;
    return true;
}

static vsh_result add_light(vshi_gltf *gltf, size_t node, size_t index, const json_t *given,
                            vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "lights[%zu] of %s", index, extension);
    vsh_model_light light = {.type = type_of(json_string_value(json_object_get(given, "type")))};
    if (light.type < 0) {
        vshi_warn(gltf->run, "%s: %s is left out: its type is not directional, point or spot", gltf->path,
                  where);
        return VSH_OK;
    }
    VSHI_TRY(read_values(gltf, given, where, &light, error));
    if (!place(gltf->node_world[node], &light)) {
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
    const json_t *carried = vshi_gltf_extension(vshi_gltf_element(gltf, "nodes", node), extension);
    const json_t *lights = json_object_get(vshi_gltf_extension(gltf->root, extension), "lights");
    size_t index;
    if (carried == NULL) {
        return VSH_OK;
    }
    if (!vshi_gltf_count(carried, "light", SIZE_MAX, &index) || index >= json_array_size(lights)) {
        return vshi_gltf_fail(gltf, error, "nodes[%zu]: its light is none of the %zu of %s", node,
                              json_array_size(lights), extension);
    }
    return add_light(gltf, node, index, json_array_get(lights, index), error);
}

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* Translation × rotation (a quaternion x, y, z, w) × scale, in floats, as transforms have always come out of
 * files: bakes keep their bits. A quaternion that is no unit one is made one. */
static void from_parts(const double t[3], const double r[4], const double s[3], double own[12]) {
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

static bool own_transform(const json_t *node, double own[12]) {
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
    from_parts(t, r, s, own);
    return good;
}

/* "nodes[3]" where it has no name, and the same of meshes. */
static void name_of(const char *array, size_t index, const json_t *item, char *text, size_t size) {
    const char *name = json_string_value(json_object_get(item, "name"));
    if (name != NULL && name[0] != '\0') {
        snprintf(text, size, "%s", name);
    } else {
        snprintf(text, size, "%s[%zu]", array, index);
    }
}

/* --- shapes */

/* A shape for each primitive of a mesh, from *first on. */
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
        if (vshi_job_cancelled(gltf->job)) {
            return vshi_job_fail_cancelled(gltf->job, error);
        }
        VSHI_TRY(vshi_gltf_read_primitive(gltf, json_array_get(primitives, i), pose, where, shape, error));
    }
    return VSH_OK;
}

/* --- skins and weights */

/* The inverse bind matrices of a skin's `count` joints; stays NULL where all are the identity. */
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
    VSHI_TRY_DONE(vshi_allocate((void **)joints, *count, sizeof **joints, gltf->path, error));
    for (size_t i = 0; i < *count; ++i) {
        const double node = json_number_value(json_array_get(list, i));
        if (!(node >= 0.0 && node < (double)gltf->node_count) || !gltf->node_seen[(size_t)node]) {
            result = vshi_gltf_fail(gltf, error, "%s: joint %zu is no node of the scene", where, i);
            goto done;
        }
        double bind[12];
        for (int k = 0; k < 12; ++k) {
            bind[k] = inverse != NULL ? (double)inverse[16 * i + (size_t)(4 * (k % 4) + k / 4)] : identity[k];
        }
        vshi_model_compose(gltf->node_world[(size_t)node], bind, (*joints)[i]);
    }
done:
    free(inverse);
    return result;
}

/* The default weights of a mesh's morph targets: the node's, else the mesh's; SIZE_MAX: no numbers. */
static vsh_result read_weights(const vshi_gltf *gltf, const json_t *owner, double **weights, size_t *count,
                               vsh_error *error) {
    *count = json_array_size(json_object_get(owner, "weights"));
    VSHI_TRY(vshi_allocate((void **)weights, *count, sizeof **weights, gltf->path, error));
    return vshi_gltf_numbers(owner, "weights", *count, *weights)
               ? VSH_OK
               : vshi_gltf_fail(gltf, error, "the weights of morph targets are no numbers");
}

/* The shapes of a node's mesh, from *first on, as its weights and its skin have them; nodes without either
 * share theirs. *skinned: they are in the world, and the node's own transform is left out. */
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

/* `instance`: 1 + which of the node's it is; 0: it has none. */
static vsh_result add_entries(vshi_gltf *gltf, size_t node, size_t mesh, size_t first, size_t instance,
                              const double world[12], vsh_error *error) {
    const json_t *given = vshi_gltf_element(gltf, "meshes", mesh);
    const size_t count = json_array_size(json_object_get(given, "primitives"));
    char node_name[256], mesh_name[256];
    const uint32_t object = vshi_model_next_object(gltf->model);
    name_of("nodes", node, vshi_gltf_element(gltf, "nodes", node), node_name, sizeof node_name);
    name_of("meshes", mesh, given, mesh_name, sizeof mesh_name);
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

/* EXT_mesh_gpu_instancing: the mesh once for every element of its accessors, each with a transform behind the
 * node's. */
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
        from_parts(t, r, s, own);
        vshi_model_compose(gltf->node_world[node], own, world);
        VSHI_TRY_DONE(vshi_job_cancelled(gltf->job)
                          ? vshi_job_fail_cancelled(gltf->job, error)
                          : add_entries(gltf, node, mesh, first, i + 1, world, error));
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
        return add_entries(gltf, node, mesh, first, 0, identity, error);
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
        if (!own_transform(given, own)) {
            return vshi_gltf_fail(gltf, error, "nodes[%zu]: its transform holds what is no number", node);
        }
        vshi_model_compose(parent, own, gltf->node_world[node]);
        VSHI_TRY(visit(gltf, json_object_get(given, "children"), gltf->node_world[node], depth + 1, error));
    }
    return VSH_OK;
}

/* All nodes that are nobody's child, in new memory: what a file without scenes shows. */
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
    if (json_array_size(scenes) > 0) { /* the first where none is named */
        const json_t *scene = json_array_get(scenes, index == SIZE_MAX ? 0 : index);
        return visit(gltf, json_object_get(scene, "nodes"), identity, 0, error);
    }
    json_t *roots = find_roots(gltf);
    const vsh_result result = visit(gltf, roots, identity, 0, error);
    json_decref(roots);
    return result;
}

vsh_result vshi_gltf_add_scene(vshi_gltf *gltf, vsh_error *error) {
    VSHI_TRY(visit_scene(gltf, error));
    for (size_t i = 0; i < gltf->visited_count; ++i) {
        VSHI_TRY(add_node(gltf, gltf->visited[i], error));
        VSHI_TRY(add_node_light(gltf, gltf->visited[i], error));
    }
    return gltf->model->entry_count > 0 ? VSH_OK : vshi_gltf_fail(gltf, error, "holds no triangles");
}
