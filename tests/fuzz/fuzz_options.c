/* Calls that make casters, images and comparisons, with structs of any bytes: they return a code and do not
 * crash. */
#include "parts.h"

#include <string.h>

static void take_transform(fuzz_input *input, double transform[12]) {
    for (int i = 0; i < 12; ++i) {
        transform[i] = i % 5 == 0;
    }
    fuzz_take(input, transform, 12 * sizeof *transform);
}

static void grid(fuzz_input *input) {
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 8;
    fuzz_take(input, &options, sizeof options);
    const vsh_run run = fuzz_take_run(input);
    double transform[12];
    take_transform(input, transform);
    float positions[24];
    memcpy(positions, fuzz_corners, sizeof positions);
    fuzz_take(input, positions, sizeof positions);
    uint32_t corners_of[36];
    memcpy(corners_of, fuzz_indices, sizeof corners_of);
    fuzz_take(input, corners_of, sizeof corners_of);
    vsh_mesh mesh = fuzz_made()->mesh;
    mesh.positions = positions;
    mesh.indices = corners_of;
    mesh.transform = fuzz_byte(input) & 1 ? transform : NULL;
    vsh_grid *result;
    FUZZ_MAKE(result, vsh_grid_from_meshes(&mesh, 1, &options, &run, &result, fuzz_error()));
    if (result != NULL) {
        vshi_field_options wide = vshi_field_options_default();
        fuzz_take(input, &wide, sizeof wide);
        vsh_field *field;
        FUZZ_MAKE(field, vshi_field_create(result, &wide, &run, &field, fuzz_error()));
        vshi_field_free(field);
    }
    vsh_grid_free(result);
}

static void unite(fuzz_input *input) {
    vsh_grid_options options = vsh_grid_options_default();
    fuzz_take(input, &options, sizeof options);
    const vsh_run run = fuzz_take_run(input);
    double transform[12];
    take_transform(input, transform);
    const vsh_grid_instance instances[] = {{fuzz_made()->grid, NULL}, {fuzz_made()->grid, transform}};
    FUZZ_TRY(vsh_grid, result, vsh_grid_unite(instances, 2, &options, &run, &result, fuzz_error()));
    FUZZ_TRY(vsh_grid, result,
             vsh_grid_from_outline(fuzz_made()->outline, transform[3], transform, &options, &run, &result,
                                   fuzz_error()));
}

static void sdf(fuzz_input *input) {
    vsh_sdf_node nodes[6];
    const size_t count = fuzz_byte(input) % 7;
    for (size_t i = 0; i < count; ++i) {
        nodes[i] = vsh_sdf_node_default();
        nodes[i].shape = fuzz_byte(input) % 12;
        nodes[i].left = (int32_t)i - 2;
        nodes[i].right = (int32_t)i - 1;
        fuzz_take(input, &nodes[i], sizeof nodes[i]);
    }
    const vsh_sdf tree = {nodes, count};
    vsh_grid_options options = vsh_grid_options_default();
    options.resolution = 8;
    fuzz_take(input, &options, sizeof options);
    const vsh_run run = fuzz_take_run(input);
    FUZZ_TRY(vsh_grid, result, vsh_grid_from_sdf(&tree, &options, &run, &result, fuzz_error()));
    vshi_solids *solids;
    double transform[12];
    take_transform(input, transform);
    FUZZ_MAKE(solids, vshi_solids_create(&tree, transform, 1, &solids, fuzz_error()));
    if (solids != NULL) {
        double position[3] = {1, 1, 1}, offset = 0.01;
        float normal[3] = {0, 1, 0};
        fuzz_take(input, position, sizeof position);
        fuzz_take(input, normal, sizeof normal);
        fuzz_take(input, &offset, sizeof offset);
        const vsh_light light = fuzz_take_light(input);
        if (offset >= 0.0 && fuzz_check_plain(vsh_light_check(&light, fuzz_error())) == VSH_OK) {
            vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, 4, 0);
            const vshi_truth truth = {.solids = solids,
                                      .light = &light,
                                      .place = vshi_light_in_world(&light),
                                      .offset = offset,
                                      .sampler = sampler,
                                      .rays = 4};
            int32_t free_rays[2], even;
            if (sampler != NULL) {
                vshi_truth_count(&truth, position, normal, NULL, 0, free_rays, &even);
            }
            vshi_sampler_free(sampler);
        }
        vshi_solids_distance(solids, position);
    }
    vshi_solids_free(solids);
}

static void heights(fuzz_input *input) {
    vsh_heights_source source = {.columns = FUZZ_SIDE, .rows = FUZZ_SIDE, .size = {2, 2}, .height = 0.5};
    fuzz_take(input, &source, sizeof source);
    float values[FUZZ_SIDE * FUZZ_SIDE];
    memcpy(values, fuzz_heights, sizeof values);
    fuzz_take(input, values, sizeof values);
    double transform[12];
    take_transform(input, transform);
    const vsh_run run = fuzz_take_run(input);
    source.name = "heights";
    source.values = values;
    source.transform = transform;
    if (source.columns > FUZZ_SIDE || source.rows > FUZZ_SIDE) {
        source.columns = FUZZ_SIDE; /* the array's length is the caller's promise */
        source.rows = FUZZ_SIDE;
    }
    FUZZ_TRY(vshi_heights, result, vshi_heights_create(&source, &run, &result, fuzz_error()));
    int32_t what = 0;
    fuzz_take(input, &what, sizeof what);
    FUZZ_TRY(vsh_model, model, vsh_model_from_heights(&source, what, &run, &model, fuzz_error()));
    double balls[8] = {0, 0, 0, 1, 2, 0, 0, 1};
    fuzz_take(input, balls, sizeof balls);
    FUZZ_TRY(vshi_spheres, spheres, vshi_spheres_create(balls, 2, transform, &run, &spheres, fuzz_error()));
}

