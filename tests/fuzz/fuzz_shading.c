/* Calls that shade and bake, with structs of any bytes: they return a code and do not crash. */
#include "parts.h"

#include <string.h>

enum { POINTS = 12, MOST_TEXELS = 1 << 14 };

/* Whether the planes hold what options ask for: members past struct_size do not count, defaults do. */
#define FITS(options)                                                                                        \
    ((options).struct_size >= (size_t)((const char *)(&(options).height + 1) - (const char *)&(options)) &&  \
     (int64_t)(options).width * (options).height <= MOST_TEXELS)

static void shade(fuzz_input *input) {
    vsh_shade_options options = vsh_shade_options_default();
    options.rays = 4;
    fuzz_take(input, &options, sizeof options);
    vsh_occluders *occluders = fuzz_take_occluders(input);
    const vsh_run run = fuzz_take_run(input);
    const vsh_light light = fuzz_take_light(input);
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[3 * POINTS], deviation[POINTS], ao[POINTS];
    uint32_t texels[POINTS] = {0};
    for (int i = 0; i < 3 * POINTS; ++i) {
        positions[i] = 0.1 * i - 1.5;
        normals[i] = (float)(i % 3 == 1);
    }
    fuzz_take(input, positions, sizeof positions);
    fuzz_take(input, normals, sizeof normals);
    fuzz_take(input, texels, sizeof texels);
    const uint8_t how = fuzz_byte(input);
    const vsh_points points = {POINTS, positions, how & 1 ? normals : NULL, how & 2 ? texels : NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    fuzz_take(input, &stats, sizeof stats.struct_size);
    float *const error = how & 4 ? deviation : NULL;
    fuzz_check_plain(
        vsh_shade_shadow(occluders, &points, &light, &options, &run, values, error, &stats, fuzz_error()));
    fuzz_check_plain(
        vsh_shade_ao(occluders, &points, &options, &run, values, error, NULL, &stats, fuzz_error()));
    fuzz_check_plain(
        vsh_shade_ao(occluders, &points, &options, &run, ao, error, values, &stats, fuzz_error()));
    fuzz_free_occluders(occluders);
}

static void query(fuzz_input *input) {
    vsh_shade_options options = vsh_shade_options_default();
    fuzz_take(input, &options, sizeof options);
    vsh_occluders *occluders = fuzz_take_occluders(input);
    const vsh_run run = fuzz_take_run(input);
    const vsh_light light = fuzz_take_light(input);
    vsh_query *made_query;
    FUZZ_MAKE(made_query, vsh_query_create(occluders, &light, 1, &options, &made_query, fuzz_error()));
    if (made_query == NULL) {
        fuzz_free_occluders(occluders);
        return;
    }
    /* strides as the input asks, within these limits */
    enum { ROOM = 1 << 12, MOST_STRIDE = 256 };
    static double positions[ROOM];
    static float normals[ROOM], visibility[ROOM], ao[ROOM], distance[ROOM], gradient[ROOM];
    vsh_point_layout layout = vsh_point_layout_default();
    fuzz_take(input, &layout, sizeof layout);
    vsh_query_output output = vsh_query_output_default();
    fuzz_take(input, &output, sizeof output);
    if (layout.position_stride > MOST_STRIDE || layout.normal_stride > MOST_STRIDE ||
        layout.texel_stride > MOST_STRIDE || output.stride > MOST_STRIDE) {
        goto done;
    }
    const uint8_t how = fuzz_byte(input);
    const vsh_points points = {POINTS - fuzz_byte(input) % (POINTS + 1), how & 1 ? positions : NULL,
                               how & 4 ? normals : NULL, how & 8 ? (const uint32_t *)fuzz_indices : NULL};
    layout.float_positions = how & 2 ? normals : NULL;
    layout.texel_stride = 4;
    float *const planes[] = {visibility};
    output.visibility = how & 16 ? planes : NULL;
    output.shadow_error = NULL;
    output.ao = how & 32 ? ao : NULL;
    output.ao_error = NULL;
    output.distance = how & 64 ? distance : NULL;
    output.gradient = how & 128 ? gradient : NULL;
    fuzz_fill(input, positions, 3 * POINTS * sizeof *positions);
    fuzz_fill(input, normals, 3 * POINTS * sizeof *normals);
    fuzz_check_plain(vsh_query_points(made_query, &points, &layout, &run, &output, NULL, fuzz_error()));
done:
    vsh_query_free(made_query);
    fuzz_free_occluders(occluders);
}

static void lightmap(fuzz_input *input) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = FUZZ_SIDE;
    fuzz_take(input, &options, sizeof options);
    const vsh_run run = fuzz_take_run(input);
    float places[16];
    memcpy(places, fuzz_uvs, sizeof places);
    fuzz_take(input, places, sizeof places);
    vsh_mesh mesh = fuzz_made()->mesh;
    mesh.uvs = places;
    mesh.normals = fuzz_byte(input) & 1 ? fuzz_corners : NULL;
    vsh_charts *charts;
    FUZZ_MAKE(charts, vsh_charts_create(&mesh, 1, &options, &run, NULL, &charts, fuzz_error()));
    if (charts != NULL && FITS(options)) {
        static float planes[8][3 * MOST_TEXELS];
        vsh_shade_options shading = vsh_shade_options_default();
        shading.ao_cones = 4;
        fuzz_take(input, &shading, sizeof shading);
        vsh_occluders *occluders = fuzz_take_occluders(input);
        const vsh_light light = fuzz_take_light(input);
        double ambient[3] = {0.1, 0.2, 0.3};
        fuzz_take(input, ambient, sizeof ambient);
        float *const shadow[] = {planes[0]}, *const tint[] = {planes[1]};
        vsh_lightmap map = {0};
        fuzz_take(input, &map, sizeof map);
        const uint8_t how = fuzz_byte(input);
        map.shadow = how & 1 ? shadow : NULL;
        map.ao = how & 2 ? planes[2] : NULL;
        map.irradiance = how & 4 ? planes[3] : NULL;
        map.coverage = planes[4];
        map.shadow_error = NULL;
        map.ao_error = NULL;
        map.bent = how & 8 ? planes[5] : NULL;
        map.tint = how & 16 ? tint : NULL;
        map.ambient = how & 32 ? ambient : NULL;
        map.invalid = how & 64 ? planes[6] : NULL;
        map.sky = how & 128 ? planes[7] : NULL;
        fuzz_check_plain(
            vsh_bake_lightmap(occluders, charts, &light, 1, &shading, &run, &map, NULL, fuzz_error()));
        fuzz_free_occluders(occluders);
    }
    vsh_charts_free(charts);
}

