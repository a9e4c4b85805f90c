#include "scenarios.h"
#include "../unit/previews.h"

#include <math.h>
#include <stdbool.h>

OWNER(vsh_provenance)

static void free_list(double **list) {
    vsh_spheres_list_free(*list);
}

/* --- what several of them need */

void parts_fill(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        values[i] = (float)(i * 37 % 101) / 100.0f;
    }
}

vsh_result parts_occluders(const vsh_run *run, vsh_grid **grid, vsh_occluders **occluders, vsh_error *error) {
    static const float corners[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
    static const uint32_t indices[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                       3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};
    const vsh_mesh mesh = {
        .name = "box", .positions = corners, .indices = indices, .vertex_count = 8, .triangle_count = 12};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 6;
    vsh_field_options wide = vsh_field_options_default();
    wide.reach = 1.0;
    *grid = NULL;
    *occluders = NULL;
    MAKE(*grid, vsh_grid_from_meshes(&mesh, 1, &options, run, grid, error));
    MAKE(*occluders, vsh_occluders_from_grid(*grid, &wide, run, occluders, error));
    return VSH_OK;
}

void parts_place(double positions[3 * POINTS], float normals[3 * POINTS]) {
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
    OWNED(vsh_scene) *scene = NULL;
    OWNED(vsh_flat_scene) *flat = NULL;
    MAKE(scene, vsh_scene_read("scene.json", NULL, &scene, error));
    MAKE(flat, vsh_flat_scene_read("flat.json", NULL, &flat, error));
    return VSH_OK;
}

static vsh_result read_models(const vsh_run *run, vsh_error *error) {
    static const char *const names[] = {"box.obj", "triangle.ply", "triangle.stl"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        OWNED(vsh_model) *model = NULL;
        MAKE(model, vsh_model_read(names[i], run, &model, error));
        const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
        vsh_mesh_report report;
        TRY(vsh_mesh_check(&mesh, &report, error));
    }
    return VSH_OK;
}

static vsh_result load_scene(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_scene) *scene = NULL;
    OWNED(vsh_assets) *assets = NULL;
    OWNED(vsh_grid) *grid = NULL, *layer = NULL;
    OWNED(vsh_triangles) *triangles = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.truth = 1;
    MAKE(scene, vsh_scene_read("scene.json", NULL, &scene, error));
    MAKE(assets, vsh_assets_load(scene, run, &assets, error));
    MAKE(grid, vsh_scene_casters(scene, assets, run, &grid, error));
    MAKE(layer, vsh_scene_layer_casters(scene, assets, &scene->layers[0], run, &layer, error));
    MAKE(triangles, vsh_scene_triangles(scene, assets, &scene->layers[0], run, &triangles, error));
    MAKE(occluders, vsh_scene_occluders(scene, assets, &options, run, &occluders, error));
    return VSH_OK;
}

static vsh_result bake_scene(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_scene) *scene = NULL;
    MAKE(scene, vsh_scene_read("scene.json", NULL, &scene, error));
    TRY(vsh_bake_scene(scene, NULL, run, NULL, error));
    return VSH_OK;
}

static double ball(void *user, const double p[3]) {
    return 2.0 * (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1.0);
}

static vsh_result make_grids(const vsh_run *run, vsh_error *error) {
    vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf sdf = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 10;
    const vsh_distance distance = {ball, NULL, 2.0, 0, {-1, -1, -1}, {1, 1, 1}};
    const double moved[12] = {1, 0, 0, 0.53, 0, 1, 0, 0.1, 0, 0, 1, 0};
    OWNED(vsh_grid) *from_sdf = NULL, *from_distance = NULL, *united = NULL;
    MAKE(from_sdf, vsh_grid_from_sdf(&sdf, &options, run, &from_sdf, error));
    MAKE(from_distance, vsh_grid_from_distance(&distance, &options, run, &from_distance, error));
    const vsh_grid_instance instances[] = {{from_sdf, NULL}, {from_distance, moved}};
    MAKE(united, vsh_grid_unite(instances, 2, &options, run, &united, error));
    return VSH_OK;
}

static vsh_result write_grid(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    TRY(parts_occluders(run, &grid, &occluders, error));
    TRY(vsh_grid_write(grid, "out.vdb", NULL, NULL, 0, error));
    return VSH_OK;
}

static vsh_result shade_points(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[POINTS], deviation[POINTS], bent[3 * POINTS];
    parts_place(positions, normals);
    const vsh_points points = {POINTS, positions, normals, NULL};
    vsh_light light = vsh_light_default();
    light.angle = 0.3;
    vsh_shade_options options = preview_options();
    options.rays = 16;
    TRY(parts_occluders(run, &grid, &occluders, error));
    for (options.method = VSH_SHADOW_HARD; options.method < VSH_SHADOW_EXACT; ++options.method) {
        TRY(vsh_shade_shadow(occluders, &points, &light, &options, run, values, deviation, NULL, error));
    }
    options.method = VSH_SHADOW_CONE;
    for (options.ao_method = VSH_AO_TAPS; options.ao_method < VSH_AO_EXACT; ++options.ao_method) {
        TRY(vsh_shade_ao(occluders, &points, &options, run, values, deviation, NULL, NULL, error));
    }
    options.ao_method = VSH_AO_CONES;
    TRY(vsh_shade_ao(occluders, &points, &options, run, values, NULL, bent, NULL, error));
    return VSH_OK;
}

