/* Heightfields from images, and as triangles: the closed solid that is voxelised, and its top as a receiver.
 */
#include "heightfield/heights.h"
#include "image/planes.h"

#include "base/floats.h"
#include "base/memory.h"
#include "mesh/mesh.h"
#include "model/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- checked sources */

static const double LEAST = 1e-12, LARGEST = 1e12;
static const double DEFAULT_BASE = 0.05; /* of the longer side */

static vsh_result check_numbers(const vsh_heights_source *s, const char *name, vsh_error *error) {
    const struct {
        const char *what;
        double value, low, high;
    } fields[] = {
        {"columns", s->columns, 2, VSH_MAX_HEIGHTS_SIDE}, {"rows", s->rows, 2, VSH_MAX_HEIGHTS_SIDE},
        {"size[0]", s->size[0], LEAST, LARGEST},          {"size[1]", s->size[1], LEAST, LARGEST},
        {"height", s->height, -LARGEST, LARGEST},         {"base", s->base, 0.0, LARGEST},
    };
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i) {
        if (!(fields[i].value >= fields[i].low && fields[i].value <= fields[i].high)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s %g is out of range %g … %g", name,
                             fields[i].what, fields[i].value, fields[i].low, fields[i].high);
        }
    }
    return VSH_OK;
}

vsh_result vshi_heights_check(const vsh_heights_source *source, const char *call,
                              vshi_checked_heights *terrain, vsh_error *error) {
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
    *terrain = (vshi_checked_heights){source, name, samples, lowest, highest, lowest - base};
    return VSH_OK;
}

/* --- triangles */

/* Rounding of UVs moves a texel's middle by at most this part of a cell. */
static const double NEAR = 0.01;

/* Samples along one side that vertices stand on. */
typedef struct axis {
    size_t samples;
    const size_t *kept; /* [count] */
    size_t count;
} axis;

static void put(float *p, double x, double y, double z) {
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
}

/* 0 … 1 */
static double place_of(axis a, size_t i) {
    return (double)a.kept[i] / (double)(a.samples - 1);
}

/* Slope between the neighbours of a sample, one of them itself at an edge. */
static double slope(const float *values, size_t stride, size_t i, size_t count, double step) {
    const size_t before = i > 0 ? stride : 0, after = i + 1 < count ? stride : 0;
    const double rise = (double)values[after] - (double)*(values - before);
    return rise / (step * (double)((before > 0) + (after > 0)));
}

static void put_surface(const vsh_heights_source *s, axis across, axis down, size_t column, size_t row,
                        float *normal, float *uv) {
    const size_t i = across.kept[column], j = down.kept[row];
    const float *value = s->values + j * across.samples + i;
    const double dx = s->size[0] / (double)(across.samples - 1), dz = s->size[1] / (double)(down.samples - 1);
    const double x = -s->height * slope(value, 1, i, across.samples, dx);
    const double z = -s->height * slope(value, across.samples, j, down.samples, dz);
    const double length = sqrt(x * x + 1.0 + z * z);
    put(normal, x / length, 1.0 / length, z / length);
    uv[0] = (float)place_of(across, column);
    uv[1] = (float)(1.0 - place_of(down, row));
}

static void put_top(const vsh_heights_source *s, axis across, axis down, vshi_model_shape *shape) {
    for (size_t row = 0; row < down.count; ++row) {
        const float *values = s->values + down.kept[row] * across.samples;
        for (size_t column = 0; column < across.count; ++column) {
            const size_t i = row * across.count + column;
            put(shape->positions + 3 * i, s->size[0] * (place_of(across, column) - 0.5),
                s->height * (double)values[across.kept[column]], s->size[1] * (place_of(down, row) - 0.5));
            if (shape->normals != NULL) {
                put_surface(s, across, down, column, row, shape->normals + 3 * i, shape->uvs[0] + 2 * i);
            }
        }
    }
}

/* Below each sample of the edge, and in the middle. */
static void put_bottom(const vshi_checked_heights *t, vshi_terrain grid, vshi_model_shape *shape) {
    const size_t edge = vshi_terrain_edge_length(grid), cells = (grid.columns - 1) * (grid.rows - 1);
    float *lower = shape->positions + 3 * t->samples;
    for (size_t i = 0; i < edge; ++i) {
        uint32_t side[3];
        vshi_terrain_triangle(grid, 2 * cells + 3 * i, side);
        const float *upper = shape->positions + 3 * (size_t)side[0];
        put(lower + 3 * i, (double)upper[0], t->bottom, (double)upper[2]);
    }
    put(lower + 3 * edge, 0.0, t->bottom, 0.0);
}

