/* How soon a call answers its callback: every stage of every long call is asked to stop at 0, a tenth, a half
 * and 0.99, and the time from there to the call's return is measured, in processor time of all threads, as
 * other work on the machine must not count: on an idle one it takes no longer. Casters are voxelised at 256,
 * lightmaps and pictures have 512². Usage: vsh_cancel FILE.csv [CALL] */
#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VOXELS = 256, SIDE = 512, STAGES = 64, POINTS = 1 << 18 };
#define FONT "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf" /* of the package fonts-dejavu-core */

static const double fractions[] = {0.0, 0.1, 0.5, 0.99};
enum { FRACTIONS = sizeof fractions / sizeof fractions[0] };

/* What calls are given, and where they leave what they make. */
static struct {
    vsh_model *model;
    vsh_mesh *meshes;
    size_t mesh_count;
    vsh_sdf_node node;
    vsh_grid *grid;
    vsh_field *field;
    vsh_occluders *occluders; /* with triangles */
    vsh_occluders *marched;   /* without */
    vsh_charts *charts;
    vsh_voxels *voxels;
    vsh_triangles *triangles;
    vsh_outline *outline;
    vsh_query *query;
    vsh_light light;
    float *planes[6];
    double *positions;
    float *normals;
} made;

typedef struct watch {
    int stage, stop_stage; /* from 0 as they begin; -1: none */
    char names[STAGES][80];
    double last, stop_at, stopped; /* stopped: seconds; 0: not yet */
} watch;

static int32_t progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    if (w->stage < 0 || strcmp(w->names[w->stage], stage) != 0 || fraction < w->last) {
        w->stage += w->stage + 1 < STAGES;
        snprintf(w->names[w->stage], sizeof w->names[0], "%s", stage);
    }
    w->last = fraction;
    if (w->stopped <= 0.0 && w->stage == w->stop_stage && fraction >= w->stop_at && fraction < 1.0) {
        w->stopped = bench_seconds();
    }
    return w->stopped > 0.0;
}

/* --- the calls; each frees what it makes */

static vsh_result load(const vsh_run *run) {
    vsh_model *model;
    const vsh_result result = vsh_model_read(VSH_ASSETS "/smooth.glb", run, &model, NULL);
    vsh_model_free(model);
    return result;
}

static vsh_result load_obj(const vsh_run *run) {
    vsh_model *model;
    const vsh_result result = vsh_model_read(VSH_ASSETS "/cloister.obj", run, &model, NULL);
    vsh_model_free(model);
    return result;
}

static vsh_grid_options grid_options(void) {
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = VOXELS;
    return options;
}

static vsh_result from_meshes(const vsh_run *run) {
    const vsh_grid_options options = grid_options();
    vsh_grid *grid;
    const vsh_result result = vsh_grid_from_meshes(made.meshes, made.mesh_count, &options, run, &grid, NULL);
    vsh_grid_free(grid);
    return result;
}

static vsh_result from_sdf(const vsh_run *run) {
    const vsh_grid_options options = grid_options();
    const vsh_sdf sdf = {&made.node, 1};
    vsh_grid *grid;
    const vsh_result result = vsh_grid_from_sdf(&sdf, &options, run, &grid, NULL);
    vsh_grid_free(grid);
    return result;
}

static double twice(void *user, const double p[3]) {
    (void)user;
    return 2.0 * (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1.0);
}

static vsh_result from_distance(const vsh_run *run) {
    const vsh_grid_options options = grid_options();
    const vsh_distance distance = {twice, NULL, 2.0, 0, {-1, -1, -1}, {1, 1, 1}};
    vsh_grid *grid;
    const vsh_result result = vsh_grid_from_distance(&distance, &options, run, &grid, NULL);
    vsh_grid_free(grid);
    return result;
}

