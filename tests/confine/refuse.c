/* Imitates a kernel that lacks a part of the confinement: runs a command for which the named calls fail.
 * Usage: refuse [seccomp] [landlock] [limits] -- COMMAND … */
#include <errno.h>
#include <seccomp.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

static const struct {
    const char *name;
    int call, reason;
} refusals[] = {
    {"seccomp", SCMP_SYS(seccomp), ENOSYS},
    {"landlock", SCMP_SYS(landlock_create_ruleset), ENOSYS},
    {"landlock", SCMP_SYS(landlock_restrict_self), ENOSYS},
    {"limits", SCMP_SYS(setrlimit), EPERM},
};

int main(int argc, char **argv) {
    const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    int failed = filter == NULL;
    int word = 1;
    for (; word < argc && strcmp(argv[word], "--") != 0; ++word) {
        for (size_t i = 0; i < sizeof refusals / sizeof refusals[0]; ++i) {
            if (strcmp(argv[word], refusals[i].name) == 0) {
                failed |= seccomp_rule_add(filter, SCMP_ACT_ERRNO((unsigned)refusals[i].reason),
                                           refusals[i].call, 0);
            }
        }
        if (strcmp(argv[word], "seccomp") == 0) {
            failed |= seccomp_rule_add(filter, SCMP_ACT_ERRNO(EINVAL), SCMP_SYS(prctl), 1,
                                       SCMP_A0(SCMP_CMP_EQ, PR_SET_SECCOMP, 0));
        } else if (strcmp(argv[word], "limits") == 0) {
            failed |= seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(prlimit64), 1,
                                       SCMP_A2(SCMP_CMP_NE, 0, 0));
        }
    }
    if (failed != 0 || word + 1 >= argc || seccomp_load(filter) != 0) {
        fputs("refuse: no such filter here\n", stderr);
        return 99;
    }
    execvp(argv[word + 1], argv + word + 1);
    return 98;
}
