/* Opening a file that somebody else may have put there. */
#ifndef VSHI_INPUT_H
#define VSHI_INPUT_H

#include "base/error.h"

#include <stdbool.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Opens a regular file for reading, without waiting: a pipe waits for its writer, a device has no end. *size
 * is its bytes, at most `most`. Messages begin with `name`. Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT (larger
 * than `most`), VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_input_open(const char *path, const char *name, uint64_t most, FILE **file,
                                       uint64_t *size, vsh_error *error);

/* Whether a file that `model` names lies in the model's folder or below, links followed; where the model is a
 * link, the folder of what it leads to is as good. A file that is not there lies nowhere else: true. */
VSHI_SHARED bool vshi_input_is_beside(const char *model, const char *path);

#ifdef __cplusplus
}
#endif
#endif
