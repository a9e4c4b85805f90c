/* Numbers in points' files: what is read is what strtod() reads, and what is written is read back to the bit.
 */
#include "fuzz.h"

#include "base/decimal.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static bool are_same(double a, double b) {
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static void check_text(const char *text, size_t size) {
    char *copy = malloc(size + 1);
    double value;
    memcpy(copy, text, size);
    copy[size] = '\0';
    if (vshi_decimal_read(text, text + size, &value)) {
        char *end;
        const double expected = strtod(copy, &end);
        FUZZ_REQUIRE(*end == '\0' && are_same(value, expected));
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
    FUZZ_REQUIRE(end <= text + sizeof text && vshi_decimal_read(text, end, &back) && are_same(back, number));
    const float single = (float)number;
    end = vshi_decimal_write_float(text, single);
    FUZZ_REQUIRE(end <= text + sizeof text && vshi_decimal_read(text, end, &back));
    FUZZ_REQUIRE(are_same((double)(float)back, (double)single));
    return 0;
}
