/* Temporary files beside their targets, and those that dead processes have left there. */
#ifndef VSHI_TEMPORARY_H
#define VSHI_TEMPORARY_H

#include "base/shared.h"

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    VSHI_TEMPORARY_ROOM = 48
}; /* bytes that the name adds to the target's: dots, process, number, "tmp" */

/* Creates ".NAME.PID.tmp.ENDING" beside the target (with a number where that name is taken), empty, and
 * returns its descriptor, or -1 with errno. `path` has room for the target and VSHI_TEMPORARY_ROOM more. As
 * long as the descriptor is open, it holds a lock on the file that says that its process lives. */
int vshi_temporary_create(const char *target, char *path, size_t capacity);

/* Removes this target's temporaries that no process holds: what a run left that was killed. A lock tells,
 * which every process on this machine sees, in whatever container, and through the usual network file systems
 * other machines do; where a file system knows no locks, the process's number does. Others' files, and all
 * that cannot be looked at, stay. */
void vshi_temporary_clean(const char *target);

/* Removes the temporary files that this process holds open. Takes no memory and no lock. */
VSHI_SHARED void vshi_temporary_remove_own(void);

#ifdef __cplusplus
}
#endif
#endif
