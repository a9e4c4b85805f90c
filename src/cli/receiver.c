#include "receiver.h"

#include "clock.h"
#include "message.h"
#include "planes.h"
#include "progress.h"
#include "signals.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static void warn_line(const vsh_run *run, const char *line) {
    run->warning(run->user, line);
}

static void warn_uvs(const vsh_run *run, const char *path, const vsh_mesh *mesh, const vsh_uv_report *uv) {
    const struct {
        size_t count;
        const char *what;
    } counted[] = {
        {uv->outside_triangles, "triangles leave the UV square; what lies outside is not baked"},
        {uv->degenerate_triangles, "triangles have no area in the UV set"},
    };
    const char *name = mesh->name != NULL ? mesh->name : "";
    char line[1024];
    if (uv->overlap_texels > 0) {
        snprintf(line, sizeof line, "%s: mesh '%s': %zu texels of %zu triangles lie over other charts", path,
                 name, uv->overlap_texels, uv->overlap_triangles);
        warn_line(run, line);
    }
    for (size_t i = 0; i < sizeof counted / sizeof counted[0]; ++i) {
        if (counted[i].count > 0) {
            snprintf(line, sizeof line, "%s: mesh '%s': %zu %s", path, name, counted[i].count,
                     counted[i].what);
            warn_line(run, line);
        }
    }
}

static vsh_image_options image_options(const vsh_receiver *receiver) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = receiver->bits;
    options.pack = receiver->pack;
    return options;
}

int cli_receiver_check(const vsh_scene *scene, size_t index) {
    const vsh_receiver *receiver = &scene->receivers[index];
    cli_planes planes;
    int code = cli_planes_name(&planes, scene, receiver->width, receiver->height);
    if (code == CLI_OK) {
        const vsh_image_options options = image_options(receiver);
        vsh_error error;
        if (vsh_image_check(receiver->output, &planes.image, &options, &error) != VSH_OK) {
            code = cli_fail(&error);
        }
    }
    cli_planes_free(&planes);
    return code;
}

int cli_receiver_texels(const cli_receiver_job *job, bool warn, vsh_texels **texels) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_receiver(job->assets, job->index, &count);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width;
    options.height = receiver->height;
    options.supersample = receiver->supersample;
    options.padding = receiver->padding;
    options.ao_spacing = receiver->ao_spacing;
    options.shade = job->scene->shade;
    vsh_uv_report *reports = calloc(count, sizeof *reports);
    if (reports == NULL) {
        cli_say("%s: the system refused memory", receiver->path);
        return CLI_LIMIT;
    }
    vsh_run run = *job->run;
    run.warning = NULL; /* its lines are told below, with the file, and not again for the second pass */
    vsh_error error;
    int code = CLI_OK;
    if (vsh_texels_create(meshes, count, &options, &run, reports, texels, &error) != VSH_OK) {
        code = cli_fail(&error);
    }
    for (size_t i = 0; i < count && warn && code == CLI_OK; ++i) {
        warn_uvs(job->run, receiver->path, &meshes[i], &reports[i]);
    }
    free(reports);
    return code;
}

static void warn_stats(const cli_receiver_job *job, const vsh_bake_stats *baked) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_receiver(job->assets, job->index, &count);
    char line[1024];
    for (size_t i = 0; i < count; ++i) {
        if (baked->invalid_by_mesh[i] > 0) {
            snprintf(line, sizeof line,
                     "%s: mesh '%s': %" PRIu64 " texels are invalid (inside a solid or seen from behind)",
                     receiver->path, meshes[i].name != NULL ? meshes[i].name : "", baked->invalid_by_mesh[i]);
            warn_line(job->run, line);
        }
    }
    if (baked->shade.unfinished > 0) {
        snprintf(line, sizeof line, "%s: %" PRIu64 " of %" PRIu64 " marches ran out of %d steps",
                 receiver->path, baked->shade.unfinished, baked->shade.marches, job->scene->shade.max_steps);
        warn_line(job->run, line);
    }
    if (baked->shade.beyond_reach > 0) {
        snprintf(line, sizeof line, "%s: %" PRIu64 " cones grew wider than the field's reach", receiver->path,
                 baked->shade.beyond_reach);
        warn_line(job->run, line);
    }
}

