/* Flat scenes: their file, and the outline of their casters. */
#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/image.h>

enum {
    MAX_ITEMS = 65536,
    MAX_LIGHTS = VSH_MAX_CHANNELS - 4, /* A and three of irradiance must fit into the image too */
    CIRCLE_SIDES = 256
};

/* --- casters in files */

enum {
    MASK = 1 << VSH_FLAT_MASK,
    TEXT = 1 << VSH_FLAT_TEXT,
    CIRCLE = 1 << VSH_FLAT_CIRCLE,
    BOX = 1 << VSH_FLAT_BOX,
    POLYGON = 1 << VSH_FLAT_POLYGON
};

static const char *const whats[] = {"a mask", "a text", "a circle", "a box", "a polygon"};
static const size_t MAX_POINTS = (size_t)1 << 20;

/* Names of the shapes, from VSH_FLAT_CIRCLE on. */
static const char *shape_name(int32_t i) {
    static const char *const names[] = {"circle", "box", "polygon", NULL};
    return names[i];
}

vsh_result vshi_read_mask_size(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_mask_options *mask = member;
    const vshi_key key = {.kind = json_is_array(value->json) ? VSHI_VECTOR : VSHI_NUMBER,
                          .count = 2,
                          .highest = VSHI_LARGEST,
                          .flags = VSHI_ABOVE};
    double size[2] = {0.0, 0.0}; /* a height of 0: by the image's proportions */
    const vsh_result result = vshi_read_value(reader, value, &key, size);
    mask->width = size[0];
    mask->height = size[1];
    return result;
}

static vsh_result read_points(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_caster *caster = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_ARRAY));
    const size_t count = json_array_size(value->json);
    if (count < 3 || count > MAX_POINTS) {
        return vshi_json_fail(reader, value, "has %zu points, out of range 3 … %zu", count, MAX_POINTS);
    }
    VSHI_TRY(vshi_read_rows(reader, value, 2, "points", &caster->points));
    caster->point_count = count;
    return VSH_OK;
}

/* A caster, and the numbers that make its transform. */
typedef struct placed {
    vsh_flat_caster caster; /* first: its keys' offsets are those of the whole */
    double translate[2];
    double rotate;
    double scale;
} placed;

#define AT(member) .offset = offsetof(placed, member)
static const vshi_key caster_keys[] = {
    VSHI_OUTLINE_KEYS(vsh_flat_caster, MASK, TEXT),
    VSHI_KEY("shape", LATER, .variants = CIRCLE | BOX | POLYGON),
    VSHI_KEY("radius", NUMBER, AT(caster.radius), VSHI_NEEDED_BY(CIRCLE), VSHI_POSITIVE),
    VSHI_KEY("half_size", VECTOR, AT(caster.half_size), VSHI_NEEDED_BY(BOX), .count = 2, VSHI_POSITIVE),
    VSHI_KEY("points", CUSTOM, VSHI_NEEDED_BY(POLYGON), .read = read_points),
    VSHI_KEY("translate", VECTOR, AT(translate), .count = 2, VSHI_ANY),
    VSHI_KEY("rotate_deg", NUMBER, AT(rotate), .lowest = -1e6, .highest = 1e6),
    VSHI_KEY("scale", NUMBER, AT(scale), .lowest = 1e-6, .highest = 1e6),
};
static const vshi_table caster_table = VSHI_TABLE(caster_keys);
#undef AT

static void compose(const placed *p, double m[6]) {
    const double angle = remainder(p->rotate, 360.0) / 180.0 * VSHI_PI;
    const double c = p->scale * vshi_cos(angle), s = p->scale * vshi_sin(angle);
    const double transform[6] = {c, -s, p->translate[0], s, c, p->translate[1]};
    memcpy(m, transform, sizeof transform);
}

static vsh_result read_caster(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_caster *caster = member;
    placed p = {.scale = 1.0};
    p.caster.mask = vsh_mask_options_default();
    p.caster.letters = vsh_text_options_default();
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    static const char *const kinds[] = {"mask", "text", "shape"};
    int32_t type;
    VSHI_TRY(vshi_read_type(reader, value, kinds, 3, &type));
    if (type == 2) {
        int32_t shape = 0;
        VSHI_TRY(
            vshi_read_choice(reader, value, &(vshi_key){.name = "shape", .name_of = shape_name}, &shape));
        type = VSH_FLAT_CIRCLE + shape;
    }
    /* A caster of no type still has its keys looked over: the type's name may be what is misspelt. */
    p.caster.type = type;
    VSHI_TRY(vshi_read_object(reader, value, &caster_table, type < 0 ? VSHI_ALL : 1U << type,
                              type < 0 ? "a caster" : whats[type], &p));
    if (type < 0) {
        return vshi_json_fail(reader, value, "key \"mask\", \"text\" or \"shape\" is missing");
    }
    compose(&p, p.caster.transform);
    *caster = p.caster;
    return VSH_OK;
}

