#define _GNU_SOURCE /* getdents64 */
#include "base/temporary.h"

#include "base/file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_TEMPORARIES = 1000 /* of one target and process at a time */ };

/* What the names of a target's temporaries begin and end with, around process and number. */
typedef struct naming {
    const char *name; /* the target's last part */
    int folder_length, stem_length;
    const char *dot, *ending;
} naming;

static naming naming_of(const char *target) {
    const char *slash = strrchr(target, '/');
    naming n = {.name = slash != NULL ? slash + 1 : target, .ending = vshi_path_ending(target)};
    n.folder_length = (int)(n.name - target);
    n.dot = n.ending[0] != '\0' ? "." : "";
    const size_t ending = strlen(n.ending);
    const size_t stem = ending > 0 ? (size_t)(n.ending - n.name) - 1 : strlen(n.name);
    const size_t room = ending + VSHI_TEMPORARY_ROOM < NAME_MAX ? NAME_MAX - ending - VSHI_TEMPORARY_ROOM : 0;
    n.stem_length = (int)(stem < room ? stem : room);
    return n;
}

/* Whether the lock is ours now. Where the file system has none, nobody else has it either. */
static bool lock(int file) {
    return flock(file, LOCK_EX | LOCK_NB) == 0 || (errno != EWOULDBLOCK && errno != EINTR);
}

/* Whether the path still leads to this file: one that was found without a lock may have been removed. */
static bool is_at(int file, const char *path) {
    struct stat held, there;
    return fstat(file, &held) == 0 && stat(path, &there) == 0 && held.st_dev == there.st_dev &&
           held.st_ino == there.st_ino;
}

int vshi_temporary_create(const char *target, char *path, size_t capacity) {
    const naming n = naming_of(target);
    for (int number = 0; number < MAX_TEMPORARIES; ++number) {
        char tag[VSHI_TEMPORARY_ROOM];
        if (number == 0) {
            snprintf(tag, sizeof tag, "%ld", (long)getpid());
        } else {
            snprintf(tag, sizeof tag, "%ld-%d", (long)getpid(), number);
        }
        snprintf(path, capacity, "%.*s.%.*s.%s.tmp%s%s", n.folder_length, target, n.stem_length, n.name, tag,
                 n.dot, n.ending);
        const int file = open(path, O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
        if (file < 0 && errno != EEXIST) {
            return -1;
        }
        if (file >= 0 && lock(file) && is_at(file, path)) {
            return file;
        }
        if (file >= 0) {
            close(file); /* another run is removing it */
        }
    }
    errno = EEXIST;
    return -1;
}

/* The process that a name tells of; 0: it is no temporary of this target. */
static long process_of(const naming *n, const char *entry) {
    if (entry[0] != '.' || strncmp(entry + 1, n->name, (size_t)n->stem_length) != 0 ||
        entry[1 + n->stem_length] != '.') {
        return 0;
    }
    const char *at = entry + 2 + n->stem_length;
    const size_t digits = strspn(at, "0123456789");
    if (digits == 0 || digits > 10) {
        return 0;
    }
    const long process = strtol(at, NULL, 10);
    at += digits;
    if (*at == '-') {
        const size_t number = strspn(at + 1, "0123456789");
        at += number > 0 ? 1 + number : 0;
    }
    const size_t tag = strlen(".tmp");
    if (strncmp(at, ".tmp", tag) != 0) {
        return 0;
    }
    at += tag;
    const size_t dot = strlen(n->dot);
    return strncmp(at, n->dot, dot) == 0 && strcmp(at + dot, n->ending) == 0 ? process : 0;
}

/* Whether nobody holds the file. The lock is kept until `file` is closed. */
static bool is_left(int file, long process) {
    if (flock(file, LOCK_EX | LOCK_NB) == 0) {
        return true;
    }
    return errno != EWOULDBLOCK && errno != EINTR && kill((pid_t)process, 0) != 0 && errno == ESRCH;
}

void vshi_temporary_clean(const char *target) {
    const naming n = naming_of(target);
    char folder[PATH_MAX];
    if (n.folder_length >= PATH_MAX) {
        return;
    }
    snprintf(folder, sizeof folder, "%.*s", n.folder_length > 0 ? n.folder_length : 1,
             n.folder_length > 0 ? target : ".");
    DIR *listing = opendir(folder);
    if (listing == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        const long process = process_of(&n, entry->d_name);
        if (process == 0) {
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

static void remove_open(int folder, const char *descriptor) {
    char path[PATH_MAX], only[VSHI_TEMPORARY_ROOM], numbered[VSHI_TEMPORARY_ROOM];
    const ssize_t size = readlinkat(folder, descriptor, path, sizeof path - 1);
    if (size <= 0) {
        return;
    }
    path[size] = '\0';
    snprintf(only, sizeof only, ".%ld.tmp", (long)getpid());
    snprintf(numbered, sizeof numbered, ".%ld-", (long)getpid());
    const char *slash = strrchr(path, '/');
    if (slash != NULL && slash[1] == '.' &&
        (strstr(slash, only) != NULL || (strstr(slash, numbered) != NULL && strstr(slash, ".tmp") != NULL))) {
        unlink(path);
    }
}

void vshi_temporary_remove_own(void) {
    const int folder = open("/proc/self/fd", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    _Alignas(struct dirent64) char entries[2048];
    for (ssize_t size; (size = getdents64(folder, entries, sizeof entries)) > 0;) {
        const struct dirent64 *entry;
        for (ssize_t at = 0; at < size; at += entry->d_reclen) {
            entry = (const void *)(entries + at);
            remove_open(folder, entry->d_name);
        }
    }
    close(folder);
}
