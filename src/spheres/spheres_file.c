/* Spheres from a CSV file. */
#include "base/decimal.h"
#include "base/error.h"
#include "base/floats.h"
#include "base/input.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/numbers.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/spheres.h>

static const double LARGEST = 1e15;

/* Of a file, 16 GiB; what is read of it is held against the memory limit. */
static const uint64_t MOST_BYTES = (uint64_t)1 << 34;

typedef struct list {
    double *values;
    size_t count, capacity; /* of spheres */
} list;

static bool is_gap(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/* Four numbers, parted by a comma or semicolon or by blanks alone; false where the row is anything else. */
static bool read_row(const char *text, double numbers[4]) {
    for (int k = 0; k < 4; ++k) {
        while (is_gap(*text)) {
            ++text;
        }
        if (k > 0 && (*text == ',' || *text == ';')) {
            ++text;
        }
        while (is_gap(*text)) {
            ++text;
        }
        const char *end = text + strcspn(text, " \t\r\n,;");
        if (!vshi_decimal_read(text, end, &numbers[k]) || isnan(numbers[k])) {
            return false;
        }
        text = end;
    }
    while (is_gap(*text)) {
        ++text;
    }
    return *text == '\0';
}

static vsh_result add(list *l, const double numbers[4], const char *path, const vsh_run *run,
                      vsh_error *error) {
    if (l->count == l->capacity) {
        const size_t capacity = l->capacity == 0 ? 1024 : 2 * l->capacity;
        vsh_result result = vshi_check_limit(run, 48.0 * (double)capacity, path, error);
        void *grown = NULL;
        if (result == VSH_OK) {
            result = vshi_allocate(&grown, capacity, 4 * sizeof *l->values, path, error);
        }
        if (result != VSH_OK) {
            return result;
        }
        if (l->count > 0) {
            memcpy(grown, l->values, l->count * 4 * sizeof *l->values);
        }
        free(l->values);
        l->values = grown;
        l->capacity = capacity;
    }
    memcpy(l->values + 4 * l->count++, numbers, 4 * sizeof *numbers);
    return VSH_OK;
}

/* A row that is no sphere. */
static vsh_result fail_row(const char *path, size_t row, const char *text, vsh_error *error) {
    char shown[48];
    snprintf(shown, sizeof shown, "%s", text);
    shown[strcspn(shown, "\r\n")] = '\0';
    return vshi_fail(error, VSH_ERROR_INPUT, "%s:%zu: '%s': expected four numbers: x, y, z, radius", path,
                     row, shown);
}

static vsh_result check_numbers(const char *path, size_t row, const double numbers[4], vsh_error *error) {
    static const char *const names[] = {"x", "y", "z", "radius"};
    for (int k = 0; k < 4; ++k) {
        if (!(fabs(numbers[k]) <= LARGEST) || (k == 3 && !(numbers[k] > 0.0))) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s:%zu: %s %g is out of range %g%s … %g", path, row,
                             names[k], numbers[k], k == 3 ? 0.0 : -LARGEST, k == 3 ? " (excluded)" : "",
                             LARGEST);
        }
    }
    return VSH_OK;
}

enum { LINE = 512, REPORTED = 1 << 16 /* bytes, between two reports of progress */ };

/* A file under way. */
typedef struct source {
    FILE *file;
    vshi_job *job;
    size_t unreported;
    bool cancelled;
} source;

/* The next line, or piece of a longer one. */
static bool next(source *from, char text[LINE]) {
    if (from->cancelled || fgets(text, LINE, from->file) == NULL) {
        return false;
    }
    from->unreported += strchr(text, '\n') != NULL ? strlen(text) : LINE - 1; /* of zeros, too */
    if (from->unreported >= REPORTED) {
        from->cancelled = vshi_job_advance(from->job, from->unreported);
        from->unreported = 0;
    }
    return true;
}

static vsh_result read_rows(const char *path, source *from, const vsh_run *run, list *l, vsh_error *error) {
    char text[LINE];
    vsh_result result = VSH_OK;
    bool first = true;
    for (size_t row = 1; result == VSH_OK && next(from, text); ++row) {
        const char *start = text;
        if (row == 1 && strncmp(start, "\xef\xbb\xbf", 3) == 0) {
            start += 3; /* a byte order mark */
        }
        start += strspn(start, " \t\r\n");
        if (*start == '\0' || *start == '#') {
            while (strchr(text, '\n') == NULL && next(from, text)) {
            }
            continue;
        }
        double numbers[4];
        if (strlen(text) + 1 == sizeof text && strchr(text, '\n') == NULL) {
            result = fail_row(path, row, start, error);
        } else if (!read_row(start, numbers)) {
            const bool names = first && ((*start >= 'A' && *start <= 'Z') ||
                                         (*start >= 'a' && *start <= 'z') || *start == '"');
            result = names ? VSH_OK : fail_row(path, row, start, error);
        } else {
            result = check_numbers(path, row, numbers, error);
            result = result == VSH_OK ? add(l, numbers, path, run, error) : result;
        }
        first = false;
    }
    if (result == VSH_OK && from->cancelled) {
        result = vshi_job_fail_cancelled(from->job, error);
    }
    if (result == VSH_OK && ferror(from->file)) {
        result = vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path);
    }
    if (result == VSH_OK && l->count == 0) {
        result = vshi_fail(error, VSH_ERROR_INPUT, "%s: no spheres", path);
    }
    return result;
}

vsh_result vsh_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                            vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(spheres);
    *spheres = NULL;
    VSHI_NEEDS(path);
    VSHI_NEEDS(count);
    *count = 0;
    vsh_run full;
    vsh_result result = vshi_run_resolve(run, &full, error);
    if (result != VSH_OK) {
        return result;
    }
    source from = {NULL, NULL, 0, false};
    uint64_t size;
    result = vshi_input_open(path, path, MOST_BYTES, &from.file, &size, error);
    if (result != VSH_OK) {
        return result;
    }
    VSHI_NUMBERS;
    list l = {NULL, 0, 0};
    from.job = vshi_job_begin(&full, "load", (size_t)size + 1);
    result = from.job != NULL ? read_rows(path, &from, &full, &l, error)
                              : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    if (result == VSH_OK && vshi_job_advance(from.job, (size_t)size + 1)) {
        result = vshi_job_fail_cancelled(from.job, error);
    }
    vshi_job_end(from.job);
    fclose(from.file);
    if (result != VSH_OK) {
        free(l.values);
        return result;
    }
    *spheres = l.values;
    *count = l.count;
    return VSH_OK;
}

void vsh_spheres_list_free(double *spheres) {
    free(spheres);
}
