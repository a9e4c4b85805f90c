/* What it costs to have files parsed by a reader: the same files here and there, small and large; meshes of a
 * million triangles beside Assimp in the process itself, in turn. */
#define _GNU_SOURCE

#include "bench.h"

#include <assimp/cimport.h>
#include <assimp/scene.h>

#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SIDE = 4096 };

void bench_read_header(FILE *csv) {
    fputs("file,bytes,here_ms,reader_ms,ratio,here_wall_ms,reader_wall_ms,assimp_ms,reader_to_assimp\n", csv);
    printf("%-22s %10s %10s %10s %7s %10s %10s %10s %7s\n", "file", "bytes", "here ms", "reader ms", "ratio",
           "wall", "wall", "Assimp ms", "ratio");
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

static void read_by_assimp(const char *path) {
    const struct aiScene *scene = aiImportFile(path, 0);
    if (scene == NULL) {
        fprintf(stderr, "%s: %s\n", path, aiGetErrorString());
        exit(3);
    }
    aiReleaseImport(scene);
}

typedef void read_fn(const char *path, const vsh_run *run);

/* Here, in a reader, by Assimp. */
enum { HERE, READER, ASSIMP, WAYS };

static void read_once(int way, const char *path, read_fn *read) {
    if (way == ASSIMP) {
        read_by_assimp(path);
        return;
    }
    vsh_run run = vsh_run_default();
    run.threads = 1;
    run.reader = way == READER ? BENCH_READER : NULL;
    read(path, &run);
}

static void measure(FILE *csv, const char *name, const char *path, read_fn *read, int ways) {
    double processor[WAYS] = {0}, wall[WAYS] = {0}, each[WAYS][2][BENCH_RUNS];
    struct stat status = {0};
    stat(path, &status);
    for (int k = -1; k < BENCH_RUNS; ++k) { /* what is loaded once is not counted */
        for (int way = 0; way < ways; ++way) {
            const double begin = processor_seconds(), clock = bench_wall();
            read_once(way, path, read);
            each[way][0][k < 0 ? 0 : k] = processor_seconds() - begin;
            each[way][1][k < 0 ? 0 : k] = bench_wall() - clock;
        }
    }
    for (int way = 0; way < ways; ++way) {
        processor[way] = 1e3 * bench_median(each[way][0], BENCH_RUNS);
        wall[way] = 1e3 * bench_median(each[way][1], BENCH_RUNS);
    }
    fprintf(csv, "%s,%lld,%.2f,%.2f,%.2f,%.2f,%.2f,", name, (long long)status.st_size, processor[HERE],
            processor[READER], processor[READER] / processor[HERE], wall[HERE], wall[READER]);
    printf("%-22s %10lld %10.2f %10.2f %7.2f %10.2f %10.2f", name, (long long)status.st_size, processor[HERE],
           processor[READER], processor[READER] / processor[HERE], wall[HERE], wall[READER]);
    if (ways == WAYS) {
        fprintf(csv, "%.2f,%.2f", processor[ASSIMP], processor[READER] / processor[ASSIMP]);
        printf(" %10.2f %7.2f", processor[ASSIMP], processor[READER] / processor[ASSIMP]);
    } else {
        fputs(",", csv);
    }
    fputs("\n", csv);
    printf("\n");
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

static void write_small_ball(const char *path) {
    write_ball(path, 0.1);
}

static void write_large_ball(const char *path) {
    write_ball(path, 0.005);
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
    /* a reader may load from the folders that this process's libraries are in, and its own lies there */
    if (dlopen(BENCH_LIBRARY, RTLD_LAZY | RTLD_LOCAL) == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        exit(3);
    }
    if (mkdtemp(folder) == NULL) {
        perror(folder);
        exit(3);
    }
    static const struct {
        const char *name, *file;
        void (*write)(const char *path);
        read_fn *read;
        int ways;
    } files[] = {
        {"a ball of 20 voxels", "small.vdb", write_small_ball, read_grid, ASSIMP},
        {"a ball of 400 voxels", "large.vdb", write_large_ball, read_grid, ASSIMP},
        {"thin.glb", NULL, NULL, read_model, ASSIMP},
        {"a million triangles", "large.obj", bench_write_bare_obj, read_model, WAYS},
        {"with UVs and normals", "full.obj", bench_write_obj, read_model, WAYS},
        {"the same as ASCII PLY", "ascii.ply", bench_write_ascii_ply, read_model, WAYS},
        {"the same as PLY", "large.ply", bench_write_ply, read_model, WAYS},
        {"the same as GLB", "large.glb", bench_write_glb, read_model, WAYS},
        {"terrain.png", NULL, NULL, read_image, ASSIMP},
        {"EXR of 4096², 2 planes", "large.exr", write_picture, read_image, ASSIMP},
    };
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        char path[256];
        const bool made = files[i].write != NULL;
        snprintf(path, sizeof path, "%s/%s", made ? folder : VSH_ASSETS,
                 made ? files[i].file : files[i].name);
        if (made) {
            files[i].write(path);
        }
        measure(csv, files[i].name, path, files[i].read, files[i].ways);
        if (made) {
            unlink(path);
        }
    }
    rmdir(folder);
}
