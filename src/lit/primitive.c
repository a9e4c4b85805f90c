/* What becomes of a primitive: its new set of UVs, and where the atlas asks for it, vertices of its own. */
#include "lit/work.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- vertices: which elements of a primitive's accessors they are, copies of these, and new sets of UVs */

static vsh_result fail_other(const vshi_lit_document *document, const char *where, vsh_error *error) {
    return vshi_gltf_fail(&document->gltf, error,
                          "%s: is not what the model was made of: the file has changed since", where);
}

/* Vertices of the model are the elements that triangles use, in their order: the others are not kept. */
static vsh_result match(vshi_lit_document *document, const uint32_t *corners, size_t count, const char *where,
                        const vsh_mesh *mesh, vshi_lit_topology *topology, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    if (count != mesh->triangle_count || mesh->vertex_count > topology->element_count) {
        return fail_other(document, where, error);
    }
    bool *used = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&used, topology->element_count, sizeof *used, error));
    VSHI_TRY_DONE(vshi_gltf_take(gltf, (void **)&topology->elements, mesh->vertex_count,
                                 sizeof *topology->elements, error));
    for (size_t i = 0; i < 3 * count; ++i) {
        used[corners[i]] = true;
    }
    size_t vertices = 0;
    for (size_t e = 0; e < topology->element_count; ++e) {
        if (used[e] && vertices < mesh->vertex_count) {
            topology->elements[vertices] = (uint32_t)e;
        }
        vertices += used[e];
    }
    bool equal = vertices == mesh->vertex_count;
    for (size_t i = 0; equal && i < 3 * count; ++i) {
        equal = mesh->indices[i] < vertices && topology->elements[mesh->indices[i]] == corners[i];
    }
    topology->vertex_count = vertices;
    result = equal ? VSH_OK : fail_other(document, where, error);
done:
    free(used);
    return result;
}

static vsh_result find_plain(vshi_lit_document *document, const json_t *primitive, const char *where,
                             const vsh_mesh *mesh, vshi_lit_topology *topology, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    size_t index, count = 0;
    vshi_gltf_accessor positions;
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), "POSITION", "accessors", where,
                             &index, error));
    if (index == SIZE_MAX) {
        return fail_other(document, where, error);
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &positions, error));
    topology->element_count = positions.count;
    uint32_t *corners = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_read_triangles(gltf, primitive, topology->mode, positions.count, where, &corners,
                                           &count, error));
    VSHI_TRY_DONE(match(document, corners, count, where, mesh, topology, error));
done:
    free(corners);
    return result;
}

/* Finds that of `primitive`, which messages call `where`, and holds it against the model's mesh. `draco` is
 * its decoded data, NULL where it has none. Errors: VSH_ERROR_INPUT (not well formed; not what the model was
 * made of), VSH_ERROR_READ, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result find_topology(vshi_lit_document *document, const json_t *primitive, const char *where,
                                const vshi_lit_draco *draco, const vsh_mesh *mesh,
                                vshi_lit_topology *topology, vsh_error *error) {
    *topology = (vshi_lit_topology){.draco = draco};
    if (!vshi_gltf_count(primitive, "mode", VSHI_GLTF_TRIANGLES, &topology->mode) ||
        topology->mode < VSHI_GLTF_TRIANGLES || topology->mode > VSHI_GLTF_FAN) {
        return fail_other(document, where, error);
    }
    if (draco == NULL) {
        return find_plain(document, primitive, where, mesh, topology, error);
    }
    topology->mode =
        VSHI_GLTF_TRIANGLES; /* Draco's triangles are lists, even if the primitive has another mode */
    topology->element_count = draco->vertex_count;
    return match(document, draco->indices, draco->triangle_count, where, mesh, topology, error);
}

static vsh_result find_elements(vshi_lit_document *document, size_t index, size_t element_count,
                                const vshi_lit_draco_attribute *draco, const char *where,
                                vshi_gltf_accessor *found, unsigned char **dense, vsh_error *error) {
    VSHI_TRY(vshi_gltf_accessor_open(&document->gltf, index, found, error));
    const size_t size = (size_t)found->components * vshi_gltf_component_size(found->type);
    if (draco != NULL) {
        found->at = draco->values;
        found->stride = size;
        return draco->type == found->type && draco->components == found->components
                   ? VSH_OK
                   : vshi_gltf_fail(&document->gltf, error, "%s: accessors[%zu] is not what was decompressed",
                                    where, index);
    }
    if (found->count != element_count) {
        return vshi_gltf_fail(&document->gltf, error, "%s: accessors[%zu] has %zu elements for %zu vertices",
                              where, index, found->count, element_count);
    }
    if (found->sparse_count > 0) { /* which becomes dense */
        VSHI_TRY(vshi_gltf_take(&document->gltf, (void **)dense, found->count, size, error));
        vshi_gltf_accessor_bytes(found, *dense);
        found->at = *dense;
        found->stride = size;
    }
    return VSH_OK;
}