static vsh_result unite(const vsh_run *run) {
    const vsh_grid_options options = grid_options();
    const double moved[12] = {1, 0, 0, 0.123, 0, 1, 0, 0.3, 0, 0, 1, 0};
    const vsh_grid_instance instances[] = {{made.grid, NULL}, {made.grid, moved}};
    vsh_grid *grid;
    const vsh_result result = vsh_grid_unite(instances, 2, &options, run, &grid, NULL);
    vsh_grid_free(grid);
    return result;
}

static vsh_result extrude(const vsh_run *run) {
    const vsh_grid_options options = grid_options();
    vsh_grid *grid;
    const vsh_result result = vsh_grid_from_outline(made.outline, 1.0, NULL, &options, run, &grid, NULL);
    vsh_grid_free(grid);
    return result;
}

static vsh_result trace_letters(const vsh_run *run) {
    char text[4096];
    for (size_t i = 0; i + 1 < sizeof text; ++i) {
        text[i] = i % 64 == 63 ? '\n' : (char)('A' + i % 26);
    }
    text[sizeof text - 1] = '\0';
    vsh_outline *outline;
    const vsh_result result = vsh_outline_from_text(text, FONT, NULL, run, &outline, NULL);
    vsh_outline_free(outline);
    return result;
}

static vsh_result trace_mask(const vsh_run *run) {
    vsh_outline *outline;
    const vsh_result result = vsh_outline_from_image(VSH_ASSETS "/terrain.png", NULL, run, &outline, NULL);
    vsh_outline_free(outline);
    return result;
}

static vsh_result make_field(const vsh_run *run) {
    vsh_field_options options = vsh_field_options_default();
    options.reach = 2.0;
    vsh_field *field;
    const vsh_result result = vsh_field_create(made.grid, &options, run, &field, NULL);
    vsh_field_free(field);
    return result;
}

static vsh_result make_charts(const vsh_run *run) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    vsh_charts *charts;
    const vsh_result result =
        vsh_charts_create(made.meshes, made.mesh_count, &options, run, NULL, &charts, NULL);
    vsh_charts_free(charts);
    return result;
}

static vsh_result bake(const vsh_run *run, int32_t shadow, int32_t ao) {
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = shadow;
    shade.ao_method = ao;
    shade.max_error = 0.1;
    const vsh_lightmap map = {.shadow = &made.planes[0], .ao = made.planes[1], .coverage = made.planes[2]};
    return vsh_bake_lightmap(made.occluders, made.charts, &made.light, 1, &shade, run, &map, NULL, NULL);
}

static vsh_result bake_cones(const vsh_run *run) {
    return bake(run, VSH_SHADOW_CONE, VSH_AO_CONES);
}

static vsh_result bake_adaptive(const vsh_run *run) {
    return bake(run, VSH_SHADOW_ADAPTIVE, VSH_AO_ADAPTIVE);
}

static vsh_result bake_exact(const vsh_run *run) {
    return bake(run, VSH_SHADOW_EXACT, VSH_AO_EXACT);
}

static vsh_result bake_volume(const vsh_run *run) {
    vsh_volume_options options = vsh_volume_options_default();
    options.ao = 1;
    vsh_volume *volume;
    const vsh_result result =
        vsh_bake_volume(made.marched, made.voxels, &made.light, 1, &options, run, &volume, NULL, NULL);
    vsh_volume_free(volume);
    return result;
}

static vsh_result make_voxels(const vsh_run *run) {
    vsh_voxels *voxels;
    const vsh_result result = vsh_voxels_from_grid(made.grid, 0.0, run, &voxels, NULL);
    vsh_voxels_free(voxels);
    return result;
}

static vsh_result draw(const vsh_run *run) {
    vsh_render_options options = vsh_render_options_default();
    options.width = options.height = SIDE;
    options.ao = 1;
    options.shafts = 0.5;
    vsh_grid_info info;
    vsh_grid_get_info(made.grid, &info);
    vsh_error error;
    bench_check(vsh_camera_frame(&options.camera, info.bounds_min, info.bounds_max, 0.5, 0.5, 1.0, &error),
                &error);
    const vsh_surface surface = {made.field, {0.7, 0.7, 0.7}};
    const vsh_picture picture = {.color = made.planes[3]};
    return vsh_render(&surface, 1, made.marched, &made.light, 1, &options, run, &picture, NULL, NULL);
}

