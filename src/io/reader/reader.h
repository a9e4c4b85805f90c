/* Requests to a reader (vsh_run.reader) for the content of a file, and the common part of all answers. */
#pragma once

#include "base/job.h"

VSH_BEGIN_C

/* --- messages: a file with numbers, texts and arrays, each at a multiple of 8 bytes, in this machine's form.
 * The receiver checks all of them. */

enum { VSHI_ENCODER_BUFFER = 1 << 14 };

/* Writes a message from offset `size` on. Keeps the first failure, and writes nothing after it. */
typedef struct vshi_encoder {
    int file;
    int error;        /* errno of the first failure; 0: none */
    size_t used;      /* of the buffer */
    uint64_t size;    /* bytes of the file, with those of the buffer */
    uint64_t room;    /* limit of bytes in the file and the heap together, else ENOMEM; 0: no limit */
    uint64_t checked; /* size at the last check of `room` */
    unsigned char buffer[VSHI_ENCODER_BUFFER];
} vshi_encoder;

void vshi_encoder_begin(vshi_encoder *encoder, int file, uint64_t offset);
VSHI_SHARED void vshi_encode_array(vshi_encoder *encoder, const void *array, size_t count, size_t size);
VSHI_SHARED void vshi_encode_count(vshi_encoder *encoder, uint64_t count);
VSHI_SHARED void vshi_encode_number(vshi_encoder *encoder, double number);
VSHI_SHARED void vshi_encode_text(vshi_encoder *encoder, const char *text); /* may be NULL */
bool vshi_encoder_flush(vshi_encoder *encoder);                             /* false after a failure */

/* Reads a message in memory. A missing or wrong part sets `bad` and reads as zeros. */
typedef struct vshi_decoder {
    const unsigned char *at, *end; /* `at` is a multiple of 8 */
    bool bad;
} vshi_decoder;

/* Returns a view of count × size bytes (size not 0), at a multiple of 8; NULL if the message is too short or
 * bad, and if count is 0. */
VSHI_SHARED const void *vshi_decode_array(vshi_decoder *decoder, uint64_t count, size_t size);
VSHI_SHARED uint64_t vshi_decode_count(vshi_decoder *decoder, uint64_t most); /* larger ones are bad */
VSHI_SHARED double vshi_decode_number(vshi_decoder *decoder); /* one that is not finite is bad */

/* Returns NULL if the writer encoded NULL, or the text is bad. `line`: control characters are bad. */
VSHI_SHARED const char *vshi_decode_text(vshi_decoder *decoder, bool line);

/* Whether nothing is left, and nothing was bad. */
VSHI_SHARED bool vshi_decoder_ends(const vshi_decoder *decoder);

/* --- requests */

/* Kinds of requests. */
enum {
    VSHI_READ_GRID = 0,
    VSHI_READ_LIST = 1,
    VSHI_READ_VOXELS = 2,
    VSHI_READ_MODEL = 3,
    VSHI_READ_IMAGE = 4,
    VSHI_READ_TEXT = 5,
    VSHI_READ_COPY = 6,
    VSHI_READ_CONFINEMENT = 7, /* how the reader is confined, without a file */
    VSHI_READ_DRACO = 8,       /* all attributes of a glTF's vertices under Draco */
    VSHI_READ_KINDS = 9
};

/* --- the caller */

/* A request: begin it, encode the parameters of the kind, send it. */
typedef struct vshi_exchange {
    const char *path;
    const vsh_run *run;
    vshi_encoder encoder;
} vshi_exchange;

/* An answer. The payload's arrays lie in the mapping, which cannot change any more. */
typedef struct vshi_answer {
    void *map;
    size_t size;
    uint32_t confined; /* VSH_CONFINED_… of the reader */
    vshi_decoder payload;
} vshi_answer;

/* Gets the fraction that the reader has done, 0 … 1, about every 20 ms; returns whether to stop. */
typedef bool vshi_poll_fn(void *user, double fraction);

