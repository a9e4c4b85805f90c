/* Ambient occlusion: checks, the methods of taps and cones, and the calls for points. */
#include "shade/ao.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "trace/trace.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    const vshi_vec invalid = {NAN, NAN, NAN};
    if (task->sphere) {
        frame->origin = vshi_to_field(task->field, task->points->positions + 3 * i);
        vshi_ao_axes((vshi_vec){0.0, 0.0, 1.0}, frame->axes);
        frame->grown = 0.0;
        vshi_ao_set(&task->values, i, NAN, NAN, invalid);
        stats->invalid += !vshi_finite(frame->origin);
        return vshi_finite(frame->origin);
    }
    vshi_vec normal;
    if (!vshi_shade_origin(task->field, task->points, i, vshi_shade_offset(task->field, &task->options),
                           &frame->origin, &normal)) {
        vshi_ao_set(&task->values, i, NAN, NAN, invalid);
        ++stats->invalid;
        return false;
    }
    vshi_ao_axes(normal, frame->axes);
    frame->grown = 0.0;
    return true;
}

/* --- taps */

/* Shades by five samples along the normal: how much nearer the surface is than an open plane (Quilez). Tuned
 * by eye; too dark in corners. */
static void shade_by_taps(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    /* Quilez's distances 0.01 … 0.13, scaled to the AO distance */
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
        task->values.ao[i] = (float)(open < 0.0 ? 0.0 : open);
    }
}

/* --- cones over the hemisphere, each an equal share of the cosine-weighted sky
 *
 * The visible share of a cone depends on how near the casters come to it, and on how free its neighbours are.
 * Its own closeness is not enough: casters thinner than the cone read as an edge through it, so closed rooms
 * with thin walls were half lit. Next to an edge some cones are free, but not in a room. The table holds mean
 * shares by analytic rays, on scenes of boxes, slats, spheres and rooms. bench/fit_ao.c computes and prints
 * it. */

/* Half angles, as a share of the half angles of equal solid angles. */
static const double WIDTH = 0.7;

/* Mean visible share of a cone: rows by its closeness over its sine, -1 … 1, columns by how free its
 * neighbours are, 0 … 1. Printed by bench/fit_ao.c. */
static const float TABLE[VSHI_AO_TABLE_EDGE][VSHI_AO_TABLE_EDGE] = {
    {0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f},
    {0.0000f, 0.1017f, 0.1017f, 0.1220f, 0.1526f, 0.1526f, 0.1614f, 0.2035f, 0.5186f},
    {0.0000f, 0.1080f, 0.1080f, 0.2362f, 0.2700f, 0.2700f, 0.2744f, 0.2744f, 0.5186f},
    {0.0000f, 0.1080f, 0.1080f, 0.2362f, 0.2784f, 0.2910f, 0.3476f, 0.3476f, 0.5633f},
    {0.0000f, 0.3478f, 0.3478f, 0.4453f, 0.5097f, 0.5174f, 0.5588f, 0.5801f, 0.7020f},
    {0.6620f, 0.6620f, 0.6685f, 0.6735f, 0.6735f, 0.7353f, 0.7353f, 0.7353f, 0.7907f},
    {0.7500f, 0.7500f, 0.7500f, 0.7696f, 0.7750f, 0.7750f, 0.7750f, 0.7750f, 0.8432f},
    {0.7500f, 0.7500f, 0.8035f, 0.8166f, 0.8271f, 0.8271f, 0.8387f, 0.8387f, 0.8562f},
    {1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f},
};

static void find_neighbours(vshi_ao_cones *cones) {
    const int32_t others = cones->count - 1;
    cones->neighbours = others < VSHI_AO_NEIGHBOURS ? others : VSHI_AO_NEIGHBOURS;
    for (int32_t i = 0; i < cones->count; ++i) {
        double cosines[VSHI_AO_NEIGHBOURS];
        int32_t found = 0;
        for (int32_t j = 0; j < cones->count; ++j) {
            const double cosine = vshi_dot(cones->directions[i], cones->directions[j]);
            if (j == i || (found == cones->neighbours && (found == 0 || cosine <= cosines[found - 1]))) {
                continue;
            }
            int32_t at = found < cones->neighbours ? found++ : found - 1;
            for (; at > 0 && cosines[at - 1] < cosine; --at) {
                cosines[at] = cosines[at - 1];
                cones->nearest[i][at] = cones->nearest[i][at - 1];
            }
            cosines[at] = cosine;
            cones->nearest[i][at] = (uint8_t)j;
        }
    }
}

