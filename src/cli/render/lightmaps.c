/* Lightmaps that are shown on their receivers. */
#include "cli/message.h"
#include "render.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Names the channels R, G, B, A (Y: R) as a pack says: "R=shadow.sun,G=ao". */
static int unpack(const char *pack, const char *path, render_lightmap *map) {
    const char *names[VSH_MAX_CHANNELS];
    const float *planes[VSH_MAX_CHANNELS];
    vsh_image read = map->image;
    memcpy(names, read.names, (size_t)read.channel_count * sizeof *names);
    memcpy(planes, read.planes, (size_t)read.channel_count * sizeof *planes);
    read.names = names;
    read.planes = planes;
    if (strlen(pack) >= sizeof map->text) {
        return cli_usage("--lightmap-pack '%s': is too long", pack);
    }
    strcpy(map->text, pack);
    map->image = (vsh_image){read.width, read.height, 0, map->names, map->planes, NULL};
    for (char *save = NULL, *item = strtok_r(map->text, ",", &save); item != NULL;
         item = strtok_r(NULL, ",", &save)) {
        char *name = strchr(item, '=');
        if (name == NULL || name - item != 1 || name[1] == '\0' || strchr("RGBA", item[0]) == NULL) {
            return cli_usage("--lightmap-pack '%s': expected R=CHANNEL,G=CHANNEL and so on", pack);
        }
        const float *plane = NULL;
        for (int32_t i = 0; i < read.channel_count; ++i) {
            const char *own = read.names[i];
            plane = own[1] == '\0' && (own[0] == item[0] || (own[0] == 'Y' && item[0] == 'R'))
                        ? read.planes[i]
                        : plane;
        }
        if (plane == NULL) {
            return cli_usage("%s: no channel %c, which --lightmap-pack names", path, item[0]);
        }
        const int32_t at = map->image.channel_count;
        if (at == VSH_MAX_CHANNELS) {
            return cli_usage("--lightmap-pack '%s': more than %d channels", pack, VSH_MAX_CHANNELS);
        }
        map->names[at] = name + 1;
        map->planes[at] = plane;
        ++map->image.channel_count;
    }
    return CLI_OK;
}

static bool says_srgb(const vsh_image_file *file) {
    size_t count = 0;
    const vsh_attribute *attributes = vsh_image_attributes(file, &count);
    bool says = false;
    for (size_t i = 0; i < count && !says; ++i) {
        says = strcmp(attributes[i].name, "vdbshade_color_space") == 0 &&
               strcmp(attributes[i].value, "sRGB") == 0;
    }
    return says;
}

/* Takes the curve off what a PNG of ours says is sRGB: R, G and B. The image is then one of map->planes. */
static int decode(render_lightmap *map) {
    const vsh_image read = map->image;
    const size_t texels = (size_t)read.width * (size_t)read.height;
    map->linear = malloc(3 * texels * sizeof *map->linear);
    if (map->linear == NULL) {
        return cli_out_of_memory("lightmaps");
    }
    map->image.names = map->names;
    map->image.planes = map->planes;
    for (int32_t c = 0; c < read.channel_count; ++c) {
        static const char rgb[] = "RGB";
        const char *name = read.names[c], *at = name[1] == '\0' ? strchr(rgb, name[0]) : NULL;
        float *plane = at != NULL ? map->linear + (size_t)(at - rgb) * texels : NULL;
        map->names[c] = name;
        map->planes[c] = plane != NULL ? plane : read.planes[c];
        for (size_t i = 0; plane != NULL && i < texels; ++i) {
            plane[i] = (float)vsh_srgb_to_linear((double)read.planes[c][i]);
        }
    }
    return CLI_OK;
}

/* That of a caster of the same file. */
static void color_of(const vsh_scene *scene, const char *path, double color[3]) {
    const vsh_caster *same = NULL;
    for (size_t i = 0; same == NULL && i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        same = caster->path != NULL && strcmp(caster->path, path) == 0 ? caster : NULL;
    }
    render_color_of(same, color);
}

int render_lightmaps_read(const render_settings *s, const vsh_scene *scene, const vsh_assets *assets,
                          const vsh_run *run, render_lightmaps *lightmaps) {
    *lightmaps = (render_lightmaps){.count = s->lightmap_count};
    if (s->lightmap_count > scene->receiver_count) {
        return cli_usage("--lightmap '%s': %s has %zu receivers", s->lightmaps[scene->receiver_count],
                         s->bake.input, scene->receiver_count);
    }
    if (s->lightmap_count == 0) {
        return CLI_OK;
    }
    lightmaps->maps = calloc(s->lightmap_count, sizeof *lightmaps->maps);
    lightmaps->lit = calloc(s->lightmap_count, sizeof *lightmaps->lit);
    if (lightmaps->maps == NULL || lightmaps->lit == NULL) {
        return cli_out_of_memory("lightmaps");
    }
    for (size_t i = 0; i < s->lightmap_count; ++i) {
        render_lightmap *map = &lightmaps->maps[i];
        vsh_lit_meshes *lit = &lightmaps->lit[i];
        vsh_error error;
        if (vsh_image_read(s->lightmaps[i], run, &map->file, &error) != VSH_OK) {
            return cli_fail(&error);
        }
        map->image = vsh_image_view(map->file);
        int code = says_srgb(map->file) ? decode(map) : CLI_OK;
        code = code == CLI_OK && s->pack != NULL ? unpack(s->pack, s->lightmaps[i], map) : code;
        if (code != CLI_OK) {
            return code;
        }
        lit->meshes = vsh_assets_receiver(assets, i, &lit->mesh_count);
        lit->lightmap = &map->image;
        lit->ambient = scene->has_ambient;
        color_of(scene, scene->receivers[i].path, lit->color);
    }
    return CLI_OK;
}

void render_lightmaps_free(render_lightmaps *lightmaps) {
    for (size_t i = 0; lightmaps->maps != NULL && i < lightmaps->count; ++i) {
        free(lightmaps->maps[i].linear);
        vsh_image_free(lightmaps->maps[i].file);
    }
    free(lightmaps->lit);
    free(lightmaps->maps);
}
