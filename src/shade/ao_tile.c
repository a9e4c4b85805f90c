/* Ambient occlusion of texels together: rays are shot for all texels of a lattice, tile by tile, until each
 * is known well enough with the help of those around it (see window.h). Where what they see bends little from
 * one to the next, the texels between shoot none; else the lattice is halved there. */
#include "shade/ao_rays.h"
#include "shade/links.h"
#include "shade/window.h"

#include <math.h>
#include <string.h>

/* Rays of a texel at first, and of one that is only looked at. */
enum { TILE = 8, FIRST = 8, BEYOND = 16 };

/* Rays of each texel of a tile in which the first ones do not all tell the same: a power of two, of these
 * over max_error at least. What few rays of a texel say of how many more it is to have is chance, and they
 * leave much where they happen to say that it has enough: with no more than the first ones, the cloister at
 * 0.01 had an RMSE of 0.0061 in the time that gives 0.0053. Lattices wider than CLOSE keep to the first rays:
 * what they are off by is what bends between their texels rather than noise, and what is said of their error
 * counts on the noise (test_ao_texels: fine texels). */
static const double SEEN_OVER = 0.4;
static const int32_t MOST_SEEN = 128, CLOSE = 2;

/* Steps between texels of a lattice, of the task's scale, at most: what a plane is off from what bends grows
 * with their square, so that they go with the square root of the error asked for, 0.05 of the scale for 0.02.
 * Where there are none along x or y, what is beside them is not known. */
static const double WIDEST = 0.35, WIDEST_ALONE = 0.2;
/* No lattice for errors below this: noise is then so small that what bends is most of the error, which
 * windows over fewer texels tell less of (test_claims: a disc that fills 32² texels). Nor for random rays, in
 * whose noise it hides. */
static const double FINE = 0.005;
/* Texels of a lattice that a window spans at least, both ways, where what lies between may follow its plane.
 */
static const int32_t SPAN = 3;
/* Where it spans fewer, the second difference of its texel's value and of those beside it, of max_error: what
 * lies between is then off the straight line by an eighth of it at most. */
static const double BEND = 4.0;
/* Beside standard deviations of its noise: a texel that is refined by chance is a speck in the picture. */
static const double SIGMAS = 2.0;

/* A tile of a lattice. */
typedef struct tile {
    vshi_texel_lattice lattice;
    vshi_windows windows;
    vshi_window_texel texels[TILE * TILE];
    vshi_window_sums sums[(TILE + 1) * (TILE + 1)];
    size_t at[TILE * TILE]; /* points + 1 */
    size_t wanted[TILE * TILE];
    size_t count;
    uint8_t place[TILE * TILE]; /* of the wanted */
} tile;

/* Whether any texel is to have more rays, up to `most`. */
static bool decide(vshi_ao_piece *piece, tile *t, int32_t most) {
    const vsh_shade_options *options = piece->task->options;
    for (size_t i = 0; i < piece->count; ++i) {
        const vshi_ao_point *point = &piece->points[i];
        if (point->taken > 0) {
            vshi_window_texel *e = &t->texels[t->place[i]];
            e->rays = point->taken;
            e->value = (float)((double)point->free / point->taken);
            e->spread = (float)vshi_ao_shared_spread(options->sampler, point->taken);
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
            const int32_t at = t->place[i];
            const vshi_window_estimate e =
                vshi_windows_estimate(&t->windows, at % TILE, at / TILE, options->max_error, 0);
            if (e.centred > VSHI_AO_TILE_ENOUGH * options->max_error) {
                point->next = 2 * point->taken < most ? 2 * point->taken : most;
                more = true;
            }
        }
    }
    return more;
}

/* Whether a lattice is fine enough at one of its texels, by the steps to those around it. */
static bool is_fine(const vshi_ao_task *task, const tile *t, int32_t at) {
    const vshi_window_texel *e = &t->texels[at];
    const float steps[2][2] = {{e->step[0], at % TILE + 1 < TILE ? e[1].step[0] : INFINITY},
                               {e->step[1], at / TILE + 1 < TILE ? e[TILE].step[1] : INFINITY}};
    float longest = 0.0f;
    int lone = 0;
    for (int axis = 0; axis < 2; ++axis) {
        bool alone = true;
        for (int k = 0; k < 2; ++k) {
            if (steps[axis][k] < INFINITY) {
                longest = steps[axis][k] > longest ? steps[axis][k] : longest;
                alone = false;
            }
        }
        lone += alone;
    }
    const double most = (lone > 0 ? WIDEST_ALONE : WIDEST) * sqrt(task->options->max_error) * task->scale;
    return lone < 2 && (double)longest <= most;
}

/* Texels of a tile along Morton's curve (1966), so that those that follow each other, whose rays make
 * packets, lie near each other both ways. */
