/* vdbshade regress: bakes the scenes of a folder, compares them with golden bakes, and reports.
 *
 * A CI may run a stranger's folder unread. So only the command line of `regress` may ask to write files,
 * or to parse files unconfined. */
#define _GNU_SOURCE /* memfd_create */
#include "base/clock.h"
#include "compare.h"

#include <dirent.h>
#include <errno.h>
#include <fnmatch.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

typedef struct regress_settings {
    cli_compare_settings compare; /* the first member */
    const char *folder, *bakes, *only;
    bool update;
} regress_settings;

static const cli_option options[] = {
    {.help = "Work"},
    {"update", NULL, "replace golden bakes that differ, and add missing ones",
     CLI_VALUE(FLAG, regress_settings, update)},
    {"only", "TEXT", "only cases whose names contain it", CLI_VALUE(TEXT, regress_settings, only)},
    {"bakes", "FOLDER", "keep the new bakes there", CLI_VALUE(TEXT, regress_settings, bakes)},
    CLI_COMPARE_OPTIONS("limits of all, instead of DIR/golden/OUTPUT.tolerance.json"),
    CLI_COMMON_OPTIONS,
};

/* Texts that are never freed. */
typedef struct lines {
    const char **line; /* [count], and NULL after the last */
    size_t count;
} lines;

static void add_line(lines *to, const char *text) {
    to->line = realloc(to->line, (to->count + 2) * sizeof *to->line);
    to->line[to->count++] = text;
    to->line[to->count] = NULL;
}

enum { ALIKE, UNLIKE, FAILED, UPDATED };
static const char *const status_names[] = {"alike", "not alike", "failed", "updated"};

/* A scene, the command that bakes it, and the files that the command writes. */
typedef struct regress_case {
    const char *name;
    const char *scene; /* file within the folder */
    const char *path;  /* FOLDER/SCENE */
    const cli_command *command;
    lines options;
    const char *output; /* for -o; NULL: the scene names its outputs */
    lines outputs;      /* names of all files written */
    int status;
    int code;                    /* exit code of a failed bake */
    const char *reason;          /* its last error; "": unknown */
    cli_comparison *comparisons; /* [outputs.count]; zeroed if there is none */
} regress_case;

/* The one run of the process. */
static struct {
    regress_settings settings;
    const char *golden; /* folder of golden bakes */
    char *bakes;        /* folder of the new bakes, absolute */
    regress_case *cases;
    size_t case_count;
} work;

static const char *in_folder(const char *folder, const char *name) {
    return cli_keep_text("%s/%s", folder, name);
}

/* --- regress.json */

static const char list_name[] = "regress.json";
enum { MOST_LIST = 4 << 20 }; /* bytes */

static regress_case *add_case(const char *scene, const char *name) {
    work.cases = realloc(work.cases, (work.case_count + 1) * sizeof *work.cases);
    regress_case *one = &work.cases[work.case_count++];
    *one = (regress_case){.scene = scene, .path = in_folder(work.settings.folder, scene), .name = name};
    return one;
}

static int refuse_case(size_t i, const char *what) {
    return cli_usage("%s/%s: cases[%zu]: %s", work.settings.folder, list_name, i, what);
}

static int read_options(const json_t *words, size_t i, regress_case *one) {
    size_t k;
    json_t *word;
    bool strings = words == NULL || json_is_array(words);
    json_array_foreach(words, k, word) {
        strings = strings && json_is_string(word);
        if (strings) {
            add_line(&one->options, cli_keep_text("%s", json_string_value(word)));
        }
    }
    return strings ? CLI_OK : refuse_case(i, "options: expected an array of strings");
}

static int read_case(json_t *json, size_t i) {
    static const cli_command *const commands[] = {&cli_bake, &cli_volume, &cli_flat, &cli_voxelize};
    const char *scene = NULL, *name = NULL, *output = NULL, *command = NULL;
    const json_t *words = NULL;
    json_error_t why;
    if (json_unpack_ex(json, &why, 0, "{s:s,s?s,s?s,s?s,s?o!}", "scene", &scene, "name", &name, "output",
                       &output, "command", &command, "options", &words) != 0) {
        return refuse_case(i, why.text);
    }
    if (output != NULL && (strchr(output, '/') != NULL || output[strspn(output, ".")] == '\0')) {
        return refuse_case(i, "output: expected a name without a folder");
    }
    regress_case *one = add_case(cli_keep_text("%s", scene),
                                 name != NULL ? cli_keep_text("%s", name)
                                              : cli_keep_text("%.*s", (int)strcspn(scene, "."), scene));
    one->output = output != NULL ? cli_keep_text("%s", output) : NULL;
    for (size_t k = 0; command != NULL && k < CLI_COUNT(commands); ++k) {
        one->command = strcmp(commands[k]->name, command) == 0 ? commands[k] : one->command;
    }
    if (command != NULL && one->command == NULL) {
        return refuse_case(i, "command: expected bake, volume, flat or voxelize");
    }
    return read_options(words, i, one);
}

