/* Modules: parts of this library that are loaded when the first call needs them, for what loads with them. */
#ifndef VSHI_MODULE_H
#define VSHI_MODULE_H

#include <pthread.h>
#include <stdatomic.h>
#include <vdbshade/base.h>

typedef struct vshi_module {
    const char *what;   /* needs it: "level sets" */
    const char *file;   /* looked for beside this library, and then as every library is */
    const char *symbol; /* its table, whose first member is the version of the headers it was built with */
    size_t room;        /* bytes that loading it takes */
    int32_t threads;    /* that its libraries begin */
    pthread_mutex_t lock;
    _Atomic(const void *) table;
} vshi_module;

#define VSHI_MODULE(what, name, room, threads)                                                               \
    {                                                                                                        \
        what, "libvdbshade_" name ".so." VSHI_SOVERSION, "vshi_" name "_module", room, threads,              \
            PTHREAD_MUTEX_INITIALIZER, NULL                                                                  \
    }

/* Loads it, where that has not been done, for as long as the process lives. Errors: VSH_ERROR_MEMORY (the
 * system refuses threads or memory that its libraries take), VSH_ERROR_UNSUPPORTED (no such file, one of
 * another version). */
vsh_result vshi_module_load(vshi_module *module, vsh_error *error);

/* NULL where it is not loaded. */
static inline const void *vshi_module_table(const vshi_module *module) {
    return atomic_load_explicit(&module->table, memory_order_acquire);
}

#endif
