/* Every system call of writing fails in turn, or the process is killed in its place: the old file is intact,
 * no temporary stays (after a kill: none after the next run), and the error says why. Children do all work,
 * because a process that has started threads cannot be forked. */
#include "base/file.h"
#include "scenarios.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <sys/wait.h>

enum { MOST = 2000, FINE = 0, BAD = 1, NOTHING_FAILED = 2 };

static bool writes(const scenario *s) {
    return strstr(s->name, "written") != NULL;
}

/* --- in a child */

static int run_failing(const scenario *s, uint64_t n) {
    const vsh_run run = vsh_run_default();
    vsh_error error = {-1, ""};
    const char *what;
    writes_begin(n, WRITES_FAIL);
    const vsh_result result = s->run(&run, &error);
    writes_end(&what);
    if (what == NULL) {
        return result == VSH_OK ? NOTHING_FAILED : BAD;
    }
    const bool said =
        result == VSH_ERROR_WRITE && error.code == result && strchr(error.message, '\n') == NULL &&
        strstr(error.message, strerror(ENOSPC)) != NULL && strstr(error.message, "out.") != NULL;
    const bool untouched = scenarios_untouched();
    if (!said || !untouched) {
        fprintf(stderr, "%s: %s, call %" PRIu64 ": %s '%s'%s\n", s->name, what, n, vsh_result_name(result),
                error.message, untouched ? "" : "; files are not as they were");
        return BAD;
    }
    return FINE;
}

static int run_short(const scenario *s, uint64_t n) {
    const vsh_run run = vsh_run_default();
    vsh_error error = {-1, ""};
    writes_begin(1, WRITES_SHORT);
    const vsh_result result = s->run(&run, &error);
    if (result != VSH_OK) {
        fprintf(stderr, "%s: %s\n", s->name, error.message);
    }
    return result == VSH_OK ? FINE : BAD;
}

static int run_killed(const scenario *s, uint64_t n) {
    const vsh_run run = vsh_run_default();
    writes_begin(n, WRITES_KILL);
    return s->run(&run, NULL) == VSH_OK ? NOTHING_FAILED : BAD;
}

static int run_well(const scenario *s, uint64_t n) {
    const vsh_run run = vsh_run_default();
    return s->run(&run, NULL) == VSH_OK ? FINE : BAD;
}

/* --- in the test's process */

/* The child's exit status; -1: it was killed. */
static int in_child(int (*work)(const scenario *, uint64_t), const scenario *s, uint64_t n) {
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        _exit(work(s, n));
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    if (WIFSIGNALED(status)) {
        assert_int_equal(WTERMSIG(status), SIGKILL);
        return -1;
    }
    return WEXITSTATUS(status);
}

static size_t temporaries(void) {
    DIR *listing = opendir(".");
    assert_non_null(listing);
    size_t count = 0;
    for (const struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) {
        count += strstr(entry->d_name, ".tmp") != NULL;
    }
    closedir(listing);
    return count;
}

TEST(every_write_may_fail) {
    for (size_t i = 0; i < scenario_count; ++i) {
        const scenario *s = &scenarios[i];
        uint64_t n = 1;
        int status = writes(s) ? FINE : NOTHING_FAILED;
        for (; status == FINE && n < MOST; ++n) {
            status = in_child(run_failing, s, n);
        }
        assert_int_equal(status, NOTHING_FAILED);
        scenarios_untouched(); /* restores the outputs that the last one has written */
        if (writes(s)) {
            assert_true(
                n > 4); /* one to open, flush and rename at least: what a module writes is not seen here */
        }
    }
}

TEST(short_and_interrupted_writes_are_gone_on_with) {
    for (size_t i = 0; i < scenario_count; ++i) {
        if (writes(&scenarios[i])) {
            assert_int_equal(in_child(run_short, &scenarios[i], 0), FINE);
            assert_int_equal(temporaries(), 0);
            scenarios_untouched();
        }
    }
}

TEST(a_kill_at_every_write_leaves_the_old_file_and_the_next_run_tidies_up) {
    for (size_t i = 0; i < scenario_count; ++i) {
        const scenario *s = &scenarios[i];
        size_t left = 0;
        for (uint64_t n = 1; writes(s) && n < MOST; ++n) {
            const int status = in_child(run_killed, s, n);
            if (status != -1) {
                assert_int_equal(status, NOTHING_FAILED);
                break;
            }
            const size_t here = temporaries();
            left += here;
            assert_true(here <= 1);
            if (here == 1) {
                assert_int_equal(in_child(run_well, s, 0), FINE);
                assert_int_equal(temporaries(), 0);
            } else {
                assert_true(scenarios_untouched());
            }
            scenarios_untouched();
        }
        assert_int_equal(left > 0, writes(s)); /* kills have left temporaries */
        scenarios_untouched();
    }
}

TEST(files_of_a_process_that_still_writes_and_of_others_stay) {
    static const struct {
        const char *name;
        bool stays;
    } files[] = {{".out.7.tmp.png", true},
                 {".out.tmp.exr", true},
                 {".out.x.tmp.exr", true},
                 {".out.7.tmp.exr.bak", true},
                 {"out.7.tmp.exr", true},
                 {".out2.7.tmp.exr", true},
                 {".out.7.exr", true},
                 {".out.7-.tmp.exr", true},
                 {".out.7.tmp.exr", false},
                 {".out.7-12.tmp.exr", false},
                 {".out.2147483647.tmp.exr", false}};
    const scenario *exr = NULL;
    for (size_t i = 0; i < scenario_count; ++i) {
        exr = strstr(scenarios[i].name, "EXR") != NULL ? &scenarios[i] : exr;
    }
    assert_non_null(exr);
    vshi_output live;
    assert_ok(vshi_output_begin(&live, "out.exr", &failure));
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        FILE *file = fopen(files[i].name, "wb");
        assert_non_null(file);
        fclose(file);
    }
    assert_int_equal(in_child(run_well, exr, 0), FINE);
    assert_int_equal(access(live.temporary, F_OK), 0);
    assert_ok(vshi_output_commit(&live, &failure));
    for (size_t i = 0; i < sizeof files / sizeof files[0]; ++i) {
        assert_int_equal(unlink(files[i].name) == 0, files[i].stays);
    }
    scenarios_untouched();
}

int main(void) {
    return run_all_tests(scenarios_begin, scenarios_end);
}
