/* A primitive with light: its new set of UVs and, where the atlas splits it, vertices of its own. */
#include "io/lit/work.h"

#include <stdlib.h>
#include <string.h>

/* --- primitives on several pages */

/* The lowest page from `from` on that a mesh lies on, or VSH_NO_CHART, which is above all pages. */
static uint32_t find_next_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh, uint32_t from) {
    uint32_t next = mesh->charts == NULL && mesh->page >= from ? mesh->page : VSH_NO_CHART;
    for (size_t t = 0; mesh->charts != NULL && t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_page_of_triangle(work, mesh, t);
        next = page >= from && page < next ? page : next;
    }
    return next;
}

/* A mesh without a place is dark on any page. */
static uint32_t find_first_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    const uint32_t first = find_next_page(work, mesh, 0);
    return first == VSH_NO_CHART ? 0 : first;
}

/* The only page of a mesh, or VSH_NO_CHART. */
static uint32_t find_only_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    const uint32_t first = find_first_page(work, mesh);
    return find_next_page(work, mesh, first + 1) == VSH_NO_CHART ? first : VSH_NO_CHART;
}

static vsh_result add_copy(vshi_lit_work *work, const json_t *made, size_t indices, uint32_t page, size_t set,
                           json_t *list, vsh_error *error) {
    json_t *primitive = vshi_lit_copy_json(work, made);
    vshi_lit_push(work, list, primitive);
    vshi_lit_set_number(work, primitive, "indices", indices);
    return vshi_lit_mark_primitive(work, primitive, page, set, NULL, error);
}

vsh_result vshi_lit_make_pages(vshi_lit_work *work, const json_t *made, const vshi_lit_corners *corners,
                               size_t *whole, json_t *list, vsh_error *error) {
    const vsh_lit_mesh *mesh = corners->mesh;
    const uint32_t only = find_only_page(work, mesh), first = find_first_page(work, mesh);
    if (only != VSH_NO_CHART) {
        if (*whole == SIZE_MAX) {
            VSHI_TRY(vshi_lit_add_indices(work, corners->list, 3 * mesh->triangle_count,
                                          corners->vertex_count, whole, error));
        }
        return add_copy(work, made, *whole, only, corners->set, list, error);
    }
    uint32_t *chosen;
    vsh_result result = VSH_OK;
    const double held = work->gltf.bytes_held;
    VSHI_TRY(
        vshi_gltf_allocate(&work->gltf, (void **)&chosen, mesh->triangle_count, 3 * sizeof *chosen, error));
    work->gltf.bytes_held = held;
    for (uint32_t page = first; page != VSH_NO_CHART; page = find_next_page(work, mesh, page + 1)) {
        size_t count = 0, indices;
        for (size_t t = 0; t < mesh->triangle_count; ++t) {
            const uint32_t own = vshi_page_of_triangle(work, mesh, t);
            if (own == page || (page == first && own == VSH_NO_CHART)) {
                memcpy(chosen + count, corners->list + 3 * t, sizeof(uint32_t[3]));
                count += 3;
            }
        }
        VSHI_TRY_DONE(vshi_lit_add_indices(work, chosen, count, corners->vertex_count, &indices, error));
        VSHI_TRY_DONE(add_copy(work, made, indices, page, corners->set, list, error));
    }
done:
    free(chosen);
    return result;
}

/* --- the set that new UVs become. They replace the file's lightmap set, or a later one of a texture that a
 * bake replaces, unless a texture that stays uses it. */

