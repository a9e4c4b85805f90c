/* One tile of a lightmap: its cells and its samples. */
#include "lightmap/texels.h"

#include "base/memory.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- conservative rasterisation of UV triangles over cells, exact and watertight
 *
 * Edge functions after Pineda, "A Parallel Algorithm for Polygon Rasterization" (1988), with the top-left
 * rule. Corners are rounded to an integer grid of 2^21 steps between two samples. Every sign on it is exact
 * in 128 bits: a sample belongs to exactly one of the triangles around an edge or a corner. The grid holds
 * UVs up to some 10^5 squares away. Farther corners are clamped, since their shape no longer shows in the
 * image. */

typedef __int128 exact; /* products of two differences of grid coordinates: below 2^123 */

enum { HALF_BITS = 20 }; /* half the distance between samples is 2^20 steps of the grid */
#define HALF_STEP ((int64_t)1 << HALF_BITS)
#define FARTHEST 17179869184.0 /* 2^34 texels: times 2^25 steps a texel (16 samples) stays below 2^60 */

static int64_t texel_steps(const vshi_raster *raster) {
    return 2 * HALF_STEP * raster->supersample;
}

static double clamp_far(double x) {
    return x < -FARTHEST ? -FARTHEST : x > FARTHEST ? FARTHEST : x;
}

static int64_t floor_divide(int64_t a, int64_t b) {
    const int64_t quotient = a / b;
    return a % b < 0 ? quotient - 1 : quotient;
}

static int64_t least(const int64_t v[3]) {
    const int64_t m = v[0] < v[1] ? v[0] : v[1];
    return m < v[2] ? m : v[2];
}

static int64_t greatest(const int64_t v[3]) {
    const int64_t m = v[0] > v[1] ? v[0] : v[1];
    return m > v[2] ? m : v[2];
}

/* Twice the signed area of (corner i, corner i + 1, point): positive on the inner side. */
static exact edge_at(const vshi_uv_triangle *t, int i, int64_t x, int64_t y) {
    const int j = (i + 1) % 3;
    return (exact)(t->grid_x[j] - t->grid_x[i]) * (y - t->grid_y[i]) -
           (exact)(t->grid_y[j] - t->grid_y[i]) * (x - t->grid_x[i]);
}

bool vshi_uv_triangle_set(const vshi_raster *raster, const float *uv[3], vshi_uv_triangle *triangle) {
    const double steps = (double)texel_steps(raster);
    for (int k = 0; k < 3; ++k) {
        triangle->x[k] = clamp_far((double)uv[k][0] * raster->width);
        triangle->y[k] = clamp_far((1.0 - (double)uv[k][1]) * raster->height);
        triangle->grid_x[k] = (int64_t)floor(triangle->x[k] * steps + 0.5);
        triangle->grid_y[k] = (int64_t)floor(triangle->y[k] * steps + 0.5);
    }
    const exact area = edge_at(triangle, 0, triangle->grid_x[2], triangle->grid_y[2]);
    if (area < 0) {
        const int64_t x = triangle->grid_x[1], y = triangle->grid_y[1];
        triangle->grid_x[1] = triangle->grid_x[2];
        triangle->grid_y[1] = triangle->grid_y[2];
        triangle->grid_x[2] = x;
        triangle->grid_y[2] = y;
    }
    return area != 0;
}

bool vshi_uv_cell_rows(const vshi_raster *raster, const vshi_uv_triangle *triangle, size_t *begin,
                       size_t *end) {
    const int64_t steps = texel_steps(raster);
    int64_t top = least(triangle->grid_y), bottom = greatest(triangle->grid_y);
    if (greatest(triangle->grid_x) <= 0 || least(triangle->grid_x) >= steps * raster->width || bottom <= 0 ||
        top >= steps * raster->height) {
        return false;
    }
    top = top > 0 ? top : 0;
    bottom = bottom < steps * raster->height ? bottom : steps * raster->height;
    *begin = (size_t)(top / (steps * VSHI_CELL));
    *end = (size_t)((bottom - 1) / (steps * VSHI_CELL)) + 1;
    return true;
}

