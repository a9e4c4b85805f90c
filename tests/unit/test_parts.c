/* Parts of lightmaps, by the library: what merging takes, and which parts have rows. */
#include "parts.h"

static void bake_whole(const case_scene *c, taken *rows, vsh_bake_report *report) {
    const vsh_row_sink sink = sink_of(rows);
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    vsh_error error;
    assert_ok(vsh_bake_scene(&c->scene, &options, NULL, report, &error), &error);
}

static void a_sink_takes_merged_rows_as_of_one_bake_and_words_come_back(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken *one = calloc(2, sizeof *one), *all = one + 1;
    assert_non_null(one);
    vsh_error error;
    vsh_bake_report report;
    bake_whole(&c, one, &report);
    assert_true(report.invalid_texels > 20 && report.invalid_texels < SIZE * SIZE / 2);
    bake_parts(&c);
    assert_ok(merge(&c, all, NULL, &error), &error);
    assert_int_equal(all->rows, SIZE);
    assert_int_equal(all->channels, 6);
    assert_memory_equal(one->values, all->values, sizeof one->values);
    char **words;
    size_t count;
    assert_ok(vsh_part_words(c.output, 0, NULL, &words, &count, &error), &error);
    assert_int_equal(count, 3);
    assert_string_equal(words[0], "one");
    assert_string_equal(words[1], "");
    assert_string_equal(words[2], "three words");
    assert_null(words[3]);
    vsh_part_words_free(words);
    free(one);
}

static void what_parts_leave_of_ao_is_as_of_one_bake(void **state) {
    (void)state;
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
        vsh_error error;
        bake_whole(&c, one, NULL);
        bake_parts(&c);
        assert_ok(merge(&c, all, NULL, &error), &error);
        assert_int_equal(all->channels, made > 0 ? CHANNELS : 5);
        assert_memory_equal(one, all, sizeof *one);
        free(one);
    }
}

static void a_shard_without_rows_reads_nothing_and_its_part_is_merged(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    fill_traced(&c, wall, false);
    taken *one = calloc(2, sizeof *one), *all = one + 1;
    assert_non_null(one);
    bake_parts(&c);
    vsh_error error;
    assert_ok(merge(&c, one, NULL, &error), &error);
    bake_parts_of(&c, vsh_bake_job_options_default().shard_least);
    assert_ok(merge(&c, all, NULL, &error), &error);
    assert_memory_equal(one, all, sizeof *one);
    free(one);

    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.shard = options.shard_count = SHARDS;
    options.parts = at("alone");
    assert_int_equal(remove(wall), 0);
    for (int idle = 0; idle < 2; ++idle) {
        options.shard_least = idle ? 1e-3 : 0.0; /* 48 × 48 texels take some milliseconds */
        vsh_bake_job *job = NULL;
        c.receiver.width = c.receiver.height = idle ? 8 : SIZE;
        const vsh_result result = vsh_bake_job_create(&c.scene, &options, NULL, &job, &error);
        assert_int_equal(result, idle ? VSH_OK : VSH_ERROR_READ);
        if (idle) {
            assert_int_equal(vsh_bake_job_count(job), 0);
            assert_int_equal(vsh_bake_job_run(job, NULL, &error), VSH_ERROR_ARGUMENT); /* not prepared */
            assert_ok(vsh_bake_job_measure(job, NULL, &error), &error);
            assert_ok(vsh_bake_job_prepare(job, NULL, &error), &error);
            assert_ok(vsh_bake_job_run(job, NULL, &error), &error);
        }
        vsh_bake_job_free(job);
    }
}

static size_t lightmaps_of_second(const case_scene *c, double least) {
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.shard = options.shard_count = SHARDS;
    options.shard_least = least;
    vsh_bake_job *job = NULL;
    vsh_error error;
    assert_ok(vsh_bake_job_create(&c->scene, &options, NULL, &job, &error), &error);
    const size_t count = vsh_bake_job_count(job);
    assert_int_equal(vsh_bake_job_shards(&c->scene, &options), count == 0 ? 1 : SHARDS);
    vsh_bake_job_free(job);
    return count;
}

