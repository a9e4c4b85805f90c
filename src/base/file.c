#include "base/file.h"

#include "base/temporary.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *last_part(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

const char *vshi_path_ending(const char *path) {
    const char *name = last_part(path);
    const char *dot = strrchr(name, '.');
    return dot != NULL && dot != name ? dot + 1 : "";
}

/* The folder of the path, in new memory: "." where the path names none. */
static char *folder_of(const char *path) {
    const size_t length = (size_t)(last_part(path) - path);
    char *folder = malloc(length + 2);
    if (folder != NULL) {
        memcpy(folder, length > 0 ? path : ".", length > 0 ? length : 1);
        folder[length > 1 ? length - 1 : 1] = '\0';
    }
    return folder;
}

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
    char *folder = folder_of(path);
    if (folder == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    struct stat status;
    vsh_result result;
    if (stat(folder, &status) != 0 || access(folder, W_OK | X_OK) != 0) {
        result =
            vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: its folder: %s", path, strerror(errno));
    } else {
        result = check_target(path, error);
    }
    free(folder);
    return result;
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
    const size_t capacity = output->target != NULL ? strlen(output->target) + VSHI_TEMPORARY_ROOM : 0;
    output->temporary = output->target != NULL ? malloc(capacity) : NULL;
    if (output->temporary == NULL) {
        free(output->target);
        output->target = NULL;
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    vshi_temporary_clean(output->target);
    const int file = vshi_temporary_create(output->target, output->temporary, capacity);
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
    char *path = folder_of(target);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", target);
    }
    const int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    free(path);
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
    if (file < 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", target, strerror(errno));
    }
    const bool flushed = fsync(file) == 0 || errno == EINVAL; /* EINVAL: the file system cannot sync */
    const int flush_error = errno;
    const bool closed = close(file) == 0;
    return flushed && closed ? VSH_OK
                             : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", target,
                                         strerror(flushed ? errno : flush_error));
}

static void forget_temporary(vshi_output *output) {
    free(output->temporary);
    output->temporary = NULL;
}

vsh_result vshi_output_commit(vshi_output *output, vsh_error *error) {
    vsh_result result = sync_file(output->temporary, output->target, error);
    if (result == VSH_OK) {
        result = put_in_place(output->temporary, output->target, error);
    }
    if (result == VSH_OK) {
        forget_temporary(output);
    }
    vshi_output_abandon(output);
    return result;
}

/* Another name for what stands at a target, "" where nothing does or the file system has no such names. It
 * looks like a temporary file that a killed process has left, which the next run takes away. */
static vsh_result keep_old(const char *target, char **kept, vsh_error *error) {
    const size_t capacity = strlen(target) + VSHI_TEMPORARY_ROOM;
    *kept = malloc(capacity);
    if (*kept == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", target);
    }
    (*kept)[0] = '\0';
    if (access(target, F_OK) != 0) {
        return VSH_OK;
    }
    const int file = vshi_temporary_create(target, *kept, capacity);
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
    if (count == 1) {
        return vshi_output_commit(outputs[0], error);
    }
    char **kept = calloc(count + 1, sizeof *kept);
    vsh_result result =
        kept != NULL ? VSH_OK : vshi_fail(error, VSH_ERROR_MEMORY, "outputs: the system refused memory");
    size_t placed = 0;
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        result = sync_file(outputs[i]->temporary, outputs[i]->target, error);
    }
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
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
            forget_temporary(outputs[i]);
        }
        free(kept[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        vshi_output_abandon(outputs[i]);
    }
    free(kept);
    return result;
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
