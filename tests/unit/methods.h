/* Shadows and AO by every method, one kind of value after the other. */
#ifndef TESTS_METHODS_H
#define TESTS_METHODS_H

#include "traced.h"

/* Shadow methods by their numbers, then those of AO. */
enum { SHADOWS = SHADOW_METHODS, KINDS = SHADOWS + AO_METHODS };

static inline bool is_ao(int kind) {
    return kind >= SHADOWS;
}

static inline const char *name_of(int kind) {
    static char name[32];
    snprintf(name, sizeof name, "%s %s", is_ao(kind) ? "AO" : "shadow",
             is_ao(kind) ? vsh_get_name(VSH_NAMES_AO, kind - SHADOWS) : vsh_get_name(VSH_NAMES_SHADOW, kind));
    return name;
}

static inline vsh_shade_stats cast_kind(const casting *c, int kind, const vsh_light *light,
                                        double ao_distance, size_t count, const double *at,
                                        const float *facing, float *values) {
    return is_ao(kind) ? cast_ao(c, kind - SHADOWS, ao_distance, count, at, facing, values)
                       : cast_shadows(c, light, kind, count, at, facing, values);
}

static inline float cast_kind_at(const casting *c, int kind, const vsh_light *light, double ao_distance,
                                 const double *at, const float *facing) {
    float value = -1.0f;
    cast_kind(c, kind, light, ao_distance, 1, at, facing, &value);
    return value;
}

/* With options of the test's own, but for the method. */
static inline void shade_kind(const casting *c, int kind, const vsh_light *light, vsh_shade_options options,
                              const vsh_points *points, float *values) {
    *(is_ao(kind) ? &options.ao_method : &options.method) = is_ao(kind) ? kind - SHADOWS : kind;
    assert_int_equal(is_ao(kind) ? vsh_shade_ao(occluders_of_caster(c), points, &options, NULL, values, NULL,
                                                NULL, NULL, NULL)
                                 : vsh_shade_shadow(occluders_of_caster(c), points, light, &options, NULL,
                                                    values, NULL, NULL, NULL),
                     VSH_OK);
}

#endif
