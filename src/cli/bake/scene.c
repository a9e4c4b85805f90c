/* Makes the scene that the options of `bake` describe. */
#include "bake.h"

#include <errno.h>
#include <unistd.h>

/* --- casters */

/* An image of heights needs --height and --size-world, and nothing else takes them. */
static int check_heights(const cli_bake_settings *s) {
    static const char *const needs[] = {"--height H, the height of white",
                                        "--size-world W, the length of its longer side"};
    const bool height = s->height != 0.0, world = s->world[0] > 0.0;
    const bool image = cli_has_ending(s->input, "png exr tif tiff pgm ppm pfm hdr jpg jpeg bmp tga jp2 webp");
    CLI_REFUSE_IF(cli_was_given("height") && !height, "--height '0': a terrain without height casts nothing");
    CLI_REFUSE_IF(!image && (height || world), "--%s: %s is no image of heights",
                  height ? "height" : "size-world", s->input);
    CLI_REFUSE_IF(image && !(height && world), "%s: an image is baked as a terrain; give %s%s%s", s->input,
                  height ? "" : needs[0], height || world ? "" : ", and ", world ? "" : needs[1]);
    return CLI_OK;
}

/* Returns the caster of a file, or of a grid in FILE.vdb. */
static vsh_caster caster_of(const char *path, const char *grid) {
    vsh_caster caster = vsh_caster_default();
    caster.type = cli_has_ending(path, "vdb") ? VSH_CASTER_VDB : VSH_CASTER_MESH;
    caster.path = path;
    caster.grid = grid;
    return caster;
}

/* Returns the caster that the input is, if it is no scene. */
static vsh_caster caster_of_input(const cli_bake_settings *s) {
    vsh_caster caster = caster_of(s->input, cli_parsed.grid);
    if (s->height != 0.0) {
        caster.type = VSH_CASTER_HEIGHTFIELD;
        caster.height = s->height;
        memcpy(caster.size, s->world, sizeof s->world);
    } else {
        caster.objects = (vsh_selection){NULL, 0, s->no_cast.text, s->no_cast.count};
    }
    return caster;
}

/* Lists the input's casters, then those of --caster. */
static void add_casters(const cli_bake_settings *s, cli_bake_scene *made) {
    const size_t own = made->read != NULL ? made->read->caster_count : 1;
    made->casters = calloc(own + s->casters.count, sizeof *made->casters);
    for (size_t i = 0; i < own; ++i) {
        made->casters[i] = made->read != NULL ? made->read->casters[i] : caster_of_input(s);
    }
    for (size_t i = 0; i < s->casters.count; ++i) {
        const char *path = s->casters.text[i], *grid = cli_split_grid(&path);
        made->casters[own + i] = caster_of(path, grid);
    }
    made->scene.casters = made->casters;
    made->scene.caster_count = own + s->casters.count;
}

/* --- receivers */

