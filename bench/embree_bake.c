/* Bakes a lightmap with Embree rays alone, from mesh to file: the baker that whole bakes are compared with.
 *
 *   vsh_embree_bake INPUT -o OUT.exr [--sun X,Y,Z --sun-angle DEGREES] [--ao DISTANCE] [--size N] [--rays N]
 *       [--frame N] [--threads N] [--stats FILE.json]
 *
 * It loads, rasterises, finds valid texels, pads and writes with the code of `vdbshade bake`. In between it
 * traces N rays a texel (16) of the same sampler in Embree's packets, without level set, proofs or sharing.
 * Many rays of another frame give the truth. */
#include "base/clock.h"
#include "base/parallel.h"
#include "common.h"
#include "embree_rays.h"
#include "field/field.h"
#include "lightmap/page.h"
#include "scene/assets.h"
#include "scene/bake_scene.h"
#include "trace/embree_scene.h"

#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/base.h>

typedef struct options {
    const char *input, *output, *stats;
    double sun[3], sun_angle, ao;
    bool lit;
    int32_t size, rays, frame, threads;
} options;

/* A lightmap being baked. */
typedef struct baking {
    vshi_page page;
    vshi_placement placement;
    vshi_lifter lifters[2]; /* for the sun, for AO */
    bench_rays_task tasks[2];
    float *planes[2]; /* NULL: not baked */
    uint32_t (*net)[2];
} baking;

static void usage(void) {
    fputs("usage: the first lines of bench/embree_bake.c\n", stderr);
    exit(2);
}

static options parse(int argc, char **argv) {
    enum { SUN = 256, ANGLE, AO, SIZE, RAYS, FRAME, THREADS, STATS };
    static const struct option known[] = {
        {"sun", 1, NULL, SUN},         {"sun-angle", 1, NULL, ANGLE}, {"ao", 1, NULL, AO},
        {"size", 1, NULL, SIZE},       {"rays", 1, NULL, RAYS},       {"frame", 1, NULL, FRAME},
        {"threads", 1, NULL, THREADS}, {"stats", 1, NULL, STATS},     {NULL, 0, NULL, 0}};
    options o = {.sun_angle = 0.53, .size = 1024, .rays = 16};
    for (int key; (key = getopt_long(argc, argv, "o:", known, NULL)) != -1;) {
        switch (key) {
        case 'o':
            o.output = optarg;
            break;
        case SUN:
            o.lit = sscanf(optarg, "%lf,%lf,%lf", &o.sun[0], &o.sun[1], &o.sun[2]) == 3;
            break;
        case ANGLE:
            o.sun_angle = atof(optarg);
            break;
        case AO:
            o.ao = atof(optarg);
            break;
        case SIZE:
            o.size = atoi(optarg);
            break;
        case RAYS:
            o.rays = atoi(optarg);
            break;
        case FRAME:
            o.frame = atoi(optarg);
            break;
        case THREADS:
            o.threads = atoi(optarg);
            break;
        case STATS:
            o.stats = optarg;
            break;
        default:
            usage();
        }
    }
    if (optind + 1 != argc || o.output == NULL || !(o.lit || o.ao > 0.0) || o.rays < 1 || o.rays > 1 << 20) {
        usage();
    }
    o.input = argv[optind];
    return o;
}

/* A field whose distances are 0 everywhere: it proves nothing, and the rules for rays' origins need one. */
static const vsh_field *field_of_nothing_known(const vshi_triangles *triangles) {
    static int32_t index[8];
    static int16_t values[VSHI_BRICK_VALUES];
    static vsh_field field = {.index = index, .values = values, .level_count = 1};
    field.voxel_size = triangles->size / 96.0; /* as vdbshade chooses it without voxels */
    field.levels[0] = (vshi_level){.brick_count = 1, .scale = 0x1p60f, .band = 0x1p60f, .quantum = 0x1p46f};
    for (int axis = 0; axis < 3; ++axis) {
        field.levels[0].origin[axis] = -VSHI_BRICK_CELLS;
        field.levels[0].size[axis] = 2;
        field.to_field[5 * axis] = 1.0 / field.voxel_size;
        field.to_field[4 * axis + 3] = -triangles->centre[axis] / field.voxel_size;
    }
    return &field;
}

/* A tile's samples, one a texel, and their rays' origins. */
typedef struct tile_work {
    vshi_samples samples;
    vshi_origins origins;
    double *from; /* [VSHI_TILE²][3] */
    float *values;
} tile_work;

