/* vdbshade info: what a file holds, and what is wrong with it. */
#include "base/vec.h"
#include "cli.h"

#include <stdarg.h>

#define IMAGE_ENDINGS "exr png tif tiff jpg jpeg hdr tga bmp webp psd pgm ppm pnm pfm gif jp2 dds heic avif"

typedef struct info_settings {
    int32_t size[2]; /* texels of the lightmap that UVs are checked in */
    double unit;     /* as in vsh_scene */
    bool json;
} info_settings;

static const cli_option options[] = {
    {.help = "Options"},
    {"json", NULL, "print the same facts as one JSON object", CLI_VALUE(FLAG, info_settings, json)},
    {"size", "W[xH]", "texels of the lightmap that UVs are checked in and options suggested for (1024)",
     CLI_VALUE(SIZE, info_settings, size)},
    CLI_VERBOSE_OPTION("a paragraph for each mesh, however many there are"),
    {"unit", CLI_SETTING},
    CLI_READER_OPTIONS,
    CLI_HELP_OPTION,
};

/* --- facts, as lines of text or as values of JSON */

static bool as_json;

/* Prints a line, or adds the value to an object or (without a key) to an array. */
static void __attribute__((format(printf, 4, 5)))
state(json_t *to, const char *key, json_t *value, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    if (!as_json) {
        vprintf(format, arguments);
        json_decref(value);
    } else if (key != NULL) {
        json_object_set_new(to, key, value);
    } else {
        json_array_append_new(to, value);
    }
    va_end(arguments);
}

/* Adds an empty array or object to an object. */
static json_t *add(json_t *to, const char *key, json_t *empty) {
    json_object_set_new(to, key, empty);
    return empty;
}

/* Prints "problem: TEXT" after `lead`, or adds the text to the array "problems"; likewise notes. */
static void __attribute__((format(printf, 4, 5)))
complain(json_t *to, const char *lead, const char *kind, const char *format, ...) {
    char text[1024], key[16];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    snprintf(key, sizeof key, "%ss", kind);
    json_t *list = json_object_get(to, key);
    state(list != NULL ? list : add(to, key, json_array()), NULL, cli_utf8_json(text), "%s%s: %s\n", lead,
          kind, text);
}

static void count_problem(json_t *to, size_t count, const char *what) {
    if (count > 0) {
        complain(to, "  ", "problem", "%zu %s", count, what);
    }
}

static void state_light(json_t *lights, const vsh_light *light) {
    char text[512];
    vsh_light_text(light, text, sizeof text);
    state(lights, NULL,
          json_pack("{s:o,s:o}", "name", cli_utf8_json(light->name), "light", cli_utf8_json(text)),
          "light '%s': %s\n", light->name, text);
}

static json_t *three(const double value[3]) {
    return json_pack("[f,f,f]", value[0], value[1], value[2]);
}

static json_t *size_of(int32_t width, int32_t height) {
    return json_pack("[i,i]", width, height);
}

/* --- bounds, and options that suit them */

static void state_bounds(json_t *to, const char *indent, const double low[3], const double high[3]) {
    state(to, "bounds", json_pack("[o,o]", three(low), three(high)), "%sbounds: %g %g %g to %g %g %g\n",
          indent, low[0], low[1], low[2], high[0], high[1], high[2]);
}

/* Share of a lightmap that charts cover: vsh_unwrap() covers 0.7 to 0.8 of 1024 × 1024 texels. */
static const double COVERED = 2.0 / 3.0;

