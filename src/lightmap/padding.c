/* Filling texels without a value, in three ways: around charts, within charts, everywhere else. */
#include "lightmap/padding.h"
#include "shade/shade.h"

#include <stdlib.h>
#include <string.h>

static void copy_texel(const vshi_plane *planes, size_t plane_count, size_t from, size_t to) {
    for (const vshi_plane *p = planes; p < planes + plane_count; ++p) {
        memcpy(p->values + to * p->channels, p->values + from * p->channels, p->channels * sizeof(float));
    }
}

/* --- around charts
 *
 * A separable nearest-neighbour search: first the nearest valid texel within each column, then over the
 * columns of each row, outwards until no column can be nearer (Saito and Toriwaki, "New algorithms for
 * Euclidean distance transformation", 1994). Distances are whole numbers, so ties are exact. */
enum { STRIP = 64, NO_ROW = INT16_MAX };

typedef struct filling {
    size_t width, height;
    const uint8_t *state;
    const int32_t *radius;
    int32_t reach; /* the largest radius */
    const vshi_plane *planes;
    size_t plane_count;
    uint8_t *filled; /* [height][width]; NULL: not wanted */
    int16_t *down;   /* [height][width]: rows from a texel to the nearest valid one of its column; NO_ROW */
} filling;

static void search_columns(void *user, size_t begin, size_t end) {
    filling *f = user;
    for (size_t strip = begin; strip < end; ++strip) {
        const size_t first = strip * STRIP;
        const size_t last = first + STRIP < f->width ? first + STRIP : f->width;
        int32_t rows[STRIP]; /* since the last valid texel */
        for (int pass = 0; pass < 2; ++pass) {
            for (size_t x = 0; x < STRIP; ++x) {
                rows[x] = NO_ROW;
            }
            for (size_t i = 0; i < f->height; ++i) {
                const size_t y = pass == 0 ? i : f->height - 1 - i;
                for (size_t x = first; x < last; ++x) {
                    const size_t at = y * f->width + x;
                    int32_t *since = &rows[x - first];
                    *since = f->state[at] == VSHI_TEXEL_VALID ? 0 : *since < NO_ROW ? *since + 1 : NO_ROW;
                    if (pass == 0) {
                        f->down[at] = (int16_t)(*since <= f->reach ? -*since : NO_ROW);
                    } else if (*since <= f->reach && *since < abs(f->down[at])) {
                        f->down[at] = (int16_t)*since;
                    }
                }
            }
        }
    }
}

/* Index of the texel whose value (x, y) takes, or SIZE_MAX. */
static size_t search_row(const filling *f, size_t x, size_t y, int32_t radius) {
    int64_t best = (int64_t)radius * radius;
    size_t source = SIZE_MAX;
    for (int64_t step = 0; step * step <= best; ++step) {
        if ((size_t)step > x && (size_t)step >= f->width - x) {
            break;
        }
        for (int side = 0; side < (step == 0 ? 1 : 2); ++side) {
            const int64_t column = side == 0 ? (int64_t)x - step : (int64_t)x + step;
            if (column < 0 || column >= (int64_t)f->width) {
                continue;
            }
            const int64_t down = f->down[y * f->width + (size_t)column];
            if (down == NO_ROW) {
                continue;
            }
            const int64_t distance = step * step + down * down;
            const size_t at = (size_t)((int64_t)y + down) * f->width + (size_t)column;
            if (distance < best || (distance == best && at < source)) {
                best = distance;
                source = at;
            }
        }
    }
    return source;
}

static void fill_rows(void *user, size_t begin, size_t end) {
    const filling *f = user;
    for (size_t y = begin; y < end; ++y) {
        for (size_t x = 0; x < f->width; ++x) {
            const size_t at = y * f->width + x;
            const uint8_t kind = f->state[at];
            const int32_t radius = kind == VSHI_TEXEL_VALID ? 0 : f->radius[kind];
            const size_t source = radius > 0 ? search_row(f, x, y, radius) : SIZE_MAX;
            if (f->filled != NULL) {
                f->filled[at] =
                    radius == 0 ? kind == VSHI_TEXEL_VALID || kind == VSHI_TEXEL_FILLED : source != SIZE_MAX;
            }
            if (source != SIZE_MAX) {
                copy_texel(f->planes, f->plane_count, source, at);
            }
        }
    }
}

vsh_result vshi_padding_fill(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                             const uint8_t *state, const int32_t radius[VSHI_TEXEL_KINDS],
                             const vshi_plane *planes, size_t plane_count, uint8_t *filled,
                             vsh_error *error) {
    filling f = {.width = (size_t)width,
                 .height = (size_t)height,
                 .state = state,
                 .radius = radius,
                 .planes = planes,
                 .plane_count = plane_count,
                 .filled = filled};
    for (int kind = 0; kind < VSHI_TEXEL_KINDS; ++kind) {
        f.reach = kind != VSHI_TEXEL_VALID && radius[kind] > f.reach ? radius[kind] : f.reach;
    }
    if (f.reach == 0 || plane_count == 0) {
        return VSH_OK;
    }
    const size_t strips = (f.width + STRIP - 1) / STRIP;
    /* Columns and rows report progress in texels. */
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, "padding", f.width * f.height * 2, "padding", error));
    vsh_result result;
    VSHI_TRY_DONE(
        vshi_store_take(store, (void **)&f.down, f.width * f.height, sizeof *f.down, "padding", error));
    VSHI_TRY_DONE(vshi_parallel_for(job, strips, 1, STRIP * f.height, search_columns, &f, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, f.height, 4, f.width, fill_rows, &f, error));
