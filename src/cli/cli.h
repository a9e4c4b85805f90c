/* Declarations that the commands of `vdbshade` share.
 *
 * A function that returns an exit code prints an error before it returns another one than CLI_OK. */
#pragma once

#include "base/file.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/vdbshade.h>

/* --- exit codes and messages: message.c */

enum {
    CLI_HELP = -1, /* the help was printed, and nothing is left to do */
    CLI_OK = 0,
    CLI_UNLIKE = 1, /* a comparison failed */
    CLI_USAGE = 2,
    CLI_FILE = 3,
    CLI_LIMIT = 4,
    CLI_DEFECT = 70, /* EX_SOFTWARE of sysexits.h */
    CLI_INTERRUPTED = 130
};

/* Returns the exit code of a call unless it is CLI_OK. */
#define CLI_TRY(call)                                                                                        \
    do {                                                                                                     \
        const int tried = (call);                                                                            \
        if (tried != CLI_OK) {                                                                               \
            return tried;                                                                                    \
        }                                                                                                    \
    } while (0)

/* Stores the exit code of a call in `code` and, unless it is CLI_OK, goes to the label `done`. */
#define CLI_TRY_DONE(call)                                                                                   \
    do {                                                                                                     \
        code = (call);                                                                                       \
        if (code != CLI_OK) {                                                                                \
            goto done;                                                                                       \
        }                                                                                                    \
    } while (0)

/* Refuses the command line with a message, as cli_usage() does, if the condition holds. */
#define CLI_REFUSE_IF(condition, ...)                                                                        \
    do {                                                                                                     \
        if (condition) {                                                                                     \
            return cli_usage(__VA_ARGS__);                                                                   \
        }                                                                                                    \
    } while (0)

/* Error of the last library call, which the main thread made with &cli_error. */
extern vsh_error cli_error;

/* Print "vdbshade: …" as one line on standard error; control characters become '?'. cli_refuse() first prints
 * the kept warnings, and returns `code`. */
void cli_say(const char *format, ...) __attribute__((format(printf, 1, 2)));
int cli_refuse(int code, const char *format, ...) __attribute__((format(printf, 2, 3)));
#define cli_usage(...) cli_refuse(CLI_USAGE, __VA_ARGS__)
#define cli_inform(...) (cli_given.quiet ? (void)0 : cli_say(__VA_ARGS__)) /* a result, unless --quiet */

/* Return the exit code of a library call, and print cli_error if it failed. cli_check_input() is for calls
 * that do not know the file's name: if the message names no existing file, it prints the command's first
 * operand before it. */
int cli_check(vsh_result result);
int cli_check_input(vsh_result result);

/* Prints cli_error after `path`, or (NULL) after the first operand, like cli_check_input(). */
int cli_fail_with(const char *path);

/* Reports a cancelled run and returns CLI_INTERRUPTED. */
int cli_cancelled(void);

enum { CLI_LINE = 1024 };
extern char cli_last_line[CLI_LINE]; /* the last line printed, without "vdbshade: "; "" at first */

/* Whether standard error is a terminal that knows escape sequences. */
bool cli_has_escapes(void);

/* Keep a warning until the next cli_print_warnings(), or print it now (--verbose). Any thread. */
void cli_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));
void cli_print_warnings(void); /* one line for each kind of warning */

void cli_begin_progress(bool shown);
int32_t cli_report_progress(void *user, const char *stage, double fraction); /* a vsh_progress_fn */
void cli_end_progress(void);                                                 /* clears the terminal's line */

/* Shows that the output is being written; CLI_INTERRUPTED if the user interrupted the run. */
int cli_begin_writing(void);

/* How the last command line wants library calls to run. Their warnings are kept for cli_print_warnings(). */
extern vsh_run cli_run;
void cli_complete_run(void); /* sets the members that depend on cli_given */

/* Makes standard output a stream of text without control characters: names come from files, and terminals
 * obey such characters. */
void cli_plain_output(void);

/* --- signals and refused memory: signals.c */

/* After this, SIGINT, SIGTERM and SIGHUP (unless ignored) only set cli_interrupted(). SIGXFSZ and SIGPIPE are
 * ignored, so that a file-size limit or a closed pipe becomes an error of the write. */
