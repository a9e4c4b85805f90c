/* Heightfields from images; as triangles: the closed solid that is voxelised, and its top as a receiver; and
 * as casters that are marched: steps are as long as the ray is high over the ground (I. Quilez, "terrain
 * raymarching", 2002), and may pass through ridges narrower than a step. */
#include "shapes/heights.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"
#include "geometry/mesh.h"
#include "io/image/image.h"
#include "io/model/model.h"
#include "light/light.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double IDENTITY[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* --- checked sources */

static const double LEAST = 1e-12, LARGEST = 1e12;
static const double DEFAULT_BASE = 0.05; /* of the longer side */

static vsh_result check_numbers(const vsh_heights_source *s, const char *name, vsh_error *error) {
    const vshi_range fields[] = {
        {"columns", s->columns, 2, VSH_MAX_HEIGHTS_SIDE}, {"rows", s->rows, 2, VSH_MAX_HEIGHTS_SIDE},
        {"size[0]", s->size[0], LEAST, LARGEST},          {"size[1]", s->size[1], LEAST, LARGEST},
        {"height", s->height, -LARGEST, LARGEST},         {"base", s->base, 0.0, LARGEST},
    };
    vsh_error why;
    const vsh_result result = vshi_check_ranges(fields, sizeof fields / sizeof fields[0], &why);
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", name, why.message);
}

/* A source whose numbers are in range. */
typedef struct checked_heights {
    const vsh_heights_source *source;
    const char *name;
    size_t samples;
    double highest, bottom; /* local units */
} checked_heights;

/* Checks sizes and values. `call` names the public function. */
static vsh_result check_source(const vsh_heights_source *source, const char *call, checked_heights *terrain,
                               vsh_error *error) {
    if (source == NULL || source->values == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s is NULL", call,
                         source == NULL ? "source" : "values");
    }
    const char *name = source->name != NULL ? source->name : "heights";
    VSHI_TRY(check_numbers(source, name, error));
    const size_t columns = (size_t)source->columns, samples = columns * (size_t)source->rows;
    double lowest = INFINITY, highest = -INFINITY;
    for (size_t i = 0; i < samples; ++i) {
        const double y = source->height * (double)source->values[i];
        if (!isfinite((float)y)) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: row %zu, column %zu: value %g is no height: it must be finite, and also "
                             "times %g",
                             name, i / columns, i % columns, (double)source->values[i], source->height);
        }
        lowest = y < lowest ? y : lowest;
        highest = y > highest ? y : highest;
    }
    const double base =
        source->base > 0.0 ? source->base : DEFAULT_BASE * fmax(source->size[0], source->size[1]);
    *terrain = (checked_heights){source, name, samples, highest, lowest - base};
    return VSH_OK;
}

/* --- triangles */

/* Share of a cell by which the rounding of UVs may move a texel's middle. */
static const double NEAR = 0.01;

/* The samples along one side that become vertices. */
typedef struct grid_axis {
    size_t samples;
    const size_t *kept; /* [count] */
    size_t count;
} grid_axis;

static void write_point(float *p, double x, double y, double z) {
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
}

/* 0 … 1 */
static double place_of(grid_axis a, size_t i) {
    return (double)a.kept[i] / (double)(a.samples - 1);
}

/* Slope between the neighbours of a sample; at an edge the sample itself replaces one. */
static double slope(const float *values, size_t stride, size_t i, size_t count, double step) {
    const size_t before = i > 0 ? stride : 0, after = i + 1 < count ? stride : 0;
    const double rise = (double)values[after] - (double)*(values - before);
    return rise / (step * (double)((before > 0) + (after > 0)));
}

static void write_surface(const vsh_heights_source *s, grid_axis across, grid_axis down, size_t column,
                          size_t row, float *normal, float *uv) {
    const size_t i = across.kept[column], j = down.kept[row];
    const float *value = s->values + j * across.samples + i;
    const double dx = s->size[0] / (double)(across.samples - 1), dz = s->size[1] / (double)(down.samples - 1);
    const double x = -s->height * slope(value, 1, i, across.samples, dx);
    const double z = -s->height * slope(value, across.samples, j, down.samples, dz);
    const double length = sqrt(x * x + 1.0 + z * z);
    write_point(normal, x / length, 1.0 / length, z / length);
    uv[0] = (float)place_of(across, column);
    uv[1] = (float)(1.0 - place_of(down, row));
}

