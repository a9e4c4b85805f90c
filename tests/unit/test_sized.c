/* Structs of another version of the headers: what a call fills ends where the caller's struct does. */
#include "casts.h"
#include "grids.h"
#include "scenes.h"

#include <vdbshade/vdbshade.h>

enum { ROOM = 16384, GUARD = 0xa5 };

static _Alignas(16) unsigned char room[ROOM];

static void guard(void) {
    memset(room, GUARD, sizeof room);
}

/* Nothing was written from `size` on. */
static void assert_ends(size_t size, const char *call) {
    for (size_t i = size; i < ROOM; ++i) {
        if (room[i] != GUARD) {
            fail_msg("%s: byte %zu of %zu was written", call, i, size);
        }
    }
}

/* Of `count` structs of `type`, `call` fills what `size` says: the same as in a struct of this version, cut;
 * the same with zeros behind; nothing beyond. */
#define HOLDS(type, count, call)                                                                             \
    do {                                                                                                     \
        type whole[count];                                                                                   \
        size_t size = sizeof(type);                                                                          \
        guard();                                                                                             \
        call;                                                                                                \
        assert_ends(size *(count), #type);                                                                   \
        memcpy(whole, room, sizeof whole);                                                                   \
        for (size = sizeof(type) - 8; size <= sizeof(type) + 24; size += 32) {                               \
            const size_t known = size < sizeof(type) ? size : sizeof(type);                                  \
            guard();                                                                                         \
            call;                                                                                            \
            assert_ends(size *(count), #type);                                                               \
            for (size_t i = 0; i < (count); ++i) {                                                           \
                assert_memory_equal(room + i * size, &whole[i], known);                                      \
                for (size_t k = known; k < size; ++k) {                                                      \
                    assert_int_equal(room[i * size + k], 0);                                                 \
                }                                                                                            \
            }                                                                                                \
        }                                                                                                    \
    } while (0)

static vsh_error why;

static void a_call_fills_the_struct_that_the_caller_has(void **state) {
    (void)state;
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance distance = sphere_field(&s);
    const vsh_grid_options options = with_voxel(0.1);
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_voxels *voxels = NULL;
    vsh_volume *volume = NULL;
    assert_int_equal(vsh_grid_from_distance(&distance, &options, NULL, &grid, &why), VSH_OK);
    assert_int_equal(vsh_field_create(grid, NULL, NULL, &field, &why), VSH_OK);
    assert_int_equal(vsh_voxels_from_grid(grid, 1.0, NULL, &voxels, &why), VSH_OK);
    const vsh_light light = vsh_light_default();
    assert_int_equal(vsh_bake_volume(occluders_of(field), voxels, &light, 1, NULL, NULL, &volume, NULL, &why),
                     VSH_OK);
    vsh_atlas *atlas = NULL;
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const uint32_t order[3] = {0, 1, 2};
    const vsh_mesh triangle = {
        .positions = corners, .indices = order, .vertex_count = 3, .triangle_count = 1};
    assert_int_equal(vsh_unwrap(&triangle, 1, NULL, NULL, &atlas, &why), VSH_OK);
    HOLDS(vsh_atlas_info, 1, vsh_atlas_get_info_sized(atlas, (void *)room, size));
    HOLDS(vsh_atlas_mesh, 1, vsh_atlas_mesh_view_sized(atlas, 0, (void *)room, size));
    HOLDS(vsh_atlas_chart, 1, vsh_atlas_chart_view_sized(atlas, 0, (void *)room, size));
    vsh_atlas_free(atlas);
    HOLDS(vsh_grid_info, 1, vsh_grid_get_info_sized(grid, (void *)room, size));
    HOLDS(vsh_field_info, 1, vsh_field_get_info_sized(field, (void *)room, size));
    vsh_occluders *casters = NULL;
    assert_int_equal(vsh_occluders_from_grid(grid, NULL, NULL, &casters, &why), VSH_OK);
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(casters, &parts);
    vsh_occluders_free(casters);
    parts.field = field;
    assert_int_equal(vsh_occluders_from_parts(&parts, &casters, &why), VSH_OK); /* no seconds in it */
    HOLDS(vsh_occluders_info, 1, vsh_occluders_get_info_sized(casters, (void *)room, size));
    vsh_occluders_free(casters);
    HOLDS(vsh_voxels_info, 1, vsh_voxels_get_info_sized(voxels, (void *)room, size));
    HOLDS(vsh_volume_info, 1, vsh_volume_get_info_sized(volume, (void *)room, size));
    HOLDS(vsh_volume_grid, 1, vsh_volume_get_grid_sized(volume, 0, (void *)room, size));
    HOLDS(vsh_volume_grid, 1, vsh_volume_get_grid_sized(volume, 7, (void *)room, size));

    static const float positions[] = {0, 0, 0, 1, 0, 0, 0, 0, 1}, uvs[] = {0, 0, 1, 0, 0, 1};
    static const uint32_t indices[] = {0, 1, 2};
    const vsh_mesh meshes[2] = {
        {.positions = positions, .uvs = uvs, .vertex_count = 3, .indices = indices, .triangle_count = 1},
        {.positions = positions, .uvs = uvs, .vertex_count = 3, .indices = indices, .triangle_count = 1},
    };
    vsh_lightmap_options lightmap = vsh_lightmap_options_default();
    lightmap.width = lightmap.height = 16;
    vsh_charts *charts = NULL;
    vsh_texels *texels = NULL;
    HOLDS(vsh_mesh_report, 1, vsh_mesh_check_sized(meshes, (void *)room, size, &why));
    HOLDS(vsh_solidity_report, 2, vsh_mesh_solidity_sized(meshes, 2, NULL, (void *)room, size, &why));
    HOLDS(vsh_lost, 2, vsh_field_find_lost_sized(field, meshes, 2, NULL, (void *)room, size, &why));
    HOLDS(vsh_uvs_measures, 1, vsh_uvs_measure_sized(meshes, 16, 16, (void *)room, size, &why));
    HOLDS(vsh_closeness, 1, vsh_charts_closeness_sized(meshes, 1, 16, 16, NULL, (void *)room, size, &why));
    HOLDS(vsh_uv_report, 2, {
        assert_int_equal(
            vsh_charts_create_sized(meshes, 2, &lightmap, NULL, (void *)room, size, &charts, &why), VSH_OK);
        vsh_charts_free(charts);
    });
    HOLDS(vsh_uv_report, 2, {
        assert_int_equal(
            vsh_texels_create_sized(meshes, 2, &lightmap, NULL, (void *)room, size, &texels, &why), VSH_OK);
        vsh_texels_free(texels);
    });
    assert_int_equal(vsh_charts_create(meshes, 1, &lightmap, NULL, NULL, &charts, &why), VSH_OK);
    assert_int_equal(vsh_texels_create(meshes, 1, &lightmap, NULL, NULL, &texels, &why), VSH_OK);
    HOLDS(vsh_stitch_report, 1, {
        float values[16 * 16] = {0};
        const vsh_lightmap plane = {.ao = values};
        assert_int_equal(vsh_lightmap_stitch_sized(charts, &plane, 0, NULL, NULL, (void *)room, size, &why),
                         VSH_OK);
    });
    HOLDS(vsh_charts_info, 1, vsh_charts_get_info_sized(charts, (void *)room, size));
    HOLDS(vsh_texels_info, 1, vsh_texels_get_info_sized(texels, (void *)room, size));
    HOLDS(vsh_texel_samples, 1, vsh_texels_samples_sized(texels, (void *)room, size));
    vsh_charts_free(charts);
    vsh_texels_free(texels);

    const float values[4] = {0, 0.25f, 0.5f, 1};
    HOLDS(vsh_coverage, 1, vsh_compare_coverage_sized(4, values, NULL, NULL, (void *)room, size));
    const vsh_compared compared = {{2, 2, 1}, values, values, NULL};
    HOLDS(vsh_measures, 1, vsh_compare_sized(&compared, NULL, NULL, (void *)room, size, &why));
    HOLDS(vsh_accuracy, 1, vsh_compare_accuracy_sized(&compared, 1, NULL, (void *)room, size, &why));
    vsh_volume_free(volume);
    vsh_voxels_free(voxels);
    vsh_field_free(field);
    vsh_grid_free(grid);
}

/* `type` begun as bindings begin it, within its size, with the values of the headers in these members. */
#define STARTS(type, made, ...)                                                                              \
    do {                                                                                                     \
        const type now = made();                                                                             \
        type begun;                                                                                          \
        const size_t offsets[] = {__VA_ARGS__};                                                              \
        guard();                                                                                             \
        assert_int_equal(vsh_struct_init(#type, (void *)room, sizeof now - 8), 1);                           \
        assert_ends(sizeof now - 8, #type);                                                                  \
        assert_int_equal(vsh_struct_init(#type, (void *)room, sizeof now), 1);                               \
        assert_ends(sizeof now, #type);                                                                      \
        memcpy(&begun, room, sizeof begun);                                                                  \
        for (size_t i = 0; i < sizeof offsets / sizeof *offsets; ++i) {                                      \
            assert_memory_equal((char *)&begun + offsets[i], (const char *)&now + offsets[i], 4);            \
        }                                                                                                    \
    } while (0)

static void bindings_have_the_defaults_of_the_headers(void **state) {
    (void)state;
    STARTS(vsh_run, vsh_run_default, offsetof(vsh_run, struct_size), offsetof(vsh_run, threads));
    STARTS(vsh_grid_options, vsh_grid_options_default, 0, offsetof(vsh_grid_options, resolution),
           offsetof(vsh_grid_options, half_width) + 4, offsetof(vsh_grid_options, shell_thickness) + 4);
    STARTS(vsh_shade_options, vsh_shade_options_default, 0, offsetof(vsh_shade_options, method),
           offsetof(vsh_shade_options, ao_method), offsetof(vsh_shade_options, max_error) + 4);
    STARTS(vsh_lightmap_options, vsh_lightmap_options_default, 0, offsetof(vsh_lightmap_options, width));
    STARTS(vsh_occluders_options, vsh_occluders_options_default, 0,
           offsetof(vsh_occluders_options, triangles), offsetof(vsh_occluders_options, grid));
    STARTS(vsh_occluder_parts, vsh_occluder_parts_default, 0, offsetof(vsh_occluder_parts, layer_count));
    STARTS(vsh_scene_occluders_options, vsh_scene_occluders_options_default, 0,
           offsetof(vsh_scene_occluders_options, triangles));
    STARTS(vsh_light, vsh_light_default, offsetof(vsh_light, name), offsetof(vsh_light, type));
    STARTS(vsh_sdf_node, vsh_sdf_node_default, offsetof(vsh_sdf_node, scale) + 4,
           offsetof(vsh_sdf_node, radius) + 4);
    STARTS(vsh_bake_stats, vsh_bake_stats_zero, 0, offsetof(vsh_bake_stats, texels));
    vsh_run run;
    assert_int_equal(vsh_struct_init("vsh_run", &run, sizeof run), 1);
    assert_int_equal(run.struct_size, sizeof run);
    /* of a later header: refused where it is used */
    assert_int_equal(vsh_struct_init("vsh_run", (void *)room, sizeof run + 32), 1);
    assert_int_equal(((vsh_run *)(void *)room)->struct_size, sizeof run + 32);
    assert_int_equal(vsh_struct_init("vsh_mesh", &run, sizeof run), 0);
    assert_int_equal(vsh_struct_init(NULL, &run, sizeof run), 0);
    assert_int_equal(vsh_struct_init("vsh_run", NULL, sizeof run), 0);
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_read("none.vdb", NULL, (void *)room, &grid, &why), VSH_ERROR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_call_fills_the_struct_that_the_caller_has),
        cmocka_unit_test(bindings_have_the_defaults_of_the_headers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
