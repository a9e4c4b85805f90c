#include "scenarios.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Runs a call; ends the scenario where it fails, and the test where it then left a handle. */
#define TRY(call)                                                                                            \
    do {                                                                                                     \
        result = (call);                                                                                     \
        if (result != VSH_OK) {                                                                              \
            goto end;                                                                                        \
        }                                                                                                    \
    } while (0)

#define MAKE(handle, call)                                                                                   \
    do {                                                                                                     \
        result = (call);                                                                                     \
        if ((result == VSH_OK) != ((handle) != NULL)) {                                                      \
            fprintf(stderr, "%s: %s with%s a handle\n", #handle, vsh_result_name(result),                    \
                    (handle) != NULL ? "" : "out");                                                          \
            abort();                                                                                         \
        }                                                                                                    \
        if (result != VSH_OK) {                                                                              \
            goto end;                                                                                        \
        }                                                                                                    \
    } while (0)

enum { SIDE = 12, POINTS = 80, FLAT_TEXELS = 64 };

/* Of the package fonts-dejavu-core. */
#define FONT "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"

/* --- files */

static const char box_obj[] =
    "o box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "vt 0 0\nvt 0.45 0\nvt 0.45 0.45\nvt 0 0.45\nvt 0.5 0.5\nvt 0.95 0.5\nvt 0.95 0.95\n"
    "f 1/1 4/2 3/3 2/4\nf 5/5 6/6 7/7\nf 5/5 7/7 8/6\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\n"
    "f 2 3 7 6\n";

static const char scene_json[] =
    "{\"casters\":[{\"mesh\":\"box.obj\",\"transform\":{\"translate\":[0,0,0.1],\"rotate_deg\":[0,10,0]}},"
    "{\"mask\":\"mask.png\",\"size\":[2,2],\"thickness\":0.5},"
    "{\"heightfield\":\"mask.png\",\"size\":[4,4],\"height\":0.5,\"layer\":\"ground\"},"
    "{\"spheres\":[[2,1,0,0.5],[2,2,0,0.25]],\"layer\":\"balls\"},"
    "{\"sdf\":{\"op\":\"smooth_union\",\"smoothing\":0.2,\"of\":[{\"shape\":\"sphere\",\"radius\":0.5},"
    "{\"shape\":\"box\",\"half_size\":[0.2,0.2,0.9]}]}}],"
    "\"layers\":[{\"name\":\"ground\",\"method\":\"hard\"},{\"name\":\"balls\",\"softness\":2,\"lights\":["
    "\"sun\"]}],"
    "\"resolution\":10,\"ao\":{\"distance\":0.5},"
    "\"lights\":[{\"name\":\"sun\",\"type\":\"directional\",\"direction\":[0,1,0.2],\"angle_deg\":5}],"
    "\"receivers\":[{\"mesh\":\"box.obj\",\"size\":8,\"output\":\"out.exr\",\"pack\":\"R=ao\"}]}";

static const char flat_json[] =
    "{\"region\":[-2,-2,2,2],\"size\":8,\"casters\":[{\"mask\":\"mask.png\",\"size\":1},"
    "{\"shape\":\"circle\",\"radius\":0.4,\"translate\":[1,1]},"
    "{\"shape\":\"polygon\",\"points\":[[0,0],[1,0],[0.5,1]]}],"
    "\"lights\":[{\"name\":\"lamp\",\"type\":\"disc\",\"position\":[-1,1],\"radius\":0.2}],\"output\":\"o."
    "png\"}";

static const char balls_csv[] = "x,y,z,r\n0,0,0,1\n2,0,0,0.5\n# none\n0;3;0;1\n";
static const char triangle_ply[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
static const char triangle_stl[] =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    "endsolid a\n";

static const struct {
    const char *name, *text;
} inputs[] = {{"box.obj", box_obj},     {"scene.json", scene_json},     {"flat.json", flat_json},
              {"balls.csv", balls_csv}, {"triangle.ply", triangle_ply}, {"triangle.stl", triangle_stl}};
enum { INPUTS = sizeof inputs / sizeof inputs[0] };

static const char *const outputs[] = {"out.exr", "out.png", "out.tif", "out.vdb"};
enum { OUTPUTS = sizeof outputs / sizeof outputs[0] };

static void write_text(const char *name, const char *text) {
    FILE *file = fopen(name, "wb");
    if (file == NULL || fputs(text, file) < 0 || fclose(file) != 0) {
        perror(name);
        abort();
    }
}

static void fill(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        values[i] = (float)(i * 37 % 101) / 100.0f;
    }
}

