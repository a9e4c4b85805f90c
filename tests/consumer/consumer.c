/* Uses the installed C library as a program would: writes a level set, reads it back by the installed reader,
 * shades points, and writes an image by the installed module. The programs of examples/
 * bake lightmaps and meshes. Ends with 0 if every value is right. Usage: consumer FOLDER (for the files it
 * writes). */
#include <vdbshade/vdbshade.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Whether this program is its own reader, as programs with the static library are. */
#ifndef OWN_READER
#define OWN_READER 0
#endif

static int failures;
static vsh_error error;

static void expect(const char *what, double value, double least, double most) {
    const int good = value >= least && value <= most;
    printf("  %-36s %8.4f  (%g … %g)%s\n", what, value, least, most, good ? "" : "  WRONG");
    failures += good ? 0 : 1;
}

static void check(const char *what, vsh_result result) {
    if (result != VSH_OK) {
        fprintf(stderr, "consumer: %s: %s: %s\n", what, vsh_result_name(result), error.message);
        exit(1);
    }
}

/* The distance to a ball of radius 0.5, centred 1 above the origin. */
static double ball(void *user, const double position[3]) {
    const double *height = user;
    const double x = position[0], y = position[1] - *height, z = position[2];
    return sqrt(x * x + y * y + z * z) - 0.5;
}

static vsh_grid *write_and_read(const char *folder) {
    char path[4096];
    double height = 1.0;
    const vsh_distance sphere = {ball, &height, 1.0, 1, {-0.5, 0.5, -0.5}, {0.5, 1.5, 0.5}};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.04;
    vsh_grid *made = NULL, *grid = NULL;
    snprintf(path, sizeof path, "%s/sphere.vdb", folder);
    check("callback", vsh_grid_from_distance(&sphere, &options, NULL, &made, &error));
    check("write", vsh_grid_write(made, path, "ball", NULL, 0, &error));
    vsh_grid_free(made);
    /* uses the reader that is installed with the library */
    vsh_run run = vsh_run_default();
    run.reader = OWN_READER ? "/proc/self/exe" : VSH_READER;
    uint32_t confined = 0;
    check("reader", vsh_reader_confinement(&run, &confined, &error));
    expect("its system calls are confined", (double)(confined & VSH_CONFINED_CALLS), VSH_CONFINED_CALLS,
           VSH_CONFINED_CALLS);
    size_t count = 0;
    vsh_vdb_entry entry;
    check("list", vsh_vdb_list(path, &run, &entry, 1, &count, &error));
    expect("grids in the file", (double)count, 1.0, 1.0);
    expect("name is \"ball\"", strcmp(entry.name, "ball") == 0, 1.0, 1.0);
    check("read", vsh_grid_read(path, "ball", &run, &grid, &error));
    return grid;
}

/* Shades a point under the ball and one far from it. AO under a sphere is 1 - (r / d)² = 0.75. */
static void ask_points(vsh_grid *grid) {
    static const double positions[] = {0.0, 0.0, 0.0, 5.0, 0.0, 0.0};
    static const float normals[] = {0.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.0F};
    const vsh_points points = {2, positions, normals, NULL};
    vsh_light light = vsh_light_default(); /* overhead */
    light.angle = 0.1;
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_distance = 3.0;
    vsh_occluders *occluders = NULL;
    float visible[2] = {-1.0F, -1.0F}, open[2] = {-1.0F, -1.0F};
    check("occluders", vsh_occluders_from_grid(grid, NULL, NULL, &occluders, &error));
    vsh_grid_free(grid); /* occluders do not need it */
    check("shadow",
          vsh_shade_shadow(occluders, &points, &light, &options, NULL, visible, NULL, NULL, &error));
    check("ao", vsh_shade_ao(occluders, &points, &options, NULL, open, NULL, NULL, NULL, &error));
    vsh_occluders_free(occluders);
    expect("shadow under the ball", visible[0], 0.0, 0.0);
    expect("shadow far aside", visible[1], 1.0, 1.0);
    expect("AO under the ball", open[0], 0.65, 0.85);
    expect("AO far aside", open[1], 0.99, 1.0);
}

/* Writes a picture by the module of image formats, which is installed beside the library. EXR needs no
 * module. */
static void write_picture(const char *folder) {
    enum { SIZE = 32 };
    char path[4096];
    float values[SIZE];
    for (int i = 0; i < SIZE; i++) {
        values[i] = (float)i / 255.0F;
    }
    const char *const name = "shadow";
    const float *const plane = values;
    const vsh_image image = {SIZE, 1, 1, &name, &plane, NULL};
    vsh_image_file *file = NULL;
    snprintf(path, sizeof path, OWN_READER ? "%s/ramp.exr" : "%s/ramp.png", folder);
    check("write an image", vsh_image_write(path, &image, NULL, &error));
    check("read an image", vsh_image_read(path, NULL, &file, &error));
    expect("its last value", vsh_image_view(file).planes[0][SIZE - 1], 31.0 / 255.0 - 1e-6,
           31.0 / 255.0 + 1e-6);
    vsh_image_free(file);
}

int main(int argc, char **argv) {
    const int served = OWN_READER ? vsh_reader_serve(argc, argv) : -1;
    if (served >= 0) {
        return served;
    }
    if (argc != 2) {
        fprintf(stderr, "usage: consumer FOLDER\n");
        return 2;
    }
    printf("C: vdbshade %s\n", vsh_version());
    ask_points(write_and_read(argv[1]));
    write_picture(argv[1]);
    vsh_grid *none = NULL;
    const vsh_result result = vsh_grid_read("no such file.vdb", NULL, NULL, &none, &error);
    expect("a missing file is VSH_ERROR_READ", result, VSH_ERROR_READ, VSH_ERROR_READ);
    expect("and the message names it", strstr(error.message, "no such file.vdb") != NULL, 1.0, 1.0);
    if (failures > 0) {
        fprintf(stderr, "consumer: %d values are wrong\n", failures);
    }
    return failures > 0;
}
