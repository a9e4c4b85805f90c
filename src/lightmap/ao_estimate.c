/* AO of texels that share rays: keeps their shots, estimates each texel from its own and its neighbours'
 * shots, and stores the values in planes. */
#include "lightmap/page.h"
#include "lightmap/planes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- shots */

/* The plane of a texel's window (slopes for each texel of the page), and its error. */
typedef struct ao_plane {
    float slope[2], deviation, curved;
} ao_plane;

double vshi_shots_bytes(const vsh_lightmap *planes, bool ao, bool sky) {
    const double shots = sizeof(float) + sizeof(int32_t) + 1.0, place = 6.0 * sizeof(float);
    const double estimate = sizeof(ao_plane) + sizeof(float);
    const double bent = ao && planes->bent != NULL ? 10.0 * sizeof(float) : 0.0; /* and tangents */
    return (ao || sky ? place + estimate : 0.0) + (ao ? shots : 0.0) + (sky ? shots : 0.0) + bent;
}

void vshi_shots_list(vshi_shots *shots, vshi_array arrays[VSHI_SHOT_ARRAYS]) {
    const vshi_array list[VSHI_SHOT_ARRAYS] = {
        {(void **)&shots->own.ao, 1, sizeof(float)},
        {(void **)&shots->rays, 1, sizeof(int32_t)},
        {(void **)&shots->level, 1, sizeof(uint8_t)},
        {(void **)&shots->own.bent, 1, 3 * sizeof(float)},
    };
    memcpy(arrays, list, sizeof list);
}

vsh_result vshi_shots_open(vshi_page *page, vshi_shots *shots, vsh_error *error) {
    const bool bent = shots == &page->ao && page->lightmap.bent != NULL;
    vshi_array arrays[VSHI_SHOT_ARRAYS + 1];
    vshi_shots_list(shots, arrays);
    for (size_t i = 0; i < VSHI_SHOT_ARRAYS; ++i) {
        const bool wanted = bent || arrays[i].memory != (void **)&shots->own.bent;
        arrays[i].count = wanted ? vshi_page_texels(page) : 0;
    }
    arrays[VSHI_SHOT_ARRAYS] =
        (vshi_array)VSHI_ARRAY(shots->compared, vshi_charts_tiles(&page->charts->sorted));
    return vshi_page_take(page, arrays, VSHI_SHOT_ARRAYS + 1, "AO texels", error);
}

void vshi_shots_close(vshi_page *page, vshi_shots *shots) {
    vshi_array arrays[VSHI_SHOT_ARRAYS];
    for (size_t i = 0; shots->compared != NULL && i < vshi_charts_tiles(&page->charts->sorted); ++i) {
        free(shots->compared[i].list);
    }
    vshi_store_give(page->store, shots->compared);
    vshi_shots_list(shots, arrays);
    for (size_t i = 0; i < VSHI_SHOT_ARRAYS; ++i) {
        vshi_store_give(page->store, *arrays[i].memory);
    }
    *shots = (vshi_shots){.rays = NULL};
}

void vshi_shots_keep(const vshi_shots *shots, size_t place, size_t k, const vshi_ao_share *share,
                     const vshi_ao_values *values) {
    shots->level[place] = share->level[k];
    shots->rays[place] = share->rays[k];
    shots->own.ao[place] = values->ao[k];
    if (values->bent != NULL) {
        memcpy(shots->own.bent + 3 * place, values->bent + 3 * k, 3 * sizeof *values->bent);
    }
}

/* --- the estimate */

/* Cells of a lattice that are estimated together, with the cells around that their windows reach. */
enum { TILES = 8, INNER = TILES * VSHI_CELL, WIDTH = INNER + 2 * VSHI_CELL, TEXELS = WIDTH * WIDTH };
_Static_assert((int)VSHI_WINDOW_REACH <= (int)VSHI_CELL, "windows reach the next tile, no farther");

/* Sums over a row of cells: of squared errors and vshi_window_estimate's curved, in VSHI_SQUARE_UNIT. */
typedef struct row_sum {
    uint64_t square;
    int64_t curved;
    double worst;
    uint64_t rays, refined, invalid;
} row_sum;

