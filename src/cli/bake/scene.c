/* From the options of `bake` to the scene it bakes. */
#include "base/clock.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"
#include "options.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* --- casters */

static int check_heights(const cli_bake_settings *s) {
    const bool given[2] = {s->height != 0.0, s->world[0] > 0.0};
    const bool wanted = cli_has_ending(
        s->input, "png exr tif tiff pgm ppm pfm hdr jpg jpeg bmp tga jp2 webp dpx"); /* images of heights */
    if (!wanted && (given[0] || given[1])) {
        return cli_usage("--%s: %s is no image of heights, to which it belongs",
                         given[0] ? "height" : "size-world", s->input);
    }
    if (wanted && !(given[0] && given[1])) {
        return cli_usage("%s: an image is baked as a terrain; give %s%s%s", s->input,
                         given[0] ? "" : "--height H, the height of white",
                         given[0] || given[1] ? "" : ", and ",
                         given[1] ? "" : "--size-world W, the length of its longer side");
    }
    return CLI_OK;
}

/* A caster of a file, or of a grid in a FILE.vdb. */
static vsh_caster caster_of(const char *path, const char *grid) {
    vsh_caster caster = vsh_caster_default();
    caster.type = cli_has_ending(path, "vdb") ? VSH_CASTER_VDB : VSH_CASTER_MESH;
    caster.path = path;
    caster.grid = grid;
    return caster;
}

/* The caster that the input is, where it is no scene. */
static vsh_caster caster_of_input(const cli_bake_settings *s) {
    vsh_caster caster = caster_of(s->input, cli_parsed_grid());
    if (s->height != 0.0) {
        caster.type = VSH_CASTER_HEIGHTFIELD;
        caster.height = s->height;
        memcpy(caster.size, s->world, sizeof s->world);
    } else {
        caster.objects = (vsh_selection){NULL, 0, s->no_cast.list, s->no_cast.count};
    }
    return caster;
}

/* The input's casters, then those of --caster. */
static void add_casters(const cli_bake_settings *s, cli_bake_scene *made) {
    const size_t own = made->read != NULL ? made->read->caster_count : 1;
    made->casters = calloc(own + s->caster_count, sizeof *made->casters);
    for (size_t i = 0; i < own; ++i) {
        made->casters[i] = made->read != NULL ? made->read->casters[i] : caster_of_input(s);
    }
    for (size_t i = 0; i < s->caster_count; ++i) {
        const char *path = s->casters[i], *grid = cli_split_grid(&path);
        made->casters[own + i] = caster_of(path, grid);
    }
    made->scene.casters = made->casters;
    made->scene.caster_count = own + s->caster_count;
}

/* --- receivers */

static int override_receiver(const cli_bake_settings *s, vsh_receiver *receiver) {
    if (s->receive.count > 0 || s->no_receive.count > 0) {
        receiver->objects =
            (vsh_selection){s->receive.list, s->receive.count, s->no_receive.list, s->no_receive.count};
    }
    if (s->densities.count > 0) {
        receiver->density = s->densities.list;
        receiver->density_count = s->densities.count;
    }
    if (s->per_object) {
        receiver->partial = true;
        receiver->atlas = VSH_ATLAS_OBJECTS;
    }
    receiver->output = s->output != NULL ? s->output : receiver->output;
    return cli_patch_receiver(&s->patch, receiver);
}

/* The plane of --floor. */
static vsh_receiver floor_of(const cli_bake_settings *s) {
    vsh_receiver receiver = vsh_receiver_default();
    receiver.type = VSH_RECEIVER_PLANE;
    receiver.path = "floor";
    memcpy(receiver.extent, s->floor_size, sizeof receiver.extent);
    for (int axis = 0; axis < 3; ++axis) {
        receiver.transform[4 * axis + 3] = s->floor_center[axis];
    }
    return receiver;
}

