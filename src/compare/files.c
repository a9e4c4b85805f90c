/* Two files, of one kind or not: images, or grids. */
#include "compare/files.h"

#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/try.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>
#include <vdbshade/provenance.h>

static const double COVERAGE_LIMIT = 0.001;

static vsh_result no_memory(const vshi_compare_work *work, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", work->path[0]);
}

vsh_result vshi_compare_problem(const vshi_compare_work *work, vsh_error *error, const char *format, ...) {
    vsh_comparison *c = work->comparison;
    void *more = realloc(c->problems, (c->problem_count + 1) * sizeof *c->problems);
    if (more == NULL) {
        return no_memory(work, error);
    }
    c->problems = more;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(c->problems[c->problem_count++], sizeof *c->problems, format, arguments);
    va_end(arguments);
    return VSH_OK;
}

/* --- one channel */

/* A channel's method, error, sampler and frame, in the file's words. */
static const char *method_of(const vshi_texts *texts, const char *channel) {
    char name[VSH_CHANNEL_NAME + 16];
    snprintf(name, sizeof name, "vdbshade_%.*s", (int)strcspn(channel, "."), channel);
    size_t i = 0;
    while (i < texts->count && strcmp(texts->list[i].name, name) != 0) {
        ++i;
    }
    return i < texts->count ? texts->list[i].value : "";
}

/* Bakes made in one way cast the same rays and have no noise between them. */
static double noise_between(const vshi_texts texts[2], const char *channel, const double max_error[2]) {
    const bool known = !isnan(max_error[0]) && !isnan(max_error[1]);
    const bool differ = strcmp(method_of(&texts[0], channel), method_of(&texts[1], channel)) != 0;
    return known && differ ? sqrt(max_error[0] * max_error[0] + max_error[1] * max_error[1]) : 0.0;
}

static void set_limits(const vshi_compare_work *work, const vshi_texts texts[2],
                       vsh_channel_comparison *channel) {
    const vsh_compare_files_options *o = &work->options;
    channel->limits = vsh_limits_default();
    for (int which = 0; which < 2; ++which) {
        channel->max_error[which] =
            vsh_provenance_max_error(texts[which].list, texts[which].count, channel->name);
    }
    vsh_limits_allow_noise(&channel->limits, isnan(o->noise)
                                                 ? noise_between(texts, channel->name, channel->max_error)
                                                 : o->noise);
    channel->coverage_limit = COVERAGE_LIMIT;
    vsh_tolerances_apply(work->tolerances, channel->name, &channel->limits, &channel->coverage_limit);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        channel->limits.value[i] = isnan(o->limits[i]) ? channel->limits.value[i] : o->limits[i];
    }
    vsh_compare_options *options = &channel->limits.options;
    options->threshold = isnan(o->threshold) ? options->threshold : o->threshold;
    options->step = isnan(o->step) ? options->step : o->step;
    options->reach = o->reach < 0 ? options->reach : o->reach;
    channel->coverage_limit = isnan(o->coverage_limit) ? channel->coverage_limit : o->coverage_limit;
}

vsh_result vshi_compare_channel(const vshi_compare_work *work, const char *name, const vshi_texts texts[2],
                                vsh_channel_comparison **channel, vsh_error *error) {
    vsh_comparison *c = work->comparison;
    vsh_channel_comparison *more = realloc(c->channels, (c->channel_count + 1) * sizeof *more);
    if (more == NULL) {
        return no_memory(work, error);
    }
    c->channels = more;
    *channel = &more[c->channel_count++];
    memset(*channel, 0, sizeof **channel);
    snprintf((*channel)->name, sizeof(*channel)->name, "%s", name);
    set_limits(work, texts, *channel);
    return VSH_OK;
}

vsh_result vshi_compare_measure(const vshi_compare_work *work, vsh_channel_comparison *channel,
                                const vsh_compared *compared, vsh_error *error) {
    vsh_run run = work->run;
    const uint64_t given = 2 * sizeof(float) * (uint64_t)compared->size[0] * (uint64_t)compared->size[1] *
                           (uint64_t)compared->size[2]; /* of what is held */
    run.memory_held -= run.memory_held < given ? run.memory_held : given;
    VSHI_TRY(vsh_compare(compared, &channel->limits.options, &run, &channel->measures, error));
    channel->failed = vsh_compare_judge(&channel->measures, &channel->limits);
    if (work->options.look != NULL &&
        work->options.look(work->options.user, work->comparison->channel_count - 1, channel, compared) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "%s: comparing was stopped", work->path[1]);
    }
    return VSH_OK;
}

