/* Calls that end the function, or go to its cleanup, where they fail. */
#ifndef VSHI_TRY_H
#define VSHI_TRY_H

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

#endif
