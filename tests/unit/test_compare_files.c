/* Files compared: what tolerances say is put over the defaults, what they must not say is refused, and what
 * two images come to. */

#include "testing.h"
static char path[64];

static int make_file(void **state) {
    strcpy(path, "tolerances-XXXXXX");
    const int file = mkstemp(path);
    return file < 0 || close(file) != 0;
}

static int remove_file(void **state) {
    return unlink(path);
}

static vsh_result read_text(const char *text, vsh_tolerances **tolerances, vsh_error *error) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
    return vsh_tolerances_read(path, tolerances, error);
}

static vsh_limits limits_of(const char *text, const char *channel, double *coverage) {
    OWNED(vsh_tolerances) *tolerances = NULL;
    assert_ok(read_text(text, &tolerances, &failure));
    vsh_limits limits = vsh_limits_default();
    vsh_tolerances_apply(tolerances, channel, &limits, coverage);
    return limits;
}

TEST(what_a_file_does_not_say_stays) {
    const vsh_limits defaults = vsh_limits_default(), limits = limits_of("{}", "ao", NULL);
    assert_memory_equal(&limits, &defaults, sizeof limits);
    vsh_limits same = defaults;
    vsh_tolerances_apply(NULL, "ao", &same, NULL);
    assert_memory_equal(&same, &defaults, sizeof same);
}

TEST(every_measure_but_one_has_a_key_of_its_name) {
    const vsh_limits defaults = vsh_limits_default();
    for (int i = 1; i < VSH_MEASURE_COUNT; ++i) {
        char text[64];
        snprintf(text, sizeof text, "{\"%s\": 0.625}", vsh_get_name(VSH_NAMES_MEASURE, i));
        vsh_limits expected = defaults;
        expected.value[i] = 0.625;
        const vsh_limits limits = limits_of(text, "shadow.sun", NULL);
        assert_memory_equal(&limits, &expected, sizeof limits);
    }
    const vsh_limits off = limits_of("{\"max\": 1e15}", "ao", NULL);
    assert_true(isinf(off.value[VSH_MEASURE_MAX]));
}

TEST(channels_come_over_the_rest_in_their_order) {
    static const char text[] = "{\"rmse\": 0.5, \"coverage\": 0.25, \"step\": 0.125, \"channels\": {"
                               "\"shadow.*\": {\"rmse\": 0.25, \"reach\": 4},"
                               "\"shadow.sun\": {\"rmse\": 0.0625, \"step\": 0.5}, \"*\": {\"max\": 0.5}}}";
    double coverage = -1.0;
    const vsh_limits sun = limits_of(text, "shadow.sun", &coverage),
                     lamp = limits_of(text, "shadow.lamp", NULL);
    const vsh_limits ao = limits_of(text, "ao", NULL), sunny = limits_of(text, "shadow.sunny", NULL);
    assert_true(coverage == 0.25);
    assert_true(sun.value[VSH_MEASURE_RMSE] == 0.0625 && sun.options.step == 0.5 && sun.options.reach == 4);
    assert_true(lamp.value[VSH_MEASURE_RMSE] == 0.25 && lamp.options.step == 0.125 &&
                lamp.options.reach == 4);
    assert_true(sunny.value[VSH_MEASURE_RMSE] == 0.25 && sunny.options.step == 0.125);
    assert_true(ao.value[VSH_MEASURE_RMSE] == 0.5 && ao.options.reach == 2 && ao.options.step == 0.125);
    assert_true(ao.value[VSH_MEASURE_MAX] == 0.5 && sun.value[VSH_MEASURE_MAX] == 0.5);
}

