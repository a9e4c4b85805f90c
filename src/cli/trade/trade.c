/* vdbshade trade: error against time of every method, on the user's own scene.
 *
 * Bakes the scene in many ways, and measures time and error of each. Every voxel size finds other texels
 * valid (neither inside a solid nor behind a wall). Runs are compared over the texels that all sizes find
 * valid, and each run over its own valid texels too. */
#include "trade.h"
#include "base/clock.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* --- options */

enum { LEAST_RESOLUTION = 2, MOST_RESOLUTION = 65536, MOST_TEXELS = 4096 };

enum { KEY_RECEIVER = 0x2000, KEY_SIZE, KEY_RESOLUTIONS, KEY_TRUTH_RAYS };

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(trade_settings, page), "output", "OUT.html", "page to write: plots and tables in one file"},
    {CLI_TEXT(trade_settings, csv), "csv", "FILE.csv", "write the table of all runs as CSV too"},
    {0, NULL, NULL, "What is measured"},
    {KEY_RECEIVER, "receiver", "N", "one receiver of the scene only, from 0 (all)"},
    {KEY_SIZE, "size", "W[xH]", "texels of each lightmap, 1 to 4096 (256)"},
    {KEY_RESOLUTIONS, "resolutions", "N,N,...",
     "voxels along the longest side, up to 16 of them\n(64,128,256)"},
    {KEY_TRUTH_RAYS, "truth-rays", "N", "rays a texel of the truth, 16 to 65536 (1024)"},
    {CLI_POSITIVE(trade_settings, budget), "budget", "SECONDS",
     "time for the runs after the truth is known; runs that\ndo not fit are left out and counted (120)"},
    {0, NULL, NULL, "Light and occlusion, where INPUT is a mesh (--lights also of a scene)"},
    CLI_LIGHTS,
    CLI_SETTING("ao"),
    CLI_SETTING("uv-set"),
    CLI_FLOOR_OPTION,
    CLI_COMMON_OPTIONS,
};

static int parse_resolutions(trade_settings *s, const char *name, const char *value) {
    s->resolution_count = 0;
    for (const char *at = value; s->resolution_count < TRADE_MAX_RESOLUTIONS; ++at) {
        char *end = NULL;
        const long number = *at >= '0' && *at <= '9' ? strtol(at, &end, 10) : 0;
        if (number < LEAST_RESOLUTION || number > MOST_RESOLUTION || (*end != ',' && *end != '\0')) {
            break;
        }
        size_t place = s->resolution_count++;
        for (; place > 0 && s->resolutions[place - 1] < number; --place) {
            s->resolutions[place] = s->resolutions[place - 1];
        }
        s->resolutions[place] = (int32_t)number;
        at = end;
        if (*at == '\0') {
            return CLI_OK;
        }
    }
    return cli_usage("%s '%s': expected up to %d whole numbers from %d to %d, with commas between them", name,
                     value, TRADE_MAX_RESOLUTIONS, LEAST_RESOLUTION, MOST_RESOLUTION);
}

static int parse_size(trade_settings *s, const char *name, const char *value) {
    int32_t width, height;
    CLI_TRY(cli_parse_size(name, value, &width, &height));
    if (width > MOST_TEXELS || height > MOST_TEXELS) {
        return cli_usage("%s '%s': expected at most %d texels", name, value, MOST_TEXELS);
    }
    return cli_patch_set(&s->bake.patch, name, value);
}

