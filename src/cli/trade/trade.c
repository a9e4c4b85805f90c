/* vdbshade trade: speed against accuracy, measured on the user's own scene. */
#include "trade.h"
#include "base/clock.h"
#include "cli/casters.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"
#include "cli/try.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    KEY_CSV = 0x2000,
    KEY_PLOT,
    KEY_VIEW,
    KEY_RECEIVER,
    KEY_SIZE,
    KEY_RESOLUTIONS,
    KEY_TRUTH_RAYS,
    KEY_BUDGET
};

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT.html", "page to write: plot, table and pictures in one file"},
    {KEY_CSV, "csv", "FILE.csv", "write the table as CSV too"},
    {KEY_PLOT, "plot", "FILE.svg",
     "write the plot of the shadow (without lights, of AO)\nas a picture of its own too"},
    {KEY_VIEW, "view", "PAGE.html",
     "also a page to look at the runs in a browser, truth and\nbakes with a slider between: docs/view.md"},
    {0, NULL, NULL, "What is measured"},
    {KEY_RECEIVER, "receiver", "N", "one receiver of the scene only, from 0 (all)"},
    {KEY_SIZE, "size", "W[xH]", "texels of each lightmap, 1 to 4096 (256)"},
    {KEY_RESOLUTIONS, "resolutions", "N,N,...",
     "voxels along the longest side, up to 16 of them\n(64,128,256)"},
    {KEY_TRUTH_RAYS, "truth-rays", "N", "rays a texel of the truth, 16 to 65536 (1024)"},
    {KEY_BUDGET, "budget", "SECONDS",
     "time to spend on runs, once there is a truth: those that\ndo not fit are left out, and counted (120)"},
    {0, NULL, NULL, "Light and occlusion, where INPUT is a mesh (--lights also of a scene)"},
    CLI_LIGHTS,
    CLI_SETTING("ao"),
    CLI_SETTING("uv-set"),
    CLI_FLOOR_OPTION,
    CLI_COMMON_OPTIONS,
};

static int trade_main(int argc, char **argv);

const cli_command cli_trade = {
    "trade",
    "INPUT -o OUT.html [options]",
    "Bakes a mesh or a scene (.json) by every method, at several voxel sizes and settings, and compares\n"
    "with the truth: rays against the triangles and the procedural shapes themselves, or against a finer\n"
    "field where a caster is a .vdb file. The page shows error against time, what is fastest for a given\n"
    "error, and what it looks like. Numbers in brackets are what holds without the option.",
    options,
    sizeof options / sizeof options[0],
    trade_main};

/* --- options */

static int take_resolutions(trade_settings *s, const char *name, const char *value) {
    s->resolution_count = 0;
    for (const char *at = value; s->resolution_count < TRADE_MAX_RESOLUTIONS; ++at) {
        char *end = NULL;
        const long number = *at >= '0' && *at <= '9' ? strtol(at, &end, 10) : 0;
        if (number < TRADE_LEAST_RESOLUTION || number > TRADE_MOST_RESOLUTION ||
            (*end != ',' && *end != '\0')) {
            break;
        }
        s->resolutions[s->resolution_count++] = (int32_t)number;
        at = end;
        if (*at == '\0') {
            return CLI_OK;
        }
    }
    return cli_usage("%s '%s': expected up to %d whole numbers from %d to %d, with commas between them", name,
                     value, TRADE_MAX_RESOLUTIONS, TRADE_LEAST_RESOLUTION, TRADE_MOST_RESOLUTION);
}

static int take_size(trade_settings *s, const char *name, const char *value) {
    int32_t width, height;
    CLI_TRY(cli_parse_size(name, value, &width, &height));
    if (width > 4096 || height > 4096) {
        return cli_usage("%s '%s': expected at most 4096 texels", name, value);
    }
    return cli_patch_set(&s->bake.patch, name, value);
}

