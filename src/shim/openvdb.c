/* OpenVDB is loaded when the first level set is made or read: loading it takes ten times as long as all other
 * libraries together (30 ms, 20 MB), and one of its own, liblog4cplus, begins threads in whoever loads it. */
#include "base/error.h"
#include "base/threads.h"
#include "shim/module.h"
#include "shim/openvdb_table.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

/* Written once. */
static _Atomic(const vshi_openvdb_table *) table;
static pthread_mutex_t loading = PTHREAD_MUTEX_INITIALIZER;

static vsh_result load(vsh_error *error) {
    char reason[512];
    if (!vshi_threads_left(VSHI_OPENVDB_THREADS)) {
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "threads: the system refuses the %d that OpenVDB's libraries begin",
                         VSHI_OPENVDB_THREADS);
    }
    const vshi_openvdb_table *found = vshi_module_table("libvdbshade_openvdb.so." VSHI_SOVERSION,
                                                        "vshi_openvdb_module", reason, sizeof reason);
    if (found == NULL) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "level sets need the module of OpenVDB, which cannot be had: %s", reason);
    }
    atomic_store_explicit(&table, found, memory_order_release);
    return VSH_OK;
}

static const vshi_openvdb_table *at(void) {
    return atomic_load_explicit(&table, memory_order_acquire);
}

static vsh_result have_module(vsh_error *error) {
    if (at() != NULL) {
        return VSH_OK;
    }
    pthread_mutex_lock(&loading);
    const vsh_result result = at() == NULL ? load(error) : VSH_OK;
    pthread_mutex_unlock(&loading);
    return result;
}

static int *const nothing = NULL;

#define MAKE(name, parameters, arguments, none)                                                              \
    vsh_result name parameters {                                                                             \
        const vsh_result result = have_module(error);                                                        \
        if (result == VSH_OK) {                                                                              \
            return at()->name arguments;                                                                     \
        }                                                                                                    \
        if ((none) != NULL) {                                                                                \
            *(none) = 0;                                                                                     \
        }                                                                                                    \
        return result;                                                                                       \
    }
#define GIVE(result, name, parameters, arguments)                                                            \
    result name parameters {                                                                                 \
        return at()->name arguments;                                                                         \
    }
#define DO(name, parameters, arguments)                                                                      \
    void name parameters {                                                                                   \
        if (at() != NULL) {                                                                                  \
            at()->name arguments;                                                                            \
        }                                                                                                    \
    }

VSHI_OPENVDB_MAKES(MAKE)
VSHI_OPENVDB_GIVES(GIVE)
VSHI_OPENVDB_DOES(DO)
