/* Where a value stands in a JSON text: Jansson gives positions for syntax errors only. */
#ifndef VSHI_LOCATE_H
#define VSHI_LOCATE_H

#include <stdbool.h>
#include <stddef.h>

typedef struct vshi_place {
    size_t line;   /* from 1 */
    size_t column; /* from 1, in characters of UTF-8, as Jansson counts */
} vshi_place;

/* Walks from the root along `ordinals` [depth]: each is the number (from 0) of a member or item in the text.
 * Numbers and not names, because Jansson keeps members in the order of the text and rejects duplicates, so
 * escapes in keys need no decoding here. `key`: the place of the last step's key instead of its value. The
 * text has been parsed before; where it does not hold such a path, the place is that of the last step found.
 */
vshi_place vshi_locate(const char *text, size_t size, const size_t *ordinals, size_t depth, bool key);

/* Line and column of byte `at`. */
vshi_place vshi_place_of(const char *text, size_t size, size_t at);

#endif
