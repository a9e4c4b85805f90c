/* Loads Embree. The library is not linked: names are looked up in Embree's own file, so neither a host's
 * functions of the same names (a static Embree, Embree 4) nor ours can take each other's place. */
#include "trace/embree_scene.h"

#include "base/error.h"

#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <string.h>

#define NAME(name) #name,
static const char *const names[] = {VSHI_EMBREE_CALLS(NAME)};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static vshi_embree calls;
static _Atomic(const vshi_embree *) loaded;

static vsh_result load(vsh_error *error) {
    /* stays for as long as the process lives, as other handles may trace with it */
    errno = 0;
    void *library = dlopen(VSH_EMBREE, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL && errno == ENOMEM) {
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "triangles: the system refused the memory that Embree takes");
    }
    unsigned char *call = (unsigned char *)&calls;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        void *found = library != NULL ? dlsym(library, names[i]) : NULL;
        if (found == NULL) {
            const char *why = dlerror();
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                             "triangles: exact methods trace rays with Embree, which cannot be loaded: %s",
                             why != NULL ? why : VSH_EMBREE);
        }
        memcpy(call + i * sizeof found, &found, sizeof found);
    }
    atomic_store_explicit(&loaded, &calls, memory_order_release);
    return VSH_OK;
}

vsh_result vshi_embree_load(const vshi_embree **embree, vsh_error *error) {
    vsh_result result = VSH_OK;
    *embree = atomic_load_explicit(&loaded, memory_order_acquire);
    if (*embree == NULL) {
        pthread_mutex_lock(&lock);
        result = atomic_load_explicit(&loaded, memory_order_relaxed) == NULL ? load(error) : VSH_OK;
        *embree = atomic_load_explicit(&loaded, memory_order_relaxed);
        pthread_mutex_unlock(&lock);
    }
    return result;
}
