/* Heightfields as meshes, as images and as they are marched; they and spheres as layers, and texels within
 * them. */
#include "images.h"
#include "terrain.h"

#include "base/job.h"
#include "base/vec.h"
#include "field/field.h"
#include "geometry/solidity.h"
#include "scene/scene.h"
#include "shapes/heights.h"
#include "trace/trace.h"
#include "traced.h"
#include <vdbshade/occluders.h>
#include <vdbshade/scene.h>

enum { SIDE = 65 };

TEST(a_solid_is_closed_wound_outwards_and_of_its_volume) {
    FREED float *values = hills(SIDE, 40);
    vsh_heights_source source = source_of(values, SIDE, 40, 10.0, 2.0);
    source.base = 0.5;
    OWNED(vsh_model) *model = model_of(&source, VSH_HEIGHTS_SOLID);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    vsh_mesh_report report;
    assert_ok(vsh_mesh_check(&mesh, &report, &failure));
    assert_true(report.open_edges == 0 && report.flipped_edges == 0 && report.degenerate_triangles == 0);
    double volume = 0.0, lowest = INFINITY;
    for (size_t t = 0; t < mesh.triangle_count; ++t) {
        vshi_vec c[3];
        vshi_mesh_triangle(&mesh, t, c);
        volume += vshi_dot(c[0], vshi_cross(c[1], c[2])) / 6.0;
    }
    /* prisms over the two triangles of each cell */
    const double dx = source.size[0] / (SIDE - 1), dz = source.size[1] / 39;
    double expected = 0.0;
    for (int i = 0; i < SIDE * 40; ++i) {
        lowest = fmin(lowest, 2.0 * (double)values[i]);
    }
    for (int i = 0; i < 39; ++i) {
        for (int j = 0; j < SIDE - 1; ++j) {
            const float *h = values + i * SIDE + j;
            const double right = (double)(h[0] + h[1] + h[SIDE + 1]) / 3.0,
                         left = (double)(h[0] + h[SIDE] + h[SIDE + 1]) / 3.0;
            expected += dx * dz * (0.5 * 2.0 * (right + left) - (lowest - 0.5));
        }
    }
    assert_less(fabs(volume - expected), 1e-4 * expected);
}

TEST(a_surface_lies_under_its_lightmap_as_the_image_does) {
    /* one high sample, in row 1 of 4 and column 3 of 5 */
    float values[20] = {0};
    values[1 * 5 + 3] = 1.0f;
    const vsh_heights_source source = {
        .columns = 5, .rows = 4, .values = values, .size = {8, 6}, .height = 3};
    OWNED(vsh_model) *model = model_of(&source, VSH_HEIGHTS_SURFACE);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    for (size_t i = 0; i < 20; ++i) {
        const float *p = mesh.positions + 3 * i, *uv = mesh.uvs + 2 * i, *n = mesh.normals + 3 * i;
        const double x = -4.0 + 2.0 * (double)(i % 5), z = -3.0 + 2.0 * (double)(i / 5);
        assert_float_equal(p[0], x, 1e-6);
        assert_float_equal(p[1], i == 8 ? 3.0 : 0.0, 1e-6);
        assert_float_equal(p[2], z, 1e-6);
        assert_float_equal(uv[0], (x + 4.0) / 8.0, 1e-6);
        assert_float_equal(uv[1], 1.0 - (z + 3.0) / 6.0, 1e-6);
        /* the sample to the left of the high one rises by 3 over 4 units */
        assert_float_equal(n[0] / n[1], i == 7 ? -0.75 : i == 9 ? 1.5 : 0.0, 1e-5);
        assert_float_equal(n[2] / n[1], i == 3 ? -1.5 : i == 13 ? 0.75 : 0.0, 1e-5);
    }
}

