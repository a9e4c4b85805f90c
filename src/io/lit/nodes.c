/* Nodes and their meshes. A node whose UVs differ from those of others gets its own mesh, and an instance of
 * EXT_mesh_gpu_instancing its own node. */
#include "io/lit/work.h"

#include <math.h>
#include <stdlib.h>

static const char instancing_name[] = "EXT_mesh_gpu_instancing";

/* A mesh as one node (or one instance) shows it: entries of the model, which are its primitives. */
typedef struct use {
    size_t node, mesh;
    size_t instance;     /* SIZE_MAX: the node has none */
    size_t first, count; /* entries */
    bool lit;            /* some primitives are lit */
    bool keeps;          /* no primitive gets new UVs or colours */
    size_t made;         /* the mesh that it shows in the end */
} use;

typedef struct uses {
    use *list; /* one block with the arrays below */
    size_t count;
    size_t *unlit;    /* [mesh_count]: how many nodes show each mesh as it is */
    json_t **changed; /* [mesh_count]: the changed mesh; NULL: it stays */
    size_t mesh_count;
} uses;

/* --- uses of meshes */

static vsh_result fail_entry(const vshi_lit_work *work, size_t entry, vsh_error *error) {
    return vshi_gltf_fail(&work->gltf, error,
                          "no node has mesh %zu of the model: the file has changed since it was read", entry);
}

static vsh_result check_entry(const vshi_lit_work *work, size_t entry, const use *u, vsh_error *error) {
    const vshi_gltf *gltf = &work->gltf;
    const vshi_model_origin *origin = &work->model->entries[entry].origin;
    const json_t *node = vshi_gltf_element(gltf, "nodes", u->node);
    const json_t *primitives = json_object_get(vshi_gltf_element(gltf, "meshes", u->mesh), "primitives");
    size_t mesh;
    const bool good = origin->node > 0 && origin->mesh > 0 && origin->primitive > 0 &&
                      vshi_gltf_count(node, "mesh", SIZE_MAX, &mesh) && mesh == u->mesh &&
                      origin->primitive <= json_array_size(primitives) &&
                      (u->instance == SIZE_MAX || vshi_gltf_extension(node, instancing_name) != NULL);
    return good ? VSH_OK : fail_entry(work, entry, error);
}

/* Whether entry e is the next primitive of a use. */
static bool continues(const vshi_lit_work *work, const use *u, size_t e) {
    const vshi_model_origin *before = &work->model->entries[e - 1].origin;
    const vshi_model_origin *origin = &work->model->entries[e].origin;
    return u->count > 0 && origin->node == before->node && origin->instance == before->instance &&
           origin->mesh == before->mesh && origin->primitive > before->primitive;
}

/* Whether a use is the first of its node, or its next instance. */
static bool is_next(const uses *all, const use *u, bool *seen) {
    const use *before = all->count > 0 ? &all->list[all->count - 1] : NULL;
    if (before != NULL && before->node == u->node) {
        return before->instance != SIZE_MAX && u->instance != SIZE_MAX && u->instance > before->instance;
    }
    const bool first = !seen[u->node];
    seen[u->node] = true;
    return first;
}

static vsh_result list_uses(vshi_lit_work *work, bool *seen, uses *all, vsh_error *error) {
    const size_t count = vsh_model_mesh_count(work->model);
    const size_t nodes = json_array_size(json_object_get(work->gltf.root, "nodes"));
    for (size_t e = 0; e < count; ++e) {
        const vshi_model_origin *origin = &work->model->entries[e].origin;
        use *last = all->count > 0 ? &all->list[all->count - 1] : NULL;
        if (last == NULL || !continues(work, last, e)) {
            const use next = {.node = (size_t)origin->node - 1,
                              .mesh = (size_t)origin->mesh - 1,
                              .instance = origin->instance > 0 ? (size_t)origin->instance - 1 : SIZE_MAX,
                              .first = e,
                              .keeps = true};
            if (origin->node == 0 || next.node >= nodes || !is_next(all, &next, seen)) {
                return fail_entry(work, e, error);
            }
            last = &all->list[all->count++];
            *last = next;
        }
        VSHI_TRY(check_entry(work, e, last, error));
        ++last->count;
        const vsh_lit_mesh *mesh = &work->meshes[e];
        last->lit = last->lit || mesh->uvs != NULL || mesh->uv_set >= 0 || mesh->colors != NULL;
        last->keeps = last->keeps && mesh->uvs == NULL && mesh->colors == NULL;
    }
    return VSH_OK;
}

/* Counts how often a node shows its mesh: once, or once for each instance. All accessors of instances have
 * one length, as the model's reader has checked. */
static vsh_result count_instances(vshi_lit_work *work, const use *u, size_t *count, vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    const json_t *attributes = json_object_get(
        vshi_gltf_extension(vshi_gltf_element(gltf, "nodes", u->node), instancing_name), "attributes");
    *count = u->instance == SIZE_MAX ? 1 : 0;
    for (int k = 0; k < VSHI_GLTF_PARTS && *count == 0; ++k) {
        vshi_gltf_accessor accessor;
        VSHI_TRY(vshi_gltf_accessor_find(gltf, attributes, vshi_gltf_parts[k].attribute, instancing_name,
                                         &accessor, error));
        *count = accessor.count;
    }
    return VSH_OK;
}

