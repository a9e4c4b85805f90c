/* Scene files: their keys, the layers and terrains in them, and settings, which are keys given one by one. */
#include "scene/scene.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"
#include "io/model/model.h"
#include "shade/occluders.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/picture.h>

enum { MAX_ITEMS = 65536 };
enum { MAX_LIGHTS = VSH_MAX_CHANNELS - 5 /* ao, A and three of irradiance must fit into the image too */ };

/* --- receivers */

vsh_result vshi_read_size(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = VSHI_INTEGER, .lowest = 1.0, .highest = VSH_MAX_LIGHTMAP_SIZE};
    int32_t *size = member;
    if (!json_is_array(value->json)) {
        VSHI_TRY(vshi_read_value(reader, value, &key, &size[0]));
        size[1] = size[0];
        return VSH_OK;
    }
    const size_t count = json_array_size(value->json);
    if (count != 2) {
        return vshi_json_fail(reader, value, "expected 2 numbers, found %zu", count);
    }
    const vshi_value first = vshi_item(value, 0), second = vshi_item(value, 1);
    VSHI_TRY(vshi_read_value(reader, &first, &key, &size[0]));
    return vshi_read_value(reader, &second, &key, &size[1]);
}
_Static_assert(offsetof(vsh_receiver, height) == offsetof(vsh_receiver, width) + sizeof(int32_t),
               "a size is two integers in a row");

vsh_result vshi_read_bits(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = VSHI_INTEGER, .lowest = 0.0, .highest = 32.0};
    int32_t *bits = member;
    VSHI_TRY(vshi_read_value(reader, value, &key, bits));
    if (*bits != 0 && *bits != 8 && *bits != 16 && *bits != 32) {
        return vshi_json_fail(reader, value, "%d is none of 0, 8, 16, 32", *bits);
    }
    return VSH_OK;
}

/* {"PATTERN": factor, …}, in the order of the file. */
static vsh_result read_density(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key key = {.kind = VSHI_NUMBER, .highest = VSHI_LARGEST, .flags = VSHI_ABOVE};
    vsh_receiver *receiver = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    vsh_density_rule *rules;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&rules, json_object_size(value->json), sizeof *rules,
                                "patterns"));
    receiver->density = rules;
    vshi_value factor = {.json = NULL};
    while (vshi_next_member(value, &factor)) {
        vsh_density_rule *rule = &rules[receiver->density_count++];
        VSHI_TRY(vshi_json_copy(reader, 0, factor.key, &rule->pattern));
        VSHI_TRY(vshi_read_value(reader, &factor, &key, &rule->factor));
    }
    return VSH_OK;
}

/* Reads a number by the key, or "auto", for which the member stays. */
static vsh_result read_auto(vshi_json *reader, const vshi_value *value, const vshi_key *key, void *member) {
    if (!json_is_string(value->json)) {
        return vshi_read_value(reader, value, key, member);
    }
    return strcmp(json_string_value(value->json), "auto") == 0
               ? VSH_OK
               : vshi_json_fail(reader, value, "\"%.64s\" is none of auto, a %snumber from %g to %g",
                                json_string_value(value->json), key->kind == VSHI_INTEGER ? "whole " : "",
                                key->lowest, key->highest);
}

/* Texels, or "auto". */
static vsh_result read_padding(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = VSHI_INTEGER, .highest = 4096.0};
    *(int32_t *)member = VSH_PADDING_AUTO;
    return read_auto(reader, value, &key, member);
}

enum {
    MESH = 1 << VSH_RECEIVER_MESH,
    HEIGHTFIELD = 1 << VSH_RECEIVER_HEIGHTFIELD,
    PLANE = 1 << VSH_RECEIVER_PLANE
};

typedef struct plane {
    double size[2], center[3], normal[3];
} plane;

#define AT(member) .offset = offsetof(plane, member)
static const vshi_key plane_keys[] = {
    VSHI_KEY("size", VECTOR, AT(size), .required = VSHI_ALL, .count = 2, .lowest = 1e-12, .highest = 1e12),
    VSHI_KEY("center", VECTOR, AT(center), .count = 3, VSHI_ANY),
    VSHI_KEY("normal", VECTOR, AT(normal), .count = 3, .flags = VSHI_NONZERO, VSHI_ANY),
};
static const vshi_table plane_table = VSHI_TABLE(plane_keys);
#undef AT