/* An image whose middle is 1 and whose border is 0. */
static void write_mask(void) {
    float pixels[SIDE * SIDE] = {0};
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const int x = i % SIDE, y = i / SIDE;
        pixels[i] = x > 2 && x < 9 && y > 2 && y < 8 && x != y ? 1.0f : 0.0f;
    }
    static const char *const name = "Y";
    const float *const plane = pixels;
    const vsh_image image = {SIDE, SIDE, 1, &name, &plane};
    if (vsh_image_write("mask.png", &image, NULL, NULL) != VSH_OK) {
        abort();
    }
}

void scenarios_make_files(void) {
    for (size_t i = 0; i < INPUTS; ++i) {
        write_text(inputs[i].name, inputs[i].text);
    }
    for (size_t i = 0; i < OUTPUTS; ++i) {
        write_text(outputs[i], "old");
    }
    write_mask();
}

void scenarios_remove_files(void) {
    for (size_t i = 0; i < INPUTS; ++i) {
        unlink(inputs[i].name);
    }
    for (size_t i = 0; i < OUTPUTS; ++i) {
        unlink(outputs[i]);
    }
    unlink("mask.png");
}

static int is_old(const char *name) {
    char text[8] = "";
    FILE *file = fopen(name, "rb");
    const int old = file != NULL && fread(text, 1, sizeof text - 1, file) == 3 && strcmp(text, "old") == 0;
    if (file != NULL) {
        fclose(file);
    }
    return old;
}

int scenarios_untouched(void) {
    int good = 1;
    for (size_t i = 0; i < OUTPUTS; ++i) {
        if (!is_old(outputs[i])) {
            good = 0;
            write_text(outputs[i], "old");
        }
    }
    DIR *listing = opendir(".");
    size_t files = 0;
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        files += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
        if (strstr(entry->d_name, ".tmp") != NULL) {
            unlink(entry->d_name);
        }
    }
    closedir(listing);
    return good && files == INPUTS + OUTPUTS + 1;
}

/* --- what several of them need */

static vsh_result box_field(const vsh_run *run, vsh_grid **grid, vsh_field **field, vsh_error *error) {
    static const float corners[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
    static const uint32_t indices[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                       3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};
    const vsh_mesh mesh = {"box", corners, NULL, NULL, indices, 8, 12, NULL};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 6;
    vsh_field_options wide = vsh_field_options_default();
    wide.reach = 1.0;
    *grid = NULL;
    *field = NULL;
    vsh_result result;
    MAKE(*grid, vsh_grid_from_meshes(&mesh, 1, &options, run, grid, error));
    MAKE(*field, vsh_field_create(*grid, &wide, run, field, error));
end:
    return result;
}

static void place(double positions[3 * POINTS], float normals[3 * POINTS]) {
    for (int i = 0; i < POINTS; ++i) {
        positions[3 * i] = 0.03 * i - 0.7;
        positions[3 * i + 1] = 1.1;
        positions[3 * i + 2] = 0.3 * (i % 7) - 0.5;
        normals[3 * i] = normals[3 * i + 2] = 0.0f;
        normals[3 * i + 1] = 1.0f;
    }
}

/* --- the scenarios */

static vsh_result read_scenes(const vsh_run *run, vsh_error *error) {
    (void)run;
    vsh_scene *scene = NULL;
    vsh_flat_scene *flat = NULL;
    vsh_result result;
    MAKE(scene, vsh_scene_read("scene.json", &scene, error));
    MAKE(flat, vsh_flat_scene_read("flat.json", &flat, error));
end:
    vsh_scene_free(scene);
    vsh_flat_scene_free(flat);
    return result;
}

static vsh_result read_models(const vsh_run *run, vsh_error *error) {
    static const char *const names[] = {"box.obj", "triangle.ply", "triangle.stl"};
    vsh_result result = VSH_OK;
    vsh_model *model = NULL;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        MAKE(model, vsh_model_read(names[i], run, &model, error));
        const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
        vsh_mesh_report report;
        TRY(vsh_mesh_check(&mesh, &report, error));
        vsh_model_free(model);
        model = NULL;
    }
end:
    vsh_model_free(model);
    return result;
}

