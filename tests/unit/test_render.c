/* Pictures against closed forms: what a pinhole sees of spheres and planes, and the light there. */
#include "shading.h"
#include "testing.h"

enum { WIDE = 64, HIGH = 48, PIXELS = WIDE * HIGH };

static float color[3 * PIXELS], alpha[PIXELS], depth[PIXELS], normal[3 * PIXELS];
static const vsh_picture picture = {color, alpha, depth, normal};

/* --- a pinhole by other means than the library's, and short ways to small pictures */

typedef struct pinhole {
    double eye[3], forward[3], right[3], up[3], pixel;
} pinhole;

static void unit(double v[3]) {
    go_along((double[3]){0}, 1.0 / length3(v), (double[]){v[0], v[1], v[2]}, v);
}

static void cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; ++i) {
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    }
}

static pinhole pinhole_of(const vsh_camera *camera) {
    pinhole p;
    memcpy(p.eye, camera->position, sizeof p.eye);
    go_along(camera->target, -1.0, camera->position, p.forward);
    unit(p.forward);
    cross(p.forward, camera->up, p.right);
    unit(p.right);
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
    vsh_render_options o = preview_render_options();
    o.camera = camera;
    o.width = WIDE;
    o.height = HIGH;
    o.samples = samples;
    return o;
}

static void render(const vsh_surface *surfaces, size_t count, const vsh_field *field, const vsh_light *light,
                   const vsh_render_options *options, const vsh_run *run) {
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_render(surfaces, count, occluders_of(field), light, light != NULL, options, run, &picture,
                         &stats, &failure));
    assert_int_equal(stats.unfinished, 0);
}

static vsh_field *ball(double x, double y, double z, double radius, double voxel) {
    const truth_solid solid = {.shape = TRUTH_SPHERE, .center = {x, y, z}, .radius = radius};
    return field_of((truth_scene){&solid, 1}, voxel, 0.0);
}

/* The middle of a picture. */
enum { MIDDLE = HIGH / 2 * WIDE + WIDE / 2 };

TEST(a_sphere_is_where_it_is_with_its_normals) {
    const double centre[3] = {0.1, -0.2, 0.3}, voxel = 0.02;
    OWNED(vsh_field) *field = ball(centre[0], centre[1], centre[2], 1.0, voxel);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    const vsh_render_options o = small(camera_at(3.0, 2.0, 4.0, 0.0, 0.0, 0.0, 35.0), 1);
    render(&surface, 1, field, NULL, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    int seen = 0, missed = 0;
    for (int at = 0; at < PIXELS; ++at) {
        double ray[3], out[3] = {0.0}, to[3];
        ray_of(&p, at % WIDE, at / WIDE, ray);
        go_along(centre, -1.0, p.eye, to);
        const double along = dot3(to, ray) / length3(ray), miss = sqrt(dot3(to, to) - along * along);
        if (miss > 1.0 + 0.1 * voxel) {
            assert_true(isinf(depth[at]));
            ++missed;
        } else if (miss < 1.0 - 0.1 * voxel) {
            go_along(p.eye, (double)depth[at], ray, out);
            go_along(out, -1.0, centre, out);
            assert_true(fabs(length3(out) - 1.0) < 0.02 * voxel);
            assert_true(dot3(out, ray) < 0.0); /* the near side */
            ++seen;
        }
        if (miss < 0.9) { /* normals are filtered: away from the edge */
            const double n[3] = {normal[3 * at], normal[3 * at + 1], normal[3 * at + 2]};
            assert_true(dot3(n, out) / length3(out) > cos(RADIANS(0.7)));
        }
    }
    assert_true(seen > 300 && missed > 300);
}

TEST(a_silhouette_has_its_area_and_soft_edges) {
    OWNED(vsh_field) *field = ball(0.0, 0.0, 0.0, 1.0, 0.02);
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
}

/* Rays that meet y = 0 within a square end at heights in a range. */
static void assert_rays_end(const vsh_field *field, vsh_camera camera, double half, double low, double high,
                            int least) {
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}};
    const vsh_render_options o = small(camera, 1);
    render(&surface, 1, field, NULL, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    int hit = 0;
    for (int i = 0; i < PIXELS; ++i) {
        double ray[3];
        ray_of(&p, i % WIDE, i / WIDE, ray);
        const double t = -p.eye[1] / ray[1], x = p.eye[0] + t * ray[0], z = p.eye[2] + t * ray[2];
        if (t > 0.0 && fabs(x) < half && fabs(z) < half) {
            const double height = p.eye[1] + (double)depth[i] * ray[1];
            assert_true(isfinite(depth[i]) && height > low && height < high);
            ++hit;
        }
    }
    assert_true(hit > least);
}

