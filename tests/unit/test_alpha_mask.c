/* Meshes that a texture cuts out: what rays meet of them, and the pieces that voxels are made of. */
#include "masked.h"

#include "mesh/alpha_mask.h"
#include "trace/embree.h"

#include <vdbshade/field.h>
#include <vdbshade/occluders.h>

static const float UP[3] = {0.0f, 1.0f, 0.0f};

static bool blocked(const vsh_triangles *triangles, const double from[3], const double direction[3]) {
    vshi_segment_ray ray = {.far = INFINITY};
    memcpy(ray.origin, from, sizeof ray.origin);
    memcpy(ray.direction, direction, sizeof ray.direction);
    bool met = false;
    vshi_triangles_blocked(triangles, &ray, 1, &met);
    return met;
}

/* --- shadows and AO */

static void a_masked_card_casts_the_shadow_of_its_disc(void **state) {
    (void)state;
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    vsh_triangles *triangles = traced_of(&c->mesh, 1);
    const double directions[3][3] = {{0.0, 1.0, 0.0}, {0.6, 0.8, 0.0}, {-0.48, 0.6, 0.64}};
    int dark = 0, lit = 0;
    for (int i = 0; i < 3 * 41 * 41; ++i) {
        const double *d = directions[i % 3];
        const double x = -1.2 + 0.06 * (i / 3 % 41), z = -1.2 + 0.06 * (i / 123);
        const double from[3] = {x - d[0] / d[1], 0.0, z - d[2] / d[1]};
        const double off = hypot(x, z) - DISC_RADIUS;
        if (fabs(off) > 1e-3) {
            assert_int_equal(blocked(triangles, from, d), off < 0.0);
            dark += off < 0.0;
            lit += fabs(x) < 1.0 && fabs(z) < 1.0 && off > 0.0;
        }
    }
    assert_true(dark > 500 && lit > 300);
    /* and from above */
    assert_true(blocked(triangles, (const double[]){0, 2, 0}, (const double[]){0, -1, 0}));
    assert_false(blocked(triangles, (const double[]){0.9, 2, 0.9}, (const double[]){0, -1, 0}));
    vsh_triangles_free(triangles);
    free(c);
}

static void soft_shadows_and_ao_are_those_of_the_disc_as_triangles(void **state) {
    (void)state;
    enum { POINTS = 200, RAYS = 1024 };
    card *c = malloc(sizeof *c);
    fan *f = malloc(sizeof *f);
    make_card(c, 0.7f);
    make_fan(f, 0.7f);
    vsh_mesh whole = c->mesh;
    whole.mask = NULL;
    vsh_triangles *cut = traced_of(&c->mesh, 1), *disc = traced_of(&f->mesh, 1),
                  *square = traced_of(&whole, 1);
    double positions[3 * POINTS];
    float normals[3 * POINTS], value[3][POINTS];
    for (size_t i = 0; i < POINTS; ++i) {
        const double at[3] = {0.01 * (double)i - 1.0, 0.0, 0.005 * (double)i};
        memcpy(positions + 3 * i, at, sizeof at);
        memcpy(normals + 3 * i, UP, sizeof UP);
    }
    const double towards[3] = {0.3, 1.0, 0.1};
    const vsh_light light = sun(towards, 0.4);
    const vsh_triangles *all[3] = {cut, disc, square};
    for (int ao = 0; ao < 2; ++ao) {
        for (int k = 0; k < 3; ++k) {
            const vsh_result result = ao ? vsh_trace_ao(all[k], NULL, POINTS, positions, normals, 0.0, 3.0,
                                                        RAYS, NULL, value[k], NULL)
                                         : vsh_trace_shadow(all[k], NULL, POINTS, positions, normals, 0.0,
                                                            &light, RAYS, NULL, value[k], NULL);
            assert_int_equal(result, VSH_OK);
        }
        double worst = 0.0, other = 0.0;
        for (size_t i = 0; i < POINTS; ++i) {
            worst = fmax(worst, fabs((double)value[0][i] - (double)value[1][i]));
            other = fmax(other, fabs((double)value[0][i] - (double)value[2][i]));
        }
        assert_true(worst <= 3.0 / RAYS); /* rays on the very edge */
        assert_true(other > 0.05);
    }
    vsh_triangles_free(cut);
    vsh_triangles_free(disc);
    vsh_triangles_free(square);
    free(c);
    free(f);
}

/* --- lookups */

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

/* As the standards have it, with another sum. */
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

static double next_of(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) * 0x1p-24;
}

enum { WIDE = 5, HIGH = 7 };

