#include "document.h"

#include "message.h"
#include "signals.h"
#include "temporary.h"
#include "utf8.h"

#include <stdbool.h>
#include <stdlib.h>

int cli_document_write(const char *path, void (*compose)(FILE *out, const void *user), const void *user) {
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return cli_out_of_memory(path);
    }
    compose(out, user);
    const bool whole = !ferror(out);
    if (fclose(out) != 0 || !whole) {
        free(text);
        return cli_out_of_memory(path);
    }
    cli_signals_writing(path);
    const int code = cli_temporary_write(path, text);
    cli_signals_writing(NULL);
    free(text);
    return code;
}

void cli_document_escape(FILE *out, const char *text) {
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = cli_utf8_length(text);
        switch (*text) {
        case '<':
            fputs("&lt;", out);
            break;
        case '>':
            fputs("&gt;", out);
            break;
        case '&':
            fputs("&amp;", out);
            break;
        case '"':
            fputs("&quot;", out);
            break;
        default: /* control characters are none of XML's */
            if (length == 0) {
                fputs(CLI_NO_CHARACTER, out);
            } else if (length == 1 && ((unsigned char)*text < 0x20 || *text == 0x7f)) {
                fputc('?', out);
            } else {
                fwrite(text, 1, length, out);
            }
        }
    }
}
