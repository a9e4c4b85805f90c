/* Statistics of a bake: the file of --stats, the summary, warnings; and the provenance of outputs. */
#include "base/clock.h"
#include "base/memory.h"
#include "cli.h"

#include <unistd.h>

static const char *const stage_names[CLI_STAGES] = {"load", "voxelize", "field", "bake", "write"};

void cli_stats_lap(cli_stats *stats, int stage) {
    const double now = vshi_seconds();
    stats->seconds[stage] += now - stats->lap;
    stats->lap = now;
}

/* Returns the field's bytes for each active voxel of the level set. */
static double bytes_per_voxel(const cli_stats *stats) {
    return (double)stats->casters.field_bytes / fmax(1.0, (double)stats->casters.active_voxels);
}

static const struct {
    const char *name;   /* in the file */
    const char *word;   /* in messages */
    const char *option; /* that chooses its method */
} kinds[CLI_STATS_KINDS] = {
    [CLI_STATS_SHADOW] = {"shadow", "shadow", "--method"},
    [CLI_STATS_AO] = {"ao", "AO", "--ao-method"},
    [CLI_STATS_SKY] = {"sky", "sky", "--ao-method"},
};

static cli_method method_of(const char *name, uint32_t traits) {
    return (cli_method){name, (traits & VSH_METHOD_KEEPS_ERROR) != 0, (traits & VSH_METHOD_TRIANGLES) != 0};
}

void cli_stats_casters(cli_stats *stats, const vsh_scene *scene, const vsh_occluders_info *casters) {
    stats->casters = *casters;
    stats->seconds[CLI_STAGE_VOXELIZE] += stats->casters.voxelize_s;
    stats->seconds[CLI_STAGE_FIELD] += stats->casters.triangles_s + stats->casters.field_s;
    stats->lap = vshi_seconds();
    cli_stats_methods(stats, scene, stats->casters.has_triangles);
}

void cli_stats_methods(cli_stats *stats, const vsh_scene *scene, int32_t has_triangles) {
    const vsh_shade_options *shade = &scene->shade;
    const int32_t method = shade->method != VSH_SHADOW_AUTO ? shade->method
                           : has_triangles                  ? (int32_t)VSH_SHADOW_EXACT
                                                            : (int32_t)VSH_SHADOW_ADAPTIVE;
    const int32_t ao_method = shade->ao_method != VSH_AO_AUTO ? shade->ao_method
                              : has_triangles                 ? (int32_t)VSH_AO_EXACT
                                                              : (int32_t)VSH_AO_ADAPTIVE;
    stats->max_error = shade->max_error;
    if (scene->light_count > 0) {
        stats->methods[CLI_STATS_SHADOW] =
            method_of(vsh_get_name(VSH_NAMES_SHADOW, method), vsh_method_traits(VSH_NAMES_SHADOW, method));
    }
    const cli_method open =
        method_of(vsh_get_name(VSH_NAMES_AO, ao_method), vsh_method_traits(VSH_NAMES_AO, ao_method));
    if (scene->ao) {
        stats->methods[CLI_STATS_AO] = open;
    }
    if (stats->of == CLI_STATS_TEXELS && scene->planes.sky != VSH_UP_NONE) {
        stats->methods[CLI_STATS_SKY] = open;
    }
}

/* Returns the kind of a channel by its place among the errors. */
static int kind_of(const cli_stats *stats, size_t channel) {
    return channel < stats->light_count ? CLI_STATS_SHADOW
                                        : CLI_STATS_AO + (int)(channel - stats->light_count);
}

/* Sums the errors of a kind's values over all lights. */
static vsh_bake_error sum_errors(const cli_stats *stats, int kind) {
    vsh_bake_error sum = {0.0, 0.0, 0.0, 0.0, 0.0};
    for (size_t i = 0; stats->errors != NULL && i < stats->light_count + 2; ++i) {
        if (kind_of(stats, i) != kind) {
            continue;
        }
        sum.values += stats->errors[i].values;
        sum.square_error += stats->errors[i].square_error;
        sum.compared += stats->errors[i].compared;
        sum.compared_square_error += stats->errors[i].compared_square_error;
        sum.worst = fmax(sum.worst, stats->errors[i].worst);
    }
    return sum;
}

