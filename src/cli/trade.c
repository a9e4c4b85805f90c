/* vdbshade trade: error against time of every method, on the user's own scene.
 *
 * Bakes the scene in many ways, and measures time and error of each. The truth is a bake by `exact` with its
 * least error. Every voxel size finds other texels valid (neither inside a solid nor behind a wall), so runs
 * are compared over the texels that are valid in all of them. */
#include "bake/bake.h"
#include "base/clock.h"
#include "base/memory.h"
#include "base/vec.h"

enum { MOST_RESOLUTIONS = 16, LEAST_RESOLUTION = 2, MOST_RESOLUTION = 65536 };

/* RMSE of shadow and AO on assets/cloister.glb between such a truth, with 1024 rays, and 4096 Embree rays a
 * texel of an independent baker (bench/embree_bake.c). */
static const double truth_error[] = {0.0004, 0.0023};
static const double truth_max_error = 0.0001; /* the least that the library takes */

/* A short run is repeated, and the shortest of its times counts. */
enum { REPEATS = 3 };
static const double SHORT_SECONDS = 0.3;

typedef struct trade_resolutions {
    int32_t value[MOST_RESOLUTIONS]; /* descending */
    size_t count;
} trade_resolutions;

typedef struct trade_settings {
    cli_bake_settings bake; /* the scene */
    const char *page;
    const char *csv; /* NULL: none */
    trade_resolutions resolutions;
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
    const char *method, *color;
    const char *options; /* of `bake` */
    int32_t resolution;  /* 0: chosen by auto */
    bool front;          /* no other run is both faster and nearer to the truth */
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
    vsh_assets *assets;
    trade_receiver *receivers;
    size_t receiver_count;
    double low[3], high[3]; /* world box of the receivers */
    double samples;
    size_t texels;  /* of all lightmaps */
    size_t covered; /* by charts */
    vsh_occluders *truth;
    vsh_occluders *fields[MOST_RESOLUTIONS]; /* for `exact`; finest first */
    vsh_occluders *voxels[MOST_RESOLUTIONS]; /* the same without triangles, for methods that march */
    uint8_t *mask;                           /* [texels]: 1 where a texel is valid in all of these */
    size_t points;                           /* texels of the mask */
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

static int parse_resolutions(void *to, const char *name, const char *value) {
    trade_resolutions *r = to;
    r->count = 0;
    for (const char *at = value; r->count < MOST_RESOLUTIONS; ++at) {
        int32_t number;
        if (!cli_read_integer(at, &number, &at) || number < LEAST_RESOLUTION || number > MOST_RESOLUTION ||
            (*at != ',' && *at != '\0')) {
            break;
        }
        size_t place = r->count++;
        for (; place > 0 && r->value[place - 1] < number; --place) {
            r->value[place] = r->value[place - 1];
        }
        r->value[place] = number;
        if (*at == '\0') {
            return CLI_OK;
        }
    }
    return cli_usage("%s '%s': expected up to %d whole numbers from %d to %d, with commas between them", name,
                     value, MOST_RESOLUTIONS, LEAST_RESOLUTION, MOST_RESOLUTION);
}

static const cli_option options[] = {
    {.help = "Output"},
    {"output", "OUT.html", "page to write: plots and tables in one file",
     CLI_VALUE(TEXT, trade_settings, page)},
    {"csv", "FILE.csv", "write the table of all runs as CSV too", CLI_VALUE(TEXT, trade_settings, csv)},
    {.help = "What is measured"},
    {"size", "W[xH]", "texels of each lightmap (256)", CLI_SETTING},
    {"resolutions", "N,N,...", "voxels along the longest side, up to 16 of them (64,128,256)",
     CLI_PARSED(trade_settings, resolutions, parse_resolutions)},
    {"truth-rays", "N", "most rays of the truth for a texel, 16 to 4096 (1024)",
     CLI_RANGE(INTEGER, trade_settings, truth_rays, 16, 4096)},
    {"budget", "SECONDS",
     "no run begins later than this after the truth is known; runs that are left out are counted (120)",
     CLI_VALUE(POSITIVE, trade_settings, budget)},
    {.help = "Light and occlusion, if INPUT is a mesh (--lights also of a scene)"},
    CLI_SUN_OPTIONS,
    CLI_RADIUS_OPTION,
    {"ao", CLI_SETTING},
    {"uv-set", CLI_SETTING},
    CLI_FLOOR_OPTION,
    CLI_COMMON_OPTIONS,
};

/* --- the scene */

static int load(trade_work *work) {
    vsh_scene *scene = work->scene;
    const vsh_scene given = *scene;
    CLI_TRY(cli_check_input(vsh_assets_load(scene, &cli_run, &work->assets, &cli_error)));
    cli_say_auto_ao(&given, scene->shade.ao_distance);
    work->receivers = calloc(scene->receiver_count, sizeof *work->receivers);
    vshi_empty_box(work->low, work->high);
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        vsh_charts_info *info = &work->receivers[i].info;
        size_t mesh_count;
        const vsh_mesh *meshes = vsh_assets_receiver(work->assets, i, &mesh_count);
        CLI_TRY(cli_check_input(vsh_receiver_charts(scene, i, meshes, mesh_count, &cli_run,
                                                    &work->receivers[i].charts, &cli_error)));
        ++work->receiver_count;
        vsh_charts_get_info(work->receivers[i].charts, info);
        if (info->samples > 0) {
            vshi_grow_box_by(work->low, work->high, NULL, info->bounds_min, info->bounds_max);
        }
        work->receivers[i].first = work->texels;
        work->texels += (size_t)info->width * (size_t)info->height;
        work->covered += info->covered;
        work->samples += (double)info->samples;
    }
    return CLI_OK;
}

