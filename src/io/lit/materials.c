/* Baked images, and materials that show them: occlusionTexture (glTF 2.0, 3.9.3), MOZ_lightmap (docs/lit.md)
 * and KHR_materials_unlit. */
#include "io/lit/work.h"

#include "base/elementary.h"
#include "base/file.h"
#include "base/text.h"
#include "io/image/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* --- images */

enum { MARK_BYTES = VSHI_LIT_NAME_BYTES + 64 }; /* a purpose and a page's name */

static const char *const purpose_names[VSHI_LIT_PURPOSES] = {
    [VSH_LIT_OCCLUSION] = "occlusion", [VSH_LIT_LIGHTMAP] = "lightmap", [VSH_LIT_PREVIEW] = "preview"};

void vshi_lit_besides_free(vshi_lit_besides *besides) {
    for (size_t i = 0; i < besides->count; ++i) {
        free(besides->list[i].name);
        free(besides->list[i].owned);
    }
    free(besides->list);
}

typedef struct rows {
    const vsh_lit_image *image;
    double factor; /* of values, before they are cut at 1 */
    bool srgb;
    int bits;
} rows;

static void fill_row(void *user, int32_t y, unsigned char *bytes) {
    const rows *r = user;
    const size_t width = (size_t)r->image->width, count = (size_t)r->image->channel_count;
    const double most = r->bits == 16 ? 65535.0 : 255.0;
    for (size_t x = 0; x < width; ++x) {
        for (size_t c = 0; c < count; ++c) {
            const double given = (double)r->image->channels[c][(size_t)y * width + x] * r->factor;
            const double cut = given > 0.0 ? (given < 1.0 ? given : 1.0) : 0.0; /* NaN becomes 0 */
            const unsigned value = (unsigned)((r->srgb ? vshi_to_srgb(cut) : cut) * most + 0.5);
            if (r->bits == 16) {
                *bytes++ = (unsigned char)(value >> 8);
            }
            *bytes++ = (unsigned char)value;
        }
    }
}

/* The divisor of planes of light, so that none is cut at 1. */
static double find_largest(const vsh_lit_image *image) {
    double most = 1.0;
    const size_t count = (size_t)image->width * (size_t)image->height;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        for (size_t i = 0; i < count; ++i) {
            const double value = (double)image->channels[c][i];
            most = value > most && isfinite(value) ? value : most;
        }
    }
    return most;
}

static vsh_result encode(vshi_lit_work *work, const vsh_lit_image *image, double scale, unsigned char **bytes,
                         size_t *size, vsh_error *error) {
    rows r = {image, 1.0, image->purpose == VSH_LIT_PREVIEW, image->bits == 16 ? 16 : 8};
    r.factor = image->purpose == VSH_LIT_LIGHTMAP                            ? 1.0 / scale
               : image->purpose == VSH_LIT_PREVIEW && image->intensity > 0.0 ? image->intensity
                                                                             : 1.0;
    const vshi_png_source source = {image->width, image->height, image->channel_count, r.bits, fill_row, &r};
    /* incompressible values grow a little */
    const double most = 1.01 * image->width * image->height * image->channel_count * r.bits / 8;
    VSHI_TRY(vshi_gltf_hold(&work->gltf, most, error));
    return vshi_png_encode(&source, work->output, bytes, size, error);
}

static vsh_result embed_bytes(vshi_lit_work *work, const void *bytes, size_t size, json_t *image,
                              const char *type, vsh_error *error) {
    size_t view;
    VSHI_TRY(vshi_lit_add_view(work, bytes, size, 0, 0, &view, error));
    vshi_lit_set_number(work, image, "bufferView", view);
    vshi_lit_set(work, image, "mimeType", json_string(type));
    return VSH_OK;
}

/* The name of an image's page, or NULL. */
static const char *find_page_name(const vshi_lit_work *work, const vsh_lit_image *image) {
    return image->page < work->options->page_count ? work->options->page_names[image->page] : NULL;
}

