/* Sizes computed with overflow checks, allocation behind them, and the memory limit. */
#pragma once

#include "base/error.h"

#include <stdbool.h>
#include <string.h>

VSH_BEGIN_C

/* Allocates count × size bytes, zeroed and aligned to 64, or NULL if count is 0. Free with free(). Errors:
 * VSH_ERROR_MEMORY, naming `what`. */
vsh_result vshi_allocate(void **memory, size_t count, size_t size, const char *what, vsh_error *error);

/* Allocates `count` elements of the type that a pointer points to, as vshi_allocate(). */
#define VSHI_ALLOCATE(pointer, count, what, error)                                                           \
    vshi_allocate((void **)&(pointer), (count), sizeof *(pointer), (what), (error))

/* Copies a text into new memory. Errors: VSH_ERROR_MEMORY, naming `what`. */
vsh_result vshi_copy_text(char **copy, const char *text, const char *what, vsh_error *error);

/* An array to allocate. VSHI_ALLOCATE_ALL(arrays, what, error) calls vshi_allocate() for each array of a
 * list, up to the first failure. The caller frees them. */
typedef struct vshi_array {
    void **memory;
    size_t count, size;
} vshi_array;
vsh_result vshi_allocate_all(const vshi_array *arrays, size_t count, const char *what, vsh_error *error);
#define VSHI_ARRAY(pointer, count)                                                                           \
    { (void **)&(pointer), (count), sizeof *(pointer) }
#define VSHI_ALLOCATE_ALL(arrays, what, error)                                                               \
    vshi_allocate_all(arrays, sizeof(arrays) / sizeof *(arrays), what, error)

/* Allocates all arrays in one block: free() the first one only. After a failure all pointers are NULL. */
vsh_result vshi_allocate_block(const vshi_array *arrays, size_t count, const char *what, vsh_error *error);
#define VSHI_ALLOCATE_BLOCK(arrays, what, error)                                                             \
    vshi_allocate_block(arrays, sizeof(arrays) / sizeof *(arrays), what, error)

/* Makes room for one more in an array of `count` elements of `size` bytes: doubles it if it is full. Errors:
 * VSH_ERROR_MEMORY, naming `what`; the array then stays. */
vsh_result vshi_make_room(void **array, size_t count, size_t *capacity, size_t size, const char *what,
                          vsh_error *error);

/* Fails with VSH_ERROR_LIMIT, naming `what`, if run->memory_held and `bytes` pass run->memory_limit. Bytes
 * are a double, so that estimates cannot overflow. `run` may be NULL. */
VSHI_SHARED vsh_result vshi_check_limit(const vsh_run *run, double bytes, const char *what, vsh_error *error);

/* Returns the peak of this process's resident memory, in bytes; 0 if the system does not tell. */
VSHI_SHARED uint64_t vshi_peak_bytes(void);

/* Returns the run's memory limit without run->memory_held, at least a byte; 0: there is no limit. */
uint64_t vshi_memory_left(const vsh_run *run);

/* Each program with base/guarded_malloc.c defines this: it ends the program after the system refused a block
 * of `bytes`. It must not allocate or lock. */
void vshi_memory_refused(size_t bytes) __attribute__((noreturn));

/* --- stores: arrays as large as a lightmap. An array lies in a file without a name if seven eighths of the
 * memory limit have no room for it. */

typedef struct vshi_stored {
    void *memory;
    size_t bytes;
    bool in_memory; /* not in a file */
} vshi_stored;

/* For one thread at a time. */
typedef struct vshi_store {
    const vsh_run *run; /* with the limit for arrays in memory; may be NULL */
    char *folder;       /* for files; NULL: no files */
    uint64_t held;      /* bytes in memory */
    vshi_stored *list;  /* [count] */
    size_t count;
} vshi_store;

/* Allocates count × size bytes, zeroed; NULL if count is 0. Errors: VSH_ERROR_LIMIT (no room and no folder),
 * VSH_ERROR_MEMORY, VSH_ERROR_WRITE (no room in the folder), naming `what`. */
vsh_result vshi_store_take(vshi_store *store, void **memory, size_t count, size_t size, const char *what,
                           vsh_error *error);

/* Frees one array. NULL does nothing. */
void vshi_store_give(vshi_store *store, void *memory);

/* Frees all arrays. */
void vshi_store_close(vshi_store *store);

/* Makes operator new end the process with this exit code if memory is refused, before a library does worse.
 */
void vshi_exit_if_new_fails(int code);

VSH_END_C
