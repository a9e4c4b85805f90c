/* Names of what shading is told. */
#include "base/names.h"

#include <vdbshade/layer.h>
#include <vdbshade/shade.h>

static const char *const combines_table[] = {[VSH_COMBINE_MULTIPLY] = "multiply", [VSH_COMBINE_MIN] = "min"};
static const vshi_names combines = VSHI_NAMES(combines_table);

int32_t vsh_combine(const char *name) {
    return vshi_name_find(combines, name);
}

const char *vsh_combine_name(int32_t combine) {
    return vshi_name_at(combines, combine);
}

static const char *const tints_table[] = {
    [VSH_TINT_NONE] = "none", [VSH_TINT_QUADRATIC] = "quadratic", [VSH_TINT_POWER] = "power"};
static const vshi_names tints = VSHI_NAMES(tints_table);

int32_t vsh_tint_type(const char *name) {
    return vshi_name_find(tints, name);
}

const char *vsh_tint_type_name(int32_t type) {
    return vshi_name_at(tints, type);
}
