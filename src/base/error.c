#include "base/error.h"

#include "base/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

const char *vsh_version(void) {
    return VSHI_VERSION;
}

static const char *const result_names[] = {
    [VSH_OK] = "VSH_OK",
    [VSH_ERROR_ARGUMENT] = "VSH_ERROR_ARGUMENT",
    [VSH_ERROR_INPUT] = "VSH_ERROR_INPUT",
    [VSH_ERROR_READ] = "VSH_ERROR_READ",
    [VSH_ERROR_WRITE] = "VSH_ERROR_WRITE",
    [VSH_ERROR_LIMIT] = "VSH_ERROR_LIMIT",
    [VSH_ERROR_MEMORY] = "VSH_ERROR_MEMORY",
    [VSH_ERROR_CANCELLED] = "VSH_ERROR_CANCELLED",
    [VSH_ERROR_UNSUPPORTED] = "VSH_ERROR_UNSUPPORTED",
    [VSH_ERROR_INTERNAL] = "VSH_ERROR_INTERNAL",
};

const char *vsh_result_name(vsh_result result) {
    const vsh_result count = (vsh_result)(sizeof result_names / sizeof result_names[0]);
    return result >= 0 && result < count ? result_names[result] : "VSH_ERROR_UNKNOWN";
}

/* Cuts the middle out of a message that is too long, because a path comes first and the reason last. Never
 * cuts a UTF-8 character in two. */
static void shorten(vsh_error *error, const char *full, size_t length) {
    static const char ellipsis[] = "…";
    size_t before = 120, after = length - (sizeof error->message - 1 - before - (sizeof ellipsis - 1));
    while (before > 0 && ((unsigned char)full[before] & 0xc0) == 0x80) {
        --before;
    }
    while (((unsigned char)full[after] & 0xc0) == 0x80) {
        ++after;
    }
    snprintf(error->message, sizeof error->message, "%.*s%s%s", (int)before, full, ellipsis, full + after);
}

vsh_result vshi_fail(vsh_error *error, vsh_result code, const char *format, ...) {
    if (error == NULL) {
        return code;
    }
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int length = vsnprintf(error->message, sizeof error->message, format, arguments);
    if (length >= (int)sizeof error->message) {
        char *full = malloc((size_t)length + 1);
        if (full != NULL) { /* else the message stays without its end */
            vsnprintf(full, (size_t)length + 1, format, again);
            shorten(error, full, (size_t)length);
        }
        free(full);
    }
    va_end(again);
    va_end(arguments);
    error->code = code;
    vshi_one_line(error->message);
    return code;
}

vsh_result vshi_fail_memory(vsh_error *error, const char *what) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
}

vsh_result vshi_check_ranges(const vshi_range *ranges, size_t count, vsh_error *error) {
    for (const vshi_range *r = ranges; r < ranges + count; ++r) {
        if (!(r->value >= r->low && r->value <= r->high)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s %g is out of range %g … %g", r->name, r->value,
                             r->low, r->high);
        }
    }
    return VSH_OK;
}

void vshi_one_line(char *text) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        if (length == 0 || (unsigned char)*text < 0x20 || *text == 0x7f) {
            *text = '?';
        }
    }
}
