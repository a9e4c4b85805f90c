/* The caller: starts a reader, waits for its end, and checks the common parts of its answer. */
#define _GNU_SOURCE

#include "base/clock.h"
#include "base/memory.h"
#include "io/reader/confine.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <link.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum {
    POLL_MS = 20,
    FIRST_FREE = 16,    /* our descriptors are at least this, above those of a reader */
    MAX_WARNINGS = 4096 /* of one file */
};

/* Limit of seconds for a file if run->reader_seconds is 0. Assimp's readers take 0.03 s a MB on an idle core,
 * and ten times as long on a busy one. */
static const double seconds_at_least = 60.0, seconds_a_byte = 1e-6;

/* Limit of seconds between a reader's closing of its descriptors and its end. */
static const double seconds_to_end = 5.0;

/* Set in the environment of every reader, so that it starts no reader itself. */
#define IN_READER "VSH_IN_READER"

/* A running reader. -1: no descriptor. */
typedef struct reader_process {
    pid_t pid;
    int answer, progress;
    double begin;
} reader_process;

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

/* Encodes the folders of this process's libraries: the reader loads the same. */
static void encode_folders(vshi_encoder *encoder) {
    folder_list list = {{NULL}, 0};
    dl_iterate_phdr(add_folder, &list);
    vshi_encode_count(encoder, list.count);
    for (size_t i = 0; i < list.count; ++i) {
        vshi_encode_text(encoder, list.folders[i]);
        free(list.folders[i]);
    }
}

/* --- the program */