void vshi_uv_cells(const vshi_raster *raster, const vshi_uv_triangle *triangle, size_t row, size_t *begin,
                   size_t *end) {
    /* Room for the rounding of the corners to the grid and of the clipping below; texels. */
    const double room = 0.01;
    const double top = (double)row * VSHI_CELL - room;
    const double bottom = (double)(row + 1) * VSHI_CELL + room;
    double left = INFINITY, right = -INFINITY;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const double x0 = triangle->x[i], y0 = triangle->y[i];
        const double x1 = triangle->x[j], y1 = triangle->y[j];
        if (y0 >= top && y0 <= bottom) {
            left = fmin(left, x0);
            right = fmax(right, x0);
        }
        const double line[2] = {top, bottom};
        for (int k = 0; k < 2; ++k) {
            if ((y0 < line[k]) != (y1 < line[k])) {
                const double x = x0 + (x1 - x0) * ((line[k] - y0) / (y1 - y0));
                left = fmin(left, x);
                right = fmax(right, x);
            }
        }
    }
    left = (left - room) / VSHI_CELL;
    right = (right + room) / VSHI_CELL;
    const size_t cells = ((size_t)raster->width + VSHI_CELL - 1) / VSHI_CELL;
    *begin = left > 0.0 ? (left < (double)cells ? (size_t)left : cells) : 0;
    *end = right >= 0.0 ? (right < (double)cells ? (size_t)right + 1 : cells) : 0;
    *end = *end < *begin ? *begin : *end;
}

/* Empties a cell. */
static void begin_cell(const vshi_raster *raster, size_t column, size_t row, vshi_cell *cell) {
    const size_t side = (size_t)VSHI_CELL * (size_t)raster->supersample;
    const size_t columns = (size_t)raster->width - column * VSHI_CELL;
    const size_t rows = (size_t)raster->height - row * VSHI_CELL;
    cell->column = column;
    cell->row = row;
    const uint64_t line = columns >= VSHI_CELL ? 0xff : ((uint64_t)1 << columns) - 1;
    cell->inside = 0;
    for (size_t y = 0; y < VSHI_CELL && y < rows; ++y) {
        cell->inside |= line << (VSHI_CELL * y);
    }
    cell->covered = 0;
    cell->border = 0;
    memset(cell->owner, 0, side * side * sizeof *cell->owner);
}

/* First and last sample, within the cell, whose centres lie between two grid coordinates. */
static void sample_range(int64_t low, int64_t high, int64_t cell_first, int64_t samples, int64_t *first,
                         int64_t *last) {
    *first = -floor_divide(HALF_STEP - low, 2 * HALF_STEP) - cell_first;
    *last = floor_divide(high - HALF_STEP, 2 * HALF_STEP) - cell_first;
    *first = *first > 0 ? *first : 0;
    *last = *last < samples - 1 ? *last : samples - 1;
}

/* Texels of a cell where a triangle finds taken samples. A shared edge is no overlap. */
typedef struct cell_overlap {
    uint64_t texels;
    uint64_t others; /* texels of these with a sample of another object's triangle */
} cell_overlap;

/* Gives the free samples inside triangle `index` to it (top-left rule, so that one triangle gets a shared
 * edge). */
