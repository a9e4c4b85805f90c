#include "base/error.h"
#include "extern/importers.h"

#define MAKE(name, parameters, arguments, none) name,
#define GIVE(result, name, parameters, arguments) name,
#define DO(name, parameters, arguments) name,

// Every symbol but this one is hidden (module.map): these functions are not the library's of the same names.
const vshi_importers_table vshi_importers_module = {
    VSHI_VERSION, VSHI_IMPORTERS_MAKES(MAKE) VSHI_IMPORTERS_GIVES(GIVE) VSHI_IMPORTERS_DOES(DO)};