/* Finds VSH_READER: beside the library (as built), or in libexec (as installed). */
static bool find_own_reader(char path[PATH_MAX]) {
    static const char *const places[] = {".", VSHI_READER_FOLDER};
    static const char here; /* in the library, or in a program that is linked with its objects */
    char folder[PATH_MAX];
    Dl_info info;
    if (dladdr(&here, &info) == 0 || info.dli_fname == NULL ||
        /* a program's name is the word that it was called by */
        realpath(strchr(info.dli_fname, '/') != NULL ? info.dli_fname : "/proc/self/exe", folder) == NULL) {
        return false;
    }
    *strrchr(folder, '/') = '\0';
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

/* Passes variables that a reader's libraries use. A hostile file must not see the others (tokens, passwords).
 */
static bool is_passed(const char *variable) {
    static const char *const beginnings[] =
        VSHI_LIST("LD_", "LC_", "LANG", "TZ=", "MALLOC_", "GLIBC_TUNABLES=", "ASAN_", "LSAN_", "TSAN_",
                  "UBSAN_", "LLVM_PROFILE_FILE=", "GCOV_", "VSH_TEST_");
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
    if (made == NULL) {
        return NULL;
    }
    for (size_t i = 0; i < count; ++i) {
        if (is_passed(environ[i])) {
            made[passed++] = environ[i];
        }
    }
    made[passed++] = mark;
    made[passed] = NULL;
    return made;
}

/* --- the process */

static int add_descriptors(posix_spawn_file_actions_t *files, const vshi_exchange *exchange, int answer,
                           int progress) {
    const struct {
        int from, to;
    } given[] = {{answer, VSHI_READER_ANSWER},
                 {exchange->encoder.file, VSHI_READER_REQUEST},
                 {progress, VSHI_READER_PROGRESS}};
    int reason = posix_spawn_file_actions_addopen(files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    reason = reason != 0 ? reason
                         : posix_spawn_file_actions_addopen(files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    if (reason == 0 && !VSHI_SANITIZED) { /* sanitizers report on standard error */
        reason = posix_spawn_file_actions_addopen(files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    }
    for (size_t i = 0; reason == 0 && i < sizeof given / sizeof given[0]; ++i) {
        reason = posix_spawn_file_actions_adddup2(files, given[i].from, given[i].to);
    }
    return reason != 0 ? reason : posix_spawn_file_actions_addclosefrom_np(files, VSHI_READER_PROGRESS + 1);
}

/* The reader gets its own process group, so that an interrupt on the terminal reaches only us. */
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

/* Starts exchange->run->reader with these descriptors. Returns 0 or an error number. posix_spawn() runs none
 * of our code between fork and exec, which is not safe in a process with threads. */
static int spawn_reader(const vshi_exchange *exchange, int answer, int progress, pid_t *pid) {
    char own[PATH_MAX], name[] = VSH_READER, argument[] = VSH_READER_ARGUMENT, mark[] = IN_READER "=1";
    char *const arguments[] = {name, argument, NULL};
    const char *program = exchange->run->reader;
    if (strcmp(program, VSH_READER) == 0) {
        /* sanitized tests contain the objects, so they are their own readers */
        program = find_own_reader(own) ? own : VSHI_SANITIZED ? "/proc/self/exe" : NULL;
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
        reason = add_descriptors(&files, exchange, answer, progress);
        reason =
            reason != 0 ? reason : posix_spawnp(pid, program, &files, &attributes, arguments, environment);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&files);
    free(environment);
    return reason;
}

/* --- the request */

static double seconds_for(const char *path, const vsh_run *run) {
    struct stat status;
    if (run->reader_seconds > 0.0) {
        return run->reader_seconds;
    }
    return seconds_at_least + (stat(path, &status) == 0 ? seconds_a_byte * (double)status.st_size : 0.0);
}

static vsh_result fail_start(const vshi_exchange *exchange, int reason, vsh_error *error) {
    const char *why = strerrordesc_np(reason);
    const bool missing = reason == ENOENT || reason == EACCES || reason == ENOEXEC || reason == ENOTDIR;
    return vshi_fail(
        error, missing ? VSH_ERROR_ARGUMENT : VSH_ERROR_MEMORY,
        "%s: cannot start the process that reads it, '%s': %s; trusted files can be read without "
        "(--sandbox off; no vsh_run.reader)",
        exchange->path, exchange->run->reader, why != NULL ? why : "?");
}

/* Moves a descriptor to FIRST_FREE or above. Other programs that the host starts do not inherit it. */
static int lift(int file) {
    if (file < 0 || file >= FIRST_FREE) {
        return file;
    }
    const int lifted = fcntl(file, F_DUPFD_CLOEXEC, FIRST_FREE);
    const int reason = errno == EINVAL ? EMFILE : errno; /* EINVAL: the limit of descriptors is FIRST_FREE */
    close(file);
    errno = reason;
    return lifted;
}

vsh_result vshi_exchange_begin(vshi_exchange *exchange, int32_t kind, const char *path, const vsh_run *run,
                               vsh_error *error) {
    if (getenv(IN_READER) != NULL) {
        /* otherwise a program that is its own reader would start itself forever */
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: not read: this process is a reader itself; main has to call vsh_reader_serve() "
                         "before anything else",
                         path);
    }
    exchange->path = path;
    exchange->run = run;
    const int file = lift(memfd_create("vdbshade request", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    vshi_encoder_begin(&exchange->encoder, file, 0);
    if (file < 0) {
        return fail_start(exchange, errno, error);
    }
    vshi_encode_count(&exchange->encoder, VSHI_REQUEST_MAGIC);
    vshi_encode_count(&exchange->encoder, VSHI_READER_PROTOCOL);
    vshi_encode_count(&exchange->encoder, (uint64_t)kind);
    vshi_encode_count(&exchange->encoder, (uint64_t)getpid());
    vshi_encode_count(&exchange->encoder, vshi_memory_left(run));
    vshi_encode_number(&exchange->encoder, seconds_for(path, run));
    vshi_encode_count(&exchange->encoder, run->confined != 0);
    vshi_encode_count(&exchange->encoder, run->allow_outside != 0);
    vshi_encode_text(&exchange->encoder, path);
    encode_folders(&exchange->encoder);
    return VSH_OK;
}

static vsh_result start_reader(const vshi_exchange *exchange, reader_process *process, vsh_error *error) {
    int ends[2] = {-1, -1};
    *process = (reader_process){-1, -1, -1, vshi_seconds()};
    process->answer = lift(memfd_create("vdbshade answer", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    int reason = process->answer < 0 || pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0 ? errno : 0;
    process->progress = ends[0];
    if (reason == 0) {
        ends[1] = lift(ends[1]);
        reason = ends[1] < 0 ? errno : spawn_reader(exchange, process->answer, ends[1], &process->pid);
    }
    if (ends[1] >= 0) {
        close(ends[1]);
    }
    return reason == 0 ? VSH_OK : fail_start(exchange, reason, error);
}

/* --- waiting */

/* Drains the pipe; returns false after the reader has closed it. */
static bool read_progress(int file, double *fraction) {
    double reports[64];
    for (;;) {
        const ssize_t size = read(file, reports, sizeof reports);
        if (size <= 0) {
            return size < 0 && (errno == EAGAIN || errno == EINTR);
        }
        const size_t count = (size_t)size / sizeof reports[0];
        const double last = count > 0 ? reports[count - 1] : 0.0;
        *fraction = last > *fraction && last <= 1.0 ? last : *fraction;
    }
}

static void kill_reader(reader_process *process, int *status) {
    kill(process->pid, SIGKILL);
    while (waitpid(process->pid, status, 0) < 0 && errno == EINTR) {
    }
    process->pid = -1;
}

static vsh_result fail_time(const vshi_exchange *exchange, double seconds, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_LIMIT,
                     "%s: reading it takes longer than the limit of %g s: damaged, or very large",
                     exchange->path, seconds);
}

/* Waits for the reader's end, and sets *status. If the host ignores SIGCHLD or waits for all its children,
 * *status is 0, and only the answer shows a failure. */
static vsh_result await_end(const vshi_exchange *exchange, reader_process *process, vshi_poll_fn *poll_user,
                            void *user, int *status, vsh_error *error) {
    const double limit = seconds_for(exchange->path, exchange->run);
    double closed = INFINITY, fraction = 0.0;
    for (;;) {
        if (closed < INFINITY) { /* it ends soon */
            nanosleep(&(struct timespec){0, 200000}, NULL);
        } else {
            struct pollfd pipe_end = {process->progress, POLLIN, 0};
            poll(&pipe_end, 1, POLL_MS);
            closed = read_progress(process->progress, &fraction) ? INFINITY : vshi_seconds();
        }
        const pid_t ended = waitpid(process->pid, status, WNOHANG);
        if (ended == process->pid || (ended < 0 && errno == ECHILD)) {
            *status = ended < 0 ? 0 : *status;
            process->pid = -1;
            return VSH_OK;
        }
        const double now = vshi_seconds();
        if (poll_user(user, fraction)) {
            kill_reader(process, status);
            return vshi_fail(error, VSH_ERROR_CANCELLED, "%s: cancelled", exchange->path);
        }
        if (now - process->begin > limit || now - closed > seconds_to_end) {
            kill_reader(process, status);
            return fail_time(exchange, limit, error);
        }
    }
}

/* --- the answer */

vsh_result vshi_answer_fail(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: damaged: its reader sent a bad answer: %s", path, what);
}

static vsh_result fail_memory(const vshi_exchange *exchange, vsh_error *error) {
    char limit[80] = "this machine's memory";
    if (exchange->run->memory_limit > 0) {
        snprintf(limit, sizeof limit, "the memory limit of %.0f MB, or than the system gives",
                 (double)exchange->run->memory_limit / 1e6);
    }
    return vshi_fail(error, VSH_ERROR_LIMIT, "%s: reading it takes more than %s: damaged, or very large",
                     exchange->path, limit);
}

/* Fails with the reason why there is no answer. */
static vsh_result fail_end(const vshi_exchange *exchange, int status, bool begun, vsh_error *error) {
    if (WIFSIGNALED(status)) {
        const int number = WTERMSIG(status);
        if (number == SIGXCPU) {
            return fail_time(exchange, seconds_for(exchange->path, exchange->run), error);
        }
        const char *name = sigabbrev_np(number);
        return vshi_fail(error, VSH_ERROR_READ, "%s: damaged: the reader crashed (SIG%s), or memory ran out",
                         exchange->path, name != NULL ? name : "?");
    }
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    const char *path = exchange->path, *reader = exchange->run->reader;
    switch (code) {
    case VSHI_READER_OUT_OF_MEMORY:
        return fail_memory(exchange, error);
    case VSHI_READER_FILE_LIMIT:
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: its reader's answer exceeds this process's limit on the size of files "
                         "(ulimit -f); raise it, or read without a reader",
                         path);
    case VSHI_READER_EMPTY:
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: its reader, '%s', cannot load the library of vdbshade %s", path, reader,
                         vsh_version());
    default:
        return begun ? vshi_fail(error, VSH_ERROR_READ,
                                 "%s: damaged: the reader ended without an answer (%d)", path, code)
                     : vshi_fail(error, VSH_ERROR_ARGUMENT,
                                 "%s: '%s' is no reader of vdbshade %s: its main does not call "
                                 "vsh_reader_serve()",
                                 path, reader, vsh_version());
    }
}

/* Seals the answer, so that it cannot change any more, and maps it. */
static vsh_result map_answer(const vshi_exchange *exchange, int file, vshi_answer *answer, vsh_error *error) {
    struct stat status;
    if (fcntl(file, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL) != 0 ||
        fstat(file, &status) != 0) {
        return vshi_answer_fail(exchange->path, "it is still being written", error);
    }
    if (status.st_size < (off_t)sizeof(vshi_answer_head)) {
        return VSH_OK; /* there is no answer */
    }
    /* its content is copied, except a model's arrays */
    VSHI_TRY(vshi_check_limit(exchange->run, 2.0 * (double)status.st_size, exchange->path, error));
    /* map all pages at once, unless the reader left holes, which would become pages */
    const int whole = status.st_blocks >= status.st_size / 512 ? MAP_POPULATE : 0;
    void *map = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_SHARED | whole, file, 0);
    if (map == MAP_FAILED) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %lld bytes", exchange->path,
                         (long long)status.st_size);
    }
    answer->map = map;
    answer->size = (size_t)status.st_size;
    return VSH_OK;
}

static void pass_warnings(const vshi_exchange *exchange, vshi_decoder warnings, uint64_t count) {
    for (uint64_t i = 0; i < count && i < MAX_WARNINGS; ++i) {
        const char *text = vshi_decode_text(&warnings, false);
        const bool note = text != NULL && strncmp(text, VSHI_NOTE, strlen(VSHI_NOTE)) == 0;
        if (text != NULL && (!note || vshi_wants_notes(exchange->run))) {
            vshi_warn(exchange->run, "%s", text);
        }
    }
}

/* Warns for every file. The callback may fold equal warnings. */
static void warn_of_missing(const vshi_exchange *exchange, uint64_t confined) {
    char missing[VSHI_MISSING_TEXT];
    /* no warning for Landlock: many systems lack it */
    const uint64_t expected = VSH_CONFINED_LIMITS | VSH_CONFINED_CALLS;
    if ((confined & expected) != expected && !VSHI_SANITIZED) {
        vshi_warn(exchange->run,
                  "the process that reads files is confined in part only: this system refuses it %s",
                  vshi_missing_text(confined, missing));
    }
}

static vsh_result read_head(const vshi_exchange *exchange, int status, vshi_answer *answer,
                            vsh_error *error) {
    vshi_answer_head head = {0};
    if (answer->map != NULL) {
        memcpy(&head, answer->map, sizeof head);
    }
    const bool begun = head.magic == VSHI_ANSWER_MAGIC && head.protocol == VSHI_READER_PROTOCOL;
    if (!begun || head.code == VSHI_ANSWER_BEGUN || status != 0) {
        return fail_end(exchange, status, begun, error);
    }
    if (head.code == VSH_ERROR_MEMORY) {
        return fail_memory(exchange, error);
    }
    head.message[sizeof head.message - 1] = '\0';
    if (head.code < VSH_OK || head.code > VSH_ERROR_INTERNAL || head.code == VSH_ERROR_CANCELLED) {
        return vshi_answer_fail(exchange->path, "an unknown result", error);
    }
    const size_t room = answer->size - sizeof head;
    if (head.payload > room || head.payload % 8 != 0) {
        return vshi_answer_fail(exchange->path, "its sizes", error);
    }
    const unsigned char *start = (const unsigned char *)answer->map + sizeof head;
    const unsigned char *end = start + head.payload;
    answer->confined = (uint32_t)(head.confined & VSH_CONFINED_ALL);
    if (head.code != VSH_ERROR_UNSUPPORTED || exchange->run->confined == 0) {
        warn_of_missing(exchange, head.confined);
    }
    pass_warnings(exchange, (vshi_decoder){end, start + room, false}, head.warnings);
    if (head.code != VSH_OK) {
        return vshi_fail(error, head.code, "%s", head.message);
    }
    answer->payload = (vshi_decoder){start, end, false};
    return VSH_OK;
}

static vsh_result send_request(vshi_exchange *exchange, vshi_poll_fn *poll_user, void *user,
                               reader_process *process, vsh_error *error) {
    if (!vshi_encoder_flush(&exchange->encoder)) {
        return fail_start(exchange, exchange->encoder.error, error);
    }
    if (poll_user(user, 0.0)) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "%s: cancelled", exchange->path);
    }
    return start_reader(exchange, process, error);
}