static cell_overlap cover_cell(const vshi_raster *raster, const vshi_uv_triangle *triangles, uint32_t index,
                               vshi_cell *cell) {
    const vshi_uv_triangle *triangle = &triangles[index];
    const int32_t n = raster->supersample;
    const int64_t side = (int64_t)VSHI_CELL * n;
    const int64_t left = (int64_t)cell->column * side, top = (int64_t)cell->row * side;
    const int64_t columns = (int64_t)raster->width * n - left, rows = (int64_t)raster->height * n - top;
    int64_t x0, x1, y0, y1;
    sample_range(least(triangle->grid_x), greatest(triangle->grid_x), left, columns < side ? columns : side,
                 &x0, &x1);
    sample_range(least(triangle->grid_y), greatest(triangle->grid_y), top, rows < side ? rows : side, &y0,
                 &y1);
    cell_overlap taken = {0, 0};
    if (x0 > x1 || y0 > y1) {
        return taken;
    }
    exact row_value[3], step_x[3], step_y[3], bias[3];
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const int64_t dx = triangle->grid_x[j] - triangle->grid_x[i];
        const int64_t dy = triangle->grid_y[j] - triangle->grid_y[i];
        row_value[i] =
            edge_at(triangle, i, (2 * (left + x0) + 1) * HALF_STEP, (2 * (top + y0) + 1) * HALF_STEP);
        step_x[i] = -(exact)dy * (2 * HALF_STEP);
        step_y[i] = (exact)dx * (2 * HALF_STEP);
        /* y points down and areas are positive: the inside lies below a top edge and right of a left one. */
        bias[i] = dy < 0 || (dy == 0 && dx > 0) ? 1 : 0;
    }
    for (int64_t y = y0; y <= y1; ++y) {
        exact value[3] = {row_value[0], row_value[1], row_value[2]};
        uint32_t *owner = cell->owner + y * side;
        const int64_t line = y / n * VSHI_CELL;
        for (int64_t x = x0; x <= x1; ++x) {
            if (value[0] + bias[0] > 0 && value[1] + bias[1] > 0 && value[2] + bias[2] > 0) {
                const uint64_t texel = (uint64_t)1 << (line + x / n);
                if (owner[x] == 0) {
                    owner[x] = index + 1;
                    cell->covered |= texel;
                } else {
                    taken.texels |= texel;
                    taken.others |= triangles[owner[x] - 1].object != triangle->object ? texel : 0;
                }
            }
            value[0] += step_x[0];
            value[1] += step_x[1];
            value[2] += step_x[2];
        }
        row_value[0] += step_y[0];
        row_value[1] += step_y[1];
        row_value[2] += step_y[2];
    }
    return taken;
}

/* Whether the triangle's inside meets the inside of a texel: no edge of either separates them. */
static bool touches(const vshi_raster *raster, const vshi_uv_triangle *triangle, int64_t x, int64_t y) {
    const int64_t steps = texel_steps(raster);
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        /* The texel's corner that lies farthest to the inner side of the edge. */
        const int64_t corner_x = (triangle->grid_y[j] < triangle->grid_y[i] ? x + 1 : x) * steps;
        const int64_t corner_y = (triangle->grid_x[j] > triangle->grid_x[i] ? y + 1 : y) * steps;
        if (edge_at(triangle, i, corner_x, corner_y) <= 0) {
            return false;
        }
    }
    return true;
}

/* Finds the point of the triangle's outline nearest to a point outside it; returns the squared distance. */
static double nearest_point(const vshi_uv_triangle *triangle, double x, double y, double weight[3]) {
    double best = INFINITY;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const double dx = triangle->x[j] - triangle->x[i], dy = triangle->y[j] - triangle->y[i];
        const double px = x - triangle->x[i], py = y - triangle->y[i];
        const double length2 = dx * dx + dy * dy;
        double t = length2 > 0.0 ? (px * dx + py * dy) / length2 : 0.0;
        t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
        const double qx = px - t * dx, qy = py - t * dy;
        const double distance = qx * qx + qy * qy;
        if (distance < best) {
            best = distance;
            weight[i] = 1.0 - t;
            weight[j] = t;
            weight[(i + 2) % 3] = 0.0;
        }
    }
    return best;
}

/* Adds texels without covered samples that triangle `index` reaches as border texels. Called in the order of
 * the triangles after all have covered, so that the first of equally near ones stays. */
static void touch_cell(const vshi_raster *raster, const vshi_uv_triangle *triangles, uint32_t index,
                       vshi_cell *cell) {
    const vshi_uv_triangle *triangle = &triangles[index];
    const uint64_t open = cell->inside & ~cell->covered;
    if (open == 0) {
        return;
    }
    const int64_t steps = texel_steps(raster);
    const int64_t left = (int64_t)cell->column * VSHI_CELL, top = (int64_t)cell->row * VSHI_CELL;
    int64_t x0 = floor_divide(least(triangle->grid_x), steps) - left;
    int64_t x1 = floor_divide(greatest(triangle->grid_x) - 1, steps) - left;
    int64_t y0 = floor_divide(least(triangle->grid_y), steps) - top;
    int64_t y1 = floor_divide(greatest(triangle->grid_y) - 1, steps) - top;
    x0 = x0 > 0 ? x0 : 0;
    y0 = y0 > 0 ? y0 : 0;
    x1 = x1 < VSHI_CELL - 1 ? x1 : VSHI_CELL - 1;
    y1 = y1 < VSHI_CELL - 1 ? y1 : VSHI_CELL - 1;
    for (int64_t y = y0; y <= y1; ++y) {
        for (int64_t x = x0; x <= x1; ++x) {
            const int64_t bit = y * VSHI_CELL + x;
            if (((open >> bit) & 1) == 0 || !touches(raster, triangle, left + x, top + y)) {
                continue;
            }
            double weight[3];
            const double distance =
                nearest_point(triangle, (double)(left + x) + 0.5, (double)(top + y) + 0.5, weight);
            if (((cell->border >> bit) & 1) == 0 || distance < cell->distance[bit]) {
                cell->border |= (uint64_t)1 << bit;
                cell->nearest[bit] = index + 1;
                cell->distance[bit] = distance;
            }
        }
    }
}