done:
    vshi_store_give(store, f.down);
    vshi_job_end(job);
    return result;
}

/* --- within charts
 *
 * Wave by wave from the valid texels over invalid ones that touch them: each takes the nearest of the sources
 * that its neighbours have from the waves before. So a texel's source depends on nothing farther than the
 * waves go, and not on the order of work. */
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

/* The nearest source around a texel, of equally near ones the first in the image. */
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
        if (state[from] == VSHI_TEXEL_VALID) {
            copy_texel(planes, plane_count, from, to);
            state[to] = VSHI_TEXEL_FILLED;
        }
    }
}

/* --- everywhere else
 *
 * Pull and push (Gortler, Grzeszczuk, Szeliski and Cohen, "The lumigraph", 1996) with plain means. Pull: each
 * level is half as large, and its texel is the mean of the four below that have a value. Push: from the
 * coarsest level down, a texel without a value copies the one above it. Neighbours are not blended, so
 * filling does not change the means of coarser levels. */
enum { MOST_CHANNELS = 4, GRAIN = 16 /* rows */ };

/* A plane, halved some times. */
typedef struct level {
    size_t width, height;
    float *values;   /* [height][width][channels] */
    uint8_t *filled; /* [height][width] */
} level;

typedef struct pulling {
    vshi_store *store;
    vshi_job *job;
    size_t channels;
    bool any;                   /* some texel holds a value */
    const level *fine, *coarse; /* the two levels at work */
} pulling;

/* Averages up to four values, in the order of the image. */
static void pull_rows(void *user, size_t begin, size_t end) {
    const pulling *p = user;
    const level *fine = p->fine, *coarse = p->coarse;
    for (size_t y = begin; y < end; ++y) {
        for (size_t x = 0; x < coarse->width; ++x) {
            float sum[MOST_CHANNELS] = {0.0f};
            int count = 0;
            for (size_t k = 0; k < 4; ++k) {
                const size_t column = 2 * x + k % 2, row = 2 * y + k / 2, at = row * fine->width + column;
                if (column >= fine->width || row >= fine->height || fine->filled[at] == 0) {
                    continue;
                }
                ++count;
                for (size_t c = 0; c < p->channels; ++c) {
                    sum[c] += fine->values[at * p->channels + c];
                }
            }
            const size_t to = y * coarse->width + x;
            coarse->filled[to] = count > 0;
            for (size_t c = 0; c < p->channels && count > 0; ++c) {
                coarse->values[to * p->channels + c] = sum[c] / (float)count;
            }
        }
    }
}

static void push_rows(void *user, size_t begin, size_t end) {
    const pulling *p = user;
    const level *fine = p->fine, *coarse = p->coarse;
    for (size_t y = begin; y < end; ++y) {
        for (size_t x = 0; x < fine->width; ++x) {
            const size_t to = y * fine->width + x, from = y / 2 * coarse->width + x / 2;
            if (fine->filled[to] == 0) {
                memcpy(fine->values + to * p->channels, coarse->values + from * p->channels,
                       p->channels * sizeof(float));
            }
        }
    }
}

/* Fills a level from the one above, which is made of it; `units` of progress a row. */
static vsh_result fill_level(pulling *p, const level *fine, size_t units, vsh_error *error) {
    if (fine->width == 1 && fine->height == 1) {
        p->any = fine->filled[0] != 0;
        return VSH_OK;
    }
    level coarse = {.width = (fine->width + 1) / 2, .height = (fine->height + 1) / 2};
    const size_t texels = coarse.width * coarse.height;
    VSHI_TRY(vshi_store_take(p->store, (void **)&coarse.filled, texels, 1, "padding", error));
    VSHI_TRY(vshi_store_take(p->store, (void **)&coarse.values, texels * p->channels, sizeof(float),
                             "padding", error));
    p->fine = fine;
    p->coarse = &coarse;
    VSHI_TRY(vshi_parallel_for(p->job, coarse.height, GRAIN, 0, pull_rows, p, error));
    VSHI_TRY(fill_level(p, &coarse, 0, error));
    p->fine = fine;
    p->coarse = &coarse;
    if (p->any) {
        VSHI_TRY(vshi_parallel_for(p->job, fine->height, GRAIN, units, push_rows, p, error));
    }
    vshi_store_give(p->store, coarse.values);
    vshi_store_give(p->store, coarse.filled);
    return VSH_OK;
}

vsh_result vshi_pull_push(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                          uint8_t *filled, const vshi_plane *planes, size_t plane_count, vsh_error *error) {
    if (plane_count == 0) {
        return VSH_OK;
    }
    pulling p = {.store = store};
    VSHI_TRY(vshi_job_open(&p.job, run, "padding", (size_t)height * plane_count, "padding", error));
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < plane_count && result == VSH_OK; ++i) {
        const level finest = {(size_t)width, (size_t)height, planes[i].values, filled};
        p.channels = planes[i].channels;
        result = fill_level(&p, &finest, 1, error);
    }
    vshi_job_end(p.job);
    return result;
}
