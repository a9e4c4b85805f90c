#include "bake/planes.h"

#include "bake/ambient.h"
#include "bake/baking.h"
#include "base/try.h"

#include <string.h>

static vsh_result fill_irradiance(vshi_baking *bake, float *plane, vsh_error *error) {
    VSHI_TRY(vshi_baking_average(bake, bake->irradiance, 3, plane, error));
    vshi_ambient_add(bake->texels, bake->state, bake->lightmap);
    return VSH_OK;
}

#define PLANE(member) .plane = offsetof(vsh_lightmap, member), .wish = VSHI_NO_WISH
#define WISHED(member) .plane = offsetof(vsh_lightmap, member), .wish = offsetof(vsh_planes, member)

static const vshi_plane_kind kinds[] = {
    {"shadow", .per_light = true, .padded = true, .needs = VSHI_NEEDS_LIGHTS, PLANE(shadow)},
    {"ao", .padded = true, .needs = VSHI_NEEDS_AO, PLANE(ao)},
    {"error", .per_light = true, .needs = VSHI_NEEDS_LIGHTS | VSHI_NEEDS_DEVIATION, PLANE(shadow_error)},
    {"error.ao", .needs = VSHI_NEEDS_AO | VSHI_NEEDS_DEVIATION, PLANE(ao_error)},
    {"irradiance", "RGB", .padded = true, .needs = VSHI_NEEDS_LIGHTS | VSHI_NEEDS_IRRADIANCE,
     PLANE(irradiance), .fill = fill_irradiance},
    {"bent", "XYZ", .padded = true, .needs = VSHI_NEEDS_AO | VSHI_NEEDS_BENT, PLANE(bent)},
    {"tint", "RGB", .per_light = true, .padded = true, .needs = VSHI_NEEDS_LIGHTS | VSHI_NEEDS_TINT,
     PLANE(tint)},
    {"invalid", WISHED(invalid)},
    {"A", PLANE(coverage)},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

const vshi_plane_kind *vshi_plane_kinds(size_t *count) {
    *count = KINDS;
    return kinds;
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

void vsh_planes_add(vsh_planes *planes, const vsh_planes *more) {
    for (size_t k = 0; k < KINDS; ++k) {
        if (vshi_plane_wished(&kinds[k], more)) {
            const size_t at = (size_t)kinds[k].wish;
            memcpy((char *)planes + at, (const char *)more + at, sizeof(int32_t));
        }
    }
}
