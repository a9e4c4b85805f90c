/* Variables of the examples on top of the headers. */
#include <stdio.h>
#include <vdbshade/vdbshade.h>

extern vsh_run run;
extern vsh_error error;
extern vsh_warning_fn print_warning;
extern vsh_occluders *occluders;
extern vsh_grid *grid;
extern vsh_light sun;
extern vsh_mesh ground;
extern const vsh_mesh *meshes;
extern size_t mesh_count;
extern float shadow[256 * 256];
extern vsh_field_info info;
