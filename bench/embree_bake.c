/* A lightmap by Embree alone, a whole process from its mesh to its file: what whole bakes are held against.
 *
 *   vsh_embree_bake INPUT -o OUT.exr [--sun X,Y,Z --sun-angle DEGREES] [--ao DISTANCE] [--size N] [--rays N]
 *       [--frame N] [--threads N] [--stats FILE.json]
 *
 * It loads, rasterises, judges validity, pads and writes as `vdbshade bake` does, by the same code; between
 * that it traces N rays a texel (16) of the same sampler in Embree's packets. No level set, no field, no
 * proofs, nothing that texels share. */
#include "bake/lift.h"
#include "bake/nearest_valid.h"
#include "bake_scene/channels.h"
#include "bake_scene/job.h"
#include "base/clock.h"
#include "base/parallel.h"
#include "bench.h"
#include "embree_rays.h"
#include "shade/inside.h"

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
    const vsh_triangles *triangles;
    vshi_channels channels;
    uint8_t *state;        /* [texels]: VSHI_TEXEL_… */
    uint8_t *valid;        /* [samples] */
    uint8_t *dropped;      /* [samples] */
    vshi_lift_light light; /* of one channel: these four */
    bench_rays_task task;
    uint32_t (*net)[2];
    float *plane;
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

static size_t end_of(const baking *b, size_t block) {
    const size_t end = (block + 1) * VSHI_ORIGIN_BLOCK;
    return end < b->texels->count ? end : b->texels->count;
}

/* src/bake/origins.c without a field. */
static void drop(void *user, size_t begin, size_t end) {
    const baking *b = user;
    for (size_t block = begin; block < end; ++block) {
        vshi_lift_drop(b->texels, b->triangles, block * VSHI_ORIGIN_BLOCK, end_of(b, block), b->dropped);
    }
}

static void validate(void *user, size_t begin, size_t end) {
    const baking *b = user;
    for (size_t block = begin; block < end; ++block) {
        const size_t first = block * VSHI_ORIGIN_BLOCK, last = end_of(b, block);
        uint8_t where[VSHI_ORIGIN_BLOCK];
        vshi_origins_inside(b->texels, b->dropped, b->triangles, first, last, NULL, NULL, where);
        for (size_t i = first; i < last; ++i) {
            b->valid[i] = where[i - first] == VSHI_OUTSIDE;
            b->state[vshi_sample_held(b->texels, i)] = b->valid[i] ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
        }
    }
}

static void shade(void *user, size_t begin, size_t end) {
    const baking *b = user;
    const vsh_texels *texels = b->texels;
    const double lift = vshi_triangles_lift(b->triangles);
    for (size_t block = begin; block < end; ++block) {
        double origins[3 * VSHI_ORIGIN_BLOCK];
        float normals[3 * VSHI_ORIGIN_BLOCK], values[VSHI_ORIGIN_BLOCK];
        uint32_t of[VSHI_ORIGIN_BLOCK];
        size_t count = 0;
        for (size_t i = block * VSHI_ORIGIN_BLOCK; i < end_of(b, block); ++i) {
            if (b->valid[i]) {
                const float *normal = texels->normal + 3 * i;
                const vshi_vec p = vshi_add(vshi_lift_place(texels, &b->light, i, b->dropped[i] != 0),
                                            vshi_scale(vshi_vec_off(normal), lift));
                double *to = origins + 3 * count;
                to[0] = p.x, to[1] = p.y, to[2] = p.z;
                memcpy(normals + 3 * count, normal, 3 * sizeof *normal);
                of[count++] = texels->texel[i];
            }
        }
        bench_rays_trace(&b->task, (const uint32_t(*)[2])b->net, count, origins, normals, of, values);
        for (size_t k = 0; k < count; ++k) {
            b->plane[vsh_texel_place(of[k], texels->info.width)] = values[k];
        }
    }
}

static void in_blocks(baking *b, const vsh_run *run, vshi_range_fn *step) {
    vsh_error error;
    const size_t blocks = (b->texels->count + VSHI_ORIGIN_BLOCK - 1) / VSHI_ORIGIN_BLOCK;
    vshi_job *job = vshi_job_begin(run, "bake", blocks);
    bench_check(vshi_parallel_for(job, blocks, 1, 1, step, b, &error), &error);
    vshi_job_end(job);
}

