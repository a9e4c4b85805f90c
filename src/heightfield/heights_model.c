/* A heightfield as triangles: the closed solid that is voxelised, and its top as a receiver. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "heightfield/heights_check.h"
#include "model/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct builder {
    const vshi_checked_heights *terrain;
    size_t columns, rows;
    vshi_model_shape *shape;
    uint32_t *next; /* index to write */
} builder;

static void put_position(float *p, double x, double y, double z) {
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
}

static double along(double size, size_t i, size_t count) {
    return size * ((double)i / (double)(count - 1) - 0.5);
}

static void put_triangle(builder *b, size_t i, size_t j, size_t k) {
    b->next[0] = (uint32_t)i;
    b->next[1] = (uint32_t)j;
    b->next[2] = (uint32_t)k;
    b->next += 3;
}

static void put_top(builder *b) {
    const vsh_heights_source *s = b->terrain->source;
    for (size_t row = 0; row < b->rows; ++row) {
        for (size_t column = 0; column < b->columns; ++column) {
            const size_t i = row * b->columns + column;
            put_position(b->shape->positions + 3 * i, along(s->size[0], column, b->columns),
                         s->height * (double)s->values[i], along(s->size[1], row, b->rows));
        }
    }
    for (size_t row = 0; row + 1 < b->rows; ++row) {
        for (size_t column = 0; column + 1 < b->columns; ++column) {
            const size_t i = row * b->columns + column, below = i + b->columns;
            put_triangle(b, i, below + 1, i + 1);
            put_triangle(b, i, below, below + 1);
        }
    }
}

/* Sample `i` of the way around the edge: along row 0, then the last column, the last row, the first column.
 */
static size_t edge_sample(const builder *b, size_t i) {
    const size_t across = b->columns - 1, down = b->rows - 1;
    if (i < across) {
        return i;
    }
    i -= across;
    if (i < down) {
        return i * b->columns + across;
    }
    i -= down;
    if (i < across) {
        return down * b->columns + across - i;
    }
    return (down - (i - across)) * b->columns;
}

static size_t edge_length(size_t columns, size_t rows) {
    return 2 * (columns - 1) + 2 * (rows - 1);
}

/* The sides, and a bottom that is a fan around its middle: sides and bottom share every vertex of the edge.
 */
static void put_sides(builder *b) {
    const size_t samples = b->terrain->samples, edge = edge_length(b->columns, b->rows);
    const double bottom = b->terrain->bottom;
    float *lower = b->shape->positions + 3 * samples;
    for (size_t i = 0; i < edge; ++i) {
        const float *upper = b->shape->positions + 3 * edge_sample(b, i);
        put_position(lower + 3 * i, (double)upper[0], bottom, (double)upper[2]);
        const size_t next = (i + 1) % edge, from = edge_sample(b, i), to = edge_sample(b, next);
        put_triangle(b, from, to, samples + next);
        put_triangle(b, from, samples + next, samples + i);
        put_triangle(b, samples + edge, samples + i, samples + next);
    }
    put_position(lower + 3 * edge, 0.0, bottom, 0.0);
}

/* Slope between the neighbours of a sample, one of them itself at an edge. */
static double slope(const float *values, size_t stride, size_t i, size_t count, double step) {
    const size_t before = i > 0 ? stride : 0, after = i + 1 < count ? stride : 0;
    const double rise = (double)values[after] - (double)*(values - before);
    return rise / (step * (double)((before > 0) + (after > 0)));
}

static void put_surface_vertices(builder *b) {
    const vsh_heights_source *s = b->terrain->source;
    const double dx = s->size[0] / (double)(b->columns - 1), dz = s->size[1] / (double)(b->rows - 1);
    for (size_t row = 0; row < b->rows; ++row) {
        for (size_t column = 0; column < b->columns; ++column) {
            const size_t i = row * b->columns + column;
            const double x = -s->height * slope(s->values + i, 1, column, b->columns, dx);
            const double z = -s->height * slope(s->values + i, b->columns, row, b->rows, dz);
            const double length = sqrt(x * x + 1.0 + z * z);
            put_position(b->shape->normals + 3 * i, x / length, 1.0 / length, z / length);
            b->shape->uvs[0][2 * i] = (float)((double)column / (double)(b->columns - 1));
            b->shape->uvs[0][2 * i + 1] = (float)(1.0 - (double)row / (double)(b->rows - 1));
        }
    }
}