typedef struct estimating {
    vshi_texel_map map;
    const vshi_shots *shots;
    const vsh_shade_options *shade;
    float *values, *bent;
    ao_plane *planes;
    int32_t isa;
    int32_t spacing; /* of the current lattice */
    row_sum *sums;   /* [rows of cells] */
} estimating;

/* Some cells of a lattice and those around them, as one rectangle of its texels. */
typedef struct block {
    vshi_texel_lattice lattice;
    size_t at[TEXELS]; /* places + 1 of texels that shot; 0: none */
    vshi_window_texel texels[TEXELS];
    vshi_window_sums sums[(WIDTH + 1) * (WIDTH + 1)];
    vshi_windows windows;
} block;

/* --- estimates of texels that shot */

static bool is_own(const estimating *s, size_t at) {
    return at > 0 && s->shots->rays[at - 1] > 0 && s->shots->level[at - 1] == s->spacing;
}

/* Lists the texels of a block. False if no texel needs an estimate. */
static bool find_texels(const estimating *s, block *b) {
    bool any = false;
    for (int32_t k = 0; k < TEXELS; ++k) {
        const int32_t x = k % WIDTH, y = k / WIDTH;
        b->at[k] = vshi_texel_at(&s->map, b->lattice.left + x * s->spacing, b->lattice.top + y * s->spacing);
        any = any || (x >= VSHI_CELL && x < VSHI_CELL + INNER && y >= VSHI_CELL && y < VSHI_CELL + INNER &&
                      is_own(s, b->at[k]));
    }
    return any;
}

static void lay_out(const estimating *s, block *b) {
    const int32_t sampler = vshi_ao_tile_sampler(s->shade->sampler);
    memset(b->texels, 0, sizeof b->texels);
    b->windows = (vshi_windows){WIDTH, WIDTH, b->texels, b->sums, s->isa};
    int32_t rays = 0;
    float spread = 0.0f;
    for (size_t k = 0; k < TEXELS; ++k) {
        const size_t i = b->at[k] - 1;
        if (b->at[k] == 0 || s->shots->rays[i] == 0 || /* or the value of a damaged part */
            !(s->shots->own.ao[i] >= 0.0f && s->shots->own.ao[i] <= 1.0f)) {
            b->at[k] = 0;
            continue;
        }
        if (s->shots->rays[i] != rays) {
            rays = s->shots->rays[i];
            spread = (float)vshi_ao_shared_spread(sampler, rays);
        }
        b->texels[k].value = s->shots->own.ao[i];
        b->texels[k].rays = rays;
        b->texels[k].spread = spread;
    }
    vshi_links_find(&s->map, &b->lattice, b->texels);
    for (size_t k = 0; k < TEXELS; ++k) { /* a texel without rays cuts the links of its neighbours */
        const bool none = b->at[k] == 0;
        b->texels[k].left = b->texels[k].left && !none && b->at[k - 1] > 0;
        b->texels[k].above = b->texels[k].above && !none && b->at[k - WIDTH] > 0;
    }
    vshi_windows_sum(&b->windows);
}

/* Bent normals turn with the surface, but windows are chosen by values, which may not change there. So the
 * average is over the differences from each texel's normal. */
static void bend(const estimating *s, const block *b, const vshi_window_estimate *e, int32_t x, int32_t y,
                 float *bent) {
    const float *own = s->map.normal + 3 * (b->at[y * WIDTH + x] - 1);
    double sum[3];
    for (size_t axis = 0; axis < 3; ++axis) {
        sum[axis] = VSHI_AO_OPEN * e->value * (double)own[axis];
    }
    for (int32_t row = e->y[0]; row <= e->y[1]; ++row) {
        for (int32_t column = e->x[0]; column <= e->x[1]; ++column) {
            const size_t i = b->at[row * WIDTH + column] - 1;
            const float *open = s->shots->own.bent + 3 * i, *normal = s->map.normal + 3 * i;
            const double weight = vshi_window_weight(e, x, y, column, row);
            const double even = VSHI_AO_OPEN * (double)s->shots->own.ao[i];
            for (size_t axis = 0; axis < 3; ++axis) {
                sum[axis] += weight * ((double)open[axis] - even * (double)normal[axis]);
            }
        }
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        bent[axis] = (float)sum[axis];
    }
}

