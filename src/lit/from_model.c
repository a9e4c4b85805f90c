/* A document made of a model that comes from another format: a node for each object, white materials. */
#include "lit/work.h"

#include "base/vec.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Arrays of a mesh in the document, for others that are the same. */
typedef struct arrays {
    const vsh_mesh *mesh;
    const vsh_lit_mesh *lit;      /* whose sources they are copied by; NULL: as they are */
    json_t *attributes;           /* without the lightmap's UVs */
    size_t indices;               /* accessor of all triangles; SIZE_MAX: not made */
    size_t sets[VSH_MAX_UV_SETS]; /* number of each of the model's sets in the document; SIZE_MAX: none */
    size_t set_count;
} arrays;

typedef struct maker {
    vshi_lit_work *work;
    vsh_mesh *meshes; /* [count], of the model */
    arrays *list;     /* [list_count], none of which has vertices in the world */
    size_t count, list_count;
} maker;

static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* --- transforms */

/* Nodes of glTF turn, scale and mirror, but do not shear (3.5.3). */
static bool shears(const double m[12]) {
    static const double slack = 1e-6; /* of the cosine between two axes; matrices of files are floats */
    for (int a = 0; a < 3; ++a) {
        const vshi_vec one = {m[a], m[4 + a], m[8 + a]};
        const int b = (a + 1) % 3;
        const vshi_vec other = {m[b], m[4 + b], m[8 + b]};
        if (fabs(vshi_dot(one, other)) > slack * vshi_length(one) * vshi_length(other)) {
            return true;
        }
    }
    return false;
}

/* --- vertices */

static size_t source_of(const vsh_lit_mesh *lit, size_t v) {
    return lit != NULL ? lit->sources[v] : v;
}

static vsh_result add_positions(maker *m, const vsh_mesh *mesh, const vsh_lit_mesh *lit, size_t count,
                                const double *world, float *values, json_t *attributes, vsh_error *error) {
    size_t accessor;
    for (size_t v = 0; v < count; ++v) {
        const float *from = mesh->positions + 3 * source_of(lit, v);
        memcpy(values + 3 * v, from, sizeof(float[3]));
        if (world != NULL) {
            const vshi_vec p = vshi_transform_point(world, vshi_vec_off(from));
            const float moved[3] = {(float)p.x, (float)p.y, (float)p.z};
            memcpy(values + 3 * v, moved, sizeof moved);
        }
    }
    VSHI_TRY(vshi_lit_add_floats(&m->work->document, values, count, 3, true, &accessor, NULL, error));
    vshi_lit_set_number(&m->work->document, attributes, "POSITION", accessor);
    return VSH_OK;
}

/* Where a normal is none, that of the triangles around it, which is what it is shaded by here. */
static vshi_vec flat_normal(const vsh_mesh *mesh, size_t triangle) {
    const uint32_t *corner = mesh->indices + 3 * triangle;
    const vshi_vec a = vshi_vec_off(mesh->positions + 3 * (size_t)corner[0]);
    const vshi_vec b = vshi_vec_off(mesh->positions + 3 * (size_t)corner[1]);
    const vshi_vec c = vshi_vec_off(mesh->positions + 3 * (size_t)corner[2]);
    return vshi_cross(vshi_sub(b, a), vshi_sub(c, a));
}

static vsh_result add_normals(maker *m, const vsh_mesh *mesh, const vsh_lit_mesh *lit, size_t count,
                              const double *world, float *values, json_t *attributes, vsh_error *error) {
    vshi_lit_document *document = &m->work->document;
    vshi_vec *normals = NULL; /* of the mesh */
    const double held = document->gltf.bytes_held;
    size_t accessor;
    vsh_result result;
    VSHI_TRY_DONE(
        vshi_gltf_allocate(&document->gltf, (void **)&normals, mesh->vertex_count, sizeof *normals, error));
    document->gltf.bytes_held = held;
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        const float *given = mesh->normals + 3 * (size_t)mesh->indices[i];
        if (!(vshi_length(vshi_vec_off(given)) > 0.0)) {
            normals[mesh->indices[i]] = vshi_add(normals[mesh->indices[i]], flat_normal(mesh, i / 3));
        }
    }
    for (size_t v = 0; v < count; ++v) {
        const size_t source = source_of(lit, v);
        const vshi_vec given = vshi_vec_off(mesh->normals + 3 * source);
        vshi_vec n = vshi_length(given) > 0.0 ? given : normals[source];
        n = world != NULL ? vshi_transform_normal(world, n) : n;
        n = vshi_length(n) > 0.0 ? vshi_unit(n) : (vshi_vec){0.0, 1.0, 0.0};
        const float unit[3] = {(float)n.x, (float)n.y, (float)n.z};
        memcpy(values + 3 * v, unit, sizeof unit);
    }
    VSHI_TRY_DONE(vshi_lit_add_floats(document, values, count, 3, false, &accessor, NULL, error));
    vshi_lit_set_number(document, attributes, "NORMAL", accessor);
