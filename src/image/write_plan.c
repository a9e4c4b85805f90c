/* What may be written into which file. */
#include "image/write_plan.h"

#include "base/attributes.h"
#include "base/file.h"
#include "base/job.h"
#include "base/srgb.h"
#include "base/try.h"
#include "image/pack.h"
#include "image/png.h"

#include <string.h>
#include <strings.h>

static int32_t holds(const vsh_image *image, int32_t channel) {
    return image->holds != NULL && channel >= 0 ? image->holds[channel] : VSH_CHANNEL_DATA;
}

static vsh_result check_image(const char *path, const vsh_image *image, vsh_error *error) {
    if (image == NULL || image->names == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: no image was given", path);
    }
    if (image->width < 1 || image->height < 1) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d × %d pixels, expected at least 1 × 1", path,
                         image->width, image->height);
    }
    if (image->channel_count < 1 || image->channel_count > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d channels, expected 1 … %d", path,
                         image->channel_count, VSH_MAX_CHANNELS);
    }
    for (int32_t c = 0; c < image->channel_count; ++c) {
        const char *name = image->names[c];
        if (name == NULL || name[0] == '\0') {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel %d has no name", path, c);
        }
        if (strnlen(name, VSH_CHANNEL_NAME) == VSH_CHANNEL_NAME) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: channel '%.40s…': the name has more than %d bytes", path, name,
                             VSH_CHANNEL_NAME - 1);
        }
        if (holds(image, c) < VSH_CHANNEL_DATA || holds(image, c) > VSH_CHANNEL_VECTOR) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' holds %d, expected %d … %d", path,
                             name, holds(image, c), VSH_CHANNEL_DATA, VSH_CHANNEL_VECTOR);
        }
        for (int32_t other = 0; other < c; ++other) {
            if (strcmp(image->names[other], name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' is given twice", path, name);
            }
        }
    }
    return VSH_OK;
}

/* A format of OpenImageIO's. */
static vsh_result plan_other(const char *path, const char *ending, vshi_format *format, vsh_error *error) {
    static const char others[] =
        "tif, jpg, tga, bmp, hdr, ppm, pgm, webp, jp2, dpx, gif, sgi, iff, rla, ico, heic, avif";
    VSHI_TRY(vshi_oiio_load(path, error));
    const char *refusal = vshi_oiio()->refusal(path);
    if (refusal != NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: '%s' is not written: %s; expected one of exr, png, %s", path, ending, refusal,
                         others);
    }
    return vshi_oiio()->format(path, format)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: ending '%s': expected one of exr, png, %s", path,
                           ending, others);
}

bool vshi_image_is_written(const char *path) {
    const char *ending = vshi_path_ending(path);
    vshi_format format;
    return strcasecmp(ending, "exr") == 0 || strcasecmp(ending, vshi_png_format.name) == 0 ||
           (vshi_oiio_load(path, NULL) == VSH_OK && vshi_oiio()->format(path, &format));
}

static vsh_result plan_format(const char *path, const vsh_image *image, vshi_write_plan *plan,
                              vsh_error *error) {
    const char *ending = vshi_path_ending(path);
    plan->exr = strcasecmp(ending, "exr") == 0;
    plan->png = strcasecmp(ending, vshi_png_format.name) == 0;
    plan->format = vshi_png_format;
    if (plan->exr) {
        return VSH_OK;
    }
    if (!plan->png) {
        VSHI_TRY(plan_other(path, ending, &plan->format, error));
    }
    if (image->width > plan->format.max_size || image->height > plan->format.max_size) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d × %d pixels: %s has at most %d a side", path,
                         image->width, image->height, plan->format.name, plan->format.max_size);
    }
    return VSH_OK;
}

static vsh_result plan_bits(const char *path, int32_t bits, vshi_write_plan *plan, vsh_error *error) {
    static const struct {
        int32_t bits;
        int32_t flag;
    } table[] = {
        {16, VSHI_BITS_16}, {8, VSHI_BITS_8}, {32, VSHI_BITS_32}}; /* the default is the first one had */
    const int32_t has = plan->exr ? VSHI_BITS_16 | VSHI_BITS_32 : plan->format.bits;
    if (plan->exr && bits == 0) {
        bits = 32;
    }
    for (size_t i = 0; i < sizeof table / sizeof table[0]; ++i) {
        if ((has & table[i].flag) != 0 && (bits == 0 || bits == table[i].bits)) {
            plan->bits = table[i].bits;
            return VSH_OK;
        }
    }
    return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d bits: %s has%s%s%s", path, bits,
                     plan->exr ? "exr" : plan->format.name, (has & VSHI_BITS_8) != 0 ? " 8" : "",
                     (has & VSHI_BITS_16) != 0 ? " 16" : "", (has & VSHI_BITS_32) != 0 ? " 32" : "");
}

