/* A page from its head to its end. What it may do is in its head: run the scripts that are in it, known by
 * their hashes, and nothing else: no request, no script that a file's name or content brings. */
#include <vdbshade/view.h>

#include "base/floats.h"
#include "base/memory.h"
#include "base/threads.h"
#include "base/utf8.h"
#include "view/page.h"

#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- the file */

/* Begins the file, of a page of zeros; end with commit_page(), also where something failed, or with
 * abandon_page(). Errors: as vshi_output_begin(). */
static vsh_result begin_page(vshi_page *page, const char *path, vsh_error *error) {
    page->path = path;
    page->sink.file = -1;
    const vsh_result result = vshi_output_begin(&page->output, path, error);
    if (result == VSH_OK) {
        page->sink = vshi_sink_open(page->output.temporary);
    }
    return result;
}

static void flush(vshi_page *page) {
    vshi_sink_write(&page->sink, page->buffer, page->used, page->written);
    page->written += page->used;
    page->used = 0;
}

void vshi_page_put(vshi_page *page, const void *bytes, size_t count) {
    const char *from = bytes;
    while (count > 0) {
        const size_t room = sizeof page->buffer - page->used, now = count < room ? count : room;
        memcpy(page->buffer + page->used, from, now);
        page->used += now;
        from += now;
        count -= now;
        if (page->used == sizeof page->buffer) {
            flush(page);
        }
    }
}

void vshi_page_text(vshi_page *page, const char *text) {
    vshi_page_put(page, text, strlen(text));
}

vsh_result vshi_page_check(const vshi_page *page, vsh_error *error) {
    return page->sink.error == 0 ? VSH_OK
                                 : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s",
                                             page->path, strerror(page->sink.error));
}

static vsh_result commit_page(vshi_page *page, vsh_error *error) {
    flush(page);
    vshi_sink_close(&page->sink);
    const vsh_result result = vshi_page_check(page, error);
    if (result != VSH_OK) {
        vshi_output_abandon(&page->output);
        return result;
    }
    return vshi_output_commit(&page->output, error);
}

static void abandon_page(vshi_page *page) {
    if (page->sink.file >= 0) {
        vshi_sink_close(&page->sink);
    }
    vshi_output_abandon(&page->output);
}

void vshi_page_data_begin(vshi_page *page) {
    snprintf(page->block, sizeof page->block, "data%zu", page->blocks++);
    vshi_page_text(page, "<script type=\"application/octet-stream\" id=\"");
    vshi_page_text(page, page->block);
    vshi_page_text(page, "\">");
}

static void put_group(vshi_page *page, const uint8_t *bytes, size_t count) {
    char letters[VSHI_BASE64_LETTERS];
    vshi_base64_group(bytes, count, letters);
    vshi_page_put(page, letters, sizeof letters);
}

void vshi_page_data(vshi_page *page, const void *bytes, size_t count) {
    const uint8_t *from = bytes;
    if (page->grouped > 0) {
        while (page->grouped < VSHI_BASE64_BYTES && count > 0) {
            page->group[page->grouped++] = *from++;
            --count;
        }
        if (page->grouped < VSHI_BASE64_BYTES) {
            return;
        }
        put_group(page, page->group, VSHI_BASE64_BYTES);
    }
    for (; count >= VSHI_BASE64_BYTES; count -= VSHI_BASE64_BYTES) {
        put_group(page, from, VSHI_BASE64_BYTES);
        from += VSHI_BASE64_BYTES;
    }
    for (size_t i = 0; i < count; ++i) {
        page->group[i] = from[i];
    }
    page->grouped = count;
}

void vshi_page_data_end(vshi_page *page) {
    if (page->grouped > 0) {
        put_group(page, page->group, page->grouped);
        page->grouped = 0;
    }
    vshi_page_text(page, "</script>\n");
}

/* --- helpers of the parts */

const char *vshi_view_file_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

json_t *vshi_view_text(const char *text) {
    char *clean = malloc(3 * strlen(text) + 1);
    if (clean == NULL) {
        return NULL;
    }
    vshi_utf8_clean(text, clean);
    json_t *made = json_string(clean);
    free(clean);
    return made;
}

