/* The lights that a scene file lists: its own, and those that files have which it names. */
#include "base/try.h"
#include "scene/parts.h"

#include <vdbshade/image.h>

#include <string.h>

enum { MAX_LIGHTS = VSH_MAX_CHANNELS - 5 /* ao, A and three of irradiance must fit into the image too */ };

/* An item of the list. */
typedef struct item {
    vsh_light light;
    vsh_light_file file; /* path NULL: a light */
} item;

static const vshi_key file_keys[] = {
    {.name = "type", .kind = VSHI_LATER, .required = VSHI_ALL},
    {.name = "file", .kind = VSHI_PATH, .required = VSHI_ALL, .offset = offsetof(vsh_light_file, path)},
    {.name = "angle_deg",
     .kind = VSHI_DEGREES,
     .offset = offsetof(vsh_light_file, angle),
     .highest = 180.0,
     .flags = VSHI_BELOW},
    {.name = "radius",
     .kind = VSHI_NUMBER,
     .offset = offsetof(vsh_light_file, radius),
     .highest = VSHI_LARGEST},
    {.name = "layers", .kind = VSHI_LATER},
};
static const vshi_table file_table = VSHI_TABLE(file_keys);

static vsh_result read_item(vshi_json *reader, const vshi_value *value, void *member) {
    item *one = member;
    VSHI_TRY(vshi_expect(reader, value, JSON_OBJECT));
    const char *type = json_string_value(json_object_get(value->json, "type"));
    if (type == NULL || strcmp(type, "file") != 0) {
        return vshi_read_light(reader, value, &one->light);
    }
    one->file.angle = vsh_light_default().angle;
    return vshi_read_object(reader, value, &file_table, VSHI_ALL, "a file of lights", &one->file);
}

/* The lights of one file: *lights, to be freed. */
static vsh_result read_file(vshi_json *reader, const vshi_value *value, const vsh_run *run, double unit,
                            vsh_light_file *file, vsh_light **lights) {
    vshi_value path;
    VSHI_TRY(vsh_lights_read(file->path, file->angle, file->radius, unit, run, lights, &file->count,
                             reader->error));
    return file->count > 0 || !vshi_member(value, "file", &path)
               ? VSH_OK
               : vshi_json_fail(reader, &path, "%.200s has no lights; those of a glTF or GLB are read",
                                file->path);
}

/* Puts the lights of an item behind those that the scene has. */
static vsh_result append(vshi_json *reader, const vshi_value *value, const vsh_light *lights, size_t count,
                         vsh_light *all, vsh_scene *scene) {
    if (count > MAX_LIGHTS - scene->light_count) {
        return vshi_json_fail(reader, value, "are %zu lights, which with those before are over %d", count,
                              MAX_LIGHTS);
    }
    if (count > 0) {
        memcpy(all + scene->light_count, lights, count * sizeof *all);
    }
    scene->light_count += count;
    return VSH_OK;
}

static vsh_result append_file(vshi_json *reader, const vshi_value *value, const vsh_run *run,
                              vsh_light_file *file, vsh_light *all, vsh_scene *scene) {
    vsh_light *lights = NULL;
    vsh_result result = VSH_OK;
    if (run != NULL) {
        VSHI_TRY_DONE(read_file(reader, value, run, scene->unit, file, &lights));
        VSHI_TRY_DONE(append(reader, value, lights, file->count, all, scene));
    }
done:
    vsh_lights_free(lights);
    return result;
}

/* Which item of the list a light is of. */
static size_t item_of(const vsh_scene *scene, size_t light) {
    size_t place = light;
    for (size_t i = 0; i < scene->light_file_count && light >= scene->light_files[i].first; ++i) {
        const vsh_light_file *file = &scene->light_files[i];
        if (light < file->first + file->count) {
            return place - (light - file->first);
        }
        place = place + 1 - file->count;
    }
    return place;
}

vshi_value vshi_light_item(const vshi_value *list, const vsh_scene *scene, size_t light) {
    return vshi_item(list, item_of(scene, light));
}

static vsh_result check_names(vshi_json *reader, const vshi_value *list, const vsh_scene *scene) {
    if (scene->light_file_count == 0) {
        return vshi_check_light_names(reader, list, scene->lights, scene->light_count);
    }
    for (size_t i = 0; i < scene->light_count; ++i) {
        for (size_t k = 0; k < i; ++k) {
            if (strcmp(scene->lights[i].name, scene->lights[k].name) == 0) {
                const vshi_value value = vshi_light_item(list, scene, i);
                return vshi_json_fail(reader, &value, "has a light \"%s\", as lights[%zu] has",
                                      scene->lights[i].name, item_of(scene, k));
            }
        }
    }
    return VSH_OK;
}

vsh_result vshi_read_lights(vshi_json *reader, const vshi_value *list, const vsh_run *run, vsh_scene *scene) {
    item *items = NULL;
    size_t count;
    vsh_light *lights = NULL;
    vsh_light_file *files = NULL;
    void *memory;
    VSHI_TRY(vshi_read_list(reader, list, 0, MAX_LIGHTS, sizeof *items, read_item, &memory, &count));
    items = memory;
    VSHI_TRY(vshi_json_allocate(reader, (void **)&files, count, sizeof *files, "files of lights"));
    VSHI_TRY(vshi_json_allocate(reader, (void **)&lights, MAX_LIGHTS, sizeof *lights, "lights"));
    scene->lights = lights;
    scene->light_files = files;
    for (size_t i = 0; i < count; ++i) {
        const vshi_value value = vshi_item(list, i);
        if (items[i].file.path == NULL) {
            VSHI_TRY(append(reader, &value, &items[i].light, 1, lights, scene));
            continue;
        }
        vsh_light_file *file = &files[scene->light_file_count];
        *file = items[i].file;
        file->first = scene->light_count;
        VSHI_TRY(append_file(reader, &value, run, file, lights, scene));
        ++scene->light_file_count;
    }
    return check_names(reader, list, scene);
}
