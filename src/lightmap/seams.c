/* Lightmaps without seams (Iwanicki, "Lighting technology of The Last of Us", 2013). */
#include "lightmap/seams.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "geometry/edges.h"
#include "lightmap/planes.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- the texels that seams read
 *
 * A bitmap of the image marks them, and its set bits are counted to number them. Tiles with marks tell the
 * chart of each texel. Places that would read a third chart are left out. The rest falls into islands that
 * have no texel in common. */

enum { READS = 8 }; /* texels: four on each side */

/* A place on a seam. Σ weight × texel is the difference between the bilinear lookups on both sides. Weights
 * are multiples of 2^-24 with the sum 0, so equal texels give exactly 0. `share` weighs the squared
 * difference by its length of border, in half texels, so that short edges count like long ones. */
typedef struct seam_row {
    uint32_t unknown[READS];
    float weight[READS];
    float share;
} seam_row;

/* The texels that seams read are the unknowns, numbered island by island. No row reads texels of two islands.
 */
typedef struct seam_system {
    size_t unknown_count;
    uint64_t *texel; /* [unknown_count]: y × width + x in its page; later its place in the planes */
    uint32_t *page;  /* [unknown_count] */
    uint32_t *chart; /* [unknown_count]: the chart that covers it; NO_CHART: none */
    size_t row_count;
    seam_row *rows; /* [row_count], island by island */
    double shares;  /* of all rows */
    size_t island_count;
    uint32_t *first_unknown; /* these two [island_count + 1] */
    uint32_t *first_row;
    uint64_t crowded; /* places left out because a third chart would be read there */
    double bytes;
} seam_system;

#define NO_CHART UINT32_MAX

static const double STEP = 0.5; /* texels, on the side where a seam is longer */

/* Steps of a lookup's place between texels: finer than filtering units (1/256), and products of two have the
 * 24 bits of a float. */
enum { STEPS_OF_TEXEL = 4096 };

/* Filtering units round a smaller weight to nothing, so its texel is not read. */
static const float UNREAD = 1.0f / 512.0f;

enum { POLL_SEAMS = 4096 };

typedef struct making {
    const vshi_seam_pages *pages;
    const vshi_seams *seams;
    vshi_job *job;
    seam_system *system;
    uint64_t *marks; /* [words]: of texels, in the order of the image */
    uint32_t *rank;  /* [words]: texels marked before a word */
    size_t words;
    uint32_t *parent;   /* [unknowns]: union-find, then the island */
    uint32_t *number;   /* [unknowns]: island by island */
    seam_row *unsorted; /* [places] */
    size_t page;        /* the current one of a pass that finds owners */
} making;

/* Texels that a lookup reads, and their weights in 2^-24. */
typedef struct lookup {
    uint64_t texel[4];
    uint32_t weight[4];
} lookup;

/* The number of places of a seam; *share of each. */
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

/* Finds the two texels along an axis, clamped at edges, and the place between their centres, 0 …
 * STEPS_OF_TEXEL. */
static uint32_t along(double at, int32_t size, int64_t texel[2]) {
    const double steps = floor((at - 0.5) * STEPS_OF_TEXEL + 0.5);
    const double whole = floor(steps / STEPS_OF_TEXEL);
    for (int k = 0; k < 2; ++k) {
        const int64_t i = (int64_t)whole + k;
        texel[k] = i < 0 ? 0 : i >= size ? size - 1 : i;
    }
    return (uint32_t)(steps - whole * STEPS_OF_TEXEL);
}

