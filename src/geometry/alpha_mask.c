#include "geometry/alpha_mask.h"

#include "base/job.h"
#include "base/memory.h"
#include "geometry/mesh.h"

#include <math.h>
#include <stdlib.h>

vsh_result vshi_alpha_mask_check(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    enum { LARGEST = 1 << 16 }; /* counts of texels must fit in 32 bits */
    const vsh_alpha_mask *mask = mesh->mask;
    if (mask == NULL) {
        return VSH_OK;
    }
    bool good = mask->alpha != NULL && mask->width >= 1 && mask->height >= 1 && mask->width < LARGEST &&
                mask->height < LARGEST && mask->alpha_cutoff >= 0.0 && mask->base_alpha >= 0.0 &&
                mask->base_alpha <= 1.0;
    for (int k = 0; k < 2; ++k) {
        good = good && (uint32_t)mask->wrap[k] <= VSH_WRAP_CLAMP;
    }
    for (int k = 0; k < 6; ++k) {
        good = good && isfinite(mask->uv_transform[k]);
    }
    if (!good) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: its alpha mask of %d × %d texels has a bad size, wrap, transform or cutoff",
                         vshi_mesh_label(mesh, index).text, mask->width, mask->height);
    }
    if (mesh->mask_uvs == NULL && mesh->vertex_count > 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: it has an alpha mask, and mask_uvs are NULL",
                         vshi_mesh_label(mesh, index).text);
    }
    return VSH_OK;
}

vshi_mask_place vshi_alpha_mask_place(const vsh_alpha_mask *mask, const float uv[2]) {
    const double *t = mask->uv_transform, u = (double)uv[0], v = (double)uv[1];
    const double x = t[0] * u + t[1] * v + t[2], y = t[3] * u + t[4] * v + t[5];
    return (vshi_mask_place){x * mask->width - 0.5, (1.0 - y) * mask->height - 0.5};
}

/* --- one place */

/* The texel at a column (row), any whole number, of an image that continues by its wrap. */
static int32_t wrap_index(double at, int32_t size, int32_t wrap) {
    if (wrap == VSH_WRAP_CLAMP) {
        return at <= 0.0 ? 0 : at >= size - 1.0 ? size - 1 : (int32_t)at;
    }
    const double period = wrap == VSH_WRAP_MIRROR ? 2.0 * size : size;
    const double rest = at - period * floor(at / period); /* rounding may leave it outside of the period */
    const int32_t in = rest <= 0.0 ? 0 : rest >= period ? 0 : (int32_t)rest;
    return in < size ? in : 2 * size - 1 - in;
}

/* A column (row) and the next, as texels. */
static void find_pair(double at, int32_t size, int32_t wrap, size_t pair[2]) {
    if (at >= 0.0 && at < size - 1.0) { /* within the image */
        pair[0] = (size_t)at;
        pair[1] = pair[0] + 1;
        return;
    }
    pair[0] = (size_t)wrap_index(at, size, wrap);
    pair[1] = (size_t)wrap_index(at + 1.0, size, wrap);
}

/* Whether an alpha of 0 … 255, times the material's base alpha, reaches the cutoff. */
static bool is_opaque(const vsh_alpha_mask *mask, double alpha) {
    return mask->base_alpha * alpha >= 255.0 * mask->alpha_cutoff;
}

bool vshi_alpha_mask_opaque(const vsh_alpha_mask *mask, vshi_mask_place at) {
    if (!isfinite(at.x) || !isfinite(at.y)) {
        return true;
    }
    const double column = floor(at.x), row = floor(at.y), x = at.x - column, y = at.y - row;
    size_t columns[2], rows[2];
    find_pair(column, mask->width, mask->wrap[0], columns);
    find_pair(row, mask->height, mask->wrap[1], rows);
    const uint8_t *first = mask->alpha + rows[0] * (size_t)mask->width;
    const uint8_t *second = mask->alpha + rows[1] * (size_t)mask->width;
    const double top = (1.0 - x) * first[columns[0]] + x * first[columns[1]];
    const double under = (1.0 - x) * second[columns[0]] + x * second[columns[1]];
    return is_opaque(mask, (1.0 - y) * top + y * under);
}

