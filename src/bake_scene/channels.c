#include "bake_scene/channels.h"

#include "bake/planes.h"
#include "base/bytes.h"
#include "base/try.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- which there are */

/* Errors that are left: only where the method knows them. */
static bool has_shadow_error(const vsh_scene *scene) {
    return scene->error && (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) != 0;
}

static bool has_ao_error(const vsh_scene *scene) {
    return scene->error && scene->ao && (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
}

/* Whether a scene's lights, AO and what goes with them ask for a plane; the others are wished for. */
static bool is_asked(const vshi_plane_kind *kind, const vsh_scene *scene) {
    const struct {
        size_t plane;
        bool asked;
    } own[] = {
        {offsetof(vsh_lightmap, shadow), scene->light_count > 0},
        {offsetof(vsh_lightmap, ao), scene->ao != 0},
        {offsetof(vsh_lightmap, shadow_error), has_shadow_error(scene)},
        {offsetof(vsh_lightmap, ao_error), has_ao_error(scene)},
        {offsetof(vsh_lightmap, irradiance), scene->irradiance != 0},
        {offsetof(vsh_lightmap, bent), scene->bent != 0},
        {offsetof(vsh_lightmap, tint), scene->tint.type != VSH_TINT_NONE},
        {offsetof(vsh_lightmap, coverage), true},
    };
    for (size_t i = 0; i < sizeof own / sizeof own[0]; ++i) {
        if (own[i].plane == kind->plane) {
            return own[i].asked;
        }
    }
    return vshi_plane_wished(kind, &scene->planes);
}

/* Values of a kind that a scene has, each of one channel or three. */
static size_t count_of(const vshi_plane_kind *kind, const vsh_scene *scene) {
    return !is_asked(kind, scene) ? 0 : kind->per_light ? scene->light_count : 1;
}

/* The channel is 0 or 1, whatever else the bake tells of invalid texels. */
static bool is_invalid(const vshi_plane_kind *kind) {
    return kind->plane == offsetof(vsh_lightmap, invalid);
}

/* --- names */

/* Names the channels of one value and returns how many there are. */
static size_t name_value(const vshi_plane_kind *kind, const vsh_light *light,
                         char (*names)[VSH_CHANNEL_NAME]) {
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
    static const int32_t holds[] = {[VSHI_HOLDS_DATA] = VSH_CHANNEL_DATA,
                                    [VSHI_HOLDS_LIGHT] = VSH_CHANNEL_LIGHT,
                                    [VSHI_HOLDS_VECTOR] = VSH_CHANNEL_VECTOR};
    memset(channels, 0, sizeof *channels);
    size_t kind_count, count = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const size_t values = count_of(&kinds[k], scene);
        count += values * vshi_plane_components(&kinds[k]);
        channels->triple_count += kinds[k].axes != NULL ? values : 0;
    }
    if (count > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: %zu channels, at most %d", count,
                         VSH_MAX_CHANNELS);
    }
    channels->names = calloc(count, sizeof *channels->names);
    channels->name_list = calloc(count, sizeof *channels->name_list);
    channels->holds = calloc(count, sizeof *channels->holds);
    channels->planes = calloc(count, sizeof *channels->planes);
    channels->triples = calloc(channels->triple_count + 1, sizeof *channels->triples);
    if (channels->names == NULL || channels->name_list == NULL || channels->holds == NULL ||
        channels->planes == NULL || channels->triples == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "channels: the system refused memory");
    }
    size_t at = 0;
    for (size_t k = 0; k < kind_count; ++k) {
        for (size_t i = 0; i < count_of(&kinds[k], scene); ++i) {
            const size_t next = at + name_value(&kinds[k], kinds[k].per_light ? &scene->lights[i] : NULL,
                                                channels->names + at);
            for (; at < next; ++at) {
                channels->holds[at] = holds[kinds[k].holds];
            }
        }
    }
    for (size_t i = 0; i < count; ++i) {
        channels->name_list[i] = channels->names[i];
    }
    channels->image = (vsh_image){
        width,          height, (int32_t)count, channels->name_list, (const float *const *)channels->planes,
        channels->holds};
    return VSH_OK;
}

/* --- values */

static int32_t bent_space(const vsh_scene *scene) {
    return scene->bent > 0 ? scene->bent - 1 : VSH_BENT_WORLD;
}

static void bind_all(vshi_channels *channels, const vsh_scene *scene) {
    float *const *plane = channels->planes, *const *triple = channels->triples;
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const vshi_plane_kind *kind = &kinds[k];
        const size_t count = count_of(kind, scene);
        if (count > 0) {
            vshi_plane_put(&channels->lightmap, kind, kind->axes != NULL ? triple : plane);
        }
        triple += kind->axes != NULL ? count : 0;
        plane += count * vshi_plane_components(kind);
    }
    channels->lightmap.tint_by = scene->tint; /* of irradiance too */
    channels->lightmap.ambient = scene->has_ambient ? scene->ambient : NULL;
    channels->lightmap.bent_space = bent_space(scene);
    channels->lightmap.asked = scene->planes;
    channels->lightmap.invalid = channels->invalid;
}

vsh_lightmap vshi_channels_shape(const vsh_scene *scene) {
    static float plane;
    float *const any[] = {&plane};
    vsh_lightmap lightmap = {.bent_space = bent_space(scene), .asked = scene->planes};
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        if (count_of(&kinds[k], scene) > 0) {
            vshi_plane_put(&lightmap, &kinds[k], any);
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
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const vshi_plane_kind *kind = &kinds[k];
        for (size_t i = 0; i < count_of(kind, scene); ++i, plane += vshi_plane_components(kind)) {
            if (kind->axes != NULL) {
                split(*triple++, texels, plane);
            } else if (is_invalid(kind)) {
                for (size_t t = 0; t < texels; ++t) {
                    plane[0][t] = channels->invalid[t] > 0.0f ? 1.0f : 0.0f;
                }
            }
        }
    }
}

void vshi_channels_join(vshi_channels *channels, const vsh_scene *scene) {
    const size_t texels = (size_t)channels->image.width * (size_t)channels->rows;
    float *const *plane = channels->planes, *const *triple = channels->triples;
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        for (size_t i = 0; i < count_of(&kinds[k], scene); ++i, plane += vshi_plane_components(&kinds[k])) {
            for (size_t at = 0; kinds[k].axes != NULL && at < 3 * texels; ++at) {
                (*triple)[at] = plane[at % 3][at / 3];
            }
            triple += kinds[k].axes != NULL;
        }
    }
}

size_t vshi_channels_padded(const vsh_scene *scene, float *const *planes, vshi_plane *padded) {
    size_t kind_count, count = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const size_t channels = count_of(&kinds[k], scene) * vshi_plane_components(&kinds[k]);
        for (size_t i = 0; kinds[k].padded && i < channels; ++i) {
            padded[count++] = (vshi_plane){planes[i], 1};
        }
        planes += channels;
    }
    return count;
}

void vshi_channels_free(vshi_channels *channels) {
    for (size_t t = 0; channels->triples != NULL && t < channels->triple_count; ++t) {
        free(channels->triples[t]);
    }
    for (int32_t i = 0; channels->planes != NULL && i < channels->image.channel_count; ++i) {
        free(channels->planes[i]);
    }
    free(channels->invalid);
    free(channels->known);
    free(channels->kept);
    free(channels->triples);
    free(channels->planes);
    free(channels->holds);
    free(channels->name_list);
    free(channels->names);
    memset(channels, 0, sizeof *channels);
}