/* --- both files */

static vsh_result read_tolerances(vshi_compare_work *work, vsh_error *error) {
    char path[4096];
    const char *file = work->options.tolerances;
    if (file == NULL) {
        if (snprintf(path, sizeof path, "%s.tolerance.json", work->path[0]) >= (int)sizeof path ||
            access(path, F_OK) != 0) {
            return VSH_OK;
        }
        file = path;
    }
    return vsh_tolerances_read(file, &work->tolerances, error);
}

/* One name for each format. */
static const char *format_of(const char *path) {
    static const struct {
        const char *ending, *format;
    } other[] = {{"tiff", "tif"}, {"jpeg", "jpg"},  {"jpe", "jpg"},  {"jif", "jpg"}, {"jfif", "jpg"},
                 {"jfi", "jpg"},  {"heif", "heic"}, {"rgbe", "hdr"}, {"j2k", "jp2"}};
    const char *ending = vshi_path_ending(path);
    for (size_t i = 0; i < sizeof other / sizeof other[0]; ++i) {
        if (strcasecmp(other[i].ending, ending) == 0) {
            return other[i].format;
        }
    }
    return ending;
}

static vsh_result compare(vshi_compare_work *work, vsh_error *error) {
    VSHI_TRY(read_tolerances(work, error));
    const char *was = format_of(work->path[0]), *is = format_of(work->path[1]);
    if (strcasecmp(was, is) != 0) {
        VSHI_TRY(vshi_compare_problem(work, error, "format: golden is '%.100s', new is '%.100s'", was, is));
    }
    const bool grids = strcasecmp(was, "vdb") == 0;
    if (grids == (strcasecmp(is, "vdb") == 0)) {
        VSHI_TRY(grids ? vshi_compare_grids(work, error) : vshi_compare_images(work, error));
    }
    vsh_comparison *c = work->comparison;
    c->alike = c->problem_count == 0;
    for (size_t i = 0; i < c->channel_count; ++i) {
        vsh_channel_comparison *channel = &c->channels[i];
        channel->alike = channel->failed == 0 && !channel->coverage_failed;
        c->alike = c->alike && channel->alike;
    }
    return VSH_OK;
}

vsh_result vsh_compare_files(const char *golden, const char *fresh, const vsh_compare_files_options *options,
                             const vsh_run *run, vsh_comparison **comparison, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(comparison);
    *comparison = NULL;
    VSHI_NEEDS(golden);
    VSHI_NEEDS(fresh);
    vshi_compare_work work = {.path = {golden, fresh}, .options = vsh_compare_files_options_default()};
    VSHI_TRY(vshi_run_resolve(run, &work.run, error));
    if (options != NULL) {
        VSHI_TRY(vshi_options_resolve(options, &work.options, sizeof work.options, "options", error));
    }
    work.comparison = calloc(1, sizeof *work.comparison);
    if (work.comparison == NULL) {
        return no_memory(&work, error);
    }
    const vsh_result result = compare(&work, error);
    vsh_tolerances_free(work.tolerances);
    if (result != VSH_OK) {
        vsh_comparison_free(work.comparison);
        return result;
    }
    *comparison = work.comparison;
    return VSH_OK;
}

int32_t vsh_comparison_alike(const vsh_comparison *comparison) {
    return comparison != NULL && comparison->alike;
}

const vsh_channel_comparison *vsh_comparison_channel(const vsh_comparison *comparison, size_t index) {
    return comparison != NULL && index < comparison->channel_count ? &comparison->channels[index] : NULL;
}

const char *vsh_comparison_problem(const vsh_comparison *comparison, size_t index) {
    return comparison != NULL && index < comparison->problem_count ? comparison->problems[index] : NULL;
}

void vsh_comparison_free(vsh_comparison *comparison) {
    if (comparison != NULL) {
        free(comparison->channels);
        free(comparison->problems);
        free(comparison);
    }
}