static vsh_result name_image(vshi_lit_work *work, const vsh_lit_image *image, vshi_lit_beside *beside,
                             json_t *made, vsh_error *error) {
    char mark[MARK_BYTES], number[16] = "";
    const char *name = find_page_name(work, image);
    if (name == NULL && work->page_count > 1) {
        snprintf(number, sizeof number, "%u", image->page);
    }
    name = name != NULL ? name : number;
    snprintf(mark, sizeof mark, ".%s%s%s", purpose_names[image->purpose], name[0] != '\0' ? "." : "", name);
    VSHI_TRY(vshi_lit_name_beside(work, mark, "png", &beside->name, error));
    vshi_lit_set(work, made, "uri", vshi_lit_uri(beside->name));
    return VSH_OK;
}

static vsh_result add_image(vshi_lit_work *work, const vsh_lit_image *image, bool embed, size_t *sampler,
                            vshi_lit_beside *beside, vsh_error *error) {
    enum { LINEAR = 9729, CLAMP = 33071 };
    *beside = (vshi_lit_beside){NULL, image->png, image->png_size, NULL};
    if (image->purpose == VSH_LIT_LIGHTMAP) {
        work->pages[image->page].intensity = image->intensity > 0.0 ? image->intensity : 1.0;
    }
    if (image->png == NULL) {
        const double scale = image->purpose == VSH_LIT_LIGHTMAP ? find_largest(image) : 1.0;
        work->pages[image->page].intensity *= scale;
        VSHI_TRY(encode(work, image, scale, &beside->owned, &beside->size, error));
        beside->bytes = beside->owned;
    }
    const char *purpose = purpose_names[image->purpose], *page = find_page_name(work, image);
    json_t *made = json_pack("{s:o}", "name",
                             page != NULL ? json_sprintf("%s of %s", purpose, page) : json_string(purpose));
    const vsh_result result = embed ? embed_bytes(work, beside->bytes, beside->size, made, "image/png", error)
                                    : name_image(work, image, beside, made, error);
    const json_int_t index = (json_int_t)vshi_lit_append(work, "images", made);
    if (*sampler == SIZE_MAX) { /* without mipmaps: in these, neighbouring charts mix */
        *sampler = vshi_lit_append(work, "samplers",
                                   json_pack("{s:i,s:i,s:i,s:i}", "magFilter", LINEAR, "minFilter", LINEAR,
                                             "wrapS", CLAMP, "wrapT", CLAMP));
    }
    json_t *texture = json_pack("{s:I,s:I,s:o}", "sampler", (json_int_t)*sampler, "source", index, "extras",
                                vshi_lit_mark_texture(purpose));
    work->pages[image->page].textures[image->purpose] = 1 + vshi_lit_append(work, "textures", texture);
    return result;
}

vsh_result vshi_lit_add_images(vshi_lit_work *work, bool embed, vshi_lit_besides *besides, vsh_error *error) {
    const vsh_lit_options *options = work->options;
    size_t sampler = SIZE_MAX;
    VSHI_TRY(vshi_gltf_allocate(&work->gltf, (void **)&besides->list, options->image_count,
                                sizeof *besides->list, error));
    for (size_t i = 0; i < options->image_count; ++i) {
        VSHI_TRY(vshi_job_check(work->gltf.job, error));
        vshi_lit_beside beside;
        const vsh_result result = add_image(work, &options->images[i], embed, &sampler, &beside, error);
        if (result == VSH_OK && !embed) {
            besides->list[besides->count++] = beside;
        } else {
            free(beside.name);
            free(beside.owned);
        }
        VSHI_TRY(result);
    }
    return VSH_OK;
}

/* --- images of a glTF that moves to another folder */

/* The media type of a file by its first bytes, else by its ending; NULL: unknown. */
static const char *find_type(const unsigned char *bytes, size_t size, const char *path) {
    static const struct {
        const char *type, *magic;
    } types[] = {{"image/png", "\x89PNG"},
                 {"image/jpeg", "\xff\xd8\xff"},
                 {"image/webp", "RIFF"},
                 {"image/ktx2", "\xabKTX 20\xbb"},
                 {"image/vnd-ms.dds", "DDS "}};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; ++i) {
        const size_t length = strlen(types[i].magic);
        if (size >= length && memcmp(bytes, types[i].magic, length) == 0) {
            return types[i].type;
        }
    }
    return strcasecmp(vshi_path_ending(path), "avif") == 0 ? "image/avif" : NULL;
}

