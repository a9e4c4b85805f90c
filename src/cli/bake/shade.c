#include "shade.h"
#include "cli/message.h"

#include <string.h>

/* Whether a method that the scene is baked by has all of these traits. */
static bool any_is(const vsh_scene *scene, uint32_t traits) {
    return (scene->light_count > 0 && (vsh_shadow_method_traits(scene->shade.method) & traits) == traits) ||
           ((scene->ao || vsh_planes_shaded(&scene->planes) > 0) &&
            (vsh_ao_method_traits(scene->shade.ao_method) & traits) == traits);
}

/* Methods that know the error of their values, and those that work until it is small enough. */
static bool knows_error(const vsh_scene *scene) {
    return any_is(scene, VSH_METHOD_RAYS);
}

static bool keeps_error(const vsh_scene *scene) {
    return any_is(scene, VSH_METHOD_KEEPS_ERROR);
}

/* Who asks for an error is to get it: a method that keeps none is none that was meant, unless it was named.
 */
static int set_accuracy(const cli_bake_settings *s, vsh_scene *scene) {
    vsh_shade_options *shade = &scene->shade;
    if (s->has_max_error) {
        shade->max_error = s->max_error;
        if (!s->has_method && (vsh_shadow_method_traits(shade->method) & VSH_METHOD_KEEPS_ERROR) == 0) {
            shade->method = VSH_SHADOW_AUTO;
        }
        if (!s->has_ao_method && (vsh_ao_method_traits(shade->ao_method) & VSH_METHOD_KEEPS_ERROR) == 0) {
            shade->ao_method = VSH_AO_AUTO;
        }
        if (!keeps_error(scene)) {
            return cli_usage("--max-error: method %s keeps none; adaptive and exact do",
                             scene->light_count > 0 ? vsh_shadow_method_name(shade->method)
                                                    : vsh_ao_method_name(shade->ao_method));
        }
    }
    shade->rays = s->has_rays ? s->rays : shade->rays;
    shade->sampler = s->has_sampler ? s->sampler : shade->sampler;
    shade->jitter = s->has_jitter ? s->jitter : shade->jitter;
    shade->frame = s->has_frame ? s->frame : shade->frame;
    shade->early_rays = s->has_early_rays ? s->early_rays : shade->early_rays;
    scene->error = scene->error || s->error;
    const char *option = s->has_rays         ? "--rays"
                         : s->has_sampler    ? "--sampler"
                         : s->has_frame      ? "--frame"
                         : s->has_early_rays ? "--early-rays"
                         : s->error          ? "--error"
                                             : NULL;
    if (option != NULL && !knows_error(scene)) {
        return cli_usage("%s: method %s takes no rays; rays, adaptive and exact do", option,
                         scene->light_count > 0 ? vsh_shadow_method_name(shade->method)
                                                : vsh_ao_method_name(shade->ao_method));
    }
    return CLI_OK;
}

int cli_bake_set_shade(const cli_bake_settings *s, vsh_scene *scene) {
    vsh_planes_add(&scene->planes, &s->planes);
    if (s->has_ao) {
        scene->ao = 1;
        scene->shade.ao_distance = s->ao_distance;
    }
    if ((s->has_ao_method || s->has_ao_cones) && !scene->ao) {
        return cli_usage("%s: there is no --ao", s->has_ao_method ? "--ao-method" : "--ao-cones");
    }
    if (s->has_ao_method) {
        scene->shade.ao_method = s->ao_method;
    }
    if (s->has_ao_cones) {
        scene->shade.ao_cones = s->ao_cones;
    }
    if (s->has_method) {
        scene->shade.method = s->method;
    }
    if (s->irradiance) {
        scene->irradiance = 1;
    }
    if (s->has_ambient) {
        scene->has_ambient = 1;
        memcpy(scene->ambient, s->ambient, sizeof scene->ambient);
    }
    if (s->has_tint) {
        scene->tint = s->tint;
    }
    scene->bent = s->bent > 0 ? s->bent : scene->bent;
    if (scene->bent > 0 && (!scene->ao || scene->shade.ao_method == VSH_AO_TAPS)) {
        return cli_usage("--bent-normals: %s", scene->ao ? "AO by taps knows no directions; use cones or rays"
                                                         : "there is no --ao");
    }
    if (scene->has_ambient && !scene->irradiance) {
        return cli_usage("%s: ambient is part of irradiance, which is not baked", s->input);
    }
    const int code = set_accuracy(s, scene);
    if (code != CLI_OK) {
        return code;
    }
    if (scene->irradiance && scene->light_count == 0) {
        return cli_usage("--irradiance: there is no light");
    }
    return CLI_OK;
}
