/* Ambient occlusion with rays against triangles: boxes, whose truth is analytic. Without Embree there is
 * nothing to test. */
#include "previews.h"
#include "shading.h"
#include "testing.h"

enum { SOLIDS = 5, TEXELS = 1000 };

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double DISTANCE = 1.0;

/* A floor, a wall, a slat an eighth of a voxel thick, a post and a box. */
static const truth_solid SCENE[SOLIDS] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0},
                                          {TRUTH_BOX, {-1.5, 0.8, 0.0}, {0.2, 0.8, 2.0}, 0.0, 0.0},
                                          {TRUTH_BOX, {0.0, 0.6, 0.0}, {0.5, 0.0025, 2.0}, 0.0, 0.0},
                                          {TRUTH_BOX, {0.5, 1.0, 1.0}, {0.04, 1.0, 0.04}, 0.0, 0.0},
                                          {TRUTH_BOX, {1.4, 0.3, -0.6}, {0.3, 0.3, 0.5}, 0.0, 0.0}};

typedef struct traced_scene {
    vsh_field *field;
    vsh_triangles *triangles;
} traced_scene;

static traced_scene scene_of(size_t solids) {
    static float corners[SOLIDS][24];
    vsh_mesh meshes[SOLIDS];
    for (size_t i = 0; i < solids; ++i) {
        const double *c = SCENE[i].center, *h = SCENE[i].half;
        meshes[i] = box_mesh(corners[i], (double[]){c[0] - h[0], c[1] - h[1], c[2] - h[2]},
                             (double[]){c[0] + h[0], c[1] + h[1], c[2] + h[2]});
    }
    const vsh_grid_options options = with_voxel(0.04);
    vsh_grid *grid = NULL;
    traced_scene scene = {NULL, NULL};
    assert_ok(vsh_grid_from_meshes(meshes, solids, &options, NULL, &grid, &failure));
    assert_ok(vsh_triangles_create(meshes, solids, NULL, &scene.triangles, &failure));
    scene.field = field_of_grid(grid, 0.0);
    return scene;
}

static void free_scene(traced_scene *scene) {
    vsh_triangles_free(scene->triangles);
    vsh_field_free(scene->field);
}

static vsh_shade_options options_of(double max_error) {
    vsh_shade_options options = preview_options();
    options.ao_method = VSH_AO_EXACT;
    options.ao_distance = DISTANCE;
    options.rays = 4096;
    options.max_error = max_error;
    return options;
}

/* Places on the floor, whatever stands near: only not under it. */
static void place(size_t solids, double *positions, float *normals) {
    uint64_t counter = 4;
    for (size_t i = 0; i < TEXELS;) {
        const double at[3] = {between(&counter, -2.5, 2.5), 0.0, between(&counter, -2.5, 2.5)};
        const double above[3] = {at[0], 1e-3, at[2]};
        if (truth_distance((truth_scene){SCENE, solids}, above) > 0.9e-3) {
            memcpy(positions + 3 * i, at, sizeof at);
            memcpy(normals + 3 * i++, UP, sizeof UP);
        }
    }
}

TEST(an_open_plate_is_exactly_1) {
    traced_scene scene = scene_of(1);
    static double positions[3 * TEXELS];
    static float normals[3 * TEXELS], ao[TEXELS];
    place(1, positions, normals);
    const vsh_points points = {TEXELS, positions, normals, NULL};
    const vsh_shade_options options = options_of(0.05);
    assert_ok(vsh_shade_ao(occluders_traced(scene.field, scene.triangles), &points, &options, NULL, ao, NULL,
                           NULL, NULL, &failure));
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(ao[i] == 1.0f);
    }
    free_scene(&scene);
}

TEST(the_error_left_is_what_was_asked_for_and_said) {
    traced_scene scene = scene_of(SOLIDS);
    static double positions[3 * TEXELS];
    static float normals[3 * TEXELS], ao[TEXELS], deviation[TEXELS], other[TEXELS];
    const double errors[] = {0.05, 0.02, 0.01}, normal[3] = {0.0, 1.0, 0.0};
    static double truth[TEXELS];
    place(SOLIDS, positions, normals);
    for (size_t i = 0; i < TEXELS; ++i) {
        const double at[3] = {positions[3 * i], 1e-5, positions[3 * i + 2]};
        truth[i] = truth_ao((truth_scene){SCENE, SOLIDS}, at, normal, DISTANCE, 4096);
    }
    const vsh_points points = {TEXELS, positions, normals, NULL};
    for (int e = 0; e < 3; ++e) {
        const vsh_shade_options options = options_of(errors[e]);
        vsh_shade_stats stats = vsh_shade_stats_zero();
        assert_ok(vsh_shade_ao(occluders_traced(scene.field, scene.triangles), &points, &options, NULL, ao,
                               deviation, NULL, &stats, &failure));
        double squares = 0.0, bias = 0.0, said = 0.0;
        for (size_t i = 0; i < TEXELS; ++i) {
            const double error = (double)ao[i] - truth[i];
            squares += error * error / TEXELS;
            bias += error / TEXELS;
            said += (double)deviation[i] * (double)deviation[i] / TEXELS;
        }
        print_message("asked %g: said %.4f, is %.4f, bias %+.4f; %.1f rays a point\n", errors[e], sqrt(said),
                      sqrt(squares), bias, (double)stats.rays / TEXELS);
        assert_true(sqrt(squares) <= 1.1 * sqrt(said) && sqrt(said) <= errors[e]);
        assert_true(fabs(bias) < 0.25 * errors[e]);
        assert_true(fabs(stats.square_error / TEXELS - said) < 1e-4 * said);
        assert_int_equal(stats.marches, 0);
        const int32_t threads[] = {2, 5};
        for (int t = 0; t < 2; ++t) {
            const vsh_run run = run_on(threads[t]);
            assert_ok(vsh_shade_ao(occluders_traced(scene.field, scene.triangles), &points, &options, &run,
                                   other, NULL, NULL, NULL, &failure));
            assert_memory_equal(ao, other, sizeof ao);
        }
    }
    free_scene(&scene);
}

TEST(it_needs_triangles) {
    traced_scene scene = scene_of(1);
    vsh_shade_options options = options_of(0.05);
    const double at[3] = {0.0, 0.0, 0.0};
    const vsh_points points = {1, at, UP, NULL};
    float ao = -1.0f;
    assert_fails(
        vsh_shade_ao(occluders_of(scene.field), &points, &options, NULL, &ao, NULL, NULL, NULL, &failure),
        VSH_ERROR_ARGUMENT, "triangles");
    free_scene(&scene);
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
