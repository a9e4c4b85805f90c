#include "scene/scene.h"

#include "base/memory.h"
#include "base/try.h"
#include "scene/parts.h"
#include "json/keys.h"

#include <vdbshade/settings.h>

#include <stdlib.h>
#include <string.h>

enum { MAX_ITEMS = 65536 };

/* What vsh_scene_free() gets is the first member. */
typedef struct owner {
    vsh_scene scene;
    vshi_json_block *blocks;
} owner;

static vsh_result read_casters(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items;
    VSHI_TRY(vshi_read_list(reader, value, 1, MAX_ITEMS, sizeof *scene->casters, vshi_read_caster, &items,
                            &scene->caster_count));
    scene->casters = items;
    return VSH_OK;
}

static vsh_result read_layers(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items;
    VSHI_TRY(vshi_read_list(reader, value, 0, VSH_MAX_LAYERS, sizeof *scene->layers, vshi_read_layer, &items,
                            &scene->layer_count));
    scene->layers = items;
    return VSH_OK;
}

static int by_output(const void *a, const void *b) {
    const vsh_receiver *const *x = a, *const *y = b;
    const int order = strcmp((*x)->output, (*y)->output);
    return order != 0 ? order : (*x > *y) - (*x < *y);
}

/* Two receivers with one output would overwrite each other. */
static vsh_result check_outputs(vshi_json *reader, const vshi_value *value, const vsh_scene *scene) {
    const vsh_receiver **sorted;
    vsh_result result = VSH_OK;
    VSHI_TRY(
        vshi_allocate((void **)&sorted, scene->receiver_count, sizeof *sorted, "receivers", reader->error));
    if (sorted == NULL) {
        return VSH_OK;
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        sorted[i] = &scene->receivers[i];
    }
    qsort(sorted, scene->receiver_count, sizeof *sorted, by_output);
    for (size_t i = 1; i < scene->receiver_count; ++i) {
        const vshi_value receiver = vshi_item(value, (size_t)(sorted[i] - scene->receivers));
        vshi_value output;
        if (strcmp(sorted[i - 1]->output, sorted[i]->output) == 0 &&
            vshi_member(&receiver, "output", &output)) {
            result =
                vshi_json_fail(reader, &output, "\"%.200s\" is the output of receivers[%zu] too",
                               json_string_value(output.json), (size_t)(sorted[i - 1] - scene->receivers));
            break;
        }
    }
    free(sorted);
    return result;
}

static vsh_result read_receivers(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    void *items;
    VSHI_TRY(vshi_read_list(reader, value, 0, MAX_ITEMS, sizeof *scene->receivers, vshi_read_receiver, &items,
                            &scene->receiver_count));
    scene->receivers = items;
    return check_outputs(reader, value, scene);
}

static void wants_ao(void *target) {
    vsh_scene *scene = target;
    scene->ao = 1;
}

static void wants_bent(void *target) {
    vsh_scene *scene = target;
    ++scene->bent; /* behind 0, which is none */
}

static const vshi_key ao_keys[] = {
    {.name = "distance",
     .kind = VSHI_NUMBER,
     .required = VSHI_ALL,
     .offset = offsetof(vsh_scene, shade.ao_distance),
     .lowest = VSHI_SMALLEST_LENGTH,
     .highest = VSHI_LARGEST,
     .then = wants_ao,
     .option = {.name = "ao",
                .value = "DISTANCE",
                .group = VSH_SETTINGS_OCCLUSION,
                .help = "ambient occlusion within a distance, scene units",
                .otherwise = "none"}},
    {.name = "method",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene, shade.ao_method),
     .names = VSH_NAMES_AO,
     .option = {.name = "ao-method",
                .value = "NAME",
                .group = VSH_SETTINGS_OCCLUSION,
                .help = "of AO; cones and taps are previews"}},
    {.name = "cones",
     .kind = VSHI_INTEGER,
     .variants = 1U << VSH_AO_CONES | 1U << VSH_AO_ADAPTIVE | 1U << VSH_AO_EXACT | 1U << VSH_AO_AUTO,
     .offset = offsetof(vsh_scene, shade.ao_cones),
     .lowest = 1.0,
     .highest = 256.0},
    {.name = "bent_normals",
     .kind = VSHI_NAME,
     .variants = ~(1U << VSH_AO_TAPS),
     .offset = offsetof(vsh_scene, bent),
     .names = VSH_NAMES_BENT,
     .then = wants_bent,
     .option = {.name = "bent-normals",
                .value = "SPACE",
                .group = VSH_SETTINGS_CHANNELS,
                .help = "with --ao also bent.X, .Y, .Z: the mean direction that is open, in world or tangent "
                        "space; -1 to 1, in integer formats (1 + x) / 2",
                .otherwise = "none"}},
};
const vshi_table vshi_ao_table = VSHI_TABLE(ao_keys);

