/* What is made to fail by the linker's --wrap, and when. */
#ifndef FAULTS_FAULTS_H
#define FAULTS_FAULTS_H

#include <stddef.h>
#include <stdint.h>

/* --- Allocations that fail: the linker's --wrap sends every malloc, calloc, realloc, aligned_alloc,
 * posix_memalign, strdup, strndup and free of our objects here, where the n-th may fail and what is not freed
 * is counted. What the libraries underneath take by themselves is not seen. */

/* From now on the `first`-th allocation fails (from 1; 0: none) and, where `all` is not 0, every later one.
 * Begins counting anew. */
void faults_begin(uint64_t first, int all);

/* Ends it; the number of allocations since, and in *failed how many of them were refused. */
uint64_t faults_end(uint64_t *failed);

/* Blocks that were taken since the process began, and are not freed. */
uint64_t faults_live(void);

/* --- System calls of writing that fail: the linker's --wrap sends open, pwrite, fsync, close and rename of
 * our objects here. Counted are those of files that are being written. */

enum {
    WRITES_FAIL,  /* the n-th fails, as on a full disk */
    WRITES_SHORT, /* every pwrite writes but a part, every other is interrupted first: all must go well */
    WRITES_KILL   /* SIGKILL in place of the n-th */
};

/* From now on; n from 1, 0: none. */
void writes_begin(uint64_t n, int how);

/* The number of calls since; *what names the one that failed, NULL: none did. */
uint64_t writes_end(const char **what);

#endif