/* Finds the lookup at place `place` of `places`, from end to end. A single place lies in the middle. */
static lookup find_lookup(const making *m, const vshi_seam *seam, int side, size_t place, size_t places) {
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
        VSHI_TRY(i % POLL_SEAMS == 0 ? vshi_job_step(m->job, 0, error) : VSH_OK);
        const vshi_seam *seam = &m->seams->list[i];
        float share;
        const size_t own = places_of(seam, &share);
        *places += own;
        for (size_t k = 0; k < 2 * own; ++k) {
            const lookup found = find_lookup(m, seam, k % 2, k / 2, own);
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

/* The chart of a texel of the tile's cell: that of its first sample, as in the bake. */
static uint32_t owner_of(const making *m, const vshi_tile *tile, size_t bit) {
    const uint32_t owner = vshi_tile_owner(m->pages->charts[m->page], tile, bit);
    if (owner == 0) {
        return NO_CHART;
    }
    const size_t first =
        m->pages->first[m->page] + m->pages->charts[m->page]->first[tile->triangle[owner - 1].mesh];
    return m->seams->chart[first + tile->triangle[owner - 1].local];
}

/* Finds the charts of a tile's marked texels. */
static vsh_result find_owners(void *user, size_t number, vsh_error *error) {
    const making *m = user;
    const vshi_charts *charts = m->pages->charts[m->page];
    const uint64_t first = m->pages->texel[m->page], width = (uint64_t)charts->raster.width;
    vshi_tile tile;
    const vsh_result result = vshi_tile_open(charts, number, &tile, error);
    for (int32_t k = 0; result == VSH_OK && k < VSHI_TILE_CELLS * VSHI_TILE_CELLS; ++k) {
        if (!vshi_tile_rasterize(charts, &tile, k % VSHI_TILE_CELLS, k / VSHI_TILE_CELLS, NULL)) {
            continue;
        }
        for (size_t bit = 0; bit < VSHI_CELL * VSHI_CELL; ++bit) {
            const size_t x = tile.cell.column * VSHI_CELL + bit % VSHI_CELL,
                         y = tile.cell.row * VSHI_CELL + bit / VSHI_CELL;
            if ((tile.cell.inside >> bit & 1) != 0 && is_marked(m, first + y * width + x)) {
                m->system->chart[unknown_of(m, first + y * width + x)] = owner_of(m, &tile, bit);
            }
        }
    }
    vshi_tile_close(&tile);
    return result;
}

/* Sets the texels of the unknowns, without charts. */
static void place_unknowns(const making *m) {
    const uint64_t first = m->pages->texel[m->page], end = m->pages->texel[m->page + 1];
    for (uint64_t word = first / 64; word < (end + 63) / 64; ++word) {
        for (uint64_t bits = m->marks[word]; bits != 0; bits &= bits - 1) {
            const uint64_t texel = 64 * word + (uint64_t)__builtin_ctzll(bits);
            if (texel >= first && texel < end) {
                const uint32_t unknown = unknown_of(m, texel);
                m->system->texel[unknown] = texel - first;
                m->system->page[unknown] = (uint32_t)m->page;
                m->system->chart[unknown] = NO_CHART;
            }
        }
    }
}

/* --- places */

/* Sets one side of a row. The weight of a texel that another chart covers, if it is hardly read, goes to the
 * texel with the most weight. */
static bool set_side(const making *m, const lookup *found, const uint32_t chart[2], int side, seam_row *row) {
    float weight[4];
    int most = 0;
    for (int k = 0; k < 4; ++k) {
        weight[k] = (float)found->weight[k] * 0x1p-24f;
        most = found->weight[k] > found->weight[most] ? k : most;
        row->unknown[4 * side + k] = UINT32_MAX;
    }
    for (int k = 0; k < 4; ++k) {
        const uint32_t unknown = found->weight[k] > 0 ? unknown_of(m, found->texel[k]) : UINT32_MAX;
        const uint32_t owner = unknown != UINT32_MAX ? m->system->chart[unknown] : NO_CHART;
        row->unknown[4 * side + k] = unknown;
        if (owner != NO_CHART && owner != chart[0] && owner != chart[1]) {
            if (weight[k] > UNREAD) {
                return false;
            }
            weight[most] += weight[k];
            weight[k] = 0.0f;
            row->unknown[4 * side + k] = UINT32_MAX;
        }
    }
    for (int k = 0; k < 4; ++k) { /* unread texels get a weight of 0, so that all rows are alike */
        if (row->unknown[4 * side + k] == UINT32_MAX) {
            row->unknown[4 * side + k] = row->unknown[4 * side + most];
            weight[k] = 0.0f;
        }
        row->weight[4 * side + k] = side == 0 ? weight[k] : -weight[k];
    }
    return true;
}

static vsh_result make_rows(making *m, vsh_error *error) {
    seam_system *system = m->system;
    for (uint32_t u = 0; u < system->unknown_count; ++u) {
        m->parent[u] = u;
    }
    for (size_t i = 0; i < m->seams->count; ++i) {
        VSHI_TRY(i % POLL_SEAMS == 0 ? vshi_job_step(m->job, 0, error) : VSH_OK);
        const vshi_seam *seam = &m->seams->list[i];
        float share;
        const size_t places = places_of(seam, &share);
        for (size_t p = 0; p < places; ++p) {
            const lookup a = find_lookup(m, seam, 0, p, places), b = find_lookup(m, seam, 1, p, places);
            seam_row *row = &m->unsorted[system->row_count];
            if (!set_side(m, &a, seam->chart, 0, row) || !set_side(m, &b, seam->chart, 1, row)) {
                ++system->crowded;
                continue;
            }
            /* the next edge has these ends, too */
            row->share = places > 1 && (p == 0 || p + 1 == places) ? 0.5f * share : share;
            system->shares += (double)row->share;
            for (int k = 1; k < READS; ++k) {
                vshi_set_join(m->parent, row->unknown[0], row->unknown[k]);
            }
            ++system->row_count;
        }
    }
    return VSH_OK;
}

/* --- islands */

/* Turns counts into the first places of groups: counts[g + 1] is the count of group g. */
static void add_up(uint32_t *counts, size_t groups) {
    for (size_t g = 0; g < groups; ++g) {
        counts[g + 1] += counts[g];
    }
}

/* Numbers islands in the order of their first texels, and their unknowns and rows in sequence. */
static vsh_result sort_islands(making *m, vsh_error *error) {
    seam_system *s = m->system;
    for (uint32_t u = 0; u < s->unknown_count; ++u) {
        m->number[u] = vshi_set_of(m->parent, u);
    }
    for (uint32_t u = 0; u < s->unknown_count; ++u) { /* a root is the first of its island */
        m->parent[u] = m->number[u] == u ? (uint32_t)s->island_count++ : m->parent[m->number[u]];
    }
    const vshi_array arrays[] = {VSHI_ARRAY(s->first_unknown, s->island_count + 2),
                                 VSHI_ARRAY(s->first_row, s->island_count + 2),
                                 VSHI_ARRAY(s->rows, s->row_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "seams", error));
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
        const seam_row *from = &m->unsorted[r];
        seam_row *to = &s->rows[rows[m->parent[from->unknown[0]]]++];
        *to = *from;
        for (int k = 0; k < READS; ++k) {
            to->unknown[k] = m->number[from->unknown[k]];
        }
    }
    return VSH_OK;
}

/* Sorts texels, charts and pages by islands. */
static vsh_result sort_unknowns(making *m, vsh_error *error) {
    seam_system *s = m->system;
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

/* Makes the system of all seams, in steps of half a texel. Errors: VSH_ERROR_LIMIT (run->memory_limit; 2^32
 * places), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
static vsh_result make_system(making *m, const vsh_run *run, vsh_error *error) {
    const char *what = "seams";
    seam_system *s = m->system;
    const uint64_t texels = m->pages->texel[m->pages->count];
    m->words = (size_t)((texels + 63) / 64);
    double tile = 0.0, bytes = m->seams->bytes + (double)m->words * (sizeof *m->marks + sizeof *m->rank);
    size_t places;
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    const vshi_array bits[] = {VSHI_ARRAY(m->marks, m->words), VSHI_ARRAY(m->rank, m->words)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(bits, what, error));
    VSHI_TRY(mark(m, &places, error));
    for (size_t page = 0; page < m->pages->count; ++page) {
        tile = fmax(tile, vshi_tile_bytes(m->pages->charts[page], run->threads));
    }
    const double each = 2 * sizeof *s->texel + 2 * sizeof *s->chart + sizeof *m->parent + sizeof *m->number +
                        2 * sizeof *s->first_row;
    bytes += (double)s->unknown_count * each + 2.0 * (double)places * sizeof *s->rows + tile;
    VSHI_TRY(vshi_check_limit(run, bytes, what, error));
    const size_t count = s->unknown_count;
    const vshi_array arrays[] = {
        VSHI_ARRAY(s->texel, count),  VSHI_ARRAY(s->chart, count),  VSHI_ARRAY(s->page, count),
        VSHI_ARRAY(m->parent, count), VSHI_ARRAY(m->number, count), VSHI_ARRAY(m->unsorted, places),
    };
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
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

static void free_making(making *m) {
    free(m->unsorted);
    free(m->number);
    free(m->parent);
    free(m->rank);
    free(m->marks);
    *m = (making){.words = 0};
}

/* --- least squares over the rows, with limits on each unknown
 *
 * Accelerated projected gradient: Beck and Teboulle, "A fast iterative shrinkage-thresholding algorithm for
 * linear inverse problems", 2009. It restarts if it overshoots: O'Donoghue and Candès, "Adaptive restart for
 * accelerated gradient schemes", 2015. */

/* The projected gradient of a solution, relative to the gradient of no change. Changes are then known to some
 * 1/1000 of the largest. */
static const double TOLERANCE = 1e-5;

/* An island's unknowns in one channel: the changes of texels that minimise the differences at seams. */
typedef struct seam_problem {
    const seam_row *rows;
    size_t row_count, unknown_count;
    uint32_t first;         /* number of its first unknown in the rows */
    const double *low;      /* [unknown_count]: ≤ 0, the least change of each */
    const double *high;     /* ≥ 0 */
    const double *keep;     /* > 0: the cost of a squared change */
    const double *gradient; /* at no change */
    double *change;         /* found */
    double *work;           /* [WORK × unknown_count] */
    vshi_job *job;          /* checked for cancelling */
} seam_problem;

enum { WORK = 2 }; /* vectors */

enum { MOST_STEPS = 1000 }; /* some 200 are taken */

/* Computes the gradient of ½ Σ share (row · values)². */
static void find_gradient(const seam_problem *p, const double *values, double *gradient) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        gradient[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const seam_row *row = &p->rows[r];
        double difference = 0.0;
        for (int k = 0; k < READS; ++k) {
            difference += (double)row->weight[k] * values[row->unknown[k] - p->first];
        }
        difference *= (double)row->share;
        for (int k = 0; k < READS; ++k) {
            gradient[row->unknown[k] - p->first] += (double)row->weight[k] * difference;
        }
    }
}

/* An upper bound of the curvature: the largest sum of a column times that of a row, which is at most 2. */
static double largest_curvature(const seam_problem *p, double *column) {
    double most = 0.0;
    for (size_t u = 0; u < p->unknown_count; ++u) {
        column[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const seam_row *row = &p->rows[r];
        for (int k = 0; k < READS; ++k) {
            column[row->unknown[k] - p->first] += (double)row->share * fabs((double)row->weight[k]);
        }
    }
    for (size_t u = 0; u < p->unknown_count; ++u) {
        most = fmax(most, 2.0 * column[u] + p->keep[u]);
    }
    return most;
}

/* Minimises ½ Σ share (row · (value + change))² + ½ Σ keep change² within low … high. All machines give the
 * same bits. */
static void solve(const seam_problem *p) {
    const size_t count = p->unknown_count;
    double *gradient = p->work, *ahead = gradient + count; /* where the gradient is taken */
    const double step = 1.0 / largest_curvature(p, gradient);
    double enough = 0.0, pace = 1.0;
    for (size_t u = 0; u < count; ++u) {
        p->change[u] = ahead[u] = 0.0;
        enough += p->gradient[u] * p->gradient[u];
    }
    enough *= TOLERANCE * TOLERANCE * step * step;
    for (int i = 0; i < MOST_STEPS && !vshi_job_advance(p->job, 0); ++i) {
        double moved = 0.0, back = 0.0;
        find_gradient(p, ahead, gradient);
        for (size_t u = 0; u < count; ++u) { /* the next change, for now in `gradient` */
            const double slope = p->gradient[u] + gradient[u] + p->keep[u] * ahead[u];
            gradient[u] = fmin(fmax(ahead[u] - step * slope, p->low[u]), p->high[u]);
            const double by = gradient[u] - ahead[u];
            moved += by * by;
            back -= by * (gradient[u] - p->change[u]);
        }
        const double next = back > 0.0 ? 1.0 : 0.5 + sqrt(0.25 + pace * pace);
        const double momentum = back > 0.0 ? 0.0 : (pace - 1.0) / next;
        pace = next;
        for (size_t u = 0; u < count; ++u) {
            ahead[u] = gradient[u] + momentum * (gradient[u] - p->change[u]);
            p->change[u] = gradient[u];
        }
        if (moved <= enough) {
            break;
        }
    }
}

/* --- islands and channels */

/* The cost of a change to a texel without a value of its own, relative to others. It gives way first, but
 * does not run away where it is hardly read. */
static const double GUESS = 0.1;

enum { VECTORS = 5 + WORK }; /* low, high, keep, gradient, change */

/* Sums over an island's rows. */
typedef struct island {
    double before, after; /* squares of differences */
    double largest;       /* value */
} island;

/* A channel: one component of a plane of each page. */
typedef struct channel {
    float **values; /* [page_count]: of its first texel */
    size_t stride;
    int range;
    double *vectors; /* [VECTORS × unknown_count] */
    island *islands; /* [island_count] */
} channel;

typedef struct stitching {
    seam_system system;
    const vsh_stitch_options *options;
    const vsh_stitch_page *pages; /* [page_count] */
    size_t page_count;
    channel *channels; /* [channel_count] */
    float **values;    /* [channel_count × page_count]: theirs */
    size_t channel_count;
    size_t begin, batch; /* channels at work */
    double *vectors;     /* [batch × VECTORS × unknown_count] */
    island *islands;     /* [batch × island_count] */
    vshi_job *job;
    double square_before, square_after; /* over all finished channels */
} stitching;

static float *value_of(const stitching *s, const channel *c, size_t unknown) {
    return c->values[s->system.page[unknown]] + s->system.texel[unknown] * c->stride;
}

static bool is_guess(const stitching *s, size_t unknown) {
    const float *coverage = s->pages[s->system.page[unknown]].lightmap->coverage;
    return coverage != NULL ? coverage[s->system.texel[unknown]] == 0.0f
                            : s->system.chart[unknown] == NO_CHART;
}

/* The largest value that is read together with each unknown. */
static void find_largest(const seam_problem *p, const double *values, double *largest) {
    for (size_t u = 0; u < p->unknown_count; ++u) {
        largest[u] = 0.0;
    }
    for (size_t r = 0; r < p->row_count; ++r) {
        const uint32_t *unknown = p->rows[r].unknown;
        double most = 0.0;
        for (int k = 0; k < READS; ++k) {
            most = fmax(most, values[unknown[k] - p->first]);
        }
        for (int k = 0; k < READS; ++k) {
            largest[unknown[k] - p->first] = fmax(largest[unknown[k] - p->first], most);
        }
    }
}

/* Limits the change of an unknown. */
static void set_limits(const stitching *s, const channel *c, size_t unknown, double value, double largest,
                       double *low, double *high) {
    const double top = c->range == VSHI_RANGE_SHARE ? 1.0 : fmax(largest, value);
    double change = s->options->max_change * top;
    if (is_guess(s, unknown)) {
        change = top;
    }
    *low = fmin(fmax(-change, -value), 0.0);
    *high = c->range == VSHI_RANGE_SHARE ? fmax(fmin(change, 1.0 - value), 0.0) : change;
}

/* Adds the change. A rounding beyond the limit goes back towards the old value. */
static float moved(float value, double change, double low, double high) {
    float to = (float)((double)value + change);
    if ((double)to - (double)value > high || (double)to - (double)value < low) {
        to = nextafterf(to, value);
    }
    return to;
}

static double square_of(const seam_problem *p, const double *values) {
    double sum = 0.0;
    for (size_t r = 0; r < p->row_count; ++r) {
        double difference = 0.0;
        for (int k = 0; k < READS; ++k) {
            difference += (double)p->rows[r].weight[k] * values[p->rows[r].unknown[k] - p->first];
        }
        sum += (double)p->rows[r].share * difference * difference;
    }
    return sum;
}

/* Stitches one island in one channel. Values that are not finite, and all texels read with them, stay. */
static void stitch_island(const stitching *s, const channel *c, size_t i) {
    const seam_system *system = &s->system;
    const size_t first = system->first_unknown[i], count = system->first_unknown[i + 1] - first;
    const size_t all = system->unknown_count;
    double *low = c->vectors + first, *high = low + all, *keep = high + all, *gradient = keep + all,
           *values = gradient + all;
    seam_problem p = {.rows = system->rows + system->first_row[i],
                      .row_count = system->first_row[i + 1] - system->first_row[i],
                      .unknown_count = count,
                      .first = (uint32_t)first,
                      .low = low,
                      .high = high,
                      .keep = keep,
                      .gradient = gradient,
                      .change = values,
                      .work = c->vectors + (VECTORS - WORK) * all + WORK * first,
                      .job = s->job};
    island *sums = &c->islands[i];
    *sums = (island){0.0, 0.0, 0.0};
    bool finite = true;
    for (size_t u = 0; u < count; ++u) {
        values[u] = (double)*value_of(s, c, first + u);
        finite = finite && isfinite(values[u]);
    }
    if (!finite || p.row_count == 0) {
        return;
    }
    find_largest(&p, values, p.work);
    for (size_t u = 0; u < count; ++u) {
        sums->largest = fmax(sums->largest, values[u]);
        set_limits(s, c, first + u, values[u], p.work[u], &low[u], &high[u]);
        keep[u] = s->options->keep * (is_guess(s, first + u) ? GUESS : 1.0);
    }
    sums->before = square_of(&p, values);
    find_gradient(&p, values, gradient);
    solve(&p);
    for (size_t u = 0; u < count; ++u) {
        float *value = value_of(s, c, first + u);
        *value = moved(*value, p.change[u], low[u], high[u]);
        p.work[u] = (double)*value;
    }
    sums->after = square_of(&p, p.work);
}

static void stitch_islands(void *user, size_t begin, size_t end) {
    const stitching *s = user;
    for (size_t i = begin; i < end; ++i) {
        stitch_island(s, &s->channels[s->begin + i % s->batch], i / s->batch);
    }
}

/* Adds in the order of the islands. Light counts relative to the largest value. */
static void add_sums(stitching *s, const channel *c) {
    double before = 0.0, after = 0.0, largest = 0.0;
    for (size_t i = 0; i < s->system.island_count; ++i) {
        before += c->islands[i].before;
        after += c->islands[i].after;
        largest = fmax(largest, c->islands[i].largest);
    }
    const double scale = c->range == VSHI_RANGE_SHARE ? 1.0 : largest > 0.0 ? largest * largest : 1.0;
    s->square_before += before / scale;
    s->square_after += after / scale;
}

/* Stitches a few channels at a time, one for each thread: charts that meet at corners make few islands. */
static vsh_result stitch_channels(stitching *s, const vsh_run *run, vsh_error *error) {
    const seam_system *system = &s->system;
    const int32_t threads = vshi_job_threads(s->job);
    const size_t most = threads > 0 ? (size_t)threads : s->channel_count;
    const size_t room = s->channel_count < most ? s->channel_count : most;
    const double bytes = (double)room * ((double)system->unknown_count * VECTORS * sizeof(double) +
                                         (double)system->island_count * sizeof(island));
    VSHI_TRY(vshi_check_limit(run, system->bytes + bytes, "seams", error));
    /* one more of each, because there may be none */
    VSHI_TRY(vshi_allocate((void **)&s->vectors, room * VECTORS, (system->unknown_count + 1) * sizeof(double),
                           "seams", error));
    VSHI_TRY(vshi_allocate((void **)&s->islands, room * (system->island_count + 1), sizeof(island), "seams",
                           error));
    for (s->begin = 0; s->begin < s->channel_count; s->begin += s->batch) {
        const size_t left = s->channel_count - s->begin;
        s->batch = left < room ? left : room;
        for (size_t k = 0; k < s->batch; ++k) {
            s->channels[s->begin + k].vectors = s->vectors + k * VECTORS * system->unknown_count;
            s->channels[s->begin + k].islands = s->islands + k * system->island_count;
        }
        VSHI_TRY(vshi_parallel_for(s->job, s->batch * system->island_count, 1, 0, stitch_islands, s, error));
        for (size_t k = 0; k < s->batch; ++k) {
            add_sums(s, &s->channels[s->begin + k]);
        }
        VSHI_TRY(vshi_job_step(s->job, s->batch, error));
    }
    return VSH_OK;
}

/* Counts the stitched channels, or (`list`) adds the part of page `page` to them. */
static size_t list_channels(const vsh_lightmap *lightmap, size_t light_count, channel *list, size_t page) {
    size_t count = 0;
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(lightmap, light_count, &c);) {
        const size_t components = c.kind->range != VSHI_RANGE_NONE ? vshi_plane_components(c.kind) : 0;
        for (size_t k = 0; k < components; ++k, ++count) {
            if (list != NULL) {
                list[count].values[page] = c.values + k;
                list[count].stride = components;
                list[count].range = c.kind->range;
            }
        }
    }
    return count;
}

static vsh_result make_channels(stitching *s, size_t light_count, vsh_error *error) {
    const vshi_array arrays[] = {VSHI_ARRAY(s->channels, s->channel_count),
                                 VSHI_ARRAY(s->values, s->channel_count * s->page_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "seams", error));
    for (size_t c = 0; c < s->channel_count; ++c) {
        s->channels[c].values = s->values + c * s->page_count;
    }
    for (size_t page = 0; page < s->page_count; ++page) {
        list_channels(s->pages[page].lightmap, light_count, s->channels, page);
    }
    return VSH_OK;
}

static vsh_result make_pages(const stitching *s, vshi_seam_pages *pages, vsh_error *error) {
    const size_t count = s->page_count;
    pages->count = count;
    const vshi_array arrays[] = {VSHI_ARRAY(pages->charts, count), VSHI_ARRAY(pages->first, count + 1),
                                 VSHI_ARRAY(pages->texel, count + 1)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "seams", error));
    for (size_t page = 0; page < count; ++page) {
        const vshi_charts *charts = &s->pages[page].charts->sorted;
        pages->charts[page] = charts;
        pages->first[page + 1] = pages->first[page] + charts->first[charts->mesh_count];
        pages->texel[page + 1] =
            pages->texel[page] + (uint64_t)charts->raster.width * (uint64_t)charts->raster.height;
    }
    return VSH_OK;
}

