/* Names of a file, each kept once and found by its text. */
#ifndef VSHI_WORDS_H
#define VSHI_WORDS_H

#include "model/growing.h"

#include <stdbool.h>
#include <stdint.h>

/* Zeros before the first. */
typedef struct vshi_words {
    char *text; /* one behind the other, with their ends */
    size_t used, text_capacity;
    size_t *begins; /* [count]: in the text */
    size_t count, capacity;
    uint32_t *slots; /* a hash table: number + 1; 0: empty */
    size_t slot_count, slot_capacity;
} vshi_words;

/* The number of a name, from 0 in order of their coming; *is_new: it was not there before. Names are cut to
 * 1023 bytes. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_words_number(vshi_words *words, vshi_budget *budget, const char *name, size_t size,
                             size_t *number, bool *is_new, vsh_error *error);

static inline const char *vshi_words_at(const vshi_words *words, size_t number) {
    return words->text + words->begins[number];
}

void vshi_words_free(vshi_words *words);

#endif