/* Suggests options of `bake` for bounds, and for receivers of an area unless it is 0. */
static void suggest_options(json_t *root, const vsh_assets_info *of, const int32_t size[2]) {
    const double density = vshi_round_digits(sqrt(COVERED * size[0] * size[1] / of->area));
    if (of->ao_distance == 0.0) {
        return;
    }
    json_t *made = add(root, "suggested", json_object());
    state_bounds(root, "", of->bounds_min, of->bounds_max);
    state(made, "ao", json_real(of->ao_distance), "suggested: --ao %.10g%s", of->ao_distance,
          of->area > 0.0 ? "" : "  # a twelfth of the diagonal\n");
    if (of->area > 0.0) {
        state(made, "texels_per_unit", json_real(density), " --texels-per-unit %.10g", density);
        state(made, "size", size_of(size[0], size[1]),
              " --size %dx%d  # a twelfth of the diagonal; charts fill two thirds\n", size[0], size[1]);
    }
}

/* Loads a scene's files and states their size; false if they cannot be loaded. */
static bool state_size(json_t *root, vsh_scene *scene, const int32_t size[2]) {
    vsh_run quiet = cli_run;
    vsh_assets_info info;
    vsh_assets *assets;
    quiet.warning = NULL;
    if (vsh_assets_load(scene, &quiet, &assets, &cli_error) != VSH_OK) {
        return false;
    }
    vsh_assets_get_info(assets, &info);
    vsh_assets_free(assets);
    suggest_options(root, &info, size);
    return true;
}

/* --- images */

static void state_channel(json_t *channels, const char *name, const float *plane, size_t count) {
    double least = INFINITY, most = -INFINITY, sum = 0.0;
    size_t finite = 0;
    for (size_t i = 0; i < count; ++i) {
        if (isfinite(plane[i])) {
            least = fmin(least, (double)plane[i]);
            most = fmax(most, (double)plane[i]);
            sum += (double)plane[i];
            ++finite;
        }
    }
    const double mean = sum / (double)finite;
    const char *range =
        finite > 0 ? cli_keep_text("min %.6g, mean %.6g, max %.6g", least, mean, most) : "no finite value";
    json_t *channel =
        json_pack("{s:o,s:o,s:o,s:o}", "name", cli_utf8_json(name), "min", cli_number_json(least), "mean",
                  cli_number_json(mean), "max", cli_number_json(most));
    state(channels, NULL, json_incref(channel), "channel '%s': %s\n", name, range);
    count_problem(channel, count - finite, "values are not finite");
    json_decref(channel);
}

static int state_image(json_t *root, const char *path) {
    vsh_image_file *file = NULL;
    CLI_TRY(cli_check(vsh_image_read(path, &cli_run, &file, &cli_error)));
    const vsh_image image = vsh_image_view(file);
    state(root, "size", size_of(image.width, image.height), "image: %d × %d, %d channels\n", image.width,
          image.height, image.channel_count);
    json_t *channels = add(root, "channels", json_array()),
           *attributes = add(root, "attributes", json_object());
    for (int32_t i = 0; i < image.channel_count; ++i) {
        state_channel(channels, image.names[i], image.planes[i], (size_t)image.width * (size_t)image.height);
    }
    size_t count = 0;
    const vsh_attribute *all = vsh_image_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        state(attributes, all[i].name, cli_utf8_json(all[i].value), "%s: %s\n", all[i].name, all[i].value);
    }
    vsh_image_free(file);
    return CLI_OK;
}

/* --- level sets */

enum { MAX_LISTED = 4096 };

