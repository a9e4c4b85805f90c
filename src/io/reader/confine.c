/* A reader before it parses or loads a library that parses: reads its request, and confines itself. */
#define _GNU_SOURCE
#include "io/reader/confine.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

/* --- the request */

bool vshi_request_read(vshi_request *request) {
    struct stat status;
    if (fstat(VSHI_READER_REQUEST, &status) != 0 || status.st_size <= 0) {
        return false;
    }
    const void *map = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE, VSHI_READER_REQUEST, 0);
    if (map == MAP_FAILED) {
        return false;
    }
    vshi_decoder decoder = {map, (const unsigned char *)map + status.st_size, false};
    if (vshi_decode_count(&decoder, UINT64_MAX) != VSHI_REQUEST_MAGIC ||
        vshi_decode_count(&decoder, UINT64_MAX) != VSHI_READER_PROTOCOL) {
        return false;
    }
    *request = (vshi_request){.kind = vshi_decode_count(&decoder, VSHI_READ_KINDS - 1)};
    request->parent = vshi_decode_count(&decoder, INT32_MAX);
    request->memory = vshi_decode_count(&decoder, UINT64_MAX);
    request->seconds = vshi_decode_number(&decoder);
    request->demanded = vshi_decode_count(&decoder, 1) != 0;
    request->outside = vshi_decode_count(&decoder, 1) != 0;
    request->path = vshi_decode_text(&decoder, false);
    request->folder_count = (size_t)vshi_decode_count(&decoder, VSHI_MOST_FOLDERS);
    for (size_t i = 0; i < request->folder_count; ++i) {
        request->folders[i] = vshi_decode_text(&decoder, false);
        decoder.bad = decoder.bad || request->folders[i] == NULL;
    }
    request->rest = decoder;
    return !decoder.bad && request->path != NULL;
}

const char *vshi_missing_text(uint64_t confined, char text[VSHI_MISSING_TEXT]) {
    static const struct {
        uint32_t bit;
        const char *name;
    } parts[] = {{VSH_CONFINED_LIMITS, "limits of resources"},
                 {VSH_CONFINED_CALLS, "seccomp (system calls)"},
                 {VSH_CONFINED_FILES, "Landlock (files)"}};
    text[0] = '\0';
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; ++i) {
        if ((confined & parts[i].bit) == 0) {
            const size_t used = strlen(text);
            snprintf(text + used, VSHI_MISSING_TEXT - used, "%s%s", used > 0 ? ", " : "", parts[i].name);
        }
    }
    return text;
}

int vshi_task_count(void) {
    DIR *tasks = opendir("/proc/self/task");
    int count = 0;
    for (const struct dirent *entry; tasks != NULL && (entry = readdir(tasks)) != NULL;) {
        count += entry->d_name[0] != '.';
    }
    if (tasks != NULL) {
        closedir(tasks);
    }
    return count;
}

/* --- limits of resources */

/* Address space beyond the memory limit: libraries, stacks of the thread pool, arenas of the allocator. */
static const uint64_t address_space_slack = (uint64_t)2 << 30;

static const uint64_t most_stack = (uint64_t)8 << 20;

enum { MOST_FILES = 64 };

static bool limit(int what, rlim_t most) {
    struct rlimit now;
    if (getrlimit((__rlimit_resource_t)what, &now) == 0 && most > now.rlim_max) {
        most = now.rlim_max;
    }
    /* SIGXCPU tells the reason; the hard limit kills without one */
    const struct rlimit limits = {most, what == RLIMIT_CPU && most < now.rlim_max ? most + 1 : most};
    return setrlimit((__rlimit_resource_t)what, &limits) == 0;
}

static uint64_t stack_bytes(void) {
    struct rlimit stack;
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    const bool less = getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur < most_stack;
    return (uint64_t)(cores > 0 ? cores : 1) * (less ? (uint64_t)stack.rlim_cur : most_stack);
}

bool vshi_confine_resources(uint64_t memory, uint64_t base, double seconds) {
    if (memory == 0) {
        memory = (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGE_SIZE);
    }
    bool all = prctl(PR_SET_PDEATHSIG, SIGKILL) == 0;
    all = prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && all;
    if (!VSHI_SANITIZED) { /* a sanitizer reads /proc/self */
        all = prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) == 0 && all;
    }
    all = limit(RLIMIT_CORE, 0) && all;
    all = limit(RLIMIT_CPU, (rlim_t)ceil(seconds) + 1) && all;
    all = limit(RLIMIT_NOFILE, MOST_FILES) && all;
    if (memory < UINT64_MAX - address_space_slack) {
        all = limit(RLIMIT_FSIZE, (rlim_t)memory + (1 << 20)) && all;
        if (!VSHI_SANITIZED) {
            all = limit(RLIMIT_AS, (rlim_t)(memory + address_space_slack)) && all;
            all = limit(RLIMIT_DATA, (rlim_t)(memory + base + stack_bytes())) && all;
        }
    }
    signal(SIGXFSZ, SIG_IGN); /* the write fails instead */
    return all && !VSHI_SANITIZED;
}

