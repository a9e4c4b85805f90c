/* Images that cannot be written or read: what is refused, what is left behind, damaged files. */
#include "expect.h"
#include "images.h"

#include <fcntl.h>

static int entries_in_folder(void) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    int count = 0;
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    }
    closedir(directory);
    return count;
}

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

static void bad_packs_are_refused_by_part(void **state) {
    sample s;
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
    refused(at("pack.jpg"), &s.image, 0, "R=ao,A=A", VSH_ERROR_ARGUMENT, "alpha");
    assert_int_equal(access(at("pack.png"), F_OK), -1);
    unmake(&s);
}

static void what_a_format_lacks_is_refused(void **state) {
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    refused(at("x.png"), &s.image, 32, NULL, VSH_ERROR_ARGUMENT, "8 16");
    refused(at("x.jpg"), &s.image, 16, NULL, VSH_ERROR_ARGUMENT, "16 bits");
    refused(at("x.exr"), &s.image, 8, NULL, VSH_ERROR_ARGUMENT, "16 32");
    refused(at("x.exr"), &s.image, -1, NULL, VSH_ERROR_ARGUMENT, "-1");
    refused(at("x.tif"), &s.image, 12, NULL, VSH_ERROR_ARGUMENT, "12");
    refused(at("x.xyz"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "xyz");
    static const char *const never[] = {"x.pfm", "x.fits", "x.pbm",  "x.zfile", "x.heics",
                                        "x.sxr", "x.null", "x.term", "x.FITS",  "x.j2c"};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; ++i) {
        refused(at(never[i]), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "is not written: ");
    }
    refused(at("x.rla"), &s.image, 16, NULL, VSH_ERROR_ARGUMENT, "rla has 32");
    refused(at("x.iff"), &s.image, 16, NULL, VSH_ERROR_ARGUMENT, "iff has 8");
    refused(at("x.pgm"), &s.image, 0, "R=ao,G=A", VSH_ERROR_ARGUMENT, "grey");
    refused(at("x.pgm"), &s.image, 0, "G=ao", VSH_ERROR_ARGUMENT, "grey");
    refused(at("x.pgm"), &s.image, 0, "R=ao,A=1", VSH_ERROR_ARGUMENT, "alpha");
    refused(at("noending"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "noending");
    refused("", &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "empty");
    vsh_image wide = s.image;
    wide.width = 70000;
    wide.height = 1;
    refused(at("x.jpg"), &wide, 0, NULL, VSH_ERROR_ARGUMENT, "65500");
    refused(at("x.ico"), &wide, 0, NULL, VSH_ERROR_ARGUMENT, "255");
    unmake(&s);
}

static void bad_images_are_refused(void **state) {
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    vsh_image bad = s.image;
    bad.width = 0;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "0 × 2");
    bad.width = 1 << 20;
    bad.height = 1 << 20;
    refused(at("x.tif"), &bad, 0, NULL, VSH_ERROR_LIMIT, "2^31");
    expect_error(vsh_image_write(at("x.exr"), &bad, NULL, &failure), VSH_ERROR_LIMIT,
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
    expect_error(vsh_image_write(at("x.exr"), &s.image, NULL, &failure), VSH_ERROR_ARGUMENT, "'ao'");
    s.image.planes = NULL; /* enough for a check before the bake */
    expect_ok(vsh_image_check(at("x.exr"), &s.image, NULL, &failure));
    unmake(&s);
}

static void places_that_cannot_be_written_are_refused(void **state) {
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    char path[600];
    snprintf(path, sizeof path, "%s/missing/x.exr", folder);
    refused(path, &s.image, 0, NULL, VSH_ERROR_WRITE, "missing");
    snprintf(path, sizeof path, "%s/folder.exr", folder);
    assert_int_equal(mkdir(path, 0777), 0);
    refused(path, &s.image, 0, NULL, VSH_ERROR_WRITE, "is a folder");
    assert_int_equal(rmdir(path), 0);
    snprintf(path, sizeof path, "%s/fifo.png", folder);
    assert_int_equal(mkfifo(path, 0666), 0);
    refused(path, &s.image, 0, NULL, VSH_ERROR_WRITE, "regular");
    assert_int_equal(unlink(path), 0);
    unmake(&s);
}

/* The limit on a file's size stands for a full disk: at the first byte, in the middle, at the very last one.
 */
static void a_full_disk_leaves_the_old_file_and_nothing_else(void **state) {
    static const char *const names[] = {"d.exr", "d.png", "d.tif",  "d.jpg",  "d.tga", "d.bmp", "d.hdr",
                                        "d.ppm", "d.pgm", "d.webp", "d.jp2",  "d.dpx", "d.gif", "d.sgi",
                                        "d.iff", "d.rla", "d.ico",  "d.heic", "d.avif"};
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit old_limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
    sample s;
    make(&s, 200, 180, 3, LIGHTMAP);
    const unsigned char old[] = "the old content";
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        expect_ok(vsh_image_write(path, &s.image, NULL, &failure));
        struct stat status;
        assert_int_equal(stat(path, &status), 0);
        const rlim_t limits[] = {0, 100, (rlim_t)status.st_size / 2, (rlim_t)status.st_size - 1};
        write_all(path, old, sizeof old);
        const int entries = entries_in_folder();
        for (size_t l = 0; l < sizeof limits / sizeof limits[0]; ++l) {
            const struct rlimit limit = {limits[l], old_limit.rlim_max};
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
            const vsh_result result = vsh_image_write(path, &s.image, NULL, &failure);
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &old_limit), 0);
            if (result != VSH_ERROR_WRITE) {
                fail_msg("%s at %llu of %llu bytes: %s", names[n], (unsigned long long)limits[l],
                         (unsigned long long)status.st_size, vsh_result_name(result));
            }
            unsigned char *bytes;
            assert_int_equal(read_all(path, &bytes), sizeof old);
            assert_memory_equal(bytes, old, sizeof old);
            free(bytes);
            assert_int_equal(entries_in_folder(), entries);
        }
        unlink(path);
    }
    signal(SIGXFSZ, SIG_DFL);
    unmake(&s);
}

