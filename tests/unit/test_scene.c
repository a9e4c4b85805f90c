/* Scenes: what their keys become. test_scene_errors.c has what is refused. */
#include "sandbox/reader.h"
#include "scenes.h"
#include <cmocka.h>
#include <jansson.h>
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <vdbshade/flat.h>
#include <vdbshade/scene.h>

static const double PI = 3.14159265358979323846;

static void assert_near(double found, double expected, double tolerance) {
    if (!(fabs(found - expected) <= tolerance)) {
        fail_msg("found %.17g, expected %.17g within %g", found, expected, tolerance);
    }
}

static void assert_vector(const double *found, double x, double y, double z) {
    assert_near(found[0], x, 1e-14);
    assert_near(found[1], y, 1e-14);
    assert_near(found[2], z, 1e-14);
}

static void assert_point(const double *m, const double *p, double x, double y, double z) {
    const double q[3] = {
        m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
        m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
        m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11],
    };
    assert_vector(q, x, y, z);
}

static void the_seeds_scene_is_the_one_of_the_techniques(void **state) {
    (void)state;
    vsh_scene *scene = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_scene_read(seeds_path, NULL, &scene, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    assert_int_equal(scene->caster_count, 1);
    assert_int_equal(scene->casters[0].type, VSH_CASTER_SDF);
    const vsh_sdf sdf = scene->casters[0].sdf;
    assert_int_equal(sdf.node_count, 9); /* five shapes, joined by four unions */
    const vsh_sdf_node *n = sdf.nodes;
    assert_int_equal(n[0].shape, VSH_SDF_PLANE);
    assert_vector(n[0].size, 3.0, 0.5, 3.0);
    assert_int_equal(n[1].shape, VSH_SDF_SPHERE);
    assert_true(n[1].radius == 0.5);
    assert_vector(n[1].translation, 0.0, 0.8, 0.0);
    assert_int_equal(n[2].shape, VSH_SDF_UNION);
    assert_int_equal(n[2].left, 0);
    assert_int_equal(n[2].right, 1);
    assert_int_equal(n[3].shape, VSH_SDF_BOX);
    assert_vector(n[3].size, 0.3, 0.3, 0.3);
    assert_true(n[3].rounding == 0.05);
    assert_vector(n[3].translation, -1.2, 0.7, 0.5);
    assert_int_equal(n[5].shape, VSH_SDF_TORUS);
    assert_true(n[5].radius == 0.4 && n[5].minor_radius == 0.08);
    assert_vector(n[5].translation, 1.2, 0.6, -0.3);
    assert_int_equal(n[7].shape, VSH_SDF_BOX);
    assert_vector(n[7].size, 0.05, 1.0, 0.05);
    assert_true(n[7].rounding == 0.0);
    assert_vector(n[7].translation, 0.3, 1.0, 1.5);
    assert_int_equal(n[8].shape, VSH_SDF_UNION);
    assert_int_equal(n[8].left, 6);
    assert_int_equal(n[8].right, 7);
    assert_true(scene->grid.voxel_size == 0.02);
    assert_int_equal(scene->light_count, 1);
    assert_string_equal(scene->lights[0].name, "sun");
    assert_int_equal(scene->lights[0].type, VSH_LIGHT_DIRECTIONAL);
    assert_vector(scene->lights[0].direction, -0.5, 0.6, -0.6);
    assert_near(tan(scene->lights[0].angle / 2.0), 0.1, 1e-15);
    assert_int_equal(scene->receiver_count, 1);
    assert_string_equal(scene->receivers[0].path, VSH_ASSETS "/seeds_floor.obj");
    assert_string_equal(scene->receivers[0].output, VSH_ASSETS "/seeds.exr");
    assert_int_equal(scene->receivers[0].width, 512);
    assert_int_equal(scene->receivers[0].height, 512);
    vsh_scene_free(scene);
}

static void every_key_lands_in_its_field(void **state) {
    (void)state;
    vsh_scene *scene = parse("dir/x/scene.json", full_scene);
    assert_int_equal(scene->caster_count, 6);
    const vsh_caster *c = scene->casters;
    assert_int_equal(c[0].type, VSH_CASTER_MESH);
    assert_string_equal(c[0].path, "dir/x/a.glb");
    const double unit[3] = {1.0, 1.0, 1.0};
    /* scaled to (2, 3, 4), turned about y so that z goes to x and x to -z, then moved */
    assert_point(c[0].transform, unit, 4.0 + 1.0, 3.0 + 2.0, -2.0 + 3.0);
    assert_int_equal(c[1].type, VSH_CASTER_VDB);
    assert_string_equal(c[1].path, "/data/b.vdb");
    assert_string_equal(c[1].grid, "rock");
    assert_point(c[1].transform, unit, 4.0, 7.0, 8.0);
    assert_string_equal(c[2].path, "dir/x/../c.vdb");
    assert_null(c[2].grid);
    assert_point(c[2].transform, unit, 1.0, 1.0, 1.0);
    assert_int_equal(c[3].type, VSH_CASTER_SDF);
    assert_point(c[3].transform, unit, -0.5, 0.5, 0.5);
    assert_int_equal(c[4].type, VSH_CASTER_MASK);
    assert_string_equal(c[4].path, "dir/x/m.png");
    assert_true(c[4].mask.width == 2.0 && c[4].mask.height == 3.0 && c[4].thickness == 0.5);
    assert_true(c[4].mask.threshold == 0.25 && c[4].mask.invert != 0);
    assert_string_equal(c[4].mask.channel, "red");
    assert_point(c[4].transform, unit, 2.0, 2.0, 2.0);
    assert_int_equal(c[5].type, VSH_CASTER_TEXT);
    assert_string_equal(c[5].path, "dir/x/f.ttf");
    assert_string_equal(c[5].text, "a\nb");
    assert_true(c[5].letters.height == 2.0 && c[5].letters.line_spacing == 1.5 && c[5].thickness == 0.25);
    assert_int_equal(c[5].letters.align, VSH_ALIGN_RIGHT);

    assert_int_equal(c[3].sdf.node_count, 9);
    const vsh_sdf_node *n = c[3].sdf.nodes;
    static const struct {
        int32_t shape, left, right;
    } expected[] = {{VSH_SDF_CAPSULE, -1, -1}, {VSH_SDF_CYLINDER, -1, -1},   {VSH_SDF_SMOOTH_UNION, 0, 1},
                    {VSH_SDF_CONE, -1, -1},    {VSH_SDF_SMOOTH_UNION, 2, 3}, {VSH_SDF_CONE, -1, -1},
                    {VSH_SDF_BOX, -1, -1},     {VSH_SDF_INTERSECTION, 5, 6}, {VSH_SDF_SUBTRACTION, 4, 7}};
    for (size_t i = 0; i < 9; ++i) {
        assert_int_equal(n[i].shape, expected[i].shape);
        assert_int_equal(n[i].left, expected[i].left);
        assert_int_equal(n[i].right, expected[i].right);
    }
    assert_true(n[0].size[1] == 1.5 && n[0].radius == 0.75);
    assert_true(n[1].size[1] == 2.5 && n[1].radius == 1.75);
    assert_true(n[2].smoothing == 0.25 && n[4].smoothing == 0.25);
    assert_true(n[3].size[1] == 3.5 && n[3].radius == 2.75 && n[3].minor_radius == 0.5);
    assert_true(n[5].minor_radius == 0.0);
    assert_vector(n[6].size, 1.0, 2.0, 3.0);
    assert_vector(n[2].rotation, 0.0, 0.0, 0.0); /* only the last of a fold is turned */
    assert_vector(n[4].rotation, sqrt(0.5), 0.0, 0.0);
    assert_near(n[4].rotation[3], sqrt(0.5), 1e-15);
    assert_vector(n[8].rotation, 0.0, 2.0, 0.0);
    assert_true(n[8].scale == 3.0 && n[7].scale == 1.0);
    assert_vector(n[8].translation, 9.0, 8.0, 7.0);

    assert_true(scene->grid.voxel_size == 0.0);
    assert_int_equal(scene->grid.resolution, 64);
    assert_true(scene->grid.half_width == 4.5 && scene->grid.shell_thickness == 3.0);
    assert_int_equal(scene->light_count, 3);
    const vsh_light *l = scene->lights;
    assert_vector(l[0].direction, 0.0, 2.0, 0.0);
    assert_vector(l[0].color, 3.0, 2.0, 1.0);
    assert_true(l[0].angle == vsh_light_default().angle);
    assert_int_equal(l[1].type, VSH_LIGHT_SPHERE);
    assert_vector(l[1].position, 1.0, 2.0, 3.0);
    assert_true(l[1].radius == 0.125 && l[1].reach == 12.0);
    assert_int_equal(l[1].falloff, VSH_FALLOFF_QUADRATIC);
    assert_vector(l[1].color, 1.0, 1.0, 1.0);
    assert_int_equal(l[2].type, VSH_LIGHT_SPOT);
    assert_string_equal(l[2].name, "head_-9");
    assert_vector(l[2].axis, 0.0, -1.0, 0.0);
    assert_vector(l[2].direction, 0.0, 1.0, 0.0); /* a sun's, as it was */
    assert_near(l[2].inner_angle, PI / 6.0, 1e-15);
    assert_true(l[2].outer_angle == PI);
    assert_int_equal(l[2].falloff, VSH_FALLOFF_INVERSE_SQUARE);
    assert_int_equal(scene->ao, 1);
    assert_int_equal(scene->irradiance, 1);
    assert_true(scene->shade.ao_distance == 2.5);
    assert_int_equal(scene->shade.ao_method, VSH_AO_CONES);
    assert_int_equal(scene->shade.ao_cones, 32);
    assert_int_equal(scene->shade.method, VSH_SHADOW_SMOOTH);
    assert_int_equal(scene->shade.rays, 77);
    assert_int_equal(scene->shade.sampler, VSH_SAMPLER_BLUE);
    assert_int_equal(scene->shade.frame, 5);
    assert_int_equal(scene->shade.early_rays, 4);
    assert_true(scene->shade.max_error == 0.25);
    assert_true(scene->error);
    assert_int_equal(scene->shade.max_steps, 99);
    assert_true(scene->shade.start_offset == 2.5);
    assert_int_equal(scene->receiver_count, 2);
    const vsh_receiver *r = scene->receivers;
    assert_string_equal(r[0].path, "dir/x/a.glb");
    assert_string_equal(r[0].output, "dir/x/out/a.png");
    assert_string_equal(r[0].pack, "R=ao");
    assert_point(r[0].transform, unit, 2.0, 1.0, 1.0);
    assert_int_equal(r[0].uv_set, 1);
    assert_int_equal(r[0].width, 128);
    assert_int_equal(r[0].height, 64);
    assert_int_equal(r[0].supersample, 2);
    assert_int_equal(r[0].padding, 8);
    assert_int_equal(r[0].bits, 16);
    vsh_scene_free(scene);
}

static void what_is_not_given_is_the_default_of_the_headers(void **state) {
    (void)state;
    vsh_scene *scene = parse("scene.json", "{\"casters\": [{\"mesh\": \"a.obj\"}],"
                                           "\"receivers\": [{\"mesh\": \"a.obj\", \"output\": \"a.exr\"}]}");
    const vsh_grid_options grid = vsh_grid_options_default();
    const vsh_shade_options shade = vsh_shade_options_default();
    const vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    assert_true(scene->grid.struct_size == grid.struct_size && scene->grid.voxel_size == grid.voxel_size);
    assert_int_equal(scene->grid.resolution, grid.resolution);
    assert_true(scene->grid.half_width == grid.half_width);
    assert_true(scene->grid.shell_thickness == grid.shell_thickness);
    assert_memory_equal(&scene->shade, &shade, sizeof shade);
    assert_int_equal(scene->ao, 0);
    assert_int_equal(scene->irradiance, 0);
    assert_int_equal(scene->light_count, 0);
    assert_string_equal(scene->casters[0].path, "a.obj");
    const vsh_receiver *r = scene->receivers;
    assert_int_equal(r->uv_set, -1);
    assert_int_equal(r->width, lightmap.width);
    assert_int_equal(r->height, lightmap.height);
    assert_int_equal(r->supersample, lightmap.supersample);
    assert_int_equal(r->padding, lightmap.padding);
    assert_int_equal(r->bits, 0);
    assert_null(r->pack);
    vsh_scene_free(scene);
}

static void rotations_turn_about_x_then_y_then_z(void **state) {
    (void)state;
    vsh_scene *scene =
        parse("s", "{\"casters\": [{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [90, 90, 0]}},"
                   "{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [0, 90, 90]}},"
                   "{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [370, -40, 725]}},"
                   "{\"mesh\": \"a\", \"transform\": {\"rotate_deg\": [10, 320, 5]}}]}");
    const double y[3] = {0.0, 1.0, 0.0}, x[3] = {1.0, 0.0, 0.0};
    assert_point(scene->casters[0].transform, y, 1.0, 0.0, 0.0);  /* y to z by x, z to x by y */
    assert_point(scene->casters[1].transform, x, 0.0, 0.0, -1.0); /* x to -z by y, which z leaves alone */
    for (int i = 0; i < 12; ++i) {                                /* whole turns change nothing */
        assert_near(scene->casters[2].transform[i], scene->casters[3].transform[i], 1e-14);
    }
    vsh_scene_free(scene);
}

static void a_rectangle_has_its_sides(void **state) {
    (void)state;
    vsh_scene *scene =
        parse("a.json", "{\"casters\":[{\"sdf\":{\"shape\":\"sphere\",\"radius\":1}}],\"lights\":["
                        "{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[1,2,3],"
                        "\"edge_u\":[4,0,0],\"edge_v\":[0,5,6],\"two_sided\":true},"
                        "{\"name\":\"b\",\"type\":\"rectangle\",\"position\":[1,2,3],"
                        "\"edge_u\":[0,1,0],\"edge_v\":[0,0,1]}]}");
    const vsh_light *l = scene->lights;
    assert_int_equal(l[0].type, VSH_LIGHT_RECTANGLE);
    assert_vector(l[0].position, 1.0, 2.0, 3.0);
    assert_vector(l[0].edge_u, 4.0, 0.0, 0.0);
    assert_vector(l[0].edge_v, 0.0, 5.0, 6.0);
    assert_true(l[0].two_sided == 1 && l[1].two_sided == 0);
    vsh_scene_free(scene);
}

static void every_example_of_the_reference_is_a_scene(void **state) {
    (void)state;
    static const char start[] = "```json\n", end[] = "\n```";
    size_t size;
    char *text = read_text(VSH_ASSETS "/../docs/scene.md", &size);
    size_t count = 0;
    for (char *at = text; (at = strstr(at, start)) != NULL; ++count) {
        at += sizeof start - 1;
        char *stop = strstr(at, end);
        assert_non_null(stop);
        *stop = '\0';
        vsh_scene *scene = parse("docs/scene.md", at);
        assert_true(scene->receiver_count > 0);
        vsh_scene_free(scene);
        at = stop + 1;
    }
    assert_true(count >= 7);
    free(text);
}

/* --- What reading a scene's text may take is known before it is read. */

/* A folder of this run's own: the sanitizers' build runs beside this one in the same working folder. */
static char folder[] = "/tmp/vdbshade-scene-memory-XXXXXX";
static char file[sizeof folder + sizeof "/memory.json"];

/* A text of `count` times a piece, between two others; in a file of ours. Its length, without the NUL. */
static size_t write_scene(const char *head, const char *piece, size_t count, const char *tail, char **text) {
    const size_t length = strlen(head) + count * strlen(piece) + strlen(tail);
    *text = malloc(length + 1);
    assert_non_null(*text);
    char *at = stpcpy(*text, head);
    for (size_t i = 0; i < count; ++i) {
        at = stpcpy(at, piece);
    }
    stpcpy(at, tail);
    FILE *out = fopen(file, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(*text, 1, length, out), length);
    assert_int_equal(fclose(out), 0);
    return length;
}

static size_t taken(void) {
    const struct mallinfo2 all = mallinfo2();
    return all.uordblks + all.hblkhd;
}

static bool passes(size_t limit) {
    vsh_run run = vsh_run_default();
    run.memory_limit = limit;
    vsh_scene *scene = NULL;
    vsh_error error = {VSH_OK, ""};
    const vsh_result result = vsh_scene_read(file, &run, &scene, &error);
    vsh_scene_free(scene);
    vsh_flat_scene *flat = NULL;
    assert_true((vsh_flat_scene_read(file, &run, &flat, NULL) == VSH_ERROR_LIMIT) ==
                (result == VSH_ERROR_LIMIT));
    vsh_flat_scene_free(flat);
    assert_true(result != VSH_ERROR_LIMIT || strstr(error.message, "memory.json") != NULL);
    return result != VSH_ERROR_LIMIT;
}

static size_t least_limit(void) {
    size_t low = 1, high = (size_t)1 << 32;
    assert_true(passes(high) && !passes(low));
    while (high - low > low / 32 + 1) {
        const size_t middle = low + (high - low) / 2;
        *(passes(middle) ? &high : &low) = middle;
    }
    return high;
}

static void every_text_takes_less_than_the_least_limit_that_lets_it_pass(void **unused) {
    (void)unused;
    if (VSHI_SANITIZED) {
        skip(); /* whose allocator takes more, and does not tell */
    }
    static const struct {
        const char *head, *piece, *tail;
    } texts[] = {{"[{}", ",{}", "]"},
                 {"[[]", ",[]", "]"},
                 {"[1", ",1", "]"},
                 {"[\"\"", ",\"\"", "]"},
                 {"[\"\"", ",\"{[,:\\\"\"", "]"},
                 {"[{\"a\":0}", ",{\"a\":0}", "]"},
                 {"[{\"a\":{}}", ",{\"a\":[]}", "]"},
                 {"[{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6,\"g\":7,\"h\":8,\"i\":9}",
                  ",{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6,\"g\":7,\"h\":8,\"i\":9}", "]"},
                 {"[[1,2,3]", ",[1,2,3]", "]"},
                 {"[[1,2,3,4,5,6,7,8,9]", ",[1,2,3,4,5,6,7,8,9]", "]"}};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i) {
        for (size_t count = 900; count <= 9000; count *= 3) {
            char *text;
            const size_t length = write_scene(texts[i].head, texts[i].piece, count, texts[i].tail, &text);
            const size_t before = taken();
            json_t *tree = json_loadb(text, length, 0, NULL);
            assert_non_null(tree);
            const size_t takes = taken() - before + length;
            json_decref(tree);
            const size_t limit = least_limit();
            if (!(takes <= limit && limit <= 8 * takes)) {
                fail_msg("%zu times %s: takes %zu, passes at %zu", count, texts[i].piece, takes, limit);
            }
            free(text);
        }
    }
}

static void a_bomb_is_refused_before_it_is_read(void **unused) {
    (void)unused;
    char *text;
    write_scene("[{}", ",{}", 300000, "]", &text);
    free(text);
    const size_t before = taken();
    assert_false(passes((size_t)50 << 20));
    assert_true(taken() <= before + 65536);
}

static int make_folder(void **state) {
    (void)state;
    if (mkdtemp(folder) == NULL) {
        return -1;
    }
    snprintf(file, sizeof file, "%s/memory.json", folder);
    return 0;
}

static int remove_folder(void **state) {
    (void)state;
    unlink(file);
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_seeds_scene_is_the_one_of_the_techniques),
        cmocka_unit_test(every_key_lands_in_its_field),
        cmocka_unit_test(what_is_not_given_is_the_default_of_the_headers),
        cmocka_unit_test(rotations_turn_about_x_then_y_then_z),
        cmocka_unit_test(a_rectangle_has_its_sides),
        cmocka_unit_test(every_example_of_the_reference_is_a_scene),
        cmocka_unit_test(every_text_takes_less_than_the_least_limit_that_lets_it_pass),
        cmocka_unit_test(a_bomb_is_refused_before_it_is_read),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
