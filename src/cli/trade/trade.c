/* vdbshade trade: error against time of every method, on the user's own scene.
 *
 * Bakes the scene in many ways, and measures time and error of each. Every voxel size finds other texels
 * valid (neither inside a solid nor behind a wall). Runs are compared over the texels that all sizes find
 * valid. */
#include "base/clock.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_RESOLUTIONS = 16, LEAST_RESOLUTION = 2, MOST_RESOLUTION = 65536 };

typedef struct trade_settings {
    cli_bake_settings bake; /* the scene, with the options that `bake` has too */
    const char *page;
    const char *csv;                       /* NULL: none */
    int32_t resolutions[MOST_RESOLUTIONS]; /* descending */
    size_t resolution_count;
    int32_t truth_rays;
    double budget; /* seconds */
} trade_settings;

/* A plane of values holds the texels of all receivers, one receiver after the other. */
typedef struct trade_receiver {
    vsh_charts *charts;
    vsh_charts_info info;
    size_t first; /* its first texel in a plane */
} trade_receiver;

/* One way to bake, its time and its error. */
typedef struct trade_run {
    const char *method; /* a static string */
    char options[128];  /* of `bake` */
    int32_t resolution; /* 0: none, or chosen by auto */
    bool front;         /* no other run is both faster and nearer to the truth */
    double build_s;
    double bake_s;
    double rate;    /* microseconds for one light at one texel, or one texel's AO */
    uint64_t bytes; /* of the field and the triangles */
    vsh_accuracy error;
} trade_run;

/* The shadows of all lights, or AO. */
typedef struct trade_subject {
    bool ao;
    size_t planes; /* lights, or 1 */
    float *truth;  /* [planes][texels] */
    trade_run *runs;
    size_t run_count;
} trade_subject;

typedef struct trade_work {
    const trade_settings *settings;
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    trade_receiver *receivers;
    size_t receiver_count;
    double low[3], high[3]; /* world box of the receivers' samples; low > high: there are none */
    double samples;
    size_t texels;            /* of all lightmaps */
    size_t covered;           /* by charts */
    vsh_triangles *triangles; /* of the mesh casters; NULL without any */
    vsh_solids *solids;       /* of the procedural casters; NULL without any */
    double triangles_s;
    vsh_occluders *fields[MOST_RESOLUTIONS]; /* with triangles if all casters have some; finest first */
    vsh_occluders *voxels[MOST_RESOLUTIONS]; /* the same fields without triangles, for methods that march */
    uint8_t *mask;                           /* [texels]: 1 where a texel is valid in all of these */
    size_t points;                           /* texels of the mask */
    double *positions;                       /* [points][3] */
    float *normals;                          /* [points][3] */
    uint32_t *texel;                         /* [points]: place in a plane */
    float *traced;                           /* [points]: values of the rays */
    trade_subject subjects[2];
    size_t subject_count;
    float *values;          /* [planes of the larger subject][texels]: those of the run being measured */
    float **planes;         /* [lights]: of a receiver that is baked */
    vsh_compared *compared; /* [planes of the larger subject][receivers] */
    size_t skipped;         /* runs that did not fit into the budget */
    double measuring;       /* when the budget began, seconds */
    double truth_s;
} trade_work;

/* --- options */

enum { KEY_SIZE = 0x2000, KEY_RESOLUTIONS, KEY_TRUTH_RAYS };

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(trade_settings, page), "output", "OUT.html", "page to write: plots and tables in one file"},
    {CLI_TEXT(trade_settings, csv), "csv", "FILE.csv", "write the table of all runs as CSV too"},
    {0, NULL, NULL, "What is measured"},
    {KEY_SIZE, "size", "W[xH]", "texels of each lightmap (256)"},
    {KEY_RESOLUTIONS, "resolutions", "N,N,...",
     "voxels along the longest side, up to 16 of them\n(64,128,256)"},
    {KEY_TRUTH_RAYS, "truth-rays", "N", "rays a texel of the truth, 16 to 65536 (1024)"},
    {CLI_POSITIVE(trade_settings, budget), "budget", "SECONDS",
     "no run begins later than this after the truth is known;\nruns that are left out are counted (120)"},
    {0, NULL, NULL, "Light and occlusion, where INPUT is a mesh (--lights also of a scene)"},
    CLI_LIGHTS,
    CLI_SETTING("ao"),
    CLI_SETTING("uv-set"),
    CLI_FLOOR_OPTION,
    CLI_COMMON_OPTIONS,
};

