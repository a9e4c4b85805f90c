/* A document made of a model of another format: a node for each object, and white materials. */
#include "io/lit/work.h"

#include "geometry/mesh.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Arrays of a mesh in the document, shared by equal meshes. */
typedef struct arrays {
    const vsh_mesh *mesh;         /* NULL: in the world, and not shared */
    const vsh_lit_mesh *lit;      /* with new vertices; NULL: the mesh's own */
    json_t *attributes;           /* without the lightmap's UVs */
    size_t indices;               /* accessor of all triangles; SIZE_MAX: not made */
    size_t sets[VSH_MAX_UV_SETS]; /* number of each of the model's sets in the document; SIZE_MAX: none */
    size_t set_count;
} arrays;

typedef struct maker {
    vshi_lit_work *work;
    vsh_mesh *meshes; /* [count], of the model */
    arrays *list;     /* [list_count] */
    size_t count, list_count;
} maker;

/* --- transforms */

/* Nodes of glTF turn, scale and mirror, but do not shear (3.5.3). */
static bool is_sheared(const double m[12]) {
    static const double slack = 1e-6; /* of the cosine between two axes: files store floats */
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

static vsh_result add_attribute(maker *m, json_t *attributes, const char *name, const float *values,
                                size_t count, int components, vsh_error *error) {
    size_t accessor;
    VSHI_TRY(vshi_lit_add_floats(m->work, values, count, components, strcmp(name, "POSITION") == 0, &accessor,
                                 error));
    vshi_lit_set_number(m->work, attributes, name, accessor);
    return VSH_OK;
}

static size_t find_source(const vsh_lit_mesh *lit, size_t v) {
    return lit != NULL ? lit->sources[v] : v;
}

static size_t count_vertices(const vsh_mesh *mesh, const vsh_lit_mesh *lit) {
    return lit != NULL ? lit->vertex_count : mesh->vertex_count;
}

static void copy_positions(const vsh_mesh *mesh, const vsh_lit_mesh *lit, const double *world,
                           float *values) {
    for (size_t v = 0; v < count_vertices(mesh, lit); ++v) {
        const float *from = mesh->positions + 3 * find_source(lit, v);
        vshi_vec_to_floats(vshi_transform_point(world, vshi_vec_off(from)), values + 3 * v);
    }
}

/* A normal of length 0 becomes that of the triangles around the vertex, which is how it is shaded here. */
static vsh_result copy_normals(maker *m, const vsh_mesh *mesh, const vsh_lit_mesh *lit, const double *world,
                               float *values, vsh_error *error) {
    vshi_gltf *gltf = &m->work->gltf;
    vshi_vec *flat;
    const double held = gltf->bytes_held;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&flat, mesh->vertex_count, sizeof *flat, error));
    gltf->bytes_held = held;
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        const size_t v = mesh->indices[i];
        if (!(vshi_length(vshi_vec_off(mesh->normals + 3 * v)) > 0.0)) {
            flat[v] = vshi_add(flat[v], vshi_mesh_face_normal(mesh, i / 3));
        }
    }
    for (size_t v = 0; v < count_vertices(mesh, lit); ++v) {
        const size_t source = find_source(lit, v);
        const vshi_vec given = vshi_vec_off(mesh->normals + 3 * source);
        vshi_vec n = vshi_length(given) > 0.0 ? given : flat[source];
        n = vshi_transform_normal(world, n);
        n = vshi_length(n) > 0.0 ? vshi_unit(n) : (vshi_vec){0.0, 1.0, 0.0};
        vshi_vec_to_floats(n, values + 3 * v);
    }
    free(flat);
    return VSH_OK;
}

/* `values` is scratch. */
static vsh_result add_set(maker *m, json_t *attributes, size_t number, const float *uvs,
                          const vsh_lit_mesh *lit, size_t count, float *values, vsh_error *error) {
    char name[40];
    for (size_t v = 0; v < count; ++v) {
        for (size_t c = 0; c < 2; ++c) {
            const float given = uvs[2 * find_source(lit, v) + c];
            values[2 * v + c] = !isfinite(given) ? 0.0F : c == 1 ? 1.0F - given : given; /* v points down */
        }
    }
    snprintf(name, sizeof name, "TEXCOORD_%zu", number);
    return add_attribute(m, attributes, name, values, count, 2, error);
}

