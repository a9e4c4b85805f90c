/* Errors of values, measured against the casters. Marched values have the error of their rays, which the
 * rays' spread shows, and the error of the field's voxels, which nothing in the field shows. So some samples
 * are compared with rays to the casters. They are stratified over each tile, so that each part counts by its
 * size. Each sample gets two independent values by rays. The product of both differences is the squared error
 * on average, without the rays' own noise. */
#include "lightmap/page.h"

#include "base/bytes.h"
#include "shade/ao.h"
#include "shade/shade.h"
#include "trace/trace.h"

#include <math.h>

/* One sample in ONE_IN costs a few hundredths of all shading. Small lightmaps compare more. Where rays met
 * the casters anyway, the error is less and fewer samples are enough. */
enum { ONE_IN = 16, ONE_TRACED_IN = 64, MOST = 16384, MOST_TRACED = 4096, LEAST = 4096, LEAST_TRACED = 1024 };
/* Rays of each of the two values of a sample in doubt. Over all samples their noise is at most a tenth of the
 * error asked for. */
enum { RAYS = 64, FINE_RAYS = 256 };
static const double FINE = 0.01;
/* Sums are multiples of this, so that their order does not change them. */
static const double UNIT = 0x1p-32;

static vshi_truth truth_of(const vsh_occluders *occluders, const vsh_shade_options *shade) {
    const vsh_field *field = occluders->field;
    static const double OFFSET = 0x1p-18; /* share of the casters' size, without triangles */
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        size = fmax(size, field->world_max[axis] - field->world_min[axis]);
    }
    vshi_truth truth = {.triangles = occluders->true_triangles, .solids = occluders->true_solids};
    truth.offset = shade->surface_offset + (truth.triangles != NULL && truth.solids == NULL
                                                ? vshi_triangles_offset(truth.triangles)
                                                : OFFSET * size);
    return truth;
}

vshi_field_error vshi_field_error_open(const vsh_occluders *occluders, const vsh_shade_options *shade,
                                       uint64_t samples, bool traced) {
    const uint64_t least = traced ? LEAST_TRACED : LEAST, most = traced ? MOST_TRACED : MOST;
    const uint64_t wanted = samples / (traced ? ONE_TRACED_IN : ONE_IN);
    const uint64_t count = wanted < least ? least : wanted > most ? most : wanted;
    const size_t step = samples > 0 ? (size_t)((samples + count - 1) / count) : 1;
    return (vshi_field_error){occluders, truth_of(occluders, shade), traced, step, NULL};
}

/* Whether a sample is valid for the casters. */
static bool is_outside(const vshi_field_error *of, const double position[3], const float normal[3]) {
    const vshi_truth *truth = &of->truth;
    uint8_t where = VSHI_OUTSIDE;
    if (truth->triangles != NULL) {
        vshi_inside(truth->triangles, 1, position, normal, NULL, NULL, &where);
    }
    double at[3];
    for (int k = 0; k < 3; ++k) {
        at[k] = position[k] + truth->offset * (double)normal[k];
    }
    return where == VSHI_OUTSIDE && (truth->solids == NULL || vshi_solids_distance(truth->solids, at) > 0.0);
}

/* Finds a sample among the origins. False: it is not valid. */
static bool find_origin(const vshi_origins *origins, size_t sample, uint32_t *origin) {
    uint32_t low = 0, high = (uint32_t)origins->count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (origins->sample[middle] < sample) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    *origin = low;
    return low < origins->count && origins->sample[low] == sample;
}

size_t vshi_field_error_choose(const vshi_field_error *of, const vshi_samples *samples,
                               const vshi_origins *origins, vshi_compared_sample *compared) {
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
            compared[count++] = (vshi_compared_sample){(uint32_t)i, origin, (uint32_t)size};
        }
    }
    return count;
}

/* The most rays behind each of a sample's two values. */
static int32_t count_rays(double max_error) {
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
    truth->rays = one_ray ? 1 : count_rays(options->max_error);
    truth->sampler = channel->sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, truth->rays, 0);
    return channel->sampler != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "error of the field: the system refused memory");
}

void vshi_truth_channel_close(vshi_truth_channel *channel) {
    vshi_sampler_free(channel->sampler);
    channel->sampler = NULL;
}

/* Finds the origin of a sample's rays to the casters. If the plane of the triangle cuts a light, the lift
 * undoes what the facet hides. Elsewhere it only moves shadows, which is an error. */
static void place(const vshi_truth_channel *channel, const vshi_samples *samples, size_t i,
                  double position[3]) {
    const vshi_lift_point point = vshi_sample_lift_point(samples, i);
    vshi_vec p = point.foot;
    if (vshi_light_is_cut(&channel->lifter, &point)) {
        p = vshi_add(p, vshi_lift_find(&channel->lifter, &point));
    }
    vshi_vec_to_doubles(p, position);
}

static void add(double weight, double square, vsh_bake_error *sum) {
    sum->compared += weight;
    sum->compared_square_error += rint(weight * square / UNIT) * UNIT;
}

void vshi_field_error_add(const vshi_truth_channel *channel, const vshi_samples *samples,
                          const double *places, const vshi_compared_sample *compared, size_t count,
                          const float *values, vsh_bake_error *sum) {
    for (size_t k = 0; k < count; ++k) {
        const size_t i = compared[k].sample;
        const double value = (double)values[compared[k].origin];
        const vsh_light *light = channel->truth.light;
        const float *face = light == NULL ? samples->geometric + 3 * i : NULL;
        double position[3], seen[2];
        if (light != NULL &&
            !vshi_light_lights(&channel->truth.place, vshi_vec_of(places + 3 * (size_t)compared[k].origin))) {
            continue; /* 0 without error */
        }
        place(channel, samples, i, position);
        if (!isnan(value) && vshi_truth_twice(&channel->truth, position, samples->normal + 3 * i, face,
                                              samples->texel[i], value, seen)) {
            add(compared[k].weight, (value - seen[0]) * (value - seen[1]), sum);
        }
    }
}

size_t vshi_field_error_count(const vshi_truth_channel *channel, const vshi_samples *samples,
                              const vshi_compared_sample *compared, size_t count,
                              vshi_compared_texel *texels) {
    size_t counted = 0;
    for (size_t k = 0; k < count; ++k) {
        const size_t i = compared[k].sample;
        double position[3];
        int32_t free[2], even;
        place(channel, samples, i, position);
        if (vshi_truth_count(&channel->truth, position, samples->normal + 3 * i, samples->geometric + 3 * i,
                             samples->texel[i], free, &even)) {
            texels[counted++] = (vshi_compared_texel){samples->texel[i],
                                                      compared[k].weight,
                                                      {(uint16_t)free[0], (uint16_t)free[1]},
                                                      (int16_t)even,
                                                      0};
        }
    }
    return counted;
}

void vshi_field_error_settle(const vshi_compared_texel *texel, double max_error, float value,
                             vsh_bake_error *sum) {
    const int32_t free[2] = {texel->free[0], texel->free[1]};
    double seen[2];
    if (!isnan(value)) {
        vshi_truth_settle(count_rays(max_error), free, texel->even, (double)value, seen);
        add(texel->weight, ((double)value - seen[0]) * ((double)value - seen[1]), sum);
    }
}
