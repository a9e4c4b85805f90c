#include "heightfield/place.h"

#include "base/isa.h"

/* Receivers are meshes of floats, and of other triangles than the heightfield's: so far below the surface, in
 * cells, a point is one on it. */
static const double UNDER = 0.25;

vshi_walk_fn *vshi_walk_of_machine(void) {
    switch (vshi_isa_resolve(VSH_ISA_BEST)) {
#if defined(__x86_64__)
    case VSH_ISA_AVX512:
        return vshi_walk_avx512;
    case VSH_ISA_AVX2:
        return vshi_walk_avx2;
#endif
    default:
        return vshi_walk_base;
    }
}

vshi_vec vshi_heights_direction(const vsh_heights *heights, vshi_vec direction) {
    return vshi_unit(vshi_transform_vector(heights->to_relief, direction));
}

vshi_stand vshi_heights_stand(const vsh_heights *heights, const vsh_points *points, size_t i, double lift,
                              double at[3], vshi_vec *normal) {
    vshi_vec p = vshi_transform_point(heights->to_relief, vshi_vec_of(points->positions + 3 * i));
    *normal = (vshi_vec){0.0, 0.0, 0.0};
    if (points->normals != NULL) {
        *normal = vshi_heights_direction(heights, vshi_vec_off(points->normals + 3 * i));
        if (!(vshi_dot(*normal, *normal) > 0.5)) {
            return VSHI_STAND_INVALID;
        }
        p = vshi_add(p, vshi_scale(*normal, lift / heights->unit));
    }
    if (!vshi_finite(p)) {
        return VSHI_STAND_INVALID;
    }
    const vshi_height_pyramid *r = &heights->relief;
    if (p.x >= 0.0 && p.x <= r->columns - 1 && p.z >= 0.0 && p.z <= (r->rows - 1) * r->depth) {
        const double surface = vshi_height_pyramid_height(r, p.x, p.z);
        if (p.y < surface && p.y >= surface - UNDER) {
            p.y = surface;
        } else if (p.y < surface && p.y > r->bottom) {
            return VSHI_STAND_BURIED;
        }
    }
    at[0] = p.x;
    at[1] = p.y;
    at[2] = p.z;
    return VSHI_STAND_FREE;
}

double vshi_heights_under(const vshi_height_pyramid *r, const double at[3], double x, double z) {
    const double ends[2] = {r->columns - 1, (r->rows - 1) * r->depth};
    const double from[2] = {at[0], at[2]}, along[2] = {x, z};
    double near = 0.0, far = INFINITY;
    for (int axis = 0; axis < 2; ++axis) {
        if (along[axis] == 0.0) {
            if (from[axis] < 0.0 || from[axis] > ends[axis]) {
                return -INFINITY;
            }
            continue;
        }
        const double a = -from[axis] / along[axis], b = (ends[axis] - from[axis]) / along[axis];
        near = fmax(near, fmin(a, b));
        far = fmin(far, fmax(a, b));
    }
    if (near > far) {
        return -INFINITY; /* beside it: no horizon either */
    }
    const double t = at[1] >= r->bottom ? near : far;
    return t > 0.0 ? (r->bottom - at[1]) / t : -INFINITY;
}

double vshi_heights_lift(const vsh_heights *heights, double start_offset) {
    return start_offset > 0.0 ? start_offset * heights->unit : 0.0;
}

bool vshi_heights_hold(const vsh_heights *heights, const double position[3]) {
    const vsh_points points = {1, position, NULL, NULL};
    double at[3];
    vshi_vec normal;
    return vshi_heights_stand(heights, &points, 0, 0.0, at, &normal) == VSHI_STAND_BURIED;
}