static vsh_result copy(vshi_lit_document *document, size_t index, const vshi_gltf_accessor *from,
                       const uint32_t *chosen, size_t count, bool bounds, size_t *accessor,
                       vsh_error *error) {
    const size_t size = (size_t)from->components * vshi_gltf_component_size(from->type);
    const size_t stride = (size + 3) & ~(size_t)3; /* of vertex attributes: a multiple of 4 */
    size_t bytes, view, offset;
    if (__builtin_mul_overflow(count, stride, &bytes)) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_add_view(document, NULL, bytes, VSHI_LIT_VERTICES, stride != size ? stride : 0, &view,
                               &offset, error));
    unsigned char *to = document->added.at + offset;
    for (size_t i = 0; i < count && from->at != NULL; ++i) {
        memcpy(to + i * stride, from->at + chosen[i] * from->stride, size);
    }
    json_t *made = vshi_lit_copy_json(document, vshi_gltf_element(&document->gltf, "accessors", index));
    *accessor = vshi_lit_append(document, "accessors", made);
    json_object_del(made, "byteOffset");
    json_object_del(made, "sparse");
    vshi_lit_set_number(document, made, "bufferView", view);
    vshi_lit_set_number(document, made, "count", count);
    const bool had = json_object_get(made, "min") != NULL || json_object_get(made, "max") != NULL;
    const vshi_gltf_accessor copied = {
        .count = count, .components = from->components, .type = from->type, .at = to, .stride = stride};
    if ((bounds || had) && count > 0) {
        vshi_lit_set_bounds(document, made, &copied);
    }
    return VSH_OK;
}

/* A new accessor of the elements chosen[count] of accessor `index`, in *gathered or from there. `draco`: its
 * values, else NULL. `element_count` is what it must have; `bounds`: with its least and largest values
 * whether or not it has had them. Sparse ones become dense. Errors: VSH_ERROR_INPUT, VSH_ERROR_READ,
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result gather_elements(vshi_lit_document *document, size_t index, size_t element_count,
                                  const vshi_lit_draco_attribute *draco, const uint32_t *chosen, size_t count,
                                  bool bounds, const char *where, vshi_lit_gathered *gathered,
                                  size_t *accessor, vsh_error *error) {
    for (size_t i = 0; i < gathered->count; ++i) {
        if (gathered->list[i].from == index) {
            *accessor = gathered->list[i].to;
            return VSH_OK;
        }
    }
    vshi_gltf_accessor from;
    unsigned char *dense = NULL;
    vsh_result result;
    VSHI_TRY_DONE(find_elements(document, index, element_count, draco, where, &from, &dense, error));
    VSHI_TRY_DONE(copy(document, index, &from, chosen, count, bounds, accessor, error));
    VSHI_TRY_DONE(vshi_model_grow(&gathered->list, gathered->count, &gathered->capacity,
                                  sizeof *gathered->list, document->gltf.path, error));
    gathered->list[gathered->count++] = (vshi_lit_copy){index, *accessor};
done:
    free(dense);
    return result;
}

static unsigned char *place(const vshi_lit_document *document, const vshi_lit_uvs *uvs, uint32_t element) {
    return document->added.at + uvs->offset + (size_t)element * sizeof(float[2]);
}

static bool fits(const vshi_lit_document *document, const vshi_lit_uvs *uvs, const uint32_t *elements,
                 const float (*values)[2], size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (uvs->set[elements[i]] &&
            memcmp(place(document, uvs, elements[i]), values[i], sizeof values[i]) != 0) {
            return false;
        }
    }
    return true;
}

static vsh_result add(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                      size_t element_count, vsh_error *error) {
    VSHI_TRY(vshi_model_grow(&pool->list, pool->count, &pool->capacity, sizeof *pool->list,
                             document->gltf.path, error));
    vshi_lit_uvs *made = &pool->list[pool->count];
    *made = (vshi_lit_uvs){.positions = positions, .count = element_count};
    VSHI_TRY(
        vshi_gltf_allocate(&document->gltf, (void **)&made->set, element_count, sizeof *made->set, error));
    ++pool->count;
    return vshi_lit_add_floats(document, NULL, element_count, 2, false, &made->accessor, &made->offset,
                               error);
}

/* An accessor in which elements[i] (< count of elements) has values[i], v down. Elements may come twice, with
 * the same values. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result put_uvs(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                          size_t element_count, const uint32_t *elements, const float (*values)[2],
                          size_t count, size_t *accessor, vsh_error *error) {
    size_t found = 0;
    while (found < pool->count &&
           (pool->list[found].positions != positions || pool->list[found].count != element_count ||
            !fits(document, &pool->list[found], elements, values, count))) {
        ++found;
    }
    if (found == pool->count) {
        VSHI_TRY(add(document, pool, positions, element_count, error));
    }
    const vshi_lit_uvs *uvs = &pool->list[found];
    for (size_t i = 0; i < count; ++i) {
        memcpy(place(document, uvs, elements[i]), values[i], sizeof values[i]);
        uvs->set[elements[i]] = true;
    }
    *accessor = uvs->accessor;
    return VSH_OK;
}

/* --- primitives on several pages */

