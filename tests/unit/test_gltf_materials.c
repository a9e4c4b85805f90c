/* Materials and lights of a glTF: where light comes through masked materials, where lights stand, and what is
 * refused. */
#include "gltf_maker.h"
#include "handles.h"
#include "io/model/model.h"

/* Five bytes are the image, in buffer view 2. */
static const unsigned char image[5] = {'I', 'M', 'A', 'G', 'E'};

static const char *material_json(const char *materials, const char *more) {
    char rest[4096];
    FREED maker *m = begin();
    memcpy(m->bytes + m->size, image, sizeof image);
    snprintf(m->views + strlen(m->views), 100, ",{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":5}",
             m->size);
    m->size += 8;
    snprintf(rest, sizeof rest,
             ALONE "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"material\":1},"
                   "{\"attributes\":{\"POSITION\":0}},{\"attributes\":{\"POSITION\":0},\"material\":0}]}],"
                   "\"materials\":[%s],%s",
             materials, more);
    return text_of(m, rest);
}

#define LEAF(more)                                                                                           \
    "{\"name\":\"plain\",\"alphaCutoff\":0.9},{\"name\":\"leaf\",\"alphaMode\":\"MASK\",\"alphaCutoff\":0."  \
    "25,"                                                                                                    \
    "\"doubleSided\":true,\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.75],\"baseColorTexture\":{" \
    "\"index\":0" more "}}}"

static const char textures[] = "\"textures\":[{\"source\":0,\"sampler\":0}],\"samplers\":[{\"wrapS\":33071,"
                               "\"wrapT\":33648}],\"images\":[{\"bufferView\":2,\"mimeType\":\"image/png\"}]";

TEST(masked_materials_come_with_their_image) {
    OWNED(vsh_model) *model = read_text("a.gltf", material_json(LEAF(",\"texCoord\":3"), textures));
    assert_int_equal(model->material_count, 2);
    assert_int_equal(model->shapes[model->entries[0].shape].material, 2);
    assert_int_equal(model->shapes[model->entries[1].shape].material, 0);
    assert_int_equal(model->shapes[model->entries[2].shape].material, 1);
    assert_int_equal(vsh_model_mesh(model, 0, 0).alpha, VSH_ALPHA_MASKED);
    const vshi_material plain = vshi_model_get_material(model, 0);
    assert_string_equal(plain.name, "plain");
    assert_true(plain.alpha == VSH_ALPHA_OPAQUE && plain.double_sided == 0 && plain.alpha_cutoff == 0.0);
    assert_null(plain.image);
    const vshi_material leaf = vshi_model_get_material(model, 1);
    assert_string_equal(leaf.name, "leaf");
    assert_true(leaf.alpha == VSH_ALPHA_MASKED && leaf.double_sided == 1);
    assert_true(leaf.alpha_cutoff == 0.25 && leaf.base_alpha == 0.75);
    assert_int_equal(leaf.uv_set, 3);
    assert_true(leaf.wrap[0] == VSH_WRAP_CLAMP && leaf.wrap[1] == VSH_WRAP_MIRROR);
    assert_int_equal(leaf.image_size, sizeof image);
    assert_memory_equal(leaf.image, image, sizeof image);
    assert_null(leaf.image_path);
}

static void assert_maps(const vshi_material *m, double u, double v, double to_u, double to_v) {
    const double *t = m->uv_transform;
    const double made[2] = {t[0] * u + t[1] * v + t[2], t[3] * u + t[4] * v + t[5]};
    assert_that(fabs(made[0] - to_u) < 1e-12 && fabs(made[1] - to_v) < 1e-12,
                "(%g, %g) becomes (%.17g, %.17g), expected (%g, %g)", u, v, made[0], made[1], to_u, to_v);
}

