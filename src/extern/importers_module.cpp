#include "base/error.h"
#include "extern/importers.h"

// Every symbol but this one is hidden (module.map): these functions are not the library's of the same names.
const vshi_importers_table vshi_importers_module = {VSHI_VERSION, VSHI_IMPORTERS_MAKES(VSHI_VALUE_MAKE)
                                                                      VSHI_IMPORTERS_GIVES(VSHI_VALUE_GIVE)
                                                                          VSHI_IMPORTERS_DOES(VSHI_VALUE_DO)};