static int32_t in_curve(int32_t n) {
    const int32_t x = (n & 1) | (n >> 1 & 2) | (n >> 2 & 4), y = (n >> 1 & 1) | (n >> 2 & 2) | (n >> 3 & 4);
    return y * TILE + x;
}

/* Lays a tile out, and lists the texels that are to shoot. */
static void open_tile(const vshi_ao_task *task, const vshi_texel_lattice *lattice, tile *t) {
    const vshi_ao_share *share = task->share;
    t->lattice = *lattice;
    t->windows = (vshi_windows){TILE, TILE, t->texels, t->sums};
    t->count = 0;
    bool any = false;
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        t->at[k] = vshi_texel_at(&share->map, lattice->left + k % TILE * lattice->spacing,
                                 lattice->top + k / TILE * lattice->spacing);
        any = any || (t->at[k] > 0 && share->level[t->at[k] - 1] == VSHI_AO_OPEN_LEVEL);
    }
    if (!any) {
        return;
    }
    memset(t->texels, 0, sizeof t->texels);
    vshi_links_find(&share->map, lattice, t->texels);
    uint8_t shoots[TILE * TILE] = {0};
    for (int32_t n = 0; n < TILE * TILE; ++n) {
        const int32_t k = in_curve(n);
        const size_t i = t->at[k] - 1;
        if (t->at[k] == 0) {
            continue;
        }
        if (share->level[i] == VSHI_AO_OPEN_LEVEL && (lattice->spacing == 1 || is_fine(task, t, k))) {
            t->place[t->count] = (uint8_t)k;
            t->wanted[t->count++] = i;
            shoots[k] = 1;
        } else if (share->rays[i] > 0) {
            t->texels[k].rays = share->rays[i];
            t->texels[k].value = task->ao[i];
            t->texels[k].spread = (float)vshi_ao_shared_spread(task->options->sampler, share->rays[i]);
            shoots[k] = 1;
        }
    }
    for (int32_t k = 0; k < TILE * TILE; ++k) { /* what shoots nothing parts those beside it */
        t->texels[k].left = t->texels[k].left && shoots[k] && shoots[k - 1];
        t->texels[k].above = t->texels[k].above && shoots[k] && shoots[k - TILE];
    }
}

/* Texels of a lattice, with their first rays to shoot: of sequences that those of a lattice have. */
static void open_piece(const vshi_ao_task *task, int32_t spacing, const size_t *points, size_t count,
                       int32_t first, vshi_ao_piece *piece, vsh_shade_stats *stats) {
    const int32_t most = vshi_ao_most_rays(task->options);
    vshi_ao_piece_open(piece, task, points, count, true, first < most ? first : most, stats);
    for (size_t i = 0; i < piece->count; ++i) {
        const uint32_t texel = piece->points[i].texel;
        piece->points[i].texel =
            vsh_texel(vsh_texel_column(texel) / (uint32_t)spacing, vsh_texel_row(texel) / (uint32_t)spacing);
    }
}

/* Has all texels shoot more than the first rays, but where these are all free or all hidden. */
static void look_closer(const vshi_ao_task *task, int32_t most, vshi_ao_piece *piece,
                        vsh_shade_stats *stats) {
    const double wanted = SEEN_OVER / task->options->max_error;
    int32_t free = 0, taken = 0, rays = FIRST;
    for (size_t i = 0; i < piece->count; ++i) {
        free += piece->points[i].free;
        taken += piece->points[i].taken;
    }
    if (free == 0 || free == taken) {
        return;
    }
    while (rays < MOST_SEEN && rays < wanted) {
        rays *= 2;
    }
    rays = rays < most ? rays : most;
    for (size_t i = 0; i < piece->count; ++i) {
        vshi_ao_point *point = &piece->points[i];
        point->next = point->taken > 0 && point->taken < rays ? rays : point->next;
    }
    vshi_ao_piece_shoot(piece, stats);
}

static void shoot_tile(const vshi_ao_task *task, tile *t, vsh_shade_stats *stats) {
    const vshi_ao_share *share = task->share;
    const int32_t most = vshi_ao_most_rays(task->options);
    const int32_t spacing = t->lattice.spacing;
    vshi_ao_piece piece;
    open_piece(task, spacing, t->wanted, t->count, FIRST, &piece, stats);
    vshi_ao_piece_shoot(&piece, stats);
    if (spacing <= CLOSE) {
        look_closer(task, most, &piece, stats);
    }
    while (decide(&piece, t, most)) {
        vshi_ao_piece_shoot(&piece, stats);
    }
    for (size_t i = 0; i < piece.count; ++i) {
        const vshi_ao_point *point = &piece.points[i];
        share->rays[point->index] = point->taken;
        share->level[point->index] = point->taken > 0 ? (uint8_t)spacing : VSHI_AO_KNOWN_LEVEL;
        if (point->taken == 0) {
            continue;
        }
        task->ao[point->index] = (float)((double)point->free / point->taken);
        if (task->bent != NULL) {
            vshi_ao_set_bent(task, point->index, vshi_ao_piece_bent(&piece, point));
        }
    }
}

