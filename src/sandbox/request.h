/* What a reader is asked for, and how it stands before it begins. */
#ifndef VSHI_READ_REQUEST_H
#define VSHI_READ_REQUEST_H

#include "sandbox/message.h"

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
    vshi_decoder rest; /* what the kind wants to know */
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

/* Answers with nothing but what is confined. Returns the exit code. */
int vshi_reader_tell(const vshi_reader_state *state);

/* Names what of VSH_CONFINED_ALL is missing, "seccomp (system calls), Landlock (files)", into `text`, which
 * is returned. */
enum { VSHI_MISSING_TEXT = 128 };
const char *vshi_missing_text(uint64_t confined, char text[VSHI_MISSING_TEXT]);

#ifdef __cplusplus
}
#endif
#endif