/* --- rectangles */

static double find_table_bytes(const vsh_alpha_mask *mask) {
    return sizeof(uint32_t) * (mask->width + 1.0) * (mask->height + 1.0);
}

vsh_result vshi_mask_table_create(const vsh_alpha_mask *mask, const vsh_run *run, vshi_mask_table *table,
                                  vsh_error *error) {
    const size_t width = (size_t)mask->width, height = (size_t)mask->height, stride = width + 1;
    *table = (vshi_mask_table){.mask = mask};
    VSHI_TRY(vshi_check_limit(run, find_table_bytes(mask), "alpha masks", error));
    VSHI_TRY(
        vshi_allocate((void **)&table->sums, stride * (height + 1), sizeof(uint32_t), "alpha masks", error));
    for (size_t y = 0; y < height; ++y) {
        const uint8_t *alpha = mask->alpha + y * width;
        const uint32_t *above = table->sums + y * stride;
        uint32_t *here = table->sums + (y + 1) * stride, row = 0;
        for (size_t x = 0; x < width; ++x) {
            row += is_opaque(mask, (double)alpha[x]);
            here[x + 1] = above[x + 1] + row;
        }
    }
    return VSH_OK;
}

void vshi_mask_table_free(vshi_mask_table *table) {
    free(table->sums);
    table->sums = NULL;
}

/* Texels along one side of the image, in one or two parts because of its wrap. */
typedef struct span {
    int32_t first[2], last[2];
    int parts;
} span;

/* Finds the span of the columns (rows) low … high, whole numbers. */
static span find_span(double low, double high, int32_t size, int32_t wrap) {
    if (wrap != VSH_WRAP_CLAMP && !(high - low < size - 1.0)) {
        return (span){{0}, {size - 1}, 1};
    }
    const int32_t a = wrap_index(low, size, wrap), b = wrap_index(high, size, wrap);
    if (wrap == VSH_WRAP_CLAMP) {
        return (span){{a}, {b}, 1};
    }
    if (wrap == VSH_WRAP_REPEAT) {
        return a <= b ? (span){{a}, {b}, 1} : (span){{a, 0}, {size - 1, b}, 2};
    }
    const double turn = floor(high / size) * size; /* here the mirrored columns change direction */
    if (!(turn > low)) {
        return (span){{a < b ? a : b}, {a < b ? b : a}, 1};
    }
    const bool end = wrap_index(turn, size, wrap) != 0; /* at the last texel, not at the first */
    return end ? (span){{a, b}, {size - 1, size - 1}, 2} : (span){{0, 0}, {a, b}, 2};
}

static vshi_mask_cover cover_of_texels(const vshi_mask_table *table, double low[2], double high[2]) {
    const vsh_alpha_mask *mask = table->mask;
    const span columns = find_span(low[0], high[0], mask->width, mask->wrap[0]);
    const span rows = find_span(low[1], high[1], mask->height, mask->wrap[1]);
    const size_t stride = (size_t)mask->width + 1;
    bool any = false, all = true;
    for (int i = 0; i < columns.parts; ++i) {
        for (int k = 0; k < rows.parts; ++k) {
            const size_t left = (size_t)columns.first[i], right = (size_t)columns.last[i] + 1;
            const uint32_t *top = table->sums + (size_t)rows.first[k] * stride;
            const uint32_t *under = table->sums + ((size_t)rows.last[k] + 1) * stride;
            const uint32_t opaque = under[right] - under[left] - (top[right] - top[left]);
            const size_t texels = (right - left) * ((size_t)rows.last[k] + 1 - (size_t)rows.first[k]);
            any = any || opaque > 0;
            all = all && opaque == texels;
        }
    }
    return all ? VSHI_MASK_OPAQUE : any ? VSHI_MASK_MIXED : VSHI_MASK_CLEAR;
}

/* Between texels alpha is bilinear, so its extremes in a part of a cell are at the part's corners. */
enum { MOST_CELLS = 6 }; /* along a side */

