/* Command lines: tables of options that are parsed, explained and suggested from. */
#ifndef CLI_OPTIONS_H
#define CLI_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <vdbshade/scene.h>
#include <vdbshade/vdbshade.h>

/* An option, or (key 0) a heading of the help, or CLI_SETTINGS. Keys below 256 are also short options. */
typedef struct cli_option {
    int key;
    const char *name;
    const char *value; /* placeholder; NULL: the option takes none */
    const char *help;  /* line breaks count as blanks; for a heading, its text */
} cli_option;

typedef struct cli_command {
    const char *name;
    const char *usage;   /* "INPUT -o OUT [options]" */
    const char *summary; /* lines that the help begins with */
    const cli_option *options;
    size_t option_count;
    int (*main)(int argc, char **argv); /* argv[0] is the command's name */
} cli_command;

/* A row of a table that stands for the library's settings of a group, VSH_SETTINGS_…: their names, help,
 * ranges and defaults are taken from there, and their keys are CLI_KEY_SETTING + the number of each. */
#define CLI_SETTINGS(group)                                                                                  \
    { CLI_KEY_SETTINGS + (group), NULL, NULL, NULL }

/* A row that stands for one of them, by its option's name: of a scene's, where a flat scene has one too. */
#define CLI_SETTING(option)                                                                                  \
    { CLI_KEY_SETTINGS, option, NULL, NULL }

enum { CLI_KEY_SETTINGS = 0x8000, CLI_KEY_SETTING = 0x9000, CLI_MOST_SETTINGS = 64 };

/* Setting `index` of the library; NULL beyond the last. */
const vsh_setting *cli_setting(size_t index);

/* The option of that name, of `length` bytes; false: it is none of the command's. */
bool cli_find_option(const cli_command *command, const char *name, size_t length, cli_option *option);

/* Its options and headings with the library's settings in the place of their rows, which last as long as the
 * process; at most `most` of them. Returns how many. */
size_t cli_list_options(const cli_command *command, cli_option *options, size_t most);

enum { CLI_MOST_OPTIONS = 128 };

/* Takes one option; returns CLI_OK or an exit code after saying why. `name` is "--sun". */
typedef int cli_option_fn(void *settings, int key, const char *name, const char *value);

/* Parses argv and takes exactly one operand, `what` ("INPUT"). *help tells that the help was asked for and
 * printed. */
int cli_parse(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
              const char *what, const char **operand, bool *help);

/* Of an operand FILE.vdb:NAME, which cli_parse() gives as FILE.vdb, the NAME; else NULL. */
const char *cli_parsed_grid(void);

/* The last command line that was parsed, as outputs tell it: without options that change no value (threads,
 * limits, output, …), and files by their names alone. Belongs to the parser; "" where memory was short. */
const char *cli_parsed_command(void);

/* The same with `least` to `count` operands, one or more; NULL stands for those that are not there. */
int cli_parse_some(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
                   const char *const *what, const char **operands, int least, int count, bool *help);

/* The same with `count` operands. */
int cli_parse_operands(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
                       const char *const *what, const char **operands, int count, bool *help);

void cli_print_help(const cli_command *command);

/* The candidate nearest to `text`, or NULL where none is near. */
const char *cli_nearest(const char *text, const char *const *candidates, size_t count);

/* Strict parsing: the whole text, finite, in the range; says what was expected. */
int cli_parse_number(const char *name, const char *text, double least, double most, double *value);
int cli_parse_positive(const char *name, const char *text, double *value); /* > 0 */
int cli_parse_integer(const char *name, const char *text, int32_t least, int32_t most, int32_t *value);
int cli_parse_vector(const char *name, const char *text, double value[3]);           /* X,Y,Z, not all 0 */
int cli_parse_point(const char *name, const char *text, double value[3]);            /* X,Y,Z */
int cli_parse_color(const char *name, const char *text, double value[3]);            /* R,G,B, >= 0 */
int cli_parse_box(const char *name, const char *text, double min[3], double max[3]); /* X0,Y0,Z0,X1,Y1,Z1 */
int cli_parse_floor(const char *name, const char *text, double size[2], double center[3]); /* W,D[,X,Y,Z] */
int cli_parse_size(const char *name, const char *text, int32_t *w, int32_t *h);            /* W[xH] */
int cli_parse_shard(const char *name, const char *text, int32_t *shard, int32_t *count);   /* I/N */
int cli_parse_bytes(const char *name, const char *text, uint64_t *value);                  /* 500M, 2GiB */

/* Parses a name of a VSH_NAMES_… kind; an error lists all names. */
int cli_parse_name(const char *name, const char *text, int32_t kind, int32_t *value);

