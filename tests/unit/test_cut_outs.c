/* Files whose materials cut out what casts: from glTF and its textures to what rays meet, in the process
 * itself and by a reader, which is this test. */
#include "leaf_files.h"

#include "base/vec.h"
#include "trace/embree.h"

#include <vdbshade/reader.h>
#include <vdbshade/scene.h>
#include <vdbshade/settings.h>

static vsh_result load(bool reader, const vsh_scene *scene, vsh_assets **assets, vsh_error *error) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    run.reader = reader ? "/proc/self/exe" : NULL;
    run.reader_seconds = reader ? 120.0 : 0.0;
    warnings[0] = '\0';
    return vsh_assets_load(scene, &run, assets, error);
}

typedef struct casting {
    file_path path;
    vsh_caster caster;
    vsh_scene scene;
} casting;

static vsh_scene *cast_of(casting *c) {
    *c = (casting){.path = path_of("a.gltf")};
    c->scene = vsh_scene_default();
    c->caster = (vsh_caster){.type = VSH_CASTER_MESH, .path = c->path.text};
    for (int k = 0; k < 12; k += 5) {
        c->caster.transform[k] = 1.0;
    }
    c->scene.casters = &c->caster;
    c->scene.caster_count = 1;
    return &c->scene;
}

/* What of places all over the card stops a ray upwards: each is asked of `expected` (1: it does, -1: too near
 * to an edge to say). */
