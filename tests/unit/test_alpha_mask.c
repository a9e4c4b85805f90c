/* Meshes that a texture cuts out: rays against them, the cover of a triangle, and the pieces that voxels are
 * made of. */

#include "geometry/alpha_mask.h"
#include "rays.h"
#include "shading.h"
#include "testing.h"
#include "trace/trace.h"
#include "truth/metrics.h"

/* A disc of this radius in a square of side 2, as an alpha of this many texels: a ramp that is a half at the
 * disc's edge, and some texels wide. */
#define DISC_RADIUS 0.8
enum { DISC_TEXELS = 128, DISC_SECTORS = 256 };

typedef struct card {
    float positions[12], uvs[8];
    uint8_t alpha[DISC_TEXELS * DISC_TEXELS];
    vsh_alpha_mask mask;
    vsh_mesh mesh;
} card;

static vsh_alpha_mask mask_of(const uint8_t *alpha, int32_t width, int32_t height) {
    return (vsh_alpha_mask){.alpha = alpha,
                            .width = width,
                            .height = height,
                            .uv_transform = {1, 0, 0, 0, 1, 0},
                            .alpha_cutoff = 0.5,
                            .base_alpha = 1.0};
}

/* A card in the plane of this height, seen from above anticlockwise: its front is up. */
static card *card_at(float height) {
    card *c = malloc(sizeof *c);
    for (uint32_t k = 0; k < 4; ++k) {
        const bool right = k == 1 || k == 2, far = k >= 2;
        const float at[3] = {right ? 1.0f : -1.0f, height, far ? -1.0f : 1.0f};
        memcpy(c->positions + 3 * k, at, sizeof at);
        c->uvs[2 * k] = right ? 1.0f : 0.0f;
        c->uvs[2 * k + 1] = far ? 1.0f : 0.0f;
    }
    for (int y = 0; y < DISC_TEXELS; ++y) {
        for (int x = 0; x < DISC_TEXELS; ++x) {
            const double u = 2.0 * (x + 0.5) / DISC_TEXELS - 1.0, v = 2.0 * (y + 0.5) / DISC_TEXELS - 1.0;
            const double value = 127.5 + 2000.0 * (DISC_RADIUS - hypot(u, v));
            c->alpha[y * DISC_TEXELS + x] = (uint8_t)(fmin(255.0, fmax(0.0, value)) + 0.5);
        }
    }
    c->mask = mask_of(c->alpha, DISC_TEXELS, DISC_TEXELS);
    c->mesh = quad_mesh("card", c->positions, NULL);
    c->mesh.mask = &c->mask;
    c->mesh.mask_uvs = c->uvs;
    return c;
}

/* The disc as triangles. */
typedef struct fan {
    float positions[3 * (DISC_SECTORS + 1)];
    uint32_t indices[3 * DISC_SECTORS];
    vsh_mesh mesh;
} fan;

static fan *fan_at(float height) {
    fan *f = malloc(sizeof *f);
    /* as large as the circle that the polygon stands for */
    const double radius = DISC_RADIUS * sqrt(2.0 * PI / DISC_SECTORS / sin(2.0 * PI / DISC_SECTORS));
    memcpy(f->positions, (const float[]){0.0f, height, 0.0f}, 3 * sizeof(float));
    for (uint32_t i = 0; i < DISC_SECTORS; ++i) {
        const double angle = 2.0 * PI * i / DISC_SECTORS;
        const float at[3] = {(float)(radius * cos(angle)), height, (float)(-radius * sin(angle))};
        memcpy(f->positions + 3 * (i + 1), at, sizeof at);
        const uint32_t corners[3] = {0, i + 1, (i + 1) % DISC_SECTORS + 1};
        memcpy(f->indices + 3 * i, corners, sizeof corners);
    }
    f->mesh = mesh_of_arrays("disc", f->positions, NULL, DISC_SECTORS + 1, f->indices, DISC_SECTORS);
    return f;
}

