/* The same level set and the same rays in OpenVDB's LevelSetRayIntersector and in NanoVDB's ZeroCrossing: µs
 * a ray, on one core and on all. And the cone march's samples against NanoVDB's, at the same places. */
#include "analytic.h"
#include "bench.h"
#include "casts.h"
#include "directions.h"
#include "scenes.h"
#include "vdb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 60000, DIRECTIONS = 16, RESOLUTION = 512, RUNS = 3 };

static const double SUN[3] = {-0.5, 0.8, -0.6};
static const double SUN_ANGLE = 5.0 * 3.14159265358979323846 / 180.0;

/* ZeroCrossing compares signs with the voxel in which a ray begins: its far corner is up to √3 voxels away.
 */
static const double LIFT = 0.25, CLEAR_LIFT = 1.75;

typedef struct subject {
    bench_scene scene;
    vsh_grid *grid;
    vsh_field *field;
    double *positions, *origins; /* [POINTS][3]: on the surface, and where rays begin */
    float *normals, *valid, *values;
    double directions[DIRECTIONS][3];
    uint8_t *mask;        /* [DIRECTIONS][POINTS]: valid, and above the horizon */
    uint8_t *ours, *hits; /* likewise */
    double traced;        /* rays */
} subject;

/* Texels of the scene, rays to points of the sun's disc, from `lift` voxels above. */
static subject prepare(int which, double lift) {
    subject s;
    vsh_error error;
    bench_scene_make(which, &s.scene);
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = RESOLUTION;
    bench_check(vsh_grid_from_meshes(s.scene.meshes, s.scene.mesh_count, &voxels, NULL, &s.grid, &error),
                &error);
    bench_check(vsh_field_create(s.grid, NULL, NULL, &s.field, &error), &error);
    s.positions = bench_take((size_t)POINTS * 3 * sizeof *s.positions);
    s.origins = bench_take((size_t)POINTS * 3 * sizeof *s.origins);
    s.normals = bench_take((size_t)POINTS * 3 * sizeof *s.normals);
    s.valid = bench_take(POINTS * sizeof *s.valid);
    s.values = bench_take(POINTS * sizeof *s.values);
    s.mask = bench_take((size_t)POINTS * DIRECTIONS);
    s.ours = bench_take((size_t)POINTS * DIRECTIONS);
    s.hits = bench_take((size_t)POINTS * DIRECTIONS);
    bench_scene_points(&s.scene, s.field, 9, POINTS, s.positions, s.normals, s.valid);
    vsh_field_info info;
    vsh_field_get_info(s.field, &info);
    for (size_t i = 0; i < (size_t)POINTS * 3; ++i) {
        s.origins[i] = s.positions[i] + lift * info.voxel_size * (double)s.normals[i];
    }
    const truth_frame frame = truth_frame_around(SUN);
    s.traced = 0.0;
    for (size_t d = 0; d < DIRECTIONS; ++d) {
        truth_light_direction(&frame, tan(0.5 * SUN_ANGLE), d, DIRECTIONS, s.directions[d]);
        for (size_t i = 0; i < POINTS; ++i) {
            const float *n = &s.normals[3 * i];
            const double up = s.directions[d][0] * (double)n[0] + s.directions[d][1] * (double)n[1] +
                              s.directions[d][2] * (double)n[2];
            const uint8_t traced = s.valid[i] > 0.0f && up > 1e-6;
            s.mask[d * POINTS + i] = traced;
            s.traced += traced;
        }
    }
    return s;
}

static void release(subject *s) {
    free(s->hits);
    free(s->ours);
    free(s->mask);
    free(s->values);
    free(s->valid);
    free(s->normals);
    free(s->origins);
    free(s->positions);
    vsh_field_free(s->field);
    vsh_grid_free(s->grid);
    bench_scene_free(&s->scene);
}

