/* The casters and lightmaps in the picture, and the camera.
 *
 * Casters with triangles are shown as these, the others as a field for each colour. A layer's casters share
 * one field, which knows no casters. If they differ in colour, or some have triangles, each colour gets a
 * field of its own, for camera rays alone. */
#include "cli/message.h"
#include "cli/paths.h"
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

static bool is_in_layer(const vsh_caster *caster, const char *layer) {
    return caster->layer == NULL || layer == NULL ? caster->layer == layer
                                                  : strcmp(caster->layer, layer) == 0;
}

/* Whether the same field can show both. */
static bool is_alike(const vsh_caster *a, const vsh_caster *b) {
    double one[3], other[3];
    find_color(a, one);
    find_color(b, other);
    return is_in_layer(a, b->layer) && cli_caster_is_direct(a) == cli_caster_is_direct(b) &&
           memcmp(one, other, sizeof one) == 0;
}

/* Caster `index`'s group: that of the first caster without triangles that is like it. */
static size_t group_of(const vsh_scene *scene, const vsh_assets *assets, size_t index) {
    size_t first = 0;
    while (is_shown_as_mesh(assets, first) || !is_alike(&scene->casters[first], &scene->casters[index])) {
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

/* Whether all of a caster's layer are like it and without triangles, so that the layer's field shows them. */
static bool is_plain(const vsh_scene *scene, const vsh_assets *assets, const vsh_caster *caster) {
    bool plain = !cli_caster_is_direct(caster);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (is_in_layer(&scene->casters[i], caster->layer)) {
            plain = plain && is_alike(&scene->casters[i], caster) && !is_shown_as_mesh(assets, i);
        }
    }
    return plain;
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
    size_t *first; /* caster of each layer */
    size_t count;
} split;

/* Splits casters without triangles into groups; those that a field of the scene shows are done. */
static int find_groups(const cli_shading *shading, split *p, render_shown *shown) {
    const vsh_scene *scene = shading->scene;
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(shading->occluders, &parts);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        const vsh_field *field = field_of(&parts, caster->layer);
        p->casters[i] = *caster;
        p->casters[i].direct = 0;
        p->casters[i].voxelised = 1;
        if (is_shown_as_mesh(shading->assets, i)) {
            p->casters[i].layer = "mesh"; /* a layer that is not made */
            continue;
        }
        const size_t group = group_of(scene, shading->assets, i);
        p->casters[i].layer = cli_keep_text("%zu", group);
        if (p->casters[i].layer == NULL) {
            return cli_out_of_memory("surfaces");
        }
        if (group == i && is_plain(scene, shading->assets, caster)) {
            add_surface(shown, field, caster);
        } else if (group == i) {
            vsh_field_info info = {.voxel_size = 0.0}; /* the scene's, or by its resolution */
            if (!cli_caster_is_direct(caster)) {
                vsh_field_get_info(field, &info);
            }
            p->first[p->count] = i;
            p->layers[p->count++] = (vsh_scene_layer){
                .name = p->casters[i].layer, .voxel_size = info.voxel_size, .shade = vsh_layer_default()};
        }
    }
    return CLI_OK;
}

/* Makes the fields of the groups, each of which is a layer. */
static int make_fields(const cli_shading *shading, const split *p, render_shown *shown) {
    vsh_scene colored = *shading->scene;
    colored.casters = p->casters;
    colored.layers = p->layers;
    colored.layer_count = p->count;
    colored.light_count = 0;
    colored.ao = 0;
    bool direct = false;
    for (size_t i = 0; i < colored.caster_count; ++i) {
        direct = direct || cli_caster_is_direct(&shading->scene->casters[i]);
    }
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = 1;          /* the camera sees them */
    vsh_assets *again = NULL; /* direct casters were loaded without their voxels */
    vsh_occluder_parts own;
    vsh_error error;
    int code;
    if (direct) {
        CLI_TRY_DONE(cli_check_result(vsh_assets_load(&colored, &shading->run, &again, &error), &error));
    }
    CLI_TRY_DONE(cli_check_result(vsh_scene_occluders(&colored, direct ? again : shading->assets, &what,
                                                      &shading->run, &shown->own, &error),
                                  &error));
    vsh_occluders_get_parts(shown->own, &own);
    for (size_t k = 0; k < own.layer_count; ++k) {
        add_surface(shown, own.layers[k].field, &p->casters[p->first[k]]);
    }
done:
    vsh_assets_free(again);
    return code;
}

int render_add_casters(const cli_shading *shading, render_shown *shown) {
    const size_t count = shading->scene->caster_count;
    split p = {.casters = calloc(count, sizeof *p.casters),
               .layers = calloc(count, sizeof *p.layers),
               .first = calloc(count, sizeof *p.first)};
    int code;
    shown->surfaces = calloc(count, sizeof *shown->surfaces);
    if (p.casters == NULL || p.layers == NULL || p.first == NULL || shown->surfaces == NULL) {
        code = cli_out_of_memory("surfaces");
        goto done;
    }
    for (size_t i = 0; i < count; ++i) {
        if (is_shown_as_mesh(shading->assets, i)) {
            vsh_lit_meshes *lit = &shown->lit[shown->lit_count++];
            lit->meshes = vsh_assets_caster(shading->assets, i, &lit->mesh_count);
            find_color(&shading->scene->casters[i], lit->color);
        }
    }
    CLI_TRY_DONE(find_groups(shading, &p, shown));
    code = p.count > 0 ? make_fields(shading, &p, shown) : CLI_OK;
done:
    free(p.first);
    free(p.layers);
    free(p.casters);
    return code;
}

