/* How a reader is confined, as the library tells and is told; and reading what is no reader's in this
 * process. This program is a reader of its own, in which libraries have begun threads before its main. */
#include "sandbox/confine.h"
#include "testing.h"

#include <sys/stat.h>

static char folder[] = "/tmp/vdbshade-test-XXXXXX";

static const char *at(const char *name) {
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static vsh_run with_reader(const char *reader) {
    vsh_run run = vsh_run_default();
    run.reader = reader;
    return run;
}

TEST(a_program_is_its_own_reader_and_confined_wholly_though_it_has_threads) {
    if (VSHI_SANITIZED) {
        skip();
    }
    const vsh_run run = with_reader("/proc/self/exe");
    uint32_t confined = 0;
    assert_ok(vsh_reader_confinement(&run, &confined, &failure));
    assert_int_equal(confined & (VSH_CONFINED_LIMITS | VSH_CONFINED_CALLS),
                     VSH_CONFINED_LIMITS | VSH_CONFINED_CALLS);
    assert_int_equal((confined & VSH_CONFINED_FILES) != 0, vshi_landlock_version() > 0);
    assert_true(vshi_task_count() > 1); /* those of a library's */
}

TEST(what_cannot_be_asked_is_an_argument) {
    uint32_t confined = 7;
    vsh_run run = vsh_run_default();
    assert_int_equal(vsh_reader_confinement(&run, &confined, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_reader_confinement(NULL, &confined, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_reader_confinement(&run, NULL, &failure), VSH_ERROR_ARGUMENT);
    run.confined = 1;
    vsh_model *model;
    assert_fails(vsh_model_read(VSH_ASSETS "/thin.glb", &run, &model, &failure), VSH_ERROR_ARGUMENT,
                 "confined: needs a reader");
}

/* This program does not lie where the library's reader is looked for. */
TEST(a_missing_reader_is_an_error_that_says_how_to_do_without) {
    if (VSHI_SANITIZED) {
        skip();
    }
    const vsh_run run = with_reader(VSH_READER);
    vsh_model *model;
    assert_int_equal(vsh_model_read(VSH_ASSETS "/thin.glb", &run, &model, &failure), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(failure.message, "vdbshade-reader"));
    assert_non_null(strstr(failure.message, "--sandbox off"));
}

/* --- what is read in this process */

static int32_t cancel_later(void *user, const char *stage, double fraction) {
    double *seen = user;
    *seen = fraction;
    return fraction > 0.2;
}

TEST(spheres_are_cancelled_within_a_file_of_any_size) {
    FILE *file = fopen(at("spheres.csv"), "wb");
    for (int i = 0; i < 100000; ++i) {
        fputs(i < 50000 ? "1,2,3,0.5\n" : "# said", file); /* a line of no end, too */
    }
    assert_int_equal(fclose(file), 0);
    double seen = 0.0, *spheres;
    size_t count;
    vsh_run run = run_watched(cancel_later, &seen);
    assert_int_equal(vsh_spheres_read(at("spheres.csv"), &run, &spheres, &count, &failure),
                     VSH_ERROR_CANCELLED);
    assert_null(spheres);
    assert_true(seen > 0.2 && seen < 0.5);
}

/* Of zeros, which take no room on the disk. */
static void make_large(const char *name, off_t size) {
    FILE *file = fopen(at(name), "wb");
    assert_int_equal(ftruncate(fileno(file), size), 0);
    assert_int_equal(fclose(file), 0);
}

static int32_t cancel_soon(void *user, const char *stage, double fraction) {
    int *calls = user;
    return ++*calls > 10;
}

TEST(a_line_of_no_end_is_refused) {
    make_large("zeros.csv", (off_t)1 << 34); /* takes many seconds to read */
    double *spheres;
    size_t count;
    assert_int_equal(vsh_spheres_read(at("zeros.csv"), NULL, &spheres, &count, &failure), VSH_ERROR_INPUT);
    assert_null(spheres);
    assert_non_null(strstr(failure.message, "zeros.csv: a row of more than "));
}

TEST(a_file_of_spheres_past_every_measure_is_a_limit) {
    make_large("sparse.csv", ((off_t)1 << 34) + 1);
    double *spheres;
    size_t count;
    assert_fails(vsh_spheres_read(at("sparse.csv"), NULL, &spheres, &count, &failure), VSH_ERROR_LIMIT,
                 "17179869184");
}

TEST(hashing_is_cancelled_within_a_file) {
    make_large("large.bin", (off_t)1 << 36); /* takes minutes to hash */
    char path[256];
    snprintf(path, sizeof path, "%s", at("large.bin"));
    const char *const files[] = {path};
    vsh_provenance_source source = vsh_provenance_source_default();
    source.files = files;
    source.file_count = 1;
    int calls = 0;
    vsh_run run = run_watched(cancel_soon, &calls);
    vsh_provenance *made;
    assert_int_equal(vsh_provenance_create(&source, &run, &made, &failure), VSH_ERROR_CANCELLED);
    assert_null(made);
    calls = 0;
    char digest[VSH_DIGEST_TEXT];
    assert_int_equal(vsh_file_digest(path, &run, digest, &failure), VSH_ERROR_CANCELLED);
    assert_int_equal(calls, 11);
}

static int make_folder(void **state) {
    return mkdtemp(folder) != NULL ? 0 : -1;
}

static int remove_folder(void **state) {
    unlink(at("spheres.csv"));
    unlink(at("sparse.csv"));
    unlink(at("zeros.csv"));
    unlink(at("large.bin"));
    return rmdir(folder);
}

FIXTURE(make_folder, remove_folder)
