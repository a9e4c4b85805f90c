/* A lightmap from a program's own arrays: the soft shadow of a box on a floor. Writes floor.exr. */
#include <stdio.h>
#include <vdbshade/vdbshade.h>

enum { SIZE = 256 };

/* A unit box a quarter above the floor. */
static const float box_positions[8][3] = {{-0.5f, 0.25f, -0.5f}, {0.5f, 0.25f, -0.5f}, {-0.5f, 1.25f, -0.5f},
                                          {0.5f, 1.25f, -0.5f},  {-0.5f, 0.25f, 0.5f}, {0.5f, 0.25f, 0.5f},
                                          {-0.5f, 1.25f, 0.5f},  {0.5f, 1.25f, 0.5f}};
static const uint32_t box_triangles[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                              {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                              {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

/* The floor, 4 × 4, with the UVs of its lightmap. */
static const float floor_positions[4][3] = {{-2, 0, -2}, {2, 0, -2}, {2, 0, 2}, {-2, 0, 2}};
static const float floor_uvs[4][2] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
static const uint32_t floor_triangles[2][3] = {{0, 2, 1}, {0, 3, 2}};

/* The shadow that casters throw on a receiver under a sun of six degrees, into shadow[SIZE * SIZE]. */
static vsh_result bake(const vsh_mesh *casters, size_t count, const vsh_mesh *receiver, float *shadow,
                       vsh_error *error) {
    vsh_occluders *occluders = NULL; /* what casts */
    vsh_charts *charts = NULL;       /* what receives */
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIZE;
    vsh_light sun = vsh_light_default();
    sun.direction[0] = 0.5; /* towards it; y is 1 */
    sun.angle = 0.1;
    const vsh_lightmap lightmap = {.shadow = &shadow};
    vsh_result result = vsh_occluders_create(casters, count, NULL, NULL, &occluders, error);
    if (result == VSH_OK) {
        result = vsh_charts_create(receiver, 1, &options, NULL, NULL, &charts, error);
    }
    if (result == VSH_OK) {
        result = vsh_bake_lightmap(occluders, charts, &sun, 1, NULL, NULL, &lightmap, NULL, error);
    }
    vsh_charts_free(charts);
    vsh_occluders_free(occluders);
    return result;
}

int main(void) {
    const vsh_mesh box = {.name = "box",
                          .positions = &box_positions[0][0],
                          .vertex_count = 8,
                          .indices = &box_triangles[0][0],
                          .triangle_count = 12};
    const vsh_mesh ground = {.name = "floor",
                             .positions = &floor_positions[0][0],
                             .uvs = &floor_uvs[0][0],
                             .vertex_count = 4,
                             .indices = &floor_triangles[0][0],
                             .triangle_count = 2};
    static float shadow[SIZE * SIZE];
    const char *const name = "shadow.sun";
    const float *const plane = shadow;
    const vsh_image image = {SIZE, SIZE, 1, &name, &plane, NULL};
    vsh_error error;
    if (bake(&box, 1, &ground, shadow, &error) != VSH_OK ||
        vsh_image_write("floor.exr", &image, NULL, &error) != VSH_OK) {
        fprintf(stderr, "lightmap: %s\n", error.message);
        return 1;
    }
    printf("%g under the box, %g in the corner\n", (double)shadow[SIZE / 2 * SIZE + SIZE / 2 - 10],
           (double)shadow[0]);
    return 0;
}
