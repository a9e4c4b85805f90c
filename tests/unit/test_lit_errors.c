/* What a lit asset is refused for: damaged documents, atlases that do not fit, limits. The old output stays.
 */
#include "expect.h"
#include "rich_asset.h"

#include "base/hash.h"

static const char old_output[] = "what was there before";

static void begin_output(void) {
    write_bytes("out.glb", old_output, sizeof old_output);
}

/* A failure says why in one line, and leaves the output as it was. */
static void assert_refused(vsh_result result, const vsh_error *error) {
    assert_int_not_equal(result, VSH_OK);
    assert_int_equal(result, error->code);
    assert_true(error->message[0] != '\0' && strchr(error->message, '\n') == NULL);
    size_t size;
    unsigned char *bytes = load_bytes(path_of("out.glb").text, &size);
    assert_int_equal(size, sizeof old_output);
    assert_memory_equal(bytes, old_output, size);
    free(bytes);
}

/* The sound asset's model, lit by vertices of their own. */
typedef struct sound {
    asset in;
    vsh_model *model;
    vsh_lit_mesh *lit;
} sound;

static sound make_sound(void) {
    sound s = {.in = make_rich()};
    /* of extensions that are known alone, so that what is replaced is dropped too */
    json_object_del(json_array_get(json_object_get(s.in.root, "nodes"), 1), "extensions");
    json_object_del(json_object_get(s.in.root, "extensions"), "VENDOR_sound");
    write_glb(&s.in, "in.glb");
    s.model = read_model(path_of("in.glb").text);
    s.lit = make_all_lit(s.model, true);
    begin_output();
    return s;
}

static void free_sound(sound *s) {
    free_lit(s->lit, vsh_model_mesh_count(s->model));
    vsh_model_free(s->model);
    free_asset(&s->in);
    remove_file("in.glb");
    remove_file("out.glb");
}

static vsh_result write_in(const sound *s, const vsh_run *run, vsh_error *error) {
    const vsh_lit_image image = white_image(VSH_LIT_OCCLUSION, 0);
    vsh_lit_options options = vsh_lit_options_default();
    options.images = &image;
    options.image_count = 1;
    return vsh_lit_write(path_of("in.glb").text, s->model, s->lit, &options, path_of("out.glb").text, run,
                         error);
}

/* --- documents */

static json_t *at_path(json_t *value, const char *path) {
    char part[64];
    while (value != NULL && *path != '\0') {
        const size_t length = strcspn(path, "/");
        snprintf(part, sizeof part, "%.*s", (int)length, path);
        value =
            json_is_array(value) ? json_array_get(value, (size_t)atoi(part)) : json_object_get(value, part);
        path += length + (path[length] == '/');
    }
    return value;
}

/* What the model does not read, or what has changed since, is found all the same. */
static void damaged_documents_are_refused(void **state) {
    static const struct {
        const char *object, *key, *value, *part;
    } damages[] = {
        {"meshes/0/primitives/0/attributes", "COLOR_0", "999", "COLOR_0"},
        {"meshes/0/primitives/0/attributes", "_ID", "\"3\"", "_ID"},
        {"meshes/0/primitives/0/attributes", "_ID", "7", "96 elements for 25 vertices"},
        {"accessors/4", "count", "24", "24 elements for 25 vertices"},
        {"accessors/4", "count", "4000000000", "pass the"},
        {"accessors/4", "bufferView", "99", "99"},
        {"accessors/4", "type", "\"MAT9\"", "type"},
        {"accessors/4", "byteOffset", "1e15", "accessors[4]"},
        {"accessors/0", "count", "1000", "pass the"},
        {"bufferViews/0", "byteStride", "8", "accessors[0]"},
        {"bufferViews/0", "buffer", "7", "7"},
        {"bufferViews/0", "byteOffset", "-4", "bufferViews[0]"},
        {"bufferViews/0", "byteLength", "1e9", "bufferViews[0]"},
        {"buffers/0", "byteLength", "1e9", "cut short"},
        {"meshes/0/primitives/0", "material", "3", "3"},
        {"meshes/3/primitives/1", "material", "-1", "material"},
        {"meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/1", "material", "77", "77"},
        {"meshes/0/primitives/0", "mode", "6", "changed since"},
        {"meshes/0/primitives/0", "indices", "99", "indices"},
        {"meshes/0/primitives/0", "indices", "8", "changed since"},
        {"meshes/0/primitives/0/targets/0", "NORMAL", "99", "NORMAL"},
        {"nodes/1", "mesh", "99", "changed since"},
        {"nodes/8", "mesh", "99", "99"},
        {"nodes/1", "mesh", "2", "changed since"},
        {"nodes/7", "extensions", "{}", "changed since"},
        {"", "meshes", "{}", "meshes"},
        {"", "nodes", "[]", "changed since"},
        {"", "materials", "7", "materials"},
        {"", "accessors", "[]", "there are only 0"},
        {"", "images", "7", "images"},
        {"", "textures", "[1]", "textures"},
        {"", "extensionsUsed", "{\"a\":1}", "extensionsUsed"},
        {"", "extensionsRequired", "[\"VENDOR_none\"]", "VENDOR_none"},
        {"", "asset", "{\"version\":\"1.0\"}", "1.0"},
    };
    sound s = make_sound();
    for (size_t i = 0; i < sizeof damages / sizeof damages[0]; ++i) {
        asset damaged = {json_deep_copy(s.in.root), s.in.bytes, s.in.size};
        json_t *object = at_path(damaged.root, damages[i].object);
        assert_non_null(object);
        json_object_set_new(object, damages[i].key, parsed(damages[i].value));
        write_glb(&damaged, "in.glb");
        const vsh_result result = write_in(&s, NULL, &failure);
        if (result == VSH_OK || strstr(failure.message, damages[i].part) == NULL) {
            fail_msg("%s: %s %s is no error of '%s': %s", damages[i].object, damages[i].key, damages[i].value,
                     damages[i].part, result == VSH_OK ? "none" : failure.message);
        }
        assert_refused(result, &failure);
        json_decref(damaged.root);
    }
    free_sound(&s);
}

