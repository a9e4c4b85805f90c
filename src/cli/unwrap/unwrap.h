/* What the command `unwrap` writes. */
#ifndef CLI_UNWRAP_H
#define CLI_UNWRAP_H

#include <vdbshade/vdbshade.h>

/* Writes the model that was read from `input` with its places in an atlas. CLI_OK or an exit code, having
 * said why. */
int cli_unwrap_write_mesh(const char *input, const char *path, const vsh_model *model, const vsh_atlas *atlas,
                          const vsh_run *run);

/* Writes a picture of the charts, pages from the top down, each chart in a colour of its own. `path` is any
 * image that vsh_image_write() writes. CLI_OK or an exit code, having said why. */
int cli_unwrap_write_picture(const char *path, const vsh_atlas *atlas);

#endif
