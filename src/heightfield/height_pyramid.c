/* Making and freeing a heightfield that is marched as it is. */
#include "heightfield/height_pyramid.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "base/try.h"
#include "heightfield/heights_check.h"

#include <stdlib.h>
#include <string.h>

double vshi_height_pyramid_height(const vshi_height_pyramid *relief, double x, double z) {
    const double row = z / relief->depth;
    int32_t i = (int32_t)x, j = (int32_t)row;
    i = i < 0 ? 0 : i > relief->columns - 2 ? relief->columns - 2 : i;
    j = j < 0 ? 0 : j > relief->rows - 2 ? relief->rows - 2 : j;
    const float *h = relief->height[0] + (size_t)j * (size_t)relief->columns + i;
    const double u = x - i, v = row - j, h00 = h[0], h01 = h[1], h10 = h[relief->columns],
                 h11 = h[relief->columns + 1];
    return u >= v ? h00 + u * (h01 - h00) + v * (h11 - h01) : h00 + v * (h10 - h00) + u * (h11 - h10);
}

/* Blocks along a side of `cells` cells. */
static int32_t blocks(int32_t cells, int32_t level) {
    return (int32_t)(((int64_t)cells + (1 << level) - 1) >> level);
}

/* Number of floats of all levels; sets everything of the relief but its heights. */
static size_t plan(vshi_height_pyramid *relief, size_t offset[VSHI_RELIEF_LEVELS]) {
    const int32_t width = relief->columns - 1, depth = relief->rows - 1;
    relief->across[0] = relief->columns;
    offset[0] = 0;
    size_t count = (size_t)relief->columns * (size_t)relief->rows;
    int32_t level = 0;
    do {
        ++level;
        relief->across[level] = blocks(width, level);
        offset[level] = count;
        count += (size_t)blocks(width, level) * (size_t)blocks(depth, level);
    } while (blocks(width, level) > 1 || blocks(depth, level) > 1);
    relief->top = level;
    return count;
}

static float at_most(float a, float b) {
    return a > b ? a : b;
}

/* Blocks of two by two cells, from the samples at their nine corners. */
static void fill_first(const vshi_height_pyramid *r, float *blocks_of) {
    const float *h = r->height[0];
    for (int32_t z = 0; z < r->rows - 1; z += 2) {
        for (int32_t x = 0; x < r->columns - 1; x += 2) {
            float highest = -INFINITY;
            for (int32_t j = z; j <= z + 2 && j < r->rows; ++j) {
                for (int32_t i = x; i <= x + 2 && i < r->columns; ++i) {
                    highest = at_most(highest, h[(size_t)j * (size_t)r->columns + (size_t)i]);
                }
            }
            blocks_of[(size_t)(z / 2) * (size_t)r->across[1] + (size_t)(x / 2)] = highest;
        }
    }
}

static void fill_next(const vshi_height_pyramid *r, int32_t level, float *blocks_of) {
    const float *below = r->height[level - 1];
    const int32_t width = blocks(r->columns - 1, level - 1), depth = blocks(r->rows - 1, level - 1);
    for (int32_t z = 0; z < depth; z += 2) {
        for (int32_t x = 0; x < width; x += 2) {
            float highest = -INFINITY;
            for (int32_t j = z; j < z + 2 && j < depth; ++j) {
                for (int32_t i = x; i < x + 2 && i < width; ++i) {
                    highest = at_most(highest, below[(size_t)j * (size_t)width + (size_t)i]);
                }
            }
            blocks_of[(size_t)(z / 2) * (size_t)r->across[level] + (size_t)(x / 2)] = highest;
        }
    }
}

static void fill(vsh_heights *made, const vshi_checked_heights *t, const size_t offset[VSHI_RELIEF_LEVELS]) {
    vshi_height_pyramid *r = &made->relief;
    const double scale = t->source->height / (t->source->size[0] / (r->columns - 1));
    for (size_t i = 0; i < t->samples; ++i) {
        made->memory[i] = (float)(scale * (double)t->source->values[i]);
    }
    r->height[0] = made->memory;
    for (int32_t level = 1; level <= r->top; ++level) {
        r->height[level] = made->memory + offset[level];
        if (level == 1) {
            fill_first(r, made->memory + offset[level]);
        } else {
            fill_next(r, level, made->memory + offset[level]);
        }
    }
}