static vsh_result read_image(vshi_lit_work *work, const char *path, unsigned char **bytes, size_t *size,
                             vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    return gltf->run->allow_outside || vshi_input_is_beside(gltf->path, path)
               ? vshi_gltf_read_file(gltf, path, path, bytes, size, error)
               : vshi_fail(error, VSH_ERROR_INPUT, "it lies outside of the model's folder");
}

static vsh_result bring_image(vshi_lit_work *work, json_t *image, const char *uri, vsh_error *error) {
    unsigned char *bytes = NULL;
    size_t size = 0;
    vsh_error why;
    char *path = vshi_uri_path(work->gltf.path, uri);
    if (path == NULL) {
        return vshi_fail_memory(error, work->gltf.path);
    }
    vsh_result result = read_image(work, path, &bytes, &size, &why);
    const char *type = result == VSH_OK ? find_type(bytes, size, path) : NULL;
    if (result == VSH_ERROR_LIMIT || result == VSH_ERROR_MEMORY) {
        result = vshi_fail(error, result, "%s", why.message);
    } else if (type == NULL) {
        vshi_warn(work->gltf.run, "%s: image '%s' keeps its path, where '%s' will not find it: %s",
                  work->gltf.path, uri, work->output,
                  result == VSH_OK ? "it is of no type that is known" : why.message);
        result = VSH_OK;
    } else {
        VSHI_TRY_DONE(embed_bytes(work, bytes, size, image, type, error));
        json_object_del(image, "uri");
    }
done:
    free(bytes);
    free(path);
    return result;
}

vsh_result vshi_lit_bring_images(vshi_lit_work *work, vsh_error *error) {
    size_t i;
    json_t *image;
    if (work->own_images == NULL) {
        return VSH_OK;
    }
    char *from = vshi_path_beside(work->model_path, ".", 1), *to = vshi_path_beside(work->output, ".", 1);
    const bool known = from != NULL && to != NULL, moves = known && !vshi_lit_is_same_file(from, to);
    free(from);
    free(to);
    const json_t *images = json_object_get(work->gltf.root, "images");
    const size_t own = json_array_size(images) - work->options->image_count; /* the bake's images follow */
    json_array_foreach(moves ? images : NULL, i, image) {
        const char *uri = json_string_value(json_object_get(image, "uri"));
        if (i < own && uri != NULL && !vshi_uri_is_data(uri) && !vshi_uri_is_remote(uri)) {
            VSHI_TRY(bring_image(work, image, uri, error));
        }
    }
    return known ? VSH_OK : vshi_fail_memory(error, work->gltf.path);
}

/* --- looks of primitives */

static const char variants_name[] = "KHR_materials_variants", transform_name[] = "KHR_texture_transform";

/* Called for a primitive, or for a variant of one. */
typedef vsh_result visit_fn(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error);

/* Visits a primitive, and its variants that name a material. */
static vsh_result visit_primitive(vshi_lit_work *work, json_t *primitive, visit_fn *visit, void *user,
                                  vsh_error *error) {
    size_t i;
    json_t *mapping;
    json_array_foreach(json_object_get(vshi_gltf_extension(primitive, variants_name), "mappings"), i,
                       mapping) {
        if (json_object_get(mapping, "material") != NULL) {
            VSHI_TRY(visit(work, mapping, user, error));
        }
    }
    return visit(work, primitive, user, error);
}

static vsh_result visit_all(vshi_lit_work *work, visit_fn *visit, void *user, vsh_error *error) {
    size_t m, p;
    json_t *mesh, *primitive;
    json_array_foreach(json_object_get(work->gltf.root, "meshes"), m, mesh) {
        json_array_foreach(json_object_get(mesh, "primitives"), p, primitive) {
            VSHI_TRY(visit_primitive(work, primitive, visit, user, error));
        }
    }
    return VSH_OK;
}

static bool are_equal(const vshi_lit_look *a, const vshi_lit_look *b) {
    const bool both = a->transform != NULL && b->transform != NULL;
    return a->material == b->material && a->page == b->page && a->set == b->set &&
           (both ? json_equal(a->transform, b->transform) != 0 : a->transform == b->transform);
}

