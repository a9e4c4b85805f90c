/* Makes each system call directly, without the C library. */
#define _GNU_SOURCE
#include "hostile.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/sched.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

enum { PATH_ROOM = 4096 };

typedef struct trial {
    const hostile_aim *aim;
    char *done;
    size_t room;
    int count;
    char marker[PATH_ROOM], kept[PATH_ROOM];
} trial;

/* Notes a call that was let through. A call that the kernel refuses for another reason was let through,
 * too. */
static void note(trial *t, const char *name, long result) {
    ++t->count;
    if (result >= 0 || (errno != EPERM && errno != ENOSYS)) {
        const size_t used = strlen(t->done);
        snprintf(t->done + used, t->room - used, " %s", name);
    }
}

static void write_files(trial *t) {
    const char *marker = t->marker, *kept = t->kept;
    note(t, "openat-create", syscall(SYS_openat, AT_FDCWD, marker, O_WRONLY | O_CREAT, 0666));
    note(t, "openat-write", syscall(SYS_openat, AT_FDCWD, kept, O_WRONLY));
    note(t, "openat-both", syscall(SYS_openat, AT_FDCWD, kept, O_RDWR));
    note(t, "openat-truncate", syscall(SYS_openat, AT_FDCWD, kept, O_RDONLY | O_TRUNC));
    note(t, "openat-append", syscall(SYS_openat, AT_FDCWD, kept, O_RDONLY | O_APPEND));
    note(t, "openat-unnamed", syscall(SYS_openat, AT_FDCWD, t->aim->folder, O_TMPFILE | O_RDWR, 0666));
    const uint64_t how[3] = {O_WRONLY | O_CREAT, 0666, 0};
    note(t, "openat2", syscall(SYS_openat2, AT_FDCWD, marker, how, sizeof how));
    note(t, "mkdirat", syscall(SYS_mkdirat, AT_FDCWD, marker, 0777));
    note(t, "mknodat", syscall(SYS_mknodat, AT_FDCWD, marker, S_IFIFO | 0666, 0));
    note(t, "symlinkat", syscall(SYS_symlinkat, kept, AT_FDCWD, marker));
    note(t, "linkat", syscall(SYS_linkat, AT_FDCWD, kept, AT_FDCWD, marker, 0));
    note(t, "renameat2", syscall(SYS_renameat2, AT_FDCWD, kept, AT_FDCWD, marker, 0));
    note(t, "unlinkat", syscall(SYS_unlinkat, AT_FDCWD, kept, 0));
    note(t, "truncate", syscall(SYS_truncate, kept, 0L));
    note(t, "fchmodat", syscall(SYS_fchmodat, AT_FDCWD, kept, 0));
    note(t, "fchownat", syscall(SYS_fchownat, AT_FDCWD, kept, 1, 1, 0));
    note(t, "utimensat", syscall(SYS_utimensat, AT_FDCWD, kept, NULL, 0));
    note(t, "setxattr", syscall(SYS_setxattr, kept, "user.marker", "x", 1UL, 0));
    note(t, "memfd_create", syscall(SYS_memfd_create, "x", 0U));
}

/* If a call made a child, the child leaves a marker, and ends. */
static void end_child(const trial *t, long result) {
    if (result == 0) {
        syscall(SYS_openat, AT_FDCWD, t->marker, O_WRONLY | O_CREAT, 0666);
        syscall(SYS_exit_group, 0);
    }
}

static void start_processes(trial *t) {
    long result = syscall(SYS_clone, SIGCHLD, NULL, NULL, NULL, NULL);
    end_child(t, result);
    note(t, "clone", result);
    struct clone_args arguments = {.exit_signal = SIGCHLD};
    result = syscall(SYS_clone3, &arguments, sizeof arguments);
    end_child(t, result);
    note(t, "clone3", result);
    char *const words[] = {(char *)"/bin/touch", t->marker, NULL}, *const none[] = {NULL};
#ifdef SYS_fork
    result = syscall(SYS_fork);
    end_child(t, result);
    note(t, "fork", result);
#endif
    note(t, "execve", syscall(SYS_execve, words[0], words, none));
    note(t, "execveat", syscall(SYS_execveat, AT_FDCWD, words[0], words, none, 0));
}

static void send_signals(trial *t) {
    const int victim = t->aim->victim;
    siginfo_t info = {.si_signo = SIGUSR1, .si_code = SI_QUEUE};
    note(t, "kill", syscall(SYS_kill, victim, SIGUSR1));
    note(t, "kill-group", syscall(SYS_kill, 0, 0));
    note(t, "tkill", syscall(SYS_tkill, victim, SIGUSR1));
    note(t, "tgkill", syscall(SYS_tgkill, victim, victim, SIGUSR1));
    note(t, "rt_sigqueueinfo", syscall(SYS_rt_sigqueueinfo, victim, SIGUSR1, &info));
    note(t, "rt_tgsigqueueinfo", syscall(SYS_rt_tgsigqueueinfo, victim, victim, SIGUSR1, &info));
    note(t, "pidfd_open", syscall(SYS_pidfd_open, victim, 0));
    note(t, "pidfd_send_signal", syscall(SYS_pidfd_send_signal, STDIN_FILENO, SIGUSR1, NULL, 0));
    note(t, "F_SETOWN", syscall(SYS_fcntl, STDIN_FILENO, F_SETOWN, victim));
    const struct f_owner_ex owner = {F_OWNER_PID, victim};
    note(t, "F_SETOWN_EX", syscall(SYS_fcntl, STDIN_FILENO, F_SETOWN_EX, &owner));
    note(t, "F_SETSIG", syscall(SYS_fcntl, STDIN_FILENO, F_SETSIG, SIGUSR1));
    note(t, "F_SETFL", syscall(SYS_fcntl, STDIN_FILENO, F_SETFL, O_ASYNC));
    note(t, "F_NOTIFY", syscall(SYS_fcntl, STDIN_FILENO, F_NOTIFY, 0));
    struct sigevent event = {.sigev_notify = SIGEV_SIGNAL, .sigev_signo = SIGUSR1};
    int timer;
    note(t, "timer_create", syscall(SYS_timer_create, CLOCK_MONOTONIC, &event, &timer));
}

