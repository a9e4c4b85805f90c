/* What a user of the C library does, against the installed package: grids from four sources, a field of each,
 * shadow and AO at points, a lightmap. Ends with 0 where every value is as a sphere (or a box) over a floor
 * has it. Usage: consumer FOLDER (for the files it writes). */
#include <vdbshade/vdbshade.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The caster: of half size or radius 0.5, its middle 1 above the origin. */
static const double middle[3] = {0.0, 1.0, 0.0};
static const double radius = 0.5;

/* Whether this program is the reader of its files itself, as one of the static library is. */
#ifndef OWN_READER
#define OWN_READER 0
#endif

static int failures;

static void expect(const char *what, double value, double least, double most) {
    const int good = value >= least && value <= most;
    printf("  %-36s %8.4f  (%g … %g)%s\n", what, value, least, most, good ? "" : "  WRONG");
    failures += good ? 0 : 1;
}

static void check(const char *what, vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fprintf(stderr, "consumer: %s: %s: %s\n", what, vsh_result_name(result), error->message);
        exit(1);
    }
}

static vsh_grid_options grid_options(void) {
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.04;
    return options;
}

static vsh_light sun(void) {
    vsh_light light = vsh_light_default(); /* overhead */
    light.angle = 0.1;
    return light;
}

/* The four ways to a grid. */

static vsh_grid *from_mesh(vsh_error *error) {
    static const float positions[] = {-0.5F, 0.5F, -0.5F, 0.5F,  0.5F,  -0.5F, -0.5F, 1.5F,
                                      -0.5F, 0.5F, 1.5F,  -0.5F, -0.5F, 0.5F,  0.5F,  0.5F,
                                      0.5F,  0.5F, -0.5F, 1.5F,  0.5F,  0.5F,  1.5F,  0.5F};
    static const uint32_t indices[] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    vsh_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.name = "box";
    mesh.positions = positions;
    mesh.vertex_count = 8;
    mesh.indices = indices;
    mesh.triangle_count = 12;
    vsh_mesh_report report;
    check("mesh check", vsh_mesh_check(&mesh, &report, error), error);
    expect("open edges of the box", (double)report.open_edges, 0.0, 0.0);
    expect("its area", report.area, 5.999, 6.001);
    const vsh_grid_options options = grid_options();
    vsh_grid *grid = NULL;
    check("mesh", vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, error), error);
    return grid;
}

static double sphere_distance(void *user, const double position[3]) {
    const double *center = user;
    const double x = position[0] - center[0];
    const double y = position[1] - center[1];
    const double z = position[2] - center[2];
    return sqrt(x * x + y * y + z * z) - radius;
}

static vsh_grid *from_callback(vsh_error *error) {
    double center[3] = {middle[0], middle[1], middle[2]};
    const vsh_distance sphere = {sphere_distance, center, 1.0, 1, {-0.5, 0.5, -0.5}, {0.5, 1.5, 0.5}};
    const vsh_grid_options options = grid_options();
    vsh_grid *grid = NULL;
    check("callback", vsh_grid_from_distance(&sphere, &options, NULL, &grid, error), error);
    return grid;
}

/* A sphere without a notch on its upper side that no ray from below finds. */
static vsh_grid *from_tree(vsh_error *error) {
    vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
    nodes[0].radius = radius;
    nodes[1].shape = VSH_SDF_BOX;
    nodes[1].size[0] = nodes[1].size[1] = nodes[1].size[2] = 0.1;
    nodes[1].translation[1] = radius;
    nodes[2].shape = VSH_SDF_SUBTRACTION;
    nodes[2].left = 0;
    nodes[2].right = 1;
    memcpy(nodes[2].translation, middle, sizeof middle);
    const vsh_sdf tree = {nodes, 3};
    check("tree check", vsh_sdf_check(&tree, error), error);
    const vsh_grid_options options = grid_options();
    vsh_grid *grid = NULL;
    check("tree", vsh_grid_from_sdf(&tree, &options, NULL, &grid, error), error);
    return grid;
}

