#include "json/locate.h"

typedef struct cursor {
    const char *text;
    size_t size;
    size_t at;
} cursor;

static int peek(const cursor *c) {
    return c->at < c->size ? (unsigned char)c->text[c->at] : -1;
}

static void skip_space(cursor *c) {
    while (peek(c) == ' ' || peek(c) == '\t' || peek(c) == '\n' || peek(c) == '\r') {
        ++c->at;
    }
}

static void skip_string(cursor *c) {
    ++c->at; /* the opening quote */
    while (peek(c) != -1 && peek(c) != '"') {
        c->at += peek(c) == '\\' ? 2 : 1;
    }
    c->at = c->at < c->size ? c->at + 1 : c->size;
}

/* Counts brackets instead of recursing, so that depth costs no stack. */
static void skip_value(cursor *c) {
    size_t open = 0;
    do {
        skip_space(c);
        const int first = peek(c);
        if (first == -1) {
            return;
        }
        if (first == '"') {
            skip_string(c);
        } else if (first == '{' || first == '[') {
            ++open;
            ++c->at;
        } else if (first == '}' || first == ']') {
            if (open == 0) {
                return;
            }
            --open;
            ++c->at;
        } else if (first == ',' || first == ':') {
            if (open == 0) {
                return;
            }
            ++c->at;
        } else {
            do { /* one at least, whatever it is */
                ++c->at;
            } while (peek(c) > ' ' && peek(c) != ',' && peek(c) != '}' && peek(c) != ']');
        }
    } while (open > 0);
}

/* Puts the cursor on child `ordinal` of the object or array it stands on, and *key on its key. */
static bool enter(cursor *c, size_t ordinal, size_t *key) {
    const bool object = peek(c) == '{';
    if (!object && peek(c) != '[') {
        return false;
    }
    ++c->at;
    for (size_t i = 0;; ++i) {
        skip_space(c);
        if (peek(c) == -1 || peek(c) == '}' || peek(c) == ']') {
            return false;
        }
        *key = c->at;
        if (object) {
            skip_string(c);
            skip_space(c);
            ++c->at; /* the colon */
            skip_space(c);
        }
        if (i == ordinal) {
            return true;
        }
        skip_value(c);
        skip_space(c);
        if (peek(c) == ',') {
            ++c->at;
        }
    }
}

vshi_place vshi_place_of(const char *text, size_t size, size_t at) {
    vshi_place place = {1, 1};
    for (size_t i = 0; i < at && i < size; ++i) {
        if (text[i] == '\n') {
            ++place.line;
            place.column = 1;
        } else if (((unsigned char)text[i] & 0xc0) != 0x80) { /* not inside a UTF-8 character */
            ++place.column;
        }
    }
    return place;
}

vshi_place vshi_locate(const char *text, size_t size, const size_t *ordinals, size_t depth, bool key) {
    cursor c = {text, size, 0};
    skip_space(&c);
    size_t found = c.at;
    for (size_t i = 0; i < depth; ++i) {
        size_t key_at = c.at;
        if (!enter(&c, ordinals[i], &key_at)) {
            break;
        }
        found = key && i + 1 == depth ? key_at : c.at;
    }
    return vshi_place_of(text, size, found);
}
