#include "base/job.h"

#include "base/parallel.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct vshi_job {
    vsh_run run;
    const char *stage;
    size_t total;
    _Atomic size_t done;
    atomic_bool cancelled;
    atomic_flag reporting; /* held by the thread that is inside the callback */
    double reported;       /* last fraction; guarded by `reporting` */
};

vshi_job *vshi_job_begin(const vsh_run *run, const char *stage, size_t total) {
    vshi_job *job = malloc(sizeof *job);
    if (job == NULL) {
        return NULL;
    }
    job->run = run != NULL ? *run : vsh_run_default();
    job->stage = stage;
    job->total = total > 0 ? total : 1;
    job->reported = -1.0;
    atomic_init(&job->done, 0);
    atomic_init(&job->cancelled, false);
    atomic_flag_clear(&job->reporting);
    vshi_job_advance(job, 0);
    return job;
}

vsh_result vshi_job_open(vshi_job **job, const vsh_run *run, const char *stage, size_t total,
                         const char *what, vsh_error *error) {
    *job = vshi_job_begin(run, stage, total);
    return *job != NULL ? VSH_OK : vshi_fail_memory(error, what);
}

void vshi_job_end(vshi_job *job) {
    if (job == NULL) {
        return;
    }
    if (!vshi_job_cancelled(job) && job->run.progress != NULL && job->reported < 1.0) {
        job->run.progress(job->run.user, job->stage, 1.0);
    }
    free(job);
}

bool vshi_job_advance(vshi_job *job, size_t units) {
    const size_t done = atomic_fetch_add(&job->done, units) + units;
    if (job->run.progress != NULL && !atomic_load(&job->cancelled) &&
        !atomic_flag_test_and_set(&job->reporting)) {
        double fraction = (double)done / (double)job->total;
        fraction = fraction < 1.0 ? fraction : 1.0;
        if (fraction >= job->reported) {
            job->reported = fraction;
            if (job->run.progress(job->run.user, job->stage, fraction) != 0) {
                atomic_store(&job->cancelled, true);
            }
        }
        atomic_flag_clear(&job->reporting);
    }
    return atomic_load(&job->cancelled);
}

bool vshi_job_cancelled(const vshi_job *job) {
    return atomic_load(&job->cancelled);
}

int32_t vshi_job_threads(const vshi_job *job) {
    const int32_t wanted = job->run.threads;
    const int32_t given = vshi_parallel_threads(wanted);
    static atomic_flag noted = ATOMIC_FLAG_INIT; /* once a process */
    if (given != wanted && vshi_wants_notes(&job->run) && !atomic_flag_test_and_set(&noted)) {
        const char *than = wanted > 0 ? "asked for" : "there are cores";
        vshi_note(&job->run,
                  "the system gives this process fewer threads than %s (%d at a time): slower, with the same "
                  "result",
                  than, given);
    }
    return given;
}

static vsh_result fail_cancelled(const vshi_job *job, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_CANCELLED, "%s: cancelled", job->stage);
}

vsh_result vshi_job_check(const vshi_job *job, vsh_error *error) {
    return vshi_job_cancelled(job) ? fail_cancelled(job, error) : VSH_OK;
}

vsh_result vshi_job_step(vshi_job *job, size_t units, vsh_error *error) {
    return vshi_job_advance(job, units) ? fail_cancelled(job, error) : VSH_OK;
}

/* --- loops over elements that may fail */

typedef struct elements {
    vshi_element_fn *fn;
    void *user;
    pthread_mutex_t lock; /* of the members below */
    size_t failed;        /* the lowest element that failed */
    vsh_result result;
    vsh_error error;
} elements;

static void handle_elements(void *user, size_t begin, size_t end) {
    elements *all = user;
    for (size_t i = begin; i < end; ++i) {
        vsh_error error;
        const vsh_result result = all->fn(all->user, i, &error);
        if (result == VSH_OK) {
            continue;
        }
        pthread_mutex_lock(&all->lock);
        if (all->result == VSH_OK || i < all->failed) {
            all->failed = i;
            all->result = result;
            all->error = error;
        }
        pthread_mutex_unlock(&all->lock);
    }
}

