// Numbers as text by the C++ library, which knows no locale.
#include "base/decimal.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

namespace {

// Without exponent where that is not longer than what printf() would write.
template <typename Float> char *write(char *text, Float value, Float most) {
    if (std::isnan(value)) {
        return std::char_traits<char>::copy(text, "nan", 3) + 3;
    }
    const Float size = std::fabs(value);
    const bool plain = size == 0 || (size >= Float(1e-6) && size < most) || std::isinf(size);
    const auto format = plain ? std::chars_format::fixed : std::chars_format::scientific;
    return std::to_chars(text, text + VSHI_DECIMAL_ROOM, value, format).ptr;
}

} // namespace

bool vshi_decimal_read(const char *text, const char *end, double *value) {
    const bool negative = text < end && *text == '-';
    text += text < end && (*text == '-' || *text == '+');
    if (text == end || *text == '-' || end[-1] == ')') { // "nan(…)" is C's
        return false;
    }
    const auto [behind, error] = std::from_chars(text, end, *value);
    if (behind != end || error == std::errc::invalid_argument) {
        return false;
    }
    if (error == std::errc::result_out_of_range) { // 0 or infinite, which is not told
        try {
            *value = std::strtod(std::string(text, end).c_str(), nullptr);
        } catch (const std::exception &) {
            return false;
        }
    }
    *value = negative ? -*value : *value;
    return true;
}

namespace {

inline bool is_digit(char c) {
    return static_cast<unsigned char>(c - '0') < 10;
}

const char *digits(const char *c, std::uint64_t *number) {
    while (is_digit(*c)) {
        *number = 10 * *number + static_cast<unsigned char>(*c++ - '0');
    }
    return c;
}

// "e-7"; NULL where no digits follow the e. Exponents that nothing is left of are cut.
const char *exponent_at(const char *c, std::int64_t *exponent) {
    const bool negative = c[1] == '-';
    c += c[1] == '-' || c[1] == '+' ? 2 : 1;
    const char *const first = c;
    std::int64_t number = 0;
    for (; is_digit(*c); ++c) {
        number = std::min<std::int64_t>(10 * number + (*c - '0'), 1 << 30);
    }
    *exponent += negative ? -number : number;
    return c == first ? nullptr : c;
}

// Any number, whatever its length, by the C++ library.
float round_slowly(const char *begin, const char *end) {
    float value = 0.0f;
    if (std::from_chars(begin, end, value).ec == std::errc::result_out_of_range) {
        double far = 0.0; // 0 or infinite
        vshi_decimal_read(begin, end, &far);
        value = static_cast<float>(far);
    }
    return value;
}

// Up to 2^53 and powers of ten up to 22 doubles are exact, and so their product or quotient is rounded once
// (Clinger, "How to read floating point numbers accurately", 1990). What is rounded to a double and then to a
// float is rounded right, unless the double lies in the middle between two floats, or where floats are
// subnormal.
bool round_fast(std::uint64_t number, std::int64_t exponent, float *value) {
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (number > std::uint64_t{1} << 53 || exponent < -22 || exponent > 22) {
        return false;
    }
    const auto whole = static_cast<double>(number);
    const double rounded = exponent < 0 ? whole / powers[-exponent] : whole * powers[exponent];
    std::uint64_t bits;
    std::memcpy(&bits, &rounded, sizeof bits);
    *value = static_cast<float>(rounded);
    return ((bits & 0x1fffffff) != 0x10000000 && rounded >= 0x1p-126) || number == 0;
}

} // namespace

const char *vshi_decimal_float(const char *text, float *value) {
    constexpr std::ptrdiff_t most_digits = 19; // of which any number fits into 64 bits
    const char *c = text + (*text == '-' || *text == '+');
    const char *const first = c;
    std::uint64_t number = 0;
    std::int64_t exponent = 0;
    c = digits(c, &number);
    std::ptrdiff_t count = c - first;
    if (*c == '.') {
        const char *const fraction = ++c;
        c = digits(c, &number);
        exponent = fraction - c;
        count += c - fraction;
    }
    if (count > 0 && (*c == 'e' || *c == 'E')) {
        c = exponent_at(c, &exponent);
    }
    if (count == 0 || c == nullptr) {
        return nullptr;
    }
    if (count > most_digits || !round_fast(number, exponent, value)) {
        *value = round_slowly(first, c);
    }
    *value = *text == '-' ? -*value : *value;
    return c;
}

char *vshi_decimal_write_float(char *text, float value) {
    return write(text, value, 1e9f);
}

char *vshi_decimal_write_double(char *text, double value) {
    return write(text, value, 1e15);
}