const char *cli_stats_methods_text(const cli_stats *stats) {
    const char *text = "";
    bool keeps_error = false;
    for (int kind = 0; kind < CLI_STATS_KINDS; ++kind) {
        const cli_method *method = &stats->methods[kind];
        if (method->name != NULL) {
            text =
                cli_keep_text("%s%s%s %s", text, *text != '\0' ? ", " : "", kinds[kind].word, method->name);
        }
        keeps_error = keeps_error || method->keeps_error;
    }
    return keeps_error ? cli_keep_text("%s, max error %g", text, stats->max_error) : text;
}

/* Tells what would make the error of a kind smaller. */
static const char *find_advice(const cli_stats *stats, const vsh_scene *scene, int kind) {
    const vsh_bake_error known = sum_errors(stats, kind);
    const bool by_rays = sqrt(known.square_error / known.values) > stats->max_error;
    if (by_rays && scene->shade.rays > 0) {
        return cli_keep_text("%d rays are too few; raise --rays, or leave it off", scene->shade.rays);
    }
    if (by_rays && scene->shade.sampler != VSH_SAMPLER_SOBOL) {
        return cli_keep_text("the sampler '%s' has no more rays; set \"sampler\": \"sobol\" in the scene",
                             vsh_get_name(VSH_NAMES_SAMPLER, scene->shade.sampler));
    }
    if (by_rays || stats->methods[kind].traces) {
        return cli_keep_text("--max-error %.1g keeps it", 0.5 * stats->max_error);
    }
    bool can = false; /* a mesh or a procedural shape, which rays can meet */
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const int32_t type = scene->casters[i].type;
        can = can || (type != VSH_CASTER_VDB && type != VSH_CASTER_MASK && type != VSH_CASTER_TEXT);
    }
    return cli_keep_text("%.3g of it comes from voxels of %.3g; %s%ssmaller ones leave less",
                         vsh_bake_error_field(&known), stats->casters.voxel_size,
                         can ? kinds[kind].option : "", can ? " exact has none, " : "");
}

void cli_stats_warn(const cli_stats *stats, const vsh_scene *scene) {
    for (int kind = 0; kind < CLI_STATS_KINDS; ++kind) {
        const vsh_bake_error known = sum_errors(stats, kind);
        const double error = vsh_bake_error_rmse(&known);
        if (stats->methods[kind].keeps_error && error > stats->max_error) {
            cli_warn("%s: the estimated error is %.3g, above the limit of %g: %s", kinds[kind].word, error,
                     stats->max_error, find_advice(stats, scene, kind));
        }
    }
}

static void set_error(json_t *of, const vsh_bake_error *known) {
    json_object_set_new(of, "estimated_rmse", cli_number_json(vsh_bake_error_rmse(known)));
    json_object_set_new(of, "field_rmse", cli_number_json(vsh_bake_error_field(known)));
    json_object_set_new(of, "worst_error", cli_number_json(known->values > 0.0 ? known->worst : NAN));
}

static json_t *list_channels(const cli_stats *stats) {
    json_t *channels = json_array();
    for (size_t i = 0; stats->errors != NULL && i < stats->light_count + 2; ++i) {
        const int kind = kind_of(stats, i);
        const char *name =
            kind == CLI_STATS_SHADOW ? cli_keep_text("shadow.%s", stats->lights[i].name) : kinds[kind].name;
        if (stats->methods[kind].name != NULL) {
            json_t *of = json_pack("{s:o}", "name", cli_utf8_json(name));
            set_error(of, &stats->errors[i]);
            json_array_append_new(channels, of);
        }
    }
    return channels;
}

static json_t *list_methods(const cli_stats *stats) {
    json_t *methods = json_object();
    for (int kind = 0; kind < CLI_STATS_KINDS; ++kind) {
        const cli_method *method = &stats->methods[kind];
        if (method->name != NULL) {
            const vsh_bake_error known = sum_errors(stats, kind);
            json_t *of = json_pack("{s:s,s:o}", "method", method->name, "max_error",
                                   cli_number_json(method->keeps_error ? stats->max_error : NAN));
            set_error(of, &known);
            json_object_set_new(methods, kinds[kind].name, of);
        }
    }
    return methods;
}