static void state_grid(json_t *grids, const vsh_vdb_entry *g) {
    const bool is_level_set = strcmp(g->grid_class, "level set") == 0;
    const char *band = "";
    json_t *grid = json_object();
    state(grid, "name", cli_utf8_json(g->name), "grid '%s'\n", g->name);
    state(grid, "type", cli_utf8_json(g->type), "  type: %s\n", g->type);
    state(grid, "class", cli_utf8_json(g->grid_class), "  class: %s\n", g->grid_class);
    state(grid, "voxel_size", three(g->voxel_size), "  voxel size: %g %g %g\n", g->voxel_size[0],
          g->voxel_size[1], g->voxel_size[2]);
    if (g->voxel_size[0] > 0.0 && is_level_set) {
        band = cli_keep_text(" (%.3g voxels)", fabs(g->background) / g->voxel_size[0]);
    }
    if (g->background != 0.0) {
        state(grid, "background", json_real(g->background), "  background: %g%s\n", g->background, band);
    }
    const int32_t *low = g->index_min, *high = g->index_max;
    state(grid, "active",
          json_pack("{s:I,s:[i,i,i],s:[i,i,i]}", "voxels", (json_int_t)g->active_voxels, "min", low[0],
                    low[1], low[2], "max", high[0], high[1], high[2]),
          "  active voxels: %" PRIu64 ", %d %d %d to %d %d %d\n", g->active_voxels, low[0], low[1], low[2],
          high[0], high[1], high[2]);
    state(grid, "bytes", json_integer((json_int_t)g->bytes), "  memory: %s\n", cli_bytes_text(g->bytes));
    json_t *attributes = add(grid, "attributes", json_object());
    for (const char *line = g->attributes; *line != '\0';) { /* NAME: VALUE */
        const int length = (int)strcspn(line, "\n"), name = (int)strcspn(line, ":\n");
        const char *value = cli_keep_text("%.*s", length - name, line + name);
        state(attributes, cli_keep_text("%.*s", name, line), cli_utf8_json(value + strspn(value, ": ")),
              "  %.*s\n", length, line);
        line += length + (line[length] != '\0');
    }
    if (strstr(g->attributes, "vdbshade_version") != NULL && !is_level_set) {
        state(grid, "baked", json_true(),
              "  holds: values that vdbshade baked, for lookups; it is not a caster\n");
    } else if (g->problem[0] != '\0') {
        complain(grid, "  ", g->mended != 0 ? "note" : "problem", "%s%s", g->problem,
                 g->mended != 0 ? ": its distances are made anew where it is used" : "");
    }
    json_array_append_new(grids, grid);
}

static int state_vdb(json_t *root, const char *path, const char *name, const int32_t size[2]) {
    vsh_vdb_entry *entries = calloc(MAX_LISTED, sizeof *entries);
    json_t *grids = add(root, "grids", json_array());
    size_t count = 0;
    int code = cli_check_input(vsh_vdb_list(path, &cli_run, entries, MAX_LISTED, &count, &cli_error));
    for (size_t i = 0; i < count && i < MAX_LISTED; ++i) {
        if (name == NULL || strcmp(entries[i].name, name) == 0) {
            state_grid(grids, &entries[i]);
        }
    }
    if (code == CLI_OK && name != NULL && json_array_size(grids) == 0) {
        code = cli_usage("%s: no grid '%s'; it holds '%s'%s", path, name, entries[0].name,
                         count > 1 ? " and others" : "");
    } else if (code == CLI_OK && count == 0) {
        complain(root, "", "problem", "no grids");
    } else if (count > MAX_LISTED && name == NULL) {
        state(root, "more_grids", json_integer((json_int_t)(count - MAX_LISTED)), "… and %zu more grids\n",
              count - MAX_LISTED);
    }
    free(entries);
    vsh_caster caster = vsh_caster_default();
    caster.type = VSH_CASTER_VDB;
    caster.path = path;
    caster.grid = name;
    if (code == CLI_OK) { /* grids that cannot cast state their problem above */
        state_size(root, &(vsh_scene){.casters = &caster, .caster_count = 1}, size);
    }
    return code;
}

/* --- scenes */

static void state_caster(json_t *casters, const vsh_caster *caster, size_t index) {
    static const char *const types[] = {"mesh", "sdf", "vdb", "heightfield", "spheres", "mask", "text"};
    const char *path = caster->path, *grid = caster->grid, *layer = caster->layer,
               *type = types[caster->type];
    const char *file = path != NULL ? cli_keep_text(" %s", path) : "";
    file = grid != NULL ? cli_keep_text("%s, grid '%s'", file, grid) : file;
    file = layer != NULL ? cli_keep_text("%s, layer '%s'", file, layer) : file;
    state(casters, NULL,
          json_pack("{s:s,s:o,s:o,s:o}", "type", type, "file", cli_utf8_json(path), "grid",
                    cli_utf8_json(grid), "layer", cli_utf8_json(layer)),
          "caster %zu: %s%s\n", index, type, file);
}