/* Barycentric coordinates of a point of the image, clamped into the triangle. */
static void find_barycentric(const vshi_uv_triangle *triangle, double x, double y, double weight[3]) {
    const double ax = triangle->x[1] - triangle->x[0], ay = triangle->y[1] - triangle->y[0];
    const double bx = triangle->x[2] - triangle->x[0], by = triangle->y[2] - triangle->y[0];
    const double px = x - triangle->x[0], py = y - triangle->y[0];
    const double area = ax * by - ay * bx;
    const double b = (px * by - py * bx) / area;
    const double c = (ax * py - ay * px) / area;
    if (!isfinite(b) || !isfinite(c)) {
        nearest_point(triangle, x, y, weight);
        return;
    }
    weight[0] = fmax(1.0 - b - c, 0.0);
    weight[1] = fmax(b, 0.0);
    weight[2] = fmax(c, 0.0);
    const double sum = weight[0] + weight[1] + weight[2];
    for (int k = 0; k < 3; ++k) {
        weight[k] /= sum;
    }
}

/* Clips a convex polygon to sign × (axis coordinate - limit) <= 0 (Sutherland and Hodgman, "Reentrant polygon
 * clipping", 1974). */
static int clip(const double (*from)[2], int count, int axis, double sign, double limit, double (*to)[2]) {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
        const double *a = from[i], *b = from[(i + 1) % count];
        const double over_a = sign * (a[axis] - limit), over_b = sign * (b[axis] - limit);
        if (over_a <= 0.0) {
            to[kept][0] = a[0];
            to[kept++][1] = a[1];
        }
        if ((over_a <= 0.0) != (over_b <= 0.0)) {
            const double t = over_a / (over_a - over_b);
            to[kept][0] = a[0] + t * (b[0] - a[0]);
            to[kept++][1] = a[1] + t * (b[1] - a[1]);
        }
    }
    return kept;
}

/* Centroid of the part of the triangle within half a texel, along both axes, of its point nearest to (x, y),
 * which is outside it. */
static void find_centroid_near(const vshi_uv_triangle *triangle, double x, double y, double weight[3]) {
    enum { MOST = 3 + 4 }; /* corners: each clip adds one at most */
    double polygon[2][MOST][2], at[2] = {0.0, 0.0};
    nearest_point(triangle, x, y, weight);
    for (int k = 0; k < 3; ++k) {
        at[0] += weight[k] * triangle->x[k];
        at[1] += weight[k] * triangle->y[k];
        polygon[0][k][0] = triangle->x[k];
        polygon[0][k][1] = triangle->y[k];
    }
    int count = 3;
    for (int side = 0; side < 4; ++side) {
        const int axis = side / 2;
        const double sign = side % 2 == 0 ? 1.0 : -1.0;
        count = clip((const double(*)[2])polygon[side % 2], count, axis, sign, at[axis] + sign * 0.5,
                     polygon[1 - side % 2]);
    }
    double area = 0.0, sum[2] = {0.0, 0.0};
    for (int i = 1; i + 1 < count; ++i) { /* a fan around the first corner */
        const double *o = polygon[0][0], *a = polygon[0][i], *b = polygon[0][i + 1];
        const double twice = fabs((a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]));
        area += twice;
        for (int axis = 0; axis < 2; ++axis) {
            sum[axis] += twice * (o[axis] + a[axis] + b[axis]) / 3.0;
        }
    }
    if (area > 0.0) {
        find_barycentric(triangle, sum[0] / area, sum[1] / area, weight);
    }
}

