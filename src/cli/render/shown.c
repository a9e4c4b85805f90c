/* The casters and lightmaps in the picture, and the camera.
 *
 * Casters with triangles are shown as these, the others as a field for each colour. A layer's casters share
 * one field, which knows no casters. If they differ in colour, or some have triangles, each colour gets a
 * field of its own, for camera rays alone. */
#include "cli/casters.h"
#include "cli/message.h"
#include "render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- casters */

static const double default_color = 0.6; /* so that full light is not white */

/* Whether a caster is shown as its triangles. */
static bool is_shown_as_mesh(const vsh_assets *assets, size_t index) {
    size_t count = 0;
    vsh_assets_caster(assets, index, &count);
    return count > 0;
}

bool render_shows_fields(const vsh_scene *scene, const vsh_assets *assets) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (!is_shown_as_mesh(assets, i)) {
            return true;
        }
    }
    return false;
}

static void find_color(const vsh_caster *caster, double color[3]) {
    const bool given =
        caster != NULL && (caster->color[0] > 0.0 || caster->color[1] > 0.0 || caster->color[2] > 0.0);
    for (int c = 0; c < 3; ++c) {
        color[c] = given ? caster->color[c] : default_color;
    }
}

/* Whether the same field can show both. */
static bool same_color(const vsh_caster *a, const vsh_caster *b) {
    double one[3], other[3];
    if (cli_caster_is_direct(a) != cli_caster_is_direct(b)) {
        return false;
    }
    find_color(a, one);
    find_color(b, other);
    return memcmp(one, other, sizeof one) == 0;
}

static bool same_layer(const char *a, const char *b) {
    return a == NULL || b == NULL ? a == b : strcmp(a, b) == 0;
}

/* Caster `index`'s group: that of the first caster without triangles in its layer of its colour. */
static size_t group_of(const vsh_scene *scene, const vsh_assets *assets, size_t index) {
    const vsh_caster *caster = &scene->casters[index];
    size_t first = 0;
    while (is_shown_as_mesh(assets, first) || !same_layer(scene->casters[first].layer, caster->layer) ||
           !same_color(&scene->casters[first], caster)) {
        ++first;
    }
    return first;
}

/* The field of a layer, or (NULL) of casters in none. */
static const vsh_field *field_of(const vsh_occluder_parts *parts, const char *layer) {
    if (layer == NULL) {
        return parts->field;
    }
    for (size_t l = 0; l < parts->layer_count; ++l) {
        if (parts->layers[l].field != NULL && strcmp(parts->layers[l].name, layer) == 0) {
            return parts->layers[l].field;
        }
    }
    return NULL;
}

/* Whether all casters of a layer have one colour and no triangles, and are in its field. */
static bool is_plain(const vsh_scene *scene, const vsh_assets *assets, const char *layer) {
    const vsh_caster *first = NULL;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (!same_layer(caster->layer, layer)) {
            continue;
        }
        first = first == NULL ? caster : first;
        if (cli_caster_is_direct(caster) || !same_color(first, caster) || is_shown_as_mesh(assets, i)) {
            return false;
        }
    }
    return true;
}

static void add_surface(render_shown *shown, const vsh_field *field, const vsh_caster *caster) {
    vsh_surface *surface = &shown->surfaces[shown->count++];
    surface->field = field;
    find_color(caster, surface->color);
}

/* Casters of a scene that is split by colours: a group is a layer. */
typedef struct split {
    vsh_caster *casters;
    vsh_scene_layer *layers;
    char (*names)[24];
    size_t *first; /* caster of each layer */
    size_t count;
} split;

/* Makes the fields of the groups, each of which is a layer. */
static int make_own(const vsh_scene *colored, const vsh_assets *assets, const vsh_run *run, const split *p,
                    render_shown *shown) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = 1; /* the camera sees them */
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_scene_occluders(colored, assets, &what, run, &shown->own, &error), &error));
    vsh_occluder_parts own;
    vsh_occluders_get_parts(shown->own, &own);
    for (size_t k = 0; k < own.layer_count; ++k) {
        add_surface(shown, own.layers[k].field, &colored->casters[p->first[k]]);
    }
    return CLI_OK;
}

