/* By the numbers of its system calls: the C library has no functions for them, and headers of this age lack
 * some of the rights (linux/landlock.h). */
#define _GNU_SOURCE
#include "sandbox/landlock.h"

#include "sandbox/reader.h"

#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#define SYS_landlock_add_rule 445
#define SYS_landlock_restrict_self 446
#endif

enum { ASK_VERSION = 1, RULE_PATH_BENEATH = 1, PATH_ROOM = 4096 };

/* Rights of files, bits. */
enum {
    EXECUTE = 1 << 0,
    READ_FILE = 1 << 2,
    READ_FOLDER = 1 << 3,
    ALL_OF_1 = (1 << 13) - 1, /* with writing, making, removing */
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

/* What is not there need not be opened. */
static void allow(int ruleset, const char *path) {
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

/* Each folder of a list as LD_LIBRARY_PATH is one. */
static void allow_list(int ruleset, const char *list) {
    while (list != NULL && *list != '\0') {
        char path[PATH_ROOM];
        const size_t length = strcspn(list, ":;");
        if (length > 0 && length < sizeof path) {
            snprintf(path, sizeof path, "%.*s", (int)length, list);
            allow(ruleset, path);
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
        allow(ruleset, folders[i]);
    }
    for (size_t i = 0; i < request->folder_count; ++i) {
        allow(ruleset, request->folders[i]);
    }
    allow_list(ruleset, getenv("LD_LIBRARY_PATH"));
    allow_list(ruleset, getenv("LD_PRELOAD"));
}

/* A model names files beside it; what else is read is one file. */
static void allow_inputs(int ruleset, const vshi_request *request) {
    char folder[PATH_MAX];
    allow(ruleset, request->path);
    if (request->kind != VSHI_READ_MODEL && request->kind != VSHI_READ_DRACO) {
        return;
    }
    const char *slash = strrchr(request->path, '/');
    const size_t length = slash != NULL ? (size_t)(slash - request->path) + 1 : 0;
    if (request->outside) {
        allow(ruleset, "/");
    } else if (length < sizeof folder) {
        snprintf(folder, sizeof folder, "%.*s", (int)length, request->path);
        allow(ruleset, length > 0 ? folder : ".");
        /* and where it is a link, as vshi_input_is_beside() has it */
        if (realpath(request->path, folder) != NULL) {
            *strrchr(folder, '/') = '\0';
            allow(ruleset, folder[0] != '\0' ? folder : "/");
        }
    }
}

bool vshi_landlock_confine(const vshi_request *request, bool start) {
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
    /* a kernel that knows less takes a longer struct whose rest is 0 */
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