static int state_scene(json_t *root, const char *path, const int32_t size[2]) {
    vsh_scene *scene = NULL;
    CLI_TRY(cli_check(vsh_scene_read(path, &cli_run, &scene, &cli_error)));
    if (!state_size(root, scene, size)) {
        complain(root, "", "problem", "%s", cli_error.message);
    }
    json_t *casters = add(root, "casters", json_array()), *layers = add(root, "layers", json_array());
    json_t *lights = add(root, "lights", json_array()), *receivers = add(root, "receivers", json_array());
    for (size_t i = 0; i < scene->caster_count; ++i) {
        state_caster(casters, &scene->casters[i], i);
    }
    for (size_t i = 0; i < scene->layer_count; ++i) {
        const vsh_scene_layer *layer = &scene->layers[i];
        const char *combine = vsh_get_name(VSH_NAMES_COMBINE, layer->combine);
        state(layers, NULL, json_pack("{s:o,s:s}", "name", cli_utf8_json(layer->name), "combine", combine),
              "layer '%s': combine %s\n", layer->name, combine);
    }
    for (size_t i = 0; i < scene->light_count; ++i) {
        state_light(lights, &scene->lights[i]);
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *r = &scene->receivers[i];
        state(receivers, NULL,
              json_pack("{s:o,s:o,s:o}", "file", cli_utf8_json(r->path), "output", cli_utf8_json(r->output),
                        "size", size_of(r->width, r->height)),
              "receiver %zu: %s to %s, %d × %d\n", i, r->path, r->output, r->width, r->height);
    }
    if (scene->grid.voxel_size > 0.0) {
        state(root, "voxel_size", json_real(scene->grid.voxel_size), "voxel size: %g\n",
              scene->grid.voxel_size);
    } else {
        state(root, "resolution", json_integer(scene->grid.resolution), "resolution: %d\n",
              scene->grid.resolution);
    }
    const char *method = vsh_get_name(VSH_NAMES_SHADOW, scene->shade.method);
    state(root, "method", json_string(method), "method: %s\n", method);
    if (scene->ao) {
        const char *ao = vsh_get_name(VSH_NAMES_AO, scene->shade.ao_method);
        state(root, "ao", json_pack("{s:s,s:f}", "method", ao, "distance", scene->shade.ao_distance),
              scene->shade.ao_distance > 0.0 ? "ao: %s, within %g\n" : "ao: %s, distance auto\n", ao,
              scene->shade.ao_distance);
    }
    vsh_scene_free(scene);
    return CLI_OK;
}

/* --- meshes */

enum { PARAGRAPHS = 8 }; /* more meshes have a line each */

/* A file's meshes. */
typedef struct mesh_info {
    const info_settings *settings;
    const char *path;
    const vsh_model *model;
    size_t count;
    double scale;                  /* from the file's unit to --unit */
    vsh_mesh *meshes;              /* [count] */
    vsh_mesh_report *checks;       /* [count]: in that unit */
    vsh_solidity_report *solidity; /* [count] */
    vsh_mesh *with_uvs;            /* [with_uv_count] */
    vsh_uv_report *reports;        /* [with_uv_count] */
    size_t with_uv_count;
    uint64_t covered; /* texels of the lightmap */
} mesh_info;

