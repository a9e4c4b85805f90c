/* vdbshade info: what a file holds, and what is wrong with it. */
#include "base/bytes.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/patch.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_SIZE = 0x2000 };

static const cli_option options[] = {
    {0, NULL, NULL, "Options"},
    {KEY_SIZE, "size", "W[xH]", "texels of the lightmap that UVs are looked at in (1024)"},
    {CLI_KEY_VERBOSE, "verbose", NULL, "a paragraph for each mesh, however many there are"},
    CLI_SETTING("unit"),
    CLI_MEMORY_OPTION,
    CLI_READER_OPTIONS,
    {'h', "help", NULL, "show this help"},
};

static int info_main(int argc, char **argv);

const cli_command cli_info = {
    "info",
    "FILE",
    "Prints what a file holds and what is wrong with it. Meshes: objects, triangles, UV sets, bounds,\n"
    "open, flipped and degenerate parts, what they are taken for, UVs that overlap within or between\n"
    "objects. OpenVDB files (FILE.vdb, or FILE.vdb:GRID): class, voxel size, band, bounds, memory of\n"
    "each grid, and why it cannot cast. Scenes (.json): casters, lights, receivers. Images: size, and\n"
    "the range of each channel.",
    options,
    sizeof options / sizeof options[0],
    info_main};

/* How meshes are looked at. */
typedef struct info_look {
    int32_t width, height; /* of the lightmap that their UVs are laid out in */
    double unit;           /* as of vsh_scene */
    bool all;              /* a paragraph for each mesh, however many there are */
} info_look;

typedef struct info_settings {
    cli_patch patch;
    info_look look;
} info_settings;

static int parse_option(void *settings, int key, const char *name, const char *value) {
    info_settings *s = settings;
    return key == KEY_SIZE ? cli_parse_size(name, value, &s->look.width, &s->look.height)
                           : cli_patch_take(&s->patch, key, name, value);
}

static void print_light(const vsh_light *light) {
    char text[512];
    vsh_light_text(light, text, sizeof text);
    printf("light '%s': %s\n", light->name, text);
}

/* --- images */

static void print_channel(const char *name, const float *plane, size_t count) {
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
    if (finite > 0) {
        printf("channel '%s': min %.6g, mean %.6g, max %.6g\n", name, least, sum / (double)finite, most);
    } else {
        printf("channel '%s': no finite value\n", name);
    }
    if (finite < count) {
        printf("  problem: %zu values are not finite\n", count - finite);
    }
}

static int print_image(const char *path, const vsh_run *run) {
    vsh_image_file *file = NULL;
    vsh_error error;
    CLI_TRY(cli_check(vsh_image_read(path, run, &file, &error), &error));
    const vsh_image image = vsh_image_view(file);
    printf("image: %d × %d, %d channels\n", image.width, image.height, image.channel_count);
    for (int32_t i = 0; i < image.channel_count; ++i) {
        print_channel(image.names[i], image.planes[i], (size_t)image.width * (size_t)image.height);
    }
    size_t count = 0;
    const vsh_attribute *attributes = vsh_image_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        printf("%s: %s\n", attributes[i].name, attributes[i].value);
    }
    vsh_image_free(file);
    return CLI_OK;
}

/* --- level sets */

enum { MAX_LISTED = 4096 };

/* Whether `vdbshade volume` made the grid: it need not be a caster then. */
static bool is_ours(const vsh_vdb_entry *grid) {
    return strstr(grid->attributes, "vdbshade_version") != NULL && strcmp(grid->grid_class, "level set") != 0;
}

