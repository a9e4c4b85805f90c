/* The lowest layer: arrays that lie in files, the error of elements that fail in parallel, and numbers as
 * text, which are compared with those of the C library. */
#include "base/decimal.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "handles.h"
#include "testing.h"

enum { MEBIBYTE = 1 << 20 };

/* Takes so many bytes, and returns how many of them are in memory. */
static uint64_t hold(vsh_run *run, const char *folder, size_t bytes) {
    FREED char *copy = folder != NULL ? strdup(folder) : NULL;
    vshi_store store = {.run = run, .folder = copy};
    unsigned char *memory = NULL;
    assert_ok(vshi_store_take(&store, (void **)&memory, bytes, 1, "planes", &failure));
    assert_int_equal(memory[0] + memory[bytes - 1], 0);
    memory[bytes - 1] = 1;
    const uint64_t held = store.held;
    vshi_store_close(&store);
    return held;
}

TEST(planes_leave_an_eighth_of_the_limit_if_they_can_lie_in_a_file) {
    vsh_run run = run_within(8 * MEBIBYTE);
    assert_int_equal(hold(&run, ".", 7 * MEBIBYTE), 7 * MEBIBYTE);
    assert_int_equal(hold(&run, ".", 7 * MEBIBYTE + 4096), 0);
    assert_int_equal(hold(&run, NULL, 8 * MEBIBYTE), 8 * MEBIBYTE);
}

enum { ELEMENTS = 64, FIRST_FAILURE = 17 };

static vsh_result fail_late(void *user, size_t index, vsh_error *error) {
    return index < FIRST_FAILURE ? VSH_OK : vshi_fail(error, VSH_ERROR_INPUT, "element %zu", index);
}

TEST(the_error_is_that_of_the_lowest_element_that_failed) {
    for (int32_t threads = 1; threads <= 8; threads *= 2) {
        vsh_run run = run_on(threads);
        vshi_job *job = vshi_job_begin(&run, "elements", ELEMENTS);
        assert_non_null(job);
        assert_fails(vshi_parallel_each(job, ELEMENTS, 1, 1, fail_late, NULL, &failure), VSH_ERROR_INPUT,
                     "element 17");
        vshi_job_end(job);
    }
}

/* --- numbers as text */

static uint64_t counter;

