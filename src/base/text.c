#include "base/text.h"

#include "base/file.h"
#include "base/memory.h"

#include <ctype.h>
#include <nettle/base64.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <vdbshade/light.h>

/* --- UTF-8 */

size_t vshi_utf8_length(const char *text) {
    /* The well-formed sequences (The Unicode Standard, table 3-7): ranges of the first and second byte, and
     * the number of bytes. */
    static const struct {
        unsigned char first, last, second_first, second_last;
        size_t length;
    } sequences[] = {{0x01, 0x7f, 0x00, 0xff, 1}, {0xc2, 0xdf, 0x80, 0xbf, 2}, {0xe0, 0xe0, 0xa0, 0xbf, 3},
                     {0xe1, 0xec, 0x80, 0xbf, 3}, {0xed, 0xed, 0x80, 0x9f, 3}, {0xee, 0xef, 0x80, 0xbf, 3},
                     {0xf0, 0xf0, 0x90, 0xbf, 4}, {0xf1, 0xf3, 0x80, 0xbf, 4}, {0xf4, 0xf4, 0x80, 0x8f, 4}};
    const unsigned char *c = (const unsigned char *)text;
    for (size_t i = 0; i < sizeof sequences / sizeof sequences[0]; ++i) {
        if (c[0] < sequences[i].first || c[0] > sequences[i].last || c[1] < sequences[i].second_first ||
            c[1] > sequences[i].second_last) {
            continue;
        }
        for (size_t k = 2; k < sequences[i].length; ++k) {
            if (c[k] < 0x80 || c[k] > 0xbf) {
                return 0;
            }
        }
        return c[0] == 0xef && c[1] == 0xbf && c[2] >= 0xbe ? 0 : sequences[i].length; /* U+FFFE, U+FFFF */
    }
    return 0;
}

void vshi_utf8_clean(const char *text, char *clean) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        const size_t size = length > 0 ? length : sizeof VSHI_NO_CHARACTER - 1;
        memcpy(clean, length > 0 ? text : VSHI_NO_CHARACTER, size);
        clean += size;
    }
    *clean = '\0';
}

/* --- names of options in files and on command lines, in the order of their constants */

#define NAMES(...) ((const char *const[]){__VA_ARGS__, NULL})

static const char *const *const tables[] = {
    [VSH_NAMES_ISA] = NAMES("best", "base", "avx2", "avx512"),
    [VSH_NAMES_SHADOW] = NAMES("hard", "classic", "practical", "improved", "smooth", "cone", "rays",
                               "adaptive", "exact", "auto"),
    [VSH_NAMES_AO] = NAMES("taps", "cones", "rays", "adaptive", "exact", "auto"),
    [VSH_NAMES_SAMPLER] = NAMES("sobol", "white", "blue"),
    [VSH_NAMES_FALLOFF] = NAMES("none", "inverse_square", "quadratic"),
    [VSH_NAMES_COLOR] = NAMES("auto", "linear", "srgb", "encoded"),
    [VSH_NAMES_ALIGN] = NAMES("left", "center", "right"),
    [VSH_NAMES_ATLAS] = NAMES("shared", "objects"),
    [VSH_NAMES_COMBINE] = NAMES("multiply", "min"),
    [VSH_NAMES_TINT] = NAMES("none", "quadratic", "power"),
    [VSH_NAMES_BENT] = NAMES("world", "tangent"),
    [VSH_NAMES_UP] = NAMES("none", "x", "y", "z", "-x", "-y", "-z"),
    [VSH_NAMES_SEAMS] = NAMES("default", "keep", "fix"),
    [VSH_NAMES_INSIDE] = NAMES("nearest", "off"),
    [VSH_NAMES_FLAT_LIGHT] = NAMES("directional", "disc", "spot"),
    [VSH_NAMES_RECEIVER_UNWRAP] = NAMES("default", "never", "auto", "always"),
    [VSH_NAMES_MEASURE] = NAMES("nonfinite", "shift", "penumbra", "lost", "gained", "rmse", "p99", "max"),
};
enum { TABLES = sizeof tables / sizeof tables[0] };

