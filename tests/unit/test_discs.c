/* Packets of rays over discs and domes (src/trace/embree_discs.c), held against the same rays one by one. */

#include "testing.h"
#include "trace/embree.h"

enum { MOST = 256, POINTS = 203 };

static vsh_triangles *triangles;
static vshi_sampler *sampler;
static vshi_disc discs[POINTS];

static double at(uint32_t i, uint32_t k) {
    return (double)((i * 2654435761u + k * 40503u) % 10007u) / 10007.0;
}

/* Points all over the cloister, one after the other in no order; discs of a sun of 30° that their normals
 * cut, or domes around these. */
static void place(bool domes, double far) {
    const vshi_vec sun = vshi_unit((vshi_vec){0.5, 0.8, 0.6});
    const double tangent = 0.26794919243112270;
    for (uint32_t i = 0; i < POINTS; ++i) {
        vshi_disc *d = &discs[i];
        d->origin[0] = -3.0 + 6.0 * at(i, 1);
        d->origin[1] = 0.05 + 2.5 * at(i, 2);
        d->origin[2] = -3.0 + 6.0 * at(i, 3);
        const vshi_vec normal = vshi_unit((vshi_vec){at(i, 4) - 0.5, at(i, 5) - 0.3, at(i, 6) - 0.5});
        d->axis = domes ? normal : sun;
        vshi_frame(d->axis, &d->u, &d->v);
        d->u = vshi_scale(d->u, domes ? 1.0 : tangent);
        d->v = vshi_scale(d->v, domes ? 1.0 : tangent);
        d->normal = domes || i % 3 == 0 ? (vshi_vec){0.0, 0.0, 0.0} : normal;
        d->far = far;
        d->lean = VSHI_WHOLE_DOME;
        if (i % 4 != 0) {
            const vshi_vec up = vshi_unit((vshi_vec){at(i, 7) - 0.5, at(i, 8) - 0.5, at(i, 9) - 0.5});
            d->lean = vshi_dome_lean(up, (vshi_vec[]){d->u, d->v, d->axis});
        }
        vshi_sampler_shift(sampler, 77 * i, 5, d->shift);
    }
}

/* How many of a disc's rays first … last - 1 meet nothing, each traced alone, as docs of vshi_disc have it.
 */
static int32_t count_lit(uint32_t i, bool domes, int32_t first, int32_t last) {
    const vshi_disc *d = &discs[i];
    int32_t lit = 0;
    for (int32_t k = first; k < last; ++k) {
        double disc[1][2];
        vshi_sampler_disc(sampler, 77 * i, 5, k, 1, disc);
        if (domes) {
            vshi_dome_place(&d->lean, disc[0]);
        }
        const double square = 1.0 - disc[0][0] * disc[0][0] - disc[0][1] * disc[0][1];
        const double up = domes ? sqrt(fmax(square, 0.0)) : 1.0;
        const vshi_vec way = vshi_unit(vshi_add(
            vshi_scale(d->axis, up), vshi_add(vshi_scale(d->u, disc[0][0]), vshi_scale(d->v, disc[0][1]))));
        const bool horizon = vshi_dot(d->normal, d->normal) > 0.0;
        const vshi_segment_ray ray = {
            {d->origin[0], d->origin[1], d->origin[2]}, {way.x, way.y, way.z}, d->far};
        bool blocked = true;
        if (!horizon || vshi_dot(way, d->normal) > 0.0) {
            vshi_triangles_blocked(triangles, &ray, 1, &blocked);
        }
        lit += !blocked;
    }
    return lit;
}

/* Of some points, in packets that are full or not; directions in floats turn a ray in 10,000. */
static void compare(bool domes, double far, uint32_t count, int32_t first, int32_t last) {
    int32_t lit[POINTS] = {0}, off = 0, all = 0;
    place(domes, far);
    vshi_triangles_discs(triangles, sampler, domes, discs, count, first, last, lit);
    for (uint32_t i = 0; i < count; ++i) {
        const int32_t alone = count_lit(i, domes, first, last);
        off += abs(alone - lit[i]);
        all += alone;
    }
    print_message("%s, far %g, %u points, rays %d to %d: %d lit, %d off\n", domes ? "domes" : "discs", far,
                  count, first, last, all, off);
    assert_true(off <= 1 + (int32_t)count * (last - first) / 10000);
    assert_true(count < 16 || (all > 0 && all < (int32_t)count * (last - first)));
}

