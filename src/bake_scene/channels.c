#include "bake_scene/channels.h"

#include "base/bytes.h"
#include "base/try.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- the table */

static bool has_shadow(const vsh_scene *scene) {
    return scene->light_count > 0;
}

static bool has_ao(const vsh_scene *scene) {
    return scene->ao != 0;
}

/* Errors that are left: only where the method knows them. */
static bool has_shadow_error(const vsh_scene *scene) {
    return scene->error && (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) != 0;
}

static bool has_ao_error(const vsh_scene *scene) {
    return scene->error && scene->ao && (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
}

static bool has_irradiance(const vsh_scene *scene) {
    return scene->irradiance != 0;
}

static bool has_bent(const vsh_scene *scene) {
    return scene->bent != 0;
}

static bool has_tint(const vsh_scene *scene) {
    return scene->tint.type != VSH_TINT_NONE;
}

static bool has_invalid(const vsh_scene *scene) {
    return scene->invalid != 0;
}

static bool always(const vsh_scene *scene) {
    (void)scene;
    return true;
}

static void bind_shadow(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    (void)scene;
    lightmap->shadow = values;
}

static void bind_ao(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    (void)scene;
    lightmap->ao = values[0];
}

static void bind_shadow_error(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    (void)scene;
    lightmap->shadow_error = values;
}

static void bind_ao_error(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    (void)scene;
    lightmap->ao_error = values[0];
}

static void bind_irradiance(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    lightmap->irradiance = values[0];
    lightmap->ambient = scene->has_ambient ? scene->ambient : NULL;
}

static void bind_bent(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    lightmap->bent = values[0];
    lightmap->bent_space = scene->bent - 1;
}

static void bind_tint(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    (void)scene;
    lightmap->tint = values;
}

static void bind_coverage(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    (void)scene;
    lightmap->coverage = values[0];
}

/* A kind of value, and the channels that hold it, in the order of their names in files. To add one: a row
 * here, its member in vsh_lightmap and who fills that in src/bake. */
static const struct kind {
    const char *name; /* "ao"; "shadow.NAME" where there is one for each light */
    bool per_light;
    const char *axes; /* of three that are baked interleaved, "irradiance.R"; NULL: one channel */
    bool (*is_baked)(const vsh_scene *scene);
    /* tells the bake where its values go: [light_count] arrays, or one; NULL: vshi_channels.invalid */
    void (*bind)(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values);
} kinds[] = {
    {"shadow", true, NULL, has_shadow, bind_shadow},
    {"ao", false, NULL, has_ao, bind_ao},
    {"error", true, NULL, has_shadow_error, bind_shadow_error},
    {"error.ao", false, NULL, has_ao_error, bind_ao_error},
    {"irradiance", false, "RGB", has_irradiance, bind_irradiance},
    {"bent", false, "XYZ", has_bent, bind_bent},
    {"tint", true, "RGB", has_tint, bind_tint},
    {"invalid", false, NULL, has_invalid, NULL},
    {"A", false, NULL, always, bind_coverage},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

/* Values of a kind that a scene has, each of one channel or three. */
static size_t count_of(const struct kind *kind, const vsh_scene *scene) {
    return !kind->is_baked(scene) ? 0 : kind->per_light ? scene->light_count : 1;
}

static size_t channels_of(const struct kind *kind) {
    return kind->axes != NULL ? 3 : 1;
}

/* --- names */

/* Names the channels of one value and returns how many there are. */
static size_t name_value(const struct kind *kind, const vsh_light *light, char (*names)[VSH_CHANNEL_NAME]) {
    char value[VSH_CHANNEL_NAME - 2];
    snprintf(value, sizeof value, "%s%s%s", kind->name, light != NULL ? "." : "",
             light != NULL ? light->name : "");
    if (kind->axes == NULL) {
        snprintf(names[0], sizeof names[0], "%s", value);
        return 1;
    }
    for (size_t c = 0; c < 3; ++c) {
        snprintf(names[c], sizeof names[c], "%s.%c", value, kind->axes[c]);
    }
    return 3;
}

vsh_result vshi_channels_name(const vsh_scene *scene, int32_t width, int32_t height, vshi_channels *channels,
                              vsh_error *error) {
    memset(channels, 0, sizeof *channels);
    size_t count = 0;
    for (size_t k = 0; k < KINDS; ++k) {
        const size_t values = count_of(&kinds[k], scene);
        count += values * channels_of(&kinds[k]);
        channels->triple_count += kinds[k].axes != NULL ? values : 0;
    }
    if (count > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: %zu channels, at most %d", count,
                         VSH_MAX_CHANNELS);
    }
    channels->names = calloc(count, sizeof *channels->names);
    channels->name_list = calloc(count, sizeof *channels->name_list);
    channels->planes = calloc(count, sizeof *channels->planes);
    channels->triples = calloc(channels->triple_count + 1, sizeof *channels->triples);
    if (channels->names == NULL || channels->name_list == NULL || channels->planes == NULL ||
        channels->triples == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "channels: the system refused memory");
    }
    size_t at = 0;
    for (size_t k = 0; k < KINDS; ++k) {
        for (size_t i = 0; i < count_of(&kinds[k], scene); ++i) {
            at += name_value(&kinds[k], kinds[k].per_light ? &scene->lights[i] : NULL, channels->names + at);
        }
    }
    for (size_t i = 0; i < count; ++i) {
        channels->name_list[i] = channels->names[i];
    }
    channels->image = (vsh_image){width, height, (int32_t)count, channels->name_list,
                                  (const float *const *)channels->planes};
    return VSH_OK;
}

