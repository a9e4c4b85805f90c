/* A scene's lightmaps, from its files to its rows, by one call and by steps. */
#include "floor_under_ball.h"

enum { SIZE = 48 };

/* Rows as they come. */
typedef struct taken {
    float *values; /* [channels][SIZE][SIZE] */
    char names[16][VSH_CHANNEL_NAME];
    int32_t channels, width, rows;
    int begun, ended, fail_at; /* fail_at: the call of `add` that fails; 0: none */
    int adds;
    vsh_result result; /* that `end` was told */
} taken;

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    (void)error;
    taken *t = user;
    ++t->begun;
    t->channels = image->channel_count;
    t->width = image->width;
    t->rows = 0;
    assert_int_equal(lightmap->width, image->width);
    assert_null(image->planes);
    for (int32_t c = 0; c < image->channel_count && c < 16; ++c) {
        snprintf(t->names[c], sizeof t->names[c], "%s", image->names[c]);
    }
    t->values = calloc((size_t)image->channel_count * SIZE * SIZE, sizeof(float));
    assert_non_null(t->values);
    return VSH_OK;
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    taken *t = user;
    if (++t->adds == t->fail_at) {
        error->code = VSH_ERROR_WRITE;
        snprintf(error->message, sizeof error->message, "the sink is full");
        return VSH_ERROR_WRITE;
    }
    for (int32_t c = 0; c < t->channels; ++c) {
        memcpy(t->values + ((size_t)c * SIZE + (size_t)t->rows) * SIZE, planes[c],
               (size_t)rows * SIZE * sizeof(float));
    }
    t->rows += rows;
    return VSH_OK;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    (void)error;
    taken *t = user;
    ++t->ended;
    t->result = result;
    return VSH_OK;
}

static vsh_row_sink sink_of(taken *t) {
    vsh_row_sink sink = vsh_row_sink_default();
    sink.begin = begin;
    sink.add = add;
    sink.end = end;
    sink.user = t;
    return sink;
}

static vsh_result bake_into(const case_scene *c, int32_t band_rows, taken *t, vsh_error *error) {
    const vsh_row_sink sink = sink_of(t);
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    options.band_rows = band_rows;
    return vsh_bake_scene(&c->scene, &options, NULL, NULL, error);
}

static void one_call_writes_the_file_that_a_sink_is_handed(void **state) {
    (void)state;
    static const char *const names[] = {"shadow.sun",   "ao",           "irradiance.R",
                                        "irradiance.G", "irradiance.B", "A"};
    case_scene c;
    fill(&c, SIZE, 1.0);
    vsh_error error;
    vsh_bake_report report;
    assert_ok(vsh_bake_scene(&c.scene, NULL, NULL, &report, &error), &error);
    assert_int_equal(report.texels, SIZE * SIZE);
    assert_int_equal(report.bands, 1);
    assert_int_equal(report.error_count, 0);
    assert_true(report.occluders.active_voxels > 0 && report.shade.marches > 0);
    taken t = {.fail_at = 0};
    assert_ok(bake_into(&c, 0, &t, &error), &error);
    assert_int_equal(t.begun, 1);
    assert_int_equal(t.ended, 1);
    assert_int_equal(t.result, VSH_OK);
    assert_int_equal(t.rows, SIZE);
    assert_int_equal(t.channels, 6);
    vsh_image_file *file;
    assert_ok(vsh_image_read(c.output, NULL, &file, &error), &error);
    const vsh_image image = vsh_image_view(file);
    for (int32_t k = 0; k < t.channels; ++k) {
        assert_string_equal(t.names[k], names[k]);
        int32_t same = 0;
        while (same < image.channel_count && strcmp(image.names[same], names[k]) != 0) {
            ++same;
        }
        assert_true(same < image.channel_count);
        assert_memory_equal(image.planes[same], t.values + (size_t)k * SIZE * SIZE,
                            SIZE * SIZE * sizeof(float));
    }
    size_t count, told = 0;
    const vsh_attribute *attributes = vsh_image_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        told += strcmp(attributes[i].name, "vdbshade_shadow") == 0;
    }
    assert_int_equal(told, 1);
    vsh_image_free(file);
    free(t.values);
}