static void trace_plane(const baking *b, tile_work *w, size_t channel) {
    const bench_rays_task *task = &b->tasks[channel];
    vshi_origins *o = &w->origins;
    const double offset = vshi_triangles_offset(task->triangles);
    vshi_origins_lift(&b->lifters[channel], &w->samples, true, o);
    for (size_t k = 0; k < 3 * o->count; ++k) {
        w->from[k] = o->start[k] + offset * (double)o->face[k];
    }
    bench_rays_trace(task, (const uint32_t(*)[2])b->net, o->count, w->from, o->normal, o->face, o->texel,
                     w->values);
    for (size_t k = 0; k < o->count; ++k) {
        b->planes[channel][vshi_page_place(&b->page, o->texel[k])] = w->values[k];
    }
}

static void bake_tile(baking *b, tile_work *w, size_t number) {
    vshi_tile tile;
    vsh_error error;
    bench_check(vshi_tile_open(&b->page.charts->sorted, number, &tile, &error), &error);
    vshi_sample_writer writer = {.charts = b->page.charts, .tile = &tile, .samples = &w->samples};
    w->samples.count = 0;
    vshi_samples_write_rows(&writer, &tile, 0, VSHI_TILE_CELLS);
    vshi_tile_close(&tile);
    vshi_origins_find(&b->placement, &w->samples, &w->origins);
    for (size_t i = 0; i < w->samples.count; ++i) {
        const size_t place = vshi_page_place(&b->page, w->samples.texel[i]);
        b->page.mesh[place] = vshi_sample_mesh(&w->samples, i) + 1;
        b->page.state[place] = w->origins.valid[i] != 0 ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
    }
    for (size_t channel = 0; channel < 2; ++channel) {
        if (b->planes[channel] != NULL) {
            trace_plane(b, w, channel);
        }
    }
}

static void bake_tiles(void *user, size_t begin, size_t end) {
    enum { ROOM = VSHI_TILE * VSHI_TILE };
    baking *b = user;
    tile_work w = {.from = bench_take(3 * ROOM * sizeof *w.from),
                   .values = bench_take(ROOM * sizeof *w.values)};
    vsh_error error;
    bench_check(vshi_samples_allocate(&w.samples, ROOM, false, &error), &error);
    bench_check(vshi_origins_allocate(&w.origins, ROOM, &error), &error);
    for (size_t tile = begin; tile < end; ++tile) {
        if (b->page.charts->samples[tile] > 0) {
            bake_tile(b, &w, tile);
        }
    }
    vshi_origins_free(&w.origins);
    vshi_samples_free(&w.samples);
    free(w.values);
    free(w.from);
}

static void bake_all(baking *b, const vsh_run *run, vsh_bake_stats *stats) {
    vsh_error error;
    const size_t tiles = vshi_charts_tiles(&b->page.charts->sorted);
    vshi_job *job = vshi_job_begin(run, "bake", tiles);
    bench_check(vshi_parallel_for(job, tiles, 1, 1, bake_tiles, b, &error), &error);
    vshi_job_end(job);
    bench_check(vshi_page_finish(&b->page, run, stats, &error), &error);
}

static void write_image(vshi_channels *channels, const vsh_receiver *receiver) {
    vsh_error error;
    vsh_image image = channels->image;
    const size_t texels = (size_t)image.width * (size_t)image.height;
    float *memory = bench_take((size_t)image.channel_count * texels * sizeof *memory);
    const float *planes[VSH_MAX_CHANNELS];
    size_t plane = 0;
    for (size_t i = 0; i < channels->value_count; ++i) {
        for (size_t c = 0; c < channels->components[i]; ++c, ++plane) {
            for (size_t t = 0; t < texels; ++t) {
                memory[plane * texels + t] = channels->values[i][channels->components[i] * t + c];
            }
            planes[plane] = memory + plane * texels;
        }
    }
    image.planes = planes;
    const vsh_image_options how = vshi_receiver_image(receiver);
    bench_check(vsh_image_write(receiver->output, &image, &how, &error), &error);
    free(memory);
}

static void write_stats(const options *o, const vsh_bake_stats *stats, const double at[5]) {
    FILE *file = fopen(o->stats, "w");
    if (file == NULL) {
        perror(o->stats);
        exit(3);
    }
    fprintf(file,
            "{\"stages_s\": {\"load\": %.4f, \"texels\": %.4f, \"tree\": %.4f, \"bake\": %.4f, "
            "\"write\": %.4f}, \"texels\": %llu, \"invalid_texels\": %llu}\n",
            at[0], at[1] - at[0], at[2] - at[1], at[3] - at[2], at[4] - at[3],
            (unsigned long long)stats->texels, (unsigned long long)stats->invalid_texels);
    fclose(file);
}

