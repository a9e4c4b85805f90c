/* Which channel goes into R, G, B and A of a file that cannot name channels. */
#ifndef VSHI_PACK_H
#define VSHI_PACK_H

#include "base/error.h"

#include <vdbshade/image.h>

#include <stdbool.h>

enum {
    VSHI_PACK_KEYS = 4,                                      /* R, G, B, A */
    VSHI_PACK_ALPHA = 3,                                     /* index of A */
    VSHI_PACK_TEXT = VSHI_PACK_KEYS * (VSH_CHANNEL_NAME + 3) /* holds every default packing */
};

/* Words instead of a pack: the named channels alone; the picture alone. */
#define VSHI_PACK_CHANNELS "channels"
#define VSHI_PACK_PICTURE "rgb"

typedef struct vshi_pack_entry {
    bool given;
    int32_t channel; /* index into the image; -1: `constant` */
    float constant;
} vshi_pack_entry;

typedef struct vshi_pack {
    vshi_pack_entry entries[VSHI_PACK_KEYS];
} vshi_pack;

extern const char *const vshi_pack_keys[VSHI_PACK_KEYS];

/* Errors: VSH_ERROR_ARGUMENT, naming the part of `text` that is wrong. */
vsh_result vshi_pack_parse(const char *text, const vsh_image *image, vshi_pack *pack, vsh_error *error);

#endif
