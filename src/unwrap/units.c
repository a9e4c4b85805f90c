#include "unwrap/units.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

enum { SMOOTHINGS = 2 }; /* of normals, by what is beside them */

static void measure(vshi_units *g) {
    const vshi_cut_mesh *s = g->surface;
    for (uint32_t u = 0; u < g->count; ++u) {
        vshi_unit_shape *unit = &g->units[u];
        vshi_vec normal = {0, 0, 0}, centre = {0, 0, 0};
        for (uint32_t i = s->unit_begin[u]; i < s->unit_begin[u + 1]; ++i) {
            const uint32_t triangle = s->unit_list[i];
            vshi_vec p[3];
            vshi_cut_mesh_corners(s, triangle, p);
            normal = vshi_add(normal, vshi_scale(s->normal[triangle], s->area[triangle]));
            centre =
                vshi_add(centre, vshi_scale(vshi_add(p[0], vshi_add(p[1], p[2])), s->area[triangle] / 3.0));
            unit->area += s->area[triangle];
        }
        unit->normal = vshi_unit(normal);
        unit->centre = vshi_scale(centre, 1.0 / unit->area);
    }
}

static uint32_t list_sides(vshi_units *g, bool count_only) {
    const vshi_cut_mesh *s = g->surface;
    uint32_t count = 0;
    for (uint32_t u = 0; u < g->count; ++u) {
        g->begin[u] = count;
        for (uint32_t i = s->unit_begin[u]; i < s->unit_begin[u + 1]; ++i) {
            for (uint32_t side = 3 * s->unit_list[i]; side < 3 * s->unit_list[i] + 3; ++side) {
                if (s->partner[side] != VSHI_NONE && s->unit[s->partner[side] / 3] != u) {
                    if (!count_only) {
                        g->sides[count] = side;
                        g->units[u].perimeter += vshi_side_length(s, side);
                    }
                    ++count;
                }
            }
        }
    }
    g->begin[g->count] = count;
    return count;
}

static vsh_result smooth(vshi_units *g, vsh_error *error) {
    vshi_vec *before = NULL;
    VSHI_TRY(vshi_allocate((void **)&before, g->count, sizeof *before, "units of a surface", error));
    for (int round = 0; round < SMOOTHINGS; ++round) {
        for (uint32_t u = 0; u < g->count; ++u) {
            before[u] = g->units[u].normal;
        }
        for (uint32_t u = 0; u < g->count; ++u) {
            vshi_vec sum = vshi_scale(before[u], g->units[u].area);
            for (uint32_t i = g->begin[u]; i < g->begin[u + 1]; ++i) {
                const uint32_t other = vshi_units_beyond(g, g->sides[i]);
                /* a large unit beside a small one tells no more than its surroundings would */
                const double area =
                    g->units[other].area < g->units[u].area ? g->units[other].area : g->units[u].area;
                sum = vshi_add(sum, vshi_scale(before[other], area));
            }
            const vshi_vec normal = vshi_unit(sum);
            if (vshi_dot(normal, normal) > 0.0) {
                g->units[u].normal = normal;
            }
        }
    }
    free(before);
    return VSH_OK;
}

vsh_result vshi_units_make(const vshi_cut_mesh *surface, vshi_units *g, vsh_error *error) {
    static const char what[] = "units of a surface";
    *g = (vshi_units){.surface = surface, .count = surface->unit_count};
    VSHI_TRY(vshi_allocate((void **)&g->units, g->count, sizeof *g->units, what, error));
    VSHI_TRY(vshi_allocate((void **)&g->begin, (size_t)g->count + 1, sizeof *g->begin, what, error));
    measure(g);
    VSHI_TRY(vshi_allocate((void **)&g->sides, list_sides(g, true), sizeof *g->sides, what, error));
    list_sides(g, false);
    return smooth(g, error);
}

void vshi_units_free(vshi_units *g) {
    free(g->sides);
    free(g->begin);
    free(g->units);
    *g = (vshi_units){0};
}
