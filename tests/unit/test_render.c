/* Pictures against closed forms: what a pinhole sees of spheres, planes and quads, and the light there. */
#include "shading.h"

#include <vdbshade/render.h>

#include <stdlib.h>

enum { WIDE = 64, HIGH = 48, PIXELS = WIDE * HIGH };

static float color[3 * PIXELS], alpha[PIXELS], depth[PIXELS], normal[3 * PIXELS];
static const vsh_picture picture = {color, alpha, depth, normal};

/* --- the same pinhole, by other means */

typedef struct pinhole {
    double eye[3], forward[3], right[3], up[3], pixel;
} pinhole;

static void normalise(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; ++i) {
        v[i] /= length;
    }
}

static void cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; ++i) {
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    }
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static pinhole pinhole_of(const vsh_camera *camera) {
    pinhole p;
    memcpy(p.eye, camera->position, sizeof p.eye);
    for (int i = 0; i < 3; ++i) {
        p.forward[i] = camera->target[i] - camera->position[i];
    }
    normalise(p.forward);
    cross(p.forward, camera->up, p.right);
    normalise(p.right);
    cross(p.right, p.forward, p.up);
    p.pixel = 2.0 * tan(0.5 * camera->fov) / HIGH;
    return p;
}

/* Through the middle of a pixel; 1 along the axis. */
static void ray_of(const pinhole *p, int x, int y, double ray[3]) {
    for (int i = 0; i < 3; ++i) {
        ray[i] = p->forward[i] +
                 p->pixel * ((x + 0.5 - 0.5 * WIDE) * p->right[i] - (y + 0.5 - 0.5 * HIGH) * p->up[i]);
    }
}

static vsh_camera camera_at(double x, double y, double z, double tx, double ty, double tz, double fov_deg) {
    vsh_camera camera = vsh_camera_default();
    const double position[3] = {x, y, z}, target[3] = {tx, ty, tz};
    memcpy(camera.position, position, sizeof position);
    memcpy(camera.target, target, sizeof target);
    camera.fov = RADIANS(fov_deg);
    return camera;
}

static vsh_render_options small(vsh_camera camera, int32_t samples) {
    vsh_render_options o = vsh_render_options_default();
    o.camera = camera;
    o.width = WIDE;
    o.height = HIGH;
    o.samples = samples;
    return o;
}

static void render(const vsh_surface *surfaces, size_t count, const vsh_field *field, const vsh_light *light,
                   const vsh_render_options *options, const vsh_run *run) {
    vsh_error error = {VSH_OK, ""};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    if (vsh_render(surfaces, count, field, light, light != NULL, options, run, &picture, &stats, &error) !=
        VSH_OK) {
        fail_msg("%s", error.message);
    }
    assert_int_equal(stats.unfinished, 0);
}

static vsh_field *ball(double x, double y, double z, double radius, double voxel) {
    const truth_solid solid = {.shape = TRUTH_SPHERE, .center = {x, y, z}, .radius = radius};
    return field_of((truth_scene){&solid, 1}, voxel, 0.0);
}