/* The only page of a mesh, or VSH_LIT_NO_CHART. */
static uint32_t find_only_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    uint32_t only = VSH_LIT_NO_CHART;
    for (size_t t = 0; mesh->charts != NULL && t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_lit_page(work, mesh, t);
        if (page != VSH_LIT_NO_CHART && only != VSH_LIT_NO_CHART && page != only) {
            return VSH_LIT_NO_CHART;
        }
        only = page != VSH_LIT_NO_CHART ? page : only;
    }
    /* one that has no place anywhere is dark on all */
    return mesh->charts == NULL ? mesh->page : only == VSH_LIT_NO_CHART ? 0 : only;
}

static vsh_result add_copy(vshi_lit_work *work, const json_t *made, size_t indices, uint32_t page, size_t set,
                           json_t *list, vsh_error *error) {
    json_t *primitive = vshi_lit_copy_json(&work->document, made);
    vshi_lit_push(&work->document, list, primitive);
    vshi_lit_set_number(&work->document, primitive, "indices", indices);
    return vshi_lit_mark_primitive(work, primitive, page, set, NULL, error);
}

/* Triangles of a page, and (on the first) those that have none: corners of them into chosen[]. */
static size_t choose_corners(const vshi_lit_work *work, const vsh_lit_mesh *mesh, const uint32_t *corners,
                             uint32_t page, bool first, uint32_t *chosen) {
    size_t count = 0;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t own = vshi_lit_page(work, mesh, t);
        if (own == page || (first && own == VSH_LIT_NO_CHART)) {
            for (size_t k = 0; k < 3; ++k) {
                chosen[count++] = corners[3 * t + k];
            }
        }
    }
    return count;
}

static vsh_result split_pages(vshi_lit_work *work, const json_t *made, const vsh_lit_mesh *mesh,
                              const uint32_t *corners, size_t vertex_count, size_t set, bool *used,
                              uint32_t *chosen, json_t *list, vsh_error *error) {
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_lit_page(work, mesh, t);
        if (page != VSH_LIT_NO_CHART) {
            used[page] = true;
        }
    }
    bool first = true;
    for (size_t page = 0; page < work->page_count; ++page) {
        if (!used[page]) {
            continue;
        }
        const size_t count = choose_corners(work, mesh, corners, (uint32_t)page, first, chosen);
        size_t indices;
        first = false;
        VSHI_TRY(vshi_lit_add_indices(&work->document, chosen, count, vertex_count, &indices, error));
        VSHI_TRY(add_copy(work, made, indices, (uint32_t)page, set, list, error));
    }
    return VSH_OK;
}

vsh_result vshi_lit_pages_make(vshi_lit_work *work, const json_t *made, const vsh_lit_mesh *mesh,
                               const uint32_t *corners, size_t vertex_count, size_t set, size_t *whole,
                               json_t *list, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    const uint32_t only = find_only_page(work, mesh);
    if (only != VSH_LIT_NO_CHART) {
        if (*whole == SIZE_MAX) {
            VSHI_TRY(vshi_lit_add_indices(document, corners, 3 * mesh->triangle_count, vertex_count, whole,
                                          error));
        }
        return add_copy(work, made, *whole, only, set, list, error);
    }
    uint32_t *chosen = NULL;
    bool *used = NULL;
    vsh_result result;
    const double held = document->gltf.bytes_held;
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&used, work->page_count, sizeof *used, error));
    VSHI_TRY_DONE(
        vshi_gltf_take(&document->gltf, (void **)&chosen, mesh->triangle_count, 3 * sizeof *chosen, error));
    document->gltf.bytes_held = held;
    VSHI_TRY_DONE(split_pages(work, made, mesh, corners, vertex_count, set, used, chosen, list, error));