static void print_grid(const vsh_vdb_entry *grid) {
    char bytes[32];
    printf("grid '%s'\n  type: %s\n  class: %s\n", grid->name, grid->type, grid->grid_class);
    printf("  voxel size: %g %g %g\n", grid->voxel_size[0], grid->voxel_size[1], grid->voxel_size[2]);
    if (grid->background != 0.0) {
        printf("  background: %g", grid->background);
        if (grid->voxel_size[0] > 0.0 && strcmp(grid->grid_class, "level set") == 0) {
            printf(" (%.3g voxels)", fabs(grid->background) / grid->voxel_size[0]);
        }
        putchar('\n');
    }
    printf("  active voxels: %" PRIu64 ", %d %d %d to %d %d %d\n", grid->active_voxels, grid->index_min[0],
           grid->index_min[1], grid->index_min[2], grid->index_max[0], grid->index_max[1],
           grid->index_max[2]);
    printf("  memory: %s\n", vshi_bytes_text(grid->bytes, bytes, sizeof bytes));
    for (const char *line = grid->attributes; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        printf("  %.*s\n", (int)length, line);
        line += length + (line[length] != '\0');
    }
    if (is_ours(grid)) {
        printf(
            "  holds: values that vdbshade baked, to be looked up: it is no caster and needs to be none\n");
    } else if (grid->problem[0] != '\0') {
        printf(grid->mended != 0 ? "  note: %s: its distances are made anew where it is used\n"
                                 : "  problem: %s\n",
               grid->problem);
    }
}

static int print_vdb(const char *path, const char *name, const vsh_run *run) {
    vsh_vdb_entry *entries = calloc(MAX_LISTED, sizeof *entries);
    size_t count = 0, shown = 0;
    vsh_error error;
    int code = cli_check_result(vsh_vdb_list(path, run, entries, MAX_LISTED, &count, &error), &error);
    const size_t listed = count < MAX_LISTED ? count : MAX_LISTED;
    for (size_t i = 0; i < listed; ++i) {
        if (name == NULL || strcmp(entries[i].name, name) == 0) {
            print_grid(&entries[i]);
            ++shown;
        }
    }
    if (code == CLI_OK && name != NULL && shown == 0) {
        code = cli_usage("%s: no grid '%s'; it holds '%s'%s", path, name, entries[0].name,
                         count > 1 ? " and others" : "");
    } else if (code == CLI_OK && count == 0) {
        printf("problem: no grids\n");
    } else if (count > MAX_LISTED && name == NULL) {
        printf("… and %zu more grids\n", count - MAX_LISTED);
    }
    free(entries);
    return code;
}

/* --- scenes */

static void print_caster(const vsh_caster *caster, size_t index) {
    static const char *const types[] = {"mesh", "sdf", "vdb", "heightfield", "spheres", "mask", "text"};
    printf("caster %zu: %s", index, types[caster->type]);
    if (caster->path != NULL) {
        printf(" %s", caster->path);
    }
    if (caster->grid != NULL) {
        printf(", grid '%s'", caster->grid);
    }
    if (caster->layer != NULL) {
        printf(", layer '%s'", caster->layer);
    }
    putchar('\n');
}

/* Returns false if the file is no flat scene. */
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

