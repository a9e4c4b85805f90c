/* Writes images, whole or row by row: formats, packs, color spaces. */
#include "base/elementary.h"
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/text.h"
#include "io/image/image.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { KEYS = 4, ALPHA = 3 /* index of A */ };

static const char *const keys[KEYS] = {"R", "G", "B", "A"};

/* --- the picture, R, G and B, of channels with other names. Other programs show it. */

/* Channels of an image that make up its picture. */
typedef struct picture {
    int32_t rgb[3];                   /* one channel each; -1: vshi_grey_at() of the channels below */
    int32_t light_count;              /* channels shadow.NAME */
    int32_t lights[VSH_MAX_CHANNELS]; /* [light_count] */
    int32_t ao;                       /* -1: none */
} picture;

/* Finds the picture of an image: its irradiance, else the mean of its lights' shadows times its AO. Returns
 * false if it has none of these, or channels R, G or B. */
static bool find_picture(const vsh_image *image, picture *found) {
    static const char light_prefix[] = "shadow.";
    static const char *const irradiance[3] = {"irradiance.R", "irradiance.G", "irradiance.B"};
    *found = (picture){.rgb = {-1, -1, -1}, .ao = -1};
    for (int32_t i = 0; i < image->channel_count; ++i) {
        const char *name = image->names[i] != NULL ? image->names[i] : "";
        for (int c = 0; c < 3; ++c) {
            if (strcmp(name, keys[c]) == 0) {
                return false;
            }
            found->rgb[c] = strcmp(name, irradiance[c]) == 0 ? i : found->rgb[c];
        }
        if (strncmp(name, light_prefix, sizeof light_prefix - 1) == 0) {
            found->lights[found->light_count++] = i;
        } else if (strcmp(name, "ao") == 0) {
            found->ao = i;
        }
    }
    if (found->rgb[0] >= 0 && found->rgb[1] >= 0 && found->rgb[2] >= 0) {
        return true;
    }
    const int32_t sources = found->light_count + (found->ao >= 0 ? 1 : 0);
    const int32_t only = sources != 1 ? -1 : found->light_count == 1 ? found->lights[0] : found->ao;
    for (int channel = 0; channel < 3; ++channel) {
        found->rgb[channel] = only;
    }
    return sources > 0;
}

/* Names the sources of a picture: "irradiance", "shadow.sun * ao", "mean of 3 shadows". */
static void describe_picture(const picture *from, const vsh_image *image, char *text, size_t capacity) {
    char lights[VSH_CHANNEL_NAME + 32] = "";
    if (from->rgb[0] != from->rgb[1]) {
        snprintf(text, capacity, "irradiance");
        return;
    }
    if (from->light_count == 1) {
        snprintf(lights, sizeof lights, "%s", image->names[from->lights[0]]);
    } else if (from->light_count > 1) {
        snprintf(lights, sizeof lights, "mean of %d shadows", from->light_count);
    }
    snprintf(text, capacity, "%s%s%s", lights, lights[0] != '\0' && from->ao >= 0 ? " * " : "",
             from->ao >= 0 ? "ao" : "");
}

/* --- packs: "R=shadow.sun,G=ao,A=A", parts between commas, each a key, '=' and a channel or 0 or 1 */

/* Words instead of a pack: only the named channels; only the picture. */
static const char pack_channels[] = "channels", pack_picture[] = "rgb";

typedef struct pack_entry {
    bool given;
    int32_t channel; /* index into the image; -1: `constant` */
    float constant;
} pack_entry;

typedef pack_entry pack[KEYS]; /* by key */

static bool ends_value(char c) {
    return c == ',' || c == '\0';
}

/* Finds the channel with its name at `value`, before a comma or the end; -1: none. Names may contain commas,
 * so the longest match wins. */
static int32_t find_channel(const char *value, const vsh_image *image, size_t *length) {
    int32_t found = -1;
    *length = 0;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        const size_t size = strlen(image->names[c]);
        if (size > *length && strncmp(value, image->names[c], size) == 0 && ends_value(value[size])) {
            found = c;
            *length = size;
        }
    }
    return found;
}

static int find_key(const char *part) {
    for (int key = 0; key < KEYS; ++key) {
        if (part[0] == keys[key][0] && part[1] == '=') {
            return key;
        }
    }
    return -1;
}

