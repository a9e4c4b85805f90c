/* Scenes of procedural shapes and level sets keep the error that is asked for, against rays in closed form.
 */
#include "analytic.h"
#include "images.h"
#include "metrics.h"
#include "scenes.h"

enum { SIZE = 96, RAYS = 1024, MOST_SOLIDS = 16, FINE = 512 };
static const double SUN[3] = {-0.5, 0.6, -0.3}, ANGLE = 0.08726646259971647, AO_DISTANCE = 0.8;

/* Shapes as a scene's text and as the truth has them. */
typedef struct shapes {
    char text[4096];
    truth_solid solids[MOST_SOLIDS];
    size_t count;
} shapes;

static void add_shape(shapes *s, const truth_solid *solid) {
    char *end = s->text + strlen(s->text);
    const size_t left = sizeof s->text - strlen(s->text);
    const double *c = solid->center, *h = solid->half;
    const char *comma = s->count > 0 ? "," : "";
    if (solid->shape == TRUTH_SPHERE) {
        snprintf(end, left, "%s{\"spheres\": [[%g, %g, %g, %g]]}", comma, c[0], c[1], c[2], solid->radius);
    } else {
        char shape[128];
        snprintf(shape, sizeof shape,
                 solid->shape == TRUTH_BOX ? "\"box\", \"half_size\": [%g, %g, %g]"
                                           : "\"torus\", \"radius\": %g, \"tube_radius\": %g",
                 solid->shape == TRUTH_BOX ? h[0] : solid->radius,
                 solid->shape == TRUTH_BOX ? h[1] : solid->minor_radius, h[2]);
        snprintf(end, left, "%s{\"sdf\": {\"shape\": %s, \"translate\": [%g, %g, %g]}}", comma, shape, c[0],
                 c[1], c[2]);
    }
    assert_true(strlen(s->text) + 1 < sizeof s->text && s->count < MOST_SOLIDS);
    s->solids[s->count++] = *solid;
}

static void add_box(shapes *s, double x, double y, double z, double half_x, double half_y, double half_z) {
    add_shape(s, &(truth_solid){TRUTH_BOX, {x, y, z}, {half_x, half_y, half_z}, 0.0, 0.0});
}

static void add_plate(shapes *s, double half) {
    add_box(s, 0.0, -0.25, 0.0, half, 0.25, half);
}

