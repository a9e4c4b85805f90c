#include "bake.h"
#include "cli/message.h"

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

static const char *method_of(const vsh_scene *scene) {
    return scene->light_count > 0 ? vsh_get_name(VSH_NAMES_SHADOW, scene->shade.method)
                                  : vsh_get_name(VSH_NAMES_AO, scene->shade.ao_method);
}

/* Who asks for an error is to get it: a method that keeps none is none that was meant, unless it was named.
 */
static int keep_error(const cli_patch *given, vsh_scene *scene) {
    vsh_shade_options *shade = &scene->shade;
    if (!cli_patch_has(given, "--method") &&
        (vsh_shadow_method_traits(shade->method) & VSH_METHOD_KEEPS_ERROR) == 0) {
        shade->method = VSH_SHADOW_AUTO;
    }
    if (!cli_patch_has(given, "--ao-method") &&
        (vsh_ao_method_traits(shade->ao_method) & VSH_METHOD_KEEPS_ERROR) == 0) {
        shade->ao_method = VSH_AO_AUTO;
    }
    return keeps_error(scene)
               ? CLI_OK
               : cli_usage("--max-error: method %s keeps none; adaptive and exact do", method_of(scene));
}

/* The first of the options that was given; NULL: none was. */
static const char *first_given(const cli_patch *given, const char *const *options, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (cli_patch_has(given, options[i])) {
            return options[i];
        }
    }
    return NULL;
}

int cli_bake_check_shade(const cli_bake_settings *s, vsh_scene *scene) {
    static const char *const of_rays[] = {"--rays", "--error"};
    const cli_patch *given = &s->patch;
    if (cli_patch_has(given, "--ao-method") && !scene->ao && vsh_planes_shaded(&scene->planes) == 0) {
        return cli_usage("--ao-method: there is no --ao");
    }
    scene->irradiance = scene->irradiance || cli_patch_has(given, "--ambient");
    if (scene->bent > 0 && (!scene->ao || scene->shade.ao_method == VSH_AO_TAPS)) {
        return cli_usage("--bent-normals: %s", scene->ao ? "AO by taps knows no directions; use cones or rays"
                                                         : "there is no --ao");
    }
    if (scene->has_ambient && !scene->irradiance) {
        return cli_usage("%s: ambient is part of irradiance, which is not baked", s->input);
    }
    if (cli_patch_has(given, "--max-error")) {
        const int code = keep_error(given, scene);
        if (code != CLI_OK) {
            return code;
        }
    }
    const char *option = first_given(given, of_rays, sizeof of_rays / sizeof of_rays[0]);
    if (option != NULL && !knows_error(scene)) {
        return cli_usage("%s: method %s takes no rays; rays, adaptive and exact do", option,
                         method_of(scene));
    }
    if (scene->irradiance && scene->light_count == 0) {
        return cli_usage("--irradiance: there is no light");
    }
    return CLI_OK;
}