static void expect_shadow(const vsh_assets *assets, int (*expected)(double x, double z)) {
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_caster(assets, 0, &count);
    if (!vsh_triangles_available()) {
        return;
    }
    vsh_triangles *triangles = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_triangles_create(meshes, count, NULL, &triangles, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    int met = 0, asked = 0;
    for (int i = 0; i < 79 * 79; ++i) {
        const double x = -0.98 + 0.025 * (i % 79), z = -0.98 + 0.025 * (i / 79);
        const vshi_segment_ray ray = {{x, 0.0, z}, {0.0, 1.0, 0.0}, INFINITY};
        bool blocked = false;
        vshi_triangles_blocked(triangles, &ray, 1, &blocked);
        const int is = expected(x, z);
        if (is >= 0) {
            if (blocked != (is == 1)) {
                fail_msg("(%g, %g) is %s", x, z, blocked ? "blocked" : "free");
            }
            met += blocked;
            ++asked;
        }
    }
    assert_true(asked > 5000 && met > 150);
    vsh_triangles_free(triangles);
}

static int by_disc(double x, double z) {
    const double off = hypot(x - CENTRE[0], z - CENTRE[1]) - RADIUS;
    return fabs(off) < 3e-3 ? -1 : off < 0.0;
}

static int everywhere(double x, double z) {
    (void)x, (void)z;
    return 1;
}

#define MASKED(more)                                                                                         \
    "{\"name\":\"leaf\",\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0"  \
    "}" more "}}"

static void a_card_casts_the_disc_in_its_textures_alpha(void **state) {
    (void)state;
    const bytes png = disc_image("disc.png", 0.0f);
    char *uri = data_uri(png);
    for (int i = 0; i < 4; ++i) {
        const bool reader = (i & 1) != 0, beside = (i & 2) != 0;
        write_card(MASKED(""), "{}", beside ? "leaf.png" : uri, 1.0f, 0.0f);
        if (beside) {
            write_bytes("leaf.png", png.at, png.size);
        }
        casting c;
        vsh_assets *assets = NULL;
        vsh_error error = {VSH_OK, ""};
        if (load(reader, cast_of(&c), &assets, &error) != VSH_OK) {
            fail_msg("%s", error.message);
        }
        assert_string_equal(warnings, "");
        expect_shadow(assets, by_disc);
        vsh_assets_free(assets);
        assert_int_equal(unlink(c.path.text), 0);
        assert_int_equal(beside ? unlink(path_of("leaf.png").text) : 0, 0);
    }
    free(uri);
    free(png.at);
}

/* What is whole is as any other mesh, and what is clear is not there. */
static void only_what_an_edge_crosses_is_asked_of_the_mask(void **state) {
    (void)state;
    const bytes png = disc_image("disc.png", 0.0f);
    char *uri = data_uri(png);
    write_card(MASKED(""), "{}", uri, 1.0f, 0.0f);
    casting c;
    vsh_assets *assets = NULL;
    assert_int_equal(load(false, cast_of(&c), &assets, NULL), VSH_OK);
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_caster(assets, 0, &count);
    assert_int_equal(count, 2);
    assert_null(meshes[0].mask);
    assert_non_null(meshes[1].mask);
    assert_int_equal(meshes[1].solidity, VSH_SOLIDITY_SHELL);
    assert_string_equal(meshes[1].material_name, "leaf");
    const size_t opaque = meshes[0].triangle_count, mixed = meshes[1].triangle_count;
    assert_in_range(opaque, 1, 20);
    assert_in_range(mixed, 20, 60);
    vsh_assets_free(assets);
    assert_int_equal(unlink(c.path.text), 0);
    free(uri);
    free(png.at);
}

/* Twice across the card: clamped, the texture's own edge goes on beyond it; mirrored, the second disc lies
 * the other way round. */
static int clamped(double x, double z) {
    return x > -0.01 || z > -0.01 ? (fabs(x) < 0.02 || fabs(z) < 0.02 ? -1 : 0)
                                  : by_disc(2.0 * x + 1.0, 2.0 * z + 1.0);
}

static int repeated(double x, double z) {
    return by_disc(2.0 * x + (x < 0.0 ? 1.0 : -1.0), 2.0 * z + (z < 0.0 ? 1.0 : -1.0));
}

static int mirrored(double x, double z) {
    return by_disc(x < 0.0 ? 2.0 * x + 1.0 : 1.0 - 2.0 * x, z < 0.0 ? 2.0 * z + 1.0 : 1.0 - 2.0 * z);
}

static int turned(double x, double z) {
    return by_disc(-x, -z);
}

static void wraps_and_texture_transforms_are_those_of_the_file(void **state) {
    (void)state;
    static const char transformed[] =
        "{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0,\"extensions\":"
        "{\"KHR_texture_transform\":{\"offset\":[1,1],\"scale\":[-1,-1]}}}}}";
    static const struct {
        const char *sampler, *material;
        float scale;
        int (*expected)(double x, double z);
    } cases[] = {{"{\"wrapS\":33071,\"wrapT\":33071}", MASKED(""), 2.0f, clamped},
                 {"{}", MASKED(""), 2.0f, repeated},
                 {"{\"wrapS\":33648,\"wrapT\":33648}", MASKED(""), 2.0f, mirrored},
                 {"{}", transformed, 1.0f, turned}};
    const bytes png = disc_image("disc.png", 0.0f);
    char *uri = data_uri(png);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        write_card(cases[i].material, cases[i].sampler, uri, cases[i].scale, 0.0f);
        casting c;
        vsh_assets *assets = NULL;
        assert_int_equal(load(false, cast_of(&c), &assets, NULL), VSH_OK);
        expect_shadow(assets, cases[i].expected);
        vsh_assets_free(assets);
        assert_int_equal(unlink(c.path.text), 0);
    }
    free(uri);
    free(png.at);
}

/* Alpha is 0.4 out of the disc and 1 in it. */
static void cutoff_and_base_factor_decide(void **state) {
    (void)state;
    static const struct {
        const char *material;
        int (*expected)(double x, double z); /* NULL: nothing casts */
    } cases[] = {
        {"{\"alphaMode\":\"MASK\",\"alphaCutoff\":0.3,\"pbrMetallicRoughness\":{\"baseColorTexture\":{"
         "\"index\":0}}}",
         everywhere},
        {"{\"alphaMode\":\"MASK\",\"alphaCutoff\":0.35,\"pbrMetallicRoughness\":{\"baseColorFactor\":["
         "1,1,1,0.5],\"baseColorTexture\":{\"index\":0}}}",
         by_disc},
        {"{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.4],"
         "\"baseColorTexture\":{\"index\":0}}}",
         NULL},
        {"{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.4]}}", NULL},
        {"{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.6]}}", everywhere},
        {"{\"alphaMode\":\"MASK\",\"alphaCutoff\":0}", everywhere}};
    const bytes png = disc_image("disc.png", 0.4f);
    char *uri = data_uri(png);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        write_card(cases[i].material, "{}", uri, 1.0f, 0.0f);
        casting c;
        vsh_assets *assets = NULL;
        vsh_error error = {VSH_OK, ""};
        const vsh_result result = load(false, cast_of(&c), &assets, &error);
        assert_int_equal(result, cases[i].expected != NULL ? VSH_OK : VSH_ERROR_INPUT);
        if (result == VSH_OK && i != 1) {
            expect_shadow(assets, cases[i].expected);
        } else if (result == VSH_OK) { /* 0.5 × alpha is 0.35 where the ramp is at a half of it */
            expect_shadow(assets, by_disc);
        } else {
            assert_non_null(strstr(error.message, "leave nothing"));
        }
        vsh_assets_free(assets);
        assert_int_equal(unlink(c.path.text), 0);
    }
    free(uri);
    free(png.at);
}

