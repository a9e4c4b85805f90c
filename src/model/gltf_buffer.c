/* The bytes of a glTF: the binary chunk of a GLB, data in the JSON itself, files beside it. */
#include "model/gltf.h"

#include "base/input.h"
#include "base/memory.h"
#include "base/uri.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static vsh_result load_data(vshi_gltf *gltf, size_t index, const char *uri, vshi_gltf_buffer *buffer,
                            vsh_error *error) {
    VSHI_TRY(vshi_gltf_hold(gltf, 0.75 * (double)strlen(uri), error));
    if (!vshi_uri_data(uri, &buffer->owned, &buffer->bytes.size)) {
        return buffer->bytes.size > 0
                   ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", gltf->path)
                   : vshi_gltf_fail(gltf, error, "buffers[%zu]: its data URI is no base64", index);
    }
    return VSH_OK;
}

static vsh_result read_file(vshi_gltf *gltf, size_t index, const char *path, vshi_gltf_buffer *buffer,
                            vsh_error *error) {
    if (!gltf->run->allow_outside && !vshi_input_is_beside(gltf->path, path)) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: buffers[%zu], which holds its vertices, is '%s', outside of its folder, where "
                         "nothing is read of a model; --allow-outside (vsh_run.allow_outside) reads it",
                         gltf->path, index, path);
    }
    char name[1024];
    snprintf(name, sizeof name, "%.400s: buffers[%zu], which holds its vertices, is the file '%.400s'",
             gltf->path, index, path);
    FILE *file;
    uint64_t bytes;
    VSHI_TRY(vshi_input_open(path, name, SIZE_MAX, &file, &bytes, error));
    const size_t size = (size_t)bytes;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&buffer->owned, size, 1, error));
    if (fread(buffer->owned, 1, size, file) != size) {
        result = vshi_fail(error, VSH_ERROR_READ, "%s: '%s': %s", gltf->path, path,
                           ferror(file) ? strerror(errno) : "became shorter while it was read");
    }
    buffer->bytes.size = size;
done:
    fclose(file);
    return result;
}

static vsh_result load_beside(vshi_gltf *gltf, size_t index, const char *uri, vshi_gltf_buffer *buffer,
                              vsh_error *error) {
    if (vshi_uri_is_remote(uri)) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: buffers[%zu] is '%s': only files beside it are read", gltf->path, index, uri);
    }
    char *path = vshi_uri_path(gltf->path, uri);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", gltf->path);
    }
    const vsh_result result = read_file(gltf, index, path, buffer, error);
    free(path);
    return result;
}

static vsh_result load(vshi_gltf *gltf, size_t index, vsh_error *error) {
    const json_t *given = vshi_gltf_element(gltf, "buffers", index);
    const json_t *uri = json_object_get(given, "uri");
    vshi_gltf_buffer *buffer = &gltf->buffers[index];
    size_t length;
    if (!vshi_gltf_count(given, "byteLength", SIZE_MAX, &length) || length == SIZE_MAX) {
        return vshi_gltf_fail(gltf, error, "buffers[%zu]: has no byteLength", index);
    }
    if (uri == NULL && index == 0 && gltf->binary) {
        buffer->bytes = gltf->chunk;
    } else if (!json_is_string(uri)) {
        return vshi_gltf_fail(gltf, error, "buffers[%zu]: has no data: neither a URI nor a binary chunk",
                              index);
    } else if (vshi_uri_is_data(json_string_value(uri))) {
        VSHI_TRY(load_data(gltf, index, json_string_value(uri), buffer, error));
    } else {
        VSHI_TRY(load_beside(gltf, index, json_string_value(uri), buffer, error));
    }
    if (buffer->bytes.size < length) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: buffers[%zu] is cut short: %zu bytes of %zu", gltf->path,
                         index, buffer->bytes.size, length);
    }
    buffer->bytes.at = buffer->owned != NULL ? buffer->owned : buffer->bytes.at;
    buffer->bytes.size = length;
    buffer->loaded = true;
    return VSH_OK;
}

vsh_result vshi_gltf_part(vshi_gltf *gltf, const json_t *object, const char *where, vshi_gltf_bytes *bytes,
                          vsh_error *error) {
    size_t buffer, offset, length;
    VSHI_TRY(vshi_gltf_index(gltf, object, "buffer", "buffers", where, &buffer, error));
    if (buffer == SIZE_MAX || !vshi_gltf_count(object, "byteOffset", 0, &offset) ||
        !vshi_gltf_count(object, "byteLength", SIZE_MAX, &length) || length == SIZE_MAX) {
        return vshi_gltf_fail(gltf, error, "%s: its buffer, byteOffset or byteLength is wrong", where);
    }
    if (!gltf->buffers[buffer].loaded) {
        VSHI_TRY(load(gltf, buffer, error));
    }
    const vshi_gltf_bytes all = gltf->buffers[buffer].bytes;
    if (offset > all.size || length > all.size - offset) {
        return vshi_gltf_fail(gltf, error, "%s: %zu bytes from %zu on pass the %zu bytes of buffers[%zu]",
                              where, length, offset, all.size, buffer);
    }
    *bytes = (vshi_gltf_bytes){all.at + offset, length};
    return VSH_OK;
}

vsh_result vshi_gltf_load(vshi_gltf *gltf, size_t index, vsh_error *error) {
    return gltf->buffers[index].loaded ? VSH_OK : load(gltf, index, error);
}

/* What a compressed view unpacks to, once. Its own buffer may have no data. */
static vsh_result unpack(vshi_gltf *gltf, size_t index, const json_t *extension, const char *where,
                         size_t length, vshi_gltf_bytes *bytes, vsh_error *error) {
    vshi_gltf_buffer *view = &gltf->views[index];
    if (!view->loaded) {
        VSHI_TRY(vshi_gltf_read_meshopt(gltf, extension, where, &view->owned, &view->bytes.size, error));
        view->bytes.at = view->owned;
        view->loaded = true;
    }
    if (length != view->bytes.size) {
        return vshi_gltf_fail(gltf, error, "%s: its byteLength is %zu, but it unpacks to %zu bytes", where,
                              length, view->bytes.size);
    }
    *bytes = view->bytes;
    return VSH_OK;
}

vsh_result vshi_gltf_view(vshi_gltf *gltf, size_t index, vshi_gltf_bytes *bytes, size_t *stride,
                          vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "bufferViews[%zu]", index);
    const json_t *view = vshi_gltf_element(gltf, "bufferViews", index);
    const json_t *packed = vshi_gltf_extension(view, "EXT_meshopt_compression");
    packed = packed != NULL ? packed : vshi_gltf_extension(view, "KHR_meshopt_compression");
    size_t length;
    if (!vshi_gltf_count(view, "byteStride", 0, stride) ||
        !vshi_gltf_count(view, "byteLength", SIZE_MAX, &length)) {
        return vshi_gltf_fail(gltf, error, "%s: its byteLength or byteStride is wrong", where);
    }
    return packed != NULL ? unpack(gltf, index, packed, where, length, bytes, error)
                          : vshi_gltf_part(gltf, view, where, bytes, error);
}

void vshi_gltf_free_buffers(vshi_gltf *gltf) {
    for (size_t i = 0; gltf->buffers != NULL && i < gltf->buffer_count; ++i) {
        free(gltf->buffers[i].owned);
    }
    free(gltf->buffers);
    for (size_t i = 0; gltf->views != NULL && i < gltf->view_count; ++i) {
        free(gltf->views[i].owned);
    }
    free(gltf->views);
}
