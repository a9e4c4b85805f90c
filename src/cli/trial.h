/* Work on files that may come from anywhere, in a child process: the installed OpenVDB reader can crash on
 * damaged ones. */
#ifndef CLI_TRIAL_H
#define CLI_TRIAL_H

#include <vdbshade/base.h>

/* Runs `work` in a child and returns its exit code. Where the child dies instead, says "PATH: damaged: …" and
 * returns CLI_FILE. The child's address space is limited to `memory` bytes (0: not). To be called before the
 * process has threads. */
int cli_isolated(const char *path, uint64_t memory, int (*work)(void *user), void *user);

/* Reads grid `name` (NULL: the first) of a .vdb file in a child, and drops it. */
int cli_trial_read(const char *path, const char *name, uint64_t memory);

#endif
