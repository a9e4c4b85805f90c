/* Charts of all shapes: each step over all of them at once, so that one large mesh and a thousand small ones
 * keep threads busy alike. */
#include "unwrap/shapes.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "mesh/mesh.h"
#include "mesh/weld.h"

#include <stdlib.h>

static const char what[] = "charts of meshes";

/* Two transforms are alike if the products of their axes, over their sum, differ by no more. Those made of
 * 32-bit quaternions differ by 1e-7 or so. */
static const double ALIKE = 1e-5;

/* Share of all charts' area that charts are joined to: larger ones leave gaps between them that nothing
 * fills. */
static const double LARGEST = 0.35;

enum {
    MOST_SHAPES = 64, /* of one set of arrays that a mesh is compared with */
    MOST_ROUNDS = 24, /* of joining charts */
    STEPS = 6         /* of the job, for each triangle */
};

/* --- instances */

/* Returns a transform's size, the root of the sum of its axes' squares. `gram` is what is equal where the
 * transforms differ by a similarity: dot products of the axes, over the sum of their squares. */
static double measure_transform(const double *m, double gram[6]) {
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    m = m != NULL ? m : identity;
    double most = 0.0, squares = 0.0;
    for (int i = 0; i < 12; ++i) { /* no square leaves the range of doubles */
        most = i % 4 != 3 && fabs(m[i]) > most ? fabs(m[i]) : most;
    }
    for (int i = 0; i < 12; ++i) {
        squares += i % 4 != 3 ? m[i] / most * (m[i] / most) : 0.0;
    }
    for (int a = 0, at = 0; a < 3; ++a) {
        for (int b = a; b < 3; ++b, ++at) {
            gram[at] = 0.0;
            for (int row = 0; row < 3; ++row) {
                gram[at] += m[4 * row + a] / most * (m[4 * row + b] / most);
            }
        }
    }
    const double sum = gram[0] + gram[3] + gram[5];
    for (int i = 0; i < 6; ++i) {
        gram[i] /= sum;
    }
    return most * sqrt(squares);
}

static bool are_alike(const double *a, const double *b) {
    double x[6], y[6];
    measure_transform(a, x);
    measure_transform(b, y);
    for (int i = 0; i < 6; ++i) {
        if (!(fabs(x[i] - y[i]) <= ALIKE)) {
            return false;
        }
    }
    return true;
}

/* Meshes of the same arrays have the same `arrays`. */
typedef struct array_set {
    uintptr_t arrays[6];
    size_t index; /* of the mesh */
} array_set;

static int compare_arrays(const array_set *x, const array_set *y) {
    for (int i = 0; i < 6; ++i) {
        if (x->arrays[i] != y->arrays[i]) {
            return x->arrays[i] < y->arrays[i] ? -1 : 1;
        }
    }
    return 0;
}

static int compare_meshes(const void *a, const void *b) {
    const array_set *x = a, *y = b;
    const int arrays = compare_arrays(x, y);
    return arrays != 0 ? arrays : (x->index > y->index) - (x->index < y->index);
}

/* first[i]: the first mesh that mesh i is an instance of. No address shows in it: of one set of arrays,
 * meshes are looked at in their order. */
static vsh_result find_first(const vsh_mesh *meshes, size_t count, size_t *first, vsh_error *error) {
    array_set *sorted = NULL;
    VSHI_TRY(vshi_allocate((void **)&sorted, count, sizeof *sorted, what, error));
    for (size_t i = 0; i < count; ++i) {
        const vsh_mesh *m = &meshes[i];
        sorted[i] = (array_set){{(uintptr_t)m->positions, (uintptr_t)m->indices, (uintptr_t)m->normals,
                                 (uintptr_t)m->uvs, m->vertex_count, m->triangle_count},
                                i};
    }
    qsort(sorted, count, sizeof *sorted, compare_meshes);
    for (size_t begin = 0, end; begin < count; begin = end) {
        size_t shapes[MOST_SHAPES], shape_count = 0;
        for (end = begin; end < count && compare_arrays(&sorted[begin], &sorted[end]) == 0; ++end) {
            const size_t own = sorted[end].index;
            first[own] = own;
            for (size_t k = 0; k < shape_count && first[own] == own; ++k) {
                first[own] = are_alike(meshes[shapes[k]].transform, meshes[own].transform) ? shapes[k] : own;
            }
            if (first[own] == own && shape_count < MOST_SHAPES) {
                shapes[shape_count++] = own;
            }
        }
    }
    free(sorted);
    return VSH_OK;
}