static void make_touching(shapes *s) {
    add_plate(s, 3.0);
    add_shape(s, &(truth_solid){TRUTH_SPHERE, {0.0, 0.5, 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0});
    add_box(s, 1.2, 0.4, 0.3, 0.4, 0.4, 0.4);
}

static void make_posts(shapes *s) {
    add_plate(s, 3.0);
    for (int i = 0; i < 9; ++i) {
        add_box(s, 1.2 * (i % 3 - 1), 0.5, i / 3 - 1.0, 0.02, 0.5, 0.02);
    }
}

static void make_frames(shapes *s) {
    add_plate(s, 3.0);
    add_box(s, -1.0, 1.0, 0.0, 0.04, 1.0, 0.04);
    add_box(s, 1.0, 1.0, 0.0, 0.04, 1.0, 0.04);
    add_box(s, 0.0, 2.0, 0.0, 1.04, 0.04, 0.04);
    add_shape(s, &(truth_solid){TRUTH_TORUS, {1.2, 0.6, 1.2}, {0.0, 0.0, 0.0}, 0.5, 0.05});
}

static void make_far_plane(shapes *s) {
    add_plate(s, 8.0);
    add_box(s, 0.0, 1.05, 0.0, 0.6, 0.6, 0.6);
    add_shape(s, &(truth_solid){TRUTH_SPHERE, {0.2, 2.3, 0.1}, {0.0, 0.0, 0.0}, 0.35, 0.0});
}

typedef struct baked {
    float shadow[FINE * FINE], ao[FINE * FINE], valid[FINE * FINE];
    double shadow_error, ao_error; /* estimates */
} baked;

static baked b;

/* Bakes casters onto the floor of the seeds' scene. */
static void bake(const char *casters, double max_error, int size, baked *out) {
    char text[8192];
    snprintf(
        text, sizeof text,
        "{\"casters\": [%s], \"lights\": [{\"name\": \"sun\", \"type\": \"directional\", \"direction\": "
        "[%g, %g, %g], \"angle_deg\": 5}], \"ao\": {\"distance\": %g}, \"max_error\": %g, \"receivers\": "
        "[{\"mesh\": \"%s/seeds_floor.obj\", \"size\": %d, \"output\": \"%s\"}]}",
        casters, SUN[0], SUN[1], SUN[2], AO_DISTANCE, max_error, VSH_ASSETS, size, at("out.exr"));
    OWNED(vsh_scene) *scene = parse(at("scene.json"), text);
    vsh_bake_error errors[3];
    vsh_bake_report report = {.errors = errors};
    assert_ok(vsh_bake_scene(scene, NULL, NULL, &report, &failure));
    out->shadow_error = vsh_bake_error_rmse(&errors[0]);
    out->ao_error = vsh_bake_error_rmse(&errors[1]);
    OWNED(vsh_image_file) *file = image_from(at("out.exr"));
    const vsh_image image = vsh_image_view(file);
    const size_t bytes = (size_t)size * (size_t)size * sizeof(float);
    memcpy(out->shadow, plane_of(&image, "shadow.sun"), bytes);
    memcpy(out->ao, plane_of(&image, "ao"), bytes);
    memcpy(out->valid, plane_of(&image, "A"), bytes);
}

/* The middles of texels on the floor. */
static void place_texels(int size, double (*points)[3]) {
    for (int i = 0; i < size * size; ++i) {
        points[i][0] = -2.5 + 5.0 * ((double)(i % size) + 0.5) / size;
        points[i][1] = 1e-5;
        points[i][2] = -2.5 + 5.0 * ((double)(i / size) + 0.5) / size;
    }
}

static void check(const char *scene, const char *what, double max_error, const float *values,
                  const float *truth, double estimate) {
    const truth_metrics m = truth_compare(SIZE * SIZE, values, truth, b.valid);
    assert_that(m.rmse <= max_error && estimate >= 0.8 * m.rmse,
                "%s, %s: %g is asked, %g is the error, %g the estimate", scene, what, max_error, m.rmse,
                estimate);
}

TEST(procedural_scenes_keep_the_error_that_is_asked_for) {
    static const struct {
        const char *name;
        void (*make)(shapes *s);
    } scenes[] = {{"touching", make_touching},
                  {"posts", make_posts},
                  {"frames", make_frames},
                  {"far plane", make_far_plane}};
    static const double up[3] = {0.0, 1.0, 0.0}, errors[] = {0.02, 0.005};
    static float shadow[SIZE * SIZE], ao[SIZE * SIZE];
    static double points[SIZE * SIZE][3];
    place_texels(SIZE, points);
    for (size_t k = 0; k < COUNT_OF(scenes); ++k) {
        shapes s = {.count = 0};
        scenes[k].make(&s);
        const truth_scene truth = {s.solids, s.count};
        truth_lights(truth, SIZE * SIZE, points[0], up, SUN, tan(0.5 * ANGLE), INFINITY, RAYS, shadow);
        for (size_t i = 0; i < SIZE * SIZE; ++i) {
            ao[i] = (float)truth_ao(truth, points[i], up, AO_DISTANCE, RAYS);
        }
        for (size_t e = 0; e < COUNT_OF(errors); ++e) {
            bake(s.text, errors[e], SIZE, &b);
            check(scenes[k].name, "shadow", errors[e], b.shadow, shadow, b.shadow_error);
            check(scenes[k].name, "AO", errors[e], b.ao, ao, b.ao_error);
        }
    }
}

/* A box and a sphere in a level set of 0.0117; beside it a plane of 16 units, whose voxels would be larger.
 */
TEST(a_level_set_keeps_its_voxels_beside_a_large_plane) {
    static baked alone, beside;
    char text[1024];
    vsh_sdf_node nodes[3] = {box_node(0.6, 0.6, 0.6), vsh_sdf_node_default(),
                             operation_node(VSH_SDF_UNION, 0, 1)};
    nodes[0].translation[1] = 1.05;
    nodes[1].radius = 0.35;
    nodes[1].translation[1] = 2.3;
    OWNED(vsh_grid) *grid = grid_from_sdf(&(vsh_sdf){nodes, 3}, 0.0117);
    assert_ok(vsh_grid_write(grid, at("shape.vdb"), NULL, NULL, 0, &failure));
    snprintf(text, sizeof text, "{\"vdb\": \"%s\"}", at("shape.vdb"));
    bake(text, 0.005, SIZE, &alone);
    snprintf(
        text, sizeof text,
        "{\"vdb\": \"%s\"}, {\"sdf\": {\"shape\": \"plane\", \"half_size\": [8, 8], \"thickness\": 0.5}}",
        at("shape.vdb"));
    bake(text, 0.005, SIZE, &beside);
    assert_true(truth_compare(SIZE * SIZE, alone.shadow, beside.shadow, NULL).rmse < 0.005);
}

/* Mean square of second differences along rows first … last - 1, where the truth is within a penumbra. */
static double bend(const float *values, const float *truth, int first, int last) {
    double sum = 0.0;
    size_t count = 0;
    for (int row = first; row < last; ++row) {
        const float *v = values + (size_t)row * FINE, *t = truth + (size_t)row * FINE;
        for (int i = 1; i + 1 < FINE; ++i) {
            if (t[i] > 0.0005f && t[i] < 0.9995f) {
                const double second = (double)v[i - 1] - 2.0 * (double)v[i] + (double)v[i + 1];
                sum += second * second;
                ++count;
            }
        }
    }
    assert_true(count > 1000);
    return sum / (double)count;
}

TEST(penumbrae_rise_smoothly_at_their_ends) {
    enum { FIRST = 200, LAST = 240 };
    static const double up[3] = {0.0, 1.0, 0.0};
    static float truth[FINE * FINE];
    static double points[FINE * FINE][3];
    shapes s = {.count = 0};
    make_far_plane(&s);
    bake(s.text, 0.02, FINE, &b);
    place_texels(FINE, points);
    const size_t from = FIRST * FINE;
    truth_lights((truth_scene){s.solids, s.count}, (LAST - FIRST) * FINE, points[from], up, SUN,
                 tan(0.5 * ANGLE), INFINITY, 4 * RAYS, truth + from);
    const double ratio = sqrt(bend(b.shadow, truth, FIRST, LAST) / bend(truth, truth, FIRST, LAST));
    assert_that(ratio < 1.3, "second differences are %g times those of the truth", ratio);
}

FIXTURE(make_folder, remove_folder)
