/* How a reader is confined, and files that are read without one. This program is its own reader, in which
 * libraries have begun threads before its main. */
#include "folder.h"
#include "io/reader/confine.h"

TEST(a_reader_that_has_threads_is_confined_wholly) {
    if (VSHI_SANITIZED) {
        skip();
    }
    vsh_run run = vsh_run_default();
    run.reader = "/proc/self/exe";
    uint32_t confined = 0;
    assert_ok(vsh_reader_confinement(&run, &confined, &failure));
    assert_int_equal(confined & (VSH_CONFINED_LIMITS | VSH_CONFINED_CALLS),
                     VSH_CONFINED_LIMITS | VSH_CONFINED_CALLS);
    assert_int_equal((confined & VSH_CONFINED_FILES) != 0, vshi_landlock_version() > 0);
    assert_true(vshi_task_count() > 1); /* a library's threads */
}

TEST(calls_without_a_reader_are_refused) {
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

/* --- files that this process reads itself */

static int32_t cancel_later(void *user, const char *stage, double fraction) {
    double *seen = user;
    *seen = fraction;
    return fraction > 0.2;
}

TEST(reading_spheres_is_cancelled_within_a_file) {
    FILE *file = fopen(at("spheres.csv"), "wb");
    for (int i = 0; i < 100000; ++i) {
        fputs(i < 50000 ? "1,2,3,0.5\n" : "# said", file); /* the second half is one long line */
    }
    assert_int_equal(fclose(file), 0);
    double seen = 0.0, *spheres;
    size_t count;
    vsh_run run = run_watched(cancel_later, &seen);
    assert_fails(vshi_spheres_read(at("spheres.csv"), &run, &spheres, &count, &failure), VSH_ERROR_CANCELLED,
                 "");
    assert_null(spheres);
    assert_true(seen > 0.2 && seen < 0.5);
}

/* Makes a file of zeros, which takes no room on the disk. */
static void make_large(const char *path, off_t size) {
    write_string(path, "");
    assert_int_equal(truncate(path, size), 0);
}

TEST(a_row_of_no_end_and_a_file_too_large_are_refused) {
    static const struct {
        off_t size;
        vsh_result code;
        const char *part;
    } cases[] = {
        {(off_t)1 << 34 /* takes many seconds to read */, VSH_ERROR_INPUT, "zeros.csv: a row of more than "},
        {((off_t)1 << 34) + 1, VSH_ERROR_LIMIT, "17179869184"}};
    for (int i = 0; i < 2; ++i) {
        double *spheres;
        size_t count;
        make_large(at("zeros.csv"), cases[i].size);
        assert_fails(vshi_spheres_read(at("zeros.csv"), NULL, &spheres, &count, &failure), cases[i].code,
                     cases[i].part);
        assert_null(spheres);
    }
}

static int32_t cancel_soon(void *user, const char *stage, double fraction) {
    int *calls = user;
    return ++*calls > 10;
}

TEST(hashing_is_cancelled_within_a_file) {
    const char *const path = at("large.bin");
    make_large(path, (off_t)1 << 36); /* takes minutes to hash */
    vsh_provenance_source source = vsh_provenance_source_default();
    source.files = &path;
    source.file_count = 1;
    int calls = 0;
    const vsh_run run = run_watched(cancel_soon, &calls);
    vsh_provenance *made;
    assert_fails(vsh_provenance_create(&source, &run, &made, &failure), VSH_ERROR_CANCELLED, "");
    assert_null(made);
    calls = 0;
    char digest[VSH_DIGEST_TEXT];
    assert_fails(vsh_file_digest(path, &run, digest, &failure), VSH_ERROR_CANCELLED, "");
    assert_int_equal(calls, 11);
}

FIXTURE(make_folder, remove_folder)
