#include "stats.h"

#include "clock.h"
#include "message.h"
#include "signals.h"
#include "temporary.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

static const char *const stage_names[CLI_STAGE_COUNT] = {"load", "voxelize", "field", "bake", "write"};

double cli_stats_stage(cli_stats *stats, int stage, double since) {
    const double now = cli_seconds();
    stats->seconds[stage] += now - since;
    return now;
}

static uint64_t peak_bytes(void) {
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) == 0 ? (uint64_t)usage.ru_maxrss * 1024 : 0;
}

/* Of the field, for each active voxel of the level set. */
static double bytes_per_voxel(const cli_stats *stats) {
    return (double)stats->field.bytes / fmax(1.0, (double)stats->field.active_voxels);
}

static const char *const kind_names[] = {"shadow", "ao"};
enum { KINDS = sizeof kind_names / sizeof kind_names[0] };

static json_t *number_or_null(double value) {
    return isnan(value) ? json_null() : json_real(value);
}

void cli_stats_methods(cli_stats *stats, const vsh_scene *scene) {
    const vsh_shade_options *shade = &scene->shade;
    const int32_t has_triangles = shade->triangles != NULL;
    const int32_t method = vsh_shadow_method_resolve(shade->method, has_triangles);
    const int32_t ao_method = vsh_ao_method_resolve(shade->ao_method, has_triangles);
    stats->max_error = shade->max_error;
    if (scene->light_count > 0) {
        stats->methods[CLI_STATS_SHADOW] = (cli_method){
            vsh_shadow_method_name(method), (vsh_shadow_method_traits(method) & VSH_METHOD_KEEPS_ERROR) != 0};
    }
    if (scene->ao) {
        stats->methods[CLI_STATS_AO] = (cli_method){
            vsh_ao_method_name(ao_method), (vsh_ao_method_traits(ao_method) & VSH_METHOD_KEEPS_ERROR) != 0};
    }
}

double cli_stats_error(const cli_stats *stats, int kind) {
    const double values = stats->estimated_values[kind], ao = stats->shade.ao_square_error;
    const double sum = kind == CLI_STATS_AO ? ao : stats->shade.square_error - ao;
    return values > 0.0 ? sqrt(fmax(0.0, sum) / values) : NAN;
}

const char *cli_stats_methods_text(const cli_stats *stats, char *text, size_t size) {
    const cli_method *shadow = &stats->methods[CLI_STATS_SHADOW], *ao = &stats->methods[CLI_STATS_AO];
    size_t used = 0;
    text[0] = '\0';
    if (shadow->name != NULL) {
        used += (size_t)snprintf(text, size, "shadow %s", shadow->name);
    }
    if (ao->name != NULL && used < size) {
        used += (size_t)snprintf(text + used, size - used, "%sAO %s", used > 0 ? ", " : "", ao->name);
    }
    if ((shadow->keeps_error || ao->keeps_error) && used < size) {
        snprintf(text + used, size - used, ", max error %g", stats->max_error);
    }
    return text;
}

void cli_stats_warn(const cli_stats *stats, const vsh_scene *scene, const vsh_run *run) {
    for (int kind = 0; kind < KINDS; ++kind) {
        const double error = cli_stats_error(stats, kind);
        if (!stats->methods[kind].keeps_error || !(error > stats->max_error) || run->warning == NULL) {
            continue;
        }
        char line[256], help[64];
        if (scene->shade.rays > 0) {
            snprintf(help, sizeof help, "%d rays are too few; leave the limit off", scene->shade.rays);
        } else {
            snprintf(help, sizeof help, "no more rays are taken by the sampler '%s'",
                     vsh_sampler_name(scene->shade.sampler));
        }
        snprintf(line, sizeof line, "%s: an error of %.2g is left, where %g was asked for: %s",
                 kind == CLI_STATS_AO ? "AO" : "shadow", error, stats->max_error, help);
        run->warning(run->user, line);
    }
}

/* What methods that keep an error say of themselves; null where no such method ran. */
static void add_errors(const cli_stats *stats, json_t *root) {
    const double values = stats->estimated_values[CLI_STATS_SHADOW] + stats->estimated_values[CLI_STATS_AO];
    json_object_set_new(
        root, "certified_share",
        number_or_null(values > 0.0 ? 1.0 - fmin(1.0, (double)stats->shade.refined / values) : NAN));
    json_object_set_new(root, "estimated_rmse",
                        number_or_null(values > 0.0 ? sqrt(stats->shade.square_error / values) : NAN));
    json_t *kinds = json_object();
    for (int kind = 0; kind < KINDS; ++kind) {
        const cli_method *method = &stats->methods[kind];
        if (method->name == NULL) {
            continue;
        }
        json_t *of = json_object();
        json_object_set_new(of, "method", json_string(method->name));
        json_object_set_new(of, "max_error", number_or_null(method->keeps_error ? stats->max_error : NAN));
        json_object_set_new(of, "estimated_rmse", number_or_null(cli_stats_error(stats, kind)));
        json_object_set_new(kinds, kind_names[kind], of);
    }
    json_object_set_new(root, "methods", kinds);
}

