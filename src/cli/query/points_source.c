#include "points.h"

#include "base/input.h"
#include "cli/message.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ROOM = 1 << 18, MOST = 1 << 26 /* bytes of a line */ };

int points_source_open(const char *path, points_source *source) {
    const bool standard = strcmp(path, "-") == 0;
    *source = (points_source){.name = standard ? "standard input" : path, .room = ROOM};
    struct stat status;
    vsh_error error;
    if (!standard &&
        vshi_input_open(path, path, UINT64_MAX, &source->file, &source->size, &error) != VSH_OK) {
        const bool waits = stat(path, &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode);
        cli_say("%s%s", error.message, waits ? "; a pipe is read as standard input, by --points -" : "");
        return CLI_FILE;
    }
    if (standard && (fstat(STDIN_FILENO, &status) != 0 || S_ISDIR(status.st_mode))) {
        cli_say("%s: cannot be read: it is a folder", source->name);
        return CLI_FILE;
    }
    if (standard && S_ISREG(status.st_mode)) {
        source->size = (uint64_t)status.st_size;
    }
    source->buffer = malloc(source->room);
    if (source->buffer == NULL) {
        cli_say("%s: the system refused memory", source->name);
        return CLI_LIMIT;
    }
    return CLI_OK;
}

void points_source_close(points_source *source) {
    if (source->file != NULL) {
        fclose(source->file);
    }
    free(source->buffer);
    source->buffer = NULL;
    source->file = NULL;
}

/* Some more bytes behind those that there are, which may move. */
static int fill(points_source *s) {
    if (s->begin > 0 && s->end == s->room) {
        memmove(s->buffer, s->buffer + s->begin, s->end - s->begin);
        s->end -= s->begin;
        s->begin = 0;
    }
    if (s->end == s->room) {
        char *more = s->room < MOST ? realloc(s->buffer, 2 * s->room) : NULL;
        if (more == NULL) {
            cli_say("%s: a row of more than %zu bytes", s->name, s->room);
            return s->room < MOST ? CLI_LIMIT : CLI_USAGE;
        }
        s->buffer = more;
        s->room *= 2;
    }
    ssize_t got;
    do {
        got = read(s->file != NULL ? fileno(s->file) : STDIN_FILENO, s->buffer + s->end, s->room - s->end);
    } while (got < 0 && errno == EINTR);
    if (got < 0) {
        cli_say("%s: cannot be read: %s", s->name, strerror(errno));
        return CLI_FILE;
    }
    s->ended = got == 0;
    s->end += (size_t)got;
    return CLI_OK;
}

int points_source_line(points_source *s, const char **line, size_t *size) {
    size_t looked = 0;
    for (;;) {
        char *start = s->buffer + s->begin;
        const size_t held = s->end - s->begin;
        const char *stop = memchr(start + looked, '\n', held - looked);
        if (stop != NULL || (s->ended && held > 0)) {
            const size_t length = stop != NULL ? (size_t)(stop - start) : held;
            points_source_take(s, length + (stop != NULL));
            *line = start;
            *size = length - (length > 0 && start[length - 1] == '\r');
            return CLI_OK;
        }
        if (s->ended) {
            *line = NULL;
            return CLI_OK;
        }
        looked = held;
        const int code = fill(s);
        if (code != CLI_OK) {
            return code;
        }
    }
}

int points_source_peek(points_source *s, size_t size, const char **bytes, size_t *available) {
    while (s->end - s->begin < size && !s->ended) {
        const int code = fill(s);
        if (code != CLI_OK) {
            return code;
        }
    }
    *bytes = s->buffer + s->begin;
    *available = s->end - s->begin < size ? s->end - s->begin : size;
    return CLI_OK;
}

void points_source_take(points_source *s, size_t size) {
    s->begin += size;
    s->taken += size;
}