static const char *name_of(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

static const char *object_of(const vsh_mesh *mesh) {
    return mesh->object_name != NULL ? mesh->object_name : name_of(mesh);
}

static void state_summary(json_t *root, const mesh_info *info) {
    size_t objects = 0, triangles = 0;
    uint32_t last = 0;
    int32_t least = VSH_MAX_UV_SETS, most = 0;
    for (size_t i = 0; i < info->count; ++i) {
        const vsh_mesh *mesh = &info->meshes[i];
        const int32_t sets = vsh_model_uv_sets(info->model, i);
        objects += mesh->object == 0 || mesh->object != last;
        last = mesh->object;
        triangles += mesh->triangle_count;
        least = sets < least ? sets : least;
        most = sets > most ? sets : most;
    }
    state(root, "objects", json_integer((json_int_t)objects), "objects: %zu, in %zu mesh%s, ", objects,
          info->count, info->count == 1 ? "" : "es");
    state(root, "triangles", json_integer((json_int_t)triangles), "%zu triangles; ", triangles);
    state(root, "uv_sets", size_of(least, most), most > least ? "UV sets: %d to %d\n" : "UV sets: %d\n",
          least, most);
}

static void state_unit(json_t *root, const vsh_model *model, double given) {
    const double own = vsh_model_unit(model), unit = given > 0.0 ? given : own;
    if (unit > 0.0) {
        state(root, "unit", json_real(unit),
              given > 0.0 ? "unit: %g m (as asked)\n" : "unit: %g m; bounds are in metres\n", unit);
    } else {
        state(root, "unit", json_null(), "unit: none in this format; bounds are the file's own numbers\n");
    }
}

/* States the lights that 'bake --lights' would read with its defaults. */
static int state_lights(json_t *root, const char *path, double unit) {
    vsh_light *lights = NULL;
    json_t *list = add(root, "lights", json_array());
    size_t count = 0;
    CLI_TRY(cli_check_input(
        vsh_lights_read(path, 0.53 * CLI_DEGREE, 0.0, unit, &cli_run, &lights, &count, &cli_error)));
    for (size_t i = 0; i < count; ++i) {
        state_light(list, &lights[i]);
    }
    vsh_lights_free(lights);
    return CLI_OK;
}

/* Checks the meshes, and states the size of all. */
static int measure_meshes(json_t *root, const mesh_info *info) {
    vsh_assets_info all = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0.0, 0.0};
    for (size_t i = 0; i < info->count; ++i) {
        vsh_mesh_report *check = &info->checks[i];
        CLI_TRY(cli_check_input(vsh_mesh_check(&info->meshes[i], check, &cli_error)));
        for (int k = 0; k < 3; ++k) {
            all.bounds_min[k] = fmin(all.bounds_min[k], check->bounds_min[k] *= info->scale);
            all.bounds_max[k] = fmax(all.bounds_max[k], check->bounds_max[k] *= info->scale);
        }
        all.area += check->area *= info->scale * info->scale;
    }
    all.ao_distance = vshi_auto_ao_distance(all.bounds_min, all.bounds_max);
    suggest_options(root, &all, info->settings->size);
    return CLI_OK;
}

/* Formats a list such as "2 solids, 1 wall with air in front of faces". */
static const char *describe_solidity(const vsh_solidity_report *report) {
    const struct {
        size_t count;
        const char *name, *detail;
    } kinds[] = {{report->solids, "solid", ""},
                 {report->rooms, "room", " in solids"},
                 {report->walls, "wall", " with air in front of faces"},
                 {report->open_solids, "open solid", ", hidden where only inner sides are seen"},
                 {report->sheets, "sheet", " with air on both sides"}};
    const char *text = "";
    for (size_t i = 0; i < CLI_COUNT(kinds); ++i) {
        if (kinds[i].count > 0) {
            text = cli_keep_text("%s%s%zu %s%s%s", text, *text != '\0' ? ", " : "", kinds[i].count,
                                 kinds[i].name, kinds[i].count == 1 ? "" : "s", kinds[i].detail);
        }
    }
    return *text != '\0' ? text : "nothing";
}

