/* vdbshade compare: compares a bake with its golden one, and explains the differences in words. */
#include "cli/commands.h"
#include "cli/compare/comparison.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const cli_option options[] = {
    {0, NULL, NULL, "Reports"},
    CLI_REPORT_OPTIONS,
    CLI_COMPARE_OPTIONS,
    {CLI_TEXT(cli_compare_settings, options.tolerances), "tolerances", "FILE.json",
     "limits, also for single channels\n(GOLDEN.tolerance.json if it exists)"},
    CLI_COMMON_OPTIONS,
};

static int compare_main(int argc, char **argv);

const cli_command cli_compare = {
    "compare",
    "GOLDEN NEW [options]",
    "Compares two images channel by channel, or two .vdb files grid by grid, over the texels that both\n"
    "cover: values, widths of penumbrae, displacement, lost shadows. Prints one line a channel. Ends with\n"
    "0 if they are alike, and with 1 if not, or if size, channels, voxels or format differ. For the\n"
    "measures see docs/pipeline.md. Numbers in brackets are defaults.",
    options,
    sizeof options / sizeof options[0],
    compare_main};

void cli_print_json(json_t *root) {
    json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
    json_decref(root);
    putchar('\n');
}

static int compare_main(int argc, char **argv) {
    cli_compare_settings s = cli_compare_settings_default();
    const char *files[2];
    CLI_TRY(cli_parse(&cli_compare, argc, argv, cli_compare_parse, &s, files));
    int code;
    cli_comparison comparison = {.alike = false};
    CLI_TRY_DONE(cli_compare_check_reports(&s, files, 2));
    cli_signals_watch();
    CLI_TRY_DONE(cli_comparison_make(&s, files[0], files[1], &comparison));
    CLI_TRY_DONE(cli_comparison_report(&s, &comparison, 1));
    if (s.json) {
        cli_print_json(cli_comparison_json(&comparison));
    } else if (!cli_given.quiet) {
        cli_comparison_print(&comparison, "");
    }
    code = comparison.alike ? CLI_OK : CLI_UNLIKE;
    cli_signals_end(code);
done:
    cli_comparison_free(&comparison);
    return code;
}

/* --- options */

cli_compare_settings cli_compare_settings_default(void) {
    cli_compare_settings s = {.options = vsh_compare_files_options_default()};
    return s;
}

int cli_compare_parse(void *settings, int key, const char *name, const char *value) {
    cli_compare_settings *s = settings;
    if (key >= CLI_KEY_LIMIT && key < CLI_KEY_LIMIT + VSH_MEASURE_COUNT) {
        return cli_parse_number(name, value, 0.0, 1e15, &s->options.limits[key - CLI_KEY_LIMIT]);
    }
    switch (key) {
    case CLI_KEY_MAX_COVERAGE:
        return cli_parse_number(name, value, 0.0, 1.0, &s->options.coverage_limit);
    case CLI_KEY_STEP:
        return cli_parse_number(name, value, 1e-6, 1.0, &s->options.step);
    case CLI_KEY_REACH:
        return cli_parse_integer(name, value, 0, 16, &s->options.reach);
    case CLI_KEY_NOISE:
        return cli_parse_number(name, value, 0.0, 1.0, &s->options.noise);
    default: /* --padding */
        s->options.padding = 1;
        return CLI_OK;
    }
}

int cli_compare_check_reports(const cli_compare_settings *s, const char *const *inputs, size_t count) {
    const char *const reports[] = {s->junit, s->html};
    if (s->junit != NULL && s->html != NULL && cli_same_file(s->junit, s->html)) {
        return cli_usage("%s: both the --junit and the --html file", s->html);
    }
    for (size_t r = 0; r < sizeof reports / sizeof reports[0]; ++r) {
        for (size_t i = 0; reports[r] != NULL && i < count; ++i) {
            if (cli_same_file(reports[r], inputs[i])) {
                return cli_usage("%s: the report is an input", reports[r]);
            }
        }
        CLI_TRY(reports[r] != NULL ? cli_temporary_check(reports[r]) : CLI_OK);
    }
    return CLI_OK;
}

/* --- comparing */

/* Draws a channel. Channels that are not measured, before it, have no pictures. */
static int32_t draw(void *user, size_t index, const vsh_channel_comparison *channel,
                    const vsh_compared *compared) {
    cli_comparison *c = user;
    c->pictures = realloc(c->pictures, (index + 1) * sizeof *c->pictures);
    while (c->picture_count < index) {
        c->pictures[c->picture_count++] = NULL;
    }
    c->pictures[c->picture_count++] = cli_comparison_pictures(channel, compared);
    return 0;
}