/* The purposes that have an image on all pages of a mesh, as bits 1 << VSH_LIT_…. */
static uint32_t find_purposes(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    uint32_t all = UINT32_MAX, page = find_first_page(work, mesh);
    for (; page != VSH_NO_CHART; page = find_next_page(work, mesh, page + 1)) {
        uint32_t purposes = 0;
        for (size_t i = 0; i < work->options->image_count; ++i) {
            const vsh_lit_image *image = &work->options->images[i];
            purposes |= image->page == page ? 1U << image->purpose : 0;
        }
        all &= purposes;
    }
    return all;
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

/* Whether `value`, or something in it but `without`, is a texture in the set. */
static bool has_texture(json_t *value, size_t set, const json_t *const without[VSHI_LIT_PURPOSES]) {
    for (int i = 0; i < VSHI_LIT_PURPOSES; ++i) {
        if (value == without[i]) {
            return false;
        }
    }
    size_t i;
    const char *name;
    json_t *member;
    bool has = is_texture_of(value, set);
    json_array_foreach(value, i, member) {
        has = has || has_texture(member, set, without);
    }
    json_object_foreach(value, name, member) {
        has = has || has_texture(member, set, without);
    }
    return has;
}

/* Whether the material of a primitive, or of a variant of it, has a remaining texture in the set. */
static bool is_shown(const vshi_lit_work *work, const json_t *owner, size_t set, uint32_t purposes) {
    const json_t *number = json_object_get(owner, "material");
    const json_t *materials = json_object_get(work->gltf.root, "materials");
    json_t *material = json_is_integer(number) && json_integer_value(number) >= 0
                           ? json_array_get(materials, (size_t)json_integer_value(number))
                           : NULL;
    const json_t *base = json_object_get(material, "pbrMetallicRoughness");
    const json_t *without[VSHI_LIT_PURPOSES] = {
        [VSH_LIT_OCCLUSION] = json_object_get(material, "occlusionTexture"),
        [VSH_LIT_LIGHTMAP] = vshi_gltf_extension(material, "MOZ_lightmap"),
        [VSH_LIT_PREVIEW] =
            vshi_lit_is_cut_by_texture(material) ? NULL : json_object_get(base, "baseColorTexture"),
    };
    for (int i = 0; i < VSHI_LIT_PURPOSES; ++i) {
        without[i] = (purposes >> i & 1) != 0 ? without[i] : NULL;
    }
    return material != NULL && has_texture(material, set, without);
}

enum { SET_NAME = 40 };

static const char *name_set(size_t set, char name[SET_NAME]) {
    snprintf(name, SET_NAME, "TEXCOORD_%zu", set);
    return name;
}

/* Whether a set exists, no morph target moves it, and new textures replace all that use it. */
static bool is_replaceable(const vshi_lit_work *work, const json_t *primitive, size_t set,
                           uint32_t purposes) {
    char name[SET_NAME];
    size_t i;
    json_t *each;
    if (json_object_get(json_object_get(primitive, "attributes"), name_set(set, name)) == NULL) {
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

/* Counts UV sets, up to VSH_MAX_UV_SETS. */
static size_t count_sets(const json_t *attributes) {
    char name[SET_NAME];
    size_t set = 0;
    while (set < VSH_MAX_UV_SETS && json_object_get(attributes, name_set(set, name)) != NULL) {
        ++set;
    }
    return set;
}

/* Finds the set for new UVs of `mesh`, and removes it from the primitive: VSHI_LIT_SET, or a later one of
 * textures that are replaced, if no remaining texture uses it; else a new one. Errors: VSH_ERROR_LIMIT
 * (VSH_MAX_UV_SETS). */
static vsh_result choose_set(const vshi_lit_work *work, json_t *primitive, const vsh_lit_mesh *mesh,
                             const char *where, size_t *set, vsh_error *error) {
    const uint32_t purposes = find_purposes(work, mesh);
    json_t *attributes = json_object_get(primitive, "attributes");
    const size_t count = count_sets(attributes);
    char name[SET_NAME];
    *set = VSHI_LIT_SET;
    while (*set < count && !((*set == VSHI_LIT_SET || is_shown(work, primitive, *set, 0)) &&
                             is_replaceable(work, primitive, *set, purposes))) {
        ++*set;
    }
    *set = *set < count ? *set : count;
    json_object_del(attributes, name_set(*set, name));
    if (*set < VSH_MAX_UV_SETS) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_LIMIT,
                     "%s: %s has %zu sets of UVs, and textures that stay use those that the lightmap could "
                     "take: no more than %d can be read",
                     work->gltf.path, where, *set, VSH_MAX_UV_SETS);
}

/* --- elements: the vertices in a primitive's accessors */

typedef struct primitive {
    vshi_lit_work *work;
    size_t mesh, index; /* in the file */
    size_t entry;       /* of the model */
    char where[96];     /* its name in messages */
    const json_t *given;
    json_t *made; /* the changed copy */
    const vsh_lit_mesh *lit;
    size_t mode;                 /* VSHI_GLTF_TRIANGLES … */
    size_t element_count;        /* each attribute's accessor has so many */
    uint32_t *elements;          /* the element of each vertex of the model's mesh, ascending */
    const vshi_lit_draco *draco; /* NULL: not compressed */
    uint32_t *chosen;            /* [lit->vertex_count]: the element of each; one block with uvs */
    float (*uvs)[2];             /* [lit->vertex_count]: v down */
    uint32_t *corners;           /* [triangle_count][3]: elements; NULL: not needed */
    bool split;                  /* an element has two places in the atlas, or is compressed */
} primitive;

static vsh_result fail_other(const primitive *p, vsh_error *error) {
    return vshi_gltf_fail(&p->work->gltf, error,
                          "%s: is not what the model was made of: the file has changed since", p->where);
}

/* Finds the model's vertices: the elements that triangles use, in their order. Checks them against the model.
 */
static vsh_result match_vertices(primitive *p, const uint32_t *corners, size_t count, vsh_error *error) {
    vshi_gltf *gltf = &p->work->gltf;
    const vsh_mesh mesh = vsh_model_mesh(p->work->model, p->entry, 0);
    if (count != mesh.triangle_count || mesh.vertex_count > p->element_count) {
        return fail_other(p, error);
    }
    bool *used;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->elements, mesh.vertex_count, sizeof *p->elements, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&used, p->element_count, sizeof *used, error));
    for (size_t i = 0; i < 3 * count; ++i) {
        used[corners[i]] = true;
    }
    size_t vertices = 0;
    for (size_t e = 0; e < p->element_count; ++e) {
        if (used[e] && vertices < mesh.vertex_count) {
            p->elements[vertices] = (uint32_t)e;
        }
        vertices += used[e];
    }
    bool equal = vertices == mesh.vertex_count;
    for (size_t i = 0; equal && i < 3 * count; ++i) {
        equal = mesh.indices[i] < vertices && p->elements[mesh.indices[i]] == corners[i];
    }
    free(used);
    return equal ? VSH_OK : fail_other(p, error);
}