static int state_mesh(json_t *of, const mesh_info *info, size_t index, const vsh_uv_report *uv) {
    const info_settings *s = info->settings;
    const vsh_solidity_report *solidity = &info->solidity[index];
    const vsh_mesh_report report = info->checks[index];
    const vsh_mesh mesh = info->meshes[index];
    vsh_uvs_measures uvs;
    CLI_TRY(cli_check_input(vsh_uvs_measure(&mesh, s->size[0], s->size[1], &uvs, &cli_error)));
    const int32_t sets = vsh_model_uv_sets(info->model, index);
    const char *taken_for = describe_solidity(solidity);
    state(of, "name", cli_utf8_json(name_of(&mesh)), "mesh %zu '%s'\n", index, name_of(&mesh));
    state(of, "triangles", json_integer((json_int_t)mesh.triangle_count), "  triangles: %zu\n",
          mesh.triangle_count);
    state(of, "vertices", json_integer((json_int_t)mesh.vertex_count), "  vertices: %zu\n",
          mesh.vertex_count);
    state(of, "uv_sets", json_integer(sets), "  UV sets: %d\n", sets);
    if (uvs.texels_per_unit > 0.0) {
        state(of, "lightmap_uvs",
              json_pack("{s:f,s:f}", "texels_per_unit", uvs.texels_per_unit / info->scale, "stretch",
                        uvs.stretch),
              "  lightmap UVs: %.4g texels a unit at %d × %d, stretch %.3f\n",
              uvs.texels_per_unit / info->scale, s->size[0], s->size[1], uvs.stretch);
    }
    state(of, "normals", json_boolean(mesh.normals != NULL), "  normals: %s\n",
          mesh.normals != NULL ? "yes" : "no, flat");
    if (report.bounds_min[0] <= report.bounds_max[0]) { /* it has an area */
        state_bounds(of, "  ", report.bounds_min, report.bounds_max);
    }
    state(of, "area", json_real(report.area), "  area: %g\n", report.area);
    if (mesh.alpha != VSH_ALPHA_OPAQUE) {
        const bool blended = mesh.alpha == VSH_ALPHA_BLENDED;
        state(of, "material", json_string(blended ? "blended" : "masked"), "  material: %s\n",
              blended ? "blended (glass, smoke): it casts no shadow, unless its texture cuts it out, or "
                        "--cast-blended"
                      : "masked (leaves, fences): it casts by its texture's alpha");
    }
    state(of, "taken_for", json_string(taken_for), "  taken for: %s\n", taken_for);
    if (solidity->closed_over > 0) {
        state(of, "closed_holes", json_integer((json_int_t)solidity->holes),
              "  closed over: %zu hole%s with %zu open edges, of %zu of these\n", solidity->holes,
              solidity->holes == 1 ? "" : "s", solidity->open_edges, solidity->closed_over);
    }
    count_problem(of, report.open_edges, "open edges");
    count_problem(of, report.flipped_edges, "edges whose triangles disagree about the outside");
    count_problem(of, report.degenerate_triangles, "triangles of zero area, which are skipped");
    count_problem(of, solidity->turned_triangles, "triangles that face the other way than those around");
    count_problem(of, uv->overlap_texels, "texels lie over other charts");
    count_problem(of, uv->outside_triangles, "triangles leave the UV square");
    count_problem(of, uv->degenerate_triangles, "triangles have no area in the UV set");
    return CLI_OK;
}

