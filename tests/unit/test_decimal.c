/* Numbers of points' text against the C library's: the same bits in, the same bits back. */
#include "base/decimal.h"
#include "testing.h"

static uint64_t counter;

static uint64_t draw(void) {
    uint64_t z = (counter += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static void expect_as_strtod(const char *text) {
    double value = -1.0;
    if (!vshi_decimal_read(text, text + strlen(text), &value)) {
        fail_msg("'%s' is not read", text);
    }
    const double expected = strtod(text, NULL);
    if (memcmp(&value, &expected, sizeof value) != 0) {
        fail_msg("'%s' is %.17g, expected %.17g", text, value, expected);
    }
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
        const uint64_t bits = draw();
        switch (i % 4) {
        case 0: { /* of any magnitude */
            double value;
            memcpy(&value, &bits, sizeof value);
            snprintf(text, sizeof text, "%.*g", (int)(draw() % 21), isfinite(value) ? value : 1.0);
            break;
        }
        case 1: /* as programs write coordinates */
            snprintf(text, sizeof text, "%.17g", ((double)(bits >> 11) * 0x1p-53 - 0.5) * 200.0);
            break;
        case 2:
            snprintf(text, sizeof text, "%lu.%lu", (unsigned long)(bits >> 40),
                     (unsigned long)(draw() >> 20));
            break;
        default: { /* next to the middle between two doubles */
            const double low = 1.0 + (double)(bits >> 12) * 0x1p-52;
            snprintf(text, sizeof text, "%.19Lg",
                     (long double)low + 0x1p-53L + (long double)(i % 3 - 1) * 0x1p-60L);
            break;
        }
        }
        expect_as_strtod(text);
    }
}

TEST(what_is_no_decimal_number_is_refused) {
    static const char *const texts[] = {"",     "-",   "+",     ".",       "e5",   "1e", "1e+",
                                        "0x10", "1,5", "1 2",   "1.2.3",   "abc",  "1f", "nanx",
                                        "in",   "--1", "1e5.0", "infinit", "1_000"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i) {
        double value;
        if (vshi_decimal_read(texts[i], texts[i] + strlen(texts[i]), &value)) {
            fail_msg("'%s' is read as %g", texts[i], value);
        }
    }
    const char *text = "nAn";
    double value;
    assert_true(vshi_decimal_read(text, text + 3, &value) && isnan(value));
    const char *low = "-Infinity";
    assert_true(vshi_decimal_read(low, low + 9, &value) && isinf(value) && value < 0.0);
}

TEST(only_the_given_characters_are_read) {
    const char *text = "12.5678";
    double value;
    assert_true(vshi_decimal_read(text, text + 4, &value));
    assert_true(value == 12.5);
}

TEST(floats_come_back_with_the_same_bits) {
    for (int i = 0; i < 600000; ++i) {
        uint32_t bits = (uint32_t)draw();
        if (i % 2 != 0) { /* visibilities */
            const float value = (float)((double)(draw() >> 40) * 0x1p-24);
            memcpy(&bits, &value, sizeof bits);
        }
        float value;
        memcpy(&value, &bits, sizeof value);
        char text[VSHI_DECIMAL_ROOM + 1];
        *vshi_decimal_write_float(text, value) = '\0';
        const float back = strtof(text, NULL);
        double wide;
        assert_true(vshi_decimal_read(text, text + strlen(text), &wide));
        if (isnan(value) ? !isnan(back) : memcmp(&back, &value, 4) != 0 || (float)wide != value) {
            fail_msg("%.9g is written '%s'", (double)value, text);
        }
        assert_true(strlen(text) < 18);
    }
    static const struct {
        float value;
        const char *text;
    } cases[] = {{0.1f, "0.1"}, {1.0f, "1"},         {-0.5f, "-0.5"},
                 {0.0f, "0"},   {100.0f, "100"},     {0.001f, "0.001"},
                 {-0.0f, "-0"}, {1e8f, "100000000"}, {0.97918636f, "0.97918636"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        char text[VSHI_DECIMAL_ROOM + 1];
        *vshi_decimal_write_float(text, cases[i].value) = '\0';
        assert_string_equal(text, cases[i].text);
    }
}

TEST(doubles_come_back_with_the_same_bits) {
    for (int i = 0; i < 200000; ++i) {
        const uint64_t bits = draw();
        double value;
        memcpy(&value, &bits, sizeof value);
        if (i % 2 != 0) { /* coordinates, of doubles and of floats, and what lies next to powers of two */
            value = ((double)(bits >> 11) * 0x1p-53 - 0.5) * 200.0;
            value = i % 4 == 1 ? (double)(float)value : value;
            value =
                i % 8 == 3 ? ldexp(1.0 - 0x1p-53 * (double)(bits & 3), (int)(bits >> 20 & 63) - 18) : value;
        }
        char text[VSHI_DECIMAL_ROOM + 1];
        *vshi_decimal_write_double(text, value) = '\0';
        const double back = strtod(text, NULL);
        if (isnan(value) ? !isnan(back) : memcmp(&back, &value, sizeof back) != 0) {
            fail_msg("%.17g is written '%s'", value, text);
        }
    }
}

static void expect_as_strtof(const char *number) {
    char text[128];
    float value = -1.0F;
    snprintf(text, sizeof text, "%s /        ", number);
    const char *end = vshi_decimal_float(text, &value);
    const float expected = strtof(text, NULL);
    if (end != text + strlen(number) || memcmp(&value, &expected, sizeof value) != 0) {
        fail_msg("'%s' is %.9g, expected %.9g", number, (double)value, (double)expected);
    }
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
    for (size_t i = 0; i < sizeof none / sizeof none[0]; ++i) {
        char text[32];
        snprintf(text, sizeof text, "%s /        ", none[i]);
        assert_null(vshi_decimal_float(text, &value));
    }
}
