/* Compares the rays of bench/embree_rays.c with a closed form. */

#include "testing.h"

#include "../bench/embree_rays.c"
#include "truth/directions.h"

OWNER(vshi_sampler)

enum { POINTS = 400 };

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

/* Half a plane over x < 0, a unit up. It ends where floats still tell its edge from a place 1e-6 beside it.
 */
static vsh_triangles *half_plane(void) {
    static const float positions[] = {-4, 1, -4, 0, 1, -4, 0, 1, 4, -4, 1, 4};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh mesh = {
        .positions = positions, .vertex_count = 4, .indices = indices, .triangle_count = 2};
    vsh_triangles *triangles = NULL;
    assert_ok(vsh_triangles_create(&mesh, 1, NULL, &triangles, &failure));
    return triangles;
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
        /* at most n^-3/4 / 2, at a half (bench/README.md, method `rays`) */
        assert_true(sqrt(square) < 0.5 * pow(rays, -0.75));
    }
}
