/* Loads Assimp and Draco when the first file needs them. Loading them with the library took half of a
 * program's start (2.5 ms, 43 000 relocations), and glTF, OBJ and PLY need neither. Static libraries and
 * tests link importers.cpp instead. */
#include "io/model/importers.h"
#include "base/module.h"

static vshi_module module = VSHI_MODULE("models of this kind", "Assimp and Draco", "importers", 16 << 20, 0);

vsh_result vshi_importers_load(vsh_error *error) {
    return vshi_module_load(&module, error);
}

const vshi_importers_table *vshi_importers(void) {
    return vshi_module_table(&module);
}
