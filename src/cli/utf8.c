#include "utf8.h"

#include <stdlib.h>
#include <string.h>

/* The well-formed sequences (The Unicode Standard, table 3-7): the first byte's range, the second's, and how
 * many there are. */
static const struct {
    unsigned char first, last, second_first, second_last;
    size_t length;
} sequences[] = {{0x01, 0x7f, 0x00, 0xff, 1}, {0xc2, 0xdf, 0x80, 0xbf, 2}, {0xe0, 0xe0, 0xa0, 0xbf, 3},
                 {0xe1, 0xec, 0x80, 0xbf, 3}, {0xed, 0xed, 0x80, 0x9f, 3}, {0xee, 0xef, 0x80, 0xbf, 3},
                 {0xf0, 0xf0, 0x90, 0xbf, 4}, {0xf1, 0xf3, 0x80, 0xbf, 4}, {0xf4, 0xf4, 0x80, 0x8f, 4}};

size_t cli_utf8_length(const char *text) {
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

json_t *cli_utf8_json(const char *text) {
    char *clean = malloc(3 * strlen(text) + 1);
    size_t used = 0;
    if (clean == NULL) {
        return NULL;
    }
    while (*text != '\0') {
        const size_t length = cli_utf8_length(text);
        memcpy(clean + used, length > 0 ? text : CLI_NO_CHARACTER, length > 0 ? length : 3);
        used += length > 0 ? length : 3;
        text += length > 0 ? length : 1;
    }
    json_t *json = json_stringn(clean, used);
    free(clean);
    return json;
}
