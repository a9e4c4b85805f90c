/* VSHI_TRY and VSHI_TRY_DONE (base/try.h) of calls that return the program's exit code. */
#ifndef CLI_TRY_H
#define CLI_TRY_H

#include "cli/message.h"

/* Returns what a call came to, unless that is CLI_OK. */
#define CLI_TRY(call)                                                                                        \
    do {                                                                                                     \
        const int tried = (call);                                                                            \
        if (tried != CLI_OK) {                                                                               \
            return tried;                                                                                    \
        }                                                                                                    \
    } while (0)

/* Puts what a call came to into `code` and, unless that is CLI_OK, goes to the label `done`. */
#define CLI_TRY_DONE(call)                                                                                   \
    do {                                                                                                     \
        code = (call);                                                                                       \
        if (code != CLI_OK) {                                                                                \
            goto done;                                                                                       \
        }                                                                                                    \
    } while (0)

#endif