static vsh_result load_scene(const vsh_run *run, vsh_error *error) {
    vsh_scene *scene = NULL;
    vsh_assets *assets = NULL;
    vsh_grid *grid = NULL, *layer = NULL;
    vsh_triangles *triangles = NULL;
    vsh_result result;
    MAKE(scene, vsh_scene_read("scene.json", &scene, error));
    MAKE(assets, vsh_assets_load(scene, run, &assets, error));
    MAKE(grid, vsh_scene_casters(scene, assets, run, &grid, error));
    MAKE(layer, vsh_scene_layer_casters(scene, assets, &scene->layers[0], run, &layer, error));
    MAKE(triangles, vsh_scene_triangles(scene, assets, &scene->layers[0], run, &triangles, error));
end:
    vsh_triangles_free(triangles);
    vsh_grid_free(layer);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    vsh_scene_free(scene);
    return result;
}

static double ball(void *user, const double p[3]) {
    (void)user;
    return 2.0 * (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1.0);
}

static vsh_result make_grids(const vsh_run *run, vsh_error *error) {
    vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf sdf = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 10;
    const vsh_distance distance = {ball, NULL, 2.0, 0, {-1, -1, -1}, {1, 1, 1}};
    const double moved[12] = {1, 0, 0, 0.53, 0, 1, 0, 0.1, 0, 0, 1, 0};
    vsh_grid *from_sdf = NULL, *from_distance = NULL, *united = NULL;
    vsh_result result;
    MAKE(from_sdf, vsh_grid_from_sdf(&sdf, &options, run, &from_sdf, error));
    MAKE(from_distance, vsh_grid_from_distance(&distance, &options, run, &from_distance, error));
    const vsh_grid_instance instances[] = {{from_sdf, NULL}, {from_distance, moved}};
    MAKE(united, vsh_grid_unite(instances, 2, &options, run, &united, error));
end:
    vsh_grid_free(united);
    vsh_grid_free(from_distance);
    vsh_grid_free(from_sdf);
    return result;
}

static vsh_result write_grid(const vsh_run *run, vsh_error *error) {
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_result result;
    TRY(box_field(run, &grid, &field, error));
    TRY(vsh_grid_write(grid, "out.vdb", NULL, error));
end:
    vsh_field_free(field);
    vsh_grid_free(grid);
    return result;
}

static vsh_result shade_points(const vsh_run *run, vsh_error *error) {
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[POINTS], deviation[POINTS], bent[3 * POINTS];
    place(positions, normals);
    const vsh_points points = {POINTS, positions, normals, NULL};
    vsh_light light = vsh_light_default();
    light.angle = 0.3;
    vsh_shade_options options = vsh_shade_options_default();
    options.rays = 16;
    vsh_result result;
    TRY(box_field(run, &grid, &field, error));
    for (options.method = VSH_SHADOW_HARD; options.method < VSH_SHADOW_EXACT; ++options.method) {
        TRY(vsh_shade_shadow(field, &points, &light, &options, run, values, deviation, NULL, error));
    }
    options.method = VSH_SHADOW_CONE;
    for (options.ao_method = VSH_AO_TAPS; options.ao_method < VSH_AO_EXACT; ++options.ao_method) {
        TRY(vsh_shade_ao(field, &points, &options, run, values, deviation, NULL, error));
    }
    options.ao_method = VSH_AO_CONES;
    TRY(vsh_shade_bent(field, &points, &options, run, values, bent, NULL, error));
end:
    vsh_field_free(field);
    vsh_grid_free(grid);
    return result;
}