/* Values of valid texels, an error for each of which square_error holds: samples where supersampled. */
static void add_values(cli_stats *sum, const cli_receiver_job *job, const vsh_texels *texels,
                       const vsh_bake_stats *baked) {
    const vsh_scene *scene = job->scene;
    vsh_texels_info info;
    vsh_texels_get_info(texels, &info);
    const double valid =
        baked->texels > 0 ? (double)(baked->texels - baked->invalid_texels) / (double)baked->texels : 0.0;
    const bool lights = scene->shade.method >= VSH_SHADOW_ADAPTIVE;
    const bool ao = scene->ao && scene->shade.ao_method >= VSH_AO_ADAPTIVE;
    const double planes = (lights ? (double)scene->light_count : 0.0) + (ao ? 1.0 : 0.0);
    sum->estimated_values += valid * (double)info.samples * planes;
}

static void add_stats(cli_stats *sum, const vsh_bake_stats *baked) {
    sum->texels += baked->texels;
    sum->invalid_texels += baked->invalid_texels;
    sum->shade.marches += baked->shade.marches;
    sum->shade.samples += baked->shade.samples;
    sum->shade.skipped += baked->shade.skipped;
    sum->shade.certified += baked->shade.certified;
    sum->shade.unfinished += baked->shade.unfinished;
    sum->shade.invalid += baked->shade.invalid;
    sum->shade.beyond_reach += baked->shade.beyond_reach;
    sum->shade.rays += baked->shade.rays;
    sum->shade.refined += baked->shade.refined;
    sum->shade.square_error += baked->shade.square_error;
}

static int write_image(const cli_receiver_job *job, cli_planes *planes) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    if (cli_progress_report(NULL, "write", 0.0) != 0) {
        const vsh_error cancelled = {VSH_ERROR_CANCELLED, "write: cancelled"};
        return cli_fail(&cancelled);
    }
    const vsh_image_options options = image_options(receiver);
    cli_planes_split(planes);
    cli_signals_writing(receiver->output);
    vsh_error error;
    const vsh_result result = vsh_image_write(receiver->output, &planes->image, &options, &error);
    cli_signals_writing(NULL);
    return result == VSH_OK ? CLI_OK : cli_fail(&error);
}

int cli_receiver_bake(const cli_receiver_job *job, const vsh_field *field, const vsh_texels *texels,
                      cli_stats *stats) {
    const vsh_scene *scene = job->scene;
    const vsh_receiver *receiver = &scene->receivers[job->index];
    double now = cli_seconds();
    size_t mesh_count = 0;
    vsh_assets_receiver(job->assets, job->index, &mesh_count);
    vsh_bake_stats baked = vsh_bake_stats_zero();
    cli_planes planes;
    int code = cli_planes_name(&planes, scene, receiver->width, receiver->height);
    if (code == CLI_OK) {
        code = cli_planes_allocate(&planes, scene, job->run->memory_limit, receiver->output);
    }
    baked.invalid_by_mesh = calloc(mesh_count, sizeof *baked.invalid_by_mesh);
    if (code == CLI_OK && baked.invalid_by_mesh == NULL) {
        cli_say("%s: the system refused memory", receiver->path);
        code = CLI_LIMIT;
    }
    vsh_error error;
    if (code == CLI_OK && vsh_bake_lightmap(field, texels, scene->lights, scene->light_count, &scene->shade,
                                            job->run, &planes.lightmap, &baked, &error) != VSH_OK) {
        code = cli_fail(&error);
    }
    now = cli_stats_stage(stats, CLI_STAGE_BAKE, now);
    if (code == CLI_OK) {
        add_stats(stats, &baked);
        add_values(stats, job, texels, &baked);
        warn_stats(job, &baked);
        code = write_image(job, &planes);
        cli_stats_stage(stats, CLI_STAGE_WRITE, now);
    }
    free(baked.invalid_by_mesh);
    cli_planes_free(&planes);
    return code;
}