static void write_top(const vsh_heights_source *s, grid_axis across, grid_axis down,
                      vshi_model_shape *shape) {
    for (size_t row = 0; row < down.count; ++row) {
        const float *values = s->values + down.kept[row] * across.samples;
        for (size_t column = 0; column < across.count; ++column) {
            const size_t i = row * across.count + column;
            write_point(shape->positions + 3 * i, s->size[0] * (place_of(across, column) - 0.5),
                        s->height * (double)values[across.kept[column]],
                        s->size[1] * (place_of(down, row) - 0.5));
            if (shape->normals != NULL) {
                write_surface(s, across, down, column, row, shape->normals + 3 * i, shape->uvs[0] + 2 * i);
            }
        }
    }
}

/* Writes the bottom: a vertex below each sample of the edge, and its middle. */
static void write_bottom(const checked_heights *t, vshi_terrain grid, vshi_model_shape *shape) {
    const size_t edge = vshi_terrain_edge_length(grid), cells = (grid.columns - 1) * (grid.rows - 1);
    float *lower = shape->positions + 3 * t->samples;
    for (size_t i = 0; i < edge; ++i) {
        uint32_t side[3];
        vshi_terrain_triangle(grid, 2 * cells + 3 * i, side);
        const float *upper = shape->positions + 3 * (size_t)side[0];
        write_point(lower + 3 * i, (double)upper[0], t->bottom, (double)upper[2]);
    }
    write_point(lower + 3 * edge, 0.0, t->bottom, 0.0);
}

/* Allocates a model of one mesh, with its arrays. */
static vsh_result allocate(const char *name, int32_t what, vshi_terrain grid, vsh_model *model,
                           vsh_error *error) {
    const bool solid = what == VSH_HEIGHTS_SOLID;
    VSHI_TRY(vshi_allocate((void **)&model->shapes, 1, sizeof *model->shapes, name, error));
    model->shape_count = 1;
    VSHI_TRY(vshi_allocate((void **)&model->entries, 1, sizeof *model->entries, name, error));
    model->entry_count = model->entry_capacity = 1;
    VSHI_TRY(vshi_copy_text(&model->entries->name, name, name, error));
    vshi_model_shape *shape = model->shapes;
    shape->vertex_count = vshi_terrain_vertex_count(grid);
    shape->triangle_count = vshi_terrain_triangle_count(grid);
    shape->uv_sets = solid ? 0 : 1;
    const size_t smooth = solid ? 0 : shape->vertex_count;
    const vshi_array arrays[] = {VSHI_ARRAY(shape->positions, 3 * shape->vertex_count),
                                 VSHI_ARRAY(shape->indices, 3 * shape->triangle_count),
                                 VSHI_ARRAY(shape->normals, 3 * smooth),
                                 VSHI_ARRAY(shape->uvs[0], 2 * smooth)};
    return VSHI_ALLOCATE_ALL(arrays, name, error);
}

static vsh_result check(const char *name, int32_t what, vshi_terrain grid, const vsh_run *run,
                        vsh_error *error) {
    if (what != VSH_HEIGHTS_SOLID && what != VSH_HEIGHTS_SURFACE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: part %d is none of VSH_HEIGHTS_…", name, what);
    }
    const size_t samples = grid.columns * grid.rows, edge = vshi_terrain_edge_length(grid);
    if (samples + edge + 1 > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu samples make more than 2^32 - 1 vertices", name,
                         samples);
    }
    const double each = what == VSH_HEIGHTS_SOLID ? 36.0 : 56.0, of_edge = 48.0;
    return vshi_check_limit(run, each * (double)samples + of_edge * (double)edge, name, error);
}

static void build(const checked_heights *t, int32_t what, grid_axis x, grid_axis z, vsh_model *model) {
    const vshi_terrain grid = {x.count, z.count, what == VSH_HEIGHTS_SOLID};
    vshi_model_shape *shape = model->shapes;
    memcpy(model->entries->transform, t->source->transform != NULL ? t->source->transform : IDENTITY,
           sizeof IDENTITY);
    write_top(t->source, x, z, shape);
    if (what == VSH_HEIGHTS_SOLID) {
        write_bottom(t, grid, shape);
    }
    for (size_t i = 0; i < shape->triangle_count; ++i) {
        vshi_terrain_triangle(grid, i, shape->indices + 3 * i);
    }
}

/* Lists the samples on both sides of each texel's middle, and the ends; all samples if `texels` is 0. Returns
 * their count. */