/* --- a filter of system calls */

/* Calls that parsing needs, with any arguments. */
static const int allowed[] = VSHI_LIST(
    SCMP_SYS(access), SCMP_SYS(arch_prctl), SCMP_SYS(brk), SCMP_SYS(clock_getres), SCMP_SYS(clock_gettime),
    SCMP_SYS(clock_nanosleep), SCMP_SYS(close), SCMP_SYS(dup), SCMP_SYS(exit), SCMP_SYS(exit_group),
    SCMP_SYS(faccessat), SCMP_SYS(faccessat2), SCMP_SYS(fadvise64), SCMP_SYS(fstat), SCMP_SYS(fstatfs),
    SCMP_SYS(futex), SCMP_SYS(getcpu), SCMP_SYS(getcwd), SCMP_SYS(getdents64), SCMP_SYS(getegid),
    SCMP_SYS(geteuid), SCMP_SYS(getgid), SCMP_SYS(getpid), SCMP_SYS(getppid), SCMP_SYS(getrandom),
    SCMP_SYS(getrlimit), SCMP_SYS(getrusage), SCMP_SYS(gettid), SCMP_SYS(gettimeofday), SCMP_SYS(getuid),
    SCMP_SYS(lseek), SCMP_SYS(lstat), SCMP_SYS(madvise), SCMP_SYS(membarrier), SCMP_SYS(mmap),
    SCMP_SYS(mprotect), SCMP_SYS(mremap), SCMP_SYS(munmap), SCMP_SYS(nanosleep), SCMP_SYS(newfstatat),
    SCMP_SYS(poll), SCMP_SYS(ppoll), SCMP_SYS(pread64), SCMP_SYS(preadv), SCMP_SYS(pwrite64), SCMP_SYS(read),
    SCMP_SYS(readlink), SCMP_SYS(readlinkat), SCMP_SYS(readv), SCMP_SYS(restart_syscall), SCMP_SYS(rseq),
    SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn), SCMP_SYS(sched_getaffinity),
    SCMP_SYS(sched_yield), SCMP_SYS(set_robust_list), SCMP_SYS(set_tid_address), SCMP_SYS(sigaltstack),
    SCMP_SYS(stat), SCMP_SYS(statx), SCMP_SYS(sysinfo), SCMP_SYS(uname), SCMP_SYS(write), SCMP_SYS(writev));

/* Commands of fcntl(), without those that send signals (F_SETOWN, F_SETSIG, F_NOTIFY). */
static const int allowed_commands[] = {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL};

/* Allows some calls with some arguments: opening for reading, beginning threads, reading limits, and signals
 * to itself (abort). */
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
    for (size_t i = 0; i < sizeof allowed_commands / sizeof allowed_commands[0]; ++i) {
        failed |= seccomp_rule_add(filter, SCMP_ACT_ALLOW, SCMP_SYS(fcntl), 1,
                                   SCMP_A1(SCMP_CMP_EQ, (scmp_datum_t)allowed_commands[i], 0));
    }
    /* a filter cannot see arguments in memory: without clone3, the C library calls clone */
    failed |= seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0);
    return failed;
}

/* Allows only the system calls that parsing needs; others fail with EPERM. Returns false if the system allows
 * no filter, and in a sanitized build. The kernel filters every thread or none, also those that libraries
 * have begun before main: a filtered thread could write to the stack of one without a filter. Calls of other
 * machines (32 bit, x32) end the process, not only a thread that others may wait for. */
static bool confine_calls(void) {
    const scmp_filter_ctx filter = VSHI_SANITIZED ? NULL : seccomp_init(SCMP_ACT_ERRNO(EPERM));
    if (filter == NULL) {
        return false;
    }
    int failed = seccomp_attr_set(filter, SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_KILL_PROCESS);
    failed |= seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    for (size_t i = 0; i < sizeof allowed / sizeof allowed[0]; ++i) {
        /* EDOM: this machine has no such call */
        const int added = seccomp_rule_add(filter, SCMP_ACT_ALLOW, allowed[i], 0);
        failed |= added == -EDOM ? 0 : added;
    }
    failed |= add_conditional(filter);
    const bool loaded = failed == 0 && seccomp_load(filter) == 0;
    seccomp_release(filter);
    return loaded;
}

/* --- files, by Landlock (Linux 5.13). The C library has no functions for it, and older headers lack some of
 * the rights (linux/landlock.h). */

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#define SYS_landlock_add_rule 445
#define SYS_landlock_restrict_self 446
#endif