static int allocate(trade_work *work) {
    const size_t lights = work->scene->light_count;
    const double planes = (double)sizeof(float) * (double)(2 * lights + 2) * (double)work->texels;
    CLI_TRY(cli_check(vshi_check_limit(&cli_run, planes, work->settings->bake.input, &cli_error)));
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

/* Makes the scene's casters, with voxels in any case or only where its methods want them. */
static int make_occluders(const trade_work *work, const vsh_scene *scene, bool triangles, bool voxels,
                          vsh_occluders **occluders) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.receivers_min = work->low;
    what.receivers_max = work->high;
    what.points = work->samples;
    what.triangles = triangles;
    what.voxels = voxels;
    return cli_check_input(vsh_scene_occluders(scene, work->assets, &what, &cli_run, occluders, &cli_error));
}

/* Bakes the subject, or (NULL) coverage, of all receivers into `values`. */
static int bake(const trade_work *work, const trade_subject *subject, const vsh_occluders *occluders,
                const vsh_shade_options *shade, float *values) {
    const size_t lights = subject != NULL && !subject->ao ? subject->planes : 0;
    vsh_bake_stats baked = vsh_bake_stats_zero();
    for (size_t r = 0; r < work->receiver_count; ++r) {
        float *first = values + work->receivers[r].first;
        for (size_t i = 0; i < lights; ++i) {
            work->planes[i] = first + i * work->texels;
        }
        const vsh_lightmap lightmap = {.shadow = lights > 0 ? work->planes : NULL,
                                       .ao = subject != NULL && subject->ao ? first : NULL,
                                       .coverage = subject == NULL ? first : NULL};
        CLI_TRY(cli_check_input(vsh_bake_lightmap(occluders, work->receivers[r].charts, work->scene->lights,
                                                  lights, shade, &cli_run, &lightmap, &baked, &cli_error)));
    }
    return CLI_OK;
}

/* Drops the texels that are not valid with these casters from the mask. */
static int drop_invalid(trade_work *work, const vsh_occluders *occluders) {
    CLI_TRY(bake(work, NULL, occluders, &work->scene->shade, work->values));
    for (size_t i = 0; i < work->texels; ++i) {
        work->mask[i] &= work->values[i] > 0.0f;
    }
    return CLI_OK;
}

/* Makes the casters at each resolution, with triangles and without. `exact` is the scene that needs
 * triangles. */