static int print_scene(const char *path, const vsh_run *run) {
    vsh_scene *scene = NULL;
    vsh_error error;
    if (vsh_scene_read(path, run, &scene, &error) != VSH_OK) {
        return error.code == VSH_ERROR_INPUT && print_flat(path, run) ? CLI_OK : cli_fail(&error);
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        print_caster(&scene->casters[i], i);
    }
    for (size_t i = 0; i < scene->layer_count; ++i) {
        const vsh_scene_layer *layer = &scene->layers[i];
        printf("layer '%s': combine %s\n", layer->name,
               vsh_get_name(VSH_NAMES_COMBINE, layer->shade.combine));
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

/* --- meshes */

enum { PARAGRAPHS = 8 }; /* more meshes have a line each */

/* A file's meshes. */
typedef struct mesh_info {
    const vsh_model *model;
    size_t count;
    vsh_mesh *meshes;              /* [count] */
    vsh_solidity_report *solidity; /* [count] */
    vsh_mesh *with_uvs;            /* [with_uv_count] */
    vsh_uv_report *reports;        /* [with_uv_count] */
    size_t with_uv_count;
} mesh_info;

static const char *name_of(const vsh_mesh *mesh) {
    return mesh->name != NULL ? mesh->name : "";
}

static const char *object_of(const vsh_mesh *mesh) {
    return mesh->object_name != NULL ? mesh->object_name : name_of(mesh);
}

static void print_summary(const mesh_info *info) {
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
    printf("objects: %zu, in %zu mesh%s, %zu triangles; UV sets: %d", objects, info->count,
           info->count == 1 ? "" : "es", triangles, least);
    if (most > least) {
        printf(" to %d", most);
    }
    putchar('\n');
}

static void print_unit(const vsh_model *model, double unit) {
    const double own = vsh_model_unit(model);
    if (unit > 0.0) {
        printf("unit: %g m (as asked)\n", unit);
    } else if (own > 0.0) {
        printf("unit: %g m; bounds are in metres\n", own);
    } else {
        printf("unit: none in this format; bounds are the file's own numbers\n");
    }
}

/* Prints the lights that 'bake --lights' would read with its defaults. */
static int print_lights(const vsh_model *model, double unit) {
    vsh_light *lights = NULL;
    size_t count = 0;
    vsh_error error;
    CLI_TRY(cli_check_result(
        vsh_lights_from_model(model, 0.53 * CLI_DEGREE, 0.0, unit, &lights, &count, &error), &error));
    for (size_t i = 0; i < count; ++i) {
        print_light(&lights[i]);
    }
    vsh_lights_free(lights);
    return CLI_OK;
}

/* Prints a list such as "2 solids, 1 wall with air in front of faces". */
static void print_solidity(const vsh_solidity_report *report) {
    const struct {
        size_t count;
        const char *name, *detail;
    } kinds[] = {{report->solids, "solid", ""},
                 {report->rooms, "room", " in solids"},
                 {report->walls, "wall", " with air in front of faces"},
                 {report->open_solids, "open solid", ", hidden where only inner sides are seen"},
                 {report->sheets, "sheet", " with air on both sides"}};
    const char *separator = "";
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; ++i) {
        if (kinds[i].count > 0) {
            printf("%s%zu %s%s%s", separator, kinds[i].count, kinds[i].name, kinds[i].count == 1 ? "" : "s",
                   kinds[i].detail);
            separator = ", ";
        }
    }
    puts(separator[0] == '\0' ? "nothing" : "");
}

static void print_problem(size_t count, const char *what) {
    if (count > 0) {
        printf("  problem: %zu %s\n", count, what);
    }
}

static void print_uv_problems(const vsh_uv_report *uv) {
    print_problem(uv->overlap_texels, "texels lie over other charts");
    print_problem(uv->outside_triangles, "triangles leave the UV square");
    print_problem(uv->degenerate_triangles, "triangles have no area in the UV set");
}

static int print_paragraph(const mesh_info *info, size_t index, const vsh_uv_report *uv,
                           const info_look *look) {
    vsh_mesh mesh = info->meshes[index];
    const vsh_solidity_report *solidity = &info->solidity[index];
    double scaled[12]; /* the user gives the unit of positions */
    const double own = vsh_model_unit(info->model), scale = look->unit / (own > 0.0 ? own : 1.0);
    for (int i = 0; i < 12; ++i) {
        scaled[i] = mesh.transform[i] * (look->unit > 0.0 ? scale : 1.0);
    }
    mesh.transform = scaled;
    vsh_mesh_report report;
    vsh_uvs_measures uvs;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_mesh_check(&mesh, &report, &error), &error));
    CLI_TRY(cli_check_result(vsh_uvs_measure(&mesh, look->width, look->height, &uvs, &error), &error));
    printf("mesh %zu '%s'\n", index, name_of(&mesh));
    printf("  triangles: %zu\n  vertices: %zu\n", mesh.triangle_count, mesh.vertex_count);
    printf("  UV sets: %d\n", vsh_model_uv_sets(info->model, index));
    if (uvs.texels_per_unit > 0.0) {
        printf("  lightmap UVs: %.4g texels a unit at %d × %d, stretch %.3f\n", uvs.texels_per_unit,
               look->width, look->height, uvs.stretch);
    }
    printf("  normals: %s\n", mesh.normals != NULL ? "yes" : "no, flat");
    printf("  bounds: %g %g %g to %g %g %g\n  area: %g\n", report.bounds_min[0], report.bounds_min[1],
           report.bounds_min[2], report.bounds_max[0], report.bounds_max[1], report.bounds_max[2],
           report.area);
    if (mesh.alpha != VSH_ALPHA_OPAQUE) {
        printf("  material: %s\n",
               mesh.alpha == VSH_ALPHA_BLENDED
                   ? "blended (glass, smoke): it casts no shadow, unless its texture cuts "
                     "it out, or --cast-blended"
                   : "masked (leaves, fences): it casts by its texture's alpha");
    }
    printf("  taken for: ");
    print_solidity(solidity);
    if (solidity->closed_over > 0) {
        printf("  closed over: %zu hole%s with %zu open edges, of %zu of these\n", solidity->holes,
               solidity->holes == 1 ? "" : "s", solidity->open_edges, solidity->closed_over);
    }
    print_problem(report.open_edges, "open edges");
    print_problem(report.flipped_edges, "edges whose triangles disagree about the outside");
    print_problem(report.degenerate_triangles, "triangles of zero area, which are skipped");
    print_problem(solidity->turned_triangles, "triangles that face the other way than those around");
    print_uv_problems(uv);
    return CLI_OK;
}