static vsh_result ask(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL, *layered = NULL;
    OWNED(vsh_heights) *heights = NULL;
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_spheres) *spheres = NULL;
    FREED_BY(free_list) double *list = NULL;
    size_t count = 0;
    OWNED(vsh_query) *query = NULL;
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[2][POINTS], gradient[3 * POINTS], samples[SIDE * SIDE];
    parts_place(positions, normals);
    parts_fill(samples, SIDE * SIDE);
    const vsh_heights_source source = {
        .columns = SIDE, .rows = SIDE, .values = samples, .size = {4, 4}, .height = 0.5};
    TRY(parts_occluders(run, &grid, &occluders, error));
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
    layers[0].method = VSH_SHADOW_CLASSIC;
    layers[1].spheres = spheres;
    layers[1].method = VSH_SHADOW_CLASSIC;
    layers[1].lights = names;
    layers[1].light_count = 1;
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(occluders, &parts);
    layers[2].field = parts.field;
    parts.layers = layers;
    parts.layer_count = 3;
    MAKE(layered, vsh_occluders_from_parts(&parts, &layered, error));
    vsh_shade_options options = preview_options();
    const vsh_light light = vsh_light_default();
    MAKE(query, vsh_query_create(layered, &light, 1, &options, &query, error));
    float *const planes[] = {values[0]};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = planes;
    output.ao = values[1];
    output.gradient = gradient;
    const vsh_points points = {POINTS, positions, normals, NULL};
    TRY(vsh_query_points(query, &points, NULL, run, &output, NULL, error));
    return VSH_OK;
}

static vsh_result trace(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_triangles) *triangles = NULL;
    OWNED(vsh_solids) *solids = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    vsh_occluders_options few = vsh_occluders_options_default();
    few.grid.resolution = 10;
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[POINTS];
    parts_place(positions, normals);
    const vsh_light light = vsh_light_default();
    const vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf sdf = {&node, 1};
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    MAKE(occluders, vsh_occluders_create(&mesh, 1, &few, run, &occluders, error));
    MAKE(solids, vsh_solids_create(&sdf, NULL, 1, &solids, error));
    MAKE(triangles, vsh_triangles_create(&mesh, 1, run, &triangles, error));
    TRY(vsh_trace_shadow(triangles, solids, POINTS, positions, normals, 0.01, &light, 8, run, values, error));
    TRY(vsh_trace_ao(triangles, solids, POINTS, positions, normals, 0.01, 1.0, 8, run, values, error));
    return VSH_OK;
}

static vsh_result tell_origin(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_scene) *scene = NULL;
    OWNED(vsh_provenance) *provenance = NULL;
    static const char *const file = "scene.json";
    MAKE(scene, vsh_scene_read(file, NULL, &scene, error));
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = scene;
    source.files = &file;
    source.file_count = 1;
    source.command = "bake scene.json";
    source.voxel_size = 0.1;
    MAKE(provenance, vsh_provenance_create(&source, run, &provenance, error));
    return VSH_OK;
}

/* Meshes of two triangles, whose vertices are split and on two pages; NULL: by their own UVs. */
static vsh_result light_asset(const char *name, bool split_them, const vsh_run *run, vsh_error *error) {
    enum { CORNERS = 6 };
    static const float white[] = {1.0f, 0.5f, 0.25f, 2.0f};
    static const float *const planes[] = {white};
    static const uint32_t sources[CORNERS] = {0, 1, 2, 0, 2, 3}, indices[CORNERS] = {0, 1, 2, 3, 4, 5},
                          charts[] = {0, 1};
    static const float uvs[2 * CORNERS] = {0, 0, 1, 0, 1, 1, 0, 0.5f, 1, 0.5f, 0, 1};
    const vsh_lit_image baked[] = {
        {.purpose = VSH_LIT_OCCLUSION, .width = 2, .height = 2, .channels = planes, .channel_count = 1},
        {.purpose = VSH_LIT_LIGHTMAP,
         .page = 1,
         .width = 2,
         .height = 2,
         .channels = planes,
         .channel_count = 1}};
    const vsh_lit_mesh split = {uvs, sources, indices, charts, CORNERS, 2, 0, -1}, meshes[] = {split, split};
    vsh_lit_options options = vsh_lit_options_default();
    options.images = baked;
    options.image_count = 2;
    options.chart_pages = charts;
    options.chart_count = 2;
    OWNED(vsh_model) *model = NULL;
    MAKE(model, vsh_model_read(name, run, &model, error));
    TRY(vsh_lit_write(name, model, split_them ? meshes : NULL, &options, "out.glb", run, error));
    return VSH_OK;
}

