/* The outline of an image's solid area: marching squares over the pixels' centres.
 *
 * Two rings of samples on the image's edge surround the pixels. The inner ring repeats the pixels next to it,
 * the outer ring is not solid. So an area that reaches the edge is closed there, at its right place. */
#include "shapes/outline.h"

#include "base/floats.h"
#include "base/memory.h"
#include "io/image/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double RED = 0.2126, GREEN = 0.7152, BLUE = 0.0722; /* Rec. 709 */

/* --- the channel */

static bool varies(const float *plane, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (plane[i] != 1.0f) {
            return true;
        }
    }
    return false;
}

/* Finds a colour by its name; in a grey image the grey. */
static const float *find_colour(const vsh_image *image, const char *name) {
    const float *plane = vshi_image_find_plane(image, name);
    return plane != NULL ? plane : vshi_image_find_plane(image, "Y");
}

static vsh_result find_luminance(const vsh_image *image, const char *path, const vsh_run *run,
                                 const float **plane, float **owned, vsh_error *error) {
    const float *rgb[3] = {find_colour(image, "R"), find_colour(image, "G"), find_colour(image, "B")};
    if (rgb[0] == NULL || rgb[1] == NULL || rgb[2] == NULL) {
        if (image->channel_count != 1) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: has no R, G and B (or Y) to take its luminance of; name a channel", path);
        }
        *plane = image->planes[0];
        return VSH_OK;
    }
    if (rgb[0] == rgb[1] && rgb[1] == rgb[2]) {
        *plane = rgb[0];
        return VSH_OK;
    }
    const size_t count = (size_t)image->width * (size_t)image->height;
    VSHI_TRY(vshi_check_limit(run, 4.0 * (double)count * (image->channel_count + 1.0), path, error));
    VSHI_TRY(vshi_allocate((void **)owned, count, sizeof(float), path, error));
    for (size_t i = 0; i < count; ++i) {
        (*owned)[i] = (float)(RED * (double)rgb[0][i] + GREEN * (double)rgb[1][i] + BLUE * (double)rgb[2][i]);
    }
    *plane = *owned;
    return VSH_OK;
}

/* The name in files: A for "alpha", and so on. */
static const char *file_name(const char *channel) {
    static const char *const names[][2] = {{"alpha", "A"}, {"red", "R"}, {"green", "G"}, {"blue", "B"}};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        if (strcmp(channel, names[i][0]) == 0) {
            return names[i][1];
        }
    }
    return channel;
}

static vsh_result find_channel(const vsh_image *image, const char *path, const char *channel,
                               const vsh_run *run, const float **plane, float **owned, vsh_error *error) {
    const size_t count = (size_t)image->width * (size_t)image->height;
    *plane = NULL;
    if (channel == NULL) {
        const float *alpha = vshi_image_find_plane(image, "A");
        if (alpha != NULL && varies(alpha, count)) {
            *plane = alpha;
            return VSH_OK;
        }
    } else if (strcmp(channel, "luminance") != 0) {
        *plane = vshi_image_find_plane(image, channel);
        *plane = *plane != NULL ? *plane : vshi_image_find_plane(image, file_name(channel));
        if (*plane != NULL) {
            return VSH_OK;
        }
        char known[256] = "";
        for (int32_t i = 0; i < image->channel_count; ++i) {
            const size_t length = strlen(known);
            snprintf(known + length, sizeof known - length, "%s%s", i > 0 ? ", " : "", image->names[i]);
        }
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: has no channel '%.64s'; it has %s", path, channel,
                         known);
    }
    return find_luminance(image, path, run, plane, owned, error);
}

/* --- the border */

/* A step of the border from one edge between samples to the next. An edge's number is twice that of its upper
 * or left sample, plus 1 if it goes down. */
typedef struct step {
    uint64_t from, to;
    bool used;
} step;

typedef struct border {
    const float *plane;
    int64_t width, height;
    int64_t columns, rows; /* of samples, rings included */
    double threshold;
    bool invert;
    double pixel[2]; /* size, world units */
    step *steps;
    size_t step_count;
} border;

static int64_t clamp(int64_t i, int64_t least, int64_t most) {
    return i < least ? least : i > most ? most : i;
}

