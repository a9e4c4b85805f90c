/* Lightmaps as a viewer sees them: bilinear lookups on the surface, which read borders and padding too. */
#include "testing.h"
#include "validity.h"

#include "directions.h"
#include "embree.h"

OWNER(truth_mesh)

/* 250: some charts then end in texels whose centres lie outside. */
enum { TEXELS = 250, POINTS = 5000, RAYS = 1024 };

static const double LIFT = 1e-5 * 4.0; /* of the room's size */
static const double WRONG = 0.25, AO_DISTANCE = 1.0;
static const double SUN_ANGLE = 0.7; /* wide, so that texels resolve the penumbra where things touch */
static const double SUN[3] = {0.4, 0.8, 0.3};

/* Random points of the surface, lifted off it, and their truth. */
typedef struct points {
    double at[3 * POINTS], uv[2 * POINTS];
    float normal[3 * POINTS];
    float ao[POINTS], shadow[POINTS], backs[POINTS];
} points;

static double number(size_t i, double irrational) {
    return fmod((double)(i + 1) * irrational, 1.0);
}

/* Sets point i of `p`: a place on quad q, which is a rectangle. */
static void place_on_quad(const shape *s, size_t q, double across, double along, points *p, size_t i) {
    double edge[2][3], g[3];
    for (size_t k = 0; k < 3; ++k) {
        const float *corner = s->positions + 12 * q + k;
        edge[0][k] = (double)(corner[3] - corner[0]);
        edge[1][k] = (double)(corner[9] - corner[0]);
        p->at[3 * i + k] = (double)corner[0] + across * edge[0][k] + along * edge[1][k];
    }
    for (size_t k = 0; k < 3; ++k) {
        g[k] = edge[0][(k + 1) % 3] * edge[1][(k + 2) % 3] - edge[0][(k + 2) % 3] * edge[1][(k + 1) % 3];
    }
    const double area = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    for (size_t k = 0; k < 3; ++k) {
        p->normal[3 * i + k] = (float)(g[k] / area);
        p->at[3 * i + k] += LIFT * g[k] / area;
    }
    for (size_t k = 0; k < 2; ++k) {
        const float *uv = s->uvs + 8 * q + k;
        p->uv[2 * i + k] = (double)uv[0] + across * (double)(uv[2] - uv[0]) + along * (double)(uv[6] - uv[0]);
    }
}

static points *place_points(const shape *s) {
    points *p = calloc(1, sizeof *p);
    assert_non_null(p);
    double area[MOST_QUADS], sum = 0.0;
    for (size_t q = 0; q < s->quads; ++q) {
        const float *c = s->positions + 12 * q;
        area[q] = sum += hypot(hypot((double)(c[3] - c[0]), (double)(c[4] - c[1])), (double)(c[5] - c[2])) *
                         hypot(hypot((double)(c[9] - c[0]), (double)(c[10] - c[1])), (double)(c[11] - c[2]));
    }
    for (size_t i = 0, q = 0; i < POINTS; ++i) {
        while (area[q] < ((double)i + 0.5) / POINTS * sum) {
            ++q;
        }
        place_on_quad(s, q, number(i, 0.7548776662466927), number(i, 0.5698402909980532), p, i);
    }
    return p;
}

static double look_up(const float *plane, const double uv[2]) {
    const double x = fmin(TEXELS - 1.0, fmax(0.0, uv[0] * TEXELS - 0.5));
    const double y = fmin(TEXELS - 1.0, fmax(0.0, (1.0 - uv[1]) * TEXELS - 0.5));
    double sum = 0.0;
    for (int k = 0; k < 4; ++k) {
        const double column = floor(x) + k % 2, row = floor(y) + k / 2;
        const double weight = (1.0 - fabs(x - column)) * (1.0 - fabs(y - row));
        sum += weight > 0.0 ? weight * (double)plane[(size_t)row * TEXELS + (size_t)column] : 0.0;
    }
    return sum;
}

