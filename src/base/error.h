/* Filling the caller's error. */
#pragma once

#include <vdbshade/base.h>

#include <stddef.h>

/* Marks functions that modules of this library call. cmake/exports.map.in exports them under a private
 * version. */
#define VSHI_SHARED __attribute__((visibility("default")))

/* Whether this is a sanitized build. Such processes cannot be confined: their shadow memory takes terabytes
 * of address space, and their runtimes make forbidden system calls and read the memory through another
 * process. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VSHI_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define VSHI_SANITIZED 1
#endif
#endif
#ifndef VSHI_SANITIZED
#define VSHI_SANITIZED 0
#endif

VSH_BEGIN_C

/* The version of the headers that this file is compiled with: "0.2.0". */
#define VSHI_TEXT_OF(number) #number
#define VSHI_TEXT(number) VSHI_TEXT_OF(number)
#define VSHI_VERSION                                                                                         \
    VSHI_TEXT(VSH_VERSION_MAJOR) "." VSHI_TEXT(VSH_VERSION_MINOR) "." VSHI_TEXT(VSH_VERSION_PATCH)

/* Fills `error` (may be NULL) and returns `code`, so that a failing call can end in `return vshi_fail(…)`.
 * Control characters in the message (from file names, say) become '?', so that it stays one line. */
VSHI_SHARED vsh_result vshi_fail(vsh_error *error, vsh_result code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Fails with VSH_ERROR_MEMORY: the system refused memory for `what`. */
VSHI_SHARED vsh_result vshi_fail_memory(vsh_error *error, const char *what);

/* A number that must lie in a range. */
typedef struct vshi_range {
    const char *name;
    double value, low, high;
} vshi_range;

/* Errors: VSH_ERROR_ARGUMENT, naming the number, its value and its range. */
vsh_result vshi_check_ranges(const vshi_range *ranges, size_t count, vsh_error *error);

/* If a pointer is NULL, makes the public function around it fail with VSH_ERROR_ARGUMENT. */
#define VSHI_NEEDS(pointer)                                                                                  \
    do {                                                                                                     \
        if ((pointer) == NULL) {                                                                             \
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s is NULL", __func__, #pointer);               \
        }                                                                                                    \
    } while (0)

/* Does the same for two pointers. */
#define VSHI_NEEDS_BOTH(first, second)                                                                       \
    do {                                                                                                     \
        VSHI_NEEDS(first);                                                                                   \
        VSHI_NEEDS(second);                                                                                  \
    } while (0)

/* Does the same for the place of a result, and sets the result to NULL. */
#define VSHI_MAKES(place)                                                                                    \
    do {                                                                                                     \
        VSHI_NEEDS(place);                                                                                   \
        *(place) = NULL;                                                                                     \
    } while (0)

/* Does the same for an array, which may be NULL if `count` is 0. */
#define VSHI_NEEDS_OF(count, array)                                                                          \
    do {                                                                                                     \
        if ((count) > 0) {                                                                                   \
            VSHI_NEEDS(array);                                                                               \
        }                                                                                                    \
    } while (0)

/* Returns the result of a call, unless it is VSH_OK. */
#define VSHI_TRY(call)                                                                                       \
    do {                                                                                                     \
        const vsh_result tried = (call);                                                                     \
        if (tried != VSH_OK) {                                                                               \
            return tried;                                                                                    \
        }                                                                                                    \
    } while (0)

/* Keeps the result of a call in `result` and, unless it is VSH_OK, goes to the label `done`, where the
 * function frees its memory. */
#define VSHI_TRY_DONE(call)                                                                                  \
    do {                                                                                                     \
        result = (call);                                                                                     \
        if (result != VSH_OK) {                                                                              \
            goto done;                                                                                       \
        }                                                                                                    \
    } while (0)

/* Control characters, and bytes that are not UTF-8, become '?'. */
VSHI_SHARED void vshi_one_line(char *text);

VSH_END_C