static double sample(const border *b, int64_t i, int64_t k) {
    const int64_t x = clamp(i - 2, 0, b->width - 1), y = clamp(k - 2, 0, b->height - 1);
    return (double)b->plane[y * b->width + x];
}

static bool solid(const border *b, int64_t i, int64_t k) {
    if (i == 0 || k == 0 || i == b->columns - 1 || k == b->rows - 1) {
        return false;
    }
    return (sample(b, i, k) >= b->threshold) != b->invert;
}

/* Position of a sample, pixels from the image's upper left corner. */
static double place(int64_t i, int64_t size) {
    return i <= 1 ? 0.0 : i >= size + 2 ? (double)size : (double)i - 1.5;
}

static vshi_point crossing(const border *b, uint64_t edge) {
    const int64_t at = (int64_t)(edge / 2), i = at % b->columns, k = at / b->columns;
    const int64_t i2 = i + (edge % 2 == 0), k2 = k + (edge % 2 == 1);
    const double v = sample(b, i, k), v2 = sample(b, i2, k2);
    double t = v2 != v ? (b->threshold - v) / (v2 - v) : 0.5; /* the rings' edges have no length */
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    const double x = place(i, b->width) + t * (place(i2, b->width) - place(i, b->width));
    const double y = place(k, b->height) + t * (place(k2, b->height) - place(k, b->height));
    return (vshi_point){(x - 0.5 * (double)b->width) * b->pixel[0],
                        (0.5 * (double)b->height - y) * b->pixel[1]};
}

static void add_step(border *b, uint64_t from, uint64_t to) {
    if (b->steps != NULL) {
        b->steps[b->step_count] = (step){from, to, false};
    }
    b->step_count++;
}

/* Goes around a cell, and joins an edge where the solid begins with one where it ends. If there are two of
 * each, the cell's middle decides whether its solid corners are connected. */
static void march_cell(border *b, int64_t i, int64_t k) {
    const bool corner[5] = {solid(b, i, k), solid(b, i + 1, k), solid(b, i + 1, k + 1), solid(b, i, k + 1),
                            solid(b, i, k)};
    const uint64_t at = (uint64_t)(k * b->columns + i), columns = (uint64_t)b->columns;
    const uint64_t edges[4] = {2 * at, 2 * (at + 1) + 1, 2 * (at + columns), 2 * at + 1};
    uint64_t begins[2] = {0, 0}, ends[2] = {0, 0};
    size_t begin_count = 0, end_count = 0;
    int first = -1; /* the first crossed edge, if it is an end */
    for (int e = 0; e < 4; ++e) {
        if (corner[e] == corner[e + 1]) {
            continue;
        }
        if (corner[e + 1]) {
            begins[begin_count++] = edges[e];
        } else {
            first = begin_count == 0 ? e : first;
            ends[end_count++] = edges[e];
        }
    }
    if (begin_count == 1) {
        add_step(b, begins[0], ends[0]);
    } else if (begin_count == 2) {
        const double middle =
            0.25 * (sample(b, i, k) + sample(b, i + 1, k) + sample(b, i + 1, k + 1) + sample(b, i, k + 1));
        const bool joined = (middle >= b->threshold) != b->invert;
        /* ends[j] follows begins[j] if the first crossing is one of `begins`, else begins[1 - j] */
        const int shift = (first >= 0) != joined;
        add_step(b, begins[0], ends[shift]);
        add_step(b, begins[1], ends[1 - shift]);
    }
}

static vsh_result march(border *b, vshi_job *job, vsh_error *error) {
    b->step_count = 0;
    for (int64_t k = 0; k + 1 < b->rows; ++k) {
        for (int64_t i = 0; i + 1 < b->columns; ++i) {
            march_cell(b, i, k);
        }
        VSHI_TRY(vshi_job_step(job, 1, error));
    }
    return VSH_OK;
}

static int by_from(const void *a, const void *b) {
    const step *p = a, *q = b;
    return (p->from > q->from) - (p->from < q->from);
}

