#define _GNU_SOURCE
#include "child.h"

#include "message.h"
#include "signals.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Between fork and exec: the threads of the libraries are not there, whatever they were in the middle of. */
static void become(const char *folder, char **words, pid_t parent, int errors) {
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

/* A child's standard error. */
typedef struct errors {
    int from; /* the pipe's end, which does not block */
    char line[1024];
    size_t length; /* of the line so far, maybe more than fits */
} errors;

/* Passes on what there is, and keeps errors: lines of ours that are no warnings. */
static void pass_errors(errors *e) {
    static const char name[] = "vdbshade: ", warning[] = "vdbshade: warning";
    char piece[4096];
    ssize_t count;
    while ((count = read(e->from, piece, sizeof piece)) > 0) {
        fwrite(piece, 1, (size_t)count, stderr);
        for (ssize_t i = 0; i < count; ++i) {
            if (piece[i] != '\n') {
                e->line[e->length < sizeof e->line - 1 ? e->length : sizeof e->line - 1] = piece[i];
                ++e->length;
                continue;
            }
            e->line[e->length < sizeof e->line - 1 ? e->length : sizeof e->line - 1] = '\0';
            if (strncmp(e->line, name, sizeof name - 1) == 0 &&
                strncmp(e->line, warning, sizeof warning - 1) != 0) {
                cli_keep_message(e->line + sizeof name - 1);
            }
            e->length = 0;
        }
    }
}

int cli_in_child(const char *what, const char *folder, char **words) {
    fflush(NULL);
    const pid_t parent = getpid();
    int ends[2];
    const bool piped = pipe2(ends, O_CLOEXEC | O_NONBLOCK) == 0;
    const pid_t child = piped ? fork() : -1;
    if (child < 0) {
        cli_say("%s: no process for it: %s", what, strerror(errno));
        if (piped) {
            close(ends[0]);
            close(ends[1]);
        }
        return CLI_LIMIT;
    }
    if (child == 0) {
        fcntl(ends[1], F_SETFL, 0); /* its end blocks */
        become(folder, words, parent, ends[1]);
    }
    close(ends[1]);
    errors e = {.from = ends[0]};
    int status = 0;
    while (waitpid(child, &status, WNOHANG) != child) {
        pass_errors(&e);
        if (cli_interrupted()) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            break;
        }
        const struct timespec pause = {0, 2000000};
        nanosleep(&pause, NULL);
    }
    pass_errors(&e);
    close(e.from);
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

/* --- what other processes see */

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#endif

/* Sanitizers look into their own process by way of another. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

enum { ASK_VERSION = 1 };

void cli_self_close(void) {
    if (!SANITIZED && syscall(SYS_landlock_create_ruleset, NULL, 0, ASK_VERSION) < 1) {
        prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
    }
}