static void blended_cards_cast_where_they_are_cut_out_and_glass_does_not(void **state) {
    (void)state;
    static const char leaf[] = "{\"name\":\"leaf\",\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{"
                               "\"baseColorTexture\":{\"index\":0}}}";
    static const char glass[] = "{\"name\":\"glass\",\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{"
                                "\"baseColorFactor\":[1,1,1,0.3],\"baseColorTexture\":{\"index\":0}}}";
    static const char plain[] =
        "{\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,"
        "0.3]}}";
    static const struct {
        const char *material;
        float outside; /* alpha there */
        bool cast_blended;
        int (*expected)(double x, double z);
    } cases[] = {{leaf, 0.0f, false, by_disc}, {leaf, 0.3f, false, NULL},  {glass, 0.0f, false, NULL},
                 {glass, 0.0f, true, by_disc}, {plain, 0.0f, false, NULL}, {plain, 0.0f, true, everywhere}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        const bytes png = disc_image("disc.png", cases[i].outside);
        char *uri = data_uri(png);
        write_card(cases[i].material, "{}", uri, 1.0f, 0.0f);
        casting c;
        vsh_assets *assets = NULL;
        vsh_error error = {VSH_OK, ""};
        cast_of(&c)->cast_blended = cases[i].cast_blended;
        const vsh_result result = load(false, &c.scene, &assets, &error);
        assert_int_equal(result, cases[i].expected != NULL ? VSH_OK : VSH_ERROR_INPUT);
        if (result == VSH_OK) {
            expect_shadow(assets, cases[i].expected);
            assert_int_equal(strstr(warnings, "at least half") != NULL, !cases[i].cast_blended);
        } else {
            assert_non_null(strstr(error.message, "blended"));
        }
        vsh_assets_free(assets);
        assert_int_equal(unlink(c.path.text), 0);
        free(uri);
        free(png.at);
    }
}

static void textures_that_cannot_be_had_leave_the_card_whole(void **state) {
    (void)state;
    const bytes png = disc_image("disc.png", 0.0f);
    const bytes cut = {png.at, png.size / 2};
    unsigned char damaged[512];
    memcpy(damaged, png.at, sizeof damaged);
    memset(damaged + 40, 0x55, sizeof damaged - 40);
    const bytes none[] = {cut,
                          {damaged, sizeof damaged},
                          {(unsigned char *)(uintptr_t) "no image", 8},
                          {(unsigned char *)(uintptr_t) "\xff\xd8\xff\xe0 nor this", 14},
                          {(unsigned char *)(uintptr_t) "RIFF\1\0\0\0WEBPVP8 ", 16}};
    for (size_t i = 0; i < 2 * (sizeof none / sizeof none[0] + 1); ++i) {
        const bool reader = i % 2 != 0, missing = i / 2 == sizeof none / sizeof none[0];
        char *uri = missing ? strdup("gone.png") : data_uri(none[i / 2]);
        write_card(MASKED(""), "{}", uri, 1.0f, 0.0f);
        casting c;
        vsh_assets *assets = NULL;
        vsh_error error = {VSH_OK, ""};
        if (load(reader, cast_of(&c), &assets, &error) != VSH_OK) {
            fail_msg("%s", error.message);
        }
        assert_non_null(strstr(warnings, "material 'leaf' casts whole"));
        assert_null(strchr(warnings, '\n'));
        expect_shadow(assets, everywhere);
        vsh_assets_free(assets);
        assert_int_equal(unlink(c.path.text), 0);
        free(uri);
    }
    free(png.at);
}