static vsh_result read_ao(vshi_json *reader, const vshi_value *value, void *member) {
    static const char *const whats[] = {
        [VSH_AO_TAPS] = "ao by taps", [VSH_AO_RAYS] = "ao by rays", [VSH_AO_AUTO] = NULL};
    vsh_scene *scene = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_read_choice(reader, value, &(vshi_key){.name = "method", .names = VSH_NAMES_AO},
                              &scene->shade.ao_method));
    const char *what = whats[scene->shade.ao_method];
    return vshi_read_object(reader, value, &vshi_ao_table, 1U << scene->shade.ao_method,
                            what != NULL ? what : "ao", scene);
}

/* "quadratic", or the powers of R, G and B. */
static vsh_result read_tint(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    const vshi_key powers = {.kind = VSHI_VECTOR, .lowest = 0.0625, .highest = 16.0, .count = 3};
    if (json_is_array(value->json)) {
        scene->tint.type = VSH_TINT_POWER;
        return vshi_read_value(reader, value, &powers, scene->tint.power);
    }
    VSHI_TRY(vshi_expect(reader, value, JSON_STRING));
    scene->tint.type = vsh_find_name(VSH_NAMES_TINT, json_string_value(value->json));
    return scene->tint.type == VSH_TINT_NONE || scene->tint.type == VSH_TINT_QUADRATIC
               ? VSH_OK
               : vshi_json_fail(reader, value, "\"%.64s\" is none of none, quadratic, [r, g, b]",
                                json_string_value(value->json));
}

static void has_ambient(void *target) {
    vsh_scene *scene = target;
    scene->has_ambient = 1;
}

static void voxels_are_named(void *target) {
    vsh_scene *scene = target;
    scene->voxels_named = 1;
}

static void resolution_is_named(void *target) {
    vsh_scene *scene = target;
    scene->voxels_named = 1;
    scene->grid.voxel_size = 0.0; /* which would stand in its place */
}

/* A name, or metres. */
static vsh_result read_unit(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key metres = {.kind = VSHI_NUMBER, .highest = 1e12, .flags = VSHI_ABOVE};
    vsh_scene *scene = member;
    if (!json_is_string(value->json)) {
        return vshi_read_value(reader, value, &metres, &scene->unit);
    }
    scene->unit = vsh_unit(json_string_value(value->json));
    return scene->unit > 0.0 ? VSH_OK
                             : vshi_json_fail(reader, value, "\"%.64s\" is none of m, cm, mm, in, ft",
                                              json_string_value(value->json));
}

