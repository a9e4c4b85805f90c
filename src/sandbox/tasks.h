/* Whether a filter of system calls holds in every thread of this process, as the kernel tells it. */
#ifndef VSHI_READ_TASKS_H
#define VSHI_READ_TASKS_H

#ifdef __cplusplus
extern "C" {
#endif

/* How many filters the calling thread has: those of the host too (a container's, a sandbox's). */
int vshi_task_filters(void);

/* How many tasks (threads) there are; 0 where that cannot be read. */
int vshi_task_count(void);

enum {
    VSHI_TASKS_UNSEEN = 0,   /* /proc is not there */
    VSHI_TASKS_FILTERED = 1, /* all of them */
    VSHI_TASKS_LOOSE = 2     /* not all of them */
};

/* Whether every task has a filter, and as many as the calling one, which are more than `before`. A kernel
 * before 5.9 does not count them: whether every task has one. */
int vshi_tasks_filtered(int before);

#ifdef __cplusplus
}
#endif
#endif