static int parse_resolutions(trade_settings *s, const char *name, const char *value) {
    s->resolution_count = 0;
    for (const char *at = value; s->resolution_count < MOST_RESOLUTIONS; ++at) {
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
                     value, MOST_RESOLUTIONS, LEAST_RESOLUTION, MOST_RESOLUTION);
}

static int parse_option(void *settings, int key, const char *name, const char *value) {
    trade_settings *s = settings;
    switch (key) {
    case KEY_SIZE:
        return cli_patch_set(&s->bake.patch, name, value);
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

/* A short run is repeated, and the shortest of its times counts. */
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
    const double start = read_clock(work);
    const vsh_result result =
        vsh_scene_truth(scene, work->assets, &work->run, &work->triangles, &work->solids, &error);
    work->triangles_s = read_clock(work) - start;
    return cli_check_result(result, &error);
}

static int allocate(trade_work *work) {
    const size_t lights = work->scene->light_count;
    const double planes = (double)sizeof(float) * (double)(2 * lights + 2) * (double)work->texels;
    if (planes > (double)work->run.memory_limit && work->run.memory_limit > 0) {
        cli_say(
            "%s: values and truth of %zu texels need %.0f MiB, over the memory limit: give a smaller --size",
            work->settings->bake.input, work->texels, planes / 0x1p20);
        return CLI_LIMIT;
    }
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
    work->mask = malloc(work->texels);
    memset(work->mask, 1, work->texels);
    return CLI_OK;
}

/* --- baking */

/* Makes the scene's casters, with voxels for every method or with what auto needs. */
static int make_occluders(const trade_work *work, const vsh_scene *scene, bool voxels,
                          vsh_occluders **occluders) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.receivers_min = work->low;
    what.receivers_max = work->high;
    what.points = work->samples;
    what.voxels = voxels;
    what.triangles = !voxels || work->solids == NULL;
    vsh_error error;
    return cli_check_result(vsh_scene_occluders(scene, work->assets, &what, &work->run, occluders, &error),
                            &error);
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

/* Drops the texels that are not valid with these casters from the mask. */
static int drop_invalid(trade_work *work, const vsh_occluders *occluders) {
    CLI_TRY(bake(work, NULL, occluders, &work->scene->shade, work->values));
    for (size_t i = 0; i < work->texels; ++i) {
        work->mask[i] &= work->values[i] > 0.0f;
    }
    return CLI_OK;
}

/* Makes the casters at a resolution, with triangles and without. */
static int make_field(trade_work *work, int32_t resolution, vsh_occluders **field, vsh_occluders **voxels) {
    vsh_scene scene = *work->scene;
    scene.grid.resolution = resolution;
    scene.grid.voxel_size = 0.0;
    scene.shade.method = VSH_SHADOW_AUTO; /* which keeps triangles where it can */
    scene.shade.ao_method = VSH_AO_AUTO;
    CLI_TRY(make_occluders(work, &scene, true, field));
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(*field, &parts);
    parts.triangles = NULL;
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_occluders_from_parts(&parts, voxels, &error), &error));
    CLI_TRY(drop_invalid(work, *field));
    return drop_invalid(work, *voxels);
}

