/* The transparency of a glTF's materials: alphaMode and the alpha of the base colour's texture
 * (glTF 2.0, 3.9.4; KHR_texture_transform). */
#include "io/model/gltf.h"

#include "base/elementary.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- samplers and transforms of textures */

static int32_t read_wrap(const json_t *sampler, const char *key) {
    enum { CLAMP = 33071, MIRROR = 33648 };
    const double code = json_number_value(json_object_get(sampler, key));
    return code == CLAMP ? VSH_WRAP_CLAMP : code == MIRROR ? VSH_WRAP_MIRROR : VSH_WRAP_REPEAT;
}

/* Copies a transform without -0; returns false if a number does not fit into a float. */
static bool copy_transform(const double from[6], double to[6]) {
    bool good = true;
    for (int i = 0; i < 6; ++i) {
        good = good && fabs(from[i]) <= FLT_MAX;
        to[i] = from[i] + 0.0;
    }
    return good;
}

/* Reads offset × rotation × scale, for UVs with v down. Rotates like Blender, Babylon and three.js, not like
 * the extension's own code (glTF issue 1563). */
static bool read_transform(const json_t *transform, double down[6]) {
    double offset[2] = {0.0, 0.0}, scale[2] = {1.0, 1.0};
    const json_t *rotation = json_object_get(transform, "rotation");
    const bool good = vshi_gltf_numbers(transform, "offset", 2, offset) &&
                      vshi_gltf_numbers(transform, "scale", 2, scale) &&
                      (rotation == NULL || json_is_number(rotation));
    const double angle = json_number_value(rotation); /* 0 if it is NULL */
    const double c = vshi_cos(angle), s = vshi_sin(angle);
    const double rows[6] = {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
    return copy_transform(rows, down) && good;
}

/* Reads the same for UVs and images with v up. */
static bool read_transform_up(const json_t *transform, double up[6]) {
    double down[6];
    const bool good = read_transform(transform, down);
    const double rows[6] = {down[0], -down[1], down[1] + down[2], -down[3], down[4], 1.0 - down[4] - down[5]};
    return copy_transform(rows, up) && good;
}

/* --- UVs that a packer stored as integers */

static void add_texture(const json_t *info, size_t wanted, vshi_gltf_unpacking *u, bool *any) {
    const json_t *extension = vshi_gltf_extension(info, "KHR_texture_transform");
    size_t own, set;
    double transform[6];
    if (json_object_get(info, "index") == NULL || !vshi_gltf_count(info, "texCoord", 0, &own) ||
        !vshi_gltf_count(extension, "texCoord", own, &set) || set != wanted) {
        return;
    }
    if (!read_transform(extension, transform) ||
        (*any && memcmp(u->transform, transform, sizeof transform) != 0)) {
        u->uvs = VSHI_GLTF_UVS_MIXED;
        return;
    }
    if (!*any && memcmp(transform, vshi_uv_identity, sizeof transform) != 0) {
        u->uvs = VSHI_GLTF_UVS_PACKED;
    }
    *any = true;
    u->extension = extension;
    memcpy(u->transform, transform, sizeof transform);
}

/* Adds all textures at or below `value`. */
static void add_textures(json_t *value, size_t set, vshi_gltf_unpacking *u, bool *any) {
    size_t i;
    const char *name;
    json_t *member;
    add_texture(value, set, u, any);
    json_array_foreach(value, i, member) {
        add_textures(member, set, u, any);
    }
    json_object_foreach(value, name, member) {
        add_textures(member, set, u, any);
    }
}

vshi_gltf_unpacking vshi_gltf_find_unpacking(const vshi_gltf *gltf, size_t material, size_t set) {
    vshi_gltf_unpacking u = {.uvs = VSHI_GLTF_UVS_PLAIN, .found = true};
    bool any = false;
    add_textures(json_array_get(json_object_get(gltf->root, "materials"), material), set, &u, &any);
    return u;
}

static bool has_integer_uvs(const vshi_gltf *gltf, const json_t *attributes, int set) {
    char name[32];
    size_t accessor, type;
    snprintf(name, sizeof name, "TEXCOORD_%d", set);
    return vshi_gltf_count(attributes, name, SIZE_MAX, &accessor) && accessor != SIZE_MAX &&
           vshi_gltf_count(vshi_gltf_element(gltf, "accessors", accessor), "componentType", VSHI_GLTF_FLOAT,
                           &type) &&
           type != VSHI_GLTF_FLOAT;
}

/* Finds the transform of each set that a primitive stores as integers. It applies to all primitives of the
 * material, so that their UVs fit the material's mask. */
static vsh_result find_packed_sets(vshi_gltf *gltf, const json_t *primitive, vsh_error *error) {
    const size_t count = gltf->model->material_count, material = vshi_gltf_material(gltf, primitive);
    if (material == SIZE_MAX) {
        return VSH_OK;
    }
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        if (!has_integer_uvs(gltf, json_object_get(primitive, "attributes"), set)) {
            continue;
        }
        if (gltf->unpackings == NULL) {
            VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->unpackings, count,
                                        sizeof(vshi_gltf_unpacking[VSH_MAX_UV_SETS]), error));
        }
        vshi_gltf_unpacking *u = &gltf->unpackings[material * VSH_MAX_UV_SETS + (size_t)set];
        *u = u->found ? *u : vshi_gltf_find_unpacking(gltf, material, (size_t)set);
    }
    return VSH_OK;
}

