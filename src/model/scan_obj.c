/* OBJ: every coordinate a finite number, every index one of a vertex that exists, and the number of faces.
 * Assimp 5.2 reads "1.5x" as 1.5 and a texture coordinate "nan" as 0, drops all UVs of a mesh where one index
 * is out of range, and passes over statements that do not begin their line. */
#include "model/scan.h"

#include <string.h>

enum { POSITION, TEXTURE, NORMAL, KINDS };

static const struct {
    const char *keyword, *name;
    int numbers; /* at least */
} kinds[KINDS] = {
    {"v", "vertex", 3},
    {"vt", "texture coordinate", 1},
    {"vn", "normal", 3},
};

typedef struct obj_state {
    int64_t count[KINDS];
    int64_t highest[KINDS]; /* index used, from 1; vertices may follow the faces that use them */
    size_t highest_line[KINDS];
} obj_state;

/* The logical line at *at, without its end, in [begin, end): a line that ends in '\' goes on in the next. *at
 * moves to the next line, *number counts lines. */
static const char *line_end(const char **at, const char *end, size_t *number) {
    const char *c = *at;
    for (;;) {
        const char *stop = memchr(c, '\n', (size_t)(end - c));
        ++*number;
        if (stop == NULL) {
            *at = end;
            return end;
        }
        const char *last = stop > c && stop[-1] == '\r' ? stop - 1 : stop;
        if (last > c && last[-1] == '\\') {
            c = stop + 1;
            continue;
        }
        *at = stop + 1;
        return stop;
    }
}

static bool is_continuation(vshi_token token) {
    return vshi_token_is(token, "\\");
}

static vsh_result scan_numbers(const vshi_scan *scan, size_t line, int kind, const char *at, const char *end,
                               vsh_error *error) {
    int numbers = 0;
    for (;;) {
        const vshi_token token = vshi_scan_token(&at, end);
        if (token.text == NULL || token.text[0] == '#') {
            break;
        }
        if (is_continuation(token)) {
            continue;
        }
        const vshi_number number = vshi_token_number(token);
        if (number != VSHI_NUMBER_FINITE) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: line %zu: %s holds '%.*s', expected a finite number", scan->path, line,
                             kinds[kind].name, VSHI_TOKEN_ARGS(token));
        }
        ++numbers;
    }
    if (numbers < kinds[kind].numbers) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu: %s of %d numbers, expected at least %d",
                         scan->path, line, kinds[kind].name, numbers, kinds[kind].numbers);
    }
    return VSH_OK;
}

/* One corner: p, p/t, p//n or p/t/n, from 1, or from -1 backwards from the latest. */
static vsh_result scan_corner(const vshi_scan *scan, obj_state *state, size_t line, vshi_token corner,
                              vsh_error *error) {
    const char *at = corner.text, *end = corner.text + corner.size;
    for (int kind = POSITION; kind < KINDS && at <= end; ++kind) {
        const char *slash = memchr(at, '/', (size_t)(end - at));
        const vshi_token part = {at, (size_t)((slash != NULL ? slash : end) - at)};
        at = slash != NULL ? slash + 1 : end + 1;
        if (part.size == 0 && kind != POSITION) {
            continue;
        }
        int64_t index;
        if (!vshi_token_integer(part, &index) || (kind == NORMAL && slash != NULL)) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu: '%.*s' is no corner of a face",
                             scan->path, line, VSHI_TOKEN_ARGS(corner));
        }
        if (index == 0 || index < -state->count[kind]) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: line %zu: %s index %lld out of range, there are %lld so far", scan->path,
                             line, kinds[kind].name, (long long)index, (long long)state->count[kind]);
        }
        if (index > state->highest[kind]) {
            state->highest[kind] = index;
            state->highest_line[kind] = line;
        }
    }
    return VSH_OK;
}

static vsh_result scan_face(vshi_scan *scan, obj_state *state, size_t line, const char *at, const char *end,
                            vsh_error *error) {
    size_t corners = 0;
    for (;;) {
        const vshi_token token = vshi_scan_token(&at, end);
        if (token.text == NULL) {
            break;
        }
        if (is_continuation(token)) {
            continue;
        }
        const vsh_result result = scan_corner(scan, state, line, token, error);
        if (result != VSH_OK) {
            return result;
        }
        ++corners;
    }
    scan->faces += corners >= 3;
    return VSH_OK;
}

static vsh_result scan_line(vshi_scan *scan, obj_state *state, size_t line, const char *begin,
                            const char *end, vsh_error *error) {
    const char *at = begin;
    const vshi_token keyword = vshi_scan_token(&at, end);
    int kind = POSITION;
    while (kind < KINDS && !vshi_token_is(keyword, kinds[kind].keyword)) {
        ++kind;
    }
    const bool face = vshi_token_is(keyword, "f");
    if (kind == KINDS && !face) {
        return VSH_OK;
    }
    if (keyword.text != begin) {
        return vshi_fail(
            error, VSH_ERROR_INPUT,
            "%s: line %zu: '%.*s' is indented; Assimp reads statements from the line's begin only",
            scan->path, line, VSHI_TOKEN_ARGS(keyword));
    }
    if (face) {
        return scan_face(scan, state, line, at, end, error);
    }
    ++state->count[kind];
    return scan_numbers(scan, line, kind, at, end, error);
}

vsh_result vshi_scan_obj(vshi_scan *scan, vsh_error *error) {
    enum { LINES_A_POLL = 4096 };
    obj_state state = {{0}, {0}, {0}};
    const char *at = scan->text, *end = scan->text + scan->size;
    size_t next_poll = LINES_A_POLL;
    for (size_t number = 0; at < end;) {
        const size_t line = number + 1;
        const char *begin = at;
        const char *stop = line_end(&at, end, &number);
        const vsh_result result = scan_line(scan, &state, line, begin, stop, error);
        if (result != VSH_OK) {
            return result;
        }
        if (number >= next_poll) {
            next_poll = number + LINES_A_POLL;
            if (vshi_scan_poll(scan, at)) {
                return vshi_job_fail_cancelled(scan->job, error);
            }
        }
    }
    for (int kind = POSITION; kind < KINDS; ++kind) {
        if (state.highest[kind] > state.count[kind]) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: line %zu: %s index %lld out of range, the file has %lld", scan->path,
                             state.highest_line[kind], kinds[kind].name, (long long)state.highest[kind],
                             (long long)state.count[kind]);
        }
    }
    return VSH_OK;
}
