#include "lit/work.h"

#include "base/elementary.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/uri.h"
#include "image/codec.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* --- names of files beside the output */

bool vshi_lit_is_same_file(const char *a, const char *b) {
    struct stat one, other;
    return stat(a, &one) == 0 && stat(b, &other) == 0 && one.st_dev == other.st_dev &&
           one.st_ino == other.st_ino;
}

vsh_result vshi_lit_check_replaced(const vshi_lit_document *document, const char *path, vsh_error *error) {
    static const char *const lists[] = {"buffers", "images"};
    json_t *const own[] = {json_object_get(document->gltf.root, "buffers"), document->own_images};
    for (size_t k = 0; k < sizeof lists / sizeof lists[0] && document->text != NULL; ++k) {
        size_t i;
        const json_t *item;
        json_array_foreach(own[k], i, item) {
            const char *uri = json_string_value(json_object_get(item, "uri"));
            if (uri == NULL || vshi_uri_is_data(uri) || vshi_uri_is_remote(uri)) {
                continue;
            }
            char *given = vshi_uri_path(document->gltf.path, uri);
            if (given == NULL) {
                return vshi_lit_no_memory(document, error);
            }
            const bool same = vshi_lit_is_same_file(given, path);
            free(given);
            if (same) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: would replace %s[%zu] of %s", path, lists[k],
                                 i, document->gltf.path);
            }
        }
    }
    return VSH_OK;
}

/* With a number, unless that is 0. */
static char *make_name(const char *output, const char *mark, const char *ending, unsigned number) {
    const char *slash = strrchr(output, '/');
    const char *name = slash != NULL ? slash + 1 : output;
    const char *own = vshi_path_ending(output);
    const size_t stem = own[0] != '\0' ? (size_t)(own - name) - 1 : strlen(name);
    const size_t size = stem + strlen(mark) + strlen(ending) + 16;
    char *made = malloc(size);
    if (made != NULL && number > 0) {
        snprintf(made, size, "%.*s%s.%u.%s", (int)stem, name, mark, number, ending);
    } else if (made != NULL) {
        snprintf(made, size, "%.*s%s.%s", (int)stem, name, mark, ending);
    }
    return made;
}

vsh_result vshi_lit_beside_name(const vshi_lit_work *work, const char *mark, const char *ending, char **name,
                                vsh_error *error) {
    enum { MOST = 100 };
    for (unsigned number = 0;; ++number) {
        *name = make_name(work->output, mark, ending, number);
        char *path = *name != NULL ? vshi_path_beside(work->output, *name, strlen(*name)) : NULL;
        if (path == NULL) {
            free(*name);
            *name = NULL;
            return vshi_lit_no_memory(&work->document, error);
        }
        const vsh_result result = vshi_lit_check_replaced(&work->document, path, error);
        free(path);
        if (result != VSH_ERROR_ARGUMENT || number == MOST) {
            return result;
        }
        free(*name);
    }
}

enum { MARK_BYTES = VSHI_LIT_NAME_BYTES + 64 }; /* of a purpose and a page's name */

static const char *const purpose_names[VSH_LIT_PURPOSES] = {
    [VSH_LIT_OCCLUSION] = "occlusion", [VSH_LIT_LIGHTMAP] = "lightmap", [VSH_LIT_PREVIEW] = "preview"};

void vshi_lit_besides_free(vshi_lit_besides *besides) {
    for (size_t i = 0; i < besides->count; ++i) {
        free(besides->list[i].name);
        free(besides->list[i].owned);
    }
    free(besides->list);
    *besides = (vshi_lit_besides){NULL, 0};
}

/* --- encoding */

typedef struct rows {
    const vsh_lit_image *image;
    double factor; /* of values, before they are cut */
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
            const double cut = given > 0.0 ? (given < 1.0 ? given : 1.0) : 0.0; /* what is none is 0 */
            const unsigned value = (unsigned)((r->srgb ? vshi_to_srgb(cut) : cut) * most + 0.5);
            if (r->bits == 16) {
                *bytes++ = (unsigned char)(value >> 8);
            }
            *bytes++ = (unsigned char)value;
        }
    }
}

