/* Assimp and Draco are loaded when the first file asks for them: of what a program takes to start, loading
 * them with the library was half (2.5 ms, 43 000 relocations), and glTF, OBJ and PLY need neither. */
#include "extern/importers.h"
#include "extern/module.h"

static vshi_module module = VSHI_MODULE("models of this kind", "importers", 16 << 20, 0);

static const vshi_importers_table *at(void) {
    return vshi_module_table(&module);
}

VSHI_IMPORTERS_MAKES(VSHI_PASS_MAKE)
VSHI_IMPORTERS_GIVES(VSHI_PASS_GIVE)
VSHI_IMPORTERS_DOES(VSHI_PASS_DO)
