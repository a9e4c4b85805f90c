/* SIGINT, SIGTERM and SIGHUP cancel the work, and memory that the system refuses ends the process at once
 * (base/guarded_malloc.c), so the command line checks no malloc(). Both remove temporary files. */
#include "base/memory.h"
#include "cli.h"

#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

/* Time for the work to stop. docs/security.md promises a second in all. */
static const long grace_nanoseconds = 250 * 1000 * 1000;

static sem_t signalled; /* posted by each signal; waited for by the watcher */
static atomic_bool interrupted;
static atomic_int written; /* 0: the output is not written; else 1 + the exit code */
static pthread_mutex_t telling = PTHREAD_MUTEX_INITIALIZER;
static bool told;                                          /* the user knows; protected by `telling` */
static pthread_mutex_t ending = PTHREAD_MUTEX_INITIALIZER; /* held while the process is ended */

static void on_signal(int number) {
    (void)number;
    const int saved = errno;
    atomic_store(&interrupted, true);
    sem_post(&signalled);
    errno = saved;
}

void cli_signals_begin(void) {
    sem_init(&signalled, 0, 0);
    struct sigaction action;
    memset(&action, 0, sizeof action);
    sigemptyset(&action.sa_mask);
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    struct sigaction before;
    if (sigaction(SIGHUP, NULL, &before) != 0 || before.sa_handler != SIG_IGN) {
        sigaction(SIGHUP, &action, NULL); /* nohup's stays ignored */
    }
    action.sa_handler = SIG_IGN;
    sigaction(SIGXFSZ, &action, NULL);
    sigaction(SIGPIPE, &action, NULL);
}

bool cli_interrupted(void) {
    return atomic_load(&interrupted);
}

/* Writes at once, under a lock of its own. The line must be out before the process ends, even if another
 * thread hangs in a write of progress. */
void cli_signals_tell(void) {
    static const char text[] = "\r\033[Kvdbshade: interrupted\n";
    const size_t skip = cli_has_escapes() ? 0 : strlen("\r\033[K");
    pthread_mutex_lock(&telling);
    if (!told && write(STDERR_FILENO, text + skip, sizeof text - 1 - skip) < 0) {
        /* Nobody can read it. */
    }
    told = true;
    pthread_mutex_unlock(&telling);
}

/* A thread ends the process, not the handler, because a thread may list a folder and take locks. */
static void *watch(void *unused) {
    (void)unused;
    while (sem_wait(&signalled) != 0) {
    }
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    until.tv_nsec += grace_nanoseconds;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    while (sem_timedwait(&signalled, &until) != 0 && errno == EINTR) {
    }
    pthread_mutex_lock(&ending);
    vshi_temporary_remove_own();
    cli_signals_tell();
    _exit(CLI_INTERRUPTED);
}

void cli_signals_watch(void) {
    pthread_t thread;
    if (pthread_create(&thread, NULL, watch, NULL) == 0) {
        pthread_detach(thread);
    }
}

/* Keeps the lock: a watcher that wakes now waits for it until the process ends. */
void cli_signals_end(int code) {
    pthread_mutex_lock(&ending);
    atomic_store(&written, code + 1);
}

/* --- memory */

void vshi_memory_refused(size_t bytes) {
    static atomic_flag begun = ATOMIC_FLAG_INIT;
    while (atomic_flag_test_and_set(&begun)) {
        pause(); /* another thread ends the process */
    }
    if (atomic_load(&written) != 0) {
        fflush(stdout);
        _exit(atomic_load(&written) - 1);
    }
    vshi_temporary_remove_own();
    char message[128];
    const int size = snprintf(message, sizeof message, "%svdbshade: the system refused memory, %zu bytes\n",
                              cli_has_escapes() ? "\r\033[K" : "", bytes);
    if (write(STDERR_FILENO, message, (size_t)size) < 0) {
        /* Nobody can read it. */
    }
    _exit(CLI_LIMIT);
}