/* States each mesh in a paragraph, or in a line if they are many. */
static int state_each(json_t *root, const mesh_info *info) {
    const bool lines = info->count > PARAGRAPHS && !cli_given.verbose && !as_json;
    const vsh_uv_report none = {0}, *next = info->reports;
    json_t *meshes = add(root, "meshes", json_array());
    if (lines) {
        puts(" triangles  UV sets  over others  over itself mesh: treated as\n"
             "(over others, over itself: texels that another object's triangle has, or one of its own)");
    }
    for (size_t i = 0; i < info->count; ++i) {
        const vsh_mesh *mesh = &info->meshes[i];
        const vsh_uv_report *uv = mesh->uvs != NULL ? next++ : &none;
        if (!lines) {
            json_t *of = json_object();
            json_array_append_new(meshes, of);
            CLI_TRY(state_mesh(of, info, i, uv));
            continue;
        }
        /* a precision of 0 prints no 0 */
        printf("%10zu %8d %12.0zu %12.0zu %s: %s\n", mesh->triangle_count, vsh_model_uv_sets(info->model, i),
               uv->other_texels, uv->overlap_texels - uv->other_texels, name_of(mesh),
               describe_solidity(&info->solidity[i]));
    }
    return CLI_OK;
}

/* --- UVs in one lightmap */

/* States how many texels objects share, and whether `bake` refuses that. */
static void state_overlap(json_t *root, const mesh_info *info) {
    uint64_t texels = 0;
    size_t over = 0;
    const vsh_uv_report *worst = info->reports;
    for (size_t i = 0; i < info->with_uv_count; ++i) {
        const vsh_uv_report *uv = &info->reports[i];
        texels += uv->other_texels;
        over += uv->other_texels > 0;
        worst = uv->other_texels > worst->other_texels ? uv : worst;
    }
    if (texels == 0) {
        return;
    }
    const bool refused = (double)texels > VSH_LARGEST_OVERLAP * (double)info->covered;
    complain(root, "", refused ? "problem" : "note",
             "objects share texels: %zu of %zu meshes lie over others, on %" PRIu64
             " texels, most of all '%s', on %zu over '%s'%s",
             over, info->with_uv_count, texels, object_of(&info->with_uvs[worst - info->reports]),
             worst->other_mesh_texels, object_of(&info->with_uvs[worst->other_mesh]),
             refused
                 ? ": one image of all is refused; bake with --per-object, choose with --receive, or unwrap "
                   "them into one atlas"
                 : "");
}

/* All meshes with UVs share one lightmap, as they do in `bake`. */
static int measure_uvs(mesh_info *info) {
    vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    lightmap.width = info->settings->size[0];
    lightmap.height = info->settings->size[1];
    vsh_run quiet = cli_run;
    quiet.warning = NULL; /* info prints the problems itself */
    vsh_charts *charts = NULL;
    vsh_charts_info found;
    CLI_TRY(cli_check_input(vsh_charts_create(info->with_uvs, info->with_uv_count, &lightmap, &quiet,
                                              info->reports, &charts, &cli_error)));
    vsh_charts_get_info(charts, &found);
    vsh_charts_free(charts);
    info->covered = found.covered;
    return CLI_OK;
}

/* States the work of `bake --unwrap auto`. */
static int state_unwrap(json_t *root, const mesh_info *info) {
    vsh_receiver receiver = vsh_receiver_default();
    receiver.width = info->settings->size[0];
    receiver.height = info->settings->size[1];
    receiver.unwrap = VSH_RECEIVER_UNWRAP_AUTO;
    int32_t needs;
    CLI_TRY(cli_check_input(
        vsh_receiver_needs_unwrap(&receiver, info->meshes, info->count, &cli_run, &needs, &cli_error)));
    state(root, "needs_unwrap", json_boolean(needs), "--unwrap auto: %s\n",
          needs == 0 ? "bakes these UVs as they are"
                     : "packs usable charts anew, and makes those of other meshes");
    return CLI_OK;
}