static const vshi_key scene_keys[] = {
    {.name = "casters", .kind = VSHI_CUSTOM, .read = read_casters},
    {.name = "voxel_size",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, grid.voxel_size),
     .lowest = VSHI_SMALLEST_LENGTH,
     .highest = VSHI_LARGEST_VOXEL,
     .then = voxels_are_named,
     .option = {.name = "voxel-size",
                .value = "SIZE",
                .group = VSH_SETTINGS_CASTERS,
                .help = "in place of --resolution: the edge of a voxel, scene units",
                .otherwise = "as --resolution says"}},
    {.name = "resolution",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, grid.resolution),
     .lowest = 2.0,
     .highest = 65536.0,
     .then = resolution_is_named,
     .option = {.name = "resolution",
                .value = "N",
                .group = VSH_SETTINGS_CASTERS,
                .help = "voxels along the longest side of the casters",
                .otherwise = "what pays: see docs/auto.md"}},
    {.name = "half_width",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, grid.half_width),
     .lowest = 3.0,
     .highest = 100.0,
     .option = {.name = "half-width",
                .value = "VOXELS",
                .group = VSH_SETTINGS_LEVEL_SET,
                .help = "half width of the narrow band"}},
    {.name = "shell_thickness",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, grid.shell_thickness),
     .lowest = 1.0,
     .highest = 50.0,
     .option = {.name = "shell-thickness",
                .value = "VOXELS",
                .group = VSH_SETTINGS_LEVEL_SET,
                .help = "thickness of sheets and of walls behind rooms' faces"}},
    {.name = "layers", .kind = VSHI_CUSTOM, .read = read_layers},
    {.name = "lights", .kind = VSHI_LATER},
    {.name = "ao", .kind = VSHI_CUSTOM, .read = read_ao},
    {.name = "irradiance",
     .kind = VSHI_BOOL,
     .offset = offsetof(vsh_scene, irradiance),
     .option =
         {.name = "irradiance",
          .group = VSH_SETTINGS_CHANNELS,
          .help =
              "also irradiance.R, .G, .B: visibility × colour × falloff × cosine, summed, × AO where baked"}},
    {.name = "ambient",
     .kind = VSHI_VECTOR,
     .offset = offsetof(vsh_scene, ambient),
     .highest = VSHI_LARGEST,
     .count = 3,
     .then = has_ambient,
     .option = {.name = "ambient",
                .value = "R,G,B",
                .group = VSH_SETTINGS_CHANNELS,
                .help = "light from all around, linear: irradiance is then that of the lights + ambient × AO",
                .otherwise = "none"}},
    {.name = "tint",
     .kind = VSHI_CUSTOM,
     .read = read_tint,
     .option = {.name = "tint",
                .value = "TINT",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "also tint.NAME.R, .G, .B of each light, its penumbra coloured: (V, V²/2 + V/2, V²) "
                        "or powers of V such as 1,1.2,1.5; irradiance takes it too",
                .range = "quadratic, or R,G,B: powers from 0.0625 to 16",
                .otherwise = "none"}},
    {.name = "method",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene, shade.method),
     .names = VSH_NAMES_SHADOW,
     .option = {.name = "method",
                .value = "NAME",
                .group = VSH_SETTINGS_OCCLUSION,
                .help = "of the shadow; auto: exact where all casters are triangles, else adaptive; all but "
                        "these and rays are previews, which keep no error; classic, practical and improved "
                        "have the outer half of the penumbra only"}},
    {.name = "rays",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.rays),
     .lowest = 1.0,
     .highest = 4096.0,
     .option = {.name = "rays",
                .value = "N",
                .group = VSH_SETTINGS_ACCURACY,
                .help = "rays a texel; with adaptive and exact a limit",
                .otherwise = "64, or as many as the error takes"}},
    {.name = "sampler",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene, shade.sampler),
     .names = VSH_NAMES_SAMPLER,
     .option =
         {.name = "sampler", .value = "NAME", .group = VSH_SETTINGS_FILE_ONLY, .help = "where they go"}},
    {.name = "frame",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.frame),
     .highest = INT32_MAX,
     .option = {.name = "frame",
                .value = "N",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "another set of them: bakes of frames 0, 1, 2 … may be averaged"}},
    {.name = "early_rays",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.early_rays),
     .highest = 4096.0,
     .option = {.name = "early-rays",
                .value = "N",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "with rays: where the first N agree, the rest are not marched",
                .otherwise = "0: never"}},
    {.name = "max_error",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, shade.max_error),
     .lowest = 1e-4,
     .highest = 1.0,
     .option = {.name = "max-error",
                .value = "E",
                .group = VSH_SETTINGS_ACCURACY,
                .help = "standard error that a value may keep, which rays follow from; takes the place of a "
                        "scene's preview methods by auto"}},
    {.name = "jitter",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, shade.jitter),
     .highest = 1.0,
     .option = {.name = "jitter",
                .value = "J",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help =
                    "shadows by one march: steps are shortened by a part of up to this, another a texel"}},
    {.name = "error",
     .kind = VSHI_BOOL,
     .offset = offsetof(vsh_scene, error),
     .option = {.name = "error",
                .group = VSH_SETTINGS_ACCURACY,
                .help = "also error.NAME of each light and error.ao: the standard error left in each value"}},
    {.name = "invalid",
     .kind = VSHI_BOOL,
     .offset = offsetof(vsh_scene, planes.invalid),
     .option = {.name = "invalid-channel",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "also the channel invalid: 1 for texels inside solids or behind walls, else 0"}},
    {.name = "sky",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_scene, planes.sky),
     .names = VSH_NAMES_UP,
     .option = {.name = "sky",
                .value = "AXIS",
                .group = VSH_SETTINGS_CHANNELS,
                .help = "also sky: what of an even sky is seen, however far the casters; up is this axis"}},
    {.name = "max_steps",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_scene, shade.max_steps),
     .lowest = 16.0,
     .highest = 65536.0,
     .option = {.name = "max-steps",
                .value = "N",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "steps after which a ray is given up"}},
    {.name = "start_offset",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_scene, shade.start_offset),
     .highest = 16.0,
     .option = {.name = "start-offset",
                .value = "VOXELS",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "how far above the surface rays begin, along its normal"}},
    {.name = "unit",
     .kind = VSHI_CUSTOM,
     .read = read_unit,
     .option = {.name = "unit",
                .value = "UNIT",
                .group = VSH_SETTINGS_CASTERS,
                .help = "of the numbers in mesh files",
                .range = "m, cm, mm, in, ft, or metres",
                .otherwise = "as FBX and DAE say; OBJ, PLY and STL stay as they are"}},
    {.name = "cast_blended",
     .kind = VSHI_BOOL,
     .offset = offsetof(vsh_scene, cast_blended),
     .option = {.name = "cast-blended",
                .group = VSH_SETTINGS_CASTERS,
                .help = "meshes of blended materials (glass) cast too"}},
    {.name = "receivers", .kind = VSHI_CUSTOM, .read = read_receivers},
};
const vshi_table vshi_scene_table = VSHI_TABLE(scene_keys);