/* The receiver that the input is, where it is no scene. */
static vsh_receiver receiver_of_input(const cli_bake_settings *s) {
    vsh_receiver receiver = vsh_receiver_default();
    receiver.path = s->input;
    if (s->height != 0.0) {
        receiver.type = VSH_RECEIVER_HEIGHTFIELD;
        receiver.relief = s->height;
        memcpy(receiver.extent, s->world, sizeof s->world);
    }
    return receiver;
}

int cli_bake_scene_receivers(const cli_bake_settings *s, cli_bake_scene *made) {
    const bool floor = s->floor_size[0] > 0.0;
    if (floor && made->read != NULL && made->read->receiver_count > 0) {
        return cli_usage("--floor: %s has receivers of its own; put a \"plane\" beside them", s->input);
    }
    const size_t count = made->read != NULL && !floor ? made->read->receiver_count : 1;
    if (count == 0) {
        return CLI_OK;
    }
    made->receivers = calloc(count, sizeof *made->receivers);
    for (size_t i = 0; i < count; ++i) {
        made->receivers[i] = floor                ? floor_of(s)
                             : made->read != NULL ? made->read->receivers[i]
                                                  : receiver_of_input(s);
        CLI_TRY(override_receiver(s, &made->receivers[i]));
    }
    made->scene.receivers = made->receivers;
    made->scene.receiver_count = count;
    return CLI_OK;
}

/* Whether an output is for many objects, of any file. */
static bool is_of_objects(const char *output) {
    const char *name = cli_file_name(output);
    return cli_is_folder(output) || strstr(name, CLI_OBJECT_NAME) != NULL || strchr(name, '.') == NULL;
}

/* Puts a receiver's output into the folder of --output-folder, and with --per-object the place of the
 * object's name into it. */
static const char *place_output(const cli_bake_settings *s, const char *output) {
    if (s->output_folder != NULL) {
        output = cli_keep_text("%s/%s", s->output_folder, cli_file_name(output));
    }
    return s->per_object && !vsh_lit_is_output(output) ? cli_object_output(output) : output;
}

/* Names are those of one file. */
static int check_objects(const cli_bake_settings *s, const cli_bake_scene *made, size_t receivers) {
    const bool chosen = s->receive.count > 0 || s->no_receive.count > 0;
    const bool one =
        receivers == 1 && (made->read == NULL || made->read->receivers[0].type == VSH_RECEIVER_MESH);
    if (chosen && !one) {
        return cli_usage("--%s: %s has no single mesh that receives: what of them does stands in the scene's "
                         "file, by \"objects\" and \"except\"",
                         s->receive.count > 0 ? "receive" : "no-receive", s->input);
    }
    if (s->no_cast.count > 0 && made->read != NULL) {
        return cli_usage("--no-cast: the casters of a scene stand in its file, %s; see \"except\"", s->input);
    }
    return CLI_OK;
}

static int add_receivers(const cli_bake_settings *s, cli_bake_scene *made) {
    const size_t given = made->read != NULL ? made->read->receiver_count : 1;
    if (s->output_folder != NULL && (s->output != NULL || made->read == NULL)) {
        return cli_usage("--output-folder '%s': %s", s->output_folder,
                         s->output != NULL ? "there is also -o" : "for the outputs that a scene names");
    }
    const bool many = s->per_object && s->output != NULL && is_of_objects(s->output);
    if (given > 1 && s->output != NULL && !many) {
        return cli_usage("-o '%s': %s has %zu receivers, each with its own output", s->output, s->input,
                         given);
    }
    if (made->read == NULL && cli_has_ending(s->input, "vdb") && s->floor_size[0] == 0.0) {
        return cli_usage(
            "%s: a level set has no UVs to bake a lightmap by; give --floor W,D,X,Y,Z for a floor that "
            "receives, or bake voxels with 'vdbshade volume'",
            s->input);
    }
    CLI_TRY(check_objects(s, made, given));
    CLI_TRY(cli_bake_scene_receivers(s, made));
    if (made->scene.receiver_count == 0) {
        return cli_usage("%s: no receivers to bake; name some in \"receivers\", or give --floor W,D,X,Y,Z",
                         s->input);
    }
    for (size_t i = 0; i < made->scene.receiver_count; ++i) {
        if (made->receivers[i].output == NULL) {
            return cli_usage("%s: no output; give -o OUT", s->input);
        }
    }
    /* a folder with the name of an image is in the way of one */
    if (s->output != NULL && !s->per_object && cli_is_folder(s->output) &&
        strchr(cli_file_name(s->output), '.') == NULL) {
        return cli_usage(
            "-o '%s': is a folder; give an image in it, as '%s%slightmap.exr', or an image for each "
            "object with --per-object",
            s->output, s->output, s->output[strlen(s->output) - 1] == '/' ? "" : "/");
    }
    for (size_t i = 0; i < made->scene.receiver_count; ++i) {
        made->receivers[i].output = place_output(s, made->receivers[i].output);
    }
    return CLI_OK;
}

