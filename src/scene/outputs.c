/* A bake's lightmaps: their names, their channels, and the files that they are written to. */
#define _GNU_SOURCE /* asprintf */
#include "scene/bake_scene.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "io/lit/work.h"
#include "lightmap/planes.h"
#include "scene/assets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <vdbshade/scene.h>

enum {
    ROWS = 64,              /* written at a time */
    MOST_LIT_PAGES = 65534, /* the number of a material's page has 16 bits */
    NAME_BYTES = 120        /* of an object in file names, which have 255 with number and ending */
};

/* --- names */

/* Names a target's file: FILE.OBJECT.exr for an object, or FILE with its name for "%s"; FILE.PAGE.exr for one
 * of several pages; else FILE.exr. To be freed; NULL if out of memory. */
static char *name_file(const vshi_target *target, size_t pages, const char *file) {
    static const char PLACE[] = "%s";
    char number[24], *made;
    if (target->object == NULL && pages <= 1) {
        return strdup(file);
    }
    snprintf(number, sizeof number, "%zu", target->lightmap->page);
    const char *mark = target->object != NULL ? target->object : number;
    const char *name = vshi_path_name(file), *dot = strrchr(name, '.');
    const char *place = target->object != NULL ? strstr(name, PLACE) : NULL;
    const char *end = dot != NULL ? dot : file + strlen(file);
    const int length =
        place != NULL ? asprintf(&made, "%.*s%s%s", (int)(place - file), file, mark, place + strlen(PLACE))
                      : asprintf(&made, "%.*s.%s%s", (int)(end - file), file, mark, end);
    return length >= 0 ? made : NULL;
}

/* Replaces characters that Linux, Windows or macOS refuse in file names, and bytes that are not UTF-8. */
static void make_safe(const char *name, char safe[NAME_BYTES + 1]) {
    size_t length = 0;
    for (size_t whole = 0; name[length] != '\0' && length < NAME_BYTES; ++length) {
        const unsigned char c = (unsigned char)name[length];
        whole = whole > 0 ? whole : vshi_utf8_length(name + length);
        safe[length] =
            whole == 0 || c < 0x20 || c == 0x7f || strchr("/\\:*?\"<>|", c) != NULL ? '_' : name[length];
        whole -= whole > 0;
    }
    while (name[length] != '\0' && length > 0 && ((unsigned char)name[length] & 0xc0) == 0x80) {
        --length; /* do not cut a character in two */
    }
    for (size_t end = length; end > 0 && (safe[end - 1] == ' ' || safe[end - 1] == '.'); --end) {
        safe[end - 1] = '_';
    }
    if (length > 0 && (safe[0] == '.' || safe[0] == ' ')) {
        safe[0] = '_';
    }
    safe[length] = '\0';
}

/* Whether two lightmaps of one name would be one file: images of one output, or pages of one asset. */
static bool are_together(const vshi_scene_bake *bake, const vshi_target *a, const vshi_target *b) {
    const char *x = bake->scene.receivers[a->lightmap->receiver].output;
    const char *y = bake->scene.receivers[b->lightmap->receiver].output;
    return a->lightmap->receiver == b->lightmap->receiver ||
           (x != NULL && y != NULL && strcasecmp(x, y) == 0);
}

/* Whether `name` is `base`, perhaps with a number behind it. Some file systems ignore case. */
static bool is_numbered(const char *name, const char *base) {
    const size_t length = strlen(base);
    return strncasecmp(name, base, length) == 0 &&
           (name[length] == '\0' ||
            (name[length] == '-' && name[length + 1 + strspn(name + length + 1, "0123456789")] == '\0'));
}

/* Counts the lightmaps before `own` with this object's name in their files, perhaps with a number. */
static size_t count_named(const vshi_scene_bake *bake, const vshi_target *own, const char *name,
                          bool numbered) {
    size_t count = 0;
    for (const vshi_target *other = bake->targets; other < own; ++other) {
        count += other->object != NULL && are_together(bake, own, other) &&
                 (numbered ? is_numbered(other->object, name) : strcasecmp(other->object, name) == 0);
    }
    return count;
}

