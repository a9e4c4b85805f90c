/* A page from its head to its end. Its head allows only the scripts in the page, by their hashes: no
 * requests, and no scripts from the names or contents of files. */
#define _GNU_SOURCE /* fopencookie */
#include "view/page.h"

#include "base/elementary.h"
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/text.h"
#include "io/image/image.h"
#include "io/lit/work.h"

#include <Imath/half.h>
#include <jansson.h>
#include <math.h>
#include <nettle/base64.h>
#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <vdbshade/image.h>
#include <zlib.h>

typedef struct page {
    const char *path;
    const vsh_run *run; /* resolved */
    vshi_lit_stream file;
    FILE *to;       /* into it */
    size_t blocks;  /* of data, so far */
    char block[32]; /* id of the last one, by which the page's script finds it */
    uint64_t block_bytes;
    struct base64_encode_ctx base64;
    json_t *about; /* array: the description of each bake */
    bool refused;  /* memory for the JSON was refused */
} page;

/* --- blocks of data, as base64 */

static void begin_block(page *p) {
    snprintf(p->block, sizeof p->block, "data%zu", p->blocks++);
    fprintf(p->to, "<script type=\"application/octet-stream\" id=\"%s\">", p->block);
    base64_encode_init(&p->base64);
    p->block_bytes = 0;
}

static void write_data(page *p, const void *bytes, size_t count) {
    enum { PIECE = 3 << 12 };
    char letters[BASE64_ENCODE_LENGTH(PIECE)];
    const uint8_t *from = bytes;
    p->block_bytes += count;
    for (size_t now; count > 0; from += now, count -= now) {
        now = count < PIECE ? count : PIECE;
        fwrite(letters, 1, base64_encode_update(&p->base64, letters, now, from), p->to);
    }
}

static void end_block(page *p) {
    char letters[BASE64_ENCODE_FINAL_LENGTH];
    fwrite(letters, 1, base64_encode_final(&p->base64, letters), p->to);
    fputs("</script>\n", p->to);
}

/* --- the description */

/* Sets a member of an object or, with key NULL, appends to an array. Without memory it sets p->refused. */
static void describe(page *p, json_t *about, const char *key, json_t *value) {
    p->refused |=
        (key != NULL ? json_object_set_new(about, key, value) : json_array_append_new(about, value)) != 0;
}

/* --- progress: a job for each file in the page */

/* Advances a job, unless an earlier write failed. */
static vsh_result advance(const page *p, vshi_job *job, size_t units, vsh_error *error) {
    const int reason = p->file.sink.error;
    if (reason != 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", p->path, strerror(reason));
    }
    return vshi_job_step(job, units, error);
}

/* --- a model: the file itself if the page's script can read it, else its triangles as a GLB */

static ssize_t write_to_block(void *user, const char *bytes, size_t size) {
    write_data(user, bytes, size);
    return (ssize_t)size;
}

static vsh_result add_triangles(page *p, const char *path, const vsh_model *model, json_t *about,
                                vsh_error *error) {
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, p->run, "page", vsh_model_mesh_count(model), p->path, error));
    begin_block(p);
    FILE *to = fopencookie(p, "w", (cookie_io_functions_t){.write = write_to_block});
    vsh_result result = to != NULL ? vshi_lit_write_model(model, path, p->run, job, to, error)
                                   : vshi_fail_memory(error, p->path);
    if (to != NULL) {
        fclose(to);
    }
    end_block(p);
    describe(p, about, "model", json_string(p->block));
    if (result == VSH_OK && p->block_bytes > VSH_MAX_VIEW_MODEL) {
        result = vshi_fail(error, VSH_ERROR_LIMIT,
                           "%s: takes %llu bytes in the page, which holds models of %d at most", path,
                           (unsigned long long)p->block_bytes, VSH_MAX_VIEW_MODEL);
    }
    vshi_job_end(job);
    return result;
}

static bool uses_extension(const json_t *root, const char *extension) {
    size_t i;
    const json_t *used;
    json_array_foreach(json_object_get(root, "extensionsUsed"), i, used) {
        const char *name = json_string_value(used);
        if (name != NULL && strcmp(name, extension) == 0) {
            return true;
        }
    }
    return false;
}

