/* Reading: up to 19 digits are a whole number below 2^64; over or times a power of ten that is exact, in
 * arithmetic wide enough, one rounding is left to see through (W. Clinger, "How to read floating point
 * numbers accurately", 1990). What is not decided so is left to strtod().
 *
 * Writing: digits come from double arithmetic, which is far finer than a float, and are tried. */
#include "points_number.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { EXACT_POWER = 22 }; /* 10^22 is the largest that a double holds */

static const double powers[EXACT_POWER + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                               1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                               1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/* --- reading */

/* digits × 10^exponent, where one rounding is certain. */
static bool scale_exactly(uint64_t digits, int exponent, double *value) {
    const int power = exponent < 0 ? -exponent : exponent;
    if (power > EXACT_POWER) {
        return digits == 0 ? (*value = 0.0, true) : false;
    }
    if (digits <= (uint64_t)1 << 53) {
        *value = exponent < 0 ? (double)digits / powers[power] : (double)digits * powers[power];
        return true;
    }
#if LDBL_MANT_DIG == 64
    /* off by half of a unit of 64 bits at most, which decides the double's 53 but next to the middle between
     * two of them */
    const long double wide = exponent < 0 ? (long double)digits / (long double)powers[power]
                                          : (long double)digits * (long double)powers[power];
    uint64_t mantissa;
    memcpy(&mantissa, &wide, sizeof mantissa);
    const uint64_t rest = mantissa & 0x7ff;
    *value = (double)wide;
    return rest < 0x3ff || rest > 0x401;
#else
    return false;
#endif
}

/* The C library's, in the C locale whatever the process has set. */
static double read_slowly(const char *text, const char *end) {
    char copy[512];
    const size_t size = (size_t)(end - text);
    char *all = size < sizeof copy ? copy : malloc(size + 1);
    if (all == NULL) {
        return (double)NAN;
    }
    memcpy(all, text, size);
    all[size] = '\0';
    const locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const locale_t old = uselocale(c);
    const double value = strtod(all, NULL);
    uselocale(old);
    freelocale(c);
    if (all != copy) {
        free(all);
    }
    return value;
}

static bool is_word(const char *text, const char *end, const char *word) {
    const size_t size = strlen(word);
    return (size_t)(end - text) == size && strncasecmp(text, word, size) == 0;
}

bool cli_number_read(const char *text, const char *end, double *value) {
    const char *c = text;
    const bool negative = c < end && *c == '-';
    c += c < end && (*c == '-' || *c == '+');
    const char *start = c;
    uint64_t digits = 0;
    int exponent = 0, count = 0; /* digits from the first that is not 0 */
    for (; c < end && is_digit(*c); ++c) {
        digits = count < 19 ? 10 * digits + (uint64_t)(*c - '0') : digits;
        exponent += count >= 19;
        count += digits != 0;
    }
    ptrdiff_t written = c - start;
    if (c < end && *c == '.') {
        const char *fraction = ++c;
        for (; c < end && is_digit(*c); ++c) {
            if (count < 19) {
                digits = 10 * digits + (uint64_t)(*c - '0');
                --exponent;
            }
            count += digits != 0;
        }
        written += c - fraction;
    }
    if (written == 0) {
        if (is_word(start, end, "nan")) {
            *value = (double)NAN;
            return true;
        }
        *value = negative ? -(double)INFINITY : (double)INFINITY;
        return is_word(start, end, "inf") || is_word(start, end, "infinity");
    }
    if (c < end && (*c == 'e' || *c == 'E')) {
        ++c;
        const bool down = c < end && *c == '-';
        c += c < end && (*c == '-' || *c == '+');
        const char *first = c;
        int power = 0;
        for (; c < end && is_digit(*c); ++c) {
            power = power < 100000 ? 10 * power + (*c - '0') : power;
        }
        if (c == first) {
            return false;
        }
        exponent += down ? -power : power;
    }
    if (c != end) {
        return false;
    }
    if (count > 19 || !scale_exactly(digits, exponent, value)) {
        *value = read_slowly(start, end);
    }
    *value = negative ? -*value : *value;
    return true;
}

/* --- writing */

static char *put(char *text, const char *word) {
    const size_t size = strlen(word);
    memcpy(text, word, size);
    return text + size;
}

/* `digits` of `count` decimal places of which the first is worth 10^leading, without zeros at the end. */
static char *put_digits(char *text, uint64_t digits, int count, int leading) {
    char d[20];
    for (int i = count - 1; i >= 0; --i) {
        d[i] = (char)('0' + digits % 10);
        digits /= 10;
    }
    while (count > 1 && d[count - 1] == '0') {
        --count;
    }
    if (leading < 0) {
        *text++ = '0';
        *text++ = '.';
        for (int i = -1; i > leading; --i) {
            *text++ = '0';
        }
        memcpy(text, d, (size_t)count);
        return text + count;
    }
    for (int i = 0; i <= leading || i < count; ++i) {
        if (i == leading + 1) {
            *text++ = '.';
        }
        *text++ = i < count ? d[i] : '0';
    }
    return text;
}

/* Sign, and what needs no digits; NULL where there are some. */
static char *put_special(char **text, double value) {
    if (isnan(value)) {
        return put(*text, "nan");
    }
    if (signbit(value)) {
        *(*text)++ = '-';
    }
    return isinf(value) ? put(*text, "inf") : value == 0.0 ? put(*text, "0") : NULL;
}

/* printf's, with a point for the comma that a locale may have. */
static char *put_slowly(char *text, int digits, double value) {
    char printed[64];
    snprintf(printed, sizeof printed, "%.*g", digits, value);
    char *comma = strchr(printed, ',');
    if (comma != NULL) {
        *comma = '.';
    }
    return put(text, printed);
}

/* Whether a float is what `value`, a correctly rounded double, and the decimal behind it both round to. */
static bool is_float(double value, float wanted) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    const uint64_t rest = bits & 0x1fffffff;
    return (float)value == wanted && (rest < 0x0fffffff || rest > 0x10000001);
}

