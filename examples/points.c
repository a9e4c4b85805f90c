/* The sun at points: below a ball, and beside it. */
#include <stdio.h>
#include <vdbshade/vdbshade.h>

int main(void) {
    vsh_sdf_node ball = vsh_sdf_node_default(); /* a unit sphere at the origin */
    vsh_sdf tree = {&ball, 1};
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.voxel_size = 0.05;
    vsh_error error;
    vsh_grid *grid;
    vsh_occluders *occluders = NULL;
    if (vsh_grid_from_sdf(&tree, &voxels, NULL, &grid, &error) != VSH_OK ||
        vsh_occluders_from_grid(grid, NULL, NULL, &occluders, &error) != VSH_OK) {
        fprintf(stderr, "points: %s\n", error.message);
        return 1;
    }
    const double positions[2][3] = {{0.0, -2.0, 0.0}, {3.0, -2.0, 0.0}};
    const float normals[2][3] = {{0.0f, 1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
    const vsh_points points = {2, &positions[0][0], &normals[0][0], NULL};
    const vsh_light sun = vsh_light_default(); /* half a degree, straight overhead */
    float lit[2];
    if (vsh_shade_shadow(occluders, &points, &sun, NULL, NULL, lit, NULL, NULL, &error) == VSH_OK) {
        printf("%g %g\n", (double)lit[0], (double)lit[1]); /* 0 1 */
    }
    vsh_occluders_free(occluders);
    vsh_grid_free(grid);
    return 0;
}
