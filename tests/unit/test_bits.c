/* Compares hashes of the results of every part with a table of hashes. They hold for any number of threads,
 * instruction set, compiler (gcc, clang) and level of optimisation; `tools/bits` tries those. Parts that
 * depend on libraries have hashes of their own: level sets of meshes on OpenVDB, traced values on Embree
 * (docs/security.md). A change of a method changes its hash: VSH_BITS=print prints the table, VSH_BITS=once
 * checks it for one thread and the base set. */
#include "base/bytes.h"
#include "base/floats.h"
#include "base/job.h"
#include "casts.h"
#include "field/field.h"
#include "grids.h"
#include "traced.h"

/* --- hashing */

typedef struct bits {
    uint64_t hash;
    size_t values;  /* floats that were hashed */
    size_t changes; /* floats that differ from the one before */
} bits;

static void add_floats(bits *b, const float *values, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        uint32_t word;
        memcpy(&word, &values[i], sizeof word);
        b->hash = vshi_mix(b->hash + word + 0x9e3779b97f4a7c15u);
        b->changes += i > 0 && values[i] != values[i - 1];
    }
    b->values += count;
}

/* --- the baked scene */

enum { SIDE = 40, POINTS = SIDE * SIDE };

static double positions[3 * POINTS];
static float normals[3 * POINTS];
static uint32_t texels[POINTS];