vsh_result vshi_view_tell(json_t *about, const char *key, json_t *value, vsh_error *error) {
    const int failed =
        key != NULL ? json_object_set_new(about, key, value) : json_array_append_new(about, value);
    return failed ? vshi_fail(error, VSH_ERROR_MEMORY, "page: the system refused memory") : VSH_OK;
}

vsh_result vshi_view_begin(const vshi_view *view, size_t total, vshi_job **job, vsh_error *error) {
    *job = vshi_job_begin(view->run, "page", total);
    return *job != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", view->page->path);
}

vsh_result vshi_view_advance(const vshi_view *view, vshi_job *job, size_t units, vsh_error *error) {
    VSHI_TRY(vshi_page_check(view->page, error));
    return vshi_job_advance(job, units) ? vshi_job_fail_cancelled(job, error) : VSH_OK;
}

/* --- the page itself */

/* The source by which Content-Security-Policy (W3C, level 2) knows a script or style: 'sha256-…'. */
static void put_source(vshi_page *page, const vshi_embedded *embedded) {
    uint8_t digest[SHA256_DIGEST_SIZE];
    struct sha256_ctx context;
    sha256_init(&context);
    sha256_update(&context, embedded->size, embedded->bytes);
    sha256_digest(&context, sizeof digest, digest);
    vshi_page_text(page, " 'sha256-");
    for (size_t i = 0; i < sizeof digest; i += VSHI_BASE64_BYTES) {
        char letters[VSHI_BASE64_LETTERS];
        const size_t left = sizeof digest - i;
        vshi_base64_group(digest + i, left < VSHI_BASE64_BYTES ? left : VSHI_BASE64_BYTES, letters);
        vshi_page_put(page, letters, sizeof letters);
    }
    vshi_page_text(page, "'");
}

static void put_head(vshi_page *page) {
    vshi_page_text(
        page, "<!doctype html>\n<html lang=\"en\" data-state=\"loading\"><head><meta charset=\"utf-8\">\n"
              "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; base-uri "
              "'none'; form-action 'none'; script-src");
    for (const vshi_embedded *script = vshi_view_scripts; script->size > 0; ++script) {
        put_source(page, script);
    }
    vshi_page_text(page, "; style-src");
    put_source(page, &vshi_view_style);
    vshi_page_text(page, "\">\n<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
                         "<meta name=\"generator\" content=\"vdbshade " VSHI_VERSION
                         "\">\n<title>vdbshade</title>\n<style>");
    vshi_page_put(page, vshi_view_style.bytes, vshi_view_style.size);
    vshi_page_text(page, "</style></head>\n<body>\n");
    vshi_page_put(page, vshi_view_body.bytes, vshi_view_body.size);
}

char *vshi_view_dump(const json_t *json) {
    const size_t size = json_dumpb(json, NULL, 0, JSON_COMPACT);
    char *text = size > 0 ? malloc(size + 1) : NULL;
    if (text != NULL && json_dumpb(json, text, size, JSON_COMPACT) != size) {
        free(text);
        return NULL;
    }
    if (text != NULL) {
        text[size] = '\0';
    }
    return text;
}

/* JSON that HTML takes for text: within strings, the only place where they can be, < > & are escaped. */
static vsh_result put_about(vshi_view *view, vsh_error *error) {
    char *text = vshi_view_dump(view->about);
    if (text == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "page: the system refused memory");
    }
    vshi_page_text(view->page, "<script type=\"application/json\" id=\"about\">");
    for (const char *at = text; *at != '\0'; ++at) {
        if (*at == '<' || *at == '>' || *at == '&') {
            char escaped[8];
            snprintf(escaped, sizeof escaped, "\\u%04x", (unsigned)*at);
            vshi_page_text(view->page, escaped);
        } else {
            vshi_page_put(view->page, at, 1);
        }
    }
    vshi_page_text(view->page, "</script>\n");
    free(text);
    return VSH_OK;
}

static void put_scripts(vshi_page *page) {
    for (const vshi_embedded *script = vshi_view_scripts; script->size > 0; ++script) {
        vshi_page_text(page, "<script>");
        vshi_page_put(page, script->bytes, script->size);
        vshi_page_text(page, "</script>\n");
    }
    vshi_page_text(page, "</body></html>\n");
}