/* Turns +y into the normal the shortest way, and moves the origin to the center, before the transform. */
static void place_plane(const plane *p, double transform[12]) {
    const double length =
        sqrt(p->normal[0] * p->normal[0] + p->normal[1] * p->normal[1] + p->normal[2] * p->normal[2]);
    const double a = p->normal[0] / length, b = p->normal[1] / length, c = p->normal[2] / length;
    const double s = b > -1.0 ? 1.0 / (1.0 + b) : 0.0; /* upside down: half a turn about x */
    const double d = b > -1.0 ? 1.0 - c * c * s : -1.0;
    const double turned[12] = {
        1.0 - a * a * s, a, -a * c * s, p->center[0], -a, b, -c, p->center[1], -a * c * s, c, d, p->center[2],
    };
    double before[12];
    memcpy(before, transform, sizeof before);
    vshi_transform_compose(before, turned, transform);
}

/* Reads the plane after the other keys: it comes before the transform. */
static vsh_result read_plane(vshi_json *reader, const vshi_value *value, vsh_receiver *receiver) {
    plane p = {.normal = {0.0, 1.0, 0.0}};
    VSHI_TRY(vshi_read_object(reader, value, &plane_table, 1, "a plane", &p));
    memcpy(receiver->extent, p.size, sizeof p.size);
    place_plane(&p, receiver->transform);
    receiver->path = "plane";
    return VSH_OK;
}

const char *vshi_color_space_key(int32_t i) {
    return i < VSH_COLOR_ENCODED ? vsh_get_name(VSH_NAMES_COLOR, i) : NULL; /* bakes are never encoded yet */
}

