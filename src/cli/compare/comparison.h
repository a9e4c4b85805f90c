/* Two baked files, compared and reported: shared by `compare` and `regress`. */
#ifndef CLI_COMPARISON_H
#define CLI_COMPARISON_H

#include "cli/options.h"

#include <jansson.h>

typedef struct cli_compare_settings {
    vsh_compare_files_options options;
    bool json; /* on standard output, instead of text */
    const char *junit, *html;
} cli_compare_settings;

cli_compare_settings cli_compare_settings_default(void);

enum {
    CLI_KEY_MAX_COVERAGE = 0x4000,
    CLI_KEY_STEP,
    CLI_KEY_REACH,
    CLI_KEY_NOISE,
    CLI_KEY_COMPARE_PADDING,
    CLI_KEY_LIMIT /* + measure; the last */
};

/* Options of commands whose settings are cli_compare_settings, or begin with them. */
#define CLI_REPORT_OPTIONS                                                                                   \
    {CLI_FLAG(cli_compare_settings, json), "json", NULL, "print everything as JSON instead of text"},        \
        {CLI_TEXT(cli_compare_settings, junit), "junit", "FILE.xml",                                         \
         "write a JUnit report, a test case a channel"},                                                     \
    {                                                                                                        \
        CLI_TEXT(cli_compare_settings, html), "html", "FILE.html",                                           \
            "write a page: golden, new, difference, measures"                                                \
    }

#define CLI_COMPARE_OPTIONS                                                                                  \
    {0, NULL, NULL, "What is compared"},                                                                     \
        {CLI_TEXT(cli_compare_settings, options.coverage), "coverage", "NAME",                               \
         "channel with the coverage, or none (A)"},                                                          \
        {CLI_KEY_COMPARE_PADDING, "padding", NULL, "compare texels that are not covered, too"},              \
        {0, NULL, NULL, "Limits, instead of those of the tolerance file"},                                   \
        {CLI_KEY_MAX_COVERAGE, "max-coverage", "SHARE",                                                      \
         "covered texels that may be in one file alone (0.001)"},                                            \
        {CLI_KEY_LIMIT + VSH_MEASURE_SHIFT, "max-shift", "TEXELS", "displacement (0.1)"},                    \
        {CLI_KEY_LIMIT + VSH_MEASURE_PENUMBRA, "max-penumbra", "X",                                          \
         "wider or narrower penumbrae, as a share (0.03)"},                                                  \
        {CLI_KEY_LIMIT + VSH_MEASURE_LOST, "max-lost", "TEXELS",                                             \
         "size of a region that lost its shadow (3)"},                                                       \
        {CLI_KEY_LIMIT + VSH_MEASURE_GAINED, "max-gained", "TEXELS",                                         \
         "size of a region that gained a shadow (3)"},                                                       \
        {CLI_KEY_LIMIT + VSH_MEASURE_RMSE, "max-rmse", "X", "root mean square difference (0.004)"},          \
        {CLI_KEY_LIMIT + VSH_MEASURE_P99, "max-p99", "X", "99th percentile of differences (0.02)"},          \
        {CLI_KEY_LIMIT + VSH_MEASURE_MAX, "max-difference", "X", "largest difference (0.25)"},               \
        {CLI_KEY_STEP, "step", "X", "least difference of a lost or gained texel, to 1 (0.1)"},               \
        {CLI_KEY_REACH, "reach", "TEXELS", "shadows that moved so far are not lost, 0 to 16 (2)"}, {         \
        CLI_KEY_NOISE, "noise", "X",                                                                         \
            "standard error between the two, which widens default\nlimits (from the max errors in the "      \
            "files where these\ndiffer, else 0)"                                                             \
    }

/* Parses one of these options into cli_compare_settings, if the parser does not store it itself. */
int cli_compare_parse(void *settings, int key, const char *name, const char *value);

/* Refuses reports that would replace one of `inputs` or each other, or cannot be written. */
int cli_compare_check_reports(const cli_compare_settings *settings, const char *const *inputs, size_t count);

enum { CLI_PROBLEM = 320, CLI_EXPLANATION = 2048 };

typedef struct cli_comparison {
    char *name; /* of the scene's output; NULL: use the files' names */
    char *golden, *fresh;
    vsh_comparison *made; /* NULL: nothing was compared */
    char **pictures;      /* [picture_count]: HTML of each channel, or NULL */
    size_t picture_count;
    char problem[CLI_PROBLEM]; /* instead of a comparison; "": none */
    bool alike;
} cli_comparison;

/* Compares two files. CLI_OK whether they are alike or not, else an exit code after printing why. Free the
 * comparison also after a failure. */
int cli_comparison_make(const cli_compare_settings *settings, const char *golden, const char *fresh,
                        cli_comparison *comparison);
void cli_comparison_free(cli_comparison *comparison);

/* Returns problems other than values, from index 0; NULL after the last. */
const char *cli_comparison_problem(const cli_comparison *comparison, size_t index);

/* Says what is wrong with a channel, the best explanation first; "" if nothing is. */
void cli_channel_explain(const vsh_channel_comparison *channel, char text[CLI_EXPLANATION]);

/* Prints a line for each problem and channel, each after `prefix`. */
void cli_comparison_print(const cli_comparison *comparison, const char *prefix);

/* Returns a new reference. */
json_t *cli_comparison_json(const cli_comparison *comparison);

/* Prints JSON and drops it. */
void cli_print_json(json_t *root);

/* Writes the JUnit and HTML reports of the settings. CLI_OK or an exit code after printing why. */
int cli_comparison_report(const cli_compare_settings *settings, const cli_comparison *comparisons,
                          size_t count);

/* Finds the texel or voxel of a value. */
void cli_channel_position(const vsh_channel_comparison *channel, uint64_t index, int32_t position[3]);

/* Formats that position, "(3, 4)". */
const char *cli_channel_place(const vsh_channel_comparison *channel, uint64_t index, char text[64]);

/* Draws golden, new and difference as HTML, to be freed. */
char *cli_comparison_pictures(const vsh_channel_comparison *channel, const vsh_compared *compared);

#endif
