#include "base/try.h"
#include "scene/parts.h"
#include "scene/transform.h"

#include <vdbshade/image.h>
#include <vdbshade/settings.h>

#include <math.h>
#include <string.h>

vsh_result vshi_read_size(vshi_json *reader, const vshi_value *value, int32_t *width, int32_t *height) {
    const vshi_key key = {.kind = VSHI_INTEGER, .lowest = 1.0, .highest = VSH_MAX_LIGHTMAP_SIZE};
    if (!json_is_array(value->json)) {
        const vsh_result result = vshi_read_value(reader, value, &key, width);
        *height = *width;
        return result;
    }
    const size_t count = json_array_size(value->json);
    if (count != 2) {
        return vshi_json_fail(reader, value, "expected 2 numbers, found %zu", count);
    }
    const vshi_value first = vshi_item(value, 0), second = vshi_item(value, 1);
    VSHI_TRY(vshi_read_value(reader, &first, &key, width));
    return vshi_read_value(reader, &second, &key, height);
}

static vsh_result read_size(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_receiver *receiver = member;
    return vshi_read_size(reader, value, &receiver->width, &receiver->height);
}

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
    for (void *at = json_object_iter(value->json); at != NULL; at = json_object_iter_next(value->json, at)) {
        vshi_value factor;
        vsh_density_rule *rule = &rules[receiver->density_count++];
        VSHI_TRY(vshi_json_copy(reader, 0, json_object_iter_key(at), &rule->pattern));
        vshi_member(value, json_object_iter_key(at), &factor);
        VSHI_TRY(vshi_read_value(reader, &factor, &key, &rule->factor));
    }
    return VSH_OK;
}

/* Texels, or "auto". */
static vsh_result read_padding(vshi_json *reader, const vshi_value *value, void *member) {
    const vshi_key key = {.kind = VSHI_INTEGER, .highest = 4096.0};
    int32_t *padding = member;
    if (!json_is_string(value->json)) {
        return vshi_read_value(reader, value, &key, padding);
    }
    *padding = VSH_PADDING_AUTO;
    return strcmp(json_string_value(value->json), "auto") == 0
               ? VSH_OK
               : vshi_json_fail(reader, value, "\"%.64s\" is none of auto, a whole number from 0 to 4096",
                                json_string_value(value->json));
}

enum {
    MESH = 1 << VSH_RECEIVER_MESH,
    HEIGHTFIELD = 1 << VSH_RECEIVER_HEIGHTFIELD,
    PLANE = 1 << VSH_RECEIVER_PLANE
};

typedef struct plane {
    double size[2], center[3], normal[3];
} plane;

static const vshi_key plane_keys[] = {
    {.name = "size",
     .kind = VSHI_VECTOR,
     .required = VSHI_ALL,
     .offset = offsetof(plane, size),
     .count = 2,
     .lowest = 1e-12,
     .highest = 1e12},
    {.name = "center",
     .kind = VSHI_VECTOR,
     .offset = offsetof(plane, center),
     .count = 3,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST},
    {.name = "normal",
     .kind = VSHI_VECTOR,
     .offset = offsetof(plane, normal),
     .count = 3,
     .lowest = -VSHI_LARGEST,
     .highest = VSHI_LARGEST,
     .flags = VSHI_NONZERO},
};
static const vshi_table plane_table = VSHI_TABLE(plane_keys);

/* Turns +y into the normal the shortest way, and moves the origin to the center, before the transform. */
static void stand(const plane *p, double transform[12]) {
    const double length =
        sqrt(p->normal[0] * p->normal[0] + p->normal[1] * p->normal[1] + p->normal[2] * p->normal[2]);
    const double a = p->normal[0] / length, b = p->normal[1] / length, c = p->normal[2] / length;
    const double s = b > -1.0 ? 1.0 / (1.0 + b) : 0.0; /* upside down: half a turn about x */
    const double turned[3][4] = {{1.0 - a * a * s, a, -a * c * s, p->center[0]},
                                 {-a, b, -c, p->center[1]},
                                 {-a * c * s, c, b > -1.0 ? 1.0 - c * c * s : -1.0, p->center[2]}};
    double before[12];
    memcpy(before, transform, sizeof before);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            double sum = column == 3 ? before[4 * row + 3] : 0.0;
            for (int k = 0; k < 3; ++k) {
                sum += before[4 * row + k] * turned[k][column];
            }
            transform[4 * row + column] = sum;
        }
    }
}

