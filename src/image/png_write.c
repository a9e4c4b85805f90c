#include "image/png.h"

#include "base/memory.h"
#include "base/try.h"
#include "image/png_stream.h"

#include <stdlib.h>
#include <string.h>

typedef struct growing {
    unsigned char *bytes;
    size_t size, capacity;
} growing;

static bool put(void *user, const unsigned char *bytes, size_t size) {
    growing *file = user;
    if (size > file->capacity - file->size) {
        const size_t capacity = 2 * file->capacity + size + 4096;
        unsigned char *grown = realloc(file->bytes, capacity);
        if (grown == NULL) {
            return false;
        }
        file->bytes = grown;
        file->capacity = capacity;
    }
    memcpy(file->bytes + file->size, bytes, size);
    file->size += size;
    return true;
}

static bool encode(vshi_png_stream *stream, const vshi_png_source *source, unsigned char *row,
                   growing *file) {
    const vshi_png_header header = {
        .width = source->width, .height = source->height, .channels = source->channels, .bits = source->bits};
    if (!vshi_png_stream_begin(stream, &header, put, file)) {
        return false;
    }
    for (int32_t y = 0; y < source->height; ++y) {
        source->row(source->user, y, row);
        if (!vshi_png_stream_row(stream, row)) {
            return false;
        }
    }
    return vshi_png_stream_end(stream);
}

vsh_result vshi_png_encode(const vshi_png_source *source, const char *what, unsigned char **bytes,
                           size_t *size, vsh_error *error) {
    vshi_png_stream stream = {0};
    growing file = {0};
    unsigned char *row = NULL;
    vsh_result result;
    *bytes = NULL;
    *size = 0;
    VSHI_TRY_DONE(vshi_allocate((void **)&row, (size_t)source->width,
                                (size_t)(source->channels * source->bits / 8), what, error));
    if (!encode(&stream, source, row, &file)) {
        result = stream.memory ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what)
                               : vshi_fail(error, VSH_ERROR_LIMIT, "%s: %s", what, stream.message);
        goto done;
    }
    *bytes = file.bytes;
    *size = file.size;
    file.bytes = NULL;
done:
    vshi_png_stream_free(&stream);
    free(file.bytes);
    free(row);
    return result;
}
