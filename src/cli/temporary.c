#include "temporary.h"

#include "message.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NAME_KEPT = 200 /* bytes of a target's name in that of its temporary */ };

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

/* The process in ".STEM.PID.tmpREST" or ".STEM.PID-N.tmpREST", and *rest; 0: the name is none of these. */
static long process_of(const char *entry, const char *stem, size_t stem_length, const char **rest) {
    const char *at = entry + 1;
    if (entry[0] != '.' || strncmp(at, stem, stem_length) != 0 || at[stem_length] != '.') {
        return 0;
    }
    at += stem_length + 1;
    const size_t digits = strspn(at, "0123456789");
    const long process = digits > 0 && digits <= 10 ? strtol(at, NULL, 10) : 0;
    at += digits;
    at += *at == '-' ? 1 + strspn(at + 1, "0123456789") : 0;
    *rest = at + strlen(".tmp");
    return strncmp(at, ".tmp", strlen(".tmp")) == 0 ? process : 0;
}

/* The program's own names, ".out.csv.PID.tmp", and those of the library, ".out.PID.tmp.csv". */
static bool is_of_process(const char *entry, const char *name, long process) {
    const char *dot = strrchr(name, '.'), *rest;
    const size_t length = strnlen(name, NAME_KEPT);
    dot = dot != NULL && dot != name ? dot : name + strlen(name);
    const size_t stem = dot - name < NAME_KEPT ? (size_t)(dot - name) : NAME_KEPT;
    return (process_of(entry, name, length, &rest) == process && *rest == '\0') ||
           (process_of(entry, name, stem, &rest) == process && strcmp(rest, dot) == 0);
}

void cli_temporary_remove(const char *target) {
    char real[PATH_MAX], folder[PATH_MAX];
    const char *name = split(target, real, folder);
    DIR *listing = opendir(folder);
    if (listing == NULL) {
        return;
    }
    const struct dirent *entry;
    while ((entry = readdir(listing)) != NULL) {
        if (is_of_process(entry->d_name, name, (long)getpid())) {
            unlinkat(dirfd(listing), entry->d_name, 0);
        }
    }
    closedir(listing);
}

static bool is_dead(long process) {
    return kill((pid_t)process, 0) != 0 && errno == ESRCH;
}

/* Whether no process writes the file: as in the library, nobody holds its lock, or where there are no locks
 * its process is dead. */
static bool is_left(int file, long process) {
    return flock(file, LOCK_EX | LOCK_NB) == 0 ||
           (errno != EWOULDBLOCK && errno != EINTR && is_dead(process));
}

/* What a killed run has left of this target. */
static void clean(const char *folder, const char *name) {
    DIR *listing = opendir(folder);
    if (listing == NULL) {
        return;
    }
    const size_t length = strnlen(name, NAME_KEPT);
    const struct dirent *entry;
    while ((entry = readdir(listing)) != NULL) {
        const char *rest;
        const long process = process_of(entry->d_name, name, length, &rest);
        if (process == 0 || *rest != '\0') {
            continue;
        }
        const int file =
            openat(dirfd(listing), entry->d_name, O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
        struct stat status;
        if (file >= 0) {
            if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
                is_left(file, process)) {
                unlinkat(dirfd(listing), entry->d_name, 0);
            }
            close(file);
        }
    }
    closedir(listing);
}

static int fail(const char *target) {
    cli_say("%s: cannot be written: %s", target, strerror(errno));
    return CLI_FILE;
}

int cli_temporary_begin(cli_temporary *t, const char *target) {
    char real[PATH_MAX], folder[PATH_MAX];
    const char *name = split(target, real, folder);
    *t = (cli_temporary){.target = target};
    clean(folder, name);
    snprintf(t->temporary, sizeof t->temporary, "%s/.%.*s.%ld.tmp", folder, NAME_KEPT, name, (long)getpid());
    snprintf(t->final, sizeof t->final, "%s/%s", folder, name);
    t->file = fopen(t->temporary, "wbx");
    if (t->file == NULL) {
        return fail(target);
    }
    if (flock(fileno(t->file), LOCK_EX | LOCK_NB) != 0) {
        errno = 0; /* some file systems have no locks; the process's number then tells that it lives */
    }
    return CLI_OK;
}

void cli_temporary_abandon(cli_temporary *t) {
    if (t->file != NULL) {
        fclose(t->file);
        unlink(t->temporary);
        t->file = NULL;
    }
}

int cli_temporary_check(const char *target) {
    struct stat status;
    const bool there = stat(target, &status) == 0;
    if (!there && errno != ENOENT) { /* its name is too long, say, where that of its temporary is not */
        return fail(target);
    }
    if (there && !S_ISREG(status.st_mode)) {
        cli_say("%s: cannot be written: it is no regular file", target);
        return CLI_FILE;
    }
    /* what only a file that is made shows: a name too long, a file system that takes none, a folder without
     * room */
    cli_temporary t;
    const int code = cli_temporary_begin(&t, target);
    cli_temporary_abandon(&t);
    return code;
}

/* On the disk, where the file system can: else a power cut may leave the new name without its contents. */
static bool is_synced(FILE *file) {
    return fsync(fileno(file)) == 0 || errno == EINVAL;
}

/* And the name; as in the library, what fails here leaves the file as it is. */
static void sync_folder(const char *path) {
    char folder[2 * PATH_MAX];
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    const int file = open(folder[0] != '\0' ? folder : "/", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file >= 0) {
        (void)fdatasync(file);
        close(file);
    }
}

int cli_temporary_commit(cli_temporary *t) {
    const bool written = fflush(t->file) == 0 && !ferror(t->file) && is_synced(t->file);
    const int write_error = errno;
    const int held = dup(fileno(t->file)); /* with its lock, until the file is in its place */
    const bool closed = fclose(t->file) == 0;
    t->file = NULL;
    struct stat old;
    if (written && closed && stat(t->final, &old) == 0 && chmod(t->temporary, old.st_mode & 0777) != 0) {
        errno = 0; /* some file systems have no modes */
    }
    int code = CLI_OK;
    if (!written || !closed || rename(t->temporary, t->final) != 0) {
        errno = written ? errno : write_error;
        code = fail(t->target);
        unlink(t->temporary);
    }
    if (code == CLI_OK) {
        sync_folder(t->final);
    }
    if (held >= 0) {
        close(held);
    }
    return code;
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
