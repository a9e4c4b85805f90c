/* Values that rays marched through a field gave are off by what the rays leave, which their spread tells, and
 * by what the field's voxels make of the casters, which nothing in the field tells. So some of the samples
 * are held against rays to the casters themselves: stratified over the lightmap, one of each `step` that
 * follow each other along its tiles, so that every part of it counts as much as it is large. Each has two
 * values by rays, independent of each other: the product of both differences is the squared error on average,
 * without the rays' own noise in it.
 *
 * Samples that a field calls invalid and the casters don't are filled from others, and count by what they are
 * filled with. */
#include "bake/field_error.h"
#include "bake/padding.h"
#include "base/elementary.h"
#include "base/hash.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "shade/ao.h"
#include "shade/inside.h"
#include "trace/embree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* One sample in so many, which costs a few hundredths of shading them all, but not so few that a small
 * lightmap's error stays unknown. Where rays met the casters anyway, what is off is less and costs less. */
enum { ONE_IN = 16, ONE_TRACED_IN = 64, MOST_TRACED = 4096, LEAST = 4096, LEAST_TRACED = 1024 };
/* Rays of a sample in doubt, each of both times: their noise, over all samples, is then a tenth of the error
 * that is asked for, and less. */
enum { RAYS = 64, FINE_RAYS = 256 };
static const double FINE = 0.01;
/* Sums are of multiples of this, so that no order shows in their bits. */
static const double UNIT = 0x1p-32;
static const double TWO_PI = 6.28318530717958647692;
static const size_t NONE = SIZE_MAX;

struct vshi_field_error_sample {
    size_t sample;   /* of the texels' */
    size_t packed;   /* of the valid ones; NONE: it is not */
    size_t filled;   /* its texel among those held, if that is filled from others; NONE: it is not */
    uint32_t weight; /* samples that it stands for */
    bool counts;     /* the casters leave it valid, and it has a value */
};

_Static_assert(sizeof(struct vshi_field_error_sample) + sizeof(double) <= VSHI_FIELD_ERROR_BYTES,
               "what a sample takes");

static size_t step_of(const vsh_texels *texels, bool traced) {
    const uint64_t wanted = texels->whole / (traced ? ONE_TRACED_IN : ONE_IN),
                   least = traced ? LEAST_TRACED : LEAST;
    const uint64_t most = traced ? MOST_TRACED : VSHI_FIELD_ERROR_MOST;
    const uint64_t count = wanted < least ? least : wanted > most ? most : wanted;
    return (size_t)((texels->whole + count - 1) / count);
}

/* Number of groups of `step` in the band's own rows of tiles. */
static size_t count_groups(const vsh_texels *texels, size_t step) {
    const vshi_band *band = &texels->band;
    size_t count = 0;
    for (size_t row = band->own_begin; row < band->own_end; ++row) {
        const size_t *start = &texels->row_start[row - band->held_begin];
        count += (start[1] - start[0] + step - 1) / step;
    }
    return count;
}

/* Place of sample i among the valid ones. */
static size_t pack_of(const vshi_origins *origins, size_t i) {
    if (!origins->valid[i]) {
        return NONE;
    }
    const size_t block = i / VSHI_ORIGIN_BLOCK;
    size_t packed = origins->before[block];
    for (size_t k = block * VSHI_ORIGIN_BLOCK; k < i; ++k) {
        packed += origins->valid[k];
    }
    return packed;
}

static void choose(vshi_field_error *share, const vshi_origins *origins, const uint8_t *state, size_t step) {
    const vsh_texels *texels = share->texels;
    const vshi_band *band = &texels->band;
    share->count = 0;
    for (size_t row = band->own_begin; row < band->own_end; ++row) {
        const size_t *start = &texels->row_start[row - band->held_begin];
        for (size_t first = start[0]; first < start[1]; first += step) {
            const size_t left = start[1] - first, size = left < step ? left : step;
            const uint64_t bits =
                vshi_mix(((uint64_t)vshi_sample_place(texels, first) + 1) * UINT64_C(0x9e3779b97f4a7c15));
            const size_t i = first + (size_t)(bits % size), texel = vshi_sample_held(texels, i);
            share->samples[share->count++] =
                (vshi_field_error_sample){.sample = i,
                                          .packed = pack_of(origins, i),
                                          .filled = state[texel] == VSHI_TEXEL_INVALID ? texel : NONE,
                                          .weight = (uint32_t)size};
        }
    }
}

