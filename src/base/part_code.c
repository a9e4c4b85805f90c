#include "base/part_code.h"

#include <stdlib.h>
#include <string.h>

void vshi_part_code_bytes(vshi_part_code *code, void *value, size_t size) {
    if (code->failed || size == 0) {
        return;
    }
    if (code->reads) {
        if (size > code->room - code->size) {
            code->failed = true;
            return;
        }
        memcpy(value, code->bytes + code->size, size);
        code->size += size;
        return;
    }
    if (size > code->room - code->size) {
        const size_t room = 2 * (code->size + size) + 4096;
        unsigned char *larger = realloc(code->bytes, room);
        if (larger == NULL) {
            code->failed = true;
            return;
        }
        code->bytes = larger;
        code->room = room;
    }
    memcpy(code->bytes + code->size, value, size);
    code->size += size;
}

void vshi_part_code_u64(vshi_part_code *code, uint64_t *value) {
    vshi_part_code_bytes(code, value, sizeof *value);
}

void vshi_part_code_f64(vshi_part_code *code, double *value) {
    vshi_part_code_bytes(code, value, sizeof *value);
}

void vshi_part_code_i32(vshi_part_code *code, int32_t *value) {
    vshi_part_code_bytes(code, value, sizeof *value);
}

/* The number of elements that follow, each of `least` bytes in the file and `size` in memory, and where they
 * are read their memory. */
void vshi_part_code_count(vshi_part_code *code, uint64_t *count, size_t least, void **list, size_t size) {
    vshi_part_code_u64(code, count);
    if (!code->reads) {
        return;
    }
    *list = NULL;
    if (code->failed || *count > (code->room - code->size) / least) {
        code->failed = true;
        *count = 0;
        return;
    }
    *list = calloc((size_t)*count + 1, size);
    if (*list == NULL) {
        code->failed = true;
        *count = 0;
    }
}

/* With its NUL, which no other is before. */
void vshi_part_code_text(vshi_part_code *code, char **text) {
    uint64_t size = code->reads ? 0 : strlen(*text) + 1;
    if (code->reads) {
        *text = NULL;
    }
    vshi_part_code_count(code, &size, 1, (void **)text, 1);
    if (!code->failed) {
        vshi_part_code_bytes(code, *text, (size_t)size);
    }
    if (code->reads && !code->failed && strlen(*text) + 1 != size) { /* calloc() put a NUL behind all */
        code->failed = true;
    }
}

void vshi_part_code_texts(vshi_part_code *code, char ***texts, uint64_t *count) {
    vshi_part_code_count(code, count, sizeof(uint64_t), (void **)texts, sizeof **texts);
    for (uint64_t i = 0; i < *count && !code->failed; ++i) {
        vshi_part_code_text(code, &(*texts)[i]);
    }
}
