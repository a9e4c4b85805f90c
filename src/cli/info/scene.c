#include "cli/message.h"
#include "info.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <vdbshade/flat.h>
#include <vdbshade/scene.h>

static void print_caster(const vsh_caster *caster, size_t index) {
    static const char *const types[] = {"mesh", "sdf", "vdb", "heightfield", "spheres", "mask", "text"};
    printf("caster %zu: %s", index, types[caster->type]);
    if (caster->type == VSH_CASTER_SDF) {
        double min[3], max[3];
        vsh_sdf_bounds(&caster->sdf, min, max);
        printf(", %zu nodes, bounds %g %g %g to %g %g %g", caster->sdf.node_count, min[0], min[1], min[2],
               max[0], max[1], max[2]);
    } else if (caster->path == NULL) {
        printf(", %zu", caster->sphere_count);
    } else {
        printf(" %s", caster->path);
        if (caster->grid != NULL) {
            printf(", grid '%s'", caster->grid);
        }
        if (caster->type == VSH_CASTER_TEXT) {
            printf(", %zu bytes of text", strlen(caster->text));
        }
        if (caster->type == VSH_CASTER_HEIGHTFIELD) {
            printf(", %g × %g, height %g%s", caster->size[0], caster->size[1], caster->height,
                   caster->direct ? ", direct" : "");
        }
    }
    if (caster->type == VSH_CASTER_SPHERES && caster->voxelised) {
        printf(", voxelised");
    }
    if (caster->layer != NULL) {
        printf(", layer '%s'", caster->layer);
    }
    putchar('\n');
}

static void print_light(const vsh_light *light) {
    char text[512];
    vsh_light_text(light, text, sizeof text);
    printf("light '%s': %s\n", light->name, text);
}

static void print_layer(const vsh_scene_layer *layer) {
    const vsh_layer *shade = &layer->shade;
    printf("layer '%s': combine %s", layer->name, vsh_get_name(VSH_NAMES_COMBINE, shade->combine));
    if (layer->voxel_size > 0.0) {
        printf(", voxel size %g", layer->voxel_size);
    } else if (layer->resolution > 0) {
        printf(", resolution %d", layer->resolution);
    }
    if (shade->method >= 0) {
        printf(", method %s", vsh_get_name(VSH_NAMES_SHADOW, shade->method));
    }
    if (shade->softness != 1.0) {
        printf(", softness %g", shade->softness);
    }
    if (shade->remap[1] > 0.0) {
        printf(", remap %g to %g", shade->remap[0], shade->remap[1]);
    }
    printf("%s\n", shade->ao ? "" : ", no ao");
}

/* False where the file is no flat scene. */
static bool print_flat(const char *path, const vsh_run *run) {
    static const char *const casters[] = {"mask", "text", "circle", "box", "polygon"};
    vsh_flat_scene *scene = NULL;
    vsh_error error;
    if (vsh_flat_scene_read(path, run, &scene, &error) != VSH_OK) {
        return false;
    }
    const vsh_flat_options *o = &scene->options;
    printf("flat scene: %g %g to %g %g, %d × %d, method %s\n", o->region_min[0], o->region_min[1],
           o->region_max[0], o->region_max[1], o->width, o->height, vsh_get_name(VSH_NAMES_FLAT, o->method));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const char *file = scene->casters[i].path;
        printf("caster %zu: %s%s%s\n", i, casters[scene->casters[i].type], file != NULL ? " " : "",
               file != NULL ? file : "");
    }
    for (size_t i = 0; i < scene->light_count; ++i) {
        printf("light '%s': %s\n", scene->lights[i].name,
               vsh_get_name(VSH_NAMES_FLAT_LIGHT, scene->lights[i].type));
    }
    vsh_flat_scene_free(scene);
    return true;
}

int cli_info_scene(const char *path, const vsh_run *run) {
    vsh_scene *scene = NULL;
    vsh_error error;
    if (vsh_scene_read(path, run, &scene, &error) != VSH_OK) {
        return error.code == VSH_ERROR_INPUT && print_flat(path, run) ? CLI_OK : cli_fail(&error);
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        print_caster(&scene->casters[i], i);
    }
    for (size_t i = 0; i < scene->layer_count; ++i) {
        print_layer(&scene->layers[i]);
    }
    for (size_t i = 0; i < scene->light_count; ++i) {
        print_light(&scene->lights[i]);
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        printf("receiver %zu: %s to %s, %d × %d\n", i, receiver->path, receiver->output, receiver->width,
               receiver->height);
    }
    if (scene->grid.voxel_size > 0.0) {
        printf("voxel size: %g\n", scene->grid.voxel_size);
    } else {
        printf("resolution: %d\n", scene->grid.resolution);
    }
    printf("method: %s\n", vsh_get_name(VSH_NAMES_SHADOW, scene->shade.method));
    if (scene->ao) {
        printf("ao: %s, within %g\n", vsh_get_name(VSH_NAMES_AO, scene->shade.ao_method),
               scene->shade.ao_distance);
    }
    vsh_scene_free(scene);
    return CLI_OK;
}