/* A sample that was filled counts where no more than this share of the rays from it say that they begin in a
 * solid: on an edge where two solids touch nobody can say what is right. */
enum { CLEAR_RAYS = 16 };
static const double CLEAR = 0.2;

/* Whether it plainly sees the open. */
static bool is_clear(const vshi_field_error *share, const double position[3], const float normal[3]) {
    static const double TURN = 0.38196601125010515; /* the golden angle, turns (Vogel, 1979) */
    const vsh_triangles *triangles = share->truth.triangles;
    if (triangles == NULL || !vshi_triangles_have_solids(triangles)) {
        return true;
    }
    const double lift = vshi_triangles_lift(triangles);
    const vshi_vec n = vshi_unit(vshi_vec_off(normal));
    const vshi_vec at = vshi_add(vshi_vec_of(position), vshi_scale(n, lift));
    vshi_vec u, v;
    vshi_frame(n, &u, &v);
    int behind = 0;
    for (int i = 0; i < CLEAR_RAYS; ++i) {
        const double square = (i + 0.5) / CLEAR_RAYS, radius = sqrt(square), angle = TWO_PI * i * TURN;
        const vshi_vec d = vshi_add(
            vshi_add(vshi_scale(u, radius * vshi_cos(angle)), vshi_scale(v, radius * vshi_sin(angle))),
            vshi_scale(n, sqrt(1.0 - square)));
        const vshi_segment_ray ray = {{at.x, at.y, at.z}, {d.x, d.y, d.z}, INFINITY};
        behind += vshi_triangles_depth(triangles, &ray) > 0;
    }
    return behind <= CLEAR * CLEAR_RAYS;
}

/* Whether the casters leave it valid. */
static bool is_outside(const vshi_field_error *share, const double position[3], const float normal[3]) {
    const vshi_truth *truth = &share->truth;
    uint8_t where = VSHI_OUTSIDE;
    if (truth->triangles != NULL) {
        vshi_inside(truth->triangles, 1, position, normal, NULL, NULL, NULL, &where);
    }
    double at[3];
    for (int k = 0; k < 3; ++k) {
        at[k] = position[k] + truth->lift * (double)normal[k];
    }
    return where == VSHI_OUTSIDE && (truth->solids == NULL || vsh_solids_distance(truth->solids, at) > 0.0);
}

static void look(void *user, size_t begin, size_t end) {
    const vshi_field_error *share = user;
    for (size_t k = begin; k < end; ++k) {
        vshi_field_error_sample *s = &share->samples[k];
        const vshi_vec p = vshi_sample_foot(share->texels, s->sample);
        const double position[3] = {p.x, p.y, p.z};
        const float *normal = share->texels->geometric + 3 * s->sample;
        if (share->traced) { /* what is valid was looked at in the same way */
            s->counts = s->packed != NONE;
            continue;
        }
        s->counts = (s->packed != NONE || s->filled != NONE) && is_outside(share, position, normal) &&
                    (s->packed != NONE || is_clear(share, position, normal));
    }
}

static vsh_result over_samples(vshi_field_error *share, vshi_range_fn *fn, void *user, const vsh_run *run,
                               vsh_error *error) {
    vshi_job *job = vshi_job_begin(run, "error of the field", share->count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "error of the field: the system refused memory");
    }
    const vsh_result result = vshi_parallel_for(job, share->count, 16, 1, fn, user, error);
    vshi_job_end(job);
    return result;
}

