#include "base/error.h"
#include "levelset/calls.h"

// Every symbol but this one is hidden (module.map): these functions are not the library's of the same names.
#define VALUE_MAKE(name, parameters, arguments, none) name,
#define VALUE_GIVE(result, name, parameters, arguments) name,
#define VALUE_DO(name, parameters, arguments) name,

const vshi_openvdb_table vshi_openvdb_module = {VSHI_VERSION,
                                                VSHI_OPENVDB_CALLS(VALUE_MAKE, VALUE_GIVE, VALUE_DO)};
