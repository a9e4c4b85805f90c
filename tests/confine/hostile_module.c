/* Preloaded (LD_PRELOAD) into a reader, this attacks like a parser that a file has taken over. It starts with
 * the first write of the answer, when the reader is confined. VSH_TEST_HOSTILE says how. The answer's
 * message, which the command line prints, lists the attacks that were let through. Does nothing in another
 * process. */
#define _GNU_SOURCE
#include "hostile.h"

#include "io/reader/reader.h"

#include <vdbshade/base.h>

#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#define EXPORTED __attribute__((visibility("default")))

enum { THREADS = 3, ROOM = 900 };

typedef int hostile_fn(const hostile_aim *aim, char *done, size_t room);

static hostile_aim aim;
static const char *how; /* NULL: leave this process alone */
static hostile_fn *attack = hostile_calls;

/* Results of the threads. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static char told[ROOM];
static int tried;
static int waiting, attacked; /* how many threads; futexes */
static int woken;
static void **frame; /* of the thread that waits to be rewritten */

static void run_attack(void) {
    char done[ROOM];
    const int count = attack(&aim, done, sizeof done);
    pthread_mutex_lock(&lock);
    const size_t used = strlen(told);
    snprintf(told + used, sizeof told - used, "%s", done);
    tried += count;
    ++attacked;
    pthread_mutex_unlock(&lock);
}

static void sleep_until(int *value) {
    while (__atomic_load_n(value, __ATOMIC_SEQ_CST) == 0) {
        syscall(SYS_futex, value, FUTEX_WAIT, 0, NULL, NULL, 0);
    }
}

/* --- threads that begin before main, like those of liblog4cplus */

static void *wait_and_attack(void *unused) {
    __atomic_add_fetch(&waiting, 1, __ATOMIC_SEQ_CST);
    sleep_until(&woken);
    run_attack();
    return unused;
}

#ifdef __x86_64__
void rewritten(void);

/* Never called: what the rewritten stack returns to. */
__attribute__((noreturn)) void rewritten(void) {
    run_attack();
    for (;;) {
        pause();
    }
}

/* Aligns the stack: it is not aligned after a return, as it is after a call. */
__asm__(".text\nrewritten_start:\nand $-16, %rsp\ncall rewritten@PLT\n");
extern char rewritten_start[];

__attribute__((noinline)) static void wait_to_be_rewritten(void) {
    __atomic_store_n(&frame, (void **)__builtin_frame_address(0), __ATOMIC_SEQ_CST);
    __atomic_add_fetch(&waiting, 1, __ATOMIC_SEQ_CST);
    sleep_until(&woken);
}

static void *wait_innocently(void *unused) {
    wait_to_be_rewritten();
    return unused;
}
#else
static void *wait_innocently(void *unused) {
    return wait_and_attack(unused);
}
#endif

static void rewrite_stack(void) {
#ifdef __x86_64__
    frame[1] = rewritten_start; /* the return address */
#endif
}

/* --- the reader */

/* The C library calls constructors as it calls main. */
__attribute__((constructor)) static void begin(int argc, char **argv) {
    if (argc < 2 || strcmp(argv[1], VSH_READER_ARGUMENT) != 0) {
        return;
    }
    how = getenv("VSH_TEST_HOSTILE");
    const char *victim = getenv("VSH_TEST_VICTIM");
    aim = (hostile_aim){getenv("VSH_TEST_FOLDER"), victim != NULL ? atoi(victim) : 0, (int)getppid(),
                        getenv("VSH_TEST_OUTSIDE")};
    if (how == NULL || aim.folder == NULL || aim.victim <= 0) {
        how = NULL;
        return;
    }
    attack = strcmp(how, "reads") == 0 ? hostile_reads : hostile_calls;
    pthread_t thread;
    for (int i = 0; i < THREADS; ++i) {
        pthread_create(&thread, NULL, i == 0 ? wait_innocently : wait_and_attack, NULL);
    }
}

static void tell(void) {
    vshi_answer_head head = {.magic = VSHI_ANSWER_MAGIC,
                             .protocol = VSHI_READER_PROTOCOL,
                             .code = VSH_ERROR_INPUT,
                             .confined = VSH_CONFINED_ALL};
    snprintf(head.message, sizeof head.message, "taken over: %d threads, %d calls, let through:%s", attacked,
             tried, told[0] != '\0' ? told : " none");
    syscall(SYS_pwrite64, VSHI_READER_ANSWER, &head, sizeof head, 0L);
    syscall(SYS_exit_group, 0);
}

static void take_over(void) {
    while (__atomic_load_n(&waiting, __ATOMIC_SEQ_CST) < THREADS) {
        sched_yield();
    }
#ifdef __x86_64__
    if (strcmp(how, "x32") == 0) {
        syscall(0x40000000 + SYS_getpid);
    } else if (strcmp(how, "i386") == 0) {
        long result = 20; /* getpid */
        __asm__ volatile("int $0x80" : "+a"(result) : : "memory", "cc");
    }
#endif
    run_attack();
    rewrite_stack();
    __atomic_store_n(&woken, 1, __ATOMIC_SEQ_CST);
    syscall(SYS_futex, &woken, FUTEX_WAKE, INT32_MAX, NULL, NULL, 0);
    for (int all = 0; !all;) {
        pthread_mutex_lock(&lock);
        all = attacked == THREADS + 1;
        pthread_mutex_unlock(&lock);
        sched_yield();
    }
    tell();
}

EXPORTED ssize_t pwrite(int file, const void *bytes, size_t size, off_t offset) {
    if (how != NULL && file == VSHI_READER_ANSWER) {
        take_over();
    }
    return syscall(SYS_pwrite64, file, bytes, size, offset);
}

EXPORTED ssize_t pwrite64(int file, const void *bytes, size_t size, off_t offset) {
    return pwrite(file, bytes, size, offset);
}
