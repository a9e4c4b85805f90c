/* Lightmaps of a wall that stands on a floor, of a coarse smooth sphere and of an open sheet. Padding gives
 * texels outside of charts their nearest neighbour's value. */
#include "lightmap/padding.h"
#include "shading.h"
#include "testing.h"
#include "texels_of.h"

enum { SIZE = 64, TEXELS = SIZE * SIZE };

#define VOXEL 0.04
#define WALL 0.2 /* half its thickness */

static double texel_x(uint32_t texel) {
    return -1.0 + 2.0 * (texel % SIZE + 0.5) / SIZE;
}

/* A slab under y = 0 and, where `wall` is not zero, a wall |x| < WALL of height 1 across all of it. */
static vsh_field *floor_field(int wall) {
    static const truth_solid solids[2] = {
        {.shape = TRUTH_BOX, .center = {0.0, -0.25, 0.0}, .half = {1.5, 0.25, 1.5}},
        {.shape = TRUTH_BOX, .center = {0.0, 0.5, 0.0}, .half = {WALL, 0.5, 1.5}}};
    return field_of((truth_scene){solids, wall ? 2 : 1}, VOXEL, 0.0);
}

static vsh_field *field_of_mesh(const vsh_mesh *mesh, double voxel) {
    return field_of_grid(grid_from_meshes(mesh, 1, voxel), 0.0);
}

/* Planes of one light, AO, irradiance and coverage. */
typedef struct planes {
    float shadow[TEXELS], ao[TEXELS], irradiance[3 * TEXELS], coverage[TEXELS];
    float *lights[1];
    vsh_lightmap all;
} planes;

static planes *new_planes(void) {
    planes *p = malloc(sizeof *p);
    memset(p, 0xff, sizeof *p); /* NaN, so that the test notices values that were not written */
    p->lights[0] = p->shadow;
    p->all = (vsh_lightmap){
        .shadow = p->lights, .ao = p->ao, .irradiance = p->irradiance, .coverage = p->coverage};
    return p;
}

static void bake(const vsh_field *field, const vsh_charts *charts, const vsh_light *light,
                 const vsh_lightmap *lightmap, vsh_bake_stats *stats, int32_t threads) {
    vsh_run run = run_on(threads);
    assert_ok(vsh_bake_lightmap(occluders_of(field), charts, light, light != NULL ? 1 : 0, NULL, &run,
                                lightmap, stats, &failure));
}

/* Most tests bake these: a field, the charts of a mesh, planes. */
typedef struct stage {
    vsh_field *field;
    vsh_charts *charts;
    planes *p;
    vsh_bake_stats stats;
} stage;

static vsh_charts *charts_of(const vsh_mesh *mesh, int32_t size, int32_t supersample, int32_t padding) {
    vsh_lightmap_options options = size_of(size, size, supersample);
    options.padding = padding;
    return charts_from(mesh, 1, &options);
}

static stage begin(vsh_field *field, const vsh_mesh *mesh, int32_t size, int32_t supersample,
                   int32_t padding) {
    return (stage){field, charts_of(mesh, size, supersample, padding), new_planes(), vsh_bake_stats_zero()};
}

/* The floor, with a wall on it or without. */
static stage begin_floor(int wall, int32_t size, int32_t supersample, int32_t padding) {
    static vsh_mesh mesh; /* charts refer to it */
    mesh = floor_mesh(NULL);
    return begin(floor_field(wall), &mesh, size, supersample, padding);
}

static void bake_stage(stage *s, const vsh_light *light) {
    bake(s->field, s->charts, light, &s->p->all, &s->stats, 0);
}

static void end(stage *s) {
    free(s->p);
    vsh_charts_free(s->charts);
    vshi_field_free(s->field);
}

TEST(a_floor_under_open_sky_is_exactly_lit) {
    const vsh_light light = sun((double[]){0.3, 1.0, 0.2}, 0.2);
    static const int32_t sizes[][2] = {{SIZE, 0}, {1, 4}}; /* with their padding */
    for (int k = 0; k < 2; ++k) {
        FREED_BY(end) stage s = begin_floor(0, sizes[k][0], 1, sizes[k][1]);
        bake_stage(&s, &light);
        const size_t texels = (size_t)(sizes[k][0] * sizes[k][0]);
        assert_all_equal(s.p->shadow, texels, 1.0f);
        assert_all_equal(s.p->coverage, texels, 1.0f);
        assert_true(texels == TEXELS || isnan(s.p->coverage[texels]));
        assert_int_equal(s.stats.texels, texels);
        assert_int_equal(s.stats.invalid_texels, 0);
    }
}