static vsh_result ask(const vsh_run *run, vsh_error *error) {
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_heights *heights = NULL;
    vsh_model *model = NULL;
    vsh_spheres *spheres = NULL;
    double *list = NULL;
    size_t count = 0;
    vsh_query *query = NULL;
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[2][POINTS], gradient[3 * POINTS], samples[SIDE * SIDE];
    place(positions, normals);
    fill(samples, SIDE * SIDE);
    const vsh_heights_source source = {
        .columns = SIDE, .rows = SIDE, .values = samples, .size = {4, 4}, .height = 0.5};
    vsh_result result;
    TRY(box_field(run, &grid, &field, error));
    MAKE(heights, vsh_heights_create(&source, run, &heights, error));
    MAKE(model, vsh_model_from_heights(&source, VSH_HEIGHTS_SURFACE, run, &model, error));
    vsh_model_free(model);
    model = NULL;
    MAKE(model, vsh_model_from_heights(&source, VSH_HEIGHTS_SOLID, run, &model, error));
    MAKE(list, vsh_spheres_read("balls.csv", run, &list, &count, error));
    MAKE(spheres, vsh_spheres_create(list, count, NULL, run, &spheres, error));
    static const char *const names[] = {"sun"};
    vsh_layer layers[] = {vsh_layer_default(), vsh_layer_default(), vsh_layer_default()};
    layers[0].heights = heights;
    layers[1].spheres = spheres;
    layers[1].lights = names;
    layers[1].light_count = 1;
    layers[2].field = field;
    vsh_shade_options options = vsh_shade_options_default();
    options.layers = layers;
    options.layer_count = 3;
    const vsh_light light = vsh_light_default();
    MAKE(query, vsh_query_create(field, &light, 1, &options, &query, error));
    float *const planes[] = {values[0]};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = planes;
    output.ao = values[1];
    output.gradient = gradient;
    vsh_strided_points points = vsh_strided_points_default();
    points.count = POINTS;
    points.positions = positions;
    points.normals = normals;
    TRY(vsh_query_strided(query, &points, run, &output, NULL, error));
end:
    vsh_query_free(query);
    vsh_spheres_free(spheres);
    vsh_spheres_list_free(list);
    vsh_model_free(model);
    vsh_heights_free(heights);
    vsh_field_free(field);
    vsh_grid_free(grid);
    return result;
}

static vsh_result trace(const vsh_run *run, vsh_error *error) {
    vsh_model *model = NULL;
    vsh_triangles *triangles = NULL;
    vsh_solids *solids = NULL;
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[POINTS];
    place(positions, normals);
    const vsh_light light = vsh_light_default();
    const vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf sdf = {&node, 1};
    vsh_result result;
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    MAKE(solids, vsh_solids_create(&sdf, NULL, 1, &solids, error));
    if (vsh_triangles_available()) {
        MAKE(triangles, vsh_triangles_create(&mesh, 1, run, &triangles, error));
    }
    TRY(vsh_trace_shadow(triangles, solids, POINTS, positions, normals, 0.01, &light, 8, run, values, error));
    TRY(vsh_trace_ao(triangles, solids, POINTS, positions, normals, 0.01, 1.0, 8, run, values, error));
end:
    vsh_solids_free(solids);
    vsh_triangles_free(triangles);
    vsh_model_free(model);
    return result;
}