const char *vsh_get_name(vsh_names kind, int32_t value) {
    const char *const *name = (uint32_t)kind < TABLES ? tables[kind] : NULL;
    for (; name != NULL && *name != NULL; ++name, --value) {
        if (value == 0) {
            return *name;
        }
    }
    return NULL;
}

int32_t vsh_find_name(vsh_names kind, const char *name) {
    const char *known;
    for (int32_t i = 0; name != NULL && (known = vsh_get_name(kind, i)) != NULL; ++i) {
        if (strcmp(known, name) == 0) {
            return i;
        }
    }
    return -1;
}

/* --- traits of methods, in the same order */

enum {
    INNER = VSH_METHOD_INNER,
    RAYS = VSH_METHOD_RAYS,
    KEEPS = VSH_METHOD_RAYS | VSH_METHOD_KEEPS_ERROR,
    TRACES = VSH_METHOD_RAYS | VSH_METHOD_KEEPS_ERROR | VSH_METHOD_TRIANGLES,
};

static const uint32_t shadow_traits[] = {
    [VSH_SHADOW_SMOOTH] = INNER,         [VSH_SHADOW_CONE] = INNER,
    [VSH_SHADOW_RAYS] = RAYS | INNER,    [VSH_SHADOW_ADAPTIVE] = KEEPS | INNER,
    [VSH_SHADOW_EXACT] = TRACES | INNER, [VSH_SHADOW_AUTO] = KEEPS | INNER,
};
static const uint32_t ao_traits[] = {
    [VSH_AO_RAYS] = RAYS,
    [VSH_AO_ADAPTIVE] = KEEPS,
    [VSH_AO_EXACT] = TRACES,
    [VSH_AO_AUTO] = KEEPS,
};

uint32_t vsh_method_traits(vsh_names kind, int32_t method) {
    const bool known = vsh_get_name(kind, method) != NULL;
    return known && kind == VSH_NAMES_SHADOW ? shadow_traits[method]
           : known && kind == VSH_NAMES_AO   ? ao_traits[method]
                                             : 0;
}

/* --- misspelt words */

size_t vshi_edit_distance(const char *a, const char *b) {
    enum { MAX_WORD = 63 };
    const size_t rows = strnlen(a, MAX_WORD + 1), columns = strnlen(b, MAX_WORD + 1);
    if (rows > MAX_WORD || columns > MAX_WORD) {
        return SIZE_MAX;
    }
    size_t row[MAX_WORD + 1];
    for (size_t j = 0; j <= columns; ++j) {
        row[j] = j;
    }
    for (size_t i = 1; i <= rows; ++i) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= columns; ++j) {
            const size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
            const size_t moved = (row[j] < row[j - 1] ? row[j] : row[j - 1]) + 1;
            diagonal = row[j];
            row[j] = replaced < moved ? replaced : moved;
        }
    }
    return row[columns];
}

bool vshi_is_near(size_t distance, const char *word) {
    const size_t length = strlen(word);
    return distance <= 2 + length / 4 && distance < length;
}

/* --- attributes */

enum { LONGEST_NAME = 79 /* PNG's */, LONGEST_VALUE = 65535 };

/* Whether all bytes of a text, at most `longest`, are in a range, and none is a control character (DEL). */
static bool is_line(const char *text, size_t longest, unsigned char first, unsigned char last) {
    const size_t length = strnlen(text, longest + 1);
    bool good = length <= longest;
    for (size_t i = 0; i < length && good; ++i) {
        const unsigned char c = (unsigned char)text[i];
        good = c >= first && c <= last && c != 0x7f;
    }
    return good;
}