#define AT(member) .offset = offsetof(vsh_receiver, member)
static const vshi_key receiver_keys[] = {
    VSHI_KEY("mesh", PATH, AT(path), VSHI_NEEDED_BY(MESH)),
    VSHI_KEY("heightfield", PATH, AT(path), .variants = HEIGHTFIELD),
    VSHI_KEY("plane", LATER, .variants = PLANE),
    VSHI_KEY("extent", VECTOR, AT(extent), VSHI_NEEDED_BY(HEIGHTFIELD), .count = 2, .lowest = 1e-12,
             .highest = 1e12),
    VSHI_KEY("height", NUMBER, AT(relief), VSHI_NEEDED_BY(HEIGHTFIELD), .lowest = -1e12, .highest = 1e12),
    VSHI_KEY("transform", CUSTOM, AT(transform), .read = vshi_read_transform),
    VSHI_KEY("uv_set", INTEGER, AT(uv_set), .variants = MESH, .highest = VSH_MAX_UV_SETS - 1,
             VSHI_OPTION("uv-set", "N", TEXELS, "UV set of the lightmap",
                         .otherwise = "the second if there is one, else the first")),
    VSHI_KEY("objects", CUSTOM, AT(objects.only), .variants = MESH, .read = vshi_read_patterns),
    VSHI_KEY("except", CUSTOM, AT(objects.except), .variants = MESH, .read = vshi_read_patterns),
    VSHI_KEY("allow_overlap", BOOL, AT(allow_overlap), .variants = MESH,
             VSHI_OPTION("allow-overlap", NULL, FILE_ONLY,
                         "bake objects that overlap in the lightmap, too: the first keeps the texels")),
    VSHI_KEY("unwrap", NAME, AT(unwrap), .variants = MESH, .names = VSH_NAMES_RECEIVER_UNWRAP,
             VSHI_OPTION("unwrap", "MODE", TEXELS,
                         "make lightmap UVs: always, or (auto) if the file's own cannot be baked",
                         .otherwise = "auto for .glb and .gltf, never for images")),
    VSHI_KEY("texels_per_unit", NUMBER, AT(texels_per_unit), .variants = MESH, VSHI_POSITIVE,
             VSHI_OPTION("texels-per-unit", "N", TEXELS, "density of new UVs, texels along a scene unit",
                         .otherwise = "the most that fit")),
    VSHI_KEY("pages", INTEGER, AT(pages), .variants = MESH, .lowest = 1.0, .highest = VSH_MAX_PAGES,
             VSHI_OPTION("pages", "N", TEXELS,
                         "images of --size that new UVs may fill: OUT.0.exr, OUT.1.exr, …",
                         .otherwise = "1; with --texels-per-unit as many as needed")),
    VSHI_KEY("density", CUSTOM, .variants = MESH, .read = read_density),
    VSHI_KEY("atlas", NAME, AT(atlas), .variants = MESH, .names = VSH_NAMES_ATLAS,
             VSHI_OPTION("atlas", "WHAT", FILE_ONLY,
                         "objects: an image for each object, OUT.NAME.exr; shared: the same images")),
    VSHI_KEY("max_size", INTEGER, AT(max_size), .variants = MESH, .lowest = 1.0,
             .highest = VSH_MAX_LIGHTMAP_SIZE,
             VSHI_OPTION("max-size", "N", FILE_ONLY,
                         "with --texels-per-unit: images as small as they can be, sides up to N",
                         .otherwise = "--size for all")),
    VSHI_KEY("size", CUSTOM, AT(width), .read = vshi_read_size,
             VSHI_OPTION("size", "W[xH]", IMAGE, "texels of the lightmap",
                         .range = "W or WxH, each from 1 to 65536 texels", .otherwise = "1024", .by = true)),
    VSHI_KEY("supersample", INTEGER, AT(supersample), .lowest = 1.0, .highest = 16.0,
             VSHI_OPTION("supersample", "N", TEXELS, "N × N samples a texel")),
    VSHI_KEY("padding", CUSTOM, AT(padding), .read = read_padding,
             VSHI_OPTION("padding", "N", TEXELS,
                         "texels by which charts grow; auto: fill all, for mip levels",
                         .range = "a whole number from 0 to 4096, or auto", .otherwise = "4")),
    VSHI_KEY(
        "seams", NAME, AT(seams), .variants = MESH, .names = VSH_NAMES_SEAMS,
        VSHI_OPTION("seams", "WHAT", TEXELS,
                    "fix: values at borders of charts move by up to --max-error, so that both sides agree",
                    .otherwise = "fix for .glb and .gltf, keep for images")),
    VSHI_KEY("ao_spacing", INTEGER, AT(ao_spacing), .lowest = 1.0, .highest = 8.0,
             VSHI_OPTION("ao-spacing", "N", FILE_ONLY,
                         "texels: above 1, texels share the rays of AO by exact and adaptive",
                         .range = "1, 2, 4 or 8")),
    VSHI_KEY("output", PATH, AT(output), .required = VSHI_ALL),
    VSHI_KEY("vertex_colors", STRING, AT(vertex_colors),
             VSHI_OPTION("vertex-colors", "VALUE", IMAGE,
                         "into a .glb, .gltf or .obj: vertex colours instead of lightmaps, without UVs",
                         .range = "ao, irradiance or shadow.NAME", .otherwise = "none")),
    VSHI_KEY("bits", CUSTOM, AT(bits), .read = vshi_read_bits,
             VSHI_OPTION("bits", "N", IMAGE, "bits a channel", .range = "8, 16 or 32",
                         .otherwise = "32 for EXR, else 16 if the format has it, else 8")),
    VSHI_KEY("pack", STRING, AT(pack),
             VSHI_OPTION("pack", "R=NAME,…", IMAGE,
                         "channels of formats without names: R=shadow.sun,G=ao,A=A; 0 and 1 are constants; "
                         "rgb: the irradiance, or shadow * ao in grey",
                         .otherwise = "irradiance or the first three but A to R, G, B; A to A; EXR: all by "
                                      "name and the picture; channels: without the picture")),
    VSHI_KEY("color_space", NAME, AT(color_space), .name_of = vshi_color_space_key,
             VSHI_OPTION("color-space", "SPACE", FILE_ONLY, "of R, G, B in 8 and 16 bits",
                         .otherwise = "auto: srgb for irradiance and tints, linear for the rest")),
};
static const vshi_table receiver_table = VSHI_TABLE(receiver_keys);

#undef AT

static vsh_result read_receiver(vshi_json *reader, const vshi_value *value, void *member) {
    static const char *const keys[] = {"mesh", "heightfield", "plane"};
    static const char *const whats[] = {"a receiver", "a heightfield receiver", "a plane receiver"};
    vsh_receiver *receiver = member;
    vshi_value given;
    *receiver = vsh_receiver_default();
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    int32_t type;
    VSHI_TRY(vshi_read_type(reader, value, keys, 3, &type));
    receiver->type = type < 0 ? VSH_RECEIVER_MESH : type;
    VSHI_TRY(vshi_read_object(reader, value, &receiver_table, 1U << receiver->type, whats[receiver->type],
                              receiver));
    return vshi_member(value, "plane", &given) ? read_plane(reader, &given, receiver) : VSH_OK;
}

/* --- scenes */