/* A light's visibility, or (NULL) AO, of all valid texels. */
static void bake_plane(baking *b, const options *o, const vsh_light *light, const vsh_run *run,
                       float *plane) {
    b->light = vshi_lift_light_of(light);
    b->plane = plane;
    b->task.light = light != NULL ? &b->light.place : NULL;
    b->task.distance = o->ao;
    in_blocks(b, run, shade);
}

/* As vsh_bake_lightmap() leaves it: coverage, and values for texels without. */
static void fill(baking *b, const vsh_run *run) {
    vsh_error error;
    vshi_spread spread = {0};
    vshi_plane planes[2];
    size_t count = 0;
    const vsh_lightmap *map = &b->channels.lightmap;
    if (map->shadow != NULL) {
        planes[count++] = (vshi_plane){map->shadow[0], 1};
    }
    if (map->ao != NULL) {
        planes[count++] = (vshi_plane){map->ao, 1};
    }
    for (size_t i = 0; i < vshi_texels_held(b->texels); ++i) {
        map->coverage[i] = b->state[i] == VSHI_TEXEL_VALID ? 1.0f : 0.0f;
    }
    bench_check(vshi_spread_find(b->texels, b->state, &spread, &error), &error);
    vshi_spread_copy(&spread, b->state, planes, count);
    const int32_t padding = b->texels->padding, least = VSHI_LEAST_INVALID_RADIUS;
    const int32_t radius[VSHI_TEXEL_KINDS] = {
        [VSHI_TEXEL_EMPTY] = padding, [VSHI_TEXEL_INVALID] = padding > least ? padding : least};
    bench_check(vshi_padding_fill(run, b->texels->info.width, b->texels->info.height, b->state, radius,
                                  planes, count, &error),
                &error);
    vshi_spread_free(&spread);
}

static void write_stats(const options *o, const baking *b, const double at[5]) {
    FILE *file = fopen(o->stats, "w");
    size_t valid = 0;
    for (size_t i = 0; i < b->texels->count; ++i) {
        valid += b->valid[i];
    }
    if (file == NULL) {
        perror(o->stats);
        exit(3);
    }
    fprintf(file,
            "{\"stages_s\": {\"load\": %.4f, \"texels\": %.4f, \"tree\": %.4f, \"bake\": %.4f, "
            "\"write\": %.4f}, \"texels\": %zu, \"invalid_texels\": %zu}\n",
            at[0], at[1] - at[0], at[2] - at[1], at[3] - at[2], at[4] - at[3], b->texels->count,
            b->texels->count - valid);
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
    baking b = {.texels = job->texels, .triangles = triangles};
    b.task = (bench_rays_task){.triangles = triangles, .sampler = sampler, .rays = o.rays};
    b.net = sampler != NULL ? bench_rays_net(sampler, o.rays) : NULL;
    if (b.net == NULL) {
        fputs("embree_bake: the system refused memory\n", stderr);
        return 4;
    }
    const size_t samples = b.texels->count, texels = vshi_texels_held(b.texels);
    b.valid = bench_take(samples);
    b.dropped = bench_take(samples);
    memset(b.dropped, 0, samples);
    b.state = bench_take(texels);
    memset(b.state, VSHI_TEXEL_EMPTY, texels);
    bench_check(vshi_channels_name(&scene, o.size, o.size, &b.channels, &error), &error);
    bench_check(vshi_channels_allocate(&b.channels, &scene, o.size, false, 0, o.output, &error), &error);
    in_blocks(&b, &run, drop);
    in_blocks(&b, &run, validate);
    if (o.lit) {
        bake_plane(&b, &o, &sun, &run, b.channels.lightmap.shadow[0]);
    }
    if (o.ao > 0.0) {
        bake_plane(&b, &o, NULL, &run, b.channels.lightmap.ao);
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
    free(b.state);
    free(b.dropped);
    free(b.valid);
    free(b.net);
    vshi_sampler_free(sampler);
    vsh_triangles_free(triangles);
    vsh_bake_job_free(job);
    return 0;
}