void cli_signals_begin(void);
bool cli_interrupted(void);

/* Prints that the run was interrupted, once in a process. */
void cli_signals_tell(void);

/* Starts a thread that ends the process at a second signal, or if work does not stop soon after the first.
 * Call it after the last fork(). */
void cli_signals_watch(void);

/* Call this when the output is written. Later signals end nothing, and refused memory ends the process with
 * `code`. */
void cli_signals_end(int code);

/* --- paths and files: files.c */

/* Formats a text that is never freed. */
const char *cli_keep_text(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Formats a number of bytes, "1.5 GiB"; likewise never freed. */
const char *cli_bytes_text(uint64_t bytes);

/* Whether a path ends in one of the endings "exr png …", in any case. */
bool cli_has_ending(const char *path, const char *endings);

/* Splits FILE.vdb:NAME: *path becomes FILE.vdb, and NAME is returned. Returns NULL for other paths, and if a
 * file has the whole name. */
const char *cli_split_grid(const char **path);

/* Whether a path is a folder, or ends in a slash. */
bool cli_is_folder(const char *path);

/* Returns the path with `end` instead of its last slashes. */
const char *cli_end_path(const char *path, const char *end);

/* Refuses an output that is an input or another output. NULL paths are skipped; `scene` adds its own inputs,
 * and may be NULL. */
int cli_check_apart(const char *const *outputs, size_t output_count, const char *const *inputs,
                    size_t input_count, const vsh_scene *scene);

/* Checks like cli_check_apart(), and refuses outputs that cannot be written. */
int cli_check_outputs(const char *const *outputs, size_t output_count, const char *const *inputs,
                      size_t input_count, const vsh_scene *scene);

/* Refuses an output that leaves the folder of `namer`, the file that names it, by a link: the folder may be a
 * stranger's. */
int cli_check_links(const char *namer, const char *path);

/* Refuses an output whose folder is missing. */
int cli_check_folder(const char *path);

/* Makes the folders of a path. */
int cli_make_folder_of(const char *path);

/* A file under way. */
typedef struct cli_temporary {
    FILE *file; /* write here; NULL: nothing is under way */
    const char *target;
    vshi_output output;
} cli_temporary;

/* Begins a file that appears whole at commit, or not at all. Write failures show at commit. */
int cli_temporary_begin(cli_temporary *temporary, const char *target);
int cli_temporary_commit(cli_temporary *temporary);

/* Commits several files: all of them, or none. */
enum { CLI_MOST_TEMPORARIES = 2 };
int cli_temporaries_commit(cli_temporary *const *list, size_t count);
void cli_temporary_abandon(cli_temporary *temporary);

/* Copies the rest of a file; false with errno if that fails. */
bool cli_copy(FILE *from, FILE *to);

/* Refuses a path that cannot be written. */
int cli_temporary_check(const char *target);

/* Writes JSON to a file, or (NULL) to standard output, and frees it. */
int cli_write_json(const char *path, json_t *root);

json_t *cli_number_json(double value);   /* null for NaN and infinity */
json_t *cli_utf8_json(const char *text); /* null for NULL; bytes that are not UTF-8 become U+FFFD */

/* Writes text with the special characters of HTML and XML escaped, between markup. */
void cli_write(FILE *out, const char *before, const char *text, const char *after);

/* --- options: options.c */

/* Parses the value of an option into the member `at` of the settings. `name` is "--sun". */
typedef int cli_parse_fn(void *at, const char *name, const char *value);

/* An option. Without a name: a heading of the help, or a group of settings. */
typedef struct cli_option {
    const char *name;
    const char *value;   /* placeholder; NULL: the option takes no value */
    const char *help;    /* line breaks count as blanks */
    int kind;            /* CLI_KIND_… */
    size_t place;        /* offset of the member that gets the value; of a setting, its number */
    void *global;        /* variable that gets the value instead; NULL: none */
    double least, most;  /* range of a number; the most items of a list */
    cli_parse_fn *parse; /* of CLI_KIND_PARSED */
} cli_option;

/* How the value of an option is parsed, and the type of the member that gets it. */
enum {
    CLI_KIND_HEADING,
    CLI_KIND_HELP,
    CLI_KIND_SETTINGS, /* a group of the library's settings, VSH_SETTINGS_…, which give their own help */
    CLI_KIND_SETTING,  /* one of these settings, by its name; the scene's rather than the flat scene's */
    CLI_KIND_TEXT,     /* const char * */
    CLI_KIND_FLAG,     /* bool, which becomes true */
    CLI_KIND_POSITIVE, /* double, > 0 */
    CLI_KIND_NUMBER,   /* double within the range */
    CLI_KIND_INTEGER,  /* int32_t within the range */
    CLI_KIND_BYTES,    /* uint64_t */
    CLI_KIND_NAME,     /* int32_t: a constant by its name, of the VSH_NAMES_… kind `least` */
    CLI_KIND_WORD,     /* int32_t: number of the word in the placeholder "a|b|c" */
    CLI_KIND_POINT,    /* double[3] */
    CLI_KIND_VECTOR,   /* double[3], not all 0 */
    CLI_KIND_COLOR,    /* double[3], >= 0 */
    CLI_KIND_SIZE,     /* int32_t[2] */
    CLI_KIND_LIST,     /* cli_list */
    CLI_KIND_PARSED    /* any, by a function */
};

/* The rest of a row: where the value goes, CLI_VALUE(TEXT, bake_settings, output). */
#define CLI_VALUE(KIND, type, member) .kind = CLI_KIND_##KIND, .place = offsetof(type, member)
#define CLI_RANGE(KIND, type, member, low, high) CLI_VALUE(KIND, type, member), .least = (low), .most = (high)
#define CLI_PARSED(type, member, function) CLI_VALUE(PARSED, type, member), .parse = (function)
#define CLI_GLOBAL(KIND, variable) .kind = CLI_KIND_##KIND, .global = &(variable)
#define CLI_SETTINGS(group) .kind = CLI_KIND_SETTINGS, .place = (group)
#define CLI_SETTING .kind = CLI_KIND_SETTING

enum { CLI_MOST_OPTIONS = 128, CLI_MOST_SETTINGS = 64, CLI_MOST_ITEMS = 256, CLI_MOST_RULES = 64 };

/* Texts of an option that may be repeated. */
typedef struct cli_list {
    const char *text[CLI_MOST_ITEMS];
    size_t count;
} cli_list;

typedef struct cli_command {
    const char *name;
    const char *usage;   /* "INPUT -o OUT [options]": begins with the operands */
    const char *brief;   /* its line in the list of commands */
    const char *summary; /* the first lines of its help */
    const cli_option *options;
    size_t option_count;
    int (*main)(int argc, char **argv); /* argv[0] is the command's name */
} cli_command;

#define CLI_COUNT(array) (sizeof(array) / sizeof *(array))
#define CLI_ENDING(options, main) (options), CLI_COUNT(options), (main) /* the last members of a command */

/* Parses a command line into `settings` and the variables below, and starts the progress. operands[] gets the
 * operands of the usage, NULL for a missing one in brackets. Returns CLI_HELP after it prints the help. */
int cli_parse(const cli_command *command, int argc, char **argv, void *settings, const char **operands);

/* Common options of the last command line, beside cli_run. */
typedef struct cli_common {
    bool quiet, verbose, progress;
    int32_t sandbox;    /* CLI_SANDBOX_… */
    bool allow_outside; /* models may name files outside their folder */
} cli_common;
enum { CLI_SANDBOX_AUTO, CLI_SANDBOX_REQUIRE, CLI_SANDBOX_OFF };
extern cli_common cli_given;

/* The rest of the last command line. */
typedef struct cli_line {
    char *command;     /* the line for provenance: without outputs and limits, files without folders */
    const char *input; /* the first operand; FILE.vdb if it is FILE.vdb:NAME and the only one */
    const char *grid;  /* that NAME, or NULL */
    const char *options[CLI_MOST_OPTIONS]; /* [option_count]: names of the options that were given */
    size_t option_count;
    const char *settings[CLI_MOST_SETTINGS]; /* the value of each setting; NULL: not given */
    vsh_solidity_rule rules[CLI_MOST_RULES]; /* [rule_count], of --treat */
    size_t rule_count;
} cli_line;
extern cli_line cli_parsed;

/* Whether the last command line has an option, "sun". */
bool cli_was_given(const char *option);

/* Gives a setting a value unless the command line did. */
int cli_set_default(const char *option, const char *value);

/* Copies the given settings to a vsh_scene, vsh_receiver or vsh_flat_scene, by VSH_SETTING_OF_…. A scene then
 * refers to cli_parsed. */
int cli_apply_settings(int32_t owner, void *target);

/* Returns setting `index` of the library, or NULL beyond the last. */
const vsh_setting *cli_setting(size_t index);

/* Finds the option of a word "--NAME", "--NAME=VALUE" or "-o"; false if the command has none. */
bool cli_find_option(const cli_command *command, const char *word, cli_option *option);

/* Lists a command's options and headings, with the settings of its groups. Returns their number. */
size_t cli_list_options(const cli_command *command, cli_option options[CLI_MOST_OPTIONS]);

/* The letter of an option, 'o' for "output"; 0 if there is none. */
char cli_letter_of(const char *option);

/* Returns the candidate nearest to `text`, or NULL if none is near. */
const char *cli_nearest(const char *text, const char *const *candidates, size_t count);

#define CLI_DEGREE 0.017453292519943295 /* radians */

/* Parse a whole text strictly. */
bool cli_read_numbers(const char *text, size_t count,
                      double *value); /* "X,Y,Z"; false if it is not `count` */
bool cli_read_integer(const char *text, int32_t *value, const char **rest);

/* Options that several commands have. */
#define CLI_STATS_OPTION(type, member)                                                                       \
    { "stats", "FILE.json", "write times, counts and peak memory as JSON", CLI_VALUE(TEXT, type, member) }

#define CLI_HELP_OPTION                                                                                      \
    { "help", NULL, "show this help", .kind = CLI_KIND_HELP }

#define CLI_VERBOSE_OPTION(text)                                                                             \
    { "verbose", NULL, text, CLI_GLOBAL(FLAG, cli_given.verbose) }

#define CLI_READER_OPTIONS                                                                                   \
    {"memory-limit", "BYTES",                                                                                \
     "memory that a step may take; with k, M, G or KiB, MiB, GiB; 0: no limit (3/4 of the machine's)",       \
     CLI_GLOBAL(BYTES, cli_run.memory_limit)},                                                               \
        {"sandbox", "auto|require|off",                                                                      \
         "confine the process that parses files as far as this system can, and warn if it cannot fully; "    \
         "require: read nothing if it cannot; off: parse in this process, a little faster, where a "         \
         "damaged "                                                                                          \
         "file may crash it (auto)",                                                                         \
         CLI_GLOBAL(WORD, cli_given.sandbox)},                                                               \
    {                                                                                                        \
        "allow-outside", NULL, "models may name files (buffers, materials) outside their folder",            \
            CLI_GLOBAL(FLAG, cli_given.allow_outside)                                                        \
    }

#define CLI_COMMON_OPTIONS                                                                                   \
    {.help = "Running"},                                                                                     \
        {"threads",                                                                                          \
         "N",                                                                                                \
         "threads, 1 to 1024 (all cores); the result is the same for any number",                            \
         CLI_GLOBAL(INTEGER, cli_run.threads),                                                               \
         .least = 1,                                                                                         \
         .most = 1024},                                                                                      \
        CLI_READER_OPTIONS,                                                                                  \
        {"progress", NULL, "show progress even if standard error is no terminal",                            \
         CLI_GLOBAL(FLAG, cli_given.progress)},                                                              \
        CLI_VERBOSE_OPTION("print every warning, and notes"),                                                \
        {"quiet", NULL, "print only errors", CLI_GLOBAL(FLAG, cli_given.quiet)}, CLI_HELP_OPTION

#define CLI_GRID_OPTIONS                                                                                     \
    {CLI_SETTINGS(VSH_SETTINGS_CASTERS)}, {                                                                  \
        "treat", "PATTERN=solid|sheet|room",                                                                 \
            "treat objects of casters as solids, closed over their holes, as sheets with air on both "       \
            "sides, "                                                                                        \
            "or as rooms with air inside; repeatable",                                                       \
            .kind = CLI_KIND_PARSED, .parse = cli_parse_treat                                                \
    }
int cli_parse_treat(void *unused, const char *name, const char *value);

/* --density PATTERN=X: factors of the density of objects by their names. */
enum { CLI_MOST_DENSITIES = 256 };
typedef struct cli_densities {
    vsh_density_rule list[CLI_MOST_DENSITIES];
    size_t count;
} cli_densities;
int cli_parse_density(void *densities, const char *name, const char *value);

/* --- commands and their help: main.c */

extern const cli_command cli_bake, cli_voxelize, cli_info, cli_trade, cli_query, cli_render, cli_volume,
    cli_flat, cli_compare, cli_regress, cli_unwrap, cli_view, cli_help, cli_merge;

/* A page of docs/, built in (cmake/embed_docs.cmake). */
typedef struct cli_page {
    const char *name; /* "scene" for docs/scene.md */
    const unsigned char *bytes;
    size_t size;
} cli_page;
extern const cli_page cli_pages[]; /* the last has no name */

void cli_print_help(const cli_command *command);

/* --- statistics and provenance: stats.c */

enum { CLI_STAGE_LOAD, CLI_STAGE_VOXELIZE, CLI_STAGE_FIELD, CLI_STAGE_BAKE, CLI_STAGE_WRITE, CLI_STAGES };

enum { CLI_STATS_TEXELS, CLI_STATS_POINTS, CLI_STATS_VOXELS };

enum { CLI_STATS_SHADOW, CLI_STATS_AO, CLI_STATS_SKY, CLI_STATS_KINDS };

/* The method that made the values of a kind. */
typedef struct cli_method {
    const char *name; /* NULL: there are no such values */
    bool keeps_error, traces;
} cli_method;

typedef struct cli_stats {
    double seconds[CLI_STAGES];
    double lap; /* when the last stage ended, seconds */
    int of;     /* CLI_STATS_…: what is counted */
    uint64_t texels, invalid_texels;
    uint64_t points, bad_rows;
    uint64_t voxels, inside_voxels, tiles;
    vsh_shade_stats shade;
    const vsh_bake_error *errors; /* [light_count + 2]: of each light, of AO, of the sky; NULL: unknown */
    const vsh_light *lights;      /* of `errors` */
    size_t light_count;
    cli_method methods[CLI_STATS_KINDS];
    double max_error; /* of --max-error */
    int32_t threads;
    vsh_occluders_info casters;
} cli_stats;

/* Returns empty statistics. */
cli_stats cli_stats_begin(int of);

/* Adds the time since the last call of cli_stats_begin(), _lap() or _casters() to a stage. */
void cli_stats_lap(cli_stats *stats, int stage);

/* Stores the methods that the scene's settings choose, with triangles (not 0) or without. */
void cli_stats_methods(cli_stats *stats, const vsh_scene *scene, int32_t has_triangles);

/* Stores the casters, adds the seconds that they took, and stores the scene's methods. */
void cli_stats_casters(cli_stats *stats, const vsh_scene *scene, const vsh_occluders_info *casters);

/* Formats "shadow exact, AO exact, max error 0.02". */
const char *cli_stats_methods_text(const cli_stats *stats);

/* Warns if an error is above --max-error, and says what would help. */
void cli_stats_warn(const cli_stats *stats, const vsh_scene *scene);

/* Ends a successful run: writes the JSON file (NULL: none). Later signals end nothing. */
int cli_stats_finish(const cli_stats *stats, const char *path);

/* Prints the summary on standard error, unless --quiet. */
void cli_stats_say(const cli_stats *stats);

/* Prints the AO distance that a load chose, unless the scene names one. */
void cli_say_auto_ao(const vsh_scene *scene, double distance);

/* Notes about an output's inputs and options. */
typedef struct cli_provenance {
    vsh_provenance *made;
    const vsh_attribute *attributes; /* [count] */
    size_t count;
} cli_provenance;

/* Makes the provenance of the parsed command, a scene (NULL: none) and `files`, the first operand first. NULL
 * files, and those that the scene names, add nothing. `casters` has the voxels and triangles, or is NULL.
 * Free it even after a failure. */
int cli_provenance_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                        const vsh_occluders_info *casters, cli_provenance *origin);
void cli_provenance_free(cli_provenance *origin);
