/* Images written and read back, for their tests. */
#ifndef TESTS_IMAGES_H
#define TESTS_IMAGES_H

#include "base/file.h"
#include "image/planes.h"
#include "testing.h"

#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

static char folder[256];

static inline const char *at(const char *name) {
    static char paths[4][512]; /* a few may be in use at a time */
    static int next = 0;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

/* An image with values of its own at every texel: between 0 and 1, not symmetric in x, y or the channel. */
enum { MOST = 8 };

typedef struct sample {
    vsh_image image;
    const char *names[MOST];
    const float *planes[MOST];
    float *values;
} sample;

static inline void make(sample *s, int32_t width, int32_t height, int32_t count, const char *const *names) {
    const size_t texels = (size_t)width * (size_t)height;
    s->values = malloc(texels * (size_t)count * sizeof(float));
    assert_non_null(s->values);
    for (int32_t c = 0; c < count; ++c) {
        s->names[c] = names[c];
        s->planes[c] = s->values + (size_t)c * texels;
        for (size_t i = 0; i < texels; ++i) {
            const double x = (double)(i % (size_t)width) / width;
            const double y = (double)(i / (size_t)width) / height;
            s->values[(size_t)c * texels + i] = (float)(0.5 + 0.5 * sin(7.0 * x + 3.1 * y * (c + 1) + c));
        }
    }
    s->image = (vsh_image){width, height, count, s->names, s->planes, NULL};
}

static inline void unmake(sample *s) {
    free(s->values);
}

static const char *const LIGHTMAP[] = {"shadow.sun", "ao", "A"};

static inline size_t read_all(const char *path, unsigned char **bytes) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    const size_t size = (size_t)ftell(file);
    rewind(file);
    *bytes = malloc(size + 1);
    assert_non_null(*bytes);
    assert_int_equal(fread(*bytes, 1, size, file), size);
    fclose(file);
    return size;
}

static inline void write_all(const char *path, const unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
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

static inline int make_folder(void **state) {
    char here[200];
    const char *place = getenv("TMPDIR");
    if (place == NULL) { /* where the tests were built */
        place = getcwd(here, sizeof here);
    }
    snprintf(folder, sizeof folder, "%.200s/vdbshade-image-XXXXXX", place != NULL ? place : ".");
    return mkdtemp(folder) == NULL;
}

static inline int remove_folder(void **state) {
    if (getenv("VSH_KEEP") != NULL) {
        return 0;
    }
    DIR *directory = opendir(folder);
    if (directory == NULL) {
        return 1;
    }
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        unlink(at(entry->d_name));
    }
    closedir(directory);
    return rmdir(folder);
}

#endif