static vsh_result bake_flat(const vsh_run *run) {
    vsh_flat_options options = vsh_flat_options_default();
    options.width = options.height = SIDE;
    options.region_max[0] = 30.0;
    vsh_light lamp = vsh_light_default();
    lamp.type = VSH_LIGHT_SPHERE;
    lamp.position[1] = 2.0;
    lamp.radius = 0.5;
    const vsh_flat_map map = {&made.planes[0], NULL, made.planes[1]};
    return vsh_flat_bake(made.outline, &lamp, 1, &options, run, &map, NULL);
}

static vsh_result ask(const vsh_run *run) {
    vsh_query_output output = vsh_query_output_default();
    output.visibility = &made.planes[0];
    output.ao = made.planes[1];
    const vsh_points points = {POINTS, made.positions, made.normals, NULL};
    return vsh_query_points(made.query, &points, NULL, run, &output, NULL, NULL);
}

static vsh_result make_triangles(const vsh_run *run) {
    vsh_triangles *triangles;
    const vsh_result result = vsh_triangles_create(made.meshes, made.mesh_count, run, &triangles, NULL);
    vsh_triangles_free(triangles);
    return result;
}

static vsh_result trace(const vsh_run *run) {
    return vsh_trace_ao(made.triangles, NULL, POINTS / 8, made.positions, made.normals, 0.01, 1.0, 16, run,
                        made.planes[0], NULL);
}

static const struct {
    const char *name;
    vsh_result (*run)(const vsh_run *run);
} calls[] = {
    {"model_read glb", load},
    {"model_read obj", load_obj},
    {"grid_from_meshes", from_meshes},
    {"grid_from_sdf", from_sdf},
    {"grid_from_distance", from_distance},
    {"grid_unite", unite},
    {"outline_from_text", trace_letters},
    {"outline_from_image", trace_mask},
    {"grid_from_outline", extrude},
    {"field_create", make_field},
    {"charts_create", make_charts},
    {"triangles_create", make_triangles},
    {"bake cones", bake_cones},
    {"bake adaptive", bake_adaptive},
    {"bake exact", bake_exact},
    {"voxels_from_grid", make_voxels},
    {"bake_volume", bake_volume},
    {"render", draw},
    {"flat_bake", bake_flat},
    {"query_points", ask},
    {"trace_ao", trace},
};