static double random_unit(uint64_t *counter) {
    return (double)(vshi_mix(++*counter * 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53;
}

enum { COLUMNS = 33, BALLS = 60 };

static float hill_values[COLUMNS * COLUMNS];
static double balls[4 * BALLS];

/* Points: rows over the floor, every third one anywhere with a normal to any side. Made once, as a test
 * computes in the host's floating-point setting. */
static void make_inputs(void) {
    uint64_t counter = 1;
    for (size_t i = 0; i < POINTS; ++i) {
        double *p = positions + 3 * i;
        float *n = normals + 3 * i;
        p[0] = -2.0 + 4.0 * ((double)(i % SIDE) + 0.5) / SIDE;
        p[1] = 0.001;
        p[2] = -2.0 + 4.0 * ((double)(i / SIDE) + 0.5) / SIDE;
        n[1] = 1.0f;
        texels[i] = (uint32_t)(i % SIDE + 65536 * (i / SIDE));
        for (int axis = 0; axis < 3 && i % 3 == 0; ++axis) {
            p[axis] = -2.0 + 4.0 * random_unit(&counter) + (axis == 1);
            n[axis] = (float)(random_unit(&counter) - 0.4);
        }
    }
    counter = 7;
    for (size_t i = 0; i < COUNT_OF(hill_values); ++i) {
        hill_values[i] = (float)random_unit(&counter);
    }
    counter = 9;
    for (size_t i = 0; i < COUNT_OF(balls); ++i) {
        balls[i] = i % 4 == 3 ? 0.05 + 0.2 * random_unit(&counter) : -2.0 + 4.0 * random_unit(&counter);
    }
}

static vsh_grid *solids(const vsh_run *run) {
    vsh_sdf_node nodes[5] = {box_node(2.5, 0.25, 2.5), vsh_sdf_node_default(),
                             operation_node(VSH_SDF_UNION, 0, 1), vsh_sdf_node_default(),
                             operation_node(VSH_SDF_UNION, 2, 3)};
    nodes[0].shape = VSH_SDF_PLANE;
    nodes[1].radius = 0.5;
    nodes[1].translation[1] = 0.875;
    nodes[3].shape = VSH_SDF_TORUS;
    nodes[3].radius = 0.5;
    nodes[3].minor_radius = 0.125;
    nodes[3].rotation[0] = 0.25;
    nodes[3].translation[0] = 1.0;
    nodes[3].translation[1] = 0.75;
    const vsh_sdf sdf = {nodes, 5};
    const vsh_grid_options options = with_voxel(0.0625);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_sdf(&sdf, &options, run, &grid, &failure));
    return grid;
}

static vsh_light usual_sun(void) {
    return sun((const double[3]){0.5, 1.0, 0.25}, 0.25);
}

static vsh_light spot(void) {
    vsh_light light = lamp((const double[3]){0.75, 2.5, -0.5}, 0.25);
    light.type = VSH_LIGHT_SPOT;
    light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
    light.axis[1] = -1.0;
    strcpy(light.name, "spot");
    return light;
}

static void add_leaves(bits *b, const vsh_grid *grid) {
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    for (size_t i = 0; i < all.count; ++i) {
        add_floats(b, all.leaf[i].values, 512);
    }
}

/* --- the parts */

typedef struct context {
    vsh_run run;
    vsh_grid *grid; /* of the solids */
    vsh_field *field;
    const vshi_triangles *triangles; /* these two: NULL where there are none */
    const vshi_layer *layer;
} context;

static void level_set_of_solids(const context *c, int32_t unused, bits *b) {
    add_leaves(b, c->grid);
}

static void field_samples(const context *c, int32_t unused, bits *b) {
    float distance[POINTS];
    vsh_field_sample(c->field, POINTS, positions, distance);
    const vshi_floats host = vshi_floats_get();
    vshi_floats_set(VSHI_FLOATS_DEFAULT);
    for (size_t i = 0; i < POINTS; ++i) {
        distance[i] = 0.5f + 0.1f * distance[i];
    }
    vshi_floats_set(host);
    add_floats(b, distance, POINTS);
}

/* Shades and hashes the points. Returns the number of rays. */
static uint64_t shade_by(const context *c, const vsh_light *light, const vsh_shade_options *options,
                         bits *b) {
    float value[POINTS], deviation[POINTS];
    const vsh_points points = {POINTS, positions, normals, texels};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    const vsh_occluders casters = {
        .field = c->field, .triangles = c->triangles, .layers = c->layer, .layer_count = c->layer != NULL};
    assert_ok(
        light != NULL
            ? vsh_shade_shadow(&casters, &points, light, options, &c->run, value, deviation, &stats, &failure)
            : vsh_shade_ao(&casters, &points, options, &c->run, value, deviation, NULL, &stats, &failure));
    add_floats(b, value, POINTS);
    for (size_t i = 0; i < POINTS; ++i) { /* NaN has many bits */
        deviation[i] = deviation[i] == deviation[i] ? deviation[i] : -1.0f;
    }
    add_floats(b, deviation, POINTS);
    return stats.rays;
}

static void shade(const context *c, const vsh_light *light, vsh_shade_options *options, bits *b) {
    options->rays = 16;
    options->ao_distance = 0.75;
    shade_by(c, light, options, b);
}

static void shadow(const context *c, int32_t method, bits *b) {
    vsh_shade_options options = preview_options();
    options.method = method;
    const vsh_light lights[] = {usual_sun(), spot()};
    for (int i = 0; i < 2; ++i) {
        shade(c, &lights[i], &options, b);
    }
}

static void rectangle(const context *c, int32_t method, bits *b) {
    vsh_shade_options options = preview_options();
    options.method = method;
    vsh_light light = spot();
    light.type = VSH_LIGHT_RECTANGLE;
    memcpy(light.edge_u, (const double[]){0.75, 0.0, 0.25}, sizeof light.edge_u);
    memcpy(light.edge_v, (const double[]){-0.125, 0.25, 0.375}, sizeof light.edge_v);
    light.two_sided = 1;
    shade(c, &light, &options, b);
}

static void ao(const context *c, int32_t method, bits *b) {
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    shade(c, NULL, &options, b);
}

/* With fewer rays than the error takes, adaptive is `rays`; here it stops by itself, at some points later
 * than at others. */
static void ao_until_max_error(const context *c, int32_t method, bits *b) {
    enum { MOST = 256 };
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    options.ao_distance = 0.75;
    options.rays = MOST;
    options.max_error = 0.06;
    const uint64_t rays = shade_by(c, NULL, &options, b);
    assert_true(rays > POINTS && rays < POINTS * MOST / 4);
}

static void samplers(const context *c, int32_t sampler, bits *b) {
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_RAYS;
    options.sampler = sampler;
    options.frame = 3;
    const vsh_light light = usual_sun();
    shade(c, &light, &options, b);
}

static void bent_normals(const context *c, int32_t method, bits *b) {
    float value[POINTS], bent[3 * POINTS];
    const vsh_points points = {POINTS, positions, normals, texels};
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    options.rays = 16;
    assert_ok(
        vsh_shade_ao(occluders_of(c->field), &points, &options, &c->run, value, NULL, bent, NULL, &failure));
    add_floats(b, value, POINTS);
    add_floats(b, bent, COUNT_OF(bent));
}

static void irradiance_and_tint(const context *c, int32_t unused, bits *b) {
    float value[POINTS], rgb[3 * POINTS] = {0.0f}, tinted[3 * POINTS];
    const vsh_points points = {POINTS, positions, normals, texels};
    const vsh_light light = spot();
    const vsh_tint tint = {VSH_TINT_POWER, {1.0, 1.25, 1.5}};
    const vsh_shade_options options = preview_options();
    assert_ok(vsh_shade_shadow(occluders_of(c->field), &points, &light, &options, &c->run, value, NULL, NULL,
                               &failure));
    vsh_shade_irradiance(&points, NULL, &light, value, rgb);
    vshi_shade_tint(POINTS, value, &tint, tinted);
    add_floats(b, rgb, COUNT_OF(rgb));
    add_floats(b, tinted, COUNT_OF(tinted));
}

static void lightmap(const context *c, int32_t method, bits *b) {
    static const float corners[12] = {-2, 0, 2, 2, 0, 2, 2, 0, -2, -2, 0, -2};
    static const float uvs[8] = {0.125f, 0.125f, 0.875f, 0.125f, 0.875f, 0.875f, 0.125f, 0.875f};
    const vsh_mesh floor = quad_mesh(NULL, corners, uvs);
    enum { SIZE = 64, TEXELS = SIZE * SIZE };
    static float shadow_plane[TEXELS], ao_plane[TEXELS], rgb[3 * TEXELS], coverage[TEXELS];
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.shade.method = method;
    options.shade.ao_method = VSH_AO_CONES;
    options.shade.ao_distance = 0.75;
    float *planes[1] = {shadow_plane};
    vsh_lightmap map = {.shadow = planes, .ao = ao_plane, .irradiance = rgb, .coverage = coverage};
    OWNED(vsh_charts) *made = NULL;
    const vsh_light light = usual_sun();
    assert_ok(vsh_charts_create(&floor, 1, &options, &c->run, NULL, &made, &failure));
    assert_ok(vsh_bake_lightmap(occluders_of(c->field), made, &light, 1, &options.shade, &c->run, &map, NULL,
                                &failure));
    add_floats(b, shadow_plane, TEXELS);
    add_floats(b, ao_plane, TEXELS);
    add_floats(b, rgb, 3 * TEXELS);
    add_floats(b, coverage, TEXELS);
}

/* Noise on a square in two charts, one of them turned, in an image of 48 × 48. */
static void seams(const context *c, int32_t unused, bits *b) {
    const vsh_run *run = &c->run;
    static const float corners[24] = {0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 2, 0, 1, 0, 0, 2, 0, 0, 2, 2, 0, 1, 2, 0};
    static const float uvs[16] = {0.05f, 0.07f, 0.37f, 0.07f, 0.37f, 0.81f, 0.05f, 0.81f,
                                  0.50f, 0.20f, 0.67f, 0.06f, 0.96f, 0.63f, 0.79f, 0.77f};
    static const uint32_t indices[12] = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
    const vsh_mesh mesh = mesh_of_arrays(NULL, corners, uvs, 8, indices, 4);
    enum { STITCHED = 48, STITCHED_TEXELS = STITCHED * STITCHED };
    static float open[STITCHED_TEXELS], light[3 * STITCHED_TEXELS];
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = STITCHED;
    uint32_t random = 1;
    for (size_t i = 0; i < 3 * STITCHED_TEXELS; ++i) {
        light[i] = (float)next_random(&random);
        open[i / 3] = light[i];
    }
    const vsh_lightmap map = {.ao = open, .irradiance = light};
    OWNED(vsh_charts) *charts = NULL;
    assert_ok(vsh_charts_create(&mesh, 1, &options, run, NULL, &charts, &failure));
    assert_ok(stitch_one(charts, &map, 0, NULL, run, NULL, &failure));
    add_floats(b, open, STITCHED_TEXELS);
    add_floats(b, light, 3 * STITCHED_TEXELS);
}

static void volume_of_band(const context *c, int32_t unused, bits *b) {
    OWNED(vsh_voxels) *voxels = NULL;
    OWNED(vsh_volume) *volume = NULL;
    vsh_volume_options options = preview_volume_options();
    options.ao = 1;
    options.shade.ao_distance = 0.75;
    const vsh_light light = usual_sun();
    assert_ok(vsh_voxels_from_grid(c->grid, 0.0, &c->run, &voxels, &failure));
    assert_ok(vsh_bake_volume(occluders_of(c->field), voxels, &light, 1, &options, &c->run, &volume, NULL,
                              &failure));
    FREED float *values = malloc(48 * 48 * 48 * sizeof *values);
    assert_non_null(values);
    const int32_t low[3] = {-24, -8, -24}, size[3] = {48, 48, 48};
    for (size_t grid = 0; grid < 2; ++grid) {
        assert_ok(vsh_volume_copy(volume, grid, low, size, values, &failure));
        for (size_t row = 0; row < 48 * 48; ++row) { /* along z, in the order that the hashes were made in */
            float along[48];
            for (size_t z = 0; z < 48; ++z) {
                along[z] = values[(z * 48 + row % 48) * 48 + row / 48];
            }
            add_floats(b, along, 48);
        }
    }
}

/* Casters without voxels, as the one layer beside an empty field. */
static void shade_layer(const context *c, const vshi_heights *heights, const vshi_spheres *spheres, bits *b) {
    OWNED(vsh_field) *empty = NULL;
    assert_ok(vshi_field_create_empty(0.0625, &empty, &failure));
    vshi_layer layer = vshi_layer_default();
    layer.heights = heights;
    layer.spheres = spheres;
    layer.method = VSH_SHADOW_CLASSIC;
    vsh_shade_options options = preview_options();
    const context here = {c->run, NULL, empty, NULL, &layer};
    const vsh_light lights[] = {usual_sun(), spot()};
    for (int i = 0; i < 2; ++i) {
        shade(&here, &lights[i], &options, b);
    }
    shade(&here, NULL, &options, b);
}

static vsh_heights_source hills(void) {
    return (vsh_heights_source){
        .columns = COLUMNS, .rows = COLUMNS, .values = hill_values, .size = {5.0, 5.0}, .height = 0.75};
}

static void heightfield(const context *c, int32_t unused, bits *b) {
    const vsh_heights_source source = hills();
    OWNED(vshi_heights) *heights = NULL;
    assert_ok(vshi_heights_create(&source, &c->run, &heights, &failure));
    shade_layer(c, heights, NULL, b);
}

static void spheres(const context *c, int32_t unused, bits *b) {
    OWNED(vshi_spheres) *made = NULL;
    assert_ok(vshi_spheres_create(balls, BALLS, NULL, &c->run, &made, &failure));
    shade_layer(c, NULL, made, b);
}

static void flat_map(const context *c, int32_t unused, bits *b) {
    enum { SIZE = 64, TEXELS = SIZE * SIZE };
    static const double points[] = {-0.5, -0.5, 0.25, -0.5, 0.25, 0.25, 0.5, 0.5, 0.75, 0.5, 0.625, 0.875};
    static const size_t counts[] = {3, 3};
    static float planes[5][TEXELS];
    OWNED(vsh_outline) *outline = NULL;
    assert_ok(vsh_outline_from_polygons(points, counts, 2, &c->run, &outline, &failure));
    vsh_flat_options options = vsh_flat_options_default();
    options.width = options.height = SIZE;
    vsh_light light = spot();
    light.type = VSH_LIGHT_SPHERE;
    light.position[0] = -0.75;
    light.position[1] = 0.75;
    float *const shadows[] = {planes[0]}, *const rgb[] = {planes[1], planes[2], planes[3]};
    const vsh_flat_map map = {shadows, rgb, planes[4]};
    assert_ok(vshi_flat_bake(outline, &light, 1, &options, &c->run, &map, &failure));
    add_floats(b, planes[0], 5 * TEXELS);
}

static void picture(const context *c, int32_t unused, bits *b) {
    enum { WIDE = 48, HIGH = 32, PIXELS = WIDE * HIGH };
    static float color[3 * PIXELS], alpha[PIXELS], depth[PIXELS], normal[3 * PIXELS], encoded[3][PIXELS];
    const vsh_picture made = {color, alpha, depth, normal};
    const vsh_surface surface = {.field = c->field, .color = {0.7, 0.7, 0.7}};
    vsh_render_options options = preview_render_options();
    options.width = WIDE;
    options.height = HIGH;
    options.samples = 2;
    options.shafts = 0.05;
    options.ao = 1;
    const double low[3] = {-2.0, 0.0, -2.0}, high[3] = {2.0, 1.5, 2.0};
    const vsh_light light = spot();
    assert_ok(vsh_camera_frame(&options.camera, low, high, 0.5, 0.5, 1.5, &failure));
    assert_ok(
        vsh_render(&surface, 1, occluders_of(c->field), &light, 1, &options, &c->run, &made, NULL, &failure));
    float *const planes[3] = {encoded[0], encoded[1], encoded[2]};
    assert_ok(vsh_picture_encode(&made, WIDE, HIGH, 0.5, planes, NULL, &failure));
    add_floats(b, color, 3 * PIXELS);
    add_floats(b, normal, 3 * PIXELS);
    add_floats(b, encoded[0], 3 * PIXELS);
}

/* --- parts that depend on libraries */

enum { MOST_MESHES = 64 };

static vsh_model *cloister(const vsh_run *run, vsh_mesh meshes[MOST_MESHES], size_t *count) {
    vsh_model *model = NULL;
    assert_ok(vsh_model_read(VSH_ASSETS "/cloister.glb", run, &model, &failure));
    *count = vsh_model_mesh_count(model);
    assert_in_range(*count, 1, MOST_MESHES);
    for (size_t i = 0; i < *count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    return model;
}

static void level_set_of_a_mesh(const context *c, int32_t unused, bits *b) {
    vsh_mesh meshes[MOST_MESHES];
    size_t count;
    OWNED(vsh_model) *model = cloister(&c->run, meshes, &count);
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 96;
    OWNED(vsh_grid) *grid = NULL;
    assert_ok(vsh_grid_from_meshes(meshes, count, &options, &c->run, &grid, &failure));
    add_leaves(b, grid);
}

/* Charts of the asset. They depend on no library, except for reading the file. */
static void atlas_of_a_mesh(const context *c, int32_t unused, bits *b) {
    vsh_mesh meshes[MOST_MESHES];
    size_t count;
    OWNED(vsh_model) *model = cloister(&c->run, meshes, &count);
    vsh_unwrap_options options = vsh_unwrap_options_default();
    options.width = options.height = 512;
    options.padding = 2;
    OWNED(vsh_atlas) *atlas = NULL;
    assert_ok(vsh_unwrap(meshes, count, &options, &c->run, &atlas, &failure));
    for (size_t i = 0; i < count; ++i) {
        const vsh_atlas_mesh mesh = vsh_atlas_mesh_view(atlas, i);
        add_floats(b, mesh.uvs, 2 * mesh.vertex_count);
    }
}

/* Holes of a repeated picture all over a mesh, seen from above; *uvs is to be freed. */
static void cut_out(vsh_mesh *mesh, vsh_alpha_mask *mask, float **uvs) {
    static uint8_t alpha[7 * 5];
    for (size_t i = 0; i < sizeof alpha; ++i) {
        alpha[i] = (uint8_t)(i * i * 37);
    }
    *uvs = malloc(2 * mesh->vertex_count * sizeof **uvs);
    assert_non_null(*uvs);
    const vshi_floats host = vshi_floats_get();
    vshi_floats_set(VSHI_FLOATS_DEFAULT);
    for (size_t i = 0; i < mesh->vertex_count; ++i) {
        (*uvs)[2 * i] = 3.0f * mesh->positions[3 * i];
        (*uvs)[2 * i + 1] = 3.0f * mesh->positions[3 * i + 2];
    }
    vshi_floats_set(host);
    *mask = (vsh_alpha_mask){.alpha = alpha,
                             .width = 7,
                             .height = 5,
                             .wrap = {VSH_WRAP_REPEAT, VSH_WRAP_MIRROR},
                             .uv_transform = {1, 0.25, 0, 0, 1, 0},
                             .alpha_cutoff = 0.4,
                             .base_alpha = 1.0};
    mesh->mask = mask;
    mesh->mask_uvs = *uvs;
}

enum { OF_AO = 1, CUT_OUT = 2 };

/* Hashes exact values, whose rays are Embree's. */
static void exact(const context *c, int32_t what, bits *b) {
    vsh_alpha_mask mask;
    FREED float *uvs = NULL;
    const vsh_heights_source source = hills();
    OWNED(vsh_model) *model = NULL;
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vshi_triangles) *triangles = NULL;
    context here = {.run = c->run};
    assert_ok(vsh_model_from_heights(&source, VSH_HEIGHTS_SOLID, &c->run, &model, &failure));
    vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    if ((what & CUT_OUT) != 0) {
        cut_out(&mesh, &mask, &uvs);
    }
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = (what & CUT_OUT) != 0 ? 16 : 64;
    assert_ok(vsh_grid_from_meshes(&mesh, 1, &options, &c->run, &grid, &failure));
    assert_ok(vshi_field_create(grid, NULL, &c->run, &here.field, &failure));
    assert_ok(vshi_triangles_create(&mesh, 1, NULL, &c->run, &triangles, &failure));
    vsh_shade_options shading = preview_options();
    shading.method = VSH_SHADOW_EXACT;
    shading.ao_method = VSH_AO_EXACT;
    here.triangles = triangles;
    const vsh_light light = usual_sun();
    shade(&here, (what & OF_AO) != 0 ? NULL : &light, &shading, b);
    vshi_field_free(here.field);
}

/* --- the table */

typedef struct part {
    const char *name;
    void (*bake)(const context *c, int32_t what, bits *b);
    int32_t what;
    uint64_t hash;
} part;

static const part parts[] = {
#include "bits.inc"
};

static void bake_part(const part *p, const vsh_run *run, bits *b) {
    context c = {.run = *run, .grid = solids(run)};
    assert_ok(vshi_field_create(c.grid, NULL, run, &c.field, &failure));
    *b = (bits){0, 0, 0};
    p->bake(&c, p->what, b);
    vshi_field_free(c.field);
    vsh_grid_free(c.grid);
}

static void print_table(void) {
    const vsh_run run = vsh_run_default();
    for (size_t i = 0; i < COUNT_OF(parts); ++i) {
        bits b;
        bake_part(&parts[i], &run, &b);
        printf("%-28s 0x%016llx\n", parts[i].name, (unsigned long long)b.hash);
    }
}

TEST(every_part_has_its_bits_for_any_threads_and_instruction_set) {
    bool wrong = false;
    const bool once = getenv("VSH_BITS") != NULL;
    for (int32_t isa = VSH_ISA_BASE; isa <= (once ? VSH_ISA_BASE : VSH_ISA_AVX512); ++isa) {
        for (int32_t threads = 1; threads <= (once ? 1 : 5) && vshi_isa_available(isa); threads += 4) {
            vsh_run run = run_on(threads);
            run.isa = isa;
            for (size_t i = 0; i < COUNT_OF(parts); ++i) {
                bits b;
                bake_part(&parts[i], &run, &b);
                assert_true(b.changes > 20);
                if (b.hash != parts[i].hash) {
                    wrong = true;
                    print_error("%s: 0x%016llx, expected 0x%016llx (%s, %d threads)\n", parts[i].name,
                                (unsigned long long)b.hash, (unsigned long long)parts[i].hash,
                                vsh_get_name(VSH_NAMES_ISA, isa), threads);
                }
            }
        }
    }
    assert_false(wrong);
}

/* --- the host's floating-point environment */

#if defined(__x86_64__)
/* MXCSR: flush to zero, denormals are zero, both; then rounding down, up, to zero, all of it, and nothing
 * masked but inexact results and denormals. */
static const vshi_floats SETTINGS[] = {0x9f80, 0x1fc0, 0x9fc0, 0x3f80, 0x5f80, 0x7f80, 0xffc0, 0x1100};
#elif defined(__aarch64__)
static const vshi_floats SETTINGS[] = {1u << 24, 1u << 22, 2u << 22, 3u << 22};
#else
static const vshi_floats SETTINGS[] = {VSHI_FLOATS_DEFAULT};
#endif

static int32_t count_strange(void *user, const char *stage, double fraction) {
    *(size_t *)user += vshi_floats_differ(vshi_floats_get()) != 0;
    return 0;
}

TEST(no_setting_of_the_host_changes_bits_and_all_are_given_back) {
    for (size_t s = 0; s < (getenv("VSH_BITS") != NULL ? 0 : COUNT_OF(SETTINGS)); ++s) {
        for (size_t i = 0; i < COUNT_OF(parts); ++i) {
            size_t strange = 0; /* calls of the callback in another setting than the default one */
            vsh_run run = run_watched(count_strange, &strange);
            run.threads = (int32_t)(s + i) % 3;
            bits b;
            vshi_floats_set(SETTINGS[s]);
            bake_part(&parts[i], &run, &b);
            const vshi_floats after = vshi_floats_get(), flags = VSHI_FLOATS_FLAGS;
            vshi_floats_set(VSHI_FLOATS_DEFAULT);
            assert_that(b.hash == parts[i].hash && strange == 0,
                        "%s, setting %#llx: other bits, or %zu callbacks in it", parts[i].name,
                        (unsigned long long)SETTINGS[s], strange);
            /* flags that say what has happened may be added */
            assert_true((after & ~flags) == (SETTINGS[s] & ~flags));
        }
    }
}

/* A torus. Threads of the pool ask for its distances. */
static double ring(void *user, const double p[3]) {
    const bool strange = vshi_floats_differ(vshi_floats_get()) != 0;
    return strange ? (double)NAN /* is refused */ : hypot(hypot(p[0], p[2]) - 1.0, p[1]) - 0.31;
}

TEST(distance_callbacks_run_in_the_default_setting) {
    const vsh_distance field = {ring, NULL, 1.0, 0, {-1.4, -0.4, -1.4}, {1.4, 0.4, 1.4}};
    for (size_t s = 0; s < COUNT_OF(SETTINGS); ++s) {
        vshi_floats_set(SETTINGS[s]);
        vsh_grid *grid = grid_from_distance(&field, 0.1);
        vshi_floats_set(VSHI_FLOATS_DEFAULT);
        vsh_grid_free(grid);
    }
}

/* Lengths that are denormal numbers, and scenes that have them, keep their values. */
TEST(denormals_are_numbers) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.1, 2.0);
    const double p[3] = {0.3, 1e-310, 0.2}, zero[3] = {0.3, 0.0, 0.2};
    const float tiny[3] = {0.0f, 1e-41f, 1e-44f}, up[3] = {0.0f, 1.0f, 0.0f};
    const double towards[3] = {5e-324, 1e-310, 0.0};
    const vsh_light light = sun(towards, 1e-310), straight = sun((const double[]){0.0, 1.0, 0.0}, 0.0);
    for (size_t s = 0; s < COUNT_OF(SETTINGS); ++s) {
        for (int kind = 0; kind < KINDS; ++kind) {
            vshi_floats_set(SETTINGS[s]);
            const float a = cast_kind_at(&c, kind, &light, 1.0, p, tiny),
                        b = cast_kind_at(&c, kind, &straight, 1.0, zero, up);
            vshi_floats_set(VSHI_FLOATS_DEFAULT);
            /* the normal is turned by a thousandth */
            assert_true(is_ao(kind) ? fabsf(a - b) <= 1e-2f : bits_of(a) == bits_of(b));
            assert_true(!is_ao(kind) ||
                        bits_of(b) == bits_of(cast_kind_at(&c, kind, &straight, 1.0, zero, up)));
        }
    }
}

