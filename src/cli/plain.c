#define _GNU_SOURCE /* fopencookie */
#include "plain.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static bool is_control(unsigned char before, unsigned char c) {
    return (c < 0x20 && c != '\n') || c == 0x7f || (before == 0xc2 && c >= 0x80 && c < 0xa0);
}

void cli_plain(char *text, size_t size) {
    unsigned char before = 0;
    for (size_t i = 0; i < size; ++i) {
        const unsigned char c = (unsigned char)text[i];
        if (is_control(before, c)) {
            text[i] = '?';
            if (c >= 0x80) {
                text[i - 1] = '?';
            }
        }
        before = c;
    }
}

/* A cookie_write_function_t: all of it, or 0 with errno. What a piece begins with may belong to the one
 * before. */
static ssize_t write_plain(void *last, const char *text, size_t size) {
    unsigned char *before = last;
    for (size_t done = 0; done < size;) {
        char piece[4096];
        const size_t count = size - done < sizeof piece ? size - done : sizeof piece;
        memcpy(piece, text + done, count);
        if (is_control(*before, (unsigned char)piece[0])) {
            piece[0] = '?';
        }
        *before = (unsigned char)text[done + count - 1];
        cli_plain(piece, count);
        for (size_t written = 0; written < count;) {
            const ssize_t got = write(STDOUT_FILENO, piece + written, count - written);
            if (got < 0 && errno != EINTR) {
                return 0;
            }
            written += got > 0 ? (size_t)got : 0;
        }
        done += count;
    }
    return (ssize_t)size;
}

void cli_plain_output(void) {
    static unsigned char before;
    static bool is_plain;
    if (is_plain) {
        return;
    }
    FILE *plain = fopencookie(&before, "w", (cookie_io_functions_t){.write = write_plain});
    if (plain != NULL) {
        setvbuf(plain, NULL, isatty(STDOUT_FILENO) ? _IOLBF : _IOFBF, BUFSIZ);
        stdout = plain;
        is_plain = true;
    }
}
