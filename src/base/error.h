/* Filling the caller's error. */
#ifndef VSHI_ERROR_H
#define VSHI_ERROR_H

#include <vdbshade/base.h>

#include <stddef.h>

/* Marks what modules of this library call of it: exported under a version of its own (cmake/exports.map.in),
 * for nobody else. */
#define VSHI_SHARED __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* The header's version, which is that of whatever is compiled with it: "0.2.0". */
#define VSHI_TEXT_OF(number) #number
#define VSHI_TEXT(number) VSHI_TEXT_OF(number)
#define VSHI_VERSION                                                                                         \
    VSHI_TEXT(VSH_VERSION_MAJOR) "." VSHI_TEXT(VSH_VERSION_MINOR) "." VSHI_TEXT(VSH_VERSION_PATCH)

/* Fills `error` (may be NULL) and returns `code`, so that a failing call can end in `return vshi_fail(…)`.
 * Control characters in the message (from file names, say) become '?', so that it stays one line. */
VSHI_SHARED vsh_result vshi_fail(vsh_error *error, vsh_result code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Ends a function of the API, whose `error` it fills, where a pointer that it needs is NULL. */
#define VSHI_NEEDS(pointer)                                                                                  \
    do {                                                                                                     \
        if ((pointer) == NULL) {                                                                             \
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s is NULL", __func__, #pointer);               \
        }                                                                                                    \
    } while (0)

/* The same of an array of `count`, which may be NULL where that is 0. */
#define VSHI_NEEDS_OF(count, array)                                                                          \
    do {                                                                                                     \
        if ((count) > 0) {                                                                                   \
            VSHI_NEEDS(array);                                                                               \
        }                                                                                                    \
    } while (0)

/* Returns what a call came to, unless that is VSH_OK. */
#define VSHI_TRY(call)                                                                                       \
    do {                                                                                                     \
        const vsh_result tried = (call);                                                                     \
        if (tried != VSH_OK) {                                                                               \
            return tried;                                                                                    \
        }                                                                                                    \
    } while (0)

/* Puts what a call came to into `result` and, unless that is VSH_OK, goes to the label `done`, where a
 * function that owns something gives it back. */
#define VSHI_TRY_DONE(call)                                                                                  \
    do {                                                                                                     \
        result = (call);                                                                                     \
        if (result != VSH_OK) {                                                                              \
            goto done;                                                                                       \
        }                                                                                                    \
    } while (0)

/* Control characters, and bytes that are not UTF-8, become '?'. */
VSHI_SHARED void vshi_one_line(char *text);

#ifdef __cplusplus
}
#endif
#endif
