#include "base/error.h"

#include "base/utf8.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

enum {
    LONGEST = 3 * 4096, /* two paths and what is said of them; more is allocated */
    KEPT_BEFORE = 120   /* of what is too long: where the path begins; the rest is its end and the reason */
};

static const char left_out[] = "…";

/* Cuts in the middle, where paths are long: what is wrong stands at the end. No character is cut. */
static void shorten(char *message, size_t capacity, const char *full, size_t length) {
    size_t before = KEPT_BEFORE, after = length - (capacity - 1 - before - (sizeof left_out - 1));
    while (before > 0 && ((unsigned char)full[before] & 0xc0) == 0x80) {
        --before;
    }
    while (((unsigned char)full[after] & 0xc0) == 0x80) {
        ++after;
    }
    snprintf(message, capacity, "%.*s%s%s", (int)before, full, left_out, full + after);
}

vsh_result vshi_fail(vsh_error *error, vsh_result code, const char *format, ...) {
    if (error == NULL) {
        return code;
    }
    error->code = code;
    char few[LONGEST], *more = NULL;
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const int written = vsnprintf(few, sizeof few, format, arguments);
    size_t length = written < 0 ? 0 : (size_t)written;
    if (length >= sizeof few) {
        more = malloc(length + 1);
        length = more != NULL ? length : sizeof few - 1; /* the reason is lost then */
    }
    if (more != NULL) {
        vsnprintf(more, length + 1, format, again);
    }
    va_end(again);
    va_end(arguments);
    const char *full = more != NULL ? more : few;
    if (length < sizeof error->message) {
        memcpy(error->message, full, length);
        error->message[length] = '\0';
    } else {
        shorten(error->message, sizeof error->message, full, length);
    }
    free(more);
    vshi_one_line(error->message);
    return code;
}

void vshi_one_line(char *text) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        if (length == 0 || (unsigned char)*text < 0x20 || *text == 0x7f) {
            *text = '?';
        }
    }
}
