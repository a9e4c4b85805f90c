#define _GNU_SOURCE
#include "sandbox/confine.h"

#include "sandbox/reader.h"
#include "sandbox/tasks.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

/* Address space beyond the memory limit: libraries, stacks of the thread pool, arenas of the allocator. */
static const uint64_t address_space_slack = (uint64_t)2 << 30;

static const uint64_t most_stack = (uint64_t)8 << 20;

enum { MOST_FILES = 64 };

static bool limit(int what, rlim_t most) {
    struct rlimit now;
    if (getrlimit((__rlimit_resource_t)what, &now) == 0 && most > now.rlim_max) {
        most = now.rlim_max;
    }
    /* who passes both limits of time at once is killed, and does not say of what */
    const struct rlimit limits = {most, what == RLIMIT_CPU && most < now.rlim_max ? most + 1 : most};
    return setrlimit((__rlimit_resource_t)what, &limits) == 0;
}

static uint64_t stacks(void) {
    struct rlimit stack;
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    const bool less = getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur < most_stack;
    return (uint64_t)(cores > 0 ? cores : 1) * (less ? (uint64_t)stack.rlim_cur : most_stack);
}

bool vshi_confine_resources(uint64_t memory, uint64_t beside, double seconds) {
    if (memory == 0) {
        memory = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGE_SIZE);
    }
    bool all = prctl(PR_SET_PDEATHSIG, SIGKILL) == 0;
    all = prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && all;
    if (!VSHI_SANITIZED) { /* whose runtime reads /proc/self */
        all = prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) == 0 && all;
    }
    all = limit(RLIMIT_CORE, 0) && all;
    all = limit(RLIMIT_CPU, (rlim_t)ceil(seconds) + 1) && all;
    all = limit(RLIMIT_NOFILE, MOST_FILES) && all;
    if (memory < UINT64_MAX - address_space_slack) {
        all = limit(RLIMIT_FSIZE, (rlim_t)memory + (1 << 20)) && all;
        if (!VSHI_SANITIZED) {
            all = limit(RLIMIT_AS, (rlim_t)(memory + address_space_slack)) && all;
            all = limit(RLIMIT_DATA, (rlim_t)(memory + beside + stacks())) && all;
        }
    }
    signal(SIGXFSZ, SIG_IGN); /* the write fails instead */
    return all && !VSHI_SANITIZED;
}

/* Calls that parsing needs, whatever their arguments. */
static const int allowed[] = {
    SCMP_SYS(access),
    SCMP_SYS(arch_prctl),
    SCMP_SYS(brk),
    SCMP_SYS(clock_getres),
    SCMP_SYS(clock_gettime),
    SCMP_SYS(clock_nanosleep),
    SCMP_SYS(close),
    SCMP_SYS(dup),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
    SCMP_SYS(faccessat),
    SCMP_SYS(faccessat2),
    SCMP_SYS(fadvise64),
    SCMP_SYS(fstat),
    SCMP_SYS(fstatfs),
    SCMP_SYS(futex),
    SCMP_SYS(getcpu),
    SCMP_SYS(getcwd),
    SCMP_SYS(getdents64),
    SCMP_SYS(getegid),
    SCMP_SYS(geteuid),
    SCMP_SYS(getgid),
    SCMP_SYS(getpid),
    SCMP_SYS(getppid),
    SCMP_SYS(getrandom),
    SCMP_SYS(getrlimit),
    SCMP_SYS(getrusage),
    SCMP_SYS(gettid),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(getuid),
    SCMP_SYS(lseek),
    SCMP_SYS(lstat),
    SCMP_SYS(madvise),
    SCMP_SYS(membarrier),
    SCMP_SYS(mmap),
    SCMP_SYS(mprotect),
    SCMP_SYS(mremap),
    SCMP_SYS(munmap),
    SCMP_SYS(nanosleep),
    SCMP_SYS(newfstatat),
    SCMP_SYS(poll),
    SCMP_SYS(ppoll),
    SCMP_SYS(pread64),
    SCMP_SYS(preadv),
    SCMP_SYS(pwrite64),
    SCMP_SYS(read),
    SCMP_SYS(readlink),
    SCMP_SYS(readlinkat),
    SCMP_SYS(readv),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(rseq),
    SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sched_getaffinity),
    SCMP_SYS(sched_yield),
    SCMP_SYS(set_robust_list),
    SCMP_SYS(set_tid_address),
    SCMP_SYS(sigaltstack),
    SCMP_SYS(stat),
    SCMP_SYS(statx),
    SCMP_SYS(sysinfo),
    SCMP_SYS(uname),
    SCMP_SYS(write),
    SCMP_SYS(writev),
};

/* Of fcntl(): not the ones that send signals (F_SETOWN, F_SETSIG, F_NOTIFY). */
static const int allowed_of_descriptors[] = {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL};

/* Calls that depend on an argument: opening for reading, threads of this process, limits that are asked for,
 * and signals to itself (abort). */
static int add_conditional(scmp_filter_ctx filter) {
    const scmp_datum_t writes = O_ACCMODE | O_CREAT | O_TRUNC | O_APPEND | (O_TMPFILE & ~O_DIRECTORY);
    const scmp_datum_t self = (scmp_datum_t)getpid();
    int failed = 0;
    failed |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(openat), 1,
                               SCMP_A2(SCMP_CMP_MASKED_EQ, writes, O_RDONLY));
    failed |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(clone), 1,
                               SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD));
    failed |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1, SCMP_A0(SCMP_CMP_EQ, self, 0));
    failed |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), 2, SCMP_A0(SCMP_CMP_EQ, 0, 0),
                               SCMP_A2(SCMP_CMP_EQ, 0, 0));
    for (size_t i = 0; i < sizeof allowed_of_descriptors / sizeof allowed_of_descriptors[0]; ++i) {
        failed |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(fcntl), 1,
                                   SCMP_A1(SCMP_CMP_EQ, (scmp_datum_t)allowed_of_descriptors[i], 0));
    }
    /* its arguments lie in memory, where no filter sees them: the C library falls back to clone */
    failed |= seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
    return failed;
}

/* Loads it into every thread, those that libraries have begun before main too: a filter of one thread is
 * none, as that thread may write over the stack of another. Calls of another kind of machine (32 bit, x32)
 * end the process, and not a thread that others may wait for. */
static bool load_filter(void) {
    const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (filter == NULL) {
        return false;
    }
    int failed = seccomp_attr_set(filter, SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
    failed |= seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    for (size_t i = 0; i < sizeof allowed / sizeof allowed[0]; ++i) {
        /* a call that this kind of machine does not have is none to allow */
        const int added = seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0);
        failed |= added == -EDOM ? 0 : added;
    }
    failed |= add_conditional(filter);
    const bool loaded = failed == 0 && seccomp_load(filter) == 0;
    seccomp_release(filter);
    return loaded;
}

int vshi_confine_calls(void) {
    if (VSHI_SANITIZED) {
        return VSHI_CALLS_FREE;
    }
    const int before = vshi_task_filters();
    if (!load_filter()) {
        return VSHI_CALLS_FREE;
    }
    static const int outcomes[] = {[VSHI_TASKS_UNSEEN] = VSHI_CALLS_FREE,
                                   [VSHI_TASKS_FILTERED] = VSHI_CALLS_CONFINED,
                                   [VSHI_TASKS_LOOSE] = VSHI_CALLS_IN_PART};
    return outcomes[vshi_tasks_filtered(before)];
}
