/* Charts of all shapes: each step over all of them at once, so that one large mesh and a thousand small ones
 * keep threads busy alike. */
#include "unwrap/shapes.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "mesh/mesh.h"
#include "unwrap/patch.h"

#include <stdlib.h>

static const char what[] = "charts of meshes";

enum { MOST_ROUNDS = 24 }; /* of joining charts */

/* Share of all charts' area that charts are joined to: larger ones leave gaps between them that nothing
 * fills. */
static const double LARGEST = 0.35;

static void end_making(vshi_shape *shape) {
    vshi_merging_free(&shape->merging);
    free(shape->owner);
    shape->owner = NULL;
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
    const vsh_mesh *meshes; /* [mesh_count]; NULL: all are packed together, else each object alone */
    size_t mesh_count;
    double max_stretch;
    bool keep_uvs;
    vshi_job *job;
} making;

/* The first failure in the order of shapes. */
static vsh_result first_failure(const vshi_shapes *shapes, vsh_error *error) {
    for (size_t i = 0; i < shapes->count; ++i) {
        if (shapes->list[i].result != VSH_OK) {
            if (error != NULL) {
                *error = shapes->list[i].error;
            }
            return shapes->list[i].result;
        }
    }
    return VSH_OK;
}

/* --- surfaces, and charts grown over them */

static vsh_result keep_own(vshi_shape *shape) {
    if (shape->mesh->uvs == NULL) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_cut_mesh_make(shape->mesh, shape->index, VSHI_CUT_UVS, &shape->surface, &shape->error));
    VSHI_TRY(vshi_keep_charts(&shape->surface, &shape->patches, &shape->kept, &shape->error));
    if (!shape->kept) {
        vshi_cut_mesh_free(&shape->surface);
    }
    return VSH_OK;
}

static vsh_result grow(const making *m, vshi_shape *shape) {
    if (m->keep_uvs) {
        VSHI_TRY(keep_own(shape));
        if (shape->kept) {
            return VSH_OK;
        }
    }
    VSHI_TRY(vshi_cut_mesh_make(shape->mesh, shape->index, VSHI_CUT_CREASES, &shape->surface, &shape->error));
    VSHI_TRY(vshi_allocate((void **)&shape->owner, shape->surface.unit_count, sizeof *shape->owner, what,
                           &shape->error));
    return vshi_grow_charts(&shape->surface, m->job, shape->owner, &shape->chart_count, &shape->error);
}

static void grow_shapes(void *user, size_t begin, size_t end) {
    const making *m = user;
    for (size_t i = begin; i < end; ++i) {
        vshi_shape *shape = &m->shapes->list[i];
        shape->result = grow(m, shape);
        vshi_job_advance(m->job, 2 * shape->mesh->triangle_count);
    }
}

/* --- charts laid out */

/* A chart as it was grown. */
typedef struct grown {
    vshi_shape *shape;
    uint32_t *triangles; /* taken over by the layout */
    uint32_t count;
    vshi_patches patches;
    vsh_result result;
} grown;

typedef struct laying {
    const making *making;
    grown *charts;
} laying;

static void lay_out_charts(void *user, size_t begin, size_t end) {
    const laying *l = user;
    for (size_t i = begin; i < end; ++i) {
        grown *chart = &l->charts[i];
        uint32_t *triangles = chart->triangles;
        vsh_error ignored;
        chart->triangles = NULL;
        chart->result = vshi_lay_out(&chart->shape->surface, triangles, chart->count, l->making->max_stretch,
                                     &chart->patches, &ignored);
        vshi_job_advance(l->making->job, chart->count);
    }
}

