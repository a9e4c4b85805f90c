/* What callers give. */
#include "lit/work.h"

#include "base/utf8.h"

#include <math.h>
#include <string.h>

static vsh_result fail_mesh(size_t index, const char *what, size_t place, size_t value, size_t limit,
                            vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_mesh %zu: %s[%zu] is %zu, expected below %zu", index,
                     what, place, value, limit);
}

static vsh_result check_triangles(const vsh_lit_mesh *lit, size_t index, const vsh_mesh *mesh,
                                  vsh_error *error) {
    for (size_t i = 0; i < 3 * lit->triangle_count; ++i) {
        if (lit->indices[i] >= lit->vertex_count) {
            return fail_mesh(index, "indices", i, lit->indices[i], lit->vertex_count, error);
        }
        if (lit->sources[lit->indices[i]] != mesh->indices[i]) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "vsh_lit_mesh %zu: corner %zu is a copy of vertex %u, but the model's is %u",
                             index, i, lit->sources[lit->indices[i]], mesh->indices[i]);
        }
    }
    return VSH_OK;
}

static vsh_result check_charts(const vshi_lit_work *work, const vsh_lit_mesh *lit, size_t index,
                               vsh_error *error) {
    if (lit->charts == NULL && lit->page >= work->page_count) {
        return fail_mesh(index, "page", 0, lit->page, work->page_count, error);
    }
    for (size_t t = 0; lit->charts != NULL && t < lit->triangle_count; ++t) {
        if (lit->charts[t] != VSH_LIT_NO_CHART && lit->charts[t] >= work->options->chart_count) {
            return fail_mesh(index, "charts", t, lit->charts[t], work->options->chart_count, error);
        }
    }
    return VSH_OK;
}

vsh_result vshi_lit_check_mesh(const vshi_lit_work *work, size_t index, vsh_error *error) {
    const vsh_lit_mesh *lit = &work->meshes[index];
    const vsh_mesh mesh = vsh_model_mesh(work->model, index, 0);
    if (lit->uvs == NULL) {
        if (lit->uv_set < -1 || lit->uv_set >= VSH_MAX_UV_SETS || lit->charts != NULL) {
            return vshi_fail(
                error, VSH_ERROR_ARGUMENT,
                "vsh_lit_mesh %zu: without uvs, uv_set is %d and charts are %sgiven, expected -1 "
                "to %d and none",
                index, lit->uv_set, lit->charts != NULL ? "" : "not ", VSH_MAX_UV_SETS - 1);
        }
        return lit->uv_set < 0 ? VSH_OK : check_charts(work, lit, index, error);
    }
    VSHI_NEEDS(lit->sources);
    VSHI_NEEDS(lit->indices);
    if (lit->triangle_count != mesh.triangle_count || lit->vertex_count > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_lit_mesh %zu: %zu triangles of %zu vertices, but the model's mesh has %zu "
                         "triangles",
                         index, lit->triangle_count, lit->vertex_count, mesh.triangle_count);
    }
    for (size_t v = 0; v < lit->vertex_count; ++v) {
        if (lit->sources[v] >= mesh.vertex_count) {
            return fail_mesh(index, "sources", v, lit->sources[v], mesh.vertex_count, error);
        }
        if (!isfinite(lit->uvs[2 * v]) || !isfinite(lit->uvs[2 * v + 1])) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_mesh %zu: uvs[%zu] are (%g, %g)", index, v,
                             (double)lit->uvs[2 * v], (double)lit->uvs[2 * v + 1]);
        }
    }
    VSHI_TRY(check_triangles(lit, index, &mesh, error));
    return check_charts(work, lit, index, error);
}

/* --- images */

static vsh_result check_image(const vsh_lit_image *image, size_t index, vsh_error *error) {
    static const unsigned char magic[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (image->purpose < 0 || image->purpose >= VSH_LIT_PURPOSES || image->page >= UINT16_MAX ||
        !(image->intensity >= 0.0 && image->intensity < 1e30)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_image %zu: purpose %d, page %u, intensity %g",
                         index, image->purpose, image->page, image->intensity);
    }
    if (image->png != NULL) {
        return image->png_size > sizeof magic && memcmp(image->png, magic, sizeof magic) == 0
                   ? VSH_OK
                   : vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_image %zu: its bytes are no PNG", index);
    }
    if (image->width < 1 || image->height < 1 || image->width > 65536 || image->height > 65536 ||
        (image->channel_count != 1 && image->channel_count != 3) ||
        (image->bits != 0 && image->bits != 8 && image->bits != 16)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_lit_image %zu: %d × %d, %d channels of %d bits, expected 1 to 65536, 1 or 3, 8 "
                         "or 16",
                         index, image->width, image->height, image->channel_count, image->bits);
    }
    VSHI_NEEDS(image->channels);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        VSHI_NEEDS(image->channels[c]);
    }
    return VSH_OK;
}

static bool is_file_name(const char *name) {
    const size_t size = strlen(name);
    bool good = size > 0 && size <= VSHI_LIT_NAME_BYTES;
    for (size_t i = 0, length; i < size && good; i += length) {
        length = vshi_utf8_length(name + i);
        good = length > 0 && (unsigned char)name[i] >= ' ' && strchr("/\\\x7f", name[i]) == NULL;
    }
    return good;
}

vsh_result vshi_lit_check_images(const vsh_lit_options *options, vsh_error *error) {
    VSHI_NEEDS_OF(options->image_count, options->images);
    VSHI_NEEDS_OF(options->chart_count, options->chart_pages);
    if (options->image_place < VSH_LIT_IMAGES_AUTO || options->image_place > VSH_LIT_IMAGES_BESIDE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_options.image_place is %d",
                         options->image_place);
    }
    for (size_t i = 0; i < options->image_count; ++i) {
        VSHI_TRY(check_image(&options->images[i], i, error));
        for (size_t k = 0; k < i; ++k) {
            if (options->images[k].purpose == options->images[i].purpose &&
                options->images[k].page == options->images[i].page) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT,
                                 "vsh_lit_image %zu: page %u has one of purpose %d already", i,
                                 options->images[i].page, options->images[i].purpose);
            }
        }
    }
    VSHI_NEEDS_OF(options->page_count, options->page_names);
    for (size_t i = 0; i < options->page_count; ++i) {
        const char *name = options->page_names[i];
        if (name != NULL && !is_file_name(name)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "vsh_lit_options.page_names[%zu]: is no UTF-8, has a character that names of "
                             "files have not, or is empty or longer than %d bytes",
                             i, VSHI_LIT_NAME_BYTES);
        }
    }
    for (size_t c = 0; c < options->chart_count; ++c) {
        if (options->chart_pages[c] >= UINT16_MAX) {
            return fail_mesh(c, "chart_pages", c, options->chart_pages[c], UINT16_MAX, error);
        }
    }
    return VSH_OK;
}