vsh_result vshi_exchange_send(vshi_exchange *exchange, vshi_poll_fn *poll_user, void *user,
                              vshi_answer *answer, vsh_error *error) {
    *answer = (vshi_answer){NULL, 0, 0, {NULL, NULL, true}};
    reader_process process = {-1, -1, -1, 0.0};
    int status = 0;
    vsh_result result = send_request(exchange, poll_user, user, &process, error);
    close(exchange->encoder.file);
    VSHI_TRY_DONE(result);
    VSHI_TRY_DONE(await_end(exchange, &process, poll_user, user, &status, error));
    VSHI_TRY_DONE(map_answer(exchange, process.answer, answer, error));
    VSHI_TRY_DONE(read_head(exchange, status, answer, error));
done:
    if (process.answer >= 0) {
        close(process.answer);
    }
    if (process.progress >= 0) {
        close(process.progress);
    }
    if (result != VSH_OK) {
        vshi_answer_free(answer);
    }
    return result;
}

typedef struct job_share {
    vshi_job *job;
    size_t units, done;
} job_share;

static bool poll_job(void *user, double fraction) {
    job_share *share = user;
    const size_t reached = (size_t)(fraction * (double)share->units);
    const size_t more = reached > share->done ? reached - share->done : 0;
    share->done += more;
    return vshi_job_advance(share->job, more);
}