static vsh_result stitch(stitching *s, size_t light_count, const vsh_run *run, vsh_stitch_report *report,
                         vsh_error *error) {
    static const double RADIANS = 3.14159265358979323846 / 180.0;
    vshi_seams seams = {NULL, NULL, 0, 0.0};
    vshi_seam_pages pages = {NULL, 0, NULL, NULL};
    seam_system *system = &s->system;
    making m = {.pages = &pages, .seams = &seams, .job = s->job, .system = system};
    vsh_result result;
    VSHI_TRY_DONE(make_channels(s, light_count, error));
    VSHI_TRY_DONE(make_pages(s, &pages, error));
    VSHI_TRY_DONE(
        vshi_seams_find(&pages, vshi_cos(s->options->max_angle * RADIANS), run, s->job, &seams, error));
    VSHI_TRY_DONE(make_system(&m, run, error));
    for (size_t u = 0; u < system->unknown_count; ++u) {
        const vsh_stitch_page *page = &s->pages[system->page[u]];
        system->texel[u] =
            vshi_plane_place(page->lightmap, (size_t)page->charts->info.width, system->texel[u]);
    }
    report->seams = seams.count;
    report->places = system->row_count;
    report->crowded = system->crowded;
    report->texels = system->unknown_count;
    vshi_seams_free(&seams);
    free_making(&m);
    VSHI_TRY_DONE(vshi_job_step(s->job, 1, error));
    VSHI_TRY_DONE(stitch_channels(s, run, error));
    const double all = (double)s->channel_count * system->shares;
    report->before = all > 0.0 ? sqrt(s->square_before / all) : 0.0;
    report->after = all > 0.0 ? sqrt(s->square_after / all) : 0.0;
done:
    free(s->islands);
    free(s->vectors);
    free(s->channels); /* the block's first array */
    free_making(&m);
    free(system->first_unknown); /* the block's first array */
    free(system->chart);
    free(system->page);
    free(system->texel);
    vshi_seams_free(&seams);
    free(pages.charts); /* the block's first array */
    return result;
}

