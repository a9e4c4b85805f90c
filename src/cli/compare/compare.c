/* vdbshade compare: whether a bake is like its golden one. */
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"
#include "comparison.h"

#include <stdlib.h>

static const cli_option options[] = {
    {0, NULL, NULL, "Reports"},
    CLI_REPORT_OPTIONS,
    CLI_COMPARE_OPTIONS,
    {CLI_KEY_TOLERANCES, "tolerances", "FILE.json",
     "limits, also for single channels\n(GOLDEN.tolerance.json where it is there)"},
    CLI_COMMON_OPTIONS,
};

static int compare_main(int argc, char **argv);

const cli_command cli_compare = {
    "compare",
    "GOLDEN NEW [options]",
    "Compares two images or two .vdb files, channel by channel and grid by grid, over the texels that\n"
    "both cover: values, structure, widths of penumbrae, displacement, lost shadows. One line a channel.\n"
    "Ends with 0 where they are alike, 1 where they are not: also by size, channels, voxels or format,\n"
    "which are told as such. What the measures are: docs/regression.md. Numbers in brackets are what\n"
    "holds without the option.",
    options,
    sizeof options / sizeof options[0],
    compare_main};

static int take(void *settings, int key, const char *name, const char *value) {
    return cli_compare_parse(settings, key, name, value);
}

static int print(const cli_compare_settings *s, const cli_comparison *c) {
    if (s->json) {
        json_t *root = cli_comparison_json(c);
        const bool whole =
            root != NULL && json_dumpf(root, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(9)) == 0;
        json_decref(root);
        putchar('\n');
        return whole ? CLI_OK : cli_out_of_memory(c->golden);
    }
    if (!s->common.quiet) {
        cli_comparison_print(stdout, c, "");
    }
    return CLI_OK;
}

static int compare_main(int argc, char **argv) {
    cli_compare_settings s = cli_compare_settings_default();
    static const char *const what[2] = {"GOLDEN", "NEW"};
    const char *files[2];
    bool help;
    int code = cli_parse_operands(&cli_compare, argc, argv, take, &s, what, files, 2, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(s.common.progress, s.common.quiet);
    code = cli_compare_check_reports(&s, files, 2);
    cli_comparison comparison = {.alike = false};
    if (code == CLI_OK) {
        cli_signals_watch();
        code = cli_comparison_make(&s, files[0], files[1], &comparison);
    }
    code = code == CLI_OK ? cli_comparison_report(&s, &comparison, 1) : code;
    code = code == CLI_OK ? print(&s, &comparison) : code;
    if (code == CLI_OK) {
        code = comparison.alike ? CLI_OK : CLI_UNLIKE;
        cli_signals_end(code);
    }
    cli_comparison_free(&comparison);
    cli_progress_end();
    return code;
}

/* --- what `regress` has too */

cli_compare_settings cli_compare_settings_default(void) {
    cli_compare_settings s = {.common = cli_common_default(), .options = vsh_compare_files_options_default()};
    return s;
}

int cli_compare_parse(cli_compare_settings *s, int key, const char *name, const char *value) {
    if (key >= CLI_KEY_LIMIT && key < CLI_KEY_LIMIT + VSH_MEASURE_COUNT) {
        const int32_t measure = key - CLI_KEY_LIMIT;
        const bool least = vsh_measure_at_least(measure) != 0;
        return cli_parse_number(name, value, least ? -1.0 : 0.0, least ? 1.0 : 1e15,
                                &s->options.limits[measure]);
    }
    switch (key) {
    case CLI_KEY_TOLERANCES:
        s->options.tolerances = value;
        return CLI_OK;
    case CLI_KEY_COVERAGE:
        s->options.coverage = value;
        return CLI_OK;
    case CLI_KEY_MAX_COVERAGE:
        return cli_parse_number(name, value, 0.0, 1.0, &s->options.coverage_limit);
    case CLI_KEY_THRESHOLD:
        return cli_parse_number(name, value, 0.0, 1.0, &s->options.threshold);
    case CLI_KEY_STEP:
        return cli_parse_number(name, value, 1e-6, 1.0, &s->options.step);
    case CLI_KEY_REACH:
        return cli_parse_integer(name, value, 0, 16, &s->options.reach);
    case CLI_KEY_NOISE:
        return cli_parse_number(name, value, 0.0, 1.0, &s->options.noise);
    case CLI_KEY_COMPARE_PADDING:
        s->options.padding = 1;
        return CLI_OK;
    case CLI_KEY_JSON:
        s->json = true;
        return CLI_OK;
    case CLI_KEY_JUNIT:
        s->junit = value;
        return CLI_OK;
    case CLI_KEY_HTML:
        s->html = value;
        return CLI_OK;
    default:
        break;
    }
    bool taken;
    return cli_common_parse(&s->common, key, name, value, &taken);
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
        const int code = reports[r] != NULL ? cli_temporary_check(reports[r]) : CLI_OK;
        if (code != CLI_OK) {
            return code;
        }
    }
    return CLI_OK;
}
