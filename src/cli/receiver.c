#include "receiver.h"

#include "clipping.h"
#include "clock.h"
#include "closeness.h"
#include "invalid.h"
#include "message.h"
#include "overall.h"
#include "planes.h"
#include "progress.h"
#include "resume.h"
#include "signals.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { RESUME_BANDS = 16 }; /* a bake that is ended loses a sixteenth of a lightmap at most */

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
    if (uv->overlap_texels > uv->other_texels) {
        snprintf(line, sizeof line,
                 "%s: mesh '%s': %zu texels of %zu triangles lie over other charts of the same object", path,
                 name, uv->overlap_texels - uv->other_texels, uv->overlap_triangles);
        warn_line(run, line);
    }
    if (uv->other_texels > 0) {
        snprintf(line, sizeof line, "%s: mesh '%s': %zu texels lie over charts of other objects", path, name,
                 uv->other_texels);
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

static const char *object_name(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    return name != NULL ? name : "";
}

/* Objects that each fill a unit square of their own are not one lightmap, whatever its size. */
static int check_overlap(const cli_receiver_job *job, const vsh_uv_report *reports, uint64_t covered) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    const vsh_uv_report *worst = reports;
    uint64_t texels = 0;
    size_t count = 0;
    for (size_t i = 0; i < job->mesh_count; ++i) {
        texels += reports[i].other_texels;
        count += reports[i].other_texels > 0;
        worst = reports[i].other_texels > worst->other_texels ? &reports[i] : worst;
    }
    if (job->allow_overlap || receiver->allow_overlap ||
        (double)texels <= CLI_LARGEST_OVERLAP * (double)covered) {
        return CLI_OK;
    }
    return cli_usage(
        "%s: objects share texels of the lightmap: %zu of %zu meshes lie over others, on %" PRIu64
        " texels (%" PRIu64 " are covered at all); '%.100s' on %zu, %zu of them over '%.100s': "
        "give each object an image of its own (--per-object), choose some (--receive NAME), or "
        "unwrap them together into one atlas (in Blender: select all, edit mode, UV > Smart UV "
        "Project); --allow-overlap bakes it as it is",
        receiver->path, count, job->mesh_count, texels, covered, object_name(&job->meshes[worst - reports]),
        worst->other_texels, worst->other_mesh_texels, object_name(&job->meshes[worst->other_mesh]));
}

/* Charts that cover no texel's centre: why. */
static int refuse_empty(const cli_receiver_job *job, const vsh_uv_report *reports) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    size_t triangles = 0, outside = 0, flat = 0;
    for (size_t m = 0; m < job->mesh_count; ++m) {
        triangles += job->meshes[m].triangle_count;
        outside += reports[m].outside_triangles;
        flat += reports[m].degenerate_triangles;
    }
    return cli_usage(
        "%s: nothing to bake: the UVs of its %zu triangles cover none of %d × %d texels; %zu have no "
        "area in the UV set, %zu leave the unit square; %s",
        receiver->path, triangles, receiver->width, receiver->height, flat, outside,
        flat + outside > 0 ? "choose another set with --uv-set, or unwrap it anew"
                           : "raise --size, or unwrap it anew");
}

static vsh_image_options image_options(const vsh_receiver *receiver) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = receiver->bits;
    options.pack = receiver->pack;
    options.color_space = receiver->color_space;
    return options;
}

int cli_receiver_check(const vsh_scene *scene, size_t index, const char *file) {
    const vsh_receiver *receiver = &scene->receivers[index];
    cli_planes planes;
    int code = cli_planes_name(&planes, scene, receiver->width, receiver->height);
    if (code == CLI_OK) {
        const vsh_image_options options = image_options(receiver);
        vsh_error error;
        if (vsh_image_check(receiver->output, &planes.image, &options, &error) != VSH_OK) {
            code = file != NULL && error.code == VSH_ERROR_ARGUMENT
                       ? cli_usage("%s: receivers[%zu]: output %s", file, index, error.message)
                       : cli_fail(&error);
        }
    }
    cli_planes_free(&planes);
    return code;
}

