/* Wave by wave from the valid texels over invalid ones that touch them: each takes the nearest of the sources
 * that its neighbours have from the waves before. So a texel's source depends on nothing farther than the
 * waves go, and not on the order of work. */
#include "bake/nearest_valid.h"
#include "base/try.h"

#include <string.h>

static const uint32_t NONE = UINT32_MAX, WAITING = UINT32_MAX - 1; /* for the end of its wave */

typedef struct spreading {
    size_t width, height;
    const uint8_t *state;
    const uint32_t *mesh; /* [height][width] */
    uint32_t *source;     /* [height][width]: its own number where it is valid */
    vshi_spread *spread;
} spreading;

static size_t neighbours_of(const spreading *s, size_t texel, size_t found[8]) {
    const size_t x = texel % s->width, y = texel / s->width;
    const size_t x0 = x > 0 ? x - 1 : 0, x1 = x + 1 < s->width ? x + 1 : x;
    const size_t y0 = y > 0 ? y - 1 : 0, y1 = y + 1 < s->height ? y + 1 : y;
    size_t count = 0;
    for (size_t row = y0; row <= y1; ++row) {
        for (size_t column = x0; column <= x1; ++column) {
            const size_t at = row * s->width + column;
            if (at != texel && s->state[at] != VSHI_TEXEL_EMPTY && s->mesh[at] == s->mesh[texel]) {
                found[count++] = at;
            }
        }
    }
    return count;
}

static int64_t square_between(const spreading *s, size_t a, size_t b) {
    const int64_t x = (int64_t)(a % s->width) - (int64_t)(b % s->width);
    const int64_t y = (int64_t)(a / s->width) - (int64_t)(b / s->width);
    return x * x + y * y;
}

/* Of the sources around a texel the nearest, of equally near ones the first in the image. */
static uint32_t nearest_source(const spreading *s, size_t texel) {
    size_t around[8];
    const size_t count = neighbours_of(s, texel, around);
    uint32_t best = NONE;
    for (size_t k = 0; k < count; ++k) {
        const uint32_t source = s->source[around[k]];
        if (source == NONE || source == WAITING) {
            continue;
        }
        const int64_t square = square_between(s, texel, source);
        const int64_t least = best != NONE ? square_between(s, texel, best) : INT64_MAX;
        if (square < least || (square == least && source < best)) {
            best = source;
        }
    }
    return best;
}

/* Adds the texels beside `texel` that have no source yet. */
static void reach_from(spreading *s, size_t texel) {
    size_t around[8];
    const size_t count = neighbours_of(s, texel, around);
    for (size_t k = 0; k < count; ++k) {
        if (s->source[around[k]] == NONE) {
            s->source[around[k]] = WAITING;
            s->spread->texel[s->spread->count++] = (uint32_t)around[k];
        }
    }
}

static void run_waves(spreading *s, size_t texels) {
    vshi_spread *spread = s->spread;
    for (size_t i = 0; i < texels; ++i) {
        if (s->state[i] == VSHI_TEXEL_VALID) {
            reach_from(s, i);
        }
    }
    size_t begin = 0;
    for (int wave = 0; wave < VSHI_SPREAD_REACH && begin < spread->count; ++wave) {
        const size_t end = spread->count;
        for (size_t i = begin; i < end; ++i) {
            spread->source[i] = nearest_source(s, spread->texel[i]);
        }
        for (size_t i = begin; i < end; ++i) {
            s->source[spread->texel[i]] = spread->source[i];
        }
        for (size_t i = begin; i < end && wave + 1 < VSHI_SPREAD_REACH; ++i) {
            reach_from(s, spread->texel[i]);
        }
        begin = end;
    }
}

vsh_result vshi_spread_find(vshi_store *store, size_t width, size_t height, const uint32_t *mesh,
                            const uint8_t *state, vshi_spread *spread, vsh_error *error) {
    const size_t texels = width * height;
    const char *what = "invalid texels";
    size_t invalid = 0;
    *spread = (vshi_spread){0};
    for (size_t i = 0; i < texels; ++i) {
        invalid += state[i] == VSHI_TEXEL_INVALID;
    }
    if (invalid == 0) {
        return VSH_OK;
    }
    spreading s = {.width = width, .height = height, .state = state, .mesh = mesh, .spread = spread};
    VSHI_TRY(vshi_store_take(store, (void **)&s.source, texels, sizeof *s.source, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&spread->texel, invalid, sizeof *spread->texel, what, error));
    VSHI_TRY(vshi_store_take(store, (void **)&spread->source, invalid, sizeof *spread->source, what, error));
    for (size_t i = 0; i < texels; ++i) {
        s.source[i] = state[i] == VSHI_TEXEL_VALID ? (uint32_t)i : NONE;
    }
    run_waves(&s, texels);
    vshi_store_give(store, s.source);
    return VSH_OK;
}

void vshi_spread_free(vshi_store *store, vshi_spread *spread) {
    vshi_store_give(store, spread->source);
    vshi_store_give(store, spread->texel);
    *spread = (vshi_spread){0};
}

void vshi_spread_copy(const vshi_spread *spread, uint8_t *state, const vshi_plane *planes,
                      size_t plane_count) {
    for (size_t i = 0; i < spread->count; ++i) {
        const size_t to = spread->texel[i], from = spread->source[i];
        for (size_t p = 0; state[from] == VSHI_TEXEL_VALID && p < plane_count; ++p) {
            const size_t channels = planes[p].channels;
            memcpy(planes[p].values + to * channels, planes[p].values + from * channels,
                   channels * sizeof(float));
        }
        if (state[from] == VSHI_TEXEL_VALID) {
            state[to] = VSHI_TEXEL_FILLED;
        }
    }
}