/* Wraps a texel as the standards define it. */
static int wrap(int at, int size, int32_t how) {
    if (how == VSH_WRAP_CLAMP) {
        return at < 0 ? 0 : at >= size ? size - 1 : at;
    }
    const int period = how == VSH_WRAP_MIRROR ? 2 * size : size;
    while (at < 0) {
        at += period;
    }
    while (at >= period) {
        at -= period;
    }
    return at < size ? at : period - 1 - at;
}

/* Looks up alpha as the standards define it, with the sum in another order. */
static double alpha_at(const vsh_alpha_mask *m, double u, double v) {
    const double *t = m->uv_transform;
    const double x = (t[0] * u + t[1] * v + t[2]) * m->width - 0.5;
    const double y = (1.0 - (t[3] * u + t[4] * v + t[5])) * m->height - 0.5;
    double sum = 0.0;
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int column = (int)floor(x) + i, row = (int)floor(y) + j;
            const int texel =
                wrap(row, m->height, m->wrap[1]) * m->width + wrap(column, m->width, m->wrap[0]);
            sum += (1.0 - fabs(x - column)) * (1.0 - fabs(y - row)) * m->alpha[texel] / 255.0;
        }
    }
    return m->base_alpha * sum;
}

enum { WIDE = 5, HIGH = 7 };

static vsh_alpha_mask random_mask(uint8_t alpha[WIDE * HIGH], int i, uint32_t *seed) {
    for (int k = 0; k < WIDE * HIGH; ++k) {
        alpha[k] = (uint8_t)(next_random(seed) * 255.99);
    }
    vsh_alpha_mask mask = mask_of(alpha, WIDE, HIGH);
    mask.wrap[0] = i % 3;
    mask.wrap[1] = i / 3 % 3;
    if (i % 2 == 1) {
        const double turned[6] = {0.8, -1.7, 0.4, 1.1, 0.6, -2.3};
        memcpy(mask.uv_transform, turned, sizeof turned);
        mask.base_alpha = 0.7;
        mask.alpha_cutoff = 0.3;
    }
    return mask;
}

static const float UP[3] = {0.0f, 1.0f, 0.0f};

static bool blocked(const vshi_triangles *triangles, const double from[3], const double direction[3]) {
    vshi_segment_ray ray = {.far = INFINITY};
    memcpy(ray.origin, from, sizeof ray.origin);
    memcpy(ray.direction, direction, sizeof ray.direction);
    bool met = false;
    vshi_triangles_blocked(triangles, &ray, 1, &met);
    return met;
}

/* --- shadows and AO */

TEST(soft_shadows_and_ao_are_those_of_the_disc_as_triangles) {
    enum { POINTS = 200, RAYS = 1024 };
    FREED card *c = card_at(0.7f);
    FREED fan *f = fan_at(0.7f);
    vsh_mesh whole = c->mesh;
    whole.mask = NULL;
    OWNED(vshi_triangles) *cut = triangles_from(&c->mesh, 1);
    OWNED(vshi_triangles) *disc = triangles_from(&f->mesh, 1);
    OWNED(vshi_triangles) *square = triangles_from(&whole, 1);
    double positions[3 * POINTS];
    float normals[3 * POINTS], value[3][POINTS];
    for (size_t i = 0; i < POINTS; ++i) {
        const double at[3] = {0.01 * (double)i - 1.0, 0.0, 0.005 * (double)i};
        memcpy(positions + 3 * i, at, sizeof at);
        memcpy(normals + 3 * i, UP, sizeof UP);
    }
    const double towards[3] = {0.3, 1.0, 0.1};
    const vsh_light light = sun(towards, 0.4);
    const vshi_triangles *all[3] = {cut, disc, square};
    for (int ao = 0; ao < 2; ++ao) {
        for (int k = 0; k < 3; ++k) {
            if (ao) {
                see_sky(all[k], NULL, POINTS, positions, normals, 0.0, 3.0, RAYS, value[k]);
            } else {
                see_light(all[k], NULL, POINTS, positions, normals, 0.0, &light, RAYS, value[k]);
            }
        }
        assert_at_most(truth_compare(POINTS, value[0], value[1], NULL).max,
                       3.0 / RAYS); /* rays on the very edge */
        assert_true(truth_compare(POINTS, value[0], value[2], NULL).max > 0.05);
    }
}