static vsh_result find_all_packed(vshi_gltf *gltf, vsh_error *error) {
    size_t m, p;
    json_t *mesh, *primitive;
    json_array_foreach(json_object_get(gltf->root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            VSHI_TRY(find_packed_sets(gltf, primitive, error));
        }
    }
    return VSH_OK;
}

/* --- images */

static vsh_result find_image_file(const vshi_gltf *gltf, const char *where, const char *uri,
                                  vshi_model_image *image, vsh_error *error) {
    if (vshi_uri_is_remote(uri)) {
        return vshi_gltf_fail(gltf, error, "%s is '%.200s': only files beside it are read", where, uri);
    }
    image->path = vshi_uri_path(gltf->path, uri);
    if (image->path == NULL) {
        return vshi_fail_memory(error, gltf->path);
    }
    if (gltf->run->allow_outside != 0 || vshi_input_is_beside(gltf->path, image->path)) {
        return VSH_OK;
    }
    const vsh_result result = vshi_gltf_fail(
        gltf, error, "%s is '%.400s', outside of its folder; --allow-outside reads it", where, image->path);
    free(image->path);
    image->path = NULL;
    return result;
}

static vsh_result copy_image_bytes(vshi_gltf *gltf, const char *where, size_t view, vshi_model_image *image,
                                   vsh_error *error) {
    vshi_gltf_bytes bytes;
    size_t stride;
    VSHI_TRY(vshi_gltf_view(gltf, view, &bytes, &stride, error));
    if (bytes.size == 0) {
        return vshi_gltf_fail(gltf, error, "%s is empty", where);
    }
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&image->owned, bytes.size, 1, error));
    memcpy(image->owned, bytes.at, bytes.size);
    image->size = bytes.size;
    return VSH_OK;
}

/* Reads an image, once. */
static vsh_result read_image(vshi_gltf *gltf, size_t index, vsh_error *error) {
    char where[32];
    snprintf(where, sizeof where, "images[%zu]", index);
    const json_t *given = vshi_gltf_element(gltf, "images", index);
    const char *uri = json_string_value(json_object_get(given, "uri"));
    vshi_model_image *image = &gltf->model->images[index];
    size_t view;
    if (image->path != NULL || image->owned != NULL) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_index(gltf, given, "bufferView", "bufferViews", where, &view, error));
    VSHI_TRY(view != SIZE_MAX ? copy_image_bytes(gltf, where, view, image, error)
             : uri == NULL    ? vshi_gltf_fail(gltf, error, "%s has neither a URI nor a buffer view", where)
             : vshi_uri_is_data(uri)
                 ? vshi_gltf_read_data(gltf, where, uri, &image->owned, &image->size, error)
                 : find_image_file(gltf, where, uri, image, error));
    image->bytes = image->owned;
    return VSH_OK;
}

/* Finds the image of a texture, by default that of an extension for other formats; SIZE_MAX: none. */
static vsh_result find_image(const vshi_gltf *gltf, const json_t *texture, const char *where, size_t *image,
                             vsh_error *error) {
    static const char *const others[] = {"EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds",
                                         "KHR_texture_basisu"};
    VSHI_TRY(vshi_gltf_index(gltf, texture, "source", "images", where, image, error));
    for (size_t i = 0; *image == SIZE_MAX && i < sizeof others / sizeof others[0]; ++i) {
        VSHI_TRY(vshi_gltf_index(gltf, vshi_gltf_extension(texture, others[i]), "source", "images", where,
                                 image, error));
    }
    return VSH_OK;
}

static vsh_result read_texture(vshi_gltf *gltf, const json_t *info, const char *where,
                               vshi_model_material *material, vsh_error *error) {
    const json_t *transform = vshi_gltf_extension(info, "KHR_texture_transform");
    vshi_material *values = &material->values;
    size_t texture, image, sampler, set, own_set;
    VSHI_TRY(vshi_gltf_index(gltf, info, "index", "textures", where, &texture, error));
    if (texture == SIZE_MAX) {
        return VSH_OK;
    }
    const json_t *given = vshi_gltf_element(gltf, "textures", texture);
    VSHI_TRY(find_image(gltf, given, where, &image, error));
    VSHI_TRY(vshi_gltf_index(gltf, given, "sampler", "samplers", where, &sampler, error));
    if (!vshi_gltf_count(info, "texCoord", 0, &set) ||
        !vshi_gltf_count(transform, "texCoord", set, &own_set) || own_set >= VSH_MAX_UV_SETS ||
        !read_transform_up(transform, values->uv_transform)) {
        return vshi_gltf_fail(gltf, error, "%s: the texCoord or transform of its texture is wrong", where);
    }
    values->uv_set = (int32_t)own_set;
    if (sampler != SIZE_MAX) {
        values->wrap[0] = read_wrap(vshi_gltf_element(gltf, "samplers", sampler), "wrapS");
        values->wrap[1] = read_wrap(vshi_gltf_element(gltf, "samplers", sampler), "wrapT");
    }
    if (image != SIZE_MAX) {
        VSHI_TRY(read_image(gltf, image, error));
        material->image = image + 1;
    }
    return VSH_OK;
}

