/* A lit document, or an OBJ, written into its files. */
#define _GNU_SOURCE /* fopencookie */
#include "base/decimal.h"
#include "base/elementary.h"
#include "base/file.h"
#include "base/text.h"
#include "base/vec.h"
#include "io/lit/work.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* Bytes begin … end - 1 of a buffer, or of the added bytes, and their offset in the buffer that is written.
 */
typedef struct range {
    size_t buffer, begin, end, place;
} range;

typedef struct writing {
    vshi_lit_work *work;
    const vshi_lit_besides *besides;
    char *bin;              /* name of the file of the buffer, or of an OBJ's materials; NULL: none */
    vshi_lit_stream *files; /* [file_count]: those of `besides`, then `bin`, then the output */
    vshi_output **outputs;  /* [file_count]: of the files */
    char **paths;           /* [file_count] */
    size_t file_count;
    json_t **parts; /* [part_count]: buffer views, and extensions of them with a buffer of their own */
    size_t part_count;
    range *ranges; /* [range_count]: bytes of the buffer that is written */
    size_t range_count;
    size_t size; /* of that buffer */
} writing;

/* --- a file as a stream */

static ssize_t write_to_sink(void *user, const char *bytes, size_t size) {
    vshi_lit_stream *stream = user;
    vshi_sink_write(&stream->sink, bytes, size, stream->written);
    stream->written += size;
    return (ssize_t)size;
}

vsh_result vshi_lit_begin_stream(vshi_lit_stream *stream, const char *path, vsh_error *error) {
    stream->path = path;
    VSHI_TRY(vshi_output_begin(&stream->output, path, error));
    stream->sink = vshi_sink_open(stream->output.temporary);
    stream->to = fopencookie(stream, "w", (cookie_io_functions_t){.write = write_to_sink});
    if (stream->to == NULL) {
        vshi_sink_close(&stream->sink);
        vshi_output_abandon(&stream->output);
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    return VSH_OK;
}

vsh_result vshi_lit_end_stream(vshi_lit_stream *stream, vsh_result result, vsh_error *error) {
    fclose(stream->to);
    const int reason = vshi_sink_close(&stream->sink);
    return result != VSH_OK || reason == 0 ? result
                                           : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s",
                                                       stream->path, strerror(reason));
}

bool vshi_lit_is_obj(const char *path) {
    return strcasecmp(vshi_path_ending(path), "obj") == 0;
}

/* --- names of files beside the output */

bool vshi_lit_is_same_file(const char *a, const char *b) {
    struct stat one, other;
    return stat(a, &one) == 0 && stat(b, &other) == 0 && one.st_dev == other.st_dev &&
           one.st_ino == other.st_ino;
}

vsh_result vshi_lit_check_replaced(const vshi_lit_work *work, const char *path, vsh_error *error) {
    static const char *const lists[] = {"buffers", "images"};
    json_t *const own[] = {json_object_get(work->gltf.root, "buffers"), work->own_images};
    for (size_t k = 0; k < sizeof lists / sizeof lists[0] && work->text != NULL; ++k) {
        size_t i;
        const json_t *item;
        json_array_foreach(own[k], i, item) {
            const char *uri = json_string_value(json_object_get(item, "uri"));
            if (uri == NULL || vshi_uri_is_data(uri) || vshi_uri_is_remote(uri)) {
                continue;
            }
            char *given = vshi_uri_path(work->gltf.path, uri);
            if (given == NULL) {
                return vshi_fail_memory(error, work->gltf.path);
            }
            const bool same = vshi_lit_is_same_file(given, path);
            free(given);
            if (same) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: would replace %s[%zu] of %s", path, lists[k],
                                 i, work->gltf.path);
            }
        }
    }
    return VSH_OK;
}