/* --- checks */

int cli_bake_check_work(const cli_bake_settings *s, const cli_bake_scene *made) {
    const bool shades = made->scene.ao || vsh_planes_shaded(&made->scene.planes) > 0;
    if (made->scene.light_count == 0 && !shades) {
        return cli_usage("%s: nothing to bake%s", s->input,
                         made->read != NULL ? ": no lights and no ao"
                                            : "; give --sun X,Y,Z or --ao DISTANCE, or both");
    }
    return CLI_OK;
}

int cli_bake_check_output(const cli_bake_settings *s, const vsh_scene *scene, const char *output) {
    CLI_TRY(cli_check_apart(output, s->input, "the input"));
    CLI_TRY(cli_check_apart(output, cli_bake_lights(s), "the file of --lights"));
    for (size_t i = 0; i < scene->light_file_count; ++i) {
        CLI_TRY(cli_check_apart(output, scene->light_files[i].path, "also a file of lights"));
    }
    const bool named_by_scene = s->output == NULL && s->output_folder == NULL && output != s->stats;
    CLI_TRY(named_by_scene ? cli_check_links(s->input, output) : CLI_OK);
    struct stat status;
    if (stat(output, &status) != 0) {
        return CLI_OK; /* it replaces nothing */
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        CLI_TRY(cli_check_apart(output, scene->casters[i].path, "also a caster's file"));
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const bool plane = scene->receivers[i].type == VSH_RECEIVER_PLANE;
        CLI_TRY(cli_check_apart(output, plane ? NULL : scene->receivers[i].path, "also a receiver's file"));
    }
    return CLI_OK;
}

int cli_bake_check_inputs(const vsh_scene *scene, const char *const *outputs, size_t count) {
    const vsh_run run = cli_make_run();
    vsh_error error;
    return cli_check(vsh_scene_check_outputs(scene, outputs, count, &run, &error), &error);
}

int cli_bake_check_files(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *const outputs[] = {s->output, s->stats};
    if (s->output != NULL && s->stats != NULL && cli_same_file(s->output, s->stats)) {
        return cli_usage("%s: both the output and the --stats file", s->output);
    }
    for (size_t i = 0; i < 2; ++i) {
        if (outputs[i] != NULL) {
            CLI_TRY(cli_bake_check_output(s, scene, outputs[i]));
            CLI_TRY(cli_bake_check_inputs(scene, &outputs[i], 1));
            CLI_TRY(cli_temporary_check(outputs[i]));
        }
    }
    return CLI_OK;
}

static int check_outputs(const cli_bake_settings *s, const vsh_scene *scene) {
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const char *output = scene->receivers[i].output;
        CLI_TRY(cli_bake_check_output(s, scene, output));
        if (s->stats != NULL && cli_same_file(output, s->stats)) {
            return cli_usage("%s: both the output and the --stats file", output);
        }
        for (size_t k = 0; k < i; ++k) {
            const char *other = scene->receivers[k].output;
            if (!s->per_object && (strcmp(output, other) == 0 || cli_same_file(output, other))) {
                return cli_usage("%s: the output of two receivers", output);
            }
        }
    }
    return s->stats != NULL ? cli_bake_check_output(s, scene, s->stats) : CLI_OK;
}

