/* Assets that are lit again: what a bake put in goes once another takes its place, and nothing else does. */
#include "assets.h"
#include "testing.h"

enum { LIGHTMAP = 1 << VSH_LIT_LIGHTMAP, OCCLUSION = 1 << VSH_LIT_OCCLUSION, LISTS = 6 };

static const char *const lists[LISTS] = {"textures",    "images",    "samplers",
                                         "bufferViews", "accessors", "materials"};

static void free_assets(int count, ...) {
    va_list list;
    va_start(list, count);
    for (int i = 0; i < count; ++i) {
        free_asset(va_arg(list, asset *));
    }
    va_end(list);
}

/* A scene with a texture that it shows and one that it does not: the glass's. */
static asset make_scene(void) {
    asset a = load_asset(VSH_MODELS "/scene.glb");
    for (int i = 0; i < 2; ++i) {
        const int view = put_view(&a, white_png, sizeof white_png, 0, 0);
        put_item(&a, "images", json_pack("{s:i,s:s}", "bufferView", view, "mimeType", "image/png"));
    }
    put_item(&a, "samplers", parsed("{\"wrapS\":10497}"));
    put_item(&a, "textures", parsed("{\"source\":0,\"sampler\":0}"));
    put_item(&a, "textures", parsed("{\"source\":1}"));
    set_at(&a, "materials/1", "occlusionTexture", parsed("{\"index\":0}"));
    set_at(&a, "buffers/0", "byteLength", json_integer((json_int_t)a.size));
    return a;
}

/* Lights a file, whose first object may be on a page of its own. */
static void light_file(const char *in, int purposes, uint32_t pages, int32_t place, const char *out,
                       const vsh_run *run) {
    OWNED(vsh_model) *model = read_model(path_of(in).text);
    vsh_lit_mesh *lit = make_all_lit(model, true);
    lit[0].page = pages - 1;
    vsh_lit_image images[4];
    size_t count = 0;
    for (int purpose = 0; purpose < VSH_LIT_PURPOSES; ++purpose) {
        for (uint32_t page = 0; page < pages && (purposes >> purpose & 1) != 0; ++page) {
            images[count++] = white_image(purpose, page);
        }
    }
    vsh_lit_options options = options_of(images, count);
    options.image_place = place;
    assert_ok(vsh_lit_write(path_of(in).text, model, lit, &options, path_of(out).text, run, &failure));
    keep_file(path_of(out).text);
    free_lit(lit, vsh_model_mesh_count(model));
}

static asset light_again(const asset *in, int purposes, uint32_t pages) {
    write_glb(in, "in.glb");
    light_file("in.glb", purposes, pages, VSH_LIT_IMAGES_EMBED, "out.glb", NULL);
    asset out = load_asset(path_of("out.glb").text);
    remove_file("in.glb");
    remove_file("out.glb");
    return out;
}

/* What a scene had of its own is where it was. */
static void assert_own_kept(const asset *in, const asset *out) {
    assert_list_kept(in, out, "textures", "");
    assert_list_kept(in, out, "samplers", "");
    assert_list_kept(in, out, "images", "bufferView");
    for (size_t i = 0; i < 2; ++i) {
        const size_t view = number_of(item_of(out, "images", i), "bufferView");
        assert_memory_equal(bytes_of_view(out, view), white_png, sizeof white_png);
    }
}

static void assert_counts(const asset *a, const asset *b, size_t list_count) {
    for (size_t k = 0; k < list_count; ++k) {
        assert_int_equal(count_of(a, lists[k]), count_of(b, lists[k]));
    }
}

/* Every index leads to what it did. */
static void assert_shown(const asset *out, int purposes) {
    static const struct {
        const char *name, *info;
    } shown[] = {[VSH_LIT_OCCLUSION] = {"occlusion", "occlusionTexture"},
                 [VSH_LIT_LIGHTMAP] = {"lightmap", "extensions/MOZ_lightmap"}};
    for (size_t m = 0; m < count_of(out, "materials"); ++m) {
        json_t *material = json_array_get(list_of(out, "materials"), m);
        for (int purpose = 0; purpose < 2; ++purpose) {
            if ((purposes >> purpose & 1) == 0) {
                continue;
            }
            const json_t *info = json_at(material, shown[purpose].info);
            const json_t *texture = item_of(out, "textures", number_of(info, "index"));
            const json_t *image = item_of(out, "images", number_of(texture, "source"));
            const json_t *sampler = item_of(out, "samplers", number_of(texture, "sampler"));
            assert_string_equal(json_string_value(json_object_get(image, "name")), shown[purpose].name);
            assert_int_equal(number_of(sampler, "wrapS"), 33071);
            assert_memory_equal(bytes_of_view(out, number_of(image, "bufferView")), white_png,
                                sizeof white_png);
        }
    }
}

