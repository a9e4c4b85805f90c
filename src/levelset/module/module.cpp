#include "base/error.h"
#include "levelset/calls.h"

// Every symbol but this one is hidden (module.map): these functions are not the library's of the same names.
const vshi_openvdb_table vshi_openvdb_module = {VSHI_VERSION, VSHI_OPENVDB_MAKES(VSHI_VALUE_MAKE)
                                                                  VSHI_OPENVDB_GIVES(VSHI_VALUE_GIVE)
                                                                      VSHI_OPENVDB_DOES(VSHI_VALUE_DO)};
