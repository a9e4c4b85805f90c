#include "bake/bent_normals.h"

#include "bake/average.h"
#include "base/names.h"
#include "base/parallel.h"
#include "shade/ao.h"

#include <string.h>

static const char *const spaces_table[] = {[VSH_BENT_WORLD] = "world", [VSH_BENT_TANGENT] = "tangent"};
static const vshi_names spaces = VSHI_NAMES(spaces_table);

int32_t vsh_bent_space(const char *name) {
    return vshi_name_find(spaces, name);
}

const char *vsh_bent_space_name(int32_t space) {
    return vshi_name_at(spaces, space);
}

typedef struct bending {
    const vsh_texels *texels;
    const vshi_origins *origins;
    int32_t space;
    const vshi_ao_keep *keep;
    float *bent;
} bending;

/* To tangent space: the sample's own axes. */
static void turn_to_tangent(const float *normal, const float *given, float *bent) {
    const vshi_vec n = vshi_unit(vshi_vec_off(normal));
    vshi_vec t = vshi_vec_off(given), b;
    t = vshi_sub(t, vshi_scale(n, vshi_dot(n, t)));
    if (!(vshi_dot(t, t) > 0.0)) {
        vshi_frame(n, &t, &b);
    }
    t = vshi_unit(t);
    b = vshi_scale(vshi_cross(n, t), (double)given[3]);
    const vshi_vec d = vshi_vec_off(bent);
    bent[0] = (float)vshi_dot(d, t);
    bent[1] = (float)vshi_dot(d, b);
    bent[2] = (float)vshi_dot(d, n);
}

static void keep_tangent(const bending *b, size_t sample) {
    const uint32_t texel = b->texels->texel[sample];
    vshi_ao_kept kept;
    if (vshi_ao_keep_row(b->keep, (int32_t)vsh_texel_row(texel), &kept)) {
        memcpy(kept.tangent + 4 * (size_t)vsh_texel_column(texel), b->texels->tangent + 4 * sample,
               4 * sizeof *kept.tangent);
    }
}

static void bend_blocks(void *user, size_t begin, size_t end) {
    const bending *b = user;
    for (size_t block = begin; block < end; ++block) {
        size_t next = b->origins->before[block];
        const size_t last = (block + 1) * VSHI_ORIGIN_BLOCK;
        for (size_t i = block * VSHI_ORIGIN_BLOCK; i < last && i < b->texels->count; ++i) {
            if (!b->origins->valid[i]) {
                continue;
            }
            vshi_ao_bent(b->bent + 3 * next, b->origins->normal + 3 * next);
            if (b->space == VSH_BENT_TANGENT) {
                turn_to_tangent(b->texels->normal + 3 * i, b->texels->tangent + 4 * i, b->bent + 3 * next);
                keep_tangent(b, i);
            }
            ++next;
        }
    }
}

vsh_result vshi_bent_normals(const vsh_texels *texels, const vshi_origins *origins, int32_t space,
                             const vshi_ao_keep *keep, const vsh_run *run, float *bent, vsh_error *error) {
    bending b = {texels, origins, space, keep, bent};
    vshi_job *job = vshi_job_begin(run, "bent", origins->blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "bent: the system refused memory");
    }
    const vsh_result result = vshi_parallel_for(job, origins->blocks, 1, 1, bend_blocks, &b, error);
    vshi_job_end(job);
    return result;
}

void vshi_bent_normals_again(size_t count, float *plane) {
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec d = vshi_unit(vshi_vec_off(plane + 3 * i));
        plane[3 * i] = (float)d.x;
        plane[3 * i + 1] = (float)d.y;
        plane[3 * i + 2] = (float)d.z;
    }
}

void vshi_bent_normal(const float *normal, const float *tangent, float *bent) {
    vshi_ao_bent(bent, normal);
    if (tangent != NULL) {
        turn_to_tangent(normal, tangent, bent);
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        bent[axis] = vshi_average_of_one(bent[axis]);
    }
    vshi_bent_normals_again(1, bent);
}