static int parse_option(void *settings, int key, const char *name, const char *value) {
    trade_settings *s = settings;
    switch (key) {
    case KEY_RECEIVER:
        return cli_parse_integer(name, value, 0, INT32_MAX, &s->receiver);
    case KEY_SIZE:
        return parse_size(s, name, value);
    case KEY_RESOLUTIONS:
        return parse_resolutions(s, name, value);
    case KEY_TRUTH_RAYS:
        return cli_parse_integer(name, value, 16, 65536, &s->truth_rays);
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
}

/* --- the scene */

/* The truth's rays begin above the texel by this part of the casters' longest side: clear of Embree's
 * rounding (60 ulp of its floats). On a smooth mesh, grazing light shows a difference from 1e-5 on. */
static const double TRUTH_LIFT = 0x1p-18;

/* A mesh that approximates a curved solid has chords inside of it: so many steps lift a point out. A step at
 * least halves the distance if the normals of mesh and solid differ by less than 60°. */
enum { SURFACE_STEPS = 16 };

/* A short run is repeated, and the median of its times counts. */
enum { REPEATS = 3 };
static const double SHORT_SECONDS = 0.3;

/* Embree's curve ends at so many rays, or at half of the truth's. */
enum { CURVE_RAYS = 256 };

/* Seconds for differences. One thread's is processor time, which ignores other work on the machine. */
static double read_clock(const trade_work *work) {
    if (work->run.threads != 1) {
        return vshi_seconds();
    }
    struct timespec now = {0, 0};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int load_receiver(trade_work *work, size_t index) {
    trade_receiver *receiver = &work->receivers[index];
    size_t mesh_count;
    const vsh_mesh *meshes = vsh_assets_receiver(work->assets, index, &mesh_count);
    vsh_error error;
    CLI_TRY(cli_check_result(
        vsh_receiver_charts(work->scene, index, meshes, mesh_count, &work->run, &receiver->charts, &error),
        &error));
    ++work->receiver_count;
    vsh_charts_get_info(receiver->charts, &receiver->info);
    for (int k = 0; k < 3 && receiver->info.samples > 0; ++k) {
        work->low[k] = fmin(work->low[k], receiver->info.bounds_min[k]);
        work->high[k] = fmax(work->high[k], receiver->info.bounds_max[k]);
    }
    receiver->first = work->texels;
    work->texels += (size_t)receiver->info.width * (size_t)receiver->info.height;
    work->covered += receiver->info.covered;
    work->samples += (double)receiver->info.samples;
    if (work->texels > UINT32_MAX) {
        cli_say("%s: more than %u texels in all receivers together", work->settings->bake.input, UINT32_MAX);
        return CLI_LIMIT;
    }
    return CLI_OK;
}

static int load(trade_work *work) {
    const vsh_scene *scene = work->scene;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_assets_load(scene, &work->run, &work->assets, &error), &error));
    work->receivers = calloc(scene->receiver_count, sizeof *work->receivers);
    for (int k = 0; k < 3; ++k) {
        work->low[k] = INFINITY;
        work->high[k] = -INFINITY;
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        CLI_TRY(load_receiver(work, i));
    }
    work->meshes = true;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const int32_t type = scene->casters[i].type;
        work->meshes = work->meshes && (type == VSH_CASTER_MESH || type == VSH_CASTER_HEIGHTFIELD);
    }
    const double start = read_clock(work);
    const vsh_result result =
        vsh_scene_truth(scene, work->assets, &work->run, &work->triangles, &work->solids, &error);
    work->triangles_s = read_clock(work) - start;
    return cli_check_result(result, &error);
}

static void allocate(trade_work *work) {
    const size_t lights = work->scene->light_count;
    if (lights > 0) {
        work->subjects[work->subject_count++] = (trade_subject){.planes = lights};
    }
    if (work->scene->ao) {
        work->subjects[work->subject_count++] = (trade_subject){.ao = true, .planes = 1};
    }
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        subject->truth = calloc(subject->planes * work->texels, sizeof *subject->truth);
    }
    work->values = calloc((lights + 1) * work->texels, sizeof *work->values);
    work->planes = calloc(lights + 1, sizeof *work->planes);
    work->compared = calloc((lights + 1) * work->receiver_count, sizeof *work->compared);
    work->any = calloc(work->texels, 1);
    work->common = malloc(work->texels);
    memset(work->common, 1, work->texels);
}

/* --- baking */