static vsh_result bake_lightmap(const vsh_run *run, vsh_error *error) {
    vsh_model *model = NULL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_texels *texels = NULL, *band = NULL;
    vsh_charts *charts = NULL;
    float planes[8][3 * SIDE * SIDE];
    vsh_result result;
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    TRY(box_field(run, &grid, &field, error));
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    options.tangents = 1;
    MAKE(texels, vsh_texels_create(&mesh, 1, &options, run, NULL, &texels, error));
    vsh_light lights[] = {vsh_light_default(), vsh_light_default()};
    strcpy(lights[1].name, "moon");
    lights[1].direction[0] = 1.0;
    float *const shadow[] = {planes[0], planes[1]}, *const tint[] = {planes[2], planes[3]};
    const vsh_lightmap all = {.shadow = shadow,
                              .ao = planes[4],
                              .irradiance = planes[5],
                              .coverage = planes[6],
                              .bent = planes[7],
                              .tint = tint,
                              .tint_by = {VSH_TINT_QUADRATIC, {1, 1, 1}},
                              .bent_space = VSH_BENT_TANGENT};
    TRY(vsh_bake_lightmap(field, texels, lights, 2, NULL, run, &all, NULL, error));
    vsh_shade_options adaptive = vsh_shade_options_default();
    adaptive.method = VSH_SHADOW_ADAPTIVE;
    adaptive.ao_method = VSH_AO_ADAPTIVE;
    adaptive.rays = 16;
    const vsh_lightmap some = {
        .shadow = shadow, .ao = planes[4], .coverage = planes[6], .ao_error = planes[7]};
    TRY(vsh_bake_lightmap(field, texels, lights, 2, &adaptive, run, &some, NULL, error));
    options.supersample = 2;
    MAKE(charts, vsh_charts_create(&mesh, 1, &options, run, NULL, &charts, error));
    double box[6];
    TRY(vsh_charts_bounds(charts, run, box, box + 3, error));
    MAKE(band, vsh_texels_create_band(charts, 0, 8, run, &band, error));
    TRY(vsh_bake_lightmap(field, band, lights, 2, NULL, run, &some, NULL, error));
end:
    vsh_texels_free(band);
    vsh_charts_free(charts);
    vsh_texels_free(texels);
    vsh_field_free(field);
    vsh_grid_free(grid);
    vsh_model_free(model);
    return result;
}

static vsh_result bake_volume(const vsh_run *run, vsh_error *error) {
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_voxels *band = NULL, *box = NULL;
    vsh_volume *on_band = NULL, *in_box = NULL;
    const double least[] = {-1, -1, -1}, most[] = {2, 2, 2};
    const vsh_light light = vsh_light_default();
    vsh_volume_options options = vsh_volume_options_default();
    options.ao = 1;
    options.shade.ao_cones = 4;
    vsh_result result;
    TRY(box_field(run, &grid, &field, error));
    MAKE(band, vsh_voxels_from_grid(grid, 2.0, run, &band, error));
    MAKE(on_band, vsh_bake_volume(field, band, &light, 1, &options, run, &on_band, NULL, error));
    MAKE(box, vsh_voxels_from_box(least, most, 0.4, run, &box, error));
    MAKE(in_box, vsh_bake_volume(field, box, &light, 1, &options, run, &in_box, NULL, error));
    TRY(vsh_volume_write(in_box, "out.vdb", 1, error));
end:
    vsh_volume_free(in_box);
    vsh_volume_free(on_band);
    vsh_voxels_free(box);
    vsh_voxels_free(band);
    vsh_field_free(field);
    vsh_grid_free(grid);
    return result;
}

static vsh_result draw(const vsh_run *run, vsh_error *error) {
    vsh_model *model = NULL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    float planes[4][3 * SIDE * SIDE], light_plane[SIDE * SIDE];
    fill(light_plane, SIDE * SIDE);
    static const char *const name = "shadow.sun";
    const float *const plane = light_plane;
    const vsh_image lightmap = {SIDE, SIDE, 1, &name, &plane};
    const vsh_light light = vsh_light_default();
    vsh_render_options options = vsh_render_options_default();
    options.width = options.height = SIDE;
    options.samples = 1;
    options.ao = 1;
    options.shafts = 0.5;
    vsh_result result;
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    TRY(box_field(run, &grid, &field, error));
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    const vsh_lit_meshes lit = {&mesh, 1, &lightmap, {1, 1, 1}, 0};
    options.lit = &lit;
    options.lit_count = 1;
    const double least[] = {0, 0, 0}, most[] = {1, 1, 1};
    TRY(vsh_camera_frame(&options.camera, least, most, 0.5, 0.5, 1.0, error));
    const vsh_picture picture = {planes[0], planes[1], planes[2], planes[3]};
    TRY(vsh_render(&surface, 1, field, &light, 1, &options, run, &picture, NULL, error));
    float *const rgb[] = {planes[1], planes[2], planes[3]};
    TRY(vsh_picture_encode(&picture, SIDE, SIDE, 0.0, rgb, NULL, error));
end:
    vsh_field_free(field);
    vsh_grid_free(grid);
    vsh_model_free(model);
    return result;
}