/* A number of 0 is left out. */
static char *make_name(const char *output, const char *mark, const char *ending, unsigned number) {
    const char *name = vshi_path_name(output);
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

vsh_result vshi_lit_name_beside(const vshi_lit_work *work, const char *mark, const char *ending, char **name,
                                vsh_error *error) {
    enum { MOST = 100 };
    for (unsigned number = 0;; ++number) {
        *name = make_name(work->output, mark, ending, number);
        char *path = *name != NULL ? vshi_path_beside(work->output, *name, strlen(*name)) : NULL;
        if (path == NULL) {
            free(*name);
            *name = NULL;
            return vshi_fail_memory(error, work->gltf.path);
        }
        const vsh_result result = vshi_lit_check_replaced(work, path, error);
        free(path);
        if (result != VSH_ERROR_ARGUMENT || number == MOST) {
            return result;
        }
        free(*name);
    }
}

/* Percent-encodes all but unreserved characters (RFC 3986). */
json_t *vshi_lit_uri(const char *name) {
    char *text = malloc(3 * strlen(name) + 1), *to = text;
    if (text == NULL) {
        return NULL;
    }
    *to = '\0';
    for (const char *c = name; *c != '\0'; ++c) {
        const unsigned char byte = (unsigned char)*c;
        const bool plain = (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') ||
                           (byte >= '0' && byte <= '9') || strchr("-._~", byte) != NULL;
        to += sprintf(to, plain ? "%c" : "%%%02X", byte);
    }
    json_t *uri = json_string(text);
    free(text);
    return uri;
}

/* --- the buffers become one, of the bytes that buffer views have */

enum { ALIGNMENT = 8 }; /* of ranges, so that the alignment of accessors in them stays */

static bool has_bytes(const vshi_lit_work *work, size_t buffer) {
    return buffer == work->gltf.buffer_count || (buffer == 0 && work->gltf.binary) ||
           json_object_get(vshi_gltf_element(&work->gltf, "buffers", buffer), "uri") != NULL;
}

static vshi_gltf_bytes bytes_of(const vshi_lit_work *work, size_t buffer) {
    return buffer < work->gltf.buffer_count ? work->gltf.buffers[buffer].bytes
                                            : (vshi_gltf_bytes){work->added.list, work->added.count};
}

static vsh_result list_parts(writing *w, vsh_error *error) {
    vshi_gltf *gltf = &w->work->gltf;
    const json_t *views = json_object_get(gltf->root, "bufferViews");
    size_t most = 0, i;
    const char *name;
    json_t *view, *extension;
    json_array_foreach(views, i, view) {
        most += 1 + json_object_size(json_object_get(view, "extensions"));
    }
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&w->parts, most, sizeof(json_t *), error));
    json_array_foreach(views, i, view) {
        w->parts[w->part_count++] = view;
        json_object_foreach(json_object_get(view, "extensions"), name, extension) {
            if (json_object_get(extension, "buffer") != NULL) {
                w->parts[w->part_count++] = extension;
            }
        }
    }
    return VSH_OK;
}

