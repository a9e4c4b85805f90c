/* Where invalid texels take their values from: within their chart, and how far. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bake/spread.h"

enum { MOST = 4096, NOWHERE = -1 };

/* A lightmap of one band. A letter a texel: of the mesh of that letter, valid in upper case, invalid in lower
 * case; a blank is empty. */
typedef struct map {
    vsh_texels texels;
    uint32_t texel[MOST], mesh[MOST];
    uint8_t state[MOST];
    int from[MOST]; /* the texel that each takes its value from */
} map;

static void spread_over(map *m, int32_t width, const char *letters) {
    const size_t count = strlen(letters);
    assert_true(count <= MOST);
    memset(m, 0, sizeof *m);
    m->texels.info.width = width;
    m->texels.info.height = m->texels.band.rows = (int32_t)count / width;
    m->texels.texel = m->texel;
    m->texels.mesh = m->mesh;
    for (size_t i = 0; i < count; ++i) {
        m->from[i] = NOWHERE;
        m->state[i] = VSHI_TEXEL_EMPTY;
        if (letters[i] == ' ') {
            continue;
        }
        const bool valid = letters[i] < 'a';
        m->state[i] = valid ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
        m->texel[m->texels.count] = vsh_texel((uint32_t)i % (uint32_t)width, (uint32_t)i / (uint32_t)width);
        m->mesh[m->texels.count++] = (uint32_t)(letters[i] - (valid ? 'A' : 'a'));
    }
    vshi_spread spread;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vshi_spread_find(&m->texels, m->state, &spread, &error), VSH_OK);
    for (size_t i = 0; i < spread.count; ++i) {
        assert_int_equal(m->state[spread.texel[i]], VSHI_TEXEL_INVALID);
        assert_int_equal(m->from[spread.texel[i]], NOWHERE);
        m->from[spread.texel[i]] = (int)spread.source[i];
    }
    vshi_spread_free(&spread);
}

static void an_invalid_texel_is_filled_from_at_most_64_texels_away(void **state) {
    (void)state;
    map *m = malloc(sizeof *m);
    char letters[201];
    memset(letters, 'a', 200);
    letters[200] = '\0';
    letters[0] = 'A';
    spread_over(m, 200, letters);
    for (int i = 1; i < 200; ++i) {
        assert_int_equal(m->from[i], i <= 64 ? 0 : NOWHERE);
    }
    spread_over(m, 1, letters);
    assert_int_equal(m->from[64], 0);
    assert_int_equal(m->from[65], NOWHERE);
    free(m);
}

static void texels_of_other_charts_are_never_taken_from(void **state) {
    (void)state;
    map *m = malloc(sizeof *m);
    /* another mesh touches; another chart of the same mesh does not */
    spread_over(m, 10,
                "Aaaaaa    "
                "BBBBBB AAA"
                "          "
                "aaaaaaa   ");
    for (int i = 1; i <= 5; ++i) {
        assert_int_equal(m->from[i], 0);
    }
    for (int i = 30; i <= 36; ++i) {
        assert_int_equal(m->from[i], NOWHERE);
    }
    /* over two arms of one chart the way goes around, not across */
    spread_over(m, 9,
                "AAAAAAAA "
                "        A"
                "aaaaaaaa ");
    assert_int_equal(m->from[25], 17);
    assert_int_equal(m->from[18], 17);
    free(m);
}

static void the_nearest_valid_texel_of_a_chart_is_taken_and_the_first_of_equals(void **state) {
    (void)state;
    map *m = malloc(sizeof *m);
    spread_over(m, 7,
                "AaaaaaA"
                "aaaaaaa"
                "AaaaaaA");
    static const int FROM[21] = {NOWHERE, 0,  0,  0,  6,  6,  NOWHERE, /* */
                                 0,       0,  0,  0,  6,  6,  6,       /* */
                                 NOWHERE, 14, 14, 14, 20, 20, NOWHERE};
    for (int i = 0; i < 21; ++i) {
        assert_int_equal(m->from[i], FROM[i]);
    }
    free(m);
}

static void values_are_copied_from_texels_that_have_one(void **state) {
    (void)state;
    uint8_t states[4] = {VSHI_TEXEL_VALID, VSHI_TEXEL_INVALID, VSHI_TEXEL_INVALID, VSHI_TEXEL_INVALID};
    float values[8] = {1.0f, 2.0f, 0.0f, 0.0f, 0.0f, 0.0f, 5.0f, 6.0f};
    uint32_t texels[2] = {1, 2}, sources[2] = {0, 3}; /* the second one lost its value to a method */
    const vshi_spread spread = {2, texels, sources};
    const vshi_plane plane = {values, 2};
    vshi_spread_copy(&spread, states, &plane, 1);
    static const float AFTER[8] = {1.0f, 2.0f, 1.0f, 2.0f, 0.0f, 0.0f, 5.0f, 6.0f};
    assert_memory_equal(values, AFTER, sizeof values);
    assert_int_equal(states[1], VSHI_TEXEL_FILLED);
    assert_int_equal(states[2], VSHI_TEXEL_INVALID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_invalid_texel_is_filled_from_at_most_64_texels_away),
        cmocka_unit_test(texels_of_other_charts_are_never_taken_from),
        cmocka_unit_test(the_nearest_valid_texel_of_a_chart_is_taken_and_the_first_of_equals),
        cmocka_unit_test(values_are_copied_from_texels_that_have_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