static vsh_result bake_flat(const vsh_run *run, vsh_error *error) {
    vsh_outline *outline = NULL, *text = NULL, *both = NULL, *crossed = NULL;
    vsh_flat_scene *scene = NULL;
    vsh_grid *grid = NULL;
    static float planes[4][FLAT_TEXELS];
    vsh_result result;
    MAKE(scene, vsh_flat_scene_read("flat.json", &scene, error));
    MAKE(outline, vsh_flat_scene_casters(scene, run, &outline, error));
    MAKE(text, vsh_outline_from_text("A8", FONT, NULL, run, &text, error));
    const double star[] = {0, 0, 2, 0.1, 0, 0.3, 1, -1, 1, 1};
    const size_t count = 5;
    MAKE(crossed, vsh_outline_from_polygons(star, &count, 1, run, &crossed, error));
    const vsh_outline_instance instances[] = {{outline, NULL}, {crossed, NULL}, {text, NULL}};
    MAKE(both, vsh_outline_unite(instances, 3, run, &both, error));
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = 8;
    MAKE(grid, vsh_grid_from_outline(both, 1.0, NULL, &voxels, run, &grid, error));
    float *const shadow[] = {planes[0]}, *const irradiance[] = {planes[1], planes[2], planes[3]};
    static float coverage[FLAT_TEXELS];
    const vsh_flat_map map = {shadow, irradiance, coverage};
    vsh_flat_options options = scene->options;
    TRY(vsh_flat_bake(both, scene->lights, 1, &options, run, &map, error));
    options.method = VSH_FLAT_CLASSIC;
    TRY(vsh_flat_bake(both, scene->lights, 1, &options, run, &map, error));
end:
    vsh_grid_free(grid);
    vsh_outline_free(both);
    vsh_outline_free(crossed);
    vsh_outline_free(text);
    vsh_outline_free(outline);
    vsh_flat_scene_free(scene);
    return result;
}

static vsh_result write_image(const char *name, vsh_error *error) {
    float pixels[4][SIDE * SIDE];
    for (int i = 0; i < 4; ++i) {
        fill(pixels[i], SIDE * SIDE);
    }
    static const char *const names[] = {"shadow.sun", "ao", "x", "A"};
    const float *const planes[] = {pixels[0], pixels[1], pixels[2], pixels[3]};
    const vsh_image image = {SIDE, SIDE, 4, names, planes};
    return vsh_image_write(name, &image, NULL, error);
}

static vsh_result write_exr(const vsh_run *run, vsh_error *error) {
    (void)run;
    return write_image("out.exr", error);
}

static vsh_result write_png(const vsh_run *run, vsh_error *error) {
    (void)run;
    return write_image("out.png", error);
}

static vsh_result write_tif(const vsh_run *run, vsh_error *error) {
    (void)run;
    return write_image("out.tif", error);
}

static vsh_result read_image(const vsh_run *run, vsh_error *error) {
    (void)run;
    vsh_image_file *file = NULL;
    vsh_result result;
    MAKE(file, vsh_image_read("mask.png", &file, error));
end:
    vsh_image_free(file);
    return result;
}

const scenario scenarios[] = {
    {"scene files", read_scenes},
    {"models", read_models},
    {"a scene's assets", load_scene},
    {"grids", make_grids},
    {"a grid written", write_grid},
    {"points shaded", shade_points},
    {"a query with layers", ask},
    {"rays traced", trace},
    {"a lightmap", bake_lightmap},
    {"a volume written", bake_volume},
    {"a picture", draw},
    {"a flat scene", bake_flat},
    {"an EXR file written", write_exr},
    {"a PNG file written", write_png},
    {"a TIFF file written", write_tif},
    {"an image read", read_image},
};
const size_t scenario_count = sizeof scenarios / sizeof scenarios[0];