static int make_fields(trade_work *work) {
    for (size_t i = 0; i < work->settings->resolution_count; ++i) {
        CLI_TRY(make_field(work, work->settings->resolutions[i], &work->fields[i], &work->voxels[i]));
    }
    for (size_t i = 0; i < work->texels; ++i) {
        work->points += work->mask[i];
    }
    return work->points > 0 ? CLI_OK
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

/* Adds points for the receiver's texels in the mask, from index *at on. */
static void place_samples(trade_work *work, const trade_receiver *receiver, vsh_texel_samples samples,
                          double lift, double voxel, size_t *at) {
    for (size_t i = 0; i < samples.count; ++i) {
        const size_t texel = receiver->first + vsh_texel_place(samples.texels[i], receiver->info.width);
        if (!work->mask[texel]) {
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
    vsh_occluders_get_parts(work->fields[0], &parts);
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
static int compare(const trade_work *work, const trade_subject *subject, vsh_accuracy *accuracy) {
    const size_t count = subject->planes * work->receiver_count;
    for (size_t i = 0; i < count; ++i) {
        const trade_receiver *receiver = &work->receivers[i % work->receiver_count];
        const size_t first = i / work->receiver_count * work->texels + receiver->first;
        work->compared[i] = (vsh_compared){{receiver->info.width, receiver->info.height, 1},
                                           subject->truth + first,
                                           work->values + first,
                                           work->mask + receiver->first};
    }
    vsh_error error;
    return cli_check_result(vsh_compare_accuracy(work->compared, count, &work->run, accuracy, &error),
                            &error);
}

/* Whether exact methods and Embree alone can trace all casters. */
static bool is_traceable(const trade_work *work) {
    vsh_occluders_info info;
    vsh_occluders_get_info(work->fields[0], &info);
    return info.has_triangles != 0 && work->solids == NULL;
}

static bool is_embree(const trade_run *run) {
    return strcmp(run->method, "embree") == 0;
}

/* Measures a run that is filled in but for its results, and adds it to its subject. Without occluders,
 * Embree's rays alone make the values. */
static int measure_run(const trade_work *work, trade_subject *subject, const vsh_occluders *occluders,
                       const vsh_shade_options *shade, trade_run *run) {
    run->bake_s = INFINITY;
    for (int i = 0; i < REPEATS && (i == 0 || run->bake_s < SHORT_SECONDS); ++i) {
        const double start = read_clock(work);
        double seconds;
        if (occluders == NULL) {
            CLI_TRY(trace(work, subject, shade->rays, work->values, &seconds));
        } else {
            CLI_TRY(bake(work, subject, occluders, shade, work->values));
            seconds = read_clock(work) - start;
        }
        run->bake_s = fmin(run->bake_s, seconds);
    }
    run->rate = 1e6 * run->bake_s / (double)(subject->planes * work->points);
    CLI_TRY(compare(work, subject, &run->error));
    subject->runs = realloc(subject->runs, (subject->run_count + 1) * sizeof *run);
    subject->runs[subject->run_count++] = *run;
    if (!cli_given.quiet) {
        cli_say("%s%s: RMSE %.4f, %.3f s", is_embree(run) ? "Embree, " : "", run->options, run->error.rmse,
                run->bake_s);
    }
    return CLI_OK;
}

/* Stores what making the casters took, with the triangles if the method traces them. */
static void add_costs(const vsh_occluders *occluders, bool traces, trade_run *run) {
    vsh_occluders_info info;
    vsh_occluders_get_info(occluders, &info);
    run->build_s = info.voxelize_s + info.field_s + (traces ? info.triangles_s : 0.0);
    run->bytes = info.field_bytes + (traces ? info.triangles_bytes : 0);
}

/* Whether the budget is spent; then a run is left out and counted. */
static bool exceeds_budget(trade_work *work) {
    const bool exceeds = vshi_seconds() - work->measuring > work->settings->budget;
    work->skipped += exceeds;
    return exceeds;
}

/* --- Embree's rays alone: the curve that every method has to beat */

static int measure_embree(trade_work *work, trade_subject *subject) {
    for (int32_t rays = 1; rays <= CURVE_RAYS && 2 * rays <= work->settings->truth_rays; rays *= 2) {
        trade_run run = {
            .method = "embree", .build_s = work->triangles_s, .bytes = vsh_triangles_bytes(work->triangles)};
        const vsh_shade_options shade = {.rays = rays};
        snprintf(run.options, sizeof run.options, "%d ray%s a texel", rays, rays == 1 ? "" : "s");
        CLI_TRY(measure_run(work, subject, NULL, &shade, &run));
    }
    return CLI_OK;
}

/* --- the methods */

/* A method of shadows, of AO or of both, and an option of `bake` with its values. */
typedef struct trade_plan {
    const char *method, *option;
    const char *values[4]; /* NULL after the last; quick ones first: the budget leaves out the slow ones */
} trade_plan;

static const trade_plan plans[] = {
    {"auto", "--max-error", {"0.05", "0.02", "0.01", "0.005"}},
    {"hard", "", {""}},
    {"classic", "", {""}},
    {"improved", "", {""}},
    {"smooth", "", {""}},
    {"cone", "", {""}},
    {"taps", "", {""}},
    {"cones", "", {""}},
    {"rays", "--rays", {"4", "16", "64"}},
    {"adaptive", "--max-error", {"0.05", "0.02", "0.01", "0.005"}},
    {"exact", "--max-error", {"0.05", "0.02", "0.01", "0.005"}},
};

/* Puts a plan over a scene of its own, and names the run by the options of `bake`. */
static int apply_plan(const trade_subject *subject, const trade_plan *plan, const char *value,
                      vsh_scene *scene, trade_run *run) {
    const char *method = subject->ao ? "--ao-method" : "--method";
    run->method = plan->method;
    snprintf(run->options, sizeof run->options, "%s %s%s%s%s%s", method, plan->method,
             *value != '\0' ? " " : "", plan->option, *value != '\0' ? " " : "", value);
    scene->shade.rays = 0; /* the error decides */
    vsh_error error;
    CLI_TRY(cli_check(vsh_scene_set(scene, method, plan->method, &error), &error));
    return *value == '\0' ? CLI_OK : cli_check(vsh_scene_set(scene, plan->option, value, &error), &error);
}

/* Measures auto, which chooses the casters itself. */
static int measure_auto(trade_work *work, trade_subject *subject, vsh_scene *scene, trade_run *run) {
    scene->ao = subject->ao ? scene->ao : 0;
    scene->light_count = subject->ao ? 0 : scene->light_count;
    vsh_occluders *occluders = NULL;
    CLI_TRY(make_occluders(work, scene, false, &occluders));
    add_costs(occluders, true, run);
    const int code = measure_run(work, subject, occluders, &scene->shade, run);
    vsh_occluders_free(occluders);
    return code;
}

static int measure_plan(trade_work *work, trade_subject *subject, const trade_plan *plan, const char *value) {
    for (size_t f = 0; f < work->settings->resolution_count; ++f) {
        trade_run run = {.resolution = 0};
        vsh_scene scene = *work->scene;
        CLI_TRY(apply_plan(subject, plan, value, &scene, &run));
        const bool exact = strcmp(run.method, "exact") == 0;
        if ((exact && !is_traceable(work)) || exceeds_budget(work)) {
            continue;
        }
        if (strcmp(run.method, "auto") == 0) {
            return measure_auto(work, subject, &scene, &run);
        }
        run.resolution = work->settings->resolutions[f];
        const size_t used = strlen(run.options);
        snprintf(run.options + used, sizeof run.options - used, " --resolution %d", run.resolution);
        scene.shade.early_rays = 0;
        const vsh_occluders *occluders = exact ? work->fields[f] : work->voxels[f];
        add_costs(work->fields[f], exact, &run);
        CLI_TRY(measure_run(work, subject, occluders, &scene.shade, &run));
    }
    return CLI_OK;
}

static int measure_plans(trade_work *work) {
    const size_t methods = sizeof plans / sizeof plans[0];
    for (size_t i = 0; i < 4 * methods; ++i) {
        const trade_plan *plan = &plans[i % methods];
        const char *value = plan->values[i / methods];
        for (size_t s = 0; s < work->subject_count && value != NULL; ++s) {
            trade_subject *subject = &work->subjects[s];
            const bool has_method =
                vsh_find_name(subject->ao ? VSH_NAMES_AO : VSH_NAMES_SHADOW, plan->method) >= 0;
            CLI_TRY(has_method ? measure_plan(work, subject, plan, value) : CLI_OK);
        }
    }
    return CLI_OK;
}

/* --- all of it */

static int compare_rates(const void *a, const void *b) {
    const double x = ((const trade_run *)a)->rate, y = ((const trade_run *)b)->rate;
    return (x > y) - (x < y);
}

/* Sorts the runs by time, and marks those on the Pareto front. Embree's own are not on it and beat no other.
 */
static void sort_runs(trade_subject *subject) {
    double best = INFINITY;
    qsort(subject->runs, subject->run_count, sizeof *subject->runs, compare_rates);
    for (size_t i = 0; i < subject->run_count; ++i) {
        trade_run *run = &subject->runs[i];
        run->front = !is_embree(run) && run->error.rmse < best;
        best = run->front ? run->error.rmse : best;
    }
}

/* Loads the scene, makes its truth and measures all runs. */
static int measure(trade_work *work) {
    CLI_TRY(load(work));
    CLI_TRY(allocate(work));
    CLI_TRY(make_fields(work));
    CLI_TRY(place_points(work));
    CLI_TRY(make_truth(work));
    work->measuring = vshi_seconds();
    for (size_t s = 0; s < work->subject_count; ++s) {
        CLI_TRY(is_traceable(work) ? measure_embree(work, &work->subjects[s]) : CLI_OK);
    }
    CLI_TRY(measure_plans(work));
    for (size_t s = 0; s < work->subject_count; ++s) {
        sort_runs(&work->subjects[s]);
    }
    return CLI_OK;
}

/* --- the plot: RMSE against time, both logarithmic */

enum { WIDTH = 860, HEIGHT = 540, LEFT = 64, RIGHT = 164, TOP = 16, BOTTOM = 48 };

/* The plot has its own style, because it also stands alone, cut out of the page. */
static const char plot_style[] =
    "<style>.plot text{font:13px system-ui,sans-serif;fill:#222}.plot .grid{stroke:#e4e4e4;fill:none}"
    ".plot .minor{stroke:#f3f3f3;fill:none}"
    ".plot .front{stroke:#111;stroke-width:1.5;stroke-dasharray:5 3;fill:none}"
    ".plot .embree{stroke:#000;stroke-width:2;fill:none}</style>\n";

/* Colours that differ without red against green (Okabe and Ito, 2008). */
static const struct {
    const char *method, *color;
} colors[] = {
    {"hard", "#999999"},     {"taps", "#999999"},  {"classic", "#cc79a7"}, {"improved", "#aa4499"},
    {"smooth", "#e69f00"},   {"cone", "#d55e00"},  {"cones", "#d55e00"},   {"rays", "#56b4e9"},
    {"adaptive", "#009e73"}, {"exact", "#0072b2"}, {"auto", "#f0e442"},    {"embree", "#000000"},
};
enum { COLOR_COUNT = sizeof colors / sizeof colors[0] };

static const char *color_of(const char *method) {
    size_t i = 0;
    while (i < COLOR_COUNT - 1 && strcmp(colors[i].method, method) != 0) {
        ++i;
    }
    return colors[i].color;
}

/* A logarithmic axis: powers of ten, and the pixels that they lie at. */
typedef struct axis {
    double low, high, from, to;
} axis;

typedef struct plot {
    FILE *out;
    const trade_work *work;
    const trade_subject *subject;
    axis axes[2]; /* x and y */
} plot;

static void include_value(axis *a, double value) {
    a->low = fmin(a->low, log10(value));
    a->high = fmax(a->high, log10(value));
}

/* Widens an axis by a margin, and to one power of ten at least. */
static void widen(axis *a) {
    if (!(a->low <= a->high)) {
        a->low = -1.0;
        a->high = 1.0;
    }
    const double margin = fmax(0.08, 0.5 * (1.0 - (a->high - a->low)));
    a->low -= margin;
    a->high += margin;
}

static double place(const axis *a, double value) {
    return a->from + (log10(value) - a->low) / (a->high - a->low) * (a->to - a->from);
}

/* An error of 0 stands at the bottom. */
static double error_of(const trade_run *run) {
    return fmax(run->error.rmse, 1e-4);
}

/* Draws lines at 1, 2 and 5 times each power of ten; a short axis has a label at each. */
static void write_grid(const plot *p, const axis *a) {
    static const int steps[] = {1, 2, 5};
    const bool across = a == &p->axes[0], all = a->high - a->low < 3.5;
    for (int i = 0; i < 3 * 14; ++i) {
        const int step = steps[i % 3];
        const double value = step * pow(10.0, i / 3 - 7), at = place(a, value);
        if (log10(value) < a->low || log10(value) > a->high) {
            continue;
        }
        fprintf(p->out, "<path class=\"%s\" d=\"M%.1f %.1f%c%d\"/>", step == 1 ? "grid" : "minor",
                across ? at : LEFT, across ? TOP : at, across ? 'V' : 'H',
                across ? HEIGHT - BOTTOM : WIDTH - RIGHT);
        if (step == 1 || all) {
            fprintf(p->out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%g</text>\n",
                    across ? at : LEFT - 6.0, across ? HEIGHT - BOTTOM + 18.0 : at + 4.0,
                    across ? "middle" : "end", value);
        }
    }
}

/* Joins Embree's runs, or those on the front. */
static void write_line(const plot *p, bool embree) {
    fprintf(p->out, "<polyline class=\"%s\" points=\"", embree ? "embree" : "front");
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        if (embree ? is_embree(run) : run->front) {
            fprintf(p->out, "%.1f,%.1f ", place(&p->axes[0], run->rate), place(&p->axes[1], error_of(run)));
        }
    }
    fputs("\"/>\n", p->out);
}

/* Finer voxels have larger dots. */
static double radius_of(int32_t resolution) {
    return resolution == 0 ? 3.0 : fmax(2.0, 0.8 * log2(resolution) - 2.0);
}

static void write_dots(const plot *p) {
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        fprintf(p->out,
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"%s\"%s><title>%s%s: RMSE %.4f, %.3g "
                "µs</title></circle>\n",
                place(&p->axes[0], run->rate), place(&p->axes[1], error_of(run)), radius_of(run->resolution),
                color_of(run->method), run->front ? " stroke=\"#000\" stroke-width=\"1.5\"" : "",
                is_embree(run) ? "Embree, " : "", run->options, run->error.rmse, run->rate);
    }
}

static void write_legend_line(const plot *p, int *y, double radius, const char *color, const char *text) {
    fprintf(p->out, "<circle cx=\"%d\" cy=\"%d\" r=\"%g\" fill=\"%s\"/><text x=\"%d\" y=\"%d\">%s</text>\n",
            WIDTH - RIGHT + 16, *y, radius, color, WIDTH - RIGHT + 30, *y + 4, text);
    *y += 20;
}

/* Methods by colour, then voxel sizes by radius. */
static void write_legend(const plot *p) {
    int y = TOP + 12;
    for (size_t c = 0; c < COLOR_COUNT; ++c) {
        write_legend_line(p, &y, 4.0, colors[c].color, colors[c].method);
    }
    for (size_t i = p->work->settings->resolution_count; i-- > 0;) {
        const int32_t resolution = p->work->settings->resolutions[i];
        char text[32];
        snprintf(text, sizeof text, "%d voxels", resolution);
        write_legend_line(p, &y, radius_of(resolution), "#bbb", text);
    }
}

static void write_plot(FILE *out, const trade_work *work, const trade_subject *subject) {
    plot p = {out,
              work,
              subject,
              {{INFINITY, -INFINITY, LEFT, WIDTH - RIGHT}, {INFINITY, -INFINITY, HEIGHT - BOTTOM, TOP}}};
    for (size_t i = 0; i < subject->run_count; ++i) {
        include_value(&p.axes[0], subject->runs[i].rate);
        include_value(&p.axes[1], error_of(&subject->runs[i]));
    }
    widen(&p.axes[0]);
    widen(&p.axes[1]);
    fprintf(out,
            "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 "
            "%d %d\" role=\"img\" aria-label=\"error against time\">\n%s<rect width=\"%d\" height=\"%d\" "
            "fill=\"#fff\"/>\n",
            WIDTH, HEIGHT, plot_style, WIDTH, HEIGHT);
    write_grid(&p, &p.axes[0]);
    write_grid(&p, &p.axes[1]);
    fprintf(out,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">bake, microseconds a value</text>\n"
            "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">RMSE against the "
            "truth</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, (TOP + HEIGHT - BOTTOM) / 2);
    write_line(&p, true);
    write_line(&p, false);
    write_dots(&p);
    write_legend(&p);
    fputs("</svg>\n", out);
}

/* --- the tables */

/* Writes the fastest run with an RMSE of at most `target`: the first on the front. */
static void write_fastest(FILE *out, const trade_subject *subject, double target) {
    size_t i = 0;
    while (i < subject->run_count && !(subject->runs[i].front && subject->runs[i].error.rmse <= target)) {
        ++i;
    }
    if (i == subject->run_count) {
        fprintf(out, "<tr><td>%g</td><td>–</td><td class=\"t\">none of these</td></tr>\n", target);
        return;
    }
    const trade_run *best = &subject->runs[i];
    fprintf(out, "<tr><td>%g</td><td>%.3g</td><td class=\"t\"><code>%s</code></td></tr>\n", target,
            best->rate, best->options);
}

/* Writes the CSV of all runs; bench/README.md explains the columns. */
static void write_runs(FILE *out, const trade_work *work) {
    fputs("subject,method,options,resolution,build_s,bake_s,us_per_value,bytes,covered,texels,rmse,penumbra_"
          "rmse,"
          "bias,p95,p99,max,width_error,front\n",
          out);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            const trade_run *run = &subject->runs[i];
            const vsh_accuracy *e = &run->error;
            fprintf(out, "%s,%s,%s,%d,%.4g,%.4g,%.4g,%" PRIu64 ",%zu,%zu,", subject->ao ? "ao" : "shadow",
                    run->method, run->options, run->resolution, run->build_s, run->bake_s, run->rate,
                    run->bytes, work->covered, work->points);
            fprintf(out, "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", e->rmse, e->penumbra_rmse, e->bias, e->p95, e->p99,
                    e->max);
            fprintf(out, isnan(e->width_error) ? "," : "%.6f,", e->width_error);
            fprintf(out, "%d\n", run->front);
        }
    }
}

static void write_targets(FILE *out, const trade_subject *subject) {
    static const double targets[] = {0.05, 0.02, 0.01, 0.005};
    fputs("<table><tr><th>RMSE of at most</th><th>µs a value</th><th class=\"t\">fastest options</th></tr>\n",
          out);
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; ++i) {
        write_fastest(out, subject, targets[i]);
    }
    fputs("</table>\n", out);
}

