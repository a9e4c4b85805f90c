/* The lights that options put beside those of a scene: a sun, and those that a file has. */
#include "bake.h"
#include "cli/message.h"
#include "cli/paths.h"

#include <stdlib.h>
#include <string.h>

static const double sun_angle_default_deg = 0.53; /* of the sun from the earth */
static const double radians_per_degree = 0.017453292519943295;

const char *cli_bake_lights(const cli_bake_settings *s) {
    return s->lights != NULL && strcmp(s->lights, CLI_LIGHTS_OF_INPUT) == 0 ? s->input : s->lights;
}

static double sun_angle(const cli_bake_settings *s) {
    return radians_per_degree * (s->has_sun_angle ? s->sun_angle_deg : sun_angle_default_deg);
}

/* --unit is over the scene's, which the lights of its files were read by. */
static int move_lights(const cli_bake_settings *s, const vsh_run *run, cli_bake_scene *made) {
    for (size_t i = 0; i < made->scene.light_file_count; ++i) {
        const vsh_light_file *file = &made->scene.light_files[i];
        vsh_light *lights = NULL;
        size_t count = 0;
        vsh_error error;
        if (vsh_lights_read(file->path, file->angle, file->radius, made->scene.unit, run, &lights, &count,
                            &error) != VSH_OK) {
            return cli_fail(&error);
        }
        const bool same = count == file->count;
        for (size_t k = 0; same && k < count; ++k) {
            memcpy(made->lights[file->first + k].position, lights[k].position, sizeof lights[k].position);
        }
        vsh_lights_free(lights);
        if (!same) {
            return cli_usage("%s: has other lights than when %s was read", file->path, s->input);
        }
    }
    return CLI_OK;
}

/* Those of the scene's file, the sun, those of another file: what is given of them. */
static int join_lights(const cli_bake_settings *s, const vsh_light *others, size_t count,
                       cli_bake_scene *made) {
    const size_t own = made->scene.light_count;
    vsh_error error;
    made->lights = calloc(own + 1 + count, sizeof *made->lights);
    if (made->lights == NULL) {
        return cli_out_of_memory("lights");
    }
    if (own > 0) {
        memcpy(made->lights, made->scene.lights, own * sizeof *made->lights);
    }
    made->scene.lights = made->lights;
    if (s->has_sun) {
        vsh_light sun = vsh_light_default();
        memcpy(sun.direction, s->sun, sizeof sun.direction);
        sun.angle = sun_angle(s);
        if (vsh_light_check(&sun, &error) != VSH_OK) {
            return cli_fail(&error);
        }
        made->lights[made->scene.light_count++] = sun;
    }
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < made->scene.light_count; ++k) {
            if (strcmp(made->lights[k].name, others[i].name) == 0) {
                return cli_usage("--lights '%s': its light '%s' has the name of %s", s->lights,
                                 others[i].name, s->has_sun ? "--sun" : "one of the scene's file");
            }
        }
        made->lights[made->scene.light_count++] = others[i];
    }
    return CLI_OK;
}

static int read_lights(const cli_bake_settings *s, const vsh_run *run, double unit, vsh_light **lights,
                       size_t *count) {
    vsh_error error;
    if (vsh_lights_read(cli_bake_lights(s), sun_angle(s), s->light_radius, unit, run, lights, count,
                        &error) != VSH_OK) {
        return cli_fail(&error);
    }
    return *count > 0 ? CLI_OK
                      : cli_usage("--lights '%s': has no lights; those of a glTF or GLB are read", s->lights);
}

static int check_options(const cli_bake_settings *s, const cli_bake_scene *made) {
    if (s->has_sun && made->read != NULL) {
        return cli_usage("--sun: the lights of a scene stand in its file, %s", s->input);
    }
    if (s->lights != NULL && made->read != NULL && strcmp(s->lights, CLI_LIGHTS_OF_INPUT) == 0) {
        return cli_usage("--lights '%s': %s is a scene; name the file, or list it there under \"lights\"",
                         s->lights, s->input);
    }
    if (s->has_sun_angle && !s->has_sun && s->lights == NULL) {
        return cli_usage("--sun-angle: there is no --sun");
    }
    if (s->has_light_radius && s->lights == NULL) {
        return cli_usage("--light-radius: there is no --lights");
    }
    return CLI_OK;
}

int cli_bake_add_lights(const cli_bake_settings *s, cli_bake_scene *made) {
    const vsh_run run = cli_common_run(&s->common);
    const bool moves = made->scene.light_file_count > 0 && cli_patch_has(&s->patch, "--unit");
    vsh_light *others = NULL;
    size_t count = 0;
    int code;
    CLI_TRY_DONE(check_options(s, made));
    if (s->lights != NULL) {
        CLI_TRY_DONE(read_lights(s, &run, made->scene.unit, &others, &count));
    }
    if (s->has_sun || count > 0 || moves) {
        CLI_TRY_DONE(join_lights(s, others, count, made));
    }
    if (moves) {
        CLI_TRY_DONE(move_lights(s, &run, made));
    }
done:
    vsh_lights_free(others);
    return code;
}

int cli_bake_check_lights(const cli_bake_settings *s, const vsh_scene *scene, const char *output) {
    if (s->lights != NULL && cli_same_file(output, cli_bake_lights(s))) {
        return cli_usage("%s: the output is the file of --lights", output);
    }
    for (size_t i = 0; i < scene->light_file_count; ++i) {
        if (cli_same_file(output, scene->light_files[i].path)) {
            return cli_usage("%s: the output is also a file of lights", output);
        }
    }
    return CLI_OK;
}
