/* Charts that are hidden as a whole, like the bottom of a box that stands on another. None of their texels
 * has a value, and no one sees them. But lines of their borders show through where surfaces meet, and coarse
 * mip levels contain them. So each texel takes the value of the texel that is nearest in the world, among the
 * edges of visible surfaces. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "lightmap/padding.h"
#include "lightmap/page.h"
#include "lightmap/places.h"
#include "lightmap/planes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char what[] = "hidden charts";

/* A texel keeps a value of its chart from this near, squared texels: lookups at visible texels read it. */
enum { OWN_SQUARE = 8 };

/* Other texels keep the value of their chart unless a place in the world is closer, by this factor. */
static const float NEARER = 0.5F;

/* The most padding around a hidden chart, texels. */
enum { MOST_PADDING = 4 };

static const uint32_t NONE = UINT32_MAX;

/* More states: a texel that is filled here; an empty texel that was tested. */
enum { HIDDEN = VSHI_TEXEL_KINDS, TESTED };

typedef struct hiding {
    const vsh_charts *charts;
    const vsh_lightmap *lightmap;
    size_t light_count;
    size_t width, height;
    vshi_store *store;
    uint8_t *state; /* [texels] */
    uint32_t *mesh; /* [texels]: of the first sample, + 1; 0: none. Later the texel's place in `at`, + 1 */
    float *at;      /* [place_count][3]: places of hidden texels, and of texels that give values */
    size_t place_count;
    vshi_places seen;
    uint32_t *hidden,
        *source; /* [hidden_count]: texels, and their sources, first in the chart, later in the world; NONE */
    size_t hidden_count;
    uint64_t filled;
} hiding;

/* --- which texels */

/* Reads a tile's states after the bake, and each texel's mesh. */
static vsh_result read_tile(void *user, size_t number, vsh_error *error) {
    const hiding *h = user;
    const vshi_charts *sorted = &h->charts->sorted;
    vshi_tile tile;
    const vsh_result result = vshi_tile_open(sorted, number, &tile, error);
    for (int32_t k = 0; result == VSH_OK && k < VSHI_TILE_CELLS * VSHI_TILE_CELLS; ++k) {
        if (!vshi_tile_rasterize(sorted, &tile, k % VSHI_TILE_CELLS, k / VSHI_TILE_CELLS, NULL)) {
            continue;
        }
        for (size_t bit = 0; bit < VSHI_CELL * VSHI_CELL; ++bit) {
            const uint32_t owner = vshi_tile_owner(sorted, &tile, bit);
            const size_t x = tile.cell.column * VSHI_CELL + bit % VSHI_CELL,
                         y = tile.cell.row * VSHI_CELL + bit / VSHI_CELL, at = y * h->width + x;
            if (owner != 0) {
                const size_t place = vshi_plane_place(h->lightmap, h->width, at);
                h->state[at] = h->lightmap->coverage[place] != 0.0F ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
                h->mesh[at] = tile.triangle[owner - 1].mesh + 1;
            }
        }
    }
    vshi_tile_close(&tile);
    return result;
}

/* Notes the places of texels that need one, by their first samples. */
static void note_places(void *user, const vshi_samples *samples) {
    const hiding *h = user;
    for (size_t i = samples->count; i-- > 0;) {
        const uint32_t place = h->mesh[vsh_texel_place(samples->texel[i], (int32_t)h->width)];
        for (size_t k = 0; place > 0 && k < 3; ++k) {
            h->at[3 * (size_t)(place - 1) + k] = (float)(samples->position[3 * i + k] - h->charts->centre[k]);
        }
    }
}

static vsh_result place_tile(void *user, size_t number, vsh_error *error) {
    hiding *h = user;
    return vshi_tile_visit(h->charts, number, false, note_places, h, error);
}

static bool is_far(const hiding *h, uint32_t a, uint32_t b) {
    const int64_t x = (int64_t)(a % h->width) - (int64_t)(b % h->width);
    const int64_t y = (int64_t)(a / h->width) - (int64_t)(b / h->width);
    return x * x + y * y > OWN_SQUARE;
}

