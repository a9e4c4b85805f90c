/* Seams of lightmaps: how far the values on both sides of charts' borders are apart where the surface is
 * smooth, as a bilinear lookup gives them. Reading models and images is the library's, finding borders is of
 * its own.
 *
 *   vsh_seams measure MODEL FILE.exr CHANNEL …
 *       of each channel "channel,places,rms,p50,p99,max" of the differences
 *   vsh_seams truth MODEL FILE.exr CHANNEL X,Y,Z DEGREES RAYS
 *       the same of a sun's shadow evaluated at these places themselves, with the normals of both sides, and
 * what lookups in FILE are off by from it: "places,p99 of truth,rmse of FILE"; DEGREES 0: of AO within X
 *   vsh_seams stitch MODEL IN.exr OUT.exr E [KEEP]
 *       vsh_lightmap_stitch() of all shadow, ao, sky and irradiance channels of IN: what it reports, and the
 *       processor seconds that it took on one thread
 */
#include "bench.h"
#include "embree.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double LIFT = 1e-5;      /* scene units: enough for Embree's floats */
static const double SMOOTH = 0.99619; /* cosine of 5 degrees */
static const double STEP = 0.25;      /* texels between places */
static const double FIRST = 0.37;     /* of a step, the first: where nobody else looks */

/* An edge of a triangle. */
typedef struct border {
    double at[2][3], normal[2][3], uv[2][2]; /* of its ends, the lower place first */
} border;

/* A place on a seam, as both sides have it. */
typedef struct place {
    double at[3];
    float normal[2][3];
    double uv[2][2];
} place;

typedef struct places {
    place *list;
    size_t count;
} places;

static int by_place(const double *a, const double *b) {
    for (int k = 0; k < 3; ++k) {
        if (a[k] != b[k]) {
            return a[k] < b[k] ? -1 : 1;
        }
    }
    return 0;
}

static int by_ends(const void *left, const void *right) {
    const border *a = left, *b = right;
    const int first = by_place(a->at[0], b->at[0]);
    return first != 0 ? first : by_place(a->at[1], b->at[1]);
}

static void normalise(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; ++k) {
        v[k] = length > 0.0 ? v[k] / length : 0.0;
    }
}

static void transform(const double *m, const float *local, double world[3]) {
    for (int k = 0; k < 3; ++k) {
        world[k] = m == NULL ? (double)local[k]
                             : m[4 * k] * (double)local[0] + m[4 * k + 1] * (double)local[1] +
                                   m[4 * k + 2] * (double)local[2] + m[4 * k + 3];
    }
}

/* Rotations and even scales are all that these models have. */
static void turn(const double *m, const float *local, double world[3]) {
    for (int k = 0; k < 3; ++k) {
        world[k] = m == NULL ? (double)local[k]
                             : m[4 * k] * (double)local[0] + m[4 * k + 1] * (double)local[1] +
                                   m[4 * k + 2] * (double)local[2];
    }
    normalise(world);
}