static void cards_without_uvs_are_whole(void **state) {
    (void)state;
    const bytes png = disc_image("disc.png", 0.0f);
    char *uri = data_uri(png);
    write_card("{\"name\":\"leaf\",\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{"
               "\"index\":0,\"texCoord\":2}}}",
               "{}", uri, 1.0f, 0.0f);
    casting c;
    vsh_assets *assets = NULL;
    assert_int_equal(load(false, cast_of(&c), &assets, NULL), VSH_OK);
    assert_non_null(strstr(warnings, "no UV set 2"));
    expect_shadow(assets, everywhere);
    vsh_assets_free(assets);
    assert_int_equal(unlink(c.path.text), 0);
    free(uri);
    free(png.at);
}

static void a_texture_past_the_memory_limit_is_an_error(void **state) {
    (void)state;
    const bytes png = disc_image("disc.png", 0.0f);
    char *uri = data_uri(png);
    write_card(MASKED(""), "{}", uri, 1.0f, 0.0f);
    casting c;
    vsh_run run = vsh_run_default();
    vsh_error error = {VSH_OK, ""};
    vsh_assets *assets = NULL;
    run.memory_limit = 4 * TEXELS * TEXELS * sizeof(float) - 1;
    assert_int_equal(vsh_assets_load(cast_of(&c), &run, &assets, &error), VSH_ERROR_LIMIT);
    assert_non_null(strstr(error.message, "material 'leaf'"));
    assert_null(assets);
    assert_int_equal(unlink(c.path.text), 0);
    free(uri);
    free(png.at);
}

static void patterns_mean_materials_where_no_object_is_called_so(void **state) {
    (void)state;
    static const struct {
        const char *pattern;
        bool matches;
    } cases[] = {{"leaf", true},           {"l*f", true},          {"material:leaf", true}, {"card", true},
                 {"material:card", false}, {"material:l?", false}, {"leav", false}};
    write_card("{\"name\":\"leaf\"}", "{}", "x.png", 1.0f, 0.0f);
    for (size_t i = 0; i < 2 * sizeof cases / sizeof cases[0]; ++i) {
        casting c;
        vsh_assets *assets = NULL;
        vsh_error error = {VSH_OK, ""};
        const char *const patterns[] = {cases[i / 2].pattern};
        cast_of(&c);
        if (i % 2 == 0) {
            c.caster.one_sided = patterns;
            c.caster.one_sided_count = 1;
        } else {
            c.caster.objects = (vsh_selection){.except = patterns, .except_count = 1};
        }
        const vsh_result result = load(false, &c.scene, &assets, &error);
        assert_int_equal(result, i % 2 == 0 && cases[i / 2].matches ? VSH_OK : VSH_ERROR_INPUT);
        if (result == VSH_OK) {
            size_t count = 0;
            assert_int_equal(vsh_assets_caster(assets, 0, &count)[0].one_sided, 1);
        } else {
            const char *part =
                cases[i / 2].matches ? "no object is left" : "there are 'card', and materials 'leaf'";
            if (strstr(error.message, part) == NULL) {
                fail_msg("'%s': no '%s'", error.message, part);
            }
        }
        vsh_assets_free(assets);
    }
    assert_int_equal(unlink(path_of("a.gltf").text), 0);
}

int main(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], VSH_READER_ARGUMENT) == 0) {
        return vsh_reader_serve(argc, argv);
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_card_casts_the_disc_in_its_textures_alpha),
        cmocka_unit_test(only_what_an_edge_crosses_is_asked_of_the_mask),
        cmocka_unit_test(wraps_and_texture_transforms_are_those_of_the_file),
        cmocka_unit_test(cutoff_and_base_factor_decide),
        cmocka_unit_test(blended_cards_cast_where_they_are_cut_out_and_glass_does_not),
        cmocka_unit_test(textures_that_cannot_be_had_leave_the_card_whole),
        cmocka_unit_test(cards_without_uvs_are_whole),
        cmocka_unit_test(a_texture_past_the_memory_limit_is_an_error),
        cmocka_unit_test(patterns_mean_materials_where_no_object_is_called_so),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