/* Comes after the other keys, as it is put before the transform. */
static vsh_result take_plane(vshi_json *reader, const vshi_value *value, vsh_receiver *receiver) {
    plane p = {.normal = {0.0, 1.0, 0.0}};
    VSHI_TRY(vshi_read_object(reader, value, &plane_table, 1, "a plane", &p));
    memcpy(receiver->extent, p.size, sizeof p.size);
    stand(&p, receiver->transform);
    receiver->path = "plane";
    return VSH_OK;
}

static vsh_result read_plane(vshi_json *reader, const vshi_value *value, void *member) {
    (void)member;
    return vshi_expect(reader, value, JSON_OBJECT);
}

const char *vshi_color_space_key(int32_t i) {
    return i < VSH_COLOR_ENCODED ? vsh_get_name(VSH_NAMES_COLOR, i) : NULL; /* bakes are never encoded yet */
}

static const vshi_key receiver_keys[] = {
    {.name = "mesh",
     .kind = VSHI_PATH,
     .variants = MESH,
     .required = MESH,
     .offset = offsetof(vsh_receiver, path)},
    {.name = "heightfield",
     .kind = VSHI_PATH,
     .variants = HEIGHTFIELD,
     .offset = offsetof(vsh_receiver, path)},
    {.name = "plane", .kind = VSHI_CUSTOM, .variants = PLANE, .read = read_plane},
    {.name = "extent",
     .kind = VSHI_VECTOR,
     .variants = HEIGHTFIELD,
     .required = HEIGHTFIELD,
     .offset = offsetof(vsh_receiver, extent),
     .count = 2,
     .lowest = 1e-12,
     .highest = 1e12},
    {.name = "height",
     .kind = VSHI_NUMBER,
     .variants = HEIGHTFIELD,
     .required = HEIGHTFIELD,
     .offset = offsetof(vsh_receiver, relief),
     .lowest = -1e12,
     .highest = 1e12},
    {.name = "transform",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(vsh_receiver, transform),
     .read = vshi_read_transform},
    {.name = "uv_set",
     .kind = VSHI_INTEGER,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, uv_set),
     .highest = VSH_MAX_UV_SETS - 1,
     .option = {.name = "uv-set",
                .value = "N",
                .group = VSH_SETTINGS_TEXELS,
                .help = "UV set of the lightmap",
                .otherwise = "the second where there is one, else the first"}},
    {.name = "objects",
     .kind = VSHI_CUSTOM,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, objects),
     .read = vshi_read_only},
    {.name = "except",
     .kind = VSHI_CUSTOM,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, objects),
     .read = vshi_read_except},
    {.name = "allow_overlap",
     .kind = VSHI_BOOL,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, allow_overlap),
     .option =
         {.name = "allow-overlap",
          .group = VSH_SETTINGS_FILE_ONLY,
          .help = "bake objects that lie over each other in the lightmap, too: the first keeps the texels"}},
    {.name = "unwrap",
     .kind = VSHI_NAME,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, unwrap),
     .names = VSH_NAMES_RECEIVER_UNWRAP,
     .option = {.name = "unwrap",
                .value = "MODE",
                .group = VSH_SETTINGS_TEXELS,
                .help = "make lightmap UVs: always, or (auto) where the file's own cannot be baked",
                .otherwise = "auto for .glb and .gltf, never for images"}},
    {.name = "texels_per_unit",
     .kind = VSHI_NUMBER,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, texels_per_unit),
     .highest = VSHI_LARGEST,
     .flags = VSHI_ABOVE,
     .option = {.name = "texels-per-unit",
                .value = "N",
                .group = VSH_SETTINGS_TEXELS,
                .help = "density of UVs that are made, texels along a scene unit",
                .otherwise = "the most that fit"}},
    {.name = "pages",
     .kind = VSHI_INTEGER,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, pages),
     .lowest = 1.0,
     .highest = VSH_MAX_PAGES,
     .option = {.name = "pages",
                .value = "N",
                .group = VSH_SETTINGS_TEXELS,
                .help = "images of --size that may be filled with UVs that are made: OUT.0.exr, OUT.1.exr, …",
                .otherwise = "1; with --texels-per-unit as many as it takes"}},
    {.name = "density", .kind = VSHI_CUSTOM, .variants = MESH, .offset = 0, .read = read_density},
    {.name = "atlas",
     .kind = VSHI_NAME,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, atlas),
     .names = VSH_NAMES_ATLAS,
     .option = {.name = "atlas",
                .value = "WHAT",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help =
                    "objects: an image for each object, OUT.NAME.exr, whose UVs, where they are made, are "
                    "packed alone; shared: all lie on the same"}},
    {.name = "max_size",
     .kind = VSHI_INTEGER,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, max_size),
     .lowest = 1.0,
     .highest = VSH_MAX_LIGHTMAP_SIZE,
     .option = {.name = "max-size",
                .value = "N",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "with --texels-per-unit, instead of --size: images are as small as what lies on them "
                        "allows, their sides powers of two up to N",
                .otherwise = "--size is that of all"}},
    {.name = "size",
     .kind = VSHI_CUSTOM,
     .read = read_size,
     .option = {.name = "size",
                .value = "W[xH]",
                .group = VSH_SETTINGS_IMAGE,
                .help = "texels of the lightmap",
                .range = "W or WxH, each from 1 to 65536 texels",
                .otherwise = "1024",
                .by = true}},
    {.name = "supersample",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_receiver, supersample),
     .lowest = 1.0,
     .highest = 16.0,
     .option = {.name = "supersample",
                .value = "N",
                .group = VSH_SETTINGS_TEXELS,
                .help = "N × N samples a texel"}},
    {.name = "padding",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(vsh_receiver, padding),
     .read = read_padding,
     .option = {.name = "padding",
                .value = "N",
                .group = VSH_SETTINGS_TEXELS,
                .help = "texels that charts are grown by; auto: all is filled, so that no mip level reads "
                        "background",
                .range = "a whole number from 0 to 4096, or auto",
                .otherwise = "4"}},
    {.name = "seams",
     .kind = VSHI_NAME,
     .variants = MESH,
     .offset = offsetof(vsh_receiver, seams),
     .names = VSH_NAMES_SEAMS,
     .option = {.name = "seams",
                .value = "WHAT",
                .group = VSH_SETTINGS_TEXELS,
                .help =
                    "fix: values on both sides of a chart's border are made to agree where the surface is "
                    "smooth, moved by up to --max-error",
                .otherwise = "fix for .glb and .gltf, keep for images"}},
    {.name = "ao_spacing",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_receiver, ao_spacing),
     .lowest = 1.0,
     .highest = 8.0,
     .option = {.name = "ao-spacing",
                .value = "N",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "texels: AO by cones or adaptive is interpolated between texels so far "
                        "apart where casters are far; texels share the rays of exact AO; 1: neither",
                .range = "1, 2, 4 or 8"}},
    {.name = "output", .kind = VSHI_PATH, .required = VSHI_ALL, .offset = offsetof(vsh_receiver, output)},
    {.name = "bits",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(vsh_receiver, bits),
     .read = vshi_read_bits,
     .option = {.name = "bits",
                .value = "N",
                .group = VSH_SETTINGS_IMAGE,
                .help = "bits a channel",
                .range = "8, 16 or 32",
                .otherwise = "32 for EXR, else 16 where the format has it, else 8"}},
    {.name = "pack",
     .kind = VSHI_STRING,
     .offset = offsetof(vsh_receiver, pack),
     .option = {.name = "pack",
                .value = "R=NAME,…",
                .group = VSH_SETTINGS_IMAGE,
                .help = "what goes where in formats that cannot name channels: R=shadow.sun,G=ao,A=A; 0 and "
                        "1 are constants; rgb: the irradiance, or shadow * ao in grey",
                .otherwise = "irradiance or the first three but A to R, G, B; A to A; EXR: all by name and "
                             "the picture; channels: without the picture"}},
    {.name = "color_space",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_receiver, color_space),
     .name_of = vshi_color_space_key,
     .option = {.name = "color-space",
                .value = "SPACE",
                .group = VSH_SETTINGS_FILE_ONLY,
                .help = "of R, G, B in 8 and 16 bits",
                .otherwise = "auto: srgb for irradiance and tints, linear for the rest"}},
};
const vshi_table vshi_receiver_table = VSHI_TABLE(receiver_keys);

vsh_result vshi_read_receiver(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_receiver *receiver = member;
    *receiver = vsh_receiver_default();
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    VSHI_TRY(vshi_reject_both(reader, value, "mesh", "heightfield"));
    VSHI_TRY(vshi_reject_both(reader, value, "mesh", "plane"));
    VSHI_TRY(vshi_reject_both(reader, value, "heightfield", "plane"));
    static const char *const whats[] = {"a receiver", "a heightfield receiver", "a plane receiver"};
    vshi_value given;
    receiver->type = vshi_member(value, "heightfield", &given) ? VSH_RECEIVER_HEIGHTFIELD
                     : vshi_member(value, "plane", &given)     ? VSH_RECEIVER_PLANE
                                                               : VSH_RECEIVER_MESH;
    VSHI_TRY(vshi_read_object(reader, value, &vshi_receiver_table, 1U << receiver->type,
                              whats[receiver->type], receiver));
    return receiver->type == VSH_RECEIVER_PLANE ? take_plane(reader, &given, receiver) : VSH_OK;
}
