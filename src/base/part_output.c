#include "base/part_file.h"
#include "base/part_sum.h"
#include "base/try.h"

#include <errno.h>
#include <stdlib.h>

enum { ROUND = 8 }; /* bytes of a head, for the sum's words */

void vshi_part_output_put(vshi_part_output *part, const void *bytes, size_t size) {
    part->sum = vshi_part_sum(part->sum, bytes, size);
    if (size > 0 && fwrite(bytes, size, 1, part->file) != 1 && part->error == 0) {
        part->error = errno != 0 ? errno : EIO;
    }
}

static vsh_result begin(vshi_part_output *part, const char *path, vshi_part_code *head,
                        const vshi_part_front *front, vsh_error *error) {
    static char zeros[ROUND];
    const size_t more = front->head_bytes - head->size;
    vshi_part_code_bytes(head, zeros, more);
    if (head->failed) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    VSHI_TRY(vshi_output_begin(&part->output, path, error));
    part->file = fopen(part->output.temporary, "wb");
    if (part->file == NULL) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
    }
    vshi_part_output_put(part, front, sizeof *front);
    vshi_part_output_put(part, head->bytes, head->size);
    return VSH_OK;
}

vsh_result vshi_part_output_begin(vshi_part_output *part, const char *path, vshi_part_code *head,
                                  vsh_error *error) {
    *part = (vshi_part_output){.sum = VSHI_PART_SUM};
    const vshi_part_front front = {VSHI_PART_MAGIC, VSHI_PART_ORDER,
                                   (head->size + ROUND - 1) / ROUND * ROUND};
    const vsh_result result = begin(part, path, head, &front, error);
    free(head->bytes);
    *head = (vshi_part_code){.reads = false};
    if (result != VSH_OK) {
        vshi_part_output_abandon(part);
    }
    return result;
}

vsh_result vshi_part_output_finish(vshi_part_output *part, vsh_error *error) {
    const uint64_t sum = part->sum;
    vshi_part_output_put(part, &sum, sizeof sum);
    if (fclose(part->file) != 0 && part->error == 0) {
        part->error = errno;
    }
    part->file = NULL;
    if (part->error != 0) {
        vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", part->output.target,
                  strerror(part->error));
        vshi_part_output_abandon(part);
        return VSH_ERROR_WRITE;
    }
    return vshi_output_commit(&part->output, error);
}

void vshi_part_output_abandon(vshi_part_output *part) {
    if (part->file != NULL) {
        fclose(part->file);
        part->file = NULL;
    }
    vshi_output_abandon(&part->output);
}