/* Takes from a packing what the format does not have: an error where the caller asked for it by name. */
static vsh_result fit_pack(const char *path, const vshi_format *format, bool asked, vshi_pack *pack,
                           vsh_error *error) {
    vshi_pack_entry *entries = pack->entries;
    if (format->alpha == VSHI_ALPHA_NONE && entries[VSHI_PACK_ALPHA].given) {
        if (asked) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pack: A is given, but %s has no alpha", path,
                             format->name);
        }
        entries[VSHI_PACK_ALPHA].given = false;
    }
    if (format->alpha == VSHI_ALPHA_ALWAYS && !entries[VSHI_PACK_ALPHA].given) {
        entries[VSHI_PACK_ALPHA] = (vshi_pack_entry){true, -1, 1.0f};
    }
    for (int key = 1; key < VSHI_PACK_ALPHA && format->grey; ++key) {
        if (asked && entries[key].given &&
            (!entries[0].given || entries[key].channel != entries[0].channel ||
             entries[key].constant != entries[0].constant)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pack: %s is not R, but the format is grey", path,
                             vshi_pack_keys[key]);
        }
        entries[key].given = false;
    }
    return VSH_OK;
}

/* Every channel under its own name. */
static void add_channels(const vsh_image *image, vshi_write_plan *plan) {
    vshi_planes *planes = &plan->planes;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        plan->channel[planes->count] = c;
        planes->planes[planes->count++] = (vshi_image_plane){.name = image->names[c]};
    }
}

/* R, G and B of the image's picture, if it has one and there is room. */
static bool add_picture(const vsh_image *image, vshi_write_plan *plan) {
    vshi_planes *planes = &plan->planes;
    vshi_picture picture;
    if (!vshi_picture_of(image, &picture) || planes->count + 3 > VSH_MAX_CHANNELS) {
        return false;
    }
    for (int c = 0; c < 3; ++c) {
        plan->channel[planes->count] = picture.rgb[c];
        planes->planes[planes->count++] =
            (vshi_image_plane){.name = vshi_pack_keys[c], .is_grey = picture.rgb[c] < 0};
    }
    if (picture.rgb[0] < 0) {
        plan->picture = picture;
    }
    vshi_picture_text(&picture, image, planes->rgb, sizeof planes->rgb);
    return true;
}

/* The picture alone: R, G, B, and A where the image and the format have it. */
static vsh_result pack_picture(const char *path, const vsh_image *image, vshi_write_plan *plan,
                               vsh_error *error) {
    if (!add_picture(image, plan)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: pack: '%s': no channel shadow.NAME, ao or irradiance to make a picture of",
                         path, VSHI_PACK_PICTURE);
    }
    vshi_planes *planes = &plan->planes;
    const int32_t format_alpha = plan->exr ? VSHI_ALPHA_KEPT : plan->format.alpha;
    if (!plan->exr && plan->format.grey) {
        planes->count = 1;
    }
    int32_t alpha = -1;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        alpha = strcmp(image->names[c], "A") == 0 ? c : alpha;
    }
    if (format_alpha == VSHI_ALPHA_ALWAYS || (format_alpha == VSHI_ALPHA_KEPT && alpha >= 0)) {
        plan->channel[planes->count] = alpha;
        planes->planes[planes->count++] =
            (vshi_image_plane){.name = vshi_pack_keys[VSHI_PACK_ALPHA], .constant = 1.0f};
    }
    return VSH_OK;
}

