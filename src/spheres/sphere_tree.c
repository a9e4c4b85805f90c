/* Making a hierarchy of bounding spheres, and searching it with cones. Spheres are sorted along a Morton
 * curve through their centres (G. M. Morton, 1966). Eight in a row share a block, as do eight blocks in a row
 * of the level above (C. Lauterbach et al., "Fast BVH construction on GPUs", 2009). */
#include "spheres/spheres.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

static const double LARGEST = 1e15;
static const size_t MOST = (size_t)1 << 30;
/* Of a float's rounding of a centre, and of the squares that are made of it, with room. */
static const double ROUNDING = 1e-6;

/* A sphere's place along the curve. */
typedef struct keyed {
    uint64_t key;
    size_t index;
} keyed;

static int compare_keys(const void *a, const void *b) {
    const keyed *one = a, *other = b;
    return one->key != other->key ? (one->key < other->key ? -1 : 1)
                                  : (one->index > other->index) - (one->index < other->index);
}

/* 21 bits, two zeros between each and the next. */
static uint64_t spread(uint64_t bits) {
    bits = (bits | bits << 32) & UINT64_C(0x001f00000000ffff);
    bits = (bits | bits << 16) & UINT64_C(0x001f0000ff0000ff);
    bits = (bits | bits << 8) & UINT64_C(0x100f00f00f00f00f);
    bits = (bits | bits << 4) & UINT64_C(0x10c30c30c30c30c3);
    return (bits | bits << 2) & UINT64_C(0x1249249249249249);
}

static vsh_result sort(vsh_spheres *made, double extent, vsh_error *error) {
    static const double most = 2097151.0; /* 21 bits */
    keyed *order = NULL;
    double(*sorted)[4] = NULL;
    const size_t count = made->info.count;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&order, count, sizeof *order, "spheres", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&sorted, count, sizeof *sorted, "spheres", error));
    for (size_t i = 0; i < count; ++i) {
        order[i].index = i;
        for (int axis = 0; axis < 3; ++axis) {
            const double from = made->sphere[i][axis] - made->info.bounds_min[axis];
            order[i].key |= spread((uint64_t)(from / extent * most)) << axis;
        }
    }
    qsort(order, count, sizeof *order, compare_keys);
    for (size_t i = 0; i < count; ++i) {
        memcpy(sorted[i], made->sphere[order[i].index], sizeof *sorted);
    }
    free(made->sphere);
    made->sphere = sorted;
done:
    free(order);
    return result;
}

/* A sphere around the spheres begin … end - 1, around the middle of their box, from the set's middle. */
static void bound(const vsh_spheres *made, size_t begin, size_t end, double rounding, vshi_ball_block *block,
                  int lane) {
    double(*sphere)[4] = made->sphere;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = begin; i < end; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = fmin(low[axis], sphere[i][axis] - sphere[i][3]);
            high[axis] = fmax(high[axis], sphere[i][axis] + sphere[i][3]);
        }
    }
    const vshi_vec centre = {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
    double radius = 0.0;
    for (size_t i = begin; i < end; ++i) {
        radius = fmax(radius, vshi_length(vshi_sub(vshi_vec_of(sphere[i]), centre)) + sphere[i][3]);
    }
    block->x[lane] = (float)(centre.x - made->middle[0]);
    block->y[lane] = (float)(centre.y - made->middle[1]);
    block->z[lane] = (float)(centre.z - made->middle[2]);
    block->radius[lane] = (float)(radius * (1.0 + ROUNDING) + rounding);
}

/* Level 0 has blocks of spheres, each level above blocks of blocks, and the last a single one, which is [0].
 */
static vsh_result build(vsh_spheres *made, double rounding, vsh_error *error) {
    size_t sizes[VSHI_BALL_DEPTH] = {(made->info.count + VSHI_BALLS - 1) / VSHI_BALLS}, spheres = 1, first;
    int top = 0;
    for (made->block_count = sizes[0]; sizes[top] > 1; made->block_count += sizes[++top]) {
        sizes[top + 1] = (sizes[top] + VSHI_BALLS - 1) / VSHI_BALLS;
    }
    VSHI_TRY(vshi_allocate((void **)&made->block, made->block_count, sizeof *made->block, "spheres", error));
    first = made->block_count;
    for (int level = 0; level <= top; ++level, spheres *= VSHI_BALLS) { /* that a lane of it holds */
        const size_t below = first;
        first -= sizes[level];
        for (size_t i = 0; i < sizes[level] * VSHI_BALLS; ++i) {
            const size_t begin = i * spheres, left = made->info.count - begin;
            const int lane = (int)(i % VSHI_BALLS);
            vshi_ball_block *block = &made->block[first + i / VSHI_BALLS];
            if (begin >= made->info.count) {
                block->radius[lane] = -INFINITY;
                continue;
            }
            bound(made, begin, begin + (left < spheres ? left : spheres), rounding, block, lane);
            block->below[lane] = level == 0 ? ~(int32_t)begin : (int32_t)(below + i);
        }
    }
    return VSH_OK;
}

