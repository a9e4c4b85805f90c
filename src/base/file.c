#define _GNU_SOURCE /* getdents64 */
#include "base/file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <nettle/sha2.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

const char *vshi_path_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

void vshi_path_folder(const char *path, char folder[PATH_MAX]) {
    const int length = (int)(vshi_path_name(path) - path);
    snprintf(folder, PATH_MAX, "%.*s", length > 1 ? length - 1 : 1, length > 0 ? path : ".");
}

const char *vshi_path_ending(const char *path) {
    const char *name = vshi_path_name(path);
    const char *dot = strrchr(name, '.');
    return dot != NULL && dot != name ? dot + 1 : "";
}

char *vshi_path_beside(const char *path, const char *name, size_t size) {
    const size_t folder = (size_t)(vshi_path_name(path) - path);
    char *text = malloc(folder + size + 1);
    if (text != NULL) {
        memcpy(text, path, folder);
        memcpy(text + folder, name, size);
        text[folder + size] = '\0';
    }
    return text;
}

/* --- temporary files beside their targets, and leftovers of dead processes */

enum {
    TEMPORARY_ROOM = 48,   /* bytes that a temporary's name adds to the target's */
    MAX_TEMPORARIES = 1000 /* of one target and process at a time */
};

/* Writes the name of a temporary of this target: ".NAME.PID.tmp.ENDING", or ".NAME.PID-NUMBER.tmp.ENDING".
 * NAME is cut so that the system accepts the length. Returns the length of ".NAME.". */
static size_t name_temporary(const char *target, long process, int number, char name[NAME_MAX + 1]) {
    const char *stem = vshi_path_name(target), *ending = vshi_path_ending(target);
    const size_t dot = ending[0] != '\0', ending_length = strlen(ending);
    const size_t room =
        ending_length + TEMPORARY_ROOM < NAME_MAX ? NAME_MAX - ending_length - TEMPORARY_ROOM : 0;
    const size_t whole = strlen(stem) - ending_length - dot, length = whole < room ? whole : room;
    char tag[16] = "";
    if (number > 0) {
        snprintf(tag, sizeof tag, "-%d", number);
    }
    snprintf(name, NAME_MAX + 1, ".%.*s.%ld%s.tmp%s%s", (int)length, stem, process, tag, dot > 0 ? "." : "",
             ending);
    return length + 2;
}

/* Returns whether this process may use the file: it got the lock, or the file system has no locks. */
static bool lock(int file) {
    return flock(file, LOCK_EX | LOCK_NB) == 0 || (errno != EWOULDBLOCK && errno != EINTR);
}

/* Returns whether the path still leads to this file. Another run may have removed it before it was locked. */
static bool is_at(int file, const char *path) {
    struct stat held, there;
    return fstat(file, &held) == 0 && stat(path, &there) == 0 && held.st_dev == there.st_dev &&
           held.st_ino == there.st_ino;
}

/* Creates an empty temporary beside the target and returns its descriptor, or -1 with errno. `path` has room
 * for the target and TEMPORARY_ROOM more. While the descriptor is open, its lock on the file tells other
 * processes that this one lives. */
