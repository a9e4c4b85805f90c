/* Reads MTL, the materials of an OBJ: their opacity, and the textures that mask them. */
#include "base/decimal.h"

#include "base/file.h"
#include "base/memory.h"
#include "io/model/obj.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <vdbshade/mesh.h>

static bool parse_number(vshi_token token, float *number) {
    return token.text != NULL && vshi_decimal_float(token.text, number) == token.text + token.size &&
           isfinite(*number);
}

/* Reads one to three numbers, u v w. The last word of the line is the file's name, even if it is a number. */
static bool read_numbers(const char **at, const char *end, double values[2]) {
    for (int i = 0; i < 3; ++i) {
        const char *next = *at, *rest;
        float number;
        const bool is_number = parse_number(vshi_scan_token(&next, end), &number);
        rest = next;
        if (!is_number || (i > 0 && vshi_scan_token(&rest, end).text == NULL)) {
            return i > 0;
        }
        if (i < 2) {
            values[i] = (double)number;
        }
        *at = next;
    }
    return true;
}

static bool read_channel(vshi_token value, int32_t *channel) {
    static const struct {
        const char *word;
        int32_t channel;
    } channels[] = {{"r", VSHI_MASK_CHANNEL_RED},
                    {"g", VSHI_MASK_CHANNEL_GREEN},
                    {"b", VSHI_MASK_CHANNEL_BLUE},
                    {"m", VSHI_MASK_CHANNEL_ALPHA},
                    {"l", VSHI_MASK_CHANNEL_LUMINANCE}};
    for (size_t i = 0; i < sizeof channels / sizeof channels[0]; ++i) {
        if (vshi_token_is(value, channels[i].word)) {
            *channel = channels[i].channel;
            return true;
        }
    }
    return false;
}

/* Reads the option `word`, whose values follow at *at. Returns false if it is unknown or incomplete. */
static bool read_option(vshi_token word, const char **at, const char *end, vshi_mtl_map *map) {
    static const struct {
        const char *word;
        int values;     /* -1: one to three numbers */
        bool supported; /* or harmless */
    } options[] = {{"-clamp", 1, true},  {"-imfchan", 1, true}, {"-o", -1, true},   {"-s", -1, true},
                   {"-blendu", 1, true}, {"-blendv", 1, true},  {"-cc", 1, true},   {"-texres", 1, true},
                   {"-bm", 1, true},     {"-boost", 1, true},   {"-type", 1, true}, {"-mm", 2, false},
                   {"-t", -1, false}};
    size_t i = 0;
    while (i < sizeof options / sizeof options[0] && !vshi_token_is(word, options[i].word)) {
        ++i;
    }
    if (i == sizeof options / sizeof options[0]) {
        return false;
    }
    double ignored[2];
    double *numbers = strcmp(options[i].word, "-o") == 0   ? map->offset
                      : strcmp(options[i].word, "-s") == 0 ? map->scale
                                                           : ignored;
    vshi_token value = {NULL, 0};
    bool complete = options[i].values > 0 || read_numbers(at, end, numbers), supported = options[i].supported;
    for (int k = 0; k < options[i].values && complete; ++k) {
        value = vshi_scan_token(at, end);
        complete = value.text != NULL;
    }
    if (vshi_token_is(word, "-clamp")) {
        map->clamp = vshi_token_is(value, "on");
    } else if (vshi_token_is(word, "-imfchan")) {
        supported = read_channel(value, &map->channel);
    }
    map->other = supported ? map->other : word;
    return complete;
}

static bool is_option(vshi_token word) {
    return word.size >= 2 && word.text[0] == '-' && word.text[1] >= 'a' && word.text[1] <= 'z';
}

bool vshi_mtl_map_read(const char *at, const char *end, vshi_mtl_map *map) {
    *map = (vshi_mtl_map){.channel = VSHI_MASK_CHANNEL_AUTO, .scale = {1.0, 1.0}};
    for (;;) {
        const char *next = at;
        const vshi_token word = vshi_scan_token(&next, end);
        if (!is_option(word)) {
            break;
        }
        if (!read_option(word, &next, end, map)) {
            map->other = word;
            return false;
        }
        at = next;
    }
    const vshi_token rest = vshi_scan_rest(at, end);
    map->name = rest.size > 0 ? rest : (vshi_token){NULL, 0};
    return true;
}

