/* Scenes: what their keys become. test_scene_errors.c has what is refused. */
#include "fields.h"
#include "sandbox/reader.h"
#include "scenes.h"
#include "testing.h"
#include <jansson.h>
#include <malloc.h>

static const double PI = 3.14159265358979323846;

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

/* By distances on both sides of its surfaces. */
TEST(the_seeds_scene_is_the_one_of_the_techniques) {
    OWNED(vsh_scene) *scene = NULL;
    assert_ok(vsh_scene_read(seeds_path, NULL, &scene, &failure));
    assert_int_equal(scene->caster_count, 1);
    assert_int_equal(scene->casters[0].type, VSH_CASTER_SDF);
    uint64_t counter = 1;
    for (int i = 0; i < 20000; ++i) {
        const double p[3] = {between(&counter, -3.5, 3.5), between(&counter, -0.1, 2.2),
                             between(&counter, -3.5, 3.5)};
        const double truth = truth_distance(truth_seeds(), p),
                     found = vsh_sdf_distance(&scene->casters[0].sdf, p);
        /* inside of unions neither is the distance to the nearest surface */
        assert_true((found < 0.0) == (truth < 0.0));
        assert_near(fmax(found, 0.0), fmax(truth, 0.0), 1e-12);
    }
    assert_true(scene->grid.voxel_size == 0.02);
    assert_int_equal(scene->light_count, 1);
    assert_string_equal(scene->lights[0].name, "sun");
    assert_int_equal(scene->lights[0].type, VSH_LIGHT_DIRECTIONAL);
    assert_memory_equal(scene->lights[0].direction, truth_seeds_sun, sizeof truth_seeds_sun);
    assert_near(tan(scene->lights[0].angle / 2.0), truth_seeds_w, 1e-15);
    assert_int_equal(scene->receiver_count, 1);
    assert_string_equal(scene->receivers[0].path, VSH_ASSETS "/seeds_floor.obj");
    assert_string_equal(scene->receivers[0].output, VSH_ASSETS "/seeds.exr");
    assert_true(scene->receivers[0].width == 512 && scene->receivers[0].height == 512);
}

