/* vdbshade render: pictures of a scene, to look at what bake makes of it. */
#include "base/clock.h"
#include "base/memory.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/warnings.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_LIGHTMAPS = 64 };

typedef struct render_settings {
    cli_bake_settings bake;     /* the scene, the output and the stats */
    vsh_render_options options; /* but for what follows from the scene */
    double orbit_deg, exposure;
    const char *lightmaps[MOST_LIGHTMAPS];
    size_t lightmap_count;
    const char *pack; /* of the lightmaps, as of `bake`; NULL: their own names */
    bool has_camera, has_look_at, has_sky, transparent;
} render_settings;

enum {
    KEY_CAMERA = 0x2000,
    KEY_LOOK_AT,
    KEY_UP,
    KEY_FOV,
    KEY_ORBIT,
    KEY_SIZE,
    KEY_SAMPLES,
    KEY_SKY,
    KEY_BACKGROUND,
    KEY_EXPOSURE,
    KEY_SHAFTS,
    KEY_SHAFT_STEPS,
    KEY_LIGHTMAP
};

static const cli_option options[] = {
    {0, NULL, NULL, "Picture"},
    {CLI_TEXT(render_settings, bake.output), "output", "OUT",
     "image to write: .exr has linear R G B, A, Z and N.X N.Y\nN.Z; others are sRGB of 8 bits"},
    {KEY_SIZE, "size", "W[xH]", "pixels, 1 to 16384 (1280x720)"},
    {KEY_SAMPLES, "samples", "N", "N x N rays a pixel, 1 to 16 (3)"},
    {KEY_EXPOSURE, "exposure", "STOPS", "colours of 8-bit pictures times 2^STOPS, -20 to 20 (0)"},
    CLI_STATS_OPTION(render_settings, bake.stats),
    {0, NULL, NULL, "Camera"},
    {KEY_CAMERA, "camera", "X,Y,Z", "where it stands (where all casters are in view)"},
    {KEY_LOOK_AT, "look-at", "X,Y,Z", "the point it looks at (the middle of the casters' box)"},
    {KEY_UP, "up", "X,Y,Z", "the way up (0,1,0)"},
    {KEY_FOV, "fov", "DEG", "angle over the picture's height, 0.1 to 170 (35)"},
    {KEY_ORBIT, "orbit", "DEG", "turn it so far around what it looks at (0)"},
    {0, NULL, NULL, "Light"},
    CLI_LIGHT_OPTIONS,
    {KEY_SKY, "sky", "R,G,B",
     "light of the open sky, linear (the scene's ambient, or\n0.3,0.3,0.3; 1,1,1 where there are no lights)"},
    {KEY_BACKGROUND, "background", "R,G,B", "where nothing is, linear (0.1,0.1,0.1); none:\ntransparent"},
    {KEY_SHAFTS, "shafts", "STRENGTH",
     "light shafts: thickness of a fog around the casters,\n0 to 100 (0: none; 0.3 is much)"},
    {KEY_SHAFT_STEPS, "shaft-steps", "N", "points a ray that they are taken at, 1 to 64 (8)"},
    {KEY_LIGHTMAP, "lightmap", "FILE",
     "show the receiver with this lightmap, whose values then\nstand in place of computed ones; again for "
     "the scene's\nnext receivers"},
    {CLI_TEXT(render_settings, pack), "lightmap-pack", "PACK",
     "the channels of lightmaps that do not name them, as\n--pack of bake: \"R=shadow.sun,G=ao\""},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

static int parse_option(void *settings, int key, const char *name, const char *value) {
    render_settings *s = settings;
    vsh_render_options *o = &s->options;
    double degrees;
    switch (key) {
    case KEY_CAMERA:
        s->has_camera = true;
        return cli_parse_point(name, value, o->camera.position);
    case KEY_LOOK_AT:
        s->has_look_at = true;
        return cli_parse_point(name, value, o->camera.target);
    case KEY_UP:
        return cli_parse_vector(name, value, o->camera.up);
    case KEY_FOV:
        CLI_TRY(cli_parse_number(name, value, 0.1, 170.0, &degrees));
        o->camera.fov = degrees * CLI_DEGREE;
        return CLI_OK;
    case KEY_ORBIT:
        return cli_parse_number(name, value, -1e6, 1e6, &s->orbit_deg);
    case KEY_SIZE:
        return cli_parse_size(name, value, &o->width, &o->height);
    case KEY_SAMPLES:
        return cli_parse_integer(name, value, 1, 16, &o->samples);
    case KEY_SKY:
        s->has_sky = true;
        return cli_parse_color(name, value, o->sky);
    case KEY_BACKGROUND:
        s->transparent = strcmp(value, "none") == 0;
        return cli_parse_color(name, s->transparent ? "0,0,0" : value, o->background);
    case KEY_EXPOSURE:
        return cli_parse_number(name, value, -20.0, 20.0, &s->exposure);
    case KEY_SHAFTS:
        return cli_parse_number(name, value, 0.0, 100.0, &o->shafts);
    case KEY_SHAFT_STEPS:
        return cli_parse_integer(name, value, 1, 64, &o->shaft_steps);
    case KEY_LIGHTMAP:
        if (s->lightmap_count == MOST_LIGHTMAPS) {
            return cli_usage("--lightmap '%s': at most %d are taken", value, MOST_LIGHTMAPS);
        }
        s->lightmaps[s->lightmap_count++] = value;
        return CLI_OK;
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
}

/* --- the picture and its file */

/* Floats of a pixel: colour, alpha, depth, normal; and those that a file is made of, which are R, G, B and A
 * of 8 bits, or colour and normal of a file of floats. */
enum { FLOATS = 8, ENCODED = 4, SPLIT = 6 };

static const char *const plane_names[FLOATS] = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"};

/* Formats of floats have linear values; all others are for the eye. */
static bool is_linear(const char *path) {
    return cli_has_ending(path, "exr hdr rgbe");
}

static uint64_t count_picture_bytes(const render_settings *s) {
    const uint64_t pixels = (uint64_t)s->options.width * (uint64_t)s->options.height;
    return pixels * (FLOATS + (is_linear(s->bake.output) ? SPLIT : ENCODED)) * sizeof(float);
}

/* The file's options and, but for the planes, what it holds. */
static vsh_image describe_image(const render_settings *s, vsh_image_options *as) {
    const bool linear = is_linear(s->bake.output);
    *as = vsh_image_options_default();
    as->bits = linear ? 0 : 8;
    as->color_space = linear ? VSH_COLOR_AUTO : VSH_COLOR_ENCODED;
    const int32_t channels = linear && cli_has_ending(s->bake.output, "exr") ? FLOATS
                             : linear || s->transparent                      ? 4
                                                                             : 3;
    return (vsh_image){s->options.width, s->options.height, channels, plane_names, NULL, NULL};
}

/* --- checks */

/* Refuses options that contradict each other, and an output that no picture can go to. */
static int check_options(const render_settings *s) {
    const vsh_render_options *o = &s->options;
    vsh_error error;
    if (s->bake.output == NULL) {
        return cli_usage("render: no output; give -o OUT");
    }
    if (s->has_look_at && !s->has_camera) {
        return cli_usage("--look-at: there is no --camera");
    }
    if (s->transparent && o->shafts > 0.0) {
        return cli_usage("--background none: not with --shafts, which lie before it");
    }
    if (s->pack != NULL && s->lightmap_count == 0) {
        return cli_usage("--lightmap-pack: there is no --lightmap");
    }
    if (o->width > VSH_MAX_PICTURE_SIZE || o->height > VSH_MAX_PICTURE_SIZE) {
        return cli_usage("--size %dx%d: expected at most %d pixels a side", o->width, o->height,
                         VSH_MAX_PICTURE_SIZE);
    }
    if (s->has_camera && s->has_look_at) {
        CLI_TRY(cli_check(vsh_camera_check(&o->camera, &error), &error));
    }
    for (size_t i = 0; i < s->lightmap_count; ++i) {
        CLI_TRY(cli_check_apart(s->bake.output, s->lightmaps[i], "also a lightmap"));
    }
    vsh_image_options as;
    const vsh_image image = describe_image(s, &as);
    return cli_check(vsh_image_check(s->bake.output, &image, &as, &error), &error);
}

/* Refuses what the scene tells before its files are read. */
static int check_files(const render_settings *s, const vsh_scene *scene) {
    CLI_TRY(cli_bake_check_files(&s->bake, scene));
    if (scene->light_count == 0 && !scene->ao && s->lightmap_count == 0) {
        return cli_usage("%s: no lights and no ao; give --sun X,Y,Z or --ao DISTANCE, or both",
                         s->bake.input);
    }
    return CLI_OK;
}

typedef struct render_lightmap {
    vsh_image_file *file;
    vsh_image image;
    float *linear;                          /* R, G and B of an sRGB file; else NULL */
    const float *decoded[VSH_MAX_CHANNELS]; /* planes of such a file */
    const char *names[VSH_MAX_CHANNELS];    /* these two of an image that was unpacked */
    const float *planes[VSH_MAX_CHANNELS];
} render_lightmap;

/* Everything in the picture. */
typedef struct render_shown {
    vsh_surface *surfaces; /* [count]: of casters without triangles */
    size_t count;
    vsh_occluders *own; /* fields of the surfaces whose colours share a layer */
    render_lightmap *maps;
    size_t map_count;
    vsh_lit_meshes *lit; /* [lit_count]: receivers with lightmaps, and behind them casters with triangles */
    size_t lit_count;
} render_shown;

/* --- casters
 *
 * Casters with triangles are shown as these, the others as a field for each colour. A layer's casters share
 * one field, which knows no casters. If they differ in colour, or some have triangles, each colour gets a
 * field of its own, for camera rays alone. */

static const double default_color = 0.6; /* so that full light is not white */

/* Whether a caster is shown as its triangles. */
static bool is_shown_as_mesh(const vsh_assets *assets, size_t index) {
    size_t count = 0;
    vsh_assets_caster(assets, index, &count);
    return count > 0;
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
static void find_groups(const cli_shading *shading, split *p, render_shown *shown) {
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

/* Adds the triangles of every caster that has them, and for the others a surface for every layer's colour. */
static int add_casters(const cli_shading *shading, render_shown *shown) {
    const size_t count = shading->scene->caster_count;
    split p = {.casters = calloc(count, sizeof *p.casters),
               .layers = calloc(count, sizeof *p.layers),
               .first = calloc(count, sizeof *p.first)};
    shown->surfaces = calloc(count, sizeof *shown->surfaces);
    for (size_t i = 0; i < count; ++i) {
        if (is_shown_as_mesh(shading->assets, i)) {
            vsh_lit_meshes *lit = &shown->lit[shown->lit_count++];
            lit->meshes = vsh_assets_caster(shading->assets, i, &lit->mesh_count);
            find_color(&shading->scene->casters[i], lit->color);
        }
    }
    find_groups(shading, &p, shown);
    const int code = p.count > 0 ? make_fields(shading, &p, shown) : CLI_OK;
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
static void decode(render_lightmap *map) {
    const vsh_image read = map->image;
    const size_t texels = (size_t)read.width * (size_t)read.height;
    map->linear = malloc(3 * texels * sizeof *map->linear);
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
}

static int read_lightmap(const render_settings *s, const char *path, const vsh_run *run,
                         render_lightmap *map) {
    vsh_error error;
    CLI_TRY(cli_check(vsh_image_read(path, run, &map->file, &error), &error));
    map->image = vsh_image_view(map->file);
    if (says_srgb(map->file)) {
        decode(map);
    }
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

/* Reads the lightmaps of the scene's first receivers. */
static int read_lightmaps(const render_settings *s, const cli_shading *shading, render_shown *shown) {
    const vsh_scene *scene = shading->scene;
    const size_t count = s->lightmap_count;
    if (count > scene->receiver_count) {
        return cli_usage("--lightmap '%s': %s has %zu receivers", s->lightmaps[scene->receiver_count],
                         s->bake.input, scene->receiver_count);
    }
    shown->maps = calloc(count + 1, sizeof *shown->maps);
    shown->lit = calloc(count + scene->caster_count + 1, sizeof *shown->lit);
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

static void free_shown(render_shown *shown) {
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

/* Adds the vertices that the mesh's triangles use, in the world. */
static void add_vertices(const vsh_mesh *mesh, double *points, size_t *count) {
    static const double identity[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    const double *t = mesh->transform != NULL ? mesh->transform : identity;
    bool *used = calloc(mesh->vertex_count + 1, sizeof *used);
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
    size_t room = 8 * seen->count + 1;
    for (size_t i = 0; i < seen->lit_count; ++i) {
        for (size_t m = 0; m < seen->lit[i].mesh_count; ++m) {
            room += seen->lit[i].meshes[m].vertex_count;
        }
    }
    double *points = malloc(3 * room * sizeof *points);
    *count = 0;
    for (size_t i = 0; i < seen->count; ++i) {
        add_box(seen->surfaces[i].field, points, count);
    }
    for (size_t i = 0; i < seen->lit_count; ++i) {
        for (size_t m = 0; m < seen->lit[i].mesh_count; ++m) {
            add_vertices(&seen->lit[i].meshes[m], points, count);
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

/* Places the camera as the settings say, or so that all of `seen` is in view. */
static int place_camera(const render_settings *s, const render_shown *seen, vsh_camera *camera) {
    const vsh_camera given = s->options.camera;
    const double aspect = (double)s->options.width / (double)s->options.height;
    vsh_error error;
    size_t count;
    double *points = find_points(seen, &count);
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

/* --- the command */

typedef struct render_work {
    const render_settings *settings;
    cli_shading shading;
    render_shown shown;
    vsh_render_options options;
    float *memory; /* of the picture */
} render_work;

static int load(render_work *work) {
    CLI_TRY(cli_shading_load(&work->shading));
    const double start = vshi_seconds();
    CLI_TRY(read_lightmaps(work->settings, &work->shading, &work->shown));
    cli_stats_stage(&work->shading.stats, CLI_STAGE_LOAD, start);
    return CLI_OK;
}

static int make_occluders(render_work *work) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = 0;
    for (size_t i = 0; i < work->shading.scene->caster_count;
         ++i) { /* casters without triangles show their field */
        what.voxels = what.voxels || !is_shown_as_mesh(work->shading.assets, i);
    }
    CLI_TRY(cli_shading_cast(&work->shading, &what));
    const double start = vshi_seconds();
    const int code = add_casters(&work->shading, &work->shown);
    cli_stats_stage(&work->shading.stats, CLI_STAGE_FIELD, start);
    return code;
}

static int set_options(render_work *work) {
    const render_settings *s = work->settings;
    const vsh_scene *scene = work->shading.scene;
    vsh_render_options *o = &work->options;
    *o = s->options;
    o->ao = scene->ao;
    for (int c = 0; c < 3 && !s->has_sky; ++c) {
        o->sky[c] = scene->has_ambient        ? scene->ambient[c]
                    : scene->light_count == 0 ? 1.0 /* all the light there is */
                                              : o->sky[c];
    }
    o->tint = scene->tint;
    o->shade = scene->shade;
    if (!scene->ao) {
        o->shade.ao_method = VSH_AO_AUTO; /* no rays are cast: exact may lack its triangles */
    }
    o->lit = work->shown.lit;
    o->lit_count = work->shown.lit_count;
    return place_camera(s, &work->shown, &o->camera);
}

/* The file of a message that begins with "lightmap N: ", as vsh_render() counts them; else NULL. */
static const char *lightmap_named(const render_settings *s, const char *message) {
    size_t index;
    return sscanf(message, "lightmap %zu: ", &index) == 1 && index < s->lightmap_count ? s->lightmaps[index]
                                                                                       : NULL;
}

/* Encodes the picture, or splits the triples of its colour and normal into planes, which stand behind it. */
static int write_picture(const render_work *work, const vsh_picture *p) {
    const render_settings *s = work->settings;
    const size_t pixels = (size_t)s->options.width * (size_t)s->options.height;
    const bool linear = is_linear(s->bake.output);
    float *made[SPLIT] = {NULL};
    for (size_t c = 0; c < (linear ? SPLIT : ENCODED); ++c) {
        made[c] = work->memory + (FLOATS + c) * pixels;
    }
    for (size_t i = 0; i < 3 * pixels && linear; ++i) {
        made[i % 3][i / 3] = p->color[i];
        made[3 + i % 3][i / 3] = p->normal[i];
    }
    vsh_error error;
    CLI_TRY(linear ? CLI_OK
                   : cli_check(vsh_picture_encode(p, s->options.width, s->options.height, s->exposure, made,
                                                  s->transparent ? made[3] : NULL, &error),
                               &error));
    const float *planes[FLOATS] = {made[0],  made[1], made[2], linear ? p->alpha : made[3],
                                   p->depth, made[3], made[4], made[5]};
    vsh_image_options as;
    vsh_image image = describe_image(s, &as);
    image.planes = planes;
    as.attributes = work->shading.origin.attributes;
    as.attribute_count = work->shading.origin.count;
    return cli_check(vsh_image_write(s->bake.output, &image, &as, &error), &error);
}

static int draw_picture(render_work *work) {
    const render_settings *s = work->settings;
    const render_shown *shown = &work->shown;
    cli_shading *shading = &work->shading;
    const vsh_scene *scene = shading->scene;
    const size_t pixels = (size_t)s->options.width * (size_t)s->options.height;
    work->memory = calloc(count_picture_bytes(s), 1);
    const vsh_picture picture = {.color = work->memory,
                                 .alpha = work->memory + 3 * pixels,
                                 .depth = work->memory + 4 * pixels,
                                 .normal = work->memory + 5 * pixels};
    double start = vshi_seconds();
    vsh_error error;
    const vsh_result result =
        vsh_render(shown->surfaces, shown->count, shading->occluders, scene->lights, scene->light_count,
                   &work->options, &shading->run, &picture, &shading->stats.shade, &error);
    start = cli_stats_stage(&shading->stats, CLI_STAGE_BAKE, start);
    if (result != VSH_OK) {
        return cli_fail_of(lightmap_named(s, error.message), &error);
    }
    shading->stats.points += (uint64_t)pixels * (uint64_t)(s->options.samples * s->options.samples);
    CLI_TRY(write_picture(work, &picture));
    cli_stats_stage(&shading->stats, CLI_STAGE_WRITE, start);
    return CLI_OK;
}

/* Lightmaps and the file of --lights are inputs too. */
static int find_origin(render_work *work) {
    const render_settings *s = work->settings;
    cli_shading *shading = &work->shading;
    const char *files[2 + MOST_LIGHTMAPS] = {s->bake.input, cli_bake_lights(&s->bake)};
    memcpy(files + 2, s->lightmaps, s->lightmap_count * sizeof *files);
    return cli_provenance_make(shading->scene, files, 2 + s->lightmap_count, &shading->stats.casters,
                               &shading->run, &shading->origin);
}

static void say_results(const render_work *work) {
    const cli_stats *stats = &work->shading.stats;
    const vsh_render_options *o = &work->options;
    if (stats->shade.unfinished > 0) {
        cli_warn("%" PRIu64 " rays ran out of steps; use larger voxels", stats->shade.unfinished);
    }
    const double *at = o->camera.position, *to = o->camera.target;
    cli_say("%s: %d × %d, camera %.5g,%.5g,%.5g looking at %.5g,%.5g,%.5g", work->settings->bake.output,
            o->width, o->height, at[0], at[1], at[2], to[0], to[1], to[2]);
    cli_stats_say(stats);
}

static int run_render(const render_settings *s, vsh_scene *scene) {
    render_work work = {.settings = s, .shading = cli_shading_begin(scene, CLI_STATS_POINTS)};
    vsh_error error;
    int code;
    CLI_TRY_DONE(cli_check(
        vshi_check_limit(&work.shading.run, (double)count_picture_bytes(s), s->bake.output, &error), &error));
    work.shading.run.memory_held += count_picture_bytes(s);
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(make_occluders(&work));
    CLI_TRY_DONE(set_options(&work));
    CLI_TRY_DONE(find_origin(&work));
    CLI_TRY_DONE(draw_picture(&work));
    CLI_TRY_DONE(cli_stats_finish(&work.shading.stats, &work.shading.run, s->bake.stats));
    if (!cli_given.quiet) {
        say_results(&work);
    }
done:
    free(work.memory);
    free_shown(&work.shown);
    cli_shading_free(&work.shading);
    return code;
}

static int render_main(int argc, char **argv) {
    render_settings s = {.options = vsh_render_options_default()};
    for (int c = 0; c < 3; ++c) { /* grey, so that no light or shadow looks coloured */
        s.options.sky[c] = 0.3;
        s.options.background[c] = 0.1;
    }
    CLI_TRY(cli_parse(&cli_render, argc, argv, parse_option, &s, &s.bake.input));
    CLI_TRY(cli_patch_check(&s.bake.patch));
    CLI_TRY(check_options(&s));
    cli_bake_scene made;
    int code;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    if (s.lightmap_count > 0) {
        CLI_TRY_DONE(cli_bake_scene_receivers(&s.bake, &made));
    }
    CLI_TRY_DONE(check_files(&s, &made.scene));
    cli_signals_watch();
    code = run_render(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}

const cli_command cli_render = {
    "render",
    "INPUT -o OUT [options]",
    "Draws a picture of INPUT, a mesh file, a level set (FILE.vdb, FILE.vdb:GRID) or a scene (.json),\n"
    "with the shadows and AO that bake would give: for looking at a scene or a lightmap. No materials but\n"
    "a caster's color; docs/view.md says more. Numbers in brackets are the defaults.",
    options,
    sizeof options / sizeof options[0],
    render_main};
