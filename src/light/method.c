/* Traits of shadow and AO methods. */
#include "light/method.h"

enum {
    INNER = VSH_METHOD_INNER,
    RAYS = VSH_METHOD_RAYS,
    KEEPS = VSH_METHOD_RAYS | VSH_METHOD_KEEPS_ERROR,
    TRACES = VSH_METHOD_RAYS | VSH_METHOD_KEEPS_ERROR | VSH_METHOD_TRIANGLES,
};

static const uint32_t shadow_traits[] = {
    [VSH_SHADOW_HARD] = 0,
    [VSH_SHADOW_CLASSIC] = 0,
    [VSH_SHADOW_PRACTICAL] = 0,
    [VSH_SHADOW_IMPROVED] = 0,
    [VSH_SHADOW_SMOOTH] = INNER,
    [VSH_SHADOW_CONE] = INNER,
    [VSH_SHADOW_RAYS] = RAYS | INNER,
    [VSH_SHADOW_ADAPTIVE] = KEEPS | INNER,
    [VSH_SHADOW_EXACT] = TRACES | INNER,
    [VSH_SHADOW_AUTO] = KEEPS | INNER,
};

static const uint32_t ao_traits[] = {
    [VSH_AO_TAPS] = 0,         [VSH_AO_CONES] = 0,      [VSH_AO_RAYS] = RAYS,
    [VSH_AO_ADAPTIVE] = KEEPS, [VSH_AO_EXACT] = TRACES, [VSH_AO_AUTO] = KEEPS,
};

enum {
    SHADOW_COUNT = sizeof shadow_traits / sizeof shadow_traits[0],
    AO_COUNT = sizeof ao_traits / sizeof ao_traits[0],
};

uint32_t vsh_method_traits(vsh_names kind, int32_t method) {
    const uint32_t place = (uint32_t)method;
    return kind == VSH_NAMES_SHADOW && place < SHADOW_COUNT ? shadow_traits[place]
           : kind == VSH_NAMES_AO && place < AO_COUNT       ? ao_traits[place]
                                                            : 0;
}

int32_t vshi_shadow_method_resolve(int32_t method, int32_t has_triangles) {
    return method != VSH_SHADOW_AUTO ? method
           : has_triangles != 0      ? (int32_t)VSH_SHADOW_EXACT
                                     : (int32_t)VSH_SHADOW_ADAPTIVE;
}

int32_t vshi_ao_method_resolve(int32_t method, int32_t has_triangles) {
    return method != VSH_AO_AUTO ? method
           : has_triangles != 0  ? (int32_t)VSH_AO_EXACT
                                 : (int32_t)VSH_AO_ADAPTIVE;
}