static void add_triangle(const vsh_mesh *mesh, size_t i, border *list, size_t *count) {
    const uint32_t *index = mesh->indices + 3 * i;
    double at[3][3], normal[3][3], flat[3], a[3], b[3];
    for (int k = 0; k < 3; ++k) {
        transform(mesh->transform, mesh->positions + 3 * (size_t)index[k], at[k]);
    }
    for (int k = 0; k < 3; ++k) {
        a[k] = at[1][k] - at[0][k];
        b[k] = at[2][k] - at[0][k];
    }
    for (int k = 0; k < 3; ++k) {
        flat[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
    normalise(flat);
    for (int k = 0; k < 3; ++k) {
        memcpy(normal[k], flat, sizeof flat);
        if (mesh->normals != NULL) {
            turn(mesh->transform, mesh->normals + 3 * (size_t)index[k], normal[k]);
        }
    }
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3, low = by_place(at[k], at[next]) < 0 ? k : next, high = k + next - low;
        border *own = &list[(*count)++];
        const int ends[2] = {low, high};
        for (int end = 0; end < 2; ++end) {
            memcpy(own->at[end], at[ends[end]], sizeof own->at[end]);
            memcpy(own->normal[end], normal[ends[end]], sizeof own->normal[end]);
            own->uv[end][0] = mesh->uvs[2 * (size_t)index[ends[end]]];
            own->uv[end][1] = mesh->uvs[2 * (size_t)index[ends[end]] + 1];
        }
    }
}

static bool is_seam(const border *a, const border *b, double size) {
    bool same = true, smooth = true;
    for (int end = 0; end < 2; ++end) {
        double cosine = 0.0;
        for (int k = 0; k < 2; ++k) {
            same = same && fabs(a->uv[end][k] - b->uv[end][k]) * size < 1e-3;
        }
        for (int k = 0; k < 3; ++k) {
            cosine += a->normal[end][k] * b->normal[end][k];
        }
        smooth = smooth && cosine >= SMOOTH;
    }
    return smooth && !same;
}

static double length_of(const border *a, double width, double height) {
    const double x = (a->uv[1][0] - a->uv[0][0]) * width, y = (a->uv[1][1] - a->uv[0][1]) * height;
    return sqrt(x * x + y * y);
}

static void add_places(const border *a, const border *b, double width, double height, places *found) {
    const double length = fmax(length_of(a, width, height), length_of(b, width, height));
    const size_t steps = 1 + (size_t)(length / STEP);
    found->list = realloc(found->list, (found->count + steps) * sizeof *found->list);
    for (size_t s = 0; found->list != NULL && s < steps; ++s) {
        const double t = ((double)s + FIRST) / (double)steps;
        place *p = &found->list[found->count++];
        for (int k = 0; k < 3; ++k) {
            p->at[k] = a->at[0][k] + t * (a->at[1][k] - a->at[0][k]);
            p->normal[0][k] = (float)(a->normal[0][k] + t * (a->normal[1][k] - a->normal[0][k]));
            p->normal[1][k] = (float)(b->normal[0][k] + t * (b->normal[1][k] - b->normal[0][k]));
        }
        for (int k = 0; k < 2; ++k) {
            p->uv[0][k] = a->uv[0][k] + t * (a->uv[1][k] - a->uv[0][k]);
            p->uv[1][k] = b->uv[0][k] + t * (b->uv[1][k] - b->uv[0][k]);
        }
    }
}

/* Places along all edges that exactly two triangles meet at, smoothly and apart in the lightmap. */
static places find_places(const vsh_mesh *meshes, size_t mesh_count, int32_t width, int32_t height) {
    size_t most = 0, count = 0;
    places found = {NULL, 0};
    for (size_t m = 0; m < mesh_count; ++m) {
        most += 3 * meshes[m].triangle_count;
    }
    border *list = bench_take(most * sizeof *list);
    for (size_t m = 0; m < mesh_count; ++m) {
        for (size_t i = 0; i < meshes[m].triangle_count; ++i) {
            add_triangle(&meshes[m], i, list, &count);
        }
    }
    qsort(list, count, sizeof *list, by_ends);
    for (size_t i = 0, end; i < count; i = end) {
        for (end = i + 1; end < count && by_ends(&list[i], &list[end]) == 0;) {
            ++end;
        }
        if (end - i == 2 && is_seam(&list[i], &list[i + 1], fmax(width, height))) {
            add_places(&list[i], &list[i + 1], width, height, &found);
        }
    }
    free(list);
    return found;
}

static double texel(const vsh_image *image, const float *plane, int64_t x, int64_t y) {
    x = x < 0 ? 0 : x >= image->width ? image->width - 1 : x;
    y = y < 0 ? 0 : y >= image->height ? image->height - 1 : y;
    return (double)plane[y * image->width + x];
}

static double look_up(const vsh_image *image, const float *plane, const double uv[2]) {
    const double x = uv[0] * image->width - 0.5, y = (1.0 - uv[1]) * image->height - 0.5;
    const double fx = floor(x), fy = floor(y), tx = x - fx, ty = y - fy;
    const int64_t ix = (int64_t)fx, iy = (int64_t)fy;
    return (1.0 - ty) * ((1.0 - tx) * texel(image, plane, ix, iy) + tx * texel(image, plane, ix + 1, iy)) +
           ty * ((1.0 - tx) * texel(image, plane, ix, iy + 1) + tx * texel(image, plane, ix + 1, iy + 1));
}

static int by_value(const void *left, const void *right) {
    const double a = *(const double *)left, b = *(const double *)right;
    return (a > b) - (a < b);
}

static double share(const double *sorted, size_t count, double part) {
    return count > 0 ? sorted[(size_t)((double)(count - 1) * part)] : 0.0;
}

static const float *channel(const vsh_image *image, const char *name) {
    for (int32_t i = 0; i < image->channel_count; ++i) {
        if (strcmp(image->names[i], name) == 0) {
            return image->planes[i];
        }
    }
    fprintf(stderr, "seams: no channel %s\n", name);
    exit(2);
}

/* --- what is read of a command's first two arguments */

typedef struct input {
    vsh_model *model;
    vsh_mesh *meshes;
    size_t mesh_count;
    vsh_image_file *file;
    vsh_image image;
} input;

static input open_input(const char *model, const char *image) {
    input in = {NULL, NULL, 0, NULL, {0}};
    vsh_error error;
    bench_check(vsh_model_read(model, NULL, &in.model, &error), &error);
    in.mesh_count = vsh_model_mesh_count(in.model);
    in.meshes = bench_take(in.mesh_count * sizeof *in.meshes);
    for (size_t i = 0; i < in.mesh_count; ++i) {
        in.meshes[i] = vsh_model_mesh(in.model, i, -1);
    }
    bench_check(vsh_image_read(image, NULL, &in.file, &error), &error);
    in.image = vsh_image_view(in.file);
    return in;
}

static void close_input(input *in) {
    vsh_image_free(in->file);
    free(in->meshes);
    vsh_model_free(in->model);
}

static int measure(char **arguments, int channel_count, char **channels) {
    input in = open_input(arguments[0], arguments[1]);
    places found = find_places(in.meshes, in.mesh_count, in.image.width, in.image.height);
    double *difference = bench_take((found.count + 1) * sizeof *difference);
    for (int c = 0; c < channel_count; ++c) {
        const float *plane = channel(&in.image, channels[c]);
        double square = 0.0;
        for (size_t i = 0; i < found.count; ++i) {
            difference[i] = fabs(look_up(&in.image, plane, found.list[i].uv[0]) -
                                 look_up(&in.image, plane, found.list[i].uv[1]));
            square += difference[i] * difference[i];
        }
        qsort(difference, found.count, sizeof *difference, by_value);
        printf("%s,%zu,%.6f,%.6f,%.6f,%.6f\n", channels[c], found.count,
               found.count > 0 ? sqrt(square / (double)found.count) : 0.0,
               share(difference, found.count, 0.5), share(difference, found.count, 0.99),
               share(difference, found.count, 1.0));
    }
    free(difference);
    free(found.list);
    close_input(&in);
    return 0;
}

static int hold_against_truth(char **arguments) {
    input in = open_input(arguments[0], arguments[1]);
    const float *plane = channel(&in.image, arguments[2]);
    places found = find_places(in.meshes, in.mesh_count, in.image.width, in.image.height);
    double sun[3] = {0.0, 0.0, 0.0};
    const double degrees = atof(arguments[4]);
    if (sscanf(arguments[3], "%lf,%lf,%lf", &sun[0], &sun[1], &sun[2]) < (degrees > 0.0 ? 3 : 1)) {
        return 2;
    }
    truth_mesh *mesh = truth_mesh_create(in.meshes, in.mesh_count);
    if (mesh == NULL) {
        fputs("seams: no Embree, no truth\n", stderr);
        return 2;
    }
    double *origins = bench_take((found.count + 1) * 3 * sizeof *origins);
    float *normals = bench_take((found.count + 1) * 3 * sizeof *normals);
    float *values[2];
    for (int side = 0; side < 2; ++side) {
        values[side] = bench_take((found.count + 1) * sizeof *values[side]);
        for (size_t i = 0; i < found.count; ++i) {
            double normal[3];
            for (int k = 0; k < 3; ++k) {
                normal[k] = (double)found.list[i].normal[side][k];
            }
            normalise(normal);
            for (int k = 0; k < 3; ++k) {
                normals[3 * i + (size_t)k] = (float)normal[k];
                origins[3 * i + (size_t)k] = found.list[i].at[k] + LIFT * normal[k];
            }
        }
        const truth_question question = {.count = found.count,
                                         .origins = origins,
                                         .normals = normals,
                                         .towards = degrees > 0.0 ? sun : NULL,
                                         .w = tan(0.5 * degrees * 3.14159265358979323846 / 180.0),
                                         .distance = sun[0],
                                         .rays = (size_t)atoi(arguments[5])};
        truth_mesh_packets(mesh, TRUTH_NEIGHBOURS_16, &question, 0, values[side]);
    }
    double square = 0.0, *difference = bench_take((found.count + 1) * sizeof *difference);
    for (size_t i = 0; i < found.count; ++i) {
        difference[i] = fabs((double)values[0][i] - (double)values[1][i]);
        for (int side = 0; side < 2; ++side) {
            const double off = look_up(&in.image, plane, found.list[i].uv[side]) - (double)values[side][i];
            square += 0.5 * off * off;
        }
    }
    qsort(difference, found.count, sizeof *difference, by_value);
    printf("%zu,%.6f,%.6f\n", found.count, share(difference, found.count, 0.99),
           found.count > 0 ? sqrt(square / (double)found.count) : 0.0);
    free(difference);
    free(values[1]);
    free(values[0]);
    free(normals);
    free(origins);
    truth_mesh_free(mesh);
    free(found.list);
    close_input(&in);
    return 0;
}

/* Shadow, AO and sky as they stand; three channels of irradiance are woven into one plane, and back. */
static int stitch(int count, char **arguments) {
    input in = open_input(arguments[0], arguments[1]);
    const size_t texels = (size_t)in.image.width * (size_t)in.image.height;
    float **planes = bench_take((size_t)in.image.channel_count * sizeof *planes), *lights[64],
          *light[3] = {NULL};
    size_t light_count = 0;
    vsh_lightmap map = {.shadow = lights};
    for (int32_t i = 0; i < in.image.channel_count; ++i) {
        const char *name = in.image.names[i];
        planes[i] = bench_take(texels * sizeof **planes);
        memcpy(planes[i], in.image.planes[i], texels * sizeof **planes);
        if (strncmp(name, "shadow.", 7) == 0 && light_count < 64) {
            lights[light_count++] = planes[i];
        }
        map.ao = strcmp(name, "ao") == 0 ? planes[i] : map.ao;
        map.sky = strcmp(name, "sky") == 0 ? planes[i] : map.sky;
        map.coverage = strcmp(name, "A") == 0 ? planes[i] : map.coverage;
        for (int c = 0; c < 3; ++c) {
            const char *const irradiance[] = {"irradiance.R", "irradiance.G", "irradiance.B"};
            light[c] = strcmp(name, irradiance[c]) == 0 ? planes[i] : light[c];
        }
    }
    const bool lit = light[0] != NULL && light[1] != NULL && light[2] != NULL;
    map.irradiance = lit ? bench_take(3 * texels * sizeof *map.irradiance) : NULL;
    for (size_t i = 0; lit && i < 3 * texels; ++i) {
        map.irradiance[i] = light[i % 3][i / 3];
    }
    vsh_error error;
    vsh_lightmap_options size = vsh_lightmap_options_default();
    size.width = in.image.width;
    size.height = in.image.height;
    vsh_charts *charts = NULL;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    bench_check(vsh_charts_create(in.meshes, in.mesh_count, &size, &run, NULL, &charts, &error), &error);
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = atof(arguments[3]);
    options.keep = count > 4 ? atof(arguments[4]) : options.keep;
    vsh_stitch_report report;
    const double start = bench_seconds();
    bench_check(vsh_lightmap_stitch(charts, &map, light_count, &options, &run, &report, &error), &error);
    printf("%.4f s, %llu seams, %llu places, %llu crowded, %llu texels, %.6f → %.6f\n",
           bench_seconds() - start, (unsigned long long)report.seams, (unsigned long long)report.places,
           (unsigned long long)report.crowded, (unsigned long long)report.texels, report.before,
           report.after);
    for (size_t i = 0; lit && i < 3 * texels; ++i) {
        light[i % 3][i / 3] = map.irradiance[i];
    }
    in.image.planes = (const float *const *)planes;
    bench_check(vsh_image_write(arguments[2], &in.image, NULL, &error), &error);
    for (int32_t i = 0; i < in.image.channel_count; ++i) {
        free(planes[i]);
    }
    free(planes);
    free(map.irradiance);
    vsh_charts_free(charts);
    close_input(&in);
    return 0;
}

int main(int argc, char **argv) {
    if (argc >= 5 && strcmp(argv[1], "measure") == 0) {
        return measure(argv + 2, argc - 4, argv + 4);
    }
    if (argc == 8 && strcmp(argv[1], "truth") == 0) {
        return hold_against_truth(argv + 2);
    }
    if ((argc == 6 || argc == 7) && strcmp(argv[1], "stitch") == 0) {
        return stitch(argc - 2, argv + 2);
    }
    fputs("usage: the first lines of bench/seams.c\n", stderr);
    return 2;
}