static vsh_result find_elements(primitive *p, vsh_error *error) {
    vshi_gltf *gltf = &p->work->gltf;
    if (!vshi_gltf_count(p->given, "mode", VSHI_GLTF_TRIANGLES, &p->mode) || p->mode < VSHI_GLTF_TRIANGLES ||
        p->mode > VSHI_GLTF_FAN) {
        return fail_other(p, error);
    }
    p->draco = vshi_lit_find_draco(p->work, p->mesh, p->index);
    if (p->draco != NULL) { /* Draco's triangles are lists in every mode */
        p->element_count = p->draco->vertex_count;
        return match_vertices(p, p->draco->indices, p->draco->triangle_count, error);
    }
    vshi_gltf_accessor positions;
    VSHI_TRY(vshi_gltf_accessor_find(gltf, json_object_get(p->given, "attributes"), "POSITION", p->where,
                                     &positions, error));
    if (positions.count == 0) {
        return fail_other(p, error);
    }
    p->element_count = positions.count;
    uint32_t *corners = NULL;
    size_t count = 0;
    vsh_result result =
        vshi_gltf_read_triangles(gltf, p->given, p->mode, positions.count, p->where, &corners, &count, error);
    result = result == VSH_OK ? match_vertices(p, corners, count, error) : result;
    free(corners);
    return result;
}

