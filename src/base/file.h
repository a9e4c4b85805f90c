/* Files: paths, outputs that appear whole or not at all, inputs of strangers, hashes. */
#pragma once

#include "base/job.h"

#include <limits.h>
#include <stdbool.h>
#include <stdio.h>
#include <vdbshade/base.h>

VSH_BEGIN_C

/* A file being written: `temporary` is in the target's folder, exists (empty) from the start and keeps the
 * target's ending, because writers choose a format by it. */
typedef struct vshi_output {
    char *target;    /* commit moves the temporary here; links are followed */
    char *temporary; /* write here; NULL: no file is being written */
    int held;        /* 1 + a descriptor that tells other processes that this one lives; 0: none */
} vshi_output;

/* Returns the path's last part. Points into `path`. */
VSHI_SHARED const char *vshi_path_name(const char *path);

/* Copies the folder of the path, "." if the path names none. The system opens no path over PATH_MAX. */
VSHI_SHARED void vshi_path_folder(const char *path, char folder[PATH_MAX]);

/* Returns the text after the last dot of the path's last part, "exr", or "". Points into `path`. */
VSHI_SHARED const char *vshi_path_ending(const char *path);

/* Returns the path of file `name`, of `size` bytes, in the folder of `path`, in new memory; NULL if memory is
 * short. */
char *vshi_path_beside(const char *path, const char *name, size_t size);

/* Checks whether vshi_output_begin() would succeed, without touching the disk. Errors: VSH_ERROR_ARGUMENT
 * (empty path), VSH_ERROR_WRITE (no such folder, not writable, a folder or device is in the way). Thread
 * safe. */
vsh_result vshi_output_check(const char *path, vsh_error *error);

/* Creates a temporary file for `path`, and removes leftovers of killed processes. Errors: as above, and
 * VSH_ERROR_MEMORY. After success, end with commit or abandon. Thread safe, also for the same path: the last
 * commit wins. */
VSHI_SHARED vsh_result vshi_output_begin(vshi_output *output, const char *path, vsh_error *error);

/* Flushes the temporary to the disk and renames it over the target. A failure abandons. Errors:
 * VSH_ERROR_WRITE. */
VSHI_SHARED vsh_result vshi_output_commit(vshi_output *output, vsh_error *error);

/* Commits several outputs in their order: all of them, or after a failure none. (If the file system has no
 * hard links, a failure removes the old files of those before it.) Errors: VSH_ERROR_WRITE, VSH_ERROR_MEMORY.
 */
VSHI_SHARED vsh_result vshi_outputs_commit(vshi_output *const *outputs, size_t count, vsh_error *error);

/* Removes the temporary, if there is one; the target stays. */
VSHI_SHARED void vshi_output_abandon(vshi_output *output);

/* Removes the temporary files that this process holds open. Takes no memory and no lock. */
VSHI_SHARED void vshi_temporary_remove_own(void);

/* Writes bytes of a file at any place, for libraries whose own writing hides failures or crashes after one. A
 * sink keeps the first failure and ignores later writes. One thread at a time. */
typedef struct vshi_sink {
    int file;  /* descriptor, also readable; -1: not open */
    int error; /* errno of the first failure; 0: none */
} vshi_sink;

VSHI_SHARED vshi_sink vshi_sink_open(const char *path); /* empties the file; a failure shows in `error` */
VSHI_SHARED bool vshi_sink_write(vshi_sink *sink, const void *data, size_t size, uint64_t offset);
VSHI_SHARED int vshi_sink_close(vshi_sink *sink); /* returns `error`, or why closing failed */

/* --- reading */

/* Opens a regular file for reading, and nothing else: a pipe waits for its writer, a device has no end. *size
 * is its bytes, at most `most`. Messages begin with `name`. Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT (larger
 * than `most`), VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_input_open(const char *path, const char *name, uint64_t most, FILE **file,
                                       uint64_t *size, vsh_error *error);

/* Returns whether `path`, a file that `model` names, is in the model's folder or below it. Links are
 * followed. If the model is a link, its target's folder counts too. True for a file that does not exist. */
VSHI_SHARED bool vshi_input_is_beside(const char *model, const char *path);

/* vsh_file_digest(), within a job. */
vsh_result vshi_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vshi_job *job, vsh_error *error);

VSH_END_C
