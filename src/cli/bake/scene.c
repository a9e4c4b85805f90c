/* From the options of `bake` to the scene it bakes. */
#include "bake.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void set_identity(double transform[12]) {
    for (int i = 0; i < 12; ++i) {
        transform[i] = i % 5 == 0 ? 1.0 : 0.0;
    }
}

static vsh_selection selection(const cli_patterns *only, const cli_patterns *except) {
    return (vsh_selection){only != NULL ? only->list : NULL, only != NULL ? only->count : 0, except->list,
                           except->count};
}

/* Caster i's file and grid: of the input, or of the (i - own)th --caster. */
static int name_caster(const cli_bake_settings *s, cli_bake_scene *made, size_t i, size_t own) {
    vsh_caster *caster = &made->casters[i];
    if (i < own) {
        caster->path = s->input;
        caster->grid = cli_parsed_grid();
        return CLI_OK;
    }
    const char *given = s->casters[i - own];
    caster->path = given;
    caster->grid = cli_grid_name(given);
    if (caster->grid != NULL) {
        caster->path = made->caster_files[i - own] = strndup(given, (size_t)(caster->grid - 1 - given));
    }
    return caster->path != NULL ? CLI_OK : cli_out_of_memory("casters");
}

/* Whether the input is an image, which is baked as a terrain. */
static bool is_heights(const char *input) {
    static const char *const endings[] = {"png", "exr",  "tif", "tiff", "pgm", "ppm",  "pfm", "hdr",
                                          "jpg", "jpeg", "bmp", "tga",  "jp2", "webp", "dpx"};
    bool is = false;
    for (size_t i = 0; i < sizeof endings / sizeof endings[0] && !is; ++i) {
        is = cli_has_ending(input, endings[i]);
    }
    return is;
}

static int check_heights(const cli_bake_settings *s) {
    const bool wanted = is_heights(s->input), given[2] = {s->height != 0.0, s->world[0] > 0.0};
    if (!wanted && (given[0] || given[1])) {
        return cli_usage("--%s: %s is no image of heights, to which it belongs",
                         given[0] ? "height" : "size-world", s->input);
    }
    if (wanted && !(given[0] && given[1])) {
        return cli_usage("%s: an image is baked as a terrain; give %s", s->input,
                         given[0] ? "--size-world W, the length of its longer side"
                         : given[1]
                             ? "--height H, the height of white"
                             : "--height H, the height of white, and --size-world W, the length of its "
                               "longer side");
    }
    return CLI_OK;
}

/* The input's casters, then those of --caster. */
static int add_casters(const cli_bake_settings *s, cli_bake_scene *made) {
    const size_t own = made->read != NULL ? made->read->caster_count : 1;
    const size_t count = own + s->caster_count;
    made->casters = calloc(count, sizeof *made->casters);
    if (made->casters == NULL) {
        return cli_out_of_memory("casters");
    }
    for (size_t i = 0; i < count; ++i) {
        if (i < own && made->read != NULL) {
            made->casters[i] = made->read->casters[i];
        } else {
            CLI_TRY(name_caster(s, made, i, own));
            made->casters[i].type =
                cli_has_ending(made->casters[i].path, "vdb") ? VSH_CASTER_VDB : VSH_CASTER_MESH;
            set_identity(made->casters[i].transform);
            if (i < own && s->height != 0.0) {
                made->casters[i].type = VSH_CASTER_HEIGHTFIELD;
                made->casters[i].height = s->height;
                memcpy(made->casters[i].size, s->world, sizeof s->world);
            } else if (i < own) {
                made->casters[i].objects = selection(NULL, &s->no_cast);
            }
        }
    }
    made->scene.casters = made->casters;
    made->scene.caster_count = count;
    return CLI_OK;
}

