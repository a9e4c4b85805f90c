/* Values of options, read strictly. */
#include "message.h"
#include "options.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/image.h>

/* strtod() and strtoll() also take leading blanks. */
static bool starts_number(const char *text) {
    return *text != '\0' && strchr("+-.0123456789", *text) != NULL;
}

static bool read_number(const char *text, double *value, const char **rest) {
    char *end = NULL;
    if (!starts_number(text) || strpbrk(text, "xXpP") != NULL) {
        return false;
    }
    *value = strtod(text, &end);
    *rest = end;
    return end != text && isfinite(*value);
}

int cli_parse_number(const char *name, const char *text, double least, double most, double *value) {
    const char *rest;
    const bool good = read_number(text, value, &rest) && *rest == '\0' && *value >= least && *value <= most;
    return good ? CLI_OK : cli_usage("%s '%s': expected a number from %g to %g", name, text, least, most);
}

int cli_parse_positive(const char *name, const char *text, double *value) {
    const char *rest;
    const bool good = read_number(text, value, &rest) && *rest == '\0' && *value > 0.0;
    return good ? CLI_OK : cli_usage("%s '%s': expected a number greater than 0", name, text);
}

static bool read_integer(const char *text, int32_t *value, const char **rest) {
    if (!starts_number(text)) {
        return false;
    }
    char *end = NULL;
    errno = 0;
    const long long number = strtoll(text, &end, 10);
    *rest = end;
    if (end == text || errno != 0 || number < INT32_MIN || number > INT32_MAX) {
        return false;
    }
    *value = (int32_t)number;
    return true;
}

int cli_parse_integer(const char *name, const char *text, int32_t least, int32_t most, int32_t *value) {
    const char *rest;
    const bool good = read_integer(text, value, &rest) && *rest == '\0' && *value >= least && *value <= most;
    return good ? CLI_OK
                : cli_usage("%s '%s': expected a whole number from %d to %d", name, text, least, most);
}

int cli_parse_shard(const char *name, const char *text, int32_t *shard, int32_t *count) {
    enum { MOST = 10000 };
    const char *rest;
    if (!read_integer(text, shard, &rest) || *rest != '/' || !read_integer(rest + 1, count, &rest) ||
        *rest != '\0' || *shard < 1 || *shard > *count || *count > MOST) {
        return cli_usage("%s '%s': expected I/N, the part and how many there are, as 1/3; at most %d", name,
                         text, MOST);
    }
    return CLI_OK;
}

static bool read_numbers(const char *text, int count, double *value) {
    const char *at = text;
    bool good = true;
    for (int i = 0; i < count && good; ++i) {
        good = read_number(at, &value[i], &at) && *at == (i + 1 < count ? ',' : '\0');
        ++at;
    }
    return good;
}

int cli_parse_vector(const char *name, const char *text, double value[3]) {
    const bool good = read_numbers(text, 3, value) && (value[0] != 0.0 || value[1] != 0.0 || value[2] != 0.0);
    return good ? CLI_OK : cli_usage("%s '%s': expected X,Y,Z, three numbers that are not all 0", name, text);
}

int cli_parse_point(const char *name, const char *text, double value[3]) {
    return read_numbers(text, 3, value) ? CLI_OK
                                        : cli_usage("%s '%s': expected X,Y,Z, three numbers", name, text);
}

int cli_parse_color(const char *name, const char *text, double value[3]) {
    const bool good = read_numbers(text, 3, value) && value[0] >= 0.0 && value[1] >= 0.0 && value[2] >= 0.0;
    return good ? CLI_OK : cli_usage("%s '%s': expected R,G,B, three numbers from 0", name, text);
}

int cli_parse_box(const char *name, const char *text, double min[3], double max[3]) {
    double value[6] = {0.0};
    const bool good = read_numbers(text, 6, value);
    memcpy(min, value, 3 * sizeof *min);
    memcpy(max, value + 3, 3 * sizeof *max);
    if (!good || !(min[0] < max[0] && min[1] < max[1] && min[2] < max[2])) {
        return cli_usage(
            "%s '%s': expected X0,Y0,Z0,X1,Y1,Z1, the second corner above the first on every axis", name,
            text);
    }
    return CLI_OK;
}

int cli_parse_floor(const char *name, const char *text, double size[2], double center[3]) {
    double value[5] = {0.0};
    const bool good = read_numbers(text, 5, value) || read_numbers(text, 2, memset(value, 0, sizeof value));
    memcpy(size, value, 2 * sizeof *size);
    memcpy(center, value + 2, 3 * sizeof *center);
    if (!good || !(size[0] > 0.0 && size[0] <= 1e12 && size[1] > 0.0 && size[1] <= 1e12)) {
        return cli_usage(
            "%s '%s': expected W,D or W,D,X,Y,Z: its sizes along x and z, above 0, and its middle", name,
            text);
    }
    return CLI_OK;
}

int cli_parse_size(const char *name, const char *text, int32_t *w, int32_t *h) {
    const char *at;
    bool good = read_integer(text, w, &at);
    if (good && *at == 'x') {
        good = read_integer(at + 1, h, &at);
    } else {
        *h = *w;
    }
    if (!good || *at != '\0' || *w < 1 || *w > VSH_MAX_LIGHTMAP_SIZE || *h < 1 ||
        *h > VSH_MAX_LIGHTMAP_SIZE) {
        return cli_usage("%s '%s': expected W or WxH, each from 1 to %d texels", name, text,
                         VSH_MAX_LIGHTMAP_SIZE);
    }
    return CLI_OK;
}

int cli_parse_bytes(const char *name, const char *text, uint64_t *value) {
    static const struct {
        const char *suffix;
        double factor;
    } units[] = {{"", 1.0},       {"k", 1e3},      {"M", 1e6},     {"G", 1e9},
                 {"KiB", 0x1p10}, {"MiB", 0x1p20}, {"GiB", 0x1p30}};
    double number;
    const char *rest;
    if (read_number(text, &number, &rest) && number >= 0.0) {
        for (size_t i = 0; i < sizeof units / sizeof units[0]; ++i) {
            if (strcmp(rest, units[i].suffix) == 0 && number * units[i].factor < 0x1p62) {
                *value = (uint64_t)(number * units[i].factor);
                return CLI_OK;
            }
        }
    }
    return cli_usage("%s '%s': expected bytes, with k, M, G, KiB, MiB or GiB behind the number", name, text);
}

int cli_parse_name(const char *option, const char *text, int32_t kind, int32_t *value) {
    *value = vsh_find_name(kind, text);
    if (*value >= 0) {
        return CLI_OK;
    }
    char list[256] = "";
    size_t used = 0;
    const char *name;
    for (int32_t i = 0; (name = vsh_get_name(kind, i)) != NULL && used < sizeof list; ++i) {
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", i > 0 ? ", " : "", name);
    }
    return cli_usage("%s '%s': expected one of %s", option, text, list);
}
