#include "base/parallel.h"

#include <pthread.h>

typedef struct elements {
    vshi_element_fn *fn;
    void *user;
    pthread_mutex_t lock; /* of what follows */
    size_t failed;        /* the lowest element that failed */
    vsh_result result;
    vsh_error error;
} elements;

/* A vshi_range_fn over elements. */
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
