/* What is read along seams. All texels of it are marked in a bitmap of the image, whose set bits are counted
 * to number them; which chart covers each is asked of the tiles that have any; places that would read a third
 * chart are left out; what is left falls apart into islands that have no texel in common. */
#include "bake/seams.h"
#include "bake/tile.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "mesh/weld.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double STEP = 0.5; /* texels, on the side where a seam is longer */

/* A lookup's place within its four texels, in steps of a texel: finer than filtering units are (1/256), and
 * products of two have the 24 bits of a float. */
enum { STEPS_OF_TEXEL = 4096 };

/* What filtering units round to nothing: a texel with less of the weight is not read. */
static const float UNREAD = 1.0f / 512.0f;

enum { POLL_SEAMS = 4096 };

typedef struct making {
    const vshi_seam_pages *pages;
    const vshi_seams *seams;
    vshi_job *job;
    vshi_seam_system *system;
    uint64_t *marks; /* [words]: of texels, in the order of the image */
    uint32_t *rank;  /* [words]: texels marked before a word */
    size_t words;
    uint32_t *parent;        /* [unknowns]: union-find, then the island */
    uint32_t *number;        /* [unknowns]: island by island */
    vshi_seam_row *unsorted; /* [places] */
    size_t page;             /* whose owners are found */
} making;

/* Texels that a lookup reads, and their weights in 2^-24. */
typedef struct lookup {
    uint64_t texel[4];
    uint32_t weight[4];
} lookup;

/* How many places a seam has; *share of each. */
static size_t places_of(const vshi_seam *seam, float *share) {
    double square = 0.0;
    for (int side = 0; side < 2; ++side) {
        const double x = seam->x[side][1] - seam->x[side][0], y = seam->y[side][1] - seam->y[side][0];
        square = fmax(square, x * x + y * y);
    }
    const double length = sqrt(square) / STEP;
    const size_t intervals = (size_t)length; /* ends lie in the image: no more than 2^18 */
    *share = (float)(length / (double)(intervals > 0 ? intervals : 1));
    return intervals + 1;
}

/* The two texels along an axis, edges repeated, and where between their centres, 0 … STEPS_OF_TEXEL. */
static uint32_t along(double at, int32_t size, int64_t texel[2]) {
    const double steps = floor((at - 0.5) * STEPS_OF_TEXEL + 0.5);
    const double whole = floor(steps / STEPS_OF_TEXEL);
    for (int k = 0; k < 2; ++k) {
        const int64_t i = (int64_t)whole + k;
        texel[k] = i < 0 ? 0 : i >= size ? size - 1 : i;
    }
    return (uint32_t)(steps - whole * STEPS_OF_TEXEL);
}

/* What is read at place `place` of `places`: from end to end, a lone one in the middle. */
static lookup look_up(const making *m, const vshi_seam *seam, int side, size_t place, size_t places) {
    const vshi_raster *raster = &m->pages->charts[seam->page[side]]->raster;
    const uint64_t texel = m->pages->texel[seam->page[side]];
    const double t = places > 1 ? (double)place / (double)(places - 1) : 0.5;
    int64_t column[2], row[2];
    const uint32_t x =
        along(seam->x[side][0] + t * (seam->x[side][1] - seam->x[side][0]), raster->width, column);
    const uint32_t y =
        along(seam->y[side][0] + t * (seam->y[side][1] - seam->y[side][0]), raster->height, row);
    lookup found;
    for (int k = 0; k < 4; ++k) {
        found.texel[k] = texel + (uint64_t)row[k / 2] * (uint64_t)raster->width + (uint64_t)column[k % 2];
        found.weight[k] = (k % 2 ? x : STEPS_OF_TEXEL - x) * (k / 2 ? y : STEPS_OF_TEXEL - y);
    }
    return found;
}

/* --- unknowns */

static vsh_result mark(making *m, size_t *places, vsh_error *error) {
    *places = 0;
    for (size_t i = 0; i < m->seams->count; ++i) {
        if (i % POLL_SEAMS == 0 && vshi_job_advance(m->job, 0)) {
            return vshi_job_fail_cancelled(m->job, error);
        }
        const vshi_seam *seam = &m->seams->list[i];
        float share;
        const size_t own = places_of(seam, &share);
        *places += own;
        for (size_t k = 0; k < 2 * own; ++k) {
            const lookup found = look_up(m, seam, k % 2, k / 2, own);
            for (int t = 0; t < 4; ++t) {
                m->marks[found.texel[t] / 64] |= (uint64_t)(found.weight[t] > 0) << (found.texel[t] % 64);
            }
        }
    }
    uint64_t total = 0;
    for (size_t w = 0; w < m->words; ++w) {
        m->rank[w] = (uint32_t)total;
        total += (uint64_t)__builtin_popcountll(m->marks[w]);
    }
    if (*places > UINT32_MAX - 1 || total > UINT32_MAX - 1) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "seams: %zu places that read %llu texels, at most %u of each", *places,
                         (unsigned long long)total, UINT32_MAX - 1);
    }
    m->system->unknown_count = (size_t)total;
    return VSH_OK;
}

