/* Masks and heightfields with any pixels: the input is width, threshold and the pixels' bits. Public calls
 * write and read the image. An outline made from it must bound an area. */
#include "fuzz.h"

#include <vdbshade/grid.h>
#include <vdbshade/image.h>
#include <vdbshade/mesh.h>

#include <math.h>
#include <string.h>

enum { MOST = 24, LEVELS = 4 };

static void check_outline(const vsh_outline *outline) {
    const vshi_outline_node *root = &outline->nodes[0];
    const vshi_point inside = {0.5 * (root->low[0] + root->high[0]), 0.5 * (root->low[1] + root->high[1])};
    FUZZ_REQUIRE(outline->contour_count > 0 && outline->area > 0.0);
    FUZZ_REQUIRE(isfinite(vshi_outline_square(outline, inside, INFINITY)));
    for (size_t i = 0; i < outline->contour_count; ++i) {
        FUZZ_REQUIRE(outline->starts[i + 1] >=
                     outline->starts[i] + 4); /* each contour repeats its first point at its end */
    }
}

static void make_outline(const char *path, const vsh_mask_options *options, const vsh_run *run) {
    vsh_outline *outline;
    if (FUZZ_MAKE(outline, vshi_outline_from_image(path, options, run, &outline, fuzz_error())) == VSH_OK) {
        check_outline(outline);
        vsh_grid_options grid_options = vsh_grid_options_default();
        grid_options.resolution = 8;
        FUZZ_TRY(vsh_grid, grid,
                 vsh_grid_from_outline(outline, 0.5, NULL, &grid_options, run, &grid, fuzz_error()));
    }
    vsh_outline_free(outline);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    fuzz_input input = {data, size};
    const int width = 1 + fuzz_byte(&input) % MOST;
    const int kind = fuzz_byte(&input);
    vsh_mask_options options = vsh_mask_options_default();
    options.invert = kind >> 1 & 1;
    if (kind >> 2 & 1) {
        fuzz_fill(&input, &options.threshold, sizeof options.threshold);
    }
    float pixels[MOST * MOST] = {0};
    int count = 0;
    while (input.left > 0 && count < MOST * width) {
        if (kind & 1) {
            fuzz_fill(&input, &pixels[count++], sizeof pixels[0]);
        } else { /* few levels, so that equal and opposite neighbours are common */
            pixels[count++] = (float)(fuzz_byte(&input) % (LEVELS + 1)) / LEVELS;
        }
    }
    const int height = count / width > 0 ? count / width : 1;
    static const char *const name = "Y";
    const float *plane = pixels;
    const vsh_image image = {width, height, 1, &name, &plane, NULL};
    const char *path = fuzz_file("a.exr", "", 0);
    FUZZ_REQUIRE(vsh_image_write(path, &image, NULL, fuzz_error()) == VSH_OK);
    const vsh_run run = fuzz_run();
    make_outline(path, &options, &run);
    const vsh_heights_source source = {
        .name = path, .columns = width, .rows = height, .values = pixels, .size = {1.0, 1.0}, .height = 1.0};
    FUZZ_TRY(vshi_heights, heights, vshi_heights_create(&source, &run, &heights, fuzz_error()));
    return 0;
}
