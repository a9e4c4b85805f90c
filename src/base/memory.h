/* Sizes computed with overflow checks, allocation behind them, and the memory limit. */
#ifndef VSHI_MEMORY_H
#define VSHI_MEMORY_H

#include "base/error.h"

#include <stdbool.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* count × size bytes, zeroed and aligned to 64, into *memory; NULL where count is 0. Free with free().
 * Errors: VSH_ERROR_MEMORY, naming `what`. */
vsh_result vshi_allocate(void **memory, size_t count, size_t size, const char *what, vsh_error *error);

/* An array to be allocated. VSHI_ALLOCATE_ALL(arrays, what, error) allocates a list of them, as
 * vshi_allocate() does each, up to the first that the system refuses. The caller frees them. */
typedef struct vshi_array {
    void **memory;
    size_t count, size;
} vshi_array;
vsh_result vshi_allocate_all(const vshi_array *arrays, size_t count, const char *what, vsh_error *error);
#define VSHI_ARRAY(pointer, count)                                                                           \
    { (void **)&(pointer), (count), sizeof *(pointer) }
#define VSHI_ALLOCATE_ALL(arrays, what, error)                                                               \
    vshi_allocate_all(arrays, sizeof(arrays) / sizeof *(arrays), what, error)

/* Gives an array of `count` elements of `size` bytes room for one more: doubles it where it is full. Errors:
 * VSH_ERROR_MEMORY, naming `what`; the array is then as it was. */
vsh_result vshi_make_room(void **array, size_t count, size_t *capacity, size_t size, const char *what,
                          vsh_error *error);

/* As many bytes, not zeroed, in pages as large as the system has them where that pays: for arrays that are
 * written at once. Free with free(). Errors: VSH_ERROR_MEMORY, naming `what`. */
vsh_result vshi_take_pages(void **memory, size_t bytes, const char *what, vsh_error *error);

/* VSH_ERROR_LIMIT, naming `what`, where `bytes` (a double, so that estimates cannot overflow) pass
 * run->memory_limit together with run->memory_held. `run` may be NULL. */
VSHI_SHARED vsh_result vshi_check_limit(const vsh_run *run, double bytes, const char *what, vsh_error *error);

/* The most bytes that this process has had in memory so far; 0 where the system does not tell. */
VSHI_SHARED uint64_t vshi_peak_bytes(void);

/* What run->memory_held leaves of its limit, at least a byte; 0: there is no limit. */
uint64_t vshi_memory_left(const vsh_run *run);

/* Ends a program that base/guarded_malloc.c is linked into, after a block of `bytes` was refused. Each of
 * those programs defines it. It takes no memory and no lock. */
void vshi_memory_refused(size_t bytes) __attribute__((noreturn));

#ifdef __cplusplus
}
#endif
#endif
