/* Shadow values: the visible fraction of a light, by one cone or ray a point. */
#include "shade/shadow.h"
#include "base/bytes.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "trace/trace.h"

#include <math.h>
#include <stdio.h>

/* A march by practical ends here: less of the light is dark. */
static const double PRACTICAL_END = 0.004;

/* Turns a closeness into a visible fraction, by method. */
static float remap(int32_t method, double closeness, double sine) {
    if (method == VSH_SHADOW_HARD || sine <= 0.0) {
        return closeness > 0.0 ? 1.0f : 0.0f;
    }
    const double x = closeness / sine;
    switch (method) {
    case VSH_SHADOW_CLASSIC:
    case VSH_SHADOW_IMPROVED:
        return (float)(x <= 0.0 ? 0.0 : x >= 1.0 ? 1.0 : x);
    case VSH_SHADOW_PRACTICAL:
        return (float)(x < PRACTICAL_END ? 0.0 : x >= 1.0 ? 1.0 : x * x * (3.0 - 2.0 * x));
    case VSH_SHADOW_SMOOTH:
        return (float)(x <= -1.0 ? 0.0 : x >= 1.0 ? 1.0 : 0.25 * (1.0 + x) * (1.0 + x) * (2.0 - x));
    default:
        return (float)vshi_cone_visibility(closeness, sine);
    }
}

/* Aims the cone of point i, which begins at `origin`. One march gets the light's own cone, rays get one that
 * holds the whole light. The lamp is seen from the point itself: a lamp nearer than the start offset would
 * otherwise be below the horizon. */
static vshi_light_side aim(const vshi_shadow_task *task, size_t i, vshi_vec origin, vshi_cone *cone) {
    const bool hard = task->options.method == VSH_SHADOW_HARD,
               has_rays = vshi_shadow_has_rays(&task->options);
    *cone = (vshi_cone){.origin = origin, .horizon = INFINITY};
    vshi_light_view view;
    const vshi_light_side side = vshi_light_look(
        &task->place, vshi_to_field(task->field, task->points->positions + 3 * i), hard, &view);
    if (side == VSHI_LIGHT_SEEN) {
        cone->direction = view.axis;
        cone->sine = hard ? 0.0 : has_rays ? view.bound : view.sine;
        cone->end = cone->whole = has_rays ? view.end : vshi_light_end(&view);
    }
    return side;
}

void vshi_shadow_gather(const vshi_shadow_task *task, size_t begin, size_t end, vshi_facing *facing,
                        vshi_chunk *chunk, vsh_shade_stats *stats) {
    const double offset = vshi_shade_offset(task->field, &task->options);
    facing->count = 0;
    for (size_t i = begin; i < end; ++i) {
        vshi_cone *cone = &facing->cone[facing->count];
        vshi_vec *normal = &facing->normal[facing->count];
        vshi_vec origin;
        if (!vshi_shade_origin(task->field, task->points, i, offset, &origin, normal)) {
            vshi_shadow_settle(task, i, NAN, NAN);
            ++stats->invalid;
            continue;
        }
        const vshi_light_side side =
            vshi_shadow_reaches(task, i) ? aim(task, i, origin, cone) : VSHI_LIGHT_AWAY;
        if (side != VSHI_LIGHT_SEEN) {
            vshi_shadow_settle(task, i, side == VSHI_LIGHT_WITHIN ? 1.0f : 0.0f, 0.0f);
            stats->skipped += side == VSHI_LIGHT_AWAY;
            continue;
        }
        if (task->points->normals != NULL) {
            cone->horizon = vshi_dot(*normal, cone->direction);
            if (cone->horizon <= -task->lowest * cone->sine) {
                vshi_shadow_settle(task, i, 0.0f, 0.0f);
                ++stats->skipped;
                continue;
            }
        }
        facing->settled[facing->count] = false;
        facing->gathered[facing->count] = false;
        facing->point[facing->count++] = i;
    }
    vshi_blocks_prove(task, facing, chunk, stats);
}

