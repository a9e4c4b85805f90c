#include "bake_forecast.h"

#include "clock.h"
#include "field.h"
#include "message.h"
#include "planes.h"
#include "receiver.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <sys/resource.h>

/* The trial: voxels along the longest side, and texels on a side. */
enum { TRIAL_RESOLUTION = 96, TRIAL_SIZE = 128 };
/* A march takes a few samples more on each finer level: this much more for twice the resolution, measured on
 * the project's scenes. */
static const double MORE_PER_DOUBLING = 1.15;
/* Making a level set takes this many times its own memory (the cloister, 96 to 512 voxels: 6 to 4.2). */
static const double MAKING = 4.3;
/* Whole numbers of texels and voxels are close, times are not: other work, caches, the share in penumbra. */
static const char *const time_note = "by a small bake; half or twice as much is possible";

typedef struct forecast {
    const vsh_scene *scene;
    const vsh_assets *assets;
    const vsh_run *run;
    uint64_t texels;
    uint64_t samples;
    uint64_t largest_bytes; /* of a receiver: texels, planes and what the bake takes */
    cli_box receivers;
    double seconds; /* of rasterising */
} forecast;

static int make_texels(const forecast *f, size_t index, int32_t most, vsh_texels **texels) {
    const vsh_receiver *receiver = &f->scene->receivers[index];
    size_t count;
    const vsh_mesh *meshes = vsh_assets_receiver(f->assets, index, &count);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width < most ? receiver->width : most;
    options.height = receiver->height < most ? receiver->height : most;
    options.supersample = most < receiver->width ? 1 : receiver->supersample;
    options.padding = most < receiver->width ? 0 : receiver->padding;
    vsh_error error;
    return vsh_texels_create(meshes, count, &options, f->run, NULL, texels, &error) == VSH_OK
               ? CLI_OK
               : cli_fail(&error);
}

static int count_texels(forecast *f) {
    f->receivers = cli_box_empty();
    const double start = cli_seconds();
    for (size_t i = 0; i < f->scene->receiver_count; ++i) {
        vsh_texels *texels = NULL;
        const int code = make_texels(f, i, VSH_MAX_LIGHTMAP_SIZE, &texels);
        if (code != CLI_OK) {
            return code;
        }
        vsh_texels_info info;
        vsh_texels_get_info(texels, &info);
        vsh_texels_free(texels);
        cli_planes planes;
        const int named = cli_planes_name(&planes, f->scene, info.width, info.height);
        const uint64_t channels = (uint64_t)planes.image.channel_count + (f->scene->irradiance ? 3 : 0);
        cli_planes_free(&planes);
        if (named != CLI_OK) {
            return named;
        }
        f->texels += info.covered;
        f->samples += info.samples;
        const uint64_t plane = 4 * (uint64_t)info.width * (uint64_t)info.height;
        const uint64_t bytes = info.bytes + channels * plane + 2 * plane + 50 * info.samples;
        f->largest_bytes = bytes > f->largest_bytes ? bytes : f->largest_bytes;
        cli_box_grow(&f->receivers, &info);
    }
    f->seconds = cli_seconds() - start;
    return CLI_OK;
}

/* What was measured on the trial. */
typedef struct trial {
    double finer;    /* the scene's resolution over the trial's */
    double sample_s; /* of one texel's sample, all lights and AO */
    cli_field made;  /* its field is freed when the trial is over */
} trial;

