/* What a reader and its caller tell each other: numbers, texts and arrays one after the other in a file, each
 * at a multiple of 8 bytes, in this machine's form. Whoever takes them trusts none of them. */
#ifndef VSHI_READ_MESSAGE_H
#define VSHI_READ_MESSAGE_H

#include "base/error.h"
#include "base/shared.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { VSHI_PUT_ROOM = 1 << 16 };

/* A message that is written from offset `size` on; the first failure is kept, what follows it is left out. */
typedef struct vshi_put {
    int file;
    int error;        /* errno of the first failure; 0: none */
    size_t used;      /* of the buffer */
    uint64_t size;    /* bytes of the file, with those of the buffer */
    uint64_t room;    /* bytes that the file and the heap may take together, ENOMEM past it; 0: any */
    uint64_t checked; /* size at which that was looked at */
    unsigned char buffer[VSHI_PUT_ROOM];
} vshi_put;

void vshi_put_begin(vshi_put *put, int file, uint64_t offset);
VSHI_SHARED void vshi_put_array(vshi_put *put, const void *array, size_t count, size_t size);
VSHI_SHARED void vshi_put_count(vshi_put *put, uint64_t count);
VSHI_SHARED void vshi_put_number(vshi_put *put, double number);
VSHI_SHARED void vshi_put_text(vshi_put *put, const char *text); /* may be NULL */
bool vshi_put_flush(vshi_put *put);                              /* false after a failure */

/* A message in memory that is read. What is not there, or not as it must be, shows as `bad`, and as zeros. */
typedef struct vshi_take {
    const unsigned char *at, *end; /* `at` is a multiple of 8 */
    bool bad;
} vshi_take;

/* A view of count × size bytes (size not 0), at a multiple of 8; NULL where the message is shorter, or bad
 * before, and where count is 0. */
VSHI_SHARED const void *vshi_take_array(vshi_take *take, uint64_t count, size_t size);
VSHI_SHARED uint64_t vshi_take_count(vshi_take *take, uint64_t most); /* larger ones are bad */
VSHI_SHARED double vshi_take_number(vshi_take *take);                 /* one that is not finite is bad */

/* NULL where the writer put NULL, or bad. `line`: one with control characters is bad. */
VSHI_SHARED const char *vshi_take_text(vshi_take *take, bool line);

/* Nothing is left, and nothing was bad. */
VSHI_SHARED bool vshi_take_ends(const vshi_take *take);

#ifdef __cplusplus
}
#endif
#endif
