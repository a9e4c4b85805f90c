/* Spheres from a CSV file. */
#include "base/error.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/numbers.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <vdbshade/spheres.h>

static const double LARGEST = 1e15;

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
        char *end = NULL;
        if (strchr("+-.0123456789", *text) == NULL || *text == '\0' || strpbrk(text, "xXpP") != NULL) {
            return false;
        }
        numbers[k] = strtod(text, &end);
        if (end == text || !(is_gap(*end) || *end == ',' || *end == ';' || *end == '\0')) {
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

static vsh_result read_rows(const char *path, FILE *file, const vsh_run *run, list *l, vsh_error *error) {
    char text[512];
    vsh_result result = VSH_OK;
    bool first = true;
    for (size_t row = 1; result == VSH_OK && fgets(text, sizeof text, file) != NULL; ++row) {
        const char *start = text;
        if (row == 1 && strncmp(start, "\xef\xbb\xbf", 3) == 0) {
            start += 3; /* a byte order mark */
        }
        start += strspn(start, " \t\r\n");
        if (*start == '\0' || *start == '#') {
            while (strchr(text, '\n') == NULL && fgets(text, sizeof text, file) != NULL) {
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
    if (result == VSH_OK && ferror(file)) {
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
    struct stat status;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, strerror(errno));
    }
    if (stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        fclose(file);
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: it is a folder", path);
    }
    VSHI_NUMBERS;
    list l = {NULL, 0, 0};
    result = read_rows(path, file, &full, &l, error);
    fclose(file);
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
