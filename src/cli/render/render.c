/* vdbshade render: pictures of a scene, to look at what bake makes of it. */
#include "render.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/try.h"
#include "cli/warnings.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct render_work {
    const render_settings *settings;
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    vsh_occluders *occluders;
    render_surfaces surfaces;
    render_lightmaps lightmaps;
    vsh_lit_meshes *lit; /* of lightmaps, and of surfaces */
    vsh_render_options options;
    cli_provenance origin;
    render_picture picture;
    cli_stats stats;
} render_work;

static int load(render_work *work) {
    const double start = vshi_seconds();
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_assets_load(work->scene, &work->run, &work->assets, &error), &error));
    CLI_TRY(render_lightmaps_read(work->settings, work->scene, work->assets, &work->run, &work->lightmaps));
    cli_stats_stage(&work->stats, CLI_STAGE_LOAD, start);
    return CLI_OK;
}

static int make_occluders(render_work *work) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = render_shows_fields(work->scene, work->assets);
    vsh_error error;
    if (vsh_scene_occluders(work->scene, work->assets, &what, &work->run, &work->occluders, &error) !=
        VSH_OK) {
        return cli_fail_of(NULL, &error);
    }
    vsh_occluders_info casters;
    vsh_occluders_get_info(work->occluders, &casters);
    cli_stats_casters(&work->stats, work->scene, &casters);
    const double start = vshi_seconds();
    const int code =
        render_surfaces_make(work->scene, work->assets, work->occluders, &work->run, &work->surfaces);
    cli_stats_stage(&work->stats, CLI_STAGE_FIELD, start);
    return code;
}

/* Meshes with lightmaps first: where both are, they are what is seen. */
static int join_lit(render_work *work) {
    const size_t count = work->lightmaps.count, more = work->surfaces.mesh_count;
    work->lit = calloc(count + more + 1, sizeof *work->lit);
    if (work->lit == NULL) {
        return cli_out_of_memory("meshes");
    }
    if (count > 0) {
        memcpy(work->lit, work->lightmaps.lit, count * sizeof *work->lit);
    }
    if (more > 0) {
        memcpy(work->lit + count, work->surfaces.meshes, more * sizeof *work->lit);
    }
    work->options.lit = work->lit;
    work->options.lit_count = count + more;
    return CLI_OK;
}

static int set_options(render_work *work) {
    const render_settings *s = work->settings;
    vsh_render_options *o = &work->options;
    *o = vsh_render_options_default();
    o->width = s->width;
    o->height = s->height;
    o->samples = s->samples;
    o->ao = work->scene->ao;
    memcpy(o->sky, s->has_sky || !work->scene->has_ambient ? s->sky : work->scene->ambient, sizeof o->sky);
    for (int c = 0; c < 3 && work->scene->light_count == 0 && !s->has_sky && !work->scene->has_ambient; ++c) {
        o->sky[c] = 1.0; /* all the light there is */
    }
    o->tint = work->scene->tint;
    memcpy(o->background, s->background, sizeof o->background);
    o->shafts = s->shafts;
    o->shaft_steps = s->shaft_steps;
    o->shade = work->scene->shade;
    if (!work->scene->ao) {
        o->shade.ao_method = VSH_AO_AUTO; /* no rays are cast: exact may lack its triangles */
    }
    CLI_TRY(join_lit(work));
    return render_camera_place(s, &work->surfaces, o);
}

/* The file that a message is of which begins with "lightmap N: ", as vsh_render() counts them; else NULL. */
static const char *lightmap_named(const render_settings *s, const char *message) {
    size_t index;
    return sscanf(message, "lightmap %zu: ", &index) == 1 && index < s->lightmap_count ? s->lightmaps[index]
                                                                                       : NULL;
}

static int draw_picture(render_work *work) {
    const render_settings *s = work->settings;
    CLI_TRY(render_picture_create(s, &work->origin, &work->picture));
    double start = vshi_seconds();
    vsh_error error;
    const vsh_result result = vsh_render(work->surfaces.surfaces, work->surfaces.count, work->occluders,
                                         work->scene->lights, work->scene->light_count, &work->options,
                                         &work->run, &work->picture.picture, &work->stats.shade, &error);
    start = cli_stats_stage(&work->stats, CLI_STAGE_BAKE, start);
    if (result != VSH_OK) {
        return cli_fail_of(lightmap_named(s, error.message), &error);
    }
    work->stats.points += (uint64_t)s->width * (uint64_t)s->height * (uint64_t)(s->samples * s->samples);
    const int code = render_output_write(s, &work->picture);
    cli_stats_stage(&work->stats, CLI_STAGE_WRITE, start);
    return code;
}