static vsh_result light_document(const vsh_run *run, vsh_error *error) {
    return light_asset("quad.gltf", true, run, error);
}

static vsh_result light_model(const vsh_run *run, vsh_error *error) {
    return light_asset("box.obj", false, run, error);
}

/* A bent sheet, a copy of it and an instance, on pages that are searched for; then with the UVs that came of
 * it. */
static vsh_result unwrap(const vsh_run *run, vsh_error *error) {
    enum { N = 3, VERTICES = (N + 1) * (N + 1), TRIANGLES = 4 * N * N };
    static float positions[VERTICES][3];
    static uint32_t indices[TRIANGLES][3];
    static const double twice[12] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
    for (uint32_t v = 0; v < VERTICES; ++v) {
        const float x = (float)(v % (N + 1)), y = (float)(v / (N + 1));
        positions[v][0] = x;
        positions[v][1] = y;
        positions[v][2] = 0.05F * (x * x + 2 * y * y);
    }
    for (uint32_t q = 0; q < 2 * N * N; ++q) {
        const uint32_t v = q / N % N * (N + 1) + q % N, quad[4] = {v, v + 1, v + N + 2, v + N + 1};
        for (uint32_t t = 0; t < 2; ++t) {
            indices[2 * q + t][0] = quad[0];
            indices[2 * q + t][1] = quad[1 + t];
            indices[2 * q + t][2] = quad[2 + t];
        }
    }
    vsh_mesh meshes[2] = {{.positions = positions[0],
                           .indices = indices[0],
                           .vertex_count = VERTICES,
                           .triangle_count = TRIANGLES}};
    meshes[1] = meshes[0];
    meshes[1].transform = twice;
    vsh_unwrap_options options = vsh_unwrap_options_default();
    options.width = options.height = 64;
    options.max_pages = 2;
    options.keep_uvs = VSH_UNWRAP_KEEP;
    OWNED(vsh_atlas) *atlas = NULL, *again = NULL;
    MAKE(atlas, vsh_unwrap(meshes, 2, &options, run, &atlas, error));
    const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, 0);
    static float corners[3 * TRIANGLES][3];
    for (size_t v = 0; v < placed.vertex_count; ++v) {
        for (size_t k = 0; k < 3; ++k) {
            corners[v][k] = positions[placed.sources[v]][k];
        }
    }
    const vsh_mesh own = {.positions = corners[0],
                          .uvs = placed.uvs,
                          .indices = placed.indices,
                          .vertex_count = placed.vertex_count,
                          .triangle_count = placed.triangle_count};
    options.max_pages = 1;
    MAKE(again, vsh_unwrap(&own, 1, &options, run, &again, error));
    return VSH_OK;
}

static vsh_result compare(const vsh_run *run, vsh_error *error) {
    float golden[SIDE * SIDE], values[SIDE * SIDE];
    parts_fill(golden, SIDE * SIDE);
    parts_fill(values, SIDE * SIDE);
    values[SIDE] = 1.0f;
    const vsh_compared compared = {{SIDE, SIDE, 1}, golden, values, NULL};
    vsh_measures measures;
    return vsh_compare(&compared, NULL, run, &measures, error);
}

static vsh_result write_page(const vsh_run *run, vsh_error *error) {
    vsh_view_bake bake = vsh_view_bake_default(), other = bake;
    bake.model = "box.obj";
    bake.planes = images;
    bake.plane_count = 1;
    other.planes = images;
    other.plane_count = IMAGES;
    return vsh_view_write("out.html", &bake, &other, run, error);
}

static vsh_result write_scene_page(const vsh_run *run, vsh_error *error) {
    vsh_sdf_node node = vsh_sdf_node_default();
    vsh_caster ball = vsh_caster_default();
    ball.type = VSH_CASTER_SDF;
    ball.sdf = (vsh_sdf){&node, 1};
    vsh_light light = vsh_light_default();
    vsh_scene scene = vsh_scene_default();
    scene.casters = &ball;
    scene.caster_count = 1;
    scene.lights = &light;
    scene.light_count = 1;
    scene.grid.resolution = 8;
    scene.shade = preview_options();
    scene.ao = 1;
    return vsh_view_write_scene("out.html", "a scene", &scene, run, error);
}

const scenario scenarios[] = {
    {"scene files", read_scenes},
    {"models", read_models},
    {"a scene's assets", load_scene},
    {"a scene baked", bake_scene},
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
    {"images read", read_images},
    {"an output's origin", tell_origin},
    {"a lit document written", light_document},
    {"a lit model written", light_model},
    {"a comparison", compare},
    {"a page", write_page},
    {"a scene's page", write_scene_page},
    {"an atlas", unwrap},
};
const size_t scenario_count = sizeof scenarios / sizeof scenarios[0];