vshi_truth vshi_field_error_truth(const vsh_occluders *occluders, const vsh_shade_options *shade) {
    const vsh_field *field = occluders->field;
    static const double LIFT = 0x1p-18; /* of the casters' size, where no triangles say it */
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        size = fmax(size, field->world_max[axis] - field->world_min[axis]);
    }
    vshi_truth truth = {.triangles = occluders->true_triangles, .solids = occluders->true_solids};
    truth.lift = shade->surface_offset + (truth.triangles != NULL && truth.solids == NULL
                                              ? vshi_triangles_lift(truth.triangles)
                                              : LIFT * size);
    return truth;
}

vsh_result vshi_field_error_choose(const vsh_texels *texels, const vshi_origins *origins,
                                   const uint8_t *state, const vsh_occluders *occluders,
                                   const vshi_truth *truth, bool traced, const vsh_run *run,
                                   vshi_field_error *share, vsh_error *error) {
    *share = (vshi_field_error){.texels = texels, .truth = *truth, .traced = traced, .occluders = occluders};
    const size_t step = step_of(texels, traced), count = count_groups(texels, step > 0 ? step : 1);
    VSHI_TRY(
        vshi_allocate((void **)&share->samples, count, sizeof *share->samples, "error of the field", error));
    VSHI_TRY(
        vshi_allocate((void **)&share->square, count, sizeof *share->square, "error of the field", error));
    if (count == 0) {
        return VSH_OK;
    }
    choose(share, origins, state, step);
    return over_samples(share, look, share, run, error);
}

void vshi_field_error_free(vshi_field_error *share) {
    free(share->square);
    free(share->samples);
    *share = (vshi_field_error){0};
}

typedef struct holding {
    const vshi_field_error *share;
    vshi_truth truth;
    vshi_lifter lifter;
    vshi_vec up;
    const float *values, *filled; /* one of them is NULL */
    const vshi_ao_keep *keep;
} holding;

/* What is kept of a sample whose value is not known yet; NULL: it is. */
static vshi_ao_shot *left_of(const holding *h, const vshi_field_error_sample *s) {
    const uint32_t texel = h->share->texels->texel[s->sample];
    return h->keep != NULL && s->counts && s->packed != NONE
               ? vshi_ao_keep_left(h->keep, (int32_t)vsh_texel_column(texel), (int32_t)vsh_texel_row(texel))
               : NULL;
}

/* Rays to the casters, to be held against the value later. */
static void keep_count(const holding *h, const vshi_field_error_sample *s, const double position[3],
                       vshi_ao_shot *shot) {
    const vsh_texels *texels = h->share->texels;
    int32_t free[2], even;
    if (vshi_truth_count(&h->truth, position, texels->normal + 3 * s->sample,
                         texels->geometric + 3 * s->sample, (uint32_t)vshi_sample_place(texels, s->sample),
                         free, &even)) {
        shot->held[0] = s->weight | (even == VSHI_TRUTH_EVEN_HIDDEN ? VSHI_AO_EVEN_HIDDEN
                                     : even == VSHI_TRUTH_EVEN_FREE ? VSHI_AO_EVEN_FREE
                                                                    : 0);
        shot->held[1] = (uint32_t)free[0] | (uint32_t)free[1] << 16;
    }
}

int32_t vshi_field_error_rays(double max_error) {
    return max_error < FINE ? FINE_RAYS : RAYS;
}

/* A square by its weight. */
static double weighed(double weight, double square) {
    return rint(weight * square / UNIT) * UNIT;
}