char *cli_number_write_float(char *text, float value) {
    char *special = put_special(&text, (double)value);
    if (special != NULL) {
        return special;
    }
    const double size = fabs((double)value);
    if (!(size >= 1e-6 && size < 1e9)) {
        return put_slowly(text, 9, size);
    }
    int leading = 0;
    while (leading < 8 && size >= powers[leading + 1]) {
        ++leading;
    }
    while (leading > -6 && leading <= 0 && size * powers[-leading] < 1.0) {
        --leading;
    }
    for (int count = 6; count < 9; ++count) {
        const int shift = count - 1 - leading;
        const double digits = nearbyint(shift >= 0 ? size * powers[shift] : size / powers[-shift]);
        const double back = shift >= 0 ? digits / powers[shift] : digits * powers[-shift];
        if (digits < powers[count] && is_float(back, (float)size)) {
            return put_digits(text, (uint64_t)digits, count, leading);
        }
    }
    /* any of the two nearest of 9 digits will do: they are 1e-8 apart at most, floats 6e-8 at least */
    double digits = nearbyint(size * powers[8 - leading]);
    if (digits >= powers[9]) {
        return put_slowly(text, 9, size);
    }
    return put_digits(text, (uint64_t)digits, 9, leading);
}

#if LDBL_MANT_DIG == 64
/* Digits from arithmetic of 64 bits, off by 0.505 of the last of 17: doubles are 1.1 of it apart at least. */
static char *put_wide(char *text, double size, int count) {
    int leading = 0;
    while (leading < 15 && size >= powers[leading + 1]) {
        ++leading;
    }
    while (leading > -6 && leading <= 0 && size * powers[-leading] < 1.0) {
        --leading;
    }
    const int shift = count - 1 - leading;
    const long double power = (long double)powers[shift < 0 ? -shift : shift];
    const long double exact = shift < 0 ? (long double)size / power : (long double)size * power;
    const uint64_t digits = (uint64_t)(exact + 0.5L);
    return digits < (uint64_t)powers[count] ? put_digits(text, digits, count, leading)
                                            : put_slowly(text, count, size);
}
#endif

char *cli_number_write_double(char *text, double value) {
    char *special = put_special(&text, value);
    if (special != NULL) {
        return special;
    }
    const double size = fabs(value);
    for (int count = 15;; ++count) {
#if LDBL_MANT_DIG == 64
        char *end = size >= 1e-6 && size < 1e15 ? put_wide(text, size, count) : put_slowly(text, count, size);
#else
        char *end = put_slowly(text, count, size);
#endif
        double back;
        if (count == 17 || (cli_number_read(text, end, &back) && back == size)) {
            return end;
        }
    }
}
