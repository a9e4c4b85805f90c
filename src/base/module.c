#define _GNU_SOURCE

#include "base/module.h"

#include "base/error.h"
#include "base/threads.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* Searches beside this library (as built), in its folder vdbshade (as installed), then on the loader's path.
 * In a host with a sanitizer, which replaces dlopen(), the loader does not search beside this library. */
static void *open_module(const char *file) {
    static const char of_this_library = 0, *const folders[] = {"", "vdbshade/"};
    Dl_info here;
    const bool known = dladdr(&of_this_library, &here) != 0 && here.dli_fname != NULL;
    /* the host may have left the folder that a relative path begins at */
    const char *end = known && here.dli_fname[0] == '/' ? strrchr(here.dli_fname, '/') : NULL;
    for (size_t i = 0; end != NULL && i < sizeof folders / sizeof folders[0]; ++i) {
        char path[4096];
        const int length = snprintf(path, sizeof path, "%.*s/%s%s", (int)(end - here.dli_fname),
                                    here.dli_fname, folders[i], file);
        if (length > 0 && (size_t)length < sizeof path && access(path, F_OK) == 0) {
            return dlopen(path, RTLD_LAZY | RTLD_LOCAL); /* if it fails, dlerror() names what is missing */
        }
    }
    return dlopen(file, RTLD_LAZY | RTLD_LOCAL);
}

static bool has_room(size_t bytes) {
    void *room = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (room != MAP_FAILED) {
        munmap(room, bytes);
    }
    return room != MAP_FAILED;
}

/* Exceptions while libraries load (their statics, refused memory or threads) end the process, so this checks
 * their needs before. */
static vsh_result check_room(const vshi_module *module, vsh_error *error) {
    errno = 0;
    if (module->threads > 0 && !vshi_threads_left(module->threads)) {
        return errno == ENOMEM
                   ? vshi_fail_memory(error, module->what)
                   : vshi_fail(
                         error, VSH_ERROR_MEMORY,
                         "threads: the system refuses the %d that OpenVDB's libraries begin; %s need it",
                         module->threads, module->what);
    }
    return has_room(module->room)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused the %zu MB that %s takes",
                           module->what, module->room / 1000000, module->file);
}

static vsh_result load(vshi_module *module, vsh_error *error) {
    VSHI_TRY(check_room(module, error));
    errno = 0;
    void *opened = open_module(module->file);
    if (opened == NULL && errno == ENOMEM) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused the memory that %s takes",
                         module->what, module->file);
    }
    const void *table = opened != NULL ? dlsym(opened, module->symbol) : NULL;
    if (table == NULL) {
        const char *why = dlerror();
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: need %s, missing here or left out of this build: %s", module->what,
                         module->libraries, why != NULL ? why : module->file);
    }
    const char *version = *(const char *const *)table;
    if (strcmp(version, VSHI_VERSION) != 0) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: need %s, which is of version %s here",
                         module->what, module->file, version);
    }
    atomic_store_explicit(&module->table, table, memory_order_release);
    return VSH_OK;
}

vsh_result vshi_module_load(vshi_module *module, vsh_error *error) {
    if (vshi_module_table(module) != NULL) {
        return VSH_OK;
    }
    pthread_mutex_lock(&module->lock);
    const vsh_result result = vshi_module_table(module) == NULL ? load(module, error) : VSH_OK;
    pthread_mutex_unlock(&module->lock);
    return result;
}
