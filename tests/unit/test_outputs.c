/* Files that belong together are put in place together, or not at all. */
#include "expect.h"
#include "images.h"

#include "base/file.h"

#include <sys/stat.h>

enum { COUNT = 3 };

static const char *const names[COUNT] = {"one.bin", "two.png", "three.gltf"};

static void put_text(const char *path, const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    assert_int_equal(fclose(file), 0);
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

static size_t entries(void) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    size_t count = 0;
    while (readdir(directory) != NULL) {
        ++count;
    }
    closedir(directory);
    return count - 2;
}

static void begin(vshi_output *outputs, vshi_output **list) {
    for (size_t i = 0; i < COUNT; ++i) {
        expect_ok(vshi_output_begin(&outputs[i], at(names[i]), &failure));
        put_text(outputs[i].temporary, "new");
        list[i] = &outputs[i];
    }
}

static void all_are_in_place_in_the_end(void **state) {
    vshi_output outputs[COUNT], *list[COUNT];
    put_text(at(names[1]), "old");
    begin(outputs, list);
    expect_ok(vshi_outputs_commit(list, COUNT, &failure));
    for (size_t i = 0; i < COUNT; ++i) {
        expect_text(names[i], "new");
    }
    assert_int_equal(entries(), COUNT);
    for (size_t i = 0; i < COUNT; ++i) {
        unlink(at(names[i]));
    }
}

/* A folder that came into the way of each in turn, as nothing but a file can be replaced. */
static void one_that_fails_leaves_all_as_they_were(void **state) {
    for (size_t failing = 0; failing < COUNT; ++failing) {
        vshi_output outputs[COUNT], *list[COUNT];
        put_text(at(names[1]), "old");
        if (failing == 1) {
            unlink(at(names[1]));
        }
        begin(outputs, list);
        assert_int_equal(mkdir(at(names[failing]), 0777), 0);
        expect_error(vshi_outputs_commit(list, COUNT, &failure), VSH_ERROR_WRITE, "");
        assert_non_null(strstr(failure.message, names[failing]));
        assert_non_null(strstr(failure.message, "could not be put in place"));
        assert_int_equal(rmdir(at(names[failing])), 0);
        for (size_t i = 0; i < COUNT; ++i) {
            expect_text(names[i], i == 1 && failing != 1 ? "old" : NULL);
        }
        unlink(at(names[1]));
        assert_int_equal(entries(), 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_are_in_place_in_the_end),
        cmocka_unit_test(one_that_fails_leaves_all_as_they_were),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
