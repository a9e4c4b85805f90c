/* vdbshade trade: error against time of every method, on the user's own scene. */
#include "trade.h"
#include "base/clock.h"
#include "cli/casters.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <stdlib.h>
#include <string.h>

enum { LEAST_RESOLUTION = 2, MOST_RESOLUTION = 65536, MOST_TEXELS = 4096 };

enum { KEY_CSV = 0x2000, KEY_RECEIVER, KEY_SIZE, KEY_RESOLUTIONS, KEY_TRUTH_RAYS, KEY_BUDGET };

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT.html", "page to write: plots and tables in one file"},
    {KEY_CSV, "csv", "FILE.csv", "write the table of all runs as CSV too"},
    {0, NULL, NULL, "What is measured"},
    {KEY_RECEIVER, "receiver", "N", "one receiver of the scene only, from 0 (all)"},
    {KEY_SIZE, "size", "W[xH]", "texels of each lightmap, 1 to 4096 (256)"},
    {KEY_RESOLUTIONS, "resolutions", "N,N,...",
     "voxels along the longest side, up to 16 of them\n(64,128,256)"},
    {KEY_TRUTH_RAYS, "truth-rays", "N", "rays a texel of the truth, 16 to 65536 (1024)"},
    {KEY_BUDGET, "budget", "SECONDS",
     "time for the runs after the truth is known; runs that\ndo not fit are left out and counted (120)"},
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
    "field where a caster is a .vdb file. The page shows error against time and the fastest options for\n"
    "a given error. Defaults are in brackets.",
    options,
    sizeof options / sizeof options[0],
    trade_main};

/* --- options */

static int parse_resolutions(trade_settings *s, const char *name, const char *value) {
    s->resolution_count = 0;
    for (const char *at = value; s->resolution_count < TRADE_MAX_RESOLUTIONS; ++at) {
        char *end = NULL;
        const long number = *at >= '0' && *at <= '9' ? strtol(at, &end, 10) : 0;
        if (number < LEAST_RESOLUTION || number > MOST_RESOLUTION || (*end != ',' && *end != '\0')) {
            break;
        }
        s->resolutions[s->resolution_count++] = (int32_t)number;
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
    case 'o':
        s->page = value;
        return CLI_OK;
    case KEY_CSV:
        s->csv = value;
        return CLI_OK;
    case KEY_RECEIVER:
        return cli_parse_integer(name, value, 0, INT32_MAX, &s->receiver);
    case KEY_SIZE:
        return parse_size(s, name, value);
    case KEY_RESOLUTIONS:
        return parse_resolutions(s, name, value);
    case KEY_TRUTH_RAYS:
        return cli_parse_integer(name, value, 16, 65536, &s->truth_rays);
    case KEY_BUDGET:
        return cli_parse_positive(name, value, &s->budget);
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
}

static int compare_descending(const void *a, const void *b) {
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x < y) - (x > y);
}

static int parse(int argc, char **argv, trade_settings *s, bool *help) {
    *s = (trade_settings){.resolutions = {256, 128, 64},
                          .resolution_count = 3,
                          .truth_rays = 1024,
                          .receiver = -1,
                          .budget = 120.0};
    s->bake.common = cli_common_default();
    cli_patch_set(&s->bake.patch, "--size", "256");
    cli_patch_set(&s->bake.patch, "--supersample", "1"); /* the truth has one sample a texel too */
    cli_patch_set(&s->bake.patch, "--padding", "0");
    CLI_TRY(cli_parse(&cli_trade, argc, argv, parse_option, s, "INPUT", &s->bake.input, help));
    if (*help) {
        return CLI_OK;
    }
    qsort(s->resolutions, s->resolution_count, sizeof s->resolutions[0], compare_descending);
    if (s->page == NULL || !cli_has_ending(s->page, "html")) {
        return cli_usage("%s: give -o OUT.html", s->page != NULL ? s->page : s->bake.input);
    }
    /* a mesh needs an output to become a scene; those of a scene are not written */
    const bool scene = cli_has_ending(s->bake.input, "json") && s->bake.floor_size[0] == 0.0;
    s->bake.output = scene ? NULL : s->page;
    return CLI_OK;
}

/* --- the command */

static int check_casters(const trade_settings *s, const vsh_scene *scene) {
    if (scene->layer_count > 0) {
        return cli_usage("%s: trade measures one field, not layers", s->bake.input);
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (cli_caster_is_direct(&scene->casters[i])) {
            return cli_usage("%s: trade measures one field, and caster %zu is not part of it", s->bake.input,
                             i);
        }
    }
    return CLI_OK;
}

static int check_output(const trade_settings *s, const vsh_scene *scene, const char *output) {
    cli_bake_settings named = s->bake;
    named.output = output; /* named by the command line, not by the scene */
    CLI_TRY(cli_bake_check_output(&named, scene, output));
    return cli_temporary_check(output);
}

/* Refuses a scene or an output before anything is loaded. */
static int check(const trade_settings *s, const vsh_scene *scene) {
    CLI_TRY(check_casters(s, scene));
    CLI_TRY(check_output(s, scene, s->page));
    if (s->csv == NULL) {
        return CLI_OK;
    }
    if (cli_same_file(s->page, s->csv)) {
        return cli_usage("%s: both the output and the --csv file", s->csv);
    }
    return check_output(s, scene, s->csv);
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
        free(work->fields[i].mask);
        vsh_occluders_free(work->fields[i].traced); /* refers to the next */
        vsh_occluders_free(work->fields[i].voxels);
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
    free(work->values);
    free(work->mask);
    vsh_triangles_free(work->triangles);
    vsh_solids_free(work->solids);
    vsh_assets_free(work->assets);
}

static int trade(const trade_settings *settings, vsh_scene *scene) {
    const double began = vshi_seconds();
    trade_work work = {.settings = settings, .scene = scene, .run = cli_common_run(&settings->bake.common)};
    int code;
    CLI_TRY_DONE(trade_measure(&work));
    CLI_TRY_DONE(trade_write_csv(&work));
    CLI_TRY_DONE(trade_write_page(&work));
    cli_signals_end(CLI_OK);
    if (!settings->bake.common.quiet) {
        cli_say("%s: %zu runs in %.1f s, %zu left out", settings->page,
                work.subjects[0].run_count + work.subjects[1].run_count, vshi_seconds() - began,
                work.skipped);
    }
done:
    free_work(&work);
    return code;
}

static int trade_main(int argc, char **argv) {
    trade_settings s;
    bool help;
    int code = parse(argc, argv, &s, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(s.bake.common.progress, s.bake.common.quiet);
    cli_bake_scene made;
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
    cli_progress_end();
    return code;
}