TEST(what_a_bake_made_is_replaced_by_the_next_to_the_same_file) {
    asset in = make_scene(), one = light_again(&in, OCCLUSION | LIGHTMAP, 1);
    assert_own_kept(&in, &one);
    assert_shown(&one, OCCLUSION | LIGHTMAP);
    assert_int_equal(count_of(&one, "textures"), 4);
    asset last = light_again(&one, OCCLUSION | LIGHTMAP, 1);
    for (int i = 0; i < 3; ++i) {
        asset again = light_again(&last, OCCLUSION | LIGHTMAP, 1);
        assert_own_kept(&in, &again);
        assert_shown(&again, OCCLUSION | LIGHTMAP);
        assert_counts(&one, &again, LISTS);
        assert_int_equal(one.size, again.size);
        assert_same_asset(&last, &again);
        free_asset(&last);
        last = again;
    }
    free_assets(3, &in, &one, &last);
}

TEST(fewer_pages_leave_fewer_textures) {
    asset in = make_scene(), two = light_again(&in, OCCLUSION | LIGHTMAP, 2);
    asset one = light_again(&in, OCCLUSION | LIGHTMAP, 1);
    assert_int_equal(count_of(&two, "textures"), 6);
    asset less = light_again(&two, OCCLUSION | LIGHTMAP, 1),
          more = light_again(&one, OCCLUSION | LIGHTMAP, 2);
    assert_counts(&less, &one, 3);
    assert_counts(&more, &two, 3);
    assert_own_kept(&in, &less);
    assert_own_kept(&in, &more);
    assert_shown(&less, OCCLUSION | LIGHTMAP);
    /* a lightmap that is not baked again stays, with what shows it */
    asset ao = light_again(&one, OCCLUSION, 1);
    assert_int_equal(count_of(&ao, "textures"), 4);
    assert_own_kept(&in, &ao);
    assert_shown(&ao, OCCLUSION | LIGHTMAP);
    free_assets(6, &in, &two, &one, &less, &more, &ao);
}

TEST(what_others_use_or_made_stays) {
    asset in = make_scene(), one = light_again(&in, LIGHTMAP, 1);
    const json_int_t image = (json_int_t)number_of(item_of(&one, "textures", 2), "source");
    /* a stranger's, with the same image */
    put_item(&one, "extensionsUsed", json_string("EXT_texture_avif"));
    put_item(&one, "textures", json_pack("{s:{s:{s:I}}}", "extensions", "EXT_texture_avif", "source", image));
    asset two = light_again(&one, LIGHTMAP, 1);
    assert_int_equal(count_of(&two, "textures"), 4);
    assert_int_equal(count_of(&two, "images"), 4);
    assert_list_kept(&one, &two, "textures", "source");
    assert_list_kept(&one, &two, "samplers", "");
    assert_int_equal(number_of(item_of(&two, "textures", 2), "source"), image + 1);
    assert_json_equal(item_of(&one, "textures", 3), item_of(&two, "textures", 3), "a texture");
    /* one that nothing shows, though it says that it was made */
    put_item(&two, "textures", json_deep_copy(item_of(&two, "textures", 2)));
    asset three = light_again(&two, LIGHTMAP, 1);
    assert_int_equal(count_of(&three, "textures"), 5);
    assert_json_equal(item_of(&two, "textures", 4), item_of(&three, "textures", 4), "a texture");
    assert_int_equal(count_of(&three, "images"), 5);
    assert_int_equal(count_of(&three, "samplers"), 3);
    assert_int_equal(number_of(item_of(&three, "textures", 2), "sampler"), 2);
    /* a mark that is gone */
    json_object_del(json_at(three.root, "textures/2"), "extras");
    asset four = light_again(&three, LIGHTMAP, 1);
    assert_list_kept(&three, &four, "textures", "");
    assert_int_equal(count_of(&four, "textures"), 6);
    free_assets(5, &in, &one, &two, &three, &four);
}

