/* Work on files that may come from anywhere, in a child process: the installed OpenVDB reader and
 * OpenImageIO's can crash on damaged ones. */
#ifndef CLI_TRIAL_H
#define CLI_TRIAL_H

#include <vdbshade/vdbshade.h>

/* Runs `work` in a child and returns its exit code. Where the child dies instead, says "PATH: damaged: …" and
 * returns CLI_FILE. The child's address space is limited to `memory` bytes (0: not). To be called before the
 * process has threads. */
int cli_isolated(const char *path, uint64_t memory, int (*work)(void *user), void *user);

/* Reads each level set, mask and font that the scene names as a caster in a child, and drops it. CLI_OK or an
 * exit code, having said why. */
int cli_trial_casters(const vsh_scene *scene, uint64_t memory);
int cli_trial_flat(const vsh_flat_scene *scene, uint64_t memory);

/* The same for the voxels of a grid of any numbers; a name of NULL: the first of the file. */
int cli_trial_voxels(const char *path, const char *name, uint64_t memory);

#endif