/* --- the scene */

static vsh_result read_size(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_scene *scene = member;
    return vshi_read_size(reader, value, &scene->options.width, &scene->options.height);
}

/* [x0, y0, x1, y1] */
static vsh_result read_region(vshi_json *reader, const vshi_value *value, void *member) {
    static const vshi_key key = {
        .kind = VSHI_VECTOR, .count = 4, .lowest = -VSHI_LARGEST, .highest = VSHI_LARGEST};
    vsh_flat_scene *scene = member;
    double r[4];
    VSHI_TRY(vshi_read_value(reader, value, &key, r));
    if (!(r[0] < r[2] && r[1] < r[3])) {
        return vshi_json_fail(reader, value, "is empty: expected [left, bottom, right, top]");
    }
    for (int axis = 0; axis < 2; ++axis) {
        scene->options.region_min[axis] = r[axis];
        scene->options.region_max[axis] = r[axis + 2];
    }
    return VSH_OK;
}

#define AT(member) .offset = offsetof(vsh_flat_scene, member)
static const vshi_key scene_keys[] = {
    VSHI_KEY("casters", LIST, AT(casters), .highest = MAX_ITEMS, .read = read_caster,
             .count = sizeof(vsh_flat_caster)),
    VSHI_KEY("lights", LIST, AT(lights), .required = VSHI_ALL, .lowest = 1.0, .highest = MAX_LIGHTS,
             .read = vshi_read_flat_light, .count = sizeof(vsh_light)),
    VSHI_KEY("region", CUSTOM, .required = VSHI_ALL, .read = read_region),
    VSHI_KEY("size", CUSTOM, .read = read_size,
             VSHI_OPTION("size", "W[xH]", FLAT_IMAGE, "texels of the map",
                         .range = "W or WxH, each from 1 to 65536 texels", .otherwise = "512", .by = true)),
    VSHI_KEY("method", NAME, AT(options.method), .names = VSH_NAMES_FLAT,
             VSHI_OPTION("method", "NAME", FLAT_TEXELS,
                         "of the shadow; classic has the outer half of the penumbra only, hard none")),
    VSHI_KEY("supersample", INTEGER, AT(options.supersample), .lowest = 1.0, .highest = 16.0,
             VSHI_OPTION("supersample", "N", FLAT_TEXELS, "N × N samples a texel")),
    VSHI_KEY("padding", INTEGER, AT(options.padding), .highest = 4096.0,
             VSHI_OPTION("padding", "N", FLAT_TEXELS, "texels that values are grown by into solids")),
    VSHI_KEY("max_steps", INTEGER, AT(options.max_steps), .lowest = 16.0, .highest = 65536.0,
             VSHI_OPTION("max-steps", "N", FLAT_TEXELS,
                         "with classic: steps after which a ray takes what is known by then")),
    VSHI_KEY("output", PATH, AT(output)),
    VSHI_KEY("bits", CUSTOM, AT(bits), .read = vshi_read_bits,
             VSHI_OPTION("bits", "N", FLAT_IMAGE, "bits a channel", .range = "8, 16 or 32",
                         .otherwise = "32 for EXR, else 16 where the format has it, else 8")),
    VSHI_KEY("pack", STRING, AT(pack),
             VSHI_OPTION("pack", "R=NAME,…", FLAT_IMAGE,
                         "what goes where in formats that cannot name channels",
                         .otherwise = "irradiance.R, .G and .B to R, G, B; A to A")),
    VSHI_KEY("color_space", NAME, AT(color_space), .name_of = vshi_color_space_key,
             VSHI_OPTION("color-space", "SPACE", FLAT_IMAGE, "of R, G, B in 8 and 16 bits",
                         .otherwise = "auto: srgb for irradiance, linear for shadows")),
};
const vshi_table vshi_flat_table = VSHI_TABLE(scene_keys);
_Static_assert(offsetof(vsh_flat_scene, caster_count) == offsetof(vsh_flat_scene, casters) + sizeof(void *) &&
                   offsetof(vsh_flat_scene, light_count) == offsetof(vsh_flat_scene, lights) + sizeof(void *),
               "lists are as vshi_list");

