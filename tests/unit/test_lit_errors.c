/* Lit assets are refused for damaged documents, atlases that do not fit, and limits. The old output stays.
 */
#include "rich_asset.h"
#include "testing.h"

#include "base/bytes.h"
static const char old_output[] = "what was there before";

/* A failure says why in one line that holds `part`, and leaves the output as it was. */
static void assert_refused(vsh_result result, const char *part) {
    assert_int_not_equal(result, VSH_OK);
    assert_int_equal(result, failure.code);
    assert_that(failure.message[0] != '\0' && strchr(failure.message, '\n') == NULL &&
                    strstr(failure.message, part) != NULL,
                "'%s' is no error of '%s'", failure.message, part);
    assert_file("out.glb", old_output, sizeof old_output);
}

/* The rich asset lit by vertices of their own, with extensions that are known alone, so that what is replaced
 * is dropped too. */
static lighting begin_sound(void) {
    asset in = make_rich();
    json_object_del(json_at(in.root, "nodes/1"), "extensions");
    json_object_del(json_at(in.root, "extensions"), "VENDOR_sound");
    const lighting l = begin_lighting(in, true);
    write_all(at("out.glb"), old_output, sizeof old_output);
    return l;
}

static vsh_result write_in(const lighting *l, const vsh_run *run) {
    const vsh_lit_image image = white_image(VSH_LIT_OCCLUSION, 0);
    const vsh_lit_options options = options_of(&image, 1);
    return vsh_lit_write(at("in.glb"), l->model, l->lit, &options, at("out.glb"), run, &failure);
}

/* --- documents */

/* Damage is found in parts that the model does not read, and in parts that changed since. */
TEST(damaged_documents_are_refused) {
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
    FREED_BY(end_lighting) lighting l = begin_sound();
    for (size_t i = 0; i < COUNT_OF(damages); ++i) {
        asset damaged = {json_deep_copy(l.in.root), l.in.bytes, l.in.size};
        set_at(&damaged, damages[i].object, damages[i].key, parsed(damages[i].value));
        write_glb(&damaged, "in.glb");
        failure = (vsh_error){VSH_OK, ""};
        assert_refused(write_in(&l, NULL), damages[i].part);
        json_decref(damaged.root);
    }
}

TEST(damaged_buffers_are_refused) {
    FREED_BY(end_lighting) lighting l = begin_sound();
    /* one triangle is turned over, the counts stay */
    unsigned char *indices =
        l.in.bytes + (element_of(&l.in, number_of(primitive_of(&l.in, 1, 0), "indices"), 0, 2) - l.in.bytes);
    const unsigned char second = indices[2];
    indices[2] = indices[4];
    indices[4] = second;
    write_glb(&l.in, "in.glb");
    assert_refused(write_in(&l, NULL), "the file has changed since");
    indices[4] = indices[2];
    indices[2] = second;
    const size_t target = number_of(json_at(l.in.root, "meshes/0/primitives/0/targets/0"), "POSITION");
    const json_t *sparse = json_object_get(item_of(&l.in, "accessors", target), "sparse");
    const size_t view = number_of(json_object_get(sparse, "indices"), "bufferView");
    unsigned char *last = l.in.bytes + number_of(item_of(&l.in, "bufferViews", view), "byteOffset") + 4;
    const unsigned char sound = *last;
    *last = 25;
    write_glb(&l.in, "in.glb");
    assert_refused(write_in(&l, NULL), "sparse index 2 of 3 is 25");
    *last = sound;
    static const char *const missing[][2] = {
        {"gone.bin", "gone.bin"}, {"../gone.bin", ""}, {"https://a/b.bin", ""}};
    for (size_t i = 0; i < 3; ++i) {
        set_at(&l.in, "buffers/0", "uri", json_string(missing[i][0]));
        write_glb(&l.in, "in.glb");
        assert_refused(write_in(&l, NULL), missing[i][1]);
    }
    assert_int_equal(failure.code, VSH_ERROR_UNSUPPORTED);
}

TEST(cut_files_are_refused_at_every_length) {
    FREED_BY(end_lighting) lighting l = begin_sound();
    FREED unsigned char *bytes = NULL;
    const size_t size = read_all(at("in.glb"), &bytes);
    for (size_t cut = 0; cut < size; cut += cut < 64 || cut + 64 > size ? 1 : 37) {
        write_all(at("in.glb"), bytes, cut);
        assert_refused(write_in(&l, NULL), "");
    }
}

/* --- callers */

