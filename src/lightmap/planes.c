/* The table of planes, their rows, and the sky. */
#include "lightmap/planes.h"

#include "base/memory.h"
#include "base/vec.h"

#include <math.h>
#include <string.h>

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

/* The sky is AO of the directions above the horizon, within a distance beyond all casters. */
vsh_shade_options vshi_sky_options(const vsh_shade_options *options, int32_t axis) {
    static const double FAR = 0x1p60;
    vsh_shade_options sky = *options;
    sky.ao_distance = FAR;
    vshi_sky_up(axis, sky.ao_up);
    return sky;
}

#define PLANE(member) .plane = offsetof(vsh_lightmap, member), .wish = VSHI_NO_WISH
#define WISHED(member) .plane = offsetof(vsh_lightmap, member), .wish = offsetof(vsh_planes, member)

static const vshi_plane_kind kinds[] = {
    {"shadow", .per_light = true, .range = VSHI_RANGE_SHARE, .padded = true, .needs = VSHI_NEEDS_LIGHTS,
     PLANE(shadow)},
    {"ao", .range = VSHI_RANGE_SHARE, .padded = true, .needs = VSHI_NEEDS_AO, PLANE(ao)},
    {"error", .per_light = true, .needs = VSHI_NEEDS_LIGHTS, PLANE(shadow_error)},
    {"error.ao", .needs = VSHI_NEEDS_AO, PLANE(ao_error)},
    {"irradiance", "RGB", VSHI_HOLDS_LIGHT, .range = VSHI_RANGE_LIGHT, .padded = true,
     .needs = VSHI_NEEDS_LIGHTS, PLANE(irradiance)},
    {"bent", "XYZ", VSHI_HOLDS_VECTOR, .padded = true, .needs = VSHI_NEEDS_AO, PLANE(bent)},
    {"tint", "RGB", VSHI_HOLDS_LIGHT, .per_light = true, .range = VSHI_RANGE_SHARE, .padded = true,
     .needs = VSHI_NEEDS_LIGHTS, PLANE(tint)},
    {"sky", .range = VSHI_RANGE_SHARE, .padded = true, .needs = VSHI_NEEDS_OPEN, WISHED(sky)},
    {"invalid", WISHED(invalid)},
    {"A", PLANE(coverage)},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

const vshi_plane_kind *vshi_plane_kinds(size_t *count) {
    *count = KINDS;
    return kinds;
}

bool vshi_plane_next(const vsh_lightmap *lightmap, size_t light_count, vshi_plane_cursor *c) {
    do {
        if (c->kind != NULL && c->kind->per_light && c->light + 1 < light_count) {
            ++c->light;
        } else {
            c->kind = c->kind == NULL ? kinds : c->kind + 1;
            c->light = 0;
        }
        if (c->kind == kinds + KINDS) {
            return false;
        }
        const char *at = (const char *)lightmap + c->kind->plane;
        float *const *list = c->kind->per_light ? *(float *const *const *)at : (float *const *)at;
        c->values = list != NULL && !(c->kind->per_light && light_count == 0) ? list[c->light] : NULL;
    } while (c->values == NULL);
    return true;
}

void vshi_plane_set(vsh_lightmap *lightmap, const vshi_plane_kind *kind, float *const *planes) {
    char *at = (char *)lightmap + kind->plane;
    if (kind->per_light) {
        *(float *const **)at = planes;
    } else {
        *(float **)at = planes[0];
    }
}

uint32_t vshi_planes_need(const vsh_lightmap *lightmap) {
    uint32_t needs = 0;
    for (size_t k = 0; k < KINDS; ++k) {
        needs |= vshi_plane_given(lightmap, &kinds[k]) ? kinds[k].needs : 0;
    }
    return needs;
}

int32_t vshi_planes_shaded(const vsh_planes *planes) {
    int32_t count = 0;
    for (size_t k = 0; k < KINDS; ++k) {
        count += (kinds[k].needs & VSHI_NEEDS_OPEN) != 0 && vshi_plane_wished(&kinds[k], planes);
    }
    return count;
}

/* --- rows */

vsh_result vshi_plane_row_check(const vsh_lightmap *lightmap, int32_t width, vsh_error *error) {
    const int32_t row = lightmap->row_texels;
    if (row != 0 && (row < width || row > VSH_MAX_LIGHTMAP_SIZE)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap row_texels %d: expected 0, or %d … %d", row,
                         width, VSH_MAX_LIGHTMAP_SIZE);
    }
    return VSH_OK;
}

vsh_result vshi_planes_tighten(const vsh_lightmap *lightmap, size_t light_count, size_t width, size_t height,
                               vsh_run *run, vsh_lightmap *tight, void **memory, vsh_error *error) {
    static const char what[] = "copy of planes";
    *memory = NULL;
    *tight = *lightmap;
    tight->row_texels = 0;
    if (vshi_plane_row(lightmap, width) == width) {
        return VSH_OK;
    }
    const size_t texels = width * height, lists = KINDS * (light_count + 1);
    size_t floats = 0;
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(lightmap, light_count, &c);) {
        floats += texels * vshi_plane_components(c.kind);
    }
    float *values, **list;
    const vshi_array arrays[] = {VSHI_ARRAY(values, floats), VSHI_ARRAY(list, lists)};
    const double bytes = (double)floats * sizeof *values + (double)lists * sizeof *list;
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    *memory = values;
    run->memory_held += (uint64_t)bytes;
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(lightmap, light_count, &c);) {
        float **own = list + (size_t)(c.kind - kinds) * (light_count + 1);
        own[c.light] = values;
        vshi_plane_set(tight, c.kind, own);
        values += texels * vshi_plane_components(c.kind);
    }
    return VSH_OK;
}

void vshi_planes_copy_rows(const vsh_lightmap *tight, const vsh_lightmap *lightmap, size_t light_count,
                           size_t width, size_t height) {
    vshi_plane_cursor from = {.kind = NULL}, to = {.kind = NULL};
    while (vshi_plane_next(tight, light_count, &from) && vshi_plane_next(lightmap, light_count, &to)) {
        const size_t components = vshi_plane_components(to.kind), row = components * width;
        const size_t apart = components * vshi_plane_row(lightmap, width);
        for (size_t y = 0; y < height; ++y) {
            memcpy(to.values + y * apart, from.values + y * row, row * sizeof *to.values);
        }
    }
}