enum { ASK_VERSION = 1, RULE_PATH_BENEATH = 1 };

/* Bits: rights to files. */
enum {
    EXECUTE = 1 << 0,
    READ_FILE = 1 << 2,
    READ_FOLDER = 1 << 3,
    ALL_OF_1 = (1 << 13) - 1, /* version 1: also writing, making, removing */
    REFER = 1 << 13,          /* from version 2 */
    TRUNCATE = 1 << 14,       /* from version 3 */
    DEVICE_CALLS = 1 << 15    /* ioctl(), from version 5 */
};

enum { TCP = 3 /* bind and connect, from version 4 */, ALONE = 3 /* abstract sockets, signals; from 6 */ };

struct ruleset {
    uint64_t files, network, scopes;
};

struct __attribute__((packed)) rule {
    uint64_t rights;
    int32_t folder;
};

int vshi_landlock_version(void) {
    const long version = syscall(SYS_landlock_create_ruleset, NULL, 0, ASK_VERSION);
    return version > 0 ? (int)version : 0;
}

/* Ignores missing files. */
static void allow_path(int ruleset, const char *path) {
    const int file = open(path, O_PATH | O_CLOEXEC);
    struct stat status;
    if (file >= 0 && fstat(file, &status) == 0) {
        const struct rule rule = {S_ISDIR(status.st_mode) ? READ_FILE | READ_FOLDER : READ_FILE, file};
        syscall(SYS_landlock_add_rule, ruleset, RULE_PATH_BENEATH, &rule, 0);
    }
    if (file >= 0) {
        close(file);
    }
}

/* Allows each folder of a list like LD_LIBRARY_PATH. */
static void allow_list(int ruleset, const char *list) {
    while (list != NULL && *list != '\0') {
        char path[PATH_MAX];
        const size_t length = strcspn(list, ":;");
        if (length > 0 && length < sizeof path) {
            snprintf(path, sizeof path, "%.*s", (int)length, list);
            allow_path(ruleset, path);
        }
        list += length + (list[length] != '\0');
    }
}

static void allow_libraries(int ruleset, const vshi_request *request) {
    static const char *const folders[] = {"/usr",           "/lib",
                                          "/lib64",         "/etc/ld.so.cache",
                                          "/etc/localtime", "/sys/devices/system",
                                          "/proc/self/exe", "/proc/self/task",
                                          "/proc/meminfo",  "/dev/null",
                                          "/dev/urandom"};
    for (size_t i = 0; i < sizeof folders / sizeof folders[0]; ++i) {
        allow_path(ruleset, folders[i]);
    }
    for (size_t i = 0; i < request->folder_count; ++i) {
        allow_path(ruleset, request->folders[i]);
    }
    allow_list(ruleset, getenv("LD_LIBRARY_PATH"));
    allow_list(ruleset, getenv("LD_PRELOAD"));
}

/* A model names other files in its folder. All other kinds of inputs are one file. */
static void allow_inputs(int ruleset, const vshi_request *request) {
    char folder[PATH_MAX];
    allow_path(ruleset, request->path);
    if (request->kind != VSHI_READ_MODEL && request->kind != VSHI_READ_DRACO) {
        return;
    }
    const char *slash = strrchr(request->path, '/');
    const size_t length = slash != NULL ? (size_t)(slash - request->path) + 1 : 0;
    if (request->outside) {
        allow_path(ruleset, "/");
    } else if (length < sizeof folder) {
        snprintf(folder, sizeof folder, "%.*s", (int)length, request->path);
        allow_path(ruleset, length > 0 ? folder : ".");
        /* for a link also its target's folder, as vshi_input_is_beside() */
        if (realpath(request->path, folder) != NULL) {
            *strrchr(folder, '/') = '\0';
            allow_path(ruleset, folder[0] != '\0' ? folder : "/");
        }
    }
}

/* Confines the calling thread and the threads that it begins later. They can read the file of the request,
 * the folders of libraries and, for a model, its folder (with `outside`, any file). They can write no file
 * and open no TCP port. Where the kernel can forbid it, they cannot signal other processes or read their
 * memory. They can start programs only if `start`. Returns false where the system refuses this. */
static bool confine_files(const vshi_request *request, bool start) {
    const int version = vshi_landlock_version();
    struct ruleset all = {ALL_OF_1, 0, 0};
    if (version < 1) {
        return false;
    }
    all.files |= version >= 2 ? REFER : 0;
    all.files |= version >= 3 ? TRUNCATE : 0;
    all.files |= version >= 5 ? DEVICE_CALLS : 0;
    all.files &= start ? ~(uint64_t)EXECUTE : UINT64_MAX;
    all.network = version >= 4 ? TCP : 0;
    all.scopes = version >= 6 ? ALONE : 0;
    /* older kernels accept a longer struct if the rest is 0 */
    const int ruleset = (int)syscall(SYS_landlock_create_ruleset, &all, sizeof all, 0);
    if (ruleset < 0) {
        return false;
    }
    allow_libraries(ruleset, request);
    allow_inputs(ruleset, request);
    const bool confined =
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
    close(ruleset);
    return confined;
}