/* A floor seen from low over it, with what stands on it; a sheet two voxels thick, seen from many sides. */
TEST(no_ray_misses_a_floor_or_a_thin_sheet) {
    vsh_field *seeds = field_of(truth_seeds(), 0.05, 0.0);
    for (double height = 0.002; height < 0.2; height *= 1.7) {
        assert_rays_end(seeds, camera_at(-2.4, height, 2.9, 2.9, height, 2.6, 20.0), 2.9, -0.002, INFINITY,
                        500);
    }
    vshi_field_free(seeds);
    const truth_solid solid = {.shape = TRUTH_BOX, .half = {2.0, 0.05, 2.0}};
    OWNED(vsh_field) *sheet = field_of((truth_scene){&solid, 1}, 0.05, 0.0);
    for (double height = 0.3; height < 40.0; height *= 1.6) {
        assert_rays_end(sheet, camera_at(0.9, height, 1.1, 0.0, 0.0, 0.0, 30.0), 1.9, 0.048, 0.052, 20);
    }
}

/* Visibility × cosine of the seeds' sun, or (NULL) AO. */
static float floor_light(const vsh_field *field, const vsh_light *light, const double at[3]) {
    const float up[3] = {0.0f, 1.0f, 0.0f};
    if (light != NULL) {
        return (float)(0.6 / sqrt(0.25 + 0.36 + 0.36)) * shadow_at(field, light, VSH_SHADOW_CONE, at, up);
    }
    const vsh_points points = {1, at, up, NULL};
    float open = -1.0f;
    const vsh_shade_options shade = preview_options();
    shade_ao_points(occluders_of(field), &points, &shade, NULL, &open, NULL);
    return open;
}

/* `full`: of a point that is lit. The documented filter with one sample a pixel: Blackman and Harris' window
 * at -1, 0 and 1 of 1.5. */
static void check_floor(const vsh_field *field, const vsh_light *light, vsh_render_options o, double full,
                        int *dark, int *lit, int *between_them) {
    static float direct[PIXELS];
    const vsh_surface surface = {field, {0.5, 0.25, 1.0}};
    render(&surface, 1, field, light, &o, NULL);
    const pinhole p = pinhole_of(&o.camera);
    for (int i = 0; i < PIXELS; ++i) {
        double ray[3], at[3];
        ray_of(&p, i % WIDE, i / WIDE, ray);
        go_along(p.eye, (double)depth[i], ray, at);
        const bool on_floor =
            isfinite(depth[i]) && fabs(at[1]) < 0.003 && fabs(at[0]) < 2.8 && fabs(at[2]) < 2.8;
        direct[i] = on_floor ? floor_light(field, light, at) : NAN;
    }
    double weight[3], sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double x = 2.0 * PI * (i + 0.5) / 3.0;
        weight[i] = 0.35875 - 0.48829 * cos(x) + 0.14128 * cos(2.0 * x) - 0.01168 * cos(3.0 * x);
        sum += weight[i];
    }
    *dark = *lit = *between_them = 0;
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
                *dark += expected < 0.01;
                *lit += expected > full;
                *between_them += expected > 0.05 && expected < 0.9 * full;
            }
        }
    }
}