/* The JSON file. */
static int write_file(const cli_stats *stats, const char *path) {
    json_t *stages = json_object();
    for (int i = 0; i < CLI_STAGE_COUNT; ++i) {
        json_object_set_new(stages, stage_names[i], json_real(stats->seconds[i]));
    }
    typedef struct count {
        const char *name;
        uint64_t value;
    } count;
    const count own[][3] = {
        [CLI_STATS_TEXELS] = {{"texels", stats->texels},
                              {"invalid_texels", stats->invalid_texels},
                              {"bands", stats->bands}},
        [CLI_STATS_POINTS] = {{"points", stats->points},
                              {"bad_rows", stats->bad_rows},
                              {"beyond_reach", stats->shade.beyond_reach}},
        [CLI_STATS_VOXELS] = {{"voxels", stats->voxels},
                              {"inside_voxels", stats->inside_voxels},
                              {"tiles", stats->tiles}},
    };
    const count counts[] = {
        own[stats->of][0],
        own[stats->of][1],
        {"samples", stats->shade.samples},
        {"marches", stats->shade.marches},
        {"certified", stats->shade.certified},
        {"unfinished", stats->shade.unfinished},
        {"skipped", stats->shade.skipped},
        {"rays", stats->shade.rays},
        {"refined", stats->shade.refined},
        {"peak_bytes", peak_bytes()},
        own[stats->of][2],
        {"threads", (uint64_t)stats->threads},
        {"levels", (uint64_t)stats->field.levels},
        {"field_bytes", stats->field.bytes},
        {"active_voxels", stats->grid.active_voxels},
    };
    json_t *root = json_object();
    json_object_set_new(root, "version", json_string(vsh_version()));
    json_object_set_new(root, "stages_s", stages);
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; ++i) {
        json_object_set_new(root, counts[i].name, json_integer((json_int_t)counts[i].value));
    }
    if (stats->of == CLI_STATS_TEXELS) {
        json_object_set_new(root, "resumed_rows", json_integer((json_int_t)stats->resumed_rows));
    }
    add_errors(stats, root);
    json_object_set_new(root, "field_bytes_per_voxel", json_real(bytes_per_voxel(stats)));
    json_object_set_new(root, "voxel_size", json_real(stats->grid.voxel_size));
    char *text = json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    json_decref(root);
    if (text == NULL) {
        cli_say("%s: the system refused memory", path);
        return CLI_LIMIT;
    }
    const int code = cli_temporary_write(path, text);
    free(text);
    return code;
}

cli_stats cli_stats_begin(int32_t of, int32_t threads) {
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return (cli_stats){
        .of = of, .shade = vsh_shade_stats_zero(), .threads = threads > 0 ? threads : (int32_t)cores};
}

int cli_stats_finish(const cli_stats *stats, const char *path) {
    int code = CLI_OK;
    if (path != NULL) {
        cli_signals_writing(path);
        code = write_file(stats, path);
        cli_signals_writing(NULL);
    }
    if (code == CLI_OK) {
        cli_signals_end();
    }
    return code;
}

void cli_stats_say(const cli_stats *stats) {
    char field[32], peak[32];
    if (stats->field.bytes == 0) {
        cli_say("no voxels, %d thread%s, peak %s", stats->threads, stats->threads == 1 ? "" : "s",
                cli_bytes_text(peak_bytes(), peak, sizeof peak));
    } else {
        cli_say("voxel %.4g, %" PRIu64
                " active voxels, field of %d level%s in %s (%.1f bytes a voxel), %d thread%s, "
                "peak %s",
                stats->grid.voxel_size, stats->grid.active_voxels, stats->field.levels,
                stats->field.levels == 1 ? "" : "s", cli_bytes_text(stats->field.bytes, field, sizeof field),
                bytes_per_voxel(stats), stats->threads, stats->threads == 1 ? "" : "s",
                cli_bytes_text(peak_bytes(), peak, sizeof peak));
    }
    char methods[128];
    if (*cli_stats_methods_text(stats, methods, sizeof methods) != '\0') {
        cli_say("%s", methods);
    }
    const double *s = stats->seconds;
    cli_say("load %.2f s, voxelize %.2f s, field %.2f s, %s %.2f s, write %.2f s", s[CLI_STAGE_LOAD],
            s[CLI_STAGE_VOXELIZE], s[CLI_STAGE_FIELD], stats->of == CLI_STATS_POINTS ? "shade" : "bake",
            s[CLI_STAGE_BAKE], s[CLI_STAGE_WRITE]);
}
