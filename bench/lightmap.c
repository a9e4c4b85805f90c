/* Lightmaps against truth, for tools/bench-cycles:
 *
 *   vsh_lightmap truth ASSET SIZE X,Y,Z DEGREES DISTANCE RAYS N OUT.exr
 *       shadow.sun, ao and A by RAYS Embree rays at each of N × N samples of a texel, from the very surface
 *   vsh_lightmap compare TRUTH.exr NAME FILE.exr CHANNEL VALID.exr …
 *       error of a file's channel against the truth's channel NAME, over texels where A is 1 in TRUTH and in
 *       every VALID: "texels,rmse,bias,p99,max"
 */
#include "bench.h"
#include "embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double LIFT = 1e-5; /* scene units: enough for Embree's floats */

typedef struct planes {
    size_t texels;
    float *shadow, *ao, *coverage;
} planes;

static void average(const vsh_texel_samples *s, const float *values, size_t texels, int32_t width,
                    float *plane) {
    float *count = bench_take(texels * sizeof *count);
    memset(plane, 0, texels * sizeof *plane);
    memset(count, 0, texels * sizeof *count);
    for (size_t i = 0; i < s->count; ++i) {
        plane[vsh_texel_place(s->texels[i], width)] += values[i];
        count[vsh_texel_place(s->texels[i], width)] += 1.0f;
    }
    for (size_t i = 0; i < texels; ++i) {
        plane[i] = count[i] > 0.0f ? plane[i] / count[i] : 0.0f;
    }
    free(count);
}

static int make_truth(char **arguments) {
    vsh_error error;
    vsh_model *model = NULL;
    vsh_charts *charts = NULL;
    double sun[3];
    const double w = tan(0.5 * atof(arguments[3]) * 3.14159265358979323846 / 180.0);
    if (sscanf(arguments[2], "%lf,%lf,%lf", &sun[0], &sun[1], &sun[2]) != 3) {
        return 2;
    }
    bench_check(vsh_model_read(arguments[0], NULL, &model, &error), &error);
    const size_t mesh_count = vsh_model_mesh_count(model);
    vsh_mesh *meshes = bench_take(mesh_count * sizeof *meshes);
    for (size_t i = 0; i < mesh_count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = size.height = atoi(arguments[1]);
    size.supersample = atoi(arguments[6]);
    bench_check(vsh_charts_create(meshes, mesh_count, &size, NULL, NULL, &charts, &error), &error);
    truth_mesh *mesh = truth_mesh_create(meshes, mesh_count);
    if (mesh == NULL) {
        fputs("lightmap: no Embree, no truth\n", stderr);
        return 2;
    }
    vsh_texels *texels = bench_texels(charts);
    const vsh_texel_samples s = vsh_texels_samples(texels);
    const size_t count = (size_t)size.width * (size_t)size.height;
    double *origins = bench_take(s.count * 3 * sizeof *origins);
    for (size_t i = 0; i < 3 * s.count; ++i) {
        origins[i] = s.positions[i] + LIFT * (double)s.geometric_normals[i];
    }
    float *values = bench_take(s.count * sizeof *values);
    float *plane[3];
    for (int p = 0; p < 3; ++p) {
        plane[p] = bench_take(count * sizeof *plane[p]);
    }
    truth_question question = {.count = s.count,
                               .origins = origins,
                               .normals = s.normals,
                               .towards = sun,
                               .w = w,
                               .distance = atof(arguments[4]),
                               .rays = (size_t)atoi(arguments[5])};
    truth_mesh_packets(mesh, TRUTH_NEIGHBOURS_16, &question, 0, values);
    average(&s, values, count, size.width, plane[0]);
    question.towards = NULL;
    truth_mesh_packets(mesh, TRUTH_NEIGHBOURS_16, &question, 0, values);
    average(&s, values, count, size.width, plane[1]);
    memset(plane[2], 0, count * sizeof *plane[2]);
    for (size_t i = 0; i < s.count; ++i) {
        plane[2][vsh_texel_place(s.texels[i], size.width)] = 1.0f;
    }
    const char *const names[] = {"shadow.sun", "ao", "A"};
    const float *const view[] = {plane[0], plane[1], plane[2]};
    const vsh_image image = {size.width, size.height, 3, names, view, NULL};
    bench_check(vsh_image_write(arguments[7], &image, NULL, &error), &error);
    for (int p = 0; p < 3; ++p) {
        free(plane[p]);
    }
    free(values);
    free(origins);
    truth_mesh_free(mesh);
    vsh_texels_free(texels);
    vsh_charts_free(charts);
    free(meshes);
    vsh_model_free(model);
    return 0;
}

static const float *channel(const vsh_image_file *file, const char *path, const char *name) {
    const vsh_image image = vsh_image_view(file);
    for (int32_t i = 0; i < image.channel_count; ++i) {
        if (strcmp(image.names[i], name) == 0) {
            return image.planes[i];
        }
    }
    fprintf(stderr, "lightmap: %s: no channel %s\n", path, name);
    exit(2);
}

static void same_size(const vsh_image *a, const vsh_image *b, const char *path) {
    if (a->width != b->width || a->height != b->height) {
        fprintf(stderr, "lightmap: %s: %d × %d, the truth has %d × %d\n", path, b->width, b->height, a->width,
                a->height);
        exit(2);
    }
}

static int compare(char **arguments, int valid_count, char **valid) {
    vsh_error error;
    vsh_image_file *truth = NULL, *file = NULL;
    bench_check(vsh_image_read(arguments[0], NULL, &truth, &error), &error);
    bench_check(vsh_image_read(arguments[2], NULL, &file, &error), &error);
    const vsh_image size = vsh_image_view(truth), other = vsh_image_view(file);
    same_size(&size, &other, arguments[2]);
    const size_t count = (size_t)size.width * (size_t)size.height;
    float *mask = bench_take(count * sizeof *mask);
    memcpy(mask, channel(truth, arguments[0], "A"), count * sizeof *mask);
    for (int v = 0; v < valid_count; ++v) {
        vsh_image_file *judge = NULL;
        bench_check(vsh_image_read(valid[v], NULL, &judge, &error), &error);
        const vsh_image view = vsh_image_view(judge);
        same_size(&size, &view, valid[v]);
        const float *a = channel(judge, valid[v], "A");
        for (size_t i = 0; i < count; ++i) {
            mask[i] = a[i] == 1.0f ? mask[i] : 0.0f;
        }
        vsh_image_free(judge);
    }
    const truth_metrics m = truth_compare(count, channel(file, arguments[2], arguments[3]),
                                          channel(truth, arguments[0], arguments[1]), mask);
    printf("%zu,%.6f,%.6f,%.5f,%.5f\n", m.count, m.rmse, m.bias, m.p99, m.max);
    free(mask);
    vsh_image_free(file);
    vsh_image_free(truth);
    return 0;
}

int main(int argc, char **argv) {
    if (argc == 10 && strcmp(argv[1], "truth") == 0) {
        return make_truth(argv + 2);
    }
    if (argc >= 6 && strcmp(argv[1], "compare") == 0) {
        return compare(argv + 2, argc - 6, argv + 6);
    }
    fputs("usage: the first lines of bench/lightmap.c\n", stderr);
    return 2;
}
