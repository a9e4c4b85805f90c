#include "bake_forecast.h"

#include "box.h"
#include "clock.h"
#include "message.h"
#include "planes.h"
#include "receiver.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
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
    const cli_targets *targets;
    const vsh_run *run;
    uint64_t texels;
    uint64_t samples;
    vsh_charts **charts; /* [receivers] */
    int32_t band_rows;
    cli_box receivers;
    double seconds; /* of rasterising */
} forecast;

static cli_receiver_job receiver_job(const forecast *f, size_t index) {
    return (cli_receiver_job){.scene = f->scene,
                              .meshes = f->targets->meshes[index],
                              .mesh_count = f->targets->mesh_counts[index],
                              .run = f->run,
                              .index = index,
                              .band_rows = f->band_rows};
}

static int count_texels(forecast *f) {
    f->receivers = cli_box_empty();
    const double start = cli_seconds();
    for (size_t i = 0; i < f->scene->receiver_count; ++i) {
        const cli_receiver_job job = receiver_job(f, i);
        const int code = cli_receiver_charts(&job, false, &f->charts[i]);
        if (code != CLI_OK) {
            return code;
        }
        vsh_charts_info counted;
        vsh_charts_get_info(f->charts[i], &counted);
        f->texels += counted.covered;
        f->samples += counted.samples;
        vsh_texels_info info = {.samples = counted.samples};
        vsh_error error;
        if (vsh_charts_bounds(f->charts[i], f->run, info.bounds_min, info.bounds_max, &error) != VSH_OK) {
            return cli_fail_of(NULL, &error);
        }
        cli_box_grow(&f->receivers, &info);
    }
    f->seconds = cli_seconds() - start;
    return CLI_OK;
}

/* What was measured on the trial. */
typedef struct trial {
    double finer;    /* the scene's resolution over the trial's */
    double sample_s; /* of one texel's sample, all lights and AO */
    vsh_occluders_info made;
} trial;

static int make_texels(const forecast *f, vsh_texels **texels) {
    const vsh_receiver *receiver = &f->scene->receivers[0];
    const size_t count = f->targets->mesh_counts[0];
    const vsh_mesh *meshes = f->targets->meshes[0];
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width < TRIAL_SIZE ? receiver->width : TRIAL_SIZE;
    options.height = receiver->height < TRIAL_SIZE ? receiver->height : TRIAL_SIZE;
    options.supersample = TRIAL_SIZE < receiver->width ? 1 : receiver->supersample;
    options.padding = TRIAL_SIZE < receiver->width ? 0 : receiver->padding;
    vsh_error error;
    return vsh_texels_create(meshes, count, &options, f->run, NULL, texels, &error) == VSH_OK
               ? CLI_OK
               : cli_fail_of(NULL, &error);
}

