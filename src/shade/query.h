/* Queries of points in free space. */
#ifndef VSHI_QUERY_H
#define VSHI_QUERY_H

#include <stdbool.h>
#include <vdbshade/query.h>

/* vsh_query_create(), or (sphere) a query whose AO is the free share of all directions around a point, each
 * counting alike, and takes no normals. Errors: VSH_ERROR_ARGUMENT, also for taps, which go along a normal. */
vsh_result vshi_query_create(const vsh_field *field, const vsh_light *lights, size_t light_count,
                             const vsh_shade_options *options, bool sphere, vsh_query **query,
                             vsh_error *error);

#endif