static size_t keep_samples(size_t samples, size_t texels, size_t *kept) {
    size_t count = 1;
    kept[0] = 0;
    for (size_t texel = 0; texel < texels; ++texel) {
        const double at = ((double)texel + 0.5) / (double)texels * (double)(samples - 1);
        for (double i = floor(at - NEAR); i <= ceil(at + NEAR) && i < (double)samples; ++i) {
            if (i > (double)kept[count - 1]) {
                kept[count++] = (size_t)i;
            }
        }
    }
    for (size_t i = texels == 0 ? 1 : samples - 1; i < samples; ++i) {
        if (i > kept[count - 1]) {
            kept[count++] = i;
        }
    }
    return count;
}

vsh_result vshi_model_of_heights(const vsh_heights_source *source, int32_t what, const size_t *texels,
                                 const vsh_run *run, vsh_model **model, vsh_error *error) {
    *model = NULL;
    checked_heights terrain;
    size_t *kept = NULL;
    vsh_model *made = NULL;
    vsh_result result;
    VSHI_TRY(check_source(source, "vsh_model_from_heights", &terrain, error));
    const size_t columns = (size_t)source->columns, rows = (size_t)source->rows;
    VSHI_TRY_DONE(vshi_allocate((void **)&kept, columns + rows, sizeof *kept, terrain.name, error));
    const grid_axis x = {columns, kept, keep_samples(columns, texels != NULL ? texels[0] : 0, kept)};
    const grid_axis z = {rows, kept + columns,
                         keep_samples(rows, texels != NULL ? texels[1] : 0, kept + columns)};
    const vshi_terrain grid = {x.count, z.count, what == VSH_HEIGHTS_SOLID};
    VSHI_TRY_DONE(check(terrain.name, what, grid, run, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, terrain.name, error));
    VSHI_TRY_DONE(allocate(terrain.name, what, grid, made, error));
    build(&terrain, what, x, z, made);
    *model = made;
    made = NULL;
done:
    vsh_model_free(made);
    free(kept);
    return result;
}

vsh_result vsh_model_from_heights(const vsh_heights_source *source, vsh_heights_part part, const vsh_run *run,
                                  vsh_model **model, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(model);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return vshi_model_of_heights(source, part, NULL, &full, model, error);
}

/* --- images */

static void find_heights(const vsh_image *image, size_t count, float *values) {
    const float *r = vshi_image_find_plane(image, "R"), *g = vshi_image_find_plane(image, "G"),
                *b = vshi_image_find_plane(image, "B");
    if (r == NULL || g == NULL || b == NULL) {
        memcpy(values, image->planes[0], count * sizeof *values);
        return;
    }
    for (size_t i = 0; i < count; ++i) {
        /* this form keeps grey exact */
        values[i] = g[i] + 0.2126f * (r[i] - g[i]) + 0.0722f * (b[i] - g[i]);
    }
}

vsh_result vshi_height_image_read(const char *path, const vsh_run *run, vshi_height_image *map,
                                  vsh_error *error) {
    *map = (vshi_height_image){0, 0, NULL};
    vsh_image_file *file = NULL;
    VSHI_TRY(vsh_image_read(path, run, &file, error));
    const vsh_image image = vsh_image_view(file);
    const size_t count = (size_t)image.width * (size_t)image.height;
    void *values = NULL;
    vsh_result result;
    if (image.width < 2 || image.height < 2 || image.width > VSH_MAX_HEIGHTS_SIDE ||
        image.height > VSH_MAX_HEIGHTS_SIDE) {
        result = vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: %d × %d pixels are no heightfield: expected 2 … %d along each side", path,
                           image.width, image.height, VSH_MAX_HEIGHTS_SIDE);
        goto done;
    }
    VSHI_TRY_DONE(vshi_check_limit(run, (double)count * 4.0 * (1.0 + image.channel_count), path, error));
    VSHI_TRY_DONE(vshi_allocate(&values, count, sizeof(float), path, error));
    find_heights(&image, count, values);
    *map = (vshi_height_image){image.width, image.height, values};
done:
    vsh_image_free(file);
    return result;
}

/* --- casters */

/* A point that is no more cells below the surface than this counts as on it: receivers are meshes of floats,
 * whose triangles may differ from the heights. */
static const double UNDER = 0.25;
/* A step is this share of the height over the ground, and at least so many cells. */
static const double STEP = 0.25, LEAST_STEP = 0.25;
/* A smaller visible share counts as 0. */
static const double DARK = 0.004;

struct vshi_heights {
    int32_t columns, rows;
    double depth;           /* a cell's length along z, in cells' widths, like the members below */
    double lowest, highest; /* bottom, and the highest sample */
    vshi_heights_info info;
    double to_cells[12]; /* world to cells: x and z from sample (0, 0), y up */
    double unit;         /* world units in a cell's width */
    float height[];      /* [rows][columns] */
};

