/* Timing and printing shared by the benchmarks. */
#ifndef BENCH_H
#define BENCH_H

#include "metrics.h"

#include <stdio.h>
#include <vdbshade/vdbshade.h>

enum { BENCH_RUNS = 5 };

/* Processor seconds of this process: what a shared machine does beside it counts least. */
double bench_seconds(void);

/* Seconds of the wall clock: for what runs on several threads. */
double bench_wall(void);

int32_t bench_cores(void);

/* Median of the runs' seconds; sorts them. */
double bench_median(double *seconds, size_t count);

/* Memory, or the end of the program. */
void *bench_take(size_t bytes);

/* Ends the program with the error where a call has failed. */
void bench_check(vsh_result result, const vsh_error *error);

/* The samples of charts; free them with vsh_texels_free(). */
vsh_texels *bench_texels(const vsh_charts *charts);

/* One row: scene, what, µs a texel (median), samples a texel, times an outside measure, error against truth.
 */
void bench_header(FILE *csv);
void bench_row(FILE *csv, const char *scene, const char *what, double microseconds, double samples,
               double embree_rays, const truth_metrics *error);

/* One row of the ratios: ours and another library's µs for the same (a ray, a sample), on `threads` threads
 * (0: all cores), and how far the results are apart. */
void bench_ratio(FILE *csv, const char *part, const char *scene, const char *what, const char *other,
                 int threads, double ours, double theirs, double difference);

/* Median seconds of `runs` calls on one thread. `deviation` may be NULL. */
double bench_shadow(int runs, const vsh_occluders *occluders, const vsh_points *points,
                    const vsh_light *light, const vsh_shade_options *shade, float *values, float *deviation,
                    vsh_shade_stats *stats);
double bench_ao(int runs, const vsh_occluders *occluders, const vsh_points *points,
                const vsh_shade_options *shade, float *values, vsh_shade_stats *stats);

/* A row for each method that marches one ray or cone. `valid` may be NULL; ray: seconds of an Embree ray, or
 * 0. */
void bench_methods(FILE *csv, const char *scene, const vsh_field *field, const vsh_points *points,
                   const vsh_light *light, double ray, const float *truth, const float *valid, float *values);

void bench_seeds(FILE *csv);
void bench_asset(FILE *csv);
void bench_shadow_lightmaps(FILE *csv);
void bench_ao_lightmaps(FILE *csv);
void bench_refine(FILE *csv);
void bench_proofs(FILE *csv);
void bench_points(FILE *csv);
void bench_intersector(FILE *csv);
void bench_nanovdb(FILE *csv);
void bench_all_cores(FILE *csv);
void bench_read(FILE *csv);
/* A sheet of a million triangles; but for the bare one with UVs and normals (sheet.c). */
void bench_write_obj(const char *path);
void bench_write_bare_obj(const char *path);
void bench_write_ascii_ply(const char *path);
void bench_write_ply(const char *path);
void bench_write_glb(const char *path);

void bench_read_header(FILE *csv);
void bench_levelset(FILE *csv);
void bench_levelset_header(FILE *csv);
void bench_scaling(FILE *csv);
void bench_scaling_header(FILE *csv);
void bench_features(FILE *csv);
void bench_features_header(FILE *csv);

/* One row of the features, in a process of its own; prints it for bench_features(). */
#define BENCH_FEATURE "--feature"
int bench_feature(int index);

#endif