int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *c) {
    *c = (cli_comparison){.golden = strdup(golden), .fresh = strdup(fresh)};
    const vsh_run run = cli_make_run();
    vsh_compare_files_options wanted = settings->options;
    wanted.look = settings->html != NULL ? draw : NULL;
    wanted.user = c;
    vsh_error error;
    CLI_TRY(cli_check(vsh_compare_files(golden, fresh, &wanted, &run, &c->made, &error), &error));
    c->alike = vsh_comparison_alike(c->made) != 0;
    return CLI_OK;
}

const char *cli_comparison_problem(const cli_comparison *c, size_t index) {
    if (c->problem[0] != '\0') {
        return index == 0 ? c->problem : NULL;
    }
    return vsh_comparison_problem(c->made, index);
}

void cli_comparison_free(cli_comparison *c) {
    for (size_t i = 0; i < c->picture_count; ++i) {
        free(c->pictures[i]);
    }
    free(c->pictures);
    vsh_comparison_free(c->made);
    free(c->name);
    free(c->golden);
    free(c->fresh);
    memset(c, 0, sizeof *c);
}

/* --- words */

void cli_channel_position(const vsh_channel_comparison *channel, uint64_t index, int32_t position[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        const uint64_t size = axis < 2 ? (uint64_t)channel->size[axis] : UINT64_MAX;
        position[axis] = (int32_t)(index % size) + channel->origin[axis];
        index /= size;
    }
}

static bool is_flat(const vsh_channel_comparison *channel) {
    return channel->size[2] == 1 && channel->origin[2] == 0;
}

const char *cli_channel_place(const vsh_channel_comparison *channel, uint64_t index, char place[64]) {
    int32_t at[3];
    cli_channel_position(channel, index, at);
    snprintf(place, 64, is_flat(channel) ? "(%d, %d)" : "(%d, %d, %d)", at[0], at[1], at[2]);
    return place;
}

static const char *texel(const vsh_channel_comparison *channel) {
    return is_flat(channel) ? "texel" : "voxel";
}

static void add_nonfinite(FILE *out, const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    char place[64];
    for (int which = 0; which < 2; ++which) {
        if (m->nonfinite[which] > 0) {
            fprintf(out, "%s%" PRIu64 " %s value%s NaN or infinite, the first at %s",
                    which > 0 && m->nonfinite[0] > 0 ? ", " : "", m->nonfinite[which],
                    which == 0 ? "golden" : "new", m->nonfinite[which] == 1 ? " is" : "s are",
                    cli_channel_place(channel, m->nonfinite_first[which], place));
        }
    }
}

static void add_region(FILE *out, const vsh_channel_comparison *channel, const vsh_region *region,
                       double limit, const char *caster) {
    const uint32_t others = UINT32_C(1) << VSH_MEASURE_SHIFT | UINT32_C(1) << VSH_MEASURE_PENUMBRA;
    char place[64];
    fprintf(out, "%" PRIu64 " %ss around %s got %s by up to %.2f with nothing like it nearby%s (limit %g)",
            region->count, texel(channel), cli_channel_place(channel, region->worst, place),
            region->by > 0.0 ? "lighter" : "darker", fabs(region->by),
            (channel->failed & others) == 0 ? caster : "", limit);
}

static void add_failure(FILE *out, const vsh_channel_comparison *channel, int measure) {
    const vsh_measures *m = &channel->measures;
    const double limit = channel->limits.value[measure];
    switch (measure) {
    case VSH_MEASURE_NONFINITE:
        add_nonfinite(out, channel);
        break;
    case VSH_MEASURE_LOST:
        add_region(out, channel, &m->lost, limit, ": a lost caster?");
        break;
    case VSH_MEASURE_GAINED:
        add_region(out, channel, &m->gained, limit, ": a new caster?");
        break;
    case VSH_MEASURE_SHIFT:
        fprintf(out, "shifted by (%.2f, %.2f", m->shift[0], m->shift[1]);
        fprintf(out, channel->size[2] > 1 ? ", %.2f)" : ")", m->shift[2]);
        fprintf(out, " %ss, which explains %.0f %% of the difference (limit %g)", texel(channel),
                100.0 * m->explained, limit);
        break;
    case VSH_MEASURE_PENUMBRA:
        fprintf(out, "penumbrae %.3f times as wide, %.2f for %.2f %ss (limit ±%g %%)",
                m->width[1] / m->width[0], m->width[1], m->width[0], texel(channel), 100.0 * limit);
        break;
    default:
        fprintf(out, "%s %.3g (limit %g)", vsh_get_name(VSH_NAMES_MEASURE, measure), m->value[measure],
                limit);
    }
}