static int bake_part(const forecast *f, const vsh_field *field, const vsh_shade_options *shade, trial *t) {
    vsh_texels *texels = NULL;
    int code = make_texels(f, 0, TRIAL_SIZE, &texels);
    if (code != CLI_OK) {
        return code;
    }
    vsh_texels_info info;
    vsh_texels_get_info(texels, &info);
    cli_planes planes;
    code = cli_planes_name(&planes, f->scene, info.width, info.height);
    code = code == CLI_OK
               ? cli_planes_allocate(&planes, f->scene, f->run->memory_limit, f->scene->receivers[0].output)
               : code;
    if (code == CLI_OK) {
        const double start = cli_seconds();
        vsh_error error;
        if (vsh_bake_lightmap(field, texels, f->scene->lights, f->scene->light_count, shade, f->run,
                              &planes.lightmap, NULL, &error) != VSH_OK) {
            code = cli_fail(&error);
        }
        t->sample_s = (cli_seconds() - start) / fmax(1.0, (double)info.samples);
    }
    cli_planes_free(&planes);
    vsh_texels_free(texels);
    return code;
}

/* Voxels of the scene over those of the trial, on a side. */
static double finer(const vsh_scene *scene, double trial_voxel) {
    return scene->grid.voxel_size > 0.0 ? trial_voxel / scene->grid.voxel_size
                                        : (double)scene->grid.resolution / TRIAL_RESOLUTION;
}

static int try_small(const forecast *f, trial *t) {
    vsh_scene small = *f->scene;
    small.grid.voxel_size = 0.0;
    small.grid.resolution = TRIAL_RESOLUTION;
    vsh_triangles *triangles = NULL;
    int code = cli_field_make(&small, f->assets, &f->receivers, f->run, &t->made);
    code = code == CLI_OK ? cli_triangles_make(f->scene, f->assets, f->run, &triangles) : code;
    if (code == CLI_OK) {
        vsh_shade_options shade = f->scene->shade;
        shade.triangles = triangles;
        t->finer = finer(f->scene, t->made.grid.voxel_size);
        code = bake_part(f, t->made.field, &shade, t);
    }
    vsh_triangles_free(triangles);
    vsh_field_free(t->made.field);
    return code;
}

static double resident_bytes(void) {
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? 1024.0 * (double)usage.ru_maxrss : 0.0;
}

int cli_bake_forecast(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run) {
    forecast f = {.scene = scene, .assets = assets, .run = run};
    int code = count_texels(&f);
    trial t = {0};
    code = code == CLI_OK ? try_small(&f, &t) : code;
    if (code != CLI_OK) {
        return code;
    }
    const double more = t.finer * t.finer; /* surfaces: voxels grow with the square */
    const double voxelize = t.made.voxelize_s * more, field = t.made.field_s * more;
    const double bake =
        f.seconds + (double)f.samples * t.sample_s * pow(MORE_PER_DOUBLING, fmax(0.0, log2(t.finer)));
    const double grid_bytes = (double)t.made.grid.bytes * more,
                 field_bytes = (double)t.made.info.bytes * more;
    const double base =
        fmax(0.0, resident_bytes() - MAKING * (double)t.made.grid.bytes); /* program and assets */
    const double peak = base + fmax(fmax(MAKING * grid_bytes, grid_bytes + field_bytes),
                                    field_bytes + (double)f.largest_bytes);
    char grid_text[32], field_text[32], peak_text[32];
    printf("texels        %" PRIu64 " in %zu lightmap%s, %" PRIu64 " samples\n", f.texels,
           scene->receiver_count, scene->receiver_count == 1 ? "" : "s", f.samples);
    printf("voxels        about %.3g of %.4g, %.4g along the longest side\n",
           (double)t.made.grid.active_voxels * more, t.made.grid.voxel_size / t.finer,
           TRIAL_RESOLUTION * t.finer);
    printf("memory        about %s at most: level set %s, field %s\n",
           cli_bytes_text((uint64_t)peak, peak_text, sizeof peak_text),
           cli_bytes_text((uint64_t)grid_bytes, grid_text, sizeof grid_text),
           cli_bytes_text((uint64_t)field_bytes, field_text, sizeof field_text));
    printf("time          about %.2g s: voxelize %.2g s, field %.2g s, bake %.2g s (%s)\n",
           voxelize + field + bake, voxelize, field, bake, time_note);
    return CLI_OK;
}
