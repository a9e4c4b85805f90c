/* What image files have in common: what may be written, and who writes and reads it. */
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "image/exr.h"
#include "image/pack.h"
#include "image/planes.h"
#include "image/png.h"
#include "shim/oiio.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* How a path is to be written: what the checks found out. */
typedef struct write_plan {
    bool exr;
    vshi_format format; /* where it is not EXR */
    int32_t bits;       /* 8, 16 or 32 */
    vshi_planes planes;
} write_plan;

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
        for (int32_t other = 0; other < c; ++other) {
            if (strcmp(image->names[other], name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' is given twice", path, name);
            }
        }
    }
    return vshi_check_values(path, image->width, image->height, image->channel_count, error);
}

static vsh_result plan_format(const char *path, const vsh_image *image, write_plan *plan, vsh_error *error) {
    const char *ending = vshi_path_ending(path);
    plan->exr = strcasecmp(ending, "exr") == 0;
    if (plan->exr) {
        return VSH_OK;
    }
    if (!vshi_oiio_format(path, &plan->format)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: ending '%s': expected one of exr, %s", path, ending,
                         vshi_oiio_endings());
    }
    if (image->width > plan->format.max_size || image->height > plan->format.max_size) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d × %d pixels: %s has at most %d a side", path,
                         image->width, image->height, plan->format.name, plan->format.max_size);
    }
    return VSH_OK;
}

static vsh_result plan_bits(const char *path, int32_t bits, write_plan *plan, vsh_error *error) {
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

static vsh_result plan_planes(const char *path, const vsh_image *image, const char *text, write_plan *plan,
                              vsh_error *error) {
    vshi_planes *planes = &plan->planes;
    *planes = (vshi_planes){.width = image->width, .height = image->height};
    if (plan->exr && text == NULL) {
        planes->count = image->channel_count;
        for (int32_t c = 0; c < image->channel_count; ++c) {
            const float *values = image->planes != NULL ? image->planes[c] : NULL;
            planes->planes[c] = (vshi_plane){image->names[c], values, 0.0f};
        }
        return VSH_OK;
    }
    char default_text[VSHI_PACK_TEXT];
    vsh_image_default_pack(image, default_text, sizeof default_text);
    vshi_pack pack;
    const vsh_result result = vshi_pack_parse(text != NULL ? text : default_text, image, &pack, error);
    if (result != VSH_OK) {
        return result;
    }
    if (!plan->exr && !plan->format.alpha && pack.entries[VSHI_PACK_ALPHA].given) {
        if (text != NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: pack: A is given, but %s has no alpha", path,
                             plan->format.name);
        }
        pack.entries[VSHI_PACK_ALPHA].given = false;
    }
    for (int key = 0; key < VSHI_PACK_KEYS; ++key) {
        const vshi_pack_entry *entry = &pack.entries[key];
        /* the other formats have R, G and B whether given or not: what is not given is 0 */
        if (entry->given || (!plan->exr && key != VSHI_PACK_ALPHA)) {
            const bool channel = entry->given && entry->channel >= 0;
            const float *values = channel && image->planes != NULL ? image->planes[entry->channel] : NULL;
            planes->planes[planes->count++] = (vshi_plane){vshi_pack_keys[key], values, entry->constant};
        }
    }
    return VSH_OK;
}

static vsh_result plan_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                             write_plan *plan, vsh_error *error) {
    vsh_image_options full = vsh_image_options_default();
    vsh_result result = vshi_options_resolve(options, &full, sizeof full, "vsh_image_options", error);
    if (result != VSH_OK) {
        return result;
    }
    if (path == NULL || path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "image path: it is empty");
    }
    result = check_image(path, image, error);
    if (result == VSH_OK) {
        result = plan_format(path, image, plan, error);
    }
    if (result == VSH_OK) {
        result = plan_bits(path, full.bits, plan, error);
    }
    if (result == VSH_OK) {
        result = plan_planes(path, image, full.pack, plan, error);
    }
    return result;
}

vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                           vsh_error *error) {
    VSHI_FLOATS;
    write_plan plan;
    const vsh_result result = plan_write(path, image, options, &plan, error);
    return result == VSH_OK ? vshi_output_check(path, error) : result;
}

vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                           vsh_error *error) {
    VSHI_FLOATS;
    write_plan plan;
    vsh_result result = plan_write(path, image, options, &plan, error);
    if (result != VSH_OK) {
        return result;
    }
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (image->planes == NULL || image->planes[c] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: channel '%s' has no values", path,
                             image->names[c]);
        }
    }
    vshi_output output;
    result = vshi_output_begin(&output, path, error);
    if (result != VSH_OK) {
        return result;
    }
    result = plan.exr ? vshi_exr_write(output.temporary, path, &plan.planes, plan.bits, error)
                      : vshi_oiio_write(output.temporary, path, &plan.format, &plan.planes, plan.bits, error);
    if (result != VSH_OK) {
        vshi_output_abandon(&output);
        return result;
    }
    return vshi_output_commit(&output, error);
}

typedef vsh_result read_fn(const char *path, vsh_image_file **file, vsh_error *error);

/* Looks at the first bytes: an EXR file is one whatever its ending says. */
static vsh_result find_reader(const char *path, read_fn **reader, vsh_error *error) {
    static const unsigned char exr[] = {0x76, 0x2f, 0x31, 0x01};
    static const unsigned char png[] = {0x89, 'P', 'N', 'G'};
    unsigned char start[4] = {0};
    struct stat status;
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: it is a folder", path);
    }
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, strerror(errno));
    }
    const size_t count = fread(start, 1, sizeof start, file);
    const bool failed = ferror(file) != 0;
    fclose(file);
    if (failed) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path);
    }
    if (count == sizeof start && memcmp(start, exr, sizeof exr) == 0) {
        *reader = vshi_exr_read;
    } else if (memcmp(start, png, sizeof png) == 0 || strcasecmp(vshi_path_ending(path), "png") == 0) {
        *reader = vshi_png_read;
    } else {
        *reader = vshi_oiio_read;
    }
    return VSH_OK;
}

vsh_result vsh_image_read(const char *path, vsh_image_file **file, vsh_error *error) {
    VSHI_FLOATS;
    if (file == NULL || path == NULL || path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_image_read: no %s was given",
                         file == NULL ? "place for the image" : "path");
    }
    *file = NULL;
    read_fn *reader = NULL;
    const vsh_result result = find_reader(path, &reader, error);
    return result == VSH_OK ? reader(path, file, error) : result;
}