static vsh_result plan_planes(const char *path, const vsh_image *image, const char *text,
                              vshi_write_plan *plan, vsh_error *error) {
    vshi_planes *planes = &plan->planes;
    *planes = (vshi_planes){.width = image->width, .height = image->height};
    plan->picture = (vshi_picture){.ao = -1};
    const bool named = text != NULL && strcmp(text, VSHI_PACK_CHANNELS) == 0;
    if (named && !plan->exr) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pack: '%s': %s cannot name channels", path, text,
                         plan->format.name);
    }
    if (plan->exr && (text == NULL || named)) {
        add_channels(image, plan);
        if (!named) {
            add_picture(image, plan);
        }
        return VSH_OK;
    }
    if (text != NULL && strcmp(text, VSHI_PACK_PICTURE) == 0) {
        return pack_picture(path, image, plan, error);
    }
    char default_text[VSHI_PACK_TEXT];
    vsh_image_default_pack(image, default_text, sizeof default_text);
    vshi_pack pack;
    const vsh_result result = vshi_pack_parse(text != NULL ? text : default_text, image, &pack, error);
    if (result != VSH_OK) {
        return result;
    }
    const vsh_result fits = plan->exr ? VSH_OK : fit_pack(path, &plan->format, text != NULL, &pack, error);
    if (fits != VSH_OK) {
        return fits;
    }
    for (int key = 0; key < VSHI_PACK_KEYS; ++key) {
        const vshi_pack_entry *entry = &pack.entries[key];
        /* the other formats have R, G and B whether given or not: what is not given is 0 */
        if (entry->given || (!plan->exr && key < (plan->format.grey ? 1 : VSHI_PACK_ALPHA))) {
            const int32_t channel = entry->given ? entry->channel : -1;
            plan->channel[planes->count] = channel;
            planes->planes[planes->count++] =
                (vshi_image_plane){.name = vshi_pack_keys[key],
                                   .constant = entry->constant,
                                   .is_signed = holds(image, channel) == VSH_CHANNEL_VECTOR};
        }
    }
    return VSH_OK;
}

/* --- what numbers of a file stand for */

double vsh_srgb_to_linear(double encoded) {
    return vshi_from_srgb(encoded);
}

static float encode_srgb(float value) {
    return (float)vshi_to_srgb((double)value);
}

/* Which planes are light, and which go through a curve. */
static vsh_result plan_colors(const char *path, const vsh_image *image, int32_t color_space,
                              vshi_write_plan *plan, vsh_error *error) {
    if (vsh_get_name(VSH_NAMES_COLOR, color_space) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: color_space %d is out of range %d … %d", path,
                         color_space, VSH_COLOR_AUTO, VSH_COLOR_ENCODED);
    }
    if (plan->exr || plan->bits == 32) {
        return color_space != VSH_COLOR_SRGB
                   ? VSH_OK
                   : vshi_fail(error, VSH_ERROR_ARGUMENT,
                               "%s: color space srgb: floats are linear; expected 8 or 16 bits of another "
                               "format",
                               path);
    }
    vshi_planes *planes = &plan->planes;
    int32_t lights = 0, others = 0;
    for (int32_t p = 0; p < planes->count; ++p) {
        vshi_image_plane *plane = &planes->planes[p];
        const int32_t channel = plan->channel[p];
        plane->is_color = holds(image, channel) == VSH_CHANNEL_LIGHT;
        if (strcmp(plane->name, vshi_pack_keys[VSHI_PACK_ALPHA]) != 0) {
            lights += plane->is_color;
            others += !plane->is_color && (channel >= 0 || plane->is_grey); /* 0 and 1 are either */
        }
    }
    const bool encode =
        color_space == VSH_COLOR_SRGB || (color_space == VSH_COLOR_AUTO && lights > 0 && others == 0);
    planes->is_srgb = encode || color_space == VSH_COLOR_ENCODED;
    for (int32_t p = 0; p < planes->count && encode; ++p) {
        vshi_image_plane *plane = &planes->planes[p];
        if (!plane->is_signed && strcmp(plane->name, vshi_pack_keys[VSHI_PACK_ALPHA]) != 0) {
            plane->encode = encode_srgb;
        }
    }
    return VSH_OK;
}

vsh_result vshi_write_plan_make(const char *path, const vsh_image *image, const vsh_image_options *options,
                                vshi_write_plan *plan, vsh_error *error) {
    vsh_image_options full = vsh_image_options_default();
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_image_options", error));
    if (path == NULL || path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "image path: it is empty");
    }
    VSHI_TRY(check_image(path, image, error));
    VSHI_TRY(plan_format(path, image, plan, error));
    if (!plan->exr) { /* whose rows are written as they come */
        VSHI_TRY(vshi_check_values(path, image->width, image->height, image->channel_count, error));
    }
    VSHI_TRY(plan_bits(path, full.bits, plan, error));
    VSHI_TRY(plan_planes(path, image, full.pack, plan, error));
    VSHI_TRY(plan_colors(path, image, full.color_space, plan, error));
    plan->planes.attributes = full.attributes;
    plan->planes.attribute_count = full.attribute_count;
    return vshi_attributes_check(path, full.attributes, full.attribute_count, error);
}
