/* What outputs tell of where they come from. */
#ifndef CLI_ORIGIN_H
#define CLI_ORIGIN_H

#include <vdbshade/vdbshade.h>

typedef struct cli_origin {
    vsh_provenance *made;
    const vsh_attribute *attributes; /* [count] */
    size_t count;
} cli_origin;

/* Of the parsed command, of a scene (NULL: there is none) and of further files[file_count], the command's
 * operand first; those that are NULL or named by the scene add nothing. `casters` tell of voxels and
 * triangles; NULL: there are none. CLI_OK or an exit code, having said why; free also after a failure. */
int cli_origin_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                    const vsh_occluders_info *casters, const vsh_run *run, cli_origin *origin);
void cli_origin_free(cli_origin *origin);

#endif
