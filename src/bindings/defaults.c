/* What bindings call instead of the headers' inline functions. */
#include <vdbshade/vdbshade.h>

#include <stdbool.h>
#include <string.h>

#define SIZED(type, defaults)                                                                                \
    static void make_##type(void *made, size_t size) {                                                       \
        const type known = defaults();                                                                       \
        memcpy(made, &known, size < sizeof known ? size : sizeof known);                                     \
    }
#define UNSIZED SIZED
#include "bindings/structs.inc"
#undef SIZED
#undef UNSIZED

#define SIZED(type, defaults) {#type, make_##type, true},
#define UNSIZED(type, defaults) {#type, make_##type, false},
static const struct {
    const char *name;
    void (*make)(void *made, size_t size);
    bool sized;
} structs[] = {
#include "bindings/structs.inc"
};

int32_t vsh_struct_init(const char *name, void *made, size_t size) {
    if (name == NULL || made == NULL) {
        return 0;
    }
    for (size_t i = 0; i < sizeof structs / sizeof structs[0]; ++i) {
        if (strcmp(structs[i].name, name) == 0) {
            structs[i].make(made, size);
            if (structs[i].sized && size >= sizeof size) {
                memcpy(made, &size, sizeof size); /* the caller's, whatever this library knows */
            }
            return 1;
        }
    }
    return 0;
}
