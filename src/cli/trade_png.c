#include "trade_png.h"

#include "base64.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 255, STORED_MOST = 65535 };

/* A PNG grown byte by byte, turned into base64 on the way out. */
typedef struct writer {
    cli_base64 to;
    uint32_t crc;
} writer;

static void put(writer *w, uint8_t byte) {
    w->crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
        w->crc = w->crc >> 1 ^ (0xedb88320u & (0u - (w->crc & 1u)));
    }
    cli_base64_put(&w->to, byte);
}

static void put_word(writer *w, uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) {
        put(w, (uint8_t)(word >> shift));
    }
}

static void put_chunk(writer *w, const char type[5], const uint8_t *bytes, size_t count) {
    put_word(w, (uint32_t)count);
    w->crc = 0xffffffffu;
    for (int i = 0; i < 4; ++i) {
        put(w, (uint8_t)type[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        put(w, bytes[i]);
    }
    put_word(w, ~w->crc);
}

/* zlib's format with one stored block a row: a header, filter 0 and the row, and the checksum of all. */
static size_t store(int width, int height, const uint8_t *pixels, uint8_t *bytes) {
    size_t at = 0;
    uint32_t a = 1, b = 0;
    bytes[at++] = 0x78;
    bytes[at++] = 0x01;
    for (int row = 0; row < height; ++row) {
        const uint32_t length = (uint32_t)width + 1;
        const uint8_t head[5] = {row + 1 == height, (uint8_t)length, (uint8_t)(length >> 8), (uint8_t)~length,
                                 (uint8_t)(~length >> 8)};
        memcpy(bytes + at, head, sizeof head);
        at += sizeof head;
        for (int i = 0; i <= width; ++i) {
            const uint8_t byte = i > 0 ? pixels[row * width + i - 1] : 0;
            bytes[at++] = byte;
            a = (a + byte) % 65521;
            b = (b + a) % 65521;
        }
    }
    for (int shift = 24; shift >= 0; shift -= 8) {
        bytes[at++] = (uint8_t)((b << 16 | a) >> shift);
    }
    return at;
}

void trade_png_write(FILE *out, int width, int height, const uint8_t *pixels, const uint8_t palette[256][3],
                     const char *alt) {
    static const uint8_t signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    uint8_t *bytes =
        width <= MOST && height <= MOST ? malloc((size_t)(width + 6) * (size_t)height + 16) : NULL;
    if (bytes == NULL) {
        return; /* the page does without */
    }
    fprintf(out, "<img alt=\"%s\" width=\"%d\" height=\"%d\" src=\"data:image/png;base64,", alt, width,
            height);
    writer w = {.to = {.out = out}};
    for (size_t i = 0; i < sizeof signature; ++i) {
        put(&w, signature[i]);
    }
    const uint8_t header[13] = {0, 0, 0, (uint8_t)width, 0, 0, 0, (uint8_t)height, 8, 3, 0, 0, 0};
    put_chunk(&w, "IHDR", header, sizeof header);
    put_chunk(&w, "PLTE", &palette[0][0], 768);
    put_chunk(&w, "IDAT", bytes, store(width, height, pixels, bytes));
    put_chunk(&w, "IEND", bytes, 0);
    cli_base64_end(&w.to);
    fputs("\">", out);
    free(bytes);
}
