/* Which program reads, and how it is started. */
#ifndef VSHI_READ_SPAWN_H
#define VSHI_READ_SPAWN_H

#include "sandbox/reader.h"

#include <sys/types.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Puts the folders that this process's libraries are loaded from: the reader loads the same. */
void vshi_encode_folders(vshi_encoder *encoder);

/* Whether vshi_spawn_reader() started this process, which must not start a reader of its own. */
bool vshi_in_reader(void);

/* Starts exchange->run->reader with these descriptors. Returns 0 or what errno says. */
int vshi_spawn_reader(const vshi_exchange *exchange, int answer, int progress, pid_t *pid);

#ifdef __cplusplus
}
#endif
#endif
