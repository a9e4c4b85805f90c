/* A lit document into its files. */
#define _GNU_SOURCE /* fopencookie */
#include "base/decimal.h"
#include "base/file.h"
#include "lit/work.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Where the bytes of each buffer lie in the one that is written. */
typedef struct layout {
    size_t *offsets; /* [buffer_count]; SIZE_MAX: has no bytes (EXT_meshopt_compression's fallback) */
    size_t *numbers; /* [buffer_count]: of each in the new list */
    size_t added;    /* where what was added begins */
    size_t size;     /* of all */
} layout;

/* --- JSON: members in their order, numbers as short as they can be read back */

typedef struct writer {
    FILE *to;
    bool lines;
    int depth;
} writer;

static void put_string(const writer *w, const char *string, size_t size) {
    size_t plain = 0; /* bytes that are not written yet */
    fputc('"', w->to);
    for (size_t i = 0; i < size; ++i) {
        const unsigned char byte = (unsigned char)string[i];
        if (byte < 0x20 || byte == '"' || byte == '\\') {
            fwrite(string + plain, 1, i - plain, w->to);
            fprintf(w->to, byte >= 0x20 ? "\\%c" : "\\u%04x", byte);
            plain = i + 1;
        }
    }
    fwrite(string + plain, 1, size - plain, w->to);
    fputc('"', w->to);
}

static void put_line(const writer *w) {
    if (w->lines) {
        fprintf(w->to, "\n%*s", 2 * w->depth, "");
    }
}

static void put_value(writer *w, const json_t *value);

static void put_object(writer *w, const json_t *object) {
    const char *name;
    json_t *member;
    bool first = true;
    fputc('{', w->to);
    ++w->depth;
    json_object_foreach((json_t *)(uintptr_t)object, name, member) {
        fputs(first ? "" : ",", w->to);
        first = false;
        put_line(w);
        put_string(w, name, strlen(name));
        fputs(w->lines ? ": " : ":", w->to);
        put_value(w, member);
    }
    --w->depth;
    if (!first) {
        put_line(w);
    }
    fputc('}', w->to);
}

/* Lists of numbers stay in one line. */
static void put_array(writer *w, const json_t *array) {
    size_t i;
    const json_t *item;
    const bool short_one =
        !json_is_object(json_array_get(array, 0)) && !json_is_array(json_array_get(array, 0));
    fputc('[', w->to);
    ++w->depth;
    json_array_foreach(array, i, item) {
        fputs(i == 0 ? "" : w->lines && short_one ? ", " : ",", w->to);
        if (!short_one) {
            put_line(w);
        }
        put_value(w, item);
    }
    --w->depth;
    if (!short_one) {
        put_line(w);
    }
    fputc(']', w->to);
}

static void put_value(writer *w, const json_t *value) {
    char number[VSHI_DECIMAL_ROOM];
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        put_object(w, value);
        break;
    case JSON_ARRAY:
        put_array(w, value);
        break;
    case JSON_STRING:
        put_string(w, json_string_value(value), json_string_length(value));
        break;
    case JSON_INTEGER:
        fprintf(w->to, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
        break;
    case JSON_REAL:
        fwrite(number, 1, (size_t)(vshi_decimal_write_double(number, json_real_value(value)) - number),
               w->to);
        break;
    default:
        fputs(json_is_true(value) ? "true" : json_is_false(value) ? "false" : "null", w->to);
        break;
    }
}

/* --- the buffers become one */

static bool has_bytes(const vshi_lit_document *document, size_t index) {
    const bool chunk = index == 0 && document->gltf.binary;
    return chunk || json_object_get(vshi_gltf_element(&document->gltf, "buffers", index), "uri") != NULL;
}

/* Bytes of a buffer in front of `offset` that are not written. */
static size_t dropped_before(const vshi_lit_document *document, size_t buffer, size_t offset) {
    size_t sum = 0;
    for (size_t i = 0; i < document->dropped_count; ++i) {
        const vshi_lit_range *range = &document->dropped[i];
        const size_t end = range->end < offset ? range->end : offset;
        sum += range->buffer == buffer && end > range->begin ? end - range->begin : 0;
    }
    return sum;
}

/* Finds the buffers' places, and reads those that have not been read. Free after a failure, too. Errors: as
 * vsh_model_read(). */
