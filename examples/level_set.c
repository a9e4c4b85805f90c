/* A level set from a file, by the confined reader: how much of the sun comes through below its middle.
 * Usage: level_set FILE.vdb */
#include <stdio.h>
#include <vdbshade/vdbshade.h>

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: level_set FILE.vdb\n");
        return 2;
    }
    vsh_error error;
    vsh_grid *grid = NULL;
    vsh_occluders *occluders = NULL;
    vsh_run run = vsh_run_default();
    run.reader = VSH_READER; /* parsed in a process of its own: files may come from anybody */
    if (vsh_grid_read(argv[1], NULL, &run, &grid, &error) != VSH_OK ||
        vsh_occluders_from_grid(grid, NULL, &run, &occluders, &error) != VSH_OK) {
        fprintf(stderr, "level_set: %s\n", error.message);
        vsh_grid_free(grid);
        return 1;
    }
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    printf("%llu voxels of %g\n", (unsigned long long)info.active_voxels, info.voxel_size);

    const double middle_x = 0.5 * (info.bounds_min[0] + info.bounds_max[0]);
    const double middle_z = 0.5 * (info.bounds_min[2] + info.bounds_max[2]);
    const double below = info.bounds_min[1] - 10.0 * info.voxel_size;
    const double position[3] = {middle_x, below, middle_z};
    const float normal[3] = {0, 1, 0};
    const vsh_points points = {1, position, normal, NULL};
    const double angles[] = {0.01, 0.5, 1.0, 2.0};
    for (size_t i = 0; i < sizeof angles / sizeof angles[0]; ++i) {
        vsh_light sun = vsh_light_default();
        vsh_shade_options options = vsh_shade_options_default();
        float lit;
        sun.angle = angles[i];
        options.method = VSH_SHADOW_ADAPTIVE;
        if (vsh_shade_shadow(occluders, &points, &sun, &options, &run, &lit, NULL, NULL, &error) != VSH_OK) {
            fprintf(stderr, "level_set: %s\n", error.message);
            break;
        }
        printf("a sun of %g radians: %.2f\n", angles[i], (double)lit);
    }
    vsh_occluders_free(occluders);
    vsh_grid_free(grid);
    return 0;
}
