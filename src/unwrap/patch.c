#include "unwrap/patch.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

static const char what[] = "a chart";

/* Where `triangle` stands in the patch, or VSHI_NONE. */
static uint32_t find(const vshi_patch *p, uint32_t triangle) {
    uint32_t begin = 0, end = p->count;
    while (begin < end) {
        const uint32_t middle = begin + (end - begin) / 2;
        if (p->triangles[middle] < triangle) {
            begin = middle + 1;
        } else {
            end = middle;
        }
    }
    return begin < p->count && p->triangles[begin] == triangle ? begin : VSHI_NONE;
}

static void find_beyond(vshi_patch *p) {
    for (uint32_t i = 0; i < p->count; ++i) {
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t side = p->surface->partner[3 * p->triangles[i] + k];
            const uint32_t other = side != VSHI_NONE ? find(p, side / 3) : VSHI_NONE;
            p->beyond[3 * i + k] = other != VSHI_NONE ? 3 * other + side % 3 : VSHI_NONE;
        }
    }
}

static uint32_t root(uint32_t *up, uint32_t corner) {
    while (up[corner] != corner) {
        up[corner] = up[up[corner]];
        corner = up[corner];
    }
    return corner;
}

static void unite(uint32_t *up, uint32_t a, uint32_t b) {
    a = root(up, a);
    b = root(up, b);
    up[a < b ? b : a] = a < b ? a : b;
}

static vsh_result number_vertices(vshi_patch *p, vsh_error *error) {
    uint32_t *up = NULL, *number = NULL;
    const uint32_t corners = 3 * p->count;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&up, corners, sizeof *up, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&number, corners, sizeof *number, what, error));
    for (uint32_t c = 0; c < corners; ++c) {
        up[c] = c;
    }
    for (uint32_t side = 0; side < corners; ++side) {
        const uint32_t other = p->beyond[side];
        if (other != VSHI_NONE && other > side) {
            unite(up, side, vshi_next_side(other));
            unite(up, vshi_next_side(side), other);
        }
    }
    for (uint32_t c = 0; c < corners; ++c) { /* roots are the lowest of theirs */
        const uint32_t r = root(up, c);
        if (r == c) {
            number[c] = p->vertex_count++;
        }
        p->corner[c / 3][c % 3] = number[r];
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&p->place, p->vertex_count, sizeof *p->place, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&p->uv, p->vertex_count, sizeof *p->uv, what, error));
    for (uint32_t i = 0; i < p->count; ++i) {
        vshi_vec at[3];
        vshi_cut_mesh_corners(p->surface, p->triangles[i], at);
        for (int k = 0; k < 3; ++k) {
            p->place[p->corner[i][k]] = at[k];
        }
        p->area += p->surface->area[p->triangles[i]];
    }
done:
    free(number);
    free(up);
    return result;
}

vsh_result vshi_patch_make(const vshi_cut_mesh *surface, uint32_t *triangles, uint32_t count, vshi_patch *p,
                           vsh_error *error) {
    *p = (vshi_patch){.surface = surface, .triangles = triangles, .count = count, .stretch = 1.0};
    VSHI_TRY(vshi_allocate((void **)&p->corner, count, sizeof *p->corner, what, error));
    VSHI_TRY(vshi_allocate((void **)&p->beyond, count, 3 * sizeof *p->beyond, what, error));
    find_beyond(p);
    return number_vertices(p, error);
}

void vshi_patch_free(vshi_patch *p) {
    free(p->uv);
    free(p->place);
    free(p->beyond);
    free(p->corner);
    free(p->triangles);
    *p = (vshi_patch){0};
}