/* Names noise or a curve if it explains most of the difference. */
static bool add_cause(FILE *out, const vsh_channel_comparison *channel, const char *separator) {
    const vsh_measures *m = &channel->measures;
    if (m->curve[2][0] > 0.0) {
        fprintf(out,
                "%svalues follow a curve that takes %.2f, %.2f, %.2f to %.2f, %.2f, %.2f: gamma or exposure?",
                separator, m->curve[0][0], m->curve[1][0], m->curve[2][0], m->curve[0][1], m->curve[1][1],
                m->curve[2][1]);
        return true;
    }
    if (m->noise_share >= 0.5 && m->noise > channel->limits.options.noise) {
        fprintf(out, "%snoise of %.3g, which is %.0f %% of the squared difference", separator, m->noise,
                100.0 * m->noise_share);
        return true;
    }
    return false;
}

void cli_channel_explain(const vsh_channel_comparison *channel, char text[CLI_EXPLANATION]) {
    FILE *out = fmemopen(text, CLI_EXPLANATION - 1, "w");
    text[0] = text[CLI_EXPLANATION - 1] = '\0'; /* no stream ends an empty or a full text */
    const char *separator = "";
    if (channel->coverage_failed) {
        const vsh_coverage *c = &channel->coverage;
        char place[64];
        fprintf(out, "coverage differs in %" PRIu64 " %ss, %.3g of those covered, the first at %s (limit %g)",
                c->differs, texel(channel), c->share, cli_channel_place(channel, c->first, place),
                channel->coverage_limit);
        separator = "; ";
    }
    if (!channel->is_coverage && channel->measures.count == 0) {
        fprintf(out, "%snothing is covered in both: nothing was compared", separator);
        if (channel->measures.nonfinite[0] + channel->measures.nonfinite[1] > 0) {
            fputs("; ", out);
            add_nonfinite(out, channel);
        }
    } else if (!channel->is_coverage && channel->failed != 0) {
        if (add_cause(out, channel, separator)) {
            separator = "; ";
        }
        for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
            if ((channel->failed >> i & 1) != 0) {
                fputs(separator, out);
                add_failure(out, channel, i);
                separator = "; ";
            }
        }
    }
    fclose(out);
}

/* --- lines */

static void print_measures(const vsh_channel_comparison *channel) {
    const vsh_measures *m = &channel->measures;
    const char *separator = "; ";
    char place[64];
    for (int i = VSH_MEASURE_NONFINITE + 1; i < VSH_MEASURE_COUNT; ++i) {
        if (!isnan(m->value[i])) {
            printf("%s%s %.3g", separator, vsh_get_name(VSH_NAMES_MEASURE, i), m->value[i]);
            separator = ", ";
        }
    }
    printf(" at %s", cli_channel_place(channel, m->worst, place));
}

static void print_noise(const vsh_channel_comparison *channel) {
    const double *made_to = channel->max_error;
    printf("; noise of %.3g is allowed for", channel->limits.options.noise);
    if (!isnan(made_to[0]) && !isnan(made_to[1])) {
        printf(" (made to max errors %.3g and %.3g)", made_to[0], made_to[1]);
    }
}

static void print_channel(const vsh_channel_comparison *channel) {
    char what[CLI_EXPLANATION];
    cli_channel_explain(channel, what);
    printf("%s: %s%s%s", channel->name, channel->alike ? "alike" : "not alike", what[0] != '\0' ? ": " : "",
           what);
    if (!channel->is_coverage && channel->limits.options.noise > 0.0) {
        print_noise(channel);
    }
    if (channel->is_coverage) {
        printf("; %" PRIu64 " and %" PRIu64 " covered, %" PRIu64 " in one alone", channel->coverage.golden,
               channel->coverage.values, channel->coverage.differs);
    } else if (channel->measures.count > 0) {
        print_measures(channel);
    }
}

void cli_comparison_print(const cli_comparison *c, const char *prefix) {
    const char *problem;
    const vsh_channel_comparison *channel;
    for (size_t i = 0; (problem = cli_comparison_problem(c, i)) != NULL; ++i) {
        printf("%snot alike: %s\n", prefix, problem);
    }
    for (size_t i = 0; (channel = vsh_comparison_channel(c->made, i)) != NULL; ++i) {
        fputs(prefix, stdout);
        print_channel(channel);
        putchar('\n');
    }
}