/* By hand: in the file's UVs (v down) scaled, turned so that u goes the way of -v, moved. */
TEST(transforms_map_uvs_with_v_up) {
    static const struct {
        const char *texture;
        int32_t uv_set;
        double maps[2][4]; /* from u, v to u, v */
    } cases[] = {
        {"", 0, {{0.25, 0.75, 0.25, 0.75}, {0, 0, 0, 0}}},
        {",\"texCoord\":1,\"extensions\":{\"KHR_texture_transform\":{\"offset\":[0.5,0.25],\"scale\":[2,4],"
         "\"texCoord\":2}}",
         2,
         {{0.0, 1.0, 0.5, 1.0 - 0.25},
          {0.5, 0.75, 1.5, 1.0 - 1.25}}}, /* (0, 0) is at (0.5, 0.25) of the file */
        /* (0.25, 0) → (0.5, 0) → (0, -0.5) → (0, 0.5); (0, 0.25) → (0.25, 0) → (0.25, 1) */
        {",\"extensions\":{\"KHR_texture_transform\":{\"offset\":[0,1],\"rotation\":1.5707963267948966,"
         "\"scale\":[2,1]}}",
         0,
         {{0.25, 1.0, 0.0, 1.0 - (1.0 - 0.5)}, {0.0, 0.75, 0.25, 1.0 - 1.0}}}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        char material[512];
        snprintf(material, sizeof material, LEAF("%s"), cases[i].texture);
        OWNED(vsh_model) *model = read_text("a.gltf", material_json(material, textures));
        const vshi_material leaf = vshi_model_get_material(model, 1);
        assert_int_equal(leaf.uv_set, cases[i].uv_set);
        for (int k = 0; k < 2; ++k) {
            const double *m = cases[i].maps[k];
            assert_maps(&leaf, m[0], m[1], m[2], m[3]);
        }
    }
}

#define MOVED(numbers, more) "\"extensions\":{\"KHR_texture_transform\":{" numbers more "}}"
#define UNPACK "\"scale\":[0.0001220703125,0.000244140625],\"offset\":[0.25,0.125]" /* 1 / 8192, 1 / 4096 */
#define BASE(more) "\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0," more "}}"
#define OCCLUSION(more) ",\"occlusionTexture\":{\"index\":0," more "}"

/* Two triangles of one material, whose UVs are those of accessors. */
static const char *packed_json(const char *material, int one, int other) {
    static const uint16_t integers[4][2] = {{0, 0}, {4096, 0}, {0, 2048}};
    static const float plain[4][2] = {{0, 0}, {0.5F, 0}, {0, 0.25F}};
    char rest[4096];
    FREED maker *m = begin();
    add(m, integers, sizeof integers, "", USHORTS, 4, "VEC2", "");
    add(m, integers, sizeof integers, "", USHORTS, 4, "VEC2", ",\"normalized\":true");
    add(m, plain, sizeof plain, "", FLOATS, 4, "VEC2", "");
    snprintf(rest, sizeof rest,
             ALONE
             "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":%d},\"material\":"
             "0},{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":%d},\"material\":0}]}],"
             "\"materials\":[{\"alphaMode\":\"MASK\",%s}],\"textures\":[{}]",
             one, other, material);
    return text_of(m, rest);
}