static const double GOLDEN_ANGLE = 2.39996322972865332, WIDEST = 0.95;

/* Directions of equal weight: a golden-angle spiral over the disc, lifted to the hemisphere (Malley's
 * method), or over the sphere. No cone over the hemisphere dips below the receiver's plane, which hides only
 * directions that do not count. */
void vshi_ao_cones_place(vshi_ao_cones *cones, int32_t count, bool sphere) {
    cones->count = count;
    const double cosine = sphere ? fmax(0.0, 1.0 - 2.0 / count) : 1.0 - 1.0 / count;
    const double share = fmin(WIDTH * sqrt(1.0 - cosine * cosine), WIDEST);
    for (int32_t i = 0; i < count; ++i) {
        const double square = (i + 0.5) / count; /* of the disc's radius there */
        const double height = sphere ? 1.0 - (2.0 * i + 1.0) / count : sqrt(1.0 - square);
        const double radius = sqrt(sphere ? 1.0 - height * height : square);
        cones->directions[i] =
            (vshi_vec){radius * vshi_cos(i * GOLDEN_ANGLE), radius * vshi_sin(i * GOLDEN_ANGLE), height};
        cones->sines[i] = sphere || share < height ? share : height;
    }
    find_neighbours(cones);
}

void vshi_ao_cone_evidence(const vshi_ao_cones *cones, const float *close, int32_t c, double evidence[2]) {
    const double own = (double)close[c] / cones->sines[c];
    evidence[0] = own < -1.0 ? -1.0 : own > 1.0 ? 1.0 : own;
    double sum = 0.0;
    for (int32_t k = 0; k < cones->neighbours; ++k) {
        const int32_t n = cones->nearest[c][k];
        const double x = (double)close[n] / cones->sines[n];
        sum += x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
    }
    evidence[1] = cones->neighbours > 0 ? sum / cones->neighbours : fmax(evidence[0], 0.0);
}

int32_t vshi_ao_table_cell(const double evidence[2], double part[2]) {
    const int32_t last = VSHI_AO_TABLE_EDGE - 2;
    const double row = 0.5 * (evidence[0] + 1.0) * (last + 1), column = evidence[1] * (last + 1);
    const int32_t r = (int32_t)row < last ? (int32_t)row : last;
    const int32_t c = (int32_t)column < last ? (int32_t)column : last;
    part[0] = row - r;
    part[1] = column - c;
    return r * VSHI_AO_TABLE_EDGE + c;
}

/* Visible share of cone c of a point. Free and hidden cones do not depend on their neighbours. */
static double cone_share(const vshi_ao_cones *cones, const float *close, int32_t c) {
    const double closeness = (double)close[c], sine = (double)(float)cones->sines[c];
    if (closeness >= sine) {
        return 1.0;
    }
    if (!(closeness > -sine)) {
        return 0.0;
    }
    double evidence[2], part[2];
    vshi_ao_cone_evidence(cones, close, c, evidence);
    const float *t = &TABLE[0][0] + vshi_ao_table_cell(evidence, part);
    const float *u = t + VSHI_AO_TABLE_EDGE;
    const double near = (double)t[0] + ((double)t[1] - (double)t[0]) * part[1];
    const double far = (double)u[0] + ((double)u[1] - (double)u[0]) * part[1];
    return near + (far - near) * part[0];
}

/* The open share of the cones above a point's face, and the mean open direction, both along the frame's axes.
 */
static double open_share(const vshi_ao_cones *cones, const float *close, vshi_vec face, vshi_vec *where) {
    int32_t count = 0;
    double open = 0.0;
    vshi_vec sum = {0.0, 0.0, 0.0}, all = {0.0, 0.0, 0.0};
    for (int32_t c = 0; c < cones->count; ++c) {
        if (vshi_dot(cones->directions[c], face) < 0.0) {
            continue;
        }
        const double share = cone_share(cones, close, c);
        ++count;
        open += share;
        sum = vshi_add(sum, vshi_scale(cones->directions[c], share));
        all = vshi_add(all, cones->directions[c]);
    }
    *where = vshi_ao_mean(sum, all, open, count, (vshi_vec){0.0, 0.0, 1.0});
    return open / count;
}