static vsh_grid *from_file(const char *folder, vsh_error *error) {
    char path[4096];
    const int length = snprintf(path, sizeof path, "%s/sphere.vdb", folder);
    if (length < 0 || (size_t)length >= sizeof path) {
        fprintf(stderr, "consumer: the folder's name is too long\n");
        exit(1);
    }
    vsh_grid *made = from_callback(error);
    check("write", vsh_grid_write(made, path, "ball", NULL, 0, error), error);
    vsh_grid_free(made);
    /* by the reader that is installed with the library */
    vsh_run run = vsh_run_default();
    run.reader = OWN_READER ? "/proc/self/exe" : VSH_READER;
    uint32_t confined = 0;
    check("reader", vsh_reader_confinement(&run, &confined, error), error);
    expect("its system calls are confined", (double)(confined & VSH_CONFINED_CALLS), VSH_CONFINED_CALLS,
           VSH_CONFINED_CALLS);
    size_t count = 0;
    vsh_vdb_entry entry;
    check("list", vsh_vdb_list(path, &run, &entry, 1, &count, error), error);
    expect("grids in the file", (double)count, 1.0, 1.0);
    expect("name is \"ball\"", strcmp(entry.name, "ball") == 0 ? 1.0 : 0.0, 1.0, 1.0);
    vsh_grid *grid = NULL;
    check("read", vsh_grid_read(path, "ball", &run, &grid, error), error);
    return grid;
}

static void ask_points(const vsh_occluders *occluders, double least_open, double most_open,
                       vsh_error *error) {
    /* Under the caster, and far aside. */
    static const double positions[] = {0.0, 0.0, 0.0, 5.0, 0.0, 0.0};
    static const float normals[] = {0.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.0F};
    const vsh_points points = {2, positions, normals, NULL};
    const vsh_light light = sun();
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_distance = 3.0;
    options.ao_cones = 64;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    float visible[2] = {-1.0F, -1.0F};
    float open[2] = {-1.0F, -1.0F};
    check("shadow",
          vsh_shade_shadow(occluders, &points, &light, &options, NULL, visible, NULL, &stats, error), error);
    check("ao", vsh_shade_ao(occluders, &points, &options, NULL, open, NULL, NULL, &stats, error), error);
    expect("shadow under the caster", visible[0], 0.0, 0.0);
    expect("shadow far aside", visible[1], 1.0, 1.0);
    expect("AO under the caster", open[0], least_open, most_open);
    expect("AO far aside", open[1], 0.99, 1.0);
    expect("marches that did not end", (double)stats.unfinished, 0.0, 0.0);
}

enum { SIZE = 32 };

/* A floor 4 wide. The caster stands over u = 1/2, v = 1/4: column 16, row 24, as row 0 is v = 1. */
static void bake_floor(const vsh_occluders *occluders, double least_open, double most_open,
                       vsh_error *error) {
    static const float positions[] = {-2.0F, 0.0F, -1.0F, -2.0F, 0.0F, 3.0F,
                                      2.0F,  0.0F, 3.0F,  2.0F,  0.0F, -1.0F};
    static const float uvs[] = {0.0F, 0.0F, 0.0F, 1.0F, 1.0F, 1.0F, 1.0F, 0.0F};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    vsh_mesh floor_mesh;
    memset(&floor_mesh, 0, sizeof floor_mesh);
    floor_mesh.name = "floor";
    floor_mesh.positions = positions;
    floor_mesh.uvs = uvs;
    floor_mesh.vertex_count = 4;
    floor_mesh.indices = indices;
    floor_mesh.triangle_count = 2;

    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = SIZE;
    options.height = SIZE;
    vsh_charts *charts = NULL;
    check("charts", vsh_charts_create(&floor_mesh, 1, &options, NULL, NULL, &charts, error), error);

    static float shadow[SIZE * SIZE], ao[SIZE * SIZE], irradiance[3 * SIZE * SIZE], coverage[SIZE * SIZE];
    float *planes[1] = {shadow};
    const vsh_light light = sun();
    const vsh_lightmap lightmap = {
        .shadow = planes, .ao = ao, .irradiance = irradiance, .coverage = coverage};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    check("bake",
          vsh_bake_lightmap(occluders, charts, &light, 1, &options.shade, NULL, &lightmap, &stats, error),
          error);
    vsh_charts_free(charts);

    const size_t under = 24 * SIZE + 16;
    const size_t mirrored = 7 * SIZE + 16; /* where it would be if v pointed down */
    const size_t corner = 0;
    double covered = 0.0;
    for (size_t i = 0; i < SIZE * SIZE; i++) {
        covered += coverage[i];
    }
    expect("lightmap: shadow under the caster", shadow[under], 0.0, 0.0);
    expect("lightmap: shadow aside", shadow[mirrored], 1.0, 1.0);
    expect("lightmap: shadow in the corner", shadow[corner], 1.0, 1.0);
    expect("lightmap: AO under the caster", ao[under], least_open, most_open);
    expect("lightmap: AO in the corner", ao[corner], 0.99, 1.0);
    expect("lightmap: irradiance under", irradiance[3 * under], 0.0, 0.0);
    expect("lightmap: irradiance aside", irradiance[3 * mirrored + 2], 0.9, 1.0001);
    expect("lightmap: covered texels", covered, SIZE * SIZE, SIZE * SIZE);
    expect("lightmap: texels in the statistics", (double)stats.texels, SIZE * SIZE, SIZE * SIZE);
}

