/* vdbshade bake: from files to lightmaps. */
#include "bake.h"
#include "base/try.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/temporary.h"
#include "cli/try.h"
#include "cli/warnings.h"
#include "options.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int make_folder_of(const char *output) {
    char *folder = cli_object_folder(output);
    const int code = folder != NULL ? cli_make_folder(folder) : cli_out_of_memory(output);
    free(folder);
    return code;
}

/* Whether the image of a receiver can be written, which the scene's file names or the command line. */
static int check_image(const cli_bake_settings *settings, const vsh_scene *scene, size_t index) {
    vsh_error error;
    if (vsh_receiver_check(scene, index, &error) == VSH_OK) {
        return CLI_OK;
    }
    return settings->output == NULL && error.code == VSH_ERROR_ARGUMENT
               ? cli_usage("%s: receivers[%zu]: output %s", settings->input, index, error.message)
               : cli_fail(&error);
}

static int check_picture(const cli_bake_settings *settings) {
    const char *path = settings->invalid_picture;
    if (path != NULL && !cli_has_ending(path, "png")) {
        return cli_usage("--invalid '%s': expected a name that ends in .png", path);
    }
    return CLI_OK;
}

/* What is only for outputs that are assets. */
static int check_lit(const cli_bake_settings *settings, const vsh_scene *scene) {
    const char *given = settings->preview ? "preview" : settings->exr != NULL ? "exr" : NULL;
    size_t assets = 0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        assets += vsh_lit_is_output(scene->receivers[i].output) != 0;
    }
    if (given != NULL && assets == 0) {
        return cli_usage("--%s: is for outputs that end in .glb, .gltf or .obj", given);
    }
    if (settings->exr == NULL) {
        return CLI_OK;
    }
    if (!cli_has_ending(settings->exr, "exr") || scene->receiver_count != 1) {
        return cli_usage("--exr '%s': expected a name that ends in .exr, and one output", settings->exr);
    }
    CLI_TRY(cli_check_folder(settings->exr));
    return cli_bake_check_output(settings, scene, settings->exr);
}

/* What is not for a part, but for all of them together; and whether what parts say they are of is what is
 * asked for. */
static int check_shard(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *given = s->invalid_picture != NULL ? "invalid"
                        : s->view != NULL          ? "view"
                        : s->exr != NULL           ? "exr"
                                                   : NULL;
    if (s->shard > 0 && given != NULL) {
        return cli_usage("--%s: not together with --shard; give it to 'vdbshade merge'", given);
    }
    if (s->merged != NULL && s->output == NULL && strcmp(s->merged, scene->receivers[0].output) != 0) {
        return cli_usage("%s: its parts are of %s, whose first output is %s", s->merged, s->input,
                         scene->receivers[0].output);
    }
    return CLI_OK;
}

/* What can be refused before anything is read. */
static int check_files(const cli_bake_settings *settings, const vsh_scene *scene) {
    if (settings->stats != NULL) {
        CLI_TRY(cli_temporary_check(settings->stats));
    }
    CLI_TRY(check_shard(settings, scene));
    CLI_TRY(check_picture(settings));
    CLI_TRY(check_lit(settings, scene));
    CLI_TRY(cli_bake_check_view(settings, scene));
    const bool makes = settings->output_folder != NULL || settings->per_object;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const char *output = scene->receivers[i].output;
        if (makes && settings->dry_run) {
            continue; /* its folder need not be there yet */
        }
        CLI_TRY(makes ? make_folder_of(output) : cli_check_folder(output));
        CLI_TRY(check_image(settings, scene, i));
    }
    return CLI_OK;
}

/* Outputs of objects have their names only now; the others are looked at once more, as inputs of models are
 * found by reading those. */
