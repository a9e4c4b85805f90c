/* What outputs tell of where they come from. */
#ifndef VSHI_CLI_PROVENANCE_H
#define VSHI_CLI_PROVENANCE_H

#include <vdbshade/vdbshade.h>

typedef struct cli_provenance {
    vsh_provenance *made;
    const vsh_attribute *attributes; /* [count] */
    size_t count;
} cli_provenance;

/* Of the parsed command, of a scene (NULL: there is none) and of further files[file_count], the command's
 * operand first; those that are NULL or named by the scene add nothing. `casters` tell of voxels and
 * triangles; NULL: there are none. CLI_OK or an exit code, having said why; free also after a failure. */
int cli_provenance_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                        const vsh_occluders_info *casters, const vsh_run *run, cli_provenance *origin);
void cli_provenance_free(cli_provenance *origin);

#endif