/* Estimates by windows across tiles. If these know too little for the texel's tile, by the tile's own
 * windows. */
static void estimate(const estimating *s, const block *b, const uint16_t *places, size_t count,
                     vshi_window_estimate *estimates) {
    const double max_error = s->shade->max_error;
    vshi_windows_estimate(&b->windows, places, count, max_error, 0, estimates);
    for (size_t k = 0; k < count; ++k) {
        if (!(estimates[k].centred <= VSHI_AO_TILE_ENOUGH * max_error)) { /* too few rays */
            vshi_window_estimate own;
            vshi_windows_estimate(&b->windows, &places[k], 1, max_error, VSHI_CELL, &own);
            estimates[k] = own.centred < estimates[k].centred ? own : estimates[k];
        }
    }
}

static void estimate_row(const estimating *s, const block *b, int32_t y) {
    const float part = 1.0f / (float)s->spacing;
    uint16_t places[INNER] = {0};
    size_t count = 0;
    vshi_window_estimate estimates[INNER];
    for (int32_t at = y * WIDTH + VSHI_CELL; at < y * WIDTH + VSHI_CELL + INNER; ++at) {
        if (is_own(s, b->at[at])) {
            places[count++] = (uint16_t)at;
        }
    }
    estimate(s, b, places, count, estimates);
    for (size_t k = 0; k < count; ++k) {
        const vshi_window_estimate *e = &estimates[k];
        const size_t i = b->at[places[k]] - 1;
        s->values[i] = (float)e->value;
        s->planes[i] = (ao_plane){
            {part * (float)e->slope[0], part * (float)e->slope[1]}, (float)e->deviation, (float)e->curved};
        if (s->bent != NULL) {
            bend(s, b, e, places[k] % WIDTH, y, s->bent + 3 * i);
        }
    }
}

static size_t blocks_across(int32_t texels, int32_t spacing) {
    const int32_t side = INNER * spacing;
    return (size_t)((texels + side - 1) / side);
}

/* Blocks are numbered row by row. */
static vsh_result estimate_block(void *user, size_t number, vsh_error *error) {
    const estimating *s = user;
    const size_t columns = blocks_across(s->map.width, s->spacing);
    const int32_t side = INNER * s->spacing, beside = VSHI_CELL * s->spacing;
    block *b = aligned_alloc(_Alignof(block), sizeof *b);
    if (b == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "AO texels: the system refused memory");
    }
    b->lattice = (vshi_texel_lattice){(int32_t)(number % columns) * side - beside,
                                      (int32_t)(number / columns) * side - beside, s->spacing, WIDTH, WIDTH};
    if (find_texels(s, b)) {
        lay_out(s, b);
        for (int32_t y = VSHI_CELL; y < VSHI_CELL + INNER; ++y) {
            estimate_row(s, b, y);
        }
    }
    free(b);
    return VSH_OK;
}

/* --- estimates of the texels between these */

/* A cell whose texels are estimated by the windows of its corners. */
typedef struct cell {
    int32_t at[2];
    uint32_t good;    /* corners that belong to the lattice, as bits */
    size_t corner[4]; /* origins */
    bool whole;
} cell;

static void read_corners(const estimating *s, cell *c) {
    c->good = 0;
    for (int32_t k = 0; k < 4; ++k) {
        const size_t at =
            vshi_texel_at(&s->map, c->at[0] + (k & 1) * s->spacing, c->at[1] + (k >> 1) * s->spacing);
        c->corner[k] = at - 1;
        if (at > 0 && s->shots->rays[at - 1] > 0 && s->shots->level[at - 1] >= s->spacing) {
            c->good |= 1u << k;
        }
    }
    c->whole = vshi_links_whole(&s->map, c->at[0], c->at[1], s->spacing);
}