/* Begins a request. `run` is resolved and has a reader; it and the path live until the request is sent.
 * Errors: VSH_ERROR_MEMORY, VSH_ERROR_ARGUMENT. */
VSHI_SHARED vsh_result vshi_exchange_begin(vshi_exchange *exchange, int32_t kind, const char *path,
                                           const vsh_run *run, vsh_error *error);

/* Starts the reader, waits for its end, and passes its warnings on. Ends the request, even after a failure.
 * Errors: those of the reader; VSH_ERROR_READ (it crashed, or its answer is bad), VSH_ERROR_LIMIT (time,
 * memory), VSH_ERROR_ARGUMENT (the program is missing, or no reader), VSH_ERROR_CANCELLED. */
VSHI_SHARED vsh_result vshi_exchange_send(vshi_exchange *exchange, vshi_poll_fn *poll, void *user,
                                          vshi_answer *answer, vsh_error *error);

/* Does the same with the progress and cancelling of a job, for `units` of it. */
VSHI_SHARED vsh_result vshi_exchange_send_job(vshi_exchange *exchange, vshi_job *job, size_t units,
                                              vshi_answer *answer, vsh_error *error);

VSHI_SHARED void vshi_answer_free(vshi_answer *answer);

/* Fails with VSH_ERROR_READ: a sound reader sends no such answer. */
VSHI_SHARED vsh_result vshi_answer_fail(const char *path, const char *what, vsh_error *error);

/* --- the reader */

/* Parses `path` for a request, and encodes the answer's payload. */
typedef vsh_result vshi_serve_fn(const char *path, vshi_decoder *request, const vsh_run *run,
                                 vshi_encoder *payload, vsh_error *error);

/* Implements vsh_reader_serve(), with the parsers of all kinds (VSHI_READ_…). */
int32_t vshi_serve(vshi_serve_fn *const servers[VSHI_READ_KINDS], int argc, char **argv);

/* --- both */

/* The elements of an array. (clang-format puts each element of a braced list on its own line.) */
#define VSHI_LIST(...)                                                                                       \
    { __VA_ARGS__ }

/* The descriptors of a reader, after the standard ones. */
enum { VSHI_READER_ANSWER = 3, VSHI_READER_REQUEST = 4, VSHI_READER_PROGRESS = 5 };

/* The word by which vdbshade-reader tells the library how it is confined: this, and a sum of VSH_CONFINED_…
 * and VSHI_CONFINED_FILE_LIMIT. */
#define VSHI_READER_CONFINED "confined="
enum { VSHI_CONFINED_FILE_LIMIT = 256 /* the host limits the size of files */ };

/* A reader's exit codes. */
enum {
    VSHI_READER_OUT_OF_MEMORY = 86, /* the system refused memory */
    VSHI_READER_FILE_LIMIT = 87,    /* the answer exceeds the host's limit on the size of files */
    VSHI_READER_CANNOT = 89,        /* it could not begin */
    VSHI_READER_EMPTY = 90          /* it could not load the library */
};

#define VSHI_REQUEST_MAGIC UINT64_C(0x6b7361687376)
#define VSHI_ANSWER_MAGIC UINT64_C(0x726577736e61)

/* The version of the messages' form: raise it with every change. */
enum { VSHI_READER_PROTOCOL = 8 };

/* The head of an answer. The reader writes it twice: with code VSHI_ANSWER_BEGUN before it parses, and at the
 * end. */
typedef struct vshi_answer_head {
    uint64_t magic;
    uint32_t protocol;
    int32_t code;      /* a vsh_result */
    uint64_t payload;  /* bytes after the head */
    uint64_t warnings; /* number of texts after the payload */
    uint64_t confined; /* VSH_CONFINED_… */
    char message[1024];
} vshi_answer_head;

enum { VSHI_ANSWER_BEGUN = -1 };

VSH_END_C
