/* Instruction sets: those that this machine lacks are refused by name. test_bits has the same bits for each.
 */
#include "base/isa.h"
#include "shading.h"
#include "testing.h"

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
