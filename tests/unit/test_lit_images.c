/* Images and materials of a lit asset: what they hold, where they go, and who shares them. */
#include "rich_asset.h"
#include "testing.h"

#include "base/elementary.h"
#include "sandbox/reader.h"

enum { WIDTH = 7, HEIGHT = 3, TEXELS = WIDTH * HEIGHT };

/* --- what they hold */

/* The image of texture `texture`, which lies in the buffer, read again. */
static vsh_image_file *image_of(const asset *out, size_t texture) {
    const json_t *image = item_of(out, "images", number_of(item_of(out, "textures", texture), "source"));
    const size_t view = number_of(image, "bufferView");
    assert_string_equal(json_string_value(json_object_get(image, "mimeType")), "image/png");
    write_bytes("image.png", bytes_of_view(out, view),
                number_of(item_of(out, "bufferViews", view), "byteLength"));
    vsh_image_file *file = NULL;
    assert_ok(vsh_image_read(path_of("image.png").text, NULL, &file, &failure));
    remove_file("image.png");
    return file;
}

static void assert_values(const vsh_image_file *file, int32_t channel, const double *expected, double most) {
    const vsh_image image = vsh_image_view(file);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    for (int i = 0; i < TEXELS; ++i) {
        const double error = fabs((double)image.planes[channel][i] - expected[i]);
        assert_that(error <= 0.5 / most + 1e-6, "channel %d, texel %d: %.9g, expected %.9g", channel, i,
                    (double)image.planes[channel][i], expected[i]);
    }
}

/* A scene's file, lit by its own UVs. */
static asset write_scene(const vsh_lit_image *images, size_t count) {
    static const char path[] = VSH_MODELS "/scene.glb";
    const vsh_lit_options options = options_of(images, count);
    OWNED(vsh_model) *model = read_model(path);
    asset out = light_model(path, model, NULL, &options);
    return out;
}

static vsh_lit_image image_with(int32_t purpose, const float *const *channels, int32_t count, int32_t bits,
                                double intensity) {
    return (vsh_lit_image){.purpose = purpose,
                           .width = WIDTH,
                           .height = HEIGHT,
                           .channels = channels,
                           .channel_count = count,
                           .bits = bits,
                           .intensity = intensity};
}

TEST(planes_become_images_of_their_values) {
    float planes[4][TEXELS]; /* one of grey, three of light up to 5.5 */
    double expected[4][TEXELS];
    for (int i = 0; i < TEXELS; ++i) {
        planes[0][i] = (float)i / (TEXELS - 1);
        expected[0][i] = (double)planes[0][i];
        for (int c = 1; c < 4; ++c) {
            planes[c][i] = (float)(i + c - 1) / 4.0F;
            expected[c][i] = (double)planes[c][i] / 5.5;
        }
    }
    const float *const views[4] = {planes[0], planes[1], planes[2], planes[3]};
    for (int32_t bits = 8; bits <= 16; bits += 8) {
        const double most = bits == 8 ? 255.0 : 65535.0;
        const vsh_lit_image images[2] = {image_with(VSH_LIT_OCCLUSION, views, 1, bits, 0.0),
                                         image_with(VSH_LIT_LIGHTMAP, views + 1, 3, bits, 2.0)};
        FREED_BY(free_asset) asset out = write_scene(images, 2);
        const json_t *lightmap = json_at(out.root, "materials/0/extensions/MOZ_lightmap");
        OWNED(vsh_image_file) *file =
            image_of(&out, number_of(json_at(out.root, "materials/0/occlusionTexture"), "index"));
        assert_values(file, 0, expected[0], most);
        /* what is over 1 is in the intensity */
        assert_true(json_number_value(json_object_get(lightmap, "intensity")) == 2.0 * 5.5);
        OWNED(vsh_image_file) *lit = image_of(&out, number_of(lightmap, "index"));
        for (int c = 0; c < 3; ++c) {
            assert_values(lit, c, expected[1 + c], most);
        }
    }
}

