/* Scenarios that bake, and that write and read images. */
#include "../unit/previews.h"
#include "scenarios.h"

#include <string.h>

enum { FLAT_TEXELS = 64 };

/* Of the package fonts-dejavu-core. */
#define FONT "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"

static void free_image(vsh_image_file **file) {
    vsh_image_free(*file);
}

vsh_result bake_lightmap(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_occluders) *occluders = NULL;
    OWNED(vsh_charts) *charts = NULL, *fine = NULL;
    OWNED(vsh_texels) *texels = NULL;
    float planes[8][3 * SIDE * SIDE];
    MAKE(model, vsh_model_read("box.obj", run, &model, error));
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    TRY(parts_occluders(run, &grid, &occluders, error));
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIDE;
    options.tangents = 1;
    MAKE(charts, vsh_charts_create(&mesh, 1, &options, run, NULL, &charts, error));
    MAKE(texels, vsh_texels_create(charts, run, &texels, error));
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
    const vsh_lightmap some = {
        .shadow = shadow, .ao = planes[4], .coverage = planes[6], .ao_error = planes[7]};
    TRY(vsh_bake_lightmap(occluders, charts, lights, 2, &adaptive, run, &some, NULL, error));
    options.supersample = 2;
    MAKE(fine, vsh_charts_create(&mesh, 1, &options, run, NULL, &fine, error));
    vsh_stitch_options creases = vsh_stitch_options_default();
    creases.max_angle = 180.0; /* a box has no other seams */
    TRY(vsh_lightmap_stitch(fine, &all, 2, &creases, run, NULL, error));
    TRY(vsh_bake_lightmap(occluders, fine, lights, 2, NULL, run, &some, NULL, error));
    return VSH_OK;
}

vsh_result bake_volume(const vsh_run *run, vsh_error *error) {
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

vsh_result draw(const vsh_run *run, vsh_error *error) {
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
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(occluders, &parts);
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

vsh_result bake_flat(const vsh_run *run, vsh_error *error) {
    OWNED(vsh_outline) *outline = NULL, *text = NULL, *both = NULL, *crossed = NULL;
    OWNED(vsh_flat_scene) *scene = NULL;
    OWNED(vsh_grid) *grid = NULL;
    static float planes[4][FLAT_TEXELS];
    MAKE(scene, vsh_flat_scene_read("flat.json", NULL, &scene, error));
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

vsh_result write_exr(const vsh_run *run, vsh_error *error) {
    return write_image("out.exr", error);
}

vsh_result write_png(const vsh_run *run, vsh_error *error) {
    return write_image("out.png", error);
}

vsh_result write_tif(const vsh_run *run, vsh_error *error) {
    return write_image("out.tif", error);
}

vsh_result read_images(const vsh_run *run, vsh_error *error) {
    for (size_t i = 0; i < IMAGES; ++i) {
        FREED_BY(free_image) vsh_image_file *file = NULL;
        MAKE(file, vsh_image_read(images[i], run, &file, error));
    }
    return VSH_OK;
}
