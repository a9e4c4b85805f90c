#define _GNU_SOURCE
#include "sandbox/spawn.h"

#include "sandbox/request.h"

#include <vdbshade/reader.h>

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <link.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

extern char **environ;

/* --- libraries */

typedef struct folder_list {
    char *folders[VSHI_MOST_FOLDERS];
    size_t count;
} folder_list;

static int add_folder(struct dl_phdr_info *info, size_t size, void *user) {
    (void)size;
    folder_list *list = user;
    const char *slash = strrchr(info->dlpi_name, '/');
    if (slash == NULL || slash == info->dlpi_name) {
        return 0;
    }
    const size_t length = (size_t)(slash - info->dlpi_name);
    for (size_t i = 0; i < list->count; ++i) {
        if (strncmp(list->folders[i], info->dlpi_name, length) == 0 && list->folders[i][length] == '\0') {
            return 0;
        }
    }
    char *folder = list->count < VSHI_MOST_FOLDERS ? strndup(info->dlpi_name, length) : NULL;
    if (folder != NULL) {
        list->folders[list->count++] = folder;
    }
    return 0;
}

void vshi_encode_folders(vshi_encoder *encoder) {
    folder_list list = {{NULL}, 0};
    dl_iterate_phdr(add_folder, &list);
    vshi_encode_count(encoder, list.count);
    for (size_t i = 0; i < list.count; ++i) {
        vshi_encode_text(encoder, list.folders[i]);
        free(list.folders[i]);
    }
}

/* --- the program */

/* The folder of the file that holds this code: the library, or a program that is linked with its objects. */
static bool own_folder(char folder[PATH_MAX]) {
    static const char here; /* in this file */
    Dl_info info;
    const bool found = dladdr(&here, &info) != 0 && info.dli_fname != NULL;
    char name[PATH_MAX];
    /* a program's own name is what it was called by */
    if (!found ||
        realpath(strchr(info.dli_fname, '/') != NULL ? info.dli_fname : "/proc/self/exe", name) == NULL) {
        return false;
    }
    char *slash = strrchr(name, '/');
    *slash = '\0';
    memcpy(folder, name, sizeof name);
    return true;
}

/* VSH_READER: beside the library as it is built, in libexec as it is installed. */
static bool find_own(char path[PATH_MAX]) {
    static const char *const places[] = {".", VSHI_READER_FOLDER};
    char folder[PATH_MAX];
    if (!own_folder(folder)) {
        return false;
    }
    for (size_t i = 0; i < sizeof places / sizeof places[0]; ++i) {
        const bool whole = places[i][0] == '/';
        const int length = snprintf(path, PATH_MAX, "%s%s%s/%s", whole ? "" : folder, whole ? "" : "/",
                                    places[i], VSH_READER);
        if (length > 0 && length < PATH_MAX && access(path, X_OK) == 0) {
            return true;
        }
    }
    return false;
}

/* --- its environment */

/* Set in the environment of every reader. */
#define VSHI_IN_READER "VSH_IN_READER"

/* Variables that a reader's libraries act on; what else a host has there (tokens, passwords) is none of a
 * hostile file's business. */
static bool is_passed(const char *variable) {
    static const char *const beginnings[] = {"LD_",
                                             "LC_",
                                             "LANG",
                                             "TZ=",
                                             "MALLOC_",
                                             "GLIBC_TUNABLES=",
                                             "ASAN_",
                                             "LSAN_",
                                             "TSAN_",
                                             "UBSAN_",
                                             "LLVM_PROFILE_FILE=",
                                             "GCOV_",
                                             "VSH_TEST_"};
    for (size_t i = 0; i < sizeof beginnings / sizeof beginnings[0]; ++i) {
        if (strncmp(variable, beginnings[i], strlen(beginnings[i])) == 0) {
            return true;
        }
    }
    return false;
}

/* Copies the variables that is_passed() keeps, and adds `mark`. */
static char **make_environment(char *mark) {
    size_t count = 0, passed = 0;
    while (environ != NULL && environ[count] != NULL) {
        ++count;
    }
    char **made = malloc((count + 2) * sizeof *made);
    for (size_t i = 0; made != NULL && i < count; ++i) {
        if (is_passed(environ[i])) {
            made[passed++] = environ[i];
        }
    }
    if (made != NULL) {
        made[passed++] = mark;
        made[passed] = NULL;
    }
    return made;
}

bool vshi_in_reader(void) {
    return getenv(VSHI_IN_READER) != NULL;
}

/* --- starting */

static int give_files(posix_spawn_file_actions_t *files, const vshi_exchange *exchange, int answer,
                      int progress) {
    const struct {
        int from, to;
    } given[] = {{answer, VSHI_READER_ANSWER},
                 {exchange->encoder.file, VSHI_READER_REQUEST},
                 {progress, VSHI_READER_PROGRESS}};
    int reason = posix_spawn_file_actions_addopen(files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    reason = reason != 0 ? reason
                         : posix_spawn_file_actions_addopen(files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    if (reason == 0 && !VSHI_SANITIZED) { /* whose reports go there */
        reason = posix_spawn_file_actions_addopen(files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    }
    for (size_t i = 0; reason == 0 && i < sizeof given / sizeof given[0]; ++i) {
        reason = posix_spawn_file_actions_adddup2(files, given[i].from, given[i].to);
    }
    return reason != 0 ? reason : posix_spawn_file_actions_addclosefrom_np(files, VSHI_READER_PROGRESS + 1);
}

/* The reader leaves our process group, so that an interrupt on the terminal reaches it through us. */
static void set_attributes(posix_spawnattr_t *attributes) {
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(attributes, &none);
    posix_spawnattr_setsigdefault(attributes, &all);
    posix_spawnattr_setpgroup(attributes, 0);
    posix_spawnattr_setflags(attributes,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
}

/* Nothing but posix_spawn(): between fork and exec none of our code runs, as it must not in a process that
 * may have threads. */
int vshi_spawn_reader(const vshi_exchange *exchange, int answer, int progress, pid_t *pid) {
    char own[PATH_MAX], name[] = VSH_READER, argument[] = VSH_READER_ARGUMENT, mark[] = VSHI_IN_READER "=1";
    char *const arguments[] = {name, argument, NULL};
    const char *program = exchange->run->reader;
    if (strcmp(program, VSH_READER) == 0) {
        /* sanitized programs of the tests are linked with the objects, and have none beside them */
        program = find_own(own) ? own : VSHI_SANITIZED ? "/proc/self/exe" : NULL;
    }
    if (program == NULL) {
        return ENOENT;
    }
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    char **environment = make_environment(mark);
    int reason = environment != NULL ? posix_spawn_file_actions_init(&files) : ENOMEM;
    if (reason != 0) {
        free(environment);
        return reason;
    }
    reason = posix_spawnattr_init(&attributes);
    if (reason == 0) {
        set_attributes(&attributes);
        reason = give_files(&files, exchange, answer, progress);
        reason =
            reason != 0 ? reason : posix_spawnp(pid, program, &files, &attributes, arguments, environment);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&files);
    free(environment);
    return reason;
}
