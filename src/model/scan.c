#include "model/scan.h"

#include <string.h>
#include <strings.h>

static const struct {
    const char *ending;
    vsh_result (*scan)(vshi_scan *, vsh_error *);
} scanners[] = {
    {"stl", vshi_scan_stl},
    {"dae", vshi_scan_dae},
};

vsh_result vshi_scan_file(vshi_scan *scan, const char *ending, vsh_error *error) {
    scan->faces = 0;
    for (size_t i = 0; i < sizeof scanners / sizeof scanners[0]; ++i) {
        if (strcasecmp(ending, scanners[i].ending) == 0) {
            return scanners[i].scan(scan, error);
        }
    }
    return VSH_OK;
}

bool vshi_scan_poll(vshi_scan *scan, const char *at) {
    const double fraction = (double)(at - scan->text) / (double)scan->size;
    const size_t reached = (size_t)(fraction * (double)scan->units);
    const size_t more = reached > scan->units_done ? reached - scan->units_done : 0;
    scan->units_done += more;
    return vshi_job_advance(scan->job, more);
}

static bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

vshi_token vshi_scan_token(const char **at, const char *end) {
    const char *c = *at;
    while (c < end && is_space(*c)) {
        ++c;
    }
    vshi_token token = {c < end ? c : NULL, 0};
    while (c < end && !is_space(*c)) {
        ++c;
    }
    token.size = token.text != NULL ? (size_t)(c - token.text) : 0;
    *at = c;
    return token;
}

vshi_token vshi_scan_rest(const char *at, const char *end) {
    while (at < end && is_space(*at)) {
        ++at;
    }
    while (end > at && is_space(end[-1])) {
        --end;
    }
    return (vshi_token){at, (size_t)(end - at)};
}

bool vshi_token_is(vshi_token token, const char *text) {
    return token.size == strlen(text) && token.size > 0 && memcmp(token.text, text, token.size) == 0;
}

static const char *skip_digits(const char *c, const char *end) {
    while (c < end && is_digit(*c)) {
        ++c;
    }
    return c;
}

vshi_number vshi_token_number(vshi_token token) {
    if (token.size == 0) {
        return VSHI_NUMBER_NONE;
    }
    const char *c = token.text, *end = c + token.size;
    c += *c == '-' || *c == '+';
    if (end - c >= 3 && (strncasecmp(c, "nan", 3) == 0 || strncasecmp(c, "inf", 3) == 0)) {
        return VSHI_NUMBER_NOT_FINITE;
    }
    const char *digits = c;
    c = skip_digits(c, end);
    ptrdiff_t count = c - digits;
    if (c < end && *c == '.') {
        const char *fraction = ++c;
        c = skip_digits(c, end);
        count += c - fraction;
    }
    if (count == 0) {
        return VSHI_NUMBER_NONE;
    }
    if (c < end && (*c == 'e' || *c == 'E')) {
        ++c;
        c += c < end && (*c == '-' || *c == '+');
        const char *exponent = c;
        c = skip_digits(c, end);
        if (c == exponent) {
            return VSHI_NUMBER_NONE;
        }
    }
    return c == end ? VSHI_NUMBER_FINITE : VSHI_NUMBER_NONE;
}

bool vshi_token_integer(vshi_token token, int64_t *value) {
    enum { DIGITS = 18 }; /* what fits int64_t whatever the digits */
    if (token.size == 0) {
        return false;
    }
    const char *c = token.text, *end = c + token.size;
    const bool negative = *c == '-';
    c += *c == '-' || *c == '+';
    if (c == end || end - c > DIGITS || skip_digits(c, end) != end) {
        return false;
    }
    *value = 0;
    for (; c < end; ++c) {
        *value = 10 * *value + (*c - '0');
    }
    *value = negative ? -*value : *value;
    return true;
}
