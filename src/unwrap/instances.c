#include "base/memory.h"
#include "base/try.h"
#include "unwrap/shapes.h"

#include <stdlib.h>

static const char what[] = "instances of meshes";

/* Of a transform's products of axes, against their sum: transforms made of 32-bit quaternions differ by 1e-7
 * or so. */
static const double ALIKE = 1e-5;

enum { MOST_SHAPES = 64 }; /* of one set of arrays that a mesh is compared with */

/* Dot products of a transform's axes: equal but for a factor where the transforms differ by a similarity. */
typedef struct gram {
    double v[6];
} gram;

static gram gram_of(const double *m) {
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    m = m != NULL ? m : identity;
    gram g;
    double most = 0.0;
    for (int i = 0; i < 12; ++i) { /* no square leaves the range of doubles */
        most = i % 4 != 3 && fabs(m[i]) > most ? fabs(m[i]) : most;
    }
    for (int a = 0, at = 0; a < 3; ++a) {
        for (int b = a; b < 3; ++b, ++at) {
            g.v[at] = 0.0;
            for (int row = 0; row < 3; ++row) {
                g.v[at] += m[4 * row + a] / most * (m[4 * row + b] / most);
            }
        }
    }
    const double sum = g.v[0] + g.v[3] + g.v[5];
    for (int i = 0; i < 6; ++i) {
        g.v[i] /= sum;
    }
    return g;
}

/* Size of a transform: the root of the sum of its axes' squares. */
static double size_of(const double *m) {
    if (m == NULL) {
        return sqrt(3.0);
    }
    double most = 0.0, sum = 0.0;
    for (int i = 0; i < 12; ++i) {
        most = i % 4 != 3 && fabs(m[i]) > most ? fabs(m[i]) : most;
    }
    for (int i = 0; i < 12; ++i) {
        sum += i % 4 != 3 ? m[i] / most * (m[i] / most) : 0.0;
    }
    return most * sqrt(sum);
}

static bool alike(const double *a, const double *b) {
    const gram x = gram_of(a), y = gram_of(b);
    for (int i = 0; i < 6; ++i) {
        if (!(fabs(x.v[i] - y.v[i]) <= ALIKE)) {
            return false;
        }
    }
    return true;
}

static int compare_arrays(const vsh_mesh *x, const vsh_mesh *y) {
    const uintptr_t a[6] = {(uintptr_t)x->positions, (uintptr_t)x->indices, (uintptr_t)x->normals,
                            (uintptr_t)x->uvs,       x->vertex_count,       x->triangle_count};
    const uintptr_t b[6] = {(uintptr_t)y->positions, (uintptr_t)y->indices, (uintptr_t)y->normals,
                            (uintptr_t)y->uvs,       y->vertex_count,       y->triangle_count};
    for (int i = 0; i < 6; ++i) {
        if (a[i] != b[i]) {
            return a[i] < b[i] ? -1 : 1;
        }
    }
    return 0;
}

typedef struct by_arrays {
    const vsh_mesh *mesh;
    size_t index;
} by_arrays;

static int compare_meshes(const void *a, const void *b) {
    const by_arrays *x = a, *y = b;
    const int arrays = compare_arrays(x->mesh, y->mesh);
    return arrays != 0 ? arrays : (x->index > y->index) - (x->index < y->index);
}

/* first[i]: the first mesh that mesh i is an instance of. No address shows in it: of one set of arrays,
 * meshes are looked at in their order. */
static vsh_result find_first(const vsh_mesh *meshes, size_t count, size_t *first, vsh_error *error) {
    by_arrays *sorted = NULL;
    VSHI_TRY(vshi_allocate((void **)&sorted, count, sizeof *sorted, what, error));
    for (size_t i = 0; i < count; ++i) {
        sorted[i] = (by_arrays){&meshes[i], i};
    }
    qsort(sorted, count, sizeof *sorted, compare_meshes);
    for (size_t begin = 0, end; begin < count; begin = end) {
        size_t shapes[MOST_SHAPES], shape_count = 0;
        for (end = begin; end < count && compare_arrays(sorted[begin].mesh, sorted[end].mesh) == 0; ++end) {
            const size_t own = sorted[end].index;
            first[own] = own;
            for (size_t k = 0; k < shape_count && first[own] == own; ++k) {
                first[own] = alike(meshes[shapes[k]].transform, meshes[own].transform) ? shapes[k] : own;
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
    *shapes = (vshi_shapes){0};
    size_t *first = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&first, mesh_count, sizeof *first, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&shapes->list, mesh_count, sizeof *shapes->list, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&shapes->instances, mesh_count, sizeof *shapes->instances, what, error));
    VSHI_TRY_DONE(find_first(meshes, mesh_count, first, error));
    for (size_t i = 0; i < mesh_count; ++i) {
        if (first[i] == i) {
            shapes->instances[i] = (vshi_instance){(uint32_t)shapes->count, 1.0};
            shapes->list[shapes->count++] = (vshi_shape){.mesh = &meshes[i], .index = i};
        } else {
            shapes->instances[i] =
                (vshi_instance){shapes->instances[first[i]].shape,
                                size_of(meshes[i].transform) / size_of(meshes[first[i]].transform)};
        }
    }
done:
    free(first);
    return result;
}
