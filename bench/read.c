/* What it costs to have files parsed by a reader: the same files here and there, small and large. */
#define _GNU_SOURCE

#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ROWS = 708 /* of the large mesh: a million triangles */, SIDE = 4096 };

void bench_read_header(FILE *csv) {
    fputs("file,bytes,here_ms,reader_ms,ratio,here_wall_ms,reader_wall_ms\n", csv);
    printf("%-22s %10s %10s %10s %7s %10s %10s\n", "file", "bytes", "here ms", "reader ms", "ratio", "wall",
           "wall");
}

/* Of this process and of those that it waited for. */
static double processor_seconds(void) {
    double sum = 0.0;
    static const int whose[] = {RUSAGE_SELF, RUSAGE_CHILDREN};
    for (size_t i = 0; i < sizeof whose / sizeof whose[0]; ++i) {
        struct rusage used;
        getrusage(whose[i], &used);
        sum += (double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
               1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
    }
    return sum;
}

static void read_grid(const char *path, const vsh_run *run) {
    vsh_error error;
    vsh_grid *grid = NULL;
    bench_check(vsh_grid_read(path, NULL, run, &grid, &error), &error);
    vsh_grid_free(grid);
}

static void read_model(const char *path, const vsh_run *run) {
    vsh_error error;
    vsh_model *model = NULL;
    bench_check(vsh_model_read(path, run, &model, &error), &error);
    vsh_model_free(model);
}

static void read_image(const char *path, const vsh_run *run) {
    vsh_error error;
    vsh_image_file *image = NULL;
    bench_check(vsh_image_read(path, run, &image, &error), &error);
    vsh_image_free(image);
}

typedef void read_fn(const char *path, const vsh_run *run);

static void measure(FILE *csv, const char *name, const char *path, read_fn *read) {
    double processor[2], wall[2];
    struct stat status = {0};
    stat(path, &status);
    for (int i = 0; i < 2; ++i) {
        vsh_run run = vsh_run_default();
        run.threads = 1;
        run.reader = i == 1 ? VSH_READER : NULL;
        double each[2][BENCH_RUNS];
        read(path, &run); /* what is loaded once is not counted */
        for (int k = 0; k < BENCH_RUNS; ++k) {
            const double begin = processor_seconds(), clock = bench_wall();
            read(path, &run);
            each[0][k] = processor_seconds() - begin;
            each[1][k] = bench_wall() - clock;
        }
        processor[i] = 1e3 * bench_median(each[0], BENCH_RUNS);
        wall[i] = 1e3 * bench_median(each[1], BENCH_RUNS);
    }
    fprintf(csv, "%s,%lld,%.2f,%.2f,%.2f,%.2f,%.2f\n", name, (long long)status.st_size, processor[0],
            processor[1], processor[1] / processor[0], wall[0], wall[1]);
    printf("%-22s %10lld %10.2f %10.2f %7.2f %10.2f %10.2f\n", name, (long long)status.st_size, processor[0],
           processor[1], processor[1] / processor[0], wall[0], wall[1]);
    fflush(stdout);
}

static void write_ball(const char *path, double voxel) {
    vsh_error error;
    vsh_sdf_node ball = vsh_sdf_node_default();
    const vsh_sdf tree = {&ball, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    vsh_grid *grid = NULL;
    bench_check(vsh_grid_from_sdf(&tree, &options, NULL, &grid, &error), &error);
    bench_check(vsh_grid_write(grid, path, NULL, NULL, 0, &error), &error);
    vsh_grid_free(grid);
}

static void write_sheet(const char *path) {
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        perror(path);
        exit(3);
    }
    for (int i = 0; i <= ROWS; ++i) {
        for (int k = 0; k <= ROWS; ++k) {
            fprintf(file, "v %.6f %.6f %.6f\n", 1e-2 * i, 0.3 * sin(0.02 * i) * cos(0.03 * k), 1e-2 * k);
        }
    }
    for (int i = 0; i < ROWS; ++i) {
        for (int k = 0; k < ROWS; ++k) {
            const int a = i * (ROWS + 1) + k + 1, b = a + 1, c = a + ROWS + 1, d = c + 1;
            fprintf(file, "f %d %d %d\nf %d %d %d\n", a, b, d, a, d, c);
        }
    }
    if (fclose(file) != 0) {
        perror(path);
        exit(3);
    }
}

static void write_picture(const char *path) {
    vsh_error error;
    const size_t count = (size_t)SIDE * SIDE;
    float *values = bench_take(count * sizeof *values);
    for (size_t i = 0; i < count; ++i) {
        values[i] = (float)sin(1e-3 * (double)(i % SIDE) * (double)(i / SIDE) / SIDE);
    }
    const char *const names[] = {"ao", "A"};
    const float *const planes[] = {values, values};
    const vsh_image image = {SIDE, SIDE, 2, names, planes, NULL};
    bench_check(vsh_image_write(path, &image, NULL, &error), &error);
    free(values);
}

void bench_read(FILE *csv) {
    char folder[] = "/tmp/vdbshade-bench-XXXXXX";
    if (mkdtemp(folder) == NULL) {
        perror(folder);
        exit(3);
    }
    char path[4][64];
    static const char *const names[] = {"small.vdb", "large.vdb", "large.obj", "large.exr"};
    for (size_t i = 0; i < 4; ++i) {
        snprintf(path[i], sizeof path[i], "%s/%s", folder, names[i]);
    }
    write_ball(path[0], 0.1);
    write_ball(path[1], 0.005);
    write_sheet(path[2]);
    write_picture(path[3]);
    measure(csv, "a ball of 20 voxels", path[0], read_grid);
    measure(csv, "a ball of 400 voxels", path[1], read_grid);
    measure(csv, "thin.glb", VSH_ASSETS "/thin.glb", read_model);
    measure(csv, "a million triangles", path[2], read_model);
    measure(csv, "terrain.png", VSH_ASSETS "/terrain.png", read_image);
    measure(csv, "EXR of 4096², 2 planes", path[3], read_image);
    for (size_t i = 0; i < 4; ++i) {
        unlink(path[i]);
    }
    rmdir(folder);
}