/* Finds whether some vertex of the model has two places in the atlas. */
static vsh_result find_split(primitive *p, vsh_error *error) {
    const vsh_lit_mesh *lit = p->lit;
    const size_t count = vsh_model_mesh(p->work->model, p->entry, 0).vertex_count;
    uint32_t *first; /* 1 + the first copy of each vertex; 0: none yet */
    VSHI_TRY(vshi_gltf_allocate(&p->work->gltf, (void **)&first, count, sizeof *first, error));
    p->split = p->draco != NULL;
    for (size_t i = 0; i < lit->vertex_count && !p->split; ++i) {
        const uint32_t source = lit->sources[i];
        if (first[source] == 0) {
            first[source] = (uint32_t)i + 1;
        } else {
            p->split = memcmp(p->uvs[first[source] - 1], p->uvs[i], sizeof p->uvs[i]) != 0;
        }
    }
    free(first);
    return VSH_OK;
}

static vsh_result find_vertices(primitive *p, vsh_error *error) {
    const vsh_lit_mesh *lit = p->lit;
    VSHI_TRY(find_elements(p, error));
    const vshi_array arrays[] = {VSHI_ARRAY(p->chosen, lit->vertex_count),
                                 VSHI_ARRAY(p->uvs, lit->vertex_count)};
    VSHI_TRY(VSHI_LIT_ALLOCATE(p->work, arrays, error));
    for (size_t i = 0; i < lit->vertex_count; ++i) {
        p->chosen[i] = p->elements[lit->sources[i]];
        p->uvs[i][0] = lit->uvs[2 * i];
        p->uvs[i][1] = 1.0F - lit->uvs[2 * i + 1]; /* v points down in glTF */
    }
    VSHI_TRY(find_split(p, error));
    if (!p->split && find_only_page(p->work, lit) == VSH_NO_CHART) {
        VSHI_TRY(vshi_gltf_allocate(&p->work->gltf, (void **)&p->corners, lit->triangle_count,
                                    3 * sizeof *p->corners, error));
        for (size_t i = 0; i < 3 * lit->triangle_count; ++i) {
            p->corners[i] = p->chosen[lit->indices[i]];
        }
    }
    return VSH_OK;
}

/* --- vertices of its own */

/* Opens the elements of accessor `index`, or `draco` if that is not NULL. Sparse elements become dense. */
static vsh_result open_elements(const primitive *p, size_t index, const vshi_lit_draco_attribute *draco,
                                vshi_gltf_accessor *found, unsigned char **dense, vsh_error *error) {
    vshi_gltf *gltf = &p->work->gltf;
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, found, error));
    const size_t size = (size_t)found->components * vshi_gltf_component_size(found->type);
    if (draco != NULL) {
        found->at = draco->values;
        found->stride = size;
        return draco->type == found->type && draco->components == found->components
                   ? VSH_OK
                   : vshi_gltf_fail(gltf, error, "%s: accessors[%zu] is not what was decompressed", p->where,
                                    index);
    }
    if (found->count != p->element_count) {
        return vshi_gltf_fail(gltf, error, "%s: accessors[%zu] has %zu elements for %zu vertices", p->where,
                              index, found->count, p->element_count);
    }
    if (found->sparse_count > 0) {
        VSHI_TRY(vshi_gltf_allocate(gltf, (void **)dense, found->count, size, error));
        vshi_gltf_accessor_bytes(found, *dense);
        found->at = *dense;
        found->stride = size;
    }
    return VSH_OK;
}

/* Makes a new accessor of the chosen elements. It has bounds if the old one had, or with `bounds`. */
static vsh_result copy_elements(const primitive *p, size_t index, const vshi_gltf_accessor *from, bool bounds,
                                size_t *accessor, vsh_error *error) {
    vshi_lit_work *work = p->work;
    const size_t size = (size_t)from->components * vshi_gltf_component_size(from->type);
    const size_t stride = (size + 3) & ~(size_t)3; /* glTF 2.0, 3.6.2.4 */
    const size_t count = p->lit->vertex_count;
    const size_t offset = work->added.count;
    size_t bytes, view;
    if (__builtin_mul_overflow(count, stride, &bytes)) {
        return vshi_fail_memory(error, work->gltf.path);
    }
    VSHI_TRY(
        vshi_lit_add_view(work, NULL, bytes, VSHI_LIT_VERTICES, stride != size ? stride : 0, &view, error));
    unsigned char *to = work->added.list + offset;
    for (size_t i = 0; i < count && from->at != NULL; ++i) {
        memcpy(to + i * stride, from->at + p->chosen[i] * from->stride, size);
    }
    json_t *made = vshi_lit_copy_json(work, vshi_gltf_element(&work->gltf, "accessors", index));
    *accessor = vshi_lit_append(work, "accessors", made);
    json_object_del(made, "byteOffset");
    json_object_del(made, "sparse");
    vshi_lit_set_number(work, made, "bufferView", view);
    vshi_lit_set_number(work, made, "count", count);
    const bool had = json_object_get(made, "min") != NULL || json_object_get(made, "max") != NULL;
    const vshi_gltf_accessor copied = {
        .count = count, .components = from->components, .type = from->type, .at = to, .stride = stride};
    if ((bounds || had) && count > 0) {
        vshi_lit_set_bounds(work, made, &copied);
    }
    return VSH_OK;
}

