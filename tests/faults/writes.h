/* System calls of writing that fail: the linker's --wrap sends open, pwrite, fsync, close and rename of our
 * objects here. Counted are those of files that are being written. */
#ifndef FAULTS_WRITES_H
#define FAULTS_WRITES_H

#include <stdint.h>

enum {
    WRITES_FAIL,  /* the n-th fails, as on a full disk */
    WRITES_SHORT, /* every pwrite writes but a part, every other is interrupted first: all must go well */
    WRITES_KILL   /* SIGKILL in place of the n-th */
};

/* From now on; n from 1, 0: none. */
void writes_begin(uint64_t n, int how);

/* The number of calls since; *what names the one that failed, NULL: none did. */
uint64_t writes_end(const char **what);

#endif