/* The place of a texel between its cell's corners, 0 … 1, but never on a corner's line. */
static double part_of(int32_t place, int32_t spacing) {
    return (place + 0.25) / (spacing + 0.5);
}

/* Blends the planes of the corners. */
static void fill_texel(const estimating *s, const cell *c, int32_t dx, int32_t dy, size_t i) {
    const uint32_t corners =
        c->good & vshi_ao_corners(&s->map, c->at, s->spacing, c->whole, c->at[0] + dx, c->at[1] + dy);
    const double u = part_of(dx, s->spacing), v = part_of(dy, s->spacing);
    double sum = 0.0, value = 0.0, deviation = 0.0, curved = 0.0, bent[3] = {0.0, 0.0, 0.0};
    for (int32_t k = 0; k < 4; ++k) {
        if ((corners >> k & 1) == 0) {
            continue;
        }
        const size_t corner = c->corner[k];
        const ao_plane *p = &s->planes[corner];
        const double weight = (k & 1 ? u : 1.0 - u) * (k >> 1 ? v : 1.0 - v);
        const int32_t x = dx - (k & 1) * s->spacing, y = dy - (k >> 1) * s->spacing;
        const double at = (double)s->values[corner] + (double)p->slope[0] * x + (double)p->slope[1] * y;
        sum += weight;
        value += weight * (at < 0.0 ? 0.0 : at > 1.0 ? 1.0 : at);
        deviation += weight * (double)p->deviation;
        curved += weight * (double)p->curved;
        for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
            bent[axis] +=
                weight * ((double)s->bent[3 * corner + axis] - VSHI_AO_OPEN * (double)s->values[corner] *
                                                                   (double)s->map.normal[3 * corner + axis]);
        }
    }
    if (!(sum > 0.0)) { /* the part of the bake is damaged */
        s->values[i] = 0.0f;
        return;
    }
    s->values[i] = (float)(value / sum);
    s->planes[i] = (ao_plane){{0.0f, 0.0f}, (float)(deviation / sum), (float)(curved / sum)};
    for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
        s->bent[3 * i + axis] =
            (float)(VSHI_AO_OPEN * (double)s->values[i] * (double)s->map.normal[3 * i + axis] +
                    bent[axis] / sum);
    }
}

/* Fills the other texels of a row of cells. A vshi_element_fn. */
static vsh_result fill_row(void *user, size_t number, vsh_error *error) {
    const estimating *s = user;
    const int32_t row = (int32_t)number * s->spacing, bottom = row + s->spacing;
    (void)error;
    for (int32_t column = 0; column < s->map.width; column += s->spacing) {
        cell c = {.at = {column, row}};
        bool read = false;
        for (int32_t y = row; y < bottom && y < s->map.height; ++y) {
            for (int32_t x = column; x < column + s->spacing && x < s->map.width; ++x) {
                const size_t i = (size_t)y * (size_t)s->map.width + (size_t)x;
                if (s->shots->level[i] != s->spacing || s->shots->rays[i] > 0) {
                    continue;
                }
                if (!read) {
                    read_corners(s, &c);
                    read = true;
                }
                fill_texel(s, &c, x - column, y - row, i);
            }
        }
    }
    return VSH_OK;
}

/* --- the estimate of a page */

