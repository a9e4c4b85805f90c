#include "base/attributes.h"

#include <stdlib.h>
#include <string.h>

enum { LONGEST_NAME = 79 /* PNG's */, LONGEST_VALUE = 65535 };

static bool is_name(const char *text) {
    const size_t length = strnlen(text, LONGEST_NAME + 1);
    bool good = length > 0 && length <= LONGEST_NAME;
    for (size_t i = 0; i < length && good; ++i) {
        good = text[i] > 0x20 && text[i] < 0x7f;
    }
    return good;
}

static bool is_value(const char *text) {
    const size_t length = strnlen(text, LONGEST_VALUE + 1);
    bool good = length <= LONGEST_VALUE;
    for (size_t i = 0; i < length && good; ++i) {
        good = (unsigned char)text[i] >= 0x20 && text[i] != 0x7f;
    }
    return good;
}

vsh_result vshi_attributes_check(const char *path, const vsh_attribute *attributes, size_t count,
                                 vsh_error *error) {
    if (attributes == NULL && count > 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %zu attributes, but none are given", path, count);
    }
    for (size_t i = 0; i < count; ++i) {
        const vsh_attribute *a = &attributes[i];
        if (a->name == NULL || !is_name(a->name)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: attribute %zu '%.80s': expected a name of 1 … %d printable letters", path,
                             i, a->name != NULL ? a->name : "", LONGEST_NAME);
        }
        if (a->value == NULL || !is_value(a->value)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: attribute '%s': expected a line of text of at most %d bytes", path, a->name,
                             LONGEST_VALUE);
        }
        for (size_t k = 0; k < i; ++k) {
            if (strcmp(attributes[k].name, a->name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: attribute '%s' is given twice", path,
                                 a->name);
            }
        }
    }
    return VSH_OK;
}

static char *copy_line(const char *text) {
    char *copy = strdup(text);
    if (copy != NULL) {
        vshi_one_line(copy);
    }
    return copy;
}

static bool grow(vshi_attributes *a) {
    const size_t capacity = 2 * a->capacity + 16;
    vsh_attribute *list = realloc(a->list, capacity * sizeof *list);
    a->list = list != NULL ? list : a->list;
    void *texts = list != NULL ? realloc(a->texts, capacity * sizeof *a->texts) : NULL;
    a->texts = texts != NULL ? texts : a->texts;
    a->capacity = texts != NULL ? capacity : a->capacity;
    return texts != NULL;
}

bool vshi_attributes_add(vshi_attributes *a, const char *name, const char *value) {
    if (a->count == a->capacity && !grow(a)) {
        return false;
    }
    char **texts = a->texts[a->count];
    texts[0] = copy_line(name);
    texts[1] = copy_line(value);
    a->list[a->count++] = (vsh_attribute){texts[0], texts[1]};
    return texts[0] != NULL && texts[1] != NULL;
}

void vshi_attributes_free(vshi_attributes *a) {
    for (size_t i = 0; i < a->count; ++i) {
        free(a->texts[i][0]);
        free(a->texts[i][1]);
    }
    free(a->texts);
    free(a->list);
    *a = (vshi_attributes){NULL, NULL, 0, 0};
}
