/* Small runs through the public calls: reading, making casters, shading, baking, writing. */
#include "scenarios.h"
#include "../unit/previews.h"

static void free_list(double **list) {
    free(*list);
}

/* --- parts of several scenarios */

/* Fills an array with values of 0 … 1; no two neighbours are equal. */
static void parts_fill(float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        values[i] = (float)(i * 37 % 101) / 100.0f;
    }
}

/* A cube with edges of 1. */
static vsh_mesh cube(void) {
    static float corners[24];
    return box_mesh(corners, (const double[3]){0, 0, 0}, (const double[3]){1, 1, 1});
}

/* The cube in a few voxels. */
static vsh_result parts_occluders(const vsh_run *run, vsh_grid **grid, vsh_occluders **occluders,
                                  vsh_error *error) {
    const vsh_mesh mesh = cube();
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 6;
    vsh_occluders_options wide = vsh_occluders_options_default();
    wide.reach = 1.0;
    *grid = NULL;
    *occluders = NULL;
    MAKE(*grid, vsh_grid_from_meshes(&mesh, 1, &options, run, grid, error));
    MAKE(*occluders, vsh_occluders_from_grid(*grid, &wide, run, occluders, error));
    return VSH_OK;
}

/* Points around the cube, with normals up. */
static void parts_place(double positions[3 * POINTS], float normals[3 * POINTS]) {
    for (int i = 0; i < POINTS; ++i) {
        positions[3 * i] = 0.03 * i - 0.7;
        positions[3 * i + 1] = 1.1;
        positions[3 * i + 2] = 0.3 * (i % 7) - 0.5;
        normals[3 * i] = normals[3 * i + 2] = 0.0f;
        normals[3 * i + 1] = 1.0f;
    }
}

/* --- the scenarios */

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
    OWNED(vshi_triangles) *triangles = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.truth = 1;
    MAKE(scene, vsh_scene_read("scene.json", NULL, &scene, error));
    MAKE(assets, vsh_assets_load(scene, run, &assets, error));
    MAKE(grid, vsh_scene_casters(scene, assets, run, &grid, error));
    MAKE(layer, vshi_scene_layer_casters(scene, assets, &scene->layers[0], run, &layer, error));
    MAKE(triangles, vshi_scene_triangles(scene, assets, &scene->layers[0], run, &triangles, error));
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
    OWNED(vsh_grid) *from_sdf = NULL, *from_distance = NULL, *from_meshes = NULL, *united = NULL;
    vsh_mesh boxes[] = {cube(), cube()}; /* which overlap */
    boxes[1].transform = moved;
    MAKE(from_sdf, vsh_grid_from_sdf(&sdf, &options, run, &from_sdf, error));
    MAKE(from_distance, vsh_grid_from_distance(&distance, &options, run, &from_distance, error));
    MAKE(from_meshes, vsh_grid_from_meshes(boxes, 2, &options, run, &from_meshes, error));
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
    OWNED(vshi_heights) *heights = NULL;
    OWNED(vsh_model) *model = NULL;
    OWNED(vshi_spheres) *spheres = NULL;
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
    MAKE(heights, vshi_heights_create(&source, run, &heights, error));
    MAKE(model, vsh_model_from_heights(&source, VSH_HEIGHTS_SURFACE, run, &model, error));
    vsh_model_free(model);
    model = NULL;
    MAKE(model, vsh_model_from_heights(&source, VSH_HEIGHTS_SOLID, run, &model, error));
    MAKE(list, vshi_spheres_read("balls.csv", run, &list, &count, error));
    MAKE(spheres, vshi_spheres_create(list, count, NULL, run, &spheres, error));
    static const char *const names[] = {"sun"};
    vshi_layer layers[] = {vshi_layer_default(), vshi_layer_default(), vshi_layer_default()};
    layers[0].heights = heights;
    layers[0].method = VSH_SHADOW_CLASSIC;
    layers[1].spheres = spheres;
    layers[1].method = VSH_SHADOW_CLASSIC;
    layers[1].lights = names;
    layers[1].light_count = 1;
    vshi_occluder_parts parts = parts_of(occluders);
    layers[2].field = parts.field;
    parts.layers = layers;
    parts.layer_count = 3;
    MAKE(layered, vshi_occluders_make(&parts, NULL, &layered, error));
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

static vsh_result make_casters(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_occluders) *occluders = NULL;
    vsh_occluders_options few = vsh_occluders_options_default();
    few.grid.resolution = 10;
    const vsh_mesh mesh = cube();
    MAKE(occluders, vsh_occluders_create(&mesh, 1, &few, run, &occluders, error));
    return VSH_OK;
}

