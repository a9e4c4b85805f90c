#include "io/reader/reader.h"

#include <errno.h>
#include <malloc.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

enum { ALIGNED = 8 };
static const uint64_t NO_TEXT = UINT64_MAX;

void vshi_encoder_begin(vshi_encoder *encoder, int file, uint64_t offset) {
    encoder->file = file;
    encoder->error = 0;
    encoder->used = 0;
    encoder->size = offset;
    encoder->room = encoder->checked = 0;
}

enum { CHECK_EVERY = 1 << 20 }; /* bytes */

/* Asks malloc(): the resident memory of getrusage() also counts the process that started this one. */
static bool has_room(vshi_encoder *encoder, uint64_t size) {
    if (encoder->room == 0 || size < encoder->checked + CHECK_EVERY) {
        return true;
    }
    encoder->checked = size;
    const struct mallinfo2 heap = mallinfo2();
    return heap.uordblks + heap.hblkhd + size <= encoder->room;
}

static void write_bytes(vshi_encoder *encoder, const unsigned char *bytes, size_t size, uint64_t offset) {
    if (encoder->error == 0 && !has_room(encoder, offset + size)) {
        encoder->error = ENOMEM;
    }
    while (encoder->error == 0 && size > 0) {
        const ssize_t written = pwrite(encoder->file, bytes, size, (off_t)offset);
        if (written > 0) {
            bytes += written;
            size -= (size_t)written;
            offset += (uint64_t)written;
        } else if (written == 0 || errno != EINTR) {
            encoder->error = written == 0 ? ENOSPC : errno;
        }
    }
}

bool vshi_encoder_flush(vshi_encoder *encoder) {
    write_bytes(encoder, encoder->buffer, encoder->used, encoder->size - encoder->used);
    encoder->used = 0;
    return encoder->error == 0;
}

static void append_bytes(vshi_encoder *encoder, const void *bytes, size_t size) {
    if (size > VSHI_ENCODER_BUFFER - encoder->used) {
        vshi_encoder_flush(encoder);
    }
    if (size > VSHI_ENCODER_BUFFER) {
        write_bytes(encoder, bytes, size, encoder->size);
    } else {
        memcpy(encoder->buffer + encoder->used, bytes, size);
        encoder->used += size;
    }
    encoder->size += size;
}

void vshi_encode_array(vshi_encoder *encoder, const void *array, size_t count, size_t size) {
    static const unsigned char zeros[ALIGNED];
    const size_t bytes = count * size; /* the array exists, so this cannot overflow */
    if (bytes > 0) {
        append_bytes(encoder, array, bytes);
        append_bytes(encoder, zeros, (ALIGNED - bytes % ALIGNED) % ALIGNED);
    }
}

void vshi_encode_count(vshi_encoder *encoder, uint64_t count) {
    append_bytes(encoder, &count, sizeof count);
}

void vshi_encode_number(vshi_encoder *encoder, double number) {
    append_bytes(encoder, &number, sizeof number);
}

void vshi_encode_text(vshi_encoder *encoder, const char *text) {
    if (text == NULL) {
        vshi_encode_count(encoder, NO_TEXT);
        return;
    }
    const size_t size = strlen(text) + 1;
    vshi_encode_count(encoder, size);
    vshi_encode_array(encoder, text, size, 1);
}

const void *vshi_decode_array(vshi_decoder *decoder, uint64_t count, size_t size) {
    const size_t left = (size_t)(decoder->end - decoder->at);
    if (decoder->bad || count > left / size) {
        decoder->bad = true;
        return NULL;
    }
    const size_t bytes = (size_t)count * size, padding = (ALIGNED - bytes % ALIGNED) % ALIGNED;
    if (padding > left - bytes) {
        decoder->bad = true;
        return NULL;
    }
    const void *array = decoder->at;
    decoder->at += bytes + padding;
    return count > 0 ? array : NULL;
}

uint64_t vshi_decode_count(vshi_decoder *decoder, uint64_t most) {
    uint64_t count = 0;
    const void *at = vshi_decode_array(decoder, 1, sizeof count);
    if (at != NULL) {
        memcpy(&count, at, sizeof count);
        decoder->bad = count > most;
    }
    return decoder->bad ? 0 : count;
}

double vshi_decode_number(vshi_decoder *decoder) {
    double number = 0.0;
    const void *at = vshi_decode_array(decoder, 1, sizeof number);
    if (at != NULL) {
        memcpy(&number, at, sizeof number);
        decoder->bad = !isfinite(number);
    }
    return decoder->bad ? 0.0 : number;
}

const char *vshi_decode_text(vshi_decoder *decoder, bool line) {
    const uint64_t size = vshi_decode_count(decoder, UINT64_MAX);
    if (decoder->bad || size == NO_TEXT) {
        return NULL;
    }
    const char *text = vshi_decode_array(decoder, size, 1);
    if (text == NULL || memchr(text, '\0', (size_t)size) != text + size - 1) {
        decoder->bad = true;
        return NULL;
    }
    for (const char *c = text; line && *c != '\0'; ++c) {
        if ((unsigned char)*c < 0x20 || *c == 0x7f) {
            decoder->bad = true;
            return NULL;
        }
    }
    return text;
}

bool vshi_decoder_ends(const vshi_decoder *decoder) {
    return !decoder->bad && decoder->at == decoder->end;
}
