/* Assimp and Draco are loaded when the first file asks for them: of what a program takes to start, loading
 * them with the library was half (2.5 ms, 43 000 relocations), and glTF, OBJ and PLY need neither. */
#include "extern/importers.h"
#include "extern/module.h"

static vshi_module module = VSHI_MODULE("models of this kind", "importers", 16 << 20, 0);

static const vshi_importers_table *at(void) {
    return vshi_module_table(&module);
}

#define MAKE(name, parameters, arguments, none)                                                              \
    vsh_result name parameters {                                                                             \
        const vsh_result result = vshi_module_load(&module, error);                                          \
        if (result == VSH_OK) {                                                                              \
            return at()->name arguments;                                                                     \
        }                                                                                                    \
        *(none) = NULL;                                                                                      \
        return result;                                                                                       \
    }
#define GIVE(result, name, parameters, arguments)                                                            \
    result name parameters {                                                                                 \
        return at()->name arguments;                                                                         \
    }
#define DO(name, parameters, arguments)                                                                      \
    void name parameters {                                                                                   \
        if (at() != NULL) {                                                                                  \
            at()->name arguments;                                                                            \
        }                                                                                                    \
    }

VSHI_IMPORTERS_MAKES(MAKE)
VSHI_IMPORTERS_GIVES(GIVE)
VSHI_IMPORTERS_DOES(DO)
