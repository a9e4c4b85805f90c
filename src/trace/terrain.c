#include "trace/terrain.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"

#include <stdlib.h>

/* Least number of cells along the ground in a unit of a ray's length: for upright rays. */
static const double LEAST_SPEED = 1e-9;
/* Room for rounding over and under all heights: shares of their range and of the longer side. */
static const double ROOM = 1e-2, FLAT = 1e-4;

/* Blocks along a side of `cells` cells. */
static int32_t blocks(int32_t cells, int32_t level) {
    return (int32_t)(((int64_t)cells + (1 << level) - 1) >> level);
}

/* Finds the greatest heights of blocks of two by two blocks of the level below, or of cells. Cells share
 * corners. */
static void fill_level(const vshi_relief *r, int32_t level) {
    const float *below = r->height[level - 1];
    const int32_t shared = level == 1; /* with the next block */
    const int32_t width = level == 1 ? r->columns : r->across[level - 1];
    const int32_t depth = level == 1 ? r->rows : blocks(r->rows - 1, level - 1);
    for (int32_t z = 0; z < depth - shared; z += 2) {
        for (int32_t x = 0; x < width - shared; x += 2) {
            float highest = -INFINITY;
            for (int32_t j = z; j < z + 2 + shared && j < depth; ++j) {
                for (int32_t i = x; i < x + 2 + shared && i < width; ++i) {
                    const float h = below[(size_t)j * (size_t)width + (size_t)i];
                    highest = h > highest ? h : highest;
                }
            }
            r->height[level][(size_t)(z / 2) * (size_t)r->across[level] + (size_t)(x / 2)] = highest;
        }
    }
}

/* Finds the transform from the rays' space to cells, the inverse of that from cells to the world. */
static void place(const vsh_mesh *mesh, vshi_terrain t, const double centre[3], double scale,
                  vshi_relief *r) {
    const float *first = mesh->positions, *last = mesh->positions + 3 * (t.columns * t.rows - 1);
    const double cell[3] = {((double)last[0] - (double)first[0]) / (double)(t.columns - 1), 1.0,
                            ((double)last[2] - (double)first[2]) / (double)(t.rows - 1)};
    const double corner[3] = {(double)first[0], 0.0, (double)first[2]};
    r->side = fmax((double)last[0] - (double)first[0], (double)last[2] - (double)first[2]);
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const double *m = mesh->transform != NULL ? mesh->transform : identity;
    const vshi_vec a = {m[0], m[4], m[8]}, b = {m[1], m[5], m[9]}, c = {m[2], m[6], m[10]};
    const vshi_vec rows[3] = {vshi_cross(b, c), vshi_cross(c, a), vshi_cross(a, b)};
    const double determinant = vshi_dot(a, rows[0]);
    const vshi_vec moved = {centre[0] - m[3], centre[1] - m[7], centre[2] - m[11]};
    for (int k = 0; k < 3; ++k) {
        const vshi_vec row = vshi_scale(rows[k], 1.0 / (determinant * cell[k]));
        double *to = r->to_cells + 4 * k;
        to[0] = row.x / scale;
        to[1] = row.y / scale;
        to[2] = row.z / scale;
        to[3] = vshi_dot(row, moved) - corner[k] / cell[k];
    }
}

vsh_result vshi_relief_create(const vsh_mesh *mesh, vshi_terrain t, const double centre[3], double scale,
                              vshi_relief *r, vsh_error *error) {
    *r = (vshi_relief){.columns = (int32_t)t.columns, .rows = (int32_t)t.rows};
    size_t offset[VSHI_TERRAIN_LEVELS] = {0}, count = t.columns * t.rows;
    r->across[0] = r->columns;
    do {
        ++r->top;
        r->across[r->top] = blocks(r->columns - 1, r->top);
        offset[r->top] = count;
        count += (size_t)r->across[r->top] * (size_t)blocks(r->rows - 1, r->top);
    } while (blocks(r->columns - 1, r->top) > 1 || blocks(r->rows - 1, r->top) > 1);
    VSHI_TRY(vshi_allocate((void **)&r->height[0], count, sizeof(float), "a terrain", error));
    r->bytes = count * sizeof(float);
    r->lowest = INFINITY;
    r->highest = -INFINITY;
    for (size_t i = 0; i < t.columns * t.rows; ++i) {
        const float h = mesh->positions[3 * i + 1];
        r->height[0][i] = h;
        r->lowest = h < r->lowest ? h : r->lowest;
        r->highest = h > r->highest ? h : r->highest;
    }
    for (int32_t level = 1; level <= r->top; ++level) {
        r->height[level] = r->height[0] + offset[level];
        fill_level(r, level);
    }
    place(mesh, t, centre, scale, r);
    return VSH_OK;
}

