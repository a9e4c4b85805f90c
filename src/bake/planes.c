#include "bake/planes.h"

#include "bake/baking.h"
#include "base/names.h"
#include "base/try.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Adds what AO lets through to the irradiance of lights, where texels are valid; without ambient light AO
 * dims the lights instead. Planes and state are of the texels that are held. Where AO is left so is this. */
static void add_ambient(const vshi_baking *bake) {
    const vsh_texels *texels = bake->texels;
    const vsh_lightmap *lightmap = bake->lightmap;
    const bool leaves = lightmap->ao != NULL && bake->keep.memory != NULL;
    const int32_t width = texels->info.width;
    for (size_t i = 0; i < vshi_texels_held(texels); ++i) {
        const float open = lightmap->ao != NULL ? lightmap->ao[i] : 1.0f;
        const int32_t column = (int32_t)(i % (size_t)width), row = (int32_t)(i / (size_t)width);
        if ((lightmap->ambient != NULL && bake->state[i] != VSHI_TEXEL_VALID) ||
            (leaves && vshi_ao_keep_left(&bake->keep, column, row + texels->band.first) != NULL)) {
            continue;
        }
        for (size_t c = 0; c < 3; ++c) {
            float *value = &lightmap->irradiance[3 * i + c];
            *value = vshi_irradiance_open(*value, lightmap->ambient, c, open);
        }
    }
}

static vsh_result fill_irradiance(vshi_baking *bake, float *plane, vsh_error *error) {
    VSHI_TRY(vshi_baking_average(bake, bake->irradiance, 3, plane, error));
    add_ambient(bake);
    return VSH_OK;
}

static const char *const ups_table[] = {
    [VSH_UP_NONE] = "none",  [VSH_UP_X] = "x",        [VSH_UP_Y] = "y",        [VSH_UP_Z] = "z",
    [VSH_UP_MINUS_X] = "-x", [VSH_UP_MINUS_Y] = "-y", [VSH_UP_MINUS_Z] = "-z",
};
static const vshi_names ups = VSHI_NAMES(ups_table);

int32_t vsh_up(const char *name) {
    return vshi_name_find(ups, name);
}

const char *vsh_up_name(int32_t up) {
    return vshi_name_at(ups, up);
}

void vshi_sky_up(int32_t axis, double up[3]) {
    for (int k = 0; k < 3; ++k) {
        up[k] = axis == VSH_UP_X + k ? 1.0 : axis == VSH_UP_MINUS_X + k ? -1.0 : 0.0;
    }
}

float vshi_sky_weighed(const float normal[3], const double up[3], float open) {
    const vshi_vec n = vshi_unit(vshi_vec_off(normal));
    const double over = fmin(fmax(0.5 * (1.0 + vshi_dot(n, vshi_vec_of(up))), 0.0), 1.0);
    return (float)(over * (double)open);
}

typedef struct skylight {
    vshi_baking *bake;
    double up[3];
} skylight;

static void weigh_sky(void *user, size_t begin, size_t end) {
    const skylight *s = user;
    for (size_t i = begin; i < end; ++i) {
        float *value = &s->bake->values[i];
        *value = vshi_sky_weighed(s->bake->origins.normal + 3 * i, s->up, *value);
    }
}

/* The sky is AO of what is over the horizon, within a distance that no caster is beyond. */
vsh_shade_options vshi_baking_options(const vshi_baking *bake, bool sky) {
    static const double FAR = 0x1p60;
    vsh_shade_options options = bake->shade;
    if (sky) {
        options.ao_distance = FAR;
        vshi_sky_up(bake->lightmap->asked.sky, options.ao_up);
    }
    return options;
}

/* Rays tell of their error before the weighing, which makes it less. */
static vsh_result fill_sky(vshi_baking *bake, float *plane, vsh_error *error) {
    const int32_t up = bake->lightmap->asked.sky;
    if (up <= VSH_UP_NONE || up > VSH_UP_MINUS_Z) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap asked.sky %d: expected %d … %d", up, VSH_UP_X,
                         VSH_UP_MINUS_Z);
    }
    const double square = bake->stats.shade.square_error;
    skylight s = {.bake = bake};
    vshi_sky_up(up, s.up);
    VSHI_TRY(vshi_baking_open(bake, true, NULL, NULL, error));
    VSHI_TRY(vshi_baking_step(bake, "sky", weigh_sky, &s, error));
    VSHI_TRY(vshi_baking_add_error(bake, bake->light_count + 1, square, error));
    return vshi_baking_average(bake, bake->values, 1, plane, error);
}

#define PLANE(member) .plane = offsetof(vsh_lightmap, member), .wish = VSHI_NO_WISH
#define WISHED(member) .plane = offsetof(vsh_lightmap, member), .wish = offsetof(vsh_planes, member)