double vshi_shadow_above(const vshi_shadow_task *task, size_t i) {
    const vsh_points *points = task->points;
    vshi_cone cone;
    if (points->normals == NULL || aim(task, i, (vshi_vec){0.0, 0.0, 0.0}, &cone) != VSHI_LIGHT_SEEN) {
        return 1.0;
    }
    const vshi_vec normal = vshi_direction_to_field(task->field, vshi_vec_off(points->normals + 3 * i));
    if (task->place.shape != NULL && vshi_shadow_has_rays(&task->options)) {
        return task->place.shape->above(&task->place, vshi_to_field(task->field, points->positions + 3 * i),
                                        normal);
    }
    const double sine = vshi_dot(normal, cone.direction);
    return (double)remap(task->options.method, sine < cone.sine || cone.sine <= 0.0 ? sine : cone.sine,
                         cone.sine);
}

/* The share to which the steps of a point are shortened. */
static float pace_of(const vshi_shadow_task *task, size_t point) {
    const vsh_points *points = task->points;
    const uint64_t texel = points->texels != NULL ? points->texels[point] : point;
    const uint64_t bits =
        vshi_mix((texel + 1) * UINT64_C(0x9e3779b97f4a7c15) + (uint64_t)task->options.frame);
    return (float)(1.0 - task->options.jitter * (double)(bits >> 11) * 0x1p-53);
}

static void shade_points(const vshi_shadow_task *task, size_t begin, size_t end, vsh_shade_stats *stats) {
    const int32_t method = task->options.method;
    vshi_facing facing;
    vshi_chunk chunk;
    vshi_shadow_gather(task, begin, end, &facing, &chunk, stats);
    for (size_t i = 0; i < facing.count; ++i) {
        vshi_cone *cone = &facing.cone[i];
        const bool hard = cone->sine <= 0.0;
        /* the receiver's own horizon is an edge: its sine is the closeness of a plane */
        cone->close = hard ? 1.0 : cone->horizon < cone->sine ? cone->horizon : cone->sine;
        cone->stop = method == VSH_SHADOW_PRACTICAL ? PRACTICAL_END * cone->sine : -task->lowest * cone->sine;
        if (!vshi_chunk_add(&chunk, task->field, cone, (uint32_t)i, stats)) {
            /* in floats, as the kernel returns it: whether a cone marches depends on the neighbours */
            task->visibility[facing.point[i]] =
                remap(method, (double)(float)cone->close, (double)(float)cone->sine);
            stats->certified += cone->close >= cone->sine;
        }
    }
    const bool jittered = task->options.jitter > 0.0 && method != VSH_SHADOW_IMPROVED;
    for (size_t r = 0; jittered && r < chunk.count; ++r) {
        chunk.pace[r] = pace_of(task, facing.point[chunk.owner[r]]);
    }
    const int32_t kind = jittered                        ? VSHI_MARCH_JITTERED
                         : method == VSH_SHADOW_IMPROVED ? VSHI_MARCH_TRIANGULATED
                                                         : VSHI_MARCH_PLAIN;
    vshi_chunk_march(&chunk, task->kernel, task->field, kind, task->options.max_steps, stats);
    for (size_t r = 0; r < chunk.count; ++r) {
        const double closeness = chunk.close[r];
        const double sine = chunk.sine[r];
        stats->certified += sine > 0.0 && (closeness >= sine || closeness <= -sine);
        task->visibility[facing.point[chunk.owner[r]]] = remap(method, closeness, sine);
    }
}

void vshi_shadow_shade(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_shadow_task *task = user;
    if (vshi_shadow_has_rays(&task->options)) {
        vshi_shadow_by_rays(task, begin, end, stats);
    } else {
        shade_points(task, begin, end, stats);
        for (size_t i = begin; task->deviation != NULL && i < end; ++i) {
            task->deviation[i] = NAN;
        }
    }
    if (task->layers != NULL) {
        vshi_layers_shadow(task->layers, task, begin, end, stats);
    }
}

