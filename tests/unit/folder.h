/* A folder of the test's own, and its files. VSH_KEEP=1 keeps it. */
#pragma once

#include "testing.h"

#include <dirent.h>

static char folder[256];

/* The path of a file; a few may be in use at a time. */
static inline const char *at(const char *name) {
    static char paths[4][512];
    static int next = 0;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static inline int make_folder(void **state) {
    char here[200];
    const char *place = getenv("TMPDIR");
    if (place == NULL) { /* in the folder where the tests were built */
        place = getcwd(here, sizeof here);
    }
    snprintf(folder, sizeof folder, "%.200s/vdbshade-test-XXXXXX", place != NULL ? place : ".");
    return mkdtemp(folder) == NULL;
}

static inline int remove_folder(void **state) {
    char command[300];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return getenv("VSH_KEEP") != NULL ? 0 : system(command);
}

static inline int entries_in_folder(void) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    int count = 0;
    while (readdir(directory) != NULL) {
        ++count;
    }
    closedir(directory);
    return count;
}

/* Reads a file. A 0 follows the bytes, and does not count in the size. */
static inline size_t read_all(const char *path, unsigned char **bytes) {
    FILE *file = fopen(path, "rb");
    assert_that(file != NULL, "%s is missing", path);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    const size_t size = (size_t)ftell(file);
    rewind(file);
    *bytes = (unsigned char *)calloc(1, size + 1);
    assert_non_null(*bytes);
    assert_int_equal(fread(*bytes, 1, size, file), size);
    fclose(file);
    return size;
}

static inline void write_all(const char *path, const void *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline void write_string(const char *path, const char *text) {
    write_all(path, text, strlen(text));
}