static int override_receiver(const cli_bake_settings *s, vsh_receiver *receiver) {
    if (s->receive.count > 0 || s->no_receive.count > 0) {
        receiver->objects =
            (vsh_selection){s->receive.text, s->receive.count, s->no_receive.text, s->no_receive.count};
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
    return cli_apply_settings(VSH_SETTING_OF_RECEIVER, receiver);
}

/* Returns the plane of --floor. */
static vsh_receiver floor_of(const cli_bake_settings *s) {
    vsh_receiver receiver = vsh_receiver_default();
    receiver.type = VSH_RECEIVER_PLANE;
    receiver.path = "floor";
    memcpy(receiver.extent, s->floor, sizeof receiver.extent);
    for (int axis = 0; axis < 3; ++axis) {
        receiver.transform[4 * axis + 3] = s->floor[2 + axis];
    }
    return receiver;
}

/* Returns the receiver that the input is, if it is no scene. */
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
    const bool floor = s->floor[0] > 0.0;
    CLI_REFUSE_IF(floor && made->read != NULL && made->read->receiver_count > 0,
                  "--floor: %s has its own receivers; add a \"plane\" to them", s->input);
    const size_t count = made->read != NULL && !floor ? made->read->receiver_count : 1;
    made->receivers = calloc(count + 1, sizeof *made->receivers);
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

/* The object's name replaces this in an output's path. */
#define OBJECT_NAME "%s"

/* Whether an output is for many objects: a folder, a path with OBJECT_NAME, or one without an ending. */
static bool is_of_objects(const char *output) {
    const char *name = vshi_path_name(output);
    return cli_is_folder(output) || strstr(name, OBJECT_NAME) != NULL || strchr(name, '.') == NULL;
}

/* Adds OBJECT_NAME to a path: "out/" and "out" become out/%s.exr, out.png becomes out.%s.png. */
static const char *add_object_name(const char *output) {
    const char *name = vshi_path_name(output), *dot = strrchr(name, '.');
    if (strstr(name, OBJECT_NAME) != NULL) {
        return output;
    }
    if (cli_is_folder(output) || dot == NULL || dot == name) {
        return cli_end_path(output, "/" OBJECT_NAME ".exr");
    }
    return cli_keep_text("%.*s.%s%s", (int)(dot - output), output, OBJECT_NAME, dot);
}

/* Applies the output folder and --per-object to a receiver's output. */
static const char *place_output(const cli_bake_settings *s, const char *output) {
    if (s->output_folder != NULL) {
        output = cli_keep_text("%s/%s", s->output_folder, vshi_path_name(output));
    }
    return s->per_object && !vsh_lit_is_output(output) ? add_object_name(output) : output;
}

/* Options that name objects need one file of meshes. */
static int check_objects(const cli_bake_settings *s, const cli_bake_scene *made, size_t receivers) {
    const bool one =
        receivers == 1 && (made->read == NULL || made->read->receivers[0].type == VSH_RECEIVER_MESH);
    CLI_REFUSE_IF((s->receive.count > 0 || s->no_receive.count > 0) && !one,
                  "--%s: %s has no single mesh that receives; choose objects in the scene's file, by "
                  "\"objects\" and \"except\"",
                  s->receive.count > 0 ? "receive" : "no-receive", s->input);
    CLI_REFUSE_IF(s->no_cast.count > 0 && made->read != NULL,
                  "--no-cast: not for a scene; use \"except\" of the casters in %s", s->input);
    return CLI_OK;
}

/* Refuses outputs that do not fit the number or kind of receivers. */
static int check_receivers(const cli_bake_settings *s, const cli_bake_scene *made, size_t receivers) {
    CLI_REFUSE_IF(receivers > 1 && s->output != NULL && !(s->per_object && is_of_objects(s->output)),
                  "-o '%s': %s has %zu receivers with outputs of their own; use -o FOLDER/", s->output,
                  s->input, receivers);
    CLI_REFUSE_IF(made->read == NULL && cli_has_ending(s->input, "vdb") && s->floor[0] == 0.0,
                  "%s: a level set has no UVs to bake a lightmap by; give --floor W,D,X,Y,Z for a floor "
                  "that receives, or bake voxels with 'vdbshade volume'",
                  s->input);
    return check_objects(s, made, receivers);
}

static int add_receivers(const cli_bake_settings *s, cli_bake_scene *made) {
    CLI_TRY(check_receivers(s, made, made->read != NULL ? made->read->receiver_count : 1));
    CLI_TRY(cli_bake_scene_receivers(s, made));
    CLI_REFUSE_IF(made->scene.receiver_count == 0,
                  "%s: no receivers to bake; name some in \"receivers\", or give --floor W,D,X,Y,Z",
                  s->input);
    /* a folder whose name has an ending is refused later, as an image that cannot be written */
    CLI_REFUSE_IF(s->output != NULL && !s->per_object && cli_is_folder(s->output) &&
                      strchr(vshi_path_name(s->output), '.') == NULL,
                  "-o '%s': is a folder; give an image in it, such as '%slightmap.exr', or an image for "
                  "each object with --per-object",
                  s->output, cli_end_path(s->output, "/"));
    for (size_t i = 0; i < made->scene.receiver_count; ++i) {
        CLI_REFUSE_IF(made->receivers[i].output == NULL, "%s: no output; give -o OUT", s->input);
        made->receivers[i].output = place_output(s, made->receivers[i].output);
    }
    return CLI_OK;
}

/* --- lights: those of the scene, a sun, and those of a file */

static const double sun_angle_default_deg = 0.53; /* the sun's diameter, seen from the earth */

const char *cli_bake_lights(const cli_bake_settings *s) {
    return s->lights != NULL && strcmp(s->lights, CLI_LIGHTS_OF_INPUT) == 0 ? s->input : s->lights;
}

static double sun_angle(const cli_bake_settings *s) {
    return CLI_DEGREE * (cli_was_given("sun-angle") ? s->sun_angle_deg : sun_angle_default_deg);
}

/* Joins the lights of the scene's file, the sun and the lights of another file. */
static int join_lights(const cli_bake_settings *s, const vsh_light *others, size_t count,
                       cli_bake_scene *made) {
    const size_t own = made->scene.light_count;
    made->lights = calloc(own + 1 + count, sizeof *made->lights);
    if (own > 0) {
        memcpy(made->lights, made->scene.lights, own * sizeof *made->lights);
    }
    made->scene.lights = made->lights;
    if (cli_was_given("sun")) {
        vsh_light sun = vsh_light_default();
        memcpy(sun.direction, s->sun, sizeof sun.direction);
        sun.angle = sun_angle(s);
        CLI_TRY(cli_check(vsh_light_check(&sun, &cli_error)));
        made->lights[made->scene.light_count++] = sun;
    }
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < made->scene.light_count; ++k) {
            CLI_REFUSE_IF(strcmp(made->lights[k].name, others[i].name) == 0,
                          "--lights '%s': its light '%s' has the name of %s; rename one of them", s->lights,
                          others[i].name, cli_was_given("sun") ? "--sun" : "one of the scene's file");
        }
        made->lights[made->scene.light_count++] = others[i];
    }
    return CLI_OK;
}