/* --- the page */

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>\n"
    "body{font:15px/1.5 system-ui,sans-serif;margin:1.5em auto;max-width:1100px;padding:0 1em;"
    "overflow-wrap:break-word}svg{width:100%;max-width:860px;min-width:640px;height:auto}"
    "table,pre{font-size:13px;overflow-x:auto}th,td{padding:.3em .6em;text-align:right}"
    "td.t,th.t{text-align:left}\n</style>\n";

static void write_conditions(FILE *out, const trade_work *work) {
    fprintf(out,
            "<p>%zu of %zu texels under charts are measured, with one sample each: those that are neither "
            "inside a solid nor behind a wall at any voxel size.</p>\n<p>Truth: %d rays a texel, from just "
            "above it, against the casters themselves%s%s; it took %.1f s.</p>\n",
            work->points, work->covered, work->settings->truth_rays,
            work->triangles != NULL ? "; triangles by Embree" : "",
            work->solids != NULL ? "; procedural shapes by sphere tracing in double precision" : "",
            work->truth_s);
    fprintf(
        out,
        "<p>Time: %s; the shortest of three bakes if they are short. A bake finds the valid texels, places "
        "the origins of rays, and shades. A value is one light at one texel, or the AO of one texel.%s</p>\n",
        work->run.threads == 1 ? "processor time of one thread" : "wall time of all threads",
        work->solids == NULL
            ? " Embree’s time is that of making and tracing the rays, from texels known to be "
              "valid."
            : "");
    if (work->skipped > 0) {
        fprintf(out,
                "<p>%zu runs did not fit into the budget of %g s; <code>--budget</code> gives more.</p>\n",
                work->skipped, work->settings->budget);
    }
}

