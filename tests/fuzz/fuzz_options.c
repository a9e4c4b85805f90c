/* The C API's structs of options and views, of any bytes: a code comes back, and no crash. Pointers are the
 * caller's promise, so they are NULL or lead to arrays that are as long as the struct says; all else is the
 * input's. The first byte chooses the call. */
#include "fuzz.h"

#include <vdbshade/vdbshade.h>

#include <stdlib.h>
#include <string.h>

enum { SIDE = 8, TEXELS = SIDE * SIDE, POINTS = 12, MOST_TEXELS = 1 << 14 };

static struct {
    vsh_mesh mesh;
    vsh_grid *grid;
    vsh_field *field;
    vsh_texels *texels;
    vsh_outline *outline;
    vsh_voxels *voxels;
    vsh_heights *heights;
    vsh_spheres *spheres;
} made;

static const float corners[] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
static const float uvs[] = {0, 0, 1, 0, 1, 1, 0, 1, 0.1f, 0.1f, 0.9f, 0.1f, 0.9f, 0.9f, 0.1f, 0.9f};
static const uint32_t indices[] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                   3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};
static const float heights_values[SIDE * SIDE] = {0.5f, 1.0f, 0.25f};

static void must(vsh_result result) {
    if (result != VSH_OK) {
        abort();
    }
}

/* The handles that calls are given: once for the process. */
static void make(void) {
    made.mesh = (vsh_mesh){"box", corners, NULL, uvs, indices, 8, 12, NULL};
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_grid_options grid = vsh_grid_options_default();
    grid.resolution = 10;
    must(vsh_grid_from_meshes(&made.mesh, 1, &grid, &run, &made.grid, NULL));
    vsh_field_options field = vsh_field_options_default();
    field.reach = 2.0;
    must(vsh_field_create(made.grid, &field, &run, &made.field, NULL));
    vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    lightmap.width = lightmap.height = SIDE;
    must(vsh_texels_create(&made.mesh, 1, &lightmap, &run, NULL, &made.texels, NULL));
    const double square[] = {-1, -1, 1, -1, 1, 1, -1, 1};
    const size_t counts[] = {4};
    must(vsh_outline_from_polygons(square, counts, 1, &run, &made.outline, NULL));
    const double box_min[] = {-1, -1, -1}, box_max[] = {1, 1, 1};
    must(vsh_voxels_from_box(box_min, box_max, 0.5, &run, &made.voxels, NULL));
    const vsh_heights_source source = {
        .columns = SIDE, .rows = SIDE, .values = heights_values, .size = {2, 2}, .height = 0.5};
    must(vsh_heights_create(&source, &run, &made.heights, NULL));
    const double balls[] = {0, 0, 0, 1, 2, 0, 0, 0.5};
    must(vsh_spheres_create(balls, 2, NULL, &run, &made.spheres, NULL));
}

/* --- parts of the input */

/* A struct of options: its own defaults with some bytes changed, or all bytes the input's. */
static void take(fuzz_input *input, void *to, size_t size) {
    const uint8_t how = fuzz_byte(input);
    if (how == 0xff) {
        fuzz_fill(input, to, size);
        return;
    }
    for (int changes = how % 8; changes > 0; --changes) {
        uint16_t place;
        fuzz_fill(input, &place, sizeof place);
        size_t width = (size_t)1 << place % 4; /* 1 to 8 bytes, aligned as members are */
        width = width < size ? width : size;
        const size_t at = place / 4 % (size / width) * width;
        fuzz_fill(input, (char *)to + at, width);
    }
}

static vsh_run take_run(fuzz_input *input) {
    vsh_run run = fuzz_run();
    if (fuzz_byte(input) % 16 == 0) {
        vsh_run wild = run;
        take(input, &wild, sizeof wild);
        wild.progress = run.progress;
        wild.warning = run.warning;
        wild.user = NULL;
        wild.threads =
            wild.threads > 2 && wild.threads <= 1024 ? 2 : wild.threads; /* they take memory and time */
        wild.memory_limit = wild.memory_limit == 0 || wild.memory_limit > run.memory_limit
                                ? run.memory_limit
                                : wild.memory_limit;
        return wild;
    }
    return run;
}