/* Each crossed edge begins one step and ends one. */
static step *find_step(const border *b, uint64_t from) {
    return bsearch(&(step){.from = from}, b->steps, b->step_count, sizeof *b->steps, by_from);
}

static void join_steps(border *b, vshi_contours *contours) {
    qsort(b->steps, b->step_count, sizeof *b->steps, by_from);
    for (size_t i = 0; i < b->step_count && contours->result == VSH_OK; ++i) {
        for (step *at = &b->steps[i]; !at->used; at = find_step(b, at->to)) {
            const vshi_point p = crossing(b, at->from);
            vshi_contours_add(contours, p.x, p.y);
            at->used = true;
        }
        vshi_contours_close(contours);
    }
}

static vsh_result trace(border *b, const char *path, double held, const vsh_run *run, vsh_outline **outline,
                        vsh_error *error) {
    vshi_contours contours = {.run = run, .error = error};
    vshi_job *job;
    vsh_result result;
    VSHI_TRY(vshi_job_open(&job, run, "outline", 2 * (size_t)b->rows, path, error));
    VSHI_TRY_DONE(march(b, job, error));
    VSHI_TRY_DONE(vshi_check_limit(run, held + (double)b->step_count * sizeof(step), path, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&b->steps, b->step_count, sizeof(step), path, error));
    if (b->steps != NULL) {
        VSHI_TRY_DONE(march(b, job, error));
        join_steps(b, &contours);
    }
done:
    free(b->steps);
    vshi_job_end(job);
    return result == VSH_OK ? vshi_contours_finish(&contours, true, path, outline) : result;
}

static vsh_result trace_image(const vsh_image *image, const char *path, const vsh_mask_options *options,
                              const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    const size_t count = (size_t)image->width * (size_t)image->height;
    const float *plane = NULL;
    float *owned = NULL;
    const double held = 4.0 * (double)count * (image->channel_count + 1.0);
    vsh_result result;
    VSHI_TRY(vshi_check_limit(run, held, path, error));
    VSHI_TRY_DONE(find_channel(image, path, options->channel, run, &plane, &owned, error));
    for (size_t i = 0; i < count; ++i) {
        if (!isfinite(plane[i])) {
            result = vshi_fail(error, VSH_ERROR_INPUT, "%s: pixel (%zu, %zu) is %g: expected finite numbers",
                               path, i % (size_t)image->width, i / (size_t)image->width, (double)plane[i]);
            goto done;
        }
    }
    const double width = options->width;
    const double height =
        options->height > 0.0 ? options->height : width * (double)image->height / (double)image->width;
    border b = {.plane = plane,
                .width = image->width,
                .height = image->height,
                .columns = (int64_t)image->width + 4,
                .rows = (int64_t)image->height + 4,
                .threshold = options->threshold,
                .invert = options->invert != 0,
                .pixel = {width / (double)image->width, height / (double)image->height}};
    result = trace(&b, path, held, run, outline, error);
done:
    free(owned);
    return result;
}

static vsh_result check_options(const vsh_mask_options *options, vsh_error *error) {
    if (!(options->width > 0.0 && options->width <= VSHI_OUTLINE_LARGEST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "mask: width %.9g: expected more than 0, at most %g",
                         options->width, VSHI_OUTLINE_LARGEST);
    }
    if (!(options->height >= 0.0 && options->height <= VSHI_OUTLINE_LARGEST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "mask: height %.9g: expected 0 … %g", options->height,
                         VSHI_OUTLINE_LARGEST);
    }
    if (!isfinite(options->threshold)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "mask: threshold %g: expected a finite number",
                         options->threshold);
    }
    return VSH_OK;
}

vsh_result vshi_outline_from_image(const char *path, const vsh_mask_options *options, const vsh_run *run,
                                   vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(outline);
    VSHI_NEEDS(path);
    vsh_mask_options full = vsh_mask_options_default();
    vsh_image_file *file;
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_mask_options", error));
    VSHI_TRY(check_options(&full, error));
    VSHI_TRY(vsh_image_read(path, run, &file, error));
    const vsh_image image = vsh_image_view(file);
    const vsh_result result = trace_image(&image, path, &full, run, outline, error);
    vsh_image_free(file);
    return result;
}
