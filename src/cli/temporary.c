#include "temporary.h"

#include "message.h"

#include <errno.h>
#include <string.h>

static int fail(const char *target) {
    cli_say("%s: cannot be written: %s", target, strerror(errno));
    return CLI_FILE;
}

int cli_temporary_begin(cli_temporary *t, const char *target) {
    *t = (cli_temporary){.target = target};
    vsh_error error;
    if (vshi_output_begin(&t->output, target, &error) != VSH_OK) {
        return cli_fail(&error);
    }
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
    /* what only a file that is made shows: a name too long, a file system that takes none, a folder without
     * room */
    cli_temporary t;
    const int code = cli_temporary_begin(&t, target);
    cli_temporary_abandon(&t);
    return code;
}

int cli_temporary_commit(cli_temporary *t) {
    if (fflush(t->file) != 0 || ferror(t->file)) {
        const int code = fail(t->target);
        cli_temporary_abandon(t);
        return code;
    }
    const bool closed = fclose(t->file) == 0;
    t->file = NULL;
    if (!closed) {
        const int code = fail(t->target);
        vshi_output_abandon(&t->output);
        return code;
    }
    vsh_error error;
    return vshi_output_commit(&t->output, &error) == VSH_OK ? CLI_OK : cli_fail(&error);
}

int cli_temporary_write(const char *target, const char *text) {
    cli_temporary t;
    const int code = cli_temporary_begin(&t, target);
    if (code != CLI_OK) {
        return code;
    }
    fputs(text, t.file); /* a failure stays with the file */
    return cli_temporary_commit(&t);
}
