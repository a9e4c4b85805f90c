/* Reads receivers, and the settings of their images, from scene files. */
#include "scene/scene.h"

#include <math.h>
#include <string.h>
#include <vdbshade/image.h>

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
    vshi_value factor = {.json = NULL};
    while (vshi_next_member(value, &factor)) {
        vsh_density_rule *rule = &rules[receiver->density_count++];
        VSHI_TRY(vshi_json_copy(reader, 0, factor.key, &rule->pattern));
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

#define AT(member) .offset = offsetof(plane, member)
static const vshi_key plane_keys[] = {
    VSHI_KEY("size", VECTOR, AT(size), .required = VSHI_ALL, .count = 2, .lowest = 1e-12, .highest = 1e12),
    VSHI_KEY("center", VECTOR, AT(center), .count = 3, VSHI_ANY),
    VSHI_KEY("normal", VECTOR, AT(normal), .count = 3, .flags = VSHI_NONZERO, VSHI_ANY),
};
static const vshi_table plane_table = VSHI_TABLE(plane_keys);
#undef AT

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

/* Reads the plane after the other keys, as it stands before the transform. */
static vsh_result read_plane(vshi_json *reader, const vshi_value *value, vsh_receiver *receiver) {
    plane p = {.normal = {0.0, 1.0, 0.0}};
    VSHI_TRY(vshi_read_object(reader, value, &plane_table, 1, "a plane", &p));
    memcpy(receiver->extent, p.size, sizeof p.size);
    stand(&p, receiver->transform);
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
                         .otherwise = "the second where there is one, else the first")),
    VSHI_KEY("objects", CUSTOM, AT(objects), .variants = MESH, .read = vshi_read_only),
    VSHI_KEY("except", CUSTOM, AT(objects), .variants = MESH, .read = vshi_read_except),
    VSHI_KEY("allow_overlap", BOOL, AT(allow_overlap), .variants = MESH,
             VSHI_OPTION(
                 "allow-overlap", NULL, FILE_ONLY,
                 "bake objects that lie over each other in the lightmap, too: the first keeps the texels")),
    VSHI_KEY("unwrap", NAME, AT(unwrap), .variants = MESH, .names = VSH_NAMES_RECEIVER_UNWRAP,
             VSHI_OPTION("unwrap", "MODE", TEXELS,
                         "make lightmap UVs: always, or (auto) where the file's own cannot be baked",
                         .otherwise = "auto for .glb and .gltf, never for images")),
    VSHI_KEY("texels_per_unit", NUMBER, AT(texels_per_unit), .variants = MESH, VSHI_POSITIVE,
             VSHI_OPTION("texels-per-unit", "N", TEXELS,
                         "density of UVs that are made, texels along a scene unit",
                         .otherwise = "the most that fit")),
    VSHI_KEY(
        "pages", INTEGER, AT(pages), .variants = MESH, .lowest = 1.0, .highest = VSH_MAX_PAGES,
        VSHI_OPTION("pages", "N", TEXELS,
                    "images of --size that may be filled with UVs that are made: OUT.0.exr, OUT.1.exr, …",
                    .otherwise = "1; with --texels-per-unit as many as it takes")),
    VSHI_KEY("density", CUSTOM, .variants = MESH, .read = read_density),
    VSHI_KEY("atlas", NAME, AT(atlas), .variants = MESH, .names = VSH_NAMES_ATLAS,
             VSHI_OPTION("atlas", "WHAT", FILE_ONLY,
                         "objects: an image for each object, OUT.NAME.exr, whose UVs, where they are made, "
                         "are packed alone; shared: all lie on the same")),
    VSHI_KEY("max_size", INTEGER, AT(max_size), .variants = MESH, .lowest = 1.0,
             .highest = VSH_MAX_LIGHTMAP_SIZE,
             VSHI_OPTION("max-size", "N", FILE_ONLY,
                         "with --texels-per-unit, instead of --size: images are as small as what lies on "
                         "them allows, their sides powers of two up to N",
                         .otherwise = "--size is that of all")),
    VSHI_KEY("size", CUSTOM, .read = read_size,
             VSHI_OPTION("size", "W[xH]", IMAGE, "texels of the lightmap",
                         .range = "W or WxH, each from 1 to 65536 texels", .otherwise = "1024", .by = true)),
    VSHI_KEY("supersample", INTEGER, AT(supersample), .lowest = 1.0, .highest = 16.0,
             VSHI_OPTION("supersample", "N", TEXELS, "N × N samples a texel")),
    VSHI_KEY(
        "padding", CUSTOM, AT(padding), .read = read_padding,
        VSHI_OPTION(
            "padding", "N", TEXELS,
            "texels that charts are grown by; auto: all is filled, so that no mip level reads background",
            .range = "a whole number from 0 to 4096, or auto", .otherwise = "4")),
    VSHI_KEY("seams", NAME, AT(seams), .variants = MESH, .names = VSH_NAMES_SEAMS,
             VSHI_OPTION("seams", "WHAT", TEXELS,
                         "fix: values on both sides of a chart's border are made to agree where the surface "
                         "is smooth, moved by up to --max-error",
                         .otherwise = "fix for .glb and .gltf, keep for images")),
    VSHI_KEY("ao_spacing", INTEGER, AT(ao_spacing), .lowest = 1.0, .highest = 8.0,
             VSHI_OPTION("ao-spacing", "N", FILE_ONLY,
                         "texels: AO by cones or adaptive is interpolated between texels so far apart where "
                         "casters are far; texels share the rays of exact AO; 1: neither",
                         .range = "1, 2, 4 or 8")),
    VSHI_KEY("output", PATH, AT(output), .required = VSHI_ALL),
    VSHI_KEY("bits", CUSTOM, AT(bits), .read = vshi_read_bits,
             VSHI_OPTION("bits", "N", IMAGE, "bits a channel", .range = "8, 16 or 32",
                         .otherwise = "32 for EXR, else 16 where the format has it, else 8")),
    VSHI_KEY("pack", STRING, AT(pack),
             VSHI_OPTION("pack", "R=NAME,…", IMAGE,
                         "what goes where in formats that cannot name channels: R=shadow.sun,G=ao,A=A; 0 and "
                         "1 are constants; rgb: the irradiance, or shadow * ao in grey",
                         .otherwise = "irradiance or the first three but A to R, G, B; A to A; EXR: all by "
                                      "name and the picture; channels: without the picture")),
    VSHI_KEY("color_space", NAME, AT(color_space), .name_of = vshi_color_space_key,
             VSHI_OPTION("color-space", "SPACE", FILE_ONLY, "of R, G, B in 8 and 16 bits",
                         .otherwise = "auto: srgb for irradiance and tints, linear for the rest")),
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
    return receiver->type == VSH_RECEIVER_PLANE ? read_plane(reader, &given, receiver) : VSH_OK;
}