/* --- lights: a sun, and those that a file has */

static const double sun_angle_default_deg = 0.53; /* of the sun from the earth */

const char *cli_bake_lights(const cli_bake_settings *s) {
    return s->lights != NULL && strcmp(s->lights, CLI_LIGHTS_OF_INPUT) == 0 ? s->input : s->lights;
}

static double sun_angle(const cli_bake_settings *s) {
    return CLI_DEGREE * (s->has_sun_angle ? s->sun_angle_deg : sun_angle_default_deg);
}

/* --unit is over the scene's, which the lights of its files were read by. */
static int move_lights(const cli_bake_settings *s, const vsh_run *run, cli_bake_scene *made) {
    for (size_t i = 0; i < made->scene.light_file_count; ++i) {
        const vsh_light_file *file = &made->scene.light_files[i];
        vsh_light *lights = NULL;
        size_t count = 0;
        vsh_error error;
        CLI_TRY(cli_check(vsh_lights_read(file->path, file->angle, file->radius, made->scene.unit, run,
                                          &lights, &count, &error),
                          &error));
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

/* Joins the lights of the scene's file, the sun and the lights of another file. */
static int join_lights(const cli_bake_settings *s, const vsh_light *others, size_t count,
                       cli_bake_scene *made) {
    const size_t own = made->scene.light_count;
    vsh_error error;
    made->lights = calloc(own + 1 + count, sizeof *made->lights);
    if (own > 0) {
        memcpy(made->lights, made->scene.lights, own * sizeof *made->lights);
    }
    made->scene.lights = made->lights;
    if (s->has_sun) {
        vsh_light sun = vsh_light_default();
        memcpy(sun.direction, s->sun, sizeof sun.direction);
        sun.angle = sun_angle(s);
        CLI_TRY(cli_check(vsh_light_check(&sun, &error), &error));
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
    return s->has_light_radius && s->lights == NULL ? cli_usage("--light-radius: there is no --lights")
                                                    : CLI_OK;
}

/* Puts the sun and the lights of a file that the options name behind those of the scene's file. */
static int add_lights(const cli_bake_settings *s, cli_bake_scene *made) {
    const vsh_run run = cli_make_run();
    const bool moves = made->scene.light_file_count > 0 && cli_patch_has(&s->patch, "--unit");
    vsh_light *others = NULL;
    size_t count = 0;
    vsh_error error;
    int code;
    CLI_TRY_DONE(check_options(s, made));
    if (s->lights != NULL) {
        CLI_TRY_DONE(cli_check(vsh_lights_read(cli_bake_lights(s), sun_angle(s), s->light_radius,
                                               made->scene.unit, &run, &others, &count, &error),
                               &error));
    }
    if (s->lights != NULL && count == 0) {
        code = cli_usage("--lights '%s': has no lights; those of a glTF or GLB are read", s->lights);
        goto done;
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

/* --- methods and what they need */

/* Whether a method that the scene is baked by has all of these traits. */
static bool any_is(const vsh_scene *scene, uint32_t traits) {
    return (scene->light_count > 0 && (vsh_shadow_method_traits(scene->shade.method) & traits) == traits) ||
           ((scene->ao || vsh_planes_shaded(&scene->planes) > 0) &&
            (vsh_ao_method_traits(scene->shade.ao_method) & traits) == traits);
}

static const char *method_of(const vsh_scene *scene) {
    return scene->light_count > 0 ? vsh_get_name(VSH_NAMES_SHADOW, scene->shade.method)
                                  : vsh_get_name(VSH_NAMES_AO, scene->shade.ao_method);
}

/* Changes methods that keep no error to auto, unless they were named. */
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
    return any_is(scene, VSH_METHOD_KEEPS_ERROR)
               ? CLI_OK
               : cli_usage("--max-error: method %s keeps none; adaptive and exact do", method_of(scene));
}

/* Whether a scene with its lights, that the options were put over, can be shaded so; sets what follows from
 * them. */
static int check_shade(const cli_bake_settings *s, vsh_scene *scene) {
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
    CLI_TRY(cli_patch_has(given, "--max-error") ? keep_error(given, scene) : CLI_OK);
    const char *option = cli_patch_has(given, "--rays")    ? "--rays"
                         : cli_patch_has(given, "--error") ? "--error"
                                                           : NULL;
    if (option != NULL && !any_is(scene, VSH_METHOD_RAYS)) {
        return cli_usage("%s: method %s takes no rays; rays, adaptive and exact do", option,
                         method_of(scene));
    }
    return scene->irradiance && scene->light_count == 0 ? cli_usage("--irradiance: there is no light")
                                                        : CLI_OK;
}

/* --- all of it */

int cli_bake_scene_casters(const cli_bake_settings *s, cli_bake_scene *made) {
    memset(made, 0, sizeof *made);
    if (cli_has_ending(s->input, "json")) {
        const vsh_run run = cli_make_run();
        vsh_error error;
        CLI_TRY(cli_check(vsh_scene_read(s->input, &run, &made->read, &error), &error));
        made->scene = *made->read;
    } else {
        CLI_TRY(cli_check_input(s->input));
        made->scene = vsh_scene_default();
        if (cli_has_ending(s->input, "vdb")) {
            made->scene.grid.resolution = 0; /* its own voxels */
        }
    }
    add_casters(s, made);
    return cli_patch_scene(&s->patch, &made->scene);
}

int cli_bake_scene_for_points(const cli_bake_settings *s, cli_bake_scene *made) {
    CLI_TRY(cli_bake_scene_casters(s, made));
    made->scene.receivers = NULL;
    made->scene.receiver_count = 0;
    CLI_TRY(add_lights(s, made));
    return check_shade(s, &made->scene);
}

int cli_bake_scene_make(const cli_bake_settings *s, cli_bake_scene *made) {
    memset(made, 0, sizeof *made);
    CLI_TRY(check_heights(s));
    if (s->output == NULL && !cli_has_ending(s->input, "json")) {
        CLI_TRY(cli_check_input(s->input));
        return cli_usage("%s: no output; give -o OUT", s->input);
    }
    CLI_TRY(cli_bake_scene_for_points(s, made));
    CLI_TRY(cli_bake_check_work(s, made));
    CLI_TRY(add_receivers(s, made));
    return check_outputs(s, &made->scene);
}

void cli_bake_scene_free(cli_bake_scene *made) {
    free(made->receivers);
    free(made->casters);
    free(made->lights);
    vsh_scene_free(made->read);
}

/* --- the work of commands that shade points */

cli_shading cli_shading_begin(vsh_scene *scene, int32_t of) {
    cli_shading shading = {.scene = scene, .run = cli_make_run()};
    shading.stats = cli_stats_begin(of, shading.run.threads);
    return shading;
}

int cli_shading_load(cli_shading *shading) {
    const double start = vshi_seconds();
    vsh_error error;
    const vsh_result result = vsh_assets_load(shading->scene, &shading->run, &shading->assets, &error);
    cli_stats_stage(&shading->stats, CLI_STAGE_LOAD, start);
    return cli_check_result(result, &error);
}

int cli_shading_cast(cli_shading *shading, const vsh_scene_occluders_options *what) {
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_scene_occluders(shading->scene, shading->assets, what, &shading->run,
                                                 &shading->occluders, &error),
                             &error));
    vsh_occluders_info casters;
    vsh_occluders_get_info(shading->occluders, &casters);
    cli_stats_casters(&shading->stats, shading->scene, &casters);
    return CLI_OK;
}

void cli_shading_free(cli_shading *shading) {
    cli_provenance_free(&shading->origin);
    vsh_occluders_free(shading->occluders);
    vsh_assets_free(shading->assets);
}