static int make_fields(trade_work *work, vsh_scene *exact) {
    const trade_resolutions *resolutions = &work->settings->resolutions;
    for (size_t i = 0; i < resolutions->count; ++i) {
        exact->grid.resolution = resolutions->value[i];
        exact->grid.voxel_size = 0.0;
        CLI_TRY(make_occluders(work, exact, true, true, &work->fields[i]));
        CLI_TRY(make_occluders(work, exact, false, true, &work->voxels[i]));
        CLI_TRY(drop_invalid(work, work->fields[i]));
        CLI_TRY(drop_invalid(work, work->voxels[i]));
    }
    for (size_t i = 0; i < work->texels; ++i) {
        work->points += work->mask[i];
    }
    return work->points > 0 ? CLI_OK
                            : cli_usage("%s: no texel is valid at all voxel sizes: nothing to measure",
                                        work->settings->bake.input);
}

static int make_truth(trade_work *work) {
    vsh_scene exact = *work->scene;
    exact.shade.method = VSH_SHADOW_EXACT;
    exact.shade.ao_method = VSH_AO_EXACT;
    exact.shade.max_error = truth_max_error;
    exact.shade.rays = work->settings->truth_rays;
    CLI_TRY(make_occluders(work, &exact, true, false, &work->truth));
    CLI_TRY(drop_invalid(work, work->truth));
    CLI_TRY(make_fields(work, &exact));
    const double start = vshi_seconds();
    for (size_t s = 0; s < work->subject_count; ++s) {
        CLI_TRY(bake(work, &work->subjects[s], work->truth, &exact.shade, work->subjects[s].truth));
    }
    work->truth_s = vshi_seconds() - start;
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
    return cli_check_input(vsh_compare_accuracy(work->compared, count, &cli_run, accuracy, &cli_error));
}

/* Measures a run that is filled in except for its results, and adds it to its subject. */
static int measure_run(const trade_work *work, trade_subject *subject, const vsh_occluders *occluders,
                       const vsh_shade_options *shade, trade_run *run) {
    run->bake_s = INFINITY;
    for (int i = 0; i < REPEATS && (i == 0 || run->bake_s < SHORT_SECONDS); ++i) {
        const double start = vshi_seconds();
        CLI_TRY(bake(work, subject, occluders, shade, work->values));
        run->bake_s = fmin(run->bake_s, vshi_seconds() - start);
    }
    run->rate = 1e6 * run->bake_s / (double)(subject->planes * work->points);
    CLI_TRY(compare(work, subject, &run->error));
    subject->runs = realloc(subject->runs, (subject->run_count + 1) * sizeof *run);
    subject->runs[subject->run_count++] = *run;
    cli_inform("%s: RMSE %.4f, %.3f s", run->options, run->error.rmse, run->bake_s);
    return CLI_OK;
}

/* --- the methods */

/* A method of shadows, of AO or of both, and an option of `bake` with its values. The colours differ without
 * red against green (Okabe and Ito, 2008). */
typedef struct trade_plan {
    const char *method, *color, *option;
    const char *values[4]; /* NULL after the last; quick ones first: the budget leaves out the slow ones */
} trade_plan;

static const trade_plan plans[] = {
    {"auto", "#f0e442", "--max-error", {"0.05", "0.02", "0.01", "0.005"}},
    {"hard", "#999999", "", {""}},
    {"classic", "#cc79a7", "", {""}},
    {"improved", "#aa4499", "", {""}},
    {"smooth", "#e69f00", "", {""}},
    {"cone", "#d55e00", "", {""}},
    {"taps", "#999999", "", {""}},
    {"cones", "#d55e00", "", {""}},
    {"rays", "#56b4e9", "--rays", {"4", "16", "64"}},
    {"adaptive", "#009e73", "--max-error", {"0.05", "0.02", "0.01", "0.005"}},
    {"exact", "#0072b2", "--max-error", {"0.05", "0.02", "0.01", "0.005"}},
};