TEST(every_key_lands_in_its_field) {
    OWNED(vsh_scene) *scene = parse("dir/x/scene.json", full_scene);
    const double unit[3] = {1.0, 1.0, 1.0};
    /* `at` is where the caster's transform puts (1, 1, 1) */
    static const struct {
        int32_t type;
        const char *path;
        double at[3];
    } casters[] = {{VSH_CASTER_MESH, "dir/x/a.glb", {5.0, 5.0, 1.0}}, /* scaled by 2, 3, 4; z to x; moved */
                   {VSH_CASTER_VDB, "/data/b.vdb", {4.0, 7.0, 8.0}},
                   {VSH_CASTER_VDB, "dir/x/../c.vdb", {1.0, 1.0, 1.0}},
                   {VSH_CASTER_SDF, NULL, {-0.5, 0.5, 0.5}},
                   {VSH_CASTER_MASK, "dir/x/m.png", {2.0, 2.0, 2.0}},
                   {VSH_CASTER_TEXT, "dir/x/f.ttf", {1.0, 1.0, 1.0}}};
    const vsh_caster *c = scene->casters;
    assert_int_equal(scene->caster_count, 6);
    for (size_t i = 0; i < 6; ++i) {
        assert_int_equal(c[i].type, casters[i].type);
        assert_true(casters[i].path == NULL || strcmp(c[i].path, casters[i].path) == 0);
        assert_point(c[i].transform, unit, casters[i].at[0], casters[i].at[1], casters[i].at[2]);
    }
    assert_string_equal(c[1].grid, "rock");
    assert_null(c[2].grid);
    assert_true(c[4].mask.width == 2.0 && c[4].mask.height == 3.0 && c[4].thickness == 0.5);
    assert_true(c[4].mask.threshold == 0.25 && c[4].mask.invert != 0);
    assert_string_equal(c[4].mask.channel, "red");
    assert_string_equal(c[5].text, "a\nb");
    assert_true(c[5].letters.height == 2.0 && c[5].letters.line_spacing == 1.5 && c[5].thickness == 0.25);
    assert_int_equal(c[5].letters.align, VSH_ALIGN_RIGHT);

    static const struct {
        int32_t shape, left, right;
    } expected[] = {{VSH_SDF_CAPSULE, -1, -1}, {VSH_SDF_CYLINDER, -1, -1},   {VSH_SDF_SMOOTH_UNION, 0, 1},
                    {VSH_SDF_CONE, -1, -1},    {VSH_SDF_SMOOTH_UNION, 2, 3}, {VSH_SDF_CONE, -1, -1},
                    {VSH_SDF_BOX, -1, -1},     {VSH_SDF_INTERSECTION, 5, 6}, {VSH_SDF_SUBTRACTION, 4, 7}};
    const vsh_sdf_node *n = c[3].sdf.nodes;
    assert_int_equal(c[3].sdf.node_count, 9);
    for (size_t i = 0; i < 9; ++i) {
        assert_true(n[i].shape == expected[i].shape && n[i].left == expected[i].left &&
                    n[i].right == expected[i].right);
    }
    assert_true(n[0].size[1] == 1.5 && n[0].radius == 0.75 && n[1].size[1] == 2.5 && n[1].radius == 1.75);
    assert_true(n[2].smoothing == 0.25 && n[4].smoothing == 0.25 && n[5].minor_radius == 0.0);
    assert_true(n[3].size[1] == 3.5 && n[3].radius == 2.75 && n[3].minor_radius == 0.5);
    assert_vector(n[6].size, 1.0, 2.0, 3.0);
    assert_vector(n[2].rotation, 0.0, 0.0, 0.0); /* only the last of a fold is turned */
    assert_vector(n[4].rotation, sqrt(0.5), 0.0, 0.0);
    assert_near(n[4].rotation[3], sqrt(0.5), 1e-15);
    assert_vector(n[8].rotation, 0.0, 2.0, 0.0);
    assert_true(n[8].scale == 3.0 && n[7].scale == 1.0);
    assert_vector(n[8].translation, 9.0, 8.0, 7.0);

    const vsh_light *l = scene->lights;
    assert_int_equal(scene->light_count, 3);
    assert_vector(l[0].direction, 0.0, 2.0, 0.0);
    assert_vector(l[0].color, 3.0, 2.0, 1.0);
    assert_true(l[0].angle == vsh_light_default().angle);
    assert_true(l[1].type == VSH_LIGHT_SPHERE && l[1].radius == 0.125 && l[1].reach == 12.0);
    assert_vector(l[1].position, 1.0, 2.0, 3.0);
    assert_int_equal(l[1].falloff, VSH_FALLOFF_QUADRATIC);
    assert_vector(l[1].color, 1.0, 1.0, 1.0);
    assert_true(l[2].type == VSH_LIGHT_SPOT && l[2].falloff == VSH_FALLOFF_INVERSE_SQUARE);
    assert_string_equal(l[2].name, "head_-9");
    assert_vector(l[2].axis, 0.0, -1.0, 0.0);
    assert_vector(l[2].direction, 0.0, 1.0, 0.0); /* a sun's, as it was */
    assert_near(l[2].inner_angle, PI / 6.0, 1e-15);
    assert_true(l[2].outer_angle == PI);

    const vsh_grid_options *g = &scene->grid;
    assert_true(g->voxel_size == 0.0 && g->resolution == 64 && g->half_width == 4.5 &&
                g->shell_thickness == 3.0);
    const vsh_shade_options *o = &scene->shade;
    assert_true(scene->ao == 1 && scene->irradiance == 1 && scene->error);
    assert_true(o->ao_distance == 2.5 && o->ao_method == VSH_AO_CONES && o->ao_cones == 32);
    assert_true(o->method == VSH_SHADOW_SMOOTH && o->rays == 77 && o->sampler == VSH_SAMPLER_BLUE);
    assert_true(o->frame == 5 && o->early_rays == 4 && o->max_error == 0.25);
    assert_true(o->max_steps == 99 && o->start_offset == 2.5);

    const vsh_receiver *r = scene->receivers;
    assert_int_equal(scene->receiver_count, 2);
    assert_string_equal(r[0].path, "dir/x/a.glb");
    assert_string_equal(r[0].output, "dir/x/out/a.png");
    assert_string_equal(r[0].pack, "R=ao");
    assert_point(r[0].transform, unit, 2.0, 1.0, 1.0);
    assert_true(r[0].uv_set == 1 && r[0].width == 128 && r[0].height == 64 && r[0].supersample == 2);
    assert_true(r[0].padding == 8 && r[0].bits == 16);
}