TEST(a_surface_keeps_the_heights_beside_each_texel_s_middle) {
    static const struct {
        size_t texels, most; /* columns of texels, and of heights that are kept */
    } cases[] = {{1, 5}, {15, 33}, {16, 50}, {32, SIDE}, {100, SIDE}};
    FREED float *values = hills(SIDE, SIDE);
    const vsh_heights_source source = source_of(values, SIDE, SIDE, 10.0, 2.0);
    const vsh_run run = vsh_run_default();
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const size_t texels[2] = {cases[i].texels, 8};
        OWNED(vsh_model) *model = NULL;
        assert_ok(vshi_model_of_heights(&source, VSH_HEIGHTS_SURFACE, texels, &run, &model, &failure));
        const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
        vshi_terrain grid;
        assert_true(vshi_mesh_is_terrain(&mesh, &grid));
        assert_true(grid.columns <= cases[i].most && grid.rows <= 26);
        assert_true(mesh.uvs[0] == 0.0f && mesh.uvs[2 * (grid.columns - 1)] == 1.0f);
        for (size_t texel = 0; texel < texels[0]; ++texel) {
            const double middle = ((double)texel + 0.5) / (double)texels[0];
            size_t next = 1;
            while ((double)mesh.uvs[2 * next] < middle) {
                ++next;
            }
            /* one cell of the heights is all that lies between */
            assert_less((double)(mesh.uvs[2 * next] - mesh.uvs[2 * next - 2]) * (SIDE - 1), 1.001);
        }
    }
}

static int32_t stop(void *user, const char *stage, double fraction) {
    return 1;
}

/* A band of 100 voxels took ten minutes. */
TEST(a_band_that_would_take_minutes_is_refused_and_the_one_it_names_is_not) {
    enum { FINE = 257 };
    FREED float *values = hills(FINE, FINE);
    const vsh_heights_source source = source_of(values, FINE, FINE, 10.0, 2.0);
    OWNED(vsh_model) *model = model_of(&source, VSH_HEIGHTS_SOLID);
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 24;
    options.half_width = 100.0;
    OWNED(vsh_grid) *grid = NULL;
    assert_fails(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT, "");
    const char *most = strstr(failure.message, "use at most ");
    assert_non_null(strstr(failure.message, "half_width 100"));
    assert_non_null(most);
    /* cancelled as soon as it begins */
    options.half_width = atof(most + strlen("use at most "));
    const vsh_run run = run_watched(stop, NULL);
    assert_fails(vsh_grid_from_meshes(&mesh, 1, &options, &run, &grid, &failure), VSH_ERROR_CANCELLED, "");
    options.half_width = 12.0;
    assert_ok(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &failure));
}

/* A triangle's corners that begin elsewhere show the same, but the mesh is no terrain any more. */
static vsh_mesh reindexed(const vsh_mesh *mesh, uint32_t *indices) {
    vsh_mesh other = *mesh;
    memcpy(indices, mesh->indices, 3 * mesh->triangle_count * sizeof *indices);
    for (int k = 0; k < 3; ++k) {
        indices[k] = mesh->indices[(k + 1) % 3];
    }
    other.indices = indices;
    return other;
}