/* World to cells: the inverse of a similarity is its transpose over the squared scale. */
static void place(vsh_heights *made, const vshi_checked_heights *t, double scale) {
    const vsh_heights_source *s = t->source;
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const double *m = s->transform != NULL ? s->transform : identity;
    const double cell = s->size[0] / (made->relief.columns - 1);
    const double corner[3] = {0.5 * s->size[0], 0.0, 0.5 * s->size[1]};
    for (int row = 0; row < 3; ++row) {
        double *to = made->to_relief + 4 * row, moved = 0.0;
        for (int column = 0; column < 3; ++column) {
            to[column] = m[4 * column + row] / (scale * scale * cell);
            moved += to[column] * m[4 * column + 3];
        }
        to[3] = corner[row] / cell - moved;
    }
    made->unit = scale * cell;
    vsh_heights_info *info = &made->info;
    for (int axis = 0; axis < 3; ++axis) {
        info->bounds_min[axis] = INFINITY;
        info->bounds_max[axis] = -INFINITY;
    }
    for (int i = 0; i < 8; ++i) {
        const vshi_vec p =
            vshi_transform_point(m, (vshi_vec){i & 1 ? corner[0] : -corner[0], i & 2 ? t->highest : t->bottom,
                                               i & 4 ? corner[2] : -corner[2]});
        const double at[3] = {p.x, p.y, p.z};
        for (int axis = 0; axis < 3; ++axis) {
            info->bounds_min[axis] = fmin(info->bounds_min[axis], at[axis]);
            info->bounds_max[axis] = fmax(info->bounds_max[axis], at[axis]);
        }
    }
}

static vsh_result check_transform(const vshi_checked_heights *t, double *scale, vsh_error *error) {
    *scale = 1.0;
    if (t->source->transform == NULL) {
        return VSH_OK;
    }
    *scale = vshi_similarity_scale(t->source->transform);
    bool finite = isfinite(*scale);
    for (int i = 0; i < 12; ++i) {
        finite = finite && isfinite(t->source->transform[i]);
    }
    if (!finite || !(*scale > 0.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: the transform must be finite and neither shear, scale unevenly nor flatten",
                         t->name);
    }
    return VSH_OK;
}

vsh_result vsh_heights_create(const vsh_heights_source *source, const vsh_run *run, vsh_heights **heights,
                              vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(heights);
    *heights = NULL;
    vsh_run full;
    vshi_checked_heights terrain;
    double scale = 1.0;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_heights_check(source, "vsh_heights_create", &terrain, error));
    VSHI_TRY(check_transform(&terrain, &scale, error));
    vsh_heights made = {.relief = {.columns = source->columns, .rows = source->rows}};
    size_t offset[VSHI_RELIEF_LEVELS];
    const size_t count = plan(&made.relief, offset);
    void *memory;
    VSHI_TRY(vshi_check_limit(&full, (double)count * sizeof(float), terrain.name, error));
    VSHI_TRY(vshi_allocate(&memory, 1, sizeof made, terrain.name, error));
    const vsh_result result = vshi_allocate((void **)&made.memory, count, sizeof(float), terrain.name, error);
    if (result != VSH_OK) {
        free(memory);
        return result;
    }
    const double cell = source->size[0] / (source->columns - 1);
    made.relief.depth = source->size[1] / (source->rows - 1) / cell;
    made.relief.bottom = terrain.bottom / cell;
    made.info.columns = source->columns;
    made.info.rows = source->rows;
    made.info.lowest = terrain.lowest;
    made.info.highest = terrain.highest;
    made.info.bytes = sizeof made + count * sizeof(float);
    fill(&made, &terrain, offset);
    place(&made, &terrain, scale);
    *heights = memcpy(memory, &made, sizeof made);
    return VSH_OK;
}

void vsh_heights_free(vsh_heights *heights) {
    if (heights != NULL) {
        free(heights->memory);
        free(heights);
    }
}

void vsh_heights_get_info_sized(const vsh_heights *heights, vsh_heights_info *info, size_t info_size) {
    vshi_give(info, info_size, &heights->info, sizeof heights->info);
}