static bool is_marked(const making *m, uint64_t texel) {
    return (m->marks[texel / 64] >> (texel % 64) & 1) != 0;
}

static uint32_t unknown_of(const making *m, uint64_t texel) {
    const uint64_t before = m->marks[texel / 64] & (((uint64_t)1 << (texel % 64)) - 1);
    return m->rank[texel / 64] + (uint32_t)__builtin_popcountll(before);
}

/* Which chart a texel of the tile's cell is of, as the bake shades it: that of its first sample. */
static uint32_t owner_of(const making *m, const vshi_tile *tile, size_t bit) {
    const uint32_t owner = vshi_tile_owner(m->pages->charts[m->page], tile, bit);
    if (owner == 0) {
        return VSHI_NO_CHART;
    }
    const size_t first = m->pages->first[m->page] + m->pages->charts[m->page]->first[tile->mesh[owner - 1]];
    return m->seams->chart[first + tile->local[owner - 1]];
}

/* Whether a texel of so many from (x, y) on is marked, both ways. */
static bool has_marks(const making *m, size_t x, size_t y, size_t side) {
    const vshi_raster *raster = &m->pages->charts[m->page]->raster;
    const size_t width = (size_t)raster->width, height = (size_t)raster->height;
    const size_t right = x + side < width ? x + side : width, bottom = y + side < height ? y + side : height;
    bool any = false;
    for (; y < bottom && !any; ++y) {
        for (size_t column = x; column < right && !any; ++column) {
            any = is_marked(m, m->pages->texel[m->page] + y * width + column);
        }
    }
    return any;
}

static void find_cell_owners(const making *m, const vshi_tile *tile) {
    const vshi_raster *raster = &m->pages->charts[m->page]->raster;
    const size_t width = (size_t)raster->width, height = (size_t)raster->height;
    for (size_t bit = 0; bit < VSHI_CELL * VSHI_CELL; ++bit) {
        const size_t x = tile->cell.column * VSHI_CELL + bit % VSHI_CELL,
                     y = tile->cell.row * VSHI_CELL + bit / VSHI_CELL;
        if (x < width && y < height && is_marked(m, m->pages->texel[m->page] + y * width + x)) {
            m->system->chart[unknown_of(m, m->pages->texel[m->page] + y * width + x)] =
                owner_of(m, tile, bit);
        }
    }
}

static vsh_result find_owners(void *user, size_t number, vsh_error *error) {
    const making *m = user;
    const vshi_charts *charts = m->pages->charts[m->page];
    const size_t x = number % charts->columns * VSHI_TILE, y = number / charts->columns * VSHI_TILE;
    vshi_tile tile;
    if (!has_marks(m, x, y, VSHI_TILE)) {
        return VSH_OK;
    }
    const vsh_result result = vshi_tile_open(charts, number, &tile, error);
    for (size_t k = 0; result == VSH_OK && k < VSHI_TILE_CELLS * VSHI_TILE_CELLS; ++k) {
        const size_t cell_x = k % VSHI_TILE_CELLS, cell_y = k / VSHI_TILE_CELLS;
        if (has_marks(m, x + VSHI_CELL * cell_x, y + VSHI_CELL * cell_y, VSHI_CELL) &&
            vshi_tile_rasterize(charts, &tile, (int32_t)cell_x, (int32_t)cell_y, NULL)) {
            find_cell_owners(m, &tile);
        }
    }
    vshi_tile_close(&tile);
    return result;
}

/* Where the unknowns are; none of a chart so far. */
static void place_unknowns(const making *m) {
    const uint64_t first = m->pages->texel[m->page], end = m->pages->texel[m->page + 1];
    for (uint64_t word = first / 64; word < (end + 63) / 64; ++word) {
        for (uint64_t bits = m->marks[word]; bits != 0; bits &= bits - 1) {
            const uint64_t texel = 64 * word + (uint64_t)__builtin_ctzll(bits);
            if (texel >= first && texel < end) {
                const uint32_t unknown = unknown_of(m, texel);
                m->system->texel[unknown] = texel - first;
                m->system->page[unknown] = (uint32_t)m->page;
                m->system->chart[unknown] = VSHI_NO_CHART;
            }
        }
    }
}

/* --- places */

/* One side's part of a row. What another chart covers and is hardly read goes to the texel that is read most.
 */
