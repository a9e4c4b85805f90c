/* What becomes of a glTF's arrays once they are as the file has them: checked, cut to what is used, v up.
 * Here and not in gltf_primitive.c as a caller does it to arrays that its reader left in the file. */
#include "base/memory.h"
#include "base/try.h"
#include "model/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 4096 /* indices that are looked at twice while they are near */ };

/* Whether each is less than `end`: by a bit that none of them may set, without a branch. */
static bool all_below(const uint32_t *indices, size_t count, size_t end) {
    static const uint32_t half = UINT32_C(1) << 31;
    uint32_t seen = 0, highest = 0;
    if (end == 0 || end > half) {
        for (size_t i = 0; i < count; ++i) {
            highest = indices[i] > highest ? indices[i] : highest;
        }
        return count == 0 || highest < end;
    }
    const uint32_t last = (uint32_t)end - 1;
    for (size_t i = 0; i < count; ++i) {
        seen |= indices[i] | (last - indices[i]);
    }
    return seen < half;
}

vsh_result vshi_model_check_indices(const char *path, const char *where, const uint32_t *indices,
                                    size_t count, size_t vertex_count, vsh_error *error) {
    if (all_below(indices, count, vertex_count)) {
        return VSH_OK;
    }
    size_t i = 0;
    while (indices[i] < vertex_count) {
        ++i;
    }
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: %s: index %zu of %zu is %u, but there are only %zu vertices", path, where, i, count,
                     indices[i], vertex_count);
}

/* Sets used[v] of each vertex that a triangle has. */
static vsh_result mark_used(const char *path, const char *where, const vshi_model_shape *shape,
                            unsigned char *restrict used, vsh_error *error) {
    const size_t count = 3 * shape->triangle_count;
    const uint32_t *restrict indices = shape->indices; /* which no byte of `used` is a part of */
    for (size_t begin = 0; begin < count; begin += BLOCK) {
        const size_t end = count - begin > BLOCK ? begin + BLOCK : count;
        if (!all_below(indices + begin, end - begin, shape->vertex_count)) {
            return vshi_model_check_indices(path, where, indices, count, shape->vertex_count, error);
        }
        for (size_t i = begin; i < end; ++i) {
            used[indices[i]] = 1;
        }
    }
    return VSH_OK;
}

/* The elements that are used move together; NULL stays. */
static void compact(float *values, size_t components, const unsigned char *used, size_t count) {
    size_t to = 0;
    for (size_t v = 0; v < count && values != NULL; ++v) {
        if (used[v] != 0) {
            memmove(values + components * to++, values + components * v, components * sizeof *values);
        }
    }
}

static vsh_result renumber(const char *path, const unsigned char *used, vshi_model_shape *shape,
                           vsh_error *error) {
    uint32_t *place = NULL, next = 0;
    VSHI_TRY(vshi_allocate((void **)&place, shape->vertex_count, sizeof *place, path, error));
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        place[v] = next;
        next += used[v];
    }
    for (size_t i = 0; i < 3 * shape->triangle_count; ++i) {
        shape->indices[i] = place[shape->indices[i]];
    }
    free(place);
    compact(shape->positions, 3, used, shape->vertex_count);
    compact(shape->normals, 3, used, shape->vertex_count);
    compact(shape->alphas, 1, used, shape->vertex_count);
    for (int set = 0; set < shape->uv_sets; ++set) {
        compact(shape->uvs[set], 2, used, shape->vertex_count);
    }
    shape->vertex_count = next;
    return VSH_OK;
}

/* Many primitives may share one large accessor, of which each uses a part: only that is kept. */
static vsh_result drop_unused(const char *path, const char *where, vshi_model_shape *shape,
                              vsh_error *error) {
    unsigned char *used = NULL;
    VSHI_TRY(vshi_allocate((void **)&used, shape->vertex_count, 1, path, error));
    vsh_result result;
    VSHI_TRY_DONE(mark_used(path, where, shape, used, error));
    size_t count = 0;
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        count += used[v];
    }
    if (count < shape->vertex_count) {
        VSHI_TRY_DONE(renumber(path, used, shape, error));
    }
done:
    free(used);
    return result;
}

/* Whether no exponent is that of infinities, without a branch. */
static bool all_finite(const float *values, size_t count) {
    static const uint32_t exponent = 0x7f800000;
    uint32_t seen = 0;
    for (size_t i = 0; i < count; ++i) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        seen |= (uint32_t)((bits & exponent) == exponent);
    }
    return seen == 0;
}

static vsh_result check_positions(const char *path, const char *where, const vshi_model_shape *shape,
                                  vsh_error *error) {
    if (all_finite(shape->positions, 3 * shape->vertex_count)) {
        return VSH_OK;
    }
    const float *p = shape->positions;
    while (isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2])) {
        p += 3;
    }
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: %s: vertex %zu of %zu lies at (%g, %g, %g), expected finite numbers", path, where,
                     (size_t)(p - shape->positions) / 3, shape->vertex_count, (double)p[0], (double)p[1],
                     (double)p[2]);
}

/* Directions that are not finite become zero, which no direction is: flat there. */
static void check_normals(const char *path, const vsh_run *run, const char *where,
                          const vshi_model_shape *shape) {
    size_t bad = 0;
    if (shape->normals == NULL || all_finite(shape->normals, 3 * shape->vertex_count)) {
        return;
    }
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        float *n = shape->normals + 3 * v;
        if (!isfinite(n[0]) || !isfinite(n[1]) || !isfinite(n[2])) {
            memset(n, 0, sizeof(float[3]));
            ++bad;
        }
    }
    vshi_warn(run, "%s: %s: %zu normals are not finite; those faces are flat", path, where, bad);
}

vsh_result vshi_model_finish(const char *path, const vsh_run *run, const char *where, vshi_model_shape *shape,
                             vsh_error *error) {
    VSHI_TRY(drop_unused(path, where, shape, error));
    VSHI_TRY(check_positions(path, where, shape, error));
    check_normals(path, run, where, shape);
    for (int set = 0; set < shape->uv_sets; ++set) {
        float *uvs = shape->uvs[set];
        for (size_t v = 0; v < shape->vertex_count && uvs != NULL; ++v) {
            uvs[2 * v + 1] = 1.0F - uvs[2 * v + 1]; /* v points down in glTF */
        }
    }
    return VSH_OK;
}