TEST(packets_count_what_lone_rays_do) {
    static const uint32_t counts[] = {1, 2, 3, 5, 16, 17, POINTS};
    static const int32_t blocks[][2] = {{0, 4}, {0, 8}, {4, 8}, {8, 16}, {0, 64}, {16, 32}, {64, 256}};
    for (size_t c = 0; c < sizeof counts / sizeof counts[0]; ++c) {
        for (size_t b = 0; b < sizeof blocks / sizeof blocks[0]; ++b) {
            assert_true(vshi_sampler_is_blocks(blocks[b][0], blocks[b][1]));
            compare(false, INFINITY, counts[c], blocks[b][0], blocks[b][1]);
            compare(true, 0.6, counts[c], blocks[b][0], blocks[b][1]);
        }
    }
    compare(false, 0.3, POINTS, 0, 64);
    compare(true, INFINITY, POINTS, 0, 64);
}

TEST(what_is_no_blocks_is_told) {
    static const int32_t none[][2] = {{0, 2}, {0, 12}, {4, 12}, {4, 4}, {2, 4}, {64, 100}, {12, 16}};
    for (size_t b = 0; b < sizeof none / sizeof none[0]; ++b) {
        assert_false(vshi_sampler_is_blocks(none[b][0], none[b][1]));
    }
}

/* What is left of the disc is bounded by half a circle and half an ellipse. It has closed forms for the means
 * of the distance along the lean, of its square, and of the square across it. */
TEST(places_fill_the_dome_above_a_plane_evenly) {
    enum { SIDE = 400 };
    static const double PI = 3.14159265358979323846;
    const vshi_vec axes[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (int k = 1; k <= 8; ++k) {
        const double rise = 0.25 * k - 1.0, slope = sqrt(1.0 - rise * rise);
        const vshi_vec up = {0.6 * slope, -0.8 * slope, rise};
        const vshi_lean lean = vshi_dome_lean(up, axes);
        double count = 0.0, along = 0.0, square = 0.0, across = 0.0;
        for (int i = 0; i < SIDE * SIDE; ++i) {
            double p[2] = {2.0 * (i % SIDE + 0.5) / SIDE - 1.0, 2.0 * (i / SIDE + 0.5) / SIDE - 1.0};
            if (p[0] * p[0] + p[1] * p[1] < 1.0) {
                vshi_dome_place(&lean, p);
                const double z = sqrt(fmax(1.0 - p[0] * p[0] - p[1] * p[1], 0.0));
                assert_true(up.x * p[0] + up.y * p[1] + up.z * z > -1e-7);
                const double a = 0.6 * p[0] - 0.8 * p[1], b = 0.8 * p[0] + 0.6 * p[1];
                count += 1.0;
                along += a;
                square += a * a;
                across += b * b;
            }
        }
        assert_true(fabs(along / count - 4.0 / (3.0 * PI) * (1.0 - rise)) < 1e-3);
        assert_true(fabs(square / count - 0.25 * (1.0 - rise + rise * rise)) < 1e-3);
        assert_true(fabs(across / count - 0.25) < 1e-3);
    }
}

int main(void) {
    OWNED(vsh_model) *model = NULL;
    if (vsh_model_read(VSH_ASSETS "/cloister.glb", NULL, &model, &failure) != VSH_OK) {
        return 1;
    }
    const size_t count = vsh_model_mesh_count(model);
    FREED vsh_mesh *meshes = calloc(count, sizeof *meshes);
    for (size_t i = 0; i < count; ++i) {
        meshes[i] = vsh_model_mesh(model, i, -1);
    }
    sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 0);
    if (sampler == NULL || vsh_triangles_create(meshes, count, NULL, &triangles, &failure) != VSH_OK) {
        return 1;
    }
    const int failed = run_all_tests(NULL, NULL);
    vsh_triangles_free(triangles);
    vshi_sampler_free(sampler);
    return failed;
}