int cli_receiver_charts(const cli_receiver_job *job, bool warn, vsh_charts **charts) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    const vsh_mesh *meshes = job->meshes;
    const size_t count = job->mesh_count;
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width;
    options.height = receiver->height;
    options.supersample = receiver->supersample;
    options.padding = receiver->padding;
    options.ao_spacing = job->scene->ao ? receiver->ao_spacing : 1;
    options.shade = job->scene->shade;
    options.tangents = job->scene->bent == 1 + VSH_BENT_TANGENT;
    vsh_uv_report *reports = calloc(count, sizeof *reports);
    if (reports == NULL) {
        cli_say("%s: the system refused memory", receiver->path);
        return CLI_LIMIT;
    }
    vsh_run run = *job->run;
    run.warning = NULL; /* its lines are told below, with the file, and not again for the second pass */
    vsh_error error;
    int code = CLI_OK;
    if (vsh_charts_create(meshes, count, &options, &run, reports, charts, &error) != VSH_OK) {
        code = cli_fail_of(receiver->path, &error);
    } else {
        vsh_charts_info info;
        vsh_charts_get_info(*charts, &info);
        code = info.covered == 0 ? refuse_empty(job, reports) : check_overlap(job, reports, info.covered);
    }
    for (size_t i = 0; i < count && warn && code == CLI_OK; ++i) {
        warn_uvs(job->run, receiver->path, &meshes[i], &reports[i]);
    }
    if (warn && code == CLI_OK) {
        cli_closeness_warn(job, reports);
    }
    free(reports);
    return code;
}

int cli_receiver_plan(const cli_receiver_job *job, const vsh_charts *charts, uint64_t held,
                      cli_bands *bands) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    cli_planes planes;
    int code = cli_planes_name(&planes, job->scene, receiver->width, receiver->height);
    if (code == CLI_OK) {
        const vsh_image_options options = image_options(receiver);
        cli_bands_need need = cli_bands_need_of(job->scene, &planes.image, receiver->output, &options);
        need.channels += (job->invalid_picture != NULL ? 4 : 0) + (job->scene->invalid ? 1 : 0);
        need.held = held;
        need.limit = job->run->memory_limit;
        need.rows = job->band_rows;
        code = cli_bands_plan(charts, &need, bands);
        const int32_t kept = (receiver->height + RESUME_BANDS - 1) / RESUME_BANDS;
        if (code == CLI_OK && job->resume && job->band_rows == 0 && bands->rows > kept) {
            need.rows = kept;
            code = cli_bands_plan(charts, &need, bands);
        }
    }
    cli_planes_free(&planes);
    return code;
}

