/* Ambient occlusion: checks, the method of taps, and the calls for points. */
#include "shade/ao.h"
#include "base/floats.h"
#include "base/memory.h"
#include "shade/layers.h"
#include "trace/embree.h"

#include <math.h>
#include <stdlib.h>

vshi_vec vshi_ao_face(const vshi_ao_task *task, size_t i, vshi_vec normal) {
    if (task->faces == NULL) {
        return normal;
    }
    const vshi_vec face = vshi_vec_off(task->faces + 3 * i);
    return vshi_dot(face, normal) < VSHI_ONE_NORMAL ? face : normal;
}

void vshi_ao_axes(vshi_vec normal, vshi_vec axes[3]) {
    vshi_frame(normal, &axes[0], &axes[1]);
    axes[2] = normal;
}

bool vshi_ao_frame_at(const vshi_ao_task *task, size_t i, vshi_ao_frame *frame, vsh_shade_stats *stats) {
    if (task->sphere) {
        frame->origin = vshi_to_field(task->field, task->points->positions + 3 * i);
        vshi_ao_axes((vshi_vec){0.0, 0.0, 1.0}, frame->axes);
        frame->grown = 0.0;
        task->ao[i] = NAN;
        stats->invalid += !vshi_finite(frame->origin);
        return vshi_finite(frame->origin);
    }
    vshi_vec normal;
    if (!vshi_shade_origin(task->field, task->points, i, vshi_shade_offset(task->field, &task->options),
                           &frame->origin, &normal)) {
        task->ao[i] = NAN;
        if (task->bent != NULL) {
            vshi_vec_to_floats((vshi_vec){NAN, NAN, NAN}, task->bent + 3 * i);
        }
        ++stats->invalid;
        return false;
    }
    vshi_ao_axes(normal, frame->axes);
    frame->grown = 0.0;
    return true;
}

/* Shades by five samples along the normal: how much nearer the surface is than an open plane (Quilez). Tuned
 * by eye; too dark in corners. */
static void shade_by_taps(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    /* his distances 0.01 … 0.13, scaled to the AO distance */
    static const double FIRST = 0.01, LAST = 0.13, FADE = 0.95, STRENGTH = 3.0;
    const double unit = task->distance / LAST;
    const double reach = (double)task->field->levels[task->field->level_count - 1].band;
    for (size_t i = begin; i < end; ++i) {
        vshi_ao_frame frame;
        if (!vshi_ao_frame_at(task, i, &frame, stats)) {
            continue;
        }
        double occlusion = 0.0, weight = 1.0;
        for (int tap = 0; tap < 5; ++tap) {
            const double h = FIRST + (LAST - FIRST) * tap / 4.0;
            const vshi_vec p = vshi_add(frame.origin, vshi_scale(frame.axes[2], h * unit));
            /* beyond the coarsest band the distance is only a lower bound, and shows no occluder */
            const double distance = vshi_distance_at(task->field, p);
            const bool beyond = distance >= reach && h * unit > reach;
            stats->beyond_reach += beyond;
            occlusion += beyond ? 0.0 : weight * (h - fmin(h, distance / unit));
            weight *= FADE;
        }
        stats->samples += 5;
        const double open = 1.0 - STRENGTH * occlusion;
        task->ao[i] = (float)(open < 0.0 ? 0.0 : open);
    }
}

void vshi_ao_shade(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const int32_t method = task->options.ao_method;
    vshi_shade_fn *shade = method == VSH_AO_TAPS    ? shade_by_taps
                           : method == VSH_AO_CONES ? vshi_ao_by_cones
                                                    : vshi_ao_by_rays;
    for (size_t i = begin; task->deviation != NULL && i < end; ++i) {
        task->deviation[i] = NAN;
    }
    for (size_t first = begin; first < end; first += VSHI_AO_GRAIN) {
        const size_t last = end - first < VSHI_AO_GRAIN ? end : first + VSHI_AO_GRAIN;
        shade(task, first, last, stats);
        if (task->layers != NULL) {
            vshi_layers_ao(task->layers, task, first, last, stats);
        }
    }
}

/* Share of the casters' diagonal that limits the scale. A well two wide and one deep is an eighth: with
 * lattices as wide as the AO distance allows, its floor came out darker by 0.01. */
static const double PART = 0.125;

/* The length over which AO bends, world units: the AO distance, or a part of the casters if that is less. */
static double scale_of(const vsh_occluders *occluders, double ao_distance) {
    const vsh_field *f = occluders->field;
    double low[3], high[3], side[3];
    if (occluders->triangles != NULL) {
        vshi_triangles_bounds(occluders->triangles, low, high);
    }
    for (int axis = 0; axis < 3; ++axis) {
        side[axis] = occluders->triangles != NULL
                         ? high[axis] - low[axis]
                         : f->voxel_size * ((double)f->bounds_max[axis] - (double)f->bounds_min[axis]);
    }
    return fmin(ao_distance, PART * vshi_length(vshi_vec_of(side)));
}

