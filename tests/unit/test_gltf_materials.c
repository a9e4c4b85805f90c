/* Materials and lights of a glTF, in the process itself and by a reader, which is this test: where light
 * comes through masked materials, where lights stand, and what is refused. */
#define _GNU_SOURCE

#include "gltf_maker.h"
#include "handles.h"
#include "io/model/model.h"
#include "models.h"
#include "testing.h"
#include <sys/mman.h>

/* A glTF, read here or by a reader; its warnings are kept. */
static vsh_model *read_gltf_by(bool reader, const char *json) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    run.reader = reader ? "/proc/self/exe" : NULL;
    run.reader_seconds = reader ? 120.0 : 0.0;
    warnings[0] = '\0';
    vsh_model *model = NULL;
    write_all(at("a.gltf"), json, strlen(json));
    assert_ok(vsh_model_read(at("a.gltf"), &run, &model, &failure));
    assert_int_equal(unlink(at("a.gltf")), 0);
    return model;
}

/* Writes a reader's answer for a file. Returns its number of bytes. */
static size_t payload_of(const char *name, unsigned char *bytes, size_t room) {
    static vshi_encoder encoder;
    vsh_error error = {0};
    const vsh_run run = vsh_run_default();
    const int file = memfd_create("payload", 0);
    vshi_encoder_begin(&encoder, file, 0);
    assert_int_equal(vshi_serve_model(at(name), NULL, &run, &encoder, &error), VSH_OK);
    assert_true(vshi_encoder_flush(&encoder));
    assert_in_range(encoder.size, 8, room);
    assert_int_equal(pread(file, bytes, (size_t)encoder.size, 0), (ssize_t)encoder.size);
    close(file);
    return (size_t)encoder.size;
}

/* The model of a telling, within a memory limit. */
static vsh_result decode(const unsigned char *bytes, size_t size, const char *name, uint64_t limit,
                         vsh_model **model, vsh_error *error) {
    vshi_decoder decoder = {bytes, bytes + size, false};
    vsh_run run = run_within(limit);
    return vshi_model_decode(&decoder, at(name), &run, model, error);
}

/* Small counts and numbers of arrays, doubles that are none or out of range, and two letters of a path. */
enum { WRONG_WORDS = 13 };
static const uint64_t wrong_words[WRONG_WORDS] = {0,
                                                  1,
                                                  2,
                                                  3,
                                                  9,
                                                  64,
                                                  UINT64_MAX,
                                                  UINT64_C(0x7ff) << 52,
                                                  UINT64_C(0xbff) << 52,
                                                  UINT64_C(0x3ff) << 52,
                                                  UINT64_C(0x7ff8) << 48,
                                                  UINT64_C(0x7fe) << 52,
                                                  UINT64_C(0x6374652f2e2e2f2e)};

/* Each word of a file's telling in turn wrong, or perhaps: refused in a line that names the file, or a model
 * for `look`. So many refused and sound ones are expected at least. */
