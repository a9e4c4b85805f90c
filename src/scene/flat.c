/* Flat scenes: their file, and the outline of their casters. */
#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/threads.h"
#include "base/try.h"
#include "scene/parts.h"
#include "scene/scene.h"

#include <vdbshade/image.h>
#include <vdbshade/settings.h>

#include <math.h>
#include <stdlib.h>

enum {
    MAX_ITEMS = 65536,
    MAX_LIGHTS = VSH_MAX_CHANNELS - 4, /* A and three of irradiance must fit into the image too */
    CIRCLE_SIDES = 256
};

/* What vsh_flat_scene_free() gets is the first member. */
typedef struct owner {
    vsh_flat_scene scene;
    vshi_json_block *blocks;
} owner;

static vsh_result read_casters(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_scene *scene = member;
    void *items = NULL;
    const vsh_result result = vshi_read_list(reader, value, 0, MAX_ITEMS, sizeof *scene->casters,
                                             vshi_read_flat_caster, &items, &scene->caster_count);
    scene->casters = items;
    return result;
}

static vsh_result read_lights(vshi_json *reader, const vshi_value *value, void *member) {
    vsh_flat_scene *scene = member;
    void *items = NULL;
    VSHI_TRY(vshi_read_list(reader, value, 1, MAX_LIGHTS, sizeof *scene->lights, vshi_read_flat_light, &items,
                            &scene->light_count));
    scene->lights = items;
    return vshi_check_light_names(reader, value, scene->lights, scene->light_count);
}

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

static const vshi_key scene_keys[] = {
    {.name = "casters", .kind = VSHI_CUSTOM, .read = read_casters},
    {.name = "lights", .kind = VSHI_CUSTOM, .required = VSHI_ALL, .read = read_lights},
    {.name = "region", .kind = VSHI_CUSTOM, .required = VSHI_ALL, .read = read_region},
    {.name = "size",
     .kind = VSHI_CUSTOM,
     .read = read_size,
     .option = {.name = "size",
                .value = "W[xH]",
                .group = VSH_SETTINGS_FLAT_IMAGE,
                .help = "texels of the map",
                .range = "W or WxH, each from 1 to 65536 texels",
                .otherwise = "512",
                .by = true}},
    {.name = "method",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_flat_scene, options.method),
     .names = VSH_NAMES_FLAT,
     .option = {.name = "method",
                .value = "NAME",
                .group = VSH_SETTINGS_FLAT_TEXELS,
                .help = "of the shadow; classic has the outer half of the penumbra only, hard none"}},
    {.name = "supersample",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_flat_scene, options.supersample),
     .lowest = 1.0,
     .highest = 16.0,
     .option = {.name = "supersample",
                .value = "N",
                .group = VSH_SETTINGS_FLAT_TEXELS,
                .help = "N × N samples a texel"}},
    {.name = "padding",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_flat_scene, options.padding),
     .highest = 4096.0,
     .option = {.name = "padding",
                .value = "N",
                .group = VSH_SETTINGS_FLAT_TEXELS,
                .help = "texels that values are grown by into solids"}},
    {.name = "max_steps",
     .kind = VSHI_INTEGER,
     .offset = offsetof(vsh_flat_scene, options.max_steps),
     .lowest = 16.0,
     .highest = 65536.0,
     .option = {.name = "max-steps",
                .value = "N",
                .group = VSH_SETTINGS_FLAT_TEXELS,
                .help = "with classic: steps after which a ray takes what is known by then"}},
    {.name = "output", .kind = VSHI_PATH, .offset = offsetof(vsh_flat_scene, output)},
    {.name = "bits",
     .kind = VSHI_CUSTOM,
     .offset = offsetof(vsh_flat_scene, bits),
     .read = vshi_read_bits,
     .option = {.name = "bits",
                .value = "N",
                .group = VSH_SETTINGS_FLAT_IMAGE,
                .help = "bits a channel",
                .range = "8, 16 or 32",
                .otherwise = "32 for EXR, else 16 where the format has it, else 8"}},
    {.name = "pack",
     .kind = VSHI_STRING,
     .offset = offsetof(vsh_flat_scene, pack),
     .option = {.name = "pack",
                .value = "R=NAME,…",
                .group = VSH_SETTINGS_FLAT_IMAGE,
                .help = "what goes where in formats that cannot name channels",
                .otherwise = "irradiance.R, .G and .B to R, G, B; A to A"}},
    {.name = "color_space",
     .kind = VSHI_NAME,
     .offset = offsetof(vsh_flat_scene, color_space),
     .name_of = vshi_color_space_key,
     .option = {.name = "color-space",
                .value = "SPACE",
                .group = VSH_SETTINGS_FLAT_IMAGE,
                .help = "of R, G, B in 8 and 16 bits",
                .otherwise = "auto: srgb for irradiance, linear for shadows"}},
};
const vshi_table vshi_flat_table = VSHI_TABLE(scene_keys);

typedef struct parsing {
    vshi_json reader;
    owner *made;
} parsing;

static vsh_result parse(void *user, vsh_error *error) {
    (void)error; /* the reader holds it */
    vshi_json *reader = &((parsing *)user)->reader;
    owner *made = ((parsing *)user)->made;
    json_t *json = NULL;
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_json_load(reader, &json));
    const vshi_value root = {NULL, NULL, 0, 0, json};
    vshi_value region;
    VSHI_TRY_DONE(vshi_expect(reader, &root, JSON_OBJECT));
    if (!vshi_member(&root, "region", &region)) {
        result =
            vshi_json_fail(reader, &root,
                           "key \"region\" is missing: a flat scene needs it; 'vdbshade bake' bakes scenes "
                           "with receivers");
        goto done;
    }
    made->scene = vsh_flat_scene_default();
    VSHI_TRY_DONE(vshi_read_object(reader, &root, &vshi_flat_table, 1, "a flat scene", &made->scene));
done:
    made->blocks = reader->blocks;
    json_decref(json);
    return result;
}

vsh_result vsh_flat_scene_read(const char *path, const vsh_run *run, vsh_flat_scene **scene,
                               vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(scene);
    *scene = NULL;
    VSHI_NEEDS(path);
    char *text = NULL;
    size_t size;
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_scene_text(path, &full, &text, &size, error));
    owner *made = calloc(1, sizeof *made);
    parsing p = {{path, text, size, NULL, error}, made};
    const vsh_result result =
        made != NULL
            ? vshi_on_stack(parse, &p, error)
            : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", path, sizeof *made);
    free(text);
    if (result == VSH_OK) {
        *scene = &made->scene;
    } else if (made != NULL) {
        vsh_flat_scene_free(&made->scene);
    }
    return result;
}

void vsh_flat_scene_free(vsh_flat_scene *scene) {
    if (scene != NULL) {
        owner *made = (owner *)scene;
        vshi_blocks_free(made->blocks);
        free(made);
    }
}

/* --- casters */

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

/* The same, counted into what is held. */
static vsh_result make_held(const vsh_flat_caster *caster, vsh_run *held, vsh_outline **outline,
                            vsh_error *error) {
    VSHI_TRY(make_caster(caster, held, outline, error));
    vsh_outline_info info;
    vsh_outline_get_info(*outline, &info);
    held->memory_held += info.bytes;
    return vshi_check_limit(held, 0.0, "outlines", error);
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
        result = make_held(&scene->casters[i], &held, &made[i], &reason);
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
