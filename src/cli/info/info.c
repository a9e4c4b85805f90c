/* vdbshade info: what a file holds, and what is wrong with it. */
#include "info.h"
#include "base/bytes.h"
#include "cli/commands.h"
#include "cli/patch.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/try.h"

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

typedef struct info_settings {
    cli_common common;
    cli_patch patch;
    info_look look;
} info_settings;

static int parse_option(void *settings, int key, const char *name, const char *value) {
    info_settings *s = settings;
    bool taken;
    if (key == KEY_SIZE) {
        return cli_parse_size(name, value, &s->look.width, &s->look.height);
    }
    const int code = cli_patch_take(&s->patch, key, name, value, &taken);
    return taken ? code : cli_common_parse(&s->common, key, name, value, &taken);
}

void info_print_light(const vsh_light *light) {
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
            const double value = plane[i];
            least = value < least ? value : least;
            most = value > most ? value : most;
            sum += value;
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
    if (vsh_image_read(path, run, &file, &error) != VSH_OK) {
        return cli_fail(&error);
    }
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

static void say_names(const char *path, const char *name, const vsh_vdb_entry *entries, size_t count) {
    char names[700] = "";
    size_t used = 0;
    for (size_t i = 0; i < count && used < sizeof names; ++i) {
        used +=
            (size_t)snprintf(names + used, sizeof names - used, "%s'%s'", i > 0 ? ", " : "", entries[i].name);
    }
    cli_say("%s: no grid '%s'; it holds %s", path, name, names);
}

static int print_vdb(const char *path, const char *name, const vsh_run *run) {
    vsh_vdb_entry *entries = calloc(MAX_LISTED, sizeof *entries);
    if (entries == NULL) {
        return cli_out_of_memory(path);
    }
    size_t count = 0;
    vsh_error error;
    if (vsh_vdb_list(path, run, entries, MAX_LISTED, &count, &error) != VSH_OK) {
        free(entries);
        return cli_fail(&error);
    }
    const size_t listed = count < MAX_LISTED ? count : MAX_LISTED;
    size_t shown = 0;
    for (size_t i = 0; i < listed; ++i) {
        if (name == NULL || strcmp(entries[i].name, name) == 0) {
            print_grid(&entries[i]);
            ++shown;
        }
    }
    if (name != NULL && shown == 0) {
        say_names(path, name, entries, listed);
        free(entries);
        return CLI_USAGE;
    }
    if (count == 0) {
        printf("problem: no grids\n");
    }
    if (count > MAX_LISTED && name == NULL) {
        printf("… and %zu more grids\n", count - MAX_LISTED);
    }
    free(entries);
    return CLI_OK;
}

/* --- scenes */

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
        print_layer(&scene->layers[i]);
    }
    for (size_t i = 0; i < scene->light_count; ++i) {
        info_print_light(&scene->lights[i]);
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

/* --- the command */

static int print_info(const char *path, const info_look *look, const vsh_run *run) {
    if (cli_has_ending(path, "vdb")) {
        return print_vdb(path, cli_parsed_grid(), run);
    }
    if (cli_has_ending(path, "json")) {
        return print_scene(path, run);
    }
    if (cli_has_ending_of(path, CLI_IMAGE_ENDINGS)) {
        return print_image(path, run);
    }
    return info_print_mesh(path, look, run);
}

static int info_main(int argc, char **argv) {
    info_settings s = {.common = cli_common_default(), .look = {.width = 1024, .height = 1024}};
    const char *path = NULL;
    bool help;
    const int code = cli_parse(&cli_info, argc, argv, parse_option, &s, "FILE", &path, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(false, true);
    cli_signals_watch();
    const vsh_run run = cli_common_run(&s.common);
    s.look.all = s.common.verbose;
    vsh_scene scene = vsh_scene_default();
    cli_patch_scene(&s.patch, &scene);
    s.look.unit = scene.unit;
    return print_info(path, &s.look, &run);
}