int cli_receiver_texels(const vsh_charts *charts, int32_t first, int32_t rows, const vsh_run *run,
                        vsh_texels **texels) {
    vsh_error error;
    const vsh_result result = vsh_texels_create_band(charts, first, rows, run, texels, &error);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

/* Whether values are what cones read, and no rays refine them. */
static bool cones_decide(const vsh_scene *scene) {
    return (scene->light_count > 0 &&
            (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) == 0) ||
           (scene->ao && (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) == 0);
}

static void warn_stats(const cli_receiver_job *job, const vsh_bake_stats *baked) {
    const vsh_receiver *receiver = &job->scene->receivers[job->index];
    const bool marched = vsh_scene_marches(job->scene, NULL) != 0;
    char line[1024];
    cli_invalid_warn(job->run, receiver->path, job->meshes, job->mesh_count, baked, !marched);
    if (baked->shade.unfinished > 0) {
        snprintf(line, sizeof line, "%s: %" PRIu64 " of %" PRIu64 " marches ran out of %d steps",
                 receiver->path, baked->shade.unfinished, baked->shade.marches, job->scene->shade.max_steps);
        warn_line(job->run, line);
    }
    if (baked->shade.beyond_reach > 0 && cones_decide(job->scene)) {
        snprintf(line, sizeof line,
                 "%s: %" PRIu64 " of %" PRIu64
                 " cones grew wider than the field reaches: far shadows may be too "
                 "dark there; rays decide with --method exact (or adaptive) and --ao-method exact",
                 receiver->path, baked->shade.beyond_reach, baked->shade.marches);
        warn_line(job->run, line);
    }
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
    sum->shade.ao_square_error += baked->shade.ao_square_error;
    for (size_t i = 0; i <= sum->light_count; ++i) {
        sum->errors[i].values += baked->errors[i].values;
        sum->errors[i].square_error += baked->errors[i].square_error;
        sum->errors[i].held += baked->errors[i].held;
        sum->errors[i].held_square_error += baked->errors[i].held_square_error;
    }
}

/* A receiver under way. */
typedef struct receiver_work {
    const cli_receiver_job *job;
    const cli_receiver_input *input;
    cli_stats *stats;
    cli_planes planes;
    vsh_bake_stats baked; /* of all bands so far */
    uint64_t *invalid;    /* [mesh_count]: of one band */
    size_t mesh_count;
    cli_overall overall;      /* where there are several bands */
    vsh_image_writer *writer; /* NULL: no row has been written */
    cli_invalid picture;
    cli_resume resume;
} receiver_work;

static int bake_band(receiver_work *work, int32_t first, int32_t rows, const vsh_run *run) {
    const vsh_scene *scene = work->job->scene;
    vsh_texels *own = NULL;
    const vsh_texels *texels = work->input->texels;
    if (texels == NULL) {
        const int code = cli_receiver_texels(work->input->charts, first, rows, run, &own);
        if (code != CLI_OK) {
            return code;
        }
        texels = own;
    }
    vsh_bake_stats band = vsh_bake_stats_zero();
    band.invalid_by_mesh = work->invalid;
    band.shade = work->baked.shade;
    band.errors = work->baked.errors;
    vsh_error error;
    const vsh_result result =
        vsh_bake_lightmap(work->input->occluders, texels, scene->lights, scene->light_count, &scene->shade,
                          run, &work->planes.lightmap, &band, &error);
    vsh_texels_free(own);
    if (result != VSH_OK) {
        return cli_fail_of(scene->receivers[work->job->index].path, &error);
    }
    work->baked.texels += band.texels;
    work->baked.invalid_texels += band.invalid_texels;
    work->baked.seen_texels += band.seen_texels;
    work->baked.shade = band.shade;
    for (size_t m = 0; m < work->mesh_count; ++m) {
        work->baked.invalid_by_mesh[m] += band.invalid_by_mesh[m];
    }
    return CLI_OK;
}

/* The file stands beside its target from its first rows on. */
static int write_band(receiver_work *work, int32_t rows) {
    const vsh_receiver *receiver = &work->job->scene->receivers[work->job->index];
    const char *stage = work->input->bands.count > 1 ? "bake" : "write";
    if (cli_progress_report(NULL, stage, work->input->bands.count > 1 ? work->overall.before : 0.0) != 0) {
        const vsh_error cancelled = {VSH_ERROR_CANCELLED, "write: cancelled"};
        return cli_fail(&cancelled);
    }
    vsh_error error;
    vsh_result result = VSH_OK;
    if (work->writer == NULL) {
        vsh_image_options options = image_options(receiver);
        options.attributes = work->job->origin->attributes;
        options.attribute_count = work->job->origin->count;
        cli_signals_writing(receiver->output);
        result =
            vsh_image_writer_create(receiver->output, &work->planes.image, &options, &work->writer, &error);
    }
    if (result == VSH_OK) {
        result = vsh_image_writer_add(work->writer, rows, work->planes.image.planes, &error);
    }
    return result != VSH_OK
               ? cli_fail(&error)
               : cli_invalid_add(&work->picture, rows, work->planes.invalid, work->planes.lightmap.coverage);
}

/* A lightmap without one valid texel is no lightmap. */
static int check_valid(const receiver_work *work) {
    const vsh_bake_stats *baked = &work->baked;
    return baked->texels == 0 || baked->invalid_texels < baked->texels
               ? CLI_OK
               : cli_usage("%s: nothing to bake: all %" PRIu64
                           " texels are inside solids or behind walls; 'vdbshade info' tells what is taken "
                           "for solid; is it to receive at all, or does what surrounds it cast?",
                           work->job->scene->receivers[work->job->index].path, baked->texels);
}

static int finish_image(receiver_work *work, int code) {
    if (code != CLI_OK) {
        vsh_image_writer_abandon(work->writer);
    } else {
        code = cli_finish_image(work->writer, work->job->scene->receivers[work->job->index].output);
    }
    cli_signals_writing(NULL);
    return code;
}

static int bake_bands(receiver_work *work) {
    const cli_receiver_job *job = work->job;
    const cli_bands *bands = &work->input->bands;
    const int32_t height = job->scene->receivers[job->index].height;
    const bool several = bands->count > 1;
    if (several) { /* texels, validate, padding, and what is shaded */
        cli_overall_begin(&work->overall, job->run, "bake",
                          3 + (int)job->scene->light_count + (job->scene->ao ? 1 : 0));
    }
    int code = CLI_OK;
    for (int32_t first = 0; first < height && code == CLI_OK; first += bands->rows) {
        const int32_t left = height - first, rows = left < bands->rows ? left : bands->rows;
        double now = cli_seconds();
        const vsh_run run =
            several ? cli_overall_round(&work->overall, (double)rows / (double)height) : *job->run;
        if (cli_resume_take(&work->resume, first, rows, &work->planes, &work->baked, work->mesh_count)) {
            work->stats->resumed_rows += (uint64_t)rows;
        } else {
            code = bake_band(work, first, rows, &run);
            if (code == CLI_OK) {
                cli_planes_split(&work->planes);
                cli_resume_keep(&work->resume, first, rows, &work->planes, &work->baked, work->mesh_count);
            }
        }
        if (several) {
            cli_overall_next(&work->overall);
        }
        now = cli_stats_stage(work->stats, CLI_STAGE_BAKE, now);
        if (code == CLI_OK && left <= bands->rows) {
            code = check_valid(work);
        }
        if (code == CLI_OK && left <= bands->rows) {
            warn_stats(job, &work->baked);
        }
        code = code == CLI_OK ? write_band(work, rows) : code;
        cli_stats_stage(work->stats, CLI_STAGE_WRITE, now);
        if (left <= bands->rows) {
            break;
        }
    }
    return code;
}

int cli_receiver_bake(const cli_receiver_job *job, const cli_receiver_input *input, cli_stats *stats) {
    const vsh_scene *scene = job->scene;
    const vsh_receiver *receiver = &scene->receivers[job->index];
    receiver_work work = {.job = job,
                          .input = input,
                          .stats = stats,
                          .baked = vsh_bake_stats_zero(),
                          .mesh_count = job->mesh_count};
    int code = cli_planes_name(&work.planes, scene, receiver->width, receiver->height);
    if (code == CLI_OK) {
        code = cli_planes_allocate(&work.planes, scene, input->bands.rows,
                                   job->invalid_picture != NULL || scene->invalid, job->run->memory_limit,
                                   receiver->output);
    }
    if (code == CLI_OK) {
        code =
            cli_invalid_open(&work.picture, job->invalid_picture, receiver->output, scene->receiver_count > 1,
                             receiver->width, receiver->height, input->bands.rows);
    }
    work.invalid = calloc(work.mesh_count, sizeof *work.invalid);
    work.baked.invalid_by_mesh = calloc(work.mesh_count, sizeof *work.baked.invalid_by_mesh);
    work.baked.errors = calloc(scene->light_count + 1, sizeof *work.baked.errors);
    if (code == CLI_OK &&
        (work.invalid == NULL || work.baked.invalid_by_mesh == NULL || work.baked.errors == NULL)) {
        cli_say("%s: the system refused memory", receiver->path);
        code = CLI_LIMIT;
    }
    if (code == CLI_OK && job->resume) {
        code = cli_resume_open(&work.resume, receiver->output, job->origin, &work.planes.image,
                               input->bands.rows, scene->light_count + 1);
    }
    if (code == CLI_OK) {
        code = bake_bands(&work);
        const double now = cli_seconds();
        code = finish_image(&work, code);
        cli_stats_stage(stats, CLI_STAGE_WRITE, now);
    }
    code = cli_invalid_close(&work.picture, code);
    cli_resume_close(&work.resume, receiver->output, receiver->height, code);
    if (code == CLI_OK) {
        add_stats(stats, &work.baked);
        stats->bands += (uint64_t)input->bands.count;
    }
    free(work.baked.errors);
    free(work.baked.invalid_by_mesh);
    free(work.invalid);
    cli_planes_free(&work.planes);
    return code;
}