/* Makes the object's name for files, with a number if it is not the first of its name. To be freed. */
static char *name_object(const vshi_scene_bake *bake, const vshi_target *own, const char *name) {
    char safe[NAME_BYTES + 1], unique[NAME_BYTES + 24];
    make_safe(name[0] != '\0' ? name : "object", safe);
    snprintf(unique, sizeof unique, "%s", safe);
    for (size_t number = count_named(bake, own, safe, true); count_named(bake, own, unique, false) > 0;) {
        snprintf(unique, sizeof unique, "%s-%zu", safe, ++number);
    }
    return strdup(unique);
}

/* --- the list of lightmaps */

/* Adds a receiver's pages. All pages go into one asset, but each page has its own image. */
static vsh_result add_pages(vshi_scene_bake *bake, size_t index, vsh_error *error) {
    const vsh_receiver *receiver = &bake->scene.receivers[index];
    const vshi_asset_place *place = vshi_assets_receiver(bake->assets, index);
    const size_t pages = place->pages.count;
    const bool lit = vsh_lit_is_output(receiver->output) != 0;
    if (lit && pages > MOST_LIT_PAGES) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu lightmaps, an asset has at most %d",
                         receiver->output, pages, MOST_LIT_PAGES);
    }
    for (size_t page = 0; page < pages; ++page) {
        const size_t at = bake->target_count++;
        vshi_target *target = &bake->targets[at];
        vsh_scene_lightmap *lightmap = target->lightmap = &bake->lightmaps[at];
        const vshi_receiver_page info = place->pages.list[page];
        size_t first;
        *lightmap = (vsh_scene_lightmap){.receiver = index,
                                         .page = page,
                                         .path = receiver->path,
                                         .width = info.width,
                                         .height = info.height};
        lightmap->meshes = vshi_place_page(place, page, &first, &lightmap->mesh_count);
        target->index = at;
        target->unwrapped = place->pages.atlas != NULL;
        target->object = info.object != NULL ? name_object(bake, target, info.object) : NULL;
        target->output = receiver->output != NULL ? name_file(target, pages, receiver->output) : NULL;
        if ((info.object != NULL && target->object == NULL) ||
            (receiver->output != NULL && target->output == NULL)) {
            return vshi_fail_memory(error, "lightmaps");
        }
        lightmap->output = lit ? receiver->output : target->output;
        target->receiver = *receiver;
        target->receiver.width = info.width;
        target->receiver.height = info.height;
        target->receiver.output = lightmap->output;
        if (receiver->seams == VSH_SEAMS_DEFAULT) {
            target->receiver.seams = lit ? VSH_SEAMS_FIX : VSH_SEAMS_KEEP;
        }
    }
    return VSH_OK;
}

vsh_result vshi_list_lightmaps(vshi_scene_bake *bake, vsh_error *error) {
    size_t most = 1;
    for (size_t i = 0; i < bake->scene.receiver_count; ++i) {
        most += vshi_assets_receiver(bake->assets, i)->pages.count;
    }
    const vshi_array arrays[] = {VSHI_ARRAY(bake->targets, most), VSHI_ARRAY(bake->lightmaps, most)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "lightmaps", error));
    for (size_t i = 0; i < bake->scene.receiver_count; ++i) {
        VSHI_TRY(add_pages(bake, i, error));
    }
    return VSH_OK;
}

/* --- channels */