static vsh_result lay_out(vshi_lit_document *document, layout *l, vsh_error *error) {
    enum { ALIGNMENT = 8 };
    vshi_gltf *gltf = &document->gltf;
    VSHI_TRY(
        vshi_gltf_allocate(gltf, (void **)&l->offsets, gltf->buffer_count + 1, sizeof *l->offsets, error));
    VSHI_TRY(
        vshi_gltf_allocate(gltf, (void **)&l->numbers, gltf->buffer_count + 1, sizeof *l->numbers, error));
    for (size_t i = 0; i < gltf->buffer_count; ++i) {
        l->offsets[i] = SIZE_MAX;
        if (has_bytes(document, i)) {
            VSHI_TRY(vshi_gltf_load(gltf, i, error));
            l->offsets[i] = l->size;
            const size_t size = gltf->buffers[i].bytes.size;
            l->size += (size - dropped_before(document, i, size) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
        }
    }
    l->added = l->size;
    l->size += document->added.size;
    return VSH_OK;
}

static bool lies_in_added(const vshi_lit_document *document, size_t view) {
    return view >= document->first_view || (document->replaced != NULL && document->replaced[view]);
}

/* Whether a buffer without bytes is referred to still: not where all its views have been replaced. */
static bool is_needed(const vshi_lit_document *document, size_t buffer) {
    size_t i, of;
    const json_t *view;
    json_array_foreach(json_object_get(document->gltf.root, "bufferViews"), i, view) {
        if (!lies_in_added(document, i) && vshi_gltf_count(view, "buffer", SIZE_MAX, &of) && of == buffer) {
            return true;
        }
    }
    return document->dropped_count == 0;
}

/* The new list: one buffer of all bytes, which is the first that had any, and behind it those without.
 * Returns that one; NULL: there are no bytes. */
static json_t *list_buffers(vshi_lit_document *document, layout *l) {
    vshi_gltf *gltf = &document->gltf;
    json_t *list = json_array(), *old = json_object_get(gltf->root, "buffers"), *one = NULL;
    for (size_t i = 0; i < gltf->buffer_count && one == NULL; ++i) {
        one = l->offsets[i] != SIZE_MAX ? json_incref(json_array_get(old, i)) : NULL;
    }
    if (one != NULL || l->size > 0) {
        one = one != NULL ? one : json_object();
        vshi_lit_push(document, list, one);
    }
    for (size_t i = 0; i < gltf->buffer_count; ++i) {
        l->numbers[i] = l->offsets[i] != SIZE_MAX ? 0 : json_array_size(list);
        if (l->offsets[i] == SIZE_MAX && is_needed(document, i)) {
            vshi_lit_push(document, list, json_incref(json_array_get(old, i)));
        }
    }
    if (json_array_size(list) > 0) {
        vshi_lit_set(document, gltf->root, "buffers", list);
    } else {
        json_object_del(gltf->root, "buffers");
        json_decref(list);
    }
    return one;
}

/* Moves what a view (or an extension of it that names a buffer of its own) refers to. */
static vsh_result move_view(vshi_lit_document *document, const layout *l, json_t *view, vsh_error *error) {
    size_t buffer, offset;
    if (!vshi_gltf_count(view, "buffer", SIZE_MAX, &buffer) || buffer >= document->gltf.buffer_count ||
        !vshi_gltf_count(view, "byteOffset", 0, &offset)) {
        return vshi_gltf_fail(&document->gltf, error, "a buffer view refers to no buffer");
    }
    vshi_lit_set_number(document, view, "buffer", l->numbers[buffer]);
    const size_t base = l->offsets[buffer] != SIZE_MAX ? l->offsets[buffer] : 0;
    const size_t moved = base + offset - dropped_before(document, buffer, offset);
    if (moved != offset) {
        vshi_lit_set_number(document, view, "byteOffset", moved);
    }
    return VSH_OK;
}

static vsh_result move_views(vshi_lit_document *document, const layout *l, vsh_error *error) {
    size_t i;
    json_t *view;
    json_array_foreach(json_object_get(document->gltf.root, "bufferViews"), i, view) {
        if (lies_in_added(document, i)) {
            const size_t at = (size_t)json_integer_value(json_object_get(view, "byteOffset"));
            vshi_lit_set_number(document, view, "buffer", 0);
            vshi_lit_set_number(document, view, "byteOffset", at + l->added);
            continue;
        }
        VSHI_TRY(move_view(document, l, view, error));
        const char *name;
        json_t *extension;
        json_object_foreach(json_object_get(view, "extensions"), name, extension) {
            if (json_object_get(extension, "buffer") != NULL) {
                VSHI_TRY(move_view(document, l, extension, error));
            }
        }
    }
    return VSH_OK;
}

/* --- writing */

/* A file under way. Its stream keeps no failure to itself: the sink does. */
typedef struct output_file {
    char *path;
    vshi_output output;
    vshi_sink sink;
    uint64_t written; /* to the sink */
    uint64_t at;      /* bytes that put() has written */
    FILE *to;
} output_file;

static ssize_t write_to_sink(void *user, const char *bytes, size_t size) {
    output_file *file = user;
    vshi_sink_write(&file->sink, bytes, size, file->written);
    file->written += size;
    return (ssize_t)size;
}

static void put(output_file *file, const void *bytes, size_t size) {
    fwrite(bytes, 1, size, file->to);
    file->at += size;
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

static void put_buffers(output_file *file, const vshi_lit_document *document, const layout *l) {
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

/* glTF 2.0, 4.4. */
static vsh_result put_binary(output_file *file, const vshi_lit_document *document, const layout *l,
                             const char *json, size_t json_size, vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942 };
    const uint64_t text = ((uint64_t)json_size + 3) & ~UINT64_C(3),
                   bytes = ((uint64_t)l->size + 3) & ~UINT64_C(3);
    const uint64_t all = HEADER + CHUNK + text + (bytes > 0 ? CHUNK + bytes : 0);
    if (all > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: %llu bytes, but a GLB can have %u; a .gltf can have more", file->path,
                         (unsigned long long)all, UINT32_MAX);
    }
    put(file, "glTF", 4);
    put_number(file, 2);
    put_number(file, all);
    put_number(file, text);
    put_number(file, JSON_CHUNK);
    put(file, json, json_size);
    put_padding(file, HEADER + CHUNK + text, ' ');
    if (bytes > 0) {
        put_number(file, bytes);
        put_number(file, BINARY_CHUNK);
        put_buffers(file, document, l);
        put_padding(file, all, '\0');
    }
    return VSH_OK;
}

/* The JSON, of a glTF with lines and indents; of a GLB it is in memory first, as its size stands in front. */
static vsh_result put_document(const vshi_lit_work *work, output_file *file, const layout *l, bool binary,
                               vsh_error *error) {
    char *json = NULL;
    size_t size = 0;
    writer w = {.to = binary ? open_memstream(&json, &size) : file->to, .lines = !binary};
    if (w.to == NULL) {
        return vshi_lit_no_memory(&work->document, error);
    }
    put_value(&w, work->document.gltf.root);
    if (!binary) {
        fputc('\n', file->to);
        return VSH_OK;
    }
    const bool failed = ferror(w.to) != 0;
    const vsh_result result = fclose(w.to) != 0 || failed
                                  ? vshi_lit_no_memory(&work->document, error)
                                  : put_binary(file, &work->document, l, json, size, error);
    free(json);
    return result;
}

/* --- files */

typedef struct files {
    output_file *list; /* [named + 1]: what stands beside the document, and the document */
    size_t named;
} files;

/* The paths of all; `bin`: the name of the file of the buffer, or of an OBJ's materials; NULL: none. */
static vsh_result name_files(const vshi_lit_work *work, const vshi_lit_besides *besides, const char *bin,
                             files *all, vsh_error *error) {
    const size_t named = besides->count + (bin != NULL);
    all->list = calloc(named + 1, sizeof *all->list);
    if (all->list == NULL) {
        return vshi_lit_no_memory(&work->document, error);
    }
    all->named = named;
    for (size_t i = 0; i <= named; ++i) {
        const char *name = i < besides->count ? besides->list[i].name : bin;
        char **path = &all->list[i].path;
        *path = i < named ? vshi_path_beside(work->output, name, strlen(name)) : strdup(work->output);
        if (*path == NULL) {
            return vshi_lit_no_memory(&work->document, error);
        }
        VSHI_TRY(vshi_lit_check_replaced(&work->document, *path, error));
        if (i == besides->count && i < named && vshi_lit_is_obj(work->output)) {
            VSHI_TRY(vshi_lit_mtl_check(*path, error));
        }
    }
    return VSH_OK;
}

static void end_files(files *all) {
    for (size_t i = 0; all->list != NULL && i <= all->named; ++i) {
        vshi_output_abandon(&all->list[i].output);
        free(all->list[i].path);
    }
    free(all->list);
}

static vsh_result commit(files *all, vsh_error *error) {
    vshi_output **outputs = calloc(all->named + 1, sizeof *outputs);
    if (outputs == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory",
                         all->list[all->named].path);
    }
    for (size_t i = 0; i <= all->named; ++i) {
        outputs[i] = &all->list[i].output;
    }
    const vsh_result result = vshi_outputs_commit(outputs, all->named + 1, error);
    free(outputs);
    return result;
}