/* --- materials */

static int32_t read_alpha_mode(const json_t *given) {
    const char *mode = json_string_value(json_object_get(given, "alphaMode"));
    return mode != NULL && strcmp(mode, "BLEND") == 0  ? VSH_ALPHA_BLENDED
           : mode != NULL && strcmp(mode, "MASK") == 0 ? VSH_ALPHA_MASKED
                                                       : VSH_ALPHA_OPAQUE;
}

/* Reads a number between limits; otherwise returns the fallback. */
static double read_number(const json_t *given, double lowest, double highest, double fallback) {
    const double number = json_number_value(given);
    return json_is_number(given) && number >= lowest && number <= highest ? number : fallback;
}

/* Reads the alpha and texture of a material that is not opaque. A texture that cannot be read gives a
 * warning: the mesh is still usable. */
static vsh_result read_mask(vshi_gltf *gltf, const json_t *given, const char *where,
                            vshi_model_material *material, vsh_error *error) {
    const json_t *surface = json_object_get(given, "pbrMetallicRoughness");
    vsh_error why;
    if (material->values.alpha == VSH_ALPHA_MASKED) {
        material->values.alpha_cutoff = read_number(json_object_get(given, "alphaCutoff"), 0.0, FLT_MAX, 0.5);
    }
    material->values.base_alpha =
        read_number(json_array_get(json_object_get(surface, "baseColorFactor"), 3), 0.0, 1.0, 1.0);
    const vsh_result result =
        read_texture(gltf, json_object_get(surface, "baseColorTexture"), where, material, &why);
    if (result == VSH_ERROR_INPUT || result == VSH_ERROR_READ || result == VSH_ERROR_UNSUPPORTED) {
        vshi_warn(gltf->run, "%s; its mask is ignored", why.message);
        return VSH_OK;
    }
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s", why.message);
}

vsh_result vshi_gltf_mask_image(const vshi_gltf *gltf, const json_t *material, size_t *image,
                                vsh_error *error) {
    const json_t *surface = json_object_get(material, "pbrMetallicRoughness");
    size_t texture;
    *image = SIZE_MAX;
    if (read_alpha_mode(material) == VSH_ALPHA_OPAQUE) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(surface, "baseColorTexture"), "index", "textures",
                             "a material", &texture, error));
    return texture != SIZE_MAX
               ? find_image(gltf, vshi_gltf_element(gltf, "textures", texture), "a texture", image, error)
               : VSH_OK;
}

vsh_result vshi_gltf_read_materials(vshi_gltf *gltf, vsh_error *error) {
    const json_t *materials = json_object_get(gltf->root, "materials");
    vsh_model *model = gltf->model;
    const size_t count = json_array_size(materials);
    const size_t images = json_array_size(json_object_get(gltf->root, "images"));
    VSHI_TRY(vshi_gltf_hold(gltf, (double)count * sizeof *model->materials, error));
    VSHI_TRY(vshi_model_add_materials(model, count, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&model->images, images, sizeof *model->images, error));
    model->image_count = images;
    VSHI_TRY(find_all_packed(gltf, error));
    for (size_t i = 0; i < count; ++i) {
        const json_t *given = json_array_get(materials, i);
        vshi_model_material *material = &model->materials[i];
        char where[32];
        snprintf(where, sizeof where, "materials[%zu]", i);
        material->values.alpha = read_alpha_mode(given);
        material->values.double_sided = json_is_true(json_object_get(given, "doubleSided"));
        const char *name = json_string_value(json_object_get(given, "name"));
        if (name != NULL && name[0] != '\0') {
            VSHI_TRY(vshi_gltf_hold(gltf, (double)strlen(name), error));
            VSHI_TRY(vshi_model_copy_line(name, &material->name, error));
        }
        if (material->values.alpha != VSH_ALPHA_OPAQUE) {
            VSHI_TRY(read_mask(gltf, given, where, material, error));
        }
        const size_t set = (size_t)material->values.uv_set;
        if (gltf->unpackings != NULL &&
            gltf->unpackings[i * VSH_MAX_UV_SETS + set].uvs == VSHI_GLTF_UVS_PACKED) {
            /* the UVs are transformed already */
            memcpy(material->values.uv_transform, vshi_uv_identity, sizeof vshi_uv_identity);
        }
    }
    return VSH_OK;
}