/* Whether the scene asks for a kind of plane: by its lights, its AO and their options, or in vsh_planes. */
static bool is_asked(const vshi_plane_kind *kind, const vsh_scene *scene) {
    /* remaining errors: only of methods that know them */
    const bool shadow_error =
        (vsh_method_traits(VSH_NAMES_SHADOW, scene->shade.method) & VSH_METHOD_RAYS) != 0;
    const bool ao_error = (vsh_method_traits(VSH_NAMES_AO, scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
    const struct {
        size_t plane;
        bool asked;
    } own[] = {
        {offsetof(vsh_lightmap, shadow), scene->light_count > 0},
        {offsetof(vsh_lightmap, ao), scene->ao != 0},
        {offsetof(vsh_lightmap, shadow_error), scene->error && shadow_error},
        {offsetof(vsh_lightmap, ao_error), scene->error && scene->ao && ao_error},
        {offsetof(vsh_lightmap, irradiance), scene->irradiance != 0},
        {offsetof(vsh_lightmap, bent), scene->bent != VSH_BENT_NONE},
        {offsetof(vsh_lightmap, tint), scene->tint.type != VSH_TINT_NONE},
        {offsetof(vsh_lightmap, coverage), true},
    };
    for (size_t i = 0; i < sizeof own / sizeof own[0]; ++i) {
        if (own[i].plane == kind->plane) {
            return own[i].asked;
        }
    }
    return vshi_plane_wished(kind, &scene->planes);
}

/* Counts the values of a kind, each of one channel or three. */
static size_t count_values(const vshi_plane_kind *kind, const vsh_scene *scene) {
    return !is_asked(kind, scene) ? 0 : kind->per_light ? scene->light_count : 1;
}

/* Names the channels of one value and returns how many there are. */
static size_t name_value(const vshi_plane_kind *kind, const vsh_light *light,
                         char (*names)[VSH_CHANNEL_NAME]) {
    char value[VSH_CHANNEL_NAME - 2];
    snprintf(value, sizeof value, "%s%s%s", kind->name, light != NULL ? "." : "",
             light != NULL ? light->name : "");
    if (kind->axes == NULL) {
        snprintf(names[0], sizeof names[0], "%s", value);
        return 1;
    }
    for (size_t c = 0; c < 3; ++c) {
        snprintf(names[c], sizeof names[c], "%s.%c", value, kind->axes[c]);
    }
    return 3;
}

vsh_result vshi_channels_name(const vsh_scene *scene, int32_t width, int32_t height, vshi_channels *channels,
                              vsh_error *error) {
    static const vsh_channel_kind holds[] = {[VSHI_HOLDS_DATA] = VSH_CHANNEL_DATA,
                                             [VSHI_HOLDS_LIGHT] = VSH_CHANNEL_LIGHT,
                                             [VSHI_HOLDS_VECTOR] = VSH_CHANNEL_VECTOR};
    memset(channels, 0, sizeof *channels);
    size_t kind_count, count = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const size_t values = count_values(&kinds[k], scene);
        count += values * vshi_plane_components(&kinds[k]);
        channels->value_count += values;
    }
    if (count > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: %zu channels, at most %d", count,
                         VSH_MAX_CHANNELS);
    }
    const vshi_array arrays[] = {VSHI_ARRAY(channels->names, count), VSHI_ARRAY(channels->name_list, count),
                                 VSHI_ARRAY(channels->holds, count),
                                 VSHI_ARRAY(channels->values, channels->value_count),
                                 VSHI_ARRAY(channels->components, channels->value_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "channels", error));
    size_t at = 0, value = 0;
    for (size_t k = 0; k < kind_count; ++k) {
        for (size_t i = 0; i < count_values(&kinds[k], scene); ++i) {
            channels->components[value++] = vshi_plane_components(&kinds[k]);
            const size_t next = at + name_value(&kinds[k], kinds[k].per_light ? &scene->lights[i] : NULL,
                                                channels->names + at);
            for (; at < next; ++at) {
                channels->holds[at] = holds[kinds[k].holds];
                channels->name_list[at] = channels->names[at];
            }
        }
    }
    channels->image = (vsh_image){width, height, (int32_t)count, channels->name_list, NULL, channels->holds};
    return VSH_OK;
}

/* Sets a lightmap's planes to the values. With `values` NULL, sets the planes to any pointer but NULL. */
static void bind_planes(vsh_lightmap *lightmap, const vsh_scene *scene, float *const *values) {
    static float plane;
    float *const any[] = {&plane};
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        const size_t count = count_values(&kinds[k], scene);
        if (count > 0) {
            vshi_plane_set(lightmap, &kinds[k], values != NULL ? values : any);
        }
        values = values != NULL ? values + count : NULL;
    }
    lightmap->bent_space = scene->bent != VSH_BENT_NONE ? scene->bent : VSH_BENT_WORLD;
    lightmap->asked = scene->planes;
}

vsh_lightmap vshi_channels_shape(const vsh_scene *scene) {
    vsh_lightmap lightmap = {.asked = scene->planes};
    bind_planes(&lightmap, scene, NULL);
    return lightmap;
}

vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, vshi_store *store,
                                  const char *output, vsh_error *error) {
    const size_t texels = (size_t)channels->image.width * (size_t)channels->image.height;
    channels->store = store;
    for (size_t i = 0; i < channels->value_count; ++i) {
        VSHI_TRY(vshi_store_take(store, (void **)&channels->values[i], texels,
                                 channels->components[i] * sizeof(float), output, error));
    }
    bind_planes(&channels->lightmap, scene, channels->values);
    channels->lightmap.tint_by = scene->tint; /* of irradiance too */
    channels->lightmap.ambient = scene->has_ambient ? scene->ambient : NULL;
    return VSH_OK;
}

void vshi_channels_free(vshi_channels *channels) {
    for (size_t i = 0; channels->store != NULL && i < channels->value_count; ++i) {
        vshi_store_give(channels->store, channels->values[i]);
    }
    free(channels->names); /* the block's first array */
    memset(channels, 0, sizeof *channels);
}

/* --- assets: a receiver's own file with its light in the materials */

/* Planes of a page: light has one or three. */
enum { AO = 0, LIGHT = 1 };

/* Viewers divide the light on a diffuse surface by this, so light of 1 shows the surface's own colour. */
static const double FULL_LIGHT = 3.14159265358979323846;

/* Whether an asset shows the light as its base colour. */
static bool is_preview(const vshi_scene_bake *bake, const char *output) {
    return bake->options.lit_preview != 0 || strcasecmp(vshi_path_ending(output), "obj") == 0;
}

/* Irradiance has three planes, the mean of the shadows has one. */
static int32_t count_light_planes(const vsh_scene *scene) {
    return scene->irradiance ? 3 : scene->light_count > 0;
}

/* The light of a texel in plane `c` of an asset. */
static float find_light(const vshi_scene_page *page, size_t texel, size_t c, bool preview) {
    const vsh_scene *scene = &page->bake->scene;
    const vsh_lightmap *from = &page->channels.lightmap;
    float light = 0.0F;
    if (scene->irradiance) {
        light = from->irradiance[3 * texel + c];
    } else {
        for (size_t i = 0; i < scene->light_count; ++i) {
            light += from->shadow[i][texel];
        }
        light /= (float)scene->light_count;
    }
    if (from->ao != NULL && preview && !scene->irradiance) {
        light *= from->ao[texel];
    } else if (from->ao != NULL && !preview && scene->has_ambient) {
        /* viewers multiply all baked light by the occlusion, but ambient light has it already */
        light += (float)scene->ambient[c] * (1.0F - from->ao[texel]);
    }
    return light;
}

static vsh_result fill_lit_page(const vshi_scene_page *page, vshi_lit_page *lit, vsh_error *error) {
    const vsh_scene *scene = &page->bake->scene;
    const char *output = page->target->lightmap->output;
    const bool preview = is_preview(page->bake, output);
    const float *ao = page->channels.lightmap.ao;
    const size_t texels = vshi_page_texels(&page->page);
    *lit = (vshi_lit_page){.object = page->target->object,
                           .width = page->target->lightmap->width,
                           .height = page->target->lightmap->height};
    if (ao != NULL) {
        VSHI_TRY(vshi_allocate((void **)&lit->planes[AO], texels, sizeof(float), output, error));
        memcpy(lit->planes[AO], ao, texels * sizeof(float));
    }
    for (int32_t c = 0; c < count_light_planes(scene); ++c) {
        float **plane = &lit->planes[LIGHT + c];
        VSHI_TRY(vshi_allocate((void **)plane, texels, sizeof(float), output, error));
        for (size_t i = 0; i < texels; ++i) {
            (*plane)[i] = find_light(page, i, (size_t)c, preview);
        }
    }
    return VSH_OK;
}

void vshi_lit_pages_free(vshi_scene_bake *bake) {
    for (size_t i = 0; i < bake->lit_page_count; ++i) {
        for (int p = 0; p < VSHI_LIT_PLANES; ++p) {
            free(bake->lit_pages[i].planes[p]);
        }
    }
    free(bake->lit_pages);
    bake->lit_pages = NULL;
    bake->lit_page_count = 0;
}

/* An asset that is written, or before the bake (`pages` NULL) checked. */
typedef struct asset {
    const vshi_scene_bake *bake;
    size_t receiver;            /* index */
    const vshi_lit_page *pages; /* [page_count] */
    size_t page_count;
    const vsh_model *model;
    vsh_lit_mesh *meshes; /* [meshes of the model] */
    vsh_lit_image *images;
    const char **names; /* [page_count] */
    uint32_t *chart_pages;
    const vshi_vertex_colors *colors; /* NULL: images */
    vsh_lit_options options;
} asset;

