/* Command lines: tables of options, which parsing, help and suggestions share. */
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

/* Keys of options whose values the parser stores itself, in a member of the command's settings: a text, a
 * flag that becomes true, a number above 0. The option "output" has the letter o, too. */
#define CLI_TEXT(type, member) (CLI_STORE_TEXT + (int)offsetof(type, member))
#define CLI_FLAG(type, member) (CLI_STORE_FLAG + (int)offsetof(type, member))
#define CLI_POSITIVE(type, member) (CLI_STORE_POSITIVE + (int)offsetof(type, member))

/* A row of a table that stands for the library's settings of a group, VSH_SETTINGS_…: the library gives their
 * names, help, ranges and defaults. The key of each is CLI_KEY_SETTING + its number. */
#define CLI_SETTINGS(group)                                                                                  \
    { CLI_KEY_SETTINGS + (group), NULL, NULL, NULL }

/* A row that stands for one of them, by its option's name: of a scene's, where a flat scene has one too. */
#define CLI_SETTING(option)                                                                                  \
    { CLI_KEY_SETTINGS, option, NULL, NULL }

enum {
    CLI_MOST_SETTINGS = 64,
    CLI_MOST_OPTIONS = 128,
    CLI_KEY_SETTINGS = 0x8000,
    CLI_KEY_SETTING = 0x9000,
    CLI_STORE_TEXT = 0x100000,
    CLI_STORE_FLAG = 0x200000,
    CLI_STORE_POSITIVE = 0x300000
};

/* Setting `index` of the library; NULL beyond the last. */
const vsh_setting *cli_setting(size_t index);

/* The option of a word "--NAME", "--NAME=VALUE" or "-o"; false: the command has none. */
bool cli_find_option(const cli_command *command, const char *word, cli_option *option);

/* Its options and headings with the library's settings in the place of their rows, which last as long as the
 * process; at most `most` of them. Returns how many. */
size_t cli_list_options(const cli_command *command, cli_option *options, size_t most);

/* Takes one option; returns CLI_OK or an exit code after saying why. `name` is "--sun". */
typedef int cli_option_fn(void *settings, int key, const char *name, const char *value);

/* Parses argv: the shared options into cli_given, those that have a place in `settings` there, each other one
 * by `take`. Operands are those that the usage begins with; NULL stands for one in brackets that is not
 * there. A single operand FILE.vdb:NAME becomes FILE.vdb. Also begins the progress. CLI_OK, CLI_HELP
 * after printing the help, or an exit code after saying why. */
int cli_parse(const cli_command *command, int argc, char **argv, cli_option_fn *take, void *settings,
              const char **operands);

/* The NAME of an operand FILE.vdb:NAME, else NULL. */
const char *cli_parsed_grid(void);

/* The last command line that was parsed, as outputs tell it: without options that change no value (threads,
 * limits, output, …), and files by their names alone. "" at first. */
const char *cli_parsed_command(void);

void cli_print_help(const cli_command *command);

/* The candidate nearest to `text`, or NULL where none is near. */
const char *cli_nearest(const char *text, const char *const *candidates, size_t count);

#define CLI_DEGREE 0.017453292519943295 /* radians */

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
    const char *sandbox; /* "auto", "require" or "off": how the process is confined that parses files */
    bool allow_outside;  /* models may name files outside their folder */
} cli_common;

/* As the last command line gave them. */
extern cli_common cli_given;

/* A run by cli_given, whose warnings are gathered from here on. */
vsh_run cli_make_run(void);

enum {
    CLI_KEY_THREADS = 0x1000,
    CLI_KEY_MEMORY_LIMIT,
    CLI_KEY_PROGRESS,
    CLI_KEY_SANDBOX,
    CLI_KEY_ALLOW_OUTSIDE,
    CLI_KEY_TREAT,
    CLI_KEY_QUIET = 'q', /* as one letter, too */
    CLI_KEY_VERBOSE = 'v'
};

/* The file of statistics, a member of settings. */
#define CLI_STATS_OPTION(type, member)                                                                       \
    { CLI_TEXT(type, member), "stats", "FILE.json", "write times, counts and peak memory as JSON" }

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

/* --- --density PATTERN=X: factors of the density by objects' names */

enum { CLI_MOST_DENSITIES = 256 };

typedef struct cli_densities {
    vsh_density_rule list[CLI_MOST_DENSITIES];
    size_t count;
} cli_densities;

/* Takes one more. CLI_OK or an exit code, having said why. */
int cli_density_take(cli_densities *densities, const char *name, const char *value);

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