static const vsh_layer *take_layer(fuzz_input *input, vsh_layer *layer) {
    static const char *const lights[] = {"sun", "other"};
    *layer = vsh_layer_default();
    take(input, layer, sizeof *layer);
    const uint8_t which = fuzz_byte(input);
    layer->field = which % 4 == 0 ? made.field : NULL;
    layer->heights = which % 4 == 1 ? made.heights : NULL;
    layer->spheres = which % 4 >= 2 ? made.spheres : NULL;
    layer->triangles = NULL;
    layer->lights = which & 16 ? lights : NULL;
    layer->light_count %= 3;
    return layer;
}

static void take_shade(fuzz_input *input, vsh_shade_options *shade, vsh_layer *layer) {
    take(input, shade, sizeof *shade);
    shade->triangles = NULL;
    const int layers = fuzz_byte(input) % 4 == 0;
    shade->layers = layers ? take_layer(input, layer) : NULL;
    shade->layer_count = layers ? 1 : shade->layer_count;
}

static vsh_light take_light(fuzz_input *input) {
    vsh_light light = vsh_light_default();
    light.angle = 0.2;
    light.radius = 0.1;
    light.position[0] = 3.0;
    take(input, &light, sizeof light);
    return light;
}

static void ended(vsh_result result, const vsh_error *error) {
    fuzz_ended(result, error, result == VSH_OK ? error : NULL);
}

/* --- the calls */

static void grid(fuzz_input *input) {
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 8;
    take(input, &options, sizeof options);
    const vsh_run run = take_run(input);
    double transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    take(input, transform, sizeof transform);
    float positions[24];
    memcpy(positions, corners, sizeof positions);
    take(input, positions, sizeof positions);
    uint32_t corners_of[36];
    memcpy(corners_of, indices, sizeof corners_of);
    take(input, corners_of, sizeof corners_of);
    vsh_mesh mesh = made.mesh;
    mesh.positions = positions;
    mesh.indices = corners_of;
    mesh.transform = fuzz_byte(input) & 1 ? transform : NULL;
    vsh_error error;
    vsh_grid *result;
    FUZZ_MAKE(result, vsh_grid_from_meshes(&mesh, 1, &options, &run, &result, fuzz_error(&error)));
    if (result != NULL) {
        vsh_field_options wide = vsh_field_options_default();
        take(input, &wide, sizeof wide);
        vsh_field *field;
        FUZZ_MAKE(field, vsh_field_create(result, &wide, &run, &field, fuzz_error(&error)));
        vsh_field_free(field);
    }
    vsh_grid_free(result);
}

static void unite(fuzz_input *input) {
    vsh_grid_options options = vsh_grid_options_default();
    take(input, &options, sizeof options);
    const vsh_run run = take_run(input);
    double transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    take(input, transform, sizeof transform);
    const vsh_grid_instance instances[] = {{made.grid, NULL}, {made.grid, transform}};
    vsh_error error;
    vsh_grid *result;
    FUZZ_MAKE(result, vsh_grid_unite(instances, 2, &options, &run, &result, fuzz_error(&error)));
    vsh_grid_free(result);
    FUZZ_MAKE(result, vsh_grid_from_outline(made.outline, transform[3], transform, &options, &run, &result,
                                            fuzz_error(&error)));
    vsh_grid_free(result);
}

static void sdf(fuzz_input *input) {
    vsh_sdf_node nodes[6];
    const size_t count = fuzz_byte(input) % 7;
    for (size_t i = 0; i < count; ++i) {
        nodes[i] = vsh_sdf_node_default();
        nodes[i].shape = fuzz_byte(input) % 12;
        nodes[i].left = (int32_t)i - 2;
        nodes[i].right = (int32_t)i - 1;
        take(input, &nodes[i], sizeof nodes[i]);
    }
    const vsh_sdf tree = {nodes, count};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 8;
    take(input, &options, sizeof options);
    const vsh_run run = take_run(input);
    vsh_error error;
    vsh_grid *result;
    FUZZ_MAKE(result, vsh_grid_from_sdf(&tree, &options, &run, &result, fuzz_error(&error)));
    vsh_grid_free(result);
    vsh_solids *solids;
    double transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    take(input, transform, sizeof transform);
    FUZZ_MAKE(solids, vsh_solids_create(&tree, transform, 1, &solids, fuzz_error(&error)));
    if (solids != NULL) {
        double position[3] = {1, 1, 1}, lift = 0.01;
        float normal[3] = {0, 1, 0}, value;
        take(input, position, sizeof position);
        take(input, normal, sizeof normal);
        take(input, &lift, sizeof lift);
        const vsh_light light = take_light(input);
        int32_t rays = 4;
        take(input, &rays, sizeof rays);
        ended(vsh_trace_shadow(NULL, solids, 1, position, normal, lift, &light, rays, &run, &value,
                               fuzz_error(&error)),
              &error);
        vsh_solids_distance(solids, position);
    }
    vsh_solids_free(solids);
}

