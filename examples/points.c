/* Prints how much of the sun reaches points in a level. Usage: points LEVEL.glb <FILE. Each line of FILE has
 * the X Y Z of a point. */
#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/vdbshade.h>

int main(int argc, char **argv) {
    vsh_run run = vsh_run_default();
    run.reader = VSH_READER; /* models are parsed in a process of their own */
    vsh_error error;
    vsh_model *level = NULL;
    vsh_occluders *occluders = NULL;
    vsh_result result = vsh_model_read(argc > 1 ? argv[1] : "level.glb", &run, &level, &error);
    if (result == VSH_OK) {
        const size_t count = vsh_model_mesh_count(level);
        vsh_mesh *meshes = calloc(count, sizeof *meshes);
        for (size_t i = 0; meshes != NULL && i < count; ++i) {
            meshes[i] = vsh_model_mesh(level, i, -1);
        }
        result = vsh_occluders_create(meshes, count, NULL, &run, &occluders, &error);
        free(meshes);
    }
    vsh_light sun = vsh_light_default();
    sun.direction[0] = -0.5; /* towards it; y is 1 */
    sun.direction[2] = 0.7;
    sun.angle = 0.035; /* two degrees */
    double position[3];
    const vsh_points point = {1, position, NULL, NULL};
    while (result == VSH_OK && scanf("%lf %lf %lf", &position[0], &position[1], &position[2]) == 3) {
        float lit = 0;
        result = vsh_shade_shadow(occluders, &point, &sun, NULL, &run, &lit, NULL, NULL, &error);
        printf("%g\n", (double)lit);
    }
    if (result != VSH_OK) {
        fprintf(stderr, "points: %s\n", error.message);
    }
    vsh_occluders_free(occluders);
    vsh_model_free(level);
    return result != VSH_OK;
}