vsh_result vshi_shadow_prepare(const vsh_occluders *occluders, const vsh_light *light,
                               const vsh_shade_options *options, vshi_shadow_task *task, vsh_error *error) {
    *task = (vshi_shadow_task){.sampler = NULL};
    VSHI_TRY(vsh_light_check(light, error));
    const vsh_field *field = occluders->field;
    const vshi_triangles *triangles = occluders->triangles;
    vsh_shade_options full = *options;
    vshi_shade_options_settle(&full, triangles);
    const bool traced = vshi_shadow_traces(&full, triangles);
    if (traced && triangles == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "method exact: the occluders have no triangles, which it traces");
    }
    if (field->unknown && !traced) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "method %s: the occluders have no voxels, which it marches; exact needs none",
                         vsh_get_name(VSH_NAMES_SHADOW, full.method));
    }
    const bool inner = (vsh_method_traits(VSH_NAMES_SHADOW, full.method) & VSH_METHOD_INNER) != 0;
    *task = (vshi_shadow_task){
        .field = field, .triangles = triangles, .light = light, .options = full, .lowest = inner ? 1.0 : 0.0};
    task->leaky = traced && (field->shell_thickness > 0.0 || vshi_triangles_have_holes(triangles));
    task->world = vshi_light_in_world(light);
    task->place = vshi_light_moved(&task->world, field->to_field, field->voxel_size);
    for (size_t i = 0; i < sizeof light->name && light->name[i] != '\0'; ++i) {
        task->purpose = 31u * task->purpose + (unsigned char)light->name[i];
    }
    if (!vshi_shadow_has_rays(&full)) {
        return VSH_OK;
    }
    task->sampler = vshi_sampler_create(full.sampler, vshi_shadow_most_rays(&full), full.frame);
    return task->sampler != NULL ? VSH_OK
                                 : vshi_fail(error, VSH_ERROR_MEMORY, "shadow: the system refused memory");
}

void vshi_shadow_close(vshi_shadow_task *task) {
    vshi_sampler_free(task->sampler);
    vshi_layers_free(task->layers);
}

vsh_result vshi_shadow_open(const vsh_occluders *occluders, const vsh_light *light,
                            const vsh_shade_options *options, int32_t isa, vshi_shadow_task *task,
                            vsh_error *error) {
    vsh_shade_options full;
    vshi_layers *layers;
    *task = (vshi_shadow_task){.sampler = NULL};
    VSHI_TRY(vshi_shade_options_resolve(options, &full, error));
    VSHI_TRY(vsh_light_check(light, error));
    VSHI_TRY(vshi_layers_prepare(occluders, &full, light, false, &layers, error));
    const vsh_result result = vshi_shadow_prepare(occluders, light, &full, task, error);
    task->layers = layers;
    task->kernel = vshi_kernel_of(isa);
    return result;
}

void vshi_shadow_points(const vshi_shadow_task *prepared, const vsh_points *points, const double *places,
                        float *visibility, float *deviation, vsh_shade_stats *stats) {
    vshi_shadow_task task = *prepared;
    task.points = points;
    task.places = places;
    task.visibility = visibility;
    task.deviation = deviation;
    for (size_t begin = 0; begin < points->count; begin += VSHI_PIECE) {
        const size_t left = points->count - begin;
        vshi_shadow_shade(&task, begin, begin + (left < VSHI_PIECE ? left : VSHI_PIECE), stats);
    }
}

vsh_result vsh_shade_shadow(const vsh_occluders *occluders, const vsh_points *points, const vsh_light *light,
                            const vsh_shade_options *options, const vsh_run *run, float *visibility,
                            float *deviation, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(occluders, points);
    VSHI_NEEDS_OF(points->count, points->positions);
    VSHI_NEEDS_OF(points->count, visibility);
    vsh_run full_run;
    VSHI_TRY(vshi_run_resolve(run, &full_run, error));
    vshi_shadow_task task;
    vsh_result result;
    VSHI_TRY_DONE(vshi_shadow_open(occluders, light, options, full_run.isa, &task, error));
    char stage[sizeof light->name + 8];
    snprintf(stage, sizeof stage, "shadow.%.*s", (int)sizeof light->name, light->name);
    task.points = points;
    task.visibility = visibility;
    task.deviation = deviation;
    result =
        vshi_shade_run(&full_run, stage, points->count, VSHI_PIECE, vshi_shadow_shade, &task, stats, error);
done:
    vshi_shadow_close(&task);
    return result;
}

static double spread_of(int32_t sampler, int32_t rays) {
    return VSHI_BORROWED * vshi_rays_deviation(sampler, rays / 2, rays, 0.5);
}

int32_t vshi_shadow_most_rays(const vsh_shade_options *options) {
    const bool keeps_error =
        (vsh_method_traits(VSH_NAMES_SHADOW, options->method) & VSH_METHOD_KEEPS_ERROR) != 0;
    return vshi_shade_most_rays(options, spread_of, keeps_error);
}