TEST(texels_under_a_wall_are_invalid_and_nothing_leaks_on_either_side) {
    const vsh_light light = sun((double[]){1.0, 1.0, 0.0}, 0.05);
    uint64_t invalid_by_mesh[1] = {77}, invalid = 0;
    FREED_BY(end) stage s = begin_floor(1, SIZE, 1, 0);
    s.stats.invalid_by_mesh = invalid_by_mesh;
    bake_stage(&s, &light);
    for (uint32_t i = 0; i < TEXELS; ++i) {
        const double x = texel_x(i);
        const float shadow = s.p->shadow[i];
        invalid += s.p->coverage[i] == 0.0f;
        assert_true(fabs(x) >= WALL - VOXEL || s.p->coverage[i] == 0.0f);
        assert_true(fabs(x) <= WALL + VOXEL || s.p->coverage[i] == 1.0f);
        /* The shadow of a wall of height 1 at 45° ends beyond the floor's edge. */
        assert_true(x >= -WALL || shadow < 0.01f);
        assert_true(x <= WALL + VOXEL || shadow > 0.99f);
        /* Invalid texels take the value of the nearest valid one, dark or lit. */
        if (fabs(x) < WALL - VOXEL && fabs(x) > WALL - 6.0 * 2.0 / SIZE) {
            assert_true(x < 0.0 ? shadow < 0.01f : shadow > 0.9f);
        }
    }
    assert_int_equal(invalid, s.stats.invalid_texels);
    assert_int_equal(invalid, invalid_by_mesh[0]);
    assert_int_equal(s.stats.texels, TEXELS);
}

TEST(padding_copies_dark_and_lit_texels_and_leaves_coverage) {
    enum { PADDING = 3 };
    /* The part x < -0.5 of the floor, all of it in shadow, and a chart around it. */
    const float positions[12] = {-1, 0, 1, -0.5f, 0, 1, -0.5f, 0, -1, -1, 0, -1};
    const float uvs[8] = {0.25f, 0.25f, 0.75f, 0.25f, 0.75f, 0.75f, 0.25f, 0.75f};
    vsh_mesh mesh = floor_mesh(NULL);
    mesh.positions = positions;
    mesh.uvs = uvs;
    const vsh_light light = sun((double[]){1.0, 1.0, 0.0}, 0.05);
    FREED_BY(end) stage s = begin(floor_field(1), &mesh, SIZE, 1, PADDING);
    bake_stage(&s, &light);
    const planes *p = s.p;
    for (int i = 0; i < TEXELS; ++i) {
        const int x = i % SIZE, y = i / SIZE;
        const int dx = x < 16 ? 16 - x : x > 47 ? x - 47 : 0, dy = y < 16 ? 16 - y : y > 47 ? y - 47 : 0;
        assert_true(p->coverage[i] == (dx == 0 && dy == 0 ? 1.0f : 0.0f));
        if (dx * dx + dy * dy > PADDING * PADDING) {
            assert_true(p->ao[i] == 0.0f);
        } else {
            const int source = (y < 16 ? 16 : y > 47 ? 47 : y) * SIZE + (x < 16 ? 16 : x > 47 ? 47 : x);
            assert_true(p->ao[i] > 0.0f && p->ao[i] == p->ao[source]);
        }
        assert_true(p->shadow[i] < 0.01f);
    }
}

TEST(a_texel_is_the_mean_of_its_valid_samples) {
    enum { N = 3, SMALL = 16 };
    const vsh_light light = sun((double[]){1.0, 1.0, 0.0}, 0.3);
    stage coarse = begin_floor(1, SMALL, N, 0), fine = begin_floor(1, SMALL * N, 1, 0);
    bake_stage(&coarse, &light);
    bake_stage(&fine, &light);
    const planes *p = coarse.p, *q = fine.p;
    for (int i = 0; i < SMALL * SMALL; ++i) {
        double sum = 0.0, count = 0.0;
        for (int s = 0; s < N * N; ++s) {
            const int at = (i / SMALL * N + s / N) * SMALL * N + i % SMALL * N + s % N;
            sum += q->coverage[at] > 0.0f ? (double)q->shadow[at] : 0.0;
            count += (double)q->coverage[at];
        }
        assert_true(p->coverage[i] == (count > 0.0 ? 1.0f : 0.0f));
        assert_true(count == 0.0 || fabs((double)p->shadow[i] - sum / count) < 1e-4);
    }
    end(&fine);
    end(&coarse);
}

