/* OpenVDB is loaded when the first level set is made or read: loading it takes ten times as long as all other
 * libraries together (30 ms, 20 MB), and one of its own, liblog4cplus, begins threads in whoever loads it. */
#include "levelset/calls.h"
#include "base/threads.h"
#include "extern/module.h"

static vshi_module module = VSHI_MODULE("level sets", "openvdb", 48 << 20, VSHI_OPENVDB_THREADS);

static const vshi_openvdb_table *at(void) {
    return vshi_module_table(&module);
}

static int *const nothing = NULL;

VSHI_OPENVDB_MAKES(VSHI_PASS_MAKE)
VSHI_OPENVDB_GIVES(VSHI_PASS_GIVE)
VSHI_OPENVDB_DOES(VSHI_PASS_DO)
