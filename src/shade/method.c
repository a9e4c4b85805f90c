/* Names of the methods, each in one table that both directions read. */
#include <vdbshade/bake.h>

#include <string.h>

static const char *const shadow_names[] = {
    [VSH_SHADOW_HARD] = "hard",           [VSH_SHADOW_CLASSIC] = "classic",
    [VSH_SHADOW_PRACTICAL] = "practical", [VSH_SHADOW_IMPROVED] = "improved",
    [VSH_SHADOW_SMOOTH] = "smooth",       [VSH_SHADOW_CONE] = "cone",
    [VSH_SHADOW_RAYS] = "rays",           [VSH_SHADOW_ADAPTIVE] = "adaptive",
    [VSH_SHADOW_EXACT] = "exact",
};

static const char *const ao_names[] = {[VSH_AO_TAPS] = "taps",
                                       [VSH_AO_CONES] = "cones",
                                       [VSH_AO_RAYS] = "rays",
                                       [VSH_AO_ADAPTIVE] = "adaptive",
                                       [VSH_AO_EXACT] = "exact"};

static const char *const sampler_names[] = {
    [VSH_SAMPLER_SOBOL] = "sobol", [VSH_SAMPLER_WHITE] = "white", [VSH_SAMPLER_BLUE] = "blue"};

static const char *const combine_names[] = {[VSH_COMBINE_MULTIPLY] = "multiply", [VSH_COMBINE_MIN] = "min"};

static const char *const tint_names[] = {
    [VSH_TINT_NONE] = "none", [VSH_TINT_QUADRATIC] = "quadratic", [VSH_TINT_POWER] = "power"};
static const char *const space_names[] = {[VSH_BENT_WORLD] = "world", [VSH_BENT_TANGENT] = "tangent"};

enum {
    SHADOW_COUNT = sizeof shadow_names / sizeof shadow_names[0],
    AO_COUNT = sizeof ao_names / sizeof ao_names[0],
    SAMPLER_COUNT = sizeof sampler_names / sizeof sampler_names[0],
    TINT_COUNT = sizeof tint_names / sizeof tint_names[0],
    SPACE_COUNT = sizeof space_names / sizeof space_names[0],
    COMBINE_COUNT = sizeof combine_names / sizeof combine_names[0],
};

static int32_t find(const char *const *names, int32_t count, const char *name) {
    for (int32_t i = 0; name != NULL && i < count; ++i) {
        if (strcmp(names[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

static const char *name_at(const char *const *names, int32_t count, int32_t i) {
    return i >= 0 && i < count ? names[i] : NULL;
}

int32_t vsh_shadow_method(const char *name) {
    return find(shadow_names, SHADOW_COUNT, name);
}

const char *vsh_shadow_method_name(int32_t method) {
    return name_at(shadow_names, SHADOW_COUNT, method);
}

int32_t vsh_ao_method(const char *name) {
    return find(ao_names, AO_COUNT, name);
}

const char *vsh_ao_method_name(int32_t method) {
    return name_at(ao_names, AO_COUNT, method);
}

int32_t vsh_sampler(const char *name) {
    return find(sampler_names, SAMPLER_COUNT, name);
}

const char *vsh_sampler_name(int32_t sampler) {
    return name_at(sampler_names, SAMPLER_COUNT, sampler);
}

int32_t vsh_combine(const char *name) {
    return find(combine_names, COMBINE_COUNT, name);
}

const char *vsh_combine_name(int32_t combine) {
    return name_at(combine_names, COMBINE_COUNT, combine);
}

int32_t vsh_tint_type(const char *name) {
    return find(tint_names, TINT_COUNT, name);
}

const char *vsh_tint_type_name(int32_t type) {
    return name_at(tint_names, TINT_COUNT, type);
}

int32_t vsh_bent_space(const char *name) {
    return find(space_names, SPACE_COUNT, name);
}

const char *vsh_bent_space_name(int32_t space) {
    return name_at(space_names, SPACE_COUNT, space);
}