static int create_temporary(const char *target, char *path, size_t capacity) {
    for (int number = 0; number < MAX_TEMPORARIES; ++number) {
        char name[NAME_MAX + 1];
        name_temporary(target, (long)getpid(), number, name);
        snprintf(path, capacity, "%.*s%s", (int)(vshi_path_name(target) - target), target, name);
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

/* Returns the process in the name of a temporary of this target; 0 for other names. */
static long find_process(const char *target, const char *entry) {
    char name[NAME_MAX + 1], *end;
    const size_t before = name_temporary(target, 0, 0, name);
    if (strncmp(entry, name, before) != 0) {
        return 0;
    }
    const long process = strtol(entry + before, &end, 10);
    const long number = *end == '-' ? strtol(end + 1, NULL, 10) : 0;
    name_temporary(target, process, (int)number, name);
    return process > 0 && strcmp(entry, name) == 0 ? process : 0;
}

/* Returns whether no process holds the file. Keeps the lock until `file` is closed. */
static bool is_leftover(int file, long process) {
    if (flock(file, LOCK_EX | LOCK_NB) == 0) {
        return true;
    }
    return errno != EWOULDBLOCK && errno != EINTR && kill((pid_t)process, 0) != 0 && errno == ESRCH;
}

/* Removes temporaries of this target that a killed run left behind. A running process locks its own, and
 * other containers and most network file systems see the lock. Without locks, the process's number decides.
 * Files of other users, and those that cannot be opened, stay. */
static void clean_temporaries(const char *target) {
    char folder[PATH_MAX];
    vshi_path_folder(target, folder);
    DIR *listing = opendir(folder);
    if (listing == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        const long process = find_process(target, entry->d_name);
        if (process == 0) {
            continue;
        }
        const int file =
            openat(dirfd(listing), entry->d_name, O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
        struct stat status;
        if (file >= 0) {
            if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
                is_leftover(file, process)) {
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

static vsh_result fail_output(const char *path, const char *why, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, why);
}

/* Returns a reason not to read or write the file as a whole; NULL if it is a regular file. */
static const char *find_obstacle(const struct stat *status) {
    return S_ISDIR(status->st_mode)    ? "it is a folder"
           : !S_ISREG(status->st_mode) ? "it is no regular file"
                                       : NULL;
}

vsh_result vshi_output_check(const char *path, vsh_error *error) {
    if (path == NULL || path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "output path: it is empty");
    }
    if (vshi_path_name(path)[0] == '\0') {
        return fail_output(path, "it is a folder", error);
    }
    char folder[PATH_MAX];
    vshi_path_folder(path, folder);
    struct stat status;
    if (stat(folder, &status) != 0 || access(folder, W_OK | X_OK) != 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: its folder: %s", path,
                         strerror(errno));
    }
    if (stat(path, &status) != 0) {
        return errno == ENOENT ? VSH_OK : fail_output(path, strerror(errno), error);
    }
    const char *obstacle = find_obstacle(&status);
    /* rename() ignores that a file is read-only, but its owner meant to keep it */
    return obstacle == NULL && access(path, W_OK) == 0
               ? VSH_OK
               : fail_output(path, obstacle != NULL ? obstacle : strerror(errno), error);
}

vsh_result vshi_output_begin(vshi_output *output, const char *path, vsh_error *error) {
    *output = (vshi_output){NULL, NULL, 0};
    VSHI_TRY(vshi_output_check(path, error));
    struct stat old;
    const bool replaces = stat(path, &old) == 0;
    output->target = replaces ? realpath(path, NULL) : strdup(path);
    const size_t capacity = output->target != NULL ? strlen(output->target) + TEMPORARY_ROOM : 0;
    output->temporary = output->target != NULL ? malloc(capacity) : NULL;
    if (output->temporary == NULL) {
        vshi_output_abandon(output);
        return vshi_fail_memory(error, path);
    }
    clean_temporaries(output->target);
    const int file = create_temporary(output->target, output->temporary, capacity);
    if (file < 0) {
        const vsh_result result = fail_output(path, strerror(errno), error);
        free(output->temporary);
        output->temporary = NULL;
        vshi_output_abandon(output);
        return result;
    }
    if (replaces && fchmod(file, old.st_mode & 0777) != 0) {
        errno = 0; /* some file systems have no modes; the new file then has the usual ones */
    }
    output->held = file + 1;
    return VSH_OK;
}

/* Moves a file to its place, and syncs the folder: otherwise a power cut may lose the new name. A failed sync
 * is ignored, because some file systems cannot sync folders, and some folders cannot be read. */
static vsh_result move_into_place(const char *temporary, const char *target, vsh_error *error) {
    char path[PATH_MAX];
    vshi_path_folder(target, path);
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

static vsh_result sync_file(const vshi_output *output, vsh_error *error) {
    /* EINVAL: this file system syncs no files */
    return fsync(output->held - 1) == 0 || errno == EINVAL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", output->target,
                           strerror(errno));
}

/* Makes a hard link to the old file at a target, *kept; "" if there is none, or the file system has no hard
 * links. It is named like a leftover of a killed process, so the next run removes it. */
static vsh_result keep_old(const char *target, char **kept, vsh_error *error) {
    const size_t capacity = strlen(target) + TEMPORARY_ROOM;
    *kept = malloc(capacity);
    if (*kept == NULL) {
        return vshi_fail_memory(error, target);
    }
    (*kept)[0] = '\0';
    if (access(target, F_OK) != 0) {
        return VSH_OK;
    }
    const int file = create_temporary(target, *kept, capacity);
    if (file < 0) {
        (*kept)[0] = '\0';
        return fail_output(target, strerror(errno), error);
    }
    close(file);
    unlink(*kept); /* the name was free; link() does not replace */
    if (link(target, *kept) != 0) {
        (*kept)[0] = '\0';
    }
    return VSH_OK;
}

/* Puts the old file back in place of the new one, or removes the new one if there was none. */
static void restore_old(const char *target, const char *kept) {
    if (kept[0] != '\0') {
        (void)!rename(kept, target);
    } else {
        unlink(target);
    }
}

vsh_result vshi_outputs_commit(vshi_output *const *outputs, size_t count, vsh_error *error) {
    char **kept = calloc(count + 1, sizeof *kept);
    vsh_result result = kept != NULL ? VSH_OK : vshi_fail_memory(error, "outputs");
    size_t placed = 0;
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        result = sync_file(outputs[i], error);
    }
    for (size_t i = 0; i < count && count > 1 && result == VSH_OK; ++i) {
        result = keep_old(outputs[i]->target, &kept[i], error);
    }
    for (; placed < count && result == VSH_OK; placed += result == VSH_OK) {
        result = move_into_place(outputs[placed]->temporary, outputs[placed]->target, error);
    }
    for (size_t i = 0; kept != NULL && i < count; ++i) {
        if (i < placed && result != VSH_OK) {
            restore_old(outputs[i]->target, kept[i]);
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

/* --- files of strangers */

static vsh_result fail_input(const char *name, const char *why, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", name, why);
}

static vsh_result check_input(int file, const char *name, uint64_t most, uint64_t *size, vsh_error *error) {
    struct stat status;
    if (fstat(file, &status) != 0) {
        return fail_input(name, strerror(errno), error);
    }
    const char *obstacle = find_obstacle(&status);
    if (obstacle != NULL) {
        return fail_input(name, obstacle, error);
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
        result = *file != NULL ? VSH_OK : vshi_fail_memory(error, name);
    }
    if (result != VSH_OK) {
        close(opened);
    }
    return result;
}

/* Removes the last part of an absolute path; "/" stays. */
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
    vshi_path_folder(model, given);
    return realpath(given, folder) != NULL && lies_in(folder, file);
}

/* --- SHA-256 of files, by Nettle */

_Static_assert(VSH_DIGEST_TEXT == 2 * SHA256_DIGEST_SIZE + 1, "a digest's text");

static vsh_result digest_stream(FILE *file, const char *path, char *digest, vshi_job *job, vsh_error *error) {
    struct sha256_ctx context;
    sha256_init(&context);
    unsigned char bytes[1 << 14];
    size_t count;
    while ((count = fread(bytes, 1, sizeof bytes, file)) > 0) {
        sha256_update(&context, count, bytes);
        VSHI_TRY(vshi_job_step(job, 0, error));
    }
    if (ferror(file)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path);
    }
    uint8_t sum[SHA256_DIGEST_SIZE];
    sha256_digest(&context, sizeof sum, sum);
    for (size_t i = 0; i < sizeof sum; ++i) {
        snprintf(digest + 2 * i, 3, "%02x", sum[i]);
    }
    return VSH_OK;
}

vsh_result vshi_file_digest(const char *path, char digest[VSH_DIGEST_TEXT], vshi_job *job, vsh_error *error) {
    FILE *file;
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &file, &size, error));
    const vsh_result result = digest_stream(file, path, digest, job, error);
    fclose(file);
    return result;
}

vsh_result vsh_file_digest(const char *path, const vsh_run *run, char digest[VSH_DIGEST_TEXT],
                           vsh_error *error) {
    VSHI_NEEDS_BOTH(path, digest);
    if (path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "digest: no path");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, &full, "hash", 1, path, error));
    const vsh_result result = vshi_file_digest(path, digest, job, error);
    vshi_job_end(job);
    return result;
}