done:
    free(chosen);
    free(used);
    return result;
}

/* Chooses the set of a primitive that new UVs become. They replace the file's lightmap set, or a set of an
 * earlier bake, which the extras of a primitive list ("vdbshade_uv_sets": [1]). */

static const char sets_key[] = "vdbshade_uv_sets";

/* Of the images of a page, as bits 1 << VSH_LIT_…. */
static uint32_t purposes_of(const vshi_lit_work *work, uint32_t page) {
    uint32_t purposes = 0;
    for (size_t i = 0; i < work->options->image_count; ++i) {
        const vsh_lit_image *image = &work->options->images[i];
        purposes |= image->page == page ? 1U << image->purpose : 0;
    }
    return purposes;
}

/* The purposes that all pages of a mesh have. */
static uint32_t purposes_of_mesh(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    const uint32_t only = find_only_page(work, mesh);
    if (only != VSH_LIT_NO_CHART) {
        return purposes_of(work, only);
    }
    uint32_t purposes = UINT32_MAX, before = VSH_LIT_NO_CHART;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_lit_page(work, mesh, t);
        if (page != VSH_LIT_NO_CHART && page != before) {
            purposes &= purposes_of(work, page);
            before = page;
        }
    }
    return purposes;
}

/* --- textures that use a set */

static bool is_texture_of(const json_t *info, size_t set) {
    size_t own = 0, moved = 0;
    const json_t *transform = vshi_gltf_extension(info, "KHR_texture_transform");
    if (json_object_get(info, "index") == NULL && json_object_get(info, "texCoord") == NULL) {
        return false;
    }
    return !vshi_gltf_count(info, "texCoord", 0, &own) ||
           !vshi_gltf_count(transform, "texCoord", own, &moved) || moved == set;
}

/* Whether any texture at or below `value`, but `without`, is in the set. */
static bool has_texture(json_t *value, size_t set, const json_t *const without[VSH_LIT_PURPOSES]) {
    for (int i = 0; i < VSH_LIT_PURPOSES; ++i) {
        if (value == without[i]) {
            return false;
        }
    }
    size_t i;
    const char *name;
    json_t *member;
    if (json_is_array(value)) {
        json_array_foreach(value, i, member) {
            if (has_texture(member, set, without)) {
                return true;
            }
        }
    }
    if (is_texture_of(value, set)) {
        return true;
    }
    json_object_foreach(value, name, member) {
        if (has_texture(member, set, without)) {
            return true;
        }
    }
    return false;
}

/* Whether the material of a primitive, or of a variant of it, shows something in the set that stays. */
static bool is_shown(const vshi_lit_work *work, const json_t *owner, size_t set, uint32_t purposes) {
    const json_t *number = json_object_get(owner, "material");
    const json_t *materials = json_object_get(work->document.gltf.root, "materials");
    json_t *material = json_is_integer(number) && json_integer_value(number) >= 0
                           ? json_array_get(materials, (size_t)json_integer_value(number))
                           : NULL;
    const json_t *base = json_object_get(material, "pbrMetallicRoughness");
    const json_t *without[VSH_LIT_PURPOSES] = {
        [VSH_LIT_OCCLUSION] = json_object_get(material, "occlusionTexture"),
        [VSH_LIT_LIGHTMAP] = vshi_gltf_extension(material, "MOZ_lightmap"),
        [VSH_LIT_PREVIEW] =
            vshi_lit_is_cut_by_texture(material) ? NULL : json_object_get(base, "baseColorTexture"),
    };
    for (int i = 0; i < VSH_LIT_PURPOSES; ++i) {
        without[i] = (purposes >> i & 1) != 0 ? without[i] : NULL;
    }
    return material != NULL && has_texture(material, set, without);
}

static void name_of(size_t set, char *name, size_t size) {
    snprintf(name, size, "TEXCOORD_%zu", set);
}