static bool is_named(const vsh_scene *scene, const char *path) {
    bool named = false;
    for (size_t i = 0; i < scene->caster_count && !named; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        named = caster->type == VSH_CASTER_HEIGHTFIELD && strcmp(caster->path, path) == 0;
    }
    return named;
}

/* Terrains that receive also cast, where the scene does not name them as casters. */
static vsh_result add_terrains(vshi_json *reader, const vshi_value *root, vsh_scene *scene) {
    size_t count = 0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        count += scene->receivers[i].type == VSH_RECEIVER_HEIGHTFIELD;
    }
    if (scene->caster_count + count == 0) {
        return vshi_json_fail(reader, root, "key \"casters\" is missing: a scene needs it");
    }
    vsh_caster *casters;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&casters, scene->caster_count + count, sizeof *casters,
                                "casters"));
    if (scene->caster_count > 0) {
        memcpy(casters, scene->casters, scene->caster_count * sizeof *casters);
    }
    scene->casters = casters;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        if (receiver->type == VSH_RECEIVER_HEIGHTFIELD && !is_named(scene, receiver->path)) {
            vsh_caster *caster = &casters[scene->caster_count++];
            *caster = vsh_caster_default();
            caster->type = VSH_CASTER_HEIGHTFIELD;
            caster->path = receiver->path;
            caster->height = receiver->relief;
            memcpy(caster->size, receiver->extent, sizeof caster->size);
            memcpy(caster->transform, receiver->transform, sizeof caster->transform);
        }
    }
    return VSH_OK;
}

static vsh_result read_scene(vshi_json *reader, json_t *json, const vsh_run *run, vsh_scene *scene) {
    const vshi_value root = {NULL, NULL, 0, 0, json};
    vshi_value lights, region;
    *scene = vsh_scene_default();
    VSHI_TRY(vshi_expect(reader, &root, JSON_OBJECT));
    if (vshi_member(&root, "region", &region)) {
        return vshi_json_fail(reader, &region, "belongs to flat scenes, which 'vdbshade flat' bakes");
    }
    VSHI_TRY(vshi_read_object(reader, &root, &vshi_scene_table, 1, "a scene", scene));
    VSHI_TRY(vshi_reject_both(reader, &root, "voxel_size", "resolution"));
    VSHI_TRY(add_terrains(reader, &root, scene));
    if (vshi_member(&root, "lights", &lights)) { /* after the unit of files' numbers */
        VSHI_TRY(vshi_read_lights(reader, &lights, run, scene));
    }
    return vshi_check_layers(reader, &root, scene);
}

vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, const vsh_run *run,
                            vsh_scene **scene, vsh_error *error) {
    *scene = NULL;
    vshi_json reader = {path, text, size, NULL, error};
    json_t *json = NULL;
    vsh_result result;
    VSHI_TRY(vshi_json_load(&reader, &json));
    owner *made = calloc(1, sizeof *made);
    if (made == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", path, sizeof *made);
        goto done;
    }
    result = read_scene(&reader, json, run, &made->scene);
    made->blocks = reader.blocks;
    if (result != VSH_OK) {
        vsh_scene_free(&made->scene);
        goto done;
    }
    *scene = &made->scene;
done:
    json_decref(json);
    return result;
}

void vsh_scene_free(vsh_scene *scene) {
    if (scene == NULL) {
        return;
    }
    owner *made = (owner *)scene;
    vshi_blocks_free(made->blocks);
    free(made);
}