static int check_lights(const cli_bake_settings *s, const cli_bake_scene *made) {
    CLI_REFUSE_IF(cli_was_given("sun") && made->read != NULL,
                  "--sun: not for a scene; add the sun to \"lights\" in %s", s->input);
    CLI_REFUSE_IF(s->lights != NULL && made->read != NULL && strcmp(s->lights, CLI_LIGHTS_OF_INPUT) == 0,
                  "--lights '%s': %s is a scene; name the file that has the lights", s->lights, s->input);
    CLI_REFUSE_IF(cli_was_given("sun-angle") && !cli_was_given("sun") && s->lights == NULL,
                  "--sun-angle: needs --sun X,Y,Z or --lights FILE");
    return cli_was_given("light-radius") && s->lights == NULL
               ? cli_usage("--light-radius: needs --lights FILE")
               : CLI_OK;
}

/* Adds the sun and the lights of --lights to those of the scene's file. */
static int add_lights(const cli_bake_settings *s, cli_bake_scene *made) {
    vsh_light *others = NULL;
    size_t count = 0;
    int code;
    CLI_TRY_DONE(check_lights(s, made));
    if (s->lights != NULL) {
        CLI_TRY_DONE(cli_check(vsh_lights_read(cli_bake_lights(s), sun_angle(s), s->light_radius,
                                               made->scene.unit, &cli_run, &others, &count, &cli_error)));
        if (count == 0) {
            code = cli_usage("--lights '%s': has no lights; only glTF and GLB files have some", s->lights);
            goto done;
        }
    }
    if (cli_was_given("sun") || count > 0) {
        CLI_TRY_DONE(join_lights(s, others, count, made));
    }
done:
    vsh_lights_free(others);
    return code;
}

/* --- methods and what they need */

static bool bakes_ao(const vsh_scene *scene) {
    return scene->ao || scene->planes.sky != VSH_UP_NONE;
}

/* Whether a method that bakes the scene has all of these traits. */
static bool any_has(const vsh_scene *scene, uint32_t traits) {
    return (scene->light_count > 0 &&
            (vsh_method_traits(VSH_NAMES_SHADOW, scene->shade.method) & traits) == traits) ||
           (bakes_ao(scene) && (vsh_method_traits(VSH_NAMES_AO, scene->shade.ao_method) & traits) == traits);
}

static const char *method_of(const vsh_scene *scene) {
    return scene->light_count > 0 ? vsh_get_name(VSH_NAMES_SHADOW, scene->shade.method)
                                  : vsh_get_name(VSH_NAMES_AO, scene->shade.ao_method);
}

/* Changes methods that keep no error to auto, unless the command line names them. */
static int keep_error(vsh_scene *scene) {
    vsh_shade_options *shade = &scene->shade;
    if (!cli_was_given("method") &&
        (vsh_method_traits(VSH_NAMES_SHADOW, shade->method) & VSH_METHOD_KEEPS_ERROR) == 0) {
        shade->method = VSH_SHADOW_AUTO;
    }
    if (!cli_was_given("ao-method") &&
        (vsh_method_traits(VSH_NAMES_AO, shade->ao_method) & VSH_METHOD_KEEPS_ERROR) == 0) {
        shade->ao_method = VSH_AO_AUTO;
    }
    return any_has(scene, VSH_METHOD_KEEPS_ERROR)
               ? CLI_OK
               : cli_usage("--max-error: method %s keeps no error; use adaptive or exact", method_of(scene));
}

/* Refuses options that the scene's methods do not use, and sets what follows from the options. */
static int check_shade(const cli_bake_settings *s, vsh_scene *scene) {
    CLI_REFUSE_IF(cli_was_given("ao-method") && !bakes_ao(scene), "--ao-method: needs --ao DISTANCE");
    scene->irradiance = scene->irradiance || cli_was_given("ambient");
    CLI_REFUSE_IF(scene->bent != VSH_BENT_NONE && (!scene->ao || scene->shade.ao_method == VSH_AO_TAPS),
                  "--bent-normals: %s",
                  scene->ao ? "AO by taps has no directions; use --ao-method cones or rays"
                            : "needs --ao DISTANCE");
    CLI_REFUSE_IF(scene->has_ambient && !scene->irradiance, "%s: \"ambient\" needs \"irradiance\": true",
                  s->input);
    CLI_TRY(cli_was_given("max-error") ? keep_error(scene) : CLI_OK);
    CLI_REFUSE_IF((cli_was_given("rays") || cli_was_given("error")) && !any_has(scene, VSH_METHOD_RAYS),
                  "--%s: method %s casts no rays; use rays, adaptive or exact",
                  cli_was_given("rays") ? "rays" : "error", method_of(scene));
    return scene->irradiance && scene->light_count == 0
               ? cli_usage("--irradiance: needs a light; give --sun X,Y,Z or --lights FILE")
               : CLI_OK;
}

