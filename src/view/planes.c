/* Planes of a bake in a page: halves, their high bytes before their low ones, each less its left neighbour,
 * by deflate. */
#include "view/page.h"

#include "base/memory.h"

#include <Imath/half.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/image.h>
#define ZLIB_CONST
#include <zlib.h>

/* Every finite value stays one. */
static float clamp_half(float value) {
    static const float MOST = 65504.0f;
    return isnan(value) ? value : fminf(fmaxf(value, -MOST), MOST);
}

/* The planes of bytes of a channel; light of a file that is sRGB is made linear. */
static void split(const float *values, int32_t width, int32_t height, bool srgb, uint8_t *bytes) {
    uint8_t *high = bytes, *low = bytes + (size_t)width * (size_t)height;
    for (int32_t y = 0; y < height; ++y) {
        unsigned last_high = 0, last_low = 0;
        for (int32_t x = 0; x < width; ++x) {
            const float value = *values++;
            const unsigned half =
                imath_float_to_half(clamp_half(srgb ? (float)vsh_srgb_to_linear(value) : value));
            *high++ = (uint8_t)((half >> 8) - last_high);
            *low++ = (uint8_t)((half & 255u) - last_low);
            last_high = half >> 8;
            last_low = half & 255u;
        }
    }
}

static vsh_result put_deflated(vshi_view *view, const uint8_t *bytes, size_t count, vsh_error *error) {
    enum { PIECE = 1 << 14, MOST = 1 << 28 };
    uint8_t piece[PIECE];
    z_stream stream;
    memset(&stream, 0, sizeof stream);
    if (deflateInit(&stream, Z_DEFAULT_COMPRESSION) != Z_OK) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", view->page->path);
    }
    vshi_page_data_begin(view->page);
    int state = Z_OK;
    while (state != Z_STREAM_END) {
        const size_t now = count < MOST ? count : MOST;
        stream.next_in = bytes;
        stream.avail_in = (uInt)now;
        bytes += now;
        count -= now;
        do {
            stream.next_out = piece;
            stream.avail_out = PIECE;
            state = deflate(&stream, count > 0 ? Z_NO_FLUSH : Z_FINISH);
            vshi_page_data(view->page, piece, PIECE - stream.avail_out);
        } while (stream.avail_out == 0);
    }
    vshi_page_data_end(view->page);
    deflateEnd(&stream);
    return vshi_page_check(view->page, error);
}

/* An image, and what its file says of itself. */
typedef struct source {
    const char *name;
    vsh_image image;
    const vsh_attribute *attributes;
    size_t attribute_count;
} source;

/* Whether an image has an attribute, of a value unless that is NULL. */
static bool has_attribute(const source *from, const char *name, const char *value) {
    for (size_t i = 0; i < from->attribute_count; ++i) {
        const vsh_attribute *one = &from->attributes[i];
        if (strcmp(one->name, name) == 0 && (value == NULL || strcmp(one->value, value) == 0)) {
            return true;
        }
    }
    return false;
}

static bool is_picture(const char *name) {
    return strcmp(name, "R") == 0 || strcmp(name, "G") == 0 || strcmp(name, "B") == 0;
}

static vsh_result put_channel(vshi_view *view, const vsh_image *image, int32_t channel, bool srgb,
                              uint8_t *bytes, json_t *channels, vsh_error *error) {
    const size_t texels = (size_t)image->width * (size_t)image->height;
    split(image->planes[channel], image->width, image->height, srgb, bytes);
    VSHI_TRY(put_deflated(view, bytes, 2 * texels, error));
    return vshi_view_tell(
        channels, NULL,
        json_pack("{s:o, s:s}", "name", vshi_view_text(image->names[channel]), "data", view->page->block),
        error);
}

static vsh_result put_channels(vshi_view *view, const source *from, uint8_t *bytes, json_t *channels,
                               vsh_error *error) {
    const vsh_image *image = &from->image;
    const bool made_of_others = has_attribute(from, VSH_IMAGE_RGB, NULL);
    const bool srgb = has_attribute(from, "vdbshade_color_space", "sRGB");
    vshi_job *job;
    VSHI_TRY(vshi_view_begin(view, (size_t)image->channel_count, &job, error));
    vsh_result result = VSH_OK;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        const bool picture = is_picture(image->names[c]);
        if (!picture || !made_of_others) {
            VSHI_TRY_DONE(put_channel(view, image, c, picture && srgb, bytes, channels, error));
        }
        VSHI_TRY_DONE(vshi_view_advance(view, job, 1, error));
    }
done:
    vshi_job_end(job);
    return result;
}

/* What the file says of itself; NULL where memory is short. */
static json_t *attributes_of(const source *from) {
    json_t *made = json_array();
    for (size_t i = 0; i < from->attribute_count; ++i) {
        json_t *pair = json_pack("[o, o]", vshi_view_text(from->attributes[i].name),
                                 vshi_view_text(from->attributes[i].value));
        if (json_array_append_new(made, pair) != 0) {
            json_decref(made);
            return NULL;
        }
    }
    return made;
}

/* `held` is what the planes take already. */
static vsh_result put(vshi_view *view, const source *from, double held, json_t *pages, vsh_error *error) {
    const vsh_image *image = &from->image;
    const size_t texels = (size_t)image->width * (size_t)image->height;
    void *bytes = NULL;
    json_t *channels = json_array();
    vsh_result result;
    VSHI_TRY_DONE(vshi_check_limit(view->run, held + 2.0 * (double)texels, from->name, error));
    VSHI_TRY_DONE(vshi_allocate(&bytes, texels, 2, from->name, error));
    VSHI_TRY_DONE(put_channels(view, from, bytes, channels, error));
    VSHI_TRY_DONE(vshi_view_tell(pages, NULL,
                                 json_pack("{s:o, s:i, s:i, s:O, s:o}", "name", vshi_view_text(from->name),
                                           "width", image->width, "height", image->height, "channels",
                                           channels, "attributes", attributes_of(from)),
                                 error));
done:
    json_decref(channels);
    free(bytes);
    return result;
}

vsh_result vshi_view_put_planes(vshi_view *view, const char *path, json_t *pages, vsh_error *error) {
    vsh_image_file *file = NULL;
    VSHI_TRY(vsh_image_read(path, view->run, &file, error));
    source from = {.name = vshi_view_file_name(path), .image = vsh_image_view(file)};
    from.attributes = vsh_image_attributes(file, &from.attribute_count);
    const double texels = (double)from.image.width * (double)from.image.height;
    const double held = texels * (double)from.image.channel_count * sizeof(float);
    const vsh_result result = put(view, &from, held, pages, error);
    vsh_image_free(file);
    return result;
}

vsh_result vshi_view_put_image(vshi_view *view, const char *name, const vsh_image *image, json_t *pages,
                               vsh_error *error) {
    const source from = {.name = name, .image = *image};
    return put(view, &from, 0.0, pages, error);
}