/* Lists texels that are not valid, except those filled from near texels. */
static vsh_result find_hidden(hiding *h, vsh_error *error) {
    const size_t count = h->width * h->height;
    vshi_spread spread;
    vsh_result result;
    VSHI_TRY(vshi_spread_find(h->store, h->width, h->height, h->mesh, h->state, &spread, error));
    for (size_t i = 0; i < spread.count; ++i) {
        h->state[spread.texel[i]] = VSHI_TEXEL_FILLED;
        h->hidden_count += is_far(h, spread.texel[i], spread.source[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        h->hidden_count += h->state[i] == VSHI_TEXEL_INVALID;
    }
    const vshi_array arrays[] = {VSHI_ARRAY(h->hidden, h->hidden_count),
                                 VSHI_ARRAY(h->source, h->hidden_count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    size_t k = 0;
    for (size_t i = 0; i < spread.count; ++i) {
        if (is_far(h, spread.texel[i], spread.source[i])) {
            h->hidden[k] = spread.texel[i];
            h->source[k++] = spread.source[i];
        }
    }
    for (size_t i = 0; i < count; ++i) {
        if (h->state[i] == VSHI_TEXEL_INVALID) {
            h->hidden[k] = (uint32_t)i;
            h->source[k++] = NONE;
        }
    }
done:
    vshi_spread_free(h->store, &spread);
    return result;
}

static const float *place_of(const hiding *h, size_t texel) {
    return h->at + 3 * (size_t)(h->mesh[texel] - 1);
}

/* Whether a valid texel lies at an edge of the visible surface. */
static bool is_edge(const hiding *h, size_t texel) {
    const size_t x = texel % h->width, y = texel / h->width;
    bool edge = x == 0 || y == 0 || x + 1 == h->width || y + 1 == h->height;
    for (size_t k = 0; k < 9 && !edge; ++k) {
        edge = h->state[(y + k / 3 - 1) * h->width + x + k % 3 - 1] != VSHI_TEXEL_VALID;
    }
    return edge;
}

/* Numbers the places that are needed: first valid texels at edges, then others. */
static void number_places(hiding *h) {
    const size_t count = h->width * h->height;
    memset(h->mesh, 0, count * sizeof *h->mesh);
    for (size_t i = 0; i < count; ++i) {
        if (h->state[i] == VSHI_TEXEL_VALID && is_edge(h, i)) {
            h->mesh[i] = (uint32_t)++h->seen.count;
        }
    }
    h->place_count = h->seen.count;
    for (size_t i = 0; i < 2 * h->hidden_count; ++i) {
        const uint32_t texel = i < h->hidden_count ? h->hidden[i] : h->source[i - h->hidden_count];
        if (texel != NONE && h->mesh[texel] == 0) {
            h->mesh[texel] = (uint32_t)++h->place_count;
        }
    }
}

static vsh_result find_seen(hiding *h, const vsh_run *run, vsh_error *error) {
    number_places(h);
    if (h->seen.count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_store_take(h->store, (void **)&h->at, h->place_count, 3 * sizeof *h->at, what, error));
    VSHI_TRY(vshi_run_stage(run, what, vshi_charts_tiles(&h->charts->sorted), place_tile, h, error));
    VSHI_TRY(vshi_allocate((void **)&h->seen.list, h->seen.count, sizeof *h->seen.list, what, error));
    for (size_t i = 0; i < h->width * h->height; ++i) {
        if (h->mesh[i] > 0 && h->mesh[i] <= h->seen.count) {
            vshi_place *place = &h->seen.list[h->mesh[i] - 1];
            memcpy(place->at, place_of(h, i), sizeof place->at);
            place->number = (uint32_t)i;
        }
    }
    return vshi_places_sort(&h->seen, error);
}

static float square_between(const float a[3], const float b[3]) {
    const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* Finds the source of each texel; NONE: it keeps its chart's value. */
static void find_sources(void *user, size_t begin, size_t end) {
    const hiding *h = user;
    for (size_t i = begin; i < end; ++i) {
        const float *at = place_of(h, h->hidden[i]);
        float square = INFINITY;
        if (h->source[i] != NONE) {
            square = NEARER * NEARER * square_between(at, place_of(h, h->source[i]));
        }
        h->source[i] = vshi_places_nearest(&h->seen, at, square);
    }
}

static void copy_value(const hiding *h, size_t from_texel, size_t to_texel) {
    const size_t from = vshi_plane_place(h->lightmap, h->width, from_texel),
                 to = vshi_plane_place(h->lightmap, h->width, to_texel);
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(h->lightmap, h->light_count, &c);) {
        const size_t components = vshi_plane_components(c.kind);
        /* a direction in another chart's tangent space means nothing here */
        const bool other = c.kind->holds == VSHI_HOLDS_VECTOR && h->lightmap->bent_space == VSH_BENT_TANGENT;
        if (c.kind->padded && !other) {
            memcpy(c.values + to * components, c.values + from * components, components * sizeof *c.values);
        }
    }
}

/* The hidden texel that an empty one pads; SIZE_MAX: it is nearer to others, or to none. */
static size_t padded_by(const hiding *h, size_t texel, int32_t reach) {
    const int32_t x = (int32_t)(texel % h->width), y = (int32_t)(texel / h->width);
    int32_t best = INT32_MAX;
    size_t by = SIZE_MAX;
    for (int32_t dy = -reach; dy <= reach; ++dy) {
        for (int32_t dx = -reach; dx <= reach; ++dx) {
            const int32_t square = dx * dx + dy * dy;
            if (x + dx < 0 || x + dx >= (int32_t)h->width || y + dy < 0 || y + dy >= (int32_t)h->height ||
                square >= best) {
                continue;
            }
            const size_t at = (size_t)(y + dy) * h->width + (size_t)(x + dx);
            if (h->state[at] != VSHI_TEXEL_EMPTY && h->state[at] != TESTED) {
                best = square;
                by = h->state[at] == HIDDEN ? at : SIZE_MAX;
            }
        }
    }
    return by;
}

/* Fills empty texels around a hidden texel whose nearest chart is hidden. */
static void pad_around(const hiding *h, size_t texel, int32_t reach) {
    const int32_t x = (int32_t)(texel % h->width), y = (int32_t)(texel / h->width);
    for (int32_t row = y - reach; row <= y + reach; ++row) {
        for (int32_t column = x - reach; column <= x + reach; ++column) {
            if (row < 0 || row >= (int32_t)h->height || column < 0 || column >= (int32_t)h->width) {
                continue;
            }
            const size_t at = (size_t)row * h->width + (size_t)column;
            if (h->state[at] != VSHI_TEXEL_EMPTY) {
                continue;
            }
            h->state[at] = TESTED;
            const size_t by = padded_by(h, at, reach);
            if (by != SIZE_MAX) {
                copy_value(h, by, at);
            }
        }
    }
}

static void fill(hiding *h) {
    const int32_t padding = h->charts->padding, reach = padding < MOST_PADDING ? padding : MOST_PADDING;
    for (size_t i = 0; i < h->hidden_count; ++i) {
        if (h->source[i] != NONE) {
            copy_value(h, h->source[i], h->hidden[i]);
            h->state[h->hidden[i]] = HIDDEN;
            ++h->filled;
        }
    }
    for (size_t i = 0; i < h->hidden_count && reach > 0; ++i) {
        if (h->source[i] != NONE) {
            pad_around(h, h->hidden[i], reach);
        }
    }
}

static vsh_result find_and_fill(hiding *h, const vsh_run *run, vsh_error *error) {
    const size_t count = h->width * h->height;
    VSHI_TRY(vshi_store_take(h->store, (void **)&h->state, count, 1, what, error));
    VSHI_TRY(vshi_store_take(h->store, (void **)&h->mesh, count, sizeof *h->mesh, what, error));
    VSHI_TRY(vshi_run_stage(run, what, vshi_charts_tiles(&h->charts->sorted), read_tile, h, error));
    VSHI_TRY(find_hidden(h, error));
    if (h->hidden_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(find_seen(h, run, error));
    if (h->seen.count == 0) {
        return VSH_OK;
    }
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, what, h->hidden_count, what, error));
    const vsh_result result = vshi_parallel_for(job, h->hidden_count, 256, 1, find_sources, h, error);
    vshi_job_end(job);
    VSHI_TRY(result);
    fill(h);
    return VSH_OK;
}

vsh_result vshi_lightmap_fill_hidden(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                     size_t light_count, vshi_store *store, const vsh_run *run,
                                     uint64_t *filled, vsh_error *error) {
    hiding h = {.charts = charts,
                .lightmap = lightmap,
                .light_count = light_count,
                .width = (size_t)charts->info.width,
                .height = (size_t)charts->info.height,
                .store = store};
    if (h.width * h.height >= UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu texels, at most %u", what, h.width * h.height,
                         UINT32_MAX - 1);
    }
    const vsh_result result = find_and_fill(&h, run, error);
    if (result == VSH_OK && filled != NULL) {
        *filled = h.filled;
    }
    vshi_places_free(&h.seen);
    free(h.source);
    free(h.hidden);
    vshi_store_give(store, h.at);
    vshi_store_give(store, h.mesh);
    vshi_store_give(store, h.state);
    return result;
}

vsh_result vsh_lightmap_fill_hidden(const vsh_charts *charts, const vsh_lightmap *lightmap,
                                    size_t light_count, const vsh_run *run, uint64_t *filled,
                                    vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(charts, lightmap);
    VSHI_NEEDS(lightmap->coverage);
    VSHI_TRY(vshi_plane_row_check(lightmap, charts->info.width, error));
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_store store = {.run = &full};
    const vsh_result result =
        vshi_lightmap_fill_hidden(charts, lightmap, light_count, &store, &full, filled, error);
    vshi_store_close(&store);
    return result;
}