/* Names of lights, each a string that is the name of one. */
static vsh_result read_light_names(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene_layer *layer = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_ARRAY));
    const vshi_key key = {.kind = VSHI_STRING};
    const size_t count = json_array_size(value->json);
    const char **names;
    /* one more, so that a list without lights is not NULL: that stands for all lights */
    VSHI_TRY(vshi_json_allocate(reader, (void **)&names, count + 1, sizeof *names, "lights of a layer"));
    for (size_t i = 0; i < count; ++i) {
        const vshi_value name = vshi_item(value, i);
        VSHI_TRY(vshi_read_value(reader, &name, &key, &names[i]));
    }
    layer->lights = names;
    layer->light_count = count;
    return VSH_OK;
}

#define AT(member) .offset = offsetof(vsh_scene_layer, member)
static const vshi_key layer_keys[] = {
    VSHI_KEY("name", STRING, AT(name), .required = VSHI_ALL),
    VSHI_KEY("voxel_size", NUMBER, AT(voxel_size), .lowest = VSHI_SMALLEST_LENGTH,
             .highest = VSHI_LARGEST_VOXEL),
    VSHI_KEY("resolution", INTEGER, AT(resolution), .lowest = 2.0, .highest = 65536.0),
    VSHI_KEY("method", NAME, AT(method), .names = VSH_NAMES_SHADOW),
    VSHI_KEY("combine", NAME, AT(combine), .names = VSH_NAMES_COMBINE),
    VSHI_KEY("softness", NUMBER, AT(softness), .highest = 1000.0),
    VSHI_KEY("remap", VECTOR, AT(remap), .highest = 1.0, .count = 2),
    VSHI_KEY("start_offset", NUMBER, AT(start_offset), .highest = 16.0),
    VSHI_KEY("lights", CUSTOM, .read = read_light_names),
    VSHI_KEY("ao", BOOL, AT(ao)),
};
static const vshi_table layer_table = VSHI_TABLE(layer_keys);
#undef AT

static vsh_result read_layer(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene_layer *layer = member;
    *layer = vsh_scene_layer_default();
    VSHI_TRY(vshi_read_object(reader, value, &layer_table, 1, "a layer", layer));
    VSHI_TRY(vshi_reject_both(reader, value, "voxel_size", "resolution"));
    vshi_value remap;
    if (vshi_member(value, "remap", &remap) && !(layer->remap[0] < layer->remap[1])) {
        return vshi_json_fail(reader, &remap, "expected two numbers that rise, found %g and %g",
                              layer->remap[0], layer->remap[1]);
    }
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
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        sorted[i] = &scene->receivers[i];
    }
    if (sorted != NULL) {
        qsort(sorted, scene->receiver_count, sizeof *sorted, by_output);
    }
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

/* Scene units, or "auto": 0, until the assets are loaded. */
static vsh_result read_ao_distance(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = VSHI_NUMBER, .lowest = VSHI_SMALLEST_LENGTH, .highest = VSHI_LARGEST};
    *(double *)member = 0.0;
    return read_auto(reader, value, &key, member);
}

#define AT(member) .offset = offsetof(vsh_scene, member)
static const vshi_key ao_keys[] = {
    VSHI_KEY("distance", CUSTOM, AT(shade.ao_distance), .required = VSHI_ALL, .read = read_ao_distance,
             .flag = offsetof(vsh_scene, ao),
             VSHI_OPTION("ao", "DISTANCE", OCCLUSION,
                         "ambient occlusion within a distance, scene units; auto: a twelfth of the diagonal "
                         "of casters and receivers",
                         .range = "a number from 1e-12 to 1e+15, or auto", .otherwise = "none")),
    VSHI_KEY("method", NAME, AT(shade.ao_method), .names = VSH_NAMES_AO,
             VSHI_OPTION("ao-method", "NAME", OCCLUSION, "method of AO; cones and taps are previews")),
    VSHI_KEY("cones", INTEGER, AT(shade.ao_cones),
             .variants = 1U << VSH_AO_CONES | 1U << VSH_AO_ADAPTIVE | 1U << VSH_AO_EXACT | 1U << VSH_AO_AUTO,
             .lowest = 1.0, .highest = 256.0),
    VSHI_KEY("bent_normals", NAME, AT(bent), .variants = ~(1U << VSH_AO_TAPS), .names = VSH_NAMES_BENT,
             VSHI_OPTION("bent-normals", "SPACE", CHANNELS,
                         "with --ao also bent.X, .Y, .Z: the mean open direction, in world or tangent space",
                         .otherwise = "none")),
};
const vshi_table vshi_ao_table = VSHI_TABLE(ao_keys);