static int make_split(const vsh_scene *scene, const vsh_assets *assets, const vsh_occluders *occluders,
                      const vsh_run *run, split *p, render_shown *shown) {
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(occluders, &parts);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_field *field = field_of(&parts, scene->casters[i].layer);
        p->casters[i] = scene->casters[i];
        p->casters[i].layer = p->names[i];
        if (is_shown_as_mesh(assets, i)) {
            snprintf(p->names[i], sizeof p->names[i], "mesh"); /* a layer that is not made */
            continue;
        }
        const size_t group = group_of(scene, assets, i);
        snprintf(p->names[i], sizeof p->names[i], "%zu", group);
        if (group == i && is_plain(scene, assets, scene->casters[i].layer)) {
            add_surface(shown, field, &scene->casters[i]);
        } else if (group == i) {
            vsh_field_info info = {.voxel_size = 0.0}; /* the scene's, or by its resolution */
            if (!cli_caster_is_direct(&scene->casters[i])) {
                vsh_field_get_info(field, &info);
            }
            p->first[p->count] = i;
            p->layers[p->count++] = (vsh_scene_layer){
                .name = p->names[i], .voxel_size = info.voxel_size, .shade = vsh_layer_default()};
        }
    }
    if (p->count == 0) {
        return CLI_OK;
    }
    vsh_scene colored = *scene;
    colored.casters = p->casters;
    colored.layers = p->layers;
    colored.layer_count = p->count;
    colored.light_count = 0;
    colored.ao = 0;
    bool direct = false;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        direct = direct || cli_caster_is_direct(&p->casters[i]);
        p->casters[i].direct = 0;
        p->casters[i].voxelised = 1;
    }
    vsh_assets *again = NULL; /* direct casters were loaded without their voxels */
    vsh_error error;
    if (direct && vsh_assets_load(&colored, run, &again, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    const int code = make_own(&colored, direct ? again : assets, run, p, shown);
    vsh_assets_free(again);
    return code;
}

int render_add_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_occluders *occluders,
                       const vsh_run *run, render_shown *shown) {
    const size_t count = scene->caster_count;
    split p = {.casters = calloc(count, sizeof *p.casters),
               .layers = calloc(count, sizeof *p.layers),
               .names = calloc(count, sizeof *p.names),
               .first = calloc(count, sizeof *p.first)};
    int code = CLI_OK;
    shown->surfaces = calloc(count, sizeof *shown->surfaces);
    if (p.casters == NULL || p.layers == NULL || p.names == NULL || p.first == NULL ||
        shown->surfaces == NULL) {
        code = cli_out_of_memory("surfaces");
        goto done;
    }
    for (size_t i = 0; i < count; ++i) {
        if (is_shown_as_mesh(assets, i)) {
            vsh_lit_meshes *lit = &shown->lit[shown->lit_count++];
            lit->meshes = vsh_assets_caster(assets, i, &lit->mesh_count);
            find_color(&scene->casters[i], lit->color);
        }
    }
    code = make_split(scene, assets, occluders, run, &p, shown);
done:
    free(p.first);
    free(p.names);
    free(p.layers);
    free(p.casters);
    return code;
}

/* --- lightmaps */

/* Renames the channels R, G, B, A (Y: R) by a pack such as "R=shadow.sun,G=ao". */
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
    for (size_t i = 0; i < count; ++i) {
        if (strcmp(attributes[i].name, "vdbshade_color_space") == 0 &&
            strcmp(attributes[i].value, "sRGB") == 0) {
            return true;
        }
    }
    return false;
}

/* Makes R, G and B linear, whose file says that they are sRGB. The image is then one of map->planes. */
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

static int read_lightmap(const render_settings *s, const char *path, const vsh_run *run,
                         render_lightmap *map) {
    vsh_error error;
    if (vsh_image_read(path, run, &map->file, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    map->image = vsh_image_view(map->file);
    CLI_TRY(says_srgb(map->file) ? decode(map) : CLI_OK);
    return s->pack != NULL ? unpack(s->pack, path, map) : CLI_OK;
}

/* The caster of a file; NULL if there is none. */
static const vsh_caster *find_caster(const vsh_scene *scene, const char *path) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (caster->path != NULL && strcmp(caster->path, path) == 0) {
            return caster;
        }
    }
    return NULL;
}

int render_read_lightmaps(const render_settings *s, const vsh_scene *scene, const vsh_assets *assets,
                          const vsh_run *run, render_shown *shown) {
    const size_t count = s->lightmap_count;
    if (count > scene->receiver_count) {
        return cli_usage("--lightmap '%s': %s has %zu receivers", s->lightmaps[scene->receiver_count],
                         s->bake.input, scene->receiver_count);
    }
    shown->maps = calloc(count + 1, sizeof *shown->maps);
    shown->lit = calloc(count + scene->caster_count + 1, sizeof *shown->lit);
    if (shown->maps == NULL || shown->lit == NULL) {
        return cli_out_of_memory("lightmaps");
    }
    shown->map_count = shown->lit_count = count;
    for (size_t i = 0; i < count; ++i) {
        vsh_lit_meshes *lit = &shown->lit[i];
        CLI_TRY(read_lightmap(s, s->lightmaps[i], run, &shown->maps[i]));
        lit->meshes = vsh_assets_receiver(assets, i, &lit->mesh_count);
        lit->lightmap = &shown->maps[i].image;
        lit->ambient = scene->has_ambient;
        find_color(find_caster(scene, scene->receivers[i].path), lit->color);
    }
    return CLI_OK;
}