/* --- the bakes in it */

static const char *name_of(const vsh_view_bake *bake) {
    if (bake->name != NULL) {
        return bake->name;
    }
    return vshi_view_file_name(bake->model != NULL ? bake->model : bake->planes[0]);
}

/* A bake, or the surface where that is not NULL. */
static vsh_result put_bake(vshi_view *view, const vsh_view_bake *bake, const vshi_view_surface *surface,
                           vsh_error *error) {
    json_t *about = json_object(), *pages = json_array();
    const char *name = surface != NULL ? surface->name : name_of(bake);
    vsh_result result;
    VSHI_TRY_DONE(vshi_view_tell(about, "name", vshi_view_text(name), error));
    VSHI_TRY_DONE(vshi_view_tell(about, "uvSet", json_integer(surface != NULL ? -1 : bake->uv_set), error));
    if (surface != NULL) {
        VSHI_TRY_DONE(vshi_view_put_arrays(view, name, surface->model, about, error));
        VSHI_TRY_DONE(vshi_view_tell(about, "perVertex", json_true(), error));
        VSHI_TRY_DONE(vshi_view_put_image(view, name, surface->image, pages, error));
    } else if (bake->model != NULL) {
        VSHI_TRY_DONE(vshi_view_put_model(view, bake->model, about, error));
    }
    for (size_t i = 0; surface == NULL && i < bake->plane_count; ++i) {
        VSHI_TRY_DONE(vshi_view_put_planes(view, bake->planes[i], pages, error));
    }
    VSHI_TRY_DONE(vshi_view_tell(about, "pages", json_incref(pages), error));
    VSHI_TRY_DONE(vshi_view_tell(view->about, NULL, json_incref(about), error));
done:
    json_decref(pages);
    json_decref(about);
    return result;
}

static vsh_result check(const vsh_view_bake *given, const char *what, vsh_view_bake *bake, vsh_error *error) {
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

typedef struct writing {
    const char *path;
    const vsh_view_bake *bakes;
    size_t count;
    const vshi_view_surface *surface;
    const vsh_run *run;
} writing;

static vsh_result put_page(vshi_view *view, const writing *w, vsh_error *error) {
    put_head(view->page);
    for (size_t i = 0; i < w->count; ++i) {
        VSHI_TRY(put_bake(view, &w->bakes[i], NULL, error));
    }
    if (w->surface != NULL) {
        VSHI_TRY(put_bake(view, NULL, w->surface, error));
    }
    VSHI_TRY(put_about(view, error));
    put_scripts(view->page);
    return VSH_OK;
}

static vsh_result write_page(void *user, vsh_error *error) {
    const writing *w = user;
    vshi_page *page;
    vshi_view view = {.run = w->run};
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&page, 1, sizeof *page, "page", error));
    VSHI_TRY_DONE(begin_page(page, w->path, error));
    view.page = page;
    view.about = json_array();
    result = view.about != NULL
                 ? put_page(&view, w, error)
                 : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", w->path);
    if (result == VSH_OK) {
        result = commit_page(page, error);
    } else {
        abandon_page(page);
    }
    json_decref(view.about);
done:
    free(page);
    return result;
}

vsh_result vshi_view_write_page(const char *path, const vsh_view_bake *bakes, size_t count,
                                const vshi_view_surface *surface, const vsh_run *run, vsh_error *error) {
    writing w = {path, bakes, count, surface, run};
    return vshi_on_stack(write_page, &w, error);
}

vsh_result vsh_view_write(const char *path, const vsh_view_bake *bake, const vsh_view_bake *other,
                          const vsh_run *run, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(path);
    VSHI_NEEDS(bake);
    vsh_view_bake bakes[2];
    vsh_run resolved;
    VSHI_TRY(check(bake, "bake", &bakes[0], error));
    if (bakes[0].model == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: the first bake's model is NULL", __func__);
    }
    if (other != NULL) {
        VSHI_TRY(check(other, "other bake", &bakes[1], error));
    }
    VSHI_TRY(vshi_run_resolve(run, &resolved, error));
    return vshi_view_write_page(path, bakes, other != NULL ? 2 : 1, NULL, &resolved, error);
}