/* The triangles of a shape's charts, ascending in each. */
static vsh_result list_charts(vshi_shape *shape, grown *charts, vsh_error *error) {
    const vshi_cut_mesh *s = &shape->surface;
    for (uint32_t c = 0; c < shape->chart_count; ++c) {
        charts[c].shape = shape;
    }
    for (int pass = 0; pass < 2 && shape->chart_count > 0; ++pass) {
        for (uint32_t i = 0; i < s->count; ++i) {
            if (s->unit[i] != VSHI_NONE) {
                grown *chart = &charts[shape->owner[s->unit[i]]];
                if (pass == 1) {
                    chart->triangles[chart->count] = i;
                }
                ++chart->count;
            }
        }
        for (uint32_t c = 0; c < shape->chart_count && pass == 0; ++c) {
            VSHI_TRY(vshi_allocate((void **)&charts[c].triangles, charts[c].count,
                                   sizeof *charts[c].triangles, what, error));
            charts[c].count = 0;
        }
    }
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
    for (size_t i = 0, at = 0; count > 0 && i < m->shapes->count; at += m->shapes->list[i++].chart_count) {
        VSHI_TRY_DONE(list_charts(&m->shapes->list[i], charts + at, error));
    }
    VSHI_TRY_DONE(vshi_parallel_for(m->job, count, 4, 0, lay_out_charts, &(laying){m, charts}, error));
    for (size_t i = 0; i < count; ++i) {
        if (charts[i].result != VSH_OK) {
            result = vshi_fail(error, charts[i].result, "%s: the system refused memory", what);
            goto done;
        }
        for (size_t k = 0; k < charts[i].patches.count; ++k) {
            vshi_patch *patch = &charts[i].patches.list[k];
            VSHI_TRY_DONE(vshi_patches_add(&charts[i].shape->patches, patch, error));
            VSHI_TRY_DONE(result);
        }
    }
done:
    for (size_t i = 0; charts != NULL && i < count; ++i) {
        vshi_patches_free(&charts[i].patches);
        free(charts[i].triangles);
    }
    free(charts);
    return result;
}

/* --- charts joined */

typedef struct joining {
    const making *making;
    struct {
        vshi_merging *merging;
        uint32_t trial;
        vsh_result result;
    } * trials;
} joining;

static void try_trials(void *user, size_t begin, size_t end) {
    const joining *j = user;
    for (size_t i = begin; i < end; ++i) {
        vsh_error ignored;
        j->trials[i].result = vshi_merging_try(j->trials[i].merging, j->trials[i].trial, &ignored);
    }
}

static vsh_result join_round(const making *m, bool *done_all, vsh_error *error) {
    joining j = {.making = m};
    size_t count = 0;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_merging *merging = &m->shapes->list[i].merging;
        if (merging->patches != NULL) {
            VSHI_TRY(vshi_merging_plan(merging, error));
            count += merging->trial_count;
        }
    }
    *done_all = count == 0;
    VSHI_TRY_DONE(vshi_allocate((void **)&j.trials, count, sizeof *j.trials, what, error));
    count = 0;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_merging *merging = &m->shapes->list[i].merging;
        for (uint32_t t = 0; t < merging->trial_count; ++t) {
            j.trials[count].merging = merging;
            j.trials[count++].trial = t;
        }
    }
    VSHI_TRY_DONE(vshi_parallel_for(m->job, count, 2, 0, try_trials, &j, error));
    for (size_t i = 0; i < count; ++i) {
        if (j.trials[i].result != VSH_OK) {
            result = vshi_fail(error, j.trials[i].result, "%s: the system refused memory", what);
            goto done;
        }
    }
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_merging *merging = &m->shapes->list[i].merging;
        if (merging->patches != NULL) {
            VSHI_TRY_DONE(vshi_merging_apply(merging, error));
            if (merging->trial_count == 0) { /* nothing more to try, ever */
                vshi_merging_free(merging);
            }
        }
    }
done:
    free(j.trials);
    return result;
}

/* World units², of meshes begin … end - 1. */
static double area_of(const making *m, size_t begin, size_t end) {
    double sum = 0.0;
    for (size_t i = begin; i < end; ++i) {
        const vshi_shape *shape = &m->shapes->list[m->shapes->instances[i].shape];
        const double scale = shape->surface.scale * m->shapes->instances[i].scale;
        double area = 0.0;
        for (size_t c = 0; c < shape->patches.count; ++c) {
            area += shape->patches.list[c].area;
        }
        sum += area * scale * scale;
    }
    return sum;
}

