#define _GNU_SOURCE
#include "self.h"

#include <stddef.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#ifndef SYS_landlock_create_ruleset
#define SYS_landlock_create_ruleset 444
#endif

/* Sanitizers look into their own process by way of another. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

enum { ASK_VERSION = 1 };

void cli_self_close(void) {
    if (!SANITIZED && syscall(SYS_landlock_create_ruleset, NULL, 0, ASK_VERSION) < 1) {
        prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
    }
}