/* Whether a lattice's values are as good as straight around one of its texels, along x (1) or y (TILE), by
 * those of the tile that hang together with it. */
static bool is_straight(const tile *t, const vshi_window_estimate *e, int32_t at, int32_t along,
                        double most) {
    const int32_t place = along == 1 ? at % TILE : at / TILE;
    int32_t run[2] = {0, 0}; /* before and after it, two at most */
    for (int32_t k = at; run[0] < 2 && run[0] < place; k -= along, ++run[0]) {
        if (!(along == 1 ? t->texels[k].left : t->texels[k].above)) {
            break;
        }
    }
    for (int32_t k = at + along; run[1] < 2 && place + run[1] + 1 < TILE; k += along, ++run[1]) {
        if (!(along == 1 ? t->texels[k].left : t->texels[k].above)) {
            break;
        }
    }
    if (run[0] + run[1] < 2) {
        const int32_t next = run[0] > 0 ? at - along : run[1] > 0 ? at + along : at;
        return fabs(e[next].value - e[at].value) <= 0.25 * most;
    }
    const vshi_window_estimate *middle = e + at + (run[0] == 0 ? along : run[1] == 0 ? -along : 0);
    const double before = middle[-along].deviation, own = 2.0 * middle->deviation,
                 after = middle[along].deviation;
    const double off = middle[-along].value - 2.0 * middle->value + middle[along].value;
    return fabs(off) <= most + SIGMAS * sqrt(before * before + own * own + after * after);
}

/* Texels at the end of a square whose next texel, in another square, is far from what they say of it by its
 * first rays: are of the finer lattice, too. */
static void look_beyond(const vshi_ao_task *task, const int32_t square[2], const tile *t,
                        const vshi_window_estimate *e, vsh_shade_stats *stats) {
    const vshi_ao_share *share = task->share;
    const int32_t spacing = t->lattice.spacing, side = vshi_ao_square(share);
    const double most = BEND * task->options->max_error;
    size_t next[2 * TILE], count = 0;
    int32_t place[2 * TILE], along[2 * TILE];
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        const int32_t at[2] = {t->lattice.left + k % TILE * spacing, t->lattice.top + k / TILE * spacing};
        if (!(t->texels[k].rays > 0) || share->level[t->at[k] - 1] != spacing) {
            continue;
        }
        for (int32_t axis = 0; axis < 2; ++axis) {
            int32_t to[2] = {at[0], at[1]};
            to[axis] += spacing;
            const size_t beyond =
                to[axis] == square[axis] + side ? vshi_texel_at(&share->map, to[0], to[1]) : 0;
            if (beyond > 0 && vshi_links_lead(&share->map, at, to)) {
                place[count] = k;
                along[count] = axis;
                next[count++] = beyond - 1;
            }
        }
    }
    if (count == 0) {
        return;
    }
    vshi_ao_piece piece;
    open_piece(task, spacing, next, count, BEYOND, &piece, stats);
    vshi_ao_piece_shoot(&piece, stats);
    for (size_t i = 0; i < count; ++i) {
        const vshi_ao_point *point = &piece.points[i];
        const vshi_window_estimate *own = &e[place[i]];
        const double said = fmin(fmax(own->value + own->slope[along[i]], 0.0), 1.0);
        const double p = (said * point->taken + 1.0) / (point->taken + 2.0);
        const double noise = vshi_ao_shared_spread(task->options->sampler, point->taken) * p * (1.0 - p);
        const double off = (double)point->free / point->taken - said;
        if (point->taken > 0 && fabs(off) > most + SIGMAS * sqrt(noise)) {
            share->level[t->at[place[i]] - 1] = (uint8_t)(spacing / 2);
        }
    }
}

/* Texels whose windows tell nothing of what lies between them and the next are of the finer lattice. */
static void grade(const vshi_ao_task *task, const int32_t square[2], const tile *t, vsh_shade_stats *stats) {
    const vshi_ao_share *share = task->share;
    const int32_t spacing = t->lattice.spacing;
    const double max_error = task->options->max_error, most = BEND * max_error;
    vshi_window_estimate e[TILE * TILE];
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        if (t->texels[k].rays > 0) {
            e[k] = vshi_windows_estimate(&t->windows, k % TILE, k / TILE, max_error, 0);
        }
    }
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        if (t->texels[k].rays > 0 && share->level[t->at[k] - 1] == spacing &&
            ((e[k].x[1] - e[k].x[0] + 1 < SPAN && !is_straight(t, e, k, 1, most)) ||
             (e[k].y[1] - e[k].y[0] + 1 < SPAN && !is_straight(t, e, k, TILE, most)))) {
            share->level[t->at[k] - 1] = (uint8_t)(spacing / 2);
        }
    }
    look_beyond(task, square, t, e, stats);
}

