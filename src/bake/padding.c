/* A separable nearest-neighbour search: first the nearest valid texel within each column, then over the
 * columns of each row, outwards until no column can be nearer (Saito and Toriwaki, "New algorithms for
 * Euclidean distance transformation", 1994). Distances are whole numbers, so ties are exact. */
#include "bake/padding.h"
#include "base/parallel.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum { STRIP = 64, NONE = INT16_MAX };

typedef struct filling {
    size_t width, height;
    const uint8_t *state;
    const int32_t *radius;
    int32_t reach; /* the largest radius */
    const vshi_plane *planes;
    size_t plane_count;
    uint8_t *filled; /* [height][width]; NULL: not asked for */
    int16_t *down;   /* [height][width]: rows from a texel to the nearest valid one of its column; NONE */
} filling;

static void search_columns(void *user, size_t begin, size_t end) {
    filling *f = user;
    for (size_t strip = begin; strip < end; ++strip) {
        const size_t first = strip * STRIP;
        const size_t last = first + STRIP < f->width ? first + STRIP : f->width;
        int32_t rows[STRIP]; /* since the last valid texel */
        for (int pass = 0; pass < 2; ++pass) {
            for (size_t x = 0; x < STRIP; ++x) {
                rows[x] = NONE;
            }
            for (size_t i = 0; i < f->height; ++i) {
                const size_t y = pass == 0 ? i : f->height - 1 - i;
                for (size_t x = first; x < last; ++x) {
                    const size_t at = y * f->width + x;
                    int32_t *since = &rows[x - first];
                    *since = f->state[at] == VSHI_TEXEL_VALID ? 0 : *since < NONE ? *since + 1 : NONE;
                    if (pass == 0) {
                        f->down[at] = (int16_t)(*since <= f->reach ? -*since : NONE);
                    } else if (*since <= f->reach && *since < abs(f->down[at])) {
                        f->down[at] = (int16_t)*since;
                    }
                }
            }
        }
    }
}

/* Index of the texel that (x, y) is filled from, or SIZE_MAX. */
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
            if (down == NONE) {
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
            if (source == SIZE_MAX) {
                continue;
            }
            for (size_t p = 0; p < f->plane_count; ++p) {
                const size_t channels = f->planes[p].channels;
                memcpy(f->planes[p].values + at * channels, f->planes[p].values + source * channels,
                       channels * sizeof(float));
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
    /* Progress in columns' worth of texels and rows' worth of texels alike. */
    vshi_job *job = vshi_job_begin(run, "padding", f.width * f.height * 2);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "padding: the system refused memory");
    }
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