/* Counts how often each mesh is shown as it is, by nodes that stay unlit or that the model does not have. */
static vsh_result count_unlit(vshi_lit_work *work, uses *all, vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    size_t n;
    const json_t *node;
    json_array_foreach(json_object_get(gltf->root, "nodes"), n, node) {
        size_t mesh;
        VSHI_TRY(vshi_gltf_index(gltf, node, "mesh", "meshes", "a node", &mesh, error));
        if (mesh != SIZE_MAX) {
            ++all->unlit[mesh];
        }
    }
    for (size_t i = 0; i < all->count;) {
        const size_t first = i, of = all->list[i].node;
        size_t lit = 0, wanted;
        for (; i < all->count && all->list[i].node == of; ++i) {
            lit += all->list[i].lit;
        }
        VSHI_TRY(count_instances(work, &all->list[first], &wanted, error));
        all->unlit[all->list[first].mesh] -= lit == wanted;
    }
    return VSH_OK;
}

/* --- meshes */

/* An earlier use without new UVs that shows the same primitives on the same pages by the same sets, or NULL.
 */
static const use *find_alike(const vshi_lit_work *work, const uses *all, const use *u) {
    for (const use *other = all->list; other < u && u->keeps; ++other) {
        bool alike = other->lit && other->keeps && other->mesh == u->mesh && other->count == u->count;
        for (size_t i = 0; alike && i < u->count; ++i) {
            const vsh_lit_mesh *a = &work->meshes[other->first + i], *b = &work->meshes[u->first + i];
            alike = a->uv_set == b->uv_set && (a->uv_set < 0 || a->page == b->page) &&
                    work->model->entries[other->first + i].origin.primitive ==
                        work->model->entries[u->first + i].origin.primitive;
        }
        if (alike) {
            return other;
        }
    }
    return NULL;
}

static vsh_result make_primitives(vshi_lit_work *work, const use *u, json_t *list, vsh_error *error) {
    const json_t *primitives =
        json_object_get(vshi_gltf_element(&work->gltf, "meshes", u->mesh), "primitives");
    size_t next = u->first;
    for (size_t p = 0; p < json_array_size(primitives); ++p) {
        if (next < u->first + u->count && work->model->entries[next].origin.primitive == p + 1) {
            VSHI_TRY(vshi_lit_make_primitive(work, u->mesh, p, next, list, error));
            ++next;
        } else {
            vshi_lit_push(work, list, vshi_lit_copy_json(work, json_array_get(primitives, p)));
        }
    }
    return VSH_OK;
}

static vsh_result make_mesh(vshi_lit_work *work, uses *all, use *u, vsh_error *error) {
    const use *alike = find_alike(work, all, u);
    if (alike != NULL) {
        u->made = alike->made;
        return VSH_OK;
    }
    json_t *mesh = vshi_lit_copy_json(work, vshi_gltf_element(&work->gltf, "meshes", u->mesh));
    json_t *list = json_array();
    const vsh_result result = make_primitives(work, u, list, error);
    vshi_lit_set(work, mesh, "primitives", list);
    if (result != VSH_OK) {
        json_decref(mesh);
        return result;
    }
    if (all->unlit[u->mesh] == 0 && all->changed[u->mesh] == NULL) {
        all->changed[u->mesh] = mesh; /* replaced later, because others are still made from the old one */
        u->made = u->mesh;
    } else {
        u->made = vshi_lit_append(work, "meshes", mesh);
    }
    return VSH_OK;
}

/* --- instances */

/* A part of an instance's transform. */
static json_t *list_part(vshi_lit_work *work, const float *values, int part) {
    enum { ROTATION = 1 };
    static const double unit_slack = 1e-5;
    double scale = 1.0, scaled[4];
    if (part == ROTATION) { /* viewers want unit length, which integers only approach */
        double square = 0.0;
        for (int c = 0; c < 4; ++c) {
            square += (double)values[c] * (double)values[c];
        }
        if (!(square > 0.0)) {
            return json_pack("[i,i,i,i]", 0, 0, 0, 1);
        }
        scale = fabs(square - 1.0) < unit_slack ? 1.0 : 1.0 / sqrt(square);
    }
    for (int c = 0; c < vshi_gltf_parts[part].components; ++c) {
        scaled[c] = (double)values[c] * scale;
    }
    return vshi_lit_list_numbers(work, scaled, (size_t)vshi_gltf_parts[part].components);
}