static int check_outputs(const cli_bake_settings *settings, const vsh_scene *scene, const vsh_bake_job *job) {
    const char *const others[] = {settings->stats, settings->exr, settings->view, settings->invalid_picture};
    enum { OTHERS = sizeof others / sizeof others[0] };
    const size_t lightmaps = vsh_bake_job_count(job);
    const char **outputs = calloc(lightmaps + OTHERS, sizeof *outputs);
    int code = outputs != NULL ? CLI_OK : cli_out_of_memory(settings->input);
    size_t count = 0;
    for (size_t i = 0; i < lightmaps && code == CLI_OK; ++i) {
        vsh_job_lightmap lightmap;
        vsh_bake_job_lightmap(job, i, &lightmap);
        outputs[count++] = lightmap.output;
        code = cli_bake_check_output(settings, scene, lightmap.output);
    }
    for (size_t i = 0; i < OTHERS && code == CLI_OK; ++i) {
        outputs[count] = others[i];
        count += others[i] != NULL;
    }
    code = code == CLI_OK ? cli_bake_check_inputs(settings, scene, outputs, count) : code;
    free(outputs);
    return code;
}

/* --- what is told */

enum { MOST_TOLD = 8 }; /* lightmaps that have a line each */

typedef struct telling {
    const cli_common *common;
    bool part;    /* lightmaps are not whole */
    size_t count; /* lightmaps */
} telling;

static bool is_each_told(const telling *t) {
    return t->count <= MOST_TOLD || t->common->verbose;
}

static void say_lightmap(void *user, const vsh_job_lightmap *lightmap, vsh_result result) {
    const telling *t = user;
    if (result != VSH_OK || t->common->quiet || t->part || !is_each_told(t)) {
        return;
    }
    cli_say("%s: %d × %d, %" PRIu64 " texels, %" PRIu64 " of them invalid", lightmap->output, lightmap->width,
            lightmap->height, lightmap->covered, lightmap->invalid_texels);
}

/* A name to go before ".I-of-N.part", to be freed. */
static char *name_parts(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *output = s->output != NULL ? s->output : scene->receivers[0].output;
    return cli_end_path(output, ""); /* a folder, of objects */
}

static void say_part(const cli_bake_settings *s, const char *parts, const vsh_bake_report *report) {
    cli_say("%s.%d-of-%d.part: %" PRIu64 " texels, %" PRIu64
            " of them invalid; 'vdbshade merge %s' once all parts are there",
            parts, s->shard, s->shard_count, report->texels, report->invalid_texels, parts);
}

/* Where there are too many for a line each. */
static void say_all(const telling *t, const vsh_bake_job *job, const vsh_bake_report *report) {
    if (t->part || is_each_told(t)) {
        return;
    }
    vsh_job_lightmap first, last;
    vsh_bake_job_lightmap(job, 0, &first);
    vsh_bake_job_lightmap(job, t->count - 1, &last);
    const bool one = strcmp(first.output, last.output) == 0;
    cli_say("%zu lightmaps, %s%s%s: %" PRIu64 " texels, %" PRIu64 " of them invalid; --verbose tells of each",
            t->count, one ? "in " : first.output, one ? "" : " to ", last.output, report->texels,
            report->invalid_texels);
}

static cli_stats make_stats(const vsh_scene *scene, const vsh_bake_report *report, int32_t threads) {
    cli_stats stats = cli_stats_begin(CLI_STATS_TEXELS, threads);
    stats.texels = report->texels;
    stats.invalid_texels = report->invalid_texels;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const int32_t spacing = scene->receivers[i].supersample == 1 ? scene->receivers[i].ao_spacing : 1;
        stats.ao_spacing = i == 0 || spacing < stats.ao_spacing ? spacing : stats.ao_spacing;
    }
    stats.shade = report->shade;
    stats.errors = report->errors;
    stats.lights = scene->lights;
    stats.light_count = scene->light_count;
    stats.seconds[CLI_STAGE_LOAD] = report->load_s;
    stats.seconds[CLI_STAGE_BAKE] = report->bake_s;
    stats.seconds[CLI_STAGE_WRITE] = report->write_s;
    cli_stats_casters(&stats, scene, &report->occluders);
    return stats;
}

