/* Modules: parts of this library that load large libraries, when the first call needs them. */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <vdbshade/base.h>

typedef struct vshi_module {
    const char *what;      /* the inputs that need it: "level sets" */
    const char *libraries; /* the libraries it is linked with: "OpenVDB" */
    const char *file;      /* searched beside this library, then on the loader's path */
    const char *symbol;    /* its table; the first member is the version of the headers it was built with */
    size_t room;           /* bytes of memory for loading */
    int32_t threads;       /* begun by its libraries */
    pthread_mutex_t lock;
    _Atomic(const void *) table;
} vshi_module;

#define VSHI_MODULE(what, libraries, name, room, threads)                                                    \
    {                                                                                                        \
        what, libraries, "libvdbshade_" name ".so." VSHI_SOVERSION, "vshi_" name "_module", room, threads,   \
            PTHREAD_MUTEX_INITIALIZER, NULL                                                                  \
    }

/* Loads a module, once for the life of the process. Errors: VSH_ERROR_MEMORY (the system refuses threads or
 * memory for its libraries), VSH_ERROR_UNSUPPORTED (no such file, or another version). */
vsh_result vshi_module_load(vshi_module *module, vsh_error *error);

/* Returns the module's table; NULL if it is not loaded. */
static inline const void *vshi_module_table(const vshi_module *module) {
    return atomic_load_explicit(&module->table, memory_order_acquire);
}