static vsh_result list_meshes(asset *a, const char *output, vsh_error *error) {
    const vshi_asset_place *place = vshi_assets_receiver(a->bake->assets, a->receiver);
    const vsh_receiver *receiver = &a->bake->scene.receivers[a->receiver];
    const size_t all = vsh_model_mesh_count(a->model);
    const vsh_atlas *atlas = place->pages.atlas;
    VSHI_TRY(vshi_allocate((void **)&a->meshes, all, sizeof *a->meshes, output, error));
    for (size_t i = 0; i < all; ++i) {
        a->meshes[i].uv_set = -1;
    }
    const uint16_t *next = a->colors != NULL ? a->colors->values : NULL;
    for (size_t i = 0; next != NULL && i < place->count; ++i) {
        a->meshes[place->numbers[i]].colors = next;
        next += 4 * place->meshes[i].vertex_count;
    }
    for (size_t page = 0; page < a->page_count; ++page) {
        size_t first, count;
        vshi_place_page(place, page, &first, &count);
        for (size_t i = first; i < first + count; ++i) {
            vsh_lit_mesh *mesh = &a->meshes[place->numbers[i]];
            if (atlas != NULL) {
                const vsh_atlas_mesh v = vsh_atlas_mesh_view(atlas, place->pages.atlas_numbers[i]);
                *mesh = (vsh_lit_mesh){
                    v.uvs, v.sources, v.indices, v.charts, v.vertex_count, v.triangle_count, 0, 0, NULL};
                continue;
            }
            mesh->page = (uint32_t)page;
            mesh->uv_set = receiver->type != VSH_RECEIVER_MESH ? 0
                           : receiver->uv_set >= 0             ? receiver->uv_set
                                                   : vsh_model_uv_sets(a->model, place->numbers[i]) > 1;
        }
    }
    if (atlas == NULL) {
        return VSH_OK;
    }
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    const size_t charts = a->options.chart_count = (size_t)info.charts;
    VSHI_TRY(vshi_allocate((void **)&a->chart_pages, charts, sizeof *a->chart_pages, output, error));
    for (size_t i = 0; i < charts; ++i) {
        a->chart_pages[i] = vsh_atlas_charts(atlas)[i].page;
    }
    a->options.chart_pages = a->chart_pages;
    return VSH_OK;
}

/* Lists the images of all pages, at most two each. */
static vsh_result list_images(asset *a, const char *output, vsh_error *error) {
    const vsh_scene *scene = &a->bake->scene;
    const int32_t light_planes = count_light_planes(scene);
    const bool preview = is_preview(a->bake, output);
    const vshi_array arrays[] = {VSHI_ARRAY(a->images, 2 * a->page_count),
                                 VSHI_ARRAY(a->names, a->page_count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, output, error));
    for (size_t i = 0; i < a->page_count; ++i) {
        const vshi_lit_page *page = &a->pages[i];
        vsh_lit_image image = {.page = (uint32_t)i,
                               .width = page->width,
                               .height = page->height,
                               .bits = scene->receivers[a->receiver].bits};
        a->names[i] = page->object;
        if (scene->ao && !(preview && light_planes > 0)) {
            image.purpose = preview ? VSH_LIT_PREVIEW : VSH_LIT_OCCLUSION;
            image.channels = (const float *const *)page->planes + AO;
            image.channel_count = 1;
            image.intensity = 1.0;
            a->images[a->options.image_count++] = image;
        }
        if (light_planes > 0) {
            image.purpose = preview ? VSH_LIT_PREVIEW : VSH_LIT_LIGHTMAP;
            image.channels = (const float *const *)page->planes + LIGHT;
            image.channel_count = light_planes;
            image.intensity = preview ? 1.0 : FULL_LIGHT;
            a->images[a->options.image_count++] = image;
        }
    }
    a->options.images = a->images;
    return VSH_OK;
}