/* Memory of a model of one mesh; its arrays too. */
static vsh_result allocate(const vshi_checked_heights *t, int32_t what, vsh_model *model, vsh_error *error) {
    const bool solid = what == VSH_HEIGHTS_SOLID;
    const size_t columns = (size_t)t->source->columns, rows = (size_t)t->source->rows;
    const size_t edge = edge_length(columns, rows);
    const size_t vertices = t->samples + (solid ? edge + 1 : 0);
    const size_t triangles = 2 * (columns - 1) * (rows - 1) + (solid ? 3 * edge : 0);
    const size_t name_size = strlen(t->name) + 1;

    VSHI_TRY(vshi_allocate((void **)&model->shapes, 1, sizeof *model->shapes, t->name, error));
    model->shape_count = 1;
    VSHI_TRY(vshi_allocate((void **)&model->entries, 1, sizeof *model->entries, t->name, error));
    model->entry_count = model->entry_capacity = 1;
    VSHI_TRY(vshi_allocate((void **)&model->entries->name, name_size, 1, t->name, error));
    memcpy(model->entries->name, t->name, name_size);

    vshi_model_shape *shape = model->shapes;
    VSHI_TRY(vshi_allocate((void **)&shape->positions, vertices, sizeof(float[3]), t->name, error));
    VSHI_TRY(vshi_allocate((void **)&shape->indices, triangles, sizeof(uint32_t[3]), t->name, error));
    if (!solid) {
        VSHI_TRY(vshi_allocate((void **)&shape->normals, vertices, sizeof(float[3]), t->name, error));
        VSHI_TRY(vshi_allocate((void **)&shape->uvs[0], vertices, sizeof(float[2]), t->name, error));
        shape->uv_sets = 1;
    }
    shape->vertex_count = vertices;
    shape->triangle_count = triangles;
    return VSH_OK;
}

static vsh_result check(const vshi_checked_heights *t, int32_t what, const vsh_run *run, vsh_error *error) {
    if (what != VSH_HEIGHTS_SOLID && what != VSH_HEIGHTS_SURFACE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: what %d is none of VSH_HEIGHTS_…", t->name, what);
    }
    const size_t edge = edge_length((size_t)t->source->columns, (size_t)t->source->rows);
    if (t->samples + edge + 1 > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %zu samples make more than 2^32 - 1 vertices", t->name,
                         t->samples);
    }
    const double each = what == VSH_HEIGHTS_SOLID ? 36.0 : 56.0, of_edge = 48.0;
    return vshi_check_limit(run, each * (double)t->samples + of_edge * (double)edge, t->name, error);
}

static void build(const vshi_checked_heights *t, int32_t what, vsh_model *model) {
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    builder b = {t, (size_t)t->source->columns, (size_t)t->source->rows, model->shapes,
                 model->shapes->indices};
    memcpy(model->entries->transform, t->source->transform != NULL ? t->source->transform : identity,
           sizeof identity);
    put_top(&b);
    if (what == VSH_HEIGHTS_SOLID) {
        put_sides(&b);
    } else {
        put_surface_vertices(&b);
    }
}

vsh_result vsh_model_from_heights(const vsh_heights_source *source, int32_t what, const vsh_run *run,
                                  vsh_model **model, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(model);
    *model = NULL;
    vsh_run full;
    vshi_checked_heights terrain;
    vsh_model *made;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_heights_check(source, "vsh_model_from_heights", &terrain, error));
    VSHI_TRY(check(&terrain, what, &full, error));
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, terrain.name, error));
    const vsh_result result = allocate(&terrain, what, made, error);
    if (result != VSH_OK) {
        vsh_model_free(made);
        return result;
    }
    build(&terrain, what, made);
    *model = made;
    return VSH_OK;
}