/* --- a tile */

double vshi_tile_bytes(const vshi_charts *charts, int32_t threads) {
    const double all_cores = 64.0; /* for threads == 0 */
    const size_t tiles = vshi_charts_tiles(charts);
    size_t most = 0;
    for (size_t tile = 0; tile < tiles; ++tile) {
        const size_t count = charts->tile_start[tile + 1] - charts->tile_start[tile];
        most = count > most ? count : most;
    }
    const double at_work = (threads > 0 ? threads : all_cores) * (double)most;
    const double total = (double)charts->tile_start[tiles];
    return sizeof(vshi_uv_triangle) * (at_work < total ? at_work : total);
}

/* Meshes without an object number get numbers of their own, above all others. */
static uint64_t object_of(const vsh_mesh *mesh, size_t index) {
    return mesh->object > 0 ? mesh->object : (uint64_t)UINT32_MAX + 1 + index;
}

/* Lists the cells of a tile that a triangle reaches; returns how many. They are numbered from the one left of
 * and above the tile. */
static size_t list_cells(const vshi_charts *charts, const vshi_tile *tile, const vshi_uv_triangle *triangle,
                         size_t cells[VSHI_TILE_ACROSS * VSHI_TILE_ACROSS]) {
    size_t rows[2], columns[2], count = 0;
    if (!vshi_uv_cell_rows(&charts->raster, triangle, &rows[0], &rows[1])) {
        return 0;
    }
    const size_t left = tile->column * VSHI_TILE_CELLS, top = tile->row * VSHI_TILE_CELLS;
    for (size_t y = 0; y < VSHI_TILE_ACROSS; ++y) {
        if (top + y < rows[0] + 1 || top + y >= rows[1] + 1) {
            continue;
        }
        vshi_uv_cells(&charts->raster, triangle, top + y - 1, &columns[0], &columns[1]);
        for (size_t x = 0; x < VSHI_TILE_ACROSS; ++x) {
            if (left + x >= columns[0] + 1 && left + x < columns[1] + 1) {
                cells[count++] = y * VSHI_TILE_ACROSS + x;
            }
        }
    }
    return count;
}

vsh_result vshi_tile_open(const vshi_charts *charts, size_t number, vshi_tile *tile, vsh_error *error) {
    enum { CELLS = VSHI_TILE_ACROSS * VSHI_TILE_ACROSS };
    *tile = (vshi_tile){.column = number % charts->columns, .row = number / charts->columns};
    const size_t count = charts->tile_start[number + 1] - charts->tile_start[number];
    const size_t side = (size_t)VSHI_CELL * (size_t)charts->raster.supersample;
    const char *what = "tile of texels";
    const vshi_array arrays[] = {VSHI_ARRAY(tile->triangle, count),
                                 VSHI_ARRAY(tile->cell.owner, side * side)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, what, error));
    size_t cells[CELLS];
    for (size_t i = 0; i < count; ++i) {
        size_t local;
        vshi_uv_triangle *t = &tile->triangle[i];
        const size_t triangle = charts->tile_triangle[charts->tile_start[number] + i];
        const size_t mesh = vshi_charts_mesh(charts, triangle, &local);
        vshi_charts_triangle(charts, mesh, local, t);
        t->mesh = (uint32_t)mesh;
        t->local = (uint32_t)local;
        t->object = object_of(&charts->meshes[mesh], mesh);
        const size_t reached = list_cells(charts, tile, t, cells);
        for (size_t k = 0; k < reached; ++k) {
            ++tile->cell_start[cells[k] + 1];
        }
    }
    size_t total = 0;
    for (size_t cell = 0; cell <= CELLS; ++cell) {
        const size_t here = tile->cell_start[cell + 1];
        tile->cell_start[cell + 1] = total;
        total += here;
    }
    VSHI_TRY(vshi_allocate((void **)&tile->cell_triangle, total, sizeof *tile->cell_triangle, what, error));
    for (size_t i = 0; i < count; ++i) {
        const size_t reached = list_cells(charts, tile, &tile->triangle[i], cells);
        for (size_t k = 0; k < reached; ++k) {
            tile->cell_triangle[tile->cell_start[cells[k] + 1]++] = (uint32_t)i;
        }
    }
    return VSH_OK;
}

