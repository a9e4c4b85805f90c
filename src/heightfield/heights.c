/* The march of I. Quilez, "terrain raymarching" (2002): steps are as long as the ray is high over the ground.
 * It may pass through ridges that are narrower than a step. */
#include "heightfield/heights.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "light/view.h"

#include <stdlib.h>
#include <string.h>

/* Receivers are float meshes, and their triangles may differ from the heights'. A point at most this far
 * below the surface counts as on it. In cells. */
static const double UNDER = 0.25;
/* A step is this part of the height over the ground, and at least so many cells. */
static const double STEP = 0.25, LEAST_STEP = 0.25;
/* A light of which less is visible is hidden. */
static const double DARK = 0.004;

struct vsh_heights {
    int32_t columns, rows;
    double depth;           /* a cell's length along z, in cells' widths, as are the members below */
    double lowest, highest; /* bottom, and the highest sample */
    vsh_heights_info info;
    double to_cells[12]; /* world to cells: x and z from sample (0, 0), y up */
    double unit;         /* world units in a cell's width */
    float *height;       /* [rows][columns] */
};

/* Height of the surface over (x, z), within the grid. */
static double height_over(const vsh_heights *heights, double x, double z) {
    const double row = z / heights->depth;
    int32_t i = (int32_t)x, j = (int32_t)row;
    i = i < 0 ? 0 : i > heights->columns - 2 ? heights->columns - 2 : i;
    j = j < 0 ? 0 : j > heights->rows - 2 ? heights->rows - 2 : j;
    const float *h = heights->height + (size_t)j * (size_t)heights->columns + i;
    const double u = x - i, v = row - j, h00 = (double)h[0], h01 = (double)h[1];
    const double h10 = (double)h[heights->columns], h11 = (double)h[heights->columns + 1];
    return u >= v ? h00 + u * (h01 - h00) + v * (h11 - h01) : h00 + v * (h10 - h00) + u * (h11 - h10);
}

/* World to cells: the inverse of a similarity is its transpose over the squared scale. */
static void place(vsh_heights *made, const vshi_checked_heights *t, double scale) {
    const vsh_heights_source *s = t->source;
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const double *m = s->transform != NULL ? s->transform : identity;
    const double cell = s->size[0] / (made->columns - 1);
    const double corner[3] = {0.5 * s->size[0], 0.0, 0.5 * s->size[1]};
    for (int row = 0; row < 3; ++row) {
        double *to = made->to_cells + 4 * row, moved = 0.0;
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
    vshi_checked_heights t;
    double scale = 1.0;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_heights_check(source, "vsh_heights_create", &t, error));
    VSHI_TRY(check_transform(&t, &scale, error));
    VSHI_TRY(vshi_check_limit(&full, (double)t.samples * sizeof(float), t.name, error));
    vsh_heights *made;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, t.name, error));
    const vsh_result result = vshi_allocate((void **)&made->height, t.samples, sizeof(float), t.name, error);
    if (result != VSH_OK) {
        free(made);
        return result;
    }
    const double cell = source->size[0] / (source->columns - 1);
    made->columns = source->columns;
    made->rows = source->rows;
    made->depth = source->size[1] / (source->rows - 1) / cell;
    made->lowest = t.bottom / cell;
    made->highest = t.highest / cell;
    made->info = (vsh_heights_info){.columns = source->columns,
                                    .rows = source->rows,
                                    .lowest = t.lowest,
                                    .highest = t.highest,
                                    .bytes = sizeof *made + t.samples * sizeof(float)};
    for (size_t i = 0; i < t.samples; ++i) {
        made->height[i] = (float)(source->height * (double)source->values[i] / cell);
    }
    place(made, &t, scale);
    *heights = made;
    return VSH_OK;
}

void vsh_heights_free(vsh_heights *heights) {
    if (heights != NULL) {
        free(heights->height);
        free(heights);
    }
}

void vsh_heights_get_info(const vsh_heights *heights, vsh_heights_info *info) {
    *info = heights->info;
}

/* --- points */

typedef enum stand {
    STAND_FREE,    /* above the surface, beside the solid or beneath it */
    STAND_BURIED,  /* within the solid */
    STAND_INVALID, /* not finite, or a normal of no length */
} stand;