static int read_list(const char *path) {
    FILE *file;
    uint64_t size;
    if (access(path, F_OK) != 0 && errno == ENOENT) {
        return CLI_OK;
    }
    CLI_TRY(cli_check(vshi_input_open(path, path, MOST_LIST, &file, &size, &cli_error)));
    int code = CLI_OK;
    json_error_t where;
    json_t *root = json_loadf(file, JSON_REJECT_DUPLICATES, &where);
    fclose(file);
    const json_t *cases = json_object_get(root, "cases");
    if (root == NULL) {
        code = cli_usage("%s:%d:%d: %s", path, where.line, where.column, where.text);
    } else if (!json_is_array(cases) || json_object_size(root) != 1) {
        code = cli_usage("%s: expected an object with the one key \"cases\", an array", path);
    }
    for (size_t i = 0; code == CLI_OK && i < json_array_size(cases); ++i) {
        code = read_case(json_array_get(cases, i), i);
    }
    json_decref(root);
    return code;
}

/* Options that change values. All settings do, too; other options are refused. Add a new option here if it
 * writes nothing. */
static const char changes_values[] = " receive no-receive no-cast one-sided sun sun-angle lights "
                                     "light-radius caster treat half band box like inside "
                                     "name box-voxel-size density height size-world floor ";

static bool is_allowed(const char *option) {
    for (size_t i = 0; cli_setting(i) != NULL; ++i) {
        if (strcmp(cli_setting(i)->option, option) == 0) {
            return true;
        }
    }
    return strstr(changes_values, cli_keep_text(" %s ", option)) != NULL;
}

static int check_options(const regress_case *one) {
    for (size_t i = 0; i < one->options.count; ++i) {
        const char *word = one->options.line[i];
        cli_option option; /* the word is "--NAME" or "--NAME=VALUE" */
        CLI_REFUSE_IF(strncmp(word, "--", 2) != 0 || !cli_find_option(one->command, word, &option) ||
                          !is_allowed(option.name),
                      "%s/%s: case '%s': option '%s' of '%s' may not be in this file, because it does not "
                      "change values; give --sandbox, --threads and --memory-limit to 'vdbshade regress'",
                      work.settings.folder, list_name, one->name, word, one->command->name);
        i += option.value != NULL && strchr(word, '=') == NULL; /* skip its value */
    }
    return CLI_OK;
}

/* --- the folder's other scenes */

static int is_scene(const struct dirent *entry) {
    const char *name = entry->d_name;
    return name[0] != '.' && cli_has_ending(name, "json") && strcmp(name, list_name) != 0 &&
           fnmatch("*.tolerance.json", name, 0) != 0;
}

static int add_scenes(void) {
    struct dirent **entries;
    const int count = scandir(work.settings.folder, &entries, is_scene, alphasort);
    if (count < 0) {
        return cli_refuse(CLI_FILE, "%s: cannot be read: %s", work.settings.folder, strerror(errno));
    }
    const size_t listed = work.case_count;
    for (int i = 0; i < count; ++i) {
        const char *scene = cli_keep_text("%s", entries[i]->d_name);
        size_t k = 0;
        while (k < listed && strcmp(work.cases[k].scene, scene) != 0) {
            ++k;
        }
        if (k == listed) {
            add_case(scene, cli_keep_text("%.*s", (int)(strlen(scene) - strlen(".json")), scene));
        }
        free(entries[i]);
    }
    free(entries);
    return CLI_OK;
}

/* --- all cases */

static void mark_failed(regress_case *one, int code) {
    one->status = FAILED;
    one->code = code;
    one->reason = cli_keep_text("%s", cli_last_line);
}

/* Whether a scene is for `flat`. Parsed JSON takes a hundred times the bytes of its file, so files beyond the
 * memory limit count as scenes of `bake`, which refuses them. */
