/* The known word that a misspelt one was probably meant to be. */
#ifndef VSHI_SUGGEST_H
#define VSHI_SUGGEST_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>

/* Number of single-character changes (V. Levenshtein, "Binary codes capable of correcting deletions,
 * insertions, and reversals", 1966), or SIZE_MAX where one word has more than 63 characters. */
VSHI_SHARED size_t vshi_edit_distance(const char *a, const char *b);

/* Whether a distance is small enough for a word of this length to be worth saying. */
bool vshi_is_near(size_t distance, const char *word);

#endif