static int state_info(json_t *root, mesh_info *info) {
    const int32_t *size = info->settings->size;
    state_summary(root, info);
    state_unit(root, info->model, info->settings->unit);
    CLI_TRY(measure_meshes(root, info));
    CLI_TRY(
        cli_check_input(vsh_mesh_solidity(info->meshes, info->count, &cli_run, info->solidity, &cli_error)));
    CLI_TRY(info->with_uv_count > 0 ? measure_uvs(info) : CLI_OK);
    CLI_TRY(state_each(root, info));
    CLI_TRY(state_lights(root, info->path, info->settings->unit));
    if (info->with_uv_count > 0) {
        const double covered = (double)info->covered / ((double)size[0] * size[1]);
        state(root, "lightmap", json_pack("{s:o,s:f}", "size", size_of(size[0], size[1]), "covered", covered),
              "lightmap of %d × %d texels: %.1f %% covered\n", size[0], size[1], 100.0 * covered);
        state_overlap(root, info);
    }
    CLI_TRY(state_unwrap(root, info));
    if (info->with_uv_count < info->count) {
        complain(root, "", "problem",
                 "%zu of %zu meshes have no UVs to bake into: they only cast with --per-object or "
                 "--no-receive; or "
                 "are unwrapped",
                 info->count - info->with_uv_count, info->count);
    }
    return CLI_OK;
}

static int state_model(json_t *root, const char *path, const info_settings *settings) {
    vsh_model *model = NULL;
    CLI_TRY(cli_check_input(vsh_model_read(path, &cli_run, &model, &cli_error)));
    const size_t count = vsh_model_mesh_count(model);
    const double own = vsh_model_unit(model);
    const double scale = settings->unit > 0.0 ? settings->unit / (own > 0.0 ? own : 1.0) : 1.0;
    mesh_info info = {.settings = settings,
                      .scale = scale,
                      .path = path,
                      .model = model,
                      .count = count,
                      .meshes = calloc(count, sizeof *info.meshes),
                      .checks = calloc(count, sizeof *info.checks),
                      .solidity = calloc(count, sizeof *info.solidity),
                      .with_uvs = calloc(count, sizeof *info.with_uvs),
                      .reports = calloc(count, sizeof *info.reports)};
    for (size_t i = 0; i < count; ++i) {
        info.meshes[i] = vsh_model_mesh(model, i, -1);
        if (info.meshes[i].uvs != NULL) {
            info.with_uvs[info.with_uv_count++] = info.meshes[i];
        }
    }
    const int code = state_info(root, &info);
    free(info.reports);
    free(info.with_uvs);
    free(info.solidity);
    free(info.checks);
    free(info.meshes);
    vsh_model_free(model);
    return code;
}

/* --- the command */

static int info_main(int argc, char **argv) {
    info_settings s = {.size = {1024, 1024}};
    const char *path = NULL;
    CLI_TRY(cli_parse(&cli_info, argc, argv, &s, &path));
    cli_begin_progress(false);
    cli_signals_watch();
    vsh_scene scene = vsh_scene_default();
    cli_apply_settings(VSH_SETTING_OF_SCENE, &scene);
    s.unit = scene.unit;
    as_json = s.json;
    json_t *root = json_object();
    const int code = cli_has_ending(path, "vdb")           ? state_vdb(root, path, cli_parsed.grid, s.size)
                     : cli_has_ending(path, "json")        ? state_scene(root, path, s.size)
                     : cli_has_ending(path, IMAGE_ENDINGS) ? state_image(root, path)
                                                           : state_model(root, path, &s);
    if (as_json && code == CLI_OK) {
        return cli_write_json(NULL, root);
    }
    json_decref(root);
    return code;
}

const cli_command cli_info = {
    "info", "FILE [options]", "what a mesh, .vdb, scene or image holds, and its problems",
    "Prints what a file holds and what is wrong with it: bounds, and options of 'bake' that suit them.\n"
    "Meshes: objects, triangles, UV sets, open, flipped and degenerate parts, whether they are solid,\n"
    "UVs that overlap within or between objects. OpenVDB files (FILE.vdb, or FILE.vdb:GRID): class,\n"
    "voxel size, band, memory of each grid, and why it cannot cast. Scenes (.json): casters, lights,\n"
    "receivers. Images: size, and the range of each channel.",
    CLI_ENDING(options, info_main)};