/* "shadow.sun, ao, A; 0 and 1 are constants". */
static void list_channels(const vsh_image *image, char *text, size_t capacity) {
    enum { ROOM = 48 };
    size_t used = 0;
    int32_t c = 0;
    for (; c < image->channel_count && used + strlen(image->names[c]) + ROOM < capacity; ++c) {
        used += (size_t)snprintf(text + used, capacity - used, "%s%s", c > 0 ? ", " : "", image->names[c]);
    }
    snprintf(text + used, capacity - used, "%s; 0 and 1 are constants",
             c < image->channel_count ? " and others" : "");
}

/* Parses the part at *text and moves to its end. */
static vsh_result parse_part(const char **text, const vsh_image *image, pack made, vsh_error *error) {
    const char *part = *text;
    const int part_length = (int)strcspn(part, ",");
    const int key = find_key(part);
    if (key < 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "pack: part '%.*s': expected R=, G=, B= or A= and a channel, 0 or 1", part_length,
                         part);
    }
    if (made[key].given) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "pack: part '%.*s': %s is given twice", part_length, part,
                         keys[key]);
    }
    const char *value = part + 2;
    size_t length;
    pack_entry entry = {true, find_channel(value, image, &length), 0.0f};
    if (entry.channel < 0) {
        if ((value[0] != '0' && value[0] != '1') || !ends_value(value[1])) {
            char names[400];
            list_channels(image, names, sizeof names);
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "pack: part '%.*s': %s%.*s; there are %s",
                             part_length, part, part_length > 2 ? "no such channel: " : "nothing after '='",
                             part_length - 2, value, names);
        }
        entry.constant = value[0] == '1' ? 1.0f : 0.0f;
        length = 1;
    }
    made[key] = entry;
    *text = value + length;
    return VSH_OK;
}

static vsh_result parse_pack(const char *text, const vsh_image *image, pack made, vsh_error *error) {
    if (text[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "pack: '' is empty: expected such as R=%s",
                         image->names[0]);
    }
    for (const char *at = text;; ++at) {
        const vsh_result result = parse_part(&at, image, made, error);
        if (result != VSH_OK || *at == '\0') {
            return result;
        }
    }
}

/* Fills the default pack. R, G and B hold the irradiance, or else the first three channels; a single channel
 * fills all three. A holds "A". */
static void fill_default_pack(const vsh_image *image, pack made) {
    int32_t channels[KEYS] = {-1, -1, -1, -1}, count = 0;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], keys[ALPHA]) == 0) {
            channels[ALPHA] = c;
        } else if (count < 3) {
            channels[count++] = c;
        }
    }
    picture found;
    if (find_picture(image, &found) && found.rgb[0] >= 0 && found.rgb[0] != found.rgb[1]) { /* irradiance */
        memcpy(channels, found.rgb, sizeof found.rgb);
    } else if (count <= 1) { /* grey; coverage if there is no other channel */
        channels[0] = channels[1] = channels[2] = count == 1 ? channels[0] : channels[ALPHA];
    }
    for (int key = 0; key < KEYS; ++key) {
        made[key] = (pack_entry){.given = channels[key] >= 0, .channel = channels[key]};
    }
}

/* --- the plan: formats, bits and planes */

/* The plan for writing an image, after all checks. */
typedef struct write_plan {
    const vshi_codec *codec;
    vshi_format format;
    int32_t bits;                      /* 8, 16 or 32 */
    vshi_planes planes;                /* without values; names are the image's, or static */
    int32_t channel[VSH_MAX_CHANNELS]; /* of the image, for each plane; -1: the plane's constant, or grey */
    picture picture;                   /* of planes that are grey */
    vsh_image_clipping *clipping;      /* the caller's; may be NULL */
} write_plan;

static int32_t find_content(const vsh_image *image, int32_t channel) {
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
        if (find_content(image, c) < VSH_CHANNEL_DATA || find_content(image, c) > VSH_CHANNEL_VECTOR) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' holds %d, expected %d … %d", path,
                             name, find_content(image, c), VSH_CHANNEL_DATA, VSH_CHANNEL_VECTOR);
        }
        for (int32_t other = 0; other < c; ++other) {
            if (strcmp(image->names[other], name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' is given twice", path, name);
            }
        }
    }
    return VSH_OK;
}

static const vshi_format exr_format = {
    .name = "exr", .bits = VSHI_BITS_16 | VSHI_BITS_32, .alpha = true, .named = true, .max_size = INT32_MAX};