static void sparse_indices_out_of_range_are_refused(void **state) {
    sound s = make_sound();
    const size_t target =
        number_of(json_array_get(json_object_get(primitive_of(&s.in, 0, 0), "targets"), 0), "POSITION");
    const json_t *sparse = json_object_get(item_of(&s.in, "accessors", target), "sparse");
    const size_t view = number_of(json_object_get(sparse, "indices"), "bufferView");
    unsigned char *bytes = s.in.bytes + number_of(item_of(&s.in, "bufferViews", view), "byteOffset");
    bytes[4] = 25; /* the last of three */
    write_glb(&s.in, "in.glb");
    assert_refused(write_in(&s, NULL, &failure), &failure);
    assert_non_null(strstr(failure.message, "sparse index 2 of 3 is 25"));
    free_sound(&s);
}

/* As many triangles of as many vertices, one of which is turned over. */
static void other_triangles_than_the_models_are_refused(void **state) {
    sound s = make_sound();
    const size_t accessor = number_of(primitive_of(&s.in, 1, 0), "indices");
    unsigned char *indices = s.in.bytes + (element_of(&s.in, accessor, 0, 2) - s.in.bytes);
    const unsigned char first = indices[2];
    indices[2] = indices[4];
    indices[4] = first;
    write_glb(&s.in, "in.glb");
    assert_refused(write_in(&s, NULL, &failure), &failure);
    assert_non_null(strstr(failure.message, "the file has changed since"));
    free_sound(&s);
}

static void cut_files_are_refused_at_every_length(void **state) {
    sound s = make_sound();
    size_t size;
    unsigned char *bytes = load_bytes(path_of("in.glb").text, &size);
    for (size_t cut = 0; cut < size; cut += cut < 64 || cut + 64 > size ? 1 : 37) {
        write_bytes("in.glb", bytes, cut);
        assert_refused(write_in(&s, NULL, &failure), &failure);
    }
    free(bytes);
    free_sound(&s);
}

/* Whatever a byte becomes, it is a sound file or a refusal. */
static void flipped_bytes_end_in_a_file_or_a_reason(void **state) {
    enum { TRIES = 500 };
    sound s = make_sound();
    size_t size, written = 0;
    unsigned char *bytes = load_bytes(path_of("in.glb").text, &size);
    uint32_t json;
    memcpy(&json, bytes + 12, sizeof json);
    for (uint32_t i = 0; i < TRIES; ++i) {
        const size_t at = vshi_mix(i) % (20 + json);
        const unsigned char old = bytes[at];
        static const char syntax[] = "0129-[]{},\"e.";
        bytes[at] = i % 3 == 0 ? (unsigned char)syntax[vshi_mix(i + TRIES) % (sizeof syntax - 1)]
                               : (unsigned char)(old ^ (1U << i % 8));
        write_bytes("in.glb", bytes, size);
        const vsh_result result = write_in(&s, NULL, &failure);
        if (result == VSH_OK) {
            asset out = load_asset(path_of("out.glb").text);
            free_asset(&out);
            ++written;
            begin_output();
        } else {
            assert_refused(result, &failure);
        }
        bytes[at] = old;
    }
    assert_in_range(written, TRIES / 20, TRIES - TRIES / 20); /* of both kinds */
    free(bytes);
    free_sound(&s);
}