static void reach_out(trial *t) {
    note(t, "socket-unix", syscall(SYS_socket, AF_UNIX, SOCK_STREAM, 0));
    note(t, "socket-inet", syscall(SYS_socket, AF_INET, SOCK_STREAM, 0));
    note(t, "socket-netlink", syscall(SYS_socket, AF_NETLINK, SOCK_RAW, 0));
    note(t, "shmget", syscall(SYS_shmget, 0, 4096L, 0600));
    note(t, "msgget", syscall(SYS_msgget, 0, 0600));
    note(t, "keyctl", syscall(SYS_keyctl, 0, -3, 0)); /* the session's keyring */
    note(t, "io_uring_setup", syscall(SYS_io_uring_setup, 1, NULL));
    note(t, "inotify_init1", syscall(SYS_inotify_init1, 0));
    note(t, "bpf", syscall(SYS_bpf, 0, NULL, 0));
    note(t, "perf_event_open", syscall(SYS_perf_event_open, NULL, 0, -1, -1, 0));
    note(t, "userfaultfd", syscall(SYS_userfaultfd, 1));
    note(t, "ioctl", syscall(SYS_ioctl, STDIN_FILENO, 0x5451 /* FIOCLEX */, 0));
}

static void change_itself(trial *t) {
    const struct rlimit wide = {RLIM_INFINITY, RLIM_INFINITY};
    note(t, "setrlimit", syscall(SYS_setrlimit, RLIMIT_CORE, &wide));
    note(t, "prlimit64", syscall(SYS_prlimit64, t->aim->victim, RLIMIT_NOFILE, NULL, &wide));
    note(t, "prctl-dumpable", syscall(SYS_prctl, PR_SET_DUMPABLE, 1, 0, 0, 0));
    note(t, "prctl-parent-death", syscall(SYS_prctl, PR_SET_PDEATHSIG, 0, 0, 0, 0));
    note(t, "setpriority", syscall(SYS_setpriority, PRIO_PROCESS, t->aim->victim, 0));
    note(t, "setsid", syscall(SYS_setsid));
    note(t, "unshare", syscall(SYS_unshare, CLONE_NEWUSER));
    note(t, "chroot", syscall(SYS_chroot, "/"));
    note(t, "chdir", syscall(SYS_chdir, "/"));
    note(t, "mount", syscall(SYS_mount, "none", t->aim->folder, "none", MS_BIND, NULL));
    note(t, "personality", syscall(SYS_personality, 0xffffffffUL));
    note(t, "ptrace", syscall(SYS_ptrace, PTRACE_SEIZE, t->aim->victim, 0, 0));
}

static trial begin(const hostile_aim *aim, char *done, size_t room) {
    trial t = {.aim = aim, .done = done, .room = room, .count = 0};
    snprintf(t.marker, sizeof t.marker, "%s/marker", aim->folder);
    snprintf(t.kept, sizeof t.kept, "%s/kept", aim->folder);
    done[0] = '\0';
    return t;
}

int hostile_calls(const hostile_aim *aim, char *done, size_t room) {
    trial t = begin(aim, done, room);
    write_files(&t);
    start_processes(&t);
    send_signals(&t);
    reach_out(&t);
    change_itself(&t);
    return t.count;
}

static void note_read(trial *t, const char *name, long result) {
    errno = EPERM;
    note(t, name, result);
}

static void read_file(trial *t, const char *name, const char *path) {
    char bytes[64];
    const int file = (int)syscall(SYS_openat, AT_FDCWD, path, O_RDONLY);
    note_read(t, name, file); /* opening it is enough */
    if (file >= 0) {
        note_read(t, name, read(file, bytes, sizeof bytes) > 0 ? 0 : -1);
        close(file);
    }
}

static void read_parent(trial *t, const char *name) {
    char path[PATH_ROOM];
    snprintf(path, sizeof path, "/proc/%d/%s", t->aim->parent, name);
    read_file(t, name, path);
}

int hostile_reads(const hostile_aim *aim, char *done, size_t room) {
    trial t = begin(aim, done, room);
    static const char *const names[] = {"environ", "mem", "maps", "cmdline", "stat"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        read_parent(&t, names[i]);
    }
    read_file(&t, "own-environ", "/proc/self/environ");
    read_file(&t, "passwd", "/etc/passwd");
    if (aim->outside != NULL) {
        read_file(&t, "outside", aim->outside);
    }
    note_read(&t, "token", getenv("TOKEN_OF_THE_HOST") != NULL ? 0 : -1);
    char word[8];
    const struct iovec here = {word, sizeof word}, there = {word, sizeof word};
    note(&t, "process_vm_readv", syscall(SYS_process_vm_readv, aim->parent, &here, 1UL, &there, 1UL, 0UL));
    note(&t, "ptrace", syscall(SYS_ptrace, PTRACE_SEIZE, aim->parent, 0, 0));
    char link[PATH_ROOM];
    snprintf(link, sizeof link, "/proc/%d/exe", aim->parent);
    note_read(&t, "exe", syscall(SYS_readlinkat, AT_FDCWD, link, word, sizeof word));
    return t.count;
}
