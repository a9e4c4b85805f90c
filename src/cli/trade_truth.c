/* What a scene's values are: rays against its triangles, or rays against a field finer than all that are
 * measured. And Embree's own curve, which every method has to beat. */
#include "message.h"
#include "progress.h"
#include "trade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of the casters' diagonal: clear of Embree's rounding, and below what any voxel shows. */
static const double TRUTH_LIFT = 1e-5;

/* Whether something stands within a voxel above a point: a gap that voxels close, or the inside of a part
 * that is thinner than one. What lies there is hidden, and no bake of these voxels says anything of it. */
static int hidden(const trade_work *work, const double *position, const float *normal, double voxel,
                  bool *is_hidden) {
    *is_hidden = false;
    if (work->triangles == NULL) {
        return CLI_OK;
    }
    vsh_light above = vsh_light_default();
    above.type = VSH_LIGHT_SPHERE;
    for (int k = 0; k < 3; ++k) {
        above.position[k] = position[k] + voxel * (double)normal[k];
    }
    float seen = 0.0f;
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_error error;
    if (vsh_trace_shadow(work->triangles, 1, position, NULL, 0.0, &above, 1, &run, &seen, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    *is_hidden = !(seen > 0.0f);
    return CLI_OK;
}

/* Share of a finest voxel within which another surface makes the truth a matter of rounding: texel centres on
 * an edge where two solids meet. */
static const double CONTACT = 0.05;

/* Takes such texels out of the mask. `normals` are geometric. */
static int drop_contacts(trade_work *work, const float *geometric, double voxel) {
    if (work->triangles == NULL) {
        return CLI_OK;
    }
    float *open = calloc(work->valid + 1, sizeof *open);
    if (open == NULL) {
        return trade_out_of_memory("contacts");
    }
    vsh_error error;
    if (vsh_trace_ao(work->triangles, work->valid, work->positions, geometric, 0.0, CONTACT * voxel, 32,
                     &work->run, open, &error) != VSH_OK) {
        free(open);
        return cli_fail(&error);
    }
    size_t left = 0;
    for (size_t i = 0; i < work->valid; ++i) {
        if (open[i] < 1.0f) {
            work->mask[work->texel[i]] = 0.0f;
            continue;
        }
        memcpy(work->positions + 3 * left, work->positions + 3 * i, 3 * sizeof *work->positions);
        memcpy(work->normals + 3 * left, work->normals + 3 * i, 3 * sizeof *work->normals);
        work->texel[left++] = work->texel[i];
    }
    work->valid = left;
    free(open);
    return CLI_OK;
}

int trade_take_mask(trade_work *work, const vsh_field *field) {
    work->mask = calloc(trade_texels(work), sizeof *work->mask);
    if (work->mask == NULL) {
        return trade_out_of_memory("coverage");
    }
    const vsh_lightmap lightmap = {.coverage = work->mask};
    vsh_error error;
    if (vsh_bake_lightmap(field, work->texels, NULL, 0, &work->scene->shade, &work->run, &lightmap, NULL,
                          &error) != VSH_OK) {
        return cli_fail(&error);
    }
    const vsh_texel_samples samples = vsh_texels_samples(work->texels);
    work->positions = calloc(samples.count + 1, 3 * sizeof *work->positions);
    work->normals = calloc(samples.count + 1, 3 * sizeof *work->normals);
    work->texel = calloc(samples.count + 1, sizeof *work->texel);
    float *geometrics = calloc(samples.count + 1, 3 * sizeof *geometrics);
    if (work->positions == NULL || work->normals == NULL || work->texel == NULL || geometrics == NULL) {
        free(geometrics);
        return trade_out_of_memory("samples");
    }
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    double square = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        square += pow(info.bounds_max[axis] - info.bounds_min[axis], 2.0);
    }
    const double lift = TRUTH_LIFT * sqrt(square);
    for (size_t i = 0; i < samples.count; ++i) {
        if (!(work->mask[samples.texel[i]] > 0.0f)) {
            continue;
        }
        const float *geometric = samples.geometric_normals + 3 * i;
        double *position = work->positions + 3 * work->valid;
        for (size_t k = 0; k < 3; ++k) {
            position[k] = samples.positions[3 * i + k] + lift * (double)geometric[k];
            work->normals[3 * work->valid + k] = samples.normals[3 * i + k];
        }
        bool is_hidden;
        const int code = hidden(work, position, geometric, info.voxel_size, &is_hidden);
        if (code != CLI_OK) {
            free(geometrics);
            return code;
        }
        if (is_hidden) {
            work->mask[samples.texel[i]] = 0.0f;
            continue;
        }
        memcpy(geometrics + 3 * work->valid, geometric, 3 * sizeof *geometric);
        work->texel[work->valid++] = samples.texel[i];
    }
    const int code = drop_contacts(work, geometrics, info.voxel_size);
    free(geometrics);
    if (code != CLI_OK) {
        return code;
    }
    if (work->valid == 0) {
        return cli_usage("%s: no texel is valid: nothing to measure", work->settings->bake.input);
    }
    return CLI_OK;
}

/* Traces the subject's planes into `values`; `seconds` is without the scattering. */
static int trace(const trade_work *work, const trade_subject *subject, int32_t rays, float *values,
                 double *seconds) {
    float *packed = calloc(work->valid, sizeof *packed);
    if (packed == NULL) {
        return trade_out_of_memory("rays");
    }
    int code = CLI_OK;
    *seconds = 0.0;
    for (size_t plane = 0; plane < subject->planes && code == CLI_OK; ++plane) {
        const double start = trade_now(work);
        vsh_error error;
        const vsh_result result =
            subject->ao ? vsh_trace_ao(work->triangles, work->valid, work->positions, work->normals, 0.0,
                                       work->scene->shade.ao_distance, rays, &work->run, packed, &error)
                        : vsh_trace_shadow(work->triangles, work->valid, work->positions, work->normals, 0.0,
                                           &work->scene->lights[plane], rays, &work->run, packed, &error);
        *seconds += trade_now(work) - start;
        if (result != VSH_OK) {
            code = cli_fail(&error);
        }
        for (size_t i = 0; i < work->valid && code == CLI_OK; ++i) {
            values[plane * trade_texels(work) + work->texel[i]] = packed[i];
        }
    }
    free(packed);
    return code;
}

/* Of a scene without triangles: rays against a field of twice the finest resolution. */
static int march(trade_work *work, int32_t resolution) {
    vsh_field *field = NULL;
    double seconds;
    int code = trade_make_field(work, resolution, &field, &seconds);
    vsh_shade_options shade = work->scene->shade;
    shade.method = VSH_SHADOW_RAYS;
    shade.ao_method = VSH_AO_RAYS;
    shade.rays = work->settings->truth_rays < 4096 ? work->settings->truth_rays : 4096;
    shade.early_rays = 0;
    const size_t lights = work->scene->light_count;
    float **planes = calloc(lights + 1, sizeof *planes);
    if (code == CLI_OK && planes == NULL) {
        code = trade_out_of_memory("truth");
    }
    if (code == CLI_OK) {
        vsh_lightmap lightmap = {0};
        for (size_t s = 0; s < work->subject_count; ++s) {
            trade_subject *subject = &work->subjects[s];
            if (subject->ao) {
                lightmap.ao = subject->truth;
                continue;
            }
            for (size_t i = 0; i < lights; ++i) {
                planes[i] = subject->truth + i * trade_texels(work);
            }
            lightmap.shadow = planes;
        }
        vsh_error error;
        if (vsh_bake_lightmap(field, work->texels, work->scene->lights, lights, &shade, &work->run, &lightmap,
                              NULL, &error) != VSH_OK) {
            code = cli_fail(&error);
        }
    }
    snprintf(work->truth_text, sizeof work->truth_text,
             "%d rays a texel against a field of %d voxels along the longest side, as not every caster is a "
             "mesh or this build has no Embree",
             shade.rays, resolution);
    free(planes);
    vsh_field_free(field);
    return code;
}

int trade_take_truth(trade_work *work, int32_t finest) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        subject->truth = calloc(subject->planes * trade_texels(work), sizeof *subject->truth);
        if (subject->truth == NULL) {
            return trade_out_of_memory("truth");
        }
    }
    if (work->triangles == NULL) {
        return march(work, finest <= 32768 ? 2 * finest : finest);
    }
    snprintf(work->truth_text, sizeof work->truth_text, "%d Embree rays a texel against the triangles",
             work->settings->truth_rays);
    int code = CLI_OK;
    for (size_t s = 0; s < work->subject_count && code == CLI_OK; ++s) {
        double seconds;
        code = trace(work, &work->subjects[s], work->settings->truth_rays, work->subjects[s].truth, &seconds);
    }
    return code;
}

int trade_measure_embree(trade_work *work) {
    int code = CLI_OK;
    for (size_t s = 0; s < work->subject_count && work->triangles != NULL; ++s) {
        trade_subject *subject = &work->subjects[s];
        for (int32_t rays = 1; rays <= 256 && 2 * rays <= work->settings->truth_rays; rays *= 2) {
            float *values = calloc(subject->planes * trade_texels(work), sizeof *values);
            if (values == NULL) {
                return trade_out_of_memory("values");
            }
            trade_run run = {.method = "embree",
                             .embree = true,
                             .build_s = work->triangles_s,
                             .bytes = vsh_triangles_bytes(work->triangles),
                             .certified = NAN,
                             .values = values};
            snprintf(run.options, sizeof run.options, "%d ray%s a texel", rays, rays == 1 ? "" : "s");
            code = trace(work, subject, rays, values, &run.bake_s);
            if (code == CLI_OK) {
                code = trade_compare(work, subject, values, &run.metrics);
            }
            if (code != CLI_OK || trade_add(work, subject, &run) == NULL) {
                free(values);
                return code != CLI_OK ? code : trade_out_of_memory("runs");
            }
        }
    }
    return code;
}