TEST(uvs_that_a_packer_made_integers_are_what_textures_see) {
    enum { INTEGER = 2, NORMALIZED, PLAIN };
    static const struct {
        const char *material;
        int one, other; /* accessors */
        double u, v;    /* of corner 1 of the first, v up */
        double other_u, other_v;
        bool left; /* the material's transform is still to be applied */
    } cases[] = {
        {BASE(MOVED(UNPACK, "")), INTEGER, INTEGER, 0.75, 0.875, 0.75, 0.875, false},
        {BASE(MOVED(UNPACK, "")) OCCLUSION(MOVED(UNPACK, "")), INTEGER, INTEGER, 0.75, 0.875, 0.75, 0.875,
         false},
        {BASE(MOVED("\"scale\":[7.9998779296875,15.999755859375],\"offset\":[0.25,0.125]", "")), NORMALIZED,
         NORMALIZED, 0.75, 0.875, 0.75, 0.875, false},
        /* one primitive is packed: the transform applies to all of the material */
        {BASE(MOVED("\"scale\":[0.5,0.5]", "")), INTEGER, PLAIN, 2048.0, 1.0, 0.25, 1.0, false},
        /* floats come from no packer */
        {BASE(MOVED("\"scale\":[0.5,0.5]", "")), PLAIN, PLAIN, 0.5, 1.0, 0.5, 1.0, true},
        /* transforms that differ; a texture in another set; a transform that names another set */
        {BASE(MOVED(UNPACK, "")) OCCLUSION("\"texCoord\":0"), INTEGER, INTEGER, 4096.0, 1.0, 4096.0, 1.0,
         true},
        {BASE(MOVED(UNPACK, "")) OCCLUSION("\"texCoord\":1"), INTEGER, INTEGER, 0.75, 0.875, 0.75, 0.875,
         false},
        {BASE("\"texCoord\":1," MOVED(UNPACK, ",\"texCoord\":0")), INTEGER, INTEGER, 0.75, 0.875, 0.75, 0.875,
         false},
        {BASE(MOVED(UNPACK, ",\"texCoord\":1")), INTEGER, INTEGER, 4096.0, 1.0, 4096.0, 1.0, true},
        /* no texture, so no transform */
        {"\"name\":\"plain\"", INTEGER, INTEGER, 4096.0, 1.0, 4096.0, 1.0, false},
    };
    for (size_t c = 0; c < COUNT_OF(cases); ++c) {
        OWNED(vsh_model) *model =
            read_text("a.gltf", packed_json(cases[c].material, cases[c].one, cases[c].other));
        const double expected[2][2] = {{cases[c].u, cases[c].v}, {cases[c].other_u, cases[c].other_v}};
        for (size_t m = 0; m < 2; ++m) {
            const float *uv = vsh_model_mesh(model, m, 0).uvs + 2;
            assert_that(hypot((double)uv[0] - expected[m][0], (double)uv[1] - expected[m][1]) <= 1e-6,
                        "case %zu, mesh %zu: (%.9g, %.9g)", c, m, (double)uv[0], (double)uv[1]);
        }
        assert_int_equal(vshi_model_get_material(model, 0).uv_transform[0] != 1.0, cases[c].left);
    }
}

TEST(images_may_lie_beside_or_in_the_json) {
    OWNED(vsh_model) *model = read_text(
        "a.gltf",
        material_json(LEAF(""), "\"textures\":[{\"extensions\":{\"EXT_texture_webp\":{\"source\":0}}}],"
                                "\"images\":[{\"uri\":\"my%20leaf.webp\"}]"));
    vshi_material leaf = vshi_model_get_material(model, 1);
    assert_null(leaf.image);
    assert_string_equal(leaf.image_path, at("my leaf.webp"));
    assert_true(leaf.wrap[0] == VSH_WRAP_REPEAT && leaf.wrap[1] == VSH_WRAP_REPEAT);
    OWNED(vsh_model) *within =
        read_text("a.gltf", material_json(LEAF(""), "\"textures\":[{\"source\":0}],\"images\":[{\"uri\":"
                                                    "\"data:image/png;base64,SU1BR0U=\"}]"));
    leaf = vshi_model_get_material(within, 1);
    assert_int_equal(leaf.image_size, sizeof image);
    assert_memory_equal(leaf.image, image, sizeof image);
}