/* Neither the time nor the file's name: and no path so long that a header had no room for its end. */
static void the_same_image_is_the_same_bytes_later_elsewhere(void **state) {
    static const char *const formats[] = {"exr", "png", "tif",  "jpg",  "tga", "bmp", "hdr",
                                          "ppm", "pgm", "webp", "jp2",  "dpx", "gif", "sgi",
                                          "iff", "rla", "ico",  "heic", "avif"};
    enum { COUNT = sizeof formats / sizeof formats[0] };
    unsigned char *bytes[COUNT];
    size_t sizes[COUNT];
    sample s;
    make(&s, 64, 50, 3, LIGHTMAP);
    const int back = open(".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    assert_true(back >= 0 && chdir(at("")) == 0);
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t n = 0; n < COUNT; ++n) {
            char name[16];
            snprintf(name, sizeof name, "%s.%s", pass == 0 ? "t" : "other", formats[n]);
            expect_ok(vsh_image_write(name, &s.image, NULL, &failure));
            if (pass == 0) {
                sizes[n] = read_all(name, &bytes[n]);
                continue;
            }
            unsigned char *again;
            const size_t size = read_all(name, &again);
            if (size != sizes[n] || memcmp(again, bytes[n], size) != 0) {
                fail_msg("%s differs", name);
            }
            free(again);
            free(bytes[n]);
        }
        if (pass == 0) {
            sleep(1); /* what some formats note by the second */
        }
    }
    assert_int_equal(fchdir(back), 0);
    close(back);
    unmake(&s);
}

static void cut_files_are_errors(void **state) {
    static const char *const names[] = {"c.exr", "c.png", "c.tif", "c.tga", "c.bmp", "c.hdr",
                                        "c.ppm", "c.dpx", "c.sgi", "c.rla", "c.ico"};
    sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        expect_ok(vsh_image_write(path, &s.image, NULL, &failure));
        unsigned char *bytes;
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
        free(bytes);
    }
    unmake(&s);
}

static void damaged_files_do_no_harm(void **state) {
    static const char *const names[] = {"b.exr", "b.png", "b.tif", "b.jpg", "b.tga",
                                        "b.bmp", "b.sgi", "b.rla", "b.ico"};
    sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    uint32_t seed = 1;
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        expect_ok(vsh_image_write(path, &s.image, NULL, &failure));
        unsigned char *bytes;
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
            vsh_image_file *file = NULL;
            const vsh_result result = vsh_image_read(path, NULL, &file, &failure);
            assert_true((result == VSH_OK) == (file != NULL));
            vsh_image_free(file);
        }
        free(bytes);
    }
    unmake(&s);
}

