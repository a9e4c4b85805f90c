/* What numbers of a file stand for. */
#include "base/srgb.h"

#include <stddef.h>
#include <vdbshade/image.h>

const char *vsh_color_space_name(int32_t color_space) {
    static const char *const names[] = {"auto", "linear", "srgb", "encoded"};
    const size_t count = sizeof names / sizeof names[0];
    return color_space >= 0 && (size_t)color_space < count ? names[color_space] : NULL;
}

double vsh_srgb_to_linear(double encoded) {
    return vshi_from_srgb(encoded);
}
