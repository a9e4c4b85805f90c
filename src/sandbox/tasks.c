#define _GNU_SOURCE
#include "sandbox/tasks.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MODE_NONE = 0, MODE_FILTER = 2, STATUS_ROOM = 4096, PATH_ROOM = 64 };

/* Of a kernel that counts no filters: it has some, or none. */
enum { UNCOUNTED = -1 };

typedef struct task_state {
    int mode, filters;
} task_state;

static int field(const char *status, const char *name, int missing) {
    const char *at = strstr(status, name);
    return at != NULL ? atoi(at + strlen(name)) : missing;
}

/* False where it cannot be read, with errno: ENOENT or ESRCH of a task that has ended. */
static bool read_state(const char *path, task_state *state) {
    char status[STATUS_ROOM];
    errno = 0;
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    const ssize_t size = file >= 0 ? read(file, status, sizeof status - 1) : -1;
    const int why = errno;
    if (file >= 0) {
        close(file);
    }
    if (size <= 0) {
        errno = why;
        return false;
    }
    status[size] = '\0';
    *state =
        (task_state){field(status, "\nSeccomp:", MODE_NONE), field(status, "\nSeccomp_filters:", UNCOUNTED)};
    return true;
}

/* The calling thread's; false where it cannot be read. */
static bool read_own_state(task_state *own) {
    char path[PATH_ROOM];
    snprintf(path, sizeof path, "/proc/self/task/%d/status", (int)gettid());
    return read_state(path, own);
}

int vshi_task_filters(void) {
    task_state own = {MODE_NONE, 0};
    return read_own_state(&own) ? own.filters : 0;
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

int vshi_tasks_filtered(int before) {
    task_state own = {MODE_NONE, 0};
    DIR *tasks = read_own_state(&own) ? opendir("/proc/self/task") : NULL;
    if (tasks == NULL) {
        return VSHI_TASKS_UNSEEN;
    }
    bool all = own.mode == MODE_FILTER && (own.filters == UNCOUNTED || own.filters > before);
    for (const struct dirent *entry; all && (entry = readdir(tasks)) != NULL;) {
        char path[PATH_ROOM];
        task_state task = {MODE_NONE, 0};
        if (entry->d_name[0] != '.') {
            snprintf(path, sizeof path, "/proc/self/task/%.20s/status", entry->d_name);
            all = read_state(path, &task) ? task.mode == MODE_FILTER && task.filters == own.filters
                                          : errno == ENOENT || errno == ESRCH; /* ended meanwhile */
        }
    }
    closedir(tasks);
    return all ? VSHI_TASKS_FILTERED : VSHI_TASKS_LOOSE;
}