static int override_receiver(const cli_bake_settings *s, vsh_receiver *receiver) {
    if (s->receive.count > 0 || s->no_receive.count > 0) {
        receiver->objects = selection(&s->receive, &s->no_receive);
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

static void free_outputs(cli_bake_scene *made) {
    for (size_t i = 0; made->outputs != NULL && i < made->scene.receiver_count; ++i) {
        free(made->outputs[i]);
    }
    free(made->outputs);
    made->outputs = NULL;
}

/* The scene's outputs, by their names, in a folder of the user's. */
static int move_outputs(const char *folder, cli_bake_scene *made) {
    made->outputs = calloc(made->scene.receiver_count, sizeof *made->outputs);
    if (made->outputs == NULL) {
        return cli_out_of_memory("outputs");
    }
    for (size_t i = 0; i < made->scene.receiver_count; ++i) {
        const char *path = made->receivers[i].output, *slash = strrchr(path, '/');
        const char *name = slash != NULL ? slash + 1 : path;
        const size_t size = strlen(folder) + strlen(name) + 2;
        made->outputs[i] = malloc(size);
        if (made->outputs[i] == NULL) {
            return cli_out_of_memory("outputs");
        }
        snprintf(made->outputs[i], size, "%s/%s", folder, name);
        made->receivers[i].output = made->outputs[i];
    }
    return CLI_OK;
}

/* Where the object's name goes in the output of each. */
static int mark_outputs(cli_bake_scene *made) {
    char **marked = calloc(made->scene.receiver_count, sizeof *marked);
    if (marked == NULL) {
        return cli_out_of_memory("outputs");
    }
    for (size_t i = 0; i < made->scene.receiver_count; ++i) {
        const char *output = made->receivers[i].output;
        marked[i] = vsh_lit_is_output(output) ? strdup(output) : cli_object_output(output);
        made->receivers[i].output = marked[i];
    }
    free_outputs(made);
    made->outputs = marked;
    for (size_t i = 0; i < made->scene.receiver_count; ++i) {
        if (marked[i] == NULL) {
            return cli_out_of_memory("outputs");
        }
    }
    return CLI_OK;
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
    if (made->receivers == NULL) {
        return cli_out_of_memory("receivers");
    }
    int code = CLI_OK;
    for (size_t i = 0; i < count && code == CLI_OK; ++i) {
        vsh_receiver *receiver = &made->receivers[i];
        *receiver = floor                ? floor_of(s)
                    : made->read != NULL ? made->read->receivers[i]
                                         : vsh_receiver_default();
        receiver->path = floor || made->read != NULL ? receiver->path : s->input;
        if (!floor && made->read == NULL && s->height != 0.0) {
            receiver->type = VSH_RECEIVER_HEIGHTFIELD;
            receiver->relief = s->height;
            memcpy(receiver->extent, s->world, sizeof s->world);
        }
        code = override_receiver(s, receiver);
    }
    made->scene.receivers = made->receivers;
    made->scene.receiver_count = count;
    return code;
}

/* Whether it is meant for a folder: one that is called as an image is, is in the way. */
static bool names_folder(const char *output) {
    const char *slash = strrchr(output, '/');
    return cli_is_folder(output) && strchr(slash != NULL ? slash + 1 : output, '.') == NULL;
}

/* Whether an output is for many objects, of any file. */
static bool is_of_objects(const char *output) {
    const char *slash = strrchr(output, '/');
    const char *last = slash != NULL ? slash : output;
    return cli_is_folder(output) || strstr(last, CLI_OBJECT_NAME) != NULL || strchr(last, '.') == NULL;
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
    int code = check_objects(s, made, given);
    code = code == CLI_OK ? cli_bake_scene_receivers(s, made) : code;
    if (code == CLI_OK && made->scene.receiver_count == 0) {
        return cli_usage("%s: no receivers to bake; name some in \"receivers\", or give --floor W,D,X,Y,Z",
                         s->input);
    }
    for (size_t i = 0; code == CLI_OK && i < made->scene.receiver_count; ++i) {
        if (made->scene.receivers[i].output == NULL) {
            return cli_usage("%s: no output; give -o OUT", s->input);
        }
    }
    if (code == CLI_OK && s->output != NULL && !s->per_object && names_folder(s->output)) {
        return cli_usage(
            "-o '%s': is a folder; give an image in it, as '%s%slightmap.exr', or an image for each "
            "object with --per-object",
            s->output, s->output, s->output[strlen(s->output) - 1] == '/' ? "" : "/");
    }
    code = code == CLI_OK && s->output_folder != NULL ? move_outputs(s->output_folder, made) : code;
    return code == CLI_OK && s->per_object ? mark_outputs(made) : code;
}

int cli_bake_check_work(const cli_bake_settings *s, const cli_bake_scene *made) {
    const bool shades = made->scene.ao || vsh_planes_shaded(&made->scene.planes) > 0;
    if (made->read == NULL && made->scene.light_count == 0 && !shades) {
        return cli_usage("%s: nothing to bake; give --sun X,Y,Z or --ao DISTANCE, or both", s->input);
    }
    if (made->scene.light_count == 0 && !shades) {
        return cli_usage("%s: nothing to bake: no lights and no ao", s->input);
    }
    return CLI_OK;
}

int cli_bake_check_output(const cli_bake_settings *s, const vsh_scene *scene, const char *output) {
    if (cli_same_file(output, s->input)) {
        return cli_usage("%s: the output is the input", output);
    }
    CLI_TRY(cli_bake_check_lights(s, scene, output));
    const bool named_by_scene = s->output == NULL && s->output_folder == NULL && output != s->stats;
    if (named_by_scene && cli_check_links(s->input, output) != CLI_OK) {
        return CLI_FILE;
    }
    struct stat status;
    if (stat(output, &status) != 0) {
        return CLI_OK; /* it replaces nothing */
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (scene->casters[i].path != NULL && cli_same_file(output, scene->casters[i].path)) {
            return cli_usage("%s: the output is also a caster's file", output);
        }
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        if (scene->receivers[i].type != VSH_RECEIVER_PLANE &&
            cli_same_file(output, scene->receivers[i].path)) {
            return cli_usage("%s: the output is also a receiver's file", output);
        }
    }
    return CLI_OK;
}

int cli_bake_check_inputs(const cli_bake_settings *s, const vsh_scene *scene, const char *const *outputs,
                          size_t count) {
    const vsh_run run = cli_common_run(&s->common);
    vsh_error error;
    return vsh_scene_check_outputs(scene, outputs, count, &run, &error) == VSH_OK ? CLI_OK : cli_fail(&error);
}

static int check_outputs(const cli_bake_settings *s, const vsh_scene *scene) {
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const char *output = scene->receivers[i].output;
        int code = cli_bake_check_output(s, scene, output);
        if (code != CLI_OK) {
            return code;
        }
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

/* The input, or defaults for a mesh, with what the options put over it. */
static int make(const cli_bake_settings *settings, bool receivers, cli_bake_scene *made) {
    memset(made, 0, sizeof *made);
    CLI_TRY(receivers ? check_heights(settings) : CLI_OK);
    if (cli_has_ending(settings->input, "json")) {
        const vsh_run run = cli_common_run(&settings->common);
        vsh_error error;
        if (vsh_scene_read(settings->input, &run, &made->read, &error) != VSH_OK) {
            return cli_fail(&error);
        }
        made->scene = *made->read;
    } else {
        CLI_TRY(cli_check_input(settings->input));
        if (receivers && settings->output == NULL) {
            return cli_usage("%s: no output; give -o OUT", settings->input);
        }
        made->scene = vsh_scene_default();
        if (cli_has_ending(settings->input, "vdb")) {
            made->scene.grid.resolution = 0; /* its own voxels */
        }
    }
    int code = cli_patch_scene(&settings->patch, &made->scene);
    code = code == CLI_OK ? cli_bake_add_lights(settings, made) : code;
    code = code == CLI_OK ? cli_bake_check_shade(settings, &made->scene) : code;
    code = code == CLI_OK && receivers ? cli_bake_check_work(settings, made) : code;
    return code == CLI_OK ? add_casters(settings, made) : code;
}

int cli_bake_scene_for_points(const cli_bake_settings *settings, cli_bake_scene *made) {
    const int code = make(settings, false, made);
    made->scene.receivers = NULL;
    made->scene.receiver_count = 0;
    return code;
}

int cli_bake_scene_make(const cli_bake_settings *settings, cli_bake_scene *made) {
    int code = make(settings, true, made);
    code = code == CLI_OK ? add_receivers(settings, made) : code;
    return code == CLI_OK ? check_outputs(settings, &made->scene) : code;
}

void cli_bake_scene_free(cli_bake_scene *made) {
    free_outputs(made);
    free(made->receivers);
    free(made->casters);
    for (size_t i = 0; i < CLI_MAX_EXTRA_CASTERS; ++i) {
        free(made->caster_files[i]);
    }
    free(made->lights);
    vsh_scene_free(made->read);
}
