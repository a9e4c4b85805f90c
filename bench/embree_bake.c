/* A lightmap by Embree alone, a whole process from its mesh to its file: what whole bakes are held against.
 *
 *   vsh_embree_bake INPUT -o OUT.exr [--sun X,Y,Z --sun-angle DEGREES] [--ao DISTANCE] [--size N] [--rays N]
 *       [--frame N] [--threads N] [--stats FILE.json]
 *
 * It loads, rasterises, judges validity, pads and writes as `vdbshade bake` does, by the same code; between
 * that it traces N rays a texel (16) of the same sampler in Embree's packets. No level set, no field, no
 * proofs, nothing that texels share. Truth is that of many rays of another frame. */
#include "bake/average.h"
#include "bake/nearest_valid.h"
#include "bake/origins.h"
#include "bake_scene/channels.h"
#include "bake_scene/job.h"
#include "base/clock.h"
#include "base/parallel.h"
#include "bench.h"
#include "embree_rays.h"
#include "field/field.h"
#include "trace/embree_scene.h"

#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/reader.h>

typedef struct options {
    const char *input, *output, *stats;
    double sun[3], sun_angle, ao;
    bool lit;
    int32_t size, rays, frame, threads;
} options;

/* A lightmap under way. */
typedef struct baking {
    const vsh_texels *texels;
    const vsh_occluders *occluders;
    vshi_origins origins;
    vshi_channels channels;
    bench_rays_task task;
    uint32_t (*net)[2];
    float *plane; /* of the channel that is baked */
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

/* What stands for a field in the rules of where rays begin: one whose distances are 0 everywhere, which
 * proves nothing. */
static const vsh_field *field_of_nothing_known(const vsh_triangles *triangles) {
    static int32_t index[8];
    static int16_t values[VSHI_BRICK_VALUES];
    static vsh_field field = {.index = index, .values = values, .level_count = 1};
    field.voxel_size = triangles->size / 96.0; /* of the program's, where all is traced */
    field.levels[0] = (vshi_level){.brick_count = 1, .scale = 0x1p60f, .band = 0x1p60f, .quantum = 0x1p46f};
    for (int axis = 0; axis < 3; ++axis) {
        field.levels[0].origin[axis] = -VSHI_BRICK_CELLS;
        field.levels[0].size[axis] = 2;
        field.to_field[5 * axis] = 1.0 / field.voxel_size;
        field.to_field[4 * axis + 3] = -triangles->centre[axis] / field.voxel_size;
    }
    return &field;
}

/* A vshi_origins_keep: all samples are needed. */
static vsh_result keep_all(void *user, const vshi_origins *origins, uint8_t *rows, vsh_error *error) {
    (void)user, (void)origins, (void)rows, (void)error;
    return VSH_OK;
}

/* Valid samples begin … end - 1. */
static void shade(void *user, size_t begin, size_t end) {
    const baking *b = user;
    const vshi_origins *o = &b->origins;
    const double lift = vshi_triangles_lift(b->task.triangles);
    double from[3 * VSHI_ORIGIN_BLOCK];
    float values[VSHI_ORIGIN_BLOCK];
    const float *faces = o->face != NULL ? o->face + 3 * begin : NULL;
    const float *up = faces != NULL ? faces : o->normal + 3 * begin;
    for (size_t k = 0; k < 3 * (end - begin); ++k) {
        from[k] = o->start[3 * begin + k] + lift * (double)up[k];
    }
    bench_rays_trace(&b->task, (const uint32_t(*)[2])b->net, end - begin, from, o->normal + 3 * begin, faces,
                     o->texel + begin, values);
    for (size_t i = begin; i < end; ++i) {
        b->plane[vsh_texel_place(o->texel[i], b->texels->info.width)] = values[i - begin];
    }
}

/* A light's visibility, or (NULL) AO, of all valid texels. */
static void bake_plane(baking *b, const vsh_light *light, const vsh_run *run, float *plane) {
    vsh_error error;
    const vshi_lifter lifter = vshi_lifter_open(b->occluders, light);
    b->task.light = light != NULL ? &lifter.place : NULL;
    b->plane = plane;
    bench_check(vshi_origins_lift(&lifter, b->texels, true, run, &b->origins, &error), &error);
    vshi_job *job = vshi_job_begin(run, "bake", b->origins.count);
    bench_check(vshi_parallel_for(job, b->origins.count, VSHI_ORIGIN_BLOCK, 1, shade, b, &error), &error);
    vshi_job_end(job);
}

/* As vsh_bake_lightmap() leaves it: coverage, and values for texels without. */
static void fill(baking *b, const vsh_run *run) {
    vsh_error error;
    const vsh_texels *texels = b->texels;
    const vsh_lightmap *map = &b->channels.lightmap;
    const size_t count = vshi_texels_held(texels);
    uint8_t *state = bench_take(count);
    memset(state, VSHI_TEXEL_EMPTY, count);
    const vshi_average find = {.texels = texels, .origins = &b->origins, .state = state};
    bench_check(vshi_average_run(&find, run, &error), &error);
    for (size_t i = 0; i < count; ++i) {
        map->coverage[i] = state[i] == VSHI_TEXEL_VALID ? 1.0f : 0.0f;
    }
    vshi_plane planes[2];
    size_t plane_count = 0;
    if (map->shadow != NULL) {
        planes[plane_count++] = (vshi_plane){map->shadow[0], 1};
    }
    if (map->ao != NULL) {
        planes[plane_count++] = (vshi_plane){map->ao, 1};
    }
    vshi_spread spread = {0};
    bench_check(vshi_spread_find(texels, state, &spread, &error), &error);
    vshi_spread_copy(&spread, state, planes, plane_count);
    const int32_t padding = texels->padding, least = VSHI_LEAST_INVALID_RADIUS;
    const int32_t radius[VSHI_TEXEL_KINDS] = {
        [VSHI_TEXEL_EMPTY] = padding, [VSHI_TEXEL_INVALID] = padding > least ? padding : least};
    bench_check(vshi_padding_fill(run, texels->info.width, texels->info.height, state, radius, planes,
                                  plane_count, NULL, &error),
                &error);
    vshi_spread_free(&spread);
    free(state);
}

static void write_stats(const options *o, const baking *b, const double at[5]) {
    FILE *file = fopen(o->stats, "w");
    if (file == NULL) {
        perror(o->stats);
        exit(3);
    }
    fprintf(file,
            "{\"stages_s\": {\"load\": %.4f, \"texels\": %.4f, \"tree\": %.4f, \"bake\": %.4f, "
            "\"write\": %.4f}, \"texels\": %zu, \"invalid_texels\": %zu}\n",
            at[0], at[1] - at[0], at[2] - at[1], at[3] - at[2], at[4] - at[3], b->texels->count,
            b->texels->count - b->origins.count);
    fclose(file);
}

int main(int argc, char **argv) {
    const int32_t served = vsh_reader_serve(argc, argv); /* where it is its own reader */
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

    vsh_bake_job *job = NULL;
    bench_check(vsh_bake_job_create(&scene, NULL, &run, &job, &error), &error);
    at[0] = vshi_seconds() - start;
    bench_check(vsh_bake_job_measure(job, &run, &error), &error);
    at[1] = vshi_seconds() - start;
    vsh_triangles *triangles = NULL;
    bench_check(vsh_scene_triangles(&scene, vsh_bake_job_assets(job), NULL, &run, &triangles, &error),
                &error);
    at[2] = vshi_seconds() - start;
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, o.rays, o.frame);
    baking b = {.texels = job->texels};
    b.task = (bench_rays_task){.triangles = triangles, .sampler = sampler, .rays = o.rays, .distance = o.ao};
    b.net = sampler != NULL ? bench_rays_net(sampler, o.rays) : NULL;
    if (b.net == NULL) {
        fputs("embree_bake: the system refused memory\n", stderr);
        return 4;
    }
    /* samples begin, and are valid, as of casters that are traced only */
    vsh_occluders *occluders = NULL;
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    parts.triangles = triangles;
    parts.field = field_of_nothing_known(triangles);
    bench_check(vsh_occluders_from_parts(&parts, &occluders, &error), &error);
    b.occluders = occluders;
    vsh_shade_options exact = vsh_shade_options_default();
    exact.method = VSH_SHADOW_EXACT;
    exact.ao_method = VSH_AO_EXACT;
    const vshi_origins_for what = {.lights = o.lit, .ao = scene.ao != 0};
    bench_check(
        vshi_origins_create(occluders, b.texels, &exact, what, keep_all, NULL, &run, &b.origins, &error),
        &error);
    bench_check(vshi_channels_name(&scene, o.size, o.size, &b.channels, &error), &error);
    bench_check(vshi_channels_allocate(&b.channels, &scene, o.size, false, 0, o.output, &error), &error);
    if (o.lit) {
        bake_plane(&b, &sun, &run, b.channels.lightmap.shadow[0]);
    }
    if (scene.ao) {
        bake_plane(&b, NULL, &run, b.channels.lightmap.ao);
    }
    fill(&b, &run);
    at[3] = vshi_seconds() - start;
    const vsh_image_options image = vshi_receiver_image(&receiver);
    vshi_channels_split(&b.channels, &scene);
    bench_check(vsh_image_write(o.output, &b.channels.image, &image, &error), &error);
    at[4] = vshi_seconds() - start;
    if (o.stats != NULL) {
        write_stats(&o, &b, at);
    }
    vshi_channels_free(&b.channels);
    vshi_origins_free(&b.origins);
    vsh_occluders_free(occluders);
    free(b.net);
    vshi_sampler_free(sampler);
    vsh_triangles_free(triangles);
    vsh_bake_job_free(job);
    return 0;
}