TEST(atlases_that_do_not_fit_are_refused) {
    enum { CASES = 11 };
    FREED_BY(end_lighting) lighting l = begin_sound();
    const vsh_lit_mesh good = l.lit[0];
    vsh_lit_mesh other = make_lit(l.model, 0, true), bad[CASES];
    uint32_t *charts = calloc(good.triangle_count, sizeof *charts);
    ((uint32_t *)(uintptr_t)other.indices)[7] = (uint32_t)good.vertex_count;
    ((uint32_t *)(uintptr_t)other.sources)[9] = VERTICES;
    ((float *)(uintptr_t)other.uvs)[11] = NAN;
    charts[3] = 1; /* there are none */
    for (int i = 0; i < 7; ++i) {
        bad[i] = good;
    }
    bad[0].indices = other.indices;
    bad[1].sources = other.sources;
    bad[2].uvs = other.uvs;
    bad[3].charts = charts;
    --bad[4].triangle_count;
    bad[5].page = 70000;
    bad[6].sources = NULL;
    bad[7] = (vsh_lit_mesh){.uv_set = 8};
    bad[8] = (vsh_lit_mesh){.uv_set = -2};
    bad[9] = (vsh_lit_mesh){.charts = charts};
    bad[10] = (vsh_lit_mesh){.uv_set = 5};
    for (int i = 0; i < CASES; ++i) {
        l.lit[0] = bad[i];
        assert_refused(write_in(&l, NULL), i < 10 ? "" : "TEXCOORD_5");
        assert_true(i == 10 || failure.code == VSH_ERROR_ARGUMENT);
    }
    l.lit[0] = good;
    vsh_lit_mesh *list = malloc(sizeof *list);
    *list = other;
    list->charts = charts;
    free_lit(list, 1);
}

TEST(images_out_of_range_are_refused) {
    static const float value[1] = {1.0F};
    static const float *const one[1] = {value};
    FREED_BY(end_lighting) lighting l = begin_sound();
    const vsh_lit_image white = white_image(0, 0),
                        bad[][2] = {
                            {white_image(VSH_LIT_PREVIEW + 1, 0)},
                            {white_image(-1, 0)},
                            {white_image(0, UINT16_MAX)},
                            {{.png = old_output, .png_size = sizeof old_output}},
                            {{.png = white_png, .png_size = 4}},
                            {{.png = white_png, .png_size = sizeof white_png, .intensity = -1.0}},
                            {{.png = white_png, .png_size = sizeof white_png, .intensity = NAN}},
                            {{.width = 0, .height = 1, .channels = one, .channel_count = 1}},
                            {{.width = 1, .height = 65537, .channels = one, .channel_count = 1}},
                            {{.width = 1, .height = 1, .channels = one, .channel_count = 2}},
                            {{.width = 1, .height = 1, .channels = one, .channel_count = 1, .bits = 32}},
                            {{.width = 1, .height = 1, .channels = NULL, .channel_count = 1}},
                            {white, white}, /* one page twice */
                        };
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        const vsh_lit_options options = options_of(bad[i], bad[i][1].png != NULL ? 2 : 1);
        assert_refused(vsh_lit_write(at("in.glb"), l.model, l.lit, &options, at("out.glb"), NULL, &failure),
                       "");
        assert_int_equal(failure.code, VSH_ERROR_ARGUMENT);
    }
}

TEST(outputs_that_are_inputs_are_refused) {
    FREED_BY(end_lighting) lighting l = begin_sound();
    static const char *const outputs[] = {"in.glb", "out.ply", "none/out.glb"};
    for (size_t i = 0; i < 3; ++i) {
        assert_fails(vsh_lit_write(at("in.glb"), l.model, l.lit, NULL, at(outputs[i]), NULL, &failure),
                     i < 2 ? VSH_ERROR_ARGUMENT : VSH_ERROR_WRITE, "");
    }
}

/* Another document may use these files too. */
TEST(files_of_the_input_are_not_replaced_but_others_named) {
    FREED_BY(end_lighting) lighting l = begin_sound();
    write_all(at("all.bin"), l.in.bytes, l.in.size);
    set_at(&l.in, "buffers/0", "uri", json_string("all.bin"));
    write_glb(&l.in, "in.glb");
    assert_ok(vsh_lit_write(at("in.glb"), l.model, l.lit, NULL, at("all.gltf"), NULL, &failure));
    FREED_BY(free_asset) asset out = load_asset(at("all.gltf"));
    assert_string_equal(text_at(&out, "buffers/0/uri"), "all.1.bin");
    assert_file("all.bin", l.in.bytes, l.in.size);
    remove_file("all.gltf");
    remove_file("all.1.bin");
    remove_file("all.bin");
}

TEST(limits_leave_the_old_file) {
    FREED_BY(end_lighting) lighting l = begin_sound();
    vsh_run run = vsh_run_default();
    for (run.memory_limit = 1000; run.memory_limit < 100000; run.memory_limit *= 3) {
        assert_fails(write_in(&l, &run), VSH_ERROR_LIMIT, "");
        assert_refused(failure.code, "");
    }
}

FIXTURE(make_folder, remove_empty_folder)
