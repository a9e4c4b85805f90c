/* Outputs list the settings and inputs that they were made from, as attributes of their files. */
#include "casts.h"
#include "images.h"
#include "previews.h"
#include "testing.h"

TEST(digests_match_the_standards_examples) {
    /* FIPS 180-4's examples, and a million times 'a' (NIST, "SHA examples") */
    static const struct {
        const char *text;
        size_t times;
        const char *digest;
    } cases[] = {
        {"", 1, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
        {"abc", 1, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
        {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 1,
         "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
        {"a", 55, "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318"},
        {"a", 56, "b35439a4ac6f0948b6d6f9e3c6af0f5f590ce20f1bde7090ef7970686ec6738a"},
        {"a", 63, "7d3e74a05d7db15bce4ad9ec0658ea98e3f06eeecf16b4c6fff2da457ddc2f34"},
        {"a", 64, "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb"},
        {"a", 65, "635361c48bb9eab14198e76ea8ab7f1a41685d6ad62aa9146d301d4f17eb0ae0"},
        {"a", 128, "6836cf13bac400e9105071cd6af47084dfacad4e5e302c94bfed24e013afb73e"},
        {"a", 65535, "6e1bebca6a8229364a162a72ef064826c4cd7457bf54f190ef782bd9deff3e42"},
        {"a", 65537, "008ffc88d3c96a9f307524eb361e47c5222a887fc45fa0c1fb8d429c5c23b430"},
        {"a", 1000000, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        FILE *file = fopen(at("digest.bin"), "wb");
        assert_non_null(file);
        for (size_t k = 0; k < cases[i].times; ++k) {
            fputs(cases[i].text, file);
        }
        assert_int_equal(fclose(file), 0);
        char digest[VSH_DIGEST_TEXT];
        assert_ok(vsh_file_digest(at("digest.bin"), NULL, digest, &failure));
        assert_string_equal(digest, cases[i].digest);
    }
}

TEST(digests_of_folders_and_pipes_are_refused) {
    char digest[VSH_DIGEST_TEXT];
    assert_fails(vsh_file_digest(at("nothing"), NULL, digest, &failure), VSH_ERROR_READ,
                 "nothing: cannot be read: No such file");
    assert_fails(vsh_file_digest(folder, NULL, digest, &failure), VSH_ERROR_READ, "it is a folder");
    assert_int_equal(mkfifo(at("pipe"), 0600), 0);
    assert_fails(vsh_file_digest(at("pipe"), NULL, digest, &failure), VSH_ERROR_READ, "");
}

/* A glTF with a buffer beside it, one within, and one behind an escaped name. */
TEST(settings_and_inputs_are_listed_in_order_and_once) {
    write_string(at("scene.json"), "{}");
    write_string(at("one.bin"), "1");
    write_string(at("two parts.bin"), "2");
    write_string(at("mesh.gltf"), "{\"buffers\": [{\"uri\": \"one.bin\"}, {\"uri\": \"data:,x\"}, {\"uri\": "
                                  "\"two%20parts.bin\"}, {\"byteLength\": 1}]}");
    const vsh_caster casters[] = {{.type = VSH_CASTER_MESH, .path = at("mesh.gltf")},
                                  {.type = VSH_CASTER_SDF},
                                  {.type = VSH_CASTER_MESH, .path = casters[0].path}};
    vsh_light sun = vsh_light_default();
    sun.angle = 0.1;
    const vsh_receiver receiver = {.path = casters[0].path};
    vsh_scene scene = {.casters = casters,
                       .caster_count = 3,
                       .lights = &sun,
                       .light_count = 1,
                       .receivers = &receiver,
                       .receiver_count = 1,
                       .shade = preview_options(),
                       .ao = 1};
    scene.shade.method = VSH_SHADOW_EXACT;
    scene.shade.max_error = 0.05;
    scene.shade.ao_distance = 2.5;
    const char *const file = at("scene.json");
    const vsh_attribute own = {"studio_shot", "12\n13"};
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = &scene;
    source.files = &file;
    source.file_count = 1;
    source.command = "bake scene.json";
    source.voxel_size = 0.125;
    source.attributes = &own;
    source.attribute_count = 1;
    vsh_provenance *made = NULL;
    assert_ok(vsh_provenance_create(&source, NULL, &made, &failure));
    size_t count = 0;
    const vsh_attribute *list = vsh_provenance_attributes(made, &count);
    static const char *const expected[][2] = {
        {"vdbshade_version", "0.2.0"},
        {"vdbshade_command", "bake scene.json"},
        {"vdbshade_shadow", "exact, max error 0.05, 64 rays, sobol"},
        {"vdbshade_ao", "cones within 2.5, 16 cones"},
        {"vdbshade_light_sun", "directional towards 0 1 0, 5.72957795 degrees across"},
        {"vdbshade_voxel_size", "0.125"},
        {"studio_shot", "12?13"},
        {"vdbshade_input_0",
         "sha256:44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a scene.json"},
        {"vdbshade_input_1", NULL},
        {"vdbshade_input_2",
         "sha256:6b86b273ff34fce19d6b804eff5a3f5747ada4eaa22f1d49c01e52ddb7875b4b one.bin"},
        {"vdbshade_input_3",
         "sha256:d4735e3a265e16eee03f59718b9b5d03019c07d8b6c51f90da3a666eec13ab35 two parts.bin"},
    };
    assert_int_equal(count, COUNT_OF(expected));
    for (size_t i = 0; i < count; ++i) {
        assert_string_equal(list[i].name, expected[i][0]);
        if (expected[i][1] != NULL) {
            assert_string_equal(list[i].value, expected[i][1]);
        }
    }
    vsh_provenance_free(made);

    assert_int_equal(unlink(at("one.bin")), 0);
    assert_fails(vsh_provenance_create(&source, NULL, &made, &failure), VSH_ERROR_READ,
                 "one.bin: cannot be read");
    assert_null(made);
}

/* A GLB with 64 MiB of binary data, where the limit on memory is 1 MiB. */
TEST(files_that_a_large_glb_names_are_found_from_its_json_alone) {
    static const char json[] = "{\"buffers\": [{}, {\"uri\": \"one.bin\"}]}    ";
    enum { SIZE = (sizeof json - 1) / 4 * 4, BINARY = 64 << 20, ALL = 28 + SIZE + BINARY };
    const uint32_t head[] = {0x46546C67, 2, ALL, SIZE, 0x4E4F534A /* "glTF", "JSON" */};
    const uint32_t binary[] = {BINARY, 0x004E4942 /* "BIN" */};
    unsigned char bytes[28 + SIZE];
    memcpy(bytes, head, sizeof head);
    memcpy(bytes + sizeof head, json, SIZE);
    memcpy(bytes + sizeof head + SIZE, binary, sizeof binary);
    write_string(at("one.bin"), "1");
    write_all(at("large.glb"), bytes, sizeof bytes);
    assert_int_equal(truncate(at("large.glb"), ALL), 0);
    const vsh_caster caster = {.type = VSH_CASTER_MESH, .path = at("large.glb")};
    const vsh_scene scene = {.casters = &caster, .caster_count = 1, .shade = preview_options()};
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = &scene;
    vsh_run run = run_within(1 << 20);
    vsh_provenance *made = NULL;
    assert_ok(vsh_provenance_create(&source, &run, &made, &failure));
    size_t count = 0;
    const vsh_attribute *list = vsh_provenance_attributes(made, &count);
    assert_string_equal(list[count - 1].value,
                        "sha256:6b86b273ff34fce19d6b804eff5a3f5747ada4eaa22f1d49c01e52ddb7875b4b one.bin");
    vsh_provenance_free(made);
    assert_int_equal(unlink(at("large.glb")), 0);
}

TEST(the_error_of_a_channel_is_read_from_its_attributes) {
    const vsh_attribute list[] = {{"vdbshade_version", "0.2.0"},
                                  {"vdbshade_shadow", "adaptive, max error 0.005, sobol, frame 3"},
                                  {"vdbshade_ao", "exact within 2.5, max error 0.02, sobol"},
                                  {"vdbshade_sky", "exact over y, max error 0.01, sobol"}};
    assert_true(vshi_provenance_max_error(list, 3, "shadow.sun") == 0.005);
    assert_true(vshi_provenance_max_error(list, 3, "ao") == 0.02);
    assert_true(vshi_provenance_max_error(list, 4, "sky") == 0.01);
    assert_true(isnan(vshi_provenance_max_error(list, 3, "irradiance.R")));
    assert_true(isnan(vshi_provenance_max_error(list, 2, "ao")));
    assert_true(isnan(vshi_provenance_max_error(NULL, 0, "ao")));
    static const char *const none[] = {
        "cone",
        "exact, max error 0.02, 64 rays, sobol", /* a limit: more may be left */
        "rays, 64 rays, sobol",
        "exact, max error , sobol",
        "exact, max error -1",
        "exact, max error nan",
        ""};
    for (size_t i = 0; i < COUNT_OF(none); ++i) {
        const vsh_attribute one = {"vdbshade_shadow", none[i]};
        assert_true(isnan(vshi_provenance_max_error(&one, 1, "shadow.key")));
    }
}

TEST(level_sets_and_volumes_carry_them) {
    const vsh_sdf_node ball = vsh_sdf_node_default();
    OWNED(vsh_grid) *grid = grid_of_tree(&ball, 1, with_voxel(0.125));
    OWNED(vsh_field) *field = NULL;
    OWNED(vsh_voxels) *voxels = NULL;
    OWNED(vsh_volume) *volume = NULL;
    const vsh_light sun = vsh_light_default();
    const vsh_attribute told = {"vdbshade_command", "voxelize ball"};
    assert_ok(vsh_grid_write(grid, at("told.vdb"), NULL, &told, 1, &failure));
    assert_ok(vshi_field_create(grid, NULL, NULL, &field, &failure));
    assert_ok(vsh_voxels_from_grid(grid, 0.0, NULL, &voxels, &failure));
    assert_ok(vsh_bake_volume(occluders_of(field), voxels, &sun, 1, NULL, NULL, &volume, NULL, &failure));
    assert_ok(vsh_volume_write(volume, at("volume.vdb"), 0, &told, 1, &failure));
    static const char *const files[] = {"told.vdb", "volume.vdb"};
    for (size_t f = 0; f < 2; ++f) {
        vsh_vdb_entry entry;
        size_t count = 0;
        assert_ok(vsh_vdb_list(at(files[f]), NULL, &entry, 1, &count, &failure));
        assert_int_equal(count, 1);
        assert_non_null(strstr(entry.attributes, "vdbshade_command: voxelize ball\n"));
    }
}

TEST(attributes_that_no_file_could_hold_are_refused) {
    static const char long_name[] =
        "an_attribute_name_of_eighty_letters_which_is_one_more_than_PNG_has_room_for_"
        "1234";
    static const struct {
        vsh_attribute list[2];
        size_t count;
        const char *message;
    } cases[] = {
        {{{"", "x"}}, 1, "attribute 0 '': expected a name of 1 … 79"},
        {{{NULL, "x"}}, 1, "attribute 0 '': expected a name"},
        {{{"two words", "x"}}, 1, "attribute 0 'two words': expected a name"},
        {{{long_name, "x"}}, 1, "attribute 0"},
        {{{"a", "two\nlines"}}, 1, "attribute 'a': expected a line of text"},
        {{{"a", NULL}}, 1, "attribute 'a': expected a line of text"},
        {{{"a", "1"}, {"a", "2"}}, 2, "attribute 'a' is given twice"},
    };
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        vsh_image_options options = vsh_image_options_default();
        options.attributes = cases[i].list;
        options.attribute_count = cases[i].count;
        assert_fails(vsh_image_write(at("refused.exr"), &s.image, &options, &failure), VSH_ERROR_ARGUMENT,
                     cases[i].message);
        assert_int_not_equal(access(at("refused.exr"), F_OK), 0);
    }
    unmake(&s);
}

FIXTURE(make_folder, remove_folder)
