/* Filters samples into pixels, and encodes pixels for files. The filter is Blackman and Harris' window over
 * three pixels (F. J. Harris, "On the use of windows for harmonic analysis with the discrete Fourier
 * transform", 1978): edges without steps or ringing. */
#include "base/elementary.h"
#include "base/floats.h"
#include "base/parallel.h"
#include "render/render.h"

#include <string.h>

void vshi_film_begin(vshi_film *film, const vshi_sample_grid *grid, const vsh_picture *picture) {
    static const double PI = 3.14159265358979323846;
    const int32_t count = 3 * grid->samples;
    const size_t pixels = (size_t)grid->width * (size_t)grid->height;
    *film = (vshi_film){.grid = grid, .picture = picture};
    double sum = 0.0;
    for (int32_t i = 0; i < count; ++i) {
        const double x = 2.0 * PI * (i + 0.5) / count;
        film->weight[i] =
            0.35875 - 0.48829 * vshi_cos(x) + 0.14128 * vshi_cos(2.0 * x) - 0.01168 * vshi_cos(3.0 * x);
        sum += film->weight[i];
    }
    for (int32_t i = 0; i < count; ++i) {
        film->weight[i] /= sum;
    }
    if (picture->color != NULL) {
        memset(picture->color, 0, 3 * pixels * sizeof(float));
    }
    if (picture->alpha != NULL) {
        memset(picture->alpha, 0, pixels * sizeof(float));
    }
    if (picture->normal != NULL) {
        memset(picture->normal, 0, 3 * pixels * sizeof(float));
    }
    for (size_t i = 0; picture->depth != NULL && i < pixels; ++i) {
        picture->depth[i] = INFINITY;
    }
}

typedef struct addition {
    const vshi_film *film;
    const vshi_seen *seen;
    int32_t first_row, rows; /* of samples */
    int32_t first_pixel;     /* row */
} addition;

/* The samples of `a` under the filter around a pixel. */
static void add_pixel(const addition *a, int32_t x, int32_t y) {
    const vshi_film *film = a->film;
    const int32_t n = film->grid->samples, across = 3 * n;
    const size_t pixel = (size_t)y * (size_t)film->grid->width + (size_t)x;
    double color[3] = {0.0}, normal[3] = {0.0}, alpha = 0.0;
    float nearest = INFINITY;
    for (int32_t j = 0; j < across; ++j) {
        const int32_t row = y * n + j - a->first_row;
        if (row < 0 || row >= a->rows) {
            continue;
        }
        const vshi_seen *seen = a->seen + (size_t)row * (size_t)film->grid->columns + (size_t)(x * n);
        for (int32_t i = 0; i < across; ++i) {
            const double weight = film->weight[j] * film->weight[i];
            for (int c = 0; c < 3; ++c) {
                color[c] += weight * (double)seen[i].color[c];
                normal[c] += weight * (double)seen[i].normal[c];
            }
            alpha += weight * (double)seen[i].alpha;
            const bool own = i >= n && i < 2 * n && j >= n && j < 2 * n;
            nearest = own && seen[i].depth < nearest ? seen[i].depth : nearest;
        }
    }
    const vsh_picture *picture = film->picture;
    for (size_t c = 0; c < 3; ++c) {
        if (picture->color != NULL) {
            picture->color[3 * pixel + c] += (float)color[c];
        }
        if (picture->normal != NULL) {
            picture->normal[3 * pixel + c] += (float)normal[c];
        }
    }
    if (picture->alpha != NULL) {
        picture->alpha[pixel] += (float)alpha;
    }
    if (picture->depth != NULL && nearest < picture->depth[pixel]) {
        picture->depth[pixel] = nearest;
    }
}

static void add_rows(void *user, size_t begin, size_t end) {
    const addition *a = user;
    for (size_t row = begin; row < end; ++row) {
        for (int32_t x = 0; x < a->film->grid->width; ++x) {
            add_pixel(a, x, a->first_pixel + (int32_t)row);
        }
    }
}

