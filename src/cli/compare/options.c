/* The options that `compare` and `regress` share. */
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/temporary.h"
#include "comparison.h"

cli_compare_settings cli_compare_settings_default(void) {
    cli_compare_settings s = {.common = cli_common_default(), .options = vsh_compare_files_options_default()};
    return s;
}

int cli_compare_take(cli_compare_settings *s, int key, const char *name, const char *value) {
    if (key >= CLI_KEY_LIMIT && key < CLI_KEY_LIMIT + VSH_MEASURE_COUNT) {
        const int32_t measure = key - CLI_KEY_LIMIT;
        const bool least = vsh_measure_at_least(measure) != 0;
        return cli_take_number(name, value, least ? -1.0 : 0.0, least ? 1.0 : 1e15,
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
        return cli_take_number(name, value, 0.0, 1.0, &s->options.coverage_limit);
    case CLI_KEY_THRESHOLD:
        return cli_take_number(name, value, 0.0, 1.0, &s->options.threshold);
    case CLI_KEY_STEP:
        return cli_take_number(name, value, 1e-6, 1.0, &s->options.step);
    case CLI_KEY_REACH:
        return cli_take_integer(name, value, 0, 16, &s->options.reach);
    case CLI_KEY_NOISE:
        return cli_take_number(name, value, 0.0, 1.0, &s->options.noise);
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
    return cli_common_take(&s->common, key, name, value, &taken);
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
