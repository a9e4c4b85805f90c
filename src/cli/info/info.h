/* vdbshade info: meshes, and what other kinds of files share with them. */
#ifndef CLI_INFO_H
#define CLI_INFO_H

#include <stdbool.h>
#include <vdbshade/vdbshade.h>

/* How meshes are looked at. */
typedef struct info_look {
    int32_t width, height; /* of the lightmap that their UVs are laid out in */
    double unit;           /* as of vsh_scene */
    bool all;              /* a paragraph for each mesh, however many there are */
} info_look;

/* CLI_OK or an exit code, having said why. */
int info_print_mesh(const char *path, const info_look *look, const vsh_run *run);

void info_print_light(const vsh_light *light);

#endif
