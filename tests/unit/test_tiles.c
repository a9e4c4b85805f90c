/* Tiles of a world bake what the whole of it does, with less. */
#include "images.h"
#include "scenes.h"

#include <vdbshade/vdbshade.h>

enum { FLOORS = 5, SIZE = 96 };

static void write_box(FILE *file, const double low[3], const double high[3], int *vertices) {
    static const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (int i = 0; i < 8; ++i) {
        fprintf(file, "v %g %g %g\n", (i & 1) != 0 ? high[0] : low[0], (i & 2) != 0 ? high[1] : low[1],
                (i & 4) != 0 ? high[2] : low[2]);
    }
    for (int f = 0; f < 6; ++f) {
        fprintf(file, "f %d %d %d %d\n", *vertices + faces[f][0], *vertices + faces[f][1],
                *vertices + faces[f][2], *vertices + faces[f][3]);
    }
    *vertices += 8;
}

/* floor.obj: 4 × 4 units around 0. posts.obj: one by the far end of each of the floors, each an object. */
static void write_world(void) {
    FILE *file = fopen(at("floor.obj"), "wb");
    assert_non_null(file);
    fputs("v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 4/4 3/3\nf 1/1 3/3 "
          "2/2\n",
          file);
    assert_int_equal(fclose(file), 0);
    file = fopen(at("posts.obj"), "wb");
    assert_non_null(file);
    int vertices = 1;
    for (int i = 0; i < FLOORS; ++i) {
        const double x = 4.0 * i + 1.5, low[3] = {x - 0.2, 0.01, -0.4}, high[3] = {x + 0.2, 2.0, 0.6};
        fprintf(file, "o post%d\n", i);
        write_box(file, low, high, &vertices);
    }
    assert_int_equal(fclose(file), 0);
}

/* The scene of `casters`, whose floors receive; `more` are further keys. The sun comes from where x is less,
 * so that a post darkens the floor behind its own. */
static vsh_scene *world(const char *casters, const char *more) {
    static char text[8192];
    int used = snprintf(text, sizeof text,
                        "{\"casters\": [%s], %s, \"lights\": [{\"name\": \"sun\", \"type\": \"directional\", "
                        "\"direction\": [-1, 0.7, 0.1], \"angle_deg\": 4}], \"ao\": {\"distance\": 0.8}, "
                        "\"receivers\": [",
                        casters, more);
    for (int i = 0; i < FLOORS; ++i) {
        used +=
            snprintf(text + used, sizeof text - (size_t)used,
                     "%s{\"mesh\": \"floor.obj\", \"transform\": {\"translate\": [%d, 0, 0]}, \"size\": %d, "
                     "\"output\": \"floor%d.exr\"}",
                     i > 0 ? ", " : "", 4 * i, SIZE, i);
    }
    snprintf(text + used, sizeof text - (size_t)used, "]}");
    return parse(at("world.json"), text);
}

static const char posts[] = "{\"mesh\": \"posts.obj\"}";
static const char nothing_more[] = "\"max_error\": 0.02";

/* --- baked into memory */

enum { SUN, AO, PLANES };

typedef struct baked {
    float values[FLOORS][PLANES][SIZE * SIZE];
    float (*now)[SIZE * SIZE];
    int32_t rows;
    int channel[PLANES];
} baked;

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    (void)error;
    baked *b = user;
    const char *name = strrchr(lightmap->output, '/');
    assert_non_null(name);
    b->now = b->values[name[strlen("/floor")] - '0'];
    b->rows = 0;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        b->channel[SUN] = strcmp(image->names[c], "shadow.sun") == 0 ? c : b->channel[SUN];
        b->channel[AO] = strcmp(image->names[c], "ao") == 0 ? c : b->channel[AO];
    }
    return VSH_OK;
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    (void)error;
    baked *b = user;
    for (int p = 0; p < PLANES; ++p) {
        memcpy(b->now[p] + b->rows * SIZE, planes[b->channel[p]], (size_t)rows * SIZE * sizeof(float));
    }
    b->rows += rows;
    return VSH_OK;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    (void)user;
    (void)error;
    return result;
}

