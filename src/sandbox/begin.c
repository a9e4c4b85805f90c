/* The reader's side before anything is parsed, or any library loaded that could: all of its confinement. */
#define _GNU_SOURCE
#include "sandbox/confine.h"
#include "sandbox/landlock.h"
#include "sandbox/reader.h"
#include "sandbox/request.h"
#include "sandbox/tasks.h"

#include <vdbshade/reader.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

/* Words behind VSH_READER_ARGUMENT, of a reader to itself and to the library that it loads. */
static const char again[] = "again";
static const char held[] = VSHI_READER_HELD;

/* The threads that libraries have begun before main are none of this thread's, which Landlock would hold for:
 * where this program is started once more they come after it, and it holds for them, too. */
static void start_again(char **argv, const vshi_request *request) {
    char argument[] = VSH_READER_ARGUMENT, word[sizeof again];
    memcpy(word, again, sizeof again);
    char *const words[] = {argv[0], argument, word, NULL};
    if (vshi_landlock_version() > 0 && vshi_landlock_confine(request, true)) {
        execv("/proc/self/exe", words);
    }
}

static bool files_are_limited(void) {
    struct rlimit size;
    return getrlimit(RLIMIT_FSIZE, &size) == 0 && size.rlim_cur != RLIM_INFINITY;
}

/* Data (heap, stacks, what libraries write to) that reading a small file takes, whatever it holds, and 50
 * MiB: most of it is never touched. OpenImageIO brings the libraries of all its formats, and their threads.
 */
static uint64_t data_beside(const vshi_request *request) {
    return (uint64_t)(request->kind == VSHI_READ_IMAGE ? 176 : 68) << 20;
}

static void confine(const vshi_request *request, bool files, vshi_reader_state *state) {
    state->cramped = files_are_limited();
    if (vshi_confine_resources(request->memory, data_beside(request), request->seconds)) {
        state->confined |= VSH_CONFINED_LIMITS;
    }
    if ((uint64_t)getppid() != request->parent) {
        state->code = VSHI_READER_CANNOT; /* it died before its death would have been ours */
        return;
    }
    if (VSHI_SANITIZED) {
        return;
    }
    if (vshi_landlock_confine(request, false) && files) {
        state->confined |= VSH_CONFINED_FILES;
    }
    const int calls = vshi_confine_calls();
    if (calls == VSHI_CALLS_CONFINED) {
        state->confined |= VSH_CONFINED_CALLS;
    } else if (calls == VSHI_CALLS_IN_PART) {
        state->code = VSHI_READER_UNCONFINED;
    }
}

/* What vdbshade-reader, which has loaded this library, tells of itself. */
static vshi_reader_state take_held(const char *word) {
    const int told = atoi(word);
    vshi_reader_state state = {(uint32_t)told & VSH_CONFINED_ALL, (told & VSHI_HELD_FILE_LIMIT) != 0, -1};
    if ((state.confined & VSH_CONFINED_CALLS) != 0 && vshi_tasks_filtered(0) != VSHI_TASKS_FILTERED) {
        state.code = VSHI_READER_UNCONFINED;
    }
    return state;
}

static int answer(const vshi_answer_head *head) {
    const ssize_t written = pwrite(VSHI_READER_ANSWER, head, sizeof *head, 0);
    return written == (ssize_t)sizeof *head ? 0 : VSHI_READER_CANNOT;
}

static vshi_answer_head head_of(const vshi_reader_state *state, vsh_result code) {
    return (vshi_answer_head){.magic = VSHI_ANSWER_MAGIC,
                              .protocol = VSHI_READER_PROTOCOL,
                              .code = code,
                              .confined = state->confined};
}

static void refuse(const vshi_request *request, vshi_reader_state *state) {
    char missing[VSHI_MISSING_TEXT];
    vshi_answer_head head = head_of(state, VSH_ERROR_UNSUPPORTED);
    snprintf(head.message, sizeof head.message,
             "%s: not read: its reader is to be confined, and this system refuses it %s", request->path,
             vshi_missing_text(state->confined, missing));
    state->code = answer(&head);
}

vshi_reader_state vshi_reader_begin(int argc, char **argv, const vshi_request *request) {
    const char *word = argc > 2 ? argv[2] : "";
    vshi_reader_state state = {0, false, -1};
    if (strncmp(word, held, sizeof held - 1) == 0) {
        return take_held(word + sizeof held - 1);
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

int vshi_reader_tell(const vshi_reader_state *state) {
    const vshi_answer_head head = head_of(state, VSH_OK);
    return answer(&head);
}