vsh_result vshi_shapes_find(const vsh_mesh *meshes, size_t mesh_count, vshi_shapes *shapes,
                            vsh_error *error) {
    *shapes = (vshi_shapes){.meshes = meshes, .mesh_count = mesh_count};
    size_t *first = NULL;
    const vshi_array arrays[] = {VSHI_ARRAY(first, mesh_count), VSHI_ARRAY(shapes->list, mesh_count),
                                 VSHI_ARRAY(shapes->instances, mesh_count)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    VSHI_TRY_DONE(find_first(meshes, mesh_count, first, error));
    for (size_t i = 0; i < mesh_count; ++i) {
        vshi_instance *instance = &shapes->instances[i];
        if (first[i] == i) {
            *instance = (vshi_instance){(uint32_t)shapes->count, 1.0};
            shapes->list[shapes->count++].mesh = &meshes[i];
        } else {
            double gram[6];
            instance->shape = shapes->instances[first[i]].shape;
            instance->scale = measure_transform(meshes[i].transform, gram) /
                              measure_transform(meshes[first[i]].transform, gram);
        }
    }
done:
    free(first);
    return result;
}

static void end_making(vshi_shape *shape) {
    vshi_merging_free(&shape->merging);
    free(shape->triangles);
    free(shape->chart_begin);
    shape->chart_begin = shape->triangles = NULL;
}

void vshi_shapes_free(vshi_shapes *shapes) {
    for (size_t i = 0; i < shapes->count; ++i) {
        vshi_shape *shape = &shapes->list[i];
        end_making(shape);
        free(shape->boxes);
        vshi_patches_free(&shape->patches);
        vshi_cut_mesh_free(&shape->surface);
    }
    free(shapes->instances);
    free(shapes->list);
    *shapes = (vshi_shapes){0};
}

typedef struct making {
    vshi_shapes *shapes;
    const vsh_unwrap_options *options;
    vshi_job *job;
    size_t triangles; /* of all shapes */
} making;

/* --- surfaces, and charts grown over them */

static vsh_result grow_charts(const making *m, vshi_shape *shape, vsh_error *error) {
    const vshi_cut_mesh *s = &shape->surface;
    uint32_t *chart = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&chart, s->count, sizeof *chart, what, error));
    VSHI_TRY_DONE(vshi_grow_charts(s, m->job, chart, &shape->chart_count, error));
    const vshi_array arrays[] = {VSHI_ARRAY(shape->chart_begin, (size_t)shape->chart_count + 2),
                                 VSHI_ARRAY(shape->triangles, s->count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, what, error));
    vshi_list_groups(chart, s->count, shape->chart_count, shape->chart_begin, shape->triangles);
done:
    free(chart);
    return result;
}

/* A vshi_element_fn over shapes. */
static vsh_result grow_shape(void *user, size_t i, vsh_error *error) {
    const making *m = user;
    vshi_shape *shape = &m->shapes->list[i];
    const size_t index = (size_t)(shape->mesh - m->shapes->meshes);
    if (m->options->keep_uvs == VSH_UNWRAP_KEEP && shape->mesh->uvs != NULL) {
        VSHI_TRY(vshi_cut_mesh_make(shape->mesh, index, true, &shape->surface, error));
        VSHI_TRY(vshi_keep_charts(&shape->surface, &shape->patches, &shape->kept, error));
    }
    if (!shape->kept) {
        vshi_cut_mesh_free(&shape->surface);
        VSHI_TRY(vshi_cut_mesh_make(shape->mesh, index, false, &shape->surface, error));
        VSHI_TRY(grow_charts(m, shape, error));
    }
    vshi_job_advance(m->job, 2 * shape->mesh->triangle_count);
    return VSH_OK;
}