/* Receiver and caster. */
TEST(a_coarse_smooth_sphere_has_no_dark_terminator_and_no_acne) {
    FREED_BY(free_sphere) sphere ball;
    make_sphere(&ball, 8, 1.0);
    const double towards[3] = {0.3, 0.9, 0.2};
    const vsh_light light = sun(towards, 0.01);
    FREED_BY(end) stage s = begin(field_of_mesh(&ball.mesh, 0.02), &ball.mesh, SIZE, 1, 0);
    bake_stage(&s, &light);
    assert_int_equal(s.stats.invalid_texels, 0);
    OWNED(texel_list) *texels = texels_from(s.charts);
    const texel_samples samples = samples_of(texels);
    for (size_t k = 0; k < samples.count; ++k) {
        const float *n = samples.normals + 3 * k;
        const double cosine = dot3((double[]){n[0], n[1], n[2]}, towards) / length3(towards);
        const float value = s.p->shadow[vsh_texel_place(samples.texels[k], SIZE)];
        assert_true(cosine <= 0.15 || value > 0.98f);
        assert_true(cosine >= -0.01 || value == 0.0f);
    }
}

TEST(an_open_sheet_does_not_shade_itself) {
    const vsh_mesh mesh = floor_mesh(NULL);
    const vsh_light light = sun((double[]){0.5, 0.8, 0.1}, 0.1);
    FREED_BY(end) stage s = begin(field_of_mesh(&mesh, VOXEL), &mesh, SIZE, 1, 0);
    bake_stage(&s, &light);
    assert_all_equal(s.p->coverage, TEXELS, 1.0f);
    assert_all_equal(s.p->shadow, TEXELS, 1.0f);
}

/* --- How a lightmap is baked: its planes, their errors, threads, options, limits. */

TEST(planes_that_are_not_requested_cost_nothing_and_change_nothing) {
    const vsh_light light = sun((double[]){1.0, 1.0, 0.0}, 0.05);
    FREED_BY(end) stage s = begin_floor(1, SIZE, 1, 2);
    bake_stage(&s, &light);
    FREED planes *some = new_planes();
    const vsh_lightmap coverage = {.coverage = some->coverage}, ao = {.ao = some->ao},
                       shadow = {.shadow = some->lights};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake(s.field, s.charts, &light, &coverage, &stats, 0);
    assert_int_equal(stats.shade.marches, 0);
    assert_int_equal(stats.shade.samples, 0);
    bake(s.field, s.charts, NULL, &ao, NULL, 0);
    bake(s.field, s.charts, &light, &shadow, NULL, 0);
    assert_memory_equal(some->coverage, s.p->coverage, sizeof some->coverage);
    assert_memory_equal(some->ao, s.p->ao, sizeof some->ao);
    assert_memory_equal(some->shadow, s.p->shadow, sizeof some->shadow);
}

/* Bakes the floor under a wall by `method` into planes of values and errors. */
static vsh_bake_stats bake_errors(int32_t method, float *shadow, float *shadow_error, float *ao_error) {
    OWNED(vsh_field) *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh(NULL);
    OWNED(vsh_charts) *charts = charts_of(&mesh, SIZE, 2, 4);
    const vsh_light light = sun((double[]){1.0, 1.0, 0.0}, 0.5);
    vsh_shade_options shade = preview_options();
    shade.method = method;
    float *shadows[1] = {shadow}, *errors[1] = {shadow_error};
    const vsh_lightmap lightmap = {
        .shadow = shadow != NULL ? shadows : NULL, .shadow_error = errors, .ao_error = ao_error};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    assert_ok(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &shade, NULL, &lightmap, &stats, &failure));
    return stats;
}