static void ask_all(const char *what, vsh_grid *grid, double least_open, double most_open, vsh_error *error) {
    printf("%s\n", what);
    vsh_occluders *occluders = NULL;
    check("occluders", vsh_occluders_from_grid(grid, NULL, NULL, &occluders, error), error);
    vsh_grid_free(grid); /* they do not need it */
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(occluders, &parts);
    float distance = 0.0F;
    vsh_field_sample(parts.field, 1, (const double[]){0.0, 0.25, 0.0}, &distance);
    expect("distance a quarter under the caster", distance, 0.21, 0.29);
    ask_points(occluders, least_open, most_open, error);
    bake_floor(occluders, least_open, most_open, error);
    vsh_occluders_free(occluders);
}

/* By the module of image formats, which is installed beside the library; EXR needs none. */
static void write_picture(const char *folder, vsh_error *error) {
    printf("an image\n");
    char path[4096];
    snprintf(path, sizeof path, OWN_READER ? "%s/ramp.exr" : "%s/ramp.png", folder);
    float values[SIZE];
    for (int i = 0; i < SIZE; i++) {
        values[i] = (float)i / 255.0F;
    }
    const char *const name = "shadow";
    const float *const plane = values;
    const vsh_image image = {SIZE, 1, 1, &name, &plane, NULL};
    check("write an image", vsh_image_write(path, &image, NULL, error), error);
    vsh_image_file *file = NULL;
    check("read an image", vsh_image_read(path, NULL, &file, error), error);
    expect("its last value", vsh_image_view(file).planes[0][SIZE - 1], 31.0 / 255.0 - 1e-6,
           31.0 / 255.0 + 1e-6);
    vsh_image_free(file);
}

static void ask_for_errors(void) {
    printf("errors\n");
    vsh_error error = {VSH_OK, ""};
    vsh_grid *grid = NULL;
    const vsh_result result = vsh_grid_read("no such file.vdb", NULL, NULL, &grid, &error);
    expect("a missing file is VSH_ERROR_READ", result, VSH_ERROR_READ, VSH_ERROR_READ);
    expect("and the message names it", strstr(error.message, "no such file.vdb") != NULL ? 1.0 : 0.0, 1.0,
           1.0);
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
    vsh_error error = {VSH_OK, ""};
    printf("C: vdbshade %s\n", vsh_version());
    /* AO under a sphere is 1 - (r / d)² = 0.75; under a box whose face is a square of half size 0.5, 0.5
     * away, it is one less the form factor of that square, 0.554. */
    ask_all("a mesh's arrays", from_mesh(&error), 0.35, 0.60, &error);
    ask_all("a callback", from_callback(&error), 0.65, 0.85, &error);
    ask_all("a procedural tree", from_tree(&error), 0.65, 0.85, &error);
    ask_all("a .vdb file", from_file(argv[1], &error), 0.65, 0.85, &error);
    write_picture(argv[1], &error);
    ask_for_errors();
    if (failures > 0) {
        fprintf(stderr, "consumer: %d values are wrong\n", failures);
    }
    return failures > 0 ? 1 : 0;
}
