/* Which reader a file is for. */
#include "base/file.h"
#include "base/floats.h"
#include "base/input.h"
#include "base/job.h"
#include "base/try.h"
#include "image/exr.h"
#include "image/oiio.h"
#include "image/png.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

typedef vsh_result read_fn(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

static vsh_result read_by_oiio(const char *path, const vsh_run *run, vsh_image_file **file,
                               vsh_error *error) {
    return vshi_oiio_read(path, NULL, run, file, error);
}

/* Looks at the first bytes: an EXR file is one whatever its ending says. */
static vsh_result find_reader(const char *path, read_fn **reader, vsh_error *error) {
    static const unsigned char exr[] = {0x76, 0x2f, 0x31, 0x01};
    static const unsigned char png[] = {0x89, 'P', 'N', 'G'};
    unsigned char start[4] = {0};
    FILE *file;
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &file, &size, error));
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
    } else if (strcasecmp(vshi_path_ending(path), "exr") == 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is no EXR file, or cut short", path);
    } else {
        *reader = read_by_oiio;
    }
    return VSH_OK;
}

vsh_result vsh_image_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(file);
    *file = NULL;
    VSHI_NEEDS(path);
    if (path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_image_read: no path was given");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (full.reader != NULL) {
        return vshi_image_from_reader(path, NULL, &full, file, error);
    }
    read_fn *reader = NULL;
    VSHI_TRY(find_reader(path, &reader, error));
    return reader(path, &full, file, error);
}

static const char *format_of(const unsigned char *bytes, size_t size) {
    static const struct {
        const char *format, *magic;
        size_t length, at;
    } formats[] = {{"png", "\x89PNG", 4, 0}, {"jpeg", "\xff\xd8\xff", 3, 0}, {"webp", "WEBP", 4, 8}};
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; ++i) {
        if (size >= formats[i].at + formats[i].length &&
            memcmp(bytes + formats[i].at, formats[i].magic, formats[i].length) == 0) {
            return formats[i].format;
        }
    }
    return NULL;
}

vsh_result vshi_image_read_bytes(const char *name, const void *at, size_t size, const vsh_run *run,
                                 vsh_image_file **file, vsh_error *error) {
    const vshi_image_bytes bytes = {at, size, format_of(at, size)};
    *file = NULL;
    if (bytes.format == NULL) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: is neither PNG nor JPEG nor WebP", name);
    }
    return run->reader != NULL                ? vshi_image_from_reader(name, &bytes, run, file, error)
           : strcmp(bytes.format, "png") == 0 ? vshi_png_read_bytes(name, &bytes, run, file, error)
                                              : vshi_oiio_read(name, &bytes, run, file, error);
}