/* Sums a row of cells for the statistics. A vshi_element_fn. */
static vsh_result sum_row(void *user, size_t row, vsh_error *error) {
    const estimating *s = user;
    row_sum *sum = &s->sums[row];
    const size_t width = (size_t)s->map.width, end = (row + 1) * VSHI_CELL * width;
    const size_t all = width * (size_t)s->map.height;
    (void)error;
    for (size_t i = row * VSHI_CELL * width; i < end && i < all; ++i) {
        if (s->shots->level[i] == VSHI_AO_KNOWN_LEVEL) {
            const float value = s->shots->own.ao[i];
            s->values[i] = value;
            s->planes[i] = (ao_plane){.deviation = isnan(value) ? NAN : 0.0f};
            for (size_t axis = 0; axis < 3 && s->bent != NULL; ++axis) {
                s->bent[3 * i + axis] = s->shots->own.bent[3 * i + axis];
            }
            sum->invalid += isnan(value);
        } else if (s->shots->level[i] != 0) {
            const double deviation = (double)s->planes[i].deviation;
            sum->square += (uint64_t)(deviation * deviation / VSHI_SQUARE_UNIT);
            sum->curved += (int64_t)((double)s->planes[i].curved / VSHI_SQUARE_UNIT);
            sum->worst = fmax(sum->worst, deviation);
            sum->rays += (uint64_t)s->shots->rays[i];
            ++sum->refined;
        }
    }
    return VSH_OK;
}

/* Sums curvature by rows of cells: for single texels it is too noisy to differ from zero. */
static void add_sums(const estimating *s, size_t rows, vsh_shade_stats *stats) {
    double square = 0.0;
    for (size_t row = 0; row < rows; ++row) {
        const row_sum *sum = &s->sums[row];
        square += (double)sum->square * VSHI_SQUARE_UNIT;
        square += sum->curved > 0 ? (double)sum->curved * VSHI_SQUARE_UNIT : 0.0;
        stats->worst_error = fmax(stats->worst_error, sum->worst);
        stats->rays += sum->rays;
        stats->refined += sum->refined;
        stats->invalid += sum->invalid;
    }
    stats->square_error += square;
    stats->ao_square_error += square;
}

static vsh_result run_estimate(estimating *s, int32_t spacing, vshi_job *job, vsh_error *error) {
    const int32_t width = s->map.width, height = s->map.height;
    for (s->spacing = spacing; s->spacing > 0; s->spacing /= 2) {
        const size_t blocks = blocks_across(width, s->spacing) * blocks_across(height, s->spacing);
        VSHI_TRY(vshi_parallel_each(job, blocks, 1, 0, estimate_block, s, error));
    }
    for (s->spacing = spacing; s->spacing > 1; s->spacing /= 2) {
        const size_t cells = (size_t)((height + s->spacing - 1) / s->spacing);
        VSHI_TRY(vshi_parallel_each(job, cells, 1, 0, fill_row, s, error));
    }
    const size_t rows = ((size_t)height + VSHI_CELL - 1) / VSHI_CELL;
    return vshi_parallel_each(job, rows, 1, 1, sum_row, s, error);
}

static vsh_result estimate_all(const vshi_page *page, const vshi_shots *shots, float *values,
                               ao_plane *planes, float *bent, const vsh_run *run, vsh_shade_stats *stats,
                               vsh_error *error) {
    const size_t rows = (page->height + VSHI_CELL - 1) / VSHI_CELL;
    estimating s = {.map = {.width = (int32_t)page->width,
                            .height = (int32_t)page->height,
                            .level = shots->level,
                            .position = page->position,
                            .normal = page->normal},
                    .shots = shots,
                    .shade = &page->shade,
                    .isa = run->isa,
                    .values = values,
                    .planes = planes,
                    .bent = bent};
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, "ao", rows, "ao", error));
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&s.sums, rows, sizeof *s.sums, "AO texels", error));
    VSHI_TRY_DONE(run_estimate(&s, page->charts->ao_spacing, job, error));
    add_sums(&s, rows, stats);
done:
    free(s.sums);
    vshi_job_end(job);
    return result;
}

/* --- bent normals */

/* Turns a direction into the tangent space of a normal and a tangent. */
static void turn_to_tangent(const float *normal, const float *given, float *bent) {
    const vshi_vec n = vshi_unit(vshi_vec_off(normal));
    vshi_vec t = vshi_vec_off(given), b;
    t = vshi_sub(t, vshi_scale(n, vshi_dot(n, t)));
    if (!(vshi_dot(t, t) > 0.0)) {
        vshi_frame(n, &t, &b);
    }
    t = vshi_unit(t);
    b = vshi_scale(vshi_cross(n, t), (double)given[3]);
    const vshi_vec d = vshi_vec_off(bent);
    vshi_vec_to_floats((vshi_vec){vshi_dot(d, t), vshi_dot(d, b), vshi_dot(d, n)}, bent);
}