static void tell_wrong(const char *name, const uint64_t *values, size_t value_count,
                       void (*look)(const vsh_model *), int refused_least, int sound_least) {
    static _Alignas(8) unsigned char whole[4096], bytes[4096];
    const size_t size = payload_of(name, whole, sizeof whole);
    int refused_count = 0, sound_count = 0;
    for (size_t word = 0; word < size / 8; ++word) {
        for (size_t k = 0; k < value_count; ++k) {
            vsh_model *model = NULL;
            vsh_error error = {0};
            memcpy(bytes, whole, size);
            memcpy(bytes + 8 * word, &values[k], 8);
            if (decode(bytes, size, name, 0, &model, &error) != VSH_OK) {
                assert_that(strstr(error.message, name) != NULL, "word %zu: %s", word, error.message);
                ++refused_count;
                continue;
            }
            look(model);
            vsh_model_free(model);
            ++sound_count;
        }
    }
    assert_in_range(refused_count, refused_least, 100000);
    assert_in_range(sound_count, sound_least, 100000);
}

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
    for (int reader = 0; reader < 2; ++reader) {
        OWNED(vsh_model) *model = read_gltf_by(reader != 0, material_json(LEAF(",\"texCoord\":3"), textures));
        assert_int_equal(vshi_model_material_count(model), 2);
        assert_int_equal(vshi_model_mesh_material(model, 0), 1);
        assert_int_equal(vshi_model_mesh_material(model, 1), -1);
        assert_int_equal(vshi_model_mesh_material(model, 2), 0);
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
    OWNED(vsh_model) *model = read_text("a.obj", quad_obj);
    assert_int_equal(vshi_model_material_count(model), 0);
    assert_int_equal(vshi_model_mesh_material(model, 0), -1);
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
        OWNED(vsh_model) *model = read_gltf_by(true, material_json(material, textures));
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
    for (size_t i = 0; i < 2 * COUNT_OF(cases); ++i) {
        const size_t c = i / 2;
        OWNED(vsh_model) *model =
            read_gltf_by(i % 2 != 0, packed_json(cases[c].material, cases[c].one, cases[c].other));
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
    for (int reader = 0; reader < 2; ++reader) {
        OWNED(vsh_model) *model = read_gltf_by(
            reader != 0,
            material_json(LEAF(""), "\"textures\":[{\"extensions\":{\"EXT_texture_webp\":{\"source\":0}}}],"
                                    "\"images\":[{\"uri\":\"my%20leaf.webp\"}]"));
        vshi_material leaf = vshi_model_get_material(model, 1);
        assert_null(leaf.image);
        assert_string_equal(leaf.image_path, at("my leaf.webp"));
        assert_true(leaf.wrap[0] == VSH_WRAP_REPEAT && leaf.wrap[1] == VSH_WRAP_REPEAT);
        OWNED(vsh_model) *within = read_gltf_by(
            reader != 0, material_json(LEAF(""), "\"textures\":[{\"source\":0}],\"images\":[{\"uri\":"
                                                 "\"data:image/png;base64,SU1BR0U=\"}]"));
        leaf = vshi_model_get_material(within, 1);
        assert_int_equal(leaf.image_size, sizeof image);
        assert_memory_equal(leaf.image, image, sizeof image);
    }
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
        for (int reader = 0; reader < 2; ++reader) {
            OWNED(vsh_model) *model = read_gltf_by(reader != 0, material_json(LEAF(""), bad[i].rest));
            const vshi_material leaf = vshi_model_get_material(model, 1);
            assert_null(leaf.image);
            assert_null(leaf.image_path);
            assert_that(strstr(warnings, bad[i].part) != NULL &&
                            strstr(warnings, "its mask is ignored") != NULL,
                        "'%s', expected '%s'", warnings, bad[i].part);
        }
    }
}

static void look_at_materials(const vsh_model *model) {
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        assert_true(vshi_model_mesh_material(model, i) < (int32_t)vshi_model_material_count(model));
    }
    for (size_t i = 0; i < vshi_model_material_count(model); ++i) {
        const vshi_material m = vshi_model_get_material(model, i);
        assert_in_range(m.uv_set, 0, VSH_MAX_UV_SETS - 1);
        assert_in_range(m.wrap[0], 0, VSH_WRAP_CLAMP);
        assert_in_range(m.alpha, 0, VSH_ALPHA_BLENDED);
        assert_true(m.base_alpha >= 0.0 && m.base_alpha <= 1.0 && isfinite(m.uv_transform[5]));
        assert_true(m.image == NULL || m.image_size == sizeof image || m.image_size <= 9);
    }
}

static void write_two_images(void) {
    const char *json =
        material_json(LEAF(""), "\"textures\":[{\"source\":0},{\"source\":1}],\"images\":[{\"uri\":"
                                "\"x.png\"},{\"bufferView\":2}]");
    write_all(at("a.gltf"), json, strlen(json));
}

TEST(damaged_materials_from_a_reader_are_refused_or_in_range) {
    write_two_images();
    tell_wrong("a.gltf", wrong_words, WRONG_WORDS, look_at_materials, 100, 20);
    assert_int_equal(unlink(at("a.gltf")), 0);
}

