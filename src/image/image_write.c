/* Images that are written, whole or as their rows come. */
#include "base/file.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "image/exr.h"
#include "image/pack.h"
#include "image/png.h"
#include "image/write_plan.h"

#include <stdlib.h>
#include <string.h>

struct vsh_image_writer {
    vshi_write_plan plan;
    vshi_output output;
    char *path;
    char (*names)[VSH_CHANNEL_NAME]; /* of the image's channels */
    int32_t channel_count;
    int32_t row;          /* next */
    vshi_exr_writer *exr; /* one of the three */
    vshi_png_writer *png;
    vshi_oiio_writer *oiio;
    vsh_image_clipping clipping;
};

static void free_writer(vsh_image_writer *writer) {
    if (writer == NULL) {
        return;
    }
    vshi_output_abandon(&writer->output);
    free(writer->names);
    free(writer->path);
    free(writer);
}

/* Closes the file, and says what its closing came to. */
static vsh_result close_file(vsh_image_writer *writer, vsh_error *error) {
    const vsh_result result = writer->plan.exr       ? vshi_exr_end(writer->exr, error)
                              : writer->plan.png     ? vshi_png_end(writer->png, error)
                              : writer->oiio != NULL ? vshi_oiio()->end(writer->oiio, error)
                                                     : VSH_OK;
    writer->exr = NULL;
    writer->png = NULL;
    writer->oiio = NULL;
    return result;
}

static vsh_result copy_texts(vsh_image_writer *writer, const char *path, const vsh_image *image,
                             vsh_error *error) {
    void *names = NULL;
    const vsh_result result =
        vshi_allocate(&names, (size_t)image->channel_count, sizeof *writer->names, path, error);
    writer->names = names;
    writer->path = strdup(path);
    if (result != VSH_OK || writer->path == NULL) {
        return result != VSH_OK ? result
                                : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    writer->channel_count = image->channel_count;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        strcpy(writer->names[c], image->names[c]); /* the plan has looked at their lengths */
    }
    for (int32_t p = 0; p < writer->plan.planes.count; ++p) {
        vshi_image_plane *plane = &writer->plan.planes.planes[p];
        const int32_t channel = writer->plan.channel[p];
        if (channel >= 0 && plane->name == image->names[channel]) {
            plane->name = writer->names[channel];
        }
    }
    return VSH_OK;
}

vsh_result vsh_image_writer_create(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_image_writer **writer, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(writer);
    *writer = NULL;
    vsh_image_writer *made = NULL;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "image", error));
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_write_plan_make(path, image, options, &made->plan, error));
    VSHI_TRY_DONE(copy_texts(made, path, image, error));
    VSHI_TRY_DONE(vshi_output_begin(&made->output, path, error));
    const vshi_write_plan *plan = &made->plan;
    const char *temporary = made->output.temporary;
    if (plan->exr) {
        VSHI_TRY_DONE(vshi_exr_begin(temporary, made->path, &plan->planes, plan->bits, &made->exr, error));
    } else if (plan->png) {
        VSHI_TRY_DONE(vshi_png_begin(temporary, made->path, &plan->planes, plan->bits, &made->png, error));
    } else {
        VSHI_TRY_DONE(vshi_oiio()->begin(temporary, made->path, &plan->format, &plan->planes, plan->bits,
                                         &made->oiio, error));
    }
    *writer = made;
    made = NULL;
done:
    free_writer(made);
    return result;
}

/* Texels of light that integers cut. */
static void count_clipped(vsh_image_writer *writer, size_t texels, const float *const *planes) {
    const vshi_planes *list = &writer->plan.planes;
    const float *light[VSHI_PACK_KEYS];
    const float *coverage = NULL;
    int count = 0;
    for (int32_t p = 0; p < list->count && !writer->plan.exr; ++p) {
        if (list->planes[p].is_color && list->planes[p].values != NULL && count < VSHI_PACK_KEYS) {
            light[count++] = list->planes[p].values;
        }
    }
    for (int32_t c = 0; c < writer->channel_count; ++c) {
        coverage = strcmp(writer->names[c], "A") == 0 ? planes[c] : coverage;
    }
    vsh_image_clipping *clipping = &writer->clipping;
    for (size_t i = 0; i < texels && count > 0; ++i) {
        if (coverage != NULL && !(coverage[i] > 0.0f)) {
            continue;
        }
        float most = 0.0f;
        for (int c = 0; c < count; ++c) {
            most = light[c][i] > most ? light[c][i] : most;
        }
        ++clipping->texels;
        clipping->clipped += most > 1.0f;
        clipping->largest = most > clipping->largest ? most : clipping->largest;
    }
}

