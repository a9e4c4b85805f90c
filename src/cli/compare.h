/* Two baked files, compared and reported: shared by `compare` and `regress`. */
#pragma once

#include "cli.h"

typedef struct cli_compare_settings {
    vsh_compare_files_options options;
    bool json; /* on standard output, instead of text */
    bool padding;
    const char *junit, *html;
    const char *title; /* of the page */
    double began;      /* seconds */
} cli_compare_settings;

/* Options of commands whose settings begin with cli_compare_settings; `tolerances` is the help of one. */
#define CLI_LIMIT_OPTION(name, placeholder, help, measure)                                                   \
    { name, placeholder, help, CLI_RANGE(NUMBER, cli_compare_settings, options.limits[measure], 0.0, 1e15) }

#define CLI_COMPARE_OPTIONS(tolerances_help)                                                                 \
    {.help = "Reports"},                                                                                     \
        {"json", NULL, "print everything as JSON instead of text",                                           \
         CLI_VALUE(FLAG, cli_compare_settings, json)},                                                       \
        {"junit", "FILE.xml", "write a JUnit report, a test case a channel",                                 \
         CLI_VALUE(TEXT, cli_compare_settings, junit)},                                                      \
        {"html", "FILE.html", "write a page: golden, new, difference, measures",                             \
         CLI_VALUE(TEXT, cli_compare_settings, html)},                                                       \
        {.help = "What is compared"},                                                                        \
        {"coverage", "NAME", "channel with the coverage, or none (A)",                                       \
         CLI_VALUE(TEXT, cli_compare_settings, options.coverage)},                                           \
        {"padding", NULL, "compare texels that are not covered, too",                                        \
         CLI_VALUE(FLAG, cli_compare_settings, padding)},                                                    \
        {.help = "Limits, instead of those of the tolerance file"},                                          \
        {"max-coverage", "SHARE", "covered texels that may be in one file alone (0.001)",                    \
         CLI_RANGE(NUMBER, cli_compare_settings, options.coverage_limit, 0.0, 1.0)},                         \
        CLI_LIMIT_OPTION("max-shift", "TEXELS", "displacement (0.1)", VSH_MEASURE_SHIFT),                    \
        CLI_LIMIT_OPTION("max-penumbra", "X", "wider or narrower penumbrae, as a share (0.03)",              \
                         VSH_MEASURE_PENUMBRA),                                                              \
        CLI_LIMIT_OPTION("max-lost", "TEXELS", "size of a region that lost its shadow (3)",                  \
                         VSH_MEASURE_LOST),                                                                  \
        CLI_LIMIT_OPTION("max-gained", "TEXELS", "size of a region that gained a shadow (3)",                \
                         VSH_MEASURE_GAINED),                                                                \
        CLI_LIMIT_OPTION("max-rmse", "X", "root mean square difference (0.004)", VSH_MEASURE_RMSE),          \
        CLI_LIMIT_OPTION("max-p99", "X", "99th percentile of differences (0.02)", VSH_MEASURE_P99),          \
        CLI_LIMIT_OPTION("max-difference", "X", "largest difference (0.25)", VSH_MEASURE_MAX),               \
        {"step", "X", "least difference of a lost or gained texel, to 1 (0.1)",                              \
         CLI_RANGE(NUMBER, cli_compare_settings, options.step, 1e-6, 1.0)},                                  \
        {"reach", "TEXELS", "shadows that moved so far are not lost, 0 to 16 (2)",                           \
         CLI_RANGE(INTEGER, cli_compare_settings, options.reach, 0, 16)},                                    \
        {"noise", "X",                                                                                       \
         "standard error between the two, which widens default limits (from the max errors in the files "    \
         "where these differ, else 0)",                                                                      \
         CLI_RANGE(NUMBER, cli_compare_settings, options.noise, 0.0, 1.0)},                                  \
    {                                                                                                        \
        "tolerances", "FILE.json", tolerances_help,                                                          \
            CLI_VALUE(TEXT, cli_compare_settings, options.tolerances)                                        \
    }

typedef struct cli_comparison {
    const char *name; /* of the scene's output; NULL: use the files' names */
    char *golden, *fresh;
    vsh_comparison *made; /* NULL: nothing was compared */
    char **pictures;      /* [picture_count]: HTML of each channel, or NULL */
    size_t picture_count;
    const char *problem; /* instead of a comparison; NULL: none */
    bool alike;
} cli_comparison;

/* Compares two files; CLI_OK whether they are alike or not. Free the comparison even after a failure. */
int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *comparison);
void cli_comparison_free(cli_comparison *comparison);

/* Returns problem `index` other than values; NULL after the last. */
const char *cli_comparison_problem(const cli_comparison *comparison, size_t index);

/* Prints a line for each problem and channel, each after `prefix`. */
void cli_comparison_print(const cli_comparison *comparison, const char *prefix);

/* Returns a new reference. */
json_t *cli_comparison_json(const cli_comparison *comparison);

/* Writes the JUnit and HTML reports of the settings. */
int cli_comparison_report(const cli_compare_settings *settings, const cli_comparison *comparisons,
                          size_t count);
