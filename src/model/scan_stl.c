/* STL: binary files are as long as their number of triangles says, ASCII ones end in "endsolid" and hold
 * numbers. Assimp 5.2 reads an ASCII file that ends between two facets as a smaller mesh. */
#include "model/scan.h"

#include "base/bytes.h"

#include <string.h>

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
            if (scan->faces % FACETS_A_POLL == 0 && vshi_scan_poll(scan, at)) {
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

vsh_result vshi_scan_stl(vshi_scan *scan, vsh_error *error) {
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