/* Writes a receiver's asset from its pages, or from the colours of its vertices. */
static vsh_result write_asset(const vshi_scene_bake *bake, size_t index, const vshi_lit_page *pages,
                              const vshi_vertex_colors *colors, vsh_error *error) {
    const vsh_receiver *receiver = &bake->scene.receivers[index];
    const char *output = receiver->output;
    const char *path = receiver->type == VSH_RECEIVER_MESH ? receiver->path : NULL;
    const vshi_asset_place *place = vshi_assets_receiver(bake->assets, index);
    asset a = {.bake = bake,
               .receiver = index,
               .pages = pages,
               .page_count = pages != NULL ? place->pages.count : 0,
               .colors = colors,
               .model = place->made != NULL ? place->made : place->model,
               .options = vsh_lit_options_default()};
    vsh_run run = bake->run;
    run.progress = NULL; /* writing is a stage of the bake's */
    vsh_result result;
    VSHI_TRY_DONE(list_images(&a, output, error));
    VSHI_TRY_DONE(list_meshes(&a, output, error));
    a.options.unlit = colors != NULL &&
                      (bake->options.lit_preview != 0 || strcmp(receiver->vertex_colors, "irradiance") == 0);
    a.options.page_names = a.names;
    a.options.page_count = a.page_count;
    a.options.attributes = vsh_provenance_attributes(bake->provenance, &a.options.attribute_count);
    result = vsh_lit_write(path, a.model, a.meshes, &a.options, output, &run, error);
done:
    free(a.chart_pages);
    free(a.names);
    free(a.images);
    free(a.meshes);
    return result;
}

/* Errors between vertices, in units of the values' error, that noise alone does not reach. */
static const double LARGE = 5.0;

/* Fits vertex colours to a page of points, and writes the asset. */
static vsh_result write_vertex_colors(const vshi_scene_page *page, vsh_error *error) {
    const vshi_scene_bake *bake = page->bake;
    vsh_scene_lightmap *lightmap = page->target->lightmap;
    const vsh_lightmap *planes = &page->channels.lightmap;
    const char *what = page->target->receiver.vertex_colors;
    const bool irradiance = strcmp(what, "irradiance") == 0;
    const float *values = irradiance ? planes->irradiance : planes->ao;
    float brightest = 0.0f;
    for (size_t i = 0; irradiance && i < 3 * vshi_page_texels(&page->page); ++i) {
        brightest = planes->coverage[i / 3] == 1.0f ? fmaxf(brightest, values[i]) : brightest;
    }
    if (brightest > 1.0f) {
        vshi_warn(&bake->run, "%s: light of up to %.3g is cut to 1; dim the lights, or bake a lightmap",
                  lightmap->output, (double)brightest);
    }
    for (size_t i = 0; i < bake->scene.light_count; ++i) {
        values = strcmp(what, page->channels.names[i]) == 0 ? planes->shadow[i] : values;
    }
    const double most = bake->scene.shade.max_error;
    double noise = NAN; /* stays NaN, and nothing is warned of, if methods keep no error */
    for (size_t i = 0; i < bake->error_count; ++i) {
        noise = fmax(noise, vsh_bake_error_rmse(&page->baked.errors[i]));
    }
    vshi_vertex_colors colors;
    vsh_result result;
    VSHI_TRY_DONE(vshi_vertex_colors_fit(page->target->charts, planes->coverage, values, irradiance ? 3 : 1,
                                         &bake->run, &colors, error));
    lightmap->vertex_error = vshi_warn_vertex_colors(page->target, colors.error,
                                                     LARGE * (noise < most ? most : noise), &bake->run);
    result = write_asset(bake, lightmap->receiver, NULL, &colors, error);
done:
    free(colors.values);
    free(colors.error);
    return result;
}

/* Keeps a page for its asset, and writes the asset with the last one. */
static vsh_result keep_lit_page(const vshi_scene_page *page, vsh_error *error) {
    vshi_scene_bake *bake = page->bake;
    const vsh_scene_lightmap *lightmap = page->target->lightmap;
    const size_t pages = vshi_assets_receiver(bake->assets, lightmap->receiver)->pages.count;
    if (page->target->receiver.vertex_colors != NULL) {
        return write_vertex_colors(page, error);
    }
    if (lightmap->page == 0) {
        vshi_lit_pages_free(bake);
        VSHI_TRY(vshi_allocate((void **)&bake->lit_pages, pages, sizeof *bake->lit_pages, lightmap->output,
                               error));
    }
    VSHI_TRY(fill_lit_page(page, &bake->lit_pages[bake->lit_page_count++], error));
    if (bake->lit_page_count < pages) {
        return VSH_OK;
    }
    const vsh_result result = write_asset(bake, lightmap->receiver, bake->lit_pages, NULL, error);
    vshi_lit_pages_free(bake);
    return result;
}

