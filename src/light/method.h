/* Traits of methods. */
#pragma once

#include <vdbshade/light.h>

/* What auto comes to with triangles (nonzero) or without; every other method is itself. */
int32_t vshi_shadow_method_resolve(int32_t method, int32_t has_triangles);
int32_t vshi_ao_method_resolve(int32_t method, int32_t has_triangles);
