/* Charts of all shapes. Each step works on all shapes at once, so that one large mesh and a thousand small
 * ones keep all threads busy. */
#include "unwrap/charts.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "geometry/edges.h"
#include "geometry/mesh.h"

#include <stdlib.h>

static const char what[] = "charts of meshes";

/* Two transforms are alike if the products of their axes, over their sum, differ by no more. Transforms made
 * of 32-bit quaternions differ by 1e-7 or so. */
static const double ALIKE = 1e-5;

enum {
    MOST_SHAPES = 64, /* of one set of arrays that a mesh is compared with */
    MOST_ROUNDS = 24, /* of joining charts */
    STEPS = 6         /* of the job, for each triangle */
};

/* --- instances */

/* Returns a transform's size, the root of the sum of its axes' squares. `gram`: dot products of the axes over
 * the sum of their squares, equal for transforms that differ by a similarity. */
static double measure_transform(const double *m, double gram[6]) {
    m = m != NULL ? m : vshi_identity;
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

typedef struct array_set {
    uintptr_t arrays[6]; /* equal for meshes of the same arrays */
    size_t index;        /* of the mesh */
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

/* first[i]: the first mesh that mesh i is an instance of. It does not depend on addresses: meshes of one set
 * of arrays are compared in their order. */
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
    size_t *first;
    const vshi_array arrays[] = {VSHI_ARRAY(shapes->list, mesh_count),
                                 VSHI_ARRAY(shapes->instances, mesh_count), VSHI_ARRAY(first, mesh_count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    VSHI_TRY(find_first(meshes, mesh_count, first, error));
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
    return VSH_OK;
}

void vshi_shapes_free(vshi_shapes *shapes) {
    for (size_t i = 0; i < shapes->count; ++i) {
        vshi_patches_free(&shapes->list[i].patches);
        vshi_cut_mesh_free(&shapes->list[i].surface);
    }
    free(shapes->list);
}

/* --- charts joined to larger ones that lie as flat: fewer charts have fewer seams, and need less padding */

/* Two charts, joined on trial. */
typedef struct trial {
    const struct merging *merging;
    uint32_t a, b;
    double perimeter; /* of both together */
    vshi_patch patch; /* both as one, if it lies flat */
    bool good;
} trial;

typedef struct merging {
    const vshi_cut_mesh *surface;
    vshi_patches *patches;
    double max_stretch;
    uint32_t *owner;   /* [triangles]: chart; VSHI_NONE: without area; one block with the four arrays below */
    double *perimeter; /* [charts] */
    uint32_t *version; /* [charts]: a number that no other chart had before */
    uint32_t versions;
    struct trial *trials; /* of this round: no chart is in two */
    uint32_t trial_count;
    uint64_t *failed; /* pairs of versions, sorted */
    size_t failed_count, failed_capacity;
} merging;

/* Most L2 stretch of a joined chart: the mean over all charts should stay within 1.05. */
static const double MOST_STRETCH = 1.045;

static const double LEAST_SHARED = 0.12; /* of the border of the chart that has less of it */
static const double HARD = 0.3;          /* weight of a hard seam's length in the shared border */

/* Square of a joined chart's perimeter over its area: 12.6 for a disc, 16 for a square, 25 for a rectangle of
 * 4 to 1. Charts beyond ROUND are joined only if that makes them no worse. */
static const double ROUND = 28.0, NO_WORSE = 1.1;

/* Begins with the charts of a surface, which must outlive the merging. */
static vsh_result merging_begin(const vshi_cut_mesh *s, vshi_patches *patches, double max_stretch, merging *m,
                                vsh_error *error) {
    const size_t count = patches->count;
    *m = (merging){.surface = s, .patches = patches, .max_stretch = fmin(max_stretch, MOST_STRETCH)};
    const vshi_array arrays[] = {VSHI_ARRAY(m->owner, s->count), VSHI_ARRAY(m->perimeter, count),
                                 VSHI_ARRAY(m->version, count), VSHI_ARRAY(m->trials, count / 2 + 1)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    memset(m->owner, 0xff, s->count * sizeof *m->owner);
    for (uint32_t c = 0; c < count; ++c) {
        const vshi_patch *p = &patches->list[c];
        m->version[c] = m->versions++;
        for (uint32_t i = 0; i < p->count; ++i) {
            m->owner[p->triangles[i]] = c;
        }
        for (uint32_t side = 0; side < 3 * p->count; ++side) {
            if (p->beyond[side] == VSHI_NONE) {
                m->perimeter[c] += vshi_side_length(s, 3 * p->triangles[side / 3] + side % 3);
            }
        }
    }
    return VSH_OK;
}

static void drop_trials(merging *m) {
    for (uint32_t i = 0; i < m->trial_count; ++i) {
        vshi_patch_free(&m->trials[i].patch);
    }
    m->trial_count = 0;
}

static void merging_free(merging *m) {
    drop_trials(m);
    free(m->failed);
    free(m->owner);
    *m = (merging){0};
}

/* A piece of border between two charts, a < b. */
typedef struct border {
    uint32_t a, b, side;
    double length, shared; /* shared: seams count less */
} border;

static int compare_borders(const void *a, const void *b) {
    const border *x = a, *y = b;
    if (x->a != y->a) {
        return x->a < y->a ? -1 : 1;
    }
    if (x->b != y->b) {
        return x->b < y->b ? -1 : 1;
    }
    return (x->side > y->side) - (x->side < y->side);
}

static int compare_shares(const void *a, const void *b) {
    const border *x = a, *y = b;
    if (x->shared != y->shared) {
        return x->shared > y->shared ? -1 : 1;
    }
    return compare_borders(a, b);
}

static int compare_keys(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static uint64_t make_key(const merging *m, uint32_t a, uint32_t b) {
    const uint32_t x = m->version[a], y = m->version[b];
    return x < y ? (uint64_t)x << 32 | y : (uint64_t)y << 32 | x;
}

static bool has_failed(const merging *m, uint32_t a, uint32_t b) {
    const uint64_t key = make_key(m, a, b);
    return m->failed_count > 0 && bsearch(&key, m->failed, m->failed_count, sizeof key, compare_keys) != NULL;
}

/* Whether two charts would make a round one. */
static bool are_promising(const merging *m, const border *pair) {
    const double pa = m->perimeter[pair->a], pb = m->perimeter[pair->b], aa = m->patches->list[pair->a].area,
                 ab = m->patches->list[pair->b].area, joined = pa + pb - 2.0 * pair->length;
    const double roundness = joined * joined / (aa + ab), before = (pa * pa + pb * pb) / (aa + ab);
    return pair->shared > LEAST_SHARED && (roundness < ROUND || roundness < NO_WORSE * before) &&
           !has_failed(m, pair->a, pair->b);
}

/* Borders by pairs of charts. */
static vsh_result find_pairs(const merging *m, border **pairs, size_t *count, vsh_error *error) {
    const vshi_cut_mesh *s = m->surface;
    size_t sides = 0, room = 0;
    for (uint32_t side = 0; side < 3 * (uint32_t)s->count; ++side) {
        const uint32_t other = s->partner[side], a = m->owner[side / 3],
                       b = other != VSHI_NONE ? m->owner[other / 3] : a;
        if (a == VSHI_NONE || b == VSHI_NONE || a >= b) {
            continue;
        }
        const double length = vshi_side_length(s, side);
        VSHI_TRY(vshi_make_room((void **)pairs, sides, &room, sizeof **pairs, what, error));
        (*pairs)[sides++] = (border){a, b, side, length, s->soft[side] ? length : HARD * length};
    }
    if (sides > 0) {
        qsort(*pairs, sides, sizeof **pairs, compare_borders);
    }
    *count = 0;
    for (size_t i = 0; i < sides; ++i) {
        border *last = *count > 0 ? &(*pairs)[*count - 1] : NULL;
        if (last != NULL && last->a == (*pairs)[i].a && last->b == (*pairs)[i].b) {
            last->length += (*pairs)[i].length;
            last->shared += (*pairs)[i].shared;
        } else {
            (*pairs)[(*count)++] = (*pairs)[i];
        }
    }
    return VSH_OK;
}

/* Chooses the next round's trials; without any, all is done. */
static vsh_result plan_trials(merging *m, vsh_error *error) {
    border *pairs = NULL;
    uint8_t *taken = NULL;
    size_t count = 0, kept = 0;
    vsh_result result;
    drop_trials(m);
    VSHI_TRY_DONE(find_pairs(m, &pairs, &count, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&taken, m->patches->count, 1, what, error));
    for (size_t i = 0; i < count; ++i) {
        border pair = pairs[i];
        const double pa = m->perimeter[pair.a], pb = m->perimeter[pair.b];
        pair.shared /= pa < pb ? pa : pb;
        if (are_promising(m, &pair)) {
            pairs[kept++] = pair;
        }
    }
    if (kept > 0) {
        qsort(pairs, kept, sizeof *pairs, compare_shares);
    }
    for (size_t i = 0; i < kept; ++i) {
        const border *pair = &pairs[i];
        if (!taken[pair->a] && !taken[pair->b]) {
            taken[pair->a] = taken[pair->b] = 1;
            m->trials[m->trial_count++] =
                (trial){.merging = m,
                        .a = pair->a,
                        .b = pair->b,
                        .perimeter = m->perimeter[pair->a] + m->perimeter[pair->b] - 2.0 * pair->length};
        }
    }
done:
    free(taken);
    free(pairs);
    return result;
}

/* A vshi_element_fn over trials. */
static vsh_result run_trial(void *user, size_t i, vsh_error *error) {
    trial *one = ((trial **)user)[i];
    const merging *m = one->merging;
    const vshi_patch *a = &m->patches->list[one->a], *b = &m->patches->list[one->b];
    uint32_t *triangles = NULL;
    VSHI_TRY(vshi_allocate((void **)&triangles, (size_t)a->count + b->count, sizeof *triangles, what, error));
    for (uint32_t k = 0, l = 0; k + l < a->count + b->count;) {
        const bool first = l == b->count || (k < a->count && a->triangles[k] < b->triangles[l]);
        triangles[k + l] = first ? a->triangles[k] : b->triangles[l];
        k += first;
        l += !first;
    }
    VSHI_TRY(vshi_patch_make(m->surface, triangles, a->count + b->count, &one->patch, error));
    VSHI_TRY(vshi_flatten(&one->patch, m->max_stretch, &one->good, error));
    if (!one->good) {
        vshi_patch_free(&one->patch);
    }
    return VSH_OK;
}

/* Closes the gaps that joined charts have left. */
static void close_up(merging *m) {
    uint32_t kept = 0;
    for (uint32_t c = 0; c < m->patches->count; ++c) {
        if (m->patches->list[c].count == 0) {
            continue;
        }
        if (kept != c) {
            m->patches->list[kept] = m->patches->list[c];
            m->perimeter[kept] = m->perimeter[c];
            m->version[kept] = m->version[c];
            for (uint32_t i = 0; i < m->patches->list[kept].count; ++i) {
                m->owner[m->patches->list[kept].triangles[i]] = kept;
            }
        }
        ++kept;
    }
    m->patches->count = kept;
}

/* Joins the charts of good trials, and remembers the others. */
static vsh_result apply_trials(merging *m, vsh_error *error) {
    for (uint32_t i = 0; i < m->trial_count; ++i) {
        trial *one = &m->trials[i];
        if (!one->good) {
            VSHI_TRY(vshi_make_room((void **)&m->failed, m->failed_count, &m->failed_capacity,
                                    sizeof *m->failed, what, error));
            m->failed[m->failed_count++] = make_key(m, one->a, one->b);
            continue;
        }
        vshi_patch_free(&m->patches->list[one->a]);
        vshi_patch_free(&m->patches->list[one->b]);
        vshi_patch *joined = &m->patches->list[one->a];
        *joined = one->patch;
        one->patch = (vshi_patch){0};
        m->perimeter[one->a] = one->perimeter;
        m->version[one->a] = m->versions++;
        for (uint32_t k = 0; k < joined->count; ++k) {
            m->owner[joined->triangles[k]] = one->a;
        }
    }
    if (m->failed_count > 0) {
        qsort(m->failed, m->failed_count, sizeof *m->failed, compare_keys);
    }
    close_up(m);
    return VSH_OK;
}

/* --- all shapes */

/* The charts of a shape while they are grown and joined. */
typedef struct charting {
    uint32_t count;
    uint32_t *begin;     /* [count + 2] in `triangles`; both are one block */
    uint32_t *triangles; /* by chart, ascending */
    merging merging;
} charting;

typedef struct making {
    vshi_shapes *shapes;
    const vsh_unwrap_options *options;
    vshi_job *job;
    size_t triangles;   /* of all shapes */
    charting *charting; /* [shapes] */
} making;

/* --- surfaces, and charts grown over them */

static vsh_result grow_charts(const making *m, size_t i, vsh_error *error) {
    const vshi_cut_mesh *s = &m->shapes->list[i].surface;
    charting *of = &m->charting[i];
    uint32_t *chart = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&chart, s->count, sizeof *chart, what, error));
    VSHI_TRY_DONE(vshi_grow_charts(s, m->job, chart, &of->count, error));
    const vshi_array arrays[] = {VSHI_ARRAY(of->begin, (size_t)of->count + 2),
                                 VSHI_ARRAY(of->triangles, s->count)};
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    vshi_list_groups(chart, s->count, of->count, of->begin, of->triangles);
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
        VSHI_TRY(grow_charts(m, i, error));
    }
    vshi_job_advance(m->job, 2 * shape->mesh->triangle_count);
    return VSH_OK;
}

/* --- charts laid out */

/* A chart as it was grown. */
typedef struct grown {
    const making *making;
    size_t shape;
    uint32_t chart;
    vshi_patches patches;
} grown;

/* A vshi_element_fn over charts. */
static vsh_result lay_out_chart(void *user, size_t i, vsh_error *error) {
    grown *g = (grown *)user + i;
    const charting *of = &g->making->charting[g->shape];
    const uint32_t *begin = of->begin + g->chart, count = begin[1] - begin[0];
    uint32_t *triangles = NULL;
    VSHI_TRY(vshi_allocate((void **)&triangles, count, sizeof *triangles, what, error));
    memcpy(triangles, of->triangles + begin[0], count * sizeof *triangles);
    VSHI_TRY(vshi_lay_out(&g->making->shapes->list[g->shape].surface, triangles, count,
                          g->making->options->max_stretch, &g->patches, error));
    vshi_job_advance(g->making->job, count);
    return VSH_OK;
}

static vsh_result lay_out_all(const making *m, vsh_error *error) {
    size_t count = 0;
    grown *charts = NULL;
    vsh_result result;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        count += m->charting[i].count;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&charts, count, sizeof *charts, what, error));
    for (size_t i = 0, at = 0; i < m->shapes->count; ++i) {
        for (uint32_t c = 0; c < m->charting[i].count; ++c) {
            charts[at++] = (grown){.making = m, .shape = i, .chart = c};
        }
    }
    VSHI_TRY_DONE(vshi_parallel_each(m->job, count, 4, 0, lay_out_chart, charts, error));
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < charts[i].patches.count; ++k) {
            VSHI_TRY_DONE(vshi_patches_add(&m->shapes->list[charts[i].shape].patches,
                                           &charts[i].patches.list[k], error));
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

static vsh_result join_round(const making *m, size_t *trial_count, vsh_error *error) {
    trial **trials = NULL;
    size_t count = 0;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < m->shapes->count; ++i) {
        merging *of = &m->charting[i].merging;
        if (of->patches != NULL) {
            VSHI_TRY(plan_trials(of, error));
            count += of->trial_count;
        }
    }
    *trial_count = count;
    VSHI_TRY_DONE(vshi_allocate((void **)&trials, count, sizeof(trial *), what, error));
    for (size_t i = 0, at = 0; i < m->shapes->count; ++i) {
        const merging *of = &m->charting[i].merging;
        for (uint32_t t = 0; t < of->trial_count; ++t) {
            trials[at++] = &of->trials[t];
        }
    }
    VSHI_TRY_DONE(vshi_parallel_each(m->job, count, 2, 0, run_trial, trials, error));
    for (size_t i = 0; i < m->shapes->count; ++i) {
        merging *of = &m->charting[i].merging;
        if (of->trial_count > 0) {
            VSHI_TRY_DONE(apply_trials(of, error));
        } else {
            merging_free(of); /* nothing left to try */
        }
    }
done:
    free(trials);
    return result;
}