/* Fills largest [shapes]: what a chart of each may have at most, world units² of its first mesh; the least of
 * what its instances may, where objects are packed alone. */
static void find_largest(const making *m, double *largest) {
    const double all = m->meshes == NULL ? area_of(m, 0, m->mesh_count) : INFINITY;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        largest[i] = LARGEST * all;
    }
    for (size_t first = 0, size; m->meshes != NULL && first < m->mesh_count; first += size) {
        size = vshi_mesh_object_size(m->meshes, first, m->mesh_count);
        const double area = area_of(m, first, first + size);
        for (size_t i = first; i < first + size; ++i) {
            const vshi_instance *instance = &m->shapes->instances[i];
            const double own = LARGEST * area / (instance->scale * instance->scale);
            largest[instance->shape] = own < largest[instance->shape] ? own : largest[instance->shape];
        }
    }
}

static vsh_result begin_joining(const making *m, vsh_error *error) {
    double *largest = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&largest, m->shapes->count, sizeof *largest, what, error));
    find_largest(m, largest);
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_shape *shape = &m->shapes->list[i];
        if (!shape->kept && shape->patches.count > 1) {
            const double scale = shape->surface.scale;
            VSHI_TRY_DONE(vshi_merging_begin(&shape->surface, &shape->patches, m->max_stretch,
                                             largest[i] / (scale * scale), &shape->merging, error));
        }
    }
done:
    free(largest);
    return result;
}

static vsh_result join_all(const making *m, size_t triangles, vsh_error *error) {
    VSHI_TRY(begin_joining(m, error));
    bool done_all = false;
    size_t told = 0;
    for (int round = 0; round < MOST_ROUNDS && !done_all; ++round) {
        VSHI_TRY(join_round(m, &done_all, error));
        vshi_job_advance(m->job, 2 * triangles / MOST_ROUNDS);
        told += 2 * triangles / MOST_ROUNDS;
    }
    vshi_job_advance(m->job, 2 * triangles - told);
    return VSH_OK;
}

/* --- boxes */

static void straighten_shapes(void *user, size_t begin, size_t end) {
    const making *m = user;
    for (size_t i = begin; i < end; ++i) {
        vshi_shape *shape = &m->shapes->list[i];
        shape->result = vshi_allocate((void **)&shape->boxes, shape->patches.count, sizeof *shape->boxes,
                                      what, &shape->error);
        for (size_t c = 0; c < shape->patches.count && shape->result == VSH_OK; ++c) {
            shape->result = vshi_patch_straighten(&shape->patches.list[c], &shape->boxes[c], &shape->error);
        }
        vshi_job_advance(m->job, shape->mesh->triangle_count);
    }
}

vsh_result vshi_shapes_lay_out(vshi_shapes *shapes, const vsh_mesh *meshes, size_t mesh_count,
                               const vsh_unwrap_options *options, vshi_job *job, vsh_error *error) {
    making m = {.shapes = shapes,
                .meshes = options->atlas == VSH_ATLAS_OBJECTS ? meshes : NULL,
                .mesh_count = mesh_count,
                .max_stretch = options->max_stretch,
                .keep_uvs = options->keep_uvs == VSH_UNWRAP_KEEP,
                .job = job};
    size_t triangles = 0;
    for (size_t i = 0; i < shapes->count; ++i) {
        triangles += shapes->list[i].mesh->triangle_count;
    }
    VSHI_TRY(vshi_parallel_for(job, shapes->count, 1, 0, grow_shapes, &m, error));
    VSHI_TRY(first_failure(shapes, error));
    VSHI_TRY(lay_out_all(&m, error));
    VSHI_TRY(join_all(&m, triangles, error));
    for (size_t i = 0; i < shapes->count; ++i) {
        end_making(&shapes->list[i]);
    }
    VSHI_TRY(vshi_parallel_for(job, shapes->count, 1, 0, straighten_shapes, &m, error));
    VSHI_TRY(first_failure(shapes, error));
    return vshi_job_cancelled(job) ? vshi_job_fail_cancelled(job, error) : VSH_OK;
}