/* Whether a set exists, no morph target moves it, and new textures replace all that use it. */
static bool is_replaceable(const vshi_lit_work *work, const json_t *primitive, size_t set,
                           uint32_t purposes) {
    char name[40];
    size_t i;
    json_t *each;
    name_of(set, name, sizeof name);
    if (json_object_get(json_object_get(primitive, "attributes"), name) == NULL) {
        return false;
    }
    json_array_foreach(json_object_get(primitive, "targets"), i, each) {
        if (json_object_get(each, name) != NULL) {
            return false;
        }
    }
    json_array_foreach(json_object_get(vshi_gltf_extension(primitive, "KHR_materials_variants"), "mappings"),
                       i, each) {
        if (is_shown(work, each, set, purposes)) {
            return false;
        }
    }
    return !is_shown(work, primitive, set, purposes);
}

/* --- sets of earlier bakes */

static const json_t *made_sets(const json_t *primitive) {
    return json_object_get(json_object_get(primitive, "extras"), sets_key);
}

/* Whether the file says that a set was made. */
static bool is_made(const json_t *primitive, size_t set) {
    size_t i;
    json_t *number;
    json_array_foreach(made_sets(primitive), i, number) {
        if (json_is_integer(number) && json_integer_value(number) == (json_int_t)set) {
            return true;
        }
    }
    return false;
}

/* Counts UV sets, up to the most that are used. */
static size_t count_sets(const json_t *attributes) {
    char name[40];
    size_t set = 0;
    do {
        name_of(set, name, sizeof name);
    } while (json_object_get(attributes, name) != NULL && ++set < VSH_MAX_UV_SETS);
    return set;
}

static void drop_set(json_t *primitive, size_t set) {
    char name[40];
    name_of(set, name, sizeof name);
    json_object_del(json_object_get(primitive, "attributes"), name);
}

vsh_result vshi_lit_tell_set(vshi_lit_document *document, json_t *primitive, size_t set, vsh_error *error) {
    json_t *extras = json_object_get(primitive, "extras");
    if (extras != NULL && !json_is_object(extras)) {
        return VSH_OK; /* somebody's own, of another kind */
    }
    VSHI_TRY(vshi_lit_object(document, primitive, "extras", &extras, error));
    json_t *list = json_array();
    const size_t count = count_sets(json_object_get(primitive, "attributes"));
    for (size_t i = 0; i <= count || i <= set; ++i) {
        if (i == set || (i < count && is_made(primitive, i))) {
            vshi_lit_push(document, list, json_integer((json_int_t)i));
        }
    }
    vshi_lit_set(document, extras, sets_key, list);
    return VSH_OK;
}

vsh_result vshi_lit_choose_set(const vshi_lit_work *work, json_t *primitive, const vsh_lit_mesh *mesh,
                               const char *where, size_t *set, vsh_error *error) {
    const uint32_t purposes = purposes_of_mesh(work, mesh);
    size_t count = count_sets(json_object_get(primitive, "attributes"));
    *set = 0;
    while (*set < count && !((*set == VSHI_LIT_SET || is_made(primitive, *set)) &&
                             is_replaceable(work, primitive, *set, purposes))) {
        ++*set;
    }
    /* sets are numbered without gaps: of others that were made the last can go */
    while (count > *set + 1 && count < VSH_MAX_UV_SETS && is_made(primitive, count - 1) &&
           is_replaceable(work, primitive, count - 1, purposes)) {
        drop_set(primitive, --count);
    }
    if (*set < count) {
        drop_set(primitive, *set);
    }
    if (*set < VSH_MAX_UV_SETS) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_LIMIT,
                     "%s: %s has %zu sets of UVs, and textures that stay use those that the lightmap could "
                     "take: no more than %d can be read",
                     work->document.gltf.path, where, *set, VSH_MAX_UV_SETS);
}

static const char draco_name[] = "KHR_draco_mesh_compression";

/* --- shapes */

static bool is_before(const vshi_lit_shape *shape, size_t mesh, size_t primitive) {
    return shape->mesh != mesh ? shape->mesh < mesh : shape->primitive < primitive;
}

