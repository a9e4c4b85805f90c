#include "bake_scene/bake_scene.h"

#include "bake/planes.h"
#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- which there are */

/* Whether a scene's lights, AO and what goes with them ask for a plane; the others are wished for. */
static bool is_asked(const vshi_plane_kind *kind, const vsh_scene *scene) {
    /* errors that are left: only where the method knows them */
    const bool shadow_error = (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) != 0;
    const bool ao_error = (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
    const struct {
        size_t plane;
        bool asked;
    } own[] = {
        {offsetof(vsh_lightmap, shadow), scene->light_count > 0},
        {offsetof(vsh_lightmap, ao), scene->ao != 0},
        {offsetof(vsh_lightmap, shadow_error), scene->error && shadow_error},
        {offsetof(vsh_lightmap, ao_error), scene->error && scene->ao && ao_error},
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
        channels->value_count += values;
    }
    if (count > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: %zu channels, at most %d", count,
                         VSH_MAX_CHANNELS);
    }
    channels->names = calloc(count, sizeof *channels->names);
    channels->name_list = calloc(count, sizeof *channels->name_list);
    channels->holds = calloc(count, sizeof *channels->holds);
    channels->values = calloc(channels->value_count + 1, sizeof *channels->values);
    channels->components = calloc(channels->value_count + 1, sizeof *channels->components);
    if (channels->names == NULL || channels->name_list == NULL || channels->holds == NULL ||
        channels->values == NULL || channels->components == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "channels: the system refused memory");
    }
    size_t at = 0, value = 0;
    for (size_t k = 0; k < kind_count; ++k) {
        for (size_t i = 0; i < count_of(&kinds[k], scene); ++i) {
            channels->components[value++] = vshi_plane_components(&kinds[k]);
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
    channels->image = (vsh_image){width, height, (int32_t)count, channels->name_list, NULL, channels->holds};
    return VSH_OK;
}

/* --- values */

/* Puts the values into the planes of a lightmap; NULL: any. */
static void bind_planes(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    static float plane;
    float *const any[] = {&plane};
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const size_t count = count_of(&kinds[k], scene);
        if (count > 0) {
            vshi_plane_put(lightmap, &kinds[k], values != NULL ? values : any);
        }
        values = values != NULL ? values + count : NULL;
    }
    lightmap->bent_space = scene->bent > 0 ? scene->bent - 1 : VSH_BENT_WORLD;
    lightmap->asked = scene->planes;
}

vsh_lightmap vshi_channels_shape(const vsh_scene *scene) {
    vsh_lightmap lightmap = {.asked = scene->planes};
    bind_planes(&lightmap, scene, NULL);
    return lightmap;
}

vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, vshi_store *store,
                                  const char *output, vsh_error *error) {
    const size_t texels = (size_t)channels->image.width * (size_t)channels->image.height;
    channels->store = store;
    for (size_t i = 0; i < channels->value_count; ++i) {
        VSHI_TRY(vshi_store_take(store, (void **)&channels->values[i], texels,
                                 channels->components[i] * sizeof(float), output, error));
    }
    bind_planes(&channels->lightmap, scene, channels->values);
    channels->lightmap.tint_by = scene->tint; /* of irradiance too */
    channels->lightmap.ambient = scene->has_ambient ? scene->ambient : NULL;
    return VSH_OK;
}

vsh_result vshi_channels_allocate_rows(const vshi_channels *channels, int32_t rows, float **memory,
                                       vsh_error *error) {
    const size_t texels = (size_t)channels->image.width * (size_t)rows;
    size_t floats = 0;
    for (size_t i = 0; i < channels->value_count; ++i) {
        floats += channels->components[i] > 1 ? channels->components[i] : 0;
    }
    return vshi_allocate((void **)memory, texels, floats * sizeof(float), "rows of a lightmap", error);
}

void vshi_channels_rows(const vshi_channels *channels, int32_t first, int32_t rows, float *memory,
                        const float **planes) {
    const size_t width = (size_t)channels->image.width, texels = width * (size_t)rows;
    for (size_t i = 0; i < channels->value_count; ++i) {
        const size_t components = channels->components[i];
        const float *values = channels->values[i] + components * width * (size_t)first;
        for (size_t c = 0; c < components; ++c) {
            *planes = components > 1 ? memory : values;
            for (size_t t = 0; components > 1 && t < texels; ++t) {
                memory[t] = values[components * t + c];
            }
            memory += components > 1 ? texels : 0;
            ++planes;
        }
    }
}

void vshi_channels_free(vshi_channels *channels) {
    for (size_t i = 0; channels->store != NULL && i < channels->value_count; ++i) {
        vshi_store_give(channels->store, channels->values[i]);
    }
    free(channels->components);
    free(channels->values);
    free(channels->holds);
    free(channels->name_list);
    free(channels->names);
    memset(channels, 0, sizeof *channels);
}