static vsh_result read_scene(vshi_json *reader, const vshi_value *root, void *made) {
    vsh_flat_scene *scene = made;
    vshi_value region, lights;
    VSHI_TRY(vshi_expect(reader, root, JSON_OBJECT));
    if (!vshi_member(root, "region", &region)) {
        return vshi_json_fail(reader, root,
                              "key \"region\" is missing: a flat scene needs it; 'vdbshade bake' bakes "
                              "scenes with receivers");
    }
    *scene = vsh_flat_scene_default();
    VSHI_TRY(vshi_read_object(reader, root, &vshi_flat_table, 1, "a flat scene", scene));
    const vsh_scene lit = {.lights = scene->lights, .light_count = scene->light_count};
    return vshi_member(root, "lights", &lights) ? vshi_check_light_names(reader, &lights, &lit) : VSH_OK;
}

vsh_result vsh_flat_scene_read(const char *path, const vsh_run *run, vsh_flat_scene **scene,
                               vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(scene);
    *scene = NULL;
    VSHI_NEEDS(path);
    void *made;
    const vsh_result result = vshi_scene_file_read(path, run, sizeof **scene, read_scene, &made, error);
    *scene = made;
    return result;
}

void vsh_flat_scene_free(vsh_flat_scene *scene) {
    vshi_json_free(scene);
}

/* --- the outline of its casters */

/* As many-sided that it is off by 1e-4 of the radius at most, and of the circle's area. */
static vsh_result make_circle(double radius, const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    const double step = 2.0 * VSHI_PI / CIRCLE_SIDES, reach = radius * sqrt(step / vshi_sin(step));
    double points[2 * CIRCLE_SIDES];
    for (int i = 0; i < CIRCLE_SIDES; ++i) {
        points[2 * i] = reach * vshi_cos(step * i);
        points[2 * i + 1] = reach * vshi_sin(step * i);
    }
    const size_t count = CIRCLE_SIDES;
    return vsh_outline_from_polygons(points, &count, 1, run, outline, error);
}

static vsh_result make_caster(const vsh_flat_caster *caster, const vsh_run *run, vsh_outline **outline,
                              vsh_error *error) {
    const double x = caster->half_size[0], y = caster->half_size[1];
    const double corners[8] = {-x, -y, x, -y, x, y, -x, y};
    const size_t four = 4;
    switch (caster->type) {
    case VSH_FLAT_MASK:
        return vsh_outline_from_image(caster->path, &caster->mask, run, outline, error);
    case VSH_FLAT_TEXT:
        return vsh_outline_from_text(caster->text, caster->path, &caster->letters, run, outline, error);
    case VSH_FLAT_CIRCLE:
        return make_circle(caster->radius, run, outline, error);
    case VSH_FLAT_BOX:
        return vsh_outline_from_polygons(corners, &four, 1, run, outline, error);
    case VSH_FLAT_POLYGON:
        return vsh_outline_from_polygons(caster->points, &caster->point_count, 1, run, outline, error);
    default:
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "type %d: expected 0 … %d", caster->type,
                         VSH_FLAT_POLYGON);
    }
}

/* Of a scene and on the way from it, what is left of its text included: measured with 60,000 circles. */
enum { BYTES_PER_CASTER = 1536 };

vsh_result vsh_flat_scene_casters(const vsh_flat_scene *scene, const vsh_run *run, vsh_outline **outline,
                                  vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(outline);
    *outline = NULL;
    VSHI_NEEDS(scene);
    const size_t count = scene->caster_count;
    vsh_outline **made = NULL;
    vsh_outline_instance *instances = NULL;
    vsh_run held; /* by all that are made so far */
    vsh_result result;
    VSHI_TRY(vshi_run_resolve(run, &held, error));
    held.memory_held += count * BYTES_PER_CASTER;
    VSHI_TRY_DONE(vshi_allocate((void **)&made, count, sizeof *made, "casters", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&instances, count, sizeof *instances, "casters", error));
    for (size_t i = 0; i < count; ++i) {
        vsh_error reason;
        result = make_caster(&scene->casters[i], &held, &made[i], &reason);
        if (result == VSH_OK) {
            vsh_outline_info info;
            vsh_outline_get_info(made[i], &info);
            held.memory_held += info.bytes;
            result = vshi_check_limit(&held, 0.0, "outlines", &reason);
        }
        if (result != VSH_OK) {
            vshi_fail(error, result, "casters[%zu]: %.960s", i, reason.message);
            goto done;
        }
        instances[i] = (vsh_outline_instance){made[i], scene->casters[i].transform};
    }
    if (count > 0) {
        result = vsh_outline_unite(instances, count, &held, outline, error);
    }
done:
    for (size_t i = 0; made != NULL && i < count; ++i) {
        vsh_outline_free(made[i]);
    }
    free(instances);
    free(made);
    return result;
}
