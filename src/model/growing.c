#include "model/growing.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

vsh_result vshi_reserve(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                        vsh_error *error) {
    void *array;
    size_t bytes;
    if (needed <= *capacity) {
        return VSH_OK;
    }
    if (__builtin_mul_overflow(needed, size, &bytes)) {
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "%s: %zu × %zu bytes are more than this machine can address", budget->path, needed,
                         size);
    }
    /* while it moves there are two of it */
    VSHI_TRY(vshi_check_limit(budget->run, budget->bytes + (double)bytes, budget->path, error));
    memcpy(&array, memory, sizeof array);
    array = realloc(array, bytes);
    if (array == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", budget->path, bytes);
    }
    memcpy(memory, &array, sizeof array);
    budget->bytes += (double)(needed - *capacity) * (double)size;
    *capacity = needed;
    return VSH_OK;
}

vsh_result vshi_grow(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                     vsh_error *error) {
    enum { LEAST = 16 };
    return needed <= *capacity
               ? VSH_OK
               : vshi_reserve(budget, memory, capacity, needed + needed / 2 + LEAST, size, error);
}
