/* Irradiance: what the shadow value leaves out. */
#include "base/elementary.h"
#include "base/floats.h"
#include "base/vec.h"
#include "light/light.h"
#include "light/view.h"
#include "shade/shade.h"

#include <math.h>

static void tint_one(const vsh_tint *tint, double v, double rgb[3]) {
    rgb[0] = rgb[1] = rgb[2] = v;
    if (tint->type == VSH_TINT_QUADRATIC) {
        rgb[1] = 0.5 * v * (v + 1.0);
        rgb[2] = v * v;
    } else if (tint->type == VSH_TINT_POWER) {
        for (int c = 0; c < 3; ++c) {
            rgb[c] = v > 0.0 ? vshi_pow(v, tint->power[c]) : v;
        }
    }
}

vsh_result vsh_tint_check(const vsh_tint *tint, vsh_error *error) {
    VSHI_NEEDS(tint);
    if (tint->type < VSH_TINT_NONE || tint->type > VSH_TINT_POWER) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "tint: type %d is out of range 0 … %d", tint->type,
                         VSH_TINT_POWER);
    }
    for (int c = 0; c < 3 && tint->type == VSH_TINT_POWER; ++c) {
        if (!(tint->power[c] >= 0.0625 && tint->power[c] <= 16.0)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "tint: power[%d] %g is out of range 0.0625 … 16", c,
                             tint->power[c]);
        }
    }
    return VSH_OK;
}

void vsh_shade_tint(size_t count, const float *visibility, const vsh_tint *tint, float *rgb) {
    VSHI_FLOATS;
    for (size_t i = 0; i < count; ++i) {
        double tinted[3];
        tint_one(tint, (double)visibility[i], tinted);
        for (size_t c = 0; c < 3; ++c) {
            rgb[3 * i + c] = (float)tinted[c];
        }
    }
}

void vsh_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                          const float *visibility, float *irradiance) {
    static const vsh_tint none = {VSH_TINT_NONE, {1.0, 1.0, 1.0}};
    vshi_shade_irradiance(points, shading_normals, light, visibility, &none, irradiance);
}

void vshi_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                           const float *visibility, const vsh_tint *tint, float *irradiance) {
    VSHI_FLOATS;
    const float *normals = shading_normals != NULL ? shading_normals : points->normals;
    const vshi_light_place place = vshi_light_in_world(light);
    for (size_t i = 0; i < points->count; ++i) {
        double tinted[3];
        tint_one(tint, (double)visibility[i], tinted);
        vshi_vec to;
        const double distance = vshi_light_towards(&place, vshi_vec_of(points->positions + 3 * i), &to);
        const double gain = vshi_light_gain(light, to, distance) *
                            fmax(0.0, vshi_dot(vshi_unit(vshi_vec_off(normals + 3 * i)), to));
        if (gain * tinted[0] > 0.0) {
            for (size_t c = 0; c < 3; ++c) {
                irradiance[3 * i + c] += (float)(tinted[c] * gain * light->color[c]);
            }
        }
    }
}
