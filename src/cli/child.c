#define _GNU_SOURCE
#include "child.h"

#include "message.h"
#include "signals.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Between fork and exec: the threads of the libraries are not there, whatever they were in the middle of. */
static void become(const char *folder, char **words, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) {
        _exit(CLI_INTERRUPTED);
    }
    if (chdir(folder) == 0) {
        execv("/proc/self/exe", words);
    }
    static const char text[] = "vdbshade: a process of its own cannot be begun\n";
    _exit(write(STDERR_FILENO, text, sizeof text - 1) > 0 ? CLI_FILE : CLI_DEFECT);
}

int cli_in_child(const char *what, const char *folder, char **words) {
    fflush(NULL);
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0) {
        cli_say("%s: no process for it: %s", what, strerror(errno));
        return CLI_LIMIT;
    }
    if (child == 0) {
        become(folder, words, parent);
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