static vsh_result find_shape(vshi_lit_work *work, size_t mesh, size_t primitive, size_t entry,
                             const json_t *given, const char *where, vshi_lit_shape **shape,
                             vsh_error *error) {
    size_t low = 0, high = work->shape_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (is_before(&work->shapes[middle], mesh, primitive)) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if (low == work->shape_count || work->shapes[low].mesh != mesh ||
        work->shapes[low].primitive != primitive) {
        VSHI_TRY(vshi_model_grow(&work->shapes, work->shape_count, &work->shape_capacity,
                                 sizeof *work->shapes, work->document.gltf.path, error));
        memmove(work->shapes + low + 1, work->shapes + low, (work->shape_count - low) * sizeof *work->shapes);
        ++work->shape_count;
        work->shapes[low] = (vshi_lit_shape){.mesh = mesh, .primitive = primitive};
        const vsh_mesh view = vsh_model_mesh(work->model, entry, 0);
        VSHI_TRY(find_topology(&work->document, given, where,
                               vshi_lit_draco_of(&work->dracos, mesh, primitive), &view,
                               &work->shapes[low].topology, error));
    }
    *shape = &work->shapes[low];
    return vsh_model_mesh(work->model, entry, 0).vertex_count == (*shape)->topology.vertex_count
               ? VSH_OK
               : vshi_gltf_fail(&work->document.gltf, error, "%s: two nodes show it with other vertices",
                                where);
}

/* --- vertices */

/* The vertices of one primitive in the atlas. */
typedef struct vertices {
    uint32_t *elements; /* [vertex_count] of the accessors */
    float (*uvs)[2];    /* [vertex_count], v down */
    uint32_t *corners;  /* [triangle_count][3]: elements; NULL: those of the atlas itself */
    bool split;         /* an element has two places, or is compressed */
} vertices;

static void free_vertices(vertices *v) {
    free(v->corners);
    free(v->uvs);
    free(v->elements);
}

/* Whether some vertex of the model has two places. */
static vsh_result find_split(vshi_lit_work *work, const vshi_lit_topology *topology, const vsh_lit_mesh *mesh,
                             vertices *v, vsh_error *error) {
    uint32_t *first = NULL; /* 1 + the first vertex of the atlas that is this one; 0: none yet */
    VSHI_TRY(vshi_gltf_allocate(&work->document.gltf, (void **)&first, topology->vertex_count, sizeof *first,
                                error));
    v->split = topology->draco != NULL;
    for (size_t i = 0; i < mesh->vertex_count && !v->split; ++i) {
        const uint32_t source = mesh->sources[i];
        if (first[source] == 0) {
            first[source] = (uint32_t)i + 1;
        } else {
            v->split = memcmp(v->uvs[first[source] - 1], v->uvs[i], sizeof v->uvs[i]) != 0;
        }
    }
    free(first);
    return VSH_OK;
}

static vsh_result find_vertices(vshi_lit_work *work, const vshi_lit_topology *topology,
                                const vsh_lit_mesh *mesh, vertices *v, vsh_error *error) {
    vshi_gltf *gltf = &work->document.gltf;
    const double held = gltf->bytes_held;
    VSHI_TRY(vshi_gltf_take(gltf, (void **)&v->elements, mesh->vertex_count, sizeof *v->elements, error));
    VSHI_TRY(vshi_gltf_take(gltf, (void **)&v->uvs, mesh->vertex_count, sizeof *v->uvs, error));
    for (size_t i = 0; i < mesh->vertex_count; ++i) {
        v->elements[i] = topology->elements[mesh->sources[i]];
        v->uvs[i][0] = mesh->uvs[2 * i];
        v->uvs[i][1] = 1.0F - mesh->uvs[2 * i + 1]; /* v points down in glTF */
    }
    VSHI_TRY(find_split(work, topology, mesh, v, error));
    if (!v->split && find_only_page(work, mesh) == VSH_LIT_NO_CHART) {
        VSHI_TRY(
            vshi_gltf_take(gltf, (void **)&v->corners, mesh->triangle_count, 3 * sizeof *v->corners, error));
        for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
            v->corners[i] = v->elements[mesh->indices[i]];
        }
    }
    gltf->bytes_held = held; /* they are freed with this primitive */
    return VSH_OK;
}

/* --- attributes */

static bool same(const vsh_lit_mesh *a, const vsh_lit_mesh *b) {
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           memcmp(a->sources, b->sources, a->vertex_count * sizeof *a->sources) == 0 &&
           memcmp(a->indices, b->indices, a->triangle_count * 3 * sizeof *a->indices) == 0;
}

