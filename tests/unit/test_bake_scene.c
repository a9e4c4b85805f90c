/* A scene's lightmaps, from its files to its rows, by one call and by steps. */
#include "floor_under_ball.h"

/* Rows come 64 at a time. */
enum { SIZE = 384, LIMIT = 4 << 20 };

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

static vsh_result bake_into(const case_scene *c, const char *scratch, const vsh_run *run, taken *t,
                            vsh_error *error) {
    const vsh_row_sink sink = sink_of(t);
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.sink = &sink;
    options.scratch = scratch;
    return vsh_bake_scene(&c->scene, &options, run, NULL, error);
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
    assert_int_equal(report.error_count, 0);
    assert_true(report.occluders.active_voxels > 0 && report.shade.marches > 0);
    taken t = {.fail_at = 0};
    assert_ok(bake_into(&c, NULL, NULL, &t, &error), &error);
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

/* The ball stands in the floor, so that some texels are invalid, over several tiles. */
static void threads_and_memory_limits_change_no_bit(void **state) {
    (void)state;
    static const struct {
        int32_t method, ao_method, supersample;
    } cases[] = {{VSH_SHADOW_CONE, VSH_AO_CONES, 1},
                 {VSH_SHADOW_IMPROVED, VSH_AO_TAPS, 2},
                 {VSH_SHADOW_ADAPTIVE, VSH_AO_ADAPTIVE, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        case_scene c;
        fill(&c, SIZE, 0.4);
        c.receiver.supersample = cases[i].supersample;
        c.receiver.ao_spacing = 4;
        c.scene.shade.method = cases[i].method;
        c.scene.shade.ao_method = cases[i].ao_method;
        c.scene.shade.rays = 32;
        vsh_error error;
        vsh_run run = vsh_run_default();
        taken one = {.fail_at = 0}, more = {.fail_at = 0}, limited = {.fail_at = 0}, none = {.fail_at = 0};
        run.threads = 1;
        assert_ok(bake_into(&c, NULL, &run, &one, &error), &error);
        run.threads = 4;
        assert_ok(bake_into(&c, NULL, &run, &more, &error), &error);
        run.threads = 2;
        run.memory_limit = LIMIT;
        assert_ok(bake_into(&c, at("."), &run, &limited, &error), &error);
        const size_t bytes = (size_t)one.channels * SIZE * SIZE * sizeof(float);
        assert_memory_equal(one.values, more.values, bytes);
        assert_memory_equal(one.values, limited.values, bytes);
        /* the folder is needed */
        assert_int_equal(bake_into(&c, at("missing"), &run, &none, &error), VSH_ERROR_WRITE);
        free(one.values);
        free(more.values);
        free(limited.values);
    }
}

static void what_a_sink_refuses_ends_the_bake_as_it_says(void **state) {
    (void)state;
    case_scene c;
    fill(&c, SIZE, 1.0);
    vsh_error error;
    taken t = {.fail_at = 2};
    assert_int_equal(bake_into(&c, NULL, NULL, &t, &error), VSH_ERROR_WRITE);
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
        cmocka_unit_test(threads_and_memory_limits_change_no_bit),
        cmocka_unit_test(what_a_sink_refuses_ends_the_bake_as_it_says),
        cmocka_unit_test(steps_come_in_their_order),
        cmocka_unit_test(what_cannot_be_is_refused_before_a_file_is_read),
        cmocka_unit_test(lightmaps_of_objects_have_their_names),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
