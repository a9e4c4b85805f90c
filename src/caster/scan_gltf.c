/* glTF: the JSON is whole, a GLB is as long as it says, and the number of triangles that the scene uses.
 * Assimp 5.2 drops a triangle whose index is out of range without a word; the number shows it. */
#include "caster/scan.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

/* The element of an array in the root; NULL where there is none. */
static json_t *element(const json_t *root, const char *array, const json_t *index) {
    if (!json_is_integer(index) || json_integer_value(index) < 0) {
        return NULL;
    }
    return json_array_get(json_object_get(root, array), (size_t)json_integer_value(index));
}

static size_t primitive_triangles(const json_t *root, const json_t *primitive) {
    enum { TRIANGLES = 4, STRIP = 5, FAN = 6 };
    const json_t *mode = json_object_get(primitive, "mode");
    const json_int_t kind = json_is_integer(mode) ? json_integer_value(mode) : TRIANGLES;
    const json_t *indices = json_object_get(primitive, "indices");
    if (indices == NULL) {
        indices = json_object_get(json_object_get(primitive, "attributes"), "POSITION");
    }
    const json_int_t count =
        json_integer_value(json_object_get(element(root, "accessors", indices), "count"));
    if (count < 3 || count > UINT32_MAX) {
        return 0;
    }
    return kind == TRIANGLES ? (size_t)count / 3 : kind == STRIP || kind == FAN ? (size_t)count - 2 : 0;
}

/* Adds the triangles of the nodes' meshes, every mesh once. */
static void visit(const json_t *root, const json_t *nodes, int depth, bool *node_seen, bool *mesh_seen,
                  size_t *triangles) {
    enum { DEEPEST = 1024 };
    size_t i;
    const json_t *index;
    json_array_foreach(nodes, i, index) {
        const json_t *node = element(root, "nodes", index);
        if (node == NULL || node_seen[json_integer_value(index)] || depth == DEEPEST) {
            continue;
        }
        node_seen[json_integer_value(index)] = true;
        const json_t *mesh_index = json_object_get(node, "mesh");
        const json_t *mesh = element(root, "meshes", mesh_index);
        if (mesh != NULL && !mesh_seen[json_integer_value(mesh_index)]) {
            mesh_seen[json_integer_value(mesh_index)] = true;
            size_t k;
            const json_t *primitive;
            json_array_foreach(json_object_get(mesh, "primitives"), k, primitive) {
                *triangles += primitive_triangles(root, primitive);
            }
        }
        visit(root, json_object_get(node, "children"), depth + 1, node_seen, mesh_seen, triangles);
    }
}

static vsh_result scan_json(vshi_scan *scan, const char *text, size_t size, vsh_error *error) {
    json_error_t where;
    json_t *root = json_loadb(text, size, 0, &where);
    if (root == NULL) {
        const bool early = json_error_code(&where) == json_error_premature_end_of_input ||
                           where.position < 0 || (size_t)where.position >= size;
        return vshi_fail(error, early ? VSH_ERROR_READ : VSH_ERROR_INPUT, "%s: %s: line %d column %d: %s",
                         scan->path, early ? "cut short" : "its JSON is damaged", where.line, where.column,
                         where.text);
    }
    vsh_result result = VSH_OK;
    bool *node_seen = calloc(json_array_size(json_object_get(root, "nodes")) + 1, sizeof *node_seen);
    bool *mesh_seen = calloc(json_array_size(json_object_get(root, "meshes")) + 1, sizeof *mesh_seen);
    if (node_seen == NULL || mesh_seen == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", scan->path);
    } else {
        const json_t *index = json_object_get(root, "scene");
        const json_t *scenes = json_object_get(root, "scenes");
        /* Assimp takes the first scene where none is named. */
        const json_t *scene = index != NULL ? element(root, "scenes", index) : json_array_get(scenes, 0);
        visit(root, json_object_get(scene, "nodes"), 0, node_seen, mesh_seen, &scan->faces);
    }
    free(mesh_seen);
    free(node_seen);
    json_decref(root);
    return result;
}

vsh_result vshi_scan_gltf(vshi_scan *scan, vsh_error *error) {
    return scan_json(scan, scan->text, scan->size, error);
}

vsh_result vshi_scan_glb(vshi_scan *scan, vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8 };
    static const char magic[4] = {'g', 'l', 'T', 'F'};
    const size_t compared = scan->size < sizeof magic ? scan->size : sizeof magic;
    if (memcmp(scan->text, magic, compared) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is no GLB: it does not begin with 'glTF'", scan->path);
    }
    const uint64_t length =
        scan->size < HEADER + CHUNK ? HEADER + CHUNK : vshi_scan_bytes(scan->text + 8, 4, false);
    if (length > scan->size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of %llu", scan->path, scan->size,
                         (unsigned long long)length);
    }
    if (vshi_scan_bytes(scan->text + 4, 4, false) != 2) {
        return VSH_OK; /* glTF 1: left to Assimp */
    }
    const uint64_t json = vshi_scan_bytes(scan->text + HEADER, 4, false);
    if (json > scan->size - HEADER - CHUNK) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: its JSON of %llu bytes passes the file's %zu bytes",
                         scan->path, (unsigned long long)json, scan->size);
    }
    return scan_json(scan, scan->text + HEADER + CHUNK, (size_t)json, error);
}