/* Adds errors by their estimates; null if no method estimates any. */
static void add_errors(const cli_stats *stats, json_t *root) {
    double values = 0.0, square = 0.0;
    for (int kind = 0; kind < CLI_STATS_KINDS; ++kind) {
        const vsh_bake_error known = sum_errors(stats, kind);
        const double error = known.values > 0.0 ? vsh_bake_error_rmse(&known) : 0.0;
        values += known.values;
        square += known.values * error * error;
    }
    const double certified = 1.0 - fmin(1.0, (double)stats->shade.refined / values);
    json_object_set_new(root, "certified_share", cli_number_json(values > 0.0 ? certified : NAN));
    json_object_set_new(root, "rays_per_value", cli_number_json((double)stats->shade.rays / values));
    json_object_set_new(root, "estimated_rmse", cli_number_json(sqrt(square / values)));
    json_object_set_new(root, "methods", list_methods(stats));
    json_object_set_new(root, "channels", list_channels(stats));
}

/* Describes how a reader is confined here; null if files were read without one (--sandbox off). */
static json_t *describe_confinement(void) {
    vsh_run quiet = cli_run;
    quiet.progress = NULL;
    uint32_t confined = 0;
    if (cli_run.reader == NULL || vsh_reader_confinement(&quiet, &confined, &cli_error) != VSH_OK) {
        return json_null();
    }
    return json_pack("{s:b,s:b,s:b}", "limits", confined & VSH_CONFINED_LIMITS, "calls",
                     confined & VSH_CONFINED_CALLS, "files", confined & VSH_CONFINED_FILES);
}

static int write_file(const cli_stats *stats, const char *path) {
    const struct {
        const char *name;
        uint64_t value;
        int of; /* CLI_STATS_…; -1: any */
    } counts[] = {
        {"texels", stats->texels, CLI_STATS_TEXELS},
        {"invalid_texels", stats->invalid_texels, CLI_STATS_TEXELS},
        {"points", stats->points, CLI_STATS_POINTS},
        {"bad_rows", stats->bad_rows, CLI_STATS_POINTS},
        {"beyond_reach", stats->shade.beyond_reach, CLI_STATS_POINTS},
        {"voxels", stats->voxels, CLI_STATS_VOXELS},
        {"inside_voxels", stats->inside_voxels, CLI_STATS_VOXELS},
        {"tiles", stats->tiles, CLI_STATS_VOXELS},
        {"samples", stats->shade.samples, -1},
        {"marches", stats->shade.marches, -1},
        {"certified", stats->shade.certified, -1},
        {"unfinished", stats->shade.unfinished, -1},
        {"skipped", stats->shade.skipped, -1},
        {"rays", stats->shade.rays, -1},
        {"refined", stats->shade.refined, -1},
        {"peak_bytes", vshi_peak_bytes(), -1},
        {"threads", (uint64_t)stats->threads, -1},
        {"levels", (uint64_t)stats->casters.levels, -1},
        {"field_bytes", stats->casters.field_bytes, -1},
        {"active_voxels", stats->casters.active_voxels, -1},
    };
    json_t *stages = json_object();
    for (int i = 0; i < CLI_STAGES; ++i) {
        json_object_set_new(stages, stage_names[i], json_real(stats->seconds[i]));
    }
    json_t *root = json_pack("{s:s,s:o}", "version", vsh_version(), "stages_s", stages);
    for (size_t i = 0; i < CLI_COUNT(counts); ++i) {
        if (counts[i].of < 0 || counts[i].of == stats->of) {
            json_object_set_new(root, counts[i].name, json_integer((json_int_t)counts[i].value));
        }
    }
    add_errors(stats, root);
    json_object_set_new(root, "confined", describe_confinement());
    json_object_set_new(root, "field_bytes_per_voxel", json_real(bytes_per_voxel(stats)));
    json_object_set_new(root, "voxel_size", json_real(stats->casters.voxel_size));
    return cli_write_json(path, root);
}

