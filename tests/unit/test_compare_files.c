/* Files compared: tolerances change the default limits, bad tolerance files are refused, and two images are
 * compared channel by channel. */
#include "folder.h"

static vsh_result read_tolerances(const char *text, vshi_tolerances **tolerances) {
    write_string(at("tolerances.json"), text);
    return vshi_tolerances_read(at("tolerances.json"), tolerances, &failure);
}

static vsh_limits limits_of(const char *text, const char *channel, double *coverage) {
    OWNED(vshi_tolerances) *tolerances = NULL;
    assert_ok(read_tolerances(text, &tolerances));
    vsh_limits limits = vshi_limits_default();
    vshi_tolerances_apply(tolerances, channel, &limits, coverage);
    return limits;
}

TEST(limits_that_a_file_lacks_keep_their_defaults) {
    const vsh_limits defaults = vshi_limits_default(), limits = limits_of("{}", "ao", NULL);
    assert_memory_equal(&limits, &defaults, sizeof limits);
    vsh_limits same = defaults;
    vshi_tolerances_apply(NULL, "ao", &same, NULL);
    assert_memory_equal(&same, &defaults, sizeof same);
}

TEST(every_measure_but_one_has_a_key_of_its_name) {
    for (int i = 1; i < VSH_MEASURE_COUNT; ++i) {
        char text[64];
        snprintf(text, sizeof text, "{\"%s\": 0.625}", vsh_get_name(VSH_NAMES_MEASURE, i));
        vsh_limits expected = vshi_limits_default();
        expected.value[i] = 0.625;
        const vsh_limits limits = limits_of(text, "shadow.sun", NULL);
        assert_memory_equal(&limits, &expected, sizeof limits);
    }
    const vsh_limits off = limits_of("{\"max\": 1e15}", "ao", NULL);
    assert_true(isinf(off.value[VSH_MEASURE_MAX]));
}

TEST(channels_replace_general_limits_in_their_order) {
    static const char text[] = "{\"rmse\": 0.5, \"coverage\": 0.25, \"step\": 0.125, \"channels\": {"
                               "\"shadow.*\": {\"rmse\": 0.25, \"reach\": 4},"
                               "\"shadow.sun\": {\"rmse\": 0.0625, \"step\": 0.5}, \"*\": {\"max\": 0.5}}}";
    static const struct {
        const char *channel;
        double rmse, step;
        int32_t reach;
    } cases[] = {{"shadow.sun", 0.0625, 0.5, 4},
                 {"shadow.lamp", 0.25, 0.125, 4},
                 {"shadow.sunny", 0.25, 0.125, 4},
                 {"ao", 0.5, 0.125, 2}};
    for (size_t i = 0; i < 4; ++i) {
        double coverage = -1.0;
        const vsh_limits limits = limits_of(text, cases[i].channel, &coverage);
        assert_true(limits.value[VSH_MEASURE_RMSE] == cases[i].rmse && limits.options.step == cases[i].step);
        assert_true(limits.options.reach == cases[i].reach && limits.value[VSH_MEASURE_MAX] == 0.5);
        assert_true(coverage == 0.25);
    }
}

TEST(bad_files_are_refused_with_the_place) {
    static const struct {
        const char *text, *words[2];
    } cases[] = {
        {"{\"rms\": 1}", {"1:2: rms: unknown key", "\"rmse\""}},
        {"{\"nonfinite\": 1}", {"nonfinite: unknown key", ""}},
        {"{\"step\": 0}", {"step: 0 is out of range", "(excluded)"}},
        {"{\"channels\": {\"ao\": {\"max\": 1, \"coverage\": 1}}}",
         {"channels.ao.coverage: is no key of a channel's tolerances", ""}},
    };
    vshi_tolerances *tolerances = NULL;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        for (int k = 0; k < 2; ++k) {
            assert_fails(read_tolerances(cases[i].text, &tolerances), VSH_ERROR_INPUT, cases[i].words[k]);
            assert_null(tolerances);
        }
    }
    assert_fails(vshi_tolerances_read("no/such/file.json", &tolerances, &failure), VSH_ERROR_READ, "");
}

/* --- whole files */

enum { SIDE = 16, COUNT = SIDE * SIDE };

/* An image: `ao` of a slope, with one texel `spot` off; and A, if there are two channels. */
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

static vsh_comparison *compare(const vsh_compare_files_options *options, bool alike) {
    vsh_comparison *c = NULL;
    assert_ok(vsh_compare_files(at("golden.exr"), at("new.exr"), options, NULL, &c, &failure));
    assert_int_equal(vsh_comparison_alike(c), alike);
    return c;
}

TEST(two_files_are_compared_channel_by_channel) {
    write_image(at("golden.exr"), SIDE, 0.0f, 2);
    write_image(at("new.exr"), SIDE, 0.0f, 2);
    OWNED(vsh_comparison) *same = compare(NULL, true);
    assert_null(vsh_comparison_problem(same, 0));
    assert_int_equal(vsh_comparison_channel(same, 0)->is_coverage, 1);
    assert_string_equal(vsh_comparison_channel(same, 1)->name, "ao");
    assert_int_equal(vsh_comparison_channel(same, 1)->measures.count, COUNT);
    assert_null(vsh_comparison_channel(same, 2));

    vsh_compare_files_options options = vsh_compare_files_options_default();
    write_image(at("new.exr"), SIDE, 0.4f, 2);
    options.look = look;
    OWNED(vsh_comparison) *spot = compare(&options, false);
    assert_int_equal(seen, 1);
    assert_true(vsh_comparison_channel(spot, 1)->failed >> VSH_MEASURE_MAX & 1);
    assert_int_equal(vsh_comparison_channel(spot, 1)->measures.worst, COUNT / 2);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        options.limits[i] = 1e9;
    }
    OWNED(vsh_comparison) *wide = compare(&options, true), *none = NULL;
    options.user = &options;
    assert_fails(vsh_compare_files(at("golden.exr"), at("new.exr"), &options, NULL, &none, &failure),
                 VSH_ERROR_CANCELLED, "");
    assert_null(none);

    write_image(at("new.exr"), 2 * SIDE, 0.0f, 1);
    OWNED(vsh_comparison) *other = compare(NULL, false);
    assert_string_equal(vsh_comparison_problem(other, 0), "channel 'A': in golden alone");
    assert_string_equal(vsh_comparison_problem(other, 1), "size: golden is 16 × 16, new is 32 × 8");
    assert_null(vsh_comparison_channel(other, 0));
    assert_fails(vsh_compare_files(at("golden.exr"), at("missing.exr"), NULL, NULL, &none, &failure),
                 VSH_ERROR_READ, "");
}

FIXTURE(make_folder, remove_folder)
