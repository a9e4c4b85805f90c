#include "lit/write.h"

#include "base/file.h"
#include "lit/buffers.h"
#include "lit/json_text.h"
#include "lit/obj.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* --- writing */

typedef struct output_file {
    vshi_output output;
    vshi_sink sink;
    uint64_t at;
} output_file;

static void put(output_file *file, const void *bytes, size_t size) {
    vshi_sink_write(&file->sink, bytes, size, file->at);
    file->at += size;
}

static void put_into(void *file, const void *bytes, size_t size) {
    put(file, bytes, size);
}

static void put_number(output_file *file, uint64_t number) {
    const unsigned char bytes[4] = {(unsigned char)number, (unsigned char)(number >> 8),
                                    (unsigned char)(number >> 16), (unsigned char)(number >> 24)};
    put(file, bytes, sizeof bytes);
}

static void put_padding(output_file *file, uint64_t end, char with) {
    while (file->at < end) {
        put(file, &with, 1);
    }
}

/* A buffer without the bytes that are dropped. */
static void put_buffer(output_file *file, const vshi_lit_document *document, size_t buffer) {
    const vshi_gltf_bytes bytes = document->gltf.buffers[buffer].bytes;
    size_t at = 0;
    for (size_t i = 0; i < document->dropped_count; ++i) {
        const vshi_lit_range *range = &document->dropped[i];
        if (range->buffer == buffer && range->begin < bytes.size) {
            put(file, bytes.at + at, range->begin - at);
            at = range->end < bytes.size ? range->end : bytes.size;
        }
    }
    put(file, bytes.at + at, bytes.size - at);
}

static void put_buffers(output_file *file, const vshi_lit_document *document, const vshi_lit_layout *l) {
    const uint64_t begin = file->at;
    for (size_t i = 0; i < document->gltf.buffer_count; ++i) {
        if (l->offsets[i] != SIZE_MAX) {
            put_padding(file, begin + l->offsets[i], '\0');
            put_buffer(file, document, i);
        }
    }
    put_padding(file, begin + l->added, '\0');
    put(file, document->added.at, document->added.size);
}

/* Chunks behind the first two, of whatever kind, as they stand in the input. */
static void find_rest(const vshi_lit_document *document, const unsigned char **rest, uint64_t *size) {
    enum { CHUNK = 8 };
    const vshi_gltf_bytes *chunk = &document->gltf.chunk;
    *rest = NULL;
    *size = 0;
    if (!document->gltf.binary || document->text == NULL) { // of an OBJ there is none
        return;
    }
    const unsigned char *end = (const unsigned char *)document->text + document->text_size;
    if (end < chunk->at) {
        return;
    }
    const size_t padded = (chunk->size + 3) & ~(size_t)3;
    const size_t left = (size_t)(end - chunk->at);
    *rest = padded < left && (left - padded) % 4 == 0 && left - padded >= CHUNK ? chunk->at + padded : NULL;
    *size = *rest != NULL ? left - padded : 0;
}

/* glTF 2.0, 4.4. */
static vsh_result put_binary(output_file *file, const vshi_lit_document *document, const vshi_lit_layout *l,
                             const vshi_lit_bytes *json, const char *path, vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942 };
    const uint64_t text = ((uint64_t)json->size + 3) & ~UINT64_C(3),
                   bytes = ((uint64_t)l->size + 3) & ~UINT64_C(3);
    const unsigned char *rest;
    uint64_t more;
    find_rest(document, &rest, &more);
    const uint64_t all = HEADER + CHUNK + text + (bytes > 0 ? CHUNK + bytes : 0) + more;
    if (all > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: %llu bytes, but a GLB can have %u; a .gltf can have more", path,
                         (unsigned long long)all, UINT32_MAX);
    }
    put(file, "glTF", 4);
    put_number(file, 2);
    put_number(file, all);
    put_number(file, text);
    put_number(file, JSON_CHUNK);
    put(file, json->at, json->size);
    put_padding(file, HEADER + CHUNK + text, ' ');
    if (bytes > 0) {
        put_number(file, bytes);
        put_number(file, BINARY_CHUNK);
        put_buffers(file, document, l);
        put_padding(file, all - more, '\0');
    }
    put(file, rest, more);
    return VSH_OK;
}

static vsh_result begin_file(output_file *file, const char *path, vsh_error *error) {
    VSHI_TRY(vshi_output_begin(&file->output, path, error));
    file->sink = vshi_sink_open(file->output.temporary);
    file->at = 0;
    return VSH_OK;
}

static vsh_result end_file(output_file *file, const char *path, vsh_error *error) {
    const int reason = vshi_sink_close(&file->sink);
    return reason == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path, strerror(reason));
}

/* --- files */

typedef struct files {
    output_file *list; /* [count]: the document's is the last */
    char **paths;      /* [named + 1] */
    size_t count, named;
} files;

/* The paths of all; `bin`: the name of the file of the buffer, or of an OBJ's materials; NULL: none. */
static vsh_result name_files(const vshi_lit_work *work, const vshi_lit_besides *besides, const char *bin,
                             files *all, vsh_error *error) {
    all->named = besides->count + (bin != NULL);
    all->list = calloc(all->named + 1, sizeof *all->list);
    all->paths = calloc(all->named + 1, sizeof *all->paths);
    if (all->list == NULL || all->paths == NULL) {
        return vshi_lit_no_memory(&work->document, error);
    }
    for (size_t i = 0; i <= all->named; ++i) {
        const char *name = i < besides->count ? besides->list[i].name : bin;
        all->paths[i] = i < all->named ? vshi_lit_beside_path(work->output, name) : strdup(work->output);
        if (all->paths[i] == NULL) {
            return vshi_lit_no_memory(&work->document, error);
        }
        VSHI_TRY(vshi_lit_check_replaced(&work->document, all->paths[i], error));
        if (i == besides->count && i < all->named && vshi_lit_is_obj(work->output)) {
            VSHI_TRY(vshi_lit_mtl_check(all->paths[i], error));
        }
    }
    return VSH_OK;
}

