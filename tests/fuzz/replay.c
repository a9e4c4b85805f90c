/* Runs a target on every file that is given, and in every folder: the regression tests. */
#include "fuzz.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static int replay_file(const char *path) {
    FILE *file = fopen(path, "rb");
    struct stat status;
    if (file == NULL || fstat(fileno(file), &status) != 0) {
        perror(path);
        return 0;
    }
    const size_t size = (size_t)status.st_size;
    /* of exactly this size, so that a sanitizer sees reads past the end */
    uint8_t *bytes = size > 0 ? malloc(size) : NULL;
    const int whole = (bytes != NULL || size == 0) && fread(bytes, 1, size, file) == size;
    fclose(file);
    if (whole) {
        fprintf(stderr, "%s\n", path); /* standard output belongs to the target */
        LLVMFuzzerTestOneInput(bytes, size);
    }
    free(bytes);
    return whole;
}

static int replay_folder(const char *path) {
    struct dirent **entries;
    const int count = scandir(path, &entries, NULL, alphasort);
    int done = 0;
    for (int i = 0; i < count; ++i) {
        char name[4096];
        if (entries[i]->d_name[0] != '.') {
            snprintf(name, sizeof name, "%s/%s", path, entries[i]->d_name);
            done += replay_file(name);
        }
        free(entries[i]);
    }
    if (count >= 0) {
        free(entries);
    }
    return done;
}

int main(int argc, char **argv) {
    int done = 0;
    for (int i = 1; i < argc; ++i) {
        struct stat status;
        done += stat(argv[i], &status) == 0 && S_ISDIR(status.st_mode) ? replay_folder(argv[i])
                                                                       : replay_file(argv[i]);
    }
    fprintf(stderr, "%d inputs\n", done);
    return done > 0 ? EXIT_SUCCESS : EXIT_FAILURE; /* a missing corpus is a failure */
}