vsh_result vsh_image_writer_get_clipping(const vsh_image_writer *writer, vsh_image_clipping *clipping,
                                         vsh_error *error) {
    VSHI_NEEDS(writer);
    VSHI_NEEDS(clipping);
    *clipping = writer->clipping;
    return VSH_OK;
}

vsh_result vsh_image_writer_add(vsh_image_writer *writer, int32_t rows, const float *const *planes,
                                vsh_error *error) {
    VSHI_FLOATS;
    vshi_planes *list = &writer->plan.planes;
    if (rows < 1 || rows > list->height - writer->row) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d rows from row %d: expected 1 … %d", writer->path,
                         rows, writer->row, list->height - writer->row);
    }
    for (int32_t c = 0; c < writer->channel_count; ++c) {
        if (planes == NULL || planes[c] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' has no values", writer->path,
                             writer->names[c]);
        }
    }
    for (int32_t p = 0; p < list->count; ++p) {
        const int32_t channel = writer->plan.channel[p];
        list->planes[p].values = channel >= 0 ? planes[channel] : NULL;
    }
    const vshi_picture *picture = &writer->plan.picture;
    list->grey.count = picture->light_count;
    for (int32_t i = 0; i < picture->light_count; ++i) {
        list->grey.lights[i] = planes[picture->lights[i]];
    }
    list->grey.ao = picture->ao >= 0 ? planes[picture->ao] : NULL;
    count_clipped(writer, (size_t)rows * (size_t)list->width, planes);
    const vsh_result result = writer->plan.exr   ? vshi_exr_add(writer->exr, list, rows, error)
                              : writer->plan.png ? vshi_png_add(writer->png, list, rows, error)
                                                 : vshi_oiio()->add(writer->oiio, list, rows, error);
    writer->row += rows;
    return result;
}

vsh_result vsh_image_writer_finish(vsh_image_writer *writer, vsh_error *error) {
    VSHI_FLOATS;
    const int32_t height = writer->plan.planes.height;
    if (writer->row < height) {
        const vsh_result result = vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d of %d rows were given",
                                            writer->path, writer->row, height);
        vsh_image_writer_abandon(writer);
        return result;
    }
    vsh_result result;
    VSHI_TRY_DONE(close_file(writer, error));
    result = vshi_output_commit(&writer->output, error);
done:
    free_writer(writer);
    return result;
}

void vsh_image_writer_abandon(vsh_image_writer *writer) {
    VSHI_FLOATS;
    if (writer != NULL) {
        close_file(writer, NULL);
        free_writer(writer);
    }
}

vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                           vsh_error *error) {
    VSHI_FLOATS;
    vshi_write_plan plan;
    VSHI_TRY(vshi_write_plan_make(path, image, options, &plan, error));
    VSHI_TRY(vshi_check_values(path, image->width, image->height, image->channel_count, error));
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (image->planes == NULL || image->planes[c] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' has no values", path,
                             image->names[c]);
        }
    }
    vsh_image_writer *writer = NULL;
    VSHI_TRY(vsh_image_writer_create(path, image, options, &writer, error));
    const vsh_result result = vsh_image_writer_add(writer, image->height, image->planes, error);
    if (result != VSH_OK) {
        vsh_image_writer_abandon(writer);
        return result;
    }
    return vsh_image_writer_finish(writer, error);
}

vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                           vsh_error *error) {
    VSHI_FLOATS;
    vshi_write_plan plan;
    VSHI_TRY(vshi_write_plan_make(path, image, options, &plan, error));
    return vshi_output_check(path, error);
}

uint64_t vsh_image_writer_bytes(const char *path, const vsh_image *image, const vsh_image_options *options) {
    vshi_write_plan plan;
    if (vshi_write_plan_make(path, image, options, &plan, NULL) != VSH_OK) {
        return 0;
    }
    return (uint64_t)(plan.exr   ? vshi_exr_writer_bytes(&plan.planes, plan.bits)
                      : plan.png ? vshi_png_writer_bytes(&plan.planes, plan.bits)
                                 : vshi_oiio()->writer_bytes(&plan.format, &plan.planes, plan.bits));
}