vsh_result vshi_sphere_check(const double sphere[4], const char *path, size_t number, vsh_error *error) {
    static const char *const names[] = {"x", "y", "z", "radius"};
    for (int k = 0; k < 4; ++k) {
        if (!(fabs(sphere[k]) <= LARGEST) || (k == 3 && !(sphere[k] > 0.0))) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s%s%zu: %s %g is out of range %g%s … %g",
                             path != NULL ? path : "sphere", path != NULL ? ":" : " ", number, names[k],
                             sphere[k], k == 3 ? 0.0 : -LARGEST, k == 3 ? " (excluded)" : "", LARGEST);
        }
    }
    return VSH_OK;
}

static vsh_result check(const double *spheres, size_t count, const double *transform, double *scale,
                        vsh_error *error) {
    if (count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "spheres: there are none");
    }
    if (count > MOST) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "spheres: %zu are more than %zu", count, MOST);
    }
    *scale = transform != NULL ? vshi_similarity_scale(transform) : 1.0;
    bool finite = *scale > 0.0 && isfinite(*scale);
    for (int i = 0; transform != NULL && i < 12; ++i) {
        finite = finite && isfinite(transform[i]);
    }
    if (!finite) {
        return vshi_fail(
            error, VSH_ERROR_ARGUMENT,
            "spheres: the transform must be finite and neither shear, scale unevenly nor flatten");
    }
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(vshi_sphere_check(spheres + 4 * i, NULL, i, error));
    }
    return VSH_OK;
}

static void place(vsh_spheres *made, const double *spheres, const double *transform, double scale) {
    vsh_spheres_info *info = &made->info;
    for (int axis = 0; axis < 3; ++axis) {
        info->bounds_min[axis] = INFINITY;
        info->bounds_max[axis] = -INFINITY;
    }
    for (size_t i = 0; i < info->count; ++i) {
        double *s = made->sphere[i];
        const vshi_vec p = vshi_transform_point(transform, vshi_vec_of(spheres + 4 * i));
        s[0] = p.x;
        s[1] = p.y;
        s[2] = p.z;
        s[3] = scale * spheres[4 * i + 3];
        for (int axis = 0; axis < 3; ++axis) {
            info->bounds_min[axis] = fmin(info->bounds_min[axis], s[axis] - s[3]);
            info->bounds_max[axis] = fmax(info->bounds_max[axis], s[axis] + s[3]);
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        made->middle[axis] = 0.5 * (info->bounds_min[axis] + info->bounds_max[axis]);
    }
}

static vsh_result make(vsh_spheres *made, const double *spheres, const double *transform, double scale,
                       vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&made->sphere, made->info.count, sizeof *made->sphere, "spheres", error));
    place(made, spheres, transform, scale);
    double extent = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        extent = fmax(extent, made->info.bounds_max[axis] - made->info.bounds_min[axis]);
    }
    VSHI_TRY(sort(made, extent, error));
    VSHI_TRY(build(made, ROUNDING * extent, error));
    made->info.bytes =
        sizeof *made + made->info.count * sizeof *made->sphere + made->block_count * sizeof *made->block;
    return VSH_OK;
}

vsh_result vsh_spheres_create(const double *spheres, size_t count, const double *transform,
                              const vsh_run *run, vsh_spheres **made, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(made);
    *made = NULL;
    VSHI_NEEDS_OF(count, spheres);
    vsh_run full;
    double scale = 1.0;
    vsh_spheres *own = NULL;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(check(spheres, count, transform, &scale, error));
    VSHI_TRY(vshi_check_limit(&full, 100.0 * (double)count, "spheres", error));
    VSHI_TRY(vshi_allocate((void **)&own, 1, sizeof *own, "spheres", error));
    own->info.count = count;
    const vsh_result result = make(own, spheres, transform, scale, error);
    if (result != VSH_OK) {
        vsh_spheres_free(own);
        return result;
    }
    *made = own;
    return VSH_OK;
}

