#include "model/mtl_map.h"

#include "base/decimal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <vdbshade/mesh.h>

static bool take_number(const char **at, const char *end, double *value) {
    const vshi_token token = vshi_scan_token(at, end);
    float number;
    if (token.text == NULL || vshi_token_number(token) != VSHI_NUMBER_FINITE ||
        vshi_decimal_float(token.text, &number) != token.text + token.size || !isfinite(number)) {
        return false;
    }
    *value = (double)number;
    return true;
}

/* One to three numbers, u v w; but the last word of the line is the file's name, whatever it is. */
static bool take_numbers(const char **at, const char *end, double values[2]) {
    if (!take_number(at, end, &values[0])) {
        return false;
    }
    for (int i = 1; i < 3; ++i) {
        const char *next = *at, *behind;
        double number;
        const bool is = take_number(&next, end, &number);
        behind = next;
        if (!is || vshi_scan_token(&behind, end).text == NULL) {
            break;
        }
        if (i < 2) {
            values[i] = number;
        }
        *at = next;
    }
    return true;
}

static bool take_channel(vshi_token value, int32_t *channel) {
    static const struct {
        const char *word;
        int32_t channel;
    } channels[] = {{"r", VSH_MASK_CHANNEL_RED},
                    {"g", VSH_MASK_CHANNEL_GREEN},
                    {"b", VSH_MASK_CHANNEL_BLUE},
                    {"m", VSH_MASK_CHANNEL_ALPHA},
                    {"l", VSH_MASK_CHANNEL_LUMINANCE}};
    for (size_t i = 0; i < sizeof channels / sizeof channels[0]; ++i) {
        if (vshi_token_is(value, channels[i].word)) {
            *channel = channels[i].channel;
            return true;
        }
    }
    return false;
}

/* The option `word`, whose values follow at *at. */
static bool take_option(vshi_token word, const char **at, const char *end, vshi_mtl_map *map) {
    static const struct {
        const char *word;
        int values; /* -1: one to three numbers */
        bool passed_over;
    } others[] = {{"-blendu", 1, true}, {"-blendv", 1, true}, {"-cc", 1, true},
                  {"-texres", 1, true}, {"-bm", 1, true},     {"-boost", 1, true},
                  {"-type", 1, true},   {"-mm", 2, false},    {"-t", -1, false}};
    if (vshi_token_is(word, "-clamp")) {
        const vshi_token value = vshi_scan_token(at, end);
        map->clamp = vshi_token_is(value, "on");
        return value.text != NULL;
    }
    if (vshi_token_is(word, "-imfchan")) {
        const vshi_token value = vshi_scan_token(at, end);
        map->other = take_channel(value, &map->channel) ? map->other : word;
        return value.text != NULL;
    }
    if (vshi_token_is(word, "-o") || vshi_token_is(word, "-s")) {
        return take_numbers(at, end, word.text[1] == 'o' ? map->offset : map->scale);
    }
    for (size_t i = 0; i < sizeof others / sizeof others[0]; ++i) {
        if (!vshi_token_is(word, others[i].word)) {
            continue;
        }
        double ignored[2];
        bool there = others[i].values > 0 || take_numbers(at, end, ignored);
        for (int k = 0; k < others[i].values && there; ++k) {
            there = vshi_scan_token(at, end).text != NULL;
        }
        map->other = others[i].passed_over ? map->other : word;
        return there;
    }
    return false;
}

static bool is_option(vshi_token word) {
    return word.size >= 2 && word.text[0] == '-' && word.text[1] >= 'a' && word.text[1] <= 'z';
}

bool vshi_mtl_map_read(const char *at, const char *end, vshi_mtl_map *map) {
    *map = (vshi_mtl_map){.channel = VSH_MASK_CHANNEL_AUTO, .scale = {1.0, 1.0}};
    for (;;) {
        const char *next = at;
        const vshi_token word = vshi_scan_token(&next, end);
        if (!is_option(word)) {
            break;
        }
        if (!take_option(word, &next, end, map)) {
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
    const char *slash = strrchr(path, '/');
    const size_t folder = slash != NULL && name.text[0] != '/' ? (size_t)(slash - path) + 1 : 0;
    char *text = malloc(folder + name.size + 1);
    struct stat status;
    if (text == NULL) {
        return NULL;
    }
    memcpy(text, path, folder);
    memcpy(text + folder, name.text, name.size);
    text[folder + name.size] = '\0';
    if (stat(text, &status) != 0) {
        for (char *c = text + folder; *c != '\0'; ++c) {
            *c = *c == '\\' ? '/' : *c;
        }
    }
    return text;
}