void vshi_relief_free(vshi_relief *relief) {
    free(relief->height[0]);
    *relief = (vshi_relief){0};
}

void vshi_terrain_aim(const vshi_relief *r, const float origin[3], const float direction[3], double from,
                      double to, int lane, vshi_terrain_rays *rays) {
    double at[3], along[3];
    for (int k = 0; k < 3; ++k) {
        const double *m = r->to_cells + 4 * k;
        along[k] = m[0] * (double)direction[0] + m[1] * (double)direction[1] + m[2] * (double)direction[2];
        at[k] = m[0] * (double)origin[0] + m[1] * (double)origin[1] + m[2] * (double)origin[2] + m[3];
    }
    const double speed = fmax(fmax(fabs(along[0]), fabs(along[2])), LEAST_SPEED);
    double first = from * speed, last = fmin(to * speed, 1e30);
    const double dx = along[0] / speed, dz = along[2] / speed;
    vshi_clip_axis(at[0], dx, 0.0, r->columns - 1, &first, &last);
    vshi_clip_axis(at[2], dz, 0.0, r->rows - 1, &first, &last);
    const double range = (double)r->highest - (double)r->lowest, room = ROOM * range + FLAT * r->side;
    vshi_clip_axis(at[1] - (double)r->lowest + room, along[1] / speed, 0.0, range + 2.0 * room, &first,
                   &last);
    /* from the place where the ray reaches the grid, which may be far from its origin */
    const double x = at[0] + first * dx, z = at[2] + first * dz;
    const bool over = first <= last;
    const double column = over ? floor(x) : 0.0, row = over ? floor(z) : 0.0;
    rays->column[lane] = (int32_t)column;
    rays->row[lane] = (int32_t)row;
    rays->x[lane] = over ? (float)(x - column) : 0.0f;
    rays->z[lane] = over ? (float)(z - row) : 0.0f;
    rays->y[lane] = over ? (float)(at[1] + first * (along[1] / speed)) : 0.0f;
    rays->dx[lane] = (float)dx;
    rays->dy[lane] = (float)(along[1] / speed);
    rays->dz[lane] = (float)dz;
    rays->to[lane] = over ? (float)(last - first) : -1.0f;
    rays->begin[lane] = first;
    rays->speed[lane] = speed;
}

void vshi_terrain_leave(vshi_terrain_rays *rays, int lane) {
    rays->column[lane] = rays->row[lane] = 0;
    rays->x[lane] = rays->z[lane] = rays->y[lane] = 0.0f;
    rays->dx[lane] = rays->dy[lane] = rays->dz[lane] = 0.0f;
    rays->to[lane] = -1.0f;
    rays->begin[lane] = 0.0;
    rays->speed[lane] = 1.0;
}

void vshi_terrain_trace(const vshi_relief *relief, vshi_terrain_rays *rays) {
    VSHI_KERNEL_OF(vshi_terrain, VSH_ISA_BEST)(relief, rays);
}

vshi_vec vshi_terrain_normal(const vshi_relief *r, const vshi_terrain_rays *rays, int lane, float t) {
    const double x = (double)rays->x[lane] + (double)t * (double)rays->dx[lane];
    const double z = (double)rays->z[lane] + (double)t * (double)rays->dz[lane];
    int32_t i = (int32_t)floor(x), j = (int32_t)floor(z);
    i = rays->column[lane] + i < 0 ? 0 : rays->column[lane] + i;
    j = rays->row[lane] + j < 0 ? 0 : rays->row[lane] + j;
    i = i > r->columns - 2 ? r->columns - 2 : i;
    j = j > r->rows - 2 ? r->rows - 2 : j;
    const float *h = r->height[0] + (size_t)j * (size_t)r->columns + (size_t)i;
    const double h00 = (double)h[0], h01 = (double)h[1], h10 = (double)h[r->columns],
                 h11 = (double)h[r->columns + 1];
    const bool right = x - (i - rays->column[lane]) >= z - (j - rays->row[lane]);
    const double g[3] = {right ? h00 - h01 : h10 - h11, 1.0, right ? h01 - h11 : h00 - h10};
    const double *m = r->to_cells; /* the transposed matrix moves a gradient */
    return (vshi_vec){g[0] * m[0] + g[1] * m[4] + g[2] * m[8], g[0] * m[1] + g[1] * m[5] + g[2] * m[9],
                      g[0] * m[2] + g[1] * m[6] + g[2] * m[10]};
}