char *vshi_mtl_map_path(const char *path, vshi_token name) {
    char *text = vshi_path_beside(name.text[0] == '/' ? "" : path, name.text, name.size);
    struct stat status;
    if (text != NULL && stat(text, &status) != 0) {
        for (char *c = text + strlen(text) - strnlen(name.text, name.size); *c != '\0'; ++c) {
            *c = *c == '\\' ? '/' : *c;
        }
    }
    return text;
}

/* `d` is the opacity, Tr the transparency. "d -halo 0.5" is lower at the silhouette. */
static vsh_result read_opacity(const char *mtl, size_t line, vshi_token keyword, const char *at,
                               const char *end, double *opacity, vsh_error *error) {
    vshi_token value = vshi_scan_token(&at, end);
    if (vshi_token_is(value, "-halo")) {
        value = vshi_scan_token(&at, end);
    }
    if (value.text == NULL) {
        return VSH_OK;
    }
    float number;
    if (!parse_number(value, &number)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: line %zu: '%.*s' is '%.*s', expected a finite number",
                         mtl, line, VSHI_TOKEN_ARGS(keyword), VSHI_TOKEN_ARGS(value));
    }
    number = keyword.text[0] == 'd' ? number : 1.0F - number;
    *opacity = number < 0.0F ? 0.0 : number < 1.0F ? (double)number : 1.0;
    return VSH_OK;
}

/* Reads the mask of the current material. A texture that cannot be used gives a warning: the mesh is still
 * usable. */
static vsh_result read_map(vshi_obj *obj, const char *mtl, size_t line, const char *at, const char *end,
                           vsh_error *error) {
    enum { LONGEST = 1023 };
    vshi_obj_alpha *alpha = &obj->alphas[obj->material];
    vshi_mtl_map map;
    bool is_new;
    char option[64] = "";
    const bool good = vshi_mtl_map_read(at, end, &map), supported = map.other.text == NULL;
    if (!supported) {
        snprintf(option, sizeof option, "%.*s", VSHI_TOKEN_ARGS(map.other));
    }
    if (!good) {
        vshi_warn(
            obj->run,
            "%s: line %zu: 'map_d' has the option '%s', which is unknown or lacks its value; its mask is "
            "ignored",
            mtl, line, option);
        return VSH_OK;
    }
    if (map.name.text == NULL) {
        return VSH_OK;
    }
    if (!supported) {
        vshi_warn(obj->run, "%s: line %zu: 'map_d' is read without its option '%s'; apply it to the image",
                  mtl, line, option);
    }
    char *path = vshi_mtl_map_path(mtl, map.name);
    if (path == NULL) {
        return vshi_fail_memory(error, mtl);
    }
    vsh_result result = VSH_OK;
    if (strlen(path) > LONGEST || memchr(map.name.text, '\0', map.name.size) != NULL) {
        vshi_warn(obj->run, "%s: line %zu: 'map_d' names no file; its mask is ignored", mtl, line);
    } else if (obj->run->allow_outside == 0 && !vshi_input_is_beside(obj->path, path)) {
        vshi_warn(obj->run,
                  "%s: line %zu: 'map_d' names '%.400s' outside of the model's folder; its mask is ignored; "
                  "--allow-outside reads it",
                  mtl, line, path);
    } else {
        result =
            vshi_words_number(&obj->images, &obj->budget, path, strlen(path), &alpha->image, &is_new, error);
        alpha->image += result == VSH_OK;
        alpha->channel = map.channel;
        alpha->clamp = map.clamp;
        memcpy(alpha->offset, map.offset, sizeof alpha->offset);
        memcpy(alpha->scale, map.scale, sizeof alpha->scale);
    }
    free(path);
    return result;
}

