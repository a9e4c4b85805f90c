#include "trade_png.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 255, STORED_MOST = 65535 };

/* A PNG grown byte by byte, turned into base64 on the way out. */
typedef struct writer {
    FILE *out;
    uint32_t crc;
    uint32_t held; /* of three bytes that wait for base64 */
    int holding;
} writer;

static void put_base64(writer *w, uint8_t byte) {
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    w->held = w->held << 8 | byte;
    if (++w->holding == 3) {
        for (int shift = 18; shift >= 0; shift -= 6) {
            fputc(letters[w->held >> shift & 63], w->out);
        }
        w->held = 0;
        w->holding = 0;
    }
}

static void end_base64(writer *w) {
    const int rest = w->holding;
    if (rest == 0) {
        return;
    }
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint32_t held = w->held << (8 * (3 - rest));
    for (int i = 0; i <= rest; ++i) {
        fputc(letters[held >> (18 - 6 * i) & 63], w->out);
    }
    fputs(rest == 1 ? "==" : "=", w->out);
}

static void put(writer *w, uint8_t byte) {
    w->crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
        w->crc = w->crc >> 1 ^ (0xedb88320u & (0u - (w->crc & 1u)));
    }
    put_base64(w, byte);
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
    writer w = {.out = out};
    for (size_t i = 0; i < sizeof signature; ++i) {
        put(&w, signature[i]);
    }
    const uint8_t header[13] = {0, 0, 0, (uint8_t)width, 0, 0, 0, (uint8_t)height, 8, 3, 0, 0, 0};
    put_chunk(&w, "IHDR", header, sizeof header);
    put_chunk(&w, "PLTE", &palette[0][0], 768);
    put_chunk(&w, "IDAT", bytes, store(width, height, pixels, bytes));
    put_chunk(&w, "IEND", bytes, 0);
    end_base64(&w);
    fputs("\">", out);
    free(bytes);
}