static int bake_part(const forecast *f, const vsh_occluders *occluders, trial *t) {
    vsh_texels *texels = NULL;
    int code = make_texels(f, &texels);
    if (code != CLI_OK) {
        return code;
    }
    vsh_texels_info info;
    vsh_texels_get_info(texels, &info);
    cli_planes planes;
    code = cli_planes_name(&planes, f->scene, info.width, info.height);
    code = code == CLI_OK ? cli_planes_allocate(&planes, f->scene, info.height, false, f->run->memory_limit,
                                                f->scene->receivers[0].output)
                          : code;
    if (code == CLI_OK) {
        const double start = cli_seconds();
        vsh_error error;
        if (vsh_bake_lightmap(occluders, texels, f->scene->lights, f->scene->light_count, &f->scene->shade,
                              f->run, &planes.lightmap, NULL, &error) != VSH_OK) {
            code = cli_fail_of(NULL, &error);
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
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.receivers_min = f->receivers.min;
    options.receivers_max = f->receivers.max;
    options.silent_voxels = 1; /* what coarse voxels lose is not lost by the scene's */
    vsh_occluders *occluders = NULL;
    vsh_error error;
    if (vsh_scene_occluders(&small, f->assets, &options, f->run, &occluders, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    vsh_occluders_get_info(occluders, &t->made);
    t->finer = finer(f->scene, t->made.voxel_size);
    const int code = bake_part(f, occluders, t);
    vsh_occluders_free(occluders);
    return code;
}

static double resident_bytes(void) {
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? 1024.0 * (double)usage.ru_maxrss : 0.0;
}

/* What the largest bake takes, the field with it; and where asked for a line for each lightmap that is baked
 * in bands. */
static int plan_bands(const forecast *f, double field_bytes, bool tell, uint64_t *largest) {
    for (size_t i = 0; i < f->scene->receiver_count; ++i) {
        const cli_receiver_job job = receiver_job(f, i);
        cli_bands bands;
        const int code = cli_receiver_plan(&job, f->charts[i], (uint64_t)field_bytes, &bands);
        if (code != CLI_OK) {
            return code;
        }
        if (tell && bands.count > 1) {
            printf("bands         %d of %d rows: %s\n", bands.count, bands.rows,
                   f->scene->receivers[i].output);
        }
        *largest = bands.bytes > *largest ? bands.bytes : *largest;
    }
    return CLI_OK;
}

static void tell_methods(const forecast *f, const trial *t) {
    cli_stats stats = {.of = CLI_STATS_TEXELS};
    char text[128];
    cli_stats_methods(&stats, f->scene, t->made.has_triangles);
    printf("methods       %s\n", cli_stats_methods_text(&stats, text, sizeof text));
}

static int predict(const forecast *f, const trial *t) {
    const double more = t->finer * t->finer; /* surfaces: voxels grow with the square */
    const double voxelize = t->made.voxelize_s * more, field = t->made.field_s * more;
    const double bake =
        f->seconds + (double)f->samples * t->sample_s * pow(MORE_PER_DOUBLING, fmax(0.0, log2(t->finer)));
    const double grid_bytes = (double)t->made.grid_bytes * more,
                 field_bytes = (double)t->made.field_bytes * more;
    const double base =
        fmax(0.0, resident_bytes() - MAKING * (double)t->made.grid_bytes); /* program and assets */
    uint64_t largest = 0; /* of a receiver: field, texels, planes and what the bake takes */
    int code = plan_bands(f, field_bytes, false, &largest);
    if (code != CLI_OK) {
        return code;
    }
    tell_methods(f, t);
    printf("texels        %" PRIu64 " in %zu lightmap%s, %" PRIu64 " samples\n", f->texels,
           f->scene->receiver_count, f->scene->receiver_count == 1 ? "" : "s", f->samples);
    code = plan_bands(f, field_bytes, true, &largest);
    const double peak = base + fmax(fmax(MAKING * grid_bytes, grid_bytes + field_bytes), (double)largest);
    char grid_text[32], field_text[32], peak_text[32];
    printf("voxels        about %.3g of %.4g, %.4g along the longest side\n",
           (double)t->made.active_voxels * more, t->made.voxel_size / t->finer, TRIAL_RESOLUTION * t->finer);
    printf("memory        about %s at most: level set %s, field %s\n",
           cli_bytes_text((uint64_t)peak, peak_text, sizeof peak_text),
           cli_bytes_text((uint64_t)grid_bytes, grid_text, sizeof grid_text),
           cli_bytes_text((uint64_t)field_bytes, field_text, sizeof field_text));
    printf("time          about %.2g s: voxelize %.2g s, field %.2g s, bake %.2g s (%s)\n",
           voxelize + field + bake, voxelize, field, bake, time_note);
    return code;
}

int cli_bake_forecast(const cli_targets *targets, const vsh_assets *assets, const vsh_run *run,
                      int32_t band_rows) {
    const vsh_scene *scene = &targets->scene;
    forecast f = {.scene = scene, .assets = assets, .targets = targets, .run = run, .band_rows = band_rows};
    f.charts = calloc(scene->receiver_count, sizeof *f.charts);
    if (f.charts == NULL) {
        cli_say("forecast: the system refused memory");
        return CLI_LIMIT;
    }
    int code = count_texels(&f);
    trial t = {0};
    code = code == CLI_OK ? try_small(&f, &t) : code;
    code = code == CLI_OK ? predict(&f, &t) : code;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        vsh_charts_free(f.charts[i]);
    }
    free(f.charts);
    return code;
}
