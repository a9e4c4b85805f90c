/* Which texels are measured. Every voxel size has its own view of what is valid (not inside a solid nor
 * behind a wall); runs are compared on the texels that all of them find valid, and each on its own beside.
 */
#include "cli/casters.h"
#include "cli/message.h"
#include "cli/try.h"
#include "trade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Of the casters' longest side: clear of Embree's rounding (60 units of its floats' last place), and below
 * what shows: on a smooth mesh grazing light tells 1e-5 from this already. */
static const double TRUTH_LIFT = 0x1p-18;
/* A receiver's mesh that stands for a curved solid has its chords inside it. So often the solid's surface is
 * sought from there; a step halves what is left at the least where the mesh's normal is within 60° of the
 * solid's. */
enum { SURFACE_STEPS = 16 };

static int load_receivers(trade_work *work) {
    const size_t count = work->scene->receiver_count;
    work->receivers = calloc(count, sizeof *work->receivers);
    if (work->receivers == NULL) {
        return cli_out_of_memory("receivers");
    }
    for (size_t i = 0; i < count; ++i) {
        trade_receiver *receiver = &work->receivers[i];
        size_t mesh_count;
        const vsh_mesh *meshes = vsh_assets_receiver(work->assets, i, &mesh_count);
        vsh_error error;
        if (vsh_receiver_charts(work->scene, i, meshes, mesh_count, &work->run, &receiver->charts,
                                &error) != VSH_OK) {
            return cli_fail_of(NULL, &error);
        }
        ++work->receiver_count;
        if (vsh_charts_bounds(receiver->charts, &work->run, receiver->low, receiver->high, &error) !=
            VSH_OK) {
            return cli_fail_of(NULL, &error);
        }
        vsh_charts_get_info(receiver->charts, &receiver->info);
        receiver->path = work->scene->receivers[i].path;
        receiver->first = work->texels;
        work->texels += (size_t)receiver->info.width * (size_t)receiver->info.height;
        work->covered += receiver->info.covered;
        if (work->texels > UINT32_MAX) {
            cli_say("%s: more than %u texels in all receivers together", work->settings->bake.input,
                    UINT32_MAX);
            return CLI_LIMIT;
        }
    }
    return CLI_OK;
}

/* The casters as rays meet them. */
static int load_casters(trade_work *work) {
    work->meshes = vsh_triangles_available() != 0;
    for (size_t i = 0; i < work->scene->caster_count; ++i) {
        work->meshes = work->meshes && cli_caster_has_triangles(&work->scene->casters[i]);
    }
    const double start = trade_now(work);
    vsh_error error;
    const vsh_result result =
        vsh_scene_truth(work->scene, work->assets, &work->run, &work->triangles, &work->solids, &error);
    work->triangles_s = trade_now(work) - start;
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

int trade_load(trade_work *work) {
    vsh_error error;
    if (vsh_assets_load(work->scene, &work->run, &work->assets, &error) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    CLI_TRY(load_receivers(work));
    return load_casters(work);
}

/* Joins the masks of fields to common and any. */
static int join_masks(trade_work *work) {
    work->common = malloc(work->texels);
    work->any = calloc(work->texels, 1);
    if (work->common == NULL || work->any == NULL) {
        return cli_out_of_memory("coverage");
    }
    memset(work->common, 1, work->texels);
    for (size_t f = 0; f < work->field_count; ++f) {
        trade_field *field = &work->fields[f];
        for (size_t i = 0; i < work->texels; ++i) {
            field->valid += field->mask[i];
            work->common[i] &= field->mask[i];
            work->any[i] |= field->mask[i];
        }
    }
    for (size_t i = 0; i < work->texels; ++i) {
        work->common_count += work->common[i];
        work->points += work->any[i];
    }
    return work->common_count > 0 ? CLI_OK
                                  : cli_usage("%s: no texel is valid at all voxel sizes: nothing to measure",
                                              work->settings->bake.input);
}

int trade_take_masks(trade_work *work) {
    float *coverage = calloc(work->texels, sizeof *coverage);
    int code = CLI_OK;
    if (coverage == NULL) {
        code = cli_out_of_memory("coverage");
        goto done;
    }
    for (size_t f = 0; f < work->field_count; ++f) {
        trade_field *field = &work->fields[f];
        field->mask = calloc(work->texels, 1);
        CLI_TRY_DONE(field->mask == NULL ? cli_out_of_memory("coverage")
                                         : trade_bake(work, field->occluders, &work->scene->shade, NULL, NULL,
                                                      coverage, NULL));
        for (size_t i = 0; i < work->texels; ++i) {
            field->mask[i] = coverage[i] > 0.0f;
        }
    }
    code = join_masks(work);
done:
    free(coverage);
    return code;
}

/* Moves a point that is barely inside a solid, by less than a voxel, along its normal to just outside. */
static void raise(const trade_work *work, double *position, const float *normal, double lift, double voxel) {
    double moved[3] = {position[0], position[1], position[2]}, height = 0.0;
    for (int step = 0; step < SURFACE_STEPS && height < voxel; ++step) {
        const double lacking = lift - vsh_solids_distance(work->solids, moved);
        if (!(lacking > 0.5 * lift)) {
            memcpy(position, moved, sizeof moved);
            return;
        }
        height += lacking;
        for (int k = 0; k < 3; ++k) {
            moved[k] = position[k] + height * (double)normal[k];
        }
    }
}

/* Points of the receiver's texels that any field finds valid, from *at on. */
static void place_samples(trade_work *work, const trade_receiver *receiver, vsh_texel_samples samples,
                          double lift, double voxel, size_t *at) {
    for (size_t i = 0; i < samples.count; ++i) {
        const size_t texel = receiver->first + vsh_texel_place(samples.texels[i], receiver->info.width);
        if (!work->any[texel]) {
            continue;
        }
        const float *geometric = samples.geometric_normals + 3 * i;
        double *position = work->positions + 3 * *at;
        for (size_t k = 0; k < 3; ++k) {
            position[k] = samples.positions[3 * i + k] + lift * (double)geometric[k];
            work->normals[3 * *at + k] = samples.normals[3 * i + k];
        }
        if (work->solids != NULL) {
            raise(work, position, geometric, lift, voxel);
        }
        work->texel[(*at)++] = (uint32_t)texel;
    }
}

int trade_place_points(trade_work *work) {
    work->positions = calloc(work->points, 3 * sizeof *work->positions);
    work->normals = calloc(work->points, 3 * sizeof *work->normals);
    work->texel = calloc(work->points, sizeof *work->texel);
    if (work->positions == NULL || work->normals == NULL || work->texel == NULL) {
        return cli_out_of_memory("points");
    }
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(work->fields[0].occluders, &parts);
    vsh_field_info info;
    vsh_field_get_info(parts.field, &info);
    double side = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        side = fmax(side, info.bounds_max[axis] - info.bounds_min[axis]);
    }
    const double lift = TRUTH_LIFT * side;
    size_t at = 0;
    for (size_t r = 0; r < work->receiver_count; ++r) {
        vsh_texels *texels;
        vsh_error error;
        if (vsh_texels_create(work->receivers[r].charts, &work->run, &texels, &error) != VSH_OK) {
            return cli_fail_of(NULL, &error);
        }
        place_samples(work, &work->receivers[r], vsh_texels_samples(texels), lift, info.voxel_size, &at);
        vsh_texels_free(texels);
    }
    work->points = at;
    return CLI_OK;
}