/* Whether geometry is compressed, which the script does not read. A lit file keeps its light: the script then
 * leaves out the compressed rest. */
static bool is_compressed(const json_t *root) {
    return (uses_extension(root, "KHR_draco_mesh_compression") ||
            uses_extension(root, "EXT_meshopt_compression") ||
            uses_extension(root, "KHR_meshopt_compression")) &&
           !uses_extension(root, "MOZ_lightmap");
}

/* Adds the bytes of a file as a block. */
static vsh_result add_file(page *p, vshi_job *job, const void *bytes, size_t size, vsh_error *error) {
    enum { PIECE = 1 << 20 };
    begin_block(p);
    for (size_t at = 0, now; at < size; at += now) {
        now = size - at < PIECE ? size - at : PIECE;
        write_data(p, (const char *)bytes + at, now);
        VSHI_TRY(advance(p, job, now, error));
    }
    end_block(p);
    return VSH_OK;
}

/* Fails if a file cannot be read, or is larger than a page can hold. */
static vsh_result check_file(const char *path, vsh_error *error) {
    FILE *file;
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, VSH_MAX_VIEW_MODEL, &file, &size, error));
    fclose(file);
    return VSH_OK;
}

/* Adds a file that a glTF names. Warns if that cannot be read. */
static vsh_result add_named(page *p, vshi_gltf *gltf, const char *uri, json_t *files, vsh_error *error) {
    char *path = vshi_uri_path(gltf->path, uri);
    const double held = gltf->bytes_held;
    unsigned char *bytes = NULL;
    size_t size;
    vsh_error why;
    vsh_result result = VSH_OK;
    if (path == NULL) {
        return vshi_fail_memory(error, p->path);
    }
    if (!p->run->allow_outside && !vshi_input_is_beside(gltf->path, path)) {
        vshi_warn(p->run, "%s: '%s' is outside of its folder and not in the page; --allow-outside reads it",
                  gltf->path, uri);
    } else if (check_file(path, &why) != VSH_OK ||
               vshi_gltf_read_file(gltf, path, path, &bytes, &size, &why) != VSH_OK) {
        vshi_warn(p->run, "%s: is not in the page: %s", gltf->path, why.message);
    } else {
        result = add_file(p, gltf->job, bytes, size, error);
        describe(p, files, NULL, json_pack("{s:o, s:s}", "uri", vshi_lit_text(uri), "data", p->block));
    }
    gltf->bytes_held = held;
    free(bytes);
    free(path);
    return result;
}

static vsh_result add_gltf(page *p, const char *path, const vsh_model *model, json_t *about,
                           vsh_error *error) {
    static const char *const lists[] = {"buffers", "images"};
    vshi_lit_work work = {.gltf = {.path = path, .run = p->run}};
    json_t *files = json_array();
    size_t size;
    vsh_result result;
    VSHI_TRY_DONE(check_file(path, error));
    VSHI_TRY_DONE(vshi_lit_read(&work, &size, error));
    if (is_compressed(work.gltf.root)) {
        result = add_triangles(p, path, model, about, error);
        goto done;
    }
    VSHI_TRY_DONE(vshi_job_open(&work.gltf.job, p->run, "page", size, p->path, error));
    VSHI_TRY_DONE(add_file(p, work.gltf.job, work.text, size, error));
    describe(p, about, "model", json_string(p->block));
    for (size_t k = 0; k < sizeof lists / sizeof lists[0]; ++k) {
        size_t i;
        const json_t *item;
        json_array_foreach(json_object_get(work.gltf.root, lists[k]), i, item) {
            const char *uri = json_string_value(json_object_get(item, "uri"));
            if (uri != NULL && !vshi_uri_is_data(uri) && !vshi_uri_is_remote(uri)) {
                VSHI_TRY_DONE(add_named(p, &work.gltf, uri, files, error));
            }
        }
    }
    describe(p, about, "files", json_incref(files));
done:
    vshi_job_end(work.gltf.job);
    vshi_lit_work_free(&work);
    json_decref(files);
    return result;
}

