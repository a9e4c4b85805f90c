#include "error.h"

#include <stdarg.h>
#include <stdio.h>

#define STRING_OF(x) #x
#define STRING(x) STRING_OF(x)

const char *vsh_version(void) {
    return STRING(VSH_VERSION_MAJOR) "." STRING(VSH_VERSION_MINOR) "." STRING(VSH_VERSION_PATCH);
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

vsh_result vshi_fail(vsh_error *error, vsh_result code, const char *format, ...) {
    if (error == NULL) {
        return code;
    }
    error->code = code;
    va_list arguments;
    va_start(arguments, format);
    const int written = vsnprintf(error->message, sizeof error->message, format, arguments);
    va_end(arguments);
    if (written < 0) {
        error->message[0] = '\0';
    }
    vshi_one_line(error->message);
    return code;
}

void vshi_one_line(char *text) {
    for (; *text != '\0'; ++text) {
        if ((unsigned char)*text < 0x20 || *text == 0x7f) {
            *text = '?';
        }
    }
}
