/* System calls of writing that fail (scenarios.h). */
#include "scenarios.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/types.h>

enum { MOST_FILES = 1024 };

static struct {
    int how;
    uint64_t n, count;
    const char *failed;
    bool written[MOST_FILES]; /* descriptors of files that are being written */
} state;

int __real_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...);
#define WRAPPED(type, function, ...)                                                                         \
    type __real_##function(__VA_ARGS__);                                                                     \
    type __wrap_##function(__VA_ARGS__);
WRAPPED(ssize_t, pwrite, int file, const void *data, size_t size, off_t offset)
WRAPPED(int, fsync, int file)
WRAPPED(int, close, int file)
WRAPPED(int, rename, const char *from, const char *to)

void writes_begin(uint64_t n, int how) {
    state.how = how;
    state.n = n;
    state.count = 0;
    state.failed = NULL;
}

uint64_t writes_end(const char **what) {
    *what = state.failed;
    state.n = 0;
    state.how = WRITES_FAIL;
    return state.count;
}

static bool fails(const char *what) {
    if (++state.count != state.n || state.how == WRITES_SHORT) {
        return false;
    }
    if (state.how == WRITES_KILL) {
        kill(getpid(), SIGKILL);
    }
    state.failed = what;
    errno = ENOSPC;
    return true;
}

int __wrap_open(const char *path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const int mode = (flags & O_CREAT) != 0 ? va_arg(arguments, int) : 0;
    va_end(arguments);
    if ((flags & O_CREAT) != 0 && fails("open")) {
        return -1;
    }
    const int file = __real_open(path, flags, mode);
    if (file >= 0 && file < MOST_FILES) {
        state.written[file] =
            (flags & O_CREAT) != 0 && (flags & O_EXCL) == 0; /* the other holds the lock only */
    }
    return file;
}

ssize_t __wrap_pwrite(int file, const void *data, size_t size, off_t offset) {
    if (fails("pwrite")) {
        return -1;
    }
    if (state.how == WRITES_SHORT) {
        if (state.count % 2 == 0) {
            errno = EINTR;
            return -1;
        }
        size = size > 1 ? size / 2 : size;
    }
    return __real_pwrite(file, data, size, offset);
}

int __wrap_fsync(int file) {
    return fails("fsync") ? -1 : __real_fsync(file);
}

int __wrap_close(int file) {
    const bool counted = file >= 0 && file < MOST_FILES && state.written[file];
    if (counted) {
        state.written[file] = false;
    }
    const bool fail = counted && fails("close");
    const int code = __real_close(file);
    if (fail) {
        errno = ENOSPC;
        return -1;
    }
    return code;
}

int __wrap_rename(const char *from, const char *to) {
    return fails("rename") ? -1 : __real_rename(from, to);
}