TEST(a_floor_has_the_shadow_and_the_ao_of_its_points) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.03, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    vsh_render_options o = small(camera_at(1.0, 5.0, 3.0, 0.0, 0.0, 0.0, 40.0), 1);
    int dark, lit, between_them;
    memset(o.sky, 0, sizeof o.sky);
    check_floor(field, &light, o, 0.6, &dark, &lit, &between_them);
    assert_true(dark > 3 && lit > 300 && between_them > 60);
    o.ao = 1;
    o.sky[0] = o.sky[1] = o.sky[2] = 1.0;
    check_floor(field, NULL, o, 0.9, &dark, &lit, &between_them);
    assert_true(lit > 300 && between_them > 10);
}

TEST(the_nearest_surface_has_its_own_color) {
    OWNED(vsh_field) *front = ball(0.0, 0.0, 1.0, 0.5, 0.05), *back = ball(0.4, 0.0, -1.0, 0.8, 0.05);
    const vsh_surface surfaces[2] = {{back, {0.9, 0.1, 0.2}}, {front, {0.1, 0.8, 0.3}}};
    vsh_render_options o = small(camera_at(0.0, 0.0, 6.0, 0.0, 0.0, 0.0, 25.0), 2);
    const double sky[3] = {0.5, 1.0, 2.0};
    memcpy(o.sky, sky, sizeof sky);
    render(surfaces, 2, front, NULL, &o, NULL);
    const float *middle = color + 3 * MIDDLE, *beside = middle + 3 * 16, *nothing = color;
    for (int c = 0; c < 3; ++c) {
        assert_true(fabs((double)middle[c] - surfaces[1].color[c] * sky[c]) < 1e-5);
        assert_true(fabs((double)beside[c] - surfaces[0].color[c] * sky[c]) < 1e-5);
        assert_true(fabs((double)nothing[c] - o.background[c]) < 1e-5);
    }
}

TEST(a_camera_inside_a_solid_sees_out) {
    OWNED(vsh_field) *within = ball(0.0, 0.0, 0.0, 1.0, 0.05), *beyond = ball(4.0, 0.0, 0.0, 1.0, 0.05);
    const vsh_surface surfaces[2] = {{within, {0.5, 0.5, 0.5}}, {beyond, {0.5, 0.5, 0.5}}};
    const vsh_render_options o = small(camera_at(0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 20.0), 1);
    render(surfaces, 2, within, NULL, &o, NULL);
    assert_true(fabs((double)depth[MIDDLE] - 3.0) < 0.01);
}

/* --- all pictures */

TEST(options_out_of_range_and_limits_are_refused) {
    OWNED(vsh_field) *field = ball(0.0, 0.0, 0.0, 1.0, 0.1);
    const vsh_occluders *casters = occluders_of(field);
    const vsh_surface surface = {field, {0.5, 0.5, 0.5}}, bright = {field, {0.5, 1.5, 0.5}};
    const vsh_render_options good = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 30.0), 4);
    vsh_render_options bad[8] = {good, good, good, good, good, good, good, good};
    static const char *const parts[] = {"width", "height",     "samples",     "shafts",
                                        "sky",   "background", "shaft_steps", "fov"};
    bad[0].width = 0;
    bad[1].height = VSH_MAX_PICTURE_SIZE + 1;
    bad[2].width = VSH_MAX_PICTURE_SIZE;
    bad[2].samples = 8;
    bad[3].shafts = NAN;
    bad[4].sky[1] = -1.0;
    bad[5].background[2] = INFINITY;
    bad[6].shaft_steps = 65;
    bad[7].camera.fov = 4.0;
    for (int i = 0; i < 8; ++i) {
        assert_fails(vsh_render(&surface, 1, casters, NULL, 0, &bad[i], NULL, &picture, NULL, &failure),
                     VSH_ERROR_ARGUMENT, parts[i]);
    }
    assert_fails(vsh_render(&bright, 1, casters, NULL, 0, &good, NULL, &picture, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "");
    const vsh_run run = run_within(100000);
    assert_fails(vsh_render(&surface, 1, casters, NULL, 0, &good, &run, &picture, NULL, &failure),
                 VSH_ERROR_LIMIT, "");
}