/* --- a picture of a lightmap's charts and their invalid texels */

/* FILE.png for one lightmap, else FILE.N.OUTPUT.png: "where.0.floor.png". To be freed; NULL if out of memory.
 */
static char *name_picture(const vshi_scene_bake *bake, const vshi_target *target, const char *file) {
    if (bake->target_count == 1) {
        return strdup(file);
    }
    const char *output = vshi_path_name(target->output != NULL ? target->output : ""),
               *dot = strrchr(output, '.');
    const int stem = dot != NULL ? (int)(dot - output) : (int)strlen(output);
    const int before = (int)(strlen(file) - strlen(".png"));
    char *path;
    return asprintf(&path, "%.*s.%td.%.*s.png", before, file, target - bake->targets, stem, output) >= 0
               ? path
               : NULL;
}

/* Writes the picture of a page, if the caller wants one. */
static vsh_result write_picture(const vshi_scene_page *page, vsh_error *error) {
    /* texels outside charts, valid and invalid texels */
    static const float COLOURS[3][3] = {{0.05f, 0.05f, 0.06f}, {0.5f, 0.5f, 0.5f}, {0.7f, 0.05f, 0.05f}};
    static const char *const NAMES[3] = {"R", "G", "B"};
    const char *file = page->bake->options.invalid_picture;
    const int32_t width = page->target->lightmap->width, height = page->target->lightmap->height;
    const size_t room = (size_t)width * ROWS;
    float *colours = NULL;
    vshi_image_writer *writer = NULL;
    vsh_result result;
    if (file == NULL) {
        return VSH_OK;
    }
    char *path = name_picture(page->bake, page->target, file);
    VSHI_TRY_DONE(path != NULL ? VSH_OK : vshi_fail_memory(error, file));
    VSHI_TRY_DONE(vshi_allocate((void **)&colours, 3 * room, sizeof *colours, file, error));
    const float *const planes[3] = {colours, colours + room, colours + 2 * room};
    const vsh_image image = {width, height, 3, NAMES, planes, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = 8;
    VSHI_TRY_DONE(vshi_image_writer_create(path, &image, &options, &writer, error));
    for (int32_t first = 0; first < height; first += ROWS) {
        const int32_t rows = height - first < ROWS ? height - first : ROWS;
        const uint8_t *state = page->page.state + (size_t)first * page->page.width;
        for (size_t i = 0; i < (size_t)rows * page->page.width; ++i) {
            const int kind = state[i] == VSHI_TEXEL_EMPTY ? 0 : state[i] == VSHI_TEXEL_VALID ? 1 : 2;
            for (size_t c = 0; c < 3; ++c) {
                colours[c * room + i] = COLOURS[kind][c];
            }
        }
        VSHI_TRY_DONE(vshi_image_writer_add(writer, rows, planes, error));
    }
    result = vshi_image_writer_finish(writer, error);
    writer = NULL;
done:
    vshi_image_writer_abandon(writer);
    free(colours);
    free(path);
    return result;
}

/* --- writing */

vsh_image_options vshi_receiver_image(const vsh_receiver *receiver) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = receiver->bits;
    options.pack = receiver->pack;
    options.color_space = receiver->color_space;
    return options;
}

/* Opens the page's image, or the EXR beside an asset; *writer is NULL if there is neither. */
static vsh_result open_image(const vshi_scene_page *page, bool is_lit, vsh_image_clipping *clipping,
                             vshi_image_writer **writer, vsh_error *error) {
    const vshi_scene_bake *bake = page->bake;
    const vsh_scene_lightmap *lightmap = page->target->lightmap;
    const char *file = is_lit ? bake->options.lit_exr : lightmap->output;
    if (bake->options.rows != NULL || file == NULL) {
        return VSH_OK;
    }
    const size_t pages = vshi_assets_receiver(bake->assets, lightmap->receiver)->pages.count;
    char *path = is_lit ? name_file(page->target, pages, file) : strdup(file);
    if (path == NULL) {
        return vshi_fail_memory(error, file);
    }
    vsh_image_options options =
        is_lit ? vsh_image_options_default() : vshi_receiver_image(&page->target->receiver);
    options.attributes = vsh_provenance_attributes(bake->provenance, &options.attribute_count);
    options.clipping = clipping;
    const vsh_result result = vshi_image_writer_create(path, &page->channels.image, &options, writer, error);
    free(path);
    return result;
}

