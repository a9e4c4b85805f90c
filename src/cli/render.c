/* vdbshade render: pictures of a scene, to look at what bake makes of it. */
#include "bake/bake.h"
#include "base/memory.h"
#include "base/vec.h"

enum { MOST_LIGHTMAPS = 64 };

typedef struct render_settings {
    cli_bake_settings bake;     /* the scene, the output and the stats */
    vsh_render_options options; /* settings that scenes do not have */
    int32_t size[2];
    double fov_deg, orbit_deg, exposure;
    cli_list lightmaps;
    bool transparent;
} render_settings;

static int parse_background(void *at, const char *name, const char *value) {
    render_settings *s = at;
    double *color = s->options.background;
    s->transparent = strcmp(value, "none") == 0;
    const bool good = cli_read_numbers(s->transparent ? "0,0,0" : value, 3, color);
    return good && color[0] >= 0.0 && color[1] >= 0.0 && color[2] >= 0.0
               ? CLI_OK
               : cli_usage("%s '%s': expected none or R,G,B, three numbers from 0", name, value);
}

static const cli_option options[] = {
    {.help = "Picture"},
    {"output", "OUT",
     "image to write: .exr has linear R G B, A, Z and N.X N.Y N.Z; others are sRGB of 8 bits",
     CLI_VALUE(TEXT, render_settings, bake.output)},
    {"size", "W[xH]", "pixels, 1 to 16384 (1280x720)", CLI_VALUE(SIZE, render_settings, size)},
    {"samples", "N", "N x N rays a pixel, 1 to 16 (3)",
     CLI_RANGE(INTEGER, render_settings, options.samples, 1, 16)},
    {"exposure", "STOPS", "colours of 8-bit pictures times 2^STOPS, -20 to 20 (0)",
     CLI_RANGE(NUMBER, render_settings, exposure, -20.0, 20.0)},
    CLI_STATS_OPTION(render_settings, bake.stats),
    {.help = "Camera"},
    {"camera", "X,Y,Z", "its position (chosen so that all casters are in view)",
     CLI_VALUE(POINT, render_settings, options.camera.position)},
    {"look-at", "X,Y,Z", "the point it looks at (the middle of the casters' box)",
     CLI_VALUE(POINT, render_settings, options.camera.target)},
    {"up", "X,Y,Z", "the way up (0,1,0)", CLI_VALUE(VECTOR, render_settings, options.camera.up)},
    {"fov", "DEG", "angle over the picture's height, 0.1 to 170 (35)",
     CLI_RANGE(NUMBER, render_settings, fov_deg, 0.1, 170.0)},
    {"orbit", "DEG", "turn it by this angle around the point it looks at (0)",
     CLI_RANGE(NUMBER, render_settings, orbit_deg, -1e6, 1e6)},
    {.help = "Light"},
    CLI_LIGHT_OPTIONS,
    {"sky", "R,G,B",
     "light of the open sky, linear (the scene's ambient, or 0.3,0.3,0.3; 1,1,1 if there are no lights)",
     CLI_VALUE(COLOR, render_settings, options.sky)},
    {"background", "R,G,B", "colour behind everything, linear (0.1,0.1,0.1); none: transparent",
     CLI_PARSED(render_settings, bake, parse_background)},
    {"shafts", "STRENGTH",
     "light shafts: thickness of a fog around the casters, 0 to 100 (0: none; 0.3 is much)",
     CLI_RANGE(NUMBER, render_settings, options.shafts, 0.0, 100.0)},
    {"shaft-steps", "N", "points on a ray where shafts are computed, 1 to 64 (8)",
     CLI_RANGE(INTEGER, render_settings, options.shaft_steps, 1, 64)},
    {"lightmap", "FILE.exr",
     "show the receiver with this lightmap, whose values replace computed ones; again for the scene's next "
     "receivers",
     CLI_RANGE(LIST, render_settings, lightmaps, 0, MOST_LIGHTMAPS)},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

/* --- the picture and its file */

/* FLOATS: of a pixel: colour, alpha, depth and normal. Writing needs more: ENCODED for R, G, B and A of 8
 * bits, or SPLIT for the planes of colour and normal in a file of floats. */
enum { FLOATS = 8, ENCODED = 4, SPLIT = 6 };

static const char *const plane_names[FLOATS] = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"};

/* Formats of floats have linear values; all others are for the eye. */
static bool is_linear(const char *path) {
    return cli_has_ending(path, "exr hdr");
}

static uint64_t count_picture_bytes(const render_settings *s) {
    const uint64_t pixels = (uint64_t)s->options.width * (uint64_t)s->options.height;
    return pixels * (FLOATS + (is_linear(s->bake.output) ? SPLIT : ENCODED)) * sizeof(float);
}

/* Returns the image without its planes, and stores the file's options. */
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

/* --- options */

/* Refuses options that contradict each other or do not fit the output, and sets what follows from them. */
static int set_options(render_settings *s) {
    vsh_render_options *o = &s->options;
    o->width = s->size[0];
    o->height = s->size[1];
    if (cli_was_given("fov")) {
        o->camera.fov = s->fov_deg * CLI_DEGREE;
    }
    CLI_REFUSE_IF(s->bake.output == NULL, "render: no output; give -o OUT");
    CLI_REFUSE_IF(cli_was_given("look-at") && !cli_was_given("camera"), "--look-at: needs --camera X,Y,Z");
    CLI_REFUSE_IF(s->transparent && o->shafts > 0.0,
                  "--background none: not with --shafts, which would cover it");
    CLI_REFUSE_IF(o->width > VSH_MAX_PICTURE_SIZE || o->height > VSH_MAX_PICTURE_SIZE,
                  "--size %dx%d: expected at most %d pixels a side", o->width, o->height,
                  VSH_MAX_PICTURE_SIZE);
    if (cli_was_given("look-at")) {
        CLI_TRY(cli_check(vsh_camera_orbit(&o->camera, 0.0, &cli_error)));
    }
    vsh_image_options as;
    const vsh_image image = describe_image(s, &as);
    return cli_check(vsh_image_check(s->bake.output, &image, &as, &cli_error));
}

typedef struct render_lightmap {
    vsh_image_file *file;
    vsh_image image; /* a view of it */
} render_lightmap;

/* Everything in the picture. */
typedef struct render_shown {
    vsh_surface *surfaces; /* [count]: of casters without triangles */
    size_t count;
    vsh_occluders *own; /* fields of the surfaces whose colours share a layer */
    render_lightmap *maps;
    size_t map_count;
    vsh_lit_meshes *lit; /* [lit_count]: receivers with lightmaps, then casters with triangles */
    size_t lit_count;
} render_shown;

/* --- casters
 *
 * Casters with triangles are shown as triangles, the others as a field for each colour. A layer's casters
 * share one field, which cannot tell them apart. If they differ in colour, or some have triangles, each
 * colour gets a field of its own, for camera rays alone. */

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

/* Whether all casters of its layer look like this one and lack triangles, so that the layer's field shows
 * them. */
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

/* Sorts casters without triangles into groups. A group is shown by a field of the scene if that has no other
 * casters, else as a layer of its own. */
static void find_groups(const cli_shading *shading, split *p, render_shown *shown) {
    const vsh_scene *scene = shading->scene;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        const vsh_field *field = vsh_occluders_get_field(shading->occluders, caster->layer);
        p->casters[i] = *caster;
        p->casters[i].direct = 0;
        p->casters[i].voxelised = 1;
        if (is_shown_as_mesh(shading->assets, i)) {
            p->casters[i].layer = "mesh"; /* a layer that is not made */
            continue;
        }
        size_t group = 0; /* the first caster without triangles that is like it */
        while (is_shown_as_mesh(shading->assets, group) || !is_alike(&scene->casters[group], caster)) {
            ++group;
        }
        p->casters[i].layer = cli_keep_text("%zu", group);
        if (group == i && is_plain(scene, shading->assets, caster)) {
            add_surface(shown, field, caster);
        } else if (group == i) {
            vsh_field_info info = {.voxel_size = 0.0}; /* the scene's, or by its resolution */
            if (!cli_caster_is_direct(caster)) {
                vsh_field_get_info(field, &info);
            }
            p->first[p->count] = i;
            vsh_scene_layer *layer = &p->layers[p->count++];
            *layer = vsh_scene_layer_default();
            layer->name = p->casters[i].layer;
            layer->voxel_size = info.voxel_size;
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
    int code;
    if (direct) {
        CLI_TRY_DONE(cli_check_input(vsh_assets_load(&colored, &cli_run, &again, &cli_error)));
    }
    CLI_TRY_DONE(cli_check_input(vsh_scene_occluders(&colored, direct ? again : shading->assets, &what,
                                                     &cli_run, &shown->own, &cli_error)));
    for (size_t k = 0; k < p->count; ++k) {
        add_surface(shown, vsh_occluders_get_field(shown->own, p->layers[k].name), &p->casters[p->first[k]]);
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

/* Returns the caster of a file; NULL if there is none. */
static const vsh_caster *find_caster(const vsh_scene *scene, const char *path) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (scene->casters[i].path != NULL && strcmp(scene->casters[i].path, path) == 0) {
            return &scene->casters[i];
        }
    }
    return NULL;
}

/* Reads the lightmaps of the scene's first receivers. */
static int read_lightmaps(const render_settings *s, const cli_shading *shading, render_shown *shown) {
    const vsh_scene *scene = shading->scene;
    const size_t count = s->lightmaps.count;
    CLI_REFUSE_IF(count > scene->receiver_count, "--lightmap '%s': %s has %zu receivers",
                  s->lightmaps.text[scene->receiver_count], s->bake.input, scene->receiver_count);
    shown->maps = calloc(count + 1, sizeof *shown->maps);
    shown->lit = calloc(count + scene->caster_count + 1, sizeof *shown->lit);
    shown->map_count = shown->lit_count = count;
    for (size_t i = 0; i < count; ++i) {
        vsh_lit_meshes *lit = &shown->lit[i];
        render_lightmap *map = &shown->maps[i];
        const char *path = s->lightmaps.text[i];
        CLI_REFUSE_IF(!cli_has_ending(path, "exr"),
                      "--lightmap '%s': expected an .exr; other formats do not name their channels", path);
        CLI_TRY(cli_check(vsh_image_read(path, &cli_run, &map->file, &cli_error)));
        map->image = vsh_image_view(map->file);
        lit->meshes = vsh_assets_receiver(shading->assets, i, &lit->mesh_count);
        lit->lightmap = &map->image;
        lit->ambient = scene->has_ambient;
        find_color(find_caster(scene, scene->receivers[i].path), lit->color);
    }
    return CLI_OK;
}

static void free_shown(render_shown *shown) {
    for (size_t i = 0; i < shown->map_count; ++i) {
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
    bool *used = calloc(mesh->vertex_count + 1, sizeof *used);
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        used[mesh->indices[i]] = true;
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const vshi_vec at = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
        vshi_vec_to_doubles(at, points + 3 * *count);
        *count += used[v] && vshi_finite(at);
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

/* Places the camera as the settings say, or so that all of `seen` is in view. */
static int place_camera(render_settings *s, const render_shown *seen) {
    const vsh_camera given = s->options.camera;
    const double aspect = (double)s->options.width / (double)s->options.height;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    vsh_camera *camera = &s->options.camera;
    size_t count;
    double *points = find_points(seen, &count);
    for (size_t i = 0; i < 3 * count; ++i) {
        low[i % 3] = fmin(low[i % 3], points[i]);
        high[i % 3] = fmax(high[i % 3], points[i]);
    }
    const bool near =
        s->orbit_deg == 0.0 && !cli_was_given("camera"); /* else all is in view from any angle */
    const vsh_result result =
        near ? vsh_camera_frame_points(camera, count, points, azimuth, elevation, aspect, &cli_error)
             : vsh_camera_frame(camera, low, high, azimuth, elevation, aspect, &cli_error);
    free(points);
    CLI_TRY(cli_check(result));
    if (cli_was_given("camera")) {
        memcpy(camera->position, given.position, sizeof camera->position);
    }
    if (cli_was_given("look-at")) {
        memcpy(camera->target, given.target, sizeof camera->target);
    }
    const double turn = near ? 0.0 : s->orbit_deg * CLI_DEGREE;
    return cli_check(vsh_camera_orbit(camera, turn, &cli_error));
}

/* --- the command */

typedef struct render_work {
    render_settings *settings;
    cli_shading shading;
    render_shown shown;
    float *memory; /* of the picture */
} render_work;

static int complete_options(render_work *work) {
    render_settings *s = work->settings;
    const vsh_scene *scene = work->shading.scene;
    vsh_render_options *o = &s->options;
    o->ao = scene->ao;
    for (int c = 0; c < 3 && !cli_was_given("sky"); ++c) {
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
    return place_camera(s, &work->shown);
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
    CLI_TRY(linear ? CLI_OK
                   : cli_check(vsh_picture_encode(p, s->options.width, s->options.height, s->exposure, made,
                                                  s->transparent ? made[3] : NULL, &cli_error)));
    const float *planes[FLOATS] = {made[0],  made[1], made[2], linear ? p->alpha : made[3],
                                   p->depth, made[3], made[4], made[5]};
    vsh_image_options as;
    vsh_image image = describe_image(s, &as);
    image.planes = planes;
    as.attributes = work->shading.origin.attributes;
    as.attribute_count = work->shading.origin.count;
    return cli_check(vsh_image_write(s->bake.output, &image, &as, &cli_error));
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
    if (vsh_render(shown->surfaces, shown->count, shading->occluders, scene->lights, scene->light_count,
                   &s->options, &cli_run, &picture, &shading->stats.shade, &cli_error) != VSH_OK) {
        size_t map; /* N of "lightmap N: …" */
        const bool named = sscanf(cli_error.message, "lightmap %zu: ", &map) == 1 && map < s->lightmaps.count;
        return cli_fail_with(named ? s->lightmaps.text[map] : NULL);
    }
    cli_stats_lap(&shading->stats, CLI_STAGE_BAKE);
    shading->stats.points += (uint64_t)pixels * (uint64_t)(s->options.samples * s->options.samples);
    CLI_TRY(write_picture(work, &picture));
    cli_stats_lap(&shading->stats, CLI_STAGE_WRITE);
    return CLI_OK;
}

static int run_render(render_settings *s, render_work *work) {
    cli_shading *shading = &work->shading;
    const char *inputs[2 + MOST_LIGHTMAPS] = {s->bake.input, cli_bake_lights(&s->bake)};
    const char *const outputs[] = {s->bake.output, s->bake.stats};
    const size_t input_count = 2 + s->lightmaps.count;
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    memcpy(inputs + 2, s->lightmaps.text, s->lightmaps.count * sizeof *inputs);
    CLI_TRY(cli_shading_begin(shading, &s->bake, CLI_STATS_POINTS));
    CLI_TRY(s->lightmaps.count > 0 ? cli_bake_scene_receivers(&s->bake, &shading->made) : CLI_OK);
    CLI_TRY(cli_check_outputs(outputs, CLI_COUNT(outputs), inputs, input_count, shading->scene));
    CLI_REFUSE_IF(shading->scene->light_count == 0 && !shading->scene->ao && s->lightmaps.count == 0,
                  "%s: no lights and no ao; give --sun X,Y,Z or --ao DISTANCE, or both", s->bake.input);
    CLI_TRY(
        cli_check(vshi_check_limit(&cli_run, (double)count_picture_bytes(s), s->bake.output, &cli_error)));
    cli_run.memory_held += count_picture_bytes(s);
    cli_signals_watch();
    CLI_TRY(cli_shading_load(shading));
    CLI_TRY(read_lightmaps(s, shading, &work->shown));
    cli_stats_lap(&shading->stats, CLI_STAGE_LOAD);
    for (size_t i = 0; i < shading->scene->caster_count; ++i) { /* show a field if there are no triangles */
        what.voxels = what.voxels || !is_shown_as_mesh(shading->assets, i);
    }
    CLI_TRY(cli_shading_cast(shading, &what));
    CLI_TRY(add_casters(shading, &work->shown));
    cli_stats_lap(&shading->stats, CLI_STAGE_FIELD);
    CLI_TRY(complete_options(work));
    CLI_TRY(
        cli_provenance_make(shading->scene, inputs, input_count, &shading->stats.casters, &shading->origin));
    CLI_TRY(draw_picture(work));
    CLI_TRY(cli_stats_finish(&shading->stats, s->bake.stats));
    if (shading->stats.shade.unfinished > 0) {
        cli_warn("%" PRIu64 " rays ran out of steps; use larger voxels", shading->stats.shade.unfinished);
    }
    const double *at = s->options.camera.position, *to = s->options.camera.target;
    cli_inform("%s: %d × %d, camera %.5g,%.5g,%.5g looking at %.5g,%.5g,%.5g", s->bake.output,
               s->options.width, s->options.height, at[0], at[1], at[2], to[0], to[1], to[2]);
    cli_stats_say(&shading->stats);
    return CLI_OK;
}

static int render_main(int argc, char **argv) {
    render_settings s = {.options = vsh_render_options_default(), .size = {1280, 720}};
    render_work work = {.settings = &s};
    for (int c = 0; c < 3; ++c) { /* grey, so that no light or shadow looks coloured */
        s.options.sky[c] = 0.3;
        s.options.background[c] = 0.1;
    }
    CLI_TRY(cli_parse(&cli_render, argc, argv, &s, &s.bake.input));
    CLI_TRY(set_options(&s));
    const int code = run_render(&s, &work);
    free(work.memory);
    free_shown(&work.shown);
    cli_shading_free(&work.shading);
    return code;
}

const cli_command cli_render = {
    "render", "INPUT -o OUT [options]", "picture of a scene, to look at a bake",
    "Draws a picture of INPUT, a mesh file, a level set (FILE.vdb, FILE.vdb:GRID) or a scene (.json),\n"
    "with the shadows and AO that bake would give: for looking at a scene or a lightmap. It shows no\n"
    "materials but a caster's color; docs/view.md says more. Numbers in brackets are defaults.",
    CLI_ENDING(options, render_main)};
