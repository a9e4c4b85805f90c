/* What `vdbshade info` prints of a file of each kind. Each returns CLI_OK or an exit code, having said why.
 */
#ifndef CLI_INFO_H
#define CLI_INFO_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* How closely a mesh file's objects are looked at. */
typedef struct cli_info_look {
    int32_t width, height;               /* of the lightmap that their UVs are laid out in */
    double unit;                         /* as of vsh_scene */
    bool all;                            /* a paragraph for each mesh, however many there are */
    bool table;                          /* a line for each */
    const vsh_solidity_report *solidity; /* [meshes] */
} cli_info_look;

enum { CLI_INFO_PARAGRAPHS = 8 }; /* more meshes have a line each */

int cli_info_mesh(const char *path, const cli_info_look *look, const vsh_run *run);

/* One line of what a model holds. */
void cli_info_summary(const vsh_model *model);

/* How those of its meshes that have UVs share an image. */
int cli_info_uvs(const vsh_model *model, const vsh_mesh *meshes, size_t count, const cli_info_look *look,
                 const vsh_run *run);
int cli_info_vdb(const char *path, const char *name, const vsh_run *run); /* name NULL: all grids */
int cli_info_scene(const char *path, const vsh_run *run);
int cli_info_image(const char *path, const vsh_run *run);

#endif
