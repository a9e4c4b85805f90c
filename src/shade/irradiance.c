/* Irradiance: what the shadow value leaves out. */
#include "base/floats.h"
#include "base/vec.h"
#include "shade/light.h"

#include <math.h>
#include <vdbshade/shade.h>

void vsh_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                          const float *visibility, float *irradiance) {
    VSHI_FLOATS;
    const float *normals = shading_normals != NULL ? shading_normals : points->normals;
    const vshi_vec towards = vshi_unit(vshi_vec_of(light->direction));
    for (size_t i = 0; i < points->count; ++i) {
        double gain = visibility[i];
        vshi_vec to = towards;
        if (light->type != VSH_LIGHT_DIRECTIONAL) {
            to = vshi_sub(vshi_vec_of(light->position), vshi_vec_of(points->positions + 3 * i));
            const double distance = vshi_length(to);
            to = vshi_unit(to);
            /* not nearer than the light's own surface, so that the square stays finite */
            gain *= vshi_light_gain(light, to, fmax(distance, fmax(light->radius, 1e-30)));
        }
        gain *= fmax(0.0, vshi_dot(vshi_unit(vshi_vec_off(normals + 3 * i)), to));
        if (gain > 0.0) {
            for (int c = 0; c < 3; ++c) {
                irradiance[3 * i + (size_t)c] += (float)(gain * light->color[c]);
            }
        }
    }
}