TEST(missing_keys_have_the_defaults_of_the_headers) {
    OWNED(vsh_scene) *scene =
        parse("scene.json", "{\"casters\": [{\"mesh\": \"a.obj\"}],"
                            "\"receivers\": [{\"mesh\": \"a.obj\", \"output\": \"a.exr\"}]}");
    const vsh_grid_options grid = vsh_grid_options_default();
    const vsh_shade_options shade = vsh_shade_options_default();
    const vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    const vsh_grid_options *g = &scene->grid; /* by its members: it has padding */
    assert_true(g->struct_size == grid.struct_size && g->voxel_size == grid.voxel_size);
    assert_true(g->resolution == grid.resolution && g->half_width == grid.half_width);
    assert_true(g->shell_thickness == grid.shell_thickness);
    assert_memory_equal(&scene->shade, &shade, sizeof shade);
    assert_true(!scene->ao && !scene->irradiance && scene->light_count == 0);
    assert_string_equal(scene->casters[0].path, "a.obj");
    const vsh_receiver *r = scene->receivers;
    assert_true(r->uv_set == -1 && r->bits == 0 && r->pack == NULL);
    assert_true(r->width == lightmap.width && r->height == lightmap.height);
    assert_true(r->supersample == lightmap.supersample && r->padding == lightmap.padding);
}

TEST(rotations_turn_about_x_then_y_then_z) {
    OWNED(vsh_scene) *scene =
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
}

TEST(a_rectangle_has_its_sides) {
    OWNED(vsh_scene) *scene =
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
}

TEST(every_example_of_the_reference_is_a_scene) {
    static const char start[] = "```json\n", end[] = "\n```";
    size_t size;
    FREED char *text = read_text(VSH_ASSETS "/../docs/scene.md", &size);
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
}

/* --- What reading a scene's text may take is known before it is read. */

/* A folder of this run's own: the sanitizers' build runs beside this one in the same working folder. */
static char folder[] = "/tmp/vdbshade-scene-memory-XXXXXX";
static char file[sizeof folder + sizeof "/memory.json"];

/* An array of `count` times a piece, which is also written to the file. */
static char *write_scene(const char *piece, size_t count) {
    char *text = malloc(count * (strlen(piece) + 1) + 3), *at = text;
    assert_non_null(text);
    for (size_t i = 0; i < count; ++i) {
        at = stpcpy(stpcpy(at, i == 0 ? "[" : ","), piece);
    }
    strcpy(at, "]");
    FILE *out = fopen(file, "wb");
    assert_non_null(out);
    assert_true(fputs(text, out) >= 0);
    assert_int_equal(fclose(out), 0);
    return text;
}

static size_t taken(void) {
    const struct mallinfo2 all = mallinfo2();
    return all.uordblks + all.hblkhd;
}

static bool passes(size_t limit) {
    vsh_run run = run_within(limit);
    OWNED(vsh_scene) *scene = NULL;
    const vsh_result result = vsh_scene_read(file, &run, &scene, &failure);
    assert_true(result != VSH_ERROR_LIMIT || strstr(failure.message, "memory.json") != NULL);
    OWNED(vsh_flat_scene) *flat = NULL;
    assert_true((vsh_flat_scene_read(file, &run, &flat, NULL) == VSH_ERROR_LIMIT) ==
                (result == VSH_ERROR_LIMIT));
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

TEST(reading_takes_less_than_the_least_limit_that_it_passes) {
    if (VSHI_SANITIZED) {
        skip(); /* whose allocator takes more, and does not tell */
    }
    static const char *const pieces[] = {
        "{}",
        "[]",
        "1",
        "\"\"",
        "\"{[,:\\\"\"",
        "{\"a\":0}",
        "{\"a\":[]}",
        "[1,2,3]",
        "[1,2,3,4,5,6,7,8,9]",
        "{\"a\":1,\"b\":2,\"c\":3,\"d\":4,\"e\":5,\"f\":6,\"g\":7,\"h\":8,\"i\":9}"};
    for (size_t i = 0; i < sizeof pieces / sizeof pieces[0]; ++i) {
        for (size_t count = 900; count <= 9000; count *= 3) {
            FREED char *text = write_scene(pieces[i], count);
            const size_t before = taken();
            json_t *tree = json_loads(text, 0, NULL);
            assert_non_null(tree);
            const size_t takes = taken() - before + strlen(text);
            json_decref(tree);
            const size_t limit = least_limit();
            assert_that(takes <= limit && limit <= 8 * takes, "%zu times %s: takes %zu, passes at %zu", count,
                        pieces[i], takes, limit);
        }
    }
}

TEST(a_bomb_is_refused_before_it_is_read) {
    free(write_scene("{}", 300000));
    const size_t before = taken();
    assert_false(passes((size_t)50 << 20));
    assert_true(taken() <= before + 65536);
}

static int make_folder(void **state) {
    const bool made = mkdtemp(folder) != NULL;
    snprintf(file, sizeof file, "%s/memory.json", folder);
    return made ? 0 : -1;
}

static int remove_folder(void **state) {
    unlink(file);
    return rmdir(folder);
}

FIXTURE(make_folder, remove_folder)
