#include "model/unsupported.h"

#include "base/file.h"
#include "base/input.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { HEAD = 512 };

static const char alembic[] = "an Alembic file", usd[] = "a USD file";
static const char blender[] = "Blender's own file; export it as GLB (File, Export, glTF 2.0)";

static const struct {
    const char *ending, *what;
} endings[] = {{"abc", alembic}, {"usd", usd},  {"usda", usd},
               {"usdc", usd},    {"usdz", usd}, {"blend", blender}};

static const struct {
    const char *bytes;
    size_t size;
    const char *what;
} beginnings[] = {
    {"Ogawa", 5, alembic}, {"\x89HDF\r\n\x1a\n", 8, alembic}, /* before 2013; no other format that meshes come
                                                                 in is HDF5 */
    {"#usda", 5, usd},     {"BLENDER-v", 9, blender},         {"BLENDER_v", 9, blender}, {"PXR-USDC", 8, usd},
};

/* A USDZ file is a Zip file whose first entry is a USD file. */
static bool is_usdz(const unsigned char *head, size_t size) {
    enum { NAME_SIZE = 26, NAME = 30 }; /* of the entry's header */
    if (size < NAME || memcmp(head, "PK\x03\x04", 4) != 0) {
        return false;
    }
    const size_t length = (size_t)head[NAME_SIZE] | (size_t)head[NAME_SIZE + 1] << 8;
    if (length < 5 || NAME + length > size) {
        return false;
    }
    const char *last = (const char *)head + NAME + length;
    return strncasecmp(last - 4, ".usd", 4) == 0 || strncasecmp(last - 5, ".usda", 5) == 0 ||
           strncasecmp(last - 5, ".usdc", 5) == 0;
}

static const char *by_content(const char *path) {
    unsigned char head[HEAD];
    FILE *file;
    uint64_t whole;
    vsh_error ignored; /* whoever reads the file finds out, too */
    vshi_input_open(path, path, UINT64_MAX, &file, &whole, &ignored);
    const size_t size = file != NULL ? fread(head, 1, sizeof head, file) : 0;
    if (file != NULL) {
        fclose(file);
    }
    for (size_t i = 0; i < sizeof beginnings / sizeof beginnings[0]; ++i) {
        if (size >= beginnings[i].size && memcmp(head, beginnings[i].bytes, beginnings[i].size) == 0) {
            return beginnings[i].what;
        }
    }
    return is_usdz(head, size) ? usd : NULL;
}

vsh_result vshi_unsupported_check(const char *path, vsh_error *error) {
    const char *what = by_content(path);
    const char *ending = vshi_path_ending(path);
    for (size_t i = 0; what == NULL && i < sizeof endings / sizeof endings[0]; ++i) {
        what = strcasecmp(ending, endings[i].ending) == 0 ? endings[i].what : NULL;
    }
    return what == NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: is %s, which is not read: " VSHI_FORMATS, path, what);
}