TEST(a_mask_that_cannot_be_read_is_left_out_with_a_warning) {
    static const struct {
        const char *rest, *part;
    } bad[] = {
        {"\"textures\":[]", "materials[1]: 'index' is 0, but there are only 0 textures"},
        {"\"textures\":[{\"source\":4}],\"images\":[{}]", "'source' is 4, but there are only 1 images"},
        {"\"textures\":[{\"source\":0}],\"images\":[{}]", "images[0] has neither a URI nor a buffer view"},
        {"\"textures\":[{\"source\":0}],\"images\":[{\"bufferView\":9}]", "'bufferView' is 9"},
        {"\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"https://a/b.png\"}]", "only files beside it"},
        {"\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"/etc/passwd\"}]", "outside of its folder"},
        {"\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"data:;base64,*\"}]", "no base64"},
        {"\"textures\":[{\"source\":0,\"sampler\":0}],\"images\":[{\"bufferView\":2}]", "'sampler' is 0"},
    };
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        OWNED(vsh_model) *model = read_text("a.gltf", material_json(LEAF(""), bad[i].rest));
        const vshi_material leaf = vshi_model_get_material(model, 1);
        assert_null(leaf.image);
        assert_null(leaf.image_path);
        assert_that(strstr(warnings, bad[i].part) != NULL && strstr(warnings, "its mask is ignored") != NULL,
                    "'%s', expected '%s'", warnings, bad[i].part);
    }
}

/* --- KHR_lights_punctual */

static const char *lit_json(const char *nodes, const char *lights) {
    char rest[4096];
    FREED maker *m = begin();
    snprintf(rest, sizeof rest,
             "\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0},%s],\"extensions\":{"
             "\"KHR_lights_punctual\":{\"lights\":[%s]}}," MESH("\"POSITION\":0", ""),
             nodes, lights);
    return text_of(m, rest);
}

#define CARRIES(light) "\"extensions\":{\"KHR_lights_punctual\":{\"light\":" light "}}"

static const char nodes[] =
    /* turned by 90° about y: its -z is -x; three times as large; children 2 and 3 of it */
    "{\"name\":\"key\",\"translation\":[1,2,3],\"rotation\":[0,0.70710678118654752,0,0.70710678118654752],"
    "\"scale\":[3,3,3],\"children\":[2,3]," CARRIES("0") "},"
                                                         "{\"translation\":[0,0,-1]," CARRIES(
                                                             "1") "},{\"name\":\"a\\nb\"," CARRIES("2") "}";
static const char lights[] =
    "{\"type\":\"directional\",\"name\":\"unused\",\"color\":[1,0.5,0.25],\"intensity\":4},"
    "{\"type\":\"point\",\"name\":\"lamp\",\"range\":7},"
    "{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":0.125,\"outerConeAngle\":0.5},\"intensity\":2}";

static void assert_vector(const double *given, double x, double y, double z) {
    assert_near(given[0], x, 1e-6);
    assert_near(given[1], y, 1e-6);
    assert_near(given[2], z, 1e-6);
}

TEST(lights_stand_where_their_nodes_do) {
    OWNED(vsh_model) *model = read_text("a.gltf", lit_json(nodes, lights));
    assert_int_equal(model->light_count, 3);
    const vshi_model_light sun = model->lights[0], lamp = model->lights[1];
    const vshi_model_light spot = model->lights[2];
    assert_string_equal(sun.name, "key");
    assert_int_equal(sun.type, VSHI_MODEL_LIGHT_DIRECTIONAL);
    assert_vector(sun.direction, -1, 0, 0);
    assert_vector(sun.color, 1, 0.5, 0.25);
    assert_true(sun.intensity == 4.0 && sun.range == 0.0 && sun.outer_angle == 0.0);
    assert_string_equal(lamp.name, "lamp"); /* its node has none */
    assert_int_equal(lamp.type, VSHI_MODEL_LIGHT_POINT);
    assert_vector(lamp.position, 1 - 3, 2, 3); /* a unit in front of it, thrice as large */
    assert_vector(lamp.direction, 0, 0, 0);
    assert_vector(lamp.color, 1, 1, 1);
    assert_true(lamp.intensity == 1.0 && lamp.range == 7.0);
    assert_string_equal(spot.name, "a?b");
    assert_int_equal(spot.type, VSHI_MODEL_LIGHT_SPOT);
    assert_vector(spot.position, 1, 2, 3);
    assert_vector(spot.direction, -1, 0, 0);
    assert_true(spot.inner_angle == 0.125 && spot.outer_angle == 0.5 && spot.intensity == 2.0);
}