/* Writes file i: what stands beside the document, the MTL or the buffer (`bin`), or the document itself. */
static vsh_result put_file(const vshi_lit_work *work, const vshi_lit_besides *besides, const layout *l,
                           const char *bin, size_t i, output_file *file, vsh_error *error) {
    const bool obj = vshi_lit_is_obj(work->output);
    if (i < besides->count) {
        put(file, besides->list[i].bytes, besides->list[i].size);
    } else if (i == besides->count && bin != NULL && obj) {
        vshi_lit_put_mtl(work, besides, file->to);
    } else if (i == besides->count && bin != NULL) {
        put_buffers(file, &work->document, l);
    } else {
        return obj ? vshi_lit_put_obj(work, bin, file->to, error)
                   : put_document(work, file, l, bin == NULL, error);
    }
    return VSH_OK;
}

static vsh_result write_file(const vshi_lit_work *work, const vshi_lit_besides *besides, const layout *l,
                             const char *bin, size_t i, output_file *file, vsh_error *error) {
    static const cookie_io_functions_t functions = {.write = write_to_sink};
    VSHI_TRY(vshi_output_begin(&file->output, file->path, error));
    file->sink = vshi_sink_open(file->output.temporary);
    file->to = fopencookie(file, "w", functions);
    vsh_result result = file->to != NULL ? put_file(work, besides, l, bin, i, file, error)
                                         : vshi_lit_no_memory(&work->document, error);
    if (file->to != NULL) {
        fclose(file->to);
    }
    const int reason = vshi_sink_close(&file->sink);
    return result != VSH_OK || reason == 0 ? result
                                           : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s",
                                                       file->path, strerror(reason));
}