/* Adds bytes of a buffer, as far as it has them. */
static void add_range(writing *w, size_t buffer, size_t offset, size_t length) {
    const size_t size = bytes_of(w->work, buffer).size;
    offset = offset < size ? offset : size;
    length = length < size - offset ? length : size - offset;
    const size_t end = (offset + length + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    w->ranges[w->range_count++] = (range){buffer, offset / ALIGNMENT * ALIGNMENT, end < size ? end : size, 0};
}

static int compare_ranges(const void *a, const void *b) {
    const range *x = a, *y = b;
    return x->buffer != y->buffer ? (x->buffer < y->buffer ? -1 : 1)
                                  : (x->begin > y->begin) - (x->begin < y->begin);
}

/* Joins ranges that touch, and finds their places. */
static void place_ranges(writing *w) {
    size_t count = 0;
    if (w->range_count > 1) {
        qsort(w->ranges, w->range_count, sizeof *w->ranges, compare_ranges);
    }
    for (size_t i = 0; i < w->range_count; ++i) {
        const range next = w->ranges[i];
        range *last = count > 0 ? &w->ranges[count - 1] : NULL;
        if (last != NULL && last->buffer == next.buffer && next.begin <= last->end) {
            last->end = next.end > last->end ? next.end : last->end;
        } else {
            w->ranges[count++] = next;
        }
    }
    w->range_count = count;
    for (size_t i = 0; i < count; ++i) {
        range *one = &w->ranges[i];
        one->place = w->size;
        w->size += (one->end - one->begin + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    }
}

/* Reads the buffers that have not been read, and finds the places of their bytes. Errors: as
 * vsh_model_read(). */
static vsh_result place_buffers(writing *w, vsh_error *error) {
    vshi_lit_work *work = w->work;
    vshi_gltf *gltf = &work->gltf;
    VSHI_TRY(list_parts(w, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&w->ranges, w->part_count + gltf->buffer_count + 1,
                                sizeof *w->ranges, error));
    for (size_t b = 0; b < gltf->buffer_count; ++b) {
        if (has_bytes(work, b)) {
            VSHI_TRY(vshi_gltf_load(gltf, b, error));
        }
    }
    for (size_t b = 0; b <= gltf->buffer_count && !work->pruned; ++b) {
        if (has_bytes(work, b)) {
            add_range(w, b, 0, bytes_of(work, b).size);
        }
    }
    for (size_t i = 0; i < w->part_count; ++i) {
        size_t buffer, offset, length;
        if (!vshi_gltf_count(w->parts[i], "buffer", SIZE_MAX, &buffer) || buffer > gltf->buffer_count ||
            !vshi_gltf_count(w->parts[i], "byteOffset", 0, &offset) ||
            !vshi_gltf_count(w->parts[i], "byteLength", 0, &length)) {
            return vshi_gltf_fail(gltf, error, "a buffer view refers to no buffer");
        }
        if (has_bytes(work, buffer)) {
            add_range(w, buffer, offset, length);
        }
    }
    place_ranges(w);
    return VSH_OK;
}

/* The range that begins last at or before an offset. */
static const range *find_range(const writing *w, size_t buffer, size_t offset) {
    const range wanted = {buffer, offset, 0, 0};
    size_t low = 0, high = w->range_count;
    while (low + 1 < high) {
        const size_t middle = low + (high - low) / 2;
        if (compare_ranges(&w->ranges[middle], &wanted) <= 0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return &w->ranges[low];
}

/* Sets the buffer and the offset of a view. numbers[buffer]: 1 + the new number of a buffer without bytes,
 * which is added to `list`; 0: not yet. */
static void move_part(const writing *w, json_t *part, size_t *numbers, json_t *list) {
    vshi_lit_work *work = w->work;
    size_t buffer = 0, offset = 0;
    vshi_gltf_count(part, "buffer", 0, &buffer);
    vshi_gltf_count(part, "byteOffset", 0, &offset);
    if (has_bytes(work, buffer)) {
        const range *in = find_range(w, buffer, offset);
        const size_t moved = in->place + (offset - in->begin);
        vshi_lit_set_number(work, part, "buffer", 0);
        if (moved != offset) {
            vshi_lit_set_number(work, part, "byteOffset", moved);
        }
        return;
    }
    if (numbers[buffer] == 0) {
        vshi_lit_push(work, list,
                      json_incref(json_array_get(json_object_get(work->gltf.root, "buffers"), buffer)));
        numbers[buffer] = json_array_size(list);
    }
    vshi_lit_set_number(work, part, "buffer", numbers[buffer] - 1);
}

/* Makes one buffer of all bytes, in the file w->bin or (NULL) in the document. That is the first buffer with
 * bytes, or a new one. Buffers without bytes (EXT_meshopt_compression's fallback) stay if views refer to
 * them. */
static vsh_result join_buffers(writing *w, vsh_error *error) {
    vshi_lit_work *work = w->work;
    vshi_gltf *gltf = &work->gltf;
    size_t *numbers;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&numbers, gltf->buffer_count + 1, sizeof *numbers, error));
    json_t *list = json_array(), *one = NULL;
    for (size_t b = 0; b < gltf->buffer_count && one == NULL; ++b) {
        one = has_bytes(work, b) ? json_incref(json_array_get(json_object_get(gltf->root, "buffers"), b))
                                 : NULL;
    }
    const bool any = one != NULL || w->size > 0;
    if (any) {
        one = one != NULL ? one : json_object();
        vshi_lit_push(work, list, one);
    }
    if (work->refused) { /* the list may not hold the buffer */
        json_decref(list);
        free(numbers);
        return vshi_fail_memory(error, work->gltf.path);
    }
    for (size_t i = 0; i < w->part_count; ++i) {
        move_part(w, w->parts[i], numbers, list);
    }
    free(numbers);
    if (any) {
        vshi_lit_set_number(work, one, "byteLength", w->size);
        json_object_del(one, "uri");
    }
    if (w->bin != NULL) {
        vshi_lit_set(work, one, "uri", vshi_lit_uri(w->bin));
    }
    if (json_array_size(list) > 0) {
        vshi_lit_set(work, gltf->root, "buffers", list);
    } else {
        json_object_del(gltf->root, "buffers");
        json_decref(list);
    }
    vshi_lit_drop_extension(work, "EXT_meshopt_compression");
    vshi_lit_drop_extension(work, "KHR_meshopt_compression");
    return work->refused ? vshi_fail_memory(error, work->gltf.path) : VSH_OK;
}

/* --- a glTF */

static void write_padding(FILE *to, uint64_t count, char with) {
    for (; count > 0; --count) {
        fputc(with, to);
    }
}

static void write_word(FILE *to, uint64_t number) {
    for (int shift = 0; shift < 32; shift += 8) {
        fputc((int)(number >> shift & 255), to);
    }
}

static void write_buffer(const writing *w, FILE *to) {
    size_t written = 0;
    for (size_t i = 0; i < w->range_count; ++i) {
        const range *one = &w->ranges[i];
        write_padding(to, one->place - written, '\0');
        if (one->begin < one->end) { /* an empty buffer has no bytes to point to */
            fwrite(bytes_of(w->work, one->buffer).at + one->begin, 1, one->end - one->begin, to);
        }
        written = one->place + (one->end - one->begin);
    }
    write_padding(to, w->size - written, '\0');
}

/* Writes a GLB (glTF 2.0, 4.4). */
static vsh_result write_chunks(const writing *w, const char *json, size_t json_size, FILE *to,
                               vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942 };
    const uint64_t text = ((uint64_t)json_size + 3) & ~UINT64_C(3),
                   bytes = ((uint64_t)w->size + 3) & ~UINT64_C(3);
    const uint64_t all = HEADER + CHUNK + text + (bytes > 0 ? CHUNK + bytes : 0);
    if (all > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: %llu bytes, but a GLB can have %u; a .gltf can have more", w->work->output,
                         (unsigned long long)all, UINT32_MAX);
    }
    fputs("glTF", to);
    write_word(to, 2);
    write_word(to, all);
    write_word(to, text);
    write_word(to, JSON_CHUNK);
    fwrite(json, 1, json_size, to);
    write_padding(to, text - json_size, ' ');
    if (bytes > 0) {
        write_word(to, bytes);
        write_word(to, BINARY_CHUNK);
        write_buffer(w, to);
        write_padding(to, bytes - w->size, '\0');
    }
    return VSH_OK;
}