void render_free_shown(render_shown *shown) {
    for (size_t i = 0; i < shown->map_count; ++i) {
        free(shown->maps[i].linear);
        vsh_image_free(shown->maps[i].file);
    }
    free(shown->maps);
    free(shown->lit);
    vsh_occluders_free(shown->own);
    free(shown->surfaces);
}

/* --- the camera */

static const double degree = 0.017453292519943295;
/* A three-quarter view from a little above. */
static const double azimuth_deg = 35.0, elevation_deg = 25.0;

static size_t count_vertices(const vsh_lit_meshes *lit, size_t count) {
    size_t vertices = 0;
    for (size_t i = 0; i < count; ++i) {
        for (size_t m = 0; m < lit[i].mesh_count; ++m) {
            vertices += lit[i].meshes[m].vertex_count;
        }
    }
    return vertices;
}

/* Adds the vertices that the mesh's triangles use, in the world. */
static bool add_vertices(const vsh_mesh *mesh, double *points, size_t *count) {
    static const double identity[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    const double *t = mesh->transform != NULL ? mesh->transform : identity;
    bool *used = calloc(mesh->vertex_count + 1, sizeof *used);
    if (used == NULL) {
        return false;
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        used[mesh->indices[i]] = true;
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const float *p = mesh->positions + 3 * v;
        double *to = points + 3 * *count;
        for (int row = 0; row < 3; ++row) {
            to[row] = t[4 * row] * (double)p[0] + t[4 * row + 1] * (double)p[1] +
                      t[4 * row + 2] * (double)p[2] + t[4 * row + 3];
        }
        *count += used[v] && isfinite(to[0]) && isfinite(to[1]) && isfinite(to[2]);
    }
    free(used);
    return true;
}

static void add_box(const vsh_field *field, double *points, size_t *count) {
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    for (int corner = 0; corner < 8; ++corner) {
        double *point = points + 3 * (*count)++;
        for (int axis = 0; axis < 3; ++axis) {
            point[axis] = corner >> axis & 1 ? info.bounds_max[axis] : info.bounds_min[axis];
        }
    }
}

/* Finds the points to keep in view: vertices of meshes, corners of the fields' boxes. [*count][3] */
static double *find_points(const render_shown *seen, size_t *count) {
    const size_t room = 8 * seen->count + count_vertices(seen->lit, seen->lit_count) + 1;
    double *points = malloc(3 * room * sizeof *points);
    *count = 0;
    for (size_t i = 0; points != NULL && i < seen->count; ++i) {
        add_box(seen->surfaces[i].field, points, count);
    }
    for (size_t i = 0; points != NULL && i < seen->lit_count; ++i) {
        for (size_t m = 0; m < seen->lit[i].mesh_count; ++m) {
            if (!add_vertices(&seen->lit[i].meshes[m], points, count)) {
                free(points);
                return NULL;
            }
        }
    }
    return points;
}

/* Frames the box around points, so that all of it is seen from any angle of --orbit. */
static vsh_result frame_box(const render_settings *s, size_t count, const double *points, vsh_camera *camera,
                            vsh_error *error) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * count; ++i) {
        low[i % 3] = fmin(low[i % 3], points[i]);
        high[i % 3] = fmax(high[i % 3], points[i]);
    }
    return vsh_camera_frame(camera, low, high, azimuth_deg * degree, elevation_deg * degree,
                            (double)s->width / (double)s->height, error);
}

int render_place_camera(const render_settings *s, const render_shown *seen, vsh_camera *camera) {
    vsh_error error;
    size_t count;
    double *points = find_points(seen, &count);
    if (points == NULL) {
        return cli_out_of_memory("camera");
    }
    memcpy(camera->up, s->up, sizeof camera->up);
    camera->fov = s->fov_deg * degree;
    const bool near = s->orbit_deg == 0.0 && !s->has_camera;
    const vsh_result result =
        near ? vsh_camera_frame_points(camera, count, points, azimuth_deg * degree, elevation_deg * degree,
                                       (double)s->width / (double)s->height, &error)
             : frame_box(s, count, points, camera, &error);
    free(points);
    if (s->has_camera) {
        memcpy(camera->position, s->camera, sizeof camera->position);
    }
    if (s->has_look_at) {
        memcpy(camera->target, s->look_at, sizeof camera->target);
    }
    if (result != VSH_OK || vsh_camera_check(camera, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    if (!near) {
        vsh_camera_orbit(camera, s->orbit_deg * degree);
    }
    return CLI_OK;
}