vsh_result vshi_film_add(const vshi_film *film, const vshi_seen *seen, int32_t first_row, int32_t rows,
                         vshi_job *job, vsh_error *error) {
    const int32_t n = film->grid->samples;
    const int32_t first = first_row / n - 2 > 0 ? first_row / n - 2 : 0;
    const int32_t last = (first_row + rows - 1) / n < film->grid->height - 1 ? (first_row + rows - 1) / n
                                                                             : film->grid->height - 1;
    addition a = {film, seen, first_row, rows, first};
    return first <= last ? vshi_parallel_for(job, (size_t)(last - first + 1), 4, 0, add_rows, &a, error)
                         : VSH_OK;
}

void vshi_film_end(const vshi_film *film) {
    const vsh_picture *picture = film->picture;
    const size_t pixels = (size_t)film->grid->width * (size_t)film->grid->height;
    for (size_t i = 0; picture->normal != NULL && i < pixels; ++i) {
        float *normal = picture->normal + 3 * i;
        const vshi_vec n = vshi_unit(vshi_vec_off(normal));
        normal[0] = (float)n.x, normal[1] = (float)n.y, normal[2] = (float)n.z;
    }
    for (size_t i = 0; picture->alpha != NULL && i < pixels; ++i) {
        const float alpha = picture->alpha[i]; /* sums of weights round */
        picture->alpha[i] = alpha > 1.0f - 0x1p-20f ? 1.0f : alpha;
    }
}

/* --- 8 bits */

/* A mask whose neighbourhoods hold all levels (J. Jimenez, "Next generation post processing in Call of Duty:
 * Advanced Warfare", 2014: interleaved gradient noise), in [0, 1); channels read it from other places. */
static double mask_at(int32_t column, int32_t row, int channel) {
    const double place = 0.06711056 * (column + 17 * channel) + 0.00583715 * (row + 31 * channel);
    const double turn = 52.9829189 * (place - floor(place));
    return turn - floor(turn);
}

/* To steps of 1/255, up or down by where the mask stands. */
static float dither(double value, double mask) {
    return (float)(fmin(255.0, floor(255.0 * value + mask)) / 255.0);
}

vsh_result vsh_picture_encode(const vsh_picture *picture, int32_t width, int32_t height, double exposure,
                              float *const rgb[3], float *alpha, vsh_error *error) {
    VSHI_FLOATS;
    static const double LEAST_ALPHA = 1e-6;
    if (picture == NULL || picture->color == NULL || rgb == NULL || rgb[0] == NULL || rgb[1] == NULL ||
        rgb[2] == NULL || (alpha != NULL && picture->alpha == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_picture_encode: a plane is NULL");
    }
    if (width < 1 || width > VSH_MAX_PICTURE_SIZE || height < 1 || height > VSH_MAX_PICTURE_SIZE ||
        !(fabs(exposure) <= 20.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_picture_encode: %d × %d pixels, exposure %g: expected 1 … %d and -20 … 20",
                         width, height, exposure, VSH_MAX_PICTURE_SIZE);
    }
    const double gain = vshi_exp2(exposure);
    for (int32_t row = 0; row < height; ++row) {
        for (int32_t column = 0; column < width; ++column) {
            const size_t pixel = (size_t)row * (size_t)width + (size_t)column;
            double over = gain;
            if (alpha != NULL) {
                const double a = picture->alpha[pixel];
                alpha[pixel] = (float)(floor(255.0 * fmin(1.0, fmax(0.0, a)) + 0.5) / 255.0);
                over = a > LEAST_ALPHA ? gain / a : 0.0;
            }
            for (int c = 0; c < 3; ++c) {
                const double value = vshi_to_srgb(over * (double)picture->color[3 * pixel + (size_t)c]);
                rgb[c][pixel] = dither(value, mask_at(column, row, c));
            }
        }
    }
    return VSH_OK;
}