/* libpng's own readers refuse larger sizes by default. */
static const vshi_format png_format = {
    .name = "png", .bits = VSHI_BITS_8 | VSHI_BITS_16, .alpha = true, .max_size = 1000000};

/* Plans a format of OpenImageIO. */
static vsh_result plan_other(const char *path, const char *ending, write_plan *plan, vsh_error *error) {
    VSHI_TRY(vshi_oiio_load(path, error));
    plan->codec = &vshi_oiio()->codec;
    return vshi_oiio()->format(path, &plan->format)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT,
                           "%s: ending '%s': expected one of exr, png, tif, jpg, tga, bmp, hdr, ppm, webp",
                           path, ending);
}

static vsh_result plan_format(const char *path, write_plan *plan, vsh_error *error) {
    const char *ending = vshi_path_ending(path);
    if (strcasecmp(ending, exr_format.name) == 0) {
        plan->codec = &vshi_exr_codec;
        plan->format = exr_format;
        return VSH_OK;
    }
    plan->codec = &vshi_png_codec;
    plan->format = png_format;
    return strcasecmp(ending, png_format.name) == 0 ? VSH_OK : plan_other(path, ending, plan, error);
}

bool vshi_image_is_written(const char *path) {
    write_plan plan;
    return plan_format(path, &plan, NULL) == VSH_OK;
}

static vsh_result check_size(const char *path, const vsh_image *image, const vshi_format *format,
                             vsh_error *error) {
    if (image->width > format->max_size || image->height > format->max_size) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d × %d pixels: %s has at most %d a side", path,
                         image->width, image->height, format->name, format->max_size);
    }
    /* EXR is written row by row, so its size has no limit */
    return format->named ? VSH_OK
                         : vshi_check_values(path, image->width, image->height, image->channel_count, error);
}

static vsh_result plan_bits(const char *path, int32_t bits, write_plan *plan, vsh_error *error) {
    static const struct {
        int32_t bits;
        int32_t flag;
    } table[] = {{16, VSHI_BITS_16}, {8, VSHI_BITS_8}, {32, VSHI_BITS_32}}; /* the first one is the default */
    const int32_t has = plan->format.bits;
    bits = plan->format.named && bits == 0 ? 32 : bits;
    for (size_t i = 0; i < sizeof table / sizeof table[0]; ++i) {
        if ((has & table[i].flag) != 0 && (bits == 0 || bits == table[i].bits)) {
            plan->bits = table[i].bits;
            return VSH_OK;
        }
    }
    return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d bits: %s has%s%s%s", path, bits, plan->format.name,
                     (has & VSHI_BITS_8) != 0 ? " 8" : "", (has & VSHI_BITS_16) != 0 ? " 16" : "",
                     (has & VSHI_BITS_32) != 0 ? " 32" : "");
}

static void add_plane(write_plan *plan, int32_t channel, vshi_image_plane plane) {
    plan->channel[plan->planes.count] = channel;
    plan->planes.planes[plan->planes.count++] = plane;
}

/* Adds R, G and B of the image's picture, if it has one and there is room. */
static bool add_picture(const vsh_image *image, write_plan *plan) {
    picture found;
    if (!find_picture(image, &found) || plan->planes.count + 3 > VSH_MAX_CHANNELS) {
        return false;
    }
    for (int c = 0; c < 3; ++c) {
        add_plane(plan, found.rgb[c], (vshi_image_plane){.name = keys[c], .is_grey = found.rgb[c] < 0});
    }
    if (found.rgb[0] < 0) {
        plan->picture = found;
    }
    describe_picture(&found, image, plan->planes.rgb, sizeof plan->planes.rgb);
    return true;
}

/* Plans the picture alone: R, G, B, and A if image and format have it. */
static vsh_result plan_picture(const char *path, const vsh_image *image, write_plan *plan, vsh_error *error) {
    if (!add_picture(image, plan)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: pack: '%s': no channel shadow.NAME, ao or irradiance to make a picture of",
                         path, pack_picture);
    }
    for (int32_t c = 0; c < image->channel_count && plan->format.alpha; ++c) {
        if (strcmp(image->names[c], keys[ALPHA]) == 0) {
            add_plane(plan, c, (vshi_image_plane){.name = keys[ALPHA]});
        }
    }
    return VSH_OK;
}