static double trace_ours(const subject *s, int32_t method, int threads, double *wall) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = threads;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = method;
    shade.rays = DIRECTIONS;
    shade.start_offset = 0.0;
    const vsh_points points = {POINTS, s->origins, s->normals, NULL};
    vsh_light sun = vsh_light_default();
    const double start = bench_seconds(), start_wall = bench_wall();
    if (method == VSH_SHADOW_RAYS) {
        memcpy(sun.direction, SUN, sizeof SUN);
        sun.angle = SUN_ANGLE;
        bench_check(vsh_shade_shadow(bench_casts(s->field), &points, &sun, &shade, &run, s->values, NULL,
                                     NULL, &error),
                    &error);
        *wall = bench_wall() - start_wall;
        return bench_seconds() - start;
    }
    sun.angle = 0.0;
    for (size_t d = 0; d < DIRECTIONS; ++d) {
        memcpy(sun.direction, s->directions[d], sizeof sun.direction);
        bench_check(vsh_shade_shadow(bench_casts(s->field), &points, &sun, &shade, &run, s->values, NULL,
                                     NULL, &error),
                    &error);
        for (size_t i = 0; i < POINTS; ++i) {
            s->ours[d * POINTS + i] = s->values[i] < 0.5f;
        }
    }
    *wall = bench_wall() - start_wall;
    return bench_seconds() - start;
}

static double trace_theirs(const subject *s, const vdb_intersector *intersector, const vdb_nano *nano,
                           int threads, double *wall) {
    const double start = bench_seconds(), start_wall = bench_wall();
    for (size_t d = 0; d < DIRECTIONS; ++d) {
        vdb_rays rays = {POINTS, s->origins, &s->mask[d * POINTS], {0.0, 0.0, 0.0}};
        memcpy(rays.direction, s->directions[d], sizeof rays.direction);
        if (nano != NULL) {
            vdb_nano_trace(nano, &rays, threads, &s->hits[d * POINTS]);
        } else {
            vdb_intersector_trace(intersector, &rays, threads, &s->hits[d * POINTS]);
        }
    }
    *wall = bench_wall() - start_wall;
    return bench_seconds() - start;
}

/* Share of the rays that one meets something with and the other not; for the rays method, whose rays are its
 * own, the mean difference of the points' values. */
static double difference(const subject *s, int32_t method) {
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < POINTS; ++i) {
        double free_rays = 0.0, mask = 0.0;
        for (size_t d = 0; d < DIRECTIONS; ++d) {
            const size_t at = d * POINTS + i;
            if (s->mask[at]) {
                mask += 1.0;
                free_rays += !s->hits[at];
                sum += method == VSH_SHADOW_RAYS ? 0.0 : (double)(s->ours[at] != s->hits[at]);
            }
        }
        count += method == VSH_SHADOW_RAYS ? mask > 0.0 : mask;
        if (method == VSH_SHADOW_RAYS && mask > 0.0) {
            sum += fabs((double)s->values[i] - free_rays / DIRECTIONS);
        }
    }
    return sum / count;
}

/* Rows of one scene: the processor's seconds of one thread (median), and all cores' wall time (least). */
static void compare(FILE *csv, const char *part, const subject *s, int32_t method,
                    const vdb_intersector *intersector, const vdb_nano *nano) {
    const char *other = nano != NULL ? "ZeroCrossing" : "LevelSetRayIntersector";
    for (int threads = 1; threads >= 0; --threads) {
        double ours[RUNS], theirs[RUNS], our_wall = INFINITY, their_wall = INFINITY;
        for (int run = 0; run < RUNS; ++run) {
            double wall;
            ours[run] = trace_ours(s, method, threads, &wall);
            our_wall = fmin(our_wall, wall);
            theirs[run] = trace_theirs(s, intersector, nano, threads, &wall);
            their_wall = fmin(their_wall, wall);
        }
        const double each = 1e6 / s->traced;
        bench_ratio(csv, part, s->scene.name, vsh_get_name(VSH_NAMES_SHADOW, method), other, threads,
                    each * (threads == 1 ? bench_median(ours, RUNS) : our_wall),
                    each * (threads == 1 ? bench_median(theirs, RUNS) : their_wall), difference(s, method));
    }
}