static bool has_region(const char *path) {
    const uint64_t most = cli_run.memory_limit > 0 ? cli_run.memory_limit / 100 : UINT64_MAX;
    FILE *file;
    uint64_t size;
    if (vshi_input_open(path, path, most, &file, &size, NULL) != VSH_OK) {
        return false;
    }
    json_t *root = json_loadf(file, 0, NULL);
    fclose(file);
    const bool has = json_object_get(root, "region") != NULL;
    json_decref(root);
    return has;
}

/* Reads the scene, and lists the outputs. */
static int find_outputs(regress_case *one) {
    vsh_scene *scene = NULL;
    vsh_flat_scene *flat = NULL;
    CLI_TRY(cli_check(one->command == &cli_flat ? vsh_flat_scene_read(one->path, &cli_run, &flat, &cli_error)
                                                : vsh_scene_read(one->path, &cli_run, &scene, &cli_error)));
    if (one->output == NULL && flat != NULL && flat->output != NULL) {
        one->output = cli_keep_text("%s", vshi_path_name(flat->output));
    }
    if (one->output != NULL) {
        add_line(&one->outputs, one->output);
    }
    for (size_t i = 0; one->output == NULL && one->command == &cli_bake && i < scene->receiver_count; ++i) {
        add_line(&one->outputs, cli_keep_text("%s", vshi_path_name(scene->receivers[i].output)));
    }
    vsh_scene_free(scene);
    vsh_flat_scene_free(flat);
    return one->outputs.count > 0
               ? CLI_OK
               : cli_usage("%s: nothing says what '%s' writes; give it an \"output\" in %s", one->path,
                           one->name, list_name);
}

/* A case that cannot be read or written is marked, so that the others go on. */
static int complete_case(regress_case *one) {
    if (one->command == NULL) {
        one->command = has_region(one->path) ? &cli_flat : &cli_bake;
    }
    CLI_TRY(check_options(one));
    int code = find_outputs(one);
    if (code == CLI_USAGE || code == CLI_FILE) {
        mark_failed(one, code);
        code = CLI_OK;
    }
    if (one->outputs.count == 0) { /* reported under the scene's own name */
        add_line(&one->outputs, one->output != NULL ? one->output : one->scene);
    }
    one->comparisons = calloc(one->outputs.count, sizeof *one->comparisons);
    return code;
}

/* Refuses two cases that have one name or write one file. */
static int check_unique(void) {
    for (size_t i = 0; i < work.case_count; ++i) {
        const regress_case *one = &work.cases[i];
        for (size_t k = 0; k <= i; ++k) {
            const regress_case *other = &work.cases[k];
            CLI_REFUSE_IF(k < i && strcmp(one->name, other->name) == 0,
                          "%s: two cases are named '%s'; name them in %s", work.settings.folder, one->name,
                          list_name);
            for (size_t a = 0; a < one->outputs.count; ++a) {
                for (size_t b = 0; b < (k < i ? other->outputs.count : a); ++b) {
                    CLI_REFUSE_IF(strcmp(one->outputs.line[a], other->outputs.line[b]) == 0,
                                  "%s: both '%s' and '%s' write '%s'", work.settings.folder, other->name,
                                  one->name, one->outputs.line[a]);
                }
            }
        }
    }
    return CLI_OK;
}

/* Finds the cases: those of regress.json, then the folder's other scenes by name. */
static int find_cases(void) {
    CLI_TRY(read_list(in_folder(work.settings.folder, list_name)));
    CLI_TRY(add_scenes());
    const char *only = work.settings.only;
    size_t kept = 0;
    for (size_t i = 0; i < work.case_count; ++i) {
        if (only == NULL || strstr(work.cases[i].name, only) != NULL) {
            const regress_case one = work.cases[i];
            work.cases[i] = work.cases[kept]; /* the others stay behind those that are kept */
            work.cases[kept++] = one;
        }
    }
    work.case_count = kept;
    if (kept == 0) {
        return only != NULL ? cli_usage("%s: no case has '%s' in its name", work.settings.folder, only)
                            : cli_usage("%s: no scenes (.json) in it", work.settings.folder);
    }
    for (size_t i = 0; i < kept; ++i) {
        CLI_TRY(complete_case(&work.cases[i]));
    }
    return check_unique();
}

/* --- baking, in child processes and before there are threads */