static void hold(void *user, size_t begin, size_t end) {
    const holding *h = user;
    const vsh_texels *texels = h->share->texels;
    for (size_t k = begin; k < end; ++k) {
        const vshi_field_error_sample *s = &h->share->samples[k];
        /* Where a light is cut by the plane of the triangle, the lift undoes what the facet hides. Elsewhere
         * it only moves shadows, which is an error. */
        const vshi_lift_point point = vshi_sample_lift_point(texels, s->sample);
        vshi_vec p = point.foot;
        if (vshi_light_is_cut(&h->lifter, &point)) {
            p = vshi_add(p, vshi_lift_find(&h->lifter, &point));
        }
        const double position[3] = {p.x, p.y, p.z};
        const float *face = h->truth.light == NULL ? texels->geometric + 3 * s->sample : NULL;
        double value = NAN, seen[2];
        vshi_ao_shot *left = left_of(h, s);
        h->share->square[k] = NAN;
        if (left != NULL) {
            keep_count(h, s, position, left);
            continue;
        }
        if (s->counts && s->packed != NONE && h->values != NULL) {
            value = (double)h->values[s->packed];
        }
        if (s->counts && s->packed == NONE && h->filled != NULL) {
            value = (double)h->filled[s->filled];
        }
        if (!isnan(value) && vshi_truth_twice(&h->truth, position, texels->normal + 3 * s->sample, face,
                                              (uint32_t)vshi_sample_place(texels, s->sample), value, seen)) {
            h->share->square[k] = (value - seen[0]) * (value - seen[1]);
        }
    }
}

vsh_result vshi_field_error_add(vshi_field_error *share, const vsh_light *light,
                                const vsh_shade_options *options, const float *values, const float *filled,
                                const vshi_ao_keep *keep, const vsh_run *run, vsh_bake_error *sum,
                                vsh_error *error) {
    holding h = {.share = share,
                 .truth = share->truth,
                 .lifter = vshi_lifter_open(share->occluders, light),
                 .up = vshi_vec_of(options->ao_up),
                 .values = values,
                 .filled = filled,
                 .keep = keep};
    const bool one_ray = light != NULL && vshi_light_is_point(&h.lifter.place);
    h.truth.light = light;
    h.truth.place = h.lifter.place;
    h.truth.distance = options->ao_distance;
    h.truth.up = vshi_dot(h.up, h.up) > 0.0 ? &h.up : NULL;
    h.truth.rays = one_ray ? 1 : vshi_field_error_rays(options->max_error);
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, h.truth.rays, 0);
    if (sampler == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "error of the field: the system refused memory");
    }
    h.truth.sampler = sampler;
    const vsh_result result = over_samples(share, hold, &h, run, error);
    vshi_sampler_free(sampler);
    VSHI_TRY(result);
    double held = 0.0, square = 0.0;
    for (size_t k = 0; k < share->count; ++k) {
        if (!isnan(share->square[k])) {
            const double weight = share->samples[k].weight;
            held += weight;
            square += weighed(weight, share->square[k]);
        }
    }
    sum->held += held;
    sum->held_square_error += square;
    return VSH_OK;
}

void vshi_field_error_settle(const vshi_ao_shot *shot, double max_error, double value, vsh_bake_error *sum) {
    const int32_t rays = vshi_field_error_rays(max_error);
    const double weight = shot->held[0] & VSHI_AO_HELD_WEIGHT;
    const int32_t free[2] = {(int32_t)(shot->held[1] & 0xffff), (int32_t)(shot->held[1] >> 16)};
    const int32_t even = (shot->held[0] & VSHI_AO_EVEN_HIDDEN) != 0 ? VSHI_TRUTH_EVEN_HIDDEN
                         : (shot->held[0] & VSHI_AO_EVEN_FREE) != 0 ? VSHI_TRUTH_EVEN_FREE
                                                                    : VSHI_TRUTH_UNEVEN;
    double seen[2];
    vshi_truth_settle(rays, free, even, value, seen);
    sum->held += weight;
    sum->held_square_error += weighed(weight, (value - seen[0]) * (value - seen[1]));
}

double vsh_bake_error_rmse(const vsh_bake_error *e) {
    if (!(e->values > 0.0)) {
        return NAN;
    }
    const double rays = e->square_error / e->values;
    const double held = e->held > 0.0 ? e->held_square_error / e->held : 0.0;
    return sqrt(rays > held ? rays : held > 0.0 ? held : 0.0);
}

double vsh_bake_error_field(const vsh_bake_error *e) {
    if (!(e->values > 0.0) || !(e->held > 0.0)) {
        return NAN;
    }
    const double more = e->held_square_error / e->held - e->square_error / e->values;
    return more > 0.0 ? sqrt(more) : 0.0;
}
