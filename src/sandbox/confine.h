/* The request of a reader, and its confinement. */
#ifndef VSHI_CONFINE_H
#define VSHI_CONFINE_H

#include "sandbox/reader.h"

#include <vdbshade/reader.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { VSHI_MOST_FOLDERS = 64 };

typedef struct vshi_request {
    uint64_t kind, parent, memory; /* VSHI_READ_…; process; bytes, 0: no limit */
    double seconds;
    bool demanded; /* vsh_run.confined */
    bool outside;  /* vsh_run.allow_outside */
    const char *path;
    const char *folders[VSHI_MOST_FOLDERS]; /* that libraries are loaded from */
    size_t folder_count;
    vshi_decoder rest; /* parameters of the kind */
} vshi_request;

/* Maps the request of this reader for good. False where there is none, or none of this version. */
bool vshi_request_read(vshi_request *request);

/* How a reader stands before it reads. */
typedef struct vshi_reader_state {
    uint32_t confined; /* VSH_CONFINED_… */
    bool cramped;      /* the size of files had a limit before ours */
    int code;          /* to end with, and not to read; -1: none */
} vshi_reader_state;

/* Confines this process for a request. The words are those of main: a reader that libraries have begun
 * threads in starts itself once more, under Landlock, and comes here again. Where confinement is demanded and
 * something of it is missing, it has answered so. */
vshi_reader_state vshi_reader_begin(int argc, char **argv, const vshi_request *request);

/* The head of an answer without payload. */
vshi_answer_head vshi_reader_head(const vshi_reader_state *state, int32_t code);

/* Writes it; false where that fails. */
bool vshi_reader_answer(const vshi_answer_head *head);

/* Answers with nothing but what is confined. Returns the exit code. */
int vshi_reader_tell(const vshi_reader_state *state);

/* Names what of VSH_CONFINED_ALL is missing, "seccomp (system calls), Landlock (files)", into `text`, which
 * is returned. */
enum { VSHI_MISSING_TEXT = 128 };
const char *vshi_missing_text(uint64_t confined, char text[VSHI_MISSING_TEXT]);

/* Limits this process for good: `memory` bytes (0: as much as the machine has) of data, `beside` more and a
 * stack for each core; address space of `memory` and 2 GiB; `seconds` of processor time, no core dump, no
 * file larger than what may be handed over, no new privileges, death with its parent. False where the host
 * allows not all of it, or in a sanitized build. */
bool vshi_confine_resources(uint64_t memory, uint64_t beside, double seconds);

/* Leaves the system calls that parsing needs, in every thread of this process and those to come; the others
 * fail with EPERM, and calls of another kind of machine (32 bit, x32) end the process. False where the host
 * allows no filter, or in a sanitized build. */
bool vshi_confine_calls(void);

/* Counts the tasks (threads) of this process; 0 where /proc is missing. */
int vshi_task_count(void);

/* The version of Landlock that this kernel has; 0: none, or it is not switched on. */
int vshi_landlock_version(void);

/* From now on memory that operator new is refused ends the process with VSHI_READER_OUT_OF_MEMORY, before a
 * library can do worse. */
void vshi_confine_memory(void);

#ifdef __cplusplus
}
#endif
#endif