done:
    free(normals);
    return result;
}

static vsh_result add_set(maker *m, const float *uvs, const vsh_lit_mesh *lit, size_t count, float *values,
                          size_t number, json_t *attributes, vsh_error *error) {
    char name[40];
    size_t accessor;
    for (size_t v = 0; v < count; ++v) {
        for (size_t c = 0; c < 2; ++c) {
            const float given = uvs[2 * source_of(lit, v) + c];
            values[2 * v + c] = !isfinite(given) ? 0.0F : c == 1 ? 1.0F - given : given; /* v points down */
        }
    }
    snprintf(name, sizeof name, "TEXCOORD_%zu", number);
    VSHI_TRY(vshi_lit_add_floats(&m->work->document, values, count, 2, false, &accessor, NULL, error));
    vshi_lit_set_number(&m->work->document, attributes, name, accessor);
    return VSH_OK;
}

static vsh_result fill(maker *m, size_t entry, const double *world, arrays *a, vsh_error *error) {
    vshi_lit_document *document = &m->work->document;
    const vsh_mesh *mesh = &m->meshes[entry];
    const size_t count = a->lit != NULL ? a->lit->vertex_count : mesh->vertex_count;
    const double held = document->gltf.bytes_held;
    float *values = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&values, count, sizeof(float[3]), error));
    document->gltf.bytes_held = held;
    VSHI_TRY_DONE(add_positions(m, mesh, a->lit, count, world, values, a->attributes, error));
    if (mesh->normals != NULL) {
        VSHI_TRY_DONE(add_normals(m, mesh, a->lit, count, world, values, a->attributes, error));
    }
    for (int32_t set = 0; set < VSH_MAX_UV_SETS; ++set) {
        const float *uvs = vsh_model_mesh(m->work->model, entry, set).uvs;
        a->sets[set] = uvs != NULL ? a->set_count : SIZE_MAX;
        if (uvs == NULL) {
            continue;
        }
        if (a->lit == NULL || a->set_count != VSHI_LIT_SET) { /* the new UVs replace that set */
            VSHI_TRY_DONE(add_set(m, uvs, a->lit, count, values, a->set_count, a->attributes, error));
        }
        ++a->set_count;
    }
done:
    free(values);
    return result;
}

/* --- primitives */

static bool is_same(const arrays *a, const vsh_mesh *mesh, const vsh_lit_mesh *lit) {
    if (a->mesh->positions != mesh->positions || a->mesh->indices != mesh->indices ||
        (a->lit == NULL) != (lit == NULL)) {
        return false;
    }
    return lit == NULL || vshi_lit_is_split_alike(a->lit, lit);
}

/* Arrays of an earlier mesh, or new ones; those in the world are for one mesh only. */
static vsh_result take_arrays(maker *m, size_t entry, const double *world, arrays **found, vsh_error *error) {
    const vsh_mesh *mesh = &m->meshes[entry];
    const vsh_lit_mesh *lit = m->work->meshes[entry].uvs != NULL ? &m->work->meshes[entry] : NULL;
    for (size_t i = 0; i < m->list_count && world == NULL; ++i) {
        *found = &m->list[i];
        if ((*found)->mesh != NULL && is_same(*found, mesh, lit)) {
            return VSH_OK;
        }
    }
    *found = &m->list[m->list_count++];
    **found = (arrays){
        .mesh = world == NULL ? mesh : NULL, .lit = lit, .attributes = json_object(), .indices = SIZE_MAX};
    return fill(m, entry, world, *found, error);
}

