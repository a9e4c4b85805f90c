/* Ambient occlusion of the texels of a tile together: rays are shot for all of them until each is known well
 * enough with the help of those around it (see window.h). */
#include "shade/ao_rays.h"
#include "shade/links.h"
#include "shade/window.h"

#include <math.h>

enum { TILE = 8, FIRST = 8 };

typedef struct tile {
    vshi_windows windows;
    vshi_window_texel texels[TILE * TILE];
    vshi_window_sums sums[(TILE + 1) * (TILE + 1)];
} tile;

static size_t place_of(const vshi_ao_point *point) {
    return (point->texel >> 16) % TILE * TILE + point->texel % TILE;
}

/* Whether any texel is to have more rays, up to `most`. */
static bool decide(vshi_ao_piece *piece, tile *t, int32_t most) {
    const vsh_shade_options *options = piece->task->options;
    for (size_t i = 0; i < piece->count; ++i) {
        const vshi_ao_point *point = &piece->points[i];
        if (point->taken > 0) {
            vshi_window_texel *e = &t->texels[place_of(point)];
            e->rays = point->taken;
            e->value = (float)((double)point->free / point->taken);
            e->spread = (float)vshi_ao_spread(options->sampler, point->taken);
        }
    }
    vshi_windows_sum(&t->windows);
    bool more = false;
    for (size_t i = 0; i < piece->count; ++i) {
        vshi_ao_point *point = &piece->points[i];
        if (point->next == 0) { /* to look again at what was known well enough takes the time that it gains */
            continue;
        }
        point->next = 0;
        if (point->taken < most) {
            const size_t at = place_of(point);
            const vshi_window_estimate e = vshi_windows_estimate(&t->windows, (int32_t)(at % TILE),
                                                                 (int32_t)(at / TILE), options->max_error, 0);
            if (e.centred > VSHI_AO_TILE_ENOUGH * options->max_error) {
                point->next = 2 * point->taken < most ? 2 * point->taken : most;
                more = true;
            }
        }
    }
    return more;
}

void vshi_ao_by_tile(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const int32_t most = vshi_ao_most_rays(task->options);
    const int32_t first = FIRST < most ? FIRST : most;
    vshi_ao_piece piece;
    tile t = {.windows = {TILE, TILE, t.texels, t.sums}};
    uint32_t at[TILE * TILE] = {0};
    vshi_ao_piece_open(&piece, task, begin, end, true, first, stats);
    for (size_t i = 0; i < piece.count; ++i) {
        if (piece.points[i].next > 0) {
            at[place_of(&piece.points[i])] = (uint32_t)(begin + i) + 1;
        }
    }
    vshi_links_find(task->points, at, TILE, TILE, t.texels);
    do {
        vshi_ao_piece_shoot(&piece, stats);
    } while (decide(&piece, &t, most));
    for (size_t i = 0; i < piece.count; ++i) {
        const vshi_ao_point *point = &piece.points[i];
        task->rays[begin + i] = point->taken;
        if (point->taken == 0) {
            continue;
        }
        task->ao[begin + i] = (float)((double)point->free / point->taken);
        if (task->bent != NULL) {
            vshi_ao_set_bent(task, begin + i, vshi_ao_piece_bent(&piece, point));
        }
        ++stats->refined;
    }
}