static vsh_result read_ao(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_scene *scene = member;
    int32_t method = scene->shade.ao_method;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_read_choice(reader, value, &(vshi_key){.name = "method", .names = VSH_NAMES_AO}, &method));
    scene->shade.ao_method = method;
    const char *what = method == VSH_AO_TAPS ? "ao by taps" : method == VSH_AO_RAYS ? "ao by rays" : "ao";
    return vshi_read_object(reader, value, &vshi_ao_table, 1U << method, what, scene);
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

static void drop_voxel_size(void *target) {
    vsh_scene *scene = target;
    scene->grid.voxel_size = 0.0; /* it would overrule the resolution */
}

/* A name, or metres. */
static vsh_result read_unit(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key metres = {.kind = VSHI_NUMBER, .highest = 1e12, .flags = VSHI_ABOVE};
    vsh_scene *scene = member;
    if (!json_is_string(value->json)) {
        return vshi_read_value(reader, value, &metres, &scene->unit);
    }
    scene->unit = vshi_find_unit(json_string_value(value->json));
    return scene->unit > 0.0 ? VSH_OK
                             : vshi_json_fail(reader, value, "\"%.64s\" is none of m, cm, mm, in, ft",
                                              json_string_value(value->json));
}

static const vshi_key scene_keys[] = {
    VSHI_KEY("casters", LIST, AT(casters), .lowest = 1.0, .highest = MAX_ITEMS, .read = vshi_read_caster,
             .count = sizeof(vsh_caster)),
    VSHI_KEY("voxel_size", NUMBER, AT(grid.voxel_size), .lowest = VSHI_SMALLEST_LENGTH,
             .highest = VSHI_LARGEST_VOXEL, .flag = offsetof(vsh_scene, voxels_named),
             VSHI_OPTION("voxel-size", "SIZE", CASTERS,
                         "instead of --resolution: the edge of a voxel, scene units",
                         .otherwise = "by --resolution")),
    VSHI_KEY("resolution", INTEGER, AT(grid.resolution), .lowest = 2.0, .highest = 65536.0,
             .flag = offsetof(vsh_scene, voxels_named), .then = drop_voxel_size,
             VSHI_OPTION("resolution", "N", CASTERS, "voxels along the longest side of the casters",
                         .otherwise = "automatic: see docs/accuracy.md")),
    VSHI_KEY("half_width", NUMBER, AT(grid.half_width), .lowest = 3.0, .highest = 100.0,
             VSHI_OPTION("half-width", "VOXELS", LEVEL_SET, "half width of the narrow band")),
    VSHI_KEY("shell_thickness", NUMBER, AT(grid.shell_thickness), .lowest = 1.0, .highest = 50.0,
             VSHI_OPTION("shell-thickness", "VOXELS", LEVEL_SET,
                         "thickness of sheets and of walls behind rooms' faces")),
    VSHI_KEY("layers", LIST, AT(layers), .highest = VSHI_MAX_LAYERS, .read = read_layer,
             .count = sizeof(vsh_scene_layer)),
    VSHI_KEY("lights", LIST, AT(lights), .highest = MAX_LIGHTS, .read = vshi_read_light,
             .count = sizeof(vsh_light)),
    VSHI_KEY("ao", CUSTOM, .read = read_ao),
    VSHI_KEY(
        "irradiance", BOOL, AT(irradiance),
        VSHI_OPTION("irradiance", NULL, CHANNELS,
                    "also irradiance.R, .G, .B: Σ visibility × colour × falloff × cosine, × AO if baked")),
    VSHI_KEY("ambient", VECTOR, AT(ambient), .highest = VSHI_LARGEST, .count = 3,
             .flag = offsetof(vsh_scene, has_ambient),
             VSHI_OPTION("ambient", "R,G,B", CHANNELS,
                         "light from all around, linear: irradiance is that of lights + ambient × AO",
                         .otherwise = "none")),
    VSHI_KEY("tint", CUSTOM, .read = read_tint,
             VSHI_OPTION("tint", "TINT", FILE_ONLY,
                         "also tint.NAME.R, .G, .B: coloured penumbrae, (V, V²/2 + V/2, V²) or powers of V",
                         .range = "quadratic, or R,G,B: powers from 0.0625 to 16", .otherwise = "none")),
    VSHI_KEY(
        "method", NAME, AT(shade.method), .names = VSH_NAMES_SHADOW,
        VSHI_OPTION("method", "NAME", OCCLUSION,
                    "method of shadows; auto: exact, or adaptive for a .vdb file, or for masks and text; all "
                    "but these and rays are previews")),
    VSHI_KEY("rays", INTEGER, AT(shade.rays), .lowest = 1.0, .highest = 4096.0,
             VSHI_OPTION("rays", "N", ACCURACY, "rays a texel; with adaptive and exact a limit",
                         .otherwise = "64, or as many as the error needs")),
    VSHI_KEY("sampler", NAME, AT(shade.sampler), .names = VSH_NAMES_SAMPLER,
             VSHI_OPTION("sampler", "NAME", FILE_ONLY, "pattern of the rays")),
    VSHI_KEY("frame", INTEGER, AT(shade.frame), .highest = INT32_MAX,
             VSHI_OPTION("frame", "N", FILE_ONLY,
                         "another set of rays: bakes of frames 0, 1, 2 … may be averaged")),
    VSHI_KEY("early_rays", INTEGER, AT(shade.early_rays), .highest = 4096.0,
             VSHI_OPTION("early-rays", "N", FILE_ONLY,
                         "with rays: if the first N agree, the rest are not marched",
                         .otherwise = "0: never")),
    VSHI_KEY(
        "max_error", NUMBER, AT(shade.max_error), .lowest = 1e-4, .highest = 1.0,
        VSHI_OPTION("max-error", "E", ACCURACY,
                    "standard error of a value, by as many rays as needed; preview methods become auto")),
    VSHI_KEY("jitter", NUMBER, AT(shade.jitter), .highest = 1.0,
             VSHI_OPTION("jitter", "J", FILE_ONLY,
                         "shadows by one march: the largest share by which a texel's steps are shorter")),
    VSHI_KEY(
        "error", BOOL, AT(error),
        VSHI_OPTION("error", NULL, ACCURACY,
                    "also error.NAME of each light and error.ao: the standard error left in each value")),
    VSHI_KEY("invalid", BOOL, AT(planes.invalid),
             VSHI_OPTION("invalid-channel", NULL, FILE_ONLY,
                         "also the channel invalid: 1 for texels inside solids or behind walls, else 0")),
    VSHI_KEY(
        "sky", NAME, AT(planes.sky), .names = VSH_NAMES_UP,
        VSHI_OPTION("sky", "AXIS", CHANNELS, "also sky: the visible share of an even sky over this axis")),
    VSHI_KEY("max_steps", INTEGER, AT(shade.max_steps), .lowest = 16.0, .highest = 65536.0,
             VSHI_OPTION("max-steps", "N", FILE_ONLY, "steps after which a ray ends")),
    VSHI_KEY("start_offset", NUMBER, AT(shade.start_offset), .highest = 16.0,
             VSHI_OPTION("start-offset", "VOXELS", FILE_ONLY,
                         "distance from the surface to the start of rays, along the normal")),
    VSHI_KEY("unit", CUSTOM, .read = read_unit,
             VSHI_OPTION("unit", "UNIT", CASTERS, "unit of the numbers in mesh files",
                         .range = "m, cm, mm, in, ft, or metres",
                         .otherwise = "that of FBX and DAE files; OBJ, PLY and STL stay as they are")),
    VSHI_KEY("cast_blended", BOOL, AT(cast_blended),
             VSHI_OPTION("cast-blended", NULL, CASTERS, "meshes of blended materials (glass) cast too")),
    VSHI_KEY("receivers", LIST, AT(receivers), .highest = MAX_ITEMS, .read = read_receiver,
             .count = sizeof(vsh_receiver)),
};
const vshi_table vshi_scene_table = VSHI_TABLE(scene_keys);
_Static_assert(offsetof(vsh_scene, caster_count) == offsetof(vsh_scene, casters) + sizeof(void *) &&
                   offsetof(vsh_scene, layer_count) == offsetof(vsh_scene, layers) + sizeof(void *) &&
                   offsetof(vsh_scene, light_count) == offsetof(vsh_scene, lights) + sizeof(void *) &&
                   offsetof(vsh_scene, receiver_count) == offsetof(vsh_scene, receivers) + sizeof(void *),
               "lists are as vshi_list");