/* --- all of it */

/* Words after VSH_READER_ARGUMENT: from a reader to itself, and to the library that it loads. */
static const char again[] = "again";
static const char confined_word[] = VSHI_READER_CONFINED;

/* Landlock confines this thread and its later threads, but not those that libraries have begun before main.
 * So the program starts again under Landlock, and then it confines them too. */
static void start_again(char **argv, const vshi_request *request) {
    char argument[] = VSH_READER_ARGUMENT, word[sizeof again];
    memcpy(word, again, sizeof again);
    char *const words[] = {argv[0], argument, word, NULL};
    if (vshi_landlock_version() > 0 && confine_files(request, true)) {
        execv("/proc/self/exe", words);
    }
}

static bool has_file_limit(void) {
    struct rlimit size;
    return getrlimit(RLIMIT_FSIZE, &size) == 0 && size.rlim_cur != RLIM_INFINITY;
}

/* Returns the bytes of data (heap, stacks, variables of libraries) for reading any small file, and 50 MiB
 * more. Most of it is never touched. OpenImageIO loads the libraries of all its formats, and their threads.
 */
static uint64_t find_base_data(const vshi_request *request) {
    return (uint64_t)(request->kind == VSHI_READ_IMAGE ? 176 : 68) << 20;
}

static void confine(const vshi_request *request, bool files, vshi_reader_state *state) {
    state->cramped = has_file_limit();
    if (vshi_confine_resources(request->memory, find_base_data(request), request->seconds)) {
        state->confined |= VSH_CONFINED_LIMITS;
    }
    if ((uint64_t)getppid() != request->parent) {
        state->code = VSHI_READER_CANNOT; /* the parent died before PR_SET_PDEATHSIG */
        return;
    }
    if (VSHI_SANITIZED) {
        return;
    }
    if (confine_files(request, false) && files) {
        state->confined |= VSH_CONFINED_FILES;
    }
    if (confine_calls()) {
        state->confined |= VSH_CONFINED_CALLS;
    }
}

/* Reads the bits that vdbshade-reader sends: how it is confined. */
static vshi_reader_state parse_confined(const char *word) {
    const int bits = atoi(word);
    return (vshi_reader_state){(uint32_t)bits & VSH_CONFINED_ALL, (bits & VSHI_CONFINED_FILE_LIMIT) != 0, -1};
}

vshi_answer_head vshi_reader_head(const vshi_reader_state *state, int32_t code) {
    return (vshi_answer_head){.magic = VSHI_ANSWER_MAGIC,
                              .protocol = VSHI_READER_PROTOCOL,
                              .code = code,
                              .confined = state->confined};
}

bool vshi_reader_answer(const vshi_answer_head *head) {
    return pwrite(VSHI_READER_ANSWER, head, sizeof *head, 0) == (ssize_t)sizeof *head;
}

int vshi_reader_answer_confinement(const vshi_reader_state *state) {
    const vshi_answer_head head = vshi_reader_head(state, VSH_OK);
    return vshi_reader_answer(&head) ? 0 : VSHI_READER_CANNOT;
}

static void refuse(const vshi_request *request, vshi_reader_state *state) {
    char missing[VSHI_MISSING_TEXT];
    vshi_answer_head head = vshi_reader_head(state, VSH_ERROR_UNSUPPORTED);
    snprintf(head.message, sizeof head.message,
             "%s: not read: its reader is to be confined, and this system refuses it %s", request->path,
             vshi_missing_text(state->confined, missing));
    state->code = vshi_reader_answer(&head) ? 0 : VSHI_READER_CANNOT;
}

vshi_reader_state vshi_reader_begin(int argc, char **argv, const vshi_request *request) {
    const char *word = argc > 2 ? argv[2] : "";
    vshi_reader_state state = {0, false, -1};
    if (strncmp(word, confined_word, sizeof confined_word - 1) == 0) {
        return parse_confined(word + sizeof confined_word - 1);
    }
    const bool started_again = strcmp(word, again) == 0;
    const bool alone = vshi_task_count() == 1;
    if (!alone && !started_again && !VSHI_SANITIZED) {
        start_again(argv, request);
    }
    confine(request, alone || started_again, &state);
    if (state.code < 0 && request->demanded && state.confined != VSH_CONFINED_ALL) {
        refuse(request, &state);
    }
    return state;
}