/* Makes the scene's casters: `voxels` alone, or what auto chooses with triangles. */
static int make_occluders(const trade_work *work, const vsh_scene *scene, bool voxels,
                          vsh_occluders **occluders, double *seconds) {
    const double start = read_clock(work);
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.receivers_min = work->low;
    what.receivers_max = work->high;
    what.points = work->samples;
    what.voxels = voxels;
    what.triangles = !voxels;
    vsh_error error;
    const vsh_result result = vsh_scene_occluders(scene, work->assets, &what, &work->run, occluders, &error);
    *seconds = read_clock(work) - start;
    return cli_check_result(result, &error);
}

/* Bakes the subject, or (NULL) coverage, of all receivers into `values`. */
static int bake(const trade_work *work, const trade_subject *subject, const vsh_occluders *occluders,
                const vsh_shade_options *shade, float *values) {
    const size_t lights = subject != NULL && !subject->ao ? subject->planes : 0;
    vsh_bake_stats baked = vsh_bake_stats_zero();
    vsh_result result = VSH_OK;
    vsh_error error;
    for (size_t r = 0; r < work->receiver_count && result == VSH_OK; ++r) {
        float *first = values + work->receivers[r].first;
        for (size_t i = 0; i < lights; ++i) {
            work->planes[i] = first + i * work->texels;
        }
        const vsh_lightmap lightmap = {.shadow = lights > 0 ? work->planes : NULL,
                                       .ao = subject != NULL && subject->ao ? first : NULL,
                                       .coverage = subject == NULL ? first : NULL};
        result = vsh_bake_lightmap(occluders, work->receivers[r].charts, work->scene->lights, lights, shade,
                                   &work->run, &lightmap, &baked, &error);
    }
    return cli_check_result(result, &error);
}

/* Finds the texels that are valid with the field's casters. */
static int find_valid(const trade_work *work, const vsh_shade_options *shade, trade_field *field) {
    field->mask = malloc(work->texels);
    CLI_TRY(bake(work, NULL, field->voxels != NULL ? field->voxels : field->traced, shade, work->values));
    for (size_t i = 0; i < work->texels; ++i) {
        field->mask[i] = work->values[i] > 0.0f;
        field->valid += field->mask[i];
    }
    return CLI_OK;
}

static int make_field(trade_work *work, trade_field *field) {
    vsh_scene scene = *work->scene;
    scene.grid.resolution = field->resolution;
    scene.grid.voxel_size = 0.0;
    CLI_TRY(make_occluders(work, &scene, true, &field->voxels, &field->build_s));
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(field->voxels, &parts);
    parts.triangles = work->meshes ? work->triangles : NULL;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_occluders_from_parts(&parts, &field->traced, &error), &error));
    CLI_TRY(find_valid(work, &work->scene->shade, field));
    for (size_t i = 0; i < work->texels; ++i) {
        work->common[i] &= field->mask[i];
        work->any[i] |= field->mask[i];
    }
    return CLI_OK;
}

static void free_field(trade_field *field) {
    free(field->mask);
    vsh_occluders_free(field->traced); /* refers to the next */
    vsh_occluders_free(field->voxels);
}

static int make_fields(trade_work *work) {
    while (work->field_count < work->settings->resolution_count) {
        trade_field *field = &work->fields[work->field_count];
        field->resolution = work->settings->resolutions[work->field_count++];
        CLI_TRY(make_field(work, field));
    }
    for (size_t i = 0; i < work->texels; ++i) {
        work->common_count += work->common[i];
        work->points += work->any[i];
    }
    return work->common_count > 0 ? CLI_OK
                                  : cli_usage("%s: no texel is valid at all voxel sizes: nothing to measure",
                                              work->settings->bake.input);
}

/* --- the truth: rays against the casters themselves */

/* Moves a point that is inside a solid, by less than a voxel, along its normal to just outside. */
static void leave_solid(const trade_work *work, double *position, const float *normal, double lift,
                        double voxel) {
    double moved[3] = {position[0], position[1], position[2]}, height = 0.0;
    for (int step = 0; step < SURFACE_STEPS && height < voxel; ++step) {
        const double missing = lift - vsh_solids_distance(work->solids, moved);
        if (!(missing > 0.5 * lift)) {
            memcpy(position, moved, sizeof moved);
            return;
        }
        height += missing;
        for (int k = 0; k < 3; ++k) {
            moved[k] = position[k] + height * (double)normal[k];
        }
    }
}