static vsh_result plan_pack(const char *path, const vsh_image *image, const char *text, write_plan *plan,
                            vsh_error *error) {
    pack made = {{0}};
    if (text == NULL) {
        fill_default_pack(image, made);
        made[ALPHA].given &= plan->format.alpha;
    } else {
        VSHI_TRY(parse_pack(text, image, made, error));
    }
    if (made[ALPHA].given && !plan->format.alpha) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pack: A is given, but %s has no alpha", path,
                         plan->format.name);
    }
    for (int key = 0; key < KEYS; ++key) {
        const pack_entry *entry = &made[key];
        /* formats other than EXR always have R, G and B: by default 0 */
        if (entry->given || (!plan->format.named && key < ALPHA)) {
            const int32_t channel = entry->given ? entry->channel : -1;
            add_plane(plan, channel,
                      (vshi_image_plane){.name = keys[key],
                                         .constant = entry->constant,
                                         .is_signed = find_content(image, channel) == VSH_CHANNEL_VECTOR});
        }
    }
    return VSH_OK;
}

static vsh_result plan_planes(const char *path, const vsh_image *image, const char *text, write_plan *plan,
                              vsh_error *error) {
    plan->planes = (vshi_planes){.width = image->width, .height = image->height};
    plan->picture = (picture){.ao = -1};
    const bool only_named = text != NULL && strcmp(text, pack_channels) == 0;
    if (only_named && !plan->format.named) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pack: '%s': %s cannot name channels", path, text,
                         plan->format.name);
    }
    if (text != NULL && strcmp(text, pack_picture) == 0) {
        return plan_picture(path, image, plan, error);
    }
    if (!only_named && (text != NULL || !plan->format.named)) {
        return plan_pack(path, image, text, plan, error);
    }
    for (int32_t c = 0; c < image->channel_count; ++c) {
        add_plane(plan, c, (vshi_image_plane){.name = image->names[c]});
    }
    if (!only_named) {
        add_picture(image, plan);
    }
    return VSH_OK;
}

/* --- color spaces */

static float encode_srgb(float value) {
    return (float)vshi_to_srgb((double)value);
}

/* Finds the planes that are light, and those with a curve. */
static vsh_result plan_colors(const char *path, const vsh_image *image, int32_t color_space, write_plan *plan,
                              vsh_error *error) {
    if (vsh_get_name(VSH_NAMES_COLOR, color_space) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: color_space %d is out of range %d … %d", path,
                         color_space, VSH_COLOR_AUTO, VSH_COLOR_ENCODED);
    }
    if (plan->format.named || plan->bits == 32) {
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
        plane->is_color = find_content(image, channel) == VSH_CHANNEL_LIGHT;
        if (strcmp(plane->name, keys[ALPHA]) != 0) {
            lights += plane->is_color;
            others += !plane->is_color && (channel >= 0 || plane->is_grey); /* not constants */
        }
    }
    const bool encode =
        color_space == VSH_COLOR_SRGB || (color_space == VSH_COLOR_AUTO && lights > 0 && others == 0);
    planes->is_srgb = encode || color_space == VSH_COLOR_ENCODED;
    for (int32_t p = 0; p < planes->count && encode; ++p) {
        vshi_image_plane *plane = &planes->planes[p];
        if (!plane->is_signed && strcmp(plane->name, keys[ALPHA]) != 0) {
            plane->encode = encode_srgb;
        }
    }
    return VSH_OK;
}

/* Errors: as vsh_image_check(), without those of the disk. */
static vsh_result make_plan(const char *path, const vsh_image *image, const vsh_image_options *options,
                            write_plan *plan, vsh_error *error) {
    vsh_image_options full = vsh_image_options_default();
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_image_options", error));
    if (path == NULL || path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "image path: it is empty");
    }
    VSHI_TRY(check_image(path, image, error));
    VSHI_TRY(plan_format(path, plan, error));
    VSHI_TRY(check_size(path, image, &plan->format, error));
    VSHI_TRY(plan_bits(path, full.bits, plan, error));
    VSHI_TRY(plan_planes(path, image, full.pack, plan, error));
    VSHI_TRY(plan_colors(path, image, full.color_space, plan, error));
    plan->clipping = full.clipping;
    plan->planes.attributes = full.attributes;
    plan->planes.attribute_count = full.attribute_count;
    return vshi_attributes_check(path, full.attributes, full.attribute_count, error);
}

/* --- writing */

struct vshi_image_writer {
    write_plan plan;
    vshi_output output;
    char *path;
    const char *const *names; /* [channel_count]: the image's */
    int32_t channel_count;
    int32_t row; /* next */
    void *file;  /* the codec's */
    vsh_image_clipping clipping;
};

