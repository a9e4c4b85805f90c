/* Methods: their names and what they are like, each in one table. */
#include "base/names.h"

#include <vdbshade/method.h>

#include <string.h>

enum {
    INNER = VSH_METHOD_INNER,
    RAYS = VSH_METHOD_RAYS,
    KEEPS = VSH_METHOD_RAYS | VSH_METHOD_KEEPS_ERROR,
    TRACES = VSH_METHOD_RAYS | VSH_METHOD_KEEPS_ERROR | VSH_METHOD_TRIANGLES,
};

typedef struct method_row {
    const char *name;
    uint32_t traits;
} method_row;

static const method_row shadow_methods[] = {
    [VSH_SHADOW_HARD] = {"hard", 0},
    [VSH_SHADOW_CLASSIC] = {"classic", 0},
    [VSH_SHADOW_PRACTICAL] = {"practical", 0},
    [VSH_SHADOW_IMPROVED] = {"improved", 0},
    [VSH_SHADOW_SMOOTH] = {"smooth", INNER},
    [VSH_SHADOW_CONE] = {"cone", INNER},
    [VSH_SHADOW_RAYS] = {"rays", RAYS | INNER},
    [VSH_SHADOW_ADAPTIVE] = {"adaptive", KEEPS | INNER},
    [VSH_SHADOW_EXACT] = {"exact", TRACES | INNER},
    [VSH_SHADOW_AUTO] = {"auto", KEEPS | INNER},
};

static const method_row ao_methods[] = {
    [VSH_AO_TAPS] = {"taps", 0},        [VSH_AO_CONES] = {"cones", 0},
    [VSH_AO_RAYS] = {"rays", RAYS},     [VSH_AO_ADAPTIVE] = {"adaptive", KEEPS},
    [VSH_AO_EXACT] = {"exact", TRACES}, [VSH_AO_AUTO] = {"auto", KEEPS},
};

static const char *const sampler_table[] = {
    [VSH_SAMPLER_SOBOL] = "sobol", [VSH_SAMPLER_WHITE] = "white", [VSH_SAMPLER_BLUE] = "blue"};
static const vshi_names samplers = VSHI_NAMES(sampler_table);

enum {
    SHADOW_COUNT = sizeof shadow_methods / sizeof shadow_methods[0],
    AO_COUNT = sizeof ao_methods / sizeof ao_methods[0],
};

static int32_t find_method(const method_row *rows, int32_t count, const char *name) {
    for (int32_t i = 0; name != NULL && i < count; ++i) {
        if (strcmp(rows[i].name, name) == 0) {
            return i;
        }
    }
    return -1;
}

int32_t vsh_shadow_method(const char *name) {
    return find_method(shadow_methods, SHADOW_COUNT, name);
}

const char *vsh_shadow_method_name(int32_t method) {
    return method >= 0 && method < SHADOW_COUNT ? shadow_methods[method].name : NULL;
}

uint32_t vsh_shadow_method_traits(int32_t method) {
    return method >= 0 && method < SHADOW_COUNT ? shadow_methods[method].traits : 0;
}

int32_t vsh_shadow_method_resolve(int32_t method, int32_t has_triangles) {
    return method != VSH_SHADOW_AUTO ? method
           : has_triangles != 0      ? (int32_t)VSH_SHADOW_EXACT
                                     : (int32_t)VSH_SHADOW_ADAPTIVE;
}

int32_t vsh_ao_method(const char *name) {
    return find_method(ao_methods, AO_COUNT, name);
}

const char *vsh_ao_method_name(int32_t method) {
    return method >= 0 && method < AO_COUNT ? ao_methods[method].name : NULL;
}

uint32_t vsh_ao_method_traits(int32_t method) {
    return method >= 0 && method < AO_COUNT ? ao_methods[method].traits : 0;
}

int32_t vsh_ao_method_resolve(int32_t method, int32_t has_triangles) {
    return method != VSH_AO_AUTO ? method
           : has_triangles != 0  ? (int32_t)VSH_AO_EXACT
                                 : (int32_t)VSH_AO_ADAPTIVE;
}

int32_t vsh_sampler(const char *name) {
    return vshi_name_find(samplers, name);
}

const char *vsh_sampler_name(int32_t sampler) {
    return vshi_name_at(samplers, sampler);
}
