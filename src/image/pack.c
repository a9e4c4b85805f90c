/* "R=shadow.sun,G=ao,A=A": parts between commas, each a key, '=' and a channel or one of the numbers 0 and 1.
 */
#include "image/pack.h"

#include "image/picture.h"

#include <stdio.h>
#include <string.h>

const char *const vshi_pack_keys[VSHI_PACK_KEYS] = {"R", "G", "B", "A"};

static bool ends_value(char c) {
    return c == ',' || c == '\0';
}

/* The channel whose name stands at `value`, up to a comma or the end. Names may have commas in them, so the
 * longest one that fits is taken. -1: none. */
static int32_t find_channel(const char *value, const vsh_image *image, size_t *length) {
    int32_t found = -1;
    *length = 0;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        const size_t size = strlen(image->names[c]);
        if (size > *length && strncmp(value, image->names[c], size) == 0 && ends_value(value[size])) {
            found = c;
            *length = size;
        }
    }
    return found;
}

static int find_key(const char *part) {
    for (int key = 0; key < VSHI_PACK_KEYS; ++key) {
        if (part[0] == vshi_pack_keys[key][0] && part[1] == '=') {
            return key;
        }
    }
    return -1;
}

/* "shadow.sun, ao, A; 0 and 1 are constants". */
static void list_channels(const vsh_image *image, char *text, size_t capacity) {
    enum { ROOM = 48 };
    size_t used = 0;
    int32_t c = 0;
    for (; c < image->channel_count && used + strlen(image->names[c]) + ROOM < capacity; ++c) {
        used += (size_t)snprintf(text + used, capacity - used, "%s%s", c > 0 ? ", " : "", image->names[c]);
    }
    snprintf(text + used, capacity - used, "%s; 0 and 1 are constants",
             c < image->channel_count ? " and others" : "");
}

/* Reads the part at *text and moves behind it. */
static vsh_result parse_part(const char **text, const vsh_image *image, vshi_pack *pack, vsh_error *error) {
    const char *part = *text;
    const int part_length = (int)strcspn(part, ",");
    const int key = find_key(part);
    if (key < 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "pack: part '%.*s': expected R=, G=, B= or A= and a channel, 0 or 1", part_length,
                         part);
    }
    if (pack->entries[key].given) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "pack: part '%.*s': %s is given twice", part_length, part,
                         vshi_pack_keys[key]);
    }
    const char *value = part + 2;
    size_t length;
    vshi_pack_entry entry = {true, find_channel(value, image, &length), 0.0f};
    if (entry.channel < 0) {
        if ((value[0] != '0' && value[0] != '1') || !ends_value(value[1])) {
            char names[400];
            list_channels(image, names, sizeof names);
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "pack: part '%.*s': %s%.*s; there are %s",
                             part_length, part, part_length > 2 ? "no such channel: " : "nothing after '='",
                             part_length - 2, value, names);
        }
        entry.constant = value[0] == '1' ? 1.0f : 0.0f;
        length = 1;
    }
    pack->entries[key] = entry;
    *text = value + length;
    return VSH_OK;
}

vsh_result vshi_pack_parse(const char *text, const vsh_image *image, vshi_pack *pack, vsh_error *error) {
    *pack = (vshi_pack){0};
    if (text[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "pack: '' is empty: expected such as R=%s",
                         image->names[0]);
    }
    for (const char *at = text;; ++at) {
        const vsh_result result = parse_part(&at, image, pack, error);
        if (result != VSH_OK || *at == '\0') {
            return result;
        }
    }
}

void vsh_image_default_pack(const vsh_image *image, char *text, size_t capacity) {
    if (text == NULL || capacity == 0) {
        return;
    }
    text[0] = '\0';
    if (image == NULL || image->names == NULL) {
        return;
    }
    const char *colors[3] = {NULL, NULL, NULL};
    const char *alpha = NULL;
    int count = 0;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (image->names[c] == NULL) {
            continue;
        }
        if (strcmp(image->names[c], "A") == 0) {
            alpha = image->names[c];
        } else if (count < 3) {
            colors[count++] = image->names[c];
        }
    }
    vshi_picture picture;
    if (image->channel_count <= VSH_MAX_CHANNELS && vshi_picture_of(image, &picture) && picture.rgb[0] >= 0 &&
        picture.rgb[0] != picture.rgb[1]) { /* irradiance: a picture as it is */
        for (int c = 0; c < 3; ++c) {
            colors[c] = image->names[picture.rgb[c]];
        }
        count = 3;
    }
    if (count <= 1) {
        /* one alone is shown in grey; where there is coverage only, it is that one */
        const char *only = count == 1 ? colors[0] : alpha;
        colors[0] = colors[1] = colors[2] = only;
    }
    const char *const values[VSHI_PACK_KEYS] = {colors[0], colors[1], colors[2], alpha};
    size_t used = 0;
    for (int key = 0; key < VSHI_PACK_KEYS && used < capacity; ++key) {
        if (values[key] != NULL) {
            const int written = snprintf(text + used, capacity - used, "%s%s=%s", used > 0 ? "," : "",
                                         vshi_pack_keys[key], values[key]);
            used += written > 0 ? (size_t)written : 0;
        }
    }
}
