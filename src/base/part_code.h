/* Numbers and texts of parts' files, written and read by the same functions. */
#ifndef VSHI_PART_CODE_H
#define VSHI_PART_CODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct vshi_part_code {
    bool reads;
    bool failed;          /* memory was short, or what is read is not what was written */
    unsigned char *bytes; /* owned */
    size_t size;          /* bytes: written, or of those that are read the ones that were */
    size_t room;          /* that there is memory for; of what is read: all */
} vshi_part_code;

void vshi_part_code_bytes(vshi_part_code *code, void *value, size_t size);
void vshi_part_code_u64(vshi_part_code *code, uint64_t *value);
void vshi_part_code_f64(vshi_part_code *code, double *value);
void vshi_part_code_i32(vshi_part_code *code, int32_t *value);

/* The number of elements that follow, each of `least` bytes at least, and where they are read memory for them
 * and one more, zeroed, `size` bytes each. It is the caller's to free also where `failed`; *count is then 0.
 */
void vshi_part_code_count(vshi_part_code *code, uint64_t *count, size_t least, void **list, size_t size);

/* A text, and a list of them; those that are read are the caller's to free. */
void vshi_part_code_text(vshi_part_code *code, char **text);
void vshi_part_code_texts(vshi_part_code *code, char ***texts, uint64_t *count);

#endif
