/* Parts of lightmaps, by the library: what merging takes, and which parts have rows. */
#include "expect.h"
#include "parts.h"

static void bake_whole(const case_scene *c, taken *rows, vsh_bake_report *report) {
    const vsh_bake_options options = options_of(rows);
    expect_ok(vsh_bake_scene(&c->scene, &options, NULL, report, &failure));
}

static void merged_rows_are_those_of_one_bake_and_words_come_back(void **state) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken *one = calloc(2, sizeof *one), *all = one + 1;
    assert_non_null(one);
    vsh_bake_report report = {.errors = NULL};
    bake_whole(&c, one, &report);
    assert_true(report.invalid_texels > 20 && report.invalid_texels < SIZE * SIZE / 2);
    bake_parts(&c);
    expect_ok(merge(&c, all, NULL, &failure));
    assert_int_equal(all->rows, SIZE);
    assert_int_equal(all->channels, 6);
    assert_memory_equal(one->values, all->values, sizeof one->values);
    char **words;
    size_t count;
    expect_ok(vsh_part_words(c.output, 0, NULL, &words, &count, &failure));
    assert_int_equal(count, 3);
    assert_string_equal(words[0], "one");
    assert_string_equal(words[1], "");
    assert_string_equal(words[2], "three words");
    assert_null(words[3]);
    vsh_part_words_free(words);
    free(one);
}

static void what_parts_leave_of_ao_is_as_of_one_bake(void **state) {
    case_scene c;
    char wall[300];
    if (!vsh_triangles_available()) {
        return;
    }
    for (int32_t made = 0; made < 3; ++made) {
        fill_traced(&c, wall, made > 0);
        c.scene.has_ambient = made == 2;
        c.scene.ambient[0] = 0.25;
        c.scene.ambient[2] = 0.75;
        taken *one = calloc(2, sizeof *one), *all = one + 1;
        assert_non_null(one);
        bake_whole(&c, one, NULL);
        bake_parts(&c);
        expect_ok(merge(&c, all, NULL, &failure));
        assert_int_equal(all->channels, made > 0 ? CHANNELS : 5);
        assert_memory_equal(one, all, sizeof *one);
        free(one);
    }
}

static void options_that_a_part_cannot_have_are_refused(void **state) {
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    static const int32_t wrong[][2] = {{1, 0}, {2, 1}, {-1, 3}, {1, 10001}, {1, -1}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0] + 2; ++i) {
        vsh_bake_options options = i == 5 ? options_of(&t) : vsh_bake_options_default();
        options.shard = i < 5 ? wrong[i][0] : 1;
        options.shard_count = i < 5 ? wrong[i][1] : 2;
        options.word_count = i == 6;
        expect_error(vsh_bake_scene(&c.scene, &options, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(merged_rows_are_those_of_one_bake_and_words_come_back),
        cmocka_unit_test(what_parts_leave_of_ao_is_as_of_one_bake),
        cmocka_unit_test(options_that_a_part_cannot_have_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
