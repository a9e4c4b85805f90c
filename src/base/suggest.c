#include "base/suggest.h"

#include <stdint.h>
#include <string.h>

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
