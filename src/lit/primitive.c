/* What becomes of a primitive: its new set of UVs, and where the atlas asks for it, vertices of its own. */
#include "lit/work.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&chosen, mesh->triangle_count,
                                     3 * sizeof *chosen, error));
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

/* --- elements: what vertices are in a primitive's accessors */

/* A primitive on its way. */
typedef struct primitive {
    vshi_lit_work *work;
    size_t mesh, index; /* in the file */
    size_t entry;       /* of the model */
    char where[96];     /* its name in messages */
    const json_t *given;
    json_t *made;
    const vsh_lit_mesh *lit;
    size_t mode;                 /* VSHI_GLTF_TRIANGLES … */
    size_t element_count;        /* elements that each attribute's accessor has */
    uint32_t *elements;          /* of the vertices of the model's mesh, increasing */
    const vshi_lit_draco *draco; /* NULL: its vertices are not compressed */
    /* the vertices of the atlas, lit->vertex_count of them */
    uint32_t *chosen;  /* elements */
    float (*uvs)[2];   /* v down */
    uint32_t *corners; /* [triangle_count][3]: elements; NULL: those of the atlas itself */
    bool split;        /* an element has two places, or is compressed */
} primitive;

static vsh_result fail_other(const primitive *p, vsh_error *error) {
    return vshi_gltf_fail(&p->work->document.gltf, error,
                          "%s: is not what the model was made of: the file has changed since", p->where);
}

/* Vertices of the model are the elements that triangles use, in their order: the others are not kept. */
static vsh_result match(primitive *p, const uint32_t *corners, size_t count, vsh_error *error) {
    vshi_gltf *gltf = &p->work->document.gltf;
    const vsh_mesh mesh = vsh_model_mesh(p->work->model, p->entry, 0);
    if (count != mesh.triangle_count || mesh.vertex_count > p->element_count) {
        return fail_other(p, error);
    }
    bool *used = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&used, p->element_count, sizeof *used, error));
    VSHI_TRY_DONE(
        vshi_gltf_allocate(gltf, (void **)&p->elements, mesh.vertex_count, sizeof *p->elements, error));
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
    result = equal ? VSH_OK : fail_other(p, error);
done:
    free(used);
    return result;
}

/* Finds the elements, and holds them against the model's mesh. Errors: VSH_ERROR_INPUT (not well formed; not
 * what the model was made of), VSH_ERROR_READ, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
static vsh_result find_elements(primitive *p, vsh_error *error) {
    vshi_gltf *gltf = &p->work->document.gltf;
    if (!vshi_gltf_count(p->given, "mode", VSHI_GLTF_TRIANGLES, &p->mode) || p->mode < VSHI_GLTF_TRIANGLES ||
        p->mode > VSHI_GLTF_FAN) {
        return fail_other(p, error);
    }
    p->draco = vshi_lit_draco_of(&p->work->dracos, p->mesh, p->index);
    if (p->draco != NULL) { /* Draco's triangles are lists in every mode */
        p->element_count = p->draco->vertex_count;
        return match(p, p->draco->indices, p->draco->triangle_count, error);
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
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_read_triangles(gltf, p->given, p->mode, positions.count, p->where, &corners,
                                           &count, error));
    result = match(p, corners, count, error);
done:
    free(corners);
    return result;
}

/* Whether some vertex of the model has two places. */
static vsh_result find_split(primitive *p, vsh_error *error) {
    const vsh_lit_mesh *lit = p->lit;
    const size_t count = vsh_model_mesh(p->work->model, p->entry, 0).vertex_count;
    uint32_t *first = NULL; /* 1 + the first vertex of the atlas that is this one; 0: none yet */
    VSHI_TRY(vshi_gltf_allocate(&p->work->document.gltf, (void **)&first, count, sizeof *first, error));
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
    vshi_gltf *gltf = &p->work->document.gltf;
    const vsh_lit_mesh *lit = p->lit;
    VSHI_TRY(find_elements(p, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->chosen, lit->vertex_count, sizeof *p->chosen, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->uvs, lit->vertex_count, sizeof *p->uvs, error));
    for (size_t i = 0; i < lit->vertex_count; ++i) {
        p->chosen[i] = p->elements[lit->sources[i]];
        p->uvs[i][0] = lit->uvs[2 * i];
        p->uvs[i][1] = 1.0F - lit->uvs[2 * i + 1]; /* v points down in glTF */
    }
    VSHI_TRY(find_split(p, error));
    if (!p->split && find_only_page(p->work, lit) == VSH_LIT_NO_CHART) {
        VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&p->corners, lit->triangle_count, 3 * sizeof *p->corners,
                                    error));
        for (size_t i = 0; i < 3 * lit->triangle_count; ++i) {
            p->corners[i] = p->chosen[lit->indices[i]];
        }
    }
    return VSH_OK;
}