static vsh_result check_pages(stitching *s, size_t light_count, vsh_run *run, vsh_error *error) {
    for (size_t page = 0; page < s->page_count; ++page) {
        const vsh_stitch_page *given = &s->pages[page];
        VSHI_NEEDS(given->charts);
        VSHI_NEEDS(given->lightmap);
        VSHI_TRY(vshi_plane_row_check(given->lightmap, given->charts->info.width, error));
        const size_t count = list_channels(given->lightmap, light_count, NULL, page);
        if (page > 0 && count != s->channel_count) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "vsh_stitch_page %zu: %zu channels, where the first page has %zu", page, count,
                             s->channel_count);
        }
        s->channel_count = count;
        run->memory_held += given->charts->info.bytes;
    }
    return VSH_OK;
}

vsh_result vsh_lightmaps_stitch(const vsh_stitch_page *pages, size_t page_count, size_t light_count,
                                const vsh_stitch_options *options, const vsh_run *run,
                                vsh_stitch_report *report, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_OF(page_count, pages);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_stitch_options own = vsh_stitch_options_default();
    VSHI_TRY(vshi_options_resolve(options, &own, sizeof own, "vsh_stitch_options", error));
    const vshi_range ranges[] = {
        {"vsh_stitch_options.max_change", own.max_change, 0.0, 1.0},
        {"vsh_stitch_options.max_angle", own.max_angle, 0.0, 180.0},
        {"vsh_stitch_options.keep", own.keep, 1e-6, 1.0},
    };
    VSHI_TRY(vshi_check_ranges(ranges, sizeof ranges / sizeof *ranges, error));
    stitching s = {.options = &own, .pages = pages, .page_count = page_count};
    VSHI_TRY(check_pages(&s, light_count, &full, error));
    VSHI_TRY(vshi_job_open(&s.job, &full, "seams", s.channel_count + 1, "seams", error));
    vsh_stitch_report found = {0};
    const vsh_result result = stitch(&s, light_count, &full, &found, error);
    vshi_job_end(s.job);
    if (result == VSH_OK && report != NULL) {
        *report = found;
    }
    return result;
}