/* What pads an image to whole eights of bytes goes with it, unless something begins there. */
TEST(bytes_that_begin_where_those_of_a_bake_end_stay) {
    static const unsigned char bytes[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    asset in = make_scene(), one = light_again(&in, LIGHTMAP, 1);
    const json_t *last = item_of(&one, "bufferViews", count_of(&one, "bufferViews") - 1);
    assert_int_equal(number_of(last, "byteLength"), sizeof white_png);
    one.size = number_of(last, "byteOffset") + sizeof white_png;
    const size_t view = (size_t)put_view(&one, bytes, sizeof bytes, 0, 0);
    assert_int_equal(number_of(item_of(&one, "bufferViews", view), "byteOffset") % 8, 4);
    put_accessor(&one, (int)view, 0, 5125, 3, "SCALAR", "");
    set_at(&one, "buffers/0", "byteLength", json_integer((json_int_t)one.size));
    asset two = light_again(&one, LIGHTMAP, 1);
    assert_memory_equal(bytes_of_view(&two, view), bytes, sizeof bytes);
    free_assets(3, &in, &one, &two);
}

TEST(beside_an_extension_that_is_not_known_all_stays) {
    asset in = make_scene(), one = light_again(&in, LIGHTMAP, 1);
    put_item(&one, "extensionsUsed", json_string("VENDOR_skylights"));
    set_at(&one, "", "extensions", parsed("{\"VENDOR_skylights\":{\"texture\":2}}"));
    asset two = light_again(&one, LIGHTMAP, 1);
    assert_list_kept(&one, &two, "textures", "");
    assert_list_kept(&one, &two, "images", "");
    assert_int_equal(count_of(&two, "textures"), count_of(&one, "textures") + 1);
    free_assets(3, &in, &one, &two);
}

/* A number of another list, in a material of an extension that is known by its beginning. */
TEST(numbers_in_extensions_of_materials_stay_as_they_are) {
    asset in = make_scene(), one = light_again(&in, LIGHTMAP, 1);
    put_item(&one, "extensionsUsed", json_string("KHR_materials_woven"));
    set_at(&one, "materials/0/extensions", "KHR_materials_woven", parsed("{\"weave\":{\"index\":3}}"));
    asset two = light_again(&one, LIGHTMAP, 1);
    assert_int_equal(count_of(&two, "textures"), 3);
    assert_json_equal(json_at(one.root, "materials/0/extensions/KHR_materials_woven"),
                      json_at(two.root, "materials/0/extensions/KHR_materials_woven"), "an extension");
    free_assets(3, &in, &one, &two);
}

TEST(files_that_were_made_are_left_and_no_longer_named) {
    asset in = make_scene();
    write_glb(&in, "in.glb");
    light_file("in.glb", LIGHTMAP, 1, VSH_LIT_IMAGES_BESIDE, "lit.gltf", NULL);
    asset one = load_asset(path_of("lit.gltf").text);
    light_file("lit.gltf", LIGHTMAP, 1, VSH_LIT_IMAGES_BESIDE, "again.gltf", NULL);
    asset two = load_asset(path_of("again.gltf").text);
    assert_counts(&one, &two, LISTS);
    assert_string_equal(text_at(&two, "images/2/uri"), "again.lightmap.png");
    assert_int_equal(one.size, two.size);
    remove_file("lit.lightmap.png"); /* which is there */
    /* what goes is not brought along, nor missed */
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    warnings[0] = '\0';
    assert_int_equal(mkdir(path_of("other").text, 0777), 0);
    light_file("lit.gltf", LIGHTMAP, 1, VSH_LIT_IMAGES_BESIDE, "other/lit.gltf", &run);
    assert_string_equal(warnings, "");
    asset far = load_asset(path_of("other/lit.gltf").text);
    assert_string_equal(text_at(&far, "images/2/uri"), "lit.lightmap.png");
    assert_int_equal(far.size, one.size);
    free_assets(4, &in, &one, &two, &far);
    static const char *const left[] = {"in.glb",         "lit.gltf",      "lit.bin",
                                       "again.gltf",     "again.bin",     "again.lightmap.png",
                                       "other/lit.gltf", "other/lit.bin", "other/lit.lightmap.png"};
    for (size_t i = 0; i < sizeof left / sizeof left[0]; ++i) {
        remove_file(left[i]);
    }
    assert_int_equal(rmdir(path_of("other").text), 0);
}

FIXTURE(make_folder, remove_folder)