static vsh_alpha_mask random_mask(uint8_t alpha[WIDE * HIGH], int i, uint32_t *seed) {
    for (int k = 0; k < WIDE * HIGH; ++k) {
        alpha[k] = (uint8_t)(next_of(seed) * 255.99);
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

static void rays_see_wraps_transforms_cutoff_and_base_factor(void **state) {
    (void)state;
    uint32_t seed = 1;
    int through = 0, met = 0;
    for (int i = 0; i < 18; ++i) {
        card *c = malloc(sizeof *c);
        uint8_t alpha[WIDE * HIGH];
        make_card(c, 1.0f);
        c->mask = random_mask(alpha, i, &seed);
        for (size_t k = 0; k < 8; ++k) {
            c->uvs[k] = 5.0f * c->uvs[k] - 2.25f; /* u: x from -1 to 1 is -2.25 to 2.75 */
        }
        vsh_triangles *triangles = traced_of(&c->mesh, 1);
        for (int k = 0; k < 400; ++k) {
            const double x = 1.9 * next_of(&seed) - 0.95, z = 1.9 * next_of(&seed) - 0.95;
            const double u = 2.5 * (x + 1.0) - 2.25, v = 2.5 * (1.0 - z) - 2.25;
            const double off = alpha_at(&c->mask, u, v) - c->mask.alpha_cutoff;
            if (fabs(off) > 1e-5) {
                const bool is = blocked(triangles, (const double[]){x, 0, z}, (const double[]){0, 1, 0});
                assert_int_equal(is, off > 0.0);
                through += !is;
                met += is;
            }
        }
        vsh_triangles_free(triangles);
        free(c);
    }
    assert_true(through > 1000 && met > 1000);
}

static void what_is_said_of_a_triangle_holds_all_over_it(void **state) {
    (void)state;
    uint32_t seed = 7;
    int told[3] = {0};
    for (int i = 0; i < 18 * 40; ++i) {
        uint8_t alpha[WIDE * HIGH];
        vsh_alpha_mask mask = random_mask(alpha, i % 18, &seed);
        /* mostly clear, or mostly opaque */
        for (int k = 0; k < WIDE * HIGH; ++k) {
            alpha[k] = k % 4 == 0 ? alpha[k] : i % 2 == 0 ? 255 : 0;
        }
        vshi_mask_table table;
        assert_int_equal(vshi_mask_table_create(&mask, NULL, &table, NULL), VSH_OK);
        for (int k = 0; k < 20; ++k) {
            float uvs[3][2];
            vshi_mask_place places[3];
            const double size = k % 3 == 0 ? 4.0 : 0.3, x = 8.0 * next_of(&seed) - 4.0,
                         y = 8.0 * next_of(&seed);
            for (int v = 0; v < 3; ++v) {
                uvs[v][0] = (float)(x + size * next_of(&seed));
                uvs[v][1] = (float)(y + size * next_of(&seed));
                places[v] = vshi_alpha_mask_place(&mask, uvs[v]);
            }
            const vshi_mask_cover cover = vshi_mask_table_cover(&table, places);
            ++told[cover];
            for (int s = 0; s < 40 && cover != VSHI_MASK_MIXED; ++s) {
                double a = next_of(&seed), b = next_of(&seed);
                a = a + b > 1.0 ? 1.0 - a : a;
                b = a + b > 1.0 ? 1.0 - b : b;
                const double p = 1.0 - a - b;
                const double u = p * (double)uvs[0][0] + a * (double)uvs[1][0] + b * (double)uvs[2][0];
                const double v = p * (double)uvs[0][1] + a * (double)uvs[1][1] + b * (double)uvs[2][1];
                const double off = alpha_at(&mask, u, v) - mask.alpha_cutoff;
                assert_true(cover == VSHI_MASK_OPAQUE ? off > -1e-6 : off < 1e-6);
            }
        }
        vshi_mask_table_free(&table);
    }
    assert_true(told[VSHI_MASK_CLEAR] > 200 && told[VSHI_MASK_OPAQUE] > 200 && told[VSHI_MASK_MIXED] > 1000);
}

static void what_lies_beyond_numbers_is_opaque(void **state) {
    (void)state;
    const uint8_t clear[1] = {0};
    const float values[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e20f};
    for (int wrapped = VSH_WRAP_REPEAT; wrapped <= VSH_WRAP_CLAMP; ++wrapped) {
        vsh_alpha_mask mask = mask_of(clear, 1, 1);
        mask.wrap[0] = mask.wrap[1] = wrapped;
        for (size_t i = 0; i < sizeof values / sizeof values[0]; ++i) {
            const vshi_mask_place at = vshi_alpha_mask_place(&mask, (const float[]){values[i], values[i]});
            assert_int_equal(vshi_alpha_mask_opaque(&mask, at), !isfinite(values[i]));
            const vshi_mask_place corners[3] = {at, {0.0, 0.0}, {1.0, 0.0}};
            vshi_mask_table table;
            assert_int_equal(vshi_mask_table_create(&mask, NULL, &table, NULL), VSH_OK);
            assert_true(vshi_mask_table_cover(&table, corners) != VSHI_MASK_CLEAR || isfinite(values[i]));
            vshi_mask_table_free(&table);
        }
    }
}

/* --- packets */

static void a_ray_sees_the_same_alone_and_in_any_packet(void **state) {
    (void)state;
    enum { RAYS = 4096 };
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    for (size_t k = 0; k < 8; ++k) {
        c->uvs[k] *= 37.0f; /* many small discs */
    }
    vsh_triangles *triangles = traced_of(&c->mesh, 1);
    static vshi_segment_ray rays[RAYS];
    static bool together[RAYS], turned[RAYS];
    uint32_t seed = 3;
    for (size_t i = 0; i < RAYS; ++i) {
        vshi_vec d = vshi_unit((vshi_vec){0.5 * next_of(&seed), 1.0, 0.5 * next_of(&seed)});
        rays[i] =
            (vshi_segment_ray){{next_of(&seed) - 0.8, 0.0, next_of(&seed) - 0.8}, {d.x, d.y, d.z}, INFINITY};
    }
    vshi_triangles_blocked(triangles, rays, RAYS, together);
    int met = 0;
    for (size_t i = 0; i < RAYS; ++i) {
        assert_int_equal(blocked(triangles, rays[i].origin, rays[i].direction), together[i]);
        met += together[i];
    }
    assert_true(met > RAYS / 4 && met < 3 * RAYS / 4);
    for (size_t i = 0; i < RAYS / 2; ++i) {
        const vshi_segment_ray kept = rays[i];
        rays[i] = rays[RAYS - 1 - i];
        rays[RAYS - 1 - i] = kept;
    }
    vshi_triangles_blocked(triangles, rays, RAYS, turned);
    for (size_t i = 0; i < RAYS; ++i) {
        assert_int_equal(turned[RAYS - 1 - i], together[i]);
    }
    vsh_triangles_free(triangles);
    free(c);
}

/* --- what else is made of triangles */

static void no_beam_is_cut_by_what_is_masked_or_one_sided(void **state) {
    (void)state;
    const vshi_sheet_beam beam = {{0.02, 0.0, 0.01}, {0.0, 1.0, 0.0}, 0.05, 0.05, INFINITY};
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    for (int kind = 0; kind < 3; ++kind) {
        vsh_mesh mesh = c->mesh;
        mesh.mask = kind == 1 ? mesh.mask : NULL;
        mesh.one_sided = kind == 2;
        vsh_triangles *triangles = traced_of(&mesh, 1);
        bool cut = false;
        vshi_triangles_cut(triangles, &beam, 1, 32, &cut);
        assert_int_equal(cut, kind == 0);
        vsh_triangles_free(triangles);
    }
    free(c);
}

static void an_opaque_triangle_beside_a_masked_one_cuts_no_beam_over_both(void **state) {
    (void)state;
    const vshi_sheet_beam beam = {{0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 0.05, 0.05, INFINITY};
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    memset(c->alpha, 0, sizeof c->alpha);
    vsh_mesh halves[2] = {c->mesh, c->mesh};
    halves[0].triangle_count = halves[1].triangle_count = 1;
    halves[1].indices += 3;
    for (size_t i = 0; i < 2; ++i) {
        halves[i].object = 1;
    }
    for (int masked = 0; masked < 2; ++masked) {
        halves[0].mask = NULL;
        halves[1].mask = masked ? c->mesh.mask : NULL;
        vsh_triangles *triangles = traced_of(halves, 2);
        bool cut = false;
        vshi_triangles_cut(triangles, &beam, 1, 32, &cut);
        assert_int_equal(cut && masked, 0);
        vsh_triangles_free(triangles);
    }
    free(c);
}

/* A box from -1 to 1. */
static vsh_mesh box_mesh(void) {
    static const float corners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                        {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
    static const uint32_t sides[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    return (vsh_mesh){.positions = corners[0], .indices = sides, .vertex_count = 8, .triangle_count = 12};
}

static void a_masked_box_holds_nothing(void **state) {
    (void)state;
    static const float uvs[16];
    const uint8_t half[2] = {255, 0};
    const vsh_alpha_mask mask = mask_of(half, 2, 1);
    vsh_mesh box = box_mesh();
    for (int masked = 0; masked < 2; ++masked) {
        box.mask = masked ? &mask : NULL;
        box.mask_uvs = uvs;
        box.solidity = masked ? VSH_SOLIDITY_SOLID : VSH_SOLIDITY_AUTO;
        vsh_triangles *triangles = traced_of(&box, 1);
        assert_int_equal(vshi_triangles_have_solids(triangles), !masked);
        vsh_triangles_free(triangles);
    }
}

static void a_one_sided_box_is_as_solid_as_any(void **state) {
    (void)state;
    vsh_mesh box = box_mesh();
    box.one_sided = 1;
    vsh_triangles *triangles = traced_of(&box, 1);
    assert_true(vshi_triangles_have_solids(triangles));
    for (int i = 0; i < 3; ++i) {
        const vshi_segment_ray ray = {{-3.0 + 3.0 * i, 0.1, 0.2}, {1.0, 0.0, 0.0}, INFINITY};
        bool nothing = false;
        uint8_t meets = VSHI_MEETS_NOTHING;
        /* before it, in it, behind it */
        assert_int_equal(vshi_triangles_depth(triangles, &ray, &nothing), i == 1);
        assert_int_equal(nothing, i == 2);
        vshi_triangles_meet(triangles, &ray, 1, &meets);
        assert_int_equal(meets, i == 0 ? VSHI_MEETS_AIR : i == 1 ? VSHI_MEETS_SOLID : VSHI_MEETS_NOTHING);
        /* and casts the same */
        assert_int_equal(blocked(triangles, ray.origin, ray.direction), i < 2);
    }
    vsh_triangles_free(triangles);
}

static void light_on_the_back_of_a_one_sided_face_comes_through(void **state) {
    (void)state;
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    for (int i = 0; i < 8; ++i) {
        const bool one_sided = (i & 1) != 0, mirrored = (i & 2) != 0, masked = (i & 4) != 0;
        const double transform[12] = {mirrored ? -1.0 : 1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        vsh_mesh mesh = c->mesh;
        mesh.one_sided = one_sided;
        mesh.transform = transform;
        mesh.mask = masked ? mesh.mask : NULL;
        vsh_triangles *triangles = traced_of(&mesh, 1);
        const double under[3] = {0.1, 0.0, 0.2}, over[3] = {0.1, 2.0, 0.2};
        /* its front is up: a light above shines on it */
        assert_true(blocked(triangles, under, (const double[]){0, 1, 0}));
        assert_int_equal(blocked(triangles, over, (const double[]){0, -1, 0}), !one_sided);
        assert_int_equal(blocked(triangles, (const double[]){0.95, 0.0, 0.95}, (const double[]){0, 1, 0}),
                         !masked);
        vsh_triangles_free(triangles);
    }
    free(c);
}

/* --- pieces */

static void pieces_are_the_opaque_part_to_within_their_size(void **state) {
    (void)state;
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    const vsh_run run = vsh_run_default();
    double before = 0.0;
    for (double size = 0.2; size > 0.01; size *= 0.5) {
        vshi_mask_pieces pieces;
        assert_int_equal(vshi_mask_pieces_cut(&c->mesh, size, &run, &pieces, NULL), VSH_OK);
        double area = 0.0, farthest = 0.0;
        for (size_t i = 0; i < pieces.count; ++i) {
            vshi_vec p[3];
            for (size_t k = 0; k < 3; ++k) {
                p[k] = vshi_vec_off(pieces.positions + 3 * (size_t)pieces.indices[3 * i + k]);
                farthest = fmax(farthest, hypot(p[k].x, p[k].z));
            }
            area += 0.5 * vshi_length(vshi_cross(vshi_sub(p[1], p[0]), vshi_sub(p[2], p[0])));
        }
        const double disc = PI * DISC_RADIUS * DISC_RADIUS;
        assert_true(area > disc - 1e-3); /* none of it is missing */
        assert_true(area < disc + 2.0 * PI * DISC_RADIUS * size);
        assert_true(farthest < DISC_RADIUS + 1.5 * size);
        assert_true(before == 0.0 || area < before);
        before = area;
        vshi_mask_pieces_free(&pieces);
    }
    free(c);
}

static void pieces_keep_to_the_memory_limit(void **state) {
    (void)state;
    card *c = malloc(sizeof *c);
    make_card(c, 1.0f);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1 << 20;
    vshi_mask_pieces pieces;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vshi_mask_pieces_cut(&c->mesh, 1e-9, &run, &pieces, &error), VSH_ERROR_LIMIT);
    assert_non_null(strstr(error.message, "'card'"));
    vshi_mask_pieces_free(&pieces);
    free(c);
}

static void voxels_hold_the_disc_and_not_the_card(void **state) {
    (void)state;
    card *c = malloc(sizeof *c);
    fan *f = malloc(sizeof *f);
    make_card(c, 0.0f);
    make_fan(f, 0.0f);
    const double voxel = 0.05;
    vsh_occluders *made[2];
    vsh_occluders_options options = vsh_occluders_options_default();
    options.triangles = 0;
    options.grid.voxel_size = voxel;
    vsh_error error = {VSH_OK, ""};
    for (int i = 0; i < 2; ++i) {
        if (vsh_occluders_create(i == 0 ? &c->mesh : &f->mesh, 1, &options, NULL, &made[i], &error) !=
            VSH_OK) {
            fail_msg("%s", error.message);
        }
    }
    vsh_occluder_parts cut, disc;
    vsh_occluders_get_parts(made[0], &cut);
    vsh_occluders_get_parts(made[1], &disc);
    int inside = 0, between = 0;
    for (int i = 0; i < 61 * 61; ++i) {
        const double at[3] = {-1.2 + 0.04 * (i % 61), 0.01, -1.2 + 0.04 * (i / 61)};
        float distances[2];
        vsh_field_sample(cut.field, 1, at, &distances[0]);
        vsh_field_sample(disc.field, 1, at, &distances[1]);
        const double a = (double)distances[0], b = (double)distances[1];
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
    vsh_occluders_free(made[0]);
    vsh_occluders_free(made[1]);
    free(c);
    free(f);
}

/* --- what is refused */

static void masks_that_are_none_are_refused(void **state) {
    (void)state;
    card *c = malloc(sizeof *c);
    for (int i = 0; i < 8; ++i) {
        make_card(c, 0.0f);
        switch (i) {
        case 0:
            c->mask.alpha = NULL;
            break;
        case 1:
            c->mask.width = 0;
            break;
        case 2:
            c->mask.height = 1 << 16;
            break;
        case 3:
            c->mask.wrap[1] = 3;
            break;
        case 4:
            c->mask.uv_transform[5] = NAN;
            break;
        case 5:
            c->mask.alpha_cutoff = -0.1;
            break;
        case 6:
            c->mask.base_alpha = 1.5;
            break;
        default:
            c->mesh.mask_uvs = NULL;
            break;
        }
        vsh_triangles *triangles = NULL;
        vsh_error error = {VSH_OK, ""};
        assert_int_equal(vsh_triangles_create(&c->mesh, 1, NULL, &triangles, &error), VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "'card'"));
        assert_null(triangles);
    }
    free(c);
}

int main(void) {
    const struct CMUnitTest traced[] = {
        cmocka_unit_test(a_masked_card_casts_the_shadow_of_its_disc),
        cmocka_unit_test(soft_shadows_and_ao_are_those_of_the_disc_as_triangles),
        cmocka_unit_test(rays_see_wraps_transforms_cutoff_and_base_factor),
        cmocka_unit_test(a_ray_sees_the_same_alone_and_in_any_packet),
        cmocka_unit_test(no_beam_is_cut_by_what_is_masked_or_one_sided),
        cmocka_unit_test(an_opaque_triangle_beside_a_masked_one_cuts_no_beam_over_both),
        cmocka_unit_test(a_masked_box_holds_nothing),
        cmocka_unit_test(a_one_sided_box_is_as_solid_as_any),
        cmocka_unit_test(light_on_the_back_of_a_one_sided_face_comes_through),
        cmocka_unit_test(masks_that_are_none_are_refused),
    };
    const struct CMUnitTest always[] = {
        cmocka_unit_test(what_is_said_of_a_triangle_holds_all_over_it),
        cmocka_unit_test(what_lies_beyond_numbers_is_opaque),
        cmocka_unit_test(pieces_are_the_opaque_part_to_within_their_size),
        cmocka_unit_test(pieces_keep_to_the_memory_limit),
        cmocka_unit_test(voxels_hold_the_disc_and_not_the_card),
    };
    const int failed = vsh_triangles_available() ? cmocka_run_group_tests(traced, NULL, NULL) : 0;
    return failed + cmocka_run_group_tests(always, NULL, NULL);
}
