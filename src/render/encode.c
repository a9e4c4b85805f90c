#include "base/error.h"
#include "base/floats.h"
#include "base/srgb.h"

#include <math.h>
#include <vdbshade/render.h>

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
