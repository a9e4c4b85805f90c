/* Instruction sets: each that this machine has gives the same bits, the others are refused by name. */
#include "testing.h"
#include "traced.h"

#include "base/isa.h"
#include "previews.h"
#include "shade/kernel/march.h"

typedef struct march_result {
    float close[1000];
    float clear[1000];
    int8_t proof[1000];
    vshi_march_stats stats;
} march_result;

static void march_with(vshi_march_fn *march, const vsh_field *field, size_t count, int32_t kind,
                       march_result *result) {
    static float lanes[14][1000];
    uint64_t counter = 77;
    for (size_t i = 0; i < count; ++i) {
        double d[3];
        random_direction(&counter, d);
        for (int axis = 0; axis < 3; ++axis) {
            lanes[axis][i] = (float)between(&counter, axis == 1 ? -20.0 : -100.0, axis == 1 ? 80.0 : 100.0);
            lanes[3 + axis][i] = (float)d[axis];
        }
        const double sine = i % 5 == 0 ? 0.0 : between(&counter, 0.001, 0.6);
        lanes[6][i] = 0.0625f;
        lanes[7][i] = (float)between(&counter, 0.1, 300.0);
        lanes[8][i] = (float)sine;
        lanes[9][i] = i % 3 == 0 ? 0.0f : -(float)sine;
        lanes[10][i] = sine > 0.0 ? (float)sine : 1.0f;
        lanes[11][i] = i % 4 == 0 ? INFINITY : (float)between(&counter, 0.0, 1.0);
        lanes[12][i] = (float)between(&counter, 0.01, 12.0);
        lanes[13][i] = i % 2 == 0 ? 0.0f : 1.0f;
    }
    const vshi_rays rays = {.count = count,
                            .origin = {lanes[0], lanes[1], lanes[2]},
                            .direction = {lanes[3], lanes[4], lanes[5]},
                            .begin = lanes[6],
                            .end = lanes[7],
                            .sine = lanes[8],
                            .stop = lanes[9],
                            .close = lanes[10],
                            .horizon = lanes[11],
                            .wide = lanes[12],
                            .deeper = lanes[13],
                            .clear = result->clear,
                            .proof = result->proof};
    memset(result->clear, 0, sizeof result->clear);
    memset(result->proof, 0, sizeof result->proof);
    result->stats = (vshi_march_stats){0, 0};
    march(field, &rays, kind, 40, &result->stats);
    memcpy(result->close, lanes[10], sizeof result->close);
}

static void expect_same(const march_result *a, const march_result *b, size_t count) {
    assert_memory_equal(a->close, b->close, count * sizeof a->close[0]);
    assert_memory_equal(a->proof, b->proof, count);
    assert_memory_equal(a->clear, b->clear, count * sizeof a->clear[0]);
    assert_int_equal(a->stats.samples, b->stats.samples);
    assert_int_equal(a->stats.unfinished, b->stats.unfinished);
}

TEST(every_kernel_marches_the_same_bits) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    static march_result base, other;
    const size_t counts[] = {0, 1, 3, 4, 5, 15, 16, 17, 100, 1000};
    for (size_t c = 0; c < sizeof counts / sizeof counts[0]; ++c) {
        for (int32_t kind = VSHI_MARCH_PLAIN; kind <= VSHI_MARCH_GROWN; ++kind) {
            march_with(vshi_kernel_base.march, field, counts[c], kind, &base);
            march_with(vshi_kernel_few.march, field, counts[c], kind, &other);
            expect_same(&base, &other, counts[c]);
            for (int32_t isa = VSH_ISA_AVX2; isa < VSHI_ISA_COUNT; ++isa) {
                if (!vsh_isa_available(isa)) {
                    continue;
                }
                march_with(vshi_kernel_of(isa)->march, field, counts[c], kind, &other);
                expect_same(&base, &other, counts[c]);
            }
        }
    }
    march_with(vshi_kernel_base.march, field, 1000, VSHI_MARCH_BEAM, &base);
    size_t partly_clear = 0;
    for (size_t i = 0; i < 1000; ++i) {
        partly_clear += base.proof[i] == VSHI_UNPROVED && base.clear[i] > 0.0625f && base.clear[i] < 300.0f;
    }
    assert_true(partly_clear > 10);
    march_with(vshi_kernel_base.march, field, 1000, VSHI_MARCH_PROOF, &base);
    bool unproved = false, proved_free = false;
    for (size_t i = 0; i < 1000; ++i) {
        unproved = unproved || base.proof[i] == VSHI_UNPROVED;
        proved_free = proved_free || base.proof[i] == VSHI_PROVED_FREE;
    }
    assert_true(unproved && proved_free);
    march_with(vshi_kernel_base.march, field, 1000, VSHI_MARCH_PLAIN, &base);
    assert_true(base.stats.unfinished > 0);
}

TEST(an_instruction_set_that_is_missing_or_unknown_is_refused_by_name) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.2, 1.0);
    const double place[3] = {0.0, 3.0, 0.0};
    const vsh_points points = {1, place, NULL, NULL};
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    vsh_run run = vsh_run_default();
    float value;
    for (int32_t isa = -1; isa <= VSHI_ISA_COUNT; ++isa) {
        run.isa = isa;
        const vsh_result result =
            vsh_shade_shadow(occluders_of(field), &points, &light, NULL, &run, &value, NULL, NULL, &failure);
        if (vsh_isa_available(isa)) {
            assert_int_equal(result, VSH_OK);
            continue;
        }
        assert_int_equal(result, VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(failure.message, "isa"));
        assert_true(vsh_get_name(VSH_NAMES_ISA, isa) == NULL ||
                    strstr(failure.message, vsh_get_name(VSH_NAMES_ISA, isa)) != NULL);
    }
    /* a run from before it had an instruction set */
    run.isa = -1;
    run.struct_size = offsetof(vsh_run, isa);
    assert_ok(
        vsh_shade_shadow(occluders_of(field), &points, &light, NULL, &run, &value, NULL, NULL, &failure));
}

TEST(the_best_set_is_one_that_this_machine_has) {
    assert_true(vsh_isa_available(VSH_ISA_BASE) && vsh_isa_available(VSH_ISA_BEST));
    assert_false(vsh_isa_available(-1) || vsh_isa_available(VSHI_ISA_COUNT));
    const int32_t best = vshi_isa_resolve(VSH_ISA_BEST);
    assert_true(best >= VSH_ISA_BASE && vsh_isa_available(best));
}