TEST(errors_are_baked_where_the_method_knows_them) {
    static float shadow[TEXELS], errors[TEXELS], alone[TEXELS], ao[TEXELS];
    const vsh_bake_stats stats = bake_errors(VSH_SHADOW_ADAPTIVE, shadow, errors, ao);
    size_t some = 0, none = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        /* a mean of standard errors, each within max_error but for its last round */
        assert_true(errors[i] >= 0.0f && errors[i] <= 0.05f);
        assert_true(ao[i] == 0.0f); /* cones know nothing of it */
        some += errors[i] > 0.0f;
        none += errors[i] == 0.0f;
    }
    assert_true(some > TEXELS / 50 && none > TEXELS / 2);
    assert_true(stats.shade.refined > 0 && stats.shade.square_error > 0.0);
    bake_errors(VSH_SHADOW_ADAPTIVE, NULL, alone, NULL); /* without the values */
    assert_memory_equal(errors, alone, sizeof errors);
    bake_errors(VSH_SHADOW_CONE, shadow, errors, NULL);
    assert_all_equal(errors, TEXELS, 0.0f);
}

/* --- wide rows: a lightmap is a part of larger images */

enum { WIDTH = 48, HEIGHT = 32, ROW = 61, LEFT = 7, TOP = 3, IMAGE = ROW * (HEIGHT + 2 * TOP) };
enum { LIGHTS = 2, IMAGES = 13 };

/* Shadow, its error and tint of each light; irradiance, bent, AO, its error, coverage, invalid, sky. */
static const size_t image_components[IMAGES] = {1, 1, 1, 1, 3, 3, 3, 3, 1, 1, 1, 1, 1};

typedef struct images {
    float values[IMAGES][3 * IMAGE];
    float *first[IMAGES]; /* texels of the lightmap */
    vsh_lightmap lightmap;
} images;

static images *new_images(int32_t row_texels) {
    images *m = malloc(sizeof *m);
    memset(m, 0xff, sizeof *m); /* NaN */
    for (int i = 0; i < IMAGES; ++i) {
        m->first[i] = m->values[i] + (row_texels != 0 ? image_components[i] * (TOP * ROW + LEFT) : 0);
    }
    float **first = m->first;
    m->lightmap = (vsh_lightmap){.shadow = first,
                                 .shadow_error = first + 2,
                                 .tint = first + 4,
                                 .irradiance = first[6],
                                 .bent = first[7],
                                 .ao = first[8],
                                 .ao_error = first[9],
                                 .coverage = first[10],
                                 .invalid = first[11],
                                 .sky = first[12],
                                 .tint_by = {.type = VSH_TINT_QUADRATIC},
                                 .asked = {.invalid = 1, .sky = VSH_UP_Y},
                                 .row_texels = row_texels};
    return m;
}

static size_t count_of_nan(const float *values, size_t count) {
    size_t found = 0;
    for (size_t i = 0; i < count; ++i) {
        found += isnan(values[i]) != 0;
    }
    return found;
}

/* Compares every row, and checks that all around the lightmap is as it was. */
static void assert_part_equals(const images *part, const images *whole) {
    for (int i = 0; i < IMAGES; ++i) {
        const size_t n = image_components[i];
        for (size_t y = 0; y < HEIGHT; ++y) {
            assert_memory_equal(part->first[i] + y * ROW * n, whole->first[i] + y * WIDTH * n,
                                WIDTH * n * sizeof(float));
        }
        assert_int_equal(count_of_nan(whole->values[i], WIDTH * HEIGHT * n), 0);
        assert_int_equal(count_of_nan(part->values[i], IMAGE * n), (IMAGE - WIDTH * HEIGHT) * n);
    }
}

/* The floor in three strips. The wall hides the middle one, and the seams on both sides of it. Rows of its
 * texels are narrower, so that values differ across seams. */
typedef struct strips {
    vsh_field *field;
    float corners[3][12], uvs[3][8];
    vsh_mesh meshes[3];
    vsh_charts *charts;
    vsh_light lights[LIGHTS];
} strips;

static void make_strips(strips *s) {
    static const float x[4] = {-1.0f, -0.14f, 0.14f, 1.0f};
    static const float u[3][2] = {{0.05f, 0.4f}, {0.45f, 0.55f}, {0.6f, 0.95f}};
    for (int i = 0; i < 3; ++i) {
        const vsh_mesh floor = floor_mesh(NULL);
        for (size_t k = 0; k < 4; ++k) {
            const int right = QUAD_UVS[2 * k] > 0.5f;
            memcpy(s->corners[i] + 3 * k, floor.positions + 3 * k, 3 * sizeof(float));
            s->corners[i][3 * k] = x[i + right];
            s->uvs[i][2 * k] = u[i][right];
            s->uvs[i][2 * k + 1] = 0.1f + (i == 1 ? 0.7f : 0.8f) * QUAD_UVS[2 * k + 1];
        }
        s->meshes[i] = quad_mesh("strip", s->corners[i], s->uvs[i]);
    }
    vsh_lightmap_options options = size_of(WIDTH, HEIGHT, 1);
    options.shade.method = VSH_SHADOW_ADAPTIVE;
    options.shade.ao_method = VSH_AO_ADAPTIVE;
    s->charts = charts_from(s->meshes, 3, &options);
    s->field = floor_field(1);
    s->lights[0] = sun((double[]){1.0, 1.0, 0.3}, 0.3);
    s->lights[1] = sun((double[]){-0.5, 1.0, 0.0}, 0.1);
}

