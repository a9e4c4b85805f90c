/* AO that parts left, and what is made of it: put together by some rows at a time, each with those that
 * windows take in. */
#include "bake/field_error.h"
#include "bake/part.h"
#include "bake/planes.h"
#include "bake_scene/merge.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum { TILE = VSHI_AO_CUT_TILE, STEP = 16 }; /* rows of tiles that are finished together, at most */

/* Rows of tiles begin … end - 1, among those that are read for them. */
typedef struct chunk {
    int32_t spacing, width, height;
    uint32_t kinds;    /* of what is kept */
    int32_t held_rays; /* vshi_field_error_rays() */
    int32_t begin, end;
    int32_t low, high;   /* that are read */
    int32_t first, rows; /* the same, of texels */
    unsigned char *kept; /* [rows]: vshi_ao_kept_row() */
    uint8_t *wanted;     /* [high - low] */
    vsh_lightmap planes; /* [rows][width]: what is finished */
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

static size_t row_bytes(const chunk *c) {
    return (size_t)c->width * vshi_ao_kept_bytes(c->kinds);
}

static vsh_result read_chunk(const vshi_parts *parts, size_t index, const chunk *c, vsh_error *error) {
    const int32_t behind = c->first + c->rows;
    memset(c->kept, 0, (size_t)c->rows * row_bytes(c));
    for (size_t i = 0; i < parts->place_count; ++i) {
        const vshi_part_place *place = &parts->places[i];
        const int32_t first = place->first > c->first ? place->first : c->first;
        const int32_t end = place->end < behind ? place->end : behind;
        if (place->lightmap == index && first < end) {
            VSHI_TRY(vshi_part_read_kept(&parts->list[place->part], place->piece, first, end - first,
                                         c->held_rays, c->kept + (size_t)(first - c->first) * row_bytes(c),
                                         error));
        }
    }
    for (int32_t row = c->low; row < c->high; ++row) {
        c->wanted[row - c->low] = row >= c->begin && row < c->end && is_left(parts, index, row);
    }
    return VSH_OK;
}

/* --- into the rows that are held */

/* The plane of a channel; NULL: there is none. */
static float *plane_of(const vshi_channels *channels, const vshi_held_rows *held, const char *name) {
    for (int32_t c = 0; c < channels->image.channel_count; ++c) {
        if (strcmp(channels->names[c], name) == 0) {
            return held->planes[c];
        }
    }
    return NULL;
}

/* Channels that are taken from planes as they are finished. */
static const struct {
    const char *name;
    size_t plane; /* offset in vsh_lightmap */
    size_t step, axis;
    bool sky; /* left where the sky is; else where AO is */
} FINISHED[] = {
    {"ao", offsetof(vsh_lightmap, ao), 1, 0, false},
    {"error.ao", offsetof(vsh_lightmap, ao_error), 1, 0, false},
    {"bent.X", offsetof(vsh_lightmap, bent), 3, 0, false},
    {"bent.Y", offsetof(vsh_lightmap, bent), 3, 1, false},
    {"bent.Z", offsetof(vsh_lightmap, bent), 3, 2, false},
    {"sky", offsetof(vsh_lightmap, sky), 1, 0, true},
};

static const char *const IRRADIANCE[] = {"irradiance.R", "irradiance.G", "irradiance.B"};

/* Where the values of a row go, channel by channel, and where they come from. */
typedef struct row_to_put {
    const chunk *chunk;
    vshi_ao_kept kept;
    size_t from, to; /* its first texel, in the chunk and in the rows that are held */
} row_to_put;

static bool is_left_of(const row_to_put *r, bool sky, size_t column) {
    const vshi_ao_shot *shots = sky ? r->kept.sky : r->kept.ao;
    return shots != NULL && vshi_ao_is_left(&shots[column]);
}

static void put_finished(const row_to_put *r, size_t k, float *to) {
    const float *from = *(float *const *)((const char *)&r->chunk->planes + FINISHED[k].plane);
    for (size_t i = 0; to != NULL && i < (size_t)r->chunk->width; ++i) {
        if (is_left_of(r, FINISHED[k].sky, i)) {
            to[r->to + i] = from[(r->from + i) * FINISHED[k].step + FINISHED[k].axis];
        }
    }
}

/* The irradiance of lights is there, and what AO lets through is not in it. */
static void put_irradiance(const row_to_put *r, const double *ambient, size_t channel, const float *coverage,
                           float *to) {
    for (size_t i = 0; to != NULL && i < (size_t)r->chunk->width; ++i) {
        const bool valid = coverage[r->to + i] == 1.0f;
        if (is_left_of(r, false, i) && (valid || ambient == NULL)) {
            float *value = &to[r->to + i];
            *value = vshi_irradiance_open(*value, ambient, channel, r->chunk->planes.ao[r->from + i]);
        }
    }
}

/* The values that were left. */
static void put_chunk(const chunk *c, const vsh_scene *scene, const vshi_channels *channels,
                      const vshi_held_rows *held) {
    const float *coverage = held->planes[channels->image.channel_count - 1];
    for (int32_t row = c->first; row < c->first + c->rows; ++row) {
        if (!c->wanted[row / TILE - c->low] || row < held->first || row >= held->end) {
            continue;
        }
        const size_t at = (size_t)(row - c->first), width = (size_t)c->width;
        const row_to_put r = {c, vshi_ao_kept_row(c->kinds, width, c->kept, at), at * width,
                              (size_t)(row - held->first) * width};
        for (size_t k = 0; k < sizeof FINISHED / sizeof FINISHED[0]; ++k) {
            put_finished(&r, k, plane_of(channels, held, FINISHED[k].name));
        }
        for (size_t k = 0; scene->ao && k < 3; ++k) {
            put_irradiance(&r, scene->has_ambient ? scene->ambient : NULL, k, coverage,
                           plane_of(channels, held, IRRADIANCE[k]));
        }
    }
}

static int32_t most_rows(int32_t rows, int32_t spacing) {
    const int32_t tiles = (rows + TILE - 1) / TILE + 1;
    return TILE * ((tiles < STEP ? tiles : STEP) + 3 * spacing + 1);
}

static bool has(const chunk *c, uint32_t kind) {
    return (c->kinds & kind) != 0;
}

static vsh_result open_chunk(chunk *c, int32_t rows, vsh_error *error) {
    const size_t most = (size_t)most_rows(rows, c->spacing), texels = most * (size_t)c->width;
    const size_t ao = has(c, VSHI_KEEPS_AO) ? texels : 0, sky = has(c, VSHI_KEEPS_SKY) ? texels : 0;
    const size_t bent = has(c, VSHI_KEEPS_OPEN) ? texels : 0;
    vsh_lightmap *planes = &c->planes;
    VSHI_TRY(vshi_allocate((void **)&c->kept, most, row_bytes(c), "merge", error));
    VSHI_TRY(vshi_allocate((void **)&c->wanted, most / TILE, 1, "merge", error));
    VSHI_TRY(vshi_allocate((void **)&planes->ao, ao, sizeof *planes->ao, "merge", error));
    VSHI_TRY(vshi_allocate((void **)&planes->ao_error, ao, sizeof *planes->ao_error, "merge", error));
    VSHI_TRY(vshi_allocate((void **)&planes->sky, sky, sizeof *planes->sky, "merge", error));
    return vshi_allocate((void **)&planes->bent, bent, 3 * sizeof *planes->bent, "merge", error);
}

static void close_chunk(chunk *c) {
    free(c->planes.bent);
    free(c->planes.sky);
    free(c->planes.ao_error);
    free(c->planes.ao);
    free(c->wanted);
    free(c->kept);
}

vsh_result vshi_parts_finish(const vshi_parts *parts, const vsh_scene *scene, size_t index,
                             const vshi_channels *channels, const vshi_held_rows *held, int32_t first,
                             int32_t end, const vsh_run *run, vsh_bake_stats *stats, vsh_error *error) {
    const vshi_part_head *head = &parts->list[0].head;
    const vshi_part_lightmap *lightmap = &head->lightmaps[index];
    chunk c = {.spacing = lightmap->left,
               .width = held->width,
               .height = lightmap->height,
               .kinds = (uint32_t)head->kinds,
               .held_rays = vshi_field_error_rays(scene->shade.max_error),
               .planes = {.asked = scene->planes}};
    if (lightmap->left <= 1) {
        return VSH_OK;
    }
    vsh_result result;
    VSHI_TRY_DONE(open_chunk(&c, held->end - held->first, error));
    const int32_t behind = (held->end + TILE - 1) / TILE;
    const int32_t counted = first / TILE, uncounted = (end + TILE - 1) / TILE;
    for (int32_t row = held->first / TILE; find_chunk(parts, index, row, behind, &c); row = c.end) {
        set_rows(&c);
        VSHI_TRY_DONE(read_chunk(parts, index, &c, error));
        vshi_ao_left left = {.width = c.width,
                             .rows = c.rows,
                             .spacing = c.spacing,
                             .kinds = c.kinds,
                             .kept = c.kept,
                             .wanted = c.wanted};
        left.first = (size_t)((counted > c.low ? counted < c.high ? counted : c.high : c.low) - c.low);
        left.last = (size_t)((uncounted > c.low ? uncounted < c.high ? uncounted : c.high : c.low) - c.low);
        VSHI_TRY_DONE(vshi_ao_finish(&left, &scene->shade, run, &c.planes, &stats->shade,
                                     &stats->errors[scene->light_count], error));
        put_chunk(&c, scene, channels, held);
    }
done:
    close_chunk(&c);
    return result;
}

double vshi_parts_finish_bytes(int32_t width, int32_t rows, int32_t spacing, int32_t threads,
                               uint32_t kinds) {
    return spacing > 1 && kinds != 0 ? vshi_ao_finish_bytes(width, most_rows(rows, spacing), threads, kinds)
                                     : 0.0;
}