vsh_result vshi_parallel_each(vshi_job *job, size_t count, size_t grain, size_t units, vshi_element_fn *fn,
                              void *user, vsh_error *error) {
    elements all = {.fn = fn, .user = user, .lock = PTHREAD_MUTEX_INITIALIZER, .result = VSH_OK};
    VSHI_TRY(vshi_parallel_for(job, count, grain, units, handle_elements, &all, error));
    if (all.result != VSH_OK && error != NULL) {
        *error = all.error;
    }
    return all.result;
}

/* --- instruction sets */

int32_t vshi_isa_available(int32_t isa) {
#if defined(__x86_64__)
    if (isa == VSH_ISA_AVX2) {
        return __builtin_cpu_supports("avx2") != 0;
    }
    if (isa == VSH_ISA_AVX512) {
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl");
    }
#endif
    return isa == VSH_ISA_BEST || isa == VSH_ISA_BASE;
}

static vsh_result check_isa(int32_t isa, vsh_error *error) {
    const char *name = vsh_get_name(VSH_NAMES_ISA, isa);
    if (name == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "isa %d is out of range 0 … %d", isa, VSHI_ISA_COUNT - 1);
    }
    if (!vshi_isa_available(isa)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "isa %s: this machine does not have it", name);
    }
    return VSH_OK;
}

int32_t vshi_isa_resolve(int32_t isa) {
    if (isa != VSH_ISA_BEST) {
        return isa;
    }
    int32_t best = VSHI_ISA_COUNT - 1;
    while (!vshi_isa_available(best)) {
        --best;
    }
    return best;
}

/* --- options */

vsh_result vshi_options_resolve(const void *given, void *defaults, size_t size, const char *what,
                                vsh_error *error) {
    if (given == NULL) {
        return VSH_OK;
    }
    size_t given_size;
    memcpy(&given_size, given, sizeof given_size);
    /* a size that is no multiple of size_t would cut a pointer in two */
    if (given_size <= sizeof given_size || given_size > size || given_size % sizeof given_size != 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: struct_size %zu, expected %zu; fill it with its default function", what,
                         given_size, size);
    }
    memcpy(defaults, given, given_size);
    return VSH_OK;
}

vsh_result vshi_run_resolve(const vsh_run *run, vsh_run *full, vsh_error *error) {
    *full = vsh_run_default();
    VSHI_TRY(vshi_options_resolve(run, full, sizeof *full, "vsh_run", error));
    if (full->threads < 0 || full->threads > 1024) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "threads %d: expected 0 … 1024", full->threads);
    }
    if (!(full->reader_seconds >= 0.0 && full->reader_seconds <= 1e9)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "reader_seconds %g: expected more than 0, at most 1e9, or 0", full->reader_seconds);
    }
    if (full->confined != 0 && full->reader == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "confined: needs a reader; vsh_run.reader is NULL");
    }
    return check_isa(full->isa, error);
}

__attribute__((format(printf, 3, 0))) static void send_line(const vsh_run *run, const char *prefix,
                                                            const char *format, va_list arguments) {
    vsh_error line;
    const int used = snprintf(line.message, sizeof line.message, "%s", prefix);
    vsnprintf(line.message + used, sizeof line.message - (size_t)used, format, arguments);
    vshi_one_line(line.message);
    run->warning(run->user, line.message);
}

void vshi_warn(const vsh_run *run, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    if (run != NULL && run->warning != NULL) {
        send_line(run, "", format, arguments);
    }
    va_end(arguments);
}

bool vshi_wants_notes(const vsh_run *run) {
    return run != NULL && run->warning != NULL && run->notes != 0;
}

void vshi_note(const vsh_run *run, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    if (vshi_wants_notes(run)) {
        send_line(run, VSHI_NOTE, format, arguments);
    }
    va_end(arguments);
}