static int take(void *settings, int key, const char *name, const char *value) {
    trade_settings *s = settings;
    switch (key) {
    case 'o':
        s->report = value;
        return CLI_OK;
    case KEY_CSV:
        s->csv = value;
        return CLI_OK;
    case KEY_PLOT:
        s->plot = value;
        return CLI_OK;
    case KEY_VIEW:
        s->view = value;
        return CLI_OK;
    case KEY_RECEIVER:
        return cli_parse_integer(name, value, 0, INT32_MAX, &s->receiver);
    case KEY_SIZE:
        return take_size(s, name, value);
    case KEY_RESOLUTIONS:
        return take_resolutions(s, name, value);
    case KEY_TRUTH_RAYS:
        return cli_parse_integer(name, value, 16, 65536, &s->truth_rays);
    case KEY_BUDGET:
        return cli_parse_positive(name, value, &s->budget);
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
}

/* --- the work */

/* Whether a run is neither slower nor farther from the truth than another, and better in one of the two. */
static bool beats(const trade_run *a, const trade_run *b) {
    return a->rate <= b->rate && a->metrics.rmse <= b->metrics.rmse &&
           (a->rate < b->rate || a->metrics.rmse < b->metrics.rmse);
}

static void mark_fronts(trade_work *work) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            trade_run *run = &subject->runs[i];
            run->front = !run->embree;
            for (size_t k = 0; k < subject->run_count && run->front; ++k) {
                run->front = subject->runs[k].embree || !beats(&subject->runs[k], run);
            }
        }
    }
}

static int make_fields(trade_work *work) {
    for (size_t i = 0; i < work->field_count; ++i) {
        trade_field *field = &work->fields[i];
        CLI_TRY(trade_make_occluders(work, field->resolution, &field->occluders, &field->build_s));
        CLI_TRY(trade_add_triangles(work, field));
    }
    return CLI_OK;
}

static int do_tasks(trade_work *work) {
    size_t next = 0;
    for (; next < work->task_count && work->tasks[next].kind == TRADE_TRUTH; ++next) {
        CLI_TRY(trade_take_truth(work, &work->tasks[next]));
    }
    work->measuring = vshi_seconds();
    for (; next < work->task_count; ++next) {
        const trade_task *task = &work->tasks[next];
        CLI_TRY(task->kind == TRADE_EMBREE ? trade_measure_embree(work, task) : trade_measure(work, task));
    }
    return CLI_OK;
}

static int measure(trade_work *work) {
    trade_describe_truth(work);
    CLI_TRY(make_fields(work));
    CLI_TRY(trade_take_masks(work));
    CLI_TRY(trade_place_points(work));
    CLI_TRY(trade_list_tasks(work));
    CLI_TRY(do_tasks(work));
    mark_fronts(work);
    return CLI_OK;
}

static void free_work(trade_work *work) {
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        for (size_t i = 0; i < subject->run_count; ++i) {
            free(subject->runs[i].values);
            free(subject->runs[i].mask);
        }
        free(subject->runs);
        free(subject->truth);
    }
    for (size_t i = 0; i < work->field_count; ++i) {
        free(work->fields[i].mask);
        vsh_occluders_free(work->fields[i].traced); /* refers to the other */
        vsh_occluders_free(work->fields[i].occluders);
    }
    for (size_t i = 0; i < work->receiver_count; ++i) {
        vsh_charts_free(work->receivers[i].charts);
    }
    free(work->receivers);
    free(work->tasks);
    free(work->any);
    free(work->common);
    free(work->positions);
    free(work->normals);
    free(work->texel);
    vsh_triangles_free(work->triangles);
    vsh_solids_free(work->solids);
    vsh_assets_free(work->assets);
}

static int write_all(const trade_work *work) {
    CLI_TRY(trade_write_csv(work));
    CLI_TRY(trade_write_plot(work));
    CLI_TRY(trade_write_report(work));
    return trade_write_view(work);
}

static void say_summary(const trade_work *work) {
    const size_t runs = work->subjects[0].run_count + work->subjects[1].run_count;
    const double seconds = vshi_seconds() - work->began;
    if (!work->settings->bake.common.quiet) {
        cli_say("%s: %zu runs in %.1f s, %zu left out", work->settings->report, runs, seconds, work->skipped);
    }
}