/* Prints a paragraph for each mesh, or a line if they are many. */
static int print_each(const mesh_info *info, const info_look *look) {
    const bool lines = info->count > PARAGRAPHS && !look->all;
    const vsh_uv_report none = {0}, *next = info->reports;
    if (lines) {
        puts(" triangles  UV sets  over others  over itself mesh: treated as\n"
             "(over others, over itself: texels that another object's triangle has, or one of its own)");
    }
    for (size_t i = 0; i < info->count; ++i) {
        const vsh_mesh *mesh = &info->meshes[i];
        const vsh_uv_report *uv = mesh->uvs != NULL ? next++ : &none;
        if (!lines) {
            CLI_TRY(print_paragraph(info, i, uv, look));
            continue;
        }
        /* a precision of 0 prints no 0 */
        printf("%10zu %8d %12.0zu %12.0zu %s: ", mesh->triangle_count, vsh_model_uv_sets(info->model, i),
               uv->other_texels, uv->overlap_texels - uv->other_texels, name_of(mesh));
        print_solidity(&info->solidity[i]);
    }
    return CLI_OK;
}

/* --- UVs in one lightmap */

static void print_verdict(const mesh_info *info, uint64_t covered) {
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
    const bool refused = (double)texels > VSH_LARGEST_OVERLAP * (double)covered;
    printf("%s: objects share texels: %zu of %zu meshes lie over others, on %" PRIu64
           " texels, most of all '%s', on %zu over '%s'%s\n",
           refused ? "problem" : "note", over, info->with_uv_count, texels,
           object_of(&info->with_uvs[worst - info->reports]), worst->other_mesh_texels,
           object_of(&info->with_uvs[worst->other_mesh]),
           refused
               ? ": one image of all is refused; bake with --per-object, choose with --receive, or unwrap "
                 "them into one atlas"
               : "");
}

/* All meshes with UVs share one lightmap, as they do in `bake`. */
static int measure_uvs(const mesh_info *info, const info_look *look, const vsh_run *run, uint64_t *covered) {
    vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    lightmap.width = look->width;
    lightmap.height = look->height;
    vsh_run quiet = *run;
    quiet.warning = NULL; /* info prints the problems itself */
    vsh_charts *charts = NULL;
    vsh_charts_info found;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_charts_create(info->with_uvs, info->with_uv_count, &lightmap, &quiet,
                                               info->reports, &charts, &error),
                             &error));
    vsh_charts_get_info(charts, &found);
    vsh_charts_free(charts);
    *covered = found.covered;
    return CLI_OK;
}

