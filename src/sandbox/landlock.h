/* Landlock (Linux 5.13): what files a process may open, by the kernel. */
#ifndef VSHI_READ_LANDLOCK_H
#define VSHI_READ_LANDLOCK_H

#include "sandbox/request.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The version that this kernel has; 0: none, or it is not switched on. */
int vshi_landlock_version(void);

/* From now on the calling thread, and those that it begins, open for reading what the request needs (the
 * file; the folder of a model, or any file where those outside are allowed; what libraries are loaded from),
 * and nothing for writing; no TCP port, no signal to other processes, and nothing of other processes' memory
 * where the kernel can forbid it. Programs can be started only if `start`. False where that cannot be had. */
bool vshi_landlock_confine(const vshi_request *request, bool start);

#ifdef __cplusplus
}
#endif
#endif