/* What planes of light are divided by, so that none is cut. */
static double largest(const vsh_lit_image *image) {
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
    /* incompressible ones are a little larger than their values */
    const double most = 1.01 * image->width * image->height * image->channel_count * r.bits / 8;
    VSHI_TRY(vshi_gltf_hold(&work->document.gltf, most, error));
    return vshi_png_encode(&source, work->output, bytes, size, error);
}

/* --- adding baked images */

static void add_sampler(vshi_lit_work *work, size_t *sampler) {
    enum { LINEAR = 9729, CLAMP = 33071 };
    if (*sampler == SIZE_MAX) { /* without smaller levels: in those, charts of all kinds flow together */
        *sampler = vshi_lit_append(&work->document, "samplers",
                                   json_pack("{s:i,s:i,s:i,s:i}", "magFilter", LINEAR, "minFilter", LINEAR,
                                             "wrapS", CLAMP, "wrapT", CLAMP));
    }
}

static vsh_result embed_bytes(vshi_lit_work *work, const void *bytes, size_t size, json_t *image,
                              const char *type, vsh_error *error) {
    size_t view;
    VSHI_TRY(vshi_lit_add_view(&work->document, bytes, size, 0, 0, &view, NULL, error));
    vshi_lit_set_number(&work->document, image, "bufferView", view);
    vshi_lit_set(&work->document, image, "mimeType", json_string(type));
    return VSH_OK;
}

