/* vdbshade bake: from files to lightmaps. */
#include "base/bytes.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/temporary.h"
#include "cli/warnings.h"
#include "options.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* Whether the page of --view can be written. */
static int check_view(const cli_bake_settings *settings, const vsh_scene *scene) {
    const char *page = settings->view;
    if (page == NULL) {
        return CLI_OK;
    }
    if (!cli_has_ending(page, "html")) {
        return cli_usage("--view '%s': expected a name that ends in .html", page);
    }
    const bool images = settings->per_object && !vsh_lit_is_output(scene->receivers[0].output);
    if (images || scene->receiver_count != 1 || scene->receivers[0].type != VSH_RECEIVER_MESH) {
        return cli_usage("--view '%s': shows one lightmap of one mesh; 'vdbshade view' shows others", page);
    }
    const int32_t unwrap = scene->receivers[0].unwrap;
    if (!vsh_lit_is_output(scene->receivers[0].output) &&
        (unwrap == VSH_RECEIVER_UNWRAP_AUTO || unwrap == VSH_RECEIVER_UNWRAP_ALWAYS)) {
        return cli_usage("--view '%s': an image does not hold the UVs that are made; bake a .glb", page);
    }
    if (cli_has_ending(scene->receivers[0].output, "obj")) {
        return cli_usage("--view '%s': shows what a .glb, a .gltf or an image holds, not an .obj", page);
    }
    if (cli_same_file(page, scene->receivers[0].output) || cli_same_file(page, settings->input)) {
        return cli_usage("--view '%s': is also the input or the output", page);
    }
    return cli_temporary_check(page);
}

/* What can be refused before anything is read. */
static int check_files(const cli_bake_settings *settings, const vsh_scene *scene) {
    if (settings->stats != NULL) {
        CLI_TRY(cli_temporary_check(settings->stats));
    }
    CLI_TRY(check_shard(settings, scene));
    if (settings->invalid_picture != NULL && !cli_has_ending(settings->invalid_picture, "png")) {
        return cli_usage("--invalid '%s': expected a name that ends in .png", settings->invalid_picture);
    }
    CLI_TRY(check_lit(settings, scene));
    CLI_TRY(check_view(settings, scene));
    const bool makes = settings->output_folder != NULL || settings->per_object;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const char *output = scene->receivers[i].output;
        if (makes && settings->dry_run) {
            continue; /* its folder need not be there yet */
        }
        CLI_TRY(makes ? cli_make_folder_of(output) : cli_check_folder(output));
        vsh_error error;
        if (vsh_receiver_check(scene, i, &error) != VSH_OK) {
            return settings->output == NULL && error.code == VSH_ERROR_ARGUMENT
                       ? cli_usage("%s: receivers[%zu]: output %s", settings->input, i, error.message)
                       : cli_fail(&error);
        }
    }
    return CLI_OK;
}

/* --- callbacks */

enum { MOST_LINES = 8 }; /* lightmaps that get a line each */

typedef struct baking {
    const cli_bake_settings *settings;
    const vsh_scene *scene;
    const char *parts; /* the name before ".I-of-N.part" */
    size_t count;      /* lightmaps */
    int code;          /* an exit code of check_outputs() */
    bool files_known;  /* their warnings are not printed yet */
} baking;

/* Checks the outputs again: objects' outputs have their names now, and models their textures. */
static int check_outputs(const baking *b, const vsh_scene_lightmap *lightmaps) {
    const cli_bake_settings *s = b->settings;
    const char *const others[] = {s->stats, s->exr, s->view, s->invalid_picture};
    enum { OTHERS = sizeof others / sizeof others[0] };
    const char **outputs = calloc(b->count + OTHERS, sizeof *outputs);
    size_t count = 0;
    int code;
    for (; count < b->count; ++count) {
        outputs[count] = lightmaps[count].output;
        CLI_TRY_DONE(cli_bake_check_output(s, b->scene, outputs[count]));
    }
    for (size_t i = 0; i < OTHERS; ++i) {
        outputs[count] = others[i];
        count += others[i] != NULL;
    }
    code = cli_bake_check_inputs(b->scene, outputs, count);
done:
    free(outputs);
    return code;
}

static vsh_result check_loaded(void *user, const vsh_scene_lightmap *lightmaps, size_t count,
                               vsh_error *error) {
    (void)error; /* check_outputs() has said why */
    baking *b = user;
    b->count = count;
    b->files_known = true;
    b->code = check_outputs(b, lightmaps);
    return b->code == CLI_OK ? VSH_OK : VSH_ERROR_CANCELLED;
}

/* Prints the warnings about files before the long work. */
static int32_t report_progress(void *user, const char *stage, double fraction) {
    baking *b = user;
    if (b->files_known && strcmp(stage, "bake") == 0) {
        b->files_known = false;
        cli_warnings_tell();
    }
    return cli_progress_report(NULL, stage, fraction);
}

static bool has_lines(const baking *b) {
    return b->settings->shard == 0 && (b->count <= MOST_LINES || cli_given.verbose);
}

static void say_lightmap(void *user, const vsh_scene_lightmap *lightmap) {
    const baking *b = user;
    if (has_lines(b) && !cli_given.quiet) {
        cli_say("%s: %d × %d, %" PRIu64 " texels, %" PRIu64 " of them invalid", lightmap->output,
                lightmap->width, lightmap->height, lightmap->covered, lightmap->invalid_texels);
    }
}

/* --- reports */

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

