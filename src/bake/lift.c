#include "bake/lift.h"
#include "base/elementary.h"
#include "base/parallel.h"
#include "trace/embree.h"

#include <math.h>

/* Where the ray begins that looks for triangles in a lift's way, in the height that rays on triangles begin
 * at: some roundings of a float over the sample's own triangle. */
static const double FIRST_PART = 0.125;

/* How far it goes, lifts: a sample may come half way to what is over it, or it would stand in its shadow. */
static const double ROOM = 2.0;

/* The sine of how high the lowest part of a light stands over a triangle whose samples need no lift for it:
 * 3°. A shadow's edge then moves by 20 lifts at most where one triangle's samples are lifted and those of the
 * next are not. */
static const double WELL_ABOVE = 0.05;

void vshi_lift_drop(const vsh_texels *texels, const vsh_triangles *triangles, size_t first, size_t last,
                    uint8_t *dropped) {
    const double hair = vshi_triangles_lift(triangles), start = FIRST_PART * hair;
    vshi_segment_ray rays[VSHI_ORIGIN_BLOCK];
    uint16_t of[VSHI_ORIGIN_BLOCK];
    bool blocked[VSHI_ORIGIN_BLOCK];
    size_t count = 0;
    for (size_t i = first; i < last; ++i) {
        const vshi_vec lift = vshi_vec_off(texels->lift + 3 * i);
        const double length = vshi_length(lift);
        if (!(length > start)) {
            continue;
        }
        const vshi_vec low =
            vshi_add(vshi_lift_foot(texels, i), vshi_scale(vshi_vec_off(texels->geometric + 3 * i), start));
        const vshi_vec up = vshi_scale(lift, 1.0 / length);
        rays[count] = (vshi_segment_ray){{low.x, low.y, low.z}, {up.x, up.y, up.z}, ROOM * length + hair};
        of[count++] = (uint16_t)(i - first);
    }
    vshi_triangles_blocked(triangles, rays, count, blocked);
    for (size_t k = 0; k < count; ++k) {
        dropped[first + of[k]] = dropped[first + of[k]] || blocked[k];
    }
}

typedef struct aiming {
    const vsh_texels *texels;
    vshi_lift_light light;
    vshi_origins *origins;
} aiming;

/* Whether all of the light is well above the triangle of a sample at `foot`. */
static bool is_above(const vsh_texels *texels, const vshi_lift_light *l, size_t sample, vshi_vec foot) {
    const vshi_vec normal = vshi_vec_off(texels->geometric + 3 * sample);
    const vshi_light_place *place = &l->place;
    if (place->parallel) {
        return vshi_dot(normal, place->towards) > place->sine + WELL_ABOVE;
    }
    const vshi_vec to = vshi_sub(place->centre, foot);
    return vshi_dot(normal, to) > place->radius + WELL_ABOVE * vshi_length(to);
}

vshi_lift_light vshi_lift_light_of(const vsh_light *light) {
    vshi_lift_light l = {.light = light};
    if (light != NULL) {
        l.place = vshi_light_in_world(light);
    }
    return l;
}

vshi_vec vshi_lift_place(const vsh_texels *texels, const vshi_lift_light *light, size_t sample,
                         bool dropped) {
    const vshi_vec foot = vshi_lift_foot(texels, sample);
    const bool low = dropped || (light->light != NULL && is_above(texels, light, sample, foot));
    return low ? foot : vshi_vec_of(texels->position + 3 * sample);
}

static void aim_blocks(void *user, size_t begin, size_t end) {
    const aiming *a = user;
    const vsh_texels *texels = a->texels;
    const vshi_origins *origins = a->origins;
    for (size_t block = begin; block < end; ++block) {
        size_t next = origins->before[block];
        const size_t last = (block + 1) * VSHI_ORIGIN_BLOCK;
        for (size_t i = block * VSHI_ORIGIN_BLOCK; i < last && i < texels->count; ++i) {
            if (!origins->valid[i]) {
                continue;
            }
            double *at = origins->surface + 3 * next++;
            const vshi_vec p = vshi_lift_place(texels, &a->light, i, origins->dropped[i]);
            at[0] = p.x;
            at[1] = p.y;
            at[2] = p.z;
        }
    }
}

vsh_result vshi_lift_for(const vsh_texels *texels, const vsh_light *light, const vsh_run *run,
                         vshi_origins *origins, vsh_error *error) {
    if (origins->surface == NULL) {
        return VSH_OK;
    }
    aiming a = {.texels = texels, .light = vshi_lift_light_of(light), .origins = origins};
    vshi_job *job = vshi_job_begin(run, "lift", origins->blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "lift: the system refused memory");
    }
    const vsh_result result = vshi_parallel_for(job, origins->blocks, 1, 1, aim_blocks, &a, error);
    vshi_job_end(job);
    return result;
}
