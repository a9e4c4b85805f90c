#include "image/picture.h"

#include <stdio.h>
#include <string.h>

static const char light_prefix[] = "shadow.";

static bool takes_color(const char *name, vshi_picture *picture, int32_t channel) {
    static const char *const names[3] = {"irradiance.R", "irradiance.G", "irradiance.B"};
    for (int c = 0; c < 3; ++c) {
        if (strcmp(name, names[c]) == 0) {
            picture->rgb[c] = channel;
            return true;
        }
    }
    return false;
}

bool vshi_picture_of(const vsh_image *image, vshi_picture *picture) {
    *picture = (vshi_picture){.rgb = {-1, -1, -1}, .ao = -1};
    for (int32_t c = 0; c < image->channel_count; ++c) {
        const char *name = image->names[c];
        if (strcmp(name, "R") == 0 || strcmp(name, "G") == 0 || strcmp(name, "B") == 0) {
            return false;
        }
        if (takes_color(name, picture, c)) {
            continue;
        }
        if (strncmp(name, light_prefix, sizeof light_prefix - 1) == 0) {
            picture->lights[picture->light_count++] = c;
        } else if (strcmp(name, "ao") == 0) {
            picture->ao = c;
        }
    }
    if (picture->rgb[0] >= 0 && picture->rgb[1] >= 0 && picture->rgb[2] >= 0) {
        return true;
    }
    const int32_t sources = picture->light_count + (picture->ao >= 0 ? 1 : 0);
    const int32_t only = sources != 1                ? -1
                         : picture->light_count == 1 ? picture->lights[0]
                                                     : picture->ao; /* a copy of it */
    for (int c = 0; c < 3; ++c) {
        picture->rgb[c] = only;
    }
    return sources > 0;
}

void vshi_picture_text(const vshi_picture *picture, const vsh_image *image, char *text, size_t capacity) {
    const bool grey = picture->rgb[0] == picture->rgb[1];
    if (!grey) {
        snprintf(text, capacity, "irradiance");
        return;
    }
    char lights[VSH_CHANNEL_NAME + 32] = "";
    if (picture->light_count == 1) {
        snprintf(lights, sizeof lights, "%s", image->names[picture->lights[0]]);
    } else if (picture->light_count > 1) {
        snprintf(lights, sizeof lights, "mean of %d shadows", picture->light_count);
    }
    snprintf(text, capacity, "%s%s%s", lights, lights[0] != '\0' && picture->ao >= 0 ? " * " : "",
             picture->ao >= 0 ? "ao" : "");
}
