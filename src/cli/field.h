/* From a scene's casters to what is marched and traced. */
#ifndef CLI_FIELD_H
#define CLI_FIELD_H

#include <vdbshade/vdbshade.h>

/* A world box; min > max on all axes where it is empty. */
typedef struct cli_box {
    double min[3], max[3];
} cli_box;

cli_box cli_box_empty(void);
void cli_box_grow(cli_box *box, const vsh_texels_info *info); /* by the samples' box */

typedef struct cli_field {
    vsh_field *field; /* to be freed */
    vsh_grid_info grid;
    vsh_field_info info;
    double voxelize_s, field_s;
} cli_field;

/* A field that reaches as far as the scene's lights and AO need at receivers in a box. CLI_OK or an exit
 * code, having said why. */
int cli_field_make(const vsh_scene *scene, const vsh_assets *assets, const cli_box *receivers,
                   const vsh_run *run, cli_field *made);

/* Diagonals of the casters' box. */
#define CLI_WITHIN_DIAGONALS 4.0

/* The same for points that are not known beforehand, within a distance of the casters' box; 0:
 * CLI_WITHIN_DIAGONALS. It does not depend on the points, so that neither do their bits. */
int cli_field_make_around(const vsh_scene *scene, const vsh_assets *assets, double within, const vsh_run *run,
                          cli_field *made);

/* The steps of it: the level set, to be freed, and what made->field is made of. */
int cli_grid_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run, vsh_grid **grid,
                  cli_field *made);
int cli_field_of_grid(const vsh_scene *scene, const vsh_grid *grid, const cli_box *receivers,
                      const vsh_run *run, cli_field *made);

/* The casters' triangles where one of the scene's methods traces them, else NULL; likewise. */
int cli_triangles_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                       vsh_triangles **triangles);

#endif
