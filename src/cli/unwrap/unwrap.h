/* What the command `unwrap` writes. */
#ifndef CLI_UNWRAP_H
#define CLI_UNWRAP_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* Writes the model that was read from `input`, whose `meshes` have places in an atlas. Pages have the names
 * of those on them where they are of `objects`. CLI_OK or an exit code, having said why. */
int cli_unwrap_write_mesh(const char *input, const char *path, const vsh_model *model, const vsh_mesh *meshes,
                          const vsh_atlas *atlas, bool objects, const vsh_run *run);

/* Writes a picture of the charts, pages from the top down, each chart in a colour of its own. `path` is any
 * image that vsh_image_write() writes. CLI_OK or an exit code, having said why. */
int cli_unwrap_write_picture(const char *path, const vsh_atlas *atlas);

#endif
