/* Images that cannot be written or read: what is refused, what is left behind, damaged files; files that are
 * put in place together, or not at all. */
#include "images.h"
#include "testing.h"

static void refused(const char *path, const vsh_image *image, int32_t bits, const char *pack, vsh_result code,
                    const char *named) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    for (int write = 0; write < 2; ++write) {
        const vsh_result result = write ? vsh_image_write(path, image, &options, &failure)
                                        : vsh_image_check(path, image, &options, &failure);
        if (result != code || failure.code != code || strstr(failure.message, named) == NULL) {
            fail_msg("%s, pack '%s', %d bits: %s '%s', expected %s with '%s'", path, pack != NULL ? pack : "",
                     bits, vsh_result_name(result), failure.message, vsh_result_name(code), named);
        }
    }
}

TEST(bad_packs_are_refused_by_part) {
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    static const char *const cases[][2] = {
        {"R=shadow.moon", "shadow.moon"},
        {"R=ao,R=shadow.sun", "'R=shadow.sun'"},
        {"", "empty"},
        {"R=", "'R='"},
        {"R=ao,", "''"},
        {",R=ao", "''"},
        {"X=ao", "'X=ao'"},
        {"ao", "'ao'"},
        {"R", "'R'"},
        {"R=ao,G=2", "'G=2'"},
        {"R=ao,G=AO", "AO"},
        {"R=ao, G=A", "' G=A'"},
        {"R=10", "'R=10'"},
        {"r=ao", "'r=ao'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        refused(at("pack.png"), &s.image, 0, cases[i][0], VSH_ERROR_ARGUMENT, cases[i][1]);
        refused(at("pack.exr"), &s.image, 0, cases[i][0], VSH_ERROR_ARGUMENT, cases[i][1]);
    }

    assert_int_equal(access(at("pack.png"), F_OK), -1);
}

TEST(what_a_format_lacks_is_refused) {
    static const struct {
        const char *name;
        int32_t bits;
        const char *pack, *part;
    } cases[] = {
        {"x.png", 32, NULL, "8 16"},       {"x.jpg", 16, NULL, "16 bits"},
        {"x.exr", 8, NULL, "16 32"},       {"x.exr", -1, NULL, "-1"},
        {"x.tif", 12, NULL, "12"},         {"x.xyz", 0, NULL, "xyz"},
        {"x.hdr", 16, NULL, "hdr has 32"}, {"x.pgm", 0, "R=ao,G=A", "grey"},
        {"x.pgm", 0, "G=ao", "grey"},      {"x.pgm", 0, "R=ao,A=1", "alpha"},
        {"x.jpg", 0, "R=ao,A=A", "alpha"}, {"noending", 0, NULL, "noending"},
    };
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        refused(at(cases[i].name), &s.image, cases[i].bits, cases[i].pack, VSH_ERROR_ARGUMENT, cases[i].part);
    }
    static const char *const unwritten[] = {"x.pfm", "x.fits", "x.pbm",  "x.zfile", "x.heics", "x.sgi",
                                            "x.sxr", "x.null", "x.term", "x.FITS",  "x.j2c"};
    for (size_t i = 0; i < sizeof unwritten / sizeof unwritten[0]; ++i) {
        refused(at(unwritten[i]), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "is not written: ");
    }
    refused("", &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "empty");
    s.image.width = 70000;
    s.image.height = 1;
    refused(at("x.jpg"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "65500");
}

TEST(bad_images_are_refused) {
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    vsh_image bad = s.image;
    bad.width = 0;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "0 × 2");
    bad.width = 1 << 20;
    bad.height = 1 << 20;
    refused(at("x.tif"), &bad, 0, NULL, VSH_ERROR_LIMIT, "2^31");
    assert_fails(vsh_image_write(at("x.exr"), &bad, NULL, &failure), VSH_ERROR_LIMIT,
                 ""); /* not row by row */
    assert_non_null(strstr(failure.message, "2^31"));
    bad = s.image;
    bad.channel_count = 0;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "0 channels");
    bad.channel_count = VSH_MAX_CHANNELS + 1;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "257");
    refused(at("x.exr"), NULL, 0, NULL, VSH_ERROR_ARGUMENT, "no image");
    s.names[1] = "A";
    refused(at("x.exr"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "'A' is given twice");
    s.names[1] = "";
    refused(at("x.exr"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "no name");
    char name[129];
    memset(name, 'n', 128);
    name[128] = '\0';
    s.names[1] = name;
    refused(at("x.exr"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "127");
    s.names[1] = "ao";
    s.planes[1] = NULL;
    assert_fails(vsh_image_write(at("x.exr"), &s.image, NULL, &failure), VSH_ERROR_ARGUMENT, "'ao'");
    s.image.planes = NULL; /* enough for a check before the bake */
    assert_ok(vsh_image_check(at("x.exr"), &s.image, NULL, &failure));
}

TEST(places_that_cannot_be_written_are_refused) {
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    assert_int_equal(mkdir(at("folder.exr"), 0777), 0);
    assert_int_equal(mkfifo(at("fifo.png"), 0666), 0);
    refused(at("missing/x.exr"), &s.image, 0, NULL, VSH_ERROR_WRITE, "missing");
    refused(at("folder.exr"), &s.image, 0, NULL, VSH_ERROR_WRITE, "is a folder");
    refused(at("fifo.png"), &s.image, 0, NULL, VSH_ERROR_WRITE, "regular");
    assert_int_equal(rmdir(at("folder.exr")), 0);
    assert_int_equal(unlink(at("fifo.png")), 0);
}

TEST(cut_files_are_errors) {
    static const char *const names[] = {"c.exr", "c.png", "c.tif", "c.tga",
                                        "c.bmp", "c.hdr", "c.ppm", "c.dpx"};
    FREED_BY(unmake) sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        assert_ok(vsh_image_write(path, &s.image, NULL, &failure));
        FREED unsigned char *bytes = NULL;
        const size_t size = read_all(path, &bytes);
        /* what stands behind the pixels may be missing: PNG's last chunk, TGA's footer */
        const size_t trailer = strcmp(names[n], "c.exr") == 0 ? 0 : 600;
        size_t errors = 0;
        for (size_t cut = 0; cut < size; cut += cut < 500 ? 1 : 37) {
            write_all(path, bytes, cut);
            vsh_image_file *file = NULL;
            const vsh_result result = vsh_image_read(path, NULL, &file, &failure);
            if (result == VSH_OK) {
                if (cut + trailer < size) {
                    fail_msg("%s cut to %zu of %zu bytes was read", names[n], cut, size);
                }
                vsh_image_free(file);
            } else {
                ++errors;
                assert_true(result == VSH_ERROR_READ || result == VSH_ERROR_INPUT);
                assert_null(file);
                assert_null(strchr(failure.message, '\n'));
                assert_non_null(strstr(failure.message, names[n]));
            }
        }
        assert_true(errors > 0);
    }
}

TEST(damaged_files_do_no_harm) {
    static const char *const names[] = {"b.exr", "b.png", "b.tif", "b.jpg", "b.tga", "b.bmp"};
    FREED_BY(unmake) sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    uint32_t seed = 1;
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        assert_ok(vsh_image_write(path, &s.image, NULL, &failure));
        FREED unsigned char *bytes = NULL;
        const size_t size = read_all(path, &bytes);
        for (int trial = 0; trial < 150; ++trial) {
            /* headers get half of the damage */
            seed = seed * 1664525u + 1013904223u;
            const size_t place = (seed >> 8) % (trial % 2 == 0 && size > 400 ? 400 : size);
            const unsigned char old = bytes[place];
            seed = seed * 1664525u + 1013904223u;
            bytes[place] = (unsigned char)(seed >> 24);
            write_all(path, bytes, size);
            bytes[place] = old;
            OWNED(vsh_image_file) *file = NULL;
            const vsh_result result = vsh_image_read(path, NULL, &file, &failure);
            assert_true((result == VSH_OK) == (file != NULL));
        }
    }
}

