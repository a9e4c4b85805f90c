/* What is known of a texture's holes over a triangle, and the pieces that voxels are made of. */
#include "masked.h"
#include "testing.h"

#include "mesh/alpha_mask.h"

TEST(what_is_said_of_a_triangle_holds_all_over_it) {
    uint32_t seed = 7;
    int told[3] = {0};
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
    }
    assert_true(told[VSHI_MASK_CLEAR] > 200 && told[VSHI_MASK_OPAQUE] > 200 && told[VSHI_MASK_MIXED] > 1000);
}

TEST(what_lies_beyond_numbers_is_opaque) {
    const uint8_t clear[1] = {0};
    const float values[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f, 1e20f};
    for (int wrapped = VSH_WRAP_REPEAT; wrapped <= VSH_WRAP_CLAMP; ++wrapped) {
        vsh_alpha_mask mask = mask_of(clear, 1, 1);
        mask.wrap[0] = mask.wrap[1] = wrapped;
        for (size_t i = 0; i < sizeof values / sizeof values[0]; ++i) {
            const vshi_mask_place at = vshi_alpha_mask_place(&mask, (const float[]){values[i], values[i]});
            assert_int_equal(vshi_alpha_mask_opaque(&mask, at), !isfinite(values[i]));
            const vshi_mask_place corners[3] = {at, {0.0, 0.0}, {1.0, 0.0}};
            FREED_BY(vshi_mask_table_free) vshi_mask_table table;
            assert_ok(vshi_mask_table_create(&mask, NULL, &table, &failure));
            assert_true(vshi_mask_table_cover(&table, corners) != VSHI_MASK_CLEAR || isfinite(values[i]));
        }
    }
}

TEST(pieces_are_the_opaque_part_to_within_their_size) {
    FREED card *c = card_at(1.0f);
    const vsh_run run = vsh_run_default();
    double before = 0.0;
    for (double size = 0.2; size > 0.01; size *= 0.5) {
        FREED_BY(vshi_mask_pieces_free) vshi_mask_pieces pieces;
        assert_ok(vshi_mask_pieces_cut(&c->mesh, size, &run, &pieces, &failure));
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
    vsh_occluders *made[2];
    vsh_occluders_options options = vsh_occluders_options_default();
    options.triangles = 0;
    options.grid.voxel_size = voxel;
    for (int i = 0; i < 2; ++i) {
        assert_ok(vsh_occluders_create(i == 0 ? &c->mesh : &f->mesh, 1, &options, NULL, &made[i], &failure));
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
}