/* --- charts laid out */

/* A chart as it was grown. */
typedef struct grown {
    const making *making;
    vshi_shape *shape;
    uint32_t chart;
    vshi_patches patches;
} grown;

/* A vshi_element_fn over charts. */
static vsh_result lay_out_chart(void *user, size_t i, vsh_error *error) {
    grown *g = (grown *)user + i;
    const uint32_t *begin = g->shape->chart_begin + g->chart, count = begin[1] - begin[0];
    uint32_t *triangles = NULL;
    VSHI_TRY(vshi_allocate((void **)&triangles, count, sizeof *triangles, what, error));
    memcpy(triangles, g->shape->triangles + begin[0], count * sizeof *triangles);
    VSHI_TRY(vshi_lay_out(&g->shape->surface, triangles, count, g->making->options->max_stretch, &g->patches,
                          error));
    vshi_job_advance(g->making->job, count);
    return VSH_OK;
}

static vsh_result lay_out_all(const making *m, vsh_error *error) {
    size_t count = 0;
    grown *charts = NULL;
    vsh_result result;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        count += m->shapes->list[i].chart_count;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&charts, count, sizeof *charts, what, error));
    for (size_t i = 0, at = 0; i < m->shapes->count; ++i) {
        for (uint32_t c = 0; c < m->shapes->list[i].chart_count; ++c) {
            charts[at++] = (grown){.making = m, .shape = &m->shapes->list[i], .chart = c};
        }
    }
    VSHI_TRY_DONE(vshi_parallel_each(m->job, count, 4, 0, lay_out_chart, charts, error));
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < charts[i].patches.count; ++k) {
            VSHI_TRY_DONE(vshi_patches_add(&charts[i].shape->patches, &charts[i].patches.list[k], error));
        }
    }
done:
    for (size_t i = 0; charts != NULL && i < count; ++i) {
        vshi_patches_free(&charts[i].patches);
    }
    free(charts);
    return result;
}

/* --- charts joined */

/* A vshi_element_fn over trials. */
static vsh_result try_trial(void *user, size_t i, vsh_error *error) {
    return vshi_merging_try(((vshi_trial **)user)[i], error);
}

static vsh_result join_round(const making *m, size_t *trial_count, vsh_error *error) {
    vshi_trial **trials = NULL;
    size_t count = 0;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_merging *merging = &m->shapes->list[i].merging;
        if (merging->patches != NULL) {
            VSHI_TRY(vshi_merging_plan(merging, error));
            count += merging->trial_count;
        }
    }
    *trial_count = count;
    VSHI_TRY_DONE(vshi_allocate((void **)&trials, count, sizeof(vshi_trial *), what, error));
    for (size_t i = 0, at = 0; i < m->shapes->count; ++i) {
        const vshi_merging *merging = &m->shapes->list[i].merging;
        for (uint32_t t = 0; t < merging->trial_count; ++t) {
            trials[at++] = &merging->trials[t];
        }
    }
    VSHI_TRY_DONE(vshi_parallel_each(m->job, count, 2, 0, try_trial, trials, error));
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_merging *merging = &m->shapes->list[i].merging;
        if (merging->trial_count > 0) {
            VSHI_TRY_DONE(vshi_merging_apply(merging, error));
        } else {
            vshi_merging_free(merging); /* nothing more to try, ever */
        }
    }
done:
    free(trials);
    return result;
}

/* World units², of meshes begin … end - 1. */
static double area_of(const vshi_shapes *shapes, size_t begin, size_t end) {
    double sum = 0.0;
    for (size_t i = begin; i < end; ++i) {
        const vshi_shape *shape = &shapes->list[shapes->instances[i].shape];
        const double scale = shape->surface.scale * shapes->instances[i].scale;
        double area = 0.0;
        for (size_t c = 0; c < shape->patches.count; ++c) {
            area += shape->patches.list[c].area;
        }
        sum += area * scale * scale;
    }
    return sum;
}

