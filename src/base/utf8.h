/* UTF-8 in texts that come from elsewhere. */
#ifndef VSHI_UTF8_H
#define VSHI_UTF8_H

#include <stddef.h>
#include <string.h>

/* U+FFFD: what stands for a byte that is part of no character. */
#define VSHI_NO_CHARACTER "\xef\xbf\xbd"

/* Bytes of the character that a text begins with; 0 where it is none of UTF-8's, or none that XML takes. The
 * text ends in NUL. */
static inline size_t vshi_utf8_length(const char *text) {
    /* The well-formed sequences (The Unicode Standard, table 3-7): the first byte's range, the second's, and
     * how many there are. */
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

/* `text` as UTF-8 whatever it holds, into clean[3 × its length + 1]: what is none becomes VSHI_NO_CHARACTER.
 */
static inline void vshi_utf8_clean(const char *text, char *clean) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        const size_t size = length > 0 ? length : sizeof VSHI_NO_CHARACTER - 1;
        memcpy(clean, length > 0 ? text : VSHI_NO_CHARACTER, size);
        clean += size;
    }
    *clean = '\0';
}

#endif
