/* A shape from a function: makes the level set of a torus, torus.vdb, and shades AO along its axis. */
#include <math.h>
#include <stdio.h>
#include <vdbshade/vdbshade.h>

typedef struct torus {
    double ring, tube;
} torus;

/* Called by many threads at once. */
static double torus_distance(void *user, const double p[3]) {
    const torus *t = user;
    return hypot(hypot(p[0], p[2]) - t->ring, p[1]) - t->tube;
}

int main(void) {
    torus shape = {1.0, 0.3};
    const vsh_distance distance = {.distance = torus_distance,
                                   .user = &shape,
                                   .lipschitz = 1.0,
                                   .exact = 1,
                                   .bounds_min = {-1.3, -0.3, -1.3},
                                   .bounds_max = {1.3, 0.3, 1.3}};
    vsh_grid_options voxels = vsh_grid_options_default();
    voxels.voxel_size = 0.02;
    vsh_error error;
    vsh_grid *grid = NULL;
    vsh_occluders *occluders = NULL;
    if (vsh_grid_from_distance(&distance, &voxels, NULL, &grid, &error) != VSH_OK ||
        vsh_grid_write(grid, "torus.vdb", "torus", NULL, 0, &error) != VSH_OK ||
        vsh_occluders_from_grid(grid, NULL, NULL, &occluders, &error) != VSH_OK) {
        fprintf(stderr, "callback: %s\n", error.message);
        vsh_grid_free(grid);
        return 1;
    }
    const double positions[3][3] = {{0.0, -0.4, 0.0}, {0.0, -1.0, 0.0}, {0.0, -4.0, 0.0}};
    const float normals[3][3] = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
    const vsh_points points = {3, &positions[0][0], &normals[0][0], NULL};
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_distance = 4.0;
    float open[3];
    if (vsh_shade_ao(occluders, &points, &options, NULL, open, NULL, NULL, NULL, &error) == VSH_OK) {
        for (int i = 0; i < 3; ++i) {
            printf("%g below: %.2f open\n", -positions[i][1], (double)open[i]);
        }
    }
    vsh_occluders_free(occluders);
    vsh_grid_free(grid);
    return 0;
}