/* Marks an owner with the look at `user`, of its own material. */
static vsh_result mark_owner(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error) {
    vshi_lit_look look = *(const vshi_lit_look *)user;
    size_t index = 0;
    VSHI_TRY(
        vshi_gltf_index(&work->gltf, owner, "material", "materials", "a primitive", &look.material, error));
    while (index < work->looks.count && !are_equal(&work->looks.list[index], &look)) {
        ++index;
    }
    if (index == work->looks.count) {
        VSHI_TRY(vshi_make_room((void **)&work->looks.list, index, &work->looks.room, sizeof look,
                                work->gltf.path, error));
        work->looks.list[work->looks.count++] = look;
        json_incref(look.transform);
    }
    vshi_lit_set(work, owner, "material", json_integer(-1 - (json_int_t)index));
    return VSH_OK;
}

vsh_result vshi_lit_mark_primitive(vshi_lit_work *work, json_t *primitive, uint32_t page, size_t set,
                                   json_t *transform, vsh_error *error) {
    vshi_lit_look look = {.page = page, .set = set, .transform = transform, .made = SIZE_MAX};
    return visit_primitive(work, primitive, mark_owner, &look, error);
}

/* The look of a marked primitive, or NULL. */
static vshi_lit_look *find_look(const vshi_lit_work *work, const json_t *owner) {
    const json_t *material = json_object_get(owner, "material");
    const json_int_t number = json_is_integer(material) ? json_integer_value(material) : 0;
    return number < 0 && -1 - number < (json_int_t)work->looks.count ? &work->looks.list[-1 - number] : NULL;
}

/* Notes the material of an unlit primitive in the array at `user`; NULL: only checks it. */
static vsh_result find_unlit(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error) {
    bool *unlit = user;
    size_t material = SIZE_MAX;
    if (find_look(work, owner) == NULL) {
        VSHI_TRY(
            vshi_gltf_index(&work->gltf, owner, "material", "materials", "a primitive", &material, error));
    }
    if (material != SIZE_MAX && unlit != NULL) {
        unlit[material] = true;
    }
    return VSH_OK;
}

vsh_result vshi_lit_check_materials(vshi_lit_work *work, vsh_error *error) {
    return visit_all(work, find_unlit, NULL, error); /* there are no looks yet */
}

/* Replaces the mark of a primitive by its material. */
static vsh_result set_material(vshi_lit_work *work, json_t *owner, void *user, vsh_error *error) {
    (void)user;
    (void)error;
    const vshi_lit_look *look = find_look(work, owner);
    if (look != NULL && look->made == SIZE_MAX) {
        json_object_del(owner, "material"); /* it had none */
    } else if (look != NULL) {
        vshi_lit_set_number(work, owner, "material", look->made);
    }
    return VSH_OK;
}

/* --- materials of looks */

static bool has_images(const vshi_lit_work *work, uint32_t page) {
    const size_t *textures = work->pages[page].textures;
    return work->pages[page].unlit || textures[VSH_LIT_OCCLUSION] > 0 || textures[VSH_LIT_LIGHTMAP] > 0 ||
           textures[VSH_LIT_PREVIEW] > 0;
}

static json_t *make_texture_info(const vshi_lit_work *work, int purpose, const vshi_lit_look *look) {
    const json_int_t texture = (json_int_t)work->pages[look->page].textures[purpose] - 1,
                     set = (json_int_t)look->set;
    return look->transform == NULL ? json_pack("{s:I,s:I}", "index", texture, "texCoord", set)
                                   : json_pack("{s:I,s:I,s:{s:O}}", "index", texture, "texCoord", set,
                                               "extensions", transform_name, look->transform);
}

bool vshi_lit_is_cut_by_texture(const json_t *material) {
    const char *mode = json_string_value(json_object_get(material, "alphaMode"));
    return mode != NULL && strcmp(mode, "OPAQUE") != 0 &&
           json_object_get(json_object_get(material, "pbrMetallicRoughness"), "baseColorTexture") != NULL;
}