static bool has_terrain(const vsh_scene *scene, const char *path) {
    bool found = false;
    for (size_t i = 0; i < scene->caster_count && !found; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        found = caster->type == VSH_CASTER_HEIGHTFIELD && strcmp(caster->path, path) == 0;
    }
    return found;
}

/* Adds casters for terrains that receive, unless the scene names them as casters. */
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
        if (receiver->type == VSH_RECEIVER_HEIGHTFIELD && !has_terrain(scene, receiver->path)) {
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

/* --- layers */

/* The number of the layer of that name; SIZE_MAX: there is none. */
static size_t find_layer(const vsh_scene *scene, const char *name) {
    for (size_t k = 0; k < scene->layer_count; ++k) {
        if (strcmp(scene->layers[k].name, name) == 0) {
            return k;
        }
    }
    return SIZE_MAX;
}

static bool has_light(const vsh_scene *scene, const char *name) {
    bool found = false;
    for (size_t i = 0; i < scene->light_count && !found; ++i) {
        found = strcmp(scene->lights[i].name, name) == 0;
    }
    return found;
}

/* Fails if an item of a list names a layer that the scene does not have. */
static vsh_result check_layer(vshi_json *reader, const vshi_value *value, const vsh_scene *scene) {
    VSHI_TRY(vshi_expect(reader, value, JSON_STRING));
    const char *name = json_string_value(value->json);
    return find_layer(scene, name) != SIZE_MAX
               ? VSH_OK
               : vshi_json_fail(reader, value, "\"%.64s\" is none of the scene's layers", name);
}

/* Checks the names of layers, and the names that casters and layers refer to. */
static vsh_result check_layers(vshi_json *reader, const vshi_value *root, const vsh_scene *scene) {
    vshi_value list, lights, name;
    for (size_t i = 0; i < scene->caster_count && vshi_member(root, "casters", &list); ++i) {
        const vshi_value caster = vshi_item(&list, i);
        if (scene->casters[i].layer != NULL && vshi_member(&caster, "layer", &name)) {
            VSHI_TRY(check_layer(reader, &name, scene));
        }
    }
    for (size_t i = 0; i < scene->layer_count && vshi_member(root, "layers", &list); ++i) {
        const vsh_scene_layer *layer = &scene->layers[i];
        const vshi_value item = vshi_item(&list, i);
        const size_t first = find_layer(scene, layer->name);
        if (first < i && vshi_member(&item, "name", &name)) {
            return vshi_json_fail(reader, &name, "\"%.64s\" is the name of layers[%zu] too", layer->name,
                                  first);
        }
        for (size_t k = 0; layer->lights != NULL && k < layer->light_count; ++k) {
            if (!has_light(scene, layer->lights[k]) && vshi_member(&item, "lights", &lights)) {
                name = vshi_item(&lights, k);
                return vshi_json_fail(reader, &name, "\"%.64s\" is none of the scene's lights",
                                      layer->lights[k]);
            }
        }
    }
    return VSH_OK;
}

/* --- the scene */

static vsh_result read_scene(vshi_json *reader, const vshi_value *root, void *made) {
    vsh_scene *scene = made;
    vshi_value lights, receivers, region;
    *scene = vsh_scene_default();
    VSHI_TRY(vshi_expect(reader, root, JSON_OBJECT));
    if (vshi_member(root, "region", &region)) {
        return vshi_json_fail(reader, &region, "belongs to flat scenes, which 'vdbshade flat' bakes");
    }
    VSHI_TRY(vshi_read_object(reader, root, &vshi_scene_table, 1, "a scene", scene));
    VSHI_TRY(vshi_reject_both(reader, root, "voxel_size", "resolution"));
    if (vshi_member(root, "receivers", &receivers)) {
        VSHI_TRY(check_outputs(reader, &receivers, scene));
    }
    VSHI_TRY(add_terrains(reader, root, scene));
    if (vshi_member(root, "lights", &lights)) {
        VSHI_TRY(vshi_check_light_names(reader, &lights, scene->lights, scene->light_count));
    }
    return check_layers(reader, root, scene);
}

vsh_result vshi_scene_parse(const char *path, const char *text, size_t size, vsh_scene **scene,
                            vsh_error *error) {
    vshi_json reader = {.path = path, .error = error, .text = text, .size = size};
    void *made;
    const vsh_result result = vshi_json_parse(&reader, sizeof **scene, read_scene, &made);
    *scene = made;
    return result;
}

vsh_result vshi_scene_file_read(const char *path, const vsh_run *run, size_t size, vshi_read_fn *read,
                                void **made, vsh_error *error) {
    VSHI_FLOATS;
    vsh_run full;
    *made = NULL;
    VSHI_NEEDS(path);
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_unsupported_check(path, error));
    vshi_json reader = {.path = path, .run = &full, .error = error};
    return vshi_json_read(&reader, size, read, made);
}

