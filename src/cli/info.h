/* What `vdbshade info` prints of a file of each kind. Each returns CLI_OK or an exit code, having said why.
 */
#ifndef CLI_INFO_H
#define CLI_INFO_H

#include <vdbshade/base.h>

int cli_info_mesh(const char *path, const vsh_run *run);
int cli_info_vdb(const char *path, const vsh_run *run);
int cli_info_scene(const char *path);
int cli_info_image(const char *path, const vsh_run *run);

#endif
