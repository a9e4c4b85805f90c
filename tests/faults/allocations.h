/* Allocations that fail: the linker's --wrap sends every malloc, calloc, realloc, aligned_alloc,
 * posix_memalign, strdup, strndup and free of our objects here, where the n-th may fail and what is not freed
 * is counted. What the libraries underneath take by themselves is not seen. */
#ifndef FAULTS_ALLOCATIONS_H
#define FAULTS_ALLOCATIONS_H

#include <stddef.h>
#include <stdint.h>

/* From now on the `first`-th allocation fails (from 1; 0: none) and, where `all` is not 0, every later one.
 * Begins counting anew. */
void faults_begin(uint64_t first, int all);

/* Ends it; the number of allocations since, and in *failed how many of them were refused. */
uint64_t faults_end(uint64_t *failed);

/* Blocks that were taken since the process began, and are not freed. */
uint64_t faults_live(void);

#endif