/* Height of the surface over (x, z), within the grid. */
static double height_over(const vshi_heights *heights, double x, double z) {
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
static void place_cells(vshi_heights *made, const checked_heights *t, double scale) {
    const vsh_heights_source *s = t->source;
    const double *m = s->transform != NULL ? s->transform : IDENTITY;
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
    vshi_heights_info *info = &made->info;
    vshi_empty_box(info->bounds_min, info->bounds_max);
    vshi_grow_box_by(info->bounds_min, info->bounds_max, m, (double[]){-corner[0], t->bottom, -corner[2]},
                     (double[]){corner[0], t->highest, corner[2]});
}

vsh_result vshi_heights_create(const vsh_heights_source *source, const vsh_run *run, vshi_heights **heights,
                               vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(heights);
    checked_heights t;
    double scale = 1.0;
    VSHI_TRY(check_source(source, "vshi_heights_create", &t, error));
    VSHI_TRY(vshi_similarity_check(source->transform, t.name, &scale, error));
    VSHI_TRY(vshi_check_limit(run, (double)t.samples * sizeof(float), t.name, error));
    vshi_heights *made;
    const size_t bytes = sizeof *made + t.samples * sizeof made->height[0];
    VSHI_TRY(vshi_allocate((void **)&made, 1, bytes, t.name, error));
    const double cell = source->size[0] / (source->columns - 1);
    made->columns = source->columns;
    made->rows = source->rows;
    made->depth = source->size[1] / (source->rows - 1) / cell;
    made->lowest = t.bottom / cell;
    made->highest = t.highest / cell;
    made->info.bytes = bytes;
    for (size_t i = 0; i < t.samples; ++i) {
        made->height[i] = (float)(source->height * (double)source->values[i] / cell);
    }
    place_cells(made, &t, scale);
    *heights = made;
    return VSH_OK;
}

void vshi_heights_free(vshi_heights *heights) {
    free(heights);
}

void vshi_heights_get_info(const vshi_heights *heights, vshi_heights_info *info) {
    *info = heights->info;
}

/* --- points */

typedef enum stand {
    STAND_FREE,    /* above the surface, beside the solid or beneath it */
    STAND_BURIED,  /* within the solid */
    STAND_INVALID, /* not finite, or a normal of no length */
} stand;

/* Places point i in cells. */
static stand find_stand(const vshi_heights *heights, const vsh_points *points, size_t i, double offset,
                        vshi_vec *at) {
    *at = vshi_transform_point(heights->to_cells, vshi_vec_of(points->positions + 3 * i));
    if (points->normals != NULL) {
        const vshi_vec normal =
            vshi_unit(vshi_transform_vector(heights->to_cells, vshi_vec_off(points->normals + 3 * i)));
        if (!(vshi_dot(normal, normal) > 0.5)) {
            return STAND_INVALID;
        }
        *at = vshi_add(*at, vshi_scale(normal, offset / heights->unit));
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

double vshi_heights_offset(const vshi_heights *heights, double start_offset) {
    return start_offset > 0.0 ? start_offset * heights->unit : 0.0;
}

bool vshi_heights_hold(const vshi_heights *heights, const double position[3]) {
    const vsh_points points = {1, position, NULL, NULL};
    vshi_vec at;
    return find_stand(heights, &points, 0, 0.0, &at) == STAND_BURIED;
}

/* --- the march */

/* The visible share of a light along a unit axis; 0 or 1 if `tangent`, that of its half angle, is 0. */
static double march(const vshi_heights *heights, vshi_vec at, vshi_vec axis, double tangent, double far,
                    vsh_shade_stats *stats) {
    double t = 0.0, visible = 1.0;
    const double top = tangent > 0.0 ? INFINITY : heights->highest;
    vshi_clip_axis(at.x, axis.x, 0.0, heights->columns - 1, &t, &far);
    vshi_clip_axis(at.y, axis.y, heights->lowest, top, &t, &far);
    vshi_clip_axis(at.z, axis.z, 0.0, (heights->rows - 1) * heights->depth, &t, &far);
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
        if (axis.y > 0.0 && p.y - heights->highest > tangent * t) { /* the whole cone is above the ground */
            break;
        }
        t += fmax(LEAST_STEP, STEP * gap);
    }
    return visible;
}

void vshi_heights_shadow(const vshi_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double offset, float *visibility,
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
        const stand where = find_stand(heights, points, i, offset, &at);
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
