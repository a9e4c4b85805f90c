/* A folder of scenes and their golden bakes. */
#ifndef CLI_REGRESS_H
#define CLI_REGRESS_H

#include "cli/compare/comparison.h"

#include <vdbshade/provenance.h>

/* Lines of text that grow. */
typedef struct regress_lines {
    char **line; /* [count], and NULL after the last */
    size_t count;
} regress_lines;

void regress_add_line(regress_lines *lines, const char *format, ...) __attribute__((format(printf, 2, 3)));
void regress_free_lines(regress_lines *lines);

enum { REGRESS_UNCHANGED, REGRESS_ALIKE, REGRESS_UNLIKE, REGRESS_FAILED, REGRESS_UPDATED };

/* A scene, the command that bakes it, and the files which that writes. */
typedef struct regress_case {
    char *name;
    char *scene; /* file within the folder */
    char *path;  /* FOLDER/SCENE */
    const cli_command *command;
    regress_lines options;
    char *output;                /* for -o; NULL: the scene names its outputs */
    regress_lines outputs;       /* names of all files written */
    regress_lines inputs;        /* everything that the result depends on, equal if nothing changed */
    char *changed;               /* the input that changed; NULL: unknown */
    int status;                  /* REGRESS_… */
    int code;                    /* exit code of a failed bake */
    char *reason;                /* its last error; "": unknown */
    cli_comparison *comparisons; /* [outputs.count]; zeroed if there is none */
} regress_case;

typedef struct regress_settings {
    cli_compare_settings compare; /* the first member: cli_compare_parse() takes a pointer to it */
    const char *folder, *cache, *bakes, *only;
    bool update, all;
} regress_settings;

typedef struct regress_work {
    const regress_settings *settings;
    vsh_run run;
    char *golden;                           /* folder of golden bakes */
    char *cache;                            /* file */
    char *bakes;                            /* folder of the new bakes, absolute */
    char program[64 + 2 * VSH_DIGEST_TEXT]; /* its version, its hash, and that of the library */
    regress_case *cases;
    size_t case_count;
} regress_work;

/* Returns "FOLDER/NAME", to be freed. */
char *regress_path(const char *folder, const char *name);

/* Reads a JSON file that strangers may have made, of up to `most` bytes; NULL if that fails. */
enum { REGRESS_MOST_BYTES = 4 << 20 }; /* parsed JSON takes a hundred times as much */
json_t *regress_load(const char *path, uint64_t most);

/* The functions below that return an int return CLI_OK, or an exit code after printing why. */

/* Finds the cases of a folder: those of its regress.json, then its other scenes by name. */
int regress_find_cases(regress_work *work);
void regress_free_case(regress_case *one);

/* Marks a case as failed, with the last error as the reason. */
void regress_mark_failed(regress_case *one, int code);

/* If a case cannot be read or written, marks it and returns CLI_OK, so that the others go on. Returns other
 * codes unchanged. */
int regress_fail_alone(regress_case *one, int code);

/* Lists the inputs of a case anew. */
int regress_list_inputs(const regress_work *work, regress_case *one);

/* Marks cases that did not change since they were alike, and notes what changed in others. Ignores a cache
 * that cannot be read. */
void regress_read_cache(regress_work *work);

/* Saves the inputs of cases that are alike. */
int regress_write_cache(const regress_work *work);

/* Makes the folder for new bakes; without --bakes it is temporary. */
int regress_make_folder(regress_work *work);

/* Removes the folder if it is temporary. */
void regress_remove_folder(regress_work *work);

/* Bakes a case in a child process. */
int regress_bake(const regress_work *work, const regress_case *one);

/* Replaces a golden bake by the new one: whole, or not at all. */
int regress_update(const regress_work *work, const char *output);

#endif