/* --- lookups */

TEST(rays_see_wraps_transforms_cutoff_and_base_factor) {
    uint32_t seed = 1;
    int through = 0, met = 0;
    for (int i = 0; i < 18; ++i) {
        FREED card *c = card_at(1.0f);
        uint8_t alpha[WIDE * HIGH];
        c->mask = random_mask(alpha, i, &seed);
        for (size_t k = 0; k < 8; ++k) {
            c->uvs[k] = 5.0f * c->uvs[k] - 2.25f; /* u: x from -1 to 1 is -2.25 to 2.75 */
        }
        OWNED(vshi_triangles) *triangles = triangles_from(&c->mesh, 1);
        for (int k = 0; k < 400; ++k) {
            const double x = 1.9 * next_random(&seed) - 0.95, z = 1.9 * next_random(&seed) - 0.95;
            const double u = 2.5 * (x + 1.0) - 2.25, v = 2.5 * (1.0 - z) - 2.25;
            const double off = alpha_at(&c->mask, u, v) - c->mask.alpha_cutoff;
            if (fabs(off) > 1e-5) {
                const bool is = blocked(triangles, (const double[]){x, 0, z}, (const double[]){0, 1, 0});
                assert_int_equal(is, off > 0.0);
                through += !is;
                met += is;
            }
        }
    }
    assert_true(through > 1000 && met > 1000);
}

/* --- packets */

TEST(a_ray_sees_the_same_alone_and_in_a_packet) {
    enum { RAYS = 4096 };
    FREED card *c = card_at(1.0f);
    for (size_t k = 0; k < 8; ++k) {
        c->uvs[k] *= 37.0f; /* many small discs */
    }
    OWNED(vshi_triangles) *triangles = triangles_from(&c->mesh, 1);
    static vshi_segment_ray rays[RAYS];
    static bool together[RAYS];
    uint32_t seed = 3;
    for (size_t i = 0; i < RAYS; ++i) {
        vshi_vec d = vshi_unit((vshi_vec){0.5 * next_random(&seed), 1.0, 0.5 * next_random(&seed)});
        rays[i] = (vshi_segment_ray){
            {next_random(&seed) - 0.8, 0.0, next_random(&seed) - 0.8}, {d.x, d.y, d.z}, INFINITY};
    }
    vshi_triangles_blocked(triangles, rays, RAYS, together);
    int met = 0;
    for (size_t i = 0; i < RAYS; ++i) {
        assert_int_equal(blocked(triangles, rays[i].origin, rays[i].direction), together[i]);
        met += together[i];
    }
    assert_true(met > RAYS / 4 && met < 3 * RAYS / 4);
}

/* --- solids and one-sided faces */

static const double BOX_LOW[3] = {-1, -1, -1}, BOX_HIGH[3] = {1, 1, 1};

TEST(a_masked_box_holds_nothing) {
    static const float uvs[16];
    const uint8_t half[2] = {255, 0};
    const vsh_alpha_mask mask = mask_of(half, 2, 1);
    float corners[24];
    vsh_mesh box = box_mesh(corners, BOX_LOW, BOX_HIGH);
    for (int masked = 0; masked < 2; ++masked) {
        box.mask = masked ? &mask : NULL;
        box.mask_uvs = uvs;
        box.solidity = masked ? VSH_SOLIDITY_SOLID : VSH_SOLIDITY_AUTO;
        OWNED(vshi_triangles) *triangles = triangles_from(&box, 1);
        assert_int_equal(vshi_triangles_have_solids(triangles), !masked);
    }
}

