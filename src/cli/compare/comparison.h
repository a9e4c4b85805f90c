/* Two baked files, compared: what `compare` and `regress` do, and how it is told. */
#ifndef CLI_COMPARISON_H
#define CLI_COMPARISON_H

#include "cli/options.h"

#include <jansson.h>
#include <stdio.h>

/* --- what is asked */

typedef struct cli_compare_settings {
    cli_common common;
    vsh_compare_files_options options;
    bool json; /* on standard output, in place of lines */
    const char *junit, *html;
} cli_compare_settings;

cli_compare_settings cli_compare_settings_default(void);

/* Keys of the options below, and of each measure's limit in the order of measures. */
enum {
    CLI_KEY_TOLERANCES = 0x4000,
    CLI_KEY_COVERAGE,
    CLI_KEY_MAX_COVERAGE,
    CLI_KEY_THRESHOLD,
    CLI_KEY_STEP,
    CLI_KEY_REACH,
    CLI_KEY_NOISE,
    CLI_KEY_COMPARE_PADDING,
    CLI_KEY_JSON,
    CLI_KEY_JUNIT,
    CLI_KEY_HTML,
    CLI_KEY_LIMIT /* + measure; the last */
};

#define CLI_REPORT_OPTIONS                                                                                   \
    {CLI_KEY_JSON, "json", NULL, "everything as JSON on standard output, in place of lines"},                \
        {CLI_KEY_JUNIT, "junit", "FILE.xml", "write a JUnit report, a test case a channel"}, {               \
        CLI_KEY_HTML, "html", "FILE.html", "write a page: golden, new, difference, measures"                 \
    }

#define CLI_COMPARE_OPTIONS                                                                                  \
    {0, NULL, NULL, "What is compared"},                                                                     \
        {CLI_KEY_COVERAGE, "coverage", "NAME", "channel that tells covered texels, or none (A)"},            \
        {CLI_KEY_COMPARE_PADDING, "padding", NULL, "compare texels that are not covered too"},               \
        {0, NULL, NULL, "Limits, over those of the tolerance file"},                                         \
        {CLI_KEY_MAX_COVERAGE, "max-coverage", "SHARE",                                                      \
         "covered texels that may be in one file alone (0.001)"},                                            \
        {CLI_KEY_LIMIT + VSH_MEASURE_RMSE, "max-rmse", "X", "root mean square difference (0.004)"},          \
        {CLI_KEY_LIMIT + VSH_MEASURE_BIAS, "max-bias", "X", "mean difference, either way (0.002)"},          \
        {CLI_KEY_LIMIT + VSH_MEASURE_MAX, "max-difference", "X", "largest difference (0.25)"},               \
        {CLI_KEY_LIMIT + VSH_MEASURE_P99, "max-p99", "X", "99th percentile of differences (0.02)"},          \
        {CLI_KEY_LIMIT + VSH_MEASURE_SHARE, "max-share", "X",                                                \
         "share of values that differ by more than the threshold\n(0.01)"},                                  \
        {CLI_KEY_LIMIT + VSH_MEASURE_SSIM, "min-ssim", "X", "structural similarity, at least (0.98)"},       \
        {CLI_KEY_LIMIT + VSH_MEASURE_PENUMBRA, "max-penumbra", "X",                                          \
         "penumbrae wider or narrower, as a share (0.03)"},                                                  \
        {CLI_KEY_LIMIT + VSH_MEASURE_WIDTHS, "max-widths", "X",                                              \
         "mean difference of their widths, as a share (0.05)"},                                              \
        {CLI_KEY_LIMIT + VSH_MEASURE_EDGES, "max-edges", "X",                                                \
         "share of shadow edges that have no counterpart (0.02)"},                                           \
        {CLI_KEY_LIMIT + VSH_MEASURE_SHIFT, "max-shift", "TEXELS", "displacement (0.1)"},                    \
        {CLI_KEY_LIMIT + VSH_MEASURE_LOST, "max-lost", "TEXELS",                                             \
         "size of a region that lost its shadow (3)"},                                                       \
        {CLI_KEY_LIMIT + VSH_MEASURE_GAINED, "max-gained", "TEXELS", "… that got one (3)"},                  \
        {CLI_KEY_THRESHOLD, "threshold", "X", "of --max-share, 0 to 1 (0.02)"},                              \
        {CLI_KEY_STEP, "step", "X", "of --max-lost: what is farther off counts, to 1 (0.1)"},                \
        {CLI_KEY_REACH, "reach", "TEXELS",                                                                   \
         "of --max-lost: what is found so far off is not lost,\n0 to 16 (2)"},                               \
    {                                                                                                        \
        CLI_KEY_NOISE, "noise", "X",                                                                         \
            "standard error between the two, which limits that are\nnot given allow for (by the max errors " \
            "of the files where\nthese differ, else 0)"                                                      \
    }

/* Takes an option of these, or a common one. */
int cli_compare_parse(cli_compare_settings *settings, int key, const char *name, const char *value);

/* Refuses reports that replace one of `inputs`, or each other, or cannot be written. */
int cli_compare_check_reports(const cli_compare_settings *settings, const char *const *inputs, size_t count);

/* --- what comes out */

enum { CLI_PROBLEM = 320 };

typedef struct cli_comparison {
    char *name; /* of a scene; NULL: the files' */
    char *golden, *fresh;
    vsh_comparison *made; /* NULL: nothing was compared */
    char **pictures;      /* [picture_count]: HTML of each channel; NULL: none */
    size_t picture_count;
    char problem[CLI_PROBLEM]; /* that is none of the files'; "": none */
    bool alike;
} cli_comparison;

/* Compares. CLI_OK whether they are alike or not; else an exit code, having said why. Free in each case. */
int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *comparison);
void cli_comparison_free(cli_comparison *comparison);

/* What is not alike without being values, from index 0; NULL behind the last. */
const char *cli_comparison_problem(const cli_comparison *comparison, size_t index);

/* --- how it is told */

/* What is wrong with a channel in words, by what names the fault best first; "" where nothing is. */
void cli_channel_explain(const vsh_channel_comparison *channel, char *text, size_t capacity);

/* Place of a value: "(3, 4)". */
const char *cli_channel_place(const vsh_channel_comparison *channel, uint64_t index, char text[64]);

/* A line a channel and problem, each after `prefix`. */
void cli_comparison_print(FILE *out, const cli_comparison *comparison, const char *prefix);

/* A new reference; NULL where memory is short. */
json_t *cli_comparison_json(const cli_comparison *comparison);

/* The reports that were asked for, of one comparison or many. CLI_OK or an exit code, having said why. */
int cli_comparison_report(const cli_compare_settings *settings, const cli_comparison *comparisons,
                          size_t count);

/* Golden, new and difference as HTML; `page` is where it will stand. NULL where memory is short or, having
 * said why, a file could not be written. */
char *cli_comparison_pictures(const char *page, const vsh_channel_comparison *channel,
                              const vsh_compared *compared);

#endif
