/* Flat scenes: their file, and the outline of their casters. */
#include "flat/flat.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "scene/scene.h"
#include "shapes/outline.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/image.h>
#include <vdbshade/picture.h>

enum {
    MAX_ITEMS = 65536,
    MAX_LIGHTS = VSH_MAX_CHANNELS - 4 /* A and three of irradiance must fit into the image too */
};

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
    VSHI_KEY("casters", LIST, AT(casters), .highest = MAX_ITEMS, .read = vshi_read_flat_caster,
             .count = sizeof(vsh_flat_caster)),
    VSHI_KEY("lights", LIST, AT(lights), .required = VSHI_ALL, .lowest = 1.0, .highest = MAX_LIGHTS,
             .read = vshi_read_flat_light, .count = sizeof(vsh_light)),
    VSHI_KEY("region", CUSTOM, .required = VSHI_ALL, .read = read_region),
    VSHI_KEY("size", CUSTOM, AT(options.width), .read = vshi_read_size,
             VSHI_OPTION("size", "W[xH]", FLAT_IMAGE, "texels of the map",
                         .range = "W or WxH, each from 1 to 65536 texels", .otherwise = "512", .by = true)),
    VSHI_KEY("supersample", INTEGER, AT(options.supersample), .lowest = 1.0, .highest = 16.0,
             VSHI_OPTION("supersample", "N", FLAT_TEXELS, "N × N samples a texel")),
    VSHI_KEY("padding", INTEGER, AT(options.padding), .highest = 4096.0,
             VSHI_OPTION("padding", "N", FLAT_TEXELS, "texels by which values grow into solids")),
    VSHI_KEY("output", PATH, AT(output)),
    VSHI_KEY("bits", CUSTOM, AT(bits), .read = vshi_read_bits,
             VSHI_OPTION("bits", "N", FLAT_IMAGE, "bits a channel", .range = "8, 16 or 32",
                         .otherwise = "32 for EXR, else 16 if the format has it, else 8")),
    VSHI_KEY("pack", STRING, AT(pack),
             VSHI_OPTION("pack", "R=NAME,…", FLAT_IMAGE, "channels of formats without names",
                         .otherwise = "irradiance.R, .G and .B to R, G, B; A to A")),
    VSHI_KEY("color_space", NAME, AT(color_space), .name_of = vshi_color_space_key,
             VSHI_OPTION("color-space", "SPACE", FLAT_IMAGE, "of R, G, B in 8 and 16 bits",
                         .otherwise = "auto: srgb for irradiance, linear for shadows")),
};
const vshi_table vshi_flat_table = VSHI_TABLE(scene_keys);
_Static_assert(offsetof(vsh_flat_scene, caster_count) == offsetof(vsh_flat_scene, casters) + sizeof(void *) &&
                   offsetof(vsh_flat_scene, light_count) ==
                       offsetof(vsh_flat_scene, lights) + sizeof(void *) &&
                   offsetof(vsh_flat_options, height) == offsetof(vsh_flat_options, width) + sizeof(int32_t),
               "lists are as vshi_list, a size is two integers in a row");

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
    return vshi_member(root, "lights", &lights)
               ? vshi_check_light_names(reader, &lights, scene->lights, scene->light_count)
               : VSH_OK;
}

vsh_result vsh_flat_scene_read(const char *path, const vsh_run *run, vsh_flat_scene **scene,
                               vsh_error *error) {
    VSHI_NEEDS(scene);
    void *made;
    const vsh_result result = vshi_scene_file_read(path, run, sizeof **scene, read_scene, &made, error);
    *scene = made;
    return result;
}

void vsh_flat_scene_free(vsh_flat_scene *scene) {
    vshi_json_free(scene);
}

/* --- the outline of its casters */

static vsh_result make_caster(const vsh_flat_caster *caster, const vsh_run *run, vsh_outline **outline,
                              vsh_error *error) {
    const double x = caster->half_size[0], y = caster->half_size[1];
    const double corners[8] = {-x, -y, x, -y, x, y, -x, y};
    const size_t four = 4;
    switch (caster->type) {
    case VSH_FLAT_MASK:
        return vshi_outline_from_image(caster->path, &caster->mask, run, outline, error);
    case VSH_FLAT_TEXT:
        return vshi_outline_from_text(caster->text, caster->path, &caster->letters, run, outline, error);
    case VSH_FLAT_BOX:
        return vsh_outline_from_polygons(corners, &four, 1, run, outline, error);
    default:
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "type %d: expected 0 … %d", caster->type, VSH_FLAT_BOX);
    }
}

/* Memory that a caster takes in the scene, its file's text and the outlines, measured with 60,000 casters. */
enum { BYTES_PER_CASTER = 1536 };

vsh_result vshi_flat_scene_casters(const vsh_flat_scene *scene, const vsh_run *run, vsh_outline **outline,
                                   vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(outline);
    VSHI_NEEDS(scene);
    const size_t count = scene->caster_count;
    vsh_outline **made = NULL;
    vshi_outline_instance *instances = NULL;
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
            vshi_outline_info info;
            vshi_outline_get_info(made[i], &info);
            held.memory_held += info.bytes;
            result = vshi_check_limit(&held, 0.0, "outlines", &reason);
        }
        if (result != VSH_OK) {
            vshi_fail(error, result, "casters[%zu]: %.960s", i, reason.message);
            goto done;
        }
        instances[i] = (vshi_outline_instance){made[i], scene->casters[i].transform};
    }
    if (count > 0) {
        result = vshi_outline_unite(instances, count, &held, outline, error);
    }
done:
    for (size_t i = 0; made != NULL && i < count; ++i) {
        vsh_outline_free(made[i]);
    }
    free(instances);
    free(made);
    return result;
}

vsh_result vsh_flat_bake(const vsh_flat_scene *scene, const vsh_run *run, const vsh_flat_map *map,
                         vsh_error *error) {
    vsh_outline *casters;
    VSHI_TRY(vshi_flat_scene_casters(scene, run, &casters, error));
    const vsh_result result =
        vshi_flat_bake(casters, scene->lights, scene->light_count, &scene->options, run, map, error);
    vsh_outline_free(casters);
    return result;
}