/* Writes the page that shows the bake. */
static int write_view(const cli_bake_settings *settings, const vsh_scene *scene, const vsh_run *run) {
    const vsh_receiver *receiver = &scene->receivers[0];
    if (settings->view == NULL) {
        return CLI_OK;
    }
    vsh_view_bake bake = vsh_view_bake_default();
    if (cli_has_ending(receiver->output, "glb gltf")) {
        bake.model = receiver->output; /* its light is in it */
    } else {
        bake.model = receiver->path;
        bake.planes = (const char *const *)&receiver->output;
        bake.plane_count = 1;
        bake.uv_set = receiver->uv_set;
    }
    vsh_error error;
    return cli_check_result(vsh_view_write(settings->view, &bake, NULL, run, &error), &error);
}

static int report_bake(const baking *b, const vsh_bake_report *report, const vsh_run *run) {
    const cli_bake_settings *s = b->settings;
    const cli_stats stats = make_stats(b->scene, report, run->threads);
    cli_stats_warn(&stats, b->scene, run);
    CLI_TRY(write_view(s, b->scene, run));
    CLI_TRY(cli_stats_finish(&stats, run, s->stats));
    cli_warnings_tell();
    if (cli_given.quiet) {
        return CLI_OK;
    }
    if (s->shard > 0) {
        cli_say("%s.%d-of-%d.part: %" PRIu64 " texels, %" PRIu64
                " of them invalid; 'vdbshade merge %s' once all parts are there",
                b->parts, s->shard, s->shard_count, report->texels, report->invalid_texels, b->parts);
    } else if (!has_lines(b)) {
        cli_say("%zu lightmaps: %" PRIu64 " texels, %" PRIu64 " of them invalid; --verbose lists each",
                b->count, report->texels, report->invalid_texels);
    }
    if (b->count > 0) {
        cli_stats_say(&stats);
    }
    return CLI_OK;
}

static int run_bake(const baking *b, const vsh_bake_options *options, const vsh_run *run) {
    const bool merges = b->settings->merged != NULL;
    vsh_bake_report report = {.errors = calloc(b->scene->light_count + 2, sizeof *report.errors)};
    vsh_error error;
    const vsh_result result =
        (merges ? vsh_merge_scene : vsh_bake_scene)(b->scene, options, run, &report, &error);
    const int code = b->code != CLI_OK  ? b->code
                     : result != VSH_OK ? cli_fail_of(NULL, &error)
                                        : report_bake(b, &report, run);
    free(report.errors);
    return code;
}

static int print_forecast(const baking *b, const vsh_bake_options *options, const vsh_run *run) {
    vsh_bake_forecast f;
    vsh_error error;
    const vsh_result result = vsh_forecast_scene(b->scene, options, run, &f, &error);
    if (b->code != CLI_OK || result != VSH_OK) {
        return b->code != CLI_OK ? b->code : cli_fail_of(NULL, &error);
    }
    cli_stats stats = {.of = CLI_STATS_TEXELS};
    char methods[128], grid[32], field[32], peak[32];
    cli_stats_methods(&stats, b->scene, f.has_triangles);
    printf("methods       %s\n", cli_stats_methods_text(&stats, methods, sizeof methods));
    printf("texels        %" PRIu64 " in %zu lightmap%s, %" PRIu64 " samples\n", f.texels, f.lightmap_count,
           f.lightmap_count == 1 ? "" : "s", f.samples);
    if (f.voxels == 0.0) {
        printf("voxels        none\n");
    } else {
        printf("voxels        about %.3g of %.4g, %.4g along the longest side\n", f.voxels, f.voxel_size,
               f.resolution);
    }
    printf("memory        about %s at most: level set %s, field %s\n",
           vshi_bytes_text((uint64_t)f.peak_bytes, peak, sizeof peak),
           vshi_bytes_text((uint64_t)f.grid_bytes, grid, sizeof grid),
           vshi_bytes_text((uint64_t)f.field_bytes, field, sizeof field));
    return CLI_OK;
}

/* Bakes a scene whose options were checked, or merges its parts, or forecasts the bake. */
static int bake_scene(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *output = s->output != NULL ? s->output : scene->receivers[0].output;
    baking b = {.settings = s, .scene = scene};
    b.parts = s->merged != NULL ? s->merged : cli_end_path(output, ""); /* it may be a folder, of objects */
    vsh_run run = cli_make_run();
    run.progress = report_progress;
    run.user = &b;
    const char *const files[] = {s->input, cli_bake_lights(s)};
    vsh_bake_options options = vsh_bake_options_default();
    options.invalid_picture = s->invalid_picture;
    options.lit_preview = s->preview;
    options.lit_exr = s->exr;
    options.command = cli_parsed_command();
    options.files = files;
    options.file_count = s->lights != NULL ? 2 : 1;
    options.shard = s->dry_run ? 0 : s->shard; /* a forecast is of the whole bake */
    options.shard_count = s->shard_count;
    options.parts = b.parts;
    options.words = s->words;
    options.word_count = s->word_count;
    options.loaded = check_loaded;
    options.done = say_lightmap;
    options.user = &b;
    return s->dry_run ? print_forecast(&b, &options, &run) : run_bake(&b, &options, &run);
}

int cli_bake_by(const cli_bake_settings *settings) {
    int code;
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_make(settings, &made));
    CLI_TRY_DONE(check_files(settings, &made.scene));
    cli_signals_watch();
    code = bake_scene(settings, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}