static void what_is_marched_is_more_work_and_objects_of_their_own_are_not_known(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    fill_traced(&c, wall, false);
    assert_int_equal(lightmaps_of_second(&c, 0.003), 0);
    assert_int_equal(vsh_bake_job_shards(&c.scene, NULL), 0);
    c.scene.shade.max_error = 1e-3;
    assert_int_equal(lightmaps_of_second(&c, 0.003), 1);
    c.scene.shade.max_error = 0.02;
    c.receiver.atlas = VSH_ATLAS_OBJECTS;
    assert_int_equal(lightmaps_of_second(&c, 0.003), 1);
    fill(&c, SIZE, 0.4);
    assert_int_equal(lightmaps_of_second(&c, 0.003), 1);
}

/* A tenth of 48 rows is 4.8. A border of AO costs more at a spacing of 4, and less at 2, traced or marched.
 */
static void borders_of_ao_take_a_tenth_at_most(void **state) {
    (void)state;
    case_scene c;
    char wall[300];
    for (int marched = 0; marched < 2; ++marched) {
        if (marched == 0) {
            fill_traced(&c, wall, false);
        } else {
            fill(&c, SIZE, 0.4);
        }
        c.receiver.ao_spacing = 4;
        assert_int_equal(lightmaps_of_second(&c, 1e-9), 0);
        c.receiver.ao_spacing = 2;
        assert_int_equal(lightmaps_of_second(&c, 1e-9), 1);
    }
    c.receiver.ao_spacing = 1;
    assert_int_equal(lightmaps_of_second(&c, 1e-9), 1);
    c.receiver.ao_spacing = 4;
    c.scene.ao = 0;
    assert_int_equal(lightmaps_of_second(&c, 1e-9), 1);
}

static void shards_that_are_told_otherwise_how_many_have_rows_are_refused(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    vsh_error error;
    for (int32_t idle = 0; idle < 2; ++idle) {
        bake_parts_of(&c, idle ? 0.0 : 1.0);
        vsh_bake_job_options options = vsh_bake_job_options_default();
        options.shard = options.shard_count = SHARDS;
        options.shard_least = idle ? 1.0 : 0.0;
        assert_ok(vsh_bake_scene(&c.scene, &options, NULL, NULL, &error), &error);
        assert_int_equal(merge(&c, &t, NULL, &error), VSH_ERROR_INPUT);
        assert_non_null(strstr(error.message, "floor.exr.2-of-2.part: is of other inputs or options"));
    }
}

static void a_job_of_a_part_is_refused_what_it_cannot_do(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 0.4);
    taken t;
    const vsh_row_sink sink = sink_of(&t);
    static const int32_t wrong[][2] = {{1, 0}, {2, 1}, {-1, 3}, {1, 10001}, {1, -1}};
    static const double times[] = {-1.0, 2e9, NAN, INFINITY};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0] + 6; ++i) {
        vsh_bake_job_options options = vsh_bake_job_options_default();
        options.shard = i < 5 ? wrong[i][0] : 1;
        options.shard_count = i < 5 ? wrong[i][1] : 2;
        options.sink = i == 5 ? &sink : NULL;
        options.word_count = i == 6;
        options.shard_least = i > 6 ? times[i - 7] : options.shard_least;
        vsh_bake_job *job = NULL;
        vsh_error error;
        assert_int_equal(vsh_bake_job_create(&c.scene, &options, NULL, &job, &error), VSH_ERROR_ARGUMENT);
        assert_null(job);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sink_takes_merged_rows_as_of_one_bake_and_words_come_back),
        cmocka_unit_test(what_parts_leave_of_ao_is_as_of_one_bake),
        cmocka_unit_test(a_shard_without_rows_reads_nothing_and_its_part_is_merged),
        cmocka_unit_test(what_is_marched_is_more_work_and_objects_of_their_own_are_not_known),
        cmocka_unit_test(borders_of_ao_take_a_tenth_at_most),
        cmocka_unit_test(shards_that_are_told_otherwise_how_many_have_rows_are_refused),
        cmocka_unit_test(a_job_of_a_part_is_refused_what_it_cannot_do),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
