/* The temporary folder of a run of regress, and those that killed runs have left. */
#include "cli/message.h"
#include "regress.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ATTEMPTS = 16 };

static const char prefix[] = "vdbshade-regress-", unique[] = "XXXXXX";

/* A folder, itself and no link to one, or -1. */
static int open_folder(int parent, const char *name) {
    return openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

/* Takes the files of a folder away, which has no folders in it. */
static void empty(int folder) {
    const int own = dup(folder); /* closedir() closes it */
    DIR *listing = own >= 0 ? fdopendir(own) : NULL;
    if (listing == NULL) {
        if (own >= 0) {
            close(own);
        }
        return;
    }
    rewinddir(listing);
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            unlinkat(folder, entry->d_name, 0);
        }
    }
    closedir(listing);
}

/* What killed runs have left: folders of this name, this user's and no one else's, whose lock nobody holds.
 */
static void clean(const char *place) {
    DIR *listing = opendir(place);
    if (listing == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        if (strncmp(entry->d_name, prefix, sizeof prefix - 1) != 0 ||
            strlen(entry->d_name) != sizeof prefix - 1 + sizeof unique - 1) {
            continue;
        }
        const int folder = open_folder(dirfd(listing), entry->d_name);
        struct stat status;
        if (folder >= 0 && fstat(folder, &status) == 0 && status.st_uid == geteuid() &&
            (status.st_mode & 0777) == 0700 && flock(folder, LOCK_EX | LOCK_NB) == 0) {
            empty(folder);
            unlinkat(dirfd(listing), entry->d_name, AT_REMOVEDIR);
        }
        if (folder >= 0) {
            close(folder);
        }
    }
    closedir(listing);
}

/* Whether the folder is ours and there: another run that cleans may have come between its making and its
 * lock. */
static bool hold(int folder, const char *path) {
    struct stat held, there;
    const bool locked =
        flock(folder, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK; /* some file systems have none */
    return locked && fstat(folder, &held) == 0 && stat(path, &there) == 0 && held.st_dev == there.st_dev &&
           held.st_ino == there.st_ino;
}

int regress_folder_make(int *held, char **path) {
    const char *place = getenv("TMPDIR");
    place = place != NULL && place[0] == '/' ? place : "/tmp";
    clean(place);
    char name[sizeof prefix + sizeof unique];
    for (int i = 0; i < ATTEMPTS; ++i) {
        snprintf(name, sizeof name, "%s%s", prefix, unique);
        free(*path);
        *path = regress_path(place, name);
        if (*path == NULL) {
            return cli_out_of_memory("folder for new bakes");
        }
        if (mkdtemp(*path) == NULL) {
            break;
        }
        const int folder = open_folder(AT_FDCWD, *path);
        if (folder >= 0 && hold(folder, *path)) {
            *held = folder + 1;
            return CLI_OK;
        }
        if (folder >= 0) {
            close(folder);
        }
    }
    cli_say("folder for new bakes: %s: cannot be made: %s", place, strerror(errno));
    return CLI_FILE;
}

void regress_folder_remove(int *held, const char *path) {
    if (*held > 0) {
        empty(*held - 1);
        rmdir(path);
        close(*held - 1);
        *held = 0;
    }
}