static vsh_result add_model(page *p, const char *path, json_t *about, vsh_error *error) {
    vsh_model *model = NULL;
    VSHI_TRY(vsh_model_read(path, p->run, &model, error));
    const vsh_result result = vshi_is_gltf(path) ? add_gltf(p, path, model, about, error)
                                                 : add_triangles(p, path, model, about, error);
    vsh_model_free(model);
    return result;
}

/* --- planes of a bake: halves, all high bytes before all low ones. Each byte is stored as its difference
 * from its left neighbour, and all are deflated */

/* Writes the two planes of bytes of a channel. `srgb`: its values are made linear. */
static void split_bytes(const float *values, int32_t width, int32_t height, bool srgb, uint8_t *bytes) {
    static const float MOST = 65504.0f; /* the largest half */
    uint8_t *high = bytes, *low = bytes + (size_t)width * (size_t)height;
    for (int32_t y = 0; y < height; ++y) {
        unsigned last_high = 0, last_low = 0;
        for (int32_t x = 0; x < width; ++x) {
            const float given = *values++, value = srgb ? (float)vshi_from_srgb(given) : given;
            const unsigned half =
                imath_float_to_half(isnan(value) ? value : fminf(fmaxf(value, -MOST), MOST));
            *high++ = (uint8_t)((half >> 8) - last_high);
            *low++ = (uint8_t)((half & 255u) - last_low);
            last_high = half >> 8;
            last_low = half & 255u;
        }
    }
}

/* An image, and the attributes of its file. */
typedef struct source {
    const char *name;
    vsh_image image;
    const vsh_attribute *attributes;
    size_t attribute_count;
} source;

static bool has_attribute(const source *from, const char *name, const char *value) {
    for (size_t i = 0; i < from->attribute_count; ++i) {
        const vsh_attribute *one = &from->attributes[i];
        if (strcmp(one->name, name) == 0 && (value == NULL || strcmp(one->value, value) == 0)) {
            return true;
        }
    }
    return false;
}

static vsh_result add_channels(page *p, const source *from, json_t *channels, vsh_error *error) {
    const vsh_image *image = &from->image;
    const size_t size = 2 * (size_t)image->width * (size_t)image->height, room = compressBound(size);
    const bool made_of_others = has_attribute(from, VSH_IMAGE_RGB, NULL);
    const bool srgb = has_attribute(from, "vdbshade_color_space", "sRGB");
    uint8_t *bytes, *packed;
    const vshi_array arrays[] = {VSHI_ARRAY(bytes, size), VSHI_ARRAY(packed, room)};
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, from->name, error));
    VSHI_TRY_DONE(vshi_job_open(&job, p->run, "page", (size_t)image->channel_count, p->path, error));
    for (int32_t c = 0; c < image->channel_count; ++c) {
        const char *name = image->names[c];
        const bool picture = strlen(name) == 1 && strchr("RGB", name[0]) != NULL;
        if (!picture || !made_of_others) {
            uLongf packed_size = room;
            split_bytes(image->planes[c], image->width, image->height, picture && srgb, bytes);
            const bool done = compress(packed, &packed_size, bytes, size) == Z_OK;
            VSHI_TRY_DONE(done ? VSH_OK : vshi_fail_memory(error, p->path));
            begin_block(p);
            write_data(p, packed, packed_size);
            end_block(p);
            describe(p, channels, NULL,
                     json_pack("{s:o, s:s}", "name", vshi_lit_text(name), "data", p->block));
        }
        VSHI_TRY_DONE(advance(p, job, 1, error));
    }
done:
    vshi_job_end(job);
    free(bytes);
    return result;
}