TEST(bad_files_are_refused_with_the_place) {
    static const struct {
        const char *text, *words[2];
    } cases[] = {
        {"{\"rms\": 1}", {"1:2: rms: unknown key", "\"rmse\""}},
        {"{\"nonfinite\": 1}", {"nonfinite: unknown key", ""}},
        {"{\"rmse\": -1}", {"1:10: rmse: -1 is out of range", "0 … "}},
        {"{\"rmse\": \"0\"}", {"expected a number", "a string"}},
        {"{\"ssim\": 0.5}", {"1:2: ssim: unknown key", ""}},
        {"{\"step\": 0}", {"step: 0 is out of range", "(excluded)"}},
        {"{\"reach\": 1.5}", {"reach: 1.5", "whole"}},
        {"{\"channels\": []}", {"channels: expected an object", "an array"}},
        {"{\"channels\": {\"ao\": {\"max\": 1, \"coverage\": 1}}}",
         {"channels.ao.coverage: is no key of a channel's tolerances", ""}},
        {"{\"rmse\": 1,}", {"1:", ""}},
        {"", {"1:", ""}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        vsh_tolerances *tolerances = NULL;
        assert_int_equal(read_text(cases[i].text, &tolerances, &failure), VSH_ERROR_INPUT);
        assert_null(tolerances);
        for (int k = 0; k < 2; ++k) {
            if (strstr(failure.message, cases[i].words[k]) == NULL) {
                fail_msg("'%s' is not in '%s'", cases[i].words[k], failure.message);
            }
        }
    }
    vsh_tolerances *tolerances = NULL;
    assert_int_equal(vsh_tolerances_read("no/such/file.json", &tolerances, NULL), VSH_ERROR_READ);
}

/* --- whole files */

enum { SIDE = 16, COUNT = SIDE * SIDE };

/* An image beside the tolerance file: `ao` of a slope, with one texel `spot` off; and A, where it is named.
 */
static void write_image(const char *image, int32_t width, float spot, int32_t channels) {
    float ao[COUNT], covered[COUNT];
    for (size_t i = 0; i < COUNT; ++i) {
        ao[i] = (float)(i % SIDE) / SIDE + (i == COUNT / 2 ? spot : 0.0f);
        covered[i] = 1.0f;
    }
    const char *const names[] = {"ao", "A"};
    const float *const planes[] = {ao, covered};
    const vsh_image view = {width, COUNT / width, channels, names, planes, NULL};
    assert_ok(vsh_image_write(image, &view, NULL, &failure));
}

static int32_t seen;

static int32_t look(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared) {
    assert_string_equal(channel->name, "ao");
    assert_int_equal(index, 1);
    assert_int_equal(compared->size[0], SIDE);
    ++seen;
    return user != NULL;
}

TEST(two_files_are_compared_channel_by_channel) {
    char golden[80], fresh[80];
    snprintf(golden, sizeof golden, "%s.golden.exr", path);
    snprintf(fresh, sizeof fresh, "%s.new.exr", path);
    vsh_compare_files_options options = vsh_compare_files_options_default();
    vsh_comparison *c = NULL;
    write_image(golden, SIDE, 0.0f, 2);
    write_image(fresh, SIDE, 0.0f, 2);
    assert_ok(vsh_compare_files(golden, fresh, NULL, NULL, &c, &failure));
    assert_int_equal(vsh_comparison_alike(c), 1);
    assert_null(vsh_comparison_problem(c, 0));
    assert_int_equal(vsh_comparison_channel(c, 0)->is_coverage, 1);
    assert_string_equal(vsh_comparison_channel(c, 1)->name, "ao");
    assert_int_equal(vsh_comparison_channel(c, 1)->measures.count, COUNT);
    assert_null(vsh_comparison_channel(c, 2));
    vsh_comparison_free(c);

    write_image(fresh, SIDE, 0.4f, 2);
    options.look = look;
    assert_ok(vsh_compare_files(golden, fresh, &options, NULL, &c, &failure));
    assert_int_equal(seen, 1);
    assert_int_equal(vsh_comparison_alike(c), 0);
    const vsh_channel_comparison *ao = vsh_comparison_channel(c, 1);
    assert_true(ao->failed >> VSH_MEASURE_MAX & 1);
    assert_int_equal(ao->measures.worst, COUNT / 2);
    vsh_comparison_free(c);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        options.limits[i] = 1e9;
    }
    assert_ok(vsh_compare_files(golden, fresh, &options, NULL, &c, &failure));
    assert_int_equal(vsh_comparison_alike(c), 1);
    vsh_comparison_free(c);
    options.user = &options;
    assert_int_equal(vsh_compare_files(golden, fresh, &options, NULL, &c, &failure), VSH_ERROR_CANCELLED);
    assert_null(c);

    write_image(fresh, 2 * SIDE, 0.0f, 1);
    assert_ok(vsh_compare_files(golden, fresh, NULL, NULL, &c, &failure));
    assert_int_equal(vsh_comparison_alike(c), 0);
    assert_string_equal(vsh_comparison_problem(c, 0), "channel 'A': in golden alone");
    assert_string_equal(vsh_comparison_problem(c, 1), "size: golden is 16 × 16, new is 32 × 8");
    assert_null(vsh_comparison_channel(c, 0));
    vsh_comparison_free(c);

    assert_int_equal(unlink(fresh), 0);
    assert_int_equal(vsh_compare_files(golden, fresh, NULL, NULL, &c, &failure), VSH_ERROR_READ);
    assert_int_equal(unlink(golden), 0);
}

FIXTURE(make_file, remove_file)