/* --- cameras */

TEST(cameras_that_see_nothing_are_refused) {
    struct {
        vsh_camera camera;
        const char *part;
    } cases[] = {{camera_at(1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 30.0), "position and target"},
                 {camera_at(0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 30.0), "up"},
                 {camera_at(0.0, NAN, 0.0, 0.0, 0.0, 0.0, 30.0), ""},
                 {camera_at(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0), ""},
                 {{.struct_size = 4}, ""}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        assert_fails(vsh_camera_orbit(&cases[i].camera, 0.0, &failure), VSH_ERROR_ARGUMENT, cases[i].part);
    }
    vsh_camera good = vsh_camera_default();
    assert_ok(vsh_camera_orbit(&good, 0.0, &failure));
    assert_fails(vsh_camera_orbit(&good, NAN, &failure), VSH_ERROR_ARGUMENT, "angle nan");
    const double points[2][6] = {{1.0, 2.0, 3.0, 1.0, 2.0, 3.0}, {0.0, 0.0, 0.0, NAN, 1.0, 1.0}};
    const struct {
        size_t count;
        const double *points;
    } framed[] = {{2, points[0]}, {2, points[1]}, {0, points[1]}, {2, NULL}};
    for (size_t i = 0; i < COUNT_OF(framed); ++i) {
        vsh_camera camera = good;
        assert_fails(
            vsh_camera_frame_points(&camera, framed[i].count, framed[i].points, 0.0, 0.0, 1.0, &failure),
            VSH_ERROR_ARGUMENT, "");
    }
}

/* Checks that all points lie before the camera, and finds the ends of their picture: -1 … 1 is all of it. */
static void assert_framed(vsh_camera camera, size_t count, const double (*points)[3], double low[2],
                          double high[2]) {
    assert_ok(vsh_camera_orbit(&camera, 0.0, &failure));
    const pinhole p = pinhole_of(&camera);
    low[0] = low[1] = INFINITY;
    high[0] = high[1] = -INFINITY;
    for (size_t i = 0; i < count; ++i) {
        double to[3];
        go_along(points[i], -1.0, p.eye, to);
        const double away = dot3(to, p.forward);
        const double at[2] = {dot3(to, p.right) / (away * p.pixel * 0.5 * WIDE),
                              dot3(to, p.up) / (away * p.pixel * 0.5 * HIGH)};
        assert_true(away > 0.0);
        for (int axis = 0; axis < 2; ++axis) {
            low[axis] = fmin(low[axis], at[axis]);
            high[axis] = fmax(high[axis], at[axis]);
        }
    }
}

TEST(framed_boxes_and_points_fill_the_picture) {
    enum { COUNT = 50 };
    const double ups[3][3] = {{0.0, 1.0, 0.0}, {0.0, 0.0, 2.0}, {0.3, 0.5, -0.2}},
                 aspect = (double)WIDE / HIGH;
    double box[8][3], points[COUNT][3], low[2], high[2];
    for (int i = 0; i < 8; ++i) {
        memcpy(box[i], (double[]){i & 1 ? 2.0 : -3.0, i & 2 ? 1.0 : 0.0, i & 4 ? 4.0 : 1.0}, sizeof box[i]);
    }
    for (int i = 0; i < COUNT; ++i) {
        points[i][0] = 5.0 + 3.0 * sin(12.9898 * i + 1.0);
        points[i][1] = 0.7 * sin(78.233 * i + 2.0);
        points[i][2] = -2.0 + sin(37.719 * i + 3.0);
    }
    for (int u = 0; u < 3; ++u) {
        for (double azimuth = 0.0; azimuth < 6.0; azimuth += 0.7) {
            vsh_camera camera = vsh_camera_default();
            memcpy(camera.up, ups[u], sizeof camera.up);
            assert_ok(vsh_camera_frame(&camera, box[0], box[7], azimuth, 0.4, aspect, &failure));
            assert_framed(camera, 8, (const double(*)[3])box, low, high);
            const double most = fmax(fmax(high[0], high[1]), -fmin(low[0], low[1]));
            assert_true(most < 1.0 && most > 0.9);
            assert_ok(vsh_camera_frame_points(&camera, COUNT, points[0], azimuth, 0.4, aspect, &failure));
            assert_framed(camera, COUNT, (const double(*)[3])points, low, high);
            const double size[2] = {0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])};
            const int larger = size[0] > size[1] ? 0 : 1;
            assert_true(size[larger] > 0.8 && size[larger] < 0.9);
            assert_true(fabs(high[larger] + low[larger]) < 1e-9); /* in the middle */
        }
    }
}

