/* Collada: the unit that its asset names ("<unit meter="0.01"/>"), by which Assimp multiplies and of which it
 * tells nothing. */
#define _GNU_SOURCE
#include "model/scan.h"

#include <stdlib.h>
#include <string.h>

/* Whatever number of white space stands around an attribute's "=", which XML allows. */
static const char *skip_blanks(const char *at, const char *end) {
    while (at < end && (*at == ' ' || (*at >= '\t' && *at <= '\r'))) {
        ++at;
    }
    return at;
}

static double attribute(const char *tag, const char *end) {
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

vsh_result vshi_scan_dae(vshi_scan *scan, vsh_error *error) {
    static const char open[] = "<unit";
    const char *end = scan->text + scan->size;
    const char *tag = memmem(scan->text, scan->size, open, sizeof open - 1);
    const char *stop = tag != NULL ? memchr(tag, '>', (size_t)(end - tag)) : NULL;
    const double metres = stop != NULL ? attribute(tag, stop) : 1.0;
    (void)error;
    scan->unit = metres > 0.0 && metres < 1e12 ? metres : 1.0; /* the format's own: a metre */
    return VSH_OK;
}