static void volume(fuzz_input *input) {
    vsh_volume_options options = vsh_volume_options_default();
    options.shade.ao_cones = 4;
    fuzz_take(input, &options, sizeof options);
    vsh_occluders *occluders = fuzz_take_occluders(input);
    const vsh_run run = fuzz_take_run(input);
    const vsh_light light = fuzz_take_light(input);
    double box[6] = {-1, -1, -1, 1, 1, 1}, size = 0.5;
    fuzz_take(input, box, sizeof box);
    fuzz_take(input, &size, sizeof size);
    vsh_voxels *voxels;
    FUZZ_MAKE(voxels, vsh_voxels_from_box(box, box + 3, size, &run, &voxels, fuzz_error()));
    FUZZ_TRY(vsh_volume, baked,
             vsh_bake_volume(occluders, voxels != NULL ? voxels : fuzz_made()->voxels, &light, 1, &options,
                             &run, &baked, NULL, fuzz_error()));
    fuzz_free_occluders(occluders);
    vsh_voxels_free(voxels);
    fuzz_take(input, &size, sizeof size);
    FUZZ_MAKE(voxels, vsh_voxels_from_grid(fuzz_made()->grid, size, &run, &voxels, fuzz_error()));
    vsh_voxels_free(voxels);
}

static void render(fuzz_input *input) {
    vsh_render_options options = vsh_render_options_default();
    options.width = options.height = FUZZ_SIDE;
    options.samples = 1;
    fuzz_take(input, &options, sizeof options);
    options.lit = NULL; /* a count without an array is refused */
    vsh_occluders *occluders = fuzz_take_occluders(input);
    const vsh_run run = fuzz_take_run(input);
    const vsh_light light = fuzz_take_light(input);
    vsh_surface surface = {fuzz_made()->field, {0.5, 0.5, 0.5}};
    fuzz_take(input, surface.color, sizeof surface.color);
    static float planes[4][3 * MOST_TEXELS];
    const vsh_picture picture = {planes[0], planes[1], planes[2], planes[3]};
    double bounds[6] = {-1, -1, -1, 1, 1, 1}, angles[3] = {0.5, 0.5, 1.0};
    fuzz_take(input, bounds, sizeof bounds);
    fuzz_take(input, angles, sizeof angles);
    const uint8_t how = fuzz_byte(input);
    const float light_map[4][4] = {{1.0f, 0.5f}, {0.25f}, {0.0f, 1.0f}, {0.75f}};
    const float *const map_planes[] = {light_map[0], light_map[1], light_map[2], light_map[3]};
    static const char *const names[] = {"ao", "irradiance.R", "irradiance.G", "irradiance.B"};
    const vsh_image image = {2, 2, 4, names, map_planes, NULL};
    vsh_lit_meshes lit = {&fuzz_made()->mesh, 1, &image, {0.5, 0.5, 0.5}, 0};
    if (how & 2) {
        fuzz_take(input, &lit, sizeof lit);
        lit.meshes = how & 4 ? &fuzz_made()->mesh : NULL;
        lit.mesh_count = how & 4 ? lit.mesh_count % 2 : lit.mesh_count;
        lit.lightmap = how & 8 ? &image : NULL;
        options.lit = &lit;
        options.lit_count = 1;
    }
    if (how & 1) {
        vsh_camera camera = options.camera;
        const vsh_result framed =
            vsh_camera_frame(&camera, bounds, bounds + 3, angles[0], angles[1], angles[2], fuzz_error());
        fuzz_check_plain(framed);
        if (framed == VSH_OK) {
            fuzz_check_plain(vsh_camera_orbit(&camera, angles[0], fuzz_error()));
            options.camera = camera;
        }
    }
    const int fits = FITS(options);
    const vsh_picture none = {NULL, NULL, NULL, NULL};
    fuzz_check_plain(vsh_render(&surface, 1, occluders, &light, 1, &options, &run, fits ? &picture : &none,
                                NULL, fuzz_error()));
    fuzz_free_occluders(occluders);
    float *const rgb[] = {planes[1], planes[2], planes[3]};
    fuzz_check_plain(vsh_picture_encode(&picture, FUZZ_SIDE, FUZZ_SIDE, angles[2], rgb, NULL, fuzz_error()));
}