int main(int argc, char **argv) {
    const int32_t served = vsh_reader_serve(argc, argv); /* as its own reader */
    if (served >= 0) {
        return served;
    }
    const options o = parse(argc, argv);
    const double start = vshi_seconds();
    double at[5];
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = o.threads;
    run.reader = "/proc/self/exe";
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, o.sun, sizeof o.sun);
    sun.angle = o.sun_angle * 3.14159265358979323846 / 180.0;
    vsh_caster caster = {.type = VSH_CASTER_MESH, .path = o.input};
    caster.transform[0] = caster.transform[5] = caster.transform[10] = 1.0;
    vsh_receiver receiver = vsh_receiver_default();
    receiver.path = o.input;
    receiver.output = o.output;
    receiver.width = receiver.height = o.size;
    vsh_scene scene = vsh_scene_default();
    scene.casters = &caster;
    scene.receivers = &receiver;
    scene.lights = &sun;
    scene.caster_count = scene.receiver_count = 1;
    scene.light_count = o.lit ? 1 : 0;
    scene.ao = o.ao > 0.0;

    vsh_assets *assets = NULL;
    vsh_charts *charts = NULL;
    size_t mesh_count = 0;
    bench_check(vsh_assets_load(&scene, &run, &assets, &error), &error);
    at[0] = vshi_seconds() - start;
    const vsh_mesh *meshes = vsh_assets_receiver(assets, 0, &mesh_count);
    bench_check(vsh_receiver_charts(&scene, 0, meshes, mesh_count, &run, &charts, &error), &error);
    at[1] = vshi_seconds() - start;
    vshi_triangles *triangles = NULL;
    bench_check(vshi_scene_triangles(&scene, assets, NULL, &run, &triangles, &error), &error);
    at[2] = vshi_seconds() - start;
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, o.rays, o.frame);
    baking b = {.net = sampler != NULL ? bench_rays_net(sampler, o.rays) : NULL};
    if (b.net == NULL) {
        fputs("embree_bake: the system refused memory\n", stderr);
        return 4;
    }
    /* origins and validity as for casters without voxels */
    vsh_occluders *occluders = NULL;
    vshi_occluder_parts parts = {.field = NULL};
    parts.triangles = triangles;
    parts.field = field_of_nothing_known(triangles);
    bench_check(vshi_occluders_make(&parts, NULL, &occluders, &error), &error);
    vsh_shade_options exact = vsh_shade_options_default();
    exact.method = VSH_SHADOW_EXACT;
    exact.ao_method = VSH_AO_EXACT;
    exact.ao_distance = o.ao > 0.0 ? o.ao : exact.ao_distance;
    b.placement = vshi_placement_open(occluders, &exact, o.lit, scene.ao != 0, run.isa);
    vshi_store store = {.run = &run};
    vshi_channels channels;
    bench_check(vshi_channels_name(&scene, o.size, o.size, &channels, &error), &error);
    bench_check(vshi_channels_allocate(&channels, &scene, &store, o.output, &error), &error);
    bench_check(
        vshi_page_open(charts, &channels.lightmap, scene.light_count, &exact, false, &store, &b.page, &error),
        &error);
    b.planes[0] = o.lit ? channels.lightmap.shadow[0] : NULL;
    b.planes[1] = channels.lightmap.ao;
    for (size_t i = 0; i < 2; ++i) {
        b.lifters[i] = vshi_lifter_open(occluders, i == 0 ? &sun : NULL);
        b.tasks[i] = (bench_rays_task){.triangles = triangles,
                                       .sampler = sampler,
                                       .rays = o.rays,
                                       .light = i == 0 ? &b.lifters[i].place : NULL,
                                       .distance = o.ao};
    }
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake_all(&b, &run, &stats);
    at[3] = vshi_seconds() - start;
    write_image(&channels, &receiver);
    at[4] = vshi_seconds() - start;
    if (o.stats != NULL) {
        write_stats(&o, &stats, at);
    }
    vshi_page_close(&b.page);
    vshi_channels_free(&channels);
    vshi_store_close(&store);
    vsh_occluders_free(occluders);
    free(b.net);
    vshi_sampler_free(sampler);
    vshi_triangles_free(triangles);
    vsh_charts_free(charts);
    vsh_assets_free(assets);
    return 0;
}
