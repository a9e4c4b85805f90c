#include "model/words.h"

#include "base/hash.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum { LONGEST = 1023 };

static uint64_t hash_of(const char *name, size_t size) {
    uint64_t hash = size;
    for (size_t i = 0; i < size; ++i) {
        hash = vshi_mix(hash ^ (unsigned char)name[i]);
    }
    return hash;
}

/* The slot of a name, or the empty one where it would be. There is always an empty one. */
static uint32_t *slot_of(const vshi_words *words, const char *name, size_t size) {
    const size_t mask = words->slot_count - 1;
    size_t at = hash_of(name, size) & mask;
    for (; words->slots[at] != 0; at = (at + 1) & mask) {
        const char *known = vshi_words_at(words, words->slots[at] - 1);
        if (strncmp(known, name, size) == 0 && known[size] == '\0') {
            break;
        }
    }
    return &words->slots[at];
}

static vsh_result grow_slots(vshi_words *words, vshi_budget *budget, vsh_error *error) {
    enum { FIRST = 64 };
    if (words->count < words->slot_count / 2) {
        return VSH_OK;
    }
    const size_t slots = words->slot_count > 0 ? 2 * words->slot_count : FIRST;
    VSHI_TRY(vshi_reserve(budget, &words->slots, &words->slot_capacity, slots, sizeof *words->slots, error));
    words->slot_count = slots;
    memset(words->slots, 0, slots * sizeof *words->slots);
    for (size_t i = 0; i < words->count; ++i) {
        const char *name = vshi_words_at(words, i);
        *slot_of(words, name, strlen(name)) = (uint32_t)i + 1;
    }
    return VSH_OK;
}

vsh_result vshi_words_number(vshi_words *words, vshi_budget *budget, const char *name, size_t size,
                             size_t *number, bool *is_new, vsh_error *error) {
    size = size > 0 ? strnlen(name, size < LONGEST ? size : LONGEST) : 0;
    VSHI_TRY(grow_slots(words, budget, error));
    uint32_t *slot = slot_of(words, name, size);
    *is_new = *slot == 0;
    if (*is_new) {
        VSHI_TRY(vshi_grow(budget, &words->text, &words->text_capacity, words->used + size + 1, 1, error));
        VSHI_TRY(vshi_grow(budget, &words->begins, &words->capacity, words->count + 1, sizeof *words->begins,
                           error));
        memcpy(words->text + words->used, name, size);
        words->text[words->used + size] = '\0';
        words->begins[words->count++] = words->used;
        words->used += size + 1;
        *slot = (uint32_t)words->count;
    }
    *number = *slot - 1;
    return VSH_OK;
}

void vshi_words_free(vshi_words *words) {
    free(words->slots);
    free(words->begins);
    free(words->text);
    *words = (vshi_words){0};
}