static void a_sphere_is_where_it_is_with_its_normals(void **state) {
    (void)state;
    enum { VOXELS = 50 };
    const double centre[3] = {0.1, -0.2, 0.3}, voxel = 1.0 / VOXELS;
    vsh_field *field = ball(centre[0], centre[1], centre[2], 1.0, voxel);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    const vsh_render_options o = small(camera_at(3.0, 2.0, 4.0, 0.0, 0.0, 0.0, 35.0), 1);
    render(&surface, 1, field, NULL, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    int seen = 0, missed = 0;
    for (int y = 0; y < HIGH; ++y) {
        for (int x = 0; x < WIDE; ++x) {
            const int at = y * WIDE + x;
            double ray[3], out[3] = {0.0}, to[3];
            ray_of(&p, x, y, ray);
            for (int i = 0; i < 3; ++i) {
                to[i] = centre[i] - p.eye[i];
            }
            const double length = sqrt(dot(ray, ray)), along = dot(to, ray) / length;
            const double miss = sqrt(dot(to, to) - along * along);
            if (miss > 1.0 + 0.1 * voxel) {
                assert_true(isinf(depth[at]));
                ++missed;
            } else if (miss < 1.0 - 0.1 * voxel) {
                for (int i = 0; i < 3; ++i) {
                    out[i] = p.eye[i] + (double)depth[at] * ray[i] - centre[i];
                }
                assert_true(fabs(sqrt(dot(out, out)) - 1.0) < 0.02 * voxel);
                assert_true(dot(out, ray) < 0.0); /* the near side */
                ++seen;
            }
            if (miss < 0.9) { /* normals are filtered: away from the edge */
                const double n[3] = {normal[3 * at], normal[3 * at + 1], normal[3 * at + 2]};
                assert_true(dot(n, out) / sqrt(dot(out, out)) > cos(RADIANS(0.7)));
            }
        }
    }
    assert_true(seen > 300 && missed > 300);
    vsh_field_free(field);
}

static void a_silhouette_has_its_area_and_soft_edges(void **state) {
    (void)state;
    vsh_field *field = ball(0.0, 0.0, 0.0, 1.0, 0.02);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    for (int32_t samples = 1; samples <= 4; samples += 3) {
        const vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 30.0), samples);
        render(&surface, 1, field, NULL, &o, NULL);
        const double radius = tan(asin(1.0 / 5.0)) / (2.0 * tan(RADIANS(15.0)) / HIGH);
        double area = 0.0;
        int between_them = 0;
        for (int i = 0; i < PIXELS; ++i) {
            assert_true(alpha[i] >= 0.0f && alpha[i] <= 1.0f);
            area += (double)alpha[i];
            between_them += alpha[i] > 0.1f && alpha[i] < 0.9f;
        }
        assert_true(fabs(area / (PI * radius * radius) - 1.0) < (samples > 1 ? 0.003 : 0.02));
        /* one ray a pixel hits or misses; more make an edge of about a pixel */
        assert_true(samples == 1 || between_them > 2.0 * PI * radius * 0.5);
    }
    vsh_field_free(field);
}

static void low_rays_do_not_miss_a_floor(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.05, 0.0);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    for (double height = 0.002; height < 0.2; height *= 1.7) {
        const vsh_render_options o = small(camera_at(-2.4, height, 2.9, 2.9, height, 2.6, 20.0), 1);
        render(&surface, 1, field, NULL, &o, NULL);
        const pinhole p = pinhole_of(&o.camera);
        int hit = 0;
        for (int i = 0; i < PIXELS; ++i) {
            double ray[3];
            ray_of(&p, i % WIDE, i / WIDE, ray);
            const double t = -p.eye[1] / ray[1], x = p.eye[0] + t * ray[0], z = p.eye[2] + t * ray[2];
            if (t > 0.0 && fabs(x) < 2.9 && fabs(z) < 2.9) {
                const double above = p.eye[1] + (double)depth[i] * ray[1];
                assert_true(isfinite(depth[i]) && above > -0.002); /* on the floor, or on what stands on it */
                ++hit;
            }
        }
        assert_true(hit > 500);
    }
    vsh_field_free(field);
}