static void flush(const vshi_ao_task *task, vshi_chunk *chunk, float *close, vsh_shade_stats *stats) {
    vshi_chunk_march(chunk, task->kernel, task->field, VSHI_MARCH_GROWN, task->options.max_steps, stats);
    for (size_t r = 0; r < chunk->count; ++r) {
        const float closeness = chunk->close[r], sine = chunk->sine[r];
        close[chunk->owner[r]] = closeness;
        stats->certified += closeness >= sine || closeness <= -sine;
    }
    chunk->count = 0;
}

static void shade_by_cones(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const vshi_ao_cones *cones = task->cones;
    const size_t count = (size_t)cones->count;
    vshi_chunk chunk;
    float close[VSHI_AO_GRAIN * VSHI_AO_MAX_CONES];
    bool valid[VSHI_AO_GRAIN];
    vshi_vec axes[VSHI_AO_GRAIN][3];
    chunk.count = 0;
    for (size_t i = begin; i < end; ++i) {
        vshi_ao_frame frame;
        valid[i - begin] = vshi_ao_frame_at(task, i, &frame, stats);
        if (!valid[i - begin]) {
            continue;
        }
        frame.grown = vshi_shade_grown(task->field, frame.origin);
        memcpy(axes[i - begin], frame.axes, sizeof frame.axes);
        ++stats->samples;
        if (chunk.count + count > VSHI_CHUNK) {
            flush(task, &chunk, close, stats);
        }
        for (size_t c = 0; c < count; ++c) {
            const vshi_cone cone = {
                .origin = frame.origin,
                .direction = vshi_ao_direction(frame.axes, cones->directions[c]),
                .end = task->distance,
                .sine = cones->sines[c],
                .close = cones->sines[c],
                .stop = -cones->sines[c],
                .wide = frame.grown,
            };
            const size_t owner = (i - begin) * count + c;
            if (!vshi_chunk_add(&chunk, task->field, &cone, (uint32_t)owner, stats)) {
                close[owner] = (float)cone.close;
                ++stats->certified;
            }
        }
    }
    flush(task, &chunk, close, stats);
    for (size_t i = begin; i < end; ++i) {
        if (!valid[i - begin]) {
            continue;
        }
        const vshi_vec *axis = axes[i - begin];
        vshi_vec where, face = {0.0, 0.0, 0.0}; /* every cone counts */
        if (task->faces != NULL) {
            const vshi_vec normal = vshi_unit(vshi_vec_off(task->points->normals + 3 * i));
            const vshi_vec f = vshi_direction_to_field(task->field, vshi_ao_face(task, i, normal));
            face = (vshi_vec){vshi_dot(f, axis[0]), vshi_dot(f, axis[1]), vshi_dot(f, axis[2])};
        }
        const float open = (float)open_share(cones, close + (i - begin) * count, face, &where);
        const vshi_vec d = vshi_direction_to_world(task->field, vshi_ao_direction(axis, where));
        vshi_ao_set(&task->values, i, open, NAN, vshi_scale(d, vshi_length(where)));
    }
}

/* --- all methods */

void vshi_ao_shade(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const int32_t method = task->options.ao_method;
    vshi_shade_fn *shade = method == VSH_AO_TAPS    ? shade_by_taps
                           : method == VSH_AO_CONES ? shade_by_cones
                                                    : vshi_ao_by_rays;
    for (size_t i = begin; task->values.deviation != NULL && i < end; ++i) {
        task->values.deviation[i] = NAN;
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
    task->isa = isa;
    task->outside = shading.outside;
    return result;
}

void vshi_ao_points(const vshi_ao_task *prepared, const vsh_points *points, const float *faces,
                    const vshi_ao_values *values, vsh_shade_stats *stats) {
    vshi_ao_task task = *prepared;
    task.points = points;
    task.faces = faces;
    task.values = *values;
    vshi_ao_shade(&task, 0, points->count, stats);
}

vsh_result vsh_shade_ao(const vsh_occluders *occluders, const vsh_points *points,
                        const vsh_shade_options *options, const vsh_run *run, float *ao, float *deviation,
                        float *bent, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(occluders, points);
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
    task.values = (vshi_ao_values){ao, deviation, bent};
    const size_t grain = task.options.ao_method == VSH_AO_TAPS ? VSHI_CHUNK : VSHI_AO_GRAIN;
    VSHI_TRY_DONE(vshi_shade_run(&full_run, "ao", points->count, grain, vshi_ao_shade, &task, stats, error));
    for (size_t i = 0; bent != NULL && i < points->count; ++i) {
        vshi_ao_bent(bent + 3 * i, points->normals + 3 * i);
    }
done:
    vshi_ao_close(&task);
    return result;
}