/* Applies a plan to its own copy of the scene, and names the run by the options of `bake`. */
static int apply_plan(const trade_subject *subject, const trade_plan *plan, const char *value,
                      vsh_scene *scene, trade_run *run) {
    const char *method = subject->ao ? "--ao-method" : "--method";
    const char *blank = *value != '\0' ? " " : "";
    run->method = plan->method;
    run->color = plan->color;
    run->options = cli_keep_text("%s %s%s%s%s%s", method, plan->method, blank, plan->option, blank, value);
    scene->shade.rays = 0; /* the error decides */
    CLI_TRY(cli_check(vsh_scene_set(scene, method, plan->method, &cli_error)));
    return *value == '\0' ? CLI_OK : cli_check(vsh_scene_set(scene, plan->option, value, &cli_error));
}

/* Measures a plan at each resolution. Auto chooses the casters itself, once. */
static int measure_plan(trade_work *work, trade_subject *subject, const trade_plan *plan, const char *value) {
    const bool is_auto = strcmp(plan->method, "auto") == 0, exact = strcmp(plan->method, "exact") == 0;
    int code = CLI_OK;
    for (size_t f = 0; f < (is_auto ? 1 : work->settings->resolutions.count) && code == CLI_OK; ++f) {
        trade_run run = {.resolution = 0};
        vsh_scene scene = *work->scene;
        vsh_occluders *own = NULL;
        CLI_TRY(apply_plan(subject, plan, value, &scene, &run));
        if (vshi_seconds() - work->measuring > work->settings->budget) {
            ++work->skipped;
            continue;
        }
        if (is_auto) {
            scene.ao = subject->ao ? scene.ao : 0;
            scene.light_count = subject->ao ? 0 : scene.light_count;
            CLI_TRY(make_occluders(work, &scene, true, false, &own));
        } else {
            scene.shade.early_rays = 0;
            run.resolution = work->settings->resolutions.value[f];
            run.options = cli_keep_text("%s --resolution %d", run.options, run.resolution);
        }
        const bool traces = is_auto || exact;
        vsh_occluders_info info;
        vsh_occluders_get_info(is_auto ? own : work->fields[f], &info);
        run.build_s = info.voxelize_s + info.field_s + (traces ? info.triangles_s : 0.0);
        run.bytes = info.field_bytes + (traces ? info.triangles_bytes : 0);
        code = measure_run(work, subject,
                           is_auto ? own
                           : exact ? work->fields[f]
                                   : work->voxels[f],
                           &scene.shade, &run);
        vsh_occluders_free(own);
    }
    return code;
}

