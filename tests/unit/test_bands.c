/* Lightmaps baked in bands of rows are those baked whole, bit by bit. */
#include "casts.h"
#include "texels_of.h"

#include <vdbshade/trace.h>

/* No multiple of a tile, with a last band of two rows. */
enum { WIDTH = 104, HEIGHT = 90, TEXELS = WIDTH * HEIGHT, PLANES = 10 };

static const double VOXEL = 0.05;

/* A box around (x, 0.4, z), turned about y, so that its footprint crosses rows and columns of texels. */
typedef struct box_mesh {
    float positions[24];
    vsh_mesh mesh;
} box_mesh;

static void make_box(box_mesh *b, double x, double z, double turn) {
    static const uint32_t SIDES[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    static const double HALF[3] = {0.9, 0.4, 0.15};
    for (size_t v = 0; v < 8; ++v) {
        const double at[3] = {(v & 1 ? 1 : -1) * HALF[0], (v & 2 ? 1 : -1) * HALF[1],
                              (v & 4 ? 1 : -1) * HALF[2]};
        b->positions[3 * v] = (float)(x + cos(turn) * at[0] + sin(turn) * at[2]);
        b->positions[3 * v + 1] = (float)(0.25 + at[1]);
        b->positions[3 * v + 2] = (float)(z - sin(turn) * at[0] + cos(turn) * at[2]);
    }
    b->mesh = (vsh_mesh){
        .name = "wall", .positions = b->positions, .indices = SIDES, .vertex_count = 8, .triangle_count = 12};
}

/* A floor whose chart stands askew, a smooth ball that lies over its corner, and a wall that both stand in:
 * texels that are invalid, padding and charts' edges in every row of tiles. */
typedef struct stage {
    quad floor;
    sphere ball;
    box_mesh wall;
    vsh_mesh receivers[2];
    vsh_field *field;
    vsh_triangles *triangles; /* NULL without Embree */
} stage;

static void set_up_floor(quad *q) {
    make_quad(q, 0.0f, 0.0f, 1.0f, 1.0f);
    for (size_t v = 0; v < 4; ++v) {
        const double x = 2.0 * q->uvs[2 * v] - 1.0, y = 2.0 * q->uvs[2 * v + 1] - 1.0;
        q->positions[3 * v] = (float)(1.5 * x);
        q->positions[3 * v + 1] = 0.0f;
        q->positions[3 * v + 2] = (float)(-1.5 * y);
        q->uvs[2 * v] = (float)(0.45 + 0.34 * x - 0.1 * y);
        q->uvs[2 * v + 1] = (float)(0.5 + 0.1 * x + 0.38 * y);
    }
}

static int set_up(void **state) {
    stage *s = calloc(1, sizeof *s);
    *state = s;
    set_up_floor(&s->floor);
    make_sphere(&s->ball, 12, 0.4);
    for (size_t v = 0; v < s->ball.mesh.vertex_count; ++v) {
        s->ball.positions[3 * v + 1] += 0.3f; /* its foot is under the floor */
        s->ball.uvs[2 * v] = 0.72f + 0.26f * s->ball.uvs[2 * v];
        s->ball.uvs[2 * v + 1] = 0.04f + 0.9f * s->ball.uvs[2 * v + 1];
    }
    make_box(&s->wall, 0.3, 0.2, 0.6);
    s->receivers[0] = s->floor.mesh;
    s->receivers[1] = s->ball.mesh;
    const vsh_mesh casters[2] = {s->wall.mesh, s->ball.mesh};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = VOXEL;
    vsh_grid *grid = NULL;
    vsh_error error = {0};
    if (vsh_grid_from_meshes(casters, 2, &options, NULL, &grid, &error) != VSH_OK ||
        vsh_field_create(grid, NULL, NULL, &s->field, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_grid_free(grid);
    if (vsh_triangles_available()) {
        assert_int_equal(vsh_triangles_create(casters, 2, NULL, &s->triangles, &error), VSH_OK);
    }
    return 0;
}

static int tear_down(void **state) {
    stage *s = *state;
    vsh_triangles_free(s->triangles);
    vsh_field_free(s->field);
    free_sphere(&s->ball);
    free(s);
    return 0;
}

/* Two lights, one of them near, with everything that a lightmap can hold. */
typedef struct planes {
    float values[PLANES][TEXELS];
    vsh_bake_stats stats;
    uint64_t invalid_by_mesh[2];
} planes;

static void set_lights(vsh_light lights[2]) {
    lights[0] = lights[1] = vsh_light_default();
    lights[0].direction[0] = 0.5;
    lights[0].direction[2] = -0.3;
    lights[0].angle = 0.3;
    lights[1].type = VSH_LIGHT_SPHERE;
    lights[1].position[1] = 2.0;
    lights[1].position[2] = 1.0;
    lights[1].radius = 0.2;
    strcpy(lights[1].name, "lamp");
}

/* Bakes rows first … first + rows - 1 into their place and adds the statistics. */
static void bake_rows(const stage *s, const vsh_texels *texels, const vsh_shade_options *shade, int32_t first,
                      int32_t threads, planes *p) {
    vsh_light lights[2];
    set_lights(lights);
    const size_t at = (size_t)first * WIDTH;
    float *const irradiance = (float *)p->values + 5 * (size_t)TEXELS; /* planes 5 … 7 are one */
    float *const shadow[2] = {p->values[0] + at, p->values[1] + at};
    float *const shadow_error[2] = {p->values[2] + at, p->values[3] + at};
    const vsh_lightmap lightmap = {.shadow = shadow,
                                   .ao = p->values[4] + at,
                                   .irradiance = irradiance + 3 * at,
                                   .coverage = p->values[8] + at,
                                   .shadow_error = shadow_error,
                                   .ao_error = p->values[9] + at};
    vsh_run run = vsh_run_default();
    run.threads = threads;
    vsh_bake_stats stats = vsh_bake_stats_zero();
    uint64_t invalid[2];
    stats.invalid_by_mesh = invalid;
    stats.shade = p->stats.shade;
    vsh_error error = {0};
    if (vsh_bake_lightmap(occluders_traced(s->field, s->triangles), texels, lights, 2, shade, &run, &lightmap,
                          &stats, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    p->stats.texels += stats.texels;
    p->stats.invalid_texels += stats.invalid_texels;
    p->stats.shade = stats.shade;
    p->invalid_by_mesh[0] += invalid[0];
    p->invalid_by_mesh[1] += invalid[1];
}

static planes *new_planes(void) {
    planes *p = malloc(sizeof *p);
    memset(p->values, 0xff, sizeof p->values); /* NaN: whatever is not written shows */
    p->stats = vsh_bake_stats_zero();
    p->invalid_by_mesh[0] = p->invalid_by_mesh[1] = 0;
    return p;
}

static void assert_same(const planes *whole, const planes *banded) {
    for (int plane = 0; plane < PLANES; ++plane) {
        for (int i = 0; i < TEXELS; ++i) {
            if (memcmp(&whole->values[plane][i], &banded->values[plane][i], sizeof(float)) != 0) {
                fail_msg("plane %d, row %d, column %d: %.9g whole, %.9g in bands", plane, i / WIDTH,
                         i % WIDTH, (double)whole->values[plane][i], (double)banded->values[plane][i]);
            }
        }
    }
    assert_int_equal(whole->stats.texels, banded->stats.texels);
    assert_int_equal(whole->stats.invalid_texels, banded->stats.invalid_texels);
    assert_memory_equal(whole->invalid_by_mesh, banded->invalid_by_mesh, sizeof whole->invalid_by_mesh);
    assert_memory_equal(&whole->stats.shade, &banded->stats.shade, sizeof whole->stats.shade);
}

static void bake_whole_and_in_bands(const stage *s, vsh_lightmap_options options) {
    static const int32_t BAND_ROWS[] = {8, 16, 40, 88, HEIGHT};
    planes *whole = new_planes();
    vsh_texels *texels = create(s->receivers, 2, options, NULL);
    bake_rows(s, texels, &options.shade, 0, 1, whole);
    vsh_texels_free(texels);
    assert_true(whole->invalid_by_mesh[0] > 100 && whole->invalid_by_mesh[1] > 100);

    vsh_charts *charts = NULL;
    vsh_error error = {0};
    if (vsh_charts_create(s->receivers, 2, &options, NULL, NULL, &charts, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    for (size_t b = 0; b < sizeof BAND_ROWS / sizeof BAND_ROWS[0]; ++b) {
        planes *banded = new_planes();
        for (int32_t first = 0; first < HEIGHT; first += BAND_ROWS[b]) {
            const int32_t left = HEIGHT - first, rows = left < BAND_ROWS[b] ? left : BAND_ROWS[b];
            assert_int_equal(vsh_texels_create_band(charts, first, rows, NULL, &texels, &error), VSH_OK);
            bake_rows(s, texels, &options.shade, first, 2, banded);
            vsh_texels_free(texels);
        }
        assert_same(whole, banded);
        free(banded);
    }
    vsh_charts_free(charts);
    free(whole);
}

static void bake_by(const stage *s, int32_t method, int32_t ao_method) {
    const struct { int32_t supersample, padding, ao_spacing; } texels[] = {{1, 0, 4}, {1, 16, 8}, {2, 4, 4}};
    for (size_t t = 0; t < sizeof texels / sizeof texels[0]; ++t) {
        vsh_lightmap_options options = size_of(WIDTH, HEIGHT, texels[t].supersample);
        options.padding = texels[t].padding;
        options.ao_spacing = texels[t].ao_spacing;
        options.shade.method = method;
        options.shade.ao_method = ao_method;
        options.shade.ao_cones = 4;
        options.shade.rays = 32;
        bake_whole_and_in_bands(s, options);
    }
}

static void cones_are_the_same_in_bands(void **state) {
    bake_by(*state, VSH_SHADOW_CONE, VSH_AO_CONES);
}

static void one_sided_estimates_and_taps_are_the_same_in_bands(void **state) {
    bake_by(*state, VSH_SHADOW_IMPROVED, VSH_AO_TAPS);
}

static void adaptive_rays_are_the_same_in_bands(void **state) {
    bake_by(*state, VSH_SHADOW_ADAPTIVE, VSH_AO_ADAPTIVE);
}

static void exact_rays_are_the_same_in_bands(void **state) {
    if (!vsh_triangles_available()) {
        skip();
    }
    bake_by(*state, VSH_SHADOW_EXACT, VSH_AO_EXACT);
}

static void bands_have_the_samples_of_the_whole(void **state) {
    const stage *s = *state;
    vsh_uv_report whole_reports[2], reports[2];
    const vsh_lightmap_options options = size_of(WIDTH, HEIGHT, 2);
    vsh_texels *whole = create(s->receivers, 2, options, whole_reports);
    const vsh_texel_samples all = vsh_texels_samples(whole);
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(s->receivers, 2, &options, NULL, reports, &charts, NULL), VSH_OK);
    assert_true(whole_reports[1].overlap_texels > 0);
    assert_memory_equal(whole_reports, reports, sizeof reports);
    vsh_texels_info info;
    vsh_charts_info counted;
    vsh_texels_get_info(whole, &info);
    vsh_charts_get_info(charts, &counted);
    assert_int_equal(counted.covered, info.covered);
    assert_int_equal(counted.samples, info.samples);
    double low[3], high[3];
    assert_int_equal(vsh_charts_bounds(charts, NULL, low, high, NULL), VSH_OK);
    assert_memory_equal(low, info.bounds_min, sizeof low);
    assert_memory_equal(high, info.bounds_max, sizeof high);
    size_t at = 0, covered = 0;
    for (int32_t first = 0; first < HEIGHT; first += 32) {
        const int32_t rows = HEIGHT - first < 32 ? HEIGHT - first : 32;
        vsh_texels *texels = NULL;
        assert_int_equal(vsh_texels_create_band(charts, first, rows, NULL, &texels, NULL), VSH_OK);
        const vsh_texel_samples part = vsh_texels_samples(texels);
        assert_true(at + part.count <= all.count);
        assert_memory_equal(part.texels, all.texels + at, part.count * sizeof *part.texels);
        assert_memory_equal(part.positions, all.positions + 3 * at, 3 * part.count * sizeof *part.positions);
        assert_memory_equal(part.normals, all.normals + 3 * at, 3 * part.count * sizeof *part.normals);
        for (size_t i = 0; i < part.count; ++i) {
            const int32_t row = (int32_t)vsh_texel_row(part.texels[i]);
            assert_true(row >= first && row < first + rows);
        }
        vsh_texels_get_info(texels, &info);
        assert_int_equal(info.samples, part.count);
        at += part.count;
        covered += info.covered;
        vsh_texels_free(texels);
    }
    assert_int_equal(at, all.count);
    assert_int_equal(covered, counted.covered);
    vsh_charts_free(charts);
    vsh_texels_free(whole);
}

/* No sample has tangents or an origin there. */
static void a_band_without_a_chart_is_baked_and_is_empty(void **state) {
    const stage *s = *state;
    float uvs[8], shadow[8 * WIDTH], bent[3 * 8 * WIDTH], coverage[8 * WIDTH];
    for (size_t v = 0; v < 4; ++v) {
        uvs[2 * v] = s->floor.uvs[2 * v];
        uvs[2 * v + 1] = 0.3f * s->floor.uvs[2 * v + 1]; /* in the lowest rows */
    }
    vsh_mesh low = s->receivers[0];
    low.uvs = uvs;
    vsh_lightmap_options options = size_of(WIDTH, HEIGHT, 1);
    options.tangents = 1;
    vsh_charts *charts = NULL;
    vsh_error error = {0};
    assert_int_equal(vsh_charts_create(&low, 1, &options, NULL, NULL, &charts, &error), VSH_OK);
    vsh_texels *texels = NULL;
    assert_int_equal(vsh_texels_create_band(charts, 0, 8, NULL, &texels, &error), VSH_OK);
    vsh_light lights[2];
    set_lights(lights);
    memset(shadow, 0xff, sizeof shadow);
    float *const shadows[1] = {shadow};
    const vsh_lightmap lightmap = {
        .shadow = shadows, .bent = bent, .bent_space = VSH_BENT_TANGENT, .coverage = coverage};
    if (vsh_bake_lightmap(occluders_traced(s->field, s->triangles), texels, lights, 1, &options.shade, NULL,
                          &lightmap, NULL, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    for (int i = 0; i < 8 * WIDTH; ++i) {
        assert_true(shadow[i] == 0.0f && coverage[i] == 0.0f && bent[3 * i] == 0.0f);
    }
    vsh_texels_free(texels);
    vsh_charts_free(charts);
}

static void rows_that_are_no_band_are_refused(void **state) {
    const stage *s = *state;
    const vsh_lightmap_options options = size_of(WIDTH, HEIGHT, 1);
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(s->receivers, 2, &options, NULL, NULL, &charts, NULL), VSH_OK);
    const vsh_lightmap nothing = {0};
    const int32_t bad[][2] = {{-8, 8}, {4, 8},  {HEIGHT, 8}, {96, 8}, {0, 0},
                              {0, 4},  {0, -8}, {0, 96},     {88, 1}, {80, 8 + HEIGHT}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        vsh_texels *texels = (vsh_texels *)charts; // not NULL, as refused it is to be
        vsh_error error = {0};
        assert_int_equal(vsh_texels_create_band(charts, bad[i][0], bad[i][1], NULL, &texels, &error),
                         VSH_ERROR_ARGUMENT);
        assert_null(texels);
        assert_non_null(strstr(error.message, "band"));
        assert_int_equal(vsh_charts_band_bytes(charts, bad[i][0], bad[i][1], &nothing, 0), 0);
    }
    vsh_charts_free(charts);
}

/* A limit that the whole lightmap passes. */
static void a_band_bakes_within_the_bytes_it_is_said_to_take(void **state) {
    const stage *s = *state;
    vsh_lightmap_options options = size_of(2048, 2048, 1);
    vsh_charts *charts = NULL;
    vsh_run run = vsh_run_default();
    run.threads = 2;
    run.memory_limit = 40 << 20;
    vsh_error error = {0};
    vsh_texels *texels = NULL;
    assert_int_equal(vsh_texels_create(s->receivers, 2, &options, &run, NULL, &texels, &error),
                     VSH_ERROR_LIMIT);
    if (vsh_charts_create(s->receivers, 2, &options, &run, NULL, &charts, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_charts_info counted;
    vsh_field_info field;
    vsh_charts_get_info(charts, &counted);
    vsh_field_get_info(s->field, &field);
    const int32_t first = 1024, rows = 64, floats = 4;
    float *memory = malloc((size_t)floats * 2048 * rows * sizeof *memory);
    const size_t plane = (size_t)2048 * rows;
    float *const shadow[2] = {memory, memory + plane};
    const vsh_lightmap lightmap = {
        .shadow = shadow, .ao = memory + 2 * plane, .coverage = memory + 3 * plane};
    const uint64_t bytes = vsh_charts_band_bytes(charts, first, rows, &lightmap, 2);
    assert_true(bytes > vsh_charts_band_bytes(charts, first, rows - 8, &lightmap, 2));
    assert_true(bytes - vsh_charts_band_bytes(charts, first, rows, &lightmap, 1) >= plane * sizeof *memory);
    assert_int_equal(vsh_texels_create_band(charts, first, rows, &run, &texels, &error), VSH_OK);
    vsh_light lights[2];
    set_lights(lights);
    options.shade.ao_method = VSH_AO_TAPS;
    run.memory_limit = field.bytes + bytes;
    assert_int_equal(vsh_bake_lightmap(occluders_traced(s->field, s->triangles), texels, lights, 2,
                                       &options.shade, &run, &lightmap, NULL, &error),
                     VSH_OK);
    run.memory_limit = field.bytes + bytes / 2;
    assert_int_equal(vsh_bake_lightmap(occluders_traced(s->field, s->triangles), texels, lights, 2,
                                       &options.shade, &run, &lightmap, NULL, &error),
                     VSH_ERROR_LIMIT);
    free(memory);
    vsh_texels_free(texels);
    vsh_charts_free(charts);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cones_are_the_same_in_bands),
        cmocka_unit_test(one_sided_estimates_and_taps_are_the_same_in_bands),
        cmocka_unit_test(adaptive_rays_are_the_same_in_bands),
        cmocka_unit_test(exact_rays_are_the_same_in_bands),
        cmocka_unit_test(bands_have_the_samples_of_the_whole),
        cmocka_unit_test(a_band_without_a_chart_is_baked_and_is_empty),
        cmocka_unit_test(rows_that_are_no_band_are_refused),
        cmocka_unit_test(a_band_bakes_within_the_bytes_it_is_said_to_take),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