/* Lightmaps that are shown are inputs, too, and so is a file whose lights are taken. */
static int find_origin(render_work *work) {
    const render_settings *s = work->settings;
    const char *files[2 + RENDER_MOST_LIGHTMAPS] = {s->bake.input, cli_bake_lights(&s->bake)};
    memcpy(files + 2, s->lightmaps, s->lightmap_count * sizeof *files);
    return cli_provenance_make(work->scene, files, 2 + s->lightmap_count, &work->stats.casters, &work->run,
                               &work->origin);
}

static void say_results(const render_work *work) {
    const render_settings *s = work->settings;
    if (s->bake.common.quiet) {
        return;
    }
    if (work->stats.shade.unfinished > 0) {
        cli_warn("%" PRIu64 " rays ran out of steps; use larger voxels", work->stats.shade.unfinished);
    }
    const double *at = work->options.camera.position, *to = work->options.camera.target;
    cli_say("%s: %d × %d, camera %.5g,%.5g,%.5g looking at %.5g,%.5g,%.5g", s->bake.output, s->width,
            s->height, at[0], at[1], at[2], to[0], to[1], to[2]);
    cli_stats_say(&work->stats);
}

static int run_render(const render_settings *s, vsh_scene *scene) {
    render_work work = {.settings = s, .scene = scene, .run = cli_common_run(&s->bake.common)};
    work.run.memory_held += render_picture_bytes(s);
    work.stats = cli_stats_begin(CLI_STATS_POINTS, work.run.threads);
    int code;
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(make_occluders(&work));
    CLI_TRY_DONE(set_options(&work));
    CLI_TRY_DONE(find_origin(&work));
    CLI_TRY_DONE(draw_picture(&work));
    CLI_TRY_DONE(cli_stats_finish(&work.stats, &work.run, s->bake.stats));
    say_results(&work);
done:
    render_picture_free(&work.picture);
    cli_provenance_free(&work.origin);
    free(work.lit);
    render_lightmaps_free(&work.lightmaps);
    render_surfaces_free(&work.surfaces);
    vsh_occluders_free(work.occluders);
    vsh_assets_free(work.assets);
    return code;
}

/* What can be refused before anything is read but the scene. */
static int check_files(const render_settings *s, const vsh_scene *scene) {
    CLI_TRY(cli_bake_check_output(&s->bake, scene, s->bake.output));
    CLI_TRY(cli_bake_check_inputs(&s->bake, scene, &s->bake.output, 1));
    if (s->bake.stats != NULL) {
        CLI_TRY(cli_bake_check_output(&s->bake, scene, s->bake.stats));
        CLI_TRY(cli_bake_check_inputs(&s->bake, scene, &s->bake.stats, 1));
    }
    if (scene->light_count == 0 && !scene->ao && s->lightmap_count == 0) {
        return cli_usage("%s: no lights and no ao; give --sun X,Y,Z or --ao DISTANCE, or both",
                         s->bake.input);
    }
    const uint64_t limit = s->bake.common.memory_limit, bytes = render_picture_bytes(s);
    if (limit > 0 && bytes > limit) {
        char all[32], most[32];
        cli_say("%s: a picture of %d × %d needs %s, over the memory limit of %s", s->bake.output, s->width,
                s->height, vshi_bytes_text(bytes, all, sizeof all),
                vshi_bytes_text(limit, most, sizeof most));
        return CLI_LIMIT;
    }
    return CLI_OK;
}

int cli_render_main(int argc, char **argv) {
    render_settings s;
    bool help;
    int code = render_parse(argc, argv, &s, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(s.bake.common.progress, s.bake.common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    if (s.lightmap_count > 0) {
        CLI_TRY_DONE(cli_bake_scene_receivers(&s.bake, &made));
    }
    CLI_TRY_DONE(check_files(&s, &made.scene));
    cli_signals_watch();
    code = run_render(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}
