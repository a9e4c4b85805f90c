#define _GNU_SOURCE
#include "model/scan.h"

#include "base/bytes.h"
#include "model/stream.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

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

/* STL: binary files are as long as their number of triangles says, ASCII ones end in "endsolid" and hold
 * numbers. Assimp 5.2 reads an ASCII file that ends between two facets as a smaller mesh. */

enum { HEADER = 84, FACET = 50, FACETS_A_POLL = 4096 };

static vsh_result scan_ascii(vshi_scan *scan, vsh_error *error) {
    const char *at = scan->text, *end = scan->text + scan->size;
    size_t vertices = 0;
    bool ended = false;
    for (;;) {
        const vshi_token token = vshi_scan_token(&at, end);
        if (token.text == NULL) {
            break;
        }
        if (vshi_token_is(token, "solid") || vshi_token_is(token, "endsolid")) {
            ended = token.text[0] == 'e';
            const char *stop = memchr(at, '\n', (size_t)(end - at)); /* a name may follow, of any words */
            at = stop != NULL ? stop : end;
        } else if (vshi_token_is(token, "endfacet")) {
            ++scan->faces;
            if (scan->faces % FACETS_A_POLL == 0 &&
                vshi_advance_to(scan->job, (double)(at - scan->text) / (double)scan->size, scan->units,
                                &scan->units_done)) {
                return vshi_job_fail_cancelled(scan->job, error);
            }
        } else if (vshi_token_is(token, "vertex")) {
            for (int k = 0; k < 3; ++k) {
                const vshi_token number = vshi_scan_token(&at, end);
                if (number.text != NULL && vshi_token_number(number) != VSHI_NUMBER_FINITE) {
                    return vshi_fail(error, VSH_ERROR_INPUT,
                                     "%s: vertex %zu of facet %zu holds '%.*s', expected a finite number",
                                     scan->path, vertices % 3, vertices / 3, VSHI_TOKEN_ARGS(number));
                }
            }
            ++vertices;
        }
    }
    if (!ended) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: no 'endsolid' after %zu facets", scan->path,
                         scan->faces);
    }
    return VSH_OK;
}

static vsh_result scan_stl(vshi_scan *scan, vsh_error *error) {
    const size_t facets = scan->size >= HEADER ? (size_t)vshi_bytes_number(scan->text + 80, 4, false) : 0;
    const uint64_t expected = HEADER + FACET * (uint64_t)facets;
    const char *at = scan->text;
    const bool solid = vshi_token_is(vshi_scan_token(&at, scan->text + scan->size), "solid");
    if (scan->size >= HEADER && expected == scan->size) {
        scan->faces = facets;
        return VSH_OK;
    }
    if (solid && memchr(scan->text, '\0', scan->size < HEADER ? scan->size : HEADER) == NULL) {
        return scan_ascii(scan, error);
    }
    if (scan->size < HEADER || expected > scan->size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of %llu", scan->path, scan->size,
                         (unsigned long long)(scan->size < HEADER ? HEADER : expected));
    }
    scan->faces = facets;
    return VSH_OK;
}

/* Collada: the unit that its asset names ("<unit meter="0.01"/>"), by which Assimp multiplies and of which it
 * tells nothing. */

/* Skips white space, which XML allows around an attribute's "=". */
static const char *skip_blanks(const char *at, const char *end) {
    while (at < end && is_space(*at)) {
        ++at;
    }
    return at;
}

static double read_metres(const char *tag, const char *end) {
    static const char name[] = "meter";
    const char *at = memmem(tag, (size_t)(end - tag), name, sizeof name - 1);
    at = at != NULL ? skip_blanks(at + sizeof name - 1, end) : end;
    at = at < end && *at == '=' ? skip_blanks(at + 1, end) : end;
    if (at == end || (*at != '"' && *at != '\'')) {
        return 0.0;
    }
    char text[64];
    const char *stop = memchr(at + 1, *at, (size_t)(end - at - 1));
    const size_t size = stop != NULL ? (size_t)(stop - at - 1) : sizeof text;
    if (size >= sizeof text || vshi_token_number((vshi_token){at + 1, size}) != VSHI_NUMBER_FINITE) {
        return 0.0;
    }
    memcpy(text, at + 1, size);
    text[size] = '\0';
    return strtod(text, NULL);
}

static vsh_result scan_dae(vshi_scan *scan, vsh_error *error) {
    static const char open[] = "<unit";
    const char *end = scan->text + scan->size;
    const char *tag = memmem(scan->text, scan->size, open, sizeof open - 1);
    const char *stop = tag != NULL ? memchr(tag, '>', (size_t)(end - tag)) : NULL;
    const double metres = stop != NULL ? read_metres(tag, stop) : 1.0;
    (void)error;
    scan->unit = metres > 0.0 && metres < 1e12 ? metres : 1.0; /* the format's own: a metre */
    return VSH_OK;
}

static const struct {
    const char *ending;
    vsh_result (*scan)(vshi_scan *, vsh_error *);
} scanners[] = {
    {"stl", scan_stl},
    {"dae", scan_dae},
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