/* Finds the copy of an accessor for a split, or makes it. */
static vsh_result copy_accessor(const primitive *p, size_t split, size_t index,
                                const vshi_lit_draco_attribute *draco, bool bounds, size_t *accessor,
                                vsh_error *error) {
    vshi_lit_work *work = p->work;
    for (size_t i = 0; i < work->copies.count; ++i) {
        if (work->copies.list[i].split == split && work->copies.list[i].from == index) {
            *accessor = work->copies.list[i].to;
            return VSH_OK;
        }
    }
    vshi_gltf_accessor from;
    unsigned char *dense = NULL;
    vsh_result result;
    VSHI_TRY_DONE(open_elements(p, index, draco, &from, &dense, error));
    VSHI_TRY_DONE(copy_elements(p, index, &from, bounds, accessor, error));
    VSHI_TRY_DONE(vshi_make_room((void **)&work->copies.list, work->copies.count, &work->copies.room,
                                 sizeof *work->copies.list, work->gltf.path, error));
    work->copies.list[work->copies.count++] = (vshi_lit_copy){split, index, *accessor};
done:
    free(dense);
    return result;
}

/* Replaces the accessors in `attributes`, of the primitive or of a morph target. */
static vsh_result copy_accessors(const primitive *p, size_t split, json_t *attributes, bool target,
                                 vsh_error *error) {
    const char *name;
    json_t *value;
    json_object_foreach(attributes, name, value) {
        size_t index, accessor = SIZE_MAX;
        VSHI_TRY(vshi_gltf_index(&p->work->gltf, attributes, name, "accessors", p->where, &index, error));
        const vshi_lit_draco_attribute *draco =
            p->draco != NULL && !target ? vshi_lit_find_draco_attribute(p->draco, p->given, name) : NULL;
        VSHI_TRY(copy_accessor(p, split, index, draco, strcmp(name, "POSITION") == 0, &accessor, error));
        vshi_lit_set_number(p->work, attributes, name, accessor);
    }
    return VSH_OK;
}

bool vshi_lit_is_split_alike(const vsh_lit_mesh *a, const vsh_lit_mesh *b) {
    if (a->sources == NULL || b->sources == NULL) { /* colours keep the vertices */
        return a->sources == b->sources;
    }
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           memcmp(a->sources, b->sources, a->vertex_count * sizeof *a->sources) == 0 &&
           memcmp(a->indices, b->indices, a->triangle_count * 3 * sizeof *a->indices) == 0;
}

/* Finds the split of an instance that is split alike, or makes one. */
static vsh_result find_split_alike(const primitive *p, size_t *split, vsh_error *error) {
    vshi_lit_work *work = p->work;
    for (*split = 0; *split < work->splits.count; ++*split) {
        const vshi_lit_split *other = &work->splits.list[*split];
        if (other->mesh == p->mesh && other->primitive == p->index &&
            vshi_lit_is_split_alike(other->lit, p->lit)) {
            return VSH_OK;
        }
    }
    VSHI_TRY(vshi_make_room((void **)&work->splits.list, work->splits.count, &work->splits.room,
                            sizeof *work->splits.list, work->gltf.path, error));
    work->splits.list[work->splits.count++] =
        (vshi_lit_split){p->mesh, p->index, &work->meshes[p->entry], SIZE_MAX};
    return VSH_OK;
}

