/* AO that parts left: put together by some rows at a time, each with those that windows take in. */
#include "bake/part.h"
#include "bake_scene/merge.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum { TILE = VSHI_AO_CUT_TILE, STEP = 16 }; /* rows of tiles that are finished together, at most */

/* Rows of tiles begin … end - 1, among those that are read for them. */
typedef struct chunk {
    int32_t spacing, width, height;
    int32_t begin, end;
    int32_t low, high;   /* that are read */
    int32_t first, rows; /* the same, of texels */
    vshi_ao_shot *shots; /* [rows][width] */
    uint8_t *wanted;     /* [high - low] */
    float *ao, *deviation;
} chunk;

/* Whether a row of tiles was left by its part. */
static bool is_left(const vshi_parts *parts, size_t index, int32_t row) {
    for (size_t i = 0; i < parts->place_count; ++i) {
        const vshi_part_place *place = &parts->places[i];
        if (place->lightmap == index && TILE * row >= place->first && TILE * row < place->end) {
            const vshi_part_head *head = &parts->list[place->part].head;
            const vshi_ao_cut cut = vshi_part_cut(head, &head->pieces[place->piece]);
            return vshi_ao_cut_leaves(&cut, row);
        }
    }
    return false;
}

/* The next rows that were left, from `row` on and before `end`; false where there are none. */
static bool find_chunk(const vshi_parts *parts, size_t index, int32_t row, int32_t end, chunk *c) {
    while (row < end && !is_left(parts, index, row)) {
        ++row;
    }
    c->begin = c->end = row;
    for (; row < end && row < c->begin + STEP; ++row) {
        c->end = is_left(parts, index, row) ? row + 1 : c->end;
    }
    return c->begin < c->end;
}

/* Windows reach as many rows of tiles up as the widest lattice's spacing, and from lower corners down; what
 * is put together begins with a square. */
static void set_rows(chunk *c) {
    const int32_t all = (c->height + TILE - 1) / TILE, reach = c->spacing;
    c->low = c->begin > reach ? (c->begin - reach) / reach * reach : 0;
    c->high = all - c->end > reach + 1 ? c->end + reach + 1 : all;
    c->first = TILE * c->low;
    c->rows = (TILE * c->high < c->height ? TILE * c->high : c->height) - c->first;
}

static vsh_result read_chunk(const vshi_parts *parts, size_t index, const chunk *c, vsh_error *error) {
    const int32_t behind = c->first + c->rows;
    memset(c->shots, 0, (size_t)c->rows * (size_t)c->width * sizeof *c->shots);
    for (size_t i = 0; i < parts->place_count; ++i) {
        const vshi_part_place *place = &parts->places[i];
        const int32_t first = place->first > c->first ? place->first : c->first;
        const int32_t end = place->end < behind ? place->end : behind;
        if (place->lightmap == index && first < end) {
            VSHI_TRY(vshi_part_read_shots(&parts->list[place->part], place->piece, first, end - first,
                                          c->shots + (size_t)(first - c->first) * (size_t)c->width, error));
        }
    }
    for (int32_t row = c->low; row < c->high; ++row) {
        c->wanted[row - c->low] = row >= c->begin && row < c->end && is_left(parts, index, row);
    }
    return VSH_OK;
}

/* The values that were left, into the rows that are held. */
static void put_chunk(const chunk *c, const vshi_held_rows *held, float *ao, float *deviation) {
    for (int32_t row = c->first; row < c->first + c->rows; ++row) {
        if (!c->wanted[row / TILE - c->low] || row < held->first || row >= held->end) {
            continue;
        }
        const size_t from = (size_t)(row - c->first) * (size_t)c->width;
        const size_t to = (size_t)(row - held->first) * (size_t)c->width;
        for (size_t i = 0; i < (size_t)c->width; ++i) {
            if (!vshi_ao_shot_is_left(&c->shots[from + i])) {
                continue;
            }
            ao[to + i] = c->ao[from + i];
            if (deviation != NULL) {
                deviation[to + i] = c->deviation[from + i];
            }
        }
    }
}