static void free_strips(strips *s) {
    vsh_charts_free(s->charts);
    vshi_field_free(s->field);
}

static vsh_result bake_strips(const strips *s, const vsh_lightmap *lightmap, const vsh_run *run,
                              vsh_error *error) {
    return vsh_bake_lightmap(occluders_of(s->field), s->charts, s->lights, LIGHTS, NULL, run, lightmap, NULL,
                             error);
}

TEST(a_part_of_larger_images_gets_the_values_of_a_lightmap_alone) {
    FREED_BY(free_strips) strips s;
    make_strips(&s);
    FREED images *whole = new_images(0), *part = new_images(ROW);
    images *both[2] = {whole, part};
    uint64_t filled[2];
    vsh_stitch_report reports[2];
    for (int k = 0; k < 2; ++k) {
        assert_ok(bake_strips(&s, &both[k]->lightmap, NULL, &failure));
    }
    assert_part_equals(part, whole);
    FREED images *baked = new_images(0);
    memcpy(baked->values, whole->values, sizeof baked->values);
    for (int k = 0; k < 2; ++k) {
        assert_ok(vsh_lightmap_fill_hidden(s.charts, &both[k]->lightmap, LIGHTS, NULL, &filled[k], &failure));
    }
    assert_part_equals(part, whole);
    assert_true(filled[0] > 0 && filled[1] == filled[0]);
    assert_memory_not_equal(whole->values, baked->values, sizeof baked->values);
    memcpy(baked->values, whole->values, sizeof baked->values);
    for (int k = 0; k < 2; ++k) {
        assert_ok(stitch_one(s.charts, &both[k]->lightmap, LIGHTS, NULL, NULL, &reports[k], &failure));
    }
    assert_part_equals(part, whole);
    assert_true(reports[0].after < reports[0].before && reports[1].after == reports[0].after);
    assert_memory_not_equal(whole->values, baked->values, sizeof baked->values);
}

static int32_t stop_at_once(void *user, const char *step, double fraction) {
    return 1;
}

TEST(bad_rows_are_refused_and_calls_that_fail_leave_wide_rows) {
    static const int32_t bad[] = {-1, 1, WIDTH - 1, VSH_MAX_LIGHTMAP_SIZE + 1};
    FREED_BY(free_strips) strips s;
    make_strips(&s);
    FREED images *part = new_images(ROW);
    vsh_lightmap *lightmap = &part->lightmap;
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        char expected[80];
        snprintf(expected, sizeof expected, "row_texels %d: expected 0, or %d … %d", bad[i], WIDTH,
                 VSH_MAX_LIGHTMAP_SIZE);
        lightmap->row_texels = bad[i];
        assert_fails(bake_strips(&s, lightmap, NULL, &failure), VSH_ERROR_ARGUMENT, expected);
        assert_fails(vsh_lightmap_fill_hidden(s.charts, lightmap, LIGHTS, NULL, NULL, &failure),
                     VSH_ERROR_ARGUMENT, expected);
        assert_fails(stitch_one(s.charts, lightmap, LIGHTS, NULL, NULL, NULL, &failure), VSH_ERROR_ARGUMENT,
                     expected);
    }
    lightmap->row_texels = ROW;
    const vsh_run stopped = run_watched(stop_at_once, NULL);
    assert_fails(bake_strips(&s, lightmap, &stopped, &failure), VSH_ERROR_CANCELLED, "");
    /* the copy counts: the limit is raised until only it has no room, in steps smaller than it */
    const uint64_t step = WIDTH * HEIGHT * IMAGES * sizeof(float);
    uint64_t limit = step;
    do {
        const vsh_run limited = run_within(limit += step);
        assert_fails(bake_strips(&s, lightmap, &limited, &failure), VSH_ERROR_LIMIT, "");
    } while (strstr(failure.message, "copy of planes") == NULL);
    for (int i = 0; i < IMAGES; ++i) {
        assert_int_equal(count_of_nan(part->values[i], 3 * IMAGE), 3 * IMAGE);
    }
}