static vshi_mask_cover cover_of_cells(const vsh_alpha_mask *mask, const double low[2], const double high[2]) {
    double at[2][MOST_CELLS + 2];
    int count[2];
    for (int axis = 0; axis < 2; ++axis) {
        count[axis] = 1;
        at[axis][0] = low[axis];
        for (double line = floor(low[axis]) + 1.0; line < high[axis]; line += 1.0) {
            at[axis][count[axis]++] = line;
        }
        at[axis][count[axis]++] = high[axis];
    }
    bool any = false, all = true;
    for (int i = 0; i < count[0]; ++i) {
        for (int k = 0; k < count[1]; ++k) {
            const bool opaque = vshi_alpha_mask_opaque(mask, (vshi_mask_place){at[0][i], at[1][k]});
            any = any || opaque;
            all = all && opaque;
        }
    }
    return all ? VSHI_MASK_OPAQUE : any ? VSHI_MASK_MIXED : VSHI_MASK_CLEAR;
}

vshi_mask_cover vshi_mask_table_cover(const vshi_mask_table *table, const vshi_mask_place corners[3]) {
    static const double FARTHEST = 0x1p50; /* beyond, doubles do not resolve columns */
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 3; ++k) {
        const double at[2] = {corners[k].x, corners[k].y};
        for (int axis = 0; axis < 2; ++axis) {
            if (!(fabs(at[axis]) < FARTHEST)) {
                return isfinite(at[axis]) ? VSHI_MASK_MIXED : VSHI_MASK_OPAQUE;
            }
            low[axis] = at[axis] < low[axis] ? at[axis] : low[axis];
            high[axis] = at[axis] > high[axis] ? at[axis] : high[axis];
        }
    }
    if (high[0] - low[0] < MOST_CELLS - 1.0 && high[1] - low[1] < MOST_CELLS - 1.0) {
        return cover_of_cells(table->mask, low, high);
    }
    for (int axis = 0; axis < 2; ++axis) {
        low[axis] = floor(low[axis]);
        high[axis] = floor(high[axis]) + 1.0;
    }
    return cover_of_texels(table, low, high);
}

/* --- pieces: the opaque parts of a masked mesh */

/* Most cuts of a piece: its sides are then 2^-40 of the triangle's. */
enum { DEEPEST = 120 };

typedef struct corner {
    vshi_vec at; /* the mesh's own space */
    vshi_mask_place place;
} corner;

typedef struct piece {
    corner corners[3];
    int depth;
} piece;

typedef struct cutting {
    const vsh_mesh *mesh;
    vshi_mask_table table;
    double size;
    double most; /* pieces */
    uint64_t count, tested;
    vshi_job *job;
    float *positions; /* NULL: only count */
} cutting;

static corner middle(const corner *a, const corner *b) {
    return (corner){vshi_scale(vshi_add(a->at, b->at), 0.5),
                    {0.5 * (a->place.x + b->place.x), 0.5 * (a->place.y + b->place.y)}};
}

/* Squared length of the side from corner k on, world units. */
static double side(const cutting *c, const piece *p, int k) {
    const vshi_vec off = vshi_sub(p->corners[(k + 1) % 3].at, p->corners[k].at);
    const vshi_vec world = vshi_transform_vector(c->mesh->transform, off);
    return vshi_dot(world, world);
}

static void keep_piece(cutting *c, const piece *p) {
    if (c->positions != NULL) {
        float *to = c->positions + 9 * c->count;
        for (int k = 0; k < 3; ++k) {
            const vshi_vec at = p->corners[k].at;
            *to++ = (float)at.x;
            *to++ = (float)at.y;
            *to++ = (float)at.z;
        }
    }
    ++c->count;
}