static bool put_side(const making *m, const lookup *found, const uint32_t chart[2], int side,
                     vshi_seam_row *row) {
    float weight[4];
    int most = 0;
    for (int k = 0; k < 4; ++k) {
        weight[k] = (float)found->weight[k] * 0x1p-24f;
        most = found->weight[k] > found->weight[most] ? k : most;
        row->unknown[4 * side + k] = UINT32_MAX;
    }
    for (int k = 0; k < 4; ++k) {
        const uint32_t unknown = found->weight[k] > 0 ? unknown_of(m, found->texel[k]) : UINT32_MAX;
        const uint32_t owner = unknown != UINT32_MAX ? m->system->chart[unknown] : VSHI_NO_CHART;
        row->unknown[4 * side + k] = unknown;
        if (owner != VSHI_NO_CHART && owner != chart[0] && owner != chart[1]) {
            if (weight[k] > UNREAD) {
                return false;
            }
            weight[most] += weight[k];
            weight[k] = 0.0f;
            row->unknown[4 * side + k] = UINT32_MAX;
        }
    }
    for (int k = 0; k < 4;
         ++k) { /* what is not read is read with a weight of 0, so that rows are all of a kind */
        if (row->unknown[4 * side + k] == UINT32_MAX) {
            row->unknown[4 * side + k] = row->unknown[4 * side + most];
            weight[k] = 0.0f;
        }
        row->weight[4 * side + k] = side == 0 ? weight[k] : -weight[k];
    }
    return true;
}

static vsh_result make_rows(making *m, vsh_error *error) {
    vshi_seam_system *system = m->system;
    for (uint32_t u = 0; u < system->unknown_count; ++u) {
        m->parent[u] = u;
    }
    for (size_t i = 0; i < m->seams->count; ++i) {
        if (i % POLL_SEAMS == 0 && vshi_job_advance(m->job, 0)) {
            return vshi_job_fail_cancelled(m->job, error);
        }
        const vshi_seam *seam = &m->seams->list[i];
        float share;
        const size_t places = places_of(seam, &share);
        for (size_t p = 0; p < places; ++p) {
            const lookup a = look_up(m, seam, 0, p, places), b = look_up(m, seam, 1, p, places);
            vshi_seam_row *row = &m->unsorted[system->row_count];
            if (!put_side(m, &a, seam->chart, 0, row) || !put_side(m, &b, seam->chart, 1, row)) {
                ++system->crowded;
                continue;
            }
            /* ends are those of the next edge too */
            row->share = places > 1 && (p == 0 || p + 1 == places) ? 0.5f * share : share;
            system->shares += (double)row->share;
            for (int k = 1; k < VSHI_SEAM_READS; ++k) {
                vshi_set_join(m->parent, row->unknown[0], row->unknown[k]);
            }
            ++system->row_count;
        }
    }
    return VSH_OK;
}

/* --- islands */

/* Begins of groups from how many each has, by the number of a group: counts[g + 1] is of group g. */
static void add_up(uint32_t *counts, size_t groups) {
    for (size_t g = 0; g < groups; ++g) {
        counts[g + 1] += counts[g];
    }
}

/* Numbers islands in the order of their first texels, and their unknowns and rows one after the other. */
static vsh_result sort_islands(making *m, vsh_error *error) {
    vshi_seam_system *s = m->system;
    const char *what = "seams";
    for (uint32_t u = 0; u < s->unknown_count; ++u) {
        m->number[u] = vshi_set_of(m->parent, u);
    }
    for (uint32_t u = 0; u < s->unknown_count; ++u) { /* a root is the first of its island */
        m->parent[u] = m->number[u] == u ? (uint32_t)s->island_count++ : m->parent[m->number[u]];
    }
    VSHI_TRY(vshi_allocate((void **)&s->first_unknown, s->island_count + 2, sizeof *s->first_unknown, what,
                           error));
    VSHI_TRY(vshi_allocate((void **)&s->first_row, s->island_count + 2, sizeof *s->first_row, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->rows, s->row_count, sizeof *s->rows, what, error));
    uint32_t *unknowns = s->first_unknown + 1,
             *rows = s->first_row + 1; /* moved on to their ends as they fill */
    for (size_t u = 0; u < s->unknown_count; ++u) {
        ++unknowns[m->parent[u] + 1];
    }
    for (size_t r = 0; r < s->row_count; ++r) {
        ++rows[m->parent[m->unsorted[r].unknown[0]] + 1];
    }
    add_up(unknowns, s->island_count);
    add_up(rows, s->island_count);
    for (size_t u = 0; u < s->unknown_count; ++u) {
        m->number[u] = unknowns[m->parent[u]]++;
    }
    for (size_t r = 0; r < s->row_count; ++r) {
        const vshi_seam_row *from = &m->unsorted[r];
        vshi_seam_row *to = &s->rows[rows[m->parent[from->unknown[0]]]++];
        *to = *from;
        for (int k = 0; k < VSHI_SEAM_READS; ++k) {
            to->unknown[k] = m->number[from->unknown[k]];
        }
    }
    return VSH_OK;
}