static const vshi_plane_kind kinds[] = {
    {"shadow", .per_light = true, .range = VSHI_RANGE_SHARE, .padded = true, .needs = VSHI_NEEDS_LIGHTS,
     PLANE(shadow)},
    {"ao", .range = VSHI_RANGE_SHARE, .padded = true, .needs = VSHI_NEEDS_AO, PLANE(ao)},
    {"error", .per_light = true, .needs = VSHI_NEEDS_LIGHTS | VSHI_NEEDS_DEVIATION, PLANE(shadow_error)},
    {"error.ao", .needs = VSHI_NEEDS_AO | VSHI_NEEDS_DEVIATION, PLANE(ao_error)},
    {"irradiance", "RGB", VSHI_HOLDS_LIGHT, .range = VSHI_RANGE_LIGHT, .padded = true,
     .needs = VSHI_NEEDS_LIGHTS | VSHI_NEEDS_IRRADIANCE, PLANE(irradiance), .fill = fill_irradiance},
    {"bent", "XYZ", VSHI_HOLDS_VECTOR, .padded = true, .needs = VSHI_NEEDS_AO | VSHI_NEEDS_BENT, PLANE(bent)},
    {"tint", "RGB", VSHI_HOLDS_LIGHT, .per_light = true, .range = VSHI_RANGE_SHARE, .padded = true,
     .needs = VSHI_NEEDS_LIGHTS | VSHI_NEEDS_TINT, PLANE(tint)},
    {"sky", .range = VSHI_RANGE_SHARE, .padded = true, .needs = VSHI_NEEDS_OPEN, WISHED(sky),
     .fill = fill_sky},
    {"invalid", WISHED(invalid)},
    {"A", PLANE(coverage)},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

const vshi_plane_kind *vshi_plane_kinds(size_t *count) {
    *count = KINDS;
    return kinds;
}

static bool is_channel_of(const vshi_plane_kind *kind, const char *name) {
    const size_t length = strlen(kind->name);
    return strncmp(name, kind->name, length) == 0 && (name[length] == '\0' || name[length] == '.');
}

bool vshi_channel_can_hold(const char *name, float value, float *low, float *high) {
    static const float ROUNDING = 1e-4f; /* of means of unit directions and of shares */
    const vshi_plane_kind *kind = kinds;
    while (kind < kinds + KINDS && !is_channel_of(kind, name)) {
        ++kind;
    }
    const uint32_t needs = kind < kinds + KINDS ? kind->needs : VSHI_NEEDS_DEVIATION;
    const bool is_error = (needs & VSHI_NEEDS_DEVIATION) != 0, is_vector = (needs & VSHI_NEEDS_BENT) != 0;
    *low = is_vector ? -1.0f : 0.0f;
    *high = is_error || (needs & VSHI_NEEDS_IRRADIANCE) != 0 ? FLT_MAX : 1.0f;
    /* methods without an estimate give NaN */
    return (is_error && isnan(value)) || (value >= *low - ROUNDING && value <= *high + ROUNDING);
}

float *vshi_plane_of(const vsh_lightmap *lightmap, const vshi_plane_kind *kind, size_t light) {
    const char *at = (const char *)lightmap + kind->plane;
    if (!kind->per_light) {
        return *(float *const *)at;
    }
    float *const *list = *(float *const *const *)at;
    return list != NULL ? list[light] : NULL;
}

void vshi_plane_put(vsh_lightmap *lightmap, const vshi_plane_kind *kind, float *const *planes) {
    char *at = (char *)lightmap + kind->plane;
    if (kind->per_light) {
        *(float *const **)at = planes;
    } else {
        *(float **)at = planes[0];
    }
}

uint32_t vshi_planes_need_of_light(const vsh_lightmap *lightmap, size_t light) {
    uint32_t needs = 0;
    for (size_t k = 0; k < KINDS; ++k) {
        const bool of_lights = (kinds[k].needs & VSHI_NEEDS_LIGHTS) != 0;
        needs |= of_lights && vshi_plane_of(lightmap, &kinds[k], light) != NULL ? kinds[k].needs : 0;
    }
    return needs;
}

uint32_t vshi_planes_need(const vsh_lightmap *lightmap, size_t light_count) {
    uint32_t needs = 0;
    for (size_t i = 0; i < light_count; ++i) {
        needs |= vshi_planes_need_of_light(lightmap, i);
    }
    for (size_t k = 0; k < KINDS; ++k) {
        const bool of_lights = (kinds[k].needs & VSHI_NEEDS_LIGHTS) != 0;
        needs |= !of_lights && vshi_plane_of(lightmap, &kinds[k], 0) != NULL ? kinds[k].needs : 0;
    }
    return needs;
}

int32_t vsh_planes_shaded(const vsh_planes *planes) {
    int32_t count = 0;
    for (size_t k = 0; k < KINDS; ++k) {
        count += (kinds[k].needs & VSHI_NEEDS_OPEN) != 0 && vshi_plane_wished(&kinds[k], planes);
    }
    return count;
}
