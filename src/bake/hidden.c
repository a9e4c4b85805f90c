/* Charts that are hidden as a whole, as the bottom of a box that stands on another: no texel of theirs has a
 * value, and no one sees them. But lines of their borders show through where surfaces meet, and smaller
 * levels of the image have a part of them. So each texel takes the value of the texel that is nearest in the
 * world, of those at the edges of what is seen. */
#include "bake/nearest_valid.h"
#include "bake/places.h"
#include "bake/planes.h"
#include "bake/texels.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char what[] = "hidden charts";

/* Texels that lookups at what is seen read are its chart's: those that took a value from as near, squared
 * texels, keep it. */
enum { OWN_SQUARE = 8 };

/* Others keep the value of their chart's nearest texel where no place in the world is nearer than this part
 * of the way to it. */
static const float NEARER = 0.5F;

/* Texels around a hidden chart that are its padding, at most. */
enum { MOST_PADDING = 4 };

static const uint32_t NONE = UINT32_MAX;

/* Of a state: filled here; an empty one that was looked at. */
enum { HIDDEN = VSHI_TEXEL_KINDS, LOOKED_AT };

typedef struct hiding {
    const vsh_texels *texels;
    size_t width, height;
    uint8_t *state;   /* [texels] */
    uint32_t *sample; /* [texels]: the first of each, + 1; 0: none */
    double centre[3]; /* of the world, so that 32 bits tell places apart */
    vshi_places seen;
    uint32_t *hidden, *source; /* [hidden_count]: texels, and those whose values they have, then take; NONE */
    size_t hidden_count;
    uint64_t filled;
} hiding;

/* --- which texels */

/* States as the bake left them, and each texel's first sample. */
static void read_states(hiding *h, const float *coverage) {
    const vsh_texels *texels = h->texels;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = texels->count; i-- > 0;) {
        const size_t at = vshi_sample_held(texels, i);
        h->state[at] = coverage[at] != 0.0F ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
        h->sample[at] = (uint32_t)i + 1;
        for (size_t k = 0; k < 3; ++k) {
            low[k] = fmin(low[k], texels->position[3 * i + k]);
            high[k] = fmax(high[k], texels->position[3 * i + k]);
        }
    }
    for (int k = 0; k < 3 && texels->count > 0; ++k) {
        h->centre[k] = 0.5 * (low[k] + high[k]);
    }
}

static bool is_far(const hiding *h, uint32_t a, uint32_t b) {
    const int64_t x = (int64_t)(a % h->width) - (int64_t)(b % h->width);
    const int64_t y = (int64_t)(a / h->width) - (int64_t)(b / h->width);
    return x * x + y * y > OWN_SQUARE;
}

/* Lists texels that are not valid, but for those that are filled from near. */
static vsh_result find_hidden(hiding *h, vsh_error *error) {
    const size_t count = h->width * h->height;
    vshi_spread spread;
    vsh_result result;
    VSHI_TRY_DONE(vshi_spread_find(h->texels, h->state, &spread, error));
    for (size_t i = 0; i < spread.count; ++i) {
        h->state[spread.texel[i]] = VSHI_TEXEL_FILLED;
        h->hidden_count += is_far(h, spread.texel[i], spread.source[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        h->hidden_count += h->state[i] == VSHI_TEXEL_INVALID;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&h->hidden, h->hidden_count, sizeof *h->hidden, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&h->source, h->hidden_count, sizeof *h->source, what, error));
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
    vshi_spread_free(&spread);
    return result;
}

static void place_of(const hiding *h, size_t texel, float at[3]) {
    const double *position = h->texels->position + 3 * (size_t)(h->sample[texel] - 1);
    for (int k = 0; k < 3; ++k) {
        at[k] = (float)(position[k] - h->centre[k]);
    }
}

/* Whether a valid texel is at an edge of what is seen. */
static bool is_edge(const hiding *h, size_t texel) {
    const size_t x = texel % h->width, y = texel / h->width;
    bool edge = x == 0 || y == 0 || x + 1 == h->width || y + 1 == h->height;
    for (size_t k = 0; k < 9 && !edge; ++k) {
        edge = h->state[(y + k / 3 - 1) * h->width + x + k % 3 - 1] != VSHI_TEXEL_VALID;
    }
    return edge;
}

static vsh_result find_seen(hiding *h, vsh_error *error) {
    const size_t count = h->width * h->height;
    for (int pass = 0; pass < 2; ++pass) {
        size_t found = 0;
        for (size_t i = 0; i < count; ++i) {
            if (h->state[i] != VSHI_TEXEL_VALID || !is_edge(h, i)) {
                continue;
            }
            if (pass == 1) {
                vshi_place *place = &h->seen.list[found];
                place_of(h, i, place->at);
                place->number = (uint32_t)i;
            }
            ++found;
        }
        if (pass == 0) {
            h->seen.count = found;
            VSHI_TRY(vshi_allocate((void **)&h->seen.list, found, sizeof *h->seen.list, what, error));
        }
    }
    return vshi_places_sort(&h->seen, error);
}

static float square_between(const float a[3], const float b[3]) {
    const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

/* The source of each; NONE: it keeps what its chart gave it. */
static void find_sources(void *user, size_t begin, size_t end) {
    const hiding *h = user;
    for (size_t i = begin; i < end; ++i) {
        float at[3], own[3], square = INFINITY;
        place_of(h, h->hidden[i], at);
        if (h->source[i] != NONE) {
            place_of(h, h->source[i], own);
            square = NEARER * NEARER * square_between(at, own);
        }
        h->source[i] = vshi_places_nearest(&h->seen, at, square);
    }
}

/* --- values */

static void copy_value(const vsh_lightmap *lightmap, size_t light_count, size_t from, size_t to) {
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + kind_count; ++kind) {
        const size_t components = vshi_plane_components(kind);
        /* a direction in the tangent space of another chart is none in this one's */
        const bool other = kind->holds == VSHI_HOLDS_VECTOR && lightmap->bent_space == VSH_BENT_TANGENT;
        for (size_t i = 0; i < (kind->per_light ? light_count : 1) && kind->padded && !other; ++i) {
            float *plane = vshi_plane_of(lightmap, kind, i);
            if (plane != NULL) {
                memcpy(plane + to * components, plane + from * components, components * sizeof *plane);
            }
        }
    }
}

/* The hidden texel that an empty one is padding of; SIZE_MAX: it is nearer to others, or to none. */
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
            if (h->state[at] != VSHI_TEXEL_EMPTY && h->state[at] != LOOKED_AT) {
                best = square;
                by = h->state[at] == HIDDEN ? at : SIZE_MAX;
            }
        }
    }
    return by;
}