/* A json_dump_callback_t. The stream keeps failures: json_dumps() of Jansson 2.14 drops keys without memory.
 */
static int write_text(const char *text, size_t size, void *user) {
    fwrite(text, 1, size, user);
    return 0;
}

/* Writes the JSON, with lines and indents, or a GLB with the JSON first, whose size precedes it. */
static vsh_result write_document(const writing *w, bool binary, FILE *to, vsh_error *error) {
    char *json = NULL;
    size_t size = 0;
    FILE *text = binary ? open_memstream(&json, &size) : to;
    if (text == NULL) {
        return vshi_fail_memory(error, w->work->gltf.path);
    }
    bool failed =
        json_dump_callback(w->work->gltf.root, write_text, text, binary ? JSON_COMPACT : JSON_INDENT(2)) != 0;
    if (!binary) {
        fputc('\n', to);
        return failed ? vshi_fail_memory(error, w->work->gltf.path) : VSH_OK;
    }
    failed = failed || ferror(text) != 0;
    const vsh_result result = fclose(text) != 0 || failed ? vshi_fail_memory(error, w->work->gltf.path)
                                                          : write_chunks(w, json, size, to, error);
    free(json);
    return result;
}

vsh_result vshi_lit_write_model(const vsh_model *model, const char *path, const vsh_run *run, vshi_job *job,
                                FILE *to, vsh_error *error) {
    vshi_lit_work work = {.model = model, .output = path, .gltf = {.path = path, .run = run, .job = job}};
    writing w = {.work = &work};
    vsh_result result;
    VSHI_TRY_DONE(vshi_lit_begin(&work, error));
    VSHI_TRY_DONE(vshi_lit_from_model(&work, error));
    VSHI_TRY_DONE(place_buffers(&w, error));
    VSHI_TRY_DONE(join_buffers(&w, error));
    result = write_document(&w, true, to, error);
done:
    free(w.ranges);
    free(w.parts);
    vshi_lit_work_free(&work);
    return result;
}

