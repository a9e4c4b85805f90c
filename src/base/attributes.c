#include "base/attributes.h"

#include "base/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { LONGEST_NAME = 79 /* PNG's */, LONGEST_VALUE = 65535 };

/* Whether all bytes of a text, at most `longest`, are in a range, and none is a control character (DEL). */
static bool is_line(const char *text, size_t longest, unsigned char first, unsigned char last) {
    const size_t length = strnlen(text, longest + 1);
    bool good = length <= longest;
    for (size_t i = 0; i < length && good; ++i) {
        const unsigned char c = (unsigned char)text[i];
        good = c >= first && c <= last && c != 0x7f;
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
        if (a->name == NULL || a->name[0] == '\0' || !is_line(a->name, LONGEST_NAME, 0x21, 0x7e)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: attribute %zu '%.80s': expected a name of 1 … %d printable letters", path,
                             i, a->name != NULL ? a->name : "", LONGEST_NAME);
        }
        if (a->value == NULL || !is_line(a->value, LONGEST_VALUE, 0x20, 0xff)) {
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

bool vshi_attributes_add(vshi_attributes *a, const char *name, const char *value) {
    if (vshi_make_room((void **)&a->list, a->count, &a->capacity, sizeof *a->list, "attributes", NULL) !=
        VSH_OK) {
        return false;
    }
    const size_t name_size = strlen(name) + 1, value_size = strlen(value) + 1;
    char *texts = malloc(name_size + value_size);
    if (texts == NULL) {
        return false;
    }
    memcpy(texts, name, name_size);
    memcpy(texts + name_size, value, value_size);
    vshi_one_line(texts);
    vshi_one_line(texts + name_size);
    a->list[a->count++] = (vsh_attribute){texts, texts + name_size};
    return true;
}

void vshi_attributes_free(vshi_attributes *a) {
    for (size_t i = 0; i < a->count; ++i) {
        free((void *)(uintptr_t)a->list[i].name); /* and the value behind it */
    }
    free(a->list);
    *a = (vshi_attributes){NULL, 0, 0};
}