vsh_result vsh_scene_read(const char *path, const vsh_run *run, vsh_scene **scene, vsh_error *error) {
    VSHI_NEEDS(scene);
    void *made;
    const vsh_result result = vshi_scene_file_read(path, run, sizeof **scene, read_scene, &made, error);
    *scene = made;
    return result;
}

void vsh_scene_free(vsh_scene *scene) {
    vshi_json_free(scene);
}

/* --- settings: keys that are also options */

/* Tables with settings, and the prefixes of their keys. */
static const struct {
    const vshi_table *table;
    const char *prefix;
    int32_t owner;
} places[] = {
    {&vshi_scene_table, "", VSH_SETTING_OF_SCENE},
    {&vshi_ao_table, "ao.", VSH_SETTING_OF_SCENE},
    {&receiver_table, "receivers.", VSH_SETTING_OF_RECEIVER},
    {&vshi_flat_table, "", VSH_SETTING_OF_FLAT},
};
enum { PLACES = sizeof places / sizeof places[0] };

static const vshi_key *find_key(size_t index, size_t *place) {
    for (*place = 0; *place < PLACES; ++*place) {
        const vshi_table *table = places[*place].table;
        for (size_t i = 0; i < table->key_count; ++i) {
            if (table->keys[i].option.name != NULL && index-- == 0) {
                return &table->keys[i];
            }
        }
    }
    return NULL;
}

