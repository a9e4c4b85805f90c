/* Files of tolerances: what they say is put over the defaults, and what they must not say is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <vdbshade/compare.h>

#include <math.h>
#include <unistd.h>

static char path[64];

static int make_file(void **state) {
    (void)state;
    strcpy(path, "tolerances-XXXXXX");
    const int file = mkstemp(path);
    return file < 0 || close(file) != 0;
}

static int remove_file(void **state) {
    (void)state;
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
    vsh_tolerances *tolerances = NULL;
    vsh_error error = {VSH_OK, ""};
    if (read_text(text, &tolerances, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_limits limits = vsh_limits_default();
    vsh_tolerances_apply(tolerances, channel, &limits, coverage);
    vsh_tolerances_free(tolerances);
    return limits;
}

static void what_a_file_does_not_say_stays(void **unused) {
    (void)unused;
    const vsh_limits defaults = vsh_limits_default(), limits = limits_of("{}", "ao", NULL);
    assert_memory_equal(&limits, &defaults, sizeof limits);
    vsh_limits same = defaults;
    vsh_tolerances_apply(NULL, "ao", &same, NULL);
    assert_memory_equal(&same, &defaults, sizeof same);
}

static void every_measure_but_one_has_a_key_of_its_name(void **unused) {
    (void)unused;
    const vsh_limits defaults = vsh_limits_default();
    for (int i = 1; i < VSH_MEASURE_COUNT; ++i) {
        char text[64];
        snprintf(text, sizeof text, "{\"%s\": 0.625}", vsh_measure_name(i));
        vsh_limits expected = defaults;
        expected.value[i] = 0.625;
        const vsh_limits limits = limits_of(text, "shadow.sun", NULL);
        assert_memory_equal(&limits, &expected, sizeof limits);
    }
    const vsh_limits off = limits_of("{\"max\": 1e15}", "ao", NULL);
    assert_true(isinf(off.value[VSH_MEASURE_MAX]));
}

static void channels_come_over_the_rest_in_their_order(void **unused) {
    (void)unused;
    static const char text[] = "{\"rmse\": 0.5, \"coverage\": 0.25, \"threshold\": 0.125, \"channels\": {"
                               "\"shadow.*\": {\"rmse\": 0.25, \"reach\": 4},"
                               "\"shadow.sun\": {\"rmse\": 0.0625, \"step\": 0.5}, \"*\": {\"ssim\": 0.5}}}";
    double coverage = -1.0;
    const vsh_limits sun = limits_of(text, "shadow.sun", &coverage),
                     lamp = limits_of(text, "shadow.lamp", NULL);
    const vsh_limits ao = limits_of(text, "ao", NULL), sunny = limits_of(text, "shadow.sunny", NULL);
    assert_true(coverage == 0.25);
    assert_true(sun.value[VSH_MEASURE_RMSE] == 0.0625 && sun.options.step == 0.5 && sun.options.reach == 4);
    assert_true(lamp.value[VSH_MEASURE_RMSE] == 0.25 && lamp.options.step == 0.1 && lamp.options.reach == 4);
    assert_true(sunny.value[VSH_MEASURE_RMSE] == 0.25 && sunny.options.step == 0.1);
    assert_true(ao.value[VSH_MEASURE_RMSE] == 0.5 && ao.options.reach == 2 && ao.options.threshold == 0.125);
    assert_true(ao.value[VSH_MEASURE_SSIM] == 0.5 && sun.value[VSH_MEASURE_SSIM] == 0.5);
}

static void bad_files_are_refused_with_the_place(void **unused) {
    (void)unused;
    static const struct {
        const char *text, *words[2];
    } cases[] = {
        {"{\"rms\": 1}", {"1:2: rms: unknown key", "\"rmse\""}},
        {"{\"nonfinite\": 1}", {"nonfinite: unknown key", ""}},
        {"{\"rmse\": -1}", {"1:10: rmse: -1 is out of range", "0 … "}},
        {"{\"rmse\": \"0\"}", {"expected a number", "a string"}},
        {"{\"ssim\": 1.5}", {"ssim: 1.5 is out of range", "-1 … 1"}},
        {"{\"step\": 0}", {"step: 0 is out of range", "(excluded)"}},
        {"{\"reach\": 1.5}", {"reach: 1.5", "whole"}},
        {"{\"channels\": []}", {"channels: expected an object", "an array"}},
        {"{\"channels\": {\"ao\": {\"max\": 1, \"coverage\": 1}}}",
         {"channels.ao.coverage: unknown key", ""}},
        {"{\"rmse\": 1,}", {"1:", ""}},
        {"", {"1:", ""}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        vsh_tolerances *tolerances = NULL;
        vsh_error error = {VSH_OK, ""};
        assert_int_equal(read_text(cases[i].text, &tolerances, &error), VSH_ERROR_INPUT);
        assert_null(tolerances);
        for (int k = 0; k < 2; ++k) {
            if (strstr(error.message, cases[i].words[k]) == NULL) {
                fail_msg("'%s' is not in '%s'", cases[i].words[k], error.message);
            }
        }
    }
    vsh_tolerances *tolerances = NULL;
    assert_int_equal(vsh_tolerances_read("no/such/file.json", &tolerances, NULL), VSH_ERROR_READ);
    assert_int_equal(vsh_tolerances_read(NULL, &tolerances, NULL), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_tolerances_read(path, NULL, NULL), VSH_ERROR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_a_file_does_not_say_stays),
        cmocka_unit_test(every_measure_but_one_has_a_key_of_its_name),
        cmocka_unit_test(channels_come_over_the_rest_in_their_order),
        cmocka_unit_test(bad_files_are_refused_with_the_place),
    };
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
