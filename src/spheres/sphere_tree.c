/* Making a hierarchy of bounding spheres, and searching it with cones. Spheres are halved at the median along
 * the longest side of their centres' box until eight parts, or parts of no more than eight, are left for a
 * block. */
#include "spheres/spheres.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/similarity.h"

#include <stdlib.h>
#include <string.h>

static const double LARGEST = 1e15;
static const size_t MOST = (size_t)1 << 30;
/* Of a float's rounding of a centre, and of the squares that are made of it, with room. */
static const double ROUNDING = 1e-6;

typedef struct builder {
    vsh_spheres *made;
    size_t capacity; /* blocks */
    double rounding; /* world units */
    vsh_error *error;
} builder;

typedef struct part {
    size_t begin, end;
} part;

/* The box of a part's centres, with `radii` times their radii around them. */
static void find_box(double (*sphere)[4], part p, double radii, double low[3], double high[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
        for (size_t i = p.begin; i < p.end; ++i) {
            low[axis] = fmin(low[axis], sphere[i][axis] - radii * sphere[i][3]);
            high[axis] = fmax(high[axis], sphere[i][axis] + radii * sphere[i][3]);
        }
    }
}

static int longest_axis(double (*sphere)[4], part p) {
    double low[3], high[3];
    int longest = 0;
    find_box(sphere, p, 0.0, low, high);
    for (int axis = 1; axis < 3; ++axis) {
        longest = high[axis] - low[axis] > high[longest] - low[longest] ? axis : longest;
    }
    return longest;
}

static void swap(double *a, double *b) {
    double kept[4];
    memcpy(kept, a, sizeof kept);
    memcpy(a, b, sizeof kept);
    memcpy(b, kept, sizeof kept);
}

/* Puts the spheres that come first along the axis before `nth` (C. A. R. Hoare, "Find", 1961). */
static void part_at(double (*sphere)[4], part p, size_t nth, int axis) {
    ptrdiff_t low = (ptrdiff_t)p.begin, high = (ptrdiff_t)p.end - 1, at = (ptrdiff_t)nth;
    while (low < high) {
        const double pivot = sphere[low + (high - low) / 2][axis];
        ptrdiff_t i = low, j = high;
        while (i <= j) {
            for (; sphere[i][axis] < pivot; ++i) {
            }
            for (; sphere[j][axis] > pivot; --j) {
            }
            if (i <= j) {
                swap(sphere[i++], sphere[j--]);
            }
        }
        low = at > j ? i : low;
        high = at < i ? j : high;
    }
}

/* Cuts a range into at most VSHI_BALLS parts; returns their number. */
static size_t cut(double (*sphere)[4], part all, part parts[VSHI_BALLS]) {
    size_t count = 1;
    parts[0] = all;
    if (all.end - all.begin <= VSHI_BALLS) {
        for (size_t i = all.begin; i < all.end; ++i) {
            parts[i - all.begin] = (part){i, i + 1};
        }
        return all.end - all.begin;
    }
    while (count < VSHI_BALLS) {
        size_t largest = 0;
        for (size_t i = 1; i < count; ++i) {
            largest = parts[i].end - parts[i].begin > parts[largest].end - parts[largest].begin ? i : largest;
        }
        const part p = parts[largest];
        const size_t size = p.end - p.begin;
        if (size <= VSHI_BALLS) {
            break;
        }
        /* whole blocks to the left, so that hardly any is half empty */
        const size_t left =
            size <= 2 * VSHI_BALLS ? VSHI_BALLS : (size / 2 + VSHI_BALLS - 1) / VSHI_BALLS * VSHI_BALLS;
        part_at(sphere, p, p.begin + left, longest_axis(sphere, p));
        parts[largest] = (part){p.begin, p.begin + left};
        parts[count++] = (part){p.begin + left, p.end};
    }
    return count;
}

/* A sphere around a part's spheres, around the middle of their box, from the set's middle. */
static void bound(const builder *b, part p, vshi_ball_block *block, size_t lane) {
    double(*sphere)[4] = b->made->sphere;
    double low[3], high[3];
    find_box(sphere, p, 1.0, low, high);
    const vshi_vec centre = {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
    double radius = 0.0;
    for (size_t i = p.begin; i < p.end; ++i) {
        radius = fmax(radius, vshi_length(vshi_sub(vshi_vec_of(sphere[i]), centre)) + sphere[i][3]);
    }
    block->x[lane] = (float)(centre.x - b->made->middle[0]);
    block->y[lane] = (float)(centre.y - b->made->middle[1]);
    block->z[lane] = (float)(centre.z - b->made->middle[2]);
    block->radius[lane] = (float)(radius * (1.0 + ROUNDING) + b->rounding);
}

static vsh_result add_block(builder *b, size_t *index) {
    vsh_spheres *made = b->made;
    if (made->block_count == b->capacity) {
        const size_t capacity = 2 * b->capacity;
        void *grown = NULL;
        VSHI_TRY(vshi_allocate(&grown, capacity, sizeof *made->block, "spheres", b->error));
        memcpy(grown, made->block, made->block_count * sizeof *made->block);
        free(made->block);
        made->block = grown;
        b->capacity = capacity;
    }
    *index = made->block_count++;
    return VSH_OK;
}

/* Depth is log8 of the count. */
static vsh_result build(builder *b, part p, size_t *index) {
    part parts[VSHI_BALLS];
    const size_t count = cut(b->made->sphere, p, parts);
    VSHI_TRY(add_block(b, index));
    for (size_t lane = 0; lane < VSHI_BALLS; ++lane) {
        if (lane >= count) {
            b->made->block[*index].radius[lane] = -INFINITY;
            continue;
        }
        bound(b, parts[lane], &b->made->block[*index], lane);
        int32_t below = ~(int32_t)parts[lane].begin;
        if (parts[lane].end - parts[lane].begin > 1) {
            size_t child = 0;
            VSHI_TRY(build(b, parts[lane], &child));
            below = (int32_t)child;
        }
        b->made->block[*index].below[lane] = below;
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
    for (size_t i = 0; i < info->count; ++i) {
        double *s = made->sphere[i];
        const vshi_vec p = vshi_transform_point(transform, vshi_vec_of(spheres + 4 * i));
        s[0] = p.x;
        s[1] = p.y;
        s[2] = p.z;
        s[3] = scale * spheres[4 * i + 3];
    }
    find_box(made->sphere, (part){0, info->count}, 1.0, info->bounds_min, info->bounds_max);
    for (int axis = 0; axis < 3; ++axis) {
        made->middle[axis] = 0.5 * (info->bounds_min[axis] + info->bounds_max[axis]);
    }
}

static vsh_result make(vsh_spheres *made, const double *spheres, const double *transform, double scale,
                       vsh_error *error) {
    const size_t capacity = made->info.count / 5 + 4;
    VSHI_TRY(vshi_allocate((void **)&made->sphere, made->info.count, sizeof *made->sphere, "spheres", error));
    VSHI_TRY(vshi_allocate((void **)&made->block, capacity, sizeof *made->block, "spheres", error));
    place(made, spheres, transform, scale);
    double extent = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        extent = fmax(extent, made->info.bounds_max[axis] - made->info.bounds_min[axis]);
    }
    builder b = {made, capacity, ROUNDING * extent, error};
    size_t top = 0;
    VSHI_TRY(build(&b, (part){0, made->info.count}, &top));
    made->info.bytes =
        sizeof *made + made->info.count * sizeof *made->sphere + b.capacity * sizeof *made->block;
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