TEST(previews_are_unlit_base_colour_of_srgb) {
    float grey[TEXELS];
    double expected[TEXELS];
    for (int i = 0; i < TEXELS; ++i) {
        grey[i] = i == 3 ? NAN : i == 4 ? -1.0F : 2.0F * (float)i / (TEXELS - 1);
        expected[i] = i == 3 || i == 4 ? 0.0 : vshi_to_srgb(fmin(0.75 * (double)grey[i], 1.0));
    }
    const float *const one[1] = {grey};
    const vsh_lit_image image = image_with(VSH_LIT_PREVIEW, one, 1, 0, 0.75);
    FREED_BY(free_asset) asset out = write_scene(&image, 1);
    assert_non_null(json_at(out.root, "materials/0/extensions/KHR_materials_unlit"));
    const json_t *base = json_at(out.root, "materials/0/pbrMetallicRoughness/baseColorTexture");
    assert_int_equal(number_of(base, "texCoord"), 1);
    OWNED(vsh_image_file) *file = image_of(&out, number_of(base, "index"));
    assert_values(file, 0, expected, 255.0);
}

/* --- materials */

TEST(materials_are_copied_only_where_they_must) {
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), false);
    light_white(&l, VSH_LIT_OCCLUSION);
    /* tiles: in set 1, and as it was for the mesh in the other scene. leaf: as variant there too, in set 1 as
     * a variant and by the instances, in set 0 by the skinned mesh. rail: set 0, and points. White: set 1 */
    assert_int_equal(count_of(&l.out, "materials"), 3 + 1 + 2 + 1 + 1);
    for (size_t m = 0; m < 3; ++m) { /* all are shown unlit as well */
        assert_json_equal(item_of(&l.in, "materials", m), item_of(&l.out, "materials", m), "a material");
    }
    /* left and right share theirs */
    size_t shared[2];
    for (size_t node = 1; node < 3; ++node) {
        json_t *primitive = json_array_get(
            json_object_get(item_of(&l.out, "meshes", number_of(item_of(&l.out, "nodes", node), "mesh")),
                            "primitives"),
            0);
        shared[node - 1] = number_of(primitive, "material");
        const json_t *mappings = json_at(primitive, "extensions/KHR_materials_variants/mappings");
        assert_int_equal(number_of(json_array_get(mappings, 0), "material"), shared[0]);
        const json_t *night =
            item_of(&l.out, "materials", number_of(json_array_get(mappings, 1), "material"));
        assert_string_equal(json_string_value(json_object_get(night, "name")), "leaf");
        assert_int_equal(number_of(json_object_get(night, "occlusionTexture"), "texCoord"), 1);
    }
    assert_int_equal(shared[0], shared[1]);
    /* without the other scene's node and the points, they change where they are */
    json_array_remove(list_of(&l.in, "scenes"), 1);
    json_array_set_new(list_of(&l.in, "nodes"), 8, parsed("{\"name\":\"empty\"}"));
    json_array_remove(json_at(l.in.root, "meshes/3/primitives"), 1);
    write_glb(&l.in, "in.glb");
    light_white(&l, VSH_LIT_OCCLUSION);
    assert_int_equal(count_of(&l.out, "materials"), 3 + 1 + 1);
    for (size_t m = 0; m < 3; ++m) {
        assert_non_null(json_object_get(item_of(&l.out, "materials", m), "occlusionTexture"));
    }
}

TEST(cut_out_materials_have_no_preview) {
    asset in = make_rich();
    set_at(&in, "materials/0", "alphaMode", json_string("MASK"));
    FREED_BY(end_lighting) lighting l = begin_lighting(in, false);
    light_white(&l, VSH_LIT_PREVIEW);
    for (size_t m = 0; m < count_of(&l.out, "materials"); ++m) {
        const json_t *material = item_of(&l.out, "materials", m);
        const char *name = json_string_value(json_object_get(material, "name"));
        if (name != NULL && strcmp(name, "tiles") == 0) {
            assert_json_equal(item_of(&in, "materials", 0), material, "tiles");
        }
    }
}

/* --- where they go */