/* The document's buffers as one, in a file of the name *bin or (NULL) in the document. */
static vsh_result join(vshi_lit_work *work, const vshi_lit_besides *besides, layout *l, char **bin,
                       files *all, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    VSHI_TRY(lay_out(document, l, error));
    if (strcasecmp(vshi_path_ending(work->output), "glb") != 0 && l->size > 0) {
        VSHI_TRY(vshi_lit_beside_name(work, "", "bin", bin, error));
    }
    VSHI_TRY(name_files(work, besides, *bin, all, error)); /* by the names that the input has */
    json_t *one = list_buffers(document, l);
    VSHI_TRY(move_views(document, l, error));
    if (document->dropped_count > 0) { /* views of compressed bytes, perhaps the last */
        vshi_lit_drop_extension(document, "EXT_meshopt_compression");
        vshi_lit_drop_extension(document, "KHR_meshopt_compression");
    }
    if (one != NULL) {
        vshi_lit_set_number(document, one, "byteLength", l->size);
        json_object_del(one, "uri");
    }
    if (*bin != NULL) {
        vshi_lit_set(document, one, "uri", vshi_lit_uri(*bin));
    }
    return document->refused ? vshi_lit_no_memory(document, error) : VSH_OK;
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
    layout l = {.size = 0};
    char *bin = NULL;
    files all = {.list = NULL};
    vsh_result result;
    VSHI_TRY_DONE(vshi_lit_is_obj(work->output) ? name_obj(work, besides, &bin, &all, error)
                                                : join(work, besides, &l, &bin, &all, error));
    for (size_t i = 0; i <= all.named; ++i) {
        VSHI_TRY_DONE(write_file(work, besides, &l, bin, i, &all.list[i], error));
    }
    VSHI_TRY_DONE(vshi_job_cancelled(work->job) ? vshi_job_fail_cancelled(work->job, error)
                                                : commit(&all, error));
done:
    end_files(&all);
    free(bin);
    free(l.numbers);
    free(l.offsets);
    return result;
}