/* Adds an accessor of UVs, or of colours; zeros if `values` is NULL. */
static vsh_result add_values(const primitive *p, const void *values, size_t count, size_t *accessor,
                             vsh_error *error) {
    return p->lit->colors != NULL ? vshi_lit_add_colors(p->work, values, count, accessor, error)
                                  : vshi_lit_add_floats(p->work, values, count, 2, false, accessor, error);
}

static vsh_result make_split(primitive *p, size_t *uvs, size_t *split, vsh_error *error) {
    size_t i;
    json_t *target;
    VSHI_TRY(find_split_alike(p, split, error));
    VSHI_TRY(copy_accessors(p, *split, json_object_get(p->made, "attributes"), false, error));
    json_array_foreach(json_object_get(p->made, "targets"), i, target) {
        VSHI_TRY(copy_accessors(p, *split, target, true, error));
    }
    vshi_lit_remove_extension(p->made, "KHR_draco_mesh_compression");
    return add_values(p, p->uvs[0], p->lit->vertex_count, uvs, error);
}

/* --- new UVs for vertices that stay */

static unsigned char *find_uv(const primitive *p, const vshi_lit_uvs *uvs, size_t vertex) {
    return p->work->added.list + uvs->offset + (size_t)p->chosen[vertex] * sizeof(float[2]);
}

static bool can_share(const primitive *p, const vshi_lit_uvs *uvs, size_t positions) {
    bool good = uvs->positions == positions && uvs->count == p->element_count &&
                uvs->colors == (p->lit->colors != NULL);
    for (size_t i = 0; i < p->lit->vertex_count && good; ++i) {
        good = !uvs->set[p->chosen[i]] || memcmp(find_uv(p, uvs, i), p->uvs[i], sizeof p->uvs[i]) == 0;
    }
    return good;
}

/* Finds an accessor with room for the UVs of the elements, or makes it, and writes them. */
static vsh_result share_uvs(const primitive *p, size_t *accessor, vsh_error *error) {
    vshi_lit_work *work = p->work;
    size_t positions, found = 0;
    VSHI_TRY(vshi_gltf_index(&work->gltf, json_object_get(p->given, "attributes"), "POSITION", "accessors",
                             p->where, &positions, error));
    while (found < work->uvs.count && !can_share(p, &work->uvs.list[found], positions)) {
        ++found;
    }
    if (found == work->uvs.count) {
        VSHI_TRY(vshi_make_room((void **)&work->uvs.list, work->uvs.count, &work->uvs.room,
                                sizeof *work->uvs.list, work->gltf.path, error));
        vshi_lit_uvs *made = &work->uvs.list[found];
        *made = (vshi_lit_uvs){.positions = positions,
                               .count = p->element_count,
                               .offset = work->added.count,
                               .colors = p->lit->colors != NULL};
        VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&made->set, made->count, sizeof *made->set, error));
        ++work->uvs.count;
        VSHI_TRY(add_values(p, NULL, made->count, &made->accessor, error));
    }
    const vshi_lit_uvs *uvs = &work->uvs.list[found];
    for (size_t i = 0; i < p->lit->vertex_count; ++i) {
        memcpy(find_uv(p, uvs, i), p->uvs[i], sizeof p->uvs[i]);
        uvs->set[p->chosen[i]] = true;
    }
    *accessor = uvs->accessor;
    return VSH_OK;
}

/* --- vertex colours */

_Static_assert(sizeof(float[2]) == VSHI_LIT_COLOR_BYTES, "UVs and colours share arrays");

/* Multiplies the colours of the vertices by the file's own: those that an earlier bake kept, or COLOR_0
 * unless a bake made it. *own: their attribute, or NULL. Errors: as vsh_model_read(). */
