/* Loads OpenVDB when the first level set is made or read. Loading it takes ten times as long as all other
 * libraries together (30 ms, 20 MB). One of its libraries, liblog4cplus, starts threads in the process. */
#include "levelset/calls.h"
#include "base/module.h"
#include "base/threads.h"

static vshi_module module = VSHI_MODULE("level sets", "OpenVDB", "openvdb", 48 << 20, VSHI_OPENVDB_THREADS);

static const vshi_openvdb_table *get_table(void) {
    return vshi_module_table(&module);
}

static int *const nothing = NULL;

#define PASS_MAKE(name, parameters, arguments, none)                                                         \
    vsh_result name parameters {                                                                             \
        const vsh_result result = vshi_module_load(&module, error);                                          \
        if (result == VSH_OK) {                                                                              \
            return get_table()->name arguments;                                                              \
        }                                                                                                    \
        if ((none) != NULL) {                                                                                \
            *(none) = 0;                                                                                     \
        }                                                                                                    \
        return result;                                                                                       \
    }
#define PASS_GIVE(result, name, parameters, arguments)                                                       \
    result name parameters {                                                                                 \
        return get_table()->name arguments;                                                                  \
    }
#define PASS_DO(name, parameters, arguments)                                                                 \
    void name parameters {                                                                                   \
        if (get_table() != NULL) {                                                                           \
            get_table()->name arguments;                                                                     \
        }                                                                                                    \
    }

VSHI_OPENVDB_CALLS(PASS_MAKE, PASS_GIVE, PASS_DO)
