/* Calls that a test expects to succeed, or to fail with a code and a message. */
#ifndef TESTS_EXPECT_H
#define TESTS_EXPECT_H

#include "tests.h"

#include <string.h>
#include <vdbshade/base.h>

/* Pass &failure to the calls given to expect_ok() and expect_error(). */
static vsh_error failure;

static inline void expect_code(vsh_result result, vsh_result code, const char *part, const char *call,
                               const char *file, int line) {
    if (result != code || (code != VSH_OK && strstr(failure.message, part) == NULL)) {
        print_error("%s: %s '%s', expected %s '%s'\n", call, vsh_result_name(result), failure.message,
                    vsh_result_name(code), part);
        _fail(file, line);
    }
}

#define expect_ok(call) expect_code(call, VSH_OK, "", #call, __FILE__, __LINE__)

/* `part` is a part of the message; "" if any will do. */
#define expect_error(call, code, part) expect_code(call, code, part, #call, __FILE__, __LINE__)

#endif