static vsh_result join_all(const making *m, vsh_error *error) {
    for (size_t i = 0; i < m->shapes->count; ++i) {
        vshi_shape *shape = &m->shapes->list[i];
        if (!shape->kept && shape->patches.count > 1) {
            VSHI_TRY(merging_begin(&shape->surface, &shape->patches, m->options->max_stretch,
                                   &m->charting[i].merging, error));
        }
    }
    size_t rest = 2 * m->triangles, left = 1;
    for (int round = 0; round < MOST_ROUNDS && left > 0; ++round) {
        VSHI_TRY(join_round(m, &left, error));
        vshi_job_advance(m->job, 2 * m->triangles / MOST_ROUNDS);
        rest -= 2 * m->triangles / MOST_ROUNDS;
    }
    vshi_job_advance(m->job, rest);
    return VSH_OK;
}

/* A vshi_element_fn over shapes. */
static vsh_result straighten_shape(void *user, size_t i, vsh_error *error) {
    const making *m = user;
    vshi_shape *shape = &m->shapes->list[i];
    merging_free(&m->charting[i].merging);
    for (size_t c = 0; c < shape->patches.count; ++c) {
        VSHI_TRY(vshi_patch_straighten(&shape->patches.list[c], error));
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
    VSHI_TRY(vshi_allocate((void **)&m.charting, shapes->count, sizeof *m.charting, what, error));
    VSHI_TRY_DONE(vshi_job_open(&m.job, run, "unwrap", STEPS * m.triangles, what, error));
    VSHI_TRY_DONE(vshi_parallel_each(m.job, shapes->count, 1, 0, grow_shape, &m, error));
    VSHI_TRY_DONE(lay_out_all(&m, error));
    VSHI_TRY_DONE(join_all(&m, error));
    VSHI_TRY_DONE(vshi_parallel_each(m.job, shapes->count, 1, 0, straighten_shape, &m, error));
    result = vshi_job_check(m.job, error);
done:
    for (size_t i = 0; i < shapes->count; ++i) {
        merging_free(&m.charting[i].merging);
        free(m.charting[i].begin);
    }
    free(m.charting);
    vshi_job_end(m.job);
    return result;
}