static void trace_points(const vsh_mesh *mesh, points *p) {
    OWNED(truth_mesh) *truth = truth_mesh_create(mesh, 1);
    const double w = tan(0.5 * SUN_ANGLE);
    assert_non_null(truth);
    assert_int_equal(truth_mesh_backs(truth, POINTS, p->at, p->normal, 96, 0, p->backs), 0);
    assert_int_equal(truth_mesh_ao(truth, POINTS, p->at, p->normal, AO_DISTANCE, RAYS, 0, p->ao), 0);
    assert_int_equal(truth_mesh_light(truth, POINTS, p->at, p->normal, SUN, w, RAYS, 0, p->shadow), 0);
}

static void bake_planes(const vsh_mesh *mesh, float *ao, float *shadow) {
    OWNED(vsh_occluders) *occluders = NULL;
    OWNED(vsh_charts) *charts = NULL;
    assert_ok(vsh_occluders_create(mesh, 1, NULL, NULL, &occluders, &failure));
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = TEXELS;
    options.shade.ao_distance = AO_DISTANCE;
    options.shade.max_error = 0.005;
    options.shade.rays = 1024;
    assert_ok(vsh_charts_create(mesh, 1, &options, NULL, NULL, &charts, &failure));
    vsh_light sun = vsh_light_default();
    memcpy(sun.direction, SUN, sizeof SUN);
    sun.angle = SUN_ANGLE;
    float *const shadows[1] = {shadow};
    const vsh_lightmap lightmap = {.ao = ao, .shadow = shadows};
    assert_ok(vsh_bake_lightmap(occluders, charts, &sun, 1, NULL, NULL, &lightmap, NULL, &failure));
}

static void compare_seen(const points *p, const char *what, const float *plane, const float *truth) {
    size_t count = 0, dark = 0;
    double square = 0.0;
    for (size_t i = 0; i < POINTS; ++i) {
        const bool underside = p->at[3 * i + 1] < 1e-3 && p->normal[3 * i + 1] < -0.5f;
        if (p->backs[i] > 0.05f || underside) {
            continue; /* under the chest, or its own face on the floor */
        }
        const double error = look_up(plane, p->uv + 2 * i) - (double)truth[i];
        ++count;
        square += error * error;
        dark += !(error >= -WRONG);
    }
    const double rmse = sqrt(square / (double)count);
    assert_that(dark == 0 && rmse <= 0.01, "%s: %zu of %zu points are too dark by a quarter, RMSE %g", what,
                dark, count, rmse);
}

TEST(rooms_are_not_seen_darker_along_corners) {
    static const box ROOM = {{-2, 0, -2}, {2, 3, 2}};
    /* Its lower sides pass through centres of the floor's texels. */
    static const box CHEST = {{-0.46, 0, -0.46}, {0.46, 0.83, 0.39}};
    for (int open = 0; open < 2; ++open) {
        FREED shape *s = calloc(1, sizeof *s);
        FREED float *planes = calloc(2 * TEXELS * TEXELS, sizeof *planes);
        assert_true(s != NULL && planes != NULL);
        add_faces(s, CHEST, false);
        add_faces(s, ROOM, true);
        if (open) { /* the fourth of the room's quads is its ceiling: the last takes its place */
            memcpy(s->positions + 12 * 9, s->positions + 12 * 11, 12 * sizeof *s->positions);
            --s->quads;
        }
        const vsh_mesh mesh = mesh_of(s);
        FREED points *p = place_points(s);
        trace_points(&mesh, p);
        bake_planes(&mesh, planes, planes + TEXELS * TEXELS);
        compare_seen(p, open ? "AO under the sky" : "AO", planes, p->ao);
        compare_seen(p, open ? "sun" : "sun outside", planes + TEXELS * TEXELS, p->shadow);
    }
}