/* The documented filter with one sample a pixel: Blackman and Harris' window at -1, 0 and 1 of 1.5. */
static void a_floor_has_the_shadow_of_its_points(void **state) {
    (void)state;
    static float direct[PIXELS];
    vsh_field *field = field_of(truth_seeds(), 0.03, 0.0);
    const vsh_surface surface = {field, {0.5, 0.25, 1.0}};
    vsh_render_options o = small(camera_at(1.0, 5.0, 3.0, 0.0, 0.0, 0.0, 40.0), 1);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const float up[3] = {0.0f, 1.0f, 0.0f};
    const double cosine = 0.6 / sqrt(0.25 + 0.36 + 0.36);
    memset(o.sky, 0, sizeof o.sky);
    render(&surface, 1, field, &light, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    for (int i = 0; i < PIXELS; ++i) {
        double ray[3], at[3];
        ray_of(&p, i % WIDE, i / WIDE, ray);
        for (int k = 0; k < 3; ++k) {
            at[k] = p.eye[k] + (double)depth[i] * ray[k];
        }
        const bool on_floor =
            isfinite(depth[i]) && fabs(at[1]) < 0.003 && fabs(at[0]) < 2.8 && fabs(at[2]) < 2.8;
        direct[i] = on_floor ? (float)cosine * shadow_at(field, &light, VSH_SHADOW_CONE, at, up) : NAN;
    }
    double weight[3], sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double x = 2.0 * PI * (i + 0.5) / 3.0;
        weight[i] = 0.35875 - 0.48829 * cos(x) + 0.14128 * cos(2.0 * x) - 0.01168 * cos(3.0 * x);
        sum += weight[i];
    }
    int lit = 0, dark = 0, penumbra = 0;
    for (int y = 1; y + 1 < HIGH; ++y) {
        for (int x = 1; x + 1 < WIDE; ++x) {
            double expected = 0.0;
            for (int k = 0; k < 9; ++k) {
                expected += weight[k / 3] * weight[k % 3] / (sum * sum) *
                            (double)direct[(y + k / 3 - 1) * WIDE + x + k % 3 - 1];
            }
            if (isfinite(expected)) {
                const float *c = color + 3 * (y * WIDE + x);
                assert_true(fabs((double)c[0] - 0.5 * expected) < 0.004);
                assert_true(fabs((double)c[1] - 0.25 * expected) < 0.002);
                assert_true(fabs((double)c[2] - expected) < 0.008);
                lit += expected > 0.99 * cosine;
                dark += expected < 0.01;
                penumbra += expected > 0.1 && expected < 0.9 * cosine;
            }
        }
    }
    assert_true(lit > 300 && dark > 3 && penumbra > 60);
    vsh_field_free(field);
}

static void the_nearest_surface_has_its_own_color(void **state) {
    (void)state;
    vsh_field *front = ball(0.0, 0.0, 1.0, 0.5, 0.05), *back = ball(0.4, 0.0, -1.0, 0.8, 0.05);
    const vsh_surface surfaces[2] = {{back, {0.9, 0.1, 0.2}}, {front, {0.1, 0.8, 0.3}}};
    vsh_render_options o = small(camera_at(0.0, 0.0, 6.0, 0.0, 0.0, 0.0, 25.0), 2);
    const double sky[3] = {0.5, 1.0, 2.0};
    memcpy(o.sky, sky, sizeof sky);
    render(surfaces, 2, front, NULL, &o, NULL);
    const float *middle = color + 3 * (HIGH / 2 * WIDE + WIDE / 2);
    const float *beside = color + 3 * (HIGH / 2 * WIDE + WIDE / 2 + 16);
    const float *nothing = color;
    for (int c = 0; c < 3; ++c) {
        assert_true(fabs((double)middle[c] - surfaces[1].color[c] * sky[c]) < 1e-5);
        assert_true(fabs((double)beside[c] - surfaces[0].color[c] * sky[c]) < 1e-5);
        assert_true(fabs((double)nothing[c] - o.background[c]) < 1e-5);
    }
    vsh_field_free(front);
    vsh_field_free(back);
}

static void who_looks_from_within_sees_out(void **state) {
    (void)state;
    vsh_field *within = ball(0.0, 0.0, 0.0, 1.0, 0.05), *beyond = ball(4.0, 0.0, 0.0, 1.0, 0.05);
    const vsh_surface surfaces[2] = {{within, {0.5, 0.5, 0.5}}, {beyond, {0.5, 0.5, 0.5}}};
    const vsh_render_options o = small(camera_at(0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 20.0), 1);
    render(surfaces, 2, within, NULL, &o, NULL);
    assert_true(fabs((double)depth[HIGH / 2 * WIDE + WIDE / 2] - 3.0) < 0.01);
    vsh_field_free(within);
    vsh_field_free(beyond);
}

