#include "parts.h"

#include <string.h>

const float fuzz_corners[24] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
const float fuzz_uvs[16] = {0, 0, 1, 0, 1, 1, 0, 1, 0.1f, 0.1f, 0.9f, 0.1f, 0.9f, 0.9f, 0.1f, 0.9f};
const uint32_t fuzz_indices[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                   3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};
const float fuzz_heights[FUZZ_SIDE * FUZZ_SIDE] = {0.5f, 1.0f, 0.25f};

static fuzz_handles made;

static void make(void) {
    made.mesh = (vsh_mesh){.name = "box",
                           .positions = fuzz_corners,
                           .uvs = fuzz_uvs,
                           .indices = fuzz_indices,
                           .vertex_count = 8,
                           .triangle_count = 12};
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_grid_options grid = vsh_grid_options_default();
    grid.resolution = 10;
    FUZZ_MUST(vsh_grid_from_meshes(&made.mesh, 1, &grid, &run, &made.grid, NULL));
    vshi_field_options field = vshi_field_options_default();
    field.reach = 2.0;
    FUZZ_MUST(vshi_field_create(made.grid, &field, &run, &made.field, NULL));
    const vsh_occluders_options options = vsh_occluders_options_default();
    FUZZ_MUST(vsh_occluders_from_grid(made.grid, &options, &run, &made.occluders, NULL));
    const double square[] = {-1, -1, 1, -1, 1, 1, -1, 1};
    const size_t counts[] = {4};
    FUZZ_MUST(vsh_outline_from_polygons(square, counts, 1, &run, &made.outline, NULL));
    const double box_min[] = {-1, -1, -1}, box_max[] = {1, 1, 1};
    FUZZ_MUST(vsh_voxels_from_box(box_min, box_max, 0.5, &run, &made.voxels, NULL));
    const vsh_heights_source source = {
        .columns = FUZZ_SIDE, .rows = FUZZ_SIDE, .values = fuzz_heights, .size = {2, 2}, .height = 0.5};
    FUZZ_MUST(vshi_heights_create(&source, &run, &made.heights, NULL));
    const double balls[] = {0, 0, 0, 1, 2, 0, 0, 0.5};
    FUZZ_MUST(vshi_spheres_create(balls, 2, NULL, &run, &made.spheres, NULL));
}

const fuzz_handles *fuzz_made(void) {
    if (made.grid == NULL) {
        make();
    }
    return &made;
}

/* --- parts of the input */

void fuzz_take(fuzz_input *input, void *to, size_t size) {
    const uint8_t how = fuzz_byte(input);
    if (how == 0xff) {
        fuzz_fill(input, to, size);
        return;
    }
    for (int changes = how % 8; changes > 0; --changes) {
        uint16_t place;
        fuzz_fill(input, &place, sizeof place);
        size_t width = (size_t)1 << place % 4; /* 1 to 8 bytes, aligned as members are */
        width = width < size ? width : size;
        const size_t at = place / 4 % (size / width) * width;
        fuzz_fill(input, (char *)to + at, width);
    }
}

vsh_run fuzz_take_run(fuzz_input *input) {
    vsh_run run = fuzz_run();
    if (fuzz_byte(input) % 16 == 0) {
        vsh_run wild = run;
        fuzz_take(input, &wild, sizeof wild);
        wild.progress = run.progress;
        wild.warning = run.warning;
        wild.user = NULL;
        wild.reader = NULL; /* a program */
        wild.threads =
            wild.threads > 2 && wild.threads <= 1024 ? 2 : wild.threads; /* more take memory and time */
        wild.memory_limit = wild.memory_limit == 0 || wild.memory_limit > run.memory_limit
                                ? run.memory_limit
                                : wild.memory_limit;
        return wild;
    }
    return run;
}

static void take_layer(fuzz_input *input, vshi_layer *layer) {
    static const char *const lights[] = {"sun", "other"};
    *layer = vshi_layer_default();
    fuzz_take(input, layer, sizeof *layer);
    const uint8_t which = fuzz_byte(input);
    layer->field = which % 4 == 0 ? made.field : NULL;
    layer->heights = which % 4 == 1 ? made.heights : NULL;
    layer->spheres = which % 4 >= 2 ? made.spheres : NULL;
    layer->triangles = NULL;
    layer->lights = which & 16 ? lights : NULL;
    layer->light_count %= 3;
    layer->name = NULL;
}

vsh_occluders *fuzz_take_occluders(fuzz_input *input) {
    const uint8_t how = fuzz_byte(input) % 8;
    vshi_layer layer;
    const vshi_occluder_parts parts = {
        .field = how == 1 ? NULL : made.field, .layers = &layer, .layer_count = how < 2};
    if (how < 2) {
        take_layer(input, &layer);
    }
    vsh_occluders *occluders;
    FUZZ_MAKE(occluders, vshi_occluders_make(&parts, NULL, &occluders, fuzz_error()));
    return occluders != NULL ? occluders : made.occluders;
}

void fuzz_free_occluders(vsh_occluders *occluders) {
    if (occluders != made.occluders) {
        vsh_occluders_free(occluders);
    }
}

vsh_light fuzz_take_light(fuzz_input *input) {
    vsh_light light = vsh_light_default();
    light.angle = 0.2;
    light.radius = 0.1;
    light.position[0] = 3.0;
    fuzz_take(input, &light, sizeof light);
    return light;
}

void fuzz_choose(const uint8_t *data, size_t size, fuzz_call *const *calls, size_t count) {
    fuzz_made();
    fuzz_input input = {data, size};
    const uint8_t call = fuzz_byte(&input);
    calls[call % count](&input);
}