static int fail_making(const char *path) {
    return cli_refuse(CLI_FILE, "%s: cannot be made: %s", path, strerror(errno));
}

/* Makes the folder for new bakes; without --bakes it is temporary. */
static int make_folder(void) {
    const char *given = work.settings.bakes;
    if (given == NULL) {
        const char *place = getenv("TMPDIR");
        work.bakes =
            strdup(in_folder(place != NULL && place[0] == '/' ? place : "/tmp", "vdbshade-regress-XXXXXX"));
        return mkdtemp(work.bakes) != NULL ? CLI_OK : fail_making(work.bakes);
    }
    if (mkdir(given, 0777) == 0 || errno == EEXIST) {
        work.bakes = realpath(given, NULL);
    }
    return work.bakes != NULL ? CLI_OK : fail_making(given);
}

/* Removes the folder if it is temporary. */
static void remove_folder(void) {
    struct dirent **entries = NULL;
    if (work.settings.bakes != NULL || work.bakes == NULL) {
        return;
    }
    const int count = scandir(work.bakes, &entries, NULL, NULL);
    for (int i = 0; i < count; ++i) {
        unlink(in_folder(work.bakes, entries[i]->d_name)); /* fails for "." and ".." */
        free(entries[i]);
    }
    free(entries);
    rmdir(work.bakes);
}

/* Becomes this program in the folder of the scenes, because options name files relative to it. */
static void become_program(const lines *words, pid_t parent, int errors) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(errors, STDERR_FILENO);
    if (getppid() != parent) {
        _exit(CLI_INTERRUPTED);
    }
    if (chdir(work.settings.folder) == 0) {
        execv("/proc/self/exe", (char *const *)(void *)words->line);
    }
    static const char text[] = "vdbshade: a child process cannot be started\n";
    _exit(write(STDERR_FILENO, text, sizeof text - 1) > 0 ? CLI_FILE : CLI_DEFECT);
}

/* Prints a child's errors, and keeps the last line of vdbshade that is no warning. */
static void print_errors(int from) {
    static const char name[] = "vdbshade: ", warning[] = "vdbshade: warning";
    char line[CLI_LINE];
    FILE *errors = fdopen(from, "r");
    cli_end_progress(); /* these lines do not clear it */
    rewind(errors);
    while (fgets(line, sizeof line, errors) != NULL) {
        fputs(line, stderr);
        line[strcspn(line, "\n")] = '\0';
        if (strncmp(line, name, sizeof name - 1) == 0 && strncmp(line, warning, sizeof warning - 1) != 0) {
            snprintf(cli_last_line, sizeof cli_last_line, "%s", line + sizeof name - 1);
        }
    }
    fclose(errors);
}

/* Runs this program with the words of a command line, and returns its exit code; CLI_DEFECT if it dies. */
static int run_child(const regress_case *one, const lines *words) {
    fflush(NULL);
    const pid_t parent = getpid();
    const int errors = memfd_create("errors", MFD_CLOEXEC);
    const pid_t child = errors >= 0 ? fork() : -1;
    if (child < 0) {
        const int code = cli_refuse(CLI_LIMIT, "%s: no process for it: %s", one->scene, strerror(errno));
        close(errors);
        return code;
    }
    if (child == 0) {
        become_program(words, parent, errors);
    }
    int status = 0;
    while (waitpid(child, &status, WNOHANG) != child) {
        if (cli_interrupted()) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            break;
        }
        const struct timespec pause = {0, 2000000};
        nanosleep(&pause, NULL);
    }
    print_errors(errors);
    if (cli_interrupted()) {
        return cli_cancelled();
    }
    return WIFEXITED(status)
               ? WEXITSTATUS(status)
               : cli_refuse(CLI_DEFECT, "%s: its process ended by signal %d", one->scene, WTERMSIG(status));
}

