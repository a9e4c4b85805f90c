/* What the command `unwrap` writes. */
#ifndef CLI_UNWRAP_H
#define CLI_UNWRAP_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* Writes meshes with their places in an atlas as an OBJ file, in the world, each page a material, which of
 * `objects` has the object's name. CLI_OK or an exit code, having said why. */
int cli_unwrap_write_obj(const char *path, const vsh_mesh *meshes, const vsh_atlas *atlas, bool objects);

/* Writes a picture of the charts, pages from the top down, each chart in a colour of its own. `path` is any
 * image that vsh_image_write() writes. CLI_OK or an exit code, having said why. */
int cli_unwrap_write_picture(const char *path, const vsh_atlas *atlas);

#endif