void vshi_bent_normal(const float *normal, const float *tangent, float *bent) {
    vshi_ao_bent(bent, normal);
    if (tangent != NULL) {
        turn_to_tangent(normal, tangent, bent);
    }
}

void vshi_bent_normalize(float *bent) {
    vshi_vec_to_floats(vshi_unit(vshi_vec_off(bent)), bent);
}

/* --- values in planes */

/* Stores a texel's value in its planes. */
static void store_ao(const vshi_page *page, size_t i, float value, const ao_plane *plane, float *bent) {
    const vsh_lightmap *planes = &page->lightmap;
    if (planes->ao != NULL) {
        planes->ao[i] = 0.0f + value; /* -0 becomes 0 */
    }
    if (planes->ao_error != NULL) {
        planes->ao_error[i] = plane->deviation;
    }
    if (bent != NULL) {
        vshi_bent_normal(page->normal + 3 * i, page->tangent != NULL ? page->tangent + 4 * i : NULL,
                         bent + 3 * i);
        for (size_t axis = 0; axis < 3; ++axis) {
            planes->bent[3 * i + axis] = 0.0f + bent[3 * i + axis];
        }
        vshi_bent_normalize(planes->bent + 3 * i);
    }
}

static void store_values(const vshi_page *page, const vshi_shots *shots, float *values,
                         const ao_plane *planes, float *bent) {
    const bool sky = shots == &page->sky;
    double up[3] = {0.0, 0.0, 0.0};
    if (sky) {
        vshi_sky_up(page->lightmap.asked.sky, up);
    }
    for (size_t i = 0; i < vshi_page_texels(page); ++i) {
        if (shots->level[i] == 0) {
            continue;
        }
        if (isnan(values[i])) {
            page->state[i] = VSHI_TEXEL_INVALID;
        } else if (sky) {
            values[i] = vshi_sky_weighed(page->normal + 3 * i, up, values[i]);
            page->lightmap.sky[i] = 0.0f + values[i];
        } else {
            store_ao(page, i, values[i], &planes[i], bent);
        }
    }
}

vsh_result vshi_ao_estimate(vshi_page *page, const vshi_shots *shots, size_t index, const vsh_run *run,
                            vsh_bake_stats *stats, vsh_error *error) {
    const size_t texels = vshi_page_texels(page);
    float *values = NULL, *bent = NULL;
    ao_plane *planes = NULL;
    const vshi_array arrays[] = {VSHI_ARRAY(values, texels), VSHI_ARRAY(planes, texels),
                                 VSHI_ARRAY(bent, shots->own.bent != NULL ? 3 * texels : 0)};
    VSHI_TRY(vshi_page_take(page, arrays, sizeof arrays / sizeof *arrays, "AO texels", error));
    vsh_shade_stats own = vsh_shade_stats_zero();
    VSHI_TRY(estimate_all(page, shots, values, planes, bent, run, &own, error));
    vshi_shade_stats_add(&stats->shade, &own);
    store_values(page, shots, values, planes, bent);
    if (stats->errors != NULL) {
        stats->errors[index].square_error += own.square_error;
        stats->errors[index].worst = fmax(stats->errors[index].worst, own.worst_error);
        for (size_t tile = 0; tile < vshi_charts_tiles(&page->charts->sorted); ++tile) {
            const vshi_compared_texels *compared = &shots->compared[tile];
            for (const vshi_compared_texel *t = compared->list; t < compared->list + compared->count; ++t) {
                vshi_field_error_settle(t, page->shade.max_error, values[vshi_page_place(page, t->texel)],
                                        &stats->errors[index]);
            }
        }
    }
    vshi_store_give(page->store, bent);
    vshi_store_give(page->store, planes);
    vshi_store_give(page->store, values);
    return VSH_OK;
}