/* Writes a lit asset of meshes of two triangles. With `split_them`, vertices are split and lie on two pages;
 * else the meshes keep their UVs. */
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
    const vsh_lit_mesh split = {uvs, sources, indices, charts, CORNERS, 2, 0, -1, NULL},
                       meshes[] = {split, split};
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

/* A rough sheet and an instance of it, on pages that are searched for; then the sheet by its own UVs. */
static vsh_result unwrap(const vsh_run *run, vsh_error *error) {
    enum { EDGE = 4 };
    static const double twice[12] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
    float samples[EDGE * EDGE];
    parts_fill(samples, EDGE * EDGE);
    const vsh_heights_source source = {
        .columns = EDGE, .rows = EDGE, .values = samples, .size = {4, 4}, .height = 2.0};
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_atlas) *atlas = NULL, *again = NULL;
    MAKE(model, vsh_model_from_heights(&source, VSH_HEIGHTS_SURFACE, run, &model, error));
    const vsh_mesh own = vsh_model_mesh(model, 0, 0);
    vsh_mesh meshes[2] = {own, own};
    meshes[0].uvs = meshes[1].uvs = NULL;
    meshes[1].transform = twice;
    vsh_unwrap_options options = vsh_unwrap_options_default();
    options.width = options.height = 64;
    options.max_pages = 2;
    options.keep_uvs = VSH_UNWRAP_KEEP;
    MAKE(atlas, vsh_unwrap(meshes, 2, &options, run, &atlas, error));
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

/* --- scenarios that bake, and that write and read images */

enum { FLAT_TEXELS = 64 };

/* Of the package fonts-dejavu-core. */
#define FONT "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"

static vsh_result bake_lightmap(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    OWNED(vsh_charts) *charts = NULL, *fine = NULL;
    float planes[8][3 * SIDE * SIDE];
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    TRY(parts_occluders(run, &grid, &occluders, error));
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIDE;
    options.tangents = 1;
    MAKE(charts, vsh_charts_create(&mesh, 1, &options, run, NULL, &charts, error));
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
    TRY(vsh_bake_lightmap(occluders, charts, lights, 2, NULL, run, &all, NULL, error));
    vsh_shade_options adaptive = preview_options();
    adaptive.method = VSH_SHADOW_ADAPTIVE;
    adaptive.ao_method = VSH_AO_ADAPTIVE;
    adaptive.rays = 16;
    const vsh_lightmap some = {.shadow = shadow,
                               .ao = planes[4],
                               .coverage = planes[6],
                               .ao_error = planes[7],
                               .row_texels = 2 * SIDE};
    TRY(vsh_bake_lightmap(occluders, charts, lights, 2, &adaptive, run, &some, NULL, error));
    options.supersample = 2;
    MAKE(fine, vsh_charts_create(&mesh, 1, &options, run, NULL, &fine, error));
    vsh_stitch_options creases = vsh_stitch_options_default();
    creases.max_angle = 180.0; /* a box has no other seams */
    TRY(stitch_one(fine, &all, 2, &creases, run, NULL, error));
    TRY(vsh_bake_lightmap(occluders, fine, lights, 2, NULL, run, &some, NULL, error));
    return VSH_OK;
}

static vsh_result bake_volume(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    OWNED(vsh_voxels) *band = NULL, *box = NULL;
    OWNED(vsh_volume) *on_band = NULL, *in_box = NULL;
    const double least[] = {-1, -1, -1}, most[] = {2, 2, 2};
    const vsh_light light = vsh_light_default();
    vsh_volume_options options = preview_volume_options();
    options.ao = 1;
    options.shade.ao_cones = 4;
    TRY(parts_occluders(run, &grid, &occluders, error));
    MAKE(band, vsh_voxels_from_grid(grid, 2.0, run, &band, error));
    MAKE(on_band, vsh_bake_volume(occluders, band, &light, 1, &options, run, &on_band, NULL, error));
    MAKE(box, vsh_voxels_from_box(least, most, 0.4, run, &box, error));
    MAKE(in_box, vsh_bake_volume(occluders, box, &light, 1, &options, run, &in_box, NULL, error));
    TRY(vsh_volume_write(in_box, "out.vdb", 1, NULL, 0, error));
    return VSH_OK;
}