static void bake(const vsh_scene *scene, baked *into) {
    const vsh_row_sink sink = {sizeof sink, begin, add, end, into};
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    vsh_error error;
    if (vsh_bake_scene(scene, &options, NULL, NULL, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
}

static vsh_tiles *tiles_of(const vsh_scene *scene, double size) {
    vsh_tiles *tiles;
    vsh_error error;
    if (vsh_tiles_create(scene, size, NULL, &tiles, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return tiles;
}

static vsh_tile *tile_of(const vsh_tiles *tiles, size_t index) {
    vsh_tile *tile;
    vsh_error error;
    if (vsh_tile_create(tiles, index, &tile, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return tile;
}

static void bake_tiles(const vsh_scene *scene, double size, baked *into) {
    vsh_tiles *tiles = tiles_of(scene, size);
    for (size_t i = 0; i < vsh_tiles_count(tiles); ++i) {
        vsh_tile *tile = tile_of(tiles, i);
        bake(vsh_tile_scene(tile), into);
        vsh_tile_free(tile);
    }
    vsh_tiles_free(tiles);
}

static double rmse(const baked *a, const baked *b, int plane) {
    double sum = 0.0;
    for (int f = 0; f < FLOORS; ++f) {
        for (int i = 0; i < SIZE * SIZE; ++i) {
            const double d = (double)a->values[f][plane][i] - (double)b->values[f][plane][i];
            sum += d * d;
        }
    }
    return sqrt(sum / (FLOORS * SIZE * SIZE));
}

static baked *two(void) {
    baked *b = calloc(2, sizeof *b);
    assert_non_null(b);
    return b;
}

/* --- meshes */

static void tiles_of_meshes_bake_the_whole_world_s_values_by_fewer_objects(void **state) {
    (void)state;
    write_world();
    vsh_scene *scene = world(posts, nothing_more);
    baked *whole = two(), *tiled = whole + 1;
    bake(scene, whole);
    bake_tiles(scene, 4.0, tiled);
    const double sun = rmse(whole, tiled, SUN), ao = rmse(whole, tiled, AO);
    printf("off by %.3g of the sun, %.3g of AO\n", sun, ao);
    assert_true(sun <= 0.1 * scene->shade.max_error);
    assert_true(ao <= 0.1 * scene->shade.max_error);
    vsh_tiles *tiles = tiles_of(scene, 4.0);
    assert_int_equal(vsh_tiles_count(tiles), FLOORS);
    for (size_t i = 0; i < FLOORS; ++i) {
        vsh_tile *tile = tile_of(tiles, i);
        vsh_tile_info info;
        vsh_tile_get_info(tile, &info);
        assert_int_equal(info.receivers, 1);
        assert_int_equal(info.all_objects, FLOORS);
        assert_int_equal(info.all_triangles, 12 * FLOORS);
        assert_int_equal(info.objects, i == 0 ? 1 : 2); /* its own and the one before */
        assert_int_equal(info.triangles, 12 * info.objects);
        assert_true(info.left_out <= 0.1 * scene->shade.max_error);
        vsh_tile_free(tile);
    }
    vsh_tiles_free(tiles);
    /* and the post before is one to be seen */
    const vsh_caster own = scene->casters[0];
    static const char *const last[] = {"post4"};
    vsh_caster alone = own;
    alone.objects = (vsh_selection){last, 1, NULL, 0};
    vsh_scene fifth = *scene;
    fifth.casters = &alone;
    fifth.receivers = &scene->receivers[4];
    fifth.receiver_count = 1;
    memcpy(tiled, whole, sizeof *tiled);
    bake(&fifth, tiled);
    assert_true(rmse(whole, tiled, SUN) > 0.02);
    free(whole);
    vsh_scene_free(scene);
}

static void one_tile_around_all_is_the_whole_bit_by_bit(void **state) {
    (void)state;
    write_world();
    vsh_scene *scene = world(posts, nothing_more);
    baked *whole = two(), *tiled = whole + 1;
    bake(scene, whole);
    bake_tiles(scene, 1000.0, tiled);
    assert_memory_equal(whole->values, tiled->values, sizeof whole->values);
    free(whole);
    vsh_scene_free(scene);
}

/* A post alone is so small that its lattices would be of single texels. */
static void texels_of_a_tile_share_rays_as_in_the_whole_world(void **state) {
    (void)state;
    write_world();
    vsh_scene *scene = world(posts, "\"max_error\": 0.3");
    baked *whole = two(), *tiled = whole + 1;
    bake(scene, whole);
    bake_tiles(scene, 4.0, tiled);
    int hidden = 0, differ = 0;
    for (int f = 0; f < FLOORS; ++f) {
        for (int i = 0; i < SIZE * SIZE; ++i) {
            hidden += whole->values[f][AO][i] < 1.0F;
            differ += whole->values[f][AO][i] != tiled->values[f][AO][i];
        }
    }
    printf("%d of %d texels differ\n", differ, hidden);
    assert_true(hidden > FLOORS * SIZE);
    assert_true(50 * differ < hidden);
    free(whole);
    vsh_scene_free(scene);
}

static void what_is_left_out_hides_less_than_a_tenth_of_the_error(void **state) {
    (void)state;
    write_world();
    /* chips before a wide sun: some hide too little to be worth a tree, all of them together do not */
    static char casters[1 << 14];
    int used = snprintf(casters, sizeof casters, "%s", posts);
    for (int i = 0; i < 60; ++i) {
        used += snprintf(casters + used, sizeof casters - (size_t)used,
                         ", {\"mesh\": \"posts.obj\", \"objects\": \"post0\", \"transform\": {\"translate\": "
                         "[%d, %d, 0], \"scale\": 0.2}}",
                         -70 - 4 * i, 30 + i);
    }
    vsh_scene *scene = world(casters, "\"max_error\": 0.05");
    vsh_light light = scene->lights[0];
    light.angle = 0.9;
    scene->lights = &light;
    vsh_tiles *tiles = tiles_of(scene, 4.0);
    vsh_tile *tile = tile_of(tiles, 2);
    vsh_tile_info info;
    vsh_tile_get_info(tile, &info);
    printf("%zu of %zu objects cast, %.3g is left out\n", info.objects, info.all_objects, info.left_out);
    assert_true(info.left_out > 0.0 && info.left_out <= 0.1 * 0.05);
    assert_true(info.objects > 2 && info.objects < info.all_objects);
    vsh_tile_free(tile);
    vsh_tiles_free(tiles);
    vsh_scene_free(scene);
}

/* An object is meant before a material, also where a tile has the material alone. */
static void a_rule_means_in_a_tile_what_it_means_in_the_world(void **state) {
    (void)state;
    write_world();
    FILE *file = fopen(at("named.obj"), "wb");
    assert_non_null(file);
    int vertices = 1;
    fputs("mtllib named.mtl\no near\nusemtl oak\n", file);
    write_box(file, (const double[]){1.3, 0.01, -0.4}, (const double[]){1.7, 2.0, 0.6}, &vertices);
    fputs("o oak\nusemtl stone\n", file);
    write_box(file, (const double[]){301.3, 0.01, -0.4}, (const double[]){301.7, 2.0, 0.6}, &vertices);
    assert_int_equal(fclose(file), 0);
    file = fopen(at("named.mtl"), "wb");
    assert_non_null(file);
    fputs("newmtl oak\nKd 1 1 1\nnewmtl stone\nKd 1 1 1\n", file);
    assert_int_equal(fclose(file), 0);
    vsh_scene *scene = world("{\"mesh\": \"named.obj\", \"shell\": \"oak\"}", nothing_more);
    vsh_tiles *tiles = tiles_of(scene, 4.0);
    vsh_tile *tile = tile_of(tiles, 0);
    vsh_assets *assets;
    vsh_error error;
    size_t count;
    assert_int_equal(vsh_assets_load(vsh_tile_scene(tile), NULL, &assets, &error), VSH_OK);
    const vsh_mesh *meshes = vsh_assets_caster(assets, 0, &count);
    assert_int_equal(count, 1);
    assert_string_equal(meshes[0].material_name, "oak");
    assert_int_equal(meshes[0].solidity, VSH_SOLIDITY_AUTO);
    vsh_assets_free(assets);
    vsh_tile_free(tile);
    vsh_tiles_free(tiles);
    vsh_scene_free(scene);
}

static void layers_and_rules_of_what_is_far_away_do_no_harm(void **state) {
    (void)state;
    write_world();
    vsh_scene *scene = world("{\"mesh\": \"posts.obj\", \"except\": \"post4\", \"solid\": \"post0\"}, "
                             "{\"mesh\": \"posts.obj\", \"objects\": \"post4\", \"layer\": \"soft\"}",
                             "\"layers\": [{\"name\": \"soft\", \"softness\": 2}]");
    baked *whole = two(), *tiled = whole + 1;
    bake(scene, whole);
    bake_tiles(scene, 4.0, tiled);
    assert_true(rmse(whole, tiled, SUN) <= 0.1 * scene->shade.max_error);
    assert_true(rmse(whole, tiled, AO) <= 0.1 * scene->shade.max_error);
    free(whole);
    vsh_scene_free(scene);
}

/* --- level sets */

static void tiles_of_a_level_set_bake_it_within_the_error_by_fewer_voxels(void **state) {
    (void)state;
    write_world();
    vsh_scene *meshes = world(posts, "\"voxel_size\": 0.05");
    vsh_assets *assets;
    vsh_grid *grid;
    vsh_error error;
    assert_int_equal(vsh_assets_load(meshes, NULL, &assets, &error), VSH_OK);
    assert_int_equal(vsh_scene_casters(meshes, assets, NULL, &grid, &error), VSH_OK);
    assert_int_equal(vsh_grid_write(grid, at("posts.vdb"), NULL, NULL, 0, &error), VSH_OK);
    vsh_grid_info all;
    vsh_grid_get_info(grid, &all);
    vsh_grid_free(grid);
    vsh_assets_free(assets);
    vsh_scene_free(meshes);

    vsh_scene *scene = world("{\"vdb\": \"posts.vdb\"}", "\"voxel_size\": 0.05");
    baked *whole = two(), *tiled = whole + 1;
    bake(scene, whole);
    bake_tiles(scene, 4.0, tiled);
    const double sun = rmse(whole, tiled, SUN), ao = rmse(whole, tiled, AO);
    printf("off by %.3g of the sun, %.3g of AO\n", sun, ao);
    assert_true(sun <= scene->shade.max_error);
    assert_true(ao <= scene->shade.max_error);
    vsh_tiles *tiles = tiles_of(scene, 4.0);
    for (size_t i = 0; i < FLOORS; ++i) {
        vsh_tile *tile = tile_of(tiles, i);
        vsh_grid_info info;
        assert_int_equal(vsh_assets_load(vsh_tile_scene(tile), NULL, &assets, &error), VSH_OK);
        assert_int_equal(vsh_scene_casters(vsh_tile_scene(tile), assets, NULL, &grid, &error), VSH_OK);
        vsh_grid_get_info(grid, &info);
        assert_true((double)info.active_voxels < 0.65 * (double)all.active_voxels);
        vsh_grid_free(grid);
        vsh_assets_free(assets);
        vsh_tile_free(tile);
    }
    vsh_tiles_free(tiles);
    free(whole);
    vsh_scene_free(scene);
}

/* --- errors */

static void refused(const vsh_scene *scene, double size, vsh_result expected, const char *words) {
    vsh_tiles *tiles = (vsh_tiles *)1;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_tiles_create(scene, size, NULL, &tiles, &error), expected);
    assert_null(tiles);
    if (strstr(error.message, words) == NULL) {
        fail_msg("'%s' does not say '%s'", error.message, words);
    }
}

static void what_cannot_be_cut_is_refused(void **state) {
    (void)state;
    write_world();
    vsh_scene *scene = world(posts, nothing_more);
    refused(NULL, 4.0, VSH_ERROR_ARGUMENT, "NULL");
    refused(scene, 0.0, VSH_ERROR_ARGUMENT, "size 0");
    refused(scene, -1.0, VSH_ERROR_ARGUMENT, "size -1");
    refused(scene, (double)NAN, VSH_ERROR_ARGUMENT, "size");
    refused(scene, (double)INFINITY, VSH_ERROR_ARGUMENT, "size inf");
    vsh_tiles *tiles = tiles_of(scene, 4.0);
    vsh_tile *tile = tile_of(tiles, 0), *none = (vsh_tile *)1;
    vsh_error error;
    refused(vsh_tile_scene(tile), 4.0, VSH_ERROR_ARGUMENT, "is a tile already");
    vsh_scene own = *vsh_tile_scene(tile);
    assert_int_equal(vsh_scene_use_field(&own, (const vsh_field_file *)1, &error), VSH_ERROR_ARGUMENT);
    assert_null(own.field);
    assert_int_equal(vsh_tile_create(tiles, FLOORS, &none, &error), VSH_ERROR_ARGUMENT);
    assert_null(none);
    assert_non_null(strstr(error.message, "tile 5: there are 5"));
    vsh_tile_free(tile);
    vsh_tiles_free(tiles);
    scene->receiver_count = 0;
    refused(scene, 4.0, VSH_ERROR_ARGUMENT, "no receivers");
    vsh_scene_free(scene);
    scene = world("{\"mesh\": \"posts.obj\", \"solid\": \"pots*\"}", nothing_more);
    refused(scene, 4.0, VSH_ERROR_INPUT, "pots*");
    vsh_scene_free(scene);
    scene = world("{\"mesh\": \"none.obj\"}", nothing_more);
    refused(scene, 4.0, VSH_ERROR_READ, "none.obj");
    vsh_scene_free(scene);
    vsh_tiles_free(NULL);
    vsh_tile_free(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_of_meshes_bake_the_whole_world_s_values_by_fewer_objects),
        cmocka_unit_test(one_tile_around_all_is_the_whole_bit_by_bit),
        cmocka_unit_test(texels_of_a_tile_share_rays_as_in_the_whole_world),
        cmocka_unit_test(what_is_left_out_hides_less_than_a_tenth_of_the_error),
        cmocka_unit_test(a_rule_means_in_a_tile_what_it_means_in_the_world),
        cmocka_unit_test(layers_and_rules_of_what_is_far_away_do_no_harm),
        cmocka_unit_test(tiles_of_a_level_set_bake_it_within_the_error_by_fewer_voxels),
        cmocka_unit_test(what_cannot_be_cut_is_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
