/* The rays that whole bakes are held against (bench/embree_rays.c): closed forms, and the sampler's own rays.
 */

#include "testing.h"

#include "../bench/embree_rays.c"
#include "truth/directions.h"

OWNER(vshi_sampler)

enum { POINTS = 400 };

/* Of the half plane near enough for floats to tell its edge from what is 1e-6 beside it. */
static const double FAR = 1000.0, NEAR = 4.0;

/* A rectangle, one corner and two sides. */
static vsh_triangles *wall(const float corner[3], const float a[3], const float b[3]) {
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    float positions[12];
    for (int k = 0; k < 3; ++k) {
        positions[k] = corner[k];
        positions[3 + k] = corner[k] + a[k];
        positions[6 + k] = corner[k] + a[k] + b[k];
        positions[9 + k] = corner[k] + b[k];
    }
    vsh_mesh mesh = {.positions = positions, .vertex_count = 4, .indices = indices, .triangle_count = 2};
    vsh_triangles *triangles = NULL;
    assert_ok(vsh_triangles_create(&mesh, 1, NULL, &triangles, &failure));
    return triangles;
}

/* Points along x on the plane y = 0, and what `rays` rays each make of them. */
typedef struct points {
    double origins[3 * POINTS];
    float normals[3 * POINTS], values[POINTS];
    uint32_t texels[POINTS];
} points;

static void trace(bench_rays_task task, double first, double last, points *p) {
    OWNED(vshi_sampler) *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, task.rays, 0);
    task.sampler = sampler;
    memset(p, 0, sizeof *p);
    for (size_t i = 0; i < POINTS; ++i) {
        p->origins[3 * i] = first + (last - first) * (double)i / (POINTS - 1);
        p->normals[3 * i + 1] = 1.0f;
        p->texels[i] = vsh_texel((uint32_t)i % 64, (uint32_t)i / 64);
    }
    uint32_t(*net)[2] = bench_rays_net(sampler, task.rays);
    bench_rays_trace(&task, (const uint32_t(*)[2])net, POINTS, p->origins, p->normals, NULL, p->texels,
                     p->values);
    free(net);
}

static vshi_light_place sun(double angle) {
    vsh_light light = vsh_light_default(); /* overhead */
    light.angle = angle;
    return vshi_light_in_world(&light);
}

/* Half a plane over x < 0, a unit up. */
static vsh_triangles *half_plane(void) {
    return wall((float[]){(float)-NEAR, 1.0f, (float)-NEAR}, (float[]){(float)NEAR, 0.0f, 0.0f},
                (float[]){0.0f, 0.0f, (float)(2.0 * NEAR)});
}

TEST(a_half_plane_hides_what_its_closed_form_says) {
    static points p;
    OWNED(vsh_triangles) *triangles = half_plane();
    const vshi_light_place light = sun(0.2);
    for (int32_t rays = 64; rays <= 4096; rays *= 8) {
        const bench_rays_task task = {.triangles = triangles, .rays = rays, .light = &light};
        trace(task, -0.12, 0.12, &p);
        double square = 0.0;
        for (size_t i = 0; i < POINTS; ++i) {
            const double error = (double)p.values[i] - truth_disc_share(p.origins[3 * i] / tan(0.1));
            square += error * error / POINTS;
        }
        /* at most n^-3/4 / 2, at a half (README, method `rays`) */
        assert_true(sqrt(square) < 0.5 * pow(rays, -0.75));
    }
}

TEST(a_wall_hides_of_the_hemisphere_what_its_closed_form_says) {
    static points p;
    OWNED(vsh_triangles) *triangles = wall((float[]){0.0f, 0.0f, (float)-FAR}, (float[]){0.0f, 1.0f, 0.0f},
                                           (float[]){0.0f, 0.0f, (float)(2.0 * FAR)});
    const bench_rays_task task = {.triangles = triangles, .rays = 4096, .distance = 10.0 * FAR};
    trace(task, 0.1, 4.0, &p);
    for (size_t i = 0; i < POINTS; ++i) {
        const double x = p.origins[3 * i], hidden = 0.5 * (1.0 - x / sqrt(1.0 + x * x));
        assert_true(fabs((double)p.values[i] - (1.0 - hidden)) < 0.006);
    }
}

/* Also where they are no power of two, and so in no cells. */
TEST(the_rays_are_the_samplers) {
    static points p;
    OWNED(vsh_triangles) *triangles = half_plane();
    const vshi_light_place light = sun(0.2);
    for (int32_t rays = 1; rays <= 64; rays += rays < 4 ? 1 : 20) {
        const bench_rays_task task = {.triangles = triangles, .rays = rays, .light = &light};
        trace(task, -0.12, 0.12, &p);
        OWNED(vshi_sampler) *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, rays, 0);
        vshi_vec u, v;
        vshi_frame(light.towards, &u, &v);
        for (size_t i = 0; i < POINTS; ++i) {
            double disc[64][2];
            int seen = 0;
            vshi_sampler_disc(sampler, p.texels[i], 0, 0, rays, disc);
            for (int32_t k = 0; k < rays; ++k) {
                seen += p.origins[3 * i] + tan(0.1) * (disc[k][0] * u.x + disc[k][1] * v.x) > 0.0;
            }
            assert_float_equal((float)seen / (float)rays, p.values[i], 1e-6f);
        }
    }
}