/* Where point i stands, in cells. */
static stand find_stand(const vsh_heights *heights, const vsh_points *points, size_t i, double lift,
                        vshi_vec *at) {
    *at = vshi_transform_point(heights->to_cells, vshi_vec_of(points->positions + 3 * i));
    if (points->normals != NULL) {
        const vshi_vec normal =
            vshi_unit(vshi_transform_vector(heights->to_cells, vshi_vec_off(points->normals + 3 * i)));
        if (!(vshi_dot(normal, normal) > 0.5)) {
            return STAND_INVALID;
        }
        *at = vshi_add(*at, vshi_scale(normal, lift / heights->unit));
    }
    if (!vshi_finite(*at)) {
        return STAND_INVALID;
    }
    if (at->x >= 0.0 && at->x <= heights->columns - 1 && at->z >= 0.0 &&
        at->z <= (heights->rows - 1) * heights->depth) {
        const double surface = height_over(heights, at->x, at->z);
        if (at->y < surface && at->y >= surface - UNDER) {
            at->y = surface;
        } else if (at->y < surface && at->y > heights->lowest) {
            return STAND_BURIED;
        }
    }
    return STAND_FREE;
}

double vshi_heights_lift(const vsh_heights *heights, double start_offset) {
    return start_offset > 0.0 ? start_offset * heights->unit : 0.0;
}

bool vshi_heights_hold(const vsh_heights *heights, const double position[3]) {
    const vsh_points points = {1, position, NULL, NULL};
    vshi_vec at;
    return find_stand(heights, &points, 0, 0.0, &at) == STAND_BURIED;
}

/* --- the march */

/* Where a ray is between two planes across one axis. */
static void clip(double from, double along, double low, double high, double *near, double *far) {
    if (along == 0.0) {
        *far = from >= low && from <= high ? *far : -1.0;
        return;
    }
    const double a = (low - from) / along, b = (high - from) / along;
    *near = fmax(*near, fmin(a, b));
    *far = fmin(*far, fmax(a, b));
}

/* The share of a light of the tangent `tangent` that is visible along a unit axis: 0 or 1 where that is 0. */
static double march(const vsh_heights *heights, vshi_vec at, vshi_vec axis, double tangent, double far,
                    vsh_shade_stats *stats) {
    double t = 0.0, visible = 1.0;
    const double top = tangent > 0.0 ? INFINITY : heights->highest;
    clip(at.x, axis.x, 0.0, heights->columns - 1, &t, &far);
    clip(at.y, axis.y, heights->lowest, top, &t, &far);
    clip(at.z, axis.z, 0.0, (heights->rows - 1) * heights->depth, &t, &far);
    for (t = fmax(t, LEAST_STEP); t < far;) {
        const vshi_vec p = vshi_add(at, vshi_scale(axis, t));
        const double gap = p.y - height_over(heights, p.x, p.z);
        ++stats->samples;
        if (gap < 0.0) {
            return 0.0;
        }
        if (tangent > 0.0) {
            visible = fmin(visible, gap / (tangent * t));
        }
        if (visible < DARK) {
            return 0.0;
        }
        if (axis.y > 0.0 && p.y - heights->highest > tangent * t) { /* the whole cone is above all */
            break;
        }
        t += fmax(LEAST_STEP, STEP * gap);
    }
    return visible;
}

void vshi_heights_shadow(const vsh_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats) {
    const bool hard = method == VSH_SHADOW_HARD;
    vshi_light_place place = vshi_light_in_world(light);
    if (place.parallel) {
        place.towards = vshi_unit(vshi_transform_vector(heights->to_cells, vshi_vec_of(light->direction)));
    } else {
        place = vshi_light_moved(&place, heights->to_cells, heights->unit);
    }
    for (size_t i = begin; i < end; ++i) {
        float *value = &visibility[i - begin];
        vshi_vec at;
        vshi_light_view view;
        const stand where = find_stand(heights, points, i, lift, &at);
        if (where != STAND_FREE) {
            *value = where == STAND_BURIED ? 0.0f : NAN;
            continue;
        }
        const vshi_light_side side = vshi_light_look(&place, at, hard, &view);
        if (side != VSHI_LIGHT_SEEN) {
            *value = side == VSHI_LIGHT_WITHIN ? 1.0f : 0.0f;
            continue;
        }
        ++stats->marches;
        const double tangent = hard ? 0.0 : vshi_light_tangent(&place, &view);
        *value = (float)march(heights, at, view.axis, tangent, vshi_light_end(&view), stats);
    }
}