/* --- padding: texels outside of charts take their nearest neighbour's value */

static const float HOLE = -7.0f; /* the value of unfilled texels alone */

/* A plane of two channels. */
static void fill(int32_t width, int32_t height, const uint8_t *states, const int32_t radii[2],
                 float *values) {
    const int32_t radius[VSHI_TEXEL_KINDS] = {radii[0], 0, radii[1]};
    const vshi_plane plane = {values, 2};
    vshi_store store = {.run = NULL};
    assert_int_equal(vshi_padding_fill(&store, NULL, width, height, states, radius, &plane, 1, NULL, NULL),
                     VSH_OK);
    vshi_store_close(&store);
}

/* The definition, texel by texel: index of the source, or -1. */
static int64_t nearest(int32_t width, int32_t height, const uint8_t *states, int64_t at, int32_t radius) {
    int64_t best = (int64_t)radius * radius + 1, source = -1;
    for (int64_t i = 0; i < (int64_t)width * height; ++i) {
        const int64_t dx = i % width - at % width, dy = i / width - at / width;
        if (states[i] == VSHI_TEXEL_VALID && dx * dx + dy * dy < best) {
            best = dx * dx + dy * dy;
            source = i;
        }
    }
    return source;
}

TEST(every_texel_takes_the_nearest_value_and_the_first_of_equally_near_ones) {
    const int32_t sizes[][2] = {{1, 1}, {37, 23}, {130, 70}, {1, 50}, {50, 1}};
    const int32_t radii[][2] = {{0, 8}, {1, 8}, {2, 0}, {5, 8}, {7, 3}, {4096, 4096}};
    uint32_t random = 12345;
    for (size_t s = 0; s < COUNT_OF(sizes); ++s) {
        const int32_t width = sizes[s][0], height = sizes[s][1];
        const size_t count = (size_t)width * (size_t)height;
        FREED uint8_t *states = malloc(count);
        FREED float *values = malloc(2 * count * sizeof *values);
        for (size_t r = 0; r < COUNT_OF(radii); ++r) {
            for (size_t i = 0; i < count; ++i) {
                random = random * 1664525u + 1013904223u;
                const uint32_t dice = (random >> 16) % 50;
                states[i] = dice == 0 ? VSHI_TEXEL_VALID : dice < 10 ? VSHI_TEXEL_INVALID : VSHI_TEXEL_EMPTY;
                values[2 * i] = states[i] == VSHI_TEXEL_VALID ? (float)i : HOLE; /* dark, too */
                values[2 * i + 1] = 2.0f * values[2 * i];
            }
            fill(width, height, states, radii[r], values);
            for (size_t i = 0; i < count; ++i) {
                const int32_t radius = states[i] == VSHI_TEXEL_EMPTY ? radii[r][0] : radii[r][1];
                const int64_t source = states[i] == VSHI_TEXEL_VALID ? (int64_t)i
                                       : radius > 0 ? nearest(width, height, states, (int64_t)i, radius)
                                                    : -1;
                assert_true(values[2 * i] == (source < 0 ? HOLE : (float)source));
                assert_true(values[2 * i + 1] == 2.0f * values[2 * i]);
            }
        }
    }
}

/* --- Where invalid texels take their values from: within their chart, and how far. */

enum { MOST = 4096, NOWHERE = -1 };

/* A lightmap. A letter is a texel of the mesh of that letter, valid in upper case, invalid in lower case. A
 * blank is empty. */
typedef struct map {
    uint32_t mesh[MOST];
    uint8_t state[MOST];
    int from[MOST]; /* the texel that each takes its value from */
} map;

static map spread_over(size_t width, const char *letters) {
    static map m;
    const size_t count = strlen(letters);
    assert_true(count <= MOST);
    memset(&m, 0, sizeof m);
    for (size_t i = 0; i < count; ++i) {
        const bool empty = letters[i] == ' ', valid = letters[i] < 'a';
        m.from[i] = NOWHERE;
        m.state[i] = empty ? VSHI_TEXEL_EMPTY : valid ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
        m.mesh[i] = empty ? 0 : 1 + (uint32_t)(letters[i] - (valid ? 'A' : 'a'));
    }
    vshi_spread spread;
    vshi_store store = {.run = NULL};
    assert_ok(vshi_spread_find(&store, width, count / width, m.mesh, m.state, &spread, &failure));
    for (size_t i = 0; i < spread.count; ++i) {
        assert_int_equal(m.state[spread.texel[i]], VSHI_TEXEL_INVALID);
        assert_int_equal(m.from[spread.texel[i]], NOWHERE);
        m.from[spread.texel[i]] = (int)spread.source[i];
    }
    vshi_spread_free(&store, &spread);
    vshi_store_close(&store);
    return m;
}