static vsh_result put_primitive(maker *m, size_t entry, arrays *a, json_t *made, json_t *list,
                                vsh_error *error) {
    vshi_lit_work *work = m->work;
    vshi_lit_document *document = &work->document;
    const vsh_mesh *mesh = &m->meshes[entry];
    const vsh_lit_mesh *lit = &work->meshes[entry];
    const uint32_t *corners = lit->uvs != NULL ? lit->indices : mesh->indices;
    const size_t count = lit->uvs != NULL ? lit->vertex_count : mesh->vertex_count;
    size_t set = a->set_count < VSHI_LIT_SET ? a->set_count : VSHI_LIT_SET;
    if (lit->uvs != NULL) {
        float *values = NULL;
        VSHI_TRY(vshi_gltf_allocate(&document->gltf, (void **)&values, count, sizeof(float[2]), error));
        const vsh_result result =
            add_set(m, lit->uvs, NULL, count, values, set, json_object_get(made, "attributes"), error);
        free(values);
        VSHI_TRY(result);
        VSHI_TRY(vshi_lit_tell_set(document, made, set, error));
    } else if (lit->uv_set >= 0) {
        set = a->sets[lit->uv_set];
    }
    if (lit->uvs == NULL && (lit->uv_set < 0 || set == SIZE_MAX)) {
        if (a->indices == SIZE_MAX) {
            VSHI_TRY(
                vshi_lit_add_indices(document, corners, 3 * mesh->triangle_count, count, &a->indices, error));
        }
        vshi_lit_set_number(document, made, "indices", a->indices);
        vshi_lit_push(document, list, json_incref(made));
        return VSH_OK;
    }
    vsh_lit_mesh shown = *lit;
    shown.triangle_count = mesh->triangle_count;
    return vshi_lit_pages_make(work, made, &shown, corners, count, set, &a->indices, list, error);
}

static vsh_result add_primitive(maker *m, size_t entry, const double *world, json_t *list, vsh_error *error) {
    arrays *a;
    VSHI_TRY(take_arrays(m, entry, world, &a, error));
    json_t *made = json_pack("{s:o}", "attributes", vshi_lit_copy_json(&m->work->document, a->attributes));
    const vsh_result result = put_primitive(m, entry, a, made, list, error);
    json_decref(made);
    return result;
}

/* --- nodes */

static vsh_result add_node(maker *m, size_t first, size_t end, json_t *nodes, vsh_error *error) {
    vshi_lit_document *document = &m->work->document;
    const vsh_mesh *of = &m->meshes[first];
    const char *name = of->object_name != NULL ? of->object_name : of->name;
    const bool sheared = shears(of->transform);
    json_t *list = json_array(), *made = json_object();
    vsh_result result = VSH_OK;
    for (size_t i = first; i < end && result == VSH_OK; ++i) {
        result = add_primitive(m, i, sheared ? of->transform : NULL, list, error);
    }
    const size_t mesh = vshi_lit_append(document, "meshes", json_pack("{s:o}", "primitives", list));
    vshi_lit_push(document, nodes, json_integer((json_int_t)vshi_lit_append(document, "nodes", made)));
    vshi_lit_set_number(document, made, "mesh", mesh);
    errno = 0;
    json_t *label = name != NULL ? json_string(name) : NULL; /* one that is no UTF-8 has no place there */
    if (label != NULL || errno == ENOMEM) {
        vshi_lit_set(document, made, "name", label);
    }
    if (!sheared && memcmp(of->transform, identity, sizeof identity) != 0) {
        double columns[16] = {[15] = 1.0};
        for (int i = 0; i < 16; ++i) {
            columns[i] = i % 4 < 3 ? of->transform[4 * (i % 4) + i / 4] : columns[i];
        }
        vshi_lit_set(document, made, "matrix", vshi_lit_numbers(document, columns, 16));
    }
    return result;
}

static vsh_result add_all(maker *m, json_t *nodes, vsh_error *error) {
    vshi_gltf *gltf = &m->work->document.gltf;
    for (size_t first = 0, end; first < m->count; first = end) {
        const vsh_mesh *of = &m->meshes[first];
        for (end = first + 1; end < m->count && of->object != 0 && m->meshes[end].object == of->object &&
                              memcmp(m->meshes[end].transform, of->transform, sizeof identity) == 0;) {
            ++end;
        }
        VSHI_TRY(vshi_job_advance(gltf->job, end - first) ? vshi_job_fail_cancelled(gltf->job, error)
                                                          : add_node(m, first, end, nodes, error));
    }
    return VSH_OK;
}

vsh_result vshi_lit_from_model(vshi_lit_work *work, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    maker m = {.work = work, .count = vsh_model_mesh_count(work->model)};
    json_t *nodes = json_array();
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&m.meshes, m.count, sizeof *m.meshes, error));
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&m.list, m.count, sizeof *m.list, error));
    for (size_t i = 0; i < m.count; ++i) {
        m.meshes[i] = vsh_model_mesh(work->model, i, 0);
    }
    vshi_lit_set_number(document, document->gltf.root, "scene", 0);
    vshi_lit_append(document, "scenes", json_pack("{s:O}", "nodes", nodes));
    VSHI_TRY_DONE(add_all(&m, nodes, error));
done:
    for (size_t i = 0; i < m.list_count; ++i) {
        json_decref(m.list[i].attributes);
    }
    free(m.list);
    free(m.meshes);
    json_decref(nodes);
    return result;
}