static vsh_result multiply_colors(const primitive *p, const char **own, vsh_error *error) {
    vshi_gltf *gltf = &p->work->gltf;
    const json_t *attributes = json_object_get(p->given, "attributes");
    vshi_gltf_accessor found;
    unsigned char *dense = NULL;
    float *values = NULL;
    size_t index;
    vsh_result result;
    *own = json_object_get(attributes, "_COLOR_0") != NULL ? "_COLOR_0" : "COLOR_0";
    VSHI_TRY(vshi_gltf_index(gltf, attributes, *own, "accessors", p->where, &index, error));
    const char *maker =
        json_string_value(json_object_get(vshi_gltf_element(gltf, "accessors", index), "name"));
    if (index == SIZE_MAX || (maker != NULL && strcmp(maker, VSHI_LIT_COLORS) == 0)) {
        *own = NULL;
        return VSH_OK;
    }
    const vshi_lit_draco_attribute *draco =
        p->draco != NULL ? vshi_lit_find_draco_attribute(p->draco, p->given, *own) : NULL;
    VSHI_TRY_DONE(open_elements(p, index, draco, &found, &dense, error));
    found.count = p->element_count;
    const size_t width = (size_t)found.components;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&values, found.count * width, sizeof *values, error));
    vshi_gltf_accessor_floats(&found, values);
    for (size_t i = 0; i < 4 * p->lit->vertex_count; ++i) {
        uint16_t *color = (uint16_t *)p->uvs + i;
        const float factor = i % 4 < width ? values[width * p->elements[i / 4] + i % 4] : 1.0f;
        *color = (uint16_t)(*color * (factor > 0.0f ? factor < 1.0f ? factor : 1.0f : 0.0f) + 0.5f);
    }
done:
    free(values);
    free(dense);
    return result;
}

/* Makes a primitive with vertex colours. */
static vsh_result make_colored(primitive *p, json_t *list, vsh_error *error) {
    static const char name[] = "COLOR_0";
    vshi_lit_work *work = p->work;
    const vsh_mesh mesh = vsh_model_mesh(work->model, p->entry, 0);
    const vshi_array arrays[] = {VSHI_ARRAY(p->chosen, mesh.vertex_count),
                                 VSHI_ARRAY(p->uvs, mesh.vertex_count)};
    const char *own;
    json_t *attributes = json_object_get(p->made, "attributes");
    vsh_lit_mesh lit = *p->lit;
    size_t colors, split = 0;
    lit.vertex_count = mesh.vertex_count;
    lit.triangle_count = mesh.triangle_count;
    lit.page = (uint32_t)work->page_count;
    p->lit = &lit;
    VSHI_TRY(find_elements(p, error));
    VSHI_TRY(VSHI_LIT_ALLOCATE(work, arrays, error));
    memcpy(p->chosen, p->elements, mesh.vertex_count * sizeof *p->chosen);
    memcpy(p->uvs, lit.colors, mesh.vertex_count * sizeof *p->uvs);
    VSHI_TRY(multiply_colors(p, &own, error));
    VSHI_TRY(p->draco != NULL ? make_split(p, &colors, &split, error) : share_uvs(p, &colors, error));
    if (own != NULL && strcmp(own, name) == 0) { /* for the next bake */
        vshi_lit_set(work, attributes, "_COLOR_0", json_incref(json_object_get(attributes, name)));
    }
    vshi_lit_set_number(work, attributes, name, colors);
    if (p->draco != NULL) {
        json_object_del(p->made, "mode");
        const vshi_lit_corners corners = {&lit, mesh.indices, mesh.vertex_count, 0};
        return vshi_lit_make_pages(work, p->made, &corners, &work->splits.list[split].indices, list, error);
    }
    vshi_lit_push(work, list, json_incref(p->made));
    return vshi_lit_mark_primitive(work, p->made, lit.page, 0, NULL, error);
}

/* --- the result */