/* Adds the planes of an image. `held`: bytes that it takes already. */
static vsh_result add_image(page *p, const source *from, double held, json_t *pages, vsh_error *error) {
    const vsh_image *image = &from->image;
    json_t *channels = json_array(), *attributes = json_array();
    const double texels = (double)image->width * (double)image->height;
    VSHI_TRY(vshi_check_limit(p->run, held + 4.0 * texels, from->name, error));
    describe(p, pages, NULL,
             json_pack("{s:o, s:i, s:i, s:o, s:o}", "name", vshi_lit_text(from->name), "width", image->width,
                       "height", image->height, "channels", channels, "attributes", attributes));
    for (size_t i = 0; i < from->attribute_count && !p->refused; ++i) {
        describe(p, attributes, NULL,
                 json_pack("[o, o]", vshi_lit_text(from->attributes[i].name),
                           vshi_lit_text(from->attributes[i].value)));
    }
    return p->refused ? vshi_fail_memory(error, p->path) : add_channels(p, from, channels, error);
}

static vsh_result add_image_file(page *p, const char *path, json_t *pages, vsh_error *error) {
    vsh_image_file *file = NULL;
    VSHI_TRY(vsh_image_read(path, p->run, &file, error));
    source from = {.name = vshi_path_name(path), .image = vsh_image_view(file)};
    from.attributes = vsh_image_attributes(file, &from.attribute_count);
    const double held =
        4.0 * (double)from.image.width * (double)from.image.height * (double)from.image.channel_count;
    const vsh_result result = add_image(p, &from, held, pages, error);
    vsh_image_free(file);
    return result;
}

/* --- the page */

/* Adds a bake, or the surface if that is not NULL. */
static vsh_result add_bake(page *p, const vsh_view_bake *bake, const vshi_view_surface *surface,
                           vsh_error *error) {
    json_t *about = json_object(), *pages = json_array();
    const char *name = surface != NULL       ? surface->name
                       : bake->name != NULL  ? bake->name
                       : bake->model != NULL ? vshi_path_name(bake->model)
                                             : vshi_path_name(bake->planes[0]);
    describe(p, p->about, NULL, about);
    describe(p, about, "name", vshi_lit_text(name));
    describe(p, about, "uvSet", json_integer(surface != NULL ? -1 : bake->uv_set));
    describe(p, about, "pages", pages);
    if (p->refused) {
        return vshi_fail_memory(error, p->path);
    }
    if (surface != NULL) {
        const source from = {.name = name, .image = *surface->image};
        describe(p, about, "perVertex", json_true());
        VSHI_TRY(add_triangles(p, name, surface->model, about, error));
        return add_image(p, &from, 0.0, pages, error);
    }
    if (bake->model != NULL) {
        VSHI_TRY(add_model(p, bake->model, about, error));
    }
    for (size_t i = 0; i < bake->plane_count; ++i) {
        VSHI_TRY(add_image_file(p, bake->planes[i], pages, error));
    }
    return VSH_OK;
}

/* Writes the source by which Content-Security-Policy (W3C, level 2) knows a script or style: 'sha256-…'. */
static void write_source(page *p, const vshi_embedded *embedded) {
    uint8_t digest[SHA256_DIGEST_SIZE];
    char letters[BASE64_ENCODE_RAW_LENGTH(SHA256_DIGEST_SIZE)];
    struct sha256_ctx context;
    sha256_init(&context);
    sha256_update(&context, embedded->size, embedded->bytes);
    sha256_digest(&context, sizeof digest, digest);
    base64_encode_raw(letters, sizeof digest, digest);
    fprintf(p->to, " 'sha256-%.*s'", (int)sizeof letters, letters);
}

static void write_embedded(page *p, const vshi_embedded *embedded) {
    fwrite(embedded->bytes, 1, embedded->size, p->to);
}

static void write_head(page *p) {
    fputs("<!doctype html>\n<html lang=\"en\" data-state=\"loading\"><head><meta charset=\"utf-8\">\n"
          "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; base-uri 'none'; "
          "form-action 'none'; script-src",
          p->to);
    for (const vshi_embedded *script = vshi_view_scripts; script->size > 0; ++script) {
        write_source(p, script);
    }
    fputs("; style-src", p->to);
    write_source(p, &vshi_view_style);
    fputs("\">\n<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
          "<meta name=\"generator\" content=\"vdbshade " VSHI_VERSION "\">\n<title>vdbshade</title>\n<style>",
          p->to);
    write_embedded(p, &vshi_view_style);
    fputs("</style></head>\n<body>\n", p->to);
    write_embedded(p, &vshi_view_body);
}

