/* A reader: reads the request, confines itself, parses, answers. */
#include "base/clock.h"
#include "base/memory.h"
#include "io/reader/confine.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_WARNINGS = 1 << 20 /* bytes of all warnings */ };

/* Seconds between two reports of progress. */
static const double report_interval = 0.01;

typedef struct serving {
    char *warnings; /* [count] texts, each with its NUL */
    size_t used, count;
    double reported;
    vshi_reader_state state;
} serving;

/* Any thread of the pool may call this, one at a time. */
static void keep_warning(void *user, const char *message) {
    serving *s = user;
    const size_t size = strlen(message) + 1;
    if (size <= MOST_WARNINGS - s->used) {
        memcpy(s->warnings + s->used, message, size);
        s->used += size;
        ++s->count;
    }
}

/* The pipe does not block: a report without room is lost. */
static int32_t report_progress(void *user, const char *stage, double fraction) {
    serving *s = user;
    (void)stage;
    const double seconds = vshi_seconds();
    if (seconds - s->reported >= report_interval) {
        s->reported = seconds;
        if (write(VSHI_READER_PROGRESS, &fraction, sizeof fraction) < 0) {
            errno = 0;
        }
    }
    return 0;
}

/* Bytes of the heap that every reader needs, and more. */
static const uint64_t heap_slack = (uint64_t)16 << 20;

static int answer(serving *s, vshi_serve_fn *serve, const char *path, vshi_decoder *request,
                  const vsh_run *run) {
    static vshi_encoder encoder;
    vshi_answer_head head = vshi_reader_head(&s->state, VSHI_ANSWER_BEGUN);
    if (!vshi_reader_answer(&head)) {
        return s->state.cramped ? VSHI_READER_FILE_LIMIT : VSHI_READER_CANNOT;
    }
    vsh_error error = {VSH_OK, ""};
    vshi_encoder_begin(&encoder, VSHI_READER_ANSWER, sizeof head);
    encoder.room = run->memory_limit > 0 && !VSHI_SANITIZED ? run->memory_limit + heap_slack : 0;
    vsh_result result = serve(path, request, run, &encoder, &error);
    head.payload = encoder.size - sizeof head;
    const char *text = s->warnings;
    for (size_t i = 0; i < s->count; ++i) {
        vshi_encode_text(&encoder, text);
        text += strlen(text) + 1;
    }
    if (!vshi_encoder_flush(&encoder)) {
        /* the caller's memory limit is a limit of files; the host may have a lower one (ulimit -f) */
        return encoder.error != ENOMEM && s->state.cramped ? VSHI_READER_FILE_LIMIT
                                                           : VSHI_READER_OUT_OF_MEMORY;
    }
    head.code = result;
    head.warnings = s->count;
    snprintf(head.message, sizeof head.message, "%s", error.message);
    return vshi_reader_answer(&head) ? 0 : VSHI_READER_CANNOT;
}

static int32_t serve_request(serving *s, vshi_serve_fn *const *servers, int argc, char **argv) {
    vshi_request request;
    if (!vshi_request_read(&request)) {
        return VSHI_READER_CANNOT;
    }
    if (s->warnings == NULL) {
        return VSHI_READER_OUT_OF_MEMORY;
    }
    s->state = vshi_reader_begin(argc, argv, &request);
    if (s->state.code >= 0) {
        return s->state.code;
    }
    if (request.kind == VSHI_READ_CONFINEMENT) {
        return vshi_reader_answer_confinement(&s->state);
    }
    vsh_run run = vsh_run_default();
    run.threads = 1;
    run.memory_limit = request.memory;
    run.allow_outside = request.outside;
    run.progress = report_progress;
    run.warning = keep_warning;
    run.notes = 1; /* the client drops them if nobody wants them */
    run.user = s;
    vshi_exit_if_new_fails(VSHI_READER_OUT_OF_MEMORY);
    return answer(s, servers[request.kind], request.path, &request.rest, &run);
}

int32_t vshi_serve(vshi_serve_fn *const servers[VSHI_READ_KINDS], int argc, char **argv) {
    if (argc < 2 || strcmp(argv[1], VSH_READER_ARGUMENT) != 0) {
        return -1;
    }
    serving s = {.warnings = malloc(MOST_WARNINGS)};
    const int32_t code = serve_request(&s, servers, argc, argv);
    free(s.warnings);
    return code;
}