void vshi_tile_close(vshi_tile *tile) {
    free(tile->cell_triangle);
    free(tile->cell.owner);
    free(tile->triangle);
}

/* Counts texels that a mesh covers again, each once. */
static void count_overlap(const vshi_overlaps *overlaps, size_t mesh, const cell_overlap *taken) {
    if (taken->texels != 0) {
        atomic_fetch_add_explicit(&overlaps->texels[mesh], (size_t)__builtin_popcountll(taken->texels),
                                  memory_order_relaxed);
        atomic_fetch_add_explicit(&overlaps->others[mesh], (size_t)__builtin_popcountll(taken->others),
                                  memory_order_relaxed);
    }
}

/* Counts texels for the mesh of their first sample of another object. */
static void count_owners(const vshi_charts *charts, const vshi_tile *tile, uint64_t object, uint64_t texels,
                         const vshi_overlaps *overlaps) {
    const size_t n = (size_t)charts->raster.supersample, side = VSHI_CELL * n;
    for (uint64_t left = texels; left != 0; left &= left - 1) {
        const size_t bit = (size_t)__builtin_ctzll(left);
        const uint32_t *sample = tile->cell.owner + bit / VSHI_CELL * n * side + bit % VSHI_CELL * n;
        for (size_t k = 0; k < n * n; ++k) {
            const uint32_t owner = sample[k / n * side + k % n];
            if (owner != 0 && tile->triangle[owner - 1].object != object) {
                atomic_fetch_add_explicit(&overlaps->owners[tile->triangle[owner - 1].mesh], 1,
                                          memory_order_relaxed);
                break;
            }
        }
    }
}

static void cover(const vshi_charts *charts, vshi_tile *tile, const uint32_t *slot, size_t count,
                  const vshi_overlaps *overlaps) {
    size_t mesh = 0;
    cell_overlap again = {0, 0};
    for (size_t i = 0; i < count; ++i) {
        const vshi_uv_triangle *t = &tile->triangle[slot[i]];
        const cell_overlap taken = cover_cell(&charts->raster, tile->triangle, slot[i], &tile->cell);
        if (overlaps == NULL || taken.texels == 0) {
            continue;
        }
        if (t->mesh != mesh) {
            count_overlap(overlaps, mesh, &again);
            mesh = t->mesh;
            again = (cell_overlap){0, 0};
        }
        if (mesh == overlaps->watched) {
            count_owners(charts, tile, t->object, taken.others & ~again.others, overlaps);
        }
        again.texels |= taken.texels;
        again.others |= taken.others;
        atomic_store_explicit(&overlaps->triangles[charts->first[mesh] + t->local], 1, memory_order_relaxed);
    }
    if (overlaps != NULL) {
        count_overlap(overlaps, mesh, &again);
    }
}

bool vshi_tile_rasterize(const vshi_charts *charts, vshi_tile *tile, int32_t x, int32_t y,
                         const vshi_overlaps *overlaps) {
    const size_t cell = (size_t)(y + 1) * VSHI_TILE_ACROSS + (size_t)(x + 1);
    const size_t count = tile->cell_start[cell + 1] - tile->cell_start[cell];
    if (count == 0) { /* also outside the image */
        return false;
    }
    const uint32_t *slot = tile->cell_triangle + tile->cell_start[cell];
    begin_cell(&charts->raster, tile->column * VSHI_TILE_CELLS + (size_t)x,
               tile->row * VSHI_TILE_CELLS + (size_t)y, &tile->cell);
    cover(charts, tile, slot, count, overlaps);
    for (size_t i = 0; i < count; ++i) {
        touch_cell(&charts->raster, tile->triangle, slot[i], &tile->cell);
    }
    return true;
}

uint32_t vshi_tile_owner(const vshi_charts *charts, const vshi_tile *tile, size_t bit) {
    const vshi_cell *cell = &tile->cell;
    const size_t n = (size_t)charts->raster.supersample, side = VSHI_CELL * n;
    uint32_t owner = 0;
    if ((cell->covered >> bit & 1) != 0) {
        const uint32_t *sample = cell->owner + bit / VSHI_CELL * n * side + bit % VSHI_CELL * n;
        for (size_t k = 0; k < n * n && owner == 0; ++k) {
            owner = sample[k / n * side + k % n];
        }
    } else if ((cell->border >> bit & 1) != 0) {
        owner = cell->nearest[bit];
    }
    return owner;
}