/* Makes a primitive with new UVs. */
static vsh_result make_new(primitive *p, json_t *list, vsh_error *error) {
    vshi_lit_work *work = p->work;
    char name[SET_NAME];
    size_t uvs, set, split = 0, whole = SIZE_MAX;
    VSHI_TRY(choose_set(work, p->made, p->lit, p->where, &set, error));
    if (set > VSHI_LIT_SET) {
        vshi_warn(work->gltf.run,
                  "%s: %s: textures that stay use TEXCOORD_%d, so the lightmap's UVs are TEXCOORD_%zu, which "
                  "Godot, Unity and Hubs do not read",
                  work->gltf.path, p->where, VSHI_LIT_SET, set);
    }
    VSHI_TRY(p->split ? make_split(p, &uvs, &split, error) : share_uvs(p, &uvs, error));
    vshi_lit_set_number(work, json_object_get(p->made, "attributes"), name_set(set, name), uvs);
    const uint32_t only = find_only_page(work, p->lit);
    if (!p->split && only != VSH_NO_CHART) { /* indices stay, also those of strips */
        vshi_lit_push(work, list, json_incref(p->made));
        return vshi_lit_mark_primitive(work, p->made, only, set, NULL, error);
    }
    if (p->mode != VSHI_GLTF_TRIANGLES || p->draco != NULL) {
        json_object_del(p->made, "mode");
    }
    const vshi_lit_corners corners = {p->lit, p->split ? p->lit->indices : p->corners,
                                      p->split ? p->lit->vertex_count : p->element_count, set};
    return vshi_lit_make_pages(work, p->made, &corners, p->split ? &work->splits.list[split].indices : &whole,
                               list, error);
}

/* Copies the transform from the file's set to the model's UVs; NULL: there is none. */
static json_t *copy_transform(const primitive *p, size_t set) {
    const vshi_model_shape *shape = &p->work->model->shapes[p->work->model->entries[p->entry].shape];
    size_t material;
    if ((shape->packed >> set & 1) == 0 || !vshi_gltf_count(p->made, "material", SIZE_MAX, &material)) {
        return NULL;
    }
    const vshi_gltf_unpacking u = vshi_gltf_find_unpacking(&p->work->gltf, material, set);
    json_t *transform = u.uvs == VSHI_GLTF_UVS_PACKED ? vshi_lit_copy_json(p->work, u.extension) : NULL;
    json_object_del(transform, "texCoord"); /* the material names the set */
    return transform;
}

/* Makes a primitive with the file's own set, or an unlit one. */
static vsh_result make_kept(primitive *p, json_t *list, vsh_error *error) {
    const int32_t set = p->lit->uv_set;
    vsh_result result = VSH_OK;
    char name[SET_NAME];
    if (set >= 0) {
        if (json_object_get(json_object_get(p->made, "attributes"), name_set((size_t)set, name)) == NULL) {
            return vshi_gltf_fail(&p->work->gltf, error, "%s: has no %s to be lit by", p->where, name);
        }
        json_t *transform = copy_transform(p, (size_t)set);
        result = vshi_lit_mark_primitive(p->work, p->made, p->lit->page, (size_t)set, transform, error);
        json_decref(transform);
    }
    vshi_lit_push(p->work, list, json_incref(p->made));
    return result;
}

vsh_result vshi_lit_make_primitive(vshi_lit_work *work, size_t mesh, size_t index, size_t entry, json_t *list,
                                   vsh_error *error) {
    const double held = work->gltf.bytes_held;
    primitive p = {.work = work, .mesh = mesh, .index = index, .entry = entry, .lit = &work->meshes[entry]};
    vsh_result result;
    snprintf(p.where, sizeof p.where, "meshes[%zu].primitives[%zu]", mesh, index);
    p.given =
        json_array_get(json_object_get(vshi_gltf_element(&work->gltf, "meshes", mesh), "primitives"), index);
    p.made = vshi_lit_copy_json(work, p.given);
    VSHI_TRY_DONE(work->refused ? vshi_fail_memory(error, work->gltf.path) : VSH_OK);
    if (p.lit->uvs == NULL) {
        result = p.lit->colors != NULL ? make_colored(&p, list, error) : make_kept(&p, list, error);
        goto done;
    }
    VSHI_TRY_DONE(find_vertices(&p, error));
    work->gltf.bytes_held = held; /* freed with this primitive */
    VSHI_TRY_DONE(make_new(&p, list, error));
done:
    free(p.corners);
    free(p.chosen);
    free(p.elements);
    json_decref(p.made);
    return result;
}