/* Names of nodes are tested in tests/cli/lights.bats. */
TEST(lights_of_a_scene_have_sizes_and_falloff) {
    vsh_light *made = NULL;
    size_t count = 0;
    OWNED(vsh_model) *model =
        read_text("a.gltf", lit_json("{\"translation\":[1,2,3],\"children\":[2,3]," CARRIES(
                                         "2") "},{" CARRIES("0") "},{" CARRIES("1") "}",
                                     lights));
    assert_ok(vshi_lights_from_model(model, 0.25, 0.5, 0.01, &made, &count, &failure));
    assert_int_equal(count, 3);
    assert_string_equal(made[0].name, "light"); /* neither it nor its node has a name */
    assert_vector(made[0].axis, 0, 0, -1);
    assert_true(made[0].inner_angle == 0.25 && made[0].outer_angle == 1.0);
    assert_vector(made[1].direction, 0, 0, 1); /* towards it */
    assert_vector(made[1].color, 4, 2, 1);
    assert_true(made[1].angle == 0.25 && made[1].falloff == VSH_FALLOFF_NONE);
    assert_vector(made[2].position, 0.01, 0.02, 0.03); /* metres read as centimetres */
    assert_true(made[2].radius == 0.5 && made[2].falloff == VSH_FALLOFF_INVERSE_SQUARE);
    vsh_lights_free(made);
    static const double bad[][3] = {{4.0, 0.5, 0.0}, {0.1, -1.0, 0.0}, {0.1, 0.0, -1.0}};
    for (int i = 0; i < 3; ++i) {
        assert_fails(vshi_lights_from_model(model, bad[i][0], bad[i][1], bad[i][2], &made, &count, &failure),
                     VSH_ERROR_ARGUMENT, "");
    }
}

TEST(wrong_lights_are_refused_by_their_number) {
    static const struct {
        const char *light, *part;
    } bad[] = {
        {"{\"type\":\"point\",\"intensity\":-1}", "its intensity is -1"},
        {"{\"type\":\"point\",\"intensity\":\"x\"}", "its intensity is no number"},
        {"{\"type\":\"point\",\"range\":-2}", "its range is -2"},
        {"{\"type\":\"point\",\"color\":[1,-1,1]}", "its color is no three numbers"},
        {"{\"type\":\"point\",\"color\":[1,\"red\"]}", "its color is no three numbers"},
        {"{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":2}}", "its outerConeAngle is 2"},
        {"{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":0}}", "its outerConeAngle is 0"},
        {"{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":1}}",
         "its innerConeAngle is 1, expected a number of 0 to "
         "0.785398"},
    };
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        refused("a.gltf", lit_json("{" CARRIES("0") "}", bad[i].light), VSH_ERROR_INPUT, bad[i].part,
                "lights[0] of KHR_lights_punctual");
    }
    static const char *const none[] = {"{" CARRIES("3") "}", "{" CARRIES("-1") "}", "{" CARRIES("{}") "}"};
    for (int i = 0; i < 3; ++i) {
        refused("a.gltf", lit_json(none[i], lights), VSH_ERROR_INPUT, "none of the 3", "nodes[1]");
    }
}

TEST(lights_without_a_direction_or_of_an_unknown_type_are_left_out_with_a_warning) {
    static const struct {
        const char *scale, *light, *warning;
    } cases[] = {{"[1,1,0]", "{\"type\":\"directional\"}", "the light of nodes[1] is left out"},
                 {"[1,1,1]", "{\"type\":\"area\"}", "lights[0] of KHR_lights_punctual is left out"},
                 {"[0,0,0]", "{\"type\":\"point\"}", NULL}}; /* which points nowhere anyway */
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        char node[128];
        snprintf(node, sizeof node, "{\"scale\":%s," CARRIES("0") "}", cases[i].scale);
        OWNED(vsh_model) *model = read_text("a.gltf", lit_json(node, cases[i].light));
        assert_int_equal(model->light_count, cases[i].warning == NULL);
        assert_true(cases[i].warning == NULL || strstr(warnings, cases[i].warning) != NULL);
    }
}

FIXTURE(make_folder, remove_empty_folder)