/* Sets the textures of a look in a material. */
static vsh_result set_textures(vshi_lit_work *work, json_t *material, const vshi_lit_look *look,
                               vsh_error *error) {
    const vshi_lit_page_images *page = &work->pages[look->page];
    json_t *base, *extensions;
    if (page->textures[VSH_LIT_OCCLUSION] > 0) {
        vshi_lit_set(work, material, "occlusionTexture", make_texture_info(work, VSH_LIT_OCCLUSION, look));
    }
    if (page->textures[VSH_LIT_LIGHTMAP] > 0) {
        VSHI_TRY(vshi_lit_find_object(work, material, "extensions", &extensions, error));
        json_t *info = make_texture_info(work, VSH_LIT_LIGHTMAP, look);
        vshi_lit_set(work, info, "intensity", json_real(page->intensity));
        vshi_lit_set(work, extensions, "MOZ_lightmap", info);
        vshi_lit_use_extension(work, "MOZ_lightmap");
    }
    const bool preview = page->textures[VSH_LIT_PREVIEW] > 0 && !vshi_lit_is_cut_by_texture(material);
    if (preview) {
        VSHI_TRY(vshi_lit_find_object(work, material, "pbrMetallicRoughness", &base, error));
        vshi_lit_set(work, base, "baseColorTexture", make_texture_info(work, VSH_LIT_PREVIEW, look));
    }
    if (preview || page->unlit) {
        VSHI_TRY(vshi_lit_find_object(work, material, "extensions", &extensions, error));
        vshi_lit_set(work, extensions, "KHR_materials_unlit", json_object());
        vshi_lit_use_extension(work, "KHR_materials_unlit");
    }
    if (look->transform != NULL) {
        vshi_lit_use_extension(work, transform_name);
    }
    return VSH_OK;
}

/* Names a material after its number, unless it keeps a name that only it has: engines find materials by name.
 */
static void name_material(vshi_lit_work *work, json_t *material, size_t number, bool is_copy) {
    const char *name = json_string_value(json_object_get(material, "name"));
    if (is_copy || name == NULL || name[0] == '\0') {
        vshi_lit_set(work, material, "name",
                     json_sprintf("%s.%zu", name != NULL && name[0] != '\0' ? name : "material", number));
    }
}

/* Makes the material of a look: in place of the old one if nobody has taken that, else a new one. Replaced
 * ones wait in changed[], because others are still copied from the old ones. */
static vsh_result make_material(vshi_lit_work *work, vshi_lit_look *look, bool *taken, json_t **changed,
                                vsh_error *error) {
    json_t *material =
        look->material != SIZE_MAX
            ? vshi_lit_copy_json(work, vshi_gltf_element(&work->gltf, "materials", look->material))
            : json_object();
    const vsh_result result =
        json_is_object(material)
            ? set_textures(work, material, look, error)
            : vshi_gltf_fail(&work->gltf, error, "materials[%zu] is no object", look->material);
    if (result != VSH_OK) {
        json_decref(material);
        return work->refused || material == NULL ? vshi_fail_memory(error, work->gltf.path) : result;
    }
    if (look->material != SIZE_MAX && !taken[look->material]) {
        taken[look->material] = true;
        changed[look->material] = material;
        look->made = look->material;
        name_material(work, material, look->made, false);
    } else {
        look->made = vshi_lit_append(work, "materials", material);
        name_material(work, material, look->made, look->material != SIZE_MAX);
    }
    return VSH_OK;
}

vsh_result vshi_lit_apply_materials(vshi_lit_work *work, vsh_error *error) {
    json_t *materials = json_object_get(work->gltf.root, "materials"), **changed;
    const size_t count = json_array_size(materials);
    bool *taken; /* by an unlit primitive, or by a look */
    const vshi_array arrays[] = {VSHI_ARRAY(changed, count), VSHI_ARRAY(taken, count)};
    vsh_result result;
    VSHI_TRY(VSHI_LIT_ALLOCATE(work, arrays, error));
    VSHI_TRY_DONE(visit_all(work, find_unlit, taken, error));
    for (size_t i = 0; i < work->looks.count; ++i) {
        vshi_lit_look *look = &work->looks.list[i];
        if (!has_images(work, look->page)) {
            look->made = look->material;
            if (look->material != SIZE_MAX) {
                taken[look->material] = true;
            }
        }
    }
    for (size_t i = 0; i < work->looks.count; ++i) {
        if (has_images(work, work->looks.list[i].page)) {
            VSHI_TRY_DONE(make_material(work, &work->looks.list[i], taken, changed, error));
        }
    }
    for (size_t m = 0; m < count; ++m) {
        work->refused |= changed[m] != NULL && json_array_set(materials, m, changed[m]) != 0;
    }
    result = visit_all(work, set_material, NULL, error);
done:
    for (size_t m = 0; m < count; ++m) {
        json_decref(changed[m]);
    }
    free(changed);
    return result;
}