static int trade(const trade_settings *settings, vsh_scene *scene) {
    trade_work work = {.settings = settings,
                       .scene = scene,
                       .run = cli_common_run(&settings->bake.common),
                       .field_count = settings->resolution_count,
                       .began = vshi_seconds()};
    if (scene->light_count > 0) {
        work.subjects[work.subject_count++] = (trade_subject){.name = "shadow", .planes = scene->light_count};
    }
    if (scene->ao) {
        work.subjects[work.subject_count++] = (trade_subject){.name = "ao", .ao = true, .planes = 1};
    }
    for (size_t i = 0; i < work.field_count; ++i) {
        work.fields[i].resolution = settings->resolutions[i];
    }
    int code;
    CLI_TRY_DONE(trade_load(&work));
    CLI_TRY_DONE(trade_check_view_uvs(&work));
    CLI_TRY_DONE(measure(&work));
    CLI_TRY_DONE(write_all(&work));
    cli_signals_end(CLI_OK);
    say_summary(&work);
done:
    free_work(&work);
    return code;
}

/* --- beforehand */

/* What can be refused before anything is read. */
static int check_files(const trade_settings *s, const vsh_scene *scene) {
    const char *const outputs[] = {s->report, s->csv, s->plot, s->view};
    static const char *const names[] = {"output", "--csv file", "--plot file", "--view page"};
    cli_bake_settings named = s->bake; /* by the command line, not by the scene */
    if (scene->layer_count > 0) {
        return cli_usage("%s: trade measures one field, not layers", s->bake.input);
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (cli_caster_is_direct(&scene->casters[i])) {
            return cli_usage("%s: trade measures one field, and caster %zu is not part of it", s->bake.input,
                             i);
        }
    }
    for (size_t i = 0; i < sizeof outputs / sizeof outputs[0]; ++i) {
        if (outputs[i] == NULL) {
            continue;
        }
        for (size_t k = 0; k < i; ++k) {
            if (outputs[k] != NULL && cli_same_file(outputs[i], outputs[k])) {
                return cli_usage("%s: both the %s and the %s", outputs[i], names[k], names[i]);
            }
        }
        named.output = outputs[i];
        CLI_TRY(cli_bake_check_output(&named, scene, outputs[i]));
        CLI_TRY(cli_temporary_check(outputs[i]));
    }
    return CLI_OK;
}

/* Leaves the scene with the one receiver that was asked for. */
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

static int compare_descending(const void *a, const void *b) {
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x < y) - (x > y);
}

static int parse(int argc, char **argv, trade_settings *s, bool *help) {
    static const int32_t resolutions[] = {256, 128, 64};
    memset(s, 0, sizeof *s);
    memcpy(s->resolutions, resolutions, sizeof resolutions);
    s->resolution_count = sizeof resolutions / sizeof resolutions[0];
    s->bake.common = cli_common_default();
    cli_patch_set(&s->bake.patch, "--size", "256");
    cli_patch_set(&s->bake.patch, "--supersample", "1"); /* the truth is one of the sample's too */
    cli_patch_set(&s->bake.patch, "--padding", "0");
    s->truth_rays = 1024;
    s->receiver = -1;
    s->budget = 120.0;
    const int code = cli_parse(&cli_trade, argc, argv, take, s, "INPUT", &s->bake.input, help);
    qsort(s->resolutions, s->resolution_count, sizeof s->resolutions[0], compare_descending);
    return code;
}

static int trade_main(int argc, char **argv) {
    trade_settings s;
    bool help;
    int code = parse(argc, argv, &s, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    if (s.report == NULL || !cli_has_ending(s.report, "html")) {
        return cli_usage("%s: give -o OUT.html", s.report != NULL ? s.report : s.bake.input);
    }
    /* a mesh needs an output to be a scene; a scene's own are not written */
    const bool scene = cli_has_ending(s.bake.input, "json") && s.bake.floor_size[0] == 0.0;
    s.bake.output = scene ? NULL : s.report;
    cli_progress_begin(s.bake.common.progress, s.bake.common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_make(&s.bake, &made));
    for (size_t i = 0; i < made.scene.receiver_count; ++i) {
        made.receivers[i].allow_overlap = 1; /* texels are measured, whatever they show */
    }
    CLI_TRY_DONE(check_files(&s, &made.scene));
    CLI_TRY_DONE(choose_receiver(&s, &made.scene));
    CLI_TRY_DONE(trade_check_view(&s, &made.scene));
    cli_signals_watch();
    code = trade(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}