static void prepare(void) {
    vsh_error error;
    const vsh_run run = vsh_run_default();
    made.node = vsh_sdf_node_default();
    made.light = vsh_light_default();
    made.light.angle = 0.2;
    bench_check(vsh_model_read(VSH_ASSETS "/cloister.glb", &run, &made.model, &error), &error);
    made.mesh_count = vsh_model_mesh_count(made.model);
    made.meshes = bench_take(made.mesh_count * sizeof *made.meshes);
    for (size_t i = 0; i < made.mesh_count; ++i) {
        made.meshes[i] = vsh_model_mesh(made.model, i, -1);
    }
    const vsh_grid_options voxels = grid_options();
    bench_check(vsh_grid_from_meshes(made.meshes, made.mesh_count, &voxels, &run, &made.grid, &error),
                &error);
    vsh_field_options reach = vsh_field_options_default();
    reach.reach = 2.0;
    bench_check(vsh_field_create(made.grid, &reach, &run, &made.field, &error), &error);
    vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    lightmap.width = lightmap.height = SIDE;
    bench_check(vsh_charts_create(made.meshes, made.mesh_count, &lightmap, &run, NULL, &made.charts, &error),
                &error);
    bench_check(vsh_triangles_create(made.meshes, made.mesh_count, &run, &made.triangles, &error), &error);
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    parts.field = made.field;
    bench_check(vsh_occluders_from_parts(&parts, &made.marched, &error), &error);
    parts.triangles = made.triangles;
    bench_check(vsh_occluders_from_parts(&parts, &made.occluders, &error), &error);
    bench_check(vsh_voxels_from_grid(made.grid, 0.0, &run, &made.voxels, &error), &error);
    bench_check(vsh_outline_from_text("The quick brown fox jumps over the lazy dog", FONT, NULL, &run,
                                      &made.outline, &error),
                &error);
    for (size_t i = 0; i < sizeof made.planes / sizeof made.planes[0]; ++i) {
        made.planes[i] = bench_take((size_t)3 * SIDE * SIDE * sizeof(float));
    }
    bench_check(vsh_query_create(made.marched, &made.light, 1, NULL, &made.query, &error), &error);
    vsh_texels *texels = bench_texels(made.charts);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    made.positions = bench_take((size_t)POINTS * 3 * sizeof *made.positions);
    made.normals = bench_take((size_t)POINTS * 3 * sizeof *made.normals);
    for (size_t i = 0; i < POINTS; ++i) {
        const size_t from = i * 7919 % samples.count;
        memcpy(made.positions + 3 * i, samples.positions + 3 * from, 3 * sizeof(double));
        memcpy(made.normals + 3 * i, samples.normals + 3 * from, 3 * sizeof(float));
    }
    vsh_texels_free(texels);
}

/* Seconds from the callback's answer to the return; negative: the stage passed over the fraction. */
static double latency(size_t call, int stage, double fraction, watch *w) {
    *w = (watch){.stage = -1, .stop_stage = stage, .stop_at = fraction};
    vsh_run run = vsh_run_default();
    run.progress = progress;
    run.user = w;
    const vsh_result result = calls[call].run(&run);
    const double end = bench_seconds();
    if (w->stopped > 0.0 && result != VSH_ERROR_CANCELLED) {
        fprintf(stderr, "bench: %s: stage %d: %s\n", calls[call].name, stage, vsh_result_name(result));
        exit(2);
    }
    return w->stopped > 0.0 ? end - w->stopped : -1.0;
}

int main(int argc, char **argv) {
    if (argc != 2 && argc != 3) {
        fputs("usage: vsh_cancel FILE.csv [CALL]\n", stderr);
        return 2;
    }
    FILE *csv = fopen(argv[1], "w");
    if (csv == NULL) {
        perror(argv[1]);
        return 3;
    }
    prepare();
    double worst = 0.0;
    fputs("call,stage,at_0_ms,at_0.1_ms,at_0.5_ms,at_0.99_ms\n", csv);
    printf("%-20s %-14s %8s %8s %8s %8s   ms\n", "call", "stage", "at 0", "0.1", "0.5", "0.99");
    for (size_t call = 0; call < sizeof calls / sizeof calls[0]; ++call) {
        watch all;
        if (argc == 3 && strcmp(argv[2], calls[call].name) != 0) {
            continue;
        }
        latency(call, -1, 0.0, &all);
        for (int stage = 0; stage <= all.stage; ++stage) {
            fprintf(csv, "%s,%s", calls[call].name, all.names[stage]);
            printf("%-20s %-14s", calls[call].name, all.names[stage]);
            for (size_t f = 0; f < FRACTIONS; ++f) {
                watch w;
                const double seconds = latency(call, stage, fractions[f], &w);
                worst = fmax(worst, seconds);
                if (seconds < 0.0) {
                    fputs(",", csv);
                    printf(" %8s", "-");
                } else {
                    fprintf(csv, ",%.1f", 1e3 * seconds);
                    printf(" %8.1f", 1e3 * seconds);
                }
                fflush(stdout);
            }
            fputs("\n", csv);
            printf("\n");
            fflush(stdout);
        }
    }
    printf("longest: %.1f ms\n", 1e3 * worst);
    return fclose(csv) != 0 || worst > 0.2;
}
