/* Cancelling from the callback, in every stage of every scenario, from its begin to nearly its end: the call
 * says so, leaks nothing, leaves outputs as they were, and works when it is asked again. `tools/bench
 * FILE.csv cancel` measures how soon it answers. */
#include "scenarios.h"

#include <inttypes.h>
#include <pthread.h>

enum { MOST_STAGES = 256 };

/* Stages are counted as they begin: a scenario makes several calls, some of one name. Called by one thread at
 * a time, but by any. */
typedef struct watch {
    int stage; /* under way; -1: none yet */
    double last;
    char name[80];
    int unfinished; /* stages that ended before 1 */
    int stop_stage; /* -1: never */
    double stop_at;
    int asked; /* to stop, within the stage */
    double asked_at;
} watch;

/* Stages that scenarios have. */
static const char *const stages_known[] = {
    "ao",         "bake",    "charts",    "compare", "field",  "flat",    "hash",   "lit",
    "load",       "outline", "pack",      "padding", "page",   "query",   "render", "seams",
    "shadow.sun", "surface", "triangles", "unwrap",  "volume", "voxelize"};
enum { STAGES_KNOWN = sizeof stages_known / sizeof stages_known[0] };
static bool stages_seen[STAGES_KNOWN];

static int32_t progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    assert_true(fraction >= 0.0 && fraction <= 1.0);
    for (size_t i = 0; i < STAGES_KNOWN; ++i) {
        stages_seen[i] |= strcmp(stages_known[i], stage) == 0;
    }
    if (w->stage < 0 || strcmp(w->name, stage) != 0 || fraction < w->last) {
        w->unfinished += w->stage >= 0 && w->last < 1.0;
        ++w->stage;
        snprintf(w->name, sizeof w->name, "%s", stage);
    }
    w->last = fraction;
    if (w->stage == w->stop_stage && fraction >= w->stop_at) {
        ++w->asked;
        w->asked_at = fraction;
    }
    return w->asked > 0;
}

static vsh_result run_scenario(const scenario *s, int32_t threads, watch *w, vsh_error *error) {
    vsh_run run = run_watched(progress, w);
    run.threads = threads;
    *error = (vsh_error){-1, ""};
    return s->run(&run, error);
}

static void stop_at(const scenario *s, int32_t threads, int stage, double fraction, uint64_t *stopped) {
    const uint64_t before = faults_live();
    watch w = {.stage = -1, .stop_stage = stage, .stop_at = fraction};
    vsh_error error;
    const vsh_result result = run_scenario(s, threads, &w, &error);
    if (w.asked == 0 || (result == VSH_OK && w.asked_at >= 1.0)) {
        scenarios_untouched(); /* no: the stage's work, the call's last, was done */
        return;
    }
    ++*stopped;
    assert_that(result == VSH_ERROR_CANCELLED && error.code == result &&
                    strchr(error.message, '\n') == NULL && error.message[0] != '\0',
                "%s: stage %d '%s' at %g: %s '%s'", s->name, stage, w.name, fraction, vsh_result_name(result),
                error.message);
    assert_that(w.asked <= 1, "%s: stage %d '%s' at %g: asked %d times more", s->name, stage, w.name,
                fraction, w.asked - 1);
    assert_that(faults_live() == before,
                "%s: stage %d '%s' at %g: %" PRIu64 " blocks before, %" PRIu64 " after", s->name, stage,
                w.name, fraction, before, faults_live());
    assert_that(scenarios_untouched(), "%s: stage %d '%s' at %g: files are not as they were", s->name, stage,
                w.name, fraction);
}

TEST(every_stage_can_be_cancelled) {
    static const double fractions[] = {0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99};
    for (size_t i = 0; i < scenario_count; ++i) {
        const scenario *s = &scenarios[i];
        watch all = {.stage = -1, .stop_stage = -1};
        vsh_error error;
        assert_int_equal(run_scenario(s, 1, &all, &error), VSH_OK);
        const int stages = all.stage + 1;
        assert_true(stages <= MOST_STAGES);
        assert_that(all.unfinished == 0 && (stages == 0 || all.last == 1.0), "%s: %d stages end before 1",
                    s->name, all.unfinished);
        scenarios_untouched(); /* no: it has written */
        for (int stage = 0; stage < stages; ++stage) {
            uint64_t here = 0;
            for (size_t f = 0; f < sizeof fractions / sizeof fractions[0]; ++f) {
                stop_at(s, 1 + (stage + (int)f) % 2, stage, fractions[f], &here);
            }
            assert_that(here >= 3, "%s: stage %d of %d (%s): only %d callbacks", s->name, stage, stages,
                        all.name, (int)here);
        }
        assert_that(run_scenario(s, 2, &all, &error) == VSH_OK, "%s afterwards: %s", s->name, error.message);
        scenarios_untouched();
    }
    for (size_t i = 0; i < STAGES_KNOWN; ++i) {
        assert_that(stages_seen[i], "no scenario has the stage '%s'", stages_known[i]);
    }
}

/* Jansson reads 2048 nested levels. */
static vsh_result read_deep(const vsh_run *run, vsh_error *error) {
    enum { LEVELS = 2000 };
    vsh_scene *scene = NULL;
    FILE *file = fopen("deep.json", "w");
    assert_non_null(file);
    fputs("{\"casters\": ", file);
    for (int level = 0; level < 2 * LEVELS; ++level) {
        fputc(level < LEVELS ? '[' : ']', file);
    }
    fputs("}", file);
    fclose(file);
    const vsh_result result = vsh_scene_read("deep.json", run, &scene, error);
    unlink("deep.json");
    return result == VSH_ERROR_INPUT ? VSH_OK : VSH_ERROR_INTERNAL;
}

static void *run_all(void *unused) {
    static const scenario deep = {"deeply nested JSON", read_deep};
    for (size_t i = 0; i <= scenario_count; ++i) {
        const scenario *s = i < scenario_count ? &scenarios[i] : &deep;
        vsh_error error;
        vsh_run run = vsh_run_default();
        run.threads = 1;
        assert_that(s->run(&run, &error) == VSH_OK, "%s: %s", s->name, error.message);
        scenarios_untouched(); /* no: it has written */
    }
    return unused;
}

TEST(every_scenario_runs_on_a_stack_of_a_mebibyte) {
    pthread_attr_t attributes;
    pthread_t thread;
    if (VSHI_SANITIZED) { /* its frames are larger */
        skip();
    }
    assert_int_equal(pthread_attr_init(&attributes), 0);
    assert_int_equal(pthread_attr_setstacksize(&attributes, 1 << 20), 0);
    assert_int_equal(pthread_create(&thread, &attributes, run_all, NULL), 0);
    assert_int_equal(pthread_join(thread, NULL), 0);
    pthread_attr_destroy(&attributes);
}

int main(void) {
    return run_all_tests(scenarios_begin, scenarios_end);
}