TEST(images_go_beside_a_gltf_with_its_buffer) {
    static const uint32_t pages[2] = {0, 1};
    FREED_BY(end_lighting) lighting l = begin_lighting(make_rich(), false);
    l.lit[0].page = 1;
    const vsh_lit_image images[2] = {white_image(VSH_LIT_LIGHTMAP, 0), white_image(VSH_LIT_LIGHTMAP, 1)};
    vsh_lit_options options = options_of(images, 2);
    options.chart_pages = pages;
    options.chart_count = 2;
    write_lit(path_of("in.glb").text, l.model, l.lit, &options, path_of("a b.gltf").text);
    l.out = load_asset(path_of("a b.gltf").text);
    assert_string_equal(text_at(&l.out, "buffers/0/uri"), "a%20b.bin");
    assert_string_equal(text_at(&l.out, "buffers/0/name"), "all");
    assert_string_equal(text_at(&l.out, "images/1/uri"), "a%20b.lightmap.0.png");
    assert_string_equal(text_at(&l.out, "images/2/uri"), "a%20b.lightmap.1.png");
    assert_views_kept(&l.in, &l.out);
    static const char *const written[] = {"a b.lightmap.0.png", "a b.lightmap.1.png"};
    for (size_t i = 0; i < 2; ++i) {
        size_t size;
        FREED unsigned char *bytes = load_bytes(path_of(written[i]).text, &size);
        assert_int_equal(size, sizeof white_png);
        assert_memory_equal(bytes, white_png, size);
        remove_file(written[i]);
    }
    /* and it can be read again */
    OWNED(vsh_model) *again = read_model(path_of("a b.gltf").text);
    assert_int_equal(vsh_model_mesh_count(again), vsh_model_mesh_count(l.model));
    remove_file("a b.gltf");
    remove_file("a b.bin");
}

TEST(images_come_along_into_another_folder) {
    asset in = make_rich();
    put_item(&in, "images", parsed("{\"uri\":\"gone.png\"}"));
    put_item(&in, "images", parsed("{\"uri\":\"link.png\"}"));
    put_item(&in, "images", parsed("{\"uri\":\"https://a.b/c.png\"}"));
    assert_int_equal(symlink("/etc/passwd", path_of("link.png").text), 0);
    assert_int_equal(mkdir(path_of("other").text, 0777), 0);
    FREED_BY(end_lighting) lighting l = begin_lighting(in, false);
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    warnings[0] = '\0';
    assert_ok(vsh_lit_write(path_of("in.glb").text, l.model, NULL, NULL, path_of("other/out.glb").text, &run,
                            &failure));
    l.out = load_asset(path_of("other/out.glb").text);
    assert_null(text_at(&l.out, "images/0/uri"));
    assert_string_equal(text_at(&l.out, "images/0/name"), "tile");
    assert_memory_equal(bytes_of_view(&l.out, number_of(item_of(&l.out, "images", 0), "bufferView")),
                        white_png, sizeof white_png);
    for (size_t i = 1; i < 4; ++i) { /* what cannot be had stays as it was */
        assert_json_equal(item_of(&in, "images", i), item_of(&l.out, "images", i), "an image");
    }
    assert_non_null(strstr(warnings, "gone.png"));
    assert_non_null(strstr(warnings, "outside of the model's folder"));
    remove_file("other/out.glb");
    assert_int_equal(rmdir(path_of("other").text), 0);
    remove_file("link.png");
}

/* --- the reader */

TEST(draco_is_decoded_by_a_reader_to_the_same_bytes) {
    static const char path[] = VSH_MODELS "/scene_draco.glb";
    vsh_model *model = read_model(path);
    vsh_lit_mesh *lit = make_all_lit(model, true);
    asset out[2];
    for (int i = 0; i < 2; ++i) {
        vsh_run run = vsh_run_default();
        run.reader = i == 1 ? "/proc/self/exe" : NULL;
        assert_ok(vsh_lit_write(path, model, lit, NULL, path_of("out.glb").text, &run, &failure));
        out[i] = load_asset(path_of("out.glb").text);
    }
    assert_same_asset(&out[0], &out[1]);
    free_asset(&out[0]);
    free_asset(&out[1]);
    free_lit(lit, vsh_model_mesh_count(model));
    vsh_model_free(model);
    remove_file("out.glb");
}

int main(int argc, char **argv) {
    if (argc >= 2 && strcmp(argv[1], VSH_READER_ARGUMENT) == 0) {
        return vsh_reader_serve(argc, argv);
    }
    return run_all_tests(make_folder, remove_folder);
}