TEST(a_terrain_is_solid_or_open_as_its_triangles_are) {
    static const double mirrors[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    FREED float *values = hills(SIDE, 40);
    const vsh_heights_source source = source_of(values, SIDE, 40, 10.0, 2.0);
    FREED uint32_t *indices = malloc(16 * SIDE * 40 * sizeof *indices);
    assert_non_null(indices);
    for (int i = 0; i < 4; ++i) {
        OWNED(vsh_model) *model = model_of(&source, i % 2 == 0 ? VSH_HEIGHTS_SOLID : VSH_HEIGHTS_SURFACE);
        vsh_mesh meshes[2] = {vsh_model_mesh(model, 0, -1)};
        meshes[0].transform = i < 2 ? NULL : mirrors;
        meshes[1] = reindexed(&meshes[0], indices);
        vshi_terrain terrain;
        assert_true(vshi_mesh_is_terrain(&meshes[0], &terrain) &&
                    !vshi_mesh_is_terrain(&meshes[1], &terrain));
        const vsh_run run = vsh_run_default();
        vshi_solidity *found[2];
        const vshi_component *c[2];
        for (int k = 0; k < 2; ++k) {
            assert_int_equal(vshi_solidity_create(&meshes[k], 1, &run, &found[k], NULL), VSH_OK);
            assert_int_equal(found[k]->count, 1);
            c[k] = found[k]->components;
        }
        assert_int_equal(c[0]->kind, i % 2 == 0 ? VSHI_KIND_SOLID : VSHI_KIND_SHEET);
        assert_true(c[0]->kind == c[1]->kind && c[0]->vessel == c[1]->vessel);
        assert_true(c[0]->open_edges == c[1]->open_edges && c[0]->area == c[1]->area);
        assert_true(fabs(c[0]->volume - c[1]->volume) <= 1e-9 * c[0]->area);
        assert_memory_equal(vshi_solidity_sides(found[0], 0), vshi_solidity_sides(found[1], 0),
                            meshes[0].triangle_count);
        vshi_solidity_free(found[0]);
        vshi_solidity_free(found[1]);
    }
}

/* From anywhere to anywhere, some upright, some along the grid. */
static vshi_segment_ray random_ray(const vshi_triangles *of, int number, uint32_t *seed) {
    double low[3], high[3], square = 0.0;
    vshi_triangles_bounds(of, low, high);
    vshi_segment_ray ray = {.far = number % 3 == 0 ? INFINITY : 0.0};
    for (int k = 0; k < 3; ++k) {
        const double side = high[k] - low[k];
        ray.origin[k] = low[k] + (1.4 * next_random(seed) - 0.2) * side;
        ray.direction[k] = number % 8 == 0 && k != number / 8 % 3 ? 0.0 : next_random(seed) - 0.5;
        square += ray.direction[k] * ray.direction[k];
    }
    for (int k = 0; k < 3; ++k) {
        ray.direction[k] /= sqrt(square);
    }
    ray.far = ray.far > 0.0 ? ray.far : 4.0 * next_random(seed);
    return ray;
}

TEST(rays_meet_a_large_terrain_as_they_meet_its_triangles) {
    enum { RAYS = 20000, COLUMNS = 500, ROWS = 530 }; /* at least 2^19 triangles */
    static const double transforms[][12] = {
        {-0.6, 0.8, 0, 5, 0.8, 0.6, 0, 1e3, 0, 0, 1, 0},       /* mirrored, and tilted */
        {1e-3, 2e-4, 0, 0, 0, 4e-3, 0, 0, 1e-4, 0, 1e-3, 0.1}, /* sheared */
    };
    FREED float *values = hills(COLUMNS, ROWS);
    const vsh_heights_source source = source_of(values, COLUMNS, ROWS, 10.0, 2.0);
    OWNED(vsh_model) *model = model_of(&source, VSH_HEIGHTS_SOLID);
    FREED uint32_t *indices = malloc(8 * ROWS * COLUMNS * sizeof *indices);
    assert_non_null(indices);
    for (size_t i = 0; i < COUNT_OF(transforms); ++i) {
        vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
        mesh.transform = transforms[i];
        const vsh_mesh other = reindexed(&mesh, indices);
        OWNED(vshi_triangles) *terrain = triangles_from(&mesh, 1), *triangles = triangles_from(&other, 1);
        assert_less(vshi_triangles_bytes(terrain), vshi_triangles_bytes(triangles) * 3 / 4);
        uint32_t seed = (uint32_t)i;
        int apart[4] = {0};
        for (int k = 0; k < RAYS; ++k) {
            const vshi_segment_ray ray = random_ray(triangles, k, &seed);
            bool blocked[2], backs[2];
            uint8_t meets[2];
            vshi_triangles *const both[2] = {terrain, triangles};
            for (int b = 0; b < 2; ++b) {
                vshi_triangles_blocked(both[b], &ray, 1, &blocked[b]);
                vshi_triangles_meet_backs(both[b], &ray, 1, &backs[b]);
                vshi_triangles_meet(both[b], &ray, 1, &meets[b]);
            }
            apart[0] += blocked[0] != blocked[1];
            apart[1] += backs[0] != backs[1];
            apart[2] += meets[0] != meets[1];
            apart[3] += vshi_triangles_depth(terrain, &ray) != vshi_triangles_depth(triangles, &ray);
            const double near = vshi_triangles_distance(terrain, &ray);
            if (blocked[0] && blocked[1] && meets[0] == meets[1]) {
                assert_true(fabs(near / vshi_triangles_distance(triangles, &ray) - 1.0) < 1e-2);
            }
        }
        for (int k = 0; k < 4; ++k) { /* rays that graze an edge */
            assert_less(apart[k], RAYS / 1000);
        }
    }
}

static vsh_caster terrain_caster(const char *path, double width, double depth, double height) {
    vsh_caster caster = vsh_caster_default();
    caster.type = VSH_CASTER_HEIGHTFIELD;
    caster.path = path;
    caster.size[0] = width;
    caster.size[1] = depth;
    caster.height = height;
    return caster;
}

/* A scene of one heightfield caster over an image in the tests' folder. */
static vsh_result load(const char *path, vsh_assets **assets, vsh_error *error) {
    vsh_caster caster = terrain_caster(path, 3.0, 2.0, 4.0);
    vsh_scene scene = vsh_scene_default();
    scene.casters = &caster;
    scene.caster_count = 1;
    scene.shade = preview_options();
    return vsh_assets_load(&scene, NULL, assets, error);
}

/* A round hill, which differs by its number. */
static float smooth_hill(int number, int column, int row) {
    const double x = (double)column / (SIDE - 1) - 0.5, z = (double)row / (SIDE - 1) - 0.5;
    const double wide = 0.1 + 0.02 * number, off = 0.05 * number - 0.2;
    return (float)exp(-((x - off) * (x - off) + (z + off) * (z + off) * (1.0 + 0.3 * number)) /
                      (wide * wide));
}

/* Marches had dark lumps on the flanks. */
TEST(no_point_of_eight_smooth_hills_is_off_by_a_tenth_from_rays_by_default) {
    enum { FACES = 2 * (SIDE - 1) * (SIDE - 1), POINTS = FACES / 3 + 1, RAYS = 256 };
    static float values[SIDE * SIDE], normals[3 * POINTS], shadow[POINTS], ao[POINTS], truth[2][POINTS];
    static double positions[3 * POINTS];
    static const double towards[3] = {-1.0, 0.5, 0.0};
    const vsh_light light = sun(towards, RADIANS(4.0));
    for (int hill = 0; hill < 8; ++hill) {
        for (int i = 0; i < SIDE * SIDE; ++i) {
            values[i] = smooth_hill(hill, i % SIDE, i / SIDE);
        }
        const float *const view = values;
        static const char *const name = "Y";
        const vsh_image image = {SIDE, SIDE, 1, &name, &view, NULL};
        vsh_image_options write = vsh_image_options_default();
        write.bits = 32;
        assert_ok(vsh_image_write(at("hill.exr"), &image, &write, &failure));
        const vsh_heights_source source = source_of(values, SIDE, SIDE, 10.0, 2.0);
        OWNED(vsh_model) *model = model_of(&source, VSH_HEIGHTS_SOLID);
        const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
        vsh_points points = {0, positions, normals, NULL};
        for (size_t i = 0; i < FACES; i += 3, ++points.count) {
            stand_on(&mesh, i, 1.0 / 3.0, 1.0 / 3.0, points.count, positions, normals);
        }
        truth_mesh *rays = truth_mesh_create(&mesh, 1);
        if (rays != NULL) {
            vsh_caster caster = terrain_caster(at("hill.exr"), 10.0, 10.0, 2.0);
            caster.direct = 1;
            vsh_scene scene = vsh_scene_default();
            scene.casters = &caster;
            scene.caster_count = 1;
            scene.lights = &light;
            scene.light_count = 1;
            scene.ao = 1;
            scene.shade.ao_distance = 1.0;
            OWNED(vsh_assets) *assets = NULL;
            OWNED(vsh_occluders) *occluders = NULL;
            assert_ok(vsh_assets_load(&scene, NULL, &assets, &failure));
            assert_ok(vsh_scene_occluders(&scene, assets, NULL, NULL, &occluders, &failure));
            assert_ok(vsh_shade_shadow(occluders, &points, &light, &scene.shade, NULL, shadow, NULL, NULL,
                                       &failure));
            assert_ok(vsh_shade_ao(occluders, &points, &scene.shade, NULL, ao, NULL, NULL, NULL, &failure));
            truth_mesh_light(rays, points.count, positions, normals, towards, tan(RADIANS(2.0)), RAYS, 0,
                             truth[0]);
            truth_mesh_ao(rays, points.count, positions, normals, 1.0, RAYS, 0, truth[1]);
            assert_less(truth_compare(points.count, shadow, truth[0], NULL).max, 0.1);
            assert_less(truth_compare(points.count, ao, truth[1], NULL).max, 0.1);
        }
        truth_mesh_free(rays);
    }
}

TEST(images_of_8_16_and_32_bits_are_read) {
    static const struct {
        const char *name;
        int32_t bits, channels;
        double tolerance;
        float scale;
    } cases[] = {
        {"8.png", 8, 1, 4.0 / 510.0 + 1e-6, 1.0f},
        {"16.png", 16, 1, 4.0 / 131070.0 + 1e-6, 1.0f},
        {"16.tif", 16, 1, 4.0 / 131070.0 + 1e-6, 1.0f},
        {"32.exr", 32, 1, 1e-5, 1.0f},
        {"large.exr", 32, 1, 1e-2, 1000.0f},
        {"below.tif", 32, 1, 1e-4, -7.0f},
        {"rgb.png", 16, 3, 4.0 / 131070.0 + 1e-5, 1.0f},
    };
    static const char *const rgb[] = {"R", "G", "B"}, *const grey[] = {"Y"};
    for (size_t k = 0; k < COUNT_OF(cases); ++k) {
        const bool color = cases[k].channels == 3;
        float planes[3][12];
        const float *const views[3] = {planes[0], planes[1], planes[2]};
        for (int i = 0; i < 36; ++i) {
            planes[i / 12][i % 12] = cases[k].scale * (float)(i % 12 * (i / 12 + 1)) / 36.0f;
        }
        const vsh_image image = {4, 3, cases[k].channels, color ? rgb : grey, views, NULL};
        vsh_image_options options = vsh_image_options_default();
        options.bits = cases[k].bits;
        options.pack = color || strstr(cases[k].name, ".exr") != NULL ? NULL : "R=Y,G=Y,B=Y";
        assert_ok(vsh_image_write(at(cases[k].name), &image, &options, &failure));
        OWNED(vsh_assets) *assets = NULL;
        assert_ok(load(at(cases[k].name), &assets, &failure));
        size_t count = 0;
        const vsh_mesh *mesh = vsh_assets_caster(assets, 0, &count);
        assert_int_equal(count, 1);
        for (size_t i = 0; i < 12; ++i) { /* of colours, their luminance */
            const double weight = color ? 0.2126 + 2 * 0.7152 + 3 * 0.0722 : 1.0;
            const double expected = 4.0 * (double)cases[k].scale * weight * (double)i / 36.0;
            assert_float_equal(mesh->positions[3 * i + 1], expected, cases[k].tolerance);
        }
    }
}

TEST(bad_images_are_refused_with_their_place) {
    static const struct {
        const char *name;
        float value; /* of one texel */
        int32_t height;
        const char *part;
    } cases[] = {{"nan.exr", NAN, 3, "nan.exr: row 1, column 3: value"},
                 {"huge.exr", 3e38f, 3, "row 1, column 3"}, /* finite, but not four times that */
                 {"line.exr", 0.0f, 1, "4 × 1 pixels"}};
    vsh_assets *assets = NULL;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        static const char *const names[] = {"Y"};
        const float values[12] = {[7] = cases[i].value}, *const views[1] = {values};
        const vsh_image image = {4, cases[i].height, 1, names, views, NULL};
        assert_ok(vsh_image_write(at(cases[i].name), &image, NULL, &failure));
        assert_fails(load(at(cases[i].name), &assets, &failure), VSH_ERROR_INPUT, cases[i].part);
        assert_null(assets);
    }
    assert_fails(load(at("none.png"), &assets, &failure), VSH_ERROR_READ, "");
}

