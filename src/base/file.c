#define _GNU_SOURCE /* getdents64 */
#include "base/file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *last_part(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

/* Finds the folder of the path, or "." if the path names none. The system opens no path over PATH_MAX. */
static void find_folder(const char *path, char folder[PATH_MAX]) {
    const int length = (int)(last_part(path) - path);
    snprintf(folder, PATH_MAX, "%.*s", length > 1 ? length - 1 : 1, length > 0 ? path : ".");
}

const char *vshi_path_ending(const char *path) {
    const char *name = last_part(path);
    const char *dot = strrchr(name, '.');
    return dot != NULL && dot != name ? dot + 1 : "";
}

/* --- temporary files beside their targets, and those that dead processes have left there */

enum {
    TEMPORARY_ROOM = 48,   /* bytes that the name adds to the target's: dots, process, number, "tmp" */
    MAX_TEMPORARIES = 1000 /* of one target and process at a time */
};

/* The parts of a temporary's name around the process and the number. */
typedef struct naming {
    const char *name; /* the target's last part */
    int folder_length, stem_length;
    const char *dot, *ending;
} naming;

static naming naming_of(const char *target) {
    naming n = {.name = last_part(target), .ending = vshi_path_ending(target)};
    n.folder_length = (int)(n.name - target);
    n.dot = n.ending[0] != '\0' ? "." : "";
    const size_t ending = strlen(n.ending);
    const size_t stem = ending > 0 ? (size_t)(n.ending - n.name) - 1 : strlen(n.name);
    const size_t room = ending + TEMPORARY_ROOM < NAME_MAX ? NAME_MAX - ending - TEMPORARY_ROOM : 0;
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

/* Creates ".NAME.PID.tmp.ENDING" beside the target (with a number where that name is taken), empty, and
 * returns its descriptor, or -1 with errno. `path` has room for the target and TEMPORARY_ROOM more. As
 * long as the descriptor is open, it holds a lock on the file that says that its process lives. */
static int create_temporary(const char *target, char *path, size_t capacity) {
    const naming n = naming_of(target);
    for (int number = 0; number < MAX_TEMPORARIES; ++number) {
        char tag[TEMPORARY_ROOM];
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

/* Removes temporaries of this target that a killed run left behind. A running process locks its own, and
 * other containers and most network file systems see the lock. Without locks, the process's number decides.
 * Files of other users, and those that cannot be opened, stay. */
static void clean_temporaries(const char *target) {
    const naming n = naming_of(target);
    char folder[PATH_MAX];
    find_folder(target, folder);
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
    char path[PATH_MAX], only[TEMPORARY_ROOM], numbered[TEMPORARY_ROOM];
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

/* --- files that appear whole or not at all */

static vsh_result check_target(const char *path, vsh_error *error) {
    struct stat status;
    if (stat(path, &status) != 0) {
        return errno == ENOENT
                   ? VSH_OK
                   : vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
    }
    if (S_ISDIR(status.st_mode)) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: it is a folder", path);
    }
    if (!S_ISREG(status.st_mode)) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: it is no regular file", path);
    }
    /* rename() would pass over a read-only file, which its owner meant to keep */
    if (access(path, W_OK) != 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
    }
    return VSH_OK;
}

vsh_result vshi_output_check(const char *path, vsh_error *error) {
    if (path == NULL || path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "output path: it is empty");
    }
    if (last_part(path)[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: it is a folder", path);
    }
    char folder[PATH_MAX];
    find_folder(path, folder);
    struct stat status;
    if (stat(folder, &status) != 0 || access(folder, W_OK | X_OK) != 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: its folder: %s", path,
                         strerror(errno));
    }
    return check_target(path, error);
}

vsh_result vshi_output_begin(vshi_output *output, const char *path, vsh_error *error) {
    *output = (vshi_output){NULL, NULL, 0};
    vsh_result result = vshi_output_check(path, error);
    if (result != VSH_OK) {
        return result;
    }
    struct stat old;
    const bool replaces = stat(path, &old) == 0;
    output->target = replaces ? realpath(path, NULL) : strdup(path);
    const size_t capacity = output->target != NULL ? strlen(output->target) + TEMPORARY_ROOM : 0;
    output->temporary = output->target != NULL ? malloc(capacity) : NULL;
    if (output->temporary == NULL) {
        free(output->target);
        output->target = NULL;
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    clean_temporaries(output->target);
    const int file = create_temporary(output->target, output->temporary, capacity);
    if (file < 0) {
        result = vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
        free(output->temporary);
        free(output->target);
        *output = (vshi_output){NULL, NULL, 0};
        return result;
    }
    if (replaces && fchmod(file, old.st_mode & 0777) != 0) {
        /* some file systems have no modes; the new file then has the usual ones */
        errno = 0;
    }
    output->held = file + 1;
    return VSH_OK;
}

/* Puts a file in its place, and syncs the folder, so that after a power cut the new name is there, and not
 * only the file's contents. What fails of the latter leaves the file in its place as it is: file systems
 * there are that cannot, and folders that may not be read. */
static vsh_result put_in_place(const char *temporary, const char *target, vsh_error *error) {
    char path[PATH_MAX];
    find_folder(target, path);
    const int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    const vsh_result result =
        rename(temporary, target) == 0
            ? VSH_OK
            : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be put in place: %s", target, strerror(errno));
    if (folder >= 0) {
        (void)fdatasync(folder);
        close(folder);
    }
    return result;
}

static vsh_result sync_file(const char *temporary, const char *target, vsh_error *error) {
    const int file = open(temporary, O_RDONLY | O_CLOEXEC);
    const bool flushed = file >= 0 && (fsync(file) == 0 || errno == EINVAL); /* the file system cannot sync */
    const int why = errno;
    const bool closed = file < 0 || close(file) == 0;
    return flushed && closed ? VSH_OK
                             : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", target,
                                         strerror(flushed ? errno : why));
}

/* Another name for what stands at a target, "" where nothing does or the file system has no such names. It
 * looks like a temporary file that a killed process has left, which the next run takes away. */
static vsh_result keep_old(const char *target, char **kept, vsh_error *error) {
    const size_t capacity = strlen(target) + TEMPORARY_ROOM;
    *kept = malloc(capacity);
    if (*kept == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", target);
    }
    (*kept)[0] = '\0';
    if (access(target, F_OK) != 0) {
        return VSH_OK;
    }
    const int file = create_temporary(target, *kept, capacity);
    if (file < 0) {
        (*kept)[0] = '\0';
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", target, strerror(errno));
    }
    close(file);
    unlink(*kept); /* the name was free; link() does not replace */
    if (link(target, *kept) != 0) {
        (*kept)[0] = '\0'; /* no hard links here, or none of folders */
    }
    return VSH_OK;
}

/* What was put in place goes again, and what stood there before comes back. */
static void take_back(const char *target, const char *kept) {
    if (kept[0] != '\0') {
        (void)!rename(kept, target);
    } else {
        unlink(target);
    }
}

vsh_result vshi_outputs_commit(vshi_output *const *outputs, size_t count, vsh_error *error) {
    char **kept = calloc(count + 1, sizeof *kept);
    vsh_result result =
        kept != NULL ? VSH_OK : vshi_fail(error, VSH_ERROR_MEMORY, "outputs: the system refused memory");
    size_t placed = 0;
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        result = sync_file(outputs[i]->temporary, outputs[i]->target, error);
    }
    for (size_t i = 0; i < count && count > 1 && result == VSH_OK; ++i) {
        result = keep_old(outputs[i]->target, &kept[i], error);
    }
    for (; placed < count && result == VSH_OK; placed += result == VSH_OK) {
        result = put_in_place(outputs[placed]->temporary, outputs[placed]->target, error);
    }
    for (size_t i = 0; kept != NULL && i < count; ++i) {
        if (i < placed && result != VSH_OK) {
            take_back(outputs[i]->target, kept[i]);
        } else if (kept[i] != NULL && kept[i][0] != '\0') {
            unlink(kept[i]);
        }
        if (i < placed) {
            free(outputs[i]->temporary);
            outputs[i]->temporary = NULL;
        }
        free(kept[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        vshi_output_abandon(outputs[i]);
    }
    free(kept);
    return result;
}

vsh_result vshi_output_commit(vshi_output *output, vsh_error *error) {
    return vshi_outputs_commit(&output, 1, error);
}

void vshi_output_abandon(vshi_output *output) {
    if (output->temporary != NULL) {
        unlink(output->temporary);
    }
    if (output->held > 0) {
        close(output->held - 1);
    }
    free(output->temporary);
    free(output->target);
    *output = (vshi_output){NULL, NULL, 0};
}

vshi_sink vshi_sink_open(const char *path) {
    vshi_sink sink = {open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666), 0};
    sink.error = sink.file < 0 ? errno : 0;
    return sink;
}

bool vshi_sink_write(vshi_sink *sink, const void *data, size_t size, uint64_t offset) {
    const char *bytes = data;
    while (sink->error == 0 && size > 0) {
        const ssize_t written = pwrite(sink->file, bytes, size, (off_t)offset);
        if (written > 0) {
            bytes += written;
            size -= (size_t)written;
            offset += (uint64_t)written;
        } else if (written == 0 || errno != EINTR) {
            sink->error = written == 0 ? ENOSPC : errno;
        }
    }
    return sink->error == 0;
}

int vshi_sink_close(vshi_sink *sink) {
    if (sink->file >= 0 && close(sink->file) != 0 && sink->error == 0) {
        sink->error = errno;
    }
    sink->file = -1;
    return sink->error;
}

/* --- opening a file that somebody else may have put there */

static vsh_result fail_input(const char *name, const char *why, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", name, why);
}

static vsh_result check_input(int file, const char *name, uint64_t most, uint64_t *size, vsh_error *error) {
    struct stat status;
    if (fstat(file, &status) != 0) {
        return fail_input(name, strerror(errno), error);
    }
    if (!S_ISREG(status.st_mode)) {
        return fail_input(name, S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file", error);
    }
    *size = (uint64_t)status.st_size;
    if (*size > most) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: is larger than the %" PRIu64 " bytes that such a file may have", name, most);
    }
    return VSH_OK;
}

vsh_result vshi_input_open(const char *path, const char *name, uint64_t most, FILE **file, uint64_t *size,
                           vsh_error *error) {
    *file = NULL;
    *size = 0;
    const int opened = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    if (opened < 0) {
        return fail_input(name, strerror(errno), error);
    }
    vsh_result result = check_input(opened, name, most, size, error);
    if (result == VSH_OK) {
        *file = fdopen(opened, "rb");
        result = *file != NULL ? VSH_OK
                               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
    }
    if (result != VSH_OK) {
        close(opened);
    }
    return result;
}

/* Cuts the last part off a whole path; "/" stays. */
static void cut_last(char *path) {
    char *slash = strrchr(path, '/');
    slash[slash == path ? 1 : 0] = '\0';
}

static bool lies_in(const char *folder, const char *path) {
    const size_t length = strlen(folder);
    return strncmp(path, folder, length) == 0 && (folder[length - 1] == '/' || path[length] == '/');
}

bool vshi_input_is_beside(const char *model, const char *path) {
    char file[PATH_MAX], folder[PATH_MAX];
    if (realpath(path, file) == NULL) {
        return errno == ENOENT;
    }
    if (realpath(model, folder) != NULL) {
        cut_last(folder);
        if (lies_in(folder, file)) {
            return true;
        }
    }
    char given[PATH_MAX];
    find_folder(model, given);
    return realpath(given, folder) != NULL && lies_in(folder, file);
}
