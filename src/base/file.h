/* Files that appear whole or not at all, and files that somebody else may have put there. */
#ifndef VSHI_FILE_H
#define VSHI_FILE_H

#include "base/error.h"

#include <stdbool.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A file under way: `temporary` stands in the target's folder, exists (empty) from the start and keeps the
 * target's ending, because writers choose a format by it. */
typedef struct vshi_output {
    char *target;    /* what commit puts in place; a link is followed */
    char *temporary; /* write here; NULL when nothing is under way */
    int held;        /* 1 + a descriptor that tells other processes that this one lives; 0: none */
} vshi_output;

/* Text after the last dot of the last part of the path, "exr"; "" where there is none. Points into `path`. */
VSHI_SHARED const char *vshi_path_ending(const char *path);

/* Whether vshi_output_begin() would succeed, without touching the disk. Errors: VSH_ERROR_ARGUMENT (empty
 * path), VSH_ERROR_WRITE (no such folder, not writable, a folder or device is in the way). Thread safe. */
vsh_result vshi_output_check(const char *path, vsh_error *error);

/* Takes a new temporary file for `path`, and removes those that killed processes have left for it. Same
 * errors, and VSH_ERROR_MEMORY. After success, end with commit or abandon. Thread safe, also for the same
 * path: the last commit stays. */
VSHI_SHARED vsh_result vshi_output_begin(vshi_output *output, const char *path, vsh_error *error);

/* Flushes the temporary to the disk and renames it over the target. A failure abandons. Errors:
 * VSH_ERROR_WRITE. */
VSHI_SHARED vsh_result vshi_output_commit(vshi_output *output, vsh_error *error);

/* The same of several, in their order: all of them, or after a failure none. (Where the file system has no
 * hard links, those before the one that failed are gone then, and do not come back.) Errors: as one,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_outputs_commit(vshi_output *const *outputs, size_t count, vsh_error *error);

/* Removes the temporary; the target is as it was. Does nothing where nothing is under way. */
VSHI_SHARED void vshi_output_abandon(vshi_output *output);

/* Removes the temporary files that this process holds open. Takes no memory and no lock. */
VSHI_SHARED void vshi_temporary_remove_own(void);

/* The bytes of a file under way, written at any place. For the libraries whose own writing hides failures, or
 * does worse after one: the first failure is kept, and what follows is left out. One thread at a time. */
typedef struct vshi_sink {
    int file;  /* descriptor, also readable; -1: not open */
    int error; /* errno of the first failure; 0: none */
} vshi_sink;

VSHI_SHARED vshi_sink vshi_sink_open(const char *path); /* empties the file; a failure shows in `error` */
VSHI_SHARED bool vshi_sink_write(vshi_sink *sink, const void *data, size_t size, uint64_t offset);
VSHI_SHARED int vshi_sink_close(vshi_sink *sink); /* returns `error`, with what closing came to */

/* --- reading */

/* Opens a regular file for reading, without waiting: a pipe waits for its writer, a device has no end. *size
 * is its bytes, at most `most`. Messages begin with `name`. Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT (larger
 * than `most`), VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_input_open(const char *path, const char *name, uint64_t most, FILE **file,
                                       uint64_t *size, vsh_error *error);

/* Whether `path`, a file that `model` names, is in the model's folder or below it. Links are followed. If the
 * model is a link, its target's folder counts too. True for a file that does not exist. */
VSHI_SHARED bool vshi_input_is_beside(const char *model, const char *path);

#ifdef __cplusplus
}
#endif
#endif
