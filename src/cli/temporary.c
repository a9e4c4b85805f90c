#include "temporary.h"

#include "message.h"

#include <dirent.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The folder of the path into folder[PATH_MAX]; links are followed, as the library follows them. Returns the
 * path's last part. */
static const char *split(const char *path, char *real, char *folder) {
    const char *at = realpath(path, real) != NULL ? real : path;
    const char *slash = strrchr(at, '/');
    if (slash == NULL) {
        snprintf(folder, PATH_MAX, ".");
        return at;
    }
    snprintf(folder, PATH_MAX, "%.*s", slash > at ? (int)(slash - at) : 1, at);
    return slash + 1;
}

void cli_temporary_remove(const char *target) {
    char real[PATH_MAX], folder[PATH_MAX], tag[32];
    split(target, real, folder);
    const int tag_length = snprintf(tag, sizeof tag, ".%ld", (long)getpid());
    DIR *listing = opendir(folder);
    if (listing == NULL) {
        return;
    }
    const struct dirent *entry;
    while ((entry = readdir(listing)) != NULL) {
        const char *at = entry->d_name[0] == '.' ? strstr(entry->d_name + 1, tag) : NULL;
        if (at != NULL) {
            at += tag_length;
            at += *at == '-' ? 1 + strspn(at + 1, "0123456789") : 0;
            if (strncmp(at, ".tmp", 4) == 0) {
                unlinkat(dirfd(listing), entry->d_name, 0);
            }
        }
    }
    closedir(listing);
}

static int fail(const char *target) {
    cli_say("%s: cannot be written: %s", target, strerror(errno));
    return CLI_FILE;
}

int cli_temporary_check(const char *target) {
    char real[PATH_MAX], folder[PATH_MAX];
    split(target, real, folder);
    struct stat status;
    if (stat(target, &status) == 0 && !S_ISREG(status.st_mode)) {
        cli_say("%s: cannot be written: it is no regular file", target);
        return CLI_FILE;
    }
    return access(folder, W_OK | X_OK) == 0 ? CLI_OK : fail(target);
}

int cli_temporary_begin(cli_temporary *t, const char *target) {
    char real[PATH_MAX], folder[PATH_MAX];
    const char *name = split(target, real, folder);
    *t = (cli_temporary){.target = target};
    snprintf(t->temporary, sizeof t->temporary, "%s/.%.200s.%ld.tmp", folder, name, (long)getpid());
    snprintf(t->final, sizeof t->final, "%s/%s", folder, name);
    t->file = fopen(t->temporary, "wbx");
    return t->file != NULL ? CLI_OK : fail(target);
}

void cli_temporary_abandon(cli_temporary *t) {
    if (t->file != NULL) {
        fclose(t->file);
        unlink(t->temporary);
        t->file = NULL;
    }
}

int cli_temporary_commit(cli_temporary *t) {
    const bool written = fflush(t->file) == 0 && !ferror(t->file);
    const int write_error = errno;
    const bool closed = fclose(t->file) == 0;
    t->file = NULL;
    struct stat old;
    if (written && closed && stat(t->final, &old) == 0 && chmod(t->temporary, old.st_mode & 0777) != 0) {
        errno = 0; /* some file systems have no modes */
    }
    if (!written || !closed || rename(t->temporary, t->final) != 0) {
        errno = written ? errno : write_error;
        const int code = fail(t->target);
        unlink(t->temporary);
        return code;
    }
    return CLI_OK;
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