/* --- lightmaps */

/* The plane of channel `letter` (or for R, of Y); NULL if there is none. */
static const float *find_plane(const vsh_image *image, char letter) {
    const float *plane = NULL;
    for (int32_t i = 0; i < image->channel_count; ++i) {
        const char *name = image->names[i];
        if (name[0] != '\0' && name[1] == '\0' && (name[0] == letter || (name[0] == 'Y' && letter == 'R'))) {
            plane = image->planes[i];
        }
    }
    return plane;
}

/* Renames the channels R, G, B, A (Y: R) by a pack such as "R=shadow.sun,G=ao". */
static int unpack(const char *pack, const char *path, render_lightmap *map) {
    const vsh_image read = map->image;
    map->image = (vsh_image){read.width, read.height, 0, map->names, map->planes, NULL};
    for (const char *item = pack + strspn(pack, ","); *item != '\0'; item += strspn(item, ",")) {
        const int length = (int)strcspn(item, ",");
        if (length < 3 || item[1] != '=' || strchr("RGBA", item[0]) == NULL) {
            return cli_usage("--lightmap-pack '%s': expected R=CHANNEL,G=CHANNEL and so on", pack);
        }
        const float *plane = find_plane(&read, item[0]);
        if (plane == NULL) {
            return cli_usage("%s: no channel %c, which --lightmap-pack names", path, item[0]);
        }
        const int32_t at = map->image.channel_count;
        if (at == VSH_MAX_CHANNELS) {
            return cli_usage("--lightmap-pack '%s': more than %d channels", pack, VSH_MAX_CHANNELS);
        }
        map->names[at] = cli_keep_text("%.*s", length - 2, item + 2);
        if (map->names[at] == NULL) {
            return cli_out_of_memory("lightmaps");
        }
        map->planes[at] = plane;
        ++map->image.channel_count;
        item += length;
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

/* Makes R, G and B linear, whose file says that they are sRGB. */
static int decode(render_lightmap *map) {
    const vsh_image read = map->image;
    const size_t texels = (size_t)read.width * (size_t)read.height;
    map->linear = malloc(3 * texels * sizeof *map->linear);
    if (map->linear == NULL) {
        return cli_out_of_memory("lightmaps");
    }
    map->image.planes = map->decoded;
    for (int32_t c = 0; c < read.channel_count; ++c) {
        static const char rgb[] = "RGB";
        const char *name = read.names[c], *at = name[1] == '\0' ? strchr(rgb, name[0]) : NULL;
        float *plane = at != NULL ? map->linear + (size_t)(at - rgb) * texels : NULL;
        map->decoded[c] = plane != NULL ? plane : read.planes[c];
        for (size_t i = 0; plane != NULL && i < texels; ++i) {
            plane[i] = (float)vsh_srgb_to_linear((double)read.planes[c][i]);
        }
    }
    return CLI_OK;
}

static int read_lightmap(const render_settings *s, const char *path, const vsh_run *run,
                         render_lightmap *map) {
    vsh_error error;
    CLI_TRY(cli_check(vsh_image_read(path, run, &map->file, &error), &error));
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

int render_read_lightmaps(const render_settings *s, const cli_shading *shading, render_shown *shown) {
    const vsh_scene *scene = shading->scene;
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
        CLI_TRY(read_lightmap(s, s->lightmaps[i], &shading->run, &shown->maps[i]));
        lit->meshes = vsh_assets_receiver(shading->assets, i, &lit->mesh_count);
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

/* A three-quarter view from a little above. */
static const double azimuth = 35.0 * CLI_DEGREE, elevation = 25.0 * CLI_DEGREE;

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
static vsh_result frame_box(size_t count, const double *points, double aspect, vsh_camera *camera,
                            vsh_error *error) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < 3 * count; ++i) {
        low[i % 3] = fmin(low[i % 3], points[i]);
        high[i % 3] = fmax(high[i % 3], points[i]);
    }
    return vsh_camera_frame(camera, low, high, azimuth, elevation, aspect, error);
}

int render_place_camera(const render_settings *s, const render_shown *seen, vsh_camera *camera) {
    const vsh_camera given = s->options.camera;
    const double aspect = (double)s->options.width / (double)s->options.height;
    vsh_error error;
    size_t count;
    double *points = find_points(seen, &count);
    if (points == NULL) {
        return cli_out_of_memory("camera");
    }
    const bool near = s->orbit_deg == 0.0 && !s->has_camera;
    const vsh_result result =
        near ? vsh_camera_frame_points(camera, count, points, azimuth, elevation, aspect, &error)
             : frame_box(count, points, aspect, camera, &error);
    free(points);
    CLI_TRY(cli_check(result, &error));
    if (s->has_camera) {
        memcpy(camera->position, given.position, sizeof camera->position);
    }
    if (s->has_look_at) {
        memcpy(camera->target, given.target, sizeof camera->target);
    }
    CLI_TRY(cli_check(vsh_camera_check(camera, &error), &error));
    if (!near) {
        vsh_camera_orbit(camera, s->orbit_deg * CLI_DEGREE);
    }
    return CLI_OK;
}