static void missing_buffers_are_refused(void **state) {
    sound s = make_sound();
    json_object_set_new(json_array_get(json_object_get(s.in.root, "buffers"), 0), "uri",
                        json_string("gone.bin"));
    write_glb(&s.in, "in.glb");
    assert_refused(write_in(&s, NULL, &failure), &failure);
    assert_non_null(strstr(failure.message, "gone.bin"));
    json_object_set_new(json_array_get(json_object_get(s.in.root, "buffers"), 0), "uri",
                        json_string("../gone.bin"));
    write_glb(&s.in, "in.glb");
    assert_refused(write_in(&s, NULL, &failure), &failure);
    json_object_set_new(json_array_get(json_object_get(s.in.root, "buffers"), 0), "uri",
                        json_string("https://a/b.bin"));
    write_glb(&s.in, "in.glb");
    assert_refused(write_in(&s, NULL, &failure), &failure);
    assert_int_equal(failure.code, VSH_ERROR_UNSUPPORTED);
    free_sound(&s);
}

/* --- callers */

static void atlases_that_do_not_fit_are_refused(void **state) {
    sound s = make_sound();
    vsh_lit_mesh *lit = &s.lit[0];
    const vsh_lit_mesh good = *lit;
    uint32_t *indices = malloc(3 * good.triangle_count * sizeof *indices),
             *sources = malloc(good.vertex_count * sizeof *sources);
    uint32_t *charts = calloc(good.triangle_count, sizeof *charts);
    float *uvs = malloc(2 * good.vertex_count * sizeof *uvs);
    memcpy(indices, good.indices, 3 * good.triangle_count * sizeof *indices);
    memcpy(sources, good.sources, good.vertex_count * sizeof *sources);
    memcpy(uvs, good.uvs, 2 * good.vertex_count * sizeof *uvs);
    indices[7] = (uint32_t)good.vertex_count;
    sources[9] = VERTICES;
    uvs[11] = NAN;
    charts[3] = 1; /* there are none */
    const vsh_lit_mesh bad[] = {
        {good.uvs, good.sources, indices, NULL, good.vertex_count, good.triangle_count, 0, 0},
        {good.uvs, sources, good.indices, NULL, good.vertex_count, good.triangle_count, 0, 0},
        {uvs, good.sources, good.indices, NULL, good.vertex_count, good.triangle_count, 0, 0},
        {good.uvs, good.sources, good.indices, charts, good.vertex_count, good.triangle_count, 0, 0},
        {good.uvs, good.sources, good.indices, NULL, good.vertex_count, good.triangle_count - 1, 0, 0},
        {good.uvs, good.sources, good.indices, NULL, good.vertex_count, good.triangle_count, 70000, 0},
        {good.uvs, NULL, good.indices, NULL, good.vertex_count, good.triangle_count, 0, 0},
        {NULL, NULL, NULL, NULL, 0, 0, 0, 8},
        {NULL, NULL, NULL, NULL, 0, 0, 0, -2},
        {NULL, NULL, NULL, charts, 0, 0, 0, 0},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        *lit = bad[i];
        assert_refused(write_in(&s, NULL, &failure), &failure);
        assert_int_equal(failure.code, VSH_ERROR_ARGUMENT);
    }
    *lit = (vsh_lit_mesh){.uv_set = 5};
    assert_refused(write_in(&s, NULL, &failure), &failure);
    assert_non_null(strstr(failure.message, "TEXCOORD_5"));
    *lit = good;
    free(uvs);
    free(charts);
    free(sources);
    free(indices);
    free_sound(&s);
}