/* --- values */

static void bind_all(vshi_channels *channels, const vsh_scene *scene) {
    float *const *plane = channels->planes, *const *triple = channels->triples;
    for (size_t k = 0; k < KINDS; ++k) {
        const struct kind *kind = &kinds[k];
        const size_t count = count_of(kind, scene);
        if (count > 0 && kind->bind != NULL) {
            kind->bind(&channels->lightmap, scene, kind->axes != NULL ? triple : plane);
        }
        triple += kind->axes != NULL ? count : 0;
        plane += count * channels_of(kind);
    }
    channels->lightmap.tint_by = scene->tint; /* of irradiance too */
    channels->lightmap.invalid = channels->invalid;
}

vsh_lightmap vshi_channels_shape(const vsh_scene *scene) {
    static float plane;
    float *const any[] = {&plane};
    vsh_lightmap lightmap = {.invalid = scene->invalid ? &plane : NULL};
    for (size_t k = 0; k < KINDS; ++k) {
        if (count_of(&kinds[k], scene) > 0 && kinds[k].bind != NULL) {
            kinds[k].bind(&lightmap, scene, any);
        }
    }
    return lightmap;
}

vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, int32_t rows, bool invalid,
                                  uint64_t limit, const char *output, vsh_error *error) {
    const size_t count = (size_t)channels->image.channel_count;
    const size_t texels = (size_t)channels->image.width * (size_t)rows; /* at most 2^32 */
    const double bytes = (double)texels * sizeof(float) *
                         ((double)count + 3.0 * (double)channels->triple_count + (invalid ? 1.0 : 0.0));
    if (bytes > (double)SIZE_MAX / 2.0 || (limit > 0 && bytes > (double)limit)) {
        char need[VSHI_BYTES_ROOM], have[VSHI_BYTES_ROOM];
        return vshi_fail(
            error, VSH_ERROR_LIMIT, "%s: %d × %d texels in %zu channels need %s; the memory limit is %s",
            output, channels->image.width, rows, count, vshi_bytes_text((uint64_t)bytes, need, sizeof need),
            vshi_bytes_text(limit, have, sizeof have));
    }
    channels->rows = rows;
    bool all = true;
    for (size_t i = 0; i < count && all; ++i) {
        all = (channels->planes[i] = calloc(texels, sizeof(float))) != NULL;
    }
    for (size_t t = 0; t < channels->triple_count && all; ++t) {
        all = (channels->triples[t] = calloc(texels, 3 * sizeof(float))) != NULL;
    }
    if (invalid && all) {
        all = (channels->invalid = calloc(texels, sizeof(float))) != NULL;
    }
    if (!all) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", output);
    }
    bind_all(channels, scene);
    return VSH_OK;
}

static void split(const float *values, size_t texels, float *const *planes) {
    for (size_t i = 0; i < texels; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            planes[c][i] = values[3 * i + c];
        }
    }
}

void vshi_channels_split(vshi_channels *channels, const vsh_scene *scene) {
    const size_t texels = (size_t)channels->image.width * (size_t)channels->rows;
    float *const *plane = channels->planes, *const *triple = channels->triples;
    for (size_t k = 0; k < KINDS; ++k) {
        const struct kind *kind = &kinds[k];
        for (size_t i = 0; i < count_of(kind, scene); ++i, plane += channels_of(kind)) {
            if (kind->axes != NULL) {
                split(*triple++, texels, plane);
            } else if (kind->bind == NULL) {
                for (size_t t = 0; t < texels; ++t) {
                    plane[0][t] = channels->invalid[t] > 0.0f ? 1.0f : 0.0f;
                }
            }
        }
    }
}

void vshi_channels_free(vshi_channels *channels) {
    for (size_t t = 0; channels->triples != NULL && t < channels->triple_count; ++t) {
        free(channels->triples[t]);
    }
    for (int32_t i = 0; channels->planes != NULL && i < channels->image.channel_count; ++i) {
        free(channels->planes[i]);
    }
    free(channels->invalid);
    free(channels->triples);
    free(channels->planes);
    free(channels->name_list);
    free(channels->names);
    memset(channels, 0, sizeof *channels);
}
