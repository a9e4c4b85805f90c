#include "fuzz.h"

#include <dirent.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static const double MOST_SECONDS = 0.03; /* more inputs find more than longer ones do */

void fuzz_fill(fuzz_input *input, void *to, size_t size) {
    const size_t taken = size < input->left ? size : input->left;
    if (taken > 0) {
        memcpy(to, input->at, taken);
        input->at += taken;
        input->left -= taken;
    }
    if (size > taken) {
        memset((char *)to + taken, 0, size - taken);
    }
}

uint8_t fuzz_byte(fuzz_input *input) {
    uint8_t byte;
    fuzz_fill(input, &byte, 1);
    return byte;
}

static void fail(const char *what, const char *which) {
    fprintf(stderr, "fuzz: %s: %s\n", what, which);
    abort();
}

/* --- files */

static char folder[256];

static void remove_folder(void) {
    DIR *listing = opendir(folder);
    if (listing == NULL) {
        return;
    }
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        unlinkat(dirfd(listing), entry->d_name, 0);
    }
    closedir(listing);
    rmdir(folder);
}

const char *fuzz_folder(void) {
    if (folder[0] == '\0') {
        const char *base = getenv("TMPDIR");
        base = access("/dev/shm", W_OK) == 0 ? "/dev/shm" : base != NULL ? base : "/tmp";
        snprintf(folder, sizeof folder, "%s/vsh_fuzz_XXXXXX", base);
        if (mkdtemp(folder) == NULL) {
            fail("no folder", folder);
        }
        atexit(remove_folder);
    }
    return folder;
}

const char *fuzz_file(const char *name, const void *data, size_t size) {
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", fuzz_folder(), name);
    const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0 || (size > 0 && write(file, data, size) != (ssize_t)size) || close(file) != 0) {
        fail("cannot be written", path);
    }
    return path;
}

/* --- calls */

static double begun;

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int fuzz_is_late(void) {
    return seconds() - begun > MOST_SECONDS;
}

static int32_t stop_late(void *user, const char *stage, double fraction) {
    if (stage == NULL || !(fraction >= 0.0 && fraction <= 1.0)) {
        fail("progress out of range", stage != NULL ? stage : "NULL");
    }
    return fuzz_is_late();
}

static void check_line(const char *line, size_t room) {
    const size_t size = strnlen(line, room);
    if (size == 0 || size == room) {
        fail("message", size == 0 ? "is empty" : "does not end");
    }
    for (size_t i = 0; i < size; ++i) {
        if ((unsigned char)line[i] < 0x20 || line[i] == 0x7f) {
            fail("message is not one line of text", line);
        }
    }
}

static void look_at_warning(void *user, const char *message) {
    check_line(message, sizeof(vsh_error));
}

vsh_run fuzz_run(void) {
    vsh_run run = vsh_run_default();
    run.threads = 1;
    run.memory_limit = FUZZ_MEMORY;
    run.progress = stop_late;
    run.warning = look_at_warning;
    run.notes = 1;
    begun = seconds();
    return run;
}

static vsh_error error;

vsh_error *fuzz_error(void) {
    error.code = -1;
    error.message[0] = '\0';
    return &error;
}

vsh_result fuzz_check(vsh_result result, const void *place) {
    void *handle;
    memcpy(&handle, place, sizeof handle);
    if (result == VSH_OK) {
        if ((int32_t)error.code != -1 || handle == NULL) {
            fail("success", handle == NULL ? "without a handle" : "with an error");
        }
        return result;
    }
    if (result < VSH_OK || result > VSH_ERROR_UNSUPPORTED) { /* VSH_ERROR_INTERNAL is a defect of ours */
        fail("code", vsh_result_name(result));
    }
    if (error.code != result || handle != NULL) {
        fail("failure", handle != NULL ? "with a handle" : "without its code");
    }
    check_line(error.message, sizeof error.message);
    return result;
}

void fuzz_require(int holds, const char *condition) {
    if (!holds) {
        fail("does not hold", condition);
    }
}

vsh_result fuzz_check_plain(vsh_result result) {
    const void *const handle = result == VSH_OK ? &error : NULL;
    return fuzz_check(result, &handle);
}
