/* The request of a reader, and its confinement. */
#pragma once

#include "io/reader/reader.h"

#include <vdbshade/base.h>

VSH_BEGIN_C

enum { VSHI_MOST_FOLDERS = 64 };

typedef struct vshi_request {
    uint64_t kind, parent, memory; /* VSHI_READ_…; process; bytes, 0: no limit */
    double seconds;
    bool demanded; /* vsh_run.confined */
    bool outside;  /* vsh_run.allow_outside */
    const char *path;
    const char *folders[VSHI_MOST_FOLDERS]; /* with libraries */
    size_t folder_count;
    vshi_decoder rest; /* parameters of the kind */
} vshi_request;

/* Maps the request of this reader for good. Returns false if there is none, or it has another version. */
bool vshi_request_read(vshi_request *request);

/* The state of a reader before it reads. */
typedef struct vshi_reader_state {
    uint32_t confined; /* VSH_CONFINED_… */
    bool cramped;      /* the host limits the size of files */
    int code;          /* to exit with at once; -1: none */
} vshi_reader_state;

/* Confines this process for a request, with the arguments of main. If libraries have begun threads, the
 * process starts itself again under Landlock, and calls this again. If the request demands confinement and
 * a part is missing, this answers so. */
vshi_reader_state vshi_reader_begin(int argc, char **argv, const vshi_request *request);

/* Makes the head of an answer without payload. */
vshi_answer_head vshi_reader_head(const vshi_reader_state *state, int32_t code);

/* Writes the head of an answer; returns false if that fails. */
bool vshi_reader_answer(const vshi_answer_head *head);

/* Answers only how the reader is confined. Returns the exit code. */
int vshi_reader_answer_confinement(const vshi_reader_state *state);

/* Lists the missing parts of VSH_CONFINED_ALL in `text`, "seccomp (system calls), Landlock (files)", and
 * returns it. */
enum { VSHI_MISSING_TEXT = 128 };
const char *vshi_missing_text(uint64_t confined, char text[VSHI_MISSING_TEXT]);

/* Limits this process for good. Data: `memory` bytes (0: those of the machine), `base` and a stack for each
 * core. Address space: `memory` and 2 GiB. Processor time: `seconds`. Files: a little more than `memory`. No
 * core dump, no new privileges; dies with its parent. Returns false if the system refuses some of this, and
 * in a sanitized build. */
bool vshi_confine_resources(uint64_t memory, uint64_t base, double seconds);

/* Counts the tasks (threads) of this process; 0 without /proc. */
int vshi_task_count(void);

/* Returns the kernel's version of Landlock; 0 if it has none, or it is not switched on. */
int vshi_landlock_version(void);

VSH_END_C
