/* Every kind of call works on a stack of 128 KiB, of a thread and of a fibre. The system does not know a
 * fibre's stack. Nobody may touch the page below each stack. */
#define _GNU_SOURCE
#include "io/reader/reader.h"
#include "scenarios.h"

#include <limits.h>
#include <pthread.h>
#include <sys/mman.h>
#include <ucontext.h>

enum { STACK = 128 << 10, GUARD = 4096 };

typedef struct call {
    scenario_fn *scenario;
    vsh_run run;
    vsh_result result;
    vsh_error error;
} call;

static void do_call(call *c) {
    c->error = (vsh_error){VSH_OK, ""};
    c->result = c->scenario(&c->run, &c->error);
}

static void *on_thread(void *user) {
    do_call(user);
    return NULL;
}

/* makecontext() passes integers only. */
static call *fibre_call;
static void on_fibre(void) {
    do_call(fibre_call);
}

static unsigned char *make_stack(void) {
    unsigned char *pages =
        mmap(NULL, GUARD + STACK, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_ptr_not_equal(pages, MAP_FAILED);
    assert_int_equal(mprotect(pages, GUARD, PROT_NONE), 0);
    return pages;
}

static void run_on_thread(call *c) {
    unsigned char *pages = make_stack();
    pthread_attr_t attributes;
    pthread_t thread;
    assert_int_equal(pthread_attr_init(&attributes), 0);
    assert_int_equal(pthread_attr_setstack(&attributes, pages + GUARD, STACK), 0);
    assert_int_equal(pthread_create(&thread, &attributes, on_thread, c), 0);
    assert_int_equal(pthread_join(thread, NULL), 0);
    pthread_attr_destroy(&attributes);
    munmap(pages, GUARD + STACK);
}

static void run_on_fibre(call *c) {
    static ucontext_t host, fibre;
    unsigned char *pages = make_stack();
    assert_int_equal(getcontext(&fibre), 0);
    fibre.uc_stack.ss_sp = pages + GUARD;
    fibre.uc_stack.ss_size = STACK;
    fibre.uc_link = &host;
    fibre_call = c;
    makecontext(&fibre, on_fibre, 0);
    assert_int_equal(swapcontext(&host, &fibre), 0);
    munmap(pages, GUARD + STACK);
}

static void run_everywhere(const char *name, call *c) {
    static void (*const places[])(call *) = {run_on_thread, run_on_fibre};
    for (size_t i = 0; i < 2; ++i) {
        c->run.threads = (int32_t)i + 1;
        places[i](c);
        assert_that(c->result == VSH_OK, "%s: %s", name, c->error.message);
        scenarios_untouched(); /* restores the outputs */
    }
}

TEST(every_scenario_runs) {
    for (size_t i = 0; i < scenario_count; ++i) {
        call c = {.scenario = scenarios[i].run, .run = vsh_run_default()};
        run_everywhere(scenarios[i].name, &c);
    }
}

TEST(files_are_read_by_a_reader) {
    char reader[PATH_MAX];
    const ssize_t length = readlink("/proc/self/exe", reader, sizeof reader - 32);
    assert_true(length > 0);
    reader[length] = '\0';
    strcpy(strrchr(reader, '/'), "/../" VSH_READER);
    if (access(reader, X_OK) != 0) {
        skip();
    }
    for (size_t i = 0; i < scenario_count; ++i) {
        if (strstr(scenarios[i].name, "models") != NULL || strstr(scenarios[i].name, "assets") != NULL ||
            strstr(scenarios[i].name, "images read") != NULL) {
            call c = {.scenario = scenarios[i].run, .run = vsh_run_default()};
            c.run.reader = reader;
            run_everywhere(scenarios[i].name, &c);
        }
    }
}

/* Jansson reads 2048 nested levels. */
static vsh_result read_deep(const vsh_run *run, vsh_error *error) {
    static const struct {
        const char *name, *begin, *end;
    } files[] = {{"deep.json", "{\"casters\": ", "}"},
                 {"deep.gltf", "{\"asset\": {\"version\": \"2.0\"}, \"extras\": ", "}"}};
    enum { LEVELS = 2000 };
    for (size_t i = 0; i < 2; ++i) {
        FILE *file = fopen(files[i].name, "w");
        assert_non_null(file);
        fputs(files[i].begin, file);
        for (int level = 0; level < 2 * LEVELS; ++level) {
            fputc(level < LEVELS ? '[' : ']', file);
        }
        fputs(files[i].end, file);
        fclose(file);
    }
    vsh_scene *scene = NULL;
    vsh_model *model = NULL;
    vshi_tolerances *tolerances = NULL;
    vsh_flat_scene *flat = NULL;
    vsh_view_bake bake = vsh_view_bake_default();
    bake.model = files[1].name;
    const bool refused = vsh_scene_read(files[0].name, run, &scene, error) == VSH_ERROR_INPUT &&
                         vsh_flat_scene_read(files[0].name, run, &flat, error) == VSH_ERROR_INPUT &&
                         vshi_tolerances_read(files[0].name, &tolerances, error) == VSH_ERROR_INPUT &&
                         vsh_model_read(files[1].name, run, &model, error) == VSH_ERROR_INPUT &&
                         vsh_view_write("deep.html", &bake, NULL, run, error) == VSH_ERROR_INPUT;
    unlink(files[0].name);
    unlink(files[1].name);
    return refused ? VSH_OK : VSH_ERROR_INTERNAL;
}

TEST(deeply_nested_files_are_refused) {
    call c = {.scenario = read_deep, .run = vsh_run_default()};
    run_everywhere("deeply nested files", &c);
}

int main(void) { /* sanitizers make frames larger */
    return VSHI_SANITIZED ? 0 : run_all_tests(scenarios_begin, scenarios_end);
}