vsh_result vshi_attributes_check(const char *path, const vsh_attribute *attributes, size_t count,
                                 vsh_error *error) {
    if (attributes == NULL && count > 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %zu attributes, but none are given", path, count);
    }
    for (size_t i = 0; i < count; ++i) {
        const vsh_attribute *a = &attributes[i];
        if (a->name == NULL || a->name[0] == '\0' || !is_line(a->name, LONGEST_NAME, 0x21, 0x7e)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: attribute %zu '%.80s': expected a name of 1 … %d printable letters", path,
                             i, a->name != NULL ? a->name : "", LONGEST_NAME);
        }
        if (a->value == NULL || !is_line(a->value, LONGEST_VALUE, 0x20, 0xff)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: attribute '%s': expected a line of text of at most %d bytes", path, a->name,
                             LONGEST_VALUE);
        }
        for (size_t k = 0; k < i; ++k) {
            if (strcmp(attributes[k].name, a->name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: attribute '%s' is given twice", path,
                                 a->name);
            }
        }
    }
    return VSH_OK;
}

bool vshi_attributes_add(vshi_attributes *a, const char *name, const char *value) {
    if (vshi_make_room((void **)&a->list, a->count, &a->capacity, sizeof *a->list, "attributes", NULL) !=
        VSH_OK) {
        return false;
    }
    const size_t name_size = strlen(name) + 1, value_size = strlen(value) + 1;
    char *texts = malloc(name_size + value_size);
    if (texts == NULL) {
        return false;
    }
    memcpy(texts, name, name_size);
    memcpy(texts + name_size, value, value_size);
    vshi_one_line(texts);
    vshi_one_line(texts + name_size);
    a->list[a->count++] = (vsh_attribute){texts, texts + name_size};
    return true;
}

void vshi_attributes_free(vshi_attributes *a) {
    for (size_t i = 0; i < a->count; ++i) {
        free((void *)(uintptr_t)a->list[i].name); /* its block also holds the value */
    }
    free(a->list);
    *a = (vshi_attributes){NULL, 0, 0};
}

/* --- URIs */

bool vshi_uri_is_data(const char *uri) {
    return strncasecmp(uri, "data:", 5) == 0;
}

bool vshi_uri_is_remote(const char *uri) {
    const char *colon = strstr(uri, "://");
    return colon != NULL && colon < uri + strcspn(uri, "/%?#");
}

char *vshi_uri_path(const char *base, const char *uri) {
    const size_t length = strlen(uri);
    char *path = vshi_path_beside(uri[0] == '/' ? "" : base, uri, length);
    if (path == NULL) {
        return NULL;
    }
    char *to = path + strlen(path) - length;
    for (const char *from = uri; *from != '\0'; ++from) {
        if (*from == '%' && isxdigit((unsigned char)from[1]) && isxdigit((unsigned char)from[2])) {
            *to++ = (char)strtol((const char[]){from[1], from[2], '\0'}, NULL, 16);
            from += 2;
        } else {
            *to++ = *from;
        }
    }
    *to = '\0';
    return path;
}

/* Decodes base64 without padding, in the usual alphabet or that of URLs. Returns the number of bytes;
 * SIZE_MAX if a letter is in neither. */
static size_t decode_base64(const char *text, size_t length, unsigned char *bytes) {
    struct base64_decode_ctx context;
    size_t count = 0;
    base64_decode_init(&context);
    for (size_t i = 0; i < length; ++i) {
        const char letter = text[i] == '-' ? '+' : text[i] == '_' ? '/' : text[i];
        const int decoded = letter > ' ' ? base64_decode_single(&context, &bytes[count], letter) : -1;
        if (decoded < 0) {
            return SIZE_MAX;
        }
        count += (size_t)decoded;
    }
    return count;
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
    unsigned char *decoded = malloc(length + 1);
    const size_t count = decoded != NULL ? decode_base64(text, length, decoded) : length + 1;
    if (decoded == NULL || count == SIZE_MAX) {
        free(decoded);
        *size = decoded == NULL ? count : 0;
        return false;
    }
    *bytes = decoded;
    *size = count;
    return true;
}