static void image(fuzz_input *input) {
    static const char *const names[] = {"x.exr", "x.png", "x.tif", "x.jpg", "x.tga", "x.xyz", ""};
    const char *name = names[fuzz_byte(input) % (sizeof names / sizeof names[0])];
    float pixels[4][16];
    memset(pixels, 0, sizeof pixels);
    fuzz_take(input, pixels, sizeof pixels);
    static char texts[4][VSH_CHANNEL_NAME + 8];
    const char *const channels[] = {texts[0], texts[1], texts[2], texts[3]};
    const float *const planes[] = {pixels[0], pixels[1], pixels[2], pixels[3]};
    for (int i = 0; i < 4; ++i) {
        memset(texts[i], 0, sizeof texts[i]);
        texts[i][0] = (char)('A' + i);
        fuzz_take(input, texts[i], sizeof texts[i] - 1);
    }
    vsh_image what = {4, 4, 4, channels, planes, NULL};
    int32_t numbers[3] = {4, 4, 4};
    fuzz_take(input, numbers, sizeof numbers);
    vsh_image_options options = vsh_image_options_default();
    fuzz_take(input, &options, sizeof options);
    char pack[32] = "R=A,G=B,B=0,A=1";
    fuzz_take(input, pack, sizeof pack - 1);
    options.pack = fuzz_byte(input) & 1 ? pack : NULL;
    static char told[2][2][96];
    memset(told, 0, sizeof told);
    fuzz_take(input, told, sizeof told);
    vsh_attribute attributes[2];
    for (int i = 0; i < 2; ++i) {
        told[i][0][95] = told[i][1][95] = '\0';
        attributes[i] = (vsh_attribute){told[i][0], fuzz_byte(input) & 1 ? told[i][1] : NULL};
    }
    options.attributes = attributes;
    options.attribute_count %= 3;
    what.width = numbers[0];
    what.height = numbers[1];
    what.channel_count = numbers[2] <= 4 || numbers[2] > VSH_MAX_CHANNELS ? numbers[2] : 4;
    char path[512] = "";
    if (name[0] != '\0') {
        strcpy(path, fuzz_file(name, "", 0));
    }
    fuzz_check_plain(vsh_image_check(path, &what, &options, fuzz_error()));
    vshi_image_writer_bytes(path, &what, &options);
    const int64_t pixels_in = (int64_t)what.width * what.height;
    if (what.width <= 16 && pixels_in <= 16) {
        fuzz_check_plain(vsh_image_write(path, &what, &options, fuzz_error()));
    }
}

static void mask(fuzz_input *input) {
    static char path[512];
    if (path[0] == '\0') {
        const float pixels[16] = {0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0.6f, 0};
        const float *const plane = pixels;
        static const char *const name = "Y";
        const vsh_image picture = {4, 4, 1, &name, &plane, NULL};
        strcpy(path, fuzz_file("mask.exr", "", 0));
        FUZZ_MUST(vsh_image_write(path, &picture, NULL, NULL));
    }
    vsh_mask_options options = vsh_mask_options_default();
    fuzz_take(input, &options, sizeof options);
    char channel[16] = "Y";
    fuzz_take(input, channel, sizeof channel - 1);
    options.channel = fuzz_byte(input) & 1 ? channel : NULL;
    const vsh_run run = fuzz_take_run(input);
    FUZZ_TRY(vsh_outline, outline, vshi_outline_from_image(path, &options, &run, &outline, fuzz_error()));
    vsh_text_options letters = vsh_text_options_default();
    fuzz_take(input, &letters, sizeof letters);
    char text[24] = "text";
    fuzz_take(input, text, sizeof text - 1);
    FUZZ_TRY(vsh_outline, outline,
             vshi_outline_from_text(text, path, &letters, &run, &outline, fuzz_error()));
}

static void compare(fuzz_input *input) {
    vsh_compare_options options = vsh_compare_options_default();
    fuzz_take(input, &options, sizeof options);
    const vsh_run run = fuzz_take_run(input);
    enum { ROOM = 512 };
    float values[2][ROOM];
    uint8_t mask[ROOM];
    for (int i = 0; i < ROOM; ++i) {
        values[0][i] = values[1][i] = (float)(i % 24) / 24.0f;
    }
    memset(mask, 1, sizeof mask);
    fuzz_take(input, values, sizeof values);
    fuzz_take(input, mask, sizeof mask);
    vsh_compared compared = {{24, 20, 1}, values[0], values[1], fuzz_byte(input) & 1 ? mask : NULL};
    fuzz_take(input, compared.size, sizeof compared.size);
    const double count = (double)compared.size[0] * compared.size[1] * compared.size[2];
    if (count > ROOM && count <= 0x1p31 && compared.size[0] > 0 && compared.size[1] > 0 &&
        compared.size[2] > 0) {
        return; /* the arrays' length is the caller's promise */
    }
    vsh_measures measures;
    if (fuzz_check_plain(vsh_compare(&compared, &options, &run, &measures, fuzz_error())) == VSH_OK) {
        vsh_limits limits = vshi_limits_default();
        fuzz_take(input, &limits, sizeof limits);
        vshi_compare_judge(&measures, &limits);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static fuzz_call *const calls[] = {grid, unite, sdf, heights, image, mask, compare};
    fuzz_choose(data, size, calls, sizeof calls / sizeof calls[0]);
    return 0;
}