static void rows_of_bands_are_the_rows_of_the_whole(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 1.0);
    vsh_error error;
    taken whole = {.fail_at = 0}, banded = {.fail_at = 0};
    assert_ok(bake_into(&c, 0, &whole, &error), &error);
    assert_ok(bake_into(&c, 16, &banded, &error), &error);
    assert_int_equal(whole.adds, 1);
    assert_int_equal(banded.adds, 3);
    assert_int_equal(banded.rows, SIZE);
    assert_memory_equal(whole.values, banded.values, (size_t)whole.channels * SIZE * SIZE * sizeof(float));
    free(whole.values);
    free(banded.values);
}

static void what_a_sink_refuses_ends_the_bake_as_it_says(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 1.0);
    vsh_error error;
    taken t = {.fail_at = 2};
    assert_int_equal(bake_into(&c, 16, &t, &error), VSH_ERROR_WRITE);
    assert_string_equal(error.message, "the sink is full");
    assert_int_equal(t.adds, 2);
    assert_int_equal(t.ended, 1);
    assert_int_equal(t.result, VSH_ERROR_WRITE);
    free(t.values);
}

static void steps_come_in_their_order(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 1.0);
    vsh_error error;
    vsh_bake_job *job;
    assert_ok(vsh_bake_job_create(&c.scene, NULL, NULL, &job, &error), &error);
    assert_int_equal(vsh_bake_job_prepare(job, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_bake_job_run(job, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_ok(vsh_bake_job_measure(job, NULL, &error), &error);
    assert_int_equal(vsh_bake_job_run(job, NULL, &error), VSH_ERROR_ARGUMENT);
    vsh_job_lightmap lightmap;
    vsh_bake_job_lightmap(job, 0, &lightmap);
    assert_int_equal(lightmap.covered, SIZE * SIZE);
    assert_int_equal(lightmap.bands, 1);
    assert_string_equal(lightmap.output, c.output);
    assert_ok(vsh_bake_job_prepare(job, NULL, &error), &error);
    vsh_bake_report report;
    vsh_bake_job_get_report(job, &report);
    assert_int_equal(report.error_count, 3);
    assert_int_equal(report.texels, 0);
    vsh_bake_job_free(job);
}

static void what_cannot_be_is_refused_before_a_file_is_read(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 1.0);
    unlink(c.mesh);
    vsh_error error;
    vsh_bake_job *job;
    taken t = {.fail_at = 0};
    vsh_row_sink sink = sink_of(&t);
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    sink.end = NULL;
    assert_int_equal(vsh_bake_job_create(&c.scene, &options, NULL, &job, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "vsh_row_sink"));
    c.receiver.output = "floor.xyz";
    assert_int_equal(vsh_bake_job_create(&c.scene, NULL, NULL, &job, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "floor.xyz"));
    c.receiver.output = c.output;
    assert_int_equal(vsh_bake_job_create(&c.scene, NULL, NULL, &job, &error), VSH_ERROR_READ);
    assert_null(job);
    c.scene.receiver_count = 0;
    assert_int_equal(vsh_bake_job_create(&c.scene, NULL, NULL, &job, &error), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_receiver_check(&c.scene, 0, &error), VSH_ERROR_ARGUMENT);
}

static void lightmaps_of_objects_have_their_names(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 1.0);
    vsh_error error;
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.per_object = 1;
    static const char *const outputs[2] = {"of.exr", "of-%s.exr"};
    static const char *const named[2] = {"of.defaultobject.exr", "of-defaultobject.exr"};
    for (int i = 0; i < 2; ++i) {
        char output[300];
        vsh_bake_job *job;
        snprintf(output, sizeof output, "%s", at(outputs[i]));
        c.receiver.output = output;
        assert_ok(vsh_bake_job_create(&c.scene, &options, NULL, &job, &error), &error);
        assert_int_equal(vsh_bake_job_count(job), 1);
        vsh_job_lightmap lightmap;
        vsh_bake_job_lightmap(job, 0, &lightmap);
        assert_string_equal(lightmap.output, at(named[i]));
        vsh_bake_job_free(job);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_call_writes_the_file_that_a_sink_is_handed),
        cmocka_unit_test(rows_of_bands_are_the_rows_of_the_whole),
        cmocka_unit_test(what_a_sink_refuses_ends_the_bake_as_it_says),
        cmocka_unit_test(steps_come_in_their_order),
        cmocka_unit_test(what_cannot_be_is_refused_before_a_file_is_read),
        cmocka_unit_test(lightmaps_of_objects_have_their_names),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