void vsh_spheres_free(vsh_spheres *spheres) {
    if (spheres != NULL) {
        free(spheres->block);
        free(spheres->sphere);
        free(spheres);
    }
}

void vsh_spheres_get_info(const vsh_spheres *spheres, vsh_spheres_info *info) {
    *info = spheres->info;
}

uint64_t vshi_sphere_tree_search(const vsh_spheres *spheres, const vshi_ball_cone *cone, vshi_ball_fn *fn,
                                 void *user) {
    const float ox = (float)(cone->origin[0] - spheres->middle[0]),
                oy = (float)(cone->origin[1] - spheres->middle[1]),
                oz = (float)(cone->origin[2] - spheres->middle[2]);
    const float ax = (float)cone->axis[0], ay = (float)cone->axis[1], az = (float)cone->axis[2];
    const float sine = (float)cone->sine, cosine = (float)cone->cosine;
    const float far = (float)fmin(cone->far, 1e18);
    /* room for the rounding of where the cone begins */
    const float room = (float)ROUNDING * (fabsf(ox) + fabsf(oy) + fabsf(oz));
    int32_t stack[VSHI_BALLS * VSHI_BALL_DEPTH];
    int waiting = 0;
    uint64_t looked = 0;
    stack[waiting++] = 0;
    while (waiting > 0) {
        const vshi_ball_block *b = &spheres->block[stack[--waiting]];
        int32_t met[VSHI_BALLS];
        looked += VSHI_BALLS;
        for (int k = 0; k < VSHI_BALLS; ++k) {
            const float x = b->x[k] - ox, y = b->y[k] - oy, z = b->z[k] - oz;
            const float along = x * ax + y * ay + z * az;
            const float cx = y * az - z * ay, cy = z * ax - x * az, cz = x * ay - y * ax;
            const float square = x * x + y * y + z * z, across = sqrtf(cx * cx + cy * cy + cz * cz);
            const float radius = b->radius[k] + room, reach = far + radius;
            met[k] = (across * cosine - along * sine <= radius + 1e-6f * across) & (along >= -radius) &
                     (square <= reach * reach) & (radius > 0.0f);
        }
        for (int k = 0; k < VSHI_BALLS; ++k) {
            if (met[k] == 0) {
                continue;
            }
            if (b->below[k] >= 0) {
                stack[waiting++] = b->below[k];
            } else if (!fn(user, spheres->sphere[~b->below[k]])) {
                return looked;
            }
        }
    }
    return looked;
}

double vshi_sphere_tree_distance(const vsh_spheres *spheres, const double position[3]) {
    struct {
        double bound;
        int32_t block;
    } stack[VSHI_BALLS * VSHI_BALL_DEPTH];
    int waiting = 0;
    double nearest = INFINITY;
    stack[waiting].bound = -INFINITY;
    stack[waiting++].block = 0;
    const vshi_vec p = vshi_sub(vshi_vec_of(position), vshi_vec_of(spheres->middle));
    while (waiting > 0) {
        --waiting;
        if (stack[waiting].bound >= nearest) {
            continue;
        }
        const vshi_ball_block *b = &spheres->block[stack[waiting].block];
        const int first = waiting;
        for (int k = 0; k < VSHI_BALLS; ++k) {
            const vshi_vec to = {(double)b->x[k] - p.x, (double)b->y[k] - p.y, (double)b->z[k] - p.z};
            /* a bound that is wide enough for the rounding of floats; infinite where there is none */
            const double bound = vshi_length(to) - (double)b->radius[k];
            if (bound >= nearest) {
                continue;
            }
            if (b->below[k] < 0) {
                const double *s = spheres->sphere[~b->below[k]];
                nearest = fmin(nearest, vshi_length(vshi_sub(vshi_vec_of(s), vshi_vec_of(position))) - s[3]);
                continue;
            }
            int at = waiting++; /* nearest on top */
            for (; at > first && stack[at - 1].bound < bound; --at) {
                stack[at] = stack[at - 1];
            }
            stack[at].bound = bound;
            stack[at].block = b->below[k];
        }
    }
    return nearest;
}