TEST(unreadable_paths_are_read_errors) {
    static const struct {
        const char *name, *text;
        vsh_result code;
        const char *part;
    } cases[] = {{"nothing.exr", NULL, VSH_ERROR_READ, "nothing.exr"},
                 {".", NULL, VSH_ERROR_READ, ""},
                 {"empty.png", "", VSH_ERROR_READ, ""},
                 {"text.txt", "hello", VSH_ERROR_INPUT, "no image format that is read"},
                 {"x.iff", "hello", VSH_ERROR_INPUT, "no image format that is read"},
                 {"x.fits", "hello", VSH_ERROR_INPUT, "no image format that is read"}};
    vsh_image_file *file = NULL;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        if (cases[i].text != NULL) {
            write_all(at(cases[i].name), (const unsigned char *)cases[i].text, strlen(cases[i].text));
        }
        assert_fails(vsh_image_read(at(cases[i].name), NULL, &file, &failure), cases[i].code, cases[i].part);
        assert_null(file);
    }
    vsh_image_free(NULL);
}

TEST(the_memory_limit_holds_without_a_reader) {
    static const char *const names[] = {"m.exr", "m.png", "m.tif"};
    FREED_BY(unmake) sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        assert_ok(vsh_image_write(at(names[n]), &s.image, NULL, &failure));
        vsh_run run = vsh_run_default();
        vsh_image_file *file = NULL;
        assert_ok(vsh_image_read(at(names[n]), &run, &file, &failure));
        const vsh_image image = vsh_image_view(file);
        run.memory_limit = (uint64_t)(image.width * image.height * image.channel_count) * sizeof(float);
        vsh_image_free(file);
        assert_ok(vsh_image_read(at(names[n]), &run, &file, &failure));
        vsh_image_free(file);
        --run.memory_limit;
        assert_fails(vsh_image_read(at(names[n]), &run, &file, &failure), VSH_ERROR_LIMIT, "");
        assert_null(file);
        assert_non_null(strstr(failure.message, names[n]));
    }
}