cli_stats cli_stats_begin(int of) {
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return (cli_stats){.of = of,
                       .lap = vshi_seconds(),
                       .shade = vsh_shade_stats_zero(),
                       .threads = cli_run.threads > 0 ? cli_run.threads : (int32_t)cores};
}

int cli_stats_finish(const cli_stats *stats, const char *path) {
    CLI_TRY(path != NULL ? write_file(stats, path) : CLI_OK);
    cli_signals_end(CLI_OK);
    return CLI_OK;
}

/* Prints "estimated error: shadow 0.0123 (the voxels' 0.012; worst 0.05), AO 0.0071 (worst 0.02)". */
static void say_errors(const cli_stats *stats) {
    const char *text = "";
    for (int kind = 0; kind < CLI_STATS_KINDS; ++kind) {
        const vsh_bake_error known = sum_errors(stats, kind);
        const double error = vsh_bake_error_rmse(&known), field = vsh_bake_error_field(&known);
        if (!isnan(error)) {
            text = cli_keep_text(
                "%s%s%s %.3g (%sworst %.3g)", text, *text != '\0' ? ", " : "", kinds[kind].word, error,
                isnan(field) || stats->methods[kind].traces ? "" : cli_keep_text("the voxels' %.3g; ", field),
                known.worst);
        }
    }
    if (*text != '\0') {
        cli_inform("estimated error: %s", text);
    }
}

void cli_stats_say(const cli_stats *stats) {
    const char *voxels = "no voxels", *methods = cli_stats_methods_text(stats);
    const vsh_occluders_info *casters = &stats->casters;
    double values = 0.0;
    for (int kind = 0; kind < CLI_STATS_KINDS; ++kind) {
        values += sum_errors(stats, kind).values;
    }
    if (casters->field_bytes > 0) {
        voxels = cli_keep_text(
            "voxel %.4g, %" PRIu64 " active voxels, field of %d level%s in %s (%.1f bytes a voxel)",
            casters->voxel_size, casters->active_voxels, casters->levels, casters->levels == 1 ? "" : "s",
            cli_bytes_text(casters->field_bytes), bytes_per_voxel(stats));
    }
    cli_inform("%s, %d thread%s, peak %s", voxels, stats->threads, stats->threads == 1 ? "" : "s",
               cli_bytes_text(vshi_peak_bytes()));
    if (*methods != '\0') {
        cli_inform("%s%s", methods,
                   values > 0.0 ? cli_keep_text("; %.3g rays a value", (double)stats->shade.rays / values)
                                : "");
    }
    say_errors(stats);
    const double *s = stats->seconds;
    cli_inform("load %.2f s, voxelize %.2f s, field %.2f s, %s %.2f s, write %.2f s", s[CLI_STAGE_LOAD],
               s[CLI_STAGE_VOXELIZE], s[CLI_STAGE_FIELD], stats->of == CLI_STATS_POINTS ? "shade" : "bake",
               s[CLI_STAGE_BAKE], s[CLI_STAGE_WRITE]);
}

void cli_say_auto_ao(const vsh_scene *scene, double distance) {
    if (scene->ao != 0 && scene->shade.ao_distance == 0.0) {
        cli_inform("AO within %g: a twelfth of the diagonal of casters and receivers", distance);
    }
}

/* --- provenance */

int cli_provenance_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                        const vsh_occluders_info *casters, cli_provenance *origin) {
    *origin = (cli_provenance){NULL, NULL, 0};
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = scene;
    source.command = cli_parsed.command;
    if (casters != NULL) {
        source.voxel_size = casters->voxel_size;
        source.has_triangles = casters->has_triangles;
    }
    source.files = files;
    source.file_count = file_count;
    CLI_TRY(cli_check(vsh_provenance_create(&source, &cli_run, &origin->made, &cli_error)));
    origin->attributes = vsh_provenance_attributes(origin->made, &origin->count);
    return CLI_OK;
}

void cli_provenance_free(cli_provenance *origin) {
    vsh_provenance_free(origin->made);
    *origin = (cli_provenance){NULL, NULL, 0};
}
