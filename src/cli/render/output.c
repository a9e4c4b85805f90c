/* Pictures as files. */
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"
#include "render.h"

#include <stdlib.h>
#include <string.h>

/* Floats of a pixel (colour, alpha, depth, normal), encoded channels (R, G, B, A), planes of a float file. */
enum { FLOATS = 8, ENCODED = 4, PLANES = 6 };

static const char *const linear_names[FLOATS] = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"};

/* Formats of floats get them; all others are for the eye. */
static bool is_linear(const char *path) {
    return cli_has_ending(path, "exr") || cli_has_ending(path, "hdr") || cli_has_ending(path, "rgbe") ||
           cli_has_ending(path, "rla");
}

int render_output_check(const render_settings *s) {
    const char *path = s->bake.output;
    for (size_t i = 0; i < s->lightmap_count; ++i) {
        if (cli_same_file(path, s->lightmaps[i])) {
            return cli_usage("%s: the output is also a lightmap", path);
        }
    }
    if (s->bake.stats != NULL && cli_same_file(path, s->bake.stats)) {
        return cli_usage("%s: both the output and the --stats file", path);
    }
    const bool linear = is_linear(path);
    const vsh_image image = {s->width, s->height, s->transparent || linear ? 4 : 3, linear_names, NULL, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = linear ? 0 : 8;
    vsh_error error;
    if (vsh_image_check(path, &image, &options, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    return cli_temporary_check(path);
}

uint64_t render_picture_bytes(const render_settings *s) {
    const uint64_t pixels = (uint64_t)s->width * (uint64_t)s->height;
    const uint64_t more = is_linear(s->bake.output) ? PLANES : 0;
    return pixels * (FLOATS + ENCODED + more) * sizeof(float);
}

int render_picture_create(const render_settings *s, const cli_provenance *origin, render_picture *p) {
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    *p = (render_picture){.memory = calloc(pixels * (FLOATS + ENCODED), sizeof(float)), .origin = origin};
    if (p->memory == NULL) {
        return cli_out_of_memory("picture");
    }
    p->picture = (vsh_picture){.color = p->memory,
                               .alpha = p->memory + 3 * pixels,
                               .depth = p->memory + 4 * pixels,
                               .normal = p->memory + 5 * pixels};
    for (size_t i = 0; i < ENCODED; ++i) {
        p->encoded[i] = p->memory + (FLOATS + i) * pixels;
    }
    return CLI_OK;
}

void render_picture_free(render_picture *p) {
    free(p->memory);
}

static int write_image(const char *path, const vsh_image *image, int32_t bits, const cli_provenance *origin) {
    vsh_image_options options = vsh_image_options_default();
    vsh_error error;
    options.bits = bits;
    options.color_space = bits == 8 ? VSH_COLOR_ENCODED : VSH_COLOR_AUTO;
    options.attributes = origin->attributes;
    options.attribute_count = origin->count;
    const vsh_result result = vsh_image_write(path, image, &options, &error);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

/* Triples as the planes that files have. */
static int write_linear(const render_settings *s, const render_picture *p, const char *path) {
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    float *memory = malloc(6 * pixels * sizeof *memory);
    if (memory == NULL) {
        return cli_out_of_memory("picture");
    }
    const float *planes[FLOATS] = {
        memory,           memory + pixels,     memory + 2 * pixels, p->picture.alpha,
        p->picture.depth, memory + 3 * pixels, memory + 4 * pixels, memory + 5 * pixels};
    for (size_t i = 0; i < pixels; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            memory[c * pixels + i] = p->picture.color[3 * i + c];
            memory[(3 + c) * pixels + i] = p->picture.normal[3 * i + c];
        }
    }
    const vsh_image image = {s->width,     s->height, cli_has_ending(path, "exr") ? FLOATS : 4,
                             linear_names, planes,    NULL};
    const int code = write_image(path, &image, 0, p->origin);
    free(memory);
    return code;
}

static int encode(const render_settings *s, const render_picture *p) {
    vsh_error error;
    return vsh_picture_encode(&p->picture, s->width, s->height, s->exposure, p->encoded,
                              s->transparent ? p->encoded[3] : NULL, &error) == VSH_OK
               ? CLI_OK
               : cli_fail(&error);
}

int render_output_write(const render_settings *s, const render_picture *p) {
    const char *path = s->bake.output;
    if (is_linear(path)) {
        return write_linear(s, p, path);
    }
    const int code = encode(s, p);
    const vsh_image image = {
        s->width, s->height, s->transparent ? 4 : 3, linear_names, (const float *const *)p->encoded, NULL};
    return code == CLI_OK ? write_image(path, &image, 8, p->origin) : code;
}