static int bake(const regress_case *one) {
    static const char *const sandboxes[] = {"auto", "require", "off"};
    lines words = {NULL, 0};
    add_line(&words, "vdbshade");
    add_line(&words, one->command->name);
    /* a scene "--stats=x.json" is a file in the folder, and no option */
    add_line(&words, cli_keep_text("%s%s", one->scene[0] == '-' ? "./" : "", one->scene));
    for (size_t i = 0; i < one->options.count; ++i) {
        add_line(&words, one->options.line[i]);
    }
    add_line(&words, one->output != NULL ? cli_keep_text("--output=%s/%s", work.bakes, one->output)
                                         : cli_keep_text("--output=%s/", work.bakes));
    add_line(&words, "--quiet");
    add_line(&words, cli_keep_text("--memory-limit=%" PRIu64, cli_run.memory_limit));
    add_line(&words, cli_keep_text("--sandbox=%s", sandboxes[cli_given.sandbox]));
    if (cli_run.threads > 0) {
        add_line(&words, cli_keep_text("--threads=%d", cli_run.threads));
    }
    if (cli_given.allow_outside) {
        add_line(&words, "--allow-outside");
    }
    const int code = run_child(one, &words);
    free(words.line);
    return code;
}

static int bake_all(void) {
    for (size_t i = 0; i < work.case_count; ++i) {
        regress_case *one = &work.cases[i];
        if (one->status == FAILED) {
            continue;
        }
        one->status = UNLIKE;
        if (cli_report_progress(NULL, one->name, (double)i / (double)work.case_count) != 0) {
            return cli_cancelled();
        }
        cli_last_line[0] = '\0';
        const int code = bake(one);
        if (code == CLI_INTERRUPTED) {
            return code;
        }
        if (code != CLI_OK) {
            mark_failed(one, code);
        }
    }
    return CLI_OK;
}

/* --- comparing */

static int compare_case(regress_case *one) {
    one->status = ALIKE;
    for (size_t k = 0; k < one->outputs.count; ++k) {
        cli_comparison *c = &one->comparisons[k];
        const char *name = one->outputs.line[k], *golden = in_folder(work.golden, name);
        if (access(golden, F_OK) == 0) {
            CLI_TRY(cli_comparison_make(&work.settings.compare, golden, in_folder(work.bakes, name), c));
        } else {
            c->problem = cli_keep_text("no golden bake %s; 'vdbshade regress --update' makes it", golden);
        }
        one->status = c->alike ? one->status : UNLIKE;
    }
    return CLI_OK;
}

static int copy(const char *from, const char *to) {
    FILE *file = fopen(from, "rb");
    if (file == NULL) {
        return cli_refuse(CLI_FILE, "%s: cannot be read: %s", from, strerror(errno));
    }
    cli_temporary target;
    int code = cli_temporary_begin(&target, to);
    if (code == CLI_OK && cli_copy(file, target.file)) {
        code = cli_temporary_commit(&target);
    } else if (code == CLI_OK) {
        cli_temporary_abandon(&target);
        code = cli_refuse(CLI_FILE, "%s: cannot be copied to %s: %s", from, to, strerror(errno));
    }
    fclose(file);
    return code;
}

/* Replaces golden bakes, each whole or not at all. */
static int update_case(regress_case *one) {
    if (mkdir(work.golden, 0777) != 0 && errno != EEXIST) {
        return fail_making(work.golden);
    }
    for (size_t k = 0; k < one->outputs.count; ++k) {
        if (!one->comparisons[k].alike) {
            const char *to = in_folder(work.golden, one->outputs.line[k]);
            CLI_TRY(cli_check_links(work.golden, to));
            CLI_TRY(copy(in_folder(work.bakes, one->outputs.line[k]), to));
        }
    }
    one->status = UPDATED;
    return CLI_OK;
}

static int compare_all(void) {
    for (size_t i = 0; i < work.case_count; ++i) {
        if (work.cases[i].status == UNLIKE) {
            CLI_TRY(compare_case(&work.cases[i]));
        }
    }
    for (size_t i = 0; i < work.case_count && work.settings.update; ++i) {
        if (work.cases[i].status == UNLIKE) {
            CLI_TRY(update_case(&work.cases[i]));
        }
    }
    return CLI_OK;
}

/* --- reports */

static const char *describe_failure(const regress_case *one) {
    return cli_keep_text("the bake ended with exit code %d%s%s", one->code,
                         one->reason[0] != '\0' ? ": " : "", one->reason);
}

static void print_lines(void) {
    for (size_t i = 0; i < work.case_count; ++i) {
        const regress_case *one = &work.cases[i];
        printf("%s: %s\n", one->name, status_names[one->status]);
        for (size_t k = 0; k < one->outputs.count; ++k) {
            const cli_comparison *c = &one->comparisons[k];
            const char *name = one->outputs.line[k];
            if (one->status == FAILED) {
                printf("  %s: %s\n", name, describe_failure(one));
            } else if (one->status == UPDATED && c->golden == NULL) {
                printf("  %s: is the golden bake now\n", name);
            } else if (!c->alike) {
                cli_comparison_print(c, cli_keep_text("  %s: ", name));
            }
        }
    }
}