/* Texels, charts and pages into the order of the islands. */
static vsh_result sort_unknowns(making *m, vsh_error *error) {
    vshi_seam_system *s = m->system;
    uint64_t *texel = NULL;
    if (s->unknown_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_allocate((void **)&texel, s->unknown_count, sizeof *texel, "seams", error));
    for (size_t u = 0; u < s->unknown_count; ++u) {
        texel[m->number[u]] = s->texel[u];
        m->parent[m->number[u]] = s->chart[u];
    }
    memcpy(s->chart, m->parent, s->unknown_count * sizeof *s->chart);
    for (size_t u = 0; u < s->unknown_count; ++u) {
        m->parent[m->number[u]] = s->page[u];
    }
    memcpy(s->page, m->parent, s->unknown_count * sizeof *s->page);
    free(s->texel);
    s->texel = texel;
    return VSH_OK;
}

static double most_tile_bytes(const making *m, int32_t threads) {
    double most = 0.0;
    for (size_t page = 0; page < m->pages->count; ++page) {
        most = fmax(most, vshi_tile_bytes(m->pages->charts[page], threads));
    }
    return most;
}

static vsh_result make(making *m, const vsh_run *run, vsh_error *error) {
    const char *what = "seams";
    vshi_seam_system *s = m->system;
    const uint64_t texels = m->pages->texel[m->pages->count];
    m->words = (size_t)((texels + 63) / 64);
    double bytes = m->seams->bytes + (double)m->words * (sizeof *m->marks + sizeof *m->rank);
    size_t places;
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    VSHI_TRY(vshi_allocate((void **)&m->marks, m->words, sizeof *m->marks, what, error));
    VSHI_TRY(vshi_allocate((void **)&m->rank, m->words, sizeof *m->rank, what, error));
    VSHI_TRY(mark(m, &places, error));
    const double each = 2 * sizeof *s->texel + 2 * sizeof *s->chart + sizeof *m->parent + sizeof *m->number +
                        2 * sizeof *s->first_row;
    bytes += (double)s->unknown_count * each + 2.0 * (double)places * sizeof *s->rows +
             most_tile_bytes(m, run->threads);
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->texel, s->unknown_count, sizeof *s->texel, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->chart, s->unknown_count, sizeof *s->chart, what, error));
    VSHI_TRY(vshi_allocate((void **)&s->page, s->unknown_count, sizeof *s->page, what, error));
    VSHI_TRY(vshi_allocate((void **)&m->parent, s->unknown_count, sizeof *m->parent, what, error));
    VSHI_TRY(vshi_allocate((void **)&m->number, s->unknown_count, sizeof *m->number, what, error));
    VSHI_TRY(vshi_allocate((void **)&m->unsorted, places, sizeof *m->unsorted, what, error));
    for (m->page = 0; m->page < m->pages->count; ++m->page) {
        place_unknowns(m);
        VSHI_TRY(vshi_parallel_each(m->job, vshi_charts_tiles(m->pages->charts[m->page]), 1, 0, find_owners,
                                    m, error));
    }
    VSHI_TRY(make_rows(m, error));
    VSHI_TRY(sort_islands(m, error));
    VSHI_TRY(sort_unknowns(m, error));
    s->bytes = m->seams->bytes + (double)s->unknown_count * (sizeof *s->texel + 2 * sizeof *s->chart) +
               (double)s->row_count * sizeof *s->rows + 2.0 * (double)s->island_count * sizeof *s->first_row;
    return VSH_OK;
}

vsh_result vshi_seam_system_make(const vshi_seam_pages *pages, const vshi_seams *seams, const vsh_run *run,
                                 vshi_job *job, vshi_seam_system *system, vsh_error *error) {
    *system = (vshi_seam_system){.unknown_count = 0};
    making m = {.pages = pages, .seams = seams, .job = job, .system = system};
    const vsh_result result = make(&m, run, error);
    free(m.unsorted);
    free(m.number);
    free(m.parent);
    free(m.rank);
    free(m.marks);
    return result;
}

void vshi_seam_system_free(vshi_seam_system *system) {
    free(system->first_row);
    free(system->first_unknown);
    free(system->rows);
    free(system->chart);
    free(system->page);
    free(system->texel);
    *system = (vshi_seam_system){.unknown_count = 0};
}
