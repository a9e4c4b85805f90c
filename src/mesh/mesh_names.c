/* Meshes chosen by their names, as a shell matches those of files. Not fnmatch(3): that depends on the
 * locale, and takes exponential time for some patterns. */
#include <vdbshade/mesh.h>

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* Behind the UTF-8 character at `text`. */
static const char *next_character(const char *text) {
    for (++text; ((unsigned char)*text & 0xc0) == 0x80; ++text) {
    }
    return text;
}

/* Behind the "]" of the set that `pattern` is in, with whether the byte is one of it; NULL: no set, as
 * nothing closes it. "[!…]" is one of all others, "[a-z]" one of a range. */
static const char *match_set(const char *pattern, char byte, bool *found) {
    const unsigned char c = (unsigned char)byte;
    const bool others = *pattern == '!' || *pattern == '^';
    bool in = false;
    const char *at = pattern + others;
    for (const char *first = at; *at != ']' || at == first; ++at) {
        if (*at == '\0') {
            return NULL;
        }
        const unsigned char low = (unsigned char)*at;
        if (at[1] == '-' && at[2] != ']' && at[2] != '\0') {
            at += 2;
        }
        in = in || (low <= c && c <= (unsigned char)*at);
    }
    *found = in != others;
    return at + 1;
}

/* One step that is no "*": moves both on, or tells that they differ. */
static bool match_one(const char **pattern, const char **text) {
    const char *p = *pattern;
    bool found = false;
    const char *end = *p == '[' ? match_set(p + 1, **text, &found) : NULL;
    if (end != NULL) {
        *pattern = end;
        *text += 1;
        return found;
    }
    if (*p == '?') {
        *pattern = p + 1;
        *text = next_character(*text);
        return true;
    }
    p += *p == '\\' && p[1] != '\0';
    *pattern = p + 1;
    return *p == *(*text)++;
}

/* Only the last "*" is ever gone back to: what the ones before it took is as good as any (Krauss, "Matching
 * wildcards", 2008). */
static bool glob(const char *pattern, const char *text) {
    const char *star = NULL, *resume = NULL;
    while (*text != '\0') {
        if (*pattern == '*') {
            star = ++pattern;
            resume = text;
        } else if (*pattern == '\0' || !match_one(&pattern, &text)) {
            if (star == NULL) {
                return false;
            }
            pattern = star;
            text = ++resume;
        }
    }
    while (*pattern == '*') {
        ++pattern;
    }
    return *pattern == '\0';
}

/* A name with brackets in it is to be found by itself, too. */
static bool matches(const char *name, const char *pattern) {
    return strcmp(name, pattern) == 0 || glob(pattern, name);
}

int32_t vsh_mesh_matches(const vsh_mesh *mesh, const char *pattern) {
    if (mesh == NULL || pattern == NULL) {
        return 0;
    }
    static const char of_material[] = "material:";
    enum { OF_MATERIAL = sizeof of_material - 1 };
    if (strncmp(pattern, of_material, OF_MATERIAL) == 0) {
        return mesh->material_name != NULL && matches(mesh->material_name, pattern + OF_MATERIAL);
    }
    const char *name = mesh->name, *object = mesh->object_name;
    if (name == NULL && object == NULL) {
        return matches("", pattern); /* as messages call it */
    }
    if ((name != NULL && matches(name, pattern)) || (object != NULL && matches(object, pattern))) {
        return 1;
    }
    const size_t length = object != NULL ? strlen(object) : 0;
    return name != NULL && length > 0 && strncmp(name, object, length) == 0 && name[length] == '/' &&
           matches(name + length + 1, pattern);
}
