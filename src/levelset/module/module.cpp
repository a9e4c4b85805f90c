#include "base/error.h"
#include "levelset/calls.h"

#define MAKE(name, parameters, arguments, none) name,
#define GIVE(result, name, parameters, arguments) name,
#define DO(name, parameters, arguments) name,

// Every symbol but this one is hidden (module.map): these functions are not the library's of the same names.
const vshi_openvdb_table vshi_openvdb_module = {
    VSHI_VERSION, VSHI_OPENVDB_MAKES(MAKE) VSHI_OPENVDB_GIVES(GIVE) VSHI_OPENVDB_DOES(DO)};