TEST(a_written_file_follows_links_and_keeps_its_mode) {
    FREED_BY(unmake) sample s;
    make(&s, 3, 3, 3, LIGHTMAP);
    const char *target = at("target.exr");
    const char *link = at("link.exr");
    write_all(target, (const unsigned char *)"old", 3);
    assert_int_equal(chmod(target, 0640), 0);
    assert_int_equal(symlink("target.exr", link), 0);
    assert_int_equal(vsh_image_write(link, &s.image, NULL, NULL), VSH_OK);
    struct stat status;
    assert_int_equal(lstat(link, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    assert_int_equal(stat(target, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0640);
    assert_true(status.st_size > 3);
}

TEST(outputs_are_made_beside_the_target_and_keep_its_ending) {
    vshi_output first;
    vshi_output second;
    const char *path = at("grid.v1.vdb");
    assert_ok(vshi_output_begin(&first, path, &failure));
    assert_ok(vshi_output_begin(&second, path, &failure));
    assert_string_not_equal(first.temporary, second.temporary);
    assert_memory_equal(first.temporary, folder, strlen(folder));
    assert_string_equal(vshi_path_ending(first.temporary), "vdb");
    assert_int_equal(access(path, F_OK), -1);
    vshi_output_abandon(&second);
    assert_null(second.temporary);
    assert_ok(vshi_output_commit(&first, &failure));
    assert_int_equal(access(path, F_OK), 0);
    vshi_output_abandon(&first); /* nothing is left to do */
    char name[256];
    memset(name, 'n', 255);
    memcpy(name + 251, ".exr", 5);
    assert_ok(vshi_output_begin(&first, at(name), &failure)); /* the longest name there is */
    assert_ok(vshi_output_commit(&first, &failure));
    assert_string_equal(vshi_path_ending("a.b/c"), "");
    assert_string_equal(vshi_path_ending(".exr"), "");
    assert_string_equal(vshi_path_ending("a/b.c.EXR"), "EXR");
}

TEST(no_temporary_is_left) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        assert_null(strstr(entry->d_name, ".tmp"));
    }
    closedir(directory);
}

/* --- files that belong together */

enum { COUNT = 3 };

static const char *const together[COUNT] = {"one.bin", "two.png", "three.gltf"};

static void put_text(const char *path, const char *text) {
    write_all(path, (const unsigned char *)text, strlen(text));
}

static void expect_text(const char *name, const char *text) {
    char found[16] = "";
    FILE *file = fopen(at(name), "rb");
    if (text == NULL) {
        assert_null(file);
        return;
    }
    assert_non_null(file);
    found[fread(found, 1, sizeof found - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(found, text);
}

static void begin(vshi_output *outputs, vshi_output **list) {
    for (size_t i = 0; i < COUNT; ++i) {
        assert_ok(vshi_output_begin(&outputs[i], at(together[i]), &failure));
        put_text(outputs[i].temporary, "new");
        list[i] = &outputs[i];
    }
}

TEST(all_are_in_place_in_the_end) {
    vshi_output outputs[COUNT], *list[COUNT];
    const int before = entries_in_folder();
    put_text(at(together[1]), "old");
    begin(outputs, list);
    assert_ok(vshi_outputs_commit(list, COUNT, &failure));
    for (size_t i = 0; i < COUNT; ++i) {
        expect_text(together[i], "new");
    }
    assert_int_equal(entries_in_folder(), before + COUNT);
    for (size_t i = 0; i < COUNT; ++i) {
        unlink(at(together[i]));
    }
}

/* A folder that came into the way of each in turn, as nothing but a file can be replaced. */
TEST(one_that_fails_leaves_all_as_they_were) {
    const int before = entries_in_folder();
    for (size_t failing = 0; failing < COUNT; ++failing) {
        vshi_output outputs[COUNT], *list[COUNT];
        put_text(at(together[1]), "old");
        if (failing == 1) {
            unlink(at(together[1]));
        }
        begin(outputs, list);
        assert_int_equal(mkdir(at(together[failing]), 0777), 0);
        assert_fails(vshi_outputs_commit(list, COUNT, &failure), VSH_ERROR_WRITE, "");
        assert_non_null(strstr(failure.message, together[failing]));
        assert_non_null(strstr(failure.message, "could not be put in place"));
        assert_int_equal(rmdir(at(together[failing])), 0);
        for (size_t i = 0; i < COUNT; ++i) {
            expect_text(together[i], i == 1 && failing != 1 ? "old" : NULL);
        }
        unlink(at(together[1]));
        assert_int_equal(entries_in_folder(), before);
    }
}

FIXTURE(make_folder, remove_folder)
