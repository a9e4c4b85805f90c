/* Numbers in points' files: what is read is what strtod() reads, and what is written is read back to the bit.
 */
#include "fuzz.h"

#include "base/decimal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void check_text(const char *text, size_t size) {
    char *copy = malloc(size + 1);
    double value;
    if (copy == NULL) {
        return;
    }
    memcpy(copy, text, size);
    copy[size] = '\0';
    if (vshi_decimal_read(text, text + size, &value)) {
        char *end;
        const double expected = strtod(copy, &end);
        if (*end != '\0' ||
            (memcmp(&value, &expected, sizeof value) != 0 && !(isnan(value) && isnan(expected)))) {
            abort();
        }
    }
    free(copy);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    check_text((const char *)data, size);
    fuzz_input input = {data, size};
    char text[VSHI_DECIMAL_ROOM];
    double number, back;
    fuzz_fill(&input, &number, sizeof number);
    char *end = vshi_decimal_write_double(text, number);
    if (end > text + sizeof text || !vshi_decimal_read(text, end, &back) ||
        (memcmp(&back, &number, sizeof back) != 0 && !(isnan(back) && isnan(number)))) {
        abort();
    }
    const float single = (float)number;
    end = vshi_decimal_write_float(text, single);
    const int read = vshi_decimal_read(text, end, &back);
    const float again = (float)back;
    if (end > text + sizeof text || !read ||
        (memcmp(&again, &single, sizeof again) != 0 && !(isnan(again) && isnan(single)))) {
        abort();
    }
    return 0;
}
