/* The folder of new bakes, the child processes that bake into it, and golden bakes that are replaced. */
#define _GNU_SOURCE /* memfd_create */
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/regress/regress.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* --- the folder */

static int fail_making(const char *path) {
    cli_say("%s: cannot be made: %s", path, strerror(errno));
    return CLI_FILE;
}

int regress_make_folder(regress_work *work) {
    const char *given = work->settings->bakes;
    if (given == NULL) {
        const char *place = getenv("TMPDIR");
        work->bakes =
            regress_path(place != NULL && place[0] == '/' ? place : "/tmp", "vdbshade-regress-XXXXXX");
        return mkdtemp(work->bakes) != NULL ? CLI_OK : fail_making(work->bakes);
    }
    if (mkdir(given, 0777) != 0 && errno != EEXIST) {
        return fail_making(given);
    }
    work->bakes = realpath(given, NULL);
    return work->bakes != NULL ? CLI_OK : fail_making(given);
}

void regress_remove_folder(regress_work *work) {
    if (work->settings->bakes != NULL || work->bakes == NULL) {
        return;
    }
    struct dirent **entries = NULL;
    const int count = scandir(work->bakes, &entries, NULL, NULL);
    for (int i = 0; i < count; ++i) {
        char *path = regress_path(work->bakes, entries[i]->d_name);
        unlink(path); /* fails for "." and ".." */
        free(path);
        free(entries[i]);
    }
    free(entries);
    rmdir(work->bakes);
}

/* --- baking */

/* Runs between fork and exec: other threads are gone, so a lock that one of them held stays locked. */
static void become_program(const char *folder, char **words, pid_t parent, int errors) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(errors, STDERR_FILENO);
    if (getppid() != parent) {
        _exit(CLI_INTERRUPTED);
    }
    if (chdir(folder) == 0) {
        execv("/proc/self/exe", words);
    }
    static const char text[] = "vdbshade: a process of its own cannot be begun\n";
    _exit(write(STDERR_FILENO, text, sizeof text - 1) > 0 ? CLI_FILE : CLI_DEFECT);
}

/* Passes a child's errors on, and keeps the last: a line of ours that is no warning. */
static void pass_errors(int from) {
    static const char name[] = "vdbshade: ", warning[] = "vdbshade: warning";
    char line[1024];
    FILE *errors = fdopen(from, "r");
    rewind(errors);
    while (fgets(line, sizeof line, errors) != NULL) {
        fputs(line, stderr);
        line[strcspn(line, "\n")] = '\0';
        if (strncmp(line, name, sizeof name - 1) == 0 && strncmp(line, warning, sizeof warning - 1) != 0) {
            cli_keep_message(line + sizeof name - 1);
        }
    }
    fclose(errors);
}

/* Runs this program in `folder` with the words of a command line, NULL after the last, and returns its exit
 * code. Then passes its errors on; the last is cli_last_message(). If the child dies, says so of `what` and
 * returns CLI_DEFECT. */
static int run_child(const char *what, const char *folder, char **words) {
    fflush(NULL);
    const pid_t parent = getpid();
    const int errors = memfd_create("errors", MFD_CLOEXEC);
    const pid_t child = errors >= 0 ? fork() : -1;
    if (child < 0) {
        cli_say("%s: no process for it: %s", what, strerror(errno));
        close(errors);
        return CLI_LIMIT;
    }
    if (child == 0) {
        become_program(folder, words, parent, errors);
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
    pass_errors(errors);
    if (cli_interrupted()) { /* as the child was, maybe before it could take a signal */
        const vsh_error cancelled = {VSH_ERROR_CANCELLED, ""};
        return cli_fail(&cancelled);
    }
    if (WIFEXITED(status)) {
        return WEXITSTATUS(status);
    }
    cli_say("%s: its process ended by signal %d", what, WTERMSIG(status));
    return CLI_DEFECT;
}

static void list_words(const regress_work *work, const regress_case *one, regress_lines *words) {
    regress_add_line(words, "vdbshade");
    regress_add_line(words, "%s", one->command->name);
    /* a scene "--stats=x.json" is a file in the folder, and no option */
    regress_add_line(words, "%s%s", one->scene[0] == '-' ? "./" : "", one->scene);
    for (size_t i = 0; i < one->options.count; ++i) {
        regress_add_line(words, "%s", one->options.line[i]);
    }
    if (one->output != NULL) {
        regress_add_line(words, "--output=%s/%s", work->bakes, one->output);
    } else {
        regress_add_line(words, "--output-folder=%s", work->bakes);
    }
    regress_add_line(words, "--quiet");
    regress_add_line(words, "--memory-limit=%llu", (unsigned long long)cli_given.memory_limit);
    regress_add_line(words, "--sandbox=%s", cli_given.sandbox);
    if (cli_given.threads > 0) {
        regress_add_line(words, "--threads=%d", cli_given.threads);
    }
    if (cli_given.allow_outside) {
        regress_add_line(words, "--allow-outside");
    }
}

int regress_bake(const regress_work *work, const regress_case *one) {
    regress_lines words = {NULL, 0};
    list_words(work, one, &words);
    /* in the folder of the scenes, because options name files relative to it */
    const int code = run_child(one->scene, work->settings->folder, words.line);
    regress_free_lines(&words);
    return code;
}

/* --- golden bakes */

static int copy(const char *from, const char *to) {
    FILE *file = fopen(from, "rb");
    if (file == NULL) {
        cli_say("%s: cannot be read: %s", from, strerror(errno));
        return CLI_FILE;
    }
    cli_temporary target;
    int code;
    CLI_TRY_DONE(cli_temporary_begin(&target, to));
    char bytes[65536];
    size_t count;
    while ((count = fread(bytes, 1, sizeof bytes, file)) > 0 &&
           fwrite(bytes, 1, count, target.file) == count) {
    }
    if (!ferror(file)) {
        code = cli_temporary_commit(&target);
    } else {
        cli_say("%s: cannot be read", from);
        cli_temporary_abandon(&target);
        code = CLI_FILE;
    }
done:
    fclose(file);
    return code;
}

int regress_update(const regress_work *work, const char *output) {
    if (mkdir(work->golden, 0777) != 0 && errno != EEXIST) {
        return fail_making(work->golden);
    }
    char *from = regress_path(work->bakes, output), *to = regress_path(work->golden, output);
    int code = cli_check_links(work->golden, to);
    code = code == CLI_OK ? copy(from, to) : code;
    free(from);
    free(to);
    return code;
}