/* That of an instance that is split alike, or a new one. */
static vsh_result take_split(vshi_lit_work *work, vshi_lit_shape *shape, const vsh_lit_mesh *mesh,
                             vshi_lit_split **split, vsh_error *error) {
    for (size_t i = 0; i < shape->split_count; ++i) {
        *split = &shape->splits[i];
        if (same((*split)->mesh, mesh)) {
            return VSH_OK;
        }
    }
    VSHI_TRY(vshi_model_grow(&shape->splits, shape->split_count, &shape->split_capacity,
                             sizeof *shape->splits, work->document.gltf.path, error));
    *split = &shape->splits[shape->split_count++];
    **split = (vshi_lit_split){.mesh = mesh, .indices = SIZE_MAX};
    return VSH_OK;
}

/* Replaces the accessors that `attributes` (of the primitive, or of a morph target) names. */
static vsh_result gather(vshi_lit_work *work, const vshi_lit_topology *topology, const json_t *primitive,
                         json_t *attributes, bool target, const vsh_lit_mesh *mesh, const vertices *v,
                         const char *where, vshi_lit_split *split, vsh_error *error) {
    const char *name;
    json_t *value;
    json_object_foreach(attributes, name, value) {
        size_t index, accessor = SIZE_MAX;
        VSHI_TRY(vshi_gltf_index(&work->document.gltf, attributes, name, "accessors", where, &index, error));
        const vshi_lit_draco_attribute *draco =
            topology->draco != NULL && !target ? vshi_lit_draco_attribute_of(topology->draco, primitive, name)
                                               : NULL;
        VSHI_TRY(gather_elements(&work->document, index, topology->element_count, draco, v->elements,
                                 mesh->vertex_count, strcmp(name, "POSITION") == 0, where, &split->gathered,
                                 &accessor, error));
        vshi_lit_set_number(&work->document, attributes, name, accessor);
    }
    return VSH_OK;
}

static void drop_draco(json_t *primitive) {
    json_t *extensions = json_object_get(primitive, "extensions");
    json_object_del(extensions, draco_name);
    if (extensions != NULL && json_object_size(extensions) == 0) {
        json_object_del(primitive, "extensions");
    }
}

/* `made` with vertices of its own. */
static vsh_result make_split(vshi_lit_work *work, vshi_lit_shape *shape, const json_t *given,
                             const vsh_lit_mesh *mesh, const vertices *v, const char *where, json_t *made,
                             size_t *uvs, vshi_lit_split **split, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    VSHI_TRY(take_split(work, shape, mesh, split, error));
    VSHI_TRY(gather(work, &shape->topology, given, json_object_get(made, "attributes"), false, mesh, v, where,
                    *split, error));
    size_t i;
    json_t *target;
    json_array_foreach(json_object_get(made, "targets"), i, target) {
        VSHI_TRY(gather(work, &shape->topology, given, target, true, mesh, v, where, *split, error));
    }
    drop_draco(made);
    return vshi_lit_add_floats(document, v->uvs[0], mesh->vertex_count, 2, false, uvs, NULL, error);
}

static vsh_result set_uvs(vshi_lit_work *work, json_t *primitive, size_t accessor, size_t set,
                          vsh_error *error) {
    char name[40];
    snprintf(name, sizeof name, "TEXCOORD_%zu", set);
    vshi_lit_set_number(&work->document, json_object_get(primitive, "attributes"), name, accessor);
    return vshi_lit_tell_set(&work->document, primitive, set, error);
}

static vsh_result make(vshi_lit_work *work, vshi_lit_shape *shape, const json_t *given,
                       const vsh_lit_mesh *mesh, const vertices *v, const char *where, json_t *made,
                       json_t *list, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    vshi_lit_split *split = NULL;
    size_t uvs, set, positions, whole = SIZE_MAX;
    VSHI_TRY(vshi_lit_choose_set(work, made, mesh, where, &set, error));
    if (set > VSHI_LIT_SET) {
        vshi_warn(document->gltf.run,
                  "%s: %s: textures that stay use TEXCOORD_%d, so the lightmap's UVs are TEXCOORD_%zu, which "
                  "Godot, Unity and Hubs do not read",
                  document->gltf.path, where, VSHI_LIT_SET, set);
    }
    if (v->split) {
        VSHI_TRY(make_split(work, shape, given, mesh, v, where, made, &uvs, &split, error));
    } else {
        VSHI_TRY(vshi_gltf_index(&document->gltf, json_object_get(given, "attributes"), "POSITION",
                                 "accessors", where, &positions, error));
        VSHI_TRY(put_uvs(document, &work->pool, positions, shape->topology.element_count, v->elements,
                         (const float(*)[2])v->uvs, mesh->vertex_count, &uvs, error));
    }
    VSHI_TRY(set_uvs(work, made, uvs, set, error));
    const uint32_t only = find_only_page(work, mesh);
    if (!v->split && only != VSH_LIT_NO_CHART) { /* its indices stay, strips too */
        vshi_lit_push(document, list, json_incref(made));
        return vshi_lit_mark_primitive(work, made, only, set, NULL, error);
    }
    if (shape->topology.mode != VSHI_GLTF_TRIANGLES || shape->topology.draco != NULL) {
        json_object_del(made, "mode");
    }
    return v->split ? vshi_lit_pages_make(work, made, mesh, mesh->indices, mesh->vertex_count, set,
                                          &split->indices, list, error)
                    : vshi_lit_pages_make(work, made, mesh, v->corners, shape->topology.element_count, set,
                                          &whole, list, error);
}