/* --- an OBJ, with its materials in a file beside it */

static const char FIRST_LINE[] = "# vdbshade ";

/* Blanks and control characters become "_". */
static void write_name(FILE *to, const char *keyword, const char *name) {
    fprintf(to, "%s ", keyword);
    for (; *name != '\0'; ++name) {
        fputc((unsigned char)*name <= ' ' || *name == 0x7f ? '_' : *name, to);
    }
    fputc('\n', to);
}

/* Writes the material of a page, by its name or number. */
static void write_page(FILE *to, const vshi_lit_work *work, const char *keyword, size_t page) {
    const vsh_lit_options *options = work->options;
    const char *name = page < options->page_count ? options->page_names[page] : NULL;
    if (name != NULL) {
        write_name(to, keyword, name);
    } else {
        fprintf(to, "%s page_%zu\n", keyword, page);
    }
}

/* A mesh with its lightmap UVs, and the numbers of its first vertices: OBJ counts over the whole file. */
typedef struct obj_mesh {
    vsh_mesh mesh;
    const vsh_lit_mesh *lit;
    const float *uvs;                  /* NULL: unlit */
    const uint32_t *indices, *sources; /* sources NULL: vertices are the mesh's own */
    size_t uv_count;
    uint64_t first_position, first_uv, first_normal;
} obj_mesh;

static void open_mesh(const vshi_lit_work *work, size_t index, obj_mesh *m) {
    const vsh_lit_mesh *lit = m->lit = &work->meshes[index];
    const bool made = lit->uvs != NULL, colored = lit->colors != NULL; /* keeps the UVs of textures */
    m->mesh = vsh_model_mesh(work->model, index, made || colored ? 0 : lit->uv_set);
    m->uvs = made ? lit->uvs : colored || lit->uv_set >= 0 ? m->mesh.uvs : NULL;
    m->indices = made ? lit->indices : m->mesh.indices;
    m->sources = made ? lit->sources : NULL;
    m->uv_count = made ? lit->vertex_count : m->uvs != NULL ? m->mesh.vertex_count : 0;
}

/* `same_object`: the mesh before belongs to the same object. */
static void write_names(FILE *to, const vsh_mesh *mesh, bool same_object, size_t index) {
    const char *name = mesh->name != NULL && mesh->name[0] != '\0' ? mesh->name : NULL;
    const char *object = mesh->object_name != NULL && mesh->object_name[0] != '\0' ? mesh->object_name : name;
    if (object == NULL) {
        fprintf(to, "o mesh_%zu\n", index);
        return;
    }
    if (!same_object) {
        write_name(to, "o", object);
    }
    if (name != NULL && strcmp(name, object) != 0) {
        write_name(to, "g", name);
    }
}

static void write_vertices(FILE *to, const obj_mesh *m) {
    const vsh_mesh *mesh = &m->mesh;
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec at = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
        const uint16_t *color = m->lit->colors != NULL ? m->lit->colors + 4 * v : NULL;
        fprintf(to, "v %.9g %.9g %.9g", at.x, at.y, at.z);
        for (int c = 0; color != NULL && c < 3; ++c) { /* sRGB, which Blender and MeshLab expect */
            fprintf(to, " %.5g", vshi_to_srgb(color[c] / 65535.0));
        }
        fputc('\n', to);
    }
    for (size_t v = 0; v < m->uv_count; ++v) {
        fprintf(to, "vt %.9g %.9g\n", (double)m->uvs[2 * v], (double)m->uvs[2 * v + 1]);
    }
    for (size_t v = 0; mesh->normals != NULL && v < mesh->vertex_count; ++v) {
        const vshi_vec n =
            vshi_unit(vshi_transform_normal(mesh->transform, vshi_vec_off(mesh->normals + 3 * v)));
        fprintf(to, "vn %.6g %.6g %.6g\n", n.x, n.y, n.z);
    }
}

