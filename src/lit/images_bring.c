/* Images that a glTF names beside it, where it moves to another folder. */
#include "lit/images.h"

#include "base/input.h"
#include "base/uri.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

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
    FILE *file;
    uint64_t told;
    if (!gltf->run->allow_outside && !vshi_input_is_beside(gltf->path, path)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "it lies outside of the model's folder");
    }
    VSHI_TRY(vshi_input_open(path, path, UINT32_MAX, &file, &told, error));
    *size = (size_t)told;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_take(gltf, (void **)bytes, *size + 1, 1, error));
    if (fread(*bytes, 1, *size, file) != *size) {
        result = vshi_fail(error, VSH_ERROR_READ, "%s: became shorter while it was read", path);
    }
done:
    fclose(file);
    return result;
}

static vsh_result bring(vshi_lit_work *work, json_t *image, const char *uri, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    unsigned char *bytes = NULL;
    size_t size = 0, view;
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
        VSHI_TRY_DONE(vshi_lit_add_view(document, bytes, size, 0, 0, &view, NULL, error));
        VSHI_TRY_DONE(vshi_lit_set(document, image, "bufferView", json_integer((json_int_t)view), error));
        VSHI_TRY_DONE(vshi_lit_set(document, image, "mimeType", json_string(type), error));
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