TEST(an_invalid_texel_is_filled_from_at_most_64_texels_away) {
    char letters[201] = "A";
    memset(letters + 1, 'a', 199);
    const map across = spread_over(200, letters), down = spread_over(1, letters);
    for (int i = 1; i < 200; ++i) {
        assert_int_equal(across.from[i], i <= 64 ? 0 : NOWHERE);
        assert_int_equal(down.from[i], i <= 64 ? 0 : NOWHERE);
    }
}

TEST(no_texel_is_filled_from_another_chart) {
    /* another mesh touches; another chart of the same mesh does not */
    const map m = spread_over(10, "Aaaaaa    "
                                  "BBBBBB AAA"
                                  "          "
                                  "aaaaaaa   ");
    for (int i = 1; i <= 36; ++i) {
        assert_true((i > 5 && i < 30) || m.from[i] == (i <= 5 ? 0 : NOWHERE));
    }
    /* over two arms of one chart the way goes around, not across */
    const map arms = spread_over(9, "AAAAAAAA "
                                    "        A"
                                    "aaaaaaaa ");
    assert_int_equal(arms.from[25], 17);
    assert_int_equal(arms.from[18], 17);
}

TEST(texels_are_filled_from_the_nearest_valid_one_or_the_first_of_equals) {
    static const int FROM[21] = {NOWHERE, 0,  0,  0,  6,  6,  NOWHERE, /* */
                                 0,       0,  0,  0,  6,  6,  6,       /* */
                                 NOWHERE, 14, 14, 14, 20, 20, NOWHERE};
    const map m = spread_over(7, "AaaaaaA"
                                 "aaaaaaa"
                                 "AaaaaaA");
    assert_memory_equal(m.from, FROM, sizeof FROM);
}

TEST(values_are_copied_from_texels_that_have_one) {
    uint8_t states[4] = {VSHI_TEXEL_VALID, VSHI_TEXEL_INVALID, VSHI_TEXEL_INVALID, VSHI_TEXEL_INVALID};
    float values[8] = {1.0f, 2.0f, 0.0f, 0.0f, 0.0f, 0.0f, 5.0f, 6.0f};
    uint32_t texels[2] = {1, 2}, sources[2] = {0, 3}; /* the second one lost its value to a method */
    const vshi_spread spread = {2, texels, sources};
    const vshi_plane plane = {values, 2};
    vshi_spread_copy(&spread, states, &plane, 1);
    static const float AFTER[8] = {1.0f, 2.0f, 1.0f, 2.0f, 0.0f, 0.0f, 5.0f, 6.0f};
    assert_memory_equal(values, AFTER, sizeof values);
    assert_int_equal(states[1], VSHI_TEXEL_FILLED);
    assert_int_equal(states[2], VSHI_TEXEL_INVALID);
}

/* --- padding for mip levels: every texel holds a value, and levels hold the means of values alone */

/* A level of a mip map: means of 2 × 2 texels, of those within the image and in `mask`, where there is one.
 */
static void halve(size_t width, size_t height, size_t channels, const float *values, const uint8_t *mask,
                  float *coarse, uint8_t *coarse_mask) {
    const size_t columns = (width + 1) / 2, rows = (height + 1) / 2;
    for (size_t i = 0; i < columns * rows * channels; ++i) {
        const size_t x = i / channels % columns, y = i / channels / columns;
        float sum = 0.0f;
        int count = 0;
        for (size_t k = 0; k < 4; ++k) {
            const size_t column = 2 * x + k % 2, row = 2 * y + k / 2;
            if (column < width && row < height && (mask == NULL || mask[row * width + column] != 0)) {
                sum += values[(row * width + column) * channels + i % channels];
                ++count;
            }
        }
        coarse[i] = count > 0 ? sum / (float)count : HOLE;
        if (coarse_mask != NULL) {
            coarse_mask[i / channels] = count > 0;
        }
    }
}