uint32_t vshi_ao_corners(const vshi_texel_map *map, const int32_t cell[2], int32_t spacing, bool whole,
                         int32_t column, int32_t row) {
    uint32_t corners = 0;
    for (int32_t k = 0; k < 4; ++k) {
        const int32_t corner[2] = {cell[0] + (k & 1) * spacing, cell[1] + (k >> 1) * spacing};
        if (whole || (vshi_texel_at(map, corner[0], corner[1]) > 0 &&
                      vshi_links_lead(map, (const int32_t[]){column, row}, corner))) {
            corners |= 1u << k;
        }
    }
    return corners;
}

/* Whether a texel beside one is none: where charts end, another surface may begin, and hide the sky of those
 * that touch it. */
static bool is_edge(const vshi_texel_map *map, int32_t column, int32_t row) {
    return vshi_texel_at(map, column - 1, row) == 0 || vshi_texel_at(map, column + 1, row) == 0 ||
           vshi_texel_at(map, column, row - 1) == 0 || vshi_texel_at(map, column, row + 1) == 0;
}

/* Gives texels of a cell without rays to its lattice, where the corners that they hang together with are all
 * of it. Corners in other squares are not looked at. */
static void cover(const vshi_ao_task *task, const int32_t square[2], const int32_t cell[2], int32_t spacing) {
    const vshi_ao_share *share = task->share;
    const int32_t side = vshi_ao_square(share);
    uint32_t looked_at = 0, good = 0;
    for (int32_t k = 0; k < 4; ++k) {
        const int32_t x = cell[0] + (k & 1) * spacing, y = cell[1] + (k >> 1) * spacing;
        const size_t at = x < square[0] + side && y < square[1] + side ? vshi_texel_at(&share->map, x, y) : 0;
        looked_at |= (uint32_t)(at > 0) << k;
        good |= (uint32_t)(at > 0 && share->rays[at - 1] > 0 && share->level[at - 1] >= spacing) << k;
    }
    if (good == 0) {
        return;
    }
    const bool whole = vshi_links_whole(&share->map, cell[0], cell[1], spacing);
    for (int32_t k = 0; k < spacing * spacing; ++k) {
        const int32_t column = cell[0] + k % spacing, row = cell[1] + k / spacing;
        const size_t at = vshi_texel_at(&share->map, column, row);
        if (at == 0 || share->level[at - 1] != VSHI_AO_OPEN_LEVEL || is_edge(&share->map, column, row)) {
            continue;
        }
        const uint32_t corners = looked_at & vshi_ao_corners(&share->map, cell, spacing, whole, column, row);
        if (corners != 0 && (corners & ~good) == 0) {
            share->level[at - 1] = (uint8_t)spacing;
        }
    }
}

static void shade_square(const vshi_ao_task *task, const int32_t square[2], vsh_shade_stats *stats) {
    const int32_t side = vshi_ao_square(task->share);
    tile t;
    const bool fine = task->options->max_error < FINE || task->options->sampler == VSH_SAMPLER_WHITE;
    for (int32_t spacing = fine ? 1 : task->share->spacing; spacing > 0; spacing /= 2) {
        const int32_t step = TILE * spacing;
        for (int32_t k = 0; k < side / step * (side / step); ++k) {
            const vshi_texel_lattice lattice = {square[0] + k % (side / step) * step,
                                                square[1] + k / (side / step) * step, spacing, TILE, TILE};
            open_tile(task, &lattice, &t);
            if (t.count > 0) {
                shoot_tile(task, &t, stats);
                if (spacing > 1) {
                    grade(task, square, &t, stats);
                }
            }
        }
        for (int32_t k = 0; spacing > 1 && k < side / spacing * (side / spacing); ++k) {
            const int32_t cell[2] = {square[0] + k % (side / spacing) * spacing,
                                     square[1] + k / (side / spacing) * spacing};
            cover(task, square, cell, spacing);
        }
    }
}

void vshi_ao_by_squares(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const vshi_ao_share *share = task->share;
    const int32_t side = vshi_ao_square(share), across = share->side / side;
    for (size_t n = begin; n < end; ++n) {
        const int32_t square[2] = {share->left + (int32_t)n % across * side,
                                   share->top + (int32_t)n / across * side};
        shade_square(task, square, stats);
    }
}