/* --- vertices of its own */

/* The elements of accessor `index`; `draco`: its values, else NULL. Sparse ones become dense. */
static vsh_result open_elements(const primitive *p, size_t index, const vshi_lit_draco_attribute *draco,
                                vshi_gltf_accessor *found, unsigned char **dense, vsh_error *error) {
    vshi_gltf *gltf = &p->work->document.gltf;
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

/* A new accessor of the chosen elements. `bounds`: with its least and largest values whether or not it has
 * had them. */
static vsh_result copy_elements(const primitive *p, size_t index, const vshi_gltf_accessor *from, bool bounds,
                                size_t *accessor, vsh_error *error) {
    vshi_lit_document *document = &p->work->document;
    const size_t size = (size_t)from->components * vshi_gltf_component_size(from->type);
    const size_t stride = (size + 3) & ~(size_t)3; /* of vertex attributes: a multiple of 4 */
    const size_t count = p->lit->vertex_count;
    size_t bytes, view, offset;
    if (__builtin_mul_overflow(count, stride, &bytes)) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_add_view(document, NULL, bytes, VSHI_LIT_VERTICES, stride != size ? stride : 0, &view,
                               &offset, error));
    unsigned char *to = document->added.at + offset;
    for (size_t i = 0; i < count && from->at != NULL; ++i) {
        memcpy(to + i * stride, from->at + p->chosen[i] * from->stride, size);
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

/* The copy of an accessor for a split, which each gets once. */
static vsh_result gather(const primitive *p, size_t split, size_t index,
                         const vshi_lit_draco_attribute *draco, bool bounds, size_t *accessor,
                         vsh_error *error) {
    vshi_lit_work *work = p->work;
    for (size_t i = 0; i < work->copy_count; ++i) {
        if (work->copies[i].split == split && work->copies[i].from == index) {
            *accessor = work->copies[i].to;
            return VSH_OK;
        }
    }
    vshi_gltf_accessor from;
    unsigned char *dense = NULL;
    vsh_result result;
    VSHI_TRY_DONE(open_elements(p, index, draco, &from, &dense, error));
    VSHI_TRY_DONE(copy_elements(p, index, &from, bounds, accessor, error));
    VSHI_TRY_DONE(vshi_make_room((void **)&work->copies, work->copy_count, &work->copy_capacity,
                                 sizeof *work->copies, work->document.gltf.path, error));
    work->copies[work->copy_count++] = (vshi_lit_copy){split, index, *accessor};
done:
    free(dense);
    return result;
}

/* Replaces the accessors that `attributes` (of the primitive, or of a morph target) names. */
static vsh_result gather_all(const primitive *p, size_t split, json_t *attributes, bool target,
                             vsh_error *error) {
    const char *name;
    json_t *value;
    json_object_foreach(attributes, name, value) {
        size_t index, accessor = SIZE_MAX;
        VSHI_TRY(
            vshi_gltf_index(&p->work->document.gltf, attributes, name, "accessors", p->where, &index, error));
        const vshi_lit_draco_attribute *draco =
            p->draco != NULL && !target ? vshi_lit_draco_attribute_of(p->draco, p->given, name) : NULL;
        VSHI_TRY(gather(p, split, index, draco, strcmp(name, "POSITION") == 0, &accessor, error));
        vshi_lit_set_number(&p->work->document, attributes, name, accessor);
    }
    return VSH_OK;
}

bool vshi_lit_is_split_alike(const vsh_lit_mesh *a, const vsh_lit_mesh *b) {
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           memcmp(a->sources, b->sources, a->vertex_count * sizeof *a->sources) == 0 &&
           memcmp(a->indices, b->indices, a->triangle_count * 3 * sizeof *a->indices) == 0;
}

/* Finds that of an instance that is split alike, or a new one. */
static vsh_result find_alike(const primitive *p, size_t *split, vsh_error *error) {
    vshi_lit_work *work = p->work;
    for (*split = 0; *split < work->split_count; ++*split) {
        const vshi_lit_split *other = &work->splits[*split];
        if (other->mesh == p->mesh && other->primitive == p->index &&
            vshi_lit_is_split_alike(other->lit, p->lit)) {
            return VSH_OK;
        }
    }
    VSHI_TRY(vshi_make_room((void **)&work->splits, work->split_count, &work->split_capacity,
                            sizeof *work->splits, work->document.gltf.path, error));
    work->splits[work->split_count++] = (vshi_lit_split){p->mesh, p->index, p->lit, SIZE_MAX};
    return VSH_OK;
}

static vsh_result make_split(primitive *p, size_t *uvs, size_t *split, vsh_error *error) {
    size_t i;
    json_t *target;
    VSHI_TRY(find_alike(p, split, error));
    VSHI_TRY(gather_all(p, *split, json_object_get(p->made, "attributes"), false, error));
    json_array_foreach(json_object_get(p->made, "targets"), i, target) {
        VSHI_TRY(gather_all(p, *split, target, true, error));
    }
    vshi_lit_remove_extension(p->made, "KHR_draco_mesh_compression");
    return vshi_lit_add_floats(&p->work->document, p->uvs[0], p->lit->vertex_count, 2, false, uvs, NULL,
                               error);
}

/* --- new UVs for vertices that stay */

static unsigned char *place(const primitive *p, const vshi_lit_uvs *uvs, size_t vertex) {
    return p->work->document.added.at + uvs->offset + (size_t)p->chosen[vertex] * sizeof(float[2]);
}

static bool fits(const primitive *p, const vshi_lit_uvs *uvs, size_t positions) {
    bool good = uvs->positions == positions && uvs->count == p->element_count;
    for (size_t i = 0; i < p->lit->vertex_count && good; ++i) {
        good = !uvs->set[p->chosen[i]] || memcmp(place(p, uvs, i), p->uvs[i], sizeof p->uvs[i]) == 0;
    }
    return good;
}

/* An accessor in which the elements have their UVs. Elements may come twice, with the same UVs. */
static vsh_result put_uvs(const primitive *p, size_t *accessor, vsh_error *error) {
    vshi_lit_work *work = p->work;
    vshi_lit_document *document = &work->document;
    size_t positions, found = 0;
    VSHI_TRY(vshi_gltf_index(&document->gltf, json_object_get(p->given, "attributes"), "POSITION",
                             "accessors", p->where, &positions, error));
    while (found < work->uv_count && !fits(p, &work->uvs[found], positions)) {
        ++found;
    }
    if (found == work->uv_count) {
        VSHI_TRY(vshi_make_room((void **)&work->uvs, work->uv_count, &work->uv_capacity, sizeof *work->uvs,
                                document->gltf.path, error));
        vshi_lit_uvs *made = &work->uvs[found];
        *made = (vshi_lit_uvs){.positions = positions, .count = p->element_count};
        VSHI_TRY(
            vshi_gltf_allocate(&document->gltf, (void **)&made->set, made->count, sizeof *made->set, error));
        ++work->uv_count;
        VSHI_TRY(vshi_lit_add_floats(document, NULL, made->count, 2, false, &made->accessor, &made->offset,
                                     error));
    }
    const vshi_lit_uvs *uvs = &work->uvs[found];
    for (size_t i = 0; i < p->lit->vertex_count; ++i) {
        memcpy(place(p, uvs, i), p->uvs[i], sizeof p->uvs[i]);
        uvs->set[p->chosen[i]] = true;
    }
    *accessor = uvs->accessor;
    return VSH_OK;
}

/* --- what it becomes */

static vsh_result make(primitive *p, json_t *list, vsh_error *error) {
    vshi_lit_work *work = p->work;
    vshi_lit_document *document = &work->document;
    char name[40];
    size_t uvs, set, split = 0, whole = SIZE_MAX;
    VSHI_TRY(vshi_lit_choose_set(work, p->made, p->lit, p->where, &set, error));
    if (set > VSHI_LIT_SET) {
        vshi_warn(document->gltf.run,
                  "%s: %s: textures that stay use TEXCOORD_%d, so the lightmap's UVs are TEXCOORD_%zu, which "
                  "Godot, Unity and Hubs do not read",
                  document->gltf.path, p->where, VSHI_LIT_SET, set);
    }
    VSHI_TRY(p->split ? make_split(p, &uvs, &split, error) : put_uvs(p, &uvs, error));
    name_of(set, name, sizeof name);
    vshi_lit_set_number(document, json_object_get(p->made, "attributes"), name, uvs);
    VSHI_TRY(vshi_lit_tell_set(document, p->made, set, error));
    const uint32_t only = find_only_page(work, p->lit);
    if (!p->split && only != VSH_LIT_NO_CHART) { /* its indices stay, strips too */
        vshi_lit_push(document, list, json_incref(p->made));
        return vshi_lit_mark_primitive(work, p->made, only, set, NULL, error);
    }
    if (p->mode != VSHI_GLTF_TRIANGLES || p->draco != NULL) {
        json_object_del(p->made, "mode");
    }
    return p->split ? vshi_lit_pages_make(work, p->made, p->lit, p->lit->indices, p->lit->vertex_count, set,
                                          &work->splits[split].indices, list, error)
                    : vshi_lit_pages_make(work, p->made, p->lit, p->corners, p->element_count, set, &whole,
                                          list, error);
}

/* A copy of the transform from the file's set to the model's UVs; NULL: there is none. */
static json_t *copy_transform(const primitive *p, size_t set) {
    const vshi_model_shape *shape = &p->work->model->shapes[p->work->model->entries[p->entry].shape];
    size_t material;
    if ((shape->packed >> set & 1) == 0 || !vshi_gltf_count(p->made, "material", SIZE_MAX, &material)) {
        return NULL;
    }
    const vshi_gltf_unpacking u = vshi_gltf_find_unpacking(&p->work->document.gltf, material, set);
    json_t *transform = u.uvs == VSHI_GLTF_UVS_PACKED ? vshi_lit_copy_json(&p->work->document, u.told) : NULL;
    json_object_del(transform, "texCoord"); /* the material names the set */
    return transform;
}

/* The set is the file's own. */
static vsh_result make_kept(primitive *p, json_t *list, vsh_error *error) {
    const int32_t set = p->lit->uv_set;
    vsh_result result = VSH_OK;
    char name[40];
    snprintf(name, sizeof name, "TEXCOORD_%d", set);
    if (set >= 0 && json_object_get(json_object_get(p->made, "attributes"), name) == NULL) {
        return vshi_gltf_fail(&p->work->document.gltf, error, "%s: has no %s to be lit by", p->where, name);
    }
    if (set >= 0) {
        json_t *transform = copy_transform(p, (size_t)set);
        result = vshi_lit_mark_primitive(p->work, p->made, p->lit->page, (size_t)set, transform, error);
        json_decref(transform);
    }
    vshi_lit_push(&p->work->document, list, json_incref(p->made));
    return result;
}

vsh_result vshi_lit_primitive_make(vshi_lit_work *work, size_t mesh, size_t index, size_t entry, json_t *list,
                                   vsh_error *error) {
    vshi_lit_document *document = &work->document;
    const double held = document->gltf.bytes_held;
    primitive p = {.work = work, .mesh = mesh, .index = index, .entry = entry, .lit = &work->meshes[entry]};
    vsh_result result;
    snprintf(p.where, sizeof p.where, "meshes[%zu].primitives[%zu]", mesh, index);
    p.given = json_array_get(
        json_object_get(vshi_gltf_element(&document->gltf, "meshes", mesh), "primitives"), index);
    p.made = vshi_lit_copy_json(document, p.given);
    VSHI_TRY_DONE(document->refused ? vshi_lit_no_memory(document, error) : VSH_OK);
    if (p.lit->uvs == NULL) {
        result = make_kept(&p, list, error);
        goto done;
    }
    VSHI_TRY_DONE(find_vertices(&p, error));
    document->gltf.bytes_held = held; /* it is freed with this primitive */
    VSHI_TRY_DONE(make(&p, list, error));
done:
    free(p.corners);
    free(p.uvs);
    free(p.chosen);
    free(p.elements);
    json_decref(p.made);
    return result;
}