/* Adds points for the receiver's texels in `any`, from index *at on. */
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
            leave_solid(work, position, geometric, lift, voxel);
        }
        work->texel[(*at)++] = (uint32_t)texel;
    }
}

static int place_points(trade_work *work) {
    work->positions = calloc(work->points, 3 * sizeof *work->positions);
    work->normals = calloc(work->points, 3 * sizeof *work->normals);
    work->texel = calloc(work->points, sizeof *work->texel);
    work->traced = calloc(work->points, sizeof *work->traced);
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(work->fields[0].voxels, &parts);
    vsh_field_info info;
    vsh_field_get_info(parts.field, &info);
    double side = 0.0;
    for (int k = 0; k < 3; ++k) {
        side = fmax(side, info.bounds_max[k] - info.bounds_min[k]);
    }
    size_t at = 0;
    for (size_t r = 0; r < work->receiver_count; ++r) {
        vsh_texels *texels;
        vsh_error error;
        CLI_TRY(cli_check_result(vsh_texels_create(work->receivers[r].charts, &work->run, &texels, &error),
                                 &error));
        place_samples(work, &work->receivers[r], vsh_texels_samples(texels), TRUTH_LIFT * side,
                      info.voxel_size, &at);
        vsh_texels_free(texels);
    }
    work->points = at;
    return CLI_OK;
}

/* Traces rays from the points into the subject's planes; *seconds is the time of the tracing alone. */
static int trace(const trade_work *work, const trade_subject *subject, int32_t rays, float *values,
                 double *seconds) {
    *seconds = 0.0;
    vsh_result result = VSH_OK;
    vsh_error error;
    for (size_t plane = 0; plane < subject->planes && result == VSH_OK; ++plane) {
        const double start = read_clock(work);
        result = subject->ao ? vsh_trace_ao(work->triangles, work->solids, work->points, work->positions,
                                            work->normals, 0.0, work->scene->shade.ao_distance, rays,
                                            &work->run, work->traced, &error)
                             : vsh_trace_shadow(work->triangles, work->solids, work->points, work->positions,
                                                work->normals, 0.0, &work->scene->lights[plane], rays,
                                                &work->run, work->traced, &error);
        *seconds += read_clock(work) - start;
        for (size_t i = 0; i < work->points; ++i) {
            values[plane * work->texels + work->texel[i]] = work->traced[i];
        }
    }
    return cli_check_result(result, &error);
}

static int make_truth(trade_work *work) {
    const double start = read_clock(work);
    for (size_t s = 0; s < work->subject_count; ++s) {
        double seconds;
        CLI_TRY(
            trace(work, &work->subjects[s], work->settings->truth_rays, work->subjects[s].truth, &seconds));
    }
    work->truth_s = read_clock(work) - start;
    return CLI_OK;
}

/* --- one run */

/* Compares work->values with the truth where the mask is 1. A receiver's lightmap is a plane of its own, so
 * that no penumbra continues in the next. */
static int compare(const trade_work *work, const trade_subject *subject, const uint8_t *mask,
                   vsh_accuracy *accuracy) {
    const size_t count = subject->planes * work->receiver_count;
    for (size_t i = 0; i < count; ++i) {
        const trade_receiver *receiver = &work->receivers[i % work->receiver_count];
        const size_t first = i / work->receiver_count * work->texels + receiver->first;
        work->compared[i] = (vsh_compared){{receiver->info.width, receiver->info.height, 1},
                                           subject->truth + first,
                                           work->values + first,
                                           mask + receiver->first};
    }
    vsh_error error;
    return cli_check_result(vsh_compare_accuracy(work->compared, count, &work->run, accuracy, &error),
                            &error);
}