/* --- fog */

/* The box is the sphere's, 2 deep; its diagonal is 2 √3: off by a voxel of its bounds. */
static void fog_in_the_sun_shines_and_in_shadow_does_not(void **state) {
    (void)state;
    vsh_field *field = ball(0.0, 0.0, 0.0, 1.0, 0.02);
    const vsh_surface surface = {field, {0.0, 0.0, 0.0}};
    const double x[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(x, 0.0);
    const double extinction = 1.0 / (2.0 * sqrt(3.0));
    for (int side = 0; side < 2; ++side) {
        /* lit: past the sphere, at a corner of the box; dark: on it, all the way in its shadow */
        const double sx = side == 0 ? 0.9 : -0.9, sy = side == 0 ? 0.9 : 0.0;
        vsh_render_options o = small(camera_at(sx, sy, 200.0, sx, sy, 0.0, 0.1), 2);
        o.shafts = 1.0;
        o.shaft_steps = 16;
        memset(o.sky, 0, sizeof o.sky);
        render(&surface, 1, field, &light, &o, NULL);
        const double left = exp(-2.0 * extinction);
        const float *c = color + 3 * (HIGH / 2 * WIDE + WIDE / 2);
        if (side == 0) {
            assert_true(fabs((double)c[0] - (o.background[0] * left + 1.0 - left)) < 0.015);
        } else {
            assert_true((double)c[0] < 0.005);
        }
    }
    vsh_field_free(field);
}

/* --- lightmaps */

static const float quad_positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
static const float quad_uvs[] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint32_t quad_indices[] = {0, 1, 2, 0, 2, 3};

static vsh_mesh quad(void) {
    return (vsh_mesh){.positions = quad_positions,
                      .uvs = quad_uvs,
                      .indices = quad_indices,
                      .vertex_count = 4,
                      .triangle_count = 2};
}

/* Texel centres at (i + ½) / N, row 0 at v = 1. */
static void a_lightmap_is_looked_up_where_it_was_baked(void **state) {
    (void)state;
    enum { N = 4 };
    float ao[N * N], shadow[N * N];
    for (int i = 0; i < N * N; ++i) {
        ao[i] = (float)(0.1 + 0.2 * (i % N));
        shadow[i] = (float)(0.9 - 0.2 * (i / N)); /* light at the top */
    }
    const char *const names[] = {"ao", "shadow.sun"};
    const float *const planes[] = {ao, shadow};
    const vsh_image image = {N, N, 2, names, planes};
    const vsh_mesh mesh = quad();
    const vsh_lit_meshes lit = {&mesh, 1, &image, {0.5, 1.0, 0.25}};
    const double z[3] = {0.0, 0.0, 1.0};
    const vsh_light light = sun(z, 0.1);
    vsh_field *field = ball(0.0, 0.0, -3.0, 0.5, 0.05); /* hidden behind it */
    const vsh_surface surface = {field, {1.0, 0.0, 0.0}};
    vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0), 1);
    const double sky[3] = {1.0, 0.0, 2.0};
    memcpy(o.sky, sky, sizeof sky);
    o.lit = &lit;
    o.lit_count = 1;
    render(&surface, 1, field, &light, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    int inside = 0;
    for (int i = 0; i < PIXELS; ++i) {
        double ray[3];
        ray_of(&p, i % WIDE, i / WIDE, ray);
        const double x = 5.0 * ray[0], y = 5.0 * ray[1];
        /* between the outermost texel centres both are linear, and no filter shows */
        if (fabs(x) < 0.65 && fabs(y) < 0.65) {
            const double open = 0.1 + 0.2 * (0.5 * (x + 1.0) * N - 0.5);
            const double seen = 0.9 - 0.2 * ((1.0 - 0.5 * (y + 1.0)) * N - 0.5);
            assert_true(fabs((double)depth[i] - 5.0) < 1e-5);
            assert_true(fabs((double)color[3 * i] - 0.5 * (seen + open)) < 1e-4);
            assert_true(fabs((double)color[3 * i + 1] - seen) < 1e-4);
            assert_true(fabs((double)color[3 * i + 2] - 0.25 * (seen + 2.0 * open)) < 1e-4);
            ++inside;
        } else if (fabs(x) < 0.95 && fabs(y) < 0.95) {
            assert_true(alpha[i] == 1.0f); /* no gap along the diagonal either */
        }
    }
    assert_true(inside > 300);
    const char *const others[] = {"ao", "shadow.moon"};
    const vsh_image missing = {N, N, 2, others, planes};
    const vsh_lit_meshes wrong = {&mesh, 1, &missing, {0.5, 0.5, 0.5}};
    vsh_error error;
    o.lit = &wrong;
    assert_int_equal(vsh_render(&surface, 1, field, &light, 1, &o, NULL, &picture, NULL, &error),
                     VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "shadow.sun"));
    vsh_field_free(field);
}