/* The plane of a channel; NULL: there is none. */
static float *plane_of(const vshi_channels *channels, const vshi_held_rows *held, const char *name) {
    for (int32_t c = 0; c < channels->image.channel_count; ++c) {
        if (strcmp(channels->names[c], name) == 0) {
            return held->planes[c];
        }
    }
    return NULL;
}

/* Names the part whose rows are the first of those that no bake left. */
static vsh_result name_part(const vshi_parts *parts, size_t index, const chunk *c, vsh_result result,
                            vsh_error *error) {
    for (size_t i = 0; result == VSH_ERROR_INPUT && i < parts->place_count; ++i) {
        const vshi_part_place *place = &parts->places[i];
        if (place->lightmap == index && place->end > TILE * c->begin) {
            return vshi_part_damaged(parts->list[place->part].path, "its rays of AO", error);
        }
    }
    return result;
}

static int32_t most_rows(int32_t rows, int32_t spacing) {
    const int32_t tiles = (rows + TILE - 1) / TILE + 1;
    return TILE * ((tiles < STEP ? tiles : STEP) + 3 * spacing + 1);
}

static vsh_result open_chunk(chunk *c, int32_t rows, vsh_error *error) {
    const size_t most = (size_t)most_rows(rows, c->spacing);
    const size_t texels = most * (size_t)c->width;
    VSHI_TRY(vshi_allocate((void **)&c->shots, texels, sizeof *c->shots, "merge", error));
    VSHI_TRY(vshi_allocate((void **)&c->wanted, most / TILE, 1, "merge", error));
    VSHI_TRY(vshi_allocate((void **)&c->ao, texels, sizeof *c->ao, "merge", error));
    return vshi_allocate((void **)&c->deviation, texels, sizeof *c->deviation, "merge", error);
}

vsh_result vshi_parts_finish(const vshi_parts *parts, const vsh_scene *scene, size_t index,
                             const vshi_channels *channels, const vshi_held_rows *held, int32_t first,
                             int32_t end, const vsh_run *run, vsh_bake_stats *stats, vsh_error *error) {
    const vshi_part_lightmap *lightmap = &parts->list[0].head.lightmaps[index];
    float *ao = plane_of(channels, held, "ao"), *deviation = plane_of(channels, held, "error.ao");
    chunk c = {.spacing = lightmap->left, .width = held->width, .height = lightmap->height};
    if (lightmap->left <= 1 || ao == NULL) {
        return VSH_OK;
    }
    vsh_result result;
    VSHI_TRY_DONE(open_chunk(&c, held->end - held->first, error));
    const int32_t behind = (held->end + TILE - 1) / TILE;
    const int32_t counted = first / TILE, uncounted = (end + TILE - 1) / TILE;
    for (int32_t row = held->first / TILE; find_chunk(parts, index, row, behind, &c); row = c.end) {
        set_rows(&c);
        VSHI_TRY_DONE(read_chunk(parts, index, &c, error));
        vshi_ao_left left = {
            .width = c.width, .rows = c.rows, .spacing = c.spacing, .shots = c.shots, .wanted = c.wanted};
        left.first = (size_t)((counted > c.low ? counted < c.high ? counted : c.high : c.low) - c.low);
        left.last = (size_t)((uncounted > c.low ? uncounted < c.high ? uncounted : c.high : c.low) - c.low);
        result = vshi_ao_finish(&left, &scene->shade, run, c.ao, c.deviation, &stats->shade,
                                &stats->errors[scene->light_count], error);
        if (result != VSH_OK) {
            result = name_part(parts, index, &c, result, error);
            goto done;
        }
        put_chunk(&c, held, ao, deviation);
    }
done:
    free(c.deviation);
    free(c.ao);
    free(c.wanted);
    free(c.shots);
    return result;
}

double vshi_parts_finish_bytes(int32_t width, int32_t rows, int32_t spacing, int32_t threads) {
    return spacing > 1 ? vshi_ao_finish_bytes(width, most_rows(rows, spacing), threads) : 0.0;
}