static void flat(fuzz_input *input) {
    vsh_flat_options options = vsh_flat_options_default();
    options.width = options.height = FUZZ_SIDE;
    options.region_min[0] = options.region_min[1] = -3;
    options.region_max[0] = options.region_max[1] = 3;
    fuzz_take(input, &options, sizeof options);
    const vsh_run run = fuzz_take_run(input);
    vsh_light lights[2] = {fuzz_take_light(input), fuzz_take_light(input)};
    static float planes[6][MOST_TEXELS];
    float *const shadow[] = {planes[0], planes[1]}, *const irradiance[] = {planes[2], planes[3], planes[4]};
    const int fits = FITS(options);
    const vsh_flat_map map = {fits ? shadow : NULL, fits ? irradiance : NULL, fits ? planes[5] : NULL};
    double points[24] = {-1, -1, 1,  -1, 1,   1,   -1, 1,   -2, -2, 0,   -2,
                         0,  0,  -2, 0,  0.5, 0.5, 2,  0.5, 2,  2,  0.5, 2};
    fuzz_take(input, points, sizeof points);
    const size_t counts[] = {3, 5, 4};
    vsh_outline *outline;
    FUZZ_MAKE(outline, vsh_outline_from_polygons(points, counts, 1 + fuzz_byte(input) % 3, &run, &outline,
                                                 fuzz_error()));
    fuzz_check_plain(vshi_flat_bake(outline, lights, 2, &options, &run, &map, fuzz_error()));
    vsh_outline_free(outline);
    double matrix[6] = {1, 0, 0, 0, 1, 0};
    fuzz_take(input, matrix, sizeof matrix);
    const vshi_outline_instance instances[] = {{fuzz_made()->outline, matrix}, {fuzz_made()->outline, NULL}};
    FUZZ_TRY(vsh_outline, both, vshi_outline_unite(instances, 2, &run, &both, fuzz_error()));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static fuzz_call *const calls[] = {shade, query, lightmap, volume, render, flat};
    fuzz_choose(data, size, calls, sizeof calls / sizeof calls[0]);
    return 0;
}
