// Numbers as text by the C++ library, which ignores the locale.
#include "base/decimal.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <string>

namespace {

// Writes no exponent for the sizes that printf() writes without one.
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
    if (error == std::errc::result_out_of_range) { // 0 or infinite: from_chars() does not tell
        try {
            *value = std::strtod(std::string(text, end).c_str(), nullptr);
        } catch (const std::exception &) {
            return false;
        }
    }
    *value = negative ? -*value : *value;
    return true;
}

const char *vshi_decimal_float(const char *text, float *value) {
    const char *const first = text + (*text == '+');
    const char *end = first + (*first == '-' && first == text);
    while ((*end >= '0' && *end <= '9') || *end == '.' || *end == 'e' || *end == 'E' ||
           ((*end == '-' || *end == '+') && (end[-1] == 'e' || end[-1] == 'E'))) {
        ++end;
    }
    const auto [behind, error] = std::from_chars(first, end, *value);
    if (error == std::errc::result_out_of_range) {
        double far = 0.0; // 0 or infinite
        vshi_decimal_read(first, behind, &far);
        *value = static_cast<float>(far);
    }
    return behind == end && error != std::errc::invalid_argument ? behind : nullptr;
}

char *vshi_decimal_write_float(char *text, float value) {
    return write(text, value, 1e9f);
}

char *vshi_decimal_write_double(char *text, double value) {
    return write(text, value, 1e15);
}