static void images_out_of_range_are_refused(void **state) {
    static const float value[1] = {1.0F};
    static const float *const one[1] = {value};
    sound s = make_sound();
    const vsh_lit_image bad[] = {
        {.purpose = VSH_LIT_PURPOSES, .png = white_png, .png_size = sizeof white_png},
        {.purpose = -1, .png = white_png, .png_size = sizeof white_png},
        {.png = old_output, .png_size = sizeof old_output},
        {.png = white_png, .png_size = 4},
        {.png = white_png, .png_size = sizeof white_png, .page = UINT16_MAX},
        {.png = white_png, .png_size = sizeof white_png, .intensity = -1.0},
        {.png = white_png, .png_size = sizeof white_png, .intensity = NAN},
        {.width = 0, .height = 1, .channels = one, .channel_count = 1},
        {.width = 1, .height = 65537, .channels = one, .channel_count = 1},
        {.width = 1, .height = 1, .channels = one, .channel_count = 2},
        {.width = 1, .height = 1, .channels = one, .channel_count = 1, .bits = 32},
        {.width = 1, .height = 1, .channels = NULL, .channel_count = 1},
    };
    for (size_t i = 0; i <= sizeof bad / sizeof bad[0]; ++i) {
        const vsh_lit_image twice[2] = {white_image(0, 0), white_image(0, 0)};
        vsh_lit_options options = vsh_lit_options_default();
        options.images = i < sizeof bad / sizeof bad[0] ? &bad[i] : twice;
        options.image_count = i < sizeof bad / sizeof bad[0] ? 1 : 2;
        assert_refused(vsh_lit_write(path_of("in.glb").text, s.model, s.lit, &options,
                                     path_of("out.glb").text, NULL, &failure),
                       &failure);
        assert_int_equal(failure.code, VSH_ERROR_ARGUMENT);
        /* before there are images, their purposes count */
        const bool purpose = options.images->purpose < 0 || options.images->purpose >= VSH_LIT_PURPOSES;
        const vsh_result early =
            vsh_lit_check_uvs(path_of("in.glb").text, s.model, s.lit, &options, NULL, &failure);
        assert_int_equal(early, purpose ? VSH_ERROR_ARGUMENT : VSH_OK);
    }
    expect_error(vsh_lit_check_uvs(NULL, s.model, NULL, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    expect_error(vsh_lit_check_uvs(NULL, NULL, s.lit, NULL, NULL, &failure), VSH_ERROR_ARGUMENT, "");
    free_sound(&s);
}

static void outputs_that_are_inputs_are_refused(void **state) {
    sound s = make_sound();
    expect_error(
        vsh_lit_write(path_of("in.glb").text, s.model, s.lit, NULL, path_of("in.glb").text, NULL, &failure),
        VSH_ERROR_ARGUMENT, "");
    expect_error(
        vsh_lit_write(path_of("in.glb").text, s.model, s.lit, NULL, path_of("out.ply").text, NULL, &failure),
        VSH_ERROR_ARGUMENT, "");
    expect_error(vsh_lit_write(path_of("in.glb").text, s.model, s.lit, NULL, path_of("none/out.glb").text,
                               NULL, &failure),
                 VSH_ERROR_WRITE, "");
    free_sound(&s);
}

/* What another document may use too. */
static void files_of_the_input_are_not_replaced_but_others_named(void **state) {
    sound s = make_sound();
    write_bytes("all.bin", s.in.bytes, s.in.size);
    json_object_set_new(json_array_get(json_object_get(s.in.root, "buffers"), 0), "uri",
                        json_string("all.bin"));
    write_glb(&s.in, "in.glb");
    expect_ok(vsh_lit_write(path_of("in.glb").text, s.model, s.lit, NULL, path_of("all.gltf").text, NULL,
                            &failure));
    json_t *out = json_load_file(path_of("all.gltf").text, 0, NULL);
    const json_t *buffer = json_array_get(json_object_get(out, "buffers"), 0);
    assert_string_equal(json_string_value(json_object_get(buffer, "uri")), "all.1.bin");
    json_decref(out);
    size_t size;
    unsigned char *bytes = load_bytes(path_of("all.bin").text, &size);
    assert_int_equal(size, s.in.size);
    assert_memory_equal(bytes, s.in.bytes, size);
    free(bytes);
    remove_file("all.gltf");
    remove_file("all.1.bin");
    remove_file("all.bin");
    free_sound(&s);
}

static int32_t stop(void *user, const char *stage, double fraction) {
    return fraction >= *(double *)user;
}

static void limits_and_cancelling_leave_the_old_file(void **state) {
    sound s = make_sound();
    vsh_run run = vsh_run_default();
    for (uint64_t limit = 1000; limit < 100000; limit *= 3) {
        run.memory_limit = limit;
        assert_refused(write_in(&s, &run, &failure), &failure);
        assert_int_equal(failure.code, VSH_ERROR_LIMIT);
    }
    run.memory_limit = 0;
    run.progress = stop;
    for (double fraction = 0.0; fraction < 0.9; fraction += 0.2) {
        run.user = &fraction;
        assert_refused(write_in(&s, &run, &failure), &failure);
        assert_int_equal(failure.code, VSH_ERROR_CANCELLED);
    }
    free_sound(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(damaged_documents_are_refused),
        cmocka_unit_test(sparse_indices_out_of_range_are_refused),
        cmocka_unit_test(other_triangles_than_the_models_are_refused),
        cmocka_unit_test(cut_files_are_refused_at_every_length),
        cmocka_unit_test(flipped_bytes_end_in_a_file_or_a_reason),
        cmocka_unit_test(missing_buffers_are_refused),
        cmocka_unit_test(atlases_that_do_not_fit_are_refused),
        cmocka_unit_test(images_out_of_range_are_refused),
        cmocka_unit_test(outputs_that_are_inputs_are_refused),
        cmocka_unit_test(files_of_the_input_are_not_replaced_but_others_named),
        cmocka_unit_test(limits_and_cancelling_leave_the_old_file),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