/* --- samples */

vsh_result vshi_samples_allocate(vshi_samples *samples, size_t room, bool tangents, vsh_error *error) {
    *samples = (vshi_samples){.room = room};
    const vshi_array arrays[] = {
        VSHI_ARRAY(samples->position, 3 * room),
        VSHI_ARRAY(samples->normal, 3 * room),
        VSHI_ARRAY(samples->geometric, 3 * room),
        VSHI_ARRAY(samples->lift, 3 * room),
        VSHI_ARRAY(samples->texel, room),
        VSHI_ARRAY(samples->mesh, room),
        VSHI_ARRAY(samples->tangent, tangents ? 4 * room : 0),
    };
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "texels", error));
    samples->tangent = tangents ? samples->tangent : NULL;
    return VSH_OK;
}

void vshi_samples_free(vshi_samples *samples) {
    free(samples->position); /* the block's first array */
    *samples = (vshi_samples){.count = 0};
}

/* Writes a sample of triangle `local` of a mesh. Each triangle has a `number` of its own, above 0. */
static void write_sample(vshi_sample_writer *w, size_t number, size_t mesh_number, size_t local,
                         uint32_t texel, const double weight[3], bool border) {
    vshi_samples *samples = w->samples;
    if (number != w->number) {
        const vsh_mesh *mesh = &w->charts->sorted.meshes[mesh_number];
        vshi_surface_set(mesh, local, &w->surface);
        if (samples->tangent != NULL) {
            double handedness;
            vshi_vec_to_floats(vshi_surface_tangent(mesh, local, &handedness), w->tangent);
            w->tangent[3] = (float)handedness;
        }
        w->number = number;
    }
    vshi_vec position, normal, lift;
    vshi_surface_at(&w->surface, weight, &position, &normal, &lift);
    const size_t i = samples->count++;
    vshi_vec_to_doubles(position, samples->position + 3 * i);
    vshi_vec_to_floats(normal, samples->normal + 3 * i);
    vshi_vec_to_floats(w->surface.geometric, samples->geometric + 3 * i);
    vshi_vec_to_floats(lift, samples->lift + 3 * i);
    samples->texel[i] = texel;
    const bool sheet = w->charts->sheet[w->charts->sorted.first[mesh_number] + local] != 0;
    samples->mesh[i] =
        (uint32_t)mesh_number | (sheet ? VSHI_SAMPLE_SHEET : 0) | (border ? VSHI_SAMPLE_BORDER : 0);
    if (samples->tangent != NULL) {
        memcpy(samples->tangent + 4 * i, w->tangent, sizeof w->tangent);
    }
}

/* Writes the points of rows of cells. A triangle's first point is no neighbour of those of the last. */
static void write_points(vshi_sample_writer *w, const vshi_tile *tile, int32_t begin, int32_t end) {
    enum { ROW_POINTS = VSHI_TILE * VSHI_CELL };
    const vsh_charts *charts = w->charts;
    const size_t first = (tile->row * charts->sorted.columns + tile->column) * VSHI_TILE * VSHI_TILE;
    const size_t triangles = charts->sorted.first[charts->sorted.mesh_count];
    const size_t last = first + (size_t)end * ROW_POINTS;
    for (size_t p = first + (size_t)begin * ROW_POINTS; p < last && p < charts->info.samples; ++p) {
        double weight[3];
        size_t local;
        const size_t triangle = vshi_find_group(charts->points, triangles, p);
        const size_t mesh = vshi_charts_mesh(&charts->sorted, triangle, &local);
        vshi_point_weights(charts, triangle, p, weight);
        write_sample(w, triangle + 1, mesh, local, vshi_point_texel(charts, p), weight,
                     p == charts->points[triangle]);
    }
}