void bench_intersector(FILE *csv) {
    for (int which = 0; which < BENCH_SCENES; ++which) {
        subject s = prepare(which, LIFT);
        vdb_intersector *intersector = vdb_intersector_create(s.grid);
        compare(csv, "intersector", &s, VSH_SHADOW_HARD, intersector, NULL);
        compare(csv, "intersector", &s, VSH_SHADOW_RAYS, intersector, NULL);
        vdb_intersector_free(intersector);
        release(&s);
    }
}

/* Places where rays to the middle of the seeds' sun are sampled, ray by ray, stepping by the field's own
 * distance until they meet the surface or leave the solids' box. */
static size_t march_places(const vsh_field *field, const double *positions, size_t count, double *places,
                           size_t capacity) {
    enum { STEPS = 256 };
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    const truth_frame sun = truth_frame_around(truth_seeds_sun);
    size_t taken = 0;
    for (size_t i = 0; i < count && taken + STEPS < capacity; ++i) {
        double t = 0.25 * info.voxel_size;
        for (int step = 0; step < STEPS; ++step) {
            double *place = &places[3 * taken];
            int inside = 1;
            for (int k = 0; k < 3; ++k) {
                place[k] = positions[3 * i + (size_t)k] + t * sun.n[k];
                inside &= sun.n[k] > 0.0 ? place[k] <= info.bounds_max[k] : place[k] >= info.bounds_min[k];
            }
            if (!inside) {
                break;
            }
            float distance;
            vsh_field_sample(field, 1, place, &distance);
            ++taken;
            if (!(distance > 0.0f)) {
                break;
            }
            t += fmax((double)distance, 0.1 * info.voxel_size);
        }
    }
    return taken;
}

static void compare_samples(FILE *csv) {
    enum { CAPACITY = 4000000 };
    bench_seeds_scene seeds;
    bench_seeds_make(&seeds);
    vdb_nano *nano = vdb_nano_create(seeds.grid);
    double *places = bench_take((size_t)CAPACITY * 3 * sizeof *places);
    float *values = bench_take(CAPACITY * sizeof *values);
    const size_t taken = march_places(seeds.field, seeds.positions, seeds.count, places, CAPACITY);
    double seconds[BENCH_RUNS];
    for (int run = 0; run < BENCH_RUNS; ++run) {
        const double start = bench_seconds();
        vdb_nano_sample(nano, taken, places, values);
        seconds[run] = bench_seconds() - start;
    }
    const double theirs = bench_median(seconds, BENCH_RUNS) / (double)taken;
    const vsh_points points = {seeds.count, seeds.positions, seeds.normals, NULL};
    const vsh_shade_options shade = vsh_shade_options_default();
    vsh_shade_stats stats;
    const double ours =
        bench_shadow(BENCH_RUNS, bench_casts(seeds.field), &points, &seeds.sun, &shade, values, NULL, &stats);
    bench_ratio(csv, "nanovdb", "seeds", "cone by sample", "trilinear sample", 1,
                1e6 * ours / (double)stats.samples, 1e6 * theirs, 0.0);
    free(values);
    free(places);
    vdb_nano_free(nano);
    bench_seeds_free(&seeds);
}

void bench_nanovdb(FILE *csv) {
    for (int which = 0; which < BENCH_SCENES; ++which) {
        subject s = prepare(which, CLEAR_LIFT);
        vdb_nano *nano = vdb_nano_create(s.grid);
        if (nano == NULL) {
            puts("nanovdb: this program was built without NanoVDB (tools/packages.txt): left out");
            release(&s);
            return;
        }
        vsh_field_info info;
        vsh_field_get_info(s.field, &info);
        printf("%-9s NanoVDB grid %.1f MiB, field %.1f MiB\n", s.scene.name,
               (double)vdb_nano_bytes(nano) / 1048576.0, (double)info.bytes / 1048576.0);
        compare(csv, "nanovdb", &s, VSH_SHADOW_HARD, NULL, nano);
        vdb_nano_free(nano);
        release(&s);
    }
    compare_samples(csv);
}
