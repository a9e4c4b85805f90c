#include "base/uri.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool vshi_uri_is_data(const char *uri) {
    return strncasecmp(uri, "data:", 5) == 0;
}

bool vshi_uri_is_remote(const char *uri) {
    const char *colon = strstr(uri, "://");
    return colon != NULL && colon < uri + strcspn(uri, "/%?#");
}

static int hex_digit(char c) {
    const char *const digits = "0123456789abcdef";
    const char lower = c >= 'A' && c <= 'F' ? (char)(c - 'A' + 'a') : c;
    const char *at = lower != '\0' ? strchr(digits, lower) : NULL;
    return at != NULL ? (int)(at - digits) : -1;
}

char *vshi_uri_path(const char *base, const char *uri) {
    const char *slash = strrchr(base, '/');
    const size_t folder = slash != NULL && uri[0] != '/' ? (size_t)(slash - base) + 1 : 0;
    char *path = malloc(folder + strlen(uri) + 1);
    if (path == NULL) {
        return NULL;
    }
    memcpy(path, base, folder);
    char *to = path + folder;
    for (const char *from = uri; *from != '\0'; ++from) {
        const int high = *from == '%' ? hex_digit(from[1]) : -1;
        const int low = high >= 0 ? hex_digit(from[2]) : -1;
        *to++ = low >= 0 ? (char)(16 * high + low) : *from;
        from += low >= 0 ? 2 : 0;
    }
    *to = '\0';
    return path;
}

/* The six bits of a letter of base64, also of the alphabet for URLs; -1: none. */
static int six_bits(unsigned char c) {
    if (c >= 'A' && c <= 'Z') {
        return c - 'A';
    }
    if (c >= 'a' && c <= 'z') {
        return c - 'a' + 26;
    }
    if (c >= '0' && c <= '9') {
        return c - '0' + 52;
    }
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

bool vshi_uri_data(const char *uri, unsigned char **bytes, size_t *size) {
    *bytes = NULL;
    *size = 0;
    const char *comma = vshi_uri_is_data(uri) ? strchr(uri, ',') : NULL;
    if (comma == NULL || comma - uri < 7 || strncasecmp(comma - 7, ";base64", 7) != 0) {
        return false;
    }
    const char *text = comma + 1;
    size_t length = strlen(text);
    while (length > 0 && text[length - 1] == '=') {
        --length;
    }
    if (length % 4 == 1) {
        return false;
    }
    const size_t expected = length / 4 * 3 + (length % 4 == 0 ? 0 : length % 4 - 1);
    unsigned char *to = malloc(expected + 1);
    if (to == NULL) {
        *size = expected;
        return false;
    }
    uint32_t held = 0;
    size_t at = 0;
    for (size_t i = 0; i < length; ++i) {
        const int bits = six_bits((unsigned char)text[i]);
        if (bits < 0) {
            free(to);
            return false;
        }
        held = held << 6 | (uint32_t)bits;
        if (i % 4 != 0) {
            to[at++] = (unsigned char)(held >> (6 - 2 * (i % 4)));
        }
    }
    *bytes = to;
    *size = at;
    return true;
}