TEST(a_path_from_a_reader_that_leaves_the_folder_is_refused) {
    static _Alignas(8) unsigned char bytes[4096];
    write_two_images();
    const size_t size = payload_of("a.gltf", bytes, sizeof bytes);
    const char name[] = "x.png";
    unsigned char *place = memmem(bytes, size, name, sizeof name);
    assert_non_null(place);
    const char out[] = "/etc/passwd";
    unsigned char *begin = place - strlen(folder) - 1; /* where the path begins: its length stays */
    memset(begin, '/', (size_t)(place - begin) + sizeof name - 1);
    memcpy(place + sizeof name - sizeof out, out, sizeof out - 1);
    vsh_model *model = NULL;
    assert_fails(decode(bytes, size, "a.gltf", 0, &model, &failure), VSH_ERROR_READ, "its images");
    assert_int_equal(unlink(at("a.gltf")), 0);
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
    for (int reader = 0; reader < 2; ++reader) {
        OWNED(vsh_model) *model = read_gltf_by(reader != 0, lit_json(nodes, lights));
        assert_int_equal(vshi_model_light_count(model), 3);
        const vshi_model_light sun = vshi_model_get_light(model, 0), lamp = vshi_model_get_light(model, 1);
        const vshi_model_light spot = vshi_model_get_light(model, 2);
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
    OWNED(vsh_model) *model = read_text("a.obj", quad_obj);
    assert_int_equal(vshi_model_light_count(model), 0);
}

TEST(lights_of_a_scene_have_names_sizes_and_falloff) {
    vsh_light *made = NULL;
    size_t count = 0;
    OWNED(vsh_model) *model = read_gltf_by(
        false, lit_json("{\"name\":\"Key light\",\"translation\":[1,2,3],\"children\":[2,3]," CARRIES(
                            "0") "},"
                                 "{\"name\":\"Key_light\"," CARRIES("1") "},{" CARRIES("2") "}",
                        lights));
    assert_ok(vshi_lights_from_model(model, 0.25, 0.5, 0.01, &made, &count, &failure));
    assert_int_equal(count, 3);
    assert_string_equal(made[0].name, "Key_light");
    assert_string_equal(made[1].name, "Key_light_2");
    assert_string_equal(made[2].name, "light");
    assert_int_equal(made[0].type, VSH_LIGHT_DIRECTIONAL);
    assert_vector(made[0].direction, 0, 0, 1); /* towards it */
    assert_vector(made[0].color, 4, 2, 1);
    assert_true(made[0].angle == 0.25 && made[0].falloff == VSH_FALLOFF_NONE);
    assert_int_equal(made[1].type, VSH_LIGHT_SPHERE);
    assert_vector(made[1].position, 0.01, 0.02, 0.03); /* metres read as centimetres */
    assert_true(made[1].radius == 0.5 && made[1].falloff == VSH_FALLOFF_INVERSE_SQUARE);
    assert_int_equal(made[2].type, VSH_LIGHT_SPOT);
    assert_vector(made[2].axis, 0, 0, -1);
    assert_true(made[2].inner_angle == 0.25 && made[2].outer_angle == 1.0);
    vsh_lights_free(made);
    static const double bad[][3] = {{4.0, 0.5, 0.0}, {0.1, -1.0, 0.0}, {0.1, 0.0, -1.0}, {0.1, 0.0, 0.0}};
    for (int i = 0; i < 4; ++i) {
        assert_fails(vshi_lights_from_model(i < 3 ? model : NULL, bad[i][0], bad[i][1], bad[i][2], &made,
                                            &count, &failure),
                     VSH_ERROR_ARGUMENT, "");
        assert_null(made);
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
        assert_int_equal(vshi_model_light_count(model), cases[i].warning == NULL);
        assert_true(cases[i].warning == NULL || strstr(warnings, cases[i].warning) != NULL);
    }
}

static void look_at_lights(const vsh_model *model) {
    vsh_light *made = NULL;
    size_t count;
    for (size_t i = 0; i < vshi_model_light_count(model); ++i) {
        const vshi_model_light light = vshi_model_get_light(model, i);
        assert_in_range(light.type, 0, VSHI_MODEL_LIGHT_SPOT);
        assert_true(light.inner_angle <= light.outer_angle && light.outer_angle <= 1.5708);
        assert_true(light.intensity >= 0.0 && isfinite(light.intensity) && light.range >= 0.0);
    }
    if (vshi_lights_from_model(model, 0.1, 0.1, 0.0, &made, &count, &failure) == VSH_OK) {
        vsh_lights_free(made);
    }
}

TEST(damaged_lights_from_a_reader_are_refused_or_in_range) {
    const char *json = lit_json(nodes, lights);
    write_all(at("a.gltf"), json, strlen(json));
    tell_wrong("a.gltf", wrong_words, WRONG_WORDS, look_at_lights, 200, 20);
    assert_int_equal(unlink(at("a.gltf")), 0);
}

FIXTURE(make_folder, remove_empty_folder)
