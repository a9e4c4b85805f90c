#include "base/input.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/part_file.h"
#include "base/part_sum.h"
#include "base/try.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>

enum { MOST_TOLD = 1 << 28, IN_MEMORY = 8, CHUNK = 1 << 20 }; /* bytes; of a byte in memory; read at once */

vsh_result vshi_part_damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: damaged: %s; bake this part again", path, what);
}

vsh_result vshi_part_read_bytes(FILE *file, const char *path, void *bytes, size_t size, vsh_error *error) {
    return size == 0 || fread(bytes, size, 1, file) == 1
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path,
                           ferror(file) ? strerror(errno) : "it ends early");
}

/* Whether the front is one of ours, and its sizes are those of the file. */
static vsh_result check_front(const char *path, const vshi_part_front *front, uint64_t size,
                              vsh_error *error) {
    if (memcmp(front->magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", path);
    }
    if (memcmp(front->magic, VSHI_PART_MAGIC, sizeof front->magic) != 0 || front->order != VSHI_PART_ORDER) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of another version of vdbshade, or of another kind of machine; bake this "
                         "part again",
                         path);
    }
    const uint64_t rest = size - sizeof *front - sizeof(uint64_t);
    return front->head_bytes <= rest && front->head_bytes % 8 == 0 && rest % 4 == 0
               ? VSH_OK
               : vshi_part_damaged(path, "it has not the size that it tells", error);
}

/* Reads `size` bytes into memory of its own. */
static vsh_result take(vshi_part_input *part, uint64_t size, const vsh_run *run, vshi_part_code *code,
                       vsh_error *error) {
    *code = (vshi_part_code){.reads = true};
    if (size > MOST_TOLD) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: tells %" PRIu64 " bytes of itself, at most %d",
                         part->path, size, MOST_TOLD);
    }
    VSHI_TRY(vshi_check_limit(run, IN_MEMORY * (double)size, part->path, error));
    VSHI_TRY(vshi_allocate((void **)&code->bytes, (size_t)size + 1, 1, part->path, error));
    code->room = (size_t)size;
    VSHI_TRY(vshi_part_read_bytes(part->file, part->path, code->bytes, (size_t)size, error));
    part->sum = vshi_part_sum(part->sum, code->bytes, (size_t)size);
    return VSH_OK;
}

/* What is too short for a part. */
static vsh_result refuse_short(vshi_part_input *part, vsh_error *error) {
    char magic[sizeof part->front.magic] = "";
    const size_t count = fread(magic, 1, sizeof magic, part->file);
    const size_t begin = strlen(VSHI_PART_MAGIC_BEGIN);
    return count >= begin && memcmp(magic, VSHI_PART_MAGIC_BEGIN, begin) == 0
               ? vshi_part_damaged(part->path, "it ends early", error)
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", part->path);
}

vsh_result vshi_part_input_open(const char *path, const vsh_run *run, vshi_part_input *part,
                                vshi_part_about *about, vsh_error *error) {
    *part = (vshi_part_input){.path = path, .sum = VSHI_PART_SUM};
    *about = (vshi_part_about){.version = NULL};
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX / 2, &part->file, &size, error));
    if (size < sizeof part->front + sizeof(uint64_t)) {
        return refuse_short(part, error);
    }
    VSHI_TRY(vshi_part_read_bytes(part->file, path, &part->front, sizeof part->front, error));
    VSHI_TRY(check_front(path, &part->front, size, error));
    part->body_bytes = size - sizeof part->front - part->front.head_bytes - sizeof(uint64_t);
    part->sum = vshi_part_sum(part->sum, &part->front, sizeof part->front);
    VSHI_TRY(take(part, part->front.head_bytes, run, &part->head, error));
    vshi_part_about_code(&part->head, about);
    if (part->head.failed) {
        return vshi_part_damaged(path, "its head", error);
    }
    return about->shard_count >= 1 && about->shard >= 1 && about->shard <= about->shard_count
               ? VSH_OK
               : vshi_part_damaged(path, "its number", error);
}

vsh_result vshi_part_input_end_head(const vshi_part_input *part, vsh_error *error) {
    return !part->head.failed && part->head.room - part->head.size < 8
               ? VSH_OK
               : vshi_part_damaged(part->path, "its head", error);
}

vsh_result vshi_part_input_check_body(vshi_part_input *part, const vsh_run *run, vsh_error *error) {
    const uint64_t bytes = part->body_bytes;
    unsigned char *chunk = NULL;
    uint64_t told;
    vshi_job *job = vshi_job_begin(run, "parts", (size_t)(bytes / CHUNK) + 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", part->path);
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&chunk, CHUNK, 1, part->path, error));
    for (uint64_t left = bytes; left > 0;) {
        const size_t size = left < CHUNK ? (size_t)left : CHUNK;
        VSHI_TRY_DONE(vshi_part_read_bytes(part->file, part->path, chunk, size, error));
        part->sum = vshi_part_sum(part->sum, chunk, size);
        left -= size;
        VSHI_TRY_DONE(vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    VSHI_TRY_DONE(vshi_part_read_bytes(part->file, part->path, &told, sizeof told, error));
    result = told == part->sum ? VSH_OK : vshi_part_damaged(part->path, "its checksum does not match", error);
done:
    free(chunk);
    vshi_job_end(job);
    return result;
}

void vshi_part_input_close(vshi_part_input *part) {
    if (part->file != NULL) {
        fclose(part->file);
        part->file = NULL;
    }
    free(part->head.bytes);
    part->head.bytes = NULL;
}

vsh_result vshi_part_reopen(const char *path, uint64_t at, FILE **file, vsh_error *error) {
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX / 2, file, &size, error));
    if (fseeko(*file, (off_t)at, SEEK_SET) == 0) {
        return VSH_OK;
    }
    const int why = errno;
    fclose(*file);
    *file = NULL;
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, strerror(why));
}
