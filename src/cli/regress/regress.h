/* A folder of scenes and their golden bakes. */
#ifndef CLI_REGRESS_H
#define CLI_REGRESS_H

#include "cli/compare/comparison.h"

/* Lines of text that grow. */
typedef struct regress_lines {
    char **line; /* [count] */
    size_t count;
} regress_lines;

/* A copy of the text is added. False where memory is short. */
bool regress_lines_add(regress_lines *lines, const char *format, ...) __attribute__((format(printf, 2, 3)));
void regress_lines_free(regress_lines *lines);

enum { REGRESS_UNCHANGED, REGRESS_ALIKE, REGRESS_UNLIKE, REGRESS_FAILED, REGRESS_UPDATED };

/* A scene, the command that bakes it, and what that writes. */
typedef struct regress_case {
    char *name;
    char *scene; /* its file, within the folder */
    const cli_command *command;
    regress_lines options;
    char *output;          /* -o; NULL: the scene names them */
    regress_lines outputs; /* names of all that is written */
    regress_lines inputs;  /* what the bake depends on, and how it is judged: equal where nothing changed */
    char *changed;         /* which of them did; NULL: none that is known */
    int status;            /* REGRESS_… */
    int code;              /* of a bake that failed */
    char *reason;          /* its last error; NULL: none is known */
    cli_comparison *comparisons; /* [outputs.count]; zeroed where there is none */
} regress_case;

typedef struct regress_settings {
    cli_compare_settings compare;
    const char *folder, *cache, *bakes, *only;
    bool update, all;
} regress_settings;

typedef struct regress_work {
    const regress_settings *settings;
    char *folder, *golden; /* golden: the folder of those */
    char *cache;           /* file */
    char *bakes;           /* folder of the new ones, absolute */
    int folder_of_bakes;   /* descriptor + 1 that holds it, where it is temporary */
    char *program;         /* hashes of the program and the library */
    regress_case *cases;
    size_t case_count;
} regress_work;

/* A file of JSON in a folder that strangers may have made; NULL where it is none, or cannot be read. */
json_t *regress_load(const char *path);

/* "FOLDER/NAME", to be freed; NULL where memory is short. */
char *regress_path(const char *folder, const char *name);

/* The cases of a folder: those of its regress.json, then its other scenes, by name. CLI_OK or an exit code,
 * having said why. */
int regress_find_cases(regress_work *work);
void regress_free_case(regress_case *one);

/* That a case's options, from the file `list`, only change values. CLI_OK or an exit code, having said why.
 */
int regress_check_options(const regress_case *one, const char *list);

/* With the last error as the reason. */
void regress_mark_failed(regress_case *one, int code);

/* A case that cannot be read or written fails by itself, and the others go on: marks it and gives CLI_OK;
 * other codes, which end all, as they are. */
int regress_failed(regress_case *one, int code);

/* Lists what a case depends on, new. */
int regress_list_inputs(const regress_work *work, regress_case *one);

/* Marks the cases that are as they were when they last were alike, and says of the others what changed. A
 * cache that cannot be read marks none. */
void regress_read_cache(regress_work *work);

/* Keeps what the cases that are alike depend on. */
int regress_write_cache(const regress_work *work);

/* Makes a folder for new bakes among the system's temporary ones, and takes away those that killed runs of
 * this user left there: a lock on the folder, *held (to be 0 before), tells that its run lives. CLI_OK or
 * CLI_FILE, having said why. */
int regress_folder_make(int *held, char **path);

/* Takes it away, and what is in it; nothing where none was made. */
void regress_folder_remove(int *held, const char *path);

/* Bakes a case in a child process. CLI_OK or an exit code, having said why. */
int regress_bake(const regress_work *work, const regress_case *one);

/* Tells of all cases on standard output, and in the files that were asked for. */
int regress_report(const regress_work *work);

/* Puts a new bake in the place of its golden one: whole, or not at all. */
int regress_update(const regress_work *work, const char *output);

#endif
