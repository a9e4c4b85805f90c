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

enum { VSHI_ENCODER_BUFFER = 1 << 14 };

/* A message that is written from offset `size` on; the first failure is kept, what follows it is left out. */
typedef struct vshi_encoder {
    int file;
    int error;        /* errno of the first failure; 0: none */
    size_t used;      /* of the buffer */
    uint64_t size;    /* bytes of the file, with those of the buffer */
    uint64_t room;    /* bytes that the file and the heap may take together, ENOMEM past it; 0: any */
    uint64_t checked; /* size at which that was looked at */
    unsigned char buffer[VSHI_ENCODER_BUFFER];
} vshi_encoder;

void vshi_encoder_begin(vshi_encoder *encoder, int file, uint64_t offset);
VSHI_SHARED void vshi_encode_array(vshi_encoder *encoder, const void *array, size_t count, size_t size);
VSHI_SHARED void vshi_encode_count(vshi_encoder *encoder, uint64_t count);
VSHI_SHARED void vshi_encode_number(vshi_encoder *encoder, double number);
VSHI_SHARED void vshi_encode_text(vshi_encoder *encoder, const char *text); /* may be NULL */
bool vshi_encoder_flush(vshi_encoder *encoder);                             /* false after a failure */

/* A message in memory that is read. What is not there, or not as it must be, shows as `bad`, and as zeros. */
typedef struct vshi_decoder {
    const unsigned char *at, *end; /* `at` is a multiple of 8 */
    bool bad;
} vshi_decoder;

/* A view of count × size bytes (size not 0), at a multiple of 8; NULL where the message is shorter, or bad
 * before, and where count is 0. */
VSHI_SHARED const void *vshi_decode_array(vshi_decoder *decoder, uint64_t count, size_t size);
VSHI_SHARED uint64_t vshi_decode_count(vshi_decoder *decoder, uint64_t most); /* larger ones are bad */
VSHI_SHARED double vshi_decode_number(vshi_decoder *decoder); /* one that is not finite is bad */

/* NULL where the writer put NULL, or bad. `line`: one with control characters is bad. */
VSHI_SHARED const char *vshi_decode_text(vshi_decoder *decoder, bool line);

/* Nothing is left, and nothing was bad. */
VSHI_SHARED bool vshi_decoder_ends(const vshi_decoder *decoder);

#ifdef __cplusplus
}
#endif
#endif