vsh_result vshi_exchange_send_job(vshi_exchange *exchange, vshi_job *job, size_t units, vshi_answer *answer,
                                  vsh_error *error) {
    job_share share = {job, units, 0};
    VSHI_TRY(vshi_exchange_send(exchange, poll_job, &share, answer, error));
    poll_job(&share, 1.0);
    const vsh_result result = vshi_job_check(job, error);
    if (result != VSH_OK) {
        vshi_answer_free(answer);
    }
    return result;
}

void vshi_answer_free(vshi_answer *answer) {
    if (answer->map != NULL) {
        munmap(answer->map, answer->size);
    }
    *answer = (vshi_answer){NULL, 0, 0, {NULL, NULL, true}};
}

static bool poll_nothing(void *user, double fraction) {
    (void)fraction;
    const vsh_run *run = user;
    return run->progress != NULL && run->progress(run->user, "load", 0.0) != 0;
}

vsh_result vsh_reader_confinement(const vsh_run *run, uint32_t *confined, vsh_error *error) {
    VSHI_NEEDS(confined);
    *confined = 0;
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (full.reader == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_reader_confinement: vsh_run.reader is NULL");
    }
    vshi_exchange *exchange;
    vshi_answer answer;
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&exchange, 1, sizeof *exchange, "reader", error));
    full.warning = NULL; /* the result tells the missing parts */
    VSHI_TRY_DONE(vshi_exchange_begin(exchange, VSHI_READ_CONFINEMENT, "reader", &full, error));
    VSHI_TRY_DONE(vshi_exchange_send(exchange, poll_nothing, &full, &answer, error));
    *confined = answer.confined;
    vshi_answer_free(&answer);
done:
    free(exchange);
    return result;
}