static uint64_t draw(void) {
    uint64_t z = (counter += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

/* Returns, by turns, a double of random bits, a coordinate as a double or a float, and a neighbour of a power
 * of two. */
static double any_double(int i) {
    const uint64_t bits = draw();
    const double coordinate = ((double)(bits >> 11) * 0x1p-53 - 0.5) * 200.0;
    double value;
    memcpy(&value, &bits, sizeof value);
    return i % 2 == 0   ? value
           : i % 4 == 1 ? (double)(float)coordinate
           : i % 8 == 3 ? ldexp(1.0 - 0x1p-53 * (double)(bits & 3), (int)(bits >> 20 & 63) - 18)
                        : coordinate;
}

static void expect_as_strtod(const char *text) {
    double value = -1.0;
    assert_that(vshi_decimal_read(text, text + strlen(text), &value), "'%s' is not read", text);
    const double expected = strtod(text, NULL);
    assert_that(memcmp(&value, &expected, sizeof value) == 0, "'%s' is %.17g, expected %.17g", text, value,
                expected);
}

/* Expects each word of a text, which spaces separate. */
static void expect_words(const char *words, void (*expect)(const char *word)) {
    char word[64];
    for (int size; sscanf(words, "%63s%n", word, &size) == 1; words += size) {
        expect(word);
    }
}

TEST(numbers_are_read_as_strtod_reads_them) {
    expect_words("0 -0 +1 1. .5 -.5e1 1e5 1E+5 1e-5 00012.500 0.1 9007199254740993 "
                 "9007199254740992.5 9007199254740993e3 123456789012345678901234567890 "
                 "18446744073709551615 9999999999999999999 0.00000000000000000000000000001 "
                 "1e-400 1e400 4.9e-324 1e22 1e23 2.2250738585072011e-308 8.41e21 0e99999 "
                 "3.518437208883201171875e13 "
                 "1.00000000000000011102230246251565404236316680908203125 "
                 "179769313486231580793e289 "
                 "0.000000000000000000000000000000000000000000000000001e51",
                 expect_as_strtod);
    for (int i = 0; i < 300000; ++i) {
        char text[64];
        const double value = any_double(i);
        /* of any length; or next to the middle between two doubles */
        const long double middle = 1.0L + (long double)(draw() >> 12) * 0x1p-52L + 0x1p-53L;
        if (i % 2 == 0) {
            snprintf(text, sizeof text, "%.*g", (int)(draw() % 21), isfinite(value) ? value : 1.0);
        } else {
            snprintf(text, sizeof text, "%.19Lg", middle + (long double)(i % 3 - 1) * 0x1p-60L);
        }
        expect_as_strtod(text);
    }
}

TEST(texts_that_are_no_decimal_numbers_are_refused) {
    static const char *const texts[] = {"",     "-",   "+",     ".",       "e5",   "1e", "1e+",
                                        "0x10", "1,5", "1 2",   "1.2.3",   "abc",  "1f", "nanx",
                                        "in",   "--1", "1e5.0", "infinit", "1_000"};
    for (size_t i = 0; i < COUNT_OF(texts); ++i) {
        double value;
        assert_that(!vshi_decimal_read(texts[i], texts[i] + strlen(texts[i]), &value), "'%s' is read as %g",
                    texts[i], value);
    }
    static const char not_finite[] = "nAn-Infinity",
                      longer[] = "12.5678"; /* only the given characters are read */
    double value;
    assert_true(vshi_decimal_read(not_finite, not_finite + 3, &value) && isnan(value));
    assert_true(vshi_decimal_read(not_finite + 3, not_finite + 12, &value) && isinf(value) && value < 0.0);
    assert_true(vshi_decimal_read(longer, longer + 4, &value) && value == 12.5);
}

TEST(floats_and_doubles_come_back_with_the_same_bits) {
    for (int i = 0; i < 600000; ++i) {
        const double value = any_double(i), visible = (double)(draw() >> 40) * 0x1p-24;
        const uint32_t word = (uint32_t)draw();
        float single;
        memcpy(&single, &word, sizeof single);
        single = i % 3 == 0 ? (float)visible : single;
        char text[VSHI_DECIMAL_ROOM + 1];
        *vshi_decimal_write_double(text, value) = '\0';
        const double back = strtod(text, NULL);
        assert_that(isnan(value) ? isnan(back) : memcmp(&back, &value, sizeof back) == 0,
                    "%.17g is written '%s'", value, text);
        *vshi_decimal_write_float(text, single) = '\0';
        const float again = strtof(text, NULL);
        double wide;
        assert_true(vshi_decimal_read(text, text + strlen(text), &wide) && strlen(text) < 18);
        assert_that(isnan(single) ? isnan(again)
                                  : memcmp(&again, &single, sizeof again) == 0 && (float)wide == single,
                    "%.9g is written '%s'", (double)single, text);
    }
    static const struct {
        float value;
        const char *text;
    } cases[] = {{0.1f, "0.1"}, {1.0f, "1"},         {-0.5f, "-0.5"},
                 {0.0f, "0"},   {100.0f, "100"},     {0.001f, "0.001"},
                 {-0.0f, "-0"}, {1e8f, "100000000"}, {0.97918636f, "0.97918636"}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        char text[VSHI_DECIMAL_ROOM + 1];
        *vshi_decimal_write_float(text, cases[i].value) = '\0';
        assert_string_equal(text, cases[i].text);
    }
}

static void expect_as_strtof(const char *number) {
    char text[128];
    float value = -1.0F;
    snprintf(text, sizeof text, "%s /        ", number);
    const char *end = vshi_decimal_float(text, &value);
    const float expected = strtof(text, NULL);
    assert_that(end == text + strlen(number) && memcmp(&value, &expected, sizeof value) == 0,
                "'%s' is %.9g, expected %.9g", number, (double)value, (double)expected);
}

/* Short and long, also in the middle between two floats and next to it, subnormal and too large. */
TEST(floats_are_read_as_strtof_reads_them) {
    expect_words("0 -0 1. -.5 +1e5 1e-46 1e-45 7.006492321624085e-46 3.4028235e38 "
                 "3.4028235677973366e38 3.5e38 1e999999999999 16777217 "
                 "16777217.000000000000000000001 16777219 1.1754943e-38 0.1e22 "
                 "123456789012345678901234567890",
                 expect_as_strtof);
    counter = 2;
    for (int i = 0; i < 300000; ++i) {
        char text[64];
        const uint64_t bits = draw();
        const uint32_t word = (uint32_t)bits & 0x7f7fffff, above = word + 1;
        float low, high;
        memcpy(&low, &word, sizeof low);
        memcpy(&high, &above, sizeof high);
        if (i % 3 == 0) {
            snprintf(text, sizeof text, "%.*g", 6 + (int)(bits >> 40 & 3), (double)low);
        } else if (i % 3 == 1 && isfinite(high)) {
            snprintf(text, sizeof text, "%.*g", 16 + (int)(bits >> 40 & 15),
                     ((double)low + (double)high) / 2.0);
        } else {
            snprintf(text, sizeof text, "%.*f", (int)(bits & 15), (double)(int32_t)(bits >> 32) / 1e6);
        }
        expect_as_strtof(text);
    }
    float value;
    static const char *const none[] = {"", "-", ".", "e5", "1e", "1e+", "-.e1", "nan", "x"};
    for (size_t i = 0; i < COUNT_OF(none); ++i) {
        char text[32];
        snprintf(text, sizeof text, "%s /        ", none[i]);
        assert_null(vshi_decimal_float(text, &value));
    }
}
