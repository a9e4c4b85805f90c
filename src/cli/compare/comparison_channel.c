/* A comparison's channels and problems, as they are found. */
#include "cli/message.h"
#include "comparison_parts.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static const double coverage_limit = 0.001;

bool cli_comparison_add_problem(cli_comparison *c, const char *format, ...) {
    void *more = realloc(c->problems, (c->problem_count + 1) * sizeof *c->problems);
    if (more == NULL) {
        return false;
    }
    c->problems = more;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(c->problems[c->problem_count++], CLI_PROBLEM, format, arguments);
    va_end(arguments);
    return true;
}

cli_channel *cli_comparison_add(cli_comparison *c, const char *name) {
    cli_channel *more = realloc(c->channels, (c->channel_count + 1) * sizeof *more);
    if (more == NULL) {
        return NULL;
    }
    c->channels = more;
    cli_channel *channel = &more[c->channel_count++];
    memset(channel, 0, sizeof *channel);
    snprintf(channel->name, sizeof channel->name, "%s", name);
    return channel;
}

bool cli_channel_alike(const cli_channel *channel) {
    return channel->failed == 0 && !channel->coverage_failed;
}

void cli_comparison_free(cli_comparison *c) {
    for (size_t i = 0; i < c->channel_count; ++i) {
        free(c->channels[i].pictures);
    }
    free(c->channels);
    free(c->problems);
    free(c->name);
    free(c->golden);
    free(c->fresh);
    memset(c, 0, sizeof *c);
}

/* --- limits */

/* Bakes made to one error cast the same rays and have no noise between them. */
static double noise_between(const double max_error[2]) {
    const bool differ = max_error[0] < max_error[1] || max_error[0] > max_error[1]; /* false of NaN */
    return differ ? sqrt(max_error[0] * max_error[0] + max_error[1] * max_error[1]) : 0.0;
}

void cli_channel_set_limits(const compare_work *work, const compare_texts texts[2], cli_channel *channel) {
    const cli_compare_settings *s = work->settings;
    channel->limits = vsh_limits_default();
    for (int which = 0; which < 2; ++which) {
        channel->max_error[which] =
            vsh_provenance_max_error(texts[which].list, texts[which].count, channel->name);
    }
    vsh_limits_allow_noise(&channel->limits, isnan(s->noise) ? noise_between(channel->max_error) : s->noise);
    channel->coverage_limit = coverage_limit;
    vsh_tolerances_apply(work->tolerances, channel->name, &channel->limits, &channel->coverage_limit);
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        channel->limits.value[i] = isnan(s->limits[i]) ? channel->limits.value[i] : s->limits[i];
    }
    vsh_compare_options *options = &channel->limits.options;
    options->threshold = isnan(s->threshold) ? options->threshold : s->threshold;
    options->step = isnan(s->step) ? options->step : s->step;
    options->reach = s->reach < 0 ? options->reach : s->reach;
    channel->coverage_limit = isnan(s->max_coverage) ? channel->coverage_limit : s->max_coverage;
}

/* --- one channel */

int cli_channel_measure(const compare_work *work, cli_channel *channel, const vsh_compared *compared) {
    vsh_run run = work->run;
    const uint64_t given = 2 * sizeof(float) * (uint64_t)compared->size[0] * (uint64_t)compared->size[1] *
                           (uint64_t)compared->size[2]; /* of what is held */
    run.memory_held -= run.memory_held < given ? run.memory_held : given;
    vsh_error error;
    if (vsh_compare(compared, &channel->limits.options, &run, &channel->measures, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    channel->failed = vsh_compare_judge(&channel->measures, &channel->limits);
    if (work->settings->html != NULL) {
        channel->pictures = cli_comparison_pictures(work->settings->html, channel, compared);
        return channel->pictures != NULL ? CLI_OK : CLI_FILE;
    }
    return CLI_OK;
}