static void irradiance_comes_before_shadows(void **state) {
    (void)state;
    const float red[1] = {0.2f}, green[1] = {0.4f}, blue[1] = {0.6f}, dark[1] = {0.0f};
    const char *const names[] = {"irradiance.B", "irradiance.G", "irradiance.R", "shadow.sun"};
    const float *const planes[] = {blue, green, red, dark};
    const vsh_image image = {1, 1, 4, names, planes};
    const vsh_mesh mesh = quad();
    const vsh_lit_meshes lit = {&mesh, 1, &image, {1.0, 1.0, 0.5}};
    const vsh_light light = vsh_light_default();
    vsh_field *field = ball(0.0, 0.0, -3.0, 0.5, 0.05);
    vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0), 1);
    memset(o.sky, 0, sizeof o.sky);
    o.lit = &lit;
    o.lit_count = 1;
    render(NULL, 0, field, &light, &o, NULL);
    const float *c = color + 3 * (HIGH / 2 * WIDE + WIDE / 2);
    assert_true(fabs((double)c[0] - 0.2) < 1e-5 && fabs((double)c[1] - 0.4) < 1e-5 &&
                fabs((double)c[2] - 0.3) < 1e-5);
    vsh_field_free(field);
}

/* --- what holds for all */

static void threads_and_instruction_sets_change_no_bit(void **state) {
    (void)state;
    static float first[3 * PIXELS];
    vsh_field *field = field_of(truth_seeds(), 0.05, 0.0);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    vsh_render_options o = small(camera_at(3.0, 3.0, 4.0, 0.0, 0.5, 0.0, 40.0), 2);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    o.ao = 1;
    o.shafts = 0.3;
    o.shaft_steps = 3;
    const struct { int32_t threads, isa; } runs[] = {{1, VSH_ISA_BASE}, {3, VSH_ISA_BASE}, {2, VSH_ISA_BEST}};
    for (size_t i = 0; i < sizeof runs / sizeof runs[0]; ++i) {
        vsh_run run = vsh_run_default();
        run.threads = runs[i].threads;
        run.isa = runs[i].isa;
        render(&surface, 1, field, &light, &o, &run);
        if (i == 0) {
            memcpy(first, color, sizeof first);
        }
        assert_memory_equal(first, color, sizeof first);
    }
    vsh_field_free(field);
}

static int32_t stop(void *user, const char *stage, double fraction) {
    (void)stage;
    double *seen = user;
    assert_true(fraction >= *seen && fraction <= 1.0);
    *seen = fraction;
    return fraction > 0.3;
}