static void unreadable_paths_are_read_errors(void **state) {
    vsh_image_file *file = NULL;
    expect_error(vsh_image_read(at("nothing.exr"), NULL, &file, &failure), VSH_ERROR_READ, "nothing.exr");
    expect_error(vsh_image_read(folder, NULL, &file, &failure), VSH_ERROR_READ, "");
    write_all(at("empty.png"), (const unsigned char *)"", 0);
    expect_error(vsh_image_read(at("empty.png"), NULL, &file, &failure), VSH_ERROR_READ, "");
    static const char *const never[] = {"text.txt", "x.iff", "x.fits"};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; ++i) {
        write_all(at(never[i]), (const unsigned char *)"hello", 5);
        expect_error(vsh_image_read(at(never[i]), NULL, &file, &failure), VSH_ERROR_INPUT,
                     "no image format that is read");
    }
    assert_null(file);
    vsh_image_free(NULL);
}

static void the_memory_limit_holds_without_a_reader(void **state) {
    static const char *const names[] = {"m.exr", "m.png", "m.tif"};
    sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        expect_ok(vsh_image_write(at(names[n]), &s.image, NULL, &failure));
        vsh_run run = vsh_run_default();
        vsh_image_file *file = NULL;
        expect_ok(vsh_image_read(at(names[n]), &run, &file, &failure));
        const vsh_image image = vsh_image_view(file);
        run.memory_limit = (uint64_t)(image.width * image.height * image.channel_count) * sizeof(float);
        vsh_image_free(file);
        expect_ok(vsh_image_read(at(names[n]), &run, &file, &failure));
        vsh_image_free(file);
        --run.memory_limit;
        expect_error(vsh_image_read(at(names[n]), &run, &file, &failure), VSH_ERROR_LIMIT, "");
        assert_null(file);
        assert_non_null(strstr(failure.message, names[n]));
    }
    unmake(&s);
}

static void a_written_file_follows_links_and_keeps_its_mode(void **state) {
    sample s;
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
    unmake(&s);
}

static void outputs_are_made_beside_the_target_and_keep_its_ending(void **state) {
    vshi_output first;
    vshi_output second;
    const char *path = at("grid.v1.vdb");
    expect_ok(vshi_output_begin(&first, path, &failure));
    expect_ok(vshi_output_begin(&second, path, &failure));
    assert_string_not_equal(first.temporary, second.temporary);
    assert_memory_equal(first.temporary, folder, strlen(folder));
    assert_string_equal(vshi_path_ending(first.temporary), "vdb");
    assert_int_equal(access(path, F_OK), -1);
    vshi_output_abandon(&second);
    assert_null(second.temporary);
    expect_ok(vshi_output_commit(&first, &failure));
    assert_int_equal(access(path, F_OK), 0);
    vshi_output_abandon(&first); /* nothing is left to do */
    char name[256];
    memset(name, 'n', 255);
    memcpy(name + 251, ".exr", 5);
    expect_ok(vshi_output_begin(&first, at(name), &failure)); /* the longest name there is */
    expect_ok(vshi_output_commit(&first, &failure));
    assert_string_equal(vshi_path_ending("a.b/c"), "");
    assert_string_equal(vshi_path_ending(".exr"), "");
    assert_string_equal(vshi_path_ending("a/b.c.EXR"), "EXR");
}

static void no_temporary_is_left(void **state) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        assert_null(strstr(entry->d_name, ".tmp"));
    }
    closedir(directory);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_packs_are_refused_by_part),
        cmocka_unit_test(what_a_format_lacks_is_refused),
        cmocka_unit_test(bad_images_are_refused),
        cmocka_unit_test(places_that_cannot_be_written_are_refused),
        cmocka_unit_test(a_full_disk_leaves_the_old_file_and_nothing_else),
        cmocka_unit_test(the_same_image_is_the_same_bytes_later_elsewhere),
        cmocka_unit_test(cut_files_are_errors),
        cmocka_unit_test(damaged_files_do_no_harm),
        cmocka_unit_test(unreadable_paths_are_read_errors),
        cmocka_unit_test(the_memory_limit_holds_without_a_reader),
        cmocka_unit_test(a_written_file_follows_links_and_keeps_its_mode),
        cmocka_unit_test(outputs_are_made_beside_the_target_and_keep_its_ending),
        cmocka_unit_test(no_temporary_is_left),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
