/* Values that rays marched through a field gave are off by what the rays leave, which their spread tells, and
 * by what the field's voxels make of the casters, which nothing in the field tells. So some of the samples
 * are held against rays to the casters themselves, stratified over each tile, so that every part of it counts
 * as much as it is large. Each has two values by rays, independent of each other: the product of both
 * differences is the squared error on average, without the rays' own noise in it. */
#include "bake/field_error.h"

#include "base/hash.h"
#include "shade/ao.h"
#include "shade/inside.h"
#include "trace/embree.h"

#include <math.h>

/* One sample in so many, which costs a few hundredths of shading them all, but not so few that a small
 * lightmap's error stays unknown. Where rays met the casters anyway, what is off is less and costs less. */
enum { ONE_IN = 16, ONE_TRACED_IN = 64, MOST = 16384, MOST_TRACED = 4096, LEAST = 4096, LEAST_TRACED = 1024 };
/* Rays of a sample in doubt, each of both times: their noise, over all samples, is then a tenth of the error
 * that is asked for, and less. */
enum { RAYS = 64, FINE_RAYS = 256 };
static const double FINE = 0.01;
/* Sums are of multiples of this, so that no order shows in their bits. */
static const double UNIT = 0x1p-32;

static size_t step_of(uint64_t samples, bool traced) {
    const uint64_t wanted = samples / (traced ? ONE_TRACED_IN : ONE_IN),
                   least = traced ? LEAST_TRACED : LEAST;
    const uint64_t most = traced ? MOST_TRACED : MOST;
    const uint64_t count = wanted < least ? least : wanted > most ? most : wanted;
    return samples > 0 ? (size_t)((samples + count - 1) / count) : 1;
}

static vshi_truth truth_of(const vsh_occluders *occluders, const vsh_shade_options *shade) {
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

vshi_field_error vshi_field_error_open(const vsh_occluders *occluders, const vsh_shade_options *shade,
                                       uint64_t samples, bool traced) {
    return (vshi_field_error){occluders, truth_of(occluders, shade), traced, step_of(samples, traced)};
}

/* Whether the casters leave it valid. */
static bool is_outside(const vshi_field_error *of, const double position[3], const float normal[3]) {
    const vshi_truth *truth = &of->truth;
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

/* The place of a sample among the origins; false: it is not valid. */
static bool find_origin(const vshi_origins *origins, size_t sample, uint32_t *origin) {
    size_t low = 0, high = origins->count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (origins->sample[middle] <= sample) {
            low = middle;
        } else {
            high = middle;
        }
    }
    *origin = (uint32_t)low;
    return low < origins->count && origins->sample[low] == sample;
}

size_t vshi_field_error_choose(const vshi_field_error *of, const vshi_samples *samples,
                               const vshi_origins *origins, vshi_held_sample *held) {
    size_t count = 0;
    for (size_t first = 0; first < samples->count; first += of->step) {
        const size_t left = samples->count - first, size = left < of->step ? left : of->step;
        const uint64_t bits = vshi_mix(((uint64_t)samples->texel[first] + 1) * UINT64_C(0x9e3779b97f4a7c15));
        const size_t i = first + (size_t)(bits % size);
        const vshi_vec p = vshi_sample_foot(samples, i);
        const double position[3] = {p.x, p.y, p.z};
        uint32_t origin;
        if (find_origin(origins, i, &origin) &&
            (of->traced || is_outside(of, position, samples->geometric + 3 * i))) {
            held[count++] = (vshi_held_sample){(uint32_t)i, origin, (uint32_t)size};
        }
    }
    return count;
}

int32_t vshi_field_error_rays(double max_error) {
    return max_error <= FINE ? FINE_RAYS : RAYS;
}

vsh_result vshi_truth_channel_open(const vshi_field_error *of, const vsh_light *light,
                                   const vsh_shade_options *options, vshi_truth_channel *channel,
                                   vsh_error *error) {
    *channel = (vshi_truth_channel){.truth = of->truth,
                                    .lifter = vshi_lifter_open(of->occluders, light),
                                    .up = vshi_vec_of(options->ao_up)};
    vshi_truth *truth = &channel->truth;
    const bool one_ray = light != NULL && vshi_light_is_point(&channel->lifter.place);
    truth->light = light;
    truth->place = channel->lifter.place;
    truth->distance = options->ao_distance;
    truth->up = vshi_dot(channel->up, channel->up) > 0.0 ? &channel->up : NULL;
    truth->rays = one_ray ? 1 : vshi_field_error_rays(options->max_error);
    truth->sampler = channel->sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, truth->rays, 0);
    return channel->sampler != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "error of the field: the system refused memory");
}

void vshi_truth_channel_close(vshi_truth_channel *channel) {
    vshi_sampler_free(channel->sampler);
    channel->sampler = NULL;
}

/* Where the rays of a sample to the casters begin. Where a light is cut by the plane of the triangle, the
 * lift undoes what the facet hides. Elsewhere it only moves shadows, which is an error. */
static void place(const vshi_truth_channel *channel, const vshi_samples *samples, size_t i,
                  double position[3]) {
    const vshi_lift_point point = vshi_sample_lift_point(samples, i);
    vshi_vec p = point.foot;
    if (vshi_light_is_cut(&channel->lifter, &point)) {
        p = vshi_add(p, vshi_lift_find(&channel->lifter, &point));
    }
    position[0] = p.x;
    position[1] = p.y;
    position[2] = p.z;
}

static void add(double weight, double square, vsh_bake_error *sum) {
    sum->held += weight;
    sum->held_square_error += rint(weight * square / UNIT) * UNIT;
}

void vshi_field_error_add(const vshi_truth_channel *channel, const vshi_samples *samples,
                          const vshi_held_sample *held, size_t count, const float *values,
                          vsh_bake_error *sum) {
    for (size_t k = 0; k < count; ++k) {
        const size_t i = held[k].sample;
        const double value = (double)values[held[k].origin];
        const float *face = channel->truth.light == NULL ? samples->geometric + 3 * i : NULL;
        double position[3], seen[2];
        place(channel, samples, i, position);
        if (!isnan(value) && vshi_truth_twice(&channel->truth, position, samples->normal + 3 * i, face,
                                              samples->texel[i], value, seen)) {
            add(held[k].weight, (value - seen[0]) * (value - seen[1]), sum);
        }
    }
}

size_t vshi_field_error_count(const vshi_truth_channel *channel, const vshi_samples *samples,
                              const vshi_held_sample *held, size_t count, vshi_held_texel *texels) {
    size_t counted = 0;
    for (size_t k = 0; k < count; ++k) {
        const size_t i = held[k].sample;
        double position[3];
        int32_t free[2], even;
        place(channel, samples, i, position);
        if (vshi_truth_count(&channel->truth, position, samples->normal + 3 * i, samples->geometric + 3 * i,
                             samples->texel[i], free, &even)) {
            texels[counted++] = (vshi_held_texel){
                samples->texel[i], held[k].weight, {(uint16_t)free[0], (uint16_t)free[1]}, (int16_t)even, 0};
        }
    }
    return counted;
}

void vshi_field_error_settle(const vshi_held_texel *texel, double max_error, float value,
                             vsh_bake_error *sum) {
    const int32_t free[2] = {texel->free[0], texel->free[1]};
    double seen[2];
    if (!isnan(value)) {
        vshi_truth_settle(vshi_field_error_rays(max_error), free, texel->even, (double)value, seen);
        add(texel->weight, ((double)value - seen[0]) * ((double)value - seen[1]), sum);
    }
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