vsh_result vshi_ao_prepare(const vsh_occluders *occluders, const vsh_shade_options *options, bool sphere,
                           vshi_ao_task *task, vsh_error *error) {
    const vshi_vec up = vshi_vec_of(options->ao_up);
    const bool horizon = vshi_dot(up, up) > 0.0;
    *task = (vshi_ao_task){.field = occluders->field,
                           .triangles = occluders->triangles,
                           .options = *options,
                           .sphere = sphere,
                           .up = horizon ? vshi_unit(up) : up,
                           .distance = options->ao_distance / occluders->field->voxel_size,
                           .scale = scale_of(occluders, options->ao_distance)};
    const vsh_shade_options *full = &task->options;
    vshi_shade_options_settle(&task->options, occluders->triangles);
    if (full->ao_method == VSH_AO_EXACT && occluders->triangles == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "AO method exact: the occluders have no triangles, which it traces");
    }
    if (full->ao_method != VSH_AO_EXACT && occluders->field->unknown) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "AO method %s: the occluders have no voxels, which it marches; exact needs none",
                         vsh_get_name(VSH_NAMES_AO, full->ao_method));
    }
    if (horizon && !vshi_ao_has_rays(full)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "AO over a horizon: method %s knows none; rays, adaptive and exact do",
                         vsh_get_name(VSH_NAMES_AO, full->ao_method));
    }
    if (full->ao_method == VSH_AO_CONES) {
        VSHI_TRY(vshi_allocate((void **)&task->cones, 1, sizeof *task->cones, "AO", error));
        vshi_ao_cones_place(task->cones, full->ao_cones, sphere);
    }
    if (!vshi_ao_has_rays(full)) {
        return VSH_OK;
    }
    task->sampler = vshi_sampler_create(full->sampler, vshi_ao_most_rays(full), full->frame);
    return task->sampler != NULL ? VSH_OK
                                 : vshi_fail(error, VSH_ERROR_MEMORY, "AO: the system refused memory");
}

void vshi_ao_bent(float *bent, const float *normal) {
    const vshi_vec n = vshi_unit(vshi_vec_off(normal)), d = vshi_vec_off(bent);
    if (isnan(bent[0])) {
        return;
    }
    const vshi_vec b = vshi_dot(d, n) > 0.0 ? vshi_unit(d) : n;
    vshi_vec_to_floats(b, bent);
}

void vshi_ao_close(vshi_ao_task *task) {
    free(task->cones);
    vshi_sampler_free(task->sampler);
    vshi_layers_free(task->layers);
}

static vsh_result check_shading(const vsh_shade_options *options, vshi_ao_shading shading, vsh_error *error) {
    const vshi_vec up = vshi_vec_of(options->ao_up);
    const bool taps = options->ao_method == VSH_AO_TAPS, horizon = vshi_dot(up, up) > 0.0;
    const char *wrong =
        shading.sphere && taps      ? "AO method taps: free space has no normals to tap along"
        : shading.sphere && horizon ? "AO over a horizon: points in free space have no normals"
        : shading.bent && taps      ? "bent normals: AO by taps knows no directions; use cones or rays"
        : shading.bent && horizon   ? "bent normals: not of AO over a horizon"
                                    : NULL;
    return wrong == NULL ? VSH_OK : vshi_fail(error, VSH_ERROR_ARGUMENT, "%s", wrong);
}

vsh_result vshi_ao_open(const vsh_occluders *occluders, const vsh_shade_options *options,
                        vshi_ao_shading shading, int32_t isa, vshi_ao_task *task, vsh_error *error) {
    vsh_shade_options full;
    vshi_layers *layers;
    *task = (vshi_ao_task){.sampler = NULL};
    VSHI_TRY(vshi_shade_options_resolve(options, &full, error));
    VSHI_TRY(check_shading(&full, shading, error));
    VSHI_TRY(vshi_layers_prepare(occluders, &full, NULL, shading.sphere, &layers, error));
    if (shading.shared) {
        full.sampler = vshi_ao_tile_sampler(full.sampler);
    }
    const vsh_result result = vshi_ao_prepare(occluders, &full, shading.sphere, task, error);
    task->layers = layers;
    task->kernel = vshi_kernel_of(isa);
    task->outside = shading.outside;
    return result;
}

void vshi_ao_points(const vshi_ao_task *prepared, const vsh_points *points, const float *faces, float *ao,
                    float *deviation, float *bent, vsh_shade_stats *stats) {
    vshi_ao_task task = *prepared;
    task.points = points;
    task.faces = faces;
    task.ao = ao;
    task.deviation = deviation;
    task.bent = bent;
    vshi_ao_shade(&task, 0, points->count, stats);
}

vsh_result vsh_shade_ao(const vsh_occluders *occluders, const vsh_points *points,
                        const vsh_shade_options *options, const vsh_run *run, float *ao, float *deviation,
                        float *bent, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(points);
    VSHI_NEEDS_OF(points->count, points->positions);
    VSHI_NEEDS_OF(points->count, ao);
    vsh_run full_run;
    VSHI_TRY(vshi_run_resolve(run, &full_run, error));
    if (points->normals == NULL && points->count > 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "AO needs normals: vsh_points.normals is NULL");
    }
    vshi_ao_task task;
    vsh_result result;
    VSHI_TRY_DONE(vshi_ao_open(occluders, options, (vshi_ao_shading){.bent = bent != NULL}, full_run.isa,
                               &task, error));
    task.points = points;
    task.ao = ao;
    task.deviation = deviation;
    task.bent = bent;
    const size_t grain = task.options.ao_method == VSH_AO_TAPS ? VSHI_CHUNK : VSHI_AO_GRAIN;
    VSHI_TRY_DONE(vshi_shade_run(&full_run, "ao", points->count, grain, vshi_ao_shade, &task, stats, error));
    for (size_t i = 0; bent != NULL && i < points->count; ++i) {
        vshi_ao_bent(bent + 3 * i, points->normals + 3 * i);
    }
done:
    vshi_ao_close(&task);
    return result;
}