static int compare_times(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Bakes work->values, or makes them by Embree's rays alone (field NULL), and sets the run's time. */
static int time_run(const trade_work *work, const trade_subject *subject, const trade_field *field,
                    const vsh_shade_options *shade, trade_run *run) {
    double times[REPEATS];
    size_t count = 0;
    do {
        const double start = read_clock(work);
        if (field == NULL) {
            CLI_TRY(trace(work, subject, shade->rays, work->values, &times[count]));
        } else {
            CLI_TRY(bake(work, subject, field->traced, shade, work->values));
            times[count] = read_clock(work) - start;
        }
    } while (++count < REPEATS && times[0] < SHORT_SECONDS);
    qsort(times, count, sizeof times[0], compare_times);
    run->bake_s = times[count / 2];
    run->rate = 1e6 * run->bake_s / (double)(subject->planes * run->valid);
    return CLI_OK;
}

/* Measures a run that is filled in but for its results, and adds it to its subject. */
static int measure_run(const trade_work *work, trade_subject *subject, const trade_field *field,
                       const vsh_shade_options *shade, trade_run *run) {
    vsh_accuracy valid;
    CLI_TRY(time_run(work, subject, field, shade, run));
    CLI_TRY(compare(work, subject, field != NULL ? field->mask : work->any, &valid));
    CLI_TRY(compare(work, subject, work->common, &run->metrics));
    run->valid_rmse = valid.rmse;
    subject->runs = realloc(subject->runs, (subject->run_count + 1) * sizeof *run);
    subject->runs[subject->run_count++] = *run;
    if (!cli_given.quiet) {
        char line[256];
        snprintf(line, sizeof line, "%s%s: RMSE %.4f, %.3f s", run->embree ? "Embree, " : "", run->options,
                 run->metrics.rmse, run->bake_s);
        cli_progress_line(line);
    }
    return CLI_OK;
}

/* Whether the run is to be left out, and counts it then. It takes about as long as the method's last one, or
 * longer by `factor`. */
static bool exceeds_budget(trade_work *work, const trade_subject *subject, const char *method,
                           double factor) {
    double seconds = 0.0;
    for (size_t i = 0; i < subject->run_count; ++i) {
        if (strcmp(subject->runs[i].method, method) == 0) {
            seconds = factor * subject->runs[i].bake_s;
        }
    }
    const bool exceeds = vshi_seconds() - work->measuring + seconds > work->settings->budget;
    work->skipped += exceeds;
    return exceeds;
}

/* --- Embree's rays alone: the curve that every method has to beat */

static int measure_embree(trade_work *work) {
    for (size_t s = 0; s < work->subject_count && work->meshes; ++s) {
        for (int32_t rays = 1; rays <= CURVE_RAYS && 2 * rays <= work->settings->truth_rays; rays *= 2) {
            trade_run run = {.method = "embree",
                             .embree = true,
                             .build_s = work->triangles_s,
                             .bytes = vsh_triangles_bytes(work->triangles),
                             .valid = work->points};
            const vsh_shade_options shade = {.rays = rays};
            snprintf(run.options, sizeof run.options, "%d ray%s a texel", rays, rays == 1 ? "" : "s");
            CLI_TRY(measure_run(work, &work->subjects[s], NULL, &shade, &run));
        }
    }
    return CLI_OK;
}

/* --- auto, with what `bake` chooses for an error */

static int measure_auto(trade_work *work, trade_subject *subject, double max_error) {
    trade_run run = {.method = "auto"};
    snprintf(run.options, sizeof run.options, "--max-error %g", max_error);
    if (exceeds_budget(work, subject, run.method, 1.0)) {
        return CLI_OK;
    }
    vsh_scene scene = *work->scene;
    scene.ao = subject->ao ? scene.ao : 0;
    scene.light_count = subject->ao ? 0 : scene.light_count;
    scene.shade.method = VSH_SHADOW_AUTO;
    scene.shade.ao_method = VSH_AO_AUTO;
    scene.shade.max_error = max_error;
    scene.shade.rays = 0;
    trade_field field = {.resolution = 0};
    int code;
    CLI_TRY_DONE(make_occluders(work, &scene, false, &field.traced, &run.build_s));
    CLI_TRY_DONE(find_valid(work, &scene.shade, &field));
    run.valid = field.valid;
    for (size_t i = 0; i < work->texels; ++i) {
        field.mask[i] &= work->any[i];
    }
    vsh_occluders_info info;
    vsh_occluders_get_info(field.traced, &info);
    run.bytes = info.field_bytes + info.triangles_bytes;
    CLI_TRY_DONE(measure_run(work, subject, &field, &scene.shade, &run));
done:
    free_field(&field);
    return code;
}

static int measure_autos(trade_work *work) {
    static const double errors[] = {0.05, 0.02, 0.01, 0.005};
    for (size_t e = 0; e < sizeof errors / sizeof errors[0]; ++e) {
        for (size_t s = 0; s < work->subject_count; ++s) {
            CLI_TRY(measure_auto(work, &work->subjects[s], errors[e]));
        }
    }
    return CLI_OK;
}

/* --- the methods */

typedef struct plan {
    bool ao;
    int32_t method;
    int32_t number;   /* rays or cones; 0: none */
    double max_error; /* 0: none */
} plan;

/* The quick ones first: the budget leaves out the slow ones. */
static const plan plans[] = {
    {false, VSH_SHADOW_HARD, 0, 0.0},       {true, VSH_AO_TAPS, 0, 0.0},
    {false, VSH_SHADOW_CLASSIC, 0, 0.0},    {true, VSH_AO_CONES, 4, 0.0},
    {false, VSH_SHADOW_IMPROVED, 0, 0.0},   {true, VSH_AO_CONES, 16, 0.0},
    {false, VSH_SHADOW_SMOOTH, 0, 0.0},     {true, VSH_AO_RAYS, 4, 0.0},
    {false, VSH_SHADOW_CONE, 0, 0.0},       {true, VSH_AO_ADAPTIVE, 0, 0.05},
    {false, VSH_SHADOW_RAYS, 4, 0.0},       {true, VSH_AO_EXACT, 0, 0.05},
    {false, VSH_SHADOW_ADAPTIVE, 0, 0.05},  {true, VSH_AO_ADAPTIVE, 0, 0.02},
    {false, VSH_SHADOW_EXACT, 0, 0.05},     {true, VSH_AO_EXACT, 0, 0.02},
    {false, VSH_SHADOW_ADAPTIVE, 0, 0.02},  {true, VSH_AO_RAYS, 16, 0.0},
    {false, VSH_SHADOW_EXACT, 0, 0.02},     {true, VSH_AO_ADAPTIVE, 0, 0.01},
    {false, VSH_SHADOW_ADAPTIVE, 0, 0.01},  {true, VSH_AO_EXACT, 0, 0.01},
    {false, VSH_SHADOW_EXACT, 0, 0.01},     {true, VSH_AO_RAYS, 64, 0.0},
    {false, VSH_SHADOW_RAYS, 16, 0.0},      {true, VSH_AO_CONES, 64, 0.0},
    {false, VSH_SHADOW_EXACT, 0, 0.005},    {true, VSH_AO_EXACT, 0, 0.005},
    {false, VSH_SHADOW_ADAPTIVE, 0, 0.005}, {true, VSH_AO_ADAPTIVE, 0, 0.005},
    {false, VSH_SHADOW_RAYS, 64, 0.0},
};

/* The options of a plan, which the run also names as those of `bake`. */
static vsh_shade_options apply_plan(const trade_work *work, const plan *p, trade_run *run) {
    vsh_shade_options shade = work->scene->shade;
    char more[64] = "";
    shade.early_rays = 0;
    *(p->ao ? &shade.ao_method : &shade.method) = p->method;
    if (p->max_error > 0.0) {
        shade.max_error = p->max_error;
        shade.rays = 0; /* the error decides */
        snprintf(more, sizeof more, " --max-error %g", p->max_error);
    } else if (p->ao && p->method == VSH_AO_CONES) {
        shade.ao_cones = p->number;
        snprintf(more, sizeof more, " with %d cones", p->number);
    } else if (p->number > 0) {
        shade.rays = p->number;
        snprintf(more, sizeof more, " --rays %d", p->number);
    }
    run->method = vsh_get_name(p->ao ? VSH_NAMES_AO : VSH_NAMES_SHADOW, p->method);
    snprintf(run->options, sizeof run->options, "%s %s%s --resolution %d", p->ao ? "--ao-method" : "--method",
             run->method, more, run->resolution);
    return shade;
}

static int measure_plan(trade_work *work, trade_subject *subject, const trade_field *field, const plan *p) {
    const bool exact = p->method == (p->ao ? (int32_t)VSH_AO_EXACT : (int32_t)VSH_SHADOW_EXACT);
    if (exact && !work->meshes) {
        return CLI_OK;
    }
    trade_run run = {.resolution = field->resolution, .build_s = field->build_s, .valid = field->valid};
    const vsh_shade_options shade = apply_plan(work, p, &run);
    /* on the first field, the method's last run had an easier setting */
    if (exceeds_budget(work, subject, run.method, field == work->fields ? 4.0 : 1.0)) {
        return CLI_OK;
    }
    vsh_occluders_info info;
    vsh_occluders_get_info(field->voxels, &info);
    run.bytes = info.field_bytes + (exact ? vsh_triangles_bytes(work->triangles) : 0);
    run.build_s += exact ? work->triangles_s : 0.0;
    return measure_run(work, subject, field, &shade, &run);
}

static int measure_plans(trade_work *work) {
    for (size_t i = 0; i < sizeof plans / sizeof plans[0]; ++i) {
        for (size_t s = 0; s < work->subject_count; ++s) {
            for (size_t f = 0; f < work->field_count && work->subjects[s].ao == plans[i].ao; ++f) {
                CLI_TRY(measure_plan(work, &work->subjects[s], &work->fields[f], &plans[i]));
            }
        }
    }
    return CLI_OK;
}

/* --- all of it */

static bool beats(const trade_run *a, const trade_run *b) {
    return a->rate <= b->rate && a->metrics.rmse <= b->metrics.rmse &&
           (a->rate < b->rate || a->metrics.rmse < b->metrics.rmse);
}

/* Marks the runs on the Pareto front. Embree's own are not on it and beat no other. */
static void mark_front(trade_subject *subject) {
    for (size_t i = 0; i < subject->run_count; ++i) {
        trade_run *run = &subject->runs[i];
        run->front = !run->embree;
        for (size_t k = 0; k < subject->run_count && run->front; ++k) {
            run->front = subject->runs[k].embree || !beats(&subject->runs[k], run);
        }
    }
}

/* Loads the scene, makes its truth and measures all runs. */
static int measure(trade_work *work) {
    CLI_TRY(load(work));
    allocate(work);
    CLI_TRY(make_fields(work));
    CLI_TRY(place_points(work));
    CLI_TRY(make_truth(work));
    work->measuring = vshi_seconds();
    CLI_TRY(measure_embree(work));
    CLI_TRY(measure_autos(work));
    CLI_TRY(measure_plans(work));
    for (size_t s = 0; s < work->subject_count; ++s) {
        mark_front(&work->subjects[s]);
    }
    return CLI_OK;
}

/* --- the command */

/* Refuses a scene or an output before anything is loaded. */
static int check(const trade_settings *s, const vsh_scene *scene) {
    if (scene->layer_count > 0) {
        return cli_usage("%s: trade measures one field, not layers", s->bake.input);
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (cli_caster_is_direct(&scene->casters[i])) {
            return cli_usage("%s: trade measures one field, and caster %zu is not part of it", s->bake.input,
                             i);
        }
    }
    if (s->csv != NULL && cli_same_file(s->page, s->csv)) {
        return cli_usage("%s: both the output and the --csv file", s->csv);
    }
    cli_bake_settings named = s->bake;
    named.output = s->page; /* named by the command line, not by the scene */
    named.stats = s->csv;
    return cli_bake_check_files(&named, scene);
}

/* Reduces the scene to the receiver of --receiver. */
static int choose_receiver(const trade_settings *s, vsh_scene *scene) {
    if (s->receiver < 0) {
        return CLI_OK;
    }
    if ((size_t)s->receiver >= scene->receiver_count) {
        return cli_usage("--receiver '%d': %s has %zu receiver%s, counted from 0", s->receiver, s->bake.input,
                         scene->receiver_count, scene->receiver_count == 1 ? "" : "s");
    }
    scene->receivers += s->receiver;
    scene->receiver_count = 1;
    return CLI_OK;
}

static void free_work(trade_work *work) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        free(work->subjects[s].runs);
        free(work->subjects[s].truth);
    }
    for (size_t i = 0; i < work->field_count; ++i) {
        free_field(&work->fields[i]);
    }
    for (size_t i = 0; i < work->receiver_count; ++i) {
        vsh_charts_free(work->receivers[i].charts);
    }
    free(work->receivers);
    free(work->common);
    free(work->any);
    free(work->positions);
    free(work->normals);
    free(work->texel);
    free(work->traced);
    free(work->values);
    free(work->planes);
    free(work->compared);
    vsh_triangles_free(work->triangles);
    vsh_solids_free(work->solids);
    vsh_assets_free(work->assets);
}

