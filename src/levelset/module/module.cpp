#include "base/error.h"
#include "levelset/calls.h"

// module.map hides every other symbol: these functions are not those of the same names in the library.
#define VALUE_MAKE(name, parameters, arguments, none) name,
#define VALUE_GIVE(result, name, parameters, arguments) name,
#define VALUE_DO(name, parameters, arguments) name,

const vshi_openvdb_table vshi_openvdb_module = {VSHI_VERSION,
                                                VSHI_OPENVDB_CALLS(VALUE_MAKE, VALUE_GIVE, VALUE_DO)};
