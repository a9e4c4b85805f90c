#include "child.h"

#include "message.h"
#include "signals.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

int cli_in_child(const char *what, int (*work)(void *user), void *user) {
    fflush(NULL);
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child < 0) {
        cli_say("%s: no process for it: %s", what, strerror(errno));
        return CLI_LIMIT;
    }
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) {
            _exit(CLI_INTERRUPTED);
        }
        const int code = work(user);
        const int flushed = fflush(NULL);
        _exit(flushed == 0 ? code : CLI_FILE);
    }
    int status = 0;
    while (waitpid(child, &status, WNOHANG) != child) {
        if (cli_interrupted()) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            const vsh_error cancelled = {VSH_ERROR_CANCELLED, ""};
            return cli_fail(&cancelled);
        }
        const struct timespec pause = {0, 2000000};
        nanosleep(&pause, NULL);
    }
    if (WIFEXITED(status)) {
        return WEXITSTATUS(status);
    }
    cli_say("%s: its process ended by signal %d", what, WTERMSIG(status));
    return CLI_DEFECT;
}
