#include "volume/channels.h"

#include "base/numbers.h"
#include "light/light.h"

#include <stdio.h>

static vshi_channel *next_of(vshi_channel **next, const vshi_channels *what, const char *method) {
    vshi_channel *channel = (*next)++;
    *channel = (vshi_channel){.method = method, .caster_voxel_size = what->caster_voxel_size};
    return channel;
}

static void describe_shadow(const vshi_channels *what, bool error, vshi_channel **next) {
    const vsh_shade_options *shade = &what->options->shade;
    const char *method =
        vsh_shadow_method_name(vsh_shadow_method_resolve(shade->method, what->has_triangles));
    for (size_t l = 0; l < what->light_count; ++l) {
        const vsh_light *light = &what->lights[l];
        vshi_channel *c = next_of(next, what, method);
        snprintf(c->name, sizeof c->name, "%s.%s", error ? "error" : "shadow", light->name);
        snprintf(c->description, sizeof c->description, "%s light '%s', 1 lit, 0 dark",
                 error ? "standard error of the visible fraction of" : "visible fraction of", light->name);
        vsh_light_text(light, c->light, sizeof c->light);
    }
}

static void describe_ao(const vshi_channels *what, bool error, vshi_channel **next) {
    const vsh_shade_options *shade = &what->options->shade;
    const int32_t method = vsh_ao_method_resolve(shade->ao_method, what->has_triangles);
    vshi_channel *c = next_of(next, what, vsh_ao_method_name(method));
    snprintf(c->name, sizeof c->name, "%s", error ? "error.ao" : "ao");
    snprintf(c->description, sizeof c->description, "%s within %g, 1 open, 0 closed",
             error ? "standard error of ambient occlusion" : "ambient occlusion", shade->ao_distance);
}

void vshi_channels_describe(const vshi_channels *what, vshi_channel *channels) {
    VSHI_NUMBERS;
    vshi_channel *next = channels;
    describe_shadow(what, false, &next);
    if (what->options->ao != 0) {
        describe_ao(what, false, &next);
    }
    if (what->shadow_error) {
        describe_shadow(what, true, &next);
    }
    if (what->ao_error) {
        describe_ao(what, true, &next);
    }
}