static void print_json(void) {
    json_t *cases = json_array();
    for (size_t i = 0; i < work.case_count; ++i) {
        const regress_case *one = &work.cases[i];
        const bool failed = one->status == FAILED;
        json_t *outputs = json_array();
        for (size_t k = 0; k < one->outputs.count && !failed; ++k) {
            json_array_append_new(outputs, cli_comparison_json(&one->comparisons[k]));
        }
        json_array_append_new(
            cases,
            json_pack("{s:o,s:s,s:o,s:o,s:o}", "name", cli_utf8_json(one->name), "status",
                      status_names[one->status], "exit_code", failed ? json_integer(one->code) : json_null(),
                      "reason", failed && one->reason[0] != '\0' ? cli_utf8_json(one->reason) : json_null(),
                      "outputs", outputs));
    }
    cli_write_json(NULL, json_pack("{s:o}", "cases", cases));
}

/* Writes JUnit and HTML, also for cases that were not baked. */
static int write_reports(void) {
    size_t count = 0, at = 0;
    for (size_t i = 0; i < work.case_count; ++i) {
        count += work.cases[i].outputs.count;
    }
    cli_comparison *all = calloc(count, sizeof *all);
    for (size_t i = 0; i < work.case_count; ++i) {
        const regress_case *one = &work.cases[i];
        for (size_t k = 0; k < one->outputs.count; ++k) {
            cli_comparison *c = &all[at++];
            *c = one->comparisons[k];
            c->name = in_folder(one->name, one->outputs.line[k]);
            if (one->status == FAILED && cli_comparison_problem(c, 0) == NULL) {
                c->problem = describe_failure(one);
            }
        }
    }
    const int code = cli_comparison_report(&work.settings.compare, all, at);
    free(all);
    return code;
}

/* --- the command */

/* Returns the exit code of the first failed case, else whether all cases are alike. */
static int find_verdict(void) {
    int code = CLI_OK;
    for (size_t i = 0; i < work.case_count; ++i) {
        const regress_case *one = &work.cases[i];
        if (one->status == FAILED && code <= CLI_UNLIKE) {
            code = one->code;
        } else if (one->status == UNLIKE && code == CLI_OK) {
            code = CLI_UNLIKE;
        }
    }
    return code;
}

static int run_cases(void) {
    const regress_settings *s = &work.settings;
    const char *const outputs[] = {s->compare.junit, s->compare.html};
    work.golden = in_folder(s->folder, "golden");
    CLI_TRY(find_cases());
    CLI_TRY(cli_check_outputs(outputs, CLI_COUNT(outputs), NULL, 0, NULL));
    CLI_TRY(make_folder());
    CLI_TRY(bake_all());
    CLI_TRY(compare_all());
    if (s->compare.json) {
        print_json();
    } else if (!cli_given.quiet) {
        print_lines();
    }
    CLI_TRY(write_reports());
    return find_verdict();
}

static int regress_main(int argc, char **argv) {
    work.settings.compare.options = vsh_compare_files_options_default();
    work.settings.compare.began = vshi_seconds();
    CLI_TRY(cli_parse(&cli_regress, argc, argv, &work.settings, &work.settings.folder));
    work.settings.compare.title = cli_keep_text("Bakes of %s", work.settings.folder);
    const int code = run_cases();
    remove_folder();
    for (size_t i = 0; i < work.case_count; ++i) {
        for (size_t k = 0; k < work.cases[i].outputs.count && work.cases[i].comparisons != NULL; ++k) {
            cli_comparison_free(&work.cases[i].comparisons[k]);
        }
    }
    return code;
}

const cli_command cli_regress = {
    "regress", "DIR [options]", "bakes a folder's scenes and compares them with golden bakes",
    "Bakes the scenes of a folder, and compares them with DIR/golden as 'vdbshade compare' does. Scenes\n"
    "are DIR/*.json. DIR/regress.json names cases with their own commands and options. Ends with 0 if\n"
    "all are alike, and with 1 if one is not, or has no golden bake. See docs/pipeline.md. Numbers in\n"
    "brackets are defaults.",
    CLI_ENDING(options, regress_main)};
