/* Arrays of a GLB that are as a model has them stay in the file: the reader tells where, and its caller reads
 * them from there into memory of its own, and only then looks at them. One copy, where a reader's own arrays
 * are written into its answer and that is mapped. What lies in the file may change at any time, what has been
 * read of it may not. */
#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"
#include "model/model.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ALIGNED = 64 };

bool vshi_file_identity(int file, uint64_t identity[VSHI_FILE_IDENTITY]) {
    struct stat status;
    if (fstat(file, &status) != 0) {
        return false;
    }
    identity[0] = (uint64_t)status.st_dev;
    identity[1] = (uint64_t)status.st_ino;
    identity[2] = (uint64_t)status.st_size;
    identity[3] = (uint64_t)status.st_mtim.tv_sec;
    identity[4] = (uint64_t)status.st_mtim.tv_nsec;
    return true;
}

/* --- the reader */

static uint64_t rounded(uint64_t bytes) {
    return (bytes + ALIGNED - 1) / ALIGNED * ALIGNED;
}

uint64_t vshi_raw_bytes(const vsh_model *model) {
    uint64_t sum = 0;
    for (size_t i = 0; i < model->shape_count; ++i) {
        const vshi_model_shape *shape = &model->shapes[i];
        if (shape->raw == NULL || shape->triangle_count == 0) {
            continue;
        }
        const uint64_t vectors = rounded(shape->vertex_count * sizeof(float[3]));
        sum += rounded(shape->triangle_count * sizeof(uint32_t[3]));
        sum += shape->normals != NULL ? 2 * vectors : vectors;
        for (int set = 0; set < shape->uv_sets; ++set) {
            sum += shape->uvs[set] != NULL ? rounded(shape->vertex_count * sizeof(float[2])) : 0;
        }
    }
    return sum;
}

static void put_place(vshi_encoder *encoder, const vshi_model_file *file, const void *array) {
    vshi_encode_count(encoder, array != NULL);
    if (array != NULL) {
        vshi_encode_count(encoder, (uint64_t)((const char *)array - (const char *)file->map));
    }
}

void vshi_raw_put(vshi_encoder *encoder, const vshi_model_file *file, const vshi_model_shape *shape) {
    vshi_encode_text(encoder, shape->raw);
    put_place(encoder, file, shape->positions);
    put_place(encoder, file, shape->indices);
    put_place(encoder, file, shape->normals);
    for (int set = 0; set < shape->uv_sets; ++set) {
        put_place(encoder, file, shape->uvs[set]);
    }
}

/* --- the caller */

static vsh_result fail_changed(const char *path, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: changed while it was read", path);
}

vsh_result vshi_raw_open(vshi_raw *raw, const uint64_t identity[VSHI_FILE_IDENTITY], uint64_t bytes,
                         size_t message, void **block, vsh_error *error) {
    enum { PLACE = 16 /* bytes of a message that tell where an array lies */ };
    /* vshi_model_finish() takes 5 bytes a vertex for a while, whose position alone is 12 */
    static const double beside = 1.0 + 5.0 / 12.0;
    uint64_t now[VSHI_FILE_IDENTITY];
    VSHI_TRY(vshi_input_open(raw->path, raw->path, SIZE_MAX / 2, &raw->file, &raw->size, error));
    if (!vshi_file_identity(fileno(raw->file), now) || memcmp(now, identity, sizeof now) != 0) {
        return fail_changed(raw->path, error);
    }
    if (bytes / (raw->size + ALIGNED) > message / PLACE) { /* each array is a part of the file */
        return vshi_answer_fail(raw->path, "what its arrays take", error);
    }
    VSHI_TRY(vshi_check_limit(raw->run, beside * (double)bytes, raw->path, error));
    VSHI_TRY(vshi_take_pages(block, (size_t)bytes, raw->path, error));
    raw->bytes = (size_t)bytes;
    raw->block = *block;
    return VSH_OK;
}

void vshi_raw_close(vshi_raw *raw) {
    if (raw->file != NULL) {
        fclose(raw->file);
        raw->file = NULL;
    }
}

static vsh_result read_array(vshi_raw *raw, unsigned char *to, size_t bytes, uint64_t offset,
                             vsh_error *error) {
    while (bytes > 0) {
        const ssize_t got = pread(fileno(raw->file), to, bytes, (off_t)offset);
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: %s", raw->path, strerror(errno));
        }
        if (got == 0) {
            return fail_changed(raw->path, error);
        }
        to += got;
        offset += (uint64_t)got;
        bytes -= (size_t)got;
    }
    return VSH_OK;
}

/* count × size bytes into *array, which stays NULL where there are none. */
static vsh_result take_array(vshi_raw *raw, vshi_decoder *decoder, size_t count, size_t size, void *array,
                             vsh_error *error) {
    if (vshi_decode_count(decoder, 1) == 0) {
        return VSH_OK;
    }
    const uint64_t offset = vshi_decode_count(decoder, raw->size);
    size_t bytes;
    if (decoder->bad || __builtin_mul_overflow(count, size, &bytes) || bytes > raw->size - offset ||
        bytes > raw->bytes - raw->used) {
        return vshi_answer_fail(raw->path, "where an array lies in it", error);
    }
    unsigned char *at = raw->block + raw->used;
    const uint64_t more = rounded(bytes);
    raw->used = more < raw->bytes - raw->used ? raw->used + (size_t)more : raw->bytes;
    memcpy(array, &at, sizeof at);
    return read_array(raw, at, bytes, offset, error);
}

vsh_result vshi_raw_take(vshi_raw *raw, vshi_decoder *decoder, vshi_model_shape *shape, vsh_error *error) {
    const char *where = vshi_decode_text(decoder, true);
    const size_t count = shape->vertex_count;
    if (where == NULL || raw->block == NULL) {
        return vshi_answer_fail(raw->path, "what lies in it", error);
    }
    VSHI_TRY(take_array(raw, decoder, count, sizeof(float[3]), &shape->positions, error));
    VSHI_TRY(take_array(raw, decoder, shape->triangle_count, sizeof(uint32_t[3]), &shape->indices, error));
    VSHI_TRY(take_array(raw, decoder, count, sizeof(float[3]), &shape->normals, error));
    for (int32_t set = 0; set < shape->uv_sets; ++set) {
        VSHI_TRY(take_array(raw, decoder, count, sizeof(float[2]), &shape->uvs[set], error));
    }
    if (decoder->bad || shape->positions == NULL || shape->indices == NULL || count == 0) {
        return vshi_answer_fail(raw->path, "what lies in it", error);
    }
    return vshi_model_finish(raw->path, raw->run, where, shape, error);
}