static void write_face(FILE *to, const obj_mesh *m, size_t triangle) {
    const bool mirrored = vshi_transform_determinant(m->mesh.transform) < 0.0; /* faces look outwards */
    fprintf(to, "f");
    for (size_t i = 0; i < 3; ++i) {
        const uint32_t v = m->indices[3 * triangle + (mirrored ? 2 - i : i)];
        const uint64_t source = m->sources != NULL ? m->sources[v] : v;
        fprintf(to, " %" PRIu64, m->first_position + source);
        if (m->uvs != NULL) {
            fprintf(to, "/%" PRIu64, m->first_uv + v);
        }
        if (m->mesh.normals != NULL) {
            fprintf(to, m->uvs != NULL ? "/%" PRIu64 : "//%" PRIu64, m->first_normal + source);
        }
    }
    fprintf(to, "\n");
}

/* With `paged`, names the material of each page. Triangles without a place show the first page. */
static void write_faces(FILE *to, const vshi_lit_work *work, const obj_mesh *m, bool paged) {
    const bool shown = m->uvs != NULL;
    uint32_t page = UINT32_MAX;
    if (paged && !shown) {
        fprintf(to, "usemtl unlit\n");
    }
    for (size_t i = 0; i < m->mesh.triangle_count; ++i) {
        const uint32_t found = shown ? vshi_page_of_triangle(work, m->lit, i) : 0;
        const uint32_t own = found != VSH_NO_CHART ? found : 0;
        if (paged && shown && own != page) {
            write_page(to, work, "usemtl", own);
            page = own;
        }
        write_face(to, m, i);
    }
}

/* Writes the model's meshes in the world. `mtl`: name of the MTL file, or NULL. */
static vsh_result write_obj(const vshi_lit_work *work, const char *mtl, FILE *to, vsh_error *error) {
    VSHI_NUMBERS;
    obj_mesh m = {.first_position = 1, .first_uv = 1, .first_normal = 1};
    fprintf(to, "%s%s\n", FIRST_LINE, VSHI_VERSION);
    for (size_t i = 0; i < work->options->attribute_count; ++i) {
        const vsh_attribute *one = &work->options->attributes[i];
        fprintf(to, "# %s: %s\n", one->name, one->value);
    }
    if (mtl != NULL) {
        fprintf(to, "mtllib %s\n", mtl);
    }
    for (size_t i = 0; i < vsh_model_mesh_count(work->model); ++i) {
        VSHI_TRY(vshi_job_step(work->gltf.job, 1, error));
        const uint32_t object = m.mesh.object;
        open_mesh(work, i, &m);
        write_names(to, &m.mesh, object != 0 && object == m.mesh.object, i);
        write_vertices(to, &m);
        write_faces(to, work, &m, mtl != NULL || work->page_count > 1);
        m.first_position += m.mesh.vertex_count;
        m.first_uv += m.uv_count;
        m.first_normal += m.mesh.normals != NULL ? m.mesh.vertex_count : 0;
    }
    return VSH_OK;
}

static void write_material(FILE *to, const char *image) {
    fprintf(to, "Ka 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\n");
    if (image != NULL) {
        fprintf(to, "map_Ka %s\nmap_Kd %s\n", image, image);
    }
}

/* Writes the materials of an OBJ: a white one for each page, with the page's image. */
static void write_mtl(const vshi_lit_work *work, const vshi_lit_besides *besides, FILE *to) {
    fprintf(to, "%s%s\n", FIRST_LINE, VSHI_VERSION);
    for (size_t page = 0; page < work->page_count; ++page) {
        const char *image = NULL;
        for (size_t i = 0; i < besides->count; ++i) { /* in the order of the images */
            image = work->options->images[i].page == page ? besides->list[i].name : image;
        }
        write_page(to, work, "newmtl", page);
        write_material(to, image);
    }
    bool unlit = false;
    for (size_t i = 0; i < vsh_model_mesh_count(work->model) && !unlit; ++i) {
        unlit = work->meshes[i].uvs == NULL && work->meshes[i].uv_set < 0;
    }
    if (unlit) {
        fprintf(to, "newmtl unlit\n");
        write_material(to, NULL);
    }
}