static void a_render_can_be_cancelled_and_limited(void **state) {
    (void)state;
    vsh_field *field = ball(0.0, 0.0, 0.0, 1.0, 0.1);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    const vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 30.0), 4);
    vsh_run run = vsh_run_default();
    vsh_error error;
    double seen = 0.0;
    run.progress = stop;
    run.user = &seen;
    assert_int_equal(vsh_render(&surface, 1, field, NULL, 0, &o, &run, &picture, NULL, &error),
                     VSH_ERROR_CANCELLED);
    run = vsh_run_default();
    run.memory_limit = 100000;
    assert_int_equal(vsh_render(&surface, 1, field, NULL, 0, &o, &run, &picture, NULL, &error),
                     VSH_ERROR_LIMIT);
    vsh_field_free(field);
}

static void options_out_of_range_are_refused(void **state) {
    (void)state;
    vsh_field *field = ball(0.0, 0.0, 0.0, 1.0, 0.1);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}}, bright = {field, {0.5, 1.5, 0.5}},
                      none = {NULL, {0.5, 0.5, 0.5}};
    const vsh_render_options good = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 30.0), 1);
    vsh_render_options bad[8];
    const char *const parts[] = {"width", "height",     "samples",     "shafts",
                                 "sky",   "background", "shaft_steps", "fov"};
    for (int i = 0; i < 8; ++i) {
        bad[i] = good;
    }
    bad[0].width = 0;
    bad[1].height = VSH_MAX_PICTURE_SIZE + 1;
    bad[2].width = VSH_MAX_PICTURE_SIZE;
    bad[2].samples = 8;
    bad[3].shafts = NAN;
    bad[4].sky[1] = -1.0;
    bad[5].background[2] = INFINITY;
    bad[6].shaft_steps = 65;
    bad[7].camera.fov = 4.0;
    vsh_error error;
    for (int i = 0; i < 8; ++i) {
        assert_int_equal(vsh_render(&surface, 1, field, NULL, 0, &bad[i], NULL, &picture, NULL, &error),
                         VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, parts[i]));
    }
    assert_int_equal(vsh_render(&bright, 1, field, NULL, 0, &good, NULL, &picture, NULL, &error),
                     VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_render(&none, 1, field, NULL, 0, &good, NULL, &picture, NULL, &error),
                     VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_render(&surface, 1, NULL, NULL, 0, &good, NULL, &picture, NULL, &error),
                     VSH_ERROR_ARGUMENT);
    vsh_field_free(field);
}

static void gradients_are_dithered_to_srgb(void **state) {
    (void)state;
    static float planes[4][PIXELS];
    float *const rgb[3] = {planes[0], planes[1], planes[2]};
    vsh_error error;
    for (int i = 0; i < PIXELS; ++i) {
        color[3 * i] = 0.25f;
        color[3 * i + 1] = 0.0f;
        color[3 * i + 2] = 1.0f;
        alpha[i] = 0.5f;
    }
    assert_int_equal(vsh_picture_encode(&picture, WIDE, HIGH, 1.0, rgb, NULL, &error), VSH_OK);
    double mean = 0.0;
    for (int i = 0; i < PIXELS; ++i) {
        const double steps = 255.0 * (double)planes[0][i];
        assert_true(fabs(steps - round(steps)) < 1e-3 && fabs(steps - 187.516) < 1.0);
        assert_true(planes[1][i] == 0.0f && planes[2][i] == 1.0f);
        mean += steps / PIXELS;
    }
    assert_true(fabs(mean - 187.516) < 0.05); /* of 0.5: 0.735357 */
    assert_int_equal(vsh_picture_encode(&picture, WIDE, HIGH, 0.0, rgb, planes[3], &error), VSH_OK);
    assert_true(fabs(255.0 * (double)planes[0][7] - 187.516) < 1.0); /* 0.25 over half of a pixel */
    assert_true(fabs((double)planes[3][7] - 128.0 / 255.0) < 1e-6);
    assert_int_equal(vsh_picture_encode(&picture, WIDE, HIGH, NAN, rgb, NULL, &error), VSH_ERROR_ARGUMENT);
}

/* --- cameras */