/* --- instruction sets */

TEST(an_instruction_set_that_is_missing_or_unknown_is_refused_by_name) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.2, 1.0);
    const double place[3] = {0.0, 3.0, 0.0};
    const vsh_points points = {1, place, NULL, NULL};
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    vsh_run run = vsh_run_default();
    float value;
    for (int32_t isa = -1; isa <= VSHI_ISA_COUNT; ++isa) {
        const char *name = vsh_get_name(VSH_NAMES_ISA, isa);
        run.isa = isa;
        for (int k = 0; k < 2; ++k) {
            assert_fails(vsh_shade_shadow(occluders_of(field), &points, &light, NULL, &run, &value, NULL,
                                          NULL, &failure),
                         vshi_isa_available(isa) ? VSH_OK : VSH_ERROR_ARGUMENT,
                         k == 0 || name == NULL ? "isa" : name);
        }
    }
    /* a run from before it had an instruction set */
    run.isa = -1;
    run.struct_size = offsetof(vsh_run, isa);
    assert_ok(
        vsh_shade_shadow(occluders_of(field), &points, &light, NULL, &run, &value, NULL, NULL, &failure));
}

int main(void) {
    make_inputs();
    const char *how = getenv("VSH_BITS");
    if (how != NULL && strcmp(how, "print") == 0) {
        print_table();
        return 0;
    }
    return run_all_tests(NULL, NULL);
}