static void pull_push(int32_t width, int32_t height, uint8_t *mask, float *values, size_t channels) {
    const vshi_plane plane = {values, channels};
    vshi_store store = {.run = NULL};
    assert_int_equal(vshi_pull_push(&store, NULL, width, height, mask, &plane, 1, NULL), VSH_OK);
    vshi_store_close(&store);
}

TEST(every_level_holds_the_means_of_values_alone) {
    const int32_t sizes[][2] = {{64, 64}, {1, 1}, {37, 90}, {128, 16}, {1, 77}, {255, 3}};
    for (size_t s = 0; s < COUNT_OF(sizes); ++s) {
        size_t width = (size_t)sizes[s][0], height = (size_t)sizes[s][1], count = width * height;
        FREED uint8_t *mask = calloc(count, 1), *means_mask = calloc(count, 1), *next_mask = calloc(count, 1);
        FREED float *filled = malloc(3 * count * sizeof *filled), *means = malloc(3 * count * sizeof *means);
        FREED float *next = malloc(3 * count * sizeof *next), *given = malloc(3 * count * sizeof *given);
        uint32_t random = 99;
        for (size_t i = 0; i < 3 * count; ++i) {
            random = random * 1664525u + 1013904223u;
            mask[i / 3] = i == 0 || (i % 3 != 0 ? mask[i / 3] != 0 : random >> 16 < 2500);
            filled[i] = means[i] = given[i] =
                mask[i / 3] != 0 ? 1.0f + (float)(random >> 8) * 0x1p-24f : HOLE;
        }
        memcpy(means_mask, mask, count);
        pull_push((int32_t)width, (int32_t)height, mask, filled, 3);
        for (size_t i = 0; i < 3 * count; ++i) {
            assert_true(filled[i] >= 1.0f && filled[i] < 2.0f);
            assert_true(mask[i / 3] == 0 || filled[i] == given[i]);
        }
        while (width > 1 || height > 1) {
            halve(width, height, 3, means, means_mask, next, next_mask);
            memcpy(means, next, 3 * count * sizeof *means);
            memcpy(means_mask, next_mask, count);
            halve(width, height, 3, filled, NULL, next, NULL);
            memcpy(filled, next, 3 * count * sizeof *filled);
            width = (width + 1) / 2;
            height = (height + 1) / 2;
            for (size_t i = 0; i < 3 * width * height; ++i) {
                assert_true(filled[i] >= 1.0f && filled[i] < 2.0f);
                assert_true(means_mask[i / 3] == 0 || fabsf(filled[i] - means[i]) < 1e-5f);
            }
        }
    }
}

TEST(a_plane_without_values_is_left) {
    uint8_t mask[12] = {0};
    float values[12];
    for (int i = 0; i < 12; ++i) {
        values[i] = HOLE;
    }
    pull_push(4, 3, mask, values, 1);
    assert_all_equal(values, 12, HOLE);
}

TEST(a_lightmap_is_filled_to_its_last_corner) {
    float uvs[8]; /* the floor's chart in a corner of the lightmap */
    for (int i = 0; i < 8; ++i) {
        uvs[i] = 0.1f + 0.2f * QUAD_UVS[i];
    }
    vsh_mesh mesh = floor_mesh(NULL);
    mesh.uvs = uvs;
    OWNED(vsh_charts) *charts = charts_of(&mesh, SIZE, 1, VSH_PADDING_AUTO),
                      *grown = charts_of(&mesh, SIZE, 1, 16);
    OWNED(vsh_field) *field = floor_field(0);
    const vsh_light light = sun((double[]){0.3, 1.0, 0.2}, 0.14);
    FREED planes *all = new_planes(), *other = new_planes();
    bake(field, charts, &light, &all->all, NULL, 1);
    bake(field, grown, &light, &other->all, NULL, 1);
    size_t beyond = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(all->coverage[i] == other->coverage[i]);
        if (other->ao[i] != 0.0f) { /* within 16 texels nothing else is done */
            assert_true(all->ao[i] == other->ao[i] && all->shadow[i] == other->shadow[i]);
            assert_memory_equal(all->irradiance + 3 * i, other->irradiance + 3 * i, 3 * sizeof(float));
        } else {
            assert_true(all->ao[i] > 0.0f && all->irradiance[3 * i + 2] > 0.0f);
            ++beyond;
        }
    }
    assert_true(beyond > TEXELS / 4);
}