/* Options that every long command has. */
typedef struct cli_common {
    int32_t threads;
    uint64_t memory_limit;
    bool quiet;
    bool verbose; /* print each warning and notes */
    bool progress;
    int sandbox;        /* CLI_SANDBOX_…: how the process is confined that parses files */
    bool allow_outside; /* what models name may lie outside their folder */
} cli_common;

enum { CLI_SANDBOX_AUTO, CLI_SANDBOX_REQUIRE, CLI_SANDBOX_OFF };

cli_common cli_common_default(void);
vsh_run cli_common_run(const cli_common *common);

enum {
    CLI_KEY_THREADS = 0x1000,
    CLI_KEY_MEMORY_LIMIT,
    CLI_KEY_PROGRESS,
    CLI_KEY_SANDBOX,
    CLI_KEY_ALLOW_OUTSIDE,
    CLI_KEY_TREAT,
    CLI_KEY_SHARD,
    CLI_KEY_QUIET = 'q', /* as one letter, too */
    CLI_KEY_VERBOSE = 'v'
};

/* Work that is shared out: `what` it does of it. */
#define CLI_SHARD_OPTION(what)                                                                               \
    { CLI_KEY_SHARD, "shard", "I/N", what }

#define CLI_READER_OPTIONS                                                                                   \
    {CLI_KEY_SANDBOX, "sandbox", "auto|require|off",                                                         \
     "confine the process that parses files as far as this\nsystem can, and warn if that is not wholly; "    \
     "require:\nelse read nothing; off: parse in this process, a\nlittle faster, where a damaged file may "  \
     "crash it (auto)"},                                                                                     \
    {                                                                                                        \
        CLI_KEY_ALLOW_OUTSIDE, "allow-outside", NULL,                                                        \
            "models may name files (buffers, materials) outside\ntheir folder"                               \
    }

#define CLI_MEMORY_OPTION                                                                                    \
    {                                                                                                        \
        CLI_KEY_MEMORY_LIMIT, "memory-limit", "BYTES",                                                       \
            "memory that a step may take; with k, M, G or KiB,\nMiB, GiB; 0: no limit (3/4 of the "          \
            "machine's)"                                                                                     \
    }

#define CLI_COMMON_OPTIONS                                                                                   \
    {0, NULL, NULL, "Running"},                                                                              \
        {CLI_KEY_THREADS, "threads", "N",                                                                    \
         "threads, 1 to 1024 (all cores); the result is\nthe same for any number"},                          \
        CLI_MEMORY_OPTION, CLI_READER_OPTIONS,                                                               \
        {CLI_KEY_PROGRESS, "progress", NULL, "show progress even where it is no terminal"},                  \
        {CLI_KEY_VERBOSE, "verbose", NULL, "every warning by itself, and notes"},                            \
        {CLI_KEY_QUIET, "quiet", NULL, "say nothing but errors"}, {                                          \
        'h', "help", NULL, "show this help"                                                                  \
    }

/* Voxels, and what meshes are taken for. */
#define CLI_GRID_OPTIONS                                                                                     \
    CLI_SETTINGS(VSH_SETTINGS_CASTERS), {                                                                    \
        CLI_KEY_TREAT, "treat", "PATTERN=solid|sheet|room",                                                  \
            "take objects of casters for solids, closed over their\nholes, for sheets with air on both "     \
            "sides, or for rooms\nwith air in what they enclose; repeatable"                                 \
    }

/* Takes an option of the tables above; *taken tells whether it was one of them. */
int cli_common_parse(cli_common *common, int key, const char *name, const char *value, bool *taken);

/* --- --density PATTERN=X: factors of the density by objects' names */

enum { CLI_MOST_DENSITIES = 256 };

typedef struct cli_densities {
    vsh_density_rule list[CLI_MOST_DENSITIES];
    char *own[CLI_MOST_DENSITIES]; /* the rules' patterns */
    size_t count;
} cli_densities;

/* Takes one more. CLI_OK or an exit code, having said why. */
int cli_density_take(cli_densities *densities, const char *name, const char *value);
void cli_densities_free(cli_densities *densities);

/* --- provenance: notes of an output's inputs and options */

typedef struct cli_provenance {
    vsh_provenance *made;
    const vsh_attribute *attributes; /* [count] */
    size_t count;
} cli_provenance;

/* Makes the provenance of the parsed command, a scene and further files [file_count], the command's operand
 * first. The scene and files may be NULL; files that the scene names add nothing. `casters` gives voxels and
 * triangles, or is NULL. Returns CLI_OK, or an exit code after a message. Free also after a failure. */
int cli_provenance_make(const vsh_scene *scene, const char *const *files, size_t file_count,
                        const vsh_occluders_info *casters, const vsh_run *run, cli_provenance *origin);
void cli_provenance_free(cli_provenance *origin);

#endif