/* Prints the work of `bake --unwrap auto`. */
static int print_unwrap(const mesh_info *info, const info_look *look, const vsh_run *run) {
    vsh_receiver receiver = vsh_receiver_default();
    receiver.width = look->width;
    receiver.height = look->height;
    receiver.unwrap = VSH_RECEIVER_UNWRAP_AUTO;
    int32_t needs;
    vsh_error error;
    CLI_TRY(cli_check_result(
        vsh_receiver_needs_unwrap(&receiver, info->meshes, info->count, run, &needs, &error), &error));
    printf("--unwrap auto: %s\n", needs == 0 ? "bakes these UVs as they are"
                                             : "packs usable charts anew, and makes those of other meshes");
    return CLI_OK;
}

static int print_meshes(const char *path, const info_look *look, const vsh_run *run) {
    vsh_model *model = NULL;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_model_read(path, run, &model, &error), &error));
    const size_t count = vsh_model_mesh_count(model);
    mesh_info info = {.model = model,
                      .count = count,
                      .meshes = calloc(count, sizeof *info.meshes),
                      .solidity = calloc(count, sizeof *info.solidity),
                      .with_uvs = calloc(count, sizeof *info.with_uvs),
                      .reports = calloc(count, sizeof *info.reports)};
    uint64_t covered = 0;
    int code;
    for (size_t i = 0; i < count; ++i) {
        info.meshes[i] = vsh_model_mesh(model, i, -1);
        if (info.meshes[i].uvs != NULL) {
            info.with_uvs[info.with_uv_count++] = info.meshes[i];
        }
    }
    print_summary(&info);
    print_unit(model, look->unit);
    CLI_TRY_DONE(cli_check_result(vsh_mesh_solidity(info.meshes, count, run, info.solidity, &error), &error));
    if (info.with_uv_count > 0) {
        CLI_TRY_DONE(measure_uvs(&info, look, run, &covered));
    }
    CLI_TRY_DONE(print_each(&info, look));
    CLI_TRY_DONE(print_lights(model, look->unit));
    if (info.with_uv_count > 0) {
        printf("lightmap of %d × %d texels: %.1f %% covered\n", look->width, look->height,
               100.0 * (double)covered / ((double)look->width * look->height));
        print_verdict(&info, covered);
    }
    CLI_TRY_DONE(print_unwrap(&info, look, run));
    if (info.with_uv_count < count) {
        printf("problem: %zu of %zu meshes have no UVs to bake into: they only cast with --per-object or "
               "--no-receive; or are unwrapped\n",
               count - info.with_uv_count, count);
    }
done:
    free(info.reports);
    free(info.with_uvs);
    free(info.solidity);
    free(info.meshes);
    vsh_model_free(model);
    return code;
}

/* --- the command */

static int info_main(int argc, char **argv) {
    info_settings s = {.look = {.width = 1024, .height = 1024}};
    const char *path = NULL;
    CLI_TRY(cli_parse(&cli_info, argc, argv, parse_option, &s, &path));
    cli_progress_begin(false, true);
    cli_signals_watch();
    const vsh_run run = cli_make_run();
    s.look.all = cli_given.verbose;
    vsh_scene scene = vsh_scene_default();
    cli_patch_scene(&s.patch, &scene);
    s.look.unit = scene.unit;
    return cli_has_ending(path, "vdb")               ? print_vdb(path, cli_parsed_grid(), &run)
           : cli_has_ending(path, "json")            ? print_scene(path, &run)
           : cli_has_ending(path, CLI_IMAGE_ENDINGS) ? print_image(path, &run)
                                                     : print_meshes(path, &s.look, &run);
}