static int measure_plans(trade_work *work) {
    const size_t methods = CLI_COUNT(plans);
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

static int compare_rates(const void *a, const void *b) {
    const double x = ((const trade_run *)a)->rate, y = ((const trade_run *)b)->rate;
    return (x > y) - (x < y);
}

/* Sorts the runs by time, and marks those on the Pareto front. */
static void sort_runs(trade_subject *subject) {
    double best = INFINITY;
    if (subject->run_count > 1) { /* the list is NULL if the budget left out all runs */
        qsort(subject->runs, subject->run_count, sizeof *subject->runs, compare_rates);
    }
    for (size_t i = 0; i < subject->run_count; ++i) {
        trade_run *run = &subject->runs[i];
        run->front = run->error.rmse < best;
        best = run->front ? run->error.rmse : best;
    }
}

/* --- the plot: RMSE against time, both logarithmic */

enum { WIDTH = 1070, HEIGHT = 560, LEFT = 64, RIGHT = 164, TOP = 16, BOTTOM = 48 };

/* The plot has its own style, because it is also cut out of the page. */
static const char plot_style[] =
    "<style>.plot text{font:13px system-ui,sans-serif;fill:#222}.plot .grid{stroke:#e4e4e4;fill:none}"
    ".plot .minor{stroke:#f3f3f3;fill:none}"
    ".plot .front{stroke:#111;stroke-width:1.5;stroke-dasharray:5 3;fill:none}</style>\n";

/* A logarithmic axis: powers of ten, and the pixels where they are. */
typedef struct axis {
    double low, high, from, to;
} axis;

typedef struct plot {
    FILE *out;
    const trade_subject *subject;
    axis x, y;
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

/* Returns the error that is drawn: 0 has no logarithm. */
static double error_of(const trade_run *run) {
    return fmax(run->error.rmse, 1e-4);
}

/* Draws lines at 1, 2 and 5 times each power of ten; a short axis has a label at each. */
static void write_grid(const plot *p, const axis *a) {
    static const int steps[] = {1, 2, 5};
    const bool across = a == &p->x, all = a->high - a->low < 3.5;
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

/* Returns the radius of a dot: finer voxels have larger ones. */
static double radius_of(int32_t resolution) {
    return resolution == 0 ? 3.0 : fmax(2.0, 0.8 * log2(resolution) - 2.0);
}

/* Draws the front as a line, and all runs as dots. */
static void write_runs_drawn(const plot *p) {
    fputs("<polyline class=\"front\" points=\"", p->out);
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        if (run->front) {
            fprintf(p->out, "%.1f,%.1f ", place(&p->x, run->rate), place(&p->y, error_of(run)));
        }
    }
    fputs("\"/>\n", p->out);
    for (size_t i = 0; i < p->subject->run_count; ++i) {
        const trade_run *run = &p->subject->runs[i];
        fprintf(p->out,
                "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"%s\"%s><title>%s: RMSE %.4f, %.3g "
                "µs</title></circle>\n",
                place(&p->x, run->rate), place(&p->y, error_of(run)), radius_of(run->resolution), run->color,
                run->front ? " stroke=\"#000\" stroke-width=\"1.5\"" : "", run->options, run->error.rmse,
                run->rate);
    }
}

/* Lists methods by colour, then voxel sizes by radius. */
static void write_legend(const plot *p, const trade_resolutions *resolutions) {
    const size_t methods = CLI_COUNT(plans);
    for (size_t i = 0; i < methods + resolutions->count; ++i) {
        const int y = TOP + 12 + 20 * (int)i;
        const int32_t resolution =
            i < methods ? 0 : resolutions->value[resolutions->count - 1 - (i - methods)];
        fprintf(p->out,
                "<circle cx=\"%d\" cy=\"%d\" r=\"%g\" fill=\"%s\"/><text x=\"%d\" y=\"%d\">%s</text>\n",
                WIDTH - RIGHT + 16, y, i < methods ? 4.0 : radius_of(resolution),
                i < methods ? plans[i].color : "#bbb", WIDTH - RIGHT + 30, y + 4,
                i < methods ? plans[i].method : cli_keep_text("%d voxels", resolution));
    }
}

static void write_plot(FILE *out, const trade_work *work, const trade_subject *subject) {
    plot p = {out,
              subject,
              {INFINITY, -INFINITY, LEFT, WIDTH - RIGHT},
              {INFINITY, -INFINITY, HEIGHT - BOTTOM, TOP}};
    for (size_t i = 0; i < subject->run_count; ++i) {
        include_value(&p.x, subject->runs[i].rate);
        include_value(&p.y, error_of(&subject->runs[i]));
    }
    widen(&p.x);
    widen(&p.y);
    fprintf(out,
            "<figure>\n<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" "
            "role=\"img\" "
            "aria-label=\"error against time\">\n%s<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n",
            WIDTH, HEIGHT, plot_style, WIDTH, HEIGHT);
    write_grid(&p, &p.x);
    write_grid(&p, &p.y);
    fprintf(out,
            "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">bake, microseconds a value</text>\n"
            "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">RMSE against the "
            "truth</text>\n",
            (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, (TOP + HEIGHT - BOTTOM) / 2);
    write_runs_drawn(&p);
    write_legend(&p, &work->settings->resolutions);
    fputs("</svg>\n</figure>\n", out);
}

/* --- the tables */

/* Writes the CSV of all runs; bench/README.md explains the columns. */
static void write_runs(FILE *out, const trade_work *work) {
    fputs("subject,method,options,resolution,build_s,bake_s,us_per_value,bytes,covered,texels,rmse,p99,max,"
          "front\n",
          out);
    for (size_t s = 0; s < work->subject_count; ++s) {
        const trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            const trade_run *run = &subject->runs[i];
            const vsh_accuracy *e = &run->error;
            fprintf(out, "%s,%s,%s,%d,%.4g,%.4g,%.4g,%" PRIu64 ",%zu,%zu,", subject->ao ? "ao" : "shadow",
                    run->method, run->options, run->resolution, run->build_s, run->bake_s, run->rate,
                    run->bytes, work->covered, work->points);
            fprintf(out, "%.6f,%.6f,%.6f,%d\n", e->rmse, e->p99, e->max, run->front);
        }
    }
}

/* Writes for each target the fastest run with such an RMSE: the first on the front. */
static void write_targets(FILE *out, const trade_subject *subject) {
    static const double targets[] = {0.05, 0.02, 0.01, 0.005};
    fputs("<table><tr><th>RMSE of at most</th><th>µs a value</th><th class=\"t\">fastest options</th></tr>\n",
          out);
    for (size_t t = 0; t < CLI_COUNT(targets); ++t) {
        size_t i = 0;
        while (i < subject->run_count &&
               !(subject->runs[i].front && subject->runs[i].error.rmse <= targets[t])) {
            ++i;
        }
        fprintf(out, "<tr><td>%g</td>", targets[t]);
        if (i < subject->run_count) {
            fprintf(out, "<td>%.3g</td><td class=\"t\"><code>%s</code></td></tr>\n", subject->runs[i].rate,
                    subject->runs[i].options);
        } else {
            fputs("<td>–</td><td class=\"t\">none of these</td></tr>\n", out);
        }
    }
    fputs("</table>\n", out);
}

/* --- the page */

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n<style>\n"
    "body{font:15px/1.5 system-ui,sans-serif;margin:1.5em auto;max-width:1100px;padding:0 1em;"
    "overflow-wrap:break-word}figure{margin:0;overflow-x:auto}svg{width:100%;min-width:640px;height:auto}"
    "table,pre{font-size:13px;overflow-x:auto}th,td{padding:.3em .6em;text-align:right}"
    "td.t,th.t{text-align:left}\n</style>\n";

static void write_conditions(FILE *out, const trade_work *work) {
    fprintf(
        out,
        "<p>%zu of %zu texels under charts are measured, with one sample each: those that are neither inside "
        "a solid nor behind a wall at any voxel size.</p>\n<p>Truth: <code>exact</code> with "
        "<code>--max-error %g</code>, at most %d rays a texel; it took %.1f s. On the project's sample scene "
        "such a truth, with 1024 rays, differs by %g for shadow and %g for AO from an independent baker's "
        "Embree rays (RMSE). So an error near that, and a smaller difference between two runs, means "
        "little.</p>\n",
        work->points, work->covered, truth_max_error, work->settings->truth_rays, work->truth_s,
        truth_error[0], truth_error[1]);
    fputs(
        "<p>Time: wall time of all threads; the shortest of three bakes if they are short. A bake finds the "
        "valid texels, places the origins of rays, and shades. A value is one light at one texel, or the AO "
        "of one texel.</p>\n",
        out);
    if (work->skipped > 0) {
        fprintf(out,
                "<p>%zu runs did not fit into the budget of %g s; <code>--budget</code> gives more.</p>\n",
                work->skipped, work->settings->budget);
    }
}

static void write_page(FILE *out, const trade_work *work) {
    const char *input = vshi_path_name(work->settings->bake.input);
    fputs(head, out);
    cli_write(out, "<title>", input, ": speed against accuracy</title>\n");
    cli_write(out, "<h1>Speed against accuracy: ", input, "</h1>\n");
    cli_write(out, "<p>", work->settings->page, ", made by ");
    cli_write(out, "<code>vdbshade ", cli_parsed.command, "</code></p>\n");
    write_conditions(out, work);
    for (size_t s = 0; s < work->subject_count; ++s) {
        fprintf(out, "<h2>%s</h2>\n", work->subjects[s].ao ? "Ambient occlusion" : "Shadow");
        write_plot(out, work, &work->subjects[s]);
        write_targets(out, &work->subjects[s]);
    }
    fputs("<h2>All runs</h2>\n<pre>", out);
    write_runs(out, work);
    fprintf(
        out,
        "</pre>\n<p>The dashed line, and 1 under <code>front</code>, is the Pareto front: no other run is "
        "both faster and nearer to the truth. Made by vdbshade %s.</p>\n</html>\n",
        vsh_version());
}

/* --- the command */

static void free_work(trade_work *work) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        free(work->subjects[s].runs);
        free(work->subjects[s].truth);
    }
    for (size_t i = 0; i < MOST_RESOLUTIONS; ++i) {
        vsh_occluders_free(work->voxels[i]);
        vsh_occluders_free(work->fields[i]);
    }
    vsh_occluders_free(work->truth);
    for (size_t i = 0; i < work->receiver_count; ++i) {
        vsh_charts_free(work->receivers[i].charts);
    }
    free(work->receivers);
    free(work->mask);
    free(work->values);
    free(work->planes);
    free(work->compared);
    vsh_assets_free(work->assets);
}