TEST(a_one_sided_box_is_as_solid_as_any) {
    float corners[24];
    vsh_mesh box = box_mesh(corners, BOX_LOW, BOX_HIGH);
    box.one_sided = 1;
    OWNED(vshi_triangles) *triangles = triangles_from(&box, 1);
    assert_true(vshi_triangles_have_solids(triangles));
    for (int i = 0; i < 3; ++i) {
        const vshi_segment_ray ray = {{-3.0 + 3.0 * i, 0.1, 0.2}, {1.0, 0.0, 0.0}, INFINITY};
        uint8_t meets = VSHI_MEETS_NOTHING;
        /* before it, in it, behind it */
        assert_int_equal(vshi_triangles_depth(triangles, &ray), i == 1);
        vshi_triangles_meet(triangles, &ray, 1, &meets);
        assert_int_equal(meets, i == 0 ? VSHI_MEETS_AIR : i == 1 ? VSHI_MEETS_SOLID : VSHI_MEETS_NOTHING);
        /* and casts the same */
        assert_int_equal(blocked(triangles, ray.origin, ray.direction), i < 2);
    }
}

TEST(light_on_the_back_of_a_one_sided_face_comes_through) {
    FREED card *c = card_at(1.0f);
    for (int i = 0; i < 8; ++i) {
        const bool one_sided = (i & 1) != 0, mirrored = (i & 2) != 0, masked = (i & 4) != 0;
        const double transform[12] = {mirrored ? -1.0 : 1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        vsh_mesh mesh = c->mesh;
        mesh.one_sided = one_sided;
        mesh.transform = transform;
        mesh.mask = masked ? mesh.mask : NULL;
        OWNED(vshi_triangles) *triangles = triangles_from(&mesh, 1);
        const double under[3] = {0.1, 0.0, 0.2}, over[3] = {0.1, 2.0, 0.2};
        /* its front is up: a light above shines on it */
        assert_true(blocked(triangles, under, (const double[]){0, 1, 0}));
        assert_int_equal(blocked(triangles, over, (const double[]){0, -1, 0}), !one_sided);
        assert_int_equal(blocked(triangles, (const double[]){0.95, 0.0, 0.95}, (const double[]){0, 1, 0}),
                         !masked);
    }
}

/* --- what is refused */

TEST(bad_masks_are_refused) {
    FREED card *c = card_at(0.0f);
    vsh_alpha_mask bad[8];
    for (int i = 0; i < 8; ++i) {
        bad[i] = c->mask;
    }
    bad[0].alpha = NULL;
    bad[1].width = 0;
    bad[2].height = 1 << 16;
    bad[3].wrap[1] = 3;
    bad[4].uv_transform[5] = NAN;
    bad[5].alpha_cutoff = -0.1;
    bad[6].base_alpha = 1.5;
    const vsh_run run = vsh_run_default();
    for (int i = 0; i < 8; ++i) {
        c->mesh.mask = &bad[i];
        c->mesh.mask_uvs = i < 7 ? c->uvs : NULL;
        vshi_triangles *triangles = NULL;
        assert_fails(vshi_triangles_create(&c->mesh, 1, NULL, &run, &triangles, &failure), VSH_ERROR_ARGUMENT,
                     "'card'");
        assert_null(triangles);
    }
}

/* --- holes and pieces */

TEST(the_cover_of_a_triangle_holds_all_over_it) {
    uint32_t seed = 7;
    int counts[3] = {0};
    for (int i = 0; i < 18 * 40; ++i) {
        uint8_t alpha[WIDE * HIGH];
        vsh_alpha_mask mask = random_mask(alpha, i % 18, &seed);
        /* mostly clear, or mostly opaque */
        for (int k = 0; k < WIDE * HIGH; ++k) {
            alpha[k] = k % 4 == 0 ? alpha[k] : i % 2 == 0 ? 255 : 0;
        }
        FREED_BY(vshi_mask_table_free) vshi_mask_table table;
        assert_ok(vshi_mask_table_create(&mask, NULL, &table, &failure));
        for (int k = 0; k < 20; ++k) {
            float uvs[3][2];
            vshi_mask_place places[3];
            const double size = k % 3 == 0 ? 4.0 : 0.3, x = 8.0 * next_random(&seed) - 4.0,
                         y = 8.0 * next_random(&seed);
            for (int v = 0; v < 3; ++v) {
                uvs[v][0] = (float)(x + size * next_random(&seed));
                uvs[v][1] = (float)(y + size * next_random(&seed));
                places[v] = vshi_alpha_mask_place(&mask, uvs[v]);
            }
            const vshi_mask_cover cover = vshi_mask_table_cover(&table, places);
            ++counts[cover];
            for (int s = 0; s < 40 && cover != VSHI_MASK_MIXED; ++s) {
                double a = next_random(&seed), b = next_random(&seed);
                a = a + b > 1.0 ? 1.0 - a : a;
                b = a + b > 1.0 ? 1.0 - b : b;
                const double p = 1.0 - a - b;
                const double u = p * (double)uvs[0][0] + a * (double)uvs[1][0] + b * (double)uvs[2][0];
                const double v = p * (double)uvs[0][1] + a * (double)uvs[1][1] + b * (double)uvs[2][1];
                const double off = alpha_at(&mask, u, v) - mask.alpha_cutoff;
                assert_true(cover == VSHI_MASK_OPAQUE ? off > -1e-6 : off < 1e-6);
            }
        }
    }
    assert_true(counts[VSHI_MASK_CLEAR] > 200 && counts[VSHI_MASK_OPAQUE] > 200 &&
                counts[VSHI_MASK_MIXED] > 1000);
}

TEST(places_that_are_not_finite_are_opaque) {
    const uint8_t clear[1] = {0};
    const float values[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e20f};
    for (int wrapped = VSH_WRAP_REPEAT; wrapped <= VSH_WRAP_CLAMP; ++wrapped) {
        vsh_alpha_mask mask = mask_of(clear, 1, 1);
        mask.wrap[0] = mask.wrap[1] = wrapped;
        for (size_t i = 0; i < COUNT_OF(values); ++i) {
            const vshi_mask_place at = vshi_alpha_mask_place(&mask, (const float[]){values[i], values[i]});
            assert_int_equal(vshi_alpha_mask_opaque(&mask, at), !isfinite(values[i]));
            const vshi_mask_place corners[3] = {at, {0.0, 0.0}, {1.0, 0.0}};
            FREED_BY(vshi_mask_table_free) vshi_mask_table table;
            assert_ok(vshi_mask_table_create(&mask, NULL, &table, &failure));
            assert_true(vshi_mask_table_cover(&table, corners) != VSHI_MASK_CLEAR || isfinite(values[i]));
        }
    }
}

TEST(pieces_keep_to_the_memory_limit) {
    FREED card *c = card_at(1.0f);
    const vsh_run run = run_within(1 << 20);
    FREED_BY(vshi_mask_pieces_free) vshi_mask_pieces pieces;
    assert_fails(vshi_mask_pieces_cut(&c->mesh, 1e-9, &run, &pieces, &failure), VSH_ERROR_LIMIT, "'card'");
}

TEST(voxels_hold_the_disc_and_not_the_card) {
    FREED card *c = card_at(0.0f);
    FREED fan *f = fan_at(0.0f);
    const double voxel = 0.05;
    OWNED(vsh_field) *cut = field_of_grid(grid_from_meshes(&c->mesh, 1, voxel), 0.0);
    OWNED(vsh_field) *disc = field_of_grid(grid_from_meshes(&f->mesh, 1, voxel), 0.0);
    int inside = 0, between = 0;
    for (int i = 0; i < 61 * 61; ++i) {
        const double at[3] = {-1.2 + 0.04 * (i % 61), 0.01, -1.2 + 0.04 * (i / 61)};
        const double a = (double)distance_at(cut, at), b = (double)distance_at(disc, at);
        if (fabs(b) < voxel) {
            assert_true(fabs(a - b) < voxel);
            inside += b < 0.0;
        }
        /* in the card, out of the disc */
        const double off = hypot(at[0], at[2]) - DISC_RADIUS;
        if (off > 2.5 * voxel && fabs(at[0]) < 1.0 && fabs(at[2]) < 1.0) {
            assert_true(a > 0.0);
            ++between;
        }
    }
    assert_true(inside > 50 && between > 100);
}