/* A json_dump_callback_t. Escapes < > &, which in JSON only occur within strings, so that HTML reads no
 * tags. */
static int write_escaped(const char *text, size_t size, void *user) {
    page *p = user;
    for (size_t i = 0; i < size; ++i) {
        fprintf(p->to, text[i] == '<' || text[i] == '>' || text[i] == '&' ? "\\u%04x" : "%c",
                (unsigned char)text[i]);
    }
    return 0;
}

static vsh_result write_scripts(page *p, vsh_error *error) {
    fputs("<script type=\"application/json\" id=\"about\">", p->to);
    if (p->refused || json_dump_callback(p->about, write_escaped, p, JSON_COMPACT) != 0) {
        return vshi_fail_memory(error, p->path);
    }
    fputs("</script>\n", p->to);
    for (const vshi_embedded *script = vshi_view_scripts; script->size > 0; ++script) {
        fputs("<script>", p->to);
        write_embedded(p, script);
        fputs("</script>\n", p->to);
    }
    fputs("</body></html>\n", p->to);
    return VSH_OK;
}

vsh_result vshi_view_write_page(const char *path, const vsh_view_bake *bakes, size_t count,
                                const vshi_view_surface *surface, const vsh_run *run, vsh_error *error) {
    page p = {.path = path, .run = run};
    VSHI_TRY(vshi_lit_begin_stream(&p.file, path, error));
    p.to = p.file.to;
    p.about = json_array();
    vsh_result result;
    VSHI_TRY_DONE(p.about != NULL ? VSH_OK : vshi_fail_memory(error, p.path));
    write_head(&p);
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(add_bake(&p, &bakes[i], NULL, error));
    }
    if (surface != NULL) {
        VSHI_TRY_DONE(add_bake(&p, NULL, surface, error));
    }
    result = write_scripts(&p, error);
done:
    json_decref(p.about);
    if (vshi_lit_end_stream(&p.file, result, error) != VSH_OK) {
        vshi_output_abandon(&p.file.output);
        return result != VSH_OK ? result : VSH_ERROR_WRITE;
    }
    return vshi_output_commit(&p.file.output, error);
}

static vsh_result check_bake(const vsh_view_bake *given, const char *what, vsh_view_bake *bake,
                             vsh_error *error) {
    *bake = vsh_view_bake_default();
    VSHI_TRY(vshi_options_resolve(given, bake, sizeof *bake, what, error));
    if (bake->plane_count > VSH_MAX_VIEW_PLANES) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %zu files of planes, at most %d", what,
                         bake->plane_count, VSH_MAX_VIEW_PLANES);
    }
    VSHI_NEEDS_OF(bake->plane_count, bake->planes);
    for (size_t i = 0; i < bake->plane_count; ++i) {
        VSHI_NEEDS(bake->planes[i]);
    }
    if (bake->uv_set < -1 || bake->uv_set >= VSH_MAX_UV_SETS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: UV set %d: expected -1 … %d", what, bake->uv_set,
                         VSH_MAX_UV_SETS - 1);
    }
    if (bake->model == NULL && bake->plane_count == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: neither a model nor planes", what);
    }
    return VSH_OK;
}

vsh_result vsh_view_write(const char *path, const vsh_view_bake *bake, const vsh_view_bake *other,
                          const vsh_run *run, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(path, bake);
    vsh_view_bake bakes[2];
    vsh_run resolved;
    VSHI_TRY(check_bake(bake, "bake", &bakes[0], error));
    if (bakes[0].model == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: the first bake's model is NULL", __func__);
    }
    if (other != NULL) {
        VSHI_TRY(check_bake(other, "other bake", &bakes[1], error));
    }
    VSHI_TRY(vshi_run_resolve(run, &resolved, error));
    return vshi_view_write_page(path, bakes, other != NULL ? 2 : 1, NULL, &resolved, error);
}