/* Memory of a model of one mesh; its arrays too. */
static vsh_result allocate(const char *name, int32_t what, vshi_terrain grid, vsh_model *model,
                           vsh_error *error) {
    const bool solid = what == VSH_HEIGHTS_SOLID;
    const size_t name_size = strlen(name) + 1;
    VSHI_TRY(vshi_allocate((void **)&model->shapes, 1, sizeof *model->shapes, name, error));
    model->shape_count = 1;
    VSHI_TRY(vshi_allocate((void **)&model->entries, 1, sizeof *model->entries, name, error));
    model->entry_count = model->entry_capacity = 1;
    VSHI_TRY(vshi_allocate((void **)&model->entries->name, name_size, 1, name, error));
    memcpy(model->entries->name, name, name_size);

    vshi_model_shape *shape = model->shapes;
    shape->vertex_count = vshi_terrain_vertex_count(grid);
    shape->triangle_count = vshi_terrain_triangle_count(grid);
    VSHI_TRY(vshi_allocate((void **)&shape->positions, shape->vertex_count, sizeof(float[3]), name, error));
    VSHI_TRY(
        vshi_allocate((void **)&shape->indices, shape->triangle_count, sizeof(uint32_t[3]), name, error));
    if (!solid) {
        VSHI_TRY(vshi_allocate((void **)&shape->normals, shape->vertex_count, sizeof(float[3]), name, error));
        VSHI_TRY(vshi_allocate((void **)&shape->uvs[0], shape->vertex_count, sizeof(float[2]), name, error));
        shape->uv_sets = 1;
    }
    return VSH_OK;
}

static vsh_result check(const char *name, int32_t what, vshi_terrain grid, const vsh_run *run,
                        vsh_error *error) {
    if (what != VSH_HEIGHTS_SOLID && what != VSH_HEIGHTS_SURFACE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: what %d is none of VSH_HEIGHTS_…", name, what);
    }
    const size_t samples = grid.columns * grid.rows, edge = vshi_terrain_edge_length(grid);
    if (samples + edge + 1 > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu samples make more than 2^32 - 1 vertices", name,
                         samples);
    }
    const double each = what == VSH_HEIGHTS_SOLID ? 36.0 : 56.0, of_edge = 48.0;
    return vshi_check_limit(run, each * (double)samples + of_edge * (double)edge, name, error);
}

static void build(const vshi_checked_heights *t, int32_t what, axis x, axis z, vsh_model *model) {
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const vshi_terrain grid = {x.count, z.count, what == VSH_HEIGHTS_SOLID};
    vshi_model_shape *shape = model->shapes;
    memcpy(model->entries->transform, t->source->transform != NULL ? t->source->transform : identity,
           sizeof identity);
    put_top(t->source, x, z, shape);
    if (what == VSH_HEIGHTS_SOLID) {
        put_bottom(t, grid, shape);
    }
    for (size_t i = 0; i < shape->triangle_count; ++i) {
        vshi_terrain_triangle(grid, i, shape->indices + 3 * i);
    }
}

/* The samples on both sides of each texel's middle, and the ends; all where `texels` is 0. Returns how many.
 */
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
    vshi_checked_heights terrain;
    size_t *kept = NULL;
    vsh_model *made = NULL;
    vsh_result result;
    VSHI_TRY(vshi_heights_check(source, "vsh_model_from_heights", &terrain, error));
    const size_t columns = (size_t)source->columns, rows = (size_t)source->rows;
    VSHI_TRY_DONE(vshi_allocate((void **)&kept, columns + rows, sizeof *kept, terrain.name, error));
    const axis x = {columns, kept, keep_samples(columns, texels != NULL ? texels[0] : 0, kept)};
    const axis z = {rows, kept + columns, keep_samples(rows, texels != NULL ? texels[1] : 0, kept + columns)};
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

vsh_result vsh_model_from_heights(const vsh_heights_source *source, int32_t what, const vsh_run *run,
                                  vsh_model **model, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(model);
    *model = NULL;
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return vshi_model_of_heights(source, what, NULL, &full, model, error);
}

/* --- images */

static void take_values(const vsh_image *image, size_t count, float *values) {
    const float *r = vshi_image_find_plane(image, "R"), *g = vshi_image_find_plane(image, "G"),
                *b = vshi_image_find_plane(image, "B");
    if (r == NULL || g == NULL || b == NULL) {
        memcpy(values, image->planes[0], count * sizeof *values);
        return;
    }
    for (size_t i = 0; i < count; ++i) {
        /* in this form grey stays what it is, to the bit */
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
    take_values(&image, count, values);
    *map = (vshi_height_image){image.width, image.height, values};
done:
    vsh_image_free(file);
    return result;
}