static vsh_result draw(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    float planes[4][3 * SIDE * SIDE], light_plane[SIDE * SIDE];
    parts_fill(light_plane, SIDE * SIDE);
    static const char *const name = "shadow.sun";
    const float *const plane = light_plane;
    const vsh_image lightmap = {SIDE, SIDE, 1, &name, &plane, NULL};
    const vsh_light light = vsh_light_default();
    vsh_render_options options = preview_render_options();
    options.width = options.height = SIDE;
    options.samples = 1;
    options.ao = 1;
    options.shafts = 0.5;
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    TRY(parts_occluders(run, &grid, &occluders, error));
    const vshi_occluder_parts parts = parts_of(occluders);
    const vsh_surface surface = {parts.field, {0.5, 0.5, 0.5}};
    const vsh_lit_meshes lit = {&mesh, 1, &lightmap, {1, 1, 1}, 0};
    options.lit = &lit;
    options.lit_count = 1;
    const double least[] = {0, 0, 0}, most[] = {1, 1, 1};
    TRY(vsh_camera_frame(&options.camera, least, most, 0.5, 0.5, 1.0, error));
    const vsh_picture picture = {planes[0], planes[1], planes[2], planes[3]};
    TRY(vsh_render(&surface, 1, occluders, &light, 1, &options, run, &picture, NULL, error));
    float *const rgb[] = {planes[1], planes[2], planes[3]};
    TRY(vsh_picture_encode(&picture, SIDE, SIDE, 0.0, rgb, NULL, error));
    return VSH_OK;
}

static vsh_result bake_flat(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_outline) *outline = NULL, *text = NULL, *both = NULL, *crossed = NULL;
    OWNED(vsh_flat_scene) *scene = NULL;
    OWNED(vsh_grid) *grid = NULL;
    static float planes[4][FLAT_TEXELS];
    MAKE(scene, vsh_flat_scene_read("flat.json", NULL, &scene, error));
    MAKE(outline, vshi_flat_scene_casters(scene, run, &outline, error));
    MAKE(text, vshi_outline_from_text("A8", FONT, NULL, run, &text, error));
    const double star[] = {0, 0, 2, 0.1, 0, 0.3, 1, -1, 1, 1};
    const size_t count = 5;
    MAKE(crossed, vsh_outline_from_polygons(star, &count, 1, run, &crossed, error));
    const vshi_outline_instance instances[] = {{outline, NULL}, {crossed, NULL}, {text, NULL}};
    MAKE(both, vshi_outline_unite(instances, 3, run, &both, error));
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.resolution = 8;
    MAKE(grid, vsh_grid_from_outline(both, 1.0, NULL, &voxels, run, &grid, error));
    float *const shadow[] = {planes[0]}, *const irradiance[] = {planes[1], planes[2], planes[3]};
    static float coverage[FLAT_TEXELS];
    const vsh_flat_map map = {shadow, irradiance, coverage};
    TRY(vshi_flat_bake(both, scene->lights, 1, &scene->options, run, &map, error));
    return VSH_OK;
}

static vsh_result write_image(const char *name, vsh_error *error) {
    float pixels[4][SIDE * SIDE];
    for (int i = 0; i < 4; ++i) {
        parts_fill(pixels[i], SIDE * SIDE);
    }
    static const char *const names[] = {"shadow.sun", "ao", "x", "A"};
    const float *const planes[] = {pixels[0], pixels[1], pixels[2], pixels[3]};
    const vsh_image image = {SIDE, SIDE, 4, names, planes, NULL};
    return vsh_image_write(name, &image, NULL, error);
}

#define WRITES_IMAGE(function, name)                                                                         \
    static vsh_result function(const vsh_run *run, vsh_error *error) {                                       \
        return write_image(name, error);                                                                     \
    }
WRITES_IMAGE(write_exr, "out.exr")
WRITES_IMAGE(write_png, "out.png")
WRITES_IMAGE(write_tif, "out.tif")

static vsh_result read_images(const vsh_run *run, vsh_error *error) {
    for (size_t i = 0; i < IMAGES; ++i) {
        OWNED(vsh_image_file) *file = NULL;
        MAKE(file, vsh_image_read(images[i], run, &file, error));
    }
    return VSH_OK;
}

const scenario scenarios[] = {
    {"models", read_models},
    {"a scene's assets", load_scene},
    {"a scene baked", bake_scene},
    {"grids", make_grids},
    {"a grid written", write_grid},
    {"points shaded", shade_points},
    {"a query with layers", ask},
    {"casters made for rays", make_casters},
    {"a lightmap", bake_lightmap},
    {"a volume written", bake_volume},
    {"a picture", draw},
    {"a flat scene", bake_flat},
    {"an EXR file written", write_exr},
    {"a PNG file written", write_png},
    {"a TIFF file written", write_tif},
    {"images read", read_images},
    {"a lit document written", light_document},
    {"a lit model written", light_model},
    {"a comparison", compare},
    {"a page", write_page},
    {"a scene's page", write_scene_page},
    {"an atlas", unwrap},
};
const size_t scenario_count = sizeof scenarios / sizeof scenarios[0];
