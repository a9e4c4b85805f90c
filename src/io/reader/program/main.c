/* vdbshade-reader: confines itself, and only then loads the library. Its libraries parse files, and some
 * begin threads when they are loaded (OpenVDB's liblog4cplus begins four). */
#include "base/memory.h"
#include "io/reader/confine.h"

#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

typedef int32_t serve_fn(int argc, char **argv);

void vshi_memory_refused(size_t bytes) {
    (void)bytes;
    _exit(VSHI_READER_OUT_OF_MEMORY);
}

static int serve(char *name, char *argument, const vshi_reader_state *state) {
    errno = 0;
    void *library = dlopen(VSHI_LIBRARY, RTLD_LAZY | RTLD_GLOBAL);
    if (library == NULL && errno == ENOMEM) {
        return VSHI_READER_OUT_OF_MEMORY;
    }
    void *symbol = library != NULL ? dlsym(library, "vsh_reader_serve") : NULL;
    if (symbol == NULL) {
        return VSHI_READER_EMPTY;
    }
    serve_fn *function;
    memcpy(&function, &symbol, sizeof function);
    char word[sizeof VSHI_READER_CONFINED + 16];
    snprintf(word, sizeof word, VSHI_READER_CONFINED "%d",
             (int)state->confined + (state->cramped ? VSHI_CONFINED_FILE_LIMIT : 0));
    char *words[] = {name, argument, word, NULL};
    return function(3, words);
}

int main(int argc, char **argv) {
    vshi_request request;
    if (argc < 2 || strcmp(argv[1], VSH_READER_ARGUMENT) != 0) {
        fputs(VSH_READER
              ": reads files for vdbshade and for programs that use its library; not to be called\n",
              stderr);
        return VSHI_READER_CANNOT;
    }
    if (!vshi_request_read(&request)) {
        return VSHI_READER_CANNOT;
    }
    const vshi_reader_state state = vshi_reader_begin(argc, argv, &request);
    if (state.code >= 0) {
        return state.code;
    }
    /* _exit(): destructors of libraries must not run */
    _exit(request.kind == VSHI_READ_CONFINEMENT ? vshi_reader_answer_confinement(&state)
                                                : serve(argv[0], argv[1], &state));
}