/* Fails if the file exists and vdbshade did not write it. */
static vsh_result check_mtl(const char *path, vsh_error *error) {
    char begins[sizeof FIRST_LINE] = "";
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return VSH_OK;
    }
    const size_t count = fread(begins, 1, sizeof begins - 1, file);
    fclose(file);
    return count == 0 || strcmp(begins, FIRST_LINE) == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT,
                           "%s: it exists, and vdbshade did not write it: give the OBJ another name", path);
}

/* --- files */

/* Finds the paths of all files, and checks that all of them may be written. */
static vsh_result name_files(writing *w, vsh_error *error) {
    const size_t named = w->besides->count + (w->bin != NULL);
    const vshi_array arrays[] = {VSHI_ARRAY(w->files, named + 1), VSHI_ARRAY(w->outputs, named + 1),
                                 VSHI_ARRAY(w->paths, named + 1)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, w->work->output, error));
    w->file_count = named + 1;
    for (size_t i = 0; i < w->file_count; ++i) {
        const char *name = i < w->besides->count ? w->besides->list[i].name : w->bin;
        char *path =
            i < named ? vshi_path_beside(w->work->output, name, strlen(name)) : strdup(w->work->output);
        w->paths[i] = path;
        w->outputs[i] = &w->files[i].output;
        if (path == NULL) {
            return vshi_fail_memory(error, w->work->gltf.path);
        }
        VSHI_TRY(vshi_lit_check_replaced(w->work, path, error));
        if (i == w->besides->count && i < named && vshi_lit_is_obj(w->work->output)) {
            VSHI_TRY(check_mtl(path, error));
        }
    }
    return VSH_OK;
}

static vsh_result write_content(const writing *w, size_t i, FILE *to, vsh_error *error) {
    const bool obj = vshi_lit_is_obj(w->work->output);
    if (i < w->besides->count) {
        fwrite(w->besides->list[i].bytes, 1, w->besides->list[i].size, to);
    } else if (i + 1 == w->file_count) {
        return obj ? write_obj(w->work, w->bin, to, error) : write_document(w, w->bin == NULL, to, error);
    } else if (obj) {
        write_mtl(w->work, w->besides, to);
    } else {
        write_buffer(w, to);
    }
    return VSH_OK;
}

vsh_result vshi_lit_write_files(vshi_lit_work *work, const vshi_lit_besides *besides, vsh_error *error) {
    writing w = {.work = work, .besides = besides};
    const bool obj = vshi_lit_is_obj(work->output),
               glb = strcasecmp(vshi_path_ending(work->output), "glb") == 0;
    vsh_result result;
    if (!obj) {
        VSHI_TRY_DONE(place_buffers(&w, error));
    }
    if (obj ? besides->count > 0 : !glb && w.size > 0) {
        VSHI_TRY_DONE(vshi_lit_name_beside(work, "", obj ? "mtl" : "bin", &w.bin, error));
    }
    VSHI_TRY_DONE(name_files(&w, error)); /* needs the input's names of its buffers */
    if (!obj) {
        VSHI_TRY_DONE(join_buffers(&w, error));
    }
    for (size_t i = 0; i < w.file_count; ++i) {
        vshi_lit_stream *file = &w.files[i];
        VSHI_TRY_DONE(vshi_lit_begin_stream(file, w.paths[i], error));
        VSHI_TRY_DONE(vshi_lit_end_stream(file, write_content(&w, i, file->to, error), error));
    }
    VSHI_TRY_DONE(vshi_job_check(work->gltf.job, error));
    result = vshi_outputs_commit(w.outputs, w.file_count, error);
done:
    for (size_t i = 0; i < w.file_count; ++i) {
        vshi_output_abandon(&w.files[i].output);
        free(w.paths[i]);
    }
    free(w.files);
    free(w.bin);
    free(w.ranges);
    free(w.parts);
    return result;
}
