/* The names that options have in files and on command lines, in the order of their constants. */
#include <string.h>
#include <vdbshade/base.h>

#define NAMES(...) ((const char *const[]){__VA_ARGS__, NULL})

static const char *const *const tables[] = {
    [VSH_NAMES_ISA] = NAMES("best", "base", "avx2", "avx512"),
    [VSH_NAMES_SHADOW] = NAMES("hard", "classic", "practical", "improved", "smooth", "cone", "rays",
                               "adaptive", "exact", "auto"),
    [VSH_NAMES_AO] = NAMES("taps", "cones", "rays", "adaptive", "exact", "auto"),
    [VSH_NAMES_SAMPLER] = NAMES("sobol", "white", "blue"),
    [VSH_NAMES_FALLOFF] = NAMES("none", "inverse_square", "quadratic"),
    [VSH_NAMES_COLOR] = NAMES("auto", "linear", "srgb", "encoded"),
    [VSH_NAMES_ALIGN] = NAMES("left", "center", "right"),
    [VSH_NAMES_ATLAS] = NAMES("shared", "objects"),
    [VSH_NAMES_COMBINE] = NAMES("multiply", "min"),
    [VSH_NAMES_TINT] = NAMES("none", "quadratic", "power"),
    [VSH_NAMES_BENT] = NAMES("world", "tangent"),
    [VSH_NAMES_UP] = NAMES("none", "x", "y", "z", "-x", "-y", "-z"),
    [VSH_NAMES_SEAMS] = NAMES("default", "keep", "fix"),
    [VSH_NAMES_INSIDE] = NAMES("nearest", "off"),
    [VSH_NAMES_FLAT] = NAMES("hard", "classic", "exact"),
    [VSH_NAMES_FLAT_LIGHT] = NAMES("directional", "disc", "spot"),
    [VSH_NAMES_RECEIVER_UNWRAP] = NAMES("default", "never", "auto", "always"),
    [VSH_NAMES_MEASURE] = NAMES("nonfinite", "shift", "penumbra", "lost", "gained", "rmse", "p99", "max"),
};
enum { TABLES = sizeof tables / sizeof tables[0] };

const char *vsh_get_name(int32_t kind, int32_t value) {
    const char *const *name = kind >= 0 && kind < TABLES ? tables[kind] : NULL;
    for (; name != NULL && *name != NULL; ++name, --value) {
        if (value == 0) {
            return *name;
        }
    }
    return NULL;
}

int32_t vsh_find_name(int32_t kind, const char *name) {
    const char *known;
    for (int32_t i = 0; name != NULL && (known = vsh_get_name(kind, i)) != NULL; ++i) {
        if (strcmp(known, name) == 0) {
            return i;
        }
    }
    return -1;
}