TEST(an_orbit_turns_around_the_target) {
    vsh_camera camera = camera_at(1.0, 2.0, 7.0, 1.0, 1.0, 3.0, 30.0);
    assert_ok(vsh_camera_orbit(&camera, 0.5 * PI, &failure));
    const double expected[3] = {5.0, 2.0, 3.0};
    for (int i = 0; i < 3; ++i) {
        assert_true(fabs(camera.position[i] - expected[i]) < 1e-12);
    }
    for (int i = 0; i < 5; ++i) {
        assert_ok(vsh_camera_orbit(&camera, 0.3 * PI, &failure));
    }
    assert_true(fabs(camera.position[2] - 7.0) < 1e-12 && fabs(camera.position[0] - 1.0) < 1e-12);
}

/* --- fog */

/* The box around the sphere has a diagonal of 2 √3, and the fog a quarter of that around it. */
TEST(fog_in_the_sun_shines_and_in_shadow_does_not) {
    OWNED(vsh_field) *field = ball(0.0, 0.0, 0.0, 1.0, 0.02);
    const vsh_surface surface = {field, {0.0, 0.0, 0.0}};
    const double x[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(x, 0.0);
    const double diagonal = 2.0 * sqrt(3.0), extinction = 1.0 / diagonal, around = 0.25 * diagonal;
    for (int side = 0; side < 2; ++side) {
        /* past the sphere at a corner of its box, all lit; then to the sphere, in its shadow from z = 1 on */
        const double sx = side == 0 ? 0.9 : -0.9, sy = side == 0 ? 0.9 : 0.0;
        vsh_render_options o = small(camera_at(sx, sy, 200.0, sx, sy, 0.0, 0.1), 2);
        o.shafts = 1.0;
        o.shaft_steps = 16;
        memset(o.sky, 0, sizeof o.sky);
        render(&surface, 1, field, &light, &o, NULL);
        const float *c = color + 3 * MIDDLE;
        const double left = exp(-extinction * (2.0 + 2.0 * around));
        const double expected =
            side == 0 ? o.background[0] * left + 1.0 - left : 1.0 - exp(-extinction * around);
        assert_true(fabs((double)c[0] - expected) < 0.015);
    }
}

/* --- lightmaps */

static vsh_mesh quad(void) {
    static const float positions[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    return quad_mesh("quad", positions, QUAD_UVS);
}

/* Texel centres at (i + ½) / N, row 0 at v = 1. */
TEST(a_lightmap_is_looked_up_where_it_was_baked) {
    enum { N = 4 };
    float ao[N * N], shadow[N * N];
    for (int i = 0; i < N * N; ++i) {
        ao[i] = (float)(0.1 + 0.2 * (i % N));
        shadow[i] = (float)(0.9 - 0.2 * (i / N)); /* light at the top */
    }
    const char *const names[] = {"ao", "shadow.sun"};
    const float *const planes[] = {ao, shadow};
    const vsh_image image = {N, N, 2, names, planes, NULL};
    const vsh_mesh mesh = quad();
    const vsh_lit_meshes lit = {&mesh, 1, &image, {0.5, 1.0, 0.25}, 0};
    const double z[3] = {0.0, 0.0, 1.0};
    const vsh_light light = sun(z, 0.1);
    OWNED(vsh_field) *field = ball(0.0, 0.0, -3.0, 0.5, 0.05); /* hidden behind it */
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
    const vsh_image missing = {N, N, 2, others, planes, NULL};
    const vsh_lit_meshes wrong[2] = {{&mesh, 1, &missing, {0.5, 0.5, 0.5}, 0},
                                     {NULL, 1, &missing, {0.5, 0.5, 0.5}, 0}};
    const struct {
        const vsh_lit_meshes *lit;
        vsh_result code;
        const char *part;
    } cases[] = {{&wrong[0], VSH_ERROR_INPUT, "shadow.sun"},
                 {&wrong[1], VSH_ERROR_ARGUMENT, "lit meshes 0: no lightmap, or no meshes"},
                 {NULL, VSH_ERROR_ARGUMENT, "lit is NULL with a lit_count of 1"}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        o.lit = cases[i].lit;
        assert_fails(
            vsh_render(&surface, 1, occluders_of(field), &light, 1, &o, NULL, &picture, NULL, &failure),
            cases[i].code, cases[i].part);
    }
}

TEST(lightmaps_with_irradiance_show_it_instead_of_shadows) {
    const float red[1] = {0.2f}, green[1] = {0.4f}, blue[1] = {0.6f}, dark[1] = {0.0f};
    const char *const names[] = {"irradiance.B", "irradiance.G", "irradiance.R", "shadow.sun"};
    const float *const planes[] = {blue, green, red, dark};
    const vsh_image image = {1, 1, 4, names, planes, NULL};
    const vsh_mesh mesh = quad();
    const vsh_lit_meshes lit = {&mesh, 1, &image, {1.0, 1.0, 0.5}, 0};
    const vsh_light light = vsh_light_default();
    OWNED(vsh_field) *field = ball(0.0, 0.0, -3.0, 0.5, 0.05);
    vsh_render_options o = small(camera_at(0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 20.0), 1);
    memset(o.sky, 0, sizeof o.sky);
    o.lit = &lit;
    o.lit_count = 1;
    render(NULL, 0, field, &light, &o, NULL);
    const float *c = color + 3 * MIDDLE;
    assert_true(fabs((double)c[0] - 0.2) < 1e-5 && fabs((double)c[1] - 0.4) < 1e-5 &&
                fabs((double)c[2] - 0.3) < 1e-5);
}

TEST(gradients_are_dithered_to_srgb) {
    static float planes[4][PIXELS];
    float *const rgb[3] = {planes[0], planes[1], planes[2]};
    for (int i = 0; i < PIXELS; ++i) {
        color[3 * i] = 0.25f;
        color[3 * i + 1] = 0.0f;
        color[3 * i + 2] = 1.0f;
        alpha[i] = 0.5f;
    }
    assert_ok(vsh_picture_encode(&picture, WIDE, HIGH, 1.0, rgb, NULL, &failure));
    double mean = 0.0;
    for (int i = 0; i < PIXELS; ++i) {
        const double steps = 255.0 * (double)planes[0][i];
        assert_true(fabs(steps - round(steps)) < 1e-3 && fabs(steps - 187.516) < 1.0);
        assert_true(planes[1][i] == 0.0f && planes[2][i] == 1.0f);
        mean += steps / PIXELS;
    }
    assert_true(fabs(mean - 187.516) < 0.05); /* of 0.5: 0.735357 */
    assert_ok(vsh_picture_encode(&picture, WIDE, HIGH, 0.0, rgb, planes[3], &failure));
    assert_true(fabs(255.0 * (double)planes[0][7] - 187.516) < 1.0); /* 0.25 over half of a pixel */
    assert_true(fabs((double)planes[3][7] - 128.0 / 255.0) < 1e-6);
    assert_fails(vsh_picture_encode(&picture, WIDE, HIGH, NAN, rgb, NULL, &failure), VSH_ERROR_ARGUMENT, "");
}