static void end_files(files *all) {
    for (size_t i = 0; i <= all->named; ++i) {
        if (i < all->count) {
            vshi_output_abandon(&all->list[i].output);
        }
        free(all->paths != NULL ? all->paths[i] : NULL);
    }
    free(all->paths);
    free(all->list);
}

static vsh_result write_document(const vshi_lit_work *work, output_file *file, const vshi_lit_layout *l,
                                 bool binary, vsh_error *error) {
    const vshi_lit_document *document = &work->document;
    vshi_lit_bytes json = {NULL, 0, 0};
    vsh_result result = vshi_lit_json_text(document->gltf.root, !binary, work->output, &json, error);
    if (result == VSH_OK && binary) {
        result = put_binary(file, document, l, &json, work->output, error);
    } else if (result == VSH_OK) {
        put(file, json.at, json.size);
        put(file, "\n", 1);
    }
    free(json.at);
    return result;
}

static vsh_result commit(files *all, vsh_error *error) {
    vshi_output **outputs = calloc(all->named + 1, sizeof *outputs);
    if (outputs == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", all->paths[all->named]);
    }
    for (size_t i = 0; i <= all->named; ++i) {
        outputs[i] = &all->list[i].output;
    }
    const vsh_result result = vshi_outputs_commit(outputs, all->named + 1, error);
    free(outputs);
    return result;
}

/* The one that is named `bin`. */
static void write_named(const vshi_lit_work *work, const vshi_lit_besides *besides, const vshi_lit_layout *l,
                        output_file *file) {
    if (vshi_lit_is_obj(work->output)) {
        vshi_lit_put_mtl(work, besides, put_into, file);
    } else {
        put_buffers(file, &work->document, l);
    }
}

static vsh_result write_all(const vshi_lit_work *work, const vshi_lit_besides *besides,
                            const vshi_lit_layout *l, const char *bin, files *all, vsh_error *error) {
    for (size_t i = 0; i <= all->named; ++i) {
        output_file *file = &all->list[i];
        VSHI_TRY(begin_file(file, all->paths[i], error));
        ++all->count;
        vsh_result result = VSH_OK;
        if (i < besides->count) {
            put(file, besides->list[i].bytes, besides->list[i].size);
        } else if (i < all->named) {
            write_named(work, besides, l, file);
        } else if (vshi_lit_is_obj(work->output)) {
            result = vshi_lit_put_obj(work, bin, put_into, file, error);
        } else {
            result = write_document(work, file, l, all->named == besides->count, error);
        }
        const vsh_result ended = end_file(file, all->paths[i], result == VSH_OK ? error : NULL);
        VSHI_TRY(result != VSH_OK ? result : ended);
    }
    if (vshi_job_cancelled(work->document.gltf.job)) {
        return vshi_job_fail_cancelled(work->document.gltf.job, error);
    }
    return commit(all, error);
}

/* The document's buffers as one, in a file of the name *bin or (NULL) in the document. */
static vsh_result join(vshi_lit_work *work, const vshi_lit_besides *besides, vshi_lit_layout *l, char **bin,
                       files *all, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    json_t *one = NULL;
    VSHI_TRY(vshi_lit_lay_out(document, l, error));
    if (strcasecmp(vshi_path_ending(work->output), "glb") != 0 && l->size > 0) {
        VSHI_TRY(vshi_lit_beside_name(work, "", "bin", bin, error));
    }
    VSHI_TRY(name_files(work, besides, *bin, all, error)); /* by the names that the input has */
    VSHI_TRY(vshi_lit_join_buffers(document, l, &one, error));
    if (one != NULL) {
        VSHI_TRY(vshi_lit_set(document, one, "byteLength", json_integer((json_int_t)l->size), error));
        json_object_del(one, "uri");
    }
    return *bin != NULL ? vshi_lit_set(document, one, "uri", vshi_lit_uri(*bin), error) : VSH_OK;
}

/* The files of an OBJ: *mtl is the name of that of its materials; NULL: it has none. */
static vsh_result name_obj(const vshi_lit_work *work, const vshi_lit_besides *besides, char **mtl, files *all,
                           vsh_error *error) {
    if (besides->count > 0) {
        VSHI_TRY(vshi_lit_beside_name(work, "", "mtl", mtl, error));
    }
    return name_files(work, besides, *mtl, all, error);
}

vsh_result vshi_lit_write_files(vshi_lit_work *work, const vshi_lit_besides *besides, vsh_error *error) {
    vshi_lit_layout l = {.size = 0};
    char *bin = NULL;
    files all = {.count = 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_lit_is_obj(work->output) ? name_obj(work, besides, &bin, &all, error)
                                                : join(work, besides, &l, &bin, &all, error));
    VSHI_TRY_DONE(write_all(work, besides, &l, bin, &all, error));
done:
    end_files(&all);
    free(bin);
    vshi_lit_layout_free(&l);
    return result;
}