static vsh_result add_vertices(maker *m, size_t entry, const double *world, arrays *a, vsh_error *error) {
    vshi_gltf *gltf = &m->work->gltf;
    const vsh_mesh *mesh = &m->meshes[entry];
    const size_t count = count_vertices(mesh, a->lit);
    const double held = gltf->bytes_held;
    float *values;
    vsh_result result;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&values, count, sizeof(float[3]), error));
    gltf->bytes_held = held;
    copy_positions(mesh, a->lit, world, values);
    VSHI_TRY_DONE(add_attribute(m, a->attributes, "POSITION", values, count, 3, error));
    if (mesh->normals != NULL) {
        VSHI_TRY_DONE(copy_normals(m, mesh, a->lit, world, values, error));
        VSHI_TRY_DONE(add_attribute(m, a->attributes, "NORMAL", values, count, 3, error));
    }
    for (int32_t set = 0; set < VSH_MAX_UV_SETS; ++set) {
        const float *uvs = vsh_model_mesh(m->work->model, entry, set).uvs;
        a->sets[set] = uvs != NULL ? a->set_count : SIZE_MAX;
        if (uvs != NULL && (a->lit == NULL || a->set_count != VSHI_LIT_SET)) { /* new UVs replace that set */
            VSHI_TRY_DONE(add_set(m, a->attributes, a->set_count, uvs, a->lit, count, values, error));
        }
        a->set_count += uvs != NULL || m->work->meshes == NULL;
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

/* How a mesh is lit: not at all if the work has no meshes. */
static const vsh_lit_mesh *find_lit(const maker *m, size_t entry) {
    static const vsh_lit_mesh unlit = {.uv_set = -1};
    return m->work->meshes != NULL ? &m->work->meshes[entry] : &unlit;
}

/* Arrays of an earlier mesh, or new ones; arrays in the world are for one mesh only. */
static vsh_result find_arrays(maker *m, size_t entry, const double *world, arrays **found, vsh_error *error) {
    const vsh_mesh *mesh = &m->meshes[entry];
    const vsh_lit_mesh *lit = find_lit(m, entry)->uvs != NULL ? find_lit(m, entry) : NULL;
    for (size_t i = 0; i < m->list_count && world == NULL; ++i) {
        *found = &m->list[i];
        if ((*found)->mesh != NULL && is_same(*found, mesh, lit)) {
            return VSH_OK;
        }
    }
    *found = &m->list[m->list_count++];
    **found = (arrays){
        .mesh = world == NULL ? mesh : NULL, .lit = lit, .attributes = json_object(), .indices = SIZE_MAX};
    return add_vertices(m, entry, world, *found, error);
}

/* Adds the new UVs of a mesh. */
static vsh_result add_new_set(maker *m, json_t *made, const vsh_lit_mesh *lit, size_t set, vsh_error *error) {
    float *values;
    VSHI_TRY(
        vshi_gltf_allocate(&m->work->gltf, (void **)&values, lit->vertex_count, sizeof(float[2]), error));
    const vsh_result result = add_set(m, json_object_get(made, "attributes"), set, lit->uvs, NULL,
                                      lit->vertex_count, values, error);
    free(values);
    return result;
}

/* Appends the primitives that `made`, with all attributes, becomes. */
static vsh_result add_pages(maker *m, size_t entry, arrays *a, json_t *made, json_t *list, vsh_error *error) {
    vshi_lit_work *work = m->work;
    const vsh_mesh *mesh = &m->meshes[entry];
    vsh_lit_mesh lit = *find_lit(m, entry);
    vshi_lit_corners corners = {&lit, lit.uvs != NULL ? lit.indices : mesh->indices,
                                count_vertices(mesh, a->lit), SIZE_MAX};
    lit.triangle_count = mesh->triangle_count;
    if (lit.uvs != NULL) {
        corners.set = a->set_count < VSHI_LIT_SET ? a->set_count : VSHI_LIT_SET;
        VSHI_TRY(add_new_set(m, made, &lit, corners.set, error));
    } else if (lit.uv_set >= 0) {
        corners.set = a->sets[lit.uv_set];
    }
    if (corners.set != SIZE_MAX) {
        return vshi_lit_make_pages(work, made, &corners, &a->indices, list, error);
    }
    if (lit.colors != NULL) {
        size_t accessor;
        VSHI_TRY(vshi_lit_add_colors(work, lit.colors, mesh->vertex_count, &accessor, error));
        vshi_lit_set_number(work, json_object_get(made, "attributes"), "COLOR_0", accessor);
    }
    if (a->indices == SIZE_MAX) {
        VSHI_TRY(vshi_lit_add_indices(work, corners.list, 3 * mesh->triangle_count, corners.vertex_count,
                                      &a->indices, error));
    }
    vshi_lit_set_number(work, made, "indices", a->indices);
    vshi_lit_push(work, list, json_incref(made));
    return lit.colors != NULL
               ? vshi_lit_mark_primitive(work, made, (uint32_t)work->page_count, 0, NULL, error)
               : VSH_OK;
}

static vsh_result add_primitive(maker *m, size_t entry, const double *world, json_t *list, vsh_error *error) {
    arrays *a;
    VSHI_TRY(find_arrays(m, entry, world, &a, error));
    json_t *made = json_pack("{s:o}", "attributes", vshi_lit_copy_json(m->work, a->attributes));
    const vsh_result result = add_pages(m, entry, a, made, list, error);
    json_decref(made);
    return result;
}

/* --- nodes */

static vsh_result add_node(maker *m, size_t first, size_t end, json_t *nodes, vsh_error *error) {
    vshi_lit_work *work = m->work;
    const vsh_mesh *of = &m->meshes[first];
    const char *name = of->object_name != NULL ? of->object_name : of->name;
    const bool sheared = is_sheared(of->transform);
    json_t *list = json_array(), *made = json_object();
    vsh_result result = VSH_OK;
    for (size_t i = first; i < end && result == VSH_OK; ++i) {
        result = add_primitive(m, i, sheared ? of->transform : NULL, list, error);
    }
    const size_t mesh = vshi_lit_append(work, "meshes", json_pack("{s:o}", "primitives", list));
    vshi_lit_push(work, nodes, json_integer((json_int_t)vshi_lit_append(work, "nodes", made)));
    vshi_lit_set_number(work, made, "mesh", mesh);
    errno = 0;
    json_t *label = name != NULL ? json_string(name) : NULL; /* names that are not UTF-8 are left out */
    if (label != NULL || errno == ENOMEM) {
        vshi_lit_set(work, made, "name", label);
    }
    if (!sheared && memcmp(of->transform, vshi_identity, sizeof vshi_identity) != 0) {
        double columns[16] = {[15] = 1.0};
        for (int i = 0; i < 16; ++i) {
            columns[i] = i % 4 < 3 ? of->transform[4 * (i % 4) + i / 4] : columns[i];
        }
        vshi_lit_set(work, made, "matrix", vshi_lit_list_numbers(work, columns, 16));
    }
    return result;
}

static vsh_result add_all(maker *m, json_t *nodes, vsh_error *error) {
    vshi_gltf *gltf = &m->work->gltf;
    for (size_t first = 0, end; first < m->count; first = end) {
        const vsh_mesh *of = &m->meshes[first];
        for (end = first + 1; end < m->count && of->object != 0 && m->meshes[end].object == of->object &&
                              memcmp(m->meshes[end].transform, of->transform, sizeof vshi_identity) == 0;) {
            ++end;
        }
        VSHI_TRY(vshi_job_step(gltf->job, end - first, error));
        VSHI_TRY(add_node(m, first, end, nodes, error));
    }
    return VSH_OK;
}

vsh_result vshi_lit_from_model(vshi_lit_work *work, vsh_error *error) {
    maker m = {.work = work, .count = vsh_model_mesh_count(work->model)};
    json_t *nodes = json_array();
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(&work->gltf, (void **)&m.meshes, m.count, sizeof *m.meshes, error));
    VSHI_TRY_DONE(vshi_gltf_allocate(&work->gltf, (void **)&m.list, m.count, sizeof *m.list, error));
    for (size_t i = 0; i < m.count; ++i) {
        m.meshes[i] = vsh_model_mesh(work->model, i, 0);
    }
    vshi_lit_set_number(work, work->gltf.root, "scene", 0);
    vshi_lit_append(work, "scenes", json_pack("{s:O}", "nodes", nodes));
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