static int trade(const trade_settings *settings, vsh_scene *scene) {
    const double began = vshi_seconds();
    trade_work work = {.settings = settings, .scene = scene, .run = cli_make_run()};
    int code;
    CLI_TRY_DONE(measure(&work));
    CLI_TRY_DONE(trade_write_csv(&work));
    CLI_TRY_DONE(trade_write_page(&work));
    cli_signals_end(CLI_OK);
    if (!cli_given.quiet) {
        cli_say("%s: %zu runs in %.1f s, %zu left out", settings->page,
                work.subjects[0].run_count + work.subjects[1].run_count, vshi_seconds() - began,
                work.skipped);
    }
done:
    free_work(&work);
    return code;
}

static int trade_main(int argc, char **argv) {
    trade_settings s = {.resolutions = {256, 128, 64},
                        .resolution_count = 3,
                        .truth_rays = 1024,
                        .receiver = -1,
                        .budget = 120.0};
    cli_patch_set(&s.bake.patch, "--size", "256");
    cli_patch_set(&s.bake.patch, "--supersample", "1"); /* the truth has one sample a texel too */
    cli_patch_set(&s.bake.patch, "--padding", "0");
    CLI_TRY(cli_parse(&cli_trade, argc, argv, parse_option, &s, &s.bake.input));
    if (s.page == NULL || !cli_has_ending(s.page, "html")) {
        return cli_usage("%s: give -o OUT.html", s.page != NULL ? s.page : s.bake.input);
    }
    /* a mesh needs an output to become a scene; those of a scene are not written */
    const bool scene = cli_has_ending(s.bake.input, "json") && s.bake.floor_size[0] == 0.0;
    s.bake.output = scene ? NULL : s.page;
    cli_bake_scene made;
    int code;
    CLI_TRY_DONE(cli_bake_scene_make(&s.bake, &made));
    CLI_TRY_DONE(check(&s, &made.scene));
    for (size_t i = 0; i < made.scene.receiver_count; ++i) {
        made.receivers[i].allow_overlap = 1; /* texels are measured, whatever they show */
    }
    CLI_TRY_DONE(choose_receiver(&s, &made.scene));
    cli_signals_watch();
    code = trade(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}

const cli_command cli_trade = {
    "trade",
    "INPUT -o OUT.html [options]",
    "Bakes a mesh or a scene (.json) by every method, at several voxel sizes and settings, and compares\n"
    "with the truth: rays against the triangles and the procedural shapes themselves. The page shows\n"
    "error against time and the fastest options for a given error. Defaults are in brackets.",
    options,
    sizeof options / sizeof options[0],
    trade_main};