/* Fills what is empty around a hidden texel, as far as its chart is what is nearest. */
static void pad_around(const hiding *h, size_t texel, int32_t reach, const vsh_lightmap *lightmap,
                       size_t light_count) {
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
            h->state[at] = LOOKED_AT;
            const size_t by = padded_by(h, at, reach);
            if (by != SIZE_MAX) {
                copy_value(lightmap, light_count, by, at);
            }
        }
    }
}

static void fill(hiding *h, const vsh_lightmap *lightmap, size_t light_count) {
    const int32_t padding = h->texels->padding, reach = padding < MOST_PADDING ? padding : MOST_PADDING;
    for (size_t i = 0; i < h->hidden_count; ++i) {
        if (h->source[i] != NONE) {
            copy_value(lightmap, light_count, h->source[i], h->hidden[i]);
            h->state[h->hidden[i]] = HIDDEN;
            ++h->filled;
        }
    }
    for (size_t i = 0; i < h->hidden_count && reach > 0; ++i) {
        if (h->source[i] != NONE) {
            pad_around(h, h->hidden[i], reach, lightmap, light_count);
        }
    }
}

static vsh_result find_and_fill(hiding *h, const vsh_lightmap *lightmap, size_t light_count,
                                const vsh_run *run, vsh_error *error) {
    const double count = (double)h->width * (double)h->height;
    const double bytes = count * (1.0 + 3.0 * sizeof(uint32_t) + VSHI_SPREAD_TEXEL_BYTES + VSHI_PLACE_BYTES);
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    VSHI_TRY(vshi_allocate((void **)&h->state, h->width * h->height, 1, what, error));
    VSHI_TRY(vshi_allocate((void **)&h->sample, h->width * h->height, sizeof *h->sample, what, error));
    read_states(h, lightmap->coverage);
    VSHI_TRY(find_hidden(h, error));
    if (h->hidden_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(find_seen(h, error));
    if (h->seen.count == 0) {
        return VSH_OK;
    }
    vshi_job *job = vshi_job_begin(run, what, h->hidden_count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
    }
    const vsh_result result = vshi_parallel_for(job, h->hidden_count, 256, 1, find_sources, h, error);
    vshi_job_end(job);
    VSHI_TRY(result);
    fill(h, lightmap, light_count);
    return VSH_OK;
}

vsh_result vsh_lightmap_fill_hidden(const vsh_texels *texels, const vsh_lightmap *lightmap,
                                    size_t light_count, const vsh_run *run, uint64_t *filled,
                                    vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(texels);
    VSHI_NEEDS(lightmap);
    VSHI_NEEDS(lightmap->coverage);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (texels->band.own_rows != texels->info.height) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %d rows of %d: the lightmap is not whole", what,
                         texels->band.own_rows, texels->info.height);
    }
    if (vshi_texels_held(texels) >= UINT32_MAX || texels->count >= UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu texels of %zu samples, at most %u of each", what,
                         vshi_texels_held(texels), texels->count, UINT32_MAX - 1);
    }
    hiding h = {.texels = texels, .width = (size_t)texels->info.width, .height = (size_t)texels->info.height};
    full.memory_held += texels->info.bytes;
    const vsh_result result = find_and_fill(&h, lightmap, light_count, &full, error);
    if (result == VSH_OK && filled != NULL) {
        *filled = h.filled;
    }
    vshi_places_free(&h.seen);
    free(h.source);
    free(h.hidden);
    free(h.sample);
    free(h.state);
    return result;
}