static int write_page(const trade_work *work) {
    cli_temporary page;
    CLI_TRY(cli_temporary_begin(&page, work->settings->page));
    FILE *out = page.file;
    fprintf(out, "%s<title>Speed against accuracy</title>\n<h1>Speed against accuracy: ", head);
    cli_escape(out, work->settings->bake.input);
    fputs("</h1>\n", out);
    write_conditions(out, work);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        fprintf(out, "<h2>%s</h2>\n", subject->ao ? "Ambient occlusion" : "Shadow");
        write_plot(out, work, subject);
        write_targets(out, subject);
    }
    fputs("<h2>All runs</h2>\n<pre>", out);
    write_runs(out, work);
    fprintf(out,
            "</pre>\n<p>Penumbrae are texels with a truth of 0.02 … 0.98. The width error is how far the "
            "distances "
            "from 10 %% to 90 %% are off, relative to them. The dashed line, and 1 under <code>front</code>, "
            "is the "
            "Pareto front: no other run is both faster and nearer to the truth. Made by vdbshade "
            "%s.</p>\n</html>\n",
            vsh_version());
    return cli_temporary_commit(&page);
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

static void free_work(trade_work *work) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        free(work->subjects[s].runs);
        free(work->subjects[s].truth);
    }
    for (size_t i = 0; i < MOST_RESOLUTIONS; ++i) {
        vsh_occluders_free(work->voxels[i]);
        vsh_occluders_free(work->fields[i]);
    }
    for (size_t i = 0; i < work->receiver_count; ++i) {
        vsh_charts_free(work->receivers[i].charts);
    }
    free(work->receivers);
    free(work->mask);
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
    if (settings->csv != NULL) {
        cli_temporary csv;
        CLI_TRY_DONE(cli_temporary_begin(&csv, settings->csv));
        write_runs(csv.file, &work);
        CLI_TRY_DONE(cli_temporary_commit(&csv));
    }
    CLI_TRY_DONE(write_page(&work));
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
    trade_settings s = {
        .resolutions = {256, 128, 64}, .resolution_count = 3, .truth_rays = 1024, .budget = 120.0};
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