static int trade(const trade_settings *settings, vsh_scene *scene) {
    const double began = vshi_seconds();
    const char *const outputs[] = {settings->page, settings->csv};
    const char *const inputs[] = {settings->bake.input, cli_bake_lights(&settings->bake)};
    trade_work work = {.settings = settings, .scene = scene};
    int code;
    CLI_TRY_DONE(cli_check_outputs(outputs, CLI_COUNT(outputs), inputs, CLI_COUNT(inputs), scene));
    cli_signals_watch();
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(allocate(&work));
    CLI_TRY_DONE(make_truth(&work));
    work.measuring = vshi_seconds();
    CLI_TRY_DONE(measure_plans(&work));
    for (size_t s = 0; s < work.subject_count; ++s) {
        sort_runs(&work.subjects[s]);
    }
    for (size_t i = 0; i < CLI_COUNT(outputs) && outputs[i] != NULL; ++i) {
        cli_temporary file;
        CLI_TRY_DONE(cli_temporary_begin(&file, outputs[i]));
        (i == 0 ? write_page : write_runs)(file.file, &work);
        CLI_TRY_DONE(cli_temporary_commit(&file));
    }
    cli_signals_end(CLI_OK);
    cli_inform("%s: %zu runs in %.1f s, %zu left out", settings->page,
               work.subjects[0].run_count + work.subjects[1].run_count, vshi_seconds() - began, work.skipped);
done:
    free_work(&work);
    return code;
}