static void add_instance(vshi_lit_work *work, const json_t *node, size_t node_index, size_t instance,
                         size_t mesh, float *const values[VSHI_GLTF_PARTS], json_t *children) {
    const char *given = json_string_value(json_object_get(node, "name"));
    json_t *name = given != NULL && given[0] != '\0' ? json_sprintf("%s[%zu]", given, instance)
                                                     : json_sprintf("nodes[%zu][%zu]", node_index, instance);
    json_t *made = json_pack("{s:o,s:I}", "name", name, "mesh", (json_int_t)mesh);
    vshi_lit_push(work, children, json_integer((json_int_t)vshi_lit_append(work, "nodes", made)));
    for (int k = 0; k < VSHI_GLTF_PARTS; ++k) {
        if (values[k] != NULL) {
            const float *own = values[k] + (size_t)vshi_gltf_parts[k].components * instance;
            vshi_lit_set(work, made, vshi_gltf_parts[k].key, list_part(work, own, k));
        }
    }
    const json_t *weights = json_object_get(node, "weights");
    if (weights != NULL) {
        vshi_lit_set(work, made, "weights", vshi_lit_copy_json(work, weights));
    }
}

/* Makes the instances of a node its children. The model has the uses `first` … `end` - 1. */
static vsh_result expand(vshi_lit_work *work, const uses *all, size_t first, size_t end, vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    const use *of = &all->list[first];
    json_t *node = json_array_get(json_object_get(gltf->root, "nodes"), of->node);
    json_t *children = json_object_get(node, "children");
    float *values[VSHI_GLTF_PARTS] = {NULL};
    size_t count;
    if (children == NULL) {
        children = json_array();
        vshi_lit_set(work, node, "children", children);
        children = json_object_get(node, "children");
    }
    vsh_result result = vshi_gltf_read_instances(gltf, vshi_gltf_extension(node, instancing_name),
                                                 instancing_name, values, &count, error);
    for (size_t i = 0, next = first; result == VSH_OK && i < count; ++i) {
        const bool has = next < end && all->list[next].instance == i;
        const size_t mesh = has && all->list[next].lit ? all->list[next].made : of->mesh;
        next += has;
        add_instance(work, node, of->node, i, mesh, values, children);
        result = vshi_job_check(gltf->job, error);
    }
    for (int k = 0; k < VSHI_GLTF_PARTS; ++k) {
        free(values[k]);
    }
    vshi_lit_remove_extension(node, instancing_name);
    json_object_del(node, "mesh");
    json_object_del(node, "weights");
    return result;
}

/* Gives a node, which has the uses `first` … `end` - 1, its mesh. */
static vsh_result set_mesh(vshi_lit_work *work, const uses *all, size_t first, size_t end, vsh_error *error) {
    const use *of = &all->list[first];
    bool any = false, same = true;
    size_t wanted;
    for (size_t i = first; i < end; ++i) {
        any = any || all->list[i].lit;
        same = same && all->list[i].lit && all->list[i].made == of->made;
    }
    if (!any) {
        return VSH_OK;
    }
    VSHI_TRY(count_instances(work, of, &wanted, error));
    if (!same || end - first != wanted) {
        return expand(work, all, first, end, error);
    }
    json_t *node = json_array_get(json_object_get(work->gltf.root, "nodes"), of->node);
    vshi_lit_set_number(work, node, "mesh", of->made);
    return VSH_OK;
}

static vsh_result make_all(vshi_lit_work *work, uses *all, vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    for (size_t i = 0; i < all->count; ++i) {
        VSHI_TRY(vshi_job_step(gltf->job, all->list[i].count, error));
        if (all->list[i].lit) {
            VSHI_TRY(make_mesh(work, all, &all->list[i], error));
        }
    }
    for (size_t first = 0, end; first < all->count; first = end) {
        for (end = first + 1; end < all->count && all->list[end].node == all->list[first].node;) {
            ++end;
        }
        VSHI_TRY(set_mesh(work, all, first, end, error));
    }
    json_t *meshes = json_object_get(gltf->root, "meshes");
    for (size_t m = 0; m < all->mesh_count; ++m) {
        work->refused |= all->changed[m] != NULL && json_array_set(meshes, m, all->changed[m]) != 0;
    }
    return VSH_OK;
}

vsh_result vshi_lit_make_nodes(vshi_lit_work *work, vsh_error *error) {
    const size_t nodes = json_array_size(json_object_get(work->gltf.root, "nodes"));
    uses all = {.mesh_count = json_array_size(json_object_get(work->gltf.root, "meshes"))};
    bool *seen;
    const vshi_array arrays[] = {VSHI_ARRAY(all.list, vsh_model_mesh_count(work->model)),
                                 VSHI_ARRAY(all.unlit, all.mesh_count),
                                 VSHI_ARRAY(all.changed, all.mesh_count), VSHI_ARRAY(seen, nodes)};
    vsh_result result;
    VSHI_TRY(VSHI_LIT_ALLOCATE(work, arrays, error));
    VSHI_TRY_DONE(list_uses(work, seen, &all, error));
    VSHI_TRY_DONE(count_unlit(work, &all, error));
    VSHI_TRY_DONE(make_all(work, &all, error));
    vshi_lit_drop_extension(work, instancing_name);
    vshi_lit_drop_extension(work, "KHR_draco_mesh_compression");
done:
    for (size_t m = 0; m < all.mesh_count; ++m) {
        json_decref(all.changed[m]);
    }
    free(all.list);
    return result;
}
