/* Materials of a glTF: what decides where light comes through masked ones; in the process itself and by a
 * reader, which is this test. */
#define _GNU_SOURCE

#include "gltf_maker.h"
#include "served.h"
#include "testing.h"

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
        assert_int_equal(vsh_model_material_count(model), 2);
        assert_int_equal(vsh_model_mesh_material(model, 0), 1);
        assert_int_equal(vsh_model_mesh_material(model, 1), -1);
        assert_int_equal(vsh_model_mesh_material(model, 2), 0);
        assert_int_equal(vsh_model_mesh(model, 0, 0).alpha, VSH_ALPHA_MASKED);
        const vsh_model_material plain = vsh_model_get_material(model, 0);
        assert_string_equal(plain.name, "plain");
        assert_true(plain.alpha == VSH_ALPHA_OPAQUE && plain.double_sided == 0 && plain.alpha_cutoff == 0.0);
        assert_null(plain.image);
        const vsh_model_material leaf = vsh_model_get_material(model, 1);
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
    assert_int_equal(vsh_model_material_count(model), 0);
    assert_int_equal(vsh_model_mesh_material(model, 0), -1);
}

static void assert_maps(const vsh_model_material *m, double u, double v, double to_u, double to_v) {
    const double *t = m->uv_transform;
    const double made[2] = {t[0] * u + t[1] * v + t[2], t[3] * u + t[4] * v + t[5]};
    if (!(fabs(made[0] - to_u) < 1e-12 && fabs(made[1] - to_v) < 1e-12)) {
        fail_msg("(%g, %g) becomes (%.17g, %.17g), expected (%g, %g)", u, v, made[0], made[1], to_u, to_v);
    }
}

/* By hand: in the file's UVs (v down) scaled, turned so that u goes the way of -v, moved. */
TEST(transforms_map_uvs_with_v_up) {
    vsh_model *model = read_gltf_by(true, material_json(LEAF(""), textures));
    vsh_model_material leaf = vsh_model_get_material(model, 1);
    assert_int_equal(leaf.uv_set, 0);
    assert_maps(&leaf, 0.25, 0.75, 0.25, 0.75);
    vsh_model_free(model);
    model =
        read_gltf_by(true, material_json(LEAF(",\"texCoord\":1,\"extensions\":{\"KHR_texture_transform\":{"
                                              "\"offset\":[0.5,0.25],\"scale\":[2,4],\"texCoord\":2}}"),
                                         textures));
    leaf = vsh_model_get_material(model, 1);
    assert_int_equal(leaf.uv_set, 2);
    assert_maps(&leaf, 0.0, 1.0, 0.5, 1.0 - 0.25); /* the file's (0, 0) is at (0.5, 0.25) of it */
    assert_maps(&leaf, 0.5, 0.75, 1.5, 1.0 - 1.25);
    vsh_model_free(model);
    model =
        read_gltf_by(true, material_json(LEAF(",\"extensions\":{\"KHR_texture_transform\":{\"offset\":[0,1],"
                                              "\"rotation\":1.5707963267948966,\"scale\":[2,1]}}"),
                                         textures));
    leaf = vsh_model_get_material(model, 1);
    assert_maps(&leaf, 0.25, 1.0, 0.0, 1.0 - (1.0 - 0.5)); /* (0.25, 0) → (0.5, 0) → (0, -0.5) → (0, 0.5) */
    assert_maps(&leaf, 0.0, 0.75, 0.25, 1.0 - 1.0);        /* (0, 0.25) → (0.25, 0) → (0.25, 1) */
    vsh_model_free(model);
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
    for (size_t i = 0; i < 2 * sizeof cases / sizeof cases[0]; ++i) {
        const size_t c = i / 2;
        OWNED(vsh_model) *model =
            read_gltf_by(i % 2 != 0, packed_json(cases[c].material, cases[c].one, cases[c].other));
        const double expected[2][2] = {{cases[c].u, cases[c].v}, {cases[c].other_u, cases[c].other_v}};
        for (size_t m = 0; m < 2; ++m) {
            const float *uv = vsh_model_mesh(model, m, 0).uvs + 2;
            if (fabs((double)uv[0] - expected[m][0]) > 1e-6 || fabs((double)uv[1] - expected[m][1]) > 1e-6) {
                fail_msg("case %zu, mesh %zu: (%.9g, %.9g)", c, m, (double)uv[0], (double)uv[1]);
            }
        }
        const vsh_model_material told = vsh_model_get_material(model, 0);
        assert_int_equal(told.uv_transform[0] != 1.0, cases[c].left);
    }
}