static void free_writer(vshi_image_writer *writer) {
    if (writer == NULL) {
        return;
    }
    vshi_output_abandon(&writer->output);
    free(writer->path);
    free(writer);
}

/* `whole`: the image is in memory, so it has at most VSHI_MAX_VALUES. */
static vsh_result create(const char *path, const vsh_image *image, const vsh_image_options *options,
                         bool whole, vshi_image_writer **writer, vsh_error *error) {
    vshi_image_writer *made;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE(made, 1, "image", error));
    VSHI_TRY_DONE(make_plan(path, image, options, &made->plan, error));
    if (whole) {
        VSHI_TRY_DONE(vshi_check_values(path, image->width, image->height, image->channel_count, error));
    }
    made->names = image->names;
    made->channel_count = image->channel_count;
    VSHI_TRY_DONE(vshi_copy_text(&made->path, path, path, error));
    VSHI_TRY_DONE(vshi_output_begin(&made->output, path, error));
    const write_plan *plan = &made->plan;
    VSHI_TRY_DONE(plan->codec->begin(made->output.temporary, made->path, &plan->format, &plan->planes,
                                     plan->bits, &made->file, error));
    *writer = made;
    made = NULL;
done:
    free_writer(made);
    return result;
}

vsh_result vshi_image_writer_create(const char *path, const vsh_image *image,
                                    const vsh_image_options *options, vshi_image_writer **writer,
                                    vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(writer);
    return create(path, image, options, false, writer, error);
}

/* Counts texels of light over 1, which integers cut. */
static void count_clipped(vshi_image_writer *writer, size_t texels, const float *const *planes) {
    const vshi_planes *list = &writer->plan.planes;
    const float *light[KEYS];
    const float *coverage = NULL;
    int count = 0;
    for (int32_t p = 0; p < list->count && !writer->plan.format.named; ++p) {
        if (list->planes[p].is_color && list->planes[p].values != NULL && count < KEYS) {
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

vsh_result vshi_image_writer_add(vshi_image_writer *writer, int32_t rows, const float *const *planes,
                                 vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(writer);
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
    const picture *from = &writer->plan.picture;
    list->grey.count = from->light_count;
    for (int32_t i = 0; i < from->light_count; ++i) {
        list->grey.lights[i] = planes[from->lights[i]];
    }
    list->grey.ao = from->ao >= 0 ? planes[from->ao] : NULL;
    count_clipped(writer, (size_t)rows * (size_t)list->width, planes);
    writer->row += rows;
    return writer->plan.codec->add(writer->file, list, rows, error);
}

vsh_result vshi_image_writer_finish(vshi_image_writer *writer, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(writer);
    const int32_t height = writer->plan.planes.height;
    vsh_result result = VSH_OK;
    if (writer->row < height) {
        result = vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d of %d rows were given", writer->path,
                           writer->row, height);
        vshi_image_writer_abandon(writer);
        return result;
    }
    if (writer->plan.clipping != NULL) {
        *writer->plan.clipping = writer->clipping;
    }
    VSHI_TRY_DONE(writer->plan.codec->end(writer->file, error));
    result = vshi_output_commit(&writer->output, error);
done:
    free_writer(writer);
    return result;
}

void vshi_image_writer_abandon(vshi_image_writer *writer) {
    VSHI_FLOATS;
    if (writer != NULL) {
        writer->plan.codec->end(writer->file, NULL);
        free_writer(writer);
    }
}

vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                           vsh_error *error) {
    VSHI_FLOATS;
    vshi_image_writer *writer;
    VSHI_TRY(create(path, image, options, true, &writer, error));
    const vsh_result result = vshi_image_writer_add(writer, image->height, image->planes, error);
    if (result != VSH_OK) {
        vshi_image_writer_abandon(writer);
        return result;
    }
    return vshi_image_writer_finish(writer, error);
}

vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                           vsh_error *error) {
    VSHI_FLOATS;
    write_plan plan;
    VSHI_TRY(make_plan(path, image, options, &plan, error));
    return vshi_output_check(path, error);
}

uint64_t vshi_image_writer_bytes(const char *path, const vsh_image *image, const vsh_image_options *options) {
    write_plan plan;
    return make_plan(path, image, options, &plan, NULL) == VSH_OK
               ? (uint64_t)plan.codec->bytes(&plan.format, &plan.planes, plan.bits)
               : 0;
}