/* Writes the samples of texel (x, y) of the cell. */
static void write_texel(vshi_sample_writer *w, size_t x, size_t y) {
    const vshi_cell *cell = &w->tile->cell;
    const size_t n = (size_t)w->charts->sorted.raster.supersample, side = VSHI_CELL * n;
    const size_t column = cell->column * VSHI_CELL + x, row = cell->row * VSHI_CELL + y;
    const size_t bit = VSHI_CELL * y + x;
    const uint32_t texel = vsh_texel((uint32_t)column, (uint32_t)row);
    double weight[3];
    if (((cell->border >> bit) & 1) != 0) {
        const uint32_t number = cell->nearest[bit];
        find_centroid_near(&w->tile->triangle[number - 1], (double)column + 0.5, (double)row + 0.5, weight);
        const vshi_uv_triangle *nearest = &w->tile->triangle[number - 1];
        write_sample(w, number, nearest->mesh, nearest->local, texel, weight, true);
        return;
    }
    for (size_t s = 0; ((cell->covered >> bit) & 1) != 0 && s < n * n; ++s) {
        const size_t sx = s % n, sy = s / n;
        const uint32_t number = cell->owner[(y * n + sy) * side + x * n + sx];
        if (number != 0) {
            find_barycentric(&w->tile->triangle[number - 1], (double)column + ((double)sx + 0.5) / (double)n,
                             (double)row + ((double)sy + 0.5) / (double)n, weight);
            const vshi_uv_triangle *owner = &w->tile->triangle[number - 1];
            write_sample(w, number, owner->mesh, owner->local, texel, weight, false);
        }
    }
}

/* Appends the samples of the last rasterised cell's texels in `mask`, along Morton's curve (1966), so that 4,
 * 16 or all 64 texels that follow each other are a square. */
static void write_cell(vshi_sample_writer *w, uint64_t mask) {
    for (size_t place = 0; place < (size_t)VSHI_CELL * VSHI_CELL; ++place) {
        const size_t x = vshi_even_bits(place), y = vshi_even_bits(place >> 1);
        if ((mask >> (VSHI_CELL * y + x) & 1) != 0) {
            write_texel(w, x, y);
        }
    }
}

void vshi_samples_write_rows(vshi_sample_writer *w, vshi_tile *tile, int32_t begin, int32_t end) {
    if (w->charts->points != NULL) {
        write_points(w, tile, begin, end);
        return;
    }
    for (int32_t y = begin; y < end; ++y) {
        for (int32_t x = 0; x < VSHI_TILE_CELLS; ++x) {
            if (vshi_tile_rasterize(&w->charts->sorted, tile, x, y, NULL)) {
                write_cell(w, UINT64_MAX);
            }
        }
    }
}

void vshi_samples_write_frame(vshi_sample_writer *w, vshi_tile *tile) {
    static const uint64_t FIRST_COLUMN = UINT64_C(0x0101010101010101), FIRST_ROW = 0xff;
    enum { LAST = VSHI_TILE_CELLS, SHIFT = VSHI_CELL - 1 };
    for (int32_t y = -1; y <= LAST; ++y) {
        for (int32_t x = -1; x <= LAST; x += y < 0 || y == LAST ? 1 : LAST + 1) {
            const uint64_t columns = x < 0 ? FIRST_COLUMN << SHIFT : x == LAST ? FIRST_COLUMN : UINT64_MAX;
            const uint64_t rows = y < 0 ? FIRST_ROW << VSHI_CELL * SHIFT : y == LAST ? FIRST_ROW : UINT64_MAX;
            if (vshi_tile_rasterize(&w->charts->sorted, tile, x, y, NULL)) {
                write_cell(w, columns & rows);
            }
        }
    }
}

vsh_result vshi_tile_visit(const vsh_charts *charts, size_t number, bool tangents, vshi_samples_fn *visit,
                           void *user, vsh_error *error) {
    const size_t n = (size_t)charts->sorted.raster.supersample;
    vshi_tile tile;
    vshi_samples samples = {.count = 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_tile_open(&charts->sorted, number, &tile, error));
    VSHI_TRY_DONE(vshi_samples_allocate(&samples, (size_t)VSHI_TILE * VSHI_CELL * n * n, tangents, error));
    vshi_sample_writer writer = {.charts = charts, .tile = &tile, .samples = &samples};
    for (int32_t row = 0; row < VSHI_TILE_CELLS; ++row) {
        samples.count = 0;
        vshi_samples_write_rows(&writer, &tile, row, row + 1);
        visit(user, &samples);
    }
done:
    vshi_samples_free(&samples);
    vshi_tile_close(&tile);
    return result;
}