static vsh_result report_writing(const vsh_run *run, double fraction, vsh_error *error) {
    if (run->progress != NULL && run->progress(run->user, "write", fraction) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "write: cancelled");
    }
    return VSH_OK;
}

/* Allocates the memory of list_rows(), to be freed. */
static vsh_result allocate_rows(const vshi_channels *channels, int32_t rows, float **memory,
                                vsh_error *error) {
    const size_t texels = (size_t)channels->image.width * (size_t)rows;
    size_t floats = 0;
    for (size_t i = 0; i < channels->value_count; ++i) {
        floats += channels->components[i] > 1 ? channels->components[i] : 0;
    }
    return vshi_allocate((void **)memory, texels, floats * sizeof(float), "rows of a lightmap", error);
}

/* Lists rows of all channels, planes[image.channel_count][rows][width]. */
static void list_rows(const vshi_channels *channels, int32_t first, int32_t rows, float *memory,
                      const float **planes) {
    const size_t width = (size_t)channels->image.width, texels = width * (size_t)rows;
    for (size_t i = 0; i < channels->value_count; ++i) {
        const size_t components = channels->components[i];
        const float *values = channels->values[i] + components * width * (size_t)first;
        for (size_t c = 0; c < components; ++c) {
            *planes = components > 1 ? memory : values;
            for (size_t t = 0; components > 1 && t < texels; ++t) {
                memory[t] = values[components * t + c];
            }
            memory += components > 1 ? texels : 0;
            ++planes;
        }
    }
}

/* Hands the page's rows to the caller or to its image. */
static vsh_result write_rows(const vshi_scene_page *page, vshi_image_writer *writer, vsh_error *error) {
    const vsh_bake_options *options = &page->bake->options;
    const vsh_scene_lightmap *lightmap = page->target->lightmap;
    const int32_t height = lightmap->height;
    const float *planes[VSH_MAX_CHANNELS];
    float *memory = NULL;
    vsh_result result;
    VSHI_TRY_DONE(report_writing(&page->bake->run, 0.0, error));
    VSHI_TRY_DONE(allocate_rows(&page->channels, ROWS, &memory, error));
    for (int32_t first = 0; first < height; first += ROWS) {
        const int32_t rows = height - first < ROWS ? height - first : ROWS;
        if (options->rows != NULL || writer != NULL) {
            list_rows(&page->channels, first, rows, memory, planes);
        }
        if (options->rows != NULL) {
            VSHI_TRY_DONE(
                options->rows(options->user, lightmap, &page->channels.image, first, rows, planes, error));
        } else if (writer != NULL) {
            VSHI_TRY_DONE(vshi_image_writer_add(writer, rows, planes, error));
        }
        VSHI_TRY_DONE(report_writing(&page->bake->run, (double)(first + rows) / (double)height, error));
    }
done:
    free(memory);
    return result;
}

vsh_result vshi_write_page(const vshi_scene_page *page, vsh_error *error) {
    const char *output = page->target->lightmap->output;
    const bool is_lit = page->bake->options.rows == NULL && vsh_lit_is_output(output) != 0;
    vshi_image_writer *writer = NULL;
    vsh_image_clipping cut = {.clipped = 0};
    vsh_result result;
    VSHI_TRY_DONE(open_image(page, is_lit, &cut, &writer, error));
    VSHI_TRY_DONE(write_rows(page, writer, error));
    VSHI_TRY_DONE(is_lit ? keep_lit_page(page, error) : VSH_OK);
    if (writer != NULL) {
        result = vshi_image_writer_finish(writer, error);
        writer = NULL;
        VSHI_TRY_DONE(result);
        vshi_warn_clipping(output, &cut, &page->bake->run);
    }
    result = write_picture(page, error);
done:
    vshi_image_writer_abandon(writer);
    return result;
}
