#include "heightfield/heights_check.h"

#include "base/try.h"

#include <math.h>
#include <stdbool.h>

static const double LEAST = 1e-12, LARGEST = 1e12;
static const double DEFAULT_BASE = 0.05; /* of the longer side */

static vsh_result check_numbers(const vsh_heights_source *s, const char *name, vsh_error *error) {
    const struct {
        const char *what;
        double value, low, high;
    } fields[] = {
        {"columns", s->columns, 2, VSH_MAX_HEIGHTS_SIDE}, {"rows", s->rows, 2, VSH_MAX_HEIGHTS_SIDE},
        {"size[0]", s->size[0], LEAST, LARGEST},          {"size[1]", s->size[1], LEAST, LARGEST},
        {"height", s->height, -LARGEST, LARGEST},         {"base", s->base, 0.0, LARGEST},
    };
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i) {
        if (!(fields[i].value >= fields[i].low && fields[i].value <= fields[i].high)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s %g is out of range %g … %g", name,
                             fields[i].what, fields[i].value, fields[i].low, fields[i].high);
        }
    }
    return VSH_OK;
}

vsh_result vshi_heights_check(const vsh_heights_source *source, const char *call,
                              vshi_checked_heights *terrain, vsh_error *error) {
    if (source == NULL || source->values == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s is NULL", call,
                         source == NULL ? "source" : "values");
    }
    const char *name = source->name != NULL ? source->name : "heights";
    VSHI_TRY(check_numbers(source, name, error));
    const size_t columns = (size_t)source->columns, samples = columns * (size_t)source->rows;
    double lowest = INFINITY, highest = -INFINITY;
    for (size_t i = 0; i < samples; ++i) {
        const double y = source->height * (double)source->values[i];
        if (!isfinite((float)y)) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: row %zu, column %zu: value %g is no height: it must be finite, and also "
                             "times %g",
                             name, i / columns, i % columns, (double)source->values[i], source->height);
        }
        lowest = y < lowest ? y : lowest;
        highest = y > highest ? y : highest;
    }
    const double base =
        source->base > 0.0 ? source->base : DEFAULT_BASE * fmax(source->size[0], source->size[1]);
    *terrain = (vshi_checked_heights){source, name, samples, lowest, highest, lowest - base};
    return VSH_OK;
}