/* --- steps */

/* Prints warnings as soon as they are known: what is wrong with the files, before the long work. */
static vsh_result run_job(vsh_bake_job *job, const vsh_scene *scene, const vsh_run *run, vsh_error *error) {
    VSHI_TRY(vsh_bake_job_measure(job, run, error));
    if (vsh_bake_job_count(job) > 0) {
        cli_bake_expect(scene, job, run->threads);
    }
    cli_warnings_tell();
    VSHI_TRY(vsh_bake_job_prepare(job, run, error));
    cli_warnings_tell();
    return vsh_bake_job_run(job, run, error);
}

static int bake_job(const cli_bake_settings *settings, const vsh_scene *scene, vsh_bake_job *job,
                    const vsh_run *run, telling *t, const char *parts) {
    t->count = vsh_bake_job_count(job);
    vsh_error error;
    if ((settings->merged != NULL ? vsh_bake_job_merge(job, run, &error)
                                  : run_job(job, scene, run, &error)) != VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    vsh_bake_report report;
    vsh_bake_job_get_report(job, &report);
    const cli_stats stats = make_stats(scene, &report, run->threads);
    cli_stats_warn(&stats, scene, run);
    CLI_TRY(cli_bake_view(settings, scene, run));
    CLI_TRY(cli_stats_finish(&stats, run, settings->stats));
    cli_warnings_tell();
    if (!settings->common.quiet) {
        say_all(t, job, &report);
        if (t->part) {
            say_part(settings, parts, &report);
        }
        if (t->count > 0) {
            cli_stats_say(&stats);
        }
    }
    return CLI_OK;
}

/* Bakes a scene whose files were checked, or puts its parts together. */
static int bake_scene(const cli_bake_settings *settings, const vsh_scene *scene) {
    const vsh_run run = cli_common_run(&settings->common);
    const bool part = settings->shard > 0;
    telling t = {.common = &settings->common, .part = part};
    vsh_bake_job_options options = vsh_bake_job_options_default();
    options.per_object = settings->per_object;
    options.invalid_picture = settings->invalid_picture;
    options.lit_preview = settings->preview;
    options.lit_exr = settings->exr;
    options.command = cli_parsed_command();
    const char *const files[] = {settings->input, cli_bake_lights(settings)};
    options.files = files;
    options.file_count = settings->lights != NULL ? 2 : 1;
    char *parts = name_parts(settings, scene);
    options.shard = settings->dry_run ? 0 : settings->shard; /* a forecast is of the whole bake */
    options.shard_count = settings->shard_count;
    options.forecast = settings->dry_run;
    options.parts = settings->merged != NULL ? settings->merged : parts;
    options.words = settings->words;
    options.word_count = settings->word_count;
    options.done = say_lightmap;
    options.user = &t;
    vsh_bake_job *job = NULL;
    vsh_error error;
    int code;
    if (parts == NULL) {
        return cli_out_of_memory(settings->input);
    }
    if (vsh_bake_job_create(scene, &options, &run, &job, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
        goto done;
    }
    CLI_TRY_DONE(check_outputs(settings, scene, job));
    code = settings->dry_run ? cli_bake_forecast(scene, job, &run)
                             : bake_job(settings, scene, job, &run, &t, parts);
done:
    vsh_bake_job_free(job);
    free(parts);
    return code;
}

int cli_bake_by(const cli_bake_settings *settings) {
    int code;
    cli_progress_begin(settings->common.progress, settings->common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_make(settings, &made));
    CLI_TRY_DONE(check_files(settings, &made.scene));
    cli_signals_watch();
    code = bake_scene(settings, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}

int cli_bake_main(int argc, char **argv) {
    cli_bake_settings settings;
    bool help;
    int code = cli_bake_parse(argc, argv, &settings, &help);
    code = code != CLI_OK || help ? code : cli_bake_by(&settings);
    cli_densities_free(&settings.densities);
    return code;
}