static void cameras_that_see_nothing_are_refused(void **state) {
    (void)state;
    vsh_error error;
    vsh_camera camera = camera_at(1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "position and target"));
    camera = camera_at(0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "up"));
    camera = camera_at(0.0, NAN, 0.0, 0.0, 0.0, 0.0, 30.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    camera = camera_at(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0);
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
    camera = vsh_camera_default();
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_OK);
    camera.struct_size = 4;
    assert_int_equal(vsh_camera_check(&camera, &error), VSH_ERROR_ARGUMENT);
}

static void a_framed_box_fills_the_picture(void **state) {
    (void)state;
    const double low[3] = {-3.0, 0.0, 1.0}, high[3] = {2.0, 1.0, 4.0};
    const double ups[3][3] = {{0.0, 1.0, 0.0}, {0.0, 0.0, 2.0}, {0.3, 0.5, -0.2}};
    for (int u = 0; u < 3; ++u) {
        for (double azimuth = 0.0; azimuth < 6.0; azimuth += 0.7) {
            vsh_camera camera = vsh_camera_default();
            vsh_error error;
            memcpy(camera.up, ups[u], sizeof camera.up);
            assert_int_equal(vsh_camera_frame(&camera, low, high, azimuth, 0.4, (double)WIDE / HIGH, &error),
                             VSH_OK);
            assert_int_equal(vsh_camera_check(&camera, &error), VSH_OK);
            const pinhole p = pinhole_of(&camera);
            double most = 0.0;
            for (int corner = 0; corner < 8; ++corner) {
                double to[3];
                for (int i = 0; i < 3; ++i) {
                    to[i] = (corner >> i & 1 ? high[i] : low[i]) - p.eye[i];
                }
                const double away = dot(to, p.forward);
                most = fmax(most, fabs(dot(to, p.right)) / (away * p.pixel * 0.5 * WIDE));
                most = fmax(most, fabs(dot(to, p.up)) / (away * p.pixel * 0.5 * HIGH));
                assert_true(away > 0.0);
            }
            assert_true(most < 1.0 && most > 0.9);
        }
    }
}

static void an_orbit_turns_around_the_target(void **state) {
    (void)state;
    vsh_camera camera = camera_at(1.0, 2.0, 7.0, 1.0, 1.0, 3.0, 30.0);
    vsh_camera_orbit(&camera, 0.5 * PI);
    const double expected[3] = {5.0, 2.0, 3.0};
    for (int i = 0; i < 3; ++i) {
        assert_true(fabs(camera.position[i] - expected[i]) < 1e-12);
    }
    for (int i = 0; i < 5; ++i) {
        vsh_camera_orbit(&camera, 0.3 * PI);
    }
    assert_true(fabs(camera.position[2] - 7.0) < 1e-12 && fabs(camera.position[0] - 1.0) < 1e-12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_is_where_it_is_with_its_normals),
        cmocka_unit_test(a_silhouette_has_its_area_and_soft_edges),
        cmocka_unit_test(low_rays_do_not_miss_a_floor),
        cmocka_unit_test(a_floor_has_the_shadow_of_its_points),
        cmocka_unit_test(the_nearest_surface_has_its_own_color),
        cmocka_unit_test(who_looks_from_within_sees_out),
        cmocka_unit_test(fog_in_the_sun_shines_and_in_shadow_does_not),
        cmocka_unit_test(a_lightmap_is_looked_up_where_it_was_baked),
        cmocka_unit_test(irradiance_comes_before_shadows),
        cmocka_unit_test(threads_and_instruction_sets_change_no_bit),
        cmocka_unit_test(a_render_can_be_cancelled_and_limited),
        cmocka_unit_test(options_out_of_range_are_refused),
        cmocka_unit_test(gradients_are_dithered_to_srgb),
        cmocka_unit_test(cameras_that_see_nothing_are_refused),
        cmocka_unit_test(a_framed_box_fills_the_picture),
        cmocka_unit_test(an_orbit_turns_around_the_target),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
