#include "temporary.h"

#include "base/utf8.h"
#include "message.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static int fail(const char *target) {
    cli_say("%s: cannot be written: %s", target, strerror(errno));
    return CLI_FILE;
}

int cli_temporary_begin(cli_temporary *t, const char *target) {
    *t = (cli_temporary){.target = target};
    vsh_error error;
    CLI_TRY(cli_check(vshi_output_begin(&t->output, target, &error), &error));
    t->file = fopen(t->output.temporary, "wb");
    if (t->file == NULL) {
        const int code = fail(target);
        vshi_output_abandon(&t->output);
        return code;
    }
    return CLI_OK;
}

void cli_temporary_abandon(cli_temporary *t) {
    if (t->file != NULL) {
        fclose(t->file);
        vshi_output_abandon(&t->output);
        t->file = NULL;
    }
}

int cli_temporary_check(const char *target) {
    /* Only a file that is made shows a name too long, a file system that takes none, a folder without room.
     */
    cli_temporary t;
    const int code = cli_temporary_begin(&t, target);
    cli_temporary_abandon(&t);
    return code;
}

int cli_temporary_commit(cli_temporary *t) {
    int code = fflush(t->file) == 0 && !ferror(t->file) ? CLI_OK : fail(t->target);
    if (fclose(t->file) != 0 && code == CLI_OK) {
        code = fail(t->target);
    }
    t->file = NULL;
    if (code != CLI_OK) {
        vshi_output_abandon(&t->output);
        return code;
    }
    vsh_error error;
    return cli_check(vshi_output_commit(&t->output, &error), &error);
}

int cli_temporary_write(const char *target, const char *text) {
    cli_temporary t;
    CLI_TRY(cli_temporary_begin(&t, target));
    fputs(text, t.file); /* a failure stays with the file */
    return cli_temporary_commit(&t);
}

/* --- text in files */

json_t *cli_number_json(double value) {
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *cli_utf8_json(const char *text) {
    if (text == NULL) {
        return json_null();
    }
    char *clean = malloc(3 * strlen(text) + 1);
    size_t used = 0;
    while (*text != '\0') {
        const size_t length = vshi_utf8_length(text);
        memcpy(clean + used, length > 0 ? text : VSHI_NO_CHARACTER, length > 0 ? length : 3);
        used += length > 0 ? length : 3;
        text += length > 0 ? length : 1;
    }
    json_t *json = json_stringn(clean, used);
    free(clean);
    return json;
}

void cli_escape(FILE *out, const char *text) {
    static const char specials[] = "<>&\"";
    static const char *const escapes[] = {"&lt;", "&gt;", "&amp;", "&quot;"};
    for (size_t length; *text != '\0'; text += length > 0 ? length : 1) {
        length = vshi_utf8_length(text);
        const char *special = strchr(specials, *text);
        if (special != NULL) {
            fputs(escapes[special - specials], out);
        } else if (length == 0) {
            fputs(VSHI_NO_CHARACTER, out);
        } else if (length == 1 && ((unsigned char)*text < 0x20 || *text == 0x7f)) {
            fputc('?', out); /* XML has no control characters */
        } else {
            fwrite(text, 1, length, out);
        }
    }
}