TEST(images_may_lie_beside_or_in_the_json) {
    for (int reader = 0; reader < 2; ++reader) {
        OWNED(vsh_model) *model = read_gltf_by(
            reader != 0,
            material_json(LEAF(""), "\"textures\":[{\"extensions\":{\"EXT_texture_webp\":{\"source\":0}}}],"
                                    "\"images\":[{\"uri\":\"my%20leaf.webp\"}]"));
        vsh_model_material leaf = vsh_model_get_material(model, 1);
        assert_null(leaf.image);
        assert_string_equal(leaf.image_path, path_of("my leaf.webp").text);
        assert_true(leaf.wrap[0] == VSH_WRAP_REPEAT && leaf.wrap[1] == VSH_WRAP_REPEAT);
        OWNED(vsh_model) *within = read_gltf_by(
            reader != 0, material_json(LEAF(""), "\"textures\":[{\"source\":0}],\"images\":[{\"uri\":"
                                                 "\"data:image/png;base64,SU1BR0U=\"}]"));
        leaf = vsh_model_get_material(within, 1);
        assert_int_equal(leaf.image_size, sizeof image);
        assert_memory_equal(leaf.image, image, sizeof image);
    }
}

TEST(a_mask_that_cannot_be_had_is_left_out_with_a_warning) {
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
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        for (int reader = 0; reader < 2; ++reader) {
            OWNED(vsh_model) *model = read_gltf_by(reader != 0, material_json(LEAF(""), bad[i].rest));
            const vsh_model_material leaf = vsh_model_get_material(model, 1);
            assert_null(leaf.image);
            assert_null(leaf.image_path);
            if (strstr(warnings, bad[i].part) == NULL || strstr(warnings, "its mask is ignored") == NULL) {
                fail_msg("'%s', expected '%s'", warnings, bad[i].part);
            }
        }
    }
}

static void look_at_materials(const vsh_model *model) {
    for (size_t i = 0; i < vsh_model_mesh_count(model); ++i) {
        assert_true(vsh_model_mesh_material(model, i) < (int32_t)vsh_model_material_count(model));
    }
    for (size_t i = 0; i < vsh_model_material_count(model); ++i) {
        const vsh_model_material m = vsh_model_get_material(model, i);
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
    write_bytes("a.gltf", json, strlen(json));
}

TEST(what_a_reader_tells_of_materials_is_refused_or_in_range) {
    write_two_images();
    tell_wrong("a.gltf", wrong_words, WRONG_WORDS, look_at_materials, 100, 20);
    assert_int_equal(unlink(path_of("a.gltf").text), 0);
}

TEST(a_path_that_a_reader_leads_out_of_the_folder_is_refused) {
    static _Alignas(8) unsigned char bytes[4096];
    write_two_images();
    const size_t size = payload_of("a.gltf", bytes, sizeof bytes);
    const char name[] = "x.png";
    unsigned char *at = memmem(bytes, size, name, sizeof name);
    assert_non_null(at);
    const char out[] = "/etc/passwd";
    unsigned char *begin = at - strlen(folder) - 1; /* where the path begins: its length stays */
    memset(begin, '/', (size_t)(at - begin) + sizeof name - 1);
    memcpy(at + sizeof name - sizeof out, out, sizeof out - 1);
    vsh_model *model = NULL;
    assert_fails(decode(bytes, size, "a.gltf", 0, &model, &failure), VSH_ERROR_READ, "its images");
    assert_int_equal(unlink(path_of("a.gltf").text), 0);
}

FIXTURE(make_folder, remove_folder)