int32_t vsh_setting_get(size_t index, vsh_setting *setting) {
    const vsh_scene scene = vsh_scene_default();
    const vsh_receiver receiver = vsh_receiver_default();
    const vsh_flat_scene flat = vsh_flat_scene_default();
    const void *const defaults[] = {[VSH_SETTING_OF_SCENE] = &scene,
                                    [VSH_SETTING_OF_RECEIVER] = &receiver,
                                    [VSH_SETTING_OF_FLAT] = &flat};
    size_t place;
    const vshi_key *key = find_key(index, &place);
    if (key == NULL) {
        return 0;
    }
    const vshi_option *option = &key->option;
    memset(setting, 0, sizeof *setting);
    snprintf(setting->key, sizeof setting->key, "%s%s", places[place].prefix, key->name);
    snprintf(setting->option, sizeof setting->option, "%s", option->name);
    snprintf(setting->value, sizeof setting->value, "%s", option->value != NULL ? option->value : "");
    snprintf(setting->help, sizeof setting->help, "%s", option->help);
    vshi_key_range(key, setting->range, sizeof setting->range);
    if (option->otherwise != NULL) {
        snprintf(setting->otherwise, sizeof setting->otherwise, "%s", option->otherwise);
    } else {
        vshi_key_value(key, defaults[places[place].owner], setting->otherwise, sizeof setting->otherwise);
    }
    setting->group = option->group;
    setting->owner = places[place].owner;
    return 1;
}

static bool is_called(const vshi_key *key, const char *prefix, const char *name) {
    const size_t length = strlen(prefix);
    return (strncmp(name, "--", 2) == 0 && strcmp(name + 2, key->option.name) == 0) ||
           (strncmp(name, prefix, length) == 0 && strcmp(name + length, key->name) == 0);
}

/* Sets a member of `target`, which has `size` bytes; a wrong text changes nothing. */
static vsh_result set(int32_t owner, const char *name, const char *text, void *target, size_t size,
                      vsh_error *error) {
    static const char *const owners[] = {"scene", "receiver", "flat scene"};
    union {
        vsh_scene scene;
        vsh_receiver receiver;
        vsh_flat_scene flat;
    } changed;
    size_t place;
    const vshi_key *key;
    VSHI_NEEDS(name);
    for (size_t i = 0; (key = find_key(i, &place)) != NULL; ++i) {
        if (places[place].owner == owner && is_called(key, places[place].prefix, name)) {
            memcpy(&changed, target, size);
            VSHI_TRY(vshi_read_text(key, name, text, &changed, error));
            memcpy(target, &changed, size);
            return VSH_OK;
        }
    }
    return vshi_fail(error, VSH_ERROR_ARGUMENT, "%.64s: no such setting of a %s", name, owners[owner]);
}

vsh_result vsh_scene_set(vsh_scene *scene, const char *name, const char *text, vsh_error *error) {
    VSHI_NEEDS(scene);
    return set(VSH_SETTING_OF_SCENE, name, text, scene, sizeof *scene, error);
}

vsh_result vsh_receiver_set(vsh_receiver *receiver, const char *name, const char *text, vsh_error *error) {
    VSHI_NEEDS(receiver);
    return set(VSH_SETTING_OF_RECEIVER, name, text, receiver, sizeof *receiver, error);
}

vsh_result vsh_flat_scene_set(vsh_flat_scene *scene, const char *name, const char *text, vsh_error *error) {
    VSHI_NEEDS(scene);
    return set(VSH_SETTING_OF_FLAT, name, text, scene, sizeof *scene, error);
}