static void shade(fuzz_input *input) {
    vsh_shade_options options = vsh_shade_options_default();
    vsh_layer layer;
    options.rays = 4;
    take_shade(input, &options, &layer);
    const vsh_run run = take_run(input);
    const vsh_light light = take_light(input);
    double positions[3 * POINTS];
    float normals[3 * POINTS], values[3 * POINTS], deviation[POINTS], ao[POINTS];
    uint32_t texels[POINTS] = {0};
    for (int i = 0; i < 3 * POINTS; ++i) {
        positions[i] = 0.1 * i - 1.5;
        normals[i] = (float)(i % 3 == 1);
    }
    take(input, positions, sizeof positions);
    take(input, normals, sizeof normals);
    take(input, texels, sizeof texels);
    const uint8_t how = fuzz_byte(input);
    const vsh_points points = {POINTS, positions, how & 1 ? normals : NULL, how & 2 ? texels : NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    take(input, &stats, sizeof stats.struct_size);
    vsh_error error;
    ended(vsh_shade_shadow(made.field, &points, &light, &options, &run, values, how & 4 ? deviation : NULL,
                           &stats, fuzz_error(&error)),
          &error);
    ended(vsh_shade_ao(made.field, &points, &options, &run, values, how & 4 ? deviation : NULL, &stats,
                       fuzz_error(&error)),
          &error);
    ended(vsh_shade_bent(made.field, &points, &options, &run, ao, values, &stats, fuzz_error(&error)),
          &error);
}

static void query(fuzz_input *input) {
    vsh_shade_options options = vsh_shade_options_default();
    vsh_layer layer;
    take_shade(input, &options, &layer);
    const vsh_run run = take_run(input);
    const vsh_light light = take_light(input);
    vsh_query *made_query;
    vsh_error error;
    FUZZ_MAKE(made_query, vsh_query_create(made.field, &light, 1, &options, &made_query, fuzz_error(&error)));
    if (made_query == NULL) {
        return;
    }
    /* strides as long as they can be wished, within these */
    enum { ROOM = 1 << 12, MOST_STRIDE = 256 };
    static double positions[ROOM];
    static float normals[ROOM], visibility[ROOM], ao[ROOM], distance[ROOM], gradient[ROOM];
    vsh_strided_points points = vsh_strided_points_default();
    points.count = POINTS;
    take(input, &points, sizeof points);
    vsh_query_output output = vsh_query_output_default();
    take(input, &output, sizeof output);
    points.count %= POINTS + 1;
    if (points.position_stride > MOST_STRIDE || points.normal_stride > MOST_STRIDE ||
        points.texel_stride > MOST_STRIDE || output.stride > MOST_STRIDE) {
        vsh_query_free(made_query);
        return;
    }
    const uint8_t how = fuzz_byte(input);
    points.positions = how & 1 ? positions : NULL;
    points.float_positions = how & 2 ? normals : NULL;
    points.normals = how & 4 ? normals : NULL;
    points.texels = how & 8 ? (const uint32_t *)indices : NULL;
    points.texel_stride = 4;
    float *const planes[] = {visibility};
    output.visibility = how & 16 ? planes : NULL;
    output.deviation = NULL;
    output.ao = how & 32 ? ao : NULL;
    output.ao_deviation = NULL;
    output.distance = how & 64 ? distance : NULL;
    output.gradient = how & 128 ? gradient : NULL;
    fuzz_fill(input, positions, 3 * POINTS * sizeof *positions);
    fuzz_fill(input, normals, 3 * POINTS * sizeof *normals);
    ended(vsh_query_strided(made_query, &points, &run, &output, NULL, fuzz_error(&error)), &error);
    vsh_query_free(made_query);
}

static void lightmap(fuzz_input *input) {
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIDE;
    take(input, &options, sizeof options);
    const vsh_run run = take_run(input);
    vsh_layer layer;
    options.shade.layers = NULL;
    options.shade.layer_count = 0;
    options.shade.triangles = NULL;
    float places[16];
    memcpy(places, uvs, sizeof places);
    take(input, places, sizeof places);
    vsh_mesh mesh = made.mesh;
    mesh.uvs = places;
    mesh.normals = fuzz_byte(input) & 1 ? corners : NULL;
    vsh_error error;
    vsh_texels *texels;
    FUZZ_MAKE(texels, vsh_texels_create(&mesh, 1, &options, &run, NULL, &texels, fuzz_error(&error)));
    vsh_charts *charts;
    FUZZ_MAKE(charts, vsh_charts_create(&mesh, 1, &options, &run, NULL, &charts, fuzz_error(&error)));
    if (charts != NULL) {
        int32_t rows[2] = {0, 8};
        take(input, rows, sizeof rows);
        vsh_texels *band;
        FUZZ_MAKE(band, vsh_texels_create_band(charts, rows[0], rows[1], &run, &band, fuzz_error(&error)));
        vsh_texels_free(band);
        vsh_charts_band_bytes(charts, rows[0], rows[1], 4, 1, 1, 1, 1);
    }
    vsh_charts_free(charts);
    if (texels != NULL && (int64_t)options.width * options.height <= MOST_TEXELS) {
        static float planes[6][3 * MOST_TEXELS];
        vsh_shade_options shading = vsh_shade_options_default();
        shading.ao_cones = 4;
        take_shade(input, &shading, &layer);
        const vsh_light light = take_light(input);
        double ambient[3] = {0.1, 0.2, 0.3};
        take(input, ambient, sizeof ambient);
        float *const shadow[] = {planes[0]}, *const tint[] = {planes[1]};
        vsh_lightmap map = {0};
        take(input, &map, sizeof map);
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
        ended(
            vsh_bake_lightmap(made.field, texels, &light, 1, &shading, &run, &map, NULL, fuzz_error(&error)),
            &error);
    }
    vsh_texels_free(texels);
}

static void volume(fuzz_input *input) {
    vsh_volume_options options = vsh_volume_options_default();
    options.shade.ao_cones = 4;
    take(input, &options, sizeof options);
    vsh_layer layer;
    options.shade.triangles = NULL;
    options.shade.layers = fuzz_byte(input) & 1 ? take_layer(input, &layer) : NULL;
    options.shade.layer_count = options.shade.layers != NULL;
    const vsh_run run = take_run(input);
    const vsh_light light = take_light(input);
    vsh_error error;
    double box[6] = {-1, -1, -1, 1, 1, 1}, size = 0.5;
    take(input, box, sizeof box);
    take(input, &size, sizeof size);
    vsh_voxels *voxels;
    FUZZ_MAKE(voxels, vsh_voxels_from_box(box, box + 3, size, &run, &voxels, fuzz_error(&error)));
    vsh_volume *baked;
    FUZZ_MAKE(baked, vsh_bake_volume(made.field, voxels != NULL ? voxels : made.voxels, &light, 1, &options,
                                     &run, &baked, NULL, fuzz_error(&error)));
    vsh_volume_free(baked);
    vsh_voxels_free(voxels);
    take(input, &size, sizeof size);
    FUZZ_MAKE(voxels, vsh_voxels_from_grid(made.grid, size, &run, &voxels, fuzz_error(&error)));
    vsh_voxels_free(voxels);
}

static void render(fuzz_input *input) {
    vsh_render_options options = vsh_render_options_default();
    options.width = options.height = SIDE;
    options.samples = 1;
    take(input, &options, sizeof options);
    options.lit = NULL;
    options.lit_count = 0;
    options.shade.layers = NULL;
    options.shade.layer_count = 0;
    options.shade.triangles = NULL;
    const vsh_run run = take_run(input);
    const vsh_light light = take_light(input);
    vsh_surface surface = {made.field, {0.5, 0.5, 0.5}};
    take(input, surface.color, sizeof surface.color);
    static float planes[4][3 * MOST_TEXELS];
    const vsh_picture picture = {planes[0], planes[1], planes[2], planes[3]};
    vsh_error error;
    double bounds[6] = {-1, -1, -1, 1, 1, 1}, angles[3] = {0.5, 0.5, 1.0};
    take(input, bounds, sizeof bounds);
    take(input, angles, sizeof angles);
    if (fuzz_byte(input) & 1) {
        vsh_camera camera = options.camera;
        ended(vsh_camera_frame(&camera, bounds, bounds + 3, angles[0], angles[1], angles[2],
                               fuzz_error(&error)),
              &error);
        if (error.code == -1) {
            vsh_camera_orbit(&camera, angles[0]);
            options.camera = camera;
        }
    }
    const int fits = (int64_t)options.width * options.height <= MOST_TEXELS;
    const vsh_picture none = {NULL, NULL, NULL, NULL};
    ended(vsh_render(&surface, 1, made.field, &light, 1, &options, &run, fits ? &picture : &none, NULL,
                     fuzz_error(&error)),
          &error);
    float *const rgb[] = {planes[1], planes[2], planes[3]};
    ended(vsh_picture_encode(&picture, SIDE, SIDE, angles[2], rgb, NULL, fuzz_error(&error)), &error);
}

static void flat(fuzz_input *input) {
    vsh_flat_options options = vsh_flat_options_default();
    options.width = options.height = SIDE;
    options.region_min[0] = options.region_min[1] = -3;
    options.region_max[0] = options.region_max[1] = 3;
    take(input, &options, sizeof options);
    const vsh_run run = take_run(input);
    vsh_light lights[2] = {take_light(input), take_light(input)};
    static float planes[6][MOST_TEXELS];
    float *const shadow[] = {planes[0], planes[1]}, *const irradiance[] = {planes[2], planes[3], planes[4]};
    const int fits = (int64_t)options.width * options.height <= MOST_TEXELS;
    const vsh_flat_map map = {fits ? shadow : NULL, fits ? irradiance : NULL, fits ? planes[5] : NULL};
    vsh_error error;
    double points[24] = {-1, -1, 1,  -1, 1,   1,   -1, 1,   -2, -2, 0,   -2,
                         0,  0,  -2, 0,  0.5, 0.5, 2,  0.5, 2,  2,  0.5, 2};
    take(input, points, sizeof points);
    const size_t counts[] = {3, 5, 4};
    vsh_outline *outline;
    FUZZ_MAKE(outline, vsh_outline_from_polygons(points, counts, 1 + fuzz_byte(input) % 3, &run, &outline,
                                                 fuzz_error(&error)));
    ended(vsh_flat_bake(outline, lights, 2, &options, &run, &map, fuzz_error(&error)), &error);
    vsh_outline_free(outline);
    double matrix[6] = {1, 0, 0, 0, 1, 0};
    take(input, matrix, sizeof matrix);
    const vsh_outline_instance instances[] = {{made.outline, matrix}, {made.outline, NULL}};
    FUZZ_MAKE(outline, vsh_outline_unite(instances, 2, &run, &outline, fuzz_error(&error)));
    vsh_outline_free(outline);
}

static void heights(fuzz_input *input) {
    vsh_heights_source source = {.columns = SIDE, .rows = SIDE, .size = {2, 2}, .height = 0.5};
    take(input, &source, sizeof source);
    float values[SIDE * SIDE];
    memcpy(values, heights_values, sizeof values);
    take(input, values, sizeof values);
    double transform[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    take(input, transform, sizeof transform);
    const vsh_run run = take_run(input);
    source.name = "heights";
    source.values = values;
    source.transform = transform;
    if (source.columns > SIDE || source.rows > SIDE) {
        source.columns = SIDE; /* the array's length is the caller's promise */
        source.rows = SIDE;
    }
    vsh_error error;
    vsh_heights *result;
    FUZZ_MAKE(result, vsh_heights_create(&source, &run, &result, fuzz_error(&error)));
    vsh_heights_free(result);
    int32_t what = 0;
    take(input, &what, sizeof what);
    vsh_model *model;
    FUZZ_MAKE(model, vsh_model_from_heights(&source, what, &run, &model, fuzz_error(&error)));
    vsh_model_free(model);
    double balls[8] = {0, 0, 0, 1, 2, 0, 0, 1};
    take(input, balls, sizeof balls);
    vsh_spheres *spheres;
    FUZZ_MAKE(spheres, vsh_spheres_create(balls, 2, transform, &run, &spheres, fuzz_error(&error)));
    vsh_spheres_free(spheres);
}

static void image(fuzz_input *input) {
    static const char *const names[] = {"x.exr", "x.png", "x.tif", "x.jpg", "x.tga", "x.xyz", ""};
    const char *name = names[fuzz_byte(input) % (sizeof names / sizeof names[0])];
    float pixels[4][16];
    memset(pixels, 0, sizeof pixels);
    take(input, pixels, sizeof pixels);
    static char texts[4][VSH_CHANNEL_NAME + 8];
    const char *const channels[] = {texts[0], texts[1], texts[2], texts[3]};
    const float *const planes[] = {pixels[0], pixels[1], pixels[2], pixels[3]};
    for (int i = 0; i < 4; ++i) {
        memset(texts[i], 0, sizeof texts[i]);
        texts[i][0] = (char)('A' + i);
        take(input, texts[i], sizeof texts[i] - 1);
    }
    vsh_image what = {4, 4, 4, channels, planes};
    int32_t numbers[3] = {4, 4, 4};
    take(input, numbers, sizeof numbers);
    vsh_image_options options = vsh_image_options_default();
    take(input, &options, sizeof options);
    char pack[32] = "R=A,G=B,B=0,A=1";
    take(input, pack, sizeof pack - 1);
    options.pack = fuzz_byte(input) & 1 ? pack : NULL;
    what.width = numbers[0];
    what.height = numbers[1];
    what.channel_count = numbers[2] <= 4 || numbers[2] > VSH_MAX_CHANNELS ? numbers[2] : 4;
    char path[512] = "";
    if (name[0] != '\0') {
        strcpy(path, fuzz_file(name, "", 0));
    }
    vsh_error error;
    ended(vsh_image_check(path, &what, &options, fuzz_error(&error)), &error);
    vsh_image_writer_bytes(path, &what, &options);
    const int64_t pixels_in = (int64_t)what.width * what.height;
    if (what.width <= 16 && pixels_in <= 16) {
        ended(vsh_image_write(path, &what, &options, fuzz_error(&error)), &error);
    }
}

static void mask(fuzz_input *input) {
    static char path[512];
    if (path[0] == '\0') {
        const float pixels[16] = {0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0.6f, 0};
        const float *const plane = pixels;
        static const char *const name = "Y";
        const vsh_image picture = {4, 4, 1, &name, &plane};
        strcpy(path, fuzz_file("mask.exr", "", 0));
        must(vsh_image_write(path, &picture, NULL, NULL));
    }
    vsh_mask_options options = vsh_mask_options_default();
    take(input, &options, sizeof options);
    char channel[16] = "Y";
    take(input, channel, sizeof channel - 1);
    options.channel = fuzz_byte(input) & 1 ? channel : NULL;
    const vsh_run run = take_run(input);
    vsh_error error;
    vsh_outline *outline;
    FUZZ_MAKE(outline, vsh_outline_from_image(path, &options, &run, &outline, fuzz_error(&error)));
    vsh_outline_free(outline);
    vsh_text_options letters = vsh_text_options_default();
    take(input, &letters, sizeof letters);
    char text[24] = "text";
    take(input, text, sizeof text - 1);
    FUZZ_MAKE(outline, vsh_outline_from_text(text, path, &letters, &run, &outline, fuzz_error(&error)));
    vsh_outline_free(outline);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static void (*const calls[])(fuzz_input *) = {grid,   unite,  sdf,  shade,   query, lightmap,
                                                  volume, render, flat, heights, image, mask};
    if (made.grid == NULL) {
        make();
    }
    fuzz_input input = {data, size};
    const uint8_t call = fuzz_byte(&input);
    calls[call % (sizeof calls / sizeof calls[0])](&input);
    return 0;
}