/* Fills largest [shapes]: the most that a chart of each may have, world units² of its first mesh. Where
 * objects are packed alone, it is the least over its instances. */
static void find_largest(const making *m, double *largest) {
    const vshi_shapes *shapes = m->shapes;
    const bool alone = m->options->atlas == VSH_ATLAS_OBJECTS;
    const double all = alone ? INFINITY : area_of(shapes, 0, shapes->mesh_count);
    for (size_t i = 0; i < shapes->count; ++i) {
        largest[i] = LARGEST * all;
    }
    for (size_t first = 0, size; alone && first < shapes->mesh_count; first += size) {
        size = vshi_mesh_object_size(shapes->meshes, first, shapes->mesh_count);
        const double area = area_of(shapes, first, first + size);
        for (size_t i = first; i < first + size; ++i) {
            const vshi_instance *instance = &shapes->instances[i];
            const double own = LARGEST * area / (instance->scale * instance->scale);
            largest[instance->shape] = fmin(own, largest[instance->shape]);
        }
    }
}

static vsh_result join_all(const making *m, vsh_error *error) {
    double *largest = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&largest, m->shapes->count, sizeof *largest, what, error));
    find_largest(m, largest);
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_shape *shape = &m->shapes->list[i];
        const double scale = shape->surface.scale;
        if (!shape->kept && shape->patches.count > 1) {
            VSHI_TRY_DONE(vshi_merging_begin(&shape->surface, &shape->patches, m->options->max_stretch,
                                             largest[i] / (scale * scale), &shape->merging, error));
        }
    }
    size_t rest = 2 * m->triangles, left = 1;
    for (int round = 0; round < MOST_ROUNDS && left > 0; ++round) {
        VSHI_TRY_DONE(join_round(m, &left, error));
        vshi_job_advance(m->job, 2 * m->triangles / MOST_ROUNDS);
        rest -= 2 * m->triangles / MOST_ROUNDS;
    }
    vshi_job_advance(m->job, rest);
done:
    free(largest);
    return result;
}

/* --- boxes */

/* A vshi_element_fn over shapes. */
static vsh_result straighten_shape(void *user, size_t i, vsh_error *error) {
    const making *m = user;
    vshi_shape *shape = &m->shapes->list[i];
    end_making(shape);
    VSHI_TRY(vshi_allocate((void **)&shape->boxes, shape->patches.count, sizeof *shape->boxes, what, error));
    for (size_t c = 0; c < shape->patches.count; ++c) {
        VSHI_TRY(vshi_patch_straighten(&shape->patches.list[c], &shape->boxes[c], error));
    }
    vshi_job_advance(m->job, shape->mesh->triangle_count);
    return VSH_OK;
}

vsh_result vshi_shapes_lay_out(vshi_shapes *shapes, const vsh_unwrap_options *options, const vsh_run *run,
                               vsh_error *error) {
    making m = {.shapes = shapes, .options = options};
    vsh_result result;
    for (size_t i = 0; i < shapes->count; ++i) {
        m.triangles += shapes->list[i].mesh->triangle_count;
    }
    m.job = vshi_job_begin(run, "unwrap", STEPS * m.triangles);
    if (m.job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "unwrap: the system refused memory");
    }
    VSHI_TRY_DONE(vshi_parallel_each(m.job, shapes->count, 1, 0, grow_shape, &m, error));
    VSHI_TRY_DONE(lay_out_all(&m, error));
    VSHI_TRY_DONE(join_all(&m, error));
    VSHI_TRY_DONE(vshi_parallel_each(m.job, shapes->count, 1, 0, straighten_shape, &m, error));
    result = vshi_job_cancelled(m.job) ? vshi_job_fail_cancelled(m.job, error) : VSH_OK;
done:
    vshi_job_end(m.job);
    return result;
}