TEST(bad_sources_are_refused) {
    static const double shear[12] = {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    static const float values[4] = {0, 1, 2, 3}, nan[4] = {0, 1, NAN, 3};
    const struct {
        int32_t columns, rows;
        double size[2], height, base;
        const float *values;
        const double *transform;
        const char *message;
    } cases[] = {
        {1, 2, {1, 1}, 1, 1, values, NULL, "columns 1 is out of range 2 … 65536"},
        {-4, 2, {1, 1}, 1, 1, values, NULL, "columns -4 is out of range"},
        {0, 0, {1, 1}, 1, 1, values, NULL, "columns 0 is out of range"},
        {2, INT32_MAX, {1, 1}, 1, 1, values, NULL, "rows 2.14748e+09 is out of range"},
        {2, 2, {0, 1}, 1, 1, values, NULL, "size[0] 0 is out of range"},
        {2, 2, {1, NAN}, 1, 1, values, NULL, "size[1] nan is out of range"},
        {2, 2, {1e13, 1}, 1, 1, values, NULL, "size[0] 1e+13 is out of range"},
        {2, 2, {1, 1}, INFINITY, 1, values, NULL, "height inf is out of range"},
        {2, 2, {1, 1}, 1, -1, values, NULL, "base -1 is out of range"},
        {2, 2, {1, 1}, 1, 1, nan, NULL, "row 1, column 0: value nan"},
        {2, 2, {1, 1}, 1, 1, NULL, NULL, "values is NULL"},
        {2, 2, {1, 1}, 1, 1, values, shear, "transform must be finite and neither shear"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const vsh_heights_source source = {.columns = cases[i].columns,
                                           .rows = cases[i].rows,
                                           .values = cases[i].values,
                                           .size = {cases[i].size[0], cases[i].size[1]},
                                           .height = cases[i].height,
                                           .base = cases[i].base,
                                           .transform = cases[i].transform};
        const vsh_result code = source.values == nan ? VSH_ERROR_INPUT : VSH_ERROR_ARGUMENT;
        vshi_heights *heights = NULL;
        vsh_model *model = NULL;
        assert_fails(vshi_heights_create(&source, NULL, &heights, &failure), code, cases[i].message);
        assert_null(heights);
        if (cases[i].transform == NULL) { /* a mesh may be sheared */
            assert_fails(vsh_model_from_heights(&source, VSH_HEIGHTS_SOLID, NULL, &model, &failure), code,
                         "");
            assert_null(model);
        }
    }
}

TEST(the_memory_limit_is_the_memory_of_heights) {
    FREED float *values = hills(SIDE, SIDE);
    const vsh_heights_source source = source_of(values, SIDE, SIDE, 10.0, 2.0);
    OWNED(vshi_heights) *heights = NULL;
    for (int enough = 0; enough < 2; ++enough) {
        const vsh_run run = run_within((enough ? 5 : 3) * SIDE * SIDE);
        assert_fails(vshi_heights_create(&source, &run, &heights, &failure),
                     enough ? VSH_OK : VSH_ERROR_LIMIT, "");
    }
    vshi_heights_info info;
    vshi_heights_get_info(heights, &info);
    assert_at_most(info.bytes, 5 * SIDE * SIDE);
}

/* --- heightfields that are marched as they are, by the methods hard and classic */

enum { WIDE = 129, POINTS = 3000 };

typedef struct stage {
    float *values;
    vshi_heights *heights;
    vsh_model *model;
    truth_mesh *truth;
    double positions[3 * POINTS];
    float normals[3 * POINTS];
} stage;

/* Hills, and points on triangles of their top, which the first are. */
static stage set_up(const double *transform) {
    stage s = {.values = hills(WIDE, WIDE)};
    vsh_heights_source source = source_of(s.values, WIDE, WIDE, 10.0, 2.0);
    source.transform = transform;
    s.heights = heights_of(&source);
    s.model = model_of(&source, VSH_HEIGHTS_SOLID);
    const vsh_mesh mesh = vsh_model_mesh(s.model, 0, -1);
    s.truth = truth_mesh_create(&mesh, 1);
    uint64_t counter = 1;
    for (size_t i = 0; i < POINTS; ++i) {
        const size_t face = (size_t)between(&counter, 0.0, 2.0 * (WIDE - 1) * (WIDE - 1) - 0.001);
        const double b = uniform(&counter), c = uniform(&counter);
        const bool over = b + c > 1.0;
        stand_on(&mesh, face, over ? 1.0 - b : b, over ? 1.0 - c : c, i, s.positions, s.normals);
    }
    return s;
}

static void tear_down(stage *s) {
    truth_mesh_free(s->truth);
    vsh_model_free(s->model);
    vshi_heights_free(s->heights);
    free(s->values);
}

static void shadow(const stage *s, const vsh_light *light, int32_t method, float *values) {
    const vsh_points points = {POINTS, s->positions, NULL, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vshi_heights_shadow(s->heights, light, method, &points, 0, POINTS, 0.0, values, &stats);
    assert_true(stats.samples > 0);
}

TEST(a_hard_march_is_the_ray_but_for_ridges_narrower_than_its_step) {
    /* turned, mirrored, three times as large */
    static const double transform[12] = {0, 0, -3, 100, 0, 3, 0, -40, -3, 0, 0, 7};
    static const double directions[][3] = {
        {-0.9, 0.2, 0.35}, {0.3, 0.6, -0.7}, {0.05, 1.0, 0.02}, {-0.9, -0.05, 0.35}};
    for (int turned = 0; turned < 2; ++turned) {
        FREED_BY(tear_down) stage s = set_up(turned ? transform : NULL);
        for (size_t d = 0; d < COUNT_OF(directions); ++d) {
            const vsh_light light = sun(directions[d], RADIANS(3.0));
            static float values[POINTS], truth[POINTS];
            shadow(&s, &light, VSH_SHADOW_HARD, values);
            truth_mesh_light(s.truth, POINTS, s.positions, NULL, directions[d], 0.0, 1, 0, truth);
            size_t differ = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                differ += values[i] != truth[i];
            }
            assert_at_most(differ, POINTS / 50);
        }
    }
}

/* A plateau of height 4 from x = 0 on, seen from the ground before it: h / (w t) is least at its edge, or
 * where the ray leaves the terrain's height. */
TEST(a_classic_march_is_the_least_height_over_the_cone_s_width) {
    float plateau[65 * 9];
    for (int i = 0; i < 65 * 9; ++i) {
        plateau[i] = i % 65 >= 32 ? 1.0f : 0.0f;
    }
    const vsh_heights_source source = {
        .columns = 65, .rows = 9, .values = plateau, .size = {64, 8}, .height = 4, .base = 1};
    OWNED(vshi_heights) *heights = heights_of(&source);
    static const double towards[3] = {1.0, 0.5, 0.0};
    const double w = 0.2;
    const vsh_light light = sun(towards, 2.0 * atan(w));
    for (int i = 0; i < 29; ++i) {
        const double x = -30.0 + i, position[3] = {x, 0.0, 0.0}, unit = sqrt(1.25);
        /* how high the ray is at the edge, and how far that is along it */
        const double gap = -0.5 * x - 4.0, far = -x * unit, expected = fmin(fmax(gap / (w * far), 0.0), 1.0);
        const vsh_points points = {1, position, NULL, NULL};
        vsh_shade_stats stats = vsh_shade_stats_zero();
        float value[2];
        vshi_heights_shadow(heights, &light, VSH_SHADOW_CLASSIC, &points, 0, 1, 0.0, &value[0], &stats);
        vshi_heights_shadow(heights, &light, VSH_SHADOW_HARD, &points, 0, 1, 0.0, &value[1], &stats);
        if (fabs(gap) > 0.01) {
            assert_float_equal(value[1], gap > 0.0 ? 1.0 : 0.0, 1e-6);
        }
        assert_float_equal(value[0], expected, 0.1); /* it steps over the edge */
    }
}

/* --- terrains and spheres as layers, and from scene files to lightmaps */

/* Of three points one is no number, one is above all and one is within. */
TEST(layers_of_heights_and_spheres_are_marched_by_hard_and_classic_alone) {
    static const double ball[4] = {0, 0, 0, 1}, positions[9] = {NAN, 0, 0, 0, 5, 0, 0, -0.3, 0};
    FREED float *samples = hills(SIDE, SIDE);
    const vsh_heights_source source = source_of(samples, SIDE, SIDE, 10.0, 1.5);
    OWNED(vshi_heights) *heights = heights_of(&source);
    OWNED(vshi_spheres) *spheres = NULL;
    assert_ok(vshi_spheres_create(ball, 1, NULL, NULL, &spheres, &failure));
    OWNED(vsh_field) *empty = field_of_nothing(1e-5);
    const vsh_points points = {3, positions, NULL, NULL};
    const vsh_light light = vsh_light_default();
    for (int which = 0; which < 2; ++which) {
        vshi_layer layer = vshi_layer_default();
        layer.heights = which == 0 ? heights : NULL;
        layer.spheres = which == 1 ? spheres : NULL;
        for (layer.method = 0; layer.method <= VSH_SHADOW_AUTO; ++layer.method) {
            const bool marched = layer.method == VSH_SHADOW_HARD || layer.method == VSH_SHADOW_CLASSIC;
            float value[3];
            assert_fails(vsh_shade_shadow(occluders_with(empty, &layer, 1), &points, &light, NULL, NULL,
                                          value, NULL, NULL, &failure),
                         marched ? VSH_OK : VSH_ERROR_ARGUMENT,
                         "layer 0: heights and spheres are shaded by the methods hard and classic");
            assert_true(!marched || (isnan(value[0]) && value[1] == 1.0f && value[2] == 0.0f));
        }
    }
}

/* Bakes the floor under casters given as JSON; coverage of its texels. */
static void bake_floor(const char *casters, float *shadow, float *coverage, int32_t side) {
    char text[1024];
    snprintf(text, sizeof text,
             "{\"casters\":[%s],\"method\":\"hard\",\"lights\":[{\"name\":\"sun\",\"type\":\"directional\","
             "\"direction\":[0,1,0]}],"
             "\"receivers\":[{\"mesh\":\"seeds_floor.obj\",\"output\":\"none.exr\"}]}",
             casters);
    OWNED(vsh_scene) *scene = NULL;
    OWNED(vsh_assets) *assets = NULL;
    assert_ok(vshi_scene_parse(VSH_ASSETS "/scene.json", text, strlen(text), &scene, &failure));
    assert_ok(vsh_assets_load(scene, NULL, &assets, &failure));
    vshi_layer layer = vshi_layer_default();
    layer.heights = vshi_assets_caster(assets, 0)->heights;
    layer.spheres = vshi_assets_caster(assets, 0)->spheres;
    layer.method = VSH_SHADOW_HARD;
    vsh_shade_options shade = preview_options();
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = side;
    options.padding = 0;
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_receiver(assets, 0, &count);
    OWNED(vsh_charts) *texels = charts_from(meshes, count, &options);
    static const double high[3] = {0.0, 1.0, 0.0};
    const vsh_light light = sun(high, 0.1);
    float *const planes[1] = {shadow};
    vsh_lightmap lightmap = {.shadow = planes, .coverage = coverage};
    OWNED(vsh_field) *empty = field_of_nothing(1e-5);
    assert_ok(vsh_bake_lightmap(occluders_with(empty, &layer, 1), texels, &light, 1, &shade, NULL, &lightmap,
                                NULL, &failure));
}

TEST(texels_within_a_sphere_or_a_terrain_are_not_valid) {
    enum { TEXELS = 64 };
    static float shadow[TEXELS * TEXELS], coverage[TEXELS * TEXELS];
    /* a ball through the floor: its section is a disc of radius 1 of the floor's 5 × 5 */
    bake_floor("{\"spheres\":[[0,0.75,0,1.25]]}", shadow, coverage, TEXELS);
    size_t invalid = 0, dark = 0;
    for (size_t i = 0; i < TEXELS * TEXELS; ++i) {
        invalid += coverage[i] == 0.0f;
        dark += coverage[i] == 1.0f && shadow[i] == 0.0f;
    }
    const double texel = 25.0 / (TEXELS * TEXELS);
    assert_less(fabs((double)invalid * texel - PI), 0.1);
    /* under the middle of the sun a ball's hard shadow is as wide as the ball */
    assert_less(fabs((double)(dark + invalid) * texel - PI * 1.25 * 1.25), 0.05);
    /* a terrain that is higher than the floor all over one side of it */
    bake_floor("{\"heightfield\":\"terrain.png\",\"size\":[5,20],\"height\":1,\"direct\":true,"
               "\"transform\":{\"translate\":[2.5,-0.05,0]}}",
               shadow, coverage, TEXELS);
    double covered = 0.0;
    for (size_t i = 0; i < TEXELS * TEXELS; ++i) {
        covered += (double)coverage[i];
    }
    assert_true(covered > 0.4 * TEXELS * TEXELS && covered < 0.6 * TEXELS * TEXELS);
}

FIXTURE(make_folder, remove_folder)
