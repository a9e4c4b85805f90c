/* The C side of `tools/bench FILE.csv calls`. `points MODEL POINTS ROUNDS` prints for each round the
 * processor seconds of a call for all points. Then it prints the nanoseconds of a call for one point: of a
 * query, of a sample of a field, of vsh_shade_shadow(). POINTS holds float64 positions, then float32 normals,
 * native. */
#include <vdbshade/vdbshade.h>

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { CALLS = 100000, POINT = 3 * sizeof(double) + 3 * sizeof(float) };

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void require(bool holds, const char *message) {
    if (!holds) {
        fprintf(stderr, "points: %s\n", message);
        exit(1);
    }
}

static void *allocate(size_t size) {
    void *memory = malloc(size > 0 ? size : 1);
    require(memory != NULL, "out of memory");
    return memory;
}

static void *read_all(const char *path, size_t *count) {
    FILE *file = fopen(path, "rb");
    require(file != NULL && fseek(file, 0, SEEK_END) == 0, "cannot read the points");
    *count = (size_t)ftell(file) / POINT;
    rewind(file);
    void *bytes = allocate(*count * POINT);
    require(fread(bytes, POINT, *count, file) == *count, "cannot read the points");
    fclose(file);
    return bytes;
}

static void measure(const vsh_query *query, const vsh_occluders *occluders, const vsh_points *points,
                    const vsh_light *sun, const vsh_shade_options *shade, const vsh_run *run, int rounds) {
    float *shadow = allocate(points->count * sizeof *shadow);
    float *const planes[] = {shadow};
    vsh_query_output output = vsh_query_output_default();
    vsh_error error;
    output.visibility = planes;
    for (int round = 0; round < rounds; ++round) {
        const double begin = seconds();
        require(vsh_query_points(query, points, NULL, run, &output, NULL, &error) == VSH_OK, error.message);
        printf("%.6f\n", seconds() - begin);
    }
    vsh_points one = *points;
    one.count = 1;
    double begin = seconds();
    for (int i = 0; i < CALLS; ++i) {
        vsh_query_points(query, &one, NULL, run, &output, NULL, &error);
    }
    printf("%.1f\n", (seconds() - begin) / CALLS * 1e9);
    const vsh_field *field = vsh_occluders_get_field(occluders, NULL);
    begin = seconds();
    for (int i = 0; i < CALLS; ++i) {
        vsh_field_sample(field, 1, points->positions, shadow);
    }
    printf("%.1f\n", (seconds() - begin) / CALLS * 1e9);
    begin = seconds();
    for (int i = 0; i < CALLS; ++i) {
        vsh_shade_shadow(occluders, &one, sun, shade, run, shadow, NULL, NULL, &error);
    }
    printf("%.1f\n", (seconds() - begin) / CALLS * 1e9);
    free(shadow);
}

int main(int argc, char **argv) {
    require(argc == 4, "usage: points MODEL POINTS ROUNDS");
    vsh_error error;
    vsh_model *model = NULL;
    vsh_occluders *occluders = NULL;
    vsh_query *query = NULL;
    require(vsh_model_read(argv[1], NULL, &model, &error) == VSH_OK, error.message);
    const size_t mesh_count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = allocate(mesh_count * sizeof *meshes);
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    vsh_occluders_options options = vsh_occluders_options_default();
    options.grid.resolution = 128;
    vsh_light sun = vsh_light_default();
    sun.direction[0] = 0.5;
    sun.angle = 0.1;
    vsh_shade_options shade = vsh_shade_options_default();
    shade.method = VSH_SHADOW_CONE;
    shade.ao_method = VSH_AO_CONES;
    require(vsh_occluders_create(meshes, mesh_count, &options, NULL, &occluders, &error) == VSH_OK &&
                vsh_query_create(occluders, &sun, 1, &shade, &query, &error) == VSH_OK,
            error.message);
    size_t count;
    char *bytes = read_all(argv[2], &count);
    const vsh_points points = {count, (const double *)(const void *)bytes,
                               (const float *)(const void *)(bytes + count * 3 * sizeof(double)), NULL};
    vsh_run run = vsh_run_default();
    run.threads = 1;
    measure(query, occluders, &points, &sun, &shade, &run, atoi(argv[3]));
    vsh_query_free(query);
    vsh_occluders_free(occluders);
    vsh_model_free(model);
    free(meshes);
    free(bytes);
    return 0;
}
