/* What it costs to make a mesh a level set and that a field, beside OpenVDB's meshToVolume of the same
 * triangles. */
#include "bench.h"
#include "vdb.h"

#include <math.h>
#include <stdlib.h>

enum { RESOLUTION = 512, ROWS = 500 /* of the ball: a million triangles */ };

void bench_levelset_header(FILE *csv) {
    fputs("mesh,triangles,voxel,level_set_ms,field_ms,openvdb_ms,ratio\n", csv);
    printf("%-22s %10s %12s %10s %12s %7s\n", "mesh", "triangles", "level set ms", "field ms", "OpenVDB ms",
           "ratio");
}

/* All of the meshes' triangles in one list, world units. */
static vdb_triangles gather(const vsh_mesh *meshes, size_t count) {
    vdb_triangles all = {NULL, NULL, 0, 0};
    for (size_t i = 0; i < count; ++i) {
        all.vertex_count += meshes[i].vertex_count;
        all.count += meshes[i].triangle_count;
    }
    float *to = bench_take(all.vertex_count * 3 * sizeof *to);
    uint32_t *index = bench_take(all.count * 3 * sizeof *index), base = 0;
    all.positions = to;
    all.indices = index;
    for (size_t i = 0; i < count; ++i) {
        const vsh_mesh *m = &meshes[i];
        for (size_t v = 0; v < m->vertex_count; ++v) {
            const float *p = m->positions + 3 * v;
            for (int row = 0; row < 3; ++row) {
                const double *t = m->transform != NULL ? m->transform + 4 * row : NULL;
                *to++ = t == NULL ? p[row] : (float)(t[0] * p[0] + t[1] * p[1] + t[2] * p[2] + t[3]);
            }
        }
        for (size_t k = 0; k < 3 * m->triangle_count; ++k) {
            *index++ = base + m->indices[k];
        }
        base += (uint32_t)m->vertex_count;
    }
    return all;
}

static void measure(FILE *csv, const char *name, const vsh_mesh *meshes, size_t count) {
    vsh_error error;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = RESOLUTION;
    vdb_triangles all = gather(meshes, count);
    double seconds[3][BENCH_RUNS], voxel = 0.0;
    for (int i = 0; i < BENCH_RUNS; ++i) {
        vsh_grid *grid = NULL;
        vsh_field *field = NULL;
        double begin = bench_seconds();
        bench_check(vsh_grid_from_meshes(meshes, count, &options, &run, &grid, &error), &error);
        seconds[0][i] = bench_seconds() - begin;
        vsh_grid_info info;
        vsh_grid_get_info(grid, &info);
        voxel = info.voxel_size;
        begin = bench_seconds();
        bench_check(vsh_field_create(grid, NULL, &run, &field, &error), &error);
        seconds[1][i] = bench_seconds() - begin;
        vsh_field_free(field);
        vsh_grid_free(grid);
        begin = bench_seconds();
        vdb_mesh_to_volume(&all, voxel, options.half_width);
        seconds[2][i] = bench_seconds() - begin;
    }
    free((void *)(uintptr_t)all.positions);
    free((void *)(uintptr_t)all.indices);
    double ms[3];
    for (int k = 0; k < 3; ++k) {
        ms[k] = 1e3 * bench_median(seconds[k], BENCH_RUNS);
    }
    fprintf(csv, "%s,%zu,%.6g,%.1f,%.1f,%.1f,%.2f\n", name, all.count, voxel, ms[0], ms[1], ms[2],
            ms[2] / ms[0]);
    printf("%-22s %10zu %12.1f %10.1f %12.1f %7.2f\n", name, all.count, ms[0], ms[1], ms[2], ms[2] / ms[0]);
    fflush(stdout);
}

static void measure_asset(FILE *csv, const char *name, const char *path) {
    vsh_error error;
    vsh_model *model = NULL;
    bench_check(vsh_model_read(path, NULL, &model, &error), &error);
    const size_t count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = bench_take(count * sizeof *meshes);
    for (size_t i = 0; i < count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    measure(csv, name, meshes, count);
    free(meshes);
    vsh_model_free(model);
}

/* A ball with bumps, of ROWS × 2 ROWS quads. */
static void measure_ball(FILE *csv) {
    enum { COLUMNS = 2 * ROWS };
    float *positions = bench_take((size_t)(ROWS + 1) * COLUMNS * 3 * sizeof *positions), *p = positions;
    uint32_t *indices = bench_take((size_t)ROWS * COLUMNS * 6 * sizeof *indices), *t = indices;
    for (int i = 0; i <= ROWS; ++i) {
        for (int k = 0; k < COLUMNS; ++k) {
            const double polar = 3.14159265358979 * i / ROWS, around = 3.14159265358979 * k / ROWS;
            const double ring = i == 0 || i == ROWS ? 0.0 : sin(polar);
            const double x = ring * cos(around), y = cos(polar), z = ring * sin(around);
            const double r = 1.0 + 0.05 * (sin(7 * x + 3 * y) + sin(9 * y + 2 * z) + sin(11 * z + 5 * x)) +
                             0.045 * sin(40 * x) * sin(37 * y) * sin(43 * z);
            *p++ = (float)(r * x);
            *p++ = (float)(r * y);
            *p++ = (float)(r * z);
        }
    }
    for (uint32_t i = 0; i < ROWS; ++i) {
        for (uint32_t k = 0; k < COLUMNS; ++k) {
            const uint32_t next = (k + 1) % COLUMNS;
            const uint32_t a = i * COLUMNS + k, b = i * COLUMNS + next, c = a + COLUMNS, d = b + COLUMNS;
            const uint32_t quad[6] = {a, b, c, b, d, c};
            for (int n = 0; n < 6; ++n) {
                *t++ = quad[n];
            }
        }
    }
    const vsh_mesh mesh = {.name = "ball",
                           .positions = positions,
                           .indices = indices,
                           .vertex_count = (size_t)(ROWS + 1) * COLUMNS,
                           .triangle_count = (size_t)ROWS * COLUMNS * 2};
    measure(csv, "a million triangles", &mesh, 1);
    free(positions);
    free(indices);
}

void bench_levelset(FILE *csv) {
    measure_asset(csv, "smooth.glb", VSH_ASSETS "/smooth.glb");
    measure_asset(csv, "thin.glb", VSH_ASSETS "/thin.glb");
    measure_asset(csv, "cloister.glb", VSH_ASSETS "/cloister.glb");
    measure_ball(csv);
}