static vsh_result read_line(vshi_obj *obj, const char *mtl, size_t line, const char *at, const char *end,
                            vsh_error *error) {
    static const char unnamed[] = "DefaultMaterial";
    const vshi_token keyword = vshi_scan_token(&at, end);
    if (vshi_token_is(keyword, "newmtl")) {
        bool is_new;
        const vshi_token name = vshi_scan_rest(at, end);
        VSHI_TRY(vshi_obj_material(obj, name.size > 0 ? name.text : unnamed,
                                   name.size > 0 ? name.size : sizeof unnamed - 1, &obj->material, &is_new,
                                   error));
        if (is_new && obj->mesh != SIZE_MAX) {
            obj->meshes[obj->mesh].material = obj->material;
        }
        return VSH_OK;
    }
    if (obj->material == SIZE_MAX) {
        return VSH_OK;
    }
    if (vshi_token_is(keyword, "map_d")) {
        return read_map(obj, mtl, line, at, end, error);
    }
    return vshi_token_is(keyword, "d") || vshi_token_is(keyword, "Tr")
               ? read_opacity(mtl, line, keyword, at, end, &obj->alphas[obj->material].opacity, error)
               : VSH_OK;
}

static vsh_result read_lines(vshi_obj *obj, vshi_text *text, vsh_error *error) {
    const char *at = text->bytes, *stop = at + text->size, *end;
    for (size_t line = 1; at < stop; ++line, at = end + 1) {
        end = memchr(at, '\n', (size_t)(stop - at));
        end = end != NULL ? end : stop;
        VSHI_TRY(vshi_text_poll(text, at, error));
        VSHI_TRY(read_line(obj, text->path, line, at, end, error));
    }
    return VSH_OK;
}

/* Reads a library if it is a regular file, which *found tells. */
static vsh_result read_file(vshi_obj *obj, const char *path, bool *found, vsh_error *error) {
    struct stat status;
    *found = stat(path, &status) == 0 && S_ISREG(status.st_mode);
    if (*found && obj->run->allow_outside == 0 && !vshi_input_is_beside(obj->path, path)) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: names the file '%s' outside of its folder, where nothing is read of a model; "
                         "--allow-outside (vsh_run.allow_outside) reads it",
                         obj->path, path);
    }
    if (!*found || status.st_size == 0) {
        return VSH_OK;
    }
    vshi_text text;
    vsh_result result = vshi_text_read(&text, path, path, &obj->budget, obj->job, 0, error);
    if (result == VSH_OK) {
        result = read_lines(obj, &text, error);
    } else if (result == VSH_ERROR_READ) {
        *found = false; /* as if it were missing */
        result = VSH_OK;
    }
    vshi_text_free(&text);
    return result;
}

char *vshi_obj_library(const char *path, int choice, const char *name, size_t size) {
    if (choice == 0) {
        return vshi_path_beside(path, name, size);
    }
    const char *own = vshi_path_name(path);
    char *library = vshi_path_beside(path, own, strlen(own));
    if (library != NULL) {
        memcpy(strrchr(library, '.') + 1, "mtl", sizeof "mtl");
    }
    return library;
}

vsh_result vshi_obj_read_materials(vshi_obj *obj, const char *text, size_t size, vsh_error *error) {
    enum { LONGEST_SHOWN = 400 };
    bool found = false;
    for (int choice = 0; choice < VSHI_OBJ_LIBRARIES && size > 0 && !found; ++choice) {
        char *path = vshi_obj_library(obj->path, choice, text, size);
        if (path == NULL) {
            return vshi_fail_memory(error, obj->path);
        }
        const vsh_result result = read_file(obj, path, &found, error);
        free(path);
        VSHI_TRY(result);
    }
    if (!found && size > 0) {
        vshi_warn(obj->run, "%s: the material library '%.*s' cannot be read: its materials are opaque",
                  obj->path, size < LONGEST_SHOWN ? (int)size : LONGEST_SHOWN, text);
    }
    return VSH_OK;
}