/* A copy of the transform from the file's set to the model's UVs; NULL: there is none. */
static json_t *copy_transform(vshi_lit_work *work, size_t entry, const json_t *primitive, size_t set) {
    const vshi_model_shape *shape = &work->model->shapes[work->model->entries[entry].shape];
    size_t material;
    if ((shape->packed >> set & 1) == 0 || !vshi_gltf_count(primitive, "material", SIZE_MAX, &material)) {
        return NULL;
    }
    const vshi_gltf_unpacking u = vshi_gltf_find_unpacking(&work->document.gltf, material, set);
    json_t *transform = u.uvs == VSHI_GLTF_UVS_PACKED ? vshi_lit_copy_json(&work->document, u.told) : NULL;
    json_object_del(transform, "texCoord"); /* the material names the set */
    return transform;
}

/* The set is the file's own. */
static vsh_result make_kept(vshi_lit_work *work, size_t entry, const char *where, json_t *made, json_t *list,
                            vsh_error *error) {
    const vsh_lit_mesh *mesh = &work->meshes[entry];
    char name[40];
    snprintf(name, sizeof name, "TEXCOORD_%d", mesh->uv_set);
    if (mesh->uv_set >= 0 && json_object_get(json_object_get(made, "attributes"), name) == NULL) {
        return vshi_gltf_fail(&work->document.gltf, error, "%s: has no %s to be lit by", where, name);
    }
    if (mesh->uv_set >= 0) {
        const size_t set = (size_t)mesh->uv_set;
        json_t *transform = copy_transform(work, entry, made, set);
        const vsh_result result = vshi_lit_mark_primitive(work, made, mesh->page, set, transform, error);
        json_decref(transform);
        VSHI_TRY(result);
    }
    vshi_lit_push(&work->document, list, json_incref(made));
    return VSH_OK;
}

vsh_result vshi_lit_primitive_make(vshi_lit_work *work, size_t mesh, size_t primitive, size_t entry,
                                   json_t *list, vsh_error *error) {
    char where[96];
    snprintf(where, sizeof where, "meshes[%zu].primitives[%zu]", mesh, primitive);
    const json_t *given = json_array_get(
        json_object_get(vshi_gltf_element(&work->document.gltf, "meshes", mesh), "primitives"), primitive);
    const vsh_lit_mesh *lit = &work->meshes[entry];
    vertices v = {.elements = NULL};
    vshi_lit_shape *shape = NULL;
    json_t *made = vshi_lit_copy_json(&work->document, given);
    vsh_result result;
    VSHI_TRY_DONE(work->document.refused ? vshi_lit_no_memory(&work->document, error) : VSH_OK);
    if (lit->uvs == NULL) {
        result = make_kept(work, entry, where, made, list, error);
        goto done;
    }
    VSHI_TRY_DONE(find_shape(work, mesh, primitive, entry, given, where, &shape, error));
    VSHI_TRY_DONE(find_vertices(work, &shape->topology, lit, &v, error));
    VSHI_TRY_DONE(make(work, shape, given, lit, &v, where, made, list, error));
done:
    free_vertices(&v);
    json_decref(made);
    return result;
}

void vshi_lit_shapes_free(vshi_lit_work *work) {
    for (size_t i = 0; i < work->shape_count; ++i) {
        for (size_t k = 0; k < work->shapes[i].split_count; ++k) {
            free(work->shapes[i].splits[k].gathered.list);
        }
        free(work->shapes[i].splits);
        free(work->shapes[i].topology.elements);
    }
    free(work->shapes);
    for (size_t i = 0; i < work->pool.count; ++i) {
        free(work->pool.list[i].set);
    }
    free(work->pool.list);
}
