#include "sandbox/message.h"

#include <errno.h>
#include <malloc.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

enum { ALIGNED = 8 };
static const uint64_t NO_TEXT = UINT64_MAX;

void vshi_put_begin(vshi_put *put, int file, uint64_t offset) {
    put->file = file;
    put->error = 0;
    put->used = 0;
    put->size = offset;
    put->room = put->checked = 0;
}

enum { CHECK_EVERY = 1 << 20 }; /* bytes */

/* The resident memory that getrusage() tells is no less than that of whoever started this process. */
static bool has_room(vshi_put *put, uint64_t size) {
    if (put->room == 0 || size < put->checked + CHECK_EVERY) {
        return true;
    }
    put->checked = size;
    const struct mallinfo2 heap = mallinfo2();
    return heap.uordblks + heap.hblkhd + size <= put->room;
}

static void write_out(vshi_put *put, const unsigned char *bytes, size_t size, uint64_t offset) {
    if (put->error == 0 && !has_room(put, offset + size)) {
        put->error = ENOMEM;
    }
    while (put->error == 0 && size > 0) {
        const ssize_t written = pwrite(put->file, bytes, size, (off_t)offset);
        if (written > 0) {
            bytes += written;
            size -= (size_t)written;
            offset += (uint64_t)written;
        } else if (written == 0 || errno != EINTR) {
            put->error = written == 0 ? ENOSPC : errno;
        }
    }
}

bool vshi_put_flush(vshi_put *put) {
    write_out(put, put->buffer, put->used, put->size - put->used);
    put->used = 0;
    return put->error == 0;
}

static void put_bytes(vshi_put *put, const void *bytes, size_t size) {
    if (size > VSHI_PUT_ROOM - put->used) {
        vshi_put_flush(put);
    }
    if (size > VSHI_PUT_ROOM) {
        write_out(put, bytes, size, put->size);
    } else {
        memcpy(put->buffer + put->used, bytes, size);
        put->used += size;
    }
    put->size += size;
}

void vshi_put_array(vshi_put *put, const void *array, size_t count, size_t size) {
    static const unsigned char zeros[ALIGNED];
    const size_t bytes = count * size; /* of memory that is there */
    if (bytes > 0) {
        put_bytes(put, array, bytes);
        put_bytes(put, zeros, (ALIGNED - bytes % ALIGNED) % ALIGNED);
    }
}

void vshi_put_count(vshi_put *put, uint64_t count) {
    put_bytes(put, &count, sizeof count);
}

void vshi_put_number(vshi_put *put, double number) {
    put_bytes(put, &number, sizeof number);
}

void vshi_put_text(vshi_put *put, const char *text) {
    if (text == NULL) {
        vshi_put_count(put, NO_TEXT);
        return;
    }
    const size_t size = strlen(text) + 1;
    vshi_put_count(put, size);
    vshi_put_array(put, text, size, 1);
}

const void *vshi_take_array(vshi_take *take, uint64_t count, size_t size) {
    const size_t left = (size_t)(take->end - take->at);
    if (take->bad || count > left / size) {
        take->bad = true;
        return NULL;
    }
    const size_t bytes = (size_t)count * size, padding = (ALIGNED - bytes % ALIGNED) % ALIGNED;
    if (padding > left - bytes) {
        take->bad = true;
        return NULL;
    }
    const void *array = take->at;
    take->at += bytes + padding;
    return count > 0 ? array : NULL;
}

uint64_t vshi_take_count(vshi_take *take, uint64_t most) {
    uint64_t count = 0;
    const void *at = vshi_take_array(take, 1, sizeof count);
    if (at != NULL) {
        memcpy(&count, at, sizeof count);
        take->bad = count > most;
    }
    return take->bad ? 0 : count;
}

double vshi_take_number(vshi_take *take) {
    double number = 0.0;
    const void *at = vshi_take_array(take, 1, sizeof number);
    if (at != NULL) {
        memcpy(&number, at, sizeof number);
        take->bad = !isfinite(number);
    }
    return take->bad ? 0.0 : number;
}

const char *vshi_take_text(vshi_take *take, bool line) {
    const uint64_t size = vshi_take_count(take, UINT64_MAX);
    if (take->bad || size == NO_TEXT) {
        return NULL;
    }
    const char *text = vshi_take_array(take, size, 1);
    if (text == NULL || memchr(text, '\0', (size_t)size) != text + size - 1) {
        take->bad = true;
        return NULL;
    }
    for (const char *c = text; line && *c != '\0'; ++c) {
        if ((unsigned char)*c < 0x20 || *c == 0x7f) {
            take->bad = true;
            return NULL;
        }
    }
    return text;
}

bool vshi_take_ends(const vshi_take *take) {
    return !take->bad && take->at == take->end;
}
