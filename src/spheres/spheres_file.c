/* Spheres from a CSV file. */
#include "base/decimal.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/numbers.h"
#include "base/try.h"
#include "spheres/sphere_tree.h"
#include "table/table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/spheres.h>

enum { SHOWN = 47 }; /* bytes of a bad line */

/* Of a file, 16 GiB; what is read of it is held against the memory limit. */
static const uint64_t MOST_BYTES = (uint64_t)1 << 34;

typedef struct list {
    double *values;
    size_t count, capacity; /* of spheres */
} list;

/* Four numbers; false where the line is anything else. */
static bool read_row(const char *line, size_t size, double numbers[4]) {
    const char *at = line, *end = line + size;
    for (int k = 0; k < 4; ++k) {
        const vshi_field f = at <= end ? vshi_field_next(&at, end, VSHI_BETWEEN_ANY) : (vshi_field){end, end};
        if (!vshi_decimal_read(f.text, f.end, &numbers[k]) || isnan(numbers[k])) {
            return false;
        }
    }
    return at > end;
}

static vsh_result add(list *l, const double numbers[4], const char *path, const vsh_run *run,
                      vsh_error *error) {
    if (l->count == l->capacity) {
        const size_t capacity = l->capacity == 0 ? 1024 : 2 * l->capacity;
        void *grown = NULL;
        VSHI_TRY(vshi_check_limit(run, 48.0 * (double)capacity, path, error));
        VSHI_TRY(vshi_allocate(&grown, capacity, 4 * sizeof *l->values, path, error));
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

/* Whether a line that is no sphere may name the columns. */
static bool is_header(char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '"';
}

static vsh_result read_rows(vshi_source *from, const vsh_run *run, list *l, vsh_error *error) {
    bool first = true;
    VSHI_TRY(vshi_source_pass_mark(from, error));
    for (size_t row = 1;; ++row) {
        const char *line;
        size_t size;
        double numbers[4];
        VSHI_TRY(vshi_source_line(from, &line, &size, error));
        if (line == NULL) {
            break;
        }
        if (vshi_line_is_empty(line, size)) {
            continue;
        }
        if (read_row(line, size, numbers)) {
            VSHI_TRY(vshi_sphere_check(numbers, from->name, row, error));
            VSHI_TRY(add(l, numbers, from->name, run, error));
        } else if (!first || !is_header(line[strspn(line, " \t")])) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s:%zu: '%.*s': expected four numbers: x, y, z, radius",
                             from->name, row, size < SHOWN ? (int)size : SHOWN, line);
        }
        first = false;
    }
    return l->count > 0 ? VSH_OK : vshi_fail(error, VSH_ERROR_INPUT, "%s: no spheres", from->name);
}

vsh_result vsh_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                            vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NUMBERS;
    VSHI_NEEDS(spheres);
    *spheres = NULL;
    VSHI_NEEDS(path);
    VSHI_NEEDS(count);
    *count = 0;
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_source from;
    vshi_job *job = NULL;
    list l = {NULL, 0, 0};
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_source_open(path, MOST_BYTES, &from, error));
    from.job = job = vshi_job_begin(&full, "load", (size_t)from.size + 1);
    if (job == NULL) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path));
    }
    VSHI_TRY_DONE(read_rows(&from, &full, &l, error));
    if (vshi_job_advance(job, 1)) {
        VSHI_TRY_DONE(vshi_job_fail_cancelled(job, error));
    }
    *spheres = l.values;
    *count = l.count;
    l.values = NULL;
done:
    free(l.values);
    vshi_job_end(job);
    vshi_source_close(&from);
    return result;
}

void vsh_spheres_list_free(double *spheres) {
    free(spheres);
}