/* Refuses casters that are not all in one field. */
static int check_casters(const trade_settings *s, const vsh_scene *scene) {
    CLI_REFUSE_IF(scene->layer_count > 0, "%s: trade measures one field, not layers", s->bake.input);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        CLI_REFUSE_IF(cli_caster_is_direct(&scene->casters[i]),
                      "%s: trade measures one field, and caster %zu is not part of it", s->bake.input, i);
    }
    return CLI_OK;
}

static int trade_main(int argc, char **argv) {
    trade_settings s = {.resolutions = {{256, 128, 64}, 3}, .truth_rays = 1024, .budget = 120.0};
    CLI_TRY(cli_parse(&cli_trade, argc, argv, &s, &s.bake.input));
    CLI_TRY(cli_set_default("size", "256"));
    CLI_TRY(cli_set_default("supersample", "1"));
    CLI_TRY(cli_set_default("padding", "0"));
    CLI_REFUSE_IF(s.page == NULL || !cli_has_ending(s.page, "html"), "%s: give -o OUT.html",
                  s.page != NULL ? s.page : s.bake.input);
    /* a mesh needs an output to become a scene, but no output is written */
    const bool scene = cli_has_ending(s.bake.input, "json") && s.bake.floor[0] == 0.0;
    s.bake.output = scene ? NULL : s.page;
    cli_bake_scene made;
    int code;
    CLI_TRY_DONE(cli_bake_scene_make(&s.bake, &made));
    CLI_TRY_DONE(check_casters(&s, &made.scene));
    for (size_t i = 0; i < made.scene.receiver_count; ++i) {
        made.receivers[i].allow_overlap = 1; /* texels are measured, even if objects share them */
    }
    code = trade(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}

const cli_command cli_trade = {
    "trade", "INPUT -o OUT.html [options]", "error against time by every method, measured on your scene",
    "Bakes a mesh or a scene (.json) by every method, at several voxel sizes and settings, and compares\n"
    "with the truth: rays against the casters themselves. The page shows error against time and the\n"
    "fastest options for a given error. Numbers in brackets are defaults.",
    CLI_ENDING(options, trade_main)};
