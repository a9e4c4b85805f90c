#define _GNU_SOURCE

#include "shim/module.h"

#include <dlfcn.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* Beside this library, and then as every library is searched for: in a host with a sanitizer, whose dlopen()
 * is not libc's, the search does not begin at this one. */
static void *open_module(const char *file) {
    static const char of_this_library = 0;
    Dl_info here;
    char path[4096];
    const bool known = dladdr(&of_this_library, &here) != 0 && here.dli_fname != NULL;
    /* a path that is not absolute would be looked for where the host is by now */
    const char *end = known && here.dli_fname[0] == '/' ? strrchr(here.dli_fname, '/') : NULL;
    void *module = NULL;
    if (end != NULL && (size_t)snprintf(path, sizeof path, "%.*s/%s", (int)(end - here.dli_fname),
                                        here.dli_fname, file) < sizeof path) {
        module = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
    }
    return module != NULL ? module : dlopen(file, RTLD_LAZY | RTLD_LOCAL);
}

const void *vshi_module_table(const char *file, const char *symbol, char *reason, size_t reason_size) {
    void *module = open_module(file);
    const void *table = module != NULL ? dlsym(module, symbol) : NULL;
    if (table == NULL) {
        const char *why = dlerror();
        snprintf(reason, reason_size, "%s", why != NULL ? why : "it has no table");
        return NULL;
    }
    const char *version = *(const char *const *)table;
    if (strcmp(version, vsh_version()) != 0) {
        snprintf(reason, reason_size, "%s is of version %s", file, version);
        return NULL;
    }
    return table;
}