/* Returns false for too many pieces, or if the job is cancelled. */
static bool cut_triangle(cutting *c, size_t triangle) {
    enum { OFTEN = 1 << 16 };
    piece stack[DEEPEST + 1];
    int left = 1;
    stack[0].depth = 0;
    for (size_t k = 0; k < 3; ++k) {
        const size_t vertex = c->mesh->indices[3 * triangle + k];
        stack[0].corners[k] = (corner){vshi_vec_off(c->mesh->positions + 3 * vertex),
                                       vshi_alpha_mask_place(c->mesh->mask, c->mesh->mask_uvs + 2 * vertex)};
    }
    while (left > 0) {
        const piece p = stack[--left];
        if (++c->tested % OFTEN == 0 && ((double)c->count > c->most || vshi_job_advance(c->job, 0))) {
            return false;
        }
        const vshi_mask_place places[3] = {p.corners[0].place, p.corners[1].place, p.corners[2].place};
        const vshi_mask_cover cover = vshi_mask_table_cover(&c->table, places);
        if (cover == VSHI_MASK_CLEAR) {
            continue;
        }
        double longest = -1.0;
        int at = 0;
        for (int k = 0; k < 3; ++k) {
            const double square = side(c, &p, k);
            at = square > longest ? k : at;
            longest = square > longest ? square : longest;
        }
        if (cover == VSHI_MASK_OPAQUE || !(longest > c->size * c->size) || p.depth == DEEPEST) {
            keep_piece(c, &p);
            continue;
        }
        const corner *a = &p.corners[at], *b = &p.corners[(at + 1) % 3], *o = &p.corners[(at + 2) % 3];
        const corner m = middle(a, b);
        stack[left++] = (piece){{*a, m, *o}, p.depth + 1};
        stack[left++] = (piece){{m, *b, *o}, p.depth + 1};
    }
    return (double)c->count <= c->most && !vshi_job_advance(c->job, 1);
}

static vsh_result cut_all(cutting *c, vsh_error *error) {
    c->count = 0;
    for (size_t i = 0; i < c->mesh->triangle_count; ++i) {
        if (vshi_mesh_degenerate(c->mesh, i) || cut_triangle(c, i)) {
            continue;
        }
        VSHI_TRY(vshi_job_check(c->job, error));
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: its alpha mask leaves more than %.0f pieces of %.3g",
                         vshi_mesh_label(c->mesh, VSHI_MESH_ALONE).text, c->most, c->size);
    }
    return VSH_OK;
}

vsh_result vshi_mask_pieces_cut(const vsh_mesh *mesh, double size, const vsh_run *run,
                                vshi_mask_pieces *pieces, vsh_error *error) {
    enum { PIECE_BYTES = 9 * sizeof(float) + 3 * sizeof(uint32_t) };
    cutting c = {.mesh = mesh, .size = size, .most = UINT32_MAX / 3};
    const uint64_t memory = run->memory_limit > 0 ? vshi_memory_left(run) : 0;
    c.most = memory > 0 ? fmin(c.most, (double)memory / PIECE_BYTES) : c.most;
    vsh_result result;
    *pieces = (vshi_mask_pieces){.count = 0};
    VSHI_TRY_DONE(vshi_mask_table_create(mesh->mask, run, &c.table, error));
    VSHI_TRY_DONE(vshi_job_open(&c.job, run, "masks", 2 * mesh->triangle_count, "alpha masks", error));
    VSHI_TRY_DONE(cut_all(&c, error));
    const size_t count = (size_t)c.count;
    VSHI_TRY_DONE(vshi_check_limit(run, find_table_bytes(mesh->mask) + PIECE_BYTES * (double)count,
                                   "pieces of alpha masks", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&pieces->positions, 9 * count, sizeof *pieces->positions,
                                "pieces of alpha masks", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&pieces->indices, 3 * count, sizeof *pieces->indices,
                                "pieces of alpha masks", error));
    c.positions = pieces->positions;
    if (count > 0) {
        VSHI_TRY_DONE(cut_all(&c, error));
    }
    for (size_t i = 0; i < 3 * count; ++i) {
        pieces->indices[i] = (uint32_t)i;
    }
    pieces->count = count;
done:
    vshi_job_end(c.job);
    vshi_mask_table_free(&c.table);
    return result;
}

void vshi_mask_pieces_free(vshi_mask_pieces *pieces) {
    free(pieces->positions);
    free(pieces->indices);
    *pieces = (vshi_mask_pieces){.count = 0};
}