/* The characters that a URI has as they are (RFC 3986), the others by their numbers. */
json_t *vshi_lit_uri(const char *name) {
    static const char digits[] = "0123456789ABCDEF";
    char *text = malloc(3 * strlen(name) + 1), *to = text;
    if (text == NULL) {
        return NULL;
    }
    for (const char *c = name; *c != '\0'; ++c) {
        const unsigned char byte = (unsigned char)*c;
        const bool plain = (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') ||
                           (byte >= '0' && byte <= '9') || strchr("-._~", byte) != NULL;
        if (plain) {
            *to++ = *c;
        } else {
            *to++ = '%';
            *to++ = digits[byte >> 4];
            *to++ = digits[byte & 15];
        }
    }
    *to = '\0';
    json_t *uri = json_string(text);
    free(text);
    return uri;
}

/* The name of an image's page, or NULL. */
static const char *name_of(const vshi_lit_work *work, const vsh_lit_image *image) {
    return image->page < work->options->page_count ? work->options->page_names[image->page] : NULL;
}

static vsh_result put_beside(vshi_lit_work *work, const vsh_lit_image *image, vshi_lit_beside *beside,
                             json_t *made, vsh_error *error) {
    char mark[MARK_BYTES], number[16] = "";
    const char *name = name_of(work, image);
    if (name == NULL && work->page_count > 1) {
        snprintf(number, sizeof number, "%u", image->page);
    }
    name = name != NULL ? name : number;
    snprintf(mark, sizeof mark, ".%s%s%s", purpose_names[image->purpose], name[0] != '\0' ? "." : "", name);
    VSHI_TRY(vshi_lit_beside_name(work, mark, "png", &beside->name, error));
    vshi_lit_set(&work->document, made, "uri", vshi_lit_uri(beside->name));
    return VSH_OK;
}

static vsh_result add(vshi_lit_work *work, const vsh_lit_image *image, bool embed, size_t *sampler,
                      vshi_lit_beside *beside, vsh_error *error) {
    *beside = (vshi_lit_beside){NULL, image->png, image->png_size, NULL};
    if (image->purpose == VSH_LIT_LIGHTMAP) {
        work->pages[image->page].intensity = image->intensity > 0.0 ? image->intensity : 1.0;
    }
    if (image->png == NULL) {
        const double scale = image->purpose == VSH_LIT_LIGHTMAP ? largest(image) : 1.0;
        work->pages[image->page].intensity *= scale;
        VSHI_TRY(encode(work, image, scale, &beside->owned, &beside->size, error));
        beside->bytes = beside->owned;
    }
    char called[MARK_BYTES];
    const char *name = name_of(work, image);
    snprintf(called, sizeof called, "%s%s%s", purpose_names[image->purpose], name != NULL ? " of " : "",
             name != NULL ? name : "");
    json_t *made = json_pack("{s:s}", "name", called);
    const vsh_result result = embed ? embed_bytes(work, beside->bytes, beside->size, made, "image/png", error)
                                    : put_beside(work, image, beside, made, error);
    const size_t index = vshi_lit_append(&work->document, "images", made);
    add_sampler(work, sampler);
    work->pages[image->page].textures[image->purpose] =
        1 + vshi_lit_append(&work->document, "textures",
                            json_pack("{s:I,s:I,s:o}", "sampler", (json_int_t)*sampler, "source",
                                      (json_int_t)index, "extras",
                                      vshi_lit_texture_mark(purpose_names[image->purpose])));
    return result;
}

vsh_result vshi_lit_images_add(vshi_lit_work *work, bool embed, vshi_lit_besides *besides, vsh_error *error) {
    const vsh_lit_options *options = work->options;
    size_t sampler = SIZE_MAX;
    VSHI_TRY(vshi_gltf_allocate(&work->document.gltf, (void **)&besides->list, options->image_count,
                                sizeof *besides->list, error));
    for (size_t i = 0; i < options->image_count; ++i) {
        if (vshi_job_cancelled(work->document.gltf.job)) {
            return vshi_job_fail_cancelled(work->document.gltf.job, error);
        }
        vshi_lit_beside beside;
        const vsh_result result = add(work, &options->images[i], embed, &sampler, &beside, error);
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

/* By its first bytes, else by its name. */
static const char *type_of(const unsigned char *bytes, size_t size, const char *path) {
    static const struct {
        const char *ending, *type, *magic;
        size_t length;
    } types[] = {{"png", "image/png", "\x89PNG", 4},     {"jpg", "image/jpeg", "\xff\xd8\xff", 3},
                 {"webp", "image/webp", "RIFF", 4},      {"ktx2", "image/ktx2", "\xabKTX 20\xbb", 8},
                 {"dds", "image/vnd-ms.dds", "DDS ", 4}, {"avif", "image/avif", NULL, 0}};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; i < sizeof types / sizeof types[0]; ++i) {
        const bool begins = types[i].magic != NULL && size >= types[i].length &&
                            memcmp(bytes, types[i].magic, types[i].length) == 0;
        if (begins || (types[i].magic == NULL && dot != NULL && strcasecmp(dot + 1, types[i].ending) == 0)) {
            return types[i].type;
        }
    }
    return NULL;
}

/* The bytes of an image, or why there are none. */
static vsh_result read_image(vshi_lit_work *work, const char *path, unsigned char **bytes, size_t *size,
                             vsh_error *error) {
    vshi_gltf *gltf = &work->document.gltf;
    return gltf->run->allow_outside || vshi_input_is_beside(gltf->path, path)
               ? vshi_gltf_read_file(gltf, path, path, bytes, size, error)
               : vshi_fail(error, VSH_ERROR_INPUT, "it lies outside of the model's folder");
}

static vsh_result bring(vshi_lit_work *work, json_t *image, const char *uri, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    unsigned char *bytes = NULL;
    size_t size = 0;
    vsh_error why;
    char *path = vshi_uri_path(document->gltf.path, uri);
    if (path == NULL) {
        return vshi_lit_no_memory(document, error);
    }
    vsh_result result = read_image(work, path, &bytes, &size, &why);
    const char *type = result == VSH_OK ? type_of(bytes, size, path) : NULL;
    if (result == VSH_ERROR_LIMIT || result == VSH_ERROR_MEMORY) {
        result = vshi_fail(error, result, "%s", why.message);
    } else if (type == NULL) {
        vshi_warn(document->gltf.run, "%s: image '%s' keeps its path, where '%s' will not find it: %s",
                  document->gltf.path, uri, work->output,
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

vsh_result vshi_lit_images_bring(vshi_lit_work *work, vsh_error *error) {
    size_t i;
    json_t *image;
    const json_t *images = json_object_get(work->document.gltf.root, "images");
    json_array_foreach(work->document.own_images, i, image) {
        const char *uri = json_string_value(json_object_get(image, "uri"));
        const bool stays = json_array_get(images, i) == image;
        if (stays && uri != NULL && !vshi_uri_is_data(uri) && !vshi_uri_is_remote(uri)) {
            VSHI_TRY(bring(work, image, uri, error));
        }
    }
    return VSH_OK;
}