int cli_bake_check_work(const cli_bake_settings *s, const cli_bake_scene *made) {
    CLI_REFUSE_IF(made->scene.light_count == 0 && !bakes_ao(&made->scene), "%s: nothing to bake%s", s->input,
                  made->read != NULL ? ": no lights and no ao"
                                     : "; give --sun X,Y,Z or --ao DISTANCE, or both");
    return CLI_OK;
}

/* --- outputs */

int cli_bake_check_output(const cli_bake_settings *s, const char *output) {
    const char *const inputs[] = {s->input, cli_bake_lights(s)};
    CLI_TRY(cli_check_apart(&output, 1, inputs, CLI_COUNT(inputs), NULL));
    return s->output == NULL && s->output_folder == NULL ? cli_check_links(s->input, output) : CLI_OK;
}

/* Refuses outputs that are an input or each other. Several receivers may share a folder of objects. */
static int check_outputs(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *const inputs[] = {s->input, cli_bake_lights(s)};
    const char **outputs = calloc(scene->receiver_count + 4, sizeof *outputs);
    size_t count = 0;
    int code = CLI_OK;
    for (size_t i = 0; i < scene->receiver_count && code == CLI_OK; ++i) {
        outputs[count] = scene->receivers[i].output;
        count += i == 0 || !s->per_object;
        code = cli_bake_check_output(s, scene->receivers[i].output);
    }
    outputs[count++] = s->stats;
    outputs[count++] = s->exr;
    outputs[count++] = s->view;
    outputs[count++] = s->invalid_picture;
    code = code == CLI_OK ? cli_check_apart(outputs, count, inputs, CLI_COUNT(inputs), NULL) : code;
    free(outputs);
    return code;
}

/* --- all of it */

static int check_input(const char *path) {
    return access(path, R_OK) == 0 ? CLI_OK
                                   : cli_refuse(CLI_FILE, "%s: cannot be opened: %s", path, strerror(errno));
}

int cli_bake_scene_casters(const cli_bake_settings *s, cli_bake_scene *made) {
    memset(made, 0, sizeof *made);
    if (cli_has_ending(s->input, "json")) {
        CLI_TRY(cli_check(vsh_scene_read(s->input, &cli_run, &made->read, &cli_error)));
        made->scene = *made->read;
    } else {
        CLI_TRY(check_input(s->input));
        made->scene = vsh_scene_default();
        if (cli_has_ending(s->input, "vdb")) {
            made->scene.grid.resolution = 0; /* the file has its own voxels */
        }
    }
    add_casters(s, made);
    return cli_apply_settings(VSH_SETTING_OF_SCENE, &made->scene);
}

static int make_for_points(const cli_bake_settings *s, cli_bake_scene *made) {
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
        CLI_TRY(check_input(s->input));
        return cli_usage("%s: no output; give -o OUT", s->input);
    }
    CLI_TRY(make_for_points(s, made));
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

int cli_shading_begin(cli_shading *shading, const cli_bake_settings *settings, int of) {
    *shading = (cli_shading){.scene = &shading->made.scene, .stats = cli_stats_begin(of)};
    return make_for_points(settings, &shading->made);
}

int cli_shading_load(cli_shading *shading) {
    const vsh_scene given = *shading->scene;
    CLI_TRY(cli_check_input(vsh_assets_load(shading->scene, &cli_run, &shading->assets, &cli_error)));
    cli_say_auto_ao(&given, shading->scene->shade.ao_distance);
    cli_stats_lap(&shading->stats, CLI_STAGE_LOAD);
    return CLI_OK;
}

int cli_shading_cast(cli_shading *shading, const vsh_scene_occluders_options *what) {
    CLI_TRY(cli_check_input(vsh_scene_occluders(shading->scene, shading->assets, what, &cli_run,
                                                &shading->occluders, &cli_error)));
    vsh_occluders_info casters;
    vsh_occluders_get_info(shading->occluders, &casters);
    cli_stats_casters(&shading->stats, shading->scene, &casters);
    return CLI_OK;
}

void cli_shading_free(cli_shading *shading) {
    cli_provenance_free(&shading->origin);
    vsh_occluders_free(shading->occluders);
    vsh_assets_free(shading->assets);
    cli_bake_scene_free(&shading->made);
}
